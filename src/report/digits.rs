//! How a run in many digits went: its table, its record, its page.

use super::page::{Page, counted, figure, magnitude};
use crate::arithmetic::Real;
use crate::dynamics::Mechanism;
use crate::run::digits::{DigitsPair, DigitsSource, Forecast, LongEvent, LongHold, LongTurn, ShownRow, Wide};
use crate::run::drift;
use crate::run::files::sha256;
use crate::stepping::StepError;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::io::{self, BufWriter, Write};

/// What a table shows of each body.
const QUANTITIES: [(&str, &str); 6] =
    [("phi", "rad"), ("omega", "rad/s"), ("x", "m"), ("y", "m"), ("vx", "m/s"), ("vy", "m/s")];
/// Digits beyond those known that are shown.
const BEYOND: usize = 3;

/// How rows are laid out.
#[derive(Clone, Debug)]
pub struct RowLayout {
    names: Vec<String>,
    /// Digits shown, where they were asked for.
    shown: Option<usize>,
    /// Digits carried.
    carried: usize,
    is_proved: bool,
    has_friction: bool,
}

impl RowLayout {
    /// Of a mechanism; `is_proved` where two runs are compared.
    pub fn new(mechanism: &Mechanism, shown: Option<usize>, carried: usize, is_proved: bool) -> Self {
        let names = mechanism.own_bodies().iter().map(|body| body.name.clone()).collect();
        let has_friction = !mechanism.frictions.is_empty();
        Self { names, shown, carried, is_proved, has_friction }
    }

    /// Digits of the numbers of a row.
    fn digits(&self, agreement: Option<f64>) -> usize {
        let known = agreement.map_or(self.carried, |digits| digits.max(0.0) as usize + BEYOND);
        self.shown.unwrap_or(known).max(1)
    }

    fn header(&self) -> String {
        let mut columns = vec!["t [s]".to_owned()];
        for name in &self.names {
            columns.extend(QUANTITIES.map(|(quantity, unit)| format!("{name}.{quantity} [{unit}]")));
        }
        columns.extend(["kinetic [J]", "potential [J]", "work [J]", "imbalance [1]"].map(str::to_owned));
        columns.extend(["residual [rad or m]", "residual' [rad/s or m/s]"].map(str::to_owned));
        columns.extend(self.has_friction.then(|| "friction [J]".to_owned()));
        columns.extend(self.is_proved.then(|| "agreement [digits]".to_owned()));
        columns.join(",")
    }
}

/// Numbers as decimal text.
fn decimal(number: &Wide, digits: usize) -> String {
    number.to_decimal(digits)
}

/// All events as a table, with their numbers to as many digits as runs agree to.
pub fn events(shown: &DigitsReport) -> String {
    let DigitsReport { source, layout, events, within, .. } = shown;
    let mut text = super::events::header(&source.mechanism);
    text += if within.is_some() { ",agreement [digits]\n" } else { "\n" };
    for (event, agreement) in *events {
        let digits = layout.digits(*agreement);
        let numbers = super::events::numbers(&source.mechanism, &event.phi, &event.omega);
        let mut cells = vec![event.name.clone(), decimal(&event.t, digits)];
        cells.extend(numbers.map(|number| decimal(number, digits)));
        cells.extend(agreement.map(|agreement| format!("{agreement:.1}")));
        text += &cells.join(",");
        text.push('\n');
    }
    text
}

/// The trajectory as CSV.
pub struct DigitsTable<W: Write> {
    layout: RowLayout,
    writer: BufWriter<W>,
}

impl<W: Write> DigitsTable<W> {
    /// With its header.
    ///
    /// # Errors
    /// What the writer says.
    pub fn new(layout: RowLayout, writer: W) -> io::Result<Self> {
        let mut table = Self::going_on(layout, writer);
        writeln!(table.writer, "{}", table.layout.header())?;
        Ok(table)
    }

    /// One whose header is there.
    pub fn going_on(layout: RowLayout, writer: W) -> Self {
        Self { layout, writer: BufWriter::new(writer) }
    }

    /// Its layout.
    pub fn layout(&self) -> &RowLayout {
        &self.layout
    }

