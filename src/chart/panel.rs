//! A rectangle with two axes: frame, ticks, names, and data drawn inside it.

use super::ChartError;
use super::axis::Axis;
use super::grid::more_labels;
use super::labels::{Occupied, spread};
use super::lines::{Point, clip, envelope, is_dense, turns};
use super::names::axis_lines;
use super::palette::{Colour, GREY, GRID, GUIDE, INK, MarkStyle, SPINE, WHITE, mix, readable};
use super::sheet::{NAME, NOTE, Pen, Sheet, TICK, note, units};
use super::text::{Align, Lettering, TextLevel};
use super::ticks::Ticks;
use plotters::coord::cartesian::Cartesian2d;
use plotters::style::{Color, ShapeStyle};
use std::f64::consts::FRAC_PI_2;

const MAJOR: f64 = 4.0;
const MINOR: f64 = 2.2;
/// Between a tick and its label \[pt\].
const GAP: f64 = 3.5;
/// From the panel's right edge to the words of an end label \[pt\].
pub(crate) const LEADER: f64 = 11.5;

/// How much longer than its panel the name of an upright axis may be, and between its lines \[pt\].
const OVER: f64 = 12.0;
const LINE: f64 = 11.5;

/// Between two labels at the ends of lines, at least \[pt\].
const LEAST: f64 = 9.5;

/// Rings of places tried for a label beside a point, and the distance from which on a line leads to it
/// \[pt\].
const RINGS: u32 = 10;
const FAR: f64 = 12.0;

/// Dashes of the first, second, … series of one colour.
pub(crate) const TURNS: [&[f64]; 4] = [&[], &[6.0, 3.2], &[2.0, 3.0], &[7.0, 3.0, 1.5, 3.0]];

/// Which parts of the frame are written.
#[derive(Clone, Copy)]
pub(crate) struct WrittenParts {
    pub x: bool,
    /// Middle of the name of the y axis, of its last line \[pt\].
    pub y_name_at: f64,
}

/// A rectangle of the page with its axes.
pub(crate) struct Panel<'a> {
    sheet: &'a Sheet,
    /// `[left, top, right, bottom]` \[pt\].
    pub bounds: [f64; 4],
    pub x: Axis,
    pub y: Axis,
    x_most: usize,
    y_most: usize,
}

/// The most ticks whose labels keep apart along `height` \[pt\].
pub(crate) fn most_up(height: f64) -> usize {
    ((height / 19.0) as usize).clamp(2, 9)
}

/// The most ticks whose labels keep apart along `width`.
fn most_along(sheet: &Sheet, axis: &Axis, width: f64) -> usize {
    let fits = |most: &usize| {
        let ticks = axis.ticks(*most);
        let mut end = f64::NEG_INFINITY;
        ticks.majors.iter().all(|tick| {
            let half = 0.5 * sheet.width(&tick.label, TICK, false);
            let middle = axis.fraction(tick.value) * width;
            let free = middle - half > end + 9.0;
            end = middle + half;
            free
        })
    };
    // A downward-running axis visits its ticks from the far end.
    if axis.from > axis.to {
        let upward = Axis { from: axis.to, to: axis.from, ..axis.clone() };
        return most_along(sheet, &upward, width);
    }
    (2..=10).rev().find(fits).unwrap_or(2)
}

/// Room left of a panel for the labels and the name of its y axis \[pt\].
pub(crate) fn left_room(sheet: &Sheet, axis: &Axis, height: f64) -> f64 {
    let ticks = axis.ticks(most_up(height));
    let lines = axis_lines(sheet, &ticks, &axis.name, height + OVER).len();
    widest(sheet, &ticks) + MAJOR + GAP + 8.0 + NAME + (lines - 1) as f64 * LINE
}

fn widest(sheet: &Sheet, ticks: &Ticks) -> f64 {
    ticks.majors.iter().map(|tick| sheet.width(&tick.label, TICK, false)).fold(0.0, f64::max)
}

