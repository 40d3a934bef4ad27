//! Formulas in the place of numbers: `"length": "2*l"`, with the scene's parameters.
//!
//! Before a scene is judged, every number that is written as a formula of parameters becomes that number; a
//! formula of time and state, where the format takes one, stays a text for the reader of loads and events.

use super::at::At;
use super::judge::{HINTS, check_name, fits, refused};
use super::names::set_by_events;
use super::tables;
use crate::arithmetic::shown::about;
use crate::scene::error::SceneError;
use crate::scene::format::{FACTOR_LAW, FieldShape, KeyTable, QuantityRange, SCENE, kind};
use crate::scene::formula::unit::Dimension;
use crate::scene::formula::{DEEPEST, Formula, FormulaError, Interpolant};
use crate::scene::locate::{Located, Member, Span, Texts, Value, push_index, push_key};
use crate::scene::{Law, Parameter, PointTable, Profile, Sine};

/// Parameters at most.
const MOST: usize = 1000;

/// A parameter with what is known of it beside its value.
pub(super) struct Valued {
    pub name: String,
    pub value: f64,
    pub dimension: Option<Dimension>,
}

impl From<&Valued> for Parameter {
    fn from(known: &Valued) -> Self {
        Self { name: known.name.clone(), value: known.value }
    }
}

/// What formulas are made of.
pub(super) struct Resolved {
    pub parameters: Vec<Valued>,
    pub tables: Vec<PointTable>,
}

/// What formulas of time may use beside it: parameters and tables.
pub(super) struct FormulaConstants<'a> {
    parameters: &'a [Valued],
    tables: Vec<Interpolant>,
}

impl<'a> FormulaConstants<'a> {
    pub fn new(parameters: &'a [Valued], tables: &[PointTable]) -> Self {
        let tables = tables.iter().map(|table| Interpolant::new(&table.name, &table.points)).collect();
        Self { parameters, tables }
    }

    /// True where a formula speaks of more than time, parameters and tables.
    pub fn is_of_place(&self, text: &str) -> bool {
        Formula::parse_with(text, &self.tables).is_ok_and(|formula| !is_of_time(&formula, self.parameters))
    }

    /// The law of a formula that was judged; `None` where it is none.
    pub fn profile(&self, text: &str) -> Option<Profile> {
        let formula = Formula::parse_with(text, &self.tables).ok()?;
        let value = |name: &str| {
            let known = self.parameters.iter().find(|known| known.name == name);
            known.map(|known| known.value)
        };
        Some(Profile::new(&formula, None, &formula.names().map(value).collect::<Vec<_>>()))
    }
}

/// Puts numbers in the place of formulas of parameters; returns the parameters, and the tables they may use.
///
/// # Errors
/// A formula that is none, a name that nothing has, a dimension that does not fit, a cycle.
pub(super) fn resolve(source: &Texts, tree: &mut Located) -> Result<Resolved, SceneError> {
    let tables = tables::tables(&At { source, node: tree, path: String::new() })?;
    let functions: Vec<_> = tables.iter().map(|table| Interpolant::new(&table.name, &table.points)).collect();
    let parameters = parameters(source, tree, &functions)?;
    let set = set_by_events(tree);
    Resolver { source, parameters: &parameters, tables: &functions, set }.members(tree, &SCENE, "")?;
    Ok(Resolved { parameters, tables })
}

