//! RATTLE, order 2, and its symmetric compositions of order 4, 6 and 8; fixed step.
//!
//! Keeps: every constraint at position and velocity level to rounding; symplectic and time-symmetric, so energy (with motors: energy less
//! work) oscillates with an amplitude of the method's order and has no drift.  Choose it for long horizons of constrained or driven scenes
//! where a cheap step counts; for few bodies and the last digits Gauss and Taylor are better.  Asks for the [`Natural`] form: forces that
//! depend on positions only.
//!
//! ```text
//! v½ = v0 + h/2 W (F(z0) - g(z0,t0) mu),     z1 = z0 + h v½,     C(z1, t1) = 0             gives mu
//! v1 = v½ + h/2 W (F(z1) - g(z1,t1) mu'),    g(z1,t1)·v1 + C_t(z1,t1) = 0                  gives mu'
//! p_t -= h/2 (mu·C_t(z0,t0) + mu'·C_t(z1,t1))                                              driven scenes
//! ```
//!
//! Source: H. C. Andersen, *Rattle: a "velocity" version of the Shake algorithm*, J. Comput. Phys. 52 (1983); B. Leimkuhler, R. D. Skeel,
//! *Symplectic numerical integrators in constrained Hamiltonian systems*, J. Comput. Phys. 112 (1994), for its symplecticity; E. Hairer, C.
//! Lubich, G. Wanner, *Geometric Numerical Integration*, 2nd ed. (2006), section VII.1.4.  p_t makes time a coordinate, so that a driven
//! scene is one without drive. Compositions: [`composition`](super::composition).
//!
//! Rounding: positions, velocities, p_t and time are pairs, and the last Newton sweep forms C(z1, t1) from them.  What is left is the
//! rounding of h W F, 1e-16 of a *kick*, not of the state.

use super::composition::Composition;
use super::{Cause, Method, Reached, StepError, Tally, Watch};
use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar};
use crate::dynamics::law::Phase;
use crate::dynamics::natural::{Natural, upper};
use crate::dynamics::tree::{self, size};
use crate::dynamics::{Form, State, Time};

/// Newton sweeps before a step is given up; an ordinary step takes three or four.
const SWEEPS: usize = 30;

/// What plain sweeps may leave of the multipliers, against the forces: the last sweep is made with pairs and takes the rest.
const LEFT_OVER: f64 = 1e-13;

/// Largest change, against the forces, at which a solve that has stopped improving counts as solved.
const STALLED: f64 = 1e-11;

/// The method: a composition and its step.
#[derive(Clone, Debug)]
pub struct Rattle {
    composition: Composition,
    step: f64,
    substeps: Vec<f64>,
    /// Time from the start of the step to the end of each substep \[s\].
    ends: Vec<Time>,
    work: Work,
}

impl Rattle {
    /// RATTLE with a fixed step \[s\], finite and not zero; a negative step runs back in time.
    pub fn new(composition: Composition, step: f64) -> Self {
        let substeps = composition.substeps(step);
        let end = |sum: &mut Time, substep: &f64| {
            *sum += Time::of(*substep);
            Some(*sum)
        };
        let mut ends: Vec<Time> = substeps.iter().scan(Time::default(), end).collect();
        // Where a step ends the next begins, to the last bit.
        if let Some(last) = ends.last_mut() {
            *last = Time::of(step);
        }
        Self { composition, step, substeps, ends, work: Work::default() }
    }

    /// The step \[s\].
    pub fn step(&self) -> f64 {
        self.step
    }

    /// The composition.
    pub fn composition(&self) -> Composition {
        self.composition
    }
}

