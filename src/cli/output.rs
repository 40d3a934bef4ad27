//! Writing to stdout and stderr, where a reader that went away is no failure.

use super::failure::{Exit, Failure};
use crate::run::Folder;
use serde_json::{Value, json};
use std::io::{ErrorKind, Write};

/// Prints data.
///
/// # Errors
/// Stdout cannot take it; a closed pipe is not an error, for whoever closed it has seen enough.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::new(Exit::Io, format!("cannot write to stdout: {error}")).told())
        }
        _ => Ok(()),
    }
}

/// Prints one JSON object.
///
/// # Errors
/// As [`print`].
pub fn print_object(object: &Value) -> Result<(), Failure> {
    print(&format!("{object:#}\n"))
}

/// Says in an object which folder it stands in, and which files.
pub fn name_files(object: &mut Value, folder: &Folder) {
    object["folder"] = json!(folder.path().display().to_string());
    object["files"] = json!(folder.files().iter().map(|file| file.display().to_string()).collect::<Vec<_>>());
}

/// Prints a message on stderr; nobody can be told where that fails.
pub fn message(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Prints one object as it is, several as the `runs` of one.
pub fn print_objects(mut objects: Vec<Value>) -> Result<(), Failure> {
    match objects.pop() {
        Some(only) if objects.is_empty() => print_object(&only),
        last => {
            objects.extend(last);
            print_object(&json!({ "runs": objects }))
        }
    }
}
