//! Whole runs of random scenes of every kind against runs of scenes that describe the same motion otherwise:
//! other order, names and ends of joints, mirrored, turned, shifted, in other units, other frames of bodies,
//! back in time, a body cut in two and welded; a part of them with dry friction in hinges.
//!
//! `METAMORPHIC=2000 cargo test --test physics -- metamorphic:: --nocapture` runs more scenes per relation;
//! `SEED` is the first, and `FOUND` names a folder for the scenes of faults.

use crate::mechanisms;
use crate::relations;

use driftless::dynamics::Mechanism;
use driftless::run::trust::Level;
use driftless::run::{
    ImpactRecord, Limits, METHODS, MethodId, Outcome, Plan, Request, Run, Sample, integrate,
};
use driftless::scene::{Scene, parse_scene};
use mechanisms::{Dice, Generated, Kind, Scales};
use relations::{Back, Related};
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Scenes for each relation where nobody says how many.
const USUAL: u64 = 84;
/// Evaluations allowed to a run.
const MAX_EVALUATIONS: u64 = 400_000;
/// Agreement that is asked for in any case: of angles \[rad\], and of places over the scene's length.
const AGREEMENT: f64 = 1e-6;
/// How much more rates, and forces and torques, may differ, over their natural scales.
const RATES: f64 = 10.0;
const FORCES: f64 = 100.0;
/// Approaches slower than this share of the natural speed are left out where impacts are compared one by one.
const SLOW: f64 = 1e-2;

/// A run and what it saw.
struct Seen {
    mechanism: Arc<Mechanism>,
    samples: Vec<Sample>,
    outcome: Outcome,
}

/// Runs a scene; else the reason why there is no run.
fn run(scene: &Scene, request: &Request, level: Level) -> Result<Seen, String> {
    let mechanism = Arc::new(Mechanism::new(scene).map_err(|error| error.to_string())?);
    let plan = Plan::new(scene, &mechanism, request).map_err(|refusal| refusal.to_string())?;
    let start = mechanism.start(scene);
    let run =
        Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).map_err(|stop| stop.to_string())?;
    let mut samples = Vec::new();
    let outcome = integrate(run.trusted(level, &start), &mut |sample| {
        samples.push(sample.clone());
        Ok(())
    });
    Ok(Seen { mechanism, samples, outcome: outcome.expect("no observer fails") })
}

/// What is asked of a method in a scene of these scales; the same to rounding in other units.
fn request(method: MethodId, scene: &Scene) -> Request {
    let mut request =
        Request { method: Some(method), max_evaluations: Some(MAX_EVALUATIONS), ..Request::default() };
    match method {
        MethodId::Dp5 | MethodId::Dopri5 | MethodId::Radau(3) => request.rtol = Some(1e-8),
        _ if method.is_adaptive() => request.rtol = Some(1e-10),
        _ => {
            request.every = Some(scene.every);
            request.step = Some(scene.every / 8.0);
        }
    }
    request
}

/// How far two runs are apart, in units of what is allowed, and where.
struct Apart {
    most: f64,
    what: String,
}

impl Apart {
    fn see(&mut self, off: f64, what: impl FnOnce() -> String) {
        if off.is_nan() || off > self.most {
            (self.most, self.what) = (if off.is_nan() { f64::INFINITY } else { off }, what());
        }
    }
}

/// The claimed error of a run.
fn claimed(seen: &Seen) -> Option<f64> {
    seen.outcome.trust.as_ref().and_then(|trust| trust.error_estimate)
}

/// The rows of constraints that motors stand for, with whether they are on angles.
fn motors(scene: &Scene, mechanism: &Mechanism) -> Vec<(String, usize, bool)> {
    let angles = scene.motors.iter().map(|motor| (motor.name.clone(), true));
    let named = angles.chain(scene.drives.iter().map(|drive| (drive.name.clone(), false)));
    named
        .filter_map(|(name, is_angle)| {
            let row = mechanism.constraints.iter().position(|row| row.name() == name)?;
            Some((name, row, is_angle))
        })
        .collect()
}

