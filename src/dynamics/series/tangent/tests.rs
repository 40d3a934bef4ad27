//! The derivatives against those of series of numbers with derivatives.

use super::*;
use crate::arithmetic::Scalar;
use crate::arithmetic::lanes::Portable;
use crate::arithmetic::lanes::wide::{EightLanes, Single, SlotTask, Vectors, WideCode};
use crate::dynamics::compile::exact::ExactMechanism;
use crate::dynamics::series::slots::InSlots;
use crate::dynamics::{Mechanism, Time};
use crate::scene::Template;
use crate::scene::exact::Watcher;
use std::sync::Arc;

/// Orders are found two at a time, so both kinds of a last one are looked at.
const ORDERS: [usize; 2] = [16, 15];

/// The reference is made of these, one derivative at a time: in vectors it is most of these tests' code.
type Plain = InSlots<Single<Portable>>;

/// A mechanism whose constants have derivatives, of which number `front` stands first, and where it starts.
fn mechanism(
    name: &str,
    numbers: &[&'static str],
    front: usize,
) -> (ExactMechanism<Number>, Vec<Number>, Vec<Number>) {
    let path = format!("examples/scenes/{name}.json");
    let template = Template::read(path.as_ref(), &[]).expect("a shipped scene");
    let plain = template.scene().expect("a valid scene");
    let structure = Arc::new(Mechanism::new(&plain).expect("a valid scene"));
    let value = |path: &str| template.value(&template.variable(path).expect("a number")).expect("a scene");
    let seed = |(lane, &path): (usize, &&'static str)| {
        (path, Number::unknown(value(path).expect("a value"), (lane + 8 - front) % 8))
    };
    let known: Vec<_> = numbers.iter().enumerate().map(seed).collect();
    let (scene, _) = template.exact_with(&[], &known, Watcher::Beside).expect("known numbers");
    let start = structure.start(&plain);
    let varied = |k: usize, value: f64| {
        Number::new(
            value,
            std::array::from_fn(|lane| libm::sin(1.0 + k as f64 + 1.7 * ((lane + front) % 8) as f64)),
        )
    };
    let n = structure.coordinates();
    let phi = (0..n).map(|k| varied(k, start.unwrapped(k) + 0.02 * k as f64)).collect();
    let omega = (0..n).map(|k| varied(n + k, 1.0 - 0.3 * k as f64)).collect();
    (ExactMechanism::new(&scene, &structure).expect("the same mechanism"), phi, omega)
}

/// Powers of the rates both ways.
struct BothPowers<'a> {
    terms: Terms<'a, Number>,
    coordinates: Coordinates,
    begin: Begin<'a>,
    is_single: bool,
    /// Whether the powers of the motion are known beforehand.
    is_known: bool,
    /// The highest power.
    order: usize,
}

struct BothExpanded<'a, 'b, S: Slots>(
    &'a mut Tangent<S>,
    &'a Terms<'b, Number>,
    Begin<'a>,
    Option<&'a MotionPowers>,
);

impl<S: Slots> SlotTask for BothExpanded<'_, '_, S> {
    type Output = ();

    #[inline(always)]
    fn perform(self) {
        self.0.expand(self.1, self.2, self.3);
    }
}

