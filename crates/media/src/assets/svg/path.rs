//! Path data (the `d` attribute), flattened to polylines.

use bansho_base::math::{self, DVec2};

use super::numbers::NumberReader;

/// Segments of a curve, and of each quarter of an arc.
const CURVE_SEGMENTS: usize = 16;

/// Why path data cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum PathError {
    #[error("a path does not begin with a move (M or m)")]
    NoMove,
    #[error("a path lacks numbers after `{0}`")]
    MissingNumbers(char),
    #[error("`{0}` is not a path command")]
    UnknownCommand(char),
    #[error("a path has a single point; allowed: at least 2 points")]
    SinglePoint,
    #[error("a path has more than {0} points")]
    TooManyPoints(usize),
}

/// The last control point of a curve.
#[derive(Clone, Copy)]
struct ControlPoint {
    is_cubic: bool,
    point: DVec2,
}

/// The state of the pen.
#[derive(Default)]
struct Pen {
    subpaths: Vec<Vec<DVec2>>,
    points: usize,
    current: DVec2,
    /// Start of the subpath.
    start: DVec2,
    /// The last control point of the curve that was just drawn, for smooth curves.
    control: Option<ControlPoint>,
}

/// The subpaths of a path, each as a polyline. Moves that draw nothing are skipped.
///
/// # Errors
/// An unknown command, missing numbers, only moves, or more than `limit` points.
pub(super) fn subpaths(data: &str, limit: usize) -> Result<Vec<Vec<DVec2>>, PathError> {
    let mut numbers = NumberReader::new(data);
    let mut pen = Pen::default();
    let mut command = None;
    while let Some(next) = numbers.peek() {
        if next.is_ascii_alphabetic() {
            numbers.take();
            command = Some(next);
        }
        let letter = command.ok_or(PathError::NoMove)?;
        if pen.subpaths.is_empty() && !letter.eq_ignore_ascii_case(&'m') {
            return Err(PathError::NoMove);
        }
        pen.draw(letter, &mut numbers)?;
        if pen.points > limit {
            return Err(PathError::TooManyPoints(limit));
        }
        // Further pairs after a move are lines. After a closing, only a command may follow.
        command = match letter {
            'M' => Some('L'),
            'm' => Some('l'),
            'Z' | 'z' => None,
            other => Some(other),
        };
    }
    let moves = !pen.subpaths.is_empty();
    pen.subpaths.retain(|points| points.len() > 1);
    if moves && pen.subpaths.is_empty() { Err(PathError::SinglePoint) } else { Ok(pen.subpaths) }
}

/// The flags of an arc.
struct ArcFlags {
    /// More than 180 degrees.
    large: bool,
    /// In the direction of increasing angles.
    sweep: bool,
}

impl Pen {
    fn draw(&mut self, letter: char, numbers: &mut NumberReader) -> Result<(), PathError> {
        let origin = if letter.is_ascii_lowercase() { self.current } else { DVec2::ZERO };
        let missing = PathError::MissingNumbers(letter);
        let mut point = || numbers.take_all::<2>().map(|pair| origin + DVec2::from(pair)).ok_or(missing);
        match letter.to_ascii_uppercase() {
            'M' => self.move_to(point()?),
            'L' => self.line_to(point()?),
            'H' => self.line_to(DVec2::new(origin.x + numbers.next().ok_or(missing)?, self.current.y)),
            'V' => self.line_to(DVec2::new(self.current.x, origin.y + numbers.next().ok_or(missing)?)),
            'C' => self.cubic_to(point()?, point()?, point()?),
            'S' => self.cubic_to(self.reflected_control(true), point()?, point()?),
            'Q' => self.quadratic_to(point()?, point()?),
            'T' => self.quadratic_to(self.reflected_control(false), point()?),
            'A' => {
                let [rx, ry, rotation_deg] = numbers.take_all().ok_or(missing)?;
                let large = numbers.flag().ok_or(missing)?;
                let sweep = numbers.flag().ok_or(missing)?;
                let end = numbers.take_all::<2>().map(|pair| origin + DVec2::from(pair)).ok_or(missing)?;
                self.arc_to(DVec2::new(rx, ry), rotation_deg.to_radians(), ArcFlags { large, sweep }, end);
            }
            'Z' => self.close(),
            _ => return Err(PathError::UnknownCommand(letter)),
        }
        Ok(())
    }

