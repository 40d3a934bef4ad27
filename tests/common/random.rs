//! Random scenes and requests, drawn from a string of bytes: what a fuzzer can steer, and a seed can give.

use driftless::run::{METHODS, Request, Stabilization};
use serde_json::{Map, Value, json};
use std::f64::consts::PI;

/// A string of bytes that choices are drawn from; zeros once it is used up.
#[derive(Clone)]
pub struct Draw<'a> {
    bytes: &'a [u8],
}

impl<'a> Draw<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    pub fn rest(self) -> &'a [u8] {
        self.bytes
    }

    pub fn byte(&mut self) -> u8 {
        let Some((&byte, rest)) = self.bytes.split_first() else { return 0 };
        self.bytes = rest;
        byte
    }

    pub fn word(&mut self) -> u64 {
        (0..8).fold(0, |word, _| word << 8 | u64::from(self.byte()))
    }

    /// One of 0 … n - 1.
    pub fn below(&mut self, n: usize) -> usize {
        if n <= 256 {
            usize::from(self.byte()) % n.max(1)
        } else {
            (usize::from(self.byte()) << 8 | usize::from(self.byte())) % n
        }
    }

    /// True in about `percent` of a hundred cases.
    pub fn chance(&mut self, percent: usize) -> bool {
        usize::from(self.byte()) * 100 >= (100 - percent.min(100)) * 256
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        f64::from(u16::from(self.byte()) << 8 | u16::from(self.byte())) / 65535.0
    }

    pub fn one<'b, T>(&mut self, of: &'b [T]) -> &'b T {
        &of[self.below(of.len())]
    }
}

/// How far numbers stray from the usual: decades up and down.
#[derive(Clone, Copy)]
struct Spread(f64);

impl Spread {
    /// A positive number about `usual`.
    fn size(self, draw: &mut Draw, usual: f64) -> f64 {
        (usual * 10f64.powf(self.0 * (2.0 * draw.share() - 1.0))).clamp(1e-30, 1e30)
    }

    /// The same with either sign, or zero.
    fn signed(self, draw: &mut Draw, usual: f64) -> f64 {
        match draw.below(4) {
            0 => 0.0,
            1 => -self.size(draw, usual),
            _ => self.size(draw, usual),
        }
    }
}

fn angle(draw: &mut Draw) -> f64 {
    match draw.below(8) {
        0 => 0.0,
        1 => PI,
        2 => PI / 2.0,
        3 => 1e6 * (draw.share() - 0.5),
        _ => 2.0 * PI * (draw.share() - 0.5),
    }
}

fn law(draw: &mut Draw, spread: Spread, rate: f64) -> Value {
    let mut law = Map::new();
    law.insert("start".into(), json!(angle(draw)));
    if draw.chance(70) {
        law.insert("rate".into(), json!(spread.signed(draw, rate)));
    }
    if draw.chance(20) {
        law.insert("acceleration".into(), json!(spread.signed(draw, rate)));
    }
    if draw.chance(30) {
        let sine = json!({"amplitude": spread.signed(draw, 0.3), "frequency": spread.signed(draw, 3.0), "phase": angle(draw)});
        law.insert("sines".into(), json!([sine]));
    }
    Value::Object(law)
}

/// A place on bar `k`, or on the ground.
fn place(draw: &mut Draw, spread: Spread, bar: Option<usize>, length: f64) -> Value {
    let point = match draw.below(4) {
        0 => [0.0, 0.0],
        1 | 2 => [length, 0.0],
        _ => [spread.signed(draw, length), spread.signed(draw, 0.1 * length)],
    };
    json!({"body": bar.map_or("ground".into(), |k| format!("bar{k}")), "point": point})
}

/// What the parts of a random scene have in common.
struct Usual {
    spread: Spread,
    /// Of bars, and of each bar \[m\].
    length: f64,
    lengths: Vec<f64>,
    /// Gravity \[m/s²\], and the rate of a pendulum \[rad/s\].
    pull: f64,
    rate: f64,
    /// Of the last bar that has one \[kg\].
    mass: f64,
    /// True where hinges may be missing.
    is_loose: bool,
}

