//! Boxes and balls in corners between rough walls, where friction at one wall acts as the push of another one:
//! against the conditions that impulses have to meet, turned as a whole, and with many digits.

use super::breaking_away::done;
use super::formulas::{adaptive, scene};
use super::friction_impacts::share;
use driftless::Mechanism;
use driftless::run::MethodId;

/// A point or direction in the plane.
type Vector = [f64; 2];

/// A point or direction turned by an angle \[rad\].
fn turned(angle: f64, [x, y]: Vector) -> Vector {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

/// A wall for a point of the body: where it goes through, its normal, restitution, kinetic and static coefficient.
fn wall(
    name: &str,
    point: Vector,
    [through, normal]: [Vector; 2],
    restitution: f64,
    [kinetic, stiction]: [f64; 2],
) -> String {
    format!(
        r#"{{"name": "{name}", "body": "body", "point": {point:?}, "restitution": {restitution},
        "line": {{"through": {through:?}, "normal": {normal:?}}}, "friction": {{"kinetic": {kinetic}, "static": {stiction}}}}}"#
    )
}

/// A box of 30 cm by 20 cm between walls.
fn boxed(gravity: [f64; 2], walls: &[String], start: &str, until: &str) -> String {
    format!(
        r#"{{"name": "box", "gravity": {gravity:?}, "bars": [{{"name": "body", "mass": 1, "centre": [0, 0],
            "inertia": 0.01, "length": 0.3}}], "walls": [{}], "start": {{"body": {{{start}}}}},
        "until": {until}, "every": {until}}}"#,
        walls.join(", ")
    )
}

/// A floor that shakes, for a lower corner of the box.
#[cfg(feature = "digits")]
fn shaking(name: &str, x: f64, law: &str, [restitution, mu]: [f64; 2]) -> String {
    format!(
        r#"{{"name": "{name}", "body": "body", "point": [{x}, -0.1], "law": "{law}", "restitution": {restitution},
        "line": {{"through": [0, 0], "normal": [0, 1]}}, "friction": {{"kinetic": {mu}, "static": {mu}}}}}"#
    )
}

/// A box on two floors that shake apart: the friction of the bounces that end at one corner carries its sliding
/// beyond rest, and the other one still bounces.
#[cfg(feature = "digits")]
#[test]
fn bounces_that_end_may_turn_the_sliding_of_a_corner() {
    use super::many_digits::bodies_at_end;
    let walls = [
        shaking("left", -0.15, "0.0172*sin(8.21*t)", [0.8, 0.284]),
        shaking("right", 0.15, "0.0148*sin(10.83*t)", [0.8, 0.536]),
        r#"{"name": "side", "body": "body", "point": [0.15, -0.1], "restitution": 0.8,
            "line": {"through": [0.5, 0], "normal": [-1, 0]}, "friction": {"kinetic": 0.806}}"#
            .to_owned(),
    ];
    let start = r#""phi": 0.02, "omega": 1.57, "origin": [0.19, 0.43], "velocity": [-0.17, 0.07]"#;
    let text = boxed([0.0, -9.81], &walls, start, "2");
    let [phi, omega, ..] = bodies_at_end(&text, "2", 22)[0];
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        let outcome = done(&text, &adaptive(method, 1e-9));
        let off = [outcome.last.phi[0] - phi, outcome.last.omega[0] - omega];
        assert!(off.iter().all(|off| off.abs() < 1e-12), "{method}: {off:?}");
    }
}

