//! The one camera walker, and the [`Tally`] that is told what it finds.

use super::Pixel;
use super::branches::{Branch, Parent, Surface, branches};
use super::past::{Found, Past};
use crate::clearance::Reach;
use crate::connect::{Connection, Sights};
use crate::light::{Light, Row};
use crate::optics::{Bsdf, Lobe, Term};
use crate::photon::PathClass;
use crate::plan::{Direct, Frame, Glints, Plan, reads_glints};
use crate::rays::{Hit, Ray, left_of};
use crate::sampling::{Rng, endurance, power_heuristic};
use crate::scene::{Material, MatterAt, SurfacePoint, View};
use glam::Vec3;

/// Delta reflections in a row that a camera ray follows for certain; beyond, a hall of mirrors is left by
/// [roulette](endurance).
///
/// Only chains that lose nothing come here; others have ended by their share. Between parallel mirrors one in n lines
/// goes on for more than n reflections, so that roulette which sets in early takes from every picture the same few thousandths.
const CERTAIN_DELTA_CHAIN: u32 = 512;

/// Who wants to know what camera paths find, for `R` pictures at once.
pub(crate) trait Tally<const R: usize> {
    /// What rows remember of the matter on their way.
    type Mark: Copy + Default;

    /// After going straight through `material`.
    fn crossed(mark: Self::Mark, material: &Material) -> Self::Mark;

    /// After a reflection by `material` of what read `rows` before it.
    fn reflected(mark: Self::Mark, rows: &[Row; R], material: &Material) -> Self::Mark;

    /// False where nothing that rows of this mark read is wanted.
    fn wants(&self, mark: Self::Mark) -> bool;

    /// A luminaire of this radiance is seen, or lights what is; `scattered`: a diffuse lobe that is.
    fn emitted(
        &mut self,
        rows: &[Row; R],
        mark: Self::Mark,
        radiance: Light,
        scattered: bool,
        pixel: &mut Pixel<R>,
    );

    /// How much may be read from photons of the inter-reflection at a diffuse surface.
    fn reach(&mut self, here: &Here<'_, R>) -> Reach;

    /// A finite lobe sends light towards the camera; `reading` are the rows and the mark of the light that it reflects.
    fn read(
        &mut self,
        here: &Here<'_, R>,
        term: &Term,
        reading: ([Row; R], Self::Mark),
        pixel: &mut Pixel<R>,
        rng: &mut Rng,
    );
}

/// One straight line still to be looked along.
struct Line<M, const R: usize> {
    origin: Vec3,
    direction: Vec3,
    parent: Parent<R>,
    mark: M,
    /// Length of the camera path so far, m.
    travelled: f32,
    /// By how much footprints grow along it beyond those of the camera, m per m.
    spread: f32,
    /// Where a glossy lobe chose its direction, which connections might have found too. None: they could not.
    by_chance: Option<ByChance>,
    /// It comes from the camera through nothing but delta lobes: what the eye does not see is not there.
    seen: bool,
    /// What absorbs light where it begins, m⁻¹.
    absorption: Vec3,
    past: Past,
}

/// Directions in which a path goes on from the first diffuse surface that photons cannot serve, and from others.
const DIRECTIONS: [u32; 2] = [2, 1];

/// How a glossy lobe chose a direction.
#[derive(Clone, Copy)]
struct ByChance {
    /// From where.
    point: SurfacePoint,
    /// With which density in solid angle, sr⁻¹.
    density: f32,
}

/// What a direction of a glossy lobe adds to the footprint at its end: this share of the mean distance of such directions, which
/// is far less than what the lobe blurs.
const SPREAD: f32 = 0.01;

/// A point on a line of the camera path, and what is still read there.
#[derive(Clone, Copy)]
pub(crate) struct Here<'s, const R: usize> {
    /// What is read of the light that leaves it.
    pub rows: &'s [Row; R],
    /// Photons tell its glossy lobes what glares.
    pub glints: bool,
    pub material: &'s Material,
    pub bsdf: &'s Bsdf,
    pub point: &'s SurfacePoint,
    /// To where the line came from.
    pub wo: Vec3,
    /// Length of the camera path, m.
    travelled: f32,
    /// Side of what a pixel covers there on a surface that faces it, m.
    pub footprint: f32,
    /// Reflections that light may have had before this surface.
    most_reflections: u32,
    /// What absorbs light on the side of `wo`, m⁻¹.
    absorption: Vec3,
    past: Past,
    /// How much may be read from photons.
    pub reach: Reach,
}