/// Half of the last label of a horizontal axis that ends at the right edge \[pt\].
pub(crate) fn right_room(sheet: &Sheet, axis: &Axis, width: f64) -> f64 {
    let ticks = axis.ticks(most_along(sheet, axis, width));
    let over = |tick: &super::ticks::Tick| {
        axis.fraction(tick.value) * width + 0.5 * sheet.width(&tick.label, TICK, false) - width
    };
    ticks.majors.iter().map(over).fold(0.0, f64::max)
}

/// What is drawn of a line beyond its horizon.
pub(crate) fn pale(colour: Colour) -> Colour {
    mix(colour, WHITE, 0.7)
}

/// Points up to a time and from it on; both have the one at it.
fn divided(points: &[Point], at: f64) -> (Vec<Point>, Vec<Point>) {
    let first = points.partition_point(|point| point[0] <= at || point[0].is_nan());
    let (mut before, mut beyond) = (points[..first].to_vec(), points[first..].to_vec());
    if let (Some(&[t0, y0]), Some(&[t1, y1])) = (before.last(), beyond.first()) {
        let middle = [at, y0 + (y1 - y0) * ((at - t0) / (t1 - t0))];
        before.push(middle);
        beyond.insert(0, middle);
    }
    (before, beyond)
}

impl<'a> Panel<'a> {
    pub(crate) fn new(sheet: &'a Sheet, bounds: [f64; 4], x: Axis, y: Axis) -> Self {
        let (x_most, y_most) = (most_along(sheet, &x, bounds[2] - bounds[0]), most_up(bounds[3] - bounds[1]));
        sheet.note_panel(bounds);
        Panel { sheet, bounds, x, y, x_most, y_most }
    }

    /// Gives both axes the same step, for panels with equal scales.
    pub(crate) fn equal_steps(mut self) -> Self {
        let step = |axis: &Axis, most: usize| match &axis.ticks(most).majors[..] {
            [first, second, ..] => (second.value - first.value).abs(),
            _ => f64::INFINITY,
        };
        let coarser = step(&self.x, self.x_most).max(step(&self.y, self.y_most)) * (1.0 - 1e-9);
        let fewer = |axis: &Axis, most: usize| {
            (2..=most).rev().find(|&most| step(axis, most) >= coarser).unwrap_or(2)
        };
        (self.x_most, self.y_most) = (fewer(&self.x, self.x_most), fewer(&self.y, self.y_most));
        self
    }

    /// Page from fractions.
    pub(crate) fn page(&self, [x, y]: Point) -> Point {
        let [left, top, right, bottom] = self.bounds;
        [left + x * (right - left), bottom - y * (bottom - top)]
    }

    fn fractions(&self, [x, y]: Point) -> Point {
        [self.x.fraction(x), self.y.fraction(y)]
    }

    /// Page from data.
    pub(crate) fn at(&self, point: Point) -> Point {
        self.page(self.fractions(point))
    }

    /// Grid, spines, ticks and names.
    pub(crate) fn frame(&self, written: WrittenParts) -> Result<(), ChartError> {
        self.grid()?;
        self.scales(written)
    }

