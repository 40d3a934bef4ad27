//! The README and the chapters below `docs/` are true of the program: tables, links, commands, scenes, and
//! what the tutorial shows.
//!
//! `UPDATE_DOCS=1 cargo test --test documentation` writes `docs/scene-reference.md` and the transcripts of
//! commands anew.
#![cfg(feature = "cli")]

#[path = "documentation/pages.rs"]
mod pages;
#[path = "common/program.rs"]
#[allow(dead_code)]
mod program;
#[path = "documentation/reference.rs"]
mod reference;
#[path = "documentation/transcripts.rs"]
mod transcripts;

use pages::{Page, root};
use program::Program;
use serde_json::Value;
use std::collections::BTreeSet;

/// Longest line of prose, in characters.
const WIDTH: usize = 110;
/// Most lines of a source.
const LONGEST_FILE: usize = 450;
/// The only names of two types: what a scene says of a force and the trait for one's own, and pairs of which
/// only one is compiled, by features and by the processor.
const SHARED_NAMES: [&str; 4] = ["Force", "Hardware", "Pages", "WideHardware"];
/// From here on a page is written by a program, whose lines are as long as its tables.
const GENERATED: [&str; 3] =
    ["<!-- What follows is written by", "<!-- Generated from", "Written by `TABLE=1"];

/// Compares a page with what it should be, or writes it.
fn held(name: &str, wanted: &str) {
    let path = root().join(name);
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, wanted).unwrap_or_else(|error| panic!("{name}: {error}"));
        return;
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    for (number, (old, new)) in found.lines().zip(wanted.lines()).enumerate() {
        assert_eq!(
            old,
            new,
            "{name}, line {}: UPDATE_DOCS=1 cargo test --test documentation writes it anew",
            number + 1
        );
    }
    assert_eq!(
        found.lines().count(),
        wanted.lines().count(),
        "{name}: UPDATE_DOCS=1 cargo test --test documentation"
    );
}

/// Names of the files of a folder with an ending, without it.
fn names(folder: &str, ending: &str) -> Vec<String> {
    let entries = std::fs::read_dir(root().join(folder)).expect(folder).flatten();
    let mut names: Vec<_> = entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix(ending).map(str::to_owned))
        .collect();
    names.sort();
    names
}

#[test]
fn the_scene_reference_is_the_schema() {
    held("docs/scene-reference.md", &reference::page(&Program::new().run("schema").exits(0).object()));
}

#[test]
fn commands_print_what_is_shown() {
    for page in Page::all() {
        if page.blocks().iter().any(|block| block.info == "console") {
            held(&page.name, &transcripts::played(&page));
        }
    }
}

#[test]
fn every_method_stands_in_the_tables_with_its_order_and_step() {
    let methods = Program::new().run("methods --json").exits(0).object();
    for page in [Page::one("README.md"), Page::one("docs/methods.md")] {
        for method in methods["methods"].as_array().expect("methods") {
            let (name, order) =
                (method["name"].as_str().expect("a name"), method["order"].as_u64().expect("an order"));
            let step = method["stepping"].as_str().expect("a stepping");
            let row =
                page.text.lines().find(|line| line.starts_with("| ") && line.contains(&format!("`{name}`")));
            let row = row.unwrap_or_else(|| panic!("{}: no row of a table for {name}", page.name));
            let cells: Vec<_> = row.split('|').map(str::trim).collect();
            let position =
                cells[1].split(", ").position(|cell| cell == format!("`{name}`")).expect("among the names");
            let orders: Vec<_> = cells[2].split(", ").collect();
            let listed = orders.get(position).is_some_and(|given| given.parse() == Ok(order));
            let up_to = orders.len() == 1
                && orders[0].split(" to ").last().and_then(|most| most.parse().ok()) >= Some(order);
            assert!(listed || up_to, "{}: {name} has order {order}: {row}", page.name);
            assert_eq!(cells[3], step, "{}: the step of {name}", page.name);
        }
    }
}