impl Usual {
    fn bar(&mut self, draw: &mut Draw) -> Value {
        let (spread, length) = (self.spread, self.length);
        let own = if draw.chance(70) { length } else { spread.size(draw, length) };
        let name = format!("bar{}", self.lengths.len());
        self.lengths.push(own);
        if draw.chance(60) {
            let inertia = *draw.one(&["full", "slender"]);
            json!({"name": name, "length": own, "width": 0.1 * own, "thickness": 0.01, "density": spread.size(draw, 700.0), "inertia": inertia})
        } else {
            self.mass = spread.size(draw, 1.0);
            let centre = [
                spread.signed(draw, 0.5 * own),
                if draw.chance(30) { spread.signed(draw, 0.1 * own) } else { 0.0 },
            ];
            let inertia = if draw.chance(20) { 0.0 } else { spread.size(draw, self.mass * own * own / 12.0) };
            json!({"name": name, "mass": self.mass, "centre": centre, "inertia": inertia, "length": own})
        }
    }

    /// A place on a bar, or on the ground, where that is as wide as `base`.
    fn place(&self, draw: &mut Draw, bar: Option<usize>, base: f64) -> Value {
        place(draw, self.spread, bar, bar.map_or(base, |bar| self.lengths[bar]))
    }

    /// A tree, and sometimes a hinge that closes a loop.
    fn hinges(&self, draw: &mut Draw) -> Vec<Value> {
        let (mut hinges, n) = (Vec::new(), self.lengths.len());
        for k in 0..n {
            if self.is_loose && draw.chance(50) {
                continue;
            }
            let parent = if k == 0 {
                None
            } else {
                [None, Some(k - 1), Some(k - 1), Some(draw.below(k))][draw.below(4)]
            };
            let there = self.place(draw, parent, 0.0);
            hinges.push(json!({"name": format!("h{k}"), "between": [there, {"body": format!("bar{k}"), "point": [0, 0]}]}));
        }
        if draw.chance(20) {
            let ends = [Some(draw.below(n)), [None, Some(draw.below(n))][draw.below(2)]];
            let ends = ends.map(|bar| self.place(draw, bar, 1.5 * self.length));
            hinges.push(json!({"name": "loop", "between": ends}));
        }
        hinges
    }

    fn body(&self, draw: &mut Draw) -> String {
        format!("bar{}", draw.below(self.lengths.len()))
    }

    /// Lets a part be relative to something in so many per cent of all cases.
    fn relate(&self, draw: &mut Draw, made: &mut Value, percent: usize) {
        if draw.chance(percent) {
            made["relative_to"] = json!([self.body(draw), self.body(draw), "ground".into()][draw.below(3)]);
        }
    }

    fn ends(&self, draw: &mut Draw) -> [Value; 2] {
        let n = self.lengths.len();
        let bars = [[None, Some(draw.below(n))][draw.below(2)], Some(draw.below(n))];
        bars.map(|bar| self.place(draw, bar, self.length))
    }

    fn spring(&self, draw: &mut Draw) -> Value {
        let Self { spread, length, pull, rate, mass, .. } = *self;
        let is_rigid = draw.chance(12);
        let damping = if !is_rigid && draw.chance(30) { spread.size(draw, mass * rate) } else { 0.0 };
        let is_damper = damping > 0.0 && draw.chance(20);
        let usual = if is_rigid { 1e6 } else { 5.0 } * (mass * pull / length);
        let stiffness = if is_damper { 0.0 } else { spread.size(draw, usual) };
        let free = if !is_rigid && draw.chance(15) { 0.0 } else { spread.size(draw, length) };
        let mut made = json!({"between": self.ends(draw), "stiffness": stiffness, "free_length": free, "damping": damping});
        if is_rigid {
            made["model"] = json!("rigid");
        }
        made
    }

