//! The Lyapunov spectrum of a motion: how fast small differences grow, in every direction.
//!
//! ```text
//! columns (dq, dw) tangent to the constraints, made orthonormal after every step (Benettin):
//!     λ_k = lim (1/t) Σ log r_kk
//! ⟨x, y⟩ = ν² dqᵀ M dq + (P dw)ᵀ M (P dw)
//!     P  onto the directions that the constraints allow, ν = 1/unit of time
//! ```
//!
//! In this product volumes are those of the phase space of positions and momenta of the constrained
//! mechanism, which a motion without dissipation keeps (Liouville): the exponents then add up to zero, not in
//! the limit but at every time.  With dampers their sum is the mean of tr(W dQ/dw), Q being the applied
//! forces and W the inverse mass matrix that the constraints leave; an impact of restitution e adds log e².
//!
//! Sources: G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980), 9-30; V. I. Arnold,
//! *Mathematical Methods of Classical Mechanics*, 2nd ed. (1989), section 16.

use super::collocation::Collocation;
use super::variation::{Look, Variation, plain};
use super::{SensitivityError, SensitivityRequest, Study, stopped};
use crate::dynamics::kernel::Kernel;
use crate::dynamics::{Mechanism, Motion};
use crate::run::driver::Pause;
use crate::run::observer::Step;
use crate::run::running::Outcome;
use crate::run::trust::{TOO_SHORT, cannot_be_chaotic};
use crate::scene::{Scene, Template};
use serde::Serialize;

/// Coordinates up to which columns are taken on by collocation in no more time than by series: `spring` takes
/// 0.6 of it, `free` and `four_bars` as long, `branch` 1.2, `chain8` 1.6 and `andrews` 2.0 times as long.
const FEW: usize = 4;
/// Times at which exponents so far are kept.
const KEPT: usize = 400;
/// Parts of the run whose exponents tell the uncertainty of the mean.
const BLOCKS: usize = 8;
/// Growth within the second half of the run, as a logarithm, from which on it is exponential; and up to which
/// it is no faster than a power of the time: log 2 for each power.
const EXPONENTIAL: f64 = 10.0;
const POWER: f64 = 3.0;
/// Standard deviations by which the largest exponent of a regular motion may lie above that of growth with
/// the time itself.
const ABOVE: f64 = 2.0;
/// Radians by which the direction of the fastest growth, or a body, turns until a motion has shown what it is
/// like; where nothing turns, growth or decay by a power does.
const SHORT: f64 = 47.0;

const NEAR_UNSTABLE: &str = "small differences grow exponentially, as beside an unstable equilibrium, and a \
    single degree of freedom that nothing drives is not chaotic";

/// What the spectrum tells of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Regime {
    /// Small differences grow exponentially.
    Chaotic,
    /// They grow no faster than a power of the time.
    Regular,
    /// Neither, as the run is too short, or since what grows exponentially cannot be chaotic.
    Undecided,
}

/// The Lyapunov exponents of a motion.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// The scene.
    pub scene: Scene,
    /// The exponents, the largest first \[1/s\].
    pub exponents: Vec<f64>,
    /// Standard deviations of their means over the run, from eight parts of it \[1/s\].
    pub errors: Vec<f64>,
    /// Their sum \[1/s\].
    pub sum: f64,
    /// What the sum is by the dissipation of the scene \[1/s\]: zero without any.
    pub expected_sum: f64,
    /// What they tell.
    pub regime: Regime,
    /// Why that is neither chaotic nor regular.
    pub why: Option<&'static str>,
    /// Times \[s\] and the exponents up to then, for charts.
    pub rows: Vec<(f64, Vec<f64>)>,
    /// How far it was integrated \[s\].
    pub until: f64,
    /// Why it ended before its horizon.
    pub lost: Option<String>,
}

impl Spectrum {
    /// The sum of the exponents less what it is by the dissipation, over the largest of them.
    pub fn defect(&self) -> f64 {
        let most = self.exponents.iter().fold(0.0, |most: f64, exponent| most.max(exponent.abs()));
        if most > 0.0 { (self.sum - self.expected_sum).abs() / most } else { 0.0 }
    }
}

