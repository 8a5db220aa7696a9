use super::luminaires::{Luminaires, Sky};
use super::numbers::Numbers;
use super::population::{LONG, Population, unit_at_first};
use super::reads::Reads;
use crate::light::Light;
use crate::optics::{Bsdf, Dielectric, Lobe, Normals, RoughDielectric, Term, Transport};
use crate::rays::{Hit, Ray, Rays, left_of};
use crate::sampling::{endurance, power_heuristic};
use crate::scene::{Material, MatterAt, Scene, SurfacePoint, View};
use glam::Vec3;
use std::ops::AddAssign;

/// What all walks of a pass have in common.
pub(super) struct Walk<'a> {
    pub scene: &'a Scene,
    rays: &'a Rays,
    luminaires: &'a Luminaires,
    max_reflections: u32,
    /// What pixels are as seen from the camera; None: points.
    looks: Option<Looks>,
    /// Some straight matrix has a nonzero first row: rows that read the invisible half may go through.
    lets_invisible_through: bool,
    /// Some straight matrix has a nonzero second row.
    lets_visible_through: bool,
}

/// A film as walks see it.
#[derive(Clone, Copy)]
struct Looks {
    view: View,
    rows: u32,
}

impl Looks {
    /// Side (m) of what a pixel covers at the end of a way (m) through nothing but delta lobes.
    fn at(&self, travelled: f32) -> f32 {
        self.view.footprint(travelled, self.rows)
    }
}

/// From where a walk starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Looker {
    /// To it, backs may be unseen.
    Camera,
    /// A surface asks what light comes to it.
    Surface,
}

/// A straight line yet to be followed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<const N: usize> {
    origin: Vec3,
    direction: Vec3,
    pub reads: Reads<N>,
    reflections: u32,
    /// What counts as all that its pixel reads.
    unit: f32,
    /// It comes from the camera through nothing but delta lobes: what the eye does not see is not there.
    seen: bool,
    /// Length of the walk before it, m.
    travelled: f32,
    /// Product of the η² factors of refraction in `reads`, which say nothing about how much light is to be had.
    compression: f32,
    /// Density in solid angle with which the direction was chosen, None where a connection had no chance of it.
    pdf_solid_angle: Option<f32>,
    /// What absorbs light where it begins, m⁻¹.
    absorption: Vec3,
}

/// What one camera sample reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reading<const N: usize> {
    /// For each row, W m⁻² sr⁻¹.
    pub radiance: [Vec3; N],
    /// The part without any reflection.
    pub emitted: [Vec3; N],
    /// Straight lines followed.
    pub lines: u64,
}

/// Buffers of one thread; they carry nothing from sample to sample.
#[derive(Default)]
pub(super) struct Scratch<const N: usize> {
    hits: Vec<Hit>,
    lines: Vec<Line<N>>,
}

/// A surface that some row can read.
struct Encounter<'a, const N: usize> {
    at: SurfacePoint,
    /// Unit, back along the line.
    from: Vec3,
    material: &'a Material,
    bsdf: &'a Bsdf,
    /// Before this surface's matrix.
    reads: Reads<N>,
    line: &'a Line<N>,
    /// What absorbs light on the side of `from`, m⁻¹.
    absorption: Vec3,
    /// Length of the walk to here, m.
    travelled: f32,
}

impl<'a> Walk<'a> {
    /// Walks in `scene` that end after `max_reflections`.
    pub fn new(
        scene: &'a Scene,
        rays: &'a Rays,
        luminaires: &'a Luminaires,
        max_reflections: Option<u32>,
    ) -> Self {
        let straight = || scene.materials.iter().map(|material| material.bsdf.straight.rows());
        Self {
            scene,
            rays,
            luminaires,
            max_reflections: max_reflections.unwrap_or(u32::MAX),
            looks: None,
            lets_invisible_through: straight().any(|rows| rows[0] != [0.0; 2]),
            lets_visible_through: straight().any(|rows| rows[1] != [0.0; 2]),
        }
    }

    /// What the camera sees is as coarse as the pixels of a film so many rows high.
    pub fn through(self, view: View, rows: u32) -> Self {
        Self { looks: Some(Looks { view, rows }), ..self }
    }

