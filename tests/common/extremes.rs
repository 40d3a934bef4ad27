//! What is asked of random scenes beside a run: sweeps that look for bars that turn over, and estimates of
//! the error.

use super::random::{self, Draw};
use driftless::dynamics::Mechanism;
use driftless::run::trust::{How, Level};
use driftless::run::{
    Limits, Outcome, Plan, Request, Run, Sample, Status, Sweep, SweepPoint, SweepTable, Totals, Vary,
    integrate, sweep,
};
use driftless::scene::{Scene, Template, parse_scene};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Rows of a run that a point of a sweep is compared with.
const ROWS: f64 = 64.0;

/// Every kind of part of a scene, for tables of what was met.
pub fn kinds(scene: &Scene) -> Vec<&'static str> {
    let hung = scene.given.iter().all(|given| given.origin.is_none());
    let rail_on_bar = |on: bool| scene.sliders.iter().any(|slider| slider.rail.place.bar.is_some() == on);
    let grounded = |on: bool| {
        scene
            .springs
            .iter()
            .any(|spring| !spring.rigid && spring.between.iter().any(|place| place.bar.is_none()) == on)
    };
    let relative = |on: bool, list: &[Option<usize>]| list.iter().any(|base| base.is_some() == on);
    let locks: Vec<_> = scene.locks.iter().map(|lock| lock.relative_to).collect();
    let coils: Vec<_> = scene.torsion_springs.iter().map(|coil| coil.relative_to).collect();
    let torques: Vec<_> = scene.torques.iter().map(|torque| torque.relative_to).collect();
    let motors: Vec<_> = scene.motors.iter().map(|motor| motor.relative_to).collect();
    let all = [
        ("floating bodies", !hung),
        ("loops or many hinges", scene.hinges.len() > scene.bars.len()),
        ("sliders on the ground", rail_on_bar(false)),
        ("sliders on bodies", rail_on_bar(true)),
        ("locked sliders", scene.sliders.iter().any(|slider| slider.locked)),
        ("welds", !scene.welds.is_empty()),
        ("locks", relative(false, &locks)),
        ("relative locks", relative(true, &locks)),
        ("springs to the ground", grounded(true)),
        ("springs between bodies", grounded(false)),
        ("springs of no free length", scene.springs.iter().any(|spring| spring.free_length == 0.0)),
        ("dampers", scene.springs.iter().any(|spring| spring.damping > 0.0)),
        ("dampers alone", scene.springs.iter().any(|spring| spring.stiffness == 0.0)),
        ("rigid springs", scene.springs.iter().any(|spring| spring.rigid)),
        ("torsion springs", relative(false, &coils)),
        ("relative torsion springs", relative(true, &coils)),
        ("forces in the ground's frame", scene.forces.iter().any(|force| !force.follows)),
        ("forces in the body's frame", scene.forces.iter().any(|force| force.follows)),
        ("laws of forces", scene.forces.iter().any(|force| force.law.is_some())),
        ("torques", relative(false, &torques)),
        ("relative torques", relative(true, &torques)),
        ("laws of torques", scene.torques.iter().any(|torque| torque.law.is_some())),
        ("motors", relative(false, &motors)),
        ("relative motors", relative(true, &motors)),
        ("motors on sliders", !scene.drives.is_empty()),
        ("walls, plastic", scene.walls.iter().any(|wall| wall.restitution == 0.0)),
        ("walls", scene.walls.iter().any(|wall| wall.restitution > 0.0 && wall.restitution < 1.0)),
        ("walls, elastic", scene.walls.iter().any(|wall| wall.restitution == 1.0)),
    ];
    all.into_iter().filter(|(_, has)| *has).map(|(kind, _)| kind).collect()
}

/// A run of a scene with a look at every row.
fn run(scene: &Scene, request: &Request, level: Level) -> Option<(Vec<Sample>, Outcome)> {
    let mechanism = Arc::new(Mechanism::new(scene).ok()?);
    let plan = Plan::new(scene, &mechanism, request).ok()?;
    let start = mechanism.start(scene);
    let run = Run::new(mechanism, plan, Limits::default(), &start).ok()?;
    let mut samples = Vec::new();
    let outcome = integrate(run.trusted(level, &start), &mut |sample| {
        samples.push(sample.clone());
        Ok(())
    });
    Some((samples, outcome.expect("nobody fails")))
}

