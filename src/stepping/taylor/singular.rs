//! Singular positions: where all links lie in line the constraints lose their independence, and a step must
//! not end near it.
//!
//! Off the constraints the equations have a pole at the distance d of the singular position, and rounding off
//! the constraints grows as 1/d: a step size rule that heeds the pole ends ever closer to it, until noise
//! sends the motion out on another branch, smoothly.  So a step that begins near such a position goes
//! through: the share of the weakest constraint ([`rank`](crate::dynamics::rank)), which knows no masses, is
//! followed along the low powers of the series to its minimum and on to where it is what it was, and the step
//! ends there.  The series itself is that of a smooth motion; its late powers are noise times d^-k, so that
//! it is summed to its smallest power only.  The finer the tolerance, the closer such a step begins: its
//! powers are those of a shorter way, and noise in double-double lets it.
//!
//! Such a step is longer than the powers allow by themselves, so it is made only where it is confirmed: at
//! its end the constraints and the energy balance hold, and the series about its end leads back to its start.
//! Else the step is as any.  One that would end far closer to the singular position than it began ends before
//! it, so that the next can lead through; what the projection finds at its end is told.

use super::expansion::Expansion;
use crate::arithmetic::DoubleDouble;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::schur::NEAR;
use crate::dynamics::series::Coefficient;
use crate::dynamics::{Coordinates, Form, Mechanism, State, Time};

/// Powers the way through is looked for with.
const LOW: usize = 8;
/// Points it is looked for at, and the longest way over the step wanted.
const POINTS: usize = 96;
const LONGEST: f64 = 12.0;
/// On a way through a singular position the share falls below this part of what it was; elsewhere it is small
/// for other reasons, and the step is as any.
const FALL: f64 = 0.1;
/// A step is too close to a singular position where the share of the weakest constraint at its end is below
/// this part of what it was, or of what is near; closer than this the way out is the same as the way on.
const CLOSER: f64 = 1.0 / 16.0;
const CLOSEST: f64 = 1e-8;
/// Halvings of the time in which a shorter step is looked for.
const HALVINGS: usize = 12;
/// Largest share of the motion that the smallest power in such a step may have: [`ASTRAY`] times the
/// tolerance, so that passages are little worse than other steps, or what rounding leaves, one of these
/// numbers over the share of the weakest constraint, in doubles and in double-double; at most [`NOISE`].
/// Below rounding no passage is made: they are several times what it came to on parallelograms and kites.
const ROUNDING: [f64; 2] = [3e-14, 3e-28];
const NOISE: f64 = 1e-6;
/// The least tolerance that counts for that in doubles and in double-double: from 1e-12 to 1e-15 the way to a
/// passage of `four_bars` takes three times as many steps, whose rounding is as much as it gains.
const LEAST: [f64; 2] = [1e-12, 0.0];
/// Iterations in which a state in double-double is put back onto the constraints.
const ROUNDS: usize = 3;
/// Largest difference between the start and where the way back leads, over the tolerance; and the limits of
/// that \[rad\]: a passage a little off is better than steps that end at the singular position, and none is
/// worth more than this.
const ASTRAY: f64 = 1e3;
const LIMITS: [f64; 2] = [1e-6, 1e-4];
/// Parts of a passage at whose ends dry friction has to follow from the motion.
const WITH_FRICTION: usize = 32;

/// What to try where there is no way through.
pub const HINT: &str = "try another tolerance, --method dp8, or a start that does not lead through it";

/// What passages are looked for and confirmed with.
#[derive(Clone, Debug)]
pub struct SingularPassage<T: Coefficient> {
    kernel: Kernel<f64>,
    /// The series about a passage's end.
    back: Expansion<T>,
    end: State,
    /// What states in double-double are put back onto the constraints with, made when first asked for.
    exact: Option<Box<Kernel<DoubleDouble>>>,
}

impl<T: Coefficient> SingularPassage<T> {
    /// For the problem an expansion is of.
    pub fn new(mechanism: &Mechanism, coordinates: Coordinates, expansion: &Expansion<T>) -> Self {
        let back = Expansion::new(mechanism, coordinates, expansion.series().order(), false);
        Self { kernel: Kernel::new(mechanism), back, end: State::default(), exact: None }
    }