/// All Lyapunov exponents of a scene's motion up to `until` \[s\], or its horizon.
///
/// # Errors
/// The scene has no such exponents, or its motion stops.
pub fn lyapunov(
    template: &Template,
    until: Option<f64>,
    tolerance: Option<f64>,
    pause: &mut Pause,
) -> Result<Spectrum, SensitivityError> {
    let request = SensitivityRequest { at: until, tolerance, ..SensitivityRequest::default() };
    let study = Study::new(template, &request)?;
    if !study.mechanism.frictions.is_empty() {
        let why = "with dry friction directions are lost, and there is no spectrum";
        return Err(SensitivityError::Unsuited(why.into()));
    }
    let mut outcome = Outcome::begun(&study.mechanism, study.plan.clone());
    let mut driver = study.driver(&mut outcome, None)?;
    let (mechanism, motion) = (driver.holding().clone(), driver.motion());
    let mut variation =
        Variation::new(&mechanism, Vec::new(), Vec::new()).map_err(SensitivityError::Unsuited)?;
    let freedom = variation.span(&motion);
    if freedom == 0 {
        let why = "the constraints leave no freedom: neighbouring motions are the same";
        return Err(SensitivityError::Unsuited(why.into()));
    }
    variation.dissipation = Some(Dissipation::new(&mechanism));
    // An integral is one unknown: nothing depends on the angle of the rotor that carries it.
    let count = 2 * freedom - mechanism.integrals().count();
    variation.keep_columns(count);
    if mechanism.coordinates() > FEW {
        variation.expanded = study.expanded(count, &mut []);
    }
    let mut orthonormal = Orthonormal::new(&mechanism, study.plan.until, count);
    orthonormal.is_planar = cannot_be_chaotic(&mechanism, freedom);
    orthonormal.renew(&mut variation, &motion);
    orthonormal.logs.fill(0.0);
    let until = study.plan.until;
    let is_through =
        variation.go(&mut driver, until, &mut outcome, &mut orthonormal, pause).map_err(stopped)?;
    if !is_through {
        return Err(SensitivityError::Stopped("interrupted".into()));
    }
    let lost = variation.lost.clone().or(orthonormal.lost.take()).or_else(|| {
        let ended = driver.ended_by.as_ref().filter(|name| *name != "observer");
        ended.map(|name| format!("event `{name}` ended the run"))
    });
    Ok(orthonormal.spectrum(study.scene, lost))
}

/// What dampers and other forces that depend on rates, and impacts, take off volumes in phase space, as a
/// logarithm.
pub(in crate::run) struct Dissipation {
    /// Where such forces act.
    kernel: Option<Kernel<f64>>,
    /// Integrated so far.
    pub total: f64,
}

impl Dissipation {
    fn new(mechanism: &Mechanism) -> Self {
        let mut none = Self { kernel: None, total: 0.0 };
        none.hold(mechanism);
        none
    }

    /// Goes on beside this mechanism.
    pub fn hold(&mut self, mechanism: &Mechanism) {
        self.kernel = mechanism.is_damped().then(|| Kernel::dense(mechanism));
    }

    /// Adds what is taken off from a time inside a step on, for `h` \[s\], by a quadrature.
    pub(super) fn add(
        &mut self,
        mechanism: &Mechanism,
        step: &mut Step,
        (from, h): (f64, f64),
        rule: &Collocation,
    ) {
        let Some(kernel) = &mut self.kernel else { return };
        let nodes = rule.nodes.iter().zip(&rule.weights);
        self.total += h * nodes
            .map(|(node, weight)| weight * trace(kernel, mechanism, step.at(from + node * h)))
            .sum::<f64>();
    }
}

/// tr(W dQ/dw) at a motion \[1/s\].
fn trace(kernel: &mut Kernel<f64>, mechanism: &Mechanism, motion: &Motion) -> f64 {
    let (t, phi, omega) = plain(motion);
    let n = phi.len();
    kernel.linearise_at::<0>(mechanism, t, &phi, &omega);
    let columns = mechanism.drag(t, &phi, &omega);
    let mut trace = 0.0;
    for (k, mut column) in columns.into_iter().enumerate() {
        crate::dynamics::tree::solve::<f64, 0>(n, &kernel.mass, &kernel.pivot, &mut column);
        let rows = mechanism.constraints.len();
        for r in 0..rows {
            kernel.multiplier[r] = kernel.fold_gradient(r, 0.0, |sum, k, g| sum + g * column[k]);
        }
        if rows > 0 {
            kernel.solve_rows();
            kernel.multiplier_accelerations();
            column[k] -= kernel.load[k];
        }
        trace += column[k];
    }
    trace
}

