//! Equilibria of a mechanism, their stability, and the modes of small vibrations about them.
//!
//! ```text
//! a(q, w) = accelerations with the constraints' multipliers       G(q) T = 0,   T'T = 1
//! equilibrium:   C(q) = 0,  T' a(q, 0) = 0                          by Newton's method along the constraints
//! linearized:    q = q0 + T y + O(y²),  y'' = T' A_q T y + T' A_w T y'
//! modes:         (s² - s T' A_w T - T' A_q T) y = 0                 damping ratio -Re s / |s|
//! ```
//!
//! Directions with T' A_q T y = 0 lead to other equilibria.  Each has an eigenvalue of zero, taken out before
//! the others are computed: of two that are the same, rounding would make a pair of the size of its root.
//!
//! A_q and A_w are exact (dual numbers).  To first order the curvature of the constraints has no part in it,
//! as a(q0, 0) = 0.  Source: L. Meirovitch, *Methods of Analytical Dynamics* (1970), sections 5.3 to 5.6.

mod corner;
mod local;
mod period;
mod periodic;
mod search;

pub use self::periodic::{PeriodicMotion, PeriodicMotions, periodic};

pub(super) use self::local::Local;
use self::period::{is_forced, moving};
use self::search::EquilibriumSearch;
use super::kinematics::left_out;
use crate::dynamics::Mechanism;
use crate::scene::Scene;
use serde::Serialize;
use std::f64::consts::TAU;
use std::sync::Arc;

/// What the constraints may be off by, in their own size.
const KEPT: f64 = 1e-11;
/// Most iterations of Newton's method from one start.
const ITERATIONS: usize = 200;
/// Starts beside the scene's that slide down before Newton's method.
const RELAXED: usize = 8;
/// Branches of laws that are tried from one start.
const BRANCHES: usize = 8;
/// Positions at least from which it is known how large accelerations are.
const FEWEST: usize = 16;
/// Whole turns to either side of the scene's start over which starts are wound, and the share of their range
/// by which one follows the other.
const WOUND: f64 = 2.0;
const GOLDEN: f64 = 0.618_033_988_749_894_8;
/// Longest step \[rad, or units of length\].
const LONGEST: f64 = 0.5;
/// What is left of the accelerations over the largest there are counts as none.
const STILL: f64 = 1e-11;
/// What is left of the accelerations over the largest at the starts: beside a spring with a free length that
/// has lost its length a slope is so large that any accelerations are small against it.
const BALANCED: f64 = 1e-7;
/// Two equilibria that differ by less are the same \[rad, or units of length\].
const DISTINCT: f64 = 1e-6;
/// Real parts below this share of the largest eigenvalue are rounding.
const ROUNDING: f64 = 1e-7;
/// Iterations of Newton's method at most from where accelerations count as none.
const POLISHED: usize = 4;
/// Eigenvalues below this share of the largest are zero where a direction is neither brought back nor damped.
const UNDAMPED: f64 = 1e-12;
/// Singular values of the stiffness below this share of the largest are zero: nothing brings their directions
/// back.
const SLACK: f64 = 1e-11;
/// Singular values of the constraints' Jacobian below this share of the largest are zero.
const DEPENDENT: f64 = 1e-7;
/// Below this share ways of motion cross nearby: an equilibrium there is not found to better than its root.
const CROSSING: f64 = 1e-4;

/// What has no part in it where a start finds the equilibrium of either branch on the other one.
const JUMPS: &str = "positions held by jumps of forces";

/// What becomes of a small disturbance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stability {
    /// It dies away.
    AsymptoticallyStable,
    /// It neither grows nor dies away, as far as the linearization tells.
    Stable,
    /// It grows.
    Unstable,
    /// Ways of motion cross there, or forces have a corner or a jump: no linearization holds.
    Undecided,
}

/// A mode of small vibrations.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mode {
    /// Real and imaginary part of the eigenvalue \[1/s\]; of a pair the one with positive imaginary part.
    pub eigenvalue: [f64; 2],
    /// Its magnitude \[rad/s\].
    pub frequency: f64,
    /// -Re/|·|: 0 undamped, 1 and more without vibration, negative where it grows.
    pub damping_ratio: f64,
    /// Real and imaginary parts of the coordinates' amplitudes \[rad, m\]; the largest, positions in units of
    /// length, is 1.
    pub shape: Vec<[f64; 2]>,
}

