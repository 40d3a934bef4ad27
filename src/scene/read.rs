//! JSON to [`Scene`], or one precise refusal.
//!
//! Every value is judged where it stands, against the tables of `format.rs`; then the parts against each other in `assemble.rs`.
//! The first fault found is the one reported.

use super::assemble;
use super::error::SceneError;
use super::format::{self, Field, GROUND, INERTIA, LONGEST_FILE, LONGEST_NAME, LONGEST_TEXT, MASS, Quantity, Shape, Table, about};
use super::locate::{Member, Node, Source, Span, Text, Value, clipped, push_index, push_key};
use super::set::{Override, put};
use super::{Bar, Hinge, Law, Motor, Place, Scene, Sine, Spring, Wall};
use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

/// Reads the scene in the file `path`, with `overrides` put in from left to right before anything is judged.
///
/// # Errors
/// The file cannot be read ([`SceneError::is_io`]), or what it says is no scene: the error names line, column, field, value, what is
/// allowed, and a hint.
pub fn read_scene(path: &Path, overrides: &[Override]) -> Result<Scene, SceneError> {
    parse_scene(&read_text(path)?, &path.display().to_string(), overrides)
}

/// Reads the text of the scene file `path`.
///
/// # Errors
/// The file cannot be read ([`SceneError::is_io`]), is too long, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, SceneError> {
    let file = path.display().to_string();
    let mut bytes = Vec::new();
    std::fs::File::open(path)
        .and_then(|opened| opened.take(LONGEST_FILE + 1).read_to_end(&mut bytes))
        .map_err(|error| SceneError::unreadable(&file, &error))?;
    if bytes.len() as u64 > LONGEST_FILE {
        let hint = "a scene of 10 000 bars fits well into this; is this the right file?";
        return Err(SceneError::whole_file(&file, "is too long", "must be at most 16 MiB", hint));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let json = String::from_utf8_lossy(error.as_bytes()).into_owned();
        let source = Source { file, texts: vec![Text { set: None, json: without_mark(&json).to_owned() }] };
        let good = good.saturating_sub(json.len() - source.texts[0].json.len());
        let span = source.span(0, good, good + char::REPLACEMENT_CHARACTER.len_utf8());
        let hint = "save the file as UTF-8; names of bars and hinges are plain ASCII anyway";
        source.refusal(span, "", "not UTF-8", "must be text in UTF-8", hint)
    })
}

/// Reads the scene in `text`; `source` is the name of its file in messages.
///
/// # Errors
/// As [`read_scene`], never an I/O error.
pub fn parse_scene(text: &str, source: &str, overrides: &[Override]) -> Result<Scene, SceneError> {
    if text.len() as u64 > LONGEST_FILE {
        let hint = "a scene of 10 000 bars fits well into this; is this the right file?";
        return Err(SceneError::whole_file(source, "is too long", "must be at most 16 MiB", hint));
    }
    let (source, tree) = put_together(text, source, overrides)?;
    scene(&At { source: &source, node: &tree, path: String::new() })
}

/// The tree of a scene's text with overrides put in, not judged yet.
pub(super) fn put_together(text: &str, source: &str, overrides: &[Override]) -> Result<(Source, Node), SceneError> {
    let mut texts = vec![Text { set: None, json: without_mark(text).to_owned() }];
    texts.extend(overrides.iter().map(Override::text));
    let source = Source { file: source.to_owned(), texts };
    let mut tree = source.tree(0)?;
    for (number, set) in overrides.iter().enumerate() {
        put(&source, &mut tree, set, source.tree(number + 1)?)?;
    }
    Ok((source, tree))
}

/// Editors on some systems put a byte order mark first; it says nothing about the scene.
fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

