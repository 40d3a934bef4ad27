//! The steps themselves, a stage a lane.

mod scratch;
use super::newton::Newton;
use super::sums::{columns, combine, largest, shifted, sum_of};
use super::tableau::{GaussTableau, lane};
use super::{Gauss, IDLE_SWEEPS, MOST_SWEEPS, NEARLY, NEWTON_STEPS, SETTLED};
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::{self, Code, Lanes, Portable};
use crate::arithmetic::sum::{fused, two_sum};
use crate::dynamics::{OdeSystem, Points, State, Time};
use crate::stepping::{Statistics, StepError};

/// Scratch space of d unknowns.
#[derive(Clone, Debug, Default)]
pub(super) struct GaussScratch {
    /// The step the next two were formed for \[s\].
    pub step: f64,
    /// h b_j, each rounded once; zero in lanes without a stage \[s\].
    span: Octet,
    /// c_j h \[s\].
    offset: [Time; LANES],
    /// Stages and their rates.
    pub points: Points,
    /// L, and what it leaves out (d, d).
    increment: Vec<Octet>,
    increment_low: Vec<Octet>,
    /// Largest change of each unknown in the last iteration, and the least so far (d, d).
    change: Vec<f64>,
    least: Vec<f64>,
    /// The largest change of the last iteration in plain doubles, and the largest magnitude among the stages
    /// then (d, d): what convergence is judged by.
    pub rest: Vec<f64>,
    pub size: Vec<f64>,
    /// The sum of all increments (d).
    pub total: Vec<DoubleDouble>,
    /// How many unknowns, from the first, tell how fast the iteration contracts.
    pub judged: usize,
    /// True where the field has been found to have no Jacobian.
    is_sweeping: bool,
    /// Steps by Newton's method before iterations are tried again, this one counted; zero where it was made
    /// by iterations.
    newton_left: f64,
}

/// Sweeps before the contraction is looked at, and the change \[rad\] below which it is one of rounding.
const EARLY: usize = 8;
const NOISE: f64 = 1e-9;
/// Newton iterations after which a step is given up.
const MOST_ITERATIONS: usize = 60;

/// One step about to be taken.
struct GaussStep<'a> {
    tableau: &'a GaussTableau,
    scratch: &'a mut GaussScratch,
    /// Evaluations after the last iteration that carry what doubles leave out.
    exact: u32,
    newton: &'a mut Option<Box<Newton>>,
    slow: f64,
    /// How many unknowns, from the first, are angles.
    angles: usize,
}

/// One step of `scratch.step`.
pub(super) fn step<F: OdeSystem + ?Sized>(
    gauss: &mut Gauss,
    problem: &mut F,
    state: &mut State,
    statistics: &mut Statistics,
) -> Result<(), StepError> {
    statistics.check(gauss.label(), state.time.hi, gauss.scratch.step)?;
    let Gauss { tableau, scratch, exact, newton, slow, portable, .. } = &mut *gauss;
    let exact = if problem.has_exact_rates() { *exact } else { 0 };
    let mut step = GaussStep { tableau, scratch, exact, newton, slow: *slow, angles: problem.angles() };
    lanes::run(Take { step: &mut step, problem: &mut Of(problem), state, statistics }, *portable);
    if gauss.scratch.newton_left == NEWTON_STEPS {
        gauss.follow(problem, state)?;
    }
    gauss.check(problem, state)?;
    gauss.scratch.commit(state, gauss.tableau.nodes.len());
    statistics.steps += 1;
    statistics.newton_steps += u64::from(gauss.scratch.newton_left > 0.0);
    Ok(())
}

/// What a step asks of a field.
trait StageRates {
    fn rates(&mut self, points: &mut Points);
    fn exact_rates(&mut self, points: &mut Points);
    fn jacobian(&mut self, t: Time, y: &[f64], jacobian: &mut [f64]) -> bool;
}

/// A field behind a table of functions, so that the steps are compiled once and not with every field.
struct Of<'a, F: ?Sized>(&'a mut F);

impl<F: OdeSystem + ?Sized> StageRates for Of<'_, F> {
    fn rates(&mut self, points: &mut Points) {
        self.0.rates(points);
    }

    fn exact_rates(&mut self, points: &mut Points) {
        self.0.exact_rates(points);
    }

    fn jacobian(&mut self, t: Time, y: &[f64], jacobian: &mut [f64]) -> bool {
        self.0.jacobian(t, y, jacobian)
    }
}

/// One step but its acceptance.
struct Take<'a, 'b> {
    step: &'a mut GaussStep<'b>,
    problem: &'a mut dyn StageRates,
    state: &'a State,
    statistics: &'a mut Statistics,
}

impl Code for Take<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.step.take::<L>(self.problem, self.state, self.statistics);
    }
}