impl Method<Natural> for Rattle {
    fn name(&self) -> &'static str {
        match self.composition {
            Composition::Single => "rattle2",
            Composition::Suzuki5 => "rattle4",
            Composition::KahanLi9 => "rattle6",
            Composition::KahanLi17 => "rattle8",
        }
    }

    fn order(&self) -> u32 {
        self.composition.order()
    }

    fn advance(
        &mut self,
        problem: &mut Natural,
        state: &mut State,
        until: Time,
        tally: &mut Tally,
        watch: &mut Watch<Natural>,
    ) -> Result<Reached, StepError> {
        match (state.turns.len(), problem.drives().is_empty()) {
            (1, true) => self.march::<1, false>(problem, state, until, tally, watch),
            (2, true) => self.march::<2, false>(problem, state, until, tally, watch),
            (3, true) => self.march::<3, false>(problem, state, until, tally, watch),
            (4, true) => self.march::<4, false>(problem, state, until, tally, watch),
            (_, true) => self.march::<0, false>(problem, state, until, tally, watch),
            (2, false) => self.march::<2, true>(problem, state, until, tally, watch),
            (_, false) => self.march::<0, true>(problem, state, until, tally, watch),
        }
    }
}

impl Rattle {
    /// Whole steps to the time nearest to `until`, for `N` bodies (any number where `N` is 0), with motors where `DRIVEN`.
    fn march<const N: usize, const DRIVEN: bool>(
        &mut self,
        natural: &mut Natural,
        state: &mut State,
        until: Time,
        tally: &mut Tally,
        watch: &mut Watch<Natural>,
    ) -> Result<Reached, StepError> {
        if self.step == 0.0 || !self.step.is_finite() {
            return Err(self.refuse(state.time.hi));
        }
        let count = ((until - state.time).hi / self.step).round();
        self.work.resize(natural);
        self.work.load::<N, DRIVEN>(natural, state);
        let mut done = 0.0;
        while done < count {
            for (&h, &end) in self.substeps.iter().zip(&self.ends) {
                if let Err(failure) = self.work.substep::<N, DRIVEN>(natural, h, state.time + end) {
                    return Err(self.explain(natural, state.time.hi, failure));
                }
                tally.evaluations += 1;
            }
            state.time += Time::of(self.step);
            self.work.store(state);
            tally.steps += 1;
            done += 1.0;
            let seen = watch(natural, state)?;
            if seen.is_changed() {
                state.memory.clear();
            }
            if seen.is_enough() {
                return Ok(Reached::Pause);
            }
            if seen.is_changed() {
                self.work.load::<N, DRIVEN>(natural, state);
            }
        }
        Ok(Reached::Until)
    }

    fn refuse(&self, t: f64) -> StepError {
        StepError {
            cause: Cause::StepTooSmall,
            method: self.name().into(),
            t,
            step: self.step,
            what: "the step is zero or not finite".into(),
            hint: "give a step in seconds, such as 0.01".into(),
        }
    }

    fn explain(&self, natural: &Natural, t: f64, failure: Failure) -> StepError {
        let (cause, what) = match failure {
            Failure::NotFinite(body) => (Cause::NotFinite, format!("the force on {} is not finite", natural.row_name(body))),
            Failure::NotConverged(row) => (Cause::NotConverged, format!("no multiplier found that keeps the {}", natural.row_name(row))),
            Failure::TooFar(row) => {
                (Cause::NotConverged, format!("a quarter turn or more in one substep of the {}", natural.row_name(row)))
            }
        };
        let hint = match cause {
            Cause::NotFinite => "check springs that can shrink to length zero".into(),
            _ => format!("try a step of {:.1e} s", 0.25 * self.step),
        };
        StepError { cause, method: self.name().into(), t, step: self.step, what, hint }
    }
}

/// Why a substep failed, with the row at fault.
#[derive(Clone, Copy, Debug)]
enum Failure {
    NotFinite(usize),
    NotConverged(usize),
    /// Converged, but on the far side of the circle.
    TooFar(usize),
}

