//! Pages of runs: every row, every control, and nothing else.

use crate::chromium::{Browser, Tab};
use crate::{DESK, PHONE, agrees, examples, is_drawn, page, pages, scene, scrub};
use std::path::Path;

/// Pages of every second example, at the same time as those of the others.
fn pages_draw_their_rows_and_nothing_else(first: usize) {
    let Some(mut browser) = Browser::start() else { return };
    for scene in examples().into_iter().skip(first).step_by(2) {
        let folder = tempfile::tempdir().expect("a folder");
        let page = page(&scene, &[], folder.path());
        let mut tab = browser.tab(DESK);
        tab.open(&page, "");
        is_drawn(&mut tab, &page);
        let rows = tab.number("driftless.main.t.length") as usize;
        for row in [0, rows / 3, rows - 1] {
            scrub(&mut tab, row);
            agrees(&mut tab, &page, row);
            is_drawn(&mut tab, &page);
        }
        let complaints = tab.complaints();
        assert!(complaints.is_empty(), "{scene}: {complaints:?}");
    }
}

#[test]
fn pages_of_examples_draw_their_rows_and_nothing_else() {
    pages_draw_their_rows_and_nothing_else(0);
}

#[test]
fn pages_of_the_other_examples_draw_their_rows_and_nothing_else() {
    pages_draw_their_rows_and_nothing_else(1);
}

#[test]
fn links_keys_and_the_mouse_go_to_times() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let page = page(&scene("motor"), &["--until", "20", "--every", "0.02"], folder.path());
    let mut tab = browser.tab(DESK);
    tab.open(&page, "#t=6&speed=0.5");
    assert_eq!(tab.eval("document.getElementById('clock').textContent"), "6.000 s");
    assert_eq!(tab.eval("document.getElementById('factor').textContent"), "0.5 ×");
    agrees(&mut tab, &page, 300);
    for (key, shift, t) in
        [("ArrowRight", false, 6.02), ("ArrowLeft", true, 5.82), ("Home", false, 0.0), ("End", false, 20.0)]
    {
        tab.key(key, shift);
        let shown = tab.number("driftless.time");
        assert!((shown - t).abs() < 1e-9, "{key}: {shown}");
    }
    tab.key("ArrowUp", false);
    assert!((tab.number("driftless.speed") - 0.625).abs() < 1e-12);
    // From the end playing begins anew, and stops where it is told to.
    tab.key(" ", false);
    tab.eval("new Promise((done) => setTimeout(done, 400))");
    let played = tab.number("driftless.time");
    assert!(played > 0.05 && played < 5.0, "{played}");
    tab.key(" ", false);
    let stopped = tab.number("driftless.time");
    tab.eval("new Promise((done) => setTimeout(done, 150))");
    assert_eq!(tab.number("driftless.time"), stopped);
    // A hash of its own after a while, which leads back.
    tab.eval("driftless.go(7)");
    tab.eval("new Promise((done) => setTimeout(done, 400))");
    assert_eq!(tab.eval("location.hash"), "#t=7");
    // Hovering moves the cursor of all charts; a click goes there, a drag zooms all of them.
    let place = |tab: &mut Tab<'_>, share: f64| {
        let at = |edge: &str| format!("driftless.charts[0].plot.over.getBoundingClientRect().{edge}");
        let [left, width, top] = ["left", "width", "top"].map(|edge| tab.number(&at(edge)));
        [left + share * width, top + 30.0]
    };
    let at = place(&mut tab, 0.25);
    tab.mouse(at, false);
    let rows = tab.eval("driftless.charts.map((chart) => chart.plot.cursor.idx)");
    let rows: Vec<f64> =
        rows.as_array().expect("rows").iter().map(|row| row.as_f64().expect("a row")).collect();
    assert!(rows.iter().all(|row| (row - 250.0).abs() <= 2.0), "{rows:?}");
    tab.mouse(at, true);
    assert!((tab.number("driftless.time") - 5.0).abs() < 0.05);
    tab.eval("driftless.charts[1].plot.setScale('x', {min: 2, max: 4})");
    tab.settle();
    assert_eq!(tab.eval("driftless.charts.every((chart) => chart.plot.scales.x.min === 2 && chart.plot.scales.x.max === 4)"), true);
    assert!(tab.complaints().is_empty());
}

#[test]
fn several_runs_lie_over_one_another() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scene("motor");
    let arguments = [
        "run",
        &scene,
        "--html",
        "--no-charts",
        "-q",
        "--method",
        "dp5",
        "--rtol",
        "1e-6",
        "--until",
        "10",
        "--stabilize",
        "elimination,projection,baumgarte,none",
    ];
    let pages = pages(&arguments, folder.path());
    let mut tab = browser.tab(DESK);
    tab.open(pages.last().expect("pages"), "#t=4");
    assert_eq!(tab.number("driftless.runs.length"), 4.0);
    let titles = tab.eval("driftless.charts.map((chart) => chart.title)");
    for title in ["Constraint residuals [rad]", "Distance from the first run [m]"] {
        assert!(titles.as_array().expect("titles").iter().any(|known| known == title), "{titles}");
    }
    assert_eq!(tab.number("document.querySelectorAll('#legend li').length"), 4.0);
    assert!(tab.complaints().is_empty());
}

