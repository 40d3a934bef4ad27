//! How stiff a mechanism is at a moment: its fastest rate by the spectrum of the Jacobian, and which spring
//! or damper makes it.
//!
//! ```text
//! y = (r q, w), r² = |A_q|:      dy'/dy = [0 r; A_q/r A_w],
//!     fastest = |lambda|, decay = -Re lambda of the largest lambda
//! a spring along g:  gamma = g (M⁻¹ - X S⁻¹ Xᵀ) gᵀ,      lambda² + c gamma lambda + k gamma = 0,
//!     E = k s²/2 + s'²/(2 gamma)
//! ```
//!
//! gamma is how much a force along the spring accelerates it, with all rows in force; its mode alone decays
//! and swings as the second line says, and E is the energy in it. Up to sixteen coordinates the eigenvalues
//! are exact; beyond, power iteration finds the largest pair.

use super::jacobian::Jacobian;
use super::kernel::{Bias, Kernel, dot};
use super::tree;
use super::{Mechanism, Motion, Time};
use crate::arithmetic::{Complex, Dual};
use nalgebra::{DMatrix, linalg::Schur};

/// Coordinates up to which all eigenvalues are computed.
const EXACT: usize = 16;
/// Rounds of the power iteration beyond.
const ROUNDS: usize = 60;
/// Coordinates up to which springs are told apart.
const NAMED: usize = 200;
/// Eigenvalues whose squares differ by this share are as large as one another.
const ALIKE: f64 = 1e-6;
/// Eigenvalues below this share of the largest are rounding: zeros come in pairs that it moves by its root.
const ROUNDING: f64 = 1e-6;
/// Share of the fastest rate that a spring must reach by itself to be what makes it.
const SHARE: f64 = 0.5;

/// The fast mode of a mechanism at a moment, and how it compares with the rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stiffness {
    /// Magnitude of the largest eigenvalue of the linearised equations \[rad/s\]; not a number where the
    /// equations are not finite.
    pub fastest: f64,
    /// Minus its real part \[1/s\]: positive where the mode dies away, negative where it grows.
    pub decay: f64,
    /// The rate of everything else \[rad/s\]: gravity on the bars, their own rates, and the laws of motors;
    /// beside a mode that dies away that of the slowest mode at least, which is its own where it is the only
    /// one.
    pub slow: f64,
    /// The spring or damper whose mode it is; `None` where it is no spring's.
    pub culprit: Option<String>,
    /// Energy in that spring's own motion \[J\]: of its stretch and of its rate.
    pub energy: Option<f64>,
    /// The same over the mechanism's energy scale.
    pub share: Option<f64>,
}

impl Stiffness {
    /// Measures it at a time, at angles and positions `phi` \[rad, m\] and rates `omega` \[rad/s, m/s\].
    pub fn at(mechanism: &Mechanism, time: Time, phi: &[f64], omega: &[f64]) -> Self {
        let (lambda, slowest) = if phi.len() <= EXACT {
            spectrum(mechanism, time, phi, omega)
        } else {
            (largest(mechanism, time, phi, omega), 0.0)
        };
        let fastest = lambda.norm_squared().sqrt();
        let mut found =
            Self { fastest, decay: -lambda.re, slow: slow(mechanism, time, omega), ..Self::default() };
        if found.is_damped() {
            found.slow = found.slow.max(slowest);
        }
        // No spring or damper feeds a mode.
        if !found.is_growing()
            && let Some(mode) = fastest_spring(mechanism, time, phi, omega)
            && mode.rate >= SHARE * fastest
        {
            found.culprit = Some(mode.name);
            (found.energy, found.share) = (Some(mode.energy), Some(mode.energy / mechanism.energy_scale));
        }
        found
    }

    /// That of the start of a run, where springs or dampers can make it stiff.
    pub fn at_start(mechanism: &Mechanism, start: &Motion) -> Option<Self> {
        let has_any =
            !mechanism.springs.is_empty() || !mechanism.torsions.is_empty() || !mechanism.forces.is_empty();
        let [phi, omega] = start.rounded();
        has_any.then(|| Self::at(mechanism, start.time, &phi, &omega))
    }

    /// True where the mode dies away within a few periods, or does not swing at all.
    pub fn is_damped(&self) -> bool {
        self.decay > 0.1 * self.fastest
    }

    /// True where the mode grows as fast.
    pub fn is_growing(&self) -> bool {
        -self.decay > 0.1 * self.fastest
    }

    /// How many times faster the mode is than the rest.
    pub fn ratio(&self) -> f64 {
        self.fastest / self.slow
    }

    /// The phase the mode runs through in so many seconds \[rad\].
    pub fn radians(&self, seconds: f64) -> f64 {
        self.fastest * seconds
    }

