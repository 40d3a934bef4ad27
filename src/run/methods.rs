//! The table of methods: one list feeds the flag parser, the help, the README and the convergence test.

use crate::stepping::composition::Composition;
use std::fmt;
use std::str::FromStr;

/// A method by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum MethodId {
    /// Dormand–Prince 5(4) of `ode_solvers`.
    Dopri5,
    /// Dormand–Prince 8(5,3) of `ode_solvers`.
    Dop853,
    /// Our Dormand–Prince 5(4).
    Dp5,
    /// Our Dormand–Prince 8(5,3).
    Dp8,
    /// The power series of the motion.
    Taylor,
    /// Radau IIA collocation with so many stages, 3 or 5; order twice that less one.
    Radau(usize),
    /// Gauss collocation with so many stages, 2 to 8; order twice that.
    Gauss(usize),
    /// RATTLE and its compositions.
    Rattle(Composition),
    /// An integrator from outside the crate: see [`Custom`](super::Custom).
    Custom,
}

/// How a method's step is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stepping {
    /// From tolerances.
    Adaptive,
    /// One step for the whole run.
    Fixed,
}

/// What the table says of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct MethodInfo {
    /// Which.
    #[serde(skip)]
    pub id: MethodId,
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// Order of its error in the step.
    pub order: u32,
    /// How its step is given.
    pub stepping: Stepping,
    /// True where it keeps the symplectic structure.
    pub symplectic: bool,
    /// What it is for.
    pub purpose: &'static str,
    /// What it asks of a scene.
    pub needs: &'static str,
}

/// Every method there is.
pub const METHODS: &[MethodInfo] = &[
    adaptive(
        MethodId::Dopri5,
        "dopri5",
        5,
        "everyday runs at 1e-3 to 1e-6 (crate ode_solvers)",
        "no walls, no dry friction, no projection",
    ),
    adaptive(
        MethodId::Dop853,
        "dop853",
        8,
        "everyday runs at 1e-6 to 1e-12 (crate ode_solvers)",
        "no walls, no dry friction, no projection",
    ),
    adaptive(MethodId::Dp5, "dp5", 5, "as dopri5, with impacts and projection after every step", "any"),
    adaptive(MethodId::Dp8, "dp8", 8, "as dop853, with impacts and projection after every step", "any"),
    adaptive(
        MethodId::Taylor,
        "taylor",
        24,
        "the most accurate path, below 1e-8 (power series, order 16 to 24)",
        "no Baumgarte's term",
    ),
    radau(3, "radau5"),
    radau(5, "radau9"),
    gauss(2, "gauss4"),
    gauss(3, "gauss6"),
    gauss(4, "gauss8"),
    gauss(5, "gauss10"),
    gauss(6, "gauss12"),
    gauss(7, "gauss14"),
    gauss(8, "gauss16"),
    rattle(Composition::Single, 2, "rattle2"),
    rattle(Composition::Suzuki5, 4, "rattle4"),
    rattle(Composition::KahanLi9, 6, "rattle6"),
    rattle(Composition::KahanLi17, 8, "rattle8"),
];

/// What there is to say of an integrator from outside.
const CUSTOM: MethodInfo = adaptive(
    MethodId::Custom,
    "custom",
    0,
    "an integrator from outside the crate",
    "what it asks for itself",
);

const fn adaptive(
    id: MethodId,
    name: &'static str,
    order: u32,
    purpose: &'static str,
    needs: &'static str,
) -> MethodInfo {
    MethodInfo { id, name, order, stepping: Stepping::Adaptive, symplectic: false, purpose, needs }
}

const fn radau(stages: usize, name: &'static str) -> MethodInfo {
    let purpose = "dampers and damped stiff springs; dissipates the energy of undamped stiff springs";
    adaptive(
        MethodId::Radau(stages),
        name,
        2 * stages as u32 - 1,
        purpose,
        "matrices: up to 2000 coordinates",
    )
}

const fn gauss(stages: usize, name: &'static str) -> MethodInfo {
    MethodInfo {
        id: MethodId::Gauss(stages),
        name,
        order: 2 * stages as u32,
        stepping: Stepping::Fixed,
        symplectic: true,
        purpose: "long horizons: the energy error stays bounded",
        needs: "no walls, no dry friction",
    }
}

const fn rattle(composition: Composition, order: u32, name: &'static str) -> MethodInfo {
    MethodInfo {
        id: MethodId::Rattle(composition),
        name,
        order,
        stepping: Stepping::Fixed,
        symplectic: true,
        purpose: "long horizons: the energy error stays bounded, constraints kept at both levels",
        needs: "no walls, no dry friction, no dampers",
    }
}

impl MethodId {
    /// Its line of the table.
    pub fn info(self) -> &'static MethodInfo {
        METHODS.iter().find(|info| info.id == self).unwrap_or(&CUSTOM)
    }

    /// True for the methods that take tolerances.
    pub fn is_adaptive(self) -> bool {
        self.info().stepping == Stepping::Adaptive
    }
}

impl fmt::Display for MethodId {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(self.info().name)
    }
}

impl FromStr for MethodId {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let known = || METHODS.iter().map(|info| info.name).collect::<Vec<_>>().join(", ");
        METHODS
            .iter()
            .find(|info| info.name == name)
            .map(|info| info.id)
            .ok_or_else(|| format!("no method `{name}`; there are {}", known()))
    }
}

/// How constraints are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stabilization {
    /// Not at all: the multipliers hold the accelerations, drift is watched.
    None,
    /// A critically damped pull.
    Baumgarte,
    /// Back onto the constraints after every step.
    Projection,
    /// Driven angles as known functions of time.
    Elimination,
}

impl Stabilization {
    /// All four.
    pub const ALL: [Self; 4] = [Self::None, Self::Baumgarte, Self::Projection, Self::Elimination];

    /// Name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Baumgarte => "baumgarte",
            Self::Projection => "projection",
            Self::Elimination => "elimination",
        }
    }
}

impl fmt::Display for Stabilization {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Stabilization {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            format!("no stabilization `{name}`; there are none, baumgarte, projection, elimination")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back_and_are_unique() {
        for info in METHODS {
            assert_eq!(info.name.parse(), Ok(info.id));
            assert_eq!(info.id.info(), info);
        }
        assert!("rk4".parse::<MethodId>().is_err());
    }
}
