//! The tables themselves: one for each kind of object of a scene file.

use super::{
    ANGLE, Field, INERTIA, MASS, MOST_BARS, Quantity, RATE, Shape, Table, not_negative, optional, positive,
    required, signed,
};

/// The whole scene.
pub(in crate::scene) static SCENE: Table = Table {
    title: "a scene",
    about: "A planar mechanism of bars, joints, springs, forces, motors and walls, in SI units; angles are absolute, from +x, counter-clockwise.",
    fields: &[
        required(
            "name",
            Shape::FolderName,
            "\"free\"",
            "Name of the scene, and of the folder its results go to.",
        ),
        optional("description", Shape::Text, "\"Two bars fall.\"", "One sentence for reports and charts."),
        required("gravity", Shape::Pair(signed("m/s²")), "[9.81, 0]", "Gravitational acceleration (x, y)."),
        required(
            "bars",
            Shape::List { of: &[&UNIFORM_BAR, &OUTRIGHT_BAR], least: 1, most: MOST_BARS },
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
            Shape::Parameters,
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
            Shape::Tables,
            "{\"gust\": [[0, 0], [1, 2.5], [3, 0]]}",
            "Functions by name, smooth through points (x, y), for formulas as gust(t): the points, a CSV file of two columns as \"gust.csv\", or two of its columns as {\"file\": \"log.csv\", \"x\": \"time\", \"y\": \"wind\"}; none if absent.",
        ),
        optional(
            "signals",
            Shape::Signals,
            "{\"speed\": \"sqrt(tip.vx^2 + tip.vy^2)\"}",
            "Formulas of time and state by name, each may use those before it; none if absent.",
        ),
        optional(
            "integrals",
            Shape::Signals,
            "{\"sum\": \"aim - bar1.phi\"}",
            "Integrals of formulas over time by name, from 0 on, for other formulas, as those of controllers; none if absent.",
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
            Shape::Outputs,
            "{\"bearing\": \"A.force\", \"pen\": \"tip.x\"}",
            "Columns of the trajectory beside those of every run, as formulas of the state and of what parts carry, by name; or a list of formulas, which then are their own names; none if absent.",
        ),
        optional(
            "inactive",
            Shape::Names,
            "[\"latch\"]",
            "Springs, torsion springs, forces, torques and potentials that do not act until an event switches them on; none if absent.",
        ),
        optional(
            "start",
            Shape::ByBar(&START),
            "{\"bar1\": {\"phi\": 0, \"omega\": 0}}",
            "What is known of each bar at t = 0, by bar name.  In a tree of hinges on the ground a bar that no motor drives must have its angle and rate; \
             where loops, sliders, welds or free bars are, the rest is found from what is given.",
        ),
        required("until", Shape::Number(positive("s")), "10", "Horizon: the run ends at this time."),
        required("every", Shape::Number(positive("s")), "0.01", "Output interval, at most the horizon."),
    ],
};

/// A bar by its shape.
pub(in crate::scene) static UNIFORM_BAR: Table = Table {
    title: "a uniform bar",
    about: "A bar is given either by length, width, thickness and density or by mass, centre and inertia; its frame has the origin at one \
            end and x along the bar.",
    fields: &[
        required("name", Shape::Name, "\"bar1\"", BAR_NAME),
        required("length", Shape::Number(positive("m")), "0.6", "Length."),
        required("width", Shape::Number(positive("m")), "0.05", "Width in the plane."),
        required("thickness", Shape::Number(positive("m")), "0.003", "Thickness across the plane."),
        required("density", Shape::Number(positive("kg/m³")), "670", "Density."),
        optional(
            "inertia",
            Shape::Inertia(INERTIA),
            "\"full\"",
            "Inertia about the centre: \"full\" m(l² + w²)/12, \"slender\" m l²/12, or a number; \"full\" if absent.",
        ),
    ],
};

/// A body by its mass distribution.
pub(in crate::scene) static OUTRIGHT_BAR: Table = Table {
    title: "a bar given by its mass",
    about: UNIFORM_BAR.about,
    fields: &[
        required("name", Shape::Name, "\"bar1\"", BAR_NAME),
        required("mass", Shape::Number(MASS), "0.0603", "Mass."),
        required("centre", Shape::Pair(signed("m")), "[0.3, 0]", "Centre of mass in the body's frame."),
        required(
            "inertia",
            Shape::Number(INERTIA),
            "0.0018",
            "Moment of inertia about the centre of mass; 0 for a point mass.",
        ),
        optional(
            "length",
            Shape::Number(not_negative("m")),
            "0.6",
            "Length in drawings; if absent, twice the distance of the centre, or twice the radius of gyration where that is zero.",
        ),
    ],
};

