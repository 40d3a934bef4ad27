//! Singular positions: where all links lie in line the rows lose their independence, and a step must not end near it.
//!
//! Off the constraints the equations have a pole at the distance d of the singular position, and rounding off the constraints grows as 1/d: a step size rule
//! that heeds the pole ends ever closer to it, until noise sends the motion out on another branch, smoothly.  So a step that begins near such
//! a position goes through: the share of the weakest row ([`schur`](crate::dynamics::schur)) is followed along the low powers of the series to its
//! minimum and on to where it is what it was, and the step ends there.  The series itself is that of a smooth motion; its late powers are
//! noise times d^-k, so that it is summed to its smallest power only.

use super::expansion::Expansion;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::schur::NEAR;
use crate::dynamics::series::Coefficient;
use crate::dynamics::{Coordinates, Form, State};

/// Powers the way through is looked for with.
const LOW: usize = 8;
/// Points it is looked for at, and the longest way over the step wanted.
const POINTS: usize = 96;
const LONGEST: f64 = 12.0;
/// On a way through a singular position the share falls below this part of what it was; elsewhere it is small for other reasons, and the step is as any.
const FALL: f64 = 0.1;
/// Largest share of the motion that the smallest power in such a step may have.
const NOISE: f64 = 1e-6;

/// How long a step must be to go through a singular position and come out as far from it as it is now; `None` where there is none ahead.
pub fn length<T: Coefficient, P: Form + ?Sized>(
    problem: &P,
    expansion: &Expansion<T>,
    kernel: &mut Option<Kernel<f64>>,
    state: &State,
    wanted: f64,
) -> Option<f64> {
    let here = expansion.series().weakest().share;
    if here >= NEAR || problem.coordinates() != Coordinates::All {
        return None;
    }
    let mechanism = problem.mechanism();
    let kernel = kernel.get_or_insert_with(|| Kernel::new(mechanism));
    let (series, n) = (expansion.series(), mechanism.coordinates());
    let mut phi = vec![0.0; n];
    let mut share = |h: f64| {
        for (i, phi) in phi.iter_mut().enumerate() {
            let rates = (0..LOW.min(series.order())).rev().map(|m| series.rate[m * n + i].value() / (m + 1) as f64);
            *phi = state.y[i] + h * rates.fold(0.0, |sum, rate| sum * h + rate);
        }
        kernel.linearise_at::<0>(mechanism, state.time, &phi, &state.y[n..2 * n]);
        kernel.weakest.share
    };
    // From well inside the step on: what comes back sooner needs no jump.
    let (mut least, mut fell) = (here, false);
    for point in 1..=POINTS {
        let h = LONGEST * wanted * (point as f64 / POINTS as f64);
        let now = share(h);
        if now.is_nan() {
            return None;
        }
        if now < least {
            (least, fell) = (now, true);
        } else if fell && now >= here {
            return (h > wanted && least < FALL * here && expansion.smallest(h) < NOISE).then_some(h);
        } else if !fell && now > here {
            return None;
        }
    }
    None
}
