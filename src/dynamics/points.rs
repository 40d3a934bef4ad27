//! Points at which a field is evaluated together: the stages of one implicit step, one a lane.

use super::Time;
use crate::arithmetic::eight::{LANES, Octet};

/// Eight points of d unknowns and the rates there; the lanes of one unknown lie side by side.
#[derive(Clone, Debug, Default)]
pub struct Points {
    /// Which lanes count; the others hold points nobody asks about.
    pub used: [bool; LANES],
    /// Times \[s\].
    pub time: [Time; LANES],
    /// Unknowns (d).
    pub y: Vec<Octet>,
    /// What they leave out (d).
    pub low: Vec<Octet>,
    /// Rates (d).
    pub rate: Vec<Octet>,
    /// What they leave out (d), where asked for.
    pub rate_low: Vec<Octet>,
    /// One point and its rate (d, d), for fields that take one at a time.
    pub single: [Vec<f64>; 2],
}

impl Points {
    /// Room for `dimension` unknowns; allocates only where that changes.
    pub fn resize(&mut self, dimension: usize) {
        for octets in [&mut self.y, &mut self.low, &mut self.rate, &mut self.rate_low] {
            octets.resize(dimension, Octet::default());
        }
        for single in &mut self.single {
            single.resize(dimension, 0.0);
        }
    }

    /// Rates at the points in use, one by one.
    pub fn each(&mut self, mut rate: impl FnMut(Time, &[f64], &mut [f64])) {
        let [point, slope] = &mut self.single;
        for lane in (0..LANES).filter(|&lane| self.used[lane]) {
            for (point, y) in point.iter_mut().zip(&self.y) {
                *point = y.0[lane];
            }
            rate(self.time[lane], point, slope);
            for (rate, &slope) in self.rate.iter_mut().zip(slope.iter()) {
                rate.0[lane] = slope;
            }
        }
    }
}
