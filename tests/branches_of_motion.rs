//! Kinematics of four bars that can just, or just not, stretch out in line: against circles that meet.

use driftless::run::kinematics::{KinematicDrive, Kinematics, kinematics};
use driftless::scene::{Scene, parse_scene};
use std::f64::consts::{PI, TAU};

/// Lengths of crank, coupler, rocker and ground, and on which side of the diagonal the coupler's end is.
struct FourBar {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
    side: f64,
}

impl FourBar {
    /// Of three bars, and a ground by which crank and ground exceed coupler and rocker together.
    fn stretched([a, b, c]: [f64; 3], excess: f64, side: f64) -> Self {
        Self { a, b, c, d: b + c - a + excess, side }
    }

    /// Angles of coupler and rocker.
    fn closed(&self, crank: f64) -> [f64; 2] {
        let (x, y) = (self.a * crank.cos(), self.a * crank.sin());
        let (dx, dy) = (self.d - x, -y);
        let distance = dx.hypot(dy);
        let along = (self.b * self.b - self.c * self.c + distance * distance) / (2.0 * distance);
        let up = self.side * (self.b * self.b - along * along).max(0.0).sqrt();
        let (bx, by) = (x + (along * dx - up * dy) / distance, y + (along * dy + up * dx) / distance);
        [(by - y).atan2(bx - x), by.atan2(bx - self.d)]
    }

    /// The angle of the crank at which coupler and rocker are in line, where they reach no farther.
    fn limit(&self) -> f64 {
        let [a, d, reach] = [self.a, self.d, self.b + self.c];
        ((a * a + d * d - reach * reach) / (2.0 * a * d)).acos()
    }

    fn scene(&self, crank: f64) -> Scene {
        let [coupler, rocker] = self.closed(crank);
        let Self { a, b, c, d, .. } = *self;
        let bar = |name: &str, length: f64| {
            format!(
                r#"{{"name": "{name}", "mass": 1, "centre": [0.2, 0], "inertia": 0.1, "length": {length:?}}}"#
            )
        };
        let hinge = |name: &str, one: &str, x: f64, other: &str, y: f64| {
            format!(
                r#"{{"name": "{name}", "between": [{{"body": "{one}", "point": [{x:?}, 0]}},
                    {{"body": "{other}", "point": [{y:?}, 0]}}]}}"#
            )
        };
        let text = format!(
            r#"{{"name": "four_bars", "gravity": [0, -9.81], "bars": [{}, {}, {}], "hinges": [{}, {}, {}, {}],
                "start": {{"crank": {{"phi": {crank:?}}}, "coupler": {{"phi": {coupler:?}}},
                    "rocker": {{"phi": {rocker:?}}}}}, "until": 1, "every": 1}}"#,
            bar("crank", a),
            bar("coupler", b),
            bar("rocker", c),
            hinge("O", "ground", 0.0, "crank", 0.0),
            hinge("A", "crank", a, "coupler", 0.0),
            hinge("B", "coupler", b, "rocker", c),
            hinge("C", "ground", d, "rocker", 0.0),
        );
        parse_scene(&text, "four bars", &[]).expect("a scene")
    }

    fn over(&self, range: [f64; 2], start: f64, count: usize) -> Kinematics {
        let drive = KinematicDrive { name: Some("crank".into()), range: Some(range), rate: Some(1.0) };
        kinematics(&self.scene(start), &drive, count).expect("kinematics")
    }
}

fn turned(a: f64, b: f64) -> f64 {
    (a - b - TAU * ((a - b) / TAU).round()).abs()
}

const BARS: [([f64; 3], f64, f64); 4] = [
    ([0.555, 0.959, 0.946], 1.0, -1.6832),
    ([0.41, 0.72, 0.63], -1.0, 0.37),
    ([0.35, 0.951, 0.832], 1.0, 2.2),
    ([0.37, 0.5, 1.12], -1.0, -0.9),
];

