//! Impulses of one impact with dry friction: Routh's method.
//!
//! ```text
//! dv_n = a_nn dp_n + a_nt dp_t,    dv_t = a_nt dp_n + a_tt dp_t      along the growing normal impulse p_n
//! slides   dp_t = -sign(v_t) mu dp_n          until v_t = 0
//! sticks   dp_t = -a_nt / a_tt dp_n
//!     where that is at most mu0 dp_n, else it slides as a_nt drives it
//! ends     Poisson: p_n = (1+e) p_c, v_n(p_c) = 0      Newton: v_n = -e v_n⁻
//! ```
//!
//! Where the mechanism leaves the point one way to move, a_nn a_tt = a_nt².  Without motors and moving walls
//! v_n and v_t are then in one proportion, and both are zero at the same impulse; which of them ends first
//! in rounded numbers says nothing.  A point that sticks there is at rest, and no impulse moves it: after
//! compression ends so, Poisson's restitution adds impulses without a rebound, and Newton's has no solution.
//!
//! Both laws agree where the point slides one way all along.  Poisson's never gains energy; Newton's may,
//! where sliding ends or turns within the impact.
//!
//! Source: E. J. Routh, *Dynamics of a System of Rigid Bodies*, 7th ed. (1905), section 187 ff.; Y. Wang,
//! M. Mason, *Two-dimensional rigid-body collisions with friction*, J. Appl. Mech. 59 (1992).

use super::super::constraint::ConstraintArguments;
use super::super::contact::metric::{ContactMetric, MetricRow};
use super::super::{Mechanism, Time};
use super::{Normal, solve};
use crate::arithmetic::Real;
use nalgebra::DVector;

/// What an impact is decided by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shock<T = f64> {
    /// a_nn, a_nt, a_tt: velocities that unit impulses make \[1/kg\].
    pub response: [T; 3],
    /// v_n and v_t before it \[m/s\]; v_n is negative.
    pub velocity: [T; 2],
    /// e.
    pub restitution: T,
    /// mu and mu0.
    pub coefficients: [T; 2],
    /// True for Newton's law of impact, else Poisson's.
    pub is_newton: bool,
    /// Where impulses change v_n and v_t in one proportion only: what of the normal velocity is rounding
    /// where v_t has ended, over the velocities it is the difference of.
    pub one_way: Option<T>,
}

/// Share of a velocity that rounding leaves of one that ended.
const NO_SPEED: f64 = 1e-14;
/// The same along a wall that others hold the point along: as much as the place of the impact is off.
const HELD_SPEED: f64 = 1e-9;

impl Shock {
    /// Normal and tangential impulse \[N·s\]; `None` where nothing ends it.
    pub fn impulses(&self) -> Option<[f64; 2]> {
        let ([v_n, v_t], [_, _, a_tt]) = (self.velocity, self.response);
        let rounding = if a_tt == 0.0 { HELD_SPEED } else { NO_SPEED };
        self.impulses_beyond(rounding * (v_n.abs() + v_t.abs()))
    }
}

impl<T: Real> Shock<T> {
    /// The same where tangential velocities up to `still` \[m/s\] are rounding.
    pub fn impulses_beyond(&self, still: T) -> Option<[T; 2]> {
        let [a_nn, a_nt, a_tt] = self.response;
        let [kinetic, stiction] = self.coefficients;
        let [mut v_n, mut v_t] = self.velocity;
        let rebound = -self.restitution * v_n;
        let at_rest = self.at_rest();
        let against = |velocity: T| if velocity < T::ZERO { kinetic } else { -kinetic };
        let [mut p_n, mut p_t] = [T::ZERO; 2];
        // The normal impulse at which it ends, known to Poisson from the end of compression on.
        let mut end = None;
        for _ in 0..8 {
            let sticks = v_t.abs() <= still && (a_tt == T::ZERO || a_nt.abs() <= stiction * a_tt);
            let ratio = if v_t.abs() > still {
                against(v_t)
            } else if sticks {
                v_t = T::ZERO;
                if a_tt == T::ZERO { T::ZERO } else { -a_nt / a_tt }
            } else {
                against(a_nt)
            };
            let (n_rate, t_rate) = match at_rest {
                Some(_) if sticks => (T::ZERO, T::ZERO),
                _ => (a_nn + a_nt * ratio, a_nt + a_tt * ratio),
            };
            // To the end of sliding, of compression, or of the impact.
            let stops = (v_t * t_rate < T::ZERO).then(|| -v_t / t_rate);
            let stops = stops.filter(|share| share.value().is_finite());
            let ends = match end {
                Some(end) => end - p_n,
                None if self.is_newton => (rebound - v_n) / n_rate,
                None => -v_n / n_rate,
            };
            let ends = Some(ends).filter(|&share| share >= T::ZERO && share.value().is_finite());
            let is_stopped = stops.is_some_and(|stops| ends.is_none_or(|ends| stops <= ends));
            let mut has_ended = ends.is_some_and(|ends| stops.is_none_or(|stops| ends <= stops));
            let share = if is_stopped { stops? } else { ends? };
            (p_n, p_t) = (p_n + share, p_t + ratio * share);
            (v_n, v_t) = (v_n + n_rate * share, v_t + t_rate * share);
            if is_stopped {
                v_t = T::ZERO;
                if at_rest.is_some_and(|least| v_n.abs() <= least) {
                    v_n = T::ZERO;
                    has_ended |= end.is_none() && (!self.is_newton || rebound == T::ZERO);
                }
            }
            if has_ended {
                if end.is_some() || self.is_newton {
                    return Some([p_n, p_t]);
                }
                end = Some((T::ONE + self.restitution) * p_n);
            }
        }
        None
    }

