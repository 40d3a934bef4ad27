//! Eight motions of mechanisms with one structure as one series: numbers with a lane for each.
//!
//! No operation mixes lanes, so that a motion has the bits it would have beside any others; the vectors of
//! the processor and plain code give the same ones.

mod constants;
mod factor;
mod landing;
mod number;

use self::constants::{LaneConstants, TermSet};
pub use self::constants::{OwnNumbers, are_equal};
use self::landing::{ProjectLanes, Regularity};
use self::number::InLanes;
use super::Series;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::{EightLanes, SlotTask, Vectors, WideCode};
use crate::arithmetic::{Complex, Scalar};
use crate::dynamics::{Coordinates, Mechanism, Time};
use std::fmt::Debug;

/// The time of each lane.
pub type Times = [Time; LANES];

/// Motions at the end of a step, about to be brought back onto the constraint equations.
#[derive(Debug)]
pub struct StepEnds<'a> {
    /// Angles and rates (2f), and what they leave out.
    pub high: &'a mut [Octet],
    /// See [`high`](Self::high).
    pub low: &'a mut [Octet],
    /// Which lanes there are motions in; the others stay where they are.
    pub is_going: [bool; LANES],
    /// What rates count as at least \[rad/s\].
    pub unit: Octet,
    /// What places and their rates count as in angles \[1/m\].
    pub per_length: Octet,
}

/// Powers of eight motions.
pub trait SeriesInLanes: Debug {
    /// Puts the numbers of a mechanism that is [alike](OwnNumbers::are_alike) into a lane.
    fn take_in(&mut self, lane: usize, own: &OwnNumbers);

    /// Expands the motions of a mechanism from their times, angles (leading parts and rests) and rates.
    fn expand(&mut self, mechanism: &Mechanism, times: Times, begin: [&[Octet]; 3]);

    /// True where the constraint equations of a lane are independent at the start, and doubles are enough for
    /// them: elsewhere its powers are of no use.
    fn is_regular(&self, lane: usize) -> bool;

    /// Brings motions back onto the constraint equations; tells which are on them then.  Of the powers,
    /// [`rates`](Self::rates) and [`power`](Self::power) stay as they are.
    fn land(&mut self, mechanism: &Mechanism, times: Times, landing: StepEnds) -> [bool; LANES];

    /// Powers 0 … P of the coordinates' rates \[rad/s^(m+1)\], coordinate by coordinate ((P+1) × f).
    fn rates(&self) -> &[Octet];

    /// Powers 0 … P-1 of the power of motors, dampers and applied forces \[W/s^m\].
    fn power(&self) -> &[Octet];

    /// Power `m` of a body's rate in a lane \[rad/s^(m+1)\].
    fn rate_of(&self, m: usize, body: usize, lane: usize) -> f64;

    /// The unit vector of a body at the start in a lane.
    fn unit_of(&self, body: usize, lane: usize) -> Complex<f64>;

    /// The angle of a body at the start in a lane, in [-π, π] \[rad\].
    fn angle_of(&self, body: usize, lane: usize) -> f64 {
        let Complex { re, im } = self.unit_of(body, lane);
        Scalar::atan2(im, re)
    }
}

/// Room for the series of eight motions of a mechanism of bodies alone, in all angles where there are rows
/// with multipliers, else in those that motors leave.
///
/// All lanes have its numbers `own` to begin with.
pub fn in_lanes(
    mechanism: &Mechanism,
    own: &OwnNumbers,
    order: usize,
    vectors: Vectors,
) -> Box<dyn SeriesInLanes> {
    vectors.run(NewSeriesInLanes { mechanism, own, order })
}

struct NewSeriesInLanes<'a> {
    mechanism: &'a Mechanism,
    own: &'a OwnNumbers,
    order: usize,
}

impl WideCode for NewSeriesInLanes<'_> {
    type Output = Box<dyn SeriesInLanes>;

    #[inline(always)]
    fn run<W: EightLanes>(self) -> Box<dyn SeriesInLanes> {
        let constants = LaneConstants::of(self.own);
        let terms = constants.terms::<W>(self.mechanism);
        let coordinates = match self.mechanism.has_multipliers() {
            true => Coordinates::All,
            false => Coordinates::Independent,
        };
        let series = Series::of_terms(&terms.terms(self.mechanism), coordinates, self.order);
        let f = series.coordinates();
        let is_asked = series.is_tied || !self.mechanism.contacts.is_empty();
        let room = || vec![InLanes::ZERO; f];
        let mut regularity = Regularity::new(series.rows.count(), f);
        if let Some(measures) = &self.own.measures {
            (0..LANES).for_each(|lane| regularity.take_in(lane, measures));
        }
        Box::new(WholeLanes {
            begin: [room(), room(), room()],
            rates: vec![Octet::default(); (self.order + 1) * f],
            power: vec![Octet::default(); self.order],
            // Where they are not the coordinates' rates, or asked for at every step.
            omega: vec![Octet::default(); if is_asked { series.omega.len() } else { 0 }],
            units: vec![[Octet::default(); 2]; series.elements],
            regularity,
            constants,
            are_others: false,
            terms,
            series,
        })
    }
}

