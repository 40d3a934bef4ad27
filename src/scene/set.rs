//! Values set from outside: `--set walls.wall.restitution=0.5`.

use super::error::SceneError;
use super::locate::{Located, Member, Span, Text, Texts, Value, push_index, push_key};
use super::number;
use super::read::nearest;
use super::template::{ShortNameError, is_number, whole};
use std::fmt;
use std::str::FromStr;

/// One value of a scene set from outside, as `PATH=VALUE`.
///
/// A path is made of keys (`until`), indices (`gravity[0]`, `bars[1].length`) and, in a list, names
/// (`bars.bar2.length`, `motors.motor.law.rate`), or the short form of one (`bar1.phi`, `motor.rate`).  What
/// holds the value must exist already, but for the start of a bar and the law of a force; a key may be new
/// (`springs.spring.damping`).  Numbers may be written as [`number`] takes them.
///
/// ```
/// let set: driftless::scene::Override = "walls.wall.restitution=0.5".parse().expect("a path and a value");
/// assert_eq!(set.path, "walls.wall.restitution");
/// assert_eq!(set.value, 0.5);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// Where: keys, names and indices.
    pub path: String,
    /// What.
    pub value: serde_json::Value,
}

/// Why a text is no [`Override`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{given}` is not PATH=VALUE, as in walls.wall.restitution=0.5 or gravity[0]=1.62")]
pub struct OverrideError {
    /// The text.
    pub given: String,
}

impl fmt::Display for Override {
    /// As it is read: text that would be read as JSON stands in quotes.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.value {
            serde_json::Value::String(text) if serde_json::from_str::<serde_json::Value>(text).is_err() => {
                write!(f, "{}={text}", self.path)
            }
            value => write!(f, "{}={value}", self.path),
        }
    }
}

impl FromStr for Override {
    type Err = OverrideError;

    /// The value is read as JSON, or else taken as text; text such as `pi/2` counts as a number where a
    /// number is meant.
    fn from_str(given: &str) -> Result<Self, OverrideError> {
        let fail = || OverrideError { given: given.to_owned() };
        let (path, value) = given.split_once('=').ok_or_else(fail)?;
        let path = path.trim().to_owned();
        steps(&path).ok_or_else(fail)?;
        let value =
            serde_json::from_str(value).unwrap_or_else(|_| serde_json::Value::String(value.to_owned()));
        Ok(Self { path, value })
    }
}

impl Override {
    /// The value as a number, where it is one.
    pub fn number(&self) -> Option<f64> {
        self.value.as_f64().or_else(|| self.value.as_str().and_then(number))
    }

    /// This option as a text of its own.
    pub(super) fn text(&self) -> Text {
        let json = self.value.to_string();
        Text { set: Some(format!("--set {}={json}", self.path)), json }
    }
}

/// One step of a path.
pub(super) enum PathStep<'a> {
    Key(&'a str),
    Index(usize),
}

impl Located {
    /// What stands at a whole path in it.
    pub(super) fn at(&self, path: &str) -> Option<&Located> {
        steps(path)?.iter().try_fold(self, |node, step| match (step, &node.value) {
            (PathStep::Key(key), Value::Object(members)) => {
                members.iter().find(|member| member.key == *key).map(|member| &member.node)
            }
            (PathStep::Key(key), Value::List(nodes)) => nodes.iter().find(|node| name(node) == Some(key)),
            (PathStep::Index(index), Value::List(nodes)) => nodes.get(*index),
            _ => None,
        })
    }
}

/// `bars[1].length` to its steps; `None` where it is no path.
pub(super) fn steps(path: &str) -> Option<Vec<PathStep<'_>>> {
    let mut steps = Vec::new();
    for part in path.split('.') {
        let (key, indices) = part.split_once('[').map_or((part, ""), |(key, _)| (key, &part[key.len()..]));
        if key.is_empty() {
            return None;
        }
        steps.push(PathStep::Key(key));
        let mut rest = indices;
        while !rest.is_empty() {
            let (index, after) = rest.strip_prefix('[')?.split_once(']')?;
            if !index.bytes().all(|digit| digit.is_ascii_digit()) {
                return None;
            }
            steps.push(PathStep::Index(index.parse().ok()?));
            rest = after;
        }
    }
    Some(steps)
}

/// Puts `value` into `tree` at the path of `set`, written out or short.
pub(super) fn put(
    source: &Texts,
    tree: &mut Located,
    set: &Override,
    value: Located,
) -> Result<(), SceneError> {
    let path = match whole(&set.path, tree) {
        Ok(path) => path,
        Err(ShortNameError::Several(hint)) => {
            let allowed = "must mean one value of the scene";
            return Err(source.refusal(value.span, &set.path, "is ambiguous", allowed, &hint));
        }
        Err(ShortNameError::NoKey { keys, hint, .. }) => {
            return Err(source.refusal(value.span, &set.path, "is not a known key", &keys, &hint));
        }
        // A part and its key; whole paths have more.
        Err(ShortNameError::Unknown(hint)) if set.path.matches('.').count() == 1 => {
            let allowed = "must begin with a key of the scene or the name of a part";
            return Err(source.refusal(value.span, &set.path, "does not exist", allowed, &hint));
        }
        // The walk along the path says what is wrong with it.
        Err(ShortNameError::Unknown(_)) => set.path.clone(),
    };
    let typed = if let Value::Text(text) = &value.value { number(text) } else { None };
    let span = value.span;
    place(source, tree, &path, value)?;
    match typed.filter(|_| is_number(&path, tree)) {
        Some(number) => place(source, tree, &path, Located { span, value: Value::Number(number) }),
        None => Ok(()),
    }
}

