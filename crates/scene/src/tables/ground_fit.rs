//! Scale and shift of an inverse depth from the ground plane of the scene.
//!
//! Where a plate shows the ground, the distance of each pixel is known from the camera. Scale and shift are those for which most pixels below the
//! horizon lie on the ground (random sample consensus: Fischler & Bolles 1981, here with fixed pairs instead of random ones), refined by least squares with
//! Tukey's weights, which leave out what stands on the ground.

use std::fmt;

use bansho_base::{camera::Camera, math::DVec2};

use super::{depth::DepthScale, picture::DepthKind};

/// The view from which a plate was taken, as the scene states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateView {
    /// The camera, for a picture without overscan.
    pub camera: Camera,
    /// Size of that picture, which the plate covers, pixels.
    pub size: [usize; 2],
    /// Height of the ground, m; `None` in a scene without ground.
    pub ground_height: Option<f64>,
}

impl PlateView {
    /// The position in the picture of a position in an image of `image_size` pixels, which covers the picture, centered.
    fn picture_position(&self, position: [f64; 2], image_size: [usize; 2]) -> DVec2 {
        let scale = [0, 1].map(|axis| image_size[axis] as f64 / self.size[axis] as f64);
        let scale = scale[0].min(scale[1]);
        let center =
            |axis: usize| (position[axis] - 0.5 * image_size[axis] as f64) / scale + 0.5 * self.size[axis] as f64;
        DVec2::new(center(0), center(1))
    }

    /// The inverse of the ground's depth at a position in the picture, 1/m; `None` from the horizon up.
    fn inverse_ground_depth(&self, height: f64, pixel: DVec2) -> Option<f64> {
        let above = self.camera.position.y - height;
        // The position plus depth times direction is the point at that depth.
        let inverse = -self.camera.direction(pixel)?.y / above;
        (above > 0.0 && inverse > 0.0 && inverse.is_finite()).then_some(inverse)
    }
}

/// Number of samples along the longer side of a depth picture.
const SAMPLES: usize = 256;
/// Number of pairs of samples that are tried.
const PAIRS: usize = 1000;
/// Number of samples on which a pair is tested.
const CONSENSUS_SAMPLES: usize = 2000;
/// Largest deviation of a pixel that agrees with the ground, as a fraction of the ground's inverse distance there.
const RELATIVE_TOLERANCE: f64 = 0.1;
/// Added to that, as a fraction of the nearest ground's inverse distance: the noise of depth estimators.
const NOISE_TOLERANCE: f64 = 0.005;
/// Smallest difference of the inverse distances of two samples that make a pair, as a fraction of the nearest ground's.
const MIN_PAIR_DIFFERENCE: f64 = 0.05;
/// Smallest fraction of the pixels below the horizon that must agree with the ground.
const MIN_AGREEING_FRACTION: f64 = 0.1;
/// Smallest number of samples below the horizon.
const MIN_SAMPLES: usize = 16;
/// Smallest fraction of the variance of the inverse distance that the values of agreeing pixels must explain.
const MIN_EXPLAINED_VARIANCE: f64 = 0.9;
/// Number of refinement steps.
const REFINEMENT_STEPS: usize = 20;
/// Deviation from which on Tukey's weights are 0, standard deviations.
const TUKEY_CUTOFF: f64 = 4.685;

