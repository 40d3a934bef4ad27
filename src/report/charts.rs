//! A run in pictures: which charts it has, and what they show.

use super::drawing::Drawing;
use crate::chart::{
    self, AngleSeries, Angles, ChartError, ConstraintDrift, DriftSeries, EnergyDrift, FILE_RESOLUTION,
    MechanismChart, MotionGif, MotorSeries, OutputSeries, OutputsChart, Pose, ResidualPanel, TorquePower,
    plain,
};
use crate::dynamics::Mechanism;
use crate::dynamics::constraint::ConstraintEquation;
use crate::report::curves::{between, furthest, is_coarse, smoothed, span};
use crate::report::page::{figure, magnitude, rough};
use crate::run::drift::Excursion;
use crate::run::{Outcome, Sample};
use crate::scene::{Place, Scene};
use std::f64::consts::TAU;

/// A chart of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chart {
    /// The mechanism at the end, and the way there.
    Mechanism,
    /// Angles against time.
    Angles,
    /// Energy drift against time.
    EnergyDrift,
    /// Constraint drift against time.
    ConstraintDrift,
    /// Torque and power of the motors against time.
    TorquePower,
    /// Outputs against time.
    Outputs,
    /// The mechanism in motion.
    Motion,
}

impl Chart {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Mechanism,
        Self::Angles,
        Self::EnergyDrift,
        Self::ConstraintDrift,
        Self::TorquePower,
        Self::Outputs,
        Self::Motion,
    ];

    /// Name of its file.
    pub fn file(self) -> &'static str {
        match self {
            Self::Mechanism => "mechanism.png",
            Self::Angles => "angles.png",
            Self::EnergyDrift => "energy_drift.png",
            Self::ConstraintDrift => "constraint_drift.png",
            Self::TorquePower => "torque_power.png",
            Self::Outputs => "outputs.png",
            Self::Motion => "mechanism.gif",
        }
    }
}

/// The charts a scene has something to show in: none of constraints without constraints, none of torques
/// without motors.
pub fn wanted(mechanism: &Mechanism, pictures: bool, motion: bool) -> Vec<Chart> {
    let driven = mechanism.constraints.iter().any(ConstraintEquation::is_motor);
    let has = |chart: &Chart| match chart {
        Chart::Mechanism | Chart::Angles | Chart::EnergyDrift => pictures,
        Chart::ConstraintDrift => pictures && !mechanism.constraints.is_empty(),
        Chart::TorquePower => pictures && driven,
        Chart::Outputs => pictures && mechanism.outputs.is_some(),
        Chart::Motion => motion,
    };
    Chart::ALL.into_iter().filter(has).collect()
}

/// Draws one chart; returns the content of its file.
///
/// # Errors
/// Drawing or encoding fails.
pub fn draw(
    chart: Chart,
    scene: &Scene,
    mechanism: &Mechanism,
    outcome: &Outcome,
) -> Result<Vec<u8>, ChartError> {
    let run = Finished { scene, mechanism, outcome };
    let picture = match chart {
        Chart::Mechanism => chart::mechanism(&run.mechanism_chart(), FILE_RESOLUTION),
        Chart::Angles => chart::angles(&run.angles(), FILE_RESOLUTION),
        Chart::EnergyDrift => chart::energy_drift(&run.energy_drift(), FILE_RESOLUTION),
        Chart::ConstraintDrift => chart::constraint_drift(&run.constraint_drift(), FILE_RESOLUTION),
        Chart::TorquePower => {
            let (chart, sliders) = run.torque_power();
            chart::force_power(&chart, &sliders, FILE_RESOLUTION)
        }
        Chart::Outputs => chart::outputs(&run.outputs(), FILE_RESOLUTION),
        Chart::Motion => return Ok(chart::motion_gif(&run.motion())?.bytes),
    };
    picture?.png_bytes()
}

