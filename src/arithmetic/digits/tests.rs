//! Against integer arithmetic of another crate, and against published digits.

use super::*;
use crate::arithmetic::DoubleDouble;
use num_bigint::{BigInt, Sign};
use proptest::prelude::*;

type Number = Digits<8>;
/// Limbs behind the point that integers of the check count in.
const PLACES: i32 = 60;
/// Powers of series.
const ORDER: usize = 20;

/// x 2^(64 PLACES), cut off.
fn integer<const W: usize>(x: &Digits<W>) -> BigInt {
    let digits: Vec<u32> = x.limb.iter().rev().flat_map(|&limb| [limb as u32, (limb >> 32) as u32]).collect();
    let sign = if x.is_negative() { Sign::Minus } else { Sign::Plus };
    let whole = BigInt::from_slice(sign, &digits);
    let shift = 64 * (PLACES + x.exponent - W as i32);
    if shift < 0 { whole >> -shift } else { whole << shift }
}

fn number() -> impl Strategy<Value = Number> {
    let limb = prop_oneof![Just(0_u64), Just(u64::MAX), any::<u64>(), 1..9_u64];
    (prop::collection::vec(limb, 8), -3..4_i32, any::<bool>(), 2..9_usize).prop_map(
        |(limb, exponent, is_negative, limbs)| {
            Number::normalized(is_negative, exponent, 8, &limb).shortened(limbs)
        },
    )
}

/// |found - exact| in units of the last limb that `found` must have, counted from the size of `scale`.
fn off(found: &Number, exact: &BigInt, scale: i32, limbs: usize) -> BigInt {
    let unit = BigInt::from(1) << (64 * (PLACES + scale - limbs as i32));
    let off = integer(found) - exact;
    let off = if off.sign() == Sign::Minus { -off } else { off };
    off / unit
}

