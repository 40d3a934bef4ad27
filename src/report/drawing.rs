//! A mechanism as charts draw it.

use crate::arithmetic::Complex;
#[cfg(feature = "charts")]
use crate::chart::{
    HingeSketch, MotorPose, OutputSeries, Pose, Sketch, SliderPose, SpiralPose, SpringSketch, WallSketch,
    plain,
};
use crate::dynamics::Mechanism;
#[cfg(feature = "charts")]
use crate::dynamics::compile::Joint;
#[cfg(feature = "charts")]
use crate::scene::Slider;
use crate::scene::{Load, NamedPoint, Place, Scene, Wall};

/// A mechanism to draw.
#[derive(Clone, Copy)]
pub(super) struct MechanismDrawing<'a> {
    /// Its scene.
    pub scene: &'a Scene,
    /// Its equations.
    pub mechanism: &'a Mechanism,
}

/// Names of outputs in a title that can take so many letters; of more the first ones are named, and how many
/// there are besides.
#[cfg(feature = "charts")]
const LETTERS: usize = 34;

/// The names of outputs in a title, with markup.
#[cfg(feature = "charts")]
pub(super) fn names_of(outputs: &[OutputSeries]) -> String {
    let mut names = String::new();
    for (k, OutputSeries { name, .. }) in outputs.iter().enumerate() {
        if k > 0 && names.len() + name.len() > LETTERS {
            return format!("{names} and {} more", outputs.len() - k);
        }
        names += if k > 0 { ", " } else { "" };
        names += name;
    }
    names
}

#[cfg(feature = "charts")]
impl MechanismDrawing<'_> {
    /// What the paths are of; none where there are none.
    pub fn title(&self) -> Option<String> {
        let names = self.names();
        let are_places =
            self.points().next().is_some() || self.leaves().into_iter().any(|body| self.is_centred(body));
        let kind = match (names.len(), are_places) {
            (0, _) => return None,
            (1, true) => "Path",
            (_, true) => "Paths",
            (1, false) => "Path of the end",
            (_, false) => "Paths of the ends",
        };
        Some(format!("{kind} of {}", names.join(", ")))
    }

    /// Names of the points whose paths are drawn, or of the bodies whose ends they are, with markup.
    pub fn names(&self) -> Vec<String> {
        self.plain_names().into_iter().map(plain).collect()
    }

    /// Where a place is (x, y) \[m\].
    pub fn place(&self, place: &Place, phi: &[f64]) -> [f64; 2] {
        let (z, translations) = self.mechanism.pose(phi);
        let at = self.mechanism.place(place, &z, &translations);
        [at.re, at.im]
    }

    /// How far a slider is along its rail, from the rail's point \[m\].
    pub fn travel(&self, slider: &Slider, phi: &[f64]) -> f64 {
        let (z, translations) = self.mechanism.pose(phi);
        let [point, origin] =
            [&slider.point, &slider.rail.place].map(|place| self.mechanism.place(place, &z, &translations));
        let (along, apart) = (along(slider, &z), point - origin);
        (apart.re * along.re + apart.im * along.im) / along.re.hypot(along.im)
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
            walls: self.walls().map(|(through, normal)| WallSketch { through, normal }).collect(),
            points: self.points().map(|point| plain(&point.name)).collect(),
        }
    }

    pub fn pose(&self, phi: &[f64], omega: &[f64]) -> Pose {
        let (z, translations) = self.mechanism.pose(phi);
        let both = |point: Complex<f64>| [point.re, point.im];
        let on = |body: usize, offset: Complex<f64>| both(translations[body] + offset * z[body]);
        let place = |place: &Place| both(self.mechanism.place(place, &z, &translations));
        let origin = |bar: usize| self.mechanism.bodies[bar].ends[0];
        let at = |joint: &Joint| joint.at.0.map_or(both(joint.at.1), |body| on(body, joint.at.1));
        let motors = self.scene.motors.iter().filter_map(|motor| {
            let joint = self.mechanism.joints.iter().find(|joint| joint.outer == Some(motor.bar))?;
            Some(MotorPose { at: at(joint), angle: phi[motor.bar], rate: omega[motor.bar] })
        });
        Pose {
            bars: (self.mechanism.own_bodies().iter().enumerate())
                .map(|(k, _)| self.ends(k).map(|end| on(k, end)))
                .collect(),
            hinges: self.mechanism.own_joints().map(at).collect(),
            springs: self.springs().map(|between| between.each_ref().map(place)).collect(),
            spirals: (self.torsion_springs())
                .map(|(bar, other)| {
                    let joint = self.mechanism.joints.iter().find(|joint| {
                        joint.between == [Some(bar), other] || joint.between == [other, Some(bar)]
                    });
                    SpiralPose { at: joint.map_or_else(|| on(bar, origin(bar)), at), angle: phi[bar] }
                })
                .collect(),
            motors: motors.collect(),
            arms: self.arms().map(|(bar, [from, to])| (bar, [on(bar, from), on(bar, to)])).collect(),
            sliders: (self.scene.sliders.iter())
                .map(|slider| SliderPose {
                    at: place(&slider.point),
                    along: both(along(slider, &z)),
                    ground: slider.rail.place.bar.is_none(),
                })
                .collect(),
            points: self.points().map(|point| place(&point.place)).collect(),
        }
    }
}

