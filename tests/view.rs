//! `driftless view` and `run --html`: which pages are written where, and what is refused.

use crate::program::Program;

fn with_run(arguments: &str) -> Program {
    let program = Program::with_scenes(&["motor", "free"]);
    let until = if arguments.contains("--until") { "" } else { "--until 1" };
    program.run(&format!("run motor.json {until} --no-charts -q {arguments}")).exits(0);
    program
}

#[test]
fn a_page_stands_beside_its_run() {
    let program = with_run("--html --method dp5 --stabilize projection,none");
    let files = program.files();
    for file in [
        "output/motor/dp5-1e-9-none/run.html",
        "output/motor/dp5-1e-9-projection/run.html",
        "output/motor/runs.html",
    ] {
        assert!(files.contains(&file.to_owned()), "{files:?}");
    }
    let page = program.read("output/motor/dp5-1e-9-none/run.html");
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
}

#[test]
fn the_page_of_a_run_is_that_of_its_folder() {
    for more in ["", "--until 2000 --every 0.02 --trust off --window 7..8"] {
        let program = with_run(&format!("--html --method dp8 --rtol 1e-8 {more}"));
        let folder = "output/motor/dp8-1e-8-elimination";
        let live = program.read(&format!("{folder}/run.html"));
        let window = if more.is_empty() { "" } else { "--from 7 --to 8" };
        program.run(&format!("view {folder} -q {window}")).exits(0);
        let read = program.read(&format!("{folder}/run.html"));
        assert!(live == read, "the rows seen and the rows read make different pages: {more}");
    }
}

#[test]
fn folders_that_hold_runs_are_shown_with_all_of_them() {
    let program = with_run("--method dp5");
    program.run("run motor.json --until 1 --no-charts -q --method dp8").exits(0);
    let told = program.run("view output/motor --json").exits(0).object();
    assert_eq!(told["runs"].as_array().map(Vec::len), Some(2));
    assert!(program.files().contains(&"output/motor/runs.html".to_owned()));
    program.run("run free.json --until 1 --no-charts -q --method dp5").exits(0);
    let two = "output/motor/dp5-1e-9-elimination output/free/dp5-1e-9";
    program.run(&format!("view {two}")).exits(2).says(&["several folders", "--out"]);
    program.run(&format!("view {two} --out pages -q")).exits(0);
    assert!(program.files().contains(&"pages/runs.html".to_owned()));
}

#[cfg(feature = "digits")]
#[test]
fn runs_in_many_digits_have_no_page() {
    let program = with_run("--method dp5");
    program.run("run motor.json --until 0.1 --every 0.1 --digits 30 -q").exits(0);
    let long = "output/motor/taylor-digits-30";
    let told = program.run("view output/motor").exits(0).says(&["note: ", long, "left out"]);
    told.shows(&["output/motor/dp5-1e-9-elimination"]);
    program.run("view output/motor -q").exits(0).stays_silent();
    program.run(&format!("view {long}")).exits(6).says(&[long, "many digits", "no page"]);
}

#[test]
fn runs_are_found_from_above_the_folder_of_their_scene() {
    let program = with_run("--method dp5");
    // One scene is found from above its folder, two have to be told apart.
    program.run("view output").exits(0).shows(&["output/motor"]);
    program.run("run free.json --until 1 --no-charts -q").exits(0);
    let told = program.run("view output").exits(6);
    told.says(&["output holds the runs of 2 scenes", "output/free, output/motor"]);
}

#[test]
fn what_is_no_run_is_refused() {
    let program = with_run("--method dp5");
    let folder = "output/motor/dp5-1e-9-elimination";
    program.run("view examples").exits(6).says(&["examples holds no run", "hint: `driftless run SCENE`"]);
    program.run(&format!("view {folder} --from 2 --to 1")).exits(2).says(&["--from 2 --to 1", "hint"]);
    program.run(&format!("view {folder} --from nan")).exits(2);
    program.run("view").exits(2);
    let table = program.read(&format!("{folder}/trajectory.csv"));
    for (from, to, words) in [
        ("bar1.phi", "bar9.phi", "column 2: `bar9.phi [rad]` stands where `bar1.phi [rad]` belongs"),
        ("\n0.0,", "\nnought,", "trajectory.csv:2: t [s]: `nought` is no number"),
        ("\n0.0,", "\n0.0,1,", "trajectory.csv:2: 22 fields, 21 columns"),
    ] {
        program.write(&format!("{folder}/trajectory.csv"), &table.replacen(from, to, 1));
        program.run(&format!("view {folder}")).exits(6).says(&[words]);
    }
    program.write(&format!("{folder}/trajectory.csv"), &table);
    let record = program.read(&format!("{folder}/run.json"));
    for (from, to, words) in [
        ("{", "", "run.json: "),
        ("resolved_scene", "scene", "no entry `resolved_scene`"),
        ("\"bar2\"", "\"bar1\"", "run.json"),
    ] {
        program.write(&format!("{folder}/run.json"), &record.replace(from, to));
        program.run(&format!("view {folder}")).exits(6).says(&[words]);
    }
    assert!(!program.files().iter().any(|file| file.ends_with(".html")), "no page of a refused run");
}

