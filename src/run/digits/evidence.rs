//! What many digits tell of a combination of modes of places with dry friction: accelerations, forces and
//! relative velocities, of which what is rounding in three quarters of the digits is zero.

use super::coordinates::DigitsCoordinates;
use super::friction::SURE;
use super::motion::DigitsMotion;
use super::projection::DigitsProjection;
use super::wall::gap;
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::Coordinates;
use crate::dynamics::compile::exact::{Acting, ExactMechanism};
use crate::dynamics::constraint::{ConstraintEquation, RowMeasure};
use crate::dynamics::friction::evidence::{ContactSigns, Evidence};
use crate::dynamics::friction::{CompiledFriction, FrictionMode, size};
use crate::dynamics::kernel::dot;
use crate::dynamics::series::Series;

/// Powers of the rates that accelerations are taken from.
const POWERS: usize = 2;
/// log2 of a moment, over the mechanism's own time.
const A_MOMENT: f64 = -20.0;
/// The same of the part of a force that is rounding a moment later: the motion up to then is known but for
/// what is of third order.
const LATER: f64 = 1.5 * A_MOMENT;

/// What is known of a moment in many digits.
pub(super) struct InDigits<'a, const W: usize> {
    motion: &'a DigitsMotion<W>,
    /// Time \[s\].
    pub t: Digits<W>,
    /// All coordinates.
    pub coordinates: DigitsCoordinates<W>,
    z: Vec<Complex<Digits<W>>>,
    /// Where each place sticks, if it does.
    anchors: Vec<Digits<W>>,
    /// log2 of the part of a number that is rounding.
    pub rounding: f64,
}

impl<'a, const W: usize> InDigits<'a, W> {
    pub fn of(motion: &'a DigitsMotion<W>) -> Self {
        Self::at(motion, motion.state.t, motion.state_coordinates(), motion.precision.rounding(SURE))
    }

    /// What is known of another time and other coordinates.
    pub fn at(
        motion: &'a DigitsMotion<W>,
        t: Digits<W>,
        coordinates: DigitsCoordinates<W>,
        rounding: f64,
    ) -> Self {
        let mechanism = &motion.mechanism;
        let z = mechanism.elements(&coordinates.phi);
        let anchor = |(friction, mode): (&CompiledFriction<Digits<W>>, &FrictionMode<Digits<W>>)| match mode {
            FrictionMode::Stick(at) => *at,
            _ => friction.displacement(&coordinates.phi, &z),
        };
        let anchors = mechanism.frictions.iter().zip(&mechanism.acting.sliding).map(anchor).collect();
        Self { motion, t, coordinates, z, anchors, rounding }
    }

    /// Modes with the displacements of what sticks in all digits.
    pub fn exact(&self, modes: &[FrictionMode]) -> Vec<FrictionMode<Digits<W>>> {
        let exact = |(mode, &at): (&FrictionMode, &Digits<W>)| match *mode {
            FrictionMode::Open => FrictionMode::Open,
            FrictionMode::Stick(_) => FrictionMode::Stick(at),
            FrictionMode::Slip(sign) => FrictionMode::Slip(sign),
            FrictionMode::Strained(sign) => FrictionMode::Strained(sign),
        };
        modes.iter().zip(&self.anchors).map(exact).collect()
    }

    pub fn mechanism(&self, closed: &[usize], modes: &[FrictionMode]) -> Option<ExactMechanism<Digits<W>>> {
        let (held, sliding) = (closed.to_vec(), self.exact(modes));
        self.motion.mechanism.with(Acting { held, sliding, ..self.motion.state.acting.clone() }).ok()
    }

    /// The first powers of the motion in these modes.
    pub fn series(&self, mechanism: &ExactMechanism<Digits<W>>) -> Series<Digits<W>> {
        let DigitsCoordinates { phi, omega, .. } = &self.coordinates;
        let mut series = Series::of_terms(&mechanism.terms(), Coordinates::All, POWERS);
        series.resolve_reversals(self.rounding);
        let zeros = vec![Digits::ZERO; phi.len()];
        series.expand_terms(&mechanism.terms(), self.t, phi, &zeros, omega);
        series
    }

    /// The relative velocity of a place at these rates, zero where it is rounding.
    fn rate(&self, place: usize, omega: &[Digits<W>]) -> f64 {
        let gradient = gradient(&self.motion.mechanism.frictions[place].tangent, &self.z);
        let rate = dot(&gradient, omega);
        let parts = gradient.iter().zip(omega).fold(Digits::ZERO, |sum, (&g, &w)| sum + (g * w).abs());
        let unit = self.motion.speed_unit(place);
        match sign(rate, parts.log2().max(libm::log2(unit)) + self.rounding) {
            0 => 0.0,
            side => f64::from(side) * rate.value().abs().max(f64::MIN_POSITIVE),
        }
    }

    /// The sign of the acceleration of what a row measures, where `unit` is the mechanism's own.
    fn speeding(&self, series: &Series<Digits<W>>, row: &ConstraintEquation<Digits<W>>, unit: f64) -> i8 {
        let n = self.z.len();
        let acceleration = second(series, self.t, row);
        let along = gradient(row, &self.z);
        let accelerations = &series.omega[n..2 * n];
        let parts = along.iter().zip(accelerations).fold(Digits::ZERO, |sum, (&g, &a)| sum + (g * a).abs());
        let left = acceleration - dot(&along, accelerations);
        sign(acceleration, (parts + left.abs()).log2().max(libm::log2(unit)) + self.rounding)
    }
}

