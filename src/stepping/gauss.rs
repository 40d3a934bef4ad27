//! Gauss collocation with s = 2…8 stages, order 2s, fixed step: `gauss4`, `gauss6`, … `gauss16`.
//!
//! Symplectic in the canonical form (q, p), symmetric in time, A-stable; energy is not conserved but stays
//! within a band that does not grow. What rounding does to the energy is a random walk and nothing else
//! (Brouwer's law), some 1e-21 of it in a thousand seconds: below the method's own error, which swings with
//! the motion, unless steps are short. To choose for long horizons: bounded systems over 1e4 s and more,
//! where the invariants count.  It asks for a smooth field: stages are found by iterations and, from about
//! `step · fastest rate = 2` on, by Newton's method (`newton.rs`).  Beyond 4 a fast mode with energy in it is
//! not followed any more, and the slow motion goes wrong while the energy stays bounded: the method stops
//! there.  In (q, w) the same coefficients are not symplectic.
//!
//! ```text
//! L_j = h b_j f(t + c_j h, Y_j),      Y_i = y + Σ_j mu_ij L_j,
//!     mu_ij = 1/2 + sigma_ij,  sigma_ij = -sigma_ji
//! y1  = y + Σ_j h b_j f(t + c_j h, Y_j)
//! ```
//!
//! What keeps the drift away:
//! * `h b_j` is one double, the same in stages and update; sigma is antisymmetric exactly.  So the method as
//!   computed is symplectic, for weights a rounding away from Gauss's.  Weights in full in the update alone
//!   are a linear drift, as a test below shows.
//! * sigma and `h b_j` are also the same read backwards, so the method as computed is symmetric in time.
//! * Sweeps of doubles that no pairs follow go on until no unknown's change falls any further, and one
//!   iteration more.  A tolerance would leave the same rest in every step.
//! * State and time are pairs; the update sums exact products in double-double.
//! * Stages are summed outwards from the step's midpoint `y + Σ L_j / 2` in mirror pairs, so that a step and
//!   its reverse round alike.
//! * Evaluations at the end in pairs of doubles ([`OdeSystem::exact_rates`]), with stages and `L_j` that are
//!   pairs too.  They go on until the stages move by less than 2⁻⁷⁸ of their size, or no less than before:
//!   five to eight of them a step.  Increments rounded to doubles would hold the stages a little to the side
//!   from which the plain iterations came, and that is the same side in every step, by how the constants
//!   happen to be rounded: 2e-21 of the energy per second on `gentle` at 2⁻⁵ s, up or down.
//!
//! The stages lie in lanes: a iteration is one evaluation of the field on vectors of eight
//! ([`OdeSystem::rates`]).
//!
//! Source: M. Antoñana, J. Makazaga, A. Murua, *Reducing and monitoring round-off error propagation for
//! symplectic implicit Runge–Kutta schemes*, Numer. Algorithms 76 (2017) 861–880, sections 3 and 4; E.
//! Hairer, R. I. McLachlan, A. Razakarivony, *Achieving Brouwer's law with implicit Runge–Kutta methods*, BIT
//! 48 (2008) 231–243; E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical Integration*, 2nd ed. (2006),
//! sections VIII.6 (starting values, iterations).  Summing outwards from the midpoint and the evaluations in
//! pairs are ours.

mod lanes;
mod newton;
mod sums;
mod tableau;

use super::{Cause, Integrator, Statistics, StepError};
use crate::arithmetic::shown::{estimate, order};
use crate::dynamics::{OdeSystem, State, Time};
use lanes::GaussScratch;
use newton::Newton;
use std::sync::OnceLock;
use tableau::GaussTableau;

/// The tableau of 2, 3, … stages and the largest mode of its A, once somebody asked for it.
static MADE: [OnceLock<(GaussTableau, f64)>; 7] = [const { OnceLock::new() }; 7];

const NAMES: [&str; 7] = ["gauss4", "gauss6", "gauss8", "gauss10", "gauss12", "gauss14", "gauss16"];

