//! Accessors: typed views of glTF buffers, with all bounds checked.

use bansho_base::host::assets::AssetProblem;

use super::{buffers::Buffers, json::Object};

/// Types of components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    U8,
    U16,
    U32,
    F32,
}

impl Component {
    fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// Element types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Element {
    component: Component,
    components: usize,
}

impl Element {
    /// The element type of an accessor; `None` for one that is not used.
    fn of(accessor: &Object) -> Result<Option<Self>, AssetProblem> {
        let component = match accessor.required_unsigned("componentType")? {
            5121 => Component::U8,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return Ok(None),
        };
        let components = match accessor.text("type")? {
            Some("SCALAR") => 1,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            Some("MAT4") => 16,
            _ => return Ok(None),
        };
        Ok(Some(Self { component, components }))
    }

    fn bytes(self) -> usize {
        self.component.bytes() * self.components
    }
}

/// What an accessor is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AccessorUse {
    Positions,
    Indices,
    Joints,
    Weights,
    Matrices,
}

impl AccessorUse {
    fn allows(self, Element { component, components }: Element) -> bool {
        match self {
            Self::Positions => component == Component::F32 && components == 3,
            Self::Indices => component != Component::F32 && components == 1,
            Self::Joints => matches!(component, Component::U8 | Component::U16) && components == 4,
            Self::Weights => component != Component::U32 && components == 4,
            Self::Matrices => component == Component::F32 && components == 16,
        }
    }

    fn expected(self) -> &'static str {
        match self {
            Self::Positions => "is not that of positions; allowed: VEC3 of componentType 5126, floats",
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
    /// From the first byte of the first element to the last byte of the last.
    bytes: &'b [u8],
    stride: usize,
    pub(super) count: usize,
    element: Element,
}

impl<'b> Accessor<'b> {
    fn read(root: &Object, index: usize, buffers: &'b Buffers, usage: AccessorUse) -> Result<Self, AssetProblem> {
        let accessor = root.item("accessors", index)?;
        match Element::of(&accessor)?.filter(|element| usage.allows(*element)) {
            Some(element) => Self::with_element(root, &accessor, element, buffers),
            None => Err(accessor.error_at("type", usage.expected())),
        }
    }

    /// The accessor `accessors[index]` as positions: vectors of three floats.
    pub(super) fn positions(root: &Object, index: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        Self::read(root, index, buffers, AccessorUse::Positions)
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

    fn with_element(
        root: &Object,
        accessor: &Object,
        element: Element,
        buffers: &'b Buffers,
    ) -> Result<Self, AssetProblem> {
        if accessor.object("sparse")?.is_some() {
            return Err(accessor.error_at("sparse", "is not supported; allowed: accessors without it"));
        }
        let view = accessor.index("bufferView", root.list("bufferViews")?.len())?;
        let view =
            view.ok_or_else(|| accessor.error_at("bufferView", "is missing, perhaps because the mesh is compressed"))?;
        let view = root.item("bufferViews", view)?;
        let buffer = view.index("buffer", buffers.len())?.ok_or_else(|| view.error_at("buffer", "is missing"))?;
        let buffer = buffers.get(buffer);
        let (offset, length) = (view.unsigned("byteOffset")?.unwrap_or(0), view.required_unsigned("byteLength")?);
        let view_bytes = offset.checked_add(length).and_then(|end| buffer.get(offset..end));
        let view_bytes = view_bytes.ok_or_else(|| {
            view.error_at("byteLength", format!("reaches beyond its buffer, which has {} bytes", buffer.len()))
        })?;
        let stride = view.unsigned("byteStride")?.unwrap_or(element.bytes()).max(1);
        let (start, count) = (accessor.unsigned("byteOffset")?.unwrap_or(0), accessor.required_unsigned("count")?);
        let length = (count.max(1) - 1).checked_mul(stride).and_then(|length| length.checked_add(element.bytes()));
        let end = length.and_then(|length| start.checked_add(length));
        let bytes = end.and_then(|end| view_bytes.get(start..end));
        let bytes = bytes.ok_or_else(|| {
            accessor.error_at("count", format!("reaches beyond its buffer view, which has {} bytes", view_bytes.len()))
        })?;
        Ok(Self { bytes, stride, count, element })
    }

    /// The bytes of each element.
    fn elements(self) -> impl Iterator<Item = &'b [u8]> + use<'b> {
        let bytes = self.element.bytes();
        (0..self.count).filter_map(move |index| self.bytes.get(index * self.stride..)?.get(..bytes))
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

/// The component with this index; 0 beyond the element.
fn integer(component: Component, bytes: &[u8], index: usize) -> u32 {
    match component {
        Component::U8 => bytes.get(index).copied().map_or(0, u32::from),
        Component::U16 => bytes.as_chunks::<2>().0.get(index).map_or(0, |bytes| u16::from_le_bytes(*bytes).into()),
        Component::U32 => bytes.as_chunks::<4>().0.get(index).map_or(0, |bytes| u32::from_le_bytes(*bytes)),
        Component::F32 => 0,
    }
}

/// The component with this index; 0 beyond the element.
fn float(component: Component, bytes: &[u8], index: usize) -> f32 {
    match component {
        Component::F32 => bytes.as_chunks::<4>().0.get(index).map_or(0.0, |bytes| f32::from_le_bytes(*bytes)),
        Component::U8 => integer(component, bytes, index) as f32 / 255.0,
        Component::U16 => integer(component, bytes, index) as f32 / 65535.0,
        Component::U32 => integer(component, bytes, index) as f32,
    }
}
