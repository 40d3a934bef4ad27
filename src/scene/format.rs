//! The format of scene files as tables: what the reader accepts, what its refusals say is allowed, and what the JSON Schema states all
//! come from here, so that they cannot part.

/// An object with a fixed set of keys.
pub(super) struct Table {
    /// What it describes, with its article.
    pub title: &'static str,
    /// One sentence more, for the schema and the hint at an unknown key.
    pub about: &'static str,
    /// Its keys.
    pub fields: &'static [Field],
}

/// One key of an object.
pub(super) struct Field {
    /// The key.
    pub name: &'static str,
    /// What it means.
    pub about: &'static str,
    /// What it may hold.
    pub shape: Shape,
    /// True where it must be there; else `about` says what its absence means.
    pub required: bool,
    /// A value, as JSON.
    pub example: &'static str,
}

/// What a field may hold.
pub(super) enum Shape {
    /// A number.
    Number(Quantity),
    /// Two numbers, x and y.
    Pair(Quantity),
    /// A name: 1 to 64 letters, digits, `-`, `_`.
    Name,
    /// The name of the scene, which also names a folder.
    FolderName,
    /// Any text on one line.
    Text,
    /// The name of a bar, or `ground` where that is true.
    Body { ground: bool },
    /// `full`, `slender` or a number.
    Inertia(Quantity),
    /// The places of a hinge or a spring.
    Between,
    /// An object.
    Object(&'static Table),
    /// So many objects, each of one of these kinds.
    List { of: &'static [&'static Table], least: usize, most: usize },
    /// One object of this kind for each bar name.
    ByBar(&'static Table),
}

/// A range of numbers and its unit.
#[derive(Clone, Copy)]
pub(super) struct Quantity {
    pub least: f64,
    pub most: f64,
    /// Empty for a pure number.
    pub unit: &'static str,
}

/// Magnitudes beyond these have no physical sense, and their squares would leave the doubles.
const TINY: f64 = 1e-30;
const HUGE: f64 = 1e30;

/// Just below 2⁴³, where the last place of an angle grows beyond 1e-3 rad.
const WIDEST_ANGLE: f64 = 8.796093e12;

/// Longest name \[characters\].
pub(super) const LONGEST_NAME: usize = 64;
/// Longest description \[characters\].
pub(super) const LONGEST_TEXT: usize = 1000;
/// Most bars of a scene.
pub(super) const MOST_BARS: usize = 10_000;
/// Longest file \[bytes\].
pub(super) const LONGEST_FILE: u64 = 16 << 20;
/// The reserved name of what does not move.
pub(super) const GROUND: &str = "ground";

const fn positive(unit: &'static str) -> Quantity {
    Quantity { least: TINY, most: HUGE, unit }
}

const fn not_negative(unit: &'static str) -> Quantity {
    Quantity { least: 0.0, most: HUGE, unit }
}

const fn signed(unit: &'static str) -> Quantity {
    Quantity { least: -HUGE, most: HUGE, unit }
}

/// An absolute angle \[rad\].
pub(super) const ANGLE: Quantity = Quantity { least: -WIDEST_ANGLE, most: WIDEST_ANGLE, unit: "rad" };
/// A rate \[rad/s\].
pub(super) const RATE: Quantity = signed("rad/s");
/// A mass \[kg\].
pub(super) const MASS: Quantity = positive("kg");
/// A moment of inertia \[kg·m²\].
pub(super) const INERTIA: Quantity = not_negative("kg·m²");

const fn required(name: &'static str, shape: Shape, example: &'static str, about: &'static str) -> Field {
    Field { name, about, shape, required: true, example }
}

const fn optional(name: &'static str, shape: Shape, example: &'static str, about: &'static str) -> Field {
    Field { name, about, shape, required: false, example }
}

/// The whole scene.
pub(super) static SCENE: Table = Table {
    title: "a scene",
    about: "A planar mechanism of bars, hinges, springs, motors and walls, in SI units; angles are absolute, from +x, counter-clockwise.",
    fields: &[
        required("name", Shape::FolderName, "\"free\"", "Name of the scene, and of the folder its results go to."),
        optional("description", Shape::Text, "\"Two bars fall.\"", "One sentence for reports and charts."),
        required("gravity", Shape::Pair(signed("m/s²")), "[9.81, 0]", "Gravitational acceleration (x, y)."),
        required("bars", Shape::List { of: &[&UNIFORM_BAR, &OUTRIGHT_BAR], least: 1, most: MOST_BARS }, "[…]", "The bodies."),
        required(
            "hinges",
            Shape::List { of: &[&HINGE], least: 1, most: usize::MAX },
            "[…]",
            "Every bar hangs on the ground through a tree of them.",
        ),
        optional("springs", Shape::List { of: &[&SPRING], least: 0, most: usize::MAX }, "[…]", "Springs and dampers; none if absent."),
        optional("motors", Shape::List { of: &[&MOTOR], least: 0, most: usize::MAX }, "[…]", "Prescribed angles; none if absent."),
        optional(
            "walls",
            Shape::List { of: &[&WALL], least: 0, most: usize::MAX },
            "[…]",
            "Lines that points cannot pass; none if absent.",
        ),
        optional(
            "start",
            Shape::ByBar(&START),
            "{\"bar1\": {\"phi\": 0, \"omega\": 0}}",
            "Angle and rate of each bar at t = 0, by bar name; a bar that a motor drives may be left out.",
        ),
        required("until", Shape::Number(positive("s")), "10", "Horizon: the run ends at this time."),
        required("every", Shape::Number(positive("s")), "0.01", "Output interval, at most the horizon."),
    ],
};

/// A bar by its shape.
pub(super) static UNIFORM_BAR: Table = Table {
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
pub(super) static OUTRIGHT_BAR: Table = Table {
    title: "a bar given by its mass",
    about: UNIFORM_BAR.about,
    fields: &[
        required("name", Shape::Name, "\"bar1\"", BAR_NAME),
        required("mass", Shape::Number(MASS), "0.0603", "Mass."),
        required("centre", Shape::Pair(signed("m")), "[0.3, 0]", "Centre of mass in the body's frame."),
        required("inertia", Shape::Number(INERTIA), "0.0018", "Moment of inertia about the centre of mass; 0 for a point mass."),
        optional(
            "length",
            Shape::Number(not_negative("m")),
            "0.6",
            "Length in drawings; if absent, twice the distance of the centre, or twice the radius of gyration where that is zero.",
        ),
    ],
};

const BAR_NAME: &str = "Name, unique among bars; not \"ground\".";

/// A hinge.
pub(super) static HINGE: Table = Table {
    title: "a hinge",
    about: "Two places, on different bodies, that coincide for ever.",
    fields: &[
        required("name", Shape::Name, "\"A\"", "Name, unique among hinges."),
        required("between", Shape::Between, PLACES, "The two places."),
    ],
};

const PLACES: &str = "[{\"body\": \"ground\", \"point\": [0, 0]}, {\"body\": \"bar1\", \"point\": [0, 0]}]";

/// A place.
pub(super) static PLACE: Table = Table {
    title: "a place",
    about: "A point of a bar or of the ground.",
    fields: &[
        required("body", Shape::Body { ground: true }, "\"bar1\"", "Name of a bar, or \"ground\"."),
        required("point", Shape::Pair(signed("m")), "[0.6, 0]", "Coordinates in the bar's frame, or in the world's for the ground."),
    ],
};

/// A spring.
pub(super) static SPRING: Table = Table {
    title: "a spring",
    about: "A linear spring with a damper beside it.",
    fields: &[
        required("name", Shape::Name, "\"spring\"", "Name, unique among springs."),
        required("between", Shape::Between, PLACES, "Its two ends, on different bodies."),
        required("stiffness", Shape::Number(not_negative("N/m")), "7.4", "Stiffness."),
        required("free_length", Shape::Number(not_negative("m")), "0.4", "Length without force."),
        optional("damping", Shape::Number(not_negative("N·s/m")), "0.1", "Damping along the spring; 0 if absent."),
    ],
};

/// A motor.
pub(super) static MOTOR: Table = Table {
    title: "a motor",
    about: "The angle of a bar, absolute or relative to another bar, as a function of time.",
    fields: &[
        required("name", Shape::Name, "\"motor\"", "Name, unique among motors; it also names the constraint."),
        required("body", Shape::Body { ground: false }, "\"bar1\"", "The driven bar."),
        optional("relative_to", Shape::Body { ground: true }, "\"bar2\"", "The bar its angle is measured from; the ground (+x) if absent."),
        required("law", Shape::Object(&LAW), "{\"start\": 0, \"rate\": 1}", "The angle as a function of time."),
    ],
};

/// The law of a motor.
pub(super) static LAW: Table = Table {
    title: "a law",
    about: "start + rate·t + acceleration·t²/2 + the sum of amplitude·sin(frequency·t + phase).",
    fields: &[
        required("start", Shape::Number(ANGLE), "1.5707963267948966", "Angle at t = 0 without the sines."),
        optional("rate", Shape::Number(RATE), "3", "Rate; 0 if absent."),
        optional("acceleration", Shape::Number(signed("rad/s²")), "0.5", "Acceleration; 0 if absent."),
        optional("sines", Shape::List { of: &[&SINE], least: 0, most: usize::MAX }, "[…]", "Sines on top; none if absent."),
    ],
};

/// One sine of a law.
pub(super) static SINE: Table = Table {
    title: "a sine",
    about: "amplitude·sin(frequency·t + phase).",
    fields: &[
        required("amplitude", Shape::Number(ANGLE), "0.2", "Amplitude."),
        required("frequency", Shape::Number(RATE), "5", "Angular frequency."),
        optional("phase", Shape::Number(ANGLE), "0", "Phase at t = 0; 0 if absent."),
    ],
};

/// A wall.
pub(super) static WALL: Table = Table {
    title: "a wall",
    about: "A line of the ground that a point of a bar cannot pass.",
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
    ],
};

/// The line of a wall.
pub(super) static LINE: Table = Table {
    title: "a line",
    about: "A line of the ground.",
    fields: &[
        required("through", Shape::Pair(signed("m")), "[0, 0]", "A point of the line."),
        required("normal", Shape::Pair(signed("")), "[1, 0]", "Normal, of any length but zero, towards the side the point may be on."),
    ],
};

/// The start of a bar.
pub(super) static START: Table = Table {
    title: "a start",
    about: "Angle and rate of a bar at t = 0.",
    fields: &[
        required("phi", Shape::Number(ANGLE), "0", "Absolute angle; may be many turns."),
        required("omega", Shape::Number(RATE), "0", "Rate."),
    ],
};

impl Table {
    /// The field of that name.
    pub fn field(&self, name: &str) -> Option<&'static Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// Its keys, for messages.
    pub fn keys(&self) -> String {
        self.fields.iter().map(|field| field.name).collect::<Vec<_>>().join(", ")
    }
}

impl Field {
    /// `for example "density": 670`.
    pub fn for_example(&self) -> String {
        format!("for example \"{}\": {}", self.name, self.example)
    }
}

impl Shape {
    /// What is allowed, as it follows "must".
    pub fn allowed(&self) -> String {
        match self {
            Self::Number(quantity) => format!("must be a number {quantity}"),
            Self::Pair(quantity) => format!("must be two numbers [x, y], each {quantity}"),
            Self::Name => format!("must be a name: 1 to {LONGEST_NAME} letters, digits, - or _"),
            Self::FolderName => format!("must be a name: 1 to {LONGEST_NAME} letters, digits, - or _, not starting with -"),
            Self::Text => format!("must be text on one line, at most {LONGEST_TEXT} characters"),
            Self::Body { ground: true } => "must be the name of a bar, or \"ground\"".to_owned(),
            Self::Body { ground: false } => "must be the name of a bar".to_owned(),
            Self::Inertia(quantity) => format!("must be \"full\", \"slender\" or a number {quantity}"),
            Self::Between => "must be a list of two places, each {\"body\": …, \"point\": [x, y]}".to_owned(),
            Self::Object(table) => format!("must be an object with the keys {}", table.keys()),
            Self::List { least: 0, most: usize::MAX, .. } => "must be a list of objects [{…}, …]".to_owned(),
            Self::List { least, most: usize::MAX, .. } => format!("must be a list of at least {least} objects [{{…}}, …]"),
            Self::List { least, most, .. } => format!("must be a list of {least} to {most} objects [{{…}}, …]"),
            Self::ByBar(table) => format!("must be an object of {{bar name: {{{}}}}}", table.keys()),
        }
    }
}

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "from {} to {}", plain(self.least), plain(self.most))?;
        if self.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.unit) }
    }
}

impl Quantity {
    /// True where `number` is inside the range; infinities and NaN are not.
    pub fn holds(&self, number: f64) -> bool {
        (self.least..=self.most).contains(&number)
    }
}

/// A number to four digits, for what is measured rather than given.
pub(super) fn about(number: f64) -> String {
    plain(format!("{number:.3e}").parse().unwrap_or(number))
}

/// A number as people write it.
fn plain(number: f64) -> String {
    let size = number.abs();
    if size != 0.0 && !(1e-3..1e6).contains(&size) { format!("{number:e}") } else { number.to_string() }
}
