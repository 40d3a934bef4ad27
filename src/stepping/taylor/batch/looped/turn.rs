//! The angle between two vectors in every lane.

use crate::arithmetic::lanes::wide::EightLanes;

/// The largest turn of a step that is told from one by a whole turn more or less \[rad\].
pub const MOST: f64 = 5.0;
/// Terms of the arc tangent's series: enough for an eighth of a turn of half a turn, to rounding.
const TERMS: usize = 20;

/// The angle from one vector to another in (-π, π) \[rad\], within a few units in the last place, and more
/// where they are opposite; by the arc tangent of an eighth of it.
#[inline(always)]
pub fn between<W: EightLanes>(from: [W; 2], to: [W; 2]) -> W {
    let cross = from[1].neg_mul_add(to[0], from[0].mul(to[1]));
    let dot = from[0].mul_add(to[0], from[1].mul(to[1]));
    let half = cross.div(cross.mul_add(cross, dot.mul(dot)).sqrt().add(dot));
    let quarter = half.div(W::ONE.add(half.mul_add(half, W::ONE).sqrt()));
    let eighth = quarter.div(W::ONE.add(quarter.mul_add(quarter, W::ONE).sqrt()));
    let square = eighth.mul(eighth);
    let mut sum = W::ZERO;
    let mut k = TERMS;
    while k > 0 {
        k -= 1;
        let term = 1.0 / (2 * k + 1) as f64;
        sum = sum.mul_add(square, W::splat(if k.is_multiple_of(2) { term } else { -term }));
    }
    sum.mul(eighth).mul(W::splat(8.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::lanes::Portable;
    use crate::arithmetic::lanes::wide::Slots;

    #[test]
    fn turns_are_those_of_the_library() {
        for k in 0..400 {
            let angle = 3.1 * (k as f64 / 200.0 - 1.0);
            let vector = |angle: f64, size: f64| {
                [size * libm::cos(angle), size * libm::sin(angle)].map(|x| <[Portable; 2]>::of(&[x; 8]))
            };
            let found = between(vector(0.3, 1.0), vector(0.3 + angle, 1.1)).array()[k % 8];
            let bound = 1e-15 + 3e-16 / (std::f64::consts::PI - angle.abs());
            assert!((found - angle).abs() < bound, "{angle}: {found}");
        }
    }
}
