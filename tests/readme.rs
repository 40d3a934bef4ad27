//! What the README says is there, is there.

use driftless::run::METHODS;
use std::path::Path;

fn readme() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).expect("a README")
}

#[test]
fn every_method_stands_in_its_table() {
    let readme = readme();
    for info in METHODS {
        assert!(readme.contains(&format!("`{}`", info.name)), "{} is missing", info.name);
    }
}

#[test]
fn every_file_it_links_to_exists() {
    let readme = readme();
    let links = readme.split("](").skip(1).filter_map(|rest| rest.split(')').next()).filter(|link| !link.starts_with("http"));
    let mut count = 0;
    for link in links {
        assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(link).exists(), "{link} does not exist");
        count += 1;
    }
    assert!(count > 5);
}

#[test]
fn every_example_stands_in_its_table() {
    let readme = readme();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    for entry in std::fs::read_dir(folder).expect("examples").filter_map(Result::ok) {
        let path = entry.path();
        if let (Some("rs"), Some(name)) = (path.extension().and_then(|x| x.to_str()), path.file_stem().and_then(|x| x.to_str())) {
            assert!(readme.contains(&format!("`{name}`")), "{name} is missing");
        }
    }
}
