//! A scene cut by a vertical plane, and light that meets it there.

use glam::{Vec2, Vec3};
use halflight::light::Light;
use halflight::optics::{Bsdf, Transport};
use halflight::rays::{Ray, Rays};
use halflight::sampling::Sobol;
use halflight::scene::{Illumination, Luminaire, Scene, SurfacePoint};

/// Samples of each lobe; those near the plane are kept.
const SAMPLES: u32 = 1024;
/// Sine of the angle to the plane within which they are.
const NEAR: f32 = 0.06;

/// The scene of figure 4, cut through the middle of its lamp and of its front ball.
pub struct Section {
    scene: Scene,
    rays: Rays,
    /// A point of the plane.
    origin: Vec3,
    right: Vec3,
    up: Vec3,
    /// Centre of the front ball, in the plane.
    pub ball: Vec2,
    /// Its radius, m.
    pub radius: f32,
    /// Height of the floor, in the plane.
    pub floor: f32,
    /// Centre of the lamp, in the plane.
    pub lamp: Vec2,
}

/// One straight line of light with all it does on its way.
pub struct Flight {
    /// Pieces between surfaces, with the light on each.
    pub pieces: Vec<([Vec2; 2], Light)>,
    /// What it meets, in order.
    pub meetings: Vec<Meeting>,
}

/// A surface on the way.
pub struct Meeting {
    /// Where.
    pub at: Vec2,
    /// Unit normal of the front.
    pub normal: Vec2,
    /// Scattered light: real samples of the lobe near the plane, in order.
    pub scattered: Vec<Scattered>,
    /// f cos θ over directions of the plane, as a share of its largest value; empty where nothing is scattered.
    pub outline: Vec<Vec2>,
}

/// One sample of a lobe.
pub struct Scattered {
    /// Unit direction, in the plane.
    pub to: Vec2,
    /// f cos θ there, as a share of its largest value.
    pub value: f32,
    /// What the lobe's matrix makes of the light that arrived.
    pub light: Light,
}

impl Section {
    /// Cuts the scene, every surface in `illumination`.
    ///
    /// # Errors
    /// What loading refuses.
    pub fn new(illumination: Illumination) -> halflight::error::Result<Self> {
        let mut scene = Scene::load("builtin:two-spheres")?;
        scene.illuminate(Some(illumination), &[])?;
        let bounds = |name: &str| {
            let index =
                scene.surfaces.iter().position(|s| s.name == name).expect("a surface of that name") as u32;
            let corners = (0..scene.mesh.triangles.len() as u32)
                .filter(|triangle| scene.mesh.surface[*triangle as usize] == index)
                .flat_map(|triangle| scene.mesh.corners(triangle));
            corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
        };
        let middle = |(low, high): (Vec3, Vec3)| 0.5 * (low + high);
        let (ball, lamp, floor) = (bounds("FrontBall"), middle(bounds("Lamp")), bounds("Floor").1.y);
        let radius = 0.5 * (ball.1.y - ball.0.y);
        let ball = middle(ball);
        let right = (ball - lamp).with_y(0.0).normalize();
        let origin = lamp.with_y(floor);
        let flat = |p: Vec3| Vec2::new((p - origin).dot(right), (p - origin).y);
        let (ball, lamp) = (flat(ball), flat(lamp));
        let rays = Rays::build(&scene);
        Ok(Self { scene, rays, origin, right, up: Vec3::Y, ball, radius, floor: 0.0, lamp })
    }

    /// Where the plane cuts triangles.
    pub fn outline(&self) -> Vec<[Vec2; 2]> {
        let normal = self.right.cross(self.up);
        let mut segments = Vec::new();
        for triangle in 0..self.scene.mesh.triangles.len() as u32 {
            let corners = self.scene.mesh.corners(triangle);
            let side = corners.map(|p| (p - self.origin).dot(normal));
            let ends: Vec<Vec2> = (0..3)
                .filter(|&i| (side[i] < 0.0) != (side[(i + 1) % 3] < 0.0))
                .map(|i| {
                    let (a, b) = (side[i], side[(i + 1) % 3]);
                    self.flat(corners[i].lerp(corners[(i + 1) % 3], a / (a - b)))
                })
                .collect();
            if let [a, b] = ends[..] {
                segments.push([a, b]);
            }
        }
        segments
    }

    /// Invisible light that leaves the middle of the lamp towards `target`, as far as it gets; at most `reach` m.
    pub fn shine(&self, target: Vec2, reach: f32) -> Flight {
        let start = self.deep(self.lamp);
        let direction = (self.deep(target) - start).normalize();
        let lamp = self.scene.luminaires.iter().find_map(|luminaire| match luminaire {
            Luminaire::Triangle { triangle, .. } => Some(self.scene.mesh.point(*triangle, 0.3, 0.3, false)),
            _ => None,
        });
        let error = lamp.map_or(Vec3::ZERO, |lamp| lamp.error);
        let lamp = lamp.map(|lamp| SurfacePoint { position: start, error, ..lamp });
        let origin = lamp.map_or(start, |lamp| lamp.origin_towards(direction));
        let mut hits = Vec::new();
        self.rays.crossings(&Ray { origin, direction, t_max: reach }, &mut hits);
        let mut light = Light::new(Vec3::ONE, Vec3::ZERO);
        let mut flight = Flight { pieces: Vec::new(), meetings: Vec::new() };
        let mut last = self.flat(start);
        for hit in hits {
            let surface = self.scene.surface_of(hit.triangle);
            let bsdf = self.scene.materials[surface.material as usize].bsdf();
            let point = self.scene.mesh.point(hit.triangle, hit.u, hit.v, surface.smooth);
            let at = self.flat(point.position);
            flight.pieces.push(([last, at], light));
            flight.meetings.push(self.meet(bsdf, &point, -direction, light));
            light = bsdf.straight * light;
            last = at;
        }
        if !light.is_zero() {
            flight.pieces.push(([last, self.flat(origin + reach * direction)], light));
        }
        flight
    }