#[test]
fn every_example_and_every_scene_is_listed() {
    for (folder, ending, page) in
        [("examples", ".rs", "docs/library.md"), ("examples/scenes", ".json", "docs/scenes.md")]
    {
        let text = Page::one(page).text;
        for name in names(folder, ending) {
            assert!(text.contains(&format!("`{name}`")), "{page}: {folder}/{name}{ending} is missing");
        }
    }
}

#[test]
fn every_link_leads_somewhere() {
    let mut count = 0;
    for page in Page::all() {
        for (line, link) in page.links() {
            if link.starts_with("https://") {
                continue;
            }
            let (path, anchor) = page.target(&link);
            assert!(path.exists(), "{}:{line}: {link} does not exist", page.name);
            let outside = page.name.starts_with("docs/")
                && !path
                    .canonicalize()
                    .expect("a path")
                    .starts_with(root().join("docs").canonicalize().expect("docs"));
            assert!(!outside, "{}:{line}: {link} is not among the pages of the book", page.name);
            if let Some(anchor) = anchor {
                let name = path
                    .strip_prefix(root())
                    .expect("below the package")
                    .components()
                    .collect::<std::path::PathBuf>();
                let name = name.to_string_lossy().replace('\\', "/").replace("docs/../", "");
                let target = Page::one(&name);
                assert!(target.anchors().contains(&anchor), "{}:{line}: {link}: no such heading", page.name);
            }
            count += 1;
        }
    }
    assert!(count > 50, "{count} links");
}

/// Registries show the README apart from what it links to.
#[cfg(unix)]
#[test]
fn links_of_a_release_are_absolute() {
    let place = std::env::temp_dir().join(format!("driftless-links-{}", std::process::id()));
    std::fs::create_dir_all(place.join("python")).expect("a folder");
    for name in ["README.md", "Cargo.toml", "python/Cargo.toml"] {
        std::fs::copy(root().join(name), place.join(name)).expect(name);
    }
    let script = root().join(".ci/links");
    let run = |url: &str| std::process::Command::new(&script).arg(url).arg(&place).status().expect("bash");
    assert_eq!(run("ftp://example.org").code(), Some(3));
    // A second time changes nothing.
    assert!(
        run("https://example.org/driftless/").success() && run("https://example.org/driftless").success()
    );
    let read = |name: &str| std::fs::read_to_string(place.join(name)).expect(name);
    let (before, after) = (Page::one("README.md").text, read("README.md"));
    let links = |text: &str| text.matches("](").count();
    assert_eq!(after.matches("](https://").count(), links(&before));
    assert_eq!(links(&after), links(&before));
    for manifest in ["Cargo.toml", "python/Cargo.toml"] {
        let lines = read(manifest);
        let named = lines.lines().filter(|line| *line == "repository = \"https://example.org/driftless\"");
        assert_eq!(named.count(), 1, "{manifest}");
    }
    std::fs::remove_dir_all(&place).expect("a folder");
}

#[test]
fn every_page_and_picture_is_used() {
    let summary: BTreeSet<_> =
        Page::one("docs/SUMMARY.md").links().into_iter().map(|(_, link)| link).collect();
    let pages = Page::all();
    for page in &pages {
        if let Some(name) = page.name.strip_prefix("docs/").filter(|name| *name != "SUMMARY.md") {
            assert!(summary.contains(name), "{name} is not in docs/SUMMARY.md");
        }
    }
    let used: BTreeSet<_> =
        pages.iter().flat_map(|page| page.links().into_iter().map(|(_, link)| link)).collect();
    for ending in [".png", ".gif", ".svg"] {
        for name in names("docs/pictures", ending) {
            assert!(
                used.contains(&format!("pictures/{name}{ending}")),
                "docs/pictures/{name}{ending} is on no page"
            );
        }
    }
}

