//! `bansho new`

use std::{
    fs::OpenOptions,
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use bansho::{
    KINDS,
    base::parameters::nearest,
    render::scene::{FORMAT, template},
};

use crate::{
    args::NewArgs,
    examples::{EXAMPLES, Example},
    output::to_stdout,
};

/// There is no example of that name.
#[derive(Debug, thiserror::Error)]
#[error("there is no example `{name}`{hint}; allowed: {allowed}")]
pub(crate) struct UnknownExample {
    name: String,
    hint: String,
    allowed: String,
}

/// Writes a scene, or lists those that can be copied.
pub(crate) fn run(args: &NewArgs) -> anyhow::Result<()> {
    let Some(name) = &args.name else { return Ok(to_stdout(&list())?) };
    let path = with_extension(name);
    match args.from.as_deref().map(find).transpose()? {
        None => create(&path, commented().as_bytes())?,
        Some(example) => {
            create(&path, example.text.as_bytes())?;
            copy_assets(example, path.parent().unwrap_or(Path::new("")))?;
        }
    }
    Ok(to_stdout(&format!("{0}: written. Draw it: bansho render {0}\n", path.display()))?)
}

fn list() -> String {
    EXAMPLES.iter().map(|example| format!("{:18} {}\n", example.name, example.about())).collect()
}

fn find(name: &str) -> Result<&'static Example, UnknownExample> {
    EXAMPLES.iter().find(|example| example.name == name).ok_or_else(|| {
        let names = || EXAMPLES.iter().map(|example| example.name);
        UnknownExample {
            name: name.to_owned(),
            hint: nearest(name, names()).map(|name| format!(", did you mean `{name}`?")).unwrap_or_default(),
            allowed: names().collect::<Vec<_>>().join(", "),
        }
    })
}

/// The first kind of phenomenon with every setting explained; an empty scene where there is none.
fn commented() -> String {
    KINDS.first().map_or_else(|| format!("bansho = {FORMAT}\n"), template::commented)
}

fn with_extension(name: &Path) -> PathBuf {
    if name.extension().is_some() { name.to_path_buf() } else { name.with_extension("toml") }
}

/// Writes a new file; one that is there already may hold someone's work.
fn create(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let shown = path.display();
    let opened = OpenOptions::new().write(true).create_new(true).open(path);
    let mut file = opened.map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => anyhow::anyhow!("{shown}: is there already; choose another name"),
        _ => anyhow::Error::new(error).context(format!("{shown}: cannot be written")),
    })?;
    file.write_all(bytes).with_context(|| format!("{shown}: cannot be written"))
}

/// Writes the pictures that an example names; those that are there already stay as they are.
fn copy_assets(example: &Example, folder: &Path) -> anyhow::Result<()> {
    for asset in example.assets {
        let path = folder.join(asset.path);
        if !path.exists() {
            bansho::media::atomic::write_bytes(&path, asset.bytes)?;
        }
    }
    Ok(())
}
