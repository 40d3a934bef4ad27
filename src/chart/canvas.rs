//! A drawing backend for plotters with smooth edges.
//!
//! The bitmap backend of plotters fills thick lines as one polygon by the even-odd rule (holes where a line
//! crosses itself), rounds widths and circles to whole pixels and needs fonts of the system.  This one draws
//! with tiny-skia instead.  Plotters speaks in whole numbers; one of its units is 1/100 pt here, so widths
//! and curves stay fine.

mod backend;

use super::ChartError;
use super::mark::{Drawing, Mark, scaled};
use super::palette::{Colour, WHITE};
use super::text::{Align, CAP_HEIGHT, Fonts, Lettering, TextBox, TextLevel, unmarked};
use plotters_backend::{BackendColor, BackendCoord};
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, Transform,
};

/// Units of the backend in a point of 1/72 inch.
pub(crate) const UNITS: f64 = 100.0;

/// White rim of words that lie on lines \[pt\].
const HALO: f64 = 1.2;

/// Least distance of two points of a line \[pt\]: nearer ones add joints, not shape.
const NEAR: f64 = 1.0 / 16.0;

/// A page: its marks, and the same as pixels.
pub(crate) struct Canvas {
    pixels: Pixmap,
    drawing: Drawing,
    /// Pixels per point.
    scale: f64,
    fonts: Fonts,
    texts: Vec<TextBox>,
}

impl Canvas {
    /// A white page of `size` \[pt\].
    pub(crate) fn new(size: [f64; 2], px_per_pt: f64) -> Result<Self, ChartError> {
        if !(0.1..=20.0).contains(&px_per_pt) {
            return Err(ChartError::Resolution { px_per_pt });
        }
        let side = |points: f64| (points * px_per_pt).round().max(1.0) as u32;
        let mut pixels =
            Pixmap::new(side(size[0]), side(size[1])).ok_or(ChartError::Resolution { px_per_pt })?;
        pixels.fill(Color::WHITE);
        let drawing = Drawing { size, marks: Vec::new() };
        Ok(Canvas { pixels, drawing, scale: px_per_pt, fonts: Fonts::new()?, texts: Vec::new() })
    }

    /// Width and height \[px\].
    pub(crate) fn dimensions(&self) -> (u32, u32) {
        (self.pixels.width(), self.pixels.height())
    }

    /// Red, green and blue of each pixel, row by row.
    pub(crate) fn rgb(&self) -> Vec<u8> {
        self.pixels
            .data()
            .as_chunks::<4>()
            .0
            .iter()
            .flat_map(|&[red, green, blue, _]| [red, green, blue])
            .collect()
    }

    /// Copies pixels painted before, and forgets what was drawn; sizes must agree.
    pub(crate) fn restore(&mut self, rgb: &[u8]) {
        self.drawing.marks.clear();
        self.texts.clear();
        for (to, from) in self.pixels.data_mut().as_chunks_mut::<4>().0.iter_mut().zip(rgb.as_chunks::<3>().0)
        {
            to[..3].copy_from_slice(from);
        }
    }

    /// Paints a rectangle of pixels, its upper left corner at `at` \[pt\]: `colour` of column and row.
    pub(crate) fn raster(
        &mut self,
        at: [f64; 2],
        size: (usize, usize),
        colour: impl Fn(usize, usize) -> Colour,
    ) {
        let places = (0..size.1).flat_map(|row| (0..size.0).map(move |column| (column, row)));
        let rgb = places.flat_map(|(column, row)| {
            let Colour { 0: red, 1: green, 2: blue } = colour(column, row);
            [red, green, blue]
        });
        self.add(Mark::Raster {
            at,
            size: [size.0 as f64 / self.scale, size.1 as f64 / self.scale],
            pixels: [size.0, size.1],
            rgb: rgb.collect(),
        });
    }

    /// The words drawn so far.
    pub(crate) fn texts(&self) -> &[TextBox] {
        &self.texts
    }

    /// What was drawn so far.
    pub(crate) fn drawing(&self) -> &Drawing {
        &self.drawing
    }

    pub(crate) fn fonts(&self) -> &Fonts {
        &self.fonts
    }

