//! Torque or force and power of motors against time, above each other, the largest magnitudes of what is
//! drawn marked.

use super::axis::Axis;
use super::file::Picture;
use super::grid::{label_room, stacked};
use super::labels::Occupied;
use super::lines::Point;
use super::names::shortened_apart;
use super::palette::{BLUE, Colour, MarkStyle, MarkerShape, SPINE, VERMILLION, marks, readable};
use super::panel::Panel;
use super::sheet::{Pen, Sheet};
use super::ticks::{decimal, figure};
use super::{ChartError, PAGE};

/// One motor.
#[derive(Clone, Debug, Default)]
pub struct MotorSeries {
    /// Name, with markup.
    pub name: String,
    /// Times \[s\], ascending.
    pub time: Vec<f64>,
    /// Torque on the driven bar at these times \[N·m\], or force on the point of the driven slider \[N\].
    pub torque: Vec<f64>,
    /// Power fed in at these times \[W\].
    pub power: Vec<f64>,
}

/// Motors of which each has its largest magnitudes marked.
const MARKED: usize = 3;
/// What the caption says of these where none is known of the run, some are, and all are.
const LARGEST: [&str; 3] = [
    "largest of the rows marked",
    "largest of the rows marked, and of the run where an output tells it",
    "largest of the run marked",
];

/// Torque and power of one or several motors.
#[derive(Clone, Debug, Default)]
pub struct TorquePower {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup; what is drawn is added.
    pub caption: Vec<String>,
    /// The motors.
    pub motors: Vec<MotorSeries>,
    /// Those of them, by number, that push a slider: what stands for their torques are forces \[N\].
    pub sliders: Vec<usize>,
    /// Largest magnitudes over the run, and when \[s\], of each motor's torque or force and of its power,
    /// where they are known; of the others those of the values are marked.
    pub peaks: Vec<[Option<[f64; 2]>; 2]>,
    /// True where too much happens between the times for curves through the values.
    pub is_coarse: bool,
    /// The time from which on the curves are pale: the horizon up to which they can be trusted \[s\].
    pub horizon: Option<f64>,
}

/// What one panel shows.
struct MotorQuantity {
    /// A line for each motor, empty where it is shown elsewhere.
    lines: Vec<Vec<Point>>,
    /// Name of the axis.
    name: &'static str,
    unit: &'static str,
}

impl TorquePower {
    /// The largest magnitude of a motor's power, or torque or force, with its time [s], where it is known.
    fn peak(&self, motor: usize, is_power: bool) -> Option<[f64; 2]> {
        self.peaks.get(motor).and_then(|both| both[usize::from(is_power)])
    }

    /// The values of a motor against time, the known largest one among them.
    fn line(&self, motor: usize, is_power: bool) -> Vec<Point> {
        let own = &self.motors[motor];
        let values = if is_power { &own.power } else { &own.torque };
        let peak = self.peak(motor, is_power).map(|[value, t]| [t, value]);
        let mut points: Vec<Point> = own.time.iter().zip(values).map(|(&t, &v)| [t, v]).chain(peak).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    }

    /// Torques, forces and powers, of the first two those that motors have.
    fn quantities(&self) -> Vec<MotorQuantity> {
        let motors = || 0..self.motors.len();
        let pushes = |motor: usize| self.sliders.contains(&motor);
        let loads = |of_sliders: bool| {
            let line = |motor| if pushes(motor) == of_sliders { self.line(motor, false) } else { Vec::new() };
            motors().map(line).collect()
        };
        let mut quantities = Vec::with_capacity(3);
        if self.sliders.is_empty() || motors().any(|motor| !pushes(motor)) {
            quantities.push(MotorQuantity { lines: loads(false), name: "torque [N·m]", unit: "N·m" });
        }
        if !self.sliders.is_empty() {
            quantities.push(MotorQuantity { lines: loads(true), name: "force [N]", unit: "N" });
        }
        let powers = motors().map(|motor| self.line(motor, true)).collect();
        quantities.push(MotorQuantity { lines: powers, name: "power [W]", unit: "W" });
        quantities
    }
}

/// What a third panel adds to the height of the page \[pt\].
const HIGHER: f64 = 110.0;

