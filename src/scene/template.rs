//! A scene some of whose numbers are left open, to be filled in again and again.
//!
//! A number is named by its path as in `--set`, or in short by the name of the bar, joint, spring, force,
//! motor or wall it belongs to: `bar1.phi` is `start.bar1.phi`, `motor.rate` is `motors.motor.law.rate`,
//! `spring.stiffness` is `springs.spring.stiffness`.  A path is judged against the tables of `format.rs` and
//! the scene's own text once; values are judged when they are filled in.

mod walk;

pub(super) use walk::FormatWalk;

use super::error::SceneError;
use super::format::{FieldShape, KeyTable, LAW, SCENE, START, TRAVEL_LAW, kind};
use super::formula::Formula;
use super::formula::unit::Dimension;
use super::locate::{Located, Value};
use super::read::{TableFiles, listed, nearest, parse_beside, put_together, read_text, source_name};
use super::set::{Override, hint, name};
use super::{Output, Scene};
use std::path::Path;

/// The text of a scene, and the overrides it is always read with.
#[derive(Clone, Debug)]
pub struct Template {
    text: String,
    source: String,
    overrides: Vec<Override>,
    outputs: Vec<Output>,
    tables: TableFiles,
}

/// A number of a scene that can be varied.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its whole path: `start.bar1.phi`.
    pub path: String,
    /// Its unit: `rad`; empty for a pure number.
    pub unit: &'static str,
    /// Where a start is varied that nothing else in the scene has a say in: the number of the bar.  Such a
    /// value can be put into a scene that was read before.
    pub start: Option<(usize, StartValue)>,
}

/// Which number of a bar's start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartValue {
    /// The angle \[rad\].
    Phi,
    /// The rate \[rad/s\].
    Omega,
}

/// The lists whose elements can be meant by their name alone, and what their paths begin with.
const LISTS: [&str; 14] = [
    "bars",
    "hinges",
    "sliders",
    "welds",
    "locks",
    "springs",
    "torsion_springs",
    "forces",
    "torques",
    "motors",
    "walls",
    "points",
    "potentials",
    "events",
];

impl Template {
    /// Reads the text of the scene file `path`.
    ///
    /// # Errors
    /// As [`read_text`].
    pub fn read(path: &Path, overrides: &[Override]) -> Result<Self, SceneError> {
        Ok(Self::new(read_text(path)?, source_name(path), overrides))
    }

    /// Takes the text of a scene; `source` is the name of its file in messages.
    pub fn new(text: String, source: String, overrides: &[Override]) -> Self {
        let (outputs, tables) = (Vec::new(), TableFiles::default());
        Self { text, source, overrides: overrides.to_vec(), outputs, tables }
    }

    /// The same with files of its tables that were read before; it reads them again each time otherwise.
    #[must_use]
    pub fn with_tables(mut self, tables: TableFiles) -> Self {
        self.tables = tables;
        self
    }

    /// The same with outputs beside those there are, of the scene or from a call before, or in place of those
    /// of the same names.
    #[must_use]
    pub fn with_outputs(mut self, outputs: Vec<Output>) -> Self {
        outputs.into_iter().for_each(|output| output.put(&mut self.outputs));
        self
    }

    /// The scene as it stands.
    ///
    /// # Errors
    /// As [`parse_scene`](super::parse_scene).
    pub fn scene(&self) -> Result<Scene, SceneError> {
        self.parsed(&self.overrides)
    }

    fn parsed(&self, overrides: &[Override]) -> Result<Scene, SceneError> {
        let mut scene = parse_beside(&self.text, &self.source, overrides, &self.tables)?;
        self.outputs.iter().cloned().for_each(|output| output.put(&mut scene.outputs));
        Ok(scene)
    }

    /// The scene with these values of these variables.
    ///
    /// # Errors
    /// As [`parse_scene`](super::parse_scene): a value out of its range, or one that does not go with the
    /// rest of the scene.
    pub fn filled(&self, variables: &[Variable], values: &[f64]) -> Result<Scene, SceneError> {
        let filled = variables
            .iter()
            .zip(values)
            .map(|(variable, &value)| Override { path: variable.path.clone(), value: value.into() });
        let overrides: Vec<Override> = self.overrides.iter().cloned().chain(filled).collect();
        self.parsed(&overrides)
    }

