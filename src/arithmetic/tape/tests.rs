use super::*;
use crate::arithmetic::{DoubleDouble, Dual};

/// Every operation there is, of two numbers near 1.
fn formula<S: Scalar>(x: S, y: S) -> S {
    let (sin, cos) = (x * y).sin_cos();
    let angle = (sin + S::of(0.3)).atan2(cos - y.powi(3));
    let root = (x.powi(2) + y.exp()).sqrt();
    (angle * root - (x / y).ln().scale(0.7)) * (x - y).tanh()
        + (-x).exp().powf(0.4)
        + S::of(2.0) / (x + x.tan())
        + (x * y).power_above_zero(S::of(1.7)) * (x + y).power_above_zero(S::of(0.5))
}

fn recorded() -> (Tape, Slot, Vec<(u32, Slot)>) {
    let mut inputs = Vec::new();
    let [(tape, results)] = Symbol::record(|| {
        let value = formula(Symbol::input(0), Symbol::input(1));
        let gradient = value.gradient();
        inputs = gradient.iter().map(|part| part.0).collect();
        [std::iter::once(value).chain(gradient.into_iter().map(|part| part.1)).collect()]
    });
    (tape, results[0], inputs.into_iter().zip(results[1..].iter().copied()).collect())
}

fn evaluated<S: Scalar>(tape: &Tape, at: [S; 2]) -> Vec<S> {
    tape.results(|input| at[input as usize], <[S]>::to_vec)
}

#[test]
fn a_tape_evaluates_to_what_the_code_evaluates_to() {
    let (tape, value, _) = recorded();
    assert_eq!(evaluated(&tape, [1.2, 0.9])[value as usize], formula(1.2, 0.9));
    let exact = [1.2, 0.9].map(DoubleDouble::of);
    assert_eq!(evaluated(&tape, exact)[value as usize], formula(exact[0], exact[1]));
    assert!((evaluated(&tape, exact)[value as usize].hi - formula(1.2, 0.9)).abs() < 1e-14);
}

#[test]
fn the_gradient_is_the_derivative_of_dual_numbers_and_of_differences() {
    let (tape, value, gradient) = recorded();
    let slots = evaluated(&tape, [1.2, 0.9]);
    let dual = formula(Dual::<2>::unknown(1.2, 0), Dual::unknown(0.9, 1));
    assert_eq!(gradient.len(), 2);
    for &(input, slot) in &gradient {
        let off = |by: f64| {
            let at = std::array::from_fn(|k| {
                DoubleDouble::sum([1.2, 0.9][k], if k == input as usize { by } else { 0.0 })
            });
            evaluated(&tape, at)[value as usize]
        };
        let difference = (off(1e-10) - off(-1e-10)).scale(0.5e10).hi;
        assert!((slots[slot as usize] - difference).abs() < 1e-13, "{} {difference}", slots[slot as usize]);
        assert!((dual.slope[input as usize] - difference).abs() < 1e-13);
    }
}

#[test]
fn series_agree_with_differences_of_values_along_a_path() {
    let (tape, value, _) = recorded();
    // x = 1.2 + 0.3 t - 0.1 t², y = 0.9 - 0.2 t + 0.4 t³
    let path = [[1.2, 0.9], [0.3, -0.2], [-0.1, 0.0], [0.0, 0.4]];
    let mut series = TapeSeries::<DoubleDouble>::new(&tape, 12);
    for m in 0..=12 {
        series.advance(&tape, m, &|input| {
            DoubleDouble::of(path.get(m).map_or(0.0, |power| power[input as usize]))
        });
    }
    let t = DoubleDouble::of(1e-2);
    let at = [0, 1].map(|k| {
        path.iter().rev().fold(DoubleDouble::ZERO, |sum, power| sum * t + DoubleDouble::of(power[k]))
    });
    let direct = evaluated(&tape, at)[value as usize];
    let summed = series.of(value).iter().rev().fold(DoubleDouble::ZERO, |sum, &power| sum * t + power);
    assert!((direct - summed).hi.abs() < 1e-22, "{:e}", (direct - summed).hi);
}

