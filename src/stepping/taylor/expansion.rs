//! The series of any mechanism about a step's start, and how far it carries.

use super::super::event::FirstEvent;
use super::super::search::PowerSeries;
use super::{JUDGES, LEADING, step_size};
use crate::arithmetic::sum::larger;
use crate::arithmetic::{Complex, DoubleDouble};
use crate::dynamics::series::polynomial::{integral, tail};
use crate::dynamics::series::{Coefficient, Series};
use crate::dynamics::{Coordinates, Mechanism, State, Time};

/// The step where every power but the first vanishes, in units of time.
const LONGEST: f64 = 1e9;
/// What a step is cut by where the loss in friction converges too slowly, and how many times.
const CUT: f64 = 0.9;
const MOST_CUTS: usize = 100;
/// How many times the largest of so many powers in a row stands for what is left out.
const SEVERAL: f64 = 10.0;

/// Series and what goes into them.
#[derive(Clone, Debug)]
pub struct Expansion<T: Coefficient> {
    mechanism: Mechanism,
    coordinates: Coordinates,
    series: Series<T>,
    /// The first powers in double-double, where the rest goes on from these.
    first: Option<Box<Series<DoubleDouble>>>,
    /// All powers in double-double, where doubles have too few digits for light members or long levers; made
    /// when first asked for.
    whole: Option<Box<Series<DoubleDouble>>>,
    /// Powers of the rates that are summed: all, or those before noise takes over in a step through a
    /// singular position.
    summed: usize,
    /// The same of the powers of the work, whose noise takes over elsewhere.
    summed_work: usize,
    u: [Vec<T>; 3],
    exact: [Vec<DoubleDouble>; 3],
}

impl<T: Coefficient> Expansion<T> {
    /// Series of a mechanism up to a power of the rates; `extended`: the first ones in double-double.
    pub fn new(mechanism: &Mechanism, coordinates: Coordinates, order: usize, extended: bool) -> Self {
        let series = Series::new(mechanism, coordinates, order);
        let f = series.coordinates();
        Self {
            mechanism: mechanism.clone(),
            coordinates,
            summed: order + 1,
            summed_work: order + 1,
            first: (extended && T::IS_PLAIN).then(|| Box::new(Series::new(mechanism, coordinates, LEADING))),
            whole: None,
            u: std::array::from_fn(|_| vec![T::ZERO; f]),
            exact: std::array::from_fn(|_| vec![DoubleDouble::default(); f]),
            series,
        }
    }

    /// True where it was made for all these.
    pub fn is_for(
        &self,
        mechanism: &Mechanism,
        coordinates: Coordinates,
        order: usize,
        extended: bool,
    ) -> bool {
        (self.series.order(), self.coordinates, self.first.is_some())
            == (order, coordinates, extended && T::IS_PLAIN)
            && self.mechanism == *mechanism
    }

    /// The series themselves.
    pub fn series(&self) -> &Series<T> {
        &self.series
    }

    /// Expands the motion about a state.
    pub fn expand(&mut self, mechanism: &Mechanism, state: &State) {
        let f = self.series.coordinates();
        self.sum_all();
        let [u, rest, rate] = &mut self.u;
        for i in 0..f {
            (u[i], rest[i]) = T::split(state.unknown(i));
            rate[i] = T::split(state.unknown(f + i)).0;
        }
        let [exact, none, exact_rate] = &mut self.exact;
        if let Some(first) = &mut self.first {
            for i in 0..f {
                (exact[i], exact_rate[i]) = (state.unknown(i), state.unknown(f + i));
            }
            first.expand(mechanism, state.time, exact, none, exact_rate);
            self.series.carry_on(mechanism, state.time, u, rest, rate, first);
        } else {
            self.series.expand(mechanism, state.time, u, rest, rate);
        }
        if T::IS_PLAIN && self.series.weakest().is_delicate {
            self.expand_wholly(mechanism, state);
        }
    }

