//! Parts that events let act or rest: motors, locks and joints are released and put back.

use super::{CompileError, Mechanism, Switches};
use crate::dynamics::constraint::Measure;
use crate::dynamics::quadratic::Quadratic;
use crate::scene::Scene;

impl Mechanism {
    /// The mechanism without some of its springs, torsion springs, applied forces, torques, motors, locks and
    /// walls, and with some of its hinges released, by name; these must be closed by rows.
    ///
    /// # Errors
    /// A name that none of them has.
    pub fn without(&self, parts: &[String]) -> Result<Self, String> {
        let names = (self.springs.iter().map(|part| &part.name))
            .chain(self.torsions.iter().map(|part| &part.name))
            .chain(self.actions.iter().map(|part| &part.name))
            .chain(self.forces.iter().map(|part| &part.name))
            .chain(self.joints.iter().filter(|joint| joint.outer.is_none()).map(|joint| &joint.name))
            .chain(self.contacts.iter().map(|contact| &contact.row.name))
            .chain(self.switched_angles().map(|r| &self.constraints[r].name));
        let names: Vec<&String> = names.collect();
        if let Some(unknown) = parts.iter().find(|part| !names.contains(part)) {
            return Err(unknown.clone());
        }
        let mut mechanism = self.clone();
        mechanism.keeps_work |= self.is_worked_on();
        mechanism.springs.retain(|part| !parts.contains(&part.name));
        mechanism.torsions.retain(|part| !parts.contains(&part.name));
        mechanism.actions.retain(|part| !parts.contains(&part.name));
        mechanism.forces.retain(|part| !parts.contains(&part.name));
        for contact in &mut mechanism.contacts {
            contact.is_off |= parts.contains(&contact.row.name);
        }
        mechanism.release(|name| parts.contains(name));
        Ok(mechanism)
    }

    /// The mechanism with motors and locks, by row number, going on so much further than they said \[rad,
    /// m\].
    pub(crate) fn shifted(&self, shifts: &[(usize, f64)]) -> Self {
        let mut mechanism = self.clone();
        for &(row, by) in shifts {
            if let Some(law) = mechanism.constraints.get_mut(row).and_then(|row| row.law.as_mut()) {
                law.start += by;
            }
        }
        mechanism
    }

    /// The mechanism with other values of the scene's parameters in the laws of the forces that act.
    ///
    /// # Errors
    /// A law that cannot be compiled with them.
    pub(crate) fn with_parameters(&self, parameters: Vec<f64>) -> Result<Self, CompileError> {
        let mut mechanism = self.clone();
        if let Some(laws) = &mut mechanism.laws {
            for force in laws.formulas.record(&parameters, &laws.modes)? {
                if let Some(acting) = mechanism.forces.iter_mut().find(|acting| acting.name == force.name) {
                    *acting = force;
                }
            }
            laws.parameters = parameters;
        }
        Ok(mechanism)
    }

    /// The mechanism with all its parts, whatever acts at the start.
    pub(crate) fn with_all_parts(&self) -> &Self {
        self.whole.as_ref().map_or(self, |(whole, _)| whole)
    }

    /// Releases motors, locks, and joints that are closed by rows: the rows stay in their places, and
    /// constrain nothing any more.  False where there are none.
    pub(super) fn release(&mut self, is_released: impl Fn(&String) -> bool) -> bool {
        let motors: Vec<usize> =
            self.switched_angles().filter(|&r| is_released(&self.constraints[r].name)).collect();
        let joints = self.joints.iter_mut().filter(|joint| is_released(&joint.name));
        let pins = joints.filter_map(|joint| joint.row.take()).flat_map(|row| [row, row + 1]);
        let rows: Vec<usize> = motors.into_iter().chain(pins).collect();
        for &r in &rows {
            let angles = self.bodies.len();
            let row = &mut self.constraints[r];
            row.measure = Measure::Place(Quadratic { angles, ..Quadratic::default() });
            (row.law, row.push, row.aim) = (None, None, None);
            // As those that depend on others, they say nothing of the position.
            self.assembly.redundant.push(row.name.clone());
            self.recursion = None;
        }
        !rows.is_empty()
    }

    /// Puts back what was released, as `before` has it.
    pub(super) fn put_back(&mut self, before: &Self) {
        for (row, before) in self.constraints.iter_mut().zip(&before.constraints) {
            if row.coordinates().is_empty() && !before.coordinates().is_empty() {
                self.assembly.redundant.retain(|name| *name != row.name);
                row.clone_from(before);
            }
        }
        for (joint, before) in self.joints.iter_mut().zip(&before.joints) {
            joint.row = before.row;
        }
    }

    /// The rows of motors and locks that events switch; those of others may be eliminated.
    pub(super) fn switched_angles(&self) -> impl Iterator<Item = usize> {
        let is_switched = |r: &usize| {
            (self.is_motor(*r) || self.constraints[*r].is_angle())
                && self.may_be_off(&self.constraints[*r].name)
        };
        (0..self.constraints.len()).filter(is_switched)
    }

    /// True where the part of that name does not act at the start, or events switch it.
    pub fn may_be_off(&self, name: &str) -> bool {
        self.switches.parts.iter().any(|part| part == name)
    }
}

impl Switches {
    pub(super) fn of(scene: &Scene) -> Self {
        let switched = scene.events.iter().flat_map(|event| event.off.iter().chain(&event.on));
        let mut parts: Vec<String> = scene.inactive.iter().chain(switched).cloned().collect();
        parts.sort_unstable();
        parts.dedup();
        let clutches = (scene.motors.iter().map(|motor| &motor.name))
            .chain(scene.drives.iter().map(|drive| &drive.name))
            .chain(scene.locks.iter().filter(|lock| lock.angle.is_none()).map(|lock| &lock.name));
        Self { clutches: clutches.filter(|name| parts.contains(name)).cloned().collect(), parts }
    }
}
