//! What is told where no start is found: all that is missing, and the configuration that comes closest.

use super::newton::{AssemblyProblem, GivenNumber, Goal};
use super::{ClosedStart, DEPENDENT, DISTINCT};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::compile::{Body, CompileError, quoted};
use crate::dynamics::constraint::RowMeasure;

/// Configurations apart by less are not told apart by a rough value \[rad, or sizes of the mechanism\].
const ROUGHLY: f64 = 0.3;
/// A coordinate with a larger share in a direction that nothing holds is open.
const OPEN: f64 = 1e-6;

/// The configuration that comes closest to what a scene asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct Closest {
    /// Coordinates, angles in [-π, π] but where gears count turns \[rad, m\].
    pub q: Vec<f64>,
    /// The start as a scene gives it: `"start": {"crank": {"phi": 0.3}}`.
    pub written: String,
    /// How far what is given is from it \[rad, or sizes of the mechanism\], where it closes all loops.
    pub apart: Option<f64>,
    /// Guesses tried, and how many of them closed all loops.
    pub guesses: [usize; 2],
}

impl std::fmt::Display for Closest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [tried, closed] = self.guesses;
        match self.apart {
            Some(apart) => write!(
                f,
                "closest: {}, {apart:.3} rad or sizes of the mechanism from what is given; {closed} of \
                    {tried} guesses lead to configurations that close all loops, none nearer",
                self.written
            ),
            None => write!(f, "closest: {}; none of {tried} guesses closes all loops", self.written),
        }
    }
}

