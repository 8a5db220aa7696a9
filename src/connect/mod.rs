//! Direct light by connection: from a camera hit to a point on a luminaire.
//!
//! Where nothing hides a uniformly bright triangle, its irradiance has a closed form, which [`Connections::unhidden`] sums.

mod polygon;
mod sights;

pub use sights::{Sights, Trial};

use crate::emission::ALIKE;
use crate::light::Light;
use crate::rays::Segment;
use crate::sampling::{Cumulative, warp};
use crate::scene::{Luminaire, Part, Parts, Scene, SurfacePoint, versine_between, warn_falloff};
use glam::{DVec3, Vec3};
use polygon::{Facet, Plane};
use sights::Cell;
use std::collections::HashMap;
use std::f32::consts::{FRAC_1_PI, PI};
use std::ops::Add;

/// Light that arrives at a camera hit along one connection.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// Unit direction to the luminaire.
    pub wi: Vec3,
    /// Radiance / pdf in solid angle for area luminaires, irradiance on a facing surface for punctual ones; both
    /// are to be multiplied by `f |wi·ns|`. Visibility is not in it.
    pub light: Light,
    /// The segment that must be looked through, from the camera hit outward.
    pub segment: Segment,
    /// Density in solid angle (sr⁻¹) with which a connection leads this way. None: by chance nobody comes to this luminaire.
    pub density: Option<f32>,
}

/// The luminaires as a camera hit sees them.
pub struct Connections {
    /// Punctual luminaires that are all connected at every hit, by index.
    every: Vec<u32>,
    /// What has an irradiance that is known where nothing hides it.
    closed_form: Vec<Facet>,
    /// Luminaires of which one is chosen, by index, and with which probabilities: by power, a share to all alike.
    one_of: Vec<u32>,
    choice: Cumulative,
    /// The place among them of each triangle that shines alike all over, where lines come upon them by chance too.
    place: HashMap<u32, u32>,
    /// And of parts of triangles.
    parts: Parts<u32>,
    /// The place of each of the skies among those that are chosen from, where chance leads to them too. None: it alone does.
    skies: Vec<Option<u32>>,
    /// Radiance of an environment that is the same from everywhere, where that has a closed form.
    even_sky: Light,
    /// Nothing hides any luminaire.
    all_is_seen: bool,
}

/// Which surfaces ask for connections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobes {
    /// Lambert's reflectors alone.
    Lambert,
    /// Others too, whose light a closed form does not tell, and from which lines may come upon luminaires by chance.
    Any,
}

/// Up to so many punctual luminaires are summed; beyond, one is chosen like any other.
const SUMMED_PUNCTUALS: usize = 16;

/// By index: punctual luminaires that are all connected at every hit, and the others.
pub(crate) fn summed_and_others(scene: &Scene) -> (Vec<u32>, Vec<u32>) {
    let all = 0..scene.luminaires.len() as u32;
    let is_delta = |i: &u32| scene.luminaires[*i as usize].is_delta();
    if all.clone().filter(is_delta).count() > SUMMED_PUNCTUALS {
        return (Vec::new(), all.collect());
    }
    all.partition(is_delta)
}

impl Connections {
    /// To no luminaire.
    pub fn none() -> Self {
        Self {
            every: Vec::new(),
            closed_form: Vec::new(),
            one_of: Vec::new(),
            choice: Cumulative::default(),
            place: HashMap::new(),
            parts: Parts::default(),
            skies: Vec::new(),
            even_sky: Light::ZERO,
            all_is_seen: false,
        }
    }

