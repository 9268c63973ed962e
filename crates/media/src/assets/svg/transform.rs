//! The `transform` of an SVG element.

use bansho_base::math::{self, DVec2};

use super::numbers::NumberReader;

/// `x' = a x + c y + e`, `y' = b x + d y + f`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    columns: [DVec2; 3],
}

impl Transform {
    pub(super) const IDENTITY: Self = Self { columns: [DVec2::X, DVec2::Y, DVec2::ZERO] };

    fn new([a, b, c, d, e, f]: [f64; 6]) -> Self {
        Self { columns: [DVec2::new(a, b), DVec2::new(c, d), DVec2::new(e, f)] }
    }

    pub(super) fn apply(&self, point: DVec2) -> DVec2 {
        let [x, y, shift] = self.columns;
        x * point.x + y * point.y + shift
    }

    /// The composition that applies `inner` first.
    pub(super) fn after(&self, inner: &Self) -> Self {
        let [x, y, shift] = self.columns;
        let linear = |column: DVec2| x * column.x + y * column.y;
        Self { columns: [linear(inner.columns[0]), linear(inner.columns[1]), linear(inner.columns[2]) + shift] }
    }

    /// Reads a list such as `translate(3 4) rotate(30)`; `None` if it is invalid.
    pub(super) fn parse(list: &str) -> Option<Self> {
        let mut all = Self::IDENTITY;
        let mut rest = list.trim_start_matches(|c: char| c.is_whitespace() || c == ',');
        while !rest.is_empty() {
            let (name, after) = rest.split_once('(')?;
            let (arguments, after) = after.split_once(')')?;
            let mut numbers = NumberReader::new(arguments);
            let arguments: Vec<f64> = std::iter::from_fn(|| numbers.next()).collect();
            all = all.after(&Self::function(name.trim(), &arguments)?);
            rest = after.trim_start_matches(|c: char| c.is_whitespace() || c == ',');
        }
        Some(all)
    }

    fn function(name: &str, arguments: &[f64]) -> Option<Self> {
        Some(match (name, arguments) {
            ("matrix", &[a, b, c, d, e, f]) => Self::new([a, b, c, d, e, f]),
            ("translate", &[x]) => Self::new([1.0, 0.0, 0.0, 1.0, x, 0.0]),
            ("translate", &[x, y]) => Self::new([1.0, 0.0, 0.0, 1.0, x, y]),
            ("scale", &[s]) => Self::new([s, 0.0, 0.0, s, 0.0, 0.0]),
            ("scale", &[x, y]) => Self::new([x, 0.0, 0.0, y, 0.0, 0.0]),
            ("rotate", &[angle]) => {
                let (sin, cos) = math::sin_cos(angle.to_radians());
                Self::new([cos, sin, -sin, cos, 0.0, 0.0])
            }
            ("rotate", &[angle, x, y]) => {
                let there = Self::function("translate", &[x, y])?;
                let back = Self::function("translate", &[-x, -y])?;
                there.after(&Self::function("rotate", &[angle])?).after(&back)
            }
            ("skewX", &[angle]) => Self::new([1.0, 0.0, math::tan(angle.to_radians()), 1.0, 0.0, 0.0]),
            ("skewY", &[angle]) => Self::new([1.0, math::tan(angle.to_radians()), 0.0, 1.0, 0.0, 0.0]),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(list: &str, point: [f64; 2]) -> Option<DVec2> {
        Transform::parse(list).map(|transform| transform.apply(point.into()))
    }

    #[test]
    fn the_last_of_a_list_applies_first() {
        assert_eq!(applied("translate(10) scale(2, 3)", [1.0, 1.0]), Some(DVec2::new(12.0, 3.0)));
        assert_eq!(applied("scale(2),translate(10 1)", [1.0, 1.0]), Some(DVec2::new(22.0, 4.0)));
        assert_eq!(applied("matrix(1 2 3 4 5 6)", [1.0, 10.0]), Some(DVec2::new(36.0, 48.0)));
        let turned = applied("rotate(90 1 1)", [2.0, 1.0]).unwrap();
        assert!(turned.distance(DVec2::new(1.0, 2.0)) < 1e-12);
        assert!(applied("skewX(45)", [0.0, 2.0]).unwrap().distance(DVec2::splat(2.0)) < 1e-12);
        assert_eq!(applied("", [1.0, 2.0]), Some(DVec2::new(1.0, 2.0)));
    }

    #[test]
    fn what_is_no_transform_is_none() {
        assert_eq!(["turn(3)", "scale(", "rotate(1 2)", "scale"].map(Transform::parse), [None; 4]);
    }
}
