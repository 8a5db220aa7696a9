use super::numbers::Numbers;
use crate::light::{Light, Matrix};
use crate::rays::{Hit, Segment};
use crate::sampling::{Cumulative, warp};
use crate::scene::{Luminaire, Parts, Scene, SurfacePoint, versine_between};
use glam::Vec3;
use std::f32::consts::TAU;

/// The luminaires that can be connected to; the default has none, which leaves finding them to chance.
#[derive(Default)]
pub(super) struct Luminaires {
    /// Running sum of power, W; as long as the scene's list.
    choice: Cumulative,
    /// For each triangle of the mesh, the density (m⁻²) with which a connection ends at a point of it.
    pdf_area: Vec<f32>,
    /// Of triangles that do not shine alike all over, the same for each part.
    of_parts: Parts<f32>,
    /// The probability of choosing each of the scene's skies; none where nothing is connected to.
    skies: Vec<f32>,
}

/// A luminaire at infinity from some direction.
pub(super) struct Sky {
    /// Its radiance, W m⁻² sr⁻¹.
    pub light: Light,
    /// Density in solid angle with which a connection would have led there; zero where none does.
    pub pdf_solid_angle: f32,
}

/// A connection from a surface point to a luminaire, before anything is known about what lies between.
pub(super) struct Connection {
    /// Unit direction to the luminaire.
    pub to: Vec3,
    /// From the surface point to the luminaire, both ends left out.
    pub segment: Segment,
    /// Irradiance on a surface that faces the luminaire over the probability of this connection, W m⁻².
    pub light: Light,
    /// Density of `to` in solid angle; None where no other way leads to this luminaire.
    pub pdf_solid_angle: Option<f32>,
}

impl Luminaires {
    /// All luminaires of a scene, to be chosen in proportion to the power that any surface reads.
    pub fn new(scene: &Scene) -> Self {
        let (_, radius) = scene.bounding_sphere();
        let visible = reads_visible(scene);
        let powers = scene.luminaires.iter().map(|luminaire| {
            let power = luminaire.power(radius);
            f64::from(if visible { power.total() } else { power.invisible.element_sum() })
        });
        let (choice, pdf_area) = (Cumulative::new(powers), vec![0.0; scene.mesh.triangles.len()]);
        let mut luminaires = Self { choice, pdf_area, of_parts: Parts::default(), skies: Vec::new() };
        let mut parts = Vec::new();
        for (index, luminaire) in scene.luminaires.iter().enumerate() {
            if let Luminaire::Triangle { triangle, part, area, .. } = *luminaire {
                let pdf_area = luminaires.pdf_area(index, area);
                match part {
                    _ if pdf_area == 0.0 => {}
                    None => luminaires.pdf_area[triangle as usize] = pdf_area,
                    Some(part) => parts.push((triangle, part, pdf_area)),
                }
            }
        }
        luminaires.of_parts = Parts::new(parts);
        let probability =
            |sky: Option<u32>| sky.map_or(0.0, |index| luminaires.probability(index as usize) as f32);
        luminaires.skies = scene.lighting_skies().into_iter().map(probability).collect();
        luminaires
    }

    /// Density (m⁻²) on a luminaire of some area.
    fn pdf_area(&self, index: usize, area: f32) -> f32 {
        (self.probability(index) / f64::from(area)) as f32
    }

    /// Density in solid angle with which a connection would have led along a line that meets a triangle at cosine `cos`; zero where
    /// none ever ends.
    pub fn pdf_solid_angle(&self, hit: &Hit, cos: f32) -> f32 {
        let whole = self.pdf_area.get(hit.triangle as usize).copied().unwrap_or(0.0);
        let pdf_area = match whole {
            0.0 => self.of_parts.at(hit.triangle, [hit.u, hit.v]).unwrap_or(0.0),
            _ => whole,
        };
        if pdf_area == 0.0 { 0.0 } else { pdf_area * (hit.t * hit.t / cos) }
    }

    /// What luminaires at infinity send from the unit vector `to`.
    pub fn skies<'a>(&'a self, scene: &'a Scene, to: Vec3) -> impl Iterator<Item = Sky> + 'a {
        scene.skies.iter().enumerate().filter_map(move |(i, luminaire)| {
            let light = scene.radiance_from(luminaire, to);
            let probability = self.skies.get(i).copied().unwrap_or(0.0);
            let pdf =
                || if probability == 0.0 { 0.0 } else { probability * pdf_of_sky(scene, luminaire, to) };
            (!light.is_zero()).then(|| Sky { light, pdf_solid_angle: pdf() })
        })
    }

