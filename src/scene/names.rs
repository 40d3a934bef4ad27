//! What the names in formulas of a scene stand for.

use super::formula::unit::Dimension;
use super::formula::{Formula, FormulaError, Interpolant};
use super::{Load, NamedPoint, Place, Scene};
use crate::arithmetic::Real;
use std::collections::HashMap;

/// What a name in a formula stands for; `P` is what points are given by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meaning<P = Place> {
    /// Time \[s\].
    Time,
    /// Parameter number k.
    Parameter(usize),
    /// Signal number k.
    Signal(usize),
    /// Angle of a bar \[rad\].
    Angle(usize),
    /// Its rate \[rad/s\].
    Rate(usize),
    /// Its cosine.
    Cosine(usize),
    /// Its sine.
    Sine(usize),
    /// First coordinate of a place \[m\].
    X(P),
    /// Second coordinate \[m\].
    Y(P),
    /// Velocities \[m/s\].
    XRate(P),
    /// Velocities \[m/s\].
    YRate(P),
    /// Distance of two places \[m\].
    Length([P; 2]),
    /// Its rate \[m/s\].
    LengthRate([P; 2]),
    /// Angle of a bar from another's \[rad\].
    RelativeAngle(usize, Option<usize>),
    /// Its rate \[rad/s\].
    RelativeRate(usize, Option<usize>),
}

impl<P> Meaning<P> {
    /// True for rates and velocities.
    fn is_rate(&self) -> bool {
        matches!(
            self,
            Self::Rate(_) | Self::XRate(_) | Self::YRate(_) | Self::LengthRate(_) | Self::RelativeRate(..)
        )
    }

    /// Its unit, as the format writes units; `rad` for angles.
    pub(super) fn unit_in_words(&self) -> &'static str {
        match self {
            Self::Angle(_) | Self::RelativeAngle(..) => "rad",
            _ => self.unit(),
        }
    }

    /// Its unit, as the format writes units.
    fn unit(&self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::X(_) | Self::Y(_) | Self::Length(_) => "m",
            Self::XRate(_) | Self::YRate(_) | Self::LengthRate(_) => "m/s",
            Self::Rate(_) | Self::RelativeRate(..) => "rad/s",
            _ => "",
        }
    }

    /// The same with points given otherwise.
    pub fn with_points<Q>(self, point: impl Fn(P) -> Q) -> Meaning<Q> {
        match self {
            Self::Time => Meaning::Time,
            Self::Parameter(number) => Meaning::Parameter(number),
            Self::Signal(number) => Meaning::Signal(number),
            Self::Angle(bar) => Meaning::Angle(bar),
            Self::Rate(bar) => Meaning::Rate(bar),
            Self::Cosine(bar) => Meaning::Cosine(bar),
            Self::Sine(bar) => Meaning::Sine(bar),
            Self::X(place) => Meaning::X(point(place)),
            Self::Y(place) => Meaning::Y(point(place)),
            Self::XRate(place) => Meaning::XRate(point(place)),
            Self::YRate(place) => Meaning::YRate(point(place)),
            Self::Length(places) => Meaning::Length(places.map(point)),
            Self::LengthRate(places) => Meaning::LengthRate(places.map(point)),
            Self::RelativeAngle(bar, base) => Meaning::RelativeAngle(bar, base),
            Self::RelativeRate(bar, base) => Meaning::RelativeRate(bar, base),
        }
    }
}

/// A formula whose names have found what they stand for.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound<C = f64> {
    /// The formula.
    pub formula: Formula,
    /// What its names stand for, in their order.
    pub meanings: Vec<Meaning<Place<C>>>,
}

/// The names that the formulas of a scene know.
#[derive(Clone, Debug, Default)]
pub struct Names<C = f64> {
    known: HashMap<String, (Meaning<Place<C>>, Option<Dimension>)>,
    /// Tables, as functions.
    tables: Vec<Interpolant>,
    /// For every signal what of time and rates is in it, and what of rates alone.
    changing: Vec<[Option<String>; 2]>,
    /// In the order in which messages list them.
    order: Vec<String>,
    /// Dimensions of integrals, as far as they are known.
    integrals: HashMap<String, Option<Dimension>>,
}

