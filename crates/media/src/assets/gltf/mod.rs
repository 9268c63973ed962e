//! Meshes from glTF 2.0 files, as `.glb` or as `.gltf` with its buffers inside it or in external files.
//!
//! `glb` splits a binary file, `json` reads values and knows their paths for error messages, `buffers` reads each file once, and
//! `nodes` finds the meshes of a scene and their transforms. The total memory is computed before the first vertex is read.

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

/// Reads an external buffer of a glTF by its URI, up to a number of bytes.
pub type ReadResource<'a> = &'a dyn Fn(&str, u64) -> Result<Vec<u8>, AssetProblem>;

/// Memory of a vertex and of a triangle while a mesh is built: growing lists take up to twice their size, and triangles also need the list
/// of indices.
const VERTEX_BYTES: usize = 2 * size_of::<[f32; 3]>();
const TRIANGLE_BYTES: usize = 2 * size_of::<[u32; 3]>() + 2 * size_of::<[u32; 3]>();

fn damaged(reason: impl std::fmt::Display) -> AssetProblem {
    AssetProblem::Damaged(reason.to_string())
}

/// Decodes all triangles of the default scene, with the transforms of their nodes. Without a default scene it is the first one; without
/// scenes, all nodes.
///
/// `file` are the bytes of a file with this `extension`; `read_resource` reads external buffers. Morph targets, skins, required extensions, and
/// sparse or compressed accessors are not supported.
///
/// # Errors
/// Another extension, damage, an unsupported feature, more memory than `limit`, or no triangles. Never panics.
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
    check_version_and_extensions(&root)?;
    let mesh_instances = nodes::mesh_instances(&root)?;
    let limit = MemoryLimit { used: limit.used.saturating_add(read_bytes), ..limit };
    let buffers = Buffers::read(&root, binary, read_resource, limit)?;
    let mut meshes = BTreeMap::new();
    for &MeshInstance { mesh, .. } in &mesh_instances {
        if let std::collections::btree_map::Entry::Vacant(entry) = meshes.entry(mesh) {
            entry.insert(TrianglePrimitives::read(&root, mesh, &buffers)?);
        }
    }
    let mesh_bytes = check_totals(mesh_instances.iter().map(|instance| &meshes[&instance.mesh]))?;
    limit.check(buffers.memory_bytes().saturating_add(mesh_bytes))?;
    let mut builder = MeshBuilder::default();
    for MeshInstance { mesh, world_from_mesh } in &mesh_instances {
        meshes[mesh].primitives.iter().try_for_each(|primitive| builder.add(primitive, world_from_mesh))?;
    }
    Ok(Mesh::new(builder.vertices, builder.triangles)?)
}

/// URIs of the external buffers of a glTF, each once; of a damaged file, those that can be found. `file` and `extension` are as in [`decode_mesh`].
pub(crate) fn external_buffer_uris(file: &[u8], extension: &str) -> Vec<String> {
    let json = match extension.to_ascii_lowercase().as_str() {
        "glb" => glb::split(file).map(|glb| glb.json).unwrap_or_default(),
        "gltf" => file,
        _ => return Vec::new(),
    };
    let Ok(value) = json::parse(json) else { return Vec::new() };
    let root = Object::root(&value);
    root.map(|root| buffers::external_uris(&root).into_iter().map(str::to_owned).collect()).unwrap_or_default()
}

/// Rejects required extensions and other versions than 2.
fn check_version_and_extensions(root: &Object) -> Result<(), AssetProblem> {
    let asset =
        root.object("asset")?.ok_or_else(|| root.error_at("asset", "is missing; allowed: { \"version\": \"2.0\" }"))?;
    let version = asset.text("version")?.unwrap_or_default();
    if !version.starts_with("2.") {
        return Err(asset.error_at("version", format!("is {version:?}; allowed: \"2.0\"")));
    }
    match root.list("extensionsRequired")? {
        [] => Ok(()),
        [first, ..] => {
            Err(root
                .error_at("extensionsRequired", format!("requires {first}; allowed: files that require no extensions")))
        }
    }
}

