//! The length and the force that gaps and contact forces are divided by, so that no threshold on them has a
//! unit.
//!
//! ```text
//! length = Σ |gamma_k| + |gap at the start|
//!     levers of the point, and how far it is from its wall
//! force  = E / length + |g| Σ m + Σ |F|,
//!     E: kinetic and elastic energy at the start, torques, inertia times the square of driven rates
//! ```
//!
//! A point without levers that starts on its wall, to rounding, takes the largest length of the other
//! contacts, else the size of the bodies, else the height its speed takes it to, else 1 m.  A body far from
//! the origin has its gap rounded to the size of its coordinates; the length is no less than what makes that
//! rounding [`ROUNDED`] of it.

use crate::arithmetic::{Complex, DoubleDouble};
use crate::dynamics::compile::Body;
use crate::dynamics::constraint::{ConstraintEquation, RowMeasure};
use crate::dynamics::force::AppliedAction;
use crate::dynamics::force::action::Applied;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::point::Point;
use crate::dynamics::{Mechanism, Motion};
use crate::scene::Profile;

/// Rounding of a gap over the length of its contact, at most, at the start.
pub const ROUNDED: f64 = 1e-13;

impl Mechanism {
    /// Gives every contact its length \[m\] and force \[N\], from the start.
    pub(in crate::dynamics) fn scale_contacts(&mut self, start: &Motion) {
        let mut z = vec![Complex::ZERO; self.coordinates()];
        self.tree.unit_vectors::<DoubleDouble, 0>(&start.phi, &mut z);
        let z: Vec<Complex<f64>> = z.iter().map(|z| Complex::new(z.re.hi, z.im.hi)).collect();
        let [phi, omega] = start.rounded();
        let own: Vec<f64> = self
            .contacts
            .iter()
            .map(|contact| {
                let distance = contact.distance(start.time, &phi, &z).abs();
                // Of a point that starts on its wall this is rounding, and no length.
                let is_known = distance > least_length(&contact.row, &z);
                levers(&contact.point) + if is_known { distance } else { 0.0 }
            })
            .collect();
        let others = own.iter().copied().fold(0.0, f64::max);
        let gravity = self.gravity.norm_squared().sqrt();
        let energy = self.energy_of_start(start);
        let pushed = self.forces_at_start(start, size(&self.bodies));
        let mass: f64 = self.bodies.iter().map(|body| body.mass).sum();
        for (contact, own) in self.contacts.iter_mut().zip(own) {
            let speed = contact.gap_rate(start.time, &phi, &z, &omega);
            let thrown = speed * speed / gravity;
            let length = [own, others, size(&self.bodies), thrown, 1.0]
                .into_iter()
                .find(|x| x.is_finite() && *x > 0.0)
                .unwrap_or(1.0);
            contact.length = power_of_two(length.max(least_length(&contact.row, &z)));
            let force = energy / contact.length
                + mass * gravity
                + driven(self.constraints.iter().chain([&contact.row]), mass, contact.length)
                + applied(&self.actions, contact.length)
                + pushed / contact.length;
            contact.force = power_of_two(if force.is_finite() && force > 0.0 { force } else { 1.0 });
        }
    }

    /// Kinetic energy and that of springs at the start \[J\].
    fn energy_of_start(&self, start: &Motion) -> f64 {
        let mut kernel = Kernel::<DoubleDouble>::without_rows(self);
        let kinetic = self.energy(&mut kernel, &start.phi, &start.omega).kinetic.hi;
        let springs: f64 = self.springs.iter().map(|spring| spring.energy(&kernel.z).hi).sum();
        kinetic + springs + self.torsions.iter().map(|torsion| torsion.energy(&start.phi).hi).sum::<f64>()
    }
}

/// Σ |gamma_k| \[m\].
fn levers(point: &Point) -> f64 {
    point.terms.iter().map(|term| term.1.norm_squared().sqrt()).sum()
}

/// The length that a gap's rounding is [`ROUNDED`] of \[m\].
fn least_length(row: &ConstraintEquation, z: &[Complex<f64>]) -> f64 {
    f64::EPSILON * magnitudes(row, z) / ROUNDED
}

/// Sum of the magnitudes a gap is summed from \[m\].
pub fn magnitudes(row: &ConstraintEquation, z: &[Complex<f64>]) -> f64 {
    let RowMeasure::Place(place) = &row.measure else { return 0.0 };
    let part = |&(k, g): &(usize, Complex<f64>)| (g.re * z[k].re).abs() + (g.im * z[k].im).abs();
    let linear = place.constant.abs() + place.linear.iter().map(part).sum::<f64>();
    place.bilinear.iter().fold(linear, |sum, &(j, k, h)| {
        let other = h * z[k];
        sum + (z[j].re * other.re).abs() + (z[j].im * other.im).abs()
    })
}

/// The longest body \[m\], 0 where none has a length.
fn size(bodies: &[Body]) -> f64 {
    let length = |x: &Complex<f64>| x.norm_squared().sqrt();
    bodies.iter().flat_map(|body| body.ends.iter().chain([&body.centre]).map(length)).fold(0.0, f64::max)
}

/// What motors ask for at most, roughly \[N\].
fn driven<'a>(rows: impl Iterator<Item = &'a ConstraintEquation>, mass: f64, length: f64) -> f64 {
    let force = |row: &ConstraintEquation| {
        let Some(law) = &row.law else { return 0.0 };
        let peaks = law.profile.as_ref().map_or([0.0; 2], Profile::peaks);
        let (mut rate, mut acceleration) = (law.rate.abs() + peaks[0], law.acceleration.abs() + peaks[1]);
        for sine in &law.sines {
            rate += (sine.amplitude * sine.frequency).abs();
            acceleration += (sine.amplitude * sine.frequency * sine.frequency).abs();
        }
        if row.is_angle() {
            mass * length * (acceleration + rate * rate)
        } else {
            mass * (acceleration + rate * rate / length)
        }
    };
    rows.map(force).sum()
}

/// The magnitudes of applied forces, and of torques over `length` \[N\].
fn applied(actions: &[AppliedAction], length: f64) -> f64 {
    let force = |action: &AppliedAction| match &action.kind {
        Applied::Force { force, .. } => force.norm_squared().sqrt(),
        Applied::Torque { torque, .. } => torque.abs() / length,
    };
    actions.iter().map(force).sum()
}

/// The largest power of two not above a positive number: dividing by it rounds nothing.
fn power_of_two(x: f64) -> f64 {
    f64::from_bits(x.clamp(f64::MIN_POSITIVE, f64::MAX).to_bits() & f64::INFINITY.to_bits())
}