fn scene(root: &At) -> Result<Scene, SceneError> {
    let fields = root.object(&format::SCENE)?;
    let name = fields.name("name")?;
    let description = fields.text_or_empty("description")?;
    let gravity = fields.pair("gravity")?;
    let (bars, bar_places) = bars(&fields)?;
    let known = Bars { numbers: bars.iter().enumerate().map(|(number, bar)| (bar.name.clone(), number)).collect(), bars: &bars };
    let (hinges, hinge_places) =
        named(&fields, "hinges", &format::HINGE, |fields, name| Ok(Hinge { name, between: between(fields, &known, "hinge")? }))?;
    let (springs, spring_places) = named(&fields, "springs", &format::SPRING, |fields, name| {
        Ok(Spring {
            name,
            between: between(fields, &known, "spring")?,
            stiffness: fields.number("stiffness")?,
            free_length: fields.number("free_length")?,
            damping: fields.number_or("damping", 0.0)?,
        })
    })?;
    let (motors, motor_places) = named(&fields, "motors", &format::MOTOR, |fields, name| motor(fields, name, &known))?;
    let (walls, wall_places) = named(&fields, "walls", &format::WALL, |fields, name| wall(fields, name, &known))?;
    let given = starts(&fields, &known)?;
    let until = fields.number("until")?;
    let every = fields.number("every")?;
    let every_at = fields.required("every")?;
    if every > until {
        let allowed = format!("must be at most the horizon `until`, {until} s");
        return Err(every_at.refuse_value(&allowed, "shorten the output interval or lengthen the horizon"));
    }
    if until / every > MOST_OUTPUTS {
        let allowed = format!("must be at least {:e} s: 2⁵³ outputs up to the horizon", until / MOST_OUTPUTS);
        return Err(every_at.refuse_value(&allowed, "beyond that the output times are no longer distinct"));
    }
    let tree = assemble::hinge_tree(root, &bars, &bar_places, &hinges, &hinge_places)?;
    let start = assemble::starts(root, &bars, &motors, &motor_places, &given)?;
    let posture = tree.posture(&start);
    assemble::springs(&posture, &springs, &spring_places)?;
    assemble::walls(&posture, &walls, &wall_places)?;
    Ok(Scene { name, description, gravity, bars, hinges, springs, motors, walls, start, until, every, ..Scene::default() })
}

/// More outputs than this have no distinct times k·every in doubles.
const MOST_OUTPUTS: f64 = 9_007_199_254_740_992.0;

fn bars<'a>(scene: &Fields<'a>) -> Result<(Vec<Bar>, Vec<At<'a>>), SceneError> {
    let list = scene.required("bars")?;
    let mut names = Names::default();
    let mut bars = Vec::new();
    let places = list.items("bars", &format::SCENE)?;
    for at in &places {
        let outright = at.has("mass") || at.has("centre");
        let fields = at.object(if outright { &format::OUTRIGHT_BAR } else { &format::UNIFORM_BAR })?;
        let name = fields.name("name")?;
        let name_at = fields.required("name")?;
        if name == GROUND {
            return Err(name_at.refuse_value("must be another name: `ground` is what does not move", "name it `base`"));
        }
        names.admit(&name, &name_at)?;
        bars.push(if outright { outright_bar(&fields, name)? } else { uniform_bar(&fields, name)? });
    }
    Ok((bars, places))
}

fn uniform_bar(fields: &Fields, name: String) -> Result<Bar, SceneError> {
    let length = fields.number("length")?;
    let width = fields.number("width")?;
    let mass = fields.number("density")? * length * width * fields.number("thickness")?;
    fields.at.comes_to("a mass", mass, &MASS)?;
    let full = mass * (length * length + width * width) / 12.0;
    let inertia = match fields.optional("inertia") {
        None => full,
        Some(at) => match &at.node.value {
            Value::Text(word) if word == "full" => full,
            Value::Text(word) if word == "slender" => mass * (length * length) / 12.0,
            Value::Number(number) if INERTIA.holds(*number) => *number,
            Value::Text(word) => {
                let hint = match nearest(word, ["full", "slender"]) {
                    Some(near) => format!("did you mean \"{near}\"?"),
                    None => "\"full\" is m(l² + w²)/12, \"slender\" is m l²/12".to_owned(),
                };
                return Err(at.refuse_value(&Shape::Inertia(INERTIA).allowed(), &hint));
            }
            _ => return Err(at.refuse_value(&Shape::Inertia(INERTIA).allowed(), "\"full\" is m(l² + w²)/12, \"slender\" is m l²/12")),
        },
    };
    fields.at.comes_to("an inertia", inertia, &INERTIA)?;
    Ok(Bar { name, length, mass, centre: [length / 2.0, 0.0], inertia })
}

fn outright_bar(fields: &Fields, name: String) -> Result<Bar, SceneError> {
    let mass = fields.number("mass")?;
    let centre = fields.pair("centre")?;
    let inertia = fields.number("inertia")?;
    let reach = 2.0 * libm::hypot(centre[0], centre[1]);
    let sensible = if reach > 0.0 { reach } else { 2.0 * (inertia / mass).sqrt() };
    let length = fields.number_or("length", sensible.min(1e30))?;
    Ok(Bar { name, length, mass, centre, inertia })
}

