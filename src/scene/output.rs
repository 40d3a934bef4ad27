//! Outputs: formulas of the state and of what parts carry, whose values a run writes beside its own columns.
//!
//! | part | quantities |
//! | --- | --- |
//! | bar | `phi`, `omega`, `alpha`; `x`, `y`, `vx`, `vy`, `ax`, `ay` of its centre of mass; `cos`, `sin` |
//! | point | `x`, `y`, `vx`, `vy`, `ax`, `ay` |
//! | hinge, weld | `fx`, `fy`, `force`; of a weld `torque` |
//! | slider | `travel`, `speed`, `fx`, `fy`, `force`; `torque` where it keeps the angle |
//! | motor, lock | `torque` or, on a slider, `force`; of a motor `power` |
//! | spring | `length`, `rate`, `force` (positive where it pulls) |
//! | torsion spring | `angle`, `rate`, `torque` (on its body) |
//! | wall | `gap`, `force` |
//! | hinge, slider, wall with dry friction | `friction` |
//!
//! Forces are those on the bodies that [`inspect`](crate::report::inspect()) names; `force` of a hinge, a
//! weld or a slider is the magnitude.

use super::formula::unit::Dimension;
use super::formula::{Formula, FormulaError};
use super::{Coupled, Coupling, FrictionPlace, Load, Meaning, Names, Place, Rail, Scene};
use serde::Serialize;
use std::collections::{HashMap, HashSet};

/// The unit of a formula whose dimension a plain number of the scene leaves open.
const UNKNOWN: &str = "?";
/// The unit of torques, as the format writes it.
const TORQUE: &str = "N·m";

/// A formula whose value is an output.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Output {
    /// Name, unique among outputs.
    pub name: String,
    /// The formula.
    pub formula: String,
}

impl Output {
    /// Reads `FORMULA`, which then is its own name, or `NAME=FORMULA`.
    pub fn parse(text: &str) -> Self {
        let is_name = |name: &str| {
            !name.is_empty()
                && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-.".contains(&byte))
        };
        match text.split_once('=') {
            Some((name, formula)) if is_name(name.trim()) => {
                Self { name: name.trim().to_owned(), formula: formula.trim().to_owned() }
            }
            _ => Self { name: text.trim().to_owned(), formula: text.trim().to_owned() },
        }
    }

    /// Puts it into a list: in place of the one of the same name, where there is one.
    pub(crate) fn put(self, into: &mut Vec<Self>) {
        match into.iter_mut().find(|known| known.name == self.name) {
            Some(known) => *known = self,
            None => into.push(self),
        }
    }
}

/// A component of a vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Its magnitude.
    Magnitude,
}

/// What no formula of the state alone says; `P` is what points are given by, parts are given by name, as some
/// of them come and go in a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Quantity<P = Place> {
    /// Angular acceleration of a bar \[rad/s²\].
    AngularAcceleration(usize),
    /// Acceleration of the point of a bar that is so far from its centre of mass, in its frame \[m/s²\].
    Acceleration(usize, [f64; 2], Component),
    /// Force of a hinge or weld on its second body \[N\].
    Joint(String, Component),
    /// Torque of a constraint on its body \[N·m\], or force along its direction \[N\].
    Multiplier(String),
    /// Power of a motor \[W\].
    Power(String),
    /// Force of a constraint on its first body \[N\].
    Push(String, Component),
    /// Tension of a spring \[N\]; its two ends.
    Tension(String, [P; 2]),
    /// Torque of a torsion spring on its body \[N·m\]; the body.
    Torsion(String, usize),
    /// Travel of a slider \[m\], or its rate \[m/s\]: the point, a point of the rail, and its direction in
    /// the frame of the body.
    Travel([P; 2], Option<usize>, [f64; 2], bool),
    /// Gap of a wall \[m\]: the point, a point of the wall and its normal.
    Gap(P, [f64; 2], [f64; 2]),
    /// Gap of a wall that moves \[m\], by its name.
    MovingGap(String),
    /// Normal force of a wall \[N\].
    Wall(String),
    /// Friction force \[N\] or torque \[N·m\].
    Friction(String),
}

