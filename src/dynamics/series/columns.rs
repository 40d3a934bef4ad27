//! Derivatives of a motion's powers in several directions, by series of numbers with derivatives in slots.
//!
//! A single direction has one slot, several have eight, in the vectors of the processor.

use super::slots::InSlots;
use super::tangent::Tangent;
use super::varied::Number;
use super::{Series, Terms};
use crate::arithmetic::eight::LANES;
use crate::arithmetic::lanes::wide::{EightLanes, Single, SlotTask, Slots, Vectors, WideCode};
use crate::arithmetic::sum::larger;
use crate::arithmetic::{Complex, Scalar};
use crate::dynamics::schur::Weakest;
use crate::dynamics::{Coordinates, Time};
use std::fmt::Debug;
use std::marker::PhantomData;

/// Powers that may be what is integrated.
pub const LEADING: usize = 4;

/// Where a motion begins: the time, coordinates (leading part and rest) and rates.
pub type Begin<'a> = (Time, &'a [Number], &'a [Number], &'a [Number]);

/// Powers of the motion of a hinge tree, as its own step found them.
#[derive(Clone, Debug, Default)]
pub struct MotionPowers {
    /// Highest power P of the rates.
    pub order: usize,
    /// Unit vectors: powers 0…P+1, body by body ((P+2) × n) \[1/s^m\].
    pub z: Vec<Complex<f64>>,
    /// Rates: powers 0…P, body by body ((P+1) × n) \[rad/s^(m+1)\].
    pub omega: Vec<f64>,
}

impl MotionPowers {
    /// Takes the powers of `n` bodies up to `order`: rates, and unit vectors, whose last power follows from
    /// those before.
    pub fn take(
        &mut self,
        (n, order): (usize, usize),
        rate: impl Fn(usize, usize) -> f64,
        unit: impl Fn(usize, usize) -> Complex<f64>,
    ) {
        self.order = order;
        self.omega.resize((order + 1) * n, 0.0);
        self.z.resize((order + 2) * n, Complex::ZERO);
        let (z, last) = self.z.split_at_mut((order + 1) * n);
        let powers = z.chunks_exact_mut(n.max(1)).zip(self.omega.chunks_exact_mut(n.max(1)));
        for (m, (z, rates)) in powers.enumerate() {
            for (k, (z, own)) in z.iter_mut().zip(rates).enumerate() {
                (*z, *own) = (unit(m, k), rate(m, k));
            }
        }
        last.fill(Complex::ZERO);
        let rates = self.omega.chunks_exact(n.max(1));
        for (z, rates) in z.chunks_exact(n.max(1)).rev().zip(rates) {
            for ((sum, z), rate) in last.iter_mut().zip(z).zip(rates) {
                *sum += z.times(*rate);
            }
        }
        for z in last {
            *z = z.left().times(1.0 / (order + 1) as f64);
        }
    }
}

/// Powers of the rates with their derivatives.
pub trait Columns: Debug + Send {
    /// Number of coordinates.
    fn coordinates(&self) -> usize;

    /// Highest power of the rates.
    fn order(&self) -> usize;

    /// Expands up to another power from here on, at most the one there is room for.
    fn expand_up_to(&mut self, order: usize);

    /// Expands a motion, whose own powers may be known; returns the row nearest to being left out at its
    /// start.
    fn expand(&mut self, terms: &Terms<Number>, begin: Begin, known: Option<&MotionPowers>) -> Weakest;

    /// Power `m` of the rate of a coordinate.
    fn rate(&self, m: usize, coordinate: usize) -> Number;

    /// The largest derivative of each power of the rates from [`LEADING`] on in a step of `h` \[s\], over
    /// what is integrated: of some coordinates, whose places `u` count where there are any, and the powers
    /// below.
    fn shares(&self, some: &[usize], u: &[Number], h: f64, shares: &mut Vec<f64>);

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
    Vectors::default().run(NewColumns { terms, coordinates, order, count })
}

struct NewColumns<'a, 'b> {
    terms: &'a Terms<'b, Number>,
    coordinates: Coordinates,
    order: usize,
    count: usize,
}

