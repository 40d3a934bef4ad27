//! The charts of a page: which columns stand together, and how far runs are from one another.

use super::columns::Role;
use super::{DECADE, Viewed};
use crate::arithmetic::Complex;
use crate::html::PackedColumn;
use serde_json::{Value, json};

/// Series of a chart before their own are asked for.
const SERIES: usize = 12;

impl Viewed {
    /// How far another run of as many bodies is from this one, as its decimal logarithm: of the ends of all
    /// bars those furthest apart \[m\], at rows of the same time.
    pub(super) fn distance(&self, other: &Self) -> Option<PackedColumn> {
        let [mine, theirs] = [self, other].map(Self::poses);
        if mine.len() != theirs.len() {
            return None;
        }
        let [times, others] = [self, other].map(|run| &run.kept.columns[0]);
        let end = |run: &Self, pose: &[usize; 3], row: usize, body: usize, end: usize| {
            let [phi, x, y] = pose.map(|k| run.kept.columns[k][row]);
            let body = &run.mechanism.bodies[body];
            Complex::new(x, y) + (body.ends[end] - body.centre) * Complex::unit(phi)
        };
        let apart = |row: usize, theirs_row: usize| {
            let ends = (0..mine.len()).flat_map(|body| [(body, 0), (body, 1)]);
            let apart = ends.map(|(body, which)| {
                let apart = end(self, &mine[body], row, body, which)
                    - end(other, &theirs[body], theirs_row, body, which);
                apart.re.hypot(apart.im)
            });
            apart.fold(0.0, f64::max)
        };
        let values = times.iter().enumerate().map(|(row, &t)| {
            let near = others.partition_point(|&other| other < t - 1e-9 * self.scene.every);
            let is_same = others.get(near).is_some_and(|&other| (other - t).abs() <= 1e-9 * self.scene.every);
            let apart = if is_same { apart(row, near) } else { 0.0 };
            if apart > 0.0 { libm::log10(apart) } else { f64::NAN }
        });
        Some(PackedColumn {
            name: format!("distance of {}", other.label),
            unit: "m".to_owned(),
            values: values.collect(),
            quantum: DECADE,
            is_logarithm: true,
        })
    }

    /// The charts shown at first: columns of one kind and unit together, those that show nothing left out.
    pub(super) fn charts(&self) -> Vec<Value> {
        let varies = |k: usize| {
            let mut values = self.kept.columns[k].iter().filter(|value| value.is_finite());
            let first = values.next();
            values.any(|value| Some(value) != first)
        };
        let mut charts = Vec::new();
        for (role, title) in [
            (Role::Angle, "Angles"),
            (Role::Rate, "Angular rates"),
            (Role::Energy, "Energy drift"),
            (Role::Residual, "Constraint residuals"),
            (Role::Torque, "Motors"),
            (Role::Power, "Motor power"),
            (Role::Output, "Outputs"),
            (Role::Part, "Energies"),
        ] {
            let mut columns: Vec<usize> =
                (0..self.columns.len()).filter(|&k| self.columns[k].role == role).collect();
            let is_drift = matches!(role, Role::Energy | Role::Residual);
            columns.retain(|&k| {
                if is_drift { self.kept.columns[k].iter().any(|value| value.is_finite()) } else { varies(k) }
            });
            let mut units: Vec<&str> = Vec::new();
            for &k in &columns {
                if !units.contains(&self.columns[k].unit.as_str()) {
                    units.push(&self.columns[k].unit);
                }
            }
            for unit in units {
                let mine: Vec<usize> =
                    columns.iter().copied().filter(|&k| self.columns[k].unit == unit).take(SERIES).collect();
                let title = match (role, unit) {
                    (Role::Torque, "N") => "Motor force",
                    (Role::Torque, _) => "Motor torque",
                    _ => title,
                };
                charts.push(json!({"title": title, "unit": unit, "columns": mine, "log": is_drift}));
            }
        }
        charts
    }
}
