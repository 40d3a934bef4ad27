//! Columns of a page, from those of the trajectory.

use super::error::ViewError;
use super::rows::Treatment;
use crate::dynamics::Mechanism;
use crate::run::files::TRAJECTORY;
use crate::run::table;
use std::path::Path;

/// What a column of the page is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Time,
    Angle,
    Rate,
    Position,
    /// Drift, as its decimal logarithm.
    Energy,
    Residual,
    Torque,
    Power,
    /// An energy.
    Part,
    Output,
    /// Angles once more, as they are at the row: where rows are thinned, those of charts are extremes.
    Pose,
}

/// A column of the page.
#[derive(Clone, Debug)]
pub(super) struct ShownColumn {
    pub name: String,
    pub unit: String,
    /// Its number in the trajectory.
    pub source: usize,
    pub role: Role,
}

impl Role {
    pub fn treatment(self) -> Treatment {
        match self {
            Self::Time | Self::Position | Self::Pose => Treatment::Row,
            Self::Energy | Self::Residual => Treatment::Logarithm,
            _ => Treatment::Extremes,
        }
    }
}

/// Whether the columns of a trajectory are those of a mechanism.
pub(super) fn fits(found: &[String], expected: &[String], folder: &Path) -> Result<(), ViewError> {
    for k in 0..expected.len().max(found.len()) {
        let [found, expected] = [found, expected].map(|names| names.get(k).map_or("nothing", String::as_str));
        if found != expected {
            return Err(ViewError::Column {
                file: folder.join(TRAJECTORY),
                column: k + 1,
                found: found.chars().take(80).collect(),
                expected: expected.chars().take(80).collect(),
            });
        }
    }
    Ok(())
}

/// The columns of a page, from those of the trajectory; velocities of the centres are left out.
pub(super) fn columns(mechanism: &Mechanism) -> Vec<ShownColumn> {
    let heads = table::header(mechanism);
    let bodies = mechanism.own_bodies().len();
    let motors: Vec<&str> = (0..mechanism.constraints.len())
        .filter(|&row| mechanism.is_motor(row))
        .map(|row| mechanism.constraints[row].name())
        .collect();
    let residuals: Vec<String> =
        mechanism.constraints.iter().map(|row| format!("{}.C", row.name())).collect();
    let of_motor =
        |name: &str, what: &str| name.strip_suffix(what).is_some_and(|motor| motors.contains(&motor));
    let mut columns = Vec::new();
    let mut poses = Vec::new();
    for (source, head) in heads.iter().enumerate() {
        let (name, unit) = head
            .rsplit_once(" [")
            .map_or((head.as_str(), ""), |(name, unit)| (name, unit.trim_end_matches(']')));
        let shown = |role| ShownColumn {
            name: name.to_owned(),
            unit: if unit == "1" { String::new() } else { unit.to_owned() },
            source,
            role,
        };
        let role = match source {
            0 => Role::Time,
            k if k <= 6 * bodies => match (k - 1) % 6 {
                0 => {
                    poses.push(shown(Role::Pose));
                    Role::Angle
                }
                1 => Role::Rate,
                2 | 3 => Role::Position,
                _ => continue,
            },
            _ if head == "imbalance [1]" => Role::Energy,
            _ if residuals.iter().any(|known| known == name) => Role::Residual,
            _ if name.ends_with(".C'") => continue,
            _ if of_motor(name, ".torque") || of_motor(name, ".force") => Role::Torque,
            _ if of_motor(name, ".power") => Role::Power,
            _ if ["kinetic", "potential", "work", "friction"].contains(&name) => Role::Part,
            _ => Role::Output,
        };
        let name = if role == Role::Energy { "energy drift" } else { name };
        columns.push(ShownColumn { name: name.to_owned(), ..shown(role) });
    }
    columns.extend(poses);
    columns
}
