//! One substep of RATTLE: its unknowns and how they are moved.

mod coupling;
mod velocity;
use self::coupling::CouplingScratch;
use super::newton::{LoopMatrix, project};
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::natural::{Demand, Guide, Natural};
use crate::dynamics::tree::size;
use crate::dynamics::{Form, State, Time};

/// Newton iterations before a step is given up; an ordinary step takes three or four.
const SWEEPS: usize = 30;

/// What plain iterations may leave of the multipliers, against the forces: the last iteration is made with
/// pairs and takes the rest.
const LEFT_OVER: f64 = 1e-13;

/// Largest change, against the forces, at which a solve that has stopped improving counts as solved.
const STALLED: f64 = 1e-11;

/// What may be left of a row before the last iteration, in its unit, at a position where some row is lost.
const KEPT: f64 = 1e-10;

/// Why a substep failed, with the row or element at fault.
#[derive(Clone, Copy, Debug)]
pub enum SubstepFailure {
    /// A force.
    NotFinite(usize),
    /// No multipliers found.
    NotConverged(usize),
    /// Converged, but on the far side of the circle.
    TooFar(usize),
}

/// A step's unknowns and scratch space, for n elements and R rows (one a body, then one a guide).
#[derive(Clone, Debug, Default)]
pub struct SubstepScratch {
    /// z (n).
    z: Vec<Complex<DoubleDouble>>,
    /// z' (n).
    v: Vec<Complex<DoubleDouble>>,
    /// p_t.
    work_integral: DoubleDouble,
    /// Whole turns, one a body.
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
    /// Scratch (n).
    change_back: Vec<Complex<f64>>,
    /// Columns W g of the rows (R × n).
    minv_jt: Vec<Complex<f64>>,
    /// Gradients of the guides at `here` (guides × n).
    gradient: Vec<Complex<f64>>,
    /// What the guides ask for at the end of the substep.
    demand: Vec<Demand<DoubleDouble>>,
    plain_demand: Vec<Demand<f64>>,
    /// C_t of the guides at `here`.
    drive: Vec<f64>,
    /// What is left of gears and cams.
    couplings: CouplingScratch,
    /// mu (R).
    multiplier: Vec<f64>,
    /// mu at the beginning of the iterations (R).
    guess: Vec<f64>,
    /// Newton matrix, then its factors.
    newton: LoopMatrix,
    /// S (R × R), then its factors, its reciprocal pivots, and what these are measured against.
    schur: Vec<f64>,
    pivot: Vec<f64>,
    scales: Vec<f64>,
    /// C(z0 + h v0)·2/h² (R).
    offset: Vec<f64>,
    /// Right side, then solution (R).
    change: Vec<f64>,
    /// The unit of each row \[rad, m\] (R), and of length \[m\].
    unit: Vec<f64>,
    length: f64,
    /// Largest force, and largest inertia \[N·m, kg·m²\].
    strength: f64,
    inertia: f64,
    /// What changes of the multipliers are measured against: the force, or what moves a vector by an ulp in
    /// one substep \[N·m\].
    scale: f64,
}

impl SubstepScratch {
    /// Room for a mechanism.
    pub fn resize(&mut self, natural: &Natural) {
        let (n, rows, guides) = (natural.elements(), natural.rows(), natural.guides().len());
        for pairs in [&mut self.z, &mut self.v, &mut self.predicted] {
            pairs.resize(n, Complex::ZERO);
        }
        let plain = [
            &mut self.ahead,
            &mut self.here,
            &mut self.force,
            &mut self.free,
            &mut self.acceleration,
            &mut self.change_back,
        ];
        for plain in plain {
            plain.resize(n, Complex::ZERO);
        }
        self.turns.resize(rows - guides, 0);
        self.inertia = natural.mechanism().tree.diagonal.iter().copied().fold(0.0, f64::max);
        self.minv_jt.resize(rows * n, Complex::ZERO);
        self.gradient.resize(guides * n, Complex::ZERO);
        self.demand.resize(guides, Demand::default());
        self.plain_demand.resize(guides, Demand::default());
        self.drive.resize(guides, 0.0);
        natural.scales(&mut self.scales);
        self.length = natural.mechanism().units.length;
        let of = |guide: &Guide| if guide.is_in_radians { 1.0 } else { self.length };
        self.unit.clear();
        self.unit.resize(rows - guides, 1.0);
        self.unit.extend(natural.guides().iter().map(of));
        self.newton.resize(&self.scales);
        self.schur.resize(rows * rows, 0.0);
        for column in
            [&mut self.multiplier, &mut self.guess, &mut self.pivot, &mut self.offset, &mut self.change]
        {
            column.resize(rows, 0.0);
        }
    }

