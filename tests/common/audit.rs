//! An independent look at a run that says it succeeded: energies and joints from the scene and the rows of
//! the table alone.

use driftless::dynamics::Mechanism;
use driftless::run::{Outcome, Sample};
use driftless::scene::{Given, Law, Place, Scene, Sine, Slider};

/// What the program promises of a success without stated limits, with a little room for the rounding of this
/// audit.
const ENERGY: f64 = 1.1e-2;
const POSITION: f64 = 1.1e-2;

fn law(law: &Law, t: f64) -> f64 {
    let sines: f64 =
        law.sines.iter().map(|sine| sine.amplitude * (sine.frequency * t + sine.phase).sin()).sum();
    law.start + law.rate * t + 0.5 * law.acceleration * t * t + sines
}

/// The sizes that a law's value is a sum of.
fn sizes(law: &Law, t: f64) -> f64 {
    let of_sine = |sine: &Sine| sine.amplitude.abs() * (1.0 + (sine.frequency * t).abs() + sine.phase.abs());
    let sines: f64 = law.sines.iter().map(of_sine).sum();
    law.start.abs() + sines + (law.rate * t).abs() + (law.acceleration * t * t).abs()
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
        for spring in scene.springs.iter().filter(|spring| !spring.rigid) {
            let [a, b] = [0, 1].map(|end| self.at(&spring.between[end], sample));
            let stretch = length([b[0] - a[0], b[1] - a[1]]) - spring.free_length;
            let own = 0.5 * spring.stiffness * stretch * stretch;
            potential += own;
            // Positions carry rounding, and stiff springs make energy of it.
            let rest = 1e-15
                * (length(a) + length(b) + self.size)
                * (1.0 + sample.phi.iter().fold(0.0, |most: f64, phi| most.max(phi.abs())));
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
            let [_, off] = self.on_rail(slider, sample);
            see((off.abs() - rest).max(0.0) / self.size, &slider.name);
        }
        for drive in &scene.drives {
            let [travel, _] = self.on_rail(&scene.sliders[drive.slider], sample);
            let off = (travel - law(&drive.law, sample.t)).abs() - rest - 1e-14 * sizes(&drive.law, sample.t);
            see(off.max(0.0) / self.size, &drive.name);
        }
        // A rod that vibrates has its length on average, which the energy of its start tells; one that does
        // not has it always.
        for rod in scene.springs.iter().filter(|spring| spring.rigid) {
            let [a, b] = [0, 1].map(|end| self.at(&rod.between[end], sample));
            let off = (length([b[0] - a[0], b[1] - a[1]]) - rod.free_length).abs();
            see((off - rest).max(0.0) / self.size, &rod.name);
        }
        for motor in &scene.motors {
            let from = motor.relative_to.map_or(0.0, |k| sample.phi[k]);
            let off = (sample.phi[motor.bar] - from - law(&motor.law, sample.t)).abs();
            see((off - 1e-14 * (from.abs() + sizes(&motor.law, sample.t))).max(0.0), &motor.name);
        }
        for lock in &scene.locks {
            let Some(angle) = lock.angle else { continue };
            let from = lock.relative_to.map_or(0.0, |k| sample.phi[k]);
            let off = (sample.phi[lock.bar] - from - angle).abs();
            see((off - 1e-14 * (from.abs() + angle.abs())).max(0.0), &lock.name);
        }
        for wall in &scene.walls {
            let point = self.at(&Place { bar: Some(wall.bar), point: wall.point }, sample);
            let gap =
                (point[0] - wall.through[0]) * wall.normal[0] + (point[1] - wall.through[1]) * wall.normal[1];
            see((-gap - rest - 1e-14 * length(wall.through)).max(0.0) / self.size, &wall.name);
        }
        worst
    }

    /// Travel of a slider along its rail, and how far it is off \[m\].
    fn on_rail(&self, slider: &Slider, sample: &Sample) -> [f64; 2] {
        let (point, origin_point) = (self.at(&slider.point, sample), self.at(&slider.rail.place, sample));
        let (sin, cos) = slider.rail.place.bar.map_or(0.0, |k| sample.phi[k]).sin_cos();
        let [x, y] = slider.rail.direction;
        let along = [cos * x - sin * y, sin * x + cos * y].map(|part| part / length([x, y]));
        let span = [point[0] - origin_point[0], point[1] - origin_point[1]];
        [along[0] * span[0] + along[1] * span[1], along[0] * span[1] - along[1] * span[0]]
    }

    /// What the first row says otherwise than the scene, of whose start nothing had to be changed; `struck`
    /// where impacts changed its rates.
    fn start(&self, first: &Sample, struck: bool, until: f64) -> Option<String> {
        let scene = self.scene;
        // The fastest turn there is, the fastest way over the size of the scene, and the horizon: rates that
        // are zero are so to the rounding of these.
        let of_way = |velocity: &[f64; 2]| length(*velocity) / self.size;
        let turns = first.omega.iter().map(|omega| omega.abs()).take(scene.bars.len());
        let fastest = first.velocity.iter().map(of_way).chain(turns).fold(1.0 / until, f64::max);
        let differ =
            |a: f64, b: f64, size: f64| (a - b).abs() > 1e-10 * (size + a.abs() + b.abs()) || a.is_nan();
        for (k, bar) in scene.bars.iter().enumerate() {
            let given = scene.given.get(k).copied().unwrap_or(Given::ANGLE_AND_RATE);
            let (start, name) = (scene.start[k], &bar.name);
            if given.phi && differ(first.phi[k], start.phi, 1.0) {
                return Some(format!(
                    "the first row has {name} at {} rad, the scene at {} rad",
                    first.phi[k], start.phi
                ));
            }
            if given.omega && !struck && differ(first.omega[k], start.omega, fastest) {
                return Some(format!(
                    "the first row has {name} at {} rad/s, the scene at {} rad/s",
                    first.omega[k], start.omega
                ));
            }
            let at = self.at(&Place { bar: Some(k), point: [0.0, 0.0] }, first);
            let turned = self.size * (1.0 + 1e-5 * first.phi[k].abs());
            if let Some(origin) = given
                .origin
                .filter(|origin| (0..2).any(|i| differ(at[i], origin[i], turned + length(*origin))))
            {
                return Some(format!(
                    "the first row has the origin of {name} at {at:?} m, the scene at {origin:?} m"
                ));
            }
        }
        None
    }
}

