//! Singular positions that the range leads through, and what columns come to at them.
//!
//! Forces and accelerations there are limits along the motion, as those of runs are: of polynomials fitted to
//! either side of the place, see [`OutputNear`].

use super::{DriveWalk, SolvedPosition, outputs_at};
use crate::dynamics::Motion;
use crate::dynamics::kernel::Bias;
use crate::dynamics::output::Moment;
use crate::dynamics::schur::{NEAR, SINGULAR};
use crate::run::extremes::{OutputNear, SMALL, SideLimit, USELESS, rounding_of, weighted};
use crate::run::kinematics::Limit;
use crate::run::kinematics::extremes::SolvedRange;
use crate::run::kinematics::independence::determinant;
use crate::run::rounding::changes;
use crate::stepping::search::{golden_sections, value};

/// How far on either side the fastest coordinate goes whose positions are looked at \[rad, units of length\].
const REACH: f64 = 0.1;
/// Share of the way to the next singular position that is looked at, at most.
const APART: f64 = 0.8;
/// Positions on either side, and how many of them are in an octave of the distance.
const PLACES: i32 = 64;
const IN_OCTAVE: f64 = 8.0;
/// Golden sections for the place of the least one.
const SECTIONS: usize = 48;

/// A singular position on the way.
pub(in crate::run::kinematics) struct SingularPosition {
    /// The drive's value there.
    drive: f64,
    /// How far it is looked at \[rad or m of the drive\].
    reach: f64,
    /// Nearer than this, over the reach, columns are too inaccurate to be of use.
    inaccurate: f64,
    /// What each column comes to below and above; nothing of those that the state tells.
    limits: Vec<Option<[SideLimit; 2]>>,
}

/// A position of a window beside a singular one: distance over the reach, share, and columns.
type Sample = (f64, f64, Vec<f64>);

impl SingularPosition {
    /// A column at a value of the drive where the state tells `plain`: by a polynomial where there is one,
    /// NaN where it is too inaccurate.
    pub fn value(&self, column: usize, drive: f64, plain: f64) -> f64 {
        let at = (drive - self.drive) / self.reach;
        let Some(Some(limits)) = self.limits.get(column) else { return plain };
        match &limits[usize::from(at > 0.0)] {
            SideLimit::Curve(curve, share) if at.abs() <= *share => value(curve, at)[0],
            SideLimit::Unbounded(..) if at.abs() < self.inaccurate => f64::NAN,
            _ => plain,
        }
    }

    /// Where a column is without bound, and in which senses: infinite numbers, and the drive's value.
    pub fn unbounded(&self, column: usize) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.limits.get(column).into_iter().flatten().flatten().filter_map(|limit| match limit {
            SideLimit::Unbounded(curve, _) => Some([f64::INFINITY.copysign(curve[0]), self.drive]),
            _ => None,
        })
    }

    /// True where no polynomial tells what a column comes to.
    pub fn is_unknown(&self, column: usize) -> bool {
        let mut sides = self.limits.get(column).into_iter().flatten().flatten();
        sides.any(|limit| matches!(limit, SideLimit::Unknown))
    }

    /// True of a position at which the state does not tell forces and accelerations.
    pub fn hides(&self, at: &SolvedPosition) -> bool {
        at.share < SINGULAR && (at.position.drive - self.drive).abs() <= self.reach
    }
}

impl DriveWalk {
    /// Singular positions at which det G does not change its sign, but for limits and the positions known.
    pub fn more_singular(&mut self, range: &SolvedRange, known: &[SolvedPosition]) -> Vec<SolvedPosition> {
        let all = &range.positions;
        let mut found = Vec::new();
        for (k, at) in all.iter().enumerate() {
            let is_limit =
                k == 0 && range.limits[0].is_some() || k + 1 == all.len() && range.limits[1].is_some();
            let [from, to] = [&all[k.saturating_sub(1)], &all[(k + 1).min(all.len() - 1)]];
            let is_least = at.share < NEAR && at.share <= from.share && at.share <= to.share;
            let is_within = |one: &SolvedPosition| {
                (from.position.drive..=to.position.drive).contains(&one.position.drive)
            };
            let is_known = known.iter().chain(&found).any(is_within);
            if is_limit || !is_least || is_known || from.share.max(to.share) < USELESS {
                continue;
            }
            let least = self.most_dependent(at, [from, to]);
            self.restore(&least);
            if least.share < SINGULAR && !self.is_beside_limit && !self.is_as_fast_as_beside_limit() {
                found.push(least);
            }
        }
        found
    }

    /// The position between two at which rows are least independent, with a third between them: by D, or by
    /// the share where that is not watched.
    fn most_dependent(&mut self, at: &SolvedPosition, [from, to]: [&SolvedPosition; 2]) -> SolvedPosition {
        let measure = |walk: &Self| determinant(&walk.mechanism, &walk.kernel).map_or(walk.share(), f64::abs);
        self.restore(at);
        let (mut least, mut smallest) = (at.clone(), measure(self));
        let look = |t: f64| {
            self.restore(from);
            self.go(t)?;
            let here = measure(self);
            if here < smallest {
                (least, smallest) = (self.solved(), here);
            }
            Ok::<_, Limit>(here)
        };
        // Where there is no way to a place between them, what was found stands.
        let _ = golden_sections(look, [from.state.time.hi, to.state.time.hi], SECTIONS);
        least
    }

