//! The second half of a substep: positions settled, elements turned, rates put onto the constraints.

use super::super::newton::project;
use super::{KEPT, SubstepFailure, SubstepScratch, plain, rows};
use crate::arithmetic::{Complex, Real};
use crate::dynamics::constraint::RowMeasure;
use crate::dynamics::natural::{Natural, times, upper};
use crate::dynamics::tree::size;
use crate::dynamics::{schur, tree};
use std::f64::consts::FRAC_PI_2;

impl SubstepScratch {
    /// One more iteration, with the constraints formed from pairs.  Sweeps in plain doubles leave lengths
    /// wrong by some 1e-22 with a preferred sign, and a length that is always too short is a steady loss of
    /// energy.
    #[inline(always)]
    pub(super) fn settle<const N: usize, const GUIDED: bool>(
        &mut self,
        natural: &Natural,
        h: f64,
    ) -> Result<(), SubstepFailure> {
        let (n, bodies) = (size::<N>(self.z.len()), self.bodies::<N, GUIDED>());
        let rows = rows::<N, GUIDED>(self.change.len());
        let (predicted, change) = (&self.predicted[..n], &mut self.change[..rows]);
        let per_push = 2.0 / (h * h);
        for k in 0..bodies {
            change[k] = 0.5 * (predicted[k].norm_squared() + -1.0).hi * per_push;
        }
        if GUIDED {
            for (r, guide) in natural.guides().iter().enumerate() {
                change[bodies + r] = guide.value(&self.demand[r], predicted).hi * per_push;
            }
            self.coupled_residuals(natural, 0.0, per_push);
        }
        let change = &mut self.change[..rows];
        for (row, change) in change.iter().enumerate() {
            let is_kept = change.abs() <= KEPT * per_push * self.unit[row];
            if !is_kept {
                return Err(SubstepFailure::NotConverged(row));
            }
        }
        if GUIDED {
            self.newton.solve::<0>(change);
        } else {
            self.newton.solve::<N>(change);
        }
        let (acceleration, minv_jt) = (&mut self.acceleration[..n], &self.minv_jt[..rows * n]);
        acceleration.fill(Complex::ZERO);
        for p in 0..rows {
            self.multiplier[p] += change[p];
            for k in 0..n {
                acceleration[k] -= minv_jt[p * n + k].times(change[p]);
            }
        }
        self.kick::<N, true>(h);
        Ok(())
    }

    /// Arrives at `predicted`, `h` \[s\] later, and counts turns; refuses the root on the far side of the
    /// circle.
    #[inline(always)]
    pub(super) fn turn<const N: usize, const GUIDED: bool>(
        &mut self,
        natural: &Natural,
        h: f64,
    ) -> Result<(), SubstepFailure> {
        let (n, bodies) = (size::<N>(self.z.len()), self.bodies::<N, GUIDED>());
        let (z, predicted, here, turns) =
            (&mut self.z[..n], &self.predicted[..n], &mut self.here[..n], &mut self.turns[..bodies]);
        for k in 0..bodies {
            let (before, after) = (z[k], predicted[k]);
            (z[k], here[k]) = (after, plain(after));
            let old = plain(before);
            if old.dot(here[k]) <= 0.0 {
                return Err(SubstepFailure::TooFar(k));
            }
            if upper(before) != upper(after) {
                turns[k] = turns[k].saturating_add(match (upper(after), old.cross(here[k]) > 0.0) {
                    (false, true) => 1,
                    (true, false) => -1,
                    _ => 0,
                });
            }
        }
        for k in bodies..n {
            (z[k], here[k]) = (predicted[k], plain(predicted[k]));
        }
        if GUIDED {
            for (r, guide) in natural.guides().iter().enumerate() {
                let demand = &self.plain_demand[r];
                // Whole turns that an angle is asked to make within a substep are seen by nobody.
                let leaps =
                    matches!(guide.measure, RowMeasure::Angle { .. }) && (demand.rate * h).abs() >= FRAC_PI_2;
                if leaps || guide.mismatch(demand, here).re <= 0.0 {
                    return Err(SubstepFailure::TooFar(bodies + r));
                }
            }
        }
        Ok(())
    }

