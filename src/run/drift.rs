//! Drift as two numbers: the largest excursion, and the slope of the per-interval maximum.  A bound alone
//! hides a climb.
//!
//! Memory does not grow with the run: the horizon is divided into a fixed number of intervals, and the record
//! for charts is kept at times that grow by a constant factor.

use super::allowance::{Allowance, AllowanceMoment, EnergyLimit};
use super::plan::Plan;
use super::sample::Sample;
use crate::arithmetic::shown::{about, estimate};
use crate::arithmetic::sum::larger;
use crate::dynamics::Mechanism;

/// Intervals the horizon is divided into.
const INTERVALS: usize = 64;
/// Growth of the times at which the running maximum is recorded: forty a decade.
const GROWTH: f64 = 1.059_253_725_177_289;

/// The excursions of one quantity that ought to stay zero.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Excursion {
    /// Largest magnitude so far; not a number once the quantity was not.
    pub max: f64,
    /// Largest magnitude in each interval; negative where none was seen.
    intervals: Vec<f64>,
    until: f64,
    /// Times \[s\] and running maxima, at growing distances.
    pub record: Vec<[f64; 2]>,
    next_record: f64,
    /// Sums for the signed trend: count, t, t², x, x t, x² with t in units of the horizon.
    sums: [f64; 6],
}

impl Excursion {
    /// A monitor over a horizon \[s\].
    pub fn new(until: f64) -> Self {
        Self {
            max: 0.0,
            intervals: vec![-1.0; INTERVALS],
            until,
            record: Vec::new(),
            next_record: 0.0,
            sums: [0.0; 6],
        }
    }

    /// Takes the quantity at time `t` \[s\].
    pub fn see(&mut self, t: f64, value: f64) {
        let size = value.abs();
        self.max = larger(size, self.max);
        let share = t / self.until;
        let slot = ((share * INTERVALS as f64) as usize).min(INTERVALS - 1);
        self.intervals[slot] = self.intervals[slot].max(size);
        if t >= self.next_record {
            if t > 0.0 {
                self.record.push([t, self.max]);
            }
            self.next_record = if t > 0.0 { t * GROWTH } else { 0.0 };
        } else if let Some(last) = self.record.last_mut().filter(|_| share >= 1.0) {
            *last = [t, self.max];
        }
        for (sum, term) in
            self.sums.iter_mut().zip([1.0, share, share * share, value, value * share, value * value])
        {
            *sum += term;
        }
    }

    /// Goes on towards a later horizon \[s\]; what was seen of its intervals stays at its times.
    fn extend(&mut self, until: f64) {
        let ratio = self.until / until;
        let mut intervals = vec![-1.0; INTERVALS];
        for (i, &max) in self.intervals.iter().enumerate() {
            let slot = (((i as f64 + 0.5) * ratio) as usize).min(INTERVALS - 1);
            intervals[slot] = f64::max(intervals[slot], max);
        }
        let [_, t, tt, _, xt, _] = &mut self.sums;
        (*t, *tt, *xt) = (*t * ratio, *tt * (ratio * ratio), *xt * ratio);
        (self.intervals, self.until) = (intervals, until);
    }

    /// Least-squares slope of the per-interval maximum \[1/s times the quantity's unit\]; zero with fewer
    /// than three intervals.
    pub fn slope(&self) -> f64 {
        let seen: Vec<(f64, f64)> = self
            .intervals
            .iter()
            .enumerate()
            .filter(|(_, max)| **max >= 0.0)
            .map(|(i, &max)| ((i as f64 + 0.5) / INTERVALS as f64, max))
            .collect();
        if seen.len() < 3 {
            return 0.0;
        }
        let count = seen.len() as f64;
        let (t_mean, x_mean) =
            (seen.iter().map(|p| p.0).sum::<f64>() / count, seen.iter().map(|p| p.1).sum::<f64>() / count);
        let (above, below) = seen.iter().fold((0.0, 0.0), |(a, b), (t, x)| {
            (a + (t - t_mean) * (x - x_mean), b + (t - t_mean) * (t - t_mean))
        });
        above / below / self.until
    }

    /// Signed least-squares trend and its standard error \[1/s times the quantity's unit\], samples taken as
    /// independent.
    pub fn trend(&self) -> (f64, f64) {
        let [count, t, tt, x, xt, xx] = self.sums;
        let spread = tt - t * t / count;
        if count < 3.0 || spread <= 0.0 {
            return (0.0, 0.0);
        }
        let slope = (xt - t * x / count) / spread;
        let rest = (xx - x * x / count - slope * slope * spread).max(0.0) / (count - 2.0);
        (slope / self.until, (rest / spread).sqrt() / self.until)
    }
}

/// Where no limit on the energy is stated: the imbalance, over the largest energy or work there has been,
/// beyond which no run is a success; those at a tolerance have a tighter limit, see [`Drift::energy_limit`].
pub const ENERGY_MOST: f64 = 1e-2;
/// And beyond which every result says that it is in doubt.
pub const ENERGY_DOUBT: f64 = 1e-4;
/// Where no limit on the constraints is stated: the violation at position level, in rad or sizes of the
/// mechanism, beyond which a run is no success.
pub const POSITION_MOST: f64 = 1e-2;

