//! Field lines over a spherical Earth, seen by an observer.
//!
//! The lines of a uniform field are parallel, so from one position each appears on a meridian of the sky about the
//! magnetic zenith, their vanishing point: the longitude is constant along a line. The whole renderer relies on that.

use bansho_base::math::{self, DVec2, DVec3, MulAdd, approximations};
pub(crate) use bansho_base::world::sky::EARTH_RADIUS_KM;

use crate::physics::atmosphere::LOWEST_KM;
pub(crate) use crate::shapes::FOOT_ALTITUDE_KM;

/// Altitude of the observer from which on it counts, km: below it, scales are those of an observer on the ground.
const ELEVATED_KM: f64 = 20.0;
/// Minimum dip angle, degrees: nearer the magnetic equator there are no auroras and field lines would not reach the
/// ground.
const MIN_DIP_DEG: f64 = 30.0;

/// The magnetic field about an observer. Lengths are km; x east, y up, z south from the point on the ground below the
/// center of the drawn square.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FieldLines {
    /// The observer, relative to the Earth's center.
    observer: DVec3,
    /// Unit vector along the field, away from the ground.
    pub(crate) along: DVec3,
    /// Two unit vectors across it; longitude is the angle from the first to the second.
    pub(crate) across: [DVec3; 2],
}

/// Intersection of a field line with the drawn plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FootPoint {
    /// Position in the plane perpendicular to the field through the observer, km.
    pub(crate) across: [f32; 2],
    /// Cosine of the angle between the field and the vertical there.
    pub(crate) vertical_cosine: f32,
}

impl FieldLines {
    /// The field of that dip and declination for an observer at a position in m.
    pub(crate) fn new(dip_deg: f64, declination_deg: f64, position: DVec3) -> Self {
        let dip = dip_deg.abs().max(MIN_DIP_DEG).to_radians();
        let (sin, cos) = math::sin_cos(dip);
        let (east, north) = math::sin_cos(declination_deg.to_radians());
        // Field lines incline away from the nearer pole: to the south in the northern hemisphere.
        let lean = if dip_deg < 0.0 { cos } else { -cos };
        let along = DVec3::new(lean * east, sin, -lean * north);
        let first = (DVec3::X - along * along.x).normalize();
        let observer = position * 1e-3 + DVec3::Y * EARTH_RADIUS_KM;
        Self { observer, along, across: [first, along.cross(first)] }
    }

    /// The field line through a position of the drawn plane, km east and south, measured along the shell at 100 km.
    #[inline(always)]
    pub(crate) fn foot_point(&self, east: f32, south: f32) -> FootPoint {
        const SHELL: f32 = (EARTH_RADIUS_KM + FOOT_ALTITUDE_KM) as f32;
        const TURNS: f32 = (1.0 / (std::f64::consts::TAU * (EARTH_RADIUS_KM + FOOT_ALTITUDE_KM))) as f32;
        let distance = east.fma(east, south * south).sqrt();
        let turns = distance * TURNS;
        let (sin, cos) = (approximations::sin_turns(turns), approximations::cos_turns(turns));
        let scale = if distance > 0.0 { sin / distance } else { 0.0 };
        let up = [east * scale, cos, south * scale];
        let observer = self.observer.as_vec3().to_array();
        let mut position = [0.0; 3];
        for axis in 0..3 {
            position[axis] = up[axis].fma(SHELL, -observer[axis]);
        }
        let [along, first, second] = self.axes_f32();
        FootPoint { across: [dot(first, position), dot(second, position)], vertical_cosine: dot(along, up).max(0.05) }
    }

    /// The position of the drawn plane, km east and south, that is seen in a direction, if any.
    pub(crate) fn foot_position(&self, direction: DVec3) -> Option<DVec2> {
        const SHELL: f64 = EARTH_RADIUS_KM + FOOT_ALTITUDE_KM;
        let direction = direction.normalize();
        let nearest = -self.observer.dot(direction);
        let squared = nearest * nearest + SHELL * SHELL - self.observer.length_squared();
        let half_chord = math::sqrt(squared.max(0.0));
        // From within the plane's shell a line of sight passes it once; from above, it is seen where the line enters the shell.
        let is_above = self.observer.length_squared() > SHELL * SHELL;
        let along = if is_above { nearest - half_chord } else { nearest + half_chord };
        let position = self.observer + direction * along;
        let level = DVec2::new(position.x, position.z);
        let distance = SHELL * math::atan2(level.length(), position.y);
        (squared >= 0.0 && along >= 0.0).then(|| level.normalize_or_zero() * distance)
    }

    /// The lines through the half-plane of a longitude, given by its cosine and sine.
    pub(crate) fn meridian(&self, [cos, sin]: [f64; 2]) -> Meridian {
        let outward = self.across[0] * cos + self.across[1] * sin;
        Meridian {
            squared: self.observer.length_squared() - EARTH_RADIUS_KM * EARTH_RADIUS_KM,
            outward: self.observer.dot(outward),
            along: self.observer.dot(self.along),
        }
    }

