//! Impulses of one impact at several walls at once, with and without dry friction.
//!
//! ```text
//! v⁺ = v⁻ + A p,   p = (n_1 … n_k, s_1 … s_k)         along the normals and the walls
//! least_i <= n_i,  w_i <= v⁺_ni,  (n_i - least_i)(v⁺_ni - w_i) = 0
//! |s_i| <= mu0_i n_i,  v⁺_ti = 0      or      s_i = -sign(v⁺_ti) mu_i n_i
//!
//! Poisson:  compression  least = 0, w = 0;   expansion  least_i = e_i n_i of the compression, w = 0
//! Newton:   at once      least = 0, w_i = -e_i v⁻_ni
//! ```
//!
//! A complementarity problem of both phases, solved as that of [`modes`](super::modes) by looking at every
//! combination.  Among those that fit, points that slide on come before those that stop, and those that stick
//! before those that turn.  A wall whose point does not approach has no restitution.  Impulses that the
//! motion does not determine, as at two corners of one body that both stick, are shared in any way that fits.
//! It is written over the scalar: numbers of many digits have a rounding of their own.
//!
//! Source: F. Pfeiffer, C. Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), sections 8.2 and
//! 8.3.

use super::super::constraint::ConstraintArguments;
use super::super::contact::metric::{ContactMetric, MetricRow};
use super::super::{Mechanism, Time};
use crate::arithmetic::Real;
use nalgebra::DVector;

/// Combinations that are looked at.
const MOST: usize = 20_000;
/// Share of the largest velocity, impulse or entry of A that rounding makes, in doubles.
const ROUNDING: f64 = 1e-11;
/// Share of the largest pivot from which on others count as large as it.
const ALIKE: f64 = 0.999_999;

/// What the impulses at several walls are decided by; or, of points that rest, their forces, with
/// accelerations for velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct Shocks<T = f64> {
    /// A \[1/kg\], row by row: velocities that unit impulses make (2k, 2k).
    pub response: Vec<T>,
    /// v⁻ \[m/s\] (2k).
    pub velocity: Vec<T>,
    /// e (k), without those of points that do not approach.
    pub restitution: Vec<T>,
    /// mu and mu0 (k); zeros without friction.
    pub coefficients: Vec<[T; 2]>,
    /// True for Newton's law of impact, else Poisson's.
    pub is_newton: bool,
    /// Share of the largest velocity, impulse or entry of A that rounding makes.
    pub rounding: T,
}

/// What the impulse at one wall does.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ImpulseEffect {
    /// True where the point takes the least normal velocity, else the least impulse.
    is_pressed: bool,
    /// Sign of the velocity of what slides, 0 of what sticks.
    slides: f64,
}

impl<T: Real> Shocks<T> {
    /// Normal and tangential impulses \[N·s\] of all walls; `None` where no combination fits, or there are
    /// too many.
    pub fn impulses(&self) -> Option<Vec<[T; 2]>> {
        let count = self.restitution.len();
        let nothing = vec![T::ZERO; count];
        let first = if self.is_newton {
            let rebound: Vec<T> =
                self.restitution.iter().zip(&self.velocity).map(|(&e, &v)| -e * v).collect();
            self.phase(&self.velocity, &nothing, &rebound)?
        } else {
            self.phase(&self.velocity, &nothing, &nothing)?
        };
        let mut all = first.clone();
        if !self.is_newton && self.restitution.iter().any(|&e| e != T::ZERO) {
            let least: Vec<T> = self.restitution.iter().zip(&first).map(|(&e, &n)| e * n).collect();
            let second = self.phase(&self.after(&self.velocity, &first), &least, &nothing)?;
            all.iter_mut().zip(second).for_each(|(all, more)| *all += more);
        }
        Some((0..count).map(|i| [all[i], all[count + i]]).collect())
    }

    /// The impulses of compression alone (2k), after which no point goes into its wall.
    pub fn compression(&self) -> Option<Vec<T>> {
        let nothing = vec![T::ZERO; self.restitution.len()];
        self.phase(&self.velocity, &nothing, &nothing)
    }

    /// The impulses after which the points of these walls do not move along their normals, whatever the
    /// others do; without friction.
    pub fn pressed(&self, walls: &[usize]) -> Option<Vec<T>> {
        let nothing = vec![T::ZERO; self.restitution.len()];
        let way = |i| ImpulseEffect { is_pressed: walls.contains(&i), slides: 0.0 };
        let ways: Vec<ImpulseEffect> = (0..nothing.len()).map(way).collect();
        self.impulses_of(&self.velocity, &nothing, &nothing, &ways)
    }