/// Stated limits; a run that exceeds one stops.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Limits {
    /// On the energy imbalance over the energy scale; `None`: [`Drift::energy_limit`].
    pub energy: Option<f64>,
    /// On every constraint, at position \[rad or m\] and velocity level \[rad/s or m/s\]; `None`:
    /// [`POSITION_MOST`].
    pub constraint: Option<f64>,
}

impl Limits {
    /// Names the first limit that is exceeded: of what is called so the imbalance over the largest energy so
    /// far and over the energy scale, with the limit of the former where none is stated; of constraints by
    /// name what is left at both levels, and what that is measured in.
    pub(super) fn exceeded<'a>(
        &self,
        (kind, [share, excursion], most): (&str, [f64; 2], f64),
        constraints: impl Iterator<Item = (&'a str, [f64; 2], f64)>,
    ) -> Result<(), String> {
        let beyond = |value: f64, limit: f64| value.is_nan() || value > limit;
        let (off, limit) = self.energy.map_or((share, most), |limit| (excursion, limit));
        if beyond(off, limit) {
            let explained =
                if self.energy.is_none() && limit < ENERGY_MOST { " of errors at the tolerance" } else { "" };
            let limit = if explained.is_empty() { format!("{limit:e}") } else { estimate(limit) };
            return Err(format!(
                "{kind} is off by {} of the scale, the limit{explained} is {limit}",
                about(off)
            ));
        }
        for (name, left, unit) in constraints {
            let (most, levels) = self.constraint.map_or((POSITION_MOST * unit, 1), |limit| (limit, 2));
            for (left, level) in left.into_iter().zip(["position", "velocity"]).take(levels) {
                if beyond(left, most) {
                    return Err(format!(
                        "constraint {name} is violated by {} at {level} level, the limit is {most:e}",
                        about(left)
                    ));
                }
            }
        }
        Ok(())
    }
}

/// What the energy balance of a mechanism is called: `energy`, or `energy minus work` where motors, dampers
/// or impacts change it.
pub(crate) fn kind(mechanism: &Mechanism) -> &'static str {
    let works = mechanism.has_work_integral() || !mechanism.contacts.is_empty();
    if works { "energy minus work" } else { "energy" }
}

/// What violations of each constraint are measured in: 1 rad, or the size of the mechanism \[m\].
pub(super) fn units(mechanism: &Mechanism) -> Vec<f64> {
    let unit = |is_in_radians: bool| if is_in_radians { 1.0 } else { mechanism.size_of_parts() };
    mechanism.with_all_parts().constraints.iter().map(|row| unit(row.is_in_radians())).collect()
}

/// How near to a singular position a run came at its output times, and between them where forces or
/// accelerations are among its outputs.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Singular {
    /// The least singular value of the rows' Jacobian over the largest, angles in rad and lengths in sizes of
    /// the mechanism.
    pub smallest: f64,
    /// When \[s\].
    pub t: f64,
    /// The row that loses its hold there.
    pub constraint: String,
}

/// The drift of a run.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Drift {
    /// Energy, or energy minus work, over the energy scale.
    pub energy: Excursion,
    /// `energy`, or `energy minus work` where motors, dampers or impacts change it.
    #[serde(skip)]
    pub kind: &'static str,
    /// Each row by name, at position and velocity level.
    pub constraints: Vec<(String, [Excursion; 2])>,
    /// The nearest to a singular position it came, where it came near one.
    pub singular: Option<Singular>,
    /// Energy the stabilizer has put in by now \[J\].
    pub stabilizer: f64,
    /// Largest magnitude of that at any time \[J\].
    pub stabilizer_max: f64,
    /// Largest imbalance over the largest energy or work there had been by then.
    pub energy_share: f64,
    /// The largest energy or work by now \[J\], at least the energy scale.
    largest: f64,
    /// What its tolerance explains of the imbalance, and the limit that follows from it.
    allowance: Option<Allowance>,
    limit: EnergyLimit,
    /// What the imbalance is given in \[J\], and violations of each row are measured in: 1 rad, or the size
    /// of the mechanism \[m\].
    scale: f64,
    units: Vec<f64>,
}

impl Drift {
    /// Monitors of a mechanism over a horizon \[s\].
    pub fn new(mechanism: &Mechanism, until: f64) -> Self {
        let pair = || [Excursion::new(until), Excursion::new(until)];
        Self {
            energy: Excursion::new(until),
            kind: kind(mechanism),
            constraints: mechanism.constraints.iter().map(|row| (row.name().to_owned(), pair())).collect(),
            singular: None,
            stabilizer: 0.0,
            stabilizer_max: 0.0,
            energy_share: 0.0,
            largest: mechanism.energy_scale,
            allowance: None,
            limit: EnergyLimit::default(),
            scale: mechanism.energy_scale,
            units: units(mechanism),
        }
    }

