//! Columns of the trajectory, chosen by name.

use super::Finished;
use crate::chart::{OutputSeries, OutputsChart, plain};
use crate::dynamics::Mechanism;
use crate::report::curves::is_coarse;
use crate::run::table::{header, row};
use crate::scene::{listed, nearest};

/// Where columns stand in a row, with their names and units.
#[derive(Debug)]
pub struct RowColumns(Vec<(usize, String, String)>);

impl RowColumns {
    /// Looks them up by their names in the table, with or without the unit.
    ///
    /// # Errors
    /// One is not there: a line, and another with the nearest name.
    pub fn find(mechanism: &Mechanism, names: &[String]) -> Result<Self, String> {
        let heads = header(mechanism);
        let all: Vec<(&str, &str)> = heads.iter().map(|head| parted(head)).collect();
        let find = |asked: &String| {
            let name = parted(asked).0.trim();
            // The time is what they are drawn over.
            let found = all.iter().enumerate().skip(1).find(|(_, head)| head.0 == name);
            found.map(|(k, (name, unit))| (k, (*name).to_owned(), (*unit).to_owned())).ok_or_else(|| {
                let known: Vec<&str> = all.iter().skip(1).map(|head| head.0).collect();
                let hint = match nearest(name, known.iter().copied()) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("there are {}", listed(&known)),
                };
                format!("the trajectory has no column `{name}`\nhint: {hint}")
            })
        };
        names.iter().map(find).collect::<Result<_, _>>().map(Self)
    }
}

/// Name and unit of `bar1.phi [rad]`.
fn parted(head: &str) -> (&str, &str) {
    let (name, unit) = head.split_once(" [").unwrap_or((head, ""));
    (name, unit.trim_end_matches(']'))
}

impl Finished<'_> {
    /// These columns.
    pub fn columns(&self, columns: &RowColumns) -> OutputsChart {
        let (samples, more) = self.window();
        let rows: Vec<Vec<f64>> = samples.iter().map(|sample| row(self.mechanism, sample)).collect();
        let outputs = columns.0.iter().map(|(k, name, unit)| OutputSeries {
            name: plain(name),
            unit: unit.replace(' ', "·"),
            time: samples.iter().map(|sample| sample.t).collect(),
            value: rows.iter().map(|row| row[*k]).collect(),
            extremes: Vec::new(),
        });
        self.over_time(outputs.collect(), more, is_coarse(&samples, self.angle_count()))
    }
}
