//! Cutting the depth of a picture into slices, so that phenomena occlude each other correctly.

use bansho_base::phenomenon::strip::DepthInterval;

/// An interval of depth, and the phenomena in it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slice {
    pub(crate) interval: DepthInterval,
    /// Indices of the phenomena.
    pub(crate) members: Vec<usize>,
}

/// Largest number of slices that cut an interval, so that a phenomenon is drawn in parts. With more, the thinnest neighbors are merged.
const MAX_CUTS: usize = 24;
/// Largest number of slices.
const MAX_SLICES: usize = 256;

/// Slices from near to far, cut wherever a phenomenon begins or ends.
///
/// `intervals[i]` are the intervals that phenomenon `i` fills. Neighboring slices with the same members are separate only where another
/// phenomenon begins or ends between them. Members of a slice are sorted from near to far and, at equal depth, by name: the picture must not depend on the
/// order of the scene's tables. `names[i]` is `None` for what is shared by the scene (lamps, obstacles, ground, sky), which follows all others in its order.
///
/// `opaque` is the only phenomenon with opaque surfaces, if nothing refracts light: all others are hidden behind its surfaces in each pixel, so that it cuts
/// none of them. It has a slice of its own, behind all slices that begin before it ends.
pub(crate) fn cut(intervals: &[Vec<DepthInterval>], names: &[Option<&str>], opaque: Option<usize>) -> Vec<Slice> {
    let mut intervals: Vec<Vec<DepthInterval>> =
        intervals.iter().map(|filled| filled.iter().map(thickened).collect()).collect();
    let opaque = opaque.and_then(|member| slice_of_all(member, &std::mem::take(&mut intervals[member])));
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
    merge_to_limit(&mut slices, MAX_CUTS, |slice| cuts_an_interval(intervals, slice));
    merge_to_limit(&mut slices, MAX_SLICES, |_| true);
    slices.iter_mut().for_each(|slice| sort_members(slice, intervals, names));
    if let Some(opaque) = opaque {
        let place = slices.partition_point(|slice| slice.interval.near < opaque.interval.far);
        slices.insert(place, opaque);
    }
    slices
}

/// A slice that contains all intervals of a phenomenon and nothing else; `None` if it fills none.
fn slice_of_all(member: usize, intervals: &[DepthInterval]) -> Option<Slice> {
    let near = intervals.iter().map(|interval| interval.near).reduce(f64::min)?;
    let far = intervals.iter().map(|interval| interval.far).reduce(f64::max)?;
    Some(Slice { interval: DepthInterval { near, far }, members: vec![member] })
}

/// Whether a member of a slice goes on before or behind it: then it is drawn in several slices, which costs more than one.
fn cuts_an_interval(intervals: &[Vec<DepthInterval>], slice: &Slice) -> bool {
    let DepthInterval { near, far } = slice.interval;
    let mut of_members = slice.members.iter().flat_map(|&member| &intervals[member]);
    of_members.any(|interval| interval.overlaps(&slice.interval) && (interval.near < near || interval.far > far))
}

/// Sorts the members of a slice by the mean depth of those of their intervals that overlap it.
///
/// Gas, for example, is drawn in layers, each at the middle of its interval, which another phenomenon may have cut.
fn sort_members(slice: &mut Slice, intervals: &[Vec<DepthInterval>], names: &[Option<&str>]) {
    if slice.members.len() < 2 {
        return;
    }
    let interval = slice.interval;
    slice.members.sort_by(|&a, &b| match (names[a], names[b]) {
        (Some(name), Some(other)) => {
            let [depth, other_depth] = [a, b].map(|member| mean_depth(&intervals[member], &interval));
            depth.total_cmp(&other_depth).then_with(|| name.cmp(other))
        }
        (own, other) => own.is_none().cmp(&other.is_none()).then(a.cmp(&b)),
    });
}