    /// The same of a run by a plan, whose tolerance limits the energy's imbalance.
    pub fn of_plan(mechanism: &Mechanism, plan: &Plan) -> Self {
        Self { allowance: Allowance::new(mechanism, plan), ..Self::new(mechanism, plan.until) }
    }

    /// The imbalance, over the largest energy or work there has been, beyond which the run is no success
    /// where no limit is stated: what errors at the tolerance in every step so far explain, twenty times, and
    /// never more than [`ENERGY_MOST`].
    pub fn energy_limit(&self) -> f64 {
        self.limit.most
    }

    /// The imbalance over the energy scale beyond which loops and sliders that nothing projects count as
    /// torn.
    pub(super) fn apart(&self) -> f64 {
        self.limit.apart
    }

    /// Whether the energy balance leaves the result in doubt.
    pub fn is_doubtful(&self) -> bool {
        self.energy_share.is_nan() || self.energy_share > self.limit.doubt
    }

    /// Goes on towards a later horizon \[s\].
    pub(super) fn extend(&mut self, until: f64) {
        let levels = self.constraints.iter_mut().flat_map(|(_, levels)| levels);
        levels.chain([&mut self.energy]).for_each(|excursion| excursion.extend(until));
    }

    /// Whether it can be one of this mechanism.
    pub(super) fn fits(&self, mechanism: &Mechanism) -> bool {
        let rows = mechanism.constraints.iter().map(|row| row.name());
        let mut excursions = self.constraints.iter().flat_map(|(_, levels)| levels).chain([&self.energy]);
        self.constraints.iter().map(|(name, _)| name.as_str()).eq(rows)
            && self.units.len() == self.constraints.len()
            && excursions.all(|excursion| excursion.intervals.len() == INTERVALS && excursion.until > 0.0)
    }

    /// Takes the nearest to a singular position it came between output times.
    pub(super) fn take_passage(&mut self, passage: Option<Singular>) {
        let known = self.singular.as_ref().map_or(f64::INFINITY, |singular| singular.smallest);
        if let Some(passage) = passage.filter(|passage| passage.smallest < known) {
            self.singular = Some(passage);
        }
    }

    /// Takes a sample after so many steps; names the first limit it exceeds.
    pub fn see(&mut self, sample: &Sample, limits: &Limits, steps: u64) -> Result<(), String> {
        self.energy.see(sample.t, sample.imbalance);
        self.stabilizer = sample.stabilizer;
        self.stabilizer_max = larger(sample.stabilizer.abs(), self.stabilizer_max);
        self.largest = self.largest.max(sample.kinetic.abs()).max(sample.work.abs());
        self.energy_share = larger(sample.imbalance.abs() * (self.scale / self.largest), self.energy_share);
        if let Some(allowance) = &self.allowance {
            let translations = &sample.phi[sample.centre.len()..];
            self.limit.see(
                allowance,
                &AllowanceMoment {
                    omega: &sample.omega,
                    translations,
                    work: sample.work,
                    largest: self.largest,
                    steps,
                },
            );
        }
        for ((_, monitors), values) in self.constraints.iter_mut().zip(&sample.constraints) {
            for (monitor, &value) in monitors.iter_mut().zip(values) {
                monitor.see(sample.t, value);
            }
        }
        let known = self.singular.as_ref().map_or(f64::INFINITY, |singular| singular.smallest);
        if let Some(smallest) = sample.singular.filter(|&smallest| smallest < known) {
            let constraint =
                self.constraints.get(sample.weakest).map_or_else(String::new, |(name, _)| name.clone());
            self.singular = Some(Singular { smallest, t: sample.t, constraint });
        }
        let names = self.constraints.iter().zip(&self.units);
        let constraints =
            names.map(|((name, levels), &unit)| (&name[..], [levels[0].max, levels[1].max], unit));
        limits.exceeded((self.kind, [self.energy_share, self.energy.max], self.limit.most), constraints)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_climb_shows_in_the_slope_and_a_swing_does_not() {
        let (mut climb, mut swing) = (Excursion::new(100.0), Excursion::new(100.0));
        for i in 0..=10_000 {
            let t = f64::from(i) * 0.01;
            climb.see(t, 1e-3 * t);
            swing.see(t, (t * 37.0).sin());
        }
        assert!((climb.slope() - 1e-3).abs() < 2e-5, "{}", climb.slope());
        assert!((climb.trend().0 - 1e-3).abs() < 1e-9);
        assert!(swing.slope().abs() < 1e-5, "{}", swing.slope());
        assert!(swing.trend().0.abs() < 3.0 * swing.trend().1 + 1e-5);
        assert_eq!(climb.max, 0.1);
        assert!(climb.record.len() < 500 && climb.record.last() == Some(&[100.0, 0.1]));
    }

    #[test]
    fn what_is_not_a_number_is_never_within_a_limit() {
        let mut excursion = Excursion::new(1.0);
        excursion.see(0.5, f64::NAN);
        excursion.see(0.6, 0.0);
        assert!(excursion.max.is_nan());
    }
}
