//! Other positions of a mechanism, from guesses that have no part of its start.

use super::ClosedStart;
use super::newton::AssemblyProblem;
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::dynamics::Mechanism;
use crate::scene::{Given, Scene};

/// A search goes on where the squares of violations fall by this factor in a few iterations …
const HOPEFUL: f64 = 4.0;
/// … and is finished where what is left of them is below this \[rad, or levers\].
const NEARLY: f64 = 1e-3;
/// What a position may be off by once its angles are taken to the turns of motors \[rad, or levers\].
const KEPT: f64 = 1e-9;

impl Mechanism {
    /// Other positions that close all rows at the start's time, of which that of the motors is one: angles
    /// and translational coordinates of each, found from so many guesses of a fixed set; and how many guesses
    /// there were, how many led to no position, and how many to one that was known.
    ///
    /// Angles are in [-π, π] but those whose turns gears count: these begin within so many half `turns` of
    /// the start.
    pub(crate) fn other_assemblies(
        &self,
        scene: &Scene,
        guesses: usize,
        turns: f64,
    ) -> (Vec<Vec<f64>>, [usize; 3]) {
        let start: Vec<DoubleDouble> = self.start(scene).phi;
        let given = |_: usize| Given { phi: false, omega: false, origin: None, velocity: None };
        let problem = AssemblyProblem { aims: Vec::new(), ..AssemblyProblem::new(self, scene, &[], &given) };
        let all: Vec<usize> = (0..start.len()).collect();
        let closed = |q| ClosedStart { q, change: 0.0, distance: 0.0, held: Vec::new(), is_of_family: false };
        let (mut found, mut others) = (vec![closed(start.clone())], Vec::new());
        let mut unassembled = 0;
        for k in 1..=guesses {
            let mut q = problem.other_guess(&start, &all, k);
            problem.gear(&mut q, &start, turns);
            let is_closed = problem.descend(&mut q, &problem.active, &[], HOPEFUL) < NEARLY
                && problem.closes(&mut q, &[]);
            let Some(place) = is_closed.then(|| problem.plain(&q)).flatten() else {
                unassembled += 1;
                continue;
            };
            let other = closed(q);
            if found.iter().all(|known| problem.differs(known, &other).is_some()) {
                found.push(other);
                others.push(place);
            }
        }
        let repeated = guesses - unassembled - others.len();
        (others, [guesses, unassembled, repeated])
    }
}

impl AssemblyProblem<'_> {
    /// A guess whose geared angles are so many times as far from the start as they were, with motors at their
    /// turns and what gears give where they give it.  Without it a wheel of a large ratio would hold the
    /// others to a small part of a turn.
    fn gear(&self, q: &mut [DoubleDouble], start: &[DoubleDouble], turns: f64) {
        let geared = self.mechanism.geared_bodies();
        if geared.is_empty() {
            return;
        }
        for &k in &geared {
            q[k] = start[k] + (q[k] - start[k]).scale(turns);
        }
        let mut plain: Vec<f64> = q.iter().map(|q| q.hi).collect();
        self.mechanism.wind(&mut plain);
        q.iter_mut().zip(plain).for_each(|(q, plain)| *q = DoubleDouble::of(plain));
        // Along a train of wheels from one to the next.
        for _ in &geared {
            let mut off = Vec::new();
            self.visit::<f64>(q, &vec![0.0; self.coordinates()], |i, here, _| {
                let aim = self.mechanism.constraints[i].aim.as_ref();
                off.extend(aim.and_then(|aim| aim.angles.first()).map(|&body| (body, here.position)));
            });
            off.retain(|(_, off)| off.is_finite());
            off.into_iter().for_each(|(body, off)| q[body] -= DoubleDouble::of(off));
        }
    }

    /// A position with angles in [-π, π] where turns do not matter, and motors at their turns; none where
    /// gears keep these from it.
    fn plain(&self, q: &[DoubleDouble]) -> Option<Vec<f64>> {
        let geared = self.mechanism.geared_bodies();
        let mut place: Vec<f64> = (0..q.len()).map(|k| self.principal(q, k, &geared)).collect();
        self.mechanism.wind(&mut place);
        let there: Vec<DoubleDouble> = place.iter().map(|&x| DoubleDouble::of(x)).collect();
        let (row, off) = self.worst(&there);
        let is_kept =
            || off <= KEPT * self.lever[row] * place.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
        (geared.is_empty() || is_kept()).then_some(place)
    }

    /// Coordinate `k`, as an angle in [-π, π] where no gear counts its turns.
    pub(super) fn principal(&self, q: &[DoubleDouble], k: usize, geared: &[usize]) -> f64 {
        let is_wrapped = k < self.mechanism.bodies.len() && !geared.contains(&k);
        if is_wrapped { q[k].reduced().0.hi } else { q[k].hi }
    }
}
