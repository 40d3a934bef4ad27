//! Many trajectories in lanes: against double-double one by one, and independent of who integrates beside
//! whom.

use crate::common;

use common::{compile, shipped};
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::{Form, Mechanism, State, Time};
use driftless::run::Problem;
use driftless::scene::{Scene, parse_scene};
use driftless::stepping::taylor::ExpansionKernel;
use driftless::stepping::taylor::batch::{Batch, BatchMember, Going};
use driftless::stepping::{Cause, Integrator, Seen, Taylor, Tolerance};
use std::sync::Arc;

/// A chain of unequal bars, the first one's angle at the start moved by `shift` \[rad\].
fn chain(bars: usize, shift: f64) -> Scene {
    parse_scene(&chain_text(bars, shift), "chain", &[]).expect("a scene")
}

/// Its scene file.
fn chain_text(bars: usize, shift: f64) -> String {
    let list = |item: &dyn Fn(usize) -> String| (0..bars).map(item).collect::<Vec<_>>().join(",");
    let bar = |i: usize| {
        format!(
            r#"{{"name":"b{i}","length":{},"width":0.05,"thickness":0.003,"density":670}}"#,
            0.4 + 0.1 * i as f64
        )
    };
    let hinge = |i: usize| {
        let near = if i == 0 {
            r#"{"body":"ground","point":[0,0]}"#.to_string()
        } else {
            format!(r#"{{"body":"b{}","point":[{},0]}}"#, i - 1, 0.3 + 0.1 * i as f64)
        };
        format!(r#"{{"name":"h{i}","between":[{near},{{"body":"b{i}","point":[0,0]}}]}}"#)
    };
    let start = |i: usize| {
        format!(
            r#""b{i}":{{"phi":{},"omega":{}}}"#,
            1.5 - 0.3 * i as f64 + if i == 0 { shift } else { 0.0 },
            0.2 * i as f64
        )
    };
    format!(
        r#"{{"name":"chain","gravity":[9.81,0],"bars":[{}],"hinges":[{}],"start":{{{}}},"until":1,"every":0.1}}"#,
        list(&bar),
        list(&hinge),
        list(&start)
    )
}

fn start(mechanism: &Arc<Mechanism>, scene: &Scene) -> State {
    Elimination::<0>::new(Arc::clone(mechanism)).state(&mechanism.start(scene))
}

fn tight() -> Tolerance {
    Tolerance { relative: 1e-17, absolute: 1e-17 }
}

#[test]
fn one_to_six_bodies_agree_with_double_double() {
    for bars in 1..=6 {
        let scenes: Vec<Scene> = (0..9).map(|i| chain(bars, 0.05 * i as f64)).collect();
        let mechanisms: Vec<_> = scenes.iter().map(compile).collect();
        let starts: Vec<State> =
            mechanisms.iter().zip(&scenes).map(|(mechanism, scene)| start(mechanism, scene)).collect();
        for order in [16, 20, 24] {
            let mut members: Vec<BatchMember> =
                mechanisms.iter().zip(&starts).map(|(m, state)| BatchMember::new(m, state.clone())).collect();
            Batch::new(tight())
                .with_order(order)
                .integrate(&mut members, Time::from(1.0), &mut |_, _| Going::On);
            for (member, (mechanism, start)) in members.iter().zip(mechanisms.iter().zip(&starts)) {
                let mut exact = start.clone();
                let problem: &mut dyn Problem = &mut Elimination::<0>::new(Arc::clone(mechanism));
                let mut statistics = Default::default();
                Taylor::reference()
                    .advance(problem, &mut exact, Time::from(1.0), &mut statistics, &mut |_, _| {
                        Ok(Seen::Kept)
                    })
                    .expect("an end");
                assert!(member.stopped.is_none() && member.statistics.steps > 3);
                assert_eq!((member.state.time, &member.state.turns), (exact.time, &exact.turns));
                for i in 0..2 * bars {
                    let error = (member.state.unknown(i) - exact.unknown(i)).hi.abs();
                    assert!(error < 3e-13, "{bars} bars, order {order}, unknown {i}: {error:e}");
                }
            }
        }
    }
}

#[test]
fn neighbours_and_the_processor_make_no_difference_to_the_bits() {
    let scene = shipped("free", &[]);
    let heavy = shipped("free", &["bars.bar2.density=900"]);
    let (light, heavy) = (compile(&scene), compile(&heavy));
    let member = |i: usize| {
        let mechanism = if i.is_multiple_of(3) { &heavy } else { &light };
        let mut motion = mechanism.start(&scene);
        motion.phi[0] = motion.phi[0] + 0.01 * i as f64;
        BatchMember::new(mechanism, Elimination::<0>::new(Arc::clone(mechanism)).state(&motion))
    };
    let batch = Batch::new(Tolerance { relative: 1e-12, absolute: 1e-12 });
    let integrate = |batch: &Batch, mut members: Vec<BatchMember>| -> Vec<State> {
        batch.integrate(&mut members, Time::from(5.0), &mut |_, _| Going::On);
        members.into_iter().map(|member| member.state).collect()
    };
    let together = integrate(&batch, (0..13).map(member).collect());
    let backwards = integrate(&batch, (0..13).rev().map(member).collect());
    let portable =
        integrate(&batch.clone().with_kernel(ExpansionKernel::Portable), (0..13).map(member).collect());
    for i in 0..13 {
        assert_eq!(integrate(&batch, vec![member(i)])[0], together[i], "{i}");
        assert_eq!(backwards[12 - i], together[i], "{i}");
        assert_eq!(portable[i], together[i], "{i}");
    }
}

/// Several driven mechanisms with their starts, some of them with the motor on the outer bar, every other one
/// at a constant rate.
fn driven(count: usize) -> Vec<(Arc<Mechanism>, State)> {
    (0..count)
        .map(|i| {
            let mut text: serde_json::Value =
                serde_json::from_str(include_str!("../examples/scenes/motor.json")).expect("JSON");
            let motor = &mut text["motors"][0];
            motor["law"] = serde_json::json!({"start": 0.1 * i as f64, "rate": 2.0 - 0.9 * i as f64});
            if i % 2 == 1 {
                motor["law"]["acceleration"] = (0.2 * i as f64).into();
                let sines: Vec<_> = (0..i % 3)
                    .map(|k| {
                        let amplitude = 0.4 + 0.1 * k as f64;
                        serde_json::json!({"amplitude": amplitude, "frequency": 3 + 5 * k, "phase": i})
                    })
                    .collect();
                motor["law"]["sines"] = sines.into();
            }
            let (own, other) = if i % 4 == 3 { ("bar2", "bar1") } else { ("bar1", "bar2") };
            motor["body"] = own.into();
            let omega = 0.3 * i as f64;
            text["start"] = serde_json::json!({other: {"phi": 1.0 - 0.2 * i as f64, "omega": omega}});
            let scene = parse_scene(&text.to_string(), "driven", &[]).expect("a scene");
            let mechanism = compile(&scene);
            let state = start(&mechanism, &scene);
            (mechanism, state)
        })
        .collect()
}

/// Integrates these mechanisms in both orders and by both kernels, and one by one in double-double.
fn agree_with_double_double_whoever_is_beside(all: &[(Arc<Mechanism>, State)], until: f64, bound: f64) {
    let until = Time::from(until);
    let members = |reversed: bool| -> Vec<BatchMember> {
        let mut members: Vec<_> = all.iter().map(|(m, state)| BatchMember::new(m, state.clone())).collect();
        if reversed {
            members.reverse();
        }
        members
    };
    let exact = |(mechanism, state): &(Arc<Mechanism>, State)| {
        let (mut exact, mut statistics) = (state.clone(), Default::default());
        let problem: &mut dyn Problem = &mut Elimination::<0>::new(Arc::clone(mechanism));
        Taylor::reference()
            .advance(problem, &mut exact, until, &mut statistics, &mut |_, _| Ok(Seen::Kept))
            .expect("an end");
        exact
    };
    let exact: Vec<State> = all.iter().map(exact).collect();
    for order in [16, 20, 24] {
        let batch = Batch::new(tight()).with_order(order);
        let ends = |batch: &Batch, mut members: Vec<BatchMember>| -> Vec<State> {
            batch.integrate(&mut members, until, &mut |_, _| Going::On);
            for member in &members {
                assert!(member.stopped.is_none() && member.statistics.steps > 2, "{member:?}");
            }
            members.into_iter().map(|member| member.state).collect()
        };
        let found = ends(&batch, members(false));
        let mut backwards = ends(&batch, members(true));
        backwards.reverse();
        assert_eq!(backwards, found);
        assert_eq!(ends(&batch.clone().with_kernel(ExpansionKernel::Portable), members(false)), found);
        for (i, ((mechanism, _), (exact, found))) in all.iter().zip(exact.iter().zip(&found)).enumerate() {
            assert_eq!((found.time, &found.turns), (exact.time, &exact.turns));
            // Angles, rates, and the work of motors or dampers.
            let coordinates = mechanism.partition.count();
            for k in 0..exact.y.len() {
                let scale = if k < 2 * coordinates { 1.0 } else { mechanism.energy_scale };
                let error = (found.unknown(k) - exact.unknown(k)).hi.abs() / scale;
                assert!(error < bound, "{i}, order {order}, unknown {k}: {error:e}");
            }
        }
    }
}

#[test]
fn driven_bodies_agree_with_double_double_whoever_is_beside_them() {
    agree_with_double_double_whoever_is_beside(&driven(11), 3.0, 1e-12);
}

/// Chains of one to three bars with one or two springs, from the ground or between bars, with and without
/// free length and damper.
#[test]
fn bodies_with_springs_agree_with_double_double_whoever_is_beside_them() {
    let sprung = |i: usize| {
        let bars = 1 + i % 3;
        let mut text: serde_json::Value =
            serde_json::from_str(&chain_text(bars, 0.1 * i as f64)).expect("JSON");
        let end = |name: &str, x: f64, y: f64| serde_json::json!({"body": name, "point": [x, y]});
        let (free_length, damping) = ([0.4, 0.0][i / 3 % 2], [0.0, 0.0, 0.3][(i + i / 3) % 3]);
        let mut springs = vec![serde_json::json!({
            "name": "s0", "between": [end("ground", -0.3, 0.2), end("b0", 0.3, 0.02)],
            "stiffness": 7.0 + i as f64, "free_length": free_length, "damping": damping,
        })];
        if i % 4 > 1 {
            let last = format!("b{}", bars - 1);
            let (from, x) = if bars == 1 { ("ground", 0.9) } else { ("b0", 0.1) };
            springs.push(serde_json::json!({
                "name": "s1", "between": [end(from, x, 0.05), end(&last, 0.3, 0.0)], "stiffness": 4.0,
                "free_length": 0.25, "damping": 0.0,
            }));
        }
        text["springs"] = springs.into();
        let scene = parse_scene(&text.to_string(), "sprung", &[]).expect("a scene");
        let mechanism = compile(&scene);
        let state = start(&mechanism, &scene);
        (mechanism, state)
    };
    let all: Vec<_> = (0..23).map(sprung).collect();
    assert!(all.iter().all(|(mechanism, _)| Batch::takes(mechanism)));
    // Some of them are chaotic: a second adds two digits.
    agree_with_double_double_whoever_is_beside(&all, 1.0, 1e-12);
}

/// Trees of one mechanism each: three bars with a motor on the first one, a motor between two bars beside a
/// spring with a damper, torsion springs beside a torque, a tree off its axes, a motor whose law is a formula,
/// bars with formulas of time, places, angles and rates, smooth ones and one that is flat for most times, and two
/// plates on a spring that are thrown.
fn trees() -> Vec<Scene> {
    let text =
        |bars: usize| -> serde_json::Value { serde_json::from_str(&chain_text(bars, 0.0)).expect("JSON") };
    let end = |name: &str, x: f64, y: f64| serde_json::json!({"body": name, "point": [x, y]});
    let sines = serde_json::json!([{"amplitude": 0.4, "frequency": 3, "phase": 0.3}]);
    let (mut driven, mut between, mut coiled) = (text(3), text(4), text(3));
    driven["motors"] = serde_json::json!([
        {"name": "m", "body": "b0", "law": {"start": 0.2, "rate": 1.5, "acceleration": -0.3, "sines": sines}}]);
    driven["start"] = serde_json::json!({"b1": {"phi": 1.2, "omega": 0.2}, "b2": {"phi": 0.9, "omega": 0.4}});
    between["motors"] = serde_json::json!([
        {"name": "m", "body": "b1", "relative_to": "b0", "law": {"start": -0.3, "rate": 2}}]);
    between["start"] = serde_json::json!({
        "b0": {"phi": 1.5, "omega": 0}, "b2": {"phi": 0.9, "omega": 0.4}, "b3": {"phi": 0.6, "omega": 0.6}});
    between["springs"] = serde_json::json!([{
        "name": "s", "between": [end("ground", -0.3, 0.2), end("b2", 0.3, 0.02)],
        "stiffness": 7, "free_length": 0.4, "damping": 0.3}]);
    coiled["torsion_springs"] = serde_json::json!([
        {"name": "t", "body": "b1", "relative_to": "b0", "stiffness": 0.3, "free_angle": 0.2, "damping": 0.01},
        {"name": "u", "body": "b0", "stiffness": 0.5, "free_angle": 0, "damping": 0}]);
    coiled["torques"] = serde_json::json!([
        {"name": "p", "body": "b2", "torque": 0.2, "law": {"start": 1, "rate": 0, "sines": sines}}]);
    let (mut written, mut hardened) = (text(3), text(2));
    written["motors"] =
        serde_json::json!([{"name": "m", "body": "b0", "law": "0.2 + 1.5*t + 0.4*exp(-1*t)*sin(3*t)"}]);
    written["start"] = driven["start"].clone();
    hardened["parameters"] = serde_json::json!({"k": 0.4, "c": 0.02});
    hardened["points"] = serde_json::json!([{"name": "tip", "body": "b1", "point": [0.5, 0.01]}]);
    hardened["torsion_springs"] = serde_json::json!([
        {"name": "t", "body": "b1", "relative_to": "b0", "potential": "k*angle^2/2 + k*angle^4/4",
         "torque": "c*rate"}]);
    hardened["forces"] = serde_json::json!([{"name": "air", "body": "b1", "point": [0.5, 0.01], "force": [
        "-c*tip.vx*sqrt(1 + tip.vx^2 + tip.vy^2)", "-c*tip.vy*sqrt(1 + tip.vx^2 + tip.vy^2)"]}]);
    hardened["torques"] = serde_json::json!([
        {"name": "push", "body": "b0", "torque": "0.1*(1 + tanh(60*(1*t - 0.6)))/(1 + b1.cos^2)"}]);
    let thrown = serde_json::json!({"name": "thrown", "gravity": [0, -9.81],
        "bars": [{"name": "a", "mass": 1, "centre": [0.1, 0.02], "inertia": 0.02, "length": 0.4},
            {"name": "b", "mass": 2, "centre": [-0.1, 0], "inertia": 0.03, "length": 0.4}],
        "springs": [{"name": "s", "between": [end("a", 0.3, 0.0), end("b", 0.0, 0.1)],
            "stiffness": 40, "free_length": 0.5, "damping": 0.3}],
        "start": {"a": {"phi": 0.3, "omega": 2, "origin": [0, 0], "velocity": [1, 5]},
            "b": {"phi": -1, "omega": -1, "origin": [1, 0.2], "velocity": [0, 4]}}, "until": 4, "every": 1});
    let read = |text: serde_json::Value| parse_scene(&text.to_string(), "tree", &[]).expect("a scene");
    let scenes = [driven, between, coiled, written, hardened, thrown].map(read);
    scenes.into_iter().chain(["branch", "drag", "duffing"].map(|name| shipped(name, &[]))).collect()
}

#[test]
fn trees_of_one_mechanism_agree_with_double_double_whoever_is_beside_them() {
    for scene in trees() {
        let mechanism = compile(&scene);
        assert!(Batch::takes_alike(&mechanism) && !Batch::takes(&mechanism));
        let coordinates = mechanism.partition.count();
        let all: Vec<_> = (0..11)
            .map(|i| {
                let mut state = start(&mechanism, &scene);
                for k in 0..coordinates {
                    state.y[k] -= 0.02 * (i * (k + 1)) as f64;
                }
                (Arc::clone(&mechanism), state)
            })
            .collect();
        agree_with_double_double_whoever_is_beside(&all, 1.0, 2e-12);
    }
}

/// The same trees with other masses, lengths, stiffnesses, laws and gravity for every trajectory.
#[test]
fn trees_with_numbers_of_their_own_agree_with_double_double_whoever_is_beside_them() {
    for scene in trees().iter().filter(|scene| Batch::takes_alike(&compile(scene))) {
        let all: Vec<_> = (0..11)
            .map(|i| {
                let mut scene = scene.clone();
                let more = 1.0 + 0.03 * i as f64;
                scene.gravity[0] *= more;
                for (k, bar) in scene.bars.iter_mut().enumerate() {
                    bar.mass *= if k % 2 == 0 { more } else { more.recip() };
                    bar.centre[0] *= more;
                }
                for hinge in &mut scene.hinges {
                    hinge.between.iter_mut().for_each(|end| end.point[0] *= more);
                }
                for spring in &mut scene.springs {
                    (spring.stiffness, spring.damping) = (spring.stiffness * more, spring.damping / more);
                }
                for spring in &mut scene.torsion_springs {
                    spring.stiffness *= more;
                    spring.free_angle += 0.01 * i as f64;
                }
                scene.parameters.iter_mut().for_each(|parameter| parameter.value *= more);
                for motor in &mut scene.motors {
                    motor.law.rate /= more;
                    motor.law.sines.iter_mut().for_each(|sine| sine.frequency *= more);
                }
                let mechanism = compile(&scene);
                let state = start(&mechanism, &scene);
                (mechanism, state)
            })
            .collect();
        agree_with_double_double_whoever_is_beside(&all, 1.0, 2e-12);
    }
}

/// Bodies with coordinates of their own, driven ones and such as ride on a driven one.
#[test]
fn trees_are_seen_inside_their_steps() {
    for scene in trees() {
        let mechanism = compile(&scene);
        let bodies = mechanism.bodies.len();
        let mut members = [BatchMember::new(&mechanism, start(&mechanism, &scene))];
        let mut last: Vec<Option<f64>> = vec![None; bodies];
        Batch::new(tight()).integrate(&mut members, Time::from(2.0), &mut |_, passage| {
            for (body, last) in last.iter_mut().enumerate() {
                let [(begin, _), (end, rate)] = [0.0, passage.step].map(|after| passage.at(body, after));
                assert!(begin.abs() <= std::f64::consts::PI * (1.0 + 1e-15));
                if let Some(last) = last {
                    let turns = (begin - *last) / std::f64::consts::TAU;
                    assert!((turns - turns.round()).abs() < 1e-13, "{body}: {begin} {last}");
                }
                let ends = passage.ends(body);
                assert!((ends[0][0] - begin).abs() < 1e-14 && (ends[1][0] - end).abs() < 1e-13);
                assert!((ends[1][1] - rate).abs() < 1e-12 * (1.0 + rate.abs()));
                *last = Some(end);
            }
            Going::On
        });
        assert!(members[0].stopped.is_none());
        let mut motion = Default::default();
        Elimination::<0>::new(Arc::clone(&mechanism)).read(&members[0].state, &mut motion);
        for (body, last) in last.iter().enumerate() {
            let turns = (motion.phi[body].hi - last.expect("a step")) / std::f64::consts::TAU;
            assert!((turns - turns.round()).abs() < 1e-12, "{body}");
        }
    }
}

#[test]
fn driven_bodies_are_seen_inside_their_steps() {
    let all = driven(4);
    for (i, (mechanism, state)) in all.iter().enumerate() {
        let mut members = [BatchMember::new(mechanism, state.clone())];
        let body = if i % 4 == 3 { 1 } else { 0 };
        let law = mechanism.constraints[0].law.clone().expect("a law");
        let mut last = [law.angle(Time::from(0.0)).hi, state.y[0]];
        Batch::new(tight()).integrate(&mut members, Time::from(3.0), &mut |_, passage| {
            // Angles go on from step to step but for whole turns, at their rates.
            for (bar, last) in [body, 1 - body].into_iter().zip(&mut last) {
                let [(begin, _), (middle, omega), (end, _)] =
                    [0.0, 0.5, 1.0].map(|share| passage.at(bar, share * passage.step));
                let turns = (begin - *last) / std::f64::consts::TAU;
                assert!((turns - turns.round()).abs() < 1e-13, "{bar}: {begin} {last}");
                assert!(begin.abs() <= std::f64::consts::PI * (1.0 + 1e-15));
                if bar == body {
                    let there = passage.from + 0.5 * passage.step;
                    let [_, rate, _] = law.angles::<f64>(there);
                    let turned = (law.angle(there) - law.angle(passage.from)).hi;
                    assert!((omega - rate).abs() < 1e-12 && (middle - begin - turned).abs() < 1e-12);
                }
                *last = end;
            }
            Going::On
        });
        assert!(members[0].stopped.is_none());
    }
}

#[test]
fn a_flip_is_found_within_its_step_and_ends_the_trajectory() {
    let scene = shipped("free", &["start.bar1.phi=3", "start.bar2.phi=2.9"]);
    let mechanism = compile(&scene);
    let mut members = [BatchMember::new(&mechanism, start(&mechanism, &scene))];
    let mut found = None;
    Batch::new(tight()).integrate(&mut members, Time::from(20.0), &mut |_, passage| {
        let end = |body: usize| passage.at(body, passage.step).0;
        let passes = |&body: &usize| end(body).abs() > std::f64::consts::PI;
        let Some(body) = (0..2).find(passes) else { return Going::On };
        let target = std::f64::consts::PI * end(body).signum();
        let beyond = |after: f64| (passage.at(body, after).0 - target) * target > 0.0;
        let (mut before, mut after) = (0.0, passage.step);
        assert!(!beyond(before) && beyond(after));
        for _ in 0..60 {
            let middle = 0.5 * (before + after);
            if beyond(middle) { after = middle } else { before = middle }
        }
        found = Some((body, (passage.from + after).hi, target));
        Going::Enough
    });
    let (body, time, target) = found.expect("a flip");
    let end = members[0].state.time.hi;
    assert!(time < end && end < time + 0.5 && end < 20.0);
    // The same moment by the scalar method.
    let problem: &mut dyn Problem = &mut Elimination::<0>::new(Arc::clone(&mechanism));
    let mut state = start(&mechanism, &scene);
    let mut statistics = Default::default();
    Taylor::reference()
        .advance(problem, &mut state, Time::from(time), &mut statistics, &mut |_, _| Ok(Seen::Kept))
        .expect("an end");
    let apart = (state.y[body].abs() - target.abs()).abs();
    assert!(apart < 1e-10, "{apart:e}");
}

#[test]
fn one_bad_trajectory_leaves_the_others_alone() {
    let (scene, other) = (shipped("free", &[]), shipped("friction_pendulum", &[]));
    let (mechanism, rubbed) = (compile(&scene), compile(&other));
    let good = start(&mechanism, &scene);
    let (mut lost, mut past) = (good.clone(), good.clone());
    lost.y[2] = f64::NAN;
    past.time = Time::from(3.0);
    let mut members = [
        BatchMember::new(&mechanism, lost),
        BatchMember::new(&rubbed, start(&rubbed, &other)),
        BatchMember::new(&mechanism, past.clone()),
        BatchMember::new(&mechanism, good),
    ];
    Batch::new(tight()).integrate(&mut members, Time::from(2.0), &mut |_, _| Going::On);
    let causes: Vec<_> =
        members.iter().map(|member| member.stopped.as_ref().map(|stop| stop.cause)).collect();
    assert_eq!(causes, [Some(Cause::NotFinite), Some(Cause::Unsuited), None, None]);
    assert_eq!(members[2].state, past);
    assert_eq!(members[3].state.time, Time::from(2.0));
    assert!(!Batch::takes(&rubbed) && Batch::takes(&mechanism));
}

/// Released from rest both bars horizontal only every fourth power is there; hanging, none; both upright,
/// they stay.
#[test]
fn symmetric_releases_and_equilibria_are_no_trap() {
    let angles = [
        ("1.5707963267948966", "1.5707963267948966"),
        ("0", "0"),
        ("3.141592653589793", "3.141592653589793"),
    ];
    for (phi1, phi2) in angles {
        let scene = shipped("free", &[&format!("start.bar1.phi={phi1}"), &format!("start.bar2.phi={phi2}")]);
        let mechanism = compile(&scene);
        let mut members = [BatchMember::new(&mechanism, start(&mechanism, &scene))];
        Batch::new(tight()).integrate(&mut members, Time::from(1.0), &mut |_, _| Going::On);
        let mut exact = start(&mechanism, &scene);
        let problem: &mut dyn Problem = &mut Elimination::<0>::new(Arc::clone(&mechanism));
        let mut statistics = Default::default();
        Taylor::reference()
            .advance(problem, &mut exact, Time::from(1.0), &mut statistics, &mut |_, _| Ok(Seen::Kept))
            .expect("an end");
        for i in 0..4 {
            let error = (members[0].state.unknown(i) - exact.unknown(i)).hi.abs();
            assert!(error < 1e-14 * f64::exp(8.0), "{phi1}, unknown {i}: {error:e}");
        }
    }
}
