//! What a chart is made of: marks in points, painted as pixels or written as SVG or PDF.

use super::palette::Colour;
use tiny_skia::{Path, Transform};

/// One thing drawn; lengths in points of 1/72 inch, from the upper left, y downwards.
#[derive(Clone, Debug)]
pub(crate) enum Mark {
    /// A filled outline (nonzero winding rule).
    Fill {
        path: Path,
        colour: Colour,
        /// From 0, not seen, to 1.
        opacity: f64,
    },
    /// A line with round joints.
    Stroke {
        path: Path,
        colour: Colour,
        opacity: f64,
        width: f64,
        /// Whether its ends are round instead of flat.
        round: bool,
    },
    /// A horizontal or vertical line with flat ends, on whole pixels where it is painted.
    Rule { from: [f64; 2], to: [f64; 2], colour: Colour, opacity: f64, width: f64 },
    /// Words as an outline.
    Words {
        text: String,
        path: Path,
        colour: Colour,
        /// Width of a white rim; 0 for none.
        halo: f64,
    },
    /// Equal rectangles of colour, row by row: red, green, blue.
    Raster { at: [f64; 2], size: [f64; 2], pixels: [usize; 2], rgb: Vec<u8> },
}

/// The drawing of a page: what [`Picture`](super::Picture) writes into its files.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drawing {
    /// Width and height \[pt\].
    pub size: [f64; 2],
    pub marks: Vec<Mark>,
}

/// A path in other units.
pub(crate) fn scaled(path: &Path, scale: f64) -> Option<Path> {
    path.clone().transform(Transform::from_scale(scale as f32, scale as f32))
}
