//! Embeds the scenes of `scenes/` and of its folders `papers/NAME/`, and the files that they name.

use std::{
    collections::BTreeMap,
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
    ["image", "depth", "albedo", "normal", "file"].contains(&key.trim()).then_some(path)
}

/// The folder of scenes: a symbolic link in the repository, a folder in the published crate. Where Git does not make links, it is a file.
fn folder() -> Result<PathBuf, Box<dyn Error>> {
    let own = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("scenes");
    Ok(if own.is_dir() { own } else { own.with_file_name("../../scenes") })
}

/// The entries of a folder, sorted.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, std::io::Error> {
    let mut paths = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, std::io::Error>>()?;
    paths.sort();
    Ok(paths)
}

/// The scenes of the folder itself, then those of each paper.
fn scene_files(folder: &Path) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let mut files = entries(folder)?;
    for paper in entries(&folder.join("papers"))?.iter().filter(|path| path.is_dir()) {
        println!("cargo::rerun-if-changed={}", paper.display());
        files.extend(entries(paper)?);
    }
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    Ok(files)
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = folder()?;
    println!("cargo::rerun-if-changed={}", folder.display());
    // By the path that scenes name, which is relative to the scene.
    let mut assets: BTreeMap<String, PathBuf> = BTreeMap::new();
    let mut scenes: BTreeMap<String, String> = BTreeMap::new();
    for path in scene_files(&folder)? {
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(&path)?;
        let named: Vec<String> = text.lines().filter_map(asset).map(str::to_owned).collect();
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let code =
            format!("    ExampleScene {{ name: {name:?}, text: include_str!({path:?}), asset_paths: &{named:?} }},\n");
        if scenes.insert(name, code).is_some() {
            return Err(format!("{}: another scene has this name", path.display()).into());
        }
        for relative in named {
            let file = path.with_file_name(&relative);
            let other = assets.entry(relative).or_insert_with(|| file.clone());
            if *other != file && fs::read(&*other)? != fs::read(&file)? {
                return Err(format!("{} differs from {}", file.display(), other.display()).into());
            }
        }
    }
    let mut code = String::from("/// Every example scene, by name.\npub const SCENES: &[ExampleScene] = &[\n");
    code.extend(scenes.into_values());
    code.push_str("];\n\nconst ASSETS: &[(&str, &[u8])] = &[\n");
    for (relative, file) in &assets {
        writeln!(code, "    ({relative:?}, include_bytes!({file:?})),")?;
    }
    code.push_str("];\n");
    fs::write(Path::new(&env::var("OUT_DIR")?).join("scenes.rs"), code)?;
    Ok(())
}