/// |found - exact| over what n limbs leave of the exact number, whose first limb may have a single bit.
fn relative(found: &Number, exact: &BigInt, limbs: usize) -> BigInt {
    if exact.sign() == Sign::NoSign {
        return BigInt::from(u8::from(!found.is_zero()));
    }
    let off = integer(found) - exact;
    ((off << (64 * (limbs - 1))) / exact).magnitude().clone().into()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn sums_are_those_of_integers(a in number(), b in number()) {
        let limbs = a.limbs().min(b.limbs());
        let scale = a.exponent.max(b.exponent);
        for (found, exact) in [(a + b, integer(&a) + integer(&b)), (a - b, integer(&a) - integer(&b))] {
            prop_assert!(off(&found, &exact, scale.max(found.exponent), limbs) <= BigInt::from(1), "{a:?} \
                {b:?} {found:?}");
            prop_assert!(found.limbs() == limbs || found.is_zero() || a.is_zero() || b.is_zero());
        }
    }

    #[test]
    fn products_and_quotients_are_those_of_integers(a in number(), b in number()) {
        let limbs = a.limbs().min(b.limbs());
        let product = a * b;
        let exact = (integer(&a) * integer(&b)) >> (64 * PLACES);
        prop_assert!(relative(&product, &exact, limbs) <= BigInt::from(10), "{a:?} {b:?}");
        if !b.is_zero() {
            let quotient = a / b;
            let exact = (integer(&a) << (64 * PLACES)) / integer(&b);
            prop_assert!(relative(&quotient, &exact, limbs) <= BigInt::from(20), "{a:?} {b:?} {quotient:?}");
        }
        let root = a.abs().sqrt();
        let exact = (integer(&a.abs()) << (64 * PLACES)).sqrt();
        prop_assert!(relative(&root, &exact, a.limbs()) <= BigInt::from(20), "{a:?} {root:?}");
    }

    #[test]
    fn sums_of_products_are_rounded_once(terms in prop::collection::vec((number(), number()), 1..40)) {
        let found = sum_of_products(terms.iter().map(|(a, b)| (a, b)));
        let exact: BigInt = terms.iter().map(|(a, b)| (integer(a) * integer(b)) >> (64 * PLACES)).sum();
        let counted = || terms.iter().filter(|(a, b)| !a.is_zero() && !b.is_zero());
        let limbs = counted().map(|(a, b)| a.limbs().min(b.limbs())).min().unwrap_or(8);
        let size = |(a, b): &(Number, Number)| (integer(&a.abs()) * integer(&b.abs())) >> (64 * PLACES);
        let size: BigInt = counted().map(size).sum();
        // Of every term as much as of a single product.
        let off = BigInt::from((integer(&found) - exact).magnitude().clone());
        prop_assert!(off << (64 * (limbs - 1)) <= size * 10 + 10, "{found:?}");
    }

    /// In a step of 2^step s a product is off by 2^-bits of the largest powers, on the unit of time, at most.
    #[test]
    fn scaled_products_are_those_of_integers(
        numbers in prop::collection::vec((number(), number()), ORDER + 1),
        radius in -70.0..3.0_f64,
        bits in 60..400_usize,
        first in 0..3_usize,
    ) {
        let step = radius - 2.5;
        let scale = TimeScale::new(radius, step, ORDER, bits);
        let falling = |m: usize, x: &Number| {
            let x = Number { exponent: 0, ..*x };
            x.ldexp(-libm::floor(radius * m as f64) as i32)
        };
        let mut factors = [Factor::new(ORDER), Factor::new(ORDER)];
        let mut powers = [Vec::new(), Vec::new()];
        let mut largest = f64::NEG_INFINITY;
        factors.iter_mut().for_each(|factor| factor.restart(&scale));
        for (m, (a, b)) in numbers.iter().enumerate() {
            for ((factor, powers), x) in factors.iter_mut().zip(&mut powers).zip([a, b]) {
                let x = falling(m, x);
                largest = largest.max(x.log2() + m as f64 * libm::floor(radius - 0.1));
                factor.push(&scale, x);
                powers.push(x);
            }
        }
        let [a, b] = &powers;
        for total in first..=ORDER {
            let found = factors[0].product(&factors[1], &scale, total, first..=total);
            let term = |j: usize| (integer(&a[j]) * integer(&b[total - j])) >> (64 * PLACES);
            let exact: BigInt = (first..=total).map(term).sum();
            let apart = (integer(&found) - &exact).bits() as f64;
            let off = apart - 64.0 * f64::from(PLACES) + total as f64 * step;
            let allowed = 2.0 * largest.max(0.0) - bits as f64;
            prop_assert!(off <= allowed || (integer(&found) - exact).bits() < 8, "{total}: 2^{off} > \
                2^{allowed}");
        }
    }

    #[test]
    fn decimals_read_back(a in number(), places in 1..120_usize) {
        let a = a.shortened(8);
        let text = a.to_decimal(140);
        let back = Number::from_decimal(&text).expect("a number");
        prop_assert!(((back - a).log2() - a.log2()) < -430.0 || back == a, "{text}");
        // Rounding once more changes half a unit of the last place at most.
        let short = Number::from_decimal(&a.to_decimal(places)).expect("a number");
        let apart = (short - a).log2() - a.log2();
        prop_assert!(short == a || apart < -3.32 * (places as f64 - 1.0), "{places} {apart}");
    }

    #[test]
    fn doubles_are_exact_and_words_read_back(x in prop::num::f64::NORMAL, a in number()) {
        prop_assert_eq!(Number::of(x).value(), x);
        prop_assert_eq!(Number::of(x).double_double(), DoubleDouble::of(x));
        prop_assert_eq!(Number::from_words(&a.to_words()), Some(a));
    }

    #[test]
    fn identities_of_sine_exponential_and_angle(a in -30.0..30.0_f64, b in -3.0..3.0_f64) {
        let [a, b] = [a, b].map(|x| Number::of(x).shortened(7) / Number::whole(3));
        let tiny = |x: Number| x.log2() < -64.0 * 6.0 + 12.0;
        let ((sa, ca), (sb, cb), (s, c)) = (a.sin_cos(), b.sin_cos(), (a + b).sin_cos());
        prop_assert!(tiny(sa * cb + ca * sb - s) && tiny(ca * cb - sa * sb - c));
        prop_assert!(tiny((a.exp() * b.exp() - (a + b).exp()) / (a + b).exp()));
        prop_assert!(tiny(a.exp().ln() - a) && tiny(s.atan2(c) - (a + b) + whole_turns(a + b)));
        let (plus, minus) = (b.exp(), (-b).exp());
        prop_assert!(tiny((plus - minus) / (plus + minus) - b.tanh()));
    }
}

fn whole_turns(angle: Number) -> Number {
    let turn = elementary::pi::<8>().ldexp(1);
    Number::of((angle.value() / turn.value()).round()) * turn
}