impl MechanismDrawing<'_> {
    /// A point and the normal of every wall, drawn once for all poses: where it is at the start; of none that
    /// a body or a formula of places moves \[m\].
    pub fn walls(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
        let stays = |wall: &&Wall| wall.on.is_none() && wall.aim.is_none();
        self.scene.walls.iter().filter(stays).map(|wall| {
            let moved = wall.law.as_ref().map_or(0.0, |law| law.at_start().phi);
            let [x, y] = wall.through;
            let through = match moved == 0.0 {
                true => wall.through,
                false => [x + moved * wall.normal[0], y + moved * wall.normal[1]],
            };
            (through, wall.normal)
        })
    }

    /// Names of the points whose paths are drawn, or of the bodies whose ends they are.
    pub fn plain_names(&self) -> Vec<&str> {
        let traced = self.traced().len();
        if self.points().next().is_some() {
            return self.points().take(traced).map(|point| point.name.as_str()).collect();
        }
        self.leaves().iter().take(traced).map(|&body| self.mechanism.bodies[body].name.as_str()).collect()
    }

    /// Up to four bodies that no other hangs on, of which the far ends move and are not that of another among
    /// them.
    pub fn leaves(&self) -> Vec<usize> {
        let hangs = &self.mechanism.forest.hangs;
        let mut leaves: Vec<usize> = Vec::new();
        for k in 0..self.mechanism.own_bodies().len() {
            let has_path =
                !self.is_joined(k, None) && leaves.iter().all(|&leaf| !self.is_joined(k, Some(leaf)));
            if has_path && hangs.iter().all(|hang| hang.origin_point.parent() != Some(k)) {
                leaves.push(k);
            }
        }
        leaves.truncate(4);
        leaves
    }

    /// Whether a hinge joins the far end of a bar with the far end of another, or with the ground.
    fn is_joined(&self, bar: usize, other: Option<usize>) -> bool {
        let is_end = |place: &Place, bar: Option<usize>| {
            let Some(bar) = bar else { return place.bar.is_none() };
            let ([x, y], [end_x, end_y]) = (place.point, self.far_end(bar).point);
            place.bar == Some(bar) && (x - end_x).hypot(y - end_y) <= 1e-9 * end_x.hypot(end_y)
        };
        self.scene.hinges.iter().any(|hinge| {
            let [a, b] = &hinge.between;
            is_end(a, Some(bar)) && is_end(b, other) || is_end(b, Some(bar)) && is_end(a, other)
        })
    }

    /// True of a body whose origin is its centre of mass, with nothing of the scene elsewhere on it: a ball,
    /// a cart, a block.
    fn is_centred(&self, bar: usize) -> bool {
        let scene = self.scene;
        let hinges = scene.hinges.iter().flat_map(|hinge| hinge.between);
        let sliders = scene.sliders.iter().flat_map(|slider| [slider.point, slider.rail.place]);
        let walls = scene.walls.iter().map(|wall| Place { bar: Some(wall.bar), point: wall.point });
        let points = scene.points.iter().map(|point| point.place);
        let mut places = hinges.chain(sliders).chain(walls).chain(points).chain(self.springs().flatten());
        scene.bars[bar].centre == [0.0; 2]
            && places.all(|place| place.bar != Some(bar) || place.point == [0.0; 2])
    }

    /// Both ends of a body as it is drawn, as the mechanism counts them: a bar from its origin on, and of one
    /// that is nothing but its centre as much on either side \[m\].
    pub fn ends(&self, body: usize) -> [Complex<f64>; 2] {
        let [origin, end] = self.mechanism.bodies[body].ends;
        if body >= self.scene.bars.len() || !self.is_centred(body) {
            return [origin, end];
        }
        let half = (end - origin).times(0.5);
        [origin - half, origin + half]
    }

    /// The far end of a bar, or the centre of a body that is nothing else.
    fn far_end(&self, bar: usize) -> Place {
        if self.is_centred(bar) {
            return Place { bar: Some(bar), point: [0.0; 2] };
        }
        let [origin, end] = self.mechanism.bodies[bar].ends;
        Place { bar: Some(bar), point: [(end - origin).re, (end - origin).im] }
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
        self.leaves().into_iter().map(|bar| self.far_end(bar)).collect()
    }

    /// The ends of all springs, those by formulas last.
    pub fn springs(&self) -> impl Iterator<Item = [Place; 2]> {
        let laws = self.scene.laws.iter().filter_map(|law| match &law.load {
            Load::Spring { between, .. } => Some(*between),
            _ => None,
        });
        self.scene.springs.iter().map(|spring| spring.between).chain(laws)
    }

    /// The bar of every torsion spring and the one its angle is measured from, those by formulas last.
    #[cfg(feature = "charts")]
    pub fn torsion_springs(&self) -> impl Iterator<Item = (usize, Option<usize>)> {
        let laws = self.scene.laws.iter().filter_map(|law| match &law.load {
            Load::TorsionSpring { bar, relative_to, .. } => Some((*bar, *relative_to)),
            _ => None,
        });
        self.scene.torsion_springs.iter().map(|spring| (spring.bar, spring.relative_to)).chain(laws)
    }

    /// What joins the origin of a bar with its hinges, spring ends and points that lie off it, counted from
    /// its origin \[m\].
    pub fn arms(&self) -> impl Iterator<Item = (usize, [Complex<f64>; 2])> {
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

/// The direction of a slider's rail, of any length.
#[cfg(feature = "charts")]
fn along(slider: &Slider, z: &[Complex<f64>]) -> Complex<f64> {
    let along = Complex::new(slider.rail.direction[0], slider.rail.direction[1]);
    slider.rail.place.bar.map_or(along, |bar| along * z[bar])
}

#[cfg(all(test, feature = "charts"))]
mod tests {
    use super::*;
    use crate::scene::read_scene;

    #[test]
    fn the_travel_of_a_slider_is_that_of_the_closed_form() {
        let scene = read_scene("examples/scenes/slider_crank_driven.json".as_ref(), &[]).expect("shipped");
        let mechanism = Mechanism::new(&scene).expect("a mechanism");
        let drawing = MechanismDrawing { scene: &scene, mechanism: &mechanism };
        for crank in [0.0_f64, 0.4, 1.7, 4.0] {
            let rod = -(0.5 * crank.sin()).asin();
            let phi = vec![crank, rod, 0.0];
            let there = 0.15 * crank.cos() + (0.09 - (0.15 * crank.sin()).powi(2)).sqrt();
            let travel = drawing.travel(&scene.sliders[0], &mechanism_phi(&mechanism, &phi));
            assert!((travel - there).abs() < 1e-15, "{travel} and {there}");
        }
    }

    #[test]
    fn ends_that_hinges_join_have_one_path_and_those_on_the_ground_none() {
        let traced = |name: &str| {
            let path = format!("examples/scenes/{name}.json");
            let scene = read_scene(path.as_ref(), &[]).expect("shipped");
            let mechanism = Mechanism::new(&scene).expect("a mechanism");
            MechanismDrawing { scene: &scene, mechanism: &mechanism }.names()
        };
        assert_eq!(traced("andrews"), ["FE", "BED"], "GE and HE end at the end of FE");
        assert_eq!(traced("four_bar_motor"), ["coupler"], "where the rocker ends as well");
        assert_eq!(traced("pid"), ["arm"], "and no body that only carries an integral");
        assert_eq!(traced("branch"), ["bar2", "plate"]);
    }

    #[test]
    fn bodies_that_are_nothing_but_their_centre_are_drawn_about_it() {
        let scene = read_scene("examples/scenes/slider_crank_driven.json".as_ref(), &[]).expect("shipped");
        let mechanism = Mechanism::new(&scene).expect("a mechanism");
        let drawing = MechanismDrawing { scene: &scene, mechanism: &mechanism };
        let lengths = |body: usize| drawing.ends(body).map(|end| end.re - mechanism.bodies[body].ends[0].re);
        assert_eq!((lengths(0), lengths(2)), ([0.0, 0.15], [-0.025, 0.025]), "crank and block");
        assert_eq!(drawing.title().as_deref(), Some("Path of block"));
        assert_eq!(drawing.traced().last().map(|place| place.point), Some([0.0; 2]));
    }

    /// The angles with whatever further coordinates a mechanism has, at zero.
    fn mechanism_phi(mechanism: &Mechanism, phi: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; mechanism.coordinates()];
        all[..phi.len()].copy_from_slice(phi);
        all
    }
}
