//! Words: fonts inside the program, a small markup, and outlines to fill.
//!
//! Markup: `*italic*`, `_{below}`, `^{above}`; a backslash takes the next character literally ([`plain`]
//! writes them).  A script right after another is set over it.  A character that DejaVu lacks appears as its
//! empty box.

use super::ChartError;
use super::palette::Colour;
use ab_glyph::{Font, FontRef, OutlineCurve};
use tiny_skia::{Path, PathBuilder};

/// Height of capitals and digits over the em in DejaVu Sans.
pub(crate) const CAP_HEIGHT: f64 = 0.729;
const SCRIPT: f64 = 0.70;
const BELOW: f64 = -0.16;
const ABOVE: f64 = 0.36;

/// Which side of the words lies at the given place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Centre,
    Right,
}

/// Which height of the words lies at the given place; the middle is that of the digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TextLevel {
    Baseline,
    Middle,
    Top,
}

/// How words are set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lettering {
    /// Em \[pt\].
    pub size: f64,
    pub bold: bool,
    pub colour: Colour,
    pub align: Align,
    pub level: TextLevel,
    /// Direction of the line of text, counter-clockwise from the right \[rad\].
    pub angle: f64,
    /// A white rim, for words that lie on lines.
    pub halo: bool,
}

impl Lettering {
    pub(crate) fn new(size: f64, colour: Colour) -> Self {
        Lettering {
            size,
            bold: false,
            colour,
            align: Align::Left,
            level: TextLevel::Baseline,
            angle: 0.0,
            halo: false,
        }
    }

    pub(crate) fn at(self, align: Align, level: TextLevel) -> Self {
        Lettering { align, level, ..self }
    }
}

/// Words on a page, for tests of the layout.
#[derive(Clone, Debug, PartialEq)]
pub struct TextBox {
    /// The words, with their markup.
    pub text: String,
    /// Corners of the box from the baseline to the cap height, counter-clockwise on the page \[pt from the
    /// upper left, y downwards\].
    pub corners: [[f64; 2]; 4],
    /// Colour of the words (red, green, blue).
    pub colour: [u8; 3],
}

impl TextBox {
    /// Smallest and largest x and y: `[left, top, right, bottom]` \[pt\].
    #[must_use]
    pub fn bounds(&self) -> [f64; 4] {
        let fold = |k: usize, pick: fn(f64, f64) -> f64| {
            self.corners.iter().map(|corner| corner[k]).fold(self.corners[0][k], pick)
        };
        [fold(0, f64::min), fold(1, f64::min), fold(0, f64::max), fold(1, f64::max)]
    }

    /// Whether two boxes share some area (separating axes of two convex shapes).
    #[must_use]
    pub fn overlaps(&self, other: &TextBox) -> bool {
        let parted = |a: &TextBox, b: &TextBox| {
            (0..4).any(|k| {
                let (from, to) = (a.corners[k], a.corners[(k + 1) % 4]);
                let side = |p: &[f64; 2]| {
                    (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0])
                };
                let inside = side(&a.corners[(k + 2) % 4]).signum();
                b.corners.iter().all(|p| side(p) * inside <= 0.0)
            })
        };
        !parted(self, other) && !parted(other, self)
    }
}

