//! Puts the playground into one file that needs nothing else: `page CORE.wasm OUT.html SCENE.json …`.

#[cfg(target_arch = "wasm32")]
fn main() {}

#[cfg(not(target_arch = "wasm32"))]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    use base64::{Engine as _, engine::general_purpose::STANDARD};
    use sha2::{Digest, Sha256};
    use std::io::Write;

    const FRAME: &str = include_str!("../../assets/playground.html");
    const STYLES: [&str; 3] = [
        include_str!("../../../src/html/assets/uPlot.min.css"),
        include_str!("../../../src/html/assets/page.css"),
        include_str!("../../assets/playground.css"),
    ];
    const SCRIPTS: [&str; 3] = [
        include_str!("../../../src/html/assets/uPlot.min.js"),
        include_str!("../../assets/playground.js"),
        include_str!("../../../src/html/assets/page.js"),
    ];
    const LICENCE: &str = include_str!("../../../src/html/assets/uPlot.LICENSE");

    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [core, out, scenes @ ..] = &arguments[..] else {
        return Err("page CORE.wasm OUT.html SCENE.json …".into());
    };
    let mut deflated = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    deflated.write_all(&std::fs::read(core)?)?;
    let scenes = scenes.iter().map(std::fs::read_to_string).collect::<Result<Vec<_>, _>>()?;
    let data = serde_json::json!({"kind": "playground", "scenes": scenes});
    let hash = |text: &str| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text)));
    let tags = |name: &str, texts: [&str; 3]| texts.map(|text| format!("<{name}>{text}</{name}>")).join("\n");
    let policy = format!(
        "default-src 'none'; script-src 'wasm-unsafe-eval' {}; style-src {}; base-uri 'none'; form-action 'none'",
        SCRIPTS.map(hash).join(" "),
        STYLES.map(hash).join(" ")
    );
    let parts = [
        ("policy", policy),
        ("styles", tags("style", STYLES)),
        // The only sign that could end the element early.
        ("data", data.to_string().replace('<', "\\u003c")),
        ("numbers", STANDARD.encode(deflated.finish()?)),
        ("licence", LICENCE.trim().to_owned()),
        ("scripts", tags("script", SCRIPTS)),
    ];
    let mut pieces = FRAME.split("{{");
    let mut page = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let (name, rest) = piece.split_once("}}").ok_or("a place without an end")?;
        page += &parts.iter().find(|(known, _)| *known == name).ok_or("an unknown place")?.1;
        page += rest;
    }
    Ok(std::fs::write(out, page)?)
}
