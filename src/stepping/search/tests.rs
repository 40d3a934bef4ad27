use super::*;
use proptest::prelude::*;

/// The first passage of a polynomial.
fn crossing(powers: &[f64], end: f64) -> Crossing {
    super::crossing(&PowerSeries { powers, end }, end)
}

/// Powers of Π (t - root), times `factor`.
fn through(roots: &[f64], factor: f64) -> Vec<f64> {
    roots.iter().fold(vec![factor], |powers, root| {
        let mut next = vec![0.0; powers.len() + 1];
        for (m, power) in powers.iter().enumerate() {
            next[m] -= root * power;
            next[m + 1] += power;
        }
        next
    })
}

#[test]
fn the_first_of_several_zeros_is_found() {
    let Crossing::At(t) = crossing(&through(&[0.3, 0.5, 0.9], -1.0), 1.0) else { panic!("no zero") };
    assert!((t - 0.3).abs() < 1e-15);
    // Two that no sample would tell from none.
    let Crossing::At(t) = crossing(&through(&[0.7, 0.7 + 1e-7], 1.0), 1.0) else { panic!("no zero") };
    assert!((t - 0.7).abs() < 1e-8);
    assert_eq!(crossing(&through(&[1.3, 0.5], 1.0), 0.4), Crossing::Nothing);
    assert_eq!(crossing(&[1e-3, -0.5, 0.5 * 0.5 / 4e-3 + 1.0], 1.0), Crossing::Nothing);
}

/// A zero of order three in the middle of the step, where it is halved and the value is exactly zero.
#[test]
fn zeros_between_two_parts_are_found() {
    for place in [0.25, 0.5, 0.75] {
        for factor in [1.0, -1.0] {
            let powers = through(&[place; 3], factor);
            let found = root(&PowerSeries { powers: &powers, end: 1.0 }, 0.0, 0.0, 1.0);
            assert!(found.is_some_and(|t| (t - place).abs() < 1e-5), "{place} {factor}: {found:?}");
        }
        // Touched, not passed.
        let powers = through(&[place; 2], -1.0);
        assert_eq!(root(&PowerSeries { powers: &powers, end: 1.0 }, 0.0, 0.0, 1.0), None);
    }
}

#[test]
fn where_rounding_is_all_there_is_signs_tell_and_few_parts_are_looked_at() {
    for (roots, level, falls) in
        [(vec![0.5; 12], 0.0, None), (vec![0.5; 11], 0.0, Some(0.5)), (vec![0.5; 12], -1e-9, Some(f64::NAN))]
    {
        let powers = through(&roots, if roots.len() % 2 == 0 { 1.0 } else { -1.0 });
        let (found, parts) = search(&PowerSeries { powers: &powers, end: 1.0 }, level, 0.0, 1.0);
        assert!(parts < 1000, "{} roots: {parts} parts", roots.len());
        match (found, falls) {
            (None, falls) => assert!(falls.is_none_or(f64::is_nan), "lost"),
            // Zeros of so many roots are known to the twelfth root of rounding.
            (Some(t), falls) => assert!(!falls.is_some_and(f64::is_nan) && (t - 0.5).abs() < 0.1, "{t}"),
        }
    }
    for nothing in [0.0, f64::NAN] {
        let (found, parts) = search(&PowerSeries { powers: &[nothing; 21], end: 1.0 }, 0.0, 0.0, 1.0);
        assert!(found.is_none() && parts < 1000);
    }
    // Noise about a level.
    let powers: Vec<f64> =
        (0..21).map(|m| if m == 0 { 1e-12 } else { 1e-17 * f64::from(m % 3 - 1) }).collect();
    let (_, parts) = search(&PowerSeries { powers: &powers, end: 1.0 }, 1e-12, 0.0, 1.0);
    assert!(parts < 1000, "{parts}");
}

/// What moves evenly passes a wall wherever it is: values are zero, or rounding, where the passage is found.
#[test]
fn passages_of_straight_lines_are_found() {
    for i in 1..=2000 {
        let (begin, slope) =
            (0.3 + libm::sin(f64::from(i)).abs(), -libm::exp(libm::cos(1.7 * f64::from(i)) * 9.0));
        let zero = -begin / slope;
        for end in [1.01, 3.0, 29.3].map(|share| share * zero) {
            let found = crossing(&[begin, slope, 0.0, 0.0], end);
            let is_there = |t: f64| (t / zero - 1.0).abs() < 1e-14;
            assert!(matches!(found, Crossing::At(t) if is_there(t)), "{begin} {slope} {end}: {found:?}");
        }
    }
}

