#![cfg(feature = "charts")]
//! Charts: files open, ink is where the data are, words can be read, odd data are survived.

use driftless::chart::*;
use std::f64::consts::{FRAC_PI_2, PI};

const BLUE: [u8; 3] = [0x00, 0x72, 0xB2];

fn times(count: usize, step: f64) -> Vec<f64> {
    (0..count).map(|k| k as f64 * step).collect()
}

fn words(text: &[&str]) -> Vec<String> {
    text.iter().map(|&word| word.to_owned()).collect()
}

fn torque(time: Vec<f64>, torque: Vec<f64>) -> TorquePower {
    let power = torque.iter().map(|v| 6.0 * v).collect();
    let motors = vec![MotorSeries { name: "motor".to_owned(), time, torque, power }];
    TorquePower {
        title: "Motor torque and power".to_owned(),
        caption: words(&["scene motor", "dop853"]),
        motors,
        ..TorquePower::default()
    }
}

fn drift(method: &str, time: Vec<f64>, error: Vec<f64>) -> DriftSeries {
    DriftSeries { method: method.to_owned(), name: format!("{method}, 10^{{−10}}"), time, error }
}

fn growing(method: &str, size: f64, power: f64) -> DriftSeries {
    let time = times(400, 25.0);
    let error = time.iter().map(|t| size * t.powf(power) * (0.7 + 0.3 * t.sin())).collect();
    drift(method, time, error)
}

/// Two bars that hang from A along gravity, a spring, a motor and a wall.
fn pose(phi: [f64; 2], rate: f64) -> Pose {
    let b = [0.6 * phi[0].cos(), 0.6 * phi[0].sin()];
    let c = [b[0] + 0.6 * phi[1].cos(), b[1] + 0.6 * phi[1].sin()];
    Pose {
        bars: vec![[[0.0, 0.0], b], [b, c]],
        hinges: vec![[0.0, 0.0], b],
        springs: vec![[[-0.3, 0.0], [b[0] / 1.5, b[1] / 1.5]]],
        motors: vec![MotorPose { at: [0.0, 0.0], angle: phi[0], rate }],
        points: vec![c],
        ..Pose::default()
    }
}

fn sketch() -> Sketch {
    Sketch {
        gravity: [9.81, 0.0],
        hinges: vec![
            HingeSketch { name: "A".to_owned(), ground: true },
            HingeSketch { name: "B".to_owned(), ground: false },
        ],
        springs: vec![SpringSketch { ground: [true, false] }],
        walls: vec![WallSketch { through: [1.3, 0.0], normal: [-1.0, 0.0] }],
        points: words(&["C"]),
    }
}

fn pendulum() -> MechanismChart {
    let trail = times(300, 0.01)
        .iter()
        .map(|t| pose([1.2 * t.cos(), 1.5 * (1.7 * t).sin()], 1.0).points[0])
        .collect();
    MechanismChart {
        title: "Path of the free end C".to_owned(),
        caption: words(&["scene both", "last 3 s"]),
        sketch: sketch(),
        poses: vec![pose([0.4, 0.2], 1.0), pose([0.7, -0.3], 1.0)],
        trails: vec![trail],
        names: words(&["C"]),
        horizon: None,
    }
}

/// All methods at many settings, as a comparison has them.
fn batch() -> WorkPrecision {
    let line = |(k, method): (usize, &&str)| {
        let order = 3.0 + (k % 7) as f64;
        let points = (0..9)
            .map(|n| {
                [
                    1e-4 * (1.0 + k as f64) * 1.7_f64.powi(n),
                    (1e-2 * 1.7_f64.powf(-order * f64::from(n))).max(1e-14),
                ]
            })
            .collect();
        WorkSeries { method: (*method).to_owned(), name: (*method).to_owned(), points }
    };
    let methods = [
        "dopri5",
        "dop853",
        "dp5",
        "dp8",
        "taylor",
        "taylor extended",
        "gauss4",
        "gauss6",
        "gauss8",
        "gauss10",
        "gauss12",
        "gauss14",
        "gauss16",
        "rattle2",
        "rattle4",
        "rattle6",
        "rattle8",
        "radau5",
        "radau9",
    ];
    WorkPrecision {
        title: "Error against evaluations".to_owned(),
        caption: words(&["scene free", "all methods"]),
        cost: Cost::Count("evaluations".to_owned()),
        error_name: "largest error of angles [rad]".to_owned(),
        series: methods.iter().enumerate().map(line).collect(),
        lost: Some(1e-3),
        floor: None,
    }
}

/// A few methods against run time, with a floor.
fn work() -> WorkPrecision {
    WorkPrecision {
        title: "Error against run time".to_owned(),
        caption: words(&["scene free"]),
        cost: Cost::Time("run time per simulated second".to_owned()),
        error_name: "largest error [rad, rad/s]".to_owned(),
        series: ["dopri5", "dop853", "gauss16", "taylor"]
            .iter()
            .enumerate()
            .map(|(k, name)| WorkSeries {
                method: (*name).to_owned(),
                name: (*name).to_owned(),
                points: (0..7)
                    .map(|i| {
                        [
                            1e-5 * (1.0 + 0.3 * k as f64) * 1.6_f64.powi(i),
                            0.1_f64.powi(i * (k as i32 + 1)).max(1e-12),
                        ]
                    })
                    .collect(),
            })
            .collect(),
        lost: None,
        floor: Some((1e-11, "rounding of the constants".to_owned())),
    }
}