    fn move_to(&mut self, point: DVec2) {
        self.subpaths.push(vec![point]);
        self.points += 1;
        (self.current, self.start, self.control) = (point, point, None);
    }

    fn push(&mut self, point: DVec2) {
        if let Some(points) = self.subpaths.last_mut() {
            points.push(point);
        }
        self.points += 1;
        self.current = point;
    }

    fn line_to(&mut self, point: DVec2) {
        self.push(point);
        self.control = None;
    }

    fn close(&mut self) {
        let start = self.start;
        if self.current != start {
            self.line_to(start);
        }
        // A command that follows without a move begins at the start.
        self.move_to(start);
    }

    /// The reflected control point; the current point, if no curve of the same degree precedes.
    fn reflected_control(&self, is_cubic: bool) -> DVec2 {
        match self.control {
            Some(control) if control.is_cubic == is_cubic => 2.0 * self.current - control.point,
            _ => self.current,
        }
    }

    fn cubic_to(&mut self, first: DVec2, second: DVec2, end: DVec2) {
        let start = self.current;
        for segment in 1..=CURVE_SEGMENTS {
            let t = segment as f64 / CURVE_SEGMENTS as f64;
            let [a, b, c] = [start.lerp(first, t), first.lerp(second, t), second.lerp(end, t)];
            self.push(a.lerp(b, t).lerp(b.lerp(c, t), t));
        }
        self.control = Some(ControlPoint { is_cubic: true, point: second });
    }

    fn quadratic_to(&mut self, control: DVec2, end: DVec2) {
        let start = self.current;
        for segment in 1..=CURVE_SEGMENTS {
            let t = segment as f64 / CURVE_SEGMENTS as f64;
            self.push(start.lerp(control, t).lerp(control.lerp(end, t), t));
        }
        self.control = Some(ControlPoint { is_cubic: false, point: control });
    }

