//! Joints, their friction, and walls.

use super::*;

/// A hinge.
pub(in crate::scene) static HINGE: KeyTable = KeyTable {
    title: "a hinge",
    about: "Two places, on different bodies, that coincide for ever.",
    fields: &[
        required("name", FieldShape::Name, "\"A\"", "Name, unique among hinges."),
        required("between", FieldShape::Between, PLACES, "The two places."),
        optional(
            "friction",
            FieldShape::Object(&HINGE_FRICTION),
            "{\"radius\": 0.01, \"kinetic\": 0.2}",
            "Dry friction; none if absent.",
        ),
    ],
};

const KINETIC: Field = required(
    "kinetic",
    FieldShape::Number(not_negative("")),
    "0.2",
    "Coefficient of friction while the two slide on each other.",
);

const STATIC: Field = optional(
    "static",
    FieldShape::Number(not_negative("")),
    "0.3",
    "Coefficient of friction while they stick, at least the kinetic one; the same if absent.",
);

/// Dry friction of a hinge.
pub(in crate::scene) static HINGE_FRICTION: KeyTable = KeyTable {
    title: "friction of a hinge",
    about: "Coulomb friction: a torque of the coefficient times the radius times the force that the hinge \
        carries.",
    fields: &[
        required("radius", FieldShape::Number(positive("m")), "0.01", "Radius at which it acts."),
        KINETIC,
        STATIC,
    ],
};

/// Dry friction of a slider.
pub(in crate::scene) static SLIDER_FRICTION: KeyTable = KeyTable {
    title: "friction of a slider",
    about: "Coulomb friction: a force along the rail of the coefficient times the force across it.",
    fields: &[KINETIC, STATIC],
};

/// Dry friction at a wall.
pub(in crate::scene) static WALL_FRICTION: KeyTable = KeyTable {
    title: "friction at a wall",
    about: "Coulomb friction: a force along the wall of the coefficient times its pressure, in impacts too.",
    fields: &[
        KINETIC,
        STATIC,
        optional(
            "impact",
            FieldShape::Word(&["poisson", "newton"]),
            "\"newton\"",
            "What restitution multiplies in an impact: \"poisson\", the impulse of compression; \"newton\", \
                the normal velocity; \"poisson\" if absent.",
        ),
    ],
};

/// A slider.
pub(in crate::scene) static SLIDER: KeyTable = KeyTable {
    title: "a slider",
    about: "A point of a body that slides along a line of the ground or of another body.",
    fields: &[
        required(
            "name",
            FieldShape::Name,
            "\"slider\"",
            "Name, unique among sliders, motors, locks and rigid springs, whose constraints bear it.",
        ),
        required(
            "point",
            FieldShape::Object(&PLACE),
            "{\"body\": \"block\", \"point\": [0, 0]}",
            "The point that slides; on another body than the rail.",
        ),
        required(
            "rail",
            FieldShape::Object(&RAIL),
            "{\"body\": \"ground\", \"point\": [0, 0], \"direction\": [1, 0]}",
            "The line; travel along it is counted from its point.",
        ),
        optional(
            "angle",
            FieldShape::Word(&["free", "locked"]),
            "\"locked\"",
            "Whether the two bodies may turn on each other, or keep the angle between them that they have at \
                the start; \"free\" if absent.",
        ),
        optional(
            "friction",
            FieldShape::Object(&SLIDER_FRICTION),
            "{\"kinetic\": 0.2}",
            "Dry friction; none if absent.",
        ),
    ],
};

/// The line of a slider.
pub(in crate::scene) static RAIL: KeyTable = KeyTable {
    title: "a rail",
    about: "A line of a bar or of the ground.",
    fields: &[
        required("body", FieldShape::Body { ground: true }, "\"ground\"", "Name of a bar, or \"ground\"."),
        required(
            "point",
            FieldShape::Pair(signed("m")),
            "[0, 0]",
            "A point of the line, in the bar's frame, or in the world's for the ground.",
        ),
        required(
            "direction",
            FieldShape::Pair(signed("")),
            "[1, 0]",
            "Direction, of any length but zero, in the same frame; travel grows along it.",
        ),
    ],
};

/// A weld.
pub(in crate::scene) static WELD: KeyTable = KeyTable {
    title: "a weld",
    about: "Two places that coincide, of bodies that keep the angle between them that they have at the \
        start.",
    fields: &[
        required(
            "name",
            FieldShape::Name,
            "\"W\"",
            "Name, unique among welds; it also names the constraints.",
        ),
        required("between", FieldShape::Between, PLACES, "The two places, on different bodies."),
    ],
};

/// A lock.
pub(in crate::scene) static LOCK: KeyTable = KeyTable {
    title: "a lock",
    about: "An angle of a bar, absolute or relative to another bar, that stays as it is.",
    fields: &[
        required(
            "name",
            FieldShape::Name,
            "\"lock\"",
            "Name, unique among locks, motors, sliders and rigid springs, whose constraints bear it.",
        ),
        required("body", FieldShape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional("relative_to", FieldShape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        optional("angle", FieldShape::Number(ANGLE), "0.5", "The angle; that of the start if absent."),
    ],
};

/// A wall.
pub(in crate::scene) static WALL: KeyTable = KeyTable {
    title: "a wall",
    about: "A line of the ground, or of another bar, that a point of a bar cannot pass.",
    fields: &[
        required("name", FieldShape::Name, "\"wall\"", "Name, unique among walls."),
        required("body", FieldShape::Body { ground: false }, "\"bar2\"", "The bar."),
        required("point", FieldShape::Pair(signed("m")), "[0.6, 0]", "The point of the bar, in its frame."),
        required("line", FieldShape::Object(&LINE), "{\"through\": [0, 0], \"normal\": [1, 0]}", "The line."),
        required(
            "restitution",
            FieldShape::Number(QuantityRange { least: 0.0, most: 1.0, unit: "" }),
            "0.5",
            "The normal velocity after an impact is -restitution times the one before: 0 plastic, 1 elastic. \
             With friction, and where several walls are hit at one moment, it multiplies the impulse of \
             compression instead, unless friction says otherwise.",
        ),
        optional(
            "law",
            FieldShape::Law(&WALL_LAW, signed("m")),
            "\"5 mm*sin(30*t)\"",
            "How far the line has moved along its normal, as a function of time or a formula of angles and \
                positions; it stays if absent.",
        ),
        optional(
            "friction",
            FieldShape::Object(&WALL_FRICTION),
            "{\"kinetic\": 0.2}",
            "Dry friction; none if absent.",
        ),
    ],
};

/// The line of a wall.
pub(in crate::scene) static LINE: KeyTable = KeyTable {
    title: "a line",
    about: "A line of the ground, or of a bar.",
    fields: &[
        optional(
            "body",
            FieldShape::Body { ground: true },
            "\"table\"",
            "The bar that carries the line, which is in its frame; the ground if absent.",
        ),
        required("through", FieldShape::Pair(signed("m")), "[0, 0]", "A point of the line."),
        required(
            "normal",
            FieldShape::Pair(signed("")),
            "[1, 0]",
            "Normal, of any length but zero, towards the side the point may be on.",
        ),
    ],
};