impl Quantity {
    /// The same with points given otherwise.
    pub fn with_points<P>(self, point: impl Fn(Place) -> P) -> Quantity<P> {
        match self {
            Self::AngularAcceleration(bar) => Quantity::AngularAcceleration(bar),
            Self::Acceleration(bar, arm, component) => Quantity::Acceleration(bar, arm, component),
            Self::Joint(name, component) => Quantity::Joint(name, component),
            Self::Multiplier(name) => Quantity::Multiplier(name),
            Self::Power(name) => Quantity::Power(name),
            Self::Push(name, component) => Quantity::Push(name, component),
            Self::Tension(name, ends) => Quantity::Tension(name, ends.map(point)),
            Self::Torsion(name, bar) => Quantity::Torsion(name, bar),
            Self::Travel(points, body, direction, is_rate) => {
                Quantity::Travel(points.map(point), body, direction, is_rate)
            }
            Self::Gap(at, through, normal) => Quantity::Gap(point(at), through, normal),
            Self::MovingGap(name) => Quantity::MovingGap(name),
            Self::Wall(name) => Quantity::Wall(name),
            Self::Friction(name) => Quantity::Friction(name),
        }
    }
}

/// What a name in the formula of an output stands for.
#[derive(Clone, Debug, PartialEq)]
pub enum Source<P = Place> {
    /// A quantity of the state.
    State(Meaning<P>),
    /// What a part carries.
    Carried(Quantity<P>),
}

/// A formula of outputs whose names have found what they stand for.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundOutput {
    /// Its name.
    pub name: String,
    /// Its unit, as headers write it; `?` where a plain number of the scene leaves it open.
    pub unit: String,
    /// The formula.
    pub formula: Formula,
    /// What its names stand for, in their order.
    pub sources: Vec<Source>,
}

/// The names that the formulas of outputs know.
pub struct OutputNames {
    names: Names,
    carried: HashMap<String, (Quantity, &'static str)>,
    /// In the order in which messages list them.
    order: Vec<String>,
    /// The columns of a run that are none of its outputs.
    columns: HashSet<String>,
}

impl OutputNames {
    /// Those of a scene.  Where two parts of different kinds have one name and a quantity alike, it is that
    /// of the kind that comes first in the table above.
    pub fn of(scene: &Scene) -> Self {
        let (names, columns) = (Names::with_signals(scene), columns(scene));
        let mut all = Self { names, carried: HashMap::new(), order: Vec::new(), columns };
        all.add_motion(scene);
        all.add_joints(scene);
        all.add_loads(scene);
        all
    }

    fn add(&mut self, part: &str, quantity: &str, unit: &'static str, what: Quantity) {
        let name = format!("{part}.{quantity}");
        if self.names.find(&name).is_none() && !self.carried.contains_key(&name) {
            self.carried.insert(name.clone(), (what, unit));
            self.order.push(name);
        }
    }

    fn add_state(&mut self, part: &str, quantity: &str, meaning: Meaning) {
        let name = format!("{part}.{quantity}");
        if self.names.find(&name).is_none() {
            self.names.add(name, meaning);
        }
    }

    fn add_vector(
        &mut self,
        part: &str,
        names: [&str; 2],
        unit: &'static str,
        what: impl Fn(Component) -> Quantity,
    ) {
        self.add(part, names[0], unit, what(Component::X));
        self.add(part, names[1], unit, what(Component::Y));
    }

    fn add_force(&mut self, part: &str, what: impl Fn(Component) -> Quantity) {
        self.add(part, "force", "N", what(Component::Magnitude));
        self.add_vector(part, ["fx", "fy"], "N", what);
    }

    fn add_motion(&mut self, scene: &Scene) {
        for (k, bar) in scene.bars[..scene.own_bars()].iter().enumerate() {
            self.add(&bar.name, "alpha", "rad/s²", Quantity::AngularAcceleration(k));
            self.add_vector(&bar.name, ["ax", "ay"], "m/s²", |axis| {
                Quantity::Acceleration(k, [0.0; 2], axis)
            });
            let centre = Place { bar: Some(k), point: bar.centre };
            for (name, meaning) in [
                ("x", Meaning::X(centre)),
                ("y", Meaning::Y(centre)),
                ("vx", Meaning::XRate(centre)),
                ("vy", Meaning::YRate(centre)),
            ] {
                self.add_state(&bar.name, name, meaning);
            }
        }
        for point in &scene.points {
            let Some(bar) = point.place.bar else { continue };
            let ([x, y], centre) = (point.place.point, scene.bars[bar].centre);
            let arm = [x - centre[0], y - centre[1]];
            self.add_vector(&point.name, ["ax", "ay"], "m/s²", |axis| {
                Quantity::Acceleration(bar, arm, axis)
            });
        }
    }