/// 100 decimals of published constants: OEIS A000796, A001113, A002162, A049469, A049470, A073744, A002193.
#[test]
fn published_constants_have_a_hundred_digits() {
    let one = Number::ONE;
    for (found, digits) in [
        (
            elementary::pi(),
            "3.141592653589793238462643383279502884197169399375105820974\
             944592307816406286208998628034825342117068",
        ),
        (
            one.exp(),
            "2.718281828459045235360287471352662497757247093699959574966\
             967627724076630353547594571382178525166427",
        ),
        (
            Number::whole(2).ln(),
            "0.693147180559945309417232121458176568075500134360255254120\
             6800094933936219696947156058633269964186875",
        ),
        (
            one.sin_cos().0,
            "0.841470984807896506652502321630298999622563060798371065672\
             7517099919104043912396689486397435430526958",
        ),
        (
            one.sin_cos().1,
            "0.540302305868139717400936607442976603732310420617922227670\
             0972553811003947744717645179518560871830893",
        ),
        (
            one.tanh(),
            "0.761594155955764888119458282604793590412768597257936551596\
             8105001219532445766384834589475216736767144",
        ),
        (
            Number::whole(2).sqrt(),
            "1.414213562373095048801688724209698078569671875376948073176\
             679737990732478462107038850387534327641572",
        ),
    ] {
        let expected = Number::from_decimal(digits).expect("digits");
        assert!((found - expected).abs().log2() < -329.0, "{found:?} {digits}");
    }
}

#[test]
fn more_limbs_change_nothing_but_the_last_digits() {
    let long = Digits::<MOST>::whole(3).sqrt().sin_cos().0;
    let short = Digits::<16>::whole(3).sqrt().sin_cos().0;
    let text = long.to_decimal(2000);
    assert!((1992..=2002).contains(&text.len()), "{text}");
    assert_eq!(text[..280], short.to_decimal(278));
    let angle = long.atan2((Digits::ONE - long * long).sqrt());
    let exact = elementary::pi::<MOST>() - Digits::<MOST>::whole(3).sqrt();
    assert!((angle - exact).log2() < -7000.0, "{}", (angle - exact).log2());
}

#[test]
fn layouts_are_those_of_doubles() {
    for text in
        ["0.6", "-12.25", "1e-5", "1.5e300", "1e16", "123456.0", "0.0001", "9999999999999998.0", "-2.5e-7"]
    {
        let number = Number::from_decimal(text).expect("a number");
        assert_eq!(number.to_decimal(30), text);
    }
    assert_eq!(Number::from_decimal("0.9996").expect("a number").to_decimal(3), "1.0");
    assert_eq!(Number::ZERO.to_decimal(9), "0.0");
    for bad in ["", "-", "1..2", "0x1", "1e", "e5", ".5", "nan", "1 2"] {
        assert!(Number::from_decimal(bad).is_none(), "{bad}");
    }
}

#[test]
fn what_is_not_finite_stays_so() {
    let nan = Number::ONE / Number::ZERO;
    for found in
        [nan, nan + Number::ONE, nan * Number::ZERO, nan.sqrt(), nan.sin_cos().0, (-Number::ONE).ln()]
    {
        assert!(!found.is_finite() && found.value().is_nan());
    }
    assert!(Number::of(f64::INFINITY).partial_cmp(&Number::ONE).is_none());
}

/// Numbers of more limbs than a few, in every size of room: what fits in them is exact.
#[test]
fn whole_numbers_are_exact_at_any_length() {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let whole = |x: &Digits<MOST>| integer(x) >> (64 * PLACES);
    for limbs in (2..40).chain([64, MOST - 1, MOST]) {
        let mut number = |is_negative| {
            let mut half: Vec<u64> = (0..limbs / 2).map(|_| next()).collect();
            // Sums of a few products fit as well.
            half[0] = half[0] >> 2 | 1;
            Digits::<MOST>::normalized(is_negative, (limbs / 2) as i32, MOST, &half).shortened(limbs)
        };
        let [a, b, c, d] = [false, true, true, false].map(&mut number);
        let [exact_a, exact_b, exact_c, exact_d] = [&a, &b, &c, &d].map(whole);
        assert_eq!(whole(&(a * b)), &exact_a * &exact_b, "{limbs} limbs");
        assert_eq!(whole(&(a + b)), &exact_a + &exact_b, "{limbs} limbs");
        assert_eq!(whole(&(a - b)), &exact_a - &exact_b, "{limbs} limbs");
        let terms = [(a, b), (c, d), (b, c)];
        let found = sum_of_products(terms.iter().map(|(a, b)| (a, b)));
        assert_eq!(
            whole(&found),
            exact_a * &exact_b + &exact_c * exact_d + exact_b * exact_c,
            "{limbs} limbs"
        );
    }
}
