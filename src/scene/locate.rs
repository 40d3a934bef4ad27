//! Where in a JSON text a value stands.
//!
//! `serde_json` judges the syntax; one pass over the text it has accepted then builds a tree of values that
//! remember their bytes, and finds what `serde_json` lets pass: a key written twice (it keeps the last), a
//! lone surrogate, a tower of brackets.  A value of a `--set` option is a text of its own, so that a scene
//! may be put together from several of them.

use super::error::{Excerpt, Refusal, SceneError};
use super::read::TableFiles;
use serde::de::IgnoredAny;
use std::collections::HashMap;
use std::fmt::Write;

/// Deeper than any scene, shallow enough for recursion.
const DEEPEST: usize = 32;

/// Keys of an object up to which one written twice is looked for among them all, beyond by its hash.
const FEW: usize = 16;

/// The longest piece of a text shown in a message \[characters\].
const SHOWN: usize = 60;

/// All texts a scene was put together from: the file first, then one for each `--set`.
pub(super) struct Texts {
    /// Name of the file for messages.
    pub file: String,
    /// Text 0 is the file.
    pub texts: Vec<Text>,
    /// Files of its tables that were read before.
    pub tables: TableFiles,
}

/// One JSON text.
pub(super) struct Text {
    /// The option it came from, as typed; `None` for the file.
    pub set: Option<String>,
    /// What it says.
    pub json: String,
}

/// Bytes `start..end` of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    text: u32,
    start: u32,
    end: u32,
}

/// A value and its place.
#[derive(Clone, Debug)]
pub(super) struct Located {
    pub span: Span,
    pub value: Value,
}

/// A value; numbers that no double holds are infinite.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Null,
    Truth,
    Number(f64),
    Text(String),
    List(Vec<Located>),
    Object(Vec<Member>),
}

/// A key, its place, and its value.
#[derive(Clone, Debug)]
pub(super) struct Member {
    pub key: String,
    pub span: Span,
    pub node: Located,
}

impl Span {
    /// Its first byte.
    pub fn first(self) -> Self {
        Self { end: self.end.min(self.start + 1), ..self }
    }

    /// The value in quotes without them, as long as no escapes are in it: bytes `from` to `to` of that.
    fn inside(self, from: usize, to: usize) -> Self {
        let at = |byte: usize| (self.start + 1).saturating_add(byte as u32).min(self.end.saturating_sub(1));
        Self { start: at(from).max(self.start), end: at(to.max(from + 1)).max(self.start + 1), ..self }
    }
}

impl Texts {
    /// Reads text number `text` of this source.
    pub fn tree(&self, text: usize) -> Result<Located, SceneError> {
        let json = &self.texts[text].json;
        if json.trim().is_empty() {
            let span = self.span(text, 0, 0);
            let hint = "a scene is a JSON object: {\"name\": …, \"bars\": […], …}; start from a file in \
                examples/scenes/";
            return Err(self.refusal(span, "", "the file is empty", "must be a JSON object", hint));
        }
        if let Err(error) = serde_json::from_str::<IgnoredAny>(json) {
            return Err(self.syntax(text, &error));
        }
        Locator { source: self, text, json, at: 0, path: String::new() }.value(0)
    }

    /// An error about `path` at `span`.
    pub fn refusal(&self, span: Span, path: &str, problem: &str, allowed: &str, hint: &str) -> SceneError {
        let text = &self.texts[span.text as usize];
        let mut refusal = Refusal {
            file: self.file.clone(),
            set: text.set.clone(),
            path: path.to_owned(),
            problem: problem.to_owned(),
            allowed: allowed.to_owned(),
            hint: hint.to_owned(),
            ..Refusal::default()
        };
        if text.set.is_none() {
            let (line, column) = position(&text.json, span.start as usize);
            refusal.line = Some(line);
            refusal.column = Some(column);
            refusal.excerpt = Some(Excerpt::of(&text.json, span.start as usize, span.end as usize));
        }
        SceneError::from(refusal)
    }

