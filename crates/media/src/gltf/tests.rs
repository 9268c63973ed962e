use super::*;

const LIMIT: MemoryLimit = MemoryLimit { total: 2 << 30, used: 0 };

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
    let padded = json.to_owned() + &" ".repeat(json.len().next_multiple_of(4) - json.len());
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

fn no_resources(_: &str, _: u64) -> Result<Vec<u8>, AssetProblem> {
    Err(AssetProblem::Missing)
}

fn reason(file: &[u8], extension: &str) -> String {
    decode_mesh(file, extension, &no_resources, LIMIT).unwrap_err().to_string()
}

#[test]
fn triangles_stand_where_their_node_does() {
    let mesh = decode_mesh(&glb(&document("", 3, ""), &bytes()), "glb", &no_resources, LIMIT).unwrap();
    let triangles: Vec<_> = mesh.triangles().collect();
    let corner = DVec3::new;
    assert_eq!(triangles, [[corner(0.0, 5.0, 0.0), corner(2.0, 5.0, 0.0), corner(0.0, 7.0, 0.0)]]);
}

#[test]
fn buffers_may_lie_beside_or_inside_the_text() {
    let read_resource = document(r#","uri":"flame.bin""#, 3, "");
    let found = decode_mesh(
        read_resource.as_bytes(),
        "gltf",
        &|name, _| {
            assert_eq!(name, "flame.bin");
            Ok(bytes())
        },
        LIMIT,
    );
    assert_eq!(found.unwrap().len(), 1);
    assert_eq!(reason(read_resource.as_bytes(), "gltf"), "no such file");
    let text = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA";
    let inside = document(&format!(r#","uri":"data:application/octet-stream;base64,{text}""#), 3, "");
    assert_eq!(decode_mesh(inside.as_bytes(), "gltf", &no_resources, LIMIT).unwrap().len(), 1);
}

#[test]
fn strips_and_fans_make_triangles_that_face_the_same_way() {
    assert_eq!(triangles(PrimitiveMode::Strip, &[0, 1, 2, 3]), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(triangles(PrimitiveMode::Fan, &[0, 1, 2, 3]), [[0, 1, 2], [0, 2, 3]]);
    for mode in [PrimitiveMode::Triangles, PrimitiveMode::Strip, PrimitiveMode::Fan] {
        let counts = (0..9).map(|corners| triangles(mode, &vec![0; corners]).len());
        assert!(counts.eq((0..9).map(|corners| mode.triangles(corners))), "{mode:?}");
    }
}

#[test]
fn hostile_files_are_refused_with_a_reason() {
    let good = glb(&document("", 3, ""), &bytes());
    for end in 0..good.len() {
        assert!(decode_mesh(&good[..end], "glb", &no_resources, LIMIT).is_err(), "{end} bytes of it");
    }
    let shorter = reason(&good[..good.len() - 1], "glb");
    assert!(
        shorter.ends_with(&format!("it is truncated: it has {} of its {} bytes", good.len() - 1, good.len())),
        "{shorter}"
    );
    assert!(
        reason(&glb(&document("", 4_000_000_000, ""), &bytes()), "glb")
            .contains("accessors[0].count reaches beyond its buffer")
    );
    assert!(
        reason(&glb(&document("", 0, ""), &bytes()), "glb")
            .contains("triangle 1 refers to vertex 1, but the mesh has only 0")
    );
    let lines = document("", 3, "").replace(r#""indices":1"#, r#""indices":1,"mode":1"#);
    assert_eq!(reason(&glb(&lines, &bytes()), "glb"), "contains no usable mesh: it has no triangles with nonzero area");
    assert!(reason(b"{", "gltf").starts_with("is damaged"));
    assert!(reason(b"", "obj").contains("allowed: .glb, .gltf"));
}

/// The document with `from` replaced by `to`, which must be in it.
fn changed(from: &str, to: &str) -> Vec<u8> {
    let document = document("", 3, "");
    assert!(document.contains(from), "{from}");
    glb(&document.replace(from, to), &bytes())
}

#[test]
fn a_fault_says_where_it_is_and_what_is_allowed() {
    let errors = [
        (r#""version":"2.0""#, r#""version":"1.0""#, r#"asset.version is "1.0"; allowed: "2.0""#),
        (r#""scene":0"#, r#""scene":3"#, "scene is 3; allowed: 0 to 0"),
        (r#""mesh":0"#, r#""mesh":-1"#, "nodes[0].mesh is invalid; allowed: a whole number from 0 on"),
        (r#""scale":[2,2,2]"#, r#""scale":[2,2]"#, "nodes[0].scale is invalid; allowed: 3 numbers"),
        (r#""POSITION":0"#, r#""POSITION":2"#, "meshes[0].primitives[0].attributes.POSITION is 2; allowed: 0 to 1"),
        (r#""indices":1"#, r#""indices":0"#, "accessors[0].type is not that of indices; allowed: SCALAR of"),
        (r#""indices":1"#, r#""indices":1,"mode":7"#, "meshes[0].primitives[0].mode is 7; allowed: 0 to 6"),
        (r#""type":"VEC3""#, r#""type":"VEC2""#, "accessors[0].type is not that of positions; allowed: VEC3 of"),
        (r#""bufferView":0,"#, "", "accessors[0].bufferView is missing, perhaps because the mesh is compressed"),
        (
            r#""count":3,"type":"SCALAR""#,
            r#""count":3,"type":"SCALAR","sparse":{}"#,
            "accessors[1].sparse.indices is missing; allowed: an object",
        ),
        (
            r#""byteOffset":36,"byteLength":6"#,
            r#""byteOffset":37,"byteLength":6"#,
            "bufferViews[1].byteLength reaches beyond",
        ),
        (r#""byteLength":42"#, r#""byteLength":43"#, "buffers[0].byteLength is 43, but the buffer has 42 bytes"),
        (
            r#""buffers":[{"#,
            r#""extensionsRequired":["X"],"buffers":[{"#,
            r#"extensionsRequired requires "X"; allowed: extensions of materials"#,
        ),
        (r#""buffers":[{"#, r#""buffers":[7,{"#, "buffers[0] is invalid; allowed: an object"),
    ];
    for (from, to, message) in errors {
        let found = reason(&changed(from, to), "glb");
        assert!(found.contains(message), "{to}: {found}");
    }
    let mut named_beyond = bytes();
    named_beyond[40] = 3;
    assert!(
        reason(&glb(&document("", 3, ""), &named_beyond), "glb")
            .contains("triangle 1 refers to vertex 4, but the mesh has only 3")
    );
}

#[test]
fn nodes_make_trees() {
    let three = |nodes: &str, scene: &str| {
        let json = document("", 3, "").replace(r#""translation":[0,5,0],"scale":[2,2,2]}"#, nodes);
        reason(&glb(&json.replace(r#""nodes":[0]"#, scene), &bytes()), "glb")
    };
    let scene = r#""nodes":[0]"#;
    assert!(three(r#""children":[0]}"#, scene).contains("contain each other"));
    assert!(three(r#""children":[1]},{"children":[2]},{"children":[0]}"#, scene).contains("contain each other"));
    assert!(
        three(r#""children":[1]},{"children":[2]},{"children":[1]}"#, scene)
            .contains("node 1 is a child of node 0 and again of node 2")
    );
    assert!(
        three(r#""children":[1]},{"mesh":0}"#, r#""nodes":[0,1]"#)
            .contains("scenes[0].nodes contains 1, which is a child of node 0")
    );
    assert!(three(r#""children":[1]},{"mesh":0}"#, r#""nodes":[0,0]"#).contains("scenes[0].nodes contains 0 twice"));
    let often = format!(r#""children":[{}1]}},{{"mesh":0}}"#, "1,".repeat(2999));
    assert!(three(&often, scene).contains("node 1 is a child of node 0 and again of node 0; allowed: one parent"));
    // Without a scene every node is shown once, where its parents put it.
    let family = changed(r#""scene":0,"scenes":[{"nodes":[0]}],"#, "");
    let family = String::from_utf8_lossy(&family[20..]).replace(r#""scale":[2,2,2]}"#, r#""children":[1]},{"mesh":0}"#);
    let json = &family[..family.rfind('}').unwrap() + 1];
    let mesh = decode_mesh(&glb(json, &bytes()), "glb", &no_resources, LIMIT).unwrap();
    assert!(mesh.len() == 2 && mesh.bounds() == [DVec3::new(0.0, 5.0, 0.0), DVec3::new(1.0, 6.0, 0.0)]);
}

#[test]
fn a_turned_and_nested_mesh_stands_where_the_format_says() {
    let turned = r#""rotation":[0,0,0.7071067811865476,0.7071067811865476],"translation":[1,0,0],"children":[1]},
        {"mesh":0,"matrix":[3,0,0,0, 0,3,0,0, 0,0,3,0, 0,2,0,1]}"#;
    let json = document("", 3, "").replace(r#""mesh":0,"translation":[0,5,0],"scale":[2,2,2]}"#, turned);
    let mesh = decode_mesh(&glb(&json, &bytes()), "glb", &no_resources, LIMIT).unwrap();
    let corners = mesh.triangles().next().unwrap();
    for (found, wanted) in corners.iter().zip([[-1.0, 0.0, 0.0], [-1.0, 3.0, 0.0], [-4.0, 0.0, 0.0]]) {
        assert!((*found - DVec3::from(wanted)).length() < 1e-6, "{corners:?}");
    }
}

#[test]
fn what_is_shown_too_often_is_refused_before_it_is_read() {
    let positions = 1_000_000;
    let mut binary = vec![0; 12 * positions];
    binary.extend([0, 0, 1, 0, 2, 0]);
    let nodes = r#"{"mesh":0},"#.repeat(1999);
    let scene: Vec<String> = (0..2000).map(|node| node.to_string()).collect();
    let json = document("", positions, "")
        .replace(r#""byteLength":36"#, &format!(r#""byteLength":{}"#, 12 * positions))
        .replace(r#""byteOffset":36"#, &format!(r#""byteOffset":{}"#, 12 * positions))
        .replace(r#""byteLength":42"#, &format!(r#""byteLength":{}"#, 12 * positions + 6))
        .replace(r#""nodes":[{"#, &format!(r#""nodes":[{nodes}{{"#))
        .replace(r#""nodes":[0]"#, &format!(r#""nodes":[{}]"#, scene.join(",")));
    let message = reason(&glb(&json, &binary), "glb");
    assert!(message.ends_with("it has 2000000000 vertices; at most 12000000 are read"), "{message}");
    let unindexed = json.replace(r#","indices":1"#, "");
    let message = reason(&glb(&unindexed, &binary), "glb");
    assert!(message.ends_with("it has 666666000 triangles; at most 4000000 are read"), "{message}");
}

#[test]
fn lists_without_end_are_refused() {
    let many = format!("[{}0]", "0,".repeat(2_000_000));
    assert!(
        reason(&changed(r#""scene":0"#, &format!(r#""more":{many},"scene":0"#)), "glb")
            .contains("values; allowed: up to 2000000")
    );
    let nodes = format!(r#""nodes":[{}{{"#, "{},".repeat(100_000));
    assert!(
        reason(&changed(r#""nodes":[{"#, &nodes), "glb").contains("nodes has 100001 elements; allowed: up to 100000")
    );
    assert!(reason("[".repeat(100_000).as_bytes(), "gltf").starts_with("is damaged"));
}

#[test]
fn a_file_that_many_buffers_name_is_read_once() {
    let read_resource = document(r#","uri":"flame.bin""#, 3, "");
    let many = format!(r#""buffers":[{}{{"#, r#"{"byteLength":12000000,"uri":"flame.bin"},"#.repeat(2000));
    let json = read_resource.replace(r#""buffers":[{"#, &many);
    let times = std::cell::Cell::new(0);
    let flame = |_: &str, _: u64| {
        times.set(times.get() + 1);
        let mut file = bytes();
        file.resize(12_000_000, 0);
        Ok(file)
    };
    assert_eq!(decode_mesh(json.as_bytes(), "gltf", &flame, LIMIT).unwrap().len(), 1);
    assert_eq!(times.get(), 1);
}

#[test]
fn what_would_take_too_much_memory_is_refused_before_it_is_read() {
    let read_resource = document(r#","uri":"flame.bin""#, 3, "");
    let decode = |total, beside_bytes: ReadResource| {
        decode_mesh(read_resource.as_bytes(), "gltf", beside_bytes, MemoryLimit { total, used: 1000 })
    };
    let given = |_: &str, _: u64| Ok(bytes());
    let fits = (0..100_000).find(|&total| decode(total, &given).is_ok()).unwrap();
    assert!((10_000..50_000).contains(&fits), "{fits}");
    // `read_resource` gets the number of remaining bytes as its limit.
    let asked = std::cell::Cell::new(None);
    let refused = |_: &str, left: u64| {
        asked.set(Some(left));
        Err(AssetProblem::FileSize { bytes: left + 1, limit: left })
    };
    assert!(matches!(decode(fits, &refused), Err(AssetProblem::FileSize { .. })));
    assert!(asked.get().is_some_and(|left| (42..1000).contains(&left)), "{asked:?}");
    let message = decode(fits - 1, &given).unwrap_err();
    assert!(matches!(message, AssetProblem::Memory { others, .. } if others > 1000), "{message}");
    // Text that would be costly to parse is not parsed.
    let many = format!("[{}0]", "{},".repeat(1_000_000));
    let message = decode_mesh(many.as_bytes(), "gltf", &given, MemoryLimit { total: 100 << 20, used: 0 }).unwrap_err();
    assert_eq!(
        message,
        AssetProblem::Memory { bytes: 2 * many.len() as u64 + 400 * 2_000_000, limit: 100 << 20, others: 0 }
    );
}

#[test]
fn every_single_damaged_byte_is_survived() {
    let good = glb(&document("", 3, ""), &bytes());
    for index in 0..good.len() {
        for value in [0, b'9', b'"', 0xff] {
            let mut bad = good.clone();
            bad[index] = value;
            // Any result will do, as long as it returns.
            drop(decode_mesh(&bad, "glb", &no_resources, LIMIT));
        }
    }
}

#[test]
fn extensions_of_materials_never_refuse_a_mesh_and_compression_is_named_first() {
    let requires =
        |names: &str| changed(r#""buffers":[{"#, &format!(r#""extensionsRequired":[{names}],"buffers":[{{"#));
    let plain = requires(r#""KHR_materials_clearcoat","KHR_texture_basisu","EXT_texture_webp","KHR_lights_punctual""#);
    assert_eq!(decode_mesh(&plain, "glb", &no_resources, LIMIT).unwrap().len(), 1);
    for (name, words) in [
        ("KHR_draco_mesh_compression", "compressed by Draco; export it without"),
        ("EXT_meshopt_compression", "compressed by meshopt; export"),
        ("KHR_mesh_quantization", "quantized to integers; export"),
    ] {
        let told = reason(&requires(&format!(r#""X","{name}""#)), "glb");
        assert!(told.contains(words) && told.contains(name), "{told}");
    }
}

#[test]
fn attributes_of_an_application_and_morph_weights_are_read_as_the_format_says() {
    let own = document("", 3, "").replace(r#""POSITION":0"#, r#""POSITION":0,"_HEAT":0"#);
    assert_eq!(decode_mesh(&glb(&own, &bytes()), "glb", &no_resources, LIMIT).unwrap().len(), 1);
    // The displacements are the positions themselves: weight 0.5 scales by 1.5. The node's weights come before the mesh's.
    let morphed = own.replace(r#""indices":1}]"#, r#""indices":1,"targets":[{"POSITION":0},{}]}],"weights":[0.5,1]"#);
    let top = |json: &str| decode_mesh(&glb(json, &bytes()), "glb", &no_resources, LIMIT).unwrap().bounds()[1];
    assert_eq!(top(&own), DVec3::new(2.0, 7.0, 0.0));
    assert_eq!(top(&morphed), DVec3::new(3.0, 8.0, 0.0));
    assert_eq!(top(&morphed.replace(r#""mesh":0,"#, r#""mesh":0,"weights":[1,0],"#)), DVec3::new(4.0, 9.0, 0.0));
}

#[test]
fn a_skin_in_its_rest_pose_moves_its_vertices_and_its_node_does_not() {
    // Two joints: the first moves by (0, 0, 1) from its bind pose, the second turns by 180 degrees about z. The vertex at (1, 0, 0) belongs to the second,
    // that at (0, 1, 0) half to each, the one at 0 to the first.
    let json = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0,1,2]}],
        "nodes":[{"mesh":0,"skin":0,"translation":[9,9,9]},{"translation":[0,0,3]},{"rotation":[0,0,1,0]}],
        "skins":[{"joints":[1,2],"inverseBindMatrices":3}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5121,"count":3,"type":"VEC4"},
                     {"bufferView":2,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"},
                     {"bufferView":3,"componentType":5126,"count":2,"type":"MAT4"}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12},
                       {"buffer":0,"byteOffset":48,"byteLength":12},{"buffer":0,"byteOffset":60,"byteLength":128}],
        "buffers":[{"byteLength":188}]}"#;
    let mut binary = bytes()[..36].to_vec();
    binary.extend([[0, 1, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]].as_flattened());
    binary.extend([[255, 0, 0, 0], [255, 0, 0, 0], [85, 85, 0, 0]].as_flattened());
    for depth in [-2.0_f32, 0.0] {
        let identity: [[f32; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
        let mut matrix = identity;
        matrix[3][2] = depth;
        binary.extend(matrix.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    }
    let mesh = decode_mesh(&glb(json, &binary), "glb", &no_resources, LIMIT).unwrap();
    let corners: Vec<DVec3> = mesh.triangles().flatten().collect();
    let expected = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.5]];
    for (found, wanted) in corners.iter().zip(expected) {
        assert!((*found - DVec3::from(wanted)).length() < 1e-6, "{corners:?}");
    }
    // A joint that the skin does not have matters where it has a weight.
    let with_joints = |at: usize, joint: u8| {
        let mut changed = binary.clone();
        changed[36 + at] = joint;
        glb(json, &changed)
    };
    assert!(decode_mesh(&with_joints(3, 9), "glb", &no_resources, LIMIT).is_ok());
    assert!(reason(&with_joints(4, 9), "glb").contains("vertex 1 follows joint 9 of a skin of 2 joints"));
    for (at, value) in [(60, f32::NAN), (60 + 64 + 4 * 13, f32::INFINITY)] {
        let mut changed = binary.clone();
        changed[at..at + 4].copy_from_slice(&value.to_le_bytes());
        let told = reason(&glb(json, &changed), "glb");
        assert!(told.contains("skins[0].inverseBindMatrices has a number that is not finite in matrix"), "{told}");
    }
    // The same weights as floats.
    let floats = json
        .replace(r#"{"bufferView":2,"componentType":5121,"normalized":true"#, r#"{"bufferView":4,"componentType":5126"#)
        .replace(
            r#"{"buffer":0,"byteOffset":60,"byteLength":128}"#,
            r#"{"buffer":0,"byteOffset":60,"byteLength":128},{"buffer":0,"byteOffset":188,"byteLength":48}"#,
        )
        .replace(r#""byteLength":188}]}"#, r#""byteLength":236}]}"#);
    for (weight, is_read) in [(0.5, true), (f32::NAN, false), (f32::INFINITY, false)] {
        let mut weighted = binary.clone();
        for own in [[1.0, 0.0, 0.0, 0.0], [weight, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]] {
            weighted.extend(own.iter().flat_map(|value: &f32| value.to_le_bytes()));
        }
        match decode_mesh(&glb(&floats, &weighted), "glb", &no_resources, LIMIT) {
            Ok(_) => assert!(is_read, "{weight}"),
            Err(error) => assert!(
                !is_read && error.to_string().contains("WEIGHTS_0 has a weight that is not finite at vertex 1"),
                "{weight}: {error}"
            ),
        }
    }
}

/// The triangle of [`document`] as a part of a square of 5 vertices, whose accessors have these `positions` and `displacements`. Three bytes of
/// indices and three vectors are behind the indices.
fn sparse_document(positions: &str, displacements: &str) -> Vec<u8> {
    let json = document("", 3, "")
        .replace(r#""indices":1}]"#, r#""indices":1,"targets":[{"POSITION":2}]}],"weights":[1]"#)
        .replace(r#"{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}"#, positions)
        .replace(r#""type":"SCALAR"}]"#, &format!(r#""type":"SCALAR"}},{displacements}]"#))
        .replace(
            r#""byteLength":6}"#,
            r#""byteLength":6},{"buffer":0,"byteOffset":42,"byteLength":4},{"buffer":0,"byteOffset":46,"byteLength":36}"#,
        )
        .replace(r#""byteLength":42"#, r#""byteLength":82"#);
    let mut binary = bytes();
    binary.extend([0, 1, 2, 7]);
    let vectors = [5.0_f32, 0.0, 0.0, 0.0, 6.0, 0.0, 0.0, 0.0, 7.0];
    binary.extend(vectors.iter().flat_map(|value| value.to_le_bytes()));
    glb(&json, &binary)
}

/// An accessor of three vectors with these keys before and within `sparse`.
fn sparse_vectors(keys: &str, count: usize, offset: usize) -> String {
    format!(
        r#"{{{keys}"componentType":5126,"count":3,"type":"VEC3","sparse":{{"count":{count},
        "indices":{{"bufferView":2,"byteOffset":{offset},"componentType":5121}},"values":{{"bufferView":3}}}}}}"#
    )
}

const ZERO_VECTORS: &str = r#"{"componentType":5126,"count":3,"type":"VEC3"}"#;

#[test]
fn sparse_elements_replace_others() {
    let corners = |positions: &str, displacements: &str| -> Vec<[f64; 3]> {
        let mesh = decode_mesh(&sparse_document(positions, displacements), "glb", &no_resources, LIMIT).unwrap();
        // The node doubles, and moves by (0, 5, 0).
        mesh.triangles().flatten().map(|corner| ((corner - DVec3::new(0.0, 5.0, 0.0)) / 2.0).to_array()).collect()
    };
    let dense = sparse_vectors(r#""bufferView":0,"#, 0, 0);
    assert_eq!(corners(&dense, ZERO_VECTORS), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    // Vertices 1 and 2 of the base.
    let replaced = sparse_vectors(r#""bufferView":0,"#, 2, 1);
    assert_eq!(corners(&replaced, ZERO_VECTORS), [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 6.0, 0.0]]);
    // All vertices of zeros.
    let alone = sparse_vectors("", 3, 0);
    assert_eq!(corners(&alone, ZERO_VECTORS), [[5.0, 0.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 7.0]]);
    // A target that moves vertices 1 and 2.
    let moved = sparse_vectors("", 2, 1);
    assert_eq!(corners(&dense, &moved), [[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [0.0, 7.0, 0.0]]);
}

#[test]
fn faults_of_sparse_elements_are_located() {
    let told = |positions: &str| reason(&sparse_document(positions, ZERO_VECTORS), "glb");
    let good = sparse_vectors(r#""bufferView":0,"#, 2, 1);
    for (from, to, message) in [
        (
            r#""byteOffset":1"#,
            r#""byteOffset":2"#,
            "accessors[0].sparse.indices.bufferView contain 7 at position 1; the accessor has 3",
        ),
        (
            r#""sparse":{"count":2"#,
            r#""sparse":{"count":4"#,
            "accessors[0].sparse.count reaches beyond its buffer view, bufferViews[2]",
        ),
        (
            r#""values":{"bufferView":3}"#,
            r#""values":{"bufferView":3,"byteOffset":13}"#,
            "sparse.count reaches beyond its buffer view, bufferViews[3]",
        ),
        (r#""values":{"bufferView":3}"#, r#""values":{}"#, "accessors[0].sparse.values.bufferView is missing"),
        (
            r#""values":{"bufferView":3}"#,
            r#""values":{"bufferView":9}"#,
            "accessors[0].sparse.values.bufferView is 9; allowed: 0 to 3",
        ),
        ("5121", "5126", "accessors[0].sparse.indices.componentType is not that of indices"),
        (r#""sparse":{"count":2,"#, r#""sparse":{"#, "accessors[0].sparse.count is missing"),
        // 7 after 2, then the bytes of 5.0: 0.
        (
            r#""bufferView":2,"byteOffset":1"#,
            r#""bufferView":1,"byteOffset":2"#,
            "contain 0 at position 1 after 1; allowed: rising indices",
        ),
    ] {
        assert!(good.contains(from), "{from}");
        let found = told(&good.replace(from, to));
        assert!(found.contains(message), "{to}: {found}");
    }
    // Without data and sparse elements, vertices are missing.
    assert!(told(ZERO_VECTORS).contains("accessors[0].bufferView is missing, perhaps because the mesh is compressed"));
    // A count without data takes no memory before it is refused.
    let endless = sparse_vectors("", 2, 1).replace(r#""count":3"#, r#""count":4000000000"#);
    assert!(told(&endless).contains("it has 4000000000 vertices"));
}