    /// What rows `start` read along a ray from `looker`.
    pub fn gather<const N: usize>(
        &self,
        looker: Looker,
        start: Reads<N>,
        origin: Vec3,
        direction: Vec3,
        numbers: &mut Numbers<'_>,
        scratch: &mut Scratch<N>,
    ) -> Reading<N> {
        let mut reading = Reading::ZERO;
        let mut population = Population::default();
        let camera = Line {
            origin,
            direction,
            reads: start,
            reflections: 0,
            unit: start.total(),
            seen: looker == Looker::Camera,
            travelled: 0.0,
            compression: 1.0,
            pdf_solid_angle: None,
            absorption: Vec3::ZERO,
        };
        scratch.lines.push(camera);
        while let Some(line) = scratch.lines.pop() {
            reading.lines += 1;
            self.follow(&line, &mut reading, &mut population, numbers, scratch);
            population.thin(&mut scratch.lines, numbers);
        }
        reading
    }

    /// One line: reads emission and bears branches at each surface in order, as far as some row reads anything.
    fn follow<const N: usize>(
        &self,
        line: &Line<N>,
        reading: &mut Reading<N>,
        population: &mut Population,
        numbers: &mut Numbers<'_>,
        scratch: &mut Scratch<N>,
    ) {
        self.cross(line, &mut scratch.hits);
        let mut reads = line.reads;
        let (mut absorption, mut before) = (line.absorption, 0.0);
        for hit in &scratch.hits {
            let material = self.scene.material_of(hit.triangle);
            if absorption != Vec3::ZERO {
                reads = reads.filtered(left_of(absorption, hit.t - before));
            }
            before = hit.t;
            let scatters = line.reflections < self.max_reflections
                && material.bsdf.terms.iter().any(|term| !reads.before(term).is_zero());
            let absorbs = self.rays.absorb() && material.is_solid();
            let mut straight = material.bsdf.straight;
            if scatters || absorbs || material.emission.is_some() || material.has_holes() {
                let footprint = if line.seen {
                    self.looks.map_or(0.0, |looks| looks.at(line.travelled + hit.t))
                } else {
                    0.0
                };
                let MatterAt { point: at, bsdf, seen, .. } =
                    self.scene.matter_at(hit.triangle, hit.u, hit.v, footprint);
                let from = -line.direction;
                straight = bsdf.straight;
                if let Some(emission) = seen {
                    let cos = from.dot(at.normals.geometric);
                    if cos > 0.0 || emission.two_sided {
                        let weight = self.chance_weight(line, hit, cos.abs());
                        reading.add(reads.scaled(weight), emission.radiance, line.reflections);
                    }
                }
                let beyond = self.rays.absorption_towards(material, &at, line.direction);
                if scatters {
                    let travelled = line.travelled + hit.t;
                    let encounter =
                        Encounter { at, from, material, bsdf: &bsdf, reads, line, absorption, travelled };
                    let child = self.encounter(&encounter, reading, population, numbers);
                    scratch.lines.extend(child);
                }
                absorption = beyond.unwrap_or(absorption);
            }
            reads = reads.through(straight);
            if reads.is_zero() {
                return;
            }
        }
        self.escape(line, reads.filtered(left_of(absorption, f32::INFINITY)), reading);
    }

    /// A line that meets nothing more reads what shines at infinity.
    fn escape<const N: usize>(&self, line: &Line<N>, reads: Reads<N>, reading: &mut Reading<N>) {
        for Sky { light, pdf_solid_angle: by_connection } in self.luminaires.skies(self.scene, line.direction)
        {
            let weight = line.pdf_solid_angle.map_or(1.0, |by_chance| match by_connection {
                0.0 => 1.0,
                _ => power_heuristic(by_chance, by_connection),
            });
            reading.add(reads.scaled(weight), light, line.reflections);
        }
    }