    /// A connection from `at` to a random point of a random luminaire. None: dark from there.
    pub fn connect(&self, scene: &Scene, at: &SurfacePoint, numbers: &mut Numbers<'_>) -> Option<Connection> {
        let index = match self.choice.len() {
            0 => return None,
            1 => 0,
            _ => self.choice.index(numbers.fine() * self.choice.total()),
        };
        let probability = self.probability(index) as f32;
        if probability == 0.0 {
            return None;
        }
        match scene.luminaires[index] {
            Luminaire::Triangle { triangle, part, emission, area } => {
                let place = warp::triangle(numbers.next());
                let [u, v] = part.map_or(place, |part| part.place(place));
                let end = scene.mesh.point(triangle, u, v, false);
                let segment = Segment::to_surface(&scene.mesh, at, &end)?;
                let offset = end.position - at.position;
                let distance2 = offset.length_squared();
                let to = offset / distance2.sqrt();
                let cos = -to.dot(end.normals.geometric);
                if !(cos > 0.0 || emission.two_sided) {
                    return None;
                }
                let pdf_solid_angle = self.pdf_area(index, area) * (distance2 / cos.abs());
                let light = (1.0 / pdf_solid_angle) * scene.radiance_at(&end, part, emission);
                Some(Connection { to, segment, light, pdf_solid_angle: Some(pdf_solid_angle) })
            }
            Luminaire::Directional { direction, irradiance } => {
                let to = -direction;
                let segment = Segment::from_towards(at, to);
                let light = (1.0 / probability) * irradiance;
                Some(Connection { to, segment, light, pdf_solid_angle: None })
            }
            Luminaire::Sun { direction, radiance, versine } => {
                let [u, v] = numbers.next();
                let to = warp::to_world(-direction, warp::off_z(versine * u, v));
                let pdf_solid_angle = probability / (TAU * versine);
                let segment = Segment::from_towards(at, to);
                let light = (1.0 / pdf_solid_angle) * radiance;
                Some(Connection { to, segment, light, pdf_solid_angle: Some(pdf_solid_angle) })
            }
            Luminaire::Environment { .. } => {
                let (to, density) = scene.environment.as_ref()?.sample(numbers.next());
                let pdf_solid_angle = probability * density;
                let segment = Segment::from_towards(at, to);
                let light = (1.0 / pdf_solid_angle) * scene.radiance_from(&scene.luminaires[index], to);
                Some(Connection { to, segment, light, pdf_solid_angle: Some(pdf_solid_angle) })
            }
            Luminaire::Point { position, .. }
            | Luminaire::Spot { position, .. }
            | Luminaire::Warn { position, .. }
            | Luminaire::Profile { position, .. } => {
                let offset = position - at.position;
                let distance = offset.length();
                let to = offset / distance;
                let irradiance = irradiance_from(scene, &scene.luminaires[index], distance, -to);
                let segment = Segment::between(at, position)?;
                let light = (1.0 / probability) * irradiance;
                Some(Connection { to, segment, light, pdf_solid_angle: None })
            }
        }
    }

    /// Probability of choosing luminaire `index`.
    fn probability(&self, index: usize) -> f64 {
        let total = self.choice.total();
        if total > 0.0 { self.choice.weight(index) / total } else { 0.0 }
    }
}

/// Density in solid angle with which a connection to a luminaire at infinity leads to `to`, once it is chosen.
fn pdf_of_sky(scene: &Scene, luminaire: &Luminaire, to: Vec3) -> f32 {
    match (luminaire, &scene.environment) {
        (Luminaire::Sun { versine, .. }, _) => 1.0 / (TAU * versine),
        (Luminaire::Environment { .. }, Some(environment)) => environment.density(to),
        _ => 0.0,
    }
}

/// True where some surface turns visible light into anything: what is seen and lights nothing is else never chosen.
fn reads_visible(scene: &Scene) -> bool {
    let reads = |matrix: Matrix| matrix.rows().iter().any(|[_, visible]| *visible != 0.0);
    let bsdfs = scene.materials.iter().map(|material| &material.bsdf);
    bsdfs.flat_map(|bsdf| bsdf.terms.iter().map(|term| term.coefficient).chain([bsdf.straight])).any(reads)
}

/// Irradiance on a surface that faces a punctual luminaire at `distance`, in unit direction `out` from it; W m⁻².
fn irradiance_from(scene: &Scene, luminaire: &Luminaire, distance: f32, out: Vec3) -> Light {
    let square = distance * distance;
    match *luminaire {
        Luminaire::Point { intensity, .. } => (1.0 / square) * intensity, // paper eq. 2
        Luminaire::Spot { direction, intensity, cone, .. } => {
            (cone.profile(versine_between(out, direction)) / square) * intensity
        }
        Luminaire::Warn { direction, intensity, exponent, attenuation: [a0, a1, a2], .. } => {
            // paper eq. 24; dark behind, where cosᵉ would be what OpenGL leaves out
            let cos = out.dot(direction);
            let angular = match exponent {
                0.0 => 1.0,
                _ if cos > 0.0 => cos.powf(exponent),
                _ => 0.0,
            };
            (angular / (a0 + a1 * distance + a2 * square)) * intensity
        }
        Luminaire::Profile { intensity, profile, .. } => {
            (scene.profiles[profile as usize].at(out) / square) * intensity
        }
        Luminaire::Triangle { .. }
        | Luminaire::Directional { .. }
        | Luminaire::Sun { .. }
        | Luminaire::Environment { .. } => Light::ZERO,
    }
}
