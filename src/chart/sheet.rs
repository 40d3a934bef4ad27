//! A page in points: lines, areas, markers, words and the heading; everything reaches the canvas as an
//! element of plotters.

use super::ChartError;
use super::canvas::{Canvas, UNITS};
use super::file::Picture;
use super::lines::{Point, dashes};
use super::palette::{Colour, GREY, INK, MarkerShape, WHITE};
use super::text::{Align, Lettering, TextLevel, unmarked};
use plotters::coord::Shift;
use plotters::drawing::DrawingArea;
use plotters::element::{Circle, Drawable, PathElement, PointCollection, Polygon};
use plotters::style::{Color, ShapeStyle};
use plotters_backend::{BackendCoord, DrawingErrorKind};
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

/// Sizes of words \[pt\].
pub(crate) const TITLE: f64 = 11.5;
pub(crate) const NAME: f64 = 9.5;
pub(crate) const TICK: f64 = 8.5;
pub(crate) const NOTE: f64 = 8.5;
pub(crate) const CAPTION: f64 = 8.0;
/// Left edge of the heading \[pt\].
pub(crate) const EDGE: f64 = 14.0;
/// Between two lines of a caption \[pt\].
const LINE: f64 = 11.5;

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pen {
    pub colour: Colour,
    /// Width \[pt\].
    pub width: f64,
    /// Lengths drawn and left out by turns \[pt\]; empty for a whole line.
    pub dash: &'static [f64],
}

impl Pen {
    pub(crate) fn new(colour: Colour, width: f64) -> Self {
        Pen { colour, width, dash: &[] }
    }

    pub(crate) fn dashed(self, dash: &'static [f64]) -> Self {
        Pen { dash, ..self }
    }
}

/// A page being drawn.
pub(crate) struct Sheet {
    canvas: Rc<RefCell<Canvas>>,
    area: DrawingArea<Canvas, Shift>,
    /// Width and height \[pt\].
    pub size: [f64; 2],
    px_per_pt: f64,
    panels: RefCell<Vec<[f64; 4]>>,
}

/// Backend units from points.
pub(crate) fn units(point: Point) -> BackendCoord {
    let whole = |x: f64| (x * UNITS).round().clamp(-1e8, 1e8) as i32;
    (whole(point[0]), whole(point[1]))
}

fn style(colour: Colour, width: f64, filled: bool) -> ShapeStyle {
    ShapeStyle { color: colour.to_rgba(), filled, stroke_width: (width * UNITS).round().max(1.0) as u32 }
}

/// Words as an element of plotters, with what its own text element lacks: markup, any angle, a rim.
struct Words<'a> {
    at: BackendCoord,
    text: &'a str,
    lettering: Lettering,
}

impl<'a> PointCollection<'a, BackendCoord> for &'a Words<'_> {
    type Point = &'a BackendCoord;
    type IntoIter = std::iter::Once<&'a BackendCoord>;

    fn point_iter(self) -> Self::IntoIter {
        std::iter::once(&self.at)
    }
}

impl Drawable<Canvas> for Words<'_> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        pos: I,
        backend: &mut Canvas,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<Infallible>> {
        for (x, y) in pos {
            backend.words(self.text, &self.lettering, [f64::from(x) / UNITS, f64::from(y) / UNITS]);
        }
        Ok(())
    }
}

/// A rectangle of pixels as an element of plotters, whose own one needs its bitmap backend.
struct Raster<F> {
    at: BackendCoord,
    size: (usize, usize),
    colour: F,
}

impl<'a, F> PointCollection<'a, BackendCoord> for &'a Raster<F> {
    type Point = &'a BackendCoord;
    type IntoIter = std::iter::Once<&'a BackendCoord>;

    fn point_iter(self) -> Self::IntoIter {
        std::iter::once(&self.at)
    }
}

impl<F: Fn(usize, usize) -> Colour> Drawable<Canvas> for Raster<F> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        pos: I,
        backend: &mut Canvas,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<Infallible>> {
        for (x, y) in pos {
            backend.raster([f64::from(x) / UNITS, f64::from(y) / UNITS], self.size, &self.colour);
        }
        Ok(())
    }
}

