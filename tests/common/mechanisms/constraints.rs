//! The constraint Jacobian in maximal coordinates, scaled by the scene's length, and its null space.

use super::{Model, dot, left, minus, norm};
use driftless::scene::{Place, Slider};

/// A scalar constraint is independent of the others where this much of its unit normal is left beside theirs.
const INDEPENDENT: f64 = 0.08;

/// An orthonormal basis of the row space of a Jacobian.
#[derive(Clone, Debug)]
pub struct Basis {
    columns: usize,
    rows: Vec<Vec<f64>>,
}

impl Basis {
    /// Adds rows; false, and nothing added, where one nearly depends on the others.
    pub fn add(&mut self, rows: &[Vec<f64>]) -> bool {
        let before = self.rows.len();
        for row in rows {
            let size = length(row);
            let mut rest: Vec<f64> = row.iter().map(|x| x / size).collect();
            for _ in 0..2 {
                self.reduce(&mut rest);
            }
            let left = length(&rest);
            if left.is_nan() || left < INDEPENDENT {
                self.rows.truncate(before);
                return false;
            }
            self.rows.push(rest.iter().map(|x| x / left).collect());
        }
        true
    }

    /// Takes off what lies in the row space.
    pub fn reduce(&self, vector: &mut [f64]) {
        for row in &self.rows {
            let share: f64 = row.iter().zip(&*vector).map(|(a, b)| a * b).sum();
            vector.iter_mut().zip(row).for_each(|(x, row)| *x -= share * row);
        }
    }

    /// Degrees of freedom.
    pub fn freedom(&self) -> usize {
        self.columns - self.rows.len()
    }
}

fn length(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl Model {
    /// The basis of all constraints there are; `None` where they are near-singular.
    pub(super) fn basis(&self) -> Option<Basis> {
        let mut basis = Basis { columns: 3 * self.bars.len(), rows: Vec::new() };
        let mut rows = Vec::new();
        for hinge in &self.hinges {
            rows.push(self.pin(&hinge.between));
        }
        for weld in &self.welds {
            rows.push(
                [self.pin(&weld.between), vec![self.angle(weld.between[1].bar, weld.between[0].bar)]]
                    .concat(),
            );
        }
        for slider in &self.sliders {
            rows.push(self.slide(slider));
        }
        for lock in &self.locks {
            rows.push(vec![self.angle(Some(lock.bar), lock.relative_to)]);
        }
        rows.iter().all(|rows| basis.add(rows)).then_some(basis)
    }

    fn empty(&self) -> Vec<f64> {
        vec![0.0; 3 * self.bars.len()]
    }

    /// Adds the velocity of a place in a direction, times a sign.
    fn point_row(&self, place: &Place, direction: [f64; 2], sign: f64, row: &mut [f64]) {
        let Some(bar) = place.bar else { return };
        let arm = self.turned(bar, place.point);
        row[3 * bar] += sign * direction[0];
        row[3 * bar + 1] += sign * direction[1];
        row[3 * bar + 2] += sign * dot(direction, left(arm)) / self.scales.length;
    }

    /// Two places that coincide.
    pub(super) fn pin(&self, between: &[Place; 2]) -> Vec<Vec<f64>> {
        let of = |direction| {
            let mut row = self.empty();
            self.point_row(&between[0], direction, 1.0, &mut row);
            self.point_row(&between[1], direction, -1.0, &mut row);
            row
        };
        vec![of([1.0, 0.0]), of([0.0, 1.0])]
    }

    /// Two angles that turn together.
    pub(super) fn angle(&self, a: Option<usize>, b: Option<usize>) -> Vec<f64> {
        let mut row = self.empty();
        if let Some(a) = a {
            row[3 * a + 2] += 1.0;
        }
        if let Some(b) = b {
            row[3 * b + 2] -= 1.0;
        }
        row
    }

    /// The direction of a rail in the world.
    pub(super) fn along(&self, slider: &Slider) -> [f64; 2] {
        let direction = slider.rail.direction;
        slider.rail.place.bar.map_or(direction, |bar| self.turned(bar, direction))
    }

    /// A point that stays on a line, and where locked the angle too.
    pub(super) fn slide(&self, slider: &Slider) -> Vec<Vec<f64>> {
        let mut rows = vec![self.on_rail(slider, left(self.along(slider)))];
        if slider.locked {
            rows.push(self.angle(slider.point.bar, slider.rail.place.bar));
        }
        rows
    }

    /// The travel of a slider.
    pub(super) fn travel_row(&self, slider: &Slider) -> Vec<f64> {
        self.on_rail(slider, self.along(slider))
    }

    /// The rate of the slider's distance from the rail's point in a direction that turns with the rail.
    fn on_rail(&self, slider: &Slider, direction: [f64; 2]) -> Vec<f64> {
        let mut row = self.empty();
        self.point_row(&slider.point, direction, 1.0, &mut row);
        self.point_row(&slider.rail.place, direction, -1.0, &mut row);
        if let Some(bar) = slider.rail.place.bar {
            let span = minus(self.at(&slider.point), self.at(&slider.rail.place));
            row[3 * bar + 2] += dot(left(direction), span) / self.scales.length;
        }
        row
    }

    /// Travel along a rail \[m\] and its rate \[m/s\].
    pub(super) fn travel(&self, slider: &Slider) -> [f64; 2] {
        let along = self.along(slider);
        let span = minus(self.at(&slider.point), self.at(&slider.rail.place));
        let rate = minus(self.velocity_at(&slider.point), self.velocity_at(&slider.rail.place));
        let turning = slider.rail.place.bar.map_or(0.0, |bar| self.start[bar].omega);
        [dot(along, span), dot(along, rate) + turning * dot(left(along), span)]
    }

    /// Two places whose distance stays.
    pub(super) fn rod(&self, between: &[Place; 2]) -> Vec<f64> {
        let span = minus(self.at(&between[0]), self.at(&between[1]));
        let direction = span.map(|x| x / norm(span));
        let mut row = self.empty();
        self.point_row(&between[0], direction, 1.0, &mut row);
        self.point_row(&between[1], direction, -1.0, &mut row);
        row
    }

    /// Rates of all bodies in the null space of the constraints; at times all are at rest.
    pub(super) fn choose_rates(&mut self, basis: &Basis) {
        let n = self.bars.len();
        if self.dice.chance(0.15) {
            return;
        }
        let slow = if self.is_coupled && self.wants_motor() { 0.15 } else { 1.0 };
        let mut rates: Vec<f64> =
            (0..3 * n).map(|_| slow * self.dice.signed(0.2, 1.8) / self.scales.time).collect();
        for _ in 0..3 {
            basis.reduce(&mut rates);
        }
        for k in 0..n {
            self.velocity[k] = [rates[3 * k], rates[3 * k + 1]].map(|rate| rate * self.scales.length);
            self.start[k].omega = rates[3 * k + 2];
        }
    }
}
