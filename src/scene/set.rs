//! Values set from outside: `--set walls.wall.restitution=0.5`.

use super::error::SceneError;
use super::locate::{Located, Member, Text, Texts, Value, push_index, push_key};
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
    let refused = |path: &str, problem: &str, allowed: &str, hint: &str| {
        source.refusal(span, path, problem, allowed, hint)
    };
    let Some(steps) = steps(path) else {
        let hint = "for example walls.wall.restitution, bars[1].length, gravity[0]";
        return Err(refused(path, "is not a path", "must be keys, names and [indices] joined by dots", hint));
    };
    let bars = names(tree);
    let mut at = tree;
    let mut path = String::new();
    let last = steps.len() - 1;
    for (number, step) in steps.iter().enumerate() {
        let holder = path.clone();
        match (step, &mut at.value) {
            (PathStep::Key(key), Value::Object(members)) => {
                push_key(&mut path, key);
                let found = members.iter().position(|member| member.key == *key);
                match found {
                    Some(index) => at = &mut members[index].node,
                    None if number == last => {
                        members.push(Member { key: (*key).to_owned(), span, node: value });
                        return Ok(());
                    }
                    None if may_be_added(&steps[..=number], &bars) => {
                        members.push(Member {
                            key: (*key).to_owned(),
                            span,
                            node: Located { span, value: Value::Object(Vec::new()) },
                        });
                        let Some(added) = members.last_mut() else { return Ok(()) };
                        at = &mut added.node;
                    }
                    None => {
                        let known: Vec<&str> = match steps[..number] {
                            [PathStep::Key("start")] => bars.iter().map(String::as_str).collect(),
                            _ => members.iter().map(|member| member.key.as_str()).collect(),
                        };
                        let hint = hint(key, &known);
                        return Err(refused(
                            &path,
                            "does not exist",
                            "what holds the value must be in the scene",
                            &hint,
                        ));
                    }
                }
            }
            (PathStep::Key(key), Value::List(nodes)) => {
                let known: Vec<&str> = nodes.iter().filter_map(name).collect();
                let Some(index) = nodes.iter().position(|node| name(node) == Some(key)) else {
                    push_key(&mut path, key);
                    let hint = if known.is_empty() {
                        "use an index, as in gravity[0]".to_owned()
                    } else {
                        hint(key, &known)
                    };
                    return Err(refused(
                        &path,
                        "does not exist",
                        &format!("{holder} must have an element of that name"),
                        &hint,
                    ));
                };
                push_index(&mut path, index);
                at = &mut nodes[index];
            }
            (PathStep::Index(index), Value::List(nodes)) => {
                push_index(&mut path, *index);
                let count = nodes.len();
                let Some(node) = nodes.get_mut(*index) else {
                    let hint = "indices count from 0; an element cannot be added";
                    return Err(refused(
                        &path,
                        "does not exist",
                        &format!("{holder} has {count} elements"),
                        hint,
                    ));
                };
                at = node;
            }
            (PathStep::Index(_), _) => {
                return Err(refused(
                    &path,
                    "is not a list",
                    "only lists have indices",
                    "use a key, as in start.bar1.phi",
                ));
            }
            (PathStep::Key(key), _) => {
                let allowed = format!("it has no `{key}` to set");
                return Err(refused(&path, "is a single value", &allowed, "set the value itself"));
            }
        }
    }
    *at = value;
    Ok(())
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