    /// The same with these values of these variables.
    #[must_use]
    pub fn with_values(&self, variables: &[Variable], values: &[f64]) -> Self {
        let filled = variables
            .iter()
            .zip(values)
            .map(|(variable, &value)| Override { path: variable.path.clone(), value: value.into() });
        let mut template = self.clone();
        template.overrides.extend(filled);
        template
    }

    /// Its text, the name of its file, and its overrides.
    pub(super) fn parts(&self) -> (&str, &str, &[Override]) {
        (&self.text, &self.source, &self.overrides)
    }

    /// Where the part of this name in one of these lists is written, as `scene.json:3:7: walls[0]`; `None`
    /// where there is none.
    pub fn place_of(&self, lists: &[&str], name: &str) -> Option<String> {
        let (source, tree) = put_together(&self.text, &self.source, &self.overrides).ok()?;
        lists.iter().find_map(|list| {
            let Value::List(nodes) = &member(&tree, list)?.value else { return None };
            let index = nodes.iter().position(|node| self::name(node) == Some(name))?;
            Some(format!("{}: {list}[{index}]", source.place_in_file(nodes[index].span)))
        })
    }

    /// The number called `name`: a path, or the short form of one.
    ///
    /// # Errors
    /// There is no such number in the scene; the error names the nearest.
    pub fn variable(&self, name: &str) -> Result<Variable, SceneError> {
        let (_, tree) = put_together(&self.text, &self.source, &self.overrides)?;
        let refused = |problem: String, allowed: &str, hint: String| {
            SceneError::whole_file(
                &self.source,
                &format!("has no number {name} to vary: {problem}"),
                allowed,
                &hint,
            )
        };
        let allowed = "must be a path to a number, as start.bar1.phi or springs.spring.stiffness";
        let path = whole(name, &tree).map_err(|error| {
            let (problem, hint) = error.in_words();
            refused(problem.unwrap_or_else(|| "nothing has that name".into()), allowed, hint)
        })?;
        let unit = FormatWalk { tree: &tree }
            .unit(&path)
            .map_err(|(problem, hint)| refused(problem, allowed, hint))?;
        let start = self.start_of(&path)?;
        Ok(Variable { path, unit, start })
    }

    /// The unit of the number at a path, in the SI; of a parameter or signal that of the number it is written
    /// as: `m` of `"60 cm"`.  Empty for a pure number.
    ///
    /// # Errors
    /// As [`variable`](Self::variable).
    pub fn unit(&self, path: &str) -> Result<String, SceneError> {
        let variable = self.variable(path)?;
        if !variable.unit.is_empty() {
            return Ok(variable.unit.to_owned());
        }
        let (_, tree) = put_together(&self.text, &self.source, &self.overrides)?;
        let formula = match tree.at(&variable.path).map(|node| &node.value) {
            Some(Value::Text(text)) => Formula::parse(text).ok(),
            _ => None,
        };
        let own = formula.as_ref().and_then(Formula::number_alone).and_then(|(_, unit)| unit);
        Ok(own.map_or_else(String::new, |unit| match unit.is(Dimension::NONE) {
            true => "rad".to_owned(),
            false => unit.unit(),
        }))
    }

    /// The value of a number as it is written in the scene, or given by an override, with or without a unit;
    /// `None` where it is left to its default, or follows from other numbers.
    ///
    /// # Errors
    /// As [`parse_scene`](super::parse_scene) where the text is no JSON or an override does not fit it.
    pub fn value(&self, variable: &Variable) -> Result<Option<f64>, SceneError> {
        let (_, tree) = put_together(&self.text, &self.source, &self.overrides)?;
        Ok(tree.at(&variable.path).and_then(|node| match &node.value {
            Value::Number(value) => Some(*value),
            Value::Text(text) => {
                let formula = Formula::parse(text).ok()?;
                formula.names().next().is_none().then(|| formula.value(&[]))
            }
            _ => None,
        }))
    }

