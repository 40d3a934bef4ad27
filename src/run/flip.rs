//! Bars that turn over: the first time an angle passes an odd multiple of π.
//!
//! That is where wrapped angles jump, so a step in which a bar's count of turns changes holds a passage.  A step in which a bar turns back near the
//! boundary may hold two; the cubic through angles and rates at both ends of the step says which steps to go through again, in parts.  The passage itself is
//! found by Newton's method on the motion, marched again from the beginning of the step, so it is as accurate as the run.  Methods that cannot march a part of
//! a step, or do not show their steps, are traced by `dp8` there.

use crate::dynamics::{Form, Glance, State};
use std::f64::consts::PI;

/// The first passage of a bar.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Flip {
    /// Time \[s\].
    pub t: f64,
    /// Number of the bar.
    pub bar: usize,
}

/// Parts of a step that is gone through again.
const PARTS: usize = 8;
/// What a cubic over a step may miss of an angle \[rad\], and of its rise over the step's ends.
const MISSED: [f64; 2] = [0.05, 0.3];

/// A step that holds a passage, or may.
pub(super) struct Suspect {
    /// Where it begins.
    pub from: State,
    /// Its length \[s\].
    pub span: f64,
    pub ends: [Glance; 2],
}

/// Looks at every step until the first passage.
#[derive(Default)]
pub(super) struct Lookout {
    pub flip: Option<Flip>,
    suspects: Vec<Suspect>,
    before: Glance,
    now: Glance,
    from: State,
    /// True once a passage is certain.
    closed: bool,
}

impl Lookout {
    /// Takes the state from which the next steps are taken.
    pub fn begin<P: Form + ?Sized>(&mut self, problem: &mut P, state: &State) {
        problem.glance(state, &mut self.before);
        remember(&mut self.from, state);
    }

    /// Takes the state after a step, and tells whether the step is to be searched; with `all` it is in any case.
    pub fn step<P: Form + ?Sized>(&mut self, problem: &mut P, state: &State, all: bool) -> bool {
        if self.closed {
            return false;
        }
        problem.glance(state, &mut self.now);
        let span = (state.time - self.from.time).hi;
        self.closed = self.before.turns != self.now.turns;
        let suspicious = all || self.closed || (0..self.now.phi.len()).any(|bar| may_pass(bar, &self.before, &self.now, span));
        if suspicious {
            self.suspects.push(Suspect { from: self.from.clone(), span, ends: [self.before.clone(), self.now.clone()] });
        }
        std::mem::swap(&mut self.before, &mut self.now);
        remember(&mut self.from, state);
        suspicious
    }

    /// Goes through the suspicious steps, oldest first, until `find` finds the passage.
    pub fn search(&mut self, find: &mut dyn FnMut(&Suspect) -> Option<Flip>) {
        for suspect in std::mem::take(&mut self.suspects) {
            let [a, b] = &suspect.ends;
            // A passage so near the end of the step that rounding decides is there.
            let turned = || (0..a.turns.len()).find(|&bar| a.turns[bar] != b.turns[bar]);
            let at_end = || turned().map(|bar| Flip { t: suspect.from.time.hi + suspect.span, bar });
            self.flip = find(&suspect).or_else(at_end);
            if self.flip.is_some() {
                return;
            }
        }
    }
}

/// Copies a state but for what a method remembers.
fn remember(copy: &mut State, state: &State) {
    copy.time = state.time;
    copy.y.clone_from(&state.y);
    copy.low.clone_from(&state.low);
    copy.turns.clone_from(&state.turns);
}

/// True where the bar moves outwards from a place whence a step may take it to the boundary and back.
pub(super) fn heads_out(phi: f64, omega: f64) -> bool {
    phi.abs() > 1.0 && phi * omega > 0.0
}

/// True where the bar turns back within a step so near the boundary that it may have been beyond.
pub(super) fn may_pass(bar: usize, a: &Glance, b: &Glance, span: f64) -> bool {
    let side = if a.phi[bar] < 0.0 { -1.0 } else { 1.0 };
    if !heads_out(a.phi[bar], a.omega[bar]) || side * b.omega[bar] >= 0.0 {
        return false;
    }
    let top = (1..PARTS).map(|k| side * Cubic::of(bar, a, b, span).at(k as f64 / PARTS as f64 * span)).fold(0.0, f64::max);
    top + MISSED[0] + MISSED[1] * (top - (side * a.phi[bar]).max(side * b.phi[bar])).max(0.0) > PI
}

/// The cubic through angle and rate of a bar at both ends of a step, the angle without the turns of its beginning.
struct Cubic {
    ends: [f64; 2],
    rates: [f64; 2],
    span: f64,
}

impl Cubic {
    fn of(bar: usize, a: &Glance, b: &Glance, span: f64) -> Self {
        Self { ends: [a.phi[bar], winding(bar, a, b)], rates: [a.omega[bar], b.omega[bar]], span }
    }

    fn at(&self, t: f64) -> f64 {
        let (s, rest) = (t / self.span, 1.0 - t / self.span);
        let angles = rest * rest * (1.0 + 2.0 * s) * self.ends[0] + s * s * (3.0 - 2.0 * s) * self.ends[1];
        angles + s * rest * self.span * (rest * self.rates[0] - s * self.rates[1])
    }

