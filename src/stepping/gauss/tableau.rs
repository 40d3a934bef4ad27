//! Coefficients of Gauss collocation, computed once in double-double.
//!
//! ```text
//! c_i   = (1 + x_i)/2 with P_s(x_i) = 0,      b_i = 1/((1 - x_i²) P_s'(x_i)²)
//! a_ij  = ∫_0^c_i l_j,    l_j(c_k) = delta_jk     (by the method's own quadrature, exact for degree 2s - 1)
//! mu_ij = a_ij/b_j = 1/2 + sigma_ij,      nu_ij = (1/b_j) ∫_1^(1+c_i) l_j
//! ```
//!
//! Symplectic is `mu_ij + mu_ji = 1`, symmetric in time is `mu_ij = mu_(s+1-j)(s+1-i)`.  With i' = s+1-i the
//! mirror image of stage i, both together say that sigma splits into a part that acts on `L_j + L_j'` and is
//! odd in i, and one that acts on `L_j - L_j'` and is even in i, and that one is minus the transpose of the
//! other.  So one matrix of half the size is all there is to round, and both properties hold exactly,
//! whatever its entries:
//!
//! ```text
//! Σ_j sigma_ij L_j = ± Σ_j eta_ij (L_j + L_j') - Σ_j eta_ji (L_j - L_j')
//!     (j <= s/2; + for i <= s/2, - for its mirror image)
//! eta_ij = (sigma_ij + sigma_ij')/2,    eta_ij = sigma_ij where j = j'
//! ```
//!
//! Stages lie in lanes: the first half in the first vector, their mirror images in the same order in the
//! second.
//!
//! Source: E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical Integration*, 2nd ed. (2006), sections
//! II.1.3 (Gauss), IV.2 (theorem 2.2), V.2 (symmetry); nodes and weights: M. Abramowitz, I. Stegun, *Handbook
//! of Mathematical Functions* (1964), 25.4.29.

use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::{DoubleDouble, Scalar};

/// Nodes, weights and matrices of one Gauss method of s stages.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct GaussTableau {
    /// c (s), rising, in (0, 1).
    pub nodes: Vec<DoubleDouble>,
    /// b (s), positive.
    pub weights: Vec<DoubleDouble>,
    /// eta, column by column: factors of `L_j + L_j'`.
    pub even: [[f64; 4]; 4],
    /// -etaᵀ, column by column: factors of `L_j - L_j'`.
    pub odd: [[f64; 4]; 4],
    /// nu, one column a stage, its rows in lanes: the collocation polynomial of one step carried on over the
    /// next.
    pub forecast: Vec<Octet>,
}

/// The lane of stage i of s.
pub(super) fn lane(i: usize, s: usize) -> usize {
    if 2 * i < s { i } else { LANES / 2 + s - 1 - i }
}

impl GaussTableau {
    /// The method of `stages` stages.
    pub fn new(stages: usize) -> Self {
        let (nodes, weights) = quadrature(stages);
        let (mut even, mut odd) = ([[0.0; 4]; 4], [[0.0; 4]; 4]);
        let mut forecast = vec![Octet::default(); stages];
        for j in 0..stages {
            for i in 0..stages {
                forecast[j].0[lane(i, stages)] =
                    (integral(&nodes, &weights, j, DoubleDouble::ONE, nodes[i]) / weights[j]).hi;
            }
        }
        let sigma = |i: usize, j: usize| {
            integral(&nodes, &weights, j, DoubleDouble::ZERO, nodes[i]) / weights[j] - DoubleDouble::of(0.5)
        };
        // The stage in the middle is its own image: nothing moves it but the odd part.
        for i in 0..stages / 2 {
            for j in 0..stages.div_ceil(2) {
                let image = stages - 1 - j;
                let eta = (sigma(i, j) + sigma(i, image)).ldexp(0.5).hi;
                (even[j][i], odd[i][j]) = (eta, -eta);
            }
        }
        Self { nodes, weights, even, odd, forecast }
    }

