//! The points of a sweep as a table: one row a point, units in the header, digits that read back to the same
//! doubles.

use super::{Status, Sweep, SweepPoint};
use crate::run::trust::Level;
use std::io::Write;

/// Writes a sweep as CSV.
pub struct SweepTable<W: Write> {
    writer: csv::Writer<W>,
    bars: Vec<String>,
    layout: SweepLayout,
    fields: Vec<String>,
}

/// How many numbers of what a row has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SweepLayout {
    bars: usize,
    integrals: usize,
    outputs: usize,
    is_judged: bool,
    /// True where places of the bodies are told beside their angles.
    has_places: bool,
}

impl SweepLayout {
    /// Of the rows of a sweep.
    pub fn of(sweep: &Sweep) -> Self {
        let mechanism = sweep.mechanism();
        Self {
            bars: mechanism.own_bodies().len(),
            integrals: mechanism.integrals().count(),
            outputs: outputs(sweep).count(),
            is_judged: sweep.trust() != Level::Off,
            has_places: mechanism.has_translations(),
        }
    }
}

/// The columns of a sweep's table: what is varied, then what came of it.
pub fn columns(sweep: &Sweep) -> Vec<String> {
    let with_unit =
        |name: &str, unit: &str| if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") };
    let mut columns: Vec<String> =
        sweep.variables().iter().map(|variable| with_unit(&variable.path, variable.unit)).collect();
    columns.push("t [s]".to_owned());
    for body in sweep.mechanism().own_bodies() {
        let quantities: &[&str] = match sweep.mechanism().has_translations() {
            true => &["phi [rad]", "omega [rad/s]", "x [m]", "y [m]", "vx [m/s]", "vy [m/s]"],
            false => &["phi [rad]", "omega [rad/s]"],
        };
        columns.extend(quantities.iter().map(|quantity| format!("{}.{quantity}", body.name)));
    }
    columns.extend(sweep.mechanism().integrals().map(|(name, _)| name.to_owned()));
    let unit = sweep.mechanism().unit_of_rows().unwrap_or("rad");
    columns.push("energy_drift [1]".to_owned());
    columns.extend([
        format!("constraint_drift [{unit}]"),
        format!(
            "constraint_rate_drift [{}]",
            unit.split(" or ").map(|unit| format!("{unit}/s")).collect::<Vec<_>>().join(" or ")
        ),
    ]);
    if sweep.trust() != Level::Off {
        columns.extend(["error_estimate [rad]", "horizon [s]"].map(str::to_owned));
    }
    for (name, unit) in outputs(sweep) {
        columns.extend(["min", "max", "mean", "rms"].map(|what| format!("{what}:{name} [{unit}]")));
    }
    columns.extend(["steps", "flip_time [s]", "flip_bar", "status", "cause"].map(str::to_owned));
    columns
}

/// Names and units of the outputs of a sweep's scene.
pub fn outputs(sweep: &Sweep) -> impl Iterator<Item = (&str, &str)> {
    sweep.mechanism().outputs.iter().flat_map(|outputs| outputs.heads())
}

/// The numbers of a point's row, in the order of [`columns`] up to the flip time; not a number where there is
/// none.
pub fn numbers(point: &SweepPoint, layout: SweepLayout) -> Vec<f64> {
    let SweepLayout { bars, integrals, outputs, is_judged, has_places } = layout;
    let mut numbers = point.values.clone();
    if point.phi.is_empty() {
        // Time, three drifts, steps and flip time; of a judged point two more.
        let others = if is_judged { 8 } else { 6 };
        let of_bar = if has_places { 6 } else { 2 };
        numbers.resize(numbers.len() + of_bar * bars + integrals + 4 * outputs + others, f64::NAN);
        return numbers;
    }
    numbers.push(point.t);
    // Behind the angles of the bodies are the integrals, and the coordinates of bodies that float.
    for bar in 0..bars {
        numbers.extend([point.phi[bar], point.omega[bar]]);
        if has_places {
            numbers.extend(point.centres.get(bar).copied().unwrap_or([[f64::NAN; 2]; 2]).as_flattened());
        }
    }
    numbers.extend(&point.omega[bars..bars + integrals]);
    numbers.push(point.energy);
    numbers.extend(point.constraint.unwrap_or([f64::NAN; 2]));
    if is_judged {
        let trust = point.trust.clone().unwrap_or_default();
        numbers.extend([trust.error, trust.horizon].map(|number| number.unwrap_or(f64::NAN)));
    }
    for k in 0..outputs {
        numbers.extend(point.extremes.get(k).copied().unwrap_or([f64::NAN; 4]));
    }
    numbers.extend([point.steps as f64, point.flip.map_or(f64::NAN, |flip| flip.t)]);
    numbers
}

impl<W: Write> SweepTable<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// What the writer says.
    pub fn new(sweep: &Sweep, writer: W) -> csv::Result<Self> {
        let mut table = Self::going_on(sweep, writer);
        table.writer.write_record(columns(sweep))?;
        Ok(table)
    }

    /// Goes on with a table whose header and first rows were written before.
    pub fn going_on(sweep: &Sweep, writer: W) -> Self {
        let bars = sweep.mechanism().own_bodies().iter().map(|body| body.name.clone()).collect();
        Self {
            writer: csv::Writer::from_writer(writer),
            bars,
            layout: SweepLayout::of(sweep),
            fields: vec![String::new(); columns(sweep).len()],
        }
    }

    /// The writer, once it has every row.
    ///
    /// # Errors
    /// What the writer says.
    pub fn written(&mut self) -> std::io::Result<&W> {
        self.writer.flush()?;
        Ok(self.writer.get_ref())
    }

    /// Writes a point.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&mut self, point: &SweepPoint) -> csv::Result<()> {
        let numbers = numbers(point, self.layout);
        let steps = numbers.len() - 2;
        self.fields.iter_mut().for_each(String::clear);
        for (column, (field, number)) in self.fields.iter_mut().zip(&numbers).enumerate() {
            let _ = match number {
                number if number.is_nan() => Ok(()),
                number if column == steps => std::fmt::Write::write_fmt(field, format_args!("{number}")),
                number => std::fmt::Write::write_fmt(field, format_args!("{number:?}")),
            };
        }
        let (status, cause) = words(&point.status);
        let bar = point.flip.and_then(|flip| self.bars.get(flip.bar)).cloned().unwrap_or_default();
        for (field, word) in self.fields[numbers.len()..].iter_mut().zip([bar, status.to_owned(), cause]) {
            *field = word;
        }
        self.writer.write_record(&self.fields)
    }

    /// Writes out what is buffered and hands the writer back.
    ///
    /// # Errors
    /// What the writer says.
    pub fn finish(self) -> std::io::Result<W> {
        self.writer.into_inner().map_err(|error| error.into_error())
    }
}

/// A status in one word, and its cause in one line.
fn words(status: &Status) -> (&'static str, String) {
    match status {
        Status::Done => ("done", String::new()),
        Status::Stopped(stop) => ("stopped", format!("{}: {}", stop.cause.word(), stop.what)),
        Status::Refused(reason) => ("refused", reason.clone()),
        Status::Skipped => ("skipped", String::new()),
    }
}
