//! Matter that is there only in part: what goes straight through it depends on where it is met.

use super::Hit;
use crate::light::Matrix;
use crate::scene::texture::Inputs;
use crate::scene::{Material, Scene};
use glam::{Vec2, Vec4};
use std::collections::HashMap;

/// Triangles whose material has holes, or is thinner in some places than in others.
pub(super) struct Cover {
    /// By class of triangles: its material, where that is one of them.
    materials: Vec<Option<Material>>,
    /// What looks their coverage up.
    corners: HashMap<u32, [Corner; 3]>,
}

/// What a vertex has that textures are looked up by.
#[derive(Clone, Copy)]
struct Corner {
    uvs: [Vec2; 2],
    colour: Vec4,
}

impl Cover {
    /// `materials`: by class. None where all that is there is there as a whole.
    pub fn of(scene: &Scene, materials: Vec<Option<Material>>, class: impl Fn(u32) -> u32) -> Option<Self> {
        if materials.iter().all(Option::is_none) {
            return None;
        }
        let mesh = &scene.mesh;
        let of = |vertex: u32| {
            let vertex = vertex as usize;
            let uv = |set: usize| mesh.uvs[set].get(vertex).copied().unwrap_or_default();
            let colour = mesh.colours.get(vertex).copied().unwrap_or(Vec4::ONE);
            Corner { uvs: [uv(0), uv(1)], colour }
        };
        let covers = |triangle: &u32| materials[class(*triangle) as usize].is_some();
        let triangles = (0..mesh.triangles.len() as u32).filter(covers);
        let corners =
            triangles.map(|triangle| (triangle, mesh.triangles[triangle as usize].map(of))).collect();
        Some(Self { materials, corners })
    }

    /// What goes straight through where a line meets a triangle of this class. None: the same wherever it is met.
    #[inline]
    pub fn straight(&self, hit: &Hit, class: u32) -> Option<Matrix> {
        let material = self.materials[class as usize].as_ref()?;
        let corners = self.corners.get(&hit.triangle)?;
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let uvs = [0, 1].map(|set| corners.iter().zip(weights).map(|(corner, w)| w * corner.uvs[set]).sum());
        let colour = corners.iter().zip(weights).map(|(corner, w)| w * corner.colour).sum();
        Some(material.straight_at(&Inputs { uvs, colour, ..Inputs::default() }))
    }
}
