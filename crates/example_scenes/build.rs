//! Embeds the scenes of `scenes/` and the files that they name.

use std::{
    collections::BTreeSet,
    env,
    error::Error,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

/// The path between the quotes of a line such as `image = "plates/hearth.png"`.
fn asset(line: &str) -> Option<&str> {
    let (key, value) = line.split_once('=')?;
    let path = value.trim().strip_prefix('"')?.split('"').next()?;
    ["image", "depth", "file"].contains(&key.trim()).then_some(path)
}

/// The folder of scenes: a symbolic link in the repository, a folder in the published crate. Where Git does not make links, it is a file.
fn folder() -> Result<PathBuf, Box<dyn Error>> {
    let own = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("scenes");
    Ok(if own.is_dir() { own } else { own.with_file_name("../../scenes") })
}

fn scene_files(folder: &Path) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let mut files = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, std::io::Error>>()?;
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    Ok(files)
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = folder()?;
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut assets = BTreeSet::new();
    let mut scenes = String::new();
    for path in scene_files(&folder)? {
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(&path)?;
        let named: Vec<String> = text.lines().filter_map(asset).map(str::to_owned).collect();
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        writeln!(
            scenes,
            "    ExampleScene {{ name: {name:?}, text: include_str!({path:?}), asset_paths: &{named:?} }},"
        )?;
        assets.extend(named);
    }
    let mut code = format!("/// Every example scene, by name.\npub const SCENES: &[ExampleScene] = &[\n{scenes}];\n\n");
    code.push_str("const ASSETS: &[(&str, &[u8])] = &[\n");
    for path in &assets {
        writeln!(code, "    ({path:?}, include_bytes!({:?})),", folder.join(path))?;
    }
    code.push_str("];\n");
    fs::write(Path::new(&env::var("OUT_DIR")?).join("scenes.rs"), code)?;
    Ok(())
}
