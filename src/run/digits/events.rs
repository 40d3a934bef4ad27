//! Events of a scene in many digits: the zeros of their formulas, by Newton's iteration on the formulas' series.
//!
//! That there is a zero, and where about, is told in doubles ([`search`](crate::stepping::search)), as it is
//! for walls: two zeros within 1e-9 of a step are one, or none.  Steps are so short that the series of the
//! formulas converge in them, too.

use super::motion::{JUDGES, Motion};
use super::wall::{in_shares, refined};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::compile::exact::ExactMechanism;
use crate::dynamics::series::FormulaSeries;
use crate::scene::Direction;
use crate::stepping::search::{Curve, Powers, root};

/// Share of a step within which the event that began it does not happen again, and two zeros are one.
const SAME: f64 = 1e-9;
/// Share of the largest value within a step up to which a formula is at its zero.
const NO_VALUE: f64 = 1e-12;
/// Share of a step after which a formula that was at its zero has left it.
const LEAVES: f64 = 1e-3;
/// Times within a step at which its largest value is looked for.
const LOOKS: usize = 8;
/// Rounds in which a step is shortened, at most.
const ROUNDS: usize = 20;
/// Events kept.
const KEPT: usize = 100_000;

/// An event that has happened.
#[derive(Clone, Debug)]
pub struct Happened<const W: usize> {
    /// Its number.
    pub event: usize,
    /// Time \[s\].
    pub t: Digits<W>,
    /// Angles, then positions of origins \[rad, m\].
    pub phi: Vec<Digits<W>>,
    /// Their rates \[rad/s, m/s\].
    pub omega: Vec<Digits<W>>,
}

/// Watches the events of a motion.
#[derive(Clone, Debug, Default)]
pub struct Watch<const W: usize> {
    series: Vec<FormulaSeries<Digits<W>>>,
    /// The powers of their formulas in the step that is next.
    powers: Vec<Vec<Digits<W>>>,
    /// What is in that step: events with their times after its begin \[s\], and the sides of zero the
    /// formulas are on at its end.
    ahead: Vec<(usize, Digits<W>)>,
    ends: Vec<i8>,
    /// The sides they were on at the end of the last one: -1, 1, or 0 where that is not known.
    pub sides: Vec<i8>,
    /// What happened before.
    pub happened: Vec<Happened<W>>,
}

impl<const W: usize> Watch<W> {
    /// For the events of a mechanism.
    pub fn new(mechanism: &ExactMechanism<Digits<W>>, order: usize) -> Self {
        let events = &mechanism.events;
        Self {
            series: events.iter().map(|event| FormulaSeries::new(&event.function, order)).collect(),
            sides: vec![0; events.len()],
            ..Self::default()
        }
    }

    /// Expands the formulas where the motion is expanded.
    pub fn expand(&mut self, motion: &Motion<W>) {
        self.powers.clear();
        if self.series.is_empty() {
            return;
        }
        let posture = motion.state_posture();
        for (event, series) in motion.mechanism.events.iter().zip(&mut self.series) {
            let from = (motion.state().t, &posture.phi[..]);
            self.powers.push(motion.series.formula(&event.function, series, from).to_vec());
        }
    }

    /// The part of a step \[s\] within which the formulas converge as far as log2 of the tolerance says.
    pub fn allows(&self, wanted: f64, tolerance: f64) -> f64 {
        if wanted.is_nan() {
            return wanted;
        }
        let shortened = |mut step: f64, powers: &Vec<Digits<W>>| {
            let Some((terms, last)) = powers.len().checked_sub(JUDGES).map(|first| powers.split_at(first))
            else {
                return step;
            };
            // A shorter step has smaller terms.
            for _ in 0..ROUNDS {
                let weight = |(k, power): (usize, &Digits<W>)| power.log2() + k as f64 * libm::log2(step);
                let size = terms.iter().enumerate().map(weight).fold(f64::NEG_INFINITY, f64::max);
                let allowed = |(j, power): (usize, &Digits<W>)| {
                    libm::exp2((tolerance + size - power.log2()) / (terms.len() + j) as f64)
                };
                let least = last.iter().enumerate().map(allowed).filter(|step| !step.is_nan());
                let least = least.fold(step, f64::min);
                if size == f64::NEG_INFINITY || least > 0.99 * step {
                    break;
                }
                step = least;
            }
            step
        };
        self.powers.iter().fold(wanted, shortened)
    }

