//! Rays against the scene: closest hit, all hits in order, transmittance.
//!
//! obvhs builds the tree. It is traversed here, eight boxes or triangles at a time, because obvhs' own traversal and
//! triangle tests leak at edges. A line that meets an edge or a corner shared by triangles crosses exactly one of them;
//! triangles without area are never hit, others from both sides. There is no distance in world units: scenes may be as small
//! or as large as f32 allows, and a crossing is a hit if its t, computed in f64, is > 0.

mod build;
mod cover;
mod exact;
mod leaf;
mod line;
mod media;
mod node;
mod segment;
#[cfg(test)]
mod tests;
mod touching;
mod visit;
mod walk;
mod widen;

use crate::light::Matrix;
use crate::optics::{Dielectric, Lobe, RoughDielectric, dispersed};
use crate::scene::{Backs, Material, MatterAt, Scene, SurfacePoint};
use build::Tree;
use cover::Cover;
use fearless_simd::{Level, dispatch};
use glam::Vec3;
use line::Line;
use media::Media;
pub use segment::Segment;
use std::cell::RefCell;
use visit::{Any, Closest, Passed, Product, Seen, UpToBlocker};
use walk::{Visit, walk};

/// One colour of light that carries so much of each, chosen in proportion, and the filter that leaves it alone and makes up for the
/// others. Light that has but one colour left is not asked.
fn one_colour(carried: Vec3, u: impl FnOnce() -> f32) -> (usize, Vec3) {
    let sum = carried.element_sum();
    if let Some(only) = (0..3).find(|colour| carried[*colour] == sum) {
        return (only, Vec3::ONE);
    }
    let mut rest = u() * sum;
    let chosen = (0..3).find(|colour| {
        rest -= carried[*colour];
        rest < 0.0
    });
    // Rounding may leave a rest after the last.
    let colour = chosen.unwrap_or_else(|| carried.max_position());
    let mut filter = Vec3::ZERO;
    filter[colour] = sum / carried[colour];
    (colour, filter)
}

/// What is left of light that goes `distance` (m) through what absorbs it: Beer's and Lambert's law, for each colour.
#[inline]
pub fn left_of(absorption: Vec3, distance: f32) -> Vec3 {
    // A colour that nothing absorbs comes from infinity too.
    absorption.map(|absorption| if absorption == 0.0 { 1.0 } else { (-absorption * distance).exp() })
}

/// A half-line or segment: points `origin + t * direction` with 0 < t < `t_max`.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, scene space (m).
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Exclusive end, m; infinity for a half-line.
    pub t_max: f32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, m, > 0.
    pub t: f32,
    /// Index into the mesh.
    pub triangle: u32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
    /// The ray meets the triangle's back.
    pub back: bool,
}

/// The class of triangles that let nothing straight through.
const BLOCKER: u32 = 0;
/// Set in the class of triangles whose backs the eye does not meet.
const UNSEEN: u32 = 1 << 31;

/// What goes straight through the scene's triangles, taken together.
enum Through {
    /// Nothing, through any of them.
    Nothing,
    /// Everything, through all of them.
    Everything,
    /// Diagonal matrices: their order does not matter.
    Diagonal,
    /// Anything: matrices multiply in order.
    Ordered,
}

/// The scene's triangles, indexed for rays.
pub struct Rays {
    tree: Tree,
    /// The distinct straight matrices; [`BLOCKER`] is zero.
    straight: Vec<Matrix>,
    through: Through,
    level: Level,
    /// None: air surrounds every solid of glass.
    media: Option<Box<Media>>,
    /// None: what goes straight through a triangle is the same all over it.
    cover: Option<Box<Cover>>,
    /// Some body absorbs light on its way.
    absorbs: bool,
    /// Some glass spreads colours.
    disperse: bool,
}

thread_local! {
    static HITS: RefCell<Vec<Hit>> = const { RefCell::new(Vec::new()) };
    static SCRATCH: RefCell<Scratch> = const { RefCell::new(Scratch { stack: Vec::new(), passed: Vec::new() }) };
}

