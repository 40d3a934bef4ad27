//! Small differences on a step of the motion as power series, beside the motion's own.
//!
//! ```text
//! scene, its numbers p seeded  →  mechanism, all constants (c, c')  →  series (w_m, w_m') about (q + dq,
//!     w + dw; p + dp)
//! du(h) = du + Σ w_m' h^(m+1)/(m+1),   dw(h) = Σ w_m' h^m,   m = 0…P
//!     driven angles: dq_i = du_base + Σ ± theta'
//! G dq + C_p dp = 0,  (G w + C_t)' (dq, dw) + C'_p dp = 0
//!     residuals on the same numbers, after every step
//! ```
//!
//! The scene is read once more on [`Varied`] numbers, in which the numbers asked for are seeds, and compiled
//! like any other, so that every constant of the equations has its exact derivatives by them.  The recurrence
//! that expands the motion then expands its derivatives, of so many numbers at once as there are lanes, in
//! the same order and with the same multipliers.  Columns in which no number but the state differs have no
//! seeds.  The motion stays what it was: its value is expanded again
//! for every block of lanes.

use super::super::observer::Step;
use super::super::trust::Ground;
use super::neighbours::Neighbours;
use super::variation::plain;
use crate::arithmetic::Scalar;
use crate::arithmetic::eight::LANES;
use crate::arithmetic::sum::larger;
use crate::dynamics::compile::exact::ExactMechanism;
use crate::dynamics::schur::NEAR;
use crate::dynamics::series::Constants;
use crate::dynamics::series::columns::{Columns, LEADING, MotionPowers, columns};
use crate::dynamics::series::varied::Number;
use crate::dynamics::{Coordinates, Mechanism, Motion, State, Time};
use crate::scene::exact::Watcher;
use crate::scene::{Scene, Template};
use std::sync::Arc;

/// Highest power P of the rates: two more than the motion has, for derivatives of its powers.
pub(super) const ORDER: usize = 22;
/// The largest of the last powers in a step, over what is integrated.
pub(super) const LIMIT: f64 = 1e-12;
/// The same for the last [`SMALL`] powers: those left out in the next step are far smaller.
const ENOUGH: f64 = 3e-12;
/// So many such powers in a row, since powers may be missing by symmetry.
const SMALL: usize = 4;
/// The least power expansions end at.
const LEAST: usize = 12;
/// Powers the step is judged by.
const JUDGES: usize = 2;
/// What is returned near singular positions, whose multipliers have fewer digits than a series asks for.
pub(super) const NEAR_SINGULAR: f64 = f64::INFINITY;
/// What series and neighbours may differ by, over the largest derivative, and of rounding.
const AGREEMENT: f64 = 1e-3;
const ROUNDING: f64 = 1e-9;
/// Accelerations of this share of one over the square of the unit of time are as good as none: where motions
/// begin at a position of rest, what is left of them is rounding alone.
const REST: f64 = 1e-6;

/// Columns of numbers of a scene, in blocks of lanes.
pub(super) struct Expansions {
    blocks: Vec<(usize, Block)>,
    /// The powers of the motion's own step.
    powers: MotionPowers,
}

impl Expansions {
    /// Of numbers at some paths of a scene, whose mechanism and derivatives of the start are these, and of so
    /// many directions in which the state alone differs.
    ///
    /// # Errors
    /// Why there are no such series.
    pub fn new(
        template: &Template,
        scene: &Scene,
        mechanism: &Arc<Mechanism>,
        numbers: &[(&str, f64)],
        starts: &[Vec<f64>],
        directions: usize,
    ) -> Result<Self, String> {
        let all = numbers.len() + directions;
        let block = |first: usize| {
            let own = first.min(numbers.len())..(first + LANES).min(numbers.len());
            let count = LANES.min(all - first);
            let block = Block::new(template, scene, mechanism, &numbers[own.clone()], &starts[own], count)?;
            Ok((count, block))
        };
        let blocks = (0..all).step_by(LANES).map(block).collect::<Result<_, String>>()?;
        Ok(Self { blocks, powers: MotionPowers::default() })
    }

