//! The scene reference as a page, generated from the JSON Schema that the program prints.

use serde_json::{Value, json};
use std::fmt::Write;

const HEAD: &str = "# Scene reference

<!-- Generated from `driftless schema` by `UPDATE_DOCS=1 cargo test --test documentation`; do not edit. -->

All keys of a scene file, with type, unit and range.  [Scenes](scenes.md) explains how the parts work together.
The same description as JSON Schema, for editors: `driftless schema`.

- Units are SI; angles are in radians, absolute, measured from +x, counter-clockwise.
- Unknown keys are refused.  A key in **bold** is required.
- A *name* has 1 to 64 letters `a` to `z` or `A` to `Z`, digits, `_` and `-`; that of the scene does not
  begin with `-`.
- Every number may be written as a [formula](formulas.md) of parameters, in quotes.
- A *number* without a stated range lies between -1e30 and 1e30.
";

/// One kind of object.
struct Kind<'a> {
    title: &'a str,
    anchor: String,
    schema: &'a Value,
}

impl Kind<'_> {
    fn is(&self, schema: &Value) -> bool {
        self.title == schema["title"] && self.schema["properties"] == schema["properties"]
    }
}

/// The page.
pub fn page(schema: &Value) -> String {
    let mut kinds = Vec::new();
    collect(schema, &mut kinds);
    let mut page = HEAD.to_owned();
    for kind in &kinds {
        section(kind, &kinds, &mut page);
    }
    page
}

/// All kinds of objects below a schema, each once, in the order in which they first appear.
fn collect<'a>(schema: &'a Value, kinds: &mut Vec<Kind<'a>>) {
    if let (Some(title), Some(properties)) = (schema["title"].as_str(), schema["properties"].as_object()) {
        if !kinds.iter().any(|kind| kind.is(schema)) {
            let same = kinds.iter().filter(|kind| kind.title == title).count();
            let anchor = if same == 0 { slug(title) } else { format!("{}-{same}", slug(title)) };
            kinds.push(Kind { title, anchor, schema });
        }
        properties.values().for_each(|value| collect(value, kinds));
    }
    for key in ["items", "additionalProperties"] {
        schema.get(key).into_iter().for_each(|value| collect(value, kinds));
    }
    for key in ["oneOf", "anyOf"] {
        schema
            .get(key)
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .for_each(|value| collect(value, kinds));
    }
}

fn section(kind: &Kind, kinds: &[Kind], page: &mut String) {
    writeln!(page, "\n## {}\n", capital(kind.title)).expect("text");
    wrapped(kind.schema["description"].as_str().unwrap_or(""), page);
    page.push_str("\n| key | type | unit | meaning |\n| --- | --- | --- | --- |\n");
    let required: Vec<_> =
        kind.schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    for (name, value) in kind.schema["properties"].as_object().into_iter().flatten() {
        let (about, unit) = unit(value["description"].as_str().unwrap_or(""));
        let key =
            if required.contains(&name.as_str()) { format!("**`{name}`**") } else { format!("`{name}`") };
        writeln!(page, "| {key} | {} | {unit} | {about} |", shape(value, kinds)).expect("text");
    }
    if kind.title != "a scene" {
        writeln!(page, "\n```json\n{}\n```", example(kind.schema)).expect("text");
    }
}

/// The type, or the first of several: every number may also be a formula.
fn kind(schema: &Value) -> Option<&str> {
    schema["type"].as_str().or_else(|| schema["type"][0].as_str())
}

