//! Whether a scene put together by hand makes sense.
//!
//! Scenes that were read are sound; this guards the equations against scenes whose fields were changed
//! afterwards or filled in by a program.  What is checked of files is checked by the reader, who reads the
//! scene as it would be written; here stand only faults that cannot be written.

use super::format::{FieldShape, START};
use super::{Coupled, Friction, FrictionPlace, Given, Law, Load, LoadLaw, Place, Refusal, Scene, Start};
use serde_json::Map;
use std::collections::HashSet;

impl Scene {
    /// The first thing that makes no sense, if any: the path of a field as in scene files, what is wrong with
    /// it, and what is allowed.
    pub fn fault(&self) -> Option<String> {
        self.broken_reference()
            .or_else(|| self.faulty_time())
            .or_else(|| self.faulty_start())
            .or_else(|| self.faulty_rotor())
            .or_else(|| self.faulty_law())
            .or_else(|| self.faulty_direction())
            .or_else(|| self.faulty_friction())
            .or_else(|| self.doubled_name())
            .or_else(|| self.refused_as_file())
    }

    /// A bar, slider or list that is not there, without which nothing can be compiled.
    pub(crate) fn broken_reference(&self) -> Option<String> {
        let bars = self.bars.len();
        if bars == 0 {
            return Some("bars: there is none".into());
        }
        if self.start.len() != bars {
            return Some(format!("start: {} entries for {bars} bars", self.start.len()));
        }
        let own = bars.saturating_sub(self.integrals.len());
        let rotors = self.integrals.iter().enumerate();
        if let Some((i, rotor)) = rotors.clone().find(|(i, integral)| integral.bar != own + i) {
            let wanted = own + i;
            return Some(format!("integrals[{i}].bar = {}: its rotor must be bar {wanted}", rotor.bar));
        }
        let sliders = self.sliders.len();
        let travels = self.couplings.iter().enumerate().filter_map(|(i, part)| match part.coupled {
            Coupled::Travel(slider) => Some(("couplings", i, slider)),
            Coupled::Angle { .. } => None,
        });
        let slides = self.drives.iter().enumerate().map(|(i, drive)| ("drives", i, drive.slider));
        let bodies = self.bodies();
        let mut wrong_bodies = bodies.iter().flat_map(|(list, of)| {
            let wrong = move |(i, bodies): (usize, &Vec<Option<usize>>)| {
                let body = bodies.iter().flatten().find(|&&body| body >= bars)?;
                Some(format!("{list}[{i}]: bar number {body} of {bars}"))
            };
            of.iter().enumerate().filter_map(wrong)
        });
        wrong_bodies.next().or_else(|| {
            let (list, i, slider) = travels.chain(slides).find(|part| part.2 >= sliders)?;
            Some(format!("{list}[{i}]: slider number {slider} of {sliders}"))
        })
    }

    /// The bodies of all parts, list by list; `None` for the ground.
    fn bodies(&self) -> Vec<(&'static str, Vec<Vec<Option<usize>>>)> {
        let pair = |between: &[Place; 2]| between.iter().map(|place| place.bar).collect::<Vec<_>>();
        let of_law = |load: &Load| match load {
            Load::Force { bar, .. } => vec![Some(*bar)],
            Load::Torque { bar, relative_to, .. } | Load::TorsionSpring { bar, relative_to, .. } => {
                vec![Some(*bar), *relative_to]
            }
            Load::Spring { between, .. } => pair(between),
            Load::Potential { .. } => Vec::new(),
        };
        let of_coupling = |coupled: &Coupled| match *coupled {
            Coupled::Angle { bar, relative_to } => vec![Some(bar), relative_to],
            Coupled::Travel(_) => Vec::new(),
        };
        let coils = self.torsion_springs.iter().map(|part| vec![Some(part.bar), part.relative_to]);
        vec![
            ("hinges", self.hinges.iter().map(|part| pair(&part.between)).collect()),
            ("welds", self.welds.iter().map(|part| pair(&part.between)).collect()),
            ("sliders", self.sliders.iter().map(|part| vec![part.point.bar, part.rail.place.bar]).collect()),
            ("locks", self.locks.iter().map(|part| vec![Some(part.bar), part.relative_to]).collect()),
            ("springs", self.springs.iter().map(|part| pair(&part.between)).collect()),
            ("torsion_springs", coils.collect()),
            ("forces", self.forces.iter().map(|part| vec![Some(part.bar)]).collect()),
            ("torques", self.torques.iter().map(|part| vec![Some(part.bar), part.relative_to]).collect()),
            ("motors", self.motors.iter().map(|part| vec![Some(part.bar), part.relative_to]).collect()),
            ("couplings", self.couplings.iter().map(|part| of_coupling(&part.coupled)).collect()),
            ("walls", self.walls.iter().map(|part| vec![Some(part.bar), part.on]).collect()),
            ("points", self.points.iter().map(|part| vec![part.place.bar]).collect()),
            ("laws", self.laws.iter().map(|part| of_law(&part.load)).collect()),
        ]
    }

    /// A horizon or an output interval that is none.
    fn faulty_time(&self) -> Option<String> {
        let is_time = |time: f64| time > 0.0 && time.is_finite();
        let wrong = !is_time(self.until) || !is_time(self.every);
        wrong.then(|| "until, every: both must be positive and finite".into())
    }

