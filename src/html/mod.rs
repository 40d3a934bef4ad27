//! Plain data in, one self-contained HTML page out: nothing is fetched from anywhere, and nothing runs in it
//! but the two scripts it is shipped with.
//!
//! The page is `assets/page.html` with `page.css` and `page.js`; charts are drawn by uPlot (L. Sorokin, MIT
//! licence), which stands in `assets/` unchanged.  A content security policy names both scripts by their
//! hashes, so that no text of a scene can become one.

mod columns;

pub use columns::PackedColumn;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use columns::{deflated, pack};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::io;

const FRAME: &str = include_str!("assets/page.html");
const STYLE: &str = include_str!("assets/page.css");
const SCRIPT: &str = include_str!("assets/page.js");
const CHARTS_STYLE: &str = include_str!("assets/uPlot.min.css");
const CHARTS_SCRIPT: &str = include_str!("assets/uPlot.min.js");
const CHARTS_LICENCE: &str = include_str!("assets/uPlot.LICENSE");

/// A page: what its script is told, and the tables it draws from.
#[derive(Clone, Debug, Default)]
pub struct Document {
    /// Title of the window.
    pub title: String,
    /// What `page.js` reads, but for the packing of the tables, which is added as `tables`.
    pub data: Value,
    /// Tables, each with columns of one length.
    pub tables: Vec<Vec<PackedColumn>>,
}

impl Document {
    /// The page.
    ///
    /// # Errors
    /// None in practice: everything is made in memory.
    pub fn html(&self) -> io::Result<Vec<u8>> {
        let mut data = self.data.clone();
        let mut packed = Vec::new();
        let mut bytes = Vec::new();
        for table in &self.tables {
            let columns: Vec<Value> = table.iter().map(|column| described(column, &mut bytes)).collect();
            packed.push(
                json!({"rows": table.first().map_or(0, |column| column.values.len()), "columns": columns}),
            );
        }
        data["tables"] = json!(packed);
        let styles = [CHARTS_STYLE, STYLE];
        let scripts = [CHARTS_SCRIPT, SCRIPT];
        let hashes = |texts: [&str; 2]| {
            texts.map(|text| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text)))).join(" ")
        };
        let policy = format!(
            "default-src 'none'; script-src {}; style-src {}; base-uri 'none'; form-action 'none'",
            hashes(scripts),
            hashes(styles)
        );
        let parts = [
            ("policy", policy),
            ("title", escaped(&self.title)),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("licence", CHARTS_LICENCE.trim().to_owned()),
            ("charts-style", CHARTS_STYLE.to_owned()),
            ("style", STYLE.to_owned()),
            // The only sign that could end the element early.
            ("data", data.to_string().replace('<', "\\u003c")),
            ("numbers", STANDARD.encode(deflated(&bytes)?)),
            ("charts-script", CHARTS_SCRIPT.to_owned()),
            ("script", SCRIPT.to_owned()),
        ];
        Ok(filled(FRAME, &parts).into_bytes())
    }
}

/// A column as the script finds it; its bytes are appended.
fn described(column: &PackedColumn, bytes: &mut Vec<u8>) -> Value {
    let begin = bytes.len();
    let packing = pack(column, bytes);
    json!({
        "name": column.name,
        "unit": column.unit,
        "log": column.is_logarithm,
        "offset": packing.offset,
        "quantum": packing.quantum,
        "order": packing.order,
        "planes": packing.planes,
        "begin": begin,
    })
}

/// The frame with its places `{{name}}` filled, each in one go: what is put in is not looked at again.
fn filled(frame: &str, parts: &[(&str, String)]) -> String {
    let mut text = String::new();
    let mut pieces = frame.split("{{");
    text.push_str(pieces.next().unwrap_or_default());
    for piece in pieces {
        let (name, rest) = piece.split_once("}}").unwrap_or(("", piece));
        let part = parts.iter().find(|(known, _)| *known == name);
        debug_assert!(part.is_some(), "the frame has a place {name}");
        text.push_str(part.map_or("", |(_, part)| part));
        text.push_str(rest);
    }
    text
}

/// Text between tags.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_leaves_its_place() {
        let hostile = "</title></script><script>alert(1)</script>{{script}}\"'&";
        let data = json!({"runs": [{"title": hostile, hostile: 1}]});
        let column = PackedColumn { name: hostile.into(), values: vec![1.0], ..PackedColumn::default() };
        let page = Document { title: hostile.into(), data, tables: vec![vec![column]] };
        let html = String::from_utf8(page.html().expect("memory")).expect("text");
        assert_eq!(html.matches("alert(1)</script>").count(), 0);
        // Data, numbers, charts, page.
        assert_eq!(html.matches("<script").count(), 4);
        assert_eq!(html.matches("</script>").count(), 4);
        assert_eq!(html.matches("</title>").count(), 1);
        assert_eq!(
            html.matches("\nconst ").count() > 0,
            html.contains("{{script}}"),
            "the page's script once, the text as it was"
        );
    }

    #[test]
    fn shipped_parts_do_not_end_their_elements() {
        for part in [CHARTS_SCRIPT, SCRIPT] {
            assert!(!part.contains("</script") && !part.contains("<!--"));
        }
        assert!(!CHARTS_LICENCE.contains("--"));
        let addresses = [SCRIPT, STYLE, FRAME].map(|part| part.matches("http").count());
        assert_eq!(addresses, [0, 0, 1], "the http of http-equiv");
    }
}
