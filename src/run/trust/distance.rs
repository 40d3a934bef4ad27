//! How far two motions of one mechanism are apart.

use crate::arithmetic::sum::larger;
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::dynamics::{Mechanism, Motion};

/// Measures distances: angles as they are \[rad\], positions of translational coordinates over the
/// mechanism's size.
#[derive(Clone, Copy, Debug)]
pub struct DistanceMetric {
    /// How many coordinates are angles; the others are positions.
    angles: usize,
    /// The first of the coordinates that are not shown: rotors of integrals, whose differences do not count.
    shown: usize,
    /// The longest bar \[m\], or the farthest centre of mass where none has a length.
    size: f64,
}

impl DistanceMetric {
    /// The ruler of a mechanism.
    pub fn new(mechanism: &Mechanism) -> Self {
        let bars = mechanism
            .bodies
            .iter()
            .map(|body| (body.ends[1] - body.ends[0]).norm_squared().sqrt())
            .fold(0.0, f64::max);
        let arms = mechanism.bodies.iter().map(|body| body.centre.norm_squared().sqrt()).fold(0.0, f64::max);
        let size = if bars > 0.0 { bars } else { arms };
        let (angles, shown) = (mechanism.bodies.len(), mechanism.own_bodies().len());
        Self { angles, shown, size: if size > 0.0 { size } else { 1.0 } }
    }

    /// What a difference in coordinate `k` weighs: 1, or one over the size \[1/m\].
    pub fn weight(&self, k: usize) -> f64 {
        if k < self.angles { 1.0 } else { 1.0 / self.size }
    }

    /// The largest difference of a coordinate, whole turns counted: an angle \[rad\], or a position over the
    /// size.  Not a number where one of them is not.
    pub fn apart(&self, one: &Motion, other: &Motion) -> f64 {
        let difference = |k: usize| {
            let turns = one.turns[k].wrapping_sub(other.turns[k]) as f64;
            (one.phi[k] - other.phi[k] + DoubleDouble::TAU.scale(turns)).hi
        };
        self.largest((0..one.phi.len().min(other.phi.len())).map(difference))
    }

    /// The largest angle of a motion, whole turns counted \[rad\], or position over the size.
    pub fn reach(&self, motion: &Motion) -> f64 {
        self.largest((0..motion.phi.len()).map(|k| motion.unwrapped(k)))
    }

    /// The largest difference of a rate \[rad/s\], or of a velocity over the size \[1/s\].
    pub fn rates_apart(&self, one: &Motion, other: &Motion) -> f64 {
        self.largest(one.omega.iter().zip(&other.omega).map(|(&a, &b)| (a - b).hi))
    }

    /// Of values of all coordinates those that count: angles as they are, positions over the size.
    pub fn measured(&self, values: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
        let Self { angles, shown, .. } = *self;
        let counts = values.enumerate().filter(move |(k, _)| *k < shown || *k >= angles);
        counts.map(|(k, value)| value * self.weight(k))
    }

    fn largest(&self, differences: impl Iterator<Item = f64>) -> f64 {
        self.measured(differences).fold(0.0, |most, difference| larger(most, difference.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::read_scene;

    #[test]
    fn turns_count_and_positions_are_measured_against_the_longest_bar() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/cart_pole.json");
        let scene = read_scene(&path, &[]).expect("a shipped scene");
        let mechanism = Mechanism::new(&scene).expect("equations");
        let (metric, one) = (DistanceMetric::new(&mechanism), mechanism.start(&scene));
        assert_eq!(metric.apart(&one, &one), 0.0);
        let mut other = one.clone();
        other.turns[0] += 1;
        assert_eq!(metric.apart(&one, &other), std::f64::consts::TAU);
        let last = one.phi.len() - 1;
        assert!(last >= mechanism.bodies.len(), "a foot that moves freely");
        other = one.clone();
        other.phi[last] = other.phi[last] + 0.5;
        let longest = scene.bars.iter().map(|bar| bar.length).fold(0.0, f64::max);
        assert!((metric.apart(&one, &other) - 0.5 / longest).abs() < 1e-15);
    }
}