/// An upper corner that bounces against a side wall is pressed to it by the friction of the lower ones alone, and
/// comes to rest there.
#[cfg(feature = "digits")]
#[test]
fn a_corner_pressed_by_the_friction_of_others_comes_to_rest() {
    use super::many_digits::bodies_at_end;
    let walls = [
        shaking("left", -0.15, "0.0199*sin(10.04*t)", [0.3, 0.556]),
        shaking("right", 0.15, "0.0139*sin(6.31*t)", [0.3, 0.372]),
        r#"{"name": "side", "body": "body", "point": [0.15, 0.1], "restitution": 0.3,
            "line": {"through": [0.5, 0], "normal": [-1, 0]}}"#
            .to_owned(),
    ];
    let start = r#""phi": 0.06, "omega": -1.48, "origin": [0.16, 0.26], "velocity": [0.35, -0.09]"#;
    let push = r#""forces": [{"name": "push", "body": "body", "point": [-0.08, -0.01],
        "force": ["4.99*sin(5.53*t+0.96)", 0]}], "start""#;
    let text = boxed([0.0, -9.81], &walls, start, "0.7").replace(r#""start""#, push);
    let [phi, omega, ..] = bodies_at_end(&text, "0.7", 22)[0];
    for method in [MethodId::Taylor, MethodId::Dp8, MethodId::Radau(5)] {
        let outcome = done(&text, &adaptive(method, 1e-11));
        let off = [outcome.last.phi[0] - phi, outcome.last.omega[0] - omega];
        assert!(off.iter().all(|off| off.abs() < 1e-9), "{method}: {off:?}");
    }
}

/// A box in a chute: between a slope and its ends.
struct Chute {
    /// Angle of the slope \[rad\].
    slope: f64,
    restitution: f64,
    /// Kinetic and static coefficients of the slope at the lower and the upper corner, and of the ends at the top
    /// and at the bottom.
    coefficients: [[f64; 2]; 4],
    /// Angle and spin at the start \[rad, rad/s\].
    turned: [f64; 2],
    origin: Vector,
    velocity: Vector,
}

/// One corner meets the slope and the lower end at once, again and again.
const HALF: Chute = Chute {
    slope: 0.35,
    restitution: 0.5,
    coefficients: [[0.162, 0.162], [0.348, 0.4524], [0.774, 0.774], [0.144, 0.1872]],
    turned: [0.35, -0.79],
    origin: [0.0, 0.29],
    velocity: [-0.13, -0.88],
};

/// A corner that rests on the slope is struck by the lower end, which it cannot slide along.
const STEEP: Chute = Chute {
    slope: 0.53,
    restitution: 0.5,
    coefficients: [[0.218, 0.2834], [0.817, 1.0621], [0.142, 0.142], [0.341, 0.4433]],
    turned: [0.53, -0.7],
    origin: [0.0, 0.3],
    velocity: [0.83, 0.84],
};

/// One corner ends bouncing just before the other one is struck.
#[cfg(feature = "digits")]
const LIVELY: Chute = Chute {
    slope: 0.32,
    restitution: 0.8,
    coefficients: [[0.616, 0.616], [0.278, 0.278], [0.689, 0.689], [0.897, 0.897]],
    turned: [0.32, -1.02],
    origin: [0.0, 0.29],
    velocity: [-0.69, 0.33],
};

/// The lower corner sticks to the bottom, and touches the slope without a force, when the upper one lands.
const PINNED: Chute = Chute {
    slope: 0.56,
    restitution: 0.3,
    coefficients: [[0.607, 0.607], [0.821, 0.821], [0.3181, 0.4134], [0.849, 0.849]],
    turned: [-0.19, 1.9],
    origin: [0.0, 0.37],
    velocity: [-0.37, -0.95],
};

impl Chute {
    /// All of it, with its gravity, turned by an angle \[rad\].
    fn text(&self, turn: f64, until: &str) -> String {
        let turned = |vector: Vector| turned(turn, vector);
        let (sin, cos) = (self.slope + turn).sin_cos();
        let wall = |name: &str, x: f64, through: f64, normal: Vector, friction: [f64; 2]| {
            wall(name, [x, -0.1], [turned([through, 0.0]), normal], self.restitution, friction)
        };
        let [lower, upper, top, bottom] = self.coefficients;
        let walls = [
            wall("lower", -0.15, 0.0, [-sin, cos], lower),
            wall("upper", 0.15, 0.0, [-sin, cos], upper),
            wall("top", 0.15, 0.9, [-cos, -sin], top),
            wall("bottom", -0.15, -0.9, [cos, sin], bottom),
        ];
        let start = format!(
            r#""phi": {}, "omega": {}, "origin": {:?}, "velocity": {:?}"#,
            self.turned[0] + turn,
            self.turned[1],
            turned(self.origin),
            turned(self.velocity)
        );
        boxed(turned([0.0, -9.81]), &walls, &start, until)
    }
}

