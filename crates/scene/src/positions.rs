//! The positions of phenomena and their parameters in the text of a scene.

use std::collections::HashMap;

use bansho_base::parameters::Table;

use crate::{
    Instance, LineColumn, Scene,
    check::PLATE_LAYER,
    text::{lines::Lines, path::nearest_span, toml},
};

/// Finds the positions of any number of phenomena. The text is parsed once.
pub struct Positions<'t> {
    root: Option<Table>,
    lines: Lines<'t>,
    /// The path of each phenomenon, such as `rain.1`, by its name.
    paths: HashMap<String, String>,
}

impl<'t> Positions<'t> {
    /// For the phenomena of `scene`, whose text is `text`.
    #[must_use]
    pub fn new(scene: &Scene, text: &'t str) -> Self {
        let mut counts: HashMap<&str, usize> = HashMap::new();
        let path = |instance: &Instance| {
            let index = counts.entry(instance.kind.key).or_default();
            *index += 1;
            (instance.name.clone(), format!("{}.{}", instance.kind.key, *index - 1))
        };
        let paths = scene.instances.iter().map(path).collect();
        Self { root: toml::parse(text).ok(), lines: Lines::new(text), paths }
    }

    /// Line and column of the parameter `key` of the phenomenon `name`, or of the nearest table above it that the text contains. The name of the
    /// plate is [`PLATE_LAYER`]. `None` if the text does not contain the phenomenon.
    pub fn find(&mut self, name: &str, key: Option<&str>) -> Option<LineColumn> {
        let root = self.root.as_ref()?;
        let span = if name == PLATE_LAYER {
            nearest_span(root, name)?
        } else {
            let rest = key.map_or_else(String::new, |key| format!(".{key}"));
            nearest_span(root, &format!("{}{rest}", self.paths.get(name)?))?
        };
        Some(self.lines.position(span.start))
    }
}
