//! Fitting numbers of a scene to measured data: weighted least squares with the derivatives of
//! [`sensitivity`](super::sensitivity).
//!
//! ```text
//! min Σ ((y_i - Y(t_i; p)) / σ_i)²                                     Levenberg and Marquardt
//! several parts: unknown states s_k at their beginnings as well,  s_k+1 = x(t_k+1; s_k,
//!     p)  by growing weights
//! covariance of p = (JᵀJ)⁻¹ at the minimum
//! σ² of a column, where nobody says:  Σ (y_i - Y)² / (n - Σ h_ii),   H = J (JᵀJ)⁻¹ Jᵀ,  until it stays
//! ```
//!
//! Where small differences grow fast the sum of squares over the whole time has many minima; over parts that
//! are short against that growth, tied together by continuity, it has not (*multiple shooting*).
//!
//! Sources: J. J. Moré, *The Levenberg-Marquardt algorithm: implementation and theory*, Lecture Notes in
//! Mathematics 630 (1978); H. G. Bock, *Recent advances in parameter identification techniques for O.D.E.*,
//! Progress in Scientific Computing 2 (1983).

mod bounds;
mod data;
mod doubt;
mod noise;
mod problem;
mod search;
mod segment;

pub use data::Data;

use super::driver::Pause;
use super::sensitivity::{Measure, SensitivityError, SensitivityRequest, Study};
use crate::scene::formula::unit::UnitScale;
use crate::scene::{Output, OutputNames, Scene, SceneError, Template, Variable};
use nalgebra::DMatrix;
use problem::FitProblem;
use segment::Lost;

/// How often noise is estimated anew at most.
const ROUNDS: usize = 40;
/// Weights of continuity, over the least noise, one after the other.
const CONTINUITY: [f64; 3] = [0.1, 10.0, 1e3];

/// What is asked for.
#[derive(Clone, Debug)]
pub struct FitRequest {
    /// Numbers to be found: paths as of `--set`, whose values in the scene are where the search begins.
    pub vary: Vec<String>,
    /// Columns of the data that count; none: all whose names mean something in the scene.
    pub columns: Vec<String>,
    /// Standard deviations of columns, by name, where they are known, in the unit of the data's header.
    pub sigmas: Vec<(String, f64)>,
    /// Parts of the data for multiple shooting.
    pub segments: usize,
    /// Tolerance of the motion.
    pub tolerance: Option<f64>,
}

impl Default for FitRequest {
    fn default() -> Self {
        let (vary, columns, sigmas) = (Vec::new(), Vec::new(), Vec::new());
        Self { vary, columns, sigmas, segments: 1, tolerance: None }
    }
}

/// Why there is no fit.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// The file of the data.
    #[error("{file}: cannot be read: {why}\nhint: check the path; --data is a table with a column `t [s]`")]
    Unreadable {
        /// Its path.
        file: String,
        /// Why.
        why: String,
    },
    /// The data.
    #[error("{0}")]
    Data(String),
    /// What is asked for.
    #[error("{0}")]
    Asked(String),
    /// The scene, or its derivatives.
    #[error("{0}")]
    Sensitivity(#[from] SensitivityError),
    /// The search found no minimum.
    #[error("{0}")]
    Failed(String),
    /// It was paused.
    #[error("interrupted")]
    Interrupted,
}

impl From<Lost> for FitError {
    fn from(lost: Lost) -> Self {
        match lost {
            Lost::Interrupted => Self::Interrupted,
            Lost::TooLong(_) | Lost::Why(_) => Self::Failed(lost.to_string()),
        }
    }
}

impl From<SceneError> for FitError {
    fn from(error: SceneError) -> Self {
        Self::Sensitivity(error.into())
    }
}

/// A number that was fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedNumber {
    /// Its path.
    pub path: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
    /// Where the search began.
    pub guess: f64,
    /// Its value.
    pub value: f64,
    /// Its standard error; NaN of a number at a bound of what the scene takes.
    pub error: f64,
    /// True where it is at such a bound, and the others are the best there.
    pub is_at_bound: bool,
}

/// A column of the data beside the fitted motion.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedColumn {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Standard deviation of its noise; NaN of a column without values.
    pub sigma: f64,
    /// Whether that was given.
    pub is_given: bool,
    /// The fitted motion at all times of the data.
    pub model: Vec<f64>,
    /// What was measured.
    pub measured: Vec<Option<f64>>,
}