impl NewColumns<'_, '_> {
    fn of<S: Slots + Send>(&self) -> Box<dyn Columns> {
        let fractions = (0..=self.order).map(|m| 1.0 / (m + 1) as f64).collect();
        if let Some(expansion) = Tangent::<S>::new(self.terms, self.coordinates, self.order) {
            return Box::new(InColumns { expansion, fractions, slots: PhantomData });
        }
        let series = Series::<InSlots<S>>::of_terms(self.terms, self.coordinates, self.order);
        let room = || vec![InSlots::ZERO; series.coordinates()];
        let expansion = WholeSeries { begin: [room(), room(), room()], series };
        Box::new(InColumns { expansion, fractions, slots: PhantomData })
    }
}

impl WideCode for NewColumns<'_, '_> {
    type Output = Box<dyn Columns>;

    #[inline(always)]
    fn run<W: EightLanes>(self) -> Box<dyn Columns> {
        if self.count == 1 { self.of::<Single<W::Half>>() } else { self.of::<W>() }
    }
}

/// Powers of a motion with their derivatives, of one kind or another.
trait ColumnExpansion<S: Slots>: Debug + Send {
    fn coordinates(&self) -> usize;
    fn order(&self) -> usize;
    fn expand_up_to(&mut self, order: usize);
    /// What of it is not compiled for the slots.
    fn prepare(&mut self, terms: &Terms<Number>, begin: Begin, known: Option<&MotionPowers>);
    fn expand(&mut self, terms: &Terms<Number>, begin: Begin, known: Option<&MotionPowers>);
    fn weakest(&self) -> Weakest;
    /// Power `m` of a rate, and its derivatives.
    fn value(&self, m: usize, coordinate: usize) -> f64;
    fn slope(&self, m: usize, coordinate: usize) -> S;
}

/// Series of numbers with derivatives, and where they begin: coordinates, what the leading part leaves out of
/// them, and rates.
#[derive(Debug)]
struct WholeSeries<S: Slots> {
    series: Series<InSlots<S>>,
    begin: [Vec<InSlots<S>>; 3],
}

impl<S: Slots + Send> ColumnExpansion<S> for WholeSeries<S> {
    fn coordinates(&self) -> usize {
        self.series.coordinates()
    }

    fn order(&self) -> usize {
        self.series.order()
    }

    fn expand_up_to(&mut self, order: usize) {
        self.series.expand_up_to(order);
    }

    fn prepare(&mut self, _terms: &Terms<Number>, _begin: Begin, _known: Option<&MotionPowers>) {}

    #[inline(always)]
    fn expand(
        &mut self,
        terms: &Terms<Number>,
        (t, from_u, from_rest, from_rate): Begin,
        _known: Option<&MotionPowers>,
    ) {
        let Self { series, begin: [u, rest, rate] } = self;
        for c in 0..u.len() {
            u[c] = InSlots::load(&from_u[c]);
            rest[c] = InSlots::load(&from_rest[c]);
            rate[c] = InSlots::load(&from_rate[c]);
        }
        series.expand_terms(terms, t, u, rest, rate);
    }

    fn weakest(&self) -> Weakest {
        self.series.weakest()
    }

    fn value(&self, m: usize, coordinate: usize) -> f64 {
        self.series.rate[m * self.series.coordinates() + coordinate].value
    }

    #[inline(always)]
    fn slope(&self, m: usize, coordinate: usize) -> S {
        self.series.rate[m * self.series.coordinates() + coordinate].slope
    }
}

impl<S: Slots + Send> ColumnExpansion<S> for Tangent<S> {
    fn coordinates(&self) -> usize {
        self.coordinates()
    }

    fn order(&self) -> usize {
        self.order()
    }

    fn expand_up_to(&mut self, order: usize) {
        self.expand_up_to(order);
    }

    fn prepare(&mut self, terms: &Terms<Number>, begin: Begin, known: Option<&MotionPowers>) {
        self.expand_values(terms, begin, known);
    }

    #[inline(always)]
    fn expand(&mut self, terms: &Terms<Number>, begin: Begin, known: Option<&MotionPowers>) {
        self.expand(terms, begin, known);
    }

    fn weakest(&self) -> Weakest {
        self.weakest()
    }

    fn value(&self, m: usize, coordinate: usize) -> f64 {
        self.value(m, coordinate)
    }

    #[inline(always)]
    fn slope(&self, m: usize, coordinate: usize) -> S {
        self.slope(m, coordinate)
    }
}

#[derive(Debug)]
struct InColumns<S, E> {
    expansion: E,
    /// 1/(m+1).
    fractions: Vec<f64>,
    slots: PhantomData<S>,
}

