//! What lies on the two sides of a face of glass, where solids of glass lie in, on or across one another.
//!
//! Which medium fills a place depends on the place alone, not on the way by which light came there, so that paths may be
//! walked in both directions. Of all solids that contain the place, the smallest fills it; if there is none, air does. A
//! solid displaces what surrounds it. (Schmidt, Budge 2002, "Simple nested dielectrics in ray traced images", let users order
//! solids by priorities; here size does.) A closed surface whose front faces inward is a bubble of air.
//!
//! The tint of a medium acts where light enters its place and where it leaves it, whichever face lies there. For a liquid
//! that reaches into the wall of its glass, that is the inner face of the wall.
//!
//! Light carries no list of solids. A face asks which of them contain the places just off its two sides, by counting the
//! faces from there to infinity. Faces that coincide lie between the same two places, so whichever is met first acts as the
//! one interface between the two media, and light starts behind both.

use super::touching::{Bounds, touching};
use super::{Hit, Ray, Rays, Tree};
use crate::light::Matrix;
use crate::optics::{Dielectric, Lobe, RoughDielectric, dispersed};
use crate::scene::{Material, Mesh, Scene, SurfacePoint};
use fearless_simd::Level;
use glam::Vec3;
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Solids of glass that have others about them.
pub(super) struct Media {
    solids: Vec<Solid>,
    /// Their triangles alone.
    mesh: Mesh,
    /// These, all of which let lines through.
    rays: Rays,
    /// The solid of each of those.
    solid: Vec<u32>,
    /// By triangle of the scene.
    faces: Vec<Face>,
}

/// A closed surface, or all open surfaces of one material.
#[derive(Clone, Debug)]
struct Solid {
    /// Of its material against air.
    glass: Dielectric,
    /// Of the body, m⁻¹.
    absorption: Vec3,
    dispersion: f32,
    material: u32,
    /// Volume, m³; of open surfaces that of their bounding box, infinity where that is flat.
    size: f64,
    /// Its front looks in.
    bubble: bool,
    bounds: Bounds,
}

/// What is known about a triangle.
enum Face {
    /// It belongs to no solid, or to one that has no others about it.
    Alone,
    /// This one of those triangles, which no other solid touches: the same on all of it, and asked when light first meets it.
    Same(u32, OnceLock<Sides>),
    /// A face of this solid that others touch.
    Ask(u32),
}

/// The solids whose matter is on the two sides of a face of the solid `own`; None: air.
#[derive(Clone, Copy)]
struct Sides {
    outer: Option<u32>,
    inner: Option<u32>,
    own: u32,
}

thread_local! {
    static HITS: RefCell<Vec<Hit>> = const { RefCell::new(Vec::new()) };
}

impl Media {
    /// None where no two solids of glass overlap or touch: each is surrounded by air.
    pub fn of(scene: &Scene, level: Level) -> Option<Self> {
        let (solids, of_surface) = Solid::all(scene);
        let crowded = crowded(&solids);
        crowded.contains(&true).then(|| Self::among(scene, level, solids, &of_surface, &crowded))
    }

    /// The same without leaving out solids that air surrounds.
    pub fn of_all(scene: &Scene, level: Level) -> Self {
        let (solids, of_surface) = Solid::all(scene);
        let all = vec![true; solids.len()];
        Self::among(scene, level, solids, &of_surface, &all)
    }

    fn among(
        scene: &Scene,
        level: Level,
        solids: Vec<Solid>,
        of_surface: &[Option<u32>],
        crowded: &[bool],
    ) -> Self {
        let of_triangle = |triangle: u32| {
            let solid = of_surface[scene.mesh.surface[triangle as usize] as usize]?;
            crowded[solid as usize].then_some(solid)
        };
        let all = 0..scene.mesh.triangles.len() as u32;
        let (triangles, solid): (Vec<u32>, Vec<u32>) =
            all.filter_map(|triangle| Some((triangle, of_triangle(triangle)?))).unzip();
        let mesh = Mesh {
            positions: triangles.iter().flat_map(|&triangle| scene.mesh.corners(triangle)).collect(),
            triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Mesh::default()
        };
        let rays = Rays {
            tree: Tree::build(&mesh, |_| 1),
            straight: vec![Matrix::ZERO, Matrix::IDENTITY],
            through: super::Through::Everything,
            level,
            media: None,
            cover: None,
            absorbs: false,
            disperse: false,
        };
        let bounds: Vec<Bounds> = (0..triangles.len() as u32).map(|i| Bounds::of(mesh.corners(i))).collect();
        let touching = touching(&bounds, &solid);
        let mut faces: Vec<Face> = scene.mesh.triangles.iter().map(|_| Face::Alone).collect();
        for (i, (triangle, touched)) in (0..).zip(triangles.into_iter().zip(touching)) {
            faces[triangle as usize] =
                if touched { Face::Ask(solid[i as usize]) } else { Face::Same(i, OnceLock::new()) };
        }
        Self { solids, mesh, rays, solid, faces }
    }