    /// The axes along the field and across it in single precision.
    #[inline(always)]
    pub(crate) fn axes_f32(&self) -> [[f32; 3]; 3] {
        let [first, second] = self.across;
        [self.along.as_vec3().to_array(), first.as_vec3().to_array(), second.as_vec3().to_array()]
    }

    /// Cosine of the colatitude, and the two components across the field, of a direction.
    pub(crate) fn field_frame_components(&self, direction: DVec3) -> [f64; 3] {
        [direction.dot(self.along), direction.dot(self.across[0]), direction.dot(self.across[1])]
    }

    /// Altitude of the observer above the ground, km.
    pub(crate) fn observer_altitude_km(&self) -> f64 {
        self.observer.length() - EARTH_RADIUS_KM
    }

    /// Whether light may be below the observer, in front of the Earth: only from the altitude of the lowest light on.
    pub(crate) fn is_above_light(&self) -> bool {
        self.observer_altitude_km() >= LOWEST_KM
    }

    /// Sine of the elevation of the Earth's horizon.
    pub(crate) fn horizon_sine(&self) -> f64 {
        let altitude_km = self.observer_altitude_km().max(0.0);
        if !self.is_elevated() {
            // The dip is small.
            return -math::sqrt(2.0 * altitude_km / EARTH_RADIUS_KM);
        }
        let cosine = EARTH_RADIUS_KM / (EARTH_RADIUS_KM + altitude_km);
        -math::sqrt(1.0 - cosine * cosine)
    }

    /// Whether the observer is so high that light may be near, or both above and below.
    pub(crate) fn is_elevated(&self) -> bool {
        self.observer_altitude_km() >= ELEVATED_KM
    }

    /// Height difference between the observer and the lower border of light, the sharpest feature, km: at least, and at most, what bins are made
    /// for. `ground` is that difference for an observer on the ground.
    pub(crate) fn border_distances_km(&self, ground: f64) -> [f64; 2] {
        const MIN_KM: f64 = 10.0;
        if !self.is_elevated() {
            return [ground; 2];
        }
        let distance = (ground - self.observer_altitude_km()).abs();
        [distance.clamp(MIN_KM, ground), distance.max(ground)]
    }
}

/// All field lines of one longitude.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meridian {
    squared: f64,
    outward: f64,
    along: f64,
}

/// A field line of a meridian. Coordinates on it are km along the field from the plane through the observer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FieldLine {
    /// Squared distance from the Earth's center at coordinate 0, minus the squared Earth radius.
    excess: f64,
    along: f64,
}

impl Meridian {
    /// The line at a distance in km from the one through the observer.
    pub(crate) fn line(&self, distance: f64) -> FieldLine {
        FieldLine { excess: self.squared + distance * (2.0 * self.outward + distance), along: self.along }
    }

    /// What the Earth hides of its lines.
    pub(crate) fn earth_shadow(&self) -> EarthShadow {
        self.coefficients_f32().into()
    }

    /// In single precision: squared distance of the observer from the Earth's center minus the squared Earth radius,
    /// and its components outward and along the field.
    #[inline(always)]
    pub(crate) fn coefficients_f32(&self) -> [f32; 3] {
        [self.squared, self.outward, self.along].map(|value| value as f32)
    }
}

impl FieldLine {
    /// Coordinate at an altitude; the point of closest approach if the line does not reach it.
    pub(crate) fn position_at_altitude(&self, altitude_km: f64) -> f64 {
        let squared = altitude_km * (2.0 * EARTH_RADIUS_KM + altitude_km);
        math::sqrt((self.along * self.along - self.excess + squared).max(0.0)) - self.along
    }

    /// Coefficients of the squared distance from the Earth's center minus the squared Earth radius, `(c0 + s (c1 +
    /// s))`.
    pub(crate) fn quadratic(&self) -> [f32; 2] {
        [self.excess as f32, (2.0 * self.along) as f32]
    }
}

/// The part of a half-plane of field lines that is behind the Earth for an observer above the light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EarthShadow {
    /// As of [`Meridian`], km.
    squared: f32,
    outward: f32,
    along: f32,
}

impl EarthShadow {
    /// Whether the Earth hides the point at a distance in km from the observer's own field line that is seen at a colatitude with this cotangent.
    ///
    /// With the direction d of the line of sight, the observer O and the point P: the line meets the Earth if O . d < 0 and (O . d)^2 > O^2 - R^2;
    /// what lies beyond its deepest point, P . d > 0, is then hidden. All products are divided by the sine of the colatitude.
    #[inline(always)]
    pub(crate) fn hides(&self, distance: f32, cotangent: f32) -> bool {
        let toward = cotangent.fma(self.along, self.outward);
        let length_squared = cotangent.fma(cotangent, 1.0);
        toward < 0.0 && toward * toward > self.squared * length_squared && distance.fma(length_squared, toward) > 0.0
    }