    /// True where what the numbers do to the accelerations of a motion is what their neighbours say.
    pub fn agrees(&mut self, motion: &Motion, neighbours: &mut [Option<Neighbours>]) -> bool {
        let (t, phi, omega) = plain(motion);
        let mut forcing: Vec<Vec<f64>> = Vec::new();
        let unit = self.blocks.first().map_or(1.0, |(_, block)| block.mechanism.structure.units.time);
        let least = REST / (unit * unit);
        let mut sizes = Vec::new();
        for neighbours in neighbours.iter_mut() {
            let mut size = 0.0_f64;
            let moved = neighbours.as_mut().and_then(|neighbours| {
                neighbours.derivative(|neighbour| {
                    let weight = neighbour.weight.abs();
                    let accelerations = neighbour.accelerations(t, &phi, &omega);
                    for acceleration in accelerations {
                        size = size.max(ROUNDING * weight * acceleration.abs().max(least));
                    }
                    accelerations.to_vec()
                })
            });
            let moved = moved.unwrap_or_else(|| vec![0.0; phi.len()]);
            sizes.push(moved.iter().fold(size, |size, slope| size.max(AGREEMENT * slope.abs())));
            forcing.push(moved);
        }
        let mut first = 0;
        self.blocks.iter_mut().all(|(count, block)| {
            let own = first..forcing.len().min(first + *count);
            first += *count;
            block.forcing(motion).iter().all(|(body, value, slopes)| {
                let mut lanes = own.clone().zip(slopes);
                let least = (ROUNDING * value).abs();
                lanes
                    .all(|(number, slope)| (slope - forcing[number][*body]).abs() <= sizes[number].max(least))
            })
        })
    }

    /// Writes what each number alone does to the accelerations of a motion, from entry `first` on; numbers
    /// that do nothing have no entries.
    pub fn force(&mut self, motion: &Motion, forcing: &mut [Vec<f64>], first: usize) {
        let mut columns = forcing;
        for (count, block) in &mut self.blocks {
            let (own, rest) = columns.split_at_mut(*count);
            block.force(motion);
            for (lane, forcing) in own.iter_mut().enumerate().filter(|(_, forcing)| !forcing.is_empty()) {
                for c in 0..block.rest.len() {
                    forcing[first + block.body(c)] = block.series.rate(1, c).slope[lane];
                }
            }
            columns = rest;
        }
    }

    /// Calls `each` with all blocks and their columns.
    fn each(&mut self, mut columns: &mut [Vec<f64>], mut each: impl FnMut(&mut Block, &mut [Vec<f64>])) {
        for (count, block) in &mut self.blocks {
            let (own, rest) = columns.split_at_mut(*count);
            each(block, own);
            columns = rest;
        }
    }

    /// Takes columns from a time inside a step on by `h` \[s\]; returns the last powers over what is
    /// integrated, and leaves the columns alone where that is above [`LIMIT`].
    pub fn advance(&mut self, step: &mut Step, from: f64, h: f64, columns: &mut [Vec<f64>]) -> f64 {
        let mut powers = std::mem::take(&mut self.powers);
        let is_known = from == step.begin() && step.powers(&mut powers);
        let motion = step.at(from);
        let (mut most, known) = (0.0_f64, is_known.then_some(&powers));
        self.each(columns, |block, columns| most = larger(most, block.expand((motion, known), h, columns)));
        self.powers = powers;
        if most <= LIMIT {
            self.each(columns, |block, columns| block.advance(motion, h, columns));
        }
        most
    }

    /// Puts columns onto the constraints at a motion.
    pub fn keep(
        &mut self,
        mechanism: &Mechanism,
        ground: &mut Option<Ground>,
        motion: &Motion,
        columns: &mut [Vec<f64>],
    ) {
        if let Some(ground) = ground.as_mut().filter(|_| mechanism.has_multipliers()) {
            let (time, phi, omega) = plain(motion);
            ground.stand(mechanism, &State { time, y: [phi, omega].concat(), ..State::default() });
        }
        self.each(columns, |block, columns| block.keep(ground, motion, columns));
    }
}

/// As many columns as there are lanes, of which some may be idle.
struct Block {
    mechanism: ExactMechanism<Number>,
    coordinates: Coordinates,
    series: Box<dyn Columns>,
    /// The power the last expansion ended at.
    order: usize,
    /// All coordinates and rates with the columns as derivatives.
    all: [Vec<Number>; 2],
    /// The independent ones, and what the leading part leaves out of the coordinates.
    own: [Vec<Number>; 2],
    rest: Vec<Number>,
    /// What powers come to in a step, and those of a group of coordinates.
    shares: Vec<f64>,
    of_group: Vec<f64>,
    /// The coordinates but for the rotors of integrals, and each of these, which have sizes of their own.
    groups: Vec<Vec<usize>>,
    jacobian: Vec<Number>,
}

