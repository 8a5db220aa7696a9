//! The other way round: which start of a path leads to a given point.

use super::{EMISSION_DIMENSIONS, Emitters};
use crate::light::Power;
use crate::sampling::warp;
use crate::scene::{Luminaire, SpotCone, SurfacePoint, versine_between, warn_falloff};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// A start that leads to a point, found from there.
#[derive(Clone, Copy, Debug)]
pub struct Aimed {
    /// The numbers of the start.
    pub start: [f32; EMISSION_DIMENSIONS],
    /// Unit, from the point.
    pub to: Vec3,
    /// Where on the luminaire it starts. None: infinitely far away.
    pub from: Option<Origin>,
    /// An estimate of all that luminaires send to a surface there that faces them, components together; W m⁻².
    pub irradiance: f32,
}

/// Where a start is.
#[derive(Clone, Copy, Debug)]
pub enum Origin {
    Surface(SurfacePoint),
    Point(Vec3),
}

impl<P: Power> Emitters<'_, P> {
    /// A start that leads to `at`, by numbers in [0, 1). None: the luminaire that they choose does not shine there.
    pub fn aim_at(&self, at: Vec3, u: [f32; EMISSION_DIMENSIONS]) -> Option<Aimed> {
        let x = f64::from(u[0]);
        let index = self.choice.index(x);
        let probability = self.choice.weight(index) as f32;
        let rest = (x - self.choice.below(index)) as f32 / probability;
        let luminaire = &self.scene.luminaires[index];
        let total = |light| P::of(light).total() / probability;
        let (place, turn) = ([u[1], u[2]], [u[3], u[4]]);
        let start =
            |[a, b]: [f32; 2], [c, d]: [f32; 2]| [u[0], a, b, c, d].map(|x| x.clamp(0.0, 1.0 - f32::EPSILON));
        match *luminaire {
            Luminaire::Triangle { triangle, part, emission, area } => {
                let own = warp::triangle(place);
                let [b1, b2] = part.map_or(own, |part| part.place(own));
                let point = self.scene.mesh.point(triangle, b1, b2, false);
                let (to, square) = way(at, point.position)?;
                let cos = -to.dot(point.normals.geometric);
                if cos == 0.0 || (cos < 0.0 && !emission.two_sided) {
                    return None;
                }
                let up = if cos > 0.0 { point.normals.geometric } else { -point.normals.geometric };
                let turn = of_disk(local(up, -to));
                let light = total(self.scene.radiance_at(&point, part, emission));
                let mut start = start(place, turn);
                if emission.two_sided {
                    // The same number chooses the luminaire and its side.
                    let rest = 0.5 * rest + if cos > 0.0 { 0.0 } else { 0.5 };
                    start[0] = (self.choice.below(index) as f32 + rest * probability).min(1.0 - f32::EPSILON);
                }
                let from = Some(Origin::Surface(point));
                Some(Aimed { start, to, from, irradiance: light * cos.abs() * area / square })
            }
            Luminaire::Point { position, intensity } => {
                let (to, square) = way(at, position)?;
                let irradiance = total(intensity) / square;
                Some(Aimed {
                    start: start(place, of_sphere(-to)),
                    to,
                    from: Some(Origin::Point(position)),
                    irradiance,
                })
            }
            Luminaire::Spot { position, direction, intensity, cone } => {
                let (to, square) = way(at, position)?;
                let versine = versine_between(-to, direction);
                let irradiance = cone.profile(versine) * total(intensity) / square;
                let turn = [of_cone(&cone, versine), azimuth(local(direction, -to))];
                (irradiance > 0.0).then(|| Aimed {
                    start: start(place, turn),
                    to,
                    from: Some(Origin::Point(position)),
                    irradiance,
                })
            }
            Luminaire::Warn { position, direction, intensity, exponent, attenuation } => {
                let (to, square) = way(at, position)?;
                let cos = -to.dot(direction);
                let (turn, profile) = match exponent {
                    0.0 => (of_sphere(-to), 1.0),
                    _ if cos <= 0.0 => return None,
                    _ => {
                        let turn = [1.0 - cos.powf(exponent + 1.0), azimuth(local(direction, -to))];
                        (turn, cos.powf(exponent))
                    }
                };
                let irradiance =
                    profile * warn_falloff(attenuation, square.sqrt()) / square * total(intensity);
                Some(Aimed { start: start(place, turn), to, from: Some(Origin::Point(position)), irradiance })
            }
            Luminaire::Directional { direction, irradiance } => {
                let place = self.seen_from_afar(at, direction);
                Some(Aimed {
                    start: start(place, turn),
                    to: -direction,
                    from: None,
                    irradiance: total(irradiance),
                })
            }
            Luminaire::Sun { .. } | Luminaire::Environment { .. } => {
                let direction = self.start(luminaire, rest, place, turn).direction;
                // Its power on the disk that it shines through, at once.
                let power = total(self.power(luminaire, place, direction));
                let irradiance = power * FRAC_1_PI / (self.radius * self.radius);
                let place = self.seen_from_afar(at, direction);
                Some(Aimed { start: start(place, turn), to: -direction, from: None, irradiance })
            }
        }
    }

    /// The numbers for the place from which light in a unit direction comes to `at`.
    fn seen_from_afar(&self, at: Vec3, direction: Vec3) -> [f32; 2] {
        let (right, up) = direction.any_orthonormal_pair();
        let off = (at - self.centre) / self.radius;
        of_disk(Vec3::new(off.dot(right), off.dot(up), 0.0))
    }
}

/// The unit direction between two points, and the square of the distance.
fn way(at: Vec3, from: Vec3) -> Option<(Vec3, f32)> {
    let way = from - at;
    let square = way.length_squared();
    (square > 0.0 && square.is_finite()).then(|| (way / square.sqrt(), square))
}

/// What [`warp::to_world`] made of the unit vector that is returned.
fn local(up: Vec3, world: Vec3) -> Vec3 {
    let (tangent, bitangent) = up.any_orthonormal_pair();
    Vec3::new(world.dot(tangent), world.dot(bitangent), world.dot(up))
}

fn azimuth(local: Vec3) -> f32 {
    (local.y.atan2(local.x) / TAU).rem_euclid(1.0)
}

/// What [`warp::sphere`] made of it.
fn of_sphere(direction: Vec3) -> [f32; 2] {
    [0.5 - 0.5 * direction.z, azimuth(direction)]
}

/// What [`warp::disk`] made of x and y, and [`warp::cosine_hemisphere`].
fn of_disk(local: Vec3) -> [f32; 2] {
    let (x, y) = (local.x, local.y);
    let radius = x.hypot(y);
    if radius == 0.0 {
        return [0.5, 0.5];
    }
    // Quarters about ±x, where the first number goes with the radius, and about ±y.
    let (a, b) = if x.abs() > y.abs() {
        let radius = radius.copysign(x);
        (radius, radius * (y / x).atan() * (4.0 / PI))
    } else {
        let radius = radius.copysign(y);
        (radius * (x / y).atan() * (4.0 / PI), radius)
    };
    [0.5 + 0.5 * a, 0.5 + 0.5 * b]
}

/// What [`SpotCone::sample`] made of a versine.
fn of_cone(cone: &SpotCone, versine: f32) -> f32 {
    let (inner, outer) = cone.versines();
    let core = TAU * inner / cone.solid_angle();
    if versine < inner {
        core * versine / inner
    } else {
        core + (1.0 - core) * ((outer - versine) / (outer - inner)).powi(3)
    }
}
