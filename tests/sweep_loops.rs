//! Sweeps over numbers of mechanisms with closed loops, sliders and motors beside them: against single runs and
//! trigonometry, and with the same bits whoever is beside whom.

use crate::sweep::points;
use driftless::run::trust::Level;
use driftless::run::{Request, Shard, Status, Sweep, SweepPoint, Vary, simulate};
use driftless::scene::{Template, parse_scene};
use driftless::stepping::taylor::batch::Batch;

pub fn shipped(name: &str) -> Template {
    Template::read(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a shipped scene")
}

pub fn by_taylor(until: f64, rtol: f64) -> Request {
    Request {
        method: Some("taylor".parse().expect("a method")),
        until: Some(until),
        every: Some(0.5 * until),
        rtol: Some(rtol),
        ..Request::default()
    }
}

pub fn planned(template: &Template, vary: &[&str], request: &Request) -> Sweep {
    let vary: Vec<Vary> = vary.iter().map(|vary| vary.parse().expect("a range")).collect();
    let plan = Sweep::new(template, vary, request).expect("a sweep");
    assert!(Batch::takes_alike(plan.mechanism()));
    plan
}

/// A crank turned by a motor, its rod's end on a rail with an offset, a damped spring between end and ground.
fn slider_crank() -> Template {
    let text = r#"{"name": "pump", "gravity": [0, -9.81],
        "bars": [{"name": "crank", "mass": 1, "centre": [0.05, 0], "inertia": 0.01, "length": 0.1},
            {"name": "rod", "mass": 0.5, "centre": [0.2, 0], "inertia": 0.01, "length": 0.4}],
        "hinges": [
            {"name": "A", "between": [{"body": "ground", "point": [0, 0]}, {"body": "crank", "point": [0, 0]}]},
            {"name": "B", "between": [{"body": "crank", "point": [0.1, 0]}, {"body": "rod", "point": [0, 0]}]}],
        "sliders": [{"name": "S", "point": {"body": "rod", "point": [0.4, 0]},
            "rail": {"body": "ground", "point": [0, 0.02], "direction": [1, 0]}}],
        "springs": [{"name": "s", "between": [{"body": "rod", "point": [0.4, 0]},
            {"body": "ground", "point": [0.8, 0.02]}], "stiffness": 50, "free_length": 0.3, "damping": 2}],
        "motors": [{"name": "motor", "body": "crank", "law": {"start": 1, "rate": 6}}],
        "start": {"rod": {"phi": -0.2}}, "until": 2, "every": 0.5}"#;
    Template::new(text.into(), "pump".into(), &[])
}

