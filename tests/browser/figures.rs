//! Pictures to be looked at, and figures; by hand.

use crate::chromium::{Browser, Tab};
use crate::{DESK, PHONE, page, scene};
use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
#[ignore = "writes pictures to be looked at"]
fn pictures() {
    let out = PathBuf::from(std::env::var("PICTURES").unwrap_or_else(|_| "target/pictures".into()));
    std::fs::create_dir_all(&out).expect("a folder");
    let mut browser = Browser::start().expect("a browser");
    for name in [
        "motor",
        "free",
        "spring",
        "wall",
        "four_bars",
        "chain8",
        "kepler",
        "slider_crank_driven",
        "stick_slip",
        "andrews",
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let page = page(&scene(name), &[], folder.path());
        for (size, word) in [(DESK, "desk"), (PHONE, "phone")] {
            let mut tab = browser.tab(size);
            tab.open(&page, "");
            tab.eval("driftless.go(0.4 * driftless.end)");
            tab.settle();
            if word == "phone" {
                tab.eval("driftless.theme(true)");
                tab.settle();
            }
            tab.screenshot(&out.join(format!("{name}-{word}.png")));
        }
    }
}

/// A chain of so many bars, released from rest as a gentle fan.
fn chain(bars: usize, folder: &Path) -> String {
    let names: Vec<String> = (1..=bars).map(|k| format!("bar{k}")).collect();
    let end = |body: &str, x: f64| serde_json::json!({"body": body, "point": [x, 0.0]});
    let hinges: Vec<serde_json::Value> = (0..bars)
        .map(|k| {
            let inner = if k == 0 { end("ground", 0.0) } else { end(&names[k - 1], 0.1) };
            serde_json::json!({"name": format!("J{k}"), "between": [inner, end(&names[k], 0.0)]})
        })
        .collect();
    let bar = |name: &String| serde_json::json!({"name": name, "length": 0.1, "width": 0.01, "thickness": 0.003, "density": 670.0});
    let start: serde_json::Map<String, serde_json::Value> = (names.iter().enumerate())
        .map(|(k, name)| (name.clone(), serde_json::json!({"phi": 1.2 - 0.004 * k as f64, "omega": 0.0})))
        .collect();
    let scene = serde_json::json!({
        "name": format!("chain{bars}"), "gravity": [9.81, 0.0], "bars": names.iter().map(bar).collect::<Vec<_>>(),
        "hinges": hinges, "start": start, "until": 4.0, "every": 0.01,
    });
    let file = folder.join(format!("chain{bars}.json"));
    std::fs::write(&file, scene.to_string()).expect("written");
    file.display().to_string()
}

/// Frames a second while it plays for three seconds, and what the page's main thread works for one \[ms\].
fn frames(tab: &mut Tab<'_>) -> [f64; 2] {
    let (before, from) = (tab.worked(), tab.number("driftless.frames"));
    let rate = tab.number(
        "new Promise((done) => { driftless.play(true); const from = driftless.frames; const at = performance.now(); \
         setTimeout(() => done(1000 * (driftless.frames - from) / (performance.now() - at)), 3000); })",
    );
    let count = tab.number("driftless.frames") - from;
    [rate, 1e3 * (tab.worked() - before) / count]
}

#[test]
#[ignore = "prints figures"]
fn figures() {
    let mut browser = Browser::start().expect("a browser");
    let folder = tempfile::tempdir().expect("a folder");
    let long = chain(128, folder.path());
    for (what, scene, more) in [
        ("motor, 500 s", scene("motor"), &["--until", "500", "--every", "0.02"][..]),
        ("motor, 250 001 rows", scene("motor"), &["--until", "5000", "--every", "0.02", "--trust", "off"]),
        ("eight bars", scene("chain8"), &[]),
        ("128 bars", long, &["--trust", "off"]),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let page = page(&scene, more, folder.path());
        let size = std::fs::metadata(&page).expect("a page").len();
        let mut ready: Vec<f64> = (0..5).map(|_| browser.tab(DESK).open(&page, "")).collect();
        ready.sort_by(f64::total_cmp);
        let mut tab = browser.tab(DESK);
        tab.open(&page, "");
        let opened = 1e3 * tab.worked();
        // Four charts: angles, rates, drift and one more.
        tab.eval("{ driftless.charts.splice(4).forEach((chart) => { chart.plot.destroy(); chart.element.remove(); }); }");
        let [frames, work] = frames(&mut tab);
        println!(
            "{what}: {size} bytes, ready after {} ms (of five: {ready:?}; {opened:.0} ms of work), {frames:.1} frames a \
             second with four charts ({work:.1} ms of work each)",
            ready[2]
        );
    }
}

#[test]
#[ignore = "prints figures"]
fn cost() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scene("motor");
    // Seconds of processor time, which other load leaves alone; the kernel counts hundredths.
    let worked = || {
        let text = std::fs::read_to_string("/proc/self/stat").expect("Linux");
        let fields: Vec<&str> = text.rsplit(')').next().expect("fields").split_whitespace().collect();
        fields[13..15].iter().map(|ticks| ticks.parse::<f64>().expect("ticks")).sum::<f64>() / 100.0
    };
    let time = |more: &[&str]| {
        let begin = worked();
        let done = Command::new(env!("CARGO_BIN_EXE_driftless"))
            .args(["run", &scene, "--until", "5000", "--every", "0.02", "--no-charts", "-q", "--force"])
            .args(more)
            .arg("--out")
            .arg(folder.path())
            .status();
        assert!(done.expect("a program").success());
        worked() - begin
    };
    // In turn, so that other load hits both.
    let mut ratios: Vec<f64> = (0..9)
        .map(|_| {
            let (without, with) = (time(&[]), time(&["--html"]));
            println!("{without:.2} s of work without, {with:.2} s with");
            with / without
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    println!("a run of 250 001 rows takes {:.3} times the work with its page (median of nine)", ratios[4]);
}
