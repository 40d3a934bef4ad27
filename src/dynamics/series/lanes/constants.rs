//! The terms of a hinge tree with a constant for each lane: trajectories of mechanisms that differ in their
//! numbers alone.
//!
//! What is a constant of the equations is listed in one order; a mechanism is its structure, and that list.

use super::super::Terms;
use super::super::rows::RowMeasures;
use super::number::InLanes;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::EightLanes;
use crate::arithmetic::{Complex, Real};
use crate::dynamics::Mechanism;
use crate::dynamics::constraint::{ConstraintEquation, RowMeasure};
use crate::dynamics::force::action::Applied;
use crate::dynamics::force::{AppliedAction, CompiledSpring, Torsion, UserForce};
use crate::dynamics::impact::Contact;
use crate::dynamics::law::{Law, Sine};
use crate::dynamics::partition::CoordinatePartition;
use crate::dynamics::point::Point;
use crate::dynamics::quadratic::Quadratic;
use crate::dynamics::tree::Tree;
use std::sync::Arc;

/// All terms of a mechanism with constants of the kind `C`.
#[derive(Debug, PartialEq)]
pub struct TermSet<C> {
    tree: Tree<C>,
    partition: CoordinatePartition<C>,
    springs: Vec<CompiledSpring<C>>,
    torsions: Vec<Torsion<C>>,
    actions: Vec<AppliedAction<C>>,
    forces: Vec<UserForce<C>>,
    constraints: Vec<ConstraintEquation<C>>,
}

impl<C: Real> TermSet<C> {
    /// Those of a mechanism, with what `of` makes of its constants, one after the other.
    fn map(mechanism: &Mechanism, mut of: impl FnMut(f64) -> C) -> Self {
        let of = &mut of;
        Self {
            tree: tree(&mechanism.tree, of),
            partition: mechanism.partition.map(|law_of| law(law_of, of)),
            springs: mechanism.springs.iter().map(|one| spring(one, of)).collect(),
            torsions: mechanism.torsions.iter().map(|one| torsion(one, of)).collect(),
            actions: mechanism.actions.iter().map(|one| action(one, of)).collect(),
            forces: mechanism
                .forces
                .iter()
                .map(|one| one.map(&mut *of, |site, mut of| point(site, &mut of)))
                .collect(),
            constraints: mechanism.constraints.iter().map(|one| equation(one, of)).collect(),
        }
    }

    /// With the structure of a mechanism.
    pub fn terms<'a>(&'a self, structure: &'a Mechanism) -> Terms<'a, C> {
        let Self { tree, partition, springs, torsions, actions, forces, constraints } = self;
        // Lanes take no dry friction.
        let friction = None;
        Terms { structure, tree, partition, springs, torsions, actions, forces, constraints, friction }
    }
}

/// True for mechanisms with the same terms and walls: what starts and energies are measured by may differ.
pub fn are_equal(one: &Mechanism, other: &Mechanism) -> bool {
    (&one.tree, &one.partition, &one.springs) == (&other.tree, &other.partition, &other.springs)
        && (&one.constraints, &one.forces) == (&other.constraints, &other.forces)
        && (&one.torsions, &one.actions) == (&other.torsions, &other.actions)
        && one.contacts == other.contacts
        && one.assembly.redundant == other.assembly.redundant
}

/// A mechanism without its redundant rows as lanes take it: its constants, and what they are constants of.
#[derive(Debug)]
pub struct OwnNumbers {
    /// All constants in their order, and what rows are measured with where there are multipliers.
    constants: Vec<f64>,
    pub(super) measures: Option<RowMeasures>,
    /// Terms and walls with ones for all constants that are not zero, and the redundant rows.
    terms: TermSet<f64>,
    walls: Vec<(ConstraintEquation, Option<usize>, bool)>,
    redundant: Vec<String>,
}

impl OwnNumbers {
    /// Those of a mechanism.
    pub fn of(mechanism: &Mechanism) -> Self {
        let redundant = mechanism.assembly.redundant.clone();
        let mechanism = &*mechanism.without_redundant_rows();
        let mut constants = Vec::new();
        let mut of = |constant: f64| if constant == 0.0 { 0.0 } else { 1.0 };
        let terms = TermSet::map(mechanism, |constant| {
            constants.push(constant);
            of(constant)
        });
        let wall = |wall: &Contact| (equation(&wall.row, &mut of), wall.on, wall.is_off);
        Self {
            constants,
            measures: mechanism.has_multipliers().then(|| RowMeasures::of(mechanism)),
            terms,
            walls: mechanism.contacts.iter().map(wall).collect(),
            redundant,
        }
    }

    /// True for mechanisms that differ in their constants alone, of which the same are zero, as the same rows
    /// follow from others.
    pub fn are_alike(&self, other: &Self) -> bool {
        (&self.terms, &self.walls, &self.redundant) == (&other.terms, &other.walls, &other.redundant)
    }
}

