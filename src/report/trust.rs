//! How far a run may be trusted, in numbers and in words.

use super::page::{Page, magnitude, rough, with_uncertainty};
use crate::dynamics::Mechanism;
use crate::run::Outcome;
use crate::run::trust::{HORIZON, How, LOST, Trust};
use serde_json::{Value, json};

/// The entry `trust` of a run's report: errors in rad, or as shares of the longest bar; times in s.  `null`
/// where there is no figure.
pub fn object(trust: Option<&Trust>) -> Value {
    let Some(trust) = trust else {
        return json!({"error_estimate": null, "horizon_s": null, "how": How::None.word(),
            "why": "not asked for"});
    };
    let from = match trust.how {
        How::Extrapolated(from) => Some(from),
        How::ReferenceSolution | How::None => None,
    };
    json!({
        "error_estimate": trust.error_estimate,
        "rate_error": trust.rate_error,
        "torque_error": trust.torque_error,
        "is_upper_bound": trust.is_upper_bound,
        "horizon_s": trust.horizon,
        "how": trust.how.word(),
        "at_s": trust.at,
        "tolerance": HORIZON,
        "lost_s": trust.lost,
        "companion": trust.error_estimator,
        "covered_s": trust.covered,
        "extrapolated_from_s": from,
        "why": trust.why,
        "lyapunov": trust.lyapunov.map(|found| json!({
            "exponent_per_s": found.exponent,
            "uncertainty_per_s": found.uncertainty,
            "until_s": found.until,
        })),
        "growth_power": trust.growth_power,
        "growth_why": trust.no_growth.as_ref().or(trust.unclear_growth.as_ref()),
        "input_error": trust.input_error,
        "inputs": super::inputs::object(trust.inputs.as_ref()),
        "model_error": trust.model_error,
        "not_judged": trust.shared,
    })
}

/// The same on a page.
pub fn describe(page: &mut Page, mechanism: &Mechanism, outcome: &Outcome) {
    let Some(trust) = &outcome.trust else {
        return page.entry("trust", "not asked for: --trust auto estimates the error");
    };
    estimate(page, mechanism, outcome, trust);
    if let Some(beside) = beside(trust) {
        page.entry("", &beside);
    }
    if trust.shared.len() > 1 {
        page.entry(
            "",
            &format!("not judged, as run and reference solution share them: {}", trust.shared.join(", ")),
        );
    }
    if let (Some(why), true) = (trust.cut(), trust.error_estimate.is_some()) {
        page.entry("", why);
    }
    if let Some(error) = trust.model_error {
        page.entry(
            "model",
            &format!(
                "springs taken for rods: off by about {} rad, more where errors grow, which no reference \
                    solution sees",
                magnitude(error)
            ),
        );
    }
    if let Some(lost) = trust.lost {
        page.entry("", &format!("more than {LOST} rad off from {} s on", rough(lost)));
    }
    growth(page, trust);
    if let Some(inputs) = &trust.inputs {
        super::inputs::describe(page, trust, inputs);
    } else if let Some(error) = trust.input_error {
        let what = match error < 1.0 {
            true => {
                format!("their last digit comes to about {} rad at {} s", magnitude(error), rough(trust.at))
            }
            false => format!("their last digit leaves no angle certain at {} s", rough(trust.at)),
        };
        page.entry("inputs", &what);
    }
}

/// The horizon, or the error at the end, or why there is neither.
fn estimate(page: &mut Page, mechanism: &Mechanism, outcome: &Outcome, trust: &Trust) {
    let what =
        if mechanism.has_translations() { "rad, and positions to as much of the longest bar" } else { "rad" };
    let source = match (trust.how, &trust.error_estimator) {
        (How::Extrapolated(from), _) => format!("carried on from t = {} s", rough(from)),
        (_, Some(name)) => format!("estimated beside {name}"),
        (_, None) => "estimated".into(),
    };
    match (trust.horizon, trust.error_estimate) {
        (Some(horizon), _) => {
            let growth = trust.lyapunov.map_or(String::new(), |found| {
                format!("; errors grow tenfold every {} s", rough(found.tenfold()))
            });
            page.entry(
                "trust",
                &format!("trusted until {} s ({HORIZON:e} rad, {source}){growth}", rough(horizon)),
            );
            page.entry("", &beyond(mechanism, outcome, horizon));
        }
        (None, Some(error)) => {
            page.entry(
                "trust",
                &format!(
                    "angles accurate to {} {} {what} at {} s ({source})",
                    how_near(trust.is_upper_bound),
                    magnitude(error),
                    rough(trust.at)
                ),
            );
            let how_far = match trust.is_beyond_model() {
                true => format!(
                    "not trusted to {HORIZON:e} rad: the model is off by more at {} s",
                    rough(trust.at)
                ),
                false => format!("trusted over the whole run, {} s", rough(trust.at)),
            };
            page.entry("", &how_far);
        }
        (None, None) => {
            let why = trust.why.as_deref().unwrap_or("nothing was to be compared");
            page.entry("trust", &format!("no estimate of the error at {} s: {why}", rough(trust.at)));
            if let Some([t, error]) = trust.record.last().filter(|point| point[0] > 0.0) {
                page.entry(
                    "",
                    &format!("typically {} rad at {} s ({source})", magnitude(1.2 * error), rough(*t)),
                );
            }
        }
    }
}

/// How errors grow.
fn growth(page: &mut Page, trust: &Trust) {
    if let Some(found) = trust.lyapunov {
        let [exponent, uncertainty] = with_uncertainty(found.exponent, found.uncertainty);
        page.entry(
            "lyapunov",
            &format!("largest exponent {exponent} ± {uncertainty} per s, over {} s", rough(found.until)),
        );
    }
    if let Some(power) = trust.growth_power {
        let how = if power < 0.05 {
            "errors do not grow".into()
        } else {
            format!("errors grow about as t^{power:.1}")
        };
        page.entry("growth", &format!("regular motion: {how}"));
    }
    if let Some(why) = trust.no_growth.as_ref().or(trust.unclear_growth.as_ref()) {
        page.entry("growth", &format!("not known: {why}"));
    }
}

/// How the estimate is to be read.
pub(super) fn how_near(is_upper_bound: bool) -> &'static str {
    if is_upper_bound { "at most about" } else { "typically" }
}

/// The errors of rates and torques, at the same time.
fn beside(trust: &Trust) -> Option<String> {
    let rate = trust.rate_error?;
    let torque =
        trust.torque_error.map_or(String::new(), |torque| format!(", torques to {} N·m", magnitude(torque)));
    let at = if trust.horizon.is_some() { "then " } else { "" };
    Some(format!("rates {at}to {} {} rad/s{torque}", how_near(trust.is_upper_bound), magnitude(rate)))
}

/// What still holds beyond the horizon.
fn beyond(mechanism: &Mechanism, outcome: &Outcome, horizon: f64) -> String {
    let drift = &outcome.drift;
    let kept = if drift.kind == "energy" { "Energy" } else { "Energy minus work" };
    let most = drift.constraints.iter().map(|(_, [position, _])| position.max).fold(0.0, f64::max);
    let rows = if mechanism.constraints.is_empty() {
        String::new()
    } else {
        format!(" and constraints ({})", magnitude(most))
    };
    let holds = if mechanism.constraints.is_empty() { "still holds" } else { "still hold" };
    format!(
        "After {} s read the path as a typical motion of the scene, not as the motion of this start. {kept} \
            (drift {}){rows} {holds}; use averages and \
         distributions, not angles at a time.",
        rough(horizon),
        magnitude(drift.energy.max)
    )
}
