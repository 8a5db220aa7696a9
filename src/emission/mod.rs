//! How photon paths start: which luminaire, where on it, in which direction, with what power. [`Beam`] follows how paths
//! spread, [`Guide`] starts more of them where caustics begin, [`StartTree`]
//! where few of all are of use.

mod aim;
mod beam;
mod guide;
mod tree;

pub use aim::{Aimed, Origin};
pub use beam::Beam;
pub use guide::Guide;
pub use tree::{StartTree, Useful};

use crate::light::{Light, Power};
use crate::sampling::{Cumulative, warp};
use crate::scene::{Emission, Environment, Luminaire, Scene, warn_falloff};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;

/// How many numbers in [0, 1) the start of a path takes.
pub const EMISSION_DIMENSIONS: usize = 5;

/// The start of a photon path.
#[derive(Clone, Copy, Debug)]
pub struct Emitted<P> {
    /// Off the luminaire's surface already.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Power of the path (W) at the luminaire; every path of one luminaire that shines alike all over carries the same.
    pub power: P,
    /// Factor on `power` at distance r along the first line.
    pub falloff: Falloff,
    /// Which of the scene's luminaires it is.
    pub luminaire: u32,
    /// Where those go that start a little differently, without a guide; the triangles of one surface are one luminaire to it.
    pub beam: Beam,
}

/// Where a path starts, without its power.
struct Start {
    origin: Vec3,
    direction: Vec3,
    falloff: Falloff,
    beam: Beam,
    /// Density of the direction (sr⁻¹), where a luminaire shines unevenly: its power goes with it.
    density: Option<f32>,
}

/// How power changes along the first line.
#[derive(Clone, Copy, Debug)]
pub enum Falloff {
    /// It does not: the inverse-square law is the spreading of photons.
    Physical,
    /// r² / (a₀ + a₁ r + a₂ r²), paper eq. 24.
    Warn([f32; 3]),
}

impl Falloff {
    /// The factor at distance `r`.
    pub fn at(self, r: f32) -> f32 {
        match self {
            Self::Physical => 1.0,
            Self::Warn(attenuation) => warn_falloff(attenuation, r),
        }
    }
}

/// The share of paths that luminaires get alike, however faint: one that is alone in its room is not lost beside one
/// that is 1e24 times as strong.
pub(crate) const ALIKE: f64 = 1.0 / 16.0;

/// The scene's luminaires, chosen in proportion to the power that can be of use, a share of all alike.
pub struct Emitters<'a, P> {
    scene: &'a Scene,
    centre: Vec3,
    radius: f32,
    /// By probability.
    choice: Cumulative,
    /// Probabilities of each and of those that shine beside it: triangles of the same surface.
    together: Vec<f32>,
    marker: std::marker::PhantomData<P>,
}

impl<'a, P: Power> Emitters<'a, P> {
    /// None where no luminaire has any power that is carried.
    pub fn new(scene: &'a Scene) -> Option<Self> {
        let (centre, radius) = scene.bounding_sphere();
        let power = |luminaire: &Luminaire| f64::from(P::of(luminaire.power(radius)).total());
        let sum: f64 = scene.luminaires.iter().map(power).sum();
        if sum == 0.0 {
            return None;
        }
        let lit = scene.luminaires.iter().filter(|luminaire| power(luminaire) > 0.0).count() as f64;
        let probability = |luminaire: &Luminaire| match power(luminaire) {
            0.0 => 0.0,
            power => (1.0 - ALIKE) * power / sum + ALIKE / lit,
        };
        let choice = Cumulative::new(scene.luminaires.iter().map(probability));
        let together = together(scene, &choice);
        Some(Self { scene, centre, radius, choice, together, marker: std::marker::PhantomData })
    }

    /// The start of one of `paths` paths, from numbers in [0, 1).
    pub fn emit(&self, paths: u32, u: [f32; EMISSION_DIMENSIONS]) -> Emitted<P> {
        let x = f64::from(u[0]);
        let index = self.choice.index(x);
        let probability = self.choice.weight(index);
        let luminaire = &self.scene.luminaires[index];
        // The choice of the luminaire leaves a number that is uniform again, and as well stratified: it chooses sides.
        let rest = ((x - self.choice.below(index)) / probability) as f32;
        let share = (1.0 / (probability * f64::from(paths))) as f32;
        let start = self.start(luminaire, rest, [u[1], u[2]], [u[3], u[4]]);
        let power = P::of(self.power(luminaire, [u[1], u[2]], &start)).scaled(share);
        let Start { origin, direction, falloff, beam, .. } = start;
        let beam = beam.thinned(self.together[index]);
        // Warn's power is that at the scene's radius; the falloff along the line is relative to it.
        let power = match falloff {
            Falloff::Physical => power,
            Falloff::Warn(attenuation) => power.scaled(1.0 / warn_falloff(attenuation, self.radius)),
        };
        Emitted { origin, direction, power, falloff, luminaire: index as u32, beam }
    }

    /// The power of a luminaire, as if it shone everywhere as it does at the place where a path starts, or from where.
    fn power(&self, luminaire: &Luminaire, place: [f32; 2], start: &Start) -> Light {
        match *luminaire {
            Luminaire::Triangle { triangle, part: Some(part), emission, area } => {
                let [b1, b2] = part.place(warp::triangle(place));
                let point = self.scene.mesh.point(triangle, b1, b2, false);
                let radiance = self.scene.radiance_at(&point, Some(part), emission);
                let emission = Emission { radiance, ..emission };
                Luminaire::Triangle { triangle, part: Some(part), emission, area }.power(self.radius)
            }
            Luminaire::Environment { .. } => {
                let over = start.density.map_or(0.0, |density| 1.0 / density);
                let fluence = over * self.scene.radiance_from(luminaire, -start.direction);
                Luminaire::Environment { fluence }.power(self.radius)
            }
            Luminaire::Profile { intensity, profile, .. } => {
                let over = start.density.map_or(0.0, |density| 1.0 / density);
                (over * self.scene.profiles[profile as usize].at(start.direction)) * intensity
            }
            _ => luminaire.power(self.radius),
        }
    }

