//! Whether the parts of a scene fit together: the hinges form a tree on the ground, the motors leave each angle one master, the start
//! agrees with their laws, and nothing begins where its force or its side is undefined.

use super::error::SceneError;
use super::format::{ANGLE, RATE, about};
use super::read::{At, GivenStart};
use super::{Bar, Hinge, Law, Motor, Place, Spring, Start, Wall};

/// A start and a law that differ by less than this, relative to 1 or the value, are the same.
const SAME: f64 = 1e-12;

/// How each bar hangs.
pub(super) struct HingeTree {
    /// The bars, each after the one it hangs on.
    order: Vec<Hang>,
}

/// How one bar hangs.
struct Hang {
    bar: usize,
    /// The body it hangs on and the point there.
    from: Place,
    /// The point of this bar.
    own: [f64; 2],
}

/// The tree of hinges; refuses a hinge that closes a loop, a bar that hangs on nothing, and one without any inertia.
pub(super) fn hinge_tree(
    root: &At,
    bars: &[Bar],
    bar_places: &[At],
    hinges: &[Hinge],
    hinge_places: &[At],
) -> Result<HingeTree, SceneError> {
    let mut groups = Groups::of(bars.len() + 1);
    let mut at_bar: Vec<Vec<usize>> = vec![Vec::new(); bars.len() + 1];
    for (number, hinge) in hinges.iter().enumerate() {
        let [a, b] = hinge.between.map(|place| body(place.bar));
        if !groups.join(a, b) {
            let problem = format!("(hinge `{}`) closes a loop", hinge.name);
            let hint =
                "closed loops are not supported in this version; leave this hinge out or hold the two points together by a stiff spring";
            return Err(hinge_places[number].refuse(&problem, "hinges must form a tree on the ground", hint));
        }
        at_bar[a].push(number);
        at_bar[b].push(number);
    }
    if let Some(free) = (0..bars.len()).find(|&bar| groups.find(body(Some(bar))) != groups.find(body(None))) {
        let problem = format!("(bar `{}`) does not hang on the ground", bars[free].name);
        let hint = "bodies that fly free are not supported in this version; join it by a hinge to \"ground\" or to a bar that hangs there";
        return Err(bar_places[free].refuse(&problem, "every bar must hang on the ground through hinges", hint));
    }
    let mut order: Vec<Hang> = Vec::with_capacity(bars.len());
    let mut hung = vec![false; bars.len() + 1];
    hung[0] = true;
    let mut reached = vec![None];
    let mut next = 0;
    while let Some(&here) = reached.get(next) {
        next += 1;
        for &number in &at_bar[body(here)] {
            let [a, b] = hinges[number].between;
            let (from, to) = if a.bar == here { (a, b) } else { (b, a) };
            let Some(bar) = to.bar else { continue };
            if !hung[body(to.bar)] {
                hung[body(to.bar)] = true;
                reached.push(to.bar);
                order.push(Hang { bar, from, own: to.point });
            }
        }
    }
    let mut turns_nothing: Vec<bool> = bars.iter().map(|bar| bar.inertia == 0.0).collect();
    let mut own = vec![[0.0; 2]; bars.len()];
    for hang in &order {
        own[hang.bar] = hang.own;
        turns_nothing[hang.bar] &= bars[hang.bar].centre == hang.own;
    }
    for hang in &order {
        if let Some(parent) = hang.from.bar {
            turns_nothing[parent] &= hang.from.point == own[parent];
        }
    }
    if let Some(bar) = turns_nothing.iter().position(|&nothing| nothing) {
        let problem = format!("(bar `{}`) is a point mass on its own hinge", bars[bar].name);
        let hint = "give it an inertia, or a centre away from its hinge";
        return Err(bar_places[bar].refuse(&problem, "turning a bar must move some mass, else its angle has no equation", hint));
    }
    debug_assert!(order.len() == bars.len() && root.path.is_empty());
    Ok(HingeTree { order })
}

/// The ground is body 0.
fn body(bar: Option<usize>) -> usize {
    bar.map_or(0, |bar| bar + 1)
}

/// Bodies that are joined, as a forest with path halving.
struct Groups(Vec<usize>);

impl Groups {
    fn of(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn find(&mut self, mut body: usize) -> usize {
        while self.0[body] != body {
            self.0[body] = self.0[self.0[body]];
            body = self.0[body];
        }
        body
    }

    /// False where the two were joined before.
    fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a] = b;
        a != b
    }
}

/// Which motors tie which bodies.
struct Ties<'a> {
    motors: &'a [Motor],
    /// The motors at each body.
    at_body: Vec<Vec<usize>>,
    /// The bars of each group of tied bodies, but not of the ground's; a bar without a motor is a group of one.
    groups: Vec<Vec<usize>>,
}

