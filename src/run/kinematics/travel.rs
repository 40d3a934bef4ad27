//! Travels of sliders, whose ends are dead centres as those of angles are.

use super::walk::{DriveWalk, SolvedPosition};
use crate::dynamics::Mechanism;
use crate::dynamics::compile::travel_along;
use crate::dynamics::constraint::ConstraintEquation;
use crate::dynamics::forest::BodyOrigin;
use crate::scene::{Scene, Slider};

/// How far a slider's point is along its rail.
pub(super) struct SliderTravel {
    pub name: String,
    row: ConstraintEquation,
}

impl SliderTravel {
    /// Those of all sliders but of points on fixed rails whose places are coordinates, which tell it
    /// themselves.
    pub fn of(scene: &Scene, mechanism: &Mechanism) -> Vec<Self> {
        let forest = &mechanism.forest;
        let tells_itself = |slider: &&Slider| {
            let floats = |body: usize| {
                let hang = &forest.hangs[body];
                let [x, y] = slider.point.point;
                matches!(hang.origin_point, BodyOrigin::Free(_)) && (hang.own.re, hang.own.im) == (x, y)
            };
            slider.rail.place.bar.is_none() && slider.point.bar.is_some_and(floats)
        };
        let sliders = scene.sliders.iter().filter(|slider| !tells_itself(slider));
        sliders.map(|slider| Self { name: slider.name.clone(), row: travel_along(forest, slider) }).collect()
    }

    /// Its rates at these positions \[m/s\].
    pub fn rates(&self, all: &[SolvedPosition], walk: &mut DriveWalk) -> Vec<f64> {
        let rate = |one| {
            walk.restore(one);
            self.rate(walk)
        };
        all.iter().map(rate).collect()
    }

    /// Its rate where the mechanism stands \[m/s\].
    pub fn rate(&self, walk: &DriveWalk) -> f64 {
        let (mut rate, omega) = (0.0, walk.rates());
        self.row.measure.slopes(walk.unit_vectors(), |k, slope| rate += slope * omega[k]);
        rate
    }

    /// It, where the mechanism stands \[m\].
    pub fn value(&self, walk: &DriveWalk) -> f64 {
        self.row.gap(walk.unit_vectors())
    }
}
