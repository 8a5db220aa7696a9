//! What of all light is of use to the picture: camera paths, scattered once or more, aim at luminaires, and remember which
//! starts of photons would have brought them what they found.
//!
//! The account is that of the picture's own light (adjoint of what photons do), so that starts are learned even where one
//! in millions is of use, as below a roof of two metres on a plain of six kilometres. What comes by mirrors and glass alone
//! is not found in this way: photon paths from the starts that were found look for it.

use super::lessons::caustics;
use crate::emission::{Aimed, EMISSION_DIMENSIONS, Emitters, Origin, StartTree, Useful};
use crate::light::{Light, Row};
use crate::optics::{Lobe, Term, Transport};
use crate::plan::{Frame, PhotonPlan, Plan};
use crate::rays::{Ray, Segment};
use crate::sampling::{Rng, Stream, choose, warp};
use crate::scene::{MatterAt, SurfacePoint};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Camera paths that find out whether there is anything to learn, and by so much denser starts must become where they are of use to
/// look on: a few paths tell little of it.
const LOOKS: [(u32, f64); 2] = [(1 << 12, 1.2), (1 << 15, 2.0)];
/// Those that learn it.
const LESSONS: u32 = 1 << 18;
/// Paths that look for caustics.
const SHOTS: u32 = 1 << 16;
/// The share of guided paths that looks for caustics, where there are any.
const CAUSTIC: f32 = 0.35;
/// What a photon counts where the camera does not see it at once: mirrors and glass may show it.
const UNSEEN: f32 = 0.02;
/// Events of a path at the most.
const EVENTS: u32 = 12;
/// Roulette after so many.
const CERTAIN: u32 = 3;

/// A place where a camera path reads light by connections.
pub struct Place<'a> {
    pub met: MatterAt<'a>,
    /// Unit, to where the path came from.
    pub wo: Vec3,
    /// What is read of the light that leaves it.
    pub row: Row,
}

/// Places where camera paths of these numbers read light, in their order.
pub fn seen_places<'a>(plan: &'a Plan, frame: &Frame, paths: Range<u32>) -> Vec<Place<'a>> {
    let each = paths.into_par_iter().map(|path| places_of(plan, frame, path));
    each.collect::<Vec<_>>().into_iter().flatten().collect()
}

fn places_of<'a>(plan: &'a Plan, frame: &Frame, path: u32) -> Vec<Place<'a>> {
    let (mut rng, mut line) = begin(plan, frame, path);
    let mut places = Vec::new();
    for _ in 0..EVENTS {
        let ray = Ray { origin: line.origin, direction: line.direction, t_max: f32::INFINITY };
        let Some(hit) = plan.rays.closest_seen(&ray) else { break };
        let met = plan.matter_at(&hit, 0.0);
        let (wo, row) = (-line.direction, line.row);
        let next = scattered(plan, &line, &met, &mut rng, |lobe| lobe.as_diffuse().is_none());
        if met.bsdf.has_finite_lobe() {
            places.push(Place { met, wo, row });
        }
        let Some((next, _)) = next else { break };
        line = next;
    }
    places
}

/// A path through a random point of the film.
fn begin(plan: &Plan, frame: &Frame, path: u32) -> (Rng, Line) {
    let view = plan.scene.camera.view(frame.aspect());
    let mut rng = Rng::new(plan.settings.seed, Stream::Measure, u32::MAX, u64::from(path));
    let [x, y] = rng.f32x2();
    let (origin, direction) =
        if view.has_lens() { view.ray_through(x, y, rng.f32x2()) } else { view.ray(x, y) };
    (rng, Line { origin, direction, row: Row::VISIBLE, scattered: false })
}

