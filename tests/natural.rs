//! Natural coordinates of any mechanism against the angle form: accelerations, multipliers, hinge forces.

use crate::common;
use crate::natural_solve::accelerations;
use crate::trees;

use driftless::arithmetic::Complex;
use driftless::dynamics::constraint::Site;
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::natural::{Natural, NaturalError};
use driftless::dynamics::{Form, Mechanism, Motion, Time};
use driftless::scene::{
    Drive, Force, Given, Hinge, Law, Lock, Place, Rail, Scene, Sine, Slider, Torque, TorsionSpring,
};
use proptest::prelude::*;
use std::sync::Arc;
use trees::{Dice, tree};

type C = Complex<f64>;

/// Where the bodies of a scene are, as its own equations say.
struct Configuration {
    mechanism: Mechanism,
    kernel: Kernel<f64>,
    translations: Vec<C>,
}

impl Configuration {
    fn new(scene: &Scene, motion: impl Fn(&Mechanism) -> Motion) -> Option<Self> {
        let mechanism = Mechanism::new(scene).ok()?;
        let phi: Vec<f64> = motion(&mechanism).phi.iter().map(|phi| phi.hi).collect();
        let mut kernel = Kernel::new(&mechanism);
        kernel.unit_vectors::<0>(&mechanism, &phi);
        let mut translations = vec![C::ZERO; mechanism.bodies.len()];
        mechanism.forest.translations(&kernel.z, &mut translations);
        Some(Self { mechanism, kernel, translations })
    }

    /// A place of a bar in the world.
    fn at(&self, place: Place) -> C {
        let point = C::new(place.point[0], place.point[1]);
        place.bar.map_or(point, |bar| {
            self.translations[bar] + self.kernel.z[bar] * (point - self.mechanism.forest.hangs[bar].own)
        })
    }

    /// The place of a bar that is at a point of the world.
    fn place(&self, bar: Option<usize>, at: C) -> Place {
        let point = bar.map_or(at, |bar| {
            self.mechanism.forest.hangs[bar].own + self.kernel.z[bar].conj() * (at - self.translations[bar])
        });
        Place { bar, point: [point.re, point.im] }
    }

    /// A direction of the world in the frame of a bar.
    fn direction(&self, bar: Option<usize>, direction: C) -> C {
        bar.map_or(direction, |bar| self.kernel.z[bar].conj() * direction)
    }
}

/// A law that starts at this value.
fn law(value: f64, dice: &mut Dice) -> Law {
    let sine = Sine {
        amplitude: dice.within(0.1, 0.5),
        frequency: dice.within(1.0, 5.0),
        phase: dice.within(-3.0, 3.0),
    };
    let start = value - sine.amplitude * sine.phase.sin();
    Law {
        start,
        rate: dice.within(-2.0, 2.0),
        acceleration: dice.within(-1.0, 1.0),
        sines: vec![sine],
        profile: None,
    }
}