struct ExpandColumns<'a, 'b, S, E> {
    columns: &'a mut InColumns<S, E>,
    terms: &'a Terms<'b, Number>,
    begin: Begin<'a>,
    known: Option<&'a MotionPowers>,
}

impl<S: Slots, E: ColumnExpansion<S>> SlotTask for ExpandColumns<'_, '_, S, E> {
    type Output = ();

    #[inline(always)]
    fn perform(self) {
        self.columns.expansion.expand(self.terms, self.begin, self.known);
    }
}

struct Shares<'a, S, E> {
    columns: &'a InColumns<S, E>,
    some: &'a [usize],
    u: &'a [Number],
    h: f64,
    shares: &'a mut Vec<f64>,
}

/// The larger ones of these and of a number's derivatives times a factor.
#[inline(always)]
fn note<S: Slots>(sizes: &mut [f64; LANES], slope: &[f64; LANES], factor: f64) {
    for lane in 0..S::COUNT {
        sizes[lane] = larger(sizes[lane], slope[lane].abs() * factor);
    }
}

impl<S: Slots, E: ColumnExpansion<S>> SlotTask for Shares<'_, S, E> {
    type Output = ();

    #[inline(always)]
    fn perform(self) {
        let Self { columns: InColumns { expansion, .. }, some, u, h, shares } = self;
        let (mut whole, mut power) = ([0.0; LANES], 1.0);
        if !u.is_empty() {
            for &c in some {
                note::<S>(&mut whole, &u[c].slope, 1.0 / h);
            }
        }
        for m in 0..=expansion.order() {
            if m < LEADING {
                for &c in some {
                    note::<S>(&mut whole, &expansion.slope(m, c).array(), power);
                }
                if m + 1 == LEADING {
                    for whole in &mut whole {
                        *whole = if *whole > 0.0 { 1.0 / *whole } else { *whole };
                    }
                }
            } else {
                let (mut sizes, mut share) = ([0.0; LANES], 0.0);
                for &c in some {
                    note::<S>(&mut sizes, &expansion.slope(m, c).array(), power);
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

struct Advance<'a, S, E> {
    columns: &'a InColumns<S, E>,
    order: usize,
    h: f64,
    own: &'a mut [Vec<Number>; 2],
}

impl<S: Slots, E: ColumnExpansion<S>> SlotTask for Advance<'_, S, E> {
    type Output = ();

    #[inline(always)]
    fn perform(self) {
        let Self { columns: InColumns { expansion, fractions, .. }, order, h, own: [u, rates] } = self;
        let (f, h) = (u.len(), S::splat(h));
        for c in 0..f {
            let (mut turn, mut speed) = (S::ZERO, S::ZERO);
            let mut m = order + 1;
            while m > 0 {
                m -= 1;
                let power = expansion.slope(m, c);
                turn = turn.mul_add(h, power.mul(S::splat(fractions[m])));
                speed = speed.mul_add(h, power);
            }
            u[c].slope = turn.mul_add(h, S::of(&u[c].slope)).array();
            rates[c].slope = speed.array();
        }
    }
}

impl<S: Slots + Send, E: ColumnExpansion<S>> Columns for InColumns<S, E> {
    fn coordinates(&self) -> usize {
        self.expansion.coordinates()
    }

    fn order(&self) -> usize {
        self.expansion.order()
    }

    fn expand_up_to(&mut self, order: usize) {
        self.expansion.expand_up_to(order);
    }

    fn expand(&mut self, terms: &Terms<Number>, begin: Begin, known: Option<&MotionPowers>) -> Weakest {
        self.expansion.prepare(terms, begin, known);
        S::perform(ExpandColumns { columns: self, terms, begin, known });
        self.expansion.weakest()
    }

    fn rate(&self, m: usize, coordinate: usize) -> Number {
        Number::new(self.expansion.value(m, coordinate), self.expansion.slope(m, coordinate).array())
    }

    fn shares(&self, some: &[usize], u: &[Number], h: f64, shares: &mut Vec<f64>) {
        shares.clear();
        S::perform(Shares { columns: self, some, u, h, shares });
    }

    fn advance(&self, order: usize, h: f64, own: &mut [Vec<Number>; 2]) {
        S::perform(Advance { columns: self, order, h, own });
    }
}
