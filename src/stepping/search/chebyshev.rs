//! Functions known by their values alone: Chebyshev interpolants, of as high a degree as they need.

use super::{Curve, IntervalBounds, ROUNDING};

use std::sync::OnceLock;

/// Interpolants of several functions on \[0, 1\], all of one degree.
#[derive(Clone, Debug)]
pub struct Interpolants {
    /// Function by function.
    pub curves: Vec<Chebyshev>,
    /// Where their values were taken.
    pub nodes: &'static Nodes,
    /// Their values there, function by function.
    pub values: Vec<Vec<f64>>,
    /// True where the last degree was enough.
    pub is_resolved: bool,
}

/// The places of the values of an interpolant of one degree, from 1 to 0, and the cosines it takes.
#[derive(Clone, Debug, Default)]
pub struct Nodes {
    /// The places.
    pub places: Vec<f64>,
    /// cos(π j k / degree), a row for each node j.
    cosines: Vec<f64>,
    /// What values at the places count in an integral from 0 to 1.
    weights: Vec<f64>,
}

/// The largest degree of [`interpolated`].
const LARGEST: usize = 64;

impl Nodes {
    /// Those of a degree, at least 1.
    pub(super) fn new(degree: usize) -> Self {
        let degree = degree.max(1);
        let cosine = |m: usize| libm::cos(std::f64::consts::PI * m as f64 / degree as f64);
        let wave: Vec<f64> = (0..2 * degree).map(cosine).collect();
        let all = || (0..=degree).flat_map(|j| (0..=degree).map(move |k| (j, k)));
        let mut nodes = Self {
            places: wave[..=degree].iter().map(|cosine| 0.5 + 0.5 * cosine).collect(),
            cosines: all().map(|(j, k)| wave[(j * k) % (2 * degree)]).collect(),
            weights: Vec::new(),
        };
        let unit = |j: usize| (0..=degree).map(|k| if j == k { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        nodes.weights = (0..=degree).map(|j| nodes.through(&unit(j)).integral()).collect();
        nodes
    }

    /// Those of a degree up to [`LARGEST`], made when they are first asked for.
    fn of(degree: usize) -> &'static Self {
        static KNOWN: [OnceLock<Nodes>; LARGEST + 1] = [const { OnceLock::new() }; LARGEST + 1];
        let degree = degree.clamp(1, LARGEST);
        KNOWN[degree].get_or_init(|| Self::new(degree))
    }

    /// The interpolant of values at these places.
    fn through(&self, values: &[f64]) -> Chebyshev {
        let degree = self.places.len() - 1;
        let end = |k: usize| if k == 0 || k == degree { 0.5 } else { 1.0 };
        let mut coefficients = vec![0.0; degree + 1];
        for (j, (value, cosines)) in values.iter().zip(self.cosines.chunks_exact(degree + 1)).enumerate() {
            let value = end(j) * value;
            coefficients.iter_mut().zip(cosines).for_each(|(sum, cosine)| *sum += value * cosine);
        }
        coefficients.iter_mut().enumerate().for_each(|(k, sum)| *sum *= 2.0 / degree as f64 * end(k));
        let steep = |(k, c): (usize, &f64)| 4.0 * (k * k * (k * k - k.min(1))) as f64 / 3.0 * c.abs();
        let bend = coefficients.iter().enumerate().map(steep).sum();
        Chebyshev { coefficients, bend }
    }

    /// The integral from 0 to 1 of the interpolant of values at these places.
    pub fn integral(&self, values: impl Iterator<Item = f64>) -> f64 {
        self.weights.iter().zip(values).fold(0.0, |sum, (weight, value)| sum + weight * value)
    }
}

/// Interpolates functions by one of the `degrees`, at most [`LARGEST`], after the other, until a degree is
/// enough for each of them, of which `is_enough` is given the number and the curve, and that of the degree
/// before.
///
/// `at` appends the value of each function at a place in \[0, 1\]; it is asked once about a place, of which
/// each degree that is twice the one before has every other already.
pub fn interpolated(
    degrees: &[usize],
    mut at: impl FnMut(f64, &mut Vec<f64>),
    is_enough: impl Fn(usize, &Chebyshev, Option<&Chebyshev>) -> bool,
) -> Interpolants {
    let mut found =
        Interpolants { curves: Vec::new(), nodes: Nodes::of(1), values: Vec::new(), is_resolved: false };
    let mut row = Vec::new();
    for &degree in degrees {
        let before = std::mem::take(&mut found.values);
        let is_nested = before.first().is_some_and(|values| 2 * (values.len() - 1) == degree);
        found.nodes = Nodes::of(degree);
        for (j, &node) in found.nodes.places.iter().enumerate() {
            row.clear();
            if is_nested && j % 2 == 0 {
                row.extend(before.iter().map(|values| values[j / 2]));
            } else {
                at(node, &mut row);
            }
            found.values.resize_with(row.len(), || Vec::with_capacity(degree + 1));
            found.values.iter_mut().zip(&row).for_each(|(values, value)| values.push(*value));
        }
        let lower = std::mem::take(&mut found.curves);
        found.curves = found.values.iter().map(|values| found.nodes.through(values)).collect();
        found.is_resolved =
            (found.curves.iter().enumerate()).all(|(k, curve)| is_enough(k, curve, lower.get(k)));
        if found.is_resolved {
            break;
        }
    }
    found
}

/// Turning points among the values in a part up to which a function that no interpolant resolves there has a
/// corner or a jump: one with more oscillates, and smaller parts resolve it.
const TURNING_POINTS: usize = 4;
/// Share of a function's size below which an oscillation may be rounding.
const SMALL: f64 = 1e-6;

/// True where a function of this size with these values, one after the other in a part of a step, oscillates
/// too often for its interpolant.
pub fn oscillates(values: &[f64], size: f64) -> bool {
    let least = SMALL * size;
    let Some(&(mut last)) = values.first() else { return false };
    let (mut sense, mut count) = (0.0, 0);
    for &value in values {
        let change = value - last;
        if sense * change >= 0.0 && sense != 0.0 {
            last = value;
        } else if change.abs() > least {
            count += usize::from(sense != 0.0);
            (sense, last) = (change.signum(), value);
        }
    }
    count > TURNING_POINTS
}

/// A function on \[0, 1\] known by its values alone: its interpolant `Σ c_k T_k(2t - 1)`.
///
/// Its bound is |T_k''| <= k² (k² - 1)/3, which the fall of the c_k keeps small.  Source: L. N. Trefethen,
/// *Approximation Theory and Approximation Practice* (2013), chapters 2, 3 and 8.
#[derive(Clone, Debug)]
pub struct Chebyshev {
    coefficients: Vec<f64>,
    bend: f64,
}

impl Chebyshev {
    /// The interpolant of values at the nodes, two at least.
    pub fn through(values: &[f64]) -> Self {
        match values.len().max(2) - 1 {
            degree @ ..=LARGEST => Nodes::of(degree).through(values),
            degree => Nodes::new(degree).through(values),
        }
    }