/// Keeps columns orthonormal, and adds up how they grow.
struct Orthonormal {
    kernel: Kernel<f64>,
    /// The names of the rows that the directions keep.
    kept: Vec<String>,
    /// ν² \[1/s²\].
    rate: f64,
    count: usize,
    /// True where no motion of the mechanism is chaotic.
    is_planar: bool,
    until: f64,
    logs: Vec<f64>,
    /// The first column and the angles at the last time \[rad\], and what they have turned by.
    last: [Vec<f64>; 2],
    turned: f64,
    rows: Vec<(f64, Vec<f64>)>,
    next: usize,
    /// Until when the columns have been followed \[s\], and what has been taken off volumes until then.
    now: f64,
    dissipated: f64,
    lost: Option<String>,
}

impl Orthonormal {
    fn new(mechanism: &Mechanism, until: f64, count: usize) -> Self {
        Self {
            kernel: Kernel::dense_without_rows(mechanism),
            kept: in_force(mechanism).cloned().collect(),
            rate: mechanism.units.time.powi(-2),
            count,
            is_planar: false,
            until,
            logs: vec![0.0; count],
            last: Default::default(),
            turned: 0.0,
            rows: Vec::new(),
            next: 1,
            now: 0.0,
            dissipated: 0.0,
            lost: None,
        }
    }

    /// Makes the columns orthonormal at a motion.
    fn renew(&mut self, variation: &mut Variation, motion: &Motion) {
        let (_, phi, _) = plain(motion);
        let n = phi.len();
        let mechanism = variation.mechanism.clone();
        for (_, k) in mechanism.integrals() {
            variation.columns.iter_mut().for_each(|column| column[k] = 0.0);
        }
        self.kernel.unit_vectors::<0>(&mechanism, &phi);
        self.kernel.mass_matrix::<0>(&mechanism);
        let mass = &self.kernel.mass;
        // What of a column counts: dq, and of dw what the constraints allow.
        let mut flat: Vec<Vec<f64>> = variation.columns.clone();
        if let Some(ground) = &mut variation.ground {
            flat.iter_mut().for_each(|column| ground.flatten(&mechanism, &mut column[n..]));
        }
        let product = |a: &[f64], b: &[f64]| {
            let half = |a: &[f64], b: &[f64]| {
                let mut sum = 0.0;
                for i in 0..n {
                    sum += mass[i * n + i] * a[i] * b[i];
                    for j in i + 1..n {
                        sum += mass[i * n + j] * (a[i] * b[j] + a[j] * b[i]);
                    }
                }
                sum
            };
            self.rate * half(&a[..n], &b[..n]) + half(&a[n..], &b[n..])
        };
        let angles: Vec<f64> = (0..mechanism.bodies.len()).map(|k| motion.unwrapped(k)).collect();
        if let ([last, before], [now, ..]) = (&self.last, &flat[..])
            && !last.is_empty()
        {
            let sizes = product(last, last) * product(now, now);
            let turned = libm::acos((product(last, now) / sizes.sqrt()).clamp(-1.0, 1.0));
            let travel = angles.iter().zip(before).map(|(now, before)| (now - before).abs());
            self.turned += travel.fold(turned, f64::max);
        }
        for j in 0..self.count {
            let mut whole = 0.0;
            // Twice is enough.
            for _ in 0..2 {
                for k in 0..j {
                    let share = product(&flat[j], &flat[k]);
                    subtract(&mut flat, j, k, share);
                    subtract(&mut variation.columns, j, k, share);
                }
            }
            let norm = product(&flat[j], &flat[j]).sqrt();
            whole += libm::log(norm);
            if !whole.is_finite() {
                variation.lose("small differences vanish or are beyond all numbers");
                return;
            }
            self.logs[j] += whole;
            for column in [&mut flat[j], &mut variation.columns[j]] {
                column.iter_mut().for_each(|entry| *entry /= norm);
            }
        }
        self.last = [flat.swap_remove(0), angles];
    }

    fn spectrum(self, scene: Scene, lost: Option<String>) -> Spectrum {
        let t = self.now.max(f64::MIN_POSITIVE);
        let mean: Vec<f64> = self.logs.iter().map(|log| log / t).collect();
        let mut order: Vec<usize> = (0..mean.len()).collect();
        order.sort_by(|&a, &b| mean[b].total_cmp(&mean[a]));
        let errors = self.errors();
        let rows = &self.rows;
        let middle = rows.iter().find(|(time, _)| *time >= 0.5 * t);
        let first = order.first().copied().unwrap_or_default();
        let growth = middle.map(|(_, logs)| self.logs[first] - logs[first]);
        let (regime, why) = match growth {
            Some(growth) if growth >= EXPONENTIAL && self.is_planar => {
                (Regime::Undecided, Some(NEAR_UNSTABLE))
            }
            Some(growth) if growth >= EXPONENTIAL => (Regime::Chaotic, None),
            Some(growth) if growth <= POWER && self.is_a_power(t, mean[first], errors[first]) => {
                (Regime::Regular, None)
            }
            _ => (Regime::Undecided, Some(TOO_SHORT)),
        };
        let sorted = |values: &[f64]| order.iter().map(|&k| values[k]).collect::<Vec<f64>>();
        Spectrum {
            scene,
            exponents: sorted(&mean),
            errors: sorted(&errors),
            sum: mean.iter().sum(),
            expected_sum: self.dissipated / t,
            regime,
            why,
            rows: (rows.iter())
                .map(|(time, logs)| (*time, sorted(logs).iter().map(|log| log / time).collect()))
                .collect(),
            until: self.now,
            lost,
        }
    }

