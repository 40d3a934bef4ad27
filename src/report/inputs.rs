//! What the digits of a scene's numbers come to, in numbers and in words.

use super::page::{Page, counted, magnitude, rough};
use crate::run::Trust;
use crate::run::trust::{Input, Inputs};
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// Numbers shown on a page; the rest is summed up.
const SHOWN: usize = 16;

/// The entry `inputs` of `trust`: effects in rad, or as shares of the longest bar, at most a turn, with
/// `is_capped` where they are larger; `null` where they were not asked for.
pub fn object(inputs: Option<&Inputs>) -> Value {
    let Some(inputs) = inputs else { return Value::Null };
    let number = |input: &Input| {
        let mut number = json!({
            "path": input.path,
            "unit": input.unit,
            "value": input.value,
            "uncertainty": input.uncertainty,
            "effect_rad": input.effect.map(bounded),
            "is_upper_bound": input.is_upper_bound,
            "at": inputs.at,
            "why": input.why,
        });
        if input.effect.is_some_and(|effect| effect > TAU) {
            number["is_capped"] = Value::Bool(true);
        }
        number
    };
    let is_capped = inputs.total.is_some_and(|total| total > TAU);
    let mut object = json!({
        "at_s": inputs.at,
        "total_rad": inputs.total.map(bounded),
        "numbers": inputs.numbers.iter().map(number).collect::<Vec<_>>(),
        "unknown": inputs.unknown(),
        "runs": inputs.runs,
        "evaluations": inputs.evaluations,
        "why": inputs.why,
    });
    if is_capped {
        object["is_capped"] = Value::Bool(true);
    }
    object
}

/// An angle cannot be more uncertain than by a turn.
fn bounded(effect: f64) -> f64 {
    effect.min(TAU)
}

/// All digits of a number, the exponent apart where it is far from everyday size.
fn plain(x: f64) -> String {
    if (1e-5..1e9).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
}

/// The same on a page.
pub fn describe(page: &mut Page, trust: &Trust, inputs: &Inputs) {
    let cost = format!(
        "{}, {}",
        counted(inputs.runs, "run", "runs"),
        counted(inputs.evaluations, "evaluation", "evaluations")
    );
    let at = rough(inputs.at);
    let what = match inputs.total {
        Some(total) if total < 1.0 => {
            format!("their last digits as written come to about {} rad at {at} s ({cost})", magnitude(total))
        }
        Some(_) => format!("their last digits as written leave no angle certain at {at} s ({cost})"),
        None if inputs.why.is_none() && inputs.numbers.is_empty() => {
            "the scene has no uncertain number".into()
        }
        None => format!("what their last digits come to is not known ({cost})"),
    };
    page.entry("inputs", &what);
    if let Some(why) = &inputs.why {
        page.entry(
            "",
            &if inputs.at < trust.at && inputs.at > 0.0 {
                format!("not known beyond {at} s: {why}")
            } else {
                why.clone()
            },
        );
    }
    if inputs.numbers.is_empty() {
        return;
    }
    let row = |input: &Input| {
        let sign = if input.is_upper_bound { "< " } else { "" };
        let size = |effect: f64| if effect < TAU { magnitude(effect) } else { "a turn".into() };
        let effect = input.effect.map_or("not known".into(), |effect| format!("{sign}{}", size(effect)));
        vec![input.path.clone(), plain(input.value), plain(input.uncertainty), effect]
    };
    let known = inputs.numbers.len() - inputs.unknown();
    let rows: Vec<Vec<String>> = inputs.numbers.iter().take(known.min(SHOWN)).map(row).collect();
    if !rows.is_empty() {
        page.table(&["number", "value", "+-", "effect [rad]"], &rows);
    }
    if known > SHOWN {
        let rest = inputs.numbers[SHOWN..known]
            .iter()
            .filter_map(|input| input.effect)
            .map(|effect| effect * effect)
            .sum::<f64>()
            .sqrt();
        page.entry("", &format!("and {} more, {} rad together", known - SHOWN, magnitude(bounded(rest))));
    }
    for input in inputs.numbers.iter().skip(known).take(SHOWN) {
        page.entry(
            "",
            &format!("{}: not known, {}", input.path, input.why.as_deref().unwrap_or("nothing was compared")),
        );
    }
    if inputs.unknown() > SHOWN {
        page.entry("", &format!("and {} more of which nothing is known", inputs.unknown() - SHOWN));
    }
}
