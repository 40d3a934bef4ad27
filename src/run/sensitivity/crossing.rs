//! Columns of a variation through impacts, events and the transitions of dry friction: see
//! [`saltation`](crate::run::saltation).

use super::neighbours::Neighbours;
use super::variation::{CrossingTime, Variation};
use crate::dynamics::{Mechanism, Motion};
use crate::run::contact::Jump;
use crate::run::event::SwitchFunction;
use crate::run::saltation::{Crossed, Delta, Discontinuity, Levels, Side, cross, engage, event_value};
use std::sync::Arc;

/// Parameters that events set, in which the columns may differ.
#[derive(Clone, Debug, Default)]
pub(in crate::run) struct SetNumbers {
    /// By number.
    pub numbers: Vec<usize>,
    /// Which of them an event has set so far: the others have the values of the scene.
    pub is_set: Vec<bool>,
    /// Their derivatives, column by column.
    pub slopes: Vec<Vec<f64>>,
}

impl SetNumbers {
    /// Those that were set, by number.
    fn known(&self) -> Vec<usize> {
        let known = self.numbers.iter().zip(&self.is_set).filter(|(_, is_set)| **is_set);
        known.map(|(&number, _)| number).collect()
    }

    /// Takes what an event of a mechanism has set.
    fn take(&mut self, mechanism: &Mechanism, event: usize, slopes: Vec<Vec<f64>>) {
        let events = mechanism.laws.as_ref().map(|laws| &laws.formulas.events);
        for number in events.iter().flat_map(|events| events[event].parameters()) {
            if let Ok(place) = self.numbers.binary_search(&number) {
                self.is_set[place] = true;
            }
        }
        let is_set = &self.is_set;
        let known = |column: Vec<f64>| -> Vec<f64> {
            column.into_iter().zip(is_set).map(|(slope, is_set)| if *is_set { slope } else { 0.0 }).collect()
        };
        self.slopes = slopes.into_iter().map(known).collect();
    }

    /// Parameters with their derivatives along a column, where there are such.
    fn of(&self, column: usize) -> Vec<(usize, f64)> {
        let slopes = self.slopes.get(column).map_or(&[][..], Vec::as_slice);
        let given = self.numbers.iter().zip(slopes).filter(|(_, slope)| **slope != 0.0);
        given.map(|(&number, &slope)| (number, slope)).collect()
    }

    /// True where columns differ in them.
    pub fn differ(&self) -> bool {
        self.slopes.iter().flatten().any(|slope| *slope != 0.0)
    }
}

impl Variation {
    /// Takes the columns through what happens at one moment.
    pub(super) fn cross(&mut self, jumps: &[Jump]) -> Result<(), String> {
        let [.., last] = jumps else { return Ok(()) };
        let passed = self.passed(jumps)?;
        let before = Arc::clone(&self.mechanism);
        self.met_several |= passed.walls.len() > 1;
        if let Some(dissipation) = &mut self.dissipation {
            let restitutions = passed.walls.iter().map(|(wall, _)| before.contacts[*wall].restitution);
            dissipation.total += restitutions.map(|e| 2.0 * libm::log(e)).sum::<f64>();
            dissipation.total += expansion(&before, jumps);
        }
        let t = last.before.time.hi;
        if jumps[0].before.omega != last.after.omega && !passed.late.is_empty() {
            self.jumped.push((t, passed.late));
        }
        let crossing = |(wall, slopes): (usize, Vec<f64>)| {
            let wall = before.contacts[wall].row.name.clone();
            CrossingTime { wall, t, slopes }
        };
        self.impacts.extend(passed.walls.into_iter().map(crossing));
        if let (Some(event), Some(slopes)) = (set_by(jumps), passed.set) {
            self.set.take(&before, event, slopes);
        }
        if jumps.iter().any(|jump| !Arc::ptr_eq(&jump.mechanism, &before)) {
            self.expanded = None;
            if let Some(off) = off(jumps) {
                self.off = off;
            }
            let now = self.loosened(&last.mechanism);
            self.follow(&now)?;
            engage(&mut self.engaged, [&before, &now]);
            self.hold(&now);
        }
        self.keep(&last.after);
        Ok(())
    }