impl<const R: usize> Here<'_, R> {
    /// The geometric normal on the side that is seen.
    pub fn normal(&self) -> Vec3 {
        let normals = &self.point.normals;
        normals.geometric * if normals.is_front(self.wo) { 1.0 } else { -1.0 }
    }

    /// What absorbs light on the side of the unit vector `wi`, m⁻¹.
    pub fn absorption(&self, plan: &Plan, wi: Vec3) -> Vec3 {
        plan.rays.absorption_towards(self.material, self.point, wi).unwrap_or(self.absorption)
    }

    /// True where some lobe reads what arrives from photons.
    fn reads_photons(&self) -> bool {
        let reads = |term: &Term| {
            let read = |row: &Row| !(*row * term.coefficient).is_zero();
            (term.lobe.as_diffuse().is_some() || (self.glints && reads_glints(&term.lobe)))
                && term.lobe.responds(&self.point.normals, self.wo)
                && self.rows.iter().any(read)
        };
        self.bsdf.terms.iter().any(reads)
    }

    /// The path was scattered by a diffuse surface on its way here.
    pub fn is_scattered(&self) -> bool {
        self.past.scattered
    }

    /// What light of a class that arrives here is to what is seen.
    pub fn class(&self, class: PathClass) -> PathClass {
        if self.is_scattered() { PathClass::Indirect } else { class }
    }

    /// True where direct light by this lobe is found by connections.
    pub fn connects(&self, term: &Term, direct: Direct) -> bool {
        if term.lobe.as_diffuse().is_some() {
            direct == Direct::Connection
        } else {
            // What narrow lobes send on is a caustic where it arrives.
            self.past.found == Found::Nothing || !term.lobe.is_narrow()
        }
    }

    /// Reflections that light may have had before this surface, as photons count theirs.
    pub fn most_counted(&self) -> u16 {
        u16::try_from(self.most_reflections).unwrap_or(u16::MAX)
    }
}

/// Camera paths, one after another.
pub(crate) struct Walk<'a, T: Tally<R>, const R: usize> {
    pub(super) plan: &'a Plan,
    /// What connections know.
    sights: Option<&'a Sights>,
    /// Width and height of the film in pixels.
    pub(super) film: [u32; 2],
    view: View,
    pub tally: T,
    /// By so much, or less, lines multiply from one delta reflection to the next.
    growth: f32,
    /// What photons tell glossy lobes.
    glints: Option<&'a Glints>,
    stack: Vec<Line<T::Mark, R>>,
    hits: Vec<Hit>,
}

impl<'a, T: Tally<R>, const R: usize> Walk<'a, T, R> {
    /// Through the pixels of a frame.
    pub fn new(plan: &'a Plan, frame: &'a Frame, tally: T) -> Self {
        let view = plan.scene.camera.view(frame.aspect());
        let film = [frame.width, frame.height];
        let growth = plan.existence.growth().max(1.0);
        let sights = frame.sights.as_deref();
        let glints = frame.photons.as_ref().and_then(|photons| photons.glints.as_deref());
        Self { plan, sights, film, view, tally, growth, glints, stack: Vec::new(), hits: Vec::new() }
    }

    /// A path through a random point of the pixel at column `x` and row `y`.
    pub fn pixel(&mut self, place: [usize; 2], mut rng: Rng) -> Pixel<R> {
        let mut pixel = Pixel::EMPTY;
        let within = rng.f32x2();
        self.path((place, within), 1.0, &mut pixel, &mut rng);
        pixel
    }

    /// A path through a point of the pixel at a column and a row, `within` [0, 1)²; the pixel is given this `part` of what it finds.
    pub fn path(
        &mut self,
        ([x, y], [jx, jy]): ([usize; 2], [f32; 2]),
        part: f32,
        pixel: &mut Pixel<R>,
        rng: &mut Rng,
    ) {
        let [width, height] = self.film.map(|side| side as f32);
        let (x, y) = ((x as f32 + jx) / width, (y as f32 + jy) / height);
        let (origin, direction) =
            if self.view.has_lens() { self.view.ray_through(x, y, rng.f32x2()) } else { self.view.ray(x, y) };
        // paper eq. 8: a pixel shows [0 1] L
        let rows = std::array::from_fn(|r| if r == 0 { Row::VISIBLE } else { Row::INVISIBLE } * part);
        let parent = Parent { rows, delta_chain: 0, share: 1.0 };
        self.stack.push(Line {
            origin,
            direction,
            parent,
            mark: T::Mark::default(),
            travelled: 0.0,
            spread: 0.0,
            by_chance: None,
            seen: true,
            absorption: Vec3::ZERO,
            past: Past::NONE,
        });
        while let Some(line) = self.stack.pop() {
            self.look_along(&line, pixel, rng);
        }
    }

