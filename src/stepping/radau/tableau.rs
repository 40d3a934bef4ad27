//! Coefficients of Radau IIA collocation.
//!
//! ```text
//! c:  zeros of d^(s-1)/dx^(s-1) (x^(s-1) (x-1)^s),      a_ij = ∫_0^c_i l_j,    l_j(c_k) = delta_jk
//! A = Σ mu_k r_k l_k:   one real mode and (s-1)/2 pairs of complex ones,  l_k r_k = 1
//! estimate: y1^ - y1 = mu_0 (h f(y) + Σ e_i z_i),   of order s, mu_0 the real mode's value
//! ```
//!
//! Source: E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed. (1996), sections IV.5
//! (table 5.6) and IV.8 (8.3, 8.15-8.19). Nodes and modes were computed to sixty digits; the rest follows
//! from them in double-double.

use crate::arithmetic::{Complex, DoubleDouble, Scalar};

/// A mode of A: its value and vectors.
#[derive(Debug)]
pub(super) struct RadauMode<T: 'static> {
    /// mu.
    pub value: T,
    /// r (s), A r = mu r.
    pub right: &'static [T],
    /// l (s), l A = mu l.
    pub left: &'static [T],
}

/// One Radau IIA method of s stages.
#[derive(Clone, Debug)]
pub(super) struct RadauTableau {
    /// c (s), rising; the last is one.
    pub nodes: &'static [DoubleDouble],
    /// a, row by row (s × s).
    pub a: Vec<f64>,
    /// The real mode.
    pub real: &'static RadauMode<f64>,
    /// One of each pair of complex modes.
    pub pairs: &'static [RadauMode<Complex<f64>>],
    /// e (s).
    pub estimate: Vec<f64>,
    /// 1/Π_(k≠j) (x_j - x_k) of the nodes 0, c (s + 1).
    barycentric: Vec<f64>,
    /// Powers 1…s of the l_j that are zero at 0, row by row (s × s).
    pub powers: Vec<f64>,
    /// What a wrong slope at the start of a step, h times that, is within it at most: max |∫ Π (1 - x/c_i)|,
    /// and as much again.
    pub off: f64,
}

const fn z(re: f64, im: f64) -> Complex<f64> {
    Complex { re, im }
}

const NODES_THREE: [DoubleDouble; 3] = [
    DoubleDouble { hi: 0.1550510257216822, lo: -5.032819811655113e-18 },
    DoubleDouble { hi: 0.6449489742783178, lo: 4.389062567353559e-17 },
    DoubleDouble { hi: 1.0, lo: 0.0 },
];

const REAL_THREE: RadauMode<f64> = RadauMode {
    value: 0.27488882959567734,
    right: &[0.09443876248897524, 0.2502131229653333, 1.0],
    left: &[4.178718591551905, 0.32768282076106237, 0.5233764454994495],
};

const PAIRS_THREE: [RadauMode<Complex<f64>>; 1] = [RadauMode {
    value: z(0.16255558520216132, 0.1849493244071408),
    right: &[
        z(-0.1412552950209542, -0.030029194105147424),
        z(0.20412935229379994, 0.3829421127572619),
        z(1.0, 0.0),
    ],
    left: &[
        z(-2.0893592957759526, 0.2514363174728934),
        z(-0.16384141038053118, -1.2859634749278026),
        z(0.23831177725027522, 0.29801960241411246),
    ],
}];

const NODES_FIVE: [DoubleDouble; 5] = [
    DoubleDouble { hi: 0.05710419611451768, lo: -7.652790650215884e-19 },
    DoubleDouble { hi: 0.2768430136381238, lo: 2.498013745992455e-17 },
    DoubleDouble { hi: 0.5835904323689168, lo: -1.3759588147620281e-17 },
    DoubleDouble { hi: 0.8602401356562195, lo: -3.66688694398211e-17 },
    DoubleDouble { hi: 1.0, lo: 0.0 },
];

