//! The dependencies between the crates of the workspace, and external dependencies that only some crates may have.

use std::{collections::BTreeMap, process::Command};

/// Each crate with the crates of the workspace on which it may depend: the table of ARCHITECTURE.md.
const ALLOWED: [(&str, &[&str]); 20] = [
    ("bansho-base", &[]),
    ("bansho-sph", &["bansho-base"]),
    ("bansho-fluid", &["bansho-base"]),
    // No phenomenon depends on another.
    ("bansho-fire", &["bansho-base", "bansho-fluid", "bansho-sph"]),
    ("bansho-rain", &["bansho-base"]),
    ("bansho-aurora", &["bansho-base", "bansho-sph"]),
    ("bansho-environment", &["bansho-base"]),
    // `scene` and `render` do not depend on phenomena: `bansho` lists their kinds.
    ("bansho-scene", &["bansho-base"]),
    ("bansho-render", &["bansho-base", "bansho-scene"]),
    ("bansho-media", &["bansho-base"]),
    // A job draws and writes files, so `bansho` depends on `media`, behind the feature `files`.
    (
        "bansho",
        &[
            "bansho-base",
            "bansho-sph",
            "bansho-fluid",
            "bansho-fire",
            "bansho-rain",
            "bansho-aurora",
            "bansho-environment",
            "bansho-scene",
            "bansho-render",
            "bansho-media",
        ],
    ),
    ("bansho-example-scenes", &[]),
    ("bansho-farm", &["bansho"]),
    ("bansho-cli", &["bansho", "bansho-farm", "bansho-example-scenes"]),
    ("bansho-egui-software", &[]),
    ("bansho-studio", &["bansho", "bansho-example-scenes", "bansho-egui-software"]),
    ("bansho-studio-bindgen", &[]),
    // Only a feature of its own turns `workspace-hack` on: what users install does not have it.
    ("bansho-python", &["bansho", "workspace-hack"]),
    ("workspace-hack", &[]),
    ("xtask", &[]),
];

/// External dependencies with the crates that may have them.
const RESERVED: [(&str, &[&str]); 9] = [
    ("wgpu", &["bansho-studio"]),
    ("egui", &["bansho-egui-software"]),
    ("eframe", &["bansho-studio"]),
    ("clap", &["bansho-cli"]),
    ("clap_complete", &["bansho-cli"]),
    ("clap_mangen", &["bansho-cli"]),
    ("indicatif", &["bansho-cli"]),
    ("anyhow", &["bansho-cli"]),
    ("signal-hook", &["bansho-cli"]),
];

/// A dependency of a crate, except development dependencies.
struct Dependency {
    name: String,
    optional: bool,
}

fn workspace() -> BTreeMap<String, Vec<Dependency>> {
    let arguments = ["metadata", "--format-version", "1", "--no-deps", "--offline"];
    let output = Command::new(env!("CARGO")).args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    let dependencies = |package: &serde_json::Value| {
        let all = package["dependencies"].as_array().unwrap();
        let own = all.iter().filter(|dependency| dependency["kind"] != "dev");
        own.map(|d| Dependency { name: text(&d["name"]), optional: d["optional"] == true }).collect()
    };
    let packages = metadata["packages"].as_array().unwrap();
    packages.iter().map(|package| (text(&package["name"]), dependencies(package))).collect()
}

/// All violations of the rules.
fn violations(workspace: &BTreeMap<String, Vec<Dependency>>) -> Vec<String> {
    let mut violations = Vec::new();
    for (name, dependencies) in workspace {
        let Some((_, known)) = ALLOWED.iter().find(|(known, _)| known == name) else {
            violations.push(format!("{name} is not listed: add its allowed dependencies here"));
            continue;
        };
        for dependency in dependencies.iter().map(|dependency| dependency.name.as_str()) {
            if workspace.contains_key(dependency) && !known.contains(&dependency) {
                violations.push(format!("{name} may not depend on {dependency}"));
            }
            let reserved = RESERVED.iter().find(|(reserved, _)| *reserved == dependency);
            if reserved.is_some_and(|(_, owners)| !owners.contains(&name.as_str())) {
                violations.push(format!("{name} may not use {dependency}"));
            }
        }
    }
    violations
}

#[test]
fn crates_have_only_allowed_dependencies() {
    let workspace = workspace();
    assert!(workspace.len() >= 6, "{:?}", workspace.keys());
    assert_eq!(violations(&workspace), Vec::<String>::new());
    let media = workspace["bansho"].iter().find(|dependency| dependency.name == "bansho-media");
    assert!(media.is_some_and(|media| media.optional), "embedders must be able to disable file access");
    let hack = workspace["bansho-python"].iter().find(|dependency| dependency.name == "workspace-hack");
    assert!(hack.is_some_and(|hack| hack.optional), "what is installed has only the features that it needs");
}

/// The crates of ARCHITECTURE.md with their allowed dependencies, in the order of the table.
fn described(page: &str) -> Vec<(String, Vec<String>)> {
    let package = |name: &str| {
        if ["bansho", "workspace-hack", "xtask"].contains(&name) { name.to_owned() } else { format!("bansho-{name}") }
    };
    let mut crates: Vec<(String, Vec<String>)> = Vec::new();
    for line in page.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let name = package(cells[1].trim_matches('`'));
        let may_use = match cells[cells.len() - 2] {
            "nothing" => Vec::new(),
            "all above" => crates.iter().map(|(above, _)| above.clone()).collect(),
            some => some.split(", ").map(|name| package(name.trim_matches('`'))).collect(),
        };
        crates.push((name, may_use));
    }
    crates
}

#[test]
fn the_architecture_lists_the_same_dependencies() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../ARCHITECTURE.md");
    let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
    let sorted = |mut crates: Vec<(String, Vec<String>)>| {
        crates.iter_mut().for_each(|(_, names)| names.sort());
        crates.sort();
        crates
    };
    let allowed = ALLOWED.iter().map(|(name, known)| ((*name).to_owned(), owned(known))).collect();
    assert_eq!(sorted(described(&std::fs::read_to_string(page).unwrap())), sorted(allowed));
}

#[test]
fn violations_are_found() {
    let dependency = |name: &str| Dependency { name: name.to_owned(), optional: false };
    let workspace = BTreeMap::from([
        ("bansho-base".to_owned(), vec![dependency("clap"), dependency("bansho-cli"), dependency("glam")]),
        ("bansho-cli".to_owned(), vec![dependency("clap")]),
        ("bansho-extra".to_owned(), Vec::new()),
    ]);
    assert_eq!(
        violations(&workspace),
        [
            "bansho-base may not use clap",
            "bansho-base may not depend on bansho-cli",
            "bansho-extra is not listed: add its allowed dependencies here",
        ]
    );
}