impl FittedColumn {
    /// Measured less fitted.
    pub(crate) fn residuals(&self) -> impl Iterator<Item = f64> {
        self.measured.iter().zip(&self.model).filter_map(|(measured, model)| Some((*measured)? - model))
    }

    /// Root mean square of the residuals; NaN of a column without values.
    pub(crate) fn rms(&self) -> f64 {
        let squares: f64 = self.residuals().map(|residual| residual * residual).sum();
        (squares / self.count() as f64).sqrt()
    }

    /// How many values there are.
    pub(crate) fn count(&self) -> usize {
        self.measured.iter().flatten().count()
    }
}

/// Numbers of a scene fitted to data.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The scene with the fitted numbers.
    pub scene: Scene,
    /// The numbers.
    pub numbers: Vec<FittedNumber>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Times of the data \[s\].
    pub times: Vec<f64>,
    /// The columns fitted to.
    pub columns: Vec<FittedColumn>,
    /// Columns of the data that mean nothing in the scene.
    pub ignored: Vec<String>,
    /// Sum of the squares of the residuals over their standard deviations.
    pub chi_square: f64,
    /// Measurements less numbers fitted.
    pub degrees_of_freedom: usize,
    /// Runs made.
    pub runs: u64,
    /// Parts of the data, and the largest step between them that is left \[rad, or lengths of the
    /// mechanism\].
    pub segments: usize,
    /// See [`Fit::segments`].
    pub gap: f64,
    /// How the search ended.
    pub ended: String,
    /// What is doubtful of the minimum: residuals that noise does not explain.
    pub doubts: Option<String>,
}

/// Fits numbers of a scene to data.
///
/// ```
/// use driftless::run::fit::{Data, FitRequest, fit};
/// use driftless::{Simulation, Template};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let template = Template::read("examples/scenes/spring.json".as_ref(), &[])?;
/// let mut table = String::from("t [s],bar1.phi [rad]\n");
/// Simulation::new(&template.scene()?)?.until(1.0).every(0.1).run_with(|sample| {
///     table += &format!("{},{}\n", sample.t, sample.phi[0]);
///     Ok(())
/// })?;
/// let guess = Template::read("examples/scenes/spring.json".as_ref(), &["spring.stiffness=7".parse()?])?;
/// let request = FitRequest { vary: vec!["spring.stiffness".into()], ..FitRequest::default() };
/// let found = fit(&guess, &Data::parse(&table, "table")?, &request, &mut || false)?;
/// assert!((found.numbers[0].value - 7.3942875).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Data, scene or request make no sense together, no minimum is found, or `pause` came true.
pub fn fit(
    template: &Template,
    data: &Data,
    request: &FitRequest,
    pause: &mut Pause,
) -> Result<Fit, FitError> {
    let scene = template.scene()?;
    let (outputs, ignored) = chosen(&scene, data, request)?;
    let variables = varied(template, request)?;
    let mut columns = columns(data, &outputs, request)?;
    let rows = data.times.len();
    if request.segments == 0 || request.segments > rows.max(2) / 2 {
        let text = format!("{} segments of {rows} rows\nhint: at least two rows a segment", request.segments);
        return Err(FitError::Asked(text));
    }
    let study_request = SensitivityRequest {
        of: outputs.into_iter().map(Measure::Output).collect(),
        to: request.vary.clone(),
        at: data.times.last().copied().filter(|last| *last > 0.0),
        every: None,
        tolerance: request.tolerance,
    };
    let first = Study::new(template, &study_request)?;
    if let Some(number) = first.idle().next() {
        let text = format!("--vary {}: no motion depends on it", number.path);
        return Err(SensitivityError::Unsuited(format!("{text}\nhint: leave it out")).into());
    }
    let guess: Vec<f64> = first.inputs.iter().map(|input| input.value).collect();
    let count = columns.iter().flat_map(|column| &column.measured).flatten().count();
    if count <= guess.len() {
        let (measurements, numbers) = (
            if count == 1 { "1 measurement" } else { &format!("{count} measurements") },
            if guess.len() == 1 { "a number and its error" } else { "as many numbers and their errors" },
        );
        let text = format!("{measurements} cannot determine {numbers}");
        return Err(FitError::Data(format!("{}: {text}\nhint: more rows or columns", data.source)));
    }
    let indices = indices(&first, data, &columns)?;
    let sizes = noise::sizes(&first, &indices, &columns);
    noise::guess(&mut columns, &sizes);
    let mut problem = FitProblem::new(
        template,
        (variables, guess.clone()),
        (data, indices, request.segments),
        study_request,
        pause,
    );
    problem.guess_states(&columns)?;
    let (mut problem, [ended, untold]) = weighted(problem, &mut columns, &sizes)?;
    let covariance = problem.covariance(&columns)?;
    let ended = format!("{ended} after {} runs{untold}", problem.runs());
    let (values, held) = (problem.values(), problem.held());
    let scene = template.filled(problem.variables(), &values)?;
    let numbers = first.inputs.iter().enumerate().map(|(k, input)| FittedNumber {
        path: input.path.clone(),
        unit: input.unit.clone(),
        guess: guess[k],
        value: values[k],
        error: if held[k] { f64::NAN } else { covariance[(k, k)].sqrt() },
        is_at_bound: held[k],
    });
    let square =
        |column: &FittedColumn| (column.residuals().map(|r| (r / column.sigma).powi(2))).sum::<f64>();
    Ok(Fit {
        numbers: numbers.collect(),
        chi_square: columns.iter().map(square).sum(),
        degrees_of_freedom: count - held.iter().filter(|held| !**held).count(),
        covariance,
        times: data.times.clone(),
        ignored,
        runs: problem.runs(),
        segments: request.segments,
        gap: problem.gap(),
        doubts: doubt::doubts(&columns),
        columns,
        ended,
        scene,
    })
}