/// Why scale and shift cannot be found from the ground.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(super) enum GroundFitError {
    /// No ground is visible to the camera.
    #[error(
        "`depth_scale` and `depth_shift` are not set and cannot be found from the ground at {height} m: the camera sees none of it; allowed: \
         `depth_known`, or `depth_scale` and `depth_shift`"
    )]
    NotSeen {
        /// Height of the ground, m.
        height: f64,
    },
    /// Too few pixels agree with the ground.
    #[error(
        "`depth_scale` and `depth_shift` are not set and cannot be found from the ground at {height} m: only {:.1} % of the pixels below the \
         horizon agree; allowed: at least {:.0} %, with the camera of the photograph; or `depth_known`, or `depth_scale` and `depth_shift`",
        100.0 * .share, 100.0 * MIN_AGREEING_FRACTION
    )]
    TooFew {
        /// Fraction of the pixels below the horizon that agree.
        share: f64,
        /// Height of the ground, m.
        height: f64,
    },
    /// The values of the pixels that agree do not follow the distance of the ground.
    #[error(
        "`depth_scale` and `depth_shift` are not set and cannot be found from the ground at {height} m: the values do not follow its distance; \
         allowed: `depth_known`, or `depth_scale` and `depth_shift`"
    )]
    Flat {
        /// Height of the ground, m.
        height: f64,
    },
}

/// Scale and shift that were found from the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundFit {
    /// Inverse distance at 0, 1/m.
    pub shift: f64,
    /// Inverse distance for each unit, 1/m.
    pub slope: f64,
    /// Fraction of the pixels below the horizon that agree with the ground.
    pub share: f64,
    /// Root mean square of (found - known) / known of the distances of those pixels.
    pub residual: f64,
}

impl GroundFit {
    /// The scale that was found.
    pub fn scale(&self) -> DepthScale {
        DepthScale { kind: DepthKind::Inverse, meters: 1.0 / self.slope, shift: self.shift }
    }

    /// Inverse distance of a sample by this fit, less that of the ground there, 1/m.
    fn deviation(&self, sample: &Sample) -> f64 {
        self.slope.mul_add(sample.value, self.shift) - sample.inverse
    }
}

impl fmt::Display for GroundFit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scale = self.scale();
        write!(
            f,
            "`depth_scale = {:.6}` and `depth_shift = {:.6}` fit the ground best; {:.0} % of the pixels below the horizon agree with it, whose distances deviate \
             by {:.1} %",
            scale.meters,
            scale.shift,
            100.0 * self.share,
            100.0 * self.residual
        )
    }
}

/// A pixel below the horizon.
#[derive(Clone, Copy)]
struct Sample {
    value: f64,
    /// Inverse distance of the ground there, 1/m.
    inverse: f64,
}

/// Samples of a depth picture below the horizon.
struct GroundSamples {
    /// Those that have a depth value, from far to near.
    samples: Vec<Sample>,
    /// Number of all samples below the horizon, including those without a depth value.
    below_horizon: usize,
    /// Inverse distance of the nearest ground, 1/m.
    nearest: f64,
}

impl GroundSamples {
    /// Samples of a depth picture with these values, which belongs to an image of `image_size` pixels.
    fn new(values: &[f32], [width, height]: [usize; 2], image_size: [usize; 2], view: &PlateView, ground: f64) -> Self {
        let step = width.max(height).div_ceil(SAMPLES);
        let [columns, rows] = [width, height].map(|side| (step.min(side) / 2..side).step_by(step));
        let per_value = [image_size[0] as f64 / width as f64, image_size[1] as f64 / height as f64];
        let (mut samples, mut below_horizon) = (Vec::new(), 0);
        for y in rows {
            for x in columns.clone() {
                let position = [(x as f64 + 0.5) * per_value[0], (y as f64 + 0.5) * per_value[1]];
                let pixel = view.picture_position(position, image_size);
                let Some(inverse) = view.inverse_ground_depth(ground, pixel) else { continue };
                below_horizon += 1;
                let value = values[y * width + x];
                if value.is_finite() && value != 0.0 {
                    samples.push(Sample { value: f64::from(value), inverse });
                }
            }
        }
        samples.sort_by(|a, b| a.inverse.total_cmp(&b.inverse));
        let nearest = samples.last().map_or(0.0, |sample| sample.inverse);
        Self { samples, below_horizon, nearest }
    }

    /// Largest deviation of a sample that agrees with the ground, 1/m.
    fn tolerance(&self, sample: &Sample) -> f64 {
        RELATIVE_TOLERANCE.mul_add(sample.inverse, NOISE_TOLERANCE * self.nearest)
    }

