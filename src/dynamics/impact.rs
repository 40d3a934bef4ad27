//! The jump of the rates when a point meets a wall.
//!
//! ```text
//! M (w⁺ - w⁻) + Jᵀ rho + Gᵀ sigma = 0,    J w⁺ + g_t = -e (J w⁻ + g_t),    G w⁺ + C_t = 0
//! ```
//!
//! In the coordinates of [`metric`](super::contact::metric): v⁺ = v + (c - Q Qᵀ c) f, v being the velocity
//! nearest to v⁻ that keeps the rows and f what brings c·v⁺ to -e c·v⁻.  Rows that depend on others get no
//! impulse.
//!
//! The impulse on the point along the wall's normal is -rho, never negative.  With dry friction at the wall
//! it follows with that of friction from Routh's method, see [`Shock`].  Without motors and friction the
//! energy changes by `-rho (1-e) J w⁻ / 2`. Source: F. Pfeiffer, C. Glocker, *Multibody Dynamics with
//! Unilateral Contacts* (1996), section 8.2 (Newton's law of impact).

use super::constraint::{ConstraintArguments, ConstraintEquation, RowMeasure};
use super::contact::metric::{ContactMetric, MetricRow};
use super::contact::scale::magnitudes;
use super::friction::impact::Shock;
use super::kernel::dot;
use super::point::Point;
use super::{Mechanism, Time};
use crate::arithmetic::Complex;

/// What constraints leave of a point's freedom along its normal, over what it has without them, below which
/// they leave none: rounding leaves as much.
pub(super) const NO_FREEDOM: f64 = 1e-11;

/// A gap that counts as touching, over the length of its contact, with what the search for impacts leaves of
/// it.
pub const TOUCH: f64 = 2e-12;

/// A wall as the mechanism meets it.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// The gap and its Jacobian; its law or its aim is how far the wall has moved along its normal.
    pub row: ConstraintEquation,
    /// The point, seen from a point of the wall where that is on a body.
    pub point: Point,
    /// The body that carries the wall; `None`: the ground.
    pub on: Option<usize>,
    /// Unit normal of the wall, in the frame of what carries it.
    pub normal: Complex<f64>,
    /// Restitution e.
    pub restitution: f64,
    /// What gaps are divided by \[m\], a power of two: see [`contact::scale`](super::contact::scale).
    pub length: f64,
    /// What forces of the wall are divided by \[N\], a power of two.
    pub force: f64,
    /// True where an event has switched it off: its point passes.
    pub is_off: bool,
}

/// The gap of a wall that is switched off, over the length of its contact.
pub const AWAY: f64 = 1.0;

impl Contact {
    /// A wall of the ground, before its point and its units are known.
    pub fn new(row: ConstraintEquation, normal: Complex<f64>, restitution: f64) -> Self {
        let point = Point::default();
        Self { row, point, on: None, normal, restitution, length: 1.0, force: 1.0, is_off: false }
    }

    /// How far the wall has moved along its normal \[m\], at angles and translational coordinates `phi` and
    /// elements `z`; `None` where it stays.
    pub fn travel(&self, t: Time, phi: &[f64], z: &[Complex<f64>]) -> Option<f64> {
        match &self.row.aim {
            None => self.row.law.as_ref().map(|law| law.value::<f64>(t)),
            Some(aim) => Some(aim.value(t, phi, z)),
        }
    }

    /// The rate of that \[m/s\].
    pub fn travel_rate(&self, t: Time, phi: &[f64], z: &[Complex<f64>], omega: &[f64]) -> Option<f64> {
        match &self.row.aim {
            None => self.row.law.as_ref().map(|law| law.rates::<f64>(t).0),
            Some(aim) => Some(aim.rate(t, phi, z, omega)),
        }
    }

    /// The gap \[m\].
    pub fn distance(&self, t: Time, phi: &[f64], z: &[Complex<f64>]) -> f64 {
        let gap = self.row.gap(z);
        self.travel(t, phi, z).map_or(gap, |travel| gap - travel)
    }

