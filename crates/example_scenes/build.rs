//! Embeds the scenes of `scenes/` and of its folders `papers/NAME/`, and the meshes that they name. Of plates it embeds the paths.

use std::{
    collections::{BTreeMap, BTreeSet},
    env,
    error::Error,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

/// The keys whose values are paths of pictures.
const PLATE_KEYS: [&str; 4] = ["image", "depth", "albedo", "normal"];

/// A file that a scene names.
struct NamedFile {
    /// The path, relative to the scene.
    path: String,
    is_plate: bool,
}

impl NamedFile {
    /// The file of a line such as `image = "plates/hearth.png"`.
    fn of_line(line: &str) -> Option<Self> {
        let (key, value) = line.split_once('=')?;
        let path = value.trim().strip_prefix('"')?.split('"').next()?.to_owned();
        let is_plate = PLATE_KEYS.contains(&key.trim());
        (is_plate || key.trim() == "file").then_some(Self { path, is_plate })
    }
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

/// What is written into the program, each by the path that scenes name, which is relative to the scene.
#[derive(Default)]
struct Embedded {
    /// The code of each scene, by name.
    scenes: BTreeMap<String, String>,
    /// Files whose bytes are embedded.
    assets: BTreeMap<String, PathBuf>,
    /// Plates, by their paths within the folder of scenes.
    plates: BTreeMap<String, String>,
}

impl Embedded {
    fn add_scene(&mut self, folder: &Path, path: &Path) -> Result<(), Box<dyn Error>> {
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(path)?;
        let files: Vec<NamedFile> = text.lines().filter_map(NamedFile::of_line).collect();
        let paths: Vec<&str> = files.iter().map(|file| file.path.as_str()).collect();
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let code =
            format!("    ExampleScene {{ name: {name:?}, text: include_str!({path:?}), asset_paths: &{paths:?} }},\n");
        if self.scenes.insert(name, code).is_some() {
            return Err(format!("{}: another scene has this name", path.display()).into());
        }
        files.into_iter().try_for_each(|file| self.add_file(folder, path, file))
    }

    /// Adds a file that the scene in the file `scene` names. A path stands for one content, whatever scene names it.
    fn add_file(&mut self, folder: &Path, scene: &Path, named: NamedFile) -> Result<(), Box<dyn Error>> {
        let file = scene.with_file_name(&named.path);
        let other = if named.is_plate {
            let within = file.strip_prefix(folder)?.to_string_lossy().replace('\\', "/");
            folder.join(self.plates.entry(named.path).or_insert(within))
        } else {
            self.assets.entry(named.path).or_insert_with(|| file.clone()).clone()
        };
        // The published crate has no plates.
        let is_same = other == file || (named.is_plate && !file.exists()) || fs::read(&other)? == fs::read(&file)?;
        if is_same { Ok(()) } else { Err(format!("{} differs from {}", file.display(), other.display()).into()) }
    }

    /// The code of the module.
    fn code(self) -> Result<String, std::fmt::Error> {
        let mut code = String::from("/// Every example scene, by name.\npub const SCENES: &[ExampleScene] = &[\n");
        code.extend(self.scenes.into_values());
        code.push_str("];\n\n");
        // Scenes in several folders name one file by several paths.
        let files: BTreeSet<&PathBuf> = self.assets.values().collect();
        let files: BTreeMap<&PathBuf, String> =
            files.into_iter().enumerate().map(|(index, file)| (file, format!("FILE_{index}"))).collect();
        for (file, constant) in &files {
            writeln!(code, "static {constant}: &[u8] = include_bytes!({file:?});")?;
        }
        code.push_str("\nstatic ASSETS: &[(&str, &[u8])] = &[\n");
        for (path, file) in &self.assets {
            writeln!(code, "    ({path:?}, {}),", files[file])?;
        }
        code.push_str("];\n\nconst PLATES: &[(&str, &str)] = &[\n");
        for (path, within) in &self.plates {
            writeln!(code, "    ({path:?}, {within:?}),")?;
        }
        code.push_str("];\n");
        Ok(code)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = folder()?;
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut embedded = Embedded::default();
    for path in scene_files(&folder)? {
        embedded.add_scene(&folder, &path)?;
    }
    fs::write(Path::new(&env::var("OUT_DIR")?).join("scenes.rs"), embedded.code()?)?;
    Ok(())
}
