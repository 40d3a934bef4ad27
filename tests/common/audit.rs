//! An independent look at a run that says it succeeded: energies and joints from the scene and the rows of the table alone.

use driftless::dynamics::Mechanism;
use driftless::run::{Outcome, Sample};
use driftless::scene::{Law, Place, Scene, Sine};

/// What the program promises of a success without stated limits, with a little room for the rounding of this audit.
const ENERGY: f64 = 1.1e-2;
const POSITION: f64 = 1.1e-2;

fn law(law: &Law, t: f64) -> f64 {
    let sines: f64 = law.sines.iter().map(|sine| sine.amplitude * (sine.frequency * t + sine.phase).sin()).sum();
    law.start + law.rate * t + 0.5 * law.acceleration * t * t + sines
}

fn length(x: [f64; 2]) -> f64 {
    x[0].hypot(x[1])
}

/// The rows of a run seen by the scene alone.
struct Auditor<'a> {
    scene: &'a Scene,
    /// Longest arm of any body, and lever of any rail \[m\].
    size: f64,
}

impl Auditor<'_> {
    /// A place in the world \[m\]; what is read of a sample are angles and centres of mass.
    fn at(&self, place: &Place, sample: &Sample) -> [f64; 2] {
        let Some(k) = place.bar else { return place.point };
        let (sin, cos) = sample.phi[k].sin_cos();
        let (centre, arm) = (self.scene.bars[k].centre, place.point);
        let [x, y] = [arm[0] - centre[0], arm[1] - centre[1]];
        [sample.centre[k][0] + cos * x - sin * y, sample.centre[k][1] + sin * x + cos * y]
    }

    /// Kinetic and potential energy \[J\], and the size of the terms they are sums of.
    fn energy(&self, sample: &Sample) -> (f64, f64, f64) {
        let scene = self.scene;
        let (mut kinetic, mut potential, mut terms) = (0.0, 0.0, 0.0);
        for (k, bar) in scene.bars.iter().enumerate() {
            let speed = length(sample.velocity[k]);
            kinetic += 0.5 * bar.mass * speed * speed + 0.5 * bar.inertia * sample.omega[k] * sample.omega[k];
            for i in 0..2 {
                potential -= bar.mass * scene.gravity[i] * sample.centre[k][i];
                terms += (bar.mass * scene.gravity[i] * sample.centre[k][i]).abs();
            }
        }
        for spring in &scene.springs {
            let [a, b] = [0, 1].map(|end| self.at(&spring.between[end], sample));
            let stretch = length([b[0] - a[0], b[1] - a[1]]) - spring.free_length;
            let own = 0.5 * spring.stiffness * stretch * stretch;
            potential += own;
            // Positions carry rounding, and stiff springs make energy of it.
            let rest =
                1e-15 * (length(a) + length(b) + self.size) * (1.0 + sample.phi.iter().fold(0.0, |most: f64, phi| most.max(phi.abs())));
            terms += own + 1e13 * spring.stiffness * rest * (stretch.abs() + rest);
        }
        for spring in &scene.torsion_springs {
            let from = spring.relative_to.map_or(0.0, |k| sample.phi[k]);
            let twist = sample.phi[spring.bar] - from - spring.free_angle;
            let own = 0.5 * spring.stiffness * twist * twist;
            potential += own;
            let rest = 1e-15 * (sample.phi[spring.bar].abs() + from.abs() + spring.free_angle.abs());
            terms += own + 1e13 * spring.stiffness * rest * (twist.abs() + rest);
        }
        (kinetic, potential, terms + kinetic)
    }

    /// The worst violation of any joint at a moment, in rad or sizes, and its name.
    fn joints(&self, sample: &Sample) -> (f64, String) {
        let scene = self.scene;
        let mut worst = (0.0, String::new());
        let mut see = |off: f64, name: &str| {
            if off.is_nan() || off > worst.0 {
                worst = (off, name.to_owned());
            }
        };
        // Rounding of this audit: where bodies are far away or have turned often.
        let far = sample.centre.iter().fold(0.0, |most: f64, &centre| most.max(length(centre)));
        let turned = sample.phi.iter().fold(0.0, |most: f64, phi| most.max(phi.abs()));
        let rest = 1e-14 * (far + self.size * (1.0 + turned));
        let gap = |between: &[Place; 2]| {
            let [a, b] = [0, 1].map(|end| self.at(&between[end], sample));
            (length([b[0] - a[0], b[1] - a[1]]) - rest).max(0.0) / self.size
        };
        scene.hinges.iter().for_each(|hinge| see(gap(&hinge.between), &hinge.name));
        scene.welds.iter().for_each(|weld| see(gap(&weld.between), &weld.name));
        for slider in &scene.sliders {
            let (point, foot) = (self.at(&slider.point, sample), self.at(&slider.rail.place, sample));
            let (sin, cos) = slider.rail.place.bar.map_or(0.0, |k| sample.phi[k]).sin_cos();
            let [x, y] = slider.rail.direction;
            let along = [cos * x - sin * y, sin * x + cos * y];
            let off = (along[0] * (point[1] - foot[1]) - along[1] * (point[0] - foot[0])).abs() / length(along);
            see((off - rest).max(0.0) / self.size, &slider.name);
        }
        for motor in &scene.motors {
            let from = motor.relative_to.map_or(0.0, |k| sample.phi[k]);
            let asked = law(&motor.law, sample.t);
            let of_sine = |sine: &Sine| sine.amplitude.abs() * (1.0 + (sine.frequency * sample.t).abs() + sine.phase.abs());
            let sizes = asked.abs()
                + from.abs()
                + motor.law.sines.iter().map(of_sine).sum::<f64>()
                + (motor.law.rate * sample.t).abs()
                + (motor.law.acceleration * sample.t * sample.t).abs();
            see(((sample.phi[motor.bar] - from - asked).abs() - 1e-14 * sizes).max(0.0), &motor.name);
        }
        worst
    }
}

