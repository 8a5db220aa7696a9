//! How wide a gather disk may be: up to where anything but its own surface comes near.
//!
//! Density estimation takes the light that fell on a disk for the light at its middle. That holds where the disk is *simple*: one
//! connected sheet of surface that hardly bends, with nothing standing on it, hanging over it or lying so near behind it that
//! photons of one would count on the other. A cube on a floor, a sheet of paper on a table, the foot of a wall, a bead, a bush: there
//! disks are made smaller, and where even a small one is not simple, camera paths go on instead of reading the map.
//!
//! Whether a disk is simple is a question of geometry alone, so that the answer does not depend on the photons that it is asked for.

mod harm;
mod tree;

use crate::rims::{Rims, Tangent};
use crate::scene::{Scene, SurfacePoint};
use glam::Vec3;
use harm::Ball;
use tree::Tree;

/// Radii that are tried, as shares of the widest. Where a camera path was scattered before all of them serve, as chance adds up over
/// directions there and a few photons are enough; where it was not, the first of them.
const SHARES: [f32; 7] = [1.0, 0.7, 0.5, LEAST_SHARE, 0.25, 0.175, 0.125];
/// So many of them.
const UNSCATTERED: usize = 4;
/// The smallest that serves where the camera looks: below, disks had no less noise than paths that go on.
pub const LEAST_SHARE: f32 = 0.35;

/// How much of a disk may be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reach {
    /// It is simple within this share of its radius.
    Simple(f32),
    /// It is not, however small.
    Crowded,
}

impl Reach {
    /// The smallest disk, simple or not.
    pub const LEAST: Self = Self::Simple(LEAST_SHARE);
}

/// All that stands in a scene, indexed for what is near a disk.
pub struct Clearance {
    tree: Tree,
    /// By triangle; see [`Rims::take_sheets`].
    sheets: Vec<u32>,
}

/// What is known of all disks near a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Even {
    sheet: u32,
    /// All of the sheet there faces about this way. Zero: nothing is known.
    normal: Vec3,
}

/// Normals on an even sheet are within this cosine of one of them: about four degrees.
const EVEN: f32 = 0.9976;

impl Clearance {
    /// Nothing stands anywhere: no photons are read.
    pub fn none() -> Self {
        Self { tree: Tree::none(), sheets: Vec::new() }
    }

    /// Of all matter of the scene. `sheets` says which triangles belong together.
    pub fn of(scene: &Scene, sheets: Vec<u32>) -> Self {
        Self { tree: Tree::of(scene, &sheets), sheets }
    }

    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        self.tree.bytes() + size_of_val(&self.sheets[..])
    }

    /// Of the disk of `radius` (m) about a point, seen from the side of `normal`. `rims` are those that may cut it; `scattered`: a
    /// camera path was scattered before it came there.
    pub fn reach(
        &self,
        scene: &Scene,
        (rims, near): (&Rims, &[u32]),
        (point, normal): (&SurfacePoint, Vec3),
        radius: f32,
        scattered: bool,
    ) -> Reach {
        let Some(&sheet) = self.sheets.get(point.triangle as usize) else { return Reach::Simple(1.0) };
        if sheet == Rims::NO_SHEET {
            return Reach::Crowded;
        }
        let tried = if scattered { SHARES.len() } else { UNSCATTERED };
        let disk = Tangent::new(point.position, normal, sheet);
        let balls = SHARES.map(|share| Ball::new(share * radius));
        let beyond =
            |way: Vec3, corners: &[Vec3; 3], tolerance: f32| rims.parts(near, &disk, way, corners, tolerance);
        let first = self.tree.first_unharmed(scene, &self.sheets, &disk, &balls[..tried], beyond);
        first.map_or(Reach::Crowded, |first| Reach::Simple(SHARES[first]))
    }

    /// What holds for all disks within `reach` (m) of a point, up to radii of `radius`.
    pub fn even(
        &self,
        scene: &Scene,
        (point, normal): (&SurfacePoint, Vec3),
        reach: f32,
        radius: f32,
    ) -> Even {
        let sheet = match self.sheets.get(point.triangle as usize) {
            Some(&sheet) if sheet != Rims::NO_SHEET => sheet,
            _ => return Even::default(),
        };
        let disk = Tangent::new(point.position, normal, sheet);
        let ball = Ball::of_many(reach, radius, EVEN);
        let unharmed = self.tree.first_unharmed(scene, &self.sheets, &disk, &[ball], |_, _, _| false);
        if unharmed.is_some() { Even { sheet, normal } } else { Even::default() }
    }

    /// True where a disk is known to be simple without a look.
    pub fn is_even(&self, even: &Even, point: &SurfacePoint, normal: Vec3) -> bool {
        even.normal.dot(normal) >= EVEN && self.sheets.get(point.triangle as usize) == Some(&even.sheet)
    }

    /// True where nobody asks.
    pub fn is_empty(&self) -> bool {
        self.sheets.is_empty()
    }
}

#[cfg(test)]
mod tests;
