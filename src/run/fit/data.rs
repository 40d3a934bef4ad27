//! Measured data: a table with a column of times and columns named as in `trajectory.csv`.

use super::FitError;
use crate::scene::formula::unit::{Dimension, UnitScale};
use std::path::Path;

/// What separates columns elsewhere.
const SEPARATORS: [(char, &str); 2] = [(';', "semicolons"), ('\t', "tabs")];

/// A table of measurements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Data {
    /// Its file, for messages.
    pub source: String,
    /// Times \[s\], rising, from 0 on.
    pub times: Vec<f64>,
    /// The other columns: names without units, and values in units of the SI, some of which may be missing.
    pub columns: Vec<(String, Vec<Option<f64>>)>,
    /// The units their header names, those of none left out; values with one that is not known stay as they
    /// are.
    pub units: Vec<Option<String>>,
}

impl Data {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or is no such table.
    pub fn read(path: &Path) -> Result<Self, FitError> {
        let source = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|error| FitError::Unreadable { file: source.clone(), why: error.to_string() })?;
        Self::parse(&text, &source)
    }

    /// Reads a text: a header `t [ms],bar1.phi [deg],…` and rows of numbers; an empty cell is no measurement,
    /// and without a unit a column is in units of the SI.
    ///
    /// # Errors
    /// It is no such table; the message names line, column and value.
    pub fn parse(text: &str, source: &str) -> Result<Self, FitError> {
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let fail = |what: String, hint: &str| FitError::Data(format!("{source}: {what}\nhint: {hint}"));
        let header = reader.headers().map_err(|error| fail(error.to_string(), "a table of numbers"))?.clone();
        let is_one = |mark: char| header.len() == 1 && header[0].contains(mark);
        if let Some((_, what)) = SEPARATORS.iter().find(|(mark, _)| is_one(*mark)) {
            let hint =
                format!("columns are separated by commas, not by {what}, as in `t [s],bar1.phi [rad]`");
            return Err(fail("line 1 is a single column".into(), &hint));
        }
        let heads: Vec<(&str, Option<&str>)> = header.iter().map(head).collect();
        let names: Vec<&str> = heads.iter().map(|(name, _)| *name).collect();
        let time = names.iter().position(|name| *name == "t").ok_or_else(|| {
            fail("has no column of times".into(), "name one `t [s]`, and the others as in trajectory.csv")
        })?;
        let scales: Vec<Option<UnitScale>> =
            heads.iter().map(|(_, unit)| unit.and_then(|unit| UnitScale::read(unit).ok())).collect();
        if let Some(unit) = heads[time].1 {
            let is_time = |scale: &UnitScale| scale.dimension.is(Dimension::of("s"));
            if !scales[time].as_ref().is_some_and(is_time) {
                let what = format!("line 1, column t: `{unit}` is no unit of time");
                return Err(fail(what, "as in `t [s]`: s, ms, us, min or h"));
            }
        }
        let mut data = Self { source: source.into(), ..Self::default() };
        for (_, (name, unit)) in heads.iter().enumerate().filter(|(column, _)| *column != time) {
            data.columns.push(((*name).to_owned(), Vec::new()));
            data.units.push(unit.map(str::to_owned));
        }
        for record in reader.records() {
            let record = record
                .map_err(|error| fail(unreadable(&error), "every row has as many cells as the header"))?;
            let line = record.position().map_or(0, csv::Position::line);
            let mut cells = Vec::new();
            for ((cell, name), scale) in record.iter().zip(&names).zip(&scales) {
                let value = if cell.is_empty() { None } else { crate::scene::number(cell) };
                if value.is_none() && !cell.is_empty() {
                    let what = format!("line {line}, column {name}: `{cell}` is not a number");
                    return Err(fail(what, "write 0.5, or leave the cell empty where nothing was measured"));
                }
                let of = |value: f64| scale.map_or(value, |scale| scale.of_number(value));
                cells.push(value.map(of));
            }
            let last = data.times.last().copied();
            match cells.remove(time) {
                Some(t) if t >= 0.0 && last.is_none_or(|last| t > last) => data.times.push(t),
                t => {
                    let t = t.map_or("empty".to_owned(), |t| t.to_string());
                    let why = match last {
                        Some(last) => format!("does not come after {last}, the time before"),
                        None => "is no time from the start on".to_owned(),
                    };
                    let what = format!("line {line}, column t: {t} {why}");
                    return Err(fail(what, "times in seconds, from 0 on and rising"));
                }
            }
            data.columns.iter_mut().zip(cells).for_each(|((_, values), cell)| values.push(cell));
        }
        match data.times.len() {
            0 => Err(fail("has no rows".into(), "at least one row of measurements")),
            _ => Ok(data),
        }
    }
}