    /// The share of the weakest constraint.
    pub(super) fn share(&self) -> f64 {
        self.mechanism.standing_share(&self.kernel)
    }

    /// What columns come to at a singular position, looked at between these values of the drive at most.
    pub fn beside_singular(
        &mut self,
        all: &[SolvedPosition],
        at: &SolvedPosition,
        ends: [f64; 2],
    ) -> SingularPosition {
        let drive = at.position.drive;
        self.restore(at);
        let most = REACH * self.law[1].abs() / self.fastest_of_jacobian();
        let lengths = ends.map(|end| (end - drive).abs().min(most));
        let reach = lengths[0].max(lengths[1]);
        let (mut samples, mut rounding): ([Vec<Sample>; 2], _) = (Default::default(), Vec::new());
        for (side, samples) in samples.iter_mut().enumerate() {
            let way = if side == 0 { -lengths[0] } else { lengths[1] };
            let is_outside = |one: &&SolvedPosition| (one.position.drive - drive) * way >= way * way;
            let from = if side == 0 { all.iter().rfind(is_outside) } else { all.iter().find(is_outside) };
            let Some(from) = from.filter(|_| way != 0.0) else { continue };
            self.restore(from);
            rounding = self.rounding();
            for k in 0..PLACES {
                let away = way * (-f64::from(k) / IN_OCTAVE).exp2();
                if self.go((drive + away - self.law[0]) / self.law[1]).is_err() || self.share() < USELESS {
                    break;
                }
                let position = self.position();
                let columns = (0..rounding.len()).map(|column| position.column(column)).collect();
                samples.push((away / reach, self.share(), columns));
            }
        }
        let is_inaccurate = |(_, share, _): &&Sample| *share < SMALL;
        let inaccurate = samples.iter().flatten().filter(is_inaccurate).map(|sample| sample.0.abs());
        let inaccurate = inaccurate.fold(0.0, f64::max);
        let follows = self.mechanism.outputs.iter().flat_map(|outputs| outputs.follows_equations());
        let limits = std::iter::once(&true).chain(follows).zip(&rounding).enumerate();
        let limits: Vec<_> = limits
            .map(|(column, (follows, &rounding))| {
                let of = |(at, _, values): &Sample| [*at, values[column]];
                let point = |sample: &Sample| weighted(of(sample), sample.1);
                let known = |sample: &&Sample| sample.2[column].is_finite();
                let points = || samples.iter().flatten().filter(known).map(point).collect();
                // The last one is the nearest.
                let nearest = || samples.each_ref().map(|side| side.iter().rfind(known).map(of));
                let ends = [-lengths[0] / reach, lengths[1] / reach];
                let output = || {
                    let (points, nearest) = (points(), nearest());
                    OutputNear { centre: drive, reach, ends, rounding, points, nearest }
                };
                follows.then(|| output().both_sides())
            })
            .collect();
        SingularPosition { drive, reach, inaccurate, limits }
    }

    /// Magnitudes of the drive's force and of the outputs that are rounding.
    fn rounding(&mut self) -> Vec<f64> {
        let mut motion = Motion::default();
        motion.follow(&self.state, self.alpha.len());
        let (mechanism, kernel, row) = (&*self.mechanism, &mut self.beside, self.row);
        let values = |motion: &Motion| {
            let ([phi, omega], time) = (motion.rounded(), motion.time);
            kernel.accelerations(mechanism, time, &phi, &omega, Bias::default());
            mechanism.share_multipliers(time, kernel, &phi, &omega);
            let winding: Vec<f64> = (0..phi.len()).map(|k| motion.unwrapped(k)).collect();
            let moment = Moment { mechanism, time, phi: &phi, winding: &winding, omega: &omega, kernel };
            [vec![-kernel.multiplier[row]], outputs_at(&moment)].concat()
        };
        rounding_of(&changes(mechanism, &motion, values))
    }
}

/// The values of the drive up to which each of some singular positions, in order, may be looked at.
pub(in crate::run::kinematics) fn between(
    all: &[SolvedPosition],
    singular: &[SolvedPosition],
) -> Vec<[f64; 2]> {
    let drive = |one: &SolvedPosition| one.position.drive;
    let part = |k: usize, end: Option<&SolvedPosition>, next: Option<&SolvedPosition>| {
        let here = drive(&singular[k]);
        let end = end.map_or(here, drive);
        next.map_or(end, |next| here + APART * (drive(next) - here))
    };
    let ends = |k: usize| {
        let before = k.checked_sub(1).map(|before| &singular[before]);
        [part(k, all.first(), before), part(k, all.last(), singular.get(k + 1))]
    };
    (0..singular.len()).map(ends).collect()
}
