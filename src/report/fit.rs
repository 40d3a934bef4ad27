//! A fit as a page, a JSON object, a table and charts.

use super::page::{Page, counted, figure, magnitude, rough};
#[cfg(feature = "charts")]
use crate::chart::{self, Band, Bands, ChartError, FILE_RESOLUTION, Picture, plain};
use crate::run::fit::{Fit, FittedColumn};
use serde_json::{Value, json};
use std::fmt::Write;

/// The options that set a scene to the fitted numbers.
pub fn options(found: &Fit) -> String {
    let set = found.numbers.iter().map(|number| format!("--set {}={:?}", number.path, number.value));
    set.collect::<Vec<_>>().join(" ")
}

/// One object: `numbers`, `covariance`, `columns`, `chi_square`, `degrees_of_freedom`, `ended`, `doubts`,
/// `set`.
pub fn object(found: &Fit) -> Value {
    json!({
        "scene": found.scene.name,
        "numbers": found.numbers.iter().map(|number| json!({
            "path": number.path, "unit": number.unit, "guess": number.guess, "value": number.value,
            "error": number.error, "at_bound": number.is_at_bound,
        })).collect::<Vec<_>>(),
        "covariance": found.covariance.row_iter()
            .map(|row| row.iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>(),
        "columns": found.columns.iter().map(|column| json!({
            "name": column.name, "unit": column.unit, "sigma": column.sigma, "is_given": column.is_given,
            "rms": column.rms(),
        })).collect::<Vec<_>>(),
        "ignored": found.ignored,
        "chi_square": found.chi_square,
        "degrees_of_freedom": found.degrees_of_freedom,
        "segments": found.segments,
        "gap": if found.segments > 1 { json!(found.gap) } else { Value::Null },
        "runs": found.runs,
        "ended": found.ended,
        "doubts": found.doubts,
        "set": options(found),
    })
}

#[cfg(feature = "charts")]
fn residuals(column: &FittedColumn) -> impl Iterator<Item = Option<f64>> {
    column
        .measured
        .iter()
        .zip(&column.model)
        .map(|(measured, model)| measured.map(|measured| measured - model))
}

/// The page.
pub fn text(found: &Fit) -> String {
    let mut page = Page::new(&found.scene.name, &found.scene.description);
    let rows: Vec<Vec<String>> = (found.numbers.iter())
        .map(|number| {
            let name = if number.unit.is_empty() {
                number.path.clone()
            } else {
                format!("{} [{}]", number.path, number.unit)
            };
            let error = if number.is_at_bound { "at its bound".into() } else { rough(number.error) };
            vec![name, figure(number.guess), format!("{:.9}", Significant(number.value)), error]
        })
        .collect();
    page.entry("fitted", &found.ended);
    if let Some(doubts) = &found.doubts {
        page.entry("doubtful", doubts);
    }
    page.table(&["number", "guess", "value", "std. error"], &rows);
    let rows: Vec<Vec<String>> = (found.columns.iter())
        .map(|column| {
            let name = format!("{} [{}]", column.name, column.unit);
            if column.count() == 0 {
                return vec![name, "no values".into(), String::new()];
            }
            let sigma = format!("{}{}", rough(column.sigma), if column.is_given { "" } else { " (found)" });
            vec![name, rough(column.rms()), sigma]
        })
        .collect();
    page.entry("columns", "residuals and the noise they were weighted with");
    page.table(&["column", "rms", "sigma"], &rows);
    page.entry("sigma", &sigma(found));
    if found.segments > 1 {
        let text = format!("{}, tied together within {}", found.segments, magnitude(found.gap));
        page.entry("segments", &text);
    }
    if !found.ignored.is_empty() {
        page.entry(
            "left out",
            &format!("columns that mean nothing in the scene: {}", found.ignored.join(", ")),
        );
    }
    correlations(&mut page, found);
    page.entry("options", "");
    page.into_text() + &options(found) + "\n"
}

/// How much of the errors of several numbers is shared.
fn correlations(page: &mut Page, found: &Fit) {
    let names: Vec<&str> = found.numbers.iter().map(|number| number.path.as_str()).collect();
    if names.len() < 2 {
        return;
    }
    page.entry("correlations", "");
    let rows: Vec<Vec<String>> = (0..names.len())
        .map(|i| {
            let entry = |j: usize| {
                let share = found.covariance[(i, j)] / (found.numbers[i].error * found.numbers[j].error);
                if share.is_nan() { "-".into() } else { format!("{share:.3}") }
            };
            std::iter::once(names[i].to_owned()).chain((0..names.len()).map(entry)).collect()
        })
        .collect();
    page.table(&[&[""], &names[..]].concat(), &rows);
}

/// A number to so many significant digits.
struct Significant(f64);

impl std::fmt::Display for Significant {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = f.precision().unwrap_or(6) as i32;
        let size = self.0.abs();
        if self.0 != 0.0 && !(1e-4..1e9).contains(&size) {
            return write!(f, "{:.*e}", digits as usize - 1, self.0);
        }
        let whole = if size > 0.0 { libm::floor(libm::log10(size)) as i32 } else { 0 };
        write!(f, "{:.*}", (digits - 1 - whole).max(0) as usize, self.0)
    }
}