    /// The least and the largest value it can have.
    pub fn range(&self) -> [f64; 2] {
        let spread = self.spread();
        [self.coefficients[0] - spread, self.coefficients[0] + spread]
    }

    /// What the last coefficients say it may be off.
    pub fn tail(&self) -> f64 {
        self.tail_of(self.coefficients.len() - 1)
    }

    /// The same of the interpolant of a lower degree, of which about the last coefficients are those here.
    pub fn tail_of(&self, degree: usize) -> f64 {
        let last = self.coefficients.iter().skip((degree + 1).saturating_sub(3));
        last.fold(0.0, |most, c| f64::max(most, c.abs()))
    }

    /// True where the tail has hardly fallen since an interpolant of half the degree, as what is not smooth
    /// leaves it; false where there is none.
    pub fn stays(&self, lower: Option<&Self>) -> bool {
        /// Share to which it falls at least where a function is smooth.
        const FALLS: f64 = 0.3;
        lower.is_some_and(|lower| self.tail() > FALLS * lower.tail())
    }

    /// How far at most its values are from the middle of their range.
    pub fn spread(&self) -> f64 {
        self.coefficients.iter().skip(1).fold(0.0, |sum, c| sum + c.abs())
    }

    /// Its integral from 0 to 1.
    pub fn integral(&self) -> f64 {
        let even = self.coefficients.iter().enumerate().step_by(2);
        even.fold(0.0, |sum, (k, c)| sum + c / (1.0 - (k * k) as f64))
    }

    /// The least magnitude it can have.
    pub fn least(&self) -> f64 {
        self.coefficients.iter().skip(1).fold(self.coefficients[0].abs(), |left, c| left - c.abs())
    }

    /// The largest magnitude it can have.
    pub fn most(&self) -> f64 {
        self.coefficients.iter().fold(0.0, |sum, c| sum + c.abs())
    }
}

impl Curve for Chebyshev {
    fn at(&self, t: f64) -> [f64; 2] {
        let x = 2.0 * t - 1.0;
        // Clenshaw's recurrence, and its derivative.
        let ([mut b, mut before], [mut slope, mut slope_before]) = ([0.0; 2], [0.0; 2]);
        for &c in self.coefficients.iter().skip(1).rev() {
            (slope, slope_before) = (2.0 * b + 2.0 * x * slope - slope_before, slope);
            (b, before) = (c + 2.0 * x * b - before, b);
        }
        [self.coefficients[0] + x * b - before, 2.0 * (b + x * slope - slope_before)]
    }

    fn about(&self, centre: f64, _radius: f64) -> IntervalBounds {
        let [value, slope] = self.at(centre);
        IntervalBounds { value, slope, bend: self.bend, rounding: ROUNDING * self.most() }
    }
}
