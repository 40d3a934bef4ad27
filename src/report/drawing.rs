//! A mechanism as charts draw it.

use crate::arithmetic::Complex;
use crate::chart::{HingeSketch, MotorPose, Pose, Sketch, SliderPose, SpringSketch, WallSketch, plain};
use crate::dynamics::Mechanism;
use crate::dynamics::compile::Joint;
use crate::scene::{Load, NamedPoint, Place, Scene};

/// A mechanism to draw.
#[derive(Clone, Copy)]
pub(super) struct Drawing<'a> {
    /// Its scene.
    pub scene: &'a Scene,
    /// Its equations.
    pub mechanism: &'a Mechanism,
}

impl<'a> Drawing<'a> {
    /// What the paths are of; none where there are none.
    pub fn title(&self) -> Option<String> {
        let traced = self.traced().len();
        let names = |all: &mut dyn Iterator<Item = &String>| {
            all.take(traced).map(|name| plain(name)).collect::<Vec<_>>().join(", ")
        };
        let several = traced > 1;
        if traced == 0 {
            None
        } else if self.points().next().is_some() {
            let names = names(&mut self.points().map(|point| &point.name));
            Some(format!("{} of {names}", if several { "Paths" } else { "Path" }))
        } else {
            let leaves = self.leaves();
            let names = names(&mut leaves.iter().map(|&body| &self.mechanism.bodies[body].name));
            Some(format!("{} of {names}", if several { "Paths of the ends" } else { "Path of the end" }))
        }
    }

    /// Up to four bodies that no other hangs on.
    pub fn leaves(&self) -> Vec<usize> {
        let hangs = &self.mechanism.forest.hangs;
        (0..hangs.len())
            .filter(|&k| hangs.iter().all(|hang| hang.origin_point.parent() != Some(k)))
            .take(4)
            .collect()
    }

    /// The scene's points on bodies.
    pub fn points(&self) -> impl Iterator<Item = &NamedPoint> {
        self.scene.points.iter().filter(|point| point.place.bar.is_some())
    }

    /// Up to four places whose paths are drawn: the scene's points, and where it has none the far ends of
    /// bars that no other hangs on.
    pub fn traced(&self) -> Vec<Place> {
        let points: Vec<Place> = self.points().map(|point| point.place).take(4).collect();
        if !points.is_empty() {
            return points;
        }
        let tip = |bar: usize| {
            let tip = self.mechanism.bodies[bar].ends;
            Place { bar: Some(bar), point: [(tip[1] - tip[0]).re, (tip[1] - tip[0]).im] }
        };
        self.leaves().into_iter().map(tip).collect()
    }

    /// Where a place is (x, y) \[m\].
    pub fn place(&self, place: &Place, phi: &[f64]) -> [f64; 2] {
        let (z, translations) = self.mechanism.pose(phi);
        let at = self.mechanism.place(place, &z, &translations);
        [at.re, at.im]
    }

    pub fn sketch(&self) -> Sketch {
        let hinges = self
            .mechanism
            .own_joints()
            .map(|joint| HingeSketch { name: plain(&joint.name), ground: joint.between.contains(&None) });
        Sketch {
            gravity: self.scene.gravity,
            hinges: hinges.collect(),
            springs: (self.springs())
                .map(|between| SpringSketch { ground: between.map(|end| end.bar.is_none()) })
                .collect(),
            walls: self
                .scene
                .walls
                .iter()
                .map(|wall| WallSketch { through: wall.through, normal: wall.normal })
                .collect(),
            points: self.points().map(|point| plain(&point.name)).collect(),
        }
    }

    pub fn pose(&self, phi: &[f64], omega: &[f64]) -> Pose {
        let (z, translations) = self.mechanism.pose(phi);
        let both = |point: Complex<f64>| [point.re, point.im];
        let on = |body: usize, offset: Complex<f64>| both(translations[body] + offset * z[body]);
        let place = |place: &Place| both(self.mechanism.place(place, &z, &translations));
        let at = |joint: &Joint| joint.at.0.map_or(both(joint.at.1), |body| on(body, joint.at.1));
        let motors = self.scene.motors.iter().filter_map(|motor| {
            let joint = self.mechanism.joints.iter().find(|joint| joint.outer == Some(motor.bar))?;
            Some(MotorPose { at: at(joint), angle: phi[motor.bar], rate: omega[motor.bar] })
        });
        Pose {
            bars: (self.mechanism.own_bodies().iter().enumerate())
                .map(|(k, body)| body.ends.map(|end| on(k, end)))
                .collect(),
            hinges: self.mechanism.own_joints().map(at).collect(),
            springs: self.springs().map(|between| between.each_ref().map(place)).collect(),
            motors: motors.collect(),
            arms: self.arms().map(|(bar, [from, to])| (bar, [on(bar, from), on(bar, to)])).collect(),
            sliders: (self.scene.sliders.iter())
                .map(|slider| {
                    let along = Complex::new(slider.rail.direction[0], slider.rail.direction[1]);
                    let along = slider.rail.place.bar.map_or(along, |bar| along * z[bar]);
                    SliderPose {
                        at: place(&slider.point),
                        along: both(along),
                        ground: slider.rail.place.bar.is_none(),
                    }
                })
                .collect(),
            points: self.points().map(|point| place(&point.place)).collect(),
        }
    }

    /// The ends of all springs, those by formulas last.
    fn springs(&self) -> impl Iterator<Item = [Place; 2]> {
        let laws = self.scene.laws.iter().filter_map(|law| match &law.load {
            Load::Spring { between, .. } => Some(*between),
            _ => None,
        });
        self.scene.springs.iter().map(|spring| spring.between).chain(laws)
    }

    /// What joins the origin of a bar with its hinges, spring ends and points that lie off it, counted from its
    /// origin \[m\].
    fn arms(&self) -> impl Iterator<Item = (usize, [Complex<f64>; 2])> {
        let hinges = self.scene.hinges.iter().flat_map(|hinge| hinge.between);
        let points = self.points().map(|point| point.place);
        hinges.chain(self.springs().flatten()).chain(points).filter_map(|place| {
            let bar = place.bar?;
            let (length, [x, y]) = (self.scene.bars[bar].length, place.point);
            let is_off = y.abs() > 1e-3 * length || x < -1e-3 * length || x > 1.001 * length;
            let origin = self.mechanism.bodies[bar].ends[0];
            is_off.then(|| (bar, [origin, origin + Complex::new(x, y)]))
        })
    }
}
