//! What is left of the rows of an exact mechanism, and what events change of what acts.

use super::ExactMechanism;
#[cfg(feature = "digits")]
use super::{Acting, FormulaEvent};
use crate::arithmetic::tape::Slot;
use crate::arithmetic::{Over, Real, Scalar};
#[cfg(feature = "digits")]
use crate::dynamics::configuration::{Configuration, Values};
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::kernel::dot;
use crate::dynamics::series::Constants;
use crate::scene::Decimal;

impl<T: Constants<Constant = T> + Over<T> + Decimal> ExactMechanism<T> {
    /// What is left of every constraint equation, and its rate, at a time; adds its Jacobian to `jacobian`
    /// (rows × n).
    pub fn residuals(&self, t: T::Time, phi: &[T], omega: &[T], jacobian: &mut [T]) -> Vec<[T; 2]> {
        let (z, n) = (self.elements(phi), phi.len());
        let rows = self.constraints.iter().zip(jacobian.chunks_exact_mut(n.max(1)));
        rows.map(|(row, jacobian)| {
            let measured = row.measure.value(phi, &z);
            row.measure.slopes(&z, |k, slope| jacobian[k] += slope);
            let phase = row.law.as_ref().map(|law| (T::law_value(law, t), T::phase(law, t).rate));
            let (mut wanted, mut rate) = phase.unwrap_or((T::ZERO, T::ZERO));
            if let Some(aim) = &row.aim {
                aim.at(T::moment(t), ConstraintArguments { phi, z: &z, omega }, |slots| {
                    let slot = |slot: Slot| slots[slot as usize];
                    (wanted, rate) = (wanted + slot(aim.value), rate + slot(aim.drive));
                    aim.slopes.iter().for_each(|&(k, slope)| jacobian[k] -= slot(slope));
                });
            }
            [whole_turns_off(measured - wanted, row.is_angle()), dot(jacobian, omega) - rate]
        })
        .collect()
    }
}

#[cfg(feature = "digits")]
impl<C: Decimal + Over<C>> ExactMechanism<C> {
    /// The rows that are in force and were not in force of this mechanism before.
    pub fn closing(&self, before: &Self) -> Vec<usize> {
        let rows = before.structure.constraints.iter().zip(&self.structure.constraints).enumerate();
        rows.filter(|(_, (before, now))| before.is_released(now)).map(|(r, _)| r).collect()
    }

    /// What acts after an event at a time, coordinates and rates.
    pub fn after(&self, event: usize, t: C, phi: &[C], omega: &[C]) -> Acting<C> {
        let mut next = self.acting.clone();
        let Some(laws) = &self.laws else { return next };
        let z = self.elements(phi);
        let at = Values { time: t, phi, z: &z, omega };
        let Acting { parameters, modes, .. } = &self.acting;
        next.parameters = laws.set_exactly_by(event, &Configuration::new(&at), parameters, modes);
        let FormulaEvent { on, off, .. } = &laws.events[event];
        next.off.retain(|part| !on.contains(part));
        next.off.extend(off.iter().filter(|part| !self.acting.off.contains(part)).cloned());
        next
    }
}

/// An angle less the whole turns nearest to it.
fn whole_turns_off<T: Scalar + Real>(residual: T, is_angle: bool) -> T {
    let turns = (residual.value() / std::f64::consts::TAU).round();
    if !is_angle || turns == 0.0 || !turns.is_finite() {
        return residual;
    }
    residual - T::ONE.atan2(T::ZERO).scale(4.0 * turns)
}
