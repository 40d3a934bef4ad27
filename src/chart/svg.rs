//! A drawing as an SVG file (W3C, "Scalable Vector Graphics 1.1", 2011): words are outlines, so that it looks
//! the same everywhere, and carry their text as labels.

use super::ChartError;
use super::file::encoded;
use super::mark::{Drawing, Mark};
use super::palette::Colour;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use std::fmt::Write;
use tiny_skia::{Path, PathSegment};

/// The file of a drawing.
///
/// # Errors
/// [`ChartError::Png`] where pixels in it cannot be encoded.
pub(crate) fn svg(drawing: &Drawing, title: &str, description: &str) -> Result<String, ChartError> {
    let [width, height] = drawing.size.map(|side| short(side as f32));
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}pt\" height=\"{height}pt\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" fill=\"none\" stroke-linejoin=\"round\">\n\
         <title>{}</title>\n<desc>{}</desc>\n<path fill=\"#fff\" d=\"M0 0H{width}V{height}H0Z\"/>\n",
        escaped(title),
        escaped(description)
    );
    for mark in &drawing.marks {
        match mark {
            Mark::Fill { path, colour, opacity } => {
                let opacity = alpha("fill", *opacity);
                line(&mut out, format_args!("<path fill=\"{}\"{opacity} d=\"{}\"/>", hex(*colour), d(path)));
            }
            Mark::Stroke { path, colour, opacity, width, round } => {
                let cap = if *round { " stroke-linecap=\"round\"" } else { "" };
                stroke(&mut out, *colour, *width, *opacity, cap, &d(path));
            }
            Mark::Rule { from, to, colour, opacity, width } => {
                let [x0, y0, x1, y1] = [from[0], from[1], to[0], to[1]].map(|c| short(c as f32));
                stroke(&mut out, *colour, *width, *opacity, "", &format!("M{x0} {y0}L{x1} {y1}"));
            }
            Mark::Words { text, path, colour, halo } => {
                let rim = if *halo > 0.0 {
                    format!(
                        " stroke=\"#fff\" stroke-width=\"{}\" paint-order=\"stroke\"",
                        short(2.0 * *halo as f32)
                    )
                } else {
                    String::new()
                };
                let (fill, label) = (hex(*colour), escaped(text));
                line(
                    &mut out,
                    format_args!("<path aria-label=\"{label}\" fill=\"{fill}\"{rim} d=\"{}\"/>", d(path)),
                );
            }
            Mark::Raster { at, size, pixels, rgb } => {
                let png = encoded(pixels[0] as u32, pixels[1] as u32, rgb, |_| Ok(()))?;
                let [x, y, width, height] = [at[0], at[1], size[0], size[1]].map(|c| short(c as f32));
                let data = BASE64_STANDARD.encode(png);
                line(
                    &mut out,
                    format_args!(
                        "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" \
                         preserveAspectRatio=\"none\" href=\"data:image/png;base64,{data}\"/>"
                    ),
                );
            }
        }
    }
    out.push_str("</svg>\n");
    Ok(out)
}

fn line(out: &mut String, words: std::fmt::Arguments) {
    // Writing into a string cannot fail.
    let _ = out.write_fmt(words);
    out.push('\n');
}

fn stroke(out: &mut String, colour: Colour, width: f64, opacity: f64, cap: &str, d: &str) {
    let (colour, width, opacity) = (hex(colour), short(width as f32), alpha("stroke", opacity));
    line(out, format_args!("<path stroke=\"{colour}\" stroke-width=\"{width}\"{opacity}{cap} d=\"{d}\"/>"));
}

fn hex(colour: Colour) -> String {
    format!("#{:02x}{:02x}{:02x}", colour.0, colour.1, colour.2)
}

fn alpha(what: &str, opacity: f64) -> String {
    if opacity < 1.0 { format!(" {what}-opacity=\"{}\"", short(opacity as f32)) } else { String::new() }
}

/// A length to a hundredth of a point.
fn short(length: f32) -> String {
    let text = format!("{length:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// The data of a path.
fn d(path: &Path) -> String {
    let mut out = String::new();
    let mut put = |letter: char, points: &[tiny_skia::Point]| {
        out.push(letter);
        for (k, point) in points.iter().enumerate() {
            if k > 0 {
                out.push(' ');
            }
            out.push_str(&short(point.x));
            out.push(' ');
            out.push_str(&short(point.y));
        }
    };
    for segment in path.segments() {
        match segment {
            PathSegment::MoveTo(a) => put('M', &[a]),
            PathSegment::LineTo(a) => put('L', &[a]),
            PathSegment::QuadTo(a, b) => put('Q', &[a, b]),
            PathSegment::CubicTo(a, b, c) => put('C', &[a, b, c]),
            PathSegment::Close => put('Z', &[]),
        }
    }
    out
}

/// Text inside an element or an attribute.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_names_are_escaped() {
        assert_eq!([1.0, 0.5, -0.001, 12.346].map(short), ["1", "0.5", "0", "12.35"]);
        assert_eq!(escaped("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
    }
}
