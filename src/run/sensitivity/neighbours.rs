//! What a number of the scene does to the equations: mechanisms at neighbouring values of it.
//!
//! ```text
//! dF/dp = Σ_k c_k F(p + k e) / e
//!     k = -2, -1, 1, 2: c = 1/12, -2/3, 2/3, -1/12;  or on one side k = 0…4: c = -25/12, 4, -3, 4/3, -1/4
//! ```
//!
//! F stands for accelerations, constraints, gaps, impacts, outputs and the start, all at one and the same
//! state.  Where they are smooth functions of p the formula is right to 11 digits and more with an e that is
//! found by trying: from one e to the next smaller one the error of truncation goes with e⁴, that of rounding
//! with 1/e.  They may have corners nearby, as |N| of dry friction and impacts between sliding and sticking
//! have; there e becomes smaller until two differences agree.  What a difference of *runs* suffers from,
//! growth of rounding and of e itself with time, is not in it.

use super::super::contact::in_modes;
use crate::dynamics::constraint::Posture;
use crate::dynamics::contact::metric::Metric;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::saltation::{Difference, Level, Levels, agreeing};
use crate::scene::{Template, Variable};
use std::sync::Arc;

/// Changes tried, over the number, or where that is zero in its unit.
const LADDER: [f64; 8] = [0.25, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
/// Where the search begins, and the estimated relative error that ends it.
const FIRST: usize = 1;
const ENOUGH: f64 = 1e-11;
/// The estimated relative error that is too large for a derivative.
const TOO_MUCH: f64 = 1e-4;
/// That of a derivative which is zero as far as rounding shows.
const DOUBTFUL: f64 = 1e-6;
/// The change of a parameter that an event sets, over its value.
const SET: f64 = 1e-3;
/// Distances at which there are neighbours, each by this factor shorter than the one before.
const LEVELS: i32 = 4;
const FINER: f64 = 1.0 / 32.0;
/// What differences may be apart over their size, and no more be extrapolated from: a corner is between them.
const SMOOTH: f64 = 1e-5;
/// What a change of the number by its own size does, over the values, below which it does nothing.
const NOTHING: f64 = 1e-11;
/// Size of a column, in changes of the number by its own size, below which its digits do not count.
const SMALL: f64 = 1e-5;
/// Rounding of an evaluation, over its value.
const ROUNDING: f64 = 4e-16;
/// Numbers below are tried in changes of their unit, too, where changes over themselves say little.
const NEAR_ZERO: f64 = 1e-3;
/// Numbers below are zero but for rounding: what they do over themselves says nothing.
const ROUNDED: f64 = 1e-12;
/// Groups of values of the start: coordinates and rates.
const STARTS: usize = 2;
/// States that are looked at, as shares of the horizon and changes of the start \[rad, m\].
const STATES: [(f64, f64); 3] = [(0.0, 0.0), (0.5, 0.4), (1.0, -0.7)];
/// Offsets and weights: on both sides, and on one.
const BOTH: [[f64; 2]; 4] = [[-2.0, 1.0 / 12.0], [-1.0, -2.0 / 3.0], [1.0, 2.0 / 3.0], [2.0, -1.0 / 12.0]];
const ONE: [[f64; 2]; 5] = [[0.0, -25.0 / 12.0], [1.0, 4.0], [2.0, -3.0], [3.0, 4.0 / 3.0], [4.0, -0.25]];

/// A mechanism at a neighbouring value, with its weight in derivatives.
#[derive(Clone, Debug)]
pub(in crate::run) struct Neighbour {
    pub weight: f64,
    /// As compiled, and with the contacts held and on the branches of the moment.
    compiled: Arc<Mechanism>,
    /// The parameter that an event has set otherwise, and by how much.
    set: Option<(usize, f64)>,
    pub mechanism: Arc<Mechanism>,
    pub kernel: Kernel<f64>,
}

impl Neighbour {
    /// Its accelerations at a state, by the code for this number of bodies where there is one.
    pub fn accelerations(&mut self, t: Time, phi: &[f64], omega: &[f64]) -> &[f64] {
        let Self { mechanism, kernel, .. } = self;
        match mechanism.size() {
            1 => kernel.accelerate::<1>(mechanism, t, phi, omega, Bias::default()),
            2 => kernel.accelerate::<2>(mechanism, t, phi, omega, Bias::default()),
            _ => kernel.accelerate::<0>(mechanism, t, phi, omega, Bias::default()),
        }
        &self.kernel.load
    }
}

/// The mechanisms for one number.
#[derive(Clone, Debug, Default)]
pub(in crate::run) struct Neighbours {
    /// At distances that become finer; empty where the number does nothing but move the start.  Those of
    /// parameters that events set are the last.
    pub levels: Vec<Level<Neighbour>>,
    /// Derivative of the start: all coordinates, then all rates.
    pub start: Vec<f64>,
    /// Estimated relative error of derivatives.
    pub error: f64,
    /// Size of a column \[rad/s, m/s\] below which steps need not resolve it to its own accuracy: what moves
    /// it is known to a share of 1e-11 of what changes of the number by its own size do.
    pub floor: f64,
}

/// A scene at one value.
struct Candidate {
    mechanism: Arc<Mechanism>,
    start: Motion,
}

/// All candidates of one change, with their weights, and what they make of F.
struct Attempt {
    change: f64,
    /// Size of the number.
    scale: f64,
    list: Vec<(f64, Candidate)>,
    slopes: Vec<Vec<f64>>,
    sizes: Vec<f64>,
}

impl Neighbours {
    /// Those of a number of a scene whose mechanism and start are these, for a run up to `until` \[s\].
    ///
    /// # Errors
    /// Why the motion has no derivative by it.
    pub fn new(
        template: &Template,
        number: (&Variable, f64),
        base: (&Arc<Mechanism>, &Motion),
        until: f64,
    ) -> Result<Self, String> {
        let search = |in_units: bool| Search { template, number, base, until, in_units }.best();
        let own = search(number.1 == 0.0);
        // A number near zero: what it does shows in changes of its unit, not in changes over itself.
        let most = match &own {
            Ok((attempt, _)) if attempt.does_nothing() => 1.0,
            Ok((_, error)) if *error < ENOUGH => 0.0,
            _ => NEAR_ZERO,
        };
        let is_rounding = number.1.abs() < ROUNDED;
        let is_near_zero = number.1 != 0.0 && number.1.abs() < most;
        let (attempt, error) = match is_near_zero.then(|| search(true)) {
            Some(Ok(other)) if is_rounding || !other.0.does_nothing() => match own {
                Ok(own) if !own.0.does_nothing() && own.1 <= other.1 => own,
                _ => other,
            },
            Some(Err(why)) if own.as_ref().map_or(true, |own| is_rounding && own.0.does_nothing()) => {
                return Err(why);
            }
            _ => own?,
        };
        let in_units = attempt.scale != number.1.abs();
        let search = Search { template, number, base, until, in_units };
        let levels = search.levels(attempt.change / attempt.scale);
        Ok(Self::of(attempt, levels, error, base.0))
    }

    fn of(attempt: Attempt, finer: Vec<Level<(f64, Candidate)>>, error: f64, base: &Mechanism) -> Self {
        let (n, scale) = (base.coordinates(), attempt.scale);
        let does_nothing = attempt.does_nothing();
        let coarsest = Level { far: scale / attempt.change, list: attempt.list };
        let all: Vec<_> = std::iter::once(coarsest).chain(finer).collect();
        let of = |(weight, Candidate { start, .. }): &(f64, Candidate)| {
            let coordinates = (0..n).map(|k| start.unwrapped(k));
            (*weight, coordinates.chain(start.omega.iter().map(|omega| omega.hi)).collect())
        };
        let start = agreeing(all.len(), |level| {
            let Level { far, list } = &all[level];
            Some(Difference::of(list.iter().map(of), &[], *far))
        });
        let mut start = start.map_or_else(|| vec![0.0; 2 * n], |(start, _)| start);
        if scale >= NEAR_ZERO && does_nothing {
            // What there is is rounding, which would grow with time.
            start.fill(0.0);
        }
        let is_alike = all[0].list.iter().all(|(_, candidate)| is_alike(&candidate.mechanism, base));
        let neighbour = |(weight, candidate): (f64, Candidate)| Neighbour {
            weight,
            set: None,
            kernel: Kernel::new(&candidate.mechanism),
            compiled: Arc::clone(&candidate.mechanism),
            mechanism: candidate.mechanism,
        };
        let levels = all.into_iter().filter(|_| !is_alike);
        let level = |Level { far, list }| Level { far, list: list.into_iter().map(neighbour).collect() };
        let levels = levels.map(level).collect();
        let unit = base.units.length.min(1.0) / base.units.time;
        Self { levels, start, error, floor: SMALL * unit / scale }
    }

    /// Takes neighbours for parameters, by number, that events have set in `mechanism` with these derivatives
    /// instead of those there are, beside the mechanism as compiled.
    pub fn set(&mut self, compiled: &Arc<Mechanism>, mechanism: &Mechanism, given: &[(usize, f64)]) {
        let parameters = mechanism.laws.as_ref().map_or(&[][..], |laws| &laws.parameters);
        if self.levels.is_empty() && !given.is_empty() {
            self.levels.resize(LEVELS as usize, Level { far: 0.0, list: Vec::new() });
        }
        for (finer, Level { far, list }) in (0..).zip(&mut self.levels) {
            list.retain(|neighbour| neighbour.set.is_none());
            let share = SET * FINER.powi(finer);
            for &(number, slope) in given {
                let value = parameters[number].abs();
                let change = share * if value == 0.0 { 1.0 } else { value };
                *far = far.max(1.0 / share);
                list.extend(BOTH.iter().map(|[offset, weight]| Neighbour {
                    weight: weight * slope / change,
                    set: Some((number, offset * change)),
                    kernel: Kernel::new(compiled),
                    compiled: Arc::clone(compiled),
                    mechanism: Arc::clone(compiled),
                }));
            }
        }
        self.levels.retain(|level| !level.list.is_empty());
    }

    /// The mechanisms with their weights.
    pub fn weighted(&self) -> Levels {
        let of = |neighbour: &Neighbour| (neighbour.weight, Arc::clone(&neighbour.mechanism));
        let level =
            |Level { far, list }: &Level<Neighbour>| Level { far: *far, list: list.iter().map(of).collect() };
        self.levels.iter().map(level).collect()
    }

    /// The derivative of what a function tells of each neighbour; `None` where there are none.
    pub fn derivative(&mut self, mut value: impl FnMut(&mut Neighbour) -> Vec<f64>) -> Option<Vec<f64>> {
        let Self { levels, error, .. } = self;
        let mut of = |neighbour: &mut Neighbour| (neighbour.weight, value(neighbour));
        let (slopes, finest) = agreeing(levels.len(), |level| {
            let Level { far, list } = levels.get_mut(level)?;
            Some(Difference::of(list.iter_mut().map(&mut of), &[], *far))
        })?;
        if finest > 0 {
            *error = error.max(ROUNDING * levels[finest].far);
        }
        Some(slopes)
    }

    /// Goes on with the parts that act, the contacts held and the branches of a mechanism, and with the
    /// values of the parameters, by number, that events have set.
    ///
    /// # Errors
    /// A neighbour cannot go on so.
    pub fn follow(&mut self, mechanism: &Mechanism, off: &[String], known: &[usize]) -> Result<(), String> {
        for neighbour in self.levels.iter_mut().flat_map(|level| &mut level.list) {
            let whole = neighbour.compiled.with_all_parts();
            let mut acting = Mechanism::clone(whole);
            if let (Some(own), Some(laws)) = (&whole.laws, &mechanism.laws) {
                let mut parameters = own.parameters.clone();
                known.iter().for_each(|&number| parameters[number] = laws.parameters[number]);
                if let Some((number, by)) = neighbour.set {
                    parameters.clone_from(&laws.parameters);
                    parameters[number] += by;
                }
                acting =
                    whole.on_branch(parameters, laws.modes.clone()).map_err(|error| error.to_string())?;
            }
            let acting = if off.is_empty() { acting } else { acting.without(off)? };
            neighbour.mechanism = in_modes(&Arc::new(acting), &mechanism.held, &mechanism.modes);
            neighbour.kernel = Kernel::new(&neighbour.mechanism);
        }
        Ok(())
    }
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
    fn does_nothing(&self) -> bool {
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

/// True where two mechanisms are the same but for how they start.
fn is_alike(one: &Mechanism, other: &Mechanism) -> bool {
    let plain = |mechanism: &Mechanism, from: &Mechanism| Mechanism {
        assembly: from.assembly.clone(),
        energy_scale: from.energy_scale,
        rigid_rate: from.rigid_rate,
        ..mechanism.clone()
    };
    plain(one, other) == *other
}

struct Search<'a> {
    template: &'a Template,
    number: (&'a Variable, f64),
    base: (&'a Arc<Mechanism>, &'a Motion),
    until: f64,
    /// Changes are in units of the number, not over it.
    in_units: bool,
}

impl Search<'_> {
    /// The attempt with the least estimated relative error, and that.
    fn best(&self) -> Result<(Attempt, f64), String> {
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
    fn levels(&self, share: f64) -> Vec<Level<(f64, Candidate)>> {
        let shares = (1..LEVELS).map(|level| share * FINER.powi(level));
        let level = |share: f64| Some(Level { far: 1.0 / share, list: self.scenes(share).ok()? });
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
        let mechanism = Mechanism::new(&scene).map_err(|error| first_line(error.to_string()))?;
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
            Some(rest) if rest % 4 == 0 => self.unconstrained(rest / 4),
            Some(rest) => [place, place * rate, place][rest % 4 - 1],
        }
    }

    /// The largest acceleration \[rad/s², m/s²\] that forces alone would cause at a state; zero where they
    /// act alone.
    fn unconstrained(&self, state: usize) -> f64 {
        let mechanism = self.base.0;
        if mechanism.constraints.is_empty() {
            return 0.0;
        }
        let (t, phi, omega) = self.state(state);
        let metric = Metric::at(mechanism, t, &phi, &omega);
        let accelerations = metric.map(|metric| metric.rates(&metric.unconstrained()));
        accelerations.unwrap_or_default().iter().fold(0.0, |most, a| most.max(a.abs()))
    }

    /// The states everything is derived at: that of the start, and two that are like no other.
    fn state(&self, number: usize) -> (Time, Vec<f64>, Vec<f64>) {
        let (n, (share, turn)) = (self.base.0.coordinates(), STATES[number]);
        let phi = (0..n).map(|k| self.base.1.phi[k].hi + turn * unlike(k));
        let omega = (0..n).map(|k| self.base.1.omega[k].hi + 3.0 * turn * unlike(k));
        (Time::from(share * self.until), phi.collect(), omega.collect())
    }

    /// The start in [`STARTS`] groups; then for each state accelerations, constraints, their rates and gaps.
    fn values(&self, candidate: &Candidate) -> Vec<Vec<f64>> {
        let n = self.base.0.coordinates();
        let Candidate { mechanism, start } = candidate;
        let mut groups = vec![
            (0..n).map(|k| start.unwrapped(k)).collect::<Vec<f64>>(),
            start.omega.iter().map(|omega| omega.hi).collect(),
        ];
        let mut kernel = Kernel::<f64>::new(mechanism);
        for (t, phi, omega) in (0..STATES.len()).map(|number| self.state(number)) {
            kernel.accelerate::<0>(mechanism, t, &phi, &omega, Bias::default());
            groups.push(kernel.load.clone());
            let (positions, rates) = residuals(mechanism, t, &phi, &omega);
            groups.extend([positions, rates]);
            let z = mechanism.elements(&phi);
            groups.push(mechanism.contacts.iter().map(|contact| contact.row.gap(&z)).collect());
        }
        groups
    }
}

/// Numbers of no particular kind.
fn unlike(k: usize) -> f64 {
    libm::sin(1.0 + 2.3 * k as f64)
}

/// C and C' of all constraints at a state.
pub(super) fn residuals(mechanism: &Mechanism, t: Time, phi: &[f64], omega: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let z = mechanism.elements(phi);
    let mut gradient = vec![0.0; phi.len()];
    let residual = |row: &crate::dynamics::constraint::ConstraintEquation| {
        gradient.fill(0.0);
        let here = row.linearise(t, Posture { phi, z: &z, omega }, &mut gradient);
        (here.position, dot(&gradient, omega) + here.drive)
    };
    mechanism.constraints.iter().map(residual).unzip()
}
