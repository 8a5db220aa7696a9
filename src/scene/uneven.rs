//! Triangles whose material does not shine alike all over become luminaires part by part, each about as bright all over as it is
//! on average: so that light starts where there is some. Within its part every luminaire has the radiance of the point.

use super::part::Part;
use super::texture::Texture;
use super::{Mesh, Pbr};
use crate::light::Light;
use crate::sampling::{hash, warp};
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

/// A part is left whole where the light by which places of it differ is less than this share of all that shines so, by the area:
/// about so many parts make a picture.
const ENOUGH: f32 = 1.0 / 16_384.0;
/// More parts than these are made again, fewer.
const MOST: usize = 1 << 16;
/// Texels of the smallest parts.
const SMALLEST: f32 = 1.0 / 16.0;
/// What vertices say is looked at as if so many texels lay on a triangle.
const TEXELS_OF_VERTICES: f32 = 64.0;
/// Fewest places that a part is looked at in.
const FEWEST: f32 = 16.0;
/// Of what shines at all, the least that is said of a part that is not known to be dark.
const FAINT: f32 = 1.0 / (1 << 20) as f32;

/// A triangle of a material that does not shine alike all over.
pub(super) struct Uneven<'a> {
    pub mesh: &'a Mesh,
    pub triangle: u32,
    pub pattern: &'a Pbr,
}

/// Parts that shine, each with its mean radiance.
type Shining = Vec<(Part, Light)>;

/// What for a part is looked at.
#[derive(Clone, Copy)]
enum Purpose {
    Division,
    Mean,
}

/// What a part looks like.
struct Look {
    mean: Light,
    least: f32,
    most: f32,
}

