//! Automatic matching of sheets between shapes (requested in chapter 4 of the thesis), as an assignment problem.

use std::collections::BTreeSet;

use bansho_base::math::DVec2;

use crate::shapes::{
    geometry::polyline::Polyline,
    strokes::intersection::{count_crossings, crossing_sheets},
};

/// Samples per sheet.
const SAMPLES: usize = 32;

/// Fractions of the transition at which crossings are counted.
const CHECKED_FRACTIONS: [f64; 3] = [0.25, 0.5, 0.75];

/// Maximum number of sheet crossing tests in the local search, about a second. With few sheets the search is
/// exhaustive.
const MAX_CROSSING_TESTS: usize = 60_000;
/// Candidate changes per iteration are the remaining tests divided by this.
const CANDIDATES_DIVISOR: usize = 8;

/// The target of a sheet, and whether its direction is reversed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SheetMatch {
    pub(crate) target: usize,
    pub(crate) reversed: bool,
}

/// A constraint from links.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct MatchConstraint {
    pub(super) target: Option<usize>,
    pub(super) reversed: Option<bool>,
}

impl MatchConstraint {
    fn allows(&self, matched: SheetMatch) -> bool {
        self.target.is_none_or(|target| target == matched.target)
            && self.reversed.is_none_or(|turned| turned == matched.reversed)
    }
}

/// Resampled sheets and targets, equal in number.
struct Comparison<'a> {
    constraints: &'a [MatchConstraint],
    sources: Vec<Vec<DVec2>>,
    targets: Vec<Vec<DVec2>>,
    /// Lengths of sheets and targets; their mean weights the motion.
    lengths: [Vec<f64>; 2],
}

/// Matches sources to targets with the minimum total motion, then removes crossings by swapping two targets or
/// reversing one sheet where possible. `constraints` take precedence.
pub(crate) fn match_sheets(
    sources: &[Polyline],
    targets: &[&Polyline],
    constraints: &[MatchConstraint],
) -> Vec<SheetMatch> {
    let comparison = Comparison {
        constraints,
        sources: sources.iter().map(|line| line.resample(SAMPLES)).collect(),
        targets: targets.iter().map(|line| line.resample(SAMPLES)).collect(),
        lengths: [sources.iter().map(Polyline::length).collect(), targets.iter().map(|line| line.length()).collect()],
    };
    let count = sources.len();
    let best: Vec<(f64, bool)> =
        (0..count * count).map(|pair| comparison.best_direction(pair / count, pair % count)).collect();
    // Larger than any possible total motion.
    let forbidden = 1.0 + best.iter().map(|(motion, _)| motion).sum::<f64>();
    let columns = assign(count, |source, target| {
        let is_forbidden = constraints[source].target.is_some_and(|required| required != target);
        best[source * count + target].0 + if is_forbidden { forbidden } else { 0.0 }
    });
    let mut initial = Vec::with_capacity(count);
    for (source, target) in columns.into_iter().enumerate() {
        initial.push(SheetMatch { target, reversed: best[source * count + target].1 });
    }
    comparison.reduce_crossings(initial).0
}