    /// Takes over a state.
    pub fn load<const N: usize, const GUIDED: bool>(&mut self, natural: &Natural, state: &State) {
        let n = self.z.len();
        for k in 0..n {
            self.z[k] = Complex::new(state.unknown(2 * k), state.unknown(2 * k + 1));
            self.v[k] = Complex::new(state.unknown(2 * (n + k)), state.unknown(2 * (n + k) + 1));
        }
        self.turns.copy_from_slice(&state.turns);
        if state.y.len() > 4 * n {
            self.work_integral = state.unknown(4 * n);
        }
        self.ask(natural, state.time);
        self.count_turns(natural);
        self.unit_vectors::<N, GUIDED>(natural);
        if state.memory.len() == self.multiplier.len() {
            self.multiplier.copy_from_slice(&state.memory);
        } else {
            // The free accelerations are a poor first guess, but a safe one.
            self.multiplier.fill(0.0);
        }
    }

    /// Hands the state back; `memory` keeps the multipliers, from which the next step's Newton iterations
    /// start.
    pub fn store(&self, state: &mut State) {
        let n = self.z.len();
        let unknowns = self
            .z
            .iter()
            .chain(&self.v)
            .flat_map(|x| [x.re, x.im])
            .chain((state.y.len() > 4 * n).then_some(self.work_integral));
        for ((y, low), unknown) in state.y.iter_mut().zip(&mut state.low).zip(unknowns) {
            (*y, *low) = (unknown.hi, unknown.lo);
        }
        state.turns.copy_from_slice(&self.turns);
        state.memory.resize(self.multiplier.len(), 0.0);
        state.memory.copy_from_slice(&self.multiplier);
    }

    /// One step of RATTLE from the state at hand to time `end`, `h` \[s\] later.
    #[inline]
    pub fn substep<const N: usize, const GUIDED: bool>(
        &mut self,
        natural: &Natural,
        h: f64,
        end: Time,
    ) -> Result<(), SubstepFailure> {
        self.predict::<N, GUIDED>(natural, h, end);
        self.solve_position::<N, GUIDED>(natural, h)?;
        self.kick::<N, true>(h);
        self.settle::<N, GUIDED>(natural, h)?;
        self.work_integral::<GUIDED>(h);
        self.turn::<N, GUIDED>(natural, h)?;
        if GUIDED {
            self.count_turns(natural);
        }
        self.unit_vectors::<N, GUIDED>(natural);
        self.solve_velocity::<N, GUIDED>(natural, h)?;
        self.kick::<N, false>(h);
        self.work_integral::<GUIDED>(h);
        Ok(())
    }

    /// Number of bodies, whose rows are the first.
    #[inline(always)]
    fn bodies<const N: usize, const GUIDED: bool>(&self) -> usize {
        if GUIDED { self.turns.len() } else { size::<N>(self.z.len()) }
    }

    /// What the guides ask for at time `t`.
    #[inline(always)]
    fn ask(&mut self, natural: &Natural, t: Time) {
        for ((demand, plain), guide) in
            self.demand.iter_mut().zip(&mut self.plain_demand).zip(natural.guides())
        {
            *demand = guide.demand(t);
            *plain = demand.plain();
        }
        self.couple(t);
    }