    /// Draws words with their anchor at `at` \[pt\].
    pub(crate) fn words(&mut self, text: &str, style: &Lettering, at: [f64; 2]) {
        let (outline, width) = self.fonts.outline(text, style.size, style.bold);
        let left = match style.align {
            Align::Left => 0.0,
            Align::Centre => -0.5 * width,
            Align::Right => -width,
        };
        let cap = CAP_HEIGHT * style.size;
        let down = match style.level {
            TextLevel::Baseline => 0.0,
            TextLevel::Middle => 0.5 * cap,
            TextLevel::Top => cap,
        };
        let (sin, cos) = (-style.angle).sin_cos();
        let turn = |x: f64, y: f64| [at[0] + cos * x - sin * y, at[1] + sin * x + cos * y];
        let corners = [
            turn(left, down),
            turn(left + width, down),
            turn(left + width, down - cap),
            turn(left, down - cap),
        ];
        self.texts.push(TextBox {
            text: text.to_owned(),
            corners,
            colour: [style.colour.0, style.colour.1, style.colour.2],
        });
        let [x, y] = turn(left, down).map(|c| c as f32);
        let place = Transform::from_row(cos as f32, sin as f32, -sin as f32, cos as f32, x, y);
        if let Some(path) = outline.and_then(|outline| outline.transform(place)) {
            let halo = if style.halo { HALO } else { 0.0 };
            self.add(Mark::Words { text: unmarked(text), path, colour: style.colour, halo });
        }
    }

    /// Takes a mark, and paints it.
    fn add(&mut self, mark: Mark) {
        self.paint(&mark);
        self.drawing.marks.push(mark);
    }

    fn paint(&mut self, mark: &Mark) {
        let whole = Transform::identity();
        let stroke = |width: f64, round: bool| Stroke {
            width: (width * self.scale) as f32,
            line_cap: if round { LineCap::Round } else { LineCap::Butt },
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        match mark {
            Mark::Fill { path, colour, opacity } => {
                if let Some(path) = scaled(path, self.scale) {
                    self.pixels.fill_path(&path, &paint(*colour, *opacity), FillRule::Winding, whole, None);
                }
            }
            Mark::Stroke { path, colour, opacity, width, round } => {
                if let Some(path) = scaled(path, self.scale) {
                    let stroke = stroke(*width, *round);
                    self.pixels.stroke_path(&path, &paint(*colour, *opacity), &stroke, whole, None);
                }
            }
            Mark::Rule { from, to, colour, opacity, width } => {
                if let Some(rect) = self.rule(*from, *to, *width) {
                    let path = PathBuilder::from_rect(rect);
                    self.pixels.fill_path(&path, &paint(*colour, *opacity), FillRule::Winding, whole, None);
                }
            }
            Mark::Words { path, colour, halo, .. } => {
                let Some(path) = scaled(path, self.scale) else { return };
                if *halo > 0.0 {
                    let rim = stroke(2.0 * halo, false);
                    self.pixels.stroke_path(&path, &paint(WHITE, 1.0), &rim, whole, None);
                }
                self.pixels.fill_path(&path, &paint(*colour, 1.0), FillRule::Winding, whole, None);
            }
            Mark::Raster { at, pixels, rgb, .. } => self.blit(*at, *pixels, rgb),
        }
    }

    /// Copies pixels, their upper left corner at `at` \[pt\].
    fn blit(&mut self, at: [f64; 2], [wide, high]: [usize; 2], rgb: &[u8]) {
        let (width, height) = (self.pixels.width() as usize, self.pixels.height() as usize);
        let [left, top] = at.map(|points| (points * self.scale).round().max(0.0) as usize);
        let to = self.pixels.data_mut().as_chunks_mut::<4>().0;
        let from = rgb.as_chunks::<3>().0;
        for row in 0..high.min(height.saturating_sub(top)) {
            for column in 0..wide.min(width.saturating_sub(left)) {
                let [red, green, blue] = from[row * wide + column];
                to[(top + row) * width + left + column] = [red, green, blue, 255];
            }
        }
    }

    /// The whole pixels of a horizontal or vertical line, which keep grids crisp.
    fn rule(&self, from: [f64; 2], to: [f64; 2], width: f64) -> Option<Rect> {
        let ([x0, y0], [x1, y1]) =
            (from.map(|c| (c * self.scale) as f32), to.map(|c| (c * self.scale) as f32));
        let width = ((width * self.scale) as f32).round().max(1.0);
        let odd = width % 2.0 == 1.0;
        let snap = |middle: f32| {
            if odd { middle.floor() - 0.5 * (width - 1.0) } else { middle.round() - 0.5 * width }
        };
        if from[1] == to[1] {
            Rect::from_xywh(x0.min(x1), snap(y0), (x1 - x0).abs(), width)
        } else {
            Rect::from_xywh(snap(x0), y0.min(y1), width, (y1 - y0).abs())
        }
    }

    fn fill(&mut self, path: Option<Path>, colour: BackendColor) {
        if let Some(path) = path {
            let (colour, opacity) = backend_colour(colour);
            self.add(Mark::Fill { path, colour, opacity });
        }
    }

    fn stroke(&mut self, path: Option<Path>, colour: BackendColor, width: u32, round: bool) {
        if let Some(path) = path {
            let (colour, opacity) = backend_colour(colour);
            self.add(Mark::Stroke { path, colour, opacity, width: f64::from(width) / UNITS, round });
        }
    }
}

/// Points from backend units.
fn points((x, y): BackendCoord) -> [f64; 2] {
    [f64::from(x) / UNITS, f64::from(y) / UNITS]
}

fn outline(corners: impl IntoIterator<Item = BackendCoord>, closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    let mut last: Option<[f64; 2]> = None;
    let mut skipped = None;
    for [x, y] in corners.into_iter().map(points) {
        match last {
            None => path.move_to(x as f32, y as f32),
            Some([a, b]) if (x - a).hypot(y - b) < NEAR => {
                skipped = Some([x, y]);
                continue;
            }
            Some(_) => path.line_to(x as f32, y as f32),
        }
        skipped = None;
        last = Some([x, y]);
    }
    if let Some([x, y]) = skipped {
        path.line_to(x as f32, y as f32);
    }
    if closed {
        path.close();
    }
    path.finish()
}

fn paint(colour: Colour, alpha: f64) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(colour.0, colour.1, colour.2, (alpha.clamp(0.0, 1.0) * 255.0).round() as u8);
    paint
}

