//! The drawing of a mechanism in a pose: bars, hinges, ground, springs, motors, walls, trails.

mod parts;
mod supports;

use super::ChartError;
use super::labels::Occupied;
use super::lines::{Point, clip};
use super::palette::{
    BLUE, Colour, GREEN, INK, ORANGE, PURPLE, SKY, SPINE, VERMILLION, WHITE, mix, readable,
};
use super::panel::Panel;
use super::sheet::{NAME, Pen, Sheet};
use super::text::{Align, Lettering, TextLevel};
use super::view::View;

pub(crate) use supports::sides_of_supports;

/// What does not change while a mechanism moves.
#[derive(Clone, Debug, Default)]
pub struct Sketch {
    /// Gravitational acceleration (x, y) \[m/s²\]; it points down the page.
    pub gravity: [f64; 2],
    /// Hinges.
    pub hinges: Vec<HingeSketch>,
    /// Springs.
    pub springs: Vec<SpringSketch>,
    /// Walls.
    pub walls: Vec<WallSketch>,
    /// Names of the points whose paths are of interest, with markup; may be empty words.
    pub points: Vec<String>,
}

/// A hinge.
#[derive(Clone, Debug, Default)]
pub struct HingeSketch {
    /// Name, with markup; written while a mechanism has few of them.
    pub name: String,
    /// Whether it is fixed to the ground.
    pub ground: bool,
}

/// A spring.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpringSketch {
    /// Which of its two ends is fixed to the ground.
    pub ground: [bool; 2],
}

/// A wall.
#[derive(Clone, Copy, Debug, Default)]
pub struct WallSketch {
    /// A point of the line (x, y) \[m\].
    pub through: [f64; 2],
    /// Normal (x, y) of any length, towards the free side.
    pub normal: [f64; 2],
}

/// Where everything is at one time.  Lists agree with those of the [`Sketch`]; what is missing is left out.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    /// Both ends of each bar (x, y) \[m\].
    pub bars: Vec<[[f64; 2]; 2]>,
    /// Number of the bar, and both ends, of what joins the places of a body that lie off its bar (x, y)
    /// \[m\].
    pub arms: Vec<(usize, [[f64; 2]; 2])>,
    /// The sliders.
    pub sliders: Vec<SliderPose>,
    /// The hinges (x, y) \[m\].
    pub hinges: Vec<[f64; 2]>,
    /// Both ends of each spring (x, y) \[m\].
    pub springs: Vec<[[f64; 2]; 2]>,
    /// The torsion springs.
    pub spirals: Vec<SpiralPose>,
    /// The motors.
    pub motors: Vec<MotorPose>,
    /// The points of interest (x, y) \[m\].
    pub points: Vec<[f64; 2]>,
}

/// A slider on its rail.
#[derive(Clone, Copy, Debug, Default)]
pub struct SliderPose {
    /// The point that slides (x, y) \[m\].
    pub at: [f64; 2],
    /// Direction of the rail (x, y) of any length.
    pub along: [f64; 2],
    /// Whether the rail is fixed to the ground.
    pub ground: bool,
}

/// A torsion spring.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpiralPose {
    /// The place about which it turns its bar (x, y) \[m\].
    pub at: [f64; 2],
    /// Absolute angle of the bar, counter-clockwise from +x \[rad\].
    pub angle: f64,
}

/// A motor.
#[derive(Clone, Copy, Debug, Default)]
pub struct MotorPose {
    /// Its hinge (x, y) \[m\].
    pub at: [f64; 2],
    /// Absolute angle of the driven bar, counter-clockwise from +x \[rad\].
    pub angle: f64,
    /// Rate of that angle \[rad/s\]; its sign gives the arrow's sense, zero leaves out the arrow head.
    pub rate: f64,
}

/// From this many names on none is written.
pub(crate) const NAMES: usize = 7;

/// Draws in a panel through a view of the world.
pub(crate) struct Pencil<'a> {
    pub sheet: &'a Sheet,
    pub panel: &'a Panel<'a>,
    pub view: View,
    /// Size of symbols, 1 for bars of usual length on the page.
    pub size: f64,
    /// For each hinge, the direction on the page in which its support lies.
    pub sides: Vec<Point>,
}

pub(crate) fn trail_colour(k: usize) -> Colour {
    [VERMILLION, BLUE, PURPLE, GREEN][k % 4]
}

pub(crate) fn finite(points: &[[f64; 2]]) -> bool {
    points.iter().flatten().all(|c| c.abs() <= 1e300)
}