const fn any_number_of(of: &'static [&'static Table]) -> Shape {
    Shape::List { of, least: 0, most: usize::MAX }
}

const BAR_NAME: &str = "Name, unique among bars; not \"ground\".";

/// A hinge.
pub(in crate::scene) static HINGE: Table = Table {
    title: "a hinge",
    about: "Two places, on different bodies, that coincide for ever.",
    fields: &[
        required("name", Shape::Name, "\"A\"", "Name, unique among hinges."),
        required("between", Shape::Between, PLACES, "The two places."),
        optional(
            "friction",
            Shape::Object(&HINGE_FRICTION),
            "{\"radius\": 0.01, \"kinetic\": 0.2}",
            "Dry friction; none if absent.",
        ),
    ],
};

const KINETIC: Field = required(
    "kinetic",
    Shape::Number(not_negative("")),
    "0.2",
    "Coefficient of friction while the two slide on each other.",
);
const STATIC: Field = optional(
    "static",
    Shape::Number(not_negative("")),
    "0.3",
    "Coefficient of friction while they stick, at least the kinetic one; the same if absent.",
);

/// Dry friction of a hinge.
pub(in crate::scene) static HINGE_FRICTION: Table = Table {
    title: "friction of a hinge",
    about: "Coulomb friction: a torque of the coefficient times the radius times the force that the hinge carries.",
    fields: &[
        required("radius", Shape::Number(positive("m")), "0.01", "Radius at which it acts."),
        KINETIC,
        STATIC,
    ],
};

/// Dry friction of a slider.
pub(in crate::scene) static SLIDER_FRICTION: Table = Table {
    title: "friction of a slider",
    about: "Coulomb friction: a force along the rail of the coefficient times the force across it.",
    fields: &[KINETIC, STATIC],
};

/// Dry friction at a wall.
pub(in crate::scene) static WALL_FRICTION: Table = Table {
    title: "friction at a wall",
    about: "Coulomb friction: a force along the wall of the coefficient times its pressure, in impacts too.",
    fields: &[
        KINETIC,
        STATIC,
        optional(
            "impact",
            Shape::Word(&["poisson", "newton"]),
            "\"newton\"",
            "What restitution multiplies in an impact: \"poisson\", the impulse of compression; \"newton\", the normal velocity; \"poisson\" if absent.",
        ),
    ],
};

const PLACES: &str = "[{\"body\": \"ground\", \"point\": [0, 0]}, {\"body\": \"bar1\", \"point\": [0, 0]}]";

/// A slider.
pub(in crate::scene) static SLIDER: Table = Table {
    title: "a slider",
    about: "A point of a body that slides along a line of the ground or of another body.",
    fields: &[
        required(
            "name",
            Shape::Name,
            "\"slider\"",
            "Name, unique among sliders; it also names the constraints.",
        ),
        required(
            "point",
            Shape::Object(&PLACE),
            "{\"body\": \"block\", \"point\": [0, 0]}",
            "The point that slides; on another body than the rail.",
        ),
        required(
            "rail",
            Shape::Object(&RAIL),
            "{\"body\": \"ground\", \"point\": [0, 0], \"direction\": [1, 0]}",
            "The line; travel along it is counted from its point.",
        ),
        optional(
            "angle",
            Shape::Word(&["free", "locked"]),
            "\"locked\"",
            "Whether the two bodies may turn on each other, or keep the angle between them that they have at the start; \"free\" if absent.",
        ),
        optional(
            "friction",
            Shape::Object(&SLIDER_FRICTION),
            "{\"kinetic\": 0.2}",
            "Dry friction; none if absent.",
        ),
    ],
};

