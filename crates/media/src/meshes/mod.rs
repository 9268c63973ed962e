//! Meshes from glTF files, as `.glb` or as `.gltf` with its buffers inside or beside it.

mod accessor;
mod base64;

use bansho_base::{
    assets::AssetProblem,
    math::{DMat4, DVec3, Mat4},
    mesh::{MOST_TRIANGLES, Mesh, MeshError},
};
use gltf::{Document, Gltf, Node, buffer::Source, mesh::Mode};

/// Most nodes that are visited; a file whose nodes contain each other has no end.
const MOST_NODES: usize = 100_000;

fn damaged(reason: impl std::fmt::Display) -> AssetProblem {
    AssetProblem::Damaged(reason.to_string())
}

/// Reads all triangles of the default scene (of all nodes, where none is the default), each where its node stands.
///
/// `file` are the bytes of a file whose name ends in `extension`; `beside` gives the bytes of files that it names.
/// Morph targets, skins and sparse or compressed accessors are not read.
///
/// # Errors
/// Another extension, damage, or no triangles. Never panics.
pub fn decode_mesh(
    file: &[u8],
    extension: &str,
    beside: &dyn Fn(&str) -> Result<Vec<u8>, AssetProblem>,
) -> Result<Mesh, AssetProblem> {
    let (json, binary) = match extension.to_ascii_lowercase().as_str() {
        "glb" => split_glb(file).ok_or_else(|| damaged("it is no binary glTF of version 2"))?,
        "gltf" => (file, None),
        _ => return Err(AssetProblem::UnknownMeshKind),
    };
    let document = parse(json)?;
    let mut gathering = Gathering { buffers: buffers(&document, binary, beside)?, ..Gathering::default() };
    let nodes: Vec<Node> = match document.default_scene().or_else(|| document.scenes().next()) {
        Some(scene) => scene.nodes().collect(),
        None => document.nodes().collect(),
    };
    gathering.walk(nodes)?;
    Ok(Mesh::new(gathering.corners, gathering.triangles)?)
}

/// The document, checked.
fn parse(json: &[u8]) -> Result<Document, AssetProblem> {
    let root = Gltf::from_slice_without_validation(json).map_err(damaged)?.document.into_json();
    // The checks of gltf 1.4.1 themselves panic where an attribute names an accessor that is not there.
    let mut attributes = root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|part| part.attributes.values());
    if attributes.any(|index| index.value() >= root.accessors.len()) {
        return Err(damaged("a primitive names an accessor that is not there"));
    }
    Document::from_json(root).map_err(damaged)
}

/// The JSON of a binary glTF, and its buffer if it has one.
fn split_glb(file: &[u8]) -> Option<(&[u8], Option<&[u8]>)> {
    let rest = file.strip_prefix(b"glTF\x02\0\0\0")?.get(4..)?;
    let (json, rest) = chunk(rest, b"JSON")?;
    Some((json, chunk(rest, b"BIN\0").map(|(binary, _)| binary)))
}

fn chunk<'a>(bytes: &'a [u8], kind: &[u8; 4]) -> Option<(&'a [u8], &'a [u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.strip_prefix(kind)?.split_at_checked(u32::from_le_bytes(*length) as usize)
}

fn buffers(
    document: &Document,
    binary: Option<&[u8]>,
    beside: &dyn Fn(&str) -> Result<Vec<u8>, AssetProblem>,
) -> Result<Vec<Vec<u8>>, AssetProblem> {
    let read = |buffer: gltf::Buffer| match buffer.source() {
        Source::Bin => binary.map(<[u8]>::to_vec).ok_or_else(|| damaged("its binary buffer is missing")),
        Source::Uri(uri) => match uri.strip_prefix("data:") {
            Some(data) => data
                .split_once(";base64,")
                .and_then(|(_, text)| base64::decode(text))
                .ok_or_else(|| damaged("a buffer inside it is not base64")),
            None => beside(uri),
        },
    };
    document.buffers().map(read).collect()
}

#[derive(Default)]
struct Gathering {
    buffers: Vec<Vec<u8>>,
    corners: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Gathering {
    fn walk(&mut self, roots: Vec<Node>) -> Result<(), AssetProblem> {
        let mut open: Vec<(Node, DMat4)> = roots.into_iter().map(|node| (node, DMat4::IDENTITY)).collect();
        let mut visited = 0;
        while let Some((node, parent)) = open.pop() {
            visited += 1;
            if visited > MOST_NODES {
                return Err(damaged(format!("it has more than {MOST_NODES} nodes, or nodes that contain each other")));
            }
            let placed = parent * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
            for primitive in node.mesh().into_iter().flat_map(|mesh| mesh.primitives()) {
                self.primitive(&primitive, &placed)?;
            }
            open.extend(node.children().map(|child| (child, placed)));
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &gltf::Primitive, placed: &DMat4) -> Result<(), AssetProblem> {
        let Some(positions) = primitive.get(&gltf::Semantic::Positions) else { return Ok(()) };
        let positions = accessor::vectors(&positions, &self.buffers)?;
        let order = match primitive.indices() {
            Some(indices) => accessor::indices(&indices, &self.buffers)?,
            None => (0..positions.len() as u32).collect(),
        };
        let triangles = triangles(primitive.mode(), &order);
        if self.triangles.len() + triangles.len() > MOST_TRIANGLES {
            return Err(MeshError::TooManyTriangles { found: self.triangles.len() + triangles.len() }.into());
        }
        let corners = self.corners.len() as u32;
        let place = |corner: [f32; 3]| placed.transform_point3(DVec3::from(corner.map(f64::from))).as_vec3().to_array();
        self.corners.extend(positions.into_iter().map(place));
        let moved = |named: [u32; 3]| named.map(|corner| corner.saturating_add(corners));
        self.triangles.extend(triangles.into_iter().map(moved));
        Ok(())
    }
}

/// The triangles that corners in this order make; none for points and lines.
fn triangles(mode: Mode, order: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::Triangles => order.as_chunks::<3>().0.to_vec(),
        Mode::TriangleStrip => {
            let turn = |(index, corners): (usize, &[u32])| match index % 2 {
                0 => [corners[0], corners[1], corners[2]],
                _ => [corners[1], corners[0], corners[2]],
            };
            order.windows(3).enumerate().map(turn).collect()
        }
        Mode::TriangleFan => {
            let (Some(&hub), rim) = (order.first(), order.get(1..).unwrap_or_default()) else { return Vec::new() };
            rim.windows(2).map(|pair| [hub, pair[0], pair[1]]).collect()
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => Vec::new(),
    }
}

#[cfg(test)]
mod tests;
