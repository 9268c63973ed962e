//! Gaps where a sheet splits or two sheets merge: how flux fades toward them and bridges them.
//!
//! Before a gap opens, the flux decreases over some distance on both sides; the ends then separate while dark. Merging
//! ends stay dim until they are close, then brighten together.

use bansho_base::math::smoothstep;

use crate::shapes::{Sheet, geometry::polyline::cumulative_lengths};

/// Gaps narrower than this, km, and than half of their maximum width, are bridged by light.
const BRIDGED_KM: f64 = 40.0;
/// Length over which the flux fades toward a gap, km, and its maximum as a fraction of the sheet.
const FADE_KM: f64 = 60.0;
const MAX_FADE_FRACTION: f64 = 0.35;
/// Fraction of the transition, on the side of the maximum width, over which ends change between drawn and dark.
const DARKENING: f64 = 0.15;

/// Two control points that coincide where the gap is closed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    pub(crate) ends: [usize; 2],
    /// Whether it opens (a split) or closes (a merge).
    pub(crate) opens: bool,
}

/// State of a gap at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GapFlux {
    /// Factor of the flux at both ends.
    pub(crate) ends: f64,
    /// Factor of the flux across the gap.
    pub(crate) across: f64,
}

/// Light across a narrow gap between two ends of sheets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge {
    /// The two ends.
    pub ends: [SheetEnd; 2],
    /// Factor of the aurora's flux.
    pub flux: f64,
    /// Factor of the aurora's energy.
    pub energy: f64,
}

/// The start or the end of a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SheetEnd {
    /// Index of the sheet.
    pub sheet: usize,
    /// Whether it is the end, else the start.
    pub is_end: bool,
}

impl GapFlux {
    /// A gap of width `width`, km, and maximum width `max_width`, at a fraction of the time from closed to maximum width.
    pub(crate) fn new(width: f64, max_width: f64, fraction: f64) -> Self {
        let limit = BRIDGED_KM.min(0.5 * max_width);
        let closed = if limit > 0.0 { 1.0 - smoothstep(0.0, limit, width) } else { 1.0 };
        // At maximum width the sheets are as drawn.
        let free = 1.0 - smoothstep(1.0 - DARKENING, 1.0, fraction);
        Self { ends: 1.0 - (1.0 - closed) * free, across: closed * free }
    }
}

/// Fades the flux of a sheet toward its end, or else its start, down to a fraction.
pub(crate) fn fade_toward_gap(sheet: &mut Sheet, is_end: bool, fraction: f64) {
    let lengths = cumulative_lengths(&sheet.points);
    let whole = lengths.last().copied().unwrap_or(0.0);
    let fade_km = FADE_KM.min(MAX_FADE_FRACTION * whole);
    for (flux, length) in sheet.flux.iter_mut().zip(&lengths) {
        let from_end = if is_end { whole - length } else { *length };
        let risen = if fade_km > 0.0 { smoothstep(0.0, fade_km, from_end) } else { 1.0 };
        *flux *= 1.0 - (1.0 - fraction) * (1.0 - risen);
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::DVec2;

    use super::*;

    #[test]
    fn light_passes_over_narrow_gaps_only_and_ends_are_as_drawn_at_the_wide_side() {
        assert_eq!(GapFlux::new(0.0, 100.0, 0.0), GapFlux { ends: 1.0, across: 1.0 });
        assert_eq!(GapFlux::new(41.0, 100.0, 0.5), GapFlux { ends: 0.0, across: 0.0 });
        assert_eq!(GapFlux::new(100.0, 100.0, 1.0), GapFlux { ends: 1.0, across: 0.0 });
        let half = GapFlux::new(20.0, 100.0, 0.3);
        assert!((half.ends - 0.5).abs() < 1e-12 && half.across == half.ends);
        // A gap that never gets wide is dark by half of its width.
        assert_eq!(GapFlux::new(4.0, 8.0, 0.5).across, 0.0);
        assert_eq!(GapFlux::new(0.0, 0.0, 0.5).across, 1.0);
    }

    #[test]
    fn flux_fades_toward_the_gap_alone() {
        let points: Vec<DVec2> = (0..41).map(|index| DVec2::new(10.0 * f64::from(index), 0.0)).collect();
        let mut sheet = Sheet { flux: vec![2.0; points.len()], energy: vec![1.0; points.len()], points };
        fade_toward_gap(&mut sheet, true, 0.25);
        assert_eq!((sheet.flux[40], sheet.flux[0], sheet.flux[34]), (0.5, 2.0, 2.0));
        assert!(sheet.flux.windows(2).all(|pair| pair[1] <= pair[0]));
        // Half of the way up between.
        assert!((sheet.flux[37] - 2.0 * 0.625).abs() < 1e-12);
    }
}