/// Draws both curves of each motor with a ring and a figure at each largest magnitude; forces are in a panel
/// between torques and powers.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn torque_power(chart: &TorquePower, px_per_pt: f64) -> Result<Picture, ChartError> {
    let quantities = chart.quantities();
    let size = [PAGE[0], PAGE[1] + (quantities.len() - 2) as f64 * HIGHER];
    let sheet = Sheet::new(size, px_per_pt)?;
    let marks = marks(chart.motors.iter().map(|motor| motor.name.as_str()));
    let several = chart.motors.len() > 1;
    let labels = shortened_apart(&sheet, chart.motors.iter().map(|motor| motor.name.as_str()));

    let all = quantities.iter().flat_map(|quantity| &quantity.lines);
    let x = Axis::tight("time [s]", all.flatten().filter(|p| p[1].is_finite()).map(|p| p[0]));
    // Zero belongs to both: its line parts driving from braking.
    let y = |MotorQuantity { lines, name, .. }: &MotorQuantity| {
        Axis::fit(name, lines.iter().flatten().map(|p| p[1]).chain(zero(lines)))
    };
    let mut caption = chart.caption.clone();
    let crowded = {
        // Tried on a page of its own: the caption has to be known before the panels have their places.
        let trial = Sheet::new(size, 0.5)?;
        let panels = stacked(&trial, 40.0, &x, quantities.iter().map(y).collect(), 20.0)?;
        let mut pairs = panels.iter().zip(&quantities);
        pairs.any(|(panel, quantity)| quantity.lines.iter().any(|line| panel.crowded(line)))
    };
    let marked: Vec<bool> = (quantities.iter().filter(|quantity| quantity.lines.len() <= MARKED))
        .flat_map(|quantity| quantity.lines.iter().enumerate().map(move |line| (quantity.unit, line)))
        .filter(|(_, (_, line))| top(line).is_some())
        .map(|(unit, (motor, _))| chart.peak(motor, unit == "W").is_some())
        .collect();
    let exact = marked.iter().filter(|&&is_known| is_known).count();
    let largest = LARGEST[usize::from(exact > 0) + usize::from(exact == marked.len())];
    let drawn = [(crowded, "bands between the extremes"), (!marked.is_empty(), largest)];
    let said: Vec<&str> = drawn.into_iter().filter_map(|(is_so, words)| is_so.then_some(words)).collect();
    caption.push(said.join(", "));
    let under = sheet.heading(&chart.title, &caption)?;
    let right = if several { label_room(&sheet, labels.iter().map(String::as_str), false) } else { 20.0 };
    let panels = stacked(&sheet, under, &x, quantities.iter().map(y).collect(), right)?;
    let label = chart.horizon.map(|horizon| format!("{} s", figure(horizon)));
    for (k, (panel, MotorQuantity { lines, unit, .. })) in panels.iter().zip(&quantities).enumerate() {
        panel.series(&[[panel.x.from, 0.0], [panel.x.to, 0.0]], &Pen::new(SPINE, 0.75))?;
        let own = MarkStyle {
            colour: if *unit == "W" { VERMILLION } else { BLUE },
            shape: MarkerShape::Disc,
            turn: 0,
        };
        let mark = |motor: usize| if several { marks[motor] } else { own };
        let (mut occupied, mut ends) = (Occupied::default(), Vec::new());
        for (motor, line) in lines.iter().enumerate() {
            let is_coarse = chart.is_coarse && !panel.crowded(line);
            let pieces = panel.trusted_rows(line, (mark(motor).colour, 1.8), chart.horizon, is_coarse)?;
            pieces.iter().for_each(|piece| occupied.line(piece));
            if let Some(end) = pieces.last().and_then(|piece| piece.last()) {
                ends.push((end[1], labels[motor].clone(), mark(motor)));
            }
        }
        // Rings of many motors would say less than none.
        for (motor, line) in lines.iter().enumerate().filter(|_| lines.len() <= MARKED) {
            peak(&sheet, panel, line, unit, mark(motor).colour, &mut occupied)?;
        }
        panel.horizon(chart.horizon, label.as_deref().filter(|_| k == 0))?;
        if lines.iter().flatten().all(|p| !p[1].is_finite()) {
            panel.empty("no data")?;
        }
        if several {
            panel.end_labels(&ends, false)?;
        }
    }
    Ok(sheet.picture(&chart.title, &caption))
}

fn zero(lines: &[Vec<Point>]) -> Option<f64> {
    (!lines.is_empty()).then_some(0.0)
}

/// The largest magnitude of a line that is not zero all along.
fn top(line: &[Point]) -> Option<Point> {
    let usable = line.iter().filter(|p| p[1].abs() <= 1e300 && p[0].is_finite());
    usable.max_by(|a, b| a[1].abs().total_cmp(&b[1].abs())).copied().filter(|top| top[1] != 0.0)
}

/// A ring and words at the largest magnitude.
fn peak(
    sheet: &Sheet,
    panel: &Panel,
    line: &[Point],
    unit: &str,
    colour: Colour,
    occupied: &mut Occupied,
) -> Result<(), ChartError> {
    let Some(top) = top(line) else { return Ok(()) };
    let at = panel.at(top);
    sheet.disc(at, 4.0, super::palette::WHITE)?;
    sheet.ring(at, 2.9, colour, 1.3)?;
    occupied.block([at[0] - 4.0, at[1] - 4.0, at[0] + 4.0, at[1] + 4.0]);
    let span = panel.x.to - panel.x.from;
    let time =
        if span > 1e3 || !(0.1..1e5).contains(&top[0].abs()) { figure(top[0]) } else { decimal(top[0], 2) };
    panel.note_beside(at, &format!("{} {unit} at {time} s", figure(top[1])), readable(colour), occupied)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_of_the_run_is_marked_where_it_is_known() {
        let motor = MotorSeries {
            name: "motor".to_owned(),
            time: vec![0.0, 1.0, 2.0],
            torque: vec![0.0, -3.76, 1.0],
            power: vec![0.0, -20.0, 6.0],
        };
        let words = |peak: [Option<Point>; 2]| -> String {
            let chart =
                TorquePower { motors: vec![motor.clone()], peaks: vec![peak], ..TorquePower::default() };
            let texts = torque_power(&chart, 1.0).expect("a picture").texts;
            texts.into_iter().map(|text| text.text + "|").collect()
        };
        let of_rows = words([None; 2]);
        assert!(of_rows.contains("−3.76 N·m at 1.00 s|") && of_rows.contains("largest of the rows marked|"));
        let torque = words([Some([-3.82, 1.1]), None]);
        assert!(
            torque.contains("|−3.82 N·m at 1.10 s|") && torque.contains("−20.00 W at 1.00 s"),
            "{torque}"
        );
        assert!(torque.contains("and of the run where an output tells it"), "{torque}");
        let both = words([Some([-3.82, 1.1]), Some([-20.3, 1.1])]);
        assert!(both.contains("−20.30 W at 1.10 s") && both.contains("largest of the run marked|"), "{both}");
    }
}
