//! What formulas depend on, on whichever branches and with whatever parameters.

use super::{Expression, FormulaEvent, Formulas};
use crate::dynamics::constraint::Site;
use crate::scene::Meaning;
use std::collections::BTreeSet;

impl Expression {
    /// True where time is in it, and true where conditions choose its branches, itself or by the signals it
    /// asks for, of which `signals` tell the same.
    fn depends_on_time_and_conditions(&self, signals: &[[bool; 2]]) -> [bool; 2] {
        let own = [self.meanings.contains(&Meaning::Time), self.formula.conditions() > 0];
        self.meanings.iter().fold(own, |[time, conditions], meaning| match meaning {
            Meaning::Signal(number) => [time || signals[*number][0], conditions || signals[*number][1]],
            _ => [time, conditions],
        })
    }
}

impl Formulas {
    /// The formulas of forces, torques, springs, motors and walls, with the names of their parts.
    pub(super) fn by_part(&self) -> impl Iterator<Item = (&str, &Expression)> {
        let laws = self.laws.iter().flat_map(|law| law.expressions().map(|one| (law.name.as_str(), one)));
        let profiles = self.profiles.iter().map(|(part, law)| (part.name.as_str(), law));
        let aims = self.aims.iter().map(|(part, _, aim)| (part.name.as_str(), aim));
        laws.chain(profiles).chain(aims)
    }

    /// The names of parts that may depend on time on other branches than those that hold.
    pub fn timed_on_branches(&self) -> Vec<&str> {
        let mut signals = Vec::with_capacity(self.signals.len());
        for signal in &self.signals {
            signals.push(signal.depends_on_time_and_conditions(&signals));
        }
        let is_timed =
            |(_, one): &(&str, &Expression)| one.depends_on_time_and_conditions(&signals) == [true; 2];
        self.by_part().filter(is_timed).map(|(name, _)| name).collect()
    }

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

    /// The parameters that events set though no law, signal or event is made of them, by number.
    pub fn set_in_vain(&self) -> impl Iterator<Item = usize> {
        let of_events = self.events.iter().flat_map(|event| {
            let set = event.set.iter().map(|(_, expression)| expression);
            std::iter::once(&event.when).chain(set)
        });
        let of = |meaning: &Meaning<Site>| match meaning {
            Meaning::Parameter(number) => Some(*number),
            _ => None,
        };
        let used: Vec<usize> = self
            .switched()
            .chain(of_events)
            .flat_map(|expression| &expression.meanings)
            .filter_map(of)
            .collect();
        let set: BTreeSet<usize> = self.events.iter().flat_map(FormulaEvent::parameters).collect();
        set.into_iter().filter(move |number| !used.contains(number))
    }
}
