//! The integrator: Gragg's modified midpoint rule, extrapolated to step zero.
//!
//! ```text
//! y_1 = y_0 + h f_0,   y_{i+1} = y_{i-1} + 2 h f_i,   T_{j,1} = y_{n_j},  n_j = 2, 4, 6, …
//! T_{j,k+1} = T_{j,k} + (T_{j,k} - T_{j-1,k}) / ((n_j / n_{j-k})² - 1)
//! ```
//!
//! The numbers are rational, so that any precision can be had.  After every step the state goes back onto its
//! constraints. Source: E. Hairer, S. P. Nørsett, G. Wanner, *Solving Ordinary Differential Equations I*
//! (1993), section II.9.

use super::double_double::Dd;
use super::model::{Model, State};
use super::start::project;

/// Error a step may make, over the scales of positions.
const TOLERANCE: f64 = 1e-18;
/// Rows of the tableau.
const MOST_ROWS: usize = 13;

/// Why there is no motion to compare with.
#[derive(Clone, Debug, PartialEq)]
pub struct Lost(pub String);

/// Integrates a model with some walls' points held; counts its work.
pub struct Integrator<'a> {
    pub model: &'a Model,
    pub evaluations: u64,
    pub most_evaluations: u64,
    /// The step that would suit next \[s\].
    pub step: f64,
    /// Least pivot met: near zero, a singular position.
    pub least_pivot: f64,
}

impl<'a> Integrator<'a> {
    pub fn new(model: &'a Model, most_evaluations: u64) -> Self {
        Self { model, evaluations: 0, most_evaluations, step: model.scene.until / 16.0, least_pivot: 1.0 }
    }

    /// Rates of positions, of rates, and of work, in one vector.
    fn rate(&mut self, t: Dd, y: &[Dd], held: &[usize]) -> Result<Vec<Dd>, Lost> {
        self.evaluations += 1;
        if self.evaluations > self.most_evaluations {
            return Err(Lost("too many evaluations".into()));
        }
        let state = unpacked(t, y);
        let found = self.model.accelerations(&state, held);
        self.least_pivot = self.least_pivot.min(found.solution.least_pivot);
        if found.solution.is_loose {
            return Err(Lost("a coordinate without mass is held by nothing".into()));
        }
        Ok(state.v.into_iter().chain(found.solution.x).chain([found.power]).collect())
    }

    /// The midpoint rule with n substeps.
    fn midpoint(
        &mut self,
        t: Dd,
        y: &[Dd],
        f: &[Dd],
        step: Dd,
        n: usize,
        held: &[usize],
    ) -> Result<Vec<Dd>, Lost> {
        let h = step / Dd::from(n as f64);
        let mut before = y.to_vec();
        let mut now: Vec<Dd> = y.iter().zip(f).map(|(&y, &f)| y + h * f).collect();
        for i in 1..n {
            let rate = self.rate(t + h.scale(i as f64), &now, held)?;
            let next = before.iter().zip(&rate).map(|(&y, &f)| y + h.scale(2.0) * f).collect();
            before = std::mem::replace(&mut now, next);
        }
        Ok(now)
    }

    /// One step: the state after it and the number of rows it took; `None` where it does not converge.
    fn attempt(
        &mut self,
        state: &State,
        f: &[Dd],
        step: Dd,
        held: &[usize],
    ) -> Result<Option<(State, usize)>, Lost> {
        let y = packed(state);
        let mut table: Vec<Vec<Dd>> = Vec::new();
        for j in 0..MOST_ROWS {
            let n = 2 * (j + 1);
            let mut line = vec![self.midpoint(state.t, &y, f, step, n, held)?];
            for k in 0..j {
                let ratio = n as f64 / (2 * (j - k)) as f64;
                let divisor = Dd::ONE
                    / (Dd::from(n as f64 * n as f64) / Dd::from((4 * (j - k) * (j - k)) as f64) - Dd::ONE);
                debug_assert!(ratio > 1.0);
                let next = line[k]
                    .iter()
                    .zip(&table[k])
                    .map(|(&fine, &coarse)| fine + (fine - coarse) * divisor)
                    .collect();
                line.push(next);
            }
            if j >= 3 {
                let (best, second) = (&line[j], &line[j - 1]);
                if self.error(best, second, step) < TOLERANCE {
                    return Ok(Some((unpacked(state.t + step, best), j + 1)));
                }
            }
            table = line;
        }
        Ok(None)
    }

    /// The largest difference over its scale: lengths over the size, rates by what they come to within the
    /// step.
    fn error(&self, one: &[Dd], other: &[Dd], step: Dd) -> f64 {
        let n = self.model.mass.len();
        let size = self.model.scene.size;
        let energy = (0..n).map(|i| self.model.mass[i].hi * one[n + i].hi * one[n + i].hi).sum::<f64>()
            + one[2 * n].hi.abs();
        let one_error = |i: usize| {
            let unit = if i % 3 == 2 { 1.0 } else { size };
            let difference = (one[i] - other[i]).hi.abs();
            match i {
                i if i < n => difference / unit,
                i if i < 2 * n => difference * step.hi.abs() / (if (i - n) % 3 == 2 { 1.0 } else { size }),
                _ => difference / (energy + f64::MIN_POSITIVE),
            }
        };
        (0..=2 * n)
            .map(one_error)
            .fold(0.0, |most, one| if one.is_nan() { f64::INFINITY } else { one.max(most) })
    }

    /// One step of at most `most` \[s\].
    pub fn step(&mut self, state: &State, most: Dd, held: &[usize]) -> Result<State, Lost> {
        let f = self.rate(state.t, &packed(state), held)?;
        let mut h = if self.step < most.hi { Dd::from(self.step) } else { most };
        loop {
            match self.attempt(state, &f, h, held)? {
                Some((mut next, rows)) => {
                    let is_whole = h.hi >= self.step;
                    self.step = match rows {
                        ..=7 => self.step.max(h.hi * 1.6),
                        8..=9 if is_whole => h.hi * 1.1,
                        8..=10 => self.step,
                        _ => h.hi * 0.8,
                    };
                    project(self.model, &mut next, held)?;
                    return Ok(next);
                }
                None => {
                    self.step = 0.4 * h.hi;
                    h = Dd::from(self.step);
                    if self.step < 1e-12 * self.model.scene.until {
                        return Err(Lost(format!("no step is short enough at t = {}", state.t.hi)));
                    }
                }
            }
        }
    }

    /// To a time, with the same points held.
    pub fn reach(&mut self, state: &State, until: Dd, held: &[usize]) -> Result<State, Lost> {
        let mut state = state.clone();
        while (until - state.t).hi > 0.0 {
            state = self.step(&state, until - state.t, held)?;
            if (until - state.t).hi.abs() < 1e-28 * until.hi.abs() {
                state.t = until;
            }
        }
        Ok(state)
    }
}

fn packed(state: &State) -> Vec<Dd> {
    state.q.iter().chain(&state.v).chain([&state.work]).copied().collect()
}

fn unpacked(t: Dd, y: &[Dd]) -> State {
    let n = y.len() / 2;
    State { t, q: y[..n].to_vec(), v: y[n..2 * n].to_vec(), work: y[2 * n] }
}
