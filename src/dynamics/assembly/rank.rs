//! Degrees of freedom, and rows that say nothing new: everywhere, or at the start alone.

use super::guess::shuffled;
use super::newton::{AssemblyProblem, KEPT};
use super::svd::{RowMatrix, independent};
use super::{Assembly, DENSE, DEPENDENT};
use crate::arithmetic::{DoubleDouble, Scalar};

/// As [`DEPENDENT`], near a singular position, where rows that are met to [`KEPT`] leave angles open by its
/// square root.
const NEARLY: f64 = 1e-5;
/// Rows squared times coordinates up to which the rows' rank is formed; beyond, they are taken to be
/// independent.
const LARGEST: usize = 1 << 28;

impl AssemblyProblem<'_> {
    /// Degrees of freedom, redundant rows and singular ones.
    pub(super) fn rank(&self, q: &[DoubleDouble]) -> Assembly {
        let rows = self.mechanism.constraints.len();
        let every = vec![true; rows];
        if (rows * rows).saturating_mul(q.len()) > LARGEST {
            return Assembly {
                degrees_of_freedom: q.len() - rows,
                conditioning: f64::NAN,
                ..Assembly::default()
            };
        }
        let here = self.jacobian(q, &every);
        let conditioning = if rows == 0 {
            1.0
        } else if q.len() <= DENSE {
            conditioning(&here)
        } else {
            f64::NAN
        };
        let dependent = dependent(&here, DEPENDENT);
        let count = |rows: &[bool]| rows.iter().filter(|&&row| row).count();
        let mut redundant = dependent.clone();
        if count(&dependent) > 0 && q.len() <= DENSE {
            // Motors may be anywhere.
            let steady: Vec<bool> = self
                .mechanism
                .constraints
                .iter()
                .zip(&self.active)
                .map(|(row, &active)| active && !row.is_motor())
                .collect();
            let none = vec![false; self.aims.len()];
            for k in 1..=12 {
                // Farther and farther: close to a singular position the nearest start may be that position.
                let spread = 0.08 * k as f64;
                let mut near: Vec<DoubleDouble> = q
                    .iter()
                    .enumerate()
                    .map(|(j, &q)| q + DoubleDouble::of(spread * self.unit[j] * shuffled(k, j)))
                    .collect();
                if self.position(&mut near, &steady, &none) < KEPT {
                    let there = self::dependent(&self.jacobian(&near, &every), NEARLY);
                    if count(&there) < count(&redundant) {
                        redundant = there;
                    }
                }
            }
        }
        let extra = count(&dependent) - count(&redundant);
        let mut singular: Vec<usize> = (0..rows).filter(|&i| dependent[i] && !redundant[i]).collect();
        singular.drain(..singular.len().saturating_sub(extra));
        let name = |i: usize| self.mechanism.constraints[i].name.clone();
        Assembly {
            degrees_of_freedom: q.len() - (rows - count(&redundant)),
            singular: singular.into_iter().map(name).collect(),
            redundant: (0..rows).filter(|&i| redundant[i]).map(name).collect(),
            conditioning,
            ..Assembly::default()
        }
    }
}

/// The least singular value that counts over the largest; 1 without any.
fn conditioning(jacobian: &RowMatrix) -> f64 {
    let values = jacobian.values();
    let smallest = values.iter().copied().filter(|&sigma| sigma > DEPENDENT).fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest / values.iter().copied().fold(0.0, f64::max) } else { 1.0 }
}

/// Which rows are combinations of those before.
fn dependent(jacobian: &RowMatrix, least: f64) -> Vec<bool> {
    independent(jacobian, least).iter().map(|new| !new).collect()
}
