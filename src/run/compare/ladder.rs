//! The settings a method is tried at, from coarse to fine.

use super::super::methods::{MethodInfo, Stepping};

/// Tolerances of an adaptive method, from coarse to fine; `extended` ones are those of series whose first
/// orders are in double-double.
pub(super) fn tolerances(info: &MethodInfo, extended: bool) -> &'static [f64] {
    const EXTENDED: &[f64] = &[1e-16, 1e-18, 1e-20, 1e-22];
    const ALL: &[f64] = &[1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15];
    match info.order {
        _ if extended => EXTENDED,
        0..=5 => &ALL[..8],
        6..=9 => &ALL[1..11],
        _ => &ALL[1..],
    }
}

/// Steps \[s\] of a fixed-step method, from coarse to fine: whole parts of `every` \[s\] around `usual`
/// \[s\], which suits the scene.
///
/// The parts are such that steps have few digits where `every` has: 10, 16, 25, 40 and 64 times powers of
/// ten, or 10, 20 and 50 times those, and small ones.
pub(super) fn steps(info: &MethodInfo, usual: f64, every: f64) -> Vec<f64> {
    debug_assert!(info.stepping == Stepping::Fixed);
    const SMALL: &[f64] = &[1.0, 2.0, 4.0, 8.0];
    const DENSE: &[f64] = &[10.0, 16.0, 25.0, 40.0, 64.0];
    const SPARSE: &[f64] = &[10.0, 20.0, 50.0];
    // The lower the order, the wider the range of steps that says something.
    let (series, coarser, count) = match info.order {
        0..=2 => (SPARSE, 2.0, 8),
        3..=4 => (SPARSE, 16.0, 9),
        5..=8 => (SPARSE, 20.0, 9),
        _ => (DENSE, 25.0, 11),
    };
    let least = every / (coarser * usual);
    let large = (0..9).flat_map(|decade| series.iter().map(move |part| part * 10_f64.powi(decade)));
    (SMALL.iter().copied().chain(large))
        .filter(|parts| *parts >= least * (1.0 - 1e-9))
        .take(count)
        .map(|parts| tidy(every / parts))
        .collect()
}

/// The interval at which runs to `until` \[s\] are looked at: whole parts of it, `least` at least, and of one
/// digit where that is possible.
pub(super) fn interval(until: f64, least: f64) -> f64 {
    let largest = until / least;
    let decade = largest.log10().floor() as i32;
    // One or two: the parts of these that steps are have few digits.
    let fine = (decade - 1..=decade)
        .rev()
        .flat_map(|decade| [2.0, 1.0].map(|digit| tidy(digit * 10_f64.powi(decade))));
    let is_part = |every: &f64| (until / every - (until / every).round()).abs() < 1e-9;
    fine.filter(|every| *every <= largest * (1.0 + 1e-9)).find(is_part).unwrap_or(until / least.ceil())
}

/// The largest number with one digit, 1, 2 or 5, up to this one.
pub(super) fn round_down(x: f64) -> f64 {
    let power = 10_f64.powi(x.log10().floor() as i32);
    tidy(
        [5.0, 2.0, 1.0]
            .into_iter()
            .map(|digit| digit * power)
            .find(|&y| y <= x * (1.0 + 1e-9))
            .unwrap_or(power),
    )
}

/// The same number without the dust of a division, where that is all there is to it.
fn tidy(x: f64) -> f64 {
    let short: f64 = format!("{x:.11e}").parse().unwrap_or(x);
    if (short - x).abs() <= 4.0 * f64::EPSILON * x.abs() { short } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::METHODS;

    #[test]
    fn steps_are_round_whole_parts_around_the_usual_one() {
        for info in METHODS.iter().filter(|info| info.stepping == Stepping::Fixed) {
            let found = steps(info, 0.005, 0.2);
            assert!(
                found.len() >= 6 && found.windows(2).all(|pair| pair[1] < pair[0]),
                "{}: {found:?}",
                info.name
            );
            for step in &found {
                assert!(format!("{step}").len() <= 10, "{}: {step}", info.name);
                assert!((0.2 / step - (0.2 / step).round()).abs() < 1e-9);
            }
            assert!(found[0] >= 0.005 && found[0] <= 0.2, "{}: {found:?}", info.name);
        }
    }

    #[test]
    fn intervals_are_whole_parts_of_the_horizon() {
        for (until, least, every) in
            [(10.0, 40.0, 0.2), (500.0, 200.0, 2.0), (1.0, 32.0, 0.02), (0.3, 32.0, 0.002)]
        {
            assert_eq!(interval(until, least), every, "{until}");
        }
        let odd = interval(std::f64::consts::PI, 40.0);
        assert_eq!((std::f64::consts::PI / odd).round(), 40.0);
        assert_eq!((round_down(731.0), round_down(0.2), round_down(1.9e-3)), (500.0, 0.2, 1e-3));
    }
}