    fn look_along(&mut self, line: &Line<T::Mark, R>, pixel: &mut Pixel<R>, rng: &mut Rng) {
        let ray = Ray { origin: line.origin, direction: line.direction, t_max: f32::INFINITY };
        let mut hits = std::mem::take(&mut self.hits);
        self.plan.look_along(&ray, &line.parent.rows, line.seen, &mut hits);
        let (plan, wo) = (self.plan, -line.direction);
        let Parent { mut rows, delta_chain, .. } = line.parent;
        let mut mark = line.mark;
        let most = plan.settings.max_reflections.unwrap_or(u32::MAX);
        let (mut absorption, mut before) = (line.absorption, 0.0);
        for hit in &hits {
            if absorption != Vec3::ZERO {
                let left = left_of(absorption, hit.t - before);
                rows = rows.map(|row| row * left);
            }
            before = hit.t;
            let travelled = line.travelled + hit.t;
            let footprint = self.view.footprint(travelled, self.film[1]) + line.spread * hit.t;
            let MatterAt { surface, material, point, bsdf, seen, .. } = plan.matter_at(hit, footprint);
            let bsdf: &Bsdf = &bsdf;
            if pixel.depth == f32::INFINITY && delta_chain == 0 && !material.is_nothing() {
                describe(pixel, hit, &point, wo, bsdf);
            }
            if line.seen && !material.is_nothing() {
                pixel.features.add(&plan.rays, rows[0], &point, wo, bsdf);
            }
            // Where a connection had a chance of it too, it is as bright as that finds it.
            let at_point = line.by_chance.is_some() && material.pattern.is_some();
            let seen = if at_point { plan.scene.emission_at(&point) } else { seen };
            if let Some(emission) = seen
                && line.past.wants(|| self.glints.is_some_and(|glints| glints.is_glaring(surface.material)))
                && delta_chain <= most
                && (emission.two_sided || point.normals.is_front(wo))
            {
                let weight = plan.chance_weight(self.sights, line.by_chance.as_ref(), hit, &point, wo);
                let weighed = if weight == 1.0 { rows } else { rows.map(|row| row * weight) };
                self.tally.emitted(&weighed, mark, emission.radiance, line.past.scattered, pixel);
            }
            if delta_chain < most {
                let (rows, point, most_reflections) = (&rows, &point, most - delta_chain - 1);
                let mut here = Here {
                    rows,
                    glints: self.glints.is_some_and(|glints| glints.are_read_by(surface.material)),
                    material,
                    bsdf,
                    point,
                    wo,
                    travelled,
                    footprint,
                    most_reflections,
                    absorption,
                    past: line.past,
                    reach: Reach::Simple(1.0),
                };
                if here.reads_photons() {
                    here.reach = self.tally.reach(&here);
                }
                self.read_surface(&here, mark, pixel, rng);
                self.pass_on(&here, line, mark, rng);
            }
            rows = rows.map(|row| row * bsdf.straight);
            mark = T::crossed(mark, material);
            absorption = plan.rays.absorption_towards(material, &point, -wo).unwrap_or(absorption);
            if rows.iter().all(|row| row.is_zero()) {
                break;
            }
        }
        self.hits = hits;
        if delta_chain <= most && line.past.found != Found::Lit && rows.iter().any(|row| !row.is_zero()) {
            if absorption != Vec3::ZERO {
                rows = rows.map(|row| row * left_of(absorption, f32::INFINITY));
            }
            self.escape(line, &rows, mark, pixel);
        }
    }

    /// A line that meets nothing more sees what shines at infinity.
    fn escape(&mut self, line: &Line<T::Mark, R>, rows: &[Row; R], mark: T::Mark, pixel: &mut Pixel<R>) {
        let Self { plan, sights, tally, glints, .. } = self;
        let from = line.by_chance.as_ref().map(|by_chance| &by_chance.point);
        for (luminaire, light, connected) in
            plan.connections.skies(&plan.scene, *sights, from, line.direction)
        {
            let glares = || {
                let glares = |g: &Glints| g.is_glaring_sky(&plan.scene, luminaire, line.direction);
                glints.is_some_and(glares)
            };
            if !line.past.wants(glares) {
                continue;
            }
            let weight = match line.by_chance {
                Some(ByChance { density, .. }) if connected > 0.0 => power_heuristic(density, connected),
                _ => 1.0,
            };
            let weighed = if weight == 1.0 { *rows } else { rows.map(|row| row * weight) };
            tally.emitted(&weighed, mark, light, line.past.scattered, pixel);
        }
    }