    /// Rounds powers found in double-double.
    #[cold]
    fn expand_wholly(&mut self, mechanism: &Mechanism, state: &State) {
        let (f, order) = (self.series.coordinates(), self.series.order());
        let whole =
            self.whole.get_or_insert_with(|| Box::new(Series::new(mechanism, self.coordinates, order)));
        let [exact, none, exact_rate] = &mut self.exact;
        for i in 0..f {
            (exact[i], exact_rate[i]) = (state.unknown(i), state.unknown(f + i));
        }
        whole.expand(mechanism, state.time, exact, none, exact_rate);
        let [u, rest, rate] = &self.u;
        self.series.carry_on(mechanism, state.time, u, rest, rate, whole);
    }

    /// The step at which the last powers fall below the tolerance \[s\], those of the unit vectors too where
    /// `with_vectors`; not a number where one of them is.
    pub fn wanted(&self, tolerance: f64, with_vectors: bool) -> f64 {
        let (order, f) = (self.series.order(), self.series.coordinates());
        let units = self.mechanism.units;
        let angles = if self.coordinates == Coordinates::All {
            self.mechanism.bodies.len()
        } else {
            self.mechanism.partition.turning()
        };
        let largest = |k: usize| {
            let rates = &self.series.rate[k * f..(k + 1) * f];
            let turning = rates[..angles].iter().fold(0.0, |most, rate| larger_size(most, rate.value()));
            rates[angles..].iter().fold(turning, |most, rate| larger_size(most, rate.value() / units.length))
                * units.time
        };
        let last: [f64; JUDGES] = std::array::from_fn(|i| largest(order - i));
        if last[0].is_nan() {
            return f64::NAN;
        }
        let mut least = f64::INFINITY;
        for (i, &size) in last.iter().enumerate() {
            least = least.min(minus_log2(size) / (order - i) as f64);
        }
        least = least.min(self.work_allows()).min(self.pressures_allow());
        if with_vectors {
            let n = self.mechanism.coordinates();
            for k in order + 2 - JUDGES..=order + 1 {
                let vectors = &self.series.z[k * n..(k + 1) * n];
                let of = |vectors: &[Complex<T>]| {
                    vectors
                        .iter()
                        .fold(0.0, |most, z| larger_size(larger_size(most, z.re.value()), z.im.value()))
                };
                let (turning, sliding) = vectors.split_at(self.mechanism.bodies.len());
                // No wall sees the angles that stand for integrals.
                let turning = &turning[..self.mechanism.own_bodies().len()];
                let size = larger(of(turning), of(sliding) / units.length);
                least = least.min(minus_log2(size) / k as f64);
            }
        }
        let step = libm::exp2(least + libm::log2(tolerance) / (order + 1) as f64).min(LONGEST * units.time);
        self.loss_converges(tolerance, step_size::falling(tolerance, order, (&last, largest), step))
    }

    /// The same of the work over the energy scale: the power of motors, dampers and applied forces may fall
    /// more slowly than the rates, and where all is driven there are no rates.  So may that of dry friction
    /// alone, whose force has the root of a normal force in it, and which motors make up for.
    fn work_allows(&self) -> f64 {
        let (order, scale) = (self.series.order(), self.mechanism.energy_scale);
        let allows = |powers: &[T]| {
            let size = |k: usize| (powers[k - 1].value() / (k as f64 * scale)).abs();
            allowed_by(order + 1 - JUDGES..order + 1, size)
        };
        let lost = self.series.lost();
        let all = allows(&self.series.power);
        if lost.is_empty() { all } else { all.min(allows(lost)) }
    }