/// Where one corner meets both walls of the chute, friction at one of them acts as the push of the other: what the
/// motion leaves open must not be left to rounding, which differs from angle to angle and from step to step.
#[test]
fn a_corner_between_two_rough_walls_does_the_same_however_it_is_turned() {
    let expected = done(&HALF.text(0.0, "0.96"), &adaptive(MethodId::Taylor, 1e-12)).last;
    for turn in [0.0, 0.4, -0.35, 1.3, -2.1, 3.0] {
        for (method, tolerance) in [
            (MethodId::Taylor, 1e-9),
            (MethodId::Taylor, 1e-12),
            (MethodId::Dp8, 1e-9),
            (MethodId::Dp8, 1e-12),
            (MethodId::Radau(5), 1e-11),
        ] {
            let last = done(&HALF.text(turn, "0.96"), &adaptive(method, tolerance)).last;
            let off = [last.phi[0] - turn - expected.phi[0], last.omega[0] - expected.omega[0]];
            assert!(off.iter().all(|off| off.abs() < 1e-7), "{method} {tolerance:e} at {turn}: {off:?}");
        }
    }
}

/// A box in a chute, where what holds two of its corners cannot hold them without the third, whose bounces end:
/// taken from a flight beside them, friction would give 678681 J.
#[cfg(feature = "digits")]
#[test]
fn friction_beside_bounces_that_end_takes_energy_off_only() {
    use super::many_digits::{last, source};
    use driftless::arithmetic::Real;
    let text = HALF.text(0.0, "1.3");
    let expected = done(&text, &adaptive(MethodId::Taylor, 1e-11)).last.friction;
    for digits in [22, 30] {
        let row = last(&source(&text, &[], "1.3", "1.3"), digits);
        let lost = row.friction.expect("friction").value();
        // What friction takes within bounces that are left out counts as lost in impacts there.
        assert!((lost - expected).abs() < 1e-5, "{digits}: {lost} J for {expected} J");
    }
}

/// A point whose bounces are left out, but still last, is found in flight by an impact at the other corner.
#[cfg(feature = "digits")]
#[test]
fn an_impact_finds_a_point_whose_bounces_last_in_flight() {
    use super::many_digits::bodies_at_end;
    let text = LIVELY.text(0.0, "1.552");
    let [phi, ..] = bodies_at_end(&text, "1.552", 22)[0];
    for method in [MethodId::Taylor, MethodId::Dp8] {
        let outcome = done(&text, &adaptive(method, 1e-12)).last;
        let off = phi - outcome.phi[0];
        assert!(off.abs() < 2e-10, "{method}: {off:e}");
    }
}

/// Along a wall where another one holds it no friction acts on a point: by which sign it would, were left to rounding,
/// which let the point rest on the slope or leave it.
#[test]
fn a_corner_held_along_a_wall_that_strikes_it_does_the_same_however_it_is_turned() {
    let expected = done(&STEEP.text(0.0, "1.54"), &adaptive(MethodId::Taylor, 1e-12)).last;
    for turn in [0.0, 0.4, -0.35, 1.3, -2.1, 3.0] {
        for (method, tolerance) in [
            (MethodId::Taylor, 1e-10),
            (MethodId::Taylor, 1e-12),
            (MethodId::Dp8, 1e-11),
            (MethodId::Radau(5), 1e-11),
        ] {
            let last = done(&STEEP.text(turn, "1.54"), &adaptive(method, tolerance)).last;
            let off = last.phi[0] - turn - expected.phi[0];
            assert!(off.abs() < 1e-7, "{method} {tolerance:e} at {turn}: {off:e}");
        }
    }
}