/// Whether a success may be called one.
pub fn audit(
    scene: &Scene,
    mechanism: &Mechanism,
    samples: &[Sample],
    outcome: &Outcome,
) -> Result<(), String> {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err("there are no rows".into());
    };
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
    let arms = scene
        .hinges
        .iter()
        .map(|hinge| &hinge.between)
        .chain(scene.welds.iter().map(|weld| &weld.between))
        .flatten();
    let places = (arms.chain(scene.springs.iter().flat_map(|spring| &spring.between)))
        .chain(scene.sliders.iter().flat_map(|slider| [&slider.point, &slider.rail.place]));
    let size = places
        .map(|place| length(place.point))
        .chain(scene.bars.iter().map(|bar| bar.length.max(length(bar.centre))))
        .fold(0.0, f64::max);
    let auditor = Auditor { scene, size: if size > 0.0 { size } else { 1.0 } };
    let struck = outcome.impact_count + outcome.persistent_contact_count > 0;
    let is_changed = !mechanism.assembly.changes.is_empty();
    if let Some(fault) = auditor.start(first, struck, outcome.plan.until).filter(|_| !is_changed) {
        return Err(fault);
    }
    let (kinetic, potential, _) = auditor.energy(first);
    let begun = kinetic + potential;
    let mut largest = mechanism.energy_scale;
    let has_motors = !(scene.motors.is_empty() && scene.drives.is_empty());
    for sample in samples {
        let (kinetic, potential, terms) = auditor.energy(sample);
        largest = largest.max(kinetic).max(sample.work.abs());
        let off = kinetic + potential - begun - sample.work;
        let room = ENERGY * largest + 1e-13 * (terms + begun.abs());
        // Walls take energy, at their impacts and where points come to rest; they give none.
        let is_off = if scene.walls.is_empty() {
            off.abs() > room || off.is_nan()
        } else {
            !(off <= room && -off <= room + outcome.impact_loss.abs())
        };
        // What a rod's vibration holds is no energy of the places of bodies, and what motors do in an impact
        // is work nobody can see from outside.
        let is_seen = mechanism.vibration.is_none() && !(outcome.impact_count > 0 && has_motors);
        if is_off && terms.is_finite() && is_seen {
            return Err(format!("the energy is off by {off:e} J of {largest:e} J at t = {} s", sample.t));
        }
        let (worst, name) = auditor.joints(sample);
        if worst.is_nan() || worst > POSITION {
            return Err(format!("{name} is off by {worst:e} at t = {} s", sample.t));
        }
    }
    Ok(())
}