    /// Writes a row.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&mut self, row: &ShownRow, agreement: Option<f64>) -> io::Result<()> {
        let digits = self.layout.digits(agreement);
        let bodies = row.bodies.iter().take(self.layout.names.len()).flatten();
        let mut cells = vec![decimal(&row.t, self.layout.carried)];
        cells.extend(bodies.chain(&row.energy).map(|number| decimal(number, digits)));
        cells.extend([row.drift, row.residual[0], row.residual[1]].map(|number| format!("{number:.3e}")));
        cells.extend(row.friction.iter().map(|number| decimal(number, digits)));
        cells.extend(agreement.map(|agreement| format!("{agreement:.1}")));
        writeln!(self.writer, "{}", cells.join(","))
    }

    /// Writes out what is buffered.
    ///
    /// # Errors
    /// What the writer says.
    pub fn written(&mut self) -> io::Result<&mut W> {
        self.writer.flush()?;
        Ok(self.writer.get_mut())
    }

    /// Hands the writer back.
    ///
    /// # Errors
    /// What the writer says.
    pub fn finish(self) -> io::Result<W> {
        self.writer.into_inner().map_err(io::IntoInnerError::into_error)
    }
}

/// What rows so far amount to.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Summary {
    /// Time of the last row \[s\].
    pub t: f64,
    /// Rows.
    pub rows: u64,
    /// Largest imbalance of energy over its scale.
    pub drift: f64,
    /// Largest residuals of the constraints.
    pub residual: [f64; 2],
    /// Digits of agreement at the last row.
    pub agreement: Option<f64>,
    /// The least of all rows.
    pub least: Option<f64>,
    /// Where the runs part \[s\].
    pub parted: Option<f64>,
    /// The largest energy or work of any row \[J\].
    pub largest: f64,
    /// Why the run stopped.
    #[serde(skip)]
    pub stop: Option<StepError>,
    /// Wall time \[s\].
    #[serde(skip)]
    pub wall_s: f64,
    /// The numbers of the last row, body by body.
    last: Vec<Vec<Vec<u64>>>,
    /// Energy lost in dry friction up to it.
    friction: Option<Vec<u64>>,
}

impl Summary {
    /// Takes a row.
    pub fn take(&mut self, row: &ShownRow, agreement: Option<f64>) {
        (self.t, self.rows) = (row.time(), self.rows + 1);
        self.drift = self.drift.max(row.drift.abs());
        let [kinetic, _, work] = row.energy.map(|energy| energy.value().abs());
        self.largest = self.largest.max(kinetic).max(work);
        self.residual = std::array::from_fn(|level| self.residual[level].max(row.residual[level]));
        self.agreement = agreement;
        self.least = match (self.least, agreement) {
            (Some(least), Some(agreement)) => Some(least.min(agreement)),
            (least, agreement) => agreement.or(least),
        };
        self.friction = row.friction.as_ref().map(Wide::to_words);
        self.last = row.bodies.iter().map(|body| body.iter().map(Wide::to_words).collect()).collect();
    }

    /// Takes the row at which runs part.
    pub fn parts(&mut self, row: &ShownRow, agreement: f64) {
        (self.parted, self.agreement) = (Some(row.time()), Some(agreement));
    }

    fn last(&self) -> Vec<Vec<Wide>> {
        let body = |words: &Vec<Vec<u64>>| words.iter().filter_map(|words| Wide::from_words(words)).collect();
        self.last.iter().map(body).collect()
    }
}

/// What is reported.
pub struct DigitsReport<'a> {
    /// The scene.
    pub source: &'a DigitsSource,
    /// The runs.
    pub pair: &'a DigitsPair,
    /// How numbers are laid out.
    pub layout: &'a RowLayout,
    /// What the rows amount to.
    pub summary: &'a Summary,
    /// How near runs must be \[rad\].
    pub within: Option<f64>,
    /// Events, with the digits to which runs agree.
    pub events: &'a [(LongEvent, Option<f64>)],
}

impl DigitsReport<'_> {
    /// The event that has ended the run.
    fn ended_by(&self) -> Option<&str> {
        self.pair.runs().last().and_then(|run| run.ended_by())
    }
}

