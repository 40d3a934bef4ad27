//! A whole motion as a function of time: Chebyshev interpolants of the dense output of every step.

use super::observer::{Observer, Step};
use super::running::Outcome;
use super::sample::Sample;
use crate::dynamics::{Motion, Time};
use crate::stepping::search::{Chebyshev, Curve, Interpolants, interpolated};
use std::ops::ControlFlow;

/// Degrees of the interpolants, and what their last coefficients may be over their largest value.
const DEGREES: [usize; 3] = [8, 16, 24];
const RESOLVED: f64 = 1e-14;
/// Below this share of the largest value, last coefficients that [stay](Chebyshev::stays) with twice the
/// degree are what the dense output of an explicit pair is off beside the steps that take its place where it
/// is not exact enough: neither a higher degree nor halves have less.
const NOISE: f64 = 1e-4;
/// Halvings of a step that no interpolant resolves.
const HALVINGS: u32 = 4;

/// A run and its motion at every time.
///
/// ```
/// use driftless::{MethodId, Simulation, read_scene};
///
/// # fn main() -> Result<(), driftless::Error> {
/// let scene = read_scene("examples/scenes/motor.json".as_ref(), &[])?;
/// let trajectory = Simulation::new(&scene)?.until(2.0).method(MethodId::Taylor).trajectory()?;
/// let (phi, omega) = trajectory.at(1.234_567).expect("a time within the run");
/// // The motor turns the first bar at one turn a second.
/// assert!((phi[0] - std::f64::consts::TAU * (1.234_567 + 0.25)).abs() < 1e-11);
/// assert!((omega[0] - std::f64::consts::TAU).abs() < 1e-11);
/// assert!(trajectory.at(2.5).is_none());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// How the run ended.
    pub outcome: Outcome,
    pieces: Vec<Piece>,
}

/// The motion in a part of a step.
#[derive(Clone, Debug)]
struct Piece {
    begin: f64,
    end: f64,
    /// Winding angles and positions, then rates.
    curves: Vec<Chebyshev>,
}

/// Keeps the motion of a run: an [`Observer`] of its steps.
#[derive(Debug, Default)]
pub struct Recorder {
    pieces: Vec<Piece>,
}

impl Recorder {
    /// The motion it has seen, and how the run ended.
    pub fn into_trajectory(self, outcome: Outcome) -> Trajectory {
        Trajectory { outcome, pieces: self.pieces }
    }

    fn record(&mut self, step: &mut Step, begin: Time, span: f64, depth: u32) {
        let at = |share: f64, row: &mut Vec<f64>| row.extend(values(step.at_time(begin + share * span)));
        let Interpolants { curves, is_resolved, .. } = interpolated(&DEGREES, at, is_enough);
        if depth < HALVINGS && !is_resolved {
            self.record(step, begin, 0.5 * span, depth + 1);
            return self.record(step, begin + 0.5 * span, 0.5 * span, depth + 1);
        }
        self.pieces.push(Piece { begin: begin.hi, end: (begin + span).hi, curves });
    }
}

fn is_enough(_: usize, curve: &Chebyshev, lower: Option<&Chebyshev>) -> bool {
    let (tail, most) = (curve.tail(), curve.most());
    tail <= RESOLVED * most || tail <= NOISE * most && curve.stays(lower) || !most.is_finite()
}

/// Winding angles and positions, then rates.
fn values(motion: &Motion) -> Vec<f64> {
    (0..motion.phi.len())
        .map(|k| motion.unwrapped(k))
        .chain(motion.omega.iter().map(|omega| omega.hi))
        .collect()
}

impl Observer for Recorder {
    fn step(&mut self, step: &mut Step) -> ControlFlow<()> {
        let (begin, span) = step.span();
        if span > 0.0 {
            self.record(step, begin, span, 0);
        }
        ControlFlow::Continue(())
    }

    fn sample(&mut self, _sample: &Sample) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl Trajectory {
    /// Winding angles of all bodies \[rad\] with the positions of floating ones \[m\], and their rates
    /// \[rad/s, m/s\], at a time \[s\] within the run; `None` outside of it.  Exact to the dense output of
    /// the method; at an impact the motion after it.
    pub fn at(&self, t: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let place = self.pieces.partition_point(|piece| piece.begin <= t).checked_sub(1)?;
        let piece = self.pieces.get(place).filter(|piece| t <= piece.end && t <= self.outcome.last.t)?;
        let share = (t - piece.begin) / (piece.end - piece.begin);
        let mut phi: Vec<f64> = piece.curves.iter().map(|curve| curve.at(share)[0]).collect();
        let omega = phi.split_off(phi.len() / 2);
        Some((phi, omega))
    }

    /// The times at which its pieces begin \[s\]: the method's steps, or parts of them.
    pub fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.pieces.iter().map(|piece| piece.begin)
    }
}
