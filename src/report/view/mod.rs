//! Runs as a page to look at: read back from their folders, thinned out where they are long.
//!
//! A page is made of what stands in the folder, `run.json` and `trajectory.csv`, and of nothing else: a run
//! of last year, or of another machine, has the same page as one that has just ended.

mod columns;
mod compare;
mod error;
mod lines;
mod live;
mod rows;
mod sweep;
mod words;

pub use compare::compared;
pub use error::ViewError;
pub use sweep::{holds, swept};

use super::geometry::geometry;
use crate::dynamics::Mechanism;
use crate::html::{Document, PackedColumn};
use crate::run::Sample;
use crate::run::files::{RECORD, TRAJECTORY, quoted};
use crate::run::table;
use crate::run::table_reader::TableReader;
use crate::scene::{Scene, parse_scene};
use columns::{Role, ShownColumn, columns, fits};
use rows::{KeptRows, Thinning};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most runs on a page.
pub const MOST_RUNS: usize = 16;
/// Step of angles shown \[rad\].
const ANGLE: f64 = 1e-4;
/// Steps in the range of any other column.
const STEPS: f64 = 65536.0;
/// Step of decimal logarithms.
const DECADE: f64 = 0.01;

/// A run to be shown.
#[derive(Debug)]
pub struct Viewed {
    label: String,
    record: Value,
    scene: Scene,
    mechanism: Arc<Mechanism>,
    columns: Vec<ShownColumn>,
    kept: KeptRows,
}

/// Rows of a run under way, thinned out for its page.
#[derive(Debug)]
pub struct Gathering {
    numbers: table::Shown,
    row: Vec<f64>,
    thinning: Thinning,
}

impl Gathering {
    /// Of a run up to a horizon with a row every so often \[s\]; `window` as in [`Viewed::read`].
    pub fn new(mechanism: &Mechanism, until: f64, every: f64, window: Option<[f64; 2]>) -> Self {
        Self::of(mechanism, &columns(mechanism), [until, every], window)
    }

    /// The same with these columns alone.
    fn of(mechanism: &Mechanism, columns: &[ShownColumn], span: [f64; 2], window: Option<[f64; 2]>) -> Self {
        let thinning = thinning(columns, span, window);
        Self { numbers: table::Shown::new(mechanism), row: Vec::new(), thinning }
    }

    /// Sees the row of a sample.
    pub fn see(&mut self, sample: &Sample) {
        self.row.clear();
        self.numbers.append(sample, &mut self.row);
        self.thinning.push(&self.row);
    }

    /// Sees a row of the table.
    pub fn push(&mut self, row: &[f64]) {
        self.thinning.push(row);
    }
}

fn thinning(columns: &[ShownColumn], [until, every]: [f64; 2], window: Option<[f64; 2]>) -> Thinning {
    let rows = (until / every).ceil().clamp(1.0, 1e12) as u64 + 1;
    let treatments = columns.iter().map(|column| (column.source, column.role.treatment())).collect();
    Thinning::new(treatments, rows, window)
}

/// The rows of the trajectory in a folder.
fn kept(
    mechanism: &Mechanism,
    columns: &[ShownColumn],
    folder: &Path,
    span: [f64; 2],
    window: Option<[f64; 2]>,
) -> Result<KeptRows, ViewError> {
    if let Some(window) = window.filter(|[from, to]| *from > span[0] || *to < 0.0) {
        return Err(ViewError::Window { file: folder.join(TRAJECTORY), window, until: span[0] });
    }
    let mut reader = TableReader::open(&folder.join(TRAJECTORY))?;
    fits(reader.names(), &table::header(mechanism), folder)?;
    reader.only(columns.iter().map(|column| column.source));
    let mut thinning = thinning(columns, span, window);
    let mut row = Vec::new();
    while reader.next(&mut row)? {
        thinning.push(&row);
    }
    let kept = thinning.finish();
    match window {
        Some(window) if kept.exact[0] == kept.exact[1] => {
            Err(ViewError::Window { file: folder.join(TRAJECTORY), window, until: span[0] })
        }
        _ => Ok(kept),
    }
}