    fn torsion_spring(&self, draw: &mut Draw) -> Value {
        let Self { spread, length, pull, rate, mass, .. } = *self;
        let damping = if draw.chance(30) { spread.size(draw, mass * length * length * rate) } else { 0.0 };
        let stiffness = spread.size(draw, mass * pull / length * length * length);
        let mut made = json!({"body": self.body(draw), "stiffness": stiffness, "free_angle": angle(draw), "damping": damping});
        self.relate(draw, &mut made, 40);
        made
    }

    fn force(&self, draw: &mut Draw) -> Value {
        let Self { spread, length, pull, rate, mass, .. } = *self;
        let force = [spread.signed(draw, mass * pull), spread.signed(draw, mass * pull)];
        let frame = *draw.one(&["ground", "body"]);
        let mut made = json!({"body": self.body(draw), "point": [length, 0], "force": force, "frame": frame});
        if draw.chance(40) {
            made["law"] = law(draw, spread, rate);
        }
        made
    }

    fn torque(&self, draw: &mut Draw) -> Value {
        let Self { spread, length, pull, rate, mass, .. } = *self;
        let mut made = json!({"body": self.body(draw), "torque": spread.signed(draw, mass * pull * length)});
        self.relate(draw, &mut made, 40);
        if draw.chance(40) {
            made["law"] = law(draw, spread, rate);
        }
        made
    }

    fn slider(&self, draw: &mut Draw) -> Value {
        let [place, point] = self.ends(draw);
        let mut rail = json!({"body": "ground", "point": [0, self.spread.signed(draw, self.length)], "direction": [1, draw.below(2)]});
        if draw.chance(40) {
            rail["body"] = place["body"].clone();
            rail["point"] = place["point"].clone();
        }
        json!({"point": point, "rail": rail, "angle": *draw.one(&["free", "free", "locked"])})
    }

    fn weld(&self, draw: &mut Draw) -> Value {
        json!({"between": self.ends(draw)})
    }

    fn lock(&self, draw: &mut Draw) -> Value {
        let mut made = json!({"body": self.body(draw)});
        if draw.chance(30) {
            made["angle"] = json!(angle(draw));
        }
        self.relate(draw, &mut made, 50);
        made
    }

    fn wall(&self, draw: &mut Draw) -> Value {
        let line =
            json!({"through": [0, -self.spread.size(draw, self.length)], "normal": [draw.below(2), 1]});
        json!({"body": self.body(draw), "point": [self.length, 0], "line": line, "restitution": *draw.one(&[0.0, 0.3, 0.5, 0.9, 1.0])})
    }

    /// A motor on a bar and one on the first slider, each sometimes; the driven bar.
    fn motors(&self, draw: &mut Draw, has_slider: bool) -> (Vec<Value>, Option<usize>) {
        let Self { spread, length, rate, .. } = *self;
        let (mut driven, mut motors) = (None, Vec::new());
        if draw.chance(25) {
            let k = draw.below(self.lengths.len());
            driven = Some(k);
            let mut motor =
                json!({"name": "motor", "body": format!("bar{k}"), "law": law(draw, spread, rate)});
            self.relate(draw, &mut motor, 20);
            motors.push(motor);
        }
        if has_slider && draw.chance(50) {
            let mut law = law(draw, spread, rate * length);
            law["start"] = json!(spread.signed(draw, length));
            motors.push(json!({"name": "drive", "slider": "sliders0", "law": law}));
        }
        (motors, driven)
    }

    /// The start of all bars but the driven one.
    fn start(&self, draw: &mut Draw, driven: Option<usize>) -> Map<String, Value> {
        let Self { spread, length, rate, is_loose, .. } = *self;
        let mut start = Map::new();
        for k in (0..self.lengths.len()).filter(|k| driven != Some(*k)) {
            if is_loose && draw.chance(10) {
                continue;
            }
            let mut given = json!({"phi": angle(draw), "omega": if draw.chance(50) { 0.0 } else { spread.signed(draw, rate) }});
            if is_loose {
                given["origin"] = json!([spread.signed(draw, length), 0]);
                given["velocity"] = json!([0, spread.signed(draw, length * rate)]);
            }
            start.insert(format!("bar{k}"), given);
        }
        start
    }
}

