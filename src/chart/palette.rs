//! Colours, and the colour and shape every method and stabilization keeps in every chart.
//!
//! The series colours are those of Okabe and Ito, "Color Universal Design" (2008).  They stay apart for
//! colour-blind readers, but not far enough to stand alone: a series also has a shape or a direct label.
//! Words need more contrast than lines; see [`readable`].

use plotters::style::RGBColor;

/// A colour of a chart.
pub(crate) type Colour = RGBColor;

pub(crate) const WHITE: Colour = RGBColor(0xFF, 0xFF, 0xFF);
/// Text and bars.
pub(crate) const INK: Colour = RGBColor(0x1F, 0x23, 0x28);
/// Captions and notes.
pub(crate) const GREY: Colour = RGBColor(0x57, 0x60, 0x6A);
/// Axes and ticks.
pub(crate) const SPINE: Colour = RGBColor(0x6E, 0x77, 0x81);
pub(crate) const GRID: Colour = RGBColor(0xE4, 0xE7, 0xEB);
/// Guides and levels.
pub(crate) const GUIDE: Colour = RGBColor(0x93, 0x98, 0xA1);

pub(crate) const SKY: Colour = RGBColor(0x56, 0xB4, 0xE9);
pub(crate) const BLUE: Colour = RGBColor(0x00, 0x72, 0xB2);
pub(crate) const GREEN: Colour = RGBColor(0x00, 0x9E, 0x73);
pub(crate) const PURPLE: Colour = RGBColor(0xCC, 0x79, 0xA7);
pub(crate) const ORANGE: Colour = RGBColor(0xE6, 0x9F, 0x00);
pub(crate) const VERMILLION: Colour = RGBColor(0xD5, 0x5E, 0x00);

/// Places of a map that were left out, and those where something failed.
pub(crate) const EXCLUDED: Colour = RGBColor(0xD3, 0xD7, 0xDC);
pub(crate) const FAILED: Colour = RGBColor(0xDE, 0x95, 0xBE);

/// The seventh series: far enough from a dark blue, which black is not.
const NEUTRAL: Colour = RGBColor(0x8A, 0x92, 0x9B);

/// Colours from dark (0) to light (1) in even steps of lightness, also to the colour-blind: viridis, by S.
/// van der Walt and N. Smith (2015).
pub(crate) fn even(share: f64) -> Colour {
    const STOPS: [Colour; 10] = [
        RGBColor(0x44, 0x01, 0x54),
        RGBColor(0x48, 0x28, 0x78),
        RGBColor(0x3E, 0x49, 0x89),
        RGBColor(0x31, 0x68, 0x8E),
        RGBColor(0x26, 0x82, 0x8E),
        RGBColor(0x1F, 0x9E, 0x89),
        RGBColor(0x35, 0xB7, 0x79),
        RGBColor(0x6D, 0xCD, 0x59),
        RGBColor(0xB4, 0xDE, 0x2C),
        RGBColor(0xFD, 0xE7, 0x25),
    ];
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let stop = (place as usize).min(STOPS.len() - 2);
    mix(STOPS[stop], STOPS[stop + 1], place - stop as f64)
}

/// Shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MarkerShape {
    Disc,
    Ring,
    Square,
    Diamond,
    Up,
    Down,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MarkStyle {
    pub colour: Colour,
    pub shape: MarkerShape,
    /// 0 for the first series of this family of colours, 1 for the second, …; chooses the dashes.
    pub turn: usize,
}

/// Seven series without a name of their own, in the order in which they are easiest to tell apart.
const FREE: [(Colour, MarkerShape); 7] = [
    (BLUE, MarkerShape::Disc),
    (VERMILLION, MarkerShape::Up),
    (GREEN, MarkerShape::Square),
    (ORANGE, MarkerShape::Ring),
    (PURPLE, MarkerShape::Diamond),
    (SKY, MarkerShape::Down),
    (NEUTRAL, MarkerShape::Disc),
];

/// The fixed colour and shape of a method or stabilization, found by the beginning of its name.
fn fixed(name: &str) -> Option<(Colour, MarkerShape)> {
    const FIXED: [(&str, Colour, MarkerShape); 12] = [
        ("dopri5", SKY, MarkerShape::Down),
        ("dp5", SKY, MarkerShape::Down),
        ("dop853", BLUE, MarkerShape::Disc),
        ("dp8", BLUE, MarkerShape::Disc),
        ("gauss", GREEN, MarkerShape::Square),
        ("rattle", PURPLE, MarkerShape::Diamond),
        ("radau", ORANGE, MarkerShape::Ring),
        ("taylor", VERMILLION, MarkerShape::Up),
        ("none", VERMILLION, MarkerShape::Down),
        ("baumgarte", ORANGE, MarkerShape::Ring),
        ("projection", BLUE, MarkerShape::Disc),
        ("elimination", GREEN, MarkerShape::Square),
    ];
    FIXED.iter().find(|(word, ..)| name.starts_with(word)).map(|&(_, colour, shape)| (colour, shape))
}

