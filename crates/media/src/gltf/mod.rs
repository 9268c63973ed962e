//! Meshes from glTF 2.0 files, as `.glb` or as `.gltf` with its buffers inside it or in external files.
//!
//! `glb` splits a binary file, `json` reads values and knows their paths for error messages, `buffers` reads each file once, `accessor` reads
//! dense and sparse elements, and `nodes` finds the meshes of a scene and their transforms. The total memory is computed before the first vertex is read.

mod accessor;
mod buffers;
mod json;
mod lights;
mod nodes;
mod skins;

use std::collections::{BTreeMap, BTreeSet, btree_map::Entry};

use bansho_base::{
    geometry::mesh::{MAX_TRIANGLES, MAX_VERTICES, Mesh, MeshError},
    host::assets::AssetProblem,
    math::{DMat4, DVec3},
};

use self::{
    accessor::Accessor,
    buffers::{Buffers, Glb},
    json::Object,
    nodes::{MeshInstance, SceneNodes},
    skins::{Influences, MorphTargets, Skin},
};
use crate::limits::MemoryLimit;

pub use self::lights::{AnimatedLight, LightKey, encode};

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
/// `file` are the bytes of a file with this `extension`; `read_resource` reads external buffers. Skins and morph targets are in their rest pose.
/// Compressed accessors are not supported, nor required extensions that change geometry.
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
        "glb" => Glb::split(file)?,
        "gltf" => Glb { json: file, binary: None },
        _ => return Err(AssetProblem::UnknownMeshKind),
    };
    let read_bytes = file.len() as u64 + json::memory_bytes(json);
    limit.check(read_bytes)?;
    let value = json::parse(json)?;
    let root = Object::root(&value)?;
    check_version_and_extensions(&root)?;
    let SceneNodes { meshes: mesh_instances, world_from_node } = nodes::scene_nodes(&root)?;
    let limit = MemoryLimit { used: limit.used.saturating_add(read_bytes), ..limit };
    let buffers = Buffers::read(&root, binary, read_resource, limit)?;
    let mut meshes = BTreeMap::new();
    let mut skins = BTreeMap::new();
    for &MeshInstance { mesh, skin, .. } in &mesh_instances {
        if let Entry::Vacant(entry) = meshes.entry(mesh) {
            let instances = mesh_instances.iter().filter(|instance| instance.mesh == mesh);
            entry.insert(TrianglePrimitives::read(&root, mesh, instances, &buffers)?);
        }
        let Some(skin) = skin else { continue };
        if let Entry::Vacant(entry) = skins.entry(skin) {
            entry.insert(Skin::read(&root, skin, &world_from_node, &buffers)?);
        }
    }
    let mesh_bytes = check_totals(mesh_instances.iter().map(|instance| &meshes[&instance.mesh]))?;
    limit.check(buffers.memory_bytes().saturating_add(mesh_bytes))?;
    let mut builder = MeshBuilder::default();
    for instance in &mesh_instances {
        let TrianglePrimitives { primitives, weights, .. } = &meshes[&instance.mesh];
        let weights = instance.weights.as_ref().unwrap_or(weights);
        let skin = instance.skin.map(|skin| &skins[&skin]);
        let pose = InstancePose { weights, skin, world_from_mesh: &instance.world_from_mesh };
        for primitive in primitives {
            if let Some(skin) = skin {
                primitive.influences.check(primitive.positions.count, skin)?;
            }
            builder.add(primitive, &pose)?;
        }
    }
    Ok(Mesh::new(builder.vertices, builder.triangles)?)
}