    /// Light that finite lobes send towards the camera.
    fn read_surface(&mut self, here: &Here<'_, R>, mark: T::Mark, pixel: &mut Pixel<R>, rng: &mut Rng) {
        let Here { point, wo, bsdf, .. } = *here;
        let mark = T::reflected(mark, here.rows, here.material);
        for term in bsdf.terms.iter().filter(|term| !term.lobe.is_delta()) {
            let rows = here.rows.map(|row| term.before(row));
            let dark = rows.iter().all(|row| row.is_zero()) || term.lobe.bound() == Vec3::ZERO;
            if dark || !term.lobe.responds(&point.normals, wo) {
                continue;
            }
            let lobe = self.plan.rays.lobe_at(term.lobe, point);
            if !lobe.is_delta() {
                self.tally.read(here, &Term { lobe, ..*term }, (rows, mark), pixel, rng);
            }
        }
    }

    /// The row goes on through delta lobes and glossy ones.
    fn pass_on(&mut self, here: &Here<'_, R>, line: &Line<T::Mark, R>, mark: T::Mark, rng: &mut Rng) {
        let Here { rows, material, bsdf, point, wo, travelled, .. } = *here;
        let diffuse = match (here.reach, line.past.scattered) {
            (Reach::Simple(_), _) => 0,
            (Reach::Crowded, false) => DIRECTIONS[0],
            (Reach::Crowded, true) => DIRECTIONS[1],
        };
        if diffuse == 0 && !bsdf.is_passed_on() {
            return;
        }
        let survival = endurance(line.parent.delta_chain, CERTAIN_DELTA_CHAIN);
        if survival < 1.0 && rng.f32() >= survival {
            return;
        }
        let Self { plan, tally, growth, stack, .. } = self;
        let mark = T::reflected(mark, rows, material);
        let surface = Surface { rows: *rows, material, bsdf, point, wo, diffuse };
        branches(&plan.rays, &surface, &line.parent, *growth, rng, |branch: Branch<R>| {
            if !tally.wants(mark) {
                return;
            }
            stack.push(Line {
                origin: point.origin_towards(branch.sample.to),
                direction: branch.sample.to,
                parent: Parent {
                    rows: branch.rows.map(|row| row * (1.0 / survival)),
                    delta_chain: line.parent.delta_chain + 1,
                    share: branch.share,
                },
                mark,
                travelled,
                spread: line.spread + branch.density.map_or(0.0, |density| SPREAD / density.sqrt()),
                // What is not connected to from there is found by chance alone.
                by_chance: branch
                    .density
                    .filter(|_| line.past.found == Found::Nothing || !branch.lobe.is_narrow())
                    .map(|density| ByChance { point: *point, density }),
                seen: line.seen && branch.lobe.is_delta(),
                past: line.past.then(&branch.lobe, here.glints),
                absorption: here.absorption(plan, branch.sample.to),
            });
        });
    }
}

impl Plan {
    /// Weight of a luminaire at `target` that a line came upon, beside connections from where the line began.
    fn chance_weight(
        &self,
        sights: Option<&Sights>,
        by_chance: Option<&ByChance>,
        hit: &Hit,
        target: &SurfacePoint,
        wo: Vec3,
    ) -> f32 {
        let Some(ByChance { point, density }) = by_chance else { return 1.0 };
        let cos = wo.dot(target.normals.geometric).abs();
        let connected = self.connections.density(&self.scene, sights, point, target, [hit.t, cos]);
        if connected == 0.0 { 1.0 } else { power_heuristic(*density, connected) }
    }
}

/// What `lobe` reflects towards `wo` of a connection, per unit of its light; weighed against the chance of coming upon the
/// luminaire where the lobe is one that camera paths go on by.
pub(crate) fn reflected(lobe: &Lobe, point: &SurfacePoint, wo: Vec3, connection: &Connection) -> Vec3 {
    let Connection { wi, density, .. } = *connection;
    let f = lobe.eval(&point.normals, wo, wi) * wi.dot(point.normals.shading).abs();
    match density {
        Some(density) if lobe.is_glossy() && f != Vec3::ZERO => {
            f * power_heuristic(density, lobe.pdf(&point.normals, wo, wi))
        }
        _ => f,
    }
}

/// What the first surface looks like.
fn describe<const R: usize>(pixel: &mut Pixel<R>, hit: &Hit, point: &SurfacePoint, wo: Vec3, bsdf: &Bsdf) {
    pixel.depth = hit.t;
    pixel.normal = point.normals.facing(wo);
    pixel.albedo = bsdf
        .terms
        .iter()
        .filter(|term| !term.turn.is_reradiated())
        .map(|term| term.coefficient.vis_inv.max(term.coefficient.vis_vis) * term.lobe.albedo())
        .sum();
}