    /// A time at which it takes a value that lies between its ends.
    fn solve(&self, value: f64) -> f64 {
        let rises = self.ends[1] > self.ends[0];
        let (mut low, mut high) = (0.0, self.span);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if (self.at(middle) < value) == rises { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Time of the largest value of `side` times it, on a grid.
    fn top(&self, side: f64) -> f64 {
        let places = (0..=32).map(|k| self.span * f64::from(k) / 32.0);
        places.max_by(|&a, &b| (side * self.at(a)).total_cmp(&(side * self.at(b)))).unwrap_or(0.0)
    }
}

/// The angle at `b`, less the turns of `a` \[rad\].
fn winding(bar: usize, a: &Glance, b: &Glance) -> f64 {
    b.phi[bar] + 2.0 * PI * (b.turns[bar] - a.turns[bar]) as f64
}

/// The first passage in a step that begins at `start` \[s\] and takes `span` \[s\]; `at` looks so many seconds after its beginning.
pub(super) fn search(start: f64, span: f64, [first, last]: &[Glance; 2], at: &mut dyn FnMut(f64) -> Option<Glance>) -> Option<Flip> {
    let plain = |bar: usize| first.omega[bar] * last.omega[bar] > 0.0;
    if first.turns != last.turns && (0..first.phi.len()).all(plain) {
        return passage(start, [0.0, span], first, last, at);
    }
    let (mut begin, mut a) = (0.0, first.clone());
    for part in 1..=PARTS {
        let end = span * part as f64 / PARTS as f64;
        let b = if part == PARTS { last.clone() } else { at(end)? };
        if a.turns != b.turns {
            return passage(start, [begin, end], &a, &b, at);
        }
        for bar in 0..a.phi.len() {
            let (cubic, side) = (Cubic::of(bar, &a, &b, end - begin), if a.phi[bar] < 0.0 { -1.0 } else { 1.0 });
            let top = cubic.top(side);
            if top > 0.0 && top < end - begin && side * cubic.at(top) > PI {
                let there = at(begin + top)?;
                if a.turns != there.turns {
                    return passage(start, [begin, begin + top], &a, &there, at);
                }
            }
        }
        (begin, a) = (end, b);
    }
    None
}

/// The first of the passages between two moments whose turns differ.
fn passage(start: f64, span: [f64; 2], a: &Glance, b: &Glance, at: &mut dyn FnMut(f64) -> Option<Glance>) -> Option<Flip> {
    let changed = (0..a.phi.len()).filter(|&bar| a.turns[bar] != b.turns[bar]);
    let found: Vec<Flip> = changed.filter_map(|bar| Some(Flip { t: start + root(bar, span, a, b, at)?, bar })).collect();
    found.into_iter().min_by(|x, y| x.t.total_cmp(&y.t))
}

/// The time after the step's beginning at which a bar is on the boundary between `a` and `b` \[s\].
fn root(bar: usize, [begin, end]: [f64; 2], a: &Glance, b: &Glance, at: &mut dyn FnMut(f64) -> Option<Glance>) -> Option<f64> {
    let side = if b.turns[bar] > a.turns[bar] { 1.0 } else { -1.0 };
    let (mut low, mut high) = (begin, end);
    let mut t = begin + Cubic::of(bar, a, b, end - begin).solve(side * PI);
    for _ in 0..20 {
        let there = at(t)?;
        let beyond = side * winding(bar, a, &there) - PI;
        if beyond < 0.0 {
            low = t
        } else {
            high = t
        }
        let newton = t - beyond / (side * there.omega[bar]);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - t).abs() <= 1e-14 * end.max(1e-3) || beyond == 0.0 {
            return Some(t);
        }
        t = next;
    }
    Some(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::angle;

    fn glance(phi: f64, omega: f64) -> Glance {
        let (mut hi, mut lo) = (phi, 0.0);
        let turns = angle::wrap(&mut hi, &mut lo);
        Glance { phi: vec![hi], turns: vec![turns], omega: vec![omega] }
    }

    /// The first passage of a given motion in one step.
    fn search(motion: impl Fn(f64) -> [f64; 2], span: f64) -> Option<Flip> {
        let ends = [0.0, span].map(|t| glance(motion(t)[0], motion(t)[1]));
        let suspicious = ends[0].turns != ends[1].turns || may_pass(0, &ends[0], &ends[1], span);
        suspicious.then(|| super::search(2.0, span, &ends, &mut |t| Some(glance(motion(t)[0], motion(t)[1]))))?
    }

    #[test]
    fn a_passage_is_found_to_rounding() {
        for (rate, time) in [(1.0, PI - 3.0), (-2.0, 0.5 * (PI + 3.0))] {
            let found = search(|t| [3.0 + rate * t, rate], 4.0).expect("it passes");
            assert!((found.t - 2.0 - time).abs() < 1e-14, "{found:?}");
        }
        // Two boundaries in one step: the first counts.
        let far = search(|t| [3.0 * t * t, 6.0 * t], 2.0).expect("it passes");
        assert!((far.t - 2.0 - (PI / 3.0).sqrt()).abs() < 1e-14, "{far:?}");
    }

    #[test]
    fn there_and_back_within_one_step_is_seen() {
        let top = |height: f64| move |t: f64| [height - (t - 0.4) * (t - 0.4), -2.0 * (t - 0.4)];
        let found = search(top(PI + 1e-4), 1.0).expect("it passes twice");
        assert!((found.t - 2.0 - 0.39).abs() < 1e-9, "{found:?}");
        assert_eq!(search(top(PI - 1e-4), 1.0), None);
        assert_eq!(search(top(2.0), 1.0), None);
        let below = search(|t| [-PI - 0.01 + (t - 0.5) * (t - 0.5), 2.0 * (t - 0.5)], 1.0).expect("on the other side");
        assert!((below.t - 2.0 - 0.4).abs() < 1e-9, "{below:?}");
    }
}
