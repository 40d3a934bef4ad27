//! Singular positions on the way: a motion goes through them, motions of neighbouring loops do not.
//!
//! Where all links of a loop lie in line, as a parallelogram or a kite does, links that are a little longer
//! or shorter no longer reach that position, or no longer leave it on the same branch.  Numbers that enter
//! the constraints have no derivative from there on; starts, masses and forces have.

use super::neighbours::{Neighbour, residuals};
use super::variation::{Variation, plain};
use crate::dynamics::kernel::Kernel;
use crate::dynamics::schur::NEAR;
use crate::run::observer::Step;
use crate::stepping::search::golden_sections;
use std::convert::Infallible;

/// Share of the weakest constraint, about the square of the distance, below which a position is singular.
const SINGULAR: f64 = 1e-10;
/// Places of a step at which that share is looked for, and golden sections beside the least one.
const PLACES: usize = 32;
const ROUNDS: usize = 60;

impl Variation {
    /// When a step up to `end` \[s\] goes through a singular position that a number changes, and the column
    /// of that number.
    pub(super) fn singular_passage(&self, step: &mut Step, end: f64) -> Option<(f64, usize)> {
        let has_effect = self.neighbours.iter().flatten().any(|neighbours| !neighbours.levels.is_empty());
        if self.mechanism.constraints.is_empty() || !has_effect {
            return None;
        }
        let (begin, mut kernel) = (step.begin(), Kernel::new(&self.mechanism));
        let mut least = (f64::INFINITY, begin);
        let mut verdict = |time: f64| {
            let (t, phi, omega) = plain(step.at(time));
            kernel.independence_at(&self.mechanism, t, &phi, &omega)
        };
        let first = verdict(begin);
        let mut share = |time: f64| {
            let share = verdict(time).share_since(&first);
            if share < least.0 {
                least = (share, time);
            }
            share
        };
        if share(begin) >= NEAR {
            return None;
        }
        let span = (end - begin) / PLACES as f64;
        let shares: Vec<f64> = (0..=PLACES).map(|place| share(begin + place as f64 * span)).collect();
        let place = (0..=PLACES).min_by(|&a, &b| shares[a].total_cmp(&shares[b]))? as f64;
        let bracket = [(place - 1.0).max(0.0), (place + 1.0).min(PLACES as f64)];
        let at = |place: f64| Ok::<f64, Infallible>(share(begin + place * span));
        let Ok(()) = golden_sections(at, bracket, ROUNDS);
        let (share, time) = least;
        if share.is_nan() || share > SINGULAR {
            return None;
        }
        self.moving_loops(step, begin).map(|column| (time, column))
    }

    /// A column whose number moves constraints other than those that motors move, at a time of a step.
    fn moving_loops(&self, step: &mut Step, time: f64) -> Option<usize> {
        let (t, phi, omega) = plain(step.at(time));
        let is_loop: Vec<bool> = self.mechanism.constraints.iter().map(|row| !row.is_motor()).collect();
        (0..self.columns.len()).find(|&k| {
            let Some(mut neighbours) = self.neighbours[k].clone() else { return false };
            let least = neighbours.floor * self.mechanism.units.time;
            let of = |neighbour: &mut Neighbour| residuals(&neighbour.mechanism, t, &phi, &omega).0;
            let moved = neighbours.derivative(of).unwrap_or_default();
            moved.iter().zip(&is_loop).any(|(moved, is_loop)| *is_loop && moved.abs() > least)
        })
    }

    /// Ends the columns at such a passage.
    pub(super) fn lose_at_passage(&mut self, (time, column): (f64, usize)) {
        let name = self.names.get(column).map_or("a number of the loops", String::as_str);
        let why = "beyond a singular position, which neighbouring mechanisms do not go through";
        self.now = time;
        self.lose(&format!("no derivative by {name} {why}"));
    }
}
