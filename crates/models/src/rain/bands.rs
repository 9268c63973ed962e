//! What each band of rows has to draw, from left to right.

/// Rows of a band.
pub(crate) const BAND: usize = 8;

/// The part of the picture that a thing may touch: columns and rows `[low, high]`, pixels; may reach beyond the picture.
pub(crate) type Extent = [[f32; 2]; 2];

/// For each band of rows of a picture, and each stretch of its columns, numbers of the things that touch it, in their order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bands {
    /// Stretches of a band.
    stretches: usize,
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Bands {
    /// Sorts things of these extents into the bands of a picture of `size` pixels, in stretches of `width` columns.
    pub(crate) fn new(size: [usize; 2], width: usize, extents: impl Iterator<Item = Extent>) -> Self {
        let stretches = size[0].div_ceil(width);
        let count = size[1].div_ceil(BAND) * stretches;
        let places = extents.map(|[columns, rows]| [spans(rows, size[1], BAND), spans(columns, size[0], width)]);
        let places: Vec<[Span; 2]> = places.collect();
        let mut starts = vec![0_u32; count + 1];
        places.iter().for_each(|spans| each(spans, stretches, |place| starts[place + 1] += 1));
        for place in 0..count {
            starts[place + 1] += starts[place];
        }
        let mut members = vec![0; starts[count] as usize];
        let mut next = starts.clone();
        for (index, spans) in places.iter().enumerate() {
            each(spans, stretches, |place| {
                members[next[place] as usize] = index as u32;
                next[place] += 1;
            });
        }
        Self { stretches, starts, members }
    }

    /// What touches a stretch of a band; nothing beyond the picture.
    #[inline(always)]
    pub(crate) fn members(&self, band: usize, stretch: usize) -> &[u32] {
        let place = band * self.stretches + stretch;
        match self.starts.get(place..place + 2) {
            Some(&[start, end]) if stretch < self.stretches => &self.members[start as usize..end as usize],
            _ => &[],
        }
    }
}

/// From which part to which: the first, and one past the last.
type Span = [u32; 2];

/// Visits the stretches that a thing touches.
#[inline(always)]
fn each([bands, columns]: &[Span; 2], stretches: usize, mut visit: impl FnMut(usize)) {
    for band in bands[0]..bands[1] {
        for column in columns[0]..columns[1] {
            visit(band as usize * stretches + column as usize);
        }
    }
}

/// The parts of `part` pixels each, of `length` pixels, that `[low, high]` touches.
#[inline(always)]
fn spans([low, high]: [f32; 2], length: usize, part: usize) -> Span {
    // Not a number touches nothing.
    if !(high >= 0.0 && low < length as f32) {
        return [0, 0];
    }
    let count = length.div_ceil(part) as u32;
    let span = |place: f32| (place.max(0.0) as u32 / part as u32).min(count);
    [span(low), (span(high) + 1).min(count)]
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
        assert_eq!(bands.members(0, 0), [0, 1, 5, 6]);
        assert_eq!(bands.members(0, 1), [0, 1, 5, 6]);
        assert_eq!([0, 1].map(|stretch| bands.members(1, stretch)), [[1, 5]; 2]);
        assert_eq!([0, 1].map(|stretch| bands.members(2, stretch)), [[1, 5]; 2]);
        assert!(bands.members(3, 0).is_empty() && bands.members(0, 2).is_empty());
        assert!(Bands::default().members(0, 0).is_empty());
    }
}