/// The constants of eight mechanisms of one structure.
#[derive(Clone, Debug)]
pub struct LaneConstants(Vec<Octet>);

impl LaneConstants {
    /// Those of one mechanism in all lanes.
    pub fn of(own: &OwnNumbers) -> Self {
        Self(own.constants.iter().copied().map(Octet::splat).collect())
    }

    /// Puts those of a mechanism into a lane; tells whether they are others.
    pub fn put(&mut self, lane: usize, own: &OwnNumbers) -> bool {
        let mut are_others = false;
        for (octet, &constant) in self.0.iter_mut().zip(&own.constants) {
            are_others |= octet.0[lane] != constant;
            octet.0[lane] = constant;
        }
        are_others
    }

    /// The terms with these constants.
    pub fn terms<W: EightLanes>(&self, like: &Mechanism) -> TermSet<InLanes<W>> {
        let mut constants = self.0.iter();
        TermSet::map(like, |constant| {
            InLanes(constants.next().map_or_else(|| W::splat(constant), |octet| W::of(&octet.0)))
        })
    }
}

/// The law of every lane.
pub fn laws<W: EightLanes>(law: &Law<InLanes<W>>) -> [Law; LANES] {
    let [start, rate, acceleration] = [law.start, law.rate, law.acceleration].map(|x| x.0.array());
    std::array::from_fn(|lane| Law {
        start: start[lane],
        rate: rate[lane],
        acceleration: acceleration[lane],
        sines: law.sines.iter().map(|sine| sine_of(sine, lane)).collect(),
        profile: law.profile.as_ref().map(|profile| profile.map_numbers(|x| x.0.array()[lane])),
    })
}

/// A sine of a lane.
pub fn sine_of<W: EightLanes>(sine: &Sine<InLanes<W>>, lane: usize) -> Sine {
    let [amplitude, frequency, phase] =
        [sine.amplitude, sine.frequency, sine.phase].map(|x| x.0.array()[lane]);
    Sine { amplitude, frequency, phase }
}

fn vector<C>(value: Complex<f64>, of: &mut impl FnMut(f64) -> C) -> Complex<C> {
    let re = of(value.re);
    Complex { re, im: of(value.im) }
}

fn vectors<C>(values: &[Complex<f64>], of: &mut impl FnMut(f64) -> C) -> Vec<Complex<C>> {
    values.iter().map(|&value| vector(value, of)).collect()
}

fn tree<C>(tree: &Tree, of: &mut impl FnMut(f64) -> C) -> Tree<C> {
    Tree {
        coordinates: tree.coordinates,
        angles: tree.angles,
        coupling: vectors(&tree.coupling, of),
        diagonal: tree.diagonal.iter().map(|&x| of(x)).collect(),
        weight: vectors(&tree.weight, of),
        off_axis: tree.off_axis,
    }
}

fn law<C>(law: &Law, of: &mut impl FnMut(f64) -> C) -> Law<C> {
    Law {
        start: of(law.start),
        rate: of(law.rate),
        acceleration: of(law.acceleration),
        sines: (law.sines.iter())
            .map(|sine| Sine {
                amplitude: of(sine.amplitude),
                frequency: of(sine.frequency),
                phase: of(sine.phase),
            })
            .collect(),
        profile: law.profile.as_ref().map(|profile| profile.map_numbers(|&x| of(x))),
    }
}

fn point<C>(point: &Point, of: &mut impl FnMut(f64) -> C) -> Point<C> {
    Point {
        root: vector(point.root, of),
        terms: point.terms.iter().map(|&(k, gamma)| (k, vector(gamma, of))).collect(),
        shifts: point.shifts.clone(),
    }
}

fn spring<C>(spring: &CompiledSpring, of: &mut impl FnMut(f64) -> C) -> CompiledSpring<C> {
    CompiledSpring {
        name: spring.name.clone(),
        bodies: spring.bodies,
        span: point(&spring.span, of),
        stiffness: of(spring.stiffness),
        free_length: of(spring.free_length),
        damping: of(spring.damping),
    }
}

fn torsion<C>(torsion: &Torsion, of: &mut impl FnMut(f64) -> C) -> Torsion<C> {
    Torsion {
        name: torsion.name.clone(),
        body: torsion.body,
        base: torsion.base,
        stiffness: of(torsion.stiffness),
        free_angle: of(torsion.free_angle),
        damping: of(torsion.damping),
    }
}

