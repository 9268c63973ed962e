//! What is selected: a table of the scene, whose parameters the inspector shows.

use bansho::{KINDS, base::parameters::TableDescriptor, scene::ValuePath};

use crate::document::{Document, PhenomenonId, descriptors};

/// A selected table of the scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Selection {
    /// The table's name in scene files.
    pub(crate) key: &'static str,
    /// Its index, if the scene may have several tables of that name.
    pub(crate) index: Option<usize>,
}

impl Default for Selection {
    fn default() -> Self {
        Self { key: KINDS[0].key, index: None }
    }
}

impl Selection {
    /// The first phenomenon of `document`, or a shared table where it has none.
    pub(crate) fn first_of(document: &Document) -> Self {
        let first = document.phenomena().into_iter().next();
        first.map_or_else(Self::default, |entry| entry.id.into())
    }

    /// The selected phenomenon; `None` where a shared table is selected.
    pub(crate) fn phenomenon(&self) -> Option<PhenomenonId> {
        PhenomenonId::find(self.key, self.index?)
    }

    /// The selected phenomenon if it is of `kind`, else the first of that kind.
    pub(crate) fn phenomenon_of(&self, kind: &'static str) -> PhenomenonId {
        let selected = self.phenomenon().filter(|selected| selected.kind == kind);
        selected.unwrap_or(PhenomenonId { kind, index: 0 })
    }

    /// Its path in the document.
    pub(crate) fn path(&self) -> ValuePath {
        let path = ValuePath::root().key(self.key);
        self.index.map_or(path.clone(), |index| path.index(index))
    }

    /// Its title.
    pub(crate) fn title(&self, document: &Document) -> String {
        let entry = document.phenomena().into_iter().find(|entry| Some(entry.id) == self.phenomenon());
        match (entry, self.index) {
            (Some(entry), _) => entry.name,
            (None, Some(index)) => format!("{} {}", self.key, index + 1),
            (None, None) => self.key.to_owned(),
        }
    }

    /// Its parameters.
    pub(crate) fn descriptor(&self) -> Option<&'static TableDescriptor> {
        descriptors::table_descriptor(self.key)
    }
}

impl From<PhenomenonId> for Selection {
    fn from(PhenomenonId { kind, index }: PhenomenonId) -> Self {
        Self { key: kind, index: Some(index) }
    }
}