const REAL_FIVE: RadauMode<f64> = RadauMode {
    value: 0.15906584442746913,
    right: &[0.013576867344947943, 0.0016179004017190875, 0.07915785334744721, 0.41225608268046143, 1.0],
    left: &[
        27.697693775684087,
        12.783337911304406,
        3.20848938671343,
        -0.9514904122489162,
        0.7415504960259897,
    ],
};

const PAIRS_FIVE: [RadauMode<Complex<f64>>; 2] = [
    RadauMode {
        value: z(0.1331790770182996, 0.07499451183581853),
        right: &[
            z(-0.011478515255229515, -0.01401985889287541),
            z(-0.007668830749180163, 0.024708578426518527),
            z(0.01939846399882895, 0.08180035370375117),
            z(0.40760117128019907, 0.19968242788680252),
            z(1.0, 0.0),
        ],
        left: &[
            z(-16.5209401067595, 4.305721989937646),
            z(-8.688476739531783, -4.849995704764404),
            z(-0.08606453162700278, -0.9573643198484372),
            z(-0.04958488899127132, -1.20934600304247),
            z(0.2656140579191533, 0.5237317439676688),
        ],
    },
    RadauMode {
        value: z(0.06506577854574362, 0.11646852774031707),
        right: &[
            z(-0.010242047817908826, 0.04767387729029572),
            z(0.05017286451737106, -0.09433181918161143),
            z(-0.23053953404341795, 0.1027030453801259),
            z(0.37789390224886127, 0.46674413033249434),
            z(1.0, 0.0),
        ],
        left: &[
            z(2.672093218917456, -1.8740299037199024),
            z(2.2968077838795806, 1.9924828681719424),
            z(-1.5181801617297122, 0.5222078208040094),
            z(0.5253300951157295, -0.5920492840689743),
            z(-0.13638930593214812, 0.22495888507839018),
        ],
    },
];

impl RadauTableau {
    /// The method of three or five stages; `None` for any other number.
    pub fn new(stages: usize) -> Option<Self> {
        let (nodes, real, pairs): (&[DoubleDouble], _, &[_]) = match stages {
            3 => (&NODES_THREE, &REAL_THREE, &PAIRS_THREE),
            5 => (&NODES_FIVE, &REAL_FIVE, &PAIRS_FIVE),
            _ => return None,
        };
        let difference = |j: usize, k: usize| {
            let at = |k: usize| if k == 0 { DoubleDouble::ZERO } else { nodes[k - 1] };
            at(j) - at(k)
        };
        let product = |j: usize| {
            (0..=stages).filter(|&k| k != j).fold(DoubleDouble::ONE, |product, k| product * difference(j, k))
        };
        Some(Self {
            nodes,
            a: matrix(nodes).iter().map(|entry| entry.hi).collect(),
            real,
            pairs,
            estimate: estimate(nodes, DoubleDouble::of(real.value)).iter().map(|entry| entry.hi).collect(),
            powers: powers(nodes),
            off: if stages == 3 { 0.1 } else { 0.04 },
            barycentric: (0..=stages).map(|j| (DoubleDouble::ONE / product(j)).hi).collect(),
        })
    }

    /// Number of stages s.
    pub fn stages(&self) -> usize {
        self.nodes.len()
    }

    /// Writes l_j(theta), j = 1…s, of the polynomial through 0 at 0 and z_j at c_j: `Σ l_j z_j` at the share
    /// `theta` of the step.
    pub fn lagrange(&self, theta: f64, weights: &mut [f64]) {
        for (j, weight) in weights.iter_mut().enumerate() {
            let others = self.nodes.iter().enumerate().filter(|&(k, _)| k != j);
            *weight = others
                .fold(self.barycentric[j + 1] * theta, |product, (_, node)| product * (theta - node.hi));
        }
    }
}