fn action<C>(action: &AppliedAction, of: &mut impl FnMut(f64) -> C) -> AppliedAction<C> {
    let kind = match &action.kind {
        Applied::Force { point: at, force, follows } => {
            Applied::Force { point: point(at, of), force: vector(*force, of), follows: *follows }
        }
        Applied::Torque { torque, base } => Applied::Torque { torque: of(*torque), base: *base },
    };
    let law = action.law.as_ref().map(|one| law(one, of));
    AppliedAction { name: action.name.clone(), body: action.body, kind, law }
}

fn equation<C>(row: &ConstraintEquation, of: &mut impl FnMut(f64) -> C) -> ConstraintEquation<C> {
    let measure = match &row.measure {
        &RowMeasure::Angle { body, base } => RowMeasure::Angle { body, base },
        RowMeasure::Place(place) => RowMeasure::Place(Quadratic {
            angles: place.angles,
            constant: of(place.constant),
            linear: place.linear.iter().map(|&(k, g)| (k, vector(g, of))).collect(),
            bilinear: place.bilinear.iter().map(|&(j, k, h)| (j, k, vector(h, of))).collect(),
        }),
    };
    let law = row.law.as_ref().map(|one| law(one, of));
    let aim = row.aim.as_ref().map(|aim| Arc::new(aim.map(&mut *of)));
    // What a row pushes is asked of the mechanism.
    ConstraintEquation { name: row.name.clone(), measure, law, push: None, aim }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::lanes::wide::{Vectors, WideCode};
    use crate::scene::{Override, parse_scene};

    fn mechanism(set: &[&str]) -> Mechanism {
        let text = r#"{"name": "two", "gravity": [9.81, 0], "bars": [
            {"name": "a", "length": 0.5, "width": 0.05, "thickness": 0.003, "density": 670},
            {"name": "b", "length": 0.4, "width": 0.05, "thickness": 0.003, "density": 700}],
            "hinges": [
                {"name": "h", "between": [
                    {"body": "ground", "point": [0, 0]}, {"body": "a", "point": [0, 0]}]},
                {"name": "k", "between": [
                    {"body": "a", "point": [0.5, 0]}, {"body": "b", "point": [0, 0]}]}],
            "torsion_springs": [{"name": "t", "body": "b", "relative_to": "a", "stiffness": 0.3,
                "free_angle": 0.2, "damping": 0}],
            "parameters": {"k": 0.3}, "torques": [{"name": "p", "body": "b", "torque": "k*sin(2*b.phi) + k"}],
            "motors": [{"name": "m", "body": "a", "law": {"start": 1, "rate": 2,
                "sines": [{"amplitude": 0.1, "frequency": 3, "phase": 0}]}}],
            "start": {"b": {"phi": 1.0, "omega": 0}}, "until": 1, "every": 1}"#;
        let overrides: Vec<Override> = set.iter().map(|set| set.parse().expect("an override")).collect();
        Mechanism::new(&parse_scene(text, "scene", &overrides).expect("a scene")).expect("a mechanism")
    }

    #[test]
    fn numbers_make_no_difference_to_the_structure_but_zeros_do() {
        let one = mechanism(&[]);
        let are_alike =
            |one: &Mechanism, other: &Mechanism| OwnNumbers::of(one).are_alike(&OwnNumbers::of(other));
        let others =
            ["bars.b.density=800", "motors.m.law.rate=3", "torsion_springs.t.stiffness=1", "parameters.k=2"];
        assert!(others.iter().all(|set| are_alike(&one, &mechanism(&[set]))));
        let zeros = ["gravity[0]=0", "torsion_springs.t.damping=0.1", "motors.m.law.rate=0"];
        assert!(zeros.iter().all(|set| !are_alike(&one, &mechanism(&[set]))));
    }

    struct RatesInLanes(LaneConstants, Mechanism);

    impl WideCode for RatesInLanes {
        type Output = ([f64; LANES], Vec<Law>);

        fn run<W: EightLanes>(self) -> Self::Output {
            let terms = self.0.terms::<W>(&self.1);
            let law = terms.constraints[0].law.as_ref().expect("a law");
            (terms.torsions[0].stiffness.0.array(), laws(law).to_vec())
        }
    }

    #[test]
    fn every_lane_has_its_own_numbers() {
        let (one, other) =
            (mechanism(&[]), mechanism(&["torsion_springs.t.stiffness=1", "motors.m.law.rate=3"]));
        let [first, second] = [&one, &other].map(OwnNumbers::of);
        let mut constants = LaneConstants::of(&first);
        assert!(!constants.put(2, &first) && constants.put(2, &second) && !constants.put(2, &second));
        let (stiffness, laws) = Vectors::Portable.run(RatesInLanes(constants, one.clone()));
        for lane in 0..LANES {
            let own = if lane == 2 { &other } else { &one };
            assert_eq!(stiffness[lane], own.torsions[0].stiffness);
            assert_eq!(Some(&laws[lane]), own.constraints[0].law.as_ref());
        }
    }
}