/// Sweeps after which a step is given up.
const MOST_SWEEPS: usize = 200;
/// Sweeps in a row without a fall that end the iteration: the one that shows it, and one of grace.
const IDLE_SWEEPS: usize = 2;
/// Most evaluations after the last iteration that carry what doubles leave out.
const MOST_EXACT_SWEEPS: u32 = 12;
/// Changes over the sizes of unknowns at which iterations give way to these, and at which these end.
const NEARLY: f64 = 1.0 / (1_u64 << 46) as f64;
const SETTLED: f64 = 1.0 / (1_u128 << 78) as f64;
/// Largest last change, relative to its scale, that can be rounding; anything above has not converged.
const LARGEST_REST: f64 = 1e-10;
/// Scale of an angle near zero \[rad\]: forces that cancel leave an angle a noise that is not relative to its
/// size.
const LEAST_ANGLE: f64 = 1e-2;
/// Contraction from which iterations are given up for Newton's method, and the radians of the fastest mode a
/// step that make them as slow as that is worth.
const SLOW: f64 = 0.6;
const FAST_RADIANS: f64 = 2.0;
/// Steps by Newton's method after which iterations are tried again.
const NEWTON_STEPS: f64 = 50.0;
/// Radians of the fastest mode a step up to which it is followed, and the share of the energy scale in it
/// from which it must be.
const RESOLVED: f64 = 4.0;
const EXCITED: f64 = 1e-6;
/// Part of a step that a remaining time may differ from whole steps.
const WHOLE: f64 = 1e-9;

/// Nodes c, weights b and coefficients a, row by row, of collocation at so many Gauss points.
pub fn collocation(stages: usize) -> [Vec<f64>; 3] {
    let tableau = GaussTableau::new(stages);
    let entries = (0..stages * stages).map(|k| tableau.entry(k / stages, k % stages)).collect();
    [
        tableau.nodes.iter().map(|node| node.hi).collect(),
        tableau.weights.iter().map(|weight| weight.hi).collect(),
        entries,
    ]
}

/// A Gauss method with its step and scratch space.
#[derive(Clone, Debug)]
pub struct Gauss {
    step: f64,
    tableau: &'static GaussTableau,
    scratch: GaussScratch,
    portable: bool,
    exact: u32,
    newton: Option<Box<Newton>>,
    /// Makes shorter steps, once one is asked for.
    spare: Option<Box<Gauss>>,
    /// Contraction of the iterations above which Newton's method takes over.
    slow: f64,
}

impl Gauss {
    /// The method of `stages` stages and this step \[s\]; the direction of time follows from the integration,
    /// not from the step's sign.
    ///
    /// `None` unless 2 ≤ `stages` ≤ 8 and the step is finite and not zero.
    pub fn new(stages: usize, step: f64) -> Option<Self> {
        let made = stages
            .checked_sub(2)
            .and_then(|place| MADE.get(place))
            .filter(|_| step.is_finite() && step != 0.0)?;
        let (tableau, largest_mode) = made.get_or_init(|| {
            let tableau = GaussTableau::new(stages);
            let largest_mode = newton::largest_mode(&tableau);
            (tableau, largest_mode)
        });
        Some(Self {
            step: step.abs(),
            slow: SLOW.min(FAST_RADIANS * largest_mode),
            tableau,
            scratch: GaussScratch::default(),
            portable: false,
            exact: MOST_EXACT_SWEEPS,
            newton: None,
            spare: None,
        })
    }

    /// The same without the evaluations that carry what doubles leave out: half the time, and the random walk
    /// of plain doubles.
    pub fn plain(self) -> Self {
        Self { exact: 0, ..self }
    }

    /// The same without the processor's vector instructions, to the same bits.
    pub fn portable(self) -> Self {
        Self { portable: true, ..self }
    }

    /// The same method, which knows nothing yet.
    pub(crate) fn another(&self) -> Self {
        Self { scratch: GaussScratch::default(), newton: None, spare: None, ..*self }
    }

