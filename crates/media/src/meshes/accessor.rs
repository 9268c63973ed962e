//! Numbers in glTF buffers, every place checked against the bytes that are there.

use bansho_base::assets::AssetProblem;
use gltf::{
    Accessor,
    accessor::{DataType, Dimensions},
};

use super::damaged;

/// The elements of an accessor, each of `N` bytes.
fn elements<'a, const N: usize>(
    accessor: &Accessor,
    buffers: &'a [Vec<u8>],
) -> Result<impl Iterator<Item = [u8; N]> + use<'a, N>, AssetProblem> {
    if accessor.sparse().is_some() {
        return Err(damaged("it has a sparse accessor, which is not read"));
    }
    let view = accessor.view().ok_or_else(|| damaged("an accessor has no buffer, perhaps because it is compressed"))?;
    let buffer = buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
    let stride = view.stride().unwrap_or(N).max(1);
    let start = view.offset().checked_add(accessor.offset());
    let length = (accessor.count().max(1) - 1).checked_mul(stride).and_then(|length| length.checked_add(N));
    let bytes = start
        .zip(length)
        .and_then(|(start, length)| buffer.get(start..start.checked_add(length)?))
        .ok_or_else(|| damaged("an accessor reaches beyond its buffer"))?;
    let element = move |at: usize| bytes.get(at..)?.first_chunk::<N>().copied();
    Ok((0..accessor.count()).filter_map(move |index| element(index * stride)))
}

/// Vectors of three floats.
pub(super) fn vectors(accessor: &Accessor, buffers: &[Vec<u8>]) -> Result<Vec<[f32; 3]>, AssetProblem> {
    if (accessor.data_type(), accessor.dimensions()) != (DataType::F32, Dimensions::Vec3) {
        return Err(damaged("its positions are not vectors of three floats"));
    }
    let vector = |bytes: [u8; 12]| {
        std::array::from_fn(|axis| {
            f32::from_le_bytes([bytes[4 * axis], bytes[4 * axis + 1], bytes[4 * axis + 2], bytes[4 * axis + 3]])
        })
    };
    Ok(elements::<12>(accessor, buffers)?.map(vector).collect())
}

/// Whole numbers of 8, 16 or 32 bits.
pub(super) fn indices(accessor: &Accessor, buffers: &[Vec<u8>]) -> Result<Vec<u32>, AssetProblem> {
    match (accessor.data_type(), accessor.dimensions()) {
        (DataType::U8, Dimensions::Scalar) => Ok(elements(accessor, buffers)?.map(|[byte]| u32::from(byte)).collect()),
        (DataType::U16, Dimensions::Scalar) => {
            Ok(elements(accessor, buffers)?.map(|bytes| u32::from(u16::from_le_bytes(bytes))).collect())
        }
        (DataType::U32, Dimensions::Scalar) => Ok(elements(accessor, buffers)?.map(u32::from_le_bytes).collect()),
        _ => Err(damaged("its indices are not whole numbers")),
    }
}