/// One picture of each chart with data as they come from runs.
fn gallery() -> Vec<(&'static str, Picture)> {
    let resolution = 1.0;
    let time = times(1500, 0.01);
    let wave = |k: usize| {
        time.iter().map(|t| (1.0 + 0.2 * k as f64) * (1.3 * t + k as f64).sin()).collect::<Vec<f64>>()
    };
    let angle = |count: usize| Angles {
        title: "Angles of the bars".to_owned(),
        caption: words(&["scene chain"]),
        time: time.clone(),
        is_coarse: false,
        series: (0..count).map(|k| AngleSeries { name: format!("bar {k}"), angle: wave(k) }).collect(),
        travels: Vec::new(),
        positions: Vec::new(),
        horizon: None,
    };
    let energy = |log_time: bool| EnergyDrift {
        title: "Energy drift".to_owned(),
        caption: words(&["scene free, released from π/2", "largest |Δ*E*| so far over 2*mgl*"]),
        quantity: "energy minus work".to_owned(),
        series: vec![
            growing("dopri5", 1e-11, 1.0),
            growing("dop853", 1e-14, 1.0),
            growing("rattle4", 1e-10, 0.0),
            growing("taylor", 1e-17, 0.5),
            growing("gauss16", 2e-17, 0.4),
            growing("radau5", 3e-12, 1.0),
        ],
        log_time,
    };
    let level = |name: &str, size: f64| ResidualPanel {
        name: name.to_owned(),
        series: vec![
            growing("none", 1e3 * size, 1.0),
            growing("baumgarte", size, 0.0),
            growing("projection", 1e-6 * size, 0.0),
            growing("elimination", 0.0, 0.0),
        ],
    };
    let constraint = ConstraintDrift {
        title: "Constraint drift under three stabilizations".to_owned(),
        caption: words(&["scene motor, start 10^{−6} rad/s off"]),
        panels: vec![level("|*C*| [rad]", 1e-9), level("|d*C*/d*t*| [rad/s]", 1e-8)],
        log_time: true,
    };
    let mut two = torque(time.clone(), wave(0));
    two.motors.push(MotorSeries {
        name: "elbow".to_owned(),
        time: time.clone(),
        torque: wave(3),
        power: wave(2),
    });
    vec![
        ("mechanism", mechanism(&pendulum(), resolution).unwrap()),
        ("angles apart", angles(&angle(2), resolution).unwrap()),
        ("angles together", angles(&angle(8), resolution).unwrap()),
        ("energy", energy_drift(&energy(true), resolution).unwrap()),
        ("energy, linear time", energy_drift(&energy(false), resolution).unwrap()),
        ("constraint", constraint_drift(&constraint, resolution).unwrap()),
        ("torque", torque_power(&torque(time.clone(), wave(1)), resolution).unwrap()),
        ("two motors", torque_power(&two, resolution).unwrap()),
        ("work", work_precision(&work(), resolution).unwrap()),
        ("batch", work_precision(&batch(), resolution).unwrap()),
    ]
}

fn luminance(colour: [u8; 3]) -> f64 {
    let linear = |part: u8| {
        let part = f64::from(part) / 255.0;
        if part <= 0.04045 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
    };
    0.2126 * linear(colour[0]) + 0.7152 * linear(colour[1]) + 0.0722 * linear(colour[2])
}

#[test]
fn words_stay_on_the_page_apart_and_readable() {
    for (name, picture) in gallery() {
        assert!(picture.texts.len() > 8, "{name} has words");
        let (width, height) = (f64::from(picture.width), f64::from(picture.height));
        for (k, text) in picture.texts.iter().enumerate() {
            let [left, top, right, bottom] = text.bounds();
            assert!(
                left >= 0.0 && top >= 0.0 && right <= width && bottom <= height,
                "{name}: {:?} leaves the page",
                text.text
            );
            assert!(1.05 / (luminance(text.colour) + 0.05) >= 4.5, "{name}: {:?} is too pale", text.text);
            for other in &picture.texts[..k] {
                assert!(!text.overlaps(other), "{name}: {:?} lies on {:?}", text.text, other.text);
            }
        }
    }
}

#[test]
fn overlap_of_words_is_noticed() {
    let picture = torque_power(&torque(times(50, 0.1), vec![1.0; 50]), 1.0).unwrap();
    let title = &picture.texts[0];
    assert!(title.overlaps(title));
    let mut aside = title.clone();
    let [left, _, right, _] = title.bounds();
    aside.corners.iter_mut().for_each(|corner| corner[0] += right - left + 1.0);
    assert!(!title.overlaps(&aside) && !aside.overlaps(title));
}

#[test]
fn the_file_opens_and_tells_what_it_shows() {
    let mut chart = torque(times(200, 0.05), times(200, 0.05).iter().map(|t| t.sin()).collect());
    chart.title = "Torque *τ*".to_owned();
    let picture = torque_power(&chart, 2.0).unwrap();
    assert_eq!((picture.width, picture.height), (960, 600));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("torque.png");
    picture.write(&path).unwrap();
    picture.write(&path).unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside the file");

    let bytes = std::fs::read(&path).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    assert_eq!(pixels, picture.rgb);
    let info = reader.info();
    assert_eq!((info.width, info.height, info.color_type), (960, 600, png::ColorType::Rgb));
    assert_eq!(info.pixel_dims.unwrap().xppu, 5669, "144 pixels an inch");
    let chunk =
        |key: &str| info.utf8_text.iter().find(|chunk| chunk.keyword == key).unwrap().get_text().unwrap();
    assert_eq!(chunk("Title"), "Torque τ");
    assert!(chunk("Description").starts_with("scene motor · dop853"));
    assert!(chunk("Software").starts_with("driftless "));
}

