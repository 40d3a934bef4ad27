//! Tables of points for formulas: written in the scene, or two columns of a CSV file beside it.

use super::at::At;
use super::judge::check_name;
use crate::scene::PointTable;
use crate::scene::error::SceneError;
use crate::scene::format::FieldShape;
use crate::scene::formula::POINTS;
use crate::scene::locate::{Located, Texts, Value};
use crate::scene::set::Override;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const HINT: &str = "for example {\"gust\": [[0, 0], [1, 2.5]]} or {\"gust\": \"gust.csv\"}";
/// The longest file \[bytes\]: the most points, with many columns beside theirs.
const LONGEST: u64 = 256 << 20;

/// The texts of the CSV files that the tables of a scene name, by these names as they are written.
pub type TableFiles = Arc<Vec<(String, String)>>;

/// Reads the files that the tables of a scene name, once for all the times it is judged; those that cannot be
/// read are left out, and the judge says why.
pub fn table_files(text: &str, source: &str, overrides: &[Override]) -> TableFiles {
    let Ok((source, tree)) = super::put_together(text, source, overrides) else {
        return TableFiles::default();
    };
    let Some(Value::Object(members)) = tree.at("tables").map(|node| &node.value) else {
        return TableFiles::default();
    };
    let mut files: Vec<(String, String)> = Vec::new();
    for member in members {
        let name = match &member.node.value {
            Value::Object(_) => member.node.at("file").map(|node| &node.value),
            value => Some(value),
        };
        let Some(Value::Text(name)) = name else { continue };
        if files.iter().all(|(known, _)| known != name)
            && let Ok(text) = contents(&beside(&source, name))
        {
            files.push((name.clone(), text));
        }
    }
    Arc::new(files)
}

/// Where a file is whose name counts from the folder of the scene.
fn beside(source: &Texts, name: &str) -> PathBuf {
    Path::new(&source.file).parent().unwrap_or(Path::new("")).join(name)
}

/// The tables of a scene.
pub(super) fn tables(root: &At) -> Result<Vec<PointTable>, SceneError> {
    let Some(at) = root.child("tables") else { return Ok(Vec::new()) };
    let Value::Object(members) = &at.node.value else { return Err(refused(&at)) };
    let mut tables: Vec<PointTable> = Vec::new();
    for member in members {
        let table = at.member(member);
        let taken: Vec<&str> = tables.iter().map(|table| table.name.as_str()).collect();
        check_name(at.source, &member.key, member.span, &table.path, &taken)?;
        let points = match &member.node.value {
            Value::List(nodes) => listed(&table, nodes)?,
            Value::Text(file) => from_file(&table, file, None)?,
            Value::Object(_) => {
                let text = |key: &str| {
                    table.child(key).and_then(|at| match &at.node.value {
                        Value::Text(text) => Some(text.as_str()),
                        _ => None,
                    })
                };
                let [Some(file), Some(x), Some(y)] = [text("file"), text("x"), text("y")] else {
                    return Err(refused(&table));
                };
                from_file(&table, file, Some([x, y]))?
            }
            _ => return Err(refused(&table)),
        };
        tables.push(PointTable { name: member.key.clone(), points });
    }
    Ok(tables)
}

fn refused(at: &At) -> SceneError {
    at.refuse_value(&FieldShape::Tables.allowed(), HINT)
}

/// Refuses a number of points; `source` is where they are from, ` in gust.csv`, or empty.
fn counted(table: &At, count: usize, source: &str) -> Result<(), SceneError> {
    let [least, most] = POINTS;
    if (least..=most).contains(&count) {
        return Ok(());
    }
    let hint = if count < least {
        "add points: a curve needs two; what is constant is a number or a parameter"
    } else {
        "thin it out, or write a formula"
    };
    let points = if count == 1 { "point" } else { "points" };
    let problem = format!("has {count} {points}{source}");
    Err(table.refuse(&problem, &FieldShape::Tables.allowed(), hint))
}

