//! What is asked of sensitivities, and what comes of it.

use super::Measure;
use crate::dynamics::CompileError;
use crate::scene::{Scene, SceneError};
use nalgebra::DMatrix;

/// What errors of the tolerance may have grown to in a measure, over its value or unit: beyond, derivatives
/// are those of noise.
const KNOWN: f64 = 1e-3;

/// What is asked for.
#[derive(Clone, Debug, Default)]
pub struct SensitivityRequest {
    /// What is derived.
    pub of: Vec<Measure>,
    /// By which numbers: paths as of `--set`.
    pub to: Vec<String>,
    /// The time of outputs, and the end of the run \[s\]; `None`: that of the scene.
    pub at: Option<f64>,
    /// Interval of outputs over time \[s\]; `None`: only at the end.
    pub every: Option<f64>,
    /// Tolerance of the motion; `None`: [`TOLERANCE`](super::TOLERANCE).
    pub tolerance: Option<f64>,
}

/// Why there are no sensitivities.
#[derive(Debug, thiserror::Error)]
pub enum SensitivityError {
    /// The scene, or a name in it.
    #[error("{0}")]
    Scene(#[from] SceneError),
    /// It has no equations.
    #[error("{0}")]
    Compile(#[from] CompileError),
    /// What is asked for makes no sense.
    #[error("{what}\nhint: {hint}")]
    Asked {
        /// What is wrong.
        what: String,
        /// What to ask for.
        hint: String,
    },
    /// The scene has no such derivatives.
    #[error("{0}")]
    Unsuited(String),
    /// The motion itself stops.
    #[error("{0}")]
    Stopped(String),
}

/// A number of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct InputNumber {
    /// Its path.
    pub path: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Estimated relative error of the derivatives of the equations by it.
    pub error: f64,
}

/// A measure with its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// When it is taken \[s\].
    pub t: f64,
    /// Its value.
    pub value: f64,
    /// Its derivatives by all numbers, in the unit of the measure over that of the number.
    pub slopes: Vec<f64>,
    /// Why there is none.
    pub why: Option<String>,
}

/// Outputs at one time with their derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct SensitivityRow {
    /// Time \[s\].
    pub t: f64,
    /// Values of the outputs.
    pub values: Vec<f64>,
    /// Derivatives, output by output, then number by number.
    pub slopes: Vec<Vec<f64>>,
}

/// Derivatives of measures by numbers of a scene.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// The scene.
    pub scene: Scene,
    /// The numbers.
    pub inputs: Vec<InputNumber>,
    /// The measures.
    pub measures: Vec<Measured>,
    /// Names and units of the outputs over time.
    pub outputs: Vec<[String; 2]>,
    /// The outputs over time, where that was asked for.
    pub rows: Vec<SensitivityRow>,
    /// Horizon \[s\].
    pub until: f64,
    /// Why the derivatives end before.
    pub lost: Option<String>,
    /// Steps of the motion and of the columns.
    pub steps: [u64; 2],
    /// True where the columns are power series beside that of the motion, false where they are integrated by
    /// collocation.
    pub by_series: bool,
}

impl Sensitivity {
    /// Derivatives of the measures (rows) by the numbers (columns); NaN where there are none.
    pub fn jacobian(&self) -> DMatrix<f64> {
        let entry = |i: usize, j: usize| self.measures[i].slopes.get(j).copied().unwrap_or(f64::NAN);
        DMatrix::from_fn(self.measures.len(), self.inputs.len(), entry)
    }

    /// Covariance of the measures where the numbers have this covariance, to first order.
    pub fn covariance(&self, inputs: &DMatrix<f64>) -> DMatrix<f64> {
        let jacobian = self.jacobian();
        &jacobian * inputs * jacobian.transpose()
    }

    /// Standard deviations of the outputs, row by row, where the numbers are independent and have these
    /// standard deviations, to first order.
    pub fn bands(&self, deviations: &[f64]) -> Vec<Vec<f64>> {
        let band = |slopes: &Vec<f64>| {
            let squares = slopes.iter().zip(deviations).map(|(slope, sigma)| (slope * sigma).powi(2));
            squares.sum::<f64>().sqrt()
        };
        self.rows.iter().map(|row| row.slopes.iter().map(band).collect()).collect()
    }
}

/// Why the derivatives of a measure are those of noise, where they are: a change of a number by the share of
/// the tolerance does as much to it as errors of that size.
pub(super) fn doubt(inputs: &[InputNumber], tolerance: f64, value: f64, slopes: &[f64]) -> Option<String> {
    let tolerance = tolerance.max(f64::EPSILON);
    let size = |input: &InputNumber| if input.value == 0.0 { 1.0 } else { input.value.abs() };
    let moved = inputs.iter().zip(slopes).map(|(input, slope)| slope.abs() * size(input));
    let share = tolerance * moved.fold(0.0, f64::max) / value.abs().max(1.0);
    (share > KNOWN).then(|| {
        format!(
            "the motion is not known any more: errors of {tolerance:.0e} have grown to {share:.0e} of the \
             value; ask for an earlier time, and look at the horizon that `run` tells"
        )
    })
}
