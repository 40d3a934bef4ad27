//! What a file says of the start.

use super::at::{At, Fields};
use super::names::BarNames;
use crate::scene::error::SceneError;
use crate::scene::format::{FieldShape, START};
use crate::scene::locate::Value;

/// The start of one bar as given.
pub(in crate::scene) struct GivenStart<'a> {
    /// The entry.
    pub fields: Fields<'a>,
    /// Angle \[rad\].
    pub phi: Option<f64>,
    /// Rate \[rad/s\].
    pub omega: Option<f64>,
    /// Position of the origin \[m\].
    pub origin: Option<[f64; 2]>,
    /// Velocity of the origin \[m/s\].
    pub velocity: Option<[f64; 2]>,
}

/// The starts that the file gives, one for each bar.
pub(super) fn starts<'a>(
    scene: &Fields<'a>,
    known: &BarNames,
) -> Result<Vec<Option<GivenStart<'a>>>, SceneError> {
    let mut given: Vec<Option<GivenStart>> = known.bars.iter().map(|_| None).collect();
    let Some(at) = scene.optional("start") else { return Ok(given) };
    let Value::Object(members) = &at.node.value else {
        return Err(at.refuse_value(
            &FieldShape::ByBar(&START).allowed(),
            "for example \"start\": {\"bar1\": {\"phi\": 0, \"omega\": 0}}",
        ));
    };
    for member in members {
        let at: At = at.member(member);
        let Some(bar) = known.number(&member.key) else {
            return Err(at.refuse_key(
                member.span,
                "names no bar",
                "must be the name of a bar",
                &known.hint(&member.key),
            ));
        };
        let fields = at.object(&START)?;
        given[bar] = Some(GivenStart {
            phi: fields.number_if_any("phi")?,
            omega: fields.number_if_any("omega")?,
            origin: fields.pair_if_any("origin")?,
            velocity: fields.pair_if_any("velocity")?,
            fields,
        });
    }
    Ok(given)
}