fn motor(fields: &Fields, name: String, known: &Bars) -> Result<Motor, SceneError> {
    let bar = known.bar(&fields.required("body")?, "a motor turns a bar; to hold a bar still give its law a start and no rate")?;
    let relative_to = match fields.optional("relative_to") {
        Some(at) => known.body(&at)?,
        None => None,
    };
    if relative_to == Some(bar) {
        let at = fields.required("relative_to")?;
        return Err(at.refuse_value("must be another bar than the driven one", "leave it out for an angle from +x"));
    }
    let law_at = fields.required("law")?;
    let law = law_at.object(&format::LAW)?;
    let mut sines = Vec::new();
    if let Some(list) = law.optional("sines") {
        for at in list.items("sines", &format::LAW)? {
            let sine = at.object(&format::SINE)?;
            sines.push(Sine {
                amplitude: sine.number("amplitude")?,
                frequency: sine.number("frequency")?,
                phase: sine.number_or("phase", 0.0)?,
            });
        }
    }
    let law =
        Law { start: law.number("start")?, rate: law.number_or("rate", 0.0)?, acceleration: law.number_or("acceleration", 0.0)?, sines };
    Ok(Motor { name, bar, relative_to, law })
}

fn wall(fields: &Fields, name: String, known: &Bars) -> Result<Wall, SceneError> {
    let bar = known.bar(&fields.required("body")?, "a wall stops a point of a bar")?;
    let point = fields.pair("point")?;
    let line = fields.required("line")?.object(&format::LINE)?;
    let through = line.pair("through")?;
    let [x, y] = line.pair("normal")?;
    let length = libm::hypot(x, y);
    if length < 1e-30 {
        let hint = "[1, 0] for a wall the point must stay right of, [0, 1] for a floor";
        return Err(line.required("normal")?.refuse_value("must be longer than 1e-30", hint));
    }
    // A normal that is a unit vector already stays as it is, so that a scene written out reads back the same.
    let unit = (x * x + y * y - 1.0).abs() <= 4.0 * f64::EPSILON;
    let normal = if unit { [x, y] } else { [x / length, y / length] };
    Ok(Wall { name, bar, point, through, normal, restitution: fields.number("restitution")? })
}

/// The two places of a hinge or spring.
fn between(fields: &Fields, known: &Bars, what: &str) -> Result<[Place; 2], SceneError> {
    let at = fields.required("between")?;
    let Value::List(nodes) = &at.node.value else {
        return Err(at.refuse_value(&Shape::Between.allowed(), "for example {\"body\": \"ground\", \"point\": [0, 0]} for one of them"));
    };
    let [first, second] = nodes.as_slice() else {
        let hint = format!("a {what} joins exactly two bodies; this list has {}", nodes.len());
        return Err(at.refuse("does not have two places", &Shape::Between.allowed(), &hint));
    };
    let places = [place(&at.item(first, 0), known)?, place(&at.item(second, 1), known)?];
    if places[0].bar == places[1].bar {
        let problem = match places[0].bar {
            Some(bar) => format!("joins `{}` to itself", known.bars[bar].name),
            None => "joins the ground to itself".to_owned(),
        };
        let hint = format!("a {what} between two bars, or between a bar and the ground, can do something");
        return Err(at.refuse(&problem, "the two places must be on different bodies", &hint));
    }
    Ok(places)
}

fn place(at: &At, known: &Bars) -> Result<Place, SceneError> {
    let fields = at.object(&format::PLACE)?;
    Ok(Place { bar: known.body(&fields.required("body")?)?, point: fields.pair("point")? })
}

/// The starts that the file gives.
fn starts<'a>(scene: &Fields<'a>, known: &Bars) -> Result<Vec<Option<GivenStart<'a>>>, SceneError> {
    let mut given: Vec<Option<GivenStart>> = known.bars.iter().map(|_| None).collect();
    let Some(at) = scene.optional("start") else { return Ok(given) };
    let Value::Object(members) = &at.node.value else {
        return Err(
            at.refuse_value(&Shape::ByBar(&format::START).allowed(), "for example \"start\": {\"bar1\": {\"phi\": 0, \"omega\": 0}}")
        );
    };
    for member in members {
        let at = at.member(member);
        let Some(&bar) = known.numbers.get(&member.key) else {
            return Err(at.refuse_key(member.span, "names no bar", "must be the name of a bar", &known.hint(&member.key)));
        };
        let fields = at.object(&format::START)?;
        let (phi, omega) = (fields.number("phi")?, fields.number("omega")?);
        given[bar] = Some(GivenStart { phi, omega, phi_at: fields.required("phi")?, omega_at: fields.required("omega")? });
    }
    Ok(given)
}

