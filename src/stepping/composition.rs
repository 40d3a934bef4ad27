//! Symmetric compositions: steps of a time-symmetric method of order 2, forwards and backwards, that together
//! have order 4, 6 or 8.
//!
//! ```text
//! Psi_h = Phi_{g_s h} ∘ ... ∘ Phi_{g_2 h} ∘ Phi_{g_1 h},    g_{s+1-i} = g_i,    Σ g_i = 1
//! order 4: Σ g_i³ = 0;   orders 6 and 8 ask for 2 and 4 conditions more
//! ```
//!
//! What is symplectic and time-symmetric stays so.  Source of the idea: H. Yoshida, *Construction of higher
//! order symplectic integrators*, Phys. Lett. A 150 (1990).  Coefficients: M. Suzuki, *Fractal decomposition
//! of exponential operators*, Phys. Lett. A 146 (1990), his fivefold rule; W. Kahan, R.-C. Li, *Composition
//! constants for raising the orders of unconventional schemes for ordinary differential equations*, Math.
//! Comp. 66 (1997), `s9odr6a` and `s17odr8a`.  Their 26 digits fulfil the conditions of the test below to
//! 3e-26; here they are as doubles.

use crate::arithmetic::DoubleDouble;

/// Which composition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Composition {
    /// The method itself, order 2.
    Single,
    /// Suzuki's five substeps, order 4.
    Suzuki5,
    /// Kahan and Li's nine substeps, order 6.
    KahanLi9,
    /// Kahan and Li's seventeen substeps, order 8.
    KahanLi17,
}

/// 1/(4 - 4^(1/3)), twice.
const SUZUKI_5: [f64; 2] = [0.414_490_771_794_375_74, 0.414_490_771_794_375_74];

const KAHAN_LI_9: [f64; 4] =
    [0.392_161_444_007_314_1, 0.332_599_136_789_359_44, -0.706_246_172_557_639_3, 0.082_213_596_293_550_8];

const KAHAN_LI_17: [f64; 8] = [
    0.130_202_483_088_890_08,
    0.561_162_981_775_108_4,
    -0.389_474_962_644_847_29,
    0.158_841_906_555_155_6,
    -0.395_903_894_133_237_57,
    0.184_539_640_978_315_7,
    0.258_374_387_686_322_04,
    0.295_011_723_609_310_3,
];

impl Composition {
    /// All of them, in rising order.
    pub const ALL: [Self; 4] = [Self::Single, Self::Suzuki5, Self::KahanLi9, Self::KahanLi17];

    /// Order of the composed method.
    pub fn order(self) -> u32 {
        match self {
            Self::Single => 2,
            Self::Suzuki5 => 4,
            Self::KahanLi9 => 6,
            Self::KahanLi17 => 8,
        }
    }

    /// Number of substeps.
    pub fn stages(self) -> usize {
        2 * self.half().len() + 1
    }

    /// The coefficients before the middle one, which is 1 less the sum of all others; those behind it are
    /// their mirror image.
    fn half(self) -> &'static [f64] {
        match self {
            Self::Single => &[],
            Self::Suzuki5 => &SUZUKI_5,
            Self::KahanLi9 => &KAHAN_LI_9,
            Self::KahanLi17 => &KAHAN_LI_17,
        }
    }

    /// The substeps of a step `step` \[s\].
    ///
    /// Rounded to half units in the last place of `step`, so that they add up to it exactly: if they did not,
    /// a driven scene would be pushed by the difference in every step, always in the same direction.
    pub fn substeps(self, step: f64) -> Vec<f64> {
        let grain = 0.5 * (step.abs().next_up() - step.abs());
        let mut substeps: Vec<f64> = self.half().iter().map(|g| (g * step / grain).round() * grain).collect();
        let middle = substeps.iter().fold(DoubleDouble::from(step), |rest, &substep| rest + -2.0 * substep);
        let back: Vec<f64> = substeps.iter().rev().copied().collect();
        substeps.push(middle.hi);
        substeps.extend(back);
        substeps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Words over the generators Y1, Y3, Y5, Y7, with their coefficients.
    type Series = BTreeMap<Vec<usize>, f64>;

    fn words(grade: usize) -> Vec<Vec<usize>> {
        let mut all = vec![vec![]];
        let mut next = 0;
        while next < all.len() {
            for generator in [1, 3, 5, 7] {
                if all[next].iter().sum::<usize>() + generator <= grade {
                    let mut word = all[next].clone();
                    word.push(generator);
                    all.push(word);
                }
            }
            next += 1;
        }
        all
    }

    fn factorial(n: usize) -> f64 {
        (1..=n).map(|k| k as f64).product()
    }

    /// A symmetric method of order 2 is the flow of h Y1 + h³ Y3 + h⁵ Y5 + ... with generators that do not
    /// commute.  Returns by how much the composition of these exponentials misses exp(h Y1), grade by grade.
    fn defects(composition: Composition, highest: usize) -> Vec<f64> {
        let words = words(highest);
        let mut product: Series =
            words.iter().map(|word| (word.clone(), f64::from(u8::from(word.is_empty())))).collect();
        for g in composition.substeps(1.0) {
            let flow = |word: &[usize]| g.powi(word.iter().sum::<usize>() as i32) / factorial(word.len());
            product = words
                .iter()
                .map(|w| (w.clone(), (0..=w.len()).map(|cut| product[&w[..cut]] * flow(&w[cut..])).sum()))
                .collect();
        }
        let mut worst = vec![0.0f64; highest + 1];
        for (word, found) in product {
            let exact =
                if word.iter().all(|&generator| generator == 1) { 1.0 / factorial(word.len()) } else { 0.0 };
            let grade: usize = word.iter().sum();
            worst[grade] = worst[grade].max((found - exact).abs());
        }
        worst
    }

    #[test]
    fn order_conditions_hold_up_to_the_order_and_fail_beyond_it() {
        for composition in Composition::ALL {
            let order = composition.order() as usize;
            let defects = defects(composition, order + 1);
            for (grade, defect) in defects.iter().enumerate() {
                assert_eq!(grade <= order, *defect < 1e-15, "{composition:?}, grade {grade}: {defect:e}");
            }
        }
    }

    #[test]
    fn substeps_mirror_and_add_up_to_the_step_exactly() {
        for composition in Composition::ALL {
            for step in [1.0, 1.0 / 256.0, 0.01, -0.003_7, 0.1, 1.0 / 3.0] {
                let substeps = composition.substeps(step);
                assert_eq!(substeps.len(), composition.stages());
                assert!(substeps.iter().eq(substeps.iter().rev()));
                let sum = substeps.iter().fold(DoubleDouble::default(), |sum, &substep| sum + substep);
                assert_eq!((sum.hi, sum.lo), (step, 0.0), "{composition:?} of {step}");
                let first = composition.half().first().copied().unwrap_or(1.0);
                assert!((substeps[0] / step - first).abs() < 2e-16);
            }
        }
    }
}
