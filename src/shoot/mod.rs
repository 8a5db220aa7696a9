//! Luminaires → photons: light shooting. Each line is one ordered query for all its hits; at each, light is deposited, reflected
//! by chance, and sent straight on.

mod crowd;
mod importance;
mod lessons;
mod levels;

pub use importance::{Place, learn_starts, seen_places};
pub use lessons::learn_guide;

use crate::emission::{Beam, Emitted, Emitters, Falloff};
use crate::light::Power;
use crate::optics::{Bsdf, Normals, Pdf, Sample, Transport};
use crate::photon::{Ledger, Orders, PathClass, Photon, Photons};
use crate::plan::{Frame, PhotonPlan, Plan};
use crate::rays::{Hit, Ray, left_of};
use crate::sampling::{Rng, Sobol, Stream, choose, endurance, hash};
use crate::scene::{MatterAt, SurfacePoint};
use crowd::Crowd;
use glam::Vec3;
use levels::Levels;
use rayon::prelude::*;

/// Paths that one task follows before it hands back its photons; results do not depend on it.
const PATHS_PER_TASK: u32 = 2048;

/// Delta reflections in a row that are followed for certain; beyond, a lossless hall of mirrors is left by
/// [roulette](endurance).
const CERTAIN_DELTA_CHAIN: u32 = 64;

/// Photons of stiff series fade to this part of their power before roulette sets in. A path is then ln(256) ≈ 6 times
/// as long on average and its sum varies by 1/256 instead of by itself: ten thousand times the efficiency.
const LEAST_FADING: f32 = 1.0 / 256.0;

/// Lines of one path between looks whether to stop.
const LINES_UNWATCHED: u64 = 1024;

/// Shoots the photons of one pass: none where the frame has none. Those of a frame that was told to [stop](Frame::stop) are
/// incomplete.
pub fn shoot<P: Power>(plan: &Plan, frame: &Frame, pass: u32) -> Photons<P> {
    let (Some(photon_plan), Some(emitters)) = (&frame.photons, Emitters::<P>::new(&plan.scene)) else {
        return Photons::none();
    };
    let seed = plan.settings.seed;
    let sobol = Sobol::new(hash(seed ^ hash(u64::from(pass) ^ hash(Stream::Shoot as u64))));
    let paths = photon_plan.paths;
    let tasks = paths.div_ceil(PATHS_PER_TASK);
    let parts: Vec<Photons<P>> = (0..tasks)
        .into_par_iter()
        .map(|task| {
            let first = task * PATHS_PER_TASK;
            let mut walk = Walk::new(plan, frame, photon_plan, tasks);
            for path in first..(first + PATHS_PER_TASK).min(paths) {
                if frame.stop.asked() {
                    break;
                }
                let rng = Rng::new(seed, Stream::Shoot, pass, u64::from(path));
                let u = sobol.point(path, 0);
                walk.follow(
                    match (&photon_plan.starts, &photon_plan.guide) {
                        (Some(starts), _) => emitters.emit_by_use(paths, u, starts),
                        (None, Some(guide)) => emitters.emit_guided(paths, u, guide),
                        (None, None) => emitters.emit(paths, u),
                    },
                    rng,
                );
            }
            walk.photons
        })
        .collect();
    join(parts)
}

fn join<P: Power>(parts: Vec<Photons<P>>) -> Photons<P> {
    let mut ledger = Ledger::default();
    parts.iter().for_each(|part| ledger.add(&part.ledger));
    let mut by_class: [Vec<Photon<P>>; 3] =
        std::array::from_fn(|c| Vec::with_capacity(parts.iter().map(|part| part.by_class[c].len()).sum()));
    let mut glints = Vec::with_capacity(parts.iter().map(|part| part.glints.len()).sum());
    for part in parts {
        for (all, some) in by_class.iter_mut().zip(part.by_class) {
            all.extend(some);
        }
        glints.extend(part.glints);
    }
    Photons { by_class, glints, ledger }
}

/// One straight line still to be followed.
struct Line<P> {
    origin: Vec3,
    direction: Vec3,
    power: P,
    falloff: Falloff,
    reflections: u32,
    delta_chain: u32,
    class: PathClass,
    orders: Orders,
    /// Some surface re-radiated it.
    reradiated: bool,
    /// Of no use once the class is [`PathClass::Indirect`].
    beam: Beam,
    /// What absorbs light where it begins, m⁻¹.
    absorption: Vec3,
}

/// Follows paths one after another and keeps what they deposit.
struct Walk<'a, P> {
    plan: &'a Plan,
    frame: &'a Frame,
    photon_plan: &'a PhotonPlan,
    levels: Levels,
    stack: Vec<Line<P>>,
    hits: Vec<Hit>,
    crowd: Crowd,
    /// The path under way comes from what glares.
    glares: bool,
    photons: Photons<P>,
}

