use super::*;

/// A right triangle of 3 positions and 3 indices of 16 bits, in `bytes()`.
fn document(buffer: &str, count: usize, extra: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"mesh":0,"translation":[0,5,0],"scale":[2,2,2]{extra}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
                     {{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],
        "buffers":[{{"byteLength":42{buffer}}}]}}"#
    )
}

fn bytes() -> Vec<u8> {
    let positions = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let indices = [0_u16, 1, 2];
    let positions = positions.iter().flat_map(|value| value.to_le_bytes());
    positions.chain(indices.iter().flat_map(|value| value.to_le_bytes())).collect()
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let padded = format!("{json:<width$}", width = json.len().next_multiple_of(4));
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend(((20 + padded.len() + 8 + binary.len()) as u32).to_le_bytes());
    file.extend((padded.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    file.extend(padded.as_bytes());
    file.extend((binary.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(binary);
    file
}

fn nothing_beside(_: &str) -> Result<Vec<u8>, AssetProblem> {
    Err(AssetProblem::Missing)
}

fn reason(file: &[u8], extension: &str) -> String {
    decode_mesh(file, extension, &nothing_beside).unwrap_err().to_string()
}

#[test]
fn triangles_stand_where_their_node_does() {
    let mesh = decode_mesh(&glb(&document("", 3, ""), &bytes()), "glb", &nothing_beside).unwrap();
    let triangles: Vec<_> = mesh.triangles().collect();
    let corner = DVec3::new;
    assert_eq!(triangles, [[corner(0.0, 5.0, 0.0), corner(2.0, 5.0, 0.0), corner(0.0, 7.0, 0.0)]]);
}

#[test]
fn buffers_may_lie_beside_or_inside_the_text() {
    let beside = document(r#","uri":"flame.bin""#, 3, "");
    let found = decode_mesh(beside.as_bytes(), "gltf", &|name| {
        assert_eq!(name, "flame.bin");
        Ok(bytes())
    });
    assert_eq!(found.unwrap().len(), 1);
    assert_eq!(reason(beside.as_bytes(), "gltf"), "no such file");
    let text = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA";
    let inside = document(&format!(r#","uri":"data:application/octet-stream;base64,{text}""#), 3, "");
    assert_eq!(decode_mesh(inside.as_bytes(), "gltf", &nothing_beside).unwrap().len(), 1);
}

#[test]
fn strips_and_fans_make_triangles_that_face_the_same_way() {
    assert_eq!(triangles(Mode::TriangleStrip, &[0, 1, 2, 3]), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(triangles(Mode::TriangleFan, &[0, 1, 2, 3]), [[0, 1, 2], [0, 2, 3]]);
    assert!(triangles(Mode::LineStrip, &[0, 1, 2]).is_empty());
}

#[test]
fn hostile_files_are_refused_with_a_reason() {
    let good = glb(&document("", 3, ""), &bytes());
    for end in 0..good.len() {
        assert!(decode_mesh(&good[..end], "glb", &nothing_beside).is_err(), "{end} bytes of it");
    }
    assert!(reason(&glb(&document("", 4_000_000_000, ""), &bytes()), "glb").contains("beyond its buffer"));
    assert!(reason(&glb(&document("", 3, r#","children":[0]"#), &bytes()), "glb").contains("contain each other"));
    assert!(reason(&glb(&document("", 0, ""), &bytes()), "glb").contains("corner"));
    let lines = document("", 3, "").replace(r#""indices":1"#, r#""indices":1,"mode":1"#);
    assert_eq!(reason(&glb(&lines, &bytes()), "glb"), "holds no usable mesh: it has no triangles with an area");
    assert!(reason(b"{", "gltf").starts_with("is damaged"));
    assert!(reason(b"", "obj").contains("allowed: .glb, .gltf"));
}

#[test]
fn every_single_damaged_byte_is_survived() {
    let good = glb(&document("", 3, ""), &bytes());
    for place in 0..good.len() {
        for value in [0, b'9', b'"', 0xff] {
            let mut bad = good.clone();
            bad[place] = value;
            // Whatever it makes of it, it must come back.
            drop(decode_mesh(&bad, "glb", &nothing_beside));
        }
    }
}