    /// a_ij.
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        integral(&self.nodes, &self.weights, j, DoubleDouble::ZERO, self.nodes[i]).hi
    }

    /// (1/b_j) ∫_0^share l_j: what each increment has given up to a share of the step.
    pub fn reached(&self, share: f64) -> Vec<f64> {
        let [nodes, weights] =
            [&self.nodes, &self.weights].map(|all| all.iter().map(|x| x.hi).collect::<Vec<f64>>());
        let of = |j: usize| integral(&nodes, &weights, j, 0.0, share) / weights[j];
        (0..nodes.len()).map(of).collect()
    }

    /// (b_i/b_j) l_j(1 + c_i): what increment j of one step gives to increment i of the next.
    pub fn carried(&self, i: usize, j: usize) -> f64 {
        (lagrange(&self.nodes, j, DoubleDouble::ONE + self.nodes[i]) * self.weights[i] / self.weights[j]).hi
    }
}

/// Nodes and weights on [0, 1].
fn quadrature(stages: usize) -> (Vec<DoubleDouble>, Vec<DoubleDouble>) {
    let (mut nodes, mut weights) = (vec![DoubleDouble::of(0.5); stages], vec![DoubleDouble::ZERO; stages]);
    let s = stages as f64;
    for i in 0..stages.div_ceil(2) {
        // Tricomi's estimate of the root, then Newton; each iteration doubles the digits.
        let mut x = DoubleDouble::of(libm::cos(std::f64::consts::PI * (i as f64 + 0.75) / (s + 0.5)));
        if 2 * i + 1 == stages {
            x = DoubleDouble::ZERO;
        }
        for _ in 0..8 {
            let (p, slope) = legendre(stages, x);
            x -= p / slope;
        }
        let (_, slope) = legendre(stages, x);
        let weight = DoubleDouble::ONE / ((DoubleDouble::ONE - x * x) * slope * slope);
        (nodes[i], nodes[stages - 1 - i]) =
            ((DoubleDouble::ONE - x).ldexp(0.5), (DoubleDouble::ONE + x).ldexp(0.5));
        (weights[i], weights[stages - 1 - i]) = (weight, weight);
    }
    (nodes, weights)
}

/// P_s and P_s' at `x`, by Bonnet's recurrence.
fn legendre(s: usize, x: DoubleDouble) -> (DoubleDouble, DoubleDouble) {
    let (mut before, mut p) = (DoubleDouble::ONE, x);
    for k in 2..=s {
        let k = k as f64;
        (before, p) = (p, ((x * p).scale(2.0 * k - 1.0) - before.scale(k - 1.0)) / DoubleDouble::of(k));
    }
    (p, (before - x * p).scale(s as f64) / (DoubleDouble::ONE - x * x))
}

/// The integral of l_j from `from` to `from + length`.
fn integral<T: Scalar>(nodes: &[T], weights: &[T], j: usize, from: T, length: T) -> T {
    let each = nodes.iter().zip(weights);
    length * each.fold(T::ZERO, |sum, (&c, &b)| sum + b * lagrange(nodes, j, from + length * c))
}

