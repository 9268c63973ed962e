//! Accessors: typed views of glTF buffers, dense or sparse, with all bounds checked.

use bansho_base::host::assets::AssetProblem;

use super::{
    buffers::Buffers,
    elements::{Component, Element, Elements, LARGEST_ELEMENT, float, integer},
    json::Object,
    sparse::SparseElements,
};

/// What an accessor is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AccessorUse {
    Positions,
    /// Displacements of a morph target.
    Displacements,
    Indices,
    Joints,
    Weights,
    Matrices,
}

impl AccessorUse {
    fn allows(self, Element { component, components }: Element) -> bool {
        match self {
            Self::Positions | Self::Displacements => component == Component::F32 && components == 3,
            Self::Indices => component != Component::F32 && components == 1,
            Self::Joints => matches!(component, Component::U8 | Component::U16) && components == 4,
            Self::Weights => component != Component::U32 && components == 4,
            Self::Matrices => component == Component::F32 && components == 16,
        }
    }

    fn expected(self) -> &'static str {
        match self {
            Self::Positions => "is not that of positions; allowed: VEC3 of componentType 5126, floats",
            Self::Displacements => "is not that of displacements; allowed: VEC3 of componentType 5126, floats",
            Self::Indices => "is not that of indices; allowed: SCALAR of componentType 5121, 5123 or 5125",
            Self::Joints => "is not that of joints; allowed: VEC4 of componentType 5121 or 5123",
            Self::Weights => "is not that of weights; allowed: VEC4 of componentType 5121, 5123 or 5126",
            Self::Matrices => "is not that of matrices; allowed: MAT4 of componentType 5126, floats",
        }
    }
}

/// The elements of an accessor.
#[derive(Clone, Copy)]
pub(super) struct Accessor<'b> {
    /// `None` if all are 0.
    dense: Option<Elements<'b>>,
    /// Those that replace some.
    sparse: Option<SparseElements<'b>>,
    pub(super) count: usize,
    element: Element,
}

/// What an accessor without a buffer view holds.
const ZEROS: [u8; LARGEST_ELEMENT] = [0; LARGEST_ELEMENT];

impl<'b> Accessor<'b> {
    fn read(root: &Object, index: usize, buffers: &'b Buffers, usage: AccessorUse) -> Result<Self, AssetProblem> {
        let accessor = root.item("accessors", index)?;
        let element = Element::of(&accessor)?.filter(|element| usage.allows(*element));
        let element = element.ok_or_else(|| accessor.error_at("type", usage.expected()))?;
        let count = accessor.required_unsigned("count")?;
        let dense = Elements::read(root, &accessor, &accessor, element, buffers)?;
        let sparse = SparseElements::read(root, &accessor, element, count, buffers)?;
        // Without both, all elements are 0. That is a target that moves nothing, which Blender writes; anything else is in an extension.
        if dense.is_none() && sparse.is_none() && usage != AccessorUse::Displacements {
            return Err(accessor.error_at("bufferView", "is missing, perhaps because the mesh is compressed"));
        }
        Ok(Self { dense, sparse, count, element })
    }

    /// The accessor `accessors[index]` as positions: vectors of three floats.
    pub(super) fn positions(root: &Object, index: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        Self::read(root, index, buffers, AccessorUse::Positions)
    }

    /// The accessor `accessors[index]` as displacements: vectors of three floats. Without data they are 0.
    pub(super) fn displacements(root: &Object, index: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        Self::read(root, index, buffers, AccessorUse::Displacements)
    }

    /// The accessor `accessors[index]` as indices: unsigned integers of 8, 16 or 32 bits.
    pub(super) fn indices(root: &Object, index: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        Self::read(root, index, buffers, AccessorUse::Indices)
    }

    /// The accessor `accessors[index]` as indices of four joints.
    pub(super) fn joints(root: &Object, index: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        Self::read(root, index, buffers, AccessorUse::Joints)
    }

    /// The accessor `accessors[index]` as weights of four joints.
    pub(super) fn weights(root: &Object, index: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        Self::read(root, index, buffers, AccessorUse::Weights)
    }

    /// The accessor `accessors[index]` as matrices of four by four floats.
    pub(super) fn matrices(root: &Object, index: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        Self::read(root, index, buffers, AccessorUse::Matrices)
    }

    /// The bytes of each element.
    fn elements(self) -> impl Iterator<Item = &'b [u8]> + use<'b> {
        let zeros = &ZEROS[..self.element.bytes()];
        let mut replaced = self.sparse.into_iter().flat_map(SparseElements::replaced).peekable();
        (0..self.count).map(move |index| match replaced.next_if(|(position, _)| *position == index) {
            Some((_, bytes)) => bytes,
            None => self.dense.map_or(zeros, |dense| dense.get(index)),
        })
    }

    /// The first `N` components of each element as floats; integers are divided by the largest.
    pub(super) fn floats<const N: usize>(self) -> impl Iterator<Item = [f32; N]> + use<'b, N> {
        let component = self.element.component;
        self.elements().map(move |bytes| std::array::from_fn(|index| float(component, bytes, index)))
    }

    /// The first `N` components of each element as integers; 0 if they are floats.
    pub(super) fn integers<const N: usize>(self) -> impl Iterator<Item = [u32; N]> + use<'b, N> {
        let component = self.element.component;
        self.elements().map(move |bytes| std::array::from_fn(|index| integer(component, bytes, index)))
    }

    /// The elements as vectors.
    pub(super) fn vectors(self) -> impl Iterator<Item = [f32; 3]> + use<'b> {
        self.floats()
    }

    /// The elements as integers.
    pub(super) fn indices_u32(self) -> Vec<u32> {
        self.integers().map(|[index]| index).collect()
    }
}