impl<'a, P: Power> Walk<'a, P> {
    /// Of one of `tasks` that share out the paths.
    fn new(plan: &'a Plan, frame: &'a Frame, photon_plan: &'a PhotonPlan, tasks: u32) -> Self {
        let crowd = Crowd::new(photon_plan, tasks);
        let levels = Levels::of(plan, frame, photon_plan.paths);
        let (stack, hits, photons) = (Vec::new(), Vec::new(), Photons::none());
        Self { plan, frame, photon_plan, levels, stack, hits, crowd, glares: false, photons }
    }

    /// Drops what was deposited.
    fn forget(&mut self) {
        self.photons.by_class.iter_mut().for_each(Vec::clear);
        self.photons.glints.clear();
        self.crowd.kept = 0;
    }

    fn follow(&mut self, emitted: Emitted<P>, mut rng: Rng) {
        let Emitted { origin, direction, power, falloff, luminaire, beam } = emitted;
        let unit = power.total();
        if unit == 0.0 {
            return; // a dark place of a luminaire
        }
        self.photons.ledger.emitted += f64::from(unit);
        let scene = &self.plan.scene;
        let glints = self.photon_plan.glints.as_ref();
        self.glares = glints.is_some_and(|glints| {
            glints.is_of_glare(scene, &scene.luminaires[luminaire as usize], direction)
        });
        self.stack.push(Line {
            origin,
            direction,
            power,
            falloff,
            reflections: 0,
            delta_chain: 0,
            class: PathClass::Direct,
            orders: Orders::default(),
            reradiated: false,
            beam,
            absorption: Vec3::ZERO,
        });
        self.crowd.lines = 0;
        while let Some(line) = self.stack.pop() {
            self.crowd.lines += 1;
            if self.crowd.lines.is_multiple_of(LINES_UNWATCHED) && self.frame.stop.asked() {
                self.stack.clear();
                break;
            }
            self.follow_line(line, unit, &mut rng);
        }
    }

    /// One ordered all-hits query; at each surface: deposit, spawn, go straight on.
    fn follow_line(&mut self, mut line: Line<P>, unit: f32, rng: &mut Rng) {
        let ray = Ray { origin: line.origin, direction: line.direction, t_max: f32::INFINITY };
        let mut hits = std::mem::take(&mut self.hits);
        self.plan.rays.crossings(&ray, &mut hits);
        self.photons.ledger.lines += 1;
        let mut power = line.power;
        let mut before = 0.0;
        for hit in &hits {
            let met = self.plan.matter_at(hit, 0.0);
            let MatterAt { surface, material, point, bsdf, .. } = &met;
            if line.absorption != Vec3::ZERO {
                let whole = power;
                power = power.filtered(left_of(line.absorption, hit.t - before));
                self.photons.ledger.absorbed += f64::from(whole.total()) - f64::from(power.total());
            }
            before = hit.t;
            let arriving = power.scaled(line.falloff.at(hit.t));
            if self.photon_plan.deposits[surface.material as usize]
                && self.photon_plan.classes.contains(line.class)
            {
                let below = bsdf.arrival(&point.normals, -line.direction);
                if let Some(photon) = self.arrived(&line, hit.t, point, arriving.scaled(below), rng) {
                    self.photons.by_class[line.class as usize].push(photon);
                }
            }
            if self.glares
                && line.class == PathClass::Caustic
                && self.photon_plan.glints.as_ref().is_some_and(|glints| glints.are_read_by(surface.material))
                && let Some(photon) = self.arrived(&line, hit.t, point, arriving, rng)
            {
                self.photons.glints.push(photon.coming_from(-line.direction));
            }
            let sent_on = self.spawn(&line, hit.t, &met, arriving, unit, rng);
            let straight = power.through(bsdf.straight);
            self.account(power, sent_on, straight);
            power = straight;
            line.orders = line.orders.crossed(material);
            let beyond = self.plan.rays.absorption_towards(material, point, line.direction);
            line.absorption = beyond.unwrap_or(line.absorption);
            if power.total() == 0.0 {
                break;
            }
        }
        self.photons.ledger.escaped += f64::from(power.total());
        self.hits = hits;
    }

    /// The photon to be kept, if the side it came to is not dark; thinned where the plan bounds memory.
    fn arrived(
        &mut self,
        line: &Line<P>,
        distance: f32,
        point: &SurfacePoint,
        power: P,
        rng: &mut Rng,
    ) -> Option<Photon<P>> {
        let from = -line.direction;
        let normals = &point.normals;
        if !normals.same_side(from, from) {
            return None;
        }
        self.photons.ledger.deposits += 1;
        let keep = self.photon_plan.keep * self.crowd.kept();
        if keep < 1.0 && (keep == 0.0 || rng.f32() >= keep) {
            return None;
        }
        self.crowd.kept += 1;
        let normal = if normals.is_front(from) { normals.geometric } else { -normals.geometric };
        let power = power.scaled(normals.arrival(from) / keep);
        assert!(power.light().is_finite(), "a photon's power is not finite: {:?}", power.light());
        let photon = Photon::new(point.position, normal, power, line.reflections);
        let level = match line.class {
            PathClass::Caustic => {
                let area = line.beam.at(line.direction, distance, normals.geometric).area();
                self.levels.of_beam(point.position, area, rng.f32())
            }
            PathClass::Direct | PathClass::Indirect => 0,
        };
        Some(Photon { orders: line.orders, ..photon }.at_level(level).reradiated(line.reradiated))
    }

