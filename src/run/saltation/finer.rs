//! Derivatives by differences that become finer until two of them agree: the functions may have corners
//! nearby, as |N| of dry friction and impacts between sliding and sticking have.

/// Two differences agree where they are apart by less than this share of themselves, or by so many units in
/// the last place of the values they are of.
const AGREE: f64 = 1e-10;
const UNITS: f64 = 64.0;
/// What is derived by, at the places of a difference, is off by so many units in the last place.
const PLACES: f64 = 4.0;
/// Two differences are apart by rounding where that is at most so many times what the next two, finer by a
/// factor, are apart over this factor.
const NOISE: f64 = 4.0;

/// Mechanisms at one distance of a number.
#[derive(Clone, Debug)]
pub(in crate::run) struct DistanceLevel<T> {
    /// The number over that distance.
    pub far: f64,
    pub list: Vec<T>,
}

/// Derivatives of some functions by one difference, and what rounding leaves of them.
pub(in crate::run) struct Difference {
    slopes: Vec<f64>,
    rounding: Vec<f64>,
    far: f64,
}

impl Difference {
    /// Of values at some places, which count with these weights, less those `here`, where these are known;
    /// what it is derived by is so `far` in units of the distance between places.
    pub fn of(values: impl IntoIterator<Item = (f64, Vec<f64>)>, here: &[f64], far: f64) -> Self {
        let (mut slopes, mut rounding): (Vec<f64>, Vec<f64>) = Default::default();
        for (weight, values) in values {
            slopes.resize(values.len(), 0.0);
            rounding.resize(values.len(), 0.0);
            for (k, value) in values.into_iter().enumerate() {
                slopes[k] += weight * (value - here.get(k).copied().unwrap_or_default());
                rounding[k] = rounding[k].max(UNITS * f64::EPSILON * (weight * value).abs());
            }
        }
        for (rounding, slope) in rounding.iter_mut().zip(&slopes) {
            *rounding += PLACES * f64::EPSILON * far * slope.abs();
        }
        Self { slopes, rounding, far }
    }
}

/// The nearest two of the differences of a value so far, none of which agree.
#[derive(Clone, Copy)]
struct Nearest {
    /// The coarser one, and the finer one.
    values: [f64; 2],
    /// The number of the finer one.
    level: usize,
    /// How far they are apart.
    off: f64,
    /// The same of the next two, over how much finer these are.
    noise: f64,
}

/// Derivatives of some functions, told by several differences.
#[derive(Clone, Debug)]
pub(in crate::run) struct Agreed {
    pub slopes: Vec<f64>,
    /// The number of the finest difference that was taken.
    pub finest: usize,
    /// What rounding leaves of those of which no two differences agree, at most.
    pub noise: f64,
}

/// The derivatives by the coarsest of so many differences, each finer than the one before, that agrees with
/// the next one.  Where no two agree those tell, value by value, that are nearest to each other: the coarser
/// one where rounding is what they are apart by, and else the finer one.  `None` where there is no such
/// difference.
pub(in crate::run) fn agreeing(
    levels: usize,
    mut difference: impl FnMut(usize) -> Option<Difference>,
) -> Option<Agreed> {
    let Difference { slopes: mut before, mut far, .. } = difference(0)?;
    let (mut found, mut taken) = (before.clone(), vec![0; before.len()]);
    let none = Nearest { values: [0.0; 2], level: 0, off: f64::INFINITY, noise: 0.0 };
    let mut nearest = vec![Some(none); found.len()];
    for level in 1..levels {
        let Difference { slopes, rounding, far: farther } = difference(level)?;
        for (k, (&now, &last)) in slopes.iter().zip(&before).enumerate() {
            let Some(nearest_two) = &mut nearest[k] else { continue };
            let off = (now - last).abs();
            if off <= AGREE * last.abs() + rounding[k] {
                (found[k], taken[k], nearest[k]) = (last, level - 1, None);
            } else if off < nearest_two.off {
                *nearest_two = Nearest { values: [last, now], level, off, noise: 0.0 };
            } else if nearest_two.level + 1 == level {
                nearest_two.noise = off * far / farther;
            }
        }
        if nearest.iter().all(Option::is_none) {
            break;
        }
        (before, far) = (slopes, farther);
    }
    let mut most = 0.0_f64;
    for (k, nearest) in nearest.iter().enumerate() {
        if let Some(Nearest { values: [coarse, fine], level: level @ 1.., off, noise }) = *nearest {
            let is_rounding = off <= NOISE * noise;
            (found[k], taken[k]) = if is_rounding { (coarse, level - 1) } else { (fine, level) };
            most = most.max(if is_rounding { off } else { 0.0 });
        }
    }
    Some(Agreed { slopes: found, finest: taken.into_iter().max().unwrap_or(0), noise: most })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivative of a function at a place, and the number of the difference that tells it.
    fn derivative(f: impl Fn(f64) -> f64, x: f64) -> (f64, usize) {
        let levels = |level: usize| {
            let h = 1e-3 * f64::powi(0.125, level as i32);
            Some(Difference::of([-1.0, 1.0].map(|side| (0.5 * side / h, vec![f(x + side * h)])), &[], x / h))
        };
        let Agreed { slopes, finest, .. } = agreeing(6, levels).expect("a derivative");
        (slopes[0], finest)
    }

    #[test]
    fn corners_nearby_are_not_reached_over() {
        for distance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            let corner = 1.0 - distance;
            let (slope, _) = derivative(|x| 3.0 * (x - corner).abs() + x, 1.0);
            assert!((slope - 4.0).abs() < 1e-8, "{distance}: {slope}");
        }
    }

    #[test]
    fn what_is_smooth_keeps_the_coarsest_difference_that_is_good_enough() {
        let (slope, finest) = derivative(|x| x * x, 3.0);
        assert!((slope - 6.0).abs() < 1e-10 && finest == 0, "{slope} of {finest}");
        // The second order is not enough for a sine at the longest distance.
        let (slope, finest) = derivative(f64::sin, 1.0);
        assert!((slope - f64::cos(1.0)).abs() < 1e-9 && finest > 0, "{slope} of {finest}");
    }

    /// Noise of 1e-12 in values of size 1 hides that of a slope that is not known to exist.
    #[test]
    fn of_differences_that_rounding_keeps_apart_the_coarsest_tells() {
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for _ in 0..100 {
            let levels = |level: usize| {
                let h = 1e-3 * f64::powi(1.0 / 32.0, level as i32);
                let mut at = |side: f64| (0.5 * side / h, vec![2.0 * side * h + 1e-12 * noise()]);
                Some(Difference::of([at(-1.0), at(1.0)], &[], 1.0 / h))
            };
            let Agreed { slopes, finest, noise } = agreeing(4, levels).expect("a derivative");
            let off = (slopes[0] - 2.0).abs();
            assert!(off < 1e-9 && off <= noise && finest == 0, "{slopes:?} of {finest}: {noise}");
        }
    }
}
