//! Meshes from glTF 2.0 files, as `.glb` or as `.gltf` with its buffers inside or beside it.
//!
//! `glb` takes a binary file apart, `json` reads values and says where they stand, `buffers` reads each file once, `nodes` says which
//! meshes are shown where. What all of them together would take is counted before the first corner is read.

mod accessor;
mod buffers;
mod glb;
mod json;
mod nodes;

use std::collections::BTreeMap;

use bansho_base::{
    geometry::mesh::{MAX_TRIANGLES, MAX_VERTICES, Mesh, MeshError},
    host::assets::AssetProblem,
    math::{DMat4, DVec3},
};

use self::{accessor::Accessor, buffers::Buffers, glb::Glb, json::Object, nodes::MeshInstance};
use super::limits::MemoryLimit;

/// Reads an external resource of a glTF by its URI, up to a number of bytes.
pub type ReadResource<'a> = &'a dyn Fn(&str, u64) -> Result<Vec<u8>, AssetProblem>;

/// Memory of a vertex and a triangle while meshes are built: growing lists take twice the size, and triangles need
/// their vertex order too.
const CORNER_BYTES: usize = 2 * size_of::<[f32; 3]>();
const TRIANGLE_BYTES: usize = 2 * size_of::<[u32; 3]>() + 2 * size_of::<[u32; 3]>();

fn damaged(reason: impl std::fmt::Display) -> AssetProblem {
    AssetProblem::Damaged(reason.to_string())
}

/// Reads all triangles of the default scene (of the first, where none is the default; of all nodes, where there is none), each where its
/// node stands.
///
/// `file` are the bytes of a file whose name ends in `extension`; `beside` gives the bytes of files that it names, of at most so many bytes.
/// Morph targets, skins, required extensions and sparse or compressed accessors are not read.
///
/// # Errors
/// Another extension, damage, more than is read, more memory than `limit`, or no triangles. Never panics.
pub fn decode_mesh(
    file: &[u8],
    extension: &str,
    read_resource: ReadResource,
    limit: MemoryLimit,
) -> Result<Mesh, AssetProblem> {
    let Glb { json, binary } = match extension.to_ascii_lowercase().as_str() {
        "glb" => glb::split(file)?,
        "gltf" => Glb { json: file, binary: None },
        _ => return Err(AssetProblem::UnknownMeshKind),
    };
    let read_bytes = file.len() as u64 + json::memory_bytes(json);
    limit.check(read_bytes)?;
    let value = json::parse(json)?;
    let root = Object::root(&value)?;
    check_demands(&root)?;
    let mesh_instances = nodes::mesh_instances(&root)?;
    let limit = MemoryLimit { used: limit.used.saturating_add(read_bytes), ..limit };
    let buffers = Buffers::read(&root, binary, read_resource, limit)?;
    let mut shapes = BTreeMap::new();
    for &MeshInstance { mesh, .. } in &mesh_instances {
        if let std::collections::btree_map::Entry::Vacant(entry) = shapes.entry(mesh) {
            entry.insert(PrimitiveMesh::read(&root, mesh, &buffers)?);
        }
    }
    let gathered_bytes = check_totals(mesh_instances.iter().map(|mesh_instances| &shapes[&mesh_instances.mesh]))?;
    limit.check(buffers.memory_bytes().saturating_add(gathered_bytes))?;
    let mut gathering = MeshBuilder::default();
    for MeshInstance { mesh, world_from_mesh } in &mesh_instances {
        shapes[mesh].parts.iter().try_for_each(|primitive_data| gathering.add(primitive_data, world_from_mesh))?;
    }
    Ok(Mesh::new(gathering.corners, gathering.triangles)?)
}

/// Names of the files beside it that a glTF's numbers lie in, each once, as many as can be found; `file` and `extension` as in [`decode_mesh`].
pub fn files_beside(file: &[u8], extension: &str) -> Vec<String> {
    let json = match extension.to_ascii_lowercase().as_str() {
        "glb" => glb::split(file).map(|glb| glb.json).unwrap_or_default(),
        "gltf" => file,
        _ => return Vec::new(),
    };
    let Ok(value) = json::parse(json) else { return Vec::new() };
    let root = Object::root(&value);
    root.map(|root| buffers::files(&root).into_iter().map(str::to_owned).collect()).unwrap_or_default()
}

/// Refuses required extensions and other versions.
fn check_demands(root: &Object) -> Result<(), AssetProblem> {
    let asset =
        root.object("asset")?.ok_or_else(|| root.fault("asset", "is missing; allowed: { \"version\": \"2.0\" }"))?;
    let version = asset.text("version")?.unwrap_or_default();
    if !version.starts_with("2.") {
        return Err(asset.fault("version", format!("is {version:?}; allowed: \"2.0\"")));
    }
    match root.list("extensionsRequired")? {
        [] => Ok(()),
        [first, ..] => {
            Err(root.fault("extensionsRequired", format!("demands {first}; allowed: files that demand no extensions")))
        }
    }
}