/// l_j at `x`.
fn lagrange<T: Scalar>(nodes: &[T], j: usize, x: T) -> T {
    let others = (0..nodes.len()).filter(|&k| k != j);
    others.fold(T::ONE, |product, k| product * ((x - nodes[k]) / (nodes[j] - nodes[k])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::Complex;
    use crate::dynamics::tree::{self, Tree};

    /// Bound on every identity below; the pair carries 1.2e-32.
    const TINY: f64 = 1e-30;

    fn power(x: DoubleDouble, k: usize) -> DoubleDouble {
        (0..k).fold(DoubleDouble::ONE, |product, _| product * x)
    }

    fn reciprocal(k: usize) -> DoubleDouble {
        DoubleDouble::ONE / DoubleDouble::of(k as f64)
    }

    fn a(tableau: &GaussTableau, i: usize, j: usize) -> DoubleDouble {
        integral(&tableau.nodes, &tableau.weights, j, DoubleDouble::ZERO, tableau.nodes[i])
    }

    #[test]
    fn weights_integrate_every_power_up_to_twice_the_stages() {
        for s in 2..=8 {
            let tableau = GaussTableau::new(s);
            let quadrature = |k: usize| {
                tableau
                    .nodes
                    .iter()
                    .zip(&tableau.weights)
                    .fold(DoubleDouble::ZERO, |sum, (&c, &b)| sum + b * power(c, k - 1))
            };
            for k in 1..=2 * s {
                assert!((quadrature(k) - reciprocal(k)).hi.abs() < TINY, "B({k}) of s = {s}");
            }
            let short = (quadrature(2 * s + 1) - reciprocal(2 * s + 1)).hi.abs();
            assert!(short > 1e-12, "s = {s} must not reach order 2s + 1: {short:e}");
        }
    }

    #[test]
    fn stages_integrate_every_power_up_to_the_stages() {
        for s in 2..=8 {
            let tableau = GaussTableau::new(s);
            for i in 0..s {
                for k in 1..=s {
                    let sum = (0..s).fold(DoubleDouble::ZERO, |sum, j| {
                        sum + a(&tableau, i, j) * power(tableau.nodes[j], k - 1)
                    });
                    let exact = power(tableau.nodes[i], k) * reciprocal(k);
                    assert!((sum - exact).hi.abs() < TINY, "C({k}), row {i} of s = {s} (k = 1: row sum)");
                }
            }
        }
    }

    #[test]
    fn the_exact_coefficients_are_symplectic() {
        for s in 2..=8 {
            let tableau = GaussTableau::new(s);
            let b = &tableau.weights;
            for i in 0..s {
                for j in 0..s {
                    let defect = b[i] * a(&tableau, i, j) + b[j] * a(&tableau, j, i) - b[i] * b[j];
                    assert!(defect.hi.abs() < TINY, "b_i a_ij + b_j a_ji = b_i b_j at {i}, {j} of s = {s}");
                }
            }
        }
    }

    /// sigma as the stored halves make it, exactly.
    fn stored(tableau: &GaussTableau, s: usize, i: usize, j: usize) -> DoubleDouble {
        let (row, column) = (lane(i, s) % 4, lane(j, s) % 4);
        let sign = |mirrored: bool| if mirrored { -1.0 } else { 1.0 };
        let (even, odd) = (
            tableau.even[column][row] * sign(lane(i, s) > 3),
            tableau.odd[column][row] * sign(lane(j, s) > 3),
        );
        DoubleDouble::sum(even, odd)
    }

    #[test]
    fn the_stored_coefficients_are_symplectic_and_symmetric_exactly() {
        for s in 2..=8 {
            let tableau = GaussTableau::new(s);
            for i in 0..s {
                for j in 0..s {
                    let (sigma, mirror) =
                        (stored(&tableau, s, i, j), stored(&tableau, s, s - 1 - j, s - 1 - i));
                    if i != j {
                        assert_eq!(
                            sigma,
                            -stored(&tableau, s, j, i),
                            "mu_ij + mu_ji = 1 at {i}, {j} of s = {s}"
                        );
                    }
                    assert_eq!(sigma, mirror, "at {i}, {j} of s = {s}");
                    let mu = a(&tableau, i, j) / tableau.weights[j];
                    assert!(
                        (DoubleDouble::of(0.5) + sigma - mu).hi.abs() < 1.2e-16,
                        "mu at {i}, {j} of s = {s}"
                    );
                }
                assert_eq!(stored(&tableau, s, i, i), DoubleDouble::ZERO, "mu_ii = 1/2");
            }
        }
    }

    #[test]
    fn the_forecast_carries_polynomials_on() {
        for s in 2..=8 {
            let tableau = GaussTableau::new(s);
            for i in 0..s {
                for k in 1..=s {
                    let sum = (0..s).fold(0.0, |sum, j| {
                        sum + tableau.forecast[j].0[lane(i, s)]
                            * (tableau.weights[j] * power(tableau.nodes[j], k - 1)).hi
                    });
                    let exact = ((power(DoubleDouble::ONE + tableau.nodes[i], k) - DoubleDouble::ONE)
                        * reciprocal(k))
                    .hi;
                    assert!(
                        (sum - exact).abs() < 1e-10 * exact,
                        "degree {k}, row {i} of s = {s}: {sum} for {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn two_stages_are_the_textbook_ones() {
        // Hammer and Hollingsworth (1955): c = 1/2 ∓ √3/6, a_12 = 1/4 - √3/6.
        let (tableau, root) = (GaussTableau::new(2), DoubleDouble::of(3.0).sqrt() / DoubleDouble::of(6.0));
        assert!((tableau.nodes[0] - (DoubleDouble::of(0.5) - root)).hi.abs() < TINY);
        assert!((a(&tableau, 0, 1) - (DoubleDouble::of(0.25) - root)).hi.abs() < TINY);
    }

    /// (q, p)' of two equal slender bars in units of their mass, length and g, in double-double.
    fn rate(tree: &Tree, y: &[DoubleDouble; 4]) -> [DoubleDouble; 4] {
        let z = [Complex::unit(y[0]), Complex::unit(y[1])];
        let (mut mass, mut twist, mut pivot) =
            ([DoubleDouble::ZERO; 4], [DoubleDouble::ZERO; 4], [DoubleDouble::ZERO; 2]);
        let (mut omega, mut force) = ([y[2], y[3]], [DoubleDouble::ZERO; 2]);
        tree.mass_matrix::<DoubleDouble, 2>(&z, &mut mass, &mut twist);
        tree::factor::<DoubleDouble, 2>(2, &mut mass, &mut pivot);
        tree::solve::<DoubleDouble, 2>(2, &mass, &pivot, &mut omega);
        tree.lagrangian_forces::<DoubleDouble, 2>(&z, &omega, &twist, &mut force);
        [omega[0], omega[1], force[0], force[1]]
    }

    /// The state at time 1 after `steps` steps, all in double-double.
    fn simulate(tree: &Tree, stages: usize, steps: usize) -> [DoubleDouble; 4] {
        let tableau = GaussTableau::new(stages);
        let h = reciprocal(steps);
        let matrix: Vec<DoubleDouble> =
            (0..stages * stages).map(|k| h * a(&tableau, k / stages, k % stages)).collect();
        let mut y = [0.5, 0.2, 0.2, -0.1].map(DoubleDouble::of);
        for _ in 0..steps {
            let mut rates = vec![rate(tree, &y); stages];
            let add = |rates: &[[DoubleDouble; 4]], row: &dyn Fn(usize) -> DoubleDouble| {
                std::array::from_fn(|k| (0..stages).fold(y[k], |sum, j| sum + row(j) * rates[j][k]))
            };
            for _ in 0..40 {
                rates = (0..stages).map(|i| rate(tree, &add(&rates, &|j| matrix[i * stages + j]))).collect();
            }
            y = add(&rates, &|j| h * tableau.weights[j]);
        }
        y
    }

    #[test]
    fn the_order_shows_below_the_rounding_of_doubles() {
        let weight = vec![Complex::new(1.5, 0.0), Complex::new(0.5, 0.0)];
        let coupling = vec![Complex::ZERO, Complex::new(0.5, 0.0), Complex::ZERO, Complex::ZERO];
        let tree = Tree {
            coordinates: 2,
            angles: 2,
            coupling,
            diagonal: vec![4.0 / 3.0, 1.0 / 3.0],
            weight,
            off_axis: false,
        };
        let exact = simulate(&tree, 8, 100);
        for stages in 2..=8 {
            let error = |steps: usize| {
                let y = simulate(&tree, stages, steps);
                (0..4).map(|k| (y[k] - exact[k]).hi.powi(2)).sum::<f64>().sqrt()
            };
            // The finest pair whose errors stay above the rounding of pairs.
            let steps = if stages < 8 { 27 } else { 20 };
            let (coarse, fine) = (error(steps), error(2 * steps));
            let order = (coarse / fine).log2();
            println!("s = {stages}: {order:.2} from {coarse:.1e} to {fine:.1e}");
            assert!(
                (order - 2.0 * stages as f64).abs() < 0.35,
                "s = {stages}: order {order:.2} from {coarse:e} to {fine:e}"
            );
        }
    }
}
