//! The playground, where it has been built.

use crate::chromium::{Browser, Tab};
use crate::{DESK, page, row, scene};
use driftless::{Limits, Mechanism, Plan, Request, Run, Running, Sample, read_scene};
use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

#[test]
fn the_playground_integrates_what_is_edited_and_dragged() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/playground/index.html");
    if !file.is_file() {
        eprintln!("the playground is not built (`.ci/playground fetch` builds it): it is not opened");
        return;
    }
    let Some(mut browser) = Browser::start() else { return };
    let mut tab = browser.tab(DESK);
    tab.open(&file, "");
    // The spring swings as the program's does.
    let folder = tempfile::tempdir().expect("a folder");
    let run = page(&scene("spring"), &["--until", "2", "--every", "0.015625"], folder.path());
    assert_eq!(tab.eval("driftless.core.advance(129)"), true);
    for (place, (name, expected)) in
        (3..).step_by(3).zip(row(&run, 128).iter().filter(|(name, _)| name.ends_with(".phi")))
    {
        let phi = tab.number(&format!("driftless.core.numbers()[{place}]"));
        assert!((phi - expected).abs() < 1e-7, "{name}: {phi}, {expected}");
    }
    tab.eval("driftless.read()");
    tab.eval("driftless.play(true)");
    tab.eval("new Promise((done) => setTimeout(done, 600))");
    assert!(tab.number("driftless.time") > 0.2);
    assert!(tab.number("Math.abs(driftless.run.rows.at(-1)[1])") < 1e-9, "energy drift");
    // A bar that is dragged straight down has another start, which stands in the editor.
    tab.eval("driftless.load(driftless.told.scenes[1])");
    let place = |tab: &mut Tab<'_>, share: f64| {
        let of = |tab: &mut Tab<'_>, axis: u8, edge: &str| {
            tab.number(&format!("(() => {{ const {{ stage, run, time }} = driftless; const ends = barEnds(0, run.geometry.bodies[0].ends, run.pose(time)).map((end) => stage.at(end)[{axis}]); return ends[0] + {share} * (ends[1] - ends[0]) + stage.canvas.getBoundingClientRect().{edge}; }})()"))
        };
        [of(tab, 0, "left"), of(tab, 1, "top")]
    };
    let [hinge, grip] = [place(&mut tab, 0.0), place(&mut tab, 0.8)];
    tab.drag(grip, [hinge[0], hinge[1] + 80.0]);
    let phi = tab.number("JSON.parse(document.getElementById('scene').value).start.bar1.phi");
    assert!(phi.abs() < 0.02, "{phi}");
    assert!((tab.number("driftless.core.numbers()[3]") - phi).abs() < 1e-12);
    // The caret's key is explained; a scene that is none says why and where.
    tab.eval("{ const editor = document.getElementById('scene'); editor.selectionStart = editor.selectionEnd = editor.value.indexOf('\"density\"') + 3; driftless.help(); }");
    let help = tab.eval("document.getElementById('help').textContent");
    assert!(help.as_str().expect("words").contains("bars.density"), "{help}");
    tab.eval("driftless.load('{\"name\": \"x\", \"bars\": [{\"nmae\": 1}]}')");
    let message = tab.eval("document.getElementById('message').textContent");
    assert!(message.as_str().expect("words").contains("nmae"), "{message}");
    assert!(tab.complaints().is_empty());
}

/// Seconds the library takes for so many rows, as the playground asks for them.
fn native(name: &str, rows: u32) -> f64 {
    let scene = read_scene(scene(name).as_ref(), &[]).expect("a scene");
    let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
    let request = Request { until: Some(3600.0), every: Some(1.0 / 64.0), ..Request::default() };
    let plan = Plan::new(&scene, &mechanism, &request).expect("a plan");
    let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &mechanism.start(&scene));
    let mut running = Running::new(run.expect("a run"));
    let seen = Cell::new(0);
    let begin = Instant::now();
    let mut observer = |_: &Sample| {
        seen.set(seen.get() + 1);
        Ok(())
    };
    assert!(!running.go(&mut observer, &mut || seen.get() >= rows).expect("a motion"));
    begin.elapsed().as_secs_f64()
}

#[test]
#[ignore = "prints figures"]
fn figures() {
    const ROWS: u32 = 64 * 60;
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/playground/index.html");
    assert!(file.is_file(), "`.ci/playground fetch` builds it");
    let mut browser = Browser::start().expect("a browser");
    let mut tab = browser.tab(DESK);
    tab.open(&file, "");
    tab.eval("driftless.play(false)");
    for name in ["free", "motor", "spring", "four_bars", "chain8", "wall"] {
        let text = std::fs::read_to_string(scene(name)).expect("a scene");
        let inside = format!(
            "(() => {{ driftless.core.read({}); const begin = performance.now(); driftless.core.advance({ROWS}); return 1e-3 * (performance.now() - begin); }})()",
            serde_json::json!(text)
        );
        // In turn, so that other load hits both; the least of nine.
        let mut least = [f64::INFINITY; 2];
        for _ in 0..9 {
            least = [least[0].min(tab.number(&inside)), least[1].min(native(name, ROWS))];
        }
        let [page, program] = least;
        println!(
            "{name}: 60 s in {:.1} ms in the page, {:.1} ms in the library, {:.1} times as long",
            1e3 * page,
            1e3 * program,
            page / program
        );
    }
}
