//! Parts that events let act or rest: motors, locks and joints are released and put back.

use super::{CompileError, Laws, Mechanism, Switches};
use crate::dynamics::Motion;
use crate::dynamics::configuration::Configuration;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::scene::Scene;
use crate::scene::read::is_name;
use std::sync::Arc;

/// Branches of laws that are tried at the start.
const BRANCHES: usize = 8;
/// How far after the start it is looked which way conditions change by rates, and by accelerations, at rates
/// up to 1 \[s\].
const A_MOMENT: f64 = 1e-7;
const A_WHILE: f64 = 1e-5;

/// Conditions of which all combinations are tried; of more, each alone.
const COMBINED: usize = 8;

/// The branches on which laws are tried: all of few conditions; of many those where one condition differs
/// from what all are now, from all false and from all true.
fn branches(modes: &[bool]) -> Vec<Vec<bool>> {
    let n = modes.len();
    if n <= COMBINED {
        return (0..1_usize << n).map(|bits| (0..n).map(|k| bits >> k & 1 == 1).collect()).collect();
    }
    let mut all = vec![modes.to_vec(), vec![false; n], vec![true; n]];
    for base in all.clone() {
        all.extend((0..n).map(|k| {
            let mut modes = base.clone();
            modes[k] = !modes[k];
            modes
        }));
    }
    all
}

impl Mechanism {
    /// The name of a law that acts and has no potential of positions alone, on the present branches or on
    /// others.
    pub(crate) fn law_without_potential(&self) -> Option<&str> {
        let laws = self.laws.as_ref().filter(|laws| !laws.modes.is_empty())?;
        let acting = |name: &str| self.forces.iter().find(|force| force.name == name);
        branches(&laws.modes).into_iter().find_map(|modes| {
            let forces = laws.formulas.record(&laws.parameters, &modes).ok()?;
            let mut without = forces.iter().filter(|force| !force.is_potential_of_place());
            without.find_map(|force| acting(&force.name)).map(|force| force.name.as_str())
        })
    }