/// What is wrong with a row.
fn unreadable(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = pos.as_ref().map_or(0, csv::Position::line);
            let cells = if *len == 1 { "cell" } else { "cells" };
            format!("line {line} has {len} {cells}, and the header has {expected_len}")
        }
        _ => error.to_string(),
    }
}

/// Name and unit of a column: `bar1.phi [rad]`, with or without the blank; a unit `?` is none.  Without it
/// brackets with a number in them are a part of the name, and so are those that do not end it.
fn head(head: &str) -> (&str, Option<&str>) {
    let has_unit = |(_, unit): &(&str, &str)| {
        unit.ends_with(']') && !unit.starts_with(|first: char| first.is_ascii_digit())
    };
    let (name, unit) = head
        .split_once(" [")
        .or_else(|| head.rsplit_once('[').filter(has_unit))
        .map_or((head, None), |(name, unit)| (name, Some(unit)));
    let unit = unit.map(|unit| unit.trim().trim_end_matches(']').trim());
    (name.trim(), unit.filter(|unit| *unit != "?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read_and_what_is_none_is_told_with_its_place() {
        let data = Data::parse("t [s],bar1.phi [rad],x\n0,1.5,\n0.5,-1e-3,2\n", "data.csv").expect("a table");
        assert_eq!(data.times, [0.0, 0.5]);
        assert_eq!(data.columns[0], ("bar1.phi".into(), vec![Some(1.5), Some(-1e-3)]));
        assert_eq!(data.columns[1], ("x".into(), vec![None, Some(2.0)]));
        for (text, told) in [
            ("bar1.phi\n1\n", "no column of times"),
            ("bar1.phi\n1\n", "name one `t [s]`"),
            ("t [s];bar1.phi [rad]\n0;1\n", "separated by commas, not by semicolons"),
            ("t [s]\tbar1.phi [rad]\n0\t1\n", "separated by commas, not by tabs"),
            ("t,a\n0,1\n0,2\n", "line 3, column t: 0 does not come after 0, the time before"),
            ("t,a\n-0.1,1\n0,2\n", "line 2, column t: -0.1 is no time from the start on"),
            ("t,a\n0,one\n", "line 2, column a: `one`"),
            ("t,a\n", "no rows"),
            ("t,a\n0,1,2\n", "data.csv"),
            ("t [deg],a\n0,1\n", "line 1, column t: `deg`"),
            ("t [sec],a\n0,1\n", "line 1, column t: `sec`"),
        ] {
            let error = Data::parse(text, "data.csv").expect_err(text).to_string();
            assert!(error.contains(told) && error.contains("data.csv"), "{error}");
        }
    }

    #[test]
    fn values_are_brought_to_units_of_the_si() {
        let text = "t [ms],bar1.phi [deg],tip.x [mm],a [counts],b [?]\n500,180,2,7,8\n";
        let data = Data::parse(text, "data.csv").expect("a table");
        assert_eq!(data.times, [0.5]);
        let values: Vec<_> = data.columns.iter().map(|(_, values)| values[0]).collect();
        assert_eq!(values, [std::f64::consts::PI, 0.002, 7.0, 8.0].map(Some));
        let units: Vec<_> = data.units.iter().map(Option::as_deref).collect();
        assert_eq!(units, [Some("deg"), Some("mm"), Some("counts"), None]);
        let data = Data::parse("t[ms],bar1.phi[deg],P.x[2],[m]\n500,180,2,1\n", "data.csv").expect("a table");
        assert_eq!((&data.times[..], data.columns[0].1[0]), (&[0.5][..], Some(std::f64::consts::PI)));
        let names: Vec<_> = data.columns.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["bar1.phi", "P.x[2]", ""]);
    }
}
