//! The node hierarchy: which meshes a scene shows, and their transforms.

use bansho_base::{
    host::assets::AssetProblem,
    math::{DMat4, DQuat, DVec3},
};

use super::{damaged, json::Object};

/// Largest number of nodes.
const MAX_NODES: usize = 100_000;

/// A mesh of a node, with its world transform.
pub(super) struct MeshInstance {
    pub(super) mesh: usize,
    pub(super) world_from_mesh: DMat4,
    /// The skin that moves it, instead of its transform.
    pub(super) skin: Option<usize>,
    /// Weights of its morph targets; `None` for those of the mesh.
    pub(super) weights: Option<Vec<f64>>,
}

/// What a scene shows.
pub(super) struct SceneNodes {
    pub(super) meshes: Vec<MeshInstance>,
    /// The transforms of all nodes.
    pub(super) world_from_node: Vec<DMat4>,
}

struct GltfNode {
    mesh: Option<usize>,
    skin: Option<usize>,
    weights: Option<Vec<f64>>,
    parent_from_node: DMat4,
    children: Vec<usize>,
    parent: Option<usize>,
}

/// The meshes of the default scene; without a default, of the first scene; without scenes, of all nodes.
pub(super) fn scene_nodes(root: &Object) -> Result<SceneNodes, AssetProblem> {
    let nodes = read_tree(root)?;
    let world_from_node = world_transforms(&nodes);
    let mut meshes = Vec::new();
    let mut stack = root_nodes(root, &nodes)?;
    // Every node has at most one parent, so none is visited twice.
    while let Some(index) = stack.pop() {
        let node = &nodes[index];
        meshes.extend(node.mesh.map(|mesh| MeshInstance {
            mesh,
            world_from_mesh: world_from_node[index],
            skin: node.skin,
            weights: node.weights.clone(),
        }));
        stack.extend(&node.children);
    }
    Ok(SceneNodes { meshes, world_from_node })
}

/// The transforms of all nodes, which form trees.
fn world_transforms(nodes: &[GltfNode]) -> Vec<DMat4> {
    let mut world_from_node = vec![DMat4::IDENTITY; nodes.len()];
    let mut stack: Vec<usize> = (0..nodes.len()).filter(|&index| nodes[index].parent.is_none()).collect();
    while let Some(index) = stack.pop() {
        let world_from_parent = nodes[index].parent.map_or(DMat4::IDENTITY, |parent| world_from_node[parent]);
        world_from_node[index] = world_from_parent * nodes[index].parent_from_node;
        stack.extend(&nodes[index].children);
    }
    world_from_node
}

/// Reads all nodes, which must form trees: no node has two parents or is its own ancestor.
fn read_tree(root: &Object) -> Result<Vec<GltfNode>, AssetProblem> {
    let count = root.list("nodes")?.len();
    if count > MAX_NODES {
        return Err(root.error_at("nodes", format!("has {count} elements; allowed: up to {MAX_NODES}")));
    }
    let lengths = [count, root.list("meshes")?.len(), root.list("skins")?.len()];
    let mut nodes: Vec<GltfNode> = root.items("nodes")?.map(|node| read(&node?, lengths)).collect::<Result<_, _>>()?;
    for index in 0..count {
        // Each child learns of its parent, of which it may have one.
        for child in std::mem::take(&mut nodes[index].children) {
            if let Some(other) = nodes[child].parent.replace(index) {
                let message =
                    format!("node {child} is a child of node {other} and again of node {index}; allowed: one parent");
                return Err(damaged(message));
            }
            nodes[index].children.push(child);
        }
    }
    // Nodes in a circle all have a parent, so that none is reached from a root.
    let mut reached: Vec<usize> = (0..count).filter(|&index| nodes[index].parent.is_none()).collect();
    let mut next = 0;
    while let Some(&index) = reached.get(next) {
        reached.extend(&nodes[index].children);
        next += 1;
    }
    if reached.len() < count {
        return Err(damaged("it has nodes that contain each other; allowed: trees of nodes"));
    }
    Ok(nodes)
}

/// Reads a node of a file with these numbers of nodes, meshes and skins.
fn read(node: &Object, [nodes, meshes, skins]: [usize; 3]) -> Result<GltfNode, AssetProblem> {
    let parent_from_node = match node.numbers::<16>("matrix")? {
        Some(columns) => DMat4::from_cols_array(&columns.map(f64::from)),
        None => {
            let rotation = node.numbers("rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
            let rotation = DQuat::from_array(rotation.map(f64::from));
            DMat4::from_scale_rotation_translation(
                vector(node, "scale", 1.0)?,
                rotation,
                vector(node, "translation", 0.0)?,
            )
        }
    };
    Ok(GltfNode {
        mesh: node.index("mesh", meshes)?,
        skin: node.index("skin", skins)?,
        weights: node.number_list("weights")?,
        parent_from_node,
        children: node.indices("children", nodes)?,
        parent: None,
    })
}

/// The vector `key` of a node, with `default` for its components if there is none.
fn vector(node: &Object, key: &str, default: f32) -> Result<DVec3, AssetProblem> {
    Ok(DVec3::from(node.numbers(key)?.unwrap_or([default; 3]).map(f64::from)))
}

/// The root nodes of the scene.
fn root_nodes(root: &Object, nodes: &[GltfNode]) -> Result<Vec<usize>, AssetProblem> {
    let scenes = root.list("scenes")?.len();
    let Some(scene) = root.index("scene", scenes)?.or((scenes > 0).then_some(0)) else {
        return Ok((0..nodes.len()).filter(|&index| nodes[index].parent.is_none()).collect());
    };
    let scene = root.item("scenes", scene)?;
    let root_nodes = scene.indices("nodes", nodes.len())?;
    let mut listed = vec![false; nodes.len()];
    for &index in &root_nodes {
        if let Some(parent) = nodes[index].parent {
            let message =
                format!("contains {index}, which is a child of node {parent}; allowed: nodes without a parent");
            return Err(scene.error_at("nodes", message));
        }
        if std::mem::replace(&mut listed[index], true) {
            return Err(scene.error_at("nodes", format!("contains {index} twice; allowed: every node once")));
        }
    }
    Ok(root_nodes)
}