#[test]
fn a_missing_folder_and_a_silly_resolution_are_refused() {
    let picture = torque_power(&TorquePower::default(), 1.0).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing").join("torque.png");
    let error = picture.write(&path).unwrap_err();
    assert!(
        matches!(error, ChartError::Folder { .. }) && error.to_string().contains("torque.png"),
        "{error}"
    );
    assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none());
    for resolution in [0.0, -1.0, f64::NAN, 1e9] {
        assert!(matches!(
            torque_power(&TorquePower::default(), resolution),
            Err(ChartError::Resolution { .. })
        ));
    }
}

/// Value against height, from the places of two tick labels.
fn height_of(picture: &Picture, panel: usize, ticks: [(&str, f64); 2]) -> impl Fn(f64) -> f64 {
    let [left, top, _, bottom] = picture.panels[panel];
    let middle = |label: &str| {
        let inside = |b: &[f64; 4]| b[2] < left && b[3] > top - 5.0 && b[1] < bottom + 5.0;
        let boxes: Vec<[f64; 4]> = picture
            .texts
            .iter()
            .filter(|text| text.text == label)
            .map(TextBox::bounds)
            .filter(inside)
            .collect();
        assert_eq!(boxes.len(), 1, "one label {label}");
        0.5 * (boxes[0][1] + boxes[0][3])
    };
    let [(low, from), (high, to)] = ticks;
    let (low, high) = (middle(low), middle(high));
    move |value| low + (value - from) / (to - from) * (high - low)
}

#[test]
fn ink_is_where_the_data_are_and_nowhere_else() {
    // A slope through a panel from 0 to 12: at t = 5 s it stands at 5 N·m.
    let time = times(101, 0.1);
    let picture = torque_power(&torque(time.clone(), time), 4.0).unwrap();
    let height = height_of(&picture, 0, [("0", 0.0), ("10", 10.0)]);
    let [left, top, right, bottom] = picture.panels[0];
    let pixel = |x: f64, y: f64| {
        let k = 3 * ((4.0 * y) as usize * picture.width as usize + (4.0 * x) as usize);
        [picture.rgb[k], picture.rgb[k + 1], picture.rgb[k + 2]]
    };
    for share in [0.1, 0.25, 0.5, 0.75, 0.9] {
        let x = left + share * (right - left);
        assert_eq!(pixel(x, height(10.0 * share)), BLUE, "the line passes at {share}");
        assert_ne!(pixel(x, height(10.0 * share) + 4.0), BLUE);
    }
    // The ring at the largest value reaches over the frame.
    let air = 4.5;
    for (k, _) in picture.rgb.as_chunks::<3>().0.iter().enumerate().filter(|(_, colour)| **colour == BLUE) {
        let (x, y) = ((k as u32 % picture.width) as f64 / 4.0, (k as u32 / picture.width) as f64 / 4.0);
        assert!(
            x > left - air && x < right + air && y > top - air && y < bottom + air,
            "ink outside the panel at {x}, {y}"
        );
    }
}

#[test]
fn zero_drift_is_seen_and_named() {
    let zero = drift("elimination", times(50, 0.1), vec![0.0; 50]);
    let panel = |name: &str| ResidualPanel {
        name: name.to_owned(),
        series: vec![growing("none", 1e-9, 1.0), zero.clone()],
    };
    let chart = ConstraintDrift {
        panels: vec![panel("|*C*| [rad]"), panel("|d*C*| [rad/s]")],
        ..ConstraintDrift::default()
    };
    let picture = constraint_drift(&chart, 2.0).unwrap();
    let said = picture.texts.iter().filter(|text| text.text.contains("exactly 0")).count();
    assert_eq!(said, 2, "once for each panel");
    let green = [0x00, 0x9E, 0x73];
    assert!(picture.rgb.as_chunks::<3>().0.contains(&green), "markers of the elimination");
    let energy = EnergyDrift { series: vec![zero], ..EnergyDrift::default() };
    assert!(energy_drift(&energy, 1.0).unwrap().texts.iter().any(|text| text.text.contains("exactly 0")));
}

/// The texts of a picture, none of which covers another or leaves the page.
fn texts_in_order(picture: &Picture) -> Vec<&str> {
    let size = [f64::from(picture.width), f64::from(picture.height)].map(|pixels| pixels / picture.px_per_pt);
    for (k, text) in picture.texts.iter().enumerate() {
        let [left, top, right, bottom] = text.bounds();
        assert!(left >= 0.0 && top >= 0.0 && right <= size[0] && bottom <= size[1], "{} is cut", text.text);
        let covered = picture.texts[..k].iter().find(|other| other.overlaps(text));
        assert!(
            covered.is_none(),
            "{} is covered by {}",
            text.text,
            covered.map_or("", |other| other.text.as_str())
        );
    }
    picture.texts.iter().map(|text| text.text.as_str()).collect()
}