impl BothPowers<'_> {
    /// The powers of the motion by themselves.
    fn powers(&self) -> MotionPowers {
        let plain = self.terms.structure.terms();
        let mut series = Series::<f64>::of_terms(&plain, self.coordinates, self.order);
        let (t, u, rest, rate) = self.begin;
        let [u, rest, rate] =
            [u, rest, rate].map(|all| all.iter().map(|number| number.value).collect::<Vec<_>>());
        series.expand_terms(&plain, t, &u, &rest, &rate);
        let (n, mut powers) = (series.coordinates(), MotionPowers::default());
        // Two orders are left to be found.
        let order = self.order - 2;
        powers.take((n, order), |m, k| series.omega[m * n + k], |m, k| series.z[m * n + k]);
        let (last, expected) = (powers.z.iter().rev(), series.z[..(order + 2) * n].iter().rev());
        for (z, expected) in last.zip(expected).take(n) {
            assert!(
                (z.re - expected.re).abs().max((z.im - expected.im).abs())
                    <= 1e-11 * expected.re.hypot(expected.im)
            );
        }
        powers
    }

    fn of<S: Slots>(&self) -> Vec<Number> {
        let mut tangent =
            Tangent::<S>::new(&self.terms, self.coordinates, self.order).expect("such a mechanism");
        let powers = self.is_known.then(|| self.powers());
        assert_eq!(tangent.fitting(powers.as_ref()).is_some(), self.is_known);
        tangent.expand_values(&self.terms, self.begin, powers.as_ref());
        S::perform(BothExpanded(&mut tangent, &self.terms, self.begin, powers.as_ref()));
        let f = tangent.coordinates();
        let found = (0..(self.order + 1) * f).map(|i| {
            let (m, c) = (i / f, i % f);
            Number::new(tangent.value(m, c), tangent.slope(m, c).array())
        });
        found.collect()
    }

    /// The reference of the first derivative; compiled once, not into the code for each kind of vector.
    #[inline(never)]
    fn expected(&self) -> Vec<f64> {
        let mut whole = Series::<Plain>::of_terms(&self.terms, self.coordinates, self.order);
        let (t, u, rest, rate) = self.begin;
        let [u, rest, rate] = [u, rest, rate].map(|all| all.iter().map(Plain::load).collect::<Vec<_>>());
        whole.expand_terms(&self.terms, t, &u, &rest, &rate);
        whole.rate[..(self.order + 1) * whole.coordinates()]
            .iter()
            .map(|rate| rate.store().slope[0])
            .collect()
    }
}

impl WideCode for BothPowers<'_> {
    type Output = Vec<Number>;

    fn run<W: EightLanes>(self) -> Vec<Number> {
        if self.is_single { self.of::<Single<W::Half>>() } else { self.of::<W>() }
    }
}

#[test]
fn derivatives_are_those_of_numbers_that_have_them() {
    let chain = ["bars.bar1.density", "bars.bar2.length", "gravity[0]"];
    let loops = ["bars.U0.mass", "bars.C0.inertia", "gravity[1]"];
    for (name, numbers, coordinates) in [
        ("free", chain, Coordinates::Independent),
        ("chain8", chain, Coordinates::Independent),
        ("four_bars", loops, Coordinates::All),
    ] {
        let all: Vec<_> = (0..8).map(|front| mechanism(name, &numbers, front)).collect();
        let rest = vec![Number::ZERO; all[0].1.len()];
        let kinds = [(false, false), (true, false), (false, true), (true, true)];
        for order in ORDERS {
            let both = |front: usize, is_single: bool, is_known: bool| {
                let (mechanism, phi, omega) = &all[front];
                let (terms, begin) = (mechanism.terms(), (Time::default(), &phi[..], &rest[..], &omega[..]));
                BothPowers { terms, coordinates, begin, is_single, is_known, order }
            };
            let expected: Vec<_> = (0..8).map(|lane| both(lane, false, false).expected()).collect();
            for (is_single, is_known) in kinds {
                if is_known && coordinates == Coordinates::All {
                    continue;
                }
                let found = Vectors::default().run(both(0, is_single, is_known));
                for (m, found) in found.chunks(rest.len()).enumerate() {
                    for (lane, expected) in expected.iter().enumerate().take(if is_single { 1 } else { 8 }) {
                        let expected = &expected[m * rest.len()..];
                        let size = expected[..rest.len()].iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                        let off = |(found, expected): (&Number, &f64)| (found.slope[lane] - expected).abs();
                        let apart = found.iter().zip(expected).map(off).fold(0.0, f64::max);
                        assert!(apart <= 1e-11 * size, "{name}, power {m}, lane {lane}: {apart} of {size}");
                    }
                }
            }
        }
    }
}