    /// Number of stages s.
    pub fn stages(&self) -> usize {
        self.tableau.nodes.len()
    }

    /// The step \[s\], positive.
    pub fn step(&self) -> f64 {
        self.step
    }
}

impl<F: OdeSystem + ?Sized> Integrator<F> for Gauss {
    fn name(&self) -> &'static str {
        NAMES[self.stages() - 2]
    }

    fn order(&self) -> u32 {
        2 * self.stages() as u32
    }

    fn begin(&mut self, problem: &mut F, _state: &mut State, _until: Time) -> Result<(), StepError> {
        self.scratch.points.resize(problem.dimension());
        self.scratch.step = 0.0;
        self.scratch.judged = if problem.angles() > 0 { problem.angles() } else { problem.dimension() };
        Ok(())
    }

    /// A whole step, forwards or backwards.  Where `until` is not a whole number of steps away (to 1e-9 of a
    /// step and the resolution of `until`), one shorter step ends there; done often, that costs the long-time
    /// behaviour: ask for multiples of the step. Events are not looked for: the canonical form has none.
    fn step(
        &mut self,
        problem: &mut F,
        state: &mut State,
        until: Time,
        statistics: &mut Statistics,
    ) -> Result<Option<usize>, StepError> {
        let step = self.next(state, until);
        if step != self.scratch.step {
            self.scratch.scale(self.tableau, step);
        }
        lanes::step(self, problem, state, statistics)?;
        Ok(None)
    }

    fn is_at(&self, state: &State, until: Time) -> bool {
        self.next(state, until) == 0.0
    }

    fn changed(&mut self, state: &mut State) {
        state.memory.clear();
    }

    /// By a shorter step: the collocation polynomial is of order s only inside, the step of order 2s at its
    /// end.
    fn interpolate(&mut self, problem: &mut F, from: &State, time: Time, inside: &mut State) {
        let mut spare = self.spare.take().unwrap_or_else(|| Box::new(self.another()));
        super::shortened(&mut *spare, problem, from, time, inside);
        self.spare = Some(spare);
    }

    /// By the collocation polynomial.
    fn interpolate_coarsely(&mut self, from: &State, time: Time, inside: &mut State) -> bool {
        let share = (time - from.time).hi / self.scratch.step;
        let is_inside = (0.0..=1.0).contains(&share) && self.scratch.total.len() == from.y.len();
        if is_inside {
            inside.clone_from(from);
            inside.time = time;
            self.scratch.carry(self.tableau, share, inside);
            inside.wrap();
        }
        is_inside
    }
}

impl Gauss {
    /// The next step \[s\] on the way to `until`: a whole one, what is left where that is shorter, or zero.
    pub(crate) fn next(&self, state: &State, until: Time) -> f64 {
        let span = (until - state.time).hi;
        let (whole, least) =
            ((span / self.step).abs().round(), WHOLE * self.step + 4.0 * f64::EPSILON * until.hi.abs());
        let rest = span.abs() - whole * self.step;
        if rest.abs() <= least {
            return if whole > 0.0 { self.step.copysign(span) } else { 0.0 };
        }
        if span.abs() >= self.step { self.step.copysign(span) } else { span }
    }

    /// Refuses to go on with steps too long for a fast mode that has a part in the motion; asked where
    /// Newton's method takes over, and then now and again.
    fn follow<F: OdeSystem + ?Sized>(&self, problem: &mut F, state: &State) -> Result<(), StepError> {
        let Some(found) = problem.stiffness(state.time, &state.y) else { return Ok(()) };
        let radians = found.radians(self.scratch.step.abs());
        let Some(share) = found.share else { return Ok(()) };
        if radians <= RESOLVED || found.is_damped() || share <= EXCITED {
            return Ok(());
        }
        let whose =
            found.culprit.map_or_else(|| "a mode of the bars".into(), |name| format!("spring `{name}`"));
        Err(StepError {
            cause: Cause::Unresolved,
            method: self.label().into(),
            t: state.time.hi,
            step: self.scratch.step,
            what: format!(
                "{whose} oscillates at {} rad/s, {radians:.1} rad a step, with {} of the energy scale",
                estimate(found.fastest),
                order(share)
            ),
            hint: format!("a step of {} s follows it", estimate(1.0 / found.fastest)),
        })
    }

