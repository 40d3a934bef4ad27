//! Why a scene was refused, in a form for people and one for programs.

use super::locate::position;
use serde::Serialize;
use std::fmt;

/// The widest piece of a line shown \[characters\].
const WIDEST: usize = 96;

/// Why a scene was refused: one [`Refusal`], shown as
///
/// ```text
/// free.json:7:31: bars[1].density = -670: must be a number from 1e-30 to 1e30 kg/m³
///   7 |     {"name": "bar2", "density": -670, "length": 0.6},
///     |                                 ^^^^
///   hint: for example "density": 670
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct SceneError(Box<Refusal>);

/// What a scene was refused for; serializes to an object with these fields.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Refusal {
    /// The file, as it was named.
    pub file: String,
    /// The `--set` option the refused value came from; then there is no line.
    pub set: Option<String>,
    /// Line, from 1; none where the file could not be read.
    pub line: Option<usize>,
    /// Column, from 1, in characters.
    pub column: Option<usize>,
    /// The field, as in `bars[1].density`; empty where the whole text is at fault.
    pub path: String,
    /// The value as written, shortened where long; none where one is missing or the key is at fault.
    pub value: Option<String>,
    /// What is wrong, in words that follow the path: `= -670`, `is missing`, `closes a loop`.
    pub problem: String,
    /// What is allowed, with its unit.
    pub allowed: String,
    /// What to try.
    pub hint: String,
    #[serde(skip)]
    pub(super) excerpt: Option<Excerpt>,
    #[serde(skip)]
    pub(super) io: bool,
}

/// A line of the file and the marks under it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Excerpt {
    line: usize,
    shown: String,
    indent: usize,
    width: usize,
}

impl SceneError {
    /// The same with another hint.
    pub(super) fn with_hint(mut self, hint: String) -> Self {
        self.0.hint = hint;
        self
    }

    /// What the scene was refused for.
    pub fn refusal(&self) -> &Refusal {
        &self.0
    }

    /// True where the file could not be read at all, false where what it says is at fault.
    pub fn is_io(&self) -> bool {
        self.0.io
    }

    pub(super) fn with_value(mut self, value: String) -> Self {
        self.0.value = Some(value);
        self
    }

    /// A file that cannot be read.
    pub(super) fn unreadable(file: &str, error: &std::io::Error) -> Self {
        let hint = match error.kind() {
            std::io::ErrorKind::NotFound => {
                "check the path; the scenes that come with the program are in examples/scenes/"
            }
            std::io::ErrorKind::PermissionDenied => "check who may read the file",
            _ => "give the path of a JSON file",
        };
        let mut refused =
            Self::whole_file(file, &format!("cannot be read ({error})"), "must be a readable file", hint);
        refused.0.io = true;
        refused
    }

    /// A file refused for what it is, not for one of its lines.
    pub(super) fn whole_file(file: &str, problem: &str, allowed: &str, hint: &str) -> Self {
        Self::from(Refusal {
            file: file.to_owned(),
            problem: problem.to_owned(),
            allowed: allowed.to_owned(),
            hint: hint.to_owned(),
            ..Refusal::default()
        })
    }
}

impl From<Refusal> for SceneError {
    fn from(refusal: Refusal) -> Self {
        Self(Box::new(refusal))
    }
}

impl std::error::Error for SceneError {}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Refusal { file, set, line, column, path, problem, allowed, hint, excerpt, .. } = self.refusal();
        write!(f, "{file}")?;
        if let (Some(line), Some(column)) = (line, column) {
            write!(f, ":{line}:{column}")?;
        }
        if let Some(set) = set {
            write!(f, " with {set}")?;
        }
        let gap = if path.is_empty() { "" } else { " " };
        write!(f, ": {path}{gap}{problem}: {allowed}")?;
        if let Some(Excerpt { line, shown, indent, width }) = excerpt {
            let margin = line.to_string().len();
            write!(f, "\n  {line} | {shown}\n  {:margin$} | {:indent$}{}", "", "", "^".repeat(*width))?;
        }
        write!(f, "\n  hint: {hint}")
    }
}

impl Excerpt {
    /// The line at byte `start`, cut to a window where it is long, with marks up to byte `end` or the end of
    /// the line.
    pub(super) fn of(text: &str, start: usize, end: usize) -> Self {
        let (line, column) = position(text, start);
        let whole = text.split('\n').nth(line - 1).unwrap_or("").trim_end_matches('\r');
        let marked = text.get(start..end).unwrap_or("").lines().next().unwrap_or("").chars().count();
        let characters: Vec<char> = whole.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let at = (column - 1).min(characters.len());
        let from = at.saturating_sub(WIDEST / 3).min(characters.len().saturating_sub(WIDEST));
        let to = characters.len().min(from + WIDEST);
        let (before, after) = (if from > 0 { "…" } else { "" }, if to < characters.len() { "…" } else { "" });
        let shown = format!("{before}{}{after}", characters[from..to].iter().collect::<String>());
        let indent = at - from + before.chars().count();
        Self { line, shown, indent, width: marked.min(to - at).max(1) }
    }
}