impl Pencil<'_> {
    pub(crate) fn at(&self, point: [f64; 2]) -> Point {
        self.panel.page(self.view.fractions(point))
    }

    /// Bars of an earlier pose in pale grey; `age` 1 for the oldest, 0 for the present.
    pub(crate) fn ghost(&self, pose: &Pose, age: f64) -> Result<(), ChartError> {
        let pen = Pen::new(mix(SPINE, WHITE, 0.74 + 0.18 * age), 4.0 * self.size);
        let arms = pose.arms.iter().map(|(_, ends)| ends);
        for bar in pose.bars.iter().chain(arms).filter(|bar| finite(&bar[..])) {
            self.sheet.rod(bar.map(|end| self.at(end)), &pen)?;
        }
        Ok(())
    }

    /// The path of a point, oldest part palest, in `shades` shades; opaque, because translucent pieces would
    /// show their joints.
    pub(crate) fn trail(
        &self,
        points: &[[f64; 2]],
        colour: Colour,
        shades: usize,
        occupied: &mut Occupied,
    ) -> Result<(), ChartError> {
        let chunk = points.len().div_ceil(shades).max(1);
        for start in (0..points.len()).step_by(chunk) {
            let part = &points[start..(start + chunk + 1).min(points.len())];
            let youth = (start + part.len()) as f64 / points.len() as f64;
            let pen = Pen::new(mix(WHITE, colour, 0.12 + 0.88 * youth), 0.8 + 1.4 * youth);
            for piece in
                clip(part.iter().map(|&p| if finite(&[p]) { self.view.fractions(p) } else { [f64::NAN; 2] }))
            {
                let piece: Vec<Point> = piece.into_iter().map(|p| self.panel.page(p)).collect();
                occupied.line(&piece);
                self.sheet.line(&piece, &pen)?;
            }
        }
        Ok(())
    }

    /// A line with hatching on the side `towards` (unit vector on the page).
    fn hatched(
        &self,
        from: Point,
        to: Point,
        towards: Point,
        every: f64,
        length: f64,
    ) -> Result<(), ChartError> {
        let pen = Pen::new(INK, 0.9 * self.size.max(0.7));
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let whole = dx.hypot(dy);
        let count = (whole / every).floor().clamp(0.0, 1000.0) as usize;
        for k in 0..=count {
            let share = (0.5 * (whole - count as f64 * every) + k as f64 * every) / whole.max(1e-9);
            let origin_point = [from[0] + share * dx, from[1] + share * dy];
            // All strokes lean the same way, as on a technical drawing.
            let along = [-towards[1], towards[0]];
            let tip = [
                origin_point[0] + length * (towards[0] + 0.8 * along[0]),
                origin_point[1] + length * (towards[1] + 0.8 * along[1]),
            ];
            self.sheet.line(&[origin_point, tip], &Pen { width: 0.75 * pen.width, ..pen })?;
        }
        self.sheet.line(&[from, to], &Pen { width: 1.3 * self.size.max(0.7), ..pen })
    }

    /// Walls, from frame to frame.
    pub(crate) fn walls(&self, walls: &[WallSketch], occupied: &mut Occupied) -> Result<(), ChartError> {
        for wall in walls.iter().filter(|wall| finite(&[wall.through, wall.normal])) {
            let length = wall.normal[0].hypot(wall.normal[1]);
            if length == 0.0 {
                continue;
            }
            let (nx, ny) = (wall.normal[0] / length, wall.normal[1] / length);
            let reach = self.view.reach() + wall.through[0].hypot(wall.through[1]);
            let ends = [-reach, reach]
                .map(|s| self.view.fractions([wall.through[0] - s * ny, wall.through[1] + s * nx]));
            for piece in clip(ends) {
                let (from, to) = (self.panel.page(piece[0]), self.panel.page(piece[1]));
                let normal = self.view.direction([nx, ny]);
                occupied.line(&[from, to]);
                self.hatched(from, to, [-normal[0], -normal[1]], 7.0, 4.5)?;
            }
        }
        Ok(())
    }

    /// The mechanism in a pose, without names.
    pub(crate) fn pose(
        &self,
        sketch: &Sketch,
        pose: &Pose,
        occupied: &mut Occupied,
    ) -> Result<(), ChartError> {
        let size = self.size;
        self.supports(sketch, pose, occupied)?;
        self.blocks(&pose.sliders, occupied)?;
        let bars = pose.arms.iter().copied().chain(pose.bars.iter().copied().enumerate());
        for (k, bar) in bars.filter(|(_, bar)| finite(&bar[..])) {
            let ends = bar.map(|end| self.at(end));
            // Near the colours of the first two lines in charts of angles.
            let colour = if k % 2 == 0 { SKY } else { ORANGE };
            self.sheet.rod(ends, &Pen::new(mix(colour, INK, 0.3), 5.6 * size))?;
            self.sheet.rod(ends, &Pen::new(mix(colour, WHITE, 0.55), 3.6 * size))?;
            let [from, to] = ends;
            let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1e-9);
            let edge = [-2.5 * size * (to[1] - from[1]) / length, 2.5 * size * (to[0] - from[0]) / length];
            for side in [-1.0, 0.0, 1.0] {
                occupied.line(&ends.map(|end| [end[0] + side * edge[0], end[1] + side * edge[1]]));
            }
        }
        for (spring, ends) in sketch.springs.iter().zip(&pose.springs).filter(|(_, ends)| finite(&ends[..])) {
            self.spring(spring, ends.map(|end| self.at(end)), occupied)?;
        }
        for spiral in pose.spirals.iter().filter(|spiral| finite(&[spiral.at, [spiral.angle, 0.0]])) {
            self.spiral(spiral, occupied)?;
        }
        for motor in pose.motors.iter().filter(|motor| finite(&[motor.at, [motor.angle, motor.rate]])) {
            self.motor(motor, sketch.hinges.len() < NAMES, occupied)?;
        }
        for &at in pose.hinges.iter().filter(|at| finite(&[**at])) {
            self.sheet.ring(self.at(at), 3.1 * size, INK, 1.1 * size)?;
        }
        for (k, &at) in pose.points.iter().enumerate().filter(|(_, at)| finite(&[**at])) {
            self.sheet.disc(self.at(at), 3.3 * size, mix(trail_colour(k), INK, 0.1))?;
        }
        Ok(())
    }

    /// Takes the room of the bars of a pose.
    pub(crate) fn block_bars(&self, pose: &Pose, occupied: &mut Occupied) {
        let bars = pose.arms.iter().map(|(_, bar)| bar).chain(&pose.bars);
        for bar in bars.filter(|bar| finite(&bar[..])) {
            occupied.line(&bar.map(|end| self.at(end)));
        }
    }

    /// An arc ahead of the driven bar, arrow head in the sense of rotation.
    fn motor(&self, motor: &MotorPose, named: bool, occupied: &mut Occupied) -> Result<(), ChartError> {
        let centre = self.at(motor.at);
        let bar = self.view.direction([libm::cos(motor.angle), libm::sin(motor.angle)]);
        // Counter-clockwise on the page, where y points down.
        let start = (-bar[1]).atan2(bar[0]);
        let sense = if motor.rate < 0.0 { -1.0 } else { 1.0 };
        let radius = 21.0 * self.size.max(0.75);
        let on =
            |angle: f64, radius: f64| [centre[0] + radius * angle.cos(), centre[1] - radius * angle.sin()];
        let arc: Vec<Point> =
            (0..=40).map(|k| on(start + sense * (0.3 + 2.1 * f64::from(k) / 40.0), radius)).collect();
        let colour = readable(PURPLE);
        self.sheet.line(&arc, &Pen::new(colour, 1.7 * self.size.max(0.75)))?;
        occupied.line(&arc);
        if motor.rate != 0.0 {
            let tip = on(start + sense * 2.72, radius);
            let origin_point = start + sense * 2.36;
            self.sheet.polygon(
                &[
                    tip,
                    on(origin_point, radius + 3.6),
                    on(origin_point + sense * 0.06, radius),
                    on(origin_point, radius - 3.6),
                ],
                colour,
            )?;
        }
        if named {
            let best = (0..9)
                .map(|k| on(start + sense * (0.4 + 0.25 * f64::from(k)), radius + 9.0))
                .map(|p| (p, occupied.cost(around(p, 5.0))));
            let Some((at, _)) = best.filter(|(_, cost)| *cost < 49.0).min_by(|a, b| a.1.total_cmp(&b.1))
            else {
                return Ok(());
            };
            occupied.block(around(at, 5.0));
            let lettering =
                Lettering { halo: true, ..Lettering::new(NAME, colour).at(Align::Centre, TextLevel::Middle) };
            self.sheet.words("*ω*", lettering, at)?;
        }
        Ok(())
    }
}

pub(crate) fn around([x, y]: Point, half: f64) -> [f64; 4] {
    [x - half, y - half, x + half, y + half]
}

/// Symbols shrink with the bars: 1 while the median bar is longer than 24 pt.
pub(crate) fn symbol_size(pose: &Pose, pt_per_metre: f64) -> f64 {
    let mut lengths: Vec<f64> = pose
        .bars
        .iter()
        .map(|[a, b]| (b[0] - a[0]).hypot(b[1] - a[1]) * pt_per_metre)
        .filter(|l| l.is_finite())
        .collect();
    lengths.sort_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).map_or(1.0, |median| (median / 24.0).clamp(0.5, 1.0))
}
