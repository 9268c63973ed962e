//! The positions of phenomena and their parameters in the text of a scene.

use std::{collections::HashMap, sync::Arc};

use bansho_base::{
    parameters::Table,
    tables::{self, TableKind},
};

use crate::{
    LineColumn, Scene,
    tables::kinds::PLATE_LAYER,
    text::{lines::Lines, path::nearest_span, toml},
};

/// Finds the positions of any number of phenomena. The text is parsed once.
pub struct Positions<'t> {
    root: Option<Table>,
    kinds: Arc<[TableKind]>,
    lines: Lines<'t>,
    /// The path of each phenomenon, such as `rain.1`, by its name.
    paths: HashMap<String, String>,
}

impl<'t> Positions<'t> {
    /// For the phenomena of `scene`, whose text is `text`.
    #[must_use]
    pub fn new(scene: &Scene, text: &'t str) -> Self {
        let mut counts: HashMap<&str, usize> = HashMap::new();
        let mut paths = HashMap::new();
        for instance in &scene.instances {
            // The number of instances of this kind so far is the index of the next one.
            let index = counts.entry(instance.kind.key).or_default();
            paths.insert(instance.name.clone(), format!("{}.{index}", instance.kind.key));
            *index += 1;
        }
        Self { root: toml::parse(text).ok(), kinds: scene.kinds.clone(), lines: Lines::new(text), paths }
    }

    /// Line and column of the parameter `key` of the phenomenon `name`, or of the nearest table above it that the text contains. The name of the
    /// plate is [`PLATE_LAYER`], and tables that are no phenomena have their keys. `None` if the text does not contain the phenomenon.
    pub fn find(&mut self, name: &str, key: Option<&str>) -> Option<LineColumn> {
        let root = self.root.as_ref()?;
        let rest = key.map_or_else(String::new, |key| format!(".{key}"));
        let span = match self.paths.get(name) {
            _ if name == PLATE_LAYER => nearest_span(root, name)?,
            Some(path) => nearest_span(root, &format!("{path}{rest}"))?,
            None if tables::shared(&self.kinds).any(|kind| kind.key == name) => {
                nearest_span(root, &format!("{name}{rest}"))?
            }
            None => return None,
        };
        Some(self.lines.position(span.start))
    }
}