/// Draws the constraint drift of several runs of one scene in one chart, a line for each stabilization and
/// constraint; returns the content of its file.
///
/// # Errors
/// Drawing or encoding fails.
pub fn overlay(scene: &Scene, mechanism: &Mechanism, outcomes: &[&Outcome]) -> Result<Vec<u8>, ChartError> {
    let panel = |unit: &str, level: usize| ResidualPanel {
        name: defect_name(level, unit),
        series: (outcomes.iter())
            .flat_map(|outcome| {
                let kind = outcome.plan.stabilization.to_string();
                (outcome.drift.constraints.iter().enumerate())
                    .filter(|(r, _)| mechanism.constraints[*r].unit() == unit)
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
        outcomes.iter().map(|outcome| plain(&super::setting(&outcome.plan))).collect();
    settings.dedup();
    let chart = ConstraintDrift {
        title: format!("Constraint drift under {} stabilizations", outcomes.len()),
        caption: std::iter::once(format!("scene {}", plain(&scene.name))).chain(settings).collect(),
        panels: units(mechanism).into_iter().flat_map(|unit| [panel(unit, 0), panel(unit, 1)]).collect(),
        log_time: outcomes.iter().any(|outcome| is_long(&outcome.drift.energy)),
    };
    chart::constraint_drift(&chart, FILE_RESOLUTION)?.png_bytes()
}

/// The units of the constraints, each with a row of panels.
fn units(mechanism: &Mechanism) -> Vec<&'static str> {
    mechanism.unit_of_rows().map_or(Vec::new(), |units| units.split(" or ").collect())
}

/// Name of the axis of violations at one level.
fn defect_name(level: usize, unit: &str) -> String {
    if level == 0 { format!("|*C*| [{unit}]") } else { format!("|*C′*| [{unit}/s]") }
}

/// Most it may turn in a window of time that shows single swings \[rad\], and how much is shown instead.
const CROWDED: [f64; 2] = [40.0 * TAU, 12.0 * TAU];
/// How far the fastest body turns along the path shown \[rad\].
const PATH: f64 = 4.0 * TAU;
/// How far it turns between ghosts \[rad\].
const GHOST: f64 = 0.4;
/// Ghosts shown.
const GHOSTS: usize = 5;
/// Frames of an animation and their delay \[1/100 s\].
const FRAMES: usize = 250;
const DELAY: u16 = 4;
/// How far the fastest body may turn in an animation that is neither slowed down nor sped up \[rad\].
const LIVELY: [f64; 2] = [0.5, 20.0 * TAU];
/// A record over so many decades of time is shown on a logarithmic axis.
const DECADES: f64 = 1.5;

/// A run and all that belongs to it.
struct Finished<'a> {
    scene: &'a Scene,
    mechanism: &'a Mechanism,
    outcome: &'a Outcome,
}

impl Finished<'_> {
    fn drawing(&self) -> Drawing<'_> {
        Drawing { scene: self.scene, mechanism: self.mechanism }
    }

    fn caption(&self, more: Option<String>) -> Vec<String> {
        let plan = &self.outcome.plan;
        let mut caption = vec![format!("scene {}", plain(&self.scene.name)), plain(&super::setting(plan))];
        if !self.mechanism.constraints.is_empty() {
            caption.push(plain(&super::check::stabilization(self.mechanism, plan)));
        }
        caption.extend(more);
        caption
    }

    /// The time up to which the path can be trusted \[s\], where that ends before `end`; and what to say
    /// about it.
    fn horizon(&self, end: f64) -> (Option<f64>, Option<String>) {
        let horizon =
            self.outcome.trust.as_ref().and_then(|trust| trust.horizon).filter(|&horizon| horizon < end);
        (horizon, horizon.map(|horizon| format!("pale beyond the trust horizon, {} s", rough(horizon))))
    }

    /// Samples in which single swings can be told apart: of the whole run, or else of its beginning; and what
    /// to say about it.
    fn window(&self) -> (Vec<&Sample>, Option<String>) {
        let trace = &self.outcome.trace;
        let whole: Vec<&Sample> = trace.whole.iter().collect();
        if !is_coarse(&whole)
            && whole.windows(2).map(|pair| furthest(pair[0], pair[1])).sum::<f64>() <= CROWDED[0]
        {
            return (whole, None);
        }
        let mut turned = 0.0;
        let mut window: Vec<&Sample> = Vec::new();
        for sample in &trace.head {
            turned += window.last().map_or(0.0, |before| furthest(before, sample));
            if turned > CROWDED[1] && window.len() > 1 {
                break;
            }
            window.push(sample);
        }
        let span = span(&window);
        (window, Some(format!("first {} s of {} s", rough(span), figure(self.outcome.last.t))))
    }

    /// The last samples, as far back as the fastest body turns by `PATH`.
    fn path(&self) -> Vec<&Sample> {
        let mut turned = 0.0;
        let mut path: Vec<&Sample> = Vec::new();
        for sample in self.outcome.trace.tail.iter().rev() {
            if let Some(after) = path.last() {
                turned += furthest(sample, after);
            }
            if turned > PATH {
                break;
            }
            path.push(sample);
        }
        path.reverse();
        path
    }

    fn mechanism_chart(&self) -> MechanismChart {
        let path = self.path();
        let coarse = is_coarse(&path);
        let drawing = self.drawing();
        let traced = drawing.traced();
        let trails = if coarse {
            Vec::new()
        } else {
            let smooth = smoothed(&path);
            let trail = |place: &Place| smooth.iter().map(|(_, phi)| drawing.place(place, phi)).collect();
            traced.iter().map(trail).collect()
        };
        let mut poses: Vec<Pose> = Vec::new();
        let (mut turned, mut after) = (0.0, None);
        for sample in path.iter().rev() {
            turned += after.map_or(GHOST, |after| furthest(sample, after));
            after = Some(*sample);
            if turned >= GHOST && poses.len() <= GHOSTS {
                poses.push(self.drawing().pose(&sample.phi, &sample.omega));
                turned = 0.0;
            }
        }
        poses.reverse();
        if coarse {
            poses.drain(..poses.len().saturating_sub(1));
        }
        let title = (drawing.title().filter(|_| !coarse))
            .unwrap_or_else(|| format!("The mechanism at {} s", figure(self.outcome.last.t)));
        let more =
            (!coarse).then(|| format!("last {} s of {} s", rough(span(&path)), figure(self.outcome.last.t)));
        let (horizon, past) = self.horizon(self.outcome.last.t);
        let trusted = horizon
            .filter(|_| !coarse)
            .map(|horizon| smoothed(&path).partition_point(|(t, _)| *t <= horizon));
        let mut caption = self.caption(more);
        caption.extend(past);
        MechanismChart { title, caption, sketch: self.drawing().sketch(), poses, trails, horizon: trusted }
    }

    fn angles(&self) -> Angles {
        let (window, more) = self.window();
        let smooth = smoothed(&window);
        let series = self.mechanism.own_bodies().iter().enumerate().map(|(k, body)| AngleSeries {
            name: plain(&body.name),
            angle: smooth.iter().map(|(_, phi)| phi[k]).collect(),
        });
        let (horizon, past) = self.horizon(window.last().map_or(0.0, |sample| sample.t));
        let mut caption = self.caption(more);
        caption.extend(past);
        Angles {
            title: "Angles of the bars".to_owned(),
            caption,
            time: smooth.iter().map(|(t, _)| *t).collect(),
            series: series.collect(),
            horizon,
        }
    }

    fn energy_drift(&self) -> EnergyDrift {
        let Outcome { plan, drift, last, .. } = self.outcome;
        let kind = if drift.kind == "energy" { "Energy" } else { "Energy minus work" };
        EnergyDrift {
            title: format!(
                "{kind} keeps to {} of its scale over {} s",
                power(drift.energy.max),
                figure(last.t)
            ),
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

    fn constraint_drift(&self) -> ConstraintDrift {
        let Outcome { plan, drift, .. } = self.outcome;
        let of = |unit: &'static str| {
            (drift.constraints.iter().enumerate())
                .filter(move |(r, _)| self.mechanism.constraints[*r].unit() == unit)
        };
        let panel = |unit: &'static str, level: usize| ResidualPanel {
            name: defect_name(level, unit),
            series: of(unit)
                .map(|(r, (constraint, _))| {
                    let method = if drift.constraints.len() == 1 {
                        plan.stabilization.to_string()
                    } else {
                        constraint.clone()
                    };
                    self.defects(r, level, method, plain(constraint))
                })
                .collect(),
        };
        let units = units(self.mechanism);
        let most =
            |unit: &'static str| of(unit).map(|(_, (_, [position, _]))| position.max).fold(0.0, f64::max);
        let kept = if units.iter().all(|unit| most(unit) == 0.0) {
            "are kept exactly".to_owned()
        } else {
            format!(
                "keep to {}",
                units
                    .iter()
                    .map(|unit| format!("{} {unit}", power(most(unit))))
                    .collect::<Vec<_>>()
                    .join(" and ")
            )
        };
        ConstraintDrift {
            title: format!("Constraints {kept} over {} s", figure(self.outcome.last.t)),
            caption: self.caption(None),
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

    /// The motors, and which of them push sliders.
    fn torque_power(&self) -> (TorquePower, Vec<usize>) {
        let (window, more) = self.window();
        let driven = self.mechanism.constraints.iter().filter(|row| row.is_motor());
        let sliders: Vec<usize> =
            driven.enumerate().filter(|(_, row)| !row.is_angle()).map(|(k, _)| k).collect();
        let motors = (self.mechanism.constraints.iter().enumerate()).filter(|(_, row)| row.is_motor()).map(
            |(r, row)| MotorSeries {
                name: plain(row.name()),
                time: window.iter().map(|sample| sample.t).collect(),
                torque: window.iter().map(|sample| sample.motors[r][0]).collect(),
                power: window.iter().map(|sample| sample.motors[r][1]).collect(),
            },
        );
        let motors: Vec<MotorSeries> = motors.collect();
        let names: Vec<&str> = motors.iter().map(|motor| motor.name.as_str()).collect();
        let (horizon, past) = self.horizon(window.last().map_or(0.0, |sample| sample.t));
        let mut caption = self.caption(more);
        caption.extend(past);
        let what = match sliders.len() {
            0 => "Torque",
            all if all == motors.len() => "Force",
            _ => "Torque, force",
        };
        (
            TorquePower {
                title: format!("{what} and power of {}", names.join(", ")),
                caption,
                motors,
                horizon,
            },
            sliders,
        )
    }

    /// The outputs over the whole run.
    fn outputs(&self) -> OutputsChart {
        let whole = &self.outcome.trace.whole;
        let heads = self.mechanism.outputs.iter().flat_map(|outputs| outputs.heads());
        let outputs = heads.enumerate().map(|(k, (name, unit))| OutputSeries {
            name: plain(name),
            unit: unit.replace(' ', "·"),
            time: whole.iter().map(|sample| sample.t).collect(),
            value: whole.iter().map(|sample| sample.outputs.get(k).copied().unwrap_or(f64::NAN)).collect(),
            extremes: self.outcome.extremes.get(k).map_or(Vec::new(), |one| vec![one.min, one.max]),
        });
        let (horizon, past) = self.horizon(self.outcome.last.t);
        OutputsChart {
            over: None,
            title: format!("Outputs over {} s", figure(self.outcome.last.t)),
            caption: self.caption(past),
            outputs: outputs.collect(),
            horizon,
        }
    }

    /// The first seconds in their own time; faster or slower where too much or nothing would be seen.
    fn motion(&self) -> MotionGif {
        let head = &self.outcome.trace.head;
        let shown = FRAMES as f64 * f64::from(DELAY) / 100.0;
        let all = head.last().map_or(0.0, |last| last.t);
        let turned_by = |until: f64| {
            let pairs = head.windows(2).take_while(|pair| pair[1].t <= until * (1.0 + 1e-12));
            pairs.map(|pair| furthest(&pair[0], &pair[1])).sum::<f64>()
        };
        let mut until = all.min(shown);
        let turned = turned_by(until);
        if turned > LIVELY[1] {
            until *= LIVELY[1] / turned;
        } else if turned < LIVELY[0] {
            until = all;
        }
        let frames = if until < shown && turned <= LIVELY[1] {
            (until / shown * FRAMES as f64).ceil() as usize
        } else {
            FRAMES
        };
        let frames = frames.max(1);
        let time: Vec<f64> = (0..=frames).map(|k| until * k as f64 / frames as f64).collect();
        let drawing = self.drawing();
        let traced = drawing.traced();
        let trails = traced.iter().map(|place| {
            let at = |k: usize| {
                let (phi, _) = between(head, until * k as f64 / (4 * frames) as f64);
                drawing.place(place, &phi)
            };
            (0..=4 * frames).map(at).collect()
        });
        MotionGif {
            title: plain(&self.scene.name),
            sketch: self.drawing().sketch(),
            poses: (time.iter())
                .map(|&t| {
                    let (phi, omega) = between(head, t);
                    self.drawing().pose(&phi, &omega)
                })
                .collect(),
            trails: trails.collect(),
            time,
            delay: DELAY,
            horizon: self.horizon(until).0,
        }
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