impl Comparison<'_> {
    fn target(&self, matched: SheetMatch) -> impl Iterator<Item = DVec2> {
        let points = &self.targets[matched.target];
        (0..SAMPLES).map(move |index| points[if matched.reversed { SAMPLES - 1 - index } else { index }])
    }

    /// Mean squared displacement times the length of the sheet.
    fn motion(&self, source: usize, matched: SheetMatch) -> f64 {
        let squares = self.sources[source].iter().zip(self.target(matched)).map(|(from, to)| from.distance_squared(to));
        let length = (self.lengths[0][source] + self.lengths[1][matched.target]) / 2.0;
        squares.sum::<f64>() / SAMPLES as f64 * length
    }

    /// The smaller motion of the two directions, and whether it is the reversed one.
    fn best_direction(&self, source: usize, target: usize) -> (f64, bool) {
        let [straight, turned] = [false, true].map(|reversed| self.motion(source, SheetMatch { target, reversed }));
        if let Some(reversed) = self.constraints[source].reversed {
            return (if reversed { turned } else { straight }, reversed);
        }
        if turned < straight { (turned, true) } else { (straight, false) }
    }

    /// Sheets interpolated at a fraction of the transition.
    fn interpolated(&self, matches: &[SheetMatch], fraction: f64) -> Vec<Vec<DVec2>> {
        let mut sheets = Vec::with_capacity(matches.len());
        for (source, matched) in self.sources.iter().zip(matches) {
            let points = source.iter().zip(self.target(*matched));
            sheets.push(points.map(|(from, to)| from.lerp(to, fraction)).collect());
        }
        sheets
    }

    fn crossings(&self, matches: &[SheetMatch]) -> usize {
        CHECKED_FRACTIONS.into_iter().map(|fraction| count_crossings(&self.interpolated(matches, fraction))).sum()
    }

    /// The sheets that cross others or themselves.
    fn crossed(&self, matches: &[SheetMatch]) -> BTreeSet<usize> {
        CHECKED_FRACTIONS
            .into_iter()
            .flat_map(|fraction| crossing_sheets(&self.interpolated(matches, fraction)))
            .collect()
    }

    /// Number of crossings and total motion.
    fn cost(&self, matches: &[SheetMatch]) -> (usize, f64) {
        (self.crossings(matches), self.all_motion(matches))
    }

    fn all_motion(&self, matches: &[SheetMatch]) -> f64 {
        matches.iter().enumerate().map(|(source, matched)| self.motion(source, *matched)).sum()
    }

    /// Local search: reverses one or swaps two as long as the number of crossings, or at equal number the motion,
    /// decreases. Also returns the number of changes tried.
    fn reduce_crossings(&self, mut matches: Vec<SheetMatch>) -> (Vec<SheetMatch>, usize) {
        let max_tries = MAX_CROSSING_TESTS / matches.len().max(1);
        let (mut cost, mut tries) = (self.cost(&matches), 0);
        while cost.0 > 0 && tries < max_tries {
            let candidates = self.candidate_changes(&matches, (max_tries / CANDIDATES_DIVISOR).min(max_tries - tries));
            tries += candidates.len();
            let candidates = candidates.into_iter().map(|other| (self.cost(&other), other));
            let best = candidates.reduce(|a, b| if is_less(b.0, a.0) { b } else { a });
            match best {
                Some((better, other)) if is_less(better, cost) => (cost, matches) = (better, other),
                _ => break,
            }
        }
        (matches, tries)
    }

    /// Up to `max_changes` allowed changes that involve a crossing sheet, those with the least motion first. Changes of two
    /// sheets without crossings cannot remove one.
    fn candidate_changes(&self, matches: &[SheetMatch], max_changes: usize) -> Vec<Vec<SheetMatch>> {
        let crossed = self.crossed(matches);
        let mut changes = Vec::new();
        for one in 0..matches.len() {
            let pairs = (0..=one).filter(|other| crossed.contains(&one) || crossed.contains(other));
            let allowed = pairs
                .map(|other| self.change(matches, [one, other]))
                .filter(|change| change.iter().all(|(source, matched)| self.constraints[*source].allows(*matched)));
            changes.extend(allowed);
        }
        if changes.len() > max_changes {
            changes.sort_by(|a, b| self.added_motion(matches, a).total_cmp(&self.added_motion(matches, b)));
            changes.truncate(max_changes);
        }
        let mut candidates = Vec::with_capacity(changes.len());
        for change in changes {
            let mut changed = matches.to_vec();
            for (source, matched) in change {
                changed[source] = matched;
            }
            candidates.push(changed);
        }
        candidates
    }

    /// Motion of a change beyond that of the present matches.
    fn added_motion(&self, matches: &[SheetMatch], change: &[(usize, SheetMatch); 2]) -> f64 {
        // A reversal is listed twice.
        let changed = if change[0].0 == change[1].0 { &change[..1] } else { change };
        changed
            .iter()
            .map(|(source, matched)| self.motion(*source, *matched) - self.motion(*source, matches[*source]))
            .sum()
    }

    /// The new matches of two sheets that swap their targets, or of a sheet that is reversed.
    fn change(&self, matches: &[SheetMatch], [one, other]: [usize; 2]) -> [(usize, SheetMatch); 2] {
        if one == other {
            let matched = matches[one];
            return [(one, SheetMatch { reversed: !matched.reversed, ..matched }); 2];
        }
        [(one, matches[other].target), (other, matches[one].target)]
            .map(|(source, target)| (source, SheetMatch { target, reversed: self.best_direction(source, target).1 }))
    }
}

