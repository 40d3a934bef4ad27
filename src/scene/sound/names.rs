//! Names of a scene put together by hand: such as scene files may have, and each once.

use super::super::format::{GROUND, LONGEST_NAME};
use super::super::read::is_name;
use super::super::{Load, Scene};
use std::collections::HashMap;

/// A list of parts, and their names.
type NamedList<'a> = (&'static str, Vec<&'a str>);

impl Scene {
    /// A name that is none, or that two parts have.
    pub(super) fn faulty_name(&self) -> Option<String> {
        if !is_name(&self.name) || self.name.starts_with('-') {
            return Some(format!("name: {}", no_name(&self.name)));
        }
        if let Some(ground) = self.bars.iter().position(|bar| bar.name == GROUND) {
            return Some(format!("bars[{ground}].name: `{GROUND}` is what does not move"));
        }
        let own = [
            ("bars", self.bars[..self.own_bars()].iter().map(|part| &*part.name).collect()),
            ("hinges", self.hinges[..self.own_hinges()].iter().map(|part| &*part.name).collect()),
            ("welds", self.welds.iter().map(|part| &*part.name).collect()),
            ("walls", self.walls.iter().map(|part| &*part.name).collect()),
            ("events", self.events.iter().map(|part| &*part.name).collect()),
            ("points", self.points.iter().map(|part| &*part.name).collect()),
        ];
        let kinds = own.map(|list: NamedList| vec![list]).into_iter();
        kinds.chain(self.loads()).chain([self.constraint_names()]).find_map(|lists| faulty(&lists))
    }

    /// Names of what acts with a force or a torque, kind by kind, by numbers and by formulas.
    fn loads(&self) -> Vec<Vec<NamedList<'_>>> {
        let laws = |is_kind: fn(&Load) -> bool| {
            let laws = self.acting_laws().filter(move |law| is_kind(&law.load));
            ("laws", laws.map(|law| &*law.name).collect::<Vec<_>>())
        };
        vec![
            vec![
                ("springs", self.springs.iter().map(|part| &*part.name).collect()),
                laws(|load| matches!(load, Load::Spring { .. })),
            ],
            vec![
                ("torsion_springs", self.torsion_springs.iter().map(|part| &*part.name).collect()),
                laws(|load| matches!(load, Load::TorsionSpring { .. })),
            ],
            vec![
                ("forces", self.forces.iter().map(|part| &*part.name).collect()),
                laws(|load| matches!(load, Load::Force { .. })),
            ],
            vec![
                ("torques", self.torques.iter().map(|part| &*part.name).collect()),
                laws(|load| matches!(load, Load::Torque { .. })),
            ],
            vec![laws(|load| matches!(load, Load::Potential { .. }))],
        ]
    }

    /// Names that are those of constraints as well.
    fn constraint_names(&self) -> Vec<NamedList<'_>> {
        let rods = self.springs.iter().filter(|spring| spring.rigid);
        vec![
            ("sliders", self.sliders.iter().map(|part| &*part.name).collect()),
            ("locks", self.locks.iter().map(|part| &*part.name).collect()),
            ("rigid springs", rods.map(|part| &*part.name).collect()),
            ("motors", self.motors.iter().map(|part| &*part.name).collect()),
            ("drives", self.drives.iter().map(|part| &*part.name).collect()),
            ("couplings", self.couplings.iter().map(|part| &*part.name).collect()),
        ]
    }
}

/// The first of some names that is none, or that another part of these lists has.
fn faulty(lists: &[NamedList]) -> Option<String> {
    let mut known: HashMap<&str, (&str, usize)> = HashMap::new();
    let all = lists.iter().flat_map(|(list, names)| names.iter().enumerate().map(move |name| (*list, name)));
    for (list, (number, name)) in all {
        if !is_name(name) {
            return Some(format!("{list}[{number}].name: {}", no_name(name)));
        }
        if let Some((other, first)) = known.insert(name, (list, number)) {
            return Some(format!("{list}[{number}].name: `{name}` is that of {other}[{first}] as well"));
        }
    }
    None
}

fn no_name(name: &str) -> String {
    let short: String = name.chars().take(LONGEST_NAME).collect();
    format!("`{short}` is no name: 1 to {LONGEST_NAME} of A to Z, a to z, 0 to 9, `_` and `-`")
}
