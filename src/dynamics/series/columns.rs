//! Derivatives of a motion's powers in several directions, by series of numbers with derivatives in slots.
//!
//! A single direction has one slot, several have eight, in the vectors of the processor.

use super::slots::InSlots;
use super::varied::Number;
use super::{Series, Terms};
use crate::arithmetic::Scalar;
use crate::arithmetic::eight::LANES;
use crate::arithmetic::lanes::wide::{EightLanes, Single, Slots, Task, Vectors, WideCode};
use crate::dynamics::schur::Weakest;
use crate::dynamics::{Coordinates, Time};
use std::fmt::Debug;

/// Powers that may be what is integrated.
pub const LEADING: usize = 4;

/// Where a motion begins: the time, coordinates (leading part and rest) and rates.
pub type Begin<'a> = (Time, &'a [Number], &'a [Number], &'a [Number]);

/// Powers of the rates with their derivatives.
pub trait Columns: Debug + Send {
    /// Number of coordinates.
    fn coordinates(&self) -> usize;

    /// Highest power of the rates.
    fn order(&self) -> usize;

    /// Expands up to another power from here on, at most the one there is room for.
    fn expand_up_to(&mut self, order: usize);

    /// Expands a motion; returns the row nearest to being left out at its start.
    fn expand(&mut self, terms: &Terms<Number>, begin: Begin) -> Weakest;

    /// Power `m` of the rate of a coordinate.
    fn rate(&self, m: usize, coordinate: usize) -> Number;

    /// The largest derivative of each power of the rates from [`LEADING`] on in a step of `h` \[s\], over
    /// what is integrated: coordinates with these derivatives, and the powers below.
    fn shares(&self, u: &[Number], h: f64, shares: &mut Vec<f64>);

    /// Takes the derivatives of coordinates and rates on by `h` \[s\], along powers 0 … `order`.
    fn advance(&self, order: usize, h: f64, own: &mut [Vec<Number>; 2]);
}

/// Room for the powers of terms in some coordinates, of so many directions.
pub fn columns(
    terms: &Terms<Number>,
    coordinates: Coordinates,
    order: usize,
    count: usize,
) -> Box<dyn Columns> {
    Vectors::default().run(Room { terms, coordinates, order, count })
}

struct Room<'a, 'b> {
    terms: &'a Terms<'b, Number>,
    coordinates: Coordinates,
    order: usize,
    count: usize,
}

impl Room<'_, '_> {
    fn of<S: Slots + Send>(&self) -> Box<dyn Columns> {
        let series = Series::<InSlots<S>>::of_terms(self.terms, self.coordinates, self.order);
        let room = || vec![InSlots::ZERO; series.coordinates()];
        let fractions = (0..=self.order).map(|m| 1.0 / (m + 1) as f64).collect();
        Box::new(InColumns { begin: [room(), room(), room()], series, fractions })
    }
}

impl WideCode for Room<'_, '_> {
    type Output = Box<dyn Columns>;

    #[inline(always)]
    fn run<W: EightLanes>(self) -> Box<dyn Columns> {
        if self.count == 1 { self.of::<Single<W::Half>>() } else { self.of::<W>() }
    }
}

/// The series, and where they begin: coordinates, what the leading part leaves out of them, and rates.
#[derive(Debug)]
struct InColumns<S: Slots> {
    series: Series<InSlots<S>>,
    begin: [Vec<InSlots<S>>; 3],
    /// 1/(m+1).
    fractions: Vec<f64>,
}

struct Expand<'a, 'b, S: Slots> {
    columns: &'a mut InColumns<S>,
    terms: &'a Terms<'b, Number>,
    begin: Begin<'a>,
}

impl<S: Slots> Task for Expand<'_, '_, S> {
    type Output = ();

