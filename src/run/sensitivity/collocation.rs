//! A step of the variational equation along a known motion, by Gauss collocation.
//!
//! ```text
//! K_i = B_i (dq + c_i h dw + h² Σ_j (a a)_ij K_j) + C_i (dw + h Σ_j a_ij K_j) + F_i
//!     B, C = da/dq, da/dw on dual numbers; F = da/dp
//! dq += h dw + h² Σ_i b_i (1 - c_i) K_i,   dw += h Σ_i b_i K_i
//! ```
//!
//! Six stages, order 12: on a step of [`taylor`](crate::stepping::taylor), which is a seventh of the radius
//! of convergence, the error is about 1e-15 of what is integrated.  How far it is from that, the last
//! coefficient of K in Legendre polynomials tells: it falls with the power 5 of the step where the error
//! falls with 12.
//!
//! Source: E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical Integration*, 2nd ed. (2006), section
//! II.1.3.

use super::super::trust::eliminate;
use crate::stepping::gauss::collocation;

/// Stages.
pub(super) const STAGES: usize = 6;

/// Degrees from the last coefficient known to that of the error.
const FALLS: i32 = STAGES as i32 + 1;

/// How far a step is from being resolved.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tails {
    /// The last Legendre coefficient of K over the size of what is integrated.
    pub last: f64,
    /// What the step leaves, over the size of rates, to which dq counts over the unit of time or a step that
    /// is longer: the coefficient of degree 12, as far as those of degree 3 to 5 fall.  Next to a pole or a
    /// corner they hardly do.
    pub rough: f64,
}

/// How far a column need not be resolved.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ColumnLimits {
    /// Size below which it need not be.
    pub floor: f64,
    /// What rounding leaves of its forcing.
    pub noise: f64,
}

/// What coefficients take of noise at the nodes, at most.
const NOISE: f64 = 4.0;

/// The method with its scratch space.
pub(super) struct Collocation {
    /// Nodes in a step of length 1.
    pub nodes: Vec<f64>,
    pub weights: Vec<f64>,
    /// a, and a a.
    coupling: [Vec<f64>; 2],
    /// What the last three Legendre coefficients take of every stage.
    last: [Vec<f64>; 3],
    system: Vec<f64>,
    /// The rotors of integrals.
    rotors: Vec<usize>,
}

impl Collocation {
    /// The method for coordinates of which these are the rotors of integrals.
    pub fn new(rotors: Vec<usize>) -> Self {
        let [nodes, weights, coupling] = collocation(STAGES);
        let entry = |k: usize| {
            (0..STAGES).map(|j| coupling[k / STAGES * STAGES + j] * coupling[j * STAGES + k % STAGES]).sum()
        };
        let square = (0..STAGES * STAGES).map(entry).collect();
        let last = [STAGES - 3, STAGES - 2, STAGES - 1].map(|degree| {
            (nodes.iter().zip(&weights))
                .map(|(node, weight)| (2 * degree + 1) as f64 * weight * legendre(degree, 2.0 * node - 1.0))
                .collect()
        });
        Self { nodes, weights, coupling: [coupling, square], last, system: Vec::new(), rotors }
    }

    /// Solves for a step of columns (dq, dw) of n coordinates; `pull` has B and C at the nodes, n × 2n row by
    /// row, one node after the other, `forcing` F of every column, node by node, empty for columns without.
    ///
    /// `limits` are how far columns need not be resolved.  `None` where there is no solution.
    pub fn solve(
        &mut self,
        (h, unit): (f64, f64),
        pull: &[f64],
        columns: &[Vec<f64>],
        (forcing, limits): (&[Vec<f64>], &[ColumnLimits]),
    ) -> Option<Tails> {
        let mut tails = Tails::default();
        let Some(n) = columns.first().map(|column| column.len() / 2) else { return Some(tails) };
        let (size, width) = (STAGES * n, STAGES * n + columns.len());
        self.fill(n, h, pull, columns, forcing);
        if !eliminate(size, width, &mut self.system) {
            return None;
        }
        let Self { last, system, rotors, .. } = self;
        let stage = |i: usize, row: usize, k: usize| system[(i * n + row) * width + size + k];
        // An integral has a size of its own, and the angle of its rotor none.
        let own: Vec<usize> = (0..n).filter(|row| !rotors.contains(row)).collect();
        let groups = || std::iter::once(&own[..]).chain(rotors.chunks(1));
        let all = columns.iter().zip(limits).enumerate();
        for ((k, (column, &ColumnLimits { floor, noise })), rows) in
            all.flat_map(|column| groups().map(move |rows| (column, rows)))
        {
            let (mut left, mut earlier, mut whole, mut rates) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
            for &row in rows {
                let part = |last: &[f64]| (0..STAGES).map(|i| last[i] * stage(i, row, k)).sum::<f64>().abs();
                let [before, but_one, highest] = last.each_ref().map(|last| part(last));
                let highest = (highest - NOISE * noise).max(0.0);
                (left, earlier) = (left.max(highest), earlier.max(before).max(but_one));
                let most = (0..STAGES).fold(0.0, |most: f64, i| most.max(stage(i, row, k).abs()));
                let rate = (h * most).max(column[n + row].abs());
                let place = if rotors.contains(&row) { 0.0 } else { column[row].abs() };
                whole = whole.max(rate).max(place / h);
                rates = rates.max(rate).max(place / h.max(unit));
            }
            if whole.is_nan() || left.is_nan() {
                return None;
            }
            if whole > 0.0 {
                tails.last = tails.last.max(h * left / (whole + floor));
            }
            if rates > 0.0 && left > 0.0 {
                let falls = (left / earlier).min(1.0).powi(FALLS);
                tails.rough = tails.rough.max(falls * h * left / (rates + floor));
            }
        }
        Some(tails)
    }

