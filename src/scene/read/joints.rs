//! What joins bodies: hinges, sliders, welds and locks; and the walls that stop them.

use super::at::Fields;
use super::loads::law_of_wall;
use super::names::BarNames;
use super::resolve::FormulaConstants;
use crate::scene::error::SceneError;
use crate::scene::format::{LINE, RAIL};
use crate::scene::{Hinge, Lock, Place, Rail, Slider, Wall, Weld};

/// A hinge.
pub(super) fn hinge(fields: &Fields, name: String, known: &BarNames) -> Result<Hinge, SceneError> {
    Ok(Hinge { name, between: known.between(fields, "hinge")? })
}

/// A slider.
pub(super) fn slider(fields: &Fields, name: String, known: &BarNames) -> Result<Slider, SceneError> {
    let point = known.place(&fields.required("point")?)?;
    let rail_at = fields.required("rail")?;
    let rail = rail_at.object(&RAIL)?;
    let place = Place { bar: known.body(&rail.required("body")?)?, point: rail.pair("point")? };
    let direction = rail.direction("direction", "[1, 0] for a rail along x, [0, 1] for one along y")?;
    known.on_two_bodies(&fields.at, point.bar, place.bar, "slider")?;
    Ok(Slider { name, point, rail: Rail { place, direction }, locked: fields.word_or_first("angle")? == 1 })
}

/// A weld.
pub(super) fn weld(fields: &Fields, name: String, known: &BarNames) -> Result<Weld, SceneError> {
    Ok(Weld { name, between: known.between(fields, "weld")? })
}

/// A lock.
pub(super) fn lock(fields: &Fields, name: String, known: &BarNames) -> Result<Lock, SceneError> {
    let bar = known.bar(fields, "a lock holds the angle of a bar; the ground does not turn")?;
    let relative_to = known.relative_to(fields, bar, "leave it out to lock the angle from +x")?;
    Ok(Lock { name, bar, relative_to, angle: fields.number_if_any("angle")? })
}

/// A wall.
pub(super) fn wall(
    fields: &Fields,
    name: String,
    known: &BarNames,
    constants: &FormulaConstants,
) -> Result<Wall, SceneError> {
    let bar = known.bar(fields, "a wall stops a point of a bar")?;
    let point = fields.pair("point")?;
    let line = fields.required("line")?.object(&LINE)?;
    let on = line.optional("body").map_or(Ok(None), |at| match known.body(&at)? {
        Some(carrier) if carrier == bar => Err(at.refuse_value(
            "must be another bar than `body` of the wall",
            "a bar cannot meet its own line; leave it out for a line of the ground",
        )),
        carrier => Ok(carrier),
    })?;
    let through = line.pair("through")?;
    let normal =
        line.direction("normal", "[1, 0] for a wall the point must stay right of, [0, 1] for a floor")?;
    let (restitution, (law, aim)) = (fields.number("restitution")?, law_of_wall(fields, constants)?);
    Ok(Wall { name, bar, point, on, through, normal, law, aim, restitution })
}
