//! Small differences through an impact: neighbours meet the wall earlier or later, by the saltation matrix.
//!
//! ```text
//! dt = -dg / g'⁻,     dq = dq⁻ + q'⁻ dt,   dw = dw⁻ + a⁻ dt       at the wall;      w⁺ = I(t, q, w⁻)
//! dq⁺ = dq - q'⁺ dt,      dw⁺ = dI(dt, dq, dw) - a⁺ dt                     a⁺ with what is held from then on
//! ```
//!
//! Source: P. C. Müller, *Calculation of Lyapunov exponents for dynamic systems with discontinuities*, Chaos,
//! Solitons & Fractals 5 (1995).

use super::Tangent;
use crate::dynamics::constraint::Posture;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Coordinates, Mechanism, Motion};
use crate::run::contact::{Jump, check_alone};
use std::sync::Arc;

/// Normal velocity over that of the point's parts below which a wall is grazed, and neighbours may miss it.
const GRAZED: f64 = 1e-7;
/// Difference the impact's derivative is taken from, over the size of what it changes.
const DIFFERENCE: f64 = 1e-6;

/// What is on both sides of an impact, in plain doubles.
struct Side {
    phi: Vec<f64>,
    omega: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Side {
    fn new(mechanism: &Mechanism, motion: &Motion) -> Self {
        let [phi, omega] =
            [&motion.phi, &motion.omega].map(|all| all.iter().map(|x| x.hi).collect::<Vec<_>>());
        let mut kernel = Kernel::<f64>::new(mechanism);
        kernel.accelerate::<0>(mechanism, motion.time, &phi, &omega, Bias::default());
        Self { acceleration: kernel.load, phi, omega }
    }
}

impl Tangent {
    /// Takes impacts, holds and releases on the way to [`Tangent::next`], in their order.
    pub(in crate::run) fn jump(&mut self, jumps: &[Jump]) {
        for jumps in jumps.chunk_by(|one, other| one.before.time == other.before.time) {
            self.jump_at_once(jumps);
        }
    }

    /// Takes those of one moment.
    fn jump_at_once(&mut self, jumps: &[Jump]) {
        let ([first, ..], [.., last]) = (jumps, jumps) else { return };
        self.advance(first.before.time, None, 0.0);
        if self.path.lost.is_some() {
            return;
        }
        let n = self.mechanism.coordinates();
        let mut all: Vec<Vec<f64>> =
            self.path.columns.iter().chain(&self.path.inputs).map(|column| self.spread(column)).collect();
        if let Err(why) = cross(&self.mechanism, jumps, &mut all) {
            return self.lose(&why);
        }
        if !Arc::ptr_eq(&last.mechanism, &self.mechanism) {
            match Self::bare(&last.mechanism) {
                Ok(other) => *self = Self { path: std::mem::take(&mut self.path), ..other },
                Err(why) => return self.lose(&why),
            }
            self.path.held.clone_from(&self.mechanism.held);
        }
        if self.coordinates == Coordinates::Independent {
            let own = &self.mechanism.partition.independent;
            for column in &mut all {
                *column = own.iter().map(|&k| column[k]).chain(own.iter().map(|&k| column[n + k])).collect();
            }
        }
        let inputs = all.split_off(self.path.columns.len());
        (self.path.columns, self.path.inputs) = (all, inputs);
        self.path.state = self.problem.state(&last.after);
        self.make_room();
        self.keep();
        self.evaluate();
        if self.normalise() {
            self.prepare();
        }
    }
}

/// Takes columns of all coordinates and rates through what happens at one moment to a mechanism with the
/// contacts held before it.
///
/// What is held or let go with an impact comes earlier or later with it; what is held is put on its wall
/// afterwards.
///
/// # Errors
/// Why neighbours do not go the same way.
fn cross(mechanism: &Mechanism, jumps: &[Jump], columns: &mut [Vec<f64>]) -> Result<(), String> {
    let Some((contact, struck)) = jumps.iter().find_map(|jump| Some((jump.contact?, jump))) else {
        return Ok(());
    };
    check_alone(jumps)?;
    let n = mechanism.coordinates();
    let here = Side::new(mechanism, &struck.before);
    let there = jumps.last().map(|last| Side::new(&last.mechanism, &last.after));
    let Some(there) = there else { return Ok(()) };
    let touched = &mechanism.contacts[contact];
    let mut gradient = vec![0.0; n];
    let z = mechanism.elements(&here.phi);
    let at = touched.row.linearise(
        struck.before.time,
        Posture { phi: &here.phi, z: &z, omega: &here.omega },
        &mut gradient,
    );
    let approach = dot(&gradient, &here.omega) + at.drive;
    if approach >= -GRAZED * touched.step_size(&here.omega) {
        return Err("a point grazes a wall, which neighbouring motions may miss".into());
    }
    for column in columns {
        let late = -dot(&gradient, &column[..n]) / approach;
        for k in 0..n {
            column[k] += late * here.omega[k];
            column[n + k] += late * here.acceleration[k];
        }
        for jump in jumps {
            if let Some(contact) = jump.contact {
                impact_at(jump, contact, late, column)?;
            }
        }
        for k in 0..n {
            column[k] -= late * there.omega[k];
            column[n + k] -= late * there.acceleration[k];
        }
    }
    Ok(())
}

/// The derivative of an impact, along a column and `late` \[s\], by differences.
fn impact_at(jump: &Jump, contact: usize, late: f64, column: &mut [f64]) -> Result<(), String> {
    let n = column.len() / 2;
    let [phi, omega] =
        [&jump.before.phi, &jump.before.omega].map(|all| all.iter().map(|x| x.hi).collect::<Vec<_>>());
    let size = |of: &[f64], from: &[f64]| {
        of.iter().zip(from).fold(0.0, |most: f64, (x, y)| most.max(x.abs() / (1.0 + y.abs())))
    };
    let most = size(&column[..n], &phi).max(size(&column[n..], &omega));
    if most == 0.0 {
        return Ok(());
    }
    let small = DIFFERENCE / most;
    let beside = |sign: f64| {
        let moved = |from: &[f64], by: &[f64]| {
            from.iter().zip(by).map(|(x, y)| x + sign * small * y).collect::<Vec<_>>()
        };
        let t = jump.before.time + sign * small * late;
        jump.mechanism.impact_at(contact, t, &moved(&phi, &column[..n]), &moved(&omega, &column[n..]))
    };
    let (Some(ahead), Some(behind)) = (beside(1.0), beside(-1.0)) else {
        return Err("neighbouring motions have no way back from a wall".into());
    };
    for (k, entry) in column[n..].iter_mut().enumerate() {
        *entry = (ahead.omega[k] - behind.omega[k]) / (2.0 * small);
    }
    Ok(())
}
