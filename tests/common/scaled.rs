//! A scene in other units: all masses, lengths or times multiplied by a number, every quantity by its
//! dimension.

use driftless::scene::{FrictionPlace, Law, Place, Scene};

/// What masses, lengths and times are multiplied by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    pub mass: f64,
    pub length: f64,
    pub time: f64,
}

impl Scale {
    pub const ONE: Self = Self { mass: 1.0, length: 1.0, time: 1.0 };

    pub fn speed(self) -> f64 {
        self.length / self.time
    }

    pub fn force(self) -> f64 {
        self.mass * self.length / (self.time * self.time)
    }

    pub fn energy(self) -> f64 {
        self.force() * self.length
    }
}

/// A law of what is measured in a unit that is multiplied by `unit`.
fn law(law: &mut Law, unit: f64, time: f64) {
    law.start *= unit;
    law.rate *= unit / time;
    law.acceleration *= unit / (time * time);
    for sine in &mut law.sines {
        sine.amplitude *= unit;
        sine.frequency /= time;
    }
}

/// The scene with every number scaled.
pub fn scaled(scene: &Scene, by: Scale) -> Scene {
    let mut scene = scene.clone();
    let times = |values: &mut [f64], factor: f64| values.iter_mut().for_each(|value| *value *= factor);
    let places =
        |places: &mut [Place]| places.iter_mut().for_each(|place| times(&mut place.point, by.length));
    times(&mut scene.gravity, by.length / (by.time * by.time));
    for bar in &mut scene.bars {
        bar.length *= by.length;
        bar.mass *= by.mass;
        times(&mut bar.centre, by.length);
        bar.inertia *= by.mass * by.length * by.length;
    }
    scene.hinges.iter_mut().for_each(|hinge| places(&mut hinge.between));
    scene.welds.iter_mut().for_each(|weld| places(&mut weld.between));
    for slider in &mut scene.sliders {
        places(std::slice::from_mut(&mut slider.point));
        places(std::slice::from_mut(&mut slider.rail.place));
    }
    for spring in &mut scene.springs {
        places(&mut spring.between);
        spring.stiffness *= by.force() / by.length;
        spring.free_length *= by.length;
        spring.damping *= by.force() / by.speed();
    }
    for torsion in &mut scene.torsion_springs {
        torsion.stiffness *= by.energy();
        torsion.damping *= by.energy() * by.time;
    }
    for force in &mut scene.forces {
        times(&mut force.point, by.length);
        times(&mut force.force, by.force());
        force.law.iter_mut().for_each(|it| law(it, 1.0, by.time));
    }
    for torque in &mut scene.torques {
        torque.torque *= by.energy();
        torque.law.iter_mut().for_each(|it| law(it, 1.0, by.time));
    }
    scene.motors.iter_mut().for_each(|motor| law(&mut motor.law, 1.0, by.time));
    scene.drives.iter_mut().for_each(|drive| law(&mut drive.law, by.length, by.time));
    for wall in &mut scene.walls {
        times(&mut wall.point, by.length);
        times(&mut wall.through, by.length);
    }
    for friction in &mut scene.frictions {
        if let FrictionPlace::Hinge { radius, .. } = &mut friction.at {
            *radius *= by.length;
        }
    }
    scene.start.iter_mut().for_each(|start| start.omega /= by.time);
    for given in &mut scene.given {
        given.origin.iter_mut().for_each(|origin| times(origin, by.length));
        given.velocity.iter_mut().for_each(|velocity| times(velocity, by.speed()));
    }
    scene.until *= by.time;
    scene.every *= by.time;
    scene
}