    /// z0 + h v0, and by how much it violates the constraints at time `end`: in plain doubles, since the last
    /// iteration takes the rest.
    #[inline(always)]
    fn predict<const N: usize, const GUIDED: bool>(&mut self, natural: &Natural, h: f64, end: Time) {
        let (n, bodies) = (size::<N>(self.z.len()), self.bodies::<N, GUIDED>());
        natural.reduced().project_rates_back(&mut self.v, &mut self.change_back);
        let (z, v, predicted, ahead) =
            (&self.z[..n], &self.v[..n], &mut self.predicted[..n], &mut self.ahead[..n]);
        let offset = &mut self.offset;
        for k in 0..n {
            predicted[k] = Complex::new(z[k].re + v[k].re.scale(h), z[k].im + v[k].im.scale(h));
        }
        natural.reduced().project_back(predicted, &mut self.change_back);
        for k in 0..n {
            ahead[k] = plain(predicted[k]);
        }
        for k in 0..bodies {
            // (|z + h v|² - 1) / h², without the difference.
            offset[k] = plain(v[k]).norm_squared() + plain(z[k]).dot(plain(v[k])) * (2.0 / h);
        }
        if GUIDED {
            self.ask(natural, end);
            for (r, guide) in natural.guides().iter().enumerate() {
                self.offset[bodies + r] = guide.value(&self.plain_demand[r], &self.ahead) * (2.0 / (h * h));
            }
        }
        self.scale = self.strength.max(f64::EPSILON * self.inertia * (2.0 / (h * h)));
    }

    /// Finds mu such that z0 + h v0 + h²/2 a(mu) keeps the constraints: by iterations with the matrix of the
    /// first and, where these do not converge, with that of each.
    #[inline(always)]
    fn solve_position<const N: usize, const GUIDED: bool>(
        &mut self,
        natural: &Natural,
        h: f64,
    ) -> Result<(), SubstepFailure> {
        self.guess.copy_from_slice(&self.multiplier);
        match self.iteration::<N, GUIDED, false>(natural, h) {
            Ok(()) => Ok(()),
            Err(failure @ SubstepFailure::NotFinite(_)) => Err(failure),
            Err(_) => {
                self.multiplier.copy_from_slice(&self.guess);
                self.iteration::<N, GUIDED, true>(natural, h)
            }
        }
    }

    /// The iterations, with exchanges where `EXCHANGED`.
    #[inline(always)]
    fn iteration<const N: usize, const GUIDED: bool, const EXCHANGED: bool>(
        &mut self,
        natural: &Natural,
        h: f64,
    ) -> Result<(), SubstepFailure> {
        let push = 0.5 * h * h;
        let mut last = f64::INFINITY;
        for iteration in 0..SWEEPS {
            self.accelerate::<N, GUIDED>();
            self.residual::<N, GUIDED>(natural, push);
            if EXCHANGED {
                self.newton_matrix::<N, GUIDED>(natural, push);
                self.newton.factor_exchanged();
            } else if iteration == 0 {
                self.newton_matrix::<N, GUIDED>(natural, push);
                let is_sound = if GUIDED { self.newton.factor::<0>() } else { self.newton.factor::<N>() };
                if !is_sound {
                    return Err(self.lost().unwrap_or(SubstepFailure::NotConverged(0)));
                }
            }
            let rows = rows::<N, GUIDED>(self.change.len());
            let (change, multiplier) = (&mut self.change[..rows], &mut self.multiplier[..rows]);
            if GUIDED {
                self.newton.solve::<0>(change);
            } else {
                self.newton.solve::<N>(change);
            }
            let (mut largest, mut culprit, mut scale) = (0.0, 0, self.scale);
            for p in 0..rows {
                multiplier[p] += change[p];
                // Forces of guides count as moments at the unit of length.
                let unit = if GUIDED { self.unit[p] } else { 1.0 };
                let size = change[p].abs() * unit;
                scale = (multiplier[p].abs() * unit).max(scale);
                if size > largest || size.is_nan() {
                    (largest, culprit) = (size, p);
                }
            }
            if !largest.is_finite() {
                return Err(self.lost().unwrap_or(SubstepFailure::NotConverged(culprit)));
            }
            // Sweeps contract by about largest/last, so this is what the next one would still change.
            if largest == 0.0 || (iteration > 0 && largest * largest <= LEFT_OVER * scale * last) {
                self.accelerate::<N, GUIDED>();
                return Ok(());
            }
            if largest >= last {
                if last > STALLED * scale {
                    return Err(SubstepFailure::NotConverged(culprit));
                }
                self.accelerate::<N, GUIDED>();
                return Ok(());
            }
            last = largest;
        }
        Err(SubstepFailure::NotConverged(0))
    }

    /// The element whose force is not finite.
    fn lost(&self) -> Option<SubstepFailure> {
        self.free
            .iter()
            .position(|free| !(free.re.is_finite() && free.im.is_finite()))
            .map(SubstepFailure::NotFinite)
    }

