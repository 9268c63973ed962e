//! Whether a sheet passes through another from one moment to the next, also where the two lie side by side and never cross.

use bansho_base::math::DVec2;

use crate::shapes::{Shape, Sheet};

/// With more sheets than these nobody sees which is which.
const MOST_SHEETS: usize = 40;
/// Places along a sheet that are looked at, in quarters of its points.
const PLACES: [usize; 3] = [1, 2, 3];
/// Those who pass are as near to each other as they move, but for this factor.
const NEAR: f64 = 1.5;

/// Whether a sheet of `before` is on the other side of another in `after`, a moment later: both have the same control points.
pub(crate) fn passes(before: &Shape, after: &Shape) -> bool {
    let count = before.sheets.len();
    let alike = |(a, b): (&Sheet, &Sheet)| a.points.len() == b.points.len();
    if count > MOST_SHEETS || count != after.sheets.len() || !before.sheets.iter().zip(&after.sheets).all(alike) {
        return false;
    }
    let pairs =
        || (0..count).flat_map(|own| (0..count).filter(move |other| *other != own).map(move |other| (own, other)));
    pairs().any(|(own, other)| {
        let [own, other] = [own, other].map(|sheet| [&before.sheets[sheet].points[..], &after.sheets[sheet].points]);
        let moved = other[0].iter().zip(other[1]).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        PLACES.iter().any(|quarters| {
            let point = own.map(|points| points[quarters * (points.len() - 1) / 4]);
            let sides = [0, 1].map(|moment| side(point[moment], other[moment]));
            let [Some(was), Some(is)] = sides else { return false };
            was * is < 0.0 && was.abs() + is.abs() < NEAR * (moved + point[0].distance(point[1]))
        })
    })
}

/// Distance of a point from a line, positive on one side of it; none where its end is nearest.
fn side(point: DVec2, line: &[DVec2]) -> Option<f64> {
    let (mut least, mut nearest) = (f64::INFINITY, None);
    let last = line.len().saturating_sub(2);
    for (index, pair) in line.windows(2).enumerate() {
        let direction = pair[1] - pair[0];
        let unclamped = (point - pair[0]).dot(direction) / direction.length_squared().max(f64::MIN_POSITIVE);
        let clamped = unclamped.clamp(0.0, 1.0);
        let distance = point.distance(pair[0] + direction * clamped);
        if distance < least {
            let beyond = (index == 0 && unclamped < 0.0) || (index == last && unclamped > 1.0);
            (least, nearest) = (distance, (!beyond).then(|| distance.copysign(direction.perp_dot(point - pair[0]))));
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(y: f64, from: f64) -> Sheet {
        Sheet {
            points: (0..9).map(|index| DVec2::new(from + 10.0 * f64::from(index), y)).collect(),
            ..Sheet::default()
        }
    }

    #[test]
    fn a_sheet_that_is_beyond_another_has_passed_it() {
        let shape = |a: Sheet, b: Sheet| Shape { sheets: vec![a, b] };
        let before = shape(row(0.0, 0.0), row(2.0, 0.0));
        assert!(passes(&before, &shape(row(3.0, 0.0), row(1.0, 0.0))));
        assert!(!passes(&before, &shape(row(1.0, 0.0), row(3.0, 0.0))), "it comes nearer");
        // Beside its end there is nothing to pass through.
        let beside = shape(row(0.0, 0.0), row(2.0, 100.0));
        assert!(!passes(&beside, &shape(row(3.0, 0.0), row(1.0, 100.0))));
        assert!(!passes(&before, &Shape { sheets: vec![row(0.0, 0.0)] }));
    }
}
