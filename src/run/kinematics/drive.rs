//! What moves a mechanism: one of its motors, or a coordinate that gets one.

use crate::arithmetic::Complex;
use crate::arithmetic::shown::about;
use crate::dynamics::compile::CompileError;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::scene::{self, Law, Motor, Scene};
use std::f64::consts::TAU;
use std::str::FromStr;
use std::sync::Arc;

/// Farthest that an angle is driven from its start \[rad\]: some millions of positions, in about a minute.
const FARTHEST: f64 = 1e6;

/// What is driven, and how far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KinematicDrive {
    /// A motor, a body or a slider; the first motor where it is left out.
    pub name: Option<String>,
    /// From where to where \[rad or m\]; one turn from the start where it is left out.
    pub range: Option<[f64; 2]>,
    /// Rate \[rad/s or m/s\]; that of the motor at the start, or 1, where it is left out.
    pub rate: Option<f64>,
}

impl FromStr for KinematicDrive {
    type Err = String;

    /// Reads `NAME` or `NAME=FROM..TO`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, range) = match text.split_once('=') {
            None => (text, None),
            Some((name, range)) => {
                let both = scene::range(range);
                (name, Some(both.ok_or("must be NAME or NAME=FROM..TO with FROM below TO, as crank=0..2pi")?))
            }
        };
        let name = name.trim().trim_end_matches(".phi").trim_end_matches(".travel");
        if name.is_empty() {
            return Err("must be NAME or NAME=FROM..TO, as crank=0..2pi".to_owned());
        }
        Ok(Self { name: Some(name.to_owned()), range, rate: None })
    }
}

/// Why a scene has no kinematics.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KinematicsError {
    /// Nothing of this name can be driven.
    #[error("`{name}` is no motor, body or slider\nhint: there are {known}")]
    Unknown {
        /// As given.
        name: String,
        /// What there is.
        known: String,
    },
    /// The scene has no motor, and nothing is named.
    #[error("the scene has no motor\nhint: name what is driven, as --drive {0}=0..2pi")]
    NoDrive(String),
    /// A slider goes no turns.
    #[error("`{0}` goes along a rail\nhint: say from where to where [m], as --drive {0}=0..0.1")]
    NoRange(String),
    /// So many turns are walked in no reasonable time.
    #[error(
        "`{name}` would go from {start} to {value:e} rad\nhint: at most {FARTHEST:e} rad from the start, as \
            {name}=0..2pi"
    )]
    Far {
        /// The drive.
        name: String,
        /// An end of its range \[rad\].
        value: f64,
        /// Its value at the start \[rad\].
        start: f64,
    },
    /// More moves than the drive gives.
    #[error(
        "`{name}` leaves {left} degree(s) of freedom, and kinematics none\nhint: `driftless run` integrates \
            what the drive does not give; or add motors or locks"
    )]
    Free {
        /// The drive.
        name: String,
        /// What is left.
        left: usize,
    },
    /// The start does not fit.
    #[error("constraint `{row}` is off by {} at the start of the range", about(*left))]
    Start {
        /// The row.
        row: String,
        /// By how much.
        left: f64,
    },
    /// The scene with its drive does not compile.
    #[error("with {}: {error}", driving(motor, name))]
    Compile {
        /// The drive.
        name: String,
        /// The motor that moves it.
        motor: String,
        /// Why.
        error: Box<CompileError>,
    },
}

fn driving(motor: &str, name: &str) -> String {
    if motor == name { format!("`{name}` as the drive") } else { format!("motor `{motor}` driving `{name}`") }
}

/// A scene with its drive.
pub(super) struct DrivenScene {
    pub scene: Scene,
    pub mechanism: Arc<Mechanism>,
    /// The drive's value at the start.
    pub start: f64,
    /// Its row.
    pub row: usize,
    /// Name of the motor; of one that is made, what was named.
    pub name: String,
    /// What moves: the motor, or the body or slider that was named.
    pub label: String,
    pub unit: &'static str,
    pub rate: f64,
    pub range: [f64; 2],
    pub is_turn: bool,
}

