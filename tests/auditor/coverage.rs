//! The table of what was compared with what, so that a blind spot shows.

use super::mechanisms::Kind;
use super::pairs::{Summary, total_of};
use driftless::run::METHODS;
use std::fmt::Write;

impl Summary {
    /// Tables in Markdown: kinds with methods, kinds with kinds, and what never met.
    pub fn tables(&self, seed: u64) -> String {
        let kinds = Kind::ALL;
        let mut text = format!(
            "{} pairs of a scene and a method, seed {seed}: {} compared, {} of them with walls; {} agree and {} differ; {} runs report themselves, {} pairs are unclear.\n\n",
            self.total,
            self.agreeing + self.differing.len(),
            self.with_walls,
            self.agreeing,
            self.differing.len(),
            total_of(&self.reported),
            total_of(&self.unclear)
        );
        let at = |kind: Kind, method: &'static str| self.methods.get(&(kind, method)).copied().unwrap_or(0);
        let names: Vec<&'static str> = METHODS.iter().map(|info| info.name).collect();
        let _ =
            writeln!(text, "Compared pairs by kind and method:\n\n| no. | kind | {} |", names.join(" | "));
        let _ = writeln!(text, "|{}", " --- |".repeat(names.len() + 2));
        for (number, &kind) in kinds.iter().enumerate() {
            let counts: Vec<String> = names.iter().map(|name| at(kind, name).to_string()).collect();
            let _ = writeln!(text, "| {} | {} | {} |", number + 1, kind.name(), counts.join(" | "));
        }
        let both = |a: Kind, b: Kind| self.kinds.get(&(a.min(b), a.max(b))).copied().unwrap_or(0);
        let _ = writeln!(
            text,
            "\nCompared pairs by two kinds, numbered as above; on the diagonal those of one:\n\n```text"
        );
        let _ = writeln!(
            text,
            "    {}",
            (1..=kinds.len()).map(|number| format!("{number:5}")).collect::<String>()
        );
        for (number, &a) in kinds.iter().enumerate() {
            let row: String = kinds[..=number].iter().map(|&b| format!("{:5}", both(a, b))).collect();
            let _ = writeln!(text, "{:4}{row}", number + 1);
        }
        let _ = writeln!(text, "```\n");
        let mut never = Vec::new();
        for (number, &a) in kinds.iter().enumerate() {
            for &b in kinds[..number].iter().filter(|&&b| a.goes_with(b) && both(a, b) == 0) {
                never.push(format!("{} with {}", b.name(), a.name()));
            }
        }
        let _ = writeln!(
            text,
            "Pairs of kinds that never met: {}.",
            if never.is_empty() { "none".into() } else { never.join(", ") }
        );
        let possible = kinds.len() * (kinds.len() + 1) / 2 * names.len();
        let _ = writeln!(
            text,
            "\nOf {possible} triples of two kinds and a method {} were compared.",
            self.triples.len()
        );
        text
    }
}
