//! The constant matrices of the hinge trees.

use super::{Body, CompileError, DENSE_LIMIT, Mechanism};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::Motion;
use crate::dynamics::constraint::{ConstraintArguments, ConstraintEquation};
use crate::dynamics::forest::{BodyOrigin, Forest};
use crate::dynamics::kernel::Kernel;
use crate::dynamics::tree::Tree;
use crate::scene::Scene;

/// H, d and the weights.
pub(super) fn constants(bodies: &[Body], forest: &Forest, gravity: Complex<f64>) -> Tree {
    if forest.coordinates > DENSE_LIMIT {
        return long_constants(bodies, forest, gravity);
    }
    dense_constants(bodies, forest, gravity)
}

/// The same with H.
pub(in crate::dynamics) fn dense_constants<C: Real>(
    bodies: &[Body<C>],
    forest: &Forest<C>,
    gravity: Complex<C>,
) -> Tree<C> {
    let n = forest.coordinates;
    let mut coupling = vec![Complex::ZERO; n * n];
    let mut diagonal: Vec<C> = bodies.iter().map(|body| body.inertia).collect();
    diagonal.resize(n, C::ZERO);
    let mut weight = vec![Complex::ZERO; n];
    for (k, body) in bodies.iter().enumerate() {
        let centre = forest.walk(k, body.centre);
        let carried = centre.shifts.iter().map(|&(x, share)| (x, Complex::new(C::of(share), C::ZERO)));
        let terms: Vec<_> = centre.terms.iter().copied().chain(carried).collect();
        for (place, &(i, gamma)) in terms.iter().enumerate() {
            diagonal[i] += body.mass * gamma.norm_squared();
            weight[i] += (gamma.conj() * gravity).times(body.mass);
            for &(j, other) in &terms[place + 1..] {
                coupling[i * n + j] += (gamma.conj() * other).times(body.mass);
            }
        }
    }
    let off_axis = coupling.iter().any(|h| h.im != C::ZERO);
    Tree { coordinates: n, angles: bodies.len(), coupling, diagonal, weight, off_axis }
}

/// d and the weights, from what hangs on each body; no H.
fn long_constants(bodies: &[Body], forest: &Forest, gravity: Complex<f64>) -> Tree {
    let n = forest.coordinates;
    let (mut diagonal, mut weight) = (vec![0.0; n], vec![Complex::ZERO; n]);
    // Mass of each body and of all that hangs on it.
    let mut carried: Vec<f64> = bodies.iter().map(|body| body.mass).collect();
    let mut off_axis = false;
    for &k in forest.order.iter().rev() {
        let Body { mass, inertia, centre, .. } = bodies[k];
        diagonal[k] += inertia + mass * centre.norm_squared();
        weight[k] += (centre.conj() * gravity).times(mass);
        off_axis |= centre.im != 0.0;
        match forest.hangs[k].origin_point {
            BodyOrigin::Ground(_) => {}
            BodyOrigin::On(parent, hinge) => {
                diagonal[parent] += carried[k] * hinge.norm_squared();
                weight[parent] += (hinge.conj() * gravity).times(carried[k]);
                carried[parent] += carried[k];
                off_axis |= hinge.im != 0.0;
            }
            BodyOrigin::Free(x) => (diagonal[x], weight[x]) = (carried[k], gravity.times(carried[k])),
        }
    }
    Tree { coordinates: n, angles: bodies.len(), coupling: Vec::new(), diagonal, weight, off_axis }
}

/// Configurations that are tried besides the start: so much of a turn, or metres, from it.
const SHIFTS: [f64; 3] = [0.0, 0.3, 1.1];
/// Slope of a constraint that counts as none.
const NO_SLOPE: f64 = 1e-12;

impl Mechanism {
    /// A motor whose law is the angle or the travel that it drives asks for nothing.
    pub(super) fn check_aims(&self, start: &Motion) -> Result<(), CompileError> {
        let [phi, omega] = start.rounded();
        let mut z = vec![Complex::ZERO; phi.len()];
        let mut depends = |row: &ConstraintEquation, shift: f64| {
            let shifted = |(k, phi): (usize, &f64)| phi + shift * (1.0 + 0.62 * k as f64).fract().max(0.1);
            let phi: Vec<f64> = phi.iter().enumerate().map(shifted).collect();
            let mut jacobian = vec![0.0; phi.len()];
            self.tree.unit_vectors::<f64, 0>(&phi, &mut z);
            row.linearise(start.time, ConstraintArguments { phi: &phi, z: &z, omega: &omega }, &mut jacobian);
            // What is not a number may depend on anything.
            !jacobian.iter().all(|slope| slope.abs() <= NO_SLOPE)
        };
        let mut driven = self.constraints.iter().filter(|row| row.aim.is_some());
        match driven.find(|row| !SHIFTS.iter().any(|&shift| depends(row, shift))) {
            Some(row) => Err(CompileError::DrivesNothing(row.name.clone())),
            None => Ok(()),
        }
    }

    /// The mass matrix at the start must be positive definite.
    pub(super) fn check_mass(&self, scene: &Scene) -> Result<(), CompileError> {
        let start = self.start(scene);
        let [phi, _] = start.rounded();
        let mut kernel = Kernel::<f64>::new(self);
        kernel.unit_vectors::<0>(self, &phi);
        kernel.mass_matrix::<0>(self);
        kernel.factor::<0>(self, &vec![0.0; phi.len()]);
        let singular = |&k: &usize| {
            // Not a number counts as singular.
            let sound = 1.0 / (kernel.pivot[k] * self.tree.diagonal[k]) > 1e-13;
            !sound
        };
        // Dividing by a pivot of zero spoils those after it: a body with nothing to turn is told first.
        let is_still = |&k: &usize| self.tree.diagonal[k] == 0.0;
        let bodies = 0..self.bodies.len();
        match bodies.clone().find(is_still).or_else(|| bodies.rev().find(singular)) {
            Some(k) => Err(CompileError::Massless(self.bodies[k].name.clone())),
            None => Ok(()),
        }
    }
}
