//! From a resolved tree to polylines.

use bansho_base::{geometry::strokes::Stroke, host::assets::AssetProblem, math::DVec2};
use usvg::{
    Group, Node, Path,
    tiny_skia_path::{PathSegment, Point, Transform},
};

use super::damaged;

/// Segments of a curve.
pub(super) const CURVE_SEGMENTS: usize = 16;

/// The strokes of a tree, moved by `origin`.
pub(super) fn of(root: &Group, origin: DVec2) -> Result<Vec<Stroke>, AssetProblem> {
    let mut strokes = Vec::new();
    collect(root, None, origin, &mut strokes)?;
    Ok(strokes)
}

fn non_empty(id: &str) -> Option<&str> {
    (!id.is_empty()).then_some(id)
}

/// Adds the strokes of a group whose nearest named group is `name`. Its depth was bounded by the first pass.
fn collect(group: &Group, name: Option<&str>, origin: DVec2, strokes: &mut Vec<Stroke>) -> Result<(), AssetProblem> {
    let name = non_empty(group.id()).or(name);
    for child in group.children() {
        match child {
            Node::Group(group) => collect(group, name, origin, strokes)?,
            Node::Path(path) if path.is_visible() => {
                let id = non_empty(path.id()).or(name);
                for points in polylines(path, origin) {
                    if !points.iter().all(|point| point.is_finite()) {
                        let id = id.unwrap_or("without an id");
                        return Err(damaged(format!("path `{id}`: a point is infinitely far away")));
                    }
                    strokes.push(Stroke { id: id.map(str::to_owned), points });
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// The subpaths of a path, each as a polyline; moves that draw nothing are left out.
fn polylines(path: &Path, origin: DVec2) -> Vec<Vec<DVec2>> {
    let transform = path.abs_transform();
    let mut lines: Vec<Vec<DVec2>> = Vec::new();
    let mut current = Point::zero();
    for segment in path.data().segments() {
        if let PathSegment::MoveTo(point) = segment {
            lines.push(vec![transformed(&transform, exact(point)) + origin]);
            current = point;
            continue;
        }
        let Some(line) = lines.last_mut() else { continue };
        let start = exact(current);
        match segment {
            PathSegment::MoveTo(_) => {}
            PathSegment::LineTo(end) => {
                line.push(transformed(&transform, exact(end)) + origin);
                current = end;
            }
            PathSegment::QuadTo(control, end) => {
                let points = [start, exact(control), exact(end)];
                line.extend(curve_steps().map(|t| transformed(&transform, quadratic(points, t)) + origin));
                current = end;
            }
            PathSegment::CubicTo(first, second, end) => {
                let points = [start, exact(first), exact(second), exact(end)];
                line.extend(curve_steps().map(|t| transformed(&transform, cubic(points, t)) + origin));
                current = end;
            }
            // A path that is back at its start already gets no point twice.
            PathSegment::Close => line.extend(line.first().copied().filter(|first| line.last() != Some(first))),
        }
    }
    lines.retain(|line| line.iter().any(|point| *point != line[0]));
    lines
}

/// The parameters of the points of a curve, without its start.
fn curve_steps() -> impl Iterator<Item = f64> {
    (1..=CURVE_SEGMENTS).map(|step| step as f64 / CURVE_SEGMENTS as f64)
}

/// A point in double precision.
fn exact(point: Point) -> DVec2 {
    DVec2::new(f64::from(point.x), f64::from(point.y))
}

fn transformed(transform: &Transform, point: DVec2) -> DVec2 {
    let &Transform { sx, kx, ky, sy, tx, ty } = transform;
    let [x_axis, y_axis, translation] =
        [[sx, ky], [kx, sy], [tx, ty]].map(|[x, y]| DVec2::new(f64::from(x), f64::from(y)));
    x_axis * point.x + y_axis * point.y + translation
}

/// A point of a quadratic Bezier curve.
fn quadratic([a, b, c]: [DVec2; 3], t: f64) -> DVec2 {
    let s = 1.0 - t;
    a * (s * s) + b * (2.0 * s * t) + c * (t * t)
}

/// A point of a cubic Bezier curve.
fn cubic([a, b, c, d]: [DVec2; 4], t: f64) -> DVec2 {
    let s = 1.0 - t;
    a * (s * s * s) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * (t * t * t)
}
