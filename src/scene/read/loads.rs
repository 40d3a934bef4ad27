//! What acts on bodies: springs, torsion springs, forces, torques and motors, with their laws.

use super::at::{At, Fields, listed, nearest};
use super::names::BarNames;
use super::resolve::FormulaConstants;
use crate::scene::error::SceneError;
use crate::scene::format::{DRIVE, Field, FieldShape};
use crate::scene::locate::Value;
use crate::scene::{
    Coupled, Coupling, Drive, Force, Law, Motor, Sine, Slider, Spring, Torque, TorsionSpring,
};

/// A spring.
pub(super) fn spring(fields: &Fields, name: String, known: &BarNames) -> Result<Spring, SceneError> {
    let (stiffness, free_length, damping) =
        (fields.number("stiffness")?, fields.number("free_length")?, fields.number_or("damping", 0.0)?);
    let rigid = fields.word_or_first("model")? == 1;
    let elastic = "leave `model` out, or write \"elastic\"";
    if rigid && (stiffness == 0.0 || free_length == 0.0) {
        let at = fields.required(if stiffness == 0.0 { "stiffness" } else { "free_length" })?;
        return Err(at.refuse(
            "is 0",
            "must be above 0 for a spring of model \"rigid\", a rod of its free length",
            elastic,
        ));
    }
    if rigid && damping != 0.0 {
        let at = fields.required("damping")?;
        return Err(at.refuse(
            "is not 0",
            "must be 0 for a spring of model \"rigid\": a damped vibration decays, and its mean force with \
                it",
            elastic,
        ));
    }
    Ok(Spring { name, between: known.between(fields, "spring")?, stiffness, free_length, damping, rigid })
}

/// A torsion spring.
pub(super) fn torsion_spring(
    fields: &Fields,
    name: String,
    known: &BarNames,
) -> Result<TorsionSpring, SceneError> {
    let (bar, relative_to) = coil_bodies(fields, known)?;
    Ok(TorsionSpring {
        name,
        bar,
        relative_to,
        stiffness: fields.number("stiffness")?,
        free_angle: fields.number("free_angle")?,
        damping: fields.number_or("damping", 0.0)?,
    })
}

/// The bar that a torsion spring turns, and the one its angle is measured from.
pub(super) fn coil_bodies(fields: &Fields, known: &BarNames) -> Result<(usize, Option<usize>), SceneError> {
    let hint = "a torsion spring turns a bar; name the ground, if anything, in `relative_to`";
    let bar = known.bar(fields, hint)?;
    Ok((bar, known.relative_to(fields, bar, "leave it out for an angle from +x")?))
}

/// The bar that a torque acts on, and the one that takes its opposite.
pub(super) fn torque_bodies(fields: &Fields, known: &BarNames) -> Result<(usize, Option<usize>), SceneError> {
    let hint = "a torque on the ground moves nothing; name the ground, if anything, in `relative_to`";
    let bar = known.bar(fields, hint)?;
    Ok((bar, known.relative_to(fields, bar, "leave it out where the ground takes the opposite torque")?))
}

/// A force.
pub(super) fn force(fields: &Fields, name: String, known: &BarNames) -> Result<Force, SceneError> {
    Ok(Force {
        name,
        bar: known.bar(fields, "a force on the ground moves nothing")?,
        point: fields.pair("point")?,
        force: fields.pair("force")?,
        follows: fields.word_or_first("frame")? == 1,
        law: fields.optional("law").map(|_| law(fields)).transpose()?,
    })
}

/// A torque.
pub(super) fn torque(fields: &Fields, name: String, known: &BarNames) -> Result<Torque, SceneError> {
    let (bar, relative_to) = torque_bodies(fields, known)?;
    Ok(Torque {
        name,
        bar,
        relative_to,
        torque: fields.number("torque")?,
        law: fields.optional("law").map(|_| law(fields)).transpose()?,
    })
}

/// One of the list of motors.
pub(super) enum AnyMotor<'a> {
    Angle(Motor, At<'a>),
    Travel(Drive),
    Coupled(Coupling),
}