    /// Spawns the reflected photon, by lobe choice and Russian roulette; returns the power it was expected to carry.
    fn spawn(
        &mut self,
        line: &Line<P>,
        distance: f32,
        met: &MatterAt<'_>,
        power: P,
        unit: f32,
        rng: &mut Rng,
    ) -> f64 {
        let MatterAt { material, bsdf, point, .. } = met;
        let orders = line.orders.reflected(material);
        if line.reflections >= self.photon_plan.max_reflections || orders.n > self.photon_plan.most_orders {
            return 0.0; // of the truncated series no more is wanted
        }
        let from = -line.direction;
        let Some((term, probability)) = choose_term(bsdf, point, from, power, rng) else { return 0.0 };
        let term = &bsdf.terms[term];
        let carried = || power.through(term.coefficient).light().colours();
        let (lobe, filter) = self.plan.rays.lobe_for(term.lobe, material, point, carried, || rng.f32());
        let Some(Sample { to, weight, pdf, geometric }) =
            lobe.sample(&point.normals, from, Transport::Shooting, rng.f32x3())
        else {
            return 0.0;
        };
        // paper eq. 21: the matrix acts on the light that arrives
        let child = term.after(power, filter * weight).scaled(1.0 / probability);
        let narrow = lobe.is_narrow();
        let delta_chain = if lobe.is_delta() { line.delta_chain + 1 } else { 0 };
        let forced = endurance(delta_chain, CERTAIN_DELTA_CHAIN);
        // A child survives in proportion to its power, so that photons stay alike. In generations that multiply,
        // the unit grows with them: their number stays the same and their weight grows. In those that hardly fade it
        // falls with them for a while: the length of a path is then no matter of chance until little is left of it.
        let fading = self.photon_plan.growth.powi(line.reflections as i32 + 1).max(LEAST_FADING);
        let unit = unit * fading;
        let survival = (child.total() / unit).min(1.0) * forced * self.crowd.born(self.stack.len());
        let expected = f64::from(child.total());
        if survival == 0.0 || rng.f32() >= survival {
            self.photons.ledger.roulette -= expected;
            return expected;
        }
        let class = if narrow && line.class != PathClass::Indirect {
            PathClass::Caustic
        } else {
            PathClass::Indirect
        };
        let beam = if class == PathClass::Caustic {
            let own = met.has_own_normals() && !geometric;
            let normals = if own { point.normals } else { Normals::flat(point.normals.geometric) };
            let bend = |step: Vec3| match own {
                true => self.plan.scene.bend(met, step),
                false => Vec3::ZERO,
            };
            let beam = line.beam.at(line.direction, distance, point.normals.geometric);
            let beam = beam.scattered(&lobe, &normals, [from, to], bend);
            match pdf {
                Pdf::Delta(share) => beam.thinned(probability * share * survival),
                Pdf::SolidAngle(density) => beam.blurred(to, density).thinned(probability * survival),
            }
        } else {
            line.beam
        };
        let power = child.scaled(1.0 / survival);
        self.photons.ledger.roulette += f64::from(power.total()) - expected;
        self.stack.push(Line {
            origin: point.origin_towards(to),
            direction: to,
            power,
            falloff: Falloff::Physical,
            reflections: line.reflections + 1,
            delta_chain,
            class,
            orders,
            reradiated: line.reradiated || term.turn.is_reradiated(),
            beam,
            absorption: self.plan.rays.absorption_towards(material, point, to).unwrap_or(line.absorption),
        });
        expected
    }

    fn account(&mut self, arriving: P, sent_on: f64, straight: P) {
        let ledger = &mut self.photons.ledger;
        let stays = f64::from(arriving.total()) - sent_on - f64::from(straight.total());
        if stays >= 0.0 {
            ledger.absorbed += stays;
        } else {
            ledger.created -= stays;
        }
    }
}

/// Chooses a term in proportion to the power it could send on. None where nothing is reflected.
fn choose_term<P: Power>(
    bsdf: &Bsdf,
    point: &SurfacePoint,
    from: Vec3,
    power: P,
    rng: &mut Rng,
) -> Option<(usize, f32)> {
    let strength = |k: usize| {
        let term = &bsdf.terms[k];
        if term.lobe.responds(&point.normals, from) {
            power.through(term.coefficient).filtered(term.lobe.share(&point.normals, from)).total()
        } else {
            0.0
        }
    };
    match bsdf.terms.len() {
        1 => (strength(0) > 0.0).then_some((0, 1.0)),
        n => choose(n, strength, rng.f32()),
    }
}

#[cfg(test)]
mod tests;
