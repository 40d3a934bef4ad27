//! The tables themselves: one for each kind of object of a scene file.

mod joints;
mod laws;
mod loads;

pub(in crate::scene) use self::joints::*;
pub(in crate::scene) use self::laws::*;
pub(in crate::scene) use self::loads::*;

use super::{
    ANGLE, Field, FieldShape, INERTIA, KeyTable, MASS, MOST_BARS, QuantityRange, RATE, TIME, not_negative,
    optional, positive, required, signed,
};

/// The whole scene.
pub(in crate::scene) static SCENE: KeyTable = KeyTable {
    title: "a scene",
    about: "A planar mechanism of bars, joints, springs, forces, motors and walls, in SI units; angles are \
        absolute, from +x, counter-clockwise.",
    fields: &[
        required(
            "name",
            FieldShape::FolderName,
            "\"free\"",
            "Name of the scene, and of the folder its results go to.",
        ),
        optional(
            "description",
            FieldShape::Text,
            "\"Two bars fall.\"",
            "One sentence for reports and charts.",
        ),
        required(
            "gravity",
            FieldShape::Pair(signed("m/s²")),
            "[9.81, 0]",
            "Gravitational acceleration (x, y).",
        ),
        required(
            "bars",
            FieldShape::List { of: &[&UNIFORM_BAR, &OUTRIGHT_BAR], least: 1, most: MOST_BARS },
            "[…]",
            "The bodies.",
        ),
        optional(
            "hinges",
            any_number_of(&[&HINGE]),
            "[…]",
            "Where bodies turn on each other or on the ground, in chains, trees and loops; none if absent.",
        ),
        optional(
            "sliders",
            any_number_of(&[&SLIDER]),
            "[…]",
            "Points that slide along lines; none if absent.",
        ),
        optional("welds", any_number_of(&[&WELD]), "[…]", "Bodies that are one; none if absent."),
        optional("locks", any_number_of(&[&LOCK]), "[…]", "Angles that stay as they are; none if absent."),
        optional(
            "parameters",
            FieldShape::Parameters,
            "{\"l\": 0.6, \"half\": \"l/2\"}",
            "Numbers by name, for formulas in the place of any number of the scene; none if absent.",
        ),
        optional(
            "points",
            any_number_of(&[&NAMED_POINT]),
            "[…]",
            "Points by name, for formulas: `tip` makes tip.x, tip.y, tip.vx, tip.vy known; none if absent.",
        ),
        optional(
            "tables",
            FieldShape::Tables,
            "{\"gust\": [[0, 0], [1, 2.5], [3, 0]]}",
            "Functions by name, smooth through points (x, y), for formulas as gust(t): the points, a CSV \
                file of two columns as \"gust.csv\", or two of its columns as \
                {\"file\": \"log.csv\", \"x\": \"time\", \"y\": \"wind\"}; none if absent.",
        ),
        optional(
            "signals",
            FieldShape::Signals,
            "{\"speed\": \"sqrt(tip.vx^2 + tip.vy^2)\"}",
            "Formulas of time and state by name, each may use those before it; none if absent.",
        ),
        optional(
            "integrals",
            FieldShape::Signals,
            "{\"sum\": \"aim - bar1.phi\"}",
            "Integrals of formulas over time by name, from 0 on, for other formulas, as those of \
                controllers; none if absent.",
        ),
        optional(
            "springs",
            any_number_of(&[&SPRING, &SPRING_BY_TENSION, &SPRING_BY_POTENTIAL]),
            "[…]",
            "Springs and dampers; none if absent.",
        ),
        optional(
            "torsion_springs",
            any_number_of(&[&TORSION_SPRING, &TORSION_SPRING_BY_TORQUE, &TORSION_SPRING_BY_POTENTIAL]),
            "[…]",
            "Springs and dampers between angles; none if absent.",
        ),
        optional("forces", any_number_of(&[&FORCE]), "[…]", "Forces at points; none if absent."),
        optional("torques", any_number_of(&[&TORQUE]), "[…]", "Torques on bodies; none if absent."),
        optional(
            "motors",
            any_number_of(&[&MOTOR, &DRIVE]),
            "[…]",
            "Prescribed angles, and prescribed travels of sliders; none if absent.",
        ),
        optional("walls", any_number_of(&[&WALL]), "[…]", "Lines that points cannot pass; none if absent."),
        optional(
            "potentials",
            any_number_of(&[&POTENTIAL]),
            "[…]",
            "Potential energies as formulas of angles and positions; none if absent.",
        ),
        optional(
            "events",
            any_number_of(&[&EVENT]),
            "[…]",
            "What is recorded, stops the run or switches parts where a formula is zero; none if absent.",
        ),
        optional(
            "outputs",
            FieldShape::Outputs,
            "{\"bearing\": \"A.force\", \"pen\": \"tip.x\"}",
            "Columns of the trajectory beside those of every run, as formulas of the state and of what parts \
                carry, by name; or a list of formulas, which then are their own names; none if absent.",
        ),
        optional(
            "inactive",
            FieldShape::Names,
            "[\"latch\"]",
            "Springs, torsion springs, forces, torques, potentials, hinges, motors, locks and walls that do \
                not act until an event switches them on; none if absent.",
        ),
        optional(
            "start",
            FieldShape::ByBar(&START),
            "{\"bar1\": {\"phi\": 0, \"omega\": 0}}",
            "What is known of each bar at t = 0, by bar name.  In a tree of hinges on the ground a bar that \
                no motor drives must have its angle and rate; \
             where loops, sliders, welds or free bars are, the rest is found from what is given.",
        ),
        required("until", FieldShape::Number(TIME), "10", "Horizon: the run ends at this time."),
        required("every", FieldShape::Number(TIME), "0.01", "Output interval, at most the horizon."),
    ],
};

