//! A drawing as a PDF file of one page (ISO 32000-1, 2008): words are outlines, so that it needs no fonts.

use super::ChartError;
use super::mark::{Drawing, Mark};
use super::palette::{Colour, WHITE};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::writers::Resources;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use std::io::Write;
use tiny_skia::{Path, PathSegment};

const CATALOG: i32 = 1;
const PAGES: i32 = 2;
const PAGE: i32 = 3;
const CONTENT: i32 = 4;
const INFO: i32 = 5;
/// The first number for states of opacity and pixels.
const FREE: i32 = 6;

/// The file of a drawing.
///
/// # Errors
/// [`ChartError::Drawing`] where the compression gives up.
pub(crate) fn pdf(drawing: &Drawing, title: &str, description: &str) -> Result<Vec<u8>, ChartError> {
    let [width, height] = drawing.size.map(|side| side as f32);
    let mut content = Content::new();
    // From the upper left, y downwards.
    content.transform([1.0, 0.0, 0.0, -1.0, 0.0, height]);
    content.set_line_join(LineJoinStyle::RoundJoin);
    let mut resources = NamedResources::default();
    let mut opaque = 1.0;
    for mark in &drawing.marks {
        let opacity = match mark {
            Mark::Fill { opacity, .. } | Mark::Stroke { opacity, .. } | Mark::Rule { opacity, .. } => {
                *opacity
            }
            Mark::Words { .. } | Mark::Raster { .. } => 1.0,
        };
        if opacity != opaque {
            content.set_parameters(Name(format!("O{}", resources.state(opacity)).as_bytes()));
            opaque = opacity;
        }
        draw(&mut content, mark, &mut resources)?;
    }
    let mut pdf = Pdf::new();
    pdf.catalog(Ref::new(CATALOG)).pages(Ref::new(PAGES));
    pdf.pages(Ref::new(PAGES)).kids([Ref::new(PAGE)]).count(1);
    let mut page = pdf.page(Ref::new(PAGE));
    page.media_box(Rect::new(0.0, 0.0, width, height)).parent(Ref::new(PAGES)).contents(Ref::new(CONTENT));
    resources.list(page.resources());
    page.finish();
    resources.write(&mut pdf);
    let content = compressed(content.finish().as_slice())?;
    pdf.stream(Ref::new(CONTENT), &content).filter(Filter::FlateDecode);
    pdf.document_info(Ref::new(INFO))
        .title(TextStr(title))
        .subject(TextStr(description))
        .producer(TextStr(concat!("driftless ", env!("CARGO_PKG_VERSION"))));
    Ok(pdf.finish())
}

/// What the content asks for by name: states of opacity `O0`, `O1`, … and pixels `R0`, `R1`, …
#[derive(Default)]
struct NamedResources {
    opacities: Vec<f64>,
    /// Width and height, and the compressed colours.
    rasters: Vec<([usize; 2], Vec<u8>)>,
}

impl NamedResources {
    /// The number of a state of opacity, new or known.
    fn state(&mut self, opacity: f64) -> usize {
        self.opacities.iter().position(|&other| other == opacity).unwrap_or_else(|| {
            self.opacities.push(opacity);
            self.opacities.len() - 1
        })
    }

    /// Where a state of opacity stands in the file.
    fn state_reference(k: usize) -> Ref {
        Ref::new(FREE + k as i32)
    }

    /// Where pixels stand in the file.
    fn raster_reference(&self, k: usize) -> Ref {
        Ref::new(FREE + (self.opacities.len() + 1 + k) as i32)
    }

    /// Puts the names into the page's dictionary.
    fn list(&self, mut dictionary: Resources) {
        if !self.opacities.is_empty() {
            let mut states = dictionary.ext_g_states();
            for k in 0..self.opacities.len() {
                states.pair(Name(format!("O{k}").as_bytes()), Self::state_reference(k));
            }
        }
        if !self.rasters.is_empty() {
            let mut pictures = dictionary.x_objects();
            for k in 0..self.rasters.len() {
                pictures.pair(Name(format!("R{k}").as_bytes()), self.raster_reference(k));
            }
        }
    }

