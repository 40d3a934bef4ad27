//! The series of a spring with its damper.
//!
//! ```text
//! D = P_a - P_b,  q = |D|²,  s = q^(-1/2):   m q_0 s_m = Σ_{j=1..m} (-j/2 - (m-j)) q_j s_{m-j}
//! F on a = -k (D - L0 s D) - c (D·D'/q) D
//! ```

use super::coefficient::SeriesNumber;
use super::factors::{CauchyFactor, Scale, VectorFactor};
use super::polynomial::{copy, copy_vectors, product, zeros};
use crate::arithmetic::{Complex, Scalar};
use crate::dynamics::force::CompiledSpring;

/// Series of one spring, powers 0 to P.
#[derive(Clone, Debug)]
pub struct SpringSeries<T: SeriesNumber> {
    /// D.
    span: Vec<Complex<T>>,
    /// q, where there is a free length or a damper.
    square: Vec<T>,
    /// s, where the free length asks for it.
    inverse_length: Vec<T>,
    /// 1/q, D·D' and their product, where there is a damper.
    inverse_square: Vec<T>,
    closing: Vec<T>,
    strain_rate: Vec<T>,
    /// The same as factors, where series are multiplied so.
    factors: Option<Box<SpringFactors<T>>>,
}

#[derive(Clone, Debug)]
struct SpringFactors<T: SeriesNumber> {
    span: VectorFactor<T>,
    square: T::Factor,
    /// j q_j.
    weighted_square: T::Factor,
    inverse_length: T::Factor,
    inverse_square: T::Factor,
    closing: T::Factor,
    strain_rate: T::Factor,
}

impl<T: SeriesNumber> SpringFactors<T> {
    fn new(order: usize) -> Self {
        let factor = || T::Factor::new(order);
        Self {
            span: VectorFactor::new(order),
            square: factor(),
            weighted_square: factor(),
            inverse_length: factor(),
            inverse_square: factor(),
            closing: factor(),
            strain_rate: factor(),
        }
    }

    fn numbers(&mut self) -> [&mut T::Factor; 6] {
        let Self { square, weighted_square, inverse_length, inverse_square, closing, strain_rate, .. } = self;
        [square, weighted_square, inverse_length, inverse_square, closing, strain_rate]
    }

    fn restart(&mut self, scale: &Scale<T>) {
        self.span.restart(scale);
        self.numbers().into_iter().for_each(|factor| factor.restart(scale));
    }

    fn are_sound(&self) -> bool {
        let Self { span, square, weighted_square, inverse_length, inverse_square, closing, strain_rate } =
            self;
        let numbers = [square, weighted_square, inverse_length, inverse_square, closing, strain_rate];
        span.is_sound() && numbers.into_iter().all(CauchyFactor::is_sound)
    }
}

impl<T: SeriesNumber> SpringSeries<T> {
    /// Room for the series of a spring up to power `order`.
    pub fn new(spring: &CompiledSpring<T::Constant>, order: usize) -> Self {
        let room = |is_wanted: bool| zeros(if is_wanted { order + 1 } else { 0 });
        let (is_long, is_damped) =
            (spring.free_length != T::Constant::ZERO, spring.damping != T::Constant::ZERO);
        Self {
            span: vec![Complex::ZERO; order + 1],
            square: room(spring.needs_length()),
            inverse_length: room(is_long),
            inverse_square: room(is_damped),
            closing: room(is_damped),
            strain_rate: room(is_damped),
            factors: (T::HAS_CONSTANTS && spring.needs_length()).then(|| Box::new(SpringFactors::new(order))),
        }
    }

    /// False where powers grow by more than products are made for.
    pub fn is_sound(&self) -> bool {
        self.factors.as_ref().is_none_or(|factors| factors.are_sound())
    }