impl GaussStep<'_> {
    /// All of one step but its acceptance.
    #[inline(always)]
    fn take<L: Lanes>(&mut self, problem: &mut dyn StageRates, state: &State, statistics: &mut Statistics) {
        self.predict::<L>(state);
        // Beside the increments there is a number where the last step was made by Newton's method.
        let (known, all) = (state.memory.len(), self.tableau.nodes.len() * state.y.len() + 1);
        let left = if known == all + 1 { state.memory[all] - 1.0 } else { 0.0 };
        self.scratch.newton_left = left;
        let has_changed = left > 0.0 && self.differentiate(problem, state, statistics)
            || !self.iteration::<L>(problem, state, statistics) && {
                self.scratch.newton_left = NEWTON_STEPS;
                true
            };
        if has_changed {
            self.solve::<L>(problem, state, statistics);
            if self.scratch.unsettled(self.angles).is_none() {
                self.scratch.sum_exactly::<L>();
                return;
            }
            // A Jacobian that turns far within the step does worse than iterations.
            self.scratch.newton_left = 0.0;
            self.scratch.is_sweeping = true;
            self.predict::<L>(state);
            self.iteration::<L>(problem, state, statistics);
            self.scratch.is_sweeping = false;
        }
        self.scratch.judge();
        self.scratch.points.rate_low.fill(Octet::default());
        self.multiply_low::<L>();
        if self.exact > 0 {
            self.refine::<L>(problem, state, statistics);
        }
        self.scratch.sum_exactly::<L>();
    }

    /// Stages from the last step's collocation polynomial, or all at y where there is none.
    #[inline(always)]
    fn predict<L: Lanes>(&mut self, state: &State) {
        let (scratch, s) = (&mut *self.scratch, self.tableau.nodes.len());
        for (time, &offset) in scratch.points.time.iter_mut().zip(&scratch.offset) {
            *time = state.time + offset;
        }
        let stages = &mut scratch.points.y;
        let known = match state.memory.split_first() {
            Some((&step, last)) if step == scratch.step && last.len() >= s * state.y.len() => {
                &last[..s * state.y.len()]
            }
            _ => &[],
        };
        for (stage, &y) in stages.iter_mut().zip(&state.y) {
            *stage = Octet::splat(y);
        }
        for ((stage, increment), &y) in stages.iter_mut().zip(known.chunks_exact(s)).zip(&state.y) {
            let mut sum = [L::splat(y); 2];
            for (column, &l) in self.tableau.forecast.iter().zip(increment) {
                let (column, l) = (column.halves::<L>(), L::splat(l));
                sum = [column[0].mul_add(l, sum[0]), column[1].mul_add(l, sum[1])];
            }
            *stage = Octet::of(sum);
        }
    }

    /// Sweeps the stages until no unknown's change falls any further; false where that takes so long that
    /// Newton's method is to be used, for which all is ready then.
    #[inline(always)]
    fn iteration<L: Lanes>(
        &mut self,
        problem: &mut dyn StageRates,
        state: &State,
        statistics: &mut Statistics,
    ) -> bool {
        self.scratch.least.fill(f64::INFINITY);
        let mut idle = 0;
        let mut sizes = [f64::NAN; 5];
        for iteration in 0..MOST_SWEEPS {
            problem.rates(&mut self.scratch.points);
            self.multiply::<L>();
            statistics.evaluations += self.tableau.nodes.len() as u64;
            self.restage::<L>(state);
            idle = if self.scratch.falls() { 0 } else { idle + 1 };
            sizes[iteration % 5] = self.scratch.size_of_change();
            let (now, before) = (sizes[iteration % 5], sizes[(iteration + 1) % 5]);
            // Over four iterations, because coordinates and momenta take turns, and well above rounding; the
            // first iterations are still finding their direction.
            let contraction = (now / before).sqrt().sqrt();
            if idle == IDLE_SWEEPS && contraction < self.slow && self.scratch.goes_on(self.angles) {
                idle = 0;
            }
            let is_over =
                idle == IDLE_SWEEPS || self.scratch.is_within(if self.exact > 0 { NEARLY } else { 0.0 });
            let is_slow = now > NOISE && (is_over || iteration >= EARLY && contraction > self.slow);
            if is_slow && !self.scratch.is_sweeping && self.differentiate(problem, state, statistics) {
                return false;
            }
            if is_over {
                return true;
            }
        }
        true
    }

    /// Evaluations that carry what doubles leave out, at stages that are pairs, until these have settled or
    /// their changes fall no further.  A rest of the iteration would have the direction of time in it, and
    /// drift.
    #[inline(always)]
    fn refine<L: Lanes>(&mut self, problem: &mut dyn StageRates, state: &State, statistics: &mut Statistics) {
        self.restage_exactly::<L>(state);
        self.scratch.least.fill(f64::INFINITY);
        let mut idle = 0;
        for iteration in 0..self.exact {
            problem.exact_rates(&mut self.scratch.points);
            self.multiply::<L>();
            self.multiply_low::<L>();
            statistics.evaluations += self.tableau.nodes.len() as u64;
            if iteration + 1 == self.exact {
                return;
            }
            self.restage_exactly::<L>(state);
            idle = if self.scratch.falls() { 0 } else { idle + 1 };
            if idle == IDLE_SWEEPS || self.scratch.is_within(SETTLED) {
                return;
            }
        }
    }

    /// The Jacobian at the middle of the predicted step and its factors; false where the field has none.
    fn differentiate(
        &mut self,
        problem: &mut dyn StageRates,
        state: &State,
        statistics: &mut Statistics,
    ) -> bool {
        self.predict::<Portable>(state);
        let (s, d) = (self.tableau.nodes.len(), state.y.len());
        let scratch = &mut *self.scratch;
        let middle: Vec<f64> = scratch
            .points
            .y
            .iter()
            .map(|y| 0.5 * (y.0[lane((s - 1) / 2, s)] + y.0[lane(s / 2, s)]))
            .collect();
        let newton = self.newton.get_or_insert_with(|| Box::new(Newton::new(self.tableau)));
        newton.jacobian.resize(d * d, 0.0);
        scratch.is_sweeping =
            !problem.jacobian(state.time + 0.5 * scratch.step, &middle, &mut newton.jacobian);
        if scratch.is_sweeping {
            return false;
        }
        statistics.jacobians += 1;
        newton.factor(scratch.step, d);
        true
    }

    /// All of a step but its acceptance by Newton's method, from the predicted stages and the factors in
    /// place.
    #[inline(always)]
    fn solve<L: Lanes>(&mut self, problem: &mut dyn StageRates, state: &State, statistics: &mut Statistics) {
        let (s, d) = (self.tableau.nodes.len(), state.y.len());
        let last = match state.memory.split_first() {
            Some((&step, last)) if step == self.scratch.step && last.len() >= s * d => &last[..s * d],
            _ => &[],
        };
        let mut rate = Vec::new();
        if last.is_empty() {
            // All stages are still at y.
            problem.rates(&mut self.scratch.points);
            statistics.evaluations += 1;
            rate.extend(self.scratch.points.rate.iter().map(|rate| rate.0[lane(0, s)]));
        }
        if let Some(newton) = &self.newton {
            newton.predict(last, s, &rate, &self.scratch.span, &mut self.scratch.increment);
        }
        self.scratch.increment_low.fill(Octet::default());
        self.restage::<L>(state);
        self.iterate::<L, false>(problem, state, statistics, MOST_ITERATIONS);
        self.scratch.judge();
        if self.exact > 0 {
            self.restage_exactly::<L>(state);
            self.iterate::<L, true>(problem, state, statistics, self.exact as usize);
        }
    }

    /// Newton iterations until no unknown's change falls any further; with `LOW` on stages that are pairs,
    /// where the field has such rates.
    #[inline(always)]
    fn iterate<L: Lanes, const LOW: bool>(
        &mut self,
        problem: &mut dyn StageRates,
        state: &State,
        statistics: &mut Statistics,
        most: usize,
    ) {
        let (s, d) = (self.tableau.nodes.len(), state.y.len());
        self.scratch.least.fill(f64::INFINITY);
        let mut idle = 0;
        for _ in 0..most {
            if LOW {
                problem.exact_rates(&mut self.scratch.points);
            } else {
                problem.rates(&mut self.scratch.points);
            }
            statistics.evaluations += s as u64;
            let (scratch, Some(newton)) = (&mut *self.scratch, self.newton.as_mut()) else { return };
            newton.correction.clear();
            for i in 0..s {
                let at = lane(i, s);
                newton.correction.extend((0..d).map(|k| {
                    let (span, points) = (scratch.span.0[at], &scratch.points);
                    let rest = fused(span, points.rate[k].0[at], -scratch.increment[k].0[at])
                        - scratch.increment_low[k].0[at];
                    if LOW { fused(span, points.rate_low[k].0[at], rest) } else { rest }
                }));
            }
            newton.solve(&scratch.span, s, d);
            for k in 0..d {
                for i in 0..s {
                    let (at, correction) = (lane(i, s), newton.correction[i * d + k]);
                    let (hi, lo) = (&mut scratch.increment[k].0[at], &mut scratch.increment_low[k].0[at]);
                    let increment = DoubleDouble { hi: *hi, lo: *lo } + correction;
                    (*hi, *lo) = (increment.hi, increment.lo);
                }
            }
            if LOW {
                self.restage_exactly::<L>(state)
            } else {
                self.restage::<L>(state)
            }
            idle = if self.scratch.falls() { 0 } else { idle + 1 };
            let is_over = self.scratch.is_within(if LOW { SETTLED } else { 0.0 });
            if idle == IDLE_SWEEPS || is_over || self.scratch.size_of_change().is_nan() {
                return;
            }
        }
    }

    /// L from the rates.
    #[inline(always)]
    fn multiply<L: Lanes>(&mut self) {
        let scratch = &mut *self.scratch;
        let span = scratch.span.halves::<L>();
        for (increment, rate) in scratch.increment.iter_mut().zip(&scratch.points.rate) {
            let rate = rate.halves::<L>();
            *increment = Octet::of([span[0].mul(rate[0]), span[1].mul(rate[1])]);
        }
    }

    /// What L leaves out.
    #[inline(always)]
    fn multiply_low<L: Lanes>(&mut self) {
        let GaussScratch { span, points, increment, increment_low, .. } = &mut *self.scratch;
        let span = span.halves::<L>();
        for (k, left) in increment_low.iter_mut().enumerate() {
            let (rate, low, product) =
                (points.rate[k].halves::<L>(), points.rate_low[k].halves::<L>(), increment[k].halves::<L>());
            let rest = |half: usize| {
                span[half].mul_add(low[half], span[half].mul_add(rate[half], product[half].neg()))
            };
            *left = Octet::of([rest(0), rest(1)]);
        }
    }

    /// The stages from L, and how far they moved.
    #[inline(always)]
    fn restage<L: Lanes>(&mut self, state: &State) {
        let scratch = &mut *self.scratch;
        let (even, odd) = (columns::<L>(&self.tableau.even), columns::<L>(&self.tableau.odd));
        for k in 0..state.y.len() {
            let [first, second] = scratch.increment[k].halves::<L>();
            let (sums, differences) = (first.add(second).array(), first.sub(second).array());
            let total = (sums[0] + sums[2]) + (sums[1] + sums[3]);
            let (middle, rest) = two_sum(state.y[k], state.low[k] + 0.5 * total);
            let (mut up, mut across) = (even[0].mul(L::splat(sums[0])), odd[0].mul(L::splat(differences[0])));
            for j in 1..4 {
                up = even[j].mul_add(L::splat(sums[j]), up);
                across = odd[j].mul_add(L::splat(differences[j]), across);
            }
            let (middle, rest) = (L::splat(middle), L::splat(rest));
            let moved = [middle.add(across.add(up).add(rest)), middle.add(across.sub(up).add(rest))];
            let before = scratch.points.y[k].halves::<L>();
            scratch.change[k] = largest([moved[0].sub(before[0]), moved[1].sub(before[1])]);
            scratch.points.y[k] = Octet::of(moved);
        }
    }

    /// The same in pairs.
    #[inline(always)]
    fn restage_exactly<L: Lanes>(&mut self, state: &State) {
        let scratch = &mut *self.scratch;
        let (even, odd) = (columns::<L>(&self.tableau.even), columns::<L>(&self.tableau.odd));
        for k in 0..state.y.len() {
            let ([first, second], [first_low, second_low]) =
                (scratch.increment[k].halves::<L>(), scratch.increment_low[k].halves::<L>());
            let ((sums, sums_low), (differences, differences_low)) =
                (first.two_sum(second), first.two_sum(second.neg()));
            let (sums_low, differences_low) =
                (sums_low.add(first_low.add(second_low)), differences_low.add(first_low.sub(second_low)));
            let (up, up_low) = combine(&even, sums.array(), sums_low.array());
            let (across, across_low) = combine(&odd, differences.array(), differences_low.array());
            let (total, total_low) = sum_of(sums, sums_low);
            let (middle, rest) = two_sum(state.y[k], 0.5 * total);
            let rest = rest + (state.low[k] + 0.5 * total_low);
            let (middle, across) = ((L::splat(middle), L::splat(rest)), (across, across_low));
            let (first, first_low) = shifted(middle, across, (up, up_low));
            let (second, second_low) = shifted(middle, across, (up.neg(), up_low.neg()));
            let (before, low_before) =
                (scratch.points.y[k].halves::<L>(), scratch.points.low[k].halves::<L>());
            let change = [
                first.sub(before[0]).add(first_low.sub(low_before[0])),
                second.sub(before[1]).add(second_low.sub(low_before[1])),
            ];
            scratch.change[k] = largest(change);
            scratch.points.y[k] = Octet::of([first, second]);
            scratch.points.low[k] = Octet::of([first_low, second_low]);
        }
    }
}