#[test]
fn powers_about_another_time_give_the_same_values() {
    let powers = through(&[0.3, 0.5, 0.9], -1.0);
    let mut local = powers.clone();
    shift(&mut local, 0.4);
    for t in [0.0, 0.35, 0.6] {
        assert!((value(&powers, t)[0] - value(&local, t - 0.4)[0]).abs() < 1e-15);
    }
}

#[test]
fn a_gap_at_zero_must_open_before_it_can_close() {
    // Thrown up from the wall, back after 0.4.
    let Crossing::At(t) = crossing(&[1e-17, 2.0, -5.0], 1.0) else { panic!("no zero") };
    assert!((t - 0.4).abs() < 1e-15);
    assert_eq!(crossing(&[0.0, 0.0, 0.0], 1.0), Crossing::Nothing);
    assert_eq!(crossing(&[0.0, 1.0], 1.0), Crossing::Nothing);
    let Crossing::Inside(t) = crossing(&[0.0, 0.0, -1.0], 1.0) else { panic!("it stays outside") };
    assert!((t - 1e-6).abs() < 1e-12);
    assert_eq!(crossing(&[-2e-12, -1.0], 1.0), Crossing::Inside(0.0));
    // From a rounding below zero on its way out, whatever rounding says of its speed.
    assert_eq!(crossing(&[-1.1e-12, -4e-17, 6e-6], 0.1), Crossing::Nothing);
    let Crossing::At(t) = crossing(&[-2e-12, 1.0, -2.0], 1.0) else { panic!("no zero") };
    assert!((t - 0.5).abs() < 1e-11);
}

/// The first change of sign among many samples, of a function that is positive at zero.
fn sampled(curve: &impl Curve, samples: u32) -> Option<f64> {
    (1..=samples).map(|k| f64::from(k) / f64::from(samples)).find(|&t| curve.at(t)[0] < 0.0)
}

