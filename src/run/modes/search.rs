//! The search for equilibria, and the linearization about them.

use super::local::{Local, at_rest};
use super::{
    BALANCED, BRANCHES, CROSSING, Equilibrium, ITERATIONS, LONGEST, Mode, POLISHED, ROUNDING, SLACK, STILL,
    Stability, UNDAMPED,
};
use crate::arithmetic::sum::larger;
use crate::dynamics::compile::WholeTurns;
use crate::dynamics::jacobian::Jacobian;
use crate::dynamics::kernel::Bias;
use crate::dynamics::{Mechanism, Time};
use nalgebra::{Complex, DMatrix, DVector};
use std::sync::Arc;

/// Half the length of differences \[rad, units of length\].
const NEAR: f64 = 1e-6;

/// A search for equilibria.
pub(super) struct EquilibriumSearch<'a> {
    pub(super) local: Local<'a>,
    jacobian: Jacobian,
    /// The largest acceleration at rest where the search starts.
    pub(super) usual: f64,
    /// True where a start went to and fro between branches.
    pub(super) has_jump: bool,
}

impl<'a> EquilibriumSearch<'a> {
    pub(super) fn new<'b>(mechanism: &'a Mechanism, starts: impl Iterator<Item = &'b Vec<f64>>) -> Self {
        let mut local = Local::new(mechanism);
        local.turns = WholeTurns::beside_rows(mechanism);
        let usual = starts.map(|phi| local.pull(phi, 0.0).amax()).fold(0.0, f64::max);
        Self { local, jacobian: Jacobian::new(mechanism), usual, has_jump: false }
    }

    /// The same search with the laws on other branches.
    pub(super) fn on<'b>(&self, mechanism: &'b Mechanism) -> EquilibriumSearch<'b> {
        let local = Local { turns: self.local.turns.clone(), ..Local::new(mechanism) };
        EquilibriumSearch { local, jacobian: Jacobian::new(mechanism), usual: self.usual, has_jump: false }
    }

    /// The equilibrium that is reached from a position with the laws on their branches there, and the
    /// mechanism on these where they are not those of the start.
    pub(super) fn settle_on_branches(&mut self, phi: &[f64]) -> Option<(Vec<f64>, Option<Arc<Mechanism>>)> {
        let of = |mechanism: &Mechanism, phi: &[f64]| {
            Some(mechanism.on_branches_of(&at_rest(phi, 0.0)).ok()?.map(Arc::new))
        };
        let mut phi = phi.to_vec();
        let mut own = of(self.local.mechanism, &phi)?;
        for round in 0..BRANCHES {
            let found = match &own {
                Some(own) => self.on(own).settle(&phi)?,
                None => self.settle(&phi)?,
            };
            let next = of(own.as_deref().unwrap_or(self.local.mechanism), &found)?;
            // On a corner rounding chooses between branches that have the same equilibrium.
            let is_same = round > 0 && self.local.is_same(&phi, &found);
            phi = found;
            match next {
                Some(next) if !is_same => own = Some(next),
                _ => return Some((phi, own)),
            }
        }
        self.has_jump = true;
        None
    }

    /// T' A_q T and T' A_w T.
    fn linear(&mut self, phi: &[f64], tangent: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
        let n = phi.len();
        let still = vec![0.0; n];
        self.jacobian.evaluate(self.local.mechanism, Time::default(), phi, &still, Bias::default());
        [0, n].map(|first| {
            let unit = &self.local.unit;
            let all = DMatrix::from_fn(n, n, |i, j| {
                self.jacobian.acceleration[2 * n * i + first + j] * unit[j] / unit[i]
            });
            tangent.transpose() * all * tangent
        })
    }

    /// T' A_q T to search by: of differences where a derivative has no value, as that of `sqrt(rate^2)` at
    /// rest.
    fn slope(&mut self, phi: &[f64], tangent: &DMatrix<f64>) -> DMatrix<f64> {
        let [mut slope, _] = self.linear(phi, tangent);
        if slope.iter().all(|entry| entry.is_finite()) {
            return slope;
        }
        for j in 0..tangent.ncols() {
            let y = DVector::from_fn(tangent.ncols(), |i, _| if i == j { NEAR } else { 0.0 });
            let [ahead, behind] = [y.clone(), -y].map(|y| {
                let there = self.local.moved(phi, tangent, &y);
                let there = self.local.projected(&there).unwrap_or(there);
                tangent.transpose() * self.local.pull(&there, 0.0)
            });
            slope.set_column(j, &((ahead - behind) / (2.0 * NEAR)));
        }
        slope
    }

    /// The largest derivative of an acceleration where the linearization was evaluated last, also in
    /// directions off the constraints.
    pub(super) fn steepest(&self) -> f64 {
        let (n, unit) = (self.local.unit.len(), &self.local.unit);
        let all = self.jacobian.acceleration.iter().enumerate();
        all.map(|(k, a)| (a * unit[k % n] / unit[k / (2 * n)]).abs()).fold(0.0, larger)
    }

    /// Where a position slides to along its accelerations, as long as its potential energy falls.
    pub(super) fn relaxed(&mut self, phi: &[f64]) -> Option<Vec<f64>> {
        let mut phi = self.local.projected(phi)?;
        let (mut here, mut length) = (self.potential(&phi), LONGEST);
        for _ in 0..ITERATIONS {
            let tangent = self.local.tangent(&phi);
            let mut y = tangent.transpose() * self.local.pull(&phi, 0.0);
            let pull = y.amax();
            if pull == 0.0 {
                break;
            }
            y *= length / pull;
            let there = self.local.moved(&phi, &tangent, &y);
            match self.local.projected(&there).map(|there| (self.potential(&there), there)) {
                Some((potential, there)) if potential < here => {
                    (phi, here, length) = (there, potential, 1.5 * length)
                }
                _ => length *= 0.3,
            }
            if length < 1e-4 {
                break;
            }
        }
        Some(phi)
    }

    /// The equilibrium that is reached from a position, if one is.
    pub(super) fn settle(&mut self, phi: &[f64]) -> Option<Vec<f64>> {
        let mut phi = self.local.projected(phi)?;
        let mut tangent = self.local.tangent(&phi);
        // Nothing can move in this assembly, whatever acts on it.
        if tangent.ncols() == 0 {
            return None;
        }
        let mut left = tangent.transpose() * self.local.pull(&phi, 0.0);
        let mut damping = 0.0;
        for _ in 0..ITERATIONS {
            let slope = self.slope(&phi, &tangent);
            let scale = slope.amax();
            if left.amax() <= STILL * scale.max(f64::MIN_POSITIVE) {
                let last = self.polished(phi, (tangent, slope, left));
                return self.is_balanced(&last).then_some(last);
            }
            // Levenberg and Marquardt: Newton's step, shortened where it does not help.
            let squares = slope.transpose() * &slope;
            let mut step = None;
            for _ in 0..12 {
                let shifted = &squares
                    + DMatrix::identity(squares.nrows(), squares.nrows()) * (damping * scale * scale);
                let Some(mut y) = shifted.lu().solve(&(slope.transpose() * -&left)) else {
                    damping = f64::max(10.0 * damping, 1e-6);
                    continue;
                };
                let longest = y.amax();
                if longest > LONGEST {
                    y *= LONGEST / longest;
                }
                let moved = self.local.moved(&phi, &tangent, &y);
                if let Some(there) = self.local.projected(&moved) {
                    let frame = self.local.tangent(&there);
                    if frame.ncols() == tangent.ncols() {
                        let rest = frame.transpose() * self.local.pull(&there, 0.0);
                        if rest.norm() < left.norm() {
                            step = Some((there, frame, rest));
                            break;
                        }
                    }
                }
                damping = f64::max(10.0 * damping, 1e-6);
            }
            let Some(taken) = step else {
                return (left.amax() <= 100.0 * STILL * scale && self.is_balanced(&phi)).then_some(phi);
            };
            (phi, tangent, left) = taken;
            damping = if damping < 1e-9 { 0.0 } else { 0.1 * damping };
        }
        None
    }

    /// A position nearly at rest, with its tangent, its slope and what is left of the accelerations, as near
    /// as Newton's method comes, which does not move it to where all is as it was.
    fn polished(
        &mut self,
        mut phi: Vec<f64>,
        (mut tangent, mut slope, mut left): (DMatrix<f64>, DMatrix<f64>, DVector<f64>),
    ) -> Vec<f64> {
        for _ in 0..POLISHED {
            let svd = slope.svd(true, true);
            let least = SLACK * svd.singular_values.amax();
            let Ok(y) = svd.solve(&-&left, least) else { break };
            let Some(there) = self.local.projected(&self.local.moved(&phi, &tangent, &y)) else { break };
            let frame = self.local.tangent(&there);
            let rest = frame.transpose() * self.local.pull(&there, 0.0);
            // Not where there is no value, as of a root beyond its corner.
            let is_nearer = rest.norm() < left.norm();
            if frame.ncols() != tangent.ncols() || !is_nearer {
                break;
            }
            slope = self.slope(&there, &frame);
            (phi, tangent, left) = (there, frame, rest);
        }
        phi
    }

    /// True where what is left of the accelerations is small beside others too.
    fn is_balanced(&mut self, phi: &[f64]) -> bool {
        let left = self.local.tangent(phi).transpose() * self.local.pull(phi, 0.0);
        left.amax() <= BALANCED * self.usual
    }

    /// Stability and modes of an equilibrium.
    pub(super) fn linearize(&mut self, phi: Vec<f64>, from_start: bool, freedom: usize) -> Equilibrium {
        let tangent = self.local.tangent(&phi);
        let f = tangent.ncols();
        let is_singular = f != freedom || self.local.conditioning < CROSSING;
        let linear = self.linear(&phi, &tangent);
        if !is_singular && self.is_on_corner(&phi, &tangent, &linear) {
            return self.on_corner(phi, &linear[0], from_start);
        }
        let [stiffness, damping] = linear;
        let [slack, held] = slack(&stiffness);
        let values = eigenvalues(&stiffness, &damping, &held);
        let largest = values.iter().map(|value| value.norm()).fold(0.0, f64::max);
        let growth = values.iter().map(|value| value.re).fold(f64::NEG_INFINITY, f64::max);
        let growth = if slack.ncols() == 0 { growth } else { growth.max(0.0) };
        let stability = if is_singular {
            Stability::Undecided
        } else if growth > ROUNDING * largest {
            Stability::Unstable
        } else if growth < -ROUNDING * largest {
            Stability::AsymptoticallyStable
        } else {
            Stability::Stable
        };
        let mut listed: Vec<Complex<f64>> =
            values.into_iter().filter(|value| value.im >= -1e-3 * ROUNDING * largest).collect();
        listed.sort_by(|a, b| a.norm().total_cmp(&b.norm()).then(a.re.total_cmp(&b.re)));
        let of_slack = slack.column_iter().map(|y| {
            let y = y.map(|y| Complex::new(y, 0.0));
            Mode { eigenvalue: [0.0; 2], frequency: 0.0, damping_ratio: 0.0, shape: self.shape(&y, &tangent) }
        });
        let modes = of_slack.chain(listed.into_iter().map(|value| {
            let frequency = value.norm();
            Mode {
                eigenvalue: [value.re + 0.0, value.im + 0.0],
                frequency,
                damping_ratio: if frequency > 0.0 { 0.0 - value.re / frequency } else { 0.0 },
                shape: self.shape(&direction(value, &stiffness, &damping), &tangent),
            }
        }));
        let modes = if is_singular { Vec::new() } else { modes.collect() };
        let potential = self.potential(&phi);
        Equilibrium {
            potential,
            phi: self.local.turns.principal(&phi),
            stability,
            modes,
            is_on_corner: false,
            from_start,
            is_family: slack.ncols() > 0 && !is_singular,
        }
    }

    /// An equilibrium at which no linearization holds since forces have a corner there.
    fn on_corner(&mut self, phi: Vec<f64>, stiffness: &DMatrix<f64>, from_start: bool) -> Equilibrium {
        let is_finite = stiffness.iter().all(|entry| entry.is_finite());
        Equilibrium {
            potential: self.potential(&phi),
            phi: self.local.turns.principal(&phi),
            stability: Stability::Undecided,
            modes: Vec::new(),
            is_on_corner: true,
            from_start,
            is_family: is_finite && slack(stiffness)[0].ncols() > 0,
        }
    }

    fn potential(&mut self, phi: &[f64]) -> f64 {
        self.local.kernel.unit_vectors::<0>(self.local.mechanism, phi);
        self.local
            .mechanism
            .energy_facing::<f64, 0>(&mut self.local.kernel, phi, &vec![0.0; phi.len()])
            .potential
    }

    /// The shape of a mode along a direction, in the coordinates.
    fn shape(&self, y: &DVector<Complex<f64>>, tangent: &DMatrix<f64>) -> Vec<[f64; 2]> {
        let q = tangent.map(|x| Complex::new(x, 0.0)) * y;
        let largest =
            q.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or(Complex::new(1.0, 0.0));
        q.iter()
            .zip(&self.local.unit)
            .map(|(q, unit)| {
                let share = q / largest * *unit;
                [share.re, share.im]
            })
            .collect()
    }
}

