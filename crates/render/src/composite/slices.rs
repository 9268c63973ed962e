//! Cutting the depth of a picture into slices, so that phenomena occlude each other correctly.

use bansho_base::phenomenon::strip::DepthInterval;

/// An interval of depth, and the phenomena in it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slice {
    pub(crate) interval: DepthInterval,
    /// Indices of the phenomena.
    pub(crate) members: Vec<usize>,
}

/// Largest number of slices. With more, the thinnest neighbors are merged.
const MAX_SLICES: usize = 24;

/// Slices from near to far, cut wherever a phenomenon begins or ends.
///
/// `intervals[i]` are the intervals that phenomenon `i` fills. Neighboring slices with the same members are separate only where another
/// phenomenon begins or ends between them.
pub(crate) fn cut(intervals: &[Vec<DepthInterval>]) -> Vec<Slice> {
    let intervals: Vec<Vec<DepthInterval>> =
        intervals.iter().map(|filled| filled.iter().map(thickened).collect()).collect();
    let intervals = intervals.as_slice();
    let mut edges: Vec<f64> = intervals
        .iter()
        .flatten()
        .flat_map(|interval| [interval.near, interval.far])
        .filter(|edge| !edge.is_nan())
        .collect();
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    let mut slices: Vec<Slice> = edges
        .windows(2)
        .map(|pair| DepthInterval { near: pair[0], far: pair[1] })
        .map(|interval| Slice { interval, members: members(intervals, &interval) })
        .filter(|slice| !slice.members.is_empty())
        .collect();
    merge_lone_neighbors(&mut slices);
    while slices.len() > MAX_SLICES {
        merge_thinnest(&mut slices);
    }
    slices
}

/// An interval of positive length. A sheet that faces the camera has a single depth; its interval becomes the shortest possible.
fn thickened(interval: &DepthInterval) -> DepthInterval {
    DepthInterval { near: interval.near, far: interval.far.max(interval.near.next_up()) }
}

fn members(intervals: &[Vec<DepthInterval>], slice: &DepthInterval) -> Vec<usize> {
    let fills = |index: &usize| intervals[*index].iter().any(|interval| interval.overlaps(slice));
    (0..intervals.len()).filter(fills).collect()
}

/// Merges touching slices that contain only the same phenomenon, since a phenomenon sorts its own contents.
fn merge_lone_neighbors(slices: &mut Vec<Slice>) {
    slices.dedup_by(|next, previous| {
        let lone = next.members.len() == 1 && next.members == previous.members;
        if lone {
            previous.interval.far = next.interval.far;
        }
        lone
    });
}

fn merge_thinnest(slices: &mut Vec<Slice>) {
    let width = |pair: &[Slice]| (pair[1].interval.far - pair[0].interval.near) / pair[1].interval.far.max(1e-9);
    let thinnest =
        slices.windows(2).enumerate().min_by(|(_, a), (_, b)| width(a).total_cmp(&width(b))).map(|(index, _)| index);
    let Some(index) = thinnest else { return };
    let next = slices.remove(index + 1);
    let merged = &mut slices[index];
    merged.interval.far = next.interval.far;
    merged.members.extend(next.members);
    merged.members.sort_unstable();
    merged.members.dedup();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interval(near: f64, far: f64) -> DepthInterval {
        DepthInterval { near, far }
    }

    #[test]
    fn rain_is_cut_where_the_flame_stands() {
        let slices = cut(&[vec![interval(0.0, 50.0)], vec![interval(3.0, 4.0)]]);
        let expected = [
            Slice { interval: interval(0.0, 3.0), members: vec![0] },
            Slice { interval: interval(3.0, 4.0), members: vec![0, 1] },
            Slice { interval: interval(4.0, 50.0), members: vec![0] },
        ];
        assert_eq!(slices, expected);
    }

    #[test]
    fn gaps_hold_no_slice_and_a_lone_phenomenon_needs_no_cut() {
        let slices = cut(&[vec![interval(1.0, 2.0), interval(2.0, 3.0), interval(5.0, 6.0)]]);
        assert_eq!(slices.len(), 1, "one phenomenon sorts itself: {slices:?}");
        assert_eq!(cut(&[]), []);
    }

    #[test]
    fn a_sheet_without_thickness_has_a_slice_of_its_own() {
        let slices = cut(&[vec![interval(0.0, 50.0)], vec![interval(3.0, 3.0)]]);
        assert_eq!(slices.len(), 3);
        assert!(slices[1].interval.contains(3.0) && slices[1].members == [0, 1]);
    }

    #[test]
    fn a_thousand_edges_come_to_a_bounded_number_of_slices_that_miss_nobody() {
        let many: Vec<Vec<DepthInterval>> =
            (0..500).map(|i| vec![interval(f64::from(i) * 0.1, f64::from(i) * 0.1 + 0.05)]).collect();
        let slices = cut(&many);
        assert!(slices.len() <= MAX_SLICES);
        let mut seen: Vec<usize> = slices.iter().flat_map(|slice| slice.members.clone()).collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 500);
        assert!(slices.windows(2).all(|pair| pair[0].interval.far <= pair[1].interval.near));
    }
}