/// URIs of the external buffers of a glTF, each once; of a damaged file, those that can be found. `file` and `extension` are as in [`decode_mesh`].
pub(crate) fn external_buffer_uris(file: &[u8], extension: &str) -> Vec<String> {
    let json = match extension.to_ascii_lowercase().as_str() {
        "glb" => Glb::split(file).map(|glb| glb.json).unwrap_or_default(),
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
    let required = root.list("extensionsRequired")?.iter().map(|name| name.as_str().unwrap_or_default());
    let geometry: Vec<&str> = required.filter(|name| !concerns_no_geometry(name)).collect();
    // What compresses the mesh is named first: it explains everything else.
    for name in &geometry {
        if let Some((_, advice)) = COMPRESSION.iter().find(|(compression, _)| compression == name) {
            return Err(root.error_at("extensionsRequired", format!("requires {name:?}: {advice}")));
        }
    }
    match geometry.first() {
        None => Ok(()),
        Some(first) => {
            let message = format!("requires {first:?}; allowed: extensions of materials, textures and lights");
            Err(root.error_at("extensionsRequired", message))
        }
    }
}

/// Extensions that compress geometry, and what to do.
const COMPRESSION: [(&str, &str); 4] = [
    (
        "KHR_draco_mesh_compression",
        "its mesh is compressed by Draco; export it without compression (in Blender: Data, Mesh, Compression off), or unpack it by `gltf-transform copy in.glb out.glb`",
    ),
    (
        "EXT_meshopt_compression",
        "its mesh is compressed by meshopt; export it without `-c` of gltfpack, or unpack it by `gltf-transform copy in.glb out.glb`",
    ),
    (
        "KHR_meshopt_compression",
        "its mesh is compressed by meshopt; export it without `-c` of gltfpack, or unpack it by `gltf-transform copy in.glb out.glb`",
    ),
    (
        "KHR_mesh_quantization",
        "its positions are quantized to integers; export it with `-noq` of gltfpack, or by `gltf-transform dequantize in.glb out.glb`",
    ),
];

/// Whether an extension only concerns materials, textures, lights, sounds or notes.
fn concerns_no_geometry(name: &str) -> bool {
    const PREFIXES: [&str; 10] = [
        "KHR_materials_",
        "EXT_materials_",
        "ADOBE_materials_",
        "KHR_texture_",
        "EXT_texture_",
        "MSFT_texture_",
        "KHR_lights_",
        "EXT_lights_",
        "KHR_xmp",
        "KHR_audio",
    ];
    PREFIXES.iter().any(|prefix| name.starts_with(prefix))
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

/// How the vertices of a mesh are placed.
struct InstancePose<'a> {
    /// Weights of the morph targets.
    weights: &'a [f64],
    /// The skin, which replaces the transform.
    skin: Option<&'a Skin>,
    world_from_mesh: &'a DMat4,
}

/// The triangle primitives of a mesh.
struct TrianglePrimitives<'b> {
    /// Weights of its morph targets.
    weights: Vec<f64>,
    primitives: Vec<Primitive<'b>>,
    triangles: usize,
    vertices: usize,
}

/// A primitive of triangles.
struct Primitive<'b> {
    positions: Accessor<'b>,
    indices: Option<Accessor<'b>>,
    mode: PrimitiveMode,
    targets: MorphTargets<'b>,
    influences: Influences<'b>,
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
    /// Reads a mesh that is shown by these `instances`.
    fn read<'i>(
        root: &Object,
        mesh: usize,
        instances: impl Iterator<Item = &'i MeshInstance>,
        buffers: &'b Buffers,
    ) -> Result<Self, AssetProblem> {
        let mesh = root.item("meshes", mesh)?;
        let weights = mesh.number_list("weights")?.unwrap_or_default();
        // Targets that no instance moves are not read: there may be hundreds, of a face for example.
        let mut used_targets = BTreeSet::new();
        for instance in instances {
            let weights = instance.weights.as_deref().unwrap_or(&weights).iter().enumerate();
            used_targets.extend(weights.filter(|(_, weight)| **weight != 0.0).map(|(target, _)| target));
        }
        let mut triangle_primitives = Self { weights, primitives: Vec::new(), triangles: 0, vertices: 0 };
        for primitive in mesh.items("primitives")? {
            let Some(primitive) = Primitive::read(root, &primitive?, &used_targets, buffers)? else { continue };
            let triangles = primitive.mode.triangles(primitive.indices.unwrap_or(primitive.positions).count);
            if triangles > 0 {
                triangle_primitives.triangles = triangle_primitives.triangles.saturating_add(triangles);
                triangle_primitives.vertices = triangle_primitives.vertices.saturating_add(primitive.positions.count);
                triangle_primitives.primitives.push(primitive);
            }
        }
        Ok(triangle_primitives)
    }
}