/// How a part of a random scene is made.
type Make = fn(&Usual, &mut Draw) -> Value;

/// Lists of parts that a scene may have, in how many per cent of all cases, and how each part is made.
const PARTS: [(&str, usize, Make); 8] = [
    ("springs", 25, Usual::spring),
    ("torsion_springs", 15, Usual::torsion_spring),
    ("forces", 10, Usual::force),
    ("torques", 10, Usual::torque),
    ("sliders", 12, Usual::slider),
    ("welds", 3, Usual::weld),
    ("locks", 5, Usual::lock),
    ("walls", 12, Usual::wall),
];

/// The text of a scene that is valid as far as single values go; what does not fit together is refused by the
/// reader or the compiler.
pub fn scene(draw: &mut Draw) -> String {
    let spread = Spread(*draw.one(&[0.5, 0.5, 1.0, 3.0, 6.0, 25.0]));
    let length = spread.size(draw, 0.6);
    let gravity = if draw.chance(80) {
        [spread.size(draw, 9.81), 0.0]
    } else {
        [spread.signed(draw, 9.81), spread.signed(draw, 9.81)]
    };
    let pull = gravity[0].abs().max(gravity[1].abs()).max(1e-30);
    let rate = (pull / length).sqrt();
    let n = *draw.one(&[1, 1, 2, 2, 2, 3, 3, 4, 5, 6]);
    let mut usual = Usual { spread, length, lengths: Vec::new(), pull, rate, mass: 1.0, is_loose: false };
    let bars: Vec<Value> = (0..n).map(|_| usual.bar(draw)).collect();
    usual.is_loose = draw.chance(10);
    let hinges = usual.hinges(draw);
    let mut scene = Map::new();
    for (list, percent, make) in PARTS {
        if draw.chance(percent) {
            let count = 1 + usize::from(draw.chance(15));
            let part = |number| {
                let mut made = make(&usual, draw);
                made["name"] = json!(format!("{list}{number}"));
                made
            };
            scene.insert(list.into(), (0..count).map(part).collect());
        }
    }
    let (motors, driven) = usual.motors(draw, scene.contains_key("sliders"));
    if !motors.is_empty() {
        scene.insert("motors".into(), json!(motors));
    }
    let start = usual.start(draw, driven);
    let until = spread.size(draw, 1.0 / rate).clamp(1e-20, 1e12);
    let rows = *draw.one(&[1.0, 2.0, 5.0, 16.0]);
    scene.insert("name".into(), json!("random"));
    scene.insert("gravity".into(), json!(gravity));
    scene.insert("bars".into(), json!(bars));
    scene.insert("hinges".into(), json!(hinges));
    scene.insert("start".into(), json!(start));
    scene.insert("until".into(), json!(until));
    scene.insert("every".into(), json!(until / rows));
    Value::Object(scene).to_string()
}

/// What is asked of a run.
pub fn request(draw: &mut Draw, until: f64, max_evaluations: u64) -> Request {
    let mut request = Request { max_evaluations: Some(max_evaluations), ..Request::default() };
    if draw.chance(75) {
        request.method = Some(draw.one(METHODS).id);
    }
    let is_adaptive = request.method.is_none_or(|method| method.is_adaptive());
    if is_adaptive && draw.chance(60) {
        request.rtol = Some(10f64.powi(-2 - draw.below(13) as i32));
        request.atol = draw.chance(10).then(|| 10f64.powi(-2 - draw.below(13) as i32));
    } else if !is_adaptive && draw.chance(70) {
        request.step = Some(until / f64::from(1 << draw.below(8)));
    }
    if draw.chance(30) {
        request.stabilize = Some(*draw.one(&Stabilization::ALL));
    }
    request.time_constant =
        (request.stabilize == Some(Stabilization::Baumgarte) && draw.chance(30)).then_some(1e-3 * until);
    request.extended = draw.chance(3);
    request
}