impl Sheet {
    /// A white page of `size` \[pt\].
    pub(crate) fn new(size: [f64; 2], px_per_pt: f64) -> Result<Self, ChartError> {
        let canvas = Rc::new(RefCell::new(Canvas::new(size, px_per_pt)?));
        let area = DrawingArea::from(&canvas);
        Ok(Sheet { canvas, area, size, px_per_pt, panels: RefCell::default() })
    }

    pub(crate) fn area(&self) -> &DrawingArea<Canvas, Shift> {
        &self.area
    }

    /// A polyline.
    pub(crate) fn line(&self, points: &[Point], pen: &Pen) -> Result<(), ChartError> {
        for dash in dashes(points, pen.dash) {
            let path: Vec<BackendCoord> = dash.into_iter().map(units).collect();
            self.area.draw(&PathElement::new(path, style(pen.colour, pen.width, false)))?;
        }
        Ok(())
    }

    /// A straight line with round ends in every direction.
    pub(crate) fn rod(&self, [from, to]: [Point; 2], pen: &Pen) -> Result<(), ChartError> {
        let (start, end) = (units(from), units(to));
        if start.0 == end.0 || start.1 == end.1 {
            // The canvas takes two points along an edge of the page for a rule, which ends in corners.
            let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
            return self.line(&[from, middle, to], pen);
        }
        self.line(&[from, to], pen)
    }

    /// A filled area.
    pub(crate) fn polygon(&self, points: &[Point], colour: Colour) -> Result<(), ChartError> {
        let corners: Vec<BackendCoord> = points.iter().copied().map(units).collect();
        Ok(self.area.draw(&Polygon::new(corners, style(colour, 1.0, true)))?)
    }

    /// A filled disc.
    pub(crate) fn disc(&self, at: Point, radius: f64, colour: Colour) -> Result<(), ChartError> {
        Ok(self.area.draw(&Circle::new(
            units(at),
            (radius * UNITS).round() as i32,
            style(colour, 1.0, true),
        ))?)
    }

    /// A disc with a rim inside its radius.
    pub(crate) fn ring(&self, at: Point, radius: f64, colour: Colour, width: f64) -> Result<(), ChartError> {
        self.disc(at, radius, colour)?;
        self.disc(at, radius - width, WHITE)
    }

    /// A marker with a white rim.
    pub(crate) fn marker(&self, at: Point, shape: MarkerShape, colour: Colour) -> Result<(), ChartError> {
        let polygon = |corners: &[Point], grow: f64| -> Vec<Point> {
            corners.iter().map(|c| [at[0] + c[0] * grow, at[1] + c[1] * grow]).collect()
        };
        let (corners, rim): (&[Point], f64) = match shape {
            MarkerShape::Disc => {
                self.disc(at, 3.5, WHITE)?;
                return self.disc(at, 2.5, colour);
            }
            MarkerShape::Ring => {
                self.disc(at, 3.5, WHITE)?;
                return self.ring(at, 2.6, colour, 1.2);
            }
            MarkerShape::Square => (&[[-2.3, -2.3], [2.3, -2.3], [2.3, 2.3], [-2.3, 2.3]], 1.4),
            MarkerShape::Diamond => (&[[0.0, -3.1], [3.1, 0.0], [0.0, 3.1], [-3.1, 0.0]], 1.45),
            MarkerShape::Up => (&[[0.0, -3.2], [2.9, 2.0], [-2.9, 2.0]], 1.6),
            MarkerShape::Down => (&[[0.0, 3.2], [2.9, -2.0], [-2.9, -2.0]], 1.6),
        };
        self.polygon(&polygon(corners, rim), WHITE)?;
        self.polygon(&polygon(corners, 1.0), colour)
    }

