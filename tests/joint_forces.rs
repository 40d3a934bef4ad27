//! What `inspect` and the table say of forces: hung weights tell every sign, redundant constraints are named,
//! and each column has the unit of what is in it.
#![cfg(feature = "cli")]

use crate::program;

use program::Program;
use serde_json::{Value, json};

const WEIGHT: f64 = 2.0 * 9.81;

/// A body of 2 kg whose centre is 0.5 m from its origin, along +x at the start, with these joints.
fn hung(joints: &Value) -> Value {
    let mut scene = json!({
        "name": "hung", "gravity": [0, -9.81],
        "bars": [{"name": "body", "mass": 2, "centre": [0.5, 0], "inertia": 0.1}],
        "start": {"body": {"phi": 0, "omega": 0}}, "until": 1, "every": 0.1,
    });
    let members = joints.as_object().expect("joints").clone();
    scene.as_object_mut().expect("an object").extend(members);
    scene
}

fn inspected(scene: &Value) -> Value {
    let program = Program::new();
    program.write("scene.json", &scene.to_string());
    program.run("inspect scene.json --json").exits(0).object()
}

#[track_caller]
fn is_near(found: &Value, expected: f64) {
    let number = found.as_f64().unwrap_or_else(|| panic!("{found} is no number"));
    assert!((number - expected).abs() < 1e-9, "{number} is not {expected}");
}

#[track_caller]
fn is_force(found: &Value, force: [f64; 2], on: &str, from: &str) {
    (0..2).for_each(|axis| is_near(&found["force"][axis], force[axis]));
    assert_eq!((&found["on"], &found["from"]), (&json!(on), &json!(from)), "{found}");
}

fn place(body: &str) -> Value {
    json!({"body": body, "point": [0, 0]})
}

/// Both orders of two bodies: the second, the first.
const ORDERS: [[&str; 2]; 2] = [["body", "ground"], ["ground", "body"]];

#[test]
fn a_weld_holds_a_weight_whichever_body_comes_first() {
    for [second, first] in ORDERS {
        let found =
            inspected(&hung(&json!({"welds": [{"name": "W", "between": [place(first), place(second)]}]})));
        let sign = if second == "body" { 1.0 } else { -1.0 };
        is_force(&found["hinges"]["W"], [0.0, sign * WEIGHT], second, first);
        assert_eq!(found["hinges"]["W"]["determinate"], true);
        // The ground has no angle: the torque is told of the body in either order, against the weight's.
        let angle = &found["constraints"]["W.angle"];
        is_near(&angle["torque"], 0.5 * WEIGHT);
        is_near(&angle["multiplier"], -0.5 * WEIGHT);
        assert_eq!(
            (&angle["on"], &angle["unit"], &angle["unit_of_multiplier"]),
            (&json!("body"), &json!("rad"), &json!("N m"))
        );
        assert_eq!(found["motors"], json!({}), "a weld is no motor");
    }
}

#[test]
fn a_hinge_with_a_lock_does_too() {
    for [second, first] in ORDERS {
        let hinge = json!({"name": "A", "between": [place(first), place(second)]});
        let found =
            inspected(&hung(&json!({"hinges": [hinge], "locks": [{"name": "lock", "body": "body"}]})));
        let sign = if second == "body" { 1.0 } else { -1.0 };
        is_force(&found["hinges"]["A"], [0.0, sign * WEIGHT], second, first);
        is_near(&found["constraints"]["lock"]["torque"], 0.5 * WEIGHT);
        assert_eq!(found["motors"], json!({}), "a lock is no motor");
    }
}

#[test]
fn a_slider_pushes_its_point_and_the_rail_the_other_way() {
    for [on, rail] in ORDERS {
        let mut line = place(rail);
        line["direction"] = json!([1, 0]);
        let slider = json!({"name": "guide", "point": place(on), "rail": line, "angle": "locked"});
        let mut scene = hung(&json!({"sliders": [slider]}));
        scene["start"]["body"] = json!({"phi": 0, "omega": 0, "origin": [0, 0], "velocity": [0, 0]});
        let found = inspected(&scene);
        let sign = if on == "body" { 1.0 } else { -1.0 };
        let guide = &found["constraints"]["guide"];
        is_force(guide, [0.0, sign * WEIGHT], on, rail);
        assert_eq!((&guide["unit"], &guide["unit_of_multiplier"]), (&json!("m"), &json!("N")));
        is_near(&found["constraints"]["guide.angle"]["torque"], 0.5 * WEIGHT);
        assert_eq!(found["motors"], json!({}), "a locked angle is no motor");
    }
}