/// Puts `value` into `tree` at a whole path.
fn place(source: &Texts, tree: &mut Located, path: &str, value: Located) -> Result<(), SceneError> {
    let span = value.span;
    let Some(steps) = steps(path) else {
        let (allowed, hint) = (
            "must be keys, names and [indices] joined by dots",
            "for example walls.wall.restitution, bars[1].length, gravity[0]",
        );
        return Err(source.refusal(span, path, "is not a path", allowed, hint));
    };
    let mut walk = Walk { source, span, bars: names(tree), path: String::new() };
    let mut at = tree;
    for (number, step) in steps.iter().enumerate() {
        at = match (step, &mut at.value) {
            (PathStep::Key(key), Value::Object(members)) => {
                walk.member(members, key, &steps[..=number], number + 1 == steps.len())?
            }
            (PathStep::Key(key), Value::List(nodes)) => walk.named_element(nodes, key)?,
            (PathStep::Index(index), Value::List(nodes)) => walk.element(nodes, *index)?,
            (PathStep::Index(_), _) => {
                let hint = "use a key, as in start.bar1.phi";
                return Err(walk.refused("is not a list", "only lists have indices", hint));
            }
            (PathStep::Key(key), _) => {
                let allowed = format!("it has no `{key}` to set");
                return Err(walk.refused("is a single value", &allowed, "set the value itself"));
            }
        };
    }
    *at = value;
    Ok(())
}

/// A path followed through a tree.
struct Walk<'a> {
    source: &'a Texts,
    /// Where the value stands that is put in.
    span: Span,
    /// Names of the bars.
    bars: Vec<String>,
    /// The path so far.
    path: String,
}

impl Walk<'_> {
    /// A refusal at the path so far.
    fn refused(&self, problem: &str, allowed: &str, hint: &str) -> SceneError {
        self.source.refusal(self.span, &self.path, problem, allowed, hint)
    }

    /// The value of a key, which is the last of `steps`; a new one where the path ends with it, or where the
    /// scene may do without what it holds.
    fn member<'t>(
        &mut self,
        members: &'t mut Vec<Member>,
        key: &str,
        steps: &[PathStep],
        is_last: bool,
    ) -> Result<&'t mut Located, SceneError> {
        push_key(&mut self.path, key);
        let found = members.iter().position(|member| member.key == key);
        if found.is_none() && !is_last && !may_be_added(steps, &self.bars) {
            let known: Vec<&str> = match steps {
                [PathStep::Key("start"), _] => self.bars.iter().map(String::as_str).collect(),
                _ => members.iter().map(|member| member.key.as_str()).collect(),
            };
            let (allowed, hint) = ("what holds the value must be in the scene", hint(key, &known));
            return Err(self.refused("does not exist", allowed, &hint));
        }
        let index = found.unwrap_or_else(|| {
            let node = Located { span: self.span, value: Value::Object(Vec::new()) };
            members.push(Member { key: key.to_owned(), span: self.span, node });
            members.len() - 1
        });
        Ok(&mut members[index].node)
    }

    /// The element of a name.
    fn named_element<'t>(
        &mut self,
        nodes: &'t mut [Located],
        key: &str,
    ) -> Result<&'t mut Located, SceneError> {
        let Some(index) = nodes.iter().position(|node| name(node) == Some(key)) else {
            let allowed = format!("{} must have an element of that name", self.path);
            push_key(&mut self.path, key);
            let known: Vec<&str> = nodes.iter().filter_map(name).collect();
            let hint = match known.is_empty() {
                true => "use an index, as in gravity[0]".to_owned(),
                false => hint(key, &known),
            };
            return Err(self.refused("does not exist", &allowed, &hint));
        };
        push_index(&mut self.path, index);
        Ok(&mut nodes[index])
    }

    /// The element of an index.
    fn element<'t>(&mut self, nodes: &'t mut [Located], index: usize) -> Result<&'t mut Located, SceneError> {
        let allowed = format!("{} has {} elements", self.path, nodes.len());
        push_index(&mut self.path, index);
        let missing =
            || self.refused("does not exist", &allowed, "indices count from 0; an element cannot be added");
        nodes.get_mut(index).ok_or_else(missing)
    }
}

/// Objects that a scene may do without and that a path may begin: the start, that of a bar, the law of a
/// force or torque.
fn may_be_added(steps: &[PathStep], bars: &[String]) -> bool {
    match steps {
        [PathStep::Key("start")] => true,
        [PathStep::Key("start"), PathStep::Key(bar)] => bars.iter().any(|known| known == bar),
        [PathStep::Key("forces" | "torques"), _, PathStep::Key("law")] => true,
        _ => false,
    }
}

/// The names of the bars.
fn names(tree: &Located) -> Vec<String> {
    let Value::Object(members) = &tree.value else { return Vec::new() };
    match members.iter().find(|member| member.key == "bars").map(|member| &member.node.value) {
        Some(Value::List(nodes)) => nodes.iter().filter_map(name).map(str::to_owned).collect(),
        _ => Vec::new(),
    }
}

pub(super) fn name(node: &Located) -> Option<&str> {
    let Value::Object(members) = &node.value else { return None };
    members.iter().find(|member| member.key == "name").and_then(|member| match &member.node.value {
        Value::Text(name) => Some(name.as_str()),
        _ => None,
    })
}

pub(super) fn hint(wanted: &str, known: &[&str]) -> String {
    match nearest(wanted, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if known.is_empty() => "the scene has none".to_owned(),
        None => format!("there are: {}", super::read::listed(known)),
    }
}
