//! OpenEXR plates: color and depth of any part, any sample type, lines or tiles.
//!
//! The header is first checked by [`header`], so that a file cannot make the decoder allocate more memory than the file could fill;
//! [`layers`] chooses what is read, the `exr` crate decompresses it, [`colors`] converts it.

mod colors;
mod layers;

use std::{io::Cursor, ops::Range, panic::catch_unwind};

use ::exr::{
    block::{
        UncompressedBlock,
        chunk::{Chunk, CompressedBlock},
        lines::LineRef,
        reader::ChunksReader,
    },
    compression::Compression,
    meta::{MetaData, attribute::SampleType, header::Header},
};
use bansho_base::{
    color::{MAX_EV100, ev100_of_camera},
    host::assets::{AssetProblem, DepthMap, NormalMap, Picture, PictureLayers, PictureRemark},
    image::Image,
};
use rayon::prelude::*;

use self::layers::{ChannelSelection, ColorChannels, DepthChannel};
use super::{
    KEY_EXPOSURE,
    header::{self, FileHeader, PartHeader, Window},
};
use crate::{
    decode::damaged,
    limits::{self, MemoryLimit},
};

/// Largest number of chunks that are decompressed in parallel.
const MAX_CHUNKS: u64 = 32;
/// Bytes of pixels in one batch of chunks; a single chunk may exceed it.
const BATCH_BYTES: u64 = 64 << 20;
/// Memory of a chunk during decompression, in multiples of its pixels: compressed, intermediate, and decompressed.
const CHUNK_COPIES: u64 = 4;

/// Decodes a plate: the layers that `layers` chooses, or those that renderers write as their colors and their depth. The result covers the display
/// window; pixels outside the data window are transparent and infinitely far. Colors stay multiplied by alpha, and NaN becomes 0.
pub(crate) fn decode(file: &[u8], layers: &PictureLayers, limit: MemoryLimit) -> Result<Picture, AssetProblem> {
    let header = header::parse_header(file).map_err(damaged)?;
    check(&header, file)?;
    let selection = ChannelSelection::of_picture(&header, layers)?;
    let planes = read_planes(file, &header, &selection, limit)?;
    colors::finish(&header, &selection, planes)
}

/// Decodes the depth alone: the layer or channel `layer`, or the one that renderers write as depth, or the only channel.
pub(crate) fn decode_depth(file: &[u8], layer: Option<&str>, limit: MemoryLimit) -> Result<DepthMap, AssetProblem> {
    let header = header::parse_header(file).map_err(damaged)?;
    check(&header, file)?;
    let selection = ChannelSelection::of_depth(&header, layer)?;
    let planes = read_planes(file, &header, &selection, limit)?;
    let values = planes.values.depth.unwrap_or_default().into_iter().map(|value| [value]).collect();
    let values = Image::from_pixels(planes.width, planes.height, values);
    let values = values.ok_or_else(|| damaged("its values do not fill it"))?;
    Ok(DepthMap { values, remarks: pixel_aspect(&header.parts[selection.part]).into_iter().collect() })
}

/// Decodes normals as they are in the file.
pub(crate) fn decode_normals(file: &[u8], limit: MemoryLimit) -> Result<NormalMap, AssetProblem> {
    let header = header::parse_header(file).map_err(damaged)?;
    check(&header, file)?;
    let selection = ChannelSelection::of_normals(&header)?;
    let planes = read_planes(file, &header, &selection, limit)?;
    let values = planes.values.color.unwrap_or_default().into_iter().map(|[x, y, z, _]| [x, y, z]).collect();
    let values = Image::from_pixels(planes.width, planes.height, values);
    let values = values.ok_or_else(|| damaged("its values do not fill it"))?;
    Ok(NormalMap { values, remarks: pixel_aspect(&header.parts[selection.part]).into_iter().collect() })
}

/// Reads the selected channels.
fn read_planes(
    file: &[u8],
    header: &FileHeader,
    selection: &ChannelSelection,
    limit: MemoryLimit,
) -> Result<PlaneWriter, AssetProblem> {
    let display = header.parts[0].display_window.ok_or_else(|| damaged("it has no display window"))?;
    let size = display.size();
    let (width, height) = (size[0] as usize, size[1] as usize);
    let batch = ChunkBatch::new(header, selection);
    limit.check(file.len() as u64 + plane_bytes(selection, size[0] * size[1]) + batch.bytes)?;
    let values = selected_planes(selection, width * height);
    let mut planes = PlaneWriter { width, height, display_min: display.min, values };
    read_chunks(file, selection, batch.chunks, &mut planes)?;
    Ok(planes)
}

/// The remark on pixels that are not square.
fn pixel_aspect(part: &PartHeader) -> Option<PictureRemark> {
    let aspect = part.float("pixelAspectRatio")?;
    (aspect.is_finite() && aspect > 0.0 && (aspect - 1.0).abs() > 1e-3)
        .then_some(PictureRemark::PixelAspect(aspect as f32))
}

