//! Event functions that nothing bounds, as gaps of walls with a law: known by their values alone, they are
//! interpolated at Chebyshev points.
//!
//! A law may be faster than the motion: a step is halved until interpolants resolve the functions, and made
//! anew to end where they have not yet.

use super::{FirstEvent, SearchScratch};
use crate::dynamics::{OdeSystem, State};
use crate::stepping::search::{Chebyshev, Crossing, crossing, interpolated, oscillates};

/// Degrees of interpolants.
const DEGREES: [usize; 4] = [8, 16, 32, 64];
/// Halvings of a step in which they do not suffice.
const HALVINGS: u32 = 6;
/// Share of its largest value that such an interpolant may be off.
const RESOLVED: f64 = 1e-10;
/// What the least magnitude is at least over what an interpolant may be off where the function has no zero,
/// and what it is off over its spread, or its spread over the least magnitude, for that to be told by so few
/// values.
const CLEAR: f64 = 10.0;
const SURE: f64 = 1e-3;
const FLAT: f64 = 1.0 / 30.0;
/// Size of gaps, in their lengths, whose oscillations are looked at: those of smaller ones may be rounding.
const OSCILLATING: f64 = 1e-4;

/// True where an interpolant is as good as the function, or the function has no zero.
fn is_enough(curve: &Chebyshev) -> bool {
    let (tail, least, spread) = (curve.tail(), curve.least(), curve.spread());
    let is_clear = least > CLEAR * tail && (tail <= SURE * spread || spread <= FLAT * least);
    tail <= RESOLVED * curve.most() || is_clear
}

impl SearchScratch {
    /// The first of the events whose functions are known by their values alone, or what was found before.
    pub(super) fn opaquely<F: OdeSystem + ?Sized>(
        &mut self,
        field: &mut F,
        state: &State,
        h: f64,
        mut found: FirstEvent,
    ) -> FirstEvent {
        let Self { dense, room, gaps, opaque, .. } = self;
        gaps.resize(field.events(), 0.0);
        let [y, slope] = room.get_mut();
        let mut at = |share: f64, row: &mut Vec<f64>| {
            dense.at(share, y, slope);
            field.gaps(state.time + share * h, y, gaps);
            row.extend(opaque.iter().map(|&event| gaps[event]));
        };
        let mut parts = vec![(0.0, 1.0, 0)];
        while let Some((begin, span, depth)) = parts.pop() {
            if begin >= found.end(1.0) {
                break;
            }
            let looked_at = interpolated(
                &DEGREES,
                |share, row| at(begin + share * span, row),
                |_, curve, _| is_enough(curve),
            );
            let curves = &looked_at.curves;
            let is_finite = curves.iter().all(|curve| curve.most().is_finite());
            if is_finite && !looked_at.is_resolved {
                if depth < HALVINGS {
                    let half = 0.5 * span;
                    parts.extend([(begin + half, half, depth + 1), (begin, half, depth + 1)]);
                    continue;
                }
                let is_fast = |(curve, values): (&Chebyshev, &Vec<f64>)| {
                    !is_enough(curve) && oscillates(values, curve.most().max(OSCILLATING))
                };
                if curves.iter().zip(&looked_at.values).any(is_fast) {
                    return FirstEvent::Near(if begin > 0.0 { begin } else { span });
                }
            }
            for (curve, &event) in curves.iter().zip(&*opaque) {
                let end = ((found.end(1.0) - begin) / span).min(1.0);
                match crossing(curve, end) {
                    Crossing::At(share) => found = FirstEvent::At(event, begin + share * span),
                    Crossing::Inside(share) => found = FirstEvent::Inside(begin + share * span),
                    Crossing::Nothing => {}
                }
            }
        }
        found
    }
}