/// What became of the points of a sweep.
#[derive(Clone, Copy, Debug, Default)]
pub struct Swept {
    pub points: u64,
    pub done: u64,
    pub flipped: u64,
    /// Points whose flips were compared with the rows of a run.
    pub compared: u64,
}

/// A small sweep over a number of the scene, and each of its points as a run.
///
/// # Panics
/// Where points are missing, or a flip is not what the rows of the run show.
pub fn sweep_of(text: &str, scene: &Scene, draw: &mut Draw, max_evaluations: u64) -> Swept {
    let mut found = Swept::default();
    let template = Template::new(text.to_owned(), "random.json".into(), &[]);
    let bar = &scene.bars[draw.below(scene.bars.len())].name;
    let rate = 8.0 / scene.until;
    let vary = match draw.below(4) {
        0 => Vary { name: format!("start.{bar}.phi"), from: -3.0, to: 3.1, count: 3 },
        1 | 2 => Vary { name: format!("start.{bar}.omega"), from: -rate, to: rate, count: 3 },
        _ => Vary { name: "gravity[1]".into(), from: -10.0, to: 10.0, count: 2 },
    };
    let mut request = random::request(draw, scene.until, max_evaluations);
    if draw.chance(50) {
        (request.method, request.rtol, request.step, request.stabilize, request.time_constant) =
            (None, Some(1e-8), None, None, None);
    }
    request.atol = None;
    let Ok(plan) = Sweep::new(&template, vec![vary], &request) else { return found };
    let plan = if draw.chance(30) { plan.ending_at_flips() } else { plan };
    let mut points: Vec<SweepPoint> = Vec::new();
    let mut table = SweepTable::new(&plan, Vec::new()).expect("room");
    let totals: Totals = sweep(&plan, 1, &mut |point: &SweepPoint| {
        points.push(point.clone());
        Ok(table.write(point)?)
    })
    .expect("nobody fails");
    assert_eq!((points.len() as u64, totals.points()), (plan.grid().count(), plan.grid().count()));
    let rows = String::from_utf8(table.finish().expect("room")).expect("text");
    assert_eq!(rows.lines().count(), points.len() + 1, "a table of {} points: {rows}", points.len());
    for point in &points {
        found.points += 1;
        found.done += u64::from(point.status == Status::Done);
        found.flipped += u64::from(point.flip.is_some());
        let finite =
            [point.t, point.energy].iter().chain(&point.phi).chain(&point.omega).all(|x| x.is_finite());
        if point.status != Status::Done {
            continue;
        }
        assert!(finite, "a point that is done holds what is no number: {point:?}; {request:?}");
        if let Some(flip) = point.flip {
            assert!(
                flip.t >= 0.0 && flip.t <= point.t && flip.bar < scene.bars.len(),
                "a flip out of place: {point:?}; {request:?}"
            );
        }
        found.compared += u64::from(agrees(&template, &plan, point, &request));
    }
    found
}

