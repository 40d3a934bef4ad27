//! Start rates of what rests under dry friction.
//!
//! Where a number moves the rate of a place that is at rest at the start, neighbouring motions slide there at
//! once, in one sense for larger values of it and in the other one for smaller values.
//!
//! A place that sticks stops them after a time and way of the first and second order.  Rates change by
//! M⁻¹ Gᵀ y, with y the impulses of the rows less those of the motion itself, and no row of what sticks moves
//! in the end: y follows from that alone, whatever the sense, and columns lose their rates there as they are
//! put onto the constraints.  Where a place slides off from rest, or a point that rests on a wall would leave
//! it while they slide, friction takes different amounts off both, and there is no derivative.  Where nothing
//! presses the neighbours go on sliding without friction: the place is open beside the motion, which it
//! neither holds nor moves.

use super::variation::{Variation, plain};
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::friction::FrictionMode;
use crate::dynamics::friction::evidence::NO_SPEED;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion, Time};
use std::sync::Arc;

/// Rate of a place over what moves it, and over the mechanism's own for a change of a coordinate by one, that
/// is rounding.
const NO_RATE: f64 = 1e-7;
/// Change of a coordinate or rate by which that rate is told.
const CHANGE: f64 = 1e-5;
/// Velocity of a place, over the mechanism's own, at which it is looked for what friction does, and what that
/// may be over the mechanism's own acceleration.
const SPEED: f64 = 1e-6;
const NO_FRICTION: f64 = 1e-9;

/// The relative velocity of a place, and the sum of the magnitudes of its parts.
fn velocity(mechanism: &Mechanism, place: usize, t: Time, [phi, omega]: [&[f64]; 2]) -> [f64; 2] {
    let row = gradient(mechanism, place, t, [phi, omega]);
    [dot(&row, omega), row.iter().zip(omega).map(|(d, omega)| (d * omega).abs()).sum()]
}

fn gradient(mechanism: &Mechanism, place: usize, t: Time, [phi, omega]: [&[f64]; 2]) -> Vec<f64> {
    let (z, mut row) = (mechanism.elements(phi), vec![0.0; phi.len()]);
    mechanism.frictions[place].tangent.differentiate(t, ConstraintArguments { phi, z: &z, omega }, &mut row);
    row
}

/// What friction of a place adds to its acceleration where it slides, over the mechanism's own.
fn friction(mechanism: &Mechanism, place: usize, t: Time, [phi, omega]: [&[f64]; 2], sign: f64) -> f64 {
    let row = gradient(mechanism, place, t, [phi, omega]);
    let along = |mode: FrictionMode| {
        let mut modes = mechanism.modes.clone();
        modes[place] = mode;
        let mechanism = mechanism.moving(&mechanism.held, &modes);
        let mut kernel = Kernel::<f64>::new(&mechanism);
        kernel.accelerations(&mechanism, t, phi, omega, Bias::default());
        dot(&row, &kernel.load)
    };
    let unit = mechanism.speed_unit(place) / mechanism.units.time;
    (along(FrictionMode::Slip(sign)) - along(FrictionMode::Open)).abs() / unit
}

/// True where every point that rests on a wall is pressed onto it.
fn rests(mechanism: &Mechanism, t: Time, [phi, omega]: [&[f64]; 2]) -> bool {
    let mut kernel = Kernel::<f64>::new(mechanism);
    kernel.accelerations(mechanism, t, phi, omega, Bias::default());
    let multipliers = &kernel.multiplier[mechanism.standing_rows()..];
    mechanism.held.iter().zip(multipliers).all(|(&held, &row)| mechanism.contacts[held].pressure(row) > 0.0)
}

/// Rates of the places at rest along a column, zero where they are rounding or a place is not at rest.
fn rates(mechanism: &Mechanism, motion: &Motion, column: &[f64]) -> Vec<f64> {
    let (t, phi, omega) = plain(motion);
    let n = phi.len();
    let most = column.iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
    let moved = |by: f64| -> [Vec<f64>; 2] {
        let along = |values: &[f64], entries: &[f64]| {
            values.iter().zip(entries).map(|(value, entry)| value + by * entry).collect()
        };
        [along(&phi, &column[..n]), along(&omega, &column[n..])]
    };
    let of_place = |place: usize| {
        let unit = mechanism.speed_unit(place);
        let [speed, parts] = velocity(mechanism, place, t, [&phi, &omega]);
        let is_at_rest = match mechanism.modes[place] {
            FrictionMode::Stick(_) => true,
            FrictionMode::Slip(_) => speed.abs() <= NO_SPEED * parts.max(unit),
            _ => false,
        };
        if !is_at_rest || most == 0.0 {
            return 0.0;
        }
        let change = CHANGE / most;
        let [after, before] = [change, -change].map(|by| {
            let [phi, omega] = moved(by);
            velocity(mechanism, place, t, [&phi, &omega])[0]
        });
        let rate = (after - before) / (2.0 * change);
        let moves = velocity(mechanism, place, t, [&phi, &column[n..]])[1];
        let turns = column[..n].iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
        if rate.abs() > NO_RATE * (moves + turns * unit) { rate } else { 0.0 }
    };
    (0..mechanism.frictions.len()).map(of_place).collect()
}