#[test]
fn a_motor_on_a_slider_has_a_force_along_the_rail() {
    for direction in [1.0, -1.0] {
        let rail = json!({"body": "ground", "point": [0, 0], "direction": [0, direction]});
        let scene = hung(&json!({
            "sliders": [{"name": "guide", "point": place("body"), "rail": rail, "angle": "locked"}],
            "motors": [{"name": "lift", "slider": "guide", "law": {"start": 0, "rate": 0.3}}],
            "start": {"body": {"phi": 0}},
        }));
        let found = inspected(&scene);
        is_near(&found["motors"]["lift"]["torque"], direction * WEIGHT);
        is_near(&found["motors"]["lift"]["power"], direction * WEIGHT * 0.3);
        assert_eq!(found["motors"]["lift"]["unit"], "N");
        is_force(&found["constraints"]["lift"], [0.0, WEIGHT], "body", "ground");
        let program = Program::new();
        program.write("scene.json", &scene.to_string());
        program.run("inspect scene.json").exits(0).shows(&[
            "force [N]",
            "multiplier [N]",
            "C [m]",
            "multiplier [N m]",
            "C [rad]",
        ]);
    }
}

/// A beam on two pins.
fn beam(gravity: [f64; 2]) -> Value {
    let pin = |name: &str, x: f64| json!({"name": name, "between": [{"body": "ground", "point": [x, 0]}, {"body": "beam", "point": [x, 0]}]});
    json!({
        "name": "beam", "gravity": gravity,
        "bars": [{"name": "beam", "mass": 2, "centre": [0.5, 0], "inertia": 0.1, "length": 2}],
        "hinges": [pin("A", 0.0), pin("B", 2.0)],
        "start": {"beam": {"phi": 0, "omega": 0}}, "until": 1, "every": 0.1,
    })
}

#[test]
fn indeterminate_forces_are_named_and_shared_equally() {
    let found = inspected(&beam([3.0, -9.81]));
    // Moments give the upward forces; along the beam only their sum is known, and the least are equal.
    is_force(&found["hinges"]["A"], [-3.0, 0.75 * WEIGHT], "beam", "ground");
    is_force(&found["hinges"]["B"], [-3.0, 0.25 * WEIGHT], "beam", "ground");
    assert_eq!(
        (&found["hinges"]["A"]["determinate"], &found["hinges"]["B"]["determinate"]),
        (&json!(false), &json!(false))
    );
    let program = Program::new();
    program.write("scene.json", &beam([3.0, -9.81]).to_string());
    program.run("inspect scene.json").exits(0).shows(&["indeterminate", "A, B", "least norm"]);
}

/// A motor's torque follows from its power whatever the rods share; the record marks what `inspect` does.
#[test]
fn outputs_of_least_norm_are_those_that_are_indeterminate() {
    let mut scene = beam([3.0, -9.81]);
    scene["bars"]
        .as_array_mut()
        .expect("bars")
        .push(json!({"name": "wheel", "mass": 1, "centre": [0, 0], "inertia": 0.1}));
    scene["hinges"].as_array_mut().expect("hinges").push(
        json!({"name": "O", "between": [{"body": "ground", "point": [0, 1]}, {"body": "wheel", "point": [0, 0]}]}),
    );
    scene["motors"] = json!([{"name": "M", "body": "wheel", "law": {"start": 0, "rate": 2}}]);
    scene["start"]["wheel"] = json!({"phi": 0});
    scene["outputs"] = json!({"T": "M.torque", "F": "A.force", "P": "M.power + O.force*(1 m/s)"});
    let program = Program::new();
    program.write("scene.json", &scene.to_string());
    let inspected = program.run("inspect scene.json --json").exits(0).object();
    program.run("run scene.json --out o --no-charts").exits(0);
    let record: Value =
        serde_json::from_str(&program.read("o/beam/taylor-1e-9-projection/run.json")).expect("a record");
    let marked = |name: &str| record["result"]["outputs"][name]["least_norm"] == true;
    assert_eq!(["T", "F", "P"].map(marked), [false, true, false], "{record:#}");
    assert_eq!(inspected["motors"]["M"]["determinate"], true);
    assert_eq!(inspected["hinges"]["A"]["determinate"], false);
    assert_eq!(inspected["hinges"]["O"]["determinate"], true);
}