    fn add_joints(&mut self, scene: &Scene) {
        let named = |name: &String| name.clone();
        for hinge in &scene.hinges[..scene.own_hinges()] {
            self.add_force(&hinge.name, |axis| Quantity::Joint(named(&hinge.name), axis));
        }
        for weld in &scene.welds {
            self.add_force(&weld.name, |axis| Quantity::Joint(named(&weld.name), axis));
            let angle = Quantity::Multiplier(format!("{}.angle", weld.name));
            self.add(&weld.name, "torque", TORQUE, angle);
        }
        for slider in &scene.sliders {
            let Rail { place, direction } = slider.rail;
            let travel = |is_rate| Quantity::Travel([slider.point, place], place.bar, direction, is_rate);
            self.add(&slider.name, "travel", "m", travel(false));
            self.add(&slider.name, "speed", "m/s", travel(true));
            self.add_force(&slider.name, |axis| Quantity::Push(named(&slider.name), axis));
            if slider.locked {
                let angle = Quantity::Multiplier(format!("{}.angle", slider.name));
                self.add(&slider.name, "torque", TORQUE, angle);
            }
        }
        let turning = scene.motors.iter().map(|motor| (&motor.name, "torque", TORQUE));
        for (name, quantity, unit) in
            turning.chain(scene.drives.iter().map(|drive| (&drive.name, "force", "N")))
        {
            self.add(name, quantity, unit, Quantity::Multiplier(named(name)));
            self.add(name, "power", "W", Quantity::Power(named(name)));
        }
        for Coupling { name, coupled, .. } in &scene.couplings {
            let (quantity, unit) = match coupled {
                Coupled::Angle { .. } => ("torque", TORQUE),
                Coupled::Travel(_) => ("force", "N"),
            };
            self.add(name, quantity, unit, Quantity::Multiplier(named(name)));
            self.add(name, "power", "W", Quantity::Power(named(name)));
        }
        for lock in &scene.locks {
            self.add(&lock.name, "torque", TORQUE, Quantity::Multiplier(named(&lock.name)));
        }
    }

    fn add_loads(&mut self, scene: &Scene) {
        let springs = scene.springs.iter().map(|spring| (&spring.name, spring.between));
        let laws = scene.laws.iter().filter_map(|law| match &law.load {
            Load::Spring { between, .. } => Some((&law.name, *between)),
            _ => None,
        });
        for (name, between) in springs.chain(laws) {
            self.add(name, "force", "N", Quantity::Tension(name.clone(), between));
        }
        let springs =
            scene.torsion_springs.iter().map(|spring| (&spring.name, spring.bar, spring.relative_to));
        let laws = scene.laws.iter().filter_map(|law| match law.load {
            Load::TorsionSpring { bar, relative_to, .. } => Some((&law.name, bar, relative_to)),
            _ => None,
        });
        for (name, bar, base) in springs.chain(laws) {
            self.add_state(name, "angle", Meaning::RelativeAngle(bar, base));
            self.add_state(name, "rate", Meaning::RelativeRate(bar, base));
            self.add(name, "torque", TORQUE, Quantity::Torsion(name.clone(), bar));
        }
        for wall in &scene.walls {
            let point = Place { bar: Some(wall.bar), point: wall.point };
            let gap = match wall.on.is_some() || wall.moves() {
                true => Quantity::MovingGap(wall.name.clone()),
                false => Quantity::Gap(point, wall.through, wall.normal),
            };
            self.add(&wall.name, "gap", "m", gap);
            self.add(&wall.name, "force", "N", Quantity::Wall(wall.name.clone()));
        }
        for friction in &scene.frictions {
            let (name, unit) = match friction.at {
                FrictionPlace::Hinge { hinge, .. } => (&scene.hinges[hinge].name, TORQUE),
                FrictionPlace::Slider(slider) => (&scene.sliders[slider].name, "N"),
                FrictionPlace::Wall { wall, .. } => (&scene.walls[wall].name, "N"),
            };
            self.add(name, "friction", unit, Quantity::Friction(name.clone()));
        }
    }

