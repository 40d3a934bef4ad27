//! A mechanism as the script of a page draws it: places in the frames of bodies, whose centres and angles are
//! columns.

use crate::arithmetic::Complex;
use crate::dynamics::Mechanism;
use crate::report::drawing::MechanismDrawing;
use crate::scene::{Place, Scene};
use serde_json::{Value, json};

/// The geometry: a place is `[body, x, y]`, counted from the body's centre of mass in its frame, or
/// `[-1, x, y]` on the ground \[m\].
pub fn geometry(scene: &Scene, mechanism: &Mechanism) -> Value {
    let drawing = MechanismDrawing { scene, mechanism };
    let place = |place: &Place| at(place.bar, local(mechanism, place));
    let bodies: Vec<Value> = (mechanism.own_bodies().iter().enumerate())
        .map(|(k, body)| {
            let ends = drawing.ends(k).map(|end| [end.re - body.centre.re, end.im - body.centre.im]);
            json!({"name": body.name, "ends": ends})
        })
        .collect();
    let arms: Vec<Value> = drawing
        .arms()
        .map(|(body, ends)| json!([body, ends.map(|end| both(end - mechanism.bodies[body].centre))]))
        .collect();
    let hinges: Vec<Value> = (mechanism.own_joints())
        .map(|joint| {
            let (body, point) = joint.at;
            let point = body.map_or(point, |body| point - mechanism.bodies[body].centre);
            json!({"name": joint.name, "at": at(body, point), "ground": joint.between.contains(&None)})
        })
        .collect();
    let motors: Vec<Value> = (scene.motors.iter())
        .filter_map(|motor| {
            let joint = mechanism.joints.iter().find(|joint| joint.outer == Some(motor.bar))?;
            let (body, point) = joint.at;
            let point = body.map_or(point, |body| point - mechanism.bodies[body].centre);
            Some(json!({"at": at(body, point), "body": motor.bar}))
        })
        .collect();
    let sliders: Vec<Value> = (scene.sliders.iter())
        .map(|slider| {
            let rail = slider.rail.place.bar;
            json!({"at": place(&slider.point),
                "rail": at(rail, Complex::new(slider.rail.direction[0], slider.rail.direction[1]))})
        })
        .collect();
    let walls: Vec<Value> =
        drawing.walls().map(|(through, normal)| json!({"through": through, "normal": normal})).collect();
    let traced: Vec<Value> = (drawing.traced().iter().zip(drawing.plain_names()))
        .map(|(point, name)| json!({"name": name, "at": place(point)}))
        .collect();
    json!({
        "gravity": scene.gravity,
        "bodies": bodies,
        "arms": arms,
        "hinges": hinges,
        "springs": drawing.springs().map(|between| between.each_ref().map(place)).collect::<Vec<_>>(),
        "motors": motors,
        "sliders": sliders,
        "walls": walls,
        "traced": traced,
        "marked": drawing.points().next().is_some(),
    })
}

/// A place counted from its body's centre of mass.
fn local(mechanism: &Mechanism, place: &Place) -> Complex<f64> {
    let point = Complex::new(place.point[0], place.point[1]);
    place.bar.map_or(point, |bar| mechanism.bodies[bar].ends[0] + point - mechanism.bodies[bar].centre)
}

fn at(body: Option<usize>, point: Complex<f64>) -> Value {
    json!([body.map_or(-1, |body| body as i64), point.re, point.im])
}

fn both(point: Complex<f64>) -> [f64; 2] {
    [point.re, point.im]
}