    /// The bar and the number of its start that a path means, where nothing else has a say in it.
    fn start_of(&self, path: &str) -> Result<Option<(usize, StartValue)>, SceneError> {
        let scene = self.scene()?;
        let mut parts = path.split('.');
        let (Some("start"), Some(bar), Some(value), None) =
            (parts.next(), parts.next(), parts.next(), parts.next())
        else {
            return Ok(None);
        };
        let value = match value {
            "phi" => StartValue::Phi,
            "omega" => StartValue::Omega,
            _ => return Ok(None),
        };
        let alone = scene.motors.is_empty()
            && scene.locks.is_empty()
            && scene.springs.is_empty()
            && scene.walls.is_empty()
            && scene.laws.is_empty();
        let alone = alone && scene.has_whole_start();
        Ok(scene.bars.iter().position(|known| known.name == bar).filter(|_| alone).map(|bar| (bar, value)))
    }
}

/// Why a short name cannot be written out.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ShortNameError {
    /// Nothing has that name; a hint.
    Unknown(String),
    /// Several parts have it; a hint.
    Several(String),
    /// The part has no such key, and neither has what its short names may leave out.
    NoKey {
        /// What has no such key.
        problem: String,
        /// What the keys are.
        keys: String,
        /// The nearest of them, or all.
        hint: String,
    },
}

impl ShortNameError {
    /// What is wrong, where more than the hint is known, and the hint.
    fn in_words(self) -> (Option<String>, String) {
        match self {
            Self::Unknown(hint) | Self::Several(hint) => (None, hint),
            Self::NoKey { problem, hint, .. } => (Some(problem), hint),
        }
    }
}

/// The table that the short names of the elements of a list may leave out, with what it is called.
fn left_out(list: &str, table: &KeyTable) -> Option<(&'static str, &'static KeyTable)> {
    match list {
        "bars" => Some(("its start", &START)),
        "motors" if table.field("slider").is_some() => Some(("its law", &TRAVEL_LAW)),
        "motors" => Some(("its law", &LAW)),
        _ => None,
    }
}

/// Refuses a short name whose key neither the part nor what may be left out has.
fn judged(list: &str, node: &Located, key: &str) -> Result<(), ShortNameError> {
    let Some(FieldShape::List { of, .. }) = SCENE.field(list).map(|field| &field.shape) else {
        return Ok(());
    };
    let Some(table) = kind(of, |key| member(node, key).is_some()) else { return Ok(()) };
    let Some((what, inner)) = left_out(list, table) else { return Ok(()) };
    if inner.field(key).is_some() || of.iter().any(|table| table.field(key).is_some()) {
        return Ok(());
    }
    let known: Vec<&str> = table.fields.iter().chain(inner.fields).map(|field| field.name).collect();
    Err(ShortNameError::NoKey {
        problem: format!("{} has no `{key}`", table.title),
        keys: format!("{} has the keys {}, and {what} {}", table.title, table.keys(), inner.keys()),
        hint: match nearest(key, known.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("there are: {}", listed(&known)),
        },
    })
}

/// A short name written out; else what is wrong with it.
pub(super) fn whole(short: &str, tree: &Located) -> Result<String, ShortNameError> {
    let first = short.split(['.', '[']).next().unwrap_or("");
    if SCENE.field(first).is_some() {
        return Ok(short.to_owned());
    }
    let rest = short[first.len()..].trim_start_matches('.');
    if rest.is_empty() && member(tree, "parameters").and_then(|all| member(all, first)).is_some() {
        return Ok(format!("parameters.{first}"));
    }
    if rest.is_empty() {
        return Err(ShortNameError::Unknown("go on with a key, as in bar1.phi".to_owned()));
    }
    let (mut found, mut nodes_found) = (Vec::new(), Vec::new());
    let mut known = Vec::new();
    for list in LISTS {
        let Some(Value::List(nodes)) = member(tree, list).map(|node| &node.value) else { continue };
        known.extend(nodes.iter().filter_map(name));
        if let Some(node) = nodes.iter().find(|node| name(node) == Some(first)) {
            nodes_found.push((list, node));
            found.push(match list {
                "bars" if START.field(rest.split('[').next().unwrap_or("")).is_some() => {
                    format!("start.{first}.{rest}")
                }
                "motors" if LAW.field(rest).is_some() => format!("motors.{first}.law.{rest}"),
                _ => format!("{list}.{first}.{rest}"),
            });
        }
    }
    match &found[..] {
        [only] => {
            let key = rest.split(['.', '[']).next().unwrap_or("");
            nodes_found.iter().try_for_each(|(list, node)| judged(list, node, key))?;
            Ok(only.clone())
        }
        [] => {
            known.extend(SCENE.fields.iter().map(|field| field.name));
            Err(ShortNameError::Unknown(hint(first, &known)))
        }
        several => Err(ShortNameError::Several(format!(
            "several things are called {first}; write {}",
            several.join(" or ")
        ))),
    }
}

