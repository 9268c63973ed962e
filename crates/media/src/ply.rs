//! Particles as binary little-endian PLY (Turk 1994), which Blender, MeshLab and Open3D read.

use bansho_base::geometry::point_cloud::PointCloud;

/// The properties of every particle, in order: position in m, velocity in m/s.
const PROPERTIES: [&str; 6] = ["x", "y", "z", "vx", "vy", "vz"];

/// The bytes of a file: positions, velocities, then the quantities of the cloud. The same particles give the same bytes.
///
/// Positions are relative to the cloud's origin, which a line `comment origin X Y Z` (m) states unless it is that of the world.
///
/// ```
/// let file = bansho_media::ply::encode(&bansho_base::geometry::point_cloud::PointCloud::default());
/// assert!(file.starts_with(b"ply\nformat binary_little_endian 1.0\n") && file.ends_with(b"end_header\n"));
/// ```
#[must_use]
pub fn encode(points: &PointCloud) -> Vec<u8> {
    let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
    header.push_str("comment Bansho: x y z in m, y up; vx vy vz in m/s");
    for quantity in points.quantities.keys() {
        header.push_str(&format!("; {} in {}", quantity.name(), quantity.unit()));
    }
    if points.origin != [0.0; 3] {
        let [x, y, z] = points.origin;
        header.push_str(&format!("\ncomment origin {x} {y} {z}"));
    }
    header.push_str(&format!("\nelement vertex {}\n", points.len()));
    for name in PROPERTIES.into_iter().chain(points.quantities.keys().map(|quantity| quantity.name())) {
        header.push_str(&format!("property float {name}\n"));
    }
    header.push_str("end_header\n");
    let mut bytes = header.into_bytes();
    bytes.reserve(points.len() * (PROPERTIES.len() + points.quantities.len()) * size_of::<f32>());
    for (index, (position, velocity)) in points.positions.iter().zip(&points.velocities).enumerate() {
        // A quantity that is not known of all particles is 0 for the rest.
        let scalars = points.quantities.values().map(|values| values.get(index).unwrap_or(&0.0));
        bytes.extend(position.iter().chain(velocity).chain(scalars).flat_map(|value| value.to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use bansho_base::geometry::point_cloud::Quantity;

    use super::*;

    #[test]
    fn the_header_says_what_follows_and_every_value_stands_at_its_place() {
        let points = PointCloud {
            origin: [0.0; 3],
            positions: vec![[1.0, 2.0, 3.0], [-1.0, 0.5, 0.25]],
            velocities: vec![[0.0, 4.0, 0.0], [7.0, 8.0, 9.0]],
            quantities: [(Quantity::Temperature, vec![1500.0, 300.0]), (Quantity::Density, vec![0.25, 1.2])].into(),
        };
        let bytes = encode(&points);
        let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
        let header = std::str::from_utf8(&bytes[..end]).unwrap();
        assert!(
            header.contains("in m/s; temperature in K; density in kg/m^3\nelement vertex 2\n")
                && header.contains("property float vz\nproperty float temperature\n")
        );
        let values: Vec<f32> = bytes[end..].as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
        let expected = [
            1.0, 2.0, 3.0, 0.0, 4.0, 0.0, 1500.0, 0.25, //
            -1.0, 0.5, 0.25, 7.0, 8.0, 9.0, 300.0, 1.2,
        ];
        assert_eq!(values, expected);
        let far = encode(&PointCloud { origin: [500_000.0, 0.0, -401_000.0], ..points });
        let far_header = header.replace("\nelement", "\ncomment origin 500000 0 -401000\nelement");
        assert_eq!(far[..far_header.len()], *far_header.as_bytes());
        assert_eq!(far[far_header.len()..], bytes[end..], "values are relative to the origin");
    }
}