    /// The luminaire that `u0` in [0, 1) chooses.
    fn luminaire(&self, u0: f32) -> &Luminaire {
        &self.scene.luminaires[self.choice.index(f64::from(u0))]
    }

    fn start(&self, luminaire: &Luminaire, side: f32, place: [f32; 2], turn: [f32; 2]) -> Start {
        let mut of_direction = None;
        let (origin, direction, falloff, beam) = match *luminaire {
            Luminaire::Triangle { triangle, part, emission, .. } => {
                let place = warp::triangle(place);
                let [b1, b2] = part.map_or(place, |part| part.place(place));
                let point = self.scene.mesh.point(triangle, b1, b2, false);
                let front = point.normals.geometric;
                let up = if emission.two_sided && side >= 0.5 { -front } else { front };
                let direction = warp::to_world(up, warp::cosine_hemisphere(turn));
                let beam = Beam::from_point(direction, FRAC_1_PI * direction.dot(up).abs());
                let beam = if emission.two_sided { beam.thinned(0.5) } else { beam };
                (point.origin_towards(direction), direction, Falloff::Physical, beam)
            }
            Luminaire::Point { position, .. } => {
                let direction = warp::sphere(turn);
                (position, direction, Falloff::Physical, Beam::from_point(direction, 0.25 * FRAC_1_PI))
            }
            Luminaire::Spot { position, direction, cone, .. } => {
                let direction = warp::to_world(direction, warp::off_z(cone.sample(turn[0]), turn[1]));
                let beam = Beam::from_point(direction, 1.0 / cone.solid_angle());
                (position, direction, Falloff::Physical, beam)
            }
            Luminaire::Warn { position, direction, exponent, attenuation, .. } => {
                let out = if exponent == 0.0 {
                    warp::sphere(turn)
                } else {
                    // pdf ∝ cosᵉ θ: cos θ = u^(1/(e+1))
                    let cos = (1.0 - turn[0]).powf(1.0 / (exponent + 1.0));
                    warp::to_world(direction, warp::about_z(cos, turn[1]))
                };
                let pdf = 0.5 * FRAC_1_PI * (exponent + 1.0) * out.dot(direction).abs().powf(exponent);
                (position, out, Falloff::Warn(attenuation), Beam::from_point(out, pdf))
            }
            Luminaire::Profile { position, profile, .. } => {
                let (out, density) = self.scene.profiles[profile as usize].sample(turn);
                of_direction = Some(density);
                (position, out, Falloff::Physical, Beam::from_point(out, density))
            }
            Luminaire::Directional { direction, .. } => {
                (self.distant(direction, place), direction, Falloff::Physical, self.parallel(direction))
            }
            Luminaire::Sun { direction, versine, .. } => {
                let direction = warp::to_world(direction, warp::off_z(versine * turn[0], turn[1]));
                let beam = self.parallel(direction).blurred(direction, 0.5 * FRAC_1_PI / versine);
                (self.distant(direction, place), direction, Falloff::Physical, beam)
            }
            Luminaire::Environment { .. } => {
                let sample = |sky: &Arc<Environment>| sky.sample(turn);
                let (to, density) = self.scene.environment.as_ref().map_or((Vec3::Y, 1.0), sample);
                of_direction = Some(density);
                let beam = self.parallel(-to).blurred(-to, density);
                (self.distant(-to, place), -to, Falloff::Physical, beam)
            }
        };
        Start { origin, direction, falloff, beam, density: of_direction }
    }

    /// Where light comes from that goes in a direction: on a disk as large as the scene, two radii back, before everything
    /// whatever the rounding.
    fn distant(&self, direction: Vec3, place: [f32; 2]) -> Vec3 {
        let (right, up) = direction.any_orthonormal_pair();
        let [x, y] = warp::disk(place);
        self.centre + self.radius * (x * right + y * up) - 2.0 * self.radius * direction
    }

    /// Of light that comes from that disk in one direction.
    fn parallel(&self, direction: Vec3) -> Beam {
        Beam::parallel(direction, FRAC_1_PI / (self.radius * self.radius))
    }
}

/// The probability of each luminaire, triangles of one surface taken together.
fn together(scene: &Scene, choice: &Cumulative) -> Vec<f32> {
    let surface = |luminaire: &Luminaire| match *luminaire {
        Luminaire::Triangle { triangle, .. } => Some(scene.mesh.surface[triangle as usize]),
        _ => None,
    };
    let mut of_surface = vec![0.0; scene.surfaces.len()];
    let each: Vec<f64> = (0..choice.len()).map(|i| choice.weight(i)).collect();
    for (luminaire, probability) in scene.luminaires.iter().zip(&each) {
        if let Some(surface) = surface(luminaire) {
            of_surface[surface as usize] += probability;
        }
    }
    let all = scene.luminaires.iter().zip(&each);
    all.map(|(luminaire, own)| surface(luminaire).map_or(*own, |surface| of_surface[surface as usize]) as f32)
        .collect()
}