    /// Spines, ticks and names.
    pub(crate) fn scales(&self, written: WrittenParts) -> Result<(), ChartError> {
        let [left, top, right, bottom] = self.bounds;
        let spine = Pen::new(SPINE, 0.75);
        let small = Pen::new(SPINE, 0.6);
        let (x_ticks, y_ticks) = (self.x.ticks(self.x_most), self.y.ticks(self.y_most));
        for value in &x_ticks.minors {
            let x = self.page([self.x.fraction(*value), 0.0])[0];
            self.sheet.line(&[[x, bottom], [x, bottom + MINOR]], &small)?;
        }
        for value in &y_ticks.minors {
            let y = self.page([0.0, self.y.fraction(*value)])[1];
            self.sheet.line(&[[left - MINOR, y], [left, y]], &small)?;
        }
        for tick in &x_ticks.majors {
            let x = self.page([self.x.fraction(tick.value), 0.0])[0];
            self.sheet.line(&[[x, bottom], [x, bottom + MAJOR]], &spine)?;
            if written.x {
                self.sheet.words(
                    &tick.label,
                    Lettering::new(TICK, INK).at(Align::Centre, TextLevel::Top),
                    [x, bottom + MAJOR + GAP],
                )?;
            }
        }
        for tick in &y_ticks.majors {
            let y = self.page([0.0, self.y.fraction(tick.value)])[1];
            self.sheet.line(&[[left - MAJOR, y], [left, y]], &spine)?;
            // The lowest label of a narrow panel would meet the first of the x axis otherwise.
            self.sheet.words(
                &tick.label,
                Lettering::new(TICK, INK).at(Align::Right, TextLevel::Middle),
                [left - MAJOR - GAP, y],
            )?;
        }
        self.sheet.line(&[[left, top], [left, bottom]], &spine)?;
        self.sheet.line(&[[left, bottom], [right, bottom]], &spine)?;
        let name = Lettering::new(NAME, INK).at(Align::Centre, TextLevel::Top);
        if written.x {
            self.sheet.words(&x_ticks.name(&self.x.name), name, [0.5 * (left + right), bottom + 22.0])?;
        }
        let upright = Lettering { angle: FRAC_PI_2, ..name.at(Align::Centre, TextLevel::Middle) };
        let lines = axis_lines(self.sheet, &y_ticks, &self.y.name, bottom - top + OVER);
        // The last line stands nearest to the axis.
        for (k, line) in lines.iter().rev().enumerate() {
            self.sheet.words(line, upright, [written.y_name_at - k as f64 * LINE, 0.5 * (top + bottom)])?;
        }
        Ok(())
    }

    /// Grid lines at the labelled ticks, by the mesh of plotters.
    fn grid(&self) -> Result<(), ChartError> {
        let ((left, top), (right, bottom)) =
            (units([self.bounds[0], self.bounds[1]]), units([self.bounds[2], self.bounds[3]]));
        let coordinates: Cartesian2d<Axis, Axis> =
            Cartesian2d::new(self.x.clone(), self.y.clone(), (left..right, bottom..top));
        let style = ShapeStyle { color: GRID.to_rgba(), filled: false, stroke_width: 60 };
        let area = self.sheet.area().apply_coord_spec(coordinates);
        Ok(area.draw_mesh(|canvas, line| line.draw(canvas, &style), self.y_most, self.x_most)?)
    }

    /// Middle of the name of the y axis if it stands as near as its labels allow \[pt\].
    pub(crate) fn name_place(&self) -> f64 {
        let ticks = self.y.ticks(self.y_most);
        self.bounds[0] - MAJOR - GAP - widest(self.sheet, &ticks) - 8.0 - 0.4 * NAME
    }

    /// Draws a line through data, clipped at the frame and broken where a point has no place; returns its
    /// pieces on the page.
    pub(crate) fn series(&self, points: &[Point], pen: &Pen) -> Result<Vec<Vec<Point>>, ChartError> {
        let pieces = clip(points.iter().map(|&point| self.fractions(point)));
        let pieces: Vec<Vec<Point>> =
            pieces.into_iter().map(|piece| piece.into_iter().map(|p| self.page(p)).collect()).collect();
        for piece in &pieces {
            self.sheet.line(piece, pen)?;
        }
        Ok(pieces)
    }

    /// Whether [`Panel::trace`] would draw a band.
    pub(crate) fn crowded(&self, points: &[Point]) -> bool {
        let points: Vec<Point> = points.iter().map(|&point| self.fractions(point)).collect();
        is_dense(&points, self.bounds[2] - self.bounds[0])
    }

