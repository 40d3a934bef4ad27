//! The start: positions from angles and joints, and projection onto the constraints.

use super::double_double::{Dd, Vec2};
use super::linear::{self, Row};
use super::model::{Equation, Model, State};
use super::motion::Lost;
use super::reader::{Measure, Scene, Target};

/// What is left of a constraint, over its scale.
const CLOSED: f64 = 1e-27;

/// Takes positions, then rates, back onto all constraints, by the shortest way in the metric of the masses.
pub fn project(model: &Model, state: &mut State, held: &[usize]) -> Result<(), Lost> {
    let equations = |state: &State| -> Vec<Equation> {
        let mut all = model.equations(state);
        all.extend(held.iter().map(|&wall| model.gap(wall, state)));
        all
    };
    if model.scene.joints.is_empty() && held.is_empty() {
        return Ok(());
    }
    let zero = vec![Dd::ZERO; model.mass.len()];
    let mut before = f64::INFINITY;
    for round in 0.. {
        let equations = equations(state);
        let most = equations.iter().fold(0.0, |most: f64, equation| most.max(equation.off.hi.abs()))
            / model.scene.size.min(1.0);
        // Redundant equations that contradict each other by the rounding of the scene's numbers do not close
        // further.
        if most < CLOSED || (most < 1e-12 && most >= 0.5 * before) {
            break;
        }
        if round > 40 || !most.is_finite() || most > 1e3 {
            return Err(Lost(format!("constraints do not close: {most:e} at t = {}", state.t.hi)));
        }
        before = most;
        let right: Vec<Dd> = equations.iter().map(|equation| -equation.off).collect();
        let rows: Vec<Row> = equations.into_iter().map(|equation| equation.row).collect();
        let step = linear::solve(&model.mass, &rows, &zero, &right);
        state.q.iter_mut().zip(step.x).for_each(|(q, dq)| *q += dq);
    }
    let equations = equations(state);
    let right: Vec<Dd> = equations.iter().map(|equation| -equation.rate).collect();
    let rows: Vec<Row> = equations.into_iter().map(|equation| equation.row).collect();
    let step = linear::solve(&model.mass, &rows, &zero, &right);
    state.v.iter_mut().zip(step.x).for_each(|(v, dv)| *v += dv);
    Ok(())
}

/// The start of a scene.
pub struct Start {
    pub model: Model,
    pub state: State,
    /// How far the scene's own numbers were from the constraints: positions over the size, rates.
    pub correction: [f64; 2],
    /// True where every number was given, or follows from joints.
    pub is_complete: bool,
}

/// Reads the start off a scene; what is not given is taken from `guess`: angles, rates, centres and their
/// velocities, if there is one.
pub fn start(scene: Scene, guess: Option<&State>) -> Result<Start, Lost> {
    let n = scene.bodies.len();
    let mut state = State { t: Dd::ZERO, q: vec![Dd::ZERO; 3 * n], v: vec![Dd::ZERO; 3 * n], work: Dd::ZERO };
    let mut is_complete = angles(&scene, &mut state, guess)?;
    is_complete &= places(&scene, &mut state, guess)?;
    let mut model = Model::new(scene);
    let measures = model.measures(&state);
    for (target, (joint, measure)) in model.targets.iter_mut().zip(model.scene.joints.iter().zip(&measures)) {
        if matches!(joint.target, Target::AsAtStart) {
            target.start = *measure;
        }
    }
    let before = state.clone();
    project(&model, &mut state, &[])?;
    // Where nothing but a guess was off, the angles kept are those found.
    if guess.is_some() {
        let measures = model.measures(&state);
        for (target, (joint, measure)) in
            model.targets.iter_mut().zip(model.scene.joints.iter().zip(&measures))
        {
            if matches!(joint.target, Target::AsAtStart) {
                target.start = *measure;
            }
        }
    }
    let off = |a: &[Dd], b: &[Dd]| a.iter().zip(b).map(|(&a, &b)| (a - b).hi.abs()).fold(0.0, f64::max);
    let correction = [off(&before.q, &state.q), off(&before.v, &state.v)];
    Ok(Start { model, state, correction, is_complete })
}

