//! Points that stay on their walls: which of them do, and the mechanism that keeps them there.
//!
//! ```text
//! of all points that touch and do not move along their normals:
//! a_c >= 0,    f_c = -lambda_c >= 0,    a_c f_c = 0
//!     a = a0 - S lambda,  S = G M⁻¹ Gᵀ,  the mechanism's rows always in force
//! ```
//!
//! A contact that lasts is a row like any other as long as it presses, and does no work; what dry friction
//! changes of that is found by [`friction`](super::friction). Source: F. Pfeiffer, C. Glocker, *Multibody
//! Dynamics with Unilateral Contacts* (1996), chapter 5; the set is found by adding the point that is pressed
//! hardest and dropping those that would be pulled (C. Lawson, R. Hanson, *Solving Least Squares Problems*
//! (1974), chapter 23).

pub mod bounces;
pub mod metric;
pub mod scale;

use self::metric::{Basis, ContactMetric, MetricRow};
use super::constraint::ConstraintArguments;
use super::friction::FrictionMode;
use super::impact::{Contact, NO_FREEDOM};
use super::kernel::dot;
use super::{Mechanism, Time};
use crate::arithmetic::Complex;
use nalgebra::DVector;

/// Height of a rebound over the length of the contact below which a pressed point stays: ten times the least
/// gap the search for impacts tells from touching.
pub const REST_HEIGHT: f64 = 1e-11;
/// Contact force over the force of the contact below which a point is not pressed; rounding makes forces of
/// this size.
const LEAST_PRESSURE: f64 = 4e-12;
/// |G| over the levers of the point below which it stands at a dead centre: there its wall has no hold on it,
/// and a row would be singular.
const DEAD_CENTRE: f64 = 1e-5;

impl Mechanism {
    /// The mechanism with these of its contacts kept by a row each, after all other rows.
    ///
    /// Nothing is renumbered: the event function of a contact that is held is its force instead of its gap.
    pub fn holding(&self, contacts: &[usize]) -> Self {
        self.moving(contacts, &vec![FrictionMode::Open; self.frictions.len()])
    }

    /// The elements at these coordinates \[rad, m\].
    pub fn elements(&self, phi: &[f64]) -> Vec<Complex<f64>> {
        let mut z = vec![Complex::ZERO; self.coordinates()];
        self.tree.unit_vectors::<f64, 0>(phi, &mut z);
        z
    }

    /// Rows that are in force whatever touches.
    pub fn standing_rows(&self) -> usize {
        self.constraints.len() - self.held.len() - self.sticking()
    }

    /// Which of the contacts `touching` stay, or `None` where the constraints leave no freedom to keep a
    /// point out of its wall.
    ///
    /// Coordinates \[rad, m\] and rates \[rad/s, m/s\].  A point stays where it would rebound to less than
    /// this height, over the length of its contact, and be pressed.
    pub fn staying(
        &self,
        touching: &[usize],
        t: Time,
        [phi, omega]: [&[f64]; 2],
        height: f64,
    ) -> Option<Vec<usize>> {
        let (metric, z) = (ContactMetric::at(self, t, phi, omega)?, self.elements(phi));
        let at = ConstraintArguments { phi, z: &z, omega };
        let acceleration = metric.acceleration();
        let met = |&contact: &usize| {
            MetContact::new(
                &self.contacts[contact],
                &metric,
                &acceleration,
                MetricRow::of(&self.contacts[contact].row, t, at),
                omega,
            )
        };
        let points: Vec<MetContact> = touching.iter().map(met).collect();
        let mut set: Vec<usize> = Vec::new();
        // Every round adds or drops one point; more rounds than this would go in a circle.
        for _ in 0..4 * points.len() + 4 {
            let mut basis = Basis::new(phi.len());
            set.retain(|&c| basis.push(&points[c].free));
            let change = basis.least(&set.iter().map(|&c| -points[c].acceleration).collect::<Vec<_>>());
            let forces = basis.shares(&change);
            let pulled = (set.iter().zip(&forces).map(|(&c, force)| (c, force / points[c].contact.force)))
                .filter(|(_, pressure)| *pressure < LEAST_PRESSURE)
                .min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((pulled, _)) = pulled {
                set.retain(|&c| c != pulled);
                continue;
            }
            let mut hardest: Option<(usize, f64)> = None;
            for (c, point) in points.iter().enumerate().filter(|(c, _)| !set.contains(c)) {
                let inward = -(point.acceleration + point.free.dot(&change));
                if point.is_dead || !point.contact.rebounds_low([point.speed, inward], height) {
                    continue;
                }
                // What the rows in force leave of the point's freedom to give way.
                let freedom = basis.rest(&point.free).norm();
                if freedom > NO_FREEDOM * point.norm {
                    let pressure = inward / (freedom * freedom) / point.contact.force;
                    if pressure > LEAST_PRESSURE && hardest.is_none_or(|(_, most)| pressure > most) {
                        hardest = Some((c, pressure));
                    }
                } else if inward > 1e-9 * (point.size + point.norm * change.norm()) {
                    return None;
                }
            }
            match hardest {
                Some((c, _)) => set.push(c),
                None => {
                    let mut staying: Vec<usize> = set.iter().map(|&c| touching[c]).collect();
                    staying.sort_unstable();
                    return Some(staying);
                }
            }
        }
        None
    }
}

impl Contact {
    /// True where its wall has no hold on the point, as the gradient of the gap by all coordinates has this
    /// square \[m²\].
    pub(crate) fn is_dead(&self, gradient_squared: f64) -> bool {
        self.tilt(gradient_squared) < DEAD_CENTRE
    }

    /// True where a point that leaves its wall at this speed \[m/s\], with this acceleration towards it
    /// \[m/s²\], comes back from less than a height, over the length of the contact.
    pub(crate) fn rebounds_low(&self, [speed, inward]: [f64; 2], height: f64) -> bool {
        inward > 0.0 && speed * speed <= 2.0 * height * self.length * inward
    }

    /// |G| over the levers of a point that turns.
    pub(super) fn tilt(&self, gradient_squared: f64) -> f64 {
        let levers: f64 = self.point.terms.iter().map(|term| term.1.norm_squared()).sum();
        if self.point.shifts.is_empty() { (gradient_squared / levers).sqrt() } else { f64::INFINITY }
    }
}

/// A contact that touches, as the set of those that stay is found.
struct MetContact<'a> {
    contact: &'a Contact,
    /// What the constraints leave of its freedom, and the size of all of it.
    free: DVector<f64>,
    norm: f64,
    /// Normal velocity \[m/s\], normal acceleration under the constraints alone and the sum of the magnitudes
    /// of its parts \[m/s²\].
    speed: f64,
    acceleration: f64,
    size: f64,
    /// True at a dead centre.
    is_dead: bool,
}

impl<'a> MetContact<'a> {
    fn new(
        contact: &'a Contact,
        metric: &ContactMetric,
        acceleration: &DVector<f64>,
        gradient: MetricRow,
        omega: &[f64],
    ) -> Self {
        let MetricRow { row, along } = gradient;
        let column = metric.column(&along);
        let parts = column.component_mul(acceleration);
        Self {
            contact,
            speed: dot(&along, omega) + row.drive,
            acceleration: parts.sum() + row.convective,
            size: parts.iter().map(|part| part.abs()).sum::<f64>() + row.convective.abs(),
            is_dead: contact.is_dead(dot(&along, &along)),
            free: metric.free(&column),
            norm: column.norm(),
        }
    }
}