    /// Its periods in so many seconds.
    pub fn periods(&self, seconds: f64) -> f64 {
        self.radians(seconds) / std::f64::consts::TAU
    }
}

/// The largest eigenvalue, and the magnitude of the smallest of those that constraints leave, zero where it
/// is rounding; by the Schur form of the whole matrix.
fn spectrum(mechanism: &Mechanism, time: Time, phi: &[f64], omega: &[f64]) -> (Complex<f64>, f64) {
    let n = phi.len();
    let mut jacobian = Jacobian::new(mechanism);
    jacobian.evaluate(mechanism, time, phi, omega, Bias::default());
    let by = |i: usize, k: usize| jacobian.acceleration[2 * n * i + k];
    let squares = (0..n)
        .flat_map(|i| (0..n).map(move |k| (i, k)))
        .fold(0.0, |sum: f64, (i, k)| sum + by(i, k) * by(i, k));
    let unknown = (Complex::new(f64::NAN, 0.0), 0.0);
    if !jacobian.acceleration.iter().all(|entry| entry.is_finite()) {
        return unknown;
    }
    // Rates over r weigh as much as coordinates: without it rounding in the Schur form grows with the
    // stiffness.
    let r = if squares > 0.0 { squares.sqrt().sqrt() } else { 1.0 };
    let matrix = DMatrix::from_fn(2 * n, 2 * n, |i, k| match (i < n, k < n) {
        (true, true) => 0.0,
        (true, false) => f64::from(i + n == k) * r,
        (false, true) => by(i - n, k) / r,
        (false, false) => by(i - n, k),
    });
    let Some(schur) = Schur::try_new(matrix, f64::EPSILON, 10_000) else {
        return (largest(mechanism, time, phi, omega), 0.0);
    };
    let values = schur.complex_eigenvalues();
    let mut sizes: Vec<f64> = values.iter().map(|value| libm::hypot(value.re, value.im)).collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    // Those of what constraints do not let move are zero.
    let rows = mechanism.constraints.len().saturating_sub(mechanism.assembly.redundant.len());
    let free = sizes.get(..2 * n.saturating_sub(rows)).unwrap_or_default();
    let slowest = match free {
        [first, .., last] if *last > ROUNDING * first => *last,
        _ => 0.0,
    };
    let values = values.iter().map(|value| Complex::new(value.re, value.im.abs()));
    let largest = values.fold(Complex::<f64>::ZERO, |most, value| {
        // Of a mode that grows and one that dies away as fast, rounding is not to choose: the first counts.
        let share = value.norm_squared() / most.norm_squared();
        let is_alike = (share - 1.0).abs() <= ALIKE;
        if if is_alike { value.re > most.re } else { value.norm_squared() > most.norm_squared() } {
            value
        } else {
            most
        }
    });
    (largest, slowest)
}

/// The largest eigenvalue or pair, by power iteration with products of the Jacobian and a vector: x'' = b x'
/// + c x fitted to three iterates.
fn largest(mechanism: &Mechanism, time: Time, phi: &[f64], omega: &[f64]) -> Complex<f64> {
    let n = phi.len();
    let mut kernel = Kernel::<Dual<1>>::new(mechanism);
    let mut product = |x: &[f64]| -> Vec<f64> {
        let along = |values: &[f64], slopes: &[f64]| -> Vec<Dual<1>> {
            values.iter().zip(slopes).map(|(&value, &slope)| Dual::new(value, [slope])).collect()
        };
        kernel.accelerate::<0>(
            mechanism,
            time,
            &along(phi, &x[..n]),
            &along(omega, &x[n..]),
            Bias::default(),
        );
        x[n..].iter().copied().chain(kernel.load.iter().map(|load| load.slope[0])).collect()
    };
    // No direction is left out, and none is preferred.
    let mut x: Vec<f64> = (0..2 * n).map(|k| 1.0 + 0.5 * libm::cos(1.0 + k as f64)).collect();
    let mut lambda = Complex::ZERO;
    for round in 0..ROUNDS {
        let size = dot(&x, &x).sqrt();
        x.iter_mut().for_each(|x| *x /= size);
        let first = product(&x);
        let second = product(&first);
        if round + 1 == ROUNDS {
            let (a, b, c) = (dot(&first, &first), dot(&first, &x), dot(&x, &x));
            let (p, q) = (dot(&second, &first), dot(&second, &x));
            let determinant = a * c - b * b;
            let (trace, product) = if determinant > 1e-12 * a * c {
                ((p * c - q * b) / determinant, -(q * a - p * b) / determinant)
            } else {
                (b / c, 0.0)
            };
            lambda = root(trace, product);
        }
        x = second;
    }
    lambda
}

