//! Curves over [0, 1] as tables, several side by side so that one load fetches all that is needed at one place.

use super::lanes::{LANES, Lanes, hold, wrap_split};

/// Straight pieces of a table.
pub(crate) const SEGMENTS: usize = 512;
/// The greatest place below 1, so that the last piece serves the end too.
const LAST: f32 = 1.0 - f32::EPSILON / 2.0;

/// `K` functions of one variable in [0, 1]: for each piece, value and rise of each function.
#[derive(Clone, Debug)]
pub(crate) struct CurveTable<const K: usize> {
    pieces: Box<[[[f32; 2]; K]; SEGMENTS]>,
}

impl<const K: usize> CurveTable<K> {
    /// The table of what `values` gives at each of the `SEGMENTS + 1` places `x`.
    pub(crate) fn new(mut values: impl FnMut(f64) -> [f64; K]) -> Self {
        Self::from_samples(|i| values(i as f64 / SEGMENTS as f64).map(|value| value as f32))
    }

    /// The table of samples by their index, 0 to `SEGMENTS`.
    pub(crate) fn from_samples(mut sample: impl FnMut(usize) -> [f32; K]) -> Self {
        let mut pieces = Box::new([[[0.0; 2]; K]; SEGMENTS]);
        let mut low = sample(0);
        for (i, piece) in pieces.iter_mut().enumerate() {
            let high = sample(i + 1);
            for k in 0..K {
                piece[k] = [low[k], high[k] - low[k]];
            }
            low = high;
        }
        Self { pieces }
    }

    /// All functions at sixteen places, which are held to [0, 1].
    #[inline(always)]
    pub(crate) fn sample(&self, x: &Lanes) -> [Lanes; K] {
        let mut place = [0.0; LANES];
        for i in 0..LANES {
            place[i] = hold(x[i], 0.0, LAST) * SEGMENTS as f32;
        }
        let (index, part) = wrap_split(&place, SEGMENTS as u32 - 1);
        let mut pieces = [[[0.0; 2]; K]; LANES];
        for i in 0..LANES {
            pieces[i] = self.pieces[index[i] as usize & (SEGMENTS - 1)];
        }
        let mut values = [[0.0; LANES]; K];
        for k in 0..K {
            for i in 0..LANES {
                values[k][i] = pieces[i][k][1].mul_add(part[i], pieces[i][k][0]);
            }
        }
        values
    }

    /// All functions at one place.
    pub(crate) fn at(&self, x: f32) -> [f32; K] {
        self.sample(&[x; LANES]).map(|lanes| lanes[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_holds_its_ends_and_is_straight_between_samples() {
        let table = CurveTable::new(|x| [x, 1.0 - x * x]);
        assert_eq!((table.at(0.0), table.at(-3.0)), ([0.0, 1.0], [0.0, 1.0]));
        let end = table.at(7.0);
        assert!((end[0] - 1.0).abs() < 1e-6 && end[1].abs() < 1e-5);
        for i in 0..1000 {
            let x = i as f32 / 999.0;
            let [line, parabola] = table.at(x);
            assert!((line - x).abs() < 1e-6 && (parabola - (1.0 - x * x)).abs() < 2e-6);
        }
    }
}
