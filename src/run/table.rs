//! The trajectory as a table: one row an output time, units in the header, digits that read back to the same doubles.

use super::sample::Sample;
use crate::dynamics::Mechanism;
use std::io::Write;

/// Writes the trajectory as CSV.
pub struct Table<W: Write> {
    writer: csv::Writer<W>,
    fields: Vec<String>,
}

impl<W: Write> Table<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// What the writer says.
    pub fn new(mechanism: &Mechanism, writer: W) -> csv::Result<Self> {
        let mut header = vec!["t [s]".to_owned()];
        for body in &mechanism.bodies {
            for (quantity, unit) in [("phi", "rad"), ("omega", "rad/s"), ("x", "m"), ("y", "m"), ("vx", "m/s"), ("vy", "m/s")] {
                header.push(format!("{}.{quantity} [{unit}]", body.name));
            }
        }
        for (quantity, unit) in [("kinetic", "J"), ("potential", "J"), ("work", "J"), ("imbalance", "1")] {
            header.push(format!("{quantity} [{unit}]"));
        }
        for row in &mechanism.rows {
            let unit = row.unit();
            let name = row.name();
            header.extend([
                format!("{name}.C [{unit}]"),
                format!("{name}.C' [{unit}/s]"),
                format!("{name}.torque [N m]"),
                format!("{name}.power [W]"),
            ]);
        }
        let mut writer = csv::Writer::from_writer(writer);
        writer.write_record(&header)?;
        Ok(Self { writer, fields: vec![String::new(); header.len()] })
    }

    /// Writes a row.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&mut self, sample: &Sample) -> csv::Result<()> {
        let mut fields = self.fields.iter_mut();
        let mut put = |value: f64| {
            if let Some(field) = fields.next() {
                field.clear();
                let _ = std::fmt::Write::write_fmt(field, format_args!("{value:?}"));
            }
        };
        put(sample.t);
        for k in 0..sample.phi.len() {
            for value in
                [sample.phi[k], sample.omega[k], sample.centre[k][0], sample.centre[k][1], sample.velocity[k][0], sample.velocity[k][1]]
            {
                put(value);
            }
        }
        for value in [sample.kinetic, sample.potential, sample.work, sample.imbalance] {
            put(value);
        }
        for (constraint, motor) in sample.constraints.iter().zip(&sample.motors) {
            for value in [constraint[0], constraint[1], motor[0], motor[1]] {
                put(value);
            }
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