/// For each triangle the parts of it that shine; of what is only seen, and lights nothing as a rule, all in one.
pub(super) fn parts(all: &[Uneven<'_>]) -> Vec<Shining> {
    let power =
        |one: &Uneven<'_>| f64::from(one.area() * one.look(Part::WHOLE, Purpose::Division).mean.total());
    let powers: Vec<f64> = all.par_iter().map(power).collect();
    let mut enough = (powers.iter().sum::<f64>() * f64::from(ENOUGH)) as f32;
    let limit = MOST.max(2 * all.len());
    loop {
        let made: Vec<Vec<Part>> = all.par_iter().map(|one| one.divided(enough, limit)).collect();
        if made.iter().map(Vec::len).sum::<usize>() <= limit {
            return all.par_iter().zip(made).map(|(one, parts)| one.measured(parts)).collect();
        }
        enough *= 8.0;
    }
}

impl Uneven<'_> {
    /// Parts that differ by less than `enough`, in units of area times radiance. With more than `limit` it is left as it is.
    fn divided(&self, enough: f32, limit: usize) -> Vec<Part> {
        let mut made = Vec::new();
        let enough = if self.pattern.emission[0] > 0.0 { enough } else { f32::INFINITY };
        self.divide(Part::WHOLE, enough, limit, &mut made);
        made
    }

    fn divide(&self, part: Part, enough: f32, limit: usize, made: &mut Vec<Part>) {
        if made.len() > limit {
            return;
        }
        let look = self.look(part, Purpose::Division);
        let is_small = self.texels(part) <= SMALLEST;
        // Of a texel hardly more than a corner is missed by so many looks.
        if look.most == 0.0 && (is_small || self.is_dark(part)) {
            return;
        }
        // What is not dark and looked so may be as bright as anything.
        let range = if look.most == 0.0 { self.pattern.most_radiance() } else { look.most - look.least };
        let differs = self.area() * part.share() * range > enough;
        match part.quarters().filter(|_| differs && !is_small) {
            Some(quarters) => quarters.into_iter().for_each(|part| self.divide(part, enough, limit, made)),
            None => made.push(part),
        }
    }

    /// With the mean radiance of each. Other looks tell it than those that decided about parts: those that are left whole are
    /// often those in which too little was found.
    fn measured(&self, parts: Vec<Part>) -> Shining {
        let faint = FAINT * self.pattern.mean_radiance();
        let measured = |part: Part| {
            let mean = self.look(part, Purpose::Mean).mean;
            (part, Light::new(mean.invisible.max(faint.invisible), mean.visible.max(faint.visible)))
        };
        parts.into_iter().map(measured).collect()
    }

    fn area(&self) -> f32 {
        self.mesh.area(self.triangle)
    }

    /// About how many texels lie on a part.
    fn texels(&self, part: Part) -> f32 {
        let on = self.pattern.shining_textures().map(|texture| {
            let stretch = self.mesh.stretch(self.triangle, usize::from(texture.set & 1));
            self.area() * (stretch / texture.texel_width()).powi(2)
        });
        let of_vertices = if self.pattern.vertex_colours.is_some() { TEXELS_OF_VERTICES } else { 0.0 };
        part.share() * on.fold(of_vertices, f32::max)
    }

    /// A part in some places: what there is between them, and in the places themselves.
    fn look(&self, part: Part, purpose: Purpose) -> Look {
        let (most, salt) = match purpose {
            Purpose::Division => (32.0, 0),
            Purpose::Mean => (256.0, 1),
        };
        let texels = self.texels(part);
        let count = (2.0 * texels).max(FEWEST).min(most) as u32;
        // What is finer than places are apart is averaged for each.
        let apart = (self.area() * part.share() / count as f32).sqrt();
        // In each part elsewhere, so that a regular pattern is not missed in the same way in all.
        let (path, depth) = part.bits();
        let turn =
            hash(salt ^ hash(u64::from(path) << 32 ^ u64::from(self.triangle) << 5 ^ u64::from(depth)));
        let mut sum = Light::ZERO;
        let (mut least, mut highest) = (f32::INFINITY, 0.0_f32);
        for i in 0..count {
            // M. Roberts 2018, "The unreasonable effectiveness of quasirandom sequences".
            let [a, b] = [0.754_877_666_246_693_f64, 0.569_840_290_998_053];
            let start = [turn & 0xffff, turn >> 16 & 0xffff].map(|bits| (bits as f64 + 0.5) / 65_536.0);
            let u = [start[0] + a * f64::from(i), start[1] + b * f64::from(i)].map(|u| u.fract() as f32);
            let [u, v] = part.place(warp::triangle(u));
            let point = self.mesh.point(self.triangle, u, v, false);
            let around = self.pattern.radiance(&self.mesh.inputs(&point, apart));
            sum += around;
            let there = if salt == 0 && texels > count as f32 {
                self.pattern.radiance(&self.mesh.inputs(&point, 0.0))
            } else {
                around
            };
            for light in [around.total(), there.total()] {
                (least, highest) = (least.min(light), highest.max(light));
            }
        }
        Look { mean: (1.0 / count as f32) * sum, least, most: highest }
    }

    /// True where nothing of a part shines, for certain.
    fn is_dark(&self, part: Part) -> bool {
        let corners = part.corners().map(|[u, v]| self.mesh.point(self.triangle, u, v, false));
        let inputs = corners.map(|corner| self.mesh.inputs(&corner, 0.0));
        let most_there = inputs.iter().map(|inputs| inputs.colour.w).fold(0.0, f32::max);
        let dark = self.pattern.is_dark(&inputs.map(|inputs| inputs.uvs), most_there);
        let divide = || part.quarters().filter(|_| self.texels(part) > SMALLEST);
        dark || divide().is_some_and(|quarters| quarters.into_iter().all(|quarter| self.is_dark(quarter)))
    }
}

impl Pbr {
    /// True where nothing shines between corners with these texture coordinates, for certain; no vertex is there by more than
    /// `most_there`.
    fn is_dark(&self, corners: &[[Vec2; 2]; 3], most_there: f32) -> bool {
        let every = |texture: &Texture, fits: &dyn Fn(Vec4) -> bool| {
            texture.every(corners.map(|uvs| uvs[usize::from(texture.set & 1)]), fits)
        };
        let shown = if self.unlit { &self.base } else { &self.emissive };
        let black = |texel: Vec4| shown.factor * texel.truncate() == Vec3::ZERO;
        let hole = |texel: Vec4| self.is_hole(texel.w * most_there);
        shown.texture.as_ref().is_some_and(|texture| every(texture, &black))
            || self.base.texture.as_ref().is_some_and(|texture| self.has_holes() && every(texture, &hole))
    }
}