/// What a proof will take, before it begins.
pub fn forecast(forecast: &Forecast, until: f64) -> String {
    let Forecast { growth, run, companion, steps, seconds, .. } = forecast;
    format!(
        "errors grow by {growth:.1} digits up to t = {until} s: {} digits at order {} and, beside them, {} \
            at order {}; about {steps} steps, {} s of computing",
        run.digits,
        run.order,
        companion.digits,
        companion.order,
        super::page::rough(*seconds)
    )
}

/// The report as one JSON object; numbers of many digits are texts.
pub fn object(shown: &DigitsReport) -> Value {
    let DigitsReport { source, pair, layout, summary, within, events } = shown;
    let digits = layout.digits(summary.agreement);
    let bodies: Map<String, Value> = (layout.names.iter().zip(summary.last()))
        .map(|(name, numbers)| {
            let member = |(&(key, _), number): (&(&str, &str), &Wide)| {
                (key.to_owned(), json!(decimal(number, digits)))
            };
            (name.clone(), Value::Object(QUANTITIES.iter().zip(&numbers).map(member).collect()))
        })
        .collect();
    let run = |run: &dyn crate::run::digits::LongRun| {
        let ([steps, impacts], precision) = (run.counts(), run.precision());
        json!({"digits": precision.digits, "order": precision.order, "steps": steps, "impacts": impacts})
    };
    let runs: Vec<Value> = pair.runs().iter().map(|one| run(&**one)).collect();
    let first: Vec<Value> = (events.iter().take(super::events::NAMED))
        .map(|(event, agreement)| {
            let t = decimal(&event.t, layout.digits(*agreement));
            json!({"name": event.name, "t": t, "agreement_digits": agreement})
        })
        .collect();
    let mut object = json!({
        "scene": source.scene.name,
        "method": "taylor",
        "settings": runs.first(),
        "until": summary.t,
        "rows": summary.rows,
        "steps": pair.runs().first().map(|run| run.counts()[0]),
        "wall_s": summary.wall_s,
        "final": {"t": summary.t, "bodies": bodies},
        "energy": {
            "kind": drift::kind(&source.mechanism),
            "max_relative": summary.drift,
            "scale": source.mechanism.energy_scale,
        },
        "constraints": {"position_max": summary.residual[0], "velocity_max": summary.residual[1]},
        "trust": within.map(|within| json!({
            "within": within,
            "until": summary.t,
            "agreement_digits": summary.agreement,
            "least_agreement_digits": summary.least,
            "parted_at": summary.parted,
            "runs": runs,
            "how": "two runs with other digits and orders, compared at every row",
        })),
        "stop": summary.stop,
    });
    if super::events::has_any(&source.mechanism) {
        object["events"] = json!({"count": events.len(), "ended_by": shown.ended_by(), "first": first});
    }
    if let Some(holds) = holds(pair, layout) {
        object["holds"] = holds;
    }
    if let Some(friction) = friction(shown) {
        object["friction"] = friction;
    }
    object
}

/// The times that points stayed on their walls, where any did.
fn holds(pair: &DigitsPair, layout: &RowLayout) -> Option<Value> {
    let holds = Some(pair.holds()).filter(|holds| !holds.is_empty())?;
    let first: Vec<Value> = (holds.iter().take(super::events::NAMED))
        .map(|(LongHold { wall, t, until }, agreement)| {
            let text = |t: &Wide| decimal(t, layout.digits(*agreement));
            json!({"wall": wall, "t": text(t), "until": until.as_ref().map(text),
                "agreement_digits": agreement})
        })
        .collect();
    Some(json!({"count": holds.len(), "first": first}))
}

/// What dry friction took, and its transitions, where there is any.
fn friction(shown: &DigitsReport) -> Option<Value> {
    let lost = Wide::from_words(shown.summary.friction.as_ref()?)?;
    let turns = shown.pair.turns();
    let first: Vec<Value> = (turns.iter().take(super::friction::NAMED))
        .map(|(LongTurn { name, t, does }, agreement)| {
            let t = decimal(t, shown.layout.digits(*agreement));
            json!({"t": t, "name": name, "mode": does, "agreement_digits": agreement})
        })
        .collect();
    let lost = decimal(&lost, shown.layout.digits(shown.summary.agreement));
    Some(json!({"energy_lost_j": lost, "transitions": turns.len(), "first": first}))
}