    /// `glass`, a face's own against air, as the interface that it is at `point` for light of one colour; None: for all alike.
    pub fn interface(&self, glass: Dielectric, point: &SurfacePoint, colour: Option<usize>) -> Dielectric {
        self.sides(point).map_or(glass, |sides| self.between(sides, colour))
    }

    /// What absorbs on the side of the unit vector `out` of a face of glass, m⁻¹; `own`: what its material does behind it.
    pub fn absorption(&self, own: Vec3, point: &SurfacePoint, out: Vec3) -> Vec3 {
        let front = point.normals.is_front(out);
        match self.sides(point) {
            Some(Sides { outer, inner, .. }) => {
                let there = if front { outer } else { inner }.map(|solid| &self.solids[solid as usize]);
                there.filter(|solid| !solid.bubble).map_or(Vec3::ZERO, |solid| solid.absorption)
            }
            None if front => Vec3::ZERO,
            None => own,
        }
    }

    /// The media on the two sides of a face at `point`. None: it has its own behind it and air in front.
    fn sides(&self, point: &SurfacePoint) -> Option<Sides> {
        match &self.faces[point.triangle as usize] {
            Face::Alone => None,
            Face::Same(triangle, sides) => Some(*sides.get_or_init(|| {
                // At its middle, whoever asks first.
                let middle = self.mesh.point(*triangle, 1.0 / 3.0, 1.0 / 3.0, false);
                self.sides_of(self.solid[*triangle as usize], &middle)
            })),
            Face::Ask(solid) => Some(self.sides_of(*solid, point)),
        }
    }

    /// The media on the two sides of a face of the solid `own`.
    fn sides_of(&self, own: u32, point: &SurfacePoint) -> Sides {
        let normal = point.normals.geometric;
        let bubble = self.solids[own as usize].bubble;
        // Which side of its own face a solid is on is not a matter of counting.
        let [outer, inner] = [(normal, bubble), (-normal, !bubble)].map(|(out, own_there)| {
            let mut there = self.containing(point.origin_towards(out), out);
            there.retain(|&known| known != own);
            there.extend(own_there.then_some(own));
            self.displacing(&there)
        });
        Sides { outer, inner, own }
    }

    /// The interface between two media. A hidden face, the same medium on both sides, is no interface.
    fn between(&self, Sides { outer, inner, own }: Sides, colour: Option<usize>) -> Dielectric {
        let solid = &self.solids[own as usize];
        let same_glass = |a: u32, b: u32| {
            let (a, b) = (&self.solids[a as usize], &self.solids[b as usize]);
            if a.bubble || b.bubble { a.bubble == b.bubble } else { a.material == b.material }
        };
        if outer == inner || outer.zip(inner).is_some_and(|(a, b)| same_glass(a, b)) {
            return Dielectric { ior: 1.0, tint: Vec3::ONE };
        }
        let index =
            |medium: Option<u32>| medium.map_or(1.0, |solid| self.solids[solid as usize].index(colour));
        // A bubble in nothing: its own glass is around it.
        let around = if solid.bubble && inner.is_none() { solid.own_index(colour) } else { index(inner) };
        Dielectric { ior: around / index(outer), tint: self.filter(outer, inner) }
    }

    /// What light is filtered by on its way between two media: by the matter of both, of whichever solid the face is that
    /// lies between them. A bubble in its own glass is the hollow of that glass, not matter of its own.
    fn filter(&self, outer: Option<u32>, inner: Option<u32>) -> Vec3 {
        let matter = |medium: u32| &self.solids[medium as usize];
        match (outer.map(matter), inner.map(matter)) {
            (Some(outer), Some(inner)) if outer.material == inner.material => outer.glass.tint,
            (outer, inner) => outer.iter().chain(&inner).map(|solid| solid.glass.tint).product(),
        }
    }