impl<C: Real> Names<C> {
    /// Those of a scene: time, bars, points, springs and parameters; signals are added one by one.
    pub fn of(scene: &Scene<C>) -> Self {
        let tables = scene.tables.iter().map(|table| {
            let points: Vec<_> = table.points.iter().map(|point| point.map(|x| x.value())).collect();
            Interpolant::new(&table.name, &points)
        });
        let mut names = Self { tables: tables.collect(), ..Self::default() };
        names.add("t".into(), Meaning::Time);
        for (number, parameter) in scene.parameters.iter().enumerate() {
            names.insert(parameter.name.clone(), Meaning::Parameter(number), None);
        }
        for integral in &scene.integrals {
            names.insert(integral.name.clone(), Meaning::Rate(integral.bar), None);
        }
        for (bar, name) in scene.bars[..scene.own_bars()].iter().map(|bar| &bar.name).enumerate() {
            names.add(format!("{name}.phi"), Meaning::Angle(bar));
            names.add(format!("{name}.omega"), Meaning::Rate(bar));
            names.add(format!("{name}.cos"), Meaning::Cosine(bar));
            names.add(format!("{name}.sin"), Meaning::Sine(bar));
        }
        for NamedPoint { name, place } in &scene.points {
            names.add(format!("{name}.x"), Meaning::X(*place));
            names.add(format!("{name}.y"), Meaning::Y(*place));
            names.add(format!("{name}.vx"), Meaning::XRate(*place));
            names.add(format!("{name}.vy"), Meaning::YRate(*place));
        }
        let springs = scene.springs.iter().map(|spring| (&spring.name, spring.between));
        let laws = scene.laws.iter().filter_map(|law| match &law.load {
            Load::Spring { between, .. } => Some((&law.name, *between)),
            _ => None,
        });
        for (name, between) in springs.chain(laws) {
            names.add(format!("{name}.length"), Meaning::Length(between));
            names.add(format!("{name}.rate"), Meaning::LengthRate(between));
        }
        names
    }

    /// The same with the signals of a scene that was judged.
    pub(super) fn with_signals(scene: &Scene<C>) -> Self {
        let mut names = Self::of(scene);
        for signal in &scene.signals {
            if let Ok((bound, dimension)) = names.alone().bind(&signal.formula) {
                names.signal(&signal.name, &bound, dimension);
            }
        }
        for integral in &scene.integrals {
            let rate = names.alone().bind(&integral.formula).ok().and_then(|bound| bound.1);
            let dimension = rate.map(|rate| rate.times(Dimension::of("s"), 1.0));
            names.integrals.insert(integral.name.clone(), dimension);
        }
        names
    }

    /// What a name stands for, and its dimension where that is known.
    pub(super) fn find(&self, name: &str) -> Option<(Meaning<Place<C>>, Option<Dimension>)> {
        self.known.get(name).copied()
    }

    /// The dimension of an integral, where that is known: what it integrates over time.
    pub(super) fn integral(&self, name: &str) -> Option<Option<Dimension>> {
        self.integrals.get(name).copied()
    }

    /// All names, in the order in which messages list them.
    pub(super) fn listed(&self) -> impl Iterator<Item = &str> {
        self.order.iter().map(String::as_str)
    }

    /// Tables, as functions.
    pub(super) fn tables(&self) -> &[Interpolant] {
        &self.tables
    }

    /// Adds a name.
    pub(super) fn add(&mut self, name: String, meaning: Meaning<Place<C>>) {
        self.insert(name, meaning, Some(Dimension::of(meaning.unit())));
    }

    fn insert(&mut self, name: String, meaning: Meaning<Place<C>>, dimension: Option<Dimension>) {
        if self.known.insert(name.clone(), (meaning, dimension)).is_none() {
            self.order.push(name);
        }
    }

