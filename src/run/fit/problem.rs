//! The least-squares problem: residuals of all parts and the steps between them, with their Jacobian.
//!
//! ```text
//! x = (p / scale, ξ_1 … ξ_m)       ξ_k  local coordinates of the state where part k begins, not the first
//! r = ((Y - y) / σ,  w (x_k(t_k+1) - s_k+1))
//! ```

use super::super::modes::Local;
use super::super::sensitivity::{SensitivityRequest, Study};
use super::FittedColumn;
use super::data::Data;
use super::segment::{Frame, Lost, Place, SegmentOutcome, pass};
use crate::arithmetic::shown::about;
use crate::dynamics::Time;
use crate::run::driver::Pause;
use crate::scene::{Template, Variable};
use nalgebra::{DMatrix, DVector};
use std::cell::RefCell;
use std::ops::Range;

/// Turns of the search for the state of a part.
const TURNS: usize = 40;
/// Weight of a state as guessed, where a part does not tell it.
const GUESSED: f64 = 1e-3;

/// Steps that a run of the search may take, over those of the guess, and at least: where it takes more, the
/// search is on its way to where nothing is told, as to a stiffness of 1e12 N/m.
const MANY: u64 = 50;
const FEW: u64 = 2_000;

/// What to do where the search runs away.
pub(super) const HINT: &str =
    "hint: begin nearer to the data by --set, vary fewer numbers, or take data that tell more";

/// A part of the data: its rows, when it begins and ends, and the state it begins with (none for the first,
/// which begins as the scene does).
struct DataSegment {
    rows: Range<usize>,
    span: [f64; 2],
    state: Option<Place>,
    /// Directions that the constraints leave, orthonormal in the coordinates' units, one a column.
    tangent: DMatrix<f64>,
}

/// Residuals and their Jacobian at some unknowns, with the column each residual is of (none of a step between
/// parts), the outputs row by row and the largest step.
#[derive(Clone)]
pub(super) struct Evaluated {
    pub residuals: DVector<f64>,
    pub jacobian: DMatrix<f64>,
    pub owners: Vec<Option<usize>>,
    pub model: Vec<Vec<f64>>,
    pub gap: f64,
}

pub(super) struct FitProblem<'a> {
    template: &'a Template,
    pub(super) variables: Vec<Variable>,
    pub(super) scale: Vec<f64>,
    times: &'a [f64],
    request: SensitivityRequest,
    /// Which outputs the columns are.
    outputs: Vec<usize>,
    parts: Vec<DataSegment>,
    unit: Vec<f64>,
    pause: RefCell<&'a mut dyn FnMut() -> bool>,
    runs: u64,
    /// Steps that a run may take; no bound before the first, whose steps tell it.
    most: u64,
    /// True where one since the last trial took more than four fifths of them.
    pub(super) is_long: bool,
    /// The numbers as guessed, over their scale.
    guess: Vec<f64>,
    pub(super) measured: Vec<Vec<Option<f64>>>,
    pub(super) sigma: Vec<f64>,
    pub(super) weight: f64,
    pub(super) x: DVector<f64>,
    /// True where the search was refused a step, and where a run at it would take too many steps.
    pub(super) was_refused: bool,
    pub(super) was_too_long: bool,
    /// Trials that took nearly as many, or too many.
    pub(super) long_trials: usize,
    /// Residual in place of one that cannot be computed.
    pub(super) far: f64,
    /// Numbers that are held at a bound, with the sign of the direction beyond it.
    pub(super) held: Vec<Option<f64>>,
    pub(super) found: Result<Evaluated, Lost>,
}