/// True where a whole path leads to a number of the format.
pub(super) fn is_number(path: &str, tree: &Located) -> bool {
    FormatWalk { tree }.unit(path).is_ok()
}

fn member<'a>(node: &'a Located, key: &str) -> Option<&'a Located> {
    let Value::Object(members) = &node.value else { return None };
    members.iter().find(|member| member.key == key).map(|member| &member.node)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn template(name: &str) -> Template {
        Template::read(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a shipped scene")
    }

    #[test]
    fn paths_and_short_names_are_found_with_their_units() {
        for (scene, name, path, unit) in [
            ("free", "start.bar1.phi", "start.bar1.phi", "rad"),
            ("free", "bar2.omega", "start.bar2.omega", "rad/s"),
            ("free", "bar2.length", "bars.bar2.length", "m"),
            ("free", "bars[1].density", "bars[1].density", "kg/m³"),
            ("free", "gravity[1]", "gravity[1]", "m/s²"),
            ("free", "until", "until", "s"),
            ("free", "B.between[0].point[0]", "hinges.B.between[0].point[0]", "m"),
            ("spring", "spring.damping", "springs.spring.damping", "N·s/m"),
            (
                "motor_sine",
                "motors.motor.law.sines[0].frequency",
                "motors.motor.law.sines[0].frequency",
                "rad/s",
            ),
            ("motor", "motor.rate", "motors.motor.law.rate", "rad/s"),
            ("wall", "walls.wall.restitution", "walls.wall.restitution", ""),
        ] {
            let variable = template(scene).variable(name).expect(name);
            assert_eq!((variable.path.as_str(), variable.unit), (path, unit));
        }
    }

    #[test]
    fn what_is_not_there_is_told_with_what_is_near() {
        for (scene, name, near) in [
            ("free", "strat.bar1.phi", "start"),
            ("free", "start.bar3.phi", "bar"),
            ("free", "start.bar1.phy", "`phi`"),
            ("free", "start.bar1", "phi, omega"),
            ("free", "bra1.phi", "`bar1`"),
            ("free", "bar1.phii", "did you mean `phi`?"),
            ("free", "bar1.foo", "inertia, phi, omega, origin, velocity"),
            ("motor", "motor.rat", "did you mean `rate`?"),
            ("motor", "motor.foo", "law, start, rate, acceleration, sines"),
            ("free", "bars.bar1.desity", "`density`"),
            ("free", "bars[2].length", "there are 2"),
            ("free", "gravity", "gravity[0]"),
            ("free", "name", "is not a single number"),
            ("free", "springs.spring.stiffness", "add it"),
            ("motor", "start.bar1.phi", "start"),
            ("free", "a..b", ""),
        ] {
            let error = template(scene).variable(name).expect_err(name);
            assert!(error.to_string().contains(near) && error.to_string().contains(name), "{error}");
        }
    }

    #[test]
    fn values_filled_in_are_those_of_an_override() {
        let template = template("free");
        let variables = [
            template.variable("bar1.phi").expect("there"),
            template.variable("bar2.density").expect("there"),
        ];
        let scene = template.filled(&variables, &[0.1, 700.0]).expect("a scene");
        assert_eq!(scene.start[0].phi, 0.1);
        assert_eq!(scene.bars[1].mass, 700.0 * 0.6 * 0.05 * 0.003);
        assert_eq!(variables[0].start, Some((0, StartValue::Phi)));
        assert_eq!(variables[1].start, None);
        let error = template.filled(&variables, &[0.1, -700.0]).expect_err("a negative density");
        assert!(error.to_string().contains("--set bars.bar2.density=-700"), "{error}");
    }
}
