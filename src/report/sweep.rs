//! What a sweep amounted to, and its chart.

use super::displaced::displaced;
use super::page::{Page, counted, figure, magnitude};
#[cfg(feature = "charts")]
use crate::chart::{self, Cell, ChartError, FILE_RESOLUTION, Map, MapAxis, Picture, ProfileChart, plain};
use crate::run::files::sha256;
use crate::run::sweep::table::columns;
#[cfg(feature = "charts")]
use crate::run::sweep::table::{SweepLayout, numbers};
use crate::run::trust::{HORIZON, Level};
#[cfg(feature = "charts")]
use crate::run::{Status, SweepPoint};
use crate::run::{Sweep, Totals};
use serde_json::{Value, json};

/// The report as one JSON object; `wall_s` \[s\] and `threads` are what differs from run to run.
pub fn object(sweep: &Sweep, totals: &Totals) -> Value {
    let axes = sweep.grid().axes().iter().zip(sweep.variables());
    let vary: Vec<Value> = axes
        .map(|(axis, variable)| {
            json!({"path": variable.path, "unit": variable.unit, "from": axis.from,
                "to": axis.to, "count": axis.count})
        })
        .collect();
    let plan = sweep.plan();
    let mut object = json!({
        "scene": sweep.scene().name,
        "method": plan.method.info().name,
        "why": plan.why,
        "settings": super::settings(plan),
        "until": plan.until,
        "vary": vary,
        "columns": columns(sweep),
        "points": sweep.grid().count(),
        "done": totals.done,
        "stopped": totals.stopped,
        "refused": totals.refused,
        "skipped": totals.skipped,
        "flipped": totals.flipped,
        "trust": (sweep.trust() != Level::Off).then(|| json!({
            "level": sweep.trust().name(),
            "tolerance": HORIZON,
            "judged": totals.judged,
            "in_doubt": totals.doubtful,
        })),
        "steps": totals.steps,
        "energy": {"max_relative": totals.energy.0, "point": totals.energy.1},
        "constraints": {"position_max": totals.constraint[0], "velocity_max": totals.constraint[1]},
        "notes": super::displaced::notes(sweep, totals),
        "threads": totals.threads,
        "wall_s": totals.wall.as_secs_f64(),
    });
    if let Some(shard) = sweep.shard() {
        let range = sweep.range();
        object["shard"] =
            json!({"number": shard.number(), "of": shard.of(), "from": range.start, "to": range.end});
    }
    object
}

/// What `sweep.json` holds: the report, the resolved scene, versions, hashes; what differs from run to run
/// stands in `timings` alone.
pub fn record(sweep: &Sweep, totals: &Totals, table_sha256: &str) -> Value {
    let mut report = object(sweep, totals);
    let mut taken = |key: &str| report.as_object_mut().and_then(|members| members.shift_remove(key));
    let timings = json!({"wall_s": taken("wall_s"), "threads": taken("threads")});
    let input = super::result::as_run(sweep.scene(), sweep.plan()).to_input();
    json!({
        "format": 1,
        "versions": {"driftless": env!("CARGO_PKG_VERSION"), "target": super::result::target()},
        "hashes": {"scene_sha256": sha256(&input.to_string()), "table_sha256": table_sha256},
        "result": report,
        "resolved_scene": input,
        "timings": timings,
    })
}

