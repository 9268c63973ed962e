//! The assignment problem (Hungarian algorithm).

/// Minimum-cost assignment by shortest augmenting paths, O(n^3) (Kuhn 1955; Jonker & Volgenant 1987). `cost(row,
/// column)` must be finite. Returns the column of each row.
pub(super) fn assign(count: usize, cost: impl Fn(usize, usize) -> f64) -> Vec<usize> {
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
