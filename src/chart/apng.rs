//! Frames into an animated PNG: after the first, the rectangle that changed.

use super::ChartError;
use png::{BlendOp, DisposeOp};

/// Writes frame after frame.
pub(crate) struct ApngEncoder<'a> {
    writer: png::Writer<&'a mut Vec<u8>>,
    width: usize,
    shown: Vec<u8>,
}

impl<'a> ApngEncoder<'a> {
    /// An endless animation of so many frames, into `bytes`; `delay` in 1/100 s.
    pub(crate) fn new(
        bytes: &'a mut Vec<u8>,
        [width, height]: [u32; 2],
        frames: u32,
        delay: u16,
    ) -> Result<Self, ChartError> {
        let mut encoder = png::Encoder::new(bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        encoder.set_animated(frames, 0)?;
        encoder.set_frame_delay(delay, 100)?;
        encoder.set_blend_op(BlendOp::Source)?;
        encoder.set_dispose_op(DisposeOp::None)?;
        Ok(Self { writer: encoder.write_header()?, width: width as usize, shown: Vec::new() })
    }

    /// Adds a frame: red, green and blue of each pixel.
    pub(crate) fn frame(&mut self, rgb: &[u8]) -> Result<(), ChartError> {
        if self.shown.is_empty() {
            self.writer.write_image_data(rgb)?;
        } else {
            let (now, before) = (rgb.as_chunks::<3>().0, self.shown.as_chunks::<3>().0);
            let mut area: Option<[usize; 4]> = None;
            for k in (0..now.len()).filter(|&k| now[k] != before[k]) {
                let (x, y) = (k % self.width, k / self.width);
                let [left, top, right, bottom] = area.unwrap_or([x, y, x, y]);
                area = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
            }
            // A frame that changes nothing still takes its time.
            let [left, top, right, bottom] = area.unwrap_or([0; 4]);
            // From the corner first: position and size must fit into the page at every moment.
            self.writer.reset_frame_position()?;
            self.writer.set_frame_dimension((right - left + 1) as u32, (bottom - top + 1) as u32)?;
            self.writer.set_frame_position(left as u32, top as u32)?;
            let rows = (top..=bottom).map(|y| &now[y * self.width + left..=y * self.width + right]);
            let part: Vec<u8> = rows.flatten().flatten().copied().collect();
            self.writer.write_image_data(&part)?;
        }
        self.shown.clear();
        self.shown.extend(rgb);
        Ok(())
    }

    /// Ends the file.
    pub(crate) fn finish(self) -> Result<(), ChartError> {
        Ok(self.writer.finish()?)
    }
}