    /// An error about the value at `span`.
    pub fn refused_value(&self, span: Span, path: &str, allowed: &str, hint: &str) -> SceneError {
        let value = self.written(span);
        self.refusal(span, path, &format!("= {value}"), allowed, hint).with_value(value)
    }

    /// The bytes of `span` as written, on one line and not too long.
    pub fn written(&self, span: Span) -> String {
        let json = &self.texts[span.text as usize].json;
        clipped(json.get(span.start as usize..span.end as usize).unwrap_or(""))
    }

    /// Bytes `from` to `to` of the text that stands in quotes at `span`; all of it where escapes are in it.
    pub fn inside(&self, span: Span, from: usize, to: usize) -> Span {
        let json = &self.texts[span.text as usize].json;
        let is_plain = json
            .get(span.start as usize..span.end as usize)
            .is_some_and(|text| text.starts_with('"') && !text.contains('\\'));
        if is_plain { span.inside(from, to) } else { span }
    }

    /// The number of the text of `span`, its bytes as written, and whether they are all of that text.
    pub fn text(&self, span: Span) -> (usize, &str, bool) {
        let Span { text, start, end } = span;
        let json = &self.texts[text as usize].json;
        (
            text as usize,
            json.get(start as usize..end as usize).unwrap_or(""),
            (start, end as usize) == (0, json.len()),
        )
    }

    /// "line 3, column 7", or the option.
    pub fn place(&self, span: Span) -> String {
        let text = &self.texts[span.text as usize];
        match &text.set {
            Some(set) => set.clone(),
            None => {
                let (line, column) = position(&text.json, span.start as usize);
                format!("line {line}, column {column}")
            }
        }
    }

    /// "scene.json:3:7", or "scene.json with" the option.
    pub fn place_in_file(&self, span: Span) -> String {
        let text = &self.texts[span.text as usize];
        match &text.set {
            Some(set) => format!("{} with {set}", self.file),
            None => {
                let (line, column) = position(&text.json, span.start as usize);
                format!("{}:{line}:{column}", self.file)
            }
        }
    }

    /// Bytes `start..end` of text number `text`.
    pub fn span(&self, text: usize, start: usize, end: usize) -> Span {
        Span { text: text as u32, start: start as u32, end: end as u32 }
    }

    fn syntax(&self, text: usize, error: &serde_json::Error) -> SceneError {
        let json = &self.texts[text].json;
        // serde_json counts bytes, and names the offending one; column 0 is the line break itself.
        let line_start =
            json.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum::<usize>();
        let mut at = (line_start + error.column()).saturating_sub(1).min(json.len());
        while !json.is_char_boundary(at) {
            at -= 1;
        }
        if error.is_eof() {
            at = json.trim_end().len();
        } else {
            // It stops inside a word such as `nan`; the fault is the word.
            at -= json[..at].bytes().rev().take_while(u8::is_ascii_alphabetic).count();
        }
        let width = if error.is_eof() { 0 } else { json[at..].chars().next().map_or(0, char::len_utf8) };
        let message = error.to_string();
        let said = message.split(" at line ").next().unwrap_or("");
        self.refusal(
            self.span(text, at, at + width),
            "",
            &format!("not JSON ({said})"),
            "must be JSON (RFC 8259)",
            syntax_hint(json, at, error),
        )
    }
}