    /// Writes the objects themselves.
    fn write(&self, pdf: &mut Pdf) {
        for (k, &opacity) in self.opacities.iter().enumerate() {
            let alpha = opacity as f32;
            pdf.ext_graphics(Self::state_reference(k)).non_stroking_alpha(alpha).stroking_alpha(alpha);
        }
        for (k, ([wide, high], data)) in self.rasters.iter().enumerate() {
            let mut picture = pdf.image_xobject(self.raster_reference(k), data);
            picture.filter(Filter::FlateDecode);
            picture.width(*wide as i32).height(*high as i32).bits_per_component(8);
            picture.color_space().device_rgb();
        }
    }
}

/// Adds a mark to the content.
fn draw(content: &mut Content, mark: &Mark, resources: &mut NamedResources) -> Result<(), ChartError> {
    match mark {
        Mark::Fill { path, colour, .. } => fill(content, path, *colour),
        Mark::Stroke { path, colour, width, round, .. } => {
            stroke(content, *colour, *width, *round);
            trace(content, path);
            content.stroke();
        }
        Mark::Rule { from, to, colour, width, .. } => {
            stroke(content, *colour, *width, false);
            content.move_to(from[0] as f32, from[1] as f32);
            content.line_to(to[0] as f32, to[1] as f32);
            content.stroke();
        }
        Mark::Words { path, colour, halo, .. } => {
            if *halo > 0.0 {
                stroke(content, WHITE, 2.0 * halo, false);
                trace(content, path);
                content.stroke();
            }
            fill(content, path, *colour);
        }
        Mark::Raster { at, size, pixels, rgb } => {
            content.save_state();
            let [x, y, wide, high] = [at[0], at[1], size[0], size[1]].map(|c| c as f32);
            // Pictures stand on their lower edge.
            content.transform([wide, 0.0, 0.0, -high, x, y + high]);
            content.x_object(Name(format!("R{}", resources.rasters.len()).as_bytes()));
            content.restore_state();
            resources.rasters.push((*pixels, compressed(rgb)?));
        }
    }
    Ok(())
}

fn compressed(bytes: &[u8]) -> Result<Vec<u8>, ChartError> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let done = encoder.write_all(bytes).and_then(|()| encoder.finish());
    done.map_err(|error| ChartError::Drawing(error.to_string()))
}

fn parts(colour: Colour) -> [f32; 3] {
    [colour.0, colour.1, colour.2].map(|part| f32::from(part) / 255.0)
}

fn fill(content: &mut Content, path: &Path, colour: Colour) {
    let [red, green, blue] = parts(colour);
    content.set_fill_rgb(red, green, blue);
    trace(content, path);
    content.fill_nonzero();
}

fn stroke(content: &mut Content, colour: Colour, width: f64, round: bool) {
    let [red, green, blue] = parts(colour);
    let cap = if round { LineCapStyle::RoundCap } else { LineCapStyle::ButtCap };
    content.set_stroke_rgb(red, green, blue).set_line_width(width as f32).set_line_cap(cap);
}

/// Adds a path; quadratic pieces become cubic ones.
fn trace(content: &mut Content, path: &Path) {
    let mut last = [0.0; 2];
    for segment in path.segments() {
        match segment {
            PathSegment::MoveTo(a) => {
                content.move_to(a.x, a.y);
                last = [a.x, a.y];
            }
            PathSegment::LineTo(a) => {
                content.line_to(a.x, a.y);
                last = [a.x, a.y];
            }
            PathSegment::QuadTo(a, b) => {
                let [x, y] = last;
                let towards = |from: f32, to: f32| from + 2.0 / 3.0 * (to - from);
                content.cubic_to(
                    towards(x, a.x),
                    towards(y, a.y),
                    towards(b.x, a.x),
                    towards(b.y, a.y),
                    b.x,
                    b.y,
                );
                last = [b.x, b.y];
            }
            PathSegment::CubicTo(a, b, c) => {
                content.cubic_to(a.x, a.y, b.x, b.y, c.x, c.y);
                last = [c.x, c.y];
            }
            PathSegment::Close => {
                content.close_path();
            }
        }
    }
}
