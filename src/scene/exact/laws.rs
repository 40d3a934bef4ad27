//! Formulas of time and state, which are kept as texts, and what they speak of.

use super::{Decimal, Reader, TreeCursor, Watcher, shortest};
use crate::scene::error::SceneError;
use crate::scene::formula::{Formula, Interpolant, Numbers};
use crate::scene::locate::Value;
use crate::scene::{Coupling, Load, LoadLaw, NamedPoint, PointTable, Profile, Scene, SceneEvent};

/// The list a law stands in.
fn list<C>(load: &Load<C>) -> &'static str {
    match load {
        Load::Force { .. } => "forces",
        Load::Torque { .. } => "torques",
        Load::Spring { .. } => "springs",
        Load::TorsionSpring { .. } => "torsion_springs",
        Load::Potential { .. } => "potentials",
    }
}

impl<'a, C: Decimal> Reader<'a, C> {
    /// The items of a list whose numbers are constant.
    pub(super) fn plain_items(&self, of: &str) -> Vec<TreeCursor<'a>> {
        let is_law = |at: &TreeCursor| {
            let mut laws = self.plain.laws.iter().filter(|law| list(&law.load) == of);
            laws.any(|law| crate::scene::set::name(at.node) == Some(&law.name))
        };
        self.root.items(of).into_iter().filter(|at| !is_law(at)).collect()
    }

    /// Tables: numbers that stand in the text by their digits, those of files as the nearest doubles'
    /// shortest.
    pub(super) fn tables(&self, plain: &Scene) -> Vec<PointTable<C>> {
        let holder = self.root.child("tables");
        let table = |plain: &PointTable| {
            let listed = holder.as_ref().map_or(Vec::new(), |holder| holder.items(&plain.name));
            let point = |(number, values): (usize, &[f64; 2])| {
                let Some(Value::List(nodes)) = listed.get(number).map(|at| &at.node.value) else {
                    return values.map(shortest);
                };
                std::array::from_fn(|k| self.literal(&nodes[k], values[k]))
            };
            let points = plain.points.iter().enumerate().map(point).collect();
            PointTable { name: plain.name.clone(), points }
        };
        plain.tables.iter().map(table).collect()
    }

    /// Named points.
    pub(super) fn points(&self, plain: &Scene) -> Result<Vec<NamedPoint<C>>, SceneError> {
        let items = self.root.items("points");
        let point = |(at, plain): (&TreeCursor, &NamedPoint)| {
            Ok(NamedPoint { name: plain.name.clone(), place: self.place(at, &plain.place)? })
        };
        items.iter().zip(&plain.points).map(point).collect()
    }

    /// Forces, torques, springs and potentials by formulas, without the torques of integrals.
    pub(super) fn laws(&self, plain: &Scene) -> Result<Vec<LoadLaw<C>>, SceneError> {
        plain.acting_laws().map(|law| self.load(law)).collect()
    }

    fn load(&self, LoadLaw { name, load }: &LoadLaw) -> Result<LoadLaw<C>, SceneError> {
        let items = self.root.items(list(load));
        let at = items.iter().find(|at| crate::scene::set::name(at.node) == Some(name)).unwrap_or(&self.root);
        let text = |key: &str, plain: &str| self.formula(at, key, plain);
        let if_any =
            |key: &str, plain: &Option<String>| plain.as_ref().map(|plain| text(key, plain)).transpose();
        let load = match load {
            Load::Force { bar, point, force: [x, y], follows } => Load::Force {
                bar: *bar,
                point: self.pair(at, "point", *point)?,
                force: {
                    let components = at.items("force");
                    let component = |k: usize, plain: &str| match components.get(k) {
                        Some(at) => self.formula_at(at, plain),
                        None => Ok(plain.to_owned()),
                    };
                    [component(0, x)?, component(1, y)?]
                },
                follows: *follows,
            },
            Load::Torque { bar, relative_to, torque } => {
                Load::Torque { bar: *bar, relative_to: *relative_to, torque: text("torque", torque)? }
            }
            Load::Spring { between, potential, tension } => Load::Spring {
                between: self.between(at, between)?,
                potential: if_any("potential", potential)?,
                tension: if_any("tension", tension)?,
            },
            Load::TorsionSpring { bar, relative_to, potential, torque } => Load::TorsionSpring {
                bar: *bar,
                relative_to: *relative_to,
                potential: if_any("potential", potential)?,
                torque: if_any("torque", torque)?,
            },
            Load::Potential { energy } => Load::Potential { energy: text("energy", energy)? },
        };
        Ok(LoadLaw { name: name.clone(), load })
    }

    /// Motors whose aim is a formula of the state.
    pub(super) fn couplings(&self, plain: &Scene) -> Result<Vec<Coupling>, SceneError> {
        let coupling = |plain: &Coupling| {
            let aim = self.formula(&self.motor(&plain.name)?, "law", &plain.aim)?;
            Ok(Coupling { aim, ..plain.clone() })
        };
        plain.couplings.iter().map(coupling).collect()
    }

    pub(super) fn formula(&self, at: &TreeCursor, key: &str, plain: &str) -> Result<String, SceneError> {
        at.child(key).map_or_else(|| Ok(plain.to_owned()), |at| self.formula_at(&at, plain))
    }

    /// The text of a formula; a number by all its digits.
    fn formula_at(&self, at: &TreeCursor, plain: &str) -> Result<String, SceneError> {
        if self.known_at(at.node).is_some() {
            return Err(self.refuse_part(at, "it stands where a formula may"));
        }
        if let Value::Number(value) = at.node.value {
            return Ok(format!("{:?}", self.literal(at.node, value)));
        }
        self.read(at, plain)?;
        Ok(plain.to_owned())
    }

    /// Events, where they are those of this run.
    pub(super) fn events(&self, plain: &Scene) -> Result<Vec<SceneEvent>, SceneError> {
        if self.watched == Watcher::Beside {
            return Ok(Vec::new());
        }
        let event = |(at, event): (&TreeCursor, &SceneEvent)| {
            let when = at.child("when").unwrap_or_else(|| at.clone());
            self.read(&when, &event.when)?;
            let values = at.child("set");
            let value = |(name, text): &(String, String)| {
                let at = values.as_ref().and_then(|values| values.child(name));
                Ok((name.clone(), self.formula_at(at.as_ref().unwrap_or(&when), text)?))
            };
            let set = event.set.iter().map(value).collect::<Result<_, SceneError>>()?;
            Ok(SceneEvent { set, ..event.clone() })
        };
        self.root.items("events").iter().zip(&plain.events).map(event).collect()
    }

    /// A formula, without corners and tables where nobody watches for them.
    fn read(&self, at: &TreeCursor, text: &str) -> Result<Formula, SceneError> {
        let tables = &self.plain.tables;
        let tables: Vec<_> =
            tables.iter().map(|table| Interpolant::new(&table.name, &table.points)).collect();
        let formula = Formula::parse_with(text, &tables).map_err(|error| {
            self.refuse(at, &format!("is no formula: {}", error.problem), "give a formula")
        })?;
        if formula.conditions() > 0 && self.watched == Watcher::Beside {
            let why = "its formula has corners or tables, across whose pieces there is no series";
            return Err(self.refuse_part(at, why));
        }
        Ok(formula)
    }

    /// Refuses signals and integrals with corners that nobody watches for.
    pub(super) fn refuse_corners(&self) -> Result<(), SceneError> {
        for key in ["signals", "integrals"] {
            let Some(holder) = self.root.child(key) else { continue };
            let Value::Object(members) = &holder.node.value else { continue };
            for member in members {
                if let (Value::Text(text), Some(at)) = (&member.node.value, holder.child(&member.key)) {
                    self.read(&at, text)?;
                }
            }
        }
        Ok(())
    }

    /// A law of time.
    pub(super) fn profile(&self, at: &TreeCursor, text: &str) -> Result<Profile<C>, SceneError> {
        let formula = self.read(at, text)?;
        let value = |name: &str| {
            let known = self.parameters.iter().find(|known| known.0 == name);
            known.map(|known| known.1)
        };
        let values: Vec<Option<C>> = formula.names().map(value).collect();
        let numbers = C::HAS_CONSTANTS.then(|| Numbers::of(&formula, &self.tables));
        Ok(Profile::new(&formula, numbers.as_ref(), &values))
    }
}