/// The larger root of lambda² - trace lambda + product.
fn root(trace: f64, product: f64) -> Complex<f64> {
    let discriminant = 0.25 * trace * trace - product;
    if discriminant >= 0.0 {
        Complex::new(0.5 * trace + discriminant.sqrt().copysign(trace), 0.0)
    } else {
        Complex::new(0.5 * trace, (-discriminant).sqrt())
    }
}

/// The largest of the bars' own rates, their swinging alone under gravity, and the laws' rates \[rad/s\].
fn slow(mechanism: &Mechanism, time: Time, omega: &[f64]) -> f64 {
    let angles = mechanism.bodies.len();
    let swings = (0..angles)
        .map(|k| (mechanism.tree.weight[k].norm_squared().sqrt() / mechanism.tree.diagonal[k]).sqrt());
    let spins = omega[..angles].iter().map(|omega| omega.abs());
    let laws = (mechanism.constraints.iter().filter_map(|row| row.law.as_ref())).flat_map(|law| {
        let rate = law.rates::<f64>(time).0.abs();
        law.sines.iter().map(|sine| sine.frequency.abs()).chain([rate])
    });
    swings.chain(spins).chain(laws).fold(0.0, f64::max).max(1e-3 / mechanism.units.time)
}

/// A spring's own motion.
struct SpringMode {
    name: String,
    /// \[rad/s\]
    rate: f64,
    /// \[J\]
    energy: f64,
}

/// The fastest of the springs, each by itself.
fn fastest_spring(mechanism: &Mechanism, time: Time, phi: &[f64], omega: &[f64]) -> Option<SpringMode> {
    let n = phi.len();
    if n > NAMED
        || !mechanism.tree.is_dense()
        || (mechanism.springs.is_empty() && mechanism.torsions.is_empty())
    {
        return None;
    }
    let mut kernel = Kernel::<f64>::dense(mechanism);
    kernel.linearise_at::<0>(mechanism, time, phi, omega);
    let z = kernel.z.clone();
    let mut modes = Vec::new();
    let mut mode = |name: &str, along: &[f64], stiffness: f64, damping: f64, stretch: f64| {
        let mobility = mobility(&mut kernel, along);
        let (spring, damper) = (stiffness * mobility, damping * mobility);
        let rate = root(-damper, spring).norm_squared().sqrt();
        let speed = dot(along, omega);
        let energy = 0.5 * stiffness * stretch * stretch + 0.5 * speed * speed / mobility;
        SpringMode { name: name.into(), rate, energy }
    };
    for spring in &mechanism.springs {
        let span = spring.span.position(&z);
        let length = span.norm_squared().sqrt();
        // Without a free length it pulls in every direction alike.
        let directions = match spring.free_length == 0.0 {
            true => vec![(Complex::new(1.0, 0.0), span.re), (Complex::new(0.0, 1.0), span.im)],
            false => vec![(span.times(1.0 / length), length - spring.free_length)],
        };
        for (direction, stretch) in directions {
            let mut along = vec![0.0; n];
            spring.span.pull(direction, &z, &mut along);
            modes.push(mode(&spring.name, &along, spring.stiffness, spring.damping, stretch));
        }
        if let (true, [.., first, second]) = (spring.free_length == 0.0, &mut modes[..])
            && (second.rate / first.rate - 1.0).abs() <= ALIKE
        {
            (first.energy, second.energy) = (first.energy + second.energy, first.energy + second.energy);
        }
    }
    for torsion in &mechanism.torsions {
        let mut along = vec![0.0; n];
        torsion.pull(1.0, &mut along);
        let stretch = torsion.between(phi) - torsion.free_angle;
        modes.push(mode(&torsion.name, &along, torsion.stiffness, torsion.damping, stretch));
    }
    modes.into_iter().filter(|mode| mode.rate.is_finite()).max_by(|a, b| a.rate.total_cmp(&b.rate))
}

