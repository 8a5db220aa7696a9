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
            Luminaire::Profile { position, intensity, profile } => {
                let (to, square) = way(at, position)?;
                let profile = &self.scene.profiles[profile as usize];
                let irradiance = profile.at(-to) * total(intensity) / square;
                let turn = profile.numbers(-to)?;
                (irradiance > 0.0).then(|| Aimed {
                    start: start(place, turn),
                    to,
                    from: Some(Origin::Point(position)),
                    irradiance,
                })
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
                let found = self.start(luminaire, rest, place, turn);
                let direction = found.direction;
                // Its power on the disk that it shines through, at once.
                let power = total(self.power(luminaire, place, &found));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Light;
    use crate::sampling::Sobol;
    use crate::scene::{
        Camera, Emission, Environment, Material, Profile, Projection, Scene, Shape, versine_between,
    };

    /// A lamp that shines on both sides, one luminaire of each other kind, and an even sky.
    fn scene() -> Scene {
        let camera =
            Camera::look_at(5.0 * Vec3::Z, Vec3::ZERO, Vec3::Y, Projection::Perspective { yfov: 1.0 });
        let mut scene = Scene::builder("aim").camera(camera);
        let shine = Emission { radiance: Light::both(Vec3::ONE), two_sided: true };
        let lamp = scene.material(Material::diffuse("Lamp", Vec3::ZERO).with_emission(shine));
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| [x, y, 0.3 * x]);
        scene.shape(Shape::quad("Lamp", lamp, corners));
        let light = Light::both(Vec3::splat(2.0));
        let (position, direction) = (Vec3::new(-0.5, 0.2, 0.1), Vec3::new(0.6, 0.0, -0.8));
        let cone = SpotCone::of_angles(0.2, 0.7);
        let attenuation = [1.0, 0.5, 0.2];
        let ies = b"TILT=NONE\n1 -1 1 3 3 1 2 0 0 0 1 1 60 0 60 180 0 90 180 9 5 1 9 2 1 9 1 1";
        let profile = scene.profile(Profile::parse(ies).expect("a good file"));
        for luminaire in [
            Luminaire::Profile { position: -position, intensity: light, profile },
            Luminaire::Point { position, intensity: light },
            Luminaire::Spot { position, direction, intensity: light, cone },
            Luminaire::Warn { position, direction, intensity: light, exponent: 4.0, attenuation },
            Luminaire::Warn { position, direction, intensity: light, exponent: 0.0, attenuation },
            Luminaire::Directional { direction, irradiance: light },
            Luminaire::sun(direction, light, 0.1),
        ] {
            scene.luminaire(luminaire);
        }
        scene.environment = Some(Environment::constant(Vec3::ONE));
        scene.build().expect("a good scene")
    }

    #[test]
    fn what_a_path_meets_can_be_aimed_at_by_its_own_start() {
        let scene = scene();
        let emitters = Emitters::<Light>::new(&scene).expect("it shines");
        let sobol = Sobol::new(8);
        for i in 0..4000 {
            let u: [f32; 5] = sobol.point(i, 0);
            let emitted = emitters.emit(1, u);
            let at = emitted.origin + 1.7 * emitted.direction;
            // Numbers of the place and, at infinity, of the direction are as they were; the rest is found.
            let Some(aimed) = emitters.aim_at(at, u) else { panic!("{i}: not lit where light went") };
            let again = emitters.emit(1, aimed.start);
            let way = (at - again.origin).normalize();
            assert!(versine_between(way, again.direction) < 1e-5, "{i}: {:?} for {u:?}", aimed.start);
            assert!(versine_between(-aimed.to, again.direction) < 1e-5 && aimed.irradiance > 0.0);
        }
    }

    #[test]
    fn all_aims_together_find_the_irradiance_of_a_place() {
        let scene = scene();
        let emitters = Emitters::<Light>::new(&scene).expect("it shines");
        let (at, n) = (Vec3::new(0.4, 0.3, 0.9), 1 << 16);
        let sobol = Sobol::new(3);
        let aims = (0..n).filter_map(|i| emitters.aim_at(at, sobol.point(i, 0)));
        let found = aims.map(|aimed| f64::from(aimed.irradiance)).sum::<f64>() / f64::from(n);
        // Both halves and three colours of each; of the sky the whole sphere.
        let each = scene.luminaires.iter().map(|luminaire| match *luminaire {
            Luminaire::Triangle { triangle, .. } => {
                let sum: f32 = (0..4096)
                    .map(|i| {
                        let [b1, b2] = warp::triangle(sobol.point(i, 0));
                        let point = scene.mesh.point(triangle, b1, b2, false);
                        let (to, square) = way(at, point.position).expect("apart");
                        to.dot(point.normals.geometric).abs() / square
                    })
                    .sum();
                6.0 * scene.mesh.area(triangle) * sum / 4096.0
            }
            Luminaire::Point { position, .. } => 12.0 / at.distance_squared(position),
            Luminaire::Spot { position, direction, cone, .. } => {
                let (to, square) = way(at, position).expect("apart");
                12.0 * cone.profile(versine_between(-to, direction)) / square
            }
            Luminaire::Warn { position, direction, exponent, attenuation, .. } => {
                let (to, square) = way(at, position).expect("apart");
                let cos = (-to.dot(direction)).max(0.0);
                let profile = if exponent == 0.0 { 1.0 } else { cos.powf(exponent) };
                12.0 * profile * warn_falloff(attenuation, square.sqrt()) / square
            }
            Luminaire::Profile { position, profile, .. } => {
                let (to, square) = way(at, position).expect("apart");
                12.0 * scene.profiles[profile as usize].at(-to) / square
            }
            Luminaire::Directional { .. } => 12.0,
            // On a surface that faces each direction of it.
            Luminaire::Sun { versine, radiance, .. } => radiance.total() * TAU * versine,
            Luminaire::Environment { fluence } => fluence.total(),
        });
        let expected: f64 = each.map(f64::from).sum();
        assert!((found / expected - 1.0).abs() < 0.005, "{found} for {expected}");
    }
}
