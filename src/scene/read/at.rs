//! A value of the tree with its path, judged against the tables of `format`: what it must be, and the refusal
//! where it is not.

use crate::arithmetic::shown::about;
use crate::scene::error::SceneError;
use crate::scene::format::{Field, FieldShape, KeyTable, LONGEST_NAME, LONGEST_TEXT, QuantityRange};
use crate::scene::locate::{Located, Member, Span, Texts, Value, clipped, push_index, push_key};

/// A value with its path.
#[derive(Clone)]
pub(in crate::scene) struct At<'a> {
    pub source: &'a Texts,
    pub node: &'a Located,
    pub path: String,
}

impl<'a> At<'a> {
    /// An error about this value that shows it.
    pub fn refuse_value(&self, allowed: &str, hint: &str) -> SceneError {
        self.source.refused_value(self.node.span, &self.path, allowed, hint)
    }

    /// An error about this value in words.
    pub fn refuse(&self, problem: &str, allowed: &str, hint: &str) -> SceneError {
        self.source.refusal(self.opening(), &self.path, problem, allowed, hint)
    }

    pub fn refuse_key(&self, key: Span, problem: &str, allowed: &str, hint: &str) -> SceneError {
        self.source.refusal(key, &self.path, problem, allowed, hint)
    }

    /// An error about `keys` missing from this object.
    pub fn missing(&self, key: &str, within: &str, allowed: &str, hint: &str) -> SceneError {
        let holder = match &self.node.value {
            Value::Object(members) => {
                members.iter().find(|member| member.key == key).map(|member| self.member(member))
            }
            _ => None,
        };
        let mut path = self.path.clone();
        push_key(&mut path, key);
        push_key(&mut path, within);
        self.source.refusal(holder.unwrap_or(self.clone()).opening(), &path, "is missing", allowed, hint)
    }

    /// The place of a long value is its opening bracket.
    fn opening(&self) -> Span {
        match self.node.value {
            Value::List(_) | Value::Object(_) => self.node.span.first(),
            _ => self.node.span,
        }
    }

    pub fn has(&self, key: &str) -> bool {
        matches!(&self.node.value, Value::Object(members) if members.iter().any(|member| member.key == key))
    }

