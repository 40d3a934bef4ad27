//! Derivatives by differences that become finer until two of them agree: the functions may have corners
//! nearby, as |N| of dry friction and impacts between sliding and sticking have.

/// Two differences agree where they are apart by less than this share of themselves, or by so many units in
/// the last place of the values they are of.
const AGREE: f64 = 1e-10;
const UNITS: f64 = 64.0;
/// What is derived by, at the places of a difference, is off by so many units in the last place.
const PLACES: f64 = 4.0;
/// Two differences are apart by rounding where that is at most so many times what finer ones are apart, over
/// how much finer these are.
const NOISE: f64 = 16.0;

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
/// the next one, value by value.  Where no two agree, by the coarsest that rounding keeps apart from the next
/// one, and else by the finer one of the nearest two.  `None` where there is no such difference.
pub(in crate::run) fn agreeing(
    levels: usize,
    mut difference: impl FnMut(usize) -> Option<Difference>,
) -> Option<Agreed> {
    let mut all = vec![difference(0)?];
    let mut taken: Vec<Option<usize>> = vec![None; all[0].slopes.len()];
    for level in 1..levels {
        let (now, last) = (difference(level)?, &all[level - 1]);
        for (k, taken) in taken.iter_mut().enumerate().filter(|(_, taken)| taken.is_none()) {
            let off = (now.slopes[k] - last.slopes[k]).abs();
            let agrees = off <= AGREE * last.slopes[k].abs() + now.rounding[k];
            *taken = agrees.then_some(level - 1);
        }
        all.push(now);
        if taken.iter().all(Option::is_some) {
            break;
        }
    }
    let mut found = Agreed { slopes: Vec::with_capacity(taken.len()), finest: 0, noise: 0.0 };
    for (k, taken) in taken.into_iter().enumerate() {
        let (level, noise) = taken.map_or_else(|| apart(&all, k), |level| (level, 0.0));
        found.slopes.push(all[level].slopes[k]);
        (found.finest, found.noise) = (found.finest.max(level), found.noise.max(noise));
    }
    Some(found)
}

/// Of a value of which no two differences agree, the number of the one that tells it, and what rounding
/// leaves of it where that is why.
fn apart(all: &[Difference], k: usize) -> (usize, f64) {
    let off = |level: usize| (all[level].slopes[k] - all[level - 1].slopes[k]).abs();
    let noise = |level: usize| {
        let finer = (level + 1..all.len()).map(|finer| off(finer) * all[level].far / all[finer].far);
        finer.fold(0.0, f64::max)
    };
    match (1..all.len()).find(|&level| off(level) <= NOISE * noise(level)) {
        Some(level) => (level - 1, off(level)),
        None => {
            ((1..all.len()).min_by(|&one, &other| off(one).total_cmp(&off(other))).unwrap_or_default(), 0.0)
        }
    }
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

    /// Noise of 1e-12 in values at distances of 1e-3, of which a bound by the last digits knows nothing.
    #[test]
    fn of_differences_that_rounding_keeps_apart_the_coarsest_tells() {
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut coarsest = 0;
        for _ in 0..100 {
            let levels = |level: usize| {
                let h = 1e-3 * f64::powi(1.0 / 32.0, level as i32);
                let mut at = |side: f64| (0.5 * side / h, vec![2.0 * side * h + 1e-12 * noise()]);
                Some(Difference::of([at(-1.0), at(1.0)], &[], 1.0 / h))
            };
            let Agreed { slopes, finest, .. } = agreeing(4, levels).expect("a derivative");
            assert!((slopes[0] - 2.0).abs() < 2e-8, "{slopes:?} of {finest}");
            coarsest += u32::from(finest == 0);
        }
        // Finer ones agree by chance now and then.
        assert!(coarsest > 95, "{coarsest} of 100");
    }
}