    fn label(&self) -> &'static str {
        NAMES[self.stages() - 2]
    }

    /// Refuses a step whose stages are not finite or have not converged.
    ///
    /// Convergence is judged by the angles where the field has any: their scale is known, and whatever else
    /// moves does so through them. A momentum at rest under forces that cancel is all rounding and has no
    /// scale of its own.
    fn check<F: OdeSystem + ?Sized>(&self, problem: &mut F, state: &State) -> Result<(), StepError> {
        let scratch = &self.scratch;
        let angles = problem.angles();
        let stop = |cause, what| StepError {
            cause,
            method: self.label().into(),
            t: state.time.hi,
            step: scratch.step,
            what,
            hint: "halve the step".into(),
        };
        if let Some(k) = scratch.total.iter().position(|total| !total.is_finite()) {
            return Err(stop(
                Cause::NotFinite,
                format!("the rate of {} came out not finite", problem.label(k)),
            ));
        }
        if let Some(k) = scratch.unsettled(angles) {
            let what = format!(
                "the iteration left a change of {:.1e} in {} and did not bring it down",
                scratch.rest[k],
                problem.label(k)
            );
            return Err(stop(Cause::NotConverged, what));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Seen;
    use super::*;
    use crate::arithmetic::{DoubleDouble, Scalar};
    use crate::dynamics::canonical::Canonical;
    use crate::dynamics::kernel::Kernel;
    use crate::dynamics::{Form, Mechanism, Motion};
    use crate::scene::{Bar, Hinge, Place, Scene, Start};
    use std::sync::Arc;

    /// Two point masses of 1 kg on massless rods of 1 m, the double pendulum of Hairer et al. (2008) and
    /// Antoñana et al. (2017).
    fn point_masses() -> Scene {
        let bar =
            |name: &str| Bar { name: name.into(), length: 1.0, mass: 1.0, centre: [1.0, 0.0], inertia: 0.0 };
        let hinge = |name: &str, inner: Place, outer: usize| Hinge {
            name: name.into(),
            between: [inner, Place { bar: Some(outer), point: [0.0, 0.0] }],
        };
        Scene {
            name: "point_masses".into(),
            description: String::new(),
            gravity: [9.8, 0.0],
            bars: vec![bar("bar1"), bar("bar2")],
            hinges: vec![
                hinge("A", Place { bar: None, point: [0.0, 0.0] }, 0),
                hinge("B", Place { bar: Some(0), point: [1.0, 0.0] }, 1),
            ],
            start: vec![Start { phi: 1.1, omega: 0.0 }, Start { phi: 0.0, omega: 0.0 }],
            until: 1.0,
            every: 1.0,
            ..Scene::default()
        }
    }

    /// Mean energy error \[J\] and its standard error over `starts` a little apart, after each of `marks`
    /// steps of 2⁻⁶ s with eight stages.
    ///
    /// `spoil` changes the method; the update, and not the stages, takes `part(i)` times what double b_i
    /// leaves out.
    fn energy_errors(
        marks: &[u32],
        starts: u32,
        spoil: fn(&mut Gauss),
        part: fn(usize) -> f64,
    ) -> Vec<(f64, f64)> {
        let mechanism = Arc::new(Mechanism::new(&point_masses()).expect("a valid scene"));
        let mut form = Canonical::<2, false>::new(mechanism.clone());
        let (mut kernel, mut motion) = (Kernel::<DoubleDouble>::without_rows(&mechanism), Motion::default());
        let mut energy = |form: &mut Canonical<2, false>, state: &State| {
            form.read(state, &mut motion);
            mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total()
        };
        let mut errors = vec![Vec::new(); marks.len()];
        for k in 0..starts {
            let mut gauss = Gauss::new(8, 1.0 / 64.0).expect("sound settings");
            spoil(&mut gauss);
            let low: Vec<f64> =
                gauss.tableau.weights.iter().map(|weight| weight.scale(gauss.step).lo).collect();
            let mut state = form.state(&mechanism.start(&point_masses()));
            // p_theta = 2.7746 is bar 2's momentum, and what p_phi has more is bar 1's.
            (state.y[0], state.y[2], state.y[3]) = (1.1 + 1e-6 * f64::from(k), 0.0, 2.7746);
            let start = energy(&mut form, &state);
            let mut taken = 0;
            for (&mark, errors) in marks.iter().zip(&mut errors) {
                while taken < mark {
                    taken += 1;
                    let until = Time::of(f64::from(taken) / 64.0);
                    gauss
                        .advance(&mut form, &mut state, until, &mut Statistics::default(), &mut |_, _| {
                            Ok(Seen::Kept)
                        })
                        .expect("a step");
                    for i in (0..8).filter(|&i| part(i) != 0.0) {
                        for (k, rate) in gauss.scratch.points.rate.iter().enumerate() {
                            let y = state.unknown(k) + part(i) * low[i] * rate.0[tableau::lane(i, 8)];
                            (state.y[k], state.low[k]) = (y.hi, y.lo);
                        }
                    }
                }
                errors.push((energy(&mut form, &state) - start).hi);
            }
        }
        let count = f64::from(starts);
        let mean = |errors: &Vec<f64>| errors.iter().sum::<f64>() / count;
        let spread = |errors: &Vec<f64>| {
            let mean = mean(errors);
            (errors.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>() / (count * (count - 1.0).max(1.0)))
                .sqrt()
        };
        errors.iter().map(|errors| (mean(errors), spread(errors))).collect()
    }

    /// A defect of 1e-9 in one entry: 2⁻¹⁵ of what it would do if the method were not symmetric in time.
    #[test]
    fn a_wrong_sigma_cannot_break_the_symmetry_in_time() {
        let spoil = |gauss: &mut Gauss| {
            let mut spoiled = gauss.tableau.clone();
            spoiled.even[1][0] += 1e-9;
            gauss.tableau = Box::leak(Box::new(spoiled));
        };
        let spoiled = energy_errors(&[1 << 14, 1 << 15], 1, spoil, |_| 0.0);
        println!("{spoiled:?}");
        assert!(spoiled[1].0 != 0.0 && spoiled[1].0.abs() < 1e-11, "{spoiled:?}");
    }

    /// Weights the stages do not know drift linearly and in proportion: -1.8e-20 J/s for what doubles leave
    /// out of ours, 17 times more where the second half of the stages does without.  At their true size the
    /// method's own error hides that for minutes, so they are enlarged here.
    #[test]
    fn low_parts_of_the_weights_in_the_update_only_drift_linearly() {
        let marks = [1 << 11, 1 << 12, 1 << 13];
        let slope = |part: fn(usize) -> f64| {
            let errors = energy_errors(&marks, 2, |_| {}, part);
            println!("{errors:?}");
            for pair in errors.windows(2) {
                assert!((pair[1].0 / pair[0].0 - 2.0).abs() < 0.2, "not linear: {errors:?}");
            }
            errors[2].0 / 128.0
        };
        let (mirrored, lopsided) = (slope(|_| 1e6), slope(|i| if i < 4 { 1e6 } else { 0.0 }));
        assert!(
            (mirrored / -1.84e-14 - 1.0).abs() < 0.1 && (lopsided / -3.09e-13 - 1.0).abs() < 0.1,
            "{mirrored:e}, {lopsided:e} J/s"
        );
        // Enlarged a thousand times: in proportion.
        let small = energy_errors(&marks, 4, |_| {}, |_| 1e3)[2];
        assert!((small.0 / 128.0 / (1e-3 * mirrored) - 1.0).abs() < 0.3, "{small:?}");
    }
}