/// Rejects too many triangles or vertices before any are read; returns the memory for building the mesh.
fn check_totals<'m>(meshes: impl Iterator<Item = &'m TrianglePrimitives<'m>>) -> Result<u64, MeshError> {
    let (mut triangles, mut vertices) = (0_usize, 0_usize);
    for mesh in meshes {
        triangles = triangles.saturating_add(mesh.triangles);
        vertices = vertices.saturating_add(mesh.vertices);
    }
    if triangles > MAX_TRIANGLES {
        return Err(MeshError::TooManyTriangles { found: triangles });
    }
    if vertices > MAX_VERTICES {
        return Err(MeshError::TooManyVertices { found: vertices });
    }
    Ok((vertices * VERTEX_BYTES + triangles * TRIANGLE_BYTES) as u64)
}

/// The triangle primitives of a mesh.
struct TrianglePrimitives<'b> {
    primitives: Vec<Primitive<'b>>,
    triangles: usize,
    vertices: usize,
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
        match primitive.unsigned("mode")? {
            None | Some(4) => Ok(Some(Self::Triangles)),
            Some(5) => Ok(Some(Self::Strip)),
            Some(6) => Ok(Some(Self::Fan)),
            Some(0..=3) => Ok(None),
            Some(mode) => Err(primitive.error_at("mode", format!("is {mode}; allowed: 0 to 6"))),
        }
    }

    /// Number of triangles for this number of vertices.
    fn triangles(self, vertices: usize) -> usize {
        match self {
            Self::Triangles => vertices / 3,
            Self::Strip | Self::Fan => vertices.saturating_sub(2),
        }
    }
}

impl<'b> TrianglePrimitives<'b> {
    fn read(root: &Object, mesh: usize, buffers: &'b Buffers) -> Result<Self, AssetProblem> {
        let mut own = Self { primitives: Vec::new(), triangles: 0, vertices: 0 };
        for primitive in root.item("meshes", mesh)?.items("primitives")? {
            let Some(primitive) = Primitive::read(root, &primitive?, buffers)? else { continue };
            let triangles = primitive.mode.triangles(primitive.indices.unwrap_or(primitive.positions).count);
            if triangles > 0 {
                own.triangles = own.triangles.saturating_add(triangles);
                own.vertices = own.vertices.saturating_add(primitive.positions.count);
                own.primitives.push(primitive);
            }
        }
        Ok(own)
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
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl MeshBuilder {
    /// Adds a primitive, transformed.
    ///
    /// # Errors
    /// An index beyond its vertices.
    fn add(&mut self, primitive: &Primitive, world_from_mesh: &DMat4) -> Result<(), MeshError> {
        let (first, count) = (self.vertices.len() as u32, primitive.positions.count);
        let transformed = |vertex: [f32; 3]| {
            world_from_mesh.transform_point3(DVec3::from(vertex.map(f64::from))).as_vec3().to_array()
        };
        self.vertices.extend(primitive.positions.vectors().map(transformed));
        let indices = primitive.indices.map_or_else(|| (0..count as u32).collect(), Accessor::indices_u32);
        let triangles = triangles(primitive.mode, &indices);
        for (triangle, own) in triangles.iter().enumerate() {
            if let Some(&vertex) = own.iter().find(|&&vertex| vertex as usize >= count) {
                return Err(MeshError::VertexIndexOutOfRange { triangle, vertex, vertex_count: count });
            }
        }
        self.triangles.extend(triangles.into_iter().map(|own| own.map(|vertex| first + vertex)));
        Ok(())
    }
}

/// The triangles of a list of indices.
fn triangles(mode: PrimitiveMode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        PrimitiveMode::Triangles => indices.as_chunks::<3>().0.to_vec(),
        PrimitiveMode::Strip => {
            let triangle = |(index, vertices): (usize, &[u32])| match index % 2 {
                0 => [vertices[0], vertices[1], vertices[2]],
                _ => [vertices[1], vertices[0], vertices[2]],
            };
            indices.windows(3).enumerate().map(triangle).collect()
        }
        PrimitiveMode::Fan => {
            let (Some(&hub), rim) = (indices.first(), indices.get(1..).unwrap_or_default()) else { return Vec::new() };
            rim.windows(2).map(|pair| [hub, pair[0], pair[1]]).collect()
        }
    }
}

#[cfg(test)]
mod tests;