/// The folders of runs meant by a folder: itself, or those in it, in the order of their names; or those of
/// the only folder in it that holds any.
///
/// # Errors
/// It holds none, or those of several scenes.
pub fn runs_in(folder: &Path) -> Result<Vec<PathBuf>, ViewError> {
    let is_run = |path: &Path| path.join(RECORD).is_file() && path.join(TRAJECTORY).is_file();
    if is_run(folder) {
        return Ok(vec![folder.to_owned()]);
    }
    let inside = |folder: &Path| {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut inside: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        inside.sort();
        inside
    };
    let runs = |folder: &Path| inside(folder).into_iter().filter(|path| is_run(path)).collect::<Vec<_>>();
    let found = runs(folder);
    if !found.is_empty() {
        return Ok(found);
    }
    let mut scenes = inside(folder);
    scenes.retain(|scene| !runs(scene).is_empty());
    match &scenes[..] {
        [] => Err(ViewError::None { folder: folder.to_owned() }),
        [scene] => Ok(runs(scene)),
        _ => Err(ViewError::Several { folder: folder.to_owned(), scenes }),
    }
}

/// Whether a folder holds a run in many digits, of which there is no page.
pub fn is_in_digits(folder: &Path) -> bool {
    let text = std::fs::read_to_string(folder.join(RECORD)).unwrap_or_default();
    let record: Value = serde_json::from_str(&text).unwrap_or_default();
    !record["result"]["settings"]["digits"].is_null()
}

impl Viewed {
    /// Reads the run in a folder.
    ///
    /// `window` \[s\] is kept row by row where the run is longer than a page can hold; left out, its
    /// beginning. Rows that were `gathered` while it ran need not be read again.
    ///
    /// # Errors
    /// There is none, or its files do not go together.
    pub fn read(
        folder: &Path,
        window: Option<[f64; 2]>,
        gathered: Option<Gathering>,
    ) -> Result<Self, ViewError> {
        let file = folder.join(RECORD);
        let damaged = |why: String| ViewError::Record { file: file.clone(), why };
        let text =
            std::fs::read_to_string(&file).map_err(|_| ViewError::None { folder: folder.to_owned() })?;
        let record: Value = serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
        let scene =
            record.get("resolved_scene").ok_or_else(|| damaged("no entry `resolved_scene`".into()))?;
        let scene = parse_scene(&scene.to_string(), &quoted(&file), &[])
            .map_err(|error| damaged(error.to_string()))?;
        let mechanism =
            Arc::new(Mechanism::of_sound(&scene, Vec::new()).map_err(|error| damaged(error.to_string()))?);
        let until = record["result"]["final"]["t"].as_f64().unwrap_or(scene.until);
        let columns = columns(&mechanism);
        let kept = match gathered {
            Some(gathered) => gathered.thinning.finish(),
            None => kept(&mechanism, &columns, folder, [until, scene.every], window)?,
        };
        let label = folder
            .canonicalize()
            .ok()
            .and_then(|path| path.file_name().map(|name| name.to_string_lossy().into_owned()));
        let label = label.unwrap_or_else(|| scene.name.clone());
        Ok(Self { label, record, scene, mechanism, columns, kept }.settled())
    }

    /// Without the second copy of the angles where every row is there: they are what they are in charts.
    fn settled(mut self) -> Self {
        if self.kept.exact == [0, self.kept.columns[0].len()] {
            self.columns.retain(|column| column.role != Role::Pose);
            self.kept.columns.truncate(self.columns.len());
        }
        self
    }