/// The numbers to be found, each once.
fn varied(template: &Template, request: &FitRequest) -> Result<Vec<Variable>, FitError> {
    let mut variables: Vec<Variable> = Vec::new();
    for name in &request.vary {
        let variable = template.variable(name)?;
        if variables.iter().any(|known| known.path == variable.path) {
            let text = format!("--vary names {} twice\nhint: name each number once", variable.path);
            return Err(SensitivityError::Unsuited(text).into());
        }
        variables.push(variable);
    }
    if variables.is_empty() {
        return Err(FitError::Asked(
            "nothing to fit\nhint: name numbers of the scene, as --vary spring.stiffness".into(),
        ));
    }
    Ok(variables)
}

/// The minimum with the noise of the columns that is found there, how the search for it ended, and what is
/// not told.
fn weighted<'a>(
    mut problem: FitProblem<'a>,
    columns: &mut [FittedColumn],
    sizes: &[f64],
) -> Result<(FitProblem<'a>, [String; 2]), Lost> {
    let (mut ended, mut untold) = ("", Vec::new());
    for _ in 0..ROUNDS {
        let least = columns.iter().fold(f64::INFINITY, |least, column| least.min(column.sigma));
        let weights = if problem.has_segments() { &CONTINUITY[..] } else { &CONTINUITY[..1] };
        for weight in weights {
            (problem, ended) = problem.minimize(columns, weight / least)?;
        }
        problem.take_model(columns)?;
        let told = problem.told(columns.len())?;
        let moving = noise::estimate(columns, sizes, &told);
        untold = noise::untold(columns, &told);
        if moving.is_empty() {
            break;
        }
        untold.extend(moving.into_iter().filter(|name| !untold.contains(name)).collect::<Vec<_>>());
    }
    let untold = untold
        .first()
        .map(|first| format!("; the noise of {} is not told: --sigma {first}=… gives it", untold.join(", ")));
    Ok((problem, [ended.into(), untold.unwrap_or_default()]))
}

/// Numbers of the outputs of the columns.
fn indices(study: &Study, data: &Data, columns: &[FittedColumn]) -> Result<Vec<usize>, FitError> {
    let heads: Vec<&str> =
        study.mechanism.outputs.iter().flat_map(|outputs| outputs.heads()).map(|(name, _)| name).collect();
    let index = |column: &FittedColumn| {
        heads.iter().position(|head| *head == column.name).ok_or_else(|| {
            let text = format!("{}: column {} is no output of the motion", data.source, column.name);
            FitError::Data(format!("{text}\nhint: the motion has: {}", heads.join(", ")))
        })
    };
    columns.iter().map(index).collect()
}