/// Points written in the scene.
fn listed(table: &At, nodes: &[Located]) -> Result<Vec<[f64; 2]>, SceneError> {
    counted(table, nodes.len(), "")?;
    let mut points: Vec<[f64; 2]> = Vec::with_capacity(nodes.len());
    for (number, node) in nodes.iter().enumerate() {
        let item = table.item(node, number);
        let Value::List(pair) = &node.value else { return Err(refused(&item)) };
        let point = match pair.as_slice() {
            [x, y] => match (&x.value, &y.value) {
                (Value::Number(x), Value::Number(y)) if x.is_finite() && y.is_finite() => [*x, *y],
                _ => return Err(refused(&item)),
            },
            _ => return Err(refused(&item)),
        };
        if points.last().is_some_and(|last| point[0] <= last[0]) {
            return Err(item.refuse_value("must have a larger x than the point before", "sort the points"));
        }
        points.push(point);
    }
    Ok(points)
}

/// Points of a CSV file, whose name counts from the folder of the scene.
fn from_file(table: &At, name: &str, columns: Option<[&str; 2]>) -> Result<Vec<[f64; 2]>, SceneError> {
    let path = beside(table.source, name);
    let shown = path.display();
    let refuse = |problem: String, hint: &str| {
        Err(table.refuse(&problem, "must be a CSV file of numbers, x ascending", hint))
    };
    let read;
    let text = match table.source.tables.iter().find(|(known, _)| known == name) {
        Some((_, text)) => text,
        None => match contents(&path) {
            Ok(text) => {
                read = text;
                &read
            }
            Err((problem, hint)) => return refuse(problem, hint),
        },
    };
    let hint = "two columns with commas, semicolons, tabs or blanks between; lines with # are comments";
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim).enumerate();
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#')).peekable();
    let is_header =
        lines.peek().is_some_and(|(_, line)| cells(line).any(|cell| cell.parse::<f64>().is_err()));
    let header: Vec<&str> = if is_header {
        lines.next().map_or(Vec::new(), |(_, line)| cells(line).collect())
    } else {
        Vec::new()
    };
    let mut places = [0, 1];
    for (place, column) in places.iter_mut().zip(columns.into_iter().flatten()) {
        match header.iter().position(|cell| *cell == column) {
            Some(found) => *place = found,
            None => {
                let known = if header.is_empty() { "no header".into() } else { header.join(", ") };
                return refuse(format!("has no column {column} in {shown}"), &format!("it has {known}"));
            }
        }
    }
    let mut points: Vec<[f64; 2]> = Vec::new();
    for (number, line) in lines {
        let row: Vec<&str> = cells(line).collect();
        let at = format!("{shown}, line {}", number + 1);
        if columns.is_none() && row.len() != 2 {
            let hint = "{\"file\": …, \"x\": …, \"y\": …} names two columns of several";
            return refuse(format!("is read from {at}, which has {} columns", row.len()), hint);
        }
        let value = |place: usize| row.get(place).and_then(|cell| cell.parse::<f64>().ok());
        let [Some(x), Some(y)] = places.map(|place| value(place).filter(|value| value.is_finite())) else {
            return refuse(format!("is read from {at}, which is no pair of numbers: {line:?}"), hint);
        };
        if points.last().is_some_and(|last| x <= last[0]) {
            return refuse(
                format!("is read from {at}, whose x is not above the one before"),
                "sort the rows",
            );
        }
        points.push([x, y]);
    }
    counted(table, points.len(), &format!(" in {shown}"))?;
    Ok(points)
}

/// The text of a file; else what is wrong with it, and a hint.
fn contents(path: &Path) -> Result<String, (String, &'static str)> {
    let shown = path.display();
    let mut bytes = Vec::new();
    std::fs::File::open(path).and_then(|file| file.take(LONGEST + 1).read_to_end(&mut bytes)).map_err(
        |error| (format!("cannot be read from {shown}: {error}"), "names count from the scene's folder"),
    )?;
    if bytes.len() as u64 > LONGEST {
        let hint = "thin it out, or keep the two columns alone";
        return Err((format!("is read from {shown}, which is longer than {} MiB", LONGEST >> 20), hint));
    }
    String::from_utf8(bytes)
        .map_err(|_| (format!("is read from {shown}, which is not UTF-8"), "save the file as UTF-8"))
}

/// The cells of a line.
fn cells(line: &str) -> impl Iterator<Item = &str> {
    let separator = [',', ';', '\t'].into_iter().find(|separator| line.contains(*separator));
    let cells: Vec<&str> = match separator {
        Some(separator) => line.split(separator).collect(),
        None => line.split_whitespace().collect(),
    };
    cells.into_iter().map(|cell| cell.trim().trim_matches('"'))
}