#[test]
fn a_crank_that_just_cannot_stretch_ends_at_its_limits() {
    for (bars, side, start) in BARS {
        for (excess, turns, count) in
            [(1e-3, 1.0, 360), (1e-5, 1.0, 360), (1e-6, 1.0, 360), (1e-5, 40.0, 400)]
        {
            let bar = FourBar::stretched(bars, excess, side);
            let end = bar.limit();
            let found = bar.over([start - TAU * turns, start + TAU * turns], start, count);
            let what = format!("{bars:?} {excess}: {:?}", found.limits);
            assert_eq!(found.limits.len(), 2, "{what}");
            for (limit, end) in found.limits.iter().zip([-end, end]) {
                assert!(limit.is_fold && (limit.drive - end).abs() < 1e-8, "{end} {what}");
            }
            assert!(found.change_points.is_empty() && !found.positions.is_empty(), "{what}");
            for at in &found.positions {
                let [coupler, rocker] = bar.closed(at.drive);
                assert!(at.drive.abs() < end, "{what}");
                assert!(turned(at.phi[1], coupler).max(turned(at.phi[2], rocker)) < 1e-9, "{what}");
            }
        }
    }
}

#[test]
fn a_crank_that_just_can_stretch_stays_on_its_branch() {
    for (bars, side, start) in BARS {
        for (excess, turns, count) in [(-1e-3, 1.0, 360), (-1e-6, 1.0, 360), (-1e-5, 10.0, 100)] {
            let bar = FourBar::stretched(bars, excess, side);
            let found = bar.over([start, start + TAU * turns], start, count);
            let what = format!("{bars:?} {excess}");
            assert!(found.limits.is_empty() && found.change_points.is_empty(), "{what}: {:?}", found.limits);
            assert_eq!(found.positions.len(), count + 1, "{what}");
            for at in &found.positions {
                let [coupler, rocker] = bar.closed(at.drive);
                assert!(
                    turned(at.phi[1], coupler).max(turned(at.phi[2], rocker)) < 1e-9,
                    "{what} {}",
                    at.drive
                );
            }
        }
    }
}

#[test]
fn a_crank_that_stretches_out_exactly_goes_straight_on() {
    for (bars, side, start) in BARS {
        for (turns, count) in [(1.0, 360), (3.0, 31)] {
            let bar = FourBar::stretched(bars, 0.0, side);
            let found = bar.over([start, start + TAU * turns], start, count);
            assert!(found.limits.is_empty(), "{bars:?}: {:?}", found.limits);
            assert_eq!(found.change_points.len() as f64, turns, "{bars:?}: {:?}", found.change_points);
            for at in &found.positions {
                // Behind each change point on the other side.
                let passed = ((at.drive - PI) / TAU).ceil() as i32;
                let side = if passed % 2 == 0 { side } else { -side };
                let [coupler, rocker] = FourBar { side, ..bar }.closed(at.drive);
                let off = turned(at.phi[1], coupler).max(turned(at.phi[2], rocker));
                assert!(off < 1e-6, "{bars:?} {}: {off:e}", at.drive);
            }
        }
    }
}

#[test]
fn a_crank_that_starts_beside_its_limit_goes_away_from_it() {
    for (k, (bars, side, _)) in BARS.into_iter().enumerate() {
        for beside in [1e-6, 1e-7, 1e-8, 1e-9] {
            let bar = FourBar::stretched(bars, 0.05 + 0.07 * k as f64, side);
            let end = bar.limit();
            let start = end - beside;
            for range in [[start - 0.5, start], [start - TAU, start + 0.1]] {
                let found = bar.over(range, start, 50);
                let what = format!("{bars:?} {beside}: {:?}", found.limits);
                let first = found.positions.first().expect("a position");
                assert!((first.drive - range[0].max(-end)).abs() < 0.13, "{what}");
                let ends: Vec<f64> = found.limits.iter().map(|limit| limit.drive).collect();
                let expected = if range[1] > start { vec![-end, end] } else { Vec::new() };
                assert_eq!(ends.len(), expected.len(), "{what}");
                assert!(ends.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{end} {what}");
                for at in found.positions.iter().filter(|at| at.drive < start - 1e-3) {
                    let [coupler, rocker] = bar.closed(at.drive);
                    let off = turned(at.phi[1], coupler).max(turned(at.phi[2], rocker));
                    assert!(off < 1e-9, "{what} {}: {off:e}", at.drive);
                }
            }
        }
    }
}