    /// The first powers from another series.
    pub fn take<U: SeriesNumber>(&mut self, other: &SpringSeries<U>) {
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
        spring: &CompiledSpring<T::Constant>,
        m: usize,
        z: &[Complex<T>],
        n: usize,
        scale: &Scale<T>,
    ) -> Complex<T> {
        self.span[m] = match m {
            0 => spring.span.position(z),
            _ => spring.span.turned(&z[m * n..(m + 1) * n]),
        };
        let mut force = -self.span[m].times(T::constant(spring.stiffness));
        if !spring.needs_length() {
            return force;
        }
        if T::HAS_CONSTANTS {
            return force + self.factored_force(spring, m, z, n, scale);
        }
        let span = &self.span[..=m];
        self.square[m] = product(span, span, |a, b| a.dot(b));
        let square = &self.square[..=m];
        if spring.free_length != T::Constant::ZERO {
            self.inverse_length[m] = if m == 0 {
                T::ONE / square[0].sqrt()
            } else {
                let known = &self.inverse_length[..m];
                let falling = known.iter().rev().zip(&square[1..]).enumerate();
                let sum = falling
                    .fold(T::ZERO, |sum, (j, (&s, &q))| sum + (q * s).scale(0.5 * (j + 1) as f64 - m as f64));
                sum / square[0].scale(m as f64)
            };
            let stretched = product(span, &self.inverse_length[..=m], |a, b| a.times(b));
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
            let ahead = spring.span.turned(&z[(m + 1) * n..(m + 2) * n]);
            let mut closing = span[0].dot(ahead).scale((m + 1) as f64);
            for l in 1..=m {
                closing += span[l].dot(span[m - l + 1]).scale((m - l + 1) as f64);
            }
            self.closing[m] = closing;
            self.strain_rate[m] = product(&self.closing[..=m], &self.inverse_square[..=m], |a, b| a * b);
            let damped = product(span, &self.strain_rate[..=m], |a, b| a.times(b));
            force += damped.times(-T::constant(spring.damping));
        }
        force
    }

    /// What free length and damper add to the force at power m, as products of factors.
    #[inline(always)]
    fn factored_force(
        &mut self,
        spring: &CompiledSpring<T::Constant>,
        m: usize,
        z: &[Complex<T>],
        n: usize,
        scale: &Scale<T>,
    ) -> Complex<T> {
        let Some(factors) = &mut self.factors else { return Complex::ZERO };
        if m == 0 {
            factors.restart(scale);
        }
        let (mut force, before) = (Complex::ZERO, m.saturating_sub(1));
        factors.span.push(scale, self.span[m]);
        let square = factors.span.dot(&factors.span, scale, m, 0..=m);
        self.square[m] = square;
        factors.square.push(scale, square);
        if spring.free_length != T::Constant::ZERO {
            factors.weighted_square.push(scale, square.scale(m as f64));
            let power = if m == 0 {
                T::ONE / square.sqrt()
            } else {
                let known = &factors.inverse_length;
                let weighted = known.product(&factors.weighted_square, scale, m, 0..=before);
                let plain = known.product(&factors.square, scale, m, 0..=before);
                (weighted.scale(0.5) - plain.scale(m as f64)) / self.square[0].scale(m as f64)
            };
            factors.inverse_length.push(scale, power);
            let stretched = factors.span.times(&factors.inverse_length, scale, m, 0..=m);
            force += stretched.times(T::constant(spring.stiffness).by(spring.free_length));
        }
        if spring.damping != T::Constant::ZERO {
            let inverse = if m == 0 {
                T::ONE / square
            } else {
                -factors.inverse_square.product(&factors.square, scale, m, 0..=before) / self.square[0]
            };
            factors.inverse_square.push(scale, inverse);
            let ahead = spring.span.turned(&z[(m + 1) * n..(m + 2) * n]);
            let mut closing = self.span[0].dot(ahead).scale((m + 1) as f64);
            if m > 0 {
                // Σ_{l=1..m} (m-l+1) D_l·D_{m-l+1} has every product twice, with factors that add up to m +
                // 1.
                let twice = factors.span.dot(&factors.span, scale, m + 1, 1..=m);
                closing += twice.scale(0.5 * (m + 1) as f64);
            }
            factors.closing.push(scale, closing);
            let strain_rate = factors.closing.product(&factors.inverse_square, scale, m, 0..=m);
            factors.strain_rate.push(scale, strain_rate);
            let damped = factors.span.times(&factors.strain_rate, scale, m, 0..=m);
            force += damped.times(-T::constant(spring.damping));
        }
        force
    }

    /// Power of the damper at power m \[W/s^m\].
    #[inline(always)]
    pub fn loss(&self, spring: &CompiledSpring<T::Constant>, m: usize, scale: &Scale<T>) -> T {
        let power = match &self.factors {
            Some(factors) => factors.strain_rate.product(&factors.closing, scale, m, 0..=m),
            None => product(&self.strain_rate[..=m], &self.closing[..=m], |a, b| a * b),
        };
        -power.by(spring.damping)
    }
}
