//! Pages of sweeps and comparisons.

use crate::chromium::{Browser, Tab};
use crate::{DESK, pages, scene};

#[test]
fn points_of_a_comparison_tell_their_settings() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scene("free");
    let arguments = [
        "compare",
        &scene,
        "--html",
        "--no-charts",
        "-q",
        "--budget",
        "2",
        "--until",
        "1",
        "--methods",
        "dp5,taylor",
    ];
    let page = pages(&arguments, folder.path()).remove(0);
    let record = std::fs::read_to_string(page.with_file_name("compare.json")).expect("a record");
    let record: serde_json::Value = serde_json::from_str(&record).expect("JSON");
    let mut tab = browser.tab(DESK);
    tab.open(&page, "");
    let rows = record["rows"].as_array().expect("rows").len();
    assert_eq!(tab.number("document.querySelectorAll('#table tbody tr').length") as usize, rows);
    // Hovering tells the setting, a click marks its row.
    let point = "driftless.charts[0].points.find((point) => point.series === 'dp5')";
    let at = |tab: &mut Tab<'_>| {
        let of = |tab: &mut Tab<'_>, axis: &str, edge: &str| {
            tab.number(&format!("(() => {{ const {{ plot }} = driftless.charts[0]; return plot.valToPos({point}.{axis}, '{axis}') + plot.over.getBoundingClientRect().{edge}; }})()"))
        };
        [of(tab, "x", "left"), of(tab, "y", "top")]
    };
    let place = at(&mut tab);
    tab.mouse(place, false);
    let told = tab.eval("driftless.charts[0].tip.hidden ? '' : driftless.charts[0].tip.textContent");
    let told = told.as_str().expect("words").to_owned();
    let command = format!("driftless run {scene} --method dp5 --rtol");
    assert!(told.contains("dp5") && told.contains(&command), "{told}: {command}");
    tab.mouse(place, true);
    let row = tab.eval("document.querySelector('#table tr.chosen td').textContent");
    let label = row.as_str().expect("a row").trim_start_matches("* ").to_owned();
    assert!(told.starts_with(&label), "{told}: {label}");
    assert!(tab.eval("location.hash").as_str().expect("a hash").starts_with("#row="));
    assert!(tab.complaints().is_empty());
}

#[test]
fn cells_of_a_map_move() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scene("free");
    let arguments = [
        "sweep",
        &scene,
        "--html",
        "--no-charts",
        "-q",
        "--until",
        "4",
        "--vary",
        "bar1.phi=-3..3:13",
        "--vary",
        "bar2.phi=-3..3:11",
    ];
    let page = pages(&arguments, folder.path()).remove(0);
    let size = std::fs::metadata(&page).expect("a page").len();
    assert!(size < 1_000_000, "{size} bytes");
    let table = std::fs::read_to_string(page.with_file_name("sweep.csv")).expect("a table");
    let mut lines = table.lines();
    let flips = lines
        .next()
        .and_then(|head| head.split(',').position(|name| name == "flip_time [s]"))
        .expect("a column");
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let mut tab = browser.tab(DESK);
    tab.open(&page, "");
    for (number, row) in rows.iter().enumerate() {
        let shown = tab.eval(&format!("(() => {{ const value = driftless.values[{number}]; return Number.isNaN(value) ? null : 10 ** value; }})()"));
        match (shown.as_f64(), row[flips].parse::<f64>()) {
            // The map holds decimal logarithms.
            (Some(shown), Ok(value)) => {
                assert!((shown / value - 1.0).abs() < 1e-3, "point {number}: {shown}, {value}")
            }
            (None, Err(_)) => {}
            other => panic!("point {number}: {other:?}"),
        }
    }
    // A corner is kept; a click there starts what the table names, and plays it.
    let place = |tab: &mut Tab<'_>, i: f64, j: f64| {
        let of = |tab: &mut Tab<'_>, code: &str| {
            tab.number(&format!("(() => {{ const [left, top, width, height] = driftless.chart.field(); const box = driftless.chart.canvas.getBoundingClientRect(); return {code}; }})()"))
        };
        [
            of(tab, &format!("box.left + left + width * ({i} + 0.5) / 13")),
            of(tab, &format!("box.top + top + height * (1 - ({j} + 0.5) / 11)")),
        ]
    };
    let corner = place(&mut tab, 12.0, 10.0);
    tab.mouse(corner, false);
    let told = tab.eval("driftless.chart.tip.textContent");
    assert!(told.as_str().expect("words").contains("bar1.phi = 3 rad"), "{told}");
    tab.mouse(corner, true);
    assert_eq!(tab.eval("driftless.page.isPlaying"), true);
    assert_eq!(
        tab.eval(
            "driftless.page.main.poses.map(([phi]) => driftless.page.main.values[phi][0].toFixed(3)).join()"
        ),
        "3.000,3.000"
    );
    tab.eval("new Promise((done) => setTimeout(done, 300))");
    assert!(tab.number("driftless.page.time") > 0.05);
    tab.eval("driftless.page.play(false)");
    // Beside one that is not kept the nearest moves, and the page says so.
    tab.eval("driftless.choose(11 * 11 + 9, false)");
    let told = tab.eval("driftless.line.textContent");
    assert!(told.as_str().expect("words").contains("nearest point whose motion is kept"), "{told}");
    assert!(tab.complaints().is_empty());
}

