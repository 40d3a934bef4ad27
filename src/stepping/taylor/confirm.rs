//! Whether a step of the series agrees with the equations inside it.
//!
//! Laws with exponentials, hyperbolic tangents or quotients may be flat to the last digit where a step
//! begins and change within it: the powers that would say so are lost in rounding, and the step wanted is
//! longer than the circle in which the series converges.  Roots nearly have corners where their argument is
//! nearly zero, and angles jump, which no power tells of either; and fractional powers that begin at zero
//! have no series there, so that steps grow from one in which they hardly act.  The accelerations of the
//! series are therefore compared with those of the equations at a few times inside the step, which is
//! shortened until they agree.
//! (Griewank & Walther,
//! *Evaluating Derivatives*, 2nd ed. (2008), section 13.2, on the defect of a Taylor polynomial.)

use super::Taylor;
use crate::dynamics::series::Coefficient;
use crate::dynamics::{Form, OdeSystem, State};

/// Times inside a step, in shares of it; not equally spaced, so that they do not beat with a period.
const SHARES: [f64; 4] = [0.23, 0.52, 0.79, 1.0];
/// Share of the largest acceleration that rounding may leave.
const ROUNDING: f64 = 1e-9;
/// Differences in accelerations that a step's tolerance stands for, over the step.
const ALLOWED: f64 = 1e3;
/// The part of it beside fractional powers: about zero they differ most at the end of a step, by what the
/// motion is off as well.
const ALLOWED_OF_POWERS: f64 = 1e-3;
/// Shortenings at most; each by a third.  So many lead up to a jump as near as rounding lets them.
const MOST: usize = 80;

/// Accelerations by the series, and by the equations at the place the series comes to \[rad/s², m/s²\].
pub(super) type Accelerations = [Vec<f64>; 2];

/// Of the step `h` \[s\] as much as the equations confirm; `look` writes the accelerations at a time inside.
pub(super) fn confirmed(
    tolerance: f64,
    mut h: f64,
    both: &mut Accelerations,
    mut look: impl FnMut(f64, &mut Accelerations),
) -> f64 {
    for _ in 0..MOST {
        let agrees = SHARES.iter().all(|share| {
            look(share * h, both);
            let [series, equations] = &*both;
            let largest = equations.iter().fold(0.0, |most: f64, a| most.max(a.abs()));
            let allowed = ALLOWED * tolerance / h + ROUNDING * largest;
            let differs = |(s, a): (&f64, &f64)| (s - a).abs() > allowed;
            // Where the equations have no finite answer the step is not judged.
            !largest.is_finite() || !series.iter().zip(equations).any(differs)
        });
        if agrees {
            break;
        }
        h *= 2.0 / 3.0;
    }
    h
}

impl<T: Coefficient> Taylor<T> {
    /// Of the step `h` \[s\] as much as the equations confirm.
    pub(super) fn confirmed<P: OdeSystem + Form + ?Sized>(
        &mut self,
        problem: &mut P,
        state: &State,
        h: f64,
    ) -> f64 {
        let Self { expansion: Some(expansion), inside, tolerance, .. } = self else { return h };
        let allowed = if problem.mechanism().has_powers_above_zero() { ALLOWED_OF_POWERS } else { 1.0 };
        let f = expansion.series().coordinates();
        let mut rates = vec![0.0; state.y.len()];
        let mut both = [Vec::new(), Vec::new()];
        confirmed(allowed * *tolerance, h, &mut both, |t, [series, equations]| {
            inside.clone_from(state);
            expansion.go(inside, t.into());
            inside.time = state.time + t;
            inside.wrap();
            problem.rhs(inside.time, &inside.y, &mut rates);
            equations.clear();
            equations.extend_from_slice(&rates[f..2 * f]);
            series.clear();
            series.extend((0..f).map(|i| expansion.acceleration(i, t)));
        })
    }
}
