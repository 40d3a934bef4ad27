//! The JSON Schema of scene files, from the same tables that the reader uses.

use super::format::{FieldShape, KeyTable, LONGEST_NAME, LONGEST_TEXT, PLACE, QuantityRange, SCENE};
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

fn object(table: &KeyTable) -> Value {
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

fn described(about: &str, shape: &FieldShape) -> String {
    match shape {
        FieldShape::Number(quantity)
        | FieldShape::Pair(quantity)
        | FieldShape::Inertia(quantity)
        | FieldShape::LawNumber(quantity)
        | FieldShape::LawPair(quantity)
        | FieldShape::Formula(quantity)
            if !quantity.unit.is_empty() =>
        {
            format!("{about} [{}]", quantity.unit)
        }
        _ => about.to_owned(),
    }
}

fn shape(of: &FieldShape) -> Value {
    match of {
        FieldShape::Number(quantity) | FieldShape::LawNumber(quantity) => number(quantity),
        FieldShape::Pair(quantity) | FieldShape::LawPair(quantity) => {
            json!({"type": "array", "items": number(quantity), "minItems": 2, "maxItems": 2})
        }
        FieldShape::Formula(_) => formula(),
        FieldShape::Parameters => {
            let number = json!({"anyOf": [{"type": "number"}, formula()]});
            json!({"type": "object", "propertyNames": identifier(), "additionalProperties": number})
        }
        FieldShape::Signals => {
            let number = json!({"type": ["number", "string"], "maxLength": LONGEST});
            json!({"type": "object", "propertyNames": identifier(), "additionalProperties": number})
        }
        FieldShape::Outputs => {
            let list = json!({"type": "array", "items": formula()});
            json!({"anyOf": [{"type": "object", "additionalProperties": formula()}, list]})
        }
        FieldShape::Tables => {
            let [least, most] = POINTS;
            let point = json!({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2});
            let text = json!({"type": "string", "minLength": 1, "maxLength": LONGEST_TEXT});
            let columns = json!({"type": "object", "properties": {"file": text, "x": text, "y": text},
                "required": ["file", "x", "y"], "additionalProperties": false});
            let points = json!({"type": "array", "items": point, "minItems": least, "maxItems": most});
            json!({"type": "object", "propertyNames": identifier(),
                "additionalProperties": {"anyOf": [points, text, columns]}})
        }
        FieldShape::Names => json!({"type": "array", "items": shape(&FieldShape::Name)}),
        FieldShape::Name => {
            json!({"type": "string", "pattern": format!("^[A-Za-z0-9_-]{{1,{LONGEST_NAME}}}$")})
        }
        FieldShape::FolderName => {
            json!({"type": "string",
                "pattern": format!("^[A-Za-z0-9_][A-Za-z0-9_-]{{0,{}}}$", LONGEST_NAME - 1)})
        }
        FieldShape::Text => json!({"type": "string", "maxLength": LONGEST_TEXT}),
        FieldShape::Word(words) => json!({"enum": words}),
        FieldShape::SliderName => shape(&FieldShape::Name),
        FieldShape::Body { .. } => json!({"type": "string", "maxLength": LONGEST_NAME}),
        FieldShape::Inertia(quantity) => json!({"anyOf": [{"enum": ["full", "slender"]}, number(quantity)]}),
        FieldShape::Between => {
            json!({"type": "array", "items": object(&PLACE), "minItems": 2, "maxItems": 2})
        }
        FieldShape::Object(table) => object(table),
        FieldShape::Law(table, _) => {
            let mut law = object(table);
            law["type"] = json!(["object", "string"]);
            law
        }
        FieldShape::List { of: tables, least, most } => {
            let kinds: Vec<_> = tables.iter().map(|table| object(table)).collect();
            let items = if let [one] = kinds.as_slice() { one.clone() } else { json!({"oneOf": kinds}) };
            let mut list = json!({"type": "array", "items": items, "minItems": least});
            if *most < usize::MAX {
                list["maxItems"] = json!(most);
            }
            list
        }
        FieldShape::ByBar(table) => json!({
            "type": "object",
            "propertyNames": shape(&FieldShape::Name),
            "additionalProperties": object(table),
        }),
    }
}

/// A number, or a formula that comes to one.
fn number(quantity: &QuantityRange) -> Value {
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
