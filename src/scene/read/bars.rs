//! Bars, by their shape or by their mass distribution.

use super::at::{Fields, nearest};
use crate::scene::Bar;
use crate::scene::error::SceneError;
use crate::scene::format::{FieldShape, INERTIA, MASS, OUTRIGHT_BAR};
use crate::scene::locate::Value;

/// A bar.
pub(super) fn bar(fields: &Fields, name: String) -> Result<Bar, SceneError> {
    if std::ptr::eq(fields.table, &OUTRIGHT_BAR) {
        outright_bar(fields, name)
    } else {
        uniform_bar(fields, name)
    }
}

fn uniform_bar(fields: &Fields, name: String) -> Result<Bar, SceneError> {
    let length = fields.number("length")?;
    let width = fields.number("width")?;
    let mass = fields.number("density")? * length * width * fields.number("thickness")?;
    fields.at.comes_to("a mass", mass, &MASS)?;
    let full = mass * (length * length + width * width) / 12.0;
    let inertia = match fields.optional("inertia") {
        None => full,
        Some(at) => match &at.node.value {
            Value::Text(word) if word == "full" => full,
            Value::Text(word) if word == "slender" => mass * (length * length) / 12.0,
            Value::Number(number) if INERTIA.holds(*number) => *number,
            Value::Text(word) => {
                let hint = match nearest(word, ["full", "slender"]) {
                    Some(near) => format!("did you mean \"{near}\"?"),
                    None => "\"full\" is m(l² + w²)/12, \"slender\" is m l²/12".to_owned(),
                };
                return Err(at.refuse_value(&FieldShape::Inertia(INERTIA).allowed(), &hint));
            }
            _ => {
                return Err(at.refuse_value(
                    &FieldShape::Inertia(INERTIA).allowed(),
                    "\"full\" is m(l² + w²)/12, \"slender\" is m l²/12",
                ));
            }
        },
    };
    fields.at.comes_to("an inertia", inertia, &INERTIA)?;
    Ok(Bar { name, length, mass, centre: [length / 2.0, 0.0], inertia })
}

fn outright_bar(fields: &Fields, name: String) -> Result<Bar, SceneError> {
    let mass = fields.number("mass")?;
    let centre = fields.pair("centre")?;
    let at = fields.required("inertia")?;
    if matches!(&at.node.value, Value::Text(word) if word == "full" || word == "slender") {
        let hint = "\"full\" and \"slender\" are for bars by width, thickness and density; of a slender bar \
            of mass m and length l it is m l²/12";
        return Err(at.refuse_value("must be a number for a bar by its mass", hint));
    }
    let inertia = fields.number("inertia")?;
    let reach = 2.0 * libm::hypot(centre[0], centre[1]);
    let sensible = if reach > 0.0 { reach } else { 2.0 * (inertia / mass).sqrt() };
    let length = fields.number_or("length", sensible.min(1e30))?;
    Ok(Bar { name, length, mass, centre, inertia })
}
