//! The numbers of a scene exactly as written: 0.6 is 3/5, not the double nearest to it.
//!
//! A scene that was read and judged in doubles is gone through once more, number by number, by the digits of
//! its text: decimals, multiples and fractions of pi on a command line, formulas of parameters.  Formulas of
//! time and state are kept as texts and read as exactly when the mechanism is compiled.  Points of tables are
//! numbers of the text too; of those in files the shortest digits count that read as the same double.
//! Numbers may also be given beside the text, with derivatives that no text holds.

mod laws;
mod parts;

use super::error::SceneError;
use super::formula::Formula;
use super::locate::{Located, Span, Texts, Value, push_index, push_key};
use super::number::Decimal;
pub use super::number::exact_number;
use super::read::put_together;
use super::template::Template;
use super::{PointTable, Scene, SceneEvent, Wall};
use std::cell::RefCell;

/// The times of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Times<C> {
    /// Horizon \[s\].
    pub until: C,
    /// Output interval \[s\].
    pub every: C,
}

impl Template {
    /// The scene with its numbers as written.  `typed` are the texts `PATH=VALUE` of the overrides as they
    /// were typed; where one is missing, the shortest digits of its value count.
    ///
    /// # Errors
    /// As [`Template::scene`]; a number whose digits do not tell all of it, or a part that is not known
    /// exactly.
    pub fn exact<C: Decimal>(&self, typed: &[String]) -> Result<(Scene<C>, Times<C>), SceneError> {
        self.exact_with(typed, &[], Watcher::Here)
    }

    /// The same where the numbers at some paths are these.
    ///
    /// # Errors
    /// As [`Template::exact`]; a number is not taken up by any part.
    pub fn exact_with<C: Decimal>(
        &self,
        typed: &[String],
        known: &[(&str, C)],
        watched: Watcher,
    ) -> Result<(Scene<C>, Times<C>), SceneError> {
        let plain = self.scene()?;
        let (text, source, overrides) = self.parts();
        let (source, tree) = put_together(text, source, overrides)?;
        let places = known.iter().filter_map(|(path, value)| Some((tree.at(path)?.span, *value)));
        let mut reader = Reader {
            source: &source,
            plain: &plain,
            root: TreeCursor { node: &tree, path: String::new() },
            typed,
            known: places.collect(),
            is_read: RefCell::new(vec![false; known.len()]),
            watched,
            parameters: Vec::new(),
            tables: Vec::new(),
        };
        reader.refuse_parts(&plain)?;
        reader.parameters = reader.known_parameters(&plain)?;
        reader.tables = reader.tables(&plain);
        let times = Times {
            until: reader.number(&reader.root, "until", plain.until)?,
            every: reader.number(&reader.root, "every", plain.every)?,
        };
        let scene = reader.scene(&plain)?;
        match reader.is_read.borrow().iter().position(|is_read| !is_read) {
            None => Ok((scene, times)),
            Some(number) => Err(reader.refuse(&reader.root, "is not read at a path", known[number].0)),
        }
    }
}

/// Who watches for the events of a scene, for the corners of its formulas and for walls that move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watcher {
    /// Whoever runs the scene: they are part of it.
    Here,
    /// Another run, which this one goes beside: events are left out, what changes the equations is refused.
    Beside,
}

/// The shortest decimal of a double: what was written, where that has no more digits than a double holds.
fn shortest<C: Decimal>(value: f64) -> C {
    if value == std::f64::consts::PI {
        return C::pi();
    }
    C::parse(&format!("{value:?}")).unwrap_or_else(|| C::of(value))
}

/// A value of the tree with its path.
#[derive(Clone)]
struct TreeCursor<'a> {
    node: &'a Located,
    path: String,
}

