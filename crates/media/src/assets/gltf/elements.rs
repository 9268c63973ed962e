//! Elements of glTF buffer views: their types, and their bytes with all bounds checked.

use bansho_base::host::assets::AssetProblem;

use super::{buffers::Buffers, json::Object};

/// Types of components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    U8,
    U16,
    U32,
    F32,
}

impl Component {
    /// The type in `componentType`; `None` for one that is not used.
    pub(super) fn of(object: &Object) -> Result<Option<Self>, AssetProblem> {
        Ok(match object.required_unsigned("componentType")? {
            5121 => Some(Self::U8),
            5123 => Some(Self::U16),
            5125 => Some(Self::U32),
            5126 => Some(Self::F32),
            _ => None,
        })
    }

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
pub(super) struct Element {
    pub(super) component: Component,
    pub(super) components: usize,
}

/// Bytes of the largest element, a matrix of floats.
pub(super) const LARGEST_ELEMENT: usize = 64;

impl Element {
    /// The element type of an accessor; `None` for one that is not used.
    pub(super) fn of(accessor: &Object) -> Result<Option<Self>, AssetProblem> {
        let components = match accessor.text("type")? {
            Some("SCALAR") => 1,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            Some("MAT4") => 16,
            _ => return Ok(None),
        };
        Ok(Component::of(accessor)?.map(|component| Self { component, components }))
    }

    /// Its size, at most [`LARGEST_ELEMENT`].
    pub(super) fn bytes(self) -> usize {
        self.component.bytes() * self.components
    }
}

/// Elements in a buffer view.
#[derive(Clone, Copy)]
pub(super) struct Elements<'b> {
    /// From the first byte of the first element to the last byte of the last.
    bytes: &'b [u8],
    stride: usize,
    element: Element,
}

impl<'b> Elements<'b> {
    /// As many elements as `counted` states, in the buffer view that `owner` names; `None` if it names none.
    pub(super) fn read(
        root: &Object,
        counted: &Object,
        owner: &Object,
        element: Element,
        buffers: &'b Buffers,
    ) -> Result<Option<Self>, AssetProblem> {
        let Some(index) = owner.index("bufferView", root.list("bufferViews")?.len())? else { return Ok(None) };
        let view = root.item("bufferViews", index)?;
        let buffer = view.index("buffer", buffers.len())?.ok_or_else(|| view.error_at("buffer", "is missing"))?;
        let buffer = buffers.get(buffer);
        let (offset, length) = (view.unsigned("byteOffset")?.unwrap_or(0), view.required_unsigned("byteLength")?);
        let view_bytes = offset.checked_add(length).and_then(|end| buffer.get(offset..end));
        let view_bytes = view_bytes.ok_or_else(|| {
            view.error_at("byteLength", format!("reaches beyond its buffer, which has {} bytes", buffer.len()))
        })?;
        let stride = view.unsigned("byteStride")?.unwrap_or(element.bytes()).max(1);
        let (start, count) = (owner.unsigned("byteOffset")?.unwrap_or(0), counted.required_unsigned("count")?);
        let length = (count.max(1) - 1).checked_mul(stride).and_then(|length| length.checked_add(element.bytes()));
        let end = length.and_then(|length| start.checked_add(length));
        let bytes = end.and_then(|end| view_bytes.get(start..end));
        let bytes = bytes.ok_or_else(|| {
            let (view, bytes) = (index, view_bytes.len());
            counted.error_at(
                "count",
                format!("reaches beyond its buffer view, bufferViews[{view}], which has {bytes} bytes"),
            )
        })?;
        Ok(Some(Self { bytes, stride, element }))
    }

    /// The bytes of an element; empty beyond the last.
    pub(super) fn get(&self, index: usize) -> &'b [u8] {
        let from = index.checked_mul(self.stride).and_then(|start| self.bytes.get(start..));
        from.and_then(|bytes| bytes.get(..self.element.bytes())).unwrap_or_default()
    }
}

/// The component with this index as an integer; 0 beyond the element.
pub(super) fn integer(component: Component, bytes: &[u8], index: usize) -> u32 {
    match component {
        Component::U8 => bytes.get(index).copied().map_or(0, u32::from),
        Component::U16 => bytes.as_chunks::<2>().0.get(index).map_or(0, |bytes| u16::from_le_bytes(*bytes).into()),
        Component::U32 => bytes.as_chunks::<4>().0.get(index).map_or(0, |bytes| u32::from_le_bytes(*bytes)),
        Component::F32 => 0,
    }
}

/// The component with this index as a float, integers divided by the largest; 0 beyond the element.
pub(super) fn float(component: Component, bytes: &[u8], index: usize) -> f32 {
    match component {
        Component::F32 => bytes.as_chunks::<4>().0.get(index).map_or(0.0, |bytes| f32::from_le_bytes(*bytes)),
        Component::U8 => integer(component, bytes, index) as f32 / 255.0,
        Component::U16 => integer(component, bytes, index) as f32 / 65535.0,
        Component::U32 => integer(component, bytes, index) as f32,
    }
}
