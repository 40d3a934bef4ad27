//! Which charts are drawn, and their files.

use super::failure::Failure;
use super::flags::TellFlags;
use crate::chart::{ChartError, Format, MotionGif, Picture, motion_apng, motion_gif};
use crate::run::Folder;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

/// Options of commands that draw.
#[derive(Clone, Debug, Args)]
pub struct ChartFlags {
    /// Draw no charts
    #[arg(long, help_heading = "Files")]
    pub no_charts: bool,
    /// Formats of charts, joined by commas
    #[arg(
        long,
        value_name = "FORMATS",
        value_parser = formats(),
        value_delimiter = ',',
        default_value = Format::Png.extension(),
        help_heading = "Files"
    )]
    pub chart_format: Vec<Format>,
}

/// Options of commands that show motion.
#[derive(Clone, Debug, Args)]
pub struct MotionFlags {
    /// Draw the motion as an animated GIF, 420 by 432 pixels in 63 colours
    #[arg(long, help_heading = "Files")]
    pub gif: bool,
    /// Draw the motion as an animated PNG, 1050 by 1080 pixels in all colours, from which `ffmpeg -i
    /// FILE.apng -pix_fmt yuv420p FILE.mp4` makes a film
    #[arg(long, help_heading = "Files")]
    pub apng: bool,
}

fn formats() -> impl TypedValueParser<Value = Format> {
    PossibleValuesParser::new(Format::ALL.map(Format::extension))
        .map(|name| Format::ALL.into_iter().find(|format| format.extension() == name).unwrap_or_default())
}

impl ChartFlags {
    /// What charts show, unless none are drawn.
    ///
    /// # Errors
    /// Drawing fails.
    pub fn drawn<T: Default>(&self, draw: impl FnOnce() -> Result<T, ChartError>) -> Result<T, ChartError> {
        if self.no_charts { Ok(T::default()) } else { draw() }
    }

    /// Writes a chart in every format wanted; `name` is without its ending.
    ///
    /// # Errors
    /// The chart cannot be encoded or written.
    pub fn keep(
        &self,
        folder: &mut Folder,
        name: &str,
        picture: &Picture,
        tell: &TellFlags,
    ) -> Result<(), Failure> {
        for format in Format::ALL.into_iter().filter(|format| self.chart_format.contains(format)) {
            write(folder, format!("{name}.{}", format.extension()), &picture.bytes(format)?, tell)?;
        }
        Ok(())
    }
}

impl MotionFlags {
    /// Whether any motion is drawn.
    pub fn has_any(&self) -> bool {
        self.gif || self.apng
    }

    /// Writes a motion in the formats wanted; `name` is without its ending.
    ///
    /// # Errors
    /// The motion cannot be drawn, encoded or written.
    pub fn keep(
        &self,
        folder: &mut Folder,
        name: &str,
        motion: &MotionGif,
        tell: &TellFlags,
    ) -> Result<(), Failure> {
        if self.gif {
            write(folder, format!("{name}.gif"), &motion_gif(motion)?.bytes, tell)?;
        }
        if self.apng {
            write(folder, format!("{name}.apng"), &motion_apng(motion)?.bytes, tell)?;
        }
        Ok(())
    }
}

fn write(folder: &mut Folder, name: String, content: &[u8], tell: &TellFlags) -> Result<(), Failure> {
    let path = folder.path().join(&name);
    folder.write(name, content)?;
    tell.remark(&format!("drew {}", path.display()));
    Ok(())
}