#[test]
fn three_equal_cranks_share_what_they_may() {
    let bar = |name: &str, length: f64| json!({"name": name, "mass": 1, "centre": [0.5 * length, 0], "inertia": 0.1, "length": length});
    let hinge = |name: String, a: Value, b: Value| json!({"name": name, "between": [a, b]});
    let at = |body: &str, x: f64| json!({"body": body, "point": [x, 0]});
    let cranks = ["left", "middle", "right"];
    let translations = cranks
        .iter()
        .enumerate()
        .map(|(i, name)| hinge(format!("A{i}"), at("ground", i as f64), at(name, 0.0)));
    let tops = cranks
        .iter()
        .enumerate()
        .map(|(i, name)| hinge(format!("B{i}"), at("coupler", i as f64), at(name, 1.0)));
    let start = json!({"phi": 1.3, "omega": 0.0});
    let scene = json!({
        "name": "cranks", "gravity": [9.81, 0],
        "bars": [bar("left", 1.0), bar("middle", 1.0), bar("right", 1.0), bar("coupler", 2.0)],
        "hinges": translations.chain(tops).collect::<Vec<_>>(),
        "start": {"left": start, "middle": start, "right": start, "coupler": {"phi": 0, "omega": 0}},
        "until": 1, "every": 0.1,
    });
    let found = inspected(&scene);
    // Newton for the coupler: what hangs on it at the tops is what moves it.
    let total = |axis: usize| {
        (0..3)
            .map(|i| found["hinges"][format!("B{i}")]["force"][axis].as_f64().expect("a number"))
            .sum::<f64>()
    };
    let (x, y) = (&found["bodies"]["coupler"]["x"], &found["bodies"]["coupler"]["y"]);
    assert!(
        (total(0) + x.as_f64().expect("a number") - 9.81).abs() < 1e-9
            && (total(1) + y.as_f64().expect("a number")).abs() < 1e-9
    );
    // The load that the cranks' rods cannot tell apart: pushes along the rods, of sum and moment zero, (1,
    // -2, 1).
    let along = |name: String| {
        let force = &found["hinges"][name]["force"];
        force[0].as_f64().expect("a number") * 1.3_f64.cos()
            + force[1].as_f64().expect("a number") * 1.3_f64.sin()
    };
    for letter in ["A", "B"] {
        assert!((0..3).all(|i| found["hinges"][format!("{letter}{i}")]["determinate"] == false), "{found:#}");
    }
    // Least norm: what is found has no part in it.
    let share = |letter: &str| {
        along(format!("{letter}0")) - 2.0 * along(format!("{letter}1")) + along(format!("{letter}2"))
    };
    assert!((share("A") - share("B")).abs() < 1e-9, "{} {}", share("A"), share("B"));
}

#[test]
fn forces_of_regular_mechanisms_are_determinate() {
    for name in ["four_bar_motor", "andrews", "quick_return", "guided"] {
        let program = Program::with_scenes(&[name]);
        let found = program.run(&format!("inspect {name}.json --json")).exits(0).object();
        for list in ["hinges", "constraints"] {
            let all = found[list].as_object().expect("an object");
            assert!(
                !all.is_empty() && all.values().all(|one| one["determinate"] == true),
                "{name}: {found:#}"
            );
        }
    }
}

/// Titles of the table of a short run, and its rows.
fn table(program: &Program, scene: &str, folder: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    program
        .run(&format!("run {scene}.json --until 1 --every 0.1 --method dp8 -q --no-charts --trust off"))
        .exits(0);
    let text = program.read(&format!("output/{scene}/{folder}/trajectory.csv"));
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let head = lines.next().expect("a header");
    (head, lines.map(|line| line.iter().map(|cell| cell.parse().expect("a number")).collect()).collect())
}

#[test]
fn columns_are_those_of_what_a_constraint_has() {
    let program = Program::with_scenes(&["guided", "cart_pole", "four_bar_motor"]);
    for (scene, method, expected) in [
        ("guided", "dp8-1e-9-projection", &["guide.C [m]", "guide.C' [m/s]"][..]),
        (
            "cart_pole",
            "dp8-1e-9-projection",
            &[
                "slider.angle.C [rad]",
                "slider.angle.C' [rad/s]",
                "slider.angle.torque [N m]",
                "slider.C [m]",
                "slider.C' [m/s]",
            ],
        ),
        (
            "four_bar_motor",
            "dp8-1e-9-projection",
            &[
                "motor.C [rad]",
                "motor.C' [rad/s]",
                "motor.torque [N m]",
                "motor.power [W]",
                ".x.C [m]",
                ".x.C' [m/s]",
                ".y.C [m]",
                ".y.C' [m/s]",
            ],
        ),
    ] {
        let (head, rows) = table(&program, scene, method);
        let own = &head[head.iter().position(|title| title.contains(".C ")).expect("constraints")..];
        assert_eq!(own.len(), expected.len(), "{own:?}");
        assert!(own.iter().zip(expected).all(|(title, expected)| title.ends_with(expected)), "{own:?}");
        assert!(rows.iter().all(|row| row.len() == head.len()));
    }
}