    /// Of a step \[s\] as much as leaves what the powers of the loss in dry friction leave out below the
    /// tolerance, taken to fall on as they do before.  Next to the branch points of a normal force its last
    /// powers are small and hardly fall, or rise.
    fn loss_converges(&self, tolerance: f64, mut step: f64) -> f64 {
        let (order, lost) = (self.series.order(), self.series.lost());
        if lost.is_empty() {
            return step;
        }
        for _ in 0..MOST_CUTS {
            let size = |k: usize| (lost[k - 1].value() * libm::pow(step, k as f64) / k as f64).abs();
            let most =
                |to: usize| (to - JUDGES..to).map(size).fold(0.0, larger) / self.mechanism.energy_scale;
            let (before, last) = (most(order + 1 - JUDGES), most(order + 1));
            // last (q + q² + …), q = last / before, of all powers and several steps next to one such point.
            if last.is_nan() || SEVERAL * last * last <= tolerance * (before - last) {
                break;
            }
            step *= CUT;
        }
        step
    }

    /// The same of the forces on points held at walls, whose zeros let them go: of a mechanism at rest they
    /// change with the load, and beside dry friction their series has circles of its own.
    fn pressures_allow(&self) -> f64 {
        let order = self.series.order();
        let allows = |place: usize| allowed_by(order - JUDGES..order, |k| self.pressure(place, k).abs());
        (0..self.mechanism.held.len()).map(allows).fold(f64::INFINITY, f64::min)
    }

    /// Power `m` of the force on a point that is held at a wall, by its place among those that are, over its
    /// contact's own \[1/s^m\].
    pub fn pressure(&self, place: usize, m: usize) -> f64 {
        let (mechanism, multipliers) = (&self.mechanism, self.series.multipliers(m));
        // The rows of the contacts that are held are the last ones, but for those of what sticks.
        let from_end = mechanism.held.len() - place + mechanism.sticking();
        let force = multipliers.iter().nth_back(from_end - 1);
        force.map_or(f64::NAN, |force| -force.value() / mechanism.contacts[mechanism.held[place]].force)
    }

    /// Sums no further than to the power that is the smallest at `h` \[s\]: of the work where two of its
    /// neighbours are, as one alone may be zero by symmetry.
    pub fn sum_to_smallest(&mut self, h: f64) {
        let order = self.series.order();
        let smallest = (1..=order).min_by(|&a, &b| self.size(a, h).total_cmp(&self.size(b, h)));
        self.summed = smallest.unwrap_or(order) + 1;
        let work: Vec<f64> = (self.series.power.iter().zip(0..))
            .map(|(power, m)| power.value().abs() * libm::pow(h, f64::from(m)))
            .collect();
        let size = |m: usize| larger(work[m], work[m + 1]);
        let smallest = (1..order - 1).min_by(|&a, &b| size(a).total_cmp(&size(b)));
        self.summed_work = smallest.map_or(order, |m| m + 1);
    }

    /// Sums all powers again.
    pub fn sum_all(&mut self) {
        let all = self.series.order() + 1;
        (self.summed, self.summed_work) = (all, all);
    }

    /// The smallest power at `h` \[s\] over the largest.
    pub fn smallest(&self, h: f64) -> f64 {
        let sizes = (0..=self.series.order()).map(|m| self.size(m, h));
        let (least, most) = sizes.fold((f64::INFINITY, 0.0), |(least, most): (f64, f64), size| {
            (least.min(size), larger(most, size))
        });
        least / most
    }

    /// The largest share of power `m` in a rate at `h` \[s\].
    fn size(&self, m: usize, h: f64) -> f64 {
        let f = self.series.coordinates();
        let largest = self.series.rate[m * f..(m + 1) * f]
            .iter()
            .fold(0.0, |most, rate| larger_size(most, rate.value()));
        largest * libm::pow(h, m as f64)
    }

    /// Acceleration of coordinate `i` by the series `h` \[s\] after its start \[rad/s², m/s²\].
    pub fn acceleration(&self, i: usize, h: f64) -> f64 {
        let f = self.series.coordinates();
        let known = if self.first.is_some() { LEADING + 1 } else { 1 };
        let later = (known..self.summed).rev();
        let sum = later.fold(0.0, |sum, m| sum * h + m as f64 * self.series.rate[m * f + i].value());
        let sum = sum * libm::pow(h, known as f64 - 1.0);
        let first = self.first.as_ref().map_or(0.0, |first| {
            (1..=LEADING).rev().fold(0.0, |sum, m| sum * h + m as f64 * first.rate[m * f + i].hi)
        });
        sum + first
    }