#[test]
fn angles_and_lengths_have_axes_of_their_own() {
    let panel = |name: &str, series: &[&str]| ResidualPanel {
        name: name.to_owned(),
        series: series
            .iter()
            .enumerate()
            .map(|(k, name)| growing(name, 1e-12 * 10_f64.powi(k as i32), 1.0))
            .collect(),
    };
    let (angles, lengths) = (["motor", "slider.angle"], ["B.x", "B.y", "slider"]);
    let chart = ConstraintDrift {
        title: "Constraints".to_owned(),
        panels: vec![
            panel("|*C*| [rad]", &angles),
            panel("|*C′*| [rad/s]", &angles),
            panel("|*C*| [m]", &lengths),
            panel("|*C′*| [m/s]", &lengths),
        ],
        ..ConstraintDrift::default()
    };
    let picture = constraint_drift(&chart, 2.0).unwrap();
    let texts = texts_in_order(&picture);
    for word in ["|*C*| [rad]", "|*C*| [m]", "motor", "slider"] {
        assert!(texts.iter().any(|text| text.contains(word)), "{word} in {texts:?}");
    }
    assert_eq!(picture.panels.len(), 4);
    let [first, second, third, fourth] = [0, 1, 2, 3].map(|k| picture.panels[k]);
    assert!(first[3] < third[1] && second[3] < fourth[1], "rows of their own");
    assert_eq!([first[0], first[2]], [third[0], third[2]], "in line");
}

#[test]
fn a_motor_on_a_slider_is_drawn_with_a_force() {
    let time = times(50, 0.1);
    let wave = |k: usize| time.iter().map(|t| (k as f64 + 1.0) * (t + k as f64).sin()).collect::<Vec<f64>>();
    let mut chart = torque(time.clone(), wave(0));
    chart.sliders = vec![0];
    let only = torque_power(&chart, 2.0).unwrap();
    let texts = texts_in_order(&only);
    assert!(
        texts.iter().any(|text| text.contains("force [N]")) && !texts.iter().any(|text| text.contains("N·m")),
        "{texts:?}"
    );
    chart.motors.push(MotorSeries {
        name: "push".to_owned(),
        time: time.clone(),
        torque: wave(3),
        power: wave(2),
    });
    chart.sliders = vec![1];
    let both = torque_power(&chart, 2.0).unwrap();
    let texts = texts_in_order(&both);
    assert!(
        ["torque [N·m]", "force [N]", "power [W]"].iter().all(|word| texts.iter().any(|text| text == word)),
        "{texts:?}"
    );
    assert_eq!(both.panels.len(), 3);
}

#[test]
fn values_at_zero_leave_the_colours_to_the_others() {
    // A twentieth happens at once, as bars do that start upside down; the rest within 0.2 to 10 s.
    let cells: Vec<Cell> = (0..1600)
        .map(|k| Cell::Value(if k % 20 == 0 { 1e-10 } else { 0.2 * 50_f64.powf((k % 97) as f64 / 96.0) }))
        .collect();
    let axis = MapAxis { name: "*a*".to_owned(), from: 0.0, to: 1.0, count: 40, log: false };
    let chart = Map {
        x: axis.clone(),
        y: axis,
        cells,
        value: "time [s]".to_owned(),
        log: true,
        dark_high: true,
        ..Map::default()
    };
    let picture = map(&chart, 1.0).unwrap();
    let [left, top, right, bottom] = picture.panels[picture.panels.len() - 1].map(|edge| edge as usize);
    let mut colours = std::collections::BTreeSet::new();
    for y in top + 1..bottom {
        for x in left + 1..right {
            colours.insert(picture.rgb.as_chunks::<3>().0[y * picture.width as usize + x]);
        }
    }
    assert!(colours.len() > 30, "{} colours", colours.len());
    assert!(picture.texts.iter().any(|text| text.text.starts_with('≤')), "{:?}", picture.texts);
}

#[test]
fn gravity_points_down_the_page_and_motors_turn_as_they_should() {
    let middle = |picture: &Picture, name: &str| {
        let text = picture.texts.iter().find(|text| text.text == name).unwrap();
        let [left, top, right, bottom] = text.bounds();
        [0.5 * (left + right), 0.5 * (top + bottom)]
    };
    let hanging = |rate: f64| {
        let mut chart = pendulum();
        chart.poses = vec![pose([0.0, 0.0], rate)];
        chart.trails.clear();
        mechanism(&chart, 2.0).unwrap()
    };
    let picture = hanging(1.0);
    assert!(middle(&picture, "C")[1] > middle(&picture, "B")[1] + 20.0, "phi = 0 hangs straight down");
    assert!(picture.texts.iter().any(|text| text.text == "*g*"));
    // Counter-clockwise from straight down is to the right.
    let side = |picture: &Picture| {
        let purple: [u8; 3] = picture.texts.iter().find(|text| text.text == "*ω*").unwrap().colour;
        let columns =
            picture.rgb.as_chunks::<3>().0.iter().enumerate().filter(|(_, colour)| **colour == purple);
        let columns: Vec<f64> = columns.map(|(k, _)| f64::from(k as u32 % picture.width) / 2.0).collect();
        let [left, _, right, _] = picture.panels[0];
        columns.iter().sum::<f64>() / columns.len() as f64 - 0.5 * (left + right)
    };
    assert!(
        side(&picture) > 5.0 && side(&hanging(-1.0)) < -5.0,
        "{} {}",
        side(&picture),
        side(&hanging(-1.0))
    );

    // A bar along +x under gravity along -y lies to the right of its hinge.
    let mut chart = pendulum();
    chart.sketch.gravity = [0.0, -9.81];
    chart.poses = vec![pose([0.0, FRAC_PI_2], 1.0)];
    chart.trails.clear();
    let picture = mechanism(&chart, 1.0).unwrap();
    assert!(middle(&picture, "B")[0] > middle(&picture, "A")[0] + 20.0);
    assert!(middle(&picture, "C")[1] < middle(&picture, "B")[1] - 20.0, "and +y is up");
    assert!(picture.texts.iter().any(|text| text.text == "*x* [m]"));
}

