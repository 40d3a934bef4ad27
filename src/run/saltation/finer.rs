//! Derivatives by differences that become finer until two of them agree: the functions may have corners
//! nearby, as |N| of dry friction and impacts between sliding and sticking have.

/// Two differences agree where they are apart by less than this share of themselves, or by so many units in
/// the last place of the values they are of.
const AGREE: f64 = 1e-10;
const UNITS: f64 = 64.0;
/// What is derived by, at the places of a difference, is off by so many units in the last place.
const PLACES: f64 = 4.0;

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
        Self { slopes, rounding }
    }
}

/// The derivatives by the coarsest of so many differences, each finer than the one before, that agrees with
/// the next one; where no two agree the finer of the two that are nearest to each other tells, value by
/// value.  With the number of the finest that was taken; `None` where there is no such difference.
pub(in crate::run) fn agreeing(
    levels: usize,
    mut difference: impl FnMut(usize) -> Option<Difference>,
) -> Option<(Vec<f64>, usize)> {
    let Difference { slopes: mut before, .. } = difference(0)?;
    let (mut found, mut taken) = (before.clone(), vec![0; before.len()]);
    // How far apart the nearest two differences of each value are that have none that agree.
    let mut apart = vec![Some(f64::INFINITY); found.len()];
    for level in 1..levels {
        let Difference { slopes, rounding } = difference(level)?;
        for (k, (&now, &last)) in slopes.iter().zip(&before).enumerate() {
            let Some(least) = apart[k] else { continue };
            let off = (now - last).abs();
            if off <= AGREE * last.abs() + rounding[k] {
                (found[k], taken[k], apart[k]) = (last, level - 1, None);
            } else if off < least {
                (found[k], taken[k], apart[k]) = (now, level, Some(off));
            }
        }
        if apart.iter().all(Option::is_none) {
            break;
        }
        before = slopes;
    }
    Some((found, taken.into_iter().max().unwrap_or(0)))
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
        let (slopes, finest) = agreeing(6, levels).expect("a derivative");
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
}