/// Compares two runs of one motion.
fn compare(scene: &Scene, scales: &Scales, first: &Seen, second: &Seen, related: &Related) -> Apart {
    let back = &related.back;
    let mut apart = Apart { most: 0.0, what: String::new() };
    let allowed =
        AGREEMENT.max(10.0 * claimed(first).unwrap_or(0.0)).max(10.0 * claimed(second).unwrap_or(0.0));
    let strikes: Vec<f64> = first.outcome.impacts.iter().map(|strike| strike.t).collect();
    let driven = motors(scene, &first.mechanism);
    let others = motors(&related.scene, &second.mechanism);
    let size = |values: &mut dyn Iterator<Item = f64>, least: f64| {
        values.fold(least, |most, value| most.max(value.abs()))
    };
    let fastest =
        size(&mut first.samples.iter().flat_map(|sample| sample.omega.iter().copied()), 1.0 / scales.time);
    let speed = size(
        &mut first.samples.iter().flat_map(|sample| sample.velocity.iter().flatten().copied()),
        scales.length / scales.time,
    );
    let energy = size(&mut first.samples.iter().map(|sample| sample.kinetic), scales.force * scales.length)
        .max(size(&mut first.samples.iter().map(|sample| sample.work), 0.0));
    for (a, b) in first.samples.iter().zip(&second.samples) {
        let t = a.t;
        apart.see((b.t / back.time - t).abs() / scales.time / 1e-9, || format!("time of the row at {t} s"));
        // Where one is before an impact and the other after it nothing is compared.
        if strikes.iter().any(|strike| (strike - t).abs() < 1e-5 * scales.time && *strike > 0.0) {
            continue;
        }
        for k in 0..scene.bars.len() {
            let name = &scene.bars[k].name;
            let [phi, omega] = back.angle(k, b);
            apart.see((phi - a.phi[k]).abs() / allowed, || {
                format!("angle of {name}: {} and {phi} rad at {t} s", a.phi[k])
            });
            let off = (omega - a.omega[k]).abs() / fastest / (RATES * allowed);
            apart.see(off, || format!("rate of {name}: {} and {omega} rad/s at {t} s", a.omega[k]));
            let [centre, velocity] = back.centre(k, b);
            for i in 0..2 {
                let off = (centre[i] - a.centre[k][i]).abs() / scales.length / allowed;
                apart.see(off, || format!("centre of {name}: {:?} and {centre:?} m at {t} s", a.centre[k]));
                let off = (velocity[i] - a.velocity[k][i]).abs() / speed / (RATES * allowed);
                apart.see(off, || {
                    format!("velocity of {name}: {:?} and {velocity:?} m/s at {t} s", a.velocity[k])
                });
            }
        }
        let [kinetic, work] = [b.kinetic, b.work].map(|energy| energy / back.energy());
        apart.see((kinetic - a.kinetic).abs() / energy / (RATES * allowed), || {
            format!("kinetic energy: {} and {kinetic} J at {t} s", a.kinetic)
        });
        apart.see((work - a.work).abs() / energy / (RATES * allowed), || {
            format!("work: {} and {work} J at {t} s", a.work)
        });
        for (name, row, is_angle) in &driven {
            let Some((_, other, _)) = others.iter().find(|(other, _, _)| other == name) else { continue };
            let units = back.of_motor(*is_angle);
            for i in 0..2 {
                let value = b.motors[*other][i] / units[i];
                let natural = [
                    if *is_angle { scales.force * scales.length } else { scales.force },
                    scales.force * scales.length / scales.time,
                ][i];
                let scale = size(&mut first.samples.iter().map(|sample| sample.motors[*row][i]), natural);
                let off = (value - a.motors[*row][i]).abs() / scale / (FORCES * allowed);
                let what = ["torque or force", "power"][i];
                apart.see(off, || format!("{what} of {name}: {} and {value} at {t} s", a.motors[*row][i]));
            }
        }
    }
    impacts(
        scales,
        [&first.outcome.impacts, &second.outcome.impacts],
        back,
        allowed,
        first.outcome.plan.until,
        &mut apart,
    );
    apart
}