/// A type in words.
fn shape(schema: &Value, kinds: &[Kind]) -> String {
    if let Some(words) = schema["enum"].as_array() {
        return words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(" or ");
    }
    for key in ["oneOf", "anyOf"] {
        if let Some(parts) = schema[key].as_array() {
            return parts.iter().map(|part| shape(part, kinds)).collect::<Vec<_>>().join(", or ");
        }
    }
    match kind(schema) {
        Some("number") => format!("number{}", range(schema)),
        Some("string") if !schema["pattern"].is_null() => "name".to_owned(),
        Some("string") if schema["maxLength"] == 64 => "name of a body".to_owned(),
        Some("string") if schema["maxLength"] == 4096 => "formula".to_owned(),
        Some("string") => format!("text of at most {} characters", schema["maxLength"]),
        Some("array") => {
            let items = &schema["items"];
            let pair = schema["minItems"] == 2 && schema["maxItems"] == 2;
            match kind(items) {
                Some("number") if pair => format!("two numbers{}", range(items)),
                _ if pair => format!("two of {}", shape(items, kinds)),
                _ => format!("list of {}", shape(items, kinds)),
            }
        }
        Some("object") => match kinds.iter().find(|kind| kind.is(schema)) {
            Some(kind) => format!("[{}](#{})", kind.title, kind.anchor),
            None if schema["additionalProperties"] == json!(false) => {
                let keys = schema["properties"].as_object().into_iter().flatten();
                format!(
                    "object with {}",
                    keys.map(|(key, _)| format!("`{key}`")).collect::<Vec<_>>().join(", ")
                )
            }
            None => {
                let key = if schema["propertyNames"]["pattern"] == json!("^[A-Za-z0-9_-]{1,64}$") {
                    "name of a body"
                } else {
                    "name"
                };
                format!("object: {key} to {}", shape(&schema["additionalProperties"], kinds))
            }
        },
        other => panic!("the reference does not know how to tell {other:?}: {schema}"),
    }
}

/// A range that is not the usual one.
fn range(schema: &Value) -> String {
    let (least, most) = (schema["minimum"].as_f64(), schema["maximum"].as_f64());
    match (least, most) {
        (Some(least), Some(most)) if (least, most) != (-1e30, 1e30) => {
            format!(", {} to {}", short(least), short(most))
        }
        _ => String::new(),
    }
}

fn short(number: f64) -> String {
    if number == 0.0 || (1e-3..1e6).contains(&number.abs()) {
        format!("{number}")
    } else {
        format!("{number:e}")
    }
}

/// A description without its unit, and the unit.
fn unit(described: &str) -> (&str, &str) {
    match described.strip_suffix(']').and_then(|rest| rest.rsplit_once(" [")) {
        Some((about, unit)) => (about, unit),
        None => (described, ""),
    }
}

/// An element with its required keys, made of their examples.
fn example(schema: &Value) -> String {
    let required: Vec<_> =
        schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let all = schema["properties"].as_object().into_iter().flatten();
    let members: Vec<_> = all
        .filter(|(name, value)| {
            (required.is_empty() || required.contains(&name.as_str())) && !value["examples"].is_null()
        })
        .map(|(name, value)| format!("\"{name}\": {}", spaced(&value["examples"][0])))
        .collect();
    format!("{{{}}}", members.join(", "))
}

/// JSON on one line, with a space after each comma and colon.
fn spaced(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("[{}]", items.iter().map(spaced).collect::<Vec<_>>().join(", ")),
        Value::Object(members) => {
            let members: Vec<_> =
                members.iter().map(|(name, value)| format!("\"{name}\": {}", spaced(value))).collect();
            format!("{{{}}}", members.join(", "))
        }
        other => other.to_string(),
    }
}

fn capital(title: &str) -> String {
    let mut letters = title.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().collect::<String>() + letters.as_str())
        .unwrap_or_default()
}

/// The anchor of a heading.
pub fn slug(heading: &str) -> String {
    let kept = heading.chars().filter(|letter| letter.is_alphanumeric() || matches!(letter, ' ' | '-' | '_'));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

/// Text in lines of at most 100 characters.
fn wrapped(text: &str, page: &mut String) {
    let mut width = 0;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if width > 0 && width + 1 + length > 100 {
            page.push('\n');
            width = 0;
        }
        if width > 0 {
            page.push(' ');
            width += 1;
        }
        page.push_str(word);
        width += length;
    }
    page.push('\n');
}
