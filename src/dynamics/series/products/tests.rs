//! Products and operations in slots of all kinds, against those in memory.

use super::*;
use crate::arithmetic::lanes::Hardware;
use crate::arithmetic::lanes::wide::{EightLanes, Single, Vectors, WideCode, WideHardware};
use crate::dynamics::series::SeriesNumber;
use crate::dynamics::series::varied::Number;

/// Powers of every series.
const COUNT: usize = 9;

fn number(k: usize) -> Number {
    let of = |i: usize| libm::sin(1.0 + 2.3 * k as f64 + 0.7 * i as f64);
    Number::new(of(100), std::array::from_fn(of))
}

fn power(series: usize, m: usize) -> Number {
    number(COUNT * series + m)
}

/// Every product of factors, and every operation on numbers, in slots of one kind.
struct All {
    is_single: bool,
}

impl All {
    fn of<S: Slots>() -> Vec<Number> {
        let [a, b, c, d]: [VariedFactor<S>; 4] = std::array::from_fn(|series| {
            let mut factor = VariedFactor::new(COUNT - 1);
            (0..COUNT).for_each(|m| factor.push(&(), InSlots::load(&power(series, m))));
            factor
        });
        let mut found = vec![a.product(&b, &(), 6, 2..=5)];
        found.extend(CauchyFactor::products([&a, &c], &b, &(), 6, 2..=5));
        found.push(CauchyFactor::sum_of_products([[&a, &b], [&c, &d]], -1.0, &(), 6, 2..=5));
        let mut ahead = SumsAhead::default();
        for m in 0..COUNT - 1 {
            found.extend(CauchyFactor::turned([&a, &b], &c, &(), m, &mut ahead));
            found.push(CauchyFactor::crossed([&a, &b], [&c, &d], &(), m, &mut ahead));
        }
        let [x, y] = [0, 1].map(|k| InSlots::<S>::load(&number(k)));
        found.extend([x + y, x - y, x * y, x / y, -x, x.scale(0.3), (x * x).sqrt(), x.sin_cos().0]);
        found.extend([x.with_product(x, y, true), x.exp(), (x * x).ln(), x.tanh(), x.atan2(y)]);
        found.into_iter().map(InSlots::store).collect()
    }
}

impl WideCode for All {
    type Output = Vec<Number>;

    fn run<W: EightLanes>(self) -> Vec<Number> {
        if self.is_single { Self::of::<Single<W::Half>>() } else { Self::of::<W>() }
    }
}

/// The same by the arithmetic of numbers in memory.
fn expected() -> Vec<Number> {
    let sum = |a: usize, b: usize, total: usize, of: RangeInclusive<usize>| {
        of.fold(Number::ZERO, |sum, j| sum + power(a, j) * power(b, total - j))
    };
    let plain = |a, b| sum(a, b, 6, 2..=5);
    let mut all = vec![plain(0, 1), plain(0, 1), plain(2, 1), plain(0, 1) - plain(2, 3)];
    for m in 0..COUNT - 1 {
        all.extend([0, 1].map(|e| sum(e, 2, m + 1, 1..=m + 1)));
        all.push(sum(0, 3, m, 1..=m) - sum(1, 2, m, 1..=m));
    }
    let (x, y) = (number(0), number(1));
    all.extend([x + y, x - y, x * y, x / y, -x, x.scale(0.3), (x * x).sqrt(), x.sin_cos().0]);
    all.extend([x + x * y, x.exp(), (x * x).ln(), x.tanh(), x.atan2(y)]);
    all
}

#[test]
fn numbers_in_slots_are_numbers_with_derivatives() {
    let found = Vectors::default().run(All { is_single: false });
    let expected = expected();
    assert_eq!(found.len(), expected.len());
    for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
        let slopes = found.slope.iter().zip(&expected.slope);
        let apart = slopes.fold((found.value - expected.value).abs(), |most, (a, b)| most.max((a - b).abs()));
        assert!(apart < 1e-13, "{k}: {found:?} {expected:?}");
    }
}

#[test]
fn all_slots_have_the_same_bits() {
    let bits = |number: &Number| [number.value.to_bits(), number.slope[0].to_bits()];
    let all = |number: &Number| (number.value.to_bits(), number.slope.map(f64::to_bits));
    let expected = Vectors::Portable.run(All { is_single: false });
    let four = Hardware::ask().map(Vectors::Two);
    let wide = WideHardware::ask().map(Vectors::One);
    for vectors in [Some(Vectors::Portable), four, wide].into_iter().flatten() {
        let found = vectors.run(All { is_single: false });
        assert!(found.iter().map(all).eq(expected.iter().map(all)), "{vectors:?}");
        let alone = vectors.run(All { is_single: true });
        assert!(alone.iter().map(bits).eq(expected.iter().map(bits)), "one beside {vectors:?}");
    }
}