impl<'a> TreeCursor<'a> {
    fn child(&self, key: &str) -> Option<TreeCursor<'a>> {
        let Value::Object(members) = &self.node.value else { return None };
        let member = members.iter().find(|member| member.key == key)?;
        let mut path = self.path.clone();
        push_key(&mut path, key);
        Some(TreeCursor { node: &member.node, path })
    }

    fn items(&self, key: &str) -> Vec<TreeCursor<'a>> {
        let Some(list) = self.child(key) else { return Vec::new() };
        let Value::List(nodes) = &list.node.value else { return Vec::new() };
        let item = |(number, node): (usize, &'a Located)| {
            let mut path = list.path.clone();
            match super::set::name(node) {
                Some(name) => push_key(&mut path, name),
                None => push_index(&mut path, number),
            }
            TreeCursor { node, path }
        };
        nodes.iter().enumerate().map(item).collect()
    }
}

struct Reader<'a, C> {
    source: &'a Texts,
    /// The scene in doubles.
    plain: &'a Scene,
    root: TreeCursor<'a>,
    typed: &'a [String],
    /// Numbers that stand for those at some places of the text, and which of them were read.
    known: Vec<(Span, C)>,
    is_read: RefCell<Vec<bool>>,
    watched: Watcher,
    parameters: Vec<(String, C)>,
    tables: Vec<PointTable<C>>,
}

impl<'a, C: Decimal> Reader<'a, C> {
    fn refuse(&self, at: &TreeCursor, problem: &str, hint: &str) -> SceneError {
        let allowed = "must be known exactly for runs in many digits: decimals, and formulas of parameters";
        self.source.refusal(at.node.span, &at.path, problem, allowed, hint)
    }

    /// An error about a part that has no series in many digits.
    fn refuse_part(&self, at: &TreeCursor, why: &str) -> SceneError {
        let problem = format!("cannot be carried in many digits: {why}");
        let allowed = "parts are carried whose numbers are constant, or formulas of time and state";
        let hint = "without --digits it runs in doubles, and --trust estimates the error";
        self.source.refusal(at.node.span, &at.path, &problem, allowed, hint)
    }

    /// Parts that are not carried in many digits.
    fn refuse_parts(&self, scene: &Scene) -> Result<(), SceneError> {
        let is_watched = self.watched == Watcher::Here;
        let parts = [
            ("events", scene.events.iter().any(SceneEvent::changes), "events change what acts"),
            ("inactive", !scene.inactive.is_empty(), "events change what acts"),
        ];
        for (key, is_there, why) in parts {
            if is_there
                && !is_watched
                && let Some(at) = self.root.child(key)
            {
                return Err(self.refuse_part(&at, why));
            }
        }
        if !scene.frictions.is_empty() && !is_watched {
            let mut items = ["hinges", "sliders", "walls"].iter().flat_map(|list| self.root.items(list));
            let at = items.find_map(|at| at.child("friction")).unwrap_or_else(|| self.root.clone());
            return Err(self.refuse_part(&at, "dry friction has corners"));
        }
        let is_refused = |wall: &Wall| {
            let moves = wall.moves() || wall.on.is_some();
            (moves || wall.aim.is_some()) && !is_watched
        };
        if let Some(wall) = scene.walls.iter().position(is_refused) {
            let at = self.root.items("walls").into_iter().nth(wall).unwrap_or_else(|| self.root.clone());
            return Err(self.refuse_part(&at, "the wall moves"));
        }
        if let Some(coupling) = scene.couplings.first().filter(|_| !is_watched) {
            let mut items = self.root.items("motors").into_iter();
            let at = items.find(|at| super::set::name(at.node) == Some(&coupling.name));
            let at = at.unwrap_or_else(|| self.root.clone());
            return Err(self.refuse_part(&at, "its aim is a formula of the state"));
        }
        if let Some(spring) = scene.springs.iter().find(|spring| spring.rigid) {
            let items = self.root.items("springs");
            let at = items.iter().find(|at| super::set::name(at.node) == Some(&spring.name));
            return Err(self
                .refuse_part(at.unwrap_or(&self.root), "a rigid spring has the mean force of a vibration"));
        }
        self.refuse_corners()
    }

