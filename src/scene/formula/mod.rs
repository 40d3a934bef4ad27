//! Formulas: texts as `-k*bar1.phi - 0.5*bar1.omega^2`, read once and evaluated over any scalar.
//!
//! Numbers (with units: `30 deg`, `5 mm`, `2 N*s/m`), names (with dots), `pi`, `+ - * / ^`, parentheses, the
//! functions of [`FUNCTIONS`], and comparisons inside `if(a < b, x, y)`.  `^` binds tightest and to the
//! right: `-2^2` is -4, `2^3^2` is 512.  Everything is SI, angles in radians.
//!
//! `abs`, `sign`, `min`, `max` and `if` have corners: a formula is smooth only while none of its
//! [`conditions`](Formula::conditions) changes sign.  Which branches hold is said from outside, so that a
//! method never steps across a corner unawares.

pub(crate) mod active;
mod branches;
mod error;
mod exact;
mod parse;
mod poles;
mod sign;
mod table;
pub mod unit;
mod wave;

use branches::{Branches, BySign, GivenBranches, Noted, WatchedBranches};
pub use error::FormulaError;
pub(crate) use error::meant;
pub(crate) use exact::Numbers;
pub(crate) use poles::Pole;
pub use table::{Interpolant, POINTS};
use unit::{Dimension, Mismatch};

use crate::arithmetic::Scalar;
use crate::arithmetic::scratch::with_copies;
use crate::scene::number::Decimal;

/// The longest formula \[bytes\].
pub const LONGEST: usize = 4096;
/// The deepest nesting.
pub const DEEPEST: usize = 64;
/// The largest whole power taken by multiplications.
const LARGEST_POWER: f64 = 64.0;

/// The functions and how many arguments they take.
pub const FUNCTIONS: [(&str, usize); 14] = [
    ("sqrt", 1),
    ("exp", 1),
    ("log", 1),
    ("sin", 1),
    ("cos", 1),
    ("tan", 1),
    ("tanh", 1),
    ("atan2", 2),
    ("pow", 2),
    ("abs", 1),
    ("sign", 1),
    ("min", 2),
    ("max", 2),
    ("if", 3),
];

/// One operation; numbers of nodes are always those of earlier ones.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Node {
    Number(f64),
    Name(usize),
    Negative(usize),
    Sum(usize, usize),
    Difference(usize, usize),
    Product(usize, usize),
    Quotient(usize, usize),
    Power(usize, usize),
    Root(usize),
    Exponential(usize),
    Logarithm(usize),
    Sine(usize),
    Cosine(usize),
    Tangent(usize),
    HyperbolicTangent(usize),
    Angle(usize, usize),
    /// a where the condition of this number is positive, else -a.
    Flip(usize, usize),
    /// a where the condition of this number is positive, else b.
    Select(usize, usize, usize),
    /// The table of this number at a, on the piece that conditions from the second number on say.
    Table(usize, usize, usize),
}

impl Node {
    /// The operands.
    fn operands(self) -> [Option<usize>; 2] {
        match self {
            Self::Number(_) | Self::Name(_) => [None; 2],
            Self::Negative(a)
            | Self::Root(a)
            | Self::Exponential(a)
            | Self::Logarithm(a)
            | Self::Sine(a)
            | Self::Cosine(a)
            | Self::Tangent(a)
            | Self::HyperbolicTangent(a)
            | Self::Flip(_, a)
            | Self::Table(_, _, a) => [Some(a), None],
            Self::Sum(a, b)
            | Self::Difference(a, b)
            | Self::Product(a, b)
            | Self::Quotient(a, b)
            | Self::Power(a, b)
            | Self::Angle(a, b)
            | Self::Select(_, a, b) => [Some(a), Some(b)],
        }
    }
}

/// Where a number stands that a formula is evaluated with.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Origin {
    /// In its text: a node.
    Node(usize),
    /// The x of a point of a table.
    Knot { table: usize, point: usize },
    /// Of the polynomial on a piece of a table.
    Coefficient { table: usize, piece: usize, power: usize },
}