    /// Velocities after impulses.
    pub fn after(&self, velocity: &[T], impulse: &[T]) -> Vec<T> {
        let rows = self.response.chunks_exact(velocity.len());
        let change = |row: &[T]| row.iter().zip(impulse).map(|(&a, &p)| a * p).reduce(|sum, term| sum + term);
        rows.zip(velocity).map(|(row, &v)| v + change(row).unwrap_or(T::ZERO)).collect()
    }

    /// The impulses of a phase from these velocities on.
    fn phase(&self, from: &[T], least: &[T], rebound: &[T]) -> Option<Vec<T>> {
        let ways: Vec<Vec<ImpulseEffect>> = (0..least.len()).map(|i| self.ways(i, from, least[i])).collect();
        let total = ways.iter().try_fold(1_usize, |all, of| all.checked_mul(of.len()));
        let total = total.filter(|&total| total <= MOST)?;
        (0..total).find_map(|mut number| {
            let way: Vec<ImpulseEffect> = (ways.iter())
                .map(|of| {
                    let own = of[number % of.len()];
                    number /= of.len();
                    own
                })
                .collect();
            let impulse = self.impulses_of(from, least, rebound, &way)?;
            self.fits(from, least, rebound, &way, &impulse).then_some(impulse)
        })
    }

    /// A velocity that is rounding.
    fn still(&self) -> T {
        self.rounding * largest(&self.velocity)
    }

    /// What a wall may do, first what changes least.
    fn ways(&self, i: usize, from: &[T], least: T) -> Vec<ImpulseEffect> {
        let ahead = from[from.len() / 2 + i];
        let still = self.still();
        let slides: &[f64] = match self.coefficients[i] {
            [_, stiction] if stiction == T::ZERO => &[0.0],
            _ if ahead > still => &[1.0, 0.0, -1.0],
            _ if ahead < -still => &[-1.0, 0.0, 1.0],
            _ => &[0.0, 1.0, -1.0],
        };
        let way = |is_pressed| slides.iter().map(move |&slides| ImpulseEffect { is_pressed, slides });
        // Without an impulse there is no friction.
        let few = if least > T::ZERO { slides.len() } else { 1 };
        way(true).chain(way(false).take(few)).collect()
    }

    /// The impulses that go these ways, wherever they lead; `None` where there are none.
    fn impulses_of(&self, from: &[T], least: &[T], rebound: &[T], way: &[ImpulseEffect]) -> Option<Vec<T>> {
        let (count, size) = (way.len(), from.len());
        let mut impulse = vec![T::ZERO; size];
        let mut unknown = Vec::new();
        for (i, way) in way.iter().enumerate() {
            let [kinetic, stiction] = self.coefficients[i];
            if way.is_pressed {
                unknown.push(i);
            } else {
                impulse[i] = least[i];
                impulse[count + i] = kinetic.scale(-way.slides) * least[i];
            }
            if way.slides == 0.0 && stiction > T::ZERO && (way.is_pressed || least[i] > T::ZERO) {
                unknown.push(count + i);
            }
        }
        let known = self.after(from, &impulse);
        // A unit of a normal impulse has its friction with it.
        let effect = |row: usize, column: usize| {
            let own = self.response[row * size + column];
            match way.get(column) {
                Some(way) => {
                    let friction = self.coefficients[column][0].scale(way.slides);
                    own - friction * self.response[row * size + count + column]
                }
                None => own,
            }
        };
        let mut matrix: Vec<T> = unknown
            .iter()
            .flat_map(|&row| unknown.iter().map(move |&column| (row, column)))
            .map(|(r, c)| effect(r, c))
            .collect();
        let mut values: Vec<T> = unknown
            .iter()
            .map(|&row| if row < count { rebound[row] } else { T::ZERO } - known[row])
            .collect();
        solve(&mut matrix, &mut values, self.rounding, self.still())?;
        for (&column, value) in unknown.iter().zip(values) {
            impulse[column] = value;
            if let Some(way) = way.get(column).filter(|way| way.slides != 0.0) {
                impulse[count + column] = self.coefficients[column][0].scale(-way.slides) * value;
            }
        }
        impulse.iter().all(|p| p.value().is_finite()).then_some(impulse)
    }