/// Through singular positions too, where points go alone and come back.
#[test]
fn points_of_loops_agree_with_single_runs() {
    for (template, vary, until, near) in [
        (shipped("andrews"), vec!["springs.spring.stiffness=4000..5000:11"], 0.01, 1e-8),
        (shipped("four_bar_motor"), vec!["motors.motor.law.rate=5..7:11"], 0.7, 1e-8),
        (shipped("four_bar_motor"), vec!["hinges.B.between[0].point[0]=0.88..0.92:11"], 0.7, 1e-8),
        (shipped("quick_return"), vec!["bars.ram.mass=1..3:3", "rocker.phi=1.18..1.2:3"], 0.7, 1e-8),
        (slider_crank(), vec!["hinges.B.between[0].point[0]=0.08..0.12:11"], 1.5, 1e-8),
        (slider_crank(), vec!["springs.s.stiffness=10..90:3", "springs.s.damping=1..3:3"], 1.5, 1e-8),
        (shipped("kite"), vec!["bars.coupler.mass=0.5..1.5:11"], 1.0, 1e-6),
        (shipped("kite"), vec!["gravity[1]=-10.5..-9.5:2", "crank.omega=7..8:9"], 1.0, 1e-6),
        (shipped("four_bars"), vec!["bars.C0.mass=0.9..1.1:9"], 3.0, 1e-6),
    ] {
        let request = by_taylor(until, 1e-12);
        let plan = planned(&template, &vary, &request);
        let (mut are_others, mut compared) = (false, 0);
        for point in points(&plan, 1) {
            let alone = template.filled(plan.variables(), &point.values).expect("a scene");
            let outcome = simulate(&alone, &request, &mut |_| Ok(())).expect("a run");
            assert_eq!((&point.status, point.t), (&Status::Done, until), "{vary:?}");
            let fastest = point.omega.iter().fold(1.0, |most: f64, omega| most.max(omega.abs()));
            let [position, rate] = point.constraint.expect("constraints");
            assert!(position < 1e-15 && rate < 1e-14 * fastest, "{vary:?}: {point:?}");
            assert!(point.energy < 1e-9, "{vary:?}: {point:?}");
            are_others |= (point.steps, point.energy) != (outcome.statistics.steps, outcome.drift.energy.max);
            are_others |= (&point.phi, &point.omega) != (&outcome.last.phi, &outcome.last.omega);
            // A single run may lose energy as it passes a singular position, and says so.
            if outcome.drift.energy.max > 1e-9 {
                continue;
            }
            compared += 1;
            for (found, exact) in point.phi.iter().zip(&outcome.last.phi) {
                assert!((found - exact).abs() < near, "{vary:?}: {point:?} {outcome:?}");
            }
            for (found, exact) in point.omega.iter().zip(&outcome.last.omega) {
                assert!((found - exact).abs() < near * fastest, "{vary:?}: {point:?} {outcome:?}");
            }
        }
        // Points that run one by one have the bits and the steps of the single run.
        assert!(are_others && 2 * compared >= plan.count(), "{vary:?}: {compared}");
    }
}

/// The points of a sweep, which are the same alone, with others beside, in another order, in parts and on threads.
pub fn same_whoever_is_beside(template: &Template, vary: &str, request: &Request) -> Vec<SweepPoint> {
    let plan = planned(template, &[vary], request);
    let whole = points(&plan, 1);
    assert!(whole.iter().all(|point| point.status == Status::Done), "{vary}");
    assert_eq!(points(&plan, 3), whole);
    for point in whole.iter().step_by(5) {
        assert_eq!(plan.point(point.index).as_ref(), Some(point), "{vary}");
    }
    let shards =
        (1..=3).flat_map(|i| points(&planned(template, &[vary], request).sharded(Shard::new(i, 3)), 1));
    assert_eq!(shards.collect::<Vec<_>>(), whole);
    let names = [vary.split('=').next().expect("a name").to_owned()];
    let backwards = whole.iter().rev().flat_map(|point| point.values.clone()).collect();
    let listed = Sweep::listed(template, &names, backwards, request).expect("a list");
    for (point, other) in points(&listed, 1).iter().rev().zip(&whole) {
        assert_eq!((&point.phi, &point.omega, point.steps), (&other.phi, &other.omega, other.steps));
    }
    whole
}

#[test]
fn neighbours_make_no_difference_to_points_of_loops() {
    for (scene, vary, until) in [
        ("andrews", "springs.spring.stiffness=4000..5000:29", 0.02),
        ("four_bar_motor", "motors.motor.law.rate=5..7:29", 1.0),
        // Through singular positions, and of one point with another structure.
        ("kite", "bars.coupler.mass=0.5..1.5:29", 2.0),
        ("kite", "gravity[1]=-14..14:29", 1.0),
    ] {
        same_whoever_is_beside(&shipped(scene), vary, &by_taylor(until, 1e-9));
    }
}