    fn known_parameters(&self, scene: &Scene) -> Result<Vec<(String, C)>, SceneError> {
        let Some(holder) = self.root.child("parameters") else { return Ok(Vec::new()) };
        let mut known = Vec::new();
        // In the order in which they depend on each other: of what is known, one more each time.
        let mut open: Vec<&str> = scene.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        while !open.is_empty() {
            let before = open.len();
            let mut failed = None;
            open.retain(|name| {
                let Some(at) = holder.child(name) else { return false };
                match self.evaluated(&at, &known) {
                    Ok(Some(value)) => known.push(((*name).to_owned(), value)),
                    Ok(None) => return true,
                    Err(error) => failed = Some(error),
                }
                false
            });
            if let Some(error) = failed {
                return Err(error);
            }
            if open.len() == before {
                return Err(self.refuse(&holder, "are not known exactly", "give them as decimals"));
            }
        }
        Ok(known)
    }

    /// The number at a place; `None` where a formula has a name that is not among those known.
    fn evaluated(&self, at: &TreeCursor, known: &[(String, C)]) -> Result<Option<C>, SceneError> {
        match &at.node.value {
            Value::Number(value) => Ok(Some(self.literal(at.node, *value))),
            Value::Text(text) => {
                let formula = Formula::parse(text).map_err(|error| {
                    self.refuse(at, &format!("has no exact value: {}", error.problem), "give the number")
                })?;
                let value = |name: &str| known.iter().find(|one| one.0 == name).map(|one| one.1);
                let Some(values) = formula.names().map(value).collect::<Option<Vec<C>>>() else {
                    return Ok(None);
                };
                Ok(Some(formula.exact_value(&values)))
            }
            _ => Err(self.refuse(at, "is no number", "give the number")),
        }
    }

    /// What a number was written as.
    fn literal(&self, node: &Located, value: f64) -> C {
        if let Some(number) = self.known_at(node) {
            return number;
        }
        let (text, digits, is_all) = self.source.text(node.span);
        let typed = text.checked_sub(1).and_then(|index| self.typed.get(index));
        let typed = typed.and_then(|typed| typed.split_once('=')).filter(|_| is_all);
        let exact = typed.map_or_else(|| C::parse(digits), |(_, value)| exact_number(value));
        exact.unwrap_or_else(|| shortest(value))
    }

    /// What is known to stand for the number at a place; of several numbers, all derivatives count.
    fn known_at(&self, node: &Located) -> Option<C> {
        let here = self.known.iter().enumerate().filter(|(_, (span, _))| *span == node.span);
        let numbers = here.map(|(number, (_, value))| {
            self.is_read.borrow_mut()[number] = true;
            *value
        });
        numbers.reduce(|sum, number| sum + number.moved_to(0.0))
    }

    fn number(&self, at: &TreeCursor, key: &str, absent: f64) -> Result<C, SceneError> {
        let Some(at) = at.child(key) else { return Ok(shortest(absent)) };
        match self.evaluated(&at, &self.parameters)? {
            Some(value) => Ok(value),
            None => Err(self.refuse(&at, "has a name whose value is not known exactly", "give the number")),
        }
    }

    fn pair(&self, at: &TreeCursor, key: &str, absent: [f64; 2]) -> Result<[C; 2], SceneError> {
        let Some(list) = at.child(key) else { return Ok(absent.map(shortest)) };
        let Value::List(nodes) = &list.node.value else { return Ok(absent.map(shortest)) };
        let mut pair = [C::ZERO; 2];
        for (number, (place, node)) in pair.iter_mut().zip(nodes).enumerate() {
            let mut path = list.path.clone();
            push_index(&mut path, number);
            let at = TreeCursor { node, path };
            let value = self.evaluated(&at, &self.parameters)?;
            *place = value.ok_or_else(|| {
                self.refuse(&at, "has a name whose value is not known exactly", "give the number")
            })?;
        }
        Ok(pair)
    }

    /// The same along a pair, of length one.
    fn direction(&self, at: &TreeCursor, key: &str, absent: [f64; 2]) -> Result<[C; 2], SceneError> {
        let [x, y] = self.pair(at, key, absent)?;
        let length = (x * x + y * y).sqrt();
        Ok([x / length, y / length])
    }
}
