//! What the equations tell of modes of places with dry friction: signs, and what is rounding.
//!
//! The combinations are the same for all numbers, see [`modes`](super::modes); this is what is told of one in
//! the numbers of a run, [`Evidence`], and that of doubles.

use super::super::constraint::ConstraintArguments;
use super::super::kernel::{Bias, Kernel, dot};
use super::super::{Mechanism, Time};
use super::shared::FreeDisplacements;
use super::{FrictionMode, FrictionMoment};

/// Velocity over the sum of the magnitudes of its parts, and over the mechanism's own, up to which a place
/// does not slide.
pub(crate) const NO_SPEED: f64 = 1e-12;
/// Share of a force, or of an acceleration, that rounding makes.
const ROUNDING: f64 = 1e-9;
/// A moment, over the mechanism's own time.
const A_MOMENT: f64 = 1e-6;

/// What the equations tell of contacts that are closed and places in these modes: signs, zero where rounding
/// leaves them open.
#[derive(Clone, Debug)]
pub struct ContactSigns {
    /// The determinant of the equations of friction.
    pub regularity: f64,
    /// Pressures of the closed contacts.
    pub pressures: Vec<i8>,
    /// Accelerations of the gaps of all that touch.
    pub leaving: Vec<i8>,
    /// mu0 N - |tau| of what sticks, zero at the limit.
    pub grips: Vec<i8>,
    /// Accelerations of the relative displacements of all places.
    pub speeding: Vec<i8>,
    /// Accelerations of all coordinates.
    pub load: Vec<f64>,
}

impl ContactSigns {
    /// True where no closed contact pulls, none of those that touch is gone into, and what sticks is within
    /// its limit.
    pub(super) fn hold(&self, closed: &[usize], modes: &[FrictionMode], touching: &[usize]) -> bool {
        let leaves = |(contact, &sign): (&usize, &i8)| closed.contains(contact) || sign >= 0;
        let grips =
            |(mode, &grip): (&FrictionMode, &i8)| !matches!(mode, FrictionMode::Stick(_)) || grip >= 0;
        self.pressures.iter().all(|&sign| sign >= 0)
            && touching.iter().zip(&self.leaving).all(leaves)
            && modes.iter().zip(&self.grips).all(grips)
    }
}

/// What is known of a moment in the numbers of a run.
pub trait Evidence {
    /// The relative velocity \[rad/s, m/s\] of every place, zero where it is rounding.
    fn rates(&self) -> Vec<f64>;

    /// What the equations tell; `None` where they have no finite solution.
    fn told(&self, closed: &[usize], modes: &[FrictionMode], touching: &[usize]) -> Option<ContactSigns>;

    /// The same a moment later, with these accelerations up to then.
    fn told_later(
        &self,
        closed: &[usize],
        modes: &[FrictionMode],
        touching: &[usize],
        load: &[f64],
    ) -> Option<ContactSigns>;

    /// False where contacts would have to pull, or what sticks is beyond its limit.
    fn hold_so(&self, closed: &[usize], modes: &[FrictionMode]) -> bool {
        self.told(closed, modes, &[]).is_some_and(|told| told.hold(closed, modes, &[]))
    }

    /// False where contacts would have to pull a moment later, or what sticks is beyond its limit.
    fn lasts(&self, closed: &[usize], modes: &[FrictionMode], touching: &[usize], load: &[f64]) -> bool {
        let later = self.told_later(closed, modes, touching, load);
        later.is_some_and(|told| told.hold(closed, modes, touching))
    }

    /// True where a place that is held by contacts, constraints and the others in these modes has no
    /// acceleration; of what motors hold less is asked.
    fn is_still(&self, place: usize, closed: &[usize], modes: &[FrictionMode], is_driven: bool) -> bool;

    /// True where a place that contacts and constraints hold has no velocity once that of the rest is as
    /// these have it.
    fn stands(&self, place: usize, closed: &[usize]) -> bool;
}

/// The evidence in doubles.
pub(super) struct InDoubles<'a> {
    pub mechanism: &'a Mechanism,
    pub at: FrictionMoment<'a>,
}

impl Mechanism {
    /// Coordinates and rates a moment after a time, with these accelerations there.
    pub(crate) fn a_moment_later(
        &self,
        t: Time,
        [phi, omega]: [&[f64]; 2],
        load: &[f64],
    ) -> (Time, [Vec<f64>; 2]) {
        let h = A_MOMENT * self.units.time;
        let moved = |((phi, omega), a): ((&f64, &f64), &f64)| phi + h * (omega + 0.5 * h * a);
        let phi = phi.iter().zip(omega).zip(load).map(moved).collect();
        let omega = omega.iter().zip(load).map(|(omega, a)| omega + h * a).collect();
        (t + h, [phi, omega])
    }