    /// A rectangle of so many pixels, given its upper left corner and the colour of each column and row.
    pub(crate) fn raster(
        &self,
        at: Point,
        size: (usize, usize),
        colour: impl Fn(usize, usize) -> Colour,
    ) -> Result<(), ChartError> {
        Ok(self.area.draw(&Raster { at: units(at), size, colour })?)
    }

    /// Words anchored at a place.
    pub(crate) fn words(&self, text: &str, lettering: Lettering, at: Point) -> Result<(), ChartError> {
        if text.is_empty() {
            return Ok(());
        }
        Ok(self.area.draw(&Words { at: units(at), text, lettering })?)
    }

    /// Width of words \[pt\].
    pub(crate) fn width(&self, text: &str, size: f64, bold: bool) -> f64 {
        self.canvas.borrow().fonts().width(text, size, bold)
    }

    /// Remembers a data area, for those who want to find it in the picture.
    pub(crate) fn note_panel(&self, bounds: [f64; 4]) {
        self.panels.borrow_mut().push(bounds);
    }

    /// Title and caption; returns the lowest baseline \[pt\].
    pub(crate) fn heading(&self, title: &str, caption: &[String]) -> Result<f64, ChartError> {
        let room = self.size[0] - 2.0 * EDGE;
        let mut y = 9.5;
        for line in wrap(&[title.to_owned()], room, |text| self.width(text, TITLE, true)) {
            y += if y < 10.0 { TITLE } else { 1.25 * TITLE };
            self.words(&line, Lettering { bold: true, ..Lettering::new(TITLE, INK) }, [EDGE, y])?;
        }
        y += 1.5;
        for line in wrap(caption, room, |text| self.width(text, CAPTION, false)) {
            y += LINE;
            self.words(&line, Lettering::new(CAPTION, GREY), [EDGE, y])?;
        }
        Ok(y)
    }

    /// Copies the pixels drawn so far.
    pub(crate) fn pixels(&self) -> Vec<u8> {
        self.canvas.borrow().rgb()
    }

    /// Goes back to pixels copied before.
    pub(crate) fn restore(&self, rgb: &[u8]) {
        self.canvas.borrow_mut().restore(rgb);
    }

    /// Width and height \[px\].
    pub(crate) fn dimensions(&self) -> (u32, u32) {
        self.canvas.borrow().dimensions()
    }

    /// The finished picture.
    pub(crate) fn picture(&self, title: &str, caption: &[String]) -> Picture {
        let canvas = self.canvas.borrow();
        let (width, height) = canvas.dimensions();
        Picture {
            width,
            height,
            rgb: canvas.rgb(),
            px_per_pt: self.px_per_pt,
            title: unmarked(title),
            description: unmarked(&caption.join(" · ")),
            texts: canvas.texts().to_vec(),
            panels: self.panels.borrow().clone(),
            drawing: canvas.drawing().clone(),
        }
    }
}

/// The words of a part, a number and what follows it as one, with a space inside that does not break.
fn words_of(part: &str) -> Vec<String> {
    let is_number = |word: &str| {
        let digits = word.trim_start_matches(['−', '-', '+']);
        digits.starts_with(|c: char| c.is_ascii_digit())
            && digits.chars().all(|c| c.is_ascii_digit() || "e.,·×^{}−-+\u{2009}".contains(c))
    };
    let mut words: Vec<String> = Vec::new();
    let mut after_number = false;
    // Thin spaces stand between the digits of a number.
    let parts = part.split(|c: char| c.is_whitespace() && c != '\u{2009}').filter(|word| !word.is_empty());
    for word in parts {
        match words.last_mut() {
            Some(number) if after_number && word.starts_with(char::is_alphabetic) => {
                number.push(' ');
                number.push_str(word);
            }
            _ => words.push(word.to_owned()),
        }
        after_number = is_number(word);
    }
    words
}

