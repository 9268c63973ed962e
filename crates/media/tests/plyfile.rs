//! An independent reader reads exported particles.

use std::{path::PathBuf, process::Command};

use bansho_base::geometry::point_cloud::{PointCloud, Quantity};
use bansho_media::{
    files::{atomic, overwrite_policy::OverwritePolicy},
    ply,
};

#[test]
#[ignore = "needs python3 with the package plyfile"]
fn plyfile_reads_every_particle() {
    let points = PointCloud {
        origin: [0.0; 3],
        positions: vec![[1.5, -2.0, 3.0e-5], [4.0, 5.0, 6.0], [0.1, 0.2, 0.3]],
        velocities: vec![[0.0, 1.0, 0.0], [-7.0, 8.0, 9.5], [0.0; 3]],
        quantities: [(Quantity::Temperature, vec![1850.0, 293.15, 900.0]), (Quantity::Density, vec![0.19, 1.2, 0.4])]
            .into(),
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gas.ply");
    atomic::write_bytes(&path, &ply::encode(&points), &OverwritePolicy::default()).unwrap();
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/python/ply_reads.py");
    let output = Command::new("python3").arg(script).arg(&path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("x y z vx vy vz temperature density"));
    for (index, line) in lines.enumerate() {
        let values: Vec<f32> = line.split(' ').map(|value| value.parse().unwrap()).collect();
        let scalars: Vec<f32> = points.quantities.values().map(|values| values[index]).collect();
        let expected = [&points.positions[index][..], &points.velocities[index], &scalars].concat();
        assert_eq!(values, expected);
    }
    assert_eq!(text.lines().count(), 4);
}
