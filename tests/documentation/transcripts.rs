//! Commands shown with what they print: run again, and compared line by line.
//!
//! In a block ```` ```console ```` each line that begins with `$ ` is a command, what follows is what it
//! prints, messages first.  Blocks ```` ```json NAME ```` of the same page are files of the folder the
//! commands run in.  Durations are not compared.

use super::pages::{Page, root};
use super::program::Program;

/// Runs the commands of a page in one folder, in their order; the page as it should be.
pub fn played(page: &Page) -> String {
    let program = Program::new();
    let scenes = root().join("examples/scenes");
    std::fs::create_dir_all(program.path("examples/scenes")).expect("a folder");
    for entry in std::fs::read_dir(scenes).expect("scenes").flatten() {
        let to = program.path("examples/scenes").join(entry.file_name());
        std::fs::copy(entry.path(), to).expect("a copy");
    }
    let mut text = String::new();
    let mut blocks = page.blocks().into_iter();
    let mut inside: Option<bool> = None;
    for line in page.text.lines() {
        let fence = line.trim_start().starts_with("```");
        match (fence, inside) {
            (true, None) => {
                let block = blocks.next().expect("a block for each fence");
                let console = block.info == "console";
                if let Some(name) = block.info.strip_prefix("json ") {
                    program.write(name, &block.text);
                }
                push(&mut text, line);
                if console {
                    text.push_str(&replayed(&block.text, &program));
                }
                inside = Some(console);
            }
            (true, Some(_)) => {
                push(&mut text, line);
                inside = None;
            }
            (false, Some(true)) => {}
            (false, _) => push(&mut text, line),
        }
    }
    text
}

fn push(text: &mut String, line: &str) {
    text.push_str(line);
    text.push('\n');
}

/// The commands of a block with what they print now; a line that differs in durations only stays as it is.
fn replayed(block: &str, program: &Program) -> String {
    let mut text = String::new();
    let shown: Vec<&str> = block.lines().collect();
    let begins: Vec<usize> = (0..shown.len()).filter(|&index| shown[index].starts_with("$ ")).collect();
    assert!(begins.first() == Some(&0), "a console block begins with a command: {block}");
    for (number, &begin) in begins.iter().enumerate() {
        let end = begins.get(number + 1).copied().unwrap_or(shown.len());
        push(&mut text, shown[begin]);
        let command = shown[begin].trim_start_matches("$ ");
        let arguments = command
            .strip_prefix("driftless ")
            .unwrap_or_else(|| panic!("not a command of the program: {command}"));
        let ran = program.run(arguments);
        let printed = ran.stderr + &ran.stdout;
        let printed: Vec<&str> = printed.lines().map(str::trim_end).collect();
        let before = &shown[begin + 1..end];
        let same = before.len() == printed.len()
            && before.iter().zip(&printed).all(|(old, new)| masked(old) == masked(new));
        (if same { before } else { &printed[..] }).iter().for_each(|line| push(&mut text, line));
    }
    text
}

/// A line without the numbers of its durations.
fn masked(line: &str) -> String {
    if !line.starts_with("cost ") {
        return line.to_owned();
    }
    let words = line.split(' ').map(|word| if word.parse::<f64>().is_ok() { "#" } else { word });
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ")
}