/// Outputs of the columns that count, and the names of those that mean nothing.
fn chosen(scene: &Scene, data: &Data, request: &FitRequest) -> Result<(Vec<Output>, Vec<String>), FitError> {
    let names = OutputNames::of(scene);
    let (mut outputs, mut ignored): (Vec<Output>, Vec<String>) = (Vec::new(), Vec::new());
    let known: Vec<&str> = data.columns.iter().map(|(name, _)| name.as_str()).collect();
    if let Some(missing) = request.columns.iter().find(|name| !known.contains(&name.as_str())) {
        let text = format!("{}: has no column {missing}\nhint: there are: {}", data.source, known.join(", "));
        return Err(FitError::Data(text));
    }
    for (k, (name, _)) in data.columns.iter().enumerate() {
        if !request.columns.is_empty() && !request.columns.contains(name) {
            continue;
        }
        let own = scene.outputs.iter().find(|output| output.name == *name).cloned();
        let output = own.unwrap_or_else(|| Output { name: name.clone(), formula: name.clone() });
        match names.bind(&output) {
            Ok(_) if outputs.iter().any(|known| known.name == *name) => {
                let text = format!("{}: has two columns {name}\nhint: leave one of them out", data.source);
                return Err(FitError::Data(text));
            }
            Ok(bound) => {
                let unit = data.units.get(k).and_then(Option::as_deref);
                check_unit(unit, &bound.unit).map_err(|(what, hint)| {
                    let text = format!("{}: line 1, column {name}: {what}\nhint: {hint}", data.source);
                    FitError::Data(text)
                })?;
                outputs.push(output);
            }
            Err(error) if request.columns.contains(name) => {
                let text = format!("{}: column {name}: {}\nhint: {}", data.source, error.problem, error.hint);
                return Err(FitError::Data(text));
            }
            Err(_) => ignored.push(name.clone()),
        }
    }
    if outputs.is_empty() {
        let bar = scene.bars.first().map_or("bar1", |bar| &bar.name);
        return Err(FitError::Data(format!(
            "{}: no column is named after an output or a quantity of the scene\nhint: quantities are angles, \
                rates, points and forces, as {bar}.phi [rad]; for another one, as an energy, add an output \
                by a formula (--output) and name the column after it",
            data.source
        )));
    }
    Ok((outputs, ignored))
}

/// A column's unit, where it has one, is of the dimension of the scene's quantity, where that is known.
fn check_unit(unit: Option<&str>, own: &str) -> Result<(), (String, String)> {
    let Some(unit) = unit else { return Ok(()) };
    let scale = UnitScale::read(unit)
        .map_err(|part| (format!("`{part}` is no unit"), format!("there are {}", UnitScale::names())))?;
    match UnitScale::read(own) {
        Ok(own_scale) if !own_scale.dimension.is(scale.dimension) => Err((
            format!("`{unit}` does not measure what the scene has in {own}"),
            "mend the unit, or name the column after what was measured".into(),
        )),
        _ => Ok(()),
    }
}

fn columns(data: &Data, outputs: &[Output], request: &FitRequest) -> Result<Vec<FittedColumn>, FitError> {
    if let Some((name, _)) = request.sigmas.iter().find(|(name, _)| outputs.iter().all(|o| o.name != *name)) {
        let names: Vec<&str> = outputs.iter().map(|output| output.name.as_str()).collect();
        let text = format!("no column {name} is fitted to\nhint: there are: {}", names.join(", "));
        return Err(FitError::Asked(text));
    }
    let column = |output: &Output| {
        let place = data.columns.iter().position(|(name, _)| *name == output.name);
        let measured = place.map(|place| data.columns[place].1.clone()).unwrap_or_default();
        let unit = place.and_then(|place| UnitScale::read(data.units.get(place)?.as_deref()?).ok());
        let given = request.sigmas.iter().find(|(name, _)| *name == output.name).map(|(_, sigma)| *sigma);
        let given = given.map(|sigma| unit.map_or(sigma, |unit| unit.of_number(sigma)));
        let sigma = given.unwrap_or_default();
        let (name, unit, model) = (output.name.clone(), String::new(), Vec::new());
        FittedColumn { name, unit, sigma, is_given: given.is_some(), model, measured }
    };
    Ok(outputs.iter().map(column).collect())
}