/// An impact presses a point that touches a wall without a force as it does one that is held: which of them it is
/// must not be left to rounding.
#[test]
fn a_corner_that_touches_without_a_force_takes_part_in_the_impact_of_another() {
    let expected = done(&PINNED.text(0.0, "2"), &adaptive(MethodId::Taylor, 1e-12)).last;
    #[cfg(feature = "digits")]
    {
        use super::many_digits::bodies_at_end;
        let off = bodies_at_end(&PINNED.text(0.0, "2"), "2", 22)[0][0] - expected.phi[0];
        assert!(off.abs() < 1e-9, "many digits: {off:e}");
    }
    for turn in [0.0, 0.4, -2.1] {
        for (method, tolerance) in [
            (MethodId::Taylor, 1e-9),
            (MethodId::Taylor, 1e-12),
            (MethodId::Dp8, 1e-10),
            (MethodId::Dp8, 1e-11),
            (MethodId::Radau(5), 1e-11),
        ] {
            let last = done(&PINNED.text(turn, "2"), &adaptive(method, tolerance)).last;
            let off = last.phi[0] - turn - expected.phi[0];
            assert!(off.abs() < 1e-8, "{method} {tolerance:e} at {turn}: {off:e}");
        }
    }
}

/// The box at rest as it lies at an angle, its impact in a corner, and what the impulses at its walls have to be.
struct Corner {
    angle: f64,
    /// Point of the box, its normal in the world, and coefficient of friction.
    walls: Vec<(Vector, Vector, f64)>,
    /// Velocity of the centre and spin \[m/s, rad/s\].
    before: [f64; 3],
}

impl Corner {
    const MASS: f64 = 1.0;
    const INERTIA: f64 = 0.01;

    /// From the centre to a point of the box.
    fn lever(&self, point: Vector) -> Vector {
        turned(self.angle, point)
    }