    /// The surfaces along a line, in order, as far as its rows can see.
    fn cross<const N: usize>(&self, line: &Line<N>, hits: &mut Vec<Hit>) {
        let ray = Ray { origin: line.origin, direction: line.direction, t_max: f32::INFINITY };
        let goes_through = (self.lets_invisible_through && line.reads.any_invisible())
            || (self.lets_visible_through && line.reads.any_visible());
        match (goes_through, line.seen) {
            (true, true) => self.rays.crossings_seen(&ray, hits),
            (true, false) => self.rays.crossings(&ray, hits),
            (false, seen) => {
                hits.clear();
                hits.extend(if seen { self.rays.closest_seen(&ray) } else { self.rays.closest(&ray) });
            }
        }
    }

    /// Weight of a luminaire that was found by chance at cosine `cos`.
    fn chance_weight<const N: usize>(&self, line: &Line<N>, hit: &Hit, cos: f32) -> f32 {
        line.pdf_solid_angle
            .map_or(1.0, |by_chance| power_heuristic(by_chance, self.luminaires.pdf_solid_angle(hit, cos)))
    }

    /// Scattering at one surface: a connection to a luminaire, and perhaps a branch.
    fn encounter<const N: usize>(
        &self,
        encounter: &Encounter<'_, N>,
        reading: &mut Reading<N>,
        population: &mut Population,
        numbers: &mut Numbers<'_>,
    ) -> Option<Line<N>> {
        let line = encounter.line;
        let shares: f32 = encounter.bsdf.terms.iter().map(|term| encounter.share(term)).sum();
        let total = shares / line.compression;
        if total == 0.0 {
            return None;
        }
        let unit = if line.reflections == 0 { unit_at_first(total, line.unit) } else { line.unit };
        let survival = population.survival(total, unit);
        if survival < 1.0 && numbers.one() >= survival {
            return None;
        }
        let reads = encounter.reads.scaled(1.0 / survival);
        self.connect(encounter, reads, shares, reading, numbers);

        let endurance = endurance(line.reflections, LONG);
        if endurance < 1.0 && numbers.one() >= endurance {
            return None;
        }
        let (term, probability) = encounter.choose(shares, numbers)?;
        let carried = || reads.colours();
        let (lobe, filter) =
            self.rays.lobe_for(term.lobe, encounter.material, &encounter.at, carried, || numbers.one());
        let term = Term { lobe, ..*term };
        let child = encounter.branch(&term, reads.filtered(filter), probability, endurance, numbers)?;
        population.grow();
        let absorption = self.absorption(encounter, child.direction);
        Some(Line { unit, absorption, ..child })
    }

    /// Next-event estimation: what a random luminaire sends here, through whatever lies between.
    fn connect<const N: usize>(
        &self,
        encounter: &Encounter<'_, N>,
        reads: Reads<N>,
        shares: f32,
        reading: &mut Reading<N>,
        numbers: &mut Numbers<'_>,
    ) {
        if !encounter.bsdf.has_finite_lobe() {
            return;
        }
        let Some(connection) = self.luminaires.connect(self.scene, &encounter.at, numbers) else { return };
        let (normals, from, to) = (&encounter.at.normals, encounter.from, connection.to);
        let cos = to.dot(normals.shading).abs();
        let mut between = None;
        for term in &encounter.bsdf.terms {
            let lobe = self.rays.lobe_at(term.lobe, &encounter.at);
            let value = lobe.eval(normals, from, to) * cos;
            let reads = reads.before(term).filtered(value);
            if reads.is_zero() {
                continue;
            }
            let weight = connection.pdf_solid_angle.map_or(1.0, |by_connection| {
                let by_chance = encounter.share(term) / shares * lobe.pdf(normals, from, to);
                power_heuristic(by_connection, by_chance)
            });
            let (between, left) = *between.get_or_insert_with(|| {
                self.rays.passed(self.scene, &connection.segment, self.absorption(encounter, to))
            });
            let reads = reads.through(between).filtered(left).scaled(weight);
            reading.add(reads, connection.light, encounter.line.reflections + 1);
        }
    }
}

impl Walk<'_> {
    /// What absorbs light on the side `out` of an encounter, m⁻¹.
    fn absorption<const N: usize>(&self, encounter: &Encounter<'_, N>, out: Vec3) -> Vec3 {
        let beyond = self.rays.absorption_towards(encounter.material, &encounter.at, out);
        beyond.unwrap_or(encounter.absorption)
    }
}