/// A word in pieces no wider than `room`; markup stays whole, and so do numbers with units.
fn pieces(word: &str, room: f64, width: impl Fn(&str) -> f64) -> Vec<String> {
    if word.contains(char::is_whitespace) || width(word) <= room {
        return vec![word.to_owned()];
    }
    let mut pieces = vec![String::new()];
    let (mut is_inside, mut is_escaped) = (false, false);
    for letter in word.chars() {
        let is_free = !is_inside && !is_escaped && letter != '}';
        if let Some(piece) = pieces.last_mut() {
            if !is_free || piece.is_empty() || width(&format!("{piece}{letter}")) <= room {
                piece.push(letter);
            } else {
                pieces.push(letter.to_string());
            }
        }
        is_inside = letter == '{' || is_inside && letter != '}';
        is_escaped = matches!(letter, '\\' | '^' | '_') && !is_escaped;
    }
    pieces
}

/// Lines no wider than `room`: parts joined by middle dots, broken at a dot, or between words where one part
/// is too long, or within a word that is.
fn wrap(parts: &[String], room: f64, width: impl Fn(&str) -> f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    for part in parts.iter().filter(|part| !part.trim().is_empty()) {
        let words = words_of(part);
        let all = words.iter().enumerate().flat_map(|(k, word)| {
            pieces(word, room, &width).into_iter().enumerate().map(move |(n, piece)| (k, n, piece))
        });
        for (k, n, piece) in all {
            let joint = match (line.is_empty(), k, n) {
                (true, ..) | (.., 1..) => "",
                (false, 0, _) => "   ·   ",
                (false, ..) => " ",
            };
            let is_first = k == 0 && n == 0;
            // A part that fits into a line of its own is not torn.
            let whole = if is_first { part } else { &piece };
            let fits = width(&format!("{line}{joint}{whole}")) <= room
                || (is_first && width(part) > room && width(&format!("{line}{joint}{piece}")) <= room);
            if !fits && !line.is_empty() {
                lines.push(std::mem::take(&mut line));
                line.push_str(&piece);
            } else {
                line.push_str(joint);
                line.push_str(&piece);
            }
        }
    }
    lines.extend((!line.is_empty()).then_some(line));
    lines
}

/// Letters for a label in the middle left of its anchor and the like.
pub(crate) fn note(colour: Colour, align: Align, level: TextLevel) -> Lettering {
    Lettering::new(NOTE, colour).at(align, level)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rods_have_round_ends_in_every_direction() {
        for to in [[70.0, 50.0], [30.0, 70.0], [69.0, 57.0], [10.0, 50.0]] {
            let sheet = Sheet::new([100.0, 100.0], 1.0).unwrap();
            let from = [30.0, 50.0];
            sheet.rod([from, to], &Pen::new(INK, 10.0)).unwrap();
            let length = (to[0] - from[0]).hypot(to[1] - from[1]);
            let pixels = sheet.pixels();
            let is_inked = |away: f64| {
                let [x, y] = [0, 1].map(|k| (to[k] + away * (to[k] - from[k]) / length) as usize);
                pixels[3 * (100 * y + x)] < 200
            };
            assert!(is_inked(3.0) && !is_inked(7.0), "to {to:?}");
        }
    }

    #[test]
    fn captions_break_at_dots_first() {
        let width = |text: &str| text.chars().count() as f64;
        let parts = ["one two".to_owned(), "three four".to_owned()];
        assert_eq!(wrap(&parts, 16.0, width), ["one two", "three four"]);
        assert_eq!(wrap(&parts, 60.0, width), ["one two   ·   three four"]);
        assert_eq!(wrap(&parts, 6.0, width), ["one", "two", "three", "four"]);
        assert!(wrap(&[], 6.0, width).is_empty());
        assert_eq!(wrap(&["of a_long-name on".to_owned()], 6.0, width), ["of", "a_long", "-name", "on"]);
        let title = ["at most 2·10^{−14} m over 0.4 s".to_owned()];
        assert_eq!(
            wrap(&title, 30.0, width),
            ["at most 2·10^{−14} m over", "0.4 s"],
            "units stay at numbers"
        );
        assert_eq!(wrap(&["over 10\u{2009}000 s".to_owned()], 6.0, width), ["over", "10\u{2009}000 s"]);
    }
}
