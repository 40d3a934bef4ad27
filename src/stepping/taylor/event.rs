//! Zeros of event functions on the polynomial of a step.
//!
//! ```text
//! on |t - c| <= r, with B a bound of |g''| there:
//! |g(c)| > |g'(c)| r + B r²/2     no zero
//! |g'(c)| > B r                   monotone: at most one, told by the signs at the ends
//! else                            both halves, the earlier one first
//! ```
//!
//! B is a sum of magnitudes, and far too large where high powers cancel: on small parts the bounds are those of the polynomial about c, a_k (t - c)^k:
//! r |a_1| + r² |a_2| + … instead of |g'| r + B r²/2, and likewise for g'.  Where all of it is below the rounding of g there is nothing to be told apart,
//! and signs at the ends decide.
//!
//! No sampling: two zeros as close together as 1e-9 of the step are found.  Source: R. E. Moore, *Methods and Applications of Interval
//! Analysis* (1979), chapter 5, for exclusion by bounds; Newton's method inside a bracket after W. Press et al., *Numerical Recipes*, 3rd
//! ed. (2007), section 9.4.

/// A gap \[m\], or force over energy \[1/m\], that counts as zero at the step's start: it must open before it can close.
const TOUCH: f64 = 1e-12;
/// Share of the step below which two zeros are one.
const CLOSE: f64 = 1e-9;
/// Share of the step from which on down the polynomial is taken about the middle of a part.
const SMALL: f64 = 1.0 / 64.0;
/// Roundings of its largest terms up to which a value is zero.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// What an event function does in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crossing {
    /// It stays positive, or at zero.
    Nothing,
    /// It passes from positive to negative at this time \[s\].
    At(f64),
    /// From zero it goes negative without opening first; it has left zero at this time \[s\].
    Inside(f64),
}

/// The first passage of the polynomial with these powers within `h` \[s\].
pub fn crossing(powers: &[f64], h: f64) -> Crossing {
    let first = powers.first().copied().unwrap_or(f64::INFINITY);
    if first > TOUCH {
        return root(powers, 0.0, 0.0, h).map_or(Crossing::Nothing, Crossing::At);
    }
    let opens = root(powers, TOUCH, 0.0, h);
    let is_below = first <= -TOUCH;
    let sinks = root(powers, if is_below { first - 0.1 * TOUCH } else { -TOUCH }, 0.0, h);
    match (opens, sinks) {
        (open, Some(sink)) if open.is_none_or(|open| sink < open) => Crossing::Inside(if is_below { 0.0 } else { sink }),
        (Some(open), _) => root(powers, 0.0, open, h).map_or(Crossing::Nothing, Crossing::At),
        (None, _) => Crossing::Nothing,
    }
}

/// The first change of sign of `polynomial - level` in (from, to].
fn root(powers: &[f64], level: f64, from: f64, to: f64) -> Option<f64> {
    search(powers, level, from, to).0
}

/// The same, and the number of parts it took.
fn search(powers: &[f64], level: f64, from: f64, to: f64) -> (Option<f64>, usize) {
    // Later halves wait; thirty halvings come down to what counts as close.
    let mut parts = [(from, to); 40];
    let (mut count, mut seen) = (1, 0);
    let least = CLOSE * (to - from);
    let mut local = Vec::new();
    while count > 0 {
        count -= 1;
        seen += 1;
        let (low, high) = parts[count];
        let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low));
        let (told, is_whole) = if radius > SMALL * (to - from) {
            (roughly(powers, level, centre, radius), false)
        } else {
            local.clear();
            local.extend_from_slice(powers);
            shift(&mut local, centre);
            (closely(&local, level, radius, ROUNDING * (size(powers, high) + level.abs())), radius < least)
        };
        match told {
            Told::NoZero => {}
            Told::Open if !is_whole => {
                (parts[count], parts[count + 1]) = ((centre, high), (low, centre));
                count += 2;
            }
            _ => {
                let at = |t: f64| value(powers, t).0 - level;
                let (before, after) = (at(low), at(high));
                // A zero at the beginning is the one the search starts from.
                if before != 0.0 && (before > 0.0) != (after > 0.0) {
                    return (Some(bracketed(powers, level, low, high, before > 0.0)), seen);
                }
            }
        }
    }
    (None, seen)
}

/// What bounds tell of `polynomial - level` on a part of the step.
enum Told {
    NoZero,
    /// At most one, or nothing but rounding: the signs at the ends tell.
    BySigns,
    Open,
}