#[test]
fn a_run_that_went_on_has_the_page_of_one_that_was_not_interrupted() {
    let program = Program::with_scenes(&["motor"]);
    let run = "run motor.json --until 60 --every 0.003 --method gauss4 --step 1e-4 --no-charts -q --html --trust off --checkpoint-every 0.05";
    let mut child = program.command(run).spawn().expect("the program");
    let is_checkpoint = |file: &String| file.ends_with("/checkpoint.previous");
    let folder = loop {
        if let Some(file) = program.files().into_iter().find(is_checkpoint) {
            break file.rsplit_once('/').expect("a folder").0.to_owned();
        }
        assert!(child.try_wait().expect("a child").is_none(), "it ended before its second checkpoint");
        std::thread::sleep(std::time::Duration::from_millis(20));
    };
    child.kill().and_then(|()| child.wait()).expect("killed");
    program.run(&format!("resume {folder} -q")).exits(0);
    let resumed = program.read(&format!("{folder}/run.html"));
    program.run(&format!("view {folder} -q")).exits(0);
    assert!(resumed == program.read(&format!("{folder}/run.html")));
}

#[test]
fn a_run_and_its_reference_share_a_page() {
    let program = with_run("--method dp5 --rtol 1e-6");
    let folder = "output/motor/dp5-1e-6-elimination";
    program.run(&format!("view {folder} --reference -q")).exits(0);
    assert!(program.files().contains(&format!("{folder}/runs.html")));
    let again = program.read(&format!("{folder}/runs.html"));
    program.run(&format!("view {folder} --reference -q")).exits(0);
    assert!(again == program.read(&format!("{folder}/runs.html")), "the same bytes every time");
}

#[test]
fn sweeps_and_comparisons_have_pages() {
    let program = Program::with_scenes(&["free"]);
    let folder = "output/free/sweep-start.bar1.phi-taylor-1e-9";
    let sweep = "sweep free.json --until 1 --vary bar1.phi=0..2:5 -q --html";
    program.run(&format!("{sweep} --no-charts")).exits(0);
    let files = program.files();
    assert!(files.contains(&format!("{folder}/sweep.html")), "{files:?}");
    assert!(!files.iter().any(|file| file.ends_with(".png")), "{files:?}");
    let page = program.read(&format!("{folder}/sweep.html"));
    assert!(page.contains("\"cells\":[0,1,2,3,4]"), "all motions are kept where points are few");
    program.run("compare free.json --until 0.5 --budget 1 --methods dp5 --no-charts -q --html").exits(0);
    assert!(program.files().contains(&"output/free/compare/compare.html".to_owned()));
}

#[test]
fn sweeps_that_no_page_can_show_are_refused() {
    let program = Program::with_scenes(&["free"]);
    let three = "--vary bar1.phi=0..1:2 --vary bar2.phi=0..1:2 --vary bar1.omega=0..1:2";
    program
        .run(&format!("sweep free.json --until 1 {three} --html"))
        .exits(2)
        .says(&["--html: 3 values are varied"]);
    program
        .run("sweep free.json --until 1 --vary bar1.phi=0..1:4 --shard 1/2 --html")
        .exits(2)
        .says(&["--shard"]);
    let many = "--vary bar1.phi=0..1:2048 --vary bar2.phi=0..1:2048";
    program
        .run(&format!("sweep free.json --until 1 {many} --html"))
        .exits(2)
        .says(&["--html: 4194304 points are more than a page can hold (1048576)", "hint"]);
    assert!(!program.files().iter().any(|file| file.starts_with("output/")), "{:?}", program.files());
}