/// The parameters, in the order of the text.
fn parameters(source: &Texts, tree: &Located, tables: &[Interpolant]) -> Result<Vec<Valued>, SceneError> {
    let Value::Object(members) = &tree.value else { return Ok(Vec::new()) };
    let Some(holder) = members.iter().find(|member| member.key == "parameters") else {
        return Ok(Vec::new());
    };
    let allowed = FieldShape::Parameters.allowed();
    let Value::Object(members) = &holder.node.value else {
        let hint = "for example {\"k\": 0.6}";
        return Err(source.refused_value(holder.node.span, "parameters", &allowed, hint));
    };
    if members.len() > MOST {
        let problem = format!("has {} entries", members.len());
        let allowed = format!("must be at most {MOST}");
        return Err(source.refusal(holder.span, "parameters", &problem, &allowed, "compute the rest before"));
    }
    let mut order = InOrder {
        source,
        tables,
        names: Vec::new(),
        formulas: Vec::new(),
        known: Vec::new(),
        open: Vec::new(),
    };
    for member in members {
        let mut path = "parameters".to_owned();
        push_key(&mut path, &member.key);
        check_name(source, &member.key, member.span, &path, &order.names)?;
        let span = member.node.span;
        let (formula, known) = match &member.node.value {
            Value::Number(number) if number.is_finite() => (None, Some((*number, None))),
            Value::Text(text) => {
                let formula = Formula::parse_with(text, tables);
                (Some(formula.map_err(|error| refused(source, span, &path, &allowed, &error))?), None)
            }
            _ => {
                let hint = "for example 0.6 or \"15*m*g/(2*l)\"";
                return Err(source.refused_value(span, &path, &allowed, hint));
            }
        };
        order.formulas.push((path, span, formula));
        order.known.push(known);
        order.names.push(&member.key);
    }
    (0..order.names.len()).try_for_each(|number| order.settle(number))?;
    let InOrder { names, known, .. } = order;
    let parameter =
        |(name, (value, dimension)): (&str, _)| Valued { name: name.to_owned(), value, dimension };
    Ok(names.into_iter().zip(known.into_iter().flatten()).map(parameter).collect())
}

/// Evaluates parameters after those they are made of.
struct InOrder<'a> {
    source: &'a Texts,
    tables: &'a [Interpolant],
    names: Vec<&'a str>,
    /// Path, place and formula of each; none of a number.
    formulas: Vec<(String, Span, Option<Formula>)>,
    known: Vec<Option<(f64, Option<Dimension>)>>,
    /// Those that wait for others.
    open: Vec<usize>,
}

impl InOrder<'_> {
    /// A name in the formula of parameter `number` that no parameter has.
    fn unknown(&self, number: usize, formula: &Formula, name: &str) -> FormulaError {
        if name == "t" || name.contains('.') {
            let hint = "parameters are numbers; what changes with time and state is a signal";
            return formula.refused(name, format!("unknown name {name}"), hint.into());
        }
        let others = self.names.iter().enumerate().filter(|(other, _)| *other != number);
        let others: Vec<&str> = others.map(|(_, name)| *name).collect();
        let mut error = formula.unknown(name, &others, self.tables);
        if others.is_empty() && error.hint.starts_with("nothing") {
            error.hint = "there is no other parameter".into();
        }
        error
    }

    fn settle(&mut self, number: usize) -> Result<(), SceneError> {
        if self.known[number].is_some() {
            return Ok(());
        }
        let (path, span, formula) = self.formulas[number].clone();
        let Some(formula) = formula else { return Ok(()) };
        let (source, allowed) = (self.source, FieldShape::Parameters.allowed());
        let refused = |error: FormulaError| refused(source, span, &path, &allowed, &error);
        if self.open.contains(&number) || self.open.len() >= DEEPEST {
            let chain: Vec<&str> = self.open.iter().chain([&number]).map(|&one| self.names[one]).collect();
            let problem = format!("is made of itself: {}", chain.join(" of "));
            return Err(source.refusal(span, &path, &problem, &allowed, "give one of them as a number"));
        }
        let part = |name| self.names.iter().position(|known| *known == name);
        let unknown = |name: &str| refused(self.unknown(number, &formula, name));
        let parts: Vec<usize> =
            formula.names().map(|name| part(name).ok_or_else(|| unknown(name))).collect::<Result<_, _>>()?;
        self.open.push(number);
        parts.iter().try_for_each(|&part| self.settle(part))?;
        self.open.pop();
        let (values, dimensions): (Vec<f64>, Vec<_>) =
            parts.iter().filter_map(|&part| self.known[part]).unzip();
        let dimension = formula.dimension(&dimensions).map_err(refused)?;
        let value = formula.value(&values);
        if !value.is_finite() {
            let problem = if value.is_nan() { "has no value" } else { "is infinite" };
            let hint = HINTS[usize::from(formula.names().next().is_none())];
            return Err(source.refusal(span, &path, problem, &allowed, hint));
        }
        self.known[number] = Some((value, dimension));
        Ok(())
    }
}

/// The value of a name, where it has one, and its dimension.
type Argument = (Option<f64>, Option<Dimension>);
/// Those of several.
type Arguments = (Vec<Option<f64>>, Vec<Option<Dimension>>);

struct Resolver<'a> {
    source: &'a Texts,
    parameters: &'a [Valued],
    tables: &'a [Interpolant],
    /// Parameters that events set: formulas of them, where there are laws, are more than numbers.
    set: Vec<String>,
}