    /// Looks for what happens in a step of so many seconds.
    pub fn look(&mut self, motion: &Motion<W>, step: f64) {
        self.ahead.clear();
        self.ends.clear();
        for (event, powers) in self.powers.iter().enumerate() {
            let shares = in_shares(powers, 1.0, step);
            let direction = motion.mechanism.events[event].direction;
            let counts =
                |rises: bool| direction == Direction::Either || rises == (direction == Direction::Rising);
            let began = (self.happened.iter().rev())
                .take_while(|last| (motion.state().t - last.t).value() <= SAME * step)
                .any(|last| last.event == event);
            let (passages, end) = passages(&shares, self.sides[event], began);
            self.ends.push(end);
            for (share, _) in passages.into_iter().filter(|(_, rises)| counts(*rises)) {
                let near = Digits::of(share * step);
                let after = if share == 0.0 { Digits::ZERO } else { refined(motion, powers, near) };
                self.ahead.push((event, after));
            }
        }
        self.ahead.sort_by(|a, b| (a.1 - b.1).value().total_cmp(&0.0).then(a.0.cmp(&b.0)));
        let end = self.ahead.iter().position(|(event, _)| motion.mechanism.events[*event].stop);
        self.ahead.truncate(end.map_or(usize::MAX, |end| end + 1));
    }

    /// The event of the step that is next which ends the run, and how much later \[s\].
    pub fn stop(&self, mechanism: &ExactMechanism<Digits<W>>) -> Option<(usize, Digits<W>)> {
        self.ahead.last().copied().filter(|(event, _)| mechanism.events[*event].stop)
    }

    /// What happens in the step that is next, as far as there is room for it.
    fn happening(&self, motion: &Motion<W>) -> impl Iterator<Item = Happened<W>> {
        let happens = |&(event, after): &(usize, Digits<W>)| {
            let t = motion.state().t + after;
            let posture = motion.at(t);
            Happened { event, t, phi: posture.phi, omega: posture.omega }
        };
        self.ahead.iter().take(KEPT.saturating_sub(self.happened.len())).map(happens)
    }

    /// What has happened up to a time in the step that is next.
    pub fn until(&self, motion: &Motion<W>, t: Digits<W>) -> Vec<Happened<W>> {
        let ahead = self.happening(motion).filter(|event| event.t <= t);
        self.happened.iter().cloned().chain(ahead).collect()
    }

    /// Takes what is in the step that is next, which is made.
    pub fn pass(&mut self, motion: &Motion<W>) {
        let passed: Vec<_> = self.happening(motion).collect();
        self.happened.extend(passed);
        self.sides.clone_from(&self.ends);
        self.ahead.clear();
    }
}

/// Passages of a formula through zero, in shares of a step and whether it rises, and its side at the end;
/// `began` says that one of them ended the step before.
fn passages(shares: &[f64], before: i8, began: bool) -> (Vec<(f64, bool)>, i8) {
    let curve = Powers { powers: shares, end: 1.0 };
    let sign = |value: f64| if value > 0.0 { 1 } else { -i8::from(value < 0.0) };
    let at = |share: f64| curve.at(share)[0];
    let most = (0..=LOOKS).map(|k| at(k as f64 / LOOKS as f64).abs()).fold(0.0, f64::max);
    let mut all = Vec::new();
    if most == 0.0 || !most.is_finite() {
        return (all, before);
    }
    let is_at_zero = at(0.0).abs() <= NO_VALUE * most;
    let mut side = if is_at_zero || began { sign(at(LEAVES)) } else { sign(at(0.0)) };
    // A jump of the rates may have carried it across.
    if before != 0 && side == -before && !began {
        all.push((0.0, side > 0));
    }
    let mut share = SAME;
    while let Some(zero) = root(&curve, 0.0, share, 1.0) {
        share = zero + SAME;
        let after = sign(at(share.min(1.0)));
        // At the very end of a step what follows is not known: it is on the other side.
        let next = if after == 0 || share >= 1.0 { -side } else { after };
        if next != side {
            all.push((zero, next > 0));
        }
        side = next;
        if share >= 1.0 {
            return (all, side);
        }
    }
    // A step may end at a zero, as one that ends on a wall does.
    let [value, slope] = curve.at(1.0);
    if value.abs() <= NO_VALUE * most && sign(slope) == -side {
        all.push((1.0, slope > 0.0));
        side = -side;
    }
    (all, side)
}
