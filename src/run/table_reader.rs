//! Tables of numbers read back from their files.

use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Why a table cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The first line names no columns.
    #[error("{}:1: no names of columns", file.display())]
    Header {
        /// The file.
        file: PathBuf,
    },
    /// A row has another number of fields than the header.
    #[error("{}:{line}: {found} fields, {expected} columns", file.display())]
    Fields {
        /// The file.
        file: PathBuf,
        /// Line, from 1 on.
        line: u64,
        /// Fields there.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// A field is no number.
    #[error("{}:{line}: {column}: `{value}` is no number", file.display())]
    Number {
        /// The file.
        file: PathBuf,
        /// Line, from 1 on.
        line: u64,
        /// Name of the column.
        column: String,
        /// What stands there.
        value: String,
    },
}

/// Reads a table row by row.
#[derive(Debug)]
pub struct TableReader {
    file: PathBuf,
    reader: BufReader<File>,
    names: Vec<String>,
    wanted: Vec<bool>,
    line: u64,
    text: Vec<u8>,
}

impl TableReader {
    /// Opens a table and reads the names of its columns.
    ///
    /// # Errors
    /// The file cannot be read, or has no header.
    pub fn open(path: &Path) -> Result<Self, TableError> {
        let failed = |source| TableError::File { file: path.to_owned(), source };
        let mut reader = BufReader::with_capacity(1 << 18, File::open(path).map_err(failed)?);
        let mut text = Vec::new();
        reader.read_until(b'\n', &mut text).map_err(failed)?;
        // Names may hold commas and quotes.
        let mut header = csv::ReaderBuilder::new().has_headers(false).from_reader(&text[..]);
        let names: Vec<String> = match header.records().next() {
            Some(Ok(record)) => record.iter().map(str::to_owned).collect(),
            _ => return Err(TableError::Header { file: path.to_owned() }),
        };
        let wanted = vec![true; names.len()];
        Ok(Self { file: path.to_owned(), reader, names, wanted, line: 1, text })
    }

    /// Names of the columns, with their units in brackets.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Reads these columns alone; the others are zero in every row.
    pub fn only(&mut self, columns: impl IntoIterator<Item = usize>) {
        self.wanted.fill(false);
        columns.into_iter().for_each(|column| self.wanted[column] = true);
    }

    /// Reads the next row in place of `row`; false after the last.  An empty field is not a number.
    ///
    /// # Errors
    /// The file cannot be read, or a row does not fit the header.
    pub fn next(&mut self, row: &mut Vec<f64>) -> Result<bool, TableError> {
        self.text.clear();
        let read = self.reader.read_until(b'\n', &mut self.text);
        if read.map_err(|source| TableError::File { file: self.file.clone(), source })? == 0 {
            return Ok(false);
        }
        self.line += 1;
        let line = self.text.strip_suffix(b"\n").unwrap_or(&self.text);
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        row.clear();
        let mut count = 0;
        for field in line.split(|&byte| byte == b',') {
            let value = match self.wanted.get(count) {
                Some(true) => number(field).ok_or_else(|| TableError::Number {
                    file: self.file.clone(),
                    line: self.line,
                    column: self.names[count].clone(),
                    value: String::from_utf8_lossy(field).chars().take(40).collect(),
                })?,
                _ => 0.0,
            };
            row.push(value);
            count += 1;
        }
        let expected = self.names.len();
        if count != expected {
            return Err(TableError::Fields {
                file: self.file.clone(),
                line: self.line,
                found: count,
                expected,
            });
        }
        Ok(true)
    }
}

fn number(field: &[u8]) -> Option<f64> {
    if field.is_empty() {
        return Some(f64::NAN);
    }
    std::str::from_utf8(field).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> (tempfile::TempDir, Result<TableReader, TableError>) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("t.csv");
        std::fs::write(&path, text).expect("written");
        let reader = TableReader::open(&path);
        (folder, reader)
    }

    #[test]
    fn rows_come_back_to_the_bit_and_wrong_ones_are_named() {
        let (_folder, reader) = table("t [s],\"a,\"\"b\"\" [m]\"\n0,0.1\r\n1,\n2,5e-324\n3,x\n4\n");
        let mut reader = reader.expect("a header");
        assert_eq!(reader.names(), ["t [s]", "a,\"b\" [m]"]);
        let mut row = Vec::new();
        assert!(reader.next(&mut row).expect("a row") && row == [0.0, 0.1]);
        assert!(reader.next(&mut row).expect("a row") && row[1].is_nan());
        assert!(reader.next(&mut row).expect("a row") && row[1] == 5e-324);
        let wrong = reader.next(&mut row).expect_err("no number").to_string();
        assert!(wrong.ends_with("t.csv:5: a,\"b\" [m]: `x` is no number"), "{wrong}");
        let short = reader.next(&mut row).expect_err("a field").to_string();
        assert!(short.ends_with("t.csv:6: 1 fields, 2 columns"), "{short}");
        assert!(!reader.next(&mut row).expect("the end"));
    }

    #[test]
    fn columns_not_asked_for_are_not_read() {
        let (_folder, reader) = table("a,b\nrubbish,2\n");
        let mut reader = reader.expect("a header");
        reader.only([1]);
        let mut row = Vec::new();
        assert!(reader.next(&mut row).expect("a row"));
        assert_eq!(row, [0.0, 2.0]);
    }

    #[test]
    fn a_file_without_columns_is_refused() {
        assert!(matches!(table("").1, Err(TableError::Header { .. })));
        assert!(matches!(TableReader::open("/no/such/file".as_ref()), Err(TableError::File { .. })));
    }
}