/// What a query needs and the next one can use again.
struct Scratch {
    stack: Vec<u64>,
    passed: Vec<((f32, bool, u32), Matrix)>,
}

impl Rays {
    /// Builds the index over all triangles of the scene; `O(n log n)`.
    pub fn build(scene: &Scene) -> Self {
        Self::build_at(scene, Level::new())
    }

    fn build_at(scene: &Scene, level: Level) -> Self {
        let (mut straight, mut partial) = (vec![Matrix::ZERO], vec![None]);
        let class_of_material: Vec<u32> = scene
            .materials
            .iter()
            .map(|material| {
                let (matrix, varies) = (material.bsdf.straight, material.has_holes());
                let alike = |i: usize| straight[i] == matrix && !varies && partial[i].is_none();
                let known = (0..straight.len()).find(|i| alike(*i));
                known.unwrap_or_else(|| {
                    straight.push(matrix);
                    partial.push(varies.then(|| material.clone()));
                    straight.len() - 1
                }) as u32
            })
            .collect();
        let backs = |material: &Material| match material.backs {
            Backs::Seen => 0,
            Backs::Unseen => UNSEEN,
        };
        let class_of_surface: Vec<u32> = scene
            .surfaces
            .iter()
            .map(|surface| surface.material as usize)
            .map(|material| class_of_material[material] | backs(&scene.materials[material]))
            .collect();
        let class = |triangle: u32| class_of_surface[scene.mesh.surface[triangle as usize] as usize];
        let mut seen = vec![false; straight.len()];
        (0..scene.mesh.triangles.len() as u32)
            .for_each(|triangle| seen[(class(triangle) & !UNSEEN) as usize] = true);
        let present = || straight.iter().zip(&seen).filter(|(_, seen)| **seen).map(|(matrix, _)| *matrix);
        let through = if present().all(Matrix::is_zero) {
            Through::Nothing
        } else if present().all(|matrix| matrix == Matrix::IDENTITY) {
            Through::Everything
        } else if present().all(Matrix::is_diagonal) {
            Through::Diagonal
        } else {
            Through::Ordered
        };
        let media = Media::of(scene, level).map(Box::new);
        let solids = || {
            let materials = scene.surfaces.iter().map(|surface| &scene.materials[surface.material as usize]);
            materials.filter(|material| material.is_solid())
        };
        let absorbs = solids().any(|material| material.absorption != Vec3::ZERO);
        let disperse = solids().any(|material| material.dispersion > 0.0);
        let cover = Cover::of(scene, partial, |triangle| class(triangle) & !UNSEEN).map(Box::new);
        let tree = Tree::build(&scene.mesh, class);
        Self { tree, straight, through, level, media, cover, absorbs, disperse }
    }

    /// The same index that also asks about the surroundings of solids that nothing but air surrounds.
    pub fn keeping_media(self, scene: &Scene) -> Self {
        Self { media: Some(Box::new(Media::of_all(scene, self.level))), ..self }
    }

    /// True where solids of glass lie in, on or across one another.
    pub fn has_media(&self) -> bool {
        self.media.is_some()
    }

    /// A lobe of the face at `point` as it is there: glass refracts between the media on its two sides.
    #[inline(always)]
    pub fn lobe_at(&self, lobe: Lobe, point: &SurfacePoint) -> Lobe {
        match (&self.media, lobe) {
            (Some(media), Lobe::Dielectric(glass)) => Lobe::Dielectric(media.interface(glass, point, None)),
            (Some(media), Lobe::RoughDielectric(RoughDielectric { ior, alpha, tint })) => {
                let Dielectric { ior, tint } = media.interface(Dielectric { ior, tint }, point, None);
                Lobe::RoughDielectric(RoughDielectric { ior, alpha, tint })
            }
            _ => lobe,
        }
    }