/// The place at rest at which friction resists these rates of places without bringing them back to rest
/// whatever their sense, by number.
fn resisting(mechanism: &Mechanism, motion: &Motion, column: &[f64], rates: &[f64]) -> Option<usize> {
    let (t, phi, omega) = plain(motion);
    let n = phi.len();
    let slides = |sign: f64| {
        let mode = |(mode, rate): (&FrictionMode, &f64)| match rate {
            0.0 => *mode,
            rate => FrictionMode::Slip(sign * rate.signum()),
        };
        let modes: Vec<_> = mechanism.modes.iter().zip(rates).map(mode).collect();
        mechanism.moving(&mechanism.held, &modes)
    };
    let resists = |&place: &usize| {
        [1.0, -1.0].into_iter().any(|sign| {
            let by = sign * SPEED * mechanism.speed_unit(place) / rates[place].abs();
            let omega: Vec<f64> = omega.iter().zip(&column[n..]).map(|(w, entry)| w + by * entry).collect();
            let (sliding, sense) = (slides(sign), sign * rates[place].signum());
            let stops = matches!(mechanism.modes[place], FrictionMode::Stick(_))
                && rests(&sliding, t, [&phi, &omega]);
            !stops && friction(&sliding, place, t, [&phi, &omega], sense) > NO_FRICTION
        })
    };
    (0..rates.len()).filter(|&place| rates[place] != 0.0).find(resists)
}

impl Variation {
    /// Takes out of force beside the motion, which begins so beside this mechanism, what sticks without a
    /// load where columns, each that of a number, move it.
    ///
    /// Where there is a load they lose these rates, or there is no derivative.
    pub fn loosen(&mut self, mechanism: &Arc<Mechanism>, motion: &Motion, numbers: &[&str]) {
        for (column, number) in self.columns.clone().iter().zip(numbers) {
            let rates = rates(mechanism, motion, column);
            if let Some(place) = resisting(mechanism, motion, column, &rates) {
                let name = &mechanism.frictions[place].name;
                return self.lose(&format!(
                    "no derivative by {number}: {name} is at rest under dry friction, which takes other \
                        amounts off neighbouring starts in one sense than in the other one"
                ));
            }
            let sticks = |place: &usize| matches!(mechanism.modes[*place], FrictionMode::Stick(_));
            let is_loose = |&place: &usize| {
                let (t, phi, omega) = plain(motion);
                friction(mechanism, place, t, [&phi, &omega], 1.0) <= NO_FRICTION
            };
            let moved = (0..rates.len()).filter(|&place| rates[place] != 0.0);
            self.loose.extend(moved.filter(sticks).filter(is_loose));
        }
    }

    /// A mechanism in which what is out of force beside the motion does not stick.
    pub(super) fn loosened(&self, mechanism: &Arc<Mechanism>) -> Arc<Mechanism> {
        if self.loose.is_empty() {
            return Arc::clone(mechanism);
        }
        let mode = |(place, mode): (usize, &FrictionMode)| match mode {
            FrictionMode::Stick(_) if self.loose.contains(&place) => FrictionMode::Open,
            mode => *mode,
        };
        let modes: Vec<_> = mechanism.modes.iter().enumerate().map(mode).collect();
        Arc::new(mechanism.moving(&mechanism.held, &modes))
    }

    /// Ends the columns where what is out of force beside the motion has got a load.
    pub(super) fn watch_loose(&mut self, motion: &Motion) {
        let (t, phi, omega) = plain(motion);
        let is_loaded = |&&place: &&usize| {
            let is_open = self.mechanism.modes[place] == FrictionMode::Open;
            is_open && friction(&self.mechanism, place, t, [&phi, &omega], 1.0) > NO_FRICTION
        };
        if let Some(&place) = self.loose.iter().find(is_loaded) {
            let name = self.mechanism.frictions[place].name.clone();
            self.lose(&format!("{name} sticks, and neighbouring motions slide there until it has a load"));
        }
    }
}
