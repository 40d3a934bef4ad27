//! The trajectory as a table: one row an output time, units in the header, digits that read back to the same
//! doubles.
//!
//! Every constraint has its residual and the rate of that.  A motor has its torque on the driven body, or its
//! force on the point that slides, along the rail, and its power beside them; a lock, a weld or a locked
//! slider the torque it exerts on its body, [`ConstraintEquation`] by row.

use super::sample::Sample;
use crate::dynamics::Mechanism;
use crate::dynamics::constraint::ConstraintEquation;
use std::io::{self, Write};
use std::sync::Arc;

/// Bytes gathered before the writer sees them.
const BUFFER: usize = 1 << 16;

/// Writes the trajectory as CSV.
pub struct Table<W: Write> {
    writer: W,
    buffer: Vec<u8>,
    /// Numbers of a row.
    width: usize,
    shown: Shown,
}

/// What the table shows of a sample.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Bodies; of the rotors of integrals after them the rate alone.
    bodies: usize,
    /// True where energy is lost in dry friction.
    friction: bool,
    /// Of each constraint's force nothing, a torque or force, or its power too.
    forces: Arc<[usize]>,
}

impl Shown {
    /// Of the samples of a mechanism.
    pub fn new(mechanism: &Mechanism) -> Self {
        let count = |(r, row): (usize, &ConstraintEquation)| {
            if mechanism.with_all_parts().is_motor(r) { 2 } else { usize::from(row.law.is_some()) }
        };
        let forces = mechanism.with_all_parts().constraints.iter().enumerate().map(count).collect();
        Self { bodies: mechanism.own_bodies().len(), friction: !mechanism.frictions.is_empty(), forces }
    }

    /// Appends the numbers of a row, in the order of [`header`].
    pub fn append(&self, sample: &Sample, numbers: &mut Vec<f64>) {
        numbers.push(sample.t);
        for k in 0..self.bodies {
            let ([x, y], [vx, vy]) = (sample.centre[k], sample.velocity[k]);
            numbers.extend([sample.phi[k], sample.omega[k], x, y, vx, vy]);
        }
        numbers.extend(&sample.omega[self.bodies..sample.centre.len()]);
        numbers.extend([sample.kinetic, sample.potential, sample.work, sample.imbalance]);
        for ((constraint, motor), &count) in
            sample.constraints.iter().zip(&sample.motors).zip(self.forces.iter())
        {
            numbers.extend(constraint.iter().chain(&motor[..count]));
        }
        numbers.extend(self.friction.then_some(sample.friction));
        numbers.extend(&sample.outputs);
    }
}

/// The names of the columns, with their units in brackets.
pub fn header(mechanism: &Mechanism) -> Vec<String> {
    let mut header = vec!["t [s]".to_owned()];
    for body in mechanism.own_bodies() {
        for (quantity, unit) in
            [("phi", "rad"), ("omega", "rad/s"), ("x", "m"), ("y", "m"), ("vx", "m/s"), ("vy", "m/s")]
        {
            header.push(format!("{}.{quantity} [{unit}]", body.name));
        }
    }
    header.extend(mechanism.integrals().map(|(name, _)| name.to_owned()));
    for (quantity, unit) in [("kinetic", "J"), ("potential", "J"), ("work", "J"), ("imbalance", "1")] {
        header.push(format!("{quantity} [{unit}]"));
    }
    let shown = Shown::new(mechanism);
    for (row, &shown) in mechanism.with_all_parts().constraints.iter().zip(shown.forces.iter()) {
        let (unit, name) = (row.unit(), row.name());
        header.extend([format!("{name}.C [{unit}]"), format!("{name}.C' [{unit}/s]")]);
        let force = if row.is_in_radians() { "torque" } else { "force" };
        header.extend(
            [format!("{name}.{force} [{}]", row.unit_of_force()), format!("{name}.power [W]")]
                .into_iter()
                .take(shown),
        );
    }
    header.extend(shown.friction.then(|| "friction [J]".to_owned()));
    let outputs = mechanism.outputs.iter().flat_map(|outputs| outputs.heads());
    header.extend(outputs.map(|(name, unit)| format!("{name} [{unit}]")));
    debug_assert_eq!(header.len(), width(mechanism, &shown));
    header
}

/// The numbers of the row of a sample, also of one in a [`Trace`](super::Trace).
pub fn row(mechanism: &Mechanism, sample: &Sample) -> Vec<f64> {
    let mut numbers = Vec::new();
    Shown::new(mechanism).append(&placed(mechanism, sample), &mut numbers);
    numbers
}

/// A sample with the positions and velocities of the centres that follow from its angles and rates.
fn placed(mechanism: &Mechanism, sample: &Sample) -> Sample {
    let (centre, velocity) =
        mechanism.centres(&sample.phi, &sample.omega).into_iter().map(|[at, moving]| (at, moving)).unzip();
    Sample { centre, velocity, ..sample.clone() }
}

