//! Where surfaces end: the true area within a gather disk.
//!
//! Density estimation divides photon power by the area it fell on. Within a gather radius of a rim, part of the disk lies
//! beyond the surface; dividing by the whole disk would draw a dark line along every edge of a room. The area of the surface
//! within the disk follows from its rims alone, by Green's theorem: π r² + Σ over rims of ½ (A × B − r² ∠AB), where A, B are
//! the ends of the part of the rim that lies within the disk, seen from its centre, with the surface on their left. Rims of
//! coplanar pieces that merely abut cancel.

mod edges;
mod tangent;

use crate::scene::Scene;
use edges::{Edges, Joined, weld};
use glam::{Vec2, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;
use std::collections::HashMap;
use std::f32::consts::PI;
use std::time::Duration;
pub use tangent::Tangent;

/// A photon counts on its own side of a surface only: where its normal is within about 60° of that of the point.
/// Any cosine in (0, 1) gives the same limit as the radius shrinks; this one keeps curved surfaces whole and tells the
/// two walls of a corner apart. An edge that bends more than this is a rim.
pub const SAME_SIDE_COSINE: f32 = 0.5;
/// And near the tangent plane only: within this share of the radius. A surface of curvature radius R leaves it at
/// gather radii above R / 2; the limit, again, does not depend on it.
pub const PLANE_SHARE: f32 = 0.25;

/// One edge at which a surface that takes photons ends, or bends too far.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rim {
    /// From here …
    a: Vec3,
    /// … to here the surface lies on the left, seen from the tip of its normal.
    b: Vec3,
    /// Unit normal of the surface.
    normal: Vec3,
    /// True where photons count on the back too.
    two_sided: bool,
    /// How many equal rims this stands for.
    count: f32,
    /// Of which connected surface.
    sheet: u32,
}

/// The rims of a scene, indexed.
pub struct Rims {
    /// Those that fill the same box one behind the other.
    rims: Vec<Rim>,
    /// Where those of each distinct box start, and the end: the builder of the tree takes O(n²) for n equal boxes, as of a fan of
    /// leaves on one stem.
    starts: Vec<u32>,
    tree: Option<Bvh2>,
    sheets: Vec<u32>,
}

impl Rims {
    /// The sheet of triangles that take no photons.
    pub const NO_SHEET: u32 = u32::MAX;

    /// No rims: every disk is whole.
    pub fn none() -> Self {
        Self { rims: Vec::new(), starts: vec![0], tree: None, sheets: Vec::new() }
    }

