//! A step's own matrix from the Jacobian, for a few coordinates under gravity alone.
//!
//! ```text
//! K_i = B_i (dq + c_i h dw + h² Σ_j (a a)_ij K_j) + C_i (dw + h Σ_j a_ij K_j)
//!     da = B dq + C dw at the Gauss points c_i
//! Phi (dq, dw) = (dq + h dw + h² Σ_i b_i (1 - c_i) K_i,  dw + h Σ_i b_i K_i)
//! ```
//!
//! Order 8, A-stable, symplectic: of a conservative motion it is wrong in phase only, and cheaper than a
//! series on dual numbers.  Phases must be right for long: where differences grow as the time, those that lag
//! behind the motion grow into others.  With order 6 at the same cost a pendulum's were off by 3 % after 200
//! periods.
//!
//! Source: E. Hairer, C. Lubich, G. Wanner, *Geometric Numerical Integration*, 2nd ed. (2006), section
//! II.1.3.

use crate::dynamics::Mechanism;
use crate::dynamics::tree::{self, Tree};
use crate::stepping::gauss::collocation;

/// Stages.
pub const STAGES: usize = 4;
/// Step over the fastest rate.
const SPAN: f64 = 0.55;

/// Diagonal of M over its pivots, with all links in line, beyond which a motion has moments much faster than
/// all before: where heavy members jerk light ones straight.
const LIGHT: f64 = 30.0;

/// True of a mechanism whose rates change no faster than they are: a step is chosen by those of the step
/// before.
pub fn is_slow(mechanism: &Mechanism) -> bool {
    let Tree { coordinates: n, coupling, diagonal, .. } = &mechanism.tree;
    let mut mass: Vec<f64> = coupling.iter().map(|h| h.norm_squared().sqrt()).collect();
    (0..*n).for_each(|i| mass[i * n + i] = diagonal[i]);
    let mut pivot = vec![0.0; *n];
    tree::factor::<f64, 0>(*n, &mut mass, &mut pivot);
    pivot.iter().zip(diagonal).all(|(pivot, diagonal)| (0.0..LIGHT).contains(&(pivot * diagonal)))
}

/// The method, with its scratch space.
pub struct TangentGauss {
    /// Where in a step the motion is asked for.
    pub nodes: Vec<f64>,
    weights: Vec<f64>,
    /// a, and a a.
    coupling: [Vec<f64>; 2],
    system: Vec<f64>,
    /// The length of the next step, once the nodes of this one are known.
    pub next: f64,
}

impl TangentGauss {
    pub fn new() -> Self {
        let [nodes, weights, coupling] = collocation(STAGES);
        let entry = |k: usize| {
            (0..STAGES).map(|j| coupling[k / STAGES * STAGES + j] * coupling[j * STAGES + k % STAGES]).sum()
        };
        let square = (0..STAGES * STAGES).map(entry).collect();
        Self { nodes, weights, coupling: [coupling, square], system: Vec::new(), next: 0.0 }
    }

    /// Writes the columns of Phi, those of rates times `rate`, from y'' by y at the nodes, one after the
    /// other: matrices B and C of `f` × 2f, row by row.
    ///
    /// False where there is no such matrix.
    pub fn step(&mut self, f: usize, h: f64, rate: f64, pull: &[f64], columns: &mut [Vec<f64>]) -> bool {
        let Self { nodes, weights, coupling: [a, aa], system, .. } = self;
        let (n, size) = (2 * f, STAGES * f);
        let width = size + n;
        system.clear();
        system.resize(size * width, 0.0);
        for i in 0..STAGES {
            for row in 0..f {
                let line = &mut system[(i * f + row) * width..][..width];
                let (turn, drag) = pull[(i * f + row) * n..][..n].split_at(f);
                for k in 0..f {
                    for j in 0..STAGES {
                        line[j * f + k] =
                            -h * (h * aa[i * STAGES + j] * turn[k] + a[i * STAGES + j] * drag[k]);
                    }
                    line[size + k] = turn[k];
                    line[size + f + k] = (drag[k] + h * nodes[i] * turn[k]) * rate;
                }
                line[i * f + row] += 1.0;
            }
        }
        if !eliminate(size, width, system) {
            return false;
        }
        for (k, column) in columns.iter_mut().enumerate() {
            for row in 0..f {
                let slope = |i: usize| weights[i] * system[(i * f + row) * width + size + k];
                let start = f64::from(k == row) + if k == f + row { h * rate } else { 0.0 };
                column[row] = (0..STAGES).fold(start, |sum, i| sum + h * h * (1.0 - nodes[i]) * slope(i));
                let start = if k == f + row { rate } else { 0.0 };
                column[f + row] = (0..STAGES).fold(start, |sum, i| sum + h * slope(i));
            }
        }
        true
    }
}

/// Solves in place, with the largest pivots: rows below are eliminated first, then those above from the last
/// one up.
pub(in crate::run) fn eliminate(size: usize, width: usize, system: &mut [f64]) -> bool {
    for p in 0..size {
        let mut best = p;
        for row in p + 1..size {
            if system[row * width + p].abs() > system[best * width + p].abs() {
                best = row;
            }
        }
        let pivot = system[best * width + p];
        if !(pivot.is_finite() && pivot != 0.0) {
            return false;
        }
        let (above, below) = system.split_at_mut((p + 1) * width);
        let line = &mut above[p * width + p..];
        if best != p {
            line.swap_with_slice(&mut below[(best - p - 1) * width + p..][..width - p]);
        }
        line.iter_mut().for_each(|entry| *entry /= pivot);
        for row in below.chunks_exact_mut(width) {
            let factor = row[p];
            row[p..].iter_mut().zip(&*line).for_each(|(entry, line)| *entry -= factor * line);
        }
    }
    for p in (1..size).rev() {
        let (above, below) = system.split_at_mut(p * width);
        let line = &below[size..width];
        for row in above.chunks_exact_mut(width) {
            let factor = row[p];
            row[size..].iter_mut().zip(line).for_each(|(entry, line)| *entry -= factor * line);
        }
    }
    true
}

/// The step that y'' by y and the rates allow \[s\].
pub fn reach(f: usize, weights: &[f64], pull: &[f64], rates: &[f64]) -> f64 {
    let mut fastest = 0.0_f64;
    for i in 0..f {
        for j in 0..f {
            let weight = weights[i] / weights[j];
            let (turn, drag) =
                ((pull[i * 2 * f + j] * weight).abs(), (pull[i * 2 * f + f + j] * weight).abs());
            fastest = fastest.max(turn.sqrt()).max(drag);
        }
    }
    // Bodies that turn against each other have the difference of their rates in the Jacobian.
    let turning = rates.iter().zip(weights).map(|(rate, weight)| (rate * weight).abs()).sum::<f64>();
    SPAN / fastest.max(turning)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillation_is_kept_and_its_phase_is_right_to_the_eighth_order() {
        let (rate, pull) = (2.0, [-4.0, 0.0].repeat(STAGES));
        let off = [0.8, 0.4].map(|h| {
            let mut columns = vec![vec![0.0; 2]; 2];
            assert!(TangentGauss::new().step(1, h, rate, &pull, &mut columns));
            let [x, v] = [columns[0][0], columns[0][1] / rate];
            assert!((x.hypot(v) - 1.0).abs() < 1e-15 && (columns[1][0] + columns[0][1] / rate).abs() < 1e-15);
            libm::atan2(-v, x) - 2.0 * h
        });
        assert!((off[0] / off[1] / 512.0 - 1.0).abs() < 0.1, "{off:?}");
    }
}
