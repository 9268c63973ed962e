//! Decompression of single chunks.

use std::panic::catch_unwind;

use ::exr::{
    block::{
        UncompressedBlock,
        chunk::{Chunk, CompressedBlock},
    },
    compression::Compression,
    meta::MetaData,
};
use bansho_base::host::assets::AssetProblem;

use crate::assets::decoded::damaged;

/// Decompresses a chunk. The PIZ and B44 decoders of the crate panic on some damaged chunks (exr 1.74: an empty list in `piz/huffman.rs`,
/// overflow in `b44/mod.rs`). They own all their data, so catching the panic is safe.
pub(super) fn decompress(chunk: Chunk, meta: &MetaData) -> Result<UncompressedBlock, AssetProblem> {
    check_dwa(&chunk, meta)?;
    catch_unwind(|| UncompressedBlock::decompress_chunk(chunk, meta, false))
        .map_err(|_| damaged("its pixels cannot be decompressed"))?
        .map_err(damaged)
}

/// Fields of 8 bytes at the start of a DWA chunk: version, nine lengths, and the kind of entropy coding.
const DWA_FIELDS: usize = 11;

/// Rejects a DWA chunk whose header claims more bytes than its pixels could need, since the crate (exr 1.74, `dwa/section_stream.rs`) allocates
/// whatever the header claims.
fn check_dwa(chunk: &Chunk, meta: &MetaData) -> Result<(), AssetProblem> {
    let header = meta.headers.get(chunk.layer_index).ok_or_else(|| damaged("a block belongs to no part"))?;
    if !matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_)) {
        return Ok(());
    }
    let bytes = match &chunk.compressed_block {
        CompressedBlock::Tile(tile) => &tile.compressed_pixels_le,
        CompressedBlock::ScanLine(lines) => &lines.compressed_pixels_le,
        _ => return Err(damaged("deep pixels are not supported")),
    };
    let index = header.get_block_data_indices(&chunk.compressed_block).map_err(damaged)?;
    let area = header.get_absolute_block_pixel_coordinates(index).map_err(damaged)?.size.area();
    let pixel_bytes = area * header.channels.bytes_per_pixel;
    // A chunk that compression would enlarge is stored uncompressed, without the fields.
    if bytes.is_empty() || bytes.len() == pixel_bytes {
        return Ok(());
    }
    // There is one coefficient per sample, and at most as many end-of-block codes.
    let limit = 4 * pixel_bytes as u64 + 4096;
    let fields: Option<&[[u8; 8]]> = bytes.as_chunks().0.get(..DWA_FIELDS);
    let is_possible = fields.is_some_and(|fields| fields.iter().all(|field| u64::from_le_bytes(*field) <= limit));
    if is_possible { Ok(()) } else { Err(damaged("a chunk claims more bytes than its pixels can need")) }
}