    /// By triangle: which connected surface it belongs to, one that nowhere bends more than a rim does. Each may be taken once.
    pub fn take_sheets(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.sheets)
    }

    /// The rims of all surfaces whose material (by index) takes photons.
    pub fn of(scene: &Scene, takes_photons: &[bool]) -> Self {
        let (rims, sheets) = find(scene, takes_photons);
        let mut rims = merge_equal(rims);
        let corners = |rim: &Rim| [rim.a.min(rim.b), rim.a.max(rim.b)];
        let key = |rim: &Rim| corners(rim).map(|corner| (corner + Vec3::ZERO).to_array().map(f32::to_bits));
        rims.sort_by_cached_key(key);
        let (mut boxes, mut starts) = (Vec::new(), vec![0]);
        for group in rims.chunk_by(|a, b| key(a) == key(b)) {
            let [min, max] = corners(&group[0]);
            boxes.push(Aabb::new(min.into(), max.into()));
            starts.push(starts[starts.len() - 1] + group.len() as u32);
        }
        let tree = (!boxes.is_empty())
            .then(|| build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut Duration::default()));
        Self { rims, starts, tree, sheets }
    }

    /// How many rims.
    pub fn len(&self) -> usize {
        self.rims.len()
    }

    /// What they take in memory.
    pub fn bytes(&self) -> usize {
        let tree = |tree: &Bvh2| size_of_val(&tree.nodes[..]) + size_of_val(&tree.primitive_indices[..]);
        size_of_val(&self.rims[..]) + size_of_val(&self.starts[..]) + self.tree.as_ref().map_or(0, tree)
    }

    /// True when no surface ends.
    pub fn is_empty(&self) -> bool {
        self.rims.is_empty()
    }

    /// The area (m²) of the surface within `radius` of `position`, seen from the side of `normal`.
    pub fn area(&self, position: Vec3, normal: Vec3, radius: f32) -> f32 {
        let mut near = Vec::new();
        self.near(position, radius, &mut near);
        let [area] = self.areas(&near, position, normal, [radius]);
        area
    }

    /// The rims, by index, that may cut a disk of `radius` (m) about `position` or a smaller one within it.
    pub fn near(&self, position: Vec3, radius: f32, near: &mut Vec<u32>) {
        near.clear();
        let Some(tree) = &self.tree else { return };
        let reach = Aabb::new((position - radius).into(), (position + radius).into());
        tree.aabb_traverse(reach, |tree, node| {
            let node = &tree.nodes[node as usize];
            let slots = node.first_index..node.first_index + node.prim_count;
            for group in slots.map(|slot| tree.primitive_indices[slot as usize] as usize) {
                near.extend(self.starts[group]..self.starts[group + 1]);
            }
            true
        });
    }

    /// True where one of the rims `near` parts a triangle from the disk: the `way` (m, in the disk's frame) to it crosses an edge of the
    /// disk's own sheet, and all of it lies beyond that edge, but for a `tolerance` (m).
    pub fn parts(
        &self,
        near: &[u32],
        disk: &Tangent,
        way: Vec3,
        corners: &[Vec3; 3],
        tolerance: f32,
    ) -> bool {
        let way = way.truncate();
        near.iter().map(|rim| &self.rims[*rim as usize]).any(|rim| {
            let cos = rim.normal.dot(disk.normal);
            if rim.sheet != disk.sheet || cos.abs() <= SAME_SIDE_COSINE {
                return false;
            }
            let [a, b] = [rim.a, rim.b].map(|end| disk.flat(end).truncate());
            let along = (b - a).normalize_or_zero();
            // The surface lies on the left, seen from the tip of its normal.
            let outward = -cos.signum() * along.perp();
            let beyond = |p: Vec2| (p - a).dot(outward) >= -tolerance;
            let crossed = || {
                let (to_way, to_middle) = ((way - a).dot(outward), -a.dot(outward));
                // Where the straight way from the middle meets the line of the edge.
                let share = if to_way == to_middle { 1.0 } else { to_middle / (to_middle - to_way) };
                let place = (way * share.clamp(0.0, 1.0) - a).dot(along);
                (-tolerance..=(b - a).length() + tolerance).contains(&place)
            };
            beyond(way) && corners.iter().all(|corner| beyond(disk.flat(*corner).truncate())) && crossed()
        })
    }

    /// The areas (m²) of the surface within each of the radii of `position`, seen from the side of `normal`; `near` are the rims
    /// that may [matter](Self::near).
    ///
    /// Right for flat surfaces with rims of any shape; curved ones are taken by their tangent plane. Where rounding
    /// leaves nothing, at the very tip of a surface, the whole disk stands in: its bias, too, shrinks with the radius.
    pub fn areas<const N: usize>(
        &self,
        near: &[u32],
        position: Vec3,
        normal: Vec3,
        radii: [f32; N],
    ) -> [f32; N] {
        let whole = radii.map(|radius| PI * radius * radius);
        let widest = radii.into_iter().fold(0.0, f32::max);
        let mut beyond = [0.0; N];
        let (right, up) = normal.any_orthonormal_pair();
        let flat = |p: Vec3| Vec3::new(p.dot(right), p.dot(up), p.dot(normal));
        for &rim in near {
            let rim = &self.rims[rim as usize];
            let cos = rim.normal.dot(normal);
            if cos.abs() <= SAME_SIDE_COSINE || (cos < 0.0 && !rim.two_sided) {
                continue;
            }
            let [a, b] = [flat(rim.a - position), flat(rim.b - position)];
            // Most rims are near, but so far away that they do not cut even the widest disk.
            let (way, from) = ((b - a).truncate(), a.truncate());
            if from.perp_dot(way).powi(2) >= widest * widest * way.length_squared() {
                continue;
            }
            for (beyond, radius) in beyond.iter_mut().zip(radii) {
                if let Some([a, b]) = within_slab(a, b, PLANE_SHARE * radius) {
                    *beyond += rim.count * cos.signum() * cut(a, b, radius);
                }
            }
        }
        std::array::from_fn(|i| {
            let area = whole[i] + beyond[i];
            // A billionth of the disk is below what its f32 terms can tell from nothing.
            if area > 1e-6 * whole[i] { area } else { whole[i] }
        })
    }
}