    /// The solids that contain a place: those of whose faces a line to infinity meets more backs than fronts.
    fn containing(&self, place: Vec3, direction: Vec3) -> Vec<u32> {
        HITS.with_borrow_mut(|hits| {
            self.rays.crossings(&Ray { origin: place, direction, t_max: f32::INFINITY }, hits);
            let step = |hit: &Hit| (self.solid[hit.triangle as usize], if hit.back { 1 } else { -1 });
            let mut steps: Vec<(u32, i32)> = hits.iter().map(step).collect();
            steps.sort_unstable();
            let within = |steps: &[(u32, i32)]| {
                let (solid, count) = (steps[0].0, steps.iter().map(|step| step.1).sum::<i32>());
                let inside = if self.solids[solid as usize].bubble { count < 0 } else { count > 0 };
                inside.then_some(solid)
            };
            steps.chunk_by(|a, b| a.0 == b.0).filter_map(within).collect()
        })
    }

    /// Of the solids at a place the one whose matter is there.
    fn displacing(&self, there: &[u32]) -> Option<u32> {
        let size = |solid: &u32| self.solids[*solid as usize].size;
        there.iter().copied().min_by(|a, b| size(a).total_cmp(&size(b)).then(a.cmp(b)))
    }
}

impl Solid {
    /// All of them, and which one each surface belongs to.
    fn all(scene: &Scene) -> (Vec<Self>, Vec<Option<u32>>) {
        let mut solids: Vec<Self> = Vec::new();
        let mut open: HashMap<u32, u32> = HashMap::new();
        let of_surface: Vec<Option<u32>> = scene
            .surfaces
            .iter()
            .map(|surface| {
                let material = &scene.materials[surface.material as usize];
                let glass = material.bsdf.terms.iter().find_map(|term| match term.lobe {
                    Lobe::Dielectric(glass) => Some(glass),
                    Lobe::RoughDielectric(RoughDielectric { ior, tint, .. }) => {
                        Some(Dielectric { ior, tint })
                    }
                    _ => None,
                })?;
                // Where matter meets other glass its colour is the mean of its pattern.
                let tint = material.pattern.as_ref().map_or(glass.tint, |pattern| pattern.mean_base());
                let glass = Dielectric { tint, ..glass };
                let mut add = || {
                    let material = surface.material;
                    let Material { absorption, dispersion, .. } = scene.materials[material as usize];
                    let (size, bounds, bubble) = (0.0, Bounds::EMPTY, false);
                    solids.push(Self { glass, absorption, dispersion, material, size, bubble, bounds });
                    solids.len() as u32 - 1
                };
                Some(if surface.closed { add() } else { *open.entry(surface.material).or_insert_with(add) })
            })
            .collect();
        // Volumes relative to a place on the solid itself, so that one far from zero loses nothing.
        let mut measured: Vec<Option<(Vec3, f64)>> = vec![None; solids.len()];
        for (triangle, &surface) in (0..).zip(&scene.mesh.surface) {
            let Some(index) = of_surface[surface as usize] else { continue };
            let corners = scene.mesh.corners(triangle);
            solids[index as usize].bounds.add(Bounds::of(corners));
            let (place, volume) = measured[index as usize].get_or_insert((corners[0], 0.0));
            let [a, b, c] = corners.map(|corner| (corner - *place).as_dvec3());
            *volume += a.dot(b.cross(c)) / 6.0;
        }
        let open: Vec<u32> = open.into_values().collect();
        for (index, (solid, measured)) in (0..).zip(solids.iter_mut().zip(measured)) {
            let volume = measured.map_or(0.0, |(_, volume)| volume);
            if open.contains(&index) {
                let volume = solid.bounds.volume();
                solid.size = if volume > 0.0 { volume } else { f64::INFINITY };
            } else {
                (solid.size, solid.bubble) = (volume.abs(), volume < 0.0);
            }
        }
        (solids, of_surface)
    }

    /// The refractive index within.
    fn index(&self, colour: Option<usize>) -> f32 {
        if self.bubble { 1.0 } else { self.own_index(colour) }
    }

    /// That of its material.
    fn own_index(&self, colour: Option<usize>) -> f32 {
        dispersed(self.glass.ior, self.dispersion, colour)
    }
}

/// Which solids have others about them: their boxes meet.
fn crowded(solids: &[Solid]) -> Vec<bool> {
    let bounds: Vec<Bounds> = solids.iter().map(|solid| solid.bounds).collect();
    touching(&bounds, &(0..solids.len() as u32).collect::<Vec<u32>>())
}
