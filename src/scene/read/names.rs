//! Names: those of one kind are different, and every one that is spoken of is there.

use super::at::{At, Fields, listed, nearest};
use crate::scene::error::SceneError;
use crate::scene::format::{Field, FieldShape, GROUND, KeyTable, PLACE, kind};
use crate::scene::locate::{Located, Value};
use crate::scene::{Bar, Place};
use std::collections::HashMap;

/// The elements of a list whose elements have a name, and their places.
pub(super) fn named<'a, T>(
    scene: &Fields<'a>,
    list: &str,
    one: impl Fn(&Fields<'a>, String) -> Result<T, SceneError>,
) -> Result<(Vec<T>, Vec<At<'a>>), SceneError> {
    let mut names = UniqueNames::default();
    let mut read = Vec::new();
    let places = match scene.table.field(list) {
        Some(field) if field.required => scene.required(list)?.items(list, scene.table)?,
        _ => scene.optional(list).map_or(Ok(Vec::new()), |at| at.items(list, scene.table))?,
    };
    let kinds: &[&'static KeyTable] =
        if let Some(Field { shape: FieldShape::List { of, .. }, .. }) = scene.table.field(list) {
            of
        } else {
            &[]
        };
    for at in &places {
        let fields = at.object(kind(kinds, |key| at.has(key)).unwrap_or(scene.table))?;
        let name = fields.name("name")?;
        let name_at = fields.required("name")?;
        if name == GROUND && list == "bars" {
            return Err(name_at
                .refuse_value("must be another name: `ground` is what does not move", "name it `base`"));
        }
        names.admit(&name, &name_at)?;
        read.push(one(&fields, name)?);
    }
    Ok((read, places))
}

/// Refuses a motor, a lock, a slider or a rigid spring of the name of another one: their names are those of
/// their constraints as well.
pub(super) fn check_constraint_names(scene: &Fields) -> Result<(), SceneError> {
    let mut known: HashMap<&str, String> = HashMap::new();
    for list in ["sliders", "locks", "springs", "motors"] {
        let parts = scene.optional(list).map_or(Ok(Vec::new()), |at| at.items(list, scene.table))?;
        for part in parts {
            let model = part.node.at("model").map(|model| &model.value);
            let is_rigid = matches!(model, Some(Value::Text(model)) if model == "rigid");
            let Some(node) = part.node.at("name").filter(|_| list != "springs" || is_rigid) else {
                continue;
            };
            let Value::Text(name) = &node.value else { continue };
            let at = At { source: part.source, node, path: format!("{}.name", part.path) };
            if let Some(first) = known.insert(name, at.path.clone()) {
                let allowed = format!("must not be the name of another constraint; {first} is the same");
                return Err(at.refuse_value(&allowed, "rename one of the two"));
            }
        }
    }
    Ok(())
}

/// Names of one kind, each with the path of its owner.
#[derive(Default)]
struct UniqueNames(HashMap<String, String>);

impl UniqueNames {
    fn admit(&mut self, name: &str, at: &At) -> Result<(), SceneError> {
        match self.0.insert(name.to_owned(), at.path.clone()) {
            None => Ok(()),
            Some(first) => {
                Err(at.refuse_value(&format!("must be unique; {first} is the same"), "rename one of the two"))
            }
        }
    }
}

/// The bars by name.
pub(super) struct BarNames<'a> {
    pub bars: &'a [Bar],
    numbers: HashMap<&'a str, usize>,
}

impl<'a> BarNames<'a> {
    pub fn of(bars: &'a [Bar]) -> Self {
        Self {
            bars,
            numbers: bars.iter().enumerate().map(|(number, bar)| (bar.name.as_str(), number)).collect(),
        }
    }

    /// The bar of that name.
    pub fn number(&self, name: &str) -> Option<usize> {
        self.numbers.get(name).copied()
    }