#[test]
fn a_run_lies_beside_its_reference() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let loose = ["--method", "dp5", "--rtol", "1e-5", "--until", "4", "--every", "0.02"];
    let run = page(&scene("free"), &loose, folder.path());
    let home = run.parent().and_then(Path::to_str).expect("a folder");
    let page = pages(&["view", home, "--reference", "-q"], &folder.path().join("view")).remove(0);
    let mut tab = browser.tab(DESK);
    tab.open(&page, "#t=4");
    assert_eq!(tab.eval("driftless.runs.map((run) => run.label)[1]"), "reference");
    let apart = tab.number(
        "10 ** driftless.charts.find((chart) => chart.title.startsWith('Distance')).lines()[0].values.at(-1)",
    );
    // What the run says of its own error is about the distance of its worse bar from the reference.
    let record = std::fs::read_to_string(run.with_file_name("run.json")).expect("a record");
    let record: serde_json::Value = serde_json::from_str(&record).expect("JSON");
    let estimate = record["result"]["trust"]["error_estimate"].as_f64().expect("an estimate");
    let share = apart / (1.2 * estimate);
    assert!((0.05..20.0).contains(&share), "{apart} m apart, estimated {estimate} rad");
    assert!(tab.complaints().is_empty());
}

#[test]
fn hostile_words_stay_words() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(scene("motor")).expect("a scene");
    let mut scene: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let hostile =
        "</script><script>window.hacked = 1</script><img src=x onerror='window.hacked=2'>\"'&lt;{{data}}";
    scene["description"] = hostile.into();
    let file = folder.path().join("hostile.json");
    std::fs::write(&file, scene.to_string()).expect("written");
    let page = page(file.to_str().expect("a name"), &["--until", "1"], folder.path());
    // Whatever a record says, 64 kB of it as well, is shown as words.
    let record = page.with_file_name("run.json");
    let text = std::fs::read_to_string(&record).expect("a record");
    let mut told: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    told["result"]["method"] = hostile.into();
    told["result"]["notes"] = serde_json::json!([format!("{hostile}{}", "ä".repeat(32 * 1024))]);
    std::fs::write(&record, told.to_string()).expect("written");
    let page = pages(
        &["view", page.parent().and_then(Path::to_str).expect("a folder"), "-q"],
        &folder.path().join("view"),
    )
    .remove(0);
    let mut tab = browser.tab(DESK);
    tab.open(&page, "#t=%3Cscript%3E&speed=nan");
    assert_eq!(tab.eval("typeof window.hacked"), "undefined");
    assert_eq!(tab.number("document.querySelectorAll('img').length"), 0.0);
    for place in ["#title", "#caption", "#words"] {
        let text = tab.eval(&format!("document.querySelector('{place}').textContent"));
        assert!(text.as_str().expect("words").contains(hostile), "{place}: {text}");
    }
    // The policy holds for whoever gets in some other way.
    tab.eval("{ const script = document.createElement('script'); script.textContent = 'window.hacked = 3'; document.body.append(script); }");
    assert_eq!(tab.eval("typeof window.hacked"), "undefined");
}

#[test]
fn long_runs_show_their_window_row_by_row() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let page = page(
        &scene("motor"),
        &["--until", "5000", "--every", "0.02", "--trust", "off", "--window", "1000..1100"],
        folder.path(),
    );
    let size = std::fs::metadata(&page).expect("a page").len();
    assert!(size < 1_500_000, "{size} bytes");
    let mut tab = browser.tab(DESK);
    tab.open(&page, "#t=1050");
    // Of the processor's time, since others may want it too.
    let work = tab.worked();
    assert!(work < 1.0, "ready after {work} s of work");
    agrees(&mut tab, &page, 52_500);
    is_drawn(&mut tab, &page);
    assert_eq!(tab.eval("driftless.remark()"), "");
    tab.eval("driftless.go(4000)");
    tab.settle();
    is_drawn(&mut tab, &page);
    assert_eq!(tab.eval("driftless.remark()"), "single rows; all of them from 1000 s to 1100 s");
    assert!(tab.complaints().is_empty());
}

#[test]
fn phones_and_the_dark_have_a_layout() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let page = page(&scene("crank_rocker"), &[], folder.path());
    let mut tab = browser.tab(PHONE);
    tab.open(&page, "");
    let wide = tab.number("document.scrollingElement.scrollWidth");
    assert!(wide <= f64::from(PHONE[0]), "{wide}");
    is_drawn(&mut tab, &page);
    tab.eval("document.getElementById('theme').click()");
    tab.settle();
    let dark = tab.eval("[...driftless.stage.context.getImageData(3, 3, 1, 1).data].slice(0, 3)");
    assert_eq!(dark, serde_json::json!([21, 24, 29]));
    assert!(tab.complaints().is_empty());
}
