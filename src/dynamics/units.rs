//! The mechanism's own units of length and time: what thresholds that would otherwise have units are
//! multiplied by.
//!
//! Each is a power of 1024, and 1 for a mechanism of human size: the size of its parts over the unit of
//! length lies within 1/32 and 32, its rate times the unit of time within 1/4 and 256.  So ordinary
//! mechanisms keep metres and seconds to the last bit, and the same mechanism a thousand times larger, slower
//! or heavier behaves alike: multiplied by a power of 1024, to the last bit.

use super::{Mechanism, Motion};
use crate::scene::{Law, Profile, Scene};
use serde::Serialize;

/// Units of a mechanism, powers of 1024.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Units {
    /// \[m\]
    pub length: f64,
    /// \[s\]
    pub time: f64,
}

impl Default for Units {
    fn default() -> Self {
        Self { length: 1.0, time: 1.0 }
    }
}

/// How far above the unit rate the range of rates lies that keeps it: mechanisms turn faster than 1 rad/s.
const FASTER: f64 = 8.0;

/// The power of 1024 next to a size; 1 where there is none.
fn nearest(size: f64) -> f64 {
    let is_usable = size > 0.0 && size.is_finite();
    if is_usable { libm::exp2(10.0 * (libm::log2(size) / 10.0).round()) } else { 1.0 }
}

impl Units {
    /// Those of a mechanism with its energy scale, from its start.
    pub(super) fn new(mechanism: &Mechanism, scene: &Scene, start: &Motion) -> Self {
        let length = mechanism.size_of_parts();
        let inertia: f64 = mechanism.tree.diagonal.iter().enumerate().fold(0.0, |sum, (k, d)| {
            let lever = if k < mechanism.bodies.len() { 1.0 } else { length };
            sum + d * lever * lever
        });
        let energy = mechanism.energy_scale;
        let given = (energy / inertia).sqrt();
        let spins = start.omega.iter().take(mechanism.bodies.len()).map(|omega| omega.hi.abs());
        let rate = spins
            .chain([given])
            .chain(laws(scene, length))
            .filter(|rate| rate.is_finite())
            .fold(0.0, f64::max);
        Self { length: nearest(length), time: 1.0 / nearest(rate / FASTER) }
    }

    /// That of coordinate `k`, of which the first `angles` are angles.
    pub(super) fn coordinate(&self, k: usize, angles: usize) -> f64 {
        if k < angles { 1.0 } else { self.length }
    }
}

/// The unit of an unknown that no error is measured by, 2⁵⁰⁰.
const UNCOUNTED: f64 = f64::from_bits((1023 + 500) << 52);

impl Mechanism {
    /// The unit of unknown `i` of a form that has so many coordinates, the first ones angles, then as many
    /// rates, then energies.
    pub(super) fn unit_of(&self, i: usize, coordinates: usize, angles: usize) -> f64 {
        match i {
            // Of a rotor that carries an integral the rate counts alone.
            i if (angles.saturating_sub(self.integrals)..angles).contains(&i) => UNCOUNTED,
            i if i < coordinates => self.units.coordinate(i, angles),
            i if i < 2 * coordinates => self.units.coordinate(i - coordinates, angles) / self.units.time,
            _ => self.energy_scale,
        }
    }
}

/// The rates that laws prescribe \[rad/s\].
fn laws(scene: &Scene, length: f64) -> impl Iterator<Item = f64> {
    let of = |law: &Law, unit: f64| {
        let sines = law.sines.iter().map(|sine| sine.frequency.abs()).fold(0.0, f64::max);
        let [rate, acceleration] = law.profile.as_ref().map_or([0.0; 2], Profile::peaks);
        let rate = rate.max(law.rate.abs());
        sines.max(rate / unit).max((acceleration.max(law.acceleration.abs()) / unit).sqrt())
    };
    let motors = scene.motors.iter().map(move |motor| of(&motor.law, 1.0));
    let factors = scene
        .forces
        .iter()
        .filter_map(|force| force.law.as_ref())
        .chain(scene.torques.iter().filter_map(|torque| torque.law.as_ref()));
    motors
        .chain(scene.drives.iter().map(move |drive| of(&drive.law, length)))
        .chain(factors.map(move |law| of(law, 1.0)))
        .chain(scene.walls.iter().filter_map(|wall| wall.law.as_ref()).map(move |law| of(law, length)))
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn sizes_of_everyday_keep_their_units() {
        for size in [0.04, 0.6, 1.0, 9.81, 30.0] {
            assert_eq!(
                (nearest(size), nearest(1024.0 * size), nearest(size / 1024.0)),
                (1.0, 1024.0, 1.0 / 1024.0)
            );
        }
        assert_eq!([0.0, f64::NAN, f64::INFINITY].map(nearest), [1.0; 3]);
    }
}