impl<'a> Ties<'a> {
    /// Fails with the number of the first motor that drives an angle the others give already.
    fn of(bars: usize, motors: &'a [Motor]) -> Result<Self, usize> {
        let mut groups = Groups::of(bars + 1);
        let mut at_body = vec![Vec::new(); bars + 1];
        for (number, motor) in motors.iter().enumerate() {
            let (from, to) = (body(motor.relative_to), body(Some(motor.bar)));
            if !groups.join(from, to) {
                return Err(number);
            }
            at_body[from].push(number);
            at_body[to].push(number);
        }
        let mut members = vec![Vec::new(); bars + 1];
        for bar in 0..bars {
            members[groups.find(body(Some(bar)))].push(bar);
        }
        members[groups.find(body(None))].clear();
        members.retain(|group| !group.is_empty());
        members.sort_by_key(|group| group[0]);
        Ok(Self { motors, at_body, groups: members })
    }

    /// Carries the start of `from` along the motors to all bodies that have none yet.
    fn spread(&self, from: usize, start: &mut [Option<Start>]) {
        let mut open = vec![from];
        while let Some(here) = open.pop() {
            let Some(known) = start[here] else { continue };
            for &number in &self.at_body[here] {
                let motor = &self.motors[number];
                let (base, bar) = (body(motor.relative_to), body(Some(motor.bar)));
                let law = motor.law.at_start();
                let (to, there) = if here == base {
                    (bar, Start { phi: known.phi + law.phi, omega: known.omega + law.omega })
                } else {
                    (base, Start { phi: known.phi - law.phi, omega: known.omega - law.omega })
                };
                if start[to].is_none() {
                    start[to] = Some(there);
                    open.push(to);
                }
            }
        }
    }
}

/// Angle and rate of each bar at t = 0: as given, or by the law of its motor.
pub(super) fn starts(
    root: &At,
    bars: &[Bar],
    motors: &[Motor],
    motor_places: &[At],
    given: &[Option<GivenStart>],
) -> Result<Vec<Start>, SceneError> {
    let ties = Ties::of(bars.len(), motors).map_err(|number| {
        let problem = format!("(motor `{}`) drives an angle that is given already", motors[number].name);
        let hint = "leave out one of the motors that share these bars";
        motor_places[number].refuse(&problem, "the other motors must leave it free", hint)
    })?;
    let mut start: Vec<Option<Start>> = vec![None; bars.len() + 1];
    start[0] = Some(Start { phi: 0.0, omega: 0.0 });
    ties.spread(0, &mut start);
    for group in &ties.groups {
        // The others follow from one: a bar that no motor drives if it is given, else the first that is.
        let driven = |bar: usize| motors.iter().any(|motor| motor.bar == bar);
        let one = group.iter().copied().filter(|&bar| given[bar].is_some()).min_by_key(|&bar| group.len() > 1 && driven(bar));
        let Some((bar, GivenStart { phi, omega, .. })) = one.and_then(|bar| Some((bar, given[bar].as_ref()?))) else {
            let free = group.iter().copied().min_by_key(|&bar| driven(bar)).unwrap_or(group[0]);
            return Err(missing_start(root, &bars[free].name, group.len() > 1));
        };
        start[body(Some(bar))] = Some(Start { phi: *phi, omega: *omega });
        ties.spread(body(Some(bar)), &mut start);
    }
    let mut resolved = Vec::with_capacity(bars.len());
    for (bar, Bar { name, .. }) in bars.iter().enumerate() {
        let Some(exact) = start[body(Some(bar))] else { return Err(missing_start(root, name, true)) };
        if let Some(&by) = ties.at_body[body(Some(bar))].first() {
            if !ANGLE.holds(exact.phi) || !RATE.holds(exact.omega) {
                let problem =
                    format!("(motor `{}`) starts bar `{name}` at {} rad, {} rad/s", motors[by].name, about(exact.phi), about(exact.omega));
                let allowed = format!("a start must be {ANGLE} and {RATE}");
                return Err(motor_places[by].refuse(&problem, &allowed, "take off whole turns, and check the rates"));
            }
            if let Some(given) = &given[bar] {
                agrees(&given.phi_at, given.phi, exact.phi, "rad", &motors[by].name)?;
                agrees(&given.omega_at, given.omega, exact.omega, "rad/s", &motors[by].name)?;
            }
        }
        resolved.push(exact);
    }
    Ok(resolved)
}

/// True for each bar whose start must be written so that all starts read back to the same bits: of bars that motors tie to each other
/// only the one that the others were computed from.
pub(super) fn written_starts(motors: &[Motor], start: &[Start]) -> Vec<bool> {
    let mut written = vec![true; start.len()];
    let Ok(ties) = Ties::of(start.len(), motors) else { return written };
    for group in ties.groups.iter().filter(|group| group.len() > 1) {
        let gives_all = |&bar: &usize| {
            let mut trial = vec![None; start.len() + 1];
            trial[body(Some(bar))] = Some(start[bar]);
            ties.spread(body(Some(bar)), &mut trial);
            group.iter().all(|&other| trial[body(Some(other))] == Some(start[other]))
        };
        if let Some(one) = group.iter().copied().find(gives_all) {
            group.iter().for_each(|&bar| written[bar] = bar == one);
        }
    }
    written
}