/// A bar by its shape.
pub(in crate::scene) static UNIFORM_BAR: KeyTable = KeyTable {
    title: "a uniform bar",
    about: "A bar is given either by length, width, thickness and density or by mass, centre and inertia; \
        its frame has the origin at one \
            end and x along the bar.",
    fields: &[
        required("name", FieldShape::Name, "\"bar1\"", BAR_NAME),
        required("length", FieldShape::Number(positive("m")), "0.6", "Length."),
        required("width", FieldShape::Number(positive("m")), "0.05", "Width in the plane."),
        required("thickness", FieldShape::Number(positive("m")), "0.003", "Thickness across the plane."),
        required("density", FieldShape::Number(positive("kg/m³")), "670", "Density."),
        optional(
            "inertia",
            FieldShape::Inertia(INERTIA),
            "\"full\"",
            "Inertia about the centre: \"full\" m(l² + w²)/12, \"slender\" m l²/12, or a number; \"full\" if \
                absent.",
        ),
    ],
};

/// A body by its mass distribution.
pub(in crate::scene) static OUTRIGHT_BAR: KeyTable = KeyTable {
    title: "a bar given by its mass",
    about: UNIFORM_BAR.about,
    fields: &[
        required("name", FieldShape::Name, "\"bar1\"", BAR_NAME),
        required("mass", FieldShape::Number(MASS), "0.0603", "Mass."),
        required("centre", FieldShape::Pair(signed("m")), "[0.3, 0]", "Centre of mass in the body's frame."),
        required(
            "inertia",
            FieldShape::Number(INERTIA),
            "0.0018",
            "Moment of inertia about the centre of mass; 0 for a point mass away from its hinge.",
        ),
        optional(
            "length",
            FieldShape::Number(not_negative("m")),
            "0.6",
            "Length in drawings; if absent, twice the distance of the centre, or twice the radius of \
                gyration where that is zero.  A body with nothing but its centre of mass is drawn about it.",
        ),
    ],
};

const fn any_number_of(of: &'static [&'static KeyTable]) -> FieldShape {
    FieldShape::List { of, least: 0, most: usize::MAX }
}

const BAR_NAME: &str = "Name, unique among bars; not \"ground\".";

const PLACES: &str = "[{\"body\": \"ground\", \"point\": [0, 0]}, {\"body\": \"bar1\", \"point\": [0, 0]}]";

const MEASURED_FROM: &str = "The bar its angle is measured from; the ground (+x) if absent.";

/// A place.
pub(in crate::scene) static PLACE: KeyTable = KeyTable {
    title: "a place",
    about: "A point of a bar or of the ground.",
    fields: &[
        required("body", FieldShape::Body { ground: true }, "\"bar1\"", "Name of a bar, or \"ground\"."),
        required(
            "point",
            FieldShape::Pair(signed("m")),
            "[0.6, 0]",
            "Coordinates in the bar's frame, or in the world's for the ground.",
        ),
    ],
};

/// A point with a name.
pub(in crate::scene) static NAMED_POINT: KeyTable = KeyTable {
    title: "a point with a name",
    about: "A point of a bar or of the ground that formulas can speak of.",
    fields: &[
        required("name", FieldShape::Name, "\"tip\"", "Name, unique among points."),
        required("body", FieldShape::Body { ground: true }, "\"bar1\"", "Name of a bar, or \"ground\"."),
        required(
            "point",
            FieldShape::Pair(signed("m")),
            "[0.6, 0]",
            "Coordinates in the bar's frame, or in the world's for the ground.",
        ),
    ],
};

/// An event.
pub(in crate::scene) static EVENT: KeyTable = KeyTable {
    title: "an event",
    about: "Where a formula of time and state passes zero; it is recorded, and may end the run or switch \
        parts.",
    fields: &[
        required("name", FieldShape::Name, "\"upright\"", "Name, unique among events."),
        required(
            "when",
            FieldShape::Formula(signed("")),
            "\"bar1.sin\"",
            "The event function: its zeros are the event.",
        ),
        optional(
            "direction",
            FieldShape::Word(&["either", "rising", "falling"]),
            "\"rising\"",
            "Which zeros count: \"rising\" from negative to positive, \"falling\" the others; \"either\" if \
                absent.",
        ),
        optional(
            "action",
            FieldShape::Word(&["record", "stop"]),
            "\"stop\"",
            "\"stop\" ends the run there, and the event switches and sets nothing; \"record\" if absent.",
        ),
        optional("on", FieldShape::Names, "[\"latch\"]", "Parts that act from then on; none if absent."),
        optional(
            "off",
            FieldShape::Names,
            "[\"motor_torque\"]",
            "Parts that act no longer from then on; none if absent.",
        ),
        optional(
            "set",
            FieldShape::Signals,
            "{\"gain\": \"2*gain\"}",
            "Parameters that have another value in formulas of time and state from then on; none if absent.",
        ),
    ],
};

/// The start of a bar.
pub(in crate::scene) static START: KeyTable = KeyTable {
    title: "a start",
    about: "What is known of a bar at t = 0; its origin and velocity only where no hinge or weld ties it, or \
        the bars it hangs together with, to the ground.",
    fields: &[
        optional("phi", FieldShape::Number(ANGLE), "0", "Absolute angle; may be many turns."),
        optional("omega", FieldShape::Number(RATE), "0", "Rate."),
        optional("origin", FieldShape::Pair(signed("m")), "[0, 0]", "Position of the bar's origin."),
        optional("velocity", FieldShape::Pair(signed("m/s")), "[0, 0]", "Velocity of the bar's origin."),
    ],
};
