//! Drift of energy and constraints as charts.

use super::Finished;
use crate::chart::{
    self, ChartError, ConstraintDrift, DriftSeries, EnergyDrift, FILE_RESOLUTION, Picture, ResidualPanel,
    plain,
};
use crate::dynamics::Mechanism;
use crate::report::page::{figure, magnitude};
use crate::run::Outcome;
use crate::run::drift::Excursion;
use crate::scene::Scene;

/// A record over so many decades of time is shown on a logarithmic axis.
const DECADES: f64 = 1.5;

/// Whether a constraint of any of the runs is off at all.
pub fn drifts(outcomes: &[&Outcome]) -> bool {
    let mut all = outcomes.iter().flat_map(|outcome| &outcome.drift.constraints);
    all.any(|(_, levels)| levels.iter().any(|level| level.max > 0.0))
}

/// Draws the constraint drift of several runs of one scene in one chart, a line for each stabilization and
/// constraint.
///
/// # Errors
/// Drawing fails.
pub fn overlay(scene: &Scene, mechanism: &Mechanism, outcomes: &[&Outcome]) -> Result<Picture, ChartError> {
    let moving: Vec<usize> = (0..mechanism.constraints.len())
        .filter(|&r| outcomes.iter().any(|outcome| is_off(outcome, r)))
        .collect();
    let rows = &mechanism.with_all_parts().constraints;
    let panel = |unit: &str, level: usize| ResidualPanel {
        name: defect_name(level, unit),
        series: (outcomes.iter())
            .flat_map(|outcome| {
                let kind = outcome.plan.stabilization.to_string();
                (outcome.drift.constraints.iter().enumerate())
                    .filter(|(r, _)| moving.contains(r) && rows[*r].unit() == unit)
                    .map(move |(r, (constraint, _))| {
                        let several = outcome.drift.constraints.len() > 1;
                        let name =
                            if several { format!("{kind}, {}", plain(constraint)) } else { kind.clone() };
                        Finished { scene, mechanism, outcome }.defects(r, level, kind.clone(), name)
                    })
            })
            .collect(),
    };
    let mut settings: Vec<String> =
        outcomes.iter().map(|outcome| plain(&crate::report::setting(&outcome.plan))).collect();
    settings.dedup();
    let chart = ConstraintDrift {
        title: format!("Constraint drift under {} stabilizations", outcomes.len()),
        caption: std::iter::once(format!("scene {}", plain(&scene.name)))
            .chain(settings)
            .chain(exactly_kept(mechanism, &moving))
            .collect(),
        panels: (units(mechanism).into_iter().flat_map(|unit| [panel(unit, 0), panel(unit, 1)]))
            .filter(|panel| !panel.series.is_empty())
            .collect(),
        log_time: outcomes.iter().any(|outcome| is_long(&outcome.drift.energy)),
    };
    chart::constraint_drift(&chart, FILE_RESOLUTION)
}

/// Whether a constraint was off at all in a run.
fn is_off(outcome: &Outcome, r: usize) -> bool {
    outcome.drift.constraints.get(r).is_some_and(|(_, levels)| levels.iter().any(|level| level.max > 0.0))
}

/// Names the constraints that are not drawn, as they are not among those that were off.
fn exactly_kept(mechanism: &Mechanism, off: &[usize]) -> Option<String> {
    let kept = mechanism.constraints.iter().enumerate().filter(|(r, _)| !off.contains(r));
    let names: Vec<String> = kept.map(|(_, row)| plain(row.name())).collect();
    (!names.is_empty()).then(|| format!("kept exactly: {}", names.join(", ")))
}

/// The units of the constraints, each with a row of panels.
fn units(mechanism: &Mechanism) -> Vec<&'static str> {
    mechanism.unit_of_rows().map_or(Vec::new(), |units| units.split(" or ").collect())
}

/// Name of the axis of violations at one level.
fn defect_name(level: usize, unit: &str) -> String {
    if level == 0 { format!("residual |*C*| [{unit}]") } else { format!("its rate |*C′*| [{unit}/s]") }
}