    /// Whether impulses and velocities after them are such as these ways claim.
    fn fits(&self, from: &[T], least: &[T], rebound: &[T], way: &[ImpulseEffect], impulse: &[T]) -> bool {
        let count = way.len();
        let after = self.after(from, impulse);
        let speed = self.still();
        let push = self.rounding * largest(impulse);
        (0..count).all(|i| {
            let [normal, along] = [impulse[i], impulse[count + i]];
            let is_kept = normal >= least[i] - push && after[i] >= rebound[i] - speed;
            let is_rough = if !way[i].is_pressed && least[i] == T::ZERO {
                // Without an impulse there is no friction, whichever way the point slides.
                true
            } else if way[i].slides == 0.0 {
                let pressed = if normal > T::ZERO { normal } else { T::ZERO };
                along.abs() <= self.coefficients[i][1] * pressed * (T::ONE + self.rounding) + push
            } else {
                after[count + i].scale(way[i].slides) >= -speed
            };
            is_kept && is_rough
        })
    }
}

/// The largest magnitude of numbers.
fn largest<T: Real>(numbers: &[T]) -> T {
    numbers.iter().fold(T::ZERO, |most, x| if x.abs() > most { x.abs() } else { most })
}

/// Solves a small system that may be singular, by elimination with exchange of rows and columns; what is left
/// open is zero, and so is what is below this share of the largest entry.  Which one is left open, of those
/// that could be, rounding must not decide: of pivots about as large, the first.  `None` where an equation
/// cannot be, by more than `open`.
fn solve<T: Real>(matrix: &mut [T], x: &mut [T], rounding: T, open: T) -> Option<()> {
    let d = x.len();
    let mut order: Vec<usize> = (0..d).collect();
    let size = largest(matrix);
    let mut rank = 0;
    while rank < d {
        let entries = || (rank..d).flat_map(|i| (rank..d).map(move |j| (i, j)));
        let weight = |(i, j): (usize, usize)| matrix[i * d + j].value().abs();
        let most = entries().map(weight).fold(0.0, f64::max);
        let large = entries().filter(|&at| weight(at) >= ALIKE * most);
        let (i, j) = large.min_by_key(|&(i, j)| (order[j], i)).unwrap_or((rank, rank));
        if matrix[i * d + j].abs() <= rounding * size {
            break;
        }
        (0..d).for_each(|k| matrix.swap(rank * d + k, i * d + k));
        (0..d).for_each(|k| matrix.swap(k * d + rank, k * d + j));
        x.swap(rank, i);
        order.swap(rank, j);
        for i in rank + 1..d {
            let share = matrix[i * d + rank] / matrix[rank * d + rank];
            for k in rank..d {
                let above = matrix[rank * d + k];
                matrix[i * d + k] -= share * above;
            }
            let above = x[rank];
            x[i] -= share * above;
        }
        rank += 1;
    }
    if x[rank..].iter().any(|left| left.abs() > open || left.value().is_nan()) {
        return None;
    }
    let mut found = vec![T::ZERO; d];
    for k in (0..rank).rev() {
        let sum = (k + 1..rank).fold(x[k], |sum, j| sum - matrix[k * d + j] * found[order[j]]);
        found[order[k]] = sum / matrix[k * d + k];
    }
    x.copy_from_slice(&found);
    Some(())
}

/// The impulses at one of several walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blow {
    /// The contact.
    pub contact: usize,
    /// Normal velocities of the point before and after \[m/s\].
    pub normal_rates: [f64; 2],
    /// The same along the wall, the normal turned clockwise; zeros without friction.
    pub tangential_rates: [f64; 2],
    /// Impulse along the normal \[N·s\], not negative.
    pub impulse: f64,
    /// Impulse of friction along the wall \[N·s\].
    pub tangential: f64,
}

impl Blow {
    /// Energy that the impulses take off the mechanism \[J\].
    pub fn energy_lost(&self) -> f64 {
        let [before, after] = self.normal_rates;
        let [slid, slides] = self.tangential_rates;
        -0.5 * (self.impulse * (before + after) + self.tangential * (slid + slides))
    }
}