/// The record of a run: the report, the scene, versions; what depends on the clock stands apart.
pub fn record(shown: &DigitsReport, trajectory: &str) -> Value {
    let mut object = object(shown);
    let wall = object.as_object_mut().and_then(|members| members.remove("wall_s"));
    let scene = json!(shown.source.scene);
    json!({
        "driftless": env!("CARGO_PKG_VERSION"),
        "scene_sha256": sha256(&scene.to_string()),
        "trajectory_sha256": trajectory,
        "scene": scene,
        "result": object,
        "timings": {"wall_s": wall},
    })
}

/// The report as a page.
pub fn text(shown: &DigitsReport) -> String {
    let DigitsReport { source, pair, layout, summary, within, events } = shown;
    let mut page = Page::new(&source.scene.name, &source.scene.description);
    for run in pair.runs() {
        let ([steps, impacts], precision) = (run.counts(), run.precision());
        let mut words = format!(
            "taylor of order {} on {} digits, {}",
            precision.order,
            precision.digits,
            counted(steps, "step", "steps")
        );
        if !source.mechanism.contacts.is_empty() {
            words += &format!(", {}", counted(impacts, "impact", "impacts"));
            let holds = run.holds().len() as u64;
            if holds > 0 {
                words += &format!(", {} on walls", counted(holds, "stay", "stays"));
            }
        }
        page.entry("method", &words);
    }
    page.entry("cost", &format!("{:.3} s", summary.wall_s));
    if let Some(within) = within {
        let digits = summary.agreement.unwrap_or(0.0);
        page.entry(
            "trusted until",
            &match summary.parted {
                None => format!("t = {} s: both runs agree to {digits:.1} digits there", figure(summary.t)),
                Some(t) => format!(
                    "t = {} s: the runs part by more than {within} at t = {} s",
                    figure(summary.t),
                    figure(t)
                ),
            },
        );
        if let Some(least) = summary.least {
            page.entry(
                "",
                &format!("{least:.1} digits at the least of {}", counted(summary.rows, "row", "rows")),
            );
        }
    }
    if let Some(stop) = &summary.stop {
        page.entry("stopped", &format!("at t = {} s: {}", figure(stop.t), stop.what));
    }
    page.entry("final state", &format!("t = {} s", figure(summary.t)));
    let digits = layout.digits(summary.agreement);
    for (name, numbers) in layout.names.iter().zip(summary.last()) {
        for ((quantity, unit), number) in QUANTITIES.iter().zip(&numbers).take(2) {
            page.entry(&format!("{name}.{quantity}"), &format!("{} {unit}", decimal(number, digits)));
        }
    }
    let scale = figure(source.mechanism.energy_scale);
    page.entry("energy drift", &format!("{} of {scale} J at most", magnitude(summary.drift)));
    if !source.mechanism.constraints.is_empty() {
        let [position, velocity] = summary.residual.map(magnitude);
        page.entry("constraints", &format!("{position} rad or m and {velocity} rad/s or m/s at most"));
    }
    if let Some(lost) = summary.friction.as_ref().and_then(|words| Wide::from_words(words)) {
        let turns = pair.turns();
        let last = |name: &str| turns.iter().rfind(|(turn, _)| turn.name == name);
        let ends: Vec<_> = (source.mechanism.frictions.iter().filter_map(|friction| last(&friction.name)))
            .map(|(turn, _)| (turn.name.as_str(), turn.does, turn.t.value()))
            .collect();
        super::friction::describe_ends(&mut page, lost.value(), turns.len() as u64, &ends);
    }
    let times: Vec<_> = events.iter().map(|(event, _)| (event.name.as_str(), event.t.value())).collect();
    super::events::describe_times(&mut page, &source.mechanism, &times);
    if let Some(event) = shown.ended_by() {
        page.entry("ended by", event);
    }
    page.into_text()
}
