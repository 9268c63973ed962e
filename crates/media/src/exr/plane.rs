//! The channels of a frame in file order.

use std::{borrow::Cow, ops::Range};

use bansho_base::frame::{Frame, Precision};
use half::slice::HalfFloatSliceExt;

/// Largest finite half, to which brighter pixels are clamped: infinities and NaN spread in every filter.
const HALF_MAX: f32 = 65504.0;

/// Component names that readers recognize. Blender ignores channels with other suffixes.
const COMPONENTS: [&str; 10] = ["R", "G", "B", "A", "X", "Y", "Z", "U", "V", "W"];

/// One channel of the file.
pub(crate) struct ChannelPlane<'a> {
    pub(crate) name: Cow<'a, str>,
    pub(crate) precision: Precision,
    source: ChannelSource<'a>,
}

enum ChannelSource<'a> {
    /// Component 0 to 3 of the color.
    Beauty(&'a [[f32; 4]], usize),
    Values(&'a [f32]),
}

/// All channels of `frame`, sorted by name as the format requires.
pub(crate) fn planes(frame: &Frame) -> Vec<ChannelPlane<'_>> {
    let beauty = ["R", "G", "B", "A"].into_iter().enumerate().map(|(component, name)| ChannelPlane {
        name: name.into(),
        precision: Precision::Half,
        source: ChannelSource::Beauty(frame.beauty.pixels(), component),
    });
    let depth = frame.depth.iter().map(|values| ChannelPlane {
        name: "Z".into(),
        precision: Precision::Single,
        source: ChannelSource::Values(values),
    });
    let channels = frame.channels.iter().map(|channel| ChannelPlane {
        name: exr_channel_name(&channel.name),
        precision: channel.precision,
        source: ChannelSource::Values(&channel.values),
    });
    let mut planes: Vec<_> = beauty.chain(depth).chain(channels).collect();
    planes.sort_by(|a, b| a.name.as_bytes().cmp(b.name.as_bytes()));
    planes
}

/// Channel name in the file. A scalar quantity such as `torch.temperature_k` becomes the single component `V` of a layer.
fn exr_channel_name(name: &str) -> Cow<'_, str> {
    let is_component = name.rsplit('.').next().is_some_and(|last| COMPONENTS.contains(&last));
    if is_component { name.into() } else { format!("{name}.V").into() }
}

impl ChannelPlane<'_> {
    /// Number of values.
    pub(crate) fn len(&self) -> usize {
        match self.source {
            ChannelSource::Beauty(pixels, _) => pixels.len(),
            ChannelSource::Values(values) => values.len(),
        }
    }

    /// Bytes of a value in the file.
    pub(crate) fn bytes_per_value(&self) -> usize {
        match self.precision {
            Precision::Half => 2,
            Precision::Single => 4,
        }
    }

    /// Appends the values of the pixels `range`, in native byte order.
    pub(crate) fn append(&self, range: Range<usize>, row: &mut RowBuffer, bytes: &mut Vec<u8>) {
        row.floats.clear();
        match self.source {
            ChannelSource::Beauty(pixels, component) => {
                row.floats.extend(pixels[range].iter().map(|pixel| pixel[component]));
            }
            ChannelSource::Values(values) => row.floats.extend_from_slice(&values[range]),
        }
        match self.precision {
            Precision::Single => bytes.extend_from_slice(bytemuck::cast_slice(&row.floats)),
            Precision::Half => {
                row.floats.iter_mut().for_each(|value| *value = finite_half(*value));
                row.halves.resize(row.floats.len(), half::f16::ZERO);
                row.halves.convert_from_f32_slice(&row.floats);
                bytes.extend(row.halves.iter().flat_map(|half| half.to_ne_bytes()));
            }
        }
    }
}

/// A finite color within the range of half.
#[inline(always)]
fn finite_half(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-HALF_MAX, HALF_MAX) }
}

/// Buffer for the conversion of a row.
#[derive(Default)]
pub(crate) struct RowBuffer {
    floats: Vec<f32>,
    halves: Vec<half::f16>,
}