    /// The gap over the length of the contact: the event function of a point that may meet its wall.
    pub fn gap(&self, t: Time, phi: &[f64], z: &[Complex<f64>]) -> f64 {
        if self.is_off { AWAY } else { self.distance(t, phi, z) / self.length }
    }

    /// True where the point is on its wall, or behind it: by [`TOUCH`] of its length, or by the rounding of
    /// the gap at these elements.
    pub fn touches(&self, t: Time, phi: &[f64], z: &[Complex<f64>]) -> bool {
        let size = magnitudes(&self.row, z) + self.travel(t, phi, z).map_or(0.0, f64::abs);
        self.gap(t, phi, z) <= TOUCH.max(4.0 * f64::EPSILON * size / self.length)
    }

    /// The rate of the gap \[m/s\].
    pub fn gap_rate(&self, t: Time, phi: &[f64], z: &[Complex<f64>], omega: &[f64]) -> f64 {
        let rate = match (&self.row.measure, self.on) {
            (RowMeasure::Place(place), Some(_)) => {
                let mut rate = 0.0;
                place.slopes(z, |k, slope| rate += slope * omega[k]);
                rate
            }
            _ => self.normal.dot(self.point.velocity(z, omega)),
        };
        self.travel_rate(t, phi, z, omega).map_or(rate, |travel_rate| rate - travel_rate)
    }

    /// The largest velocity the parts of the point have along the normal \[m/s\]: rounding of its normal
    /// velocity is a share of it.
    pub fn step_size(&self, omega: &[f64]) -> f64 {
        let turning = self.point.terms.iter().map(|&(k, gamma)| gamma.norm_squared().sqrt() * omega[k].abs());
        let carried = self.point.shifts.iter().map(|&(x, share)| match self.on {
            None => share.abs() * ((self.normal.re * omega[x]).abs() + (self.normal.im * omega[x + 1]).abs()),
            Some(_) => share.abs() * libm::hypot(omega[x], omega[x + 1]),
        });
        turning.chain(carried).fold(0.0, f64::max)
    }

    /// The force of the wall over the force of the contact: the event function of a point that is held.
    pub fn pressure(&self, multiplier: f64) -> f64 {
        -multiplier / self.force
    }
}

/// What an impact did.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// Rates of all coordinates after it \[rad/s, m/s\].
    pub omega: Vec<f64>,
    /// Normal velocity of the point before it \[m/s\], negative.
    pub approach: f64,
    /// Impulse on the point along the wall's normal \[N·s\].
    pub impulse: f64,
    /// Impulse of friction on the point along the wall, the normal turned clockwise \[N·s\].
    pub tangential: f64,
    /// Impulses of the rows \[N·m·s or N·s\]: of a contact that is held, positive where it would have to
    /// pull.
    pub row_impulses: Vec<f64>,
    /// Energy after less energy before \[J\].
    pub energy_change: f64,
    /// Impulsive work of the motors and of a wall that moves, which hold their rates \[J\].
    pub motor_work: f64,
}

impl Mechanism {
    /// The held contact that would have to pull the hardest to keep a point from rebounding at another one,
    /// where the constraints leave it no freedom; `None` where none has to.
    pub fn pulled_without_way_back(
        &self,
        contact: usize,
        t: Time,
        phi: &[f64],
        omega: &[f64],
    ) -> Option<usize> {
        let metric = ContactMetric::at(self, t, phi, omega)?;
        let z = self.elements(phi);
        let MetricRow { along, .. } =
            MetricRow::of(&self.contacts[contact].row, t, ConstraintArguments { phi, z: &z, omega });
        self.pulled(&metric.multipliers(&metric.column(&along)), NO_FREEDOM)
    }

    /// What constraints, holds and places that stick leave of a point's freedom along the normal of its wall,
    /// over what it has without them; or, where that is less, its Jacobian over its levers, zero at the dead
    /// centre of a point that turns.
    pub fn freedom(&self, contact: usize, t: Time, phi: &[f64], omega: &[f64]) -> f64 {
        let Some(metric) = ContactMetric::at(self, t, phi, omega) else { return 1.0 };
        let (contact, at) =
            (&self.contacts[contact], ConstraintArguments { phi, z: &self.elements(phi), omega });
        let along = MetricRow::of(&contact.row, t, at).along;
        let column = metric.column(&along);
        let whole = column.norm();
        let left = if whole > 0.0 { metric.free(&column).norm() / whole } else { 0.0 };
        left.min(contact.tilt(dot(&along, &along)))
    }