/// A step's unknowns and scratch space, for n bodies and R rows (one a body, then one a motor).
#[derive(Clone, Debug, Default)]
struct Work {
    /// z (n).
    z: Vec<Complex<DoubleDouble>>,
    /// z' (n).
    v: Vec<Complex<DoubleDouble>>,
    /// p_t.
    account: DoubleDouble,
    /// Whole turns (n).
    turns: Vec<i64>,
    /// z0 + h v0 (n), and its leading parts.
    predicted: Vec<Complex<DoubleDouble>>,
    ahead: Vec<Complex<f64>>,
    /// z (n), leading parts.
    here: Vec<Complex<f64>>,
    /// F (n), then W F (n).
    force: Vec<Complex<f64>>,
    free: Vec<Complex<f64>>,
    /// W (F - g mu) (n).
    acceleration: Vec<Complex<f64>>,
    /// Columns W g of the rows (R × n).
    lifted: Vec<Complex<f64>>,
    /// Gradients of the motors' rows at `here`.
    gradient: Vec<[Complex<f64>; 2]>,
    /// What the motors ask for at the end of the substep.
    phase: Vec<Phase<DoubleDouble>>,
    /// C_t of the motors' rows at `here`.
    drive: Vec<f64>,
    /// mu (R).
    multiplier: Vec<f64>,
    /// Newton matrix or S, then its factors (R × R).
    matrix: Vec<f64>,
    pivot: Vec<f64>,
    /// C(z0 + h v0)·2/h² (R).
    offset: Vec<f64>,
    /// Right side, then solution (R).
    change: Vec<f64>,
    /// Largest force, and largest inertia \[N·m, kg·m²\].
    strength: f64,
    inertia: f64,
    /// What changes of the multipliers are measured against: the force, or what moves a vector by an ulp in one substep \[N·m\].
    scale: f64,
}

impl Work {
    fn resize(&mut self, natural: &Natural) {
        let (rows, motors) = (natural.rows(), natural.drives().len());
        let n = rows - motors;
        for pairs in [&mut self.z, &mut self.v, &mut self.predicted] {
            pairs.resize(n, Complex::ZERO);
        }
        for plain in [&mut self.ahead, &mut self.here, &mut self.force, &mut self.free, &mut self.acceleration] {
            plain.resize(n, Complex::ZERO);
        }
        self.turns.resize(n, 0);
        self.inertia = natural.mechanism().tree.diagonal.iter().copied().fold(0.0, f64::max);
        self.lifted.resize(rows * n, Complex::ZERO);
        self.gradient.resize(motors, [Complex::ZERO; 2]);
        self.phase.resize(motors, Phase::default());
        self.drive.resize(motors, 0.0);
        self.matrix.resize(rows * rows, 0.0);
        for column in [&mut self.multiplier, &mut self.pivot, &mut self.offset, &mut self.change] {
            column.resize(rows, 0.0);
        }
    }

