//! Springs, applied forces and torques.

use super::*;

/// A spring.
pub(in crate::scene) static SPRING: KeyTable = KeyTable {
    title: "a spring",
    about: "A linear spring with a damper beside it.",
    fields: &[
        required("name", FieldShape::Name, "\"spring\"", "Name, unique among springs."),
        required("between", FieldShape::Between, PLACES, "Its two ends, on different bodies."),
        required("stiffness", FieldShape::Number(not_negative("N/m")), "7.4", "Stiffness."),
        required("free_length", FieldShape::Number(not_negative("m")), "0.4", "Length without force."),
        optional(
            "damping",
            FieldShape::Number(not_negative("N·s/m")),
            "0.1",
            "Damping along the spring; 0 if absent.",
        ),
        optional(
            "model",
            FieldShape::Word(&["elastic", "rigid"]),
            "\"rigid\"",
            "\"rigid\" takes a very stiff spring for a rod of its free length, and its fast vibration for \
                the force it exerts on average; \"elastic\" if absent.",
        ),
    ],
};

/// A spring by the force it exerts.
pub(in crate::scene) static SPRING_BY_TENSION: KeyTable = KeyTable {
    title: "a spring with a law of its force",
    about: "A spring or damper whose force is a formula, in which `length` and `rate` are its own.",
    fields: &[
        required("name", FieldShape::Name, "\"spring\"", "Name, unique among springs."),
        required("between", FieldShape::Between, PLACES, "Its two ends, on different bodies."),
        required("tension", FieldShape::Formula(signed("N")), "\"k*(length - l0) + 0.1*rate\"", TENSION),
    ],
};

const TENSION: &str =
    "Force that pulls the ends together, negative where it pushes; its work is accounted for.";

/// A spring by its energy.
pub(in crate::scene) static SPRING_BY_POTENTIAL: KeyTable = KeyTable {
    title: "a spring with a law of its energy",
    about: "A spring whose energy is a formula of its `length`; what a formula of `tension` adds does work.",
    fields: &[
        required("name", FieldShape::Name, "\"spring\"", "Name, unique among springs."),
        required("between", FieldShape::Between, PLACES, "Its two ends, on different bodies."),
        required("potential", FieldShape::Formula(signed("J")), "\"k*(length - l0)^2/2\"", "Energy stored."),
        optional(
            "tension",
            FieldShape::Formula(signed("N")),
            "\"0.1*rate\"",
            "Force beside; none if absent.",
        ),
    ],
};

/// A torsion spring by the torque it exerts.
pub(in crate::scene) static TORSION_SPRING_BY_TORQUE: KeyTable = KeyTable {
    title: "a torsion spring with a law of its torque",
    about: "A torsion spring or damper whose torque is a formula, in which `angle` and `rate` are its own.",
    fields: &[
        required("name", FieldShape::Name, "\"coil\"", "Name, unique among torsion springs."),
        required("body", FieldShape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional("relative_to", FieldShape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        required("torque", FieldShape::Formula(signed("N·m")), "\"k*angle^3 + 0.01*rate\"", TURNS_BACK),
    ],
};

const TURNS_BACK: &str = "Torque that turns the bar back, against growing angles; its work is accounted for.";

/// A torsion spring by its energy.
pub(in crate::scene) static TORSION_SPRING_BY_POTENTIAL: KeyTable = KeyTable {
    title: "a torsion spring with a law of its energy",
    about: "A torsion spring whose energy is a formula of its `angle`; what a formula of `torque` adds does \
        work.",
    fields: &[
        required("name", FieldShape::Name, "\"coil\"", "Name, unique among torsion springs."),
        required("body", FieldShape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional("relative_to", FieldShape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        required("potential", FieldShape::Formula(signed("J")), "\"k*angle^4/4\"", "Energy stored."),
        optional(
            "torque",
            FieldShape::Formula(signed("N·m")),
            "\"0.01*rate\"",
            "Torque beside; none if absent.",
        ),
    ],
};

/// A torsion spring.
pub(in crate::scene) static TORSION_SPRING: KeyTable = KeyTable {
    title: "a torsion spring",
    about: "A spring and a damper between the angles of two bodies; whole turns count.",
    fields: &[
        required("name", FieldShape::Name, "\"coil\"", "Name, unique among torsion springs."),
        required("body", FieldShape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional("relative_to", FieldShape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        required("stiffness", FieldShape::Number(not_negative("N·m/rad")), "0.5", "Stiffness."),
        required("free_angle", FieldShape::Number(ANGLE), "0", "Angle without torque."),
        optional("damping", FieldShape::Number(not_negative("N·m·s/rad")), "0.01", "Damping; 0 if absent."),
    ],
};

/// A potential.
pub(in crate::scene) static POTENTIAL: KeyTable = KeyTable {
    title: "a potential",
    about: "A potential energy as a formula of angles and positions; its gradient acts on the bars.",
    fields: &[
        required("name", FieldShape::Name, "\"field\"", "Name, unique among potentials."),
        required("energy", FieldShape::Formula(signed("J")), "\"-G*m1*m2/distance\"", "The energy."),
    ],
};

/// A force.
pub(in crate::scene) static FORCE: KeyTable = KeyTable {
    title: "a force",
    about: "A force at a point of a bar, in the directions of the ground or of the bar, constant or times a \
        law of time.",
    fields: &[
        required("name", FieldShape::Name, "\"push\"", "Name, unique among forces."),
        required("body", FieldShape::Body { ground: false }, "\"bar1\"", "The bar."),
        required("point", FieldShape::Pair(signed("m")), "[0.6, 0]", "The point of the bar, in its frame."),
        required(
            "force",
            FieldShape::LawPair(signed("N")),
            "[0, 1.5]",
            "The force; its components may be formulas.",
        ),
        optional(
            "frame",
            FieldShape::Word(&["ground", "body"]),
            "\"body\"",
            "Whose x and y the force has: the \"ground\"'s, or those of the \"body\", with which it turns; \
                \"ground\" if absent.",
        ),
        optional(
            "law",
            FieldShape::Law(&FACTOR_LAW, signed("")),
            "{\"start\": 0, \"sines\": [{\"amplitude\": 1, \"frequency\": 5}]}",
            FACTOR,
        ),
    ],
};

/// A torque.
pub(in crate::scene) static TORQUE: KeyTable = KeyTable {
    title: "a torque",
    about: "A torque on a bar, and its opposite on another where it is between two; constant or times a law \
        of time.",
    fields: &[
        required("name", FieldShape::Name, "\"torque\"", "Name, unique among torques."),
        required("body", FieldShape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional(
            "relative_to",
            FieldShape::Body { ground: true },
            "\"bar2\"",
            "The bar that takes the opposite torque; the ground if absent.",
        ),
        required("torque", FieldShape::LawNumber(signed("N·m")), "0.033", "The torque; it may be a formula."),
        optional(
            "law",
            FieldShape::Law(&FACTOR_LAW, signed("")),
            "{\"start\": 0, \"sines\": [{\"amplitude\": 1, \"frequency\": 5}]}",
            FACTOR,
        ),
    ],
};

const FACTOR: &str = "What it is multiplied by, a pure number, as a function of time; constant if absent.";