impl AssemblyProblem<'_> {
    /// No guess closes the rows: the one that came closest.
    pub(super) fn impossible(&self, open: Vec<Vec<DoubleDouble>>, guesses: [usize; 2]) -> CompileError {
        let least = open.into_iter().min_by(|a, b| self.worst(a).1.total_cmp(&self.worst(b).1));
        let q = least.unwrap_or_default();
        self.no_start(&q, self.closest(&q, None, guesses))
    }

    /// The nearest start is too far from what is given.
    pub(super) fn far(
        &self,
        guess: &[DoubleDouble],
        best: &ClosedStart,
        guesses: [usize; 2],
    ) -> CompileError {
        let mut held = guess.to_vec();
        self.position(&mut held, &self.active, &vec![true; self.aims.len()]);
        self.no_start(&held, self.closest(&best.q, Some(best.change), guesses))
    }

    /// With the row that is off most at a position.
    fn no_start(&self, q: &[DoubleDouble], closest: Closest) -> CompileError {
        let (row, left) = self.worst(q);
        // Without rows it is the places given that rounding keeps from being met.
        let (row, unit) =
            self.mechanism.constraints.get(row).map_or(("start", "m"), |row| (&row.name, row.unit()));
        CompileError::Impossible { row: row.into(), left, unit, closest: Box::new(closest) }
    }

    fn closest(&self, q: &[DoubleDouble], apart: Option<f64>, guesses: [usize; 2]) -> Closest {
        // What a motor or a gear gives is not to be given, unless its law names the angle it gives.
        let mut is_driven = vec![false; self.mechanism.coordinates()];
        self.visit::<f64>(q, &vec![0.0; q.len()], |i, _, gradient| {
            let row = &self.mechanism.constraints[i];
            let turned = match (&row.measure, &row.aim) {
                (_, Some(aim)) => aim.angles.first().copied(),
                (&RowMeasure::Angle { body, .. }, _) if row.law.is_some() => Some(body),
                _ => None,
            };
            turned.into_iter().for_each(|body| is_driven[body] |= gradient[body] == 1.0);
        });
        let geared = self.mechanism.geared_bodies();
        let q: Vec<f64> = (0..q.len()).map(|k| self.principal(q, k, &geared)).collect();
        let entry = |(body, phi): (&Body, &f64)| {
            format!("\"{}\": {{\"phi\": {}}}", body.name, (phi * 1e4).round() / 1e4)
        };
        let given =
            self.mechanism.own_bodies().iter().zip(&q).enumerate().filter(|(body, _)| !is_driven[*body]);
        let all: Vec<String> = given.map(|(_, one)| entry(one)).collect();
        Closest { written: format!("\"start\": {{{}}}", all.join(", ")), q, apart, guesses }
    }

    /// Refuses a start of which neither rows nor what is given fix a coordinate, or its rate, and names as
    /// many as must be given.
    pub(super) fn check_open(
        &self,
        q: &[DoubleDouble],
        rows: &[bool],
        aims: &[GivenNumber],
        missing: &[usize],
        what: &str,
    ) -> Result<(), CompileError> {
        let mut matrix = self.jacobian(q, rows);
        self.add_aims(&mut matrix, aims, q);
        let mut asked = Vec::new();
        for k in matrix.svd().to_fix(q.len(), DEPENDENT, missing, OPEN) {
            let place = self.place(k, what);
            if !asked.contains(&place) {
                asked.push(place);
            }
        }
        if asked.is_empty() { Ok(()) } else { Err(CompileError::Undetermined(asked)) }
    }

    /// How far apart two starts are in a coordinate \[rad, or sizes of the mechanism\].
    fn apart(&self, one: &ClosedStart, other: &ClosedStart, k: usize) -> f64 {
        let apart = other.q[k] - one.q[k];
        if k < self.mechanism.bodies.len() { apart.reduced().0.hi.abs() } else { apart.hi.abs() / self.size }
    }

    /// The coordinate in which two starts differ most, where they differ.
    pub(super) fn differs(&self, one: &ClosedStart, other: &ClosedStart) -> Option<usize> {
        let apart = |&k: &usize| self.apart(one, other, k);
        (0..one.q.len()).max_by(|a, b| apart(a).total_cmp(&apart(b))).filter(|k| apart(k) > DISTINCT)
    }

    /// Refuses a start with rivals that are as near to what is given, and names what tells them all apart.
    pub(super) fn check_alone(
        &self,
        best: &ClosedStart,
        near: Vec<&ClosedStart>,
    ) -> Result<(), CompileError> {
        let mut rivals: Vec<&ClosedStart> = Vec::new();
        for other in near {
            if self.differs(best, other).is_some()
                && rivals.iter().all(|known| self.differs(known, other).is_some())
            {
                rivals.push(other);
            }
        }
        let count = rivals.len() + 1;
        let mut asked: Vec<(usize, f64)> = Vec::new();
        while !rivals.is_empty() {
            // The coordinate that tells most of them apart, by the most.
            let told = |k: usize| {
                let apart: Vec<f64> =
                    rivals.iter().map(|other| self.apart(best, other, k)).filter(|&x| x > ROUGHLY).collect();
                (apart.len(), apart.into_iter().fold(0.0, f64::max))
            };
            let better = |a: &usize, b: &usize| {
                let (a, b) = (told(*a), told(*b));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            };
            let Some(k) = (0..best.q.len()).max_by(better) else { break };
            let (told_apart, _) = told(k);
            let farthest = (rivals.iter())
                .max_by(|a, b| self.apart(best, a, k).total_cmp(&self.apart(best, b, k)))
                .map_or(0.0, |other| self.shown(other, k));
            asked.push((k, farthest));
            if told_apart == 0 {
                break;
            }
            rivals.retain(|other| self.apart(best, other, k) <= ROUGHLY);
        }
        let Some(&(k, other)) = asked.first() else { return Ok(()) };
        Err(CompileError::Ambiguous {
            what: self.place(k, "phi"),
            one: self.shown(best, k),
            other,
            unit: if k < self.mechanism.bodies.len() { "rad" } else { "m" },
            count,
            advice: {
                let is_given =
                    |&(k, _): &(usize, f64)| self.aims.iter().any(|aim| aim.goal == Goal::Coordinate(k));
                let (given, open): (Vec<_>, Vec<_>) = asked.iter().partition(|one| is_given(one));
                let names = |list: Vec<&(usize, f64)>| {
                    let names: Vec<String> = list.iter().map(|(k, _)| self.place(*k, "phi")).collect();
                    quoted(&names)
                };
                match (open.is_empty(), given.is_empty()) {
                    (true, _) => format!("give {} more exactly", names(given)),
                    (false, true) => format!("add {} to the scene; roughly is enough", names(open)),
                    (false, false) => {
                        format!(
                            "add {} to the scene, roughly, and give {} more exactly",
                            names(open),
                            names(given)
                        )
                    }
                }
            },
        })
    }

    fn shown(&self, found: &ClosedStart, k: usize) -> f64 {
        self.principal(&found.q, k, &self.mechanism.geared_bodies())
    }
}