    /// Decides which luminaires are summed and which are chosen from. Those of `closed_form`, by index, have an irradiance that is
    /// known where nothing hides them: everywhere, if `all_is_seen`.
    pub fn new(scene: &Scene, closed_form: &[u32], all_is_seen: bool, lobes: Lobes) -> Self {
        let (_, radius) = scene.bounding_sphere();
        let (every, others) = summed_and_others(scene);
        let even_sky = even_sky(scene, closed_form);
        let closed_form = Facet::of(scene, closed_form);
        let (mut one_of, mut powers) = (Vec::new(), Vec::new());
        let mut sum = 0.0;
        // Where nothing is hidden the closed form is all.
        let known = !closed_form.is_empty() || !even_sky.is_zero();
        let hidden = !known || !all_is_seen || lobes == Lobes::Any;
        for i in others.into_iter().filter(|_| hidden) {
            let power = f64::from(scene.luminaires[i as usize].power(radius).total());
            if power > 0.0 {
                sum += power;
                one_of.push(i);
                powers.push(power);
            }
        }
        // In proportion to power, a share of all alike: the strongest may be behind a wall.
        let alike = ALIKE / powers.len() as f64;
        let choice = Cumulative::new(powers.into_iter().map(|power| (1.0 - ALIKE) * power / sum + alike));
        let by_chance = || one_of.iter().zip(0..).filter(|_| lobes == Lobes::Any);
        let whole = |(&luminaire, place): (&u32, u32)| match scene.luminaires[luminaire as usize] {
            Luminaire::Triangle { triangle, part: None, .. } => Some((triangle, place)),
            _ => None,
        };
        let part = |(&luminaire, place): (&u32, u32)| match scene.luminaires[luminaire as usize] {
            Luminaire::Triangle { triangle, part: Some(part), .. } => Some((triangle, part, place)),
            _ => None,
        };
        let (place, parts) = (by_chance().filter_map(whole).collect(), by_chance().filter_map(part));
        let parts = Parts::new(parts);
        let connected = |sky: u32| one_of.iter().position(|own| *own == sky).filter(|_| lobes == Lobes::Any);
        let skies = scene.lighting_skies().into_iter();
        let skies = skies.map(|sky| sky.and_then(connected).map(|place| place as u32)).collect();
        Self { every, closed_form, one_of, choice, place, parts, skies, even_sky, all_is_seen }
    }

    /// Of how many luminaires each sample chooses one; the others are all summed.
    pub fn chosen_among(&self) -> usize {
        self.one_of.len()
    }

    /// Calls `visit` with the connections to the luminaires that are all connected at every hit.
    pub fn to_all(&self, scene: &Scene, point: &SurfacePoint, mut visit: impl FnMut(Connection)) {
        for &i in &self.every {
            if let Some(connection) = connect(scene, &scene.luminaires[i as usize], point, [0.5, 0.5]) {
                visit(connection);
            }
        }
    }

    /// Irradiance (W m⁻²) on the side of `wo`, of both halves, of the luminaires that have a closed form, as if nothing hid
    /// them.
    pub fn unhidden(&self, point: &SurfacePoint, wo: Vec3) -> Light {
        let front = point.normals.is_front(wo);
        let shine = self.closed_form.iter().filter(|facet| facet.shines_on(point));
        let light = shine.map(|facet| {
            facet.projected_solid_angle(point.position, &point.normals, front) * facet.emission.radiance
        });
        light.fold(PI * point.normals.share_above() * self.even_sky, Light::add)
    }

    /// True when some luminaires have a closed form.
    pub fn has_closed_form(&self) -> bool {
        !self.closed_form.is_empty() || !self.even_sky.is_zero()
    }

    /// True when there are luminaires of which one is chosen.
    pub fn are_sampled(&self) -> bool {
        !self.one_of.is_empty()
    }

    /// True when the closed form is all the direct light that there is on Lambert's reflectors.
    pub fn are_known(&self) -> bool {
        self.has_closed_form() && self.all_is_seen
    }

    /// Density in solid angle (sr⁻¹) with which a connection from `point` would have led along a line that met `target`, a point of
    /// a triangle, at distance `t` and cosine `cos`. Zero where none ever does.
    pub fn density(
        &self,
        scene: &Scene,
        sights: Option<&Sights>,
        point: &SurfacePoint,
        target: &SurfacePoint,
        [t, cos]: [f32; 2],
    ) -> f32 {
        let place = self.place.get(&target.triangle).copied();
        let Some(place) = place.or_else(|| self.parts.at(target.triangle, [target.u, target.v])) else {
            return 0.0;
        };
        let Luminaire::Triangle { triangle, part, emission, area } =
            scene.luminaires[self.one_of[place as usize] as usize]
        else {
            return 0.0;
        };
        if !Plane::through(scene.mesh.corners(triangle)).lights(point, emission.two_sided) {
            return 0.0;
        }
        let corners = corners_of(scene, triangle, part);
        let corners = corners.map(|corner| (corner - point.position).as_dvec3());
        let density =
            match is_near(&corners, area).then(|| solid_angle(corners.map(DVec3::normalize))).flatten() {
                Some(sr) => 1.0 / sr as f32,
                None => t * t / (cos * area),
            };
        self.probability(cell_of(sights, point), place as usize) * density
    }

