//! Whether a scene put together by hand makes sense: numbers of bars that exist, numbers that are finite.
//!
//! Scenes that were read are sound; this guards the equations against scenes whose fields were changed
//! afterwards or filled in by a program.

mod names;

use super::format::WIDEST_ANGLE;
use super::{Coupled, Friction, FrictionPlace, Law, Place, Scene};

impl Scene {
    /// The first thing that makes no sense, if any: the path of a field, and what is wrong with it.
    pub fn fault(&self) -> Option<String> {
        let bars = self.bars.len();
        if bars == 0 {
            return Some("bars: there is none".into());
        }
        if self.start.len() != bars {
            return Some(format!("start: {} entries for {bars} bars", self.start.len()));
        }
        self.faulty_number()
            .or_else(|| self.faulty_body(bars))
            .or_else(|| self.faulty_name())
            .or_else(|| self.faulty_law())
            .or_else(|| self.faulty_friction())
    }

    /// A bar, slider or list that is not there.
    fn faulty_body(&self, bars: usize) -> Option<String> {
        let all = |list: &'static str, of: Vec<Vec<Option<usize>>>| {
            let wrong = |(i, bodies): (usize, Vec<Option<usize>>)| {
                let body = bodies.into_iter().flatten().find(|&body| body >= bars)?;
                Some(format!("{list}[{i}]: bar number {body} of {bars}"))
            };
            of.into_iter().enumerate().find_map(wrong)
        };
        let pair = |between: &[Place; 2]| between.iter().map(|place| place.bar).collect::<Vec<_>>();
        let lists = [
            ("hinges", self.hinges.iter().map(|part| pair(&part.between)).collect()),
            ("welds", self.welds.iter().map(|part| pair(&part.between)).collect()),
            ("sliders", self.sliders.iter().map(|part| vec![part.point.bar, part.rail.place.bar]).collect()),
            ("locks", self.locks.iter().map(|part| vec![Some(part.bar), part.relative_to]).collect()),
            ("springs", self.springs.iter().map(|part| pair(&part.between)).collect()),
            (
                "torsion_springs",
                self.torsion_springs.iter().map(|part| vec![Some(part.bar), part.relative_to]).collect(),
            ),
            ("forces", self.forces.iter().map(|part| vec![Some(part.bar)]).collect()),
            ("torques", self.torques.iter().map(|part| vec![Some(part.bar), part.relative_to]).collect()),
            ("motors", self.motors.iter().map(|part| vec![Some(part.bar), part.relative_to]).collect()),
            (
                "couplings",
                (self.couplings.iter())
                    .map(|part| match part.coupled {
                        Coupled::Angle { bar, relative_to } => vec![Some(bar), relative_to],
                        Coupled::Travel(slider) => {
                            vec![self.sliders.get(slider).map_or(Some(usize::MAX), |_| None)]
                        }
                    })
                    .collect(),
            ),
            ("walls", self.walls.iter().map(|part| vec![Some(part.bar), part.on]).collect()),
        ];
        let own = |(i, between): (usize, Vec<Option<usize>>)| (between[0] == between[1]).then_some(i);
        let joined = self
            .hinges
            .iter()
            .map(|part| pair(&part.between))
            .chain(self.welds.iter().map(|part| pair(&part.between)));
        let to_itself = || {
            joined
                .enumerate()
                .find_map(own)
                .map(|i| format!("hinges and welds: number {i} joins a body to itself"))
        };
        let drives = || {
            let wrong = self.drives.iter().position(|drive| drive.slider >= self.sliders.len())?;
            Some(format!(
                "drives[{wrong}]: slider number {} of {}",
                self.drives[wrong].slider,
                self.sliders.len()
            ))
        };
        lists.into_iter().find_map(|(list, of)| all(list, of)).or_else(to_itself).or_else(drives)
    }

    /// A number that is not finite, or out of its range.
    fn faulty_number(&self) -> Option<String> {
        let finite = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
        let wrong = |list: &str, at: Option<usize>| {
            at.map(|i| format!("{list}[{i}]: a number is not finite or out of its range"))
        };
        if !finite(&self.gravity) {
            return Some("gravity: a number is not finite".into());
        }
        let is_time = |time: f64| time > 0.0 && time.is_finite();
        if !is_time(self.until) || !is_time(self.every) {
            return Some("until, every: both must be positive and finite".into());
        }
        let unit = |v: [f64; 2]| ((v[0] * v[0] + v[1] * v[1]).sqrt() - 1.0).abs() < 1e-6;
        let place = |place: &Place| finite(&place.point);
        let found = [
            wrong(
                "bars",
                self.bars.iter().position(|bar| {
                    !finite(&[bar.length, bar.mass, bar.centre[0], bar.centre[1], bar.inertia])
                        || bar.length < 0.0
                        || bar.mass <= 0.0
                        || bar.inertia < 0.0
                }),
            ),
            wrong(
                "start",
                (self.start.iter())
                    .position(|start| !finite(&[start.phi, start.omega]) || start.phi.abs() > WIDEST_ANGLE),
            ),
            wrong("hinges", self.hinges.iter().position(|part| !part.between.iter().all(place))),
            wrong("welds", self.welds.iter().position(|part| !part.between.iter().all(place))),
            wrong(
                "sliders",
                self.sliders.iter().position(|part| {
                    !place(&part.point) || !place(&part.rail.place) || !unit(part.rail.direction)
                }),
            ),
            wrong(
                "springs",
                self.springs.iter().position(|part| {
                    let numbers = [part.stiffness, part.free_length, part.damping];
                    !part.between.iter().all(place)
                        || !finite(&numbers)
                        || numbers.iter().any(|&number| number < 0.0)
                }),
            ),
            wrong(
                "torsion_springs",
                self.torsion_springs.iter().position(|part| {
                    !finite(&[part.stiffness, part.free_angle, part.damping])
                        || part.stiffness < 0.0
                        || part.damping < 0.0
                }),
            ),
            wrong("forces", self.forces.iter().position(|part| !finite(&part.point) || !finite(&part.force))),
            wrong("torques", self.torques.iter().position(|part| !part.torque.is_finite())),
            wrong(
                "walls",
                self.walls.iter().position(|part| {
                    !finite(&part.point)
                        || !finite(&part.through)
                        || !unit(part.normal)
                        || !(0.0..=1.0).contains(&part.restitution)
                }),
            ),
        ];
        found.into_iter().flatten().next()
    }

    /// Friction of a part that is not there or has it already, or with a number out of its range.
    fn faulty_friction(&self) -> Option<String> {
        let is_wrong = |(i, friction): (usize, &Friction)| {
            let Friction { at, kinetic, stiction } = friction;
            let is_there = match at {
                FrictionPlace::Hinge { hinge, radius } => {
                    *hinge < self.hinges.len() && *radius > 0.0 && radius.is_finite()
                }
                FrictionPlace::Slider(slider) => *slider < self.sliders.len(),
                FrictionPlace::Wall { wall, .. } => *wall < self.walls.len(),
            };
            let same = |other: &Friction| other.at.part() == at.part();
            let sound =
                (0.0..f64::INFINITY).contains(kinetic) && (*kinetic..f64::INFINITY).contains(stiction);
            !is_there || !sound || self.frictions[..i].iter().any(same)
        };
        let wrong = self.frictions.iter().enumerate().position(is_wrong)?;
        Some(format!("frictions[{wrong}]: no such part, twice the same one, or a number out of its range"))
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
}