/// Data, fitted motion and residuals, row by row.
pub fn table(found: &Fit) -> String {
    let mut text = String::from("t [s]");
    for FittedColumn { name, unit, .. } in &found.columns {
        let _ = write!(text, ",{name} [{unit}],{name} fitted [{unit}],{name} residual [{unit}]");
    }
    text.push('\n');
    for (k, t) in found.times.iter().enumerate() {
        let _ = write!(text, "{t:?}");
        for column in &found.columns {
            let cell = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:?}"));
            let (measured, model) = (column.measured[k], column.model[k]);
            let residual = measured.map(|measured| measured - model);
            let _ = write!(text, ",{},{model:?},{}", cell(measured), cell(residual));
        }
        text.push('\n');
    }
    text
}

/// Where the noise is from, and chi square where it is given: with that of the residuals it tests nothing.
fn sigma(found: &Fit) -> String {
    let freedom = counted(found.degrees_of_freedom as u64, "degree of freedom", "degrees of freedom");
    match found.columns.iter().all(|column| column.is_given) {
        true => format!("given: chi square {} at {freedom}", rough(found.chi_square)),
        false => format!("found from the residuals, {freedom}"),
    }
}

/// The fitted motion through the data, and the residuals.
///
/// # Errors
/// Drawing fails.
#[cfg(feature = "charts")]
pub fn charts(found: &Fit) -> Result<Vec<(&'static str, Picture)>, ChartError> {
    let caption = vec![format!("scene {}", plain(&found.scene.name)), format!("sigma {}", sigma(found))];
    let unit = |column: &FittedColumn| plain(&column.unit).replace(' ', "·");
    let dots = |values: &mut dyn Iterator<Item = Option<f64>>| {
        found.times.iter().zip(values).filter_map(|(&t, value)| Some([t, value?])).collect::<Vec<_>>()
    };
    let fitted = |column: &FittedColumn| Band {
        name: format!("{} [{}]", plain(&column.name), unit(column)),
        time: found.times.clone(),
        value: column.model.clone(),
        dots: dots(&mut column.measured.iter().copied()),
        ..Band::default()
    };
    let left = |column: &FittedColumn| Band {
        name: format!("{} [{}]", plain(&column.name), unit(column)),
        dots: dots(&mut residuals(column)),
        zero: true,
        ..Band::default()
    };
    let chart = |title: &str, key: &str, bands: Vec<Band>| Bands {
        title: title.into(),
        caption: [caption.clone(), vec![key.to_owned()]].concat(),
        bands,
    };
    let fits = chart(
        "Fitted motion and data",
        "dots: data, line: fitted motion at the times of the data",
        found.columns.iter().map(fitted).collect(),
    );
    let residuals =
        chart("Residuals: data minus fitted motion", "", found.columns.iter().map(left).collect());
    Ok(vec![
        ("fit", chart::bands(&fits, FILE_RESOLUTION)?),
        ("residuals", chart::bands(&residuals, FILE_RESOLUTION)?),
    ])
}