    /// W (F - g mu) from the columns W g at hand.
    #[inline(always)]
    fn accelerate<const N: usize, const GUIDED: bool>(&mut self) {
        let n = size::<N>(self.z.len());
        let rows = rows::<N, GUIDED>(self.multiplier.len());
        let (acceleration, free) = (&mut self.acceleration[..n], &self.free[..n]);
        let (minv_jt, multiplier) = (&self.minv_jt[..rows * n], &self.multiplier[..rows]);
        acceleration.copy_from_slice(free);
        for p in 0..rows {
            for k in 0..n {
                acceleration[k] -= minv_jt[p * n + k].times(multiplier[p]);
            }
        }
    }

    /// C(z0 + h v0 + push a) / push into `change`: the offset, and what the acceleration adds to it.
    #[inline(always)]
    fn residual<const N: usize, const GUIDED: bool>(&mut self, natural: &Natural, push: f64) {
        let (n, bodies) = (size::<N>(self.z.len()), self.bodies::<N, GUIDED>());
        let (ahead, acceleration) = (&self.ahead[..n], &self.acceleration[..n]);
        let rows = rows::<N, GUIDED>(self.change.len());
        let (change, offset) = (&mut self.change[..rows], &self.offset[..rows]);
        for k in 0..bodies {
            change[k] =
                offset[k] + (ahead[k].dot(acceleration[k]) + 0.5 * push * acceleration[k].norm_squared());
        }
        if GUIDED {
            for (r, guide) in natural.guides().iter().enumerate() {
                let demand = &self.plain_demand[r];
                let linear = guide.slip(demand, ahead, acceleration);
                change[bodies + r] =
                    offset[bodies + r] + (linear + push * guide.square(demand, acceleration));
            }
            self.coupled_residuals(natural, push, 1.0 / push);
        }
    }

    /// Gradients at the predicted end against the columns at the start.
    #[inline(always)]
    fn newton_matrix<const N: usize, const GUIDED: bool>(&mut self, natural: &Natural, push: f64) {
        let n = size::<N>(self.z.len());
        let (here, ahead, acceleration) = (&mut self.here[..n], &self.ahead[..n], &self.acceleration[..n]);
        for k in 0..n {
            here[k] = ahead[k] + acceleration[k].times(push);
        }
        if GUIDED {
            self.guide_gradients(natural);
        }
        let (bodies, rows) = (self.bodies::<N, GUIDED>(), rows::<N, GUIDED>(self.change.len()));
        let matrix = &mut self.newton.entries[..rows * rows];
        project(n, bodies, rows, &self.here, &self.gradient, &self.minv_jt, matrix);
    }

    /// Gradients of the guides at `here`.
    fn guide_gradients(&mut self, natural: &Natural) {
        let n = self.here.len();
        self.gradient.fill(Complex::ZERO);
        for ((guide, demand), gradient) in
            natural.guides().iter().zip(&self.plain_demand).zip(self.gradient.chunks_mut(n))
        {
            guide.gradient(demand, &self.here, gradient);
        }
        self.coupled_gradients(natural);
    }

    /// v += h/2 a and, where `DRIFT`, the predicted end with it by h times the very same change: with h²/2
    /// instead, rounded on its own, the two would disagree by a constant part of 1e-16, and the energy drift.
    #[inline(always)]
    fn kick<const N: usize, const DRIFT: bool>(&mut self, h: f64) {
        let n = size::<N>(self.z.len());
        let (v, predicted, acceleration) =
            (&mut self.v[..n], &mut self.predicted[..n], &self.acceleration[..n]);
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
    fn work_integral<const GUIDED: bool>(&mut self, h: f64) {
        if GUIDED {
            let bodies = self.turns.len();
            for (lambda, drive) in self.multiplier[bodies..].iter().zip(&self.drive) {
                self.work_integral = self.work_integral + -0.5 * h * lambda * drive;
            }
        }
    }
}

/// Number of rows: known when compiled where there are no guides.
#[inline(always)]
fn rows<const N: usize, const GUIDED: bool>(rows: usize) -> usize {
    if GUIDED { rows } else { size::<N>(rows) }
}

/// Leading parts.
#[inline(always)]
fn plain(x: Complex<DoubleDouble>) -> Complex<f64> {
    Complex::new(x.re.hi, x.im.hi)
}