    /// True where a run of `t` \[s\] is long enough to tell exponential growth from that of a power, and the
    /// largest exponent is none but by chance: it is no more than its scatter, which alone would tell nothing
    /// of a scatter that is large.
    fn is_a_power(&self, t: f64, exponent: f64, error: f64) -> bool {
        let is_still = self.turned < std::f64::consts::PI;
        let has_grown = || self.logs.iter().any(|log| log.abs() >= POWER);
        let has_shown = self.turned >= SHORT || is_still && has_grown();
        let (above, open) = (exponent - libm::log1p(t * self.rate.sqrt()) / t, ABOVE * error);
        has_shown && above <= open && above * t <= POWER && (above + open) * 0.5 * t <= EXPONENTIAL
    }

    /// Standard deviations of the mean exponents, from parts of the run.
    fn errors(&self) -> Vec<f64> {
        let at = |part: usize| self.rows.get((part * self.rows.len() / BLOCKS).wrapping_sub(1));
        let none = (0.0, vec![0.0; self.count]);
        let error = |k: usize| {
            let rates: Vec<f64> = (0..BLOCKS)
                .filter_map(|part| {
                    let (from, to) = (at(part).unwrap_or(&none), at(part + 1)?);
                    Some((to.1[k] - from.1[k]) / (to.0 - from.0))
                })
                .collect();
            let count = rates.len() as f64;
            let mean = rates.iter().sum::<f64>() / count;
            let squares = rates.iter().map(|rate| (rate - mean).powi(2)).sum::<f64>();
            (squares / (count * (count - 1.0))).sqrt()
        };
        (0..self.count).map(error).collect()
    }
}

/// The names of the rows that constrain directions.
fn in_force(mechanism: &Mechanism) -> impl Iterator<Item = &String> {
    let redundant = &mechanism.assembly.redundant;
    mechanism.constraints.iter().map(|row| &row.name).filter(|name| !redundant.contains(name))
}

fn subtract(columns: &mut [Vec<f64>], from: usize, what: usize, share: f64) {
    let (before, rest) = columns.split_at_mut(from);
    rest[0].iter_mut().zip(&before[what]).for_each(|(entry, other)| *entry -= share * other);
}

impl Orthonormal {
    /// Ends the columns where their directions are not those of the start any more, or volumes unknown.
    fn check(&self, variation: &mut Variation) {
        if variation.lost.is_some() {
            return;
        }
        let why = if !variation.mechanism.held.is_empty() {
            "a point stays on its wall, and directions are lost"
        } else if !in_force(&variation.mechanism).eq(&self.kept) {
            "a joint closes or opens, and there are fewer or more directions"
        } else if variation.met_several {
            "several walls are met at once, and volumes are not followed"
        } else if variation.set.differ() {
            "an event sets a number otherwise beside the motion, and volumes are not followed"
        } else {
            return;
        };
        variation.lose(why);
    }
}

impl Look for Orthonormal {
    fn next(&self) -> Option<f64> {
        (self.next <= KEPT).then(|| self.until * self.next as f64 / KEPT as f64)
    }

    fn at(&mut self, variation: &mut Variation, motion: &Motion, time: f64) {
        self.next += 1;
        self.stepped(variation, motion, time);
        self.rows.push((time, self.logs.clone()));
    }

    fn crossed(&mut self, variation: &mut Variation, _motion: &Motion, _time: f64) {
        self.check(variation);
    }

    fn stepped(&mut self, variation: &mut Variation, motion: &Motion, time: f64) {
        self.check(variation);
        if variation.lost.is_some() {
            return;
        }
        self.renew(variation, motion);
        self.now = time;
        self.dissipated = variation.dissipation.as_ref().map_or(0.0, |lost| lost.total);
    }
}
