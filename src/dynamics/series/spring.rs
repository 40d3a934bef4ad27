//! The series of a spring with its damper.
//!
//! ```text
//! D = P_a - P_b,  q = |D|²,  s = q^(-1/2):   m q_0 s_m = Σ_{j=1..m} (-j/2 - (m-j)) q_j s_{m-j}
//! F on a = -k (D - L0 s D) - c (D·D'/q) D
//! ```

use super::coefficient::SeriesNumber;
use super::polynomial::{copy, copy_vectors, product_of_numbers, product_of_vectors, scaled_vectors, zeros};
use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::force::Spring;

/// Series of one spring, powers 0 to P.
#[derive(Clone, Debug)]
pub struct SpringSeries<T> {
    /// D.
    span: Vec<Complex<T>>,
    /// q, where there is a free length or a damper.
    square: Vec<T>,
    /// j q_j, where the free length asks for it and numbers are long.
    weighted_square: Vec<T>,
    /// s, where the free length asks for it.
    inverse_length: Vec<T>,
    /// 1/q, D·D' and their product, where there is a damper.
    inverse_square: Vec<T>,
    closing: Vec<T>,
    strain_rate: Vec<T>,
}

impl<T: SeriesNumber> SpringSeries<T> {
    /// Room for the series of a spring up to power `order`.
    pub fn new(spring: &Spring<T::Constant>, order: usize) -> Self {
        let room = |is_wanted: bool| zeros(if is_wanted { order + 1 } else { 0 });
        let (is_long, is_damped) =
            (spring.free_length != T::Constant::ZERO, spring.damping != T::Constant::ZERO);
        Self {
            span: vec![Complex::ZERO; order + 1],
            square: room(spring.needs_length()),
            weighted_square: room(is_long && T::IS_LONG),
            inverse_length: room(is_long),
            inverse_square: room(is_damped),
            closing: room(is_damped),
            strain_rate: room(is_damped),
        }
    }

    /// The first powers from another series.
    pub fn take<U: Real>(&mut self, other: &SpringSeries<U>) {
        copy_vectors(&mut self.span, &other.span);
        copy(&mut self.square, &other.square);
        copy(&mut self.inverse_length, &other.inverse_length);
        copy(&mut self.inverse_square, &other.inverse_square);
        copy(&mut self.closing, &other.closing);
        copy(&mut self.strain_rate, &other.strain_rate);
    }

    /// Force on the spring's first end at power m, from powers up to m+1 of z.
    #[inline(always)]
    pub fn force(
        &mut self,
        spring: &Spring<T::Constant>,
        m: usize,
        z: &[Complex<T>],
        n: usize,
    ) -> Complex<T> {
        let at = |m: usize| spring.span.turned(&z[m * n..(m + 1) * n]);
        self.span[m] = if m == 0 { spring.span.position(z) } else { at(m) };
        let span = &self.span[..=m];
        let mut force = -span[m].times(T::constant(spring.stiffness));
        if !spring.needs_length() {
            return force;
        }
        self.square[m] = product_of_vectors(span, span);
        if !self.weighted_square.is_empty() {
            self.weighted_square[m] = self.square[m].scale(m as f64);
        }
        let square = &self.square[..=m];
        if spring.free_length != T::Constant::ZERO {
            self.inverse_length[m] = if m == 0 {
                T::ONE / square[0].sqrt()
            } else {
                let known = &self.inverse_length[..m];
                let falling = known.iter().rev().zip(&square[1..]).enumerate();
                let sum = if T::IS_LONG {
                    let weighted = product_of_numbers(known, &self.weighted_square[1..=m]);
                    weighted.scale(0.5) - product_of_numbers(known, &square[1..]).scale(m as f64)
                } else {
                    falling.fold(T::ZERO, |sum, (j, (&s, &q))| {
                        sum + (q * s).scale(0.5 * (j + 1) as f64 - m as f64)
                    })
                };
                sum / square[0].scale(m as f64)
            };
            let stretched = scaled_vectors(span, &self.inverse_length[..=m]);
            // In double-double the product must not be rounded: a constant error acts in every step.
            force += stretched.times(T::constant(spring.stiffness).by(spring.free_length));
        }
        if spring.damping != T::Constant::ZERO {
            self.inverse_square[m] = if m == 0 {
                T::ONE / square[0]
            } else {
                let known = &self.inverse_square[..m];
                -known.iter().rev().zip(&square[1..]).fold(T::ZERO, |sum, (&i, &q)| sum + q * i) / square[0]
            };
            // D' at power m is (m+1) D_{m+1}.
            let ahead = at(m + 1);
            let mut closing = span[0].dot(ahead).scale((m + 1) as f64);
            if T::IS_LONG {
                // Σ_{l=1..m} (m-l+1) D_l·D_{m-l+1} has every product twice, with factors that add up to m + 1.
                closing += product_of_vectors(&span[1..], &span[1..]).scale(0.5 * (m + 1) as f64);
            } else {
                for l in 1..=m {
                    closing += span[l].dot(span[m - l + 1]).scale((m - l + 1) as f64);
                }
            }
            self.closing[m] = closing;
            self.strain_rate[m] = product_of_numbers(&self.closing[..=m], &self.inverse_square[..=m]);
            force += scaled_vectors(span, &self.strain_rate[..=m]).times(-T::constant(spring.damping));
        }
        force
    }

    /// Power of the damper at power m \[W/s^m\].
    #[inline(always)]
    pub fn loss(&self, spring: &Spring<T::Constant>, m: usize) -> T {
        -product_of_numbers(&self.strain_rate[..=m], &self.closing[..=m]).by(spring.damping)
    }
}