    /// Takes a state from where the series was expanded on by `h` \[s\].
    pub fn go(&self, state: &mut State, h: Time) {
        let (f, series) = (self.series.coordinates(), &self.series);
        let (rates, powers) =
            (&series.rate[..self.summed * f], &series.power[..self.summed_work.min(series.power.len())]);
        let step = T::split(h).0;
        // Powers of the rates that are in `first` already, and powers of the work.
        let known = if self.first.is_some() { LEADING + 1 } else { 0 };
        let start = known.max(1);
        for i in 0..f {
            let mut angle = integral(rates, i, f, known, step).double_double();
            let mut rate = tail(rates, i, f, start, step).double_double();
            match &self.first {
                Some(first) => {
                    angle += integral(&first.rate, i, f, 0, h);
                    rate += tail(&first.rate, i, f, 1, h);
                }
                None if T::IS_PLAIN => angle = angle + state.low[f + i] * h.hi,
                None => {}
            }
            for (at, increment) in [(i, angle), (f + i, rate)] {
                add(state, at, increment);
            }
        }
        if state.y.len() > 2 * f {
            let mut work = integral(powers, 0, 1, known.saturating_sub(1), step).double_double();
            if let Some(first) = &self.first {
                work += integral(&first.power, 0, 1, 0, h);
            }
            add(state, 2 * f, work);
        }
        if !series.lost().is_empty() {
            let lost = &series.lost()[..self.summed_work.min(series.lost().len())];
            add(state, 2 * f + 2, integral(lost, 0, 1, 0, step).double_double());
        }
    }

    /// Of `h` \[s\] what comes before the force that presses a hinge or rail that slides passes zero.
    pub fn until_reversal(&self, h: f64) -> f64 {
        let mut found = FirstEvent::Nothing;
        for mut powers in self.series.pressing() {
            let scale = powers.iter().rev().fold(0.0, |sum: f64, power| sum * h + power.abs());
            if !(scale > 0.0 && scale.is_finite()) {
                continue;
            }
            powers.iter_mut().for_each(|power| *power /= scale);
            // Rounding, where it begins at zero.
            powers[0] = powers[0].max(0.0);
            found = found.or_earlier(0, &PowerSeries { powers: &powers, end: found.end(h) }, h);
        }
        found.end(h)
    }

    /// The first coordinate whose series is not finite, as far as there is one.
    pub fn lost(&self) -> usize {
        let f = self.series.coordinates();
        self.series.rate.iter().position(|rate| !rate.value().is_finite()).map_or(0, |at| at % f.max(1))
    }
}

fn add(state: &mut State, i: usize, increment: DoubleDouble) {
    let sum = state.unknown(i) + increment;
    (state.y[i], state.low[i]) = (sum.hi, sum.lo);
}

/// The larger of a magnitude and that of a value; not a number if either is not.
pub(super) fn larger_size(most: f64, value: f64) -> f64 {
    larger(value.abs(), most)
}

/// -log2 from the bits of a positive double, within 0.09; so large for zero that it never counts.
pub(super) fn minus_log2(size: f64) -> f64 {
    if size == 0.0 {
        1e9
    } else {
        (1_f64.to_bits() as i64 - size.to_bits() as i64) as f64 / (1_u64 << 52) as f64
    }
}

/// log2 of the step at which the last powers of these sizes are one; what is not a number does not count.
fn allowed_by(powers: std::ops::Range<usize>, size: impl Fn(usize) -> f64) -> f64 {
    powers.fold(f64::INFINITY, |least, k| {
        let size = size(k);
        if size.is_nan() { least } else { least.min(minus_log2(size) / k as f64) }
    })
}
