//! Small differences through an impact, or an event that switches parts and branches, by the saltation matrix.
//!
//! ```text
//! dt = -(g_q dq + g_w dw + g_p dp) / g',     dq = dq⁻ + q'⁻ dt,   dw = dw⁻ + a⁻ dt      at the zero of g;      w⁺ = I(t, q, w⁻; p)
//! dq⁺ = dq - q'⁺ dt,      dw⁺ = dI(dt, dq, dw, dp) - a⁺ dt                               a⁺ with what acts and is held from then on
//! ```
//!
//! Derivatives of g and I along a column are central differences of the fourth order.
//!
//! Source: P. C. Müller, *Calculation of Lyapunov exponents for dynamic systems with discontinuities*, Chaos,
//! Solitons & Fractals 5 (1995).

use super::super::contact::{Jump, Switch, check_alone};
use super::super::event::SwitchFunction;
use super::neighbours::Neighbour;
use super::variation::{Crossing, Variation, plain};
use crate::dynamics::constraint::Posture;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion, Time};
use std::sync::Arc;

/// Normal velocity over that of the point's parts below which a wall is grazed, and neighbours may miss it.
const GRAZED: f64 = 1e-7;
/// Half of the longest difference, over the size of what it changes.
const DIFFERENCE: f64 = 1e-3;
/// Share of the approach that a difference may take off.
const SHARE: f64 = 0.05;
/// Offsets and weights of a derivative of the fourth order.
const STENCIL: [[f64; 2]; 4] = [[-2.0, 1.0 / 12.0], [-1.0, -2.0 / 3.0], [1.0, 2.0 / 3.0], [2.0, -1.0 / 12.0]];

/// A function of time, coordinates and rates.
pub(super) type Function<'a> = &'a mut dyn FnMut(Time, &[f64], &[f64]) -> Option<Vec<f64>>;

/// A state in plain doubles, with its accelerations.
pub(super) struct Side {
    pub t: Time,
    pub phi: Vec<f64>,
    pub omega: Vec<f64>,
    pub acceleration: Vec<f64>,
}

impl Side {
    pub fn new(mechanism: &Mechanism, motion: &Motion) -> Self {
        let (t, phi, omega) = plain(motion);
        let mut kernel = Kernel::<f64>::new(mechanism);
        kernel.accelerate::<0>(mechanism, t, &phi, &omega, Bias::default());
        Self { t, acceleration: kernel.load, phi, omega }
    }

    /// The direction of the motion itself: rates, then accelerations.
    pub fn ahead(&self) -> Vec<f64> {
        [&self.omega[..], &self.acceleration[..]].concat()
    }

    /// The derivative of a function of time, coordinates and rates along a column, and time with it.
    pub fn slope(&self, column: &[f64], late: f64, share: f64, value: Function) -> Option<Vec<f64>> {
        let n = self.phi.len();
        let size = |of: &[f64], from: &[f64]| {
            of.iter().zip(from).fold(0.0, |most: f64, (x, y)| most.max(x.abs() / (1.0 + y.abs())))
        };
        let most = size(&column[..n], &self.phi).max(size(&column[n..], &self.omega)).max(late.abs());
        let h = if most > 0.0 { DIFFERENCE.min(share) / most } else { 1.0 };
        let mut sum: Vec<f64> = Vec::new();
        for [offset, weight] in STENCIL {
            let moved = |from: &[f64], by: &[f64]| {
                from.iter().zip(by).map(|(x, y)| x + offset * h * y).collect::<Vec<f64>>()
            };
            let t = self.t + offset * h * late;
            let values = value(t, &moved(&self.phi, &column[..n]), &moved(&self.omega, &column[n..]))?;
            sum.resize(values.len(), 0.0);
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight / h * value);
        }
        Some(sum)
    }
}