/// Compares impacts, as far as the points come fast.
fn impacts(
    scales: &Scales,
    [first, second]: [&[ImpactRecord]; 2],
    back: &Back,
    allowed: f64,
    until: f64,
    apart: &mut Apart,
) {
    let speed = scales.length / scales.time;
    let fast = |strikes: &[ImpactRecord], [mass, length, time]: [f64; 3]| -> Vec<ImpactRecord> {
        let in_units = |strike: &ImpactRecord| ImpactRecord {
            friction_impulse: strike.friction_impulse / (mass * length / time),
            t: strike.t / time,
            wall: strike.wall.clone(),
            impulse: strike.impulse / (mass * length / time),
            approach: strike.approach / (length / time),
            energy_lost: strike.energy_lost / (mass * length * length / (time * time)),
        };
        strikes.iter().map(in_units).filter(|strike| strike.approach.abs() > SLOW * speed).collect()
    };
    let (first, second) = (fast(first, [1.0; 3]), fast(second, [back.mass, back.length, back.time]));
    let is_near_end = |strike: &ImpactRecord| until - strike.t < 1e-5 * scales.time;
    if first.len() != second.len() && !first.iter().chain(&second).any(is_near_end) {
        let times = |strikes: &[ImpactRecord]| {
            strikes.iter().map(|strike| (strike.t, strike.approach)).collect::<Vec<_>>()
        };
        apart.see(f64::INFINITY, || format!("impacts: {:?} and {:?}", times(&first), times(&second)));
        return;
    }
    for (a, b) in first.iter().zip(&second) {
        let path = (a.t - b.t).abs() * a.approach.abs().min(speed);
        apart.see(path / scales.length / (RATES * allowed), || format!("impact at {} and {} s", a.t, b.t));
        let momentum = scales.mass * speed + a.impulse.abs();
        let off = (a.impulse - b.impulse).abs() / momentum / (FORCES * allowed);
        apart.see(off, || format!("impulse of {}: {} and {} N·s at {} s", a.wall, a.impulse, b.impulse, a.t));
        let energy = scales.mass * speed * speed + a.energy_lost.abs();
        let off = (a.energy_lost - b.energy_lost).abs() / energy / (FORCES * allowed);
        apart.see(off, || {
            format!("energy lost at {}: {} and {} J at {} s", a.wall, a.energy_lost, b.energy_lost, a.t)
        });
    }
}

/// A relation, and what it came to.
struct Account {
    name: &'static str,
    /// Pairs of runs compared, stopped alike, refused alike, and those that say more of the motion than of
    /// the program.
    compared: u64,
    stopped: u64,
    stops: BTreeMap<String, u64>,
    refused: u64,
    sensitive: u64,
    by_method: BTreeMap<&'static str, u64>,
    by_kind: BTreeMap<Kind, u64>,
    with_impacts: u64,
    faults: Vec<String>,
    /// Of the two runs only one says that it stopped: no wrong motion, but rounding should not decide that.
    lone_stops: Vec<String>,
}

impl Account {
    /// Takes a fault down.
    fn fault(&mut self, made: &Generated, method: MethodId, scenes: [&Scene; 2], what: &str) {
        let fault = self.noted(made, method, scenes, what);
        self.faults.push(fault);
    }

    /// Takes a stop of one of the two runs down.
    fn lone_stop(&mut self, made: &Generated, method: MethodId, scenes: [&Scene; 2], what: &str) {
        let stop = self.noted(made, method, scenes, what);
        self.lone_stops.push(stop);
    }

    /// In one line; the two scenes, as files, go where `FOUND` says.
    fn noted(&self, made: &Generated, method: MethodId, scenes: [&Scene; 2], what: &str) -> String {
        if let Some(folder) = std::env::var_os("FOUND") {
            let scenes = scenes.map(Scene::to_input);
            let found = json!({"what": what, "relation": self.name, "method": method.info().name, "scene": scenes[0], "related": scenes[1]});
            let file = std::path::Path::new(&folder).join(format!(
                "{}-{}.json",
                self.name.replace(' ', "-"),
                made.seed
            ));
            std::fs::write(file, format!("{found:#}\n")).expect("a folder for what is found");
        }
        format!("seed {} by {method} ({:?}): {}", made.seed, made.kinds, what.replace('\n', " "))
    }

