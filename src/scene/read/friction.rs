//! Dry friction, said where it acts: in a hinge, a slider or a wall.

use super::at::{At, Fields};
use crate::scene::error::SceneError;
use crate::scene::format::{HINGE_FRICTION, KeyTable, SLIDER_FRICTION, WALL_FRICTION};
use crate::scene::{Friction, FrictionPlace};

/// The friction of all hinges, sliders and walls at these places.
pub(super) fn all(hinges: &[At], sliders: &[At], walls: &[At]) -> Result<Vec<Friction>, SceneError> {
    let mut found = Vec::new();
    add(&mut found, hinges, &HINGE_FRICTION, |fields, hinge| {
        Ok(FrictionPlace::Hinge { hinge, radius: fields.number("radius")? })
    })?;
    add(&mut found, sliders, &SLIDER_FRICTION, |_, slider| Ok(FrictionPlace::Slider(slider)))?;
    add(&mut found, walls, &WALL_FRICTION, |fields, wall| {
        Ok(FrictionPlace::Wall { wall, is_newton: fields.word_or_first("impact")? == 1 })
    })?;
    Ok(found)
}

fn add(
    found: &mut Vec<Friction>,
    places: &[At],
    table: &'static KeyTable,
    place: impl Fn(&Fields, usize) -> Result<FrictionPlace, SceneError>,
) -> Result<(), SceneError> {
    for (number, at) in places.iter().enumerate() {
        let Some(at) = at.child("friction") else { continue };
        let fields = at.object(table)?;
        let kinetic = fields.number("kinetic")?;
        let stiction = fields.number_if_any("static")?.unwrap_or(kinetic);
        if stiction < kinetic {
            return Err(fields.required("static")?.refuse_value(
                &format!("must be at least the kinetic coefficient, {kinetic}"),
                "leave it out where both are the same",
            ));
        }
        found.push(Friction { at: place(&fields, number)?, kinetic, stiction });
    }
    Ok(())
}