/// How many numbers that are.
fn width(mechanism: &Mechanism, shown: &Shown) -> usize {
    let forces = shown.forces.iter().sum::<usize>();
    let outputs = mechanism.outputs.as_ref().map_or(0, |outputs| outputs.heads().count());
    let others = mechanism.integrals + usize::from(shown.friction) + outputs;
    1 + 6 * shown.bodies + others + 4 + 2 * mechanism.constraints.len() + forces
}

impl<W: Write> Table<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// What the writer says.
    pub fn new(mechanism: &Mechanism, writer: W) -> csv::Result<Self> {
        let (header, shown) = (header(mechanism), Shown::new(mechanism));
        let mut titles = csv::Writer::from_writer(Vec::with_capacity(BUFFER + BUFFER / 4));
        titles.write_record(&header)?;
        let buffer = titles.into_inner().map_err(|error| error.into_error())?;
        Ok(Self { writer, buffer, width: header.len(), shown })
    }

    /// Goes on with a table whose header and first rows were written before.
    pub fn going_on(mechanism: &Mechanism, writer: W) -> Self {
        let shown = Shown::new(mechanism);
        let width = width(mechanism, &shown);
        Self { writer, buffer: Vec::with_capacity(BUFFER + BUFFER / 4), width, shown }
    }

    /// What it shows of each constraint's force.
    pub(super) fn shown(&self) -> Shown {
        self.shown.clone()
    }

    /// The writer, once it has every row.
    ///
    /// # Errors
    /// What the writer says.
    pub fn written(&mut self) -> io::Result<&mut W> {
        self.writer.write_all(&self.buffer)?;
        self.buffer.clear();
        self.writer.flush()?;
        Ok(&mut self.writer)
    }

    /// Writes a row.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&mut self, sample: &Sample) -> io::Result<()> {
        let mut row = Vec::with_capacity(self.width);
        self.shown.append(sample, &mut row);
        self.lines(&row)
    }

    /// Writes rows of [`columns`], one after the other.
    pub(super) fn lines(&mut self, numbers: &[f64]) -> io::Result<()> {
        for row in numbers.chunks_exact(self.width) {
            let buffer = &mut self.buffer;
            for &value in row {
                put_number(buffer, value);
            }
            if let Some(last) = buffer.last_mut() {
                *last = b'\n';
            }
            if buffer.len() >= BUFFER {
                self.writer.write_all(buffer)?;
                buffer.clear();
            }
        }
        Ok(())
    }

    /// Writes out what is buffered and hands the writer back.
    ///
    /// # Errors
    /// What the writer says.
    pub fn finish(mut self) -> io::Result<W> {
        self.written()?;
        Ok(self.writer)
    }
}

/// Appends a number and a comma: the shortest digits that read back to the same double, laid out as Rust's
/// `{:?}` does.
pub(crate) fn put_number(buffer: &mut Vec<u8>, value: f64) {
    let mut digits = zmij::Buffer::new();
    let text = digits.format(value).as_bytes();
    let size = value.abs();
    if size == 0.0 || (1e-4..1e16).contains(&size) || !size.is_finite() {
        buffer.extend_from_slice(text);
    } else if (1e-5..1e-4).contains(&size) {
        // 0.0000123 is written 1.23e-5.
        let (sign, digits) = if value < 0.0 { (&b"-"[..], &text[7..]) } else { (&b""[..], &text[6..]) };
        buffer.extend_from_slice(sign);
        buffer.push(digits[0]);
        if digits.len() > 1 {
            buffer.push(b'.');
            buffer.extend_from_slice(&digits[1..]);
        }
        buffer.extend_from_slice(b"e-5");
    } else {
        buffer.extend(text.iter().filter(|&&letter| letter != b'+'));
    }
    buffer.push(b',');
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn written(value: f64) -> String {
        let mut buffer = Vec::new();
        put_number(&mut buffer, value);
        assert_eq!(buffer.pop(), Some(b','));
        String::from_utf8(buffer).expect("ASCII")
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn numbers_are_written_as_the_standard_library_does(bits in any::<u64>(), near in -20.0..20.0f64,
            digits in 1u32..1000) {
            for value in [f64::from_bits(bits), near, 10f64.powf(near), -10f64.powf(near),
                f64::from(digits) * 1e-7, f64::from(digits) * 1e14] {
                let (ours, theirs) = (written(value), format!("{value:?}"));
                // Of two shortest numbers equally near, either is right: ours ends on an even digit.
                let is_tie = ours.len() == theirs.len() && ours.parse() == Ok(value);
                prop_assert!(ours == theirs || is_tie, "{ours} {theirs}");
            }
        }
    }

    #[test]
    fn the_bounds_of_the_layouts() {
        let bounds = [
            0.0,
            -0.0,
            1e-4,
            1e-5,
            9.999e-5,
            1e15,
            1e16,
            1e17,
            5e-324,
            f64::MAX,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ];
        for value in bounds.iter().flat_map(|&x: &f64| [x, -x, x.next_up(), x.next_down()]) {
            assert_eq!(written(value), format!("{value:?}"));
        }
    }
}
