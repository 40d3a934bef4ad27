//! Points that stay on their walls: which of them do, and the mechanism that keeps them there.
//!
//! ```text
//! of all points that touch and do not move along their normals:
//! a_c >= 0,    f_c = -lambda_c >= 0,    a_c f_c = 0          a = a0 - S lambda,  S = G M⁻¹ Gᵀ,  rows of the motors always in force
//! ```
//!
//! A wall has no friction, so that a contact that lasts is a row like any other as long as it presses, and does no work.
//! Source: F. Pfeiffer, C. Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), chapter 5; the set is found by adding the point that is
//! pressed hardest and dropping those that would be pulled (C. Lawson, R. Hanson, *Solving Least Squares Problems* (1974), chapter 23).

pub mod scale;

use super::kernel::{Kernel, dot};
use super::{Mechanism, Time};
use nalgebra::{DMatrix, DVector};

/// Height of a rebound over the length of the contact below which a pressed point stays: ten times the least gap the search for impacts tells from
/// touching.
pub const REST_HEIGHT: f64 = 1e-11;
/// Contact force over the force of the contact below which a point is not pressed; rounding makes forces of this size.
const LEAST_FORCE: f64 = 4e-12;
/// |G| over the levers of the point below which it stands at a dead centre: there its wall has no hold on it, and a row would be singular.
const DEAD_CENTRE: f64 = 1e-5;

impl Mechanism {
    /// The mechanism with these of its contacts kept by a row each, after all other rows.
    ///
    /// Nothing is renumbered: the event function of a contact that is held is its force instead of its gap.
    pub fn holding(&self, contacts: &[usize]) -> Self {
        let mut mechanism = self.clone();
        mechanism.rows.truncate(self.standing_rows());
        mechanism.rows.extend(contacts.iter().map(|&contact| self.contacts[contact].row.clone()));
        mechanism.held = contacts.to_vec();
        mechanism.choose_form();
        mechanism
    }

    /// Rows that are in force whatever touches.
    pub fn standing_rows(&self) -> usize {
        self.rows.len() - self.held.len()
    }

    /// Which of the contacts `touching` stay, or `None` where the motors leave no freedom to keep a point out of its wall.
    ///
    /// Angles \[rad\] and rates \[rad/s\] of all bodies.  A point stays where it would rebound to less than [`REST_HEIGHT`] and be pressed.
    pub fn staying(&self, touching: &[usize], t: Time, phi: &[f64], omega: &[f64]) -> Option<Vec<usize>> {
        let all = self.holding(touching);
        let (n, size, motors) = (self.coordinates(), all.rows.len(), self.standing_rows());
        let mut kernel = Kernel::<f64>::dense(&all);
        kernel.accelerate_free::<0>(&all, t, phi, omega);
        kernel.linearise::<0>(&all, t, phi, omega);
        fn part(rows: &[f64], r: usize, n: usize) -> &[f64] {
            &rows[r * n..(r + 1) * n]
        }
        let schur = DMatrix::from_fn(size, size, |r, s| dot(part(&kernel.jacobian, r, n), part(&kernel.lifted, s, n)));
        let free = DVector::from_fn(size, |r, _| dot(part(&kernel.jacobian, r, n), &kernel.load) + kernel.rows[r].convective);
        let contact = |r: usize| &self.contacts[touching[r - motors]];
        let least = |r: usize| LEAST_FORCE * contact(r).force;
        let mut set: Vec<usize> = (0..motors).collect();
        // Every round adds or drops one point; more rounds than this would go in a circle.
        for _ in 0..4 * size + 4 {
            let multiplier = solve(&schur, &set, &free)?;
            let pulled = (set.iter().copied().filter(|&r| r >= motors && -multiplier[r] < least(r)))
                .max_by(|&a, &b| multiplier[a].total_cmp(&multiplier[b]));
            if let Some(pulled) = pulled {
                set.retain(|&r| r != pulled);
                continue;
            }
            let acceleration = &free - &schur * &multiplier;
            let mut hardest: Option<(usize, f64)> = None;
            for r in (motors..size).filter(|r| !set.contains(r)) {
                let terms = &contact(r).point.terms;
                let levers: f64 = terms.iter().map(|term| term.1.norm_squared()).sum();
                let jacobian = part(&kernel.jacobian, r, n);
                let inward = -acceleration[r];
                let speed = kernel.row_rate(r, omega);
                let dead = dot(jacobian, jacobian) < DEAD_CENTRE * DEAD_CENTRE * levers;
                if dead || inward <= 0.0 || speed * speed > 2.0 * REST_HEIGHT * contact(r).length * inward {
                    continue;
                }
                // What the rows in force leave of the point's freedom to give way.
                let freedom = schur[(r, r)] - schur.column(r).dot(&solve(&schur, &set, &schur.column(r).into_owned())?);
                if freedom > 1e-12 * schur[(r, r)] {
                    let force = inward / freedom;
                    if force > least(r) && hardest.is_none_or(|(_, most)| force > most) {
                        hardest = Some((r, force));
                    }
                } else if inward > 1e-9 * (free[r].abs() + (free[r] - acceleration[r]).abs()) {
                    return None;
                }
            }
            match hardest {
                Some((r, _)) => set.push(r),
                None => {
                    let mut staying: Vec<usize> = set[motors..].iter().map(|&r| touching[r - motors]).collect();
                    staying.sort_unstable();
                    return Some(staying);
                }
            }
        }
        None
    }
}

/// The multipliers of the rows in `set` that bring about `right` there; zero elsewhere.
fn solve(schur: &DMatrix<f64>, set: &[usize], right: &DVector<f64>) -> Option<DVector<f64>> {
    let mut multiplier = DVector::zeros(right.len());
    if !set.is_empty() {
        let part = schur.select_rows(set).select_columns(set);
        let found = part.full_piv_lu().solve(&right.select_rows(set)).filter(|x| x.iter().all(|x| x.is_finite()))?;
        for (&r, &value) in set.iter().zip(found.iter()) {
            multiplier[r] = value;
        }
    }
    Some(multiplier)
}
