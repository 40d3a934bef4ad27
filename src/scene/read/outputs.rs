//! Outputs: formulas by name, or a list of formulas.

use super::at::{At, Fields};
use super::judge::refused;
use crate::scene::error::SceneError;
use crate::scene::format::FieldShape;
use crate::scene::locate::{Located, Value};
use crate::scene::{Output, OutputNames, Scene};

const HINT: &str = "for example {\"bearing\": \"A.force\"} or [\"A.force\", \"tip.x\"]";
/// Outputs at most.
const MOST: usize = 1000;
/// The longest name \[bytes\].
const LONGEST: usize = 64;

fn formula(at: &At, node: &Located) -> Result<String, SceneError> {
    match &node.value {
        Value::Text(text) => Ok(text.clone()),
        _ => Err(at.refuse_value("must be a formula in quotes", HINT)),
    }
}

/// The outputs of a scene.
pub(super) fn outputs(fields: &Fields) -> Result<Vec<Output>, SceneError> {
    let Some(at) = fields.optional("outputs") else { return Ok(Vec::new()) };
    let mut outputs: Vec<Output> = Vec::new();
    let mut add = |at: &At, output: Output| {
        let is_plain = |byte: u8| byte.is_ascii_graphic() && byte != b',' && byte != b'"';
        if output.name.is_empty() || output.name.len() > LONGEST && output.name != output.formula {
            return Err(at.refuse("has no name of 1 to 64 characters", "must have one", HINT));
        }
        if !output.name.bytes().all(is_plain) && output.name != output.formula {
            return Err(at.refuse(
                "has a name that no column can have",
                "must be letters a to z or A to Z, digits, -, _, .",
                HINT,
            ));
        }
        if outputs.iter().any(|known| known.name == output.name) {
            return Err(at.refuse("is there twice", "names of outputs must be different", "rename one"));
        }
        outputs.push(output);
        Ok(())
    };
    let count = match &at.node.value {
        Value::Object(members) => members.len(),
        Value::List(nodes) => nodes.len(),
        _ => 0,
    };
    if count > MOST {
        let allowed = format!("must be at most {MOST}");
        return Err(at.refuse(&format!("has {count} entries"), &allowed, "merge some"));
    }
    match &at.node.value {
        Value::Object(members) => {
            for member in members {
                let at = at.member(member);
                let formula = formula(&at, &member.node)?;
                add(&at, Output { name: member.key.clone(), formula })?;
            }
        }
        Value::List(nodes) => {
            for (number, node) in nodes.iter().enumerate() {
                let at = at.item(node, number);
                let formula = formula(&at, node)?;
                add(&at, Output { name: formula.clone(), formula })?;
            }
        }
        _ => return Err(at.refuse_value(&FieldShape::Outputs.allowed(), HINT)),
    }
    Ok(outputs)
}

/// Judges every output where it stands: its names, its dimensions.
pub(super) fn check<'a>(root: &At<'a>, scene: &Scene) -> Result<(), SceneError> {
    if scene.outputs.is_empty() {
        return Ok(());
    }
    let names = OutputNames::of(scene);
    for (number, output) in scene.outputs.iter().enumerate() {
        names.bind(output).map_err(|error| {
            let all = root.child("outputs");
            let at = all.and_then(|all| match &all.node.value {
                Value::List(nodes) => nodes.get(number).map(|node| all.item(node, number)),
                _ => all.child(&output.name),
            });
            let at = at.unwrap_or_else(|| root.clone());
            refused(
                at.source,
                at.node.span,
                &at.path,
                "must be a formula of coordinates, forces and other values of parts, by a name of its own",
                &error,
            )
        })?;
    }
    Ok(())
}
