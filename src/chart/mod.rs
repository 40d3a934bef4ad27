//! Charts: plain data in, pictures out, drawn off-screen.
//!
//! Each chart is a struct of plain rows and a function that turns it into a [`Picture`] (or an
//! [`Animation`]).  Nothing is run or read here.  The pictures are drawn with plotters on a canvas of our
//! own, because its bitmap backend cannot draw smooth lines; fonts are part of the program.  What is drawn is
//! kept as lines, so that every chart can become a PNG, an SVG or a PDF file ([`Format`]).
//!
//! Sizes are points of 1/72 inch; one number, pixels per point, sets the resolution.  Every string may carry
//! a small markup, `*italic*`, `_{below}`, `^{above}`; [`plain`] protects names that come from outside.
//!
//! | chart | data | shows |
//! | --- | --- | --- |
//! | [`mechanism()`] | [`MechanismChart`] | a pose, earlier poses, paths of points |
//! | [`angles()`] | [`Angles`] | angles of bars against time |
//! | [`energy_drift()`] | [`EnergyDrift`] | largest relative energy error so far |
//! | [`constraint_drift()`] | [`ConstraintDrift`] | defects of constraints, positions beside velocities |
//! | [`torque_power()`] | [`TorquePower`] | torque above power of motors |
//! | [`outputs()`] | [`OutputsChart`] | outputs by unit, their extremes marked |
//! | [`work_precision()`] | [`WorkPrecision`] | error against run time or evaluations |
//! | [`map()`] | [`Map`] | a value over two others, as colours |
//! | [`multipliers()`] | [`Multipliers`] | Floquet multipliers and the unit circle |
//! | [`matrix()`] | [`OutcomeMatrix`] | outcomes by row and column, as colours and words |
//! | [`bars()`] | [`Bars`] | signed values in groups, as bars |
//! | [`bands()`] | [`Bands`] | curves with bands of uncertainty and measured dots |
//! | [`profile()`] | [`ProfileChart`] | a value over one other |
//! | [`motion_gif()`], [`motion_apng()`] | [`MotionGif`] | the mechanism in motion |

mod angles;
mod annotations;
mod apng;
mod axis;
mod bands;
mod bars;
mod canvas;
mod constraint_drift;
mod energy_drift;
mod file;
mod gif;
mod grid;
mod labels;
mod lines;
mod map;
mod mark;
mod matrix;
mod mechanism;
mod motion;
mod multipliers;
mod names;
mod outputs;
mod palette;
mod panel;
mod pdf;
mod profile;
mod sheet;
mod sketch;
mod svg;
mod text;
mod ticks;
mod torque_power;
mod view;
mod work_precision;

pub use angles::{AngleSeries, Angles, angles};
pub use bands::{Band, Bands, bands};
pub use bars::{BarGroup, Bars, bars};
pub use constraint_drift::{ConstraintDrift, ResidualPanel, constraint_drift};
pub use energy_drift::{DriftSeries, EnergyDrift, energy_drift};
pub use file::{Format, Picture};
pub use map::{Cell, Map, MapAxis, map};
pub use matrix::{CellOutcome, OutcomeMatrix, matrix};
pub use mechanism::{MechanismChart, mechanism};
pub use motion::{Animation, MotionGif, motion_apng, motion_gif};
pub use multipliers::{Multipliers, multipliers};
pub use outputs::{OutputSeries, OutputsChart, outputs};
pub(crate) use profile::spans_decades;
pub use profile::{ProfileChart, profile};
pub use sketch::{HingeSketch, MotorPose, Pose, Sketch, SliderPose, SpiralPose, SpringSketch, WallSketch};
pub use text::{TextBox, plain, unmarked};
pub use torque_power::{MotorSeries, TorquePower, torque_power};
pub use work_precision::{Cost, WorkPrecision, WorkSeries, work_precision};

use std::path::PathBuf;
use thiserror::Error;

/// Pixels per point of charts in files: pages 480 pt wide become 1920 px.
pub const FILE_RESOLUTION: f64 = 4.0;

/// Width and height of a usual chart \[pt\].
const PAGE: [f64; 2] = [480.0, 300.0];

/// Why there is no chart.
#[derive(Debug, Error)]
pub enum ChartError {
    /// The resolution makes no picture.
    #[error("no chart has {px_per_pt} pixels per point; use 0.1 to 20, or 4 for files")]
    Resolution {
        /// What was asked for.
        px_per_pt: f64,
    },
    /// The file's name tells no format.
    #[error("{}: a chart's file ends in .png, .svg or .pdf\nhint: --chart start.png", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// A font inside the program cannot be read.
    #[error("a font inside the program is damaged")]
    Font,
    /// The drawing library gave up.
    #[error("drawing a chart failed: {0}")]
    Drawing(String),
    /// The PNG encoder gave up.
    #[error("encoding a PNG picture failed: {0}")]
    Png(#[from] png::EncodingError),
    /// The GIF encoder gave up.
    #[error("encoding a GIF animation failed: {0}")]
    Gif(#[from] ::gif::EncodingError),
    /// The folder of the file is not there.
    #[error("cannot write {}: there is no folder {}\nhint: make it first, or name another", path.display(),
        folder.display())]
    Folder {
        /// The file.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The file cannot be written.
    #[error("cannot write {}: {source}\nhint: is the disk full, or the folder closed to you?",
        path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

impl<E: std::error::Error + Send + Sync> From<plotters::drawing::DrawingAreaErrorKind<E>> for ChartError {
    fn from(error: plotters::drawing::DrawingAreaErrorKind<E>) -> Self {
        ChartError::Drawing(error.to_string())
    }
}