/// Whether a point's flip could be compared with the rows of a run.
///
/// # Panics
/// Where they do not agree.
fn agrees(template: &Template, plan: &Sweep, point: &SweepPoint, request: &Request) -> bool {
    let Ok(scene) = template.filled(plan.variables(), &point.values) else { return false };
    let every = plan.plan().until / ROWS;
    let request = Request {
        method: Some(plan.plan().method),
        every: Some(every),
        step: plan.plan().step.map(|step| step.min(every)),
        ..request.clone()
    };
    let Some((samples, outcome)) = run(&scene, &request, Level::Off) else { return false };
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return false };
    let is_same =
        |sample: &Sample| (0..scene.bars.len()).all(|k| (sample.phi[k] - point.phi[k]).abs() < 1e-4);
    let is_over = (last.t - point.t).abs() <= 1e-9 * last.t;
    if outcome.stop.is_some() || (is_over && !is_same(last)) {
        return false;
    }
    // Angles so near the boundary that the last digit decides, and those that are there at the start, tell
    // nothing.
    let side = |phi: f64| ((phi + PI) / TAU).floor();
    let is_clear = |phi: f64| (phi + PI - TAU * ((phi + PI) / TAU).round()).abs() > 1e-3 + 1e-12 * phi.abs();
    if (0..scene.bars.len()).any(|k| !is_clear(first.phi[k])) {
        return false;
    }
    for pair in samples.windows(2) {
        let passed = |k: &usize| {
            side(pair[0].phi[*k]) != side(pair[1].phi[*k])
                && is_clear(pair[0].phi[*k])
                && is_clear(pair[1].phi[*k])
        };
        let Some(bar) = (0..scene.bars.len()).find(passed) else { continue };
        // A fixed step may be so long that the motion between its ends is off by a good part of it.
        let slack = if plan.plan().step.is_some() { 2.0 * every } else { 0.0 };
        let latest = pair[1].t * (1.0 + 1e-9) + slack;
        let is_seen = point.flip.is_some_and(|flip| flip.t <= latest);
        assert!(
            is_seen,
            "{} turns over between {} and {} s ({} and {} rad), but the point has {:?}; {:?} {request:?}",
            scene.bars[bar].name,
            pair[0].t,
            pair[1].t,
            pair[0].phi[bar],
            pair[1].phi[bar],
            point.flip,
            point.values
        );
        return true;
    }
    // Nothing passes from row to row; what goes there and back between two comes near at both.
    if let Some(flip) = point.flip.filter(|flip| flip.t < last.t * (1.0 - 1e-9)) {
        let near = |sample: &Sample| {
            (sample.phi[flip.bar] + PI - TAU * ((sample.phi[flip.bar] + PI) / TAU).round()).abs()
        };
        let fastest = samples.iter().fold(0.0, |most: f64, sample| most.max(sample.omega[flip.bar].abs()));
        let around = samples.windows(2).find(|pair| pair[0].t <= flip.t && flip.t <= pair[1].t);
        let distance = around.map_or(0.0, |pair| near(&pair[0]).min(near(&pair[1])));
        assert!(
            distance <= 4.0 * fastest * every + 2e-3,
            "{point:?} flips where the rows are {distance} rad away; {request:?}"
        );
    }
    true
}

/// Whether a run with an estimate of its error has one.
///
/// # Panics
/// Where the run is not the same as without, or what is estimated makes no sense.
pub fn trust_of(scene: &Scene, request: &Request, level: Level) -> Option<bool> {
    let (plain, outcome) = run(scene, request, Level::Off)?;
    let (rows, trusted) = run(scene, request, level)?;
    assert_eq!(outcome.stop, trusted.stop, "{request:?}");
    // Rows may hold what is no number where the run says so and stops.
    if outcome.stop.is_none() {
        let same = |a: &Sample, b: &Sample| a.phi == b.phi && a.omega == b.omega && a.t == b.t;
        assert!(
            plain.len() == rows.len() && plain.iter().zip(&rows).all(|(a, b)| same(a, b)),
            "an estimate changes the run: {request:?}"
        );
    }
    let trust = trusted.trust.expect("an estimate was asked for");
    let end = trusted.last.t;
    let is_finite = |value: Option<f64>| value.is_none_or(|value| value.is_finite() && value >= 0.0);
    assert!(
        is_finite(trust.error_estimate)
            && is_finite(trust.horizon)
            && is_finite(trust.lost)
            && is_finite(trust.input_error),
        "{trust:?}"
    );
    assert!(
        trust.covered <= end * (1.0 + 1e-9) && trust.at <= end * (1.0 + 1e-9),
        "it looks beyond {end} s: {trust:?}"
    );
    assert!(trust.horizon.is_none_or(|horizon| horizon <= end * (1.0 + 1e-9)), "{trust:?}");
    assert!(
        trust.error_estimate.is_some() || trust.why.is_some() || end == 0.0,
        "no estimate and no reason: {trust:?} {request:?}"
    );
    assert!((trust.how == How::None) == trust.error_estimate.is_none(), "{trust:?}");
    assert!(trust.record.iter().all(|[t, error]| t.is_finite() && error.is_finite()), "{trust:?}");
    Some(trust.error_estimate.is_some())
}

/// A scene, and what is asked of it, as a run with little work would take it.
pub fn parsed(text: &str) -> Option<Scene> {
    parse_scene(text, "random.json", &[]).ok()
}