    /// Forces, gradients and columns W g at z and the time last asked about.
    #[inline(always)]
    pub(super) fn unit_vectors<const N: usize, const GUIDED: bool>(&mut self, natural: &Natural) {
        let (n, bodies) = (size::<N>(self.z.len()), self.bodies::<N, GUIDED>());
        let rows = rows::<N, GUIDED>(self.change.len());
        for k in 0..n {
            self.here[k] = plain(self.z[k]);
        }
        natural.force(&self.here[..n], &mut self.force[..n]);
        let (here, force, free) = (&self.here[..n], &self.force[..n], &mut self.free[..n]);
        let (w, minv_jt) = (&natural.reduced().inverse[..n * n], &mut self.minv_jt[..rows * n]);
        self.strength = 0.0;
        for i in 0..n {
            let unit = if i < bodies { 1.0 } else { self.length };
            self.strength = self.strength.max(force[i].re.abs() * unit).max(force[i].im.abs() * unit);
            let mut sum = Complex::ZERO;
            for j in 0..n {
                sum += times(&w[i * n + j], force[j]);
            }
            for j in 0..bodies {
                minv_jt[j * n + i] = times(&w[i * n + j], here[j]);
            }
            free[i] = sum;
        }
        if GUIDED {
            self.guide_gradients(natural);
            for (r, guide) in natural.guides().iter().enumerate() {
                self.drive[r] = guide.drive(&self.plain_demand[r], &self.here);
                let gradient = &self.gradient[r * n..(r + 1) * n];
                for (minv_jt, w) in self.minv_jt[(bodies + r) * n..(bodies + r + 1) * n]
                    .iter_mut()
                    .zip(natural.reduced().inverse.chunks(n))
                {
                    *minv_jt = w.iter().zip(gradient).fold(Complex::ZERO, |sum, (w, &g)| sum + times(w, g));
                }
            }
            self.coupled_drives(natural);
        }
    }

    /// Finds mu' such that v½ + h/2 a(mu') keeps the constraints' rates.
    #[inline(always)]
    pub(super) fn solve_velocity<const N: usize, const GUIDED: bool>(
        &mut self,
        natural: &Natural,
        h: f64,
    ) -> Result<(), SubstepFailure> {
        let (n, bodies) = (size::<N>(self.z.len()), self.bodies::<N, GUIDED>());
        let rows = rows::<N, GUIDED>(self.change.len());
        project(n, bodies, rows, &self.here, &self.gradient, &self.minv_jt, &mut self.schur[..rows * rows]);
        let (z, v, here, free) = (&self.z[..n], &self.v[..n], &self.here[..n], &self.free[..n]);
        if let Some(failure) = self.lost() {
            return Err(failure);
        }
        // z1·v½ = h/2 |v½|², because both ends of the step lie on the circle; but not to the last bit where
        // linear rows were put back on the way.
        let is_direct = natural.reduced().rows.is_empty();
        for k in 0..bodies {
            let swing =
                if is_direct { plain(v[k]).norm_squared() } else { z[k].dot(v[k]).value() * (2.0 / h) };
            self.multiplier[k] = here[k].dot(free[k]) + swing;
        }
        if GUIDED {
            for (r, guide) in natural.guides().iter().enumerate() {
                let demand = &self.demand[r];
                let slip = guide.slip(demand, z, v) + guide.drive(demand, z);
                let gradient = &self.gradient[r * n..(r + 1) * n];
                let direct: f64 = gradient.iter().zip(free).map(|(gradient, free)| gradient.dot(*free)).sum();
                self.multiplier[bodies + r] = direct + slip.value() * (2.0 / h);
            }
            self.coupled_rates(natural, 2.0 / h);
        }
        let (multiplier, schur, pivot) = (&mut self.multiplier[..rows], &mut self.schur, &mut self.pivot);
        if GUIDED {
            schur::factor::<f64, 0>(rows, schur, pivot, &self.scales);
            tree::solve::<f64, 0>(rows, schur, pivot, multiplier);
        } else {
            schur::factor::<f64, N>(rows, schur, pivot, &self.scales);
            tree::solve::<f64, N>(rows, schur, pivot, multiplier);
        }
        self.accelerate::<N, GUIDED>();
        Ok(())
    }
}