impl<const N: usize> Encounter<'_, N> {
    /// A bound of how much a branch by `term` would read.
    fn share(&self, term: &Term) -> f32 {
        if term.lobe.responds(&self.at.normals, self.from) {
            self.reads.before(term).filtered(term.lobe.share(&self.at.normals, self.from)).total()
        } else {
            0.0
        }
    }

    /// A term in proportion to its share of the sum `shares`, and its probability.
    fn choose(&self, shares: f32, numbers: &mut Numbers<'_>) -> Option<(&Term, f32)> {
        if let [only] = self.bsdf.terms.as_slice() {
            return Some((only, 1.0));
        }
        let mut rest = numbers.one() * shares;
        let mut chosen = None;
        for term in &self.bsdf.terms {
            let share = self.share(term);
            if share > 0.0 {
                chosen = Some((term, share / shares));
                rest -= share;
                if rest < 0.0 {
                    break;
                }
            }
        }
        chosen
    }

    /// The line that `term` scatters into. None: absorbed.
    fn branch(
        &self,
        term: &Term,
        reads: Reads<N>,
        probability: f32,
        endurance: f32,
        numbers: &mut Numbers<'_>,
    ) -> Option<Line<N>> {
        let normals = &self.at.normals;
        let u = match term.lobe {
            Lobe::Mirror(_) => [0.0; 3],
            Lobe::Diffuse(_) => {
                let [u, v] = numbers.next();
                [u, v, 0.0]
            }
            _ if term.lobe.is_delta() => [0.0, 0.0, numbers.one()],
            _ => numbers.next(),
        };
        let sample = term.lobe.sample(normals, self.from, Transport::Gathering, u)?;
        let reads = reads.before(term).filtered(sample.weight);
        Some(Line {
            origin: self.at.origin_towards(sample.to),
            direction: sample.to,
            reads: reads.scaled(1.0 / (probability * endurance)),
            reflections: self.line.reflections + 1,
            unit: self.line.unit,
            seen: self.line.seen && term.lobe.is_delta(),
            travelled: self.travelled,
            compression: self.line.compression * compression(&term.lobe, normals, self.from, sample.to),
            pdf_solid_angle: sample.pdf.solid_angle().map(|density| probability * density),
            absorption: self.absorption,
        })
    }
}

impl<const N: usize> Reading<N> {
    /// Nothing read.
    pub const ZERO: Self = Self { radiance: [Vec3::ZERO; N], emitted: [Vec3::ZERO; N], lines: 0 };

    /// Reads `light` that was reflected so many times.
    fn add(&mut self, reads: Reads<N>, light: Light, reflections: u32) {
        for (row, value) in reads.of(light).into_iter().enumerate() {
            self.radiance[row] += value;
            if reflections == 0 {
                self.emitted[row] += value;
            }
        }
    }

    /// The mean of `count` readings that were summed; lines are not averaged.
    pub fn over(self, count: u32) -> Self {
        let mean = |sum: Vec3| sum / count as f32;
        Self { radiance: self.radiance.map(mean), emitted: self.emitted.map(mean), lines: self.lines }
    }
}

impl<const N: usize> AddAssign for Reading<N> {
    fn add_assign(&mut self, other: Self) {
        for row in 0..N {
            self.radiance[row] += other.radiance[row];
            self.emitted[row] += other.emitted[row];
        }
        self.lines += other.lines;
    }
}

/// By what refraction scales radiance on the way from `from` to `to`: η² of the side left over that of the side entered.
fn compression(lobe: &Lobe, normals: &Normals, from: Vec3, to: Vec3) -> f32 {
    match lobe {
        Lobe::Dielectric(Dielectric { ior, .. }) | Lobe::RoughDielectric(RoughDielectric { ior, .. })
            if normals.is_front(from) != normals.is_front(to) =>
        {
            if normals.is_front(from) {
                1.0 / (ior * ior)
            } else {
                ior * ior
            }
        }
        _ => 1.0,
    }
}
