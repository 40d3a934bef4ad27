//! What a mechanism has beside its bars: rails and blocks of sliders, springs, torsion springs.

use super::{Pencil, SliderPose, SpiralPose, SpringSketch, around, finite};
use crate::chart::ChartError;
use crate::chart::labels::Occupied;
use crate::chart::lines::{Point, clip};
use crate::chart::palette::{GREEN, INK, SPINE, WHITE, mix};
use crate::chart::sheet::Pen;
use std::f64::consts::TAU;

/// Turns of a torsion spring, and its points.
const SPIRAL: (f64, usize) = (1.75, 60);

/// A slider with its rail's direction on the page, of length one.
fn directed(sliders: &[SliderPose]) -> impl Iterator<Item = (&SliderPose, [f64; 2])> {
    sliders.iter().filter(|slider| finite(&[slider.at, slider.along])).filter_map(|slider| {
        let length = slider.along[0].hypot(slider.along[1]);
        (length > 0.0).then(|| (slider, slider.along.map(|x| x / length)))
    })
}

impl Pencil<'_> {
    /// Rails of the ground from frame to frame.
    pub(crate) fn rails(&self, sliders: &[SliderPose], occupied: &mut Occupied) -> Result<(), ChartError> {
        let pen = Pen::new(mix(SPINE, WHITE, 0.25), 0.9 * self.size.max(0.7));
        for (slider, unit) in directed(sliders).filter(|(slider, _)| slider.ground) {
            let reach = self.view.reach() + slider.at[0].hypot(slider.at[1]);
            let ends = [-reach, reach]
                .map(|s| self.view.fractions([slider.at[0] + s * unit[0], slider.at[1] + s * unit[1]]));
            for piece in clip(ends) {
                let line = [self.panel.page(piece[0]), self.panel.page(piece[1])];
                occupied.line(&line);
                self.sheet.line(&line, &pen)?;
            }
        }
        Ok(())
    }

    /// The blocks on the rails.
    pub(super) fn blocks(&self, sliders: &[SliderPose], occupied: &mut Occupied) -> Result<(), ChartError> {
        for (slider, unit) in directed(sliders) {
            let ([dx, dy], [x, y]) = (self.view.direction(unit), self.at(slider.at));
            let corner =
                |along: f64, across: f64| [x + along * dx - across * dy, y + along * dy + across * dx];
            let (half, wide) = (8.0 * self.size, 4.6 * self.size);
            let block = [corner(-half, -wide), corner(half, -wide), corner(half, wide), corner(-half, wide)];
            self.sheet.polygon(&block, mix(SPINE, WHITE, 0.7))?;
            self.sheet
                .line(&[block[0], block[1], block[2], block[3], block[0]], &Pen::new(INK, 0.9 * self.size))?;
            occupied.block(around([x, y], half));
        }
        Ok(())
    }

    /// A torsion spring: a spiral whose outer end lies on its bar.
    pub(super) fn spiral(&self, spiral: &SpiralPose, occupied: &mut Occupied) -> Result<(), ChartError> {
        let centre = self.at(spiral.at);
        let bar = self.view.direction([libm::cos(spiral.angle), libm::sin(spiral.angle)]);
        let end = (-bar[1]).atan2(bar[0]);
        let (turns, points) = SPIRAL;
        let on = |k: usize| {
            let share = k as f64 / points as f64;
            let (angle, radius) = (end - TAU * turns * (1.0 - share), (4.5 + 9.0 * share) * self.size);
            [centre[0] + radius * angle.cos(), centre[1] - radius * angle.sin()]
        };
        let line: Vec<Point> = (0..=points).map(on).collect();
        self.elastic(&line)?;
        occupied.block(around(centre, 13.5 * self.size));
        Ok(())
    }

    /// The line of a spring.
    fn elastic(&self, line: &[Point]) -> Result<(), ChartError> {
        self.sheet.line(line, &Pen::new(WHITE, 3.2 * self.size))?;
        self.sheet.line(line, &Pen::new(mix(GREEN, INK, 0.15), 1.6 * self.size))
    }

    /// A spring between two places.
    pub(super) fn spring(
        &self,
        spring: &SpringSketch,
        [from, to]: [Point; 2],
        occupied: &mut Occupied,
    ) -> Result<(), ChartError> {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.hypot(dy);
        for (k, at) in [from, to].into_iter().enumerate().filter(|(k, _)| spring.ground[*k]) {
            let away = if k == 0 { dy } else { -dy };
            // The hatching lies on the side the spring does not leave to.
            let up = if away >= 0.0 { -1.0 } else { 1.0 };
            let half = 7.5 * self.size;
            self.hatched(
                [at[0] - half, at[1]],
                [at[0] + half, at[1]],
                [0.0, up],
                3.6 * self.size,
                4.4 * self.size,
            )?;
            occupied.block([at[0] - half, at[1] - 5.0, at[0] + half, at[1] + 5.0]);
        }
        let (along, across) = if length > 0.0 {
            ([dx / length, dy / length], [-dy / length, dx / length])
        } else {
            ([0.0; 2], [0.0; 2])
        };
        let lead = (0.15 * length).min(8.0 * self.size);
        let waves = 11;
        let mut line = vec![from];
        for k in 0..=waves {
            let s = lead + (length - 2.0 * lead) * f64::from(k) / f64::from(waves);
            let offset =
                if k == 0 || k == waves { 0.0 } else { 4.6 * self.size * f64::from(1 - 2 * (k % 2)) };
            line.push([
                from[0] + s * along[0] + offset * across[0],
                from[1] + s * along[1] + offset * across[1],
            ]);
        }
        line.push(to);
        self.elastic(&line)?;
        occupied.line(&line);
        for at in [from, to] {
            self.sheet.disc(at, 2.1 * self.size, INK)?;
        }
        Ok(())
    }
}
