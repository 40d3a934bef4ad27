//! Why a scene has no equations.

use super::DENSE_LIMIT;
use crate::arithmetic::shown::about;
use crate::dynamics::assembly::Closest;

/// Why a scene has no equations.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompileError {
    /// Motors and locks give the same angle twice.
    #[error(
        "`{0}` gives an angle that the other motors and locks give already\nhint: leave out one of the \
            motors and locks that share these bars"
    )]
    Redundant(String),
    /// The law of a motor is what it drives.
    #[error(
        "the law of motor `{0}` is the angle or the travel that it drives, which asks for nothing\nhint: \
            give it by time or by other bodies, or leave the motor out"
    )]
    DrivesNothing(String),
    /// Too many rows that act on one another.
    #[error(
        "{0} constraint rows that act on one another through the bodies they hang on; at most about \
            {DENSE_LIMIT} are taken"
    )]
    TooMany(usize),
    /// The mass matrix is singular: some body moves no mass when it turns.
    #[error(
        "the mass matrix is singular at the start: turning bar `{0}` moves no mass, and its angle has no \
            equation without constraints\nhint: give it an inertia, or a centre away from its hinge; a point \
            mass fixed to a bar can be part of that bar"
    )]
    Massless(String),
    /// No start closes the rows, or none near what is given.
    #[error(
        "no start fits: constraint `{row}` is off by {} {unit} at the nearest\n{closest}\nhint: \
            check lengths and places, and whether what `start` gives can be reached; `driftless check SCENE \
            --chart FILE` draws the closest", about(*left)
    )]
    Impossible {
        /// The row that is off most.
        row: String,
        /// By how much.
        left: f64,
        /// `rad` or `m`.
        unit: &'static str,
        /// What comes closest.
        closest: Box<Closest>,
    },
    /// No rates keep the rows at the start.
    #[error(
        "no rates fit the start: constraint `{row}` slips by {} {unit}\nhint: check motors against \
            locks, and whether the start is a dead centre for the motor", about(*left)
    )]
    ImpossibleRates {
        /// The row that slips most.
        row: String,
        /// By how much.
        left: f64,
        /// `rad/s` or `m/s`.
        unit: &'static str,
    },
    /// Coordinates, or rates, that neither the rows nor the scene give: as many as have to be added.
    #[error("the start leaves {} open: no constraint gives {}\nhint: add {} to the scene{}", quoted(.0),
        them(.0), them(.0), or_a_hinge(.0))]
    Undetermined(Vec<String>),
    /// More than one start fits what is given.
    #[error(
        "the start is ambiguous: `{what}` may be {one:.6} or {other:.6} {unit}, and {count} configurations \
            are found that fit\nhint: {advice}"
    )]
    Ambiguous {
        /// Where the scene could say which.
        what: String,
        /// One value.
        one: f64,
        /// Another.
        other: f64,
        /// `rad` or `m`.
        unit: &'static str,
        /// Configurations that were found.
        count: usize,
        /// What to give, so that the first of them is told from all others.
        advice: String,
    },
    /// A spring with a free length or a damper starts without a direction.
    #[error(
        "spring `{0}` starts with length 0 and has a free length or damping\nhint: its force has no \
            direction there; start elsewhere, move an end, or set both to 0"
    )]
    SpringWithoutLength(String),
    /// A force or torque of a formula has no finite value at the start.
    #[error(
        "`{force}` is {} at the start\nhint: its formula divides by zero there, or takes a root, logarithm \
            or power of a number that has none; start elsewhere, or change the formula",
        if value.is_nan() { "not a number" } else { "infinite" }
    )]
    NotFinite {
        /// The part.
        force: String,
        /// Its magnitude: infinite, or not a number.
        value: f64,
    },
    /// A rigid spring that vibrates is not the only constraint.
    #[error(
        "rigid spring `{spring}` starts with {} J of vibration, and its mean force is known only \
            where no other constraint, wall or damper is\nhint: start it at its free length and without a \
            rate along it, or leave its `model` out", about(*energy)
    )]
    NotAlone {
        /// The spring.
        spring: String,
        /// Its energy \[J\].
        energy: f64,
    },
    /// The line of a wall moves with the point that meets it, which has dry friction there.
    #[error(
        "wall `{0}` has friction and a law that depends on where its own point is: it is a curve, and \
            friction acts along the line\nhint: leave the friction out, or let the law depend on other parts"
    )]
    FrictionOnCurve(String),
    /// The scene was put together by hand and makes no sense.
    #[error("the scene makes no sense: {0}")]
    Unsound(String),
    /// A potential depends on time or rates.
    #[error("the potential of force `{0}` depends on time or rates\nhint: leave what does to `Force::apply`")]
    NoPotential(String),
    /// A force acts on a body the mechanism does not have.
    #[error("force `{0}` is one of another mechanism: it names a body that is not there")]
    ForeignForce(String),
    /// A force shares its name with another one or with a part of the scene.
    #[error(
        "force `{0}` has the name of another force or of a part of the scene\nhint: give it a name of its \
            own; events switch parts by name"
    )]
    NameTaken(String),
    /// What a force is called is no name.
    #[error("force {0:?} has no name: 1 to 64 letters a to z or A to Z, digits, - or _")]
    NoName(String),
    /// An event asks for a body the mechanism does not have.
    #[error("event `{0}` is one of another mechanism: it names a body that is not there")]
    ForeignEvent(String),
    /// An event from outside shares its name with one of the scene.
    #[error(
        "event `{0}` has the name of an event of the scene\nhint: give it a name of its own; records tell \
            events by name"
    )]
    EventNameTaken(String),
    /// No bar has the name asked for.
    #[error("no bar is called `{0}`")]
    NoSuchBar(String),
    /// A point starts behind its wall.
    #[error(
        "wall `{wall}` has its point {} m behind it at the start\nhint: start elsewhere, move the \
            wall, or turn its normal", about(*gap)
    )]
    BehindWall {
        /// The wall.
        wall: String,
        /// How far \[m\].
        gap: f64,
    },
}