/// Where two circles meet: the angles of coupler and rocker of a four-bar with crank and base.
#[test]
fn a_driven_four_bar_is_where_trigonometry_has_it() {
    let template = shipped("four_bar_motor");
    let vary = ["motors.motor.law.rate=5..7:4", "hinges.B.between[0].point[0]=0.88..0.92:4"];
    for point in points(&planned(&template, &vary, &by_taylor(3.0, 1e-11)), 1) {
        let [rate, coupler] = [point.values[0], point.values[1]];
        let crank = std::f64::consts::FRAC_PI_2 + 3.0 * rate;
        let (x, y, rocker) = (0.3 * crank.cos(), 0.3 * crank.sin(), 0.7);
        let (dx, dy) = (1.0 - x, -y);
        let square = dx * dx + dy * dy;
        let inner = (square + coupler * coupler - rocker * rocker) / (2.0 * coupler * square.sqrt());
        let angle = dy.atan2(dx) + inner.acos();
        let (end_x, end_y) = (x + coupler * angle.cos(), y + coupler * angle.sin());
        let other = end_y.atan2(end_x - 1.0);
        // Both ends of the coupler have one velocity along it.
        let other_rate = 0.3 * rate * (angle - crank).sin() / (rocker * (angle - other).sin());
        for (found, exact) in point.phi.iter().zip([crank, angle, other]) {
            let off = (found - exact) / std::f64::consts::TAU;
            assert!((off - off.round()).abs() < 1e-13, "{point:?}: {exact}");
        }
        assert!((point.phi[0] - crank).abs() < 1e-13, "{point:?}");
        assert!((point.omega[2] - other_rate).abs() < 1e-12, "{point:?}: {other_rate}");
    }
}

/// The second sweep, at a hundredth of the tolerance, changes no point and knows its error.
#[test]
fn points_of_loops_are_judged_in_lanes() {
    let (template, vary) = (shipped("andrews"), ["springs.spring.stiffness=4000..5000:9"]);
    let request = by_taylor(0.02, 1e-7);
    let bare = points(&planned(&template, &vary, &request), 1);
    let fine = points(&planned(&template, &vary, &by_taylor(0.02, 1e-12)), 1);
    let judged = points(&planned(&template, &vary, &request).trusted(Level::Auto), 1);
    for (mut point, (bare, fine)) in judged.into_iter().zip(bare.into_iter().zip(fine)) {
        let trust = point.trust.take().expect("asked for");
        assert_eq!(point, bare);
        let off = point.phi.iter().zip(&fine.phi).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        let error = trust.error.expect("a figure");
        assert!(off < error && error < 1e-5 && trust.horizon.is_none(), "{trust:?} for {off:e}");
    }
}

/// Output times anywhere near the singular positions of two parallelograms, whose bars move as one pendulum:
/// three bars about their ends, and two that are carried along.
#[test]
fn output_times_close_to_singular_positions_leave_a_point_where_it_is() {
    let gravity = -8.994_237_499_999_999;
    let vary = format!("gravity[1]={gravity}..{gravity}:1");
    let one = format!(
        r#"{{"name": "one", "gravity": [0, {gravity}],
        "start": {{"bar": {{"phi": 1.5707963267948966, "omega": -1}}}},
        "bars": [{{"name": "bar", "mass": 7, "centre": [0.5, 0], "inertia": 1.25, "length": 1}}],
        "hinges": [{{"name": "O", "between": [{{"body": "ground", "point": [0, 0]}},
            {{"body": "bar", "point": [0, 0]}}]}}], "until": 4, "every": 4}}"#
    );
    let scene = parse_scene(&one, "one", &[]).expect("a scene");
    let pendulum = simulate(&scene, &by_taylor(4.0, 1e-13), &mut |_| Ok(())).expect("a run").last;
    for every in [0.038_443_589_005_354_02, 0.057, 0.13] {
        let request = Request { every: Some(every), ..by_taylor(4.0, 1e-9) };
        let plan = planned(&shipped("four_bars"), &[&vary], &request).trusted(Level::Auto);
        let point = &points(&plan, 1)[0];
        assert_eq!(point.status, Status::Done, "{every}: {point:?}");
        let off = (point.phi[0] - pendulum.phi[0]).abs();
        let estimate = point.trust.as_ref().and_then(|trust| trust.error).expect("an estimate");
        assert!(off < 3e-8 && point.energy < 1e-8, "{every}: off by {off:.1e} rad, {point:?}");
        assert!(estimate < 3e-8, "{every}: {estimate:.1e}");
    }
}
