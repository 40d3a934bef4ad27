//! What stands beside a mechanism: names, the arrow of gravity, a scale bar, a legend of paths.

use super::ChartError;
use super::labels::{Occupied, place};
use super::lines::Point;
use super::palette::{Colour, GREY, INK};
use super::sheet::{CAPTION, NAME, NOTE, Pen, Sheet, note};
use super::sketch::{NAMES, Pencil, Pose, Sketch, around, finite, trail_colour};
use super::text::{Align, Lettering, TextLevel};
use super::ticks::{nice_step, nice_words};

/// Share of the panel that a scale bar takes about.
const BAR: f64 = 0.12;
/// Length of the line of a legend \[pt\].
const SAMPLE: f64 = 14.0;

impl Pencil<'_> {
    /// Names of hinges and points beside them, away from the bars that meet there.
    pub(crate) fn names(
        &self,
        sketch: &Sketch,
        pose: &Pose,
        occupied: &mut Occupied,
    ) -> Result<(), ChartError> {
        let hinges = sketch.hinges.iter().map(|hinge| &hinge.name).zip(&pose.hinges);
        let all: Vec<(&String, &[f64; 2])> = hinges
            .chain(sketch.points.iter().zip(&pose.points))
            .filter(|(name, at)| !name.is_empty() && finite(&[**at]))
            .collect();
        if all.len() >= NAMES {
            return Ok(());
        }
        for &(_, &at) in &all {
            occupied.block(around(self.at(at), 3.5));
        }
        for (name, &at) in all {
            let here = self.at(at);
            let mut avoid = Vec::new();
            for bar in &pose.bars {
                let ends = bar.map(|end| self.at(end));
                for (near, far) in [(ends[0], ends[1]), (ends[1], ends[0])] {
                    let length = (far[0] - near[0]).hypot(far[1] - near[1]);
                    if (near[0] - here[0]).hypot(near[1] - here[1]) < 1.0 && length > 0.0 {
                        avoid.push([(far[0] - near[0]) / length, (far[1] - near[1]) / length]);
                    }
                }
            }
            let size = [self.sheet.width(name, NAME, false), 0.75 * NAME];
            let (bounds, cost) = place(here, 5.5, 2, size, self.panel.bounds, &avoid, occupied);
            // A name that would lie on another one is worse than none.
            if cost > 49.0 {
                continue;
            }
            occupied.block(bounds);
            let lettering =
                Lettering { halo: true, ..Lettering::new(NAME, INK).at(Align::Left, TextLevel::Middle) };
            self.sheet.words(name, lettering, [bounds[0], 0.5 * (bounds[1] + bounds[3])])?;
        }
        Ok(())
    }

    /// Arrow of gravity in the emptiest corner, and the directions of x and y where they lie oblique to the
    /// page.
    pub(crate) fn compass(&self, occupied: &mut Occupied) -> Result<(), ChartError> {
        let [left, top, right, bottom] = self.panel.bounds;
        let corner = |occupied: &Occupied, half: f64| {
            let inset = half + 6.0;
            let corners = [
                [right - inset, top + inset],
                [left + inset, top + inset],
                [right - inset, bottom - inset],
                [left + inset, bottom - inset],
            ];
            let costs = corners.map(|at| occupied.cost(around(at, half)));
            let best = (0..4).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
            corners[best]
        };
        if self.view.falls() {
            let [x, y] = corner(occupied, 16.0);
            occupied.block(around([x, y], 16.0));
            self.arrow([x + 6.0, y - 13.0], [x + 6.0, y + 14.0], GREY)?;
            let lettering = Lettering::new(NAME + 1.0, GREY).at(Align::Centre, TextLevel::Middle);
            self.sheet.words("*g*", lettering, [x - 5.0, y - 2.0])?;
        }
        if self.view.oblique() {
            let centre = corner(occupied, 20.0);
            occupied.block(around(centre, 20.0));
            for (axis, name) in [([1.0, 0.0], "*x*"), ([0.0, 1.0], "*y*")] {
                let d = self.view.direction(axis);
                self.arrow(centre, [centre[0] + 15.0 * d[0], centre[1] + 15.0 * d[1]], GREY)?;
                let lettering = Lettering::new(NAME - 1.0, GREY).at(Align::Centre, TextLevel::Middle);
                self.sheet.words(name, lettering, [centre[0] + 21.0 * d[0], centre[1] + 21.0 * d[1]])?;
            }
        }
        Ok(())
    }

    fn arrow(&self, from: Point, to: Point, colour: Colour) -> Result<(), ChartError> {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1e-9);
        let (along, across) = (
            [(to[0] - from[0]) / length, (to[1] - from[1]) / length],
            [-(to[1] - from[1]) / length, (to[0] - from[0]) / length],
        );
        let back =
            |s: f64, w: f64| [to[0] - s * along[0] + w * across[0], to[1] - s * along[1] + w * across[1]];
        self.sheet.line(&[from, back(4.0, 0.0)], &Pen::new(colour, 1.3))?;
        self.sheet.polygon(&[to, back(6.5, 3.0), back(5.0, 0.0), back(6.5, -3.0)], colour)
    }

    /// A round length in the emptiest lower corner.
    pub(crate) fn scale_bar(&self, occupied: &mut Occupied) -> Result<(), ChartError> {
        let [left, _, right, bottom] = self.panel.bounds;
        let scale = self.view.scale(right - left);
        let length = nice_step(BAR * (right - left) / scale);
        if !(length.is_finite() && length > 0.0) {
            return Ok(());
        }
        let words = format!("{} m", nice_words(length));
        let wide = (length * scale).max(self.sheet.width(&words, CAPTION, false));
        // A corner where one is free, else a place between them.
        let (first, last) = (left + 8.0, right - 8.0 - wide);
        let places = [0.0, 1.0, 0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875]
            .map(|share| first + share * (last - first).max(0.0))
            .map(|x| [x, bottom - 22.0, x + wide, bottom - 6.0]);
        let cost = |bounds: &&[f64; 4]| occupied.cost(**bounds);
        let cheapest = places.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
        let bounds = cheapest.copied().unwrap_or(places[0]);
        occupied.block(bounds);
        let (middle, y) = (0.5 * (bounds[0] + bounds[2]), bounds[3] - 2.0);
        let [from, to] = [-0.5, 0.5].map(|share| middle + share * length * scale);
        let pen = Pen::new(GREY, 1.2);
        self.sheet.line(&[[from, y], [to, y]], &pen)?;
        for end in [from, to] {
            self.sheet.line(&[[end, y - 3.0], [end, y + 0.6]], &pen)?;
        }
        let lettering =
            Lettering { halo: true, ..Lettering::new(CAPTION, GREY).at(Align::Centre, TextLevel::Baseline) };
        self.sheet.words(&words, lettering, [middle, y - 5.5])
    }
}

/// Colours and names of paths in a row from `at`; names that do not fit are left out.
pub(crate) fn legend(sheet: &Sheet, names: &[String], at: Point) -> Result<(), ChartError> {
    let mut x = at[0];
    for (k, name) in names.iter().enumerate() {
        let width = sheet.width(name, NOTE, false);
        if x + SAMPLE + 4.0 + width > sheet.size[0] - at[0] {
            break;
        }
        sheet.line(&[[x, at[1]], [x + SAMPLE, at[1]]], &Pen::new(trail_colour(k), 2.2))?;
        sheet.words(name, note(GREY, Align::Left, TextLevel::Middle), [x + SAMPLE + 4.0, at[1]])?;
        x += SAMPLE + 4.0 + width + 14.0;
    }
    Ok(())
}
