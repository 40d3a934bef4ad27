//! What there is to watch of the rows while a mechanism moves: how near to a singular position it is.

use super::svd::RowMatrix;
use crate::dynamics::Mechanism;
use crate::dynamics::kernel::Kernel;

/// Rows up to which this is formed.
const MOST: usize = 64;

impl Mechanism {
    /// The least singular value of the rows' Jacobian over the largest, angles in rad and lengths in sizes of
    /// the mechanism, after an evaluation of the equations; zeros of redundant rows are not counted.  Not a
    /// number where there are no rows, or too many for singular values.
    pub fn conditioning(&self, kernel: &Kernel<f64>) -> f64 {
        let Some(jacobian) = self.measured(kernel) else { return f64::NAN };
        let mut values = jacobian.values();
        values.sort_by(f64::total_cmp);
        let independent =
            (jacobian.rows - self.assembly.redundant.len().min(jacobian.rows)).min(jacobian.columns);
        match values.len().checked_sub(independent).and_then(|first| values.get(first)) {
            Some(least) => least / values.last().unwrap_or(&f64::NAN),
            // Those that are exactly zero are not listed.
            None => 0.0,
        }
    }

    /// The rows' Jacobian in rad and sizes of the mechanism.
    fn measured(&self, kernel: &Kernel<f64>) -> Option<RowMatrix> {
        let (r, n) = (self.constraints.len(), self.coordinates());
        if r == 0 || r > MOST || kernel.jacobian.len() != r * n {
            return None;
        }
        let (size, angles) = (self.size_of_parts(), self.bodies.len());
        let mut measured = RowMatrix::zero(r, n);
        for (i, row) in self.constraints.iter().enumerate() {
            let unit = if row.is_angle() { 1.0 } else { 1.0 / size };
            for (k, (entry, g)) in measured.row_mut(i).iter_mut().zip(&kernel.jacobian[i * n..]).enumerate() {
                *entry = g * unit * if k < angles { 1.0 } else { size };
            }
        }
        Some(measured)
    }
}

#[cfg(test)]
mod tests {
    use crate::dynamics::kernel::{Bias, Kernel};
    use crate::dynamics::{Mechanism, Time};
    use crate::scene::{Bar, Hinge, Place, Scene, Start};

    /// One bar on three equal cranks, upright and at rest under gravity across.
    fn three_cranks(phi: f64) -> Mechanism {
        let bar = |name: &str, length: f64| Bar {
            name: name.into(),
            length,
            mass: 1.0,
            centre: [0.5 * length, 0.0],
            inertia: 0.1,
        };
        let hinge = |name: String, a: (Option<usize>, f64), b: (usize, f64)| Hinge {
            name,
            between: [Place { bar: a.0, point: [a.1, 0.0] }, Place { bar: Some(b.0), point: [b.1, 0.0] }],
        };
        let translations = (0..3).map(|i| hinge(format!("A{i}"), (None, i as f64), (i, 0.0)));
        let tops = (0..3).map(|i| hinge(format!("B{i}"), (Some(3), i as f64), (i, 1.0)));
        let scene = Scene {
            name: "three_cranks".into(),
            gravity: [9.81, 0.0],
            bars: vec![bar("left", 1.0), bar("middle", 1.0), bar("right", 1.0), bar("coupler", 2.0)],
            hinges: translations.chain(tops).collect(),
            start: vec![
                Start { phi, omega: 0.0 },
                Start { phi, omega: 0.0 },
                Start { phi, omega: 0.0 },
                Start { phi: 0.0, omega: 0.0 },
            ],
            until: 1.0,
            every: 0.1,
            ..Scene::default()
        };
        Mechanism::new(&scene).expect("a start")
    }

    fn evaluated(mechanism: &Mechanism, phi: f64) -> Kernel<f64> {
        let mut kernel = Kernel::new(mechanism);
        kernel.accelerations(mechanism, Time::default(), &[phi, phi, phi, 0.0], &[0.0; 4], Bias::default());
        kernel
    }

    #[test]
    fn the_least_singular_value_falls_with_the_distance_of_a_singular_position() {
        let mechanism = three_cranks(1.3);
        let at = |phi: f64| mechanism.conditioning(&evaluated(&mechanism, phi));
        // All links in line at zero.
        for phi in [1e-2, 1e-4, 1e-6] {
            assert!((at(phi) / at(0.1 * phi) - 10.0).abs() < 0.2, "{phi}: {} {}", at(phi), at(0.1 * phi));
        }
        assert!(at(1.3) > 0.05);
    }
}