impl Resolver<'_> {
    /// All members of an object.
    fn members(&self, node: &mut Located, table: &'static KeyTable, path: &str) -> Result<(), SceneError> {
        let Value::Object(members) = &mut node.value else { return Ok(()) };
        for member in members {
            if let Some(field) = table.field(&member.key) {
                let mut inner = path.to_owned();
                push_key(&mut inner, &member.key);
                self.visit(&mut member.node, &field.shape, &inner)?;
            }
        }
        Ok(())
    }

    fn visit(&self, node: &mut Located, shape: &FieldShape, path: &str) -> Result<(), SceneError> {
        let each = |nodes: &mut [Located], one: &dyn Fn(&mut Located, &str) -> Result<(), SceneError>| {
            nodes.iter_mut().enumerate().try_for_each(|(number, node)| {
                let mut inner = path.to_owned();
                push_index(&mut inner, number);
                one(node, &inner)
            })
        };
        match (shape, &mut node.value) {
            // A word of bars of another kind, of which the reader of bars speaks.
            (FieldShape::Number(_), Value::Text(text)) if path.ends_with(".inertia") && is_of_shape(text) => {
                Ok(())
            }
            (FieldShape::Number(quantity) | FieldShape::LawNumber(quantity), Value::Text(_)) => {
                self.number(node, quantity, shape, path)
            }
            (FieldShape::Inertia(quantity), Value::Text(text)) if !is_of_shape(text) => {
                // A word that is nearly one of the two is left to the reader, who knows what was meant.
                if Formula::parse_with(text, self.tables).is_ok_and(|formula| self.knows(&formula)) {
                    return self.number(node, quantity, shape, path);
                }
                Ok(())
            }
            (FieldShape::Pair(quantity), Value::List(nodes)) => {
                each(nodes, &|node, path| self.visit(node, &FieldShape::Number(*quantity), path))
            }
            (FieldShape::LawPair(quantity), Value::List(nodes)) => {
                each(nodes, &|node, path| self.visit(node, &FieldShape::LawNumber(*quantity), path))
            }
            (FieldShape::Law(_, quantity), Value::Text(text)) => {
                // What is no sum is left to the reader of motors.
                if let Some(law) = self.law(text, node.span, quantity, shape, path)? {
                    node.value = law_object(node.span, &law);
                }
                Ok(())
            }
            (FieldShape::Object(table) | FieldShape::Law(table, _), _) => self.members(node, table, path),
            (FieldShape::Between, Value::List(nodes)) => {
                each(nodes, &|node, path| self.members(node, &crate::scene::format::PLACE, path))
            }
            (FieldShape::List { of, .. }, Value::List(nodes)) => each(nodes, &|node, path| {
                let Value::Object(members) = &node.value else { return Ok(()) };
                let has = |key: &str| members.iter().any(|member| member.key == key);
                kind(of, has).map_or(Ok(()), |table| self.members(node, table, path))
            }),
            (FieldShape::ByBar(table), Value::Object(members)) => members.iter_mut().try_for_each(|member| {
                let mut inner = path.to_owned();
                push_key(&mut inner, &member.key);
                self.members(&mut member.node, table, &inner)
            }),
            _ => Ok(()),
        }
    }

    /// The law of time that a formula is; `None` for one of a motor or a wall that is no sum.
    fn law(
        &self,
        text: &str,
        span: Span,
        quantity: &QuantityRange,
        shape: &FieldShape,
        path: &str,
    ) -> Result<Option<Law>, SceneError> {
        let refused = |error: FormulaError| refused(self.source, span, path, &shape.allowed(), &error);
        let formula = Formula::parse_with(text, self.tables).map_err(refused)?;
        let is_motor = !matches!(shape, FieldShape::Law(table, _) if std::ptr::eq(*table, &FACTOR_LAW));
        if is_motor && !is_of_time(&formula, self.parameters) {
            return Ok(None);
        }
        let time = (None, Some(Dimension::of("s")));
        let (values, dimensions) = self.arguments(&formula, &[("t", time)]).map_err(refused)?;
        let dimension = formula.dimension(&dimensions).map_err(refused)?;
        fits(&formula, dimension, quantity).map_err(refused)?;
        if let (Some(name), false) = (self.is_set(&formula), is_motor) {
            let problem = format!("speaks of {name}, which an event sets");
            let hint = "write the force or the torque itself as a formula".to_owned();
            return Err(refused(formula.refused(name, problem, hint)));
        }
        match formula.law(&values) {
            _ if self.is_set(&formula).is_some() => Ok(None),
            Err(_) if is_motor => Ok(None),
            law => law.map(Some).map_err(refused),
        }
    }

    /// The first parameter of a formula that an event sets.
    fn is_set<'b>(&self, formula: &'b Formula) -> Option<&'b str> {
        formula.names().find(|name| self.set.iter().any(|set| set == name))
    }

    fn find(&self, name: &str) -> Option<&Valued> {
        self.parameters.iter().find(|known| known.name == name)
    }

    /// True where a formula has no names but those of parameters.
    fn knows(&self, formula: &Formula) -> bool {
        formula.names().all(|name| self.find(name).is_some())
    }

    /// Values and dimensions of the names of a formula, which are parameters or stand in `beside`.
    fn arguments(&self, formula: &Formula, beside: &[(&str, Argument)]) -> Result<Arguments, FormulaError> {
        let argument = |name: &str| {
            let parameter = self.find(name).map(|known| (Some(known.value), known.dimension));
            let other = || beside.iter().find(|known| known.0 == name).map(|known| known.1);
            parameter.or_else(other).ok_or_else(|| {
                let names = beside.iter().map(|known| known.0);
                let known: Vec<&str> =
                    names.chain(self.parameters.iter().map(|known| known.name.as_str())).collect();
                let mut error = formula.unknown(name, &known, self.tables);
                if known.is_empty() {
                    error.hint =
                        "\"parameters\": {…} gives numbers names; numbers depend on these alone".into();
                }
                error
            })
        };
        formula.names().map(argument).collect()
    }

    /// Puts the number in the place of its formula.
    fn number(
        &self,
        node: &mut Located,
        quantity: &QuantityRange,
        shape: &FieldShape,
        path: &str,
    ) -> Result<(), SceneError> {
        let Value::Text(text) = &node.value else { return Ok(()) };
        // A quoted number is left to the reader, who says so.
        if text.trim().parse::<f64>().is_ok() {
            return Ok(());
        }
        let refused = |error: FormulaError| refused(self.source, node.span, path, &shape.allowed(), &error);
        let formula = Formula::parse_with(text, self.tables).map_err(refused)?;
        let is_law = !self.knows(&formula) || self.is_set(&formula).is_some();
        if matches!(shape, FieldShape::LawNumber(_)) && is_law {
            return Ok(());
        }
        let (values, dimensions) = self.arguments(&formula, &[]).map_err(refused)?;
        let dimension = formula.dimension(&dimensions).map_err(refused)?;
        fits(&formula, dimension, quantity).map_err(refused)?;
        let value = formula.value(&values.into_iter().flatten().collect::<Vec<f64>>());
        if !quantity.holds(value) {
            let problem = format!("= {} comes to {}", self.source.written(node.span), about(value));
            let hint = HINTS[usize::from(formula.names().next().is_none())];
            return Err(self.source.refusal(node.span, path, &problem, &shape.allowed(), hint));
        }
        node.value = Value::Number(value);
        Ok(())
    }
}

/// True where a formula has no names but t and those of parameters.
fn is_of_time(formula: &Formula, parameters: &[Valued]) -> bool {
    formula.names().all(|name| name == "t" || parameters.iter().any(|known| known.name == name))
}

/// The inertias that a bar by width and density may have by name.
fn is_of_shape(word: &str) -> bool {
    matches!(word, "full" | "slender")
}

/// A law as the object that could stand in its formula's place.
fn law_object(span: Span, law: &Law) -> Value {
    let number = |value: f64| Located { span, value: Value::Number(value) };
    let member = |key: &str, node: Located| Member { key: key.to_owned(), span, node };
    let sine = |sine: &Sine| {
        let members = vec![
            member("amplitude", number(sine.amplitude)),
            member("frequency", number(sine.frequency)),
            member("phase", number(sine.phase)),
        ];
        Located { span, value: Value::Object(members) }
    };
    let sines = Located { span, value: Value::List(law.sines.iter().map(sine).collect()) };
    Value::Object(vec![
        member("start", number(law.start)),
        member("rate", number(law.rate)),
        member("acceleration", number(law.acceleration)),
        member("sines", sines),
    ])
}
