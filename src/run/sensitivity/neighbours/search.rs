//! The search for the distances at which mechanisms of neighbouring values tell what a number does.

use super::{FINER, LEVELS, residuals};
use crate::dynamics::contact::metric::ContactMetric;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::saltation::DistanceLevel;
use crate::scene::{Template, Variable};
use std::sync::Arc;

/// Changes tried, over the number, or where that is zero in its unit.
const LADDER: [f64; 8] = [0.25, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
/// Where the search begins, and the estimated relative error that ends it.
const FIRST: usize = 1;
pub(super) const ENOUGH: f64 = 1e-11;
/// The estimated relative error that is too large for a derivative.
const TOO_MUCH: f64 = 1e-4;
/// That of a derivative which is zero as far as rounding shows.
const DOUBTFUL: f64 = 1e-6;
/// What differences may be apart over their size, and no more be extrapolated from: a corner is between them.
const SMOOTH: f64 = 1e-5;
/// What a change of the number by its own size does, over the values, below which it does nothing.
const NOTHING: f64 = 1e-11;
/// Rounding of an evaluation, over its value.
pub(super) const ROUNDING: f64 = 4e-16;
/// Groups of values of the start: coordinates and rates.
const STARTS: usize = 2;
/// States that are looked at, as shares of the horizon and changes of the start \[rad, m\].
const STATES: [(f64, f64); 3] = [(0.0, 0.0), (0.5, 0.4), (1.0, -0.7)];
/// Offsets and weights: on both sides, and on one.
pub(super) const BOTH: [[f64; 2]; 4] =
    [[-2.0, 1.0 / 12.0], [-1.0, -2.0 / 3.0], [1.0, 2.0 / 3.0], [2.0, -1.0 / 12.0]];
const ONE: [[f64; 2]; 5] = [[0.0, -25.0 / 12.0], [1.0, 4.0], [2.0, -3.0], [3.0, 4.0 / 3.0], [4.0, -0.25]];

/// A scene at one value.
pub(super) struct Candidate {
    pub mechanism: Arc<Mechanism>,
    pub start: Motion,
}

/// All candidates of one change, with their weights, and what they make of F.
pub(super) struct Attempt {
    pub change: f64,
    /// Size of the number.
    pub scale: f64,
    pub list: Vec<(f64, Candidate)>,
    slopes: Vec<Vec<f64>>,
    sizes: Vec<f64>,
}

/// Keeps the better one, by its error and its number.
fn keep(best: &mut Option<(f64, usize)>, error: f64, index: usize) {
    if best.is_none_or(|(least, _)| error < least) {
        *best = Some((error, index));
    }
}

impl Attempt {
    /// The largest slope over the size of what is derived.
    fn steepest(&self) -> f64 {
        self.slopes.iter().zip(&self.sizes).fold(0.0, |most: f64, (slopes, size)| {
            let size = size.max(f64::MIN_POSITIVE);
            slopes.iter().fold(most, |most, slope| most.max(slope.abs() / size))
        })
    }

    /// True where what there is may be rounding.
    fn is_rounding(&self) -> bool {
        self.steepest() * self.change <= ROUNDING
    }

    /// True where a change of the number by its scale does nothing: its derivative is zero.
    pub fn does_nothing(&self) -> bool {
        self.steepest() * self.scale < NOTHING
    }
}

/// Estimated relative error of the second of two attempts, with the smaller change.
fn error(larger: &Attempt, smaller: &Attempt) -> f64 {
    if smaller.does_nothing() {
        return 0.0;
    }
    if larger.is_rounding() && smaller.is_rounding() {
        // As far as can be seen the number does nothing here, where it may do something farther away.
        return DOUBTFUL;
    }
    let mut apart = 0.0_f64;
    for ((before, now), size) in larger.slopes.iter().zip(&smaller.slopes).zip(&smaller.sizes) {
        let off = before.iter().zip(now).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        apart = apart.max(off / size.max(f64::MIN_POSITIVE));
    }
    let is_smooth = apart <= SMOOTH * smaller.steepest();
    let share = if is_smooth { (smaller.change / larger.change).powi(4) } else { 1.0 };
    (share * apart + ROUNDING / smaller.change) / smaller.steepest()
}

/// What distances are looked for: for a number of a scene whose mechanism and start are these, for a run
/// up to `until` \[s\].
pub(super) struct DistanceSearch<'a> {
    pub template: &'a Template,
    pub number: (&'a Variable, f64),
    pub base: (&'a Arc<Mechanism>, &'a Motion),
    pub until: f64,
    /// Changes are in units of the number, not over it.
    pub in_units: bool,
}

impl DistanceSearch<'_> {
    /// The attempt with the least estimated relative error, and that.
    pub fn best(&self) -> Result<(Attempt, f64), String> {
        let (mut tried, mut best, mut why): (Vec<Attempt>, Option<(f64, usize)>, _) =
            (Vec::new(), None, String::new());
        for share in &LADDER[FIRST..] {
            match self.attempt(*share) {
                Ok(attempt) => tried.push(attempt),
                Err(reason) => why = reason,
            }
            if let [.., larger, smaller] = &tried[..] {
                keep(&mut best, error(larger, smaller), tried.len() - 1);
            }
            if best.is_some_and(|(error, _)| error < ENOUGH) {
                break;
            }
        }
        // A larger change is of use where rounding is what limits.
        if best.is_none_or(|(error, _)| error >= ENOUGH)
            && let (Ok(larger), Some(first)) = (self.attempt(LADDER[0]), tried.first())
        {
            keep(&mut best, error(&larger, first), 0);
        }
        match best.filter(|(error, _)| *error < TOO_MUCH) {
            Some((error, index)) => Ok((tried.swap_remove(index), error)),
            None if why.is_empty() => Err("the equations do not depend on it smoothly".into()),
            None => Err(why),
        }
    }

    /// What those at a change over the number tell.
    fn attempt(&self, share: f64) -> Result<Attempt, String> {
        let (list, scale) = (self.scenes(share)?, self.scale());
        let (slopes, sizes) = self.slopes(&list);
        Ok(Attempt { change: share * scale, scale, list, slopes, sizes })
    }

    /// Scenes at ever smaller changes than this one over the number, as far as there are such.
    pub fn levels(&self, share: f64) -> Vec<DistanceLevel<(f64, Candidate)>> {
        let shares = (1..LEVELS).map(|level| share * FINER.powi(level));
        let level = |share: f64| Some(DistanceLevel { far: 1.0 / share, list: self.scenes(share).ok()? });
        shares.map_while(level).collect()
    }

    /// Scenes at a change over the number, on both sides of it or on one.
    fn scenes(&self, share: f64) -> Result<Vec<(f64, Candidate)>, String> {
        let change = share * self.scale();
        self.list(change, &BOTH).or_else(|_| self.list(change, &ONE)).or_else(|_| self.list(-change, &ONE))
    }

    /// Size of the number.
    fn scale(&self) -> f64 {
        if self.in_units { 1.0 } else { self.number.1.abs() }
    }

    fn list(&self, change: f64, offsets: &[[f64; 2]]) -> Result<Vec<(f64, Candidate)>, String> {
        offsets.iter().map(|[k, weight]| Ok((weight / change, self.candidate(k * change)?))).collect()
    }

    fn candidate(&self, change: f64) -> Result<Candidate, String> {
        let (variable, value) = self.number;
        let (base, start) = self.base;
        if change == 0.0 {
            return Ok(Candidate { mechanism: Arc::clone(base), start: start.clone() });
        }
        let first_line = |text: String| text.lines().next().unwrap_or_default().to_owned();
        let scene = self
            .template
            .filled(std::slice::from_ref(variable), &[value + change])
            .map_err(|error| first_line(error.to_string()))?;
        let mechanism =
            Mechanism::of_sound(&scene, Vec::new()).map_err(|error| first_line(error.to_string()))?;
        let shape = |mechanism: &Mechanism| {
            (mechanism.coordinates(), mechanism.constraints.len(), mechanism.contacts.len())
        };
        if shape(&mechanism) != shape(base) {
            return Err("neighbouring values give a mechanism of another kind".into());
        }
        let start = mechanism.start(&scene);
        // On the branches of the scene itself: its formulas may have a corner at the start.
        let own = mechanism.laws.as_ref().map(|laws| laws.parameters.clone());
        let mechanism = match (own, &base.laws) {
            (Some(own), Some(laws)) => {
                mechanism.on_branch(own, laws.modes.clone()).map_err(|error| error.to_string())?
            }
            _ => mechanism,
        };
        Ok(Candidate { mechanism: Arc::new(mechanism), start })
    }

    /// Derivatives of the start and of all that acts at some states, group by group, and the sizes of what is
    /// derived.
    fn slopes(&self, list: &[(f64, Candidate)]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let (mut slopes, mut sizes): (Vec<Vec<f64>>, Vec<f64>) = (Vec::new(), Vec::new());
        for (weight, candidate) in list {
            for (group, values) in self.values(candidate).into_iter().enumerate() {
                if slopes.len() == group {
                    slopes.push(vec![0.0; values.len()]);
                    sizes.push(self.least_size(group));
                }
                for (slope, value) in slopes[group].iter_mut().zip(&values) {
                    *slope += weight * value;
                    sizes[group] = sizes[group].max(value.abs());
                }
            }
        }
        (slopes, sizes)
    }

    /// The size that values of a group have at least: a start at rest, a constraint that is met and an
    /// acceleration that constraints leave are differences of numbers that are not small, and rounded as
    /// those.
    fn least_size(&self, group: usize) -> f64 {
        let units = self.base.0.units;
        let (place, rate) = (units.length.min(1.0), 1.0 / units.time);
        match group.checked_sub(STARTS) {
            None => [1.0, rate][group],
            Some(rest) => match rest % self.groups() {
                0 => self.unconstrained(rest / self.groups()),
                // The integrand of an integral has a size of its own.
                group => [place, place * rate, place].get(group - 1).copied().unwrap_or_default(),
            },
        }
    }

    /// Groups of values of a state.
    fn groups(&self) -> usize {
        4 + self.base.0.integrals
    }

    /// The largest acceleration \[rad/s², m/s²\] that forces alone would cause at a state; zero where they
    /// act alone.
    fn unconstrained(&self, state: usize) -> f64 {
        let mechanism = self.base.0;
        if mechanism.constraints.is_empty() {
            return 0.0;
        }
        let (t, phi, omega) = self.state(state);
        let metric = ContactMetric::at(mechanism, t, &phi, &omega);
        let accelerations = metric.map(|metric| metric.rates(&metric.unconstrained()));
        let accelerations = accelerations.unwrap_or_default();
        let own = accelerations.iter().enumerate().filter(|(k, _)| !mechanism.is_integral(*k));
        own.fold(0.0, |most, (_, a)| most.max(a.abs()))
    }

    /// The states everything is derived at: that of the start, and two that are like no other.
    fn state(&self, number: usize) -> (Time, Vec<f64>, Vec<f64>) {
        let (n, (share, turn)) = (self.base.0.coordinates(), STATES[number]);
        let phi = (0..n).map(|k| self.base.1.phi[k].hi + turn * unlike(k));
        let omega = (0..n).map(|k| self.base.1.omega[k].hi + 3.0 * turn * unlike(k));
        (Time::from(share * self.until), phi.collect(), omega.collect())
    }

    /// The start in [`STARTS`] groups; then for each state accelerations, constraints, their rates and gaps,
    /// and what each integral integrates.
    fn values(&self, candidate: &Candidate) -> Vec<Vec<f64>> {
        let n = self.base.0.coordinates();
        let Candidate { mechanism, start } = candidate;
        let mut groups = vec![
            (0..n).map(|k| start.unwrapped(k)).collect::<Vec<f64>>(),
            start.omega.iter().map(|omega| omega.hi).collect(),
        ];
        let mut kernel = Kernel::<f64>::new(mechanism);
        for (t, phi, omega) in (0..STATES.len()).map(|number| self.state(number)) {
            kernel.accelerations(mechanism, t, &phi, &omega, Bias::default());
            let loads = kernel.load.iter().copied().enumerate();
            let (integrands, own): (Vec<_>, Vec<_>) = loads.partition(|(k, _)| mechanism.is_integral(*k));
            groups.push(own.into_iter().map(|(_, acceleration)| acceleration).collect());
            let (positions, rates) = residuals(mechanism, t, &phi, &omega);
            groups.extend([positions, rates]);
            let z = mechanism.elements(&phi);
            groups.push(mechanism.contacts.iter().map(|contact| contact.row.gap(&z)).collect());
            groups.extend(integrands.into_iter().map(|(_, integrand)| vec![integrand]));
        }
        groups
    }
}

/// Numbers of no particular kind.
fn unlike(k: usize) -> f64 {
    libm::sin(1.0 + 2.3 * k as f64)
}