    /// What luminaires at infinity radiate from the unit vector `to`: each, its light (W m⁻² sr⁻¹) and the density in solid angle
    /// (sr⁻¹) with which a connection would have led there; zero where none ever does.
    pub fn skies<'a>(
        &'a self,
        scene: &'a Scene,
        sights: Option<&'a Sights>,
        point: Option<&'a SurfacePoint>,
        to: Vec3,
    ) -> impl Iterator<Item = (&'a Luminaire, Light, f32)> + 'a {
        scene.skies.iter().zip(&self.skies).filter_map(move |(luminaire, place)| {
            let light = scene.radiance_from(luminaire, to);
            let density = || match (place, point) {
                (Some(place), Some(point)) => {
                    let cell = cell_of(sights, point);
                    self.probability(cell, *place as usize) * sky_density(scene, luminaire, cell, to)
                }
                _ => 0.0,
            };
            (!light.is_zero()).then(|| (luminaire, light, density()))
        })
    }

    /// With which probability a connection from a cell leads to a luminaire that is chosen from.
    fn probability(&self, cell: Option<&Cell>, place: usize) -> f32 {
        cell.and_then(|cell| cell.probability(place)).unwrap_or_else(|| self.choice.weight(place) as f32)
    }

    /// With which probabilities luminaires are chosen, and which of them is an environment: what [`Sights`] are learned by.
    pub fn choice(&self, scene: &Scene) -> (Vec<f32>, Option<u32>) {
        let is_sky = |i: &u32| matches!(scene.luminaires[*i as usize], Luminaire::Environment { .. });
        let invertible = scene.environment.as_ref().is_some_and(|environment| environment.is_invertible());
        let sky = self.one_of.iter().position(is_sky).filter(|_| invertible);
        let even = (0..self.one_of.len()).map(|place| self.choice.weight(place) as f32).collect();
        (even, sky.map(|place| place as u32))
    }

    /// A connection as without [`Sights`], and which of the luminaires it leads to.
    pub fn try_one(&self, scene: &Scene, point: &SurfacePoint, u: [f32; 3]) -> Option<(u32, Connection)> {
        self.one_from(scene, None, point, u)
    }

    /// One connection to one of the luminaires that are chosen from, by three numbers in [0, 1); it is unbiased for
    /// all of them. None: the one chosen does not shine there.
    pub fn to_one(
        &self,
        scene: &Scene,
        sights: Option<&Sights>,
        point: &SurfacePoint,
        u: [f32; 3],
    ) -> Option<Connection> {
        self.one_from(scene, cell_of(sights, point), point, u).map(|(_, connection)| connection)
    }

    fn one_from(
        &self,
        scene: &Scene,
        cell: Option<&Cell>,
        point: &SurfacePoint,
        u: [f32; 3],
    ) -> Option<(u32, Connection)> {
        if self.one_of.is_empty() {
            return None;
        }
        let even = || {
            let chosen = self.choice.index(f64::from(u[0]));
            (chosen, self.choice.weight(chosen) as f32)
        };
        let (chosen, probability) = cell.and_then(|cell| cell.choose(u[0])).unwrap_or_else(even);
        let luminaire = &scene.luminaires[self.one_of[chosen] as usize];
        let place = [u[1], u[2]];
        let (place, guided) = match (luminaire, cell) {
            (Luminaire::Environment { .. }, Some(cell)) => cell.of_sky(place),
            _ => (place, 1.0),
        };
        let probability = probability * guided;
        let connection = connect(scene, luminaire, point, place)?;
        let density = connection.density.map(|density| probability * density);
        let light = (1.0 / probability) * connection.light;
        Some((chosen as u32, Connection { light, density, ..connection }))
    }
}