    /// The normal velocity up to which the point rests where v_t has ended \[m/s\]; `None` where it can move
    /// two ways.
    fn at_rest(&self) -> Option<T> {
        let ([_, a_nt, a_tt], [v_n, v_t]) = (self.response, self.velocity);
        let rounding = self.one_way.filter(|_| a_tt != T::ZERO)?;
        Some(rounding * (v_n.abs() + (a_nt / a_tt * v_t).abs()))
    }
}

impl Mechanism {
    /// Rates \[rad/s, m/s\] without those along the normals of the contacts that are held, which impulses of
    /// their walls take off with the friction of those that slide, and the work of motors and of walls that
    /// move \[J\]; `None` where there are no such impulses.
    ///
    /// They may pull: see `run/contact/rest.rs`.
    pub(crate) fn without_normal_rates(
        &self,
        t: Time,
        phi: &[f64],
        omega: &[f64],
    ) -> Option<(Vec<f64>, f64)> {
        let metric = ContactMetric::at(self, t, phi, omega)?;
        let (before, z) = (metric.velocity(omega), self.elements(phi));
        let columns: Vec<DVector<f64>> = metric.rows.iter().map(|row| metric.column(&row.along)).collect();
        let mut pushes = columns.clone();
        for (friction, coefficient) in self.sliding() {
            let Normal::Contact(_) = friction.normal else { continue };
            let along = MetricRow::of(&friction.tangent, t, ConstraintArguments { phi, z: &z, omega }).along;
            pushes[self.normal_row(friction)?].axpy(-coefficient, &metric.column(&along), 1.0);
        }
        let counting = metric.counting();
        let mut impulses: Vec<f64> =
            counting.iter().map(|&r| -metric.rows[r].row.drive - columns[r].dot(&before)).collect();
        let mut matrix: Vec<f64> = counting
            .iter()
            .flat_map(|&r| counting.iter().map(|&s| columns[r].dot(&pushes[s])).collect::<Vec<_>>())
            .collect();
        solve(&mut matrix, &mut impulses);
        let (mut change, mut work) = (DVector::zeros(omega.len()), 0.0);
        for (&s, impulse) in counting.iter().zip(impulses) {
            change.axpy(impulse, &pushes[s], 1.0);
            work -= impulse * metric.rows[s].row.drive;
        }
        let change = metric.rates(&change);
        let is_finite = change.iter().all(|x| x.is_finite());
        let rates = change.iter().zip(omega).map(|(change, omega)| omega + change);
        is_finite.then(|| (rates.collect(), work))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rod of unit mass and length that meets the floor with its lower end at an angle.
    fn rod(angle: f64, velocity: [f64; 2], mu: f64, e: f64) -> Shock {
        let (sin, cos) = libm::sincos(angle);
        let (x, y) = (0.5 * cos, 0.5 * sin);
        let inertia = 1.0 / 12.0;
        // The point is at (-x, -y) from the centre: v_P = v + w (y, -x).
        let response = [1.0 + x * x / inertia, -x * y / inertia, 1.0 + y * y / inertia];
        Shock { response, velocity, restitution: e, coefficients: [mu; 2], is_newton: false, one_way: None }
    }

    /// Impulses by small steps of the normal impulse, without any case.
    fn by_steps(shock: &Shock) -> [f64; 2] {
        let [a_nn, a_nt, a_tt] = shock.response;
        let [mut v_n, mut v_t] = shock.velocity;
        let (mu, step) = (shock.coefficients[0], 1e-6);
        let [mut p_n, mut p_t] = [0.0; 2];
        let mut end = f64::INFINITY;
        while p_n < end {
            // The tangential impulse that would stop it, as far as friction reaches.
            let wanted = -(v_t + a_nt * step) / a_tt;
            let dp_t = wanted.clamp(-mu * step, mu * step);
            (p_n, p_t) = (p_n + step, p_t + dp_t);
            (v_n, v_t) = (v_n + a_nn * step + a_nt * dp_t, v_t + a_nt * step + a_tt * dp_t);
            if end.is_infinite() && v_n >= 0.0 {
                end = (1.0 + shock.restitution) * p_n;
            }
        }
        [p_n, p_t]
    }

    #[test]
    fn impulses_are_those_of_small_steps() {
        let mut covered = [0; 3];
        for angle in [0.3, 0.7, 1.2, 1.5, 2.0, 2.6] {
            for v_t in [-2.0, -0.3, 0.0, 0.3, 2.0] {
                for mu in [0.05, 0.3, 1.0] {
                    for e in [0.0, 0.5, 1.0] {
                        let shock = rod(angle, [-1.0, v_t], mu, e);
                        let found = shock.impulses().expect("an end");
                        let expected = by_steps(&shock);
                        for (found, expected) in found.iter().zip(expected) {
                            assert!((found - expected).abs() < 1e-5, "{shock:?}: {found} {expected}");
                        }
                        let [p_n, p_t] = found;
                        let [_, a_nt, a_tt] = shock.response;
                        let after = v_t + a_nt * p_n + a_tt * p_t;
                        covered[if after.abs() < 1e-12 { 0 } else { usize::from(after * v_t > 0.0) + 1 }] +=
                            1;
                        assert!(p_t.abs() <= mu * p_n * (1.0 + 1e-12));
                    }
                }
            }
        }
        println!("ends sticking {}, turned {}, slides on {}", covered[0], covered[1], covered[2]);
        assert!(covered.iter().all(|&count| count > 5), "{covered:?}");
    }
}