/// The command line of a page names the file as it was given, with what was changed and added.
#[test]
fn the_command_on_a_page_makes_its_run_again() {
    let program = Program::with_scenes(&["free"]);
    let [scene, set] = ["my free.json", "bar1.length=500 mm"];
    program.write(scene, &program.read("free.json"));
    let given = ["--set", set, "--set", "bar1.density=2e3/3", "--output", "reach=bar2.x"];
    let mut command = program.command("run");
    command.arg(scene).args(["--until", "0.5", "--html", "--no-charts", "-q"]).args(given);
    assert!(command.status().expect("the program").success());
    let folder = "output/free/taylor-1e-9";
    let (page, table) =
        (program.read(&format!("{folder}/run.html")), program.read(&format!("{folder}/trajectory.csv")));
    let told = page.split(r#""command":"driftless "#).nth(1).and_then(|rest| rest.split('"').next());
    let told = told.expect("a command").to_owned();
    let named = "run 'my free.json' --set 'bar1.length=500 mm' --set bar1.density=2e3/3 --output reach=bar2.x --method";
    assert!(told.starts_with(named), "{told}");
    let words = shell_words(&told);
    let again = program.command("").args(&words).args(["--out", "again", "-q"]).status();
    assert!(again.expect("the program").success(), "{words:?}");
    assert_eq!(program.read("again/free/taylor-1e-9/trajectory.csv"), table);
    let sweep = "sweep free.json --set gravity[0]=1.62 --vary bar1.phi=0..1:3 --until 0.5 --html -q";
    program.run(sweep).exits(0);
    let pages: Vec<String> =
        program.files().into_iter().filter(|file| file.ends_with("sweep.html")).collect();
    assert!(program.read(&pages[0]).contains("driftless run free.json --set 'gravity[0]=1.62' --html"));
}

/// Words of a command line as a shell takes them, where quotes are single ones.
fn shell_words(line: &str) -> Vec<String> {
    let parts = line.split('\'').enumerate();
    let marked: String =
        parts.map(|(k, part)| if k % 2 == 1 { part.replace(' ', "\0") } else { part.into() }).collect();
    marked.split_whitespace().map(|word| word.replace('\0', " ")).collect()
}

/// Rows that are too far apart for curves are drawn alone, and a motor that holds still has its torque drawn.
#[test]
fn charts_show_rows_alone_where_they_are_far_apart_and_motors_that_hold() {
    let program = Program::with_scenes(&["free"]);
    program.run("run free.json --until 40 --every 4 --trust off --chart-format svg -q").exits(0);
    let folder = program.files().into_iter().find(|file| file.ends_with("angles.svg")).expect("a chart");
    assert!(program.read(&folder).contains("rows alone"));
    let text = program.read("free.json").replacen(
        r#""start""#,
        r#""motors": [{"name": "M", "body": "bar1", "law": {"start": "pi/2", "rate": 0}}], "start""#,
        1,
    );
    program.write("held.json", &text);
    program.run("run held.json --until 0.5 -q").exits(0);
    assert!(program.files().iter().any(|file| file.ends_with("torque_power.png")));
}

/// A pendulum that hangs has nothing to be too far apart, and one whose rows are many periods apart has dots
/// of its outputs, of which the caption says so.
#[test]
fn captions_tell_what_rests_from_what_is_too_far_apart() {
    let program = Program::new();
    let pendulum = |phi: f64, until: f64, every: f64| {
        format!(
            r#"{{"name": "bar", "gravity": [0, -9.81], "start": {{"bar": {{"phi": {phi}, "omega": 0}}}},
            "bars": [{{"name": "bar", "length": 0.6, "width": 0.05, "thickness": 0.003, "density": 670}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}},
            {{"body": "bar", "point": [0, 0]}}]}}], "until": {until}, "every": {every},
            "outputs": {{"x": "bar.x"}}}}"#
        )
    };
    let chart = |text: &str, name: &str, folder: &str| -> String {
        program.write("bar.json", text);
        program.run(&format!("run bar.json --trust off --chart-format svg -q --out {folder}")).exits(0);
        let ending = format!("{name}.svg");
        let is_it = |file: &String| file.starts_with(folder) && file.ends_with(&ending);
        program.files().into_iter().find(is_it).map(|file| program.read(&file)).expect("a chart")
    };
    let rest = chart(&pendulum(-std::f64::consts::FRAC_PI_2, 10.0, 0.01), "mechanism", "a");
    assert!(!rest.contains("too far apart") && rest.contains("The mechanism at"));
    let far = chart(&pendulum(0.3, 300.0, 10.0), "outputs", "b");
    assert!(far.contains("may be an alias"));
    let near = chart(&pendulum(0.3, 3.0, 0.01), "outputs", "c");
    assert!(!near.contains("may be an alias"));
}