fn syntax_hint(json: &str, at: usize, error: &serde_json::Error) -> &'static str {
    let rest = &json[at..];
    let before = json[..at].trim_end();
    if error.is_eof() {
        "the file ends too early: close every bracket, brace and quote"
    } else if before.ends_with(',') && rest.starts_with([']', '}'])
        || error.to_string().starts_with("trailing comma")
    {
        "remove the comma before the closing bracket"
    } else if rest.starts_with("//") || rest.starts_with("/*") || rest.starts_with('#') {
        "JSON has no comments; use \"description\""
    } else if rest.starts_with(['N', 'I', 'n', 'i']) || rest.starts_with("-I") || before.ends_with('-') {
        "numbers must be finite and written out; formulas and units go in quotes, as \"pi/2\" or \"90 deg\""
    } else if error.to_string().starts_with("control character") {
        match rest.find(|c: char| c.is_ascii_control()).map(|at| rest.as_bytes()[at]) {
            Some(b'\t') => "write \\t for a tab inside of quotes",
            Some(byte) if !matches!(byte, b'\n' | b'\r') => {
                "leave it out, or write it as \\u and four hexadecimal digits"
            }
            _ => "this text is not closed by a quote on its line",
        }
    } else if rest.starts_with(|c: char| c.is_ascii_digit())
        && before.strip_suffix(',').is_some_and(|before| before.ends_with(|c: char| c.is_ascii_digit()))
    {
        "decimals are written with a point, as 0.6"
    } else if rest.starts_with(['+', '.', '\'']) {
        "write 0.5, not .5 or +0.5, and put text in double quotes"
    } else if rest.starts_with(['{', '[']) && error.to_string().starts_with("trailing characters") {
        "the scene ends before it, and a file holds one scene"
    } else if rest.starts_with(['"', '{', '[']) && before.ends_with(',') {
        "a bracket or brace before it closes too early"
    } else if rest.starts_with(['"', '{', '[']) {
        "a comma or colon seems to be missing before it"
    } else {
        "compare with a file in examples/scenes/"
    }
}

/// Line and column, from 1, of a byte; columns count characters.
pub(super) fn position(text: &str, byte: usize) -> (usize, usize) {
    let before = text.get(..byte).unwrap_or(text);
    let line = before.bytes().filter(|&b| b == b'\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
    (line, column)
}

/// A text on one line, printable, and at most [`SHOWN`] characters long.
pub(super) fn clipped(text: &str) -> String {
    if text.len() <= SHOWN && text.bytes().all(|byte| matches!(byte, b' '..=b'~')) {
        return text.to_owned();
    }
    let mut shown = String::new();
    for (count, word) in text.chars().enumerate() {
        if count == SHOWN {
            shown.push('…');
            break;
        }
        shown.push(if word.is_control() { ' ' } else { word });
    }
    shown
}

struct Locator<'a> {
    source: &'a Texts,
    text: usize,
    json: &'a str,
    at: usize,
    path: String,
}

