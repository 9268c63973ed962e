//! Limits on claimed sizes, checked before memory is allocated.

use bansho_base::host::{assets::AssetProblem, memory};

/// Largest side, pixels.
pub const SIDE: u64 = 16384;
/// Largest number of pixels: half of the largest square, 2 GiB as floats.
pub const PIXELS: u64 = SIDE * SIDE / 2;
/// Default memory limit of a scene's inputs, bytes.
pub(crate) const MEMORY_BYTES: u64 = 2 << 30;
/// Largest text file (a drawing, or another file that a scene names), bytes.
pub const TEXT_BYTES: u64 = 64 << 20;
/// Largest compression ratio of DEFLATE: 258 bytes in two bits, with a margin for headers.
pub(crate) const DEFLATE_RATIO: u64 = 1040;

/// Memory limit of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryLimit {
    /// Bytes that all inputs may take in total.
    pub total: u64,
    /// Bytes that other inputs use already.
    pub used: u64,
}

impl Default for MemoryLimit {
    fn default() -> Self {
        Self { total: MEMORY_BYTES, used: 0 }
    }
}

impl MemoryLimit {
    /// Remaining bytes.
    pub fn available(self) -> u64 {
        self.total.saturating_sub(self.used)
    }

    /// Checks that an input that takes `bytes` bytes, including its file, is within the limit and that the system can allocate them.
    ///
    /// # Errors
    /// It exceeds the limit, or the system has less memory.
    pub fn check(self, bytes: u64) -> Result<(), AssetProblem> {
        if bytes > self.available() {
            return Err(AssetProblem::Memory { bytes, limit: self.available(), others: self.used });
        }
        if memory::can_allocate(bytes as f64) { Ok(()) } else { Err(AssetProblem::NoMemory { bytes }) }
    }
}

/// Rejects empty pictures and those beyond [`SIDE`] or [`PIXELS`].
pub(crate) fn check_size([width, height]: [u64; 2]) -> Result<[u64; 2], AssetProblem> {
    if width == 0 || height == 0 {
        return Err(AssetProblem::Damaged(format!("it claims {width} x {height} pixels")));
    }
    if width > SIDE || height > SIDE {
        return Err(AssetProblem::TooLarge { width, height, limit: SIDE });
    }
    if width * height > PIXELS {
        return Err(AssetProblem::TooManyPixels { width, height, limit: PIXELS });
    }
    Ok([width, height])
}

/// Rejects a picture of `claimed_bytes` that its file could not hold even at the format's largest compression ratio.
pub(crate) fn check_expansion(
    [width, height]: [u64; 2],
    claimed_bytes: u64,
    file: &[u8],
    ratio: u64,
) -> Result<(), AssetProblem> {
    let file_bytes = file.len() as u64;
    if claimed_bytes > file_bytes.saturating_mul(ratio) {
        let reason = format!("it claims {width} x {height} pixels, more than its {file_bytes} bytes can hold");
        return Err(AssetProblem::Damaged(reason));
    }
    Ok(())
}