    /// Takes over a state.
    fn load<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural, state: &State) {
        let n = self.z.len();
        for k in 0..n {
            self.z[k] = Complex::new(state.unknown(2 * k), state.unknown(2 * k + 1));
            self.v[k] = Complex::new(state.unknown(2 * (n + k)), state.unknown(2 * (n + k) + 1));
        }
        self.turns.copy_from_slice(&state.turns);
        if DRIVEN {
            self.account = state.unknown(4 * n);
        }
        for (phase, drive) in self.phase.iter_mut().zip(natural.drives()) {
            *phase = drive.law.at(state.time);
        }
        self.face::<N, DRIVEN>(natural);
        if state.memory.len() == self.multiplier.len() {
            self.multiplier.copy_from_slice(&state.memory);
        } else {
            // The free accelerations are a poor first guess, but a safe one.
            self.multiplier.fill(0.0);
        }
    }

    /// Hands the state back; `memory` keeps the multipliers, from which the next step's Newton sweeps start.
    fn store(&self, state: &mut State) {
        let n = self.z.len();
        let unknowns = self.z.iter().chain(&self.v).flat_map(|x| [x.re, x.im]).chain((state.y.len() > 4 * n).then_some(self.account));
        for ((y, low), unknown) in state.y.iter_mut().zip(&mut state.low).zip(unknowns) {
            (*y, *low) = (unknown.hi, unknown.lo);
        }
        state.turns.copy_from_slice(&self.turns);
        state.memory.resize(self.multiplier.len(), 0.0);
        state.memory.copy_from_slice(&self.multiplier);
    }

    /// One step of RATTLE from the state at hand to time `end`, `h` \[s\] later.
    #[inline]
    fn substep<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural, h: f64, end: Time) -> Result<(), Failure> {
        self.predict::<N, DRIVEN>(natural, h, end);
        self.solve_position::<N, DRIVEN>(natural, h)?;
        self.kick::<N, true>(h);
        self.settle::<N, DRIVEN>(natural, h);
        self.account::<DRIVEN>(h);
        self.turn::<N, DRIVEN>(natural)?;
        self.face::<N, DRIVEN>(natural);
        self.solve_velocity::<N, DRIVEN>(natural, h)?;
        self.kick::<N, false>(h);
        self.account::<DRIVEN>(h);
        Ok(())
    }

    /// z0 + h v0, and by how much it violates the constraints at time `end`: in plain doubles, since the last sweep takes the rest.
    #[inline(always)]
    fn predict<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural, h: f64, end: Time) {
        let n = size::<N>(self.z.len());
        let (z, v, predicted, ahead) = (&self.z[..n], &self.v[..n], &mut self.predicted[..n], &mut self.ahead[..n]);
        let offset = &mut self.offset;
        for k in 0..n {
            predicted[k] = Complex::new(z[k].re + v[k].re.scale(h), z[k].im + v[k].im.scale(h));
            ahead[k] = plain(predicted[k]);
            // (|z + h v|² - 1) / h², without the difference.
            offset[k] = plain(v[k]).norm_squared() + plain(z[k]).dot(plain(v[k])) * (2.0 / h);
        }
        if DRIVEN {
            for (r, drive) in natural.drives().iter().enumerate() {
                self.phase[r] = drive.law.at(end);
                offset[n + r] = drive.mismatch(plain(self.phase[r].unit), ahead).im * (2.0 / (h * h));
            }
        }
        self.scale = self.strength.max(f64::EPSILON * self.inertia * (2.0 / (h * h)));
    }

    /// Finds mu such that z0 + h v0 + h²/2 a(mu) keeps the constraints, by Newton sweeps with the matrix of the first.
    #[inline(always)]
    fn solve_position<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural, h: f64) -> Result<(), Failure> {
        let push = 0.5 * h * h;
        let mut last = f64::INFINITY;
        for sweep in 0..SWEEPS {
            self.accelerate::<N, DRIVEN>();
            self.residual::<N, DRIVEN>(natural, push);
            if sweep == 0 {
                self.newton_matrix::<N, DRIVEN>(natural, push);
                factor::<N, DRIVEN>(&mut self.matrix, &mut self.pivot);
            }
            let rows = rows::<N, DRIVEN>(self.change.len());
            let (change, multiplier) = (&mut self.change[..rows], &mut self.multiplier[..rows]);
            solve::<N, DRIVEN>(&self.matrix, &self.pivot, change);
            let (mut largest, mut culprit, mut scale) = (0.0, 0, self.scale);
            for p in 0..rows {
                multiplier[p] += change[p];
                scale = multiplier[p].abs().max(scale);
                if change[p].abs() > largest || change[p].is_nan() {
                    (largest, culprit) = (change[p].abs(), p);
                }
            }
            if !largest.is_finite() {
                let lost = self.free.iter().position(|free| !(free.re.is_finite() && free.im.is_finite()));
                return Err(lost.map_or(Failure::NotConverged(culprit), Failure::NotFinite));
            }
            // Sweeps contract by about largest/last, so this is what the next one would still change.
            if largest == 0.0 || (sweep > 0 && largest * largest <= LEFT_OVER * scale * last) {
                self.accelerate::<N, DRIVEN>();
                return Ok(());
            }
            if largest >= last {
                if last > STALLED * scale {
                    return Err(Failure::NotConverged(culprit));
                }
                self.accelerate::<N, DRIVEN>();
                return Ok(());
            }
            last = largest;
        }
        Err(Failure::NotConverged(0))
    }

    /// W (F - g mu) from the columns W g at hand.
    #[inline(always)]
    fn accelerate<const N: usize, const DRIVEN: bool>(&mut self) {
        let n = size::<N>(self.z.len());
        let rows = rows::<N, DRIVEN>(self.multiplier.len());
        let (acceleration, free) = (&mut self.acceleration[..n], &self.free[..n]);
        let (lifted, multiplier) = (&self.lifted[..rows * n], &self.multiplier[..rows]);
        acceleration.copy_from_slice(free);
        for p in 0..rows {
            for k in 0..n {
                acceleration[k] -= lifted[p * n + k].times(multiplier[p]);
            }
        }
    }

    /// C(z0 + h v0 + push a) / push into `change`: the offset, and what the acceleration adds to it.
    #[inline(always)]
    fn residual<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural, push: f64) {
        let n = size::<N>(self.z.len());
        let (ahead, acceleration) = (&self.ahead[..n], &self.acceleration[..n]);
        let rows = rows::<N, DRIVEN>(self.change.len());
        let (change, offset) = (&mut self.change[..rows], &self.offset[..rows]);
        for k in 0..n {
            change[k] = offset[k] + (ahead[k].dot(acceleration[k]) + 0.5 * push * acceleration[k].norm_squared());
        }
        if DRIVEN {
            for (r, drive) in natural.drives().iter().enumerate() {
                let unit = plain(self.phase[r].unit);
                let linear = drive.slip(unit, ahead, acceleration).im;
                let square = drive.base.map_or(0.0, |b| (unit.conj() * acceleration[drive.body] * acceleration[b].conj()).im);
                change[n + r] = offset[n + r] + (linear + push * square);
            }
        }
    }

    /// Gradients at the predicted end against the columns at the start.
    #[inline(always)]
    fn newton_matrix<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural, push: f64) {
        let n = size::<N>(self.z.len());
        let (here, ahead, acceleration) = (&mut self.here[..n], &self.ahead[..n], &self.acceleration[..n]);
        for k in 0..n {
            here[k] = ahead[k] + acceleration[k].times(push);
        }
        if DRIVEN {
            for (r, drive) in natural.drives().iter().enumerate() {
                self.gradient[r] = drive.gradient(plain(self.phase[r].unit), here);
            }
        }
        self.project::<N, DRIVEN>(natural);
    }

    /// Gradients at `here` against the columns at hand, into `matrix`.
    #[inline(always)]
    fn project<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural) {
        let n = size::<N>(self.z.len());
        let rows = rows::<N, DRIVEN>(self.change.len());
        let (here, lifted, matrix) = (&self.here[..n], &self.lifted[..rows * n], &mut self.matrix[..rows * rows]);
        for p in 0..n {
            for q in 0..rows {
                matrix[p * rows + q] = here[p].dot(lifted[q * n + p]);
            }
        }
        if DRIVEN {
            for (r, drive) in natural.drives().iter().enumerate() {
                let ([a, b], [on_a, on_b]) = (drive.bodies(), self.gradient[r]);
                for q in 0..rows {
                    matrix[(n + r) * rows + q] = on_a.dot(lifted[q * n + a]) + on_b.dot(lifted[q * n + b]);
                }
            }
        }
    }

    /// v += h/2 a and, where `DRIFT`, the predicted end with it by h times the very same change: with h²/2 instead, rounded on its own, the
    /// two would disagree by a constant part of 1e-16, and the energy drift.
    #[inline(always)]
    fn kick<const N: usize, const DRIFT: bool>(&mut self, h: f64) {
        let n = size::<N>(self.z.len());
        let (v, predicted, acceleration) = (&mut self.v[..n], &mut self.predicted[..n], &self.acceleration[..n]);
        for k in 0..n {
            let change = acceleration[k].times(0.5 * h);
            v[k] = Complex::new(v[k].re + change.re, v[k].im + change.im);
            if DRIFT {
                predicted[k] = Complex::new(predicted[k].re + h * change.re, predicted[k].im + h * change.im);
            }
        }
    }

    /// p_t -= h/2 lambda·C_t.
    #[inline(always)]
    fn account<const DRIVEN: bool>(&mut self, h: f64) {
        if DRIVEN {
            let n = self.z.len();
            for (lambda, drive) in self.multiplier[n..].iter().zip(&self.drive) {
                self.account = self.account + -0.5 * h * lambda * drive;
            }
        }
    }

    /// One more sweep, with the constraints formed from pairs.  Sweeps in plain doubles leave lengths wrong by some 1e-22 with a preferred
    /// sign, and a length that is always too short is a steady loss of energy.
    #[inline(always)]
    fn settle<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural, h: f64) {
        let n = size::<N>(self.z.len());
        let rows = rows::<N, DRIVEN>(self.change.len());
        let (predicted, change) = (&self.predicted[..n], &mut self.change[..rows]);
        let per_push = 2.0 / (h * h);
        for k in 0..n {
            change[k] = 0.5 * (predicted[k].norm_squared() + -1.0).hi * per_push;
        }
        if DRIVEN {
            for (r, drive) in natural.drives().iter().enumerate() {
                change[n + r] = drive.mismatch(self.phase[r].unit, predicted).im.hi * per_push;
            }
        }
        solve::<N, DRIVEN>(&self.matrix, &self.pivot, change);
        let (acceleration, lifted) = (&mut self.acceleration[..n], &self.lifted[..rows * n]);
        acceleration.fill(Complex::ZERO);
        for p in 0..rows {
            self.multiplier[p] += change[p];
            for k in 0..n {
                acceleration[k] -= lifted[p * n + k].times(change[p]);
            }
        }
        self.kick::<N, true>(h);
    }

    /// Arrives at `predicted` and counts turns; refuses the root on the far side of the circle.
    #[inline(always)]
    fn turn<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural) -> Result<(), Failure> {
        let n = size::<N>(self.z.len());
        let (z, predicted, here, turns) = (&mut self.z[..n], &self.predicted[..n], &mut self.here[..n], &mut self.turns[..n]);
        for k in 0..n {
            let (before, after) = (z[k], predicted[k]);
            (z[k], here[k]) = (after, plain(after));
            let old = plain(before);
            if old.dot(here[k]) <= 0.0 {
                return Err(Failure::TooFar(k));
            }
            if upper(before) != upper(after) {
                turns[k] += match (upper(after), old.cross(here[k]) > 0.0) {
                    (false, true) => 1,
                    (true, false) => -1,
                    _ => 0,
                };
            }
        }
        if DRIVEN {
            for (r, drive) in natural.drives().iter().enumerate() {
                if drive.mismatch(plain(self.phase[r].unit), here).re <= 0.0 {
                    return Err(Failure::TooFar(n + r));
                }
            }
        }
        Ok(())
    }

    /// Forces, gradients and columns W g at z and the time of `demand`.
    #[inline(always)]
    fn face<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural) {
        let n = size::<N>(self.z.len());
        let rows = rows::<N, DRIVEN>(self.change.len());
        for k in 0..n {
            self.here[k] = plain(self.z[k]);
        }
        natural.force(&self.here[..n], &mut self.force[..n]);
        let (here, force, free) = (&self.here[..n], &self.force[..n], &mut self.free[..n]);
        let (w, lifted) = (&natural.inverse()[..n * n], &mut self.lifted[..rows * n]);
        self.strength = 0.0;
        for i in 0..n {
            self.strength = self.strength.max(force[i].re.abs()).max(force[i].im.abs());
            let mut sum = Complex::ZERO;
            for j in 0..n {
                lifted[j * n + i] = w[i * n + j] * here[j];
                sum += w[i * n + j] * force[j];
            }
            free[i] = sum;
        }
        if DRIVEN {
            for (r, drive) in natural.drives().iter().enumerate() {
                let phase = self.phase[r];
                let unit = plain(phase.unit);
                self.drive[r] = -phase.rate.hi * drive.mismatch(unit, here).re;
                self.gradient[r] = drive.gradient(unit, here);
                let ([a, b], [on_a, on_b]) = (drive.bodies(), self.gradient[r]);
                for i in 0..n {
                    lifted[(n + r) * n + i] = w[i * n + a] * on_a + w[i * n + b] * on_b;
                }
            }
        }
    }

    /// Finds mu' such that v½ + h/2 a(mu') keeps the constraints' rates.
    #[inline(always)]
    fn solve_velocity<const N: usize, const DRIVEN: bool>(&mut self, natural: &Natural, h: f64) -> Result<(), Failure> {
        let n = size::<N>(self.z.len());
        let rows = rows::<N, DRIVEN>(self.change.len());
        self.project::<N, DRIVEN>(natural);
        let (z, v, here, free) = (&self.z[..n], &self.v[..n], &self.here[..n], &self.free[..n]);
        for k in 0..n {
            if !(free[k].re.is_finite() && free[k].im.is_finite()) {
                return Err(Failure::NotFinite(k));
            }
            // z1·v½ = h/2 |v½|², because both ends of the step lie on the circle.
            self.multiplier[k] = here[k].dot(free[k]) + plain(v[k]).norm_squared();
        }
        if DRIVEN {
            for (r, drive) in natural.drives().iter().enumerate() {
                let phase = self.phase[r];
                let slip = drive.slip(phase.unit, z, v).im - phase.rate * drive.mismatch(phase.unit, z).re;
                let ([a, b], [on_a, on_b]) = (drive.bodies(), self.gradient[r]);
                self.multiplier[n + r] = on_a.dot(free[a]) + on_b.dot(free[b]) + slip.value() * (2.0 / h);
            }
        }
        let multiplier = &mut self.multiplier[..rows];
        tree_factor::<N, DRIVEN>(&mut self.matrix, &mut self.pivot);
        tree_solve::<N, DRIVEN>(&self.matrix, &self.pivot, multiplier);
        self.accelerate::<N, DRIVEN>();
        Ok(())
    }
}