/// The second derivative of what a row measures.
pub(super) fn second<const W: usize>(
    series: &Series<Digits<W>>,
    t: Digits<W>,
    row: &ConstraintEquation<Digits<W>>,
) -> Digits<W> {
    let n = series.elements();
    match row.measure {
        RowMeasure::Place(_) => gap(series, t, row)[2].scale(2.0),
        RowMeasure::Angle { body, base } => {
            base.map_or(series.omega[n + body], |base| series.omega[n + body] - series.omega[n + base])
        }
    }
}

/// The sign of a number, zero where its log2 is not above this.
fn sign<const W: usize>(x: Digits<W>, least: f64) -> i8 {
    let size = x.log2();
    match size > least {
        true if x < Digits::ZERO => -1,
        true => 1,
        false => 0,
    }
}

/// The gradient of what a row measures, by all coordinates.
pub(super) fn gradient<const W: usize>(
    row: &ConstraintEquation<Digits<W>>,
    z: &[Complex<Digits<W>>],
) -> Vec<Digits<W>> {
    let mut gradient = vec![Digits::ZERO; z.len()];
    row.measure.slopes(z, |k, slope| gradient[k] += slope);
    gradient
}

impl<const W: usize> Evidence for InDigits<'_, W> {
    fn rates(&self) -> Vec<f64> {
        (0..self.anchors.len()).map(|place| self.rate(place, &self.coordinates.omega)).collect()
    }

    fn told(&self, closed: &[usize], modes: &[FrictionMode], touching: &[usize]) -> Option<ContactSigns> {
        let mechanism = self.mechanism(closed, modes)?;
        let series = self.series(&mechanism);
        let (n, rows) = (self.z.len(), series.multipliers(0));
        let load = &series.omega[n..2 * n];
        if !load.iter().chain(rows).all(|x| x.is_finite()) {
            return None;
        }
        let structure = &mechanism.structure;
        let standing = structure.standing_rows();
        let pressure = |(&contact, &force): (&usize, &Digits<W>)| {
            sign(-force, libm::log2(structure.contacts[contact].force) + self.rounding)
        };
        let most = rows.iter().map(Digits::log2).fold(f64::NEG_INFINITY, f64::max);
        let mut stuck = rows[standing + closed.len()..].iter().zip(series.sticks());
        let grip =
            |(place, (friction, mode)): (usize, (&CompiledFriction<Digits<W>>, &FrictionMode))| match mode {
                FrictionMode::Stick(_) => stuck.next().map_or(0, |(tau, normal)| {
                    let pressing = size(friction.normal, normal[0]).0;
                    let size = pressing.log2().max(most) + friction.stiction.log2();
                    let size = size.max(libm::log2(self.motion.friction_unit(place)));
                    sign(friction.stiction * pressing - tau.abs(), size + self.rounding)
                }),
                _ => 0,
            };
        let time = structure.units.time;
        let gap = |&contact: &usize| {
            let unit = structure.contacts[contact].length / (time * time);
            self.speeding(&series, &mechanism.walls[contact].0, unit)
        };
        let speeding = |(place, friction): (usize, &CompiledFriction<Digits<W>>)| {
            self.speeding(&series, &friction.tangent, self.motion.speed_unit(place) / time)
        };
        // At rest what is left of accelerations is rounding.
        let moves = |(k, acceleration): (usize, &Digits<W>)| {
            let length = if k < structure.bodies.len() { 1.0 } else { structure.size_of_parts() };
            match sign(*acceleration, libm::log2(length / (time * time)) + self.rounding) {
                0 => 0.0,
                _ => acceleration.value(),
            }
        };
        Some(ContactSigns {
            regularity: series.regularity(),
            pressures: closed.iter().zip(&rows[standing..]).map(pressure).collect(),
            leaving: touching.iter().map(gap).collect(),
            grips: mechanism.frictions.iter().zip(modes).enumerate().map(grip).collect(),
            speeding: mechanism.frictions.iter().enumerate().map(speeding).collect(),
            load: load.iter().enumerate().map(moves).collect(),
        })
    }

    fn told_later(
        &self,
        closed: &[usize],
        modes: &[FrictionMode],
        touching: &[usize],
        load: &[f64],
    ) -> Option<ContactSigns> {
        let moment = Digits::of(libm::exp2(A_MOMENT) * self.motion.mechanism.structure.units.time);
        let mut later = self.coordinates.clone();
        for ((phi, omega), &load) in later.phi.iter_mut().zip(&mut later.omega).zip(load) {
            let change = Digits::of(load) * moment;
            *phi += (*omega + change.scale(0.5)) * moment;
            *omega += change;
        }
        let later = Self::at(self.motion, self.t + moment, later, self.rounding.max(LATER));
        later.told(closed, modes, touching)
    }

    fn is_still(&self, place: usize, closed: &[usize], modes: &[FrictionMode], _is_driven: bool) -> bool {
        let mut modes = modes.to_vec();
        modes[place] = FrictionMode::Open;
        self.told(closed, &modes, &[]).is_some_and(|told| told.speeding[place] == 0)
    }

    fn stands(&self, place: usize, closed: &[usize]) -> bool {
        let Some(mechanism) = self.mechanism(closed, &vec![FrictionMode::Open; self.anchors.len()]) else {
            return false;
        };
        let DigitsCoordinates { phi, mut omega, .. } = self.coordinates.clone();
        let mut projection = DigitsProjection::new(&mechanism, self.motion.precision);
        projection.close(&mechanism, self.t, &phi, &mut omega);
        self.rate(place, &omega) == 0.0
    }
}