impl Finished<'_> {
    pub fn energy_drift(&self) -> EnergyDrift {
        let Outcome { plan, drift, last, .. } = self.outcome;
        let kind = if drift.kind == "energy" { "energy" } else { "energy balance" };
        let most = if drift.energy.max == 0.0 {
            "exactly 0".to_owned()
        } else {
            format!("at most {}", power(drift.energy.max))
        };
        EnergyDrift {
            title: format!("Relative error of the {kind}: {most} over {} s", figure(last.t)),
            caption: self.caption(Some(format!("scale {} J", figure(self.mechanism.energy_scale)))),
            quantity: drift.kind.to_owned(),
            series: vec![DriftSeries {
                method: plan.method.to_string(),
                name: plan.method.to_string(),
                time: drift.energy.record.iter().map(|point| point[0]).collect(),
                error: drift.energy.record.iter().map(|point| point[1]).collect(),
            }],
            log_time: is_long(&drift.energy),
        }
    }

    /// The constraints that are off at all; those kept exactly are named in the caption.
    pub fn constraint_drift(&self) -> ConstraintDrift {
        let Outcome { plan, drift, .. } = self.outcome;
        let off: Vec<usize> = (0..drift.constraints.len()).filter(|&r| is_off(self.outcome, r)).collect();
        let of = |unit: &'static str| {
            off.iter().copied().filter(move |&r| self.mechanism.constraints[r].unit() == unit)
        };
        let panel = |unit: &'static str, level: usize| ResidualPanel {
            name: defect_name(level, unit),
            series: of(unit)
                .map(|r| {
                    let constraint = &drift.constraints[r].0;
                    let method = if drift.constraints.len() == 1 {
                        plan.stabilization.to_string()
                    } else {
                        constraint.clone()
                    };
                    self.defects(r, level, method, plain(constraint))
                })
                .collect(),
        };
        let mut units = units(self.mechanism);
        units.retain(|unit| of(unit).next().is_some());
        let most = |unit: &'static str| of(unit).map(|r| drift.constraints[r].1[0].max).fold(0.0, f64::max);
        let kept: Vec<String> = units.iter().map(|unit| format!("{} {unit}", power(most(unit)))).collect();
        let kept =
            if kept.is_empty() { "exactly 0".to_owned() } else { format!("at most {}", kept.join(" and ")) };
        ConstraintDrift {
            title: format!("Constraint residuals: {kept} over {} s", figure(self.outcome.last.t)),
            caption: self.caption(exactly_kept(self.mechanism, &off)),
            panels: units.into_iter().flat_map(|unit| [panel(unit, 0), panel(unit, 1)]).collect(),
            log_time: is_long(&drift.energy),
        }
    }

    /// Violation of constraint `r` at one level (0 position, 1 velocity) against time.
    fn defects(&self, r: usize, level: usize, method: String, name: String) -> DriftSeries {
        // Thinned samples may have missed the largest ones; the record has not.
        let mut points: Vec<[f64; 2]> = self.outcome.drift.constraints[r].1[level].record.clone();
        let later = self.outcome.trace.whole.iter().filter(|sample| sample.t > 0.0);
        points.extend(later.map(|sample| [sample.t, sample.constraints[r][level]]));
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (time, error) = points.into_iter().map(|[t, error]| (t, error)).unzip();
        DriftSeries { method, name, time, error }
    }
}

fn is_long(record: &Excursion) -> bool {
    record
        .record
        .first()
        .zip(record.record.last())
        .is_some_and(|(first, last)| (last[0] / first[0]).log10() >= DECADES)
}

/// `1.5·10^{−16}`.
fn power(size: f64) -> String {
    match magnitude(size).split_once('e') {
        Some((digits, exponent)) => format!("{digits}·10^{{{}}}", exponent.replace('-', "−")),
        None => magnitude(size),
    }
}

#[cfg(test)]
mod tests {
    use super::power;

    #[test]
    fn sizes_become_powers_of_ten() {
        assert_eq!(power(1.52e-16), "1.5·10^{−16}");
        assert_eq!(power(0.0), "0");
    }
}