/// The report as a page.
pub fn text(sweep: &Sweep, totals: &Totals) -> String {
    let scene = sweep.scene();
    let mut page = Page::new(&scene.name, &scene.description);
    page.entry("method", &super::setting(sweep.plan()));
    page.entry("", sweep.plan().why.as_deref().unwrap_or("as asked for"));
    for (number, (axis, variable)) in sweep.grid().axes().iter().zip(sweep.variables()).enumerate() {
        let unit = if variable.unit.is_empty() { String::new() } else { format!(" {}", variable.unit) };
        let range = format!(
            "{}: {} to {}{unit}, {}",
            variable.path,
            figure(axis.from),
            figure(axis.to),
            counted(axis.count, "value", "values")
        );
        page.entry(if number == 0 { "varied" } else { "" }, &range);
    }
    displaced(sweep, totals).iter().for_each(|displaced| page.entry("start", &displaced.to_string()));
    if let Some(shard) = sweep.shard() {
        let range = sweep.range();
        let of = sweep.grid().count();
        page.entry("part", &format!("{shard}: points {} to {} of {of}", range.start + 1, range.end));
    }
    let seconds = totals.wall.as_secs_f64();
    let rate = figure((sweep.count() as f64 / seconds.max(1e-9)).round());
    let [points, steps] = [counted(sweep.count(), "point", "points"), counted(totals.steps, "step", "steps")];
    let threads = counted(totals.threads as u64, "thread", "threads");
    page.entry("cost", &format!("{points}, {steps}, {seconds:.3} s on {threads}, {rate} points a second"));
    page.entry("points", &by_status(totals));
    if totals.refused + totals.stopped > 0 {
        page.entry("", "why points were refused or stopped: column `cause` of the table");
    }
    page.entry(
        "turned over",
        &match common_end(sweep, totals) {
            Some(end) => format!("{} of {points}, by t = {} s", totals.flipped, figure(end)),
            None => format!("{} of {points}, by the end of each run", totals.flipped),
        },
    );
    if sweep.trust() != Level::Off {
        let (of, without) = (totals.judged, totals.done - totals.judged.min(totals.done));
        let rest = if without > 0 { format!("; {without} without an estimate") } else { String::new() };
        page.entry(
            "trust",
            &format!(
                "{} of {} in doubt: off by more than {HORIZON:e} rad at their end{rest}",
                totals.doubtful,
                counted(of, "point", "points")
            ),
        );
    }
    page.entry(
        "energy drift",
        &format!("{} of its scale at most, in row {}", magnitude(totals.energy.0), totals.energy.1 + 1),
    );
    if let Some(unit) = sweep.mechanism().unit_of_rows() {
        let [position, velocity] = totals.constraint.map(magnitude);
        page.entry("constraints", &format!("{position} {unit} and {velocity} {} at most", per_second(unit)));
    }
    page.into_text()
}

/// When all runs ended \[s\], but for those that end as a bar turns over; none where events ended them at
/// different times.
fn common_end(sweep: &Sweep, totals: &Totals) -> Option<f64> {
    if sweep.ends_at_flips() || totals.ends.is_none() { Some(sweep.plan().until) } else { totals.end() }
}

/// The unit of the rate of a constraint.
fn per_second(unit: &str) -> String {
    unit.split(" or ").map(|unit| format!("{unit}/s")).collect::<Vec<_>>().join(" or ")
}

/// `12 done, 3 stopped, 1 refused`.
fn by_status(totals: &Totals) -> String {
    let kinds = [
        (totals.done, "done"),
        (totals.stopped, "stopped"),
        (totals.refused, "refused"),
        (totals.skipped, "skipped"),
    ];
    kinds
        .iter()
        .filter(|(count, word)| *count > 0 || *word == "done")
        .map(|(count, word)| format!("{count} {word}"))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Most points a chart remembers; more could not be told apart in it.
#[cfg(feature = "charts")]
const MOST: u64 = 1 << 22;

/// The chart of a sweep over one or two values, as its points come in.
#[cfg(feature = "charts")]
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct SweepChart {
    /// Which of the numbers of a row.
    column: Option<usize>,
    layout: SweepLayout,
    /// The numbers of all points so far; not a number where there is none.
    seen: Vec<f64>,
    failed: Vec<bool>,
}

/// What the chart of a sweep says beside its points.
#[cfg(feature = "charts")]
#[derive(Debug)]
pub(super) struct Labels {
    pub title: String,
    pub caption: Vec<String>,
    /// What is shown, with its unit.
    pub value: String,
    pub axes: Vec<MapAxis>,
    pub is_log: bool,
    pub is_flip: bool,
    /// What a point without a number means.
    pub never: String,
}

/// Why there is no chart of a column.
#[cfg(feature = "charts")]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoChart {
    /// The table has no such column, or it holds words.
    #[error("the table has no column of numbers `{0}`\nhint: there are: {1}")]
    Column(String, String),
    /// A list of points has no order.
    #[error("the points are a list; a chart shows a grid")]
    Listed,
    /// A chart shows one or two varied values.
    #[error("{0} values are varied; a chart shows one or two")]
    Dimensions(usize),
    /// More points than a chart can show.
    #[error("{0} points are more than a chart can show ({MOST})")]
    Points(u64),
    /// Nothing to show.
    #[error("no bar turned over; --map COLUMN draws another column: {0}")]
    Nothing(String),
}