/// Refuses more than a mesh may have before reading any of it; returns the memory that building it takes.
fn check_totals<'s>(shapes: impl Iterator<Item = &'s PrimitiveMesh<'s>>) -> Result<u64, MeshError> {
    let (mut triangles, mut corners) = (0_usize, 0_usize);
    for shape in shapes {
        triangles = triangles.saturating_add(shape.triangles);
        corners = corners.saturating_add(shape.corners);
    }
    if triangles > MAX_TRIANGLES {
        return Err(MeshError::TooManyTriangles { found: triangles });
    }
    if corners > MAX_VERTICES {
        return Err(MeshError::TooManyVertices { found: corners });
    }
    Ok((corners * CORNER_BYTES + triangles * TRIANGLE_BYTES) as u64)
}

/// The triangle primitives of a mesh.
struct PrimitiveMesh<'b> {
    parts: Vec<Primitive<'b>>,
    triangles: usize,
    corners: usize,
}

/// A primitive of triangles.
struct Primitive<'b> {
    positions: Accessor<'b>,
    indices: Option<Accessor<'b>>,
    mode: PrimitiveMode,
}

/// Topology of a primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PrimitiveMode {
    Triangles,
    Strip,
    Fan,
}

impl PrimitiveMode {
    /// The mode of a primitive; `None` for points and lines.
    fn of(primitive: &Object) -> Result<Option<Self>, AssetProblem> {
        match primitive.whole("mode")? {
            None | Some(4) => Ok(Some(Self::Triangles)),
            Some(5) => Ok(Some(Self::Strip)),
            Some(6) => Ok(Some(Self::Fan)),
            Some(0..=3) => Ok(None),
            Some(mode) => Err(primitive.fault("mode", format!("is {mode}; allowed: 0 to 6"))),
        }
    }

    /// Number of triangles for this number of vertices.
    fn triangles(self, corners: usize) -> usize {
        match self {
            Self::Triangles => corners / 3,
            Self::Strip | Self::Fan => corners.saturating_sub(2),
        }
    }
}

impl<'b> PrimitiveMesh<'b> {
    fn read(root: &Object, mesh: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        let mut shape = Self { parts: Vec::new(), triangles: 0, corners: 0 };
        for primitive in root.item("meshes", mesh)?.items("primitives")? {
            let Some(primitive_data) = Primitive::read(root, &primitive?, buffers)? else { continue };
            let triangles =
                primitive_data.mode.triangles(primitive_data.indices.unwrap_or(primitive_data.positions).count);
            if triangles > 0 {
                shape.triangles = shape.triangles.saturating_add(triangles);
                shape.corners = shape.corners.saturating_add(primitive_data.positions.count);
                shape.parts.push(primitive_data);
            }
        }
        Ok(shape)
    }
}

impl<'b> Primitive<'b> {
    /// `None` for points, lines and primitives without positions.
    fn read(root: &Object, primitive: &Object, buffers: &'b Buffers) -> Result<Option<Self>, AssetProblem> {
        let accessors = root.list("accessors")?.len();
        let attributes = primitive.object("attributes")?;
        let positions = attributes.map(|attributes| attributes.index("POSITION", accessors)).transpose()?.flatten();
        let (Some(mode), Some(positions)) = (PrimitiveMode::of(primitive)?, positions) else { return Ok(None) };
        let positions = Accessor::positions(root, positions, buffers)?;
        let indices = primitive.index("indices", accessors)?;
        let indices = indices.map(|indices| Accessor::indices(root, indices, buffers)).transpose()?;
        Ok(Some(Self { positions, indices, mode }))
    }
}

#[derive(Default)]
struct MeshBuilder {
    corners: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl MeshBuilder {
    /// Adds a primitive, transformed. Indices must refer to its own vertices.
    fn add(&mut self, primitive_data: &Primitive, world_from_mesh: &DMat4) -> Result<(), MeshError> {
        let (first, corners) = (self.corners.len() as u32, primitive_data.positions.count);
        let place = |corner: [f32; 3]| {
            world_from_mesh.transform_point3(DVec3::from(corner.map(f64::from))).as_vec3().to_array()
        };
        self.corners.extend(primitive_data.positions.vectors().map(place));
        let order = primitive_data.indices.map_or_else(|| (0..corners as u32).collect(), Accessor::indices_u32);
        let triangles = triangles(primitive_data.mode, &order);
        for (triangle, named) in triangles.iter().enumerate() {
            if let Some(&corner) = named.iter().find(|&&corner| corner as usize >= corners) {
                return Err(MeshError::VertexIndexOutOfRange { triangle, vertex: corner, vertex_count: corners });
            }
        }
        self.triangles.extend(triangles.into_iter().map(|named| named.map(|corner| first + corner)));
        Ok(())
    }
}

/// The triangles of a vertex order.
fn triangles(mode: PrimitiveMode, order: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        PrimitiveMode::Triangles => order.as_chunks::<3>().0.to_vec(),
        PrimitiveMode::Strip => {
            let turn = |(index, corners): (usize, &[u32])| match index % 2 {
                0 => [corners[0], corners[1], corners[2]],
                _ => [corners[1], corners[0], corners[2]],
            };
            order.windows(3).enumerate().map(turn).collect()
        }
        PrimitiveMode::Fan => {
            let (Some(&hub), rim) = (order.first(), order.get(1..).unwrap_or_default()) else { return Vec::new() };
            rim.windows(2).map(|pair| [hub, pair[0], pair[1]]).collect()
        }
    }
}

#[cfg(test)]
mod tests;