/// A start as given, with its places.
pub(super) struct GivenStart<'a> {
    pub phi: f64,
    pub omega: f64,
    pub phi_at: At<'a>,
    pub omega_at: At<'a>,
}

/// The elements of a list whose elements have a name.
fn named<'a, T>(
    scene: &Fields<'a>,
    list: &str,
    table: &'static Table,
    one: impl Fn(&Fields, String) -> Result<T, SceneError>,
) -> Result<(Vec<T>, Vec<At<'a>>), SceneError> {
    let mut names = Names::default();
    let mut read = Vec::new();
    let places = match scene.table.field(list) {
        Some(field) if field.required => scene.required(list)?.items(list, scene.table)?,
        _ => scene.optional(list).map_or(Ok(Vec::new()), |at| at.items(list, scene.table))?,
    };
    for at in &places {
        let fields = at.object(table)?;
        let name = fields.name("name")?;
        names.admit(&name, &fields.required("name")?)?;
        read.push(one(&fields, name)?);
    }
    Ok((read, places))
}

/// Names of one kind, each with the path of its owner.
#[derive(Default)]
struct Names(HashMap<String, String>);

impl Names {
    fn admit(&mut self, name: &str, at: &At) -> Result<(), SceneError> {
        match self.0.insert(name.to_owned(), at.path.clone()) {
            None => Ok(()),
            Some(first) => Err(at.refuse_value(&format!("must be unique; {first} is the same"), "rename one of the two")),
        }
    }
}

/// The bars by name.
struct Bars<'a> {
    bars: &'a [Bar],
    numbers: HashMap<String, usize>,
}

impl Bars<'_> {
    /// The bar named at `at`, or the ground.
    fn body(&self, at: &At) -> Result<Option<usize>, SceneError> {
        let Value::Text(name) = &at.node.value else {
            return Err(at.refuse_value(&Shape::Body { ground: true }.allowed(), &self.hint("")));
        };
        if name == GROUND {
            return Ok(None);
        }
        self.numbers
            .get(name)
            .map(|&bar| Some(bar))
            .ok_or_else(|| at.refuse_value("names no body; must be the name of a bar, or \"ground\"", &self.hint(name)))
    }

    /// The bar named at `at`; `hint` says why it cannot be the ground.
    fn bar(&self, at: &At, hint: &str) -> Result<usize, SceneError> {
        match self.body(at)? {
            Some(bar) => Ok(bar),
            None => Err(at.refuse_value(&Shape::Body { ground: false }.allowed(), hint)),
        }
    }

    fn hint(&self, wanted: &str) -> String {
        let names: Vec<&str> = self.bars.iter().map(|bar| bar.name.as_str()).collect();
        let list = listed(&names);
        match nearest(wanted, names) {
            Some(near) => format!("did you mean \"{near}\"? known bars: {list}"),
            None => format!("known bars: {list}"),
        }
    }
}

/// The first dozen of some words.
pub(super) fn listed(words: &[&str]) -> String {
    let more = if words.len() > 12 { format!(", … ({} in all)", words.len()) } else { String::new() };
    words.iter().take(12).map(|word| clipped(word)).collect::<Vec<_>>().join(", ") + &more
}

/// The known word within a third of its letters of `wanted`.
pub(super) fn nearest<'a>(wanted: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted: String = wanted.chars().take(LONGEST_NAME).flat_map(char::to_lowercase).collect();
    let far = (wanted.chars().count() / 3).max(1);
    known
        .into_iter()
        .map(|word| (strsim::damerau_levenshtein(&wanted, &word.to_lowercase()), word))
        .filter(|(distance, word)| *distance <= far && *distance < word.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, word)| word)
}

/// A value with its path.
#[derive(Clone)]
pub(super) struct At<'a> {
    pub source: &'a Source,
    pub node: &'a Node,
    pub path: String,
}

