//! The series of a law of time.

use crate::arithmetic::{Over, Real, Scalar};
use crate::dynamics::Time;
use crate::dynamics::law::{Law, Sine};
use crate::scene::Profile;

/// So many powers 0, 1, … of a law about time `t` \[u/s^m\].
pub fn powers(law: &Law, t: Time, count: usize) -> Vec<f64> {
    let mut rate = vec![0.0; count.max(2)];
    add(law, 1.0, t, &mut rate, 0, 1);
    let rest = rate.iter().zip(1..count).map(|(rate, m)| rate / m as f64);
    std::iter::once(law.value::<f64>(t)).chain(rest).collect()
}

/// Adds `sign` times the powers 0, 1, … of a law's rate about time `t` to a series of stride `stride` from
/// `first`.
pub fn add<T: Real>(law: &Law, sign: f64, t: Time, series: &mut [T], first: usize, stride: usize) {
    let unit = |sine: &Sine| T::split((t.scale(sine.frequency) + sine.phase).reduced().0).0.sin_cos();
    let profile = |profile: &Profile, order: usize| profile.series::<T>(t, order);
    add_from(law, sign, law.at::<T>(t).rate, (unit, profile), (series, first, stride));
}

/// The same from the rate at that time and from functions that know it: sine and cosine of a sine's argument,
/// and the series of a profile up to an order.
#[inline(always)]
pub fn add_from<C: Copy, T: Real + Over<C>>(
    law: &Law<C>,
    sign: f64,
    rate: T,
    (unit, profile_powers): (impl Fn(&Sine<C>) -> (T, T), impl Fn(&Profile<C>, usize) -> Vec<T>),
    (series, first, stride): (&mut [T], usize, usize),
) {
    series[first] += rate.scale(sign);
    if let Some(profile) = &law.profile {
        // Power m of the rate is m + 1 times power m + 1 of the law; power 0 is there already.
        let order = (series.len() - first).div_ceil(stride);
        let powers = profile_powers(profile, order);
        for (m, power) in series[first..].iter_mut().step_by(stride).enumerate().skip(1) {
            *power += powers[m + 1].scale(sign * (m + 1) as f64);
        }
    }
    series[first + stride] += T::constant(law.acceleration).scale(sign);
    for sine in &law.sines {
        let (sin, cos) = unit(sine);
        // The m-th derivative of A f cos is A f^(m+1) cos, -sin, -cos, sin; power 0 is in the law's rate
        // already.
        let turns = [cos, -sin, -cos, sin];
        let mut factor = T::constant(sine.amplitude).by(sine.frequency).scale(sign);
        for (m, power) in series[first..].iter_mut().step_by(stride).enumerate().skip(1) {
            factor = factor.by(sine.frequency) / T::of(m as f64);
            *power += turns[m % 4] * factor;
        }
    }
}