/// Whether cost `a` (crossings, motion) is lower than `b`, by more than the rounding of the motion.
fn is_less(a: (usize, f64), b: (usize, f64)) -> bool {
    a.0 < b.0 || (a.0 == b.0 && a.1 < b.1 * (1.0 - 1e-12))
}

/// Minimum-cost assignment by shortest augmenting paths, O(n^3) (Kuhn 1955; Jonker & Volgenant 1987). `cost(row,
/// column)` must be finite. Returns the column of each row.
fn assign(count: usize, cost: impl Fn(usize, usize) -> f64) -> Vec<usize> {
    const FREE: usize = usize::MAX;
    let mut row_price = vec![0.0; count];
    // An extra column holds the row that is being inserted.
    let mut column_price = vec![0.0; count + 1];
    let mut row_of = vec![FREE; count + 1];
    for row in 0..count {
        row_of[count] = row;
        let mut column = count;
        let mut min_reduced = vec![f64::INFINITY; count];
        let mut previous_column = vec![count; count];
        let mut visited = vec![false; count + 1];
        while row_of[column] != FREE {
            visited[column] = true;
            let current = row_of[column];
            let (mut step, mut next) = (f64::INFINITY, column);
            for other in (0..count).filter(|&other| !visited[other]) {
                let reduced = cost(current, other) - row_price[current] - column_price[other];
                if reduced < min_reduced[other] {
                    (min_reduced[other], previous_column[other]) = (reduced, column);
                }
                if min_reduced[other] < step {
                    (step, next) = (min_reduced[other], other);
                }
            }
            for other in 0..=count {
                if visited[other] {
                    row_price[row_of[other]] += step;
                    column_price[other] -= step;
                } else {
                    min_reduced[other] -= step;
                }
            }
            column = next;
        }
        while column != count {
            row_of[column] = row_of[previous_column[column]];
            column = previous_column[column];
        }
    }
    let mut columns = vec![0; count];
    (0..count).for_each(|column| columns[row_of[column]] = column);
    columns
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;

    fn line(from: [f64; 2], to: [f64; 2]) -> Polyline {
        Polyline::new(vec![from.into(), to.into()]).unwrap()
    }

    fn matches(sources: &[Polyline], targets: &[Polyline]) -> Vec<(usize, bool)> {
        constrained_matches(sources, targets, &vec![MatchConstraint::default(); sources.len()])
    }

    fn constrained_matches(
        sources: &[Polyline],
        targets: &[Polyline],
        constraints: &[MatchConstraint],
    ) -> Vec<(usize, bool)> {
        let initial = match_sheets(sources, &targets.iter().collect::<Vec<_>>(), constraints);
        initial.into_iter().map(|matched| (matched.target, matched.reversed)).collect()
    }

    #[test]
    fn sheets_go_to_the_nearest_targets_whichever_way_they_were_drawn() {
        let sources = [line([0.0, 0.0], [10.0, 0.0]), line([0.0, 5.0], [10.0, 5.0])];
        let targets = [line([10.0, 6.0], [0.0, 6.0]), line([0.0, 1.0], [10.0, 1.0])];
        let found = matches(&sources, &targets);
        assert_eq!(found, [(1, false), (0, true)]);
        let turned = found.iter().filter(|(_, reversed)| *reversed).count();
        bansho_base::assert_measured!(
            "future work: correspondence: sheets that were drawn the other way",
            turned as f64,
            1.0,
            0.0
        );
    }

    #[test]
    fn what_a_person_wants_comes_before_what_is_near() {
        let sources = [line([0.0, 0.0], [10.0, 0.0]), line([0.0, 5.0], [10.0, 5.0])];
        let targets = [line([10.0, 6.0], [0.0, 6.0]), line([0.0, 1.0], [10.0, 1.0])];
        let mut constraints = [MatchConstraint::default(), MatchConstraint { target: Some(1), reversed: None }];
        assert_eq!(constrained_matches(&sources, &targets, &constraints), [(0, true), (1, false)]);
        constraints[1].reversed = Some(true);
        assert_eq!(constrained_matches(&sources, &targets, &constraints), [(0, true), (1, true)]);
    }

    #[test]
    fn all_together_move_least_even_where_one_could_move_less() {
        // Both like the first target best, but only the second source can take the second one cheaply.
        let sources = [line([0.0, 0.0], [10.0, 0.0]), line([0.0, 2.0], [10.0, 2.0])];
        let targets = [line([0.0, 1.5], [10.0, 1.5]), line([0.0, 9.0], [10.0, 9.0])];
        assert_eq!(matches(&sources, &targets), [(0, false), (1, false)]);
    }

    /// A sheet turns a quarter about one of its ends or the other: the first moves it less, but through another.
    #[test]
    fn sheets_that_would_cross_midway_are_turned() {
        let sources = [line([0.0, 0.0], [10.0, 0.0]), line([3.0, 4.0], [4.0, 3.0])];
        let targets = [line([1.0, 10.0], [0.0, 0.0]), line([3.0, 4.0], [4.0, 3.0])];
        let constraints = [MatchConstraint::default(); 2];
        let initial = match_sheets(&sources, &targets.iter().collect::<Vec<_>>(), &constraints);
        let comparison = comparison(&sources, &targets, &constraints);
        let through = [SheetMatch { target: 0, reversed: true }, SheetMatch { target: 1, reversed: false }];
        assert!(comparison.best_direction(0, 0).1 && comparison.crossings(&through) > 0);
        assert_eq!(comparison.crossings(&initial), 0);
    }

    fn comparison<'a>(
        sources: &[Polyline],
        targets: &[Polyline],
        constraints: &'a [MatchConstraint],
    ) -> Comparison<'a> {
        let sampled = |line: &Polyline| line.resample(SAMPLES);
        Comparison {
            constraints,
            sources: sources.iter().map(sampled).collect(),
            targets: targets.iter().map(sampled).collect(),
            lengths: [vec![1.0; sources.len()], vec![1.0; targets.len()]],
        }
    }

    /// The same beside very many sheets that stay: only what the two could become is looked at.
    #[test]
    fn a_crossing_among_many_sheets_takes_few_tries() {
        const MANY: usize = 200;
        let rows = || (0..MANY).map(|row| line([30.0, row as f64], [40.0, row as f64]));
        let with_rows = |two: [Polyline; 2]| two.into_iter().chain(rows()).collect::<Vec<_>>();
        let sources = with_rows([line([0.0, 0.0], [10.0, 0.0]), line([3.0, 4.0], [4.0, 3.0])]);
        let targets = with_rows([line([1.0, 10.0], [0.0, 0.0]), line([3.0, 4.0], [4.0, 3.0])]);
        let constraints = vec![MatchConstraint::default(); MANY + 2];
        let comparison = comparison(&sources, &targets, &constraints);
        let through: Vec<SheetMatch> =
            (0..MANY + 2).map(|target| SheetMatch { target, reversed: target == 0 }).collect();
        assert!(comparison.crossings(&through) > 0);
        let (initial, tries) = comparison.reduce_crossings(through);
        assert_eq!(comparison.crossings(&initial), 0);
        assert!(tries > 0 && tries <= MAX_CROSSING_TESTS / (MANY + 2) / CANDIDATES_DIVISOR, "{tries} tries");
    }

    fn permutations(count: usize) -> Vec<Vec<usize>> {
        if count == 0 {
            return vec![Vec::new()];
        }
        let insert = |shorter: Vec<usize>| {
            (0..count).map(move |slot| {
                let mut longer = shorter.clone();
                longer.insert(slot, count - 1);
                longer
            })
        };
        permutations(count - 1).into_iter().flat_map(insert).collect()
    }

    #[test]
    fn no_other_assignment_is_cheaper() {
        let key = Key::new(1, "assignment");
        for case in 0..300 {
            let count = 1 + (case % 6) as usize;
            let cost =
                |row: usize, column: usize| f64::from(key.uniforms(case, (row * 8 + column) as u32, Purpose(0))[0]);
            let total =
                |columns: &[usize]| columns.iter().enumerate().map(|(row, &column)| cost(row, column)).sum::<f64>();
            let best = permutations(count).iter().map(|columns| total(columns)).fold(f64::INFINITY, f64::min);
            let found = assign(count, cost);
            let mut sorted = found.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..count).collect::<Vec<_>>());
            assert!((total(&found) - best).abs() < 1e-9, "case {case}");
        }
    }

    #[test]
    fn greed_is_not_enough() {
        // The cheapest single pair (0, 0) would force the dearest (1, 1).
        let cost = [[1.0, 2.0], [3.0, 10.0]];
        assert_eq!(assign(2, |row, column| cost[row][column]), [1, 0]);
        assert!(assign(0, |_, _| 0.0).is_empty());
    }
}