#[test]
fn lines_are_short() {
    for page in Page::all() {
        let own = GENERATED.iter().filter_map(|mark| page.text.find(mark)).min().unwrap_or(page.text.len());
        let own = page.text[..own].lines().count();
        let in_prose =
            page.prose().into_iter().filter(|line| !line.text.starts_with('|') || page.name == "README.md");
        let mut lines: Vec<_> = in_prose.map(|line| (line.number, line.text.to_owned())).collect();
        for block in page.blocks().iter().filter(|block| !matches!(block.info.as_str(), "text" | "console")) {
            lines.extend(
                block.text.lines().enumerate().map(|(index, line)| (block.line + index, line.to_owned())),
            );
        }
        for (number, line) in lines.into_iter().filter(|(number, _)| *number <= own) {
            let width = line.chars().count();
            assert!(width <= WIDTH, "{}:{number}: {width} characters", page.name);
        }
    }
}

/// All sources, with their paths.
fn sources() -> Vec<(std::path::PathBuf, String)> {
    let mut folders = vec![std::path::PathBuf::from("src")];
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder of sources") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let text = std::fs::read_to_string(&path).expect("a source");
                sources.push((path, text));
            }
        }
    }
    assert!(sources.len() > 400, "{} files", sources.len());
    sources
}

/// Of the sources as well, and no file of them is long.
#[test]
fn sources_have_short_lines_and_short_files() {
    for (path, text) in sources() {
        for (number, line) in (1..).zip(text.lines()) {
            let width = line.chars().count();
            assert!(width <= WIDTH, "{}:{number}: {width} characters", path.display());
        }
        let lines = text.lines().count();
        assert!(lines <= LONGEST_FILE, "{}: {lines} lines", path.display());
    }
}

/// A type's name, where a line of a source begins one.
fn type_begun(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let line = match line.strip_prefix("pub") {
        Some(rest) if rest.starts_with('(') => rest.split_once(") ")?.1,
        Some(rest) => rest.trim_start(),
        None => line,
    };
    let rest = ["struct ", "enum ", "trait "].iter().find_map(|word| line.strip_prefix(word))?;
    rest.split(|letter: char| !letter.is_alphanumeric()).next().filter(|name| !name.is_empty())
}

#[test]
fn no_two_types_share_a_name() {
    let mut owners = std::collections::BTreeMap::<String, BTreeSet<String>>::new();
    for (path, text) in sources() {
        for name in text.lines().filter_map(type_begun) {
            owners.entry(name.into()).or_default().insert(path.display().to_string());
        }
    }
    assert!(owners.len() > 800, "{} types", owners.len());
    let shared: Vec<_> = owners
        .iter()
        .filter(|(name, files)| files.len() > 1 && !SHARED_NAMES.contains(&name.as_str()))
        .collect();
    assert!(shared.is_empty(), "{shared:?}");
}

#[test]
fn every_command_line_is_one_the_program_takes() {
    let program = Program::new();
    let mut count = 0;
    for page in Page::all() {
        let mut commands = page.inline_code();
        for block in page.blocks().iter().filter(|block| matches!(block.info.as_str(), "sh" | "console")) {
            let numbered = block.text.lines().enumerate();
            commands.extend(
                numbered.map(|(index, line)| (block.line + index, line.trim_start_matches("$ ").to_owned())),
            );
        }
        for (line, command) in commands {
            let command = command.split(" #").next().unwrap_or("").trim();
            let run = command
                .strip_prefix("cargo run --release -- ")
                .or_else(|| command.strip_prefix("driftless "));
            let Some(arguments) = run else { continue };
            // Help comes after everything before it has been understood.
            let ran = program.run(&format!("{arguments} --help"));
            assert_eq!(ran.code, 0, "{}:{line}: {command}: {}", page.name, ran.stderr);
            count += 1;
        }
    }
    assert!(count > 30, "{count} command lines");
}