impl Block {
    fn new(
        template: &Template,
        plain: &Scene,
        structure: &Arc<Mechanism>,
        numbers: &[(&str, f64)],
        starts: &[Vec<f64>],
        count: usize,
    ) -> Result<Self, String> {
        let seed = |(lane, &(path, value)): (usize, &(_, f64))| (path, Number::unknown(value, lane));
        let known: Vec<_> = numbers.iter().enumerate().map(seed).collect();
        let (mut scene, _) =
            template.exact_with(&[], &known, Watcher::Beside).map_err(|error| error.to_string())?;
        // Angles that are kept from the start are those of the start that was found.
        let found = structure.start(plain);
        for (k, start) in scene.start.iter_mut().enumerate() {
            start.phi = Number::new(found.unwrapped(k), slopes(starts, k));
        }
        let mechanism = ExactMechanism::new(&scene, structure)?;
        let (n, rows) = (structure.coordinates(), structure.constraints.len());
        if mechanism.tree.coordinates != n || mechanism.constraints.len() != rows {
            return Err("the mechanism is of another kind".into());
        }
        let coordinates =
            if structure.has_multipliers() { Coordinates::All } else { Coordinates::Independent };
        let series = columns(&mechanism.terms(), coordinates, ORDER, count);
        let room = |count: usize| vec![Number::ZERO; count];
        let f = series.coordinates();
        let bodies = &mechanism.partition.independent;
        let body = |c: usize| if coordinates == Coordinates::All { c } else { bodies[c] };
        let (rotors, own): (Vec<_>, Vec<_>) = (0..f).partition(|&c| structure.is_integral(body(c)));
        let groups = std::iter::once(own).chain(rotors.into_iter().map(|rotor| vec![rotor])).collect();
        Ok(Self {
            groups,
            of_group: Vec::new(),
            series,
            order: ORDER,
            coordinates,
            mechanism,
            all: [room(n), room(n)],
            own: [room(f), room(f)],
            rest: room(f),
            shares: Vec::with_capacity(ORDER),
            jacobian: room(rows * n),
        })
    }

    /// Takes the state of a motion, with its columns.
    fn take(&mut self, motion: &Motion, columns: &[Vec<f64>]) {
        let n = self.all[0].len();
        let [phi, omega] = &mut self.all;
        for k in 0..n {
            phi[k] = Number::new(motion.phi[k].hi, slopes(columns, k));
            omega[k] = Number::new(motion.omega[k].hi, slopes(columns, n + k));
        }
        for c in 0..self.rest.len() {
            let body = self.body(c);
            self.own[0][c] = self.all[0][body];
            self.own[1][c] = self.all[1][body];
            self.rest[c] = Number::constant(motion.phi[body].lo);
        }
    }

    /// Gives the derivatives of all coordinates and rates at a time, from those of the independent ones.
    fn give(&mut self, t: Time, columns: &mut [Vec<f64>]) {
        let n = self.all[0].len();
        for k in 0..n {
            let (mut phi, mut omega);
            if self.coordinates == Coordinates::All {
                (phi, omega) = (self.own[0][k], self.own[1][k]);
            } else {
                let dependent = &self.mechanism.partition.bodies[k];
                let of = |own: &[Number]| dependent.base.map_or(Number::ZERO, |base| own[base]);
                (phi, omega) = (of(&self.own[0]), of(&self.own[1]));
                for (sign, law) in &dependent.laws {
                    phi += Number::law_value(law, t).scale(*sign);
                    omega += Number::phase(law, t).rate.scale(*sign);
                }
            }
            for (lane, column) in columns.iter_mut().enumerate() {
                (column[k], column[n + k]) = (phi.slope[lane], omega.slope[lane]);
            }
        }
    }