    /// The value of the member of this object of that name.
    pub fn child(&self, key: &str) -> Option<At<'a>> {
        let Value::Object(members) = &self.node.value else { return None };
        members.iter().find(|member| member.key == key).map(|member| self.member(member))
    }

    /// The element of this list of that name.
    pub fn named(&self, name: &str) -> Option<At<'a>> {
        let Value::List(nodes) = &self.node.value else { return None };
        let number = nodes.iter().position(|node| crate::scene::set::name(node) == Some(name))?;
        Some(self.item(&nodes[number], number))
    }

    /// The value of a member of this object.
    pub fn member(&self, member: &'a Member) -> At<'a> {
        let mut path = self.path.clone();
        push_key(&mut path, &clipped(&member.key));
        At { source: self.source, node: &member.node, path }
    }

    /// An element of this list.
    pub fn item(&self, node: &'a Located, number: usize) -> At<'a> {
        let mut path = self.path.clone();
        push_index(&mut path, number);
        At { source: self.source, node, path }
    }

    /// This value as an object that has all keys of `table` it must have, and no others.
    pub fn object(&self, table: &'static KeyTable) -> Result<Fields<'a>, SceneError> {
        let Value::Object(members) = &self.node.value else {
            let allowed = format!("must be an object, {}, with the keys {}", table.title, table.keys());
            if self.path.is_empty() {
                return Err(self.refuse(
                    "the file is not a JSON object",
                    &allowed,
                    "compare with a file in examples/scenes/",
                ));
            }
            return Err(self.refuse_value(&allowed, table.about));
        };
        for member in members {
            if table.field(&member.key).is_none() {
                let names = table.fields.iter().map(|field| field.name);
                let hint = nearest(&member.key, names)
                    .map_or(table.about.to_owned(), |near| format!("did you mean `{near}`?"));
                let allowed = format!("{} has the keys {}", table.title, table.keys());
                return Err(self.member(member).refuse_key(
                    member.span,
                    "is not a known key",
                    &allowed,
                    &hint,
                ));
            }
        }
        Ok(Fields { at: self.clone(), members, table })
    }

    /// The elements of this list, which is the field `name` of `table`.
    pub fn items(&self, name: &str, table: &'static KeyTable) -> Result<Vec<At<'a>>, SceneError> {
        let shape = table.field(name).map(|field| &field.shape);
        let (least, most) = if let Some(FieldShape::List { least, most, .. }) = shape {
            (*least, *most)
        } else {
            (0, usize::MAX)
        };
        let allowed = || shape.map_or(String::new(), FieldShape::allowed);
        match &self.node.value {
            Value::List(nodes) if (least..=most).contains(&nodes.len()) => {
                Ok(nodes.iter().enumerate().map(|(number, node)| self.item(node, number)).collect())
            }
            Value::List(nodes) => {
                let hint = if nodes.len() < least {
                    "compare with examples/scenes/free.json"
                } else {
                    "split the scene"
                };
                Err(self.refuse(&format!("has {} elements", nodes.len()), &allowed(), hint))
            }
            _ => Err(self.refuse_value(&allowed(), "even a single one stands in square brackets")),
        }
    }

    fn number(&self, field: &Field, quantity: &QuantityRange) -> Result<f64, SceneError> {
        let allowed = || field.shape.allowed();
        match &self.node.value {
            Value::Number(number) if quantity.holds(*number) => Ok(*number),
            Value::Number(_) if quantity.unit == "rad" => Err(self.refuse_value(
                &allowed(),
                "beyond that the last place of the angle is coarser than 1e-3 rad; take off whole turns",
            )),
            Value::Text(text) if text.trim().parse::<f64>().is_ok_and(f64::is_finite) => {
                Err(self
                    .refuse_value(&allowed(), &format!("write it without quotes: {}", clipped(text.trim()))))
            }
            _ => Err(self.refuse_value(&allowed(), &field.for_example())),
        }
    }

    /// Refuses this object where what follows from it is out of range.
    pub fn comes_to(&self, what: &str, number: f64, quantity: &QuantityRange) -> Result<(), SceneError> {
        if quantity.holds(number) {
            return Ok(());
        }
        let problem = format!("comes to {what} of {} {}", about(number), quantity.unit);
        Err(self.refuse(&problem, &FieldShape::Number(*quantity).allowed(), "check the units: metres, kg/m³"))
    }
}

/// The members of an object whose keys are known to be good.
pub(in crate::scene) struct Fields<'a> {
    pub at: At<'a>,
    members: &'a [Member],
    pub table: &'static KeyTable,
}

impl<'a> Fields<'a> {
    pub fn optional(&self, name: &str) -> Option<At<'a>> {
        self.members.iter().find(|member| member.key == name).map(|member| self.at.member(member))
    }

    pub fn required(&self, name: &str) -> Result<At<'a>, SceneError> {
        self.optional(name).ok_or_else(|| {
            let mut path = self.at.path.clone();
            push_key(&mut path, name);
            let (allowed, hint) = match self.table.field(name) {
                Some(field) => (field.shape.allowed(), format!("add it, {}", field.for_example())),
                None => (String::new(), self.table.about.to_owned()),
            };
            self.at.source.refusal(self.at.opening(), &path, "is missing", &allowed, &hint)
        })
    }

    pub fn number(&self, name: &str) -> Result<f64, SceneError> {
        let at = self.required(name)?;
        match self.table.field(name) {
            Some(
                field @ Field {
                    shape: FieldShape::Number(quantity) | FieldShape::LawNumber(quantity), ..
                },
            ) => at.number(field, quantity),
            _ => Err(at.refuse_value("must be a number the format knows", self.table.about)),
        }
    }

    pub fn number_or(&self, name: &str, absent: f64) -> Result<f64, SceneError> {
        if self.optional(name).is_some() { self.number(name) } else { Ok(absent) }
    }

    pub fn pair(&self, name: &str) -> Result<[f64; 2], SceneError> {
        let at = self.required(name)?;
        match (self.table.field(name), &at.node.value) {
            (
                Some(
                    field @ Field {
                        shape: FieldShape::Pair(quantity) | FieldShape::LawPair(quantity), ..
                    },
                ),
                Value::List(nodes),
            ) if nodes.len() == 2 => Ok([
                at.item(&nodes[0], 0).coordinate(field, quantity)?,
                at.item(&nodes[1], 1).coordinate(field, quantity)?,
            ]),
            (Some(field), _) => Err(at.refuse_value(&field.shape.allowed(), &field.for_example())),
            (None, _) => Err(at.refuse_value("must be a pair the format knows", self.table.about)),
        }
    }

    /// A pair, or none where there is no such key.
    pub fn pair_if_any(&self, name: &str) -> Result<Option<[f64; 2]>, SceneError> {
        self.optional(name).map(|_| self.pair(name)).transpose()
    }

    /// A number, or none where there is no such key.
    pub fn number_if_any(&self, name: &str) -> Result<Option<f64>, SceneError> {
        self.optional(name).map(|_| self.number(name)).transpose()
    }

    /// A unit vector along a pair that may have any length but zero; `hint` has sensible ones.
    pub fn direction(&self, name: &str, hint: &str) -> Result<[f64; 2], SceneError> {
        let [x, y] = self.pair(name)?;
        let length = libm::hypot(x, y);
        if length < 1e-30 {
            return Err(self.required(name)?.refuse_value("must be longer than 1e-30", hint));
        }
        // What is a unit vector already stays as it is, so that a scene written out reads back the same.
        let unit = (x * x + y * y - 1.0).abs() <= 4.0 * f64::EPSILON;
        Ok(if unit { [x, y] } else { [x / length, y / length] })
    }

    /// One of a few words, by its number; the first where there is no such key.
    pub fn word_or_first(&self, name: &str) -> Result<usize, SceneError> {
        let (Some(at), Some(Field { shape: shape @ FieldShape::Word(words), .. })) =
            (self.optional(name), self.table.field(name))
        else {
            return Ok(0);
        };
        let said = if let Value::Text(said) = &at.node.value { said } else { "" };
        words.iter().position(|word| *word == said).ok_or_else(|| {
            let hint = match nearest(said, words.iter().copied()) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => format!("it is \"{}\" if left out", words[0]),
            };
            at.refuse_value(&shape.allowed(), &hint)
        })
    }

    pub fn text_or_empty(&self, name: &str) -> Result<String, SceneError> {
        let Some(at) = self.optional(name) else { return Ok(String::new()) };
        match &at.node.value {
            Value::Text(text)
                if text.chars().count() <= LONGEST_TEXT && !text.chars().any(char::is_control) =>
            {
                Ok(text.clone())
            }
            _ => Err(at.refuse_value(&FieldShape::Text.allowed(), "one sentence is enough")),
        }
    }

    pub fn name(&self, name: &str) -> Result<String, SceneError> {
        let at = self.required(name)?;
        let shape = self.table.field(name).map_or(&FieldShape::Name, |field| &field.shape);
        let folder = matches!(shape, FieldShape::FolderName);
        match &at.node.value {
            Value::Text(text) if is_name(text) && !(folder && text.starts_with('-')) => Ok(text.clone()),
            Value::Text(text) => {
                let mended: String = text
                    .trim()
                    .chars()
                    .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
                    .take(LONGEST_NAME)
                    .collect();
                let hint = if is_name(&mended) {
                    format!("for example \"{mended}\"")
                } else {
                    "for example \"bar1\"".to_owned()
                };
                Err(at.refuse_value(&shape.allowed(), &hint))
            }
            _ => Err(at.refuse_value(&shape.allowed(), "names stand in double quotes")),
        }
    }
}

