//! How the world lies on the page: gravity points down, a rotation keeps angles counter-clockwise, both
//! scales are equal.

use super::axis::Axis;
use super::lines::Point;
use super::sketch::{Pose, Sketch};

/// A rotated and fitted view of the world.
#[derive(Clone, Debug)]
pub(crate) struct View {
    /// Unit vectors of the world that point right and down on the page.
    right: [f64; 2],
    down: [f64; 2],
    falls: bool,
    /// Ends of the panel to the right \[m\].
    u: [f64; 2],
    /// Ends of the panel upwards \[m\].
    h: [f64; 2],
}

impl View {
    /// A view that holds all poses and trails with some air.
    pub(crate) fn around(sketch: &Sketch, poses: &[Pose], trails: &[Vec<[f64; 2]>]) -> Self {
        let [gx, gy] = sketch.gravity;
        let g = gx.hypot(gy);
        let falls = g > 0.0 && g.is_finite();
        let down = if falls { [gx / g, gy / g] } else { [0.0, -1.0] };
        // Exactly along an axis in spite of rounding.
        let down = down.map(|c| {
            if c.abs() < 1e-12 {
                0.0
            } else if c.abs() > 1.0 - 1e-12 {
                c.signum()
            } else {
                c
            }
        });
        let mut view = View { right: [-down[1], down[0]], down, falls, u: [-1.0, 1.0], h: [-1.0, 1.0] };
        let parts = |pose: &Pose| -> Vec<[f64; 2]> {
            let arms = pose.arms.iter().map(|(_, ends)| ends);
            let pairs = pose.bars.iter().chain(&pose.springs).chain(arms).flatten();
            pairs.chain(&pose.hinges).chain(&pose.points).copied().collect()
        };
        let all = poses
            .iter()
            .flat_map(parts)
            .chain(trails.iter().flatten().copied())
            .filter(|p| p.iter().all(|c| c.abs() <= 1e300));
        let mut ends: Option<[f64; 4]> = None;
        for [u, h] in all.map(|p| view.rotated(p)) {
            let [a, b, c, d] = ends.unwrap_or([u, u, h, h]);
            ends = Some([a.min(u), b.max(u), c.min(h), d.max(h)]);
        }
        if let Some([a, b, c, d]) = ends {
            let largest = (b - a).max(d - c);
            let air = if largest > 1e-290 { 0.09 * largest } else { (0.05 * a.abs().max(c.abs())).max(1.0) };
            view.u = [a - air, b + air];
            view.h = [c - air, d + air];
        }
        view
    }

    fn rotated(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x * self.right[0] + y * self.right[1], -(x * self.down[0] + y * self.down[1])]
    }

    /// Height over width of what has to be shown.
    pub(crate) fn aspect(&self) -> f64 {
        (self.h[1] - self.h[0]) / (self.u[1] - self.u[0])
    }

    /// Widened to a panel of this width and height, so that both scales are equal.
    pub(crate) fn fitted(mut self, width: f64, height: f64) -> Self {
        let scale = (width / (self.u[1] - self.u[0])).min(height / (self.h[1] - self.h[0]));
        for (ends, length) in [(&mut self.u, width), (&mut self.h, height)] {
            let (middle, half) = (0.5 * ends[0] + 0.5 * ends[1], 0.5 * length / scale);
            *ends = [middle - half, middle + half];
        }
        self
    }

    /// Place in the panel, as fractions to the right and upwards.
    pub(crate) fn fractions(&self, point: [f64; 2]) -> Point {
        let [u, h] = self.rotated(point);
        [(u - self.u[0]) / (self.u[1] - self.u[0]), (h - self.h[0]) / (self.h[1] - self.h[0])]
    }

    /// A direction of the world on the page (y downwards).
    pub(crate) fn direction(&self, d: [f64; 2]) -> Point {
        let [u, h] = self.rotated(d);
        [u, -h]
    }

    /// A length beyond every distance in the panel \[m\].
    pub(crate) fn reach(&self) -> f64 {
        4.0 * (self.u[0].abs().max(self.u[1].abs()) + self.h[0].abs().max(self.h[1].abs()))
    }

    /// Points of paper for a metre.
    pub(crate) fn scale(&self, width: f64) -> f64 {
        width / (self.u[1] - self.u[0])
    }

    pub(crate) fn falls(&self) -> bool {
        self.falls
    }

    /// Whether neither x nor y lies along an edge of the page.
    pub(crate) fn oblique(&self) -> bool {
        self.down[0] != 0.0 && self.down[1] != 0.0
    }

    /// The axes of the panel: coordinates of the world where they lie along its edges, else lengths across
    /// and along gravity.
    pub(crate) fn axes(&self) -> (Axis, Axis) {
        if self.oblique() {
            return (
                Axis::linear("across [m]", self.u[0], self.u[1]),
                Axis::linear("height [m]", self.h[0], self.h[1]),
            );
        }
        let axis = |direction: [f64; 2], ends: [f64; 2]| {
            let name = if direction[0] != 0.0 { "*x* [m]" } else { "*y* [m]" };
            let sign = direction[0] + direction[1];
            Axis::linear(name, sign * ends[0], sign * ends[1])
        };
        (axis(self.right, self.u), axis(self.down.map(|c| -c), self.h))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(gravity: [f64; 2]) -> View {
        let pose = Pose { bars: vec![[[-1.0, -1.0], [1.0, 1.0]]], ..Pose::default() };
        View::around(&Sketch { gravity, ..Sketch::default() }, &[pose], &[]).fitted(100.0, 100.0)
    }

    #[test]
    fn gravity_points_down_and_angles_stay_counter_clockwise() {
        for (gravity, x, y) in [
            ([0.0, -9.81], [1.0, 0.0], [0.0, -1.0]),
            ([9.81, 0.0], [0.0, 1.0], [1.0, 0.0]),
            ([0.0, 0.0], [1.0, 0.0], [0.0, -1.0]),
            ([-9.81, 0.0], [0.0, -1.0], [-1.0, 0.0]),
            ([0.0, 1.62], [-1.0, 0.0], [0.0, 1.0]),
        ] {
            let view = view(gravity);
            assert_eq!(view.direction([1.0, 0.0]), x, "x under {gravity:?}");
            assert_eq!(view.direction([0.0, 1.0]), y, "y under {gravity:?}");
        }
    }

    #[test]
    fn axes_tell_the_coordinates_of_the_world() {
        let view = view([9.81, 0.0]);
        let (x, y) = view.axes();
        assert_eq!((x.name.as_str(), y.name.as_str()), ("*y* [m]", "*x* [m]"));
        let [fx, fy] = view.fractions([0.3, -0.7]);
        assert!((x.fraction(-0.7) - fx).abs() < 1e-12 && (y.fraction(0.3) - fy).abs() < 1e-12);
        assert!(y.from > y.to, "x runs downwards");
    }
}