/// Directions that nothing brings back, and all others: orthonormal, one a column.
fn slack(stiffness: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
    let f = stiffness.ncols();
    let svd = stiffness.clone().svd(false, true);
    let least = SLACK * svd.singular_values.amax();
    let right = svd.v_t.unwrap_or_else(|| DMatrix::identity(f, f));
    let (slack, held): (Vec<usize>, Vec<usize>) = (0..f).partition(|&k| svd.singular_values[k] <= least);
    [slack, held].map(|those| DMatrix::from_fn(f, those.len(), |i, j| right[(those[j], i)]))
}

/// Eigenvalues of the linearized motion but for those of zero that the directions left out of `held` have,
/// two each where nothing damps them.  Without damping the others are the square roots of those of the
/// stiffness, which then have all digits of a problem half the size.
fn eigenvalues(stiffness: &DMatrix<f64>, damping: &DMatrix<f64>, held: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let (f, r) = (held.nrows(), held.ncols());
    if damping.amax() == 0.0 {
        if r == 0 {
            return Vec::new();
        }
        let squares = (held.transpose() * stiffness * held).complex_eigenvalues();
        let root = |square: &Complex<f64>| {
            // Real where rounding made a pair of two that are equal.
            let real = square.im.abs() <= 1e-9 * square.norm();
            let root = if real { Complex::new(square.re, 0.0).sqrt() } else { square.sqrt() };
            [root, -root]
        };
        return squares.iter().flat_map(root).collect();
    }
    // Coordinates along the directions that are held, and all rates.
    let mut system = DMatrix::<f64>::zeros(r + f, r + f);
    system.view_mut((0, r), (r, f)).copy_from(&held.transpose());
    system.view_mut((r, 0), (f, r)).copy_from(&(stiffness * held));
    system.view_mut((r, r), (f, f)).copy_from(damping);
    let mut values: Vec<Complex<f64>> = system.complex_eigenvalues().iter().copied().collect();
    let largest = values.iter().map(|value| value.norm()).fold(0.0, f64::max);
    values.retain(|value| r == f || value.norm() > UNDAMPED * largest);
    values
}

/// The direction that an eigenvalue has.
fn direction(value: Complex<f64>, stiffness: &DMatrix<f64>, damping: &DMatrix<f64>) -> DVector<Complex<f64>> {
    let f = stiffness.nrows();
    let matrix = DMatrix::from_fn(f, f, |i, j| {
        let own = if i == j { value * value } else { Complex::new(0.0, 0.0) };
        own - value * damping[(i, j)] - stiffness[(i, j)]
    });
    let svd = matrix.svd(false, true);
    let least = (0..f).min_by(|&a, &b| svd.singular_values[a].total_cmp(&svd.singular_values[b]));
    match (least, svd.v_t) {
        (Some(least), Some(right)) => DVector::from_fn(f, |i, _| right[(least, i)].conj()),
        _ => DVector::zeros(f),
    }
}
