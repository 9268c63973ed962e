//! Skins and morph targets in their rest pose (glTF 2.0, 3.7.2.2 and 3.7.3).

use std::collections::BTreeSet;

use bansho_base::{
    host::assets::AssetProblem,
    math::{DMat4, DVec3},
};

use super::{accessor::Accessor, buffers::Buffers, damaged, json::Object};

/// The transforms of a skin's joints from its mesh to the world.
pub(super) struct Skin {
    world_from_mesh: Vec<DMat4>,
}

impl Skin {
    /// The skin `skins[index]`; `world_from_node` are the transforms of all nodes.
    pub(super) fn read(
        root: &Object,
        index: usize,
        world_from_node: &[DMat4],
        buffers: &Buffers,
    ) -> Result<Self, AssetProblem> {
        let skin = root.item("skins", index)?;
        let joints = skin.indices("joints", world_from_node.len())?;
        let accessors = root.list("accessors")?.len();
        let inverse = skin.index("inverseBindMatrices", accessors)?;
        let matrices: Vec<DMat4> = match inverse {
            None => vec![DMat4::IDENTITY; joints.len()],
            Some(accessor) => {
                let matrices = Accessor::matrices(root, accessor, buffers)?.floats::<16>().take(joints.len());
                matrices.map(|columns| DMat4::from_cols_array(&columns.map(f64::from))).collect()
            }
        };
        // A matrix that is not finite would move vertices of any weight to nowhere.
        if let Some(joint) = matrices.iter().position(|matrix| !matrix.is_finite()) {
            let message = format!("has a number that is not finite in matrix {joint}");
            return Err(skin.error_at("inverseBindMatrices", message));
        }
        if matrices.len() < joints.len() {
            let message = format!("has {} matrices for {} joints", matrices.len(), joints.len());
            return Err(skin.error_at("inverseBindMatrices", message));
        }
        let world_from_mesh = joints.iter().zip(matrices).map(|(&joint, inverse)| world_from_node[joint] * inverse);
        Ok(Self { world_from_mesh: world_from_mesh.collect() })
    }
}

/// The joints of the vertices of a primitive: four for each set.
pub(super) struct Influences<'b> {
    sets: Vec<[Accessor<'b>; 2]>,
}

impl<'b> Influences<'b> {
    /// Reads `JOINTS_0` and `WEIGHTS_0`, and further sets.
    pub(super) fn read(
        root: &Object,
        attributes: &Object,
        vertices: usize,
        buffers: &'b Buffers,
    ) -> Result<Self, AssetProblem> {
        let accessors = root.list("accessors")?.len();
        let mut sets = Vec::new();
        for set in 0.. {
            let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
            let Some(joint) = attributes.index(&joints, accessors)? else { break };
            let weight = attributes.index(&weights, accessors)?;
            let weight = weight.ok_or_else(|| attributes.error_at(&weights, "is missing beside its joints"))?;
            let pair = [Accessor::joints(root, joint, buffers)?, Accessor::weights(root, weight, buffers)?];
            if pair.iter().any(|accessor| accessor.count < vertices) {
                return Err(attributes.error_at(&joints, format!("has fewer elements than {vertices} vertices")));
            }
            if let Some(vertex) = pair[1].floats::<4>().take(vertices).position(|of| !of.iter().all(|w| w.is_finite()))
            {
                return Err(
                    attributes.error_at(&weights, format!("has a weight that is not finite at vertex {vertex}"))
                );
            }
            sets.push(pair);
        }
        Ok(Self { sets })
    }

    /// Checks that the joints of `vertices` with a weight are among those of `skin`.
    ///
    /// # Errors
    /// A joint that the skin does not have.
    pub(super) fn check(&self, vertices: usize, skin: &Skin) -> Result<(), AssetProblem> {
        let count = skin.world_from_mesh.len();
        for [joints, weights] in &self.sets {
            let influences = joints.integers::<4>().zip(weights.floats::<4>()).take(vertices).enumerate();
            for (vertex, (joints, weights)) in influences {
                let mut used = joints.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
                if let Some((joint, _)) = used.find(|(joint, _)| *joint as usize >= count) {
                    return Err(damaged(format!("vertex {vertex} follows joint {joint} of a skin of {count} joints")));
                }
            }
        }
        Ok(())
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.sets.is_empty()
    }

    /// Moves `vertices` to where the joints put them in the world.
    pub(super) fn apply(&self, vertices: &mut [DVec3], skin: &Skin) {
        let mut moved = vec![(DVec3::ZERO, 0.0); vertices.len()];
        for [joints, weights] in &self.sets {
            let influences = joints.integers::<4>().zip(weights.floats::<4>());
            for (((sum, total), vertex), (joints, weights)) in moved.iter_mut().zip(&*vertices).zip(influences) {
                for (joint, weight) in joints.into_iter().zip(weights) {
                    let Some(world) = skin.world_from_mesh.get(joint as usize).filter(|_| weight > 0.0) else {
                        continue;
                    };
                    *sum += f64::from(weight) * world.transform_point3(*vertex);
                    *total += f64::from(weight);
                }
            }
        }
        for (vertex, (sum, total)) in vertices.iter_mut().zip(moved) {
            // Weights need not add up to 1 in the file. Vertices without any stay where they are.
            if total > 0.0 {
                *vertex = sum / total;
            }
        }
    }
}

/// The morph targets of a primitive whose weights are not 0.
pub(super) struct MorphTargets<'b> {
    targets: Vec<Option<Accessor<'b>>>,
}

impl<'b> MorphTargets<'b> {
    /// Reads the displacements of the targets that are used.
    pub(super) fn read(
        root: &Object,
        primitive: &Object,
        used_targets: &BTreeSet<usize>,
        buffers: &'b Buffers,
    ) -> Result<Self, AssetProblem> {
        let accessors = root.list("accessors")?.len();
        let mut targets = Vec::new();
        for (index, target) in primitive.items("targets")?.enumerate() {
            let position = target?.index("POSITION", accessors)?.filter(|_| used_targets.contains(&index));
            targets.push(position.map(|position| Accessor::displacements(root, position, buffers)).transpose()?);
        }
        Ok(Self { targets })
    }

    /// Adds the weighted displacements.
    pub(super) fn apply(&self, vertices: &mut [DVec3], weights: &[f64]) {
        for (target, weight) in self.targets.iter().zip(weights) {
            let Some(target) = target.filter(|_| *weight != 0.0) else { continue };
            for (vertex, displacement) in vertices.iter_mut().zip(target.vectors()) {
                *vertex += *weight * DVec3::from(displacement.map(f64::from));
            }
        }
    }
}