/// Series, where they begin, and what is asked of them.
#[derive(Debug)]
struct WholeLanes<W: EightLanes> {
    constants: LaneConstants,
    /// True where the terms and the series still have others.
    are_others: bool,
    terms: TermSet<InLanes<W>>,
    series: Series<InLanes<W>>,
    begin: [Vec<InLanes<W>>; 3],
    rates: Vec<Octet>,
    power: Vec<Octet>,
    /// Rates of the bodies, where they are not those of the coordinates or asked for at every step.
    omega: Vec<Octet>,
    /// Unit vectors of the elements at the start.
    units: Vec<[Octet; 2]>,
    regularity: Regularity,
}

struct ExpandLanes<'a, 'b, W: EightLanes> {
    whole: &'a mut WholeLanes<W>,
    mechanism: &'b Mechanism,
    times: Times,
    begin: [&'a [Octet]; 3],
}

impl<W: EightLanes> SlotTask for ExpandLanes<'_, '_, W> {
    type Output = ();

    #[inline(always)]
    fn perform(self) {
        let WholeLanes {
            series, begin: [u, rest, rate], rates, power, omega, units, regularity, terms, ..
        } = self.whole;
        let terms = &terms.terms(self.mechanism);
        let [from_u, from_rest, from_rate] = self.begin;
        for c in 0..u.len() {
            u[c] = InLanes(W::of(&from_u[c].0));
            rest[c] = InLanes(W::of(&from_rest[c].0));
            rate[c] = InLanes(W::of(&from_rate[c].0));
        }
        series.expand_terms(terms, self.times, u, rest, rate);
        if !series.rows.is_empty() {
            regularity.look(series, &terms.tree.diagonal);
        }
        for i in 0..rates.len() {
            rates[i] = Octet(series.rate[i].0.array());
        }
        for m in 0..power.len() {
            power[m] = Octet(series.power[m].0.array());
        }
        for i in 0..omega.len() {
            omega[i] = Octet(series.omega[i].0.array());
        }
        for i in 0..units.len() {
            let z = series.z[i];
            units[i] = [Octet(z.re.0.array()), Octet(z.im.0.array())];
        }
    }
}

impl<W: EightLanes> SeriesInLanes for WholeLanes<W> {
    fn expand(&mut self, mechanism: &Mechanism, times: Times, begin: [&[Octet]; 3]) {
        if std::mem::take(&mut self.are_others) {
            self.terms = self.constants.terms(mechanism);
            self.series.renew(&self.terms.terms(mechanism));
        }
        W::perform(ExpandLanes { whole: self, mechanism, times, begin });
    }

    fn take_in(&mut self, lane: usize, own: &OwnNumbers) {
        self.are_others |= self.constants.put(lane, own);
        if let Some(measures) = &own.measures {
            self.regularity.take_in(lane, measures);
        }
    }

    fn is_regular(&self, lane: usize) -> bool {
        self.series.rows.is_empty() || self.regularity.holds(lane)
    }

    fn land(&mut self, mechanism: &Mechanism, times: Times, landing: StepEnds) -> [bool; LANES] {
        let Self { series, begin, regularity, terms, .. } = self;
        W::perform(ProjectLanes { series, regularity, begin, terms: &terms.terms(mechanism), times, landing })
    }

    fn rates(&self) -> &[Octet] {
        &self.rates
    }

    fn power(&self) -> &[Octet] {
        &self.power
    }

    fn rate_of(&self, m: usize, body: usize, lane: usize) -> f64 {
        let of = if self.omega.is_empty() { &self.rates } else { &self.omega };
        of[m * self.series.elements + body].0[lane]
    }

    fn unit_of(&self, body: usize, lane: usize) -> Complex<f64> {
        let [re, im] = &self.units[body];
        Complex::new(re.0[lane], im.0[lane])
    }
}
