//! The parts of a scene, number by number.

use super::{Decimal, Reader, TreeCursor};
use crate::scene::error::SceneError;
use crate::scene::locate::Value;
use crate::scene::{
    Bar, Drive, Force, Friction, FrictionPlace, Given, Hinge, Law, Lock, Motor, Parameter, Place, Rail,
    Scene, Sine, Slider, Spring, Start, Torque, TorsionSpring, Wall, Weld,
};

impl<'a, C: Decimal> Reader<'a, C> {
    pub(super) fn place(&self, at: &TreeCursor, plain: &Place) -> Result<Place<C>, SceneError> {
        Ok(Place { bar: plain.bar, point: self.pair(at, "point", plain.point)? })
    }

    pub(super) fn between(&self, at: &TreeCursor, plain: &[Place; 2]) -> Result<[Place<C>; 2], SceneError> {
        let items = at.items("between");
        match &items[..] {
            [a, b] => Ok([self.place(a, &plain[0])?, self.place(b, &plain[1])?]),
            _ => Err(self.refuse(at, "has no two places", "compare with the scene's text")),
        }
    }

    fn law(&self, at: &TreeCursor, plain: &Law) -> Result<Law<C>, SceneError> {
        let Some(law) = at.child("law") else { return Ok(Law::default()) };
        if let Value::Text(text) = &law.node.value {
            return Ok(Law { profile: Some(self.profile(&law, text)?), ..Law::default() });
        }
        let items = law.items("sines");
        let sines = items.iter().zip(&plain.sines).map(|(at, plain)| {
            Ok(Sine {
                amplitude: self.number(at, "amplitude", plain.amplitude)?,
                frequency: self.number(at, "frequency", plain.frequency)?,
                phase: self.number(at, "phase", plain.phase)?,
            })
        });
        Ok(Law {
            start: self.number(&law, "start", plain.start)?,
            rate: self.number(&law, "rate", plain.rate)?,
            acceleration: self.number(&law, "acceleration", plain.acceleration)?,
            sines: sines.collect::<Result<_, SceneError>>()?,
            profile: None,
        })
    }

    /// The parts of a list, each with what it is in doubles.
    fn each<P, E>(
        &self,
        list: &str,
        plain: &[P],
        mut part: impl FnMut(&TreeCursor<'a>, &P) -> Result<E, SceneError>,
    ) -> Result<Vec<E>, SceneError> {
        self.plain_items(list).iter().zip(plain).map(|(at, plain)| part(at, plain)).collect()
    }

    /// The motor of a name: on an angle, on a slider or a gear, which stand in one list.
    pub(super) fn motor(&self, name: &str) -> Result<TreeCursor<'a>, SceneError> {
        let found =
            self.root.items("motors").into_iter().find(|at| crate::scene::set::name(at.node) == Some(name));
        found.ok_or_else(|| {
            self.refuse(&self.root, &format!("has no motor {name}"), "compare with the scene's text")
        })
    }

    fn bar(&self, at: &TreeCursor, plain: &Bar) -> Result<Bar<C>, SceneError> {
        let name = plain.name.clone();
        if at.child("mass").is_some() {
            return Ok(Bar {
                name,
                length: self.number(at, "length", plain.length)?,
                mass: self.number(at, "mass", plain.mass)?,
                centre: self.pair(at, "centre", plain.centre)?,
                inertia: self.number(at, "inertia", plain.inertia)?,
            });
        }
        let size = |key| self.number(at, key, 0.0);
        let (length, width) = (size("length")?, size("width")?);
        let mass = size("density")? * length * width * size("thickness")?;
        let twelfth = |square: C| mass * square / C::of(12.0);
        let word = at.child("inertia").and_then(|at| match &at.node.value {
            Value::Text(word) if word == "full" || word == "slender" => Some(word == "full"),
            Value::Null => Some(true),
            _ => None,
        });
        let inertia = match (word, at.child("inertia")) {
            (Some(false), _) => twelfth(length * length),
            (Some(true), _) | (_, None) => twelfth(length * length + width * width),
            _ => self.number(at, "inertia", plain.inertia)?,
        };
        Ok(Bar { name, length, mass, centre: [length / C::of(2.0), C::ZERO], inertia })
    }