/// g (M⁻¹ - X S⁻¹ Xᵀ) gᵀ, after [`Kernel::linearise_at`].
fn mobility(kernel: &mut Kernel<f64>, along: &[f64]) -> f64 {
    let n = along.len();
    let mut moved = along.to_vec();
    tree::solve::<f64, 0>(n, &kernel.mass, &kernel.pivot, &mut moved);
    for r in 0..kernel.rows.len() {
        kernel.multiplier[r] = kernel.row_speed(r, &moved);
    }
    kernel.solve_rows();
    kernel.multiplier_accelerations();
    moved
        .iter()
        .zip(&kernel.load)
        .zip(along)
        .fold(0.0, |sum, ((moved, held), along)| sum + (moved - held) * along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scene, read_scene};

    fn scene(name: &str, overrides: &[&str]) -> Scene {
        let overrides: Vec<_> = overrides.iter().map(|text| text.parse().expect("an override")).collect();
        read_scene(format!("examples/scenes/{name}.json").as_ref(), &overrides).expect("a valid scene")
    }

    fn measured(scene: &Scene) -> Stiffness {
        let mechanism = Mechanism::new(scene).expect("equations");
        let start = mechanism.start(scene);
        let [phi, omega] = start.rounded();
        Stiffness::at(&mechanism, start.time, &phi, &omega)
    }

    /// Bar 1 so that the spring has its free length, both at rest; at the source's stiffness the spring is no
    /// faster than gravity.
    fn sprung(factor: f64, damping: f64) -> Scene {
        let mut scene = scene("spring", &[]);
        (scene.springs[0].stiffness, scene.springs[0].damping) = (7.394_287_5 * factor, damping);
        (scene.start[0].phi, scene.start[1].phi) = (1.955_193_101_290_539_7, std::f64::consts::FRAC_PI_2);
        scene
    }

    #[test]
    fn a_stiff_spring_is_found_with_its_rate_and_name() {
        for factor in [1e4, 1e8, 1e12_f64] {
            let found = measured(&sprung(factor, 0.0));
            // 6.2 sqrt(factor) rad/s, measured by an independent program.
            assert!((found.fastest / (6.2 * factor.sqrt()) - 1.0).abs() < 0.03, "{found:?}");
            assert!(found.decay.abs() < 1e-3 * found.fastest && !found.is_damped(), "{found:?}");
            assert_eq!(found.culprit.as_deref(), Some("spring"));
            assert!(found.energy < Some(1e-12) && found.slow > 3.0 && found.slow < 10.0, "{found:?}");
            assert!(
                (found.periods(1.0) - found.fastest / std::f64::consts::TAU).abs() < 1e-9 * found.fastest
            );
        }
    }

    #[test]
    fn dampers_show_as_decay_and_stretch_as_energy() {
        let found = measured(&sprung(1e8, 6675.0));
        assert!(found.is_damped() && found.culprit.is_some(), "{found:?}");
        let overdamped = measured(&sprung(1.0, 1e4));
        assert!(
            (overdamped.decay / overdamped.fastest - 1.0).abs() < 1e-6 && overdamped.fastest > 1e4,
            "{overdamped:?}"
        );
        assert_eq!(overdamped.culprit.as_deref(), Some("spring"));
        let mut stretched = sprung(1e6, 0.0);
        stretched.start[0].phi += 1e-3;
        let mechanism = Mechanism::new(&stretched).expect("equations");
        let z = Complex::unit(stretched.start[0].phi);
        let expected = mechanism.springs[0].energy(&[z, Complex::ZERO]);
        let energy = measured(&stretched).energy.expect("that of the spring");
        assert!((energy / expected - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_spring_without_a_free_length_has_the_energy_of_both_directions() {
        for (at, velocity) in [([0.1, 0.0], [0.0, 0.0]), ([0.03, -0.07], [2.0, 1.0])] {
            let text = format!(
                r#"{{"name": "ball", "gravity": [0, 0],
                "bars": [{{"name": "a", "mass": 1, "centre": [0, 0], "inertia": 0.01, "length": 0.1}}],
                "springs": [{{"name": "s", "between": [{{"body": "ground", "point": [0, 0]}},
                                                    {{"body": "a", "point": [0, 0]}}],
                             "stiffness": 1e4, "free_length": 0}}],
                "start": {{"a": {{"phi": 0, "omega": 0, "origin": {at:?}, "velocity": {velocity:?}}}}},
                "until": 1, "every": 0.1}}"#
            );
            let found = measured(&crate::scene::parse_scene(&text, "ball.json", &[]).expect("a scene"));
            let squared = |of: [f64; 2]| of[0] * of[0] + of[1] * of[1];
            let expected = 0.5 * 1e4 * squared(at) + 0.5 * squared(velocity);
            assert!((found.energy.expect("a spring") / expected - 1.0).abs() < 1e-12, "{found:?}");
        }
    }

    #[test]
    fn gravity_alone_is_nobodys_fault() {
        let found = measured(&scene("free", &[]));
        assert!(found.culprit.is_none() && found.ratio() < 3.0 && found.energy.is_none(), "{found:?}");
    }

    #[test]
    fn power_iteration_finds_what_the_schur_form_does() {
        for scene in [sprung(1e6, 0.0), sprung(1e6, 667.0), sprung(1.0, 1e4)] {
            let mechanism = Mechanism::new(&scene).expect("equations");
            let phi = [scene.start[0].phi, scene.start[1].phi];
            let [exact, found] = [|m: &_, t, phi: &_, omega: &_| spectrum(m, t, phi, omega).0, largest]
                .map(|method| method(&mechanism, Time::default(), &phi, &[0.0, 0.0]));
            assert!((exact - found).norm_squared() < 1e-6 * exact.norm_squared(), "{exact:?} {found:?}");
        }
    }
}
