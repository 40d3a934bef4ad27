//! Events from outside, and those that are asked for by name.

use super::{Event, EventDetector, Owner};
use crate::dynamics::Motion;

impl EventDetector {
    /// The name of an event.
    pub fn name(&self, event: usize) -> &str {
        match self.owner(event) {
            Owner::Scene(laws, number) => &laws.formulas.events[number].name,
            Owner::Condition(laws, number) => &laws.formulas.conditions[number],
            Owner::Friction(watch, number) => watch.place(number).map_or("friction", |place| &place.name),
            Owner::Outside(number) => self.events[number].name(),
        }
    }

    /// The events from outside.
    pub fn outside(&self) -> &[Box<dyn Event>] {
        &self.events
    }

    /// True for an event that is not the scene's own.
    pub fn is_from_outside(&self, event: usize) -> bool {
        matches!(self.owner(event), Owner::Outside(_))
    }

    /// What cannot be of an event from outside whose function was not a number in the last step, or whose
    /// action asked for a body that is not there.
    pub fn take_undefined(&mut self) -> Option<String> {
        let name = |number: usize| self.events[number].name();
        let undefined = self.undefined.take().map(|number| {
            format!("the function of event `{}` is not a number in the step that ends here", name(number))
        });
        let foreign = self.foreign.take();
        undefined.or_else(|| {
            Some(format!("the action of event `{}` asks for a body that is not there", name(foreign?)))
        })
    }

    /// True where an event is known to do more than to be recorded.
    pub fn changes_run(&self, event: usize) -> bool {
        match self.owner(event) {
            Owner::Condition(..) | Owner::Friction(..) => true,
            Owner::Outside(_) => false,
            Owner::Scene(laws, number) => {
                let said = &laws.formulas.events[number];
                said.stop || !said.off.is_empty() || !said.on.is_empty() || said.parameters().next().is_some()
            }
        }
    }

    /// The value of the function of the event of this name.
    pub fn value_of(&self, name: &str, motion: &Motion) -> Option<f64> {
        let event = (0..self.functions()).find(|&event| self.name(event) == name)?;
        self.values(motion).get(event).copied()
    }
}
