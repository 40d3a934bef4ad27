//! Travels of sliders, whose ends are dead centres as those of angles are.

use super::walk::{DriveWalk, SolvedPosition};
use super::{DeadCentre, STILL};
use crate::arithmetic::Complex;
use crate::dynamics::Mechanism;
use crate::dynamics::forest::BodyOrigin;
use crate::dynamics::point::Point;
use crate::scene::Scene;

/// How far a slider's point is along its rail.
pub(super) struct SliderTravel {
    name: String,
    point: Point,
    foot: Point,
    /// The rail's body, and its unit vector in that body's frame or the world's.
    body: Option<usize>,
    direction: Complex<f64>,
}

impl SliderTravel {
    /// Those of all sliders, but of bodies whose places are coordinates, which tell it themselves.
    pub fn of(scene: &Scene, mechanism: &Mechanism) -> Vec<Self> {
        let forest = &mechanism.forest;
        let floats = |body: usize| matches!(forest.hangs[body].origin_point, BodyOrigin::Free(_));
        let sliders = scene.sliders.iter().filter(|slider| !slider.point.bar.is_some_and(floats));
        let travel = |slider: &crate::scene::Slider| {
            let [x, y] = slider.rail.direction;
            Self {
                name: slider.name.clone(),
                point: forest.point(&slider.point),
                foot: forest.point(&slider.rail.place),
                body: slider.rail.place.bar,
                direction: Complex::new(x / x.hypot(y), y / x.hypot(y)),
            }
        };
        sliders.map(travel).collect()
    }

    fn along(&self, z: &[Complex<f64>]) -> Complex<f64> {
        self.body.map_or(self.direction, |body| z[body].turn(self.direction))
    }

    /// \[m\]
    fn value(&self, z: &[Complex<f64>]) -> f64 {
        self.along(z).dot(self.point.position(z) - self.foot.position(z))
    }

    /// \[m/s\]
    fn rate(&self, z: &[Complex<f64>], omega: &[f64]) -> f64 {
        let along = self.along(z);
        let turning = self.body.map_or(0.0, |body| {
            omega[body] * along.left().dot(self.point.position(z) - self.foot.position(z))
        });
        along.dot(self.point.velocity(z, omega) - self.foot.velocity(z, omega)) + turning
    }

    /// Where it turns back between positions, and at the last of them.
    pub fn dead_centres(
        &self,
        all: &[SolvedPosition],
        walk: &mut DriveWalk,
        is_moving: impl Fn(f64) -> bool,
        in_line: f64,
    ) -> Vec<DeadCentre> {
        let mut rates = Vec::with_capacity(all.len());
        for one in all {
            walk.restore(one);
            rates.push(self.rate(walk.unit_vectors(), walk.rates()));
        }
        let fastest = rates.iter().fold(0.0, |most: f64, rate| most.max(rate.abs()));
        if !is_moving(fastest) {
            return Vec::new();
        }
        // At a position that is a dead centre the rate is zero to rounding, with either sign.
        let plain = |rate: f64| if rate.abs() <= STILL * fastest { 0.0 } else { rate };
        let mut found = Vec::new();
        for (k, pair) in all.windows(2).enumerate() {
            let [before, after] = [rates[k], rates[k + 1]].map(plain);
            if !(before * after < 0.0 || after == 0.0) {
                continue;
            }
            let rate = |walk: &DriveWalk| plain(self.rate(walk.unit_vectors(), walk.rates()));
            if let Some(position) = walk.root([&pair[0], &pair[1]], rate) {
                found.push(DeadCentre {
                    drive: position.drive,
                    name: self.name.clone(),
                    value: self.value(walk.unit_vectors()),
                    in_line: walk.in_line(in_line),
                });
            }
        }
        found
    }
}
