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

mod search;

use self::search::{Attempt, BOTH, Candidate, DistanceSearch, ENOUGH, ROUNDING};
use super::super::contact::in_modes;
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::saltation::{Difference, DistanceLevel, Levels, agreeing};
use crate::scene::{Template, Variable};
use std::sync::Arc;

/// The change of a parameter that an event sets, over its value.
const SET: f64 = 1e-3;
/// Distances at which there are neighbours, each by this factor shorter than the one before.
const LEVELS: i32 = 4;
const FINER: f64 = 1.0 / 32.0;
/// Size of a column, in changes of the number by its own size, below which its digits do not count.
const SMALL: f64 = 1e-5;
/// Numbers below are tried in changes of their unit, too, where changes over themselves say little.
const NEAR_ZERO: f64 = 1e-3;
/// Numbers below are zero but for rounding: what they do over themselves says nothing.
const ROUNDED: f64 = 1e-12;

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
            _ => kernel.accelerations(mechanism, t, phi, omega, Bias::default()),
        }
        &self.kernel.load
    }
}

/// The mechanisms for one number.
#[derive(Clone, Debug, Default)]
pub(in crate::run) struct Neighbours {
    /// At distances that become finer; empty where the number does nothing but move the start.  Those of
    /// parameters that events set are the last.
    pub levels: Vec<DistanceLevel<Neighbour>>,
    /// Derivative of the start: all coordinates, then all rates.
    pub start: Vec<f64>,
    /// Estimated relative error of derivatives.
    pub error: f64,
    /// Size of a column \[rad/s, m/s\] below which steps need not resolve it to its own accuracy: what moves
    /// it is known to a share of 1e-11 of what changes of the number by its own size do.
    pub floor: f64,
    /// What rounding leaves of derivatives since somebody last set it to zero, at most.
    pub noise: f64,
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
        let search = |in_units: bool| DistanceSearch { template, number, base, until, in_units }.best();
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
        let search = DistanceSearch { template, number, base, until, in_units };
        let levels = search.levels(attempt.change / attempt.scale);
        Ok(Self::of(attempt, levels, error, base.0))
    }

    fn of(
        attempt: Attempt,
        finer: Vec<DistanceLevel<(f64, Candidate)>>,
        error: f64,
        base: &Mechanism,
    ) -> Self {
        let (n, scale) = (base.coordinates(), attempt.scale);
        let does_nothing = attempt.does_nothing();
        let coarsest = DistanceLevel { far: scale / attempt.change, list: attempt.list };
        let all: Vec<_> = std::iter::once(coarsest).chain(finer).collect();
        let of = |(weight, Candidate { start, .. }): &(f64, Candidate)| {
            let coordinates = (0..n).map(|k| start.unwrapped(k));
            (*weight, coordinates.chain(start.omega.iter().map(|omega| omega.hi)).collect())
        };
        let start = agreeing(all.len(), |level| {
            let DistanceLevel { far, list } = &all[level];
            Some(Difference::of(list.iter().map(of), &[], *far))
        });
        let mut start = start.map_or_else(|| vec![0.0; 2 * n], |agreed| agreed.slopes);
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
        let level = |DistanceLevel { far, list }| DistanceLevel {
            far,
            list: list.into_iter().map(neighbour).collect(),
        };
        let levels = levels.map(level).collect();
        let unit = base.units.length.min(1.0) / base.units.time;
        Self { levels, start, error, floor: SMALL * unit / scale, noise: 0.0 }
    }

    /// Takes neighbours for parameters, by number, that events have set in `mechanism` with these derivatives
    /// instead of those there are, beside the mechanism as compiled.
    pub fn set(&mut self, compiled: &Arc<Mechanism>, mechanism: &Mechanism, given: &[(usize, f64)]) {
        let parameters = mechanism.laws.as_ref().map_or(&[][..], |laws| &laws.parameters);
        if self.levels.is_empty() && !given.is_empty() {
            self.levels.resize(LEVELS as usize, DistanceLevel { far: 0.0, list: Vec::new() });
        }
        for (finer, DistanceLevel { far, list }) in (0..).zip(&mut self.levels) {
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
        let level = |DistanceLevel { far, list }: &DistanceLevel<Neighbour>| DistanceLevel {
            far: *far,
            list: list.iter().map(of).collect(),
        };
        self.levels.iter().map(level).collect()
    }

    /// The derivative of what a function tells of each neighbour; `None` where there are none.
    pub fn derivative(&mut self, mut value: impl FnMut(&mut Neighbour) -> Vec<f64>) -> Option<Vec<f64>> {
        let Self { levels, error, noise, .. } = self;
        let mut of = |neighbour: &mut Neighbour| (neighbour.weight, value(neighbour));
        let agreed = agreeing(levels.len(), |level| {
            let DistanceLevel { far, list } = levels.get_mut(level)?;
            Some(Difference::of(list.iter_mut().map(&mut of), &[], *far))
        })?;
        if agreed.finest > 0 {
            *error = error.max(ROUNDING * levels[agreed.finest].far);
        }
        *noise = noise.max(agreed.noise);
        Some(agreed.slopes)
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

/// True where two mechanisms are the same but for how they start.
fn is_alike(one: &Mechanism, other: &Mechanism) -> bool {
    let plain = |mechanism: &Mechanism, from: &Mechanism| Mechanism {
        assembly: from.assembly.clone(),
        energy_scale: from.energy_scale,
        slowest_rod: from.slowest_rod.clone(),
        ..mechanism.clone()
    };
    plain(one, other) == *other
}

/// C and C' of all constraints at a state.
pub(super) fn residuals(mechanism: &Mechanism, t: Time, phi: &[f64], omega: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let z = mechanism.elements(phi);
    let mut gradient = vec![0.0; phi.len()];
    let residual = |row: &crate::dynamics::constraint::ConstraintEquation| {
        gradient.fill(0.0);
        let here = row.linearise(t, ConstraintArguments { phi, z: &z, omega }, &mut gradient);
        (here.position, dot(&gradient, omega) + here.drive)
    };
    mechanism.constraints.iter().map(residual).unzip()
}