#[test]
fn points_that_turn_over_at_once_are_not_said_to_stay() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scene("free");
    let vary = ["--vary", "bar1.phi=-pi..pi:5", "--vary", "bar2.phi=-pi..pi:5"];
    let arguments = [&["sweep", &scene, "--html", "--no-charts", "-q", "--until", "4"], &vary[..]].concat();
    let page = pages(&arguments, folder.path()).remove(0);
    let table = std::fs::read_to_string(page.with_file_name("sweep.csv")).expect("a table");
    let flips =
        table.lines().next().and_then(|head| head.split(',').position(|name| name == "flip_time [s]"));
    let flips = flips.expect("a column");
    let at_once: Vec<usize> = (table.lines().skip(1).enumerate())
        .filter(|(_, line)| line.split(',').nth(flips) == Some("0.0"))
        .map(|(number, _)| number)
        .collect();
    assert!(!at_once.is_empty(), "{table}");
    let mut tab = browser.tab(DESK);
    tab.open(&page, "");
    for number in at_once {
        let told = tab.eval(&format!("driftless.described({number})"));
        assert!(told.as_str().expect("words").ends_with(": flip time 0 s"), "{told}");
        let colours = tab.eval(&format!(
            "[driftless.colour({number}), driftless.shade(0)].map((c) => c.join()).join(' ')"
        ));
        let colours = colours.as_str().expect("words").split_once(' ').expect("two");
        assert_eq!(colours.0, colours.1, "point {number}");
    }
    // The ticks of the axes are those of the picture, and the colours have their unit.
    let ticks = tab.eval("driftless.told.axes[1].ticks.map(([, text]) => text).join()");
    assert!(ticks.as_str().expect("words").contains("−π/2,0,π/2"), "{ticks}");
    assert_eq!(tab.eval("driftless.told.colours.name"), "flip time [s]");
    let first = tab.eval("driftless.told.colours.ticks[0][1]");
    assert!(first.as_str().expect("words").starts_with("≤ "), "{first}");
    assert!(tab.complaints().is_empty());
}

/// Labels tell every tick from the next, whatever the range.
#[test]
fn ticks_have_labels_of_their_own() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scene("free");
    let arguments =
        ["sweep", &scene, "--html", "--no-charts", "-q", "--until", "0.01", "--vary", "bar1.phi=0..0.1:3"];
    let page = pages(&arguments, folder.path()).remove(0);
    let mut tab = browser.tab(DESK);
    tab.open(&page, "");
    let words = |tab: &mut Tab<'_>, script: &str| tab.eval(script).as_str().expect("words").to_owned();
    let ticks = |tab: &mut Tab<'_>, low: &str, high: &str| {
        words(tab, &format!("tickWords(roundPlaces({low}, {high}, 5)).join()"))
    };
    assert_eq!(ticks(&mut tab, "0", "1e-6"), "0,2e-7,4e-7,6e-7,8e-7,1e-6");
    assert_eq!(ticks(&mut tab, "0", "1e-30"), "0,2e-31,4e-31,6e-31,8e-31,1e-30");
    assert_eq!(ticks(&mut tab, "-0.3", "0.4"), "-0.2,0,0.2,0.4");
    assert_eq!(ticks(&mut tab, "2 - 1e-12", "2 + 1e-12"), "2,+5e-13,+1e-12,+1.5e-12,+2e-12");
    assert_eq!(ticks(&mut tab, "1e6", "1e6 + 0.5"), "1000000,+0.1,+0.2,+0.3,+0.4,+0.5");
    assert_eq!(words(&mut tab, "powerWords(decadeTicks(-0.44, -0.36)).join()"), "0.38,0.4,0.42");
    // Where no bar turns over there is nothing to read off.
    assert_eq!(words(&mut tab, "String(driftless.chart.names.isBlank)"), "true");
    assert!(tab.complaints().is_empty());
}
