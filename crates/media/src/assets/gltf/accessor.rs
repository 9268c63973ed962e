//! Accessors: typed views of glTF buffers, with all bounds checked.

use bansho_base::host::assets::AssetProblem;

use super::{buffers::Buffers, json::Object};

/// Element types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Element {
    /// Three floats of 32 bits.
    Vector,
    U8,
    U16,
    U32,
}

impl Element {
    fn of(accessor: &Object) -> Result<Option<Self>, AssetProblem> {
        Ok(match (accessor.required_unsigned("componentType")?, accessor.text("type")?) {
            (5126, Some("VEC3")) => Some(Self::Vector),
            (5121, Some("SCALAR")) => Some(Self::U8),
            (5123, Some("SCALAR")) => Some(Self::U16),
            (5125, Some("SCALAR")) => Some(Self::U32),
            _ => None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::Vector => 12,
            Self::U8 => 1,
            Self::U16 => 2,
            Self::U32 => 4,
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
    /// The accessor `accessors[index]` as positions: vectors of three floats.
    pub(super) fn positions(root: &Object, index: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        let accessor = root.item("accessors", index)?;
        match Element::of(&accessor)? {
            Some(Element::Vector) => Self::with_element(root, &accessor, Element::Vector, buffers),
            _ => {
                Err(accessor.error_at("type", "is not that of positions; allowed: VEC3 of componentType 5126, floats"))
            }
        }
    }

    /// The accessor `accessors[index]` as indices: unsigned integers of 8, 16 or 32 bits.
    pub(super) fn indices(root: &Object, index: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        let accessor = root.item("accessors", index)?;
        match Element::of(&accessor)? {
            Some(element) if element != Element::Vector => Self::with_element(root, &accessor, element, buffers),
            _ => Err(accessor
                .error_at("type", "is not that of indices; allowed: SCALAR of componentType 5121, 5123 or 5125")),
        }
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

    fn elements<const N: usize>(self) -> impl Iterator<Item = [u8; N]> + use<'b, N> {
        let element = move |index: usize| self.bytes.get(index * self.stride..)?.first_chunk::<N>().copied();
        (0..self.count).filter_map(element)
    }

    /// The elements as vectors; empty if they are integers.
    pub(super) fn vectors(self) -> impl Iterator<Item = [f32; 3]> + use<'b> {
        let vector = |bytes: [u8; 12]| {
            std::array::from_fn(|axis| {
                f32::from_le_bytes([bytes[4 * axis], bytes[4 * axis + 1], bytes[4 * axis + 2], bytes[4 * axis + 3]])
            })
        };
        self.elements::<12>().map(vector)
    }

    /// The elements as integers; empty if they are vectors.
    pub(super) fn indices_u32(self) -> Vec<u32> {
        match self.element {
            Element::Vector => Vec::new(),
            Element::U8 => self.elements().map(|[byte]| u32::from(byte)).collect(),
            Element::U16 => self.elements().map(|bytes| u32::from(u16::from_le_bytes(bytes))).collect(),
            Element::U32 => self.elements().map(u32::from_le_bytes).collect(),
        }
    }
}