    /// A number of the start that a file may not have.
    fn faulty_start(&self) -> Option<String> {
        let holds = |key: &str, numbers: &[f64]| match START.field(key).map(|field| &field.shape) {
            Some(FieldShape::Number(range) | FieldShape::Pair(range)) => {
                numbers.iter().all(|&number| range.holds(number))
            }
            _ => false,
        };
        let is_start = |&Start { phi, omega }: &Start| holds("phi", &[phi]) && holds("omega", &[omega]);
        let is_given = |Given { origin, velocity, .. }: &Given| {
            origin.is_none_or(|origin| holds("origin", &origin))
                && velocity.is_none_or(|velocity| holds("velocity", &velocity))
        };
        if self.given.len() > self.bars.len() {
            return Some(format!("given: {} entries for {} bars", self.given.len(), self.bars.len()));
        }
        let start = self.start.iter().position(|start| !is_start(start)).map(|i| ("start", i));
        let given = || self.given.iter().position(|given| !is_given(given)).map(|i| ("given", i));
        let (list, i) = start.or_else(given)?;
        Some(format!("{list}[{i}]: a number is not finite or out of its range"))
    }

    /// An integral that is not what its rotor integrates.
    fn faulty_rotor(&self) -> Option<String> {
        let rotors = Scene { integrals: self.integrals.clone(), ..Self::default() }.with_rotors();
        let own = self.own_bars();
        let is_rotor = |law: &&LoadLaw| matches!(law.load, Load::Torque { bar, .. } if bar >= own);
        let torques = self.laws.iter().filter(is_rotor);
        let is_same = self.bars[own..] == rotors.bars
            && self.hinges[self.own_hinges()..] == rotors.hinges
            && torques.eq(&rotors.laws);
        (!is_same).then(|| {
            "integrals: each is carried by a rotor, the last of `bars` and `hinges`, and by a law of its \
                formula in `laws`; change all of them or the text of the scene"
                .into()
        })
    }

    /// A law with a number that is not finite.
    fn faulty_law(&self) -> Option<String> {
        let is_wrong = |law: &Law| {
            let sines = law.sines.iter().flat_map(|sine| [sine.amplitude, sine.frequency, sine.phase]);
            let profile = law.profile.iter().flat_map(|profile| profile.at(0.0));
            let mut numbers = [law.start, law.rate, law.acceleration].into_iter().chain(sines).chain(profile);
            numbers.any(|number| !number.is_finite())
        };
        let laws = (self.motors.iter().map(|part| (&part.name, Some(&part.law))))
            .chain(self.drives.iter().map(|part| (&part.name, Some(&part.law))))
            .chain(self.forces.iter().map(|part| (&part.name, part.law.as_ref())))
            .chain(self.torques.iter().map(|part| (&part.name, part.law.as_ref())))
            .chain(self.walls.iter().map(|part| (&part.name, part.law.as_ref())));
        let mut laws = laws.filter_map(|(name, law)| Some((name, law?)));
        laws.find(|(_, law)| is_wrong(law)).map(|(name, _)| format!("law of {name}: a number is not finite"))
    }

    /// A direction that is no unit vector: the reader makes it one.
    fn faulty_direction(&self) -> Option<String> {
        let is_unit = |v: [f64; 2]| (v[0].hypot(v[1]) - 1.0).abs() < 1e-6;
        let rails = self.sliders.iter().position(|slider| !is_unit(slider.rail.direction));
        let walls = || self.walls.iter().position(|wall| !is_unit(wall.normal));
        let rail = rails.map(|i| format!("sliders[{i}].rail.direction: must be a unit vector"));
        rail.or_else(|| Some(format!("walls[{}].normal: must be a unit vector", walls()?)))
    }

    /// Friction of a part that is not there or has it already, which would not be written.
    fn faulty_friction(&self) -> Option<String> {
        let is_wrong = |(i, friction): (usize, &Friction)| {
            let is_there = match friction.at {
                FrictionPlace::Hinge { hinge, .. } => hinge < self.own_hinges(),
                FrictionPlace::Slider(slider) => slider < self.sliders.len(),
                FrictionPlace::Wall { wall, .. } => wall < self.walls.len(),
            };
            !is_there || self.frictions[..i].iter().any(|other| other.at.part() == friction.at.part())
        };
        let wrong = self.frictions.iter().enumerate().position(is_wrong)?;
        Some(format!("frictions[{wrong}]: no such part, or twice the same one"))
    }

    /// A name that stands twice where scene files have it as a key.
    fn doubled_name(&self) -> Option<String> {
        let lists: [(_, Vec<&String>); 5] = [
            ("parameters", self.parameters.iter().map(|one| &one.name).collect()),
            ("tables", self.tables.iter().map(|one| &one.name).collect()),
            ("signals", self.signals.iter().map(|one| &one.name).collect()),
            ("integrals", self.integrals.iter().map(|one| &one.name).collect()),
            ("outputs", self.outputs.iter().map(|one| &one.name).collect()),
        ];
        let set = (self.events.iter())
            .map(|event| ("parameters set by an event", event.set.iter().map(|one| &one.0).collect()));
        lists.into_iter().chain(set).find_map(|(list, names)| {
            let mut known = HashSet::new();
            let twice = names.into_iter().find(|name| !known.insert(*name))?;
            Some(format!("{list}: `{twice}` is there twice; names must be different"))
        })
    }

    /// What the reader refuses the scene for, but for its start.
    fn refused_as_file(&self) -> Option<String> {
        let error = super::read::judge_parts(&self.with_start(Map::new()).to_string()).err()?;
        let Refusal { path, value, problem, allowed, hint, .. } = error.refusal();
        // JSON has no other numbers.
        let problem = if value.as_deref() == Some("null") { "is not finite" } else { problem };
        Some(format!("{path} {problem}: {allowed}; {hint}"))
    }
}
