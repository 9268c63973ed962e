//! Accessors: typed views of glTF buffers, dense or sparse (elements that replace some, glTF 2.0, 3.6.2.3), with all bounds checked.

use bansho_base::host::assets::AssetProblem;

use super::{buffers::Buffers, json::Object};

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
            Self::Positions | Self::Displacements => component == ComponentType::F32 && components == 3,
            Self::Indices => component != ComponentType::F32 && components == 1,
            Self::Joints => matches!(component, ComponentType::U8 | ComponentType::U16) && components == 4,
            Self::Weights => component != ComponentType::U32 && components == 4,
            Self::Matrices => component == ComponentType::F32 && components == 16,
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

/// Types of components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ComponentType {
    U8,
    U16,
    U32,
    F32,
}

impl ComponentType {
    /// The type in `componentType`; `None` for one that is not used.
    fn of(object: &Object) -> Result<Option<Self>, AssetProblem> {
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
struct Element {
    component: ComponentType,
    components: usize,
}

/// Bytes of the largest element, a matrix of floats.
const LARGEST_ELEMENT: usize = 64;

impl Element {
    /// The element type of an accessor; `None` for one that is not used.
    fn of(accessor: &Object) -> Result<Option<Self>, AssetProblem> {
        let components = match accessor.text("type")? {
            Some("SCALAR") => 1,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            Some("MAT4") => 16,
            _ => return Ok(None),
        };
        Ok(ComponentType::of(accessor)?.map(|component| Self { component, components }))
    }

    /// Its size, at most [`LARGEST_ELEMENT`].
    fn bytes(self) -> usize {
        self.component.bytes() * self.components
    }
}

/// Elements in a buffer view.
#[derive(Clone, Copy)]
struct Elements<'b> {
    /// From the first byte of the first element to the last byte of the last.
    bytes: &'b [u8],
    stride: usize,
    element: Element,
}

impl<'b> Elements<'b> {
    /// As many elements as `counted` states, in the buffer view that `owner` names; `None` if it names none.
    fn read(
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
        // The last element ends with its bytes: the rest of its stride may be beyond the view.
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
    fn get(&self, index: usize) -> &'b [u8] {
        let from = index.checked_mul(self.stride).and_then(|start| self.bytes.get(start..));
        from.and_then(|bytes| bytes.get(..self.element.bytes())).unwrap_or_default()
    }
}

/// The component with this index as an integer; 0 beyond the element.
fn integer(component: ComponentType, bytes: &[u8], index: usize) -> u32 {
    match component {
        ComponentType::U8 => bytes.get(index).copied().map_or(0, u32::from),
        ComponentType::U16 => bytes.as_chunks::<2>().0.get(index).map_or(0, |bytes| u16::from_le_bytes(*bytes).into()),
        ComponentType::U32 => bytes.as_chunks::<4>().0.get(index).map_or(0, |bytes| u32::from_le_bytes(*bytes)),
        ComponentType::F32 => 0,
    }
}

/// The component with this index as a float, integers divided by the largest; 0 beyond the element.
fn float(component: ComponentType, bytes: &[u8], index: usize) -> f32 {
    match component {
        ComponentType::F32 => bytes.as_chunks::<4>().0.get(index).map_or(0.0, |bytes| f32::from_le_bytes(*bytes)),
        ComponentType::U8 => integer(component, bytes, index) as f32 / 255.0,
        ComponentType::U16 => integer(component, bytes, index) as f32 / 65535.0,
        ComponentType::U32 => integer(component, bytes, index) as f32,
    }
}

/// Elements that replace others.
#[derive(Clone, Copy)]
struct SparseElements<'b> {
    count: usize,
    /// Which elements are replaced: rising, and all within the accessor.
    indices: Elements<'b>,
    component: ComponentType,
    values: Elements<'b>,
}

impl<'b> SparseElements<'b> {
    /// Those of `accessor`, which has `count` elements; `None` if it replaces none.
    fn read(
        root: &Object,
        accessor: &Object,
        element: Element,
        count: usize,
        buffers: &'b Buffers,
    ) -> Result<Option<Self>, AssetProblem> {
        let Some(sparse) = accessor.object("sparse")? else { return Ok(None) };
        let indices = sparse.object("indices")?;
        let indices = indices.ok_or_else(|| sparse.error_at("indices", "is missing; allowed: an object"))?;
        let values = sparse.object("values")?;
        let values = values.ok_or_else(|| sparse.error_at("values", "is missing; allowed: an object"))?;
        let replaced_count = sparse.required_unsigned("count")?;
        let component = ComponentType::of(&indices)?.filter(|component| *component != ComponentType::F32);
        let component = component
            .ok_or_else(|| indices.error_at("componentType", "is not that of indices; allowed: 5121, 5123 or 5125"))?;
        let scalar = Element { component, components: 1 };
        let index_elements = Elements::read(root, &sparse, &indices, scalar, buffers)?;
        let index_elements = index_elements.ok_or_else(|| indices.error_at("bufferView", "is missing"))?;
        let value_elements = Elements::read(root, &sparse, &values, element, buffers)?;
        let value_elements = value_elements.ok_or_else(|| values.error_at("bufferView", "is missing"))?;
        let sparse_elements =
            Self { count: replaced_count, indices: index_elements, component, values: value_elements };
        sparse_elements.check(&indices, count)?;
        Ok(Some(sparse_elements))
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
    fn replaced(self) -> impl Iterator<Item = (usize, &'b [u8])> + use<'b> {
        (0..self.count).map(move |position| (self.index(position), self.values.get(position)))
    }
}