    /// The last powers in a step of `h` \[s\] over what is integrated, and the power up to which the next
    /// step is worth expanding.
    fn tail(&mut self, h: f64) -> (f64, usize) {
        let order = self.series.order();
        let Self { series, own, shares, of_group, groups, .. } = self;
        for (number, group) in groups.iter().enumerate() {
            // Nothing depends on the angle of a rotor.
            let places = if number == 0 { &own[0][..] } else { &[] };
            let found = if number == 0 { &mut *shares } else { &mut *of_group };
            series.shares(group, places, h, found);
            if number > 0 {
                shares.iter_mut().zip(&*of_group).for_each(|(share, &other)| *share = larger(*share, other));
            }
        }
        let (mut small, mut enough) = (0, None);
        for (m, &share) in (LEADING..).zip(&self.shares) {
            small = if share <= ENOUGH { small + 1 } else { 0 };
            if small >= SMALL && m >= LEAST {
                enough.get_or_insert(m + 1);
            }
        }
        let last = self.shares.iter().rev().take(JUDGES);
        let tail = last.fold(0.0, |tail, &share| larger(tail, share));
        (tail, enough.unwrap_or(order + 2).min(ORDER))
    }

    /// The body whose angle an independent coordinate is.
    fn body(&self, coordinate: usize) -> usize {
        match self.coordinates {
            Coordinates::All => coordinate,
            _ => self.mechanism.partition.independent[coordinate],
        }
    }

    /// Expands a motion as far as its accelerations, which every number alone moves.
    fn force(&mut self, motion: &Motion) {
        let order = self.series.order();
        self.series.expand_up_to(1);
        self.take(motion, &[]);
        let [u, rate] = &self.own;
        self.series.expand(&self.mechanism.terms(), (motion.time, u, &self.rest, rate), None);
        self.series.expand_up_to(order);
    }

    /// Accelerations of the independent coordinates of a motion, with what each number alone does to them:
    /// coordinate, value, and derivatives, lane by lane.
    fn forcing(&mut self, motion: &Motion) -> Vec<(usize, f64, Vec<f64>)> {
        self.force(motion);
        let of = |c: usize| {
            let Number { value, slope, .. } = self.series.rate(1, c);
            (self.body(c), value, slope.to_vec())
        };
        (0..self.rest.len()).map(of).collect()
    }

    /// Expands them beside a motion; returns the last powers in a step of `h` \[s\] over what is integrated.
    /// Powers of the motion itself may be known.
    fn expand(
        &mut self,
        (motion, known): (&Motion, Option<&MotionPowers>),
        h: f64,
        columns: &[Vec<f64>],
    ) -> f64 {
        self.take(motion, columns);
        let [u, rate] = &self.own;
        let begin = (motion.time, &u[..], &self.rest[..], &rate[..]);
        let weakest = self.series.expand(&self.mechanism.terms(), begin, known);
        if weakest.share < NEAR {
            return NEAR_SINGULAR;
        }
        self.order = self.series.order();
        let (tail, enough) = self.tail(h);
        if tail > LIMIT && self.order < ORDER {
            self.series.expand_up_to(ORDER);
            return self.expand((motion, known), h, columns);
        }
        self.series.expand_up_to(enough);
        tail
    }

    /// Takes them on by `h` \[s\] along their series.
    fn advance(&mut self, motion: &Motion, h: f64, columns: &mut [Vec<f64>]) {
        self.series.advance(self.order, h, &mut self.own);
        self.give(motion.time + h, columns);
    }

    /// Puts them onto the constraints at a motion, which is that of `ground`.
    fn keep(&mut self, ground: &mut Option<Ground>, motion: &Motion, columns: &mut [Vec<f64>]) {
        if self.coordinates != Coordinates::All {
            if self.mechanism.partition.driven() {
                self.take(motion, columns);
                self.give(motion.time, columns);
            }
            return;
        }
        let (Some(ground), n) = (ground, self.all[0].len()) else { return };
        for level in 0..2 {
            self.take(motion, columns);
            let [phi, omega] = &self.all;
            self.jacobian.fill(Number::ZERO);
            let left = self.mechanism.residuals(motion.time, phi, omega, &mut self.jacobian);
            for (lane, column) in columns.iter_mut().enumerate() {
                let half = &mut column[level * n..(level + 1) * n];
                ground.take_off(left.iter().map(|left| left[level].slope[lane]), half);
            }
        }
    }
}

/// What the columns of a block are in one place.
#[inline]
fn slopes(columns: &[Vec<f64>], place: usize) -> [f64; LANES] {
    let mut slopes = [0.0; LANES];
    for (slope, column) in slopes.iter_mut().zip(columns) {
        *slope = column[place];
    }
    slopes
}