#[test]
fn fast_oscillation_becomes_a_band_and_the_caption_says_so() {
    let chart = |rate: f64| {
        let time = times(4096, 2.44);
        let angle = time.iter().map(|t| (rate * t).sin()).collect();
        Angles { time, series: vec![AngleSeries { name: "*φ*".to_owned(), angle }], ..Angles::default() }
    };
    assert!(angles(&chart(1.3), 1.0).unwrap().description.contains("bands"));
    assert!(!angles(&chart(1e-3), 1.0).unwrap().description.contains("bands"));
}

#[test]
fn angles_are_told_in_pi_or_turns() {
    let chart = |last: f64| Angles {
        time: times(100, 0.1),
        series: vec![AngleSeries { name: "*φ*".to_owned(), angle: times(100, last / 99.0) }],
        ..Angles::default()
    };
    let has =
        |last: f64, word: &str| angles(&chart(last), 1.0).unwrap().texts.iter().any(|text| text.text == word);
    assert!(has(2.0 * PI, "π") && has(2.0 * PI, "*φ* [rad]"));
    assert!(has(300.0 * PI, "*φ* [turns]") && has(300.0 * PI, "100"));
    assert!(has(0.1, "0.05") || has(0.1, "0.06"), "small angles are plain numbers");
}

#[test]
fn the_animation_runs_for_ever_and_repeats_only_what_changes() {
    let poses: Vec<Pose> = times(12, 0.1).iter().map(|t| pose([t.cos(), 2.0 * t.sin()], 1.0)).collect();
    let trail = times(111, 0.01).iter().map(|t| pose([t.cos(), 2.0 * t.sin()], 1.0).points[0]).collect();
    let chart = MotionGif {
        title: "Double pendulum".to_owned(),
        sketch: sketch(),
        poses,
        time: times(12, 0.1),
        trails: vec![trail],
        delay: 4,
        horizon: None,
    };
    let animation = motion_gif(&chart).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.gif");
    animation.write(&path).unwrap();
    let mut decoder = gif::DecodeOptions::new().read_info(std::fs::File::open(&path).unwrap()).unwrap();
    assert_eq!((decoder.width(), decoder.height()), (420, 432));
    let (mut count, mut first) = (0, 0);
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let area = u32::from(frame.width) * u32::from(frame.height);
        assert_eq!(frame.delay, 4);
        if count == 0 {
            first = area;
        } else {
            assert!(area < first, "only a part is drawn again");
        }
        count += 1;
    }
    assert_eq!((count, first), (12, 420 * 432));
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
}

/// How many frames a GIF has.
fn frames(animation: &Animation) -> usize {
    let mut decoder = gif::DecodeOptions::new().read_info(&animation.bytes[..]).unwrap();
    std::iter::from_fn(|| decoder.read_next_frame().unwrap().map(drop)).count()
}

#[test]
fn the_animated_png_draws_again_only_what_changes_and_comes_back_to_it() {
    let poses: Vec<Pose> = [0.3, 1.1, 0.3].map(|t: f64| pose([t.cos(), 2.0 * t.sin()], 1.0)).into();
    let animation =
        motion_apng(&MotionGif { sketch: sketch(), poses, delay: 4, ..MotionGif::default() }).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&animation.bytes)).read_info().unwrap();
    let (wide, high) = (reader.info().width as usize, reader.info().height as usize);
    assert_eq!((wide % 2, high % 2), (0, 0), "films want even numbers");
    let control = reader.info().animation_control.unwrap();
    assert_eq!((control.num_frames, control.num_plays), (3, 0));
    let (mut page, mut pages) = (vec![0; 3 * wide * high], Vec::new());
    let mut buffer = page.clone();
    for k in 0..3 {
        reader.next_frame(&mut buffer).unwrap();
        let frame = *reader.info().frame_control().unwrap();
        assert_eq!((frame.delay_num, frame.delay_den), (4, 100));
        let [left, top, w, h] =
            [frame.x_offset, frame.y_offset, frame.width, frame.height].map(|x| x as usize);
        assert!((k == 0) == (w * h == wide * high), "only a part is drawn again");
        for row in 0..h {
            let to = 3 * ((top + row) * wide + left);
            page[to..to + 3 * w].copy_from_slice(&buffer[3 * row * w..3 * (row + 1) * w]);
        }
        pages.push(page.clone());
    }
    assert!(pages[0] == pages[2] && pages[0] != pages[1]);
}

/// The words of a picture without markup, in their order.
fn said(picture: &Picture) -> Vec<String> {
    picture.texts.iter().map(|text| unmarked(&text.text)).filter(|text| !text.trim().is_empty()).collect()
}