impl<'a> At<'a> {
    /// An error about this value that shows it.
    pub fn refuse_value(&self, allowed: &str, hint: &str) -> SceneError {
        self.source.refused_value(self.node.span, &self.path, allowed, hint)
    }

    /// An error about this value in words.
    pub fn refuse(&self, problem: &str, allowed: &str, hint: &str) -> SceneError {
        self.source.refusal(self.opening(), &self.path, problem, allowed, hint)
    }

    fn refuse_key(&self, key: Span, problem: &str, allowed: &str, hint: &str) -> SceneError {
        self.source.refusal(key, &self.path, problem, allowed, hint)
    }

    /// An error about `keys` missing from this object.
    pub fn missing(&self, key: &str, within: &str, allowed: &str, hint: &str) -> SceneError {
        let holder = match &self.node.value {
            Value::Object(members) => members.iter().find(|member| member.key == key).map(|member| self.member(member)),
            _ => None,
        };
        let mut path = self.path.clone();
        push_key(&mut path, key);
        push_key(&mut path, within);
        self.source.refusal(holder.unwrap_or(self.clone()).opening(), &path, "is missing", allowed, hint)
    }

    /// The place of a long value is its opening bracket.
    fn opening(&self) -> Span {
        match self.node.value {
            Value::List(_) | Value::Object(_) => self.node.span.first(),
            _ => self.node.span,
        }
    }

    fn has(&self, key: &str) -> bool {
        matches!(&self.node.value, Value::Object(members) if members.iter().any(|member| member.key == key))
    }