/// Not before any sample that is negative, and negative right after it.
fn agrees(curve: &impl Curve, found: Crossing) -> Result<(), TestCaseError> {
    let seen = sampled(curve, 20_000);
    match found {
        Crossing::At(t) => {
            prop_assert!(seen.is_none_or(|seen| t <= seen), "{t} {seen:?}");
            prop_assert!(curve.at(t)[0].abs() < 1e-9, "{t}: {:e}", curve.at(t)[0]);
        }
        _ => prop_assert!(seen.is_none(), "a sample at {seen:?} is negative"),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_sample_of_a_polynomial_is_negative_before_its_passage(powers in prop::collection::vec(-1.0..1.0_f64,
        2..22), start in 1e-6..1.0_f64) {
        let mut powers = powers;
        powers[0] = start;
        agrees(&PowerSeries { powers: &powers, end: 1.0 }, crossing(&powers, 1.0))?;
    }

    #[test]
    fn the_first_of_random_zeros_is_found(first in 0.01..0.9_f64, apart in -8.0..-0.5_f64,
        others in prop::collection::vec(1.1..3.0_f64, 0..8)) {
        // Two zeros close together, the others beyond the step.
        let mut roots = vec![first, first + 10_f64.powf(apart)];
        roots.extend(&others);
        let powers = through(&roots, if roots.len() % 2 == 0 { 1.0 } else { -1.0 });
        // The dip is a parabola, and its powers are rounded.
        let bend: f64 = others.iter().map(|root| root - first).product();
        let unsure = 1e-9 + (10.0 * f64::EPSILON * size(&powers, 1.0) / bend).sqrt();
        match crossing(&powers, 1.0) {
            Crossing::At(t) => prop_assert!((t - first).abs() < unsure, "{t} {first} {unsure:e}"),
            other => prop_assert!(10_f64.powf(apart) < unsure, "{other:?} {unsure:e}"),
        }
    }

    #[test]
    fn an_interpolant_finds_what_its_function_has(slow in 0.5..9.0_f64, phase in 0.0..6.0_f64,
        shift in -0.95..0.95_f64) {
        let function = |t: f64| (slow * t + phase).cos() * (0.3 * t).exp() + shift;
        let values: Vec<f64> = chebyshev::Nodes::new(32).places.into_iter().map(function).collect();
        let curve = Chebyshev::through(&values);
        prop_assert!(curve.tail() < 1e-12 && curve.at(0.37)[0] - function(0.37) < 1e-12);
        let slope = (function(0.37 + 1e-6) - function(0.37 - 1e-6)) / 2e-6;
        prop_assert!((curve.at(0.37)[1] - slope).abs() < 1e-7);
        if function(0.0) > 1e-6 {
            agrees(&curve, super::crossing(&curve, 1.0))?;
        }
    }
}

/// (t - 0.3)² (1.5 - t) touches zero, and passes it later; a steep passage of large values rounds to either
/// side.
#[test]
fn what_touches_zero_stays_on_its_side_and_what_passes_does_not() {
    let touching = through(&[0.3, 0.3, 1.5], -1.0);
    assert_eq!(crossing(&touching, 1.0), Crossing::Nothing);
    let Crossing::At(t) = crossing(&touching, 2.0) else { panic!("no zero") };
    assert!((t - 1.5).abs() < 1e-12, "{t}");
    for size in [1.0, 1e6, 1e12] {
        for k in 1..50 {
            let zero = 0.019 * f64::from(k);
            let Crossing::At(t) = crossing(&[size * zero, -size, -1e-3], 1.0) else {
                panic!("{size} {zero}")
            };
            assert!((t - zero).abs() < 2e-3, "{size}: {t} for {zero}");
        }
    }
}

#[test]
fn a_minimum_whose_side_is_unknown_is_told() {
    // (t - 0.6)² + height, off by 1e-6.
    let dip = |height: f64| [0.36 + height, -1.2, 1.0];
    for (height, is_known) in [(5e-7, false), (-5e-7, false), (2e-6, true), (-2e-6, true), (0.0, false)] {
        let powers = dip(height);
        let curve = PowerSeries { powers: &powers, end: 1.0 };
        let passes = if let Crossing::At(t) = crossing(&powers, 1.0) { Some(t) } else { None };
        let found = doubtful(&curve, 1e-6, |_| 1e-6, [0.0, 1.0], passes);
        assert_eq!(found.is_none(), is_known, "{height}: {found:?}");
        assert!(found.is_none_or(|t| (t - 0.6).abs() < 1e-9), "{found:?}");
        // Known well enough where the dip is, and nowhere else.
        assert!(
            height == 0.0 || doubtful(&curve, 1e-6, |t| 1e-6 * (t - 0.6).abs(), [0.0, 1.0], passes).is_none()
        );
    }
}

/// Zeros near the beginning, where doubles are closer together than rounding can tell values apart.
#[test]
fn zeros_near_the_beginning_are_found_to_rounding() {
    // A bar that had come within 4e-6 rad of the boundary, at Chebyshev's nodes.
    let angles = [
        3.146274495853511,
        3.1460965549548274,
        3.1455896449990424,
        3.1448305078439844,
        3.1439342782762156,
        3.143037210683562,
        3.142276050323488,
        3.1417671171146524,
        3.141588338143051,
    ];
    let curve = Chebyshev::through(&angles.map(|angle| std::f64::consts::PI - angle));
    let Crossing::At(found) = super::crossing(&curve, 1.0) else { panic!("no zero") };
    assert!((found - 9.186_294_836_757e-4).abs() < 1e-14, "{found}");
    let mut worst = 0.0_f64;
    for k in 0..20_000 {
        let share = f64::from(k) / 20_000.0;
        let root = libm::exp10(-8.0 + 7.0 * share);
        let (slope, bend) = (0.0047 * (1.0 + share), 1e-5 * (37.0 * share).sin());
        let values = |t: f64| (t - root) * (bend * t - slope);
        let values: Vec<f64> = chebyshev::Nodes::new(8).places.into_iter().map(values).collect();
        let Crossing::At(found) = super::crossing(&Chebyshev::through(&values), 1.0) else {
            panic!("no zero at {root}")
        };
        worst = worst.max((found - root).abs());
    }
    assert!(worst < 1e-14, "{worst:e}");
}

#[test]
fn a_corner_does_not_oscillate_and_a_wave_does() {
    let values = |f: fn(f64) -> f64| (0..=32).map(|k| f(f64::from(k) / 32.0)).collect::<Vec<f64>>();
    assert!(
        !oscillates(&values(|t| (t - 0.3).abs()), 1.0) && !oscillates(&values(|t| (t - 0.3).signum()), 1.0)
    );
    assert!(
        oscillates(&values(|t| (20.0 * t).sin()), 1.0) && oscillates(&values(|t| (1e6 * t * t).sin()), 1.0)
    );
    assert!(!oscillates(&values(|t| 1.0 + 1e-9 * (1e6 * t * t).sin()), 1.0));
}
