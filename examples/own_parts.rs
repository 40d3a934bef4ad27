//! A force, an event and an observer of one's own: a pendulum over two magnets that comes to rest at one of them.
//!
//! `cargo run --example own_parts` prints where it rests from seven starts, when, and how often it has passed the middle.

use driftless::run::Sample;
use driftless::{Configuration, Event, Force, Loads, Scalar, SceneBuilder, Simulation, Site, ground, on};
use std::ops::ControlFlow;

/// Half the distance between the magnets, how far below the hinge they are, and how far they are from the tip's
/// plane \[m\].
const PLACES: [f64; 3] = [0.25, 1.05, 0.1];
/// Energy of the tip at 1 m from a magnet \[J·m\].
const PULL: f64 = 0.2;
/// Drag on the tip \[N·s/m\].
const DRAG: f64 = 0.08;

/// Two magnets that pull the tip, and drag on it.
struct Magnets {
    tip: Site,
}

impl Force for Magnets {
    fn name(&self) -> &str {
        "magnets"
    }

    fn potential<S: Scalar>(&self, at: &Configuration<S>) -> S {
        let [x, y] = at.position(&self.tip);
        let [side, depth, off] = PLACES;
        let distance = |side: f64| {
            let [dx, dy] = [x - S::of(side), y + S::of(depth)];
            (dx * dx + dy * dy + S::of(off * off)).sqrt()
        };
        -(S::of(PULL) / distance(side) + S::of(PULL) / distance(-side))
    }

    fn apply<S: Scalar>(&self, at: &Configuration<S>, loads: &mut Loads<S>) {
        let [vx, vy] = at.velocity(&self.tip);
        loads.force(&self.tip, [vx.scale(-DRAG), vy.scale(-DRAG)]);
    }
}

/// The tip passes below the hinge.
struct Passes {
    tip: Site,
}

impl Event for Passes {
    fn name(&self) -> &str {
        "passes"
    }

    fn value(&self, at: &Configuration<f64>) -> f64 {
        at.position(&self.tip)[0]
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for start in [0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2] {
        let scene = SceneBuilder::new("magnets")
            .gravity([0.0, -9.81])
            .bar("bar", 1.0, 0.2)
            .hinge("A", ground([0.0, 0.0]), on("bar", [0.0, 0.0]))
            .start("bar", -std::f64::consts::FRAC_PI_2 + start, 0.0)
            .until(200.0, 0.05)
            .build()?;
        let simulation = Simulation::new(&scene)?;
        let tip = simulation.site("bar", [1.0, 0.0])?;
        // It rests where it has not moved for a second.
        let mut resting = 0;
        let mut observer = |sample: &Sample| {
            resting = if sample.omega[0].abs() < 1e-3 { resting + 1 } else { 0 };
            if resting < 20 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let outcome = simulation
            .force(&Magnets { tip: tip.clone() })?
            .event(Passes { tip })
            .run_observed(&mut observer)?;
        let angle = outcome.last.phi[0] + std::f64::consts::FRAC_PI_2;
        println!(
            "from {start:.1} rad: at rest at {angle:+.3} rad after {:5.1} s, {:2} times past the middle; energy balance kept to {:.1e}",
            outcome.last.t, outcome.event_count, outcome.drift.energy.max
        );
    }
    Ok(())
}
