//! What each band of rows has to draw.

/// Rows of a band.
pub(crate) const BAND: usize = 8;

/// For each band of rows of a picture, numbers of the things that touch it, in their order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bands {
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Bands {
    /// Sorts things that touch the rows `[low, high]` each (pixels, may reach beyond) into the bands of a picture of `height` rows.
    pub(crate) fn new(height: usize, rows: &[[f32; 2]]) -> Self {
        let count = height.div_ceil(BAND);
        let touched = |[low, high]: [f32; 2]| {
            // Not a number touches nothing.
            if !(high >= 0.0 && low < height as f32) {
                return 0..0;
            }
            let band = |row: f32| (row.max(0.0) as usize / BAND).min(count);
            band(low)..(band(high) + 1).min(count)
        };
        let mut starts = vec![0_u32; count + 1];
        for &rows in rows {
            touched(rows).for_each(|band| starts[band + 1] += 1);
        }
        for band in 0..count {
            starts[band + 1] += starts[band];
        }
        let mut members = vec![0; starts[count] as usize];
        let mut next = starts.clone();
        for (index, &rows) in rows.iter().enumerate() {
            for band in touched(rows) {
                members[next[band] as usize] = index as u32;
                next[band] += 1;
            }
        }
        Self { starts, members }
    }

    /// The things that touch a band; none beyond the picture.
    pub(crate) fn members(&self, band: usize) -> &[u32] {
        match self.starts.get(band..band + 2) {
            Some(&[start, end]) => &self.members[start as usize..end as usize],
            _ => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_come_in_their_order_to_every_band_that_they_touch() {
        let rows = [[-5.0, 3.0], [7.5, 16.5], [30.0, 40.0], [-9.0, -1.0], [f32::NAN, 3.0], [0.0, 1e9]];
        let bands = Bands::new(21, &rows);
        assert_eq!(bands.members(0), [0, 1, 5]);
        assert_eq!(bands.members(1), [1, 5]);
        assert_eq!(bands.members(2), [1, 5]);
        assert!(bands.members(3).is_empty());
    }
}