    /// Reads an output, finds what its names stand for, and checks its dimensions.
    ///
    /// # Errors
    /// It is no formula, has a name that nothing has, or puts together what has different units; or its own
    /// name is that of another column.
    pub fn bind(&self, output: &Output) -> Result<BoundOutput, FormulaError> {
        let bound = self.bound(output)?;
        let Output { name, formula } = output;
        let is_constraint = name.ends_with(".C") || name.ends_with(".C'");
        if formula.trim() != name && (is_constraint || self.columns.contains(name)) {
            let problem = format!("the name {name} is that of another column");
            return Err(bound.formula.refused(formula, problem, "rename the output".into()));
        }
        Ok(bound)
    }

    fn bound(&self, Output { name, formula: text }: &Output) -> Result<BoundOutput, FormulaError> {
        let formula = Formula::parse_with(text, self.names.tables())?;
        let (mut sources, mut dimensions, mut unit) = (Vec::new(), Vec::new(), None);
        let mut are_torques = true;
        for name in formula.names() {
            let (source, dimension, own) = match (self.names.find(name), self.carried.get(name)) {
                (Some((meaning, dimension)), _) => {
                    (Source::State(meaning), dimension, meaning.unit_in_words())
                }
                (None, Some((quantity, unit))) => {
                    (Source::Carried(quantity.clone()), Some(Dimension::of(unit)), *unit)
                }
                (None, None) => {
                    let known = self.names.listed().chain(self.order.iter().map(String::as_str));
                    return Err(formula.unknown(name, &known.collect::<Vec<_>>(), self.names.tables()));
                }
            };
            are_torques &= own == TORQUE;
            let is_alone = formula.text().trim() == name;
            if let Some(dimension) = self.names.integral(name).filter(|_| is_alone) {
                unit = Some(dimension.map_or_else(|| UNKNOWN.to_owned(), |dimension| dimension.unit()));
            } else if is_alone && !matches!(source, Source::State(Meaning::Signal(_) | Meaning::Parameter(_)))
            {
                unit = Some(if own.is_empty() { "1" } else { own }.to_owned());
            }
            sources.push(source);
            dimensions.push(dimension);
        }
        let dimension = formula.dimension(&dimensions)?;
        let is_torque = are_torques && !sources.is_empty();
        let unit = unit.unwrap_or_else(|| match dimension {
            // What is made of torques alone is one, and no energy.
            Some(dimension) if is_torque && dimension.is(Dimension::of(TORQUE)) => TORQUE.to_owned(),
            Some(dimension) => dimension.unit(),
            None => UNKNOWN.to_owned(),
        });
        Ok(BoundOutput { name: name.clone(), unit: unit.replace('·', " "), formula, sources })
    }

    /// The same for a signal that outputs may use.
    pub(crate) fn bind_signal(&self, name: &str, formula: &str) -> Result<BoundOutput, FormulaError> {
        self.bound(&Output { name: name.to_owned(), formula: formula.to_owned() })
    }
}

/// Names of the columns of a scene's runs beside its outputs, but for the residuals of constraints, which end
/// in `.C` and `.C'`.
fn columns(scene: &Scene) -> HashSet<String> {
    let bars = scene.bars[..scene.own_bars()].iter().map(|bar| &bar.name);
    let driven = (scene.motors.iter().map(|motor| &motor.name))
        .chain(scene.drives.iter().map(|drive| &drive.name))
        .chain(scene.couplings.iter().map(|coupling| &coupling.name))
        .chain(scene.locks.iter().map(|lock| &lock.name));
    let fixed = scene.welds.iter().map(|weld| &weld.name);
    let fixed = fixed.chain(scene.sliders.iter().map(|slider| &slider.name));
    let of = |name: &String, quantities: &[&str]| -> Vec<String> {
        quantities.iter().map(|quantity| format!("{name}.{quantity}")).collect()
    };
    bars.flat_map(|name| of(name, &["phi", "omega", "x", "y", "vx", "vy"]))
        .chain(driven.flat_map(|name| of(name, &["torque", "force", "power"])))
        .chain(fixed.flat_map(|name| of(name, &["angle.torque"])))
        .chain(scene.integrals.iter().map(|integral| integral.name.clone()))
        .chain(["t", "kinetic", "potential", "work", "imbalance"].map(str::to_owned))
        .chain((!scene.frictions.is_empty()).then(|| "friction".to_owned()))
        .collect()
}