#[test]
fn a_torque_has_the_same_peak_in_both_of_its_charts() {
    let program = Program::with_scenes(&["motor"]);
    program
        .run(
            "run motor.json --until 2 --every 0.02 --output M=motor.torque --trust off --chart-format svg -q",
        )
        .exits(0);
    let peak = |name: &str| -> String {
        let file = program.files().into_iter().find(|file| file.ends_with(name)).expect("a chart");
        let text = program.read(&file);
        let labels = text.split("aria-label=\"").skip(1).filter_map(|rest| rest.split('"').next());
        let mut peaks = labels.filter(|label| label.contains("N·m at"));
        peaks.next().expect("a mark").split(" s").next().unwrap_or_default().to_owned()
    };
    assert_eq!(peak("torque_power.svg"), peak("outputs.svg"));
}

/// Frames of an animation, and how long each stays \[1/100 s\].
fn frames(path: &std::path::Path) -> Vec<u16> {
    let file = std::fs::File::open(path).expect("an animation");
    let mut decoder = gif::DecodeOptions::new().read_info(file).expect("a GIF");
    std::iter::from_fn(|| decoder.read_next_frame().expect("a frame").map(|frame| frame.delay)).collect()
}

#[test]
fn animations_have_rows_alone_where_they_are_far_apart_and_frames_enough_of_fast_motions() {
    let program = Program::with_scenes(&["free", "andrews"]);
    let of = |arguments: &str, folder: &str| {
        program.run(&format!("run {arguments} --trust off --gif -q --out {folder}")).exits(0);
        let file = program
            .files()
            .into_iter()
            .find(|file| file.starts_with(folder) && file.ends_with("mechanism.gif"));
        frames(&program.path(&file.expect("an animation")))
    };
    assert_eq!(of("free.json --until 10 --every 1", "a"), [100; 11]);
    assert_eq!(of("free.json --until 12 --every 1 --window 0..10", "b"), [100; 11]);
    let fast = of("andrews.json", "c");
    assert!(fast.len() > 50 && fast.iter().all(|&delay| delay == 4), "{} frames", fast.len());
}

#[test]
fn runs_of_a_single_row_have_no_charts_against_time() {
    let program = Program::with_scenes(&["free"]);
    program.run("run free.json --method dp8 --max-evaluations 2 --trust off -q");
    let files = program.files();
    assert!(files.iter().any(|file| file.ends_with("mechanism.png")), "{files:?}");
    assert!(!files.iter().any(|file| file.ends_with("energy_drift.png")), "{files:?}");
}

#[test]
fn pages_of_sweeps_without_numbers_have_no_colours_and_profiles_have_their_axis() {
    let program = Program::with_scenes(&["free"]);
    let page = |vary: &str, out: &str| {
        let sweep = "sweep free.json --html --no-charts -q --until";
        program.run(&format!("{sweep} {vary} --out {out}")).exits(0);
        let file = program.files().into_iter().find(|file| file.starts_with(out) && file.ends_with("html"));
        program.read(&file.expect("a page"))
    };
    let still = page("0.01 --vary bar1.phi=0..0.1:2 --vary bar2.phi=0..0.1:2", "a");
    assert!(still.contains(r#""colours":null"#));
    let narrow = page("2 --vary bar1.phi=3.0..3.1:3", "b");
    assert!(narrow.contains(r#""log":false"#) && !narrow.contains(r#""log":true,"high_is_dark""#));
}

/// The horizon of `motor` lies between the first and the last rows that are kept one by one.
#[test]
fn the_path_shown_of_a_run_is_one_that_can_be_trusted_and_drawn() {
    let program = Program::with_scenes(&["motor"]);
    program.run("run motor.json -q --chart-format svg").exits(0);
    let file = program.files().into_iter().find(|file| file.ends_with("mechanism.svg")).expect("a chart");
    let chart = program.read(&file);
    assert!(chart.contains("Path of the end of bar2") && chart.contains("s of 500 s, trusted"), "{chart}");
}