    /// The same for light of which each colour carries `carried`. Rough glass spreads no colours. Where its colours part, one of them goes on for all: the lobe is that of
    /// the one that `u` in [0, 1) chooses, and the filter makes up for the others.
    #[inline(always)]
    pub fn lobe_for(
        &self,
        lobe: Lobe,
        material: &Material,
        point: &SurfacePoint,
        carried: impl FnOnce() -> Vec3,
        u: impl FnOnce() -> f32,
    ) -> (Lobe, Vec3) {
        if !self.disperses(material) || !matches!(lobe, Lobe::Dielectric(_)) {
            return (self.lobe_at(lobe, point), Vec3::ONE);
        }
        let carried = carried();
        let (colour, filter) = one_colour(carried, u);
        (self.lobe_of_colour(lobe, material, point, colour), filter)
    }

    /// True where a face of glass refracts colours in ways of their own.
    #[inline(always)]
    fn disperses(&self, material: &Material) -> bool {
        // Where solids touch, the glass that disperses may be on the other side.
        self.disperse && (material.dispersion > 0.0 || self.media.is_some())
    }

    /// The same for light of one colour (0 red, 1 green, 2 blue), as the glass of `material` refracts it.
    pub fn lobe_of_colour(
        &self,
        lobe: Lobe,
        material: &Material,
        point: &SurfacePoint,
        colour: usize,
    ) -> Lobe {
        match (&self.media, lobe) {
            (Some(media), Lobe::Dielectric(glass)) => {
                let own =
                    Dielectric { ior: dispersed(glass.ior, material.dispersion, Some(colour)), ..glass };
                Lobe::Dielectric(media.interface(own, point, Some(colour)))
            }
            (None, Lobe::Dielectric(glass)) => Lobe::Dielectric(Dielectric {
                ior: dispersed(glass.ior, material.dispersion, Some(colour)),
                ..glass
            }),
            _ => self.lobe_at(lobe, point),
        }
    }

    /// True where some body absorbs light on its way.
    pub fn absorb(&self) -> bool {
        self.absorbs
    }

    /// What absorbs light on the side of the unit vector `out` of a surface, m⁻¹. None: what is there is on both sides of it, or
    /// nothing absorbs anywhere.
    #[inline(always)]
    pub fn absorption_towards(&self, material: &Material, point: &SurfacePoint, out: Vec3) -> Option<Vec3> {
        if !self.absorbs || !material.is_solid() {
            return None;
        }
        Some(match &self.media {
            Some(media) => media.absorption(material.absorption, point, out),
            None if point.normals.is_front(out) => Vec3::ZERO,
            None => material.absorption,
        })
    }

    /// What light that travels a [`Segment`] from its far end to its origin is multiplied by: the ordered product of the straight
    /// matrices, and what is left of each colour where `absorption` (m⁻¹) is that at the origin.
    pub fn passed(&self, scene: &Scene, segment: &Segment, absorption: Vec3) -> (Matrix, Vec3) {
        if !self.absorbs {
            return (self.transmittance(segment), Vec3::ONE);
        }
        HITS.with_borrow_mut(|hits| self.passed_by(scene, segment, absorption, hits, |_| ()))
    }

    /// The same, crossing by crossing: `met` is shown the matter of each, as far as anything comes through; `hits` is for use.
    ///
    /// What absorbs is a matter of the place alone: also for light that goes straight into a body.
    pub fn passed_by(
        &self,
        scene: &Scene,
        segment: &Segment,
        absorption: Vec3,
        hits: &mut Vec<Hit>,
        mut met: impl FnMut(&Material),
    ) -> (Matrix, Vec3) {
        let (length, direction) = (segment.length() as f32, segment.direction());
        self.crossings(segment, hits);
        let (mut matrix, mut left) = (Matrix::IDENTITY, Vec3::ONE);
        let (mut absorption, mut before) = (absorption, 0.0);
        for hit in hits.iter() {
            let MatterAt { material, bsdf, point, .. } = scene.matter_at(hit.triangle, hit.u, hit.v, 0.0);
            matrix = matrix * bsdf.straight;
            met(material);
            if matrix.is_zero() {
                return (matrix, Vec3::ZERO);
            }
            left *= left_of(absorption, (hit.t - before) * length);
            absorption = self.absorption_towards(material, &point, direction).unwrap_or(absorption);
            before = hit.t;
        }
        (matrix, left * left_of(absorption, (segment.end as f32 - before) * length))
    }

