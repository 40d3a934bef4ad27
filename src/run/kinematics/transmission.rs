//! Transmission angles: how well a coupler pushes what it moves.
//!
//! Where a coupler meets a body that hangs on the ground, the angle between the lines from the common hinge
//! to the other hinge of each; where its end slides on the ground, that between the coupler and the normal of
//! the rail.  It is 90° where all of the force moves, and 0 where none does.
//!
//! Source: H. Alt, *Der Übertragungswinkel und seine Bedeutung für das Konstruieren periodischer Getriebe*
//! (1932); J. J. Uicker, G. R. Pennock, J. E. Shigley, *Theory of Machines and Mechanisms*, section 1.10.

use crate::arithmetic::Complex;
use crate::scene::{Hinge, Place, Scene};

/// A body and a direction in its frame; `None` for the ground.
type Side = (Option<usize>, Complex<f64>);

/// A transmission angle.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmission {
    /// The hinge or slider.
    pub at: String,
    /// Of the coupler first.
    sides: [Side; 2],
}

impl Transmission {
    /// Name of its column.
    pub fn name(&self) -> String {
        format!("transmission.{}", self.at)
    }

    /// The angle in [0, π/2] at these elements \[rad\].
    pub(super) fn angle(&self, z: &[Complex<f64>]) -> f64 {
        let [a, b] = self.sides.map(|(body, way)| body.map_or(way, |body| way * z[body]));
        let (dot, cross) = (a.re * b.re + a.im * b.im, a.re * b.im - a.im * b.re);
        cross.abs().atan2(dot.abs())
    }
}

/// The other places of a bar at hinges, and whether any of these is on the ground.
fn others(scene: &Scene, bar: usize, hinge: usize) -> Vec<(Place, bool)> {
    let of = |(k, between): (usize, &[Place; 2])| {
        let side = between.iter().position(|place| place.bar == Some(bar)).filter(|_| k != hinge)?;
        Some((between[side], between[1 - side].bar.is_none()))
    };
    scene.hinges.iter().map(|hinge| &hinge.between).enumerate().filter_map(of).collect()
}

fn way(from: &Place, to: &Place) -> Complex<f64> {
    Complex::new(to.point[0] - from.point[0], to.point[1] - from.point[1])
}

/// The hinges between two bodies of one other hinge each, with the lines to these.
pub(super) fn lines(scene: &Scene) -> Vec<Transmission> {
    let of = |(k, hinge): (usize, &Hinge)| {
        let [a, b] = hinge.between;
        let ([(far, _)], [(near, _)]) = (&others(scene, a.bar?, k)[..], &others(scene, b.bar?, k)[..]) else {
            return None;
        };
        Some(Transmission { at: hinge.name.clone(), sides: [(a.bar, way(&a, far)), (b.bar, way(&b, near))] })
    };
    scene.hinges.iter().enumerate().filter_map(of).collect()
}

/// Those of a scene, but at what the drive moves itself.
pub(super) fn of(scene: &Scene, drive: &str) -> Vec<Transmission> {
    let driven = scene.motors.iter().find(|motor| motor.name == drive).map(|motor| motor.bar);
    let mut all = Vec::new();
    for (k, hinge) in scene.hinges.iter().enumerate() {
        for [coupler, output] in [hinge.between, [hinge.between[1], hinge.between[0]]] {
            let (Some(a), Some(b)) = (coupler.bar, output.bar) else { continue };
            let ([(far, false)], [(pivot, true)]) = (&others(scene, a, k)[..], &others(scene, b, k)[..])
            else {
                continue;
            };
            if Some(b) != driven {
                let sides = [(Some(a), way(&coupler, far)), (Some(b), way(&output, pivot))];
                all.push(Transmission { at: hinge.name.clone(), sides });
            }
        }
    }
    for slider in scene.sliders.iter().filter(|slider| slider.rail.place.bar.is_none()) {
        let Some(bar) = slider.point.bar else { continue };
        let [x, y] = slider.rail.direction;
        let normal = (None, Complex::new(-y, x));
        let (at, side) = match (slider.locked, &others(scene, bar, usize::MAX)[..]) {
            (false, [(far, false)]) if far.point != slider.point.point => {
                (&slider.name, (Some(bar), way(&slider.point, far)))
            }
            // A block: what pushes it is hinged to it.
            _ => match pushing(scene, bar) {
                Some((hinge, side)) => (&scene.hinges[hinge].name, side),
                None => continue,
            },
        };
        all.push(Transmission { at: at.clone(), sides: [side, normal] });
    }
    all
}

/// The only hinge of a block, and the line to the only other hinge of the bar there.
fn pushing(scene: &Scene, block: usize) -> Option<(usize, Side)> {
    let mut at = scene.hinges.iter().enumerate().filter_map(|(k, hinge)| {
        let side = hinge.between.iter().position(|place| place.bar == Some(block))?;
        Some((k, hinge.between[1 - side]))
    });
    let (Some((k, near)), None) = (at.next(), at.next()) else { return None };
    match &others(scene, near.bar?, k)[..] {
        [(far, false)] => Some((k, (near.bar, way(&near, far)))),
        _ => None,
    }
}
