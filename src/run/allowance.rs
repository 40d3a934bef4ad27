//! How far the energy balance of a run by an adaptive method may be off before the run counts as wrong: what
//! its tolerance explains.
//!
//! ```text
//! limit = min(1e-2, 20 (N + 10) e),   e = (s + a_w) / E
//!     with errors at the tolerance in every unknown:  d_q = atol + rtol |q| + rounding,  d_w likewise
//!     rounding: 1e-14; of closed loops and sliders by their series 1e-12, as on the way through singular
//!     positions
//! s = sqrt(E) (Σ r_i d_wi + Σ R d_q) + Σ |W_i| d_q + (Σ r_i |w_i|)² d_q,    a_w = atol E + rtol |work|
//! r_i = sqrt(2 M_ii),   R = sqrt(2 k) (Σ |gamma|),
//!     M_ii, W_i, gamma: inertia, weights and levers, see `dynamics::tree`
//! absolute tolerances are in the mechanism's own units of length and time
//! ```
//!
//! E is the largest energy or work there has been, at least the energy scale, and N the number of steps
//! taken.  Every term is a bound on the gradient of the energy: |p·dw| by the inertia, |dV/dq| of a spring by
//! the energy it can hold.  A step may err by the tolerance, so that N steps may err by N times as much;
//! twenty times that is no rounding of the law, and something that step-size control does not see.  Never
//! beyond 1e-2: an energy so far off is wrong at any tolerance.

use super::drift::{ENERGY_DOUBT, ENERGY_MOST};
use super::methods::{MethodId, Stabilization};
use super::plan::Plan;
use crate::dynamics::Mechanism;

/// How much more than errors at the tolerance in every step is allowed.
const GENEROUS: f64 = 20.0;
/// Steps that every run is granted beside its own.
const FIRST_STEPS: f64 = 10.0;
/// The tolerance that rounding leaves of a tighter one, and in steps that lead through singular positions.
const ROUNDING: f64 = 1e-14;
const PASSAGE: f64 = 1e-12;
/// Energy balance beyond which loops and sliders that nothing projects count as torn: at a singular position
/// they may let go at any tolerance, in steps that err by less.
const APART: f64 = 1e-4;
/// Share of the limit from which a result says that it is in doubt.
const DOUBTFUL: f64 = 0.1;

/// What a tolerance explains of the energy's imbalance.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Allowance {
    /// Relative and absolute, rounding included.
    tolerance: [f64; 2],
    /// The mechanism's units of length \[m\] and time \[s\], and how many of the coordinates are angles.
    units: [f64; 2],
    angles: usize,
    /// r: sqrt(2 M_ii) of every coordinate \[sqrt(J) s over rad or m\].
    inertia: Vec<f64>,
    /// Σ R and Σ |W|, of angles \[sqrt(J), J\] and of positions \[the same over m\].
    rigidity: [f64; 2],
    weight: [f64; 2],
    /// False where loops and sliders are not put back onto their constraints: what these let go is not the
    /// steps' error.
    is_kept: bool,
}

/// A moment of a run, as far as its allowance goes.
pub(super) struct AllowanceMoment<'a> {
    /// Rates of all coordinates \[rad/s, m/s\].
    pub omega: &'a [f64],
    /// Coordinates that are positions \[m\].
    pub translations: &'a [f64],
    /// Work so far \[J\].
    pub work: f64,
    /// The largest energy or work so far \[J\], at least the energy scale.
    pub largest: f64,
    /// Steps taken so far.
    pub steps: u64,
}

impl Allowance {
    /// That of a plan's tolerance, where it has one.
    pub fn new(mechanism: &Mechanism, plan: &Plan) -> Option<Self> {
        let tolerance = plan.tolerance?;
        let is_loose = matches!(plan.stabilization, Stabilization::None | Stabilization::Baumgarte);
        let leaps = mechanism.has_closed_loops() && plan.method == MethodId::Taylor;
        let rounding = if leaps { PASSAGE } else { ROUNDING };
        let tree = &mechanism.tree;
        let (mut rigidity, mut weight) = ([0.0; 2], [0.0; 2]);
        for spring in &mechanism.springs {
            let levers: f64 = spring.span.terms.iter().map(|(_, gamma)| gamma.norm_squared().sqrt()).sum();
            let stiff = (2.0 * spring.stiffness).sqrt();
            rigidity[0] += stiff * levers;
            rigidity[1] += stiff * spring.span.shifts.len() as f64;
        }
        rigidity[0] +=
            mechanism.torsions.iter().map(|torsion| 2.0 * (2.0 * torsion.stiffness).sqrt()).sum::<f64>();
        let angles = mechanism.bodies.len();
        for (k, pull) in tree.weight.iter().enumerate() {
            weight[usize::from(k >= angles)] += pull.norm_squared().sqrt();
        }
        Some(Self {
            tolerance: [tolerance.relative + rounding, tolerance.absolute + rounding],
            units: [mechanism.units.length, mechanism.units.time],
            angles,
            inertia: tree.diagonal.iter().map(|inertia| (2.0 * inertia).sqrt()).collect(),
            rigidity,
            weight,
            is_kept: !(is_loose && mechanism.has_multipliers()),
        })
    }

    /// What errors at the tolerance in every unknown come to in the energy at most, over the largest.
    fn share(&self, moment: &AllowanceMoment) -> f64 {
        let ([relative, absolute], [length, time], largest) = (self.tolerance, self.units, moment.largest);
        let unit = |k: usize| if k < self.angles { 1.0 / time } else { length / time };
        let rates = || self.inertia.iter().zip(moment.omega);
        let fast: f64 = rates()
            .enumerate()
            .map(|(k, (inertia, omega))| inertia * (absolute * unit(k) + relative * omega.abs()))
            .sum();
        let swing: f64 = rates().map(|(inertia, omega)| inertia * omega.abs()).sum();
        // Angles are kept in [-π, π].
        let far = moment.translations.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let moved = [absolute + relative * std::f64::consts::PI, absolute * length + relative * far];
        let sum = |parts: [f64; 2]| parts[0] * moved[0] + parts[1] * moved[1];
        let energy =
            largest.sqrt() * (fast + sum(self.rigidity)) + sum(self.weight) + swing * swing * moved[0];
        (energy + relative * moment.work.abs()) / largest + absolute
    }
}

/// What the energy's imbalance is held against, over the largest energy or work there has been.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct EnergyLimit {
    /// Beyond it a run is no success.
    pub most: f64,
    /// Beyond it a result is in doubt.
    pub doubt: f64,
    /// Beyond it loops and sliders that nothing projects count as torn.
    pub apart: f64,
    /// The largest share of the energy that errors at the tolerance came to in a step.
    share: f64,
}

impl Default for EnergyLimit {
    fn default() -> Self {
        Self { most: ENERGY_MOST, doubt: ENERGY_DOUBT, apart: APART, share: 0.0 }
    }
}

impl EnergyLimit {
    /// Goes on to another moment.
    pub fn see(&mut self, allowance: &Allowance, moment: &AllowanceMoment) {
        let share = allowance.share(moment);
        self.share = if share.is_nan() { f64::INFINITY } else { share.max(self.share) };
        let explained = GENEROUS * (moment.steps as f64 + FIRST_STEPS) * self.share;
        if allowance.is_kept {
            self.most = explained.min(ENERGY_MOST);
            self.doubt = (DOUBTFUL * explained).min(ENERGY_DOUBT);
        }
    }
}