/// The text with every character of the markup taken literally.
#[must_use]
pub fn plain(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if matches!(c, '*' | '_' | '^' | '\\') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// The text without its markup, for the text chunks of a file.
#[must_use]
pub fn unmarked(text: &str) -> String {
    glyphs(text).iter().map(|glyph| glyph.character).collect()
}

/// A character with its place in the markup.
struct Glyph {
    character: char,
    italic: bool,
    script: Script,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Script {
    None,
    Below,
    Above,
}

fn glyphs(text: &str) -> Vec<Glyph> {
    let chars: Vec<char> = text.chars().collect();
    let mut out = Vec::with_capacity(chars.len());
    let (mut italic, mut script, mut k) = (false, Script::None, 0);
    while k < chars.len() {
        let next = chars.get(k + 1).copied();
        let mut literal = None;
        match (chars[k], next) {
            ('\\', Some(c)) => {
                literal = Some(c);
                k += 1;
            }
            ('*', _) if italic || chars[k + 1..].contains(&'*') => italic = !italic,
            ('_', Some('{')) if chars[k..].contains(&'}') => {
                script = Script::Below;
                k += 1;
            }
            ('^', Some('{')) if chars[k..].contains(&'}') => {
                script = Script::Above;
                k += 1;
            }
            ('}', _) if script != Script::None => script = Script::None,
            (c, _) => literal = Some(c),
        }
        if let Some(character) = literal {
            out.push(Glyph { character, italic, script });
        }
        k += 1;
    }
    out
}

/// The three faces of DejaVu Sans.
pub(crate) struct Fonts {
    regular: FontRef<'static>,
    bold: FontRef<'static>,
    oblique: FontRef<'static>,
}

impl Fonts {
    pub(crate) fn new() -> Result<Self, ChartError> {
        let face = |bytes: &'static [u8]| FontRef::try_from_slice(bytes).map_err(|_| ChartError::Font);
        Ok(Fonts {
            regular: face(dejavu::sans::regular())?,
            bold: face(dejavu::sans::bold())?,
            oblique: face(dejavu::sans::oblique())?,
        })
    }

    /// Whether the regular face has the character.
    #[cfg(test)]
    pub(crate) fn has(&self, character: char) -> bool {
        [&self.regular, &self.bold].iter().all(|font| font.glyph_id(character).0 != 0)
    }

    /// Width of the words, in units of `size`.
    pub(crate) fn width(&self, text: &str, size: f64, bold: bool) -> f64 {
        self.walk(text, size, bold, |_, _, _, _, _| ())
    }

    /// Outline with the baseline's left end at the origin, y downwards, and the width, both in units of
    /// `size`.
    pub(crate) fn outline(&self, text: &str, size: f64, bold: bool) -> (Option<Path>, f64) {
        let mut path = PathBuilder::new();
        let width = self.walk(text, size, bold, |font, id, x, rise, scale| {
            let Some(outline) = font.outline(id) else { return };
            let place = |p: ab_glyph::Point| {
                ((x + f64::from(p.x) * scale) as f32, (-rise - f64::from(p.y) * scale) as f32)
            };
            let mut last = None;
            for curve in outline.curves {
                let (from, to) = match curve {
                    OutlineCurve::Line(a, b)
                    | OutlineCurve::Quad(a, _, b)
                    | OutlineCurve::Cubic(a, _, _, b) => (a, b),
                };
                if last != Some(from) {
                    if last.is_some() {
                        path.close();
                    }
                    path.move_to(place(from).0, place(from).1);
                }
                let end = place(to);
                match curve {
                    OutlineCurve::Line(..) => path.line_to(end.0, end.1),
                    OutlineCurve::Quad(_, c, _) => path.quad_to(place(c).0, place(c).1, end.0, end.1),
                    OutlineCurve::Cubic(_, c, d, _) => {
                        path.cubic_to(place(c).0, place(c).1, place(d).0, place(d).1, end.0, end.1)
                    }
                }
                last = Some(to);
            }
            if last.is_some() {
                path.close();
            }
        });
        (path.finish(), width)
    }

    /// Visits each glyph with its font, number, x, rise and scale from font units; returns the width.
    fn walk(
        &self,
        text: &str,
        size: f64,
        bold: bool,
        mut visit: impl FnMut(&FontRef, ab_glyph::GlyphId, f64, f64, f64),
    ) -> f64 {
        let (mut x, mut widest) = (0.0, 0.0_f64);
        let mut script_start = 0.0;
        let mut last: Option<(ab_glyph::GlyphId, Script, bool)> = None;
        for glyph in glyphs(text) {
            let font = match (bold, glyph.italic) {
                (true, _) => &self.bold,
                (false, true) => &self.oblique,
                (false, false) => &self.regular,
            };
            let (share, rise) = match glyph.script {
                Script::None => (1.0, 0.0),
                Script::Below => (SCRIPT, BELOW * size),
                Script::Above => (SCRIPT, ABOVE * size),
            };
            let scale = share * size / f64::from(font.units_per_em().unwrap_or(2048.0));
            let id = font.glyph_id(glyph.character);
            match last {
                Some((before, script, italic)) if script == glyph.script && italic == glyph.italic => {
                    x += f64::from(font.kern_unscaled(before, id)) * scale;
                }
                Some((_, script, _)) if script != Script::None && glyph.script != Script::None => {
                    x = script_start
                }
                Some((_, script, _)) if script != Script::None => x = widest,
                _ => {}
            }
            if glyph.script != Script::None && last.is_none_or(|(_, script, _)| script == Script::None) {
                script_start = x;
            }
            visit(font, id, x, rise, scale);
            x += f64::from(font.h_advance_unscaled(id)) * scale;
            widest = widest.max(x);
            last = Some((id, glyph.script, glyph.italic));
        }
        widest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_is_set_and_literal_text_survives() {
        assert_eq!(unmarked("*x*_{1} in m^{2}, a*b, c_d"), "x1 in m2, ab, c_d".replace("ab", "a*b"));
        let odd = "a*b*c_{d}\\^{e}";
        assert_eq!(unmarked(&plain(odd)), odd);
    }

    #[test]
    fn scripts_are_stacked_and_small() {
        let fonts = Fonts::new().unwrap();
        let stacked = fonts.width("x_{1}^{2}", 10.0, false);
        assert!((stacked - fonts.width("x_{1}", 10.0, false)).abs() < 1e-9);
        assert!((fonts.width("_{8}", 10.0, false) - SCRIPT * fonts.width("8", 10.0, false)).abs() < 1e-9);
    }

    #[test]
    fn the_fonts_have_every_character_charts_write() {
        let fonts = Fonts::new().unwrap();
        for c in "✓✗◷−×·√∝µ≤≥°εφωΔπ²³⁻∞|∂\u{2009}…–".chars().chain(' '..='~')
        {
            assert!(fonts.has(c), "{c:?} is missing");
        }
    }
}