fn missing_start(root: &At, bar: &str, tied: bool) -> SceneError {
    let hint = if tied {
        format!("its motors only tie it to other bars; add \"start\": {{\"{bar}\": {{\"phi\": 0, \"omega\": 0}}}} or that of one of those")
    } else {
        format!("add \"start\": {{\"{bar}\": {{\"phi\": 0, \"omega\": 0}}}}; only bars that a motor drives may be left out")
    };
    root.missing("start", bar, "must be {\"phi\": angle in rad, \"omega\": rate in rad/s}", &hint)
}

fn agrees(at: &At, given: f64, exact: f64, unit: &str, motor: &str) -> Result<(), SceneError> {
    if (given - exact).abs() <= SAME * exact.abs().max(1.0) {
        return Ok(());
    }
    let allowed = format!("must be {exact:?} {unit}, by the law of motor `{motor}`");
    let turns = (given - exact) / std::f64::consts::TAU;
    let hint = if unit == "rad" && turns.abs() >= 0.5 && (turns - turns.round()).abs() < 1e-9 {
        format!("leave it out, or write {exact:?}; angles are not taken modulo a turn, and this one is {turns:.0} turns off")
    } else {
        format!("leave the bar out of \"start\", or write {exact:?}")
    };
    Err(at.refuse_value(&allowed, &hint))
}

impl Law {
    /// Angle \[rad\] and rate \[rad/s\] at t = 0.
    pub fn at_start(&self) -> Start {
        let mut start = Start { phi: self.start, omega: self.rate };
        for sine in &self.sines {
            start.phi += sine.amplitude * libm::sin(sine.phase);
            start.omega += sine.amplitude * sine.frequency * libm::cos(sine.phase);
        }
        start
    }
}

/// Where everything is at t = 0.
pub(super) struct Posture {
    /// Origin \[m\], cos and sin of the angle, and the sum of the lengths that lead there \[m\], of each bar.
    bars: Vec<([f64; 2], [f64; 2], f64)>,
}

impl HingeTree {
    /// Where everything is at `start`.
    pub fn posture(&self, start: &[Start]) -> Posture {
        let bars = start.iter().map(|start| ([0.0; 2], [libm::cos(start.phi), libm::sin(start.phi)], 0.0)).collect();
        let mut posture = Posture { bars };
        for Hang { bar, from, own } in &self.order {
            let (hinge, way) = posture.at(*from);
            let [c, s] = posture.bars[*bar].1;
            let origin = [hinge[0] - (c * own[0] - s * own[1]), hinge[1] - (s * own[0] + c * own[1])];
            posture.bars[*bar] = (origin, [c, s], way + own[0].abs() + own[1].abs());
        }
        posture
    }
}

impl Posture {
    /// Position \[m\] of a place, and the sum of the lengths that lead there \[m\], which scales its rounding error.
    fn at(&self, place: Place) -> ([f64; 2], f64) {
        let [x, y] = place.point;
        let size = x.abs() + y.abs();
        let Some(bar) = place.bar else { return (place.point, size) };
        let ([x0, y0], [c, s], way) = self.bars[bar];
        ([x0 + c * x - s * y, y0 + s * x + c * y], way + size)
    }
}

/// Refuses a spring without a direction.
pub(super) fn springs(posture: &Posture, springs: &[Spring], places: &[At]) -> Result<(), SceneError> {
    for (Spring { name, between: [a, b], free_length, .. }, at) in springs.iter().zip(places) {
        let ((from, way_from), (to, way_to)) = (posture.at(*a), posture.at(*b));
        let length = libm::hypot(to[0] - from[0], to[1] - from[1]);
        if *free_length > 0.0 && length <= SAME * (way_from + way_to) {
            let problem = format!("(spring `{name}`) starts with length 0 and has the free length {free_length} m");
            let hint = "its force has no direction there; start elsewhere, move an end, or set free_length to 0";
            return Err(at.refuse(&problem, "such a spring must start with a positive length", hint));
        }
    }
    Ok(())
}

/// Refuses a wall whose point starts behind it.
pub(super) fn walls(posture: &Posture, walls: &[Wall], places: &[At]) -> Result<(), SceneError> {
    for (Wall { name, bar, point, through, normal, .. }, at) in walls.iter().zip(places) {
        let (position, way) = posture.at(Place { bar: Some(*bar), point: *point });
        let gap = (position[0] - through[0]) * normal[0] + (position[1] - through[1]) * normal[1];
        if gap < -SAME * (way + through[0].abs() + through[1].abs()) {
            let problem = format!("(wall `{name}`) has its point {} m behind it at the start", about(-gap));
            let hint = format!("start elsewhere, move the wall, or turn its normal to [{}, {}]", -normal[0], -normal[1]);
            return Err(at.refuse(&problem, "the point must start on the side the normal shows, or on the wall", &hint));
        }
    }
    Ok(())
}
