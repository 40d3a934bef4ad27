//! Pages of runs in a real browser: what is drawn, what the controls do, and that nothing else happens.
//!
//! Where no Chromium is installed the tests say so and pass.
//! `PICTURES=folder cargo test --test browser pictures -- --ignored` keeps pictures of ten pages at two sizes,
//! `cargo test --test browser figures -- --ignored --nocapture` prints times to the first frame and frames a
//! second, and `cargo test --test browser cost -- --ignored --nocapture` what a page costs a run.
#![cfg(all(feature = "cli", feature = "charts"))]

#[path = "browser/chromium.rs"]
mod chromium;
#[path = "browser/figures.rs"]
mod figures;
#[path = "browser/playground.rs"]
mod playground;
#[path = "browser/runs.rs"]
mod runs;
#[path = "browser/studies.rs"]
mod studies;

use chromium::Tab;
use std::path::{Path, PathBuf};
use std::process::Command;

const DESK: [u32; 2] = [1400, 900];
const PHONE: [u32; 2] = [390, 800];

/// Runs the program; returns the pages it wrote, those of several runs last.
fn pages(arguments: &[&str], out: &Path) -> Vec<PathBuf> {
    let done = Command::new(env!("CARGO_BIN_EXE_driftless"))
        .args(arguments)
        .arg("--out")
        .arg(out)
        .output()
        .expect("a program");
    assert!(
        matches!(done.status.code(), Some(0 | 4 | 5)),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&done.stderr)
    );
    let mut folders = vec![out.to_owned()];
    let (mut single, mut several) = (Vec::new(), Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            match path.file_name().and_then(|name| name.to_str()) {
                _ if path.is_dir() => folders.push(path),
                Some("run.html" | "sweep.html" | "compare.html") => single.push(path),
                Some("runs.html") => several.push(path),
                _ => {}
            }
        }
    }
    single.sort();
    single.extend(several);
    assert!(!single.is_empty(), "{arguments:?} wrote no page");
    single
}

/// The page of one run.
fn page(scene: &str, more: &[&str], out: &Path) -> PathBuf {
    let arguments = [&["run", scene, "--html", "--no-charts", "-q", "--force"], more].concat();
    pages(&arguments, out).remove(0)
}

fn scene(name: &str) -> String {
    format!("{}/examples/scenes/{name}.json", env!("CARGO_MANIFEST_DIR"))
}

fn examples() -> Vec<String> {
    let folder = format!("{}/examples/scenes", env!("CARGO_MANIFEST_DIR"));
    let mut found: Vec<String> = std::fs::read_dir(folder)
        .expect("scenes")
        .map(|entry| entry.expect("an entry").path().display().to_string())
        .filter(|path| path.ends_with(".json"))
        .collect();
    found.sort();
    found
}

/// A row of a trajectory, by the names of its columns without their units.
fn row(page: &Path, number: usize) -> Vec<(String, f64)> {
    let text = std::fs::read_to_string(page.with_file_name("trajectory.csv")).expect("a trajectory");
    let mut lines = text.lines();
    let names = lines
        .next()
        .expect("a header")
        .split(',')
        .map(|name| name.split(" [").next().unwrap_or(name).to_owned());
    let numbers = lines.nth(number).expect("a row").split(',').map(|field| field.parse().expect("a number"));
    names.zip(numbers).collect()
}

/// The numbers that the charts show at the time of the page, by name.
const SHOWN: &str = "Object.fromEntries(driftless.charts.flatMap((chart) => \
    [...chart.body.querySelectorAll('.u-series')].slice(1).map((row) => \
    [row.querySelector('.u-label').textContent, row.querySelector('.u-value').textContent])))";

/// Goes to a row with the scrub bar.
fn scrub(tab: &mut Tab<'_>, row: usize) {
    tab.eval(&format!(
        "{{ const bar = document.getElementById('scrub'); bar.value = {row}; bar.dispatchEvent(new Event('input')); }}"
    ));
    tab.settle();
}

/// What the charts show is what stands in the row, as far as it is shown.
fn agrees(tab: &mut Tab<'_>, page: &Path, number: usize) {
    let expected = row(page, number);
    let shown = tab.eval(SHOWN);
    let shown = shown.as_object().expect("numbers");
    assert!(!shown.is_empty());
    for (name, text) in shown {
        let text = text.as_str().expect("words");
        let column = if name == "energy drift" { "imbalance" } else { name.as_str() };
        let (_, value) =
            expected.iter().find(|(known, _)| known == column).unwrap_or_else(|| panic!("no column {name}"));
        let is_drift = column == "imbalance" || name.ends_with(".C");
        let number: f64 = text.parse().unwrap_or_else(|_| panic!("{name}: {text}"));
        // Angles to 1e-4 rad, drifts to a digit, others to a few 1e-5 of their range.
        let near = if is_drift {
            *value == 0.0 && number == 0.0 || (number / value.abs() - 1.0).abs() < 0.08
        } else {
            let range = tab.number(&format!(
                "(() => {{ const k = driftless.main.columns.findIndex((c) => c.name === {}); return 65536 * driftless.main.columns[k].quantum; }})()",
                serde_json::json!(name)
            ));
            (number - value).abs()
                <= 2e-5 * range
                    + 6e-5 * value.abs().min(1.0)
                    + 1.1e-4 * f64::from(u8::from(name.ends_with(".phi")))
        };
        assert!(near, "{}: row {number}: {name} is shown as {text}, not {value}", page.display());
    }
}

/// Ink where the bars are, and the mark of the time at one place in all charts.
fn is_drawn(tab: &mut Tab<'_>, page: &Path) {
    let bare = tab.eval(
        "(() => { const { stage, main, time } = driftless; const pose = main.motion.at(time); \
         const context = stage.canvas.getContext('2d'); \
         return main.geometry.bodies.map((body, k) => { \
           const [a, b] = body.ends.map(([x, y]) => stage.at(located([k, x, y], pose))); \
           const [x, y] = [0.35 * a[0] + 0.65 * b[0], 0.35 * a[1] + 0.65 * b[1]]; \
           const [r, g, bl] = context.getImageData(Math.round(x * stage.ratio), Math.round(y * stage.ratio), 1, 1).data; \
           return r > 245 && g > 245 && bl > 245 ? body.name : null; }).filter((name) => name !== null); })()",
    );
    assert_eq!(bare, serde_json::json!([]), "{}: bars without ink", page.display());
    let apart = tab.number(
        "(() => { const places = driftless.charts.map((chart) => chart.now.getBoundingClientRect().left - chart.plot.over.getBoundingClientRect().left); \
         return Math.max(...places) - Math.min(...places); })()",
    );
    assert!(apart < 0.5, "{}: {apart} px apart", page.display());
}