/// A tree with some of everything natural coordinates take: a body hung on nothing, pins, sliders and slots
/// with and without a law of travel, locks, a motor, constant forces.  All of it fits the configuration at the
/// start.
fn mechanism(n: usize, seed: u64) -> Option<Scene> {
    let dice = &mut Dice::new(seed);
    let mut scene = tree(n, false, dice);
    scene.springs.iter_mut().for_each(|spring| spring.damping = 0.0);
    // Rates are put onto the rows when the scene is compiled.
    scene.given = vec![Given { omega: false, ..Given::ANGLE_AND_RATE }; n];
    if dice.pick(3) == 0 {
        let loose = dice.pick(scene.hinges.len());
        scene.hinges.remove(loose);
    }
    let configuration = Configuration::new(&scene, |mechanism| mechanism.start(&scene))?;
    let other =
        |bar: usize, dice: &mut Dice| Some(dice.pick(n + 1)).filter(|&other| other < n && other != bar);
    for extra in 0..1 + dice.pick(3) {
        let bar = dice.pick(n);
        let base = other(bar, dice);
        let point = Place { bar: Some(bar), point: [dice.within(-0.5, 0.5), dice.within(-0.5, 0.5)] };
        let at = configuration.at(point);
        let name = format!("extra{extra}");
        match dice.pick(5) {
            0 => scene.hinges.push(Hinge { name, between: [point, configuration.place(base, at)] }),
            1 | 2 => {
                let (angle, travel) = (dice.within(-3.0, 3.0), dice.within(-0.5, 0.5));
                let along = configuration.direction(base, C::unit(angle));
                let mut place = configuration.place(base, at);
                place.point = [place.point[0] - travel * along.re, place.point[1] - travel * along.im];
                let rail = Rail { place, direction: [along.re, along.im] };
                if dice.pick(3) == 0 {
                    scene.drives.push(Drive {
                        name: format!("drive{extra}"),
                        slider: scene.sliders.len(),
                        law: law(travel, dice),
                    });
                }
                scene.sliders.push(Slider { name, point, rail, locked: dice.pick(4) == 0 });
            }
            3 => scene.locks.push(Lock { name, bar, relative_to: base, angle: None }),
            _ => {
                let given = scene.start[bar].phi - base.map_or(0.0, |base| scene.start[base].phi);
                scene.motors.push(driftless::scene::Motor {
                    name,
                    bar,
                    relative_to: base,
                    law: law(given, dice),
                });
            }
        }
    }
    if dice.pick(2) == 0 {
        let (bar, point, force) = (dice.pick(n), [0.2, -0.1], [dice.within(-5.0, 5.0), 3.0]);
        scene.forces.push(Force { name: "force".into(), bar, point, force, follows: false, law: None });
        scene.torques.push(Torque {
            name: "torque".into(),
            bar,
            relative_to: other(bar, dice),
            torque: dice.within(-2.0, 2.0),
            law: None,
        });
    }
    Some(scene)
}

/// True where all rows are kept and none is near losing its hold.
fn is_sound(mechanism: &Mechanism, motion: &Motion) -> bool {
    let mut kernel = Kernel::<f64>::new(mechanism);
    let (phi, omega) = numbers(motion);
    kernel.accelerations(mechanism, Time::default(), &phi, &omega, Bias::default());
    // Of rows that depend on others everywhere each form may leave out another one; light members cost both
    // forms digits.
    let share =
        |r: usize| if kernel.is_left_out(r) { 0.0 } else { 1.0 / (kernel.schur_pivot[r] * kernel.scale[r]) };
    let is_regular = kernel.weakest.share > 1e-3 && (0..mechanism.constraints.len()).all(|r| share(r) > 1e-3);
    kernel.rows_at(mechanism, Time::default(), &phi, &omega);
    let is_kept =
        |r: usize| kernel.rows[r].position.abs() < 1e-12 && kernel.row_rate(r, &omega).abs() < 1e-12;
    is_regular && (0..mechanism.constraints.len()).all(is_kept)
}

fn numbers(motion: &Motion) -> (Vec<f64>, Vec<f64>) {
    (motion.phi.iter().map(|phi| phi.hi).collect(), motion.omega.iter().map(|omega| omega.hi).collect())
}

/// Elements, rates, z'' and the multipliers of all rows in natural coordinates.
fn natural(mechanism: &Mechanism, motion: &Motion) -> (Vec<C>, Vec<C>, Vec<C>, Vec<f64>) {
    let natural = Natural::new(Arc::new(mechanism.clone())).expect("a natural form");
    let state = natural.state(motion);
    let vectors: Vec<C> = state.y.as_chunks::<2>().0.iter().map(|x| C::new(x[0], x[1])).collect();
    let (z, rate) = vectors.split_at(mechanism.coordinates());
    let (z, rate) = (z.to_vec(), rate[..mechanism.coordinates()].to_vec());
    let (acceleration, multiplier) = accelerations(&natural, Time::default(), (&z, &vec![0; z.len()]), &rate);
    (z, rate, acceleration, multiplier)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |largest, value| largest.max(value.abs()))
}

/// A random mechanism, its start, and one evaluation in angles there.
struct Sound {
    scene: Scene,
    mechanism: Mechanism,
    motion: Motion,
    kernel: Kernel<f64>,
}

