//! Which SIMD instructions kernels use: the widest of the machine, or narrower ones for tests and measurements. The results are the same bytes.

use std::{
    fmt,
    str::FromStr,
    sync::atomic::{AtomicU8, Ordering},
};

use fearless_simd::Level;

/// A set of SIMD instructions for which kernels are compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum VectorLevel {
    /// No vector instructions.
    Scalar,
    /// 128 bits on x86, without fused multiply-add: it is emulated, and slow.
    Sse2,
    /// 128 bits on x86 (x86-64-v2), also without fused multiply-add.
    Sse4_2,
    /// 256 bits on x86, with fused multiply-add (x86-64-v3).
    Avx2,
    /// 512 bits on x86 since Ice Lake.
    Avx512,
    /// 128 bits on 64-bit ARM.
    Neon,
    /// 128 bits in WebAssembly.
    Simd128,
}

/// The machine has no such vector instructions, or kernels are not compiled for them.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("vector level \"{requested}\" is not available on this machine; allowed: {}", list(.available))]
pub struct VectorLevelError {
    /// The level that was requested, as it was written.
    pub requested: String,
    /// Those that can be selected, narrowest first.
    pub available: Vec<VectorLevel>,
}

fn list(levels: &[VectorLevel]) -> String {
    levels.iter().map(|level| level.name()).collect::<Vec<_>>().join(", ")
}

/// The selected level as an index of [`VectorLevel::ALL`]; any other value selects the widest.
static SELECTED: AtomicU8 = AtomicU8::new(WIDEST);
const WIDEST: u8 = u8::MAX;

/// The instructions that kernels are dispatched to: the widest of the machine, unless [`set_vector_level`] has selected others.
#[must_use]
pub fn level() -> Level {
    let selected = VectorLevel::ALL.get(usize::from(SELECTED.load(Ordering::Relaxed)));
    selected.and_then(|selected| selected.level()).unwrap_or_else(widest)
}

/// Selects the instructions of all kernels of this process that start from now on; `None` for the widest of the machine. It changes times, not results.
///
/// # Errors
/// The machine has no such instructions.
pub fn set_vector_level(level: Option<VectorLevel>) -> Result<(), VectorLevelError> {
    let selected = match level {
        None => WIDEST,
        Some(level) if level.level().is_none() => return Err(VectorLevelError::new(level.name())),
        Some(level) => level as u8,
    };
    SELECTED.store(selected, Ordering::Relaxed);
    Ok(())
}

/// All levels of the machine, narrowest first: every one gives the same bits.
#[cfg(test)]
pub(crate) fn available_levels() -> impl Iterator<Item = Level> + Clone {
    VectorLevel::ALL.into_iter().filter_map(VectorLevel::level)
}

/// The widest instructions of the machine that kernels are compiled for.
#[expect(clippy::disallowed_methods, reason = "the one place that asks the machine")]
fn widest() -> Level {
    match Level::new() {
        #[cfg(all(any(target_arch = "x86", target_arch = "x86_64"), disable_dispatch_sse4_2))]
        Level::Sse4_2(_) => Level::baseline(),
        level => level,
    }
}

impl VectorLevelError {
    fn new(requested: &str) -> Self {
        Self { requested: requested.to_owned(), available: VectorLevel::available() }
    }
}

impl VectorLevel {
    /// All levels; on one machine, narrower ones are first.
    pub const ALL: [Self; 7] =
        [Self::Scalar, Self::Sse2, Self::Sse4_2, Self::Avx2, Self::Avx512, Self::Neon, Self::Simd128];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Sse2 => "sse2",
            Self::Sse4_2 => "sse4.2",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
            Self::Simd128 => "simd128",
        }
    }

    /// The levels that the machine has and that kernels are compiled for, narrowest first; never empty.
    #[must_use]
    pub fn available() -> Vec<Self> {
        Self::ALL.into_iter().filter(|level| level.level().is_some()).collect()
    }

    /// The level that kernels are dispatched to now: see [`level`].
    #[must_use]
    pub fn selected() -> Self {
        Self::of(level())
    }

    /// What `fearless_simd::dispatch!` takes; `None` where the machine lacks the instructions, or where the program is compiled for wider ones only.
    #[must_use]
    pub fn level(self) -> Option<Level> {
        // Dispatch goes to the baseline of the compilation where a level below it is asked for.
        if self < Self::of(Level::baseline()) { None } else { self.proof() }
    }

    /// The proof that the machine has the instructions.
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    fn proof(self) -> Option<Level> {
        use fearless_simd::Simd;
        let widest = widest();
        match self {
            Self::Sse2 => widest.as_sse2().map(Simd::level),
            // See `.cargo/config.toml`.
            Self::Sse4_2 if cfg!(disable_dispatch_sse4_2) => None,
            Self::Sse4_2 => widest.as_sse4_2().map(Simd::level),
            Self::Avx2 => widest.as_avx2().map(Simd::level),
            Self::Avx512 => widest.as_avx512().map(Simd::level),
            _ => None,
        }
    }

    /// The proof that the machine has the instructions. Elsewhere than on x86, they are fixed when the program is compiled.
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    fn proof(self) -> Option<Level> {
        let widest = widest();
        (self == Self::of(widest)).then_some(widest)
    }

    fn of(level: Level) -> Self {
        match level {
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Sse2(_) => Self::Sse2,
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Sse4_2(_) => Self::Sse4_2,
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Avx2(_) => Self::Avx2,
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Avx512(_) => Self::Avx512,
            #[cfg(target_arch = "aarch64")]
            Level::Neon(_) => Self::Neon,
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Level::WasmSimd128(_) => Self::Simd128,
            _ => Self::Scalar,
        }
    }
}

impl fmt::Display for VectorLevel {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl FromStr for VectorLevel {
    type Err = VectorLevelError;

    /// The available level with this name.
    fn from_str(name: &str) -> Result<Self, VectorLevelError> {
        let named = Self::available().into_iter().find(|level| level.name() == name);
        named.ok_or_else(|| VectorLevelError::new(name))
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Simd, dispatch};

    use super::*;

    #[test]
    fn levels_are_selected_by_name_and_never_above_the_machine() {
        let available = VectorLevel::available();
        assert!(available.is_sorted() && !available.is_empty(), "{available:?}");
        assert_eq!(available.last(), Some(&VectorLevel::of(widest())));
        for level in VectorLevel::ALL {
            match level.name().parse::<VectorLevel>() {
                Ok(parsed) => assert!(parsed == level && available.contains(&level)),
                Err(error) => {
                    assert!(!available.contains(&level));
                    assert_eq!(set_vector_level(Some(level)), Err(error.clone()));
                    let message = error.to_string();
                    assert!(available.iter().all(|level| message.contains(level.name())), "{message}");
                }
            }
        }
        assert!("mmx".parse::<VectorLevel>().is_err());
    }

    #[test]
    fn kernels_are_dispatched_to_the_selected_level() {
        for selected in VectorLevel::available() {
            set_vector_level(Some(selected)).unwrap();
            assert_eq!(VectorLevel::of(level()), selected);
            let dispatched = dispatch!(level(), simd => simd.level());
            assert_eq!(VectorLevel::of(dispatched), selected);
        }
        set_vector_level(None).unwrap();
        assert_eq!(VectorLevel::of(level()), VectorLevel::of(widest()));
    }
}