    /// Draws a line, or the band between its extremes where it oscillates too fast to be followed.
    pub(crate) fn trace(
        &self,
        points: &[Point],
        colour: Colour,
        width: f64,
    ) -> Result<Vec<Vec<Point>>, ChartError> {
        if !self.crowded(points) {
            let pieces = self.series(points, &Pen::new(colour, width))?;
            if pieces.is_empty() {
                self.dots(points, colour)?;
            }
            return Ok(pieces);
        }
        let fractions: Vec<Point> = points.iter().map(|&point| self.fractions(point)).collect();
        // Each column holds a whole oscillation, so that its extremes are those of the envelope.
        let columns = (turns(&fractions) / 3).min((self.bounds[2] - self.bounds[0]) as usize).max(2);
        let columns = envelope(&fractions, columns);
        let upper: Vec<Point> =
            columns.iter().map(|&(x, _, high)| self.page([x, high.clamp(0.0, 1.0)])).collect();
        let lower: Vec<Point> =
            columns.iter().map(|&(x, low, _)| self.page([x, low.clamp(0.0, 1.0)])).collect();
        let around: Vec<Point> = upper.iter().chain(lower.iter().rev()).copied().collect();
        self.sheet.polygon(&around, mix(colour, WHITE, 0.62))?;
        for edge in [&upper, &lower] {
            self.sheet.line(edge, &Pen::new(colour, 0.7))?;
        }
        Ok(vec![upper, lower])
    }

    /// [`Panel::trace`] in full colour up to a time, and pale beyond it.
    pub(crate) fn trusted(
        &self,
        points: &[Point],
        colour: Colour,
        width: f64,
        horizon: Option<f64>,
    ) -> Result<Vec<Vec<Point>>, ChartError> {
        let Some(horizon) = horizon else { return self.trace(points, colour, width) };
        let (before, beyond) = divided(points, horizon);
        // The pale part first, so that the line begins where the other ends.
        let mut pieces = Vec::new();
        for (part, colour) in [(beyond, pale(colour)), (before, colour)] {
            if !part.is_empty() {
                pieces.push(self.trace(&part, colour, width)?);
            }
        }
        Ok(pieces.into_iter().rev().flatten().collect())
    }

    /// The same of rows, which may be too far apart for a line.
    pub(crate) fn trusted_rows(
        &self,
        rows: &[Point],
        (colour, width): (Colour, f64),
        horizon: Option<f64>,
        is_coarse: bool,
    ) -> Result<Vec<Vec<Point>>, ChartError> {
        match is_coarse {
            true => self.trusted_dots(rows, colour, horizon),
            false => self.trusted(rows, colour, width, horizon),
        }
    }

    /// The points alone in full colour up to a time, and pale beyond it.
    fn trusted_dots(
        &self,
        points: &[Point],
        colour: Colour,
        horizon: Option<f64>,
    ) -> Result<Vec<Vec<Point>>, ChartError> {
        let known = points.partition_point(|point| horizon.is_none_or(|horizon| point[0] <= horizon));
        self.dots(&points[known..], pale(colour))?;
        self.dots(&points[..known], colour)?;
        Ok(vec![points.iter().map(|&point| self.page(self.fractions(point))).collect()])
    }

    /// A thin upright line at a time, with words at its top where there is room for them.
    pub(crate) fn horizon(&self, at: Option<f64>, words: Option<&str>) -> Result<(), ChartError> {
        let Some(share) = at.map(|at| self.x.fraction(at)).filter(|share| (0.0..=1.0).contains(share)) else {
            return Ok(());
        };
        let ([x, top], [_, bottom]) = (self.page([share, 1.0]), self.page([share, 0.0]));
        self.sheet.line(&[[x, top], [x, bottom]], &Pen::new(GREY, 0.6))?;
        let Some(words) = words else { return Ok(()) };
        let half = 0.5 * self.sheet.width(words, NOTE, false);
        let middle = x.clamp(self.bounds[0] + half, (self.bounds[2] - half).max(self.bounds[0] + half));
        self.sheet.words(words, note(GREY, Align::Centre, TextLevel::Baseline), [middle, top - 3.0])
    }