    /// The bar named at `at`, or the ground.
    pub fn body(&self, at: &At) -> Result<Option<usize>, SceneError> {
        let Value::Text(name) = &at.node.value else {
            return Err(at.refuse_value(&FieldShape::Body { ground: true }.allowed(), &self.hint("")));
        };
        if name == GROUND {
            return Ok(None);
        }
        self.number(name).map(Some).ok_or_else(|| {
            at.refuse_value("names no body; must be the name of a bar, or \"ground\"", &self.hint(name))
        })
    }

    /// The bar that the field `body` names; `hint` says why it cannot be the ground.
    pub fn bar(&self, fields: &Fields, hint: &str) -> Result<usize, SceneError> {
        let at = fields.required("body")?;
        match self.body(&at)? {
            Some(bar) => Ok(bar),
            None => Err(at.refuse_value(&FieldShape::Body { ground: false }.allowed(), hint)),
        }
    }

    /// The bar, other than `bar`, that the field `relative_to` names; `None` for the ground, or where there
    /// is no such field.
    pub fn relative_to(&self, fields: &Fields, bar: usize, hint: &str) -> Result<Option<usize>, SceneError> {
        let Some(at) = fields.optional("relative_to") else { return Ok(None) };
        match self.body(&at)? {
            Some(base) if base == bar => Err(at.refuse_value("must be another bar than `body`", hint)),
            base => Ok(base),
        }
    }

    pub fn hint(&self, wanted: &str) -> String {
        let names: Vec<&str> = self.bars.iter().map(|bar| bar.name.as_str()).collect();
        let list = listed(&names);
        match nearest(wanted, names) {
            Some(near) => format!("did you mean \"{near}\"? known bars: {list}"),
            None => format!("known bars: {list}"),
        }
    }

    /// A place.
    pub fn place(&self, at: &At) -> Result<Place, SceneError> {
        self.place_of(&at.object(&PLACE)?)
    }

    /// The place that an object has among its fields.
    pub fn place_of(&self, fields: &Fields) -> Result<Place, SceneError> {
        Ok(Place { bar: self.body(&fields.required("body")?)?, point: fields.pair("point")? })
    }

    /// The two places of a hinge, a weld or a spring.
    pub fn between(&self, fields: &Fields, what: &str) -> Result<[Place; 2], SceneError> {
        let at = fields.required("between")?;
        let Value::List(nodes) = &at.node.value else {
            return Err(at.refuse_value(
                &FieldShape::Between.allowed(),
                "for example {\"body\": \"ground\", \"point\": [0, 0]} for one of them",
            ));
        };
        let [first, second] = nodes.as_slice() else {
            let hint = format!("a {what} joins exactly two bodies; this list has {}", nodes.len());
            return Err(at.refuse("does not have two places", &FieldShape::Between.allowed(), &hint));
        };
        let places = [self.place(&at.item(first, 0))?, self.place(&at.item(second, 1))?];
        self.on_two_bodies(&at, places[0].bar, places[1].bar, what)?;
        Ok(places)
    }

    /// Refuses a `what` at `at` that would join a body to itself.
    pub fn on_two_bodies(
        &self,
        at: &At,
        one: Option<usize>,
        other: Option<usize>,
        what: &str,
    ) -> Result<(), SceneError> {
        if one != other {
            return Ok(());
        }
        let problem = match one {
            Some(bar) => format!("joins `{}` to itself", self.bars[bar].name),
            None => "joins the ground to itself".to_owned(),
        };
        let hint = format!("a {what} between two bars, or between a bar and the ground, can do something");
        Err(at.refuse(&problem, "the two places must be on different bodies", &hint))
    }
}

/// The parameters that events set.
pub(super) fn set_by_events(tree: &Located) -> Vec<String> {
    let Some(Value::List(events)) = tree.at("events").map(|events| &events.value) else { return Vec::new() };
    let set = events.iter().filter_map(|event| match &event.at("set")?.value {
        Value::Object(members) => Some(members),
        _ => None,
    });
    set.flatten().map(|member| member.key.clone()).collect()
}