/// ½ (A × B − r² ∠AB) of the part of the segment that lies in the disk of radius r about zero; zero where none does.
#[inline(always)]
fn cut(a: Vec2, b: Vec2, r: f32) -> f32 {
    let way = b - a;
    let (qa, qb, qc) = (way.length_squared(), a.dot(way), a.length_squared() - r * r);
    let discriminant = qb * qb - qa * qc;
    if qa == 0.0 || discriminant <= 0.0 {
        return 0.0;
    }
    let root = discriminant.sqrt();
    let (from, to) = (((-qb - root) / qa).max(0.0), ((-qb + root) / qa).min(1.0));
    if from >= to {
        return 0.0;
    }
    // An end that lies within is taken as it is: near it angles are sensitive to rounding.
    let at = |share: f32| if share == 1.0 { b } else { a + share * way };
    let (a, b) = (at(from), at(to));
    let cross = a.perp_dot(b);
    0.5 * (cross - r * r * cross.atan2(a.dot(b)))
}

/// The part of a segment within `half` of the plane z = 0.
#[inline(always)]
fn within_slab(a: Vec3, b: Vec3, half: f32) -> Option<[Vec2; 2]> {
    if a.z.abs() <= half && b.z.abs() <= half {
        return Some([a.truncate(), b.truncate()]);
    }
    let at = |level: f32| (level - a.z) / (b.z - a.z);
    let (low, high) = (at(-half).min(at(half)).max(0.0), at(-half).max(at(half)).min(1.0));
    (low < high).then(|| [low, high].map(|share| (a + share * (b - a)).truncate()))
}

/// Edges without a neighbour that goes on within [`SAME_SIDE_COSINE`], in the order of triangles; and which triangles neighbours join,
/// by triangle.
fn find(scene: &Scene, takes_photons: &[bool]) -> (Vec<Rim>, Vec<u32>) {
    let mesh = &scene.mesh;
    let material = |t: u32| scene.surface_of(t).material as usize;
    let takes: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|t| takes_photons[material(*t)]).collect();
    let normals: Vec<Vec3> = takes.par_iter().map(|t| mesh.normal(*t)).collect();
    let welded = weld(&mesh.positions);
    let sides = |t: &u32| {
        let [a, b, c] = mesh.triangles[*t as usize].map(|i| welded[i as usize]);
        [(a, b), (b, c), (c, a)]
    };
    let edges = Edges::of(mesh.positions.len(), takes.iter().map(sides));
    let (edges, bend) = (&edges, &normals);
    let beside = |normal: Vec3, (from, to): (u32, u32)| {
        edges.between(to, from).filter(move |other| bend[*other as usize].dot(normal) > SAME_SIDE_COSINE)
    };
    // What is there twice is not one surface.
    let single =
        |(from, to): (u32, u32)| edges.between(from, to).count() == 1 && edges.between(to, from).count() == 1;
    let mut joined = Joined::new(takes.len());
    for (t, normal) in (0..).zip(&normals) {
        for side in sides(&takes[t as usize]).into_iter().filter(|side| single(*side)) {
            beside(*normal, side).for_each(|other| joined.join(t, other));
        }
    }
    let sheet_of = joined.names();
    let mut sheets = vec![Rims::NO_SHEET; mesh.triangles.len()];
    for (t, sheet) in takes.iter().zip(&sheet_of) {
        sheets[*t as usize] = *sheet;
    }
    let rims_of = |(t, &normal): (&u32, &Vec3)| {
        let places = mesh.corners(*t);
        let terms = &scene.material_of(*t).bsdf.terms;
        let sheet = sheets[*t as usize];
        let rim = |k: usize| {
            let two_sided = terms.iter().any(|term| term.lobe.is_two_sided());
            Rim { a: places[k], b: places[(k + 1) % 3], normal, two_sided, count: 1.0, sheet }
        };
        let sides = sides(t);
        (0..3).filter(|k| beside(normal, sides[*k]).next().is_none()).map(rim).collect::<Vec<_>>()
    };
    let rims = takes.par_iter().zip(&normals).flat_map_iter(rims_of).collect();
    (rims, sheets)
}

/// Equal rims become one that counts for all: piles of equal boxes would take the tree's builder quadratic time.
fn merge_equal(rims: Vec<Rim>) -> Vec<Rim> {
    let mut seen = HashMap::with_capacity(rims.len());
    let mut merged: Vec<Rim> = Vec::with_capacity(rims.len());
    for rim in rims {
        let key = [rim.a, rim.b, rim.normal].map(|v| v.to_array().map(f32::to_bits));
        let index = *seen.entry((key, rim.two_sided)).or_insert(merged.len());
        match merged.get_mut(index) {
            Some(first) => first.count += 1.0,
            None => merged.push(rim),
        }
    }
    merged
}

#[cfg(test)]
mod tests;
