//! `bansho new`

use std::path::{Path, PathBuf};

use bansho::{
    KINDS,
    base::{host::printable::printable, parameters::nearest, phenomenon::kind::PhenomenonKind},
    media::{MediaError, files::atomic},
    scene::template,
};

use bansho_example_scenes::{ExampleScene, SCENES};

use crate::{args::NewArgs, output::to_stdout};

/// There is no example or phenomenon of that name.
#[derive(Debug, thiserror::Error)]
#[error("there is no {what} `{name}`{hint}; allowed: {allowed}")]
pub(crate) struct Unknown {
    what: &'static str,
    name: String,
    hint: String,
    allowed: String,
}

impl Unknown {
    fn new(what: &'static str, name: &str, known: &[&str]) -> Self {
        Self {
            what,
            name: name.to_owned(),
            hint: nearest(name, known.iter().copied())
                .map(|name| format!(", did you mean `{name}`?"))
                .unwrap_or_default(),
            allowed: known.join(", "),
        }
    }
}

/// Writes a scene, or lists those that can be copied.
pub(crate) fn run(args: &NewArgs) -> anyhow::Result<()> {
    let Some(name) = &args.name else { return Ok(to_stdout(&list())?) };
    let path = with_extension(name);
    match args.from.as_deref().map(find).transpose()? {
        None => atomic::write_new(&path, text(kind(args.kind.as_deref())?, args.all).as_bytes())?,
        Some(example) => {
            atomic::write_new(&path, example.text.as_bytes())?;
            copy_assets(example, path.parent().unwrap_or(Path::new("")))?;
        }
    }
    Ok(to_stdout(&format!("{0}: written. Draw it: bansho render {0}\n", printable(&path.display().to_string())))?)
}

/// A new scene of a kind: all of its settings, or a short one that says how to get them.
fn text(kind: &PhenomenonKind, all: bool) -> String {
    if all {
        return template::commented(kind);
    }
    let more =
        format!("\n# What one changes first; `bansho new NAME --kind {} --all` writes every setting.\n", kind.key);
    template::short(kind).replacen('\n', &more, 1)
}

fn list() -> String {
    SCENES.iter().map(|scene| format!("{:18} {}\n", scene.name, scene.summary())).collect()
}

fn find(name: &str) -> Result<&'static ExampleScene, Unknown> {
    let names: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
    bansho_example_scenes::find(name).ok_or_else(|| Unknown::new("example", name, &names))
}

/// The kind of phenomenon of that name; the first one where none is named.
fn kind(name: Option<&str>) -> Result<&'static PhenomenonKind, Unknown> {
    let names: Vec<&str> = KINDS.iter().map(|kind| kind.key).collect();
    let name = name.unwrap_or(names[0]);
    KINDS.iter().find(|kind| kind.key == name).ok_or_else(|| Unknown::new("phenomenon", name, &names))
}

fn with_extension(name: &Path) -> PathBuf {
    if name.extension().is_some() { name.to_path_buf() } else { name.with_extension("toml") }
}

/// Writes the pictures that an example names; those that are there already stay as they are.
fn copy_assets(example: &ExampleScene, folder: &Path) -> anyhow::Result<()> {
    for (path, bytes) in example.assets() {
        match atomic::write_new(&folder.join(path), bytes) {
            Err(MediaError::AlreadyExists { .. }) => {}
            written => written?,
        }
    }
    Ok(())
}