/// Rejects files that need more memory than is allowed, or than their bytes could fill.
fn check(header: &FileHeader, file: &[u8]) -> Result<(), AssetProblem> {
    if header.deep {
        return Err(damaged("deep pixels are not supported; flatten them first"));
    }
    for part in &header.parts {
        let (Some(data), Some(display)) = (part.data_window, part.display_window) else {
            return Err(damaged("its header lacks a window"));
        };
        limits::check_size(display.size())?;
        let [width, height] = limits::check_size(data.size())?;
        if part.tile.is_some_and(|tile| tile.iter().any(|side| !(1..=limits::SIDE as u32).contains(side))) {
            return Err(damaged("its tile size is invalid"));
        }
        if part.channels.is_empty() || part.channels.iter().any(|channel| channel.sampling != [1, 1]) {
            return Err(damaged(
                "its channels are subsampled (luminance and chroma), which is not supported; convert it to RGB, as by \
                 `oiiotool in.exr --ch R,G,B -o out.exr`",
            ));
        }
        limits::check_expansion([width, height], part_bytes(part), file, max_compression_ratio(part))?;
    }
    Ok(())
}

/// Largest compression ratio of a part.
fn max_compression_ratio(part: &PartHeader) -> u64 {
    match part.compression {
        Some(0) => 1,
        Some(1) => 64, // run lengths of up to 128 in 2 bytes
        Some(2 | 3) => limits::DEFLATE_RATIO,
        Some(5) => 2 * limits::DEFLATE_RATIO, // floats of 3 bytes, then DEFLATE
        Some(6 | 7) => 32,                    // 4 x 4 halves in 3 bytes at least
        _ => 1 << 15,                         // Huffman runs over wavelets or cosines
    }
}

fn selected_planes(selection: &ChannelSelection, pixels: usize) -> DecodedPlanes {
    let color = selection.color.map(|_| vec![[0.0; 4]; pixels]);
    DecodedPlanes { color, depth: selection.depth.map(|_| vec![f32::INFINITY; pixels]) }
}

/// Bytes of the result for this number of pixels.
fn plane_bytes(selection: &ChannelSelection, pixels: u64) -> u64 {
    let color = if selection.color.is_some() { size_of::<[f32; 4]>() } else { 0 };
    let depth = if selection.depth.is_some() { size_of::<f32>() } else { 0 };
    // Without colors, the depth is shown as gray.
    pixels * (color.max(size_of::<[f32; 4]>()) + depth) as u64
}

struct DecodedPlanes {
    color: Option<Vec<[f32; 4]>>,
    depth: Option<Vec<f32>>,
}

struct PlaneWriter {
    width: usize,
    height: usize,
    display_min: [i32; 2],
    values: DecodedPlanes,
}

/// The pixels of the picture that a line covers.
struct LineSpan {
    /// Number of values to the left of the picture.
    skipped: usize,
    pixels: Range<usize>,
}

/// Number of chunks in a batch, and its memory in bytes.
struct ChunkBatch {
    chunks: usize,
    bytes: u64,
}

impl ChunkBatch {
    fn new(header: &FileHeader, selection: &ChannelSelection) -> Self {
        let (mut largest_chunk, mut total) = (1, 0);
        for (_, part) in header.parts.iter().enumerate().filter(|(index, _)| selection.contains_part(*index)) {
            largest_chunk = chunk_bytes(part).max(largest_chunk);
            total += part_bytes(part);
        }
        let chunks = (BATCH_BYTES / largest_chunk).clamp(1, MAX_CHUNKS);
        Self { chunks: chunks as usize, bytes: (chunks * largest_chunk).min(total) * CHUNK_COPIES }
    }
}

/// Bytes of a part's pixels.
fn part_bytes(part: &PartHeader) -> u64 {
    let [width, height] = part.data_window.map_or([0, 0], Window::size);
    width * height * pixel_bytes(part)
}

fn pixel_bytes(part: &PartHeader) -> u64 {
    part.channels.iter().map(|channel| channel.bytes_per_sample).sum()
}

/// Bytes of the pixels of a part's chunk.
fn chunk_bytes(part: &PartHeader) -> u64 {
    let [width, height] = part.data_window.map_or([0, 0], Window::size);
    let rows = header::lines_in_chunk(part.compression);
    let [columns, rows] = part.tile.map_or([width, rows], |tile| tile.map(u64::from));
    columns.min(width) * rows.min(height) * pixel_bytes(part)
}