#[test]
fn an_svg_file_has_the_page_the_words_and_the_lines() {
    for (name, picture) in gallery() {
        let text = String::from_utf8(picture.bytes(Format::Svg).unwrap()).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let root = document.root_element();
        let page: Vec<f64> =
            root.attribute("viewBox").unwrap().split(' ').map(|x| x.parse().unwrap()).collect();
        let pixels = [page[2], page[3]].map(|side| (side * picture.px_per_pt).round() as u32);
        for (side, pixels) in [picture.width, picture.height].iter().zip(pixels) {
            assert!(side.abs_diff(pixels) <= 1, "{name}: {side} and {pixels}");
        }
        let labels = document.descendants().filter_map(|node| node.attribute("aria-label"));
        assert_eq!(labels.map(str::to_owned).collect::<Vec<_>>(), said(&picture), "{name}");
        let title = root.children().find(|node| node.has_tag_name("title")).and_then(|node| node.text());
        assert_eq!(title.unwrap_or_default(), picture.title, "{name}");
        // Every number of every path lies on the page, or not far off it.
        for path in document.descendants().filter_map(|node| node.attribute("d")) {
            let numbers = path.split(|c: char| c.is_ascii_alphabetic() || c == ' ').filter(|x| !x.is_empty());
            for number in numbers.map(|x| x.parse::<f64>().unwrap_or_else(|_| panic!("{name}: {x}"))) {
                assert!((-60.0..=page[2].max(page[3]) + 60.0).contains(&number), "{name}: {number}");
            }
        }
    }
}

#[test]
fn a_pdf_file_has_one_page_whose_content_can_be_read() {
    use std::io::Read;
    let at = |bytes: &[u8], what: &[u8]| bytes.windows(what.len()).position(|part| part == what);
    for (name, picture) in gallery() {
        let file = picture.bytes(Format::Pdf).unwrap();
        assert!(file.starts_with(b"%PDF-1.") && file.ends_with(b"%%EOF"), "{name}");
        let text = String::from_utf8_lossy(&file).into_owned();
        // The table of objects is where the end of the file says, and names places where objects begin.
        let table: usize = text.rsplit("startxref").next().unwrap().lines().nth(1).unwrap().parse().unwrap();
        assert!(file[table..].starts_with(b"xref"), "{name}");
        let entries = String::from_utf8_lossy(&file[table..]).into_owned();
        let places = entries.lines().filter(|line| line.trim_end().ends_with(" n"));
        for place in places.map(|line| line[..10].parse::<usize>().unwrap()) {
            let begin = String::from_utf8_lossy(&file[place..place + 12]).into_owned();
            assert!(begin.contains(" 0 obj"), "{name}: {begin}");
        }
        let page = text.split("/MediaBox [").nth(1).unwrap().split(']').next().unwrap();
        let page: Vec<f64> = page.split_whitespace().map(|x| x.parse().unwrap()).collect();
        assert!((page[2] * picture.px_per_pt - f64::from(picture.width)).abs() < 1.0, "{name}: {page:?}");
        // The last stream is the content.
        let last = text.matches("stream\n").count();
        assert!(last > 0, "{name}");
        let mut rest = &file[..];
        let mut content = Vec::new();
        while let Some(begin) = at(rest, b"\nstream\n") {
            let data = &rest[begin + 8..];
            let end = at(data, b"\nendstream").unwrap();
            content.clear();
            flate2::read::ZlibDecoder::new(&data[..end]).read_to_end(&mut content).unwrap();
            rest = &data[end..];
        }
        let content = String::from_utf8(content).unwrap();
        let count = |operator: &str| {
            content.lines().filter(|line| line.split(' ').any(|word| word == operator)).count()
        };
        assert!(count("f") >= said(&picture).len(), "{name}: every word is filled");
        assert_eq!(count("q"), count("Q"), "{name}");
    }
}

#[test]
fn a_file_name_without_a_known_format_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let picture = mechanism(&pendulum(), 1.0).unwrap();
    for name in ["start.jpg", "start"] {
        let error = picture.write(&folder.path().join(name)).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(".png, .svg or .pdf"), "{error}");
    }
    picture.write(&folder.path().join("start.SVG")).unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_wall_keeps_its_hatching_where_earlier_poses_cross_it() {
    let mut chart = pendulum();
    chart.sketch.walls = vec![WallSketch { through: [0.3, 0.0], normal: [-1.0, 0.0] }];
    let dark = |chart: &MechanismChart| {
        let picture = mechanism(chart, 2.0).unwrap();
        let ink = |p: &&[u8; 3]| p.iter().all(|&part| part < 70);
        picture.rgb.as_chunks::<3>().0.iter().filter(ink).count()
    };
    let with = dark(&chart);
    // The same view without the earlier pose; what it covered would be missing.
    let ghost = chart.poses.remove(0);
    chart.trails.push(ghost.bars.iter().flatten().copied().chain(ghost.hinges).collect());
    chart.trails[1].truncate(0);
    let without = dark(&chart);
    assert!(with as f64 > 0.97 * without as f64, "{with} of {without} dark pixels");
}

#[test]
fn bars_that_wind_up_do_not_flatten_the_others() {
    let time = times(400, 0.01);
    let swing = |k: usize| AngleSeries {
        name: format!("bar{k}"),
        angle: time.iter().map(|t| (3.0 * t + k as f64).sin()).collect(),
    };
    let mut series: Vec<AngleSeries> = (0..4).map(swing).collect();
    series.push(AngleSeries { name: "crank".to_owned(), angle: time.iter().map(|t| 50.0 * t).collect() });
    let travels =
        vec![AngleSeries { name: "cart".to_owned(), angle: time.iter().map(|t| 0.1 * t.cos()).collect() }];
    let chart = Angles { time: time.clone(), series, travels, ..Angles::default() };
    let picture = angles(&chart, 1.0).unwrap();
    assert_eq!(picture.panels.len(), 3);
    for words in ["angle [rad]", "crank [turns]", "cart [m]"] {
        assert!(said(&picture).contains(&words.to_owned()), "{words}: {:?}", said(&picture));
    }
}