    /// The same index, whose answers are found as if anything might go through any surface.
    #[must_use]
    pub fn without_shortcuts(self) -> Self {
        Self { through: Through::Ordered, ..self }
    }

    /// What the index takes in memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.tree.nodes[..]) + size_of_val(&self.tree.blocks[..])
    }

    /// The first triangle that the ray meets.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.query(&ray.into(), Closest::new(ray.t_max)).finish()
    }

    /// The first triangle that the eye meets along the ray: backs that are [`Backs::Unseen`] are not there.
    pub fn closest_seen(&self, ray: &Ray) -> Option<Hit> {
        self.query(&ray.into(), Seen(Closest::new(ray.t_max))).0.finish()
    }

    /// All triangles that the eye meets along the ray, as [`crossings`](Self::crossings).
    pub fn crossings_seen(&self, ray: &Ray, hits: &mut Vec<Hit>) {
        hits.clear();
        match self.through {
            Through::Nothing => hits.extend(self.closest_seen(ray)),
            _ => self
                .query(&ray.into(), Seen(UpToBlocker::new(ray.t_max, self.cover.as_deref(), hits)))
                .0
                .finish(),
        }
    }

    /// All triangles along a [`Ray`] or [`Segment`] in order of (t, front before back, triangle), up to and including the
    /// first that lets nothing straight through.
    #[inline]
    pub fn crossings(&self, along: impl Into<Segment>, hits: &mut Vec<Hit>) {
        hits.clear();
        let segment = along.into();
        let t_max = segment.end as f32;
        match self.through {
            Through::Nothing => hits.extend(self.query(&segment, Closest::new(t_max)).finish()),
            _ => self.query(&segment, UpToBlocker::new(t_max, self.cover.as_deref(), hits)).finish(),
        }
    }

    /// True when any triangle lies on a [`Ray`] or [`Segment`].
    #[inline]
    pub fn occluded(&self, along: impl Into<Segment>) -> bool {
        let segment = along.into();
        self.query(&segment, Any { t_max: segment.end as f32, found: false }).found
    }

    /// What light that travels a [`Ray`] or [`Segment`] from its *far* end to its origin is multiplied by: the ordered
    /// product of the straight matrices.
    #[inline]
    pub fn transmittance(&self, along: impl Into<Segment>) -> Matrix {
        self.product_along(&along.into())
    }

    fn product_along(&self, segment: &Segment) -> Matrix {
        let t_max = segment.end as f32;
        let straight = &self.straight;
        match self.through {
            Through::Nothing => {
                if self.occluded(segment) {
                    Matrix::ZERO
                } else {
                    Matrix::IDENTITY
                }
            }
            Through::Everything => Matrix::IDENTITY,
            Through::Diagonal => {
                self.query(
                    segment,
                    Product { t_max, straight, cover: self.cover.as_deref(), product: Matrix::IDENTITY },
                )
                .product
            }
            Through::Ordered => SCRATCH.with_borrow_mut(|Scratch { stack, passed }| {
                passed.clear();
                let visit = Passed { t_max, straight, cover: self.cover.as_deref(), passed, blocked: false };
                self.query_with(stack, segment, visit).product()
            }),
        }
    }

    #[inline(always)]
    fn query<V: Visit>(&self, segment: &Segment, visit: V) -> V {
        SCRATCH.with_borrow_mut(|scratch| self.query_with(&mut scratch.stack, segment, visit))
    }

    #[inline(always)]
    fn query_with<V: Visit>(&self, stack: &mut Vec<u64>, segment: &Segment, mut visit: V) -> V {
        if stack.len() < self.tree.stack {
            stack.resize(self.tree.stack, 0);
        }
        let visit_ref = &mut visit;
        dispatch!(self.level, simd => {
            let line = Line::new(segment);
            walk(simd, &self.tree, &line, stack, visit_ref);
        });
        visit
    }
}