/// What of a scene has no part in its kinematics.
pub(in crate::run) fn left_out(scene: &Scene) -> Vec<&'static str> {
    [
        (!scene.walls.is_empty(), "walls"),
        (!scene.frictions.is_empty(), "dry friction"),
        (!scene.events.is_empty(), "events"),
    ]
    .into_iter()
    .filter_map(|(has, name)| has.then_some(name))
    .collect()
}

/// Where the drive's law stands in the scene.
#[derive(Clone, Copy)]
enum Slot {
    /// Among the motors.
    Turning(usize),
    /// Among those on sliders.
    Sliding(usize),
}

impl DrivenScene {
    /// The scene with the law of its drive at a constant rate.
    pub fn new(given: &Scene, drive: &KinematicDrive) -> Result<Self, KinematicsError> {
        if let Some(fault) = given.fault() {
            let name = drive.name.clone().unwrap_or_default();
            let error = Box::new(CompileError::Unsound(fault));
            return Err(KinematicsError::Compile { motor: name.clone(), name, error });
        }
        let mut scene = given.clone();
        let (slot, start, own_rate) = find(&mut scene, drive)?;
        // A motor that stands at the start has no rate of its own.
        let own_rate = if own_rate != 0.0 && own_rate.is_finite() { own_rate } else { 1.0 };
        let rate = drive.rate.unwrap_or(own_rate);
        let law = Law { start, rate, ..Law::default() };
        let (name, unit) = match slot {
            Slot::Turning(k) => {
                scene.motors[k].law = law;
                (scene.motors[k].name.clone(), "rad")
            }
            Slot::Sliding(k) => {
                scene.drives[k].law = law;
                (scene.drives[k].name.clone(), "m")
            }
        };
        let label = drive.name.clone().unwrap_or_else(|| name.clone());
        let is_turn = drive.range.is_none();
        let range = match drive.range {
            Some(range) => range,
            None if unit == "m" => return Err(KinematicsError::NoRange(label)),
            None => [start, start + TAU],
        };
        if let Some(&value) = range.iter().find(|value| unit == "rad" && (*value - start).abs() > FARTHEST) {
            return Err(KinematicsError::Far { name: label, value, start });
        }
        // A motor made for the drive has no name of its own.
        let mut known =
            given.motors.iter().map(|motor| &motor.name).chain(given.drives.iter().map(|slide| &slide.name));
        let motor = if known.any(|known| *known == name) { name.clone() } else { label.clone() };
        let mechanism = Arc::new(compile(&scene, [&label, &motor])?);
        let left = mechanism.assembly.degrees_of_freedom;
        if left > 0 {
            return Err(KinematicsError::Free { name: label, left });
        }
        let row = match slot {
            // Rows of motors that give angles come first.
            Slot::Turning(k) => k,
            // The slider's own row may bear the name, too, but has no law.
            Slot::Sliding(_) => (mechanism.constraints.iter())
                .position(|row| row.name() == name && row.law.is_some() && !row.is_angle())
                .unwrap_or_default(),
        };
        Ok(Self { scene, mechanism, start, row, label, name: motor, unit, rate, range, is_turn })
    }
}

fn compile(scene: &Scene, [name, motor]: [&str; 2]) -> Result<Mechanism, KinematicsError> {
    Mechanism::of_sound(scene, Vec::new()).map_err(|error| KinematicsError::Compile {
        name: name.to_owned(),
        motor: motor.to_owned(),
        error: Box::new(error),
    })
}

/// Takes out the first motor, whose place a driven coordinate takes, and gives its name; else `name`.
fn freed(scene: &mut Scene, name: String) -> String {
    if !scene.motors.is_empty() {
        return scene.motors.remove(0).name;
    }
    if scene.drives.is_empty() { name } else { scene.drives.remove(0).name }
}

/// A name for a motor on a slider, whose own name is that of its rail's constraint.
fn unused(scene: &Scene, slider: String) -> String {
    let is_free = |name: &String| {
        let mut names = (scene.sliders.iter().map(|part| &part.name))
            .chain(scene.locks.iter().map(|part| &part.name))
            .chain(scene.springs.iter().map(|part| &part.name))
            .chain(scene.couplings.iter().map(|part| &part.name));
        names.all(|other| other != name)
    };
    (1..).map(|k| format!("drive{k}")).find(is_free).unwrap_or(slider)
}

