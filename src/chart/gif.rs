//! Frames into a GIF: one palette for all of them, only what has changed.

use super::ChartError;
use gif::{DisposalMethod, Frame, Repeat};
use std::borrow::Cow;
use std::collections::HashMap;

/// Colours besides the transparent one; more of them cannot be told apart in a drawing and make the file
/// larger.
const COLOURS: usize = 63;
/// Smallest distance between two colours of the palette (Euclidean, red, green, blue from 0 to 255).
const APART: i32 = 22;
const TRANSPARENT: u8 = COLOURS as u8;

/// Writes frame after frame.
pub(crate) struct GifEncoder {
    gif: gif::Encoder<Vec<u8>>,
    width: usize,
    delay: u16,
    palette: Vec<[u8; 3]>,
    nearest: HashMap<[u8; 3], u8>,
    shown: Vec<u8>,
}

fn distance(a: [u8; 3], b: [u8; 3]) -> i32 {
    a.iter().zip(b).map(|(&a, b)| (i32::from(a) - i32::from(b)).pow(2)).sum()
}

/// The commonest colours that keep apart.
fn palette(samples: &[Vec<u8>]) -> Vec<[u8; 3]> {
    let mut count: HashMap<[u8; 3], u32> = HashMap::new();
    for &pixel in samples.iter().flat_map(|frame| frame.as_chunks::<3>().0) {
        *count.entry(pixel).or_default() += 1;
    }
    let mut colours: Vec<([u8; 3], u32)> = count.into_iter().collect();
    // Ties are settled by the colour itself, so the file does not depend on the order of a hash table.
    colours.sort_by_key(|&(colour, count)| (std::cmp::Reverse(count), colour));
    let mut chosen: Vec<[u8; 3]> = Vec::new();
    for (colour, _) in colours {
        if chosen.len() == COLOURS {
            break;
        }
        if chosen.iter().all(|&other| distance(colour, other) >= APART * APART) {
            chosen.push(colour);
        }
    }
    chosen
}

impl GifEncoder {
    /// An endless animation; `delay` in 1/100 s; colours are chosen from `samples`.
    pub(crate) fn new(width: u32, height: u32, delay: u16, samples: &[Vec<u8>]) -> Result<Self, ChartError> {
        let palette = palette(samples);
        let mut table: Vec<u8> = palette.iter().flatten().copied().collect();
        table.resize(3 * (COLOURS + 1), 255);
        let mut gif = gif::Encoder::new(Vec::new(), width as u16, height as u16, &table)?;
        gif.set_repeat(Repeat::Infinite)?;
        Ok(GifEncoder {
            gif,
            width: width as usize,
            delay,
            palette,
            nearest: HashMap::new(),
            shown: Vec::new(),
        })
    }

    fn index(&mut self, colour: [u8; 3]) -> u8 {
        let palette = &self.palette;
        *self.nearest.entry(colour).or_insert_with(|| {
            let best = (0..palette.len()).min_by_key(|&k| distance(palette[k], colour)).unwrap_or(0);
            best as u8
        })
    }

    /// Adds a frame (red, green, blue of each pixel): the rectangle that changed, unchanged pixels in it
    /// transparent.
    pub(crate) fn frame(&mut self, rgb: &[u8]) -> Result<(), ChartError> {
        let mut last = ([0; 3], self.index([0; 3]));
        let index = |&colour: &[u8; 3]| {
            // Most pixels look like their neighbour.
            if colour != last.0 {
                last = (colour, self.index(colour));
            }
            last.1
        };
        let now: Vec<u8> = rgb.as_chunks::<3>().0.iter().map(index).collect();
        let changed = |k: usize| self.shown.get(k) != Some(&now[k]);
        let mut area: Option<[usize; 4]> = None;
        for k in (0..now.len()).filter(|&k| changed(k)) {
            let (x, y) = (k % self.width, k / self.width);
            let [left, top, right, bottom] = area.unwrap_or([x, y, x, y]);
            area = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
        }
        // A frame that changes nothing still takes its time.
        let [left, top, right, bottom] = area.unwrap_or([0; 4]);
        let places =
            (top..=bottom).flat_map(|y| (left..=right).map(move |x| (x, y))).map(|(x, y)| y * self.width + x);
        let buffer: Vec<u8> = places.map(|k| if changed(k) { now[k] } else { TRANSPARENT }).collect();
        self.gif.write_frame(&Frame {
            delay: self.delay,
            dispose: DisposalMethod::Keep,
            transparent: Some(TRANSPARENT),
            left: left as u16,
            top: top as u16,
            width: (right - left + 1) as u16,
            height: (bottom - top + 1) as u16,
            buffer: Cow::Owned(buffer),
            ..Frame::default()
        })?;
        self.shown = now;
        Ok(())
    }

    /// The file.
    pub(crate) fn finish(self) -> Result<Vec<u8>, ChartError> {
        self.gif.into_inner().map_err(ChartError::Gif)
    }
}