#[test]
fn a_driven_slider_has_the_force_that_moves_it() {
    let program = Program::new();
    let rail = json!({"body": "ground", "point": [0, 0], "direction": [1, 0]});
    let mut scene = hung(&json!({
        "sliders": [{"name": "guide", "point": place("body"), "rail": rail, "angle": "locked"}],
        "motors": [{"name": "push", "slider": "guide", "law": {"start": 0, "sines": [{"amplitude": 0.1, "frequency": 4}]}}],
        "start": {"body": {"phi": 0}},
    }));
    scene["name"] = json!("pushed");
    program.write("pushed.json", &scene.to_string());
    let (head, rows) = table(&program, "pushed", "dp8-1e-9-projection");
    let column = |title: &str| {
        head.iter().position(|known| known == title).unwrap_or_else(|| panic!("{title} in {head:?}"))
    };
    let (force, power) = (column("push.force [N]"), column("push.power [W]"));
    for row in rows {
        let t = row[0];
        let expected = -2.0 * 0.1 * 16.0 * (4.0 * t).sin();
        assert!(
            (row[force] - expected).abs() < 1e-9
                && (row[power] - expected * 0.4 * (4.0 * t).cos()).abs() < 1e-9,
            "{row:?}"
        );
    }
}

/// A platform on two equal cranks and locked beside them: the loop holds its angle already.  Column, output and
/// `inspect` tell the same torque, which balances the platform with the forces of its hinges.
#[test]
fn the_column_of_a_redundant_lock_balances_the_forces_of_the_hinges() {
    let crank =
        |name: &str| json!({"name": name, "mass": 1, "centre": [0.15, 0], "inertia": 0.01, "length": 0.3});
    let at = |body: &str, x: f64| json!({"body": body, "point": [x, 0]});
    let hinge = |name: &str, first: Value, second: Value| json!({"name": name, "between": [first, second]});
    let scene = json!({
        "name": "platform", "gravity": [0, -10],
        "bars": [{"name": "cp", "mass": 1, "centre": [0.3, 0], "inertia": 0.05, "length": 1}, crank("c0"), crank("c1")],
        "hinges": [hinge("A0", at("ground", 0.0), at("c0", 0.0)), hinge("B0", at("c0", 0.3), at("cp", 0.0)),
                   hinge("A1", at("ground", 1.0), at("c1", 0.0)), hinge("B1", at("c1", 0.3), at("cp", 1.0))],
        "locks": [{"name": "lock", "body": "cp"}],
        "outputs": {"torque": "lock.torque", "y0": "B0.fy", "y1": "B1.fy"},
        "start": {"cp": {"phi": 0}, "c0": {"phi": 1.2, "omega": 2}, "c1": {"phi": 1.2}}, "until": 0.4, "every": 0.1,
    });
    let program = Program::new();
    program.write("platform.json", &scene.to_string());
    let (head, rows) = table(&program, "platform", "dp8-1e-9-projection");
    let column = |title: &str| head.iter().position(|one| one == title).unwrap_or_else(|| panic!("{head:?}"));
    let columns = ["lock.torque [N m]", "torque [N m]", "y0 [N]", "y1 [N]"].map(column);
    for row in &rows {
        let [torque, output, y0, y1] = columns.map(|column| row[column]);
        assert!((torque - output).abs() < 1e-12 && torque.abs() > 0.1, "{torque} {output}");
        assert!((torque + 0.7 * y1 - 0.3 * y0).abs() < 1e-9, "{torque} {y0} {y1}");
    }
    is_near(&inspected(&scene)["constraints"]["lock"]["torque"], rows[0][columns[0]]);
}

/// A point that lies on its wall at the start is pressed, and the hinge carries the rest: moments about both.
#[test]
fn a_point_at_rest_on_its_wall_is_held_at_the_start() {
    let at = |body: &str, x: f64| json!({"body": body, "point": [x, 0]});
    for fraction in [0.7, 1.0] {
        let scene = hung(&json!({
            "hinges": [{"name": "A", "between": [at("ground", 0.0), at("body", 0.0)]}],
            "walls": [{"name": "W", "body": "body", "point": [fraction, 0], "restitution": 0.5,
                       "line": {"through": [0, 0], "normal": [0, 1]}}],
        }));
        let found = inspected(&scene);
        let pressing = 0.5 * WEIGHT / fraction;
        is_near(&found["bodies"]["body"]["phi"], 0.0);
        is_near(&found["hinges"]["A"]["force"][1], WEIGHT - pressing);
        is_near(&found["constraints"]["W"]["multiplier"], -pressing);
    }
}