/// A point of one luminaire, seen from `point`. None: it does not shine there.
fn connect(scene: &Scene, luminaire: &Luminaire, point: &SurfacePoint, u: [f32; 2]) -> Option<Connection> {
    match *luminaire {
        Luminaire::Triangle { triangle, part, emission, area } => {
            if !Plane::through(scene.mesh.corners(triangle)).lights(point, emission.two_sided) {
                return None;
            }
            let (target, density) = sample_triangle(scene, (triangle, part), area, point.position, u)?;
            let segment = Segment::to_surface(&scene.mesh, point, &target)?;
            let wi = segment.direction();
            let facing = -wi.dot(target.normals.geometric);
            if facing <= 0.0 && !emission.two_sided {
                return None;
            }
            let sr = match density {
                Density::SolidAngle(sr) => sr,
                Density::Area => facing.abs() * area / segment.length().powi(2) as f32,
            };
            let light = sr * scene.radiance_at(&target, part, emission);
            Some(Connection { wi, light, segment, density: Some(1.0 / sr) })
        }
        Luminaire::Point { position, intensity } => punctual(point, position, |_, _| 1.0, intensity),
        Luminaire::Spot { position, direction, intensity, cone } => {
            punctual(point, position, |out, _| cone.profile(versine_between(out, direction)), intensity)
        }
        Luminaire::Warn { position, direction, intensity, exponent, attenuation } => {
            let profile = |out: Vec3, r: f32| {
                let cos = out.dot(direction);
                let directional = match exponent {
                    0.0 => 1.0,
                    _ if cos <= 0.0 => 0.0,
                    _ => cos.powf(exponent),
                };
                directional * warn_falloff(attenuation, r)
            };
            punctual(point, position, profile, intensity)
        }
        Luminaire::Profile { position, intensity, profile } => {
            punctual(point, position, |out, _| scene.profiles[profile as usize].at(out), intensity)
        }
        Luminaire::Directional { direction, irradiance } => {
            let wi = -direction;
            let segment = Segment::from_towards(point, wi);
            Some(Connection { wi, light: irradiance, segment, density: None })
        }
        Luminaire::Sun { direction, radiance, versine } => {
            let wi = warp::to_world(-direction, warp::off_z(versine * u[0], u[1]));
            let density = 0.5 * FRAC_1_PI / versine;
            let segment = Segment::from_towards(point, wi);
            Some(Connection { wi, light: (1.0 / density) * radiance, segment, density: Some(density) })
        }
        Luminaire::Environment { .. } => {
            let (wi, density) = scene.environment.as_ref()?.sample(u);
            let light = (1.0 / density) * scene.radiance_from(luminaire, wi);
            Some(Connection { wi, light, segment: Segment::from_towards(point, wi), density: Some(density) })
        }
    }
}

/// What is seen from where a point lies. None: nobody knows.
fn cell_of<'a>(sights: Option<&'a Sights>, point: &SurfacePoint) -> Option<&'a Cell> {
    sights.and_then(|sights| sights.from(point))
}

/// Density in solid angle (sr⁻¹) with which [`connect`] chooses the unit vector `to`, where a luminaire at infinity shines from there.
fn sky_density(scene: &Scene, luminaire: &Luminaire, cell: Option<&Cell>, to: Vec3) -> f32 {
    match (luminaire, &scene.environment) {
        (Luminaire::Sun { versine, .. }, _) => 0.5 * FRAC_1_PI / versine,
        (_, Some(environment)) => {
            let guided = cell.map_or(1.0, |cell| cell.density_of_sky(environment.numbers(to)));
            guided * environment.density(to)
        }
        _ => 0.0,
    }
}

/// The radiance of an environment that is the same from everywhere, if it is among `luminaires`, by index.
fn even_sky(scene: &Scene, luminaires: &[u32]) -> Light {
    let is_sky = |i: &u32| matches!(scene.luminaires[*i as usize], Luminaire::Environment { .. });
    let constant = || scene.environment.as_ref().and_then(|environment| environment.as_constant());
    if luminaires.iter().any(is_sky) { constant().unwrap_or(Light::ZERO) } else { Light::ZERO }
}