#[cfg(feature = "charts")]
impl SweepChart {
    /// A chart of this column of the table, its unit left out or not, or of the flip times.
    ///
    /// # Errors
    /// There can be no such chart.
    pub fn new(sweep: &Sweep, column: Option<&str>) -> Result<Self, NoChart> {
        if sweep.grid().is_listed() {
            return Err(NoChart::Listed);
        }
        let axes = sweep.grid().axes().len();
        if axes > 2 {
            return Err(NoChart::Dimensions(axes));
        }
        if sweep.grid().count() > MOST {
            return Err(NoChart::Points(sweep.grid().count()));
        }
        let names = results(sweep);
        let short = |name: &str| name.split(" [").next().unwrap_or_default().to_owned();
        let column = match column {
            None => None,
            Some(wanted) => Some(
                names
                    .iter()
                    .position(|name| name == wanted || short(name) == wanted)
                    .ok_or_else(|| NoChart::Column(wanted.to_owned(), listed(sweep)))?,
            ),
        };
        Ok(Self { column, layout: SweepLayout::of(sweep), seen: Vec::new(), failed: Vec::new() })
    }

    /// Whether it can be the chart of so many points of a sweep.
    pub fn fits(&self, sweep: &Sweep, points: u64) -> bool {
        let sizes = [self.seen.len(), self.failed.len()];
        let is_known = self.column.is_none_or(|column| column < results(sweep).len());
        is_known && self.layout == SweepLayout::of(sweep) && sizes.iter().all(|&size| size as u64 == points)
    }

    /// With the points of the part that follows.
    pub fn join(&mut self, next: &Self) {
        self.seen.extend(&next.seen);
        self.failed.extend(&next.failed);
    }

    /// Takes a point.
    pub fn see(&mut self, point: &SweepPoint) {
        let numbers = numbers(point, self.layout);
        let column = self.column.map_or(numbers.len() - 1, |column| column + point.values.len());
        self.seen.push(numbers[column]);
        self.failed.push(matches!(point.status, Status::Stopped(_) | Status::Refused(_)));
    }

    /// The numbers of all points so far; NaN where there is none.
    pub(super) fn values(&self) -> &[f64] {
        &self.seen
    }

    /// Which points stopped or were refused.
    pub(super) fn failed(&self) -> &[bool] {
        &self.failed
    }

    /// What its chart says.
    pub(super) fn labels(&self, sweep: &Sweep, totals: &Totals) -> Labels {
        let end = common_end(sweep, totals);
        let names = results(sweep);
        let is_flip = self.column.is_none_or(|column| column + 1 == names.len());
        let name = if is_flip {
            "flip time [s]".to_owned()
        } else {
            spaced(&names[self.column.unwrap_or_default()])
        };
        let bare = name.split(" [").next().unwrap_or_default().to_owned();
        let axes: Vec<MapAxis> = (sweep.grid().axes().iter().zip(sweep.variables()))
            .map(|(axis, variable)| {
                let unit =
                    if variable.unit.is_empty() { String::new() } else { format!(" [{}]", variable.unit) };
                MapAxis {
                    name: format!("{}{unit}", plain(&variable.path)),
                    from: axis.from,
                    to: axis.to,
                    count: axis.count as usize,
                    log: false,
                }
            })
            .collect();
        let title =
            if is_flip { "Time until a bar first turns over".to_owned() } else { titled(&bare, sweep, end) };
        let mut caption =
            vec![format!("scene {}", plain(&sweep.scene().name)), plain(&super::setting(sweep.plan()))];
        caption.push(format!(
            "{} {}, {}",
            axes.iter().map(|axis| axis.count.to_string()).collect::<Vec<_>>().join(" × "),
            if sweep.grid().count() == 1 { "point" } else { "points" },
            end.map_or_else(
                || format!("up to {} s each", figure(sweep.plan().until)),
                |end| format!("{} s each", figure(end))
            )
        ));
        let is_wide = is_flip || names[self.column.unwrap_or_default()].contains("drift") || name == "steps";
        let is_log = is_wide && (axes.len() == 2 || chart::spans_decades(&self.seen));
        let never = match end {
            _ if !is_flip => "no value".to_owned(),
            Some(end) => format!("not within {} s", figure(end)),
            None => "not before the end".to_owned(),
        };
        caption.extend(displaced(sweep, totals).iter().map(|displaced| plain(&displaced.briefly())));
        Labels { title, caption, value: name, axes, is_log, is_flip, never }
    }