/// A place where a mechanism stays at rest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Equilibrium {
    /// Angles in (-π, π] but where turns matter \[rad\], then translational coordinates \[m\].
    pub phi: Vec<f64>,
    /// Potential energy \[J\].
    pub potential: f64,
    /// What a small disturbance does.
    pub stability: Stability,
    /// Its modes, from the slowest; none where its stability is undecided.
    pub modes: Vec<Mode>,
    /// True where forces have a corner or a jump there, in the coordinates or in the rates, or a derivative
    /// that is infinite.
    pub is_on_corner: bool,
    /// True where the scene's start slides down to it, or comes to it by Newton's method.
    pub from_start: bool,
    /// True where neighbours are equilibria too: coordinates that nothing brings back.
    pub is_family: bool,
}

/// The equilibria of a scene.
#[derive(Clone, Debug)]
pub struct Modes {
    /// The scene.
    pub scene: Scene,
    /// Its mechanism.
    pub mechanism: Arc<Mechanism>,
    /// Degrees of freedom.
    pub degrees_of_freedom: usize,
    /// The equilibria, from the lowest potential energy.
    pub equilibria: Vec<Equilibrium>,
    /// How many starts the search had, some of them twice, and how many ended at an equilibrium.
    pub starts: [usize; 2],
    /// The other positions asked for: all of them, those in which loops cannot be closed, and those that come
    /// to a position among the starts.
    pub asked: [usize; 3],
    /// What of the scene has no part in this.
    pub left_out: Vec<&'static str>,
}

/// Why a scene has no equilibria to look for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModesError {
    /// Motors or forces change with time.
    #[error(
        "`{0}` moves with time: there is no equilibrium\nhint: give it a constant law, or `driftless run` \
            the scene"
    )]
    Moving(String),
    /// Forces change with time.
    #[error(
        "forces of the scene change with time: there is no equilibrium\nhint: leave them out, or `driftless \
            run` the scene"
    )]
    Forced,
    /// Integrals of controllers are unknowns of their own.
    #[error(
        "the scene has integrals, whose equilibria are not looked for\nhint: leave the integral part of the \
            controller out"
    )]
    Integrals,
    /// Transitions between sticking and sliding.
    #[error(
        "small differences are not followed through the transitions of dry friction\nhint: leave the \
            friction out"
    )]
    Friction,
    /// No period is seen.
    #[error("the period of {0} is not known\nhint: `--period S` gives it, in seconds; it is checked")]
    PeriodUnknown(String),
    /// Not a period.
    #[error(
        "{period} s is no period of {what}\nhint: `--period S` gives another one; for a motor at a constant \
            rate it is one turn"
    )]
    NotPeriodic {
        /// The one asked for \[s\].
        period: f64,
        /// What differs.
        what: String,
    },
    /// Motors determine the motion.
    #[error(
        "the motors leave no freedom: the motion repeats itself after {0} s and has no multipliers\nhint: \
            `driftless kinematics` shows it"
    )]
    Driven(f64),
    /// Nothing can move.
    #[error("the constraints leave no freedom: nothing can vibrate")]
    Rigid,
}

/// The starts once more, with whole turns of the bodies that torsion springs turn and no constraint holds, up
/// to so many to either side of the scene's start.
fn wound(mechanism: &Mechanism, first: &[f64], others: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let is_held = |body: usize| mechanism.constraints.iter().any(|row| row.coordinates().contains(&body));
    let springs = mechanism.torsions.iter().filter(|spring| spring.stiffness != 0.0);
    let mut bodies: Vec<usize> = springs.map(|spring| spring.body).filter(|&body| !is_held(body)).collect();
    bodies.sort_unstable();
    bodies.dedup();
    if bodies.is_empty() {
        return Vec::new();
    }
    let turned = |(number, phi): (usize, &[f64])| {
        let mut phi = phi.to_vec();
        for (place, &body) in bodies.iter().enumerate() {
            // Evenly spread, for each body otherwise.
            let share = ((number + 1) as f64 * (place + 1) as f64 * GOLDEN).fract();
            let turns = (share * (2.0 * WOUND + 1.0)).floor() - WOUND;
            phi[body] += TAU * (((first[body] - phi[body]) / TAU).round() + turns);
        }
        phi
    };
    std::iter::once(first).chain(others.iter().map(Vec::as_slice)).enumerate().map(turned).collect()
}