/// By a bound of the second derivative.
fn roughly(powers: &[f64], level: f64, centre: f64, radius: f64) -> Told {
    let (value, slope) = value(powers, centre);
    let bend = bend(powers, centre + radius);
    if (value - level).abs() > slope.abs() * radius + 0.5 * bend * radius * radius {
        Told::NoZero
    } else if slope.abs() > bend * radius {
        Told::BySigns
    } else {
        Told::Open
    }
}

/// By the polynomial about the middle of the part, whose values are rounded by as much as `rounding`.
fn closely(local: &[f64], level: f64, radius: f64, rounding: f64) -> Told {
    let value = local.first().map_or(0.0, |value| value - level).abs();
    let slope = local.get(1).map_or(0.0, |slope| slope.abs());
    let (mut tilt, mut power) = (0.0, radius);
    for (m, a) in local.iter().enumerate().skip(2) {
        tilt += m as f64 * a.abs() * power;
        power *= radius;
    }
    // |a_k| r^k is at most half of k |a_k| r^k.
    let reach = radius * (slope + 0.5 * tilt);
    let most = value + reach;
    if value > reach.max(rounding) {
        Told::NoZero
    } else if slope > tilt || most <= rounding || most.is_nan() {
        Told::BySigns
    } else {
        Told::Open
    }
}

/// Powers about `centre`, in their place: Horner's scheme, once a power.
fn shift(powers: &mut [f64], centre: f64) {
    for first in 0..powers.len() {
        for m in (first + 1..powers.len()).rev() {
            powers[m - 1] += centre * powers[m];
        }
    }
}

/// Sum of the magnitudes of all terms up to time `t`.
fn size(powers: &[f64], t: f64) -> f64 {
    powers.iter().rev().fold(0.0, |sum, power| sum * t + power.abs())
}

/// The zero between two times at which the signs differ: Newton's method, and bisection where it would leave the bracket.
fn bracketed(powers: &[f64], level: f64, mut low: f64, mut high: f64, falls: bool) -> f64 {
    let mut t = 0.5 * (low + high);
    for _ in 0..100 {
        let (value, slope) = value(powers, t);
        let value = value - level;
        if (value > 0.0) == falls {
            low = t
        } else {
            high = t
        }
        let next = t - value / slope;
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        if next == t || next <= low || next >= high {
            break;
        }
        if (next - t).abs() <= f64::EPSILON * t {
            return next;
        }
        t = next;
    }
    high
}

/// Value and derivative.
pub fn value(powers: &[f64], t: f64) -> (f64, f64) {
    powers.iter().rev().fold((0.0, 0.0), |(value, slope), &power| (value * t + power, slope * t + value))
}

/// A bound of the second derivative up to time `t`.
fn bend(powers: &[f64], t: f64) -> f64 {
    let terms = powers.iter().enumerate().skip(2).rev();
    terms.fold(0.0, |sum, (m, power)| sum * t + (m * (m - 1)) as f64 * power.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn where_rounding_is_all_there_is_signs_tell_and_few_parts_are_looked_at() {
        for (roots, level, falls) in [(vec![0.5; 12], 0.0, None), (vec![0.5; 11], 0.0, Some(0.5)), (vec![0.5; 12], -1e-9, Some(f64::NAN))] {
            let powers = through(&roots, if roots.len() % 2 == 0 { 1.0 } else { -1.0 });
            let (found, parts) = search(&powers, level, 0.0, 1.0);
            assert!(parts < 1000, "{} roots: {parts} parts", roots.len());
            match (found, falls) {
                (None, falls) => assert!(falls.is_none_or(f64::is_nan), "lost"),
                // Zeros of so many roots are known to the twelfth root of rounding.
                (Some(t), falls) => assert!(!falls.is_some_and(f64::is_nan) && (t - 0.5).abs() < 0.1, "{t}"),
            }
        }
        for nothing in [0.0, f64::NAN] {
            let (found, parts) = search(&[nothing; 21], 0.0, 0.0, 1.0);
            assert!(found.is_none() && parts < 1000);
        }
        // Noise about a level.
        let powers: Vec<f64> = (0..21).map(|m| if m == 0 { 1e-12 } else { 1e-17 * f64::from(m % 3 - 1) }).collect();
        let (_, parts) = search(&powers, 1e-12, 0.0, 1.0);
        assert!(parts < 1000, "{parts}");
    }

    #[test]
    fn powers_about_another_time_give_the_same_values() {
        let powers = through(&[0.3, 0.5, 0.9], -1.0);
        let mut local = powers.clone();
        shift(&mut local, 0.4);
        for t in [0.0, 0.35, 0.6] {
            assert!((value(&powers, t).0 - value(&local, t - 0.4).0).abs() < 1e-15);
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
}
