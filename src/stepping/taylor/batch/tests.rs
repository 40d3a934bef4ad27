//! The same bits in all vectors.

use super::*;
use crate::arithmetic::lanes::Hardware;
use crate::arithmetic::lanes::wide::WideHardware;
use crate::dynamics::Form;
use crate::dynamics::elimination::Elimination;
use crate::scene::parse_scene;
use std::sync::Arc;

/// More trajectories than there are lanes, of which some end early.
fn ends(vectors: Vectors) -> Vec<State> {
    let scene = parse_scene(
        r#"{"name": "two", "gravity": [9.81, 0], "bars": [
            {"name": "a", "length": 0.5, "width": 0.05, "thickness": 0.003, "density": 670},
            {"name": "b", "length": 0.4, "width": 0.05, "thickness": 0.003, "density": 700}],
            "hinges": [
                {"name": "h", "between": [
                    {"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                {"name": "k", "between": [
                    {"body": "a", "point": [0.5, 0]}, {"body": "b", "point": [0, 0]}]}],
            "start": {"a": {"phi": 1.5, "omega": 0}, "b": {"phi": 1.0, "omega": 0}},
            "until": 1, "every": 1}"#,
        "scene",
        &[],
    )
    .expect("a scene");
    let mechanism = Arc::new(Mechanism::new(&scene).expect("a mechanism"));
    let state = Elimination::<0>::new(Arc::clone(&mechanism)).state(&mechanism.start(&scene));
    let mut members: Vec<BatchMember> = (0..21)
        .map(|k| {
            let mut state = state.clone();
            (state.y[0], state.y[1]) = (1.5 - 0.1 * k as f64, 1.0 + 0.03 * k as f64);
            BatchMember::new(&mechanism, state)
        })
        .collect();
    let batch = Batch::new(Tolerance { relative: 1e-10, absolute: 1e-10 });
    let until = Time::from(3.0);
    let mut watch = |member: usize, passage: &TakenStep| match passage.from.hi > 0.1 * member as f64 {
        true => Going::Enough,
        false => Going::On,
    };
    let kernel = FreeLanes::<2, false>::new(&members[0], batch.order, vectors);
    let lanes = LaneSlots::new(kernel, &batch, until);
    let (batch, fits, members_here) = (&batch, &[true; 21][..], &mut members);
    let observer = &mut StepsAlone(&mut watch);
    vectors.run(Integration { lanes, fits, batch, members: members_here, until, observer });
    members.into_iter().map(|member| member.state).collect()
}

#[test]
fn all_vectors_have_the_same_bits() {
    let expected = ends(Vectors::Portable);
    if let Some(four) = Hardware::ask() {
        assert_eq!(ends(Vectors::Two(four)), expected);
    }
    if let Some(wide) = WideHardware::ask() {
        assert_eq!(ends(Vectors::One(wide)), expected);
    }
}