    /// [`Evidence::hold_so`] in doubles.
    pub(crate) fn hold_so(&self, at: FrictionMoment, closed: &[usize], modes: &[FrictionMode]) -> bool {
        InDoubles { mechanism: self, at }.hold_so(closed, modes)
    }

    /// The relative velocity \[rad/s, m/s\] of every place, zero where it is rounding.
    fn sliding_rates(&self, at: FrictionMoment) -> Vec<f64> {
        let mut row = vec![0.0; at.phi.len()];
        let configuration = ConstraintArguments { phi: at.phi, z: at.z, omega: at.omega };
        (self.frictions.iter().enumerate())
            .map(|(number, friction)| {
                row.fill(0.0);
                let here = friction.tangent.differentiate(at.t, configuration, &mut row);
                let rate = dot(&row, at.omega) + here.drive;
                let parts: f64 = row.iter().zip(at.omega).map(|(d, omega)| (d * omega).abs()).sum();
                let size = parts.max(self.speed_unit(number));
                if rate.abs() <= NO_SPEED * size { 0.0 } else { rate }
            })
            .collect()
    }
}

impl Evidence for InDoubles<'_> {
    fn rates(&self) -> Vec<f64> {
        self.mechanism.sliding_rates(self.at)
    }

    fn told(&self, closed: &[usize], modes: &[FrictionMode], touching: &[usize]) -> Option<ContactSigns> {
        let Self { mechanism: free, at } = *self;
        let mechanism = free.moving(closed, modes);
        let mut kernel = Kernel::<f64>::new(&mechanism);
        kernel.accelerations(&mechanism, at.t, at.phi, at.omega, Bias::default());
        if !kernel.load.iter().chain(&kernel.multiplier).all(|x| x.is_finite()) {
            return None;
        }
        let forces = kernel.friction_forces(&mechanism, at.t, at.phi, at.omega);
        let pressures = closed.iter().zip(&kernel.multiplier[mechanism.standing_rows()..]);
        let pressure = |(&contact, &multiplier): (&usize, &f64)| free.contacts[contact].pressure(multiplier);
        let pressures = pressures.map(pressure).map(|pressure| sign(pressure, ROUNDING)).collect();
        let configuration = ConstraintArguments { phi: at.phi, z: at.z, omega: at.omega };
        let mut row = vec![0.0; at.phi.len()];
        let mut acceleration = |of: &super::ConstraintEquation| {
            row.fill(0.0);
            let here = of.differentiate(at.t, configuration, &mut row);
            let parts = row.iter().zip(&kernel.load).map(|(g, a)| (g * a).abs()).sum::<f64>();
            (dot(&row, &kernel.load) + here.convective, parts + here.convective.abs())
        };
        let mut acceleration = |of: &super::ConstraintEquation| {
            let (acceleration, size) = acceleration(of);
            sign(acceleration, ROUNDING * size)
        };
        let leaving = touching.iter().map(|&contact| acceleration(&free.contacts[contact].row)).collect();
        let speeding = free.frictions.iter().map(|friction| acceleration(&friction.tangent)).collect();
        let grip = |(friction, [tau, pressing]): (&super::CompiledFriction, [f64; 2])| {
            let rounding =
                f64::EPSILON * kernel.multiplier.iter().fold(pressing, |most, x| most.max(x.abs()));
            let most = friction.stiction * pressing;
            sign(most - tau.abs(), ROUNDING * most + friction.stiction * rounding)
        };
        let grips = free.frictions.iter().zip(forces).map(grip).collect();
        let regularity = kernel.regularity;
        Some(ContactSigns { regularity, pressures, leaving, grips, speeding, load: kernel.load })
    }

    fn told_later(
        &self,
        closed: &[usize],
        modes: &[FrictionMode],
        touching: &[usize],
        load: &[f64],
    ) -> Option<ContactSigns> {
        let FrictionMoment { t, phi, omega, .. } = self.at;
        let (t, [phi, omega]) = self.mechanism.a_moment_later(t, [phi, omega], load);
        let z = self.mechanism.elements(&phi);
        let at = FrictionMoment { t, phi: &phi, z: &z, omega: &omega };
        InDoubles { mechanism: self.mechanism, at }.told(closed, modes, touching)
    }

    fn is_still(&self, place: usize, closed: &[usize], modes: &[FrictionMode], is_driven: bool) -> bool {
        self.mechanism.room_beside(self.at, closed, modes, place).is_still(place, is_driven)
    }

    fn stands(&self, place: usize, closed: &[usize]) -> bool {
        let open = vec![FrictionMode::Open; self.mechanism.frictions.len()];
        FreeDisplacements::new(self.mechanism, self.at, closed, &open).stands(place)
    }
}

/// The sign of a number, zero up to what is rounding.
fn sign(x: f64, rounding: f64) -> i8 {
    if x > rounding { 1 } else { -i8::from(x < -rounding) }
}
