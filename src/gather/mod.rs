//! Camera hits + map → image: the final pass, DESIGN "Gather".
//!
//! A camera ray carries rows (one for each picture that is made: the visible one, and the invisible one on request)
//! and multiplies matrices onto them from the right. It goes straight on where the row does, is passed on by delta
//! lobes, and ends at finite lobes: there direct light is connected and all other light is read from the maps.

mod branches;
mod by_order;
mod connect;
mod direct;
mod estimate;
mod polygon;

use branches::{Parent, Surface, branches};
pub use by_order::{ABREAST, MostOrders, gather_by_order};
pub use connect::Connections;
use direct::{Begun, Open};
pub use estimate::{ALPHA, Irradiance, Maps, Nearby, radius_factor};

use crate::light::{Power, Row};
use crate::optics::{Bsdf, Lobe, Normals};
use crate::plan::{Direct, Plan};
use crate::rays::{Hit, Ray};
use crate::sampling::{Rng, Sobol, Stream, endurance};
use crate::scene::{SurfacePoint, View};
use crate::shoot::PathClass;
use glam::Vec3;
use rayon::prelude::*;

/// What a pass shows in each pixel, row-major from the top left, linear RGB.
///
/// `R` pictures are made at once: the visible one, and the invisible one where asked for.
pub struct Gathered<const R: usize> {
    /// One per pixel.
    pub pixels: Vec<Pixel<R>>,
}

/// One pixel of one pass.
#[derive(Clone, Copy, Debug)]
pub struct Pixel<const R: usize> {
    /// Radiance (W m⁻² sr⁻¹) by who served it, for each picture.
    pub parts: [Parts; R],
    /// Distance along the camera ray to the first surface, m; infinity where there is none.
    pub depth: f32,
    /// Shading normal of the first surface, towards the camera.
    pub normal: Vec3,
    /// Reflectance of the first surface, lobes summed.
    pub albedo: Vec3,
    /// Estimated bias of the finite gather radius in the visible picture.
    pub bias: Vec3,
}

/// The radiance of a pixel by class of light path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parts {
    /// Luminaires seen.
    pub emitted: Vec3,
    /// Straight from luminaires to the surface that is seen.
    pub direct: Vec3,
    /// Through delta lobes only.
    pub caustic: Vec3,
    /// Through at least one finite lobe.
    pub indirect: Vec3,
}

impl Parts {
    fn of(&mut self, class: PathClass) -> &mut Vec3 {
        match class {
            PathClass::Direct => &mut self.direct,
            PathClass::Caustic => &mut self.caustic,
            PathClass::Indirect => &mut self.indirect,
        }
    }

    /// All of it.
    pub fn total(&self) -> Vec3 {
        self.emitted + self.direct + self.caustic + self.indirect
    }
}

/// Rows of a tile, and of the band of tiles that one task gathers.
const TILE: usize = 8;
/// Its columns.
const TILE_WIDTH: usize = 32;

/// Delta reflections in a row that a camera ray follows for certain; beyond, a hall of mirrors is left by
/// [roulette](endurance).
///
/// Only chains that lose nothing come here; others have ended by their share. Between parallel mirrors one in n lines
/// goes on for more than n reflections, so that roulette which sets in early takes from every picture the same few thousandths.
const CERTAIN_DELTA_CHAIN: u32 = 512;

/// Gathers one pass: one camera path through a random point of each pixel. That of a plan that was told to
/// [stop](Plan::stop) is incomplete.
pub fn gather<P: Power, const R: usize>(
    plan: &Plan,
    connections: &Connections,
    maps: &Maps<'_, P>,
    pass: u32,
) -> Gathered<R> {
    let (width, height) = (plan.settings.width, plan.settings.height);
    let view = plan.scene.camera.view(width as f32 / height as f32);
    let (width, height) = (width as usize, height as usize);
    let mut pixels = vec![Pixel::<R>::EMPTY; width * height];
    pixels.par_chunks_mut(width * TILE).enumerate().for_each(|(band, rows)| {
        let mut walk = Walk {
            plan,
            view,
            connections,
            maps,
            nearby: Nearby::default(),
            growth: plan.existence.growth().max(1.0),
            stack: Vec::new(),
            hits: Vec::new(),
            open: Vec::new(),
            sampled: Vec::new(),
        };
        let mut tile = Vec::with_capacity(TILE * TILE_WIDTH);
        for left in (0..width).step_by(TILE_WIDTH) {
            if plan.stop.asked() {
                return;
            }
            let right = (left + TILE_WIDTH).min(width);
            tile.clear();
            for y in band * TILE..band * TILE + rows.len() / width {
                for x in left..right {
                    let rng = Rng::new(plan.settings.seed, Stream::Gather, pass, (y * width + x) as u64);
                    tile.push(walk.pixel([x, y], tile.len(), rng));
                }
            }
            walk.connect_more(&mut tile, right - left);
            for (row, done) in rows.chunks_mut(width).zip(tile.chunks(right - left)) {
                row[left..right].copy_from_slice(done);
            }
        }
    });
    Gathered { pixels }
}

