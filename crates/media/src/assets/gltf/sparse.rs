//! Sparse accessors: elements that replace some of those of an accessor (glTF 2.0, 3.6.2.3).

use bansho_base::host::assets::AssetProblem;

use super::{
    buffers::Buffers,
    elements::{Component, Element, Elements, integer},
    json::Object,
};

/// Elements that replace others.
#[derive(Clone, Copy)]
pub(super) struct SparseElements<'b> {
    count: usize,
    /// Which elements are replaced: rising, and all within the accessor.
    indices: Elements<'b>,
    component: Component,
    values: Elements<'b>,
}

impl<'b> SparseElements<'b> {
    /// Those of `accessor`, which has `count` elements; `None` if it replaces none.
    pub(super) fn read(
        root: &Object,
        accessor: &Object,
        element: Element,
        count: usize,
        buffers: &'b Buffers,
    ) -> Result<Option<Self>, AssetProblem> {
        let Some(sparse) = accessor.object("sparse")? else { return Ok(None) };
        let part = |key| sparse.object(key)?.ok_or_else(|| sparse.error_at(key, "is missing; allowed: an object"));
        let (indices, values) = (part("indices")?, part("values")?);
        let replaced = sparse.required_unsigned("count")?;
        let component = Component::of(&indices)?.filter(|component| *component != Component::F32);
        let not_integers = || indices.error_at("componentType", "is not that of indices; allowed: 5121, 5123 or 5125");
        let component = component.ok_or_else(not_integers)?;
        let scalar = Element { component, components: 1 };
        let read = |owner: &Object, element| {
            let elements = Elements::read(root, &sparse, owner, element, buffers)?;
            elements.ok_or_else(|| owner.error_at("bufferView", "is missing"))
        };
        let own =
            Self { count: replaced, indices: read(&indices, scalar)?, component, values: read(&values, element)? };
        own.check(&indices, count)?;
        Ok(Some(own))
    }

    /// Checks that the indices rise and are within an accessor of `count` elements. `owner` is the object of the indices.
    fn check(&self, owner: &Object, count: usize) -> Result<(), AssetProblem> {
        let mut least = 0;
        for position in 0..self.count {
            let index = self.index(position);
            if index >= count {
                let message = format!("contain {index} at position {position}; the accessor has {count} elements");
                return Err(owner.error_at("bufferView", message));
            }
            if index < least {
                let message =
                    format!("contain {index} at position {position} after {}; allowed: rising indices", least - 1);
                return Err(owner.error_at("bufferView", message));
            }
            least = index + 1;
        }
        Ok(())
    }

    fn index(&self, position: usize) -> usize {
        integer(self.component, self.indices.get(position), 0) as usize
    }

    /// Which elements are replaced, rising, and the bytes that replace them.
    pub(super) fn replaced(self) -> impl Iterator<Item = (usize, &'b [u8])> + use<'b> {
        (0..self.count).map(move |position| (self.index(position), self.values.get(position)))
    }
}