    /// How long a step must be to go through a singular position and come out as far from it as it is now;
    /// `None` where there is none ahead.
    pub fn length<P: Form + ?Sized>(
        &mut self,
        problem: &P,
        expansion: &Expansion<T>,
        state: &State,
        wanted: f64,
        tolerance: f64,
    ) -> Option<f64> {
        let mechanism = problem.mechanism();
        let (series, n) = (expansion.series(), mechanism.coordinates());
        let kernel = &mut self.kernel;
        let mut phi = vec![0.0; n];
        let mut verdict = |h: f64| {
            for (i, phi) in phi.iter_mut().enumerate() {
                let rates = (0..LOW.min(series.order()))
                    .rev()
                    .map(|m| series.rate[m * n + i].value() / (m + 1) as f64);
                *phi = state.y[i] + h * rates.fold(0.0, |sum, rate| sum * h + rate);
            }
            kernel.independence_at(mechanism, state.time, &phi, &state.y[n..2 * n])
        };
        let first = verdict(0.0);
        let here = first.share_since(&first);
        if here >= NEAR {
            return None;
        }
        // From well inside the step on: what comes back sooner needs no jump.
        let (mut least, mut fell) = (here, false);
        for point in 1..=POINTS {
            let h = LONGEST * wanted * (point as f64 / POINTS as f64);
            let now = verdict(h).share_since(&first);
            if now.is_nan() {
                return None;
            }
            if now < least {
                (least, fell) = (now, true);
            } else if fell && now >= here {
                let is_summed = expansion.smallest(h) < noise::<T>(tolerance, here);
                return (h > wanted && least < FALL * here && is_summed).then_some(h);
            } else if !fell && now > here {
                return None;
            }
        }
        None
    }

    /// Of a step from `start` to the time `end` that ends far closer to a singular position than it began,
    /// the end of that part which leads to where passages are looked for, or closer by a little; `inside`
    /// writes states inside the step.
    pub fn before(
        &mut self,
        mechanism: &Mechanism,
        start: &State,
        end: Time,
        inside: &mut dyn FnMut(Time, &mut State),
    ) -> Option<Time> {
        let n = mechanism.coordinates();
        let Self { kernel, end: state, .. } = self;
        let mut share = |h: f64| {
            inside(start.time + h, state);
            kernel.independence_at(mechanism, state.time, &state.y[..n], &state.y[n..2 * n]).share()
        };
        let h = (end - start.time).hi;
        let here = share(0.0).min(NEAR);
        let last = share(h);
        if here < CLOSEST || last >= CLOSER * here {
            return None;
        }
        let [mut off, mut near] = [0.0, h];
        for _ in 0..HALVINGS {
            let middle = 0.5 * (off + near);
            *(if share(middle) < 0.5 * here { &mut near } else { &mut off }) = middle;
        }
        Some(start.time + near)
    }

    /// Puts a state in double-double back onto all constraints, as no projection does there: what it is off
    /// them grows as the inverse of the distance from a singular position, and with every passage.
    pub fn put_back(&mut self, mechanism: &Mechanism, state: &mut State) {
        let n = mechanism.coordinates();
        let kernel = self.exact.get_or_insert_with(|| Box::new(Kernel::new(mechanism)));
        for round in 0..=ROUNDS {
            let unknowns: Vec<_> = (0..2 * n).map(|i| state.unknown(i)).collect();
            let (phi, omega) = unknowns.split_at(n);
            kernel.linearise_at::<0>(mechanism, state.time, phi, omega);
            if kernel.weakest.share < CLOSEST {
                return;
            }
            // Rates come last, where the position is.
            let from = if round == ROUNDS { n } else { 0 };
            for r in 0..mechanism.constraints.len() {
                kernel.multiplier[r] =
                    if from == n { kernel.row_rate(r, omega) } else { kernel.rows[r].position };
            }
            kernel.solve_rows();
            kernel.multiplier_accelerations();
            for (k, &change) in kernel.load.iter().enumerate() {
                let corrected = unknowns[from + k] - change;
                (state.y[from + k], state.low[from + k]) = (corrected.hi, corrected.lo);
            }
        }
    }

