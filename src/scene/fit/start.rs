//! Angle and rate of every bar at t = 0: as given, or as motors and locks tell, or a guess.

use super::{Groups, Places, SAME, body};
use crate::arithmetic::shown::about;
use crate::scene::error::SceneError;
use crate::scene::format::{ANGLE, RATE};
use crate::scene::read::{At, GivenStart};
use crate::scene::{Given, Law, Scene, Start};

/// A motor on an angle, or a lock that says which.
struct AngleConstraint<'a> {
    /// "motor" or "lock".
    kind: &'static str,
    name: &'a str,
    /// The two bodies.
    base: usize,
    bar: usize,
    /// The angle between them, and its rate.
    law: Start,
}

impl<'a> AngleConstraint<'a> {
    /// Those of a scene, motors first.
    fn all(scene: &'a Scene) -> Vec<Self> {
        let acting = scene.motors.iter().filter(|motor| !scene.is_inactive(&motor.name));
        let motors = acting.map(|motor| Self {
            kind: "motor",
            name: &motor.name,
            base: body(motor.relative_to),
            bar: body(Some(motor.bar)),
            law: motor.law.at_start(),
        });
        let acting = scene.locks.iter().filter(|lock| !scene.is_inactive(&lock.name));
        let locks = acting.filter_map(|lock| {
            let law = Start { phi: lock.angle?, omega: 0.0 };
            Some(Self {
                kind: "lock",
                name: &lock.name,
                base: body(lock.relative_to),
                bar: body(Some(lock.bar)),
                law,
            })
        });
        motors.chain(locks).collect()
    }
}

/// Which motors and locks tie which bodies.
struct AngleConstraints<'a> {
    all: Vec<AngleConstraint<'a>>,
    /// The ties at each body.
    at_body: Vec<Vec<usize>>,
    /// The bars of each group of tied bodies, but not of the ground's; a bar without a tie is a group of one.
    groups: Vec<Vec<usize>>,
}

/// One of the two numbers of a [`Start`].
type Part = fn(&Start) -> f64;

impl<'a> AngleConstraints<'a> {
    /// Fails with the number of the first tie whose angle the others give already.
    fn of(scene: &'a Scene) -> Result<Self, usize> {
        let bars = scene.bars.len();
        let all = AngleConstraint::all(scene);
        let mut groups = Groups::of(bars + 1);
        let mut at_body = vec![Vec::new(); bars + 1];
        for (number, angle_constraint) in all.iter().enumerate() {
            if !groups.join(angle_constraint.base, angle_constraint.bar) {
                return Err(number);
            }
            at_body[angle_constraint.base].push(number);
            at_body[angle_constraint.bar].push(number);
        }
        let mut members = vec![Vec::new(); bars + 1];
        for bar in 0..bars {
            members[groups.find(body(Some(bar)))].push(bar);
        }
        members[groups.find(body(None))].clear();
        members.retain(|group| !group.is_empty());
        members.sort_by_key(|group| group[0]);
        Ok(Self { all, at_body, groups: members })
    }

    /// True for a bar that a tie turns; one that a tie only measures from is not.
    fn driven(&self, bar: usize) -> bool {
        let bar = body(Some(bar));
        self.at_body[bar].iter().any(|&number| self.all[number].bar == bar)
    }

    /// Carries `part` of the start of `from` along the ties to all bodies that have none yet.
    fn spread(&self, from: usize, part: Part, start: &mut [Option<f64>]) {
        let mut open = vec![from];
        while let Some(here) = open.pop() {
            let Some(known) = start[here] else { continue };
            for &number in &self.at_body[here] {
                let angle_constraint = &self.all[number];
                let law = part(&angle_constraint.law);
                let (to, there) = if here == angle_constraint.base {
                    (angle_constraint.bar, known + law)
                } else {
                    (angle_constraint.base, known - law)
                };
                if start[to].is_none() {
                    start[to] = Some(there);
                    open.push(to);
                }
            }
        }
    }

    /// `part` of the start of every bar.  In a group of tied bars all follow from one: a bar that no tie
    /// turns if it is given, else the first that is.
    fn resolved(&self, bars: usize, part: Part, given: &dyn Fn(usize) -> Option<f64>) -> Vec<f64> {
        let mut start = vec![None; bars + 1];
        start[0] = Some(0.0);
        self.spread(0, part, &mut start);
        for group in &self.groups {
            let turned = |bar: &usize| group.len() > 1 && self.driven(*bar);
            let known = group.iter().copied().filter(|&bar| given(bar).is_some()).min_by_key(turned);
            if let Some(one) = known.or_else(|| group.iter().copied().min_by_key(turned)) {
                start[body(Some(one))] = Some(given(one).unwrap_or(0.0));
                self.spread(body(Some(one)), part, &mut start);
            }
        }
        start.into_iter().skip(1).map(|value| value.unwrap_or(0.0)).collect()
    }

