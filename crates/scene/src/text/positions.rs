//! Where a scene's text states its phenomena.

use std::collections::HashMap;

use bansho_base::parameters::Table;

use super::{lines::Lines, toml};
use crate::{Scene, check};

/// Finds the places of many phenomena with one look at the text.
pub struct Positions<'t> {
    root: Option<Table>,
    lines: Lines<'t>,
    /// Where each phenomenon stands in its list: `rain.1`.
    paths: HashMap<String, String>,
}

impl<'t> Positions<'t> {
    /// For the phenomena of `scene`, whose text is `text`.
    #[must_use]
    pub fn new(scene: &Scene, text: &'t str) -> Self {
        let mut counts: HashMap<&str, usize> = HashMap::new();
        let path = |instance: &crate::Instance| {
            let index = counts.entry(instance.kind.key).or_default();
            *index += 1;
            (instance.name.clone(), format!("{}.{}", instance.kind.key, *index - 1))
        };
        let paths = scene.instances.iter().map(path).collect();
        Self { root: toml::parse(text).ok(), lines: Lines::new(text), paths }
    }

    /// Where the text states the parameter `key` of the phenomenon `name`, or the nearest part of it: one-based line and column; of the
    /// plate where that is the name. None where it states no such phenomenon.
    pub fn of(&mut self, name: &str, key: Option<&str>) -> Option<(usize, usize)> {
        let root = self.root.as_ref()?;
        let span = if name == check::PLATE_LAYER {
            check::place(root, name)?
        } else {
            let rest = key.map_or_else(String::new, |key| format!(".{key}"));
            check::place(root, &format!("{}{rest}", self.paths.get(name)?))?
        };
        Some(self.lines.position(span.start))
    }
}
