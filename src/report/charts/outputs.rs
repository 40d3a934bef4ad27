//! Torques, outputs and columns against time.

use super::{ALIAS, Finished};
use crate::chart::{MotorSeries, OutputSeries, OutputsChart, TorquePower, plain};
use crate::report::curves::is_coarse;
use crate::report::drawing::names_of;
use crate::report::page::figure;

impl Finished<'_> {
    /// The motors.
    pub fn torque_power(&self) -> TorquePower {
        let (window, more) = self.window();
        let (driven, rows) =
            (super::motors(self.mechanism, self.outcome), &self.mechanism.with_all_parts().constraints);
        let sliders: Vec<usize> =
            driven.iter().enumerate().filter(|&(_, &row)| !rows[row].is_angle()).map(|(k, _)| k).collect();
        let series = |row: usize| MotorSeries {
            name: plain(rows[row].name()),
            time: window.iter().map(|sample| sample.t).collect(),
            torque: window.iter().map(|sample| sample.motors[row][0]).collect(),
            power: window.iter().map(|sample| sample.motors[row][1]).collect(),
        };
        let within = window.first().zip(window.last()).map_or([0.0; 2], |(first, last)| [first.t, last.t]);
        let peaks = driven.iter().map(|&row| self.peaks(rows[row].name(), within)).collect();
        let motors: Vec<MotorSeries> = driven.into_iter().map(series).collect();
        let names: Vec<&str> = motors.iter().map(|motor| motor.name.as_str()).collect();
        let (horizon, past) = self.horizon(window.last().map_or(0.0, |sample| sample.t));
        let mut caption = self.caption(more);
        caption.extend(past);
        let is_coarse = is_coarse(&window, self.angle_count());
        caption.extend(is_coarse.then(|| format!("rows {ALIAS}")));
        let what = match sliders.len() {
            0 => "Torque",
            all if all == motors.len() => "Force",
            _ => "Torque, force",
        };
        TorquePower {
            title: format!("{what} and power of {}", names.join(", ")),
            caption,
            motors,
            sliders,
            peaks,
            is_coarse,
            horizon,
        }
    }

    /// The largest magnitudes of a motor's torque or force and of its power over the run, and their times,
    /// where an output of the scene is just that and has them in the window.
    fn peaks(&self, motor: &str, [from, to]: [f64; 2]) -> [Option<[f64; 2]>; 2] {
        let peak = |kinds: &[&str]| {
            let is_that = |formula: &str| {
                formula
                    .trim()
                    .strip_prefix(motor)
                    .and_then(|rest| rest.strip_prefix('.'))
                    .is_some_and(|kind| kinds.contains(&kind))
            };
            let output = self.scene.outputs.iter().find(|output| is_that(&output.formula))?;
            let extremes = self.outcome.extremes.iter().find(|one| one.name == output.name)?;
            Some(extremes.peak()).filter(|peak| (from..=to).contains(&peak[1]) && peak[0].is_finite())
        };
        [peak(&["torque", "force"]), peak(&["power"])]
    }

    /// The outputs over the whole run.
    pub fn outputs(&self) -> OutputsChart {
        let trace = &self.outcome.trace;
        let (whole, more) = match trace.window {
            Some(_) => (&trace.part, Some(self.chosen_window())),
            None => (&trace.whole, None),
        };
        // What lies outside of the window would stretch the chart to it.
        let [from, to] = trace.window.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let seen = |extreme: &[f64; 2]| (from..=to).contains(&extreme[1]) && extreme[0].is_finite();
        let heads = self.mechanism.outputs.iter().flat_map(|outputs| outputs.heads());
        let outputs = heads.enumerate().map(|(k, (name, unit))| OutputSeries {
            name: plain(name),
            unit: unit.replace(' ', "·"),
            time: whole.iter().map(|sample| sample.t).collect(),
            value: whole.iter().map(|sample| sample.outputs.get(k).copied().unwrap_or(f64::NAN)).collect(),
            extremes: (self.outcome.extremes.get(k).into_iter())
                .flat_map(|one| [one.min, one.max])
                .filter(seen)
                .collect(),
        });
        let is_coarse = is_coarse(&whole.iter().collect::<Vec<_>>(), self.angle_count());
        self.over_time(outputs.collect(), more, is_coarse)
    }

    /// The chart of series of the run, whose rows may be too far apart for curves.
    pub fn over_time(
        &self,
        outputs: Vec<OutputSeries>,
        more: Option<String>,
        is_coarse: bool,
    ) -> OutputsChart {
        let end = outputs.iter().filter_map(|output| output.time.last()).copied().fold(0.0, f64::max);
        let (horizon, past) = self.horizon(end);
        let begin = outputs.iter().filter_map(|output| output.time.first()).copied().fold(end, f64::min);
        let drawn = match (more.is_some(), begin > 0.0) {
            (true, true) => format!("from {} s to {} s", figure(begin), figure(end)),
            (true, false) => format!("over {} s", figure(end)),
            (false, _) => format!("over {} s", figure(self.outcome.last.t)),
        };
        OutputsChart {
            over: None,
            quantity: None,
            title: format!("{} {drawn}", names_of(&outputs)),
            caption: (self.caption(more).into_iter().chain(past))
                .chain(is_coarse.then(|| format!("rows {ALIAS}")))
                .collect(),
            outputs,
            is_coarse,
            horizon,
            settled_from: None,
        }
    }
}