    /// What comes of it, with the columns taken through.
    fn passed(&mut self, jumps: &[Jump]) -> Result<Crossed, String> {
        let mut columns = std::mem::take(&mut self.columns);
        let follow = |k: usize, jump: &Jump| -> Result<Levels, String> {
            let mut beside = self.neighbours[k].clone().unwrap_or_default();
            let off = off(jumps).unwrap_or_else(|| self.off.clone());
            beside.follow(&jump.mechanism, &off, &self.set.known())?;
            Ok(beside.weighted())
        };
        let column = |(entries, neighbours): (_, &Option<Neighbours>)| {
            let neighbours = neighbours.as_ref().map_or_else(Vec::new, Neighbours::weighted);
            Delta { entries, neighbours }
        };
        let entries = columns.iter_mut().map(Vec::as_mut_slice);
        let mut list: Vec<Delta> = entries.zip(&self.neighbours).map(column).collect();
        let (mechanism, set) = (&self.mechanism, &self.set.numbers[..]);
        let moment = jumps.first().map(|jump| jump.before.time);
        let earlier = self.moment.as_ref().filter(|(at, _)| Some(*at) == moment).map(|(_, late)| &late[..]);
        let passed = cross(&Discontinuity { mechanism, jumps, set, follow: &follow, earlier }, &mut list);
        self.columns = columns;
        if let (Ok(passed), Some(moment)) = (&passed, moment)
            && !passed.late.is_empty()
        {
            self.moment = Some((moment, passed.late.clone()));
        }
        passed
    }

    /// Takes the neighbours on beside a mechanism, with the parameters that events have set.
    fn follow(&mut self, mechanism: &Mechanism) -> Result<(), String> {
        let known = self.set.known();
        for (k, neighbours) in self.neighbours.iter_mut().enumerate() {
            let given = self.set.of(k);
            if neighbours.is_none() && given.is_empty() {
                continue;
            }
            let neighbours = neighbours.get_or_insert_default();
            neighbours.set(&self.compiled, mechanism, &given);
            neighbours.follow(mechanism, &self.off, &known)?;
        }
        Ok(())
    }
}

/// ln of the volume of small differences after a switch over that before: that of the rates of the function
/// at whose zero forces change, which differ where it speaks of rates.
///
/// The saltation matrix is 1 + (f⁺ - f⁻) ∇gᵀ/g'⁻, whose determinant is g'⁺/g'⁻.
fn expansion(before: &Arc<Mechanism>, jumps: &[Jump]) -> f64 {
    let (Some(jump), Some(last)) = (jumps.iter().find(|jump| jump.switch.is_some()), jumps.last()) else {
        return 0.0;
    };
    let Some(switch) = jump.switch.as_ref().filter(|_| jump.before.omega == last.after.omega) else {
        return 0.0;
    };
    let rate = |side: Side| {
        let value = &mut |motion: &Motion| Some(vec![event_value(before, switch.at, motion)?]);
        side.slope(&side.ahead(), 1.0, f64::INFINITY, value).map(|rate| rate[0])
    };
    let [earlier, later] =
        [Side::new(before, &jump.before), Side::new(&last.mechanism, &last.after)].map(rate);
    match (earlier, later) {
        (Some(earlier), Some(later)) => libm::log((later / earlier).abs()),
        _ => 0.0,
    }
}

/// The event of the scene that sets something, by number.
fn set_by(jumps: &[Jump]) -> Option<usize> {
    jumps.iter().find_map(|jump| match jump.switch.as_ref()?.at {
        SwitchFunction::Event(number) => Some(number),
        _ => None,
    })
}

/// Parts that do not act after these, where an event says so.
fn off(jumps: &[Jump]) -> Option<Vec<String>> {
    jumps.iter().rev().find_map(|jump| jump.switch.as_ref().map(|switch| switch.off.clone()))
}
