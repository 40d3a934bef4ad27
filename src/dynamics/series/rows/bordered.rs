//! Rows that border the inverse of M_0, and the way back onto them, for numbers with a lane for each motion.
//!
//! ```text
//! K = S⁻¹,  B = M_0⁻¹ Jᵀ K,  A = M_0⁻¹ - B J M_0⁻¹;   c: what is known of the rows
//! a_m = A load_m - B c_m,   lambda_m = Bᵀ load_m + K c_m
//! positions:  S x = C,  q -= M_0⁻¹ Jᵀ x;   rates:  S x = J w + C_t,  w -= M_0⁻¹ Jᵀ x
//! ```
//!
//! One sum stands between an order and the next.  No row is ever left out: where that would be called for,
//! the numbers that come out are of no use, and whoever asks for them looks at the pivots first.
//!
//! All coordinates are free: the angles of the bodies, and the places of those that float.

// Iterators and closures are left out of these loops: they are not compiled into code for the vectors.

use super::{Kind, RowSeries, bent, in_force};
use crate::arithmetic::Complex;
use crate::dynamics::constraint::RowMeasure;
use crate::dynamics::partition::CoordinatePartition;
use crate::dynamics::series::order::rows_times;
use crate::dynamics::series::{SeriesNumber, Terms};
use crate::dynamics::tree;

impl<T: SeriesNumber> RowSeries<T> {
    /// Takes the constants of other rows of the same kinds.
    pub fn renew(&mut self, terms: &Terms<T::Constant>, partition: &CoordinatePartition<T::Constant>) {
        for (kind, row) in self.kinds.iter_mut().zip(in_force(terms.constraints, partition)) {
            match (kind, &row.measure) {
                (Kind::Place { place, law, aim, .. }, RowMeasure::Place(other)) => {
                    place.clone_from(other);
                    law.clone_from(&row.law);
                    if let (Some(aim), Some(other)) = (aim, &row.aim) {
                        aim.renew(other);
                    }
                }
                (Kind::Angle { law, .. }, _) => *law = row.law.clone().unwrap_or_default(),
                _ => {}
            }
        }
    }

    /// Number of rows in force.
    pub fn count(&self) -> usize {
        self.kinds.len()
    }

    /// J (r × f), and the reciprocal pivots of S.
    #[inline(always)]
    pub fn factors(&self) -> [&[T]; 2] {
        [&self.jacobian, &self.pivot]
    }

    /// Power 0 of the rate of a row's law, or of its aim where nothing moves \[rad/s, m/s\].
    #[inline(always)]
    fn drive(&self, row: usize) -> T {
        match &self.kinds[row] {
            Kind::Place { drive, law: Some(_), .. } | Kind::Angle { drive, .. } => drive[0],
            Kind::Place { aim: Some(aim), .. } => match aim.drive() {
                Some(drive) => drive[0],
                None => T::ZERO,
            },
            Kind::Place { .. } => T::ZERO,
        }
    }

    /// The coordinates whose magnitudes a row's rounding grows with.
    #[inline(always)]
    pub fn growing(&self, row: usize) -> &[usize] {
        &self.growing[row]
    }

    /// J at the elements `z`, and where aims are.
    #[inline(always)]
    pub fn linearise(&mut self, z: &[Complex<T>]) {
        let f = self.coordinates;
        self.jacobian.fill(T::ZERO);
        for (i, kind) in self.kinds.iter().enumerate() {
            let row = &mut self.jacobian[i * f..(i + 1) * f];
            match kind {
                Kind::Place { place, aim, .. } => {
                    for &(k, g) in &place.linear {
                        add_slope(row, place.angles, k, z, Complex::of(g));
                    }
                    for &(j, k, h) in &place.bilinear {
                        add_slope(row, place.angles, k, z, z[j].turn(h.conj()));
                        add_slope(row, place.angles, j, z, z[k].turn(h));
                    }
                    if let Some(aim) = aim {
                        aim.take_slopes_off(row);
                    }
                }
                Kind::Angle { body, base, .. } => {
                    row[*body] += T::ONE;
                    if let Some(base) = base {
                        row[*base] -= T::ONE;
                    }
                }
            }
        }
    }

