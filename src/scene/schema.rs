//! The JSON Schema of scene files, from the same tables that the reader uses.

use super::format::{LONGEST_NAME, LONGEST_TEXT, PLACE, Quantity, SCENE, Shape, Table};
use super::formula::{LONGEST, POINTS};
use serde_json::{Map, Value, json};

/// The JSON Schema (draft 2020-12) of scene files, with units, ranges and examples.
///
/// What a schema cannot say (names that exist, hinges that form a tree, a start that agrees with its motor)
/// is left to [`read_scene`](super::read_scene).
pub fn schema() -> Value {
    let mut schema = object(&SCENE);
    if let Value::Object(members) = &mut schema {
        members.shift_insert(0, "$schema".to_owned(), json!("https://json-schema.org/draft/2020-12/schema"));
    }
    schema
}

fn object(table: &Table) -> Value {
    let mut properties = Map::new();
    for field in table.fields {
        let mut property = shape(&field.shape);
        if let Value::Object(members) = &mut property {
            members.insert("description".to_owned(), json!(described(field.about, &field.shape)));
            // Long lists have no example that is JSON.
            if let Ok(example) = serde_json::from_str::<Value>(field.example) {
                members.insert("examples".to_owned(), json!([example]));
            }
        }
        properties.insert(field.name.to_owned(), property);
    }
    let required: Vec<_> =
        table.fields.iter().filter(|field| field.required).map(|field| field.name).collect();
    json!({
        "title": table.title,
        "description": table.about,
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

fn described(about: &str, shape: &Shape) -> String {
    match shape {
        Shape::Number(quantity)
        | Shape::Pair(quantity)
        | Shape::Inertia(quantity)
        | Shape::LawNumber(quantity)
        | Shape::LawPair(quantity)
        | Shape::Formula(quantity)
            if !quantity.unit.is_empty() =>
        {
            format!("{about} [{}]", quantity.unit)
        }
        _ => about.to_owned(),
    }
}

fn shape(of: &Shape) -> Value {
    match of {
        Shape::Number(quantity) | Shape::LawNumber(quantity) => number(quantity),
        Shape::Pair(quantity) | Shape::LawPair(quantity) => {
            json!({"type": "array", "items": number(quantity), "minItems": 2, "maxItems": 2})
        }
        Shape::Formula(_) => formula(),
        Shape::Parameters => {
            let number = json!({"anyOf": [{"type": "number"}, formula()]});
            json!({"type": "object", "propertyNames": identifier(), "additionalProperties": number})
        }
        Shape::Signals => {
            let number = json!({"type": ["number", "string"], "maxLength": LONGEST});
            json!({"type": "object", "propertyNames": identifier(), "additionalProperties": number})
        }
        Shape::Outputs => {
            let list = json!({"type": "array", "items": formula()});
            json!({"anyOf": [{"type": "object", "additionalProperties": formula()}, list]})
        }
        Shape::Tables => {
            let [least, most] = POINTS;
            let point = json!({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2});
            let text = json!({"type": "string", "minLength": 1, "maxLength": LONGEST_TEXT});
            let columns = json!({"type": "object", "properties": {"file": text, "x": text, "y": text},
                "required": ["file", "x", "y"], "additionalProperties": false});
            let points = json!({"type": "array", "items": point, "minItems": least, "maxItems": most});
            json!({"type": "object", "propertyNames": identifier(),
                "additionalProperties": {"anyOf": [points, text, columns]}})
        }
        Shape::Names => json!({"type": "array", "items": shape(&Shape::Name)}),
        Shape::Name => json!({"type": "string", "pattern": format!("^[A-Za-z0-9_-]{{1,{LONGEST_NAME}}}$")}),
        Shape::FolderName => {
            json!({"type": "string",
                "pattern": format!("^[A-Za-z0-9_][A-Za-z0-9_-]{{0,{}}}$", LONGEST_NAME - 1)})
        }
        Shape::Text => json!({"type": "string", "maxLength": LONGEST_TEXT}),
        Shape::Word(words) => json!({"enum": words}),
        Shape::SliderName => shape(&Shape::Name),
        Shape::Body { .. } => json!({"type": "string", "maxLength": LONGEST_NAME}),
        Shape::Inertia(quantity) => json!({"anyOf": [{"enum": ["full", "slender"]}, number(quantity)]}),
        Shape::Between => json!({"type": "array", "items": object(&PLACE), "minItems": 2, "maxItems": 2}),
        Shape::Object(table) => object(table),
        Shape::Law(table, _) => {
            let mut law = object(table);
            law["type"] = json!(["object", "string"]);
            law
        }
        Shape::List { of: tables, least, most } => {
            let kinds: Vec<_> = tables.iter().map(|table| object(table)).collect();
            let items = if let [one] = kinds.as_slice() { one.clone() } else { json!({"oneOf": kinds}) };
            let mut list = json!({"type": "array", "items": items, "minItems": least});
            if *most < usize::MAX {
                list["maxItems"] = json!(most);
            }
            list
        }
        Shape::ByBar(table) => json!({
            "type": "object",
            "propertyNames": shape(&Shape::Name),
            "additionalProperties": object(table),
        }),
    }
}

/// A number, or a formula that comes to one.
fn number(quantity: &Quantity) -> Value {
    let mut number =
        json!({"type": ["number", "string"], "minimum": quantity.least, "maximum": quantity.most});
    number["maxLength"] = json!(LONGEST);
    number
}

fn formula() -> Value {
    json!({"type": "string", "minLength": 1, "maxLength": LONGEST})
}

fn identifier() -> Value {
    json!({"type": "string", "pattern": format!("^[A-Za-z_][A-Za-z0-9_]{{0,{}}}$", LONGEST_NAME - 1)})
}