impl At<'_> {
    /// One number of a pair.
    fn coordinate(&self, field: &Field, quantity: &QuantityRange) -> Result<f64, SceneError> {
        match self.node.value {
            Value::Number(number) if quantity.holds(number) => Ok(number),
            _ => Err(self.refuse_value(&FieldShape::Number(*quantity).allowed(), &field.for_example())),
        }
    }
}

/// True for what a part may be called.
pub(crate) fn is_name(text: &str) -> bool {
    (1..=LONGEST_NAME).contains(&text.len())
        && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_')
}

/// The first dozen of some words.
pub(crate) fn listed(words: &[&str]) -> String {
    let more = if words.len() > 12 { format!(", … ({} in all)", words.len()) } else { String::new() };
    words.iter().take(12).map(|word| clipped(word)).collect::<Vec<_>>().join(", ") + &more
}

/// The known word within a third of its letters of `wanted`.
pub(crate) fn nearest<'a>(wanted: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted: String = wanted.chars().take(LONGEST_NAME).flat_map(char::to_lowercase).collect();
    let letters = wanted.chars().count();
    let far = (letters / 3).max(1);
    known
        .into_iter()
        // Words are at least as far from each other as their lengths are.
        .filter(|word| word.chars().count().abs_diff(letters) <= far)
        .map(|word| (strsim::damerau_levenshtein(&wanted, &word.to_lowercase()), word))
        .filter(|(distance, word)| *distance <= far && *distance < word.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, word)| word)
}