    /// J, M_0⁻¹ Jᵀ and the factors of S, from those of M_0.
    #[inline(always)]
    pub fn factor(&mut self, z: &[Complex<T>], mass: &[T], pivot: &[T]) {
        self.linearise(z);
        let (r, f) = (self.kinds.len(), self.coordinates);
        self.minv_jt.copy_from_slice(&self.jacobian);
        for i in 0..r {
            tree::solve::<T, 0>(f, mass, pivot, &mut self.minv_jt[i * f..(i + 1) * f]);
        }
        for i in 0..r {
            for j in i..r {
                let jacobian = &self.jacobian[i * f..(i + 1) * f];
                let minv_jt = &self.minv_jt[j * f..(j + 1) * f];
                let mut sum = T::ZERO;
                for c in 0..f {
                    sum = sum.with_product(jacobian[c], minv_jt[c], true);
                }
                self.schur[i * r + j] = sum;
            }
        }
        tree::factor::<T, 0>(r, &mut self.schur, &mut self.pivot);
    }

    /// Borders M_0⁻¹ (f × f) with the rows just factored.
    #[inline(always)]
    pub fn border_inverse(&mut self, inverse: &[T]) {
        let (r, f) = (self.kinds.len(), self.coordinates);
        let size = r + f;
        for s in 0..r {
            // Column s of K, and with it of B.
            let column = &mut self.right[..r];
            column.fill(T::ZERO);
            column[s] = T::ONE;
            tree::solve::<T, 0>(r, &self.schur, &self.pivot, column);
            for c in 0..f {
                let mut sum = T::ZERO;
                for i in 0..r {
                    sum = sum.with_product(self.minv_jt[i * f + c], column[i], true);
                }
                self.border[(f + s) * size + c] = sum;
                self.border[c * size + f + s] = -sum;
            }
            for i in 0..r {
                self.border[(f + i) * size + f + s] = self.right[i];
            }
        }
        for c in 0..f {
            for d in c..f {
                let mut sum = inverse[c * f + d];
                for s in 0..r {
                    sum = sum.with_product(self.border[c * size + f + s], self.minv_jt[s * f + d], true);
                }
                self.border[c * size + d] = sum;
                self.border[d * size + c] = sum;
            }
        }
    }

    /// Multipliers of power m from the loads of the coordinates, which become their accelerations.
    #[inline(always)]
    pub fn solve_bordered(&mut self, m: usize, z: &[Complex<T>], bend: &[Complex<T>], solution: &mut [T]) {
        let (r, f) = (self.kinds.len(), self.coordinates);
        let (size, solution) = (r + f, &mut solution[..f]);
        let right = &mut self.right[..size];
        right[..f].copy_from_slice(solution);
        for (i, kind) in self.kinds.iter().enumerate() {
            right[f + i] = match kind {
                Kind::Place { place, drive, law, aim } => {
                    let mut known = bent(place, m, z, bend);
                    if let Some(aim) = aim {
                        known -= aim.known;
                    }
                    if law.is_some() { known - drive[m + 1].scale((m + 1) as f64) } else { known }
                }
                Kind::Angle { drive, .. } => -drive[m + 1].scale((m + 1) as f64),
            };
        }
        let found = &mut self.found[..size];
        rows_times(&self.border, right, found);
        solution.copy_from_slice(&found[..f]);
        self.multiplier[m * r..(m + 1) * r].copy_from_slice(&found[f..]);
    }