#[test]
fn settings_below_the_floor_are_not_told_apart() {
    let series = |method: &str, points: Vec<[f64; 2]>| WorkSeries {
        method: method.to_owned(),
        name: method.to_owned(),
        points,
    };
    let chart = WorkPrecision {
        series: vec![
            series("taylor", vec![[1.0, 1e-8], [2.0, 3e-16]]),
            series("gauss16", vec![[300.0, 1e-16]]),
        ],
        floor: Some((1e-15, "rounding".to_owned())),
        ..WorkPrecision::default()
    };
    // The slow method stands at the right edge; the pale band of the front does not reach there.
    let band = |chart: &WorkPrecision| {
        let picture = work_precision(chart, 1.0).unwrap();
        let [left, _, right, _] = picture.panels[0];
        let middle = (0.5 * (left + right)) as usize;
        let wide = picture.width as usize;
        let pale = |p: &[u8; 3]| p[0] > 240 && p[2] < 215 && p[0] > p[2] + 30;
        (0..picture.height as usize).any(|y| pale(&picture.rgb.as_chunks::<3>().0[y * wide + middle]))
    };
    assert!(!band(&chart));
    assert!(band(&WorkPrecision { floor: None, ..chart }));
}

#[test]
fn odd_data_draw_something_sensible() {
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let far = (0..40).map(|k| 1e6 + 1e-3 * f64::from(k).sin()).collect();
    let cases: [Vec<f64>; 9] = [
        vec![],
        vec![1.5],
        vec![2.0; 40],
        vec![0.0; 40],
        vec![nan; 40],
        vec![1.0, nan, 2.0, inf, -3.0, -inf, 0.0, 5.0],
        vec![1e300, -1e300, 1e308, f64::MAX, -1e299],
        vec![1e-300, -1e-300, 5e-324, 2e-300, 0.0],
        far,
    ];
    for values in cases {
        let time = times(values.len(), 0.1);
        // Time as it comes, and the odd values for times too.
        for time in [time, values.clone()] {
            let pictures = odd_pictures(&time, &values);
            for picture in pictures {
                assert!(picture.rgb.iter().any(|&part| part < 150), "something is drawn for {values:?}");
                let area = f64::from(picture.width) * f64::from(picture.height);
                let dark = picture
                    .rgb
                    .as_chunks::<3>()
                    .0
                    .iter()
                    .filter(|colour| colour.iter().all(|&part| part < 200))
                    .count();
                assert!((dark as f64) < 0.3 * area, "the page is not flooded for {values:?}");
            }
        }
    }
}

fn odd_pictures(time: &[f64], values: &[f64]) -> Vec<Picture> {
    let (time, values) = (time.to_vec(), values.to_vec());
    let series = vec![drift("taylor", time.clone(), values.clone())];
    let points: Vec<[f64; 2]> = time.iter().zip(&values).map(|(&t, &v)| [t, v]).collect();
    let bars: Vec<[[f64; 2]; 2]> = points.iter().map(|&p| [[0.0, 0.0], p]).collect();
    let pose = Pose {
        hinges: points.clone(),
        springs: bars.clone(),
        motors: points.iter().map(|&at| MotorPose { at, angle: at[1], rate: at[0] }).collect(),
        points: points.clone(),
        arms: bars.iter().map(|&bar| (0, bar)).collect(),
        spirals: points.iter().map(|&at| SpiralPose { at, angle: at[0] }).collect(),
        sliders: points.iter().map(|&at| SliderPose { at, along: at, ground: at[0] > 0.0 }).collect(),
        bars,
    };
    let mut sketch = sketch();
    sketch.gravity = [values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(0.0)];
    sketch.walls = points.iter().map(|&through| WallSketch { through, normal: through }).collect();
    let mut out = Vec::new();
    for log_time in [false, true] {
        let panels = vec![ResidualPanel { name: "|*C*| [m]".to_owned(), series: series.clone() }; 2];
        let title = || "odd".to_owned();
        out.push(
            energy_drift(
                &EnergyDrift { title: title(), series: series.clone(), log_time, ..EnergyDrift::default() },
                0.5,
            )
            .unwrap(),
        );
        out.push(
            constraint_drift(
                &ConstraintDrift { title: title(), panels, log_time, ..ConstraintDrift::default() },
                0.5,
            )
            .unwrap(),
        );
    }
    for count in [1, 3, 5] {
        let series = vec![AngleSeries { name: "bar".to_owned(), angle: values.clone() }; count];
        out.push(angles(&Angles { time: time.clone(), series, ..Angles::default() }, 0.5).unwrap());
    }
    out.push(torque_power(&torque(time, values), 0.5).unwrap());
    let work = WorkSeries { method: "taylor".to_owned(), name: "taylor".to_owned(), points: points.clone() };
    out.push(work_precision(&WorkPrecision { series: vec![work], ..WorkPrecision::default() }, 0.5).unwrap());
    let chart = MechanismChart {
        sketch: sketch.clone(),
        poses: vec![pose.clone(), pose.clone()],
        trails: vec![points.clone()],
        ..Default::default()
    };
    out.push(mechanism(&chart, 0.5).unwrap());
    let motion =
        MotionGif { sketch, poses: vec![pose.clone(), pose], trails: vec![points], ..MotionGif::default() };
    assert_eq!(frames(&motion_gif(&motion).unwrap()), 2);
    out
}