impl<'a> FitProblem<'a> {
    pub fn new(
        template: &'a Template,
        (variables, guess): (Vec<Variable>, Vec<f64>),
        (data, outputs, segments): (&'a Data, Vec<usize>, usize),
        request: SensitivityRequest,
        pause: &'a mut Pause,
    ) -> Self {
        let scale: Vec<f64> =
            guess.iter().map(|value| if *value == 0.0 { 1.0 } else { value.abs() }).collect();
        let rows = data.times.len();
        let first = |segment: usize| segment * rows / segments;
        let begin = |segment: usize| if segment == 0 { 0.0 } else { data.times[first(segment)] };
        let parts = (0..segments).map(|k| DataSegment {
            rows: first(k)..first(k + 1),
            span: [begin(k), if k + 1 < segments { begin(k + 1) } else { data.times[rows - 1] }],
            state: None,
            tangent: DMatrix::zeros(0, 0),
        });
        let x: Vec<f64> = guess.iter().zip(&scale).map(|(value, scale)| value / scale).collect();
        Self {
            x: DVector::from_column_slice(&x),
            guess: x,
            most: u64::MAX,
            is_long: false,
            was_refused: false,
            was_too_long: false,
            long_trials: 0,
            far: f64::INFINITY,
            held: vec![None; guess.len()],
            parts: parts.collect(),
            measured: Vec::new(),
            sigma: Vec::new(),
            unit: Vec::new(),
            times: &data.times,
            pause: RefCell::new(pause),
            runs: 0,
            weight: 1.0,
            found: Err("not evaluated yet".into()),
            template,
            variables,
            scale,
            request,
            outputs,
        }
    }

    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// The numbers as they stand.
    pub fn values(&self) -> Vec<f64> {
        self.scale.iter().zip(self.x.iter()).map(|(scale, x)| scale * x).collect()
    }

    /// Which of them are at a bound.
    pub fn held(&self) -> Vec<bool> {
        self.held.iter().map(Option::is_some).collect()
    }

    pub fn has_segments(&self) -> bool {
        self.parts.len() > 1
    }

    pub fn runs(&self) -> u64 {
        self.runs
    }

    pub fn gap(&self) -> f64 {
        self.found.as_ref().map_or(f64::NAN, |found| found.gap)
    }

    /// The scene with the numbers as they stand.
    pub(super) fn study(&self) -> Result<Study, Lost> {
        let template = self.template.with_values(&self.variables, &self.values());
        Study::new(&template, &self.request).map_err(|error| Lost::from(error.to_string()))
    }

    /// Takes what is measured and how exactly.
    pub(super) fn take(&mut self, columns: &[FittedColumn]) {
        self.measured = columns.iter().map(|column| column.measured.clone()).collect();
        self.sigma = columns.iter().map(|column| column.sigma).collect();
    }

    /// States at the beginnings of all parts but the first: each from the end of the part before it, then
    /// fitted to its own rows.
    pub fn guess_states(&mut self, columns: &[FittedColumn]) -> Result<(), Lost> {
        self.take(columns);
        if self.parts.len() == 1 {
            return Ok(());
        }
        let study = self.study()?;
        let mut local = Local::new(&study.mechanism);
        self.unit = local.unit.clone();
        let mut at = self.pass(&study, 0, None)?.end;
        for k in 1..self.parts.len() {
            local.time = Time::from(self.parts[k].span[0]);
            at = local
                .projected_moving(&at)
                .ok_or("the state between two parts does not fit the constraints")?;
            for _ in 0..TURNS {
                let tangent = local.tangent(&at[0]);
                (self.parts[k].state, self.parts[k].tangent) = (Some(at.clone()), tangent);
                let Some((step, better)) = self.state_step(&study, &mut local, k) else { break };
                at = better;
                if step.amax() < 1e-9 {
                    break;
                }
            }
            let state = self.parts[k].state.clone();
            at = self.pass(&study, k, state.as_ref())?.end;
        }
        let freedom: usize = self.parts[1..].iter().map(|part| 2 * part.tangent.ncols()).sum();
        let count = self.variables.len();
        self.x = DVector::from_fn(count + freedom, |k, _| if k < count { self.x[k] } else { 0.0 });
        Ok(())
    }

    /// A step of Gauss and Newton for the state of a part, from its own rows and what was guessed, shortened
    /// until it helps, and the state it leads to; none where it does not help.
    fn state_step(&mut self, study: &Study, local: &mut Local, k: usize) -> Option<(DVector<f64>, Place)> {
        let state = self.parts[k].state.clone()?;
        let passed = self.pass(study, k, Some(&state)).ok()?;
        let (count, f) = (self.variables.len(), self.parts[k].tangent.ncols());
        let (residuals, slopes) = self.rows(k, &passed);
        let jacobian = slopes.columns(count, 2 * f).into_owned();
        let squares = jacobian.transpose() * &jacobian;
        let prior =
            DMatrix::identity(2 * f, 2 * f) * (GUESSED * GUESSED * squares.diagonal().amax().max(1e-300));
        let step = (squares + prior).cholesky()?.solve(&-(jacobian.transpose() * &residuals));
        let mut share = 1.0;
        for _ in 0..8 {
            let tried = &step * share;
            if let Some(moved) = self.state(local, k, tried.as_slice())
                && let Ok(passed) = self.pass(study, k, Some(&moved))
                && self.rows(k, &passed).0.norm() < residuals.norm()
            {
                return Some((tried, moved));
            }
            share *= 0.25;
        }
        None
    }

    /// The state of a part with these local coordinates about its base; `None` where none of them is on the
    /// constraints.
    fn state(&self, local: &mut Local, k: usize, x: &[f64]) -> Option<Place> {
        let DataSegment { state: Some(base), tangent, span, .. } = &self.parts[k] else { return None };
        local.time = Time::from(span[0]);
        let [y, v] = [0, 1].map(|half| {
            let f = tangent.ncols();
            DVector::from_column_slice(&x[half * f..(half + 1) * f])
        });
        local.beside(base, tangent, [&y, &v])
    }

    /// A part of the motion, from a state or as the scene starts.
    fn pass(&mut self, study: &Study, k: usize, state: Option<&Place>) -> Result<SegmentOutcome, Lost> {
        self.runs += 1;
        let part = &self.parts[k];
        let frame = Frame { tangent: &part.tangent, unit: &self.unit };
        let from = state.map(|state| (part.span[0], state, frame));
        let times = &self.times[part.rows.clone()];
        let mut pause = self.pause.borrow_mut();
        let is_one_of_several = self.parts.len() > 1;
        let passed = pass(study, from, (times, part.span[1]), (is_one_of_several, self.most), &mut **pause);
        self.is_long |= match &passed {
            Ok(passed) => passed.effort > self.most / 5 * 4,
            Err(why) => matches!(why, Lost::TooLong(_)),
        };
        let passed = passed?;
        if self.most == u64::MAX {
            self.most = passed.effort.saturating_mul(MANY).max(FEW);
        }
        Ok(passed)
    }

    /// Where the search is with a number, and where it began, once it is elsewhere.
    pub(super) fn ran_to(&self, k: usize) -> Option<String> {
        let (path, scale) = (&self.variables[k].path, self.scale[k]);
        let [at, from] = [self.x[k], self.guess[k]].map(|x| about(scale * x));
        (self.x[k] != self.guess[k]).then(|| format!("the search ran from {path} = {from} to {at}"))
    }

    /// Why the search cannot go on to runs that take too many steps, with the number that is farthest from
    /// its guess.
    pub(super) fn too_long(&self) -> String {
        let away = |k: &usize| (self.x[*k] - self.guess[*k]).abs();
        let farthest = (0..self.guess.len()).max_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or_default();
        let beyond = format!("a run takes more than {} steps", self.most);
        match self.ran_to(farthest) {
            Some(ran) => format!("{ran}, beyond which {beyond}\n{HINT}"),
            None => format!(
                "beside the guess, {} = {}, {beyond}",
                self.variables[farthest].path,
                about(self.scale[farthest] * self.x[farthest])
            ),
        }
    }

    /// Residuals of the rows of a part, with their slopes by the numbers and by its state.
    fn rows(&self, k: usize, passed: &SegmentOutcome) -> (DVector<f64>, DMatrix<f64>) {
        let (mut residuals, mut slopes) = (Vec::new(), Vec::new());
        let width = passed.columns.len();
        for (row, derived) in self.parts[k].rows.clone().zip(&passed.rows) {
            for ((measured, &output), sigma) in self.measured.iter().zip(&self.outputs).zip(&self.sigma) {
                let Some(measured) = measured[row] else { continue };
                residuals.push((derived.values[output] - measured) / sigma);
                slopes.extend(derived.slopes[output].iter().map(|slope| slope / sigma));
            }
        }
        let rows = residuals.len();
        (DVector::from_vec(residuals), DMatrix::from_row_slice(rows, width, &slopes))
    }

    /// The columns that the residuals of a part are of.
    fn owners(&self, k: usize) -> impl Iterator<Item = Option<usize>> {
        let is_there = |row: usize| move |(_, column): &(usize, &Vec<Option<f64>>)| column[row].is_some();
        let of = move |row| self.measured.iter().enumerate().filter(is_there(row)).map(|(k, _)| Some(k));
        self.parts[k].rows.clone().flat_map(of)
    }

    /// Everything at the present unknowns.
    pub(super) fn evaluate(&mut self) -> Result<Evaluated, Lost> {
        let study = self.study()?;
        let count = self.variables.len();
        let mut local = Local::new(&study.mechanism);
        let (mut residuals, mut lines): (Vec<f64>, Vec<DVector<f64>>) = (Vec::new(), Vec::new());
        let (mut model, mut gap, mut owners) = (Vec::new(), 0.0_f64, Vec::new());
        let mut before: Option<(SegmentOutcome, usize)> = None;
        let mut first = count;
        for k in 0..self.parts.len() {
            let f = if k == 0 { 0 } else { self.parts[k].tangent.ncols() };
            let state = match k {
                0 => None,
                _ => {
                    let state = self.state(&mut local, k, self.x.rows(first, 2 * f).as_slice());
                    Some(state.ok_or("a state does not fit the constraints")?)
                }
            };
            if let (Some(state), Some((passed, at))) = (&state, &before) {
                gap = self.tie(k, (passed, *at), (state, first), (&mut residuals, &mut lines)).max(gap);
                owners.resize(residuals.len(), None);
            }
            let passed = self.pass(&study, k, state.as_ref())?;
            let (own, slopes) = self.rows(k, &passed);
            for (i, residual) in own.iter().enumerate() {
                residuals.push(*residual);
                lines.push(self.line(&slopes.row(i).iter().copied().collect::<Vec<f64>>(), first));
            }
            owners.extend(self.owners(k));
            let outputs = &self.outputs;
            model.extend(passed.rows.iter().map(|row| outputs.iter().map(|&o| row.values[o]).collect()));
            before = Some((passed, first));
            first += 2 * f;
        }
        let mut jacobian = DMatrix::from_fn(lines.len(), self.x.len(), |i, j| lines[i][j]);
        self.leave_out_rounding(&mut jacobian, &owners);
        let residuals = DVector::from_vec(residuals);
        match residuals.iter().chain(jacobian.iter()).all(|x| x.is_finite()) {
            true => Ok(Evaluated { residuals, jacobian, owners, model, gap }),
            false => Err("residuals are not finite".into()),
        }
    }

    /// A line of the Jacobian from slopes by the numbers and by the state whose unknowns begin at `first`.
    fn line(&self, slopes: &[f64], first: usize) -> DVector<f64> {
        let count = self.variables.len();
        let mut line = DVector::zeros(self.x.len());
        for (j, slope) in slopes.iter().enumerate() {
            match j < count {
                true => line[j] = slope * self.scale[j],
                false => line[first + j - count] = *slope,
            }
        }
        line
    }

    /// The step from the end of the part before to the state of part `k`, in local coordinates; the largest
    /// is returned.
    fn tie(
        &self,
        k: usize,
        (passed, at): (&SegmentOutcome, usize),
        (state, first): (&Place, usize),
        (residuals, lines): (&mut Vec<f64>, &mut Vec<DVector<f64>>),
    ) -> f64 {
        let tangent = &self.parts[k].tangent;
        let (n, f) = (tangent.nrows(), tangent.ncols());
        let mut gap = 0.0_f64;
        for j in 0..2 * f {
            let (half, column) = if j < f { (0, j) } else { (1, j - f) };
            let along = |x: &dyn Fn(usize) -> f64| {
                (0..n).map(|i| tangent[(i, column)] * x(i) / self.unit[i]).sum::<f64>()
            };
            let step = along(&|i| passed.end[half][i] - state[half][i]);
            let slopes: Vec<f64> =
                passed.columns.iter().map(|one| self.weight * along(&|i| one[half * n + i])).collect();
            let mut line = self.line(&slopes, at);
            line[first + j] -= self.weight;
            gap = gap.max(step.abs());
            residuals.push(self.weight * step);
            lines.push(line);
        }
        gap
    }

    /// Takes the states as they are for new bases.
    pub(super) fn rebase(&mut self) -> Result<(), Lost> {
        let study = self.study()?;
        let mut local = Local::new(&study.mechanism);
        let mut first = self.variables.len();
        for k in 1..self.parts.len() {
            let f = self.parts[k].tangent.ncols();
            let state = self.state(&mut local, k, self.x.rows(first, 2 * f).as_slice());
            let state = state.ok_or("a state does not fit the constraints")?;
            let tangent = local.tangent(&state[0]);
            if tangent.ncols() != f {
                return Err("a part begins at a singular position".into());
            }
            (self.parts[k].state, self.parts[k].tangent) = (Some(state), tangent);
            self.x.rows_mut(first, 2 * f).fill(0.0);
            first += 2 * f;
        }
        self.found = self.evaluate();
        self.found.as_ref().map(|_| ()).map_err(Clone::clone)
    }

    /// Writes the fitted motion to the columns.
    pub fn take_model(&self, columns: &mut [FittedColumn]) -> Result<(), Lost> {
        let found = self.found.as_ref().map_err(Clone::clone)?;
        for (k, column) in columns.iter_mut().enumerate() {
            column.model = found.model.iter().map(|row| row[k]).collect();
        }
        let study = self.study()?;
        let heads: Vec<(&str, &str)> =
            study.mechanism.outputs.iter().flat_map(|outputs| outputs.heads()).collect();
        for (column, &output) in columns.iter_mut().zip(&self.outputs) {
            column.unit = heads.get(output).map(|(_, unit)| (*unit).to_owned()).unwrap_or_default();
        }
        Ok(())
    }
}