#[test]
fn what_is_said_twice_is_recorded_once_and_what_nobody_asks_for_is_not() {
    let [(tape, _)] = Symbol::record(|| {
        let x = Symbol::input(0);
        let unused = x.exp();
        let _ = unused * unused;
        [vec![x * x + x * x, (x * x).scale(1.0) + Symbol::ZERO, Symbol::of(2.0) * Symbol::of(3.0)]]
    });
    // Input, square, sum, and the constant six.
    assert_eq!(tape.len(), 4);
}

#[test]
fn lanes_have_the_bits_of_plain_numbers() {
    use crate::arithmetic::eight::{Eight, LANES, Lanewise, Octet};
    use crate::arithmetic::lanes::Portable;
    let (tape, value, _) = recorded();
    let at = |lane: usize| [1.2 + 0.1 * lane as f64, 0.9 - 0.05 * lane as f64];
    let octet = |k: usize| Octet(std::array::from_fn::<_, LANES, _>(|lane| at(lane)[k]));
    let lanes = [0, 1].map(|k| Eight::<Portable>::load(&octet(k), &Octet::default()));
    let (mut found, mut low) = (Octet::default(), Octet::default());
    evaluated(&tape, lanes)[value as usize].store(&mut found, &mut low);
    for lane in 0..LANES {
        let plain = formula(at(lane)[0], at(lane)[1]);
        // Sine and cosine of lanes are rounded by a series of their own.
        assert!(
            (found.0[lane] - plain).abs() < 1e-14 * plain.abs().max(1.0),
            "{lane}: {} {plain}",
            found.0[lane]
        );
    }
}

#[test]
fn only_differences_of_inputs_are_told_from_inputs() {
    let differs = |formula: fn([Symbol; 3]) -> Symbol| {
        let [(tape, results)] = Symbol::record(|| [vec![formula([0, 1, 2].map(Symbol::input))]]);
        !tape.is_unchanged_by_shifts(|input| input < 2, results.into_iter())
    };
    assert!(!differs(|[x, y, z]| ((x - y) * z).tanh() + (y.scale(2.0) - x - x).sin_cos().1));
    assert!(!differs(|[_, _, z]| z * z));
    assert!(differs(|[x, y, z]| (x - y) * z + y));
    assert!(differs(|[x, y, _]| x * x - y * y));
    assert!(differs(|[x, y, z]| (x.scale(2.0) - y) / z));
}

#[test]
fn powers_above_zero_are_zero_below() {
    let [(tape, slots)] = Symbol::record(|| {
        let value = Symbol::input(0).power_above_zero(Symbol::of(1.5));
        [std::iter::once(value).chain(value.gradient().into_iter().map(|part| part.1)).collect()]
    });
    for (x, expected) in [(4.0, [8.0, 3.0]), (0.0, [0.0; 2]), (-1e-17, [0.0; 2])] {
        let found = tape.results(|_| x, |results| [0, 1].map(|k| results[slots[k] as usize]));
        assert!(
            found.iter().zip(expected).all(|(a, b): (&f64, f64)| (a - b).abs() < 1e-14),
            "{x}: {found:?}"
        );
        let dual = Dual::<1>::unknown(x, 0).power_above_zero(Dual::of(1.5));
        assert!((dual.value - expected[0]).abs() < 1e-14 && (dual.slope[0] - expected[1]).abs() < 1e-14);
    }
    // The first powers are those of the value alone, as there is no series.
    let mut series = TapeSeries::<f64>::new(&tape, 3);
    (0..=3).for_each(|m| series.advance(&tape, m, &|_| [0.0, 1.0, 0.5, 0.0][m]));
    assert_eq!(series.of(slots[0]), [0.0; 4]);
}