    /// The mechanism without some of its springs, torsion springs, applied forces, torques, motors, locks and
    /// walls, and with some of its hinges released, by name; these must be closed by rows.
    ///
    /// # Errors
    /// A name that none of them has.
    pub fn without(&self, parts: &[String]) -> Result<Self, String> {
        if let Some(unknown) = parts.iter().find(|part| !self.may_be_switched(part)) {
            return Err(unknown.clone());
        }
        let mut mechanism = self.clone();
        mechanism.keeps_work |= self.is_worked_on();
        mechanism.keeps_turns |= self.is_winding();
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

    /// True where a part of this name may be left out.
    pub(crate) fn may_be_switched(&self, part: &str) -> bool {
        let closed = self.joints.iter().filter(|joint| joint.outer.is_none()).map(|joint| &joint.name);
        let angles = self.switched_angles().map(|r| &self.constraints[r].name);
        self.acting_names().chain(closed).chain(angles).any(|name| name == part)
    }

    /// Names of springs, torsion springs, applied forces, torques and walls.
    fn acting_names(&self) -> impl Iterator<Item = &String> {
        (self.springs.iter().map(|part| &part.name))
            .chain(self.torsions.iter().map(|part| &part.name))
            .chain(self.actions.iter().map(|part| &part.name))
            .chain(self.forces.iter().map(|part| &part.name))
            .chain(self.contacts.iter().map(|contact| &contact.row.name))
    }

    /// Parts are switched by name: a force from outside that shares one, or that of a body, is refused.
    pub(super) fn check_names(&self) -> Result<(), CompileError> {
        let joints = self.joints.iter().map(|joint| &joint.name);
        let rows = self.constraints.iter().map(|row| &row.name);
        let held: Vec<&String> = joints.chain(rows).collect();
        let is_taken = |name: &String| {
            held.contains(&name)
                || self.bodies.iter().any(|body| body.name == *name)
                || self.site(name, [0.0; 2]).is_ok()
                || self.acting_names().filter(|other| *other == name).count() > 1
        };
        if let Some(force) = self.forces_from_outside().iter().find(|force| !is_name(&force.name)) {
            return Err(CompileError::NoName(force.name.clone()));
        }
        let taken = self.forces_from_outside().iter().find(|force| is_taken(&force.name));
        taken.map_or(Ok(()), |force| Err(CompileError::NameTaken(force.name.clone())))
    }

    /// The mechanism without the events of its scene, as it is before any of them.
    pub(crate) fn without_events(&self) -> Self {
        let mut mechanism = self.clone();
        if let Some(laws) = &mut mechanism.laws {
            Arc::make_mut(&mut laws.formulas).events.clear();
        }
        if let Some((whole, _)) = &mut mechanism.whole {
            *whole = Arc::new(whole.without_events());
        }
        mechanism
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

    /// Without the parts that do not act at the start.
    ///
    /// # Errors
    /// One of them is no part.
    pub(super) fn acting(self, inactive: &[String]) -> Result<Self, CompileError> {
        let unknown =
            |part| CompileError::Unsound(format!("inactive: no part that can be switched is `{part}`"));
        let mut acting = self.without(inactive).map_err(unknown)?;
        acting.whole = Some((Arc::new(self), inactive.to_vec()));
        Ok(acting)
    }

    /// Assembled with the laws of motors and walls on their branches at the start that is found.
    ///
    /// # Errors
    /// See [`Self::assembled`].
    pub(super) fn assembled_on_branches(self, scene: &Scene, kept: &[usize]) -> Result<Self, CompileError> {
        if !self.laws.as_ref().is_some_and(|laws| laws.formulas.drives() && !laws.modes.is_empty()) {
            return self.assembled(scene, kept);
        }
        let given = self.start_as_given(scene);
        let mut next = self.on_branches_after(&given, false)?.unwrap_or(self);
        for _ in 0..BRANCHES {
            let found = next.clone().assembled(scene, kept)?;
            match next.on_branches_after(&found.start(scene), false)? {
                Some(other) => next = other,
                None => return Ok(found),
            }
        }
        next.assembled(scene, kept)
    }

    /// The mechanism with its laws on their branches at a motion; `None` where they are on them.
    ///
    /// # Errors
    /// See [`Self::on_branch`].
    pub(crate) fn on_branches_of(&self, motion: &Motion) -> Result<Option<Self>, CompileError> {
        self.on(self.law_modes(motion))
    }

    /// The same for what comes after a motion, where conditions are zero at it: by its rates, and where
    /// `with_forces` by its accelerations on the branches at the motion as well.
    ///
    /// # Errors
    /// See [`Self::on_branch`].
    pub(super) fn on_branches_after(
        &self,
        motion: &Motion,
        with_forces: bool,
    ) -> Result<Option<Self>, CompileError> {
        let here = self.law_modes(motion);
        let zeros = self.laws_at(motion, |laws, at| laws.formulas.zeros(at, &laws.parameters, &here));
        let zeros = zeros.unwrap_or_default();
        if !zeros.contains(&true) {
            return self.on(here);
        }
        let [phi, omega] = motion.rounded();
        let fastest = omega.iter().fold(1.0, |most: f64, omega| most.max(omega.abs()));
        let mut after = vec![self.law_modes(&motion.later(A_MOMENT / fastest, &[]))];
        if with_forces {
            let mut kernel = Kernel::<f64>::new(self);
            kernel.accelerations(self, motion.time, &phi, &omega, Bias::default());
            after.push(self.law_modes(&motion.later(A_WHILE / fastest, &kernel.load[..phi.len()])));
        }
        let changes = |k: usize| zeros[k] && after.iter().any(|after| after[k] != here[k]);
        self.on((0..here.len()).map(|k| here[k] ^ changes(k)).collect())
    }

    /// What is found of the laws at a motion; nothing where no condition chooses branches.
    fn laws_at<R>(&self, motion: &Motion, find: impl FnOnce(&Laws, &Configuration<f64>) -> R) -> Option<R> {
        let laws = self.laws.as_ref().filter(|laws| !laws.modes.is_empty())?;
        Some(self.seen(motion, |at| find(laws, at)))
    }

    /// The branches that hold at a motion; none where no condition chooses any.
    fn law_modes(&self, motion: &Motion) -> Vec<bool> {
        self.laws_at(motion, |laws, at| laws.formulas.modes(at, &laws.parameters)).unwrap_or_default()
    }

    /// The mechanism with its laws on these branches; `None` where they are on them.
    fn on(&self, there: Vec<bool>) -> Result<Option<Self>, CompileError> {
        let Some(Laws { parameters, modes, .. }) = &self.laws else { return Ok(None) };
        match &self.whole {
            _ if there == *modes => Ok(None),
            Some((whole, inactive)) => whole.on_branch(parameters.clone(), there)?.acting(inactive).map(Some),
            None => self.on_branch(parameters.clone(), there).map(Some),
        }
    }

    /// True for the name of a hinge, a weld or a lock.
    pub(crate) fn is_joint(&self, part: &str) -> bool {
        let row = self.constraints.iter().position(|row| row.name == part);
        self.joints.iter().any(|joint| joint.name == part) || row.is_some_and(|row| !self.is_motor(row))
    }

    /// Parts that do not act, by name.
    pub(crate) fn resting(&self) -> &[String] {
        self.whole.as_ref().map_or(&[], |(_, inactive)| inactive)
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
            row.release(angles);
            // As those that depend on others, they say nothing of the position.
            self.assembly.redundant.push(row.name.clone());
            self.recursion = None;
        }
        !rows.is_empty()
    }

    /// Puts back what was released, as `before` has it.
    pub(super) fn put_back(&mut self, before: &Self) {
        for (row, before) in self.constraints.iter_mut().zip(&before.constraints) {
            if row.is_released(before) {
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