impl Variation {
    /// Takes the columns through what happens at one moment.
    pub(super) fn cross(&mut self, jumps: &[Jump]) -> Result<(), String> {
        let [.., last] = jumps else { return Ok(()) };
        if !last.mechanism.held.is_empty() {
            return Err("a point comes to rest on its wall, which small differences do not follow".into());
        }
        check_alone(jumps)?;
        let (mut off, mut is_other) = (None, false);
        for jump in jumps {
            off = jump.switch.as_ref().map(|switch| switch.off.clone()).or(off);
            is_other |= !Arc::ptr_eq(&jump.mechanism, &self.mechanism);
        }
        let cause = jumps.iter().find(|jump| jump.contact.is_some() || jump.switch.is_some());
        if let Some(cause) = cause {
            let here = Side::new(&self.mechanism, &cause.before);
            let there = Side::new(&last.mechanism, &last.after);
            let late = match (&cause.contact, &cause.switch) {
                (Some(contact), _) => self.late_at_wall(*contact, &here)?,
                (None, Some(switch)) => self.late_at_switch(switch, &cause.before, &here)?,
                (None, None) => return Ok(()),
            };
            for (k, &late) in late.iter().enumerate() {
                shift(&mut self.columns[k], late, &here);
                for jump in jumps {
                    if let Some(contact) = jump.contact {
                        self.strike(k, contact, late, jump)?;
                    }
                }
                shift(&mut self.columns[k], -late, &there);
            }
            if let Some(contact) = cause.contact {
                let wall = self.mechanism.contacts[contact].row.name.clone();
                self.impacts.push(Crossing { wall, t: cause.before.time.hi, slopes: late });
            }
        }
        if is_other {
            self.expanded = None;
            if let Some(off) = off {
                self.off = off;
            }
            for neighbours in self.neighbours.iter_mut().flatten() {
                neighbours.follow(&last.mechanism, &self.off)?;
            }
            self.hold(&last.mechanism);
        }
        self.keep(&last.after);
        Ok(())
    }

    /// How much later a point meets its wall, column by column.
    fn late_at_wall(&self, contact: usize, here: &Side) -> Result<Vec<f64>, String> {
        let n = here.phi.len();
        let touched = &self.mechanism.contacts[contact];
        let mut gradient = vec![0.0; n];
        let z = self.mechanism.elements(&here.phi);
        let at = Posture { phi: &here.phi, z: &z, omega: &here.omega };
        touched.row.linearise(here.t, at, &mut gradient);
        let approach = dot(&gradient, &here.omega);
        if approach >= -GRAZED * touched.step_size(&here.omega) {
            return Err("a point grazes a wall, which neighbouring motions may miss".into());
        }
        let moved = |neighbour: &Neighbour| {
            let z = neighbour.mechanism.elements(&here.phi);
            neighbour.weight * neighbour.mechanism.contacts[contact].row.gap(&z)
        };
        let late = |(column, neighbours): (&Vec<f64>, &Option<super::Neighbours>)| {
            let list = neighbours.iter().flat_map(|neighbours| &neighbours.list);
            -(dot(&gradient, &column[..n]) + list.map(moved).sum::<f64>()) / approach
        };
        Ok(self.columns.iter().zip(&self.neighbours).map(late).collect())
    }