    /// An arc of an ellipse, by its end points (SVG 1.1, appendix F.6).
    fn arc_to(&mut self, radii: DVec2, rotation: f64, ArcFlags { large, sweep }: ArcFlags, end: DVec2) {
        self.control = None;
        let radii = radii.abs();
        let (sin, cos) = math::sin_cos(rotation);
        let axis = DVec2::new(cos, sin);
        let half = DVec2::new(cos, -sin).rotate((self.current - end) / 2.0);
        if radii.min_element() == 0.0 || half == DVec2::ZERO {
            self.push(end);
            return;
        }
        // Radii that are too small are scaled up (F.6.6).
        let radii = radii * (half / radii).length().max(1.0);
        let ratio = half / radii;
        let square = (1.0 / ratio.length_squared() - 1.0).max(0.0).sqrt();
        let sign = if large == sweep { -1.0 } else { 1.0 };
        // Center and end angles on the unit circle.
        let center = sign * square * DVec2::new(ratio.y, -ratio.x);
        let angle = |point: DVec2| math::atan2(point.y - center.y, point.x - center.x);
        let from = angle(ratio);
        let mut swept = angle(-ratio) - from;
        if sweep && swept < 0.0 {
            swept += std::f64::consts::TAU;
        } else if !sweep && swept > 0.0 {
            swept -= std::f64::consts::TAU;
        }
        let middle = self.current.midpoint(end);
        let segments = (swept.abs() / std::f64::consts::FRAC_PI_2 * CURVE_SEGMENTS as f64).ceil().max(1.0) as usize;
        for segment in 1..segments {
            let (sin, cos) = math::sin_cos(from + swept * segment as f64 / segments as f64);
            self.push(middle + axis.rotate((center + DVec2::new(cos, sin)) * radii));
        }
        self.push(end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(data: &str) -> Vec<Vec<[f64; 2]>> {
        let lines = subpaths(data, 1000).unwrap();
        lines.into_iter().map(|line| line.into_iter().map(|point| point.to_array()).collect()).collect()
    }

    #[test]
    fn moves_lines_and_closings() {
        assert_eq!(lines("M1 2 3,4h1v-1l-1-1"), [[[1.0, 2.0], [3.0, 4.0], [4.0, 4.0], [4.0, 3.0], [3.0, 2.0]]]);
        assert_eq!(
            lines("m1 1 1 0zm5 0l0 1"),
            [vec![[1.0, 1.0], [2.0, 1.0], [1.0, 1.0]], vec![[6.0, 1.0], [6.0, 2.0]]]
        );
        assert_eq!(lines("M0 0 M1 1 L2 2"), [[[1.0, 1.0], [2.0, 2.0]]]);
        assert!(lines("").is_empty());
    }

    #[test]
    fn curves_pass_their_middle() {
        // Half of a cubic is (a + 3 b + 3 c + d) / 8, of a quadratic (a + 2 b + c) / 4.
        let cubic = &lines("M0 0C0 8 8 8 8 0S16-8 16 0")[0];
        assert_eq!((cubic.len(), cubic[8], cubic[24]), (33, [4.0, 6.0], [12.0, -6.0]));
        let quadratic = &lines("M0 0Q4 8 8 0T16 0")[0];
        assert_eq!((quadratic[8], quadratic[24]), ([4.0, 4.0], [12.0, -4.0]));
    }

    #[test]
    fn arcs_stay_on_their_circle() {
        for (data, center, pieces) in [
            ("M1 0A1 1 0 0 1 0 1", [0.0, 0.0], 16),
            ("M1 0A1 1 0 1 1 0 1", [1.0, 1.0], 48),
            ("M1 0A1 1 0 0 0 0 1", [1.0, 1.0], 16),
        ] {
            let line = subpaths(data, 1000).unwrap().remove(0);
            assert!(line.iter().all(|point| (point.distance(center.into()) - 1.0).abs() < 1e-12), "{data}");
            assert!(line.len().abs_diff(pieces + 1) <= 1, "{data}: {}", line.len());
        }
        // A radius that is too small grows to half of the distance; a rotated ellipse keeps its end points.
        let grown = subpaths("M0 0A1 1 0 0 1 4 0", 1000).unwrap().remove(0);
        assert!(grown.iter().all(|point| (point.distance(DVec2::new(2.0, 0.0)) - 2.0).abs() < 1e-12));
        let turned = subpaths("M0 0A3 1 30 0 1 4 1", 1000).unwrap().remove(0);
        assert_eq!((turned[0], turned[turned.len() - 1]), (DVec2::ZERO, DVec2::new(4.0, 1.0)));
        assert_eq!(lines("M0 0A0 1 0 0 1 4 1"), [[[0.0, 0.0], [4.0, 1.0]]]);
    }

    #[test]
    fn broken_paths_are_errors() {
        assert_eq!(subpaths("L1 1", 1000), Err(PathError::NoMove));
        assert_eq!(subpaths("1 1", 1000), Err(PathError::NoMove));
        assert_eq!(subpaths("M1", 1000), Err(PathError::MissingNumbers('M')));
        assert_eq!(subpaths("M1 1 B2 2", 1000), Err(PathError::UnknownCommand('B')));
        assert_eq!(subpaths("M1 1 L2 2 z 3", 1000), Err(PathError::NoMove));
        assert_eq!(subpaths("M0 0 A1 1 0 2 0 1 1", 1000), Err(PathError::MissingNumbers('A')));
        // Closings alone make points too, and no more are made than may be.
        assert_eq!(subpaths(&format!("M0 0{}", "z".repeat(1000)), 1000), Err(PathError::TooManyPoints(1000)));
    }
}