    fn tell(&self) {
        let Self { name, compared, stopped, refused, sensitive, with_impacts, .. } = self;
        println!(
            "{name}: {compared} pairs of runs compared, {with_impacts} with impacts; {stopped} stopped alike, {refused} refused alike, \
             {sensitive} too sensitive"
        );
        println!("  stops: {:?}", self.stops);
        println!("  methods: {:?}", self.by_method);
        let kinds: Vec<String> =
            self.by_kind.iter().map(|(kind, count)| format!("{} {count}", kind.name())).collect();
        println!("  kinds: {}", kinds.join(", "));
        self.lone_stops.iter().for_each(|stop| println!("  ALONE {stop}"));
        self.faults.iter().for_each(|fault| println!("  FAULT {fault}"));
    }
}

/// True where a start that differs by 1e-9 of its rates leads so far away that what was seen says nothing.
fn is_sensitive(scene: &Scene, scales: &Scales, request: &Request, seen: &Seen, most: f64) -> bool {
    const NUDGE: f64 = 1e-10;
    let mut nudged = scene.clone();
    for (start, given) in nudged.start.iter_mut().zip(&mut nudged.given) {
        start.omega *= 1.0 + NUDGE;
        given.velocity.iter_mut().flatten().for_each(|v| *v *= 1.0 + NUDGE);
    }
    for start in nudged.start.iter_mut().skip(nudged.given.len()) {
        start.omega *= 1.0 + NUDGE;
    }
    nudged.gravity.iter_mut().for_each(|g| *g *= 1.0 + NUDGE);
    let Ok(other) = run(&nudged, request, Level::Off) else { return false };
    let same = relations::shifted(scene, [0.0; 2]);
    10.0 * compare(scene, scales, seen, &other, &same).most > most
}

/// A relation on one scene with one method.
fn once(made: &Generated, scene: &Scene, related: &Related, method: MethodId, account: &mut Account) {
    let asked = request(method, scene);
    let mut asked_related = request(method, &related.scene);
    if let Some(step) = &mut asked_related.step {
        // Rounding of the units must not change the number of steps.
        *step *= 1.0 + 1e-12;
    }
    let (first, second) = (run(scene, &asked, Level::Auto), run(&related.scene, &asked_related, Level::Auto));
    let scenes = [scene, &related.scene];
    let (first, second) = match (first, second) {
        (Ok(first), Ok(second)) => (first, second),
        (Err(_), Err(_)) => {
            account.refused += 1;
            return;
        }
        (Err(refusal), Ok(_)) | (Ok(_), Err(refusal)) => {
            // A weld more is one that a method may not take.
            if related.scene.welds.len() == scene.welds.len() {
                let refusal = refusal.lines().next().unwrap_or_default();
                account.fault(made, method, scenes, &format!("only one of the two is refused: {refusal}"));
            }
            account.refused += 1;
            return;
        }
    };
    match (&first.outcome.stop, &second.outcome.stop) {
        (None, None) => {}
        (Some(stop), Some(_)) => {
            account.stopped += 1;
            let what = stop.what.split(|letter: char| letter.is_ascii_digit()).next().unwrap_or_default();
            *account.stops.entry(format!("{}: {what}", stop.cause.word())).or_default() += 1;
            return;
        }
        (Some(stop), None) | (None, Some(stop)) => {
            account.lone_stop(made, method, scenes, &format!("only one of the two stops: {stop}"));
            return;
        }
    }
    if claimed(&first).is_some_and(|error| error > 1e-3) {
        account.sensitive += 1;
        return;
    }
    let apart = compare(scene, &made.scales, &first, &second, related);
    if apart.most > 1.0 {
        if is_sensitive(scene, &made.scales, &asked, &first, apart.most) {
            account.sensitive += 1;
            return;
        }
        account.fault(made, method, scenes, &format!("{} times too far apart: {}", apart.most, apart.what));
    }
    account.compared += 1;
    account.with_impacts += u64::from(first.outcome.impact_count > 0);
    *account.by_method.entry(method.info().name).or_default() += 1;
    made.kinds.iter().for_each(|&kind| *account.by_kind.entry(kind).or_default() += 1);
}

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// Scenes whose seeds begin at a relation's own, each with the next method that takes it.
fn on_random_scenes(
    name: &'static str,
    relation: u64,
    mut relate: impl FnMut(&Generated, &Scene, &mut Dice, MethodId, &mut Account),
) {
    let (count, seed) = (number("METAMORPHIC", USUAL), number("SEED", 1));
    let mut account = Account {
        name,
        compared: 0,
        stopped: 0,
        stops: BTreeMap::new(),
        refused: 0,
        sensitive: 0,
        by_method: BTreeMap::new(),
        by_kind: BTreeMap::new(),
        with_impacts: 0,
        faults: Vec::new(),
        lone_stops: Vec::new(),
    };
    for index in 0..count {
        let seed = seed.wrapping_mul(1_000_003).wrapping_add(relation * 100_000_007).wrapping_add(index);
        let made = mechanisms::scene(seed);
        let mut scene = parse_scene(&made.text, "random.json", &[])
            .unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let mut frictions = Dice::new(seed ^ 0x00f1_1c00);
        if frictions.chance(0.25) {
            relations::with_friction(&mut scene, &mut frictions, made.scales.length);
        }
        let mut dice = Dice::new(seed ^ 0x00d1_ce00);
        let walls: Vec<MethodId> = METHODS.iter().map(|info| info.id).filter(|id| takes_walls(*id)).collect();
        let all: Vec<MethodId> = METHODS.iter().map(|info| info.id).collect();
        let damped = scene.springs.iter().any(|spring| spring.damping > 0.0)
            || scene.torsion_springs.iter().any(|coil| coil.damping > 0.0);
        let undamped: Vec<MethodId> =
            all.iter().copied().filter(|id| !matches!(id, MethodId::Rattle(_))).collect();
        let of = if !scene.walls.is_empty() || !scene.frictions.is_empty() {
            &walls
        } else if damped {
            &undamped
        } else {
            &all
        };
        let method = dice.one(of);
        relate(&made, &scene, &mut dice, method, &mut account);
    }
    account.tell();
    let Account { faults, lone_stops, compared, .. } = account;
    assert!(
        faults.is_empty(),
        "{name}: {} faults in {compared} pairs, of which\n{}",
        faults.len(),
        faults[..faults.len().min(6)].join("\n")
    );
    assert!(
        lone_stops.len() as u64 <= 1 + compared / 100,
        "{name}: of {compared} pairs one run stops and the other does not: {lone_stops:#?}"
    );
    assert!(count < 100 || compared > count / 4);
}