    /// The rates of a column after an impact.
    fn strike(&mut self, k: usize, contact: usize, late: f64, jump: &Jump) -> Result<(), String> {
        let (t, phi, omega) = plain(&jump.before);
        let n = phi.len();
        let mechanism = Arc::clone(&self.mechanism);
        let strike = |mechanism: &Mechanism, t: Time, phi: &[f64], omega: &[f64]| {
            mechanism.impact_at(contact, t, phi, omega).map(|impact| impact.omega)
        };
        let touched = &mechanism.contacts[contact];
        let along = |phi: &[f64], omega: &[f64]| {
            touched.normal.dot(touched.point.velocity(&mechanism.elements(phi), omega))
        };
        let column = &mut self.columns[k];
        let side = Side { t, acceleration: Vec::new(), phi, omega };
        // Neighbours must meet the wall as well.
        let most = column.iter().fold(late.abs(), |most, entry| most.max(entry.abs()));
        let scale = |entry: f64| if most > 0.0 { entry / most } else { 0.0 };
        let unit: Vec<f64> = column.iter().map(|&entry| scale(entry)).collect();
        let faster = side
            .slope(&unit, 0.0, f64::INFINITY, &mut |_, phi, omega| Some(vec![along(phi, omega)]))
            .map_or(0.0, |slope| slope[0].abs());
        let size = 1.0 + side.omega.iter().fold(0.0, |most: f64, omega| most.max(omega.abs()));
        let share = SHARE * along(&side.phi, &side.omega).abs() / (faster * size).max(f64::MIN_POSITIVE);
        let no_way = || "neighbouring motions have no way back from a wall".to_owned();
        let mut after = side
            .slope(column, late, share, &mut |t, phi, omega| strike(&mechanism, t, phi, omega))
            .ok_or_else(no_way)?;
        for neighbour in self.neighbours[k].iter().flat_map(|neighbours| &neighbours.list) {
            let omega = strike(&neighbour.mechanism, t, &side.phi, &side.omega).ok_or_else(no_way)?;
            after.iter_mut().zip(omega).for_each(|(sum, omega)| *sum += neighbour.weight * omega);
        }
        column[n..].copy_from_slice(&after);
        Ok(())
    }

    /// How much later an event happens, column by column.
    fn late_at_switch(&self, switch: &Switch, motion: &Motion, here: &Side) -> Result<Vec<f64>, String> {
        if !(switch.keeps_motion && switch.keeps_parameters) {
            return Err(
                "an event sets parameters or the motion, which small differences do not follow".into()
            );
        }
        let n = here.phi.len();
        let value = |mechanism: &Mechanism, t: Time, phi: &[f64], omega: &[f64]| {
            event_value(mechanism, switch.at, &moved(motion, t, phi, omega))
        };
        let base = &*self.mechanism;
        let along = |column: &[f64], late: f64| {
            here.slope(column, late, f64::INFINITY, &mut |t, phi, omega| {
                Some(vec![value(base, t, phi, omega)?])
            })
            .map(|slope| slope[0])
        };
        let unknown =
            || "an event from outside changes the run, which small differences do not follow".to_owned();
        let rate = along(&here.ahead(), 1.0).ok_or_else(unknown)?;
        if rate == 0.0 || !rate.is_finite() {
            return Err("an event function only touches zero, which neighbouring motions may miss".into());
        }
        let mut late = Vec::new();
        for (column, neighbours) in self.columns.iter().zip(&self.neighbours) {
            let mut change = along(&column[..2 * n], 0.0).ok_or_else(unknown)?;
            for neighbour in neighbours.iter().flat_map(|neighbours| &neighbours.list) {
                let value = value(&neighbour.mechanism, here.t, &here.phi, &here.omega);
                change += neighbour.weight * value.ok_or_else(unknown)?;
            }
            late.push(-change / rate);
        }
        Ok(late)
    }
}

/// Takes a column to a moment so much later.
fn shift(column: &mut [f64], late: f64, side: &Side) {
    let n = side.phi.len();
    for k in 0..n {
        column[k] += late * side.omega[k];
        column[n + k] += late * side.acceleration[k];
    }
}

/// A motion at other coordinates and rates.
pub(super) fn moved(motion: &Motion, t: Time, phi: &[f64], omega: &[f64]) -> Motion {
    let all = |from: &[f64]| from.iter().map(|&x| crate::arithmetic::DoubleDouble::from(x)).collect();
    Motion { time: t, phi: all(phi), omega: all(omega), ..motion.clone() }
}

/// The event function of a mechanism's own event or condition at a motion.
pub(super) fn event_value(mechanism: &Mechanism, at: SwitchFunction, motion: &Motion) -> Option<f64> {
    let laws = mechanism.laws.as_ref()?;
    mechanism.seen(motion, |here| match at {
        SwitchFunction::Event(number) => Some(laws.formulas.event_value(number, here, &laws.parameters)),
        SwitchFunction::Condition(number) => {
            laws.formulas.condition_values(here, &laws.parameters, &laws.modes).get(number).copied()
        }
        SwitchFunction::Other => None,
    })
}