/// The lists of a scene whose parts are constraints.
const CONSTRAINTS: &[&str] = &["motors", "locks", "hinges", "sliders", "welds", "springs"];

/// Those whose parts are forces or torques by formulas.
const FORCES: &[&str] = &["forces", "torques", "springs", "torsion_springs", "potentials"];

impl CompileError {
    /// The name of the part that is at fault, and the lists of the scene it may be in; `None` where it is not
    /// one alone.
    pub fn part(&self) -> Option<(&'static [&'static str], &str)> {
        match self {
            // Rows of a hinge are called `A.x` and `A.y`.
            Self::Redundant(row) | Self::Impossible { row, .. } | Self::ImpossibleRates { row, .. } => {
                Some((CONSTRAINTS, row.split_once('.').map_or(row.as_str(), |(part, _)| part)))
            }
            Self::DrivesNothing(motor) => Some((&["motors"], motor)),
            Self::Massless(bar) => Some((&["bars"], bar)),
            Self::SpringWithoutLength(spring) | Self::NotAlone { spring, .. } => Some((&["springs"], spring)),
            Self::NotFinite { force, .. } => Some((FORCES, force)),
            Self::FrictionOnCurve(wall) | Self::BehindWall { wall, .. } => Some((&["walls"], wall)),
            _ => None,
        }
    }
}

/// Names in backticks, with commas and an `and`.
pub(crate) fn quoted(names: &[String]) -> String {
    let all: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match all.split_last() {
        Some((last, before)) if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => all.join(""),
    }
}

/// What else may give a place.
fn or_a_hinge(names: &[String]) -> &'static str {
    let is_place = |name: &String| name.ends_with(".origin");
    if names.iter().any(is_place) { ", or the hinge, weld or slider that holds the bar" } else { "" }
}

fn them(names: &[String]) -> &'static str {
    if names.len() == 1 { "it" } else { "them" }
}
