//! What each band of rows has to draw, from left to right.

/// Rows of a band.
pub(crate) const BAND: usize = 8;

/// The part of the picture that a thing may touch: columns and rows `[low, high]`, pixels; may reach beyond the picture.
pub(crate) type Extent = [[f32; 2]; 2];

/// For each band of rows of a picture, and each stretch of its columns, numbers of the things that touch it, in their order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bands {
    /// Columns of a stretch.
    width: usize,
    /// Stretches of a band.
    stretches: usize,
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Bands {
    /// Sorts things of these extents into the bands of a picture of `size` pixels, in stretches of `width` columns.
    pub(crate) fn new(size: [usize; 2], width: usize, extents: impl Iterator<Item = Extent> + Clone) -> Self {
        let stretches = size[0].div_ceil(width);
        let count = size[1].div_ceil(BAND) * stretches;
        let places = |[columns, rows]: Extent| Places {
            bands: spans(rows, size[1], BAND),
            columns: spans(columns, size[0], width),
            stretches,
        };
        let mut starts = vec![0_u32; count + 1];
        extents.clone().for_each(|extent| places(extent).each(|place| starts[place + 1] += 1));
        for place in 0..count {
            starts[place + 1] += starts[place];
        }
        let mut members = vec![0; starts[count] as usize];
        let mut next = starts.clone();
        for (index, extent) in extents.enumerate() {
            places(extent).each(|place| {
                members[next[place] as usize] = index as u32;
                next[place] += 1;
            });
        }
        Self { width, stretches, starts, members }
    }

    /// The stretches of columns of a band that hold anything between columns `from` and `to`: where each begins and ends, and its members;
    /// none beyond the picture.
    pub(crate) fn stretches(&self, band: usize, from: usize, to: usize) -> impl Iterator<Item = ([usize; 2], &[u32])> {
        let stretches = if from < to { from / self.width..to.div_ceil(self.width).min(self.stretches) } else { 0..0 };
        stretches.filter_map(move |stretch| {
            let place = band * self.stretches + stretch;
            let &[start, end] = self.starts.get(place..place + 2)?.first_chunk()?;
            let columns = [stretch * self.width, (stretch + 1) * self.width];
            (start < end).then(|| (columns, &self.members[start as usize..end as usize]))
        })
    }
}

/// The stretches that a thing touches.
struct Places {
    bands: std::ops::Range<usize>,
    columns: std::ops::Range<usize>,
    stretches: usize,
}

impl Places {
    #[inline(always)]
    fn each(self, mut visit: impl FnMut(usize)) {
        for band in self.bands {
            for column in self.columns.clone() {
                visit(band * self.stretches + column);
            }
        }
    }
}

/// The parts of `part` pixels each, of `length` pixels, that `[low, high]` touches.
fn spans([low, high]: [f32; 2], length: usize, part: usize) -> std::ops::Range<usize> {
    // Not a number touches nothing.
    if !(high >= 0.0 && low < length as f32) {
        return 0..0;
    }
    let count = length.div_ceil(part);
    let span = |place: f32| (place.max(0.0) as usize / part).min(count);
    span(low)..(span(high) + 1).min(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_come_in_their_order_to_every_band_and_stretch_that_they_touch() {
        let all = [0.0, 99.0];
        let rows = [[-5.0, 3.0], [7.5, 16.5], [30.0, 40.0], [-9.0, -1.0], [f32::NAN, 3.0], [0.0, 1e9]];
        let narrow = [[31.0, 33.0], [0.0, 3.0]];
        let extents = rows.into_iter().map(|rows| [all, rows]).chain([narrow]);
        let bands = Bands::new([48, 21], 32, extents);
        let members = |band: usize, from: usize, to: usize| -> Vec<(usize, Vec<u32>)> {
            bands.stretches(band, from, to).map(|([from, _], members)| (from, members.to_vec())).collect()
        };
        assert_eq!(members(0, 0, 48), [(0, vec![0, 1, 5, 6]), (32, vec![0, 1, 5, 6])]);
        assert_eq!(members(1, 0, 48), [(0, vec![1, 5]), (32, vec![1, 5])]);
        assert_eq!(members(2, 40, 48), [(32, vec![1, 5])]);
        assert_eq!(members(2, 0, 32), [(0, vec![1, 5])]);
        assert!(members(3, 0, 48).is_empty() && members(0, 5, 5).is_empty());
        assert!(Bands::default().stretches(0, 0, 0).next().is_none());
    }
}