impl Locator<'_> {
    fn value(&mut self, depth: usize) -> Result<Located, SceneError> {
        self.skip_space();
        let start = self.at;
        let value = match self.peek() {
            Some(b'{' | b'[') if depth == DEEPEST => {
                let span = self.span(start, start + 1);
                let hint = "a scene never needs more than six levels of brackets";
                let allowed = format!("at most {DEEPEST} levels are read");
                return Err(self.source.refusal(span, &self.path, "is nested too deeply", &allowed, hint));
            }
            Some(b'{') => self.object(depth)?,
            Some(b'[') => self.list(depth)?,
            Some(b'"') => Value::Text(self.string()?.0),
            Some(b't') => self.word(4, Value::Truth),
            Some(b'f') => self.word(5, Value::Truth),
            Some(b'n') => self.word(4, Value::Null),
            _ => self.number()?,
        };
        Ok(Located { span: self.span(start, self.at), value })
    }

    fn object(&mut self, depth: usize) -> Result<Value, SceneError> {
        let mut members: Vec<Member> = Vec::new();
        let mut seen = HashMap::new();
        let parent = self.path.len();
        self.at += 1;
        loop {
            self.skip_space();
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b'"') => {
                    let (key, span) = self.string()?;
                    let written =
                        self.source.written(self.span(span.start as usize + 1, span.end as usize - 1));
                    push_key(&mut self.path, &written);
                    if let Some(first) = twice(&members, &mut seen, &key) {
                        let hint =
                            format!("it stands first at {}; remove one of the two", self.source.place(first));
                        return Err(self.source.refusal(
                            span,
                            &self.path,
                            "appears twice",
                            "each key may appear once in an object",
                            &hint,
                        ));
                    }
                    self.skip_space();
                    self.at += 1;
                    let node = self.value(depth + 1)?;
                    members.push(Member { key, span, node });
                    self.path.truncate(parent);
                }
                _ => break,
            }
        }
        self.at += 1;
        Ok(Value::Object(members))
    }

    fn list(&mut self, depth: usize) -> Result<Value, SceneError> {
        let mut nodes = Vec::new();
        let parent = self.path.len();
        self.at += 1;
        loop {
            self.skip_space();
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b']') | None => break,
                Some(_) => {
                    push_index(&mut self.path, nodes.len());
                    nodes.push(self.value(depth + 1)?);
                    self.path.truncate(parent);
                }
            }
        }
        self.at += 1;
        Ok(Value::List(nodes))
    }

    /// A string, decoded, and its place with the quotes.
    fn string(&mut self) -> Result<(String, Span), SceneError> {
        let start = self.at;
        self.at += 1;
        loop {
            match self.peek() {
                Some(b'\\') => self.at += 2,
                Some(b'"') | None => break,
                Some(_) => self.at += 1,
            }
        }
        self.at = (self.at + 1).min(self.json.len());
        let span = self.span(start, self.at);
        let written = self.json.get(start..self.at).unwrap_or("");
        let quoted = written.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
        if let Some(plain) = quoted.filter(|quoted| !quoted.contains('\\')) {
            return Ok((plain.to_owned(), span));
        }
        let decoded = serde_json::from_str(written).map_err(|_| {
            let hint = "write a character above U+FFFF as itself, or as both halves of its surrogate pair";
            self.source.refused_value(span, &self.path, "must be valid Unicode", hint)
        })?;
        Ok((decoded, span))
    }

    fn number(&mut self) -> Result<Value, SceneError> {
        let start = self.at;
        while let Some(b'0'..=b'9' | b'-' | b'+' | b'.' | b'e' | b'E') = self.peek() {
            self.at += 1;
        }
        let span = self.span(start, self.at);
        let written = self.json.get(start..self.at).unwrap_or("");
        let number = written.parse().map_err(|_| {
            self.source.refused_value(
                span,
                &self.path,
                "must be a JSON value",
                "compare with a file in examples/scenes/",
            )
        })?;
        Ok(Value::Number(number))
    }

    fn word(&mut self, letters: usize, value: Value) -> Value {
        self.at = (self.at + letters).min(self.json.len());
        value
    }

    fn skip_space(&mut self) {
        while let Some(b' ' | b'\t' | b'\r' | b'\n') = self.peek() {
            self.at += 1;
        }
    }

    fn peek(&self) -> Option<u8> {
        self.json.as_bytes().get(self.at).copied()
    }

    fn span(&self, start: usize, end: usize) -> Span {
        self.source.span(self.text, start, end)
    }
}

/// Where a key stands among the members of its object so far; `seen` are those beyond the first few.
fn twice(members: &[Member], seen: &mut HashMap<String, Span>, key: &str) -> Option<Span> {
    let (few, others) = members.split_at(members.len().min(FEW));
    if let Some(member) = others.last() {
        seen.insert(member.key.clone(), member.span);
    }
    few.iter().find(|member| member.key == key).map(|member| member.span).or_else(|| seen.get(key).copied())
}

/// Appends a key to a path: `bars[0]` and `name` to `bars[0].name`.
pub(super) fn push_key(path: &mut String, key: &str) {
    if !path.is_empty() {
        path.push('.');
    }
    path.push_str(key);
}

/// Appends an index to a path: `bars` and 0 to `bars[0]`.
pub(super) fn push_index(path: &mut String, index: usize) {
    // Writing to a text does not fail.
    let _ = write!(path, "[{index}]");
}