/// Where a path goes on, straight or by one of the lobes that it may take, in proportion to what is read by it; and the lobe. None:
/// nowhere.
fn scattered(
    plan: &Plan,
    line: &Line,
    met: &MatterAt<'_>,
    rng: &mut Rng,
    takes: impl Fn(&Lobe) -> bool,
) -> Option<(Line, Option<Lobe>)> {
    let MatterAt { point, bsdf, .. } = met;
    let wo = -line.direction;
    let straight = line.row * bsdf.straight;
    let strength = |i: usize| match bsdf.terms.get(i) {
        None => straight.total(),
        Some(term) if takes(&term.lobe) && term.lobe.responds(&point.normals, wo) => {
            (term.before(line.row) * term.lobe.share(&point.normals, wo)).total()
        }
        Some(_) => 0.0,
    };
    let (chosen, probability) = choose(bsdf.terms.len() + 1, strength, rng.f32())?;
    let Some(term) = bsdf.terms.get(chosen) else {
        let origin = point.origin_towards(line.direction);
        return Some((Line { origin, row: straight * (1.0 / probability), ..*line }, None));
    };
    let lobe = plan.rays.lobe_at(term.lobe, point);
    let sample = lobe.sample(&point.normals, wo, Transport::Gathering, rng.f32x3())?;
    let line = Line {
        origin: point.origin_towards(sample.to),
        direction: sample.to,
        row: term.before(line.row) * (sample.weight / probability),
        scattered: line.scattered,
    };
    Some((line, Some(lobe)))
}

/// Learns which starts are of use to the picture. None: hardly fewer than all.
pub fn learn_starts(plan: &Plan, frame: &Frame) -> Option<StartTree> {
    let photons = frame.photons.as_ref().filter(|_| plan.settings.learns())?;
    let emitters = Emitters::<Light>::new(&plan.scene)?;
    let eye = Eye { plan, frame, emitters, direct: photons.classes.direct };
    let mut next = 0;
    let mut look = |paths: u32| {
        next += paths;
        eye.look(next - paths..next)
    };
    for (paths, worth) in LOOKS {
        // What some tell must hold for others.
        let (learned, asked) = (look(paths), look(paths));
        if StartTree::new(learned)?.gain_for(&asked) < worth {
            return None;
        }
    }
    let mut useful = look(LESSONS);
    let tree = StartTree::new(useful.clone())?;
    if !photons.classes.caustic {
        return Some(tree);
    }
    let mut caustic = eye.caustics(photons, &tree);
    // Both are in units of their own.
    let sum = |useful: &[Useful]| useful.iter().map(|one| one.weight).sum::<f32>();
    let scale = CAUSTIC / (1.0 - CAUSTIC) * sum(&useful) / sum(&caustic);
    if scale.is_finite() {
        caustic.iter_mut().for_each(|one| one.weight *= scale);
        useful.append(&mut caustic);
    }
    StartTree::new(useful)
}

/// Camera paths that learn.
struct Eye<'a> {
    plan: &'a Plan,
    frame: &'a Frame,
    emitters: Emitters<'a, Light>,
    /// Photons serve direct light too.
    direct: bool,
}

/// A line of a camera path.
struct Line {
    origin: Vec3,
    direction: Vec3,
    row: Row,
    /// It has been scattered by a surface that takes photons.
    scattered: bool,
}