    /// The held contact that would have to pull the hardest, by more than `least`, of these impulses of the
    /// rows.
    pub fn pulled(&self, row_impulses: &[f64], least: f64) -> Option<usize> {
        let held = self.held.iter().zip(&row_impulses[self.standing_rows()..]);
        let pulled = held.filter(|(_, pull)| **pull > least);
        pulled.max_by(|a, b| a.1.total_cmp(b.1)).map(|(&held, _)| held)
    }

    /// The jump at contact `contact`, or `None` where the motors leave the point no freedom to rebound.
    ///
    /// Coordinates \[rad, m\] and rates \[rad/s, m/s\] at the moment of impact; a point that is not
    /// approaching keeps its rates.
    pub fn impact_at(&self, contact: usize, t: Time, phi: &[f64], omega: &[f64]) -> Option<Impact> {
        let Contact { row, restitution, .. } = &self.contacts[contact];
        let metric = ContactMetric::at(self, t, phi, omega)?;
        let z = self.elements(phi);
        let MetricRow { row: here, along } = MetricRow::of(row, t, ConstraintArguments { phi, z: &z, omega });
        let approach = dot(&along, omega) + here.drive;
        if approach >= 0.0 {
            let row_impulses = vec![0.0; self.constraints.len()];
            return Some(Impact {
                omega: omega.to_vec(),
                approach,
                impulse: 0.0,
                tangential: 0.0,
                row_impulses,
                energy_change: 0.0,
                motor_work: 0.0,
            });
        }
        let (column, before) = (metric.column(&along), metric.velocity(omega));
        let (free, kept) = (metric.free(&column), metric.kept(&before));
        if free.norm() <= NO_FREEDOM * column.norm() {
            return None;
        }
        let mut impulse = (-restitution * approach - (column.dot(&kept) + here.drive)) / free.norm_squared();
        let (mut push, mut change) = (&column * impulse, &kept - &before + &free * impulse);
        let mut tangential = 0.0;
        if let Some(friction) = self.friction_at(contact) {
            let along = MetricRow::of(&friction.tangent, t, ConstraintArguments { phi, z: &z, omega }).along;
            let across = metric.column(&along);
            let mut free_across = metric.free(&across);
            // Where others hold it along its wall, rounding must not say which way it slides.
            if free_across.norm() <= NO_FREEDOM * across.norm() {
                free_across.fill(0.0);
            }
            let share = free.dot(&free_across) / free.norm_squared();
            let apart = (&free_across - &free * share).norm();
            let shock = Shock {
                response: [free.norm_squared(), free.dot(&free_across), free_across.norm_squared()],
                velocity: [column.dot(&kept) + here.drive, across.dot(&kept)],
                restitution: *restitution,
                coefficients: [friction.kinetic, friction.stiction],
                is_newton: friction.is_newton,
                one_way: (apart <= NO_FREEDOM * free_across.norm()).then_some(NO_FREEDOM),
            };
            [impulse, tangential] = shock.impulses()?;
            push = &column * impulse + &across * tangential;
            change = &kept - &before + &free * impulse + &free_across * tangential;
        }
        let row_impulses = metric.multipliers(&(&push - &change));
        let of_rows = row_impulses.iter().zip(&metric.rows).map(|(impulse, row)| impulse * row.row.drive);
        let motor_work = of_rows.sum::<f64>() - impulse * here.drive;
        let is_finite = impulse.is_finite() && change.iter().chain(&row_impulses).all(|x| x.is_finite());
        is_finite.then(|| Impact {
            approach,
            impulse,
            tangential,
            row_impulses,
            energy_change: change.dot(&before) + 0.5 * change.norm_squared(),
            motor_work,
            // What takes no part keeps its rate to the last bit.
            omega: metric.rates(&change).iter().zip(omega).map(|(change, omega)| omega + change).collect(),
        })
    }
}