fn read_chunks(
    file: &[u8],
    selection: &ChannelSelection,
    batch_size: usize,
    planes: &mut PlaneWriter,
) -> Result<(), AssetProblem> {
    let reader = ::exr::block::read(Cursor::new(file), false).map_err(damaged)?;
    // The smaller copies of a file with levels of resolution are not read.
    let chunks = reader.filter_chunks(false, |_, tile, block| {
        tile.is_largest_resolution_level() && selection.contains_part(block.layer)
    });
    let mut chunks = chunks.map_err(damaged)?;
    let meta = chunks.meta_data().clone();
    loop {
        let batch: Vec<Chunk> = chunks.by_ref().take(batch_size).collect::<Result<_, _>>().map_err(damaged)?;
        if batch.is_empty() {
            return Ok(());
        }
        let blocks: Vec<UncompressedBlock> =
            batch.into_par_iter().map(|chunk| decompress(chunk, &meta)).collect::<Result<_, _>>()?;
        for block in &blocks {
            let header = meta.headers.get(block.index.layer).ok_or_else(|| damaged("a block belongs to no part"))?;
            planes.copy_block(block, header, selection);
        }
    }
}

impl PlaneWriter {
    /// Copies the selected channels of a block.
    fn copy_block(&mut self, block: &UncompressedBlock, header: &Header, selection: &ChannelSelection) {
        let part = block.index.layer;
        for line in block.lines(&header.channels) {
            let channel = line.location.channel;
            let Some(kind) = header.channels.list.get(channel).map(|channel| channel.sample_type) else { continue };
            let Some(LineSpan { skipped, pixels }) = self.span(&line, header) else { continue };
            // One channel may be both, where a gray layer is also chosen as the depth.
            if let Some(depth) =
                self.values.depth.as_mut().filter(|_| selection.depth == Some(DepthChannel { part, channel }))
            {
                let values = samples(&line, kind).skip(skipped);
                depth[pixels.clone()].iter_mut().zip(values).for_each(|(z, value)| *z = value);
            }
            if let (Some(color), Some(channels)) =
                (&mut self.values.color, selection.color.filter(|_| selection.part == part))
            {
                copy_color(&mut color[pixels], samples(&line, kind).skip(skipped), channels, channel);
            }
        }
    }

    /// The pixels that a line covers; `None` outside the picture.
    fn span(&self, line: &LineRef<'_>, header: &Header) -> Option<LineSpan> {
        let origin = header.own_attributes.layer_position;
        let x = line.location.position.0 as i64 + i64::from(origin.0) - i64::from(self.display_min[0]);
        let y = line.location.position.1 as i64 + i64::from(origin.1) - i64::from(self.display_min[1]);
        let row = usize::try_from(y).ok().filter(|row| *row < self.height)? * self.width;
        let end = (x + line.location.sample_count as i64).min(self.width as i64);
        let start = x.max(0);
        (start < end)
            .then(|| LineSpan { skipped: (start - x) as usize, pixels: row + start as usize..row + end as usize })
    }
}

/// Writes the values of a channel into its color components.
fn copy_color(pixels: &mut [[f32; 4]], values: impl Iterator<Item = f32>, color: ColorChannels, channel: usize) {
    let targets = color.components().map(|selection| selection == Some(channel));
    if !targets.contains(&true) {
        return;
    }
    for (pixel, value) in pixels.iter_mut().zip(values) {
        (0..4).filter(|component| targets[*component]).for_each(|component| pixel[component] = value);
        // Without alpha in the file, pixels inside the data window are opaque and the others transparent.
        if color.alpha.is_none() {
            pixel[3] = 1.0;
        }
    }
}

/// The values of a line as `f32`.
fn samples<'a>(line: &LineRef<'a>, kind: SampleType) -> Box<dyn Iterator<Item = f32> + 'a> {
    let bytes = line.value;
    match kind {
        SampleType::F16 => Box::new(bytes.as_chunks().0.iter().map(|pair| half::f16::from_ne_bytes(*pair).to_f32())),
        SampleType::F32 => Box::new(bytes.as_chunks().0.iter().map(|four| f32::from_ne_bytes(*four))),
        SampleType::U32 => Box::new(bytes.as_chunks().0.iter().map(|four| u32::from_ne_bytes(*four) as f32)),
    }
}

/// Exposure value at ISO 100 from Bansho's own attribute, or from OpenEXR's attributes for camera settings.
fn exposure(part: &PartHeader) -> Option<f64> {
    let stated = part.float(KEY_EXPOSURE).filter(|ev100| ev100.abs() <= MAX_EV100);
    stated.or_else(|| ev100_of_camera(part.float("aperture")?, part.float("expTime")?, part.float("isoSpeed")?))
}

/// Decompresses a chunk. The PIZ and B44 decoders of the crate panic on some damaged chunks (exr 1.74: an empty list in `piz/huffman.rs`,
/// overflow in `b44/mod.rs`). They own all their data, so catching the panic is safe.
fn decompress(chunk: Chunk, meta: &MetaData) -> Result<UncompressedBlock, AssetProblem> {
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