/// Light of a punctual luminaire: intensity × profile(direction out of it, distance) / r².
fn punctual(
    point: &SurfacePoint,
    position: Vec3,
    profile: impl Fn(Vec3, f32) -> f32,
    intensity: Light,
) -> Option<Connection> {
    let segment = Segment::between(point, position)?;
    let (wi, r) = (segment.direction(), segment.length() as f32);
    let profile = profile(-wi, r);
    (profile > 0.0).then(|| Connection { wi, light: (profile / (r * r)) * intensity, segment, density: None })
}

enum Density {
    /// Uniform over the solid angle the triangle subtends (sr).
    SolidAngle(f32),
    /// Uniform over its area.
    Area,
}

/// Below this solid angle (sr) rounding in f64 spoils directions.
const SMALLEST_SOLID_ANGLE: f64 = 1e-6;

/// Where a triangle's area is below this share of the square of its distance, area is sampled: what is integrated is then so
/// nearly constant over it that finding the solid angle costs more than it saves.
const NEARLY_CONSTANT: f64 = 0.05;

/// Corners of a triangle, or of a part of it.
fn corners_of(scene: &Scene, triangle: u32, part: Option<Part>) -> [Vec3; 3] {
    let corners @ [a, b, c] = scene.mesh.corners(triangle);
    part.map_or(corners, |part| part.corners().map(|[u, v]| (1.0 - u - v) * a + u * b + v * c))
}

/// A point of a triangle, or of a part of it, uniform over its solid angle from `eye` where that is large enough to matter.
fn sample_triangle(
    scene: &Scene,
    (triangle, part): (u32, Option<Part>),
    area: f32,
    eye: Vec3,
    u: [f32; 2],
) -> Option<(SurfacePoint, Density)> {
    let point = |place: [f32; 2]| {
        let [b1, b2] = part.map_or(place, |part| part.place(place));
        scene.mesh.point(triangle, b1, b2, false)
    };
    let corners = corners_of(scene, triangle, part).map(|corner| (corner - eye).as_dvec3());
    if is_near(&corners, area)
        && let Some((direction, sr)) = sample_spherical_triangle(corners, u)
    {
        return Some((point(barycentrics(corners, direction)?), Density::SolidAngle(sr as f32)));
    }
    Some((point(warp::triangle(u)), Density::Area))
}

/// True where the solid angle of a triangle is sampled, not its area.
fn is_near(corners: &[DVec3; 3], area: f32) -> bool {
    let nearest = corners.iter().map(|corner| corner.length_squared()).fold(f64::INFINITY, f64::min);
    f64::from(area) > NEARLY_CONSTANT * nearest
}

/// The solid angle (sr) of a triangle with its corners in these unit directions. None where it is too small to be sampled.
/// A. Van Oosterom & J. Strackee 1983, "The solid angle of a plane triangle".
fn solid_angle([a, b, c]: [DVec3; 3]) -> Option<f64> {
    let six_volumes = a.dot(b.cross(c)).abs();
    let sr = 2.0 * six_volumes.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
    (sr > SMALLEST_SOLID_ANGLE).then_some(sr)
}

/// A direction uniform over the solid angle of the triangle `corners` (relative to the eye), and that angle in sr.
/// J. Arvo 1995, "Stratified sampling of spherical triangles". None where the angle is too small or the eye lies in
/// the triangle's plane.
fn sample_spherical_triangle(corners: [DVec3; 3], u: [f32; 2]) -> Option<(DVec3, f64)> {
    let [a, b, c] = corners.map(DVec3::normalize);
    let sr = solid_angle([a, b, c])?;
    let six_volumes = a.dot(b.cross(c)).abs();
    // The angle alpha at a.
    let (ab, ca) = (a.cross(b), c.cross(a));
    let scale = 1.0 / (ab.length_squared() * ca.length_squared()).sqrt();
    let (sin_alpha, cos_alpha) = (six_volumes * scale, -ab.dot(ca) * scale);
    let (u0, u1) = (f64::from(u[0]), f64::from(u[1]));
    // Sine and cosine of u0 sr − alpha.
    let (sin, cos) = (u0 * sr).sin_cos();
    let (s, t) = (sin * cos_alpha - cos * sin_alpha, cos * cos_alpha + sin * sin_alpha);
    let (p, q) = (t - cos_alpha, s + sin_alpha * a.dot(b));
    let cos_side = ((q * t - p * s) * cos_alpha - q) / ((q * s + p * t) * sin_alpha);
    let cos_side = if cos_side.is_finite() { cos_side.clamp(-1.0, 1.0) } else { 1.0 };
    let along = |from: DVec3, towards: DVec3, cos: f64| {
        let across = (towards - towards.dot(from) * from).normalize_or_zero();
        cos * from + (1.0 - cos * cos).max(0.0).sqrt() * across
    };
    let c_sub = along(a, c, cos_side);
    let z = 1.0 - u1 * (1.0 - c_sub.dot(b));
    let direction = along(b, c_sub, z);
    direction.is_finite().then_some((direction, sr))
}