fn sound(n: usize, seed: u64) -> Result<Sound, TestCaseError> {
    let scene = mechanism(n, seed).ok_or_else(|| TestCaseError::reject("no equations"))?;
    let mechanism = Mechanism::new(&scene).map_err(|_| TestCaseError::reject("angles given twice"))?;
    let motion = mechanism.start(&scene);
    prop_assume!(is_sound(&mechanism, &motion));
    let (phi, omega) = numbers(&motion);
    let mut kernel = Kernel::<f64>::new(&mechanism);
    kernel.accelerations(&mechanism, Time::default(), &phi, &omega, Bias::default());
    Ok(Sound { scene, mechanism, motion, kernel })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, max_global_rejects: 20_000, ..ProptestConfig::default() })]

    /// The two forms share nothing but the constants of the tree and the lists of the rows.
    #[test]
    fn both_forms_tell_the_same_accelerations_and_multipliers(n in 2..=6usize, seed in any::<u64>()) {
        let Sound { mechanism, motion, kernel, .. } = sound(n, seed)?;
        let (z, _, acceleration, multiplier) = natural(&mechanism, &motion);
        // Accelerations are what is left of the parts that loads and multipliers have in them.
        let parts = kernel.multiplier.iter().zip(kernel.minv_jt.chunks(mechanism.coordinates().max(1)));
        let parts = parts.fold(1.0, |most: f64, (multiplier, minv_jt)| most.max(multiplier.abs() * largest(minv_jt)));
        let (fastest, strongest) = (largest(&kernel.load).max(1e-3 * parts), largest(&kernel.multiplier));
        for k in 0..n {
            let alpha = z[k].cross(acceleration[k]);
            prop_assert!((alpha - kernel.load[k]).abs() < 1e-9 * fastest, "{alpha} {} of {fastest}", kernel.load[k]);
        }
        for x in (n..mechanism.coordinates()).step_by(2) {
            let origin_point = acceleration[x] - C::new(kernel.load[x], kernel.load[x + 1]);
            prop_assert!(origin_point.norm_squared().sqrt() < 1e-9 * fastest, "{origin_point:?} of {fastest}");
        }
        prop_assert_eq!(multiplier.len(), kernel.multiplier.len());
        for ((found, exact), row) in multiplier.iter().zip(&kernel.multiplier).zip(&mechanism.constraints) {
            prop_assert!((found - exact).abs() < 1e-9 * strongest, "{}: {found} {exact} of {strongest}", row.name);
        }
    }

    /// Newton and Euler against the multipliers of the same hinges where every body hangs on nothing and
    /// every hinge is a pin.
    #[test]
    fn hinge_forces_are_the_multipliers_of_the_hinges_as_pins(n in 2..=5usize, seed in any::<u64>()) {
        let Sound { scene, mechanism, motion, kernel } = sound(n, seed)?;
        let (phi, omega) = numbers(&motion);
        let forces = mechanism.hinge_forces(Time::default(), &kernel, &phi, &omega);
        // The same bodies in the same places, each by itself.
        let mut loose = Scene { hinges: Vec::new(), ..scene.clone() };
        for k in 0..n {
            let origin = mechanism.end(k, 0).point;
            let (at, rate) = (origin.position(&kernel.z), origin.velocity(&kernel.z, &omega));
            let (origin, velocity) = (Some([at.re, at.im]), Some([rate.re, rate.im]));
            loose.given[k] = Given { origin, velocity, ..Given::ANGLE_AND_RATE };
            loose.start[k] = driftless::scene::Start { phi: phi[k], omega: omega[k] };
        }
        let Ok(mut apart) = Mechanism::new(&loose) else { return Err(TestCaseError::reject("no start apart")) };
        let spread = apart.start(&loose);
        let site = |mechanism: &Mechanism, place: &Place| Site { body: place.bar, point: mechanism.forest.point(place) };
        for hinge in &scene.hinges {
            apart = apart.pinned(&hinge.name, &site(&apart, &hinge.between[0]), &site(&apart, &hinge.between[1]));
        }
        let (_, _, _, multiplier) = natural(&apart, &spread);
        let first = apart.constraints.iter().position(|row| row.name == format!("{}.x", scene.hinges[0].name)).expect("the first pin");
        let strongest = forces.iter().fold(1.0f64, |most, force| most.max(force.norm_squared().sqrt()));
        for ((h, force), hinge) in forces.iter().enumerate().zip(&scene.hinges) {
            let pin = C::new(multiplier[first + 2 * h], multiplier[first + 2 * h + 1]);
            prop_assert!((pin - *force).norm_squared().sqrt() < 1e-9 * strongest, "{}: {pin:?} {force:?}", hinge.name);
        }
    }
}

