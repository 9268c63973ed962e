//! What is selected: a table of the scene, whose parameters the inspector shows.

use bansho::{
    KINDS,
    base::parameters::TableDescriptor,
    scene::{SHARED_TABLES, ValuePath},
};

use crate::document::Document;

/// A selected table of the scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Selection {
    /// The table's name in scene files.
    pub(crate) key: &'static str,
    /// Which of that name, where there may be many.
    pub(crate) index: Option<usize>,
}

impl Default for Selection {
    fn default() -> Self {
        Self { key: SHARED_TABLES[0].key, index: None }
    }
}

impl Selection {
    /// The first phenomenon, if there is one.
    pub(crate) fn first_of(document: &Document) -> Self {
        let first = document.phenomena().into_iter().next();
        first.map_or_else(Self::default, |listed| Self { key: listed.kind, index: Some(listed.index) })
    }

    /// Which of `kind` it is, or the first where it is something else.
    pub(crate) fn index_of(&self, kind: &str) -> usize {
        self.index.filter(|_| self.key == kind).unwrap_or_default()
    }

    /// Its path in the document.
    pub(crate) fn place(&self) -> ValuePath {
        let place = ValuePath::root().key(self.key);
        self.index.map_or(place.clone(), |index| place.index(index))
    }

    /// Its title.
    pub(crate) fn title(&self, document: &Document) -> String {
        let listed =
            document.phenomena().into_iter().find(|listed| Some(listed.index) == self.index && listed.kind == self.key);
        match (listed, self.index) {
            (Some(listed), _) => listed.name,
            (None, Some(index)) => format!("{} {}", self.key, index + 1),
            (None, None) => self.key.to_owned(),
        }
    }

    /// Its parameters.
    pub(crate) fn descriptor(&self) -> Option<&'static TableDescriptor> {
        let shared = SHARED_TABLES.iter().find(|table| table.key == self.key).map(|table| (table.table)());
        shared.or_else(|| KINDS.iter().find(|kind| kind.key == self.key).map(|kind| (kind.table)()))
    }
}