/// A formula that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    text: String,
    nodes: Vec<Node>,
    /// What each node comes to where no name is in it.
    constants: Vec<Option<f64>>,
    /// The dimension of each number that has a unit.
    units: Vec<(usize, Dimension)>,
    /// The bytes of the operator, name or function of each node.
    places: Vec<(u32, u32)>,
    /// Names and the byte each first stands at.
    names: Vec<(String, usize)>,
    /// The nodes whose signs choose the branches, or the arguments of tables.
    conditions: Vec<usize>,
    /// The nodes that branches hold at zero or above.
    held: Vec<usize>,
    /// The exponents above zero that do not change with time, though names are in them.
    fixed: Vec<usize>,
    /// The tables in it.
    tables: Vec<Interpolant>,
    /// The arguments of functions that change in a window of them alone.
    active: Vec<active::ActiveArgument>,
}

impl Formula {
    /// Reads a formula.
    ///
    /// # Errors
    /// The text is none; the error has the column.
    pub fn parse(text: &str) -> Result<Self, FormulaError> {
        parse::parse(text, &[])
    }

    /// The same with tables as functions.
    ///
    /// # Errors
    /// As [`Formula::parse`].
    pub fn parse_with(text: &str, tables: &[Interpolant]) -> Result<Self, FormulaError> {
        parse::parse(text, tables)
    }

