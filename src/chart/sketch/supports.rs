//! Supports of the hinges on the ground: on which side of a hinge its symbol lies, and the symbol.

use super::{Pencil, Pose, Sketch, finite};
use crate::chart::ChartError;
use crate::chart::labels::Occupied;
use crate::chart::lines::Point;
use crate::chart::palette::{INK, SPINE, WHITE, mix};
use crate::chart::sheet::Pen;
use crate::chart::view::View;

/// The side of a hinge whose bars prefer none: above it.
const ABOVE: Point = [0.0, -1.0];
/// A bar within this share of its length from a hinge is attached to it.
const NEAR: f64 = 1e-3;
/// Bars that turn all around a hinge have a mean direction shorter than this, of those of length one.
const NO_SIDE: f64 = 0.2;
/// Half the width of a support's triangle, and its height, in symbols of size 1 \[pt\].
const HALF: f64 = 6.5;
const HEIGHT: f64 = 10.0;

/// For each hinge the direction along an edge of the page that is farthest from the bars attached to it in
/// these poses; one for all poses, as supports do not turn.
pub(crate) fn sides_of_supports(sketch: &Sketch, poses: &[Pose], view: &View) -> Vec<Point> {
    (sketch.hinges.iter().enumerate())
        .map(|(k, hinge)| if hinge.ground { side(k, poses, view) } else { ABOVE })
        .collect()
}

fn side(k: usize, poses: &[Pose], view: &View) -> Point {
    let (mut sum, mut count) = ([0.0; 2], 0_usize);
    for pose in poses {
        let Some(&hinge) = pose.hinges.get(k) else { continue };
        for bar in pose.bars.iter().chain(pose.arms.iter().map(|(_, ends)| ends)) {
            let Some(towards) = direction_of_attached(hinge, bar) else { continue };
            let towards = view.direction(towards);
            sum = [sum[0] + towards[0], sum[1] + towards[1]];
            count += 1;
        }
    }
    let [x, y] = sum;
    if count == 0 || x.hypot(y) < NO_SIDE * count as f64 {
        ABOVE
    } else if x.abs() > 1.001 * y.abs() {
        [-x.signum(), 0.0]
    } else {
        [0.0, -y.signum()]
    }
}

/// The direction of length one from a hinge to the middle of a bar that goes through it.
fn direction_of_attached(hinge: [f64; 2], [from, to]: &[[f64; 2]; 2]) -> Option<[f64; 2]> {
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = along[0].hypot(along[1]);
    let there = [hinge[0] - from[0], hinge[1] - from[1]];
    let share = (there[0] * along[0] + there[1] * along[1]) / (length * length);
    let share = share.clamp(0.0, 1.0);
    let apart = (there[0] - share * along[0]).hypot(there[1] - share * along[1]);
    let middle = [0.5 * along[0] - there[0], 0.5 * along[1] - there[1]];
    let far = middle[0].hypot(middle[1]);
    (apart < NEAR * length && far > NEAR * length).then(|| middle.map(|x| x / far))
}

/// The place so far along the base of a support, and so far from its hinge.
fn beside(hinge: Point, side: Point, along: f64, away: f64) -> Point {
    [hinge[0] - along * side[1] + away * side[0], hinge[1] + along * side[0] + away * side[1]]
}

