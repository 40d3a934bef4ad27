//! Series of the numbers whose constants are doubles.

use super::polynomial::{copy, copy_vectors};
use super::{Coefficient, Series, drive};
use crate::arithmetic::{Complex, DoubleDouble};
use crate::dynamics::constraint::RowMeasure;
use crate::dynamics::impact::{AWAY, Contact};
use crate::dynamics::{Coordinates, Mechanism, Time};

impl<T: Coefficient> Series<T> {
    /// Room for series of a mechanism in some coordinates up to this power of the rates, at least 2.
    pub fn new(mechanism: &Mechanism, coordinates: Coordinates, order: usize) -> Self {
        Self::of_terms(&mechanism.terms(), coordinates, order)
    }

    /// Expands the motion through coordinates `u` \[rad\] (leading part and rest) and rates `u_rate`
    /// \[rad/s\] at time `t`.
    pub fn expand(&mut self, mechanism: &Mechanism, t: Time, u: &[T], u_rest: &[T], u_rate: &[T]) {
        self.expand_terms(&mechanism.terms(), t, u, u_rest, u_rate);
    }

    /// Expands a motion whose first powers were found in more digits; they are rounded, and the later ones
    /// follow from them.
    pub fn carry_on(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        u: &[T],
        u_rest: &[T],
        u_rate: &[T],
        first: &Series<DoubleDouble>,
    ) {
        let terms = &mechanism.terms();
        self.law_series(terms, t);
        T::begin(self, t, u, u_rest, u_rate);
        copy_vectors(&mut self.z, &first.z);
        copy(&mut self.omega, &first.omega);
        copy(&mut self.rate, &first.rate);
        copy(&mut self.power, &first.power);
        copy_vectors(&mut self.rest, &first.rest);
        copy(&mut self.torque, &first.torque);
        copy(&mut self.applied, &first.applied);
        for (action, first) in self.actions.iter_mut().zip(&first.actions) {
            action.take(first);
        }
        for (spring, first) in self.springs.iter_mut().zip(&first.springs) {
            spring.take(first);
        }
        for (force, first) in self.forces.iter_mut().zip(&first.forces) {
            force.take(first);
        }
        self.rows.take(&first.rows);
        if let (Some(friction), Some(first)) = (&mut self.friction, &first.friction) {
            friction.take(first);
        }
        T::orders(self, terms, first.order.min(self.order));
    }

    /// Powers 0, 1, … of the gap of a wall over the length of its contact \[1/s^m\], to that of the unit
    /// vectors.
    pub fn gap(&self, contact: &Contact, t: Time, powers: &mut Vec<f64>) {
        powers.clear();
        let RowMeasure::Place(place) = &contact.row.measure else { return };
        if contact.is_off {
            powers.extend([AWAY, 0.0]);
            return;
        }
        let n = self.elements.max(1);
        let elements = self.z.chunks_exact(self.elements.max(1));
        powers.extend(elements.map(|z| {
            place.linear.iter().fold(T::ZERO, |sum, &(k, g)| sum + Complex::of(g).dot(z[k])).value()
        }));
        // Lines of the ground are linear; those of bodies have products beside.
        for &(j, k, h) in &place.bilinear {
            for (m, power) in powers.iter_mut().enumerate() {
                let term = |l: usize| self.z[l * n + j].dot(self.z[(m - l) * n + k].turn(h));
                *power += (0..m + 1).fold(T::ZERO, |sum, l| sum + term(l)).value();
            }
        }
        if let Some(law) = &contact.row.law {
            let moved = drive::powers(law, t, powers.len());
            for (power, moved) in powers.iter_mut().zip(moved) {
                *power -= moved;
            }
        }
        if let Some(aim) = &contact.row.aim {
            for (power, moved) in powers.iter_mut().zip(self.aim(aim)) {
                *power -= moved.value();
            }
        }
        if let Some(first) = powers.first_mut() {
            *first += place.constant;
        }
        powers.iter_mut().for_each(|power| *power /= contact.length);
    }
}