fn backend_colour(colour: BackendColor) -> (Colour, f64) {
    let (red, green, blue) = colour.rgb;
    (plotters::style::RGBColor(red, green, blue), colour.alpha)
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::prelude::*;

    fn drawn(size: [f64; 2], paint: impl FnOnce(&DrawingArea<Canvas, plotters::coord::Shift>)) -> Canvas {
        let cell = std::rc::Rc::new(std::cell::RefCell::new(Canvas::new(size, 4.0).unwrap()));
        paint(&DrawingArea::from(&cell));
        std::rc::Rc::try_unwrap(cell).ok().unwrap().into_inner()
    }

    fn dark(canvas: &Canvas, x: u32, y: u32) -> bool {
        canvas.pixels.pixel(x, y).is_some_and(|p| p.red() < 40)
    }

    #[test]
    fn a_thick_line_covers_its_own_crossing() {
        let canvas = drawn([20.0, 20.0], |area| {
            let twice = vec![(200, 200), (1800, 1800), (1800, 200), (200, 1800), (200, 200), (1800, 1800)];
            area.draw(&PathElement::new(
                twice,
                ShapeStyle { color: BLACK.into(), filled: false, stroke_width: 200 },
            ))
            .unwrap();
        });
        assert!(dark(&canvas, 40, 40), "the crossing is covered");
        assert!(dark(&canvas, 20, 20), "a line traced twice does not vanish");
        assert!(!dark(&canvas, 40, 10));
    }

    #[test]
    fn rules_fill_whole_pixels() {
        let canvas = drawn([20.0, 20.0], |area| {
            area.draw(&PathElement::new(
                vec![(100, 1003), (1900, 1003)],
                ShapeStyle { color: BLACK.into(), filled: false, stroke_width: 75 },
            ))
            .unwrap();
        });
        let column: Vec<u8> = (0..80).map(|y| canvas.pixels.pixel(40, y).unwrap().red()).collect();
        assert_eq!(column.iter().filter(|&&red| red == 0).count(), 3, "0.75 pt are three pixels");
        assert_eq!(column.iter().filter(|&&red| red == 255).count(), 77);
    }

    #[test]
    fn plotters_draws_its_own_mesh_and_words_on_it() {
        let canvas = drawn([200.0, 150.0], |area| {
            let mut builder = ChartBuilder::on(area);
            builder.margin(500).x_label_area_size(3000).y_label_area_size(4000);
            let mut chart = builder.build_cartesian_2d(0.0..1.0, 0.0..1.0).unwrap();
            chart.configure_mesh().label_style(("sans", 850.0)).x_desc("time").draw().unwrap();
        });
        assert!(canvas.texts().iter().any(|text| text.text == "time"));
        assert!(canvas.rgb().iter().any(|&part| part < 40));
    }
}
