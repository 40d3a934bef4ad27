//! The start of a scene as a chart, or what comes closest to it.

use super::drawing::MechanismDrawing;
use super::page::figure;
use crate::chart::{self, ChartError, FILE_RESOLUTION, MechanismChart, Picture, plain};
use crate::dynamics::assembly::Closest;
use crate::dynamics::{CompileError, Mechanism};
use crate::scene::Scene;

/// The start of a scene.
///
/// # Errors
/// Drawing fails.
pub fn chart(scene: &Scene, mechanism: &Mechanism) -> Result<Picture, ChartError> {
    let start = mechanism.start(scene);
    let [phi, omega] = start.rounded();
    drawn(scene, mechanism, &phi, &omega, &format!("Start of {}", plain(&scene.name)), Vec::new())
}

/// The configuration that comes closest to a start that fits not.
///
/// # Errors
/// Drawing fails.
pub fn closest(scene: &Scene, closest: &Closest) -> Result<Picture, ChartError> {
    let unassembled = |error: CompileError| ChartError::Drawing(error.to_string());
    let mechanism = Mechanism::unassembled(scene, Vec::new()).map_err(unassembled)?;
    let [tried, closed] = closest.guesses;
    let caption = match closest.apart {
        Some(apart) => vec![
            format!("{} rad or sizes of the mechanism from what is given", figure(apart)),
            format!("{closed} of {tried} guesses lead to closed loops, none nearer"),
        ],
        None => {
            vec![format!("none of {tried} guesses closes all loops"), "joints shown on one body".to_owned()]
        }
    };
    let still = vec![0.0; closest.q.len()];
    drawn(scene, &mechanism, &closest.q, &still, "Closest configuration", caption)
}

fn drawn(
    scene: &Scene,
    mechanism: &Mechanism,
    phi: &[f64],
    omega: &[f64],
    title: &str,
    caption: Vec<String>,
) -> Result<Picture, ChartError> {
    let drawing = MechanismDrawing { scene, mechanism };
    let chart = MechanismChart {
        title: title.to_owned(),
        caption: std::iter::once(format!("scene {}", plain(&scene.name))).chain(caption).collect(),
        sketch: drawing.sketch(),
        poses: vec![drawing.pose(phi, omega)],
        trails: Vec::new(),
        names: Vec::new(),
        horizon: None,
    };
    chart::mechanism(&chart, FILE_RESOLUTION)
}
