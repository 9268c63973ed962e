//! Puts the scenes of `scenes/` into the program, with the plates and meshes they name, so that `bansho new --from` needs no files.

use std::{
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

fn example(scenes: &Path, path: &Path) -> Result<Option<String>, Box<dyn Error>> {
    let text = fs::read_to_string(path)?;
    let mut assets = String::new();
    for relative in text.lines().filter_map(asset) {
        let file = scenes.join(relative);
        // A sequence or a picture that is not shipped cannot travel with the program.
        if !file.is_file() {
            return Ok(None);
        }
        write!(assets, "Asset {{ path: {relative:?}, bytes: include_bytes!({file:?}) }}, ")?;
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    Ok(Some(format!("    Example {{ name: {name:?}, text: include_str!({path:?}), assets: &[{assets}] }},\n")))
}

fn main() -> Result<(), Box<dyn Error>> {
    let scenes = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../../scenes");
    println!("cargo::rerun-if-changed={}", scenes.display());
    let mut paths: Vec<PathBuf> = match fs::read_dir(&scenes) {
        Ok(entries) => entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>()?,
        Err(_) => Vec::new(),
    };
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    let mut code = String::from(
        "/// Every scene that comes with the program, by name.\npub(crate) const EXAMPLES: &[Example] = &[\n",
    );
    for path in &paths {
        code.push_str(&example(&scenes, path)?.unwrap_or_default());
    }
    code.push_str("];\n");
    fs::write(Path::new(&env::var("OUT_DIR")?).join("examples.rs"), code)?;
    Ok(())
}