/// Looks for equilibria from the start of a scene and from `starts` other positions of a fixed set.
///
/// # Errors
/// The scene has none by its nature.
pub fn modes(scene: &Scene, mechanism: &Arc<Mechanism>, starts: usize) -> Result<Modes, ModesError> {
    if mechanism.integrals().next().is_some() {
        return Err(ModesError::Integrals);
    }
    if let Some(name) = moving(mechanism) {
        return Err(ModesError::Moving(name.to_owned()));
    }
    if is_forced(mechanism) {
        return Err(ModesError::Forced);
    }
    let start = mechanism.start(scene);
    let [first, _] = start.rounded();
    // Wheels come to all their positions beside one another after some turns only.
    let turns = mechanism.turns_of_gears();
    let (others, asked) = mechanism.other_assemblies(scene, starts, turns);
    let more = if starts < FEWEST { mechanism.other_assemblies(scene, FEWEST, turns).0 } else { Vec::new() };
    let mut search = EquilibriumSearch::new(mechanism, [&first].into_iter().chain(&others).chain(&more));
    let freedom = search.local.tangent(&first).ncols();
    if freedom == 0 {
        return Err(ModesError::Rigid);
    }
    let mut equilibria: Vec<Equilibrium> = Vec::new();
    let mut count = [0, 0];
    // Stable ones are few among many: some starts slide down first, the scene's before all.
    let slid = search.relaxed(&first).unwrap_or_else(|| first.clone());
    let others_slid: Vec<Vec<f64>> =
        others.iter().take(RELAXED).filter_map(|phi| search.relaxed(phi)).collect();
    let turned = wound(mechanism, &first, &others);
    let all = [&slid, &first].into_iter().chain(&others_slid).chain(&others).chain(&turned);
    for (k, phi) in all.enumerate() {
        count[0] += 1;
        let Some((phi, branch)) = search.settle_on_branches(phi) else { continue };
        count[1] += 1;
        if equilibria.iter().any(|known| search.local.is_same(&known.phi, &phi)) {
            continue;
        }
        let from_start = k < 2 && equilibria.is_empty();
        let found = match &branch {
            Some(branch) => search.on(branch).linearize(phi, from_start, freedom),
            None => search.linearize(phi, from_start, freedom),
        };
        // Of a family one is enough.
        if !found.is_family || equilibria.iter().all(|known| !known.is_of_family(&found)) {
            equilibria.push(found);
        }
    }
    equilibria.sort_by(|a, b| a.potential.total_cmp(&b.potential));
    Ok(Modes {
        scene: scene.clone(),
        mechanism: Arc::clone(mechanism),
        degrees_of_freedom: freedom,
        equilibria,
        starts: count,
        asked,
        left_out: left_out(scene).into_iter().chain(search.has_jump.then_some(JUMPS)).collect(),
    })
}

impl Equilibrium {
    /// True where another one has the same energy and the same eigenvalues.
    fn is_of_family(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-6 * scale;
        let largest = self.modes.iter().map(|mode| mode.frequency).fold(f64::MIN_POSITIVE, f64::max);
        let scale = self.potential.abs().max(other.potential.abs()).max(1e-12);
        near(self.potential, other.potential, scale)
            && self.modes.len() == other.modes.len()
            && (self.modes.iter().zip(&other.modes)).all(|(a, b)| near(a.frequency, b.frequency, largest))
    }
}

impl Modes {
    /// Coordinates at a phase \[rad\] of a mode's vibration about an equilibrium, of an amplitude of `share`:
    /// rad of the largest angle, or sizes of the mechanism where a position is largest.
    pub fn displaced(&self, equilibrium: &Equilibrium, mode: &Mode, phase: f64, share: f64) -> Vec<f64> {
        let mut local = Local::new(&self.mechanism);
        let bodies = self.mechanism.bodies.len();
        let size = |shape: &[f64; 2]| shape[0].hypot(shape[1]);
        let largest = |shape: &[[f64; 2]]| shape.iter().map(size).fold(0.0, f64::max);
        let (turns, shifts) = mode.shape.split_at(bodies);
        let length = self.mechanism.size_of_parts();
        let amplitude = share / largest(turns).max(largest(shifts) / length).max(f64::MIN_POSITIVE);
        let (sin, cos) = phase.sin_cos();
        let moved: Vec<f64> = (equilibrium.phi.iter().zip(&mode.shape))
            .map(|(phi, [re, im])| phi + amplitude * (re * cos - im * sin))
            .collect();
        local.projected(&moved).unwrap_or(moved)
    }
}
