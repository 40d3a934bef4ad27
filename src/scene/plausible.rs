//! What a scene says that is allowed, and yet is likely not meant: degrees, millimetres, points off a bar.

use super::formula::Formula;
use super::{Place, Scene, stays::places};
use std::f64::consts::TAU;

/// Most notes of one kind.
const MOST: usize = 3;
/// The weight of the Earth, and how far it may be off \[m/s²\].
const EARTH: [f64; 2] = [9.81, 0.1];
/// Bars of mechanisms on the Earth are shorter \[m\].
const LONG: f64 = 20.0;
/// A point on a bar's line may lie so far beyond its ends, in lengths.
const BEYOND: f64 = 0.02;
/// A point of a plate may lie so far off the line it is drawn by, in its lengths.
const PLATE: f64 = 10.0;

impl Scene {
    /// What is likely not meant, a sentence each.
    pub fn doubts(&self) -> Vec<String> {
        let mut doubts = self.degrees();
        doubts.extend(self.millimetres());
        doubts.extend(self.points_off_bars());
        doubts.extend(self.constant_events());
        doubts
    }

    /// Events whose function is a number.
    fn constant_events(&self) -> Vec<String> {
        let is_number = |when: &str| Formula::parse(when).is_ok_and(|when| when.names().next().is_none());
        let events = self.events.iter().filter(|event| is_number(&event.when)).take(MOST);
        events.map(|event| format!("event `{}` never happens: its `when` is a number", event.name)).collect()
    }

    /// Angles of more than a turn that are whole numbers, as degrees are.
    fn degrees(&self) -> Vec<String> {
        let starts = (self.bars.iter().zip(&self.start).enumerate())
            .filter(|(bar, _)| self.given.get(*bar).is_none_or(|given| given.phi))
            .filter(|(bar, _)| self.motors.iter().all(|motor| motor.bar != *bar))
            .map(|(_, (bar, start))| (format!("start.{}.phi", bar.name), start.phi));
        let motors =
            self.motors.iter().map(|motor| (format!("motors.{}.law.start", motor.name), motor.law.start));
        let locks =
            self.locks.iter().filter_map(|lock| Some((format!("locks.{}.angle", lock.name), lock.angle?)));
        let coils = self
            .torsion_springs
            .iter()
            .map(|spring| (format!("torsion_springs.{}.free_angle", spring.name), spring.free_angle));
        let looks =
            |(_, angle): &(String, f64)| angle.abs() > TAU && angle.fract() == 0.0 && angle.abs() <= 720.0;
        (starts.chain(motors).chain(locks).chain(coils).filter(looks).take(MOST))
            .map(|(path, angle)| {
                format!(
                    "{path} is {angle} rad, {:.1} turns; if degrees are meant, write \"{angle}*pi/180\" or \
                        {:.6}",
                    angle / TAU,
                    angle.to_radians()
                )
            })
            .collect()
    }

    /// Bars of tens of metres under the Earth's weight.
    fn millimetres(&self) -> Option<String> {
        let [weight, off] = EARTH;
        let is_earth = (self.gravity[0].hypot(self.gravity[1]) - weight).abs() < off;
        let longest = self.bars.iter().max_by(|a, b| a.length.total_cmp(&b.length))?;
        (is_earth && longest.length > LONG).then(|| {
            format!(
                "bar {} is {} m long; lengths are in m, so that {} mm are {}",
                longest.name,
                longest.length,
                longest.length,
                longest.length / 1000.0
            )
        })
    }

    /// Points off the bar they are on: beyond its ends on its line, or farther away than it is long; of
    /// plates only those much farther away.
    fn points_off_bars(&self) -> Vec<String> {
        let off = |(path, place): (String, Place)| {
            let bar = &self.bars[place.bar?];
            let [x, y] = place.point;
            let beyond = (x - bar.length).max(-x).max(0.0);
            let is_plain = bar.centre == [0.5 * bar.length, 0.0];
            let allowed = bar.length
                * match (is_plain, y == 0.0) {
                    (true, true) => BEYOND,
                    (true, false) => 1.0,
                    (false, _) => PLATE,
                };
            (beyond.hypot(y) > allowed).then(|| {
                format!(
                    "{path} = [{x}, {y}] lies off bar {}, which is drawn from [0, 0] to [{}, 0]",
                    bar.name, bar.length
                )
            })
        };
        places(self).into_iter().filter_map(off).take(MOST).collect()
    }
}