    /// Takes the columns through the step that was solved for last.
    pub fn take(&self, h: f64, columns: &mut [Vec<f64>]) {
        let Some(n) = columns.first().map(|column| column.len() / 2) else { return };
        let (size, width) = (STAGES * n, STAGES * n + columns.len());
        let Self { nodes, weights, system, .. } = self;
        for (k, column) in columns.iter_mut().enumerate() {
            for row in 0..n {
                let mut turn = 0.0;
                let mut rate = 0.0;
                for i in 0..STAGES {
                    let slope = weights[i] * system[(i * n + row) * width + size + k];
                    turn += (1.0 - nodes[i]) * slope;
                    rate += slope;
                }
                column[row] += h * (column[n + row] + h * turn);
                column[n + row] += h * rate;
            }
        }
    }

    /// The equations of the stages, with their right sides.
    fn fill(&mut self, n: usize, h: f64, pull: &[f64], columns: &[Vec<f64>], forcing: &[Vec<f64>]) {
        let Self { nodes, coupling: [a, aa], system, .. } = self;
        let (size, width) = (STAGES * n, STAGES * n + columns.len());
        system.clear();
        system.resize(size * width, 0.0);
        for i in 0..STAGES {
            for row in 0..n {
                let line = &mut system[(i * n + row) * width..][..width];
                let (turn, drag) = pull[(i * n + row) * 2 * n..][..2 * n].split_at(n);
                for k in 0..n {
                    for j in 0..STAGES {
                        line[j * n + k] =
                            -h * (h * aa[i * STAGES + j] * turn[k] + a[i * STAGES + j] * drag[k]);
                    }
                }
                line[i * n + row] += 1.0;
                for ((right, column), forcing) in line[size..].iter_mut().zip(columns).zip(forcing) {
                    *right = forcing.get(i * n + row).copied().unwrap_or(0.0);
                    for k in 0..n {
                        *right += turn[k] * (column[k] + nodes[i] * h * column[n + k]);
                        *right += drag[k] * column[n + k];
                    }
                }
            }
        }
    }
}

/// The Legendre polynomial of a degree at x.
fn legendre(degree: usize, x: f64) -> f64 {
    let (mut before, mut now) = (0.0, 1.0);
    for k in 0..degree {
        let k = k as f64;
        (before, now) = (now, ((2.0 * k + 1.0) * x * now - k * before) / (k + 1.0));
    }
    now
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_forced_oscillation_is_met_to_its_order() {
        // x'' = -4 x + cos t, x(0) = 0.3, x'(0) = 0.1: x = cos t / 3 + (0.3 - 1/3) cos 2t + 0.05 sin 2t.
        let error = |steps: usize| {
            let h = 2.0 / steps as f64;
            let (mut method, mut columns) = (Collocation::new(Vec::new()), vec![vec![0.3, 0.1]]);
            for k in 0..steps {
                let forcing =
                    method.nodes.iter().map(|node| libm::cos((k as f64 + node) * h)).collect::<Vec<_>>();
                let pull = [-4.0, 0.0].repeat(STAGES);
                let tails = method.solve((h, 1.0), &pull, &columns, (&[forcing], &[ColumnLimits::default()]));
                assert!(tails.is_some_and(|tails| tails.last < 1.0));
                method.take(h, &mut columns);
            }
            let exact = libm::cos(2.0) / 3.0 + (0.3 - 1.0 / 3.0) * libm::cos(4.0) + 0.05 * libm::sin(4.0);
            (columns[0][0] - exact).abs()
        };
        let [one, two] = [error(1), error(2)];
        assert!(one < 1e-6 && two < one / 2000.0, "{one:e} {two:e}");
    }

    #[test]
    fn the_last_coefficient_of_a_polynomial_of_lower_degree_is_zero() {
        let method = Collocation::new(Vec::new());
        let sum = |degree: i32| {
            let powers = method.nodes.iter().map(|node| node.powi(degree));
            powers.zip(&method.last[2]).map(|(power, last)| power * last).sum::<f64>()
        };
        assert!((0..5).all(|degree| sum(degree).abs() < 1e-14) && sum(5).abs() > 1e-3);
    }
}
