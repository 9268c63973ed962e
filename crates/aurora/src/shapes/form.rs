//! Named auroral forms, each defined by its heading along the sheet.

use bansho_base::math::{self, DVec2, lerp, saturate, smoothstep};

bansho_base::choice! {
    /// Auroral form.
    pub enum Form {
        /// A quiet arc with its middle to the north.
        Arc = "arc",
        /// A band with shallow waves (`wave_count`).
        Band = "band",
        /// An S whose middle section runs backward.
        SShape = "s_shape",
        /// A band that winds up at its eastern end (`bend_deg` 630 is one turn and three quarters).
        Spiral = "spiral",
        /// A band with `wave_count` folds whose flanks run backward.
        Fold = "fold",
        /// A substorm's surge: a band that rises to the north and curls over.
        Surge = "surge",
        /// A row of `wave_count` tongues, wide at the top: omega bands.
        Omega = "omega",
        /// A band whose eastern end peels off and folds back.
        Peel = "peel",
    }
}

/// Number of segments of a form's line.
const SEGMENTS: usize = 256;

/// Sine of an angle in turns.
fn wave(turns: f64) -> f64 {
    math::sin(std::f64::consts::TAU * turns)
}

impl Form {
    /// Default bend, degrees.
    fn default_bend_deg(self) -> f64 {
        match self {
            Self::Arc => 40.0,
            Self::Band => 38.0,
            Self::SShape => 140.0,
            Self::Spiral => 630.0,
            Self::Fold => 105.0,
            Self::Surge => 85.0,
            Self::Omega => 110.0,
            Self::Peel => 180.0,
        }
    }

    /// Default number of waves or folds.
    fn default_count(self) -> i64 {
        match self {
            Self::Arc | Self::SShape | Self::Spiral | Self::Surge | Self::Peel => 1,
            Self::Fold => 2,
            Self::Band | Self::Omega => 3,
        }
    }

    /// Heading at the fraction `s` of the length, in units of the bend: 0 is east, positive is south.
    fn heading(self, s: f64, count: f64) -> f64 {
        match self {
            Self::Arc => s - 0.5,
            Self::Band => wave(count * s) * (0.65 + 0.35 * wave(0.31 + 0.7 * s)),
            // 0 at the ends and 1 in the middle, which runs backward.
            Self::SShape => wave(0.5 * s) * wave(0.5 * s),
            // An Euler spiral after a straight section: its curvature increases monotonically, so it cannot cross
            // itself.
            Self::Spiral => {
                let wound = saturate((s - 0.15) / 0.85);
                wound * wound
            }
            // The sine-generated curve of meanders (Langbein & Leopold 1966), attenuated at both ends.
            Self::Fold => wave(count * s) * smoothstep(0.0, 0.2, s) * smoothstep(0.0, 0.2, 1.0 - s),
            Self::Surge => {
                let rise = smoothstep(0.2, 0.4, s) - 2.3 * smoothstep(0.45, 0.85, s);
                -rise
            }
            Self::Omega => {
                let phase = count * s;
                wave(phase) + 0.12 * wave(2.0 * phase)
            }
            Self::Peel => -smoothstep(0.62, 0.8, s),
        }
    }

    /// The form's line of length 1 about the origin, x east and z south.
    pub(super) fn line(self, bend_deg: Option<f64>, count: Option<i64>) -> Vec<DVec2> {
        let bend = bend_deg.unwrap_or_else(|| self.default_bend_deg()).to_radians();
        let count = count.unwrap_or_else(|| self.default_count()) as f64;
        let mut at = DVec2::ZERO;
        let mut line = vec![at];
        for segment in 0..SEGMENTS {
            let s = (segment as f64 + 0.5) / SEGMENTS as f64;
            let (sin, cos) = math::sin_cos(bend * self.heading(s, count));
            at += DVec2::new(cos, sin) / SEGMENTS as f64;
            line.push(at);
        }
        let low = line.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = line.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let middle = DVec2::new(lerp(low.x, high.x, 0.5), lerp(low.y, high.y, 0.5));
        line.iter().map(|point| point - middle).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{geometry::polyline::Polyline, strokes::intersection::first_crossing};

    #[test]
    fn every_form_is_a_line_of_length_one_that_does_not_cross_itself() {
        for choice in Form::CHOICES {
            let form = Form::from_name(choice.name).unwrap();
            let line = form.line(None, None);
            assert_eq!(first_crossing(&[&line]), None, "{}", choice.name);
            assert!((Polyline::new(line.clone()).unwrap().length() - 1.0).abs() < 1e-9);
            assert!(line.iter().all(|point| point.abs().max_element() < 0.5), "{}", choice.name);
        }
    }

    /// An arc bent by 60 degrees has the radius 3/pi: chord 2 r sin 30, sagitta r (1 - cos 30), its middle to the north.
    #[test]
    fn an_arc_is_part_of_a_circle() {
        let line = Form::Arc.line(Some(60.0), None);
        let (first, middle, last) = (line[0], line[SEGMENTS / 2], line[SEGMENTS]);
        let radius = 3.0 / std::f64::consts::PI;
        assert!((first.distance(last) - radius).abs() < 1e-5);
        assert!((first.y - middle.y - radius * (1.0 - 3.0_f64.sqrt() / 2.0)).abs() < 1e-5);
    }

    #[test]
    fn an_s_runs_back_in_its_middle_and_looks_the_same_upside_down() {
        let line = Form::SShape.line(None, None);
        assert!(line[SEGMENTS / 2 + 1].x < line[SEGMENTS / 2 - 1].x);
        for index in 0..=SEGMENTS {
            assert!((line[index] + line[SEGMENTS - index]).length() < 1e-9);
        }
    }
}