    /// Power m of the power of the rows that do work \[W/s^m\].
    #[inline(always)]
    pub(super) fn power_of_motors(&mut self, m: usize, omega: &[T]) -> T {
        let (r, mut power) = (self.kinds.len(), T::ZERO);
        for (i, kind) in self.kinds.iter_mut().enumerate() {
            if !self.works[i] {
                continue;
            }
            let rates = match kind {
                Kind::Angle { body, base, speed, .. } => {
                    speed[m] = omega[*body];
                    if let Some(base) = base {
                        speed[m] -= omega[*base];
                    }
                    &speed[..=m]
                }
                Kind::Place { drive, law: Some(_), .. } => &drive[..=m],
                Kind::Place { aim, .. } => match aim.as_ref().and_then(|aim| aim.drive()) {
                    // Its other powers are zero where there is but one.
                    Some(drive) => &drive[..drive.len().min(m + 1)],
                    None => &[],
                },
            };
            let mut sum = T::ZERO;
            for j in m + 1 - rates.len()..=m {
                sum = sum.with_product(self.multiplier[j * r + i], rates[m - j], true);
            }
            power -= sum;
        }
        power
    }

    /// Finds where the laws' rows are to be at a time, for [`violations`](Self::violations).
    pub fn face(&mut self, t: T::Time) {
        self.goals.clear();
        for kind in &self.kinds {
            self.goals.push(match kind {
                Kind::Place { law: Some(law), .. } => Complex::new(T::law_value(law, t), T::ZERO),
                Kind::Place { .. } => Complex::ZERO,
                Kind::Angle { law, .. } => T::phase(law, t).unit,
            });
        }
    }

    /// How far the rows are off their laws and aims at elements `z`, an angle by its sine's series up to the
    /// fifth power \[m, rad\].
    #[inline(always)]
    pub fn violations(&mut self, z: &[Complex<T>]) {
        for (i, kind) in self.kinds.iter().enumerate() {
            self.right[i] = match kind {
                Kind::Place { place, aim, .. } => {
                    let mut sum = T::constant(place.constant) - self.goals[i].re;
                    if let Some(aim) = aim {
                        sum -= aim.value();
                    }
                    for &(k, g) in &place.linear {
                        sum += Complex::of(g).dot(z[k]);
                    }
                    for &(j, k, h) in &place.bilinear {
                        sum += z[j].dot(z[k].turn(h));
                    }
                    sum
                }
                Kind::Angle { body, base, .. } => {
                    let facing = match base {
                        Some(base) => z[*body] * z[*base].conj(),
                        None => z[*body],
                    };
                    let sine = self.goals[i].cross(facing);
                    let square = sine * sine;
                    sine + sine * square * (T::of(1.0 / 6.0) + square.scale(3.0 / 40.0))
                }
            };
        }
    }

    /// What was found of a row.
    #[inline(always)]
    pub fn off(&self, row: usize) -> T {
        self.right[row]
    }

    /// How fast they go off at rates `omega`, with the J at hand \[m/s, rad/s\].
    #[inline(always)]
    pub fn slips(&mut self, omega: &[T]) -> &[T] {
        let (r, f) = (self.kinds.len(), self.coordinates);
        for i in 0..r {
            let jacobian = &self.jacobian[i * f..(i + 1) * f];
            let mut sum = -self.drive(i);
            for c in 0..f {
                sum = sum.with_product(jacobian[c], omega[c], true);
            }
            self.right[i] = sum;
        }
        &self.right[..r]
    }

    /// What has to be taken off the coordinates for the violations or slips found last.
    #[inline(always)]
    pub fn way_back(&mut self) -> &[T] {
        let (r, f) = (self.kinds.len(), self.coordinates);
        let (x, way) = self.right.split_at_mut(r);
        tree::solve::<T, 0>(r, &self.schur, &self.pivot, x);
        for c in 0..f {
            let mut sum = T::ZERO;
            for i in 0..r {
                sum = sum.with_product(self.minv_jt[i * f + c], x[i], true);
            }
            way[c] = sum;
        }
        &way[..f]
    }
}

/// Adds to a row of J what a gradient on element `k` makes of it.
#[inline(always)]
fn add_slope<T: SeriesNumber>(
    row: &mut [T],
    angles: usize,
    k: usize,
    z: &[Complex<T>],
    gradient: Complex<T>,
) {
    if k < angles {
        row[k] += z[k].cross(gradient);
    } else {
        row[k] += gradient.re;
        row[k + 1] += gradient.im;
    }
}
