//! A finished picture, and how it becomes a file: whole or not at all.

use super::ChartError;
use super::mark::Drawing;
use super::pdf::pdf;
use super::svg::svg;
use super::text::TextBox;
use std::io::Write;
use std::path::Path;

/// A drawn chart.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width \[px\].
    pub width: u32,
    /// Height \[px\].
    pub height: u32,
    /// Red, green and blue of each pixel, row by row from the top: `3·width·height` bytes.
    pub rgb: Vec<u8>,
    /// Pixels per point of 1/72 inch.
    pub px_per_pt: f64,
    /// Title, also written into the file.
    pub title: String,
    /// What is drawn, also written into the file.
    pub description: String,
    /// The words in the picture and where they stand.
    pub texts: Vec<TextBox>,
    /// Data areas `[left, top, right, bottom]` \[pt\].
    pub panels: Vec<[f64; 4]>,
    /// What was drawn, for files of lines instead of pixels.
    pub(crate) drawing: Drawing,
}

/// What a file of a chart is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// Pixels.
    #[default]
    Png,
    /// Lines, as XML; for web pages and drawing programs.
    Svg,
    /// Lines; for documents and printers.
    Pdf,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Png, Self::Svg, Self::Pdf];

    /// The end of its files' names, and its own name.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Svg => "svg",
            Self::Pdf => "pdf",
        }
    }

    /// The format that the end of a file's name tells, whatever its case.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Self::ALL.into_iter().find(|format| format.extension() == extension)
    }
}

/// A PNG file in memory: 8-bit RGB.
pub(crate) fn encoded(
    width: u32,
    height: u32,
    rgb: &[u8],
    more: impl FnOnce(&mut png::Encoder<&mut Vec<u8>>) -> Result<(), png::EncodingError>,
) -> Result<Vec<u8>, ChartError> {
    // A debug build spends seconds on a good compression; its pictures are looked at once.
    let compression =
        if cfg!(debug_assertions) { png::Compression::Fast } else { png::Compression::Balanced };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(compression);
    more(&mut encoder)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(bytes)
}

impl Picture {
    /// The picture as a PNG file in memory: 8-bit RGB, size on paper, sRGB, text chunks `Title`,
    /// `Description` and `Software`.
    ///
    /// # Errors
    /// [`ChartError::Png`] if the encoder refuses, for instance a picture without pixels.
    pub fn png_bytes(&self) -> Result<Vec<u8>, ChartError> {
        encoded(self.width, self.height, &self.rgb, |encoder| {
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
            let per_metre = (self.px_per_pt * 72.0 / 0.0254).round() as u32;
            encoder.set_pixel_dims(Some(png::PixelDimensions {
                xppu: per_metre,
                yppu: per_metre,
                unit: png::Unit::Meter,
            }));
            encoder.add_itxt_chunk("Title".to_owned(), self.title.clone())?;
            encoder.add_itxt_chunk("Description".to_owned(), self.description.clone())?;
            encoder.add_itxt_chunk(
                "Software".to_owned(),
                concat!("driftless ", env!("CARGO_PKG_VERSION")).to_owned(),
            )
        })
    }

    /// The picture as a file of a format in memory.
    ///
    /// SVG and PDF files hold the lines, words as outlines; only the cells of maps are pixels in them.
    ///
    /// # Errors
    /// As [`Picture::png_bytes`], or [`ChartError::Drawing`] if the compression of a PDF file gives up.
    pub fn bytes(&self, format: Format) -> Result<Vec<u8>, ChartError> {
        match format {
            Format::Png => self.png_bytes(),
            Format::Svg => Ok(svg(&self.drawing, &self.title, &self.description)?.into_bytes()),
            Format::Pdf => pdf(&self.drawing, &self.title, &self.description),
        }
    }

    /// Writes the file in the format its name ends in, `.png`, `.svg` or `.pdf`, replacing an older one at
    /// once.
    ///
    /// # Errors
    /// As [`Picture::bytes`], [`ChartError::Format`] for another ending, or [`ChartError::Write`] if the
    /// folder does not exist or cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ChartError> {
        let format = Format::of(path).ok_or_else(|| ChartError::Format { path: path.to_owned() })?;
        write_whole(path, &self.bytes(format)?)
    }
}

/// Writes next to the target first, so that a reader never meets half a file.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ChartError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(ChartError::Folder { path: path.to_owned(), folder: folder.to_owned() });
    }
    let failed = |source: std::io::Error| ChartError::Write { path: path.to_owned(), source };
    let file = tempfile::Builder::new().prefix(".chart-").tempfile_in(folder);
    // What the system says names the temporary file.
    let mut file = file.map_err(|error| failed(error.kind().into()))?;
    file.write_all(bytes).map_err(failed)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private; a chart is as readable as any other result.
        file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644)).map_err(failed)?;
    }
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}