    /// Angle and rate of a bar as given; as in doubles where the scene does not give them.
    fn start(&self, scene: &Scene, bar: usize) -> Result<Start<C>, SceneError> {
        let plain = scene.start[bar];
        let Some(at) = self.root.child("start").and_then(|all| all.child(&scene.bars[bar].name)) else {
            return Ok(Start { phi: C::of(plain.phi), omega: C::of(plain.omega) });
        };
        let of = |key: &str, value: f64| {
            if at.child(key).is_some() { self.number(&at, key, value) } else { Ok(C::of(value)) }
        };
        Ok(Start { phi: of("phi", plain.phi)?, omega: of("omega", plain.omega)? })
    }

    /// What is said of the start of a bar.
    fn given(&self, scene: &Scene, bar: usize) -> Result<Given<C>, SceneError> {
        let at = self.root.child("start").and_then(|all| all.child(&scene.bars[bar].name));
        let has = |key: &str| at.as_ref().is_some_and(|at| at.child(key).is_some());
        let pair = |key: &str| match &at {
            Some(at) if has(key) => self.pair(at, key, [0.0; 2]).map(Some),
            _ => Ok(None),
        };
        Ok(Given {
            phi: has("phi"),
            omega: has("omega"),
            origin: pair("origin")?,
            velocity: pair("velocity")?,
        })
    }

    pub(super) fn scene(&self, plain: &Scene) -> Result<Scene<C>, SceneError> {
        let bars = 0..plain.own_bars();
        let scene = Scene {
            name: plain.name.clone(),
            gravity: self.pair(&self.root, "gravity", plain.gravity)?,
            bars: self.each("bars", &plain.bars, |at, bar| self.bar(at, bar))?,
            hinges: self.each("hinges", &plain.hinges, |at, hinge| {
                Ok(Hinge { name: hinge.name.clone(), between: self.between(at, &hinge.between)? })
            })?,
            sliders: self.each("sliders", &plain.sliders, |at, slider| self.slider(at, slider))?,
            welds: self.each("welds", &plain.welds, |at, weld| {
                Ok(Weld { name: weld.name.clone(), between: self.between(at, &weld.between)? })
            })?,
            locks: self.each("locks", &plain.locks, |at, lock| {
                let angle = lock.angle.map(|angle| self.number(at, "angle", angle)).transpose()?;
                Ok(Lock { name: lock.name.clone(), bar: lock.bar, relative_to: lock.relative_to, angle })
            })?,
            springs: self.each("springs", &plain.springs, |at, spring| self.spring(at, spring))?,
            torsion_springs: self.each("torsion_springs", &plain.torsion_springs, |at, torsion| {
                Ok(TorsionSpring {
                    name: torsion.name.clone(),
                    bar: torsion.bar,
                    relative_to: torsion.relative_to,
                    stiffness: self.number(at, "stiffness", torsion.stiffness)?,
                    free_angle: self.number(at, "free_angle", torsion.free_angle)?,
                    damping: self.number(at, "damping", torsion.damping)?,
                })
            })?,
            forces: self.each("forces", &plain.forces, |at, force| self.force(at, force))?,
            torques: self.each("torques", &plain.torques, |at, torque| {
                Ok(Torque {
                    name: torque.name.clone(),
                    bar: torque.bar,
                    relative_to: torque.relative_to,
                    torque: self.number(at, "torque", torque.torque)?,
                    law: torque.law.as_ref().map(|law| self.law(at, law)).transpose()?,
                })
            })?,
            motors: plain
                .motors
                .iter()
                .map(|motor| self.angle_motor(motor))
                .collect::<Result<_, SceneError>>()?,
            drives: plain.drives.iter().map(|drive| self.drive(drive)).collect::<Result<_, SceneError>>()?,
            couplings: self.couplings(plain)?,
            walls: self.each("walls", &plain.walls, |at, wall| self.wall(at, wall))?,
            frictions: self.frictions(plain)?,
            start: bars.clone().map(|bar| self.start(plain, bar)).collect::<Result<_, _>>()?,
            given: bars.map(|bar| self.given(plain, bar)).collect::<Result<_, _>>()?,
            parameters: (self.parameters.iter())
                .map(|(name, value)| Parameter { name: name.clone(), value: *value })
                .collect(),
            tables: self.tables.clone(),
            points: self.points(plain)?,
            signals: plain.signals.clone(),
            integrals: plain.integrals.clone(),
            laws: self.laws(plain)?,
            events: self.events(plain)?,
            inactive: plain.inactive.clone(),
            until: plain.until,
            every: plain.every,
            ..Scene::default()
        };
        Ok(scene.with_rotors())
    }