    fn agrees(&self, fit: &GroundFit, sample: &Sample) -> bool {
        fit.deviation(sample).abs() <= self.tolerance(sample)
    }

    /// The line through the pair of samples with which most others agree.
    fn consensus(&self) -> Option<GroundFit> {
        let count = self.samples.len();
        let voters: Vec<&Sample> = self.samples.iter().step_by(count.div_ceil(CONSENSUS_SAMPLES).max(1)).collect();
        let mut best: Option<(usize, GroundFit)> = None;
        for pair in 0..PAIRS {
            // A sequence that fills the plane evenly: R2 of Roberts (2018), the powers of 1 / 1.3247, the plastic number.
            let [a, b] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2]
                .map(|step: f64| self.samples[((step * pair as f64).fract() * count as f64) as usize]);
            let slope = (a.inverse - b.inverse) / (a.value - b.value);
            let is_wide = (a.inverse - b.inverse).abs() >= MIN_PAIR_DIFFERENCE * self.nearest;
            if !(is_wide && slope > 0.0 && slope.is_finite()) {
                continue;
            }
            let fit = GroundFit { slope, shift: a.inverse - slope * a.value, share: 0.0, residual: 0.0 };
            let agreeing = voters.iter().filter(|sample| self.agrees(&fit, sample)).count();
            if best.is_none_or(|(most, _)| agreeing > most) {
                best = Some((agreeing, fit));
            }
        }
        best.map(|(_, fit)| fit)
    }

    /// One step of least squares with Tukey's weights; `None` if nothing determines a line that rises.
    fn refined(&self, fit: &GroundFit) -> Option<GroundFit> {
        // In units of the tolerance, which grows toward the camera.
        let relative: Vec<f64> =
            self.samples.iter().map(|sample| (fit.deviation(sample) / self.tolerance(sample)).abs()).collect();
        let mut deviations: Vec<f64> = relative.iter().copied().filter(|deviation| *deviation <= 1.0).collect();
        deviations.sort_by(f64::total_cmp);
        let median = *deviations.get(deviations.len() / 2)?;
        // 1.4826 median: a normal distribution's standard deviation. The floor keeps exact data from dividing by 0.
        let reach = TUKEY_CUTOFF * (1.4826 * median).max(1e-6);
        let weights: Vec<f64> = relative.iter().map(|deviation| tukey_biweight(deviation / reach)).collect();
        let (mut total, mut value, mut inverse) = (0.0, 0.0, 0.0);
        for (weight, sample) in weights.iter().zip(&self.samples) {
            total += weight;
            value += weight * sample.value;
            inverse += weight * sample.inverse;
        }
        // The weighted means, through which the line of least squares passes.
        let (value, inverse) = (value / total, inverse / total);
        let (mut covariance, mut variance) = (0.0, 0.0);
        for (weight, sample) in weights.iter().zip(&self.samples) {
            let weighted = weight * (sample.value - value);
            covariance += weighted * (sample.inverse - inverse);
            variance += weighted * (sample.value - value);
        }
        let slope = covariance / variance;
        (slope > 0.0 && slope.is_finite()).then_some(GroundFit { slope, shift: inverse - slope * value, ..*fit })
    }

    /// `fit` with its share and residual, and the fraction of the variance that it explains.
    fn evaluate(&self, fit: &GroundFit) -> (GroundFit, f64) {
        let agreeing: Vec<&Sample> = self.samples.iter().filter(|sample| self.agrees(fit, sample)).collect();
        let count = agreeing.len().max(1) as f64;
        let mean = agreeing.iter().map(|sample| sample.inverse).sum::<f64>() / count;
        let (mut unexplained, mut total, mut relative) = (0.0, 0.0, 0.0);
        for sample in &agreeing {
            let deviation = fit.deviation(sample);
            unexplained += deviation * deviation;
            total += (sample.inverse - mean) * (sample.inverse - mean);
            // Relative deviation of the distance: (1 / fitted - 1 / actual) / (1 / actual). Noise may make the fitted inverse distance negative;
            // that counts as a deviation of 100 %.
            let fitted = sample.inverse + deviation;
            let of_distance: f64 = if fitted > 0.0 { (sample.inverse / fitted - 1.0).clamp(-1.0, 1.0) } else { 1.0 };
            relative += of_distance * of_distance;
        }
        let share = agreeing.len() as f64 / self.below_horizon.max(1) as f64;
        (GroundFit { share, residual: (relative / count).sqrt(), ..*fit }, 1.0 - unexplained / total)
    }
}