    /// The value of a member of this object.
    fn member(&self, member: &'a Member) -> At<'a> {
        let mut path = self.path.clone();
        push_key(&mut path, &clipped(&member.key));
        At { source: self.source, node: &member.node, path }
    }

    /// An element of this list.
    fn item(&self, node: &'a Node, number: usize) -> At<'a> {
        let mut path = self.path.clone();
        push_index(&mut path, number);
        At { source: self.source, node, path }
    }

    /// This value as an object that has all keys of `table` it must have, and no others.
    fn object(&self, table: &'static Table) -> Result<Fields<'a>, SceneError> {
        let Value::Object(members) = &self.node.value else {
            let allowed = format!("must be an object, {}, with the keys {}", table.title, table.keys());
            if self.path.is_empty() {
                return Err(self.refuse("the file is not a JSON object", &allowed, "compare with a file in examples/scenes/"));
            }
            return Err(self.refuse_value(&allowed, table.about));
        };
        for member in members {
            if table.field(&member.key).is_none() {
                let names = table.fields.iter().map(|field| field.name);
                let hint = nearest(&member.key, names).map_or(table.about.to_owned(), |near| format!("did you mean `{near}`?"));
                let allowed = format!("{} has the keys {}", table.title, table.keys());
                return Err(self.member(member).refuse_key(member.span, "is not a known key", &allowed, &hint));
            }
        }
        Ok(Fields { at: self.clone(), members, table })
    }

    /// The elements of this list, which is the field `name` of `table`.
    fn items(&self, name: &str, table: &'static Table) -> Result<Vec<At<'a>>, SceneError> {
        let shape = table.field(name).map(|field| &field.shape);
        let (least, most) = if let Some(Shape::List { least, most, .. }) = shape { (*least, *most) } else { (0, usize::MAX) };
        let allowed = || shape.map_or(String::new(), Shape::allowed);
        match &self.node.value {
            Value::List(nodes) if (least..=most).contains(&nodes.len()) => {
                Ok(nodes.iter().enumerate().map(|(number, node)| self.item(node, number)).collect())
            }
            Value::List(nodes) => {
                let hint = if nodes.len() < least { "compare with examples/scenes/free.json" } else { "split the scene" };
                Err(self.refuse(&format!("has {} elements", nodes.len()), &allowed(), hint))
            }
            _ => Err(self.refuse_value(&allowed(), "even a single one stands in square brackets")),
        }
    }

    fn number(&self, field: &Field, quantity: &Quantity) -> Result<f64, SceneError> {
        let allowed = || field.shape.allowed();
        match &self.node.value {
            Value::Number(number) if quantity.holds(*number) => Ok(*number),
            Value::Number(_) if quantity.unit == "rad" => {
                Err(self.refuse_value(&allowed(), "beyond that the last place of the angle is coarser than 1e-3 rad; take off whole turns"))
            }
            Value::Text(text) if text.trim().parse::<f64>().is_ok_and(f64::is_finite) => {
                Err(self.refuse_value(&allowed(), &format!("write it without quotes: {}", clipped(text.trim()))))
            }
            _ => Err(self.refuse_value(&allowed(), &field.for_example())),
        }
    }

    /// Refuses this object where what follows from it is out of range.
    fn comes_to(&self, what: &str, number: f64, quantity: &Quantity) -> Result<(), SceneError> {
        if quantity.holds(number) {
            return Ok(());
        }
        let problem = format!("comes to {what} of {} {}", about(number), quantity.unit);
        Err(self.refuse(&problem, &Shape::Number(*quantity).allowed(), "check the units: metres, kg/m³"))
    }
}

/// The members of an object whose keys are known to be good.
struct Fields<'a> {
    at: At<'a>,
    members: &'a [Member],
    table: &'static Table,
}

impl<'a> Fields<'a> {
    fn optional(&self, name: &str) -> Option<At<'a>> {
        self.members.iter().find(|member| member.key == name).map(|member| self.at.member(member))
    }

    fn required(&self, name: &str) -> Result<At<'a>, SceneError> {
        self.optional(name).ok_or_else(|| {
            let mut path = self.at.path.clone();
            push_key(&mut path, name);
            let (allowed, hint) = match self.table.field(name) {
                Some(field) => (field.shape.allowed(), format!("add it, {}", field.for_example())),
                None => (String::new(), self.table.about.to_owned()),
            };
            self.at.source.refusal(self.at.opening(), &path, "is missing", &allowed, &hint)
        })
    }

    fn number(&self, name: &str) -> Result<f64, SceneError> {
        let at = self.required(name)?;
        match self.table.field(name) {
            Some(field @ Field { shape: Shape::Number(quantity), .. }) => at.number(field, quantity),
            _ => Err(at.refuse_value("must be a number the format knows", self.table.about)),
        }
    }

    fn number_or(&self, name: &str, absent: f64) -> Result<f64, SceneError> {
        if self.optional(name).is_some() { self.number(name) } else { Ok(absent) }
    }

    fn pair(&self, name: &str) -> Result<[f64; 2], SceneError> {
        let at = self.required(name)?;
        match (self.table.field(name), &at.node.value) {
            (Some(field @ Field { shape: Shape::Pair(quantity), .. }), Value::List(nodes)) if nodes.len() == 2 => {
                Ok([at.item(&nodes[0], 0).coordinate(field, quantity)?, at.item(&nodes[1], 1).coordinate(field, quantity)?])
            }
            (Some(field), _) => Err(at.refuse_value(&field.shape.allowed(), &field.for_example())),
            (None, _) => Err(at.refuse_value("must be a pair the format knows", self.table.about)),
        }
    }

    fn text_or_empty(&self, name: &str) -> Result<String, SceneError> {
        let Some(at) = self.optional(name) else { return Ok(String::new()) };
        match &at.node.value {
            Value::Text(text) if text.chars().count() <= LONGEST_TEXT && !text.chars().any(char::is_control) => Ok(text.clone()),
            _ => Err(at.refuse_value(&Shape::Text.allowed(), "one sentence is enough")),
        }
    }

    fn name(&self, name: &str) -> Result<String, SceneError> {
        let at = self.required(name)?;
        let shape = self.table.field(name).map_or(&Shape::Name, |field| &field.shape);
        let folder = matches!(shape, Shape::FolderName);
        match &at.node.value {
            Value::Text(text) if is_name(text) && !(folder && text.starts_with('-')) => Ok(text.clone()),
            Value::Text(text) => {
                let mended: String =
                    text.trim().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).take(LONGEST_NAME).collect();
                let hint = if is_name(&mended) { format!("for example \"{mended}\"") } else { "for example \"bar1\"".to_owned() };
                Err(at.refuse_value(&shape.allowed(), &hint))
            }
            _ => Err(at.refuse_value(&shape.allowed(), "names stand in double quotes")),
        }
    }
}

impl At<'_> {
    /// One number of a pair.
    fn coordinate(&self, field: &Field, quantity: &Quantity) -> Result<f64, SceneError> {
        match self.node.value {
            Value::Number(number) if quantity.holds(number) => Ok(number),
            _ => Err(self.refuse_value(&Shape::Number(*quantity).allowed(), &field.for_example())),
        }
    }
}

fn is_name(text: &str) -> bool {
    (1..=LONGEST_NAME).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_')
}