/// Whether a success may be called one.
pub fn audit(scene: &Scene, mechanism: &Mechanism, samples: &[Sample], outcome: &Outcome) -> Result<(), String> {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return Err("there are no rows".into()) };
    // Fixed steps end on the horizon to rounding.
    if (last.t - outcome.plan.until).abs() > 1e-9 * outcome.plan.until
        || samples.windows(2).any(|pair| pair[1].t <= pair[0].t)
        || first.t != 0.0
    {
        return Err(format!("the rows do not go from 0 to {} s", outcome.plan.until));
    }
    if samples.len() as u64 != outcome.plan.rows + 1 || samples.iter().any(|sample| !sample.is_finite()) {
        return Err("rows are missing, or hold what is no number".into());
    }
    let arms = scene.hinges.iter().map(|hinge| &hinge.between).chain(scene.welds.iter().map(|weld| &weld.between)).flatten();
    let places =
        arms.chain(scene.springs.iter().flat_map(|spring| &spring.between)).chain(scene.sliders.iter().map(|slider| &slider.point));
    let size =
        places.map(|place| length(place.point)).chain(scene.bars.iter().map(|bar| bar.length.max(length(bar.centre)))).fold(0.0, f64::max);
    let auditor = Auditor { scene, size: if size > 0.0 { size } else { 1.0 } };
    let (kinetic, potential, _) = auditor.energy(first);
    let begun = kinetic + potential;
    let mut largest = mechanism.energy_scale;
    for sample in samples {
        let (kinetic, potential, terms) = auditor.energy(sample);
        largest = largest.max(kinetic).max(sample.work.abs());
        let off = kinetic + potential - begun - sample.work;
        let room = ENERGY * largest + 1e-13 * (terms + begun.abs());
        // Walls take energy, at their impacts and where points come to rest; they give none.
        let is_off = if scene.walls.is_empty() {
            off.abs() > room || off.is_nan()
        } else {
            !(off <= room && -off <= room + outcome.strike_loss.abs())
        };
        if is_off && terms.is_finite() {
            return Err(format!("the energy is off by {off:e} J of {largest:e} J at t = {} s", sample.t));
        }
        let (worst, name) = auditor.joints(sample);
        if worst.is_nan() || worst > POSITION {
            return Err(format!("{name} is off by {worst:e} at t = {} s", sample.t));
        }
    }
    Ok(())
}
