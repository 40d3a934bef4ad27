//! Forces from outside the crate: written once over the scalar, they must do in every method what the scene's
//! own parts do.

use driftless::arithmetic::Scalar;
use driftless::dynamics::constraint::Site;
use driftless::dynamics::force::{Force, Loads, UserForce};
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::{CompileError, Configuration, Mechanism};
use driftless::run::trust::Level;
use driftless::run::{Limits, MethodId, Outcome, Plan, Request, Run, Stabilization, integrate};
use driftless::scene::{Scene, read_scene};
use driftless::stepping::composition::Composition;
use std::sync::Arc;

fn scene(name: &str) -> Scene {
    read_scene(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a valid scene")
}

fn run(scene: &Scene, forces: Vec<UserForce>, request: Request) -> Outcome {
    let mechanism = Arc::new(Mechanism::with_forces(scene, forces).expect("equations"));
    let plan =
        Plan::new(scene, &mechanism, &request).unwrap_or_else(|refusal| panic!("{}: {refusal}", scene.name));
    let start = mechanism.start(scene);
    let run = Run::new(mechanism, plan, Limits::default(), &start).expect("a run");
    let outcome = integrate(run.trusted(Level::Off, &start), &mut |_| Ok(())).expect("samples");
    assert!(outcome.stop.is_none(), "{}: {:?}", scene.name, outcome.stop);
    outcome
}

/// The springs and dampers of a scene, written again with nothing but what the door offers.
struct Springs(Vec<(Site, Site, driftless::scene::Spring)>);

impl Springs {
    /// Takes them out of a scene.
    fn of(scene: &mut Scene) -> Self {
        let mechanism = Mechanism::new(scene).expect("equations");
        let springs = std::mem::take(&mut scene.springs);
        let site = |place: driftless::scene::Place| match place.bar {
            Some(bar) => mechanism.site(&scene.bars[bar].name, place.point).expect("a bar"),
            None => Site::ground(place.point),
        };
        Self(
            springs
                .into_iter()
                .map(|spring| (site(spring.between[0]), site(spring.between[1]), spring))
                .collect(),
        )
    }
}

impl Force for Springs {
    fn name(&self) -> &str {
        "springs"
    }

    fn potential<S: Scalar>(&self, at: &Configuration<S>) -> S {
        self.0.iter().fold(S::ZERO, |sum, (a, b, spring)| {
            let ([ax, ay], [bx, by]) = (at.position(a), at.position(b));
            let (dx, dy) = (ax - bx, ay - by);
            let square = dx * dx + dy * dy;
            if spring.free_length == 0.0 {
                return sum + square.scale(0.5 * spring.stiffness);
            }
            let stretch = square.sqrt() - S::of(spring.free_length);
            sum + (stretch * stretch).scale(0.5 * spring.stiffness)
        })
    }

    fn apply<S: Scalar>(&self, at: &Configuration<S>, loads: &mut Loads<S>) {
        for (a, b, spring) in self.0.iter().filter(|(.., spring)| spring.damping != 0.0) {
            let ([ax, ay], [bx, by]) = (at.position(a), at.position(b));
            let ([avx, avy], [bvx, bvy]) = (at.velocity(a), at.velocity(b));
            let (dx, dy) = (ax - bx, ay - by);
            let rate = (dx * (avx - bvx) + dy * (avy - bvy)) / (dx * dx + dy * dy);
            let force = [(dx * rate).scale(-spring.damping), (dy * rate).scale(-spring.damping)];
            loads.force(a, force);
            loads.force(b, force.map(|part| -part));
        }
    }
}

fn methods(step: f64) -> Vec<(MethodId, Request)> {
    let adaptive = |method, rtol| {
        (method, Request { method: Some(method), rtol: Some(rtol), atol: Some(rtol), ..Request::default() })
    };
    let fixed = |method| (method, Request { method: Some(method), step: Some(step), ..Request::default() });
    vec![
        adaptive(MethodId::Dopri5, 1e-10),
        adaptive(MethodId::Dop853, 1e-11),
        adaptive(MethodId::Dp5, 1e-10),
        adaptive(MethodId::Dp8, 1e-12),
        adaptive(MethodId::Taylor, 1e-13),
        (MethodId::Taylor, Request { method: Some(MethodId::Taylor), extended: true, ..Request::default() }),
        adaptive(MethodId::Radau(3), 1e-9),
        adaptive(MethodId::Radau(5), 1e-11),
        fixed(MethodId::Gauss(4)),
        fixed(MethodId::Gauss(8)),
        fixed(MethodId::Rattle(Composition::KahanLi17)),
    ]
}

/// The largest difference of an angle or rate at the end.
fn apart(a: &Outcome, b: &Outcome) -> f64 {
    let pairs = a.last.phi.iter().zip(&b.last.phi).chain(a.last.omega.iter().zip(&b.last.omega));
    pairs.fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}

#[test]
fn springs_from_outside_move_every_scene_as_its_own_do_by_every_method() {
    let mut covered = 0;
    for (name, damping, until) in [
        ("spring", 0.0, 2.0),
        ("spring", 0.2, 2.0),
        ("four_bars", 0.1, 0.5),
        ("motor", 0.0, 1.0),
        ("cart_pole", 0.05, 1.0),
        ("chain8", 0.1, 0.5),
    ] {
        let mut own = scene(name);
        (own.until, own.every) = (until, until);
        if own.springs.is_empty() {
            let last = own.bars.len() - 1;
            own.springs.push(driftless::scene::Spring {
                name: "added".into(),
                between: [
                    driftless::scene::Place { bar: Some(last), point: [0.7 * own.bars[last].length, 0.05] },
                    driftless::scene::Place { bar: None, point: [1.3, -0.9] },
                ],
                stiffness: 3.0,
                free_length: 0.4,
                damping,
                rigid: false,
            });
        }
        own.springs.iter_mut().for_each(|spring| spring.damping = damping);
        let mut other = own.clone();
        let springs = UserForce::record(&Springs::of(&mut other)).expect("a force");
        let reference = run(
            &own,
            Vec::new(),
            Request { method: Some(MethodId::Taylor), rtol: Some(1e-14), ..Request::default() },
        );
        for (method, request) in methods(1e-3) {
            let is_rattle = matches!(method, MethodId::Rattle(_));
            // Those that the mechanism itself keeps out with springs of its own.
            let mechanism = Mechanism::new(&own).expect("equations");
            if Plan::new(&own, &mechanism, &request).is_err() {
                continue;
            }
            let from_outside = run(&other, vec![springs.clone()], request.clone());
            let off = apart(&reference, &from_outside);
            let bound = if is_rattle { 3e-7 } else { 3e-8 };
            assert!(off < bound, "{name} with damping {damping} by {method}: {off:e}");
            let drift = from_outside.drift.energy.max;
            assert!(
                drift < 1e-8,
                "{name} with damping {damping} by {method}: the balance drifts by {drift:e}"
            );
            covered += 1;
        }
    }
    assert!(covered >= 45, "{covered} pairs of scene and method");
}

/// A torque of a motor with a PD law, gravity of a point mass, a gust that depends on time, and a winding
/// spring: every kind of input there is.
struct Everything {
    tip: Site,
    body: usize,
}

impl Force for Everything {
    fn name(&self) -> &str {
        "everything"
    }

    fn potential<S: Scalar>(&self, at: &Configuration<S>) -> S {
        let [x, y] = at.position(&self.tip);
        let (dx, dy) = (x - S::of(3.0), y + S::of(0.5));
        let twist = at.angle(self.body) - S::of(0.3);
        let [cos, sin] = at.direction(self.body);
        -S::of(0.8) / (dx * dx + dy * dy).sqrt() + (twist * twist).scale(0.02) + (cos * sin).scale(0.05)
    }

    fn apply<S: Scalar>(&self, at: &Configuration<S>, loads: &mut Loads<S>) {
        let gust = (at.time().scale(3.0)).sin_cos().0.scale(0.1);
        let [vx, vy] = at.velocity(&self.tip);
        let speed = (vx * vx + vy * vy + S::of(1e-6)).sqrt();
        loads.force(&self.tip, [gust - (vx * speed).scale(0.01), -(vy * speed).scale(0.01)]);
        loads.torque(self.body, (at.rate(self.body).tanh() + at.rate(self.body)).scale(-0.01));
    }
}

#[test]
fn all_methods_agree_on_a_force_of_everything_and_keep_its_balance() {
    for name in ["free", "motor", "four_bars", "chain8", "cart_pole"] {
        let mut own = scene(name);
        (own.until, own.every) = (0.5, 0.5);
        let mechanism = Mechanism::new(&own).expect("equations");
        let bar = own.bars.last().expect("a bar");
        let body = mechanism.body(&bar.name).expect("a body");
        let force = Everything { tip: mechanism.site(&bar.name, [bar.length, 0.02]).expect("a site"), body };
        let force = UserForce::record(&force).expect("a force");
        // By another formulation than all others: Radau's Newton with the Jacobian of dual numbers.
        let radau = Request {
            method: Some(MethodId::Radau(5)),
            rtol: Some(1e-13),
            atol: Some(1e-13),
            ..Request::default()
        };
        let reference = run(&own, vec![force.clone()], radau);
        let without = run(&own, Vec::new(), Request { method: Some(MethodId::Taylor), ..Request::default() });
        assert!(apart(&reference, &without) > 1e-3, "{name} does not feel the force");
        let mut covered = 0;
        for (method, request) in methods(1e-3) {
            let mechanism = Mechanism::with_forces(&own, vec![force.clone()]).expect("equations");
            if Plan::new(&own, &mechanism, &request).is_err() {
                assert!(
                    !matches!(method, MethodId::Taylor | MethodId::Dp8 | MethodId::Radau(_)),
                    "{name} by {method} is refused"
                );
                continue;
            }
            let outcome = run(&own, vec![force.clone()], request);
            let (off, drift) = (apart(&reference, &outcome), outcome.drift.energy.max);
            assert!(off < 3e-8, "{name} by {method}: {off:e}");
            assert!(drift < 1e-8, "{name} by {method}: the balance drifts by {drift:e}");
            covered += 1;
        }
        assert!(covered >= 7, "{name}: {covered} methods");
    }
}

#[test]
fn projection_and_baumgarte_take_forces_too() {
    let mut own = scene("motor");
    (own.until, own.every) = (1.0, 1.0);
    let mechanism = Mechanism::new(&own).expect("equations");
    let force = Everything { tip: mechanism.site("bar2", [0.6, 0.0]).expect("a site"), body: 1 };
    let force = UserForce::record(&force).expect("a force");
    let taylor = Request { method: Some(MethodId::Taylor), rtol: Some(1e-14), ..Request::default() };
    let reference = run(&own, vec![force.clone()], taylor);
    for stabilize in [Stabilization::None, Stabilization::Baumgarte, Stabilization::Projection] {
        for method in [MethodId::Dp8, MethodId::Taylor] {
            let request = Request {
                method: Some(method),
                rtol: Some(1e-12),
                atol: Some(1e-12),
                stabilize: Some(stabilize),
                ..Request::default()
            };
            let mechanism = Mechanism::with_forces(&own, vec![force.clone()]).expect("equations");
            if Plan::new(&own, &mechanism, &request).is_err() {
                continue;
            }
            let off = apart(&reference, &run(&own, vec![force.clone()], request));
            assert!(off < 1e-8, "{method} with {stabilize}: {off:e}");
        }
    }
}

#[test]
fn hinges_carry_a_spring_from_outside_as_one_of_the_scene() {
    let own = scene("spring");
    let mut other = own.clone();
    let springs = UserForce::record(&Springs::of(&mut other)).expect("a force");
    let [own, other] = [Mechanism::new(&own), Mechanism::with_forces(&other, vec![springs])]
        .map(|mechanism| mechanism.expect("equations"));
    let (phi, omega) = ([0.7, -1.1], [2.0, -3.0]);
    let forces = [own, other].map(|mechanism| {
        let mut kernel = Kernel::<f64>::new(&mechanism);
        kernel.accelerations(&mechanism, Default::default(), &phi, &omega, Bias::default());
        mechanism.hinge_forces(Default::default(), &kernel, &phi, &omega)
    });
    for (own, other) in forces[0].iter().zip(&forces[1]) {
        assert!((*own - *other).norm_squared().sqrt() < 1e-13, "{own:?} {other:?}");
    }
}

#[test]
fn the_error_estimate_holds_with_a_force_from_outside() {
    let mut own = scene("free");
    (own.until, own.every) = (4.0, 0.5);
    let mechanism = Mechanism::new(&own).expect("equations");
    let tip = mechanism.site("bar2", [0.6, 0.0]).expect("a site");
    let force = UserForce::record(&Everything { tip, body: 1 }).expect("a force");
    let mechanism = Arc::new(Mechanism::with_forces(&own, vec![force.clone()]).expect("equations"));
    let request =
        Request { method: Some(MethodId::Dp8), rtol: Some(1e-8), atol: Some(1e-8), ..Request::default() };
    let plan = Plan::new(&own, &mechanism, &request).expect("a plan");
    let start = mechanism.start(&own);
    let run_with_estimate =
        Run::new(mechanism, plan, Limits::default(), &start).expect("a run").trusted(Level::Auto, &start);
    let outcome = integrate(run_with_estimate, &mut |_| Ok(())).expect("samples");
    let exact = run(
        &own,
        vec![force],
        Request { method: Some(MethodId::Taylor), extended: true, ..Request::default() },
    );
    let estimate = outcome.trust.as_ref().and_then(|trust| trust.error_estimate).expect("an estimate");
    let error =
        outcome.last.phi.iter().zip(&exact.last.phi).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    assert!(estimate > error / 3.0 && estimate < 10.0 * error.max(1e-13), "{estimate:e} for {error:e}");
}

struct Wrong;

impl Force for Wrong {
    fn name(&self) -> &str {
        "wrong"
    }

    fn potential<S: Scalar>(&self, at: &Configuration<S>) -> S {
        at.rate(0) * at.rate(0)
    }
}

struct Elsewhere;

impl Force for Elsewhere {
    fn name(&self) -> &str {
        "elsewhere"
    }

    fn apply<S: Scalar>(&self, _at: &Configuration<S>, loads: &mut Loads<S>) {
        loads.torque(7, S::ONE);
    }
}

#[test]
fn what_cannot_be_right_is_refused() {
    assert_eq!(UserForce::record(&Wrong), Err(CompileError::NoPotential("wrong".into())));
    let elsewhere = UserForce::record(&Elsewhere).expect("a force of some mechanism");
    assert_eq!(
        Mechanism::with_forces(&scene("free"), vec![elsewhere]).err(),
        Some(CompileError::ForeignForce("elsewhere".into()))
    );
    let mechanism = Mechanism::new(&scene("free")).expect("equations");
    assert_eq!(mechanism.site("bar9", [0.0; 2]).err(), Some(CompileError::NoSuchBar("bar9".into())));
}

/// Spoils a scene.
type Edit = fn(&mut Scene);

/// Fields that a program may get wrong, one at a time.
fn spoilt() -> Vec<(&'static str, Scene)> {
    let edits: [(&str, Edit); 12] = [
        ("bars", |scene| scene.bars.clear()),
        ("start", |scene| scene.start.truncate(1)),
        ("hinges", |scene| scene.hinges[1].between[1].bar = Some(9)),
        ("itself", |scene| scene.hinges[1].between[1].bar = Some(0)),
        ("bars", |scene| scene.bars[0].mass = f64::NAN),
        ("bars", |scene| scene.bars[0].mass = 0.0),
        ("bars", |scene| scene.bars[1].inertia = -1.0),
        ("gravity", |scene| scene.gravity[0] = f64::INFINITY),
        ("start", |scene| scene.start[0].omega = f64::NAN),
        ("springs", |scene| scene.springs[0].between[0].bar = Some(2)),
        ("springs", |scene| scene.springs[0].stiffness = -1.0),
        ("springs", |scene| scene.springs[0].between[1].point[0] = f64::NAN),
    ];
    let spoil = |(what, edit): (&'static str, Edit)| {
        let mut spoilt = scene("spring");
        edit(&mut spoilt);
        (what, spoilt)
    };
    edits.into_iter().map(spoil).collect()
}

#[test]
fn a_scene_put_together_wrongly_is_an_error_and_no_panic() {
    for (what, scene) in spoilt() {
        let Err(CompileError::Unsound(fault)) = Mechanism::new(&scene) else { panic!("{what} is taken") };
        assert!(fault.contains(what), "{what}: {fault}");
    }
}