    fn mechanism(&self, restitution: f64) -> Mechanism {
        let wall = |(k, &(point, normal, mu)): (usize, &(Vector, Vector, f64))| {
            wall(&format!("wall{k}"), point, [self.lever(point), normal], restitution, [mu, mu])
        };
        let walls: Vec<String> = self.walls.iter().enumerate().map(wall).collect();
        let [vx, vy, spin] = self.before;
        let start =
            format!(r#""phi": {}, "omega": {spin}, "origin": [0, 0], "velocity": [{vx}, {vy}]"#, self.angle);
        Mechanism::new(&scene(&boxed([0.0, -9.81], &walls, &start, "1"))).expect("equations")
    }

    /// Velocities of the point at a wall along its normal and along the wall, the normal turned clockwise.
    fn velocity(&self, wall: usize, [vx, vy, spin]: [f64; 3]) -> Vector {
        let (point, [nx, ny], _) = self.walls[wall];
        let [x, y] = self.lever(point);
        let [vx, vy] = [vx - spin * y, vy + spin * x];
        [vx * nx + vy * ny, vx * ny - vy * nx]
    }

    /// Impulses and velocities after an impact; `None` where no point approaches.
    fn after(&self, restitution: f64) -> Option<(Vec<Vector>, [f64; 3])> {
        let all: Vec<usize> = (0..self.walls.len()).collect();
        let approaches = |&wall: &usize| self.velocity(wall, self.before)[0] < -1e-3;
        all.iter().any(approaches).then_some(())?;
        let [vx, vy, spin] = self.before;
        let (phi, omega) = ([self.angle, 0.0, 0.0], [spin, vx, vy]);
        let mechanism = self.mechanism(restitution);
        let impacts = mechanism.impact_at_several(&all, Default::default(), &phi, &omega);
        let impacts = impacts.unwrap_or_else(|| panic!("no impulses: {:?} {:?}", self.walls, self.before));
        let mut impulses = vec![[0.0; 2]; all.len()];
        for blow in &impacts.blows {
            impulses[blow.contact] = [blow.impulse, blow.tangential];
        }
        let [spin, vx, vy] = impacts.omega[..] else { panic!("three coordinates") };
        Some((impulses, [vx, vy, spin]))
    }

    /// Momentum and spin are those of the impulses.
    fn balances(&self, impulses: &[Vector], after: [f64; 3]) {
        let mut given = [0.0; 3];
        for (&(point, [nx, ny], _), [normal, along]) in self.walls.iter().zip(impulses) {
            let ([x, y], [px, py]) =
                (self.lever(point), [nx * normal + ny * along, ny * normal - nx * along]);
            given = [given[0] + px, given[1] + py, given[2] + x * py - y * px];
        }
        for (k, inertia) in [Self::MASS, Self::MASS, Self::INERTIA].into_iter().enumerate() {
            let off = inertia * (after[k] - self.before[k]) - given[k];
            assert!(off.abs() < 1e-10, "{k}: {off:e} of {:?} at {:?}", self.before, self.walls);
        }
    }

    fn energy([vx, vy, spin]: [f64; 3]) -> f64 {
        0.5 * (Self::MASS * (vx * vx + vy * vy) + Self::INERTIA * spin * spin)
    }
}

/// Plastic impacts meet the conditions of contact and of Coulomb's law one by one, elastic ones balance and lose
/// energy; there always are such impulses (Stewart 2000, SIAM Review 42, section 4.2).
#[test]
fn impulses_in_corners_are_found_and_meet_the_conditions_of_contact_and_friction() {
    let (left, right) = ([-0.15, -0.1], [0.15, -0.1]);
    let (mut met, mut slid, mut stuck, mut free) = ([0; 5], 0, 0, 0);
    for k in 0..3000_u32 {
        let of = |salt: u32| share(k, salt);
        let (angle, kind) = (6.2 * of(1) - 3.1, (k % 5) as usize);
        let facing = |turn: f64| {
            let (sin, cos) = (angle + turn).sin_cos();
            [-sin, cos]
        };
        let (floor, side, lean) =
            (facing(0.0), facing(std::f64::consts::FRAC_PI_2), facing(0.3 + 2.4 * of(2)));
        let mu = |salt: u32| 1.2 * of(salt);
        let walls = match kind {
            0 => vec![(left, floor, mu(3)), (right, floor, mu(4))],
            1 => vec![(left, floor, mu(3)), (right, floor, mu(4)), (right, side, mu(5))],
            2 => vec![(right, floor, mu(3)), (right, side, mu(4))],
            3 => vec![(left, floor, mu(3)), (right, lean, mu(4))],
            _ => vec![(right, floor, mu(3)), (right, lean, mu(4))],
        };
        // Half of them move along or about one of the walls, whose point just touches.
        let [vx, vy, spin] = [4.0 * of(6) - 2.0, 4.0 * of(7) - 2.0, 8.0 * of(8) - 4.0];
        let corner = Corner { angle, walls, before: [vx, vy, spin] };
        let (_, normal, _) = corner.walls[0];
        let inward = corner.velocity(0, corner.before)[0];
        let before = if of(9) < 0.5 {
            [vx - inward * normal[0], vy - inward * normal[1], spin]
        } else {
            corner.before
        };
        let corner = Corner { before, ..corner };
        let Some((impulses, after)) = corner.after(0.0) else { continue };
        met[kind] += 1;
        corner.balances(&impulses, after);
        for (wall, &[normal, along]) in impulses.iter().enumerate() {
            let ([leaving, sliding], mu) = (corner.velocity(wall, after), corner.walls[wall].2);
            let told = format!("{wall}: {leaving} {sliding} by {normal} {along} at {:?}", corner.walls);
            assert!(normal >= -1e-10 && leaving >= -1e-10 && normal * leaving < 1e-9, "{told}");
            assert!(along.abs() <= mu * normal + 1e-9, "{told}");
            if sliding.abs() > 1e-9 {
                assert!((along + sliding.signum() * mu * normal).abs() < 1e-9, "{told}");
            }
            let count = match (normal > 1e-9, sliding.abs() > 1e-9) {
                (false, _) => &mut free,
                (true, true) => &mut slid,
                (true, false) => &mut stuck,
            };
            *count += 1;
        }
        let (impulses, after) = corner.after(of(10)).expect("the same");
        corner.balances(&impulses, after);
        assert!(Corner::energy(after) <= Corner::energy(corner.before) + 1e-10, "{:?}", corner.walls);
    }
    println!("impacts by kind of corner {met:?}: {slid} points slide, {stuck} stick, {free} are free");
    assert!(met.iter().all(|&met| met > 150) && [slid, stuck, free].iter().all(|&count| count > 300));
}

/// A ball that came to rest between two walls, pushed to and fro, stays there; at times one of the walls alone can
/// hold it, and both supports at their limits share the load before.
#[test]
fn a_ball_between_two_walls_rests_while_its_load_swings() {
    for ([left, right], [mu, other], push) in [
        (
            [[0.5480239367918736, 0.8364626499151869], [-0.7379313711099627, 0.6748757600712672]],
            [0.668, 0.143],
            "4.33*sin(5.9*t+1.43)",
        ),
        (
            [[0.7512804051402927, 0.6599831458849822], [-0.8723554823449863, 0.4888720818605275]],
            [0.483, 0.536],
            "6.62*sin(6.95*t+3.39)",
        ),
    ] {
        let text = format!(
            r#"{{"name": "ball", "gravity": [0, -9.81], "bars": [{{"name": "body", "mass": 1, "centre": [0, 0], "inertia": 0.01}}],
            "walls": [{}, {}], "forces": [{{"name": "push", "body": "body", "point": [0, 0], "force": ["{push}", 0]}}],
            "start": {{"body": {{"phi": 0, "omega": 0, "origin": [-0.19, 0.44], "velocity": [0.03, -0.39]}}}},
            "until": 4, "every": 4}}"#,
            wall("left", [0.0; 2], [[0.0; 2], left], 0.3, [mu, mu]),
            wall("right", [0.0; 2], [[0.0; 2], right], 0.3, [other, other])
        );
        for (method, tolerance) in
            [(MethodId::Taylor, 1e-10), (MethodId::Dp8, 1e-10), (MethodId::Radau(5), 1e-10)]
        {
            let outcome = done(&text, &adaptive(method, tolerance));
            assert!(
                outcome.last.phi[1..].iter().all(|x| x.abs() < 1e-10),
                "{method}: {:?}",
                outcome.last.phi
            );
        }
    }
}

/// A box that ends bouncing on its corner: the friction of the bounces left out carries it beyond rest, in many
/// digits as well.
#[cfg(feature = "digits")]
#[test]
fn bounces_that_end_may_turn_the_sliding_in_many_digits() {
    use super::many_digits::bodies_at_end;
    let wall = |name: &str, x: f64, through: f64, normal: Vector, mu: f64| {
        wall(name, [x, -0.1], [[through, 0.0], normal], 0.8, [mu, mu])
    };
    let walls = [
        wall("left", -0.15, 0.0, [0.0, 1.0], 0.417),
        wall("right", 0.15, 0.0, [0.0, 1.0], 0.381),
        wall("side", 0.15, 0.5, [-1.0, 0.0], 0.603),
    ];
    let start = r#""phi": -0.11, "omega": -1.54, "origin": [0.02, 0.49], "velocity": [0.06, 0.81]"#;
    let text = boxed([0.0, -9.81], &walls, start, "2");
    let expected = done(&text, &adaptive(MethodId::Taylor, 1e-12)).last;
    for digits in [22, 30] {
        let off = bodies_at_end(&text, "2", digits)[0][0] - expected.phi[0];
        assert!(off.abs() < 1e-9, "{digits}: {off:e}");
    }
}
