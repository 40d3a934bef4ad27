//! What formulas depend on, on whichever branches and with whatever parameters.

use super::{FormulaEvent, Formulas};
use crate::dynamics::constraint::Site;
use crate::scene::Meaning;

impl Formulas {
    /// True where a law applies forces beside potentials, on whatever branch.
    pub fn applies(&self) -> bool {
        self.laws.iter().any(|law| law.place.applies())
    }

    /// True where it has conditions, or events that change something.
    pub fn switches(&self) -> bool {
        let changes =
            |event: &FormulaEvent| !(event.on.is_empty() && event.off.is_empty() && event.set.is_empty());
        !self.conditions.is_empty() || self.events.iter().any(changes)
    }

    /// True where walls may move by time on other branches or with other parameters than those that hold.
    pub fn may_move_walls(&self) -> bool {
        let has_time = |meaning: &Meaning<Site>| matches!(meaning, Meaning::Time | Meaning::Signal(_));
        let of_walls = self.aims.iter().filter(|(part, ..)| part.is_wall);
        self.switches() && of_walls.flat_map(|aim| &aim.2.meanings).any(has_time)
    }

    /// True where laws of motors or walls are formulas.
    pub fn drives(&self) -> bool {
        !self.profiles.is_empty() || !self.aims.is_empty()
    }

    /// What the names in them mean, on whichever branches.
    pub fn meanings(&self) -> impl Iterator<Item = &Meaning<Site>> {
        self.switched().flat_map(|expression| &expression.meanings)
    }

    /// The same but of laws of gears and cams, where these are the same all along.
    pub fn meanings_beside_gears(&self) -> impl Iterator<Item = &Meaning<Site>> {
        let is_gear =
            |expression| self.aims.iter().any(|aim| !aim.0.is_wall && std::ptr::eq(&aim.2, expression));
        let switches = self.switches();
        let others = self.switched().filter(move |expression| switches || !is_gear(*expression));
        others.flat_map(|expression| &expression.meanings)
    }

    /// What the numbers mean that formulas that act depend on, themselves or by signals.
    pub fn acting_meanings(&self) -> impl Iterator<Item = &Meaning<Site>> {
        let own = || self.acting().flat_map(|expression| &expression.meanings);
        let has_signals = own().any(|meaning| matches!(meaning, Meaning::Signal(_)));
        let signals = self.signals.iter().filter(move |_| has_signals);
        own().chain(signals.flat_map(|expression| &expression.meanings))
    }
}