/// Where `direction` from the eye meets the triangle's plane, as weights of the second and third corner, moved into
/// the triangle where rounding leaves it.
fn barycentrics([a, b, c]: [DVec3; 3], direction: DVec3) -> Option<[f32; 2]> {
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let b1 = -a.dot(p) / determinant;
    let b2 = direction.dot((-a).cross(e1)) / determinant;
    if !(b1.is_finite() && b2.is_finite()) {
        return None;
    }
    let b1 = b1.clamp(0.0, 1.0);
    Some([b1 as f32, b2.clamp(0.0, 1.0 - b1) as f32])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn directions_are_uniform_over_the_solid_angle() {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let octant = [x, 3.0 * y, 0.5 * z];
        let (_, sr) = sample_spherical_triangle(octant, [0.3, 0.6]).expect("seen");
        assert!((sr - FRAC_PI_2).abs() < 1e-14, "{sr}");
        // A lamp, one that is small and far, one seen edge-on, one behind and around the eye.
        let triangles = [
            octant,
            [DVec3::new(-0.2, -0.3, 1.5), DVec3::new(0.3, -0.3, 1.5), DVec3::new(0.3, 0.3, 1.4)],
            [DVec3::new(0.0, 9.0, 1.0), DVec3::new(0.1, 9.0, 1.0), DVec3::new(0.1, 9.1, 1.0)],
            [DVec3::new(-1.0, 0.01, 1.0), DVec3::new(1.0, 0.02, 1.0), DVec3::new(0.5, 0.015, 4.0)],
            [DVec3::new(-1.0, -1.0, 0.1), DVec3::new(1.2, -0.9, 0.1), DVec3::new(0.1, 1.5, 0.2)],
        ];
        let strata = 256;
        for corners in triangles {
            let [a, b, c] = corners.map(DVec3::normalize);
            let mut sum = DVec3::ZERO;
            for i in 0..strata * strata {
                let u = [i % strata, i / strata].map(|i| (i as f32 + 0.5) / strata as f32);
                let (direction, sr) = sample_spherical_triangle(corners, u).expect("seen");
                assert!((direction.length() - 1.0).abs() < 1e-9);
                let inside = [(a, b), (b, c), (c, a)].map(|(p, q)| direction.dot(p.cross(q).normalize()));
                let side = a.dot(b.cross(c)).signum();
                assert!(inside.iter().all(|inside| inside * side > -1e-6), "{direction}: {inside:?}");
                sum += sr * direction;
            }
            let mean = sum / f64::from(strata * strata);
            // The integral of the direction over the solid angle, by its edges.
            let edge = |p: DVec3, q: DVec3| 0.5 * p.angle_between(q) * p.cross(q).normalize();
            let exact = (edge(a, b) + edge(b, c) + edge(c, a)) * a.dot(b.cross(c)).signum();
            let off = (mean - exact).length() / exact.length();
            // A tenth of the 2 % that must be told.
            assert!(off < 2e-3, "{mean} for {exact}");
        }
    }

    #[test]
    fn triangles_that_are_hardly_seen_have_no_solid_angle_to_sample() {
        let far = [DVec3::new(0.0, 0.0, 1e4), DVec3::new(1.0, 0.0, 1e4), DVec3::new(0.0, 1.0, 1e4)];
        let edge_on = [DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 0.5, 0.0)];
        let at_a_corner = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for corners in [far, edge_on, at_a_corner] {
            assert_eq!(sample_spherical_triangle(corners, [0.4, 0.7]), None, "{corners:?}");
        }
    }
}
