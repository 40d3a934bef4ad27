//! A page of text for people: labelled entries and small tables, 80 columns wide.

pub(crate) use crate::arithmetic::shown::{figure, magnitude, rough};

/// Columns of a page.
const WIDTH: usize = 80;
/// Columns of the labels.
const LABELS: usize = 15;

/// A page under way.
#[derive(Clone, Debug, Default)]
pub struct Page {
    text: String,
}

impl Page {
    /// A page with a heading.
    pub fn new(name: &str, description: &str) -> Self {
        let mut page = Self::default();
        page.entry(name, description);
        page.text.push('\n');
        page
    }

    /// A labelled entry, wrapped; an empty label continues the entry above.
    pub fn entry(&mut self, label: &str, value: &str) {
        let mut label = label.to_owned();
        if label.chars().count() >= LABELS {
            self.text.push_str(&label);
            self.text.push('\n');
            label.clear();
        }
        for line in wrapped(value, WIDTH - LABELS) {
            let line = format!("{label:LABELS$}{line}");
            self.text.push_str(line.trim_end());
            self.text.push('\n');
            label.clear();
        }
    }

    /// A table under a labelled entry: names left, numbers right; cut into several where it is too wide.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        let widths: Vec<usize> = (0..head.len())
            .map(|k| {
                rows.iter()
                    .filter_map(|row| row.get(k))
                    .map(|cell| cell.chars().count())
                    .fold(head[k].chars().count(), usize::max)
            })
            .collect();
        let mut from = 1;
        while from < head.len() {
            let mut to = from;
            let mut width = 2 + widths[0];
            while to < head.len() && (to == from || width + 2 + widths[to] <= WIDTH) {
                width += 2 + widths[to];
                to += 1;
            }
            let mut line = |cells: &dyn Fn(usize) -> String| {
                let mut line = format!("  {:1$}", cells(0), widths[0]);
                for (k, width) in widths.iter().enumerate().take(to).skip(from) {
                    line.push_str(&format!("  {:>width$}", cells(k)));
                }
                self.text.push_str(line.trim_end());
                self.text.push('\n');
            };
            line(&|k| head[k].to_owned());
            for row in rows {
                line(&|k| row.get(k).cloned().unwrap_or_default());
            }
            from = to;
        }
    }

    /// The text, ending with a line break.
    pub fn into_text(self) -> String {
        self.text
    }
}

/// Lines of at most `width` characters where words allow it; at least one line.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        let used = lines[last].chars().count();
        if used > 0 && used + 1 + word.chars().count() > width {
            lines.push(word.to_owned());
        } else {
            if used > 0 {
                lines[last].push(' ');
            }
            lines[last].push_str(word);
        }
    }
    lines
}

/// So many of something: `1 point`, `4096 points`.
pub fn counted(count: u64, one: &str, many: &str) -> String {
    if count == 1 { format!("1 {one}") } else { format!("{count} {many}") }
}

/// A number and its uncertainty with the same decimals, as far as two digits of the uncertainty reach:
/// `1.15` and `0.24`.
pub fn with_uncertainty(x: f64, uncertainty: f64) -> [String; 2] {
    let size = uncertainty.abs();
    if !(1e-9..1e6).contains(&size) || x.is_nan() || x.abs() >= 1e6 {
        return [figure(x), magnitude(uncertainty)];
    }
    let decimals = (1 - size.log10().floor() as i32).clamp(0, 9) as usize;
    // No sign before a zero.
    let x = if x.abs() < 0.5 * 10_f64.powi(-(decimals as i32)) { 0.0 } else { x };
    [format!("{x:.decimals$}"), format!("{uncertainty:.decimals$}")]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_decimals_of_its_uncertainty() {
        for (x, uncertainty, shown) in [
            (1.153, 0.24, ["1.15", "0.24"]),
            (1.153, 0.0024, ["1.1530", "0.0024"]),
            (-0.000_01, 0.03, ["0.000", "0.030"]),
            (153.2, 12.4, ["153", "12"]),
            (2.0, 0.0, ["2", "0"]),
            (2.0, 3e-14, ["2", "3.0e-14"]),
            (2.0, f64::INFINITY, ["2", "infinite"]),
        ] {
            assert_eq!(with_uncertainty(x, uncertainty), shown);
        }
    }

    #[test]
    fn no_line_is_wider_than_the_page() {
        let mut page = Page::new("name", &"several words ".repeat(20));
        page.entry("a label longer than its column", "value");
        let head: Vec<String> = (0..12).map(|k| format!("column {k}")).collect();
        let head: Vec<&str> = head.iter().map(String::as_str).collect();
        page.table(&head, &[vec!["1.2345678".into(); 12], vec!["2".into(); 12]]);
        let text = page.into_text();
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(text.contains("column 11") && text.contains("\na label longer"));
    }
}