    #[inline(always)]
    fn perform(self) {
        let InColumns { series, begin: [u, rest, rate], .. } = self.columns;
        let (t, from_u, from_rest, from_rate) = self.begin;
        for c in 0..u.len() {
            u[c] = InSlots::load(&from_u[c]);
            rest[c] = InSlots::load(&from_rest[c]);
            rate[c] = InSlots::load(&from_rate[c]);
        }
        series.expand_terms(self.terms, t, u, rest, rate);
    }
}

struct Shares<'a, S: Slots> {
    columns: &'a InColumns<S>,
    u: &'a [Number],
    h: f64,
    shares: &'a mut Vec<f64>,
}

/// The larger one, or what is not a number.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The larger ones of these and of a number's derivatives times a factor.
#[inline(always)]
fn note<S: Slots>(sizes: &mut [f64; LANES], slope: &[f64; LANES], factor: f64) {
    for lane in 0..S::COUNT {
        sizes[lane] = larger(sizes[lane], slope[lane].abs() * factor);
    }
}

impl<S: Slots> Task for Shares<'_, S> {
    type Output = ();

    #[inline(always)]
    fn perform(self) {
        let Self { columns: InColumns { series, .. }, u, h, shares } = self;
        let f = u.len();
        let (mut whole, mut power) = ([0.0; LANES], 1.0);
        for u in u {
            note::<S>(&mut whole, &u.slope, 1.0 / h);
        }
        for m in 0..=series.order() {
            let rates = &series.rate[m * f..(m + 1) * f];
            if m < LEADING {
                for rate in rates {
                    note::<S>(&mut whole, &rate.slopes(), power);
                }
                if m + 1 == LEADING {
                    for whole in &mut whole {
                        *whole = if *whole > 0.0 { 1.0 / *whole } else { *whole };
                    }
                }
            } else {
                let (mut sizes, mut share) = ([0.0; LANES], 0.0);
                for rate in rates {
                    note::<S>(&mut sizes, &rate.slopes(), power);
                }
                for lane in 0..S::COUNT {
                    share = larger(share, sizes[lane] * whole[lane]);
                }
                shares.push(share);
            }
            power *= h;
        }
    }
}

struct Advance<'a, S: Slots> {
    columns: &'a InColumns<S>,
    order: usize,
    h: f64,
    own: &'a mut [Vec<Number>; 2],
}

impl<S: Slots> Task for Advance<'_, S> {
    type Output = ();

    #[inline(always)]
    fn perform(self) {
        let Self { columns: InColumns { series, fractions, .. }, order, h, own: [u, rates] } = self;
        let (f, h) = (u.len(), S::splat(h));
        for c in 0..f {
            let (mut turn, mut speed) = (S::ZERO, S::ZERO);
            let mut m = order + 1;
            while m > 0 {
                m -= 1;
                let power = series.rate[m * f + c].slope;
                turn = turn.mul_add(h, power.mul(S::splat(fractions[m])));
                speed = speed.mul_add(h, power);
            }
            u[c].slope = turn.mul_add(h, S::of(&u[c].slope)).array();
            rates[c].slope = speed.array();
        }
    }
}

impl<S: Slots + Send> Columns for InColumns<S> {
    fn coordinates(&self) -> usize {
        self.series.coordinates()
    }

    fn order(&self) -> usize {
        self.series.order()
    }

    fn expand_up_to(&mut self, order: usize) {
        self.series.expand_up_to(order);
    }

    fn expand(&mut self, terms: &Terms<Number>, begin: Begin) -> Weakest {
        S::perform(Expand { columns: self, terms, begin });
        self.series.weakest()
    }

    fn rate(&self, m: usize, coordinate: usize) -> Number {
        self.series.rate[m * self.series.coordinates() + coordinate].store()
    }

    fn shares(&self, u: &[Number], h: f64, shares: &mut Vec<f64>) {
        shares.clear();
        S::perform(Shares { columns: self, u, h, shares });
    }

    fn advance(&self, order: usize, h: f64, own: &mut [Vec<Number>; 2]) {
        S::perform(Advance { columns: self, order, h, own });
    }
}