/// The line of a slider.
pub(in crate::scene) static RAIL: Table = Table {
    title: "a rail",
    about: "A line of a bar or of the ground.",
    fields: &[
        required("body", Shape::Body { ground: true }, "\"ground\"", "Name of a bar, or \"ground\"."),
        required(
            "point",
            Shape::Pair(signed("m")),
            "[0, 0]",
            "A point of the line, in the bar's frame, or in the world's for the ground.",
        ),
        required(
            "direction",
            Shape::Pair(signed("")),
            "[1, 0]",
            "Direction, of any length but zero, in the same frame; travel grows along it.",
        ),
    ],
};

/// A weld.
pub(in crate::scene) static WELD: Table = Table {
    title: "a weld",
    about: "Two places that coincide, of bodies that keep the angle between them that they have at the start.",
    fields: &[
        required("name", Shape::Name, "\"W\"", "Name, unique among welds; it also names the constraints."),
        required("between", Shape::Between, PLACES, "The two places, on different bodies."),
    ],
};

/// A lock.
pub(in crate::scene) static LOCK: Table = Table {
    title: "a lock",
    about: "An angle of a bar, absolute or relative to another bar, that stays as it is.",
    fields: &[
        required("name", Shape::Name, "\"lock\"", "Name, unique among locks; it also names the constraint."),
        required("body", Shape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional("relative_to", Shape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        optional("angle", Shape::Number(ANGLE), "0.5", "The angle; that of the start if absent."),
    ],
};

const MEASURED_FROM: &str = "The bar its angle is measured from; the ground (+x) if absent.";

/// A place.
pub(in crate::scene) static PLACE: Table = Table {
    title: "a place",
    about: "A point of a bar or of the ground.",
    fields: &[
        required("body", Shape::Body { ground: true }, "\"bar1\"", "Name of a bar, or \"ground\"."),
        required(
            "point",
            Shape::Pair(signed("m")),
            "[0.6, 0]",
            "Coordinates in the bar's frame, or in the world's for the ground.",
        ),
    ],
};

/// A spring.
pub(in crate::scene) static SPRING: Table = Table {
    title: "a spring",
    about: "A linear spring with a damper beside it.",
    fields: &[
        required("name", Shape::Name, "\"spring\"", "Name, unique among springs."),
        required("between", Shape::Between, PLACES, "Its two ends, on different bodies."),
        required("stiffness", Shape::Number(not_negative("N/m")), "7.4", "Stiffness."),
        required("free_length", Shape::Number(not_negative("m")), "0.4", "Length without force."),
        optional(
            "damping",
            Shape::Number(not_negative("N·s/m")),
            "0.1",
            "Damping along the spring; 0 if absent.",
        ),
        optional(
            "model",
            Shape::Word(&["elastic", "rigid"]),
            "\"rigid\"",
            "\"rigid\" takes a very stiff spring for a rod of its free length, and its fast vibration for the force it exerts on average; \"elastic\" if absent.",
        ),
    ],
};

/// A spring by the force it exerts.
pub(in crate::scene) static SPRING_BY_TENSION: Table = Table {
    title: "a spring with a law of its force",
    about: "A spring or damper whose force is a formula, in which `length` and `rate` are its own.",
    fields: &[
        required("name", Shape::Name, "\"spring\"", "Name, unique among springs."),
        required("between", Shape::Between, PLACES, "Its two ends, on different bodies."),
        required("tension", Shape::Formula(signed("N")), "\"k*(length - l0) + 0.1*rate\"", TENSION),
    ],
};

const TENSION: &str =
    "Force that pulls the ends together, negative where it pushes; its work is accounted for.";

/// A spring by its energy.
pub(in crate::scene) static SPRING_BY_POTENTIAL: Table = Table {
    title: "a spring with a law of its energy",
    about: "A spring whose energy is a formula of its `length`; what a formula of `tension` adds does work.",
    fields: &[
        required("name", Shape::Name, "\"spring\"", "Name, unique among springs."),
        required("between", Shape::Between, PLACES, "Its two ends, on different bodies."),
        required("potential", Shape::Formula(signed("J")), "\"k*(length - l0)^2/2\"", "Energy stored."),
        optional("tension", Shape::Formula(signed("N")), "\"0.1*rate\"", "Force beside; none if absent."),
    ],
};

/// A torsion spring by the torque it exerts.
pub(in crate::scene) static TORSION_SPRING_BY_TORQUE: Table = Table {
    title: "a torsion spring with a law of its torque",
    about: "A torsion spring or damper whose torque is a formula, in which `angle` and `rate` are its own.",
    fields: &[
        required("name", Shape::Name, "\"coil\"", "Name, unique among torsion springs."),
        required("body", Shape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional("relative_to", Shape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        required("torque", Shape::Formula(signed("N·m")), "\"k*angle^3 + 0.01*rate\"", TURNS_BACK),
    ],
};

const TURNS_BACK: &str = "Torque that turns the bar back, against growing angles; its work is accounted for.";

/// A torsion spring by its energy.
pub(in crate::scene) static TORSION_SPRING_BY_POTENTIAL: Table = Table {
    title: "a torsion spring with a law of its energy",
    about: "A torsion spring whose energy is a formula of its `angle`; what a formula of `torque` adds does work.",
    fields: &[
        required("name", Shape::Name, "\"coil\"", "Name, unique among torsion springs."),
        required("body", Shape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional("relative_to", Shape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        required("potential", Shape::Formula(signed("J")), "\"k*angle^4/4\"", "Energy stored."),
        optional("torque", Shape::Formula(signed("N·m")), "\"0.01*rate\"", "Torque beside; none if absent."),
    ],
};

/// A point with a name.
pub(in crate::scene) static NAMED_POINT: Table = Table {
    title: "a point with a name",
    about: "A point of a bar or of the ground that formulas can speak of.",
    fields: &[
        required("name", Shape::Name, "\"tip\"", "Name, unique among points."),
        required("body", Shape::Body { ground: true }, "\"bar1\"", "Name of a bar, or \"ground\"."),
        required(
            "point",
            Shape::Pair(signed("m")),
            "[0.6, 0]",
            "Coordinates in the bar's frame, or in the world's for the ground.",
        ),
    ],
};

/// A potential.
pub(in crate::scene) static POTENTIAL: Table = Table {
    title: "a potential",
    about: "A potential energy as a formula of angles and positions; its gradient acts on the bars.",
    fields: &[
        required("name", Shape::Name, "\"field\"", "Name, unique among potentials."),
        required("energy", Shape::Formula(signed("J")), "\"-G*m1*m2/distance\"", "The energy."),
    ],
};

/// An event.
pub(in crate::scene) static EVENT: Table = Table {
    title: "an event",
    about: "Where a formula of time and state passes zero; it is recorded, and may end the run or switch parts.",
    fields: &[
        required("name", Shape::Name, "\"upright\"", "Name, unique among events."),
        required(
            "when",
            Shape::Formula(signed("")),
            "\"bar1.sin\"",
            "The event function: its zeros are the event.",
        ),
        optional(
            "direction",
            Shape::Word(&["either", "rising", "falling"]),
            "\"rising\"",
            "Which zeros count: \"rising\" from negative to positive, \"falling\" the others; \"either\" if absent.",
        ),
        optional(
            "action",
            Shape::Word(&["record", "stop"]),
            "\"stop\"",
            "\"stop\" ends the run there; \"record\" if absent.",
        ),
        optional("on", Shape::Names, "[\"latch\"]", "Parts that act from then on; none if absent."),
        optional(
            "off",
            Shape::Names,
            "[\"motor_torque\"]",
            "Parts that act no longer from then on; none if absent.",
        ),
        optional(
            "set",
            Shape::Signals,
            "{\"gain\": \"2*gain\"}",
            "Parameters that have another value in formulas of time and state from then on; none if absent.",
        ),
    ],
};

/// A torsion spring.
pub(in crate::scene) static TORSION_SPRING: Table = Table {
    title: "a torsion spring",
    about: "A spring and a damper between the angles of two bodies; whole turns count.",
    fields: &[
        required("name", Shape::Name, "\"coil\"", "Name, unique among torsion springs."),
        required("body", Shape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional("relative_to", Shape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        required("stiffness", Shape::Number(not_negative("N·m/rad")), "0.5", "Stiffness."),
        required("free_angle", Shape::Number(ANGLE), "0", "Angle without torque."),
        optional("damping", Shape::Number(not_negative("N·m·s/rad")), "0.01", "Damping; 0 if absent."),
    ],
};

/// A force.
pub(in crate::scene) static FORCE: Table = Table {
    title: "a force",
    about: "A force at a point of a bar, in the directions of the ground or of the bar, constant or times a law of time.",
    fields: &[
        required("name", Shape::Name, "\"push\"", "Name, unique among forces."),
        required("body", Shape::Body { ground: false }, "\"bar1\"", "The bar."),
        required("point", Shape::Pair(signed("m")), "[0.6, 0]", "The point of the bar, in its frame."),
        required(
            "force",
            Shape::LawPair(signed("N")),
            "[0, 1.5]",
            "The force; its components may be formulas.",
        ),
        optional(
            "frame",
            Shape::Word(&["ground", "body"]),
            "\"body\"",
            "Whose x and y the force has: the \"ground\"'s, or those of the \"body\", with which it turns; \"ground\" if absent.",
        ),
        optional(
            "law",
            Shape::Law(&FACTOR_LAW, signed("")),
            "{\"start\": 0, \"sines\": [{\"amplitude\": 1, \"frequency\": 5}]}",
            FACTOR,
        ),
    ],
};

/// A torque.
pub(in crate::scene) static TORQUE: Table = Table {
    title: "a torque",
    about: "A torque on a bar, and its opposite on another where it is between two; constant or times a law of time.",
    fields: &[
        required("name", Shape::Name, "\"torque\"", "Name, unique among torques."),
        required("body", Shape::Body { ground: false }, "\"bar1\"", "The bar."),
        optional(
            "relative_to",
            Shape::Body { ground: true },
            "\"bar2\"",
            "The bar that takes the opposite torque; the ground if absent.",
        ),
        required("torque", Shape::LawNumber(signed("N·m")), "0.033", "The torque; it may be a formula."),
        optional(
            "law",
            Shape::Law(&FACTOR_LAW, signed("")),
            "{\"start\": 0, \"sines\": [{\"amplitude\": 1, \"frequency\": 5}]}",
            FACTOR,
        ),
    ],
};

const FACTOR: &str = "What it is multiplied by, a pure number, as a function of time; constant if absent.";

/// A motor.
pub(in crate::scene) static MOTOR: Table = Table {
    title: "a motor",
    about: "The angle of a bar, absolute or relative to another bar, as a function of time.",
    fields: &[
        required(
            "name",
            Shape::Name,
            "\"motor\"",
            "Name, unique among motors; it also names the constraint.",
        ),
        required("body", Shape::Body { ground: false }, "\"bar1\"", "The driven bar."),
        optional("relative_to", Shape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        required(
            "law",
            Shape::Law(&LAW, ANGLE),
            "{\"start\": 0, \"rate\": 1}",
            "The angle as a function of time.",
        ),
    ],
};

/// A motor on a slider.
pub(in crate::scene) static DRIVE: Table = Table {
    title: "a motor on a slider",
    about: "The travel of a slider along its rail as a function of time.",
    fields: &[
        required(
            "name",
            Shape::Name,
            "\"motor\"",
            "Name, unique among motors; it also names the constraint.",
        ),
        required("slider", Shape::SliderName, "\"slider\"", "The driven slider."),
        required(
            "law",
            Shape::Law(&TRAVEL_LAW, signed("m")),
            "{\"start\": 0, \"rate\": 0.1}",
            "The travel as a function of time.",
        ),
    ],
};

/// The law of a wall.
pub(in crate::scene) static WALL_LAW: Table =
    Table { title: "a law of a wall", about: SUM, fields: &TRAVEL_TERMS };
/// The law of a motor.
pub(in crate::scene) static LAW: Table = Table { title: "a law", about: SUM, fields: &ANGLE_TERMS };
/// The law of a motor on a slider.
pub(in crate::scene) static TRAVEL_LAW: Table =
    Table { title: "a law of travel", about: SUM, fields: &TRAVEL_TERMS };
/// The law of a force or a torque.
pub(in crate::scene) static FACTOR_LAW: Table =
    Table { title: "a law without unit", about: SUM, fields: &FACTOR_TERMS };

const SUM: &str = "start + rate·t + acceleration·t²/2 + the sum of amplitude·sin(frequency·t + phase).";

static ANGLE_TERMS: [Field; 4] = terms(
    required("start", Shape::Number(ANGLE), "1.5707963267948966", "Angle at t = 0 without the sines."),
    [RATE, signed("rad/s²")],
    &[&SINE],
);
static TRAVEL_TERMS: [Field; 4] = terms(
    required("start", Shape::Number(signed("m")), "0.1", "Travel at t = 0 without the sines."),
    [signed("m/s"), signed("m/s²")],
    &[&TRAVEL_SINE],
);
static FACTOR_TERMS: [Field; 4] = terms(
    required("start", Shape::Number(signed("")), "1", "Factor at t = 0 without the sines."),
    [signed("1/s"), signed("1/s²")],
    &[&FACTOR_SINE],
);

const fn terms(
    start: Field,
    [rate, acceleration]: [Quantity; 2],
    sine: &'static [&'static Table],
) -> [Field; 4] {
    [
        start,
        optional("rate", Shape::Number(rate), "3", "Rate; 0 if absent."),
        optional("acceleration", Shape::Number(acceleration), "0.5", "Acceleration; 0 if absent."),
        optional("sines", any_number_of(sine), "[…]", "Sines on top; none if absent."),
    ]
}

/// One sine of a motor's law.
pub(in crate::scene) static SINE: Table = Table { title: "a sine", about: WAVE, fields: &ANGLE_WAVE };
static TRAVEL_SINE: Table = Table { title: "a sine", about: WAVE, fields: &TRAVEL_WAVE };
static FACTOR_SINE: Table = Table { title: "a sine", about: WAVE, fields: &FACTOR_WAVE };

const WAVE: &str = "amplitude·sin(frequency·t + phase).";

static ANGLE_WAVE: [Field; 3] = wave(ANGLE);
static TRAVEL_WAVE: [Field; 3] = wave(signed("m"));
static FACTOR_WAVE: [Field; 3] = wave(signed(""));

const fn wave(amplitude: Quantity) -> [Field; 3] {
    [
        required("amplitude", Shape::Number(amplitude), "0.2", "Amplitude."),
        required("frequency", Shape::Number(RATE), "5", "Angular frequency."),
        optional("phase", Shape::Number(ANGLE), "0", "Phase at t = 0; 0 if absent."),
    ]
}

/// A wall.
pub(in crate::scene) static WALL: Table = Table {
    title: "a wall",
    about: "A line of the ground, or of another bar, that a point of a bar cannot pass.",
    fields: &[
        required("name", Shape::Name, "\"wall\"", "Name, unique among walls."),
        required("body", Shape::Body { ground: false }, "\"bar2\"", "The bar."),
        required("point", Shape::Pair(signed("m")), "[0.6, 0]", "The point of the bar, in its frame."),
        required("line", Shape::Object(&LINE), "{\"through\": [0, 0], \"normal\": [1, 0]}", "The line."),
        required(
            "restitution",
            Shape::Number(Quantity { least: 0.0, most: 1.0, unit: "" }),
            "0.5",
            "The normal velocity after an impact is -restitution times the one before: 0 plastic, 1 elastic.",
        ),
        optional(
            "law",
            Shape::Law(&WALL_LAW, signed("m")),
            "\"5 mm*sin(30*t)\"",
            "How far the line has moved along its normal, as a function of time; it stays if absent.",
        ),
        optional(
            "friction",
            Shape::Object(&WALL_FRICTION),
            "{\"kinetic\": 0.2}",
            "Dry friction; none if absent.",
        ),
    ],
};

/// The line of a wall.
pub(in crate::scene) static LINE: Table = Table {
    title: "a line",
    about: "A line of the ground, or of a bar.",
    fields: &[
        optional(
            "body",
            Shape::Body { ground: true },
            "\"table\"",
            "The bar that carries the line, which is in its frame; the ground if absent.",
        ),
        required("through", Shape::Pair(signed("m")), "[0, 0]", "A point of the line."),
        required(
            "normal",
            Shape::Pair(signed("")),
            "[1, 0]",
            "Normal, of any length but zero, towards the side the point may be on.",
        ),
    ],
};

/// The start of a bar.
pub(in crate::scene) static START: Table = Table {
    title: "a start",
    about: "What is known of a bar at t = 0; its origin and velocity only where no hinge or weld ties it, or the bars it hangs together with, to the ground.",
    fields: &[
        optional("phi", Shape::Number(ANGLE), "0", "Absolute angle; may be many turns."),
        optional("omega", Shape::Number(RATE), "0", "Rate."),
        optional("origin", Shape::Pair(signed("m")), "[0, 0]", "Position of the bar's origin."),
        optional("velocity", Shape::Pair(signed("m/s")), "[0, 0]", "Velocity of the bar's origin."),
    ],
};