/// Number of rows: known when compiled where there are no motors.
#[inline(always)]
fn rows<const N: usize, const DRIVEN: bool>(rows: usize) -> usize {
    if DRIVEN { rows } else { size::<N>(rows) }
}

/// Leading parts.
#[inline(always)]
fn plain(x: Complex<DoubleDouble>) -> Complex<f64> {
    Complex::new(x.re.hi, x.im.hi)
}

/// Factors S.
#[inline(always)]
fn tree_factor<const N: usize, const DRIVEN: bool>(matrix: &mut [f64], pivot: &mut [f64]) {
    match DRIVEN {
        true => tree::factor::<f64, 0>(pivot.len(), matrix, pivot),
        false => tree::factor::<f64, N>(pivot.len(), matrix, pivot),
    }
}

/// Solves with the factors of S.
#[inline(always)]
fn tree_solve<const N: usize, const DRIVEN: bool>(matrix: &[f64], pivot: &[f64], load: &mut [f64]) {
    match DRIVEN {
        true => tree::solve::<f64, 0>(pivot.len(), matrix, pivot, load),
        false => tree::solve::<f64, N>(pivot.len(), matrix, pivot, load),
    }
}

/// Newton matrix = L U in place, without exchanges: its symmetric part is close to S, which is positive definite.
#[inline(always)]
fn factor<const N: usize, const DRIVEN: bool>(matrix: &mut [f64], pivot: &mut [f64]) {
    let rows = rows::<N, DRIVEN>(pivot.len());
    let (matrix, pivot) = (&mut matrix[..rows * rows], &mut pivot[..rows]);
    for k in 0..rows {
        pivot[k] = 1.0 / matrix[k * rows + k];
        for i in k + 1..rows {
            let l = matrix[i * rows + k] * pivot[k];
            matrix[i * rows + k] = l;
            for j in k + 1..rows {
                matrix[i * rows + j] -= l * matrix[k * rows + j];
            }
        }
    }
}

/// Solves with the factors of [`factor`], in place.
#[inline(always)]
fn solve<const N: usize, const DRIVEN: bool>(matrix: &[f64], pivot: &[f64], load: &mut [f64]) {
    let rows = rows::<N, DRIVEN>(pivot.len());
    let (matrix, pivot, load) = (&matrix[..rows * rows], &pivot[..rows], &mut load[..rows]);
    for i in 1..rows {
        for k in 0..i {
            load[i] -= matrix[i * rows + k] * load[k];
        }
    }
    for i in (0..rows).rev() {
        for k in i + 1..rows {
            load[i] -= matrix[i * rows + k] * load[k];
        }
        load[i] *= pivot[i];
    }
}