#[test]
fn charts_without_any_data_say_so() {
    let says = |picture: Picture| picture.texts.iter().any(|text| text.text == "no data");
    assert!(says(mechanism(&MechanismChart::default(), 1.0).unwrap()));
    assert!(says(angles(&Angles::default(), 1.0).unwrap()));
    assert!(says(energy_drift(&EnergyDrift::default(), 1.0).unwrap()));
    assert!(says(constraint_drift(&ConstraintDrift::default(), 1.0).unwrap()));
    assert!(says(torque_power(&TorquePower::default(), 1.0).unwrap()));
    assert!(says(work_precision(&WorkPrecision::default(), 1.0).unwrap()));
    assert_eq!(frames(&motion_gif(&MotionGif::default()).unwrap()), 1);
}

#[test]
fn the_same_data_give_the_same_picture() {
    let twice = [mechanism(&pendulum(), 1.0).unwrap(), mechanism(&pendulum(), 1.0).unwrap()];
    assert_eq!(twice[0].rgb, twice[1].rgb);
}

/// Torques of more than three motors are not marked, nor are those that are zero.
#[test]
fn the_caption_speaks_of_marks_only_where_there_are_any() {
    let of = |count: usize, value: f64| {
        let mut chart = torque(times(50, 0.1), vec![value; 50]);
        let motor = chart.motors[0].clone();
        chart.motors = (0..count).map(|k| MotorSeries { name: format!("m{k}"), ..motor.clone() }).collect();
        said(&torque_power(&chart, 1.0).unwrap()).join(" ")
    };
    for (count, value, is_marked) in [(1, 2.0, true), (3, 2.0, true), (1, 0.0, false), (5, 2.0, false)] {
        let words = of(count, value);
        assert_eq!(words.contains("marked"), is_marked, "{count} motors at {value}: {words}");
        assert_eq!(words.contains("12.00 W at"), is_marked, "{count} motors at {value}: {words}");
    }
}

/// Sixty curves in a panel with room for a third as many labels.
#[test]
fn labels_of_many_curves_are_those_of_the_largest() {
    let outputs = (0..60).map(|k| OutputSeries {
        name: format!("c {k}"),
        unit: "rad".to_owned(),
        time: times(3, 1.0),
        value: vec![0.0, 0.1 * f64::from(k), 0.001 * f64::from(k)],
        extremes: Vec::new(),
    });
    let chart =
        OutputsChart { title: "many".to_owned(), outputs: outputs.collect(), ..OutputsChart::default() };
    let picture = outputs_of(&chart);
    let labels: Vec<&TextBox> = picture.texts.iter().filter(|text| text.text.starts_with("c ")).collect();
    let told = said(&picture);
    assert!(labels.len() > 8 && told.contains(&format!("and {} more", 60 - labels.len())), "{told:?}");
    for k in 60 - labels.len()..60 {
        assert!(told.contains(&format!("c {k}")), "{k} is among the largest: {told:?}");
    }
    for (k, one) in picture.texts.iter().enumerate() {
        assert!(picture.texts[..k].iter().all(|other| !one.overlaps(other)), "{:?}", one.text);
        assert!(one.bounds()[2] <= f64::from(picture.width), "{:?} ends beyond the page", one.text);
    }
}

/// Bars with ordinary names in a panel each, and an output whose values are told from a number on.
#[test]
fn names_of_upright_axes_stay_at_their_panels() {
    let time = times(200, 0.05);
    let names = ["left_front_suspension_arm", "upper_control_link", "wheel_carrier"];
    let series = |(k, name): (usize, &&str)| AngleSeries {
        name: plain(name),
        angle: time.iter().map(|t| (t + k as f64).sin()).collect(),
    };
    let bars = Angles {
        title: "Angles of the bars".to_owned(),
        time: time.clone(),
        series: names.iter().enumerate().map(series).collect(),
        ..Angles::default()
    };
    let output = |name: &str, unit: &str, from: f64| OutputSeries {
        name: plain(name),
        unit: unit.to_owned(),
        time: time.clone(),
        value: time.iter().map(|t| from + 1e-12 * t.sin()).collect(),
        extremes: Vec::new(),
    };
    let long = "a_name_of_sixty_four_letters_".repeat(2);
    let far = OutputsChart {
        title: "Outputs".to_owned(),
        outputs: vec![output("bearing", "N", 0.6244338578), output(&long, "m", 0.0), output("c", "W", 0.0)],
        ..OutputsChart::default()
    };
    for (name, picture) in [("angles", angles(&bars, 1.0).unwrap()), ("outputs", outputs_of(&far))] {
        let [_, from, _, to] = picture.panels[0];
        for (k, one) in picture.texts.iter().enumerate() {
            let [left, top, right, bottom] = one.bounds();
            let is_upright = bottom - top > right - left;
            assert!(
                left >= 0.0 && top >= 0.0 && bottom <= f64::from(picture.height),
                "{name}: {:?}",
                one.text
            );
            assert!(!is_upright || bottom - top < to - from + 12.5, "{name}: {:?} is too long", one.text);
            for other in &picture.texts[..k] {
                assert!(!one.overlaps(other), "{name}: {:?} lies on {:?}", one.text, other.text);
            }
        }
    }
}

fn outputs_of(chart: &OutputsChart) -> Picture {
    outputs(chart, 1.0).unwrap()
}
