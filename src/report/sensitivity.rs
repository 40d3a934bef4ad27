//! Sensitivities and Lyapunov spectra as pages, JSON objects, tables and charts.

use super::page::{Page, counted, figure, magnitude, rough, with_uncertainty};
#[cfg(feature = "charts")]
use crate::chart::{
    self, Band, Bands, BarGroup, Bars, ChartError, FILE_RESOLUTION, OutputSeries, OutputsChart, Picture,
    plain,
};
#[cfg(feature = "charts")]
use crate::run::sensitivity::InputNumber;
use crate::run::sensitivity::{Measured, Regime, Sensitivity, Spectrum};
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// Names of pictures with what they show.
#[cfg(feature = "charts")]
pub type Charts = Vec<(&'static str, Picture)>;

/// Unit of a derivative.
fn ratio(of: &str, to: &str) -> String {
    match (of, to) {
        (of, "") => of.to_owned(),
        (of, to) if of == to => "1".to_owned(),
        // A rate by its quantity: rad/s by rad is 1/s.
        (of, to) if of.strip_prefix(to).is_some_and(|rest| rest.starts_with('/')) => {
            format!("1{}", &of[to.len()..])
        }
        (of, to) if to.strip_prefix(of).is_some_and(|rest| rest.starts_with('/')) => {
            to[of.len() + 1..].to_owned()
        }
        ("1" | "", to) => format!("1/({to})"),
        (of, to) if to.contains([' ', '/', '·']) => format!("{of}/({to})"),
        (of, to) => format!("{of}/{to}"),
    }
}

/// One object: `inputs`, `measures` with a derivative for each, `deviations` where numbers are uncertain.
pub fn object(found: &Sensitivity, deviations: &[f64]) -> Value {
    let measure = |measured: &Measured| {
        let slopes = found.inputs.iter().zip(&measured.slopes);
        let slopes: Map<String, Value> =
            slopes.map(|(input, slope)| (input.path.clone(), json!(slope))).collect();
        let mut object = json!({
            "name": measured.name, "unit": measured.unit, "t": finite(measured.t),
            "value": finite(measured.value), "derivatives": slopes,
        });
        if !deviations.is_empty() {
            object["sigma"] = json!(deviation(&measured.slopes, deviations));
        }
        if let Some(why) = &measured.why {
            object["why"] = json!(why);
        }
        object
    };
    json!({
        "scene": found.scene.name,
        "until": found.until,
        "inputs": found.inputs.iter().map(|input| json!({
            "path": input.path, "unit": input.unit, "value": input.value, "relative_error": input.error,
        })).collect::<Vec<_>>(),
        "measures": found.measures.iter().map(measure).collect::<Vec<_>>(),
        "uncertainties": found.inputs.iter().zip(deviations)
            .filter(|(_, sigma)| **sigma > 0.0)
            .map(|(input, sigma)| (input.path.clone(), json!(sigma))).collect::<Map<_, _>>(),
        "lost": found.lost,
        "steps": found.steps[0],
        "by_series": found.by_series,
    })
}

fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn deviation(slopes: &[f64], deviations: &[f64]) -> f64 {
    slopes.iter().zip(deviations).map(|(slope, sigma)| (slope * sigma).powi(2)).sum::<f64>().sqrt()
}

/// The page.
pub fn text(found: &Sensitivity, deviations: &[f64]) -> String {
    let mut page = Page::new(&found.scene.name, &found.scene.description);
    for measured in &found.measures {
        let value = match &measured.why {
            Some(why) => format!("not known: {why}"),
            None => {
                let sigma = match deviations.is_empty() {
                    true => String::new(),
                    false => format!(" ± {}", rough(deviation(&measured.slopes, deviations))),
                };
                let at = if measured.value == measured.t && measured.unit == "s" {
                    String::new()
                } else {
                    format!(" at {} s", figure(measured.t))
                };
                format!("{}{sigma} {}{at}", figure(measured.value), measured.unit)
            }
        };
        page.entry(&measured.name, &value);
        if measured.why.is_some() {
            continue;
        }
        let rows: Vec<Vec<String>> = (found.inputs.iter().zip(&measured.slopes))
            .map(|(input, slope)| {
                let unit = ratio(&measured.unit, &input.unit);
                vec![input.path.clone(), figure(*slope), unit, rough(percent(input.value) * slope)]
            })
            .collect();
        page.table(&["by", "derivative", "unit", "for 1 %"], &rows);
    }
    let worst = found.inputs.iter().map(|input| input.error).fold(0.0, f64::max);
    page.entry(
        "accuracy",
        &format!("derivatives of the equations to {} or better", magnitude(worst.max(1e-13))),
    );
    if !found.rows.is_empty() {
        page.entry("over time", &counted(found.rows.len() as u64, "row", "rows"));
    }
    if let Some(lost) = &found.lost {
        page.entry("ended", lost);
    }
    page.into_text()
}

/// One per cent of a number, or a hundredth of its unit where it is zero.
fn percent(value: f64) -> f64 {
    0.01 * if value == 0.0 { 1.0 } else { value.abs() }
}

/// Outputs over time with their derivatives, and standard deviations where numbers are uncertain.
pub fn table(found: &Sensitivity, deviations: &[f64]) -> String {
    let mut text = String::from("t [s]");
    for [name, unit] in &found.outputs {
        let _ = write!(text, ",{name} [{unit}]");
        for input in &found.inputs {
            let _ = write!(text, ",d {name}/d {} [{}]", input.path, ratio(unit, &input.unit));
        }
        if !deviations.is_empty() {
            let _ = write!(text, ",sigma {name} [{unit}]");
        }
    }
    text.push('\n');
    for row in &found.rows {
        let _ = write!(text, "{:?}", row.t);
        for (value, slopes) in row.values.iter().zip(&row.slopes) {
            let _ = write!(text, ",{value:?}");
            for slope in slopes {
                let _ = write!(text, ",{slope:?}");
            }
            if !deviations.is_empty() {
                let _ = write!(text, ",{:?}", deviation(slopes, deviations));
            }
        }
        text.push('\n');
    }
    text
}

/// Bars, and over time derivatives and bands.
///
/// # Errors
/// Drawing fails.
#[cfg(feature = "charts")]
pub fn charts(found: &Sensitivity, deviations: &[f64]) -> Result<Charts, ChartError> {
    let caption = vec![format!("scene {}", plain(&found.scene.name))];
    let bars = |measured: &Measured| -> Vec<(String, f64)> {
        let of = |(k, input): (usize, &InputNumber)| {
            let slope = measured.slopes.get(k).copied().unwrap_or(f64::NAN);
            (plain(&input.path), percent(input.value) * slope)
        };
        let mut bars: Vec<_> = found.inputs.iter().enumerate().map(of).collect();
        // The largest first, those that are not known last.
        let size = |bar: &(String, f64)| if bar.1.is_nan() { -1.0 } else { bar.1.abs() };
        bars.sort_by(|a, b| size(b).total_cmp(&size(a)));
        bars
    };
    let group = |measured: &Measured| BarGroup {
        name: plain(&measured.name),
        unit: plain(&measured.unit).replace(' ', "·"),
        bars: bars(measured),
    };
    let of_percent =
        "change for 1 % more of each number, or a hundredth of its unit where it is 0".to_owned();
    let bars = Bars {
        title: titled(found),
        caption: [caption.clone(), vec![of_percent.clone()]].concat(),
        groups: found.measures.iter().map(group).collect(),
    };
    let mut all = vec![("sensitivity", chart::bars(&bars, FILE_RESOLUTION)?)];
    if found.rows.is_empty() {
        return Ok(all);
    }
    let time: Vec<f64> = found.rows.iter().map(|row| row.t).collect();
    let mut series = Vec::new();
    for (k, [name, unit]) in found.outputs.iter().enumerate() {
        for (j, input) in found.inputs.iter().enumerate() {
            series.push(OutputSeries {
                name: format!("{} by {}", plain(name), plain(short(&input.path))),
                unit: plain(unit).replace(' ', "·"),
                time: time.clone(),
                value: found.rows.iter().map(|row| percent(input.value) * row.slopes[k][j]).collect(),
                extremes: Vec::new(),
            });
        }
    }
    let over_time = OutputsChart {
        title: "Sensitivities over time".into(),
        caption: [caption.clone(), vec![of_percent]].concat(),
        outputs: series,
        quantity: Some("change".to_owned()),
        ..OutputsChart::default()
    };
    all.push(("sensitivity_time", chart::outputs(&over_time, FILE_RESOLUTION)?));
    if !deviations.is_empty() {
        let bands = found.bands(deviations);
        let band = |(k, [name, unit]): (usize, &[String; 2])| Band {
            name: format!("{} [{}]", plain(name), plain(unit).replace(' ', "·")),
            time: time.clone(),
            value: found.rows.iter().map(|row| row.values[k]).collect(),
            half_width: bands.iter().map(|row| 2.0 * row[k]).collect(),
            ..Band::default()
        };
        let chart = Bands {
            title: "Outputs with their uncertainty".into(),
            caption: [caption, vec!["bands of two standard deviations, to first order".into()]].concat(),
            bands: found.outputs.iter().enumerate().map(band).collect(),
        };
        all.push(("uncertainty", chart::bands(&chart, FILE_RESOLUTION)?));
    }
    Ok(all)
}

/// A title with the time of what is derived, where all is of one time.
#[cfg(feature = "charts")]
fn titled(found: &Sensitivity) -> String {
    let mut times = found.measures.iter().map(|measured| measured.t).filter(|t| t.is_finite());
    match times.next() {
        Some(first) if times.all(|t| t == first) => format!("Sensitivities at {} s", figure(first)),
        _ => format!("Sensitivities within {} s", figure(found.until)),
    }
}

/// A path without the list it begins with: `spring.stiffness` of `springs.spring.stiffness`.
#[cfg(feature = "charts")]
fn short(path: &str) -> &str {
    path.split_once('.')
        .map_or(path, |(list, rest)| if list != "start" && rest.contains('.') { rest } else { path })
}

/// One object of a spectrum.
pub fn spectrum_object(found: &Spectrum) -> Value {
    json!({
        "scene": found.scene.name,
        "until": found.until,
        "exponents": found.exponents,
        "errors": found.errors,
        "sum": found.sum,
        "expected_sum": found.expected_sum,
        "defect": found.defect(),
        "regime": found.regime,
        "why": found.why,
        "lost": found.lost,
    })
}

/// The page of a spectrum.
pub fn spectrum_text(found: &Spectrum) -> String {
    let mut page = Page::new(&found.scene.name, &found.scene.description);
    let regime = match found.regime {
        Regime::Chaotic => {
            let largest = found.exponents.first().copied().unwrap_or(f64::NAN);
            format!("chaotic: small differences grow tenfold every {} s", rough(10.0_f64.ln() / largest))
        }
        Regime::Regular => "regular: small differences grow no faster than a power of the time".into(),
        Regime::Undecided => format!("undecided: {}", found.why.unwrap_or_default()),
    };
    page.entry("motion", &regime);
    page.entry("integrated", &format!("{} s", figure(found.until)));
    let rows: Vec<Vec<String>> = (found.exponents.iter().zip(&found.errors).enumerate())
        .map(|(k, (exponent, error))| {
            let [exponent, error] = with_uncertainty(*exponent, *error);
            vec![(k + 1).to_string(), exponent, error]
        })
        .collect();
    page.table(&["exponent", "[1/s]", "± [1/s]"], &rows);
    page.entry(
        "sum",
        &format!(
            "{} 1/s; by the dissipation of the scene {} 1/s",
            // A sum that is rounding has no more digits.
            if found.sum.abs() < 1e-9 { magnitude(found.sum) } else { figure(found.sum) },
            if found.expected_sum == 0.0 { "0".into() } else { figure(found.expected_sum) }
        ),
    );
    page.entry("", &format!("the difference is {} of the largest exponent", magnitude(found.defect())));
    if let Some(lost) = &found.lost {
        page.entry("ended", lost);
    }
    page.into_text()
}

/// The exponents so far, row by row.
pub fn spectrum_table(found: &Spectrum) -> String {
    let mut text = String::from("t [s]");
    for k in 0..found.exponents.len() {
        let _ = write!(text, ",lambda{} [1/s]", k + 1);
    }
    text.push('\n');
    for (t, exponents) in &found.rows {
        let _ = write!(text, "{t:?}");
        exponents.iter().for_each(|exponent| {
            let _ = write!(text, ",{exponent:?}");
        });
        text.push('\n');
    }
    text
}

/// The exponents so far over time.
///
/// # Errors
/// Drawing fails.
#[cfg(feature = "charts")]
pub fn spectrum_charts(found: &Spectrum) -> Result<Charts, ChartError> {
    let series = |k: usize| OutputSeries {
        name: format!("*λ*_{{{}}}", k + 1),
        unit: "1/s".into(),
        time: found.rows.iter().map(|row| row.0).collect(),
        value: found.rows.iter().map(|row| row.1[k]).collect(),
        extremes: Vec::new(),
    };
    let chart = OutputsChart {
        title: "Lyapunov exponents".into(),
        caption: vec![
            format!("scene {}", plain(&found.scene.name)),
            "means from the start on, scaled to their second half".to_owned(),
            format!("their sum {} 1/s", magnitude(found.sum)),
        ],
        outputs: (0..found.exponents.len()).map(series).collect(),
        quantity: Some("exponent".to_owned()),
        settled_from: found.rows.last().map(|row| 0.5 * row.0),
        ..OutputsChart::default()
    };
    Ok(vec![("lyapunov", chart::outputs(&chart, FILE_RESOLUTION)?)])
}
