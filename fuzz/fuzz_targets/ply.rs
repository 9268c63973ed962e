//! Particles as PLY: what is written of any particles is read back, value for value, by a reader that knows nothing of the writer.
#![no_main]

use std::collections::BTreeMap;

use bansho_base::geometry::point_cloud::{PointCloud, Quantity};
use bansho_media::ply;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let points = points(bytes);
    let file = ply::encode(&points);
    assert_eq!(file, ply::encode(&points), "the same particles give the same bytes");
    let columns = read(&file).expect("a file that a reader of PLY understands");
    let expected = 6 + points.quantities.len();
    assert_eq!(columns.len(), expected);
    for axis in 0..3 {
        same(&columns, ["x", "y", "z"][axis], points.positions.iter().map(|place| place[axis]));
        same(&columns, ["vx", "vy", "vz"][axis], points.velocities.iter().map(|velocity| velocity[axis]));
    }
    for (quantity, values) in &points.quantities {
        same(&columns, quantity.name(), values.iter().copied());
    }
});

/// Particles of any bytes: the first says which quantities are known, each four of the others are a number.
fn points(bytes: &[u8]) -> PointCloud {
    let (kinds, bytes) = bytes.split_first().map_or((0, bytes), |(kinds, rest)| (*kinds, rest));
    let known: Vec<Quantity> =
        Quantity::ALL.into_iter().enumerate().filter(|(index, _)| kinds >> index & 1 == 1).map(|(_, q)| q).collect();
    let numbers: Vec<f32> = bytes.as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
    let mut points = PointCloud::default();
    for row in numbers.chunks_exact(6 + known.len()) {
        points.positions.push([row[0], row[1], row[2]]);
        points.velocities.push([row[3], row[4], row[5]]);
        for (slot, quantity) in known.iter().enumerate() {
            points.quantities.entry(*quantity).or_default().push(row[6 + slot]);
        }
    }
    points
}

/// The columns of a binary PLY of floats, by name. Nothing may follow the last.
fn read(file: &[u8]) -> Option<BTreeMap<String, Vec<f32>>> {
    let end = b"end_header\n";
    let at = file.windows(end.len()).position(|window| window == end)?;
    let (mut count, mut names) = (None, Vec::new());
    let mut lines = std::str::from_utf8(&file[..at]).ok()?.lines();
    (lines.next()? == "ply" && lines.next()? == "format binary_little_endian 1.0").then_some(())?;
    for line in lines {
        match line.split_whitespace().collect::<Vec<_>>()[..] {
            ["comment", ..] => {}
            ["element", "vertex", number] => count = Some(number.parse::<usize>().ok()?),
            ["property", "float", name] => names.push(name.to_owned()),
            _ => return None,
        }
    }
    let (values, []) = file[at + end.len()..].as_chunks::<4>() else { return None };
    (values.len() == count? * names.len()).then_some(())?;
    let column = |index: usize| values.iter().skip(index).step_by(names.len()).map(|four| f32::from_le_bytes(*four));
    Some(names.iter().enumerate().map(|(index, name)| (name.clone(), column(index).collect())).collect())
}

fn same(columns: &BTreeMap<String, Vec<f32>>, name: &str, expected: impl Iterator<Item = f32>) {
    let bits = |value: f32| value.to_bits();
    assert!(columns[name].iter().copied().map(bits).eq(expected.map(bits)), "{name}");
}
