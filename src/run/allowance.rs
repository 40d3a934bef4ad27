//! How far the energy balance of a run by an adaptive method may be off before the run counts as wrong: what its tolerance explains.
//!
//! ```text
//! limit = min(1e-2, 20 (N + 10) e),   e = (s + a_w) / E   with errors at the tolerance in every unknown:  d_q = atol + rtol |q| + 1e-14,  d_w likewise
//! s = sqrt(E) (Σ r_i d_wi + R d_q) + (Σ |W_i| + (Σ r_i |w_i|)²) d_q,    a_w = atol E + rtol |work|
//! r_i = sqrt(2 M_ii),   R = Σ sqrt(2 k) (Σ |gamma|),   M_ii, W_i, gamma: inertia, weights and levers, see `dynamics::tree`
//! ```
//!
//! E is the largest energy or work there has been, at least the energy scale, and N the number of steps taken.  Every term is a bound on the gradient of the
//! energy: |p·dw| by the inertia, |dV/dq| of a spring by the energy it can hold.  A step may err by the tolerance, so that N steps may err by N times as much;
//! twenty times that is no rounding of the law, and something that step-size control does not see.  Never beyond 1e-2: an energy so far off is
//! wrong at any tolerance.

use super::drift::{ENERGY_DOUBT, ENERGY_MOST};
use super::methods::Stabilization;
use super::plan::Plan;
use crate::dynamics::Mechanism;

/// How much more than errors at the tolerance in every step is allowed.
const GENEROUS: f64 = 20.0;
/// Steps that every run is granted beside its own.
const FIRST_STEPS: f64 = 10.0;
/// The tolerance that rounding leaves of a tighter one.
const ROUNDING: f64 = 1e-14;
/// Energy balance beyond which loops and sliders that nothing projects count as torn, where the tolerance does not explain more.
const APART: f64 = 1e-4;
/// Share of the limit from which a result says that it is in doubt.
const DOUBTFUL: f64 = 0.1;

/// What a tolerance explains of the energy's imbalance.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Allowance {
    /// Relative and absolute, rounding included.
    tolerance: [f64; 2],
    /// r: sqrt(2 M_ii) of every coordinate, and R \[sqrt(J) over rad or m\].
    inertia: Vec<f64>,
    rigidity: f64,
    /// Σ |W| \[J over rad or m\].
    weight: f64,
    /// False where loops and sliders are not put back onto their constraints: what these let go is not the steps' error.
    is_kept: bool,
}

/// A moment of a run, as far as its allowance goes.
pub(super) struct Moment<'a> {
    /// Rates of all coordinates \[rad/s, m/s\].
    pub omega: &'a [f64],
    /// Coordinates that are positions \[m\].
    pub feet: &'a [f64],
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
        let tree = &mechanism.tree;
        let springs = mechanism.springs.iter().map(|spring| {
            let levers: f64 = spring.span.terms.iter().map(|(_, gamma)| gamma.norm_squared().sqrt()).sum();
            (2.0 * spring.stiffness).sqrt() * (levers + spring.span.shifts.len() as f64)
        });
        let torsions = mechanism.torsions.iter().map(|torsion| 2.0 * (2.0 * torsion.stiffness).sqrt());
        Some(Self {
            tolerance: [tolerance.relative + ROUNDING, tolerance.absolute + ROUNDING],
            inertia: tree.diagonal.iter().map(|inertia| (2.0 * inertia).sqrt()).collect(),
            rigidity: springs.chain(torsions).sum(),
            weight: tree.weight.iter().map(|weight| weight.norm_squared().sqrt()).sum(),
            is_kept: !(is_loose && mechanism.has_multipliers()),
        })
    }

    /// What errors at the tolerance in every unknown come to in the energy at most, over the largest.
    fn share(&self, moment: &Moment) -> f64 {
        let ([relative, absolute], largest) = (self.tolerance, moment.largest);
        let rates = || self.inertia.iter().zip(moment.omega);
        let fast: f64 = rates().map(|(inertia, omega)| inertia * (absolute + relative * omega.abs())).sum();
        let swing: f64 = rates().map(|(inertia, omega)| inertia * omega.abs()).sum();
        // Angles are kept in [-π, π].
        let far = moment.feet.iter().fold(std::f64::consts::PI, |most: f64, x| most.max(x.abs()));
        let moved = absolute + relative * far;
        let energy = largest.sqrt() * (fast + self.rigidity * moved) + (self.weight + swing * swing) * moved;
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
    pub fn see(&mut self, allowance: &Allowance, moment: &Moment) {
        let share = allowance.share(moment);
        self.share = if share.is_nan() { f64::INFINITY } else { share.max(self.share) };
        let explained = GENEROUS * (moment.steps as f64 + FIRST_STEPS) * self.share;
        self.apart = explained.clamp(APART, ENERGY_MOST);
        if allowance.is_kept {
            self.most = explained.min(ENERGY_MOST);
            self.doubt = (DOUBTFUL * explained).min(ENERGY_DOUBT);
        }
    }
}