impl<const R: usize> Pixel<R> {
    const EMPTY: Self = Self {
        parts: [Parts { emitted: Vec3::ZERO, direct: Vec3::ZERO, caustic: Vec3::ZERO, indirect: Vec3::ZERO };
            R],
        depth: f32::INFINITY,
        normal: Vec3::ZERO,
        albedo: Vec3::ZERO,
        bias: Vec3::ZERO,
    };
}

/// One straight line still to be looked along.
struct Line<const R: usize> {
    origin: Vec3,
    direction: Vec3,
    parent: Parent<R>,
    /// Length of the camera path so far, m.
    travelled: f32,
}

/// A point on a line of the camera path, and what is still read there.
#[derive(Clone, Copy)]
struct Here<'s, 'a, const R: usize> {
    /// In its tile.
    pixel: usize,
    rows: &'s [Row; R],
    bsdf: &'a Bsdf,
    point: &'s SurfacePoint,
    wo: Vec3,
    /// Length of the camera path, m.
    travelled: f32,
    /// Reflections that light may have had before this surface.
    most_reflections: u32,
}

struct Walk<'a, P, const R: usize> {
    plan: &'a Plan,
    view: View,
    connections: &'a Connections,
    maps: &'a Maps<'a, P>,
    nearby: Nearby,
    /// By so much, or less, lines multiply from one delta reflection to the next.
    growth: f32,
    stack: Vec<Line<R>>,
    hits: Vec<Hit>,
    /// Hits of the tile that may connect more.
    open: Vec<Begun<'a, R>>,
    sampled: Vec<[f32; 2]>,
}

impl<'a, P: Power, const R: usize> Walk<'a, P, R> {
    /// The pixel at column and row; `index` is its place in the tile.
    fn pixel(&mut self, [x, y]: [usize; 2], index: usize, mut rng: Rng) -> Pixel<R> {
        let settings = &self.plan.settings;
        let (width, height) = (settings.width as f32, settings.height as f32);
        let [jx, jy] = rng.f32x2();
        let (origin, direction) = self.view.ray((x as f32 + jx) / width, (y as f32 + jy) / height);
        let mut pixel = Pixel::EMPTY;
        // paper eq. 8: a pixel shows [0 1] L
        let rows = std::array::from_fn(|r| if r == 0 { Row::VISIBLE } else { Row::INVISIBLE });
        let parent = Parent { rows, delta_chain: 0, share: 1.0 };
        self.stack.push(Line { origin, direction, parent, travelled: 0.0 });
        while let Some(line) = self.stack.pop() {
            self.look_along(&line, index, &mut pixel, &mut rng);
        }
        pixel
    }

