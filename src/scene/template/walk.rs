//! Paths of numbers, followed through the format's tables and a scene's tree side by side.

use super::member;
use crate::scene::format::{Field, FieldShape, KeyTable, SCENE, UNIFORM_BAR, kind};
use crate::scene::locate::{Located, Value, push_index, push_key};
use crate::scene::read::{listed, nearest};
use crate::scene::set::{PathStep, hint, name, steps};

/// Follows a path through the format's tables and the scene's tree side by side.
pub(in crate::scene) struct FormatWalk<'a> {
    pub tree: &'a Located,
}

impl FormatWalk<'_> {
    /// The unit of the number at the end of a path; else what is wrong and a hint.
    pub fn unit(&self, path: &str) -> Result<&'static str, (String, String)> {
        let steps = steps(path).ok_or_else(|| {
            ("it is not a path".to_owned(), "keys, names and [indices] joined by dots".to_owned())
        })?;
        let mut steps = steps.into_iter().peekable();
        let (mut table, mut node, mut walked): (&'static KeyTable, Option<&Located>, String) =
            (&SCENE, Some(self.tree), String::new());
        loop {
            let Some(PathStep::Key(key)) = steps.next() else { return Err(no_number(&walked, table)) };
            let Some(field) = table.field(key) else {
                let keys: Vec<&str> = table.fields.iter().map(|field| field.name).collect();
                return Err((format!("{} has no `{key}`", table.title), hint(key, &keys)));
            };
            push_key(&mut walked, key);
            node = node.and_then(|node| member(node, key));
            // What holds a number must be in the scene, as for an override; the number itself may be left to
            // its default.
            if node.is_none() && steps.peek().is_some() {
                return Err((
                    format!("{walked} is not in the scene"),
                    "a part of the start that is found or that a motor gives cannot be varied; else add it \
                        to the file"
                        .into(),
                ));
            }
            match (&field.shape, steps.peek()) {
                (
                    FieldShape::Number(quantity)
                    | FieldShape::LawNumber(quantity)
                    | FieldShape::Inertia(quantity),
                    None,
                ) => {
                    return Ok(quantity.unit);
                }
                (FieldShape::Parameters | FieldShape::Signals, Some(PathStep::Key(name))) => {
                    element_by_key(node, name, &mut walked)?;
                    steps.next();
                    return if steps.next().is_none() { Ok("") } else { Err(no_number(&walked, table)) };
                }
                (FieldShape::Tables, Some(PathStep::Key(name))) => {
                    let points = element_by_key(node, name, &mut walked)?;
                    steps.next();
                    return coordinate(points, &mut steps, &mut walked);
                }
                (
                    FieldShape::Pair(quantity) | FieldShape::LawPair(quantity),
                    Some(PathStep::Index(0 | 1)),
                ) => {
                    steps.next();
                    return if steps.next().is_none() {
                        Ok(quantity.unit)
                    } else {
                        Err(no_number(&walked, table))
                    };
                }
                (FieldShape::Object(inner) | FieldShape::Law(inner, _), Some(_)) => table = inner,
                (FieldShape::ByBar(inner), Some(PathStep::Key(bar))) => {
                    node = element_by_key(node, bar, &mut walked)?;
                    steps.next();
                    table = inner;
                }
                (FieldShape::List { of, .. }, Some(step)) => {
                    node = element(node, step, &mut walked)?;
                    steps.next();
                    table =
                        kind(of, |key| node.is_some_and(|node| member(node, key).is_some())).unwrap_or(table);
                }
                (FieldShape::Between, Some(step)) => {
                    node = element(node, step, &mut walked)?;
                    steps.next();
                    table = &crate::scene::format::PLACE;
                }
                _ => return Err(example(&walked, field)),
            }
        }
    }
}

/// A coordinate of a point of a table that is written out.
fn coordinate<'a>(
    points: Option<&Located>,
    steps: &mut impl Iterator<Item = PathStep<'a>>,
    walked: &mut String,
) -> Result<&'static str, (String, String)> {
    let path: Vec<PathStep> = steps.collect();
    let is_list = |node: &Located| matches!(node.value, Value::List(_));
    if let ([point @ PathStep::Index(_), PathStep::Index(0 | 1)], true) =
        (&path[..], points.is_some_and(is_list))
    {
        element(points, point, walked)?;
        return Ok("");
    }
    let hint = format!("a coordinate of a point written in the scene, as {walked}[0][1]");
    Err((format!("{walked} is a table, not a number"), hint))
}

fn no_number(walked: &str, table: &KeyTable) -> (String, String) {
    (format!("{walked} is {}, not a number", table.title), format!("go on with one of {}", table.keys()))
}

/// What is wrong with a path that ends too early or too late at a field.
fn example(walked: &str, field: &Field) -> (String, String) {
    let hint = match &field.shape {
        FieldShape::Pair(_) | FieldShape::LawPair(_) => format!("{walked}[0] or {walked}[1]"),
        FieldShape::Object(table) | FieldShape::Law(table, _) | FieldShape::ByBar(table) => {
            format!("go on, in the end with one of {}", table.keys())
        }
        FieldShape::List { of, .. } => {
            format!("go on with the name of one, then one of {}", of.first().unwrap_or(&&UNIFORM_BAR).keys())
        }
        _ => "`driftless schema` describes the numbers of a scene".to_owned(),
    };
    (format!("{walked} is not a single number"), hint)
}

/// An element of a list by name or index.
fn element<'a>(
    node: Option<&'a Located>,
    step: &PathStep,
    walked: &mut String,
) -> Result<Option<&'a Located>, (String, String)> {
    let Some(Value::List(nodes)) = node.map(|node| &node.value) else { return Ok(None) };
    let names: Vec<&str> = nodes.iter().filter_map(name).collect();
    let found = match step {
        PathStep::Index(index) => nodes.get(*index),
        PathStep::Key(key) => nodes.iter().find(|node| name(node) == Some(key)),
    };
    if found.is_none() {
        let (what, hint) = match step {
            PathStep::Index(index) => {
                (format!("[{index}]"), format!("indices count from 0; there are {}", nodes.len()))
            }
            PathStep::Key(key) => (format!(" `{key}`"), hint(key, &names)),
        };
        return Err((format!("{walked} has no{what}"), hint));
    }
    match step {
        PathStep::Index(index) => push_index(walked, *index),
        PathStep::Key(key) => push_key(walked, key),
    }
    Ok(found)
}

/// The start of a bar.
fn element_by_key<'a>(
    node: Option<&'a Located>,
    bar: &str,
    walked: &mut String,
) -> Result<Option<&'a Located>, (String, String)> {
    let Some(Value::Object(members)) = node.map(|node| &node.value) else { return Ok(None) };
    let Some(found) = members.iter().find(|member| member.key == bar) else {
        let known: Vec<&str> = members.iter().map(|member| member.key.as_str()).collect();
        let hint = match nearest(bar, known.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => {
                format!("there are: {}; a bar that a motor drives starts as its law says", listed(&known))
            }
        };
        return Err((format!("{walked} has no `{bar}`"), hint));
    };
    push_key(walked, bar);
    Ok(Some(&found.node))
}