/// Tukey's biweight (Beaton & Tukey 1974) of a deviation in units of its cutoff, beyond which a sample has no weight.
fn tukey_biweight(deviation: f64) -> f64 {
    let ratio = deviation.abs().min(1.0);
    (1.0 - ratio * ratio) * (1.0 - ratio * ratio)
}

/// Fits `1 / distance = shift + slope value` to the ground at `height`, where a depth shows it. The depth has `values` in rows of its `size`, and belongs to an
/// image of `image_size` pixels.
pub(super) fn fit(
    values: &[f32],
    size: [usize; 2],
    image_size: [usize; 2],
    view: &PlateView,
    height: f64,
) -> Result<GroundFit, GroundFitError> {
    let samples = GroundSamples::new(values, size, image_size, view, height);
    if samples.below_horizon < MIN_SAMPLES {
        return Err(GroundFitError::NotSeen { height });
    }
    if samples.samples.len() < MIN_SAMPLES {
        return Err(GroundFitError::TooFew { share: 0.0, height });
    }
    let mut fit = samples.consensus().ok_or(GroundFitError::Flat { height })?;
    for _ in 0..REFINEMENT_STEPS {
        let Some(refined) = samples.refined(&fit) else { break };
        fit = refined;
    }
    let (fit, explained) = samples.evaluate(&fit);
    if fit.share < MIN_AGREEING_FRACTION {
        return Err(GroundFitError::TooFew { share: fit.share, height });
    }
    if explained < MIN_EXPLAINED_VARIANCE {
        return Err(GroundFitError::Flat { height });
    }
    Ok(fit)
}

#[cfg(test)]
mod tests {
    use bansho_base::camera::CameraParameters;

    use super::*;

    const SIZE: [usize; 2] = [320, 200];

    fn view() -> PlateView {
        let camera = CameraParameters {
            position: [0.3, 1.6, 5.0].into(),
            target: [0.0, 1.0, 0.0].into(),
            roll_deg: 3.0.into(),
            ..CameraParameters::default()
        };
        PlateView { camera: camera.at(0.0, SIZE), size: SIZE, ground_height: Some(0.0) }
    }

    /// Depth along the axis of a ground with boxes (x from, x to, z of the front, height) before a sky, whose depth is infinite.
    fn scene_depth(view: &PlateView, boxes: &[[f64; 4]], size: [usize; 2]) -> Vec<f64> {
        let camera = &view.camera;
        let mut depths = Vec::new();
        for y in 0..size[1] {
            for x in 0..size[0] {
                let position = [x as f64 + 0.5, y as f64 + 0.5];
                let direction = camera.direction(view.picture_position(position, size)).unwrap();
                let ground = if direction.y < 0.0 { -camera.position.y / direction.y } else { f64::INFINITY };
                let front = boxes.iter().filter_map(|[from, to, z, height]| {
                    let depth = (z - camera.position.z) / direction.z;
                    let point = camera.position + depth * direction;
                    (depth > 0.0 && (*from..*to).contains(&point.x) && (0.0..*height).contains(&point.y))
                        .then_some(depth)
                });
                depths.push(front.fold(ground, f64::min));
            }
        }
        depths
    }

    fn values(depths: &[f64], shift: f64, slope: f64) -> Vec<f32> {
        depths.iter().map(|depth| ((1.0 / depth - shift) / slope) as f32).collect()
    }

