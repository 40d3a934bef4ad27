//! A spring's series, in which products of one order are of neighbours in memory.
//!
//! ```text
//! q = |D|²,   s = q^(-1/2):  m q_0 s_m = Σ_{j=1..m} (j/2 - m) q_j s_{m-j},
//!     F_m = k (L0 Σ s_j D_{m-j} - D_m)
//! ```

use super::HIGHEST_ORDER;
use crate::arithmetic::Complex;
use crate::arithmetic::lanes::Lanes;
use crate::dynamics::force;
use crate::dynamics::point::Point;

/// Room for a scalar series, and for lanes that read beyond its end.
const LENGTH: usize = HIGHEST_ORDER + 8;

/// A spring and its series: D, |D|² with its powers' numbers, 1/|D|; `backwards` ones run from the end, so
/// that products are of neighbours.
#[derive(Clone, Debug)]
pub struct LoopSpring {
    /// D.
    pub span: Point,
    stiffness: f64,
    free_length: f64,
    x: SpringPowers,
    y: SpringPowers,
    square: [f64; LENGTH],
    weighted: [f64; LENGTH],
    inverse: SpringPowers,
}

impl LoopSpring {
    /// Of a spring of the mechanism, without its damper.
    pub fn new(spring: &force::CompiledSpring) -> Self {
        Self {
            span: spring.span.clone(),
            stiffness: spring.stiffness,
            free_length: spring.free_length,
            x: SpringPowers::ZERO,
            y: SpringPowers::ZERO,
            square: [0.0; LENGTH],
            weighted: [0.0; LENGTH],
            inverse: SpringPowers::ZERO,
        }
    }
}

#[derive(Clone, Debug)]
struct SpringPowers {
    forwards: [f64; LENGTH],
    backwards: [f64; LENGTH],
}

impl SpringPowers {
    const ZERO: Self = Self { forwards: [0.0; LENGTH], backwards: [0.0; LENGTH] };

    #[inline(always)]
    fn push(&mut self, m: usize, value: f64) {
        self.forwards[m] = value;
        self.backwards[HIGHEST_ORDER - m] = value;
    }
}

/// Σ_{j=0..m} a_j b_{m-j}.
#[inline(always)]
fn convolve<L: Lanes>(a: &[f64; LENGTH], b: &SpringPowers, m: usize) -> f64 {
    let mut sum = L::ZERO;
    let mut j = 0;
    while j <= m {
        let at = HIGHEST_ORDER - m + j;
        let (a, b) = ([a[j], a[j + 1], a[j + 2], a[j + 3]], &b.backwards);
        sum = L::of(a).mul_add(L::of([b[at], b[at + 1], b[at + 2], b[at + 3]]), sum);
        j += 4;
    }
    let [a, b, c, d] = sum.array();
    (a + c) + (b + d)
}

/// Power m of a spring's force on its first end, from that of its span.
#[inline(always)]
pub fn pull<L: Lanes>(spring: &mut LoopSpring, m: usize, d: Complex<f64>) -> Complex<f64> {
    if spring.free_length == 0.0 {
        return d.times(-spring.stiffness);
    }
    let LoopSpring { x, y, square, weighted, inverse, .. } = spring;
    x.push(m, d.re);
    y.push(m, d.im);
    square[m] = convolve::<L>(&x.forwards, x, m) + convolve::<L>(&y.forwards, y, m);
    weighted[m] = m as f64 * square[m];
    if m == 0 {
        inverse.push(0, 1.0 / square[0].sqrt());
    } else {
        // s = q^(-1/2):  m q_0 s_m = Σ_{j=1..m} (j/2 - m) q_j s_{m-j}.
        inverse.push(m, 0.0);
        let plain = convolve::<L>(square, inverse, m);
        let sum = 0.5 * convolve::<L>(weighted, inverse, m) - m as f64 * plain;
        inverse.push(m, sum / (m as f64 * square[0]));
    }
    let along = Complex::new(convolve::<L>(&inverse.forwards, x, m), convolve::<L>(&inverse.forwards, y, m));
    (along.times(spring.free_length) - d).times(spring.stiffness)
}