/// A motor, or a motor on a slider.
pub(super) fn motor<'a>(
    fields: &Fields<'a>,
    name: String,
    known: &BarNames,
    sliders: &[Slider],
    constants: &FormulaConstants,
) -> Result<AnyMotor<'a>, SceneError> {
    if let Value::Text(text) = &fields.required("law")?.node.value
        && constants.is_of_place(text)
    {
        let coupled = match std::ptr::eq(fields.table, &DRIVE) {
            true => Coupled::Travel(slider(&fields.required("slider")?, sliders)?),
            false => {
                let bar = known.bar(fields, "a motor turns a bar")?;
                let relative_to = known.relative_to(fields, bar, "leave it out for an angle from +x")?;
                Coupled::Angle { bar, relative_to }
            }
        };
        return Ok(AnyMotor::Coupled(Coupling { name, coupled, aim: text.clone() }));
    }
    if std::ptr::eq(fields.table, &DRIVE) {
        return Ok(AnyMotor::Travel(Drive {
            name,
            slider: slider(&fields.required("slider")?, sliders)?,
            law: motor_law(fields, constants)?,
        }));
    }
    let bar =
        known.bar(fields, "a motor turns a bar; to hold a bar still give its law a start and no rate")?;
    let relative_to = known.relative_to(fields, bar, "leave it out for an angle from +x")?;
    Ok(AnyMotor::Angle(
        Motor { name, bar, relative_to, law: motor_law(fields, constants)? },
        fields.at.clone(),
    ))
}

/// The slider named at `at`.
fn slider(at: &At, sliders: &[Slider]) -> Result<usize, SceneError> {
    let wanted = if let Value::Text(name) = &at.node.value { name } else { "" };
    sliders.iter().position(|slider| slider.name == wanted).ok_or_else(|| {
        let names: Vec<&str> = sliders.iter().map(|slider| slider.name.as_str()).collect();
        let hint = match nearest(wanted, names.iter().copied()) {
            Some(near) => format!("did you mean \"{near}\"? known sliders: {}", listed(&names)),
            None if names.is_empty() => {
                "the scene has no sliders; a motor on an angle has a `body`".to_owned()
            }
            None => format!("known sliders: {}", listed(&names)),
        };
        at.refuse_value(&FieldShape::SliderName.allowed(), &hint)
    })
}

/// The law of a wall, if it has one: of time, or of where the mechanism is.
pub(super) fn law_of_wall(
    fields: &Fields,
    constants: &FormulaConstants,
) -> Result<(Option<Law>, Option<String>), SceneError> {
    let Some(at) = fields.optional("law") else { return Ok((None, None)) };
    match &at.node.value {
        Value::Text(text) if constants.is_of_place(text) => Ok((None, Some(text.clone()))),
        _ => Ok((Some(motor_law(fields, constants)?), None)),
    }
}

/// The law of a motor or wall: a sum, or a formula that is none.
fn motor_law(fields: &Fields, constants: &FormulaConstants) -> Result<Law, SceneError> {
    let at = fields.required("law")?;
    let Value::Text(text) = &at.node.value else { return law(fields) };
    let profile = constants.profile(text);
    if profile.as_ref().is_some_and(|profile| profile.at(0.0).iter().all(|value| value.is_finite())) {
        return Ok(Law { profile, ..Law::default() });
    }
    let allowed = "must have a finite value, rate and acceleration at t = 0";
    Err(at.refuse_value(allowed, "the start of the motion follows from them"))
}

/// The field `law`, in the units that its table says.
fn law(fields: &Fields) -> Result<Law, SceneError> {
    let Some(Field { shape: FieldShape::Law(table, _), .. }) = fields.table.field("law") else {
        return Err(fields.at.refuse("has no law", "must be of a kind that has one", fields.table.about));
    };
    let law = fields.required("law")?.object(table)?;
    let mut sines = Vec::new();
    if let (Some(list), Some(Field { shape: FieldShape::List { of: [sine], .. }, .. })) =
        (law.optional("sines"), table.field("sines"))
    {
        for at in list.items("sines", table)? {
            let sine = at.object(sine)?;
            sines.push(Sine {
                amplitude: sine.number("amplitude")?,
                frequency: sine.number("frequency")?,
                phase: sine.number_or("phase", 0.0)?,
            });
        }
    }
    Ok(Law {
        start: law.number("start")?,
        rate: law.number_or("rate", 0.0)?,
        acceleration: law.number_or("acceleration", 0.0)?,
        sines,
        profile: None,
    })
}