    /// Adds the dimension of a parameter.
    pub(super) fn set_dimension(&mut self, name: &str, dimension: Option<Dimension>) {
        if let Some(known) = self.known.get_mut(name) {
            known.1 = dimension;
        }
    }

    /// Adds the next signal.
    pub fn signal(&mut self, name: &str, bound: &Bound<C>, dimension: Option<Dimension>) {
        let number = self.changing.len();
        let found = [self.changing(bound), self.rate_in(bound)];
        self.changing.push(found.map(|what| what.map(|what| format!("{name}, which depends on {what}"))));
        self.insert(name.to_owned(), Meaning::Signal(number), dimension);
    }

    /// The name in a formula that depends on time or rates, if any.
    pub fn changing(&self, bound: &Bound<C>) -> Option<String> {
        self.first(bound, 0, |meaning| matches!(meaning, Meaning::Time) || meaning.is_rate())
    }

    /// The name in a formula that depends on rates, if any.
    pub(super) fn rate_in(&self, bound: &Bound<C>) -> Option<String> {
        self.first(bound, 1, Meaning::is_rate)
    }

    /// The first name of that kind, `which` of what is known of signals.
    fn first(
        &self,
        bound: &Bound<C>,
        which: usize,
        is_kind: impl Fn(&Meaning<Place<C>>) -> bool,
    ) -> Option<String> {
        bound.formula.names().zip(&bound.meanings).find_map(|(name, meaning)| match meaning {
            Meaning::Signal(number) => self.changing[*number][which].clone(),
            meaning => is_kind(meaning).then(|| name.to_owned()),
        })
    }

    /// The same with the names that the formulas of a load have beside.
    pub fn within(&self, load: &Load<C>) -> Scope<'_, C> {
        let own = match *load {
            Load::Spring { between, .. } => {
                vec![("length", Meaning::Length(between)), ("rate", Meaning::LengthRate(between))]
            }
            Load::TorsionSpring { bar, relative_to, .. } => vec![
                ("angle", Meaning::RelativeAngle(bar, relative_to)),
                ("rate", Meaning::RelativeRate(bar, relative_to)),
            ],
            _ => Vec::new(),
        };
        Scope { names: self, own }
    }

    /// Names without any beside.
    pub fn alone(&self) -> Scope<'_, C> {
        Scope { names: self, own: Vec::new() }
    }
}

/// The names of a scene, and those that one formula has beside.
#[derive(Clone, Debug)]
pub struct Scope<'a, C = f64> {
    names: &'a Names<C>,
    own: Vec<(&'static str, Meaning<Place<C>>)>,
}

impl<C: Real> Scope<'_, C> {
    fn find(&self, name: &str) -> Option<(Meaning<Place<C>>, Option<Dimension>)> {
        let own = self.own.iter().find(|own| own.0 == name);
        own.map(|own| (own.1, Some(Dimension::of(own.1.unit())))).or_else(|| self.names.find(name))
    }

    /// Reads a formula, finds what its names stand for, and checks its dimensions.
    ///
    /// # Errors
    /// It is none, has a name that nothing has, or puts together what has different units.
    pub fn bind(&self, text: &str) -> Result<(Bound<C>, Option<Dimension>), FormulaError> {
        let formula = Formula::parse_with(text, &self.names.tables)?;
        let mut meanings = Vec::new();
        let mut dimensions = Vec::new();
        for name in formula.names() {
            let Some((meaning, dimension)) = self.find(name) else {
                let known =
                    self.names.order.iter().map(String::as_str).chain(self.own.iter().map(|own| own.0));
                return Err(formula.unknown(name, &known.collect::<Vec<_>>(), &self.names.tables));
            };
            meanings.push(meaning);
            dimensions.push(dimension);
        }
        let dimension = formula.dimension(&dimensions)?;
        Ok((Bound { formula, meanings }, dimension))
    }
}