    /// Refuses a start of which nothing tells a part; the hint names all such parts.
    fn known_whole(&self, scene: &Scene, root: &At, given: &[Option<GivenStart>]) -> Result<(), SceneError> {
        let mut first = None;
        let mut entries = Vec::new();
        for group in &self.groups {
            let of = |&bar: &usize| given[bar].as_ref().map(|given| (bar, given));
            if group.iter().filter_map(of).any(|(_, given)| given.is_whole()) {
                continue;
            }
            let begun = group.iter().find_map(of);
            let free = group.iter().copied().min_by_key(|&bar| self.driven(bar)).unwrap_or(group[0]);
            let name = &scene.bars[begun.map_or(free, |(bar, _)| bar)].name;
            let is_open =
                |value: fn(&GivenStart) -> Option<f64>| begun.is_none_or(|(_, given)| value(given).is_none());
            let open = [("phi", is_open(|given| given.phi)), ("omega", is_open(|given| given.omega))];
            let keys: Vec<&str> = open.iter().filter(|(_, is_open)| *is_open).map(|(key, _)| *key).collect();
            let values: Vec<String> = keys.iter().map(|key| format!("\"{key}\": 0")).collect();
            entries.push(format!("\"{name}\": {{{}}}", values.join(", ")));
            if first.is_none() {
                first = Some(match begun {
                    Some((_, given)) => given.fields.required(keys[0]).err(),
                    None => Some(missing_start(root, name, group.len() > 1)),
                });
            }
        }
        match first.flatten() {
            Some(error) if entries.len() > 1 => Err(error.with_hint(format!(
                "{} bars have no whole start; add \"start\": {{{}}}, with values for 0; only bars that a \
                    motor drives or a lock holds may be left out",
                entries.len(),
                entries.join(", ")
            ))),
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}

impl GivenStart<'_> {
    fn is_whole(&self) -> bool {
        self.phi.is_some() && self.omega.is_some()
    }
}

/// Angle and rate of each bar at t = 0, and what of it the file gives: as given, or by the law of a motor or
/// the angle of a lock, or 0 where the rest may be found later; an empty second list where it may not
/// (`whole`).
pub(super) fn starts(
    scene: &Scene,
    places: &Places,
    given: &[Option<GivenStart>],
    whole: bool,
) -> Result<(Vec<Start>, Vec<Given>), SceneError> {
    let motors = scene.motors.iter().zip(places.motors).filter(|(motor, _)| !scene.is_inactive(&motor.name));
    let locks = (scene.locks.iter().zip(places.locks))
        .filter(|(lock, _)| lock.angle.is_some() && !scene.is_inactive(&lock.name));
    let of_rows: Vec<&At> = motors.map(|(_, at)| at).chain(locks.map(|(_, at)| at)).collect();
    let place = |number: usize| of_rows[number];
    let angle_constraints = AngleConstraints::of(scene).map_err(|number| {
        let AngleConstraint { kind, name, .. } = AngleConstraint::all(scene).swap_remove(number);
        let does = if kind == "motor" { "drives" } else { "holds" };
        let problem = format!("({kind} `{name}`) {does} an angle that is given already");
        let hint = "leave out one of the motors and locks that share these bars";
        place(number).refuse(&problem, "the other motors and locks must leave it free", hint)
    })?;
    if whole {
        angle_constraints.known_whole(scene, places.root, given)?;
    }
    // Where all must be known, both numbers of a group are those of the same bar.
    let usable = |bar: usize| given[bar].as_ref().filter(|given| !whole || given.is_whole());
    let phi = angle_constraints.resolved(scene.bars.len(), |start| start.phi, &|bar| usable(bar)?.phi);
    let omega = angle_constraints.resolved(scene.bars.len(), |start| start.omega, &|bar| usable(bar)?.omega);
    let start: Vec<Start> = phi.into_iter().zip(omega).map(|(phi, omega)| Start { phi, omega }).collect();
    for (bar, exact) in start.iter().enumerate() {
        let Some(&by) = angle_constraints.at_body[body(Some(bar))].first() else { continue };
        let angle_constraint @ AngleConstraint { kind, name, .. } = &angle_constraints.all[by];
        if !ANGLE.holds(exact.phi) || !RATE.holds(exact.omega) {
            let bar = &scene.bars[bar].name;
            let problem = format!(
                "({kind} `{name}`) starts bar `{bar}` at {} rad, {} rad/s",
                about(exact.phi),
                about(exact.omega)
            );
            let allowed = format!("a start must be {ANGLE} and {RATE}");
            return Err(place(by).refuse(&problem, &allowed, "take off whole turns, and check the rates"));
        }
        if let Some(given) = &given[bar] {
            agrees(given, "phi", given.phi, exact.phi, "rad", angle_constraint)?;
            agrees(given, "omega", given.omega, exact.omega, "rad/s", angle_constraint)?;
        }
    }
    let mut said: Vec<Given> = if whole { Vec::new() } else { given.iter().map(said).collect() };
    while said.last() == Some(&Given::ANGLE_AND_RATE) {
        said.pop();
    }
    Ok((start, said))
}

/// What an entry of the file gives.
fn said(given: &Option<GivenStart>) -> Given {
    match given {
        None => Given { phi: false, omega: false, origin: None, velocity: None },
        Some(given) => Given {
            phi: given.phi.is_some(),
            omega: given.omega.is_some(),
            origin: given.origin,
            velocity: given.velocity,
        },
    }
}

/// True for each bar whose start must be written so that all starts read back to the same bits, where all are
/// known: of bars that motors and locks tie to each other only the one that the others were computed from.
pub(in crate::scene) fn written_starts(scene: &Scene) -> Vec<bool> {
    let start = &scene.start;
    let mut written = vec![true; start.len()];
    let Ok(angle_constraints) = AngleConstraints::of(scene) else { return written };
    for group in angle_constraints.groups.iter().filter(|group| group.len() > 1) {
        let gives_all = |&bar: &usize| {
            let parts: [Part; 2] = [|start| start.phi, |start| start.omega];
            parts.into_iter().all(|part| {
                let mut trial = vec![None; start.len() + 1];
                trial[body(Some(bar))] = Some(part(&start[bar]));
                angle_constraints.spread(body(Some(bar)), part, &mut trial);
                group.iter().all(|&other| trial[body(Some(other))] == Some(part(&start[other])))
            })
        };
        if let Some(one) = group.iter().copied().find(gives_all) {
            group.iter().for_each(|&bar| written[bar] = bar == one);
        }
    }
    written
}

fn missing_start(root: &At, bar: &str, tied: bool) -> SceneError {
    let hint = if tied {
        format!(
            "its motors and locks only tie it to other bars; add \"start\": {{\"{bar}\": {{\"phi\": 0, \
                \"omega\": 0}}}} or that of one of those"
        )
    } else {
        format!(
            "add \"start\": {{\"{bar}\": {{\"phi\": 0, \"omega\": 0}}}}; only bars that a motor drives or a \
                lock holds may be left out"
        )
    };
    root.missing("start", bar, "must be {\"phi\": angle in rad, \"omega\": rate in rad/s}", &hint)
}

fn agrees(
    at: &GivenStart,
    key: &str,
    given: Option<f64>,
    exact: f64,
    unit: &str,
    angle_constraint: &AngleConstraint,
) -> Result<(), SceneError> {
    let Some(given) = given.filter(|given| (given - exact).abs() > SAME * exact.abs().max(1.0)) else {
        return Ok(());
    };
    let by = if angle_constraint.kind == "motor" { "the law of motor" } else { "lock" };
    let allowed = format!("must be {exact:?} {unit}, by {by} `{}`", angle_constraint.name);
    let turns = (given - exact) / std::f64::consts::TAU;
    let hint = if unit == "rad" && turns.abs() >= 0.5 && (turns - turns.round()).abs() < 1e-9 {
        format!(
            "leave it out, or write {exact:?}; angles are not taken modulo a turn, and this one is \
                {turns:.0} turns off"
        )
    } else {
        format!("leave the bar out of \"start\", or write {exact:?}")
    };
    Err(at.fields.required(key)?.refuse_value(&allowed, &hint))
}

impl Law {
    /// Angle \[rad\] and rate \[rad/s\] at t = 0.
    pub fn at_start(&self) -> Start {
        let mut start = Start { phi: self.start, omega: self.rate };
        for sine in &self.sines {
            start.phi += sine.amplitude * libm::sin(sine.phase);
            start.omega += sine.amplitude * sine.frequency * libm::cos(sine.phase);
        }
        if let Some(profile) = &self.profile {
            let [phi, omega, _] = profile.at(0.0);
            start = Start { phi: start.phi + phi, omega: start.omega + omega };
        }
        start
    }
}
