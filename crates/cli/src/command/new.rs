//! `bansho new`

use std::path::{Path, PathBuf};

use bansho::{
    KINDS,
    base::{host::printable::printable, parameters::nearest, tables::TableKind},
    media::{MediaError, files::atomic},
    phenomena,
    scene::template,
};

use bansho_example_scenes::{ExampleScene, SCENES, SceneFile};

use crate::{
    args::NewArgs,
    exit::UsageError,
    output::{print, shell_word},
};

/// The error for an unknown `name` of an example or a phenomenon.
fn unknown(kind: &str, name: &str, known: &[&str]) -> UsageError {
    let hint = nearest(name, known.iter().copied()).map(|name| format!(", did you mean `{name}`?")).unwrap_or_default();
    UsageError(format!("there is no {kind} `{name}`{hint}; allowed: {}", known.join(", ")))
}

/// Writes a new scene, or lists the examples.
pub(crate) fn run(args: &NewArgs) -> anyhow::Result<()> {
    let Some(name) = &args.name else { return Ok(print(&list())?) };
    let path = with_extension(name);
    match args.from.as_deref().map(find).transpose()? {
        None => atomic::write_new(&path, text(kind(args.kind.as_deref())?, args.all).as_bytes())?,
        Some(example) => {
            // Before anything is written: a scene without its plates could not be drawn.
            let assets = example.read_assets()?;
            atomic::write_new(&path, example.text.as_bytes())?;
            write_assets(&assets, path.parent().unwrap_or(Path::new("")))?;
        }
    }
    let shown = path.display().to_string();
    Ok(print(&format!("{}: written. Draw it: bansho render {}\n", printable(&shown), shell_word(&path)))?)
}

/// The text of a new scene: with all settings, or a short one with a comment how to get all.
fn text(kind: &TableKind, all: bool) -> String {
    if all {
        return template::commented(kind, KINDS);
    }
    let more = format!(
        "\n# The settings that are changed most often; `bansho new NAME --kind {} --all` writes every setting.\n",
        kind.key
    );
    template::short(kind, KINDS).replacen('\n', &more, 1)
}

fn list() -> String {
    let width = SCENES.iter().map(|scene| scene.name.len()).max().unwrap_or(0);
    SCENES.iter().map(|scene| format!("{:width$} {}\n", scene.name, scene.summary())).collect()
}

fn find(name: &str) -> Result<&'static ExampleScene, UsageError> {
    let names: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
    bansho_example_scenes::find(name).ok_or_else(|| unknown("example", name, &names))
}

/// The kind of phenomenon with this name; without a name, the first one.
fn kind(name: Option<&str>) -> Result<&'static TableKind, UsageError> {
    let names: Vec<&str> = phenomena().map(|kind| kind.key).collect();
    let name = name.unwrap_or(names[0]);
    phenomena().find(|kind| kind.key == name).ok_or_else(|| unknown("phenomenon", name, &names))
}

fn with_extension(name: &Path) -> PathBuf {
    if name.extension().is_some() { name.to_path_buf() } else { name.with_extension("toml") }
}

/// Writes the files that an example names. Existing files are kept.
fn write_assets(assets: &[SceneFile], folder: &Path) -> anyhow::Result<()> {
    for (path, bytes) in assets {
        match atomic::write_new(&folder.join(path), bytes) {
            Err(MediaError::AlreadyExists { .. }) => {}
            written => written?,
        }
    }
    Ok(())
}