    const BOXES: [[f64; 4]; 4] =
        [[-1.5, -0.6, 2.5, 1.2], [0.4, 1.6, 1.0, 2.0], [-0.4, 0.2, 3.4, 0.3], [-9.0, -2.0, -6.0, 4.0]];

    #[test]
    fn scale_and_shift_are_found_among_boxes() {
        let view = view();
        for (shift, slope, size) in [(0.02, 0.001, SIZE), (-0.1, 0.4, [160, 100]), (0.5, 3e-5, [480, 320])] {
            let depths = scene_depth(&view, &BOXES, size);
            let found = fit(&values(&depths, shift, slope), size, size, &view, 0.0).unwrap();
            assert!(
                (found.slope / slope - 1.0).abs() < 0.01 && (found.shift - shift).abs() < 0.01 * shift.abs(),
                "{found:?}"
            );
            // The boxes cover more than a quarter of what is below the horizon.
            assert!((0.4..0.75).contains(&found.share) && found.residual < 0.03, "{found:?}");
            assert!((found.scale().meters_of(((0.25 - shift) / slope) as f32) - 4.0).abs() < 0.02);
        }
    }

    #[test]
    fn noise_and_codes_move_the_result_little() {
        let view = view();
        let depths = scene_depth(&view, &BOXES, SIZE);
        // Codes of 8 bits up to 255, with a noise of 2 codes.
        let exact = values(&depths, 0.01, 0.002);
        let noisy = exact
            .iter()
            .enumerate()
            .map(|(index, value)| (value + 2.0 * ((index * 7919) % 101) as f32 / 50.0 - 2.0).round().max(1.0));
        let found = fit(&noisy.collect::<Vec<f32>>(), SIZE, SIZE, &view, 0.0).unwrap();
        assert!((found.slope / 0.002 - 1.0).abs() < 0.03 && (found.shift - 0.01).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn what_shows_no_ground_is_refused() {
        let view = view();
        let wall = scene_depth(&view, &[[-90.0, 90.0, 3.0, 90.0]], SIZE);
        // A wall over the whole view, but for a strip of ground at its foot.
        let found = fit(&values(&wall, 0.0, 0.01), SIZE, SIZE, &view, 0.0);
        assert!(matches!(found, Err(GroundFitError::TooFew { .. } | GroundFitError::Flat { .. })), "{found:?}");
        let message = GroundFitError::TooFew { share: 0.042, height: 0.5 }.to_string();
        let expected = "from the ground at 0.5 m: only 4.2 % of the pixels below the horizon agree; allowed";
        assert!(message.contains(expected), "{message}");
        // Larger values are farther: it is no inverse depth.
        let depths = scene_depth(&view, &[], SIZE);
        let farther: Vec<f32> = depths.iter().map(|depth| *depth as f32).collect();
        let found = fit(&farther, SIZE, SIZE, &view, 0.0);
        assert!(matches!(found, Err(GroundFitError::TooFew { .. } | GroundFitError::Flat { .. })), "{found:?}");
        assert_eq!(fit(&vec![3.0; 64_000], SIZE, SIZE, &view, 0.0), Err(GroundFitError::Flat { height: 0.0 }));
        assert_eq!(
            fit(&vec![0.0; 64_000], SIZE, SIZE, &view, 0.0),
            Err(GroundFitError::TooFew { share: 0.0, height: 0.0 })
        );
        // The camera is below it.
        assert_eq!(fit(&farther, SIZE, SIZE, &view, 2.0), Err(GroundFitError::NotSeen { height: 2.0 }));
    }

    #[test]
    fn a_plate_covers_the_picture() {
        let view = PlateView { size: [200, 100], ..view() };
        assert_eq!(view.picture_position([150.0, 150.0], [300, 300]), DVec2::new(100.0, 50.0));
        // Its width fits; 75 of its rows are cropped at the top and at the bottom.
        assert_eq!(view.picture_position([0.0, 75.0], [300, 300]), DVec2::new(0.0, 0.0));
    }
}
