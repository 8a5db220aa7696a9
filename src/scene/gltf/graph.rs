use super::Reason;
use super::notes::label;
use crate::scene::names::clean;
use glam::{DAffine3, DMat3, DVec3};
use gltf::json::Root;
use gltf::json::scene::Node;

/// A node where it stands in the world.
pub(super) struct Placed<'a> {
    pub index: usize,
    pub node: &'a Node,
    /// Local to world, in f64 all along the chain of parents.
    pub to_world: DAffine3,
}

impl Placed<'_> {
    /// How messages call it.
    pub fn label(&self) -> String {
        label("node", self.index, self.node.name.as_deref())
    }

    /// Its name, else its number.
    pub fn name(&self) -> String {
        match &self.node.name {
            Some(name) if !name.is_empty() => clean(name),
            _ => format!("node {}", self.index),
        }
    }

    /// Where its origin is.
    pub fn position(&self) -> DVec3 {
        self.to_world.translation
    }

    /// Its axes in the world, of length 1 and square to each other: what shines along −Z does so from there, mirrored where the
    /// node is.
    pub fn upright(&self) -> Result<DMat3, Reason> {
        let axes = self.to_world.matrix3;
        let back = -self.forward()?;
        let right = (axes.x_axis - axes.x_axis.dot(back) * back).try_normalize();
        let right =
            right.ok_or_else(|| format!("{} is scaled to nothing across; give it a scale", self.label()))?;
        let up = back.cross(right) * axes.determinant().signum();
        Ok(DMat3::from_cols(right, up, back))
    }

    /// The unit direction of its local −Z, along which cameras look and lights shine.
    pub fn forward(&self) -> Result<DVec3, Reason> {
        (-self.to_world.matrix3.z_axis)
            .try_normalize()
            .ok_or_else(|| format!("{} is scaled to nothing along its axis; give it a scale", self.label()))
    }
}

/// All nodes under `roots`, parents before children, siblings in the order of the file; `to_parent` is of each node of
/// the file. Not recursive: the file may be deep, and it may hold a cycle.
pub(super) fn place<'a>(
    root: &'a Root,
    to_parent: &[DAffine3],
    roots: &[usize],
) -> Result<Vec<Placed<'a>>, Reason> {
    let mut seen = vec![false; root.nodes.len()];
    let mut placed = Vec::new();
    let mut pending: Vec<_> = roots.iter().rev().map(|index| (*index, DAffine3::IDENTITY)).collect();
    while let Some((index, parent)) = pending.pop() {
        let node =
            root.nodes.get(index).ok_or_else(|| format!("node {index} does not exist; export it again"))?;
        let name = label("node", index, node.name.as_deref());
        if std::mem::replace(&mut seen[index], true) {
            return Err(format!(
                "{name} is reached twice: nodes must form a tree, without cycles and with one parent each; \
                 remove it from one of its parents"
            ));
        }
        let to_world = parent * to_parent[index];
        if !to_world.is_finite() {
            return Err(format!("{name} has a transform that is not finite; give it one"));
        }
        let children = node.children.iter().flatten().rev();
        pending.extend(children.map(|child| (child.value(), to_world)));
        placed.push(Placed { index, node, to_world });
    }
    Ok(placed)
}