/// What an impact at several walls did.
#[derive(Clone, Debug, PartialEq)]
pub struct Impacts {
    /// Rates of all coordinates after it \[rad/s, m/s\].
    pub omega: Vec<f64>,
    /// The walls that took part.
    pub blows: Vec<Blow>,
    /// Impulsive work of the motors and of walls that move, which hold their rates \[J\].
    pub motor_work: f64,
}

impl Mechanism {
    /// The jump at these contacts at once, none of which is held by the mechanism itself; `None` where no
    /// impulses fit, see [`Shocks::impulses`].
    ///
    /// Coordinates \[rad, m\] and rates \[rad/s, m/s\] at the moment of impact.  Newton's law is that of
    /// impacts all of whose walls with friction have it.
    pub fn impact_at_several(
        &self,
        contacts: &[usize],
        t: Time,
        phi: &[f64],
        omega: &[f64],
    ) -> Option<Impacts> {
        let (metric, z) = (ContactMetric::at(self, t, phi, omega)?, self.elements(phi));
        let at = ConstraintArguments { phi, z: &z, omega };
        let before = metric.velocity(omega);
        let kept = metric.kept(&before);
        let normals: Vec<MetricRow> =
            contacts.iter().map(|&contact| MetricRow::of(&self.contacts[contact].row, t, at)).collect();
        let frictions: Vec<_> = contacts.iter().map(|&contact| self.friction_at(contact)).collect();
        let along = frictions.iter().map(|friction| match friction {
            Some(friction) => metric.column(&MetricRow::of(&friction.tangent, t, at).along),
            None => DVector::zeros(omega.len()),
        });
        let columns: Vec<DVector<f64>> =
            normals.iter().map(|normal| metric.column(&normal.along)).chain(along).collect();
        let free: Vec<DVector<f64>> = columns.iter().map(|column| metric.free(column)).collect();
        let count = contacts.len();
        let drive = |i: usize| normals.get(i).map_or(0.0, |normal| normal.row.drive);
        let rates = |v: &DVector<f64>| -> Vec<f64> {
            columns.iter().enumerate().map(|(i, column)| column.dot(v) + drive(i)).collect()
        };
        let velocity = rates(&kept);
        let still = ROUNDING * velocity.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let restitution = |(i, &contact): (usize, &usize)| match velocity[i] < -still {
            true => self.contacts[contact].restitution,
            false => 0.0,
        };
        let known = frictions.iter().flatten();
        let shocks = Shocks {
            response: free.iter().flat_map(|row| free.iter().map(|other| row.dot(other))).collect(),
            restitution: contacts.iter().enumerate().map(restitution).collect(),
            coefficients: (frictions.iter())
                .map(|friction| friction.map_or([0.0; 2], |friction| [friction.kinetic, friction.stiction]))
                .collect(),
            is_newton: known.clone().count() > 0 && known.clone().all(|friction| friction.is_newton),
            velocity,
            rounding: ROUNDING,
        };
        let impulses = shocks.impulses()?;
        let (mut push, mut change) = (DVector::zeros(omega.len()), &kept - &before);
        for (i, [normal, tangential]) in impulses.iter().enumerate() {
            for (column, impulse) in [(i, normal), (count + i, tangential)] {
                push.axpy(*impulse, &columns[column], 1.0);
                change.axpy(*impulse, &free[column], 1.0);
            }
        }
        let row_impulses = metric.multipliers(&(&push - &change));
        let of_rows = row_impulses.iter().zip(&metric.rows).map(|(impulse, row)| impulse * row.row.drive);
        let of_walls = impulses.iter().enumerate().map(|(i, [normal, _])| normal * drive(i));
        let motor_work = of_rows.sum::<f64>() - of_walls.sum::<f64>();
        let (first, last) = (rates(&before), rates(&(&before + &change)));
        let most = impulses.iter().fold(0.0_f64, |most, impulse| most.max(impulse[0]));
        let blows = (impulses.iter().enumerate())
            .filter(|(_, impulse)| impulse[0] > ROUNDING * most)
            .map(|(i, &[impulse, tangential])| Blow {
                contact: contacts[i],
                normal_rates: [first[i], last[i]],
                tangential_rates: [first[count + i], last[count + i]],
                impulse,
                tangential,
            })
            .collect();
        change.iter().all(|x| x.is_finite()).then(|| Impacts {
            blows,
            motor_work,
            omega: metric.rates(&change).iter().zip(omega).map(|(change, omega)| omega + change).collect(),
        })
    }
}