fn takes_walls(method: MethodId) -> bool {
    matches!(method, MethodId::Dp5 | MethodId::Dp8 | MethodId::Taylor | MethodId::Radau(_))
}

#[test]
fn the_order_of_bodies_does_not_matter() {
    on_random_scenes("order", 1, |made, scene, dice, method, account| {
        once(made, scene, &relations::reordered(scene, dice), method, account);
    });
}

#[test]
fn names_do_not_matter_to_the_last_bit() {
    on_random_scenes("names", 2, |made, scene, _, method, account| {
        let related = relations::renamed(scene);
        let (first, second) = (
            run(scene, &request(method, scene), Level::Off),
            run(&related.scene, &request(method, scene), Level::Off),
        );
        if let (Ok(first), Ok(second)) = (&first, &second)
            && (!first
                .samples
                .iter()
                .zip(&second.samples)
                .all(|(a, b)| a.phi == b.phi && a.omega == b.omega && a.motors == b.motors)
                || first.samples.len() != second.samples.len())
        {
            account.fault(made, method, [scene, &related.scene], "other numbers by other names");
        }
        once(made, scene, &related, method, account);
    });
}

#[test]
fn the_ends_of_joints_may_be_exchanged() {
    on_random_scenes("swapped ends", 3, |made, scene, _, method, account| {
        once(made, scene, &relations::swapped(scene), method, account);
    });
}

#[test]
fn a_mirrored_scene_has_the_mirrored_motion() {
    on_random_scenes("mirrored", 4, |made, scene, _, method, account| {
        once(made, scene, &relations::mirrored(scene), method, account);
    });
}

#[test]
fn a_turned_scene_has_the_turned_motion() {
    on_random_scenes("turned", 5, |made, scene, dice, method, account| {
        once(made, scene, &relations::turned(scene, dice.within(-3.0, 3.0)), method, account);
    });
}