/// The start as the scene's own motors have it, all of whose angles the scene then gives, and no rates.
fn settled(scene: &mut Scene, name: &str) -> Result<(Motion, Mechanism), KinematicsError> {
    let mechanism = compile(scene, [name, name])?;
    let motion = mechanism.start(scene);
    let own = scene.own_bars();
    for (bar, start) in scene.start.iter_mut().enumerate().take(own) {
        start.phi = motion.unwrapped(bar);
    }
    for given in scene.given.iter_mut().take(own) {
        (given.phi, given.omega, given.velocity) = (true, false, None);
    }
    Ok((motion, mechanism))
}

/// The place of the drive's law, its value at the start and its rate there; a coordinate gets a motor.
fn find(scene: &mut Scene, drive: &KinematicDrive) -> Result<(Slot, f64, f64), KinematicsError> {
    let name = match (&drive.name, scene.motors.first(), scene.drives.first()) {
        (Some(name), ..) => name.clone(),
        (None, Some(motor), _) => motor.name.clone(),
        (None, None, Some(slide)) => slide.name.clone(),
        (None, None, None) => {
            let body = scene.bars.first().map_or("crank", |bar| bar.name.as_str());
            return Err(KinematicsError::NoDrive(body.to_owned()));
        }
    };
    let of_law = |law: &Law| (law.angle(Time::default()).hi, law.rates::<f64>(Time::default()).0);
    if let Some(k) = scene.motors.iter().position(|motor| motor.name == name) {
        let (start, rate) = of_law(&scene.motors[k].law);
        return Ok((Slot::Turning(k), start, rate));
    }
    if let Some(k) = scene.drives.iter().position(|slide| slide.name == name) {
        let (start, rate) = of_law(&scene.drives[k].law);
        return Ok((Slot::Sliding(k), start, rate));
    }
    let own = scene.own_bars();
    if let Some(bar) = scene.bars[..own].iter().position(|bar| bar.name == name) {
        let start = settled(scene, &name)?.0.unwrapped(bar);
        let is_it = |motor: &Motor| motor.bar == bar && motor.relative_to.is_none();
        let k = scene.motors.iter().position(is_it).unwrap_or_else(|| {
            let law = Law { rate: 1.0, ..Law::default() };
            let motor = Motor { name: freed(scene, name), bar, relative_to: None, law };
            scene.motors.insert(0, motor);
            0
        });
        return Ok((Slot::Turning(k), start, of_law(&scene.motors[k].law).1));
    }
    if let Some(slider) = scene.sliders.iter().position(|slider| slider.name == name) {
        let (motion, mechanism) = settled(scene, &name)?;
        let start = travel(scene, &mechanism, &motion, slider);
        let k = scene.drives.iter().position(|slide| slide.slider == slider).unwrap_or_else(|| {
            let law = Law { rate: 1.0, ..Law::default() };
            let made = unused(scene, name);
            let slide = scene::Drive { name: freed(scene, made), slider, law };
            scene.drives.insert(0, slide);
            0
        });
        return Ok((Slot::Sliding(k), start, of_law(&scene.drives[k].law).1));
    }
    let known: Vec<&str> = (scene.motors.iter().map(|motor| motor.name.as_str()))
        .chain(scene.drives.iter().map(|slide| slide.name.as_str()))
        .chain(scene.bars[..own].iter().map(|bar| bar.name.as_str()))
        .chain(scene.sliders.iter().map(|slider| slider.name.as_str()))
        .collect();
    Err(KinematicsError::Unknown { name, known: known.join(", ") })
}

/// The travel of a slider at the start \[m\].
fn travel(scene: &Scene, mechanism: &Mechanism, start: &Motion, slider: usize) -> f64 {
    let [phi, _] = start.rounded();
    let (z, translations) = mechanism.pose(&phi);
    let slider = &scene.sliders[slider];
    let [point, foot] =
        [slider.point, slider.rail.place].map(|place| mechanism.place(&place, &z, &translations));
    let along = Complex::new(slider.rail.direction[0], slider.rail.direction[1]);
    let along = slider.rail.place.bar.map_or(along, |bar| along * z[bar]);
    let away = point - foot;
    away.re * along.re + away.im * along.im
}