    /// A slider on its rail.
    fn slider(&self, at: &TreeCursor, plain: &Slider) -> Result<Slider<C>, SceneError> {
        let missing = || self.refuse(at, "has no rail", "compare with the scene's text");
        let rail = at.child("rail").ok_or_else(missing)?;
        let point = at.child("point").ok_or_else(missing)?;
        Ok(Slider {
            name: plain.name.clone(),
            point: self.place(&point, &plain.point)?,
            rail: Rail {
                place: self.place(&rail, &plain.rail.place)?,
                direction: self.direction(&rail, "direction", plain.rail.direction)?,
            },
            locked: plain.locked,
        })
    }

    /// A motor on an angle.
    fn angle_motor(&self, plain: &Motor) -> Result<Motor<C>, SceneError> {
        let law = self.law(&self.motor(&plain.name)?, &plain.law)?;
        Ok(Motor { name: plain.name.clone(), bar: plain.bar, relative_to: plain.relative_to, law })
    }

    /// A motor on a slider.
    fn drive(&self, plain: &Drive) -> Result<Drive<C>, SceneError> {
        let law = self.law(&self.motor(&plain.name)?, &plain.law)?;
        Ok(Drive { name: plain.name.clone(), slider: plain.slider, law })
    }

    /// A wall with its law or aim.
    fn wall(&self, at: &TreeCursor, plain: &Wall) -> Result<Wall<C>, SceneError> {
        let line = at.child("line").unwrap_or_else(|| at.clone());
        Ok(Wall {
            name: plain.name.clone(),
            bar: plain.bar,
            point: self.pair(at, "point", plain.point)?,
            on: plain.on,
            law: plain.law.as_ref().map(|law| self.law(at, law)).transpose()?,
            aim: plain.aim.as_ref().map(|aim| self.formula(at, "law", aim)).transpose()?,
            through: self.pair(&line, "through", plain.through)?,
            normal: self.direction(&line, "normal", plain.normal)?,
            restitution: self.number(at, "restitution", plain.restitution)?,
        })
    }

    fn spring(&self, at: &TreeCursor, spring: &Spring) -> Result<Spring<C>, SceneError> {
        Ok(Spring {
            name: spring.name.clone(),
            between: self.between(at, &spring.between)?,
            stiffness: self.number(at, "stiffness", spring.stiffness)?,
            free_length: self.number(at, "free_length", spring.free_length)?,
            damping: self.number(at, "damping", spring.damping)?,
            rigid: spring.rigid,
        })
    }

    fn frictions(&self, plain: &Scene) -> Result<Vec<Friction<C>>, SceneError> {
        plain.frictions.iter().map(|friction| self.friction(friction)).collect()
    }

    fn friction(&self, plain: &Friction) -> Result<Friction<C>, SceneError> {
        let (list, number) = match plain.at {
            FrictionPlace::Hinge { hinge, .. } => ("hinges", hinge),
            FrictionPlace::Slider(slider) => ("sliders", slider),
            FrictionPlace::Wall { wall, .. } => ("walls", wall),
        };
        let at = self.root.items(list).get(number).and_then(|at| at.child("friction"));
        let at =
            at.ok_or_else(|| self.refuse(&self.root, "has no friction", "compare with the scene's text"))?;
        let kinetic = self.number(&at, "kinetic", plain.kinetic)?;
        let stiction = match at.child("static") {
            Some(_) => self.number(&at, "static", plain.stiction)?,
            None => kinetic,
        };
        let place = match plain.at {
            FrictionPlace::Hinge { hinge, radius } => {
                FrictionPlace::Hinge { hinge, radius: self.number(&at, "radius", radius)? }
            }
            FrictionPlace::Slider(slider) => FrictionPlace::Slider(slider),
            FrictionPlace::Wall { wall, is_newton } => FrictionPlace::Wall { wall, is_newton },
        };
        Ok(Friction { at: place, kinetic, stiction })
    }

    fn force(&self, at: &TreeCursor, force: &Force) -> Result<Force<C>, SceneError> {
        Ok(Force {
            name: force.name.clone(),
            bar: force.bar,
            point: self.pair(at, "point", force.point)?,
            force: self.pair(at, "force", force.force)?,
            follows: force.follows,
            law: force.law.as_ref().map(|law| self.law(at, law)).transpose()?,
        })
    }
}