    /// Its table.
    fn table(&self) -> Vec<PackedColumn> {
        let range = |k: usize| {
            let values = self.kept.columns[k].iter().copied().filter(|value| value.is_finite());
            let [low, high] =
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
            (high - low).max(0.0)
        };
        let is_place = |column: &ShownColumn| column.role == Role::Position;
        let reach =
            (0..self.columns.len()).filter(|&k| is_place(&self.columns[k])).map(range).fold(0.0, f64::max);
        let column = |(k, shown): (usize, &ShownColumn)| PackedColumn {
            name: shown.name.clone(),
            unit: shown.unit.clone(),
            values: self.kept.columns[k].clone(),
            quantum: match shown.role {
                Role::Time => self.scene.every / 4096.0,
                Role::Angle | Role::Pose => ANGLE,
                Role::Position => reach / STEPS,
                Role::Energy | Role::Residual => DECADE,
                _ => range(k) / STEPS,
            },
            is_logarithm: matches!(shown.role, Role::Energy | Role::Residual),
        };
        self.columns.iter().enumerate().map(column).collect()
    }

    /// What the page's script is told of it.
    fn data(&self) -> Value {
        let poses = self.poses();
        json!({
            "label": self.label,
            "scene": self.scene.name,
            "description": self.scene.description,
            "setting": words::setting(&self.record),
            "command": words::command(&self.record, &self.scene),
            "summary": words::summary(&self.record),
            "notes": self.record["result"]["notes"],
            "record": self.record,
            "horizon": self.record["result"]["trust"]["horizon_s"],
            "marks": words::marks(&self.record),
            "geometry": geometry(&self.scene, &self.mechanism),
            "poses": poses,
            "exact": self.kept.exact,
            "rows": self.kept.rows,
            "every": self.scene.every,
            "charts": self.charts(),
            // Those after it are not for charts.
            "shown": self.columns.iter().filter(|column| column.role != Role::Pose).count(),
            "distances": [],
        })
    }

    /// The columns of angle and centre of each body, as they are at a row.
    fn poses(&self) -> Vec<[usize; 3]> {
        let of = |role: Role| (0..self.columns.len()).filter(move |&k| self.columns[k].role == role);
        let places: Vec<usize> = of(Role::Position).collect();
        let turns = if of(Role::Pose).next().is_some() { Role::Pose } else { Role::Angle };
        of(turns).zip(places.chunks(2)).map(|(phi, place)| [phi, place[0], place[1]]).collect()
    }
}

fn of_several_scenes(runs: &[Viewed]) -> bool {
    runs.iter().any(|run| run.scene.name != runs[0].scene.name)
}

/// The names of runs on a page: those of their folders, with the scene before where scenes differ.
fn labels(runs: &[Viewed]) -> Vec<String> {
    let with_scene = of_several_scenes(runs);
    let label = |run: &Viewed| match with_scene {
        true => format!("{}/{}", run.scene.name, run.label),
        false => run.label.clone(),
    };
    runs.iter().map(label).collect()
}

/// A page of these runs: the first in full, the others beside it.
pub fn page(runs: &[Viewed]) -> Document {
    let names = labels(runs);
    let mut data: Vec<Value> = runs.iter().map(Viewed::data).collect();
    for (data, name) in data.iter_mut().zip(&names) {
        data["label"] = json!(name);
    }
    let mut tables: Vec<Vec<PackedColumn>> = runs.iter().map(Viewed::table).collect();
    let Some((first, others)) = runs.split_first() else { return Document::default() };
    for other in others {
        let distance = first.distance(other);
        let index = distance.as_ref().map(|_| tables[0].len());
        tables[0].extend(distance);
        if let Some(distances) = data[0]["distances"].as_array_mut() {
            distances.push(json!(index));
        }
    }
    Document {
        title: match of_several_scenes(runs) {
            true => names.join(", "),
            false => format!("{}: {}", first.scene.name, names.join(", ")),
        },
        data: json!({"kind": "runs", "runs": data}),
        tables,
    }
}