/// Angles and rates as given, or as motors and locks tell.
fn angles(scene: &Scene, state: &mut State, guess: Option<&State>) -> Result<bool, Lost> {
    let n = scene.bodies.len();
    let mut phi: Vec<Option<Dd>> = scene.bodies.iter().map(|body| body.given.phi.map(Dd::from)).collect();
    let mut omega: Vec<Option<Dd>> = scene.bodies.iter().map(|body| body.given.omega.map(Dd::from)).collect();
    for _ in 0..n {
        for joint in &scene.joints {
            let (Measure::Angle { body: Some(body), base }, target) = (&joint.measure, &joint.target) else {
                continue;
            };
            let law = if let Target::Law(law) = target { Some(law.at(Dd::ZERO)) } else { None };
            let known = |of: &[Option<Dd>], base: &Option<usize>| base.map_or(Some(Dd::ZERO), |k| of[k]);
            match (law, phi[*body], known(&phi, base)) {
                (Some(law), None, Some(base)) => phi[*body] = Some(base + law[0]),
                (Some(law), Some(own), None) => phi[base.expect("a body")] = Some(own - law[0]),
                _ => {}
            }
            let rate = law.map_or(Dd::ZERO, |law| law[1]);
            match (omega[*body], known(&omega, base)) {
                (None, Some(base)) => omega[*body] = Some(base + rate),
                (Some(own), None) => omega[base.expect("a body")] = Some(own - rate),
                _ => {}
            }
        }
    }
    let mut is_complete = true;
    for k in 0..n {
        let guessed = |of: fn(&State) -> &Vec<Dd>| guess.map(|guess| of(guess)[3 * k + 2]);
        is_complete &= phi[k].is_some() && omega[k].is_some();
        let lacking = || Lost(format!("the start of `{}` is not given", scene.bodies[k].name));
        state.q[3 * k + 2] = phi[k].or_else(|| guessed(|guess| &guess.q)).ok_or_else(lacking)?;
        state.v[3 * k + 2] = omega[k].or_else(|| guessed(|guess| &guess.v)).ok_or_else(lacking)?;
    }
    Ok(is_complete)
}

/// Positions and velocities of the centres: from the origins given, along hinges and welds.
fn places(scene: &Scene, state: &mut State, guess: Option<&State>) -> Result<bool, Lost> {
    let n = scene.bodies.len();
    let mut known = vec![false; n];
    let mut is_complete = true;
    let put = |state: &mut State, k: usize, point: Vec2, at: Vec2, velocity: Vec2| {
        let arm = point.turned(state.q[3 * k + 2].sin_cos());
        let speed = velocity - arm.left().times(state.v[3 * k + 2]);
        (state.q[3 * k], state.q[3 * k + 1]) = ((at - arm).x, (at - arm).y);
        (state.v[3 * k], state.v[3 * k + 1]) = (speed.x, speed.y);
    };
    let spread = |state: &mut State, known: &mut Vec<bool>| {
        for _ in 0..n {
            for joint in &scene.joints {
                let Measure::Difference { places, .. } = &joint.measure else { continue };
                for (from, to) in [(places[0], places[1]), (places[1], places[0])] {
                    let Some(k) = to.body.filter(|&k| !known[k]) else { continue };
                    if from.body.is_some_and(|k| !known[k]) {
                        continue;
                    }
                    let (at, velocity) = match from.body {
                        None => (from.point, Vec2::default()),
                        Some(b) => {
                            let arm = from.point.turned(state.q[3 * b + 2].sin_cos());
                            let centre = Vec2 { x: state.q[3 * b], y: state.q[3 * b + 1] };
                            let speed = Vec2 { x: state.v[3 * b], y: state.v[3 * b + 1] };
                            (centre + arm, speed + arm.left().times(state.v[3 * b + 2]))
                        }
                    };
                    put(state, k, to.point, at, velocity);
                    known[k] = true;
                }
            }
        }
    };
    spread(state, &mut known);
    for k in 0..n {
        if known[k] {
            continue;
        }
        let body = &scene.bodies[k];
        let origin = Vec2::default() - body.centre;
        match (body.given.origin, guess) {
            (Some(at), _) => {
                is_complete &= body.given.velocity.is_some();
                put(state, k, origin, Vec2::of(at), Vec2::of(body.given.velocity.unwrap_or_default()));
                if let (None, Some(guess)) = (body.given.velocity, guess) {
                    (state.v[3 * k], state.v[3 * k + 1]) = (guess.v[3 * k], guess.v[3 * k + 1]);
                }
            }
            // Another body of the group may be the one that is given.
            _ if scene.bodies[k + 1..].iter().any(|other| other.given.origin.is_some())
                && guess.is_none() =>
            {
                continue;
            }
            (None, Some(guess)) => {
                is_complete = false;
                for i in 3 * k..3 * k + 2 {
                    (state.q[i], state.v[i]) = (guess.q[i], guess.v[i]);
                }
            }
            (None, None) => return Err(Lost(format!("the origin of `{}` is not given", body.name))),
        }
        known[k] = true;
        spread(state, &mut known);
    }
    if known.contains(&false) {
        return Err(Lost("the origin of a group is not given".into()));
    }
    Ok(is_complete)
}
