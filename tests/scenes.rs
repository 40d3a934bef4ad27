//! Scenes: those shipped read and round-trip; everything else is refused at the right place, with a hint.

use driftless::scene::read_scene;
use std::path::{Path, PathBuf};

fn shipped() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder).expect("folder of scenes").map(|entry| entry.expect("entry").path()).collect();
    files.retain(|file| file.extension().is_some_and(|end| end == "json"));
    files.sort();
    files
}

#[test]
fn every_shipped_scene_reads() {
    let files = shipped();
    assert_eq!(files.len(), 10);
    for file in files {
        match read_scene(&file, &[]) {
            Ok(scene) => assert_eq!(Some(scene.name.as_str()), file.file_stem().and_then(|stem| stem.to_str())),
            Err(error) => panic!("{error}"),
        }
    }
}
