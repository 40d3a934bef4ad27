//! The table of methods.

use super::page::Page;
use crate::run::METHODS;
use crate::run::methods::Stepping;
use serde_json::{Value, json};

/// One object a method, in the order of [`METHODS`].
pub fn object() -> Value {
    json!({ "methods": METHODS })
}

/// The table as text.
pub fn text() -> String {
    let mut page = Page::default();
    for info in METHODS {
        let step = match info.stepping {
            Stepping::Adaptive => "adaptive step",
            Stepping::Fixed => "fixed step",
        };
        let symplectic = if info.symplectic { ", symplectic" } else { "" };
        page.entry(info.name, &format!("order {}, {step}{symplectic}", info.order));
        page.entry("", &format!("{}; scene: {}", info.purpose, info.needs));
    }
    page.into_text()
}