impl Pencil<'_> {
    /// Hinges on the ground on the page, with the sides of their supports.
    fn supported<'a>(
        &'a self,
        sketch: &'a Sketch,
        pose: &'a Pose,
    ) -> impl Iterator<Item = (Point, Point)> + 'a {
        let hinges = sketch.hinges.iter().zip(&pose.hinges).zip(&self.sides);
        hinges
            .filter(|((hinge, at), _)| hinge.ground && finite(&[**at]))
            .map(|((_, at), side)| (self.at(*at), *side))
    }

    /// Keeps the places of the supports free of names.
    pub(crate) fn block_supports(&self, sketch: &Sketch, pose: &Pose, occupied: &mut Occupied) {
        let (half, height) = (HALF * self.size, HEIGHT * self.size);
        for (hinge, side) in self.supported(sketch, pose) {
            // The strokes lean beyond one end of the base.
            let one = beside(hinge, side, -1.8 * half, 2.0);
            let other = beside(hinge, side, 1.8 * half + 3.0, height + 5.0 * self.size);
            let [[left, right], [top, bottom]] = [0, 1].map(|c| [one[c].min(other[c]), one[c].max(other[c])]);
            occupied.block([left, top, right, bottom]);
        }
    }

    /// The supports of all hinges on the ground: a triangle on a hatched line.
    pub(super) fn supports(
        &self,
        sketch: &Sketch,
        pose: &Pose,
        occupied: &mut Occupied,
    ) -> Result<(), ChartError> {
        self.block_supports(sketch, pose, occupied);
        let size = self.size;
        let (half, height) = (HALF * size, HEIGHT * size);
        for (hinge, side) in self.supported(sketch, pose) {
            let on = |along: f64, away: f64| beside(hinge, side, along, away);
            let corners = [on(-half, height), hinge, on(half, height)];
            self.sheet.polygon(&corners, mix(SPINE, WHITE, 0.7))?;
            self.sheet.line(&corners, &Pen::new(INK, 0.9 * size))?;
            let base = [on(-1.8 * half, height), on(1.8 * half, height)];
            self.hatched(base[0], base[1], side, 3.6 * size, 4.4 * size)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::sketch::HingeSketch;

    fn sides(bars: &[[[f64; 2]; 2]], poses: usize) -> Vec<Point> {
        let sketch = Sketch {
            gravity: [0.0, -9.81],
            hinges: vec![HingeSketch { ground: true, ..HingeSketch::default() }],
            ..Sketch::default()
        };
        let pose = |bars: &[[[f64; 2]; 2]]| Pose {
            bars: bars.to_vec(),
            hinges: vec![[1.0, 2.0]],
            ..Pose::default()
        };
        let all: Vec<Pose> = match poses {
            1 => vec![pose(bars)],
            _ => bars.iter().map(|bar| pose(&[*bar])).collect(),
        };
        let view = View::around(&sketch, &all, &[]);
        sides_of_supports(&sketch, &all, &view)
    }

    #[test]
    fn a_support_lies_opposite_to_the_bars_attached() {
        let hinge = [1.0, 2.0];
        let to = |x: f64, y: f64| [hinge, [1.0 + x, 2.0 + y]];
        assert_eq!(sides(&[to(0.1, -1.0)], 1), [[0.0, -1.0]], "above one that hangs");
        assert_eq!(sides(&[to(0.1, 1.0)], 1), [[0.0, 1.0]], "below one that stands");
        assert_eq!(sides(&[to(1.0, 0.2)], 1), [[-1.0, 0.0]], "to the left of one that leads to the right");
        assert_eq!(sides(&[to(-1.0, 1.0)], 1), [[0.0, 1.0]], "below rather than beside");
        assert_eq!(sides(&[to(1.0, -0.5), to(-1.0, -0.5)], 1), [[0.0, -1.0]], "opposite to the mean of two");
        assert_eq!(sides(&[[[0.9, 1.9], [1.5, 2.5]]], 1), [[0.0, 1.0]], "from the longer part of a lever");
        assert_eq!(sides(&[[[5.0, 1.0], [6.0, 9.0]]], 1), [ABOVE], "bars elsewhere do not count");
        let around = [to(1.0, 0.0), to(0.0, 1.0), to(-1.0, 0.0), to(0.0, -1.0)];
        assert_eq!(sides(&around, 4), [ABOVE], "of a bar that turns all around");
        assert_eq!(
            sides(&[to(-0.5, 1.0), to(0.5, 1.0)], 4),
            [[0.0, 1.0]],
            "of one that swings about its top"
        );
    }
}