/// A in double-double: the integrals of the polynomials through the nodes, by their coefficients.
fn matrix(nodes: &[DoubleDouble]) -> Vec<DoubleDouble> {
    let s = nodes.len();
    let mut a = vec![DoubleDouble::ZERO; s * s];
    for j in 0..s {
        let coefficients = lagrange_coefficients(nodes, j);
        for i in 0..s {
            let integral =
                coefficients.iter().enumerate().rev().fold(DoubleDouble::ZERO, |sum, (k, &coefficient)| {
                    sum * nodes[i] + coefficient / DoubleDouble::of((k + 1) as f64)
                });
            a[i * s + j] = integral * nodes[i];
        }
    }
    a
}

/// The coefficients of l_j, from the constant up.
fn lagrange_coefficients(nodes: &[DoubleDouble], j: usize) -> Vec<DoubleDouble> {
    let mut coefficients = vec![DoubleDouble::ONE];
    for (_, &node) in nodes.iter().enumerate().filter(|&(k, _)| k != j) {
        let scale = DoubleDouble::ONE / (nodes[j] - node);
        coefficients.push(DoubleDouble::ZERO);
        for k in (0..coefficients.len()).rev() {
            let below = if k == 0 { DoubleDouble::ZERO } else { coefficients[k - 1] };
            coefficients[k] = (below - coefficients[k] * node) * scale;
        }
    }
    coefficients
}

/// The powers 1…s of the polynomials that are one at a node, zero at the others and at 0.
fn powers(nodes: &[DoubleDouble]) -> Vec<f64> {
    let mut with_zero = vec![DoubleDouble::ZERO];
    with_zero.extend_from_slice(nodes);
    (1..=nodes.len())
        .flat_map(|j| lagrange_coefficients(&with_zero, j).into_iter().skip(1).map(|power| power.hi))
        .collect()
}

