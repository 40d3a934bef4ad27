//! How many rows a run writes, and how many are too many.

use super::{MAX_ROWS, Request, RequestRefusal, mismatch, usage};
use crate::arithmetic::shown::{count, plain};
use crate::dynamics::Mechanism;

/// Most numbers of a trajectory that a scene asks for by itself: about a gigabyte.
const MOST_NUMBERS: f64 = 5e7;

/// Output rows after the first; the last may come early.
pub(super) fn rows(until: f64, every: f64) -> f64 {
    (until / every * (1.0 - 1e-12)).ceil().max(1.0)
}

/// The same, not more than a run may write, nor than a scene may ask for by itself.
pub(super) fn checked_rows(
    mechanism: &Mechanism,
    request: &Request,
    until: f64,
    every: f64,
) -> Result<f64, RequestRefusal> {
    let rows = rows(until, every);
    let interval = || format!("an output interval of {} s up to {} s", plain(every), plain(until));
    if rows > MAX_ROWS {
        let reason = format!("{} rows would be written; at most {MAX_ROWS:e}", count(rows));
        return Err(match request.every {
            Some(_) => usage("--every", reason, "a longer output interval"),
            None => {
                mismatch(format!("every: {}", interval()), &reason, "a longer every in the scene, or --every")
            }
        });
    }
    let numbers = rows * (5 + 6 * mechanism.bodies.len() + 4 * mechanism.constraints.len()) as f64;
    if request.every.is_none() && numbers > MOST_NUMBERS {
        let size = (numbers * 2e-8).ceil();
        let reason = format!("the trajectory would hold {} numbers, about {size:.0} GB", count(numbers));
        let alternative = format!("a longer --every, or --every {every} if that is meant");
        return Err(mismatch(interval(), &reason, &alternative));
    }
    Ok(rows)
}