    /// Data that make no line, as dots.
    pub(crate) fn dots(&self, points: &[Point], colour: Colour) -> Result<(), ChartError> {
        for point in points
            .iter()
            .map(|&point| self.fractions(point))
            .filter(|p| p.iter().all(|c| (0.0..=1.0).contains(c)))
        {
            self.sheet.disc(self.page(point), 1.2, colour)?;
        }
        Ok(())
    }

    /// A dotted horizontal line at a value.
    pub(crate) fn level(&self, value: f64) -> Result<(), ChartError> {
        let ends = [self.x.from, self.x.to].map(|x| [x, value]);
        self.series(&ends, &Pen::new(GUIDE, 0.8).dashed(&[1.0, 2.2]))?;
        Ok(())
    }

    /// Words in the middle of a panel without data.
    pub(crate) fn empty(&self, words: &str) -> Result<(), ChartError> {
        self.sheet.words(words, note(GREY, Align::Centre, TextLevel::Middle), self.page([0.5, 0.5]))
    }

    /// How many labels at the ends of lines can be told apart.
    pub(crate) fn labels_that_fit(&self) -> usize {
        1 + ((self.bounds[3] - self.bounds[1] - 4.0).max(0.0) / LEAST) as usize
    }

    /// Labels right of the panel at the ends of lines: height of the end \[pt\], words, mark.  Of more than
    /// fit the first have one, and a last line says how many more there are.
    pub(crate) fn end_labels(
        &self,
        ends: &[(f64, String, MarkStyle)],
        markers: bool,
    ) -> Result<(), ChartError> {
        let most = self.labels_that_fit();
        let (top, mut bottom) = (self.bounds[1] + 2.0, self.bounds[3] - 2.0);
        let (ends, more) = ends.split_at(if ends.len() > most { most - 1 } else { ends.len() });
        if !more.is_empty() {
            let words = more_labels(more.len());
            let lettering = note(GREY, Align::Left, TextLevel::Middle);
            self.sheet.words(&words, lettering, [self.bounds[2] + LEADER, bottom])?;
            bottom -= LEAST;
        }
        let wanted: Vec<f64> = ends.iter().map(|end| end.0).collect();
        let places = spread(&wanted, 12.0, top, bottom);
        let right = self.bounds[2];
        for ((at, words, mark), place) in ends.iter().zip(places) {
            // A label hardly moved gets a straight leader.
            let place = if (place - at).abs() < 2.2 { *at } else { place };
            self.sheet.line(&[[right + 2.5, *at], [right + 9.0, place]], &Pen::new(mark.colour, 0.9))?;
            let mut x = right + LEADER;
            if markers {
                self.sheet.marker([x + 2.5, place], mark.shape, mark.colour)?;
                x += 8.0;
            }
            self.sheet.words(
                words,
                note(readable(mark.colour), Align::Left, TextLevel::Middle),
                [x, place],
            )?;
        }
        Ok(())
    }

    /// Draws words inside the panel beside a place, where they cover least.
    pub(crate) fn note_beside(
        &self,
        at: Point,
        words: &str,
        colour: Colour,
        occupied: &mut Occupied,
    ) -> Result<(), ChartError> {
        let size = [self.sheet.width(words, NOTE, false), NOTE];
        let (bounds, _) = super::labels::place(at, 5.0, RINGS, size, self.bounds, &[], occupied);
        occupied.block(bounds);
        let near = [at[0].clamp(bounds[0], bounds[2]), at[1].clamp(bounds[1], bounds[3])];
        let apart = [near[0] - at[0], near[1] - at[1]];
        let length = apart[0].hypot(apart[1]);
        if length > FAR {
            let from = [at[0] + 3.4 / length * apart[0], at[1] + 3.4 / length * apart[1]];
            self.sheet.line(&[from, near], &Pen::new(colour, 0.6))?;
        }
        let lettering = Lettering { halo: true, ..note(colour, Align::Left, TextLevel::Middle) };
        self.sheet.words(words, lettering, [bounds[0], 0.5 * (bounds[1] + bounds[3])])
    }
}