impl<'b> Primitive<'b> {
    /// `None` for points, lines and primitives without positions.
    fn read(
        root: &Object,
        primitive: &Object,
        used_targets: &BTreeSet<usize>,
        buffers: &'b Buffers,
    ) -> Result<Option<Self>, AssetProblem> {
        let accessors = root.list("accessors")?.len();
        let attributes = primitive.object("attributes")?;
        let Some(attributes) = attributes else { return Ok(None) };
        let positions = attributes.index("POSITION", accessors)?;
        let (Some(mode), Some(positions)) = (PrimitiveMode::of(primitive)?, positions) else { return Ok(None) };
        let positions = Accessor::positions(root, positions, buffers)?;
        let indices = primitive.index("indices", accessors)?;
        let indices = indices.map(|indices| Accessor::indices(root, indices, buffers)).transpose()?;
        let targets = MorphTargets::read(root, primitive, used_targets, buffers)?;
        let influences = Influences::read(root, &attributes, positions.count, buffers)?;
        Ok(Some(Self { positions, indices, mode, targets, influences }))
    }
}

impl Primitive<'_> {
    /// Its vertices in the world.
    fn vertices(&self, pose: &InstancePose) -> Vec<DVec3> {
        let mut vertices: Vec<DVec3> =
            self.positions.vectors().map(|vertex| DVec3::from(vertex.map(f64::from))).collect();
        self.targets.apply(&mut vertices, pose.weights);
        match pose.skin.filter(|_| !self.influences.is_empty()) {
            Some(skin) => self.influences.apply(&mut vertices, skin),
            None => vertices.iter_mut().for_each(|vertex| *vertex = pose.world_from_mesh.transform_point3(*vertex)),
        }
        vertices
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
    fn add(&mut self, primitive: &Primitive, pose: &InstancePose) -> Result<(), MeshError> {
        let (first, count) = (self.vertices.len() as u32, primitive.positions.count);
        let vertices = primitive.vertices(pose).into_iter().map(|vertex| vertex.as_vec3().to_array());
        self.vertices.extend(vertices);
        let indices = primitive.indices.map_or_else(|| (0..count as u32).collect(), Accessor::indices_u32);
        let triangles = triangles(primitive.mode, &indices);
        for (triangle, vertices) in triangles.iter().enumerate() {
            if let Some(&vertex) = vertices.iter().find(|&&vertex| vertex as usize >= count) {
                return Err(MeshError::VertexIndexOutOfRange { triangle, vertex, vertex_count: count });
            }
        }
        self.triangles.extend(triangles.into_iter().map(|vertices| vertices.map(|vertex| first + vertex)));
        Ok(())
    }
}

/// The triangles of a list of indices.
fn triangles(mode: PrimitiveMode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        PrimitiveMode::Triangles => indices.as_chunks::<3>().0.to_vec(),
        PrimitiveMode::Strip => {
            // Every other triangle of a strip is turned around, so that all face the same side.
            let mut triangles = Vec::with_capacity(indices.len().saturating_sub(2));
            for (index, vertices) in indices.windows(3).enumerate() {
                let [a, b] = if index % 2 == 0 { [vertices[0], vertices[1]] } else { [vertices[1], vertices[0]] };
                triangles.push([a, b, vertices[2]]);
            }
            triangles
        }
        PrimitiveMode::Fan => {
            let (Some(&hub), rim) = (indices.first(), indices.get(1..).unwrap_or_default()) else { return Vec::new() };
            rim.windows(2).map(|pair| [hub, pair[0], pair[1]]).collect()
        }
    }
}

#[cfg(test)]
mod tests;