    /// The map of a sweep over two values.
    pub(super) fn map(&self, labels: &Labels) -> Option<Map> {
        let [x, y] = &labels.axes[..] else { return None };
        let cells =
            self.seen.iter().zip(&self.failed).map(|(&value, &failed)| match (value.is_nan(), failed) {
                (false, _) => Cell::Value(value),
                (true, true) => Cell::Failed,
                (true, false) => Cell::Never,
            });
        Some(Map {
            title: labels.title.clone(),
            caption: labels.caption.clone(),
            x: x.clone(),
            y: y.clone(),
            cells: cells.collect(),
            value: labels.value.clone(),
            log: labels.is_log,
            dark_high: labels.is_flip,
            range: None,
            words: [labels.never.clone(), "left out".to_owned(), "stopped or refused".to_owned()],
        })
    }

    /// Draws what was seen.
    ///
    /// # Errors
    /// Drawing fails; `Ok` with the reason where there is nothing to show.
    pub fn draw(&self, sweep: &Sweep, totals: &Totals) -> Result<Result<Picture, NoChart>, ChartError> {
        let labels = self.labels(sweep, totals);
        if labels.is_flip && self.seen.iter().all(|time| time.is_nan()) {
            return Ok(Err(NoChart::Nothing(listed(sweep))));
        }
        let picture = match self.map(&labels) {
            Some(map) => chart::map(&map, FILE_RESOLUTION),
            None => {
                let Labels { title, mut caption, value: name, axes, is_log: log, never, .. } = labels;
                if self.seen.iter().any(|value| value.is_nan()) {
                    caption.push(format!("dots on the upper edge: {never}"));
                }
                let values = (0..sweep.grid().count()).map(|index| sweep.grid().values(index)[0]).collect();
                let x_name = axes.first().map(|axis| axis.name.clone()).unwrap_or_default();
                chart::profile(
                    &ProfileChart {
                        title,
                        caption,
                        x_name,
                        y_name: name,
                        x: values,
                        y: self.seen.clone(),
                        log,
                    },
                    FILE_RESOLUTION,
                )
            }
        };
        Ok(Ok(picture?))
    }
}

/// The columns of numbers that came out.
#[cfg(feature = "charts")]
fn results(sweep: &Sweep) -> Vec<String> {
    let mut names = columns(sweep).split_off(sweep.variables().len());
    names.truncate(names.len() - 3);
    names
}

#[cfg(feature = "charts")]
fn listed(sweep: &Sweep) -> String {
    results(sweep)
        .iter()
        .map(|name| name.split(" [").next().unwrap_or_default().to_owned())
        .collect::<Vec<_>>()
        .join(", ")
}

/// A column's name as the name of an axis.
#[cfg(feature = "charts")]
fn spaced(name: &str) -> String {
    if !name.contains("drift") {
        return plain(name);
    }
    // Of the energy it is told as a share of the scene's scale of energy.
    let name = name.replace('_', " ").replace(" [1]", "");
    if name == "energy drift" { format!("relative {name}") } else { name }
}

/// What a column is, and of which time: `max:O` is the largest O over the run, an angle that at its end.
#[cfg(feature = "charts")]
fn titled(column: &str, sweep: &Sweep, end: Option<f64>) -> String {
    let of = |(kind, name)| match kind {
        "min" => Some(format!("Least {name}")),
        "max" => Some(format!("Largest {name}")),
        "mean" => Some(format!("Mean {name}")),
        "rms" => Some(format!("Rms of {name}")),
        _ => None,
    };
    let until = figure(end.unwrap_or(sweep.plan().until));
    let over = column.split_once(':').and_then(of);
    let over = over.or_else(|| column.contains("drift").then(|| format!("Largest {column}")));
    match over {
        Some(over) if end.is_none() => format!("{over} over each run"),
        Some(over) => format!("{over} over {until} s"),
        None if matches!(column, "steps" | "horizon" | "t") => {
            let up_to = if end.is_none() { "up to " } else { "" };
            format!("{} of runs of {up_to}{until} s", capital(column))
        }
        None if sweep.ends_at_flips() => format!("{} at the end", capital(column)),
        None if end.is_none() => format!("{} at the end of each run", capital(column)),
        None => format!("{} at {until} s", capital(column)),
    }
}

#[cfg(feature = "charts")]
fn capital(name: &str) -> String {
    if name.contains('.') {
        return name.to_owned();
    }
    let mut letters = name.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