/// e: what the quadrature of order s with the weight mu_0 at 0 has more than the method, in terms of z.
///
/// z interpolated by a polynomial that is zero at 0 has slopes z'(c_i), so that Σ (b^_i - b_i) h f_i = Σ
/// (b^_i - b_i) z'(c_i).
fn estimate(nodes: &[DoubleDouble], real: DoubleDouble) -> Vec<DoubleDouble> {
    let s = nodes.len();
    // Σ_i (b^_i - b_i) c_i^(k-1) = -mu_0 for k = 1 and 0 beyond: b^ - b = -mu_0 l_i(0).
    let surplus: Vec<_> = (0..s).map(|i| -(real * lagrange_coefficients(nodes, i)[0])).collect();
    let mut with_zero = vec![DoubleDouble::ZERO];
    with_zero.extend_from_slice(nodes);
    (1..=s)
        .map(|j| {
            let coefficients = lagrange_coefficients(&with_zero, j);
            let slope = |x: DoubleDouble| {
                (1..=s).rev().fold(DoubleDouble::ZERO, |sum, k| sum * x + coefficients[k].scale(k as f64))
            };
            (0..s).fold(DoubleDouble::ZERO, |sum, i| sum + surplus[i] * slope(nodes[i])) / real
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TINY: f64 = 1e-30;

    fn power(x: DoubleDouble, k: usize) -> DoubleDouble {
        (0..k).fold(DoubleDouble::ONE, |product, _| product * x)
    }

    /// Σ_j a_ij c_j^(k-1) - c_i^k/k.
    fn defect(nodes: &[DoubleDouble], i: usize, k: usize) -> f64 {
        let (s, a) = (nodes.len(), matrix(nodes));
        let sum = (0..s).fold(DoubleDouble::ZERO, |sum, j| sum + a[i * s + j] * power(nodes[j], k - 1));
        (sum - power(nodes[i], k) / DoubleDouble::of(k as f64)).hi
    }

    #[test]
    fn stages_integrate_powers_up_to_their_number_and_the_last_up_to_the_order() {
        for nodes in [&NODES_THREE[..], &NODES_FIVE] {
            let s = nodes.len();
            for i in 0..s {
                for k in 1..=s {
                    assert!(defect(nodes, i, k).abs() < TINY, "C({k}), row {i} of s = {s}");
                }
            }
            for k in s + 1..2 * s {
                assert!(defect(nodes, s - 1, k).abs() < TINY, "B({k}) of s = {s}");
            }
            assert!(defect(nodes, s - 1, 2 * s).abs() > 1e-8, "s = {s} must not reach order 2s");
        }
    }

    #[test]
    fn the_last_stage_is_the_new_state_and_the_first_order_of_both_tables_is_the_published_one() {
        let root = 6.0_f64.sqrt();
        let tableau = RadauTableau::new(3).expect("three stages");
        let published = [
            (88.0 - 7.0 * root) / 360.0,
            (296.0 - 169.0 * root) / 1800.0,
            (-2.0 + 3.0 * root) / 225.0,
            (296.0 + 169.0 * root) / 1800.0,
            (88.0 + 7.0 * root) / 360.0,
            (-2.0 - 3.0 * root) / 225.0,
            (16.0 - root) / 36.0,
            (16.0 + root) / 36.0,
            1.0 / 9.0,
        ];
        assert!(tableau.a.iter().zip(published).all(|(a, published)| (a - published).abs() < 1e-15));
        // e times 1/mu_0 is (8.19)'s (-13 - 7√6, -13 + 7√6, -1)/3.
        let weights = [-(13.0 + 7.0 * root) / 3.0, (-13.0 + 7.0 * root) / 3.0, -1.0 / 3.0];
        assert!(
            tableau.estimate.iter().zip(weights).all(|(e, weight)| (e - weight).abs() < 1e-14),
            "{:?}",
            tableau.estimate
        );
        assert!((tableau.real.value - 0.274_888_829_595_677_4).abs() < 1e-16);
        assert!(RadauTableau::new(4).is_none());
    }

    #[test]
    fn the_modes_are_those_of_the_matrix() {
        for s in [3, 5] {
            let tableau = RadauTableau::new(s).expect("a method");
            let modes = std::iter::once((
                z(tableau.real.value, 0.0),
                widen(tableau.real.right),
                widen(tableau.real.left),
            ))
            .chain(tableau.pairs.iter().map(|mode| (mode.value, mode.right.to_vec(), mode.left.to_vec())));
            for (value, right, left) in modes {
                let one = right.iter().zip(&left).fold(z(0.0, 0.0), |sum, (&r, &l)| sum + r * l);
                assert!((one - z(1.0, 0.0)).norm_squared() < 1e-26);
                for i in 0..s {
                    let row = (0..s).fold(z(0.0, 0.0), |sum, j| sum + right[j].times(tableau.a[i * s + j]));
                    assert!((row - value * right[i]).norm_squared() < 1e-28, "{i} of s = {s}");
                    let column = (0..s).fold(z(0.0, 0.0), |sum, j| sum + left[j].times(tableau.a[j * s + i]));
                    assert!((column - value * left[i]).norm_squared() < 1e-26, "{i} of s = {s}");
                }
            }
        }
    }

    fn widen(values: &[f64]) -> Vec<Complex<f64>> {
        values.iter().map(|&value| z(value, 0.0)).collect()
    }

    #[test]
    fn the_polynomial_goes_through_its_points_and_the_estimate_has_order_s() {
        for s in [3, 5] {
            let tableau = RadauTableau::new(s).expect("a method");
            let mut weights = vec![0.0; s];
            for power in 1..=s {
                tableau.lagrange(1.7, &mut weights);
                let sum: f64 = weights
                    .iter()
                    .zip(tableau.nodes)
                    .map(|(weight, node)| weight * node.hi.powi(power as i32))
                    .sum();
                assert!((sum - 1.7_f64.powi(power as i32)).abs() < 1e-11, "power {power} of s = {s}: {sum}");
                // z = t^power of y' = power t^(power-1): f(0) = 1 for power one, else 0; the estimate
                // vanishes.
                let rest = if power == 1 { 1.0 } else { 0.0 };
                let error: f64 = tableau
                    .estimate
                    .iter()
                    .zip(tableau.nodes)
                    .map(|(e, node)| e * node.hi.powi(power as i32))
                    .sum::<f64>()
                    + rest;
                assert!(error.abs() < 1e-13, "power {power} of s = {s}: {error}");
            }
        }
    }
}
