//! A window as the crate calls it.

use super::super::interruption;
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::dynamics::Time;
use std::cell::RefCell;

/// Rows in which less than this part of the window's time passes end it: the crate goes to and fro at a
/// singularity, which may be one of a law that the motion has left before.
const STALLED: (u64, f64) = (1000, 1e-3);

/// Writes y' at (t, y), of a field of any type: the crate's methods are compiled once for each number of
/// unknowns, and not for each field.
pub type Rates<'a> = dyn FnMut(Time, &[f64], &mut [f64]) + 'a;

/// The field as the crate calls it: unknowns of the field, then the time since the window's start, all over
/// their units.
pub struct Window<'a> {
    rates: RefCell<&'a mut Rates<'a>>,
    start: Time,
    n: usize,
    /// The units of the unknowns and of time, and room for the unknowns.
    unit: &'a [f64],
    time_unit: f64,
    y: RefCell<Vec<f64>>,
    /// Rows that may still be kept.
    rows: usize,
    /// True where it goes on to its end in any case.
    finishes: bool,
    /// Rows made, and the time of the last one that was looked at.
    made: u64,
    mark: f64,
}

impl<'a> Window<'a> {
    /// A window from a time on, in these units of the unknowns and of time \[s\], that may keep so many rows;
    /// unless it `finishes`, it ends where the process is asked to stop.
    pub fn new(
        rates: &'a mut Rates<'a>,
        start: Time,
        (unit, time_unit): (&'a [f64], f64),
        rows: usize,
        finishes: bool,
    ) -> Self {
        let (n, rates) = (unit.len(), RefCell::new(rates));
        let y = RefCell::new(vec![0.0; n]);
        Self { rates, start, n, unit, time_unit, y, rows, finishes, made: 0, mark: 0.0 }
    }

    /// The rate of scaled unknowns and time.
    pub fn rate(&self, y: &[f64], rate: &mut [f64]) {
        let mut unknowns = self.y.borrow_mut();
        unknowns.iter_mut().zip(y).zip(self.unit).for_each(|((unknown, y), unit)| *unknown = y * unit);
        let time = self.start + DoubleDouble::of(y[self.n] * self.time_unit);
        (self.rates.borrow_mut())(time, &unknowns, &mut rate[..self.n]);
        rate.iter_mut().zip(self.unit).for_each(|(rate, unit)| *rate = *rate * self.time_unit / unit);
        rate[self.n] = 1.0;
    }

    /// Counts a row; true where it was the last that may be kept, time hardly passes, or nobody waits for
    /// more.
    pub fn is_full(&mut self, y: &[f64]) -> bool {
        self.rows = self.rows.saturating_sub(1);
        self.made += 1;
        let mut is_stalled = false;
        if self.made.is_multiple_of(STALLED.0) {
            let time = y[self.n];
            is_stalled = time - self.mark < STALLED.1 * time;
            self.mark = time;
        }
        self.rows == 0 || is_stalled || !self.finishes && interruption::is_asked()
    }
}
