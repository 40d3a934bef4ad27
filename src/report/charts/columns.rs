//! Columns of the trajectory, chosen by name.

use super::Finished;
use crate::chart::{OutputSeries, OutputsChart, plain};
use crate::dynamics::Mechanism;
use crate::report::page::figure;
use crate::run::table::{header, row};
use strsim::jaro_winkler;

/// Where columns stand in a row, with their names and units.
#[derive(Debug)]
pub struct Columns(Vec<(usize, String, String)>);

impl Columns {
    /// Looks them up by their names in the table, with or without the unit.
    ///
    /// # Errors
    /// One is not there: a line with the nearest one.
    pub fn find(mechanism: &Mechanism, names: &[String]) -> Result<Self, String> {
        let all: Vec<(String, String)> = (header(mechanism).iter().skip(1))
            .map(|head| {
                let (name, unit) = head.split_once(" [").unwrap_or((head, ""));
                (name.to_owned(), unit.trim_end_matches(']').to_owned())
            })
            .collect();
        let find = |asked: &String| {
            let name = asked.split_once(" [").map_or(asked.as_str(), |(name, _)| name).trim();
            let found = all.iter().position(|head| head.0 == name);
            found.map(|k| (k + 1, all[k].0.clone(), all[k].1.clone())).ok_or_else(|| {
                let likeness = |head: &&(String, String)| jaro_winkler(&head.0, name);
                let nearest = all.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
                let hint =
                    nearest.map_or(String::new(), |head| format!("\nhint: did you mean `{}`?", head.0));
                format!("the trajectory has no column `{name}`{hint}")
            })
        };
        names.iter().map(find).collect::<Result<_, _>>().map(Self)
    }
}

impl Finished<'_> {
    /// The columns of these names, as far as there are such.
    pub fn columns(&self, names: &[String]) -> OutputsChart {
        let (samples, more) = self.window();
        let rows: Vec<Vec<f64>> = samples.iter().map(|sample| row(self.mechanism, sample)).collect();
        let found = Columns::find(self.mechanism, names).map_or(Vec::new(), |columns| columns.0);
        let outputs = found.into_iter().map(|(k, name, unit)| OutputSeries {
            name: plain(&name),
            unit: unit.replace(' ', "·"),
            time: samples.iter().map(|sample| sample.t).collect(),
            value: rows.iter().map(|row| row[k]).collect(),
            extremes: Vec::new(),
        });
        let (horizon, past) = self.horizon(samples.last().map_or(0.0, |sample| sample.t));
        OutputsChart {
            over: None,
            title: format!("Columns of {} s", figure(self.outcome.last.t)),
            caption: self.caption(more).into_iter().chain(past).collect(),
            outputs: outputs.collect(),
            horizon,
        }
    }
}