#[test]
fn what_has_no_natural_form_is_refused_by_name() {
    let refused = |change: &dyn Fn(&mut Scene)| {
        let mut scene = common::free();
        change(&mut scene);
        Natural::new(common::compile(&scene)).expect_err("no natural form")
    };
    let torsion = TorsionSpring {
        name: "t".into(),
        bar: 1,
        relative_to: None,
        stiffness: 1.0,
        free_angle: 0.0,
        damping: 0.0,
    };
    assert_eq!(
        refused(&|scene| scene.torsion_springs.push(torsion.clone())),
        NaturalError::Torsion("t".into())
    );
    let force =
        Force { name: "f".into(), bar: 1, point: [0.3, 0.0], force: [1.0, 0.0], follows: true, law: None };
    assert_eq!(refused(&|scene| scene.forces.push(force.clone())), NaturalError::Applied("f".into()));
    let torque =
        Torque { name: "m".into(), bar: 1, relative_to: None, torque: 1.0, law: Some(Law::constant(2.0)) };
    assert_eq!(refused(&|scene| scene.torques.push(torque.clone())), NaturalError::Applied("m".into()));
}

/// A parallelogram on three cranks: one of them more than is needed.
#[test]
fn a_row_too_many_changes_no_acceleration() {
    let place = |bar: Option<usize>, x: f64, y: f64| Place { bar, point: [x, y] };
    let bar = |name: &str, mass: f64, length: f64| driftless::scene::Bar {
        name: name.into(),
        length,
        mass,
        centre: [length / 2.0, 0.0],
        inertia: mass * length * length / 12.0,
    };
    let hinge = |name: &str, a: Place, b: Place| Hinge { name: name.into(), between: [a, b] };
    let mut scene = common::free();
    scene.bars = vec![bar("left", 0.1, 0.5), bar("right", 0.1, 0.5), bar("coupler", 0.3, 1.0)];
    scene.hinges = vec![
        hinge("A", place(None, 0.0, 0.0), place(Some(0), 0.0, 0.0)),
        hinge("B", place(None, 0.0, 1.0), place(Some(1), 0.0, 0.0)),
        hinge("C", place(Some(0), 0.5, 0.0), place(Some(2), 0.0, 0.0)),
        hinge("D", place(Some(1), 0.5, 0.0), place(Some(2), 1.0, 0.0)),
    ];
    let start = |phi: f64, omega: f64| driftless::scene::Start { phi, omega };
    scene.start = vec![start(0.4, 2.0), start(0.4, 2.0), start(std::f64::consts::FRAC_PI_2, 0.0)];
    let accelerations = |scene: &Scene| {
        let mechanism = common::compile(scene);
        let motion = mechanism.start(scene);
        let (z, _, acceleration, _) = natural(&mechanism, &motion);
        z.iter().zip(acceleration).map(|(z, a)| z.cross(a)).collect::<Vec<_>>()
    };
    let plain = accelerations(&scene);
    scene.bars.push(bar("middle", 1e-12, 0.5));
    scene.hinges.push(hinge("E", place(None, 0.0, 0.5), place(Some(3), 0.0, 0.0)));
    scene.hinges.push(hinge("F", place(Some(3), 0.5, 0.0), place(Some(2), 0.5, 0.0)));
    scene.start.push(start(0.4, 2.0));
    let more = accelerations(&scene);
    for k in 0..3 {
        assert!((plain[k] - more[k]).abs() < 1e-9 * plain[0].abs(), "{plain:?} {more:?}");
    }
    assert!((more[3] - more[0]).abs() < 1e-9 * plain[0].abs(), "{more:?}");
}