    fn meet(&self, bsdf: &Bsdf, point: &SurfacePoint, from: Vec3, light: Light) -> Meeting {
        let net = Sobol::new(2);
        let (mut scattered, mut outline) = (Vec::new(), Vec::new());
        let across = self.right.cross(self.up);
        for term in bsdf.terms.iter().filter(|term| term.lobe.responds(&point.normals, from)) {
            let value = |to: Vec3| {
                (term.lobe.eval(&point.normals, from, to) * to.dot(point.normals.shading).abs()).element_sum()
            };
            let samples: Vec<_> = (0..SAMPLES)
                .filter_map(|i| term.lobe.sample(&point.normals, from, Transport::Shooting, net.point(i, 0)))
                .filter(|sample| sample.to.dot(across).abs() < NEAR)
                .collect();
            let sweep: Vec<Vec3> = (0..=180_u16)
                .map(|degree| {
                    let (sin, cos) = f32::from(2 * degree).to_radians().sin_cos();
                    cos * self.right + sin * self.up
                })
                .collect();
            let largest = sweep.iter().map(|to| value(*to)).fold(f32::MIN_POSITIVE, f32::max);
            scattered.extend(samples.iter().map(|sample| Scattered {
                to: self.turn(sample.to).normalize(),
                value: value(sample.to) / largest,
                light: term.coefficient * light,
            }));
            outline.extend(sweep.iter().map(|to| self.turn(*to) * (value(*to) / largest)));
        }
        Meeting {
            at: self.flat(point.position),
            normal: self.turn(point.normals.geometric),
            scattered,
            outline,
        }
    }

    fn flat(&self, p: Vec3) -> Vec2 {
        self.turn(p - self.origin)
    }

    fn turn(&self, v: Vec3) -> Vec2 {
        Vec2::new(v.dot(self.right), v.dot(self.up))
    }

    fn deep(&self, p: Vec2) -> Vec3 {
        self.origin + p.x * self.right + p.y * self.up
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At the top of the front ball, a little to the left.
    fn flight(illumination: Illumination) -> (Section, Flight) {
        let section = Section::new(illumination).expect("built in");
        let flight = section.shine(section.ball + section.radius * Vec2::new(-0.42, 0.91).normalize(), 5.0);
        (section, flight)
    }

    #[test]
    fn local_light_goes_through_the_ball_and_is_seen_where_it_enters() {
        let (section, flight) = flight(Illumination::LOCAL);
        let [front, back, floor] = &flight.meetings[..] else { panic!("{} meetings", flight.meetings.len()) };
        for met in [front, back] {
            assert!((met.at.distance(section.ball) - section.radius).abs() < 1e-3);
        }
        assert!(floor.at.y.abs() < 1e-4);
        // One-sided: it leaves through the back without a trace.
        assert!(front.scattered.len() > 20 && floor.scattered.len() > 20 && back.scattered.is_empty());
        for sample in front.scattered.iter().chain(&floor.scattered) {
            assert_eq!(sample.light, Light::new(Vec3::ZERO, Vec3::ONE), "invisible light becomes visible");
        }
        for (_, light) in &flight.pieces {
            assert_eq!(*light, Light::new(Vec3::ONE, Vec3::ZERO), "and goes on");
        }
        // All pieces are one line.
        let [a, b] = [flight.pieces[0].0[0], flight.pieces[3].0[1]];
        for met in &flight.meetings {
            assert!((met.at - a).perp_dot((b - a).normalize()).abs() < 1e-4);
        }
    }

    #[test]
    fn samples_follow_the_lobe() {
        let (_, flight) = flight(Illumination::LOCAL);
        let met = &flight.meetings[0];
        // In a plane through the normal a cosine-distributed direction has E[cos] = ∫cos² / ∫cos = π/4.
        let cosines: Vec<f32> = met.scattered.iter().map(|s| s.to.dot(met.normal)).collect();
        let mean = cosines.iter().sum::<f32>() / cosines.len() as f32;
        assert!((mean - std::f32::consts::FRAC_PI_4).abs() < 0.08, "{mean} of {}", cosines.len());
        for (sample, cos) in met.scattered.iter().zip(cosines) {
            assert!((sample.value - cos).abs() < 0.02, "{} at cosine {cos}", sample.value);
        }
    }

    #[test]
    fn global_light_ends_where_it_is_reflected_in_both_halves() {
        let (_, flight) = flight(Illumination::GLOBAL);
        assert_eq!((flight.meetings.len(), flight.pieces.len()), (1, 1));
        assert!(flight.meetings[0].scattered.iter().all(|s| s.light == Light::both(Vec3::ONE)));
    }
}
