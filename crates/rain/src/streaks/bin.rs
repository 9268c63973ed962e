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

/// Which bands, and which stretches of them, a thing touches: the first, and one past the last.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spans {
    bands: [u16; 2],
    stretches: [u16; 2],
}

impl Spans {
    /// Those of a thing in a picture of `size` pixels, in stretches of `width` columns.
    #[inline(always)]
    pub(crate) fn new([columns, rows]: Extent, size: [usize; 2], width: usize) -> Self {
        Self { bands: span(rows, size[1], BAND), stretches: span(columns, size[0], width) }
    }

    /// Visits the stretches, of which a band has so many.
    #[inline(always)]
    fn each(&self, of_band: usize, mut visit: impl FnMut(usize)) {
        for band in self.bands[0]..self.bands[1] {
            for stretch in self.stretches[0]..self.stretches[1] {
                visit(usize::from(band) * of_band + usize::from(stretch));
            }
        }
    }
}

/// The parts of `part` pixels each, of `length` pixels, that `[low, high]` touches.
#[inline(always)]
fn span([low, high]: [f32; 2], length: usize, part: usize) -> [u16; 2] {
    // Not a number touches nothing.
    if !(high >= 0.0 && low < length as f32) {
        return [0, 0];
    }
    let (last, scale) = (((length - 1) / part) as f32, 1.0 / part as f32);
    let held = |place: f32| (place * scale).clamp(0.0, last) as i32 as u16;
    [held(low), held(high) + 1]
}

impl Bands {
    /// Sorts things into the bands of a picture of `size` pixels, in stretches of `width` columns.
    pub(crate) fn new(size: [usize; 2], width: usize, things: &[Spans]) -> Self {
        let stretches = size[0].div_ceil(width);
        let count = size[1].div_ceil(BAND) * stretches;
        let mut starts = vec![0_u32; count + 1];
        things.iter().for_each(|spans| spans.each(stretches, |place| starts[place + 1] += 1));
        for place in 0..count {
            starts[place + 1] += starts[place];
        }
        let mut members = vec![0; starts[count] as usize];
        let mut next = starts.clone();
        for (index, spans) in things.iter().enumerate() {
            spans.each(stretches, |place| {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_come_in_their_order_to_every_band_and_stretch_that_they_touch() {
        let all = [0.0, 99.0];
        let rows = [[-5.0, 3.0], [7.5, 16.5], [30.0, 40.0], [-9.0, -1.0], [f32::NAN, 3.0], [0.0, 1e9]];
        let narrow = [[31.0, 33.0], [0.0, 3.0]];
        let extents = rows.into_iter().map(|rows| [all, rows]).chain([narrow]);
        let spans: Vec<Spans> = extents.map(|extent| Spans::new(extent, [48, 21], 32)).collect();
        let bands = Bands::new([48, 21], 32, &spans);
        assert_eq!(bands.members(0, 0), [0, 1, 5, 6]);
        assert_eq!(bands.members(0, 1), [0, 1, 5, 6]);
        assert_eq!([0, 1].map(|stretch| bands.members(1, stretch)), [[1, 5]; 2]);
        assert_eq!([0, 1].map(|stretch| bands.members(2, stretch)), [[1, 5]; 2]);
        assert!(bands.members(3, 0).is_empty() && bands.members(0, 2).is_empty());
        assert!(Bands::default().members(0, 0).is_empty());
    }
}