#[test]
fn every_option_is_told_and_none_that_is_not() {
    let program = Program::new();
    let help = program.run("--help").exits(0).stdout;
    let commands =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let commands: Vec<_> = commands
        .filter(|line| !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(commands.len() > 9, "{commands:?}");
    let mut known: BTreeSet<String> = BTreeSet::new();
    let told = Page::one("docs/commands.md").text;
    for command in commands {
        assert!(told.contains(&format!("`{command}")), "docs/commands.md: {command} is missing");
        // It takes no options.
        if command == "help" {
            continue;
        }
        let help = program.run(&format!("{command} --help")).exits(0).stdout;
        known.extend(help.lines().filter_map(|line| {
            let line = line.trim_start();
            // After a short form, as in `-q, --quiet`.
            let line = if line.starts_with("--") {
                line
            } else {
                line.split_once(", ").map_or(line, |(_, long)| long)
            };
            let name = line.split([' ', '<']).next().unwrap_or("");
            (name.starts_with("--") && name != "--help").then(|| name.to_owned())
        }));
    }
    for option in &known {
        assert!(told.contains(&format!("`{option}")), "docs/commands.md: {option} is missing");
    }
    // Those of other programs.
    let others = [
        "--release",
        "--locked",
        "--example",
        "--bench",
        "--test",
        "--no-default-features",
        "--features",
        "--all-targets",
        "--help",
    ];
    let others: BTreeSet<_> = others
        .into_iter()
        .chain(["--open", "--ignored", "--nocapture", "--doc", "--tool", "--path", "--angles"])
        .collect();
    for page in Page::all() {
        for (line, code) in page.inline_code() {
            for word in code.split_whitespace().filter(|word| word.len() > 2 && word.starts_with("--")) {
                let word = word.split('=').next().unwrap_or("");
                assert!(
                    known.contains(word) || others.contains(word),
                    "{}:{line}: there is no option {word}",
                    page.name
                );
            }
        }
    }
}

#[test]
fn every_scene_shown_is_one() {
    let mut count = 0;
    for page in Page::all().iter().filter(|page| page.name != "docs/scene-reference.md") {
        let program = Program::new();
        for block in page.blocks().iter().filter(|block| block.info.starts_with("json")) {
            let parsed: Result<Value, _> = serde_json::from_str(&block.text);
            let value = parsed.unwrap_or_else(|error| panic!("{}:{}: {error}", page.name, block.line));
            // A file of that name shows what is said of a mistake.
            if value["bars"].is_array() && block.info != "json broken.json" {
                program.write("shown.json", &block.text);
                let ran = program.run("check shown.json");
                assert_eq!(ran.code, 0, "{}:{}: {}", page.name, block.line, ran.stderr);
                count += 1;
            }
        }
    }
    assert!(count > 2, "{count} scenes");
}

#[test]
fn every_file_named_exists() {
    for page in Page::all() {
        for (line, code) in page.inline_code() {
            let path = code.split_whitespace().next().unwrap_or("");
            let ours = ["src/", "tests/", "examples/", "benches/", "docs/", "fuzz/", ".ci/"]
                .iter()
                .any(|folder| path.starts_with(folder));
            assert!(!ours || root().join(path).exists(), "{}:{line}: {path} does not exist", page.name);
        }
    }
}

#[test]
fn modules_stand_in_the_order_that_imports_follow() {
    let imports = std::fs::read_to_string(root().join(".ci/imports")).expect(".ci/imports");
    let modules = imports
        .lines()
        .find_map(|line| line.strip_prefix("modules=("))
        .expect("the modules")
        .trim_end_matches(')');
    let text = Page::one("docs/architecture.md").text;
    let rows: Vec<_> = text
        .lines()
        .filter_map(|line| line.strip_prefix("| `").and_then(|rest| rest.split_once("/` |")))
        .map(|(module, _)| module)
        .collect();
    assert_eq!(rows, modules.split_whitespace().collect::<Vec<_>>(), "docs/architecture.md");
}