impl Eye<'_> {
    /// What was of use to paths of these numbers, in their order.
    fn look(&self, paths: Range<u32>) -> Vec<Useful> {
        let each = paths.into_par_iter().map(|path| self.path(path));
        each.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// Starts of paths that leave caustics, most of all where the camera sees them.
    fn caustics(&self, photons: &PhotonPlan, tree: &StartTree) -> Vec<Useful> {
        let Self { plan, frame, emitters, .. } = self;
        let start = |u| {
            let (start, density) = tree.warp(u);
            (emitters.emit(SHOTS, start), (start, density))
        };
        caustics(plan, frame, photons, SHOTS, start, |(start, density), left| {
            let seen: f32 =
                left.iter().map(|photon| photon.power.total() * self.regard(photon.position)).sum();
            (seen > 0.0).then_some(Useful { start, weight: seen / density })
        })
    }

    /// What light at a place counts for, by the share of the film that it is on.
    fn regard(&self, place: Vec3) -> f32 {
        let camera = &self.plan.scene.camera;
        if camera.film(place, self.frame.aspect()).is_none() {
            return UNSEEN;
        }
        // Up to its own surface.
        let way = 0.999 * (place - camera.position);
        let segment = Segment { origin: camera.position, way: way.as_dvec3(), end: 1.0 };
        if self.plan.rays.transmittance(segment).is_zero() { UNSEEN } else { 1.0 }
    }

    fn path(&self, path: u32) -> Vec<Useful> {
        let (mut rng, first) = begin(self.plan, self.frame, path);
        let mut line = Some(first);
        let mut useful = Vec::new();
        for event in 0..EVENTS {
            let Some(current) = line else { break };
            line = self.follow(&current, event, &mut rng, &mut useful);
        }
        useful
    }

    /// To the next surface. None: the path ends.
    fn follow(&self, line: &Line, event: u32, rng: &mut Rng, useful: &mut Vec<Useful>) -> Option<Line> {
        let plan = self.plan;
        let ray = Ray { origin: line.origin, direction: line.direction, t_max: f32::INFINITY };
        let met = plan.matter_at(&plan.rays.closest(&ray)?, 0.0);
        if line.scattered || self.direct {
            self.aim(line, &met, rng, useful);
        }
        let (next, lobe) = scattered(plan, line, &met, rng, |_| true)?;
        let takes = self.frame.photons.as_ref().is_some_and(|p| p.deposits[met.surface.material as usize]);
        let scattered = line.scattered || (takes && lobe.is_some_and(|lobe| lobe.as_diffuse().is_some()));
        let survival =
            if event < CERTAIN { 1.0 } else { (next.row.total() / line.row.total()).clamp(0.1, 1.0) };
        (rng.f32() < survival).then(|| Line { row: next.row * (1.0 / survival), scattered, ..next })
    }

    /// Remembers the start that brings light to a surface, and how much of it the picture reads.
    fn aim(&self, line: &Line, met: &MatterAt<'_>, rng: &mut Rng, useful: &mut Vec<Useful>) {
        let MatterAt { point, bsdf, .. } = met;
        let u: [f32; EMISSION_DIMENSIONS] = std::array::from_fn(|_| rng.f32());
        let wo = -line.direction;
        // What is seen there is read from photons around it.
        let near = if line.scattered { Vec3::ZERO } else { self.beside(point, rng) };
        let Some(Aimed { start, to, from, irradiance }) = self.emitters.aim_at(point.position + near, u)
        else {
            return;
        };
        let read = |term: &Term| match &term.lobe {
            lobe if lobe.is_delta() => 0.0,
            lobe => (term.before(line.row) * self.reflected(lobe, point, wo, to)).total(),
        };
        let weight = irradiance * bsdf.terms.iter().map(read).sum::<f32>();
        if weight > 0.0 && self.sees(point, to, from) {
            useful.push(Useful { start, weight });
        }
    }

    /// A way (m) to a place within the gather radius of what the camera sees.
    fn beside(&self, point: &SurfacePoint, rng: &mut Rng) -> Vec3 {
        let view = self.plan.scene.camera.view(self.frame.aspect());
        let radius = self.frame.indirect_radius * view.footprint_at(point.position, self.frame.height);
        let [x, y] = warp::disk(rng.f32x2());
        let (right, up) = point.normals.geometric.any_orthonormal_pair();
        radius * (x * right + y * up)
    }

    fn reflected(&self, lobe: &Lobe, point: &SurfacePoint, wo: Vec3, to: Vec3) -> Vec3 {
        self.plan.rays.lobe_at(*lobe, point).eval(&point.normals, wo, to)
            * to.dot(point.normals.shading).abs()
    }

    /// True where not all light is stopped between a point and where a start is.
    fn sees(&self, point: &SurfacePoint, to: Vec3, from: Option<Origin>) -> bool {
        let segment = match from {
            None => Some(Segment::from_towards(point, to)),
            Some(Origin::Point(position)) => Segment::between(point, position),
            Some(Origin::Surface(end)) => Segment::to_surface(&self.plan.scene.mesh, point, &end),
        };
        segment.is_some_and(|segment| !self.plan.rays.transmittance(segment).is_zero())
    }
}