#[test]
fn a_shifted_scene_has_the_shifted_motion() {
    on_random_scenes("shifted", 6, |made, scene, dice, method, account| {
        let shift = [0, 1].map(|_| made.scales.length * dice.signed(0.5, 20.0));
        once(made, scene, &relations::shifted(scene, shift), method, account);
    });
}

#[test]
fn the_frames_of_bodies_do_not_matter() {
    on_random_scenes("reframed", 10, |made, scene, dice, method, account| {
        once(made, scene, &relations::reframed(scene, dice, made.scales.length), method, account);
    });
}

#[test]
fn units_do_not_matter() {
    on_random_scenes("units", 7, |made, scene, dice, method, account| {
        let units = [0, 1, 2].map(|_| dice.one(&[1e-6, 1e-3, 1.0, 1.0, 1e3, 1e6]));
        once(made, scene, &relations::scaled(scene, units), method, account);
    });
}

#[test]
fn a_body_cut_in_two_and_welded_moves_as_before() {
    on_random_scenes("cut and welded", 8, |made, scene, dice, method, account| {
        if let Some(related) = relations::split(scene, dice) {
            once(made, scene, &related, method, account);
        }
    });
}

/// Without dampers and losses the way back leads to where the run began.
#[test]
fn a_run_goes_back_to_its_start() {
    on_random_scenes("back in time", 9, |made, scene, _, method, account| {
        if !relations::is_reversible(scene) {
            return;
        }
        let asked = request(method, scene);
        let Ok(there) = run(scene, &asked, Level::Auto) else { return };
        let Some(end) = there.samples.last().filter(|_| there.outcome.stop.is_none()) else { return };
        // A point that rests on its wall has lost what it would need to leave it.
        if there.outcome.persistent_contact_count > 0 || claimed(&there).is_some_and(|error| error > 1e-6) {
            return;
        }
        let reversed = relations::backwards(scene, end);
        let scenes = [scene, &reversed];
        let back = match run(&reversed, &asked, Level::Auto) {
            Ok(back) if back.outcome.stop.is_none() => back,
            Ok(back) => {
                let stop = back.outcome.stop.map(|stop| stop.to_string()).unwrap_or_default();
                return account.lone_stop(made, method, scenes, &format!("stops on the way back: {stop}"));
            }
            // What a method without projection leaves of a rod's length is a vibration on the way back.
            Err(_) if scene.springs.iter().any(|spring| spring.rigid) => {
                account.refused += 1;
                return;
            }
            Err(refusal) => {
                return account.fault(made, method, scenes, &format!("cannot go back: {refusal}"));
            }
        };
        let (Some(first), Some(last)) = (there.samples.first(), back.samples.last()) else { return };
        let allowed =
            AGREEMENT.max(10.0 * claimed(&there).unwrap_or(0.0)).max(10.0 * claimed(&back).unwrap_or(0.0));
        let off = (0..scene.bars.len()).fold(0.0, |most: f64, k| {
            let way = [0, 1].map(|i| first.centre[k][i] - last.centre[k][i]);
            most.max((first.phi[k] - last.phi[k]).abs()).max(way[0].hypot(way[1]) / made.scales.length)
        });
        // Impacts at the start are not undone by those at the end, which the way back does not reach.
        let touched = there
            .outcome
            .impacts
            .iter()
            .chain(&back.outcome.impacts)
            .any(|strike| strike.t < 1e-6 * made.scales.time);
        if !(off <= allowed || touched) {
            let here = relations::shifted(scene, [0.0; 2]);
            let apart = compare(scene, &made.scales, &there, &there, &here);
            if is_sensitive(scene, &made.scales, &asked, &there, apart.most.max(off / allowed)) {
                account.sensitive += 1;
                return;
            }
            account.fault(made, method, scenes, &format!("comes back {off:e} away, {allowed:e} are allowed"));
        }
        account.compared += 1;
        account.with_impacts += u64::from(there.outcome.impact_count > 0);
        *account.by_method.entry(method.info().name).or_default() += 1;
        made.kinds.iter().for_each(|&kind| *account.by_kind.entry(kind).or_default() += 1);
    });
}
