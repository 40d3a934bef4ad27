//! The projection of a few bodies with loops in natural coordinates: linear rows by constant matrices, then
//! the unit lengths, both levels with one set of factors
//! ([`projection`](crate::dynamics::natural::projection)).
//!
//! ```text
//! z -> z - dz:   q -= atan(z × dz / (1 - z·dz));
//!     v = i z w at the new place,  v -> v - dv:   w -= z × dv
//! ```
//!
//! The shortest way in the metric of the mass matrix, as in angles, for about a fifth of the time.

use crate::arithmetic::Complex;
use crate::arithmetic::lanes::row::{Row, at, room};
use crate::arithmetic::lanes::{self, Code, Lanes};
use crate::arithmetic::sincos;
use crate::arithmetic::sum::two_sum;
use crate::dynamics::State;
use crate::dynamics::looped::NEAR;
use crate::dynamics::natural::ReducedMatrices;
use crate::dynamics::natural::projection::{CLOSE, LaneProjection};

/// Turns up to this \[rad\] are their sines' series.
const SMALL: f64 = 1e-4;
/// Most bodies.
const MOST: usize = room(4);

/// Up to four, eight or sixteen bodies.
#[derive(Clone, Debug)]
pub enum NaturalProjection {
    Few(Box<NaturalScratch<1>>),
    Several(Box<NaturalScratch<2>>),
    Many(Box<NaturalScratch<4>>),
}

/// Constants, and elements and rates of the state faced last.
#[derive(Clone, Debug)]
pub struct NaturalScratch<const B: usize> {
    projection: LaneProjection<B>,
    z: [Row<B>; 2],
    rate: Row<B>,
    /// What rates count as at least \[rad/s\].
    unit: f64,
}

impl NaturalProjection {
    /// Of a form's matrices, with the mechanism's unit of rates \[rad/s\].
    pub fn new(reduced: &ReducedMatrices, unit: f64) -> Self {
        match reduced.free.len() {
            0..=4 => Self::Few(Box::new(NaturalScratch::new(reduced, unit))),
            5..=8 => Self::Several(Box::new(NaturalScratch::new(reduced, unit))),
            _ => Self::Many(Box::new(NaturalScratch::new(reduced, unit))),
        }
    }

    /// Writes the elements at a state.
    pub fn unit_vectors(&mut self, state: &State, z: &mut [Complex<f64>]) {
        match self {
            Self::Few(bench) => lanes::run(PositionStage { bench, state, z }, false),
            Self::Several(bench) => lanes::run(PositionStage { bench, state, z }, false),
            Self::Many(bench) => lanes::run(PositionStage { bench, state, z }, false),
        }
    }

    /// Brings the state faced last onto all rows and writes its new elements; tells the largest turn \[rad\]
    /// and the largest change of a rate \[rad/s\]. `None`, and nothing done, near a singular position, where
    /// the angle form knows what to leave out.
    pub fn land(&mut self, state: &mut State, z: &mut [Complex<f64>]) -> Option<[f64; 2]> {
        match self {
            Self::Few(bench) => lanes::run(ProjectNatural { bench, state, z }, false),
            Self::Several(bench) => lanes::run(ProjectNatural { bench, state, z }, false),
            Self::Many(bench) => lanes::run(ProjectNatural { bench, state, z }, false),
        }
    }
}

impl<const B: usize> NaturalScratch<B> {
    fn new(reduced: &ReducedMatrices, unit: f64) -> Self {
        let zero = [[[0.0; 4]; B]; 2];
        Self { projection: LaneProjection::new(reduced), z: zero, rate: [[0.0; 4]; B], unit }
    }
}

#[inline(always)]
fn vector<const B: usize>(x: &[Row<B>; 2], i: usize) -> Complex<f64> {
    Complex::new(at(&x[0], i), at(&x[1], i))
}

struct PositionStage<'a, const B: usize> {
    bench: &'a mut NaturalScratch<B>,
    state: &'a State,
    z: &'a mut [Complex<f64>],
}

impl<const B: usize> Code for PositionStage<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { bench: NaturalScratch { z, rate, .. }, state, z: elements } = self;
        let n = elements.len();
        let (mut angle, mut rest) = ([[0.0; 4]; B], [[0.0; 4]; B]);
        angle.as_flattened_mut()[..n].copy_from_slice(&state.y[..n]);
        rest.as_flattened_mut()[..n].copy_from_slice(&state.low[..n]);
        rate.as_flattened_mut()[..n].copy_from_slice(&state.y[n..2 * n]);
        for b in 0..B {
            let live = L::of(std::array::from_fn(|lane| if 4 * b + lane < n { 1.0 } else { 0.0 }));
            let (s, c) = sincos::sin_cos(L::of(angle[b]), L::of(rest[b]));
            (z[0][b], z[1][b]) = (c.mul(live).array(), s.mul(live).array());
        }
        for (i, element) in elements.iter_mut().enumerate() {
            *element = vector(z, i);
        }
    }
}

struct ProjectNatural<'a, const B: usize> {
    bench: &'a mut NaturalScratch<B>,
    state: &'a mut State,
    z: &'a mut [Complex<f64>],
}

impl<const B: usize> Code for ProjectNatural<'_, B> {
    type Output = Option<[f64; 2]>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<[f64; 2]> {
        let Self { bench: NaturalScratch { projection, z, rate, unit }, state, z: elements } = self;
        let n = elements.len();
        let moved = projection.project_back::<L>(z);
        // What is not a number is not sound.
        let is_sound = moved.least >= NEAR && moved.left <= CLOSE;
        if !is_sound {
            return None;
        }
        let mut v = *z;
        for b in 0..B {
            let w = L::of(rate[b]);
            (v[0][b], v[1][b]) = (L::of(z[1][b]).mul(w).neg().array(), L::of(z[0][b]).mul(w).array());
        }
        let slowed = projection.project_rates_back::<L>(z, &mut v);
        let mut changes = [[0.0; 2]; MOST];
        let (mut most, mut fastest) = ([0.0_f64; 2], *unit);
        for (i, change) in changes[..n].iter_mut().enumerate() {
            let (from, away) = (elements[i], vector(&moved.change, i));
            *change = [-arc(from.cross(away), 1.0 - from.dot(away)), -vector(z, i).cross(vector(&slowed, i))];
            (most, fastest) = (
                [most[0].max(change[0].abs()), most[1].max(change[1].abs())],
                fastest.max(state.y[n + i].abs()),
            );
        }
        // What is at rounding already is left alone.
        if most[0] <= f64::EPSILON && most[1] <= f64::EPSILON * fastest {
            return Some([0.0; 2]);
        }
        for (i, [turn, change]) in changes[..n].iter().enumerate() {
            (state.y[i], state.low[i]) = two_sum(state.y[i], state.low[i] + turn);
            (state.y[n + i], state.low[n + i]) = two_sum(state.y[n + i], state.low[n + i] + change);
            elements[i] = vector(z, i);
        }
        Some(most)
    }
}

/// The angle whose sine and cosine these are.
#[inline(always)]
fn arc(sin: f64, cos: f64) -> f64 {
    let square = sin * sin;
    if square <= SMALL * SMALL && cos > 0.0 {
        sin * (1.0 + square * (1.0 / 6.0))
    } else {
        libm::atan2(sin, cos)
    }
}