    /// True where a step of `h` \[s\], as it is summed, keeps the constraints and the energy balance, and the
    /// series about its end leads back.
    pub fn is_confirmed<P: Form + ?Sized>(
        &mut self,
        problem: &P,
        expansion: &Expansion<T>,
        state: &State,
        h: f64,
        tolerance: f64,
    ) -> bool {
        let mechanism = problem.mechanism();
        if !self.friction_follows(mechanism, expansion, state, h) {
            return false;
        }
        let Self { kernel, back, end, .. } = self;
        let n = mechanism.coordinates();
        let limit = (ASTRAY * tolerance).clamp(LIMITS[0], LIMITS[1]);
        end.clone_from(state);
        expansion.go(end, DoubleDouble::from(h));
        end.time = state.time + h;
        end.wrap();
        let balance = |kernel: &mut Kernel<f64>, state: &State| {
            kernel.unit_vectors::<0>(mechanism, &state.y[..n]);
            let energy = mechanism.energy_facing::<f64, 0>(kernel, &state.y[..n], &state.y[n..2 * n]).total();
            energy - state.y.get(2 * n).copied().unwrap_or(0.0)
        };
        let lost = balance(kernel, end) - balance(kernel, state);
        let is_energy_kept = lost.abs() <= limit * mechanism.energy_scale;
        let off = kernel.independence_at(mechanism, end.time, &end.y[..n], &end.y[n..2 * n]).share();
        let is_kept = off.is_finite() && kernel.violation(mechanism) <= limit;
        if !(is_energy_kept && is_kept) {
            return false;
        }
        back.expand(mechanism, end);
        back.sum_to_smallest(h);
        let mut start = end.clone();
        back.go(&mut start, DoubleDouble::from(-h));
        let fastest = state.y[n..2 * n].iter().fold(1.0, |most: f64, rate| most.max(rate.abs()));
        (0..2 * n).all(|i| {
            let size = if i < n { 1.0 } else { fastest };
            let off = (start.unknown(i) - state.unknown(i)).hi;
            // A turn may lie between the two.
            let off =
                if i < mechanism.bodies.len() { libm::remainder(off, std::f64::consts::TAU) } else { off };
            off.abs() <= limit * size
        })
    }

    /// True where no surfaces jam ([`JAMS`](crate::dynamics::friction::paradox::JAMS)) on the way through:
    /// the determinant of the equations of friction keeps its sign.
    fn friction_follows(
        &mut self,
        mechanism: &Mechanism,
        expansion: &Expansion<T>,
        state: &State,
        h: f64,
    ) -> bool {
        if mechanism.sliding().next().is_none() {
            return true;
        }
        let Self { kernel, end, .. } = self;
        let n = mechanism.coordinates();
        (0..=WITH_FRICTION).all(|point| {
            let share = point as f64 / WITH_FRICTION as f64;
            end.clone_from(state);
            expansion.go(end, DoubleDouble::from(share * h));
            end.time = state.time + share * h;
            end.wrap();
            let [phi, omega] = [&end.y[..n], &end.y[n..2 * n]];
            kernel.accelerations(mechanism, end.time, phi, omega, Bias::default());
            // In the singular position itself there are no equations.
            kernel.regularity > 0.0 || kernel.weakest.share < CLOSEST
        })
    }
}

/// Largest share of the motion that the smallest power may have at a tolerance, where the weakest constraint
/// has this share.
fn noise<T: Coefficient>(tolerance: f64, share: f64) -> f64 {
    let kind = usize::from(!T::IS_PLAIN);
    (ASTRAY * tolerance.max(LEAST[kind])).max(ROUNDING[kind] / share).min(NOISE)
}

/// True where a singular position may be ahead.
pub fn is_near<T: Coefficient, P: Form + ?Sized>(problem: &P, expansion: &Expansion<T>) -> bool {
    expansion.series().weakest().share < NEAR && problem.coordinates() == Coordinates::All
}
