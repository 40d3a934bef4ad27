//! Answers on standard output, one JSON object a line, to requests on standard input, so that a peer in
//! another language can be timed in turn with this crate.
//!
//! ```text
//! problem SCENE                constants, starts and true ends
//! time taylor|batch ORDER TOLERANCE    error and microseconds per simulated second and trajectory of one run over all starts
//! ```

use crate::candidates;
use crate::problem::Problem;
use driftless::dynamics::Motion;
use serde_json::json;
use std::io::{BufRead, Write};

pub fn serve() {
    let (input, mut output) = (std::io::stdin().lock(), std::io::stdout().lock());
    let mut problem: Option<Problem> = None;
    for line in input.lines().map_while(Result::ok) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let answer = match (&words[..], &problem) {
            (["problem", name], _) => {
                problem = Problem::named(name);
                problem.as_ref().map(describe)
            }
            (["time", code, order, tolerance], Some(problem)) => timed(problem, code, order, tolerance),
            _ => None,
        };
        let answer = answer.unwrap_or_else(|| json!({ "error": format!("cannot answer: {line}") }));
        if writeln!(output, "{answer}").and_then(|()| output.flush()).is_err() {
            return;
        }
    }
}

fn describe(problem: &Problem) -> serde_json::Value {
    let numbers =
        |motion: &Motion| motion.phi.iter().chain(&motion.omega).map(|x| x.hi).collect::<Vec<f64>>();
    let tree = &problem.mechanism.tree;
    let laws = problem.scene.motors.iter().map(|motor| {
        let sines = motor.law.sines.iter().map(|sine| [sine.amplitude, sine.frequency, sine.phase]);
        json!({ "start": motor.law.start, "rate": motor.law.rate, "sines": sines.collect::<Vec<_>>() })
    });
    // Between the ground and the first bar, which hangs at the origin.
    let springs = problem.scene.springs.iter().map(|spring| {
        json!({
            "points": spring.between.each_ref().map(|place| place.point),
            "stiffness": spring.stiffness,
            "free_length": spring.free_length,
        })
    });
    json!({
        "until": problem.until,
        "diagonal": tree.diagonal,
        "coupling": tree.coupling.iter().map(|h| h.re).collect::<Vec<_>>(),
        "weight": tree.weight.iter().map(|w| w.re).collect::<Vec<_>>(),
        "motors": laws.collect::<Vec<_>>(),
        "springs": springs.collect::<Vec<_>>(),
        "starts": problem.starts.iter().map(numbers).collect::<Vec<_>>(),
        "ends": problem.ends.iter().map(numbers).collect::<Vec<_>>(),
    })
}

fn timed(problem: &Problem, code: &str, order: &str, tolerance: &str) -> Option<serde_json::Value> {
    let (order, tolerance) = (order.parse().ok()?, tolerance.parse().ok()?);
    let mut candidate = match code {
        "taylor" => candidates::taylor(problem, Some(order)),
        "batch" => candidates::batch(problem, order),
        _ => return None,
    };
    let error = problem.error(&(candidate.run)(tolerance));
    let time = crate::timed(&mut candidate, problem, tolerance);
    Some(json!({ "mean_error": error, "us": time }))
}
