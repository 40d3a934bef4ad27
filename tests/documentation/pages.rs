//! The pages: the README and the chapters below `docs/`, cut into prose, code blocks, links and headings.

use super::reference::slug;
use std::path::{Path, PathBuf};

/// The folder of the package.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// One page.
pub struct Page {
    /// Path below the package, with `/`.
    pub name: String,
    pub text: String,
}

/// A fenced block of code.
pub struct Block {
    /// What follows the fence: language, and a file's name where there is one.
    pub info: String,
    /// Number of its first line of text.
    pub line: usize,
    pub text: String,
}

/// Prose of a page: a line of it, and its number.
pub struct Line<'a> {
    pub number: usize,
    pub text: &'a str,
}

impl Page {
    fn read(name: &str) -> Self {
        let text =
            std::fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        Self { name: name.to_owned(), text }
    }

    /// The README and every chapter.
    pub fn all() -> Vec<Self> {
        let mut names: Vec<_> = std::fs::read_dir(root().join("docs"))
            .expect("docs/")
            .filter_map(|entry| entry.expect("an entry").file_name().into_string().ok())
            .filter(|name| name.ends_with(".md"))
            .map(|name| format!("docs/{name}"))
            .collect();
        names.push("README.md".to_owned());
        names.sort();
        names.iter().map(|name| Self::read(name)).collect()
    }

    pub fn one(name: &str) -> Self {
        Self::read(name)
    }

    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut inside = false;
        for (index, line) in self.text.lines().enumerate() {
            match line.trim_start().strip_prefix("```") {
                Some(_) if inside => inside = false,
                Some(info) => {
                    blocks.push(Block { info: info.trim().to_owned(), line: index + 2, text: String::new() });
                    inside = true;
                }
                None if inside => {
                    let block = blocks.last_mut().expect("an open block");
                    block.text.push_str(line);
                    block.text.push('\n');
                }
                None => {}
            }
        }
        assert!(!inside, "{}: a block of code has no end", self.name);
        blocks
    }

    /// The lines outside code blocks.
    pub fn prose(&self) -> Vec<Line<'_>> {
        let mut inside = false;
        let mut lines = Vec::new();
        for (index, text) in self.text.lines().enumerate() {
            if text.trim_start().starts_with("```") {
                inside = !inside;
            } else if !inside {
                lines.push(Line { number: index + 1, text });
            }
        }
        lines
    }

    /// Targets of links and pictures in the prose, with their lines.
    pub fn links(&self) -> Vec<(usize, String)> {
        let mut links = Vec::new();
        for line in self.prose() {
            let text = without_code(line.text);
            for rest in text.split("](").skip(1) {
                let target = rest.split(')').next().unwrap_or("");
                links.push((line.number, target.to_owned()));
            }
        }
        links
    }

    /// Anchors of the headings.
    pub fn anchors(&self) -> Vec<String> {
        let headings = self.prose().into_iter().filter_map(|line| {
            let heading = line.text.trim_start_matches('#');
            (heading.len() < line.text.len() && heading.starts_with(' ')).then(|| slug(heading.trim()))
        });
        let slugs: Vec<_> = headings.collect();
        let anchor = |(index, slug): (usize, &String)| match slugs[..index]
            .iter()
            .filter(|before| *before == slug)
            .count()
        {
            0 => slug.clone(),
            same => format!("{slug}-{same}"),
        };
        slugs.iter().enumerate().map(anchor).collect()
    }

    /// Pieces of inline code, with their lines.
    pub fn inline_code(&self) -> Vec<(usize, String)> {
        let mut pieces = Vec::new();
        for line in self.prose() {
            assert!(
                line.text.matches('`').count() % 2 == 0,
                "{}:{}: code goes on in the next line",
                self.name,
                line.number
            );
            pieces.extend(line.text.split('`').skip(1).step_by(2).map(|code| (line.number, code.to_owned())));
        }
        pieces
    }

    /// The file a link of this page leads to, and the anchor in it.
    pub fn target(&self, link: &str) -> (PathBuf, Option<String>) {
        let (file, anchor) =
            link.split_once('#').map_or((link, None), |(file, anchor)| (file, Some(anchor.to_owned())));
        let folder = root().join(&self.name).parent().expect("a folder").to_path_buf();
        (if file.is_empty() { root().join(&self.name) } else { folder.join(file) }, anchor)
    }
}

/// A line with its inline code blanked out.
fn without_code(line: &str) -> String {
    line.split('`').enumerate().map(|(index, piece)| if index % 2 == 0 { piece } else { "code" }).collect()
}