    /// Whether it hides the point at an altitude on the field line at a distance, km.
    pub(crate) fn hides_altitude(&self, distance: f32, altitude_km: f32) -> bool {
        const DIAMETER: f32 = 2.0 * EARTH_RADIUS_KM as f32;
        let excess = distance.fma(2.0 * self.outward + distance, self.squared);
        let squared = self.along.fma(self.along, altitude_km.fma(DIAMETER + altitude_km, -excess));
        let position = squared.max(0.0).sqrt() - self.along;
        distance > 0.0 && self.hides(distance, position / distance)
    }
}

impl From<[f32; 3]> for EarthShadow {
    /// From [`Meridian::coefficients_f32`].
    fn from([squared, outward, along]: [f32; 3]) -> Self {
        Self { squared, outward, along }
    }
}

/// Scalar product.
#[inline(always)]
pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0].fma(b[0], a[1].fma(b[1], a[2] * b[2]))
}

/// Altitude from the value of [`FieldLine::quadratic`], km; arranged to avoid cancellation.
#[inline(always)]
pub(crate) fn altitude(squared: f32) -> f32 {
    const RADIUS: f32 = EARTH_RADIUS_KM as f32;
    let radius = squared + RADIUS * RADIUS;
    let radius = if radius > 0.0 { radius } else { 0.0 };
    squared / (RADIUS + radius.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_lean_to_the_south_in_the_north() {
        let field = FieldLines::new(77.0, 0.0, DVec3::ZERO);
        assert!(field.along.y > 0.97 && field.along.z > 0.2 && field.along.x.abs() < 1e-12);
        assert!(FieldLines::new(-77.0, 0.0, DVec3::ZERO).along.z < -0.2);
        // Magnetic north 90 degrees east of north: they lean to the west.
        assert!(FieldLines::new(77.0, 90.0, DVec3::ZERO).along.x < -0.2);
        for axis in field.across {
            assert!(axis.dot(field.along).abs() < 1e-12 && (axis.length() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_foot_lies_on_its_line_at_100_km() {
        let field = FieldLines::new(77.0, 5.0, DVec3::new(20.0, 1.7, -300.0));
        for [east, south] in [[0.0, 0.0], [120.0, -80.0], [-600.0, 900.0]] {
            let foot = field.foot_point(east, south);
            let [x, y] = foot.across.map(f64::from);
            let distance = math::hypot(x, y);
            let line = field.meridian([x / distance, y / distance]).line(distance);
            let position = line.position_at_altitude(100.0);
            // The same position, by the sphere.
            let radius = EARTH_RADIUS_KM + 100.0;
            let far = math::hypot(f64::from(east), f64::from(south)).max(1e-9);
            let (sin, cos) = math::sin_cos(far / radius);
            let up = DVec3::new(f64::from(east) / far * sin, cos, f64::from(south) / far * sin);
            let from_lines = field.observer + field.across[0] * x + field.across[1] * y + field.along * position;
            assert!((up * radius - from_lines).length() < 0.02, "{east} {south}");
            assert!((f64::from(foot.vertical_cosine) - up.dot(field.along)).abs() < 1e-6);
            let [constant, linear] = line.quadratic();
            let found = altitude((position as f32).fma(position as f32 + linear, constant));
            assert!((found - 100.0).abs() < 0.01, "{found}");
        }
    }

    #[test]
    fn a_drawn_place_is_seen_where_it_is() {
        let field = FieldLines::new(77.0, 5.0, DVec3::new(20e3, 1.7, -300e3));
        let radius = EARTH_RADIUS_KM + FOOT_ALTITUDE_KM;
        for position in [DVec2::ZERO, DVec2::new(120.0, -80.0), DVec2::new(-300.0, -700.0)] {
            let (sin, cos) = math::sin_cos(position.length() / radius);
            let level = position.normalize_or_zero() * sin;
            let direction = DVec3::new(level.x, cos, level.y) * radius - field.observer;
            assert!((field.foot_position(direction).unwrap() - position).length() < 1e-6);
        }
        // From above the shell and looking away.
        assert_eq!(FieldLines::new(77.0, 0.0, DVec3::Y * 2e5).foot_position(DVec3::X), None);
    }

    #[test]
    fn a_field_line_keeps_its_longitude() {
        let field = FieldLines::new(77.0, 0.0, DVec3::ZERO);
        let foot = field.foot_point(80.0, -150.0).across.map(f64::from);
        let longitude = math::atan2(foot[1], foot[0]);
        for position in [90.0, 150.0, 400.0] {
            let seen = field.across[0] * foot[0] + field.across[1] * foot[1] + field.along * position;
            let [_, x, y] = field.field_frame_components(seen.normalize());
            assert!((math::atan2(y, x) - longitude).abs() < 1e-9);
        }
    }
}
