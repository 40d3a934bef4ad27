//! `dp5`: Dormand–Prince 5(4), our own stepper.
//!
//! Order 5, seven stages of which the last is the first of the next step; adaptive, explicit; keeps nothing
//! by itself.  Choose it at loose tolerances (1e-3…1e-6) where projection after every step or located impacts
//! are needed; otherwise `dopri5` gives the same.
//!
//! Source: J. R. Dormand, P. J. Prince, *A family of embedded Runge-Kutta formulae*, J. Comp. Appl. Math. 6
//! (1980), table 2; the interpolation is L. F. Shampine's, as printed in Hairer, Nørsett, Wanner I, section
//! II.6.

use super::explicit::{EmbeddedPair, Explicit, NESTED, Row};

/// The coefficients of Dormand–Prince 5(4).
#[derive(Clone, Copy, Debug)]
pub struct DormandPrince5;

/// The method.
pub type Dp5 = Explicit<DormandPrince5>;

const A: [Row; 5] = [
    &[(0, 1.0 / 5.0)],
    &[(0, 3.0 / 40.0), (1, 9.0 / 40.0)],
    &[(0, 44.0 / 45.0), (1, -56.0 / 15.0), (2, 32.0 / 9.0)],
    &[(0, 19372.0 / 6561.0), (1, -25360.0 / 2187.0), (2, 64448.0 / 6561.0), (3, -212.0 / 729.0)],
    &[
        (0, 9017.0 / 3168.0),
        (1, -355.0 / 33.0),
        (2, 46732.0 / 5247.0),
        (3, 49.0 / 176.0),
        (4, -5103.0 / 18656.0),
    ],
];

const B: Row =
    &[(0, 35.0 / 384.0), (2, 500.0 / 1113.0), (3, 125.0 / 192.0), (4, -2187.0 / 6784.0), (5, 11.0 / 84.0)];

const C: [f64; 6] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0];

/// Fifth order less fourth.
const E: Row = &[
    (0, 71.0 / 57600.0),
    (2, -71.0 / 16695.0),
    (3, 71.0 / 1920.0),
    (4, -17253.0 / 339_200.0),
    (5, 22.0 / 525.0),
    (6, -1.0 / 40.0),
];

const DENSE: Row = &[
    (0, -12_715_105_075.0 / 11_282_082_432.0),
    (2, 87_487_479_700.0 / 32_700_410_799.0),
    (3, -10_690_763_975.0 / 1_880_347_072.0),
    (4, 701_980_252_875.0 / 199_316_789_632.0),
    (5, -1_453_857_185.0 / 822_651_844.0),
    (6, 69_997_945.0 / 29_380_423.0),
];

impl EmbeddedPair for DormandPrince5 {
    const NAME: &'static str = "dp5";
    const ORDER: u32 = 5;
    const STAGES: usize = 6;
    const EXTRA: usize = 0;
    const DEGREE: usize = 4;
    const A: &'static [Row] = &A;
    const C: &'static [f64] = &C;
    const B: Row = B;

    fn error(h: f64, k: &[f64], scale: &[f64]) -> f64 {
        let n = scale.len();
        let sum: f64 = (0..n)
            .map(|i| (h * E.iter().fold(0.0, |sum, &(j, e)| sum + e * k[j * n + i]) / scale[i]).powi(2))
            .sum();
        sum / n as f64
    }

    fn extra_stages(_rate: &mut dyn FnMut(usize, f64, Row)) {}

    fn interpolate(h: f64, change: f64, k: &dyn Fn(usize) -> f64) -> [f64; NESTED] {
        let start = h * k(0) - change;
        let end = change - h * k(6) - start;
        let bend = h * DENSE.iter().fold(0.0, |sum, &(j, d)| sum + d * k(j));
        [change, start, end, bend, 0.0, 0.0, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stepping::explicit::checks;

    #[test]
    fn rows_sum_to_their_nodes() {
        checks::rows_sum_to_nodes::<DormandPrince5>(1e-15);
    }

    #[test]
    fn quadrature_conditions_hold_to_order_five() {
        checks::quadrature::<DormandPrince5>(5, 1e-14);
    }

    #[test]
    fn the_interpolation_is_exact_for_polynomials_of_its_order() {
        checks::interpolation::<DormandPrince5>(4, 1e-13);
    }
}