/// The shade of number `turn` among `count` series of one colour: itself and a darker one, or from light to
/// dark where there are more.
fn shade(colour: Colour, turn: usize, count: usize) -> Colour {
    let place = match count {
        0 | 1 => 0.0,
        2 => -0.5 * turn as f64,
        _ => 0.5 - 1.2 * turn as f64 / (count - 1) as f64,
    };
    if place > 0.0 { mix(colour, WHITE, place) } else { mix(colour, INK, -place) }
}

/// A mark for each name: known methods and stabilizations keep theirs, in shades where they share a colour;
/// other names take what is left.
pub(crate) fn marks<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<MarkStyle> {
    let names: Vec<&str> = names.into_iter().collect();
    let known: Vec<_> = names.iter().map(|name| fixed(name)).collect();
    let mut free =
        FREE.iter().filter(|(colour, _)| !known.iter().flatten().any(|(taken, _)| taken == colour)).cycle();
    let mut chosen: Vec<(Colour, MarkerShape)> = Vec::new();
    for known in &known {
        chosen.push(known.or_else(|| free.next().copied()).unwrap_or(FREE[6]));
    }
    let of =
        |colour: Colour, all: &[(Colour, MarkerShape)]| all.iter().filter(|other| other.0 == colour).count();
    let mark = |(k, &(colour, shape)): (usize, &(Colour, MarkerShape))| {
        let turn = of(colour, &chosen[..k]);
        MarkStyle { colour: shade(colour, turn, of(colour, &chosen)), shape, turn }
    };
    chosen.iter().enumerate().map(mark).collect()
}

/// `share` of the way from one colour to another.
pub(crate) fn mix(from: Colour, to: Colour, share: f64) -> Colour {
    let blend =
        |a: u8, b: u8| (f64::from(a) + share.clamp(0.0, 1.0) * (f64::from(b) - f64::from(a))).round() as u8;
    RGBColor(blend(from.0, to.0), blend(from.1, to.1), blend(from.2, to.2))
}

/// Contrast of two colours, 1 to 21 (Web Content Accessibility Guidelines 2.2, section 1.4.3).
pub(crate) fn contrast(a: Colour, b: Colour) -> f64 {
    let (bright, dark) = (luminance(a).max(luminance(b)), luminance(a).min(luminance(b)));
    (bright + 0.05) / (dark + 0.05)
}

fn luminance(colour: Colour) -> f64 {
    let linear = |part: u8| {
        let part = f64::from(part) / 255.0;
        if part <= 0.04045 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
    };
    0.2126 * linear(colour.0) + 0.7152 * linear(colour.1) + 0.0722 * linear(colour.2)
}

/// The colour, darkened until words in it have a contrast of 4.5 on white.
pub(crate) fn readable(colour: Colour) -> Colour {
    (0..=20)
        .map(|step| mix(colour, INK, 0.05 * f64::from(step)))
        .find(|&word| contrast(word, WHITE) >= 4.5)
        .unwrap_or(INK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_in_every_series_colour_can_be_read() {
        for (colour, _) in FREE {
            assert!(contrast(readable(colour), WHITE) >= 4.5);
        }
        assert_eq!(readable(BLUE), BLUE, "blue is dark enough as it is");
        assert!((contrast(RGBColor(0, 0, 0), WHITE) - 21.0).abs() < 1e-12);
    }

    #[test]
    fn methods_of_one_family_are_told_apart_by_their_shades() {
        let names = ["gauss4", "gauss6", "gauss8", "gauss10", "gauss12", "gauss14", "gauss16"];
        let lights: Vec<f64> = marks(names).iter().map(|mark| luminance(mark.colour)).collect();
        assert!(lights.windows(2).all(|pair| pair[1] < 0.9 * pair[0]), "{lights:?}");
    }

    #[test]
    fn colours_of_a_map_grow_lighter_all_the_way() {
        let steps: Vec<f64> = (0..=48).map(|k| luminance(even(f64::from(k) / 48.0))).collect();
        assert!(steps.windows(2).all(|pair| pair[1] > pair[0]), "{steps:?}");
    }

    #[test]
    fn methods_keep_their_colour_and_others_never_take_it() {
        let marks = marks(["taylor", "shoulder", "taylor, extended", "elbow"]);
        assert_eq!((marks[0].colour, marks[0].turn), (VERMILLION, 0));
        assert_eq!((marks[2].colour, marks[2].turn), (shade(VERMILLION, 1, 2), 1));
        assert_eq!((marks[1].colour, marks[3].colour), (BLUE, GREEN));
    }
}