/// Mean depth of the middles of those `intervals` that overlap a slice, m.
fn mean_depth(intervals: &[DepthInterval], slice: &DepthInterval) -> f64 {
    /// Depth at which intervals without end are cut off, m: far behind everything.
    const END: f64 = 1e12;
    let (mut sum, mut count) = (0.0, 0.0);
    for interval in intervals.iter().filter(|interval| interval.overlaps(slice)) {
        sum += 0.5 * (interval.near.max(-END) + interval.far.min(END));
        count += 1.0;
    }
    sum / f64::max(count, 1.0)
}

/// An interval of positive length. A sheet that faces the camera has a single depth; its interval becomes the shortest possible.
fn thickened(interval: &DepthInterval) -> DepthInterval {
    DepthInterval { near: interval.near, far: interval.far.max(interval.near.next_up()) }
}

/// The phenomena of which an interval overlaps a slice.
fn members(intervals: &[Vec<DepthInterval>], slice: &DepthInterval) -> Vec<usize> {
    let mut members = Vec::new();
    for (index, filled) in intervals.iter().enumerate() {
        if filled.iter().any(|interval| interval.overlaps(slice)) {
            members.push(index);
        }
    }
    members
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

/// Thickness of two neighboring slices together, relative to their far end.
fn relative_thickness(pair: &[Slice]) -> f64 {
    (pair[1].interval.far - pair[0].interval.near) / pair[1].interval.far.max(1e-9)
}

/// Merges the thinnest neighbors until no more than `limit` slices are counted.
fn merge_to_limit(slices: &mut Vec<Slice>, limit: usize, is_counted: impl Fn(&Slice) -> bool) {
    let mut counted: Vec<bool> = slices.iter().map(&is_counted).collect();
    let mut count = counted.iter().filter(|counted| **counted).count();
    while count > limit {
        // At least one of them is counted, so that each merger gets nearer to the limit or leaves it as it is with fewer slices.
        let pairs = slices.windows(2).zip(counted.windows(2)).enumerate();
        let thinnest = pairs
            .filter(|(_, (_, counted))| counted[0] || counted[1])
            .min_by(|(_, (a, _)), (_, (b, _))| relative_thickness(a).total_cmp(&relative_thickness(b)))
            .map(|(index, _)| index);
        let Some(index) = thinnest else { return };
        let next = slices.remove(index + 1);
        count -= [counted[index], counted.remove(index + 1)].into_iter().filter(|counted| *counted).count();
        let merged = &mut slices[index];
        merged.interval.far = next.interval.far;
        merged.members.extend(next.members);
        merged.members.sort_unstable();
        merged.members.dedup();
        counted[index] = is_counted(merged);
        count += usize::from(counted[index]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interval(near: f64, far: f64) -> DepthInterval {
        DepthInterval { near, far }
    }

    /// The slices of phenomena that are named in the order of their indices.
    fn cut(intervals: &[Vec<DepthInterval>]) -> Vec<Slice> {
        let names: Vec<String> = (0..intervals.len()).map(|i| format!("{i:05}")).collect();
        let names: Vec<Option<&str>> = names.iter().map(|name| Some(name.as_str())).collect();
        super::cut(intervals, &names, None)
    }

    #[test]
    fn rain_is_cut_where_the_flame_stands() {
        let slices = cut(&[vec![interval(0.0, 50.0)], vec![interval(3.0, 4.0)]]);
        let expected = [
            Slice { interval: interval(0.0, 3.0), members: vec![0] },
            Slice { interval: interval(3.0, 4.0), members: vec![1, 0] },
            Slice { interval: interval(4.0, 50.0), members: vec![0] },
        ];
        assert_eq!(slices, expected);
    }

    #[test]
    fn opaque_surfaces_cut_nothing() {
        let intervals =
            [vec![interval(0.0, 50.0)], vec![interval(3.0, 4.0), interval(8.0, 8.0)], vec![interval(5.0, 60.0)]];
        let slices = super::cut(&intervals, &[Some("rain"), None, None], Some(1));
        let expected = [
            Slice { interval: interval(0.0, 5.0), members: vec![0] },
            Slice { interval: interval(5.0, 50.0), members: vec![0, 2] },
            Slice { interval: interval(3.0, 8.0_f64.next_up()), members: vec![1] },
            Slice { interval: interval(50.0, 60.0), members: vec![2] },
        ];
        assert_eq!(slices, expected);
        assert_eq!(super::cut(&[Vec::new()], &[None], Some(0)), [], "none is seen");
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
        assert!(slices[1].interval.contains(3.0) && slices[1].members == [1, 0]);
    }

    #[test]
    fn a_thousand_edges_come_to_a_bounded_number_of_slices_that_miss_nobody() {
        let crowd = || (0..500).map(|i| vec![interval(f64::from(i) * 0.1, f64::from(i) * 0.1 + 0.05)]);
        let rain = vec![interval(0.0, 100.0)];
        for (many, limit) in [(crowd().collect::<Vec<_>>(), MAX_SLICES), (crowd().chain([rain]).collect(), MAX_CUTS)] {
            let slices = cut(&many);
            assert!(slices.len() <= limit, "{}", slices.len());
            let mut seen: Vec<usize> = slices.iter().flat_map(|slice| slice.members.clone()).collect();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), many.len());
            assert!(slices.windows(2).all(|pair| pair[0].interval.far <= pair[1].interval.near));
        }
    }

    /// Names of the members of the slices, from near to far.
    fn names_from_near_to_far(tables: &[(&'static str, Vec<DepthInterval>)]) -> Vec<Vec<&'static str>> {
        let intervals: Vec<Vec<DepthInterval>> = tables.iter().map(|(_, filled)| filled.clone()).collect();
        let names: Vec<Option<&str>> =
            tables.iter().map(|(name, _)| (!["ground", "sky"].contains(name)).then_some(*name)).collect();
        let members = |slice: Slice| slice.members.iter().map(|&member| tables[member].0).collect();
        super::cut(&intervals, &names, None).into_iter().map(members).collect()
    }

    #[test]
    fn slices_and_their_members_do_not_depend_on_the_order_of_tables() {
        // Two gases whose layers interleave, two sheets at one depth, one a little farther, and rain; the ground stays last.
        let tables = [
            ("gas", vec![interval(2.0, 2.4), interval(2.4, 2.8)]),
            ("more gas", vec![interval(2.1, 2.5), interval(2.5, 2.9)]),
            ("b", vec![interval(3.0, 3.0)]),
            ("a", vec![interval(3.0, 3.0)]),
            ("behind", vec![interval(3.01, 3.01)]),
            ("rain", vec![interval(0.05, 50.0)]),
            ("ground", vec![interval(0.0, 1e5)]),
        ];
        let expected = names_from_near_to_far(&tables);
        let mut swapped = tables.clone();
        swapped[..6].reverse();
        assert_eq!(names_from_near_to_far(&swapped), expected);
        swapped[..6].rotate_left(2);
        assert_eq!(names_from_near_to_far(&swapped), expected);
        let position = |names: &[&str]| expected.iter().position(|members| members == names);
        assert!(
            position(&["gas", "more gas", "rain", "ground"]).is_some(),
            "the middle of a layer counts: {expected:?}"
        );
        let [at, behind] = [position(&["a", "b", "rain", "ground"]), position(&["behind", "rain", "ground"])];
        assert!(at.is_some() && at < behind, "{expected:?}");
    }

    #[test]
    fn hundreds_of_sheets_without_rain_are_not_merged() {
        let [odd, even] = [0, 1].map(|first| (0..60).map(move |i| f64::from(2 * i + first) * 0.01 + 1.0));
        let [odd, even] = [odd, even].map(|depths| depths.map(|depth| interval(depth, depth)).collect::<Vec<_>>());
        assert_eq!(cut(&[odd, even]).len(), 120);
    }
}