    fn look_along(&mut self, line: &Line<R>, index: usize, pixel: &mut Pixel<R>, rng: &mut Rng) {
        let ray = Ray { origin: line.origin, direction: line.direction, t_max: f32::INFINITY };
        let mut hits = std::mem::take(&mut self.hits);
        self.plan.look_along(&ray, &line.parent.rows, &mut hits);
        let Parent { mut rows, delta_chain, .. } = line.parent;
        let plan = self.plan;
        for hit in &hits {
            let material = &plan.scene.materials[self.plan.material_index(hit.triangle)];
            let point =
                self.plan.scene.mesh.point(hit.triangle, hit.u, hit.v, self.plan.is_smooth(hit.triangle));
            let wo = -line.direction;
            if pixel.depth == f32::INFINITY && delta_chain == 0 && !material.is_nothing() {
                describe(pixel, hit, &point, wo, &material.bsdf);
            }
            let most = self.plan.settings.max_reflections.unwrap_or(u32::MAX);
            if let Some(emission) = material.emission
                && delta_chain <= most
                && (emission.two_sided || point.normals.is_front(wo))
            {
                for (parts, row) in pixel.parts.iter_mut().zip(rows) {
                    parts.emitted += row * emission.radiance;
                }
            }
            let travelled = line.travelled + hit.t;
            if delta_chain < most {
                let here = Here {
                    pixel: index,
                    rows: &rows,
                    bsdf: &material.bsdf,
                    point: &point,
                    wo,
                    travelled,
                    most_reflections: most - delta_chain - 1,
                };
                self.read_surface(&here, pixel, rng);
                self.pass_on(&here, line, rng);
            }
            rows = rows.map(|row| row * material.bsdf.straight);
            if rows.iter().all(|row| row.is_zero()) {
                break;
            }
        }
        self.hits = hits;
    }

    /// Light that finite lobes send towards the camera.
    fn read_surface(&mut self, here: &Here<'_, 'a, R>, pixel: &mut Pixel<R>, rng: &mut Rng) {
        let Here { point, wo, .. } = *here;
        for term in here.bsdf.terms.iter().filter(|term| !term.lobe.is_delta()) {
            let rows = here.rows.map(|row| row * term.coefficient);
            if rows.iter().all(|row| row.is_zero()) || !term.lobe.responds(&point.normals, wo) {
                continue;
            }
            if self.plan.settings.direct == Direct::Connection {
                let sobol = Sobol::of_dimensions(u64::from(rng.u32()) << 32 | u64::from(rng.u32()));
                let open = Open { pixel: here.pixel, rows, term, point: *point, wo, sobol };
                self.connect(open, pixel);
            }
            let Lobe::Diffuse(diffuse) = term.lobe else { continue };
            let footprint = self.view.footprint(here.travelled, self.plan.settings.height);
            let normal = point.normals.geometric * if point.normals.is_front(wo) { 1.0 } else { -1.0 };
            let f = diffuse.towards(&point.normals, wo);
            let most = u16::try_from(here.most_reflections).unwrap_or(u16::MAX);
            let irradiance = self.maps.irradiance(&mut self.nearby, point, normal, footprint, most);
            for (class, irradiance) in
                [PathClass::Direct, PathClass::Caustic, PathClass::Indirect].into_iter().zip(irradiance)
            {
                let value = irradiance.value.filtered(f);
                for (parts, row) in pixel.parts.iter_mut().zip(rows) {
                    *parts.of(class) += value.read(row);
                }
                pixel.bias += irradiance.bias.filtered(f).read(rows[0]);
            }
        }
    }

    /// The row goes on through delta lobes.
    fn pass_on(&mut self, here: &Here<'_, 'a, R>, line: &Line<R>, rng: &mut Rng) {
        if !here.bsdf.has_delta_lobe() {
            return;
        }
        let survival = endurance(line.parent.delta_chain, CERTAIN_DELTA_CHAIN);
        if survival < 1.0 && rng.f32() >= survival {
            return;
        }
        let Self { plan, growth, stack, .. } = self;
        let Here { rows, bsdf, point, wo, travelled, .. } = *here;
        let surface = Surface { rows: *rows, bsdf, point, wo };
        branches(&plan.rays, &surface, &line.parent, *growth, rng, |branch| {
            stack.push(Line {
                origin: point.origin_towards(branch.sample.to),
                direction: branch.sample.to,
                parent: Parent {
                    rows: branch.rows.map(|row| row * (1.0 / survival)),
                    delta_chain: line.parent.delta_chain + 1,
                    share: branch.share,
                },
                travelled,
            });
        });
    }
}

/// What the first surface looks like.
fn describe<const R: usize>(pixel: &mut Pixel<R>, hit: &Hit, point: &SurfacePoint, wo: Vec3, bsdf: &Bsdf) {
    pixel.depth = hit.t;
    let Normals { shading, .. } = point.normals;
    pixel.normal = if point.normals.is_front(wo) { shading } else { -shading };
    pixel.albedo = bsdf
        .terms
        .iter()
        .map(|term| term.coefficient.vis_inv.max(term.coefficient.vis_vis) * term.lobe.albedo())
        .sum();
}