    /// Its text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The names in it, each once, in the order in which they first stand.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(|name| name.0.as_str())
    }

    /// True for a name alone.
    pub(crate) fn is_name(&self) -> bool {
        matches!(self.nodes[..], [Node::Name(_)])
    }

    /// How many conditions choose its branches: 0 for a smooth formula.
    pub fn conditions(&self) -> usize {
        self.conditions.len()
    }

    /// An error at a name of this formula that nothing has, unless it is that of a table.
    pub fn unknown(&self, name: &str, known: &[&str], tables: &[Interpolant]) -> FormulaError {
        if tables.iter().any(|table| table.name == name) {
            return self.refused(name, format!("{name} is a table"), format!("write {name}(…)"));
        }
        self.refused(name, format!("unknown name {name}"), meant(name, known))
    }

    /// An error at a name of this formula.
    pub(crate) fn refused(&self, name: &str, problem: String, hint: String) -> FormulaError {
        let start = self.names.iter().find(|one| one.0 == name).map_or(0, |one| one.1);
        FormulaError::new(&self.text, start, start + name.len(), problem, hint)
    }

    /// Its value in doubles, every branch as the conditions say there; `values` are those of
    /// [`names`](Self::names), in this order.  A missing one counts as zero.
    pub fn value(&self, values: &[f64]) -> f64 {
        self.run(values, &mut BySign)
    }

    /// Its value over any scalar, on the branches where the conditions whose bits are set are positive.
    pub fn evaluate<S: Scalar>(&self, values: &[S], bits: &[bool]) -> S {
        self.run(values, &mut GivenBranches(bits))
    }

    /// The same where `number` gives its numbers as such scalars.
    pub(crate) fn evaluate_over<S: Scalar>(
        &self,
        values: &[S],
        bits: &[bool],
        number: impl Fn(Origin) -> S,
    ) -> S {
        self.run_over(values, &|origin, _| number(origin), &mut GivenBranches(bits))
    }

    /// Its value over a scalar with an order, with the numbers of its text exactly as written.
    pub(crate) fn exact_value<S: Decimal>(&self, values: &[S]) -> S {
        let numbers = Numbers::of(self, &[]);
        self.run_over(values, &|origin, _| numbers.at(origin), &mut branches::ByOrder)
    }

    /// The branches that hold at these values, by the signs of the conditions there.
    pub fn modes(&self, values: &[f64]) -> Vec<bool> {
        self.modes_beside_zeros(values, &[])
    }

    /// The same where these conditions are zero, whatever rounding makes of them.
    pub fn modes_beside_zeros(&self, values: &[f64], zeros: &[bool]) -> Vec<bool> {
        let mut noted = Noted { found: vec![false; self.conditions.len()], zeros };
        self.run(values, &mut noted);
        noted.found
    }

    /// The values of its conditions on the same branches.
    pub fn condition_values<S: Scalar>(&self, values: &[S], bits: &[bool], all: &mut Vec<S>) {
        self.condition_values_over(values, bits, &|_, value| S::of(value), all);
    }

    /// The same where `number` gives its numbers.
    pub(crate) fn condition_values_over<S: Scalar>(
        &self,
        values: &[S],
        bits: &[bool],
        number: &impl Fn(Origin, f64) -> S,
        all: &mut Vec<S>,
    ) {
        if self.conditions.is_empty() {
            return;
        }
        let begin = all.len();
        all.resize(begin + self.conditions.len(), S::ZERO);
        self.run_over(
            values,
            number,
            &mut WatchedBranches { given: GivenBranches(bits), values: &mut all[begin..] },
        );
    }

    fn run<S: Scalar>(&self, values: &[S], branches: &mut impl Branches<S>) -> S {
        self.run_over(values, &|_, value| S::of(value), branches)
    }

    fn run_over<S: Scalar>(
        &self,
        values: &[S],
        number: &impl Fn(Origin, f64) -> S,
        branches: &mut impl Branches<S>,
    ) -> S {
        if let [Node::Name(number)] = self.nodes[..] {
            return values.get(number).copied().unwrap_or(S::ZERO);
        }
        with_copies(S::ZERO, self.nodes.len(), |results| self.fill(results, values, number, branches))
    }

    /// Fills in what every operation comes to; returns the last one.
    fn fill<S: Scalar>(
        &self,
        results: &mut [S],
        values: &[S],
        number: &impl Fn(Origin, f64) -> S,
        branches: &mut impl Branches<S>,
    ) -> S {
        for place in 0..self.nodes.len() {
            results[place] = self.operation(place, results, values, number, branches);
        }
        results.last().copied().unwrap_or(S::ZERO)
    }

    /// What an operation comes to, by the results of those before it.
    #[inline]
    fn operation<S: Scalar>(
        &self,
        place: usize,
        results: &[S],
        values: &[S],
        number: &impl Fn(Origin, f64) -> S,
        branches: &mut impl Branches<S>,
    ) -> S {
        let at = |node: usize| results[node];
        match self.nodes[place] {
            Node::Name(number) => values.get(number).copied().unwrap_or(S::ZERO),
            Node::Flip(condition, a) => {
                if branches.is_positive(condition, at(self.conditions[condition])) {
                    at(a)
                } else {
                    -at(a)
                }
            }
            Node::Select(condition, a, b) => {
                if branches.is_positive(condition, at(self.conditions[condition])) { at(a) } else { at(b) }
            }
            Node::Table(number_of, first, a) => {
                let table = &self.tables[number_of];
                let knot = |point: usize| table.knot(number_of, point, number);
                let piece = branches.piece(first, &table.knots(), at(a), knot);
                table.value(number_of, piece, at(a), number)
            }
            Node::Number(value) => number(Origin::Node(place), value),
            node => self.smooth(node, at),
        }
    }

    /// What one operation without a condition comes to; `at` gives the results of earlier ones.
    fn smooth<S: Scalar>(&self, node: Node, at: impl Fn(usize) -> S) -> S {
        match node {
            Node::Number(number) => S::of(number),
            Node::Negative(a) => -at(a),
            Node::Sum(a, b) => at(a) + at(b),
            Node::Difference(a, b) => at(a) - at(b),
            Node::Product(a, b) => at(a) * at(b),
            Node::Quotient(a, b) => at(a) / at(b),
            Node::Power(a, b) => self.power([a, b], at(a), at(b)),
            Node::Root(a) if self.is_held_above_zero(a) => at(a).power_above_zero(S::of(0.5)),
            Node::Root(a) => at(a).sqrt(),
            Node::Exponential(a) => at(a).exp(),
            Node::Logarithm(a) => at(a).ln(),
            Node::Sine(a) => at(a).sin_cos().0,
            Node::Cosine(a) => at(a).sin_cos().1,
            Node::Tangent(a) => at(a).tan(),
            Node::HyperbolicTangent(a) => at(a).tanh(),
            Node::Angle(y, x) => at(y).atan2(at(x)),
            Node::Name(_) | Node::Flip(..) | Node::Select(..) | Node::Table(..) => S::ZERO,
        }
    }

    /// Adds an operation that stands at bytes `place`, and what it comes to where all it takes is constant.
    fn push(&mut self, node: Node, place: (usize, usize)) -> usize {
        self.note_base(node);
        let is_open = matches!(node, Node::Name(_) | Node::Flip(..) | Node::Select(..) | Node::Table(..));
        let is_constant =
            !is_open && node.operands().into_iter().flatten().all(|node| self.constants[node].is_some());
        let value = is_constant.then(|| self.smooth(node, |node| self.constants[node].unwrap_or(0.0)));
        self.nodes.push(node);
        self.constants.push(value);
        self.places.push((place.0 as u32, place.1 as u32));
        self.nodes.len() - 1
    }

    /// Its dimension, from those of its names in their order; `None` where that is left open: a number
    /// without a unit may have any.
    ///
    /// # Errors
    /// A sum, a comparison or a function of what does not go together.
    pub fn dimension(&self, names: &[Option<Dimension>]) -> Result<Option<Dimension>, FormulaError> {
        let mut dimensions: Vec<Option<Dimension>> = Vec::with_capacity(self.nodes.len());
        for (number, &node) in self.nodes.iter().enumerate() {
            let of = |node: usize| dimensions[node];
            let dimension = match node {
                Node::Number(_) => self.units.iter().find(|unit| unit.0 == number).map(|unit| unit.1),
                Node::Name(name) => names.get(name).copied().flatten(),
                Node::Table(..) => None,
                Node::Negative(a) | Node::Flip(_, a) => of(a),
                Node::Sum(a, b) | Node::Difference(a, b) | Node::Select(_, a, b) | Node::Angle(a, b) => {
                    let both = self.same(number, of(a), of(b))?;
                    if matches!(node, Node::Angle(..)) { Some(Dimension::NONE) } else { both }
                }
                Node::Product(a, b) => of(a).zip(of(b)).map(|(a, b)| a.times(b, 1.0)),
                Node::Quotient(a, b) => of(a).zip(of(b)).map(|(a, b)| a.times(b, -1.0)),
                Node::Root(a) => of(a).map(|a| a.power(0.5)),
                Node::Power(a, b) => {
                    self.pure(number, of(b))?;
                    match (of(a), self.constants[b]) {
                        (Some(a), Some(power)) => Some(a.power(power)),
                        (Some(a), None) if !a.is(Dimension::NONE) => {
                            return Err(self.misfit(number, &Mismatch::Base(a)));
                        }
                        (a, _) => a,
                    }
                }
                Node::Exponential(a)
                | Node::Logarithm(a)
                | Node::Sine(a)
                | Node::Cosine(a)
                | Node::Tangent(a)
                | Node::HyperbolicTangent(a) => {
                    self.pure(number, of(a))?;
                    Some(Dimension::NONE)
                }
            };
            dimensions.push(dimension);
        }
        Ok(dimensions.last().copied().flatten())
    }

    /// The dimension of two that must be the same.
    fn same(
        &self,
        node: usize,
        a: Option<Dimension>,
        b: Option<Dimension>,
    ) -> Result<Option<Dimension>, FormulaError> {
        match (a, b) {
            (Some(a), Some(b)) if !a.is(b) => Err(self.misfit(node, &Mismatch::Sum(a, b))),
            (a, b) => Ok(a.or(b)),
        }
    }

    /// Refuses what has a dimension.
    fn pure(&self, node: usize, a: Option<Dimension>) -> Result<(), FormulaError> {
        match a {
            Some(a) if !a.is(Dimension::NONE) => Err(self.misfit(node, &Mismatch::Pure(a))),
            _ => Ok(()),
        }
    }

    fn misfit(&self, node: usize, mismatch: &Mismatch) -> FormulaError {
        let (start, end) = self.places[node];
        let hint = match mismatch {
            Mismatch::Base(_) => {
                "the unit of such a power is not known: divide its base by a number with its unit, as in \
                    (x/1 m)^p"
            }
            _ => {
                "numbers without a unit fit anything, as in sin(1*t); units stand behind numbers, as 5 mm or \
                    30 deg"
            }
        };
        FormulaError::new(&self.text, start as usize, end as usize, mismatch.to_string(), hint.into())
    }
}
