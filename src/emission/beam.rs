//! How far neighbouring paths have spread where a path ends: photon differentials (Igehy 1999, *Tracing ray differentials*;
//! Schjøth et al. 2007, *Photon differentials*).
//!
//! Light that a lens focuses is dense and sharp; light that a ball scatters about the room is faint and smooth. A single
//! gather radius blurs the first or leaves the second noisy. The beam of a path tells the two apart from the path alone,
//! without looking at other photons.

use crate::optics::{Dielectric, Lobe, Normals, RoughDielectric};
use glam::Vec3;

/// The change of a path's place and direction with each of two numbers, of which paths have unit density.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// m.
    place: [Vec3; 2],
    direction: [Vec3; 2],
}

impl Beam {
    /// From one point into directions that have density `pdf_solid_angle` (sr⁻¹) about the unit vector
    /// `direction`.
    pub fn from_point(direction: Vec3, pdf_solid_angle: f32) -> Self {
        Self { place: [Vec3::ZERO; 2], direction: across(direction, pdf_solid_angle) }
    }

    /// Parallel, with density `pdf_area` (m⁻²) on a plane that faces the unit vector `direction`.
    pub fn parallel(direction: Vec3, pdf_area: f32) -> Self {
        Self { place: across(direction, pdf_area), direction: [Vec3::ZERO; 2] }
    }

    /// After `distance` along `direction`, on a surface with the unit normal `normal`.
    pub fn at(&self, direction: Vec3, distance: f32, normal: Vec3) -> Self {
        let along = direction / direction.dot(normal);
        let place = std::array::from_fn(|i| {
            let place = self.place[i] + distance * self.direction[i];
            place - place.dot(normal) * along
        });
        Self { place, ..*self }
    }

    /// What it covers of the surface that it is [at](Self::at), m²: one over the density of one path there.
    pub fn area(&self) -> f32 {
        self.place[0].cross(self.place[1]).length()
    }

    /// Of the paths around it only the share `probability` goes on, at random.
    pub fn thinned(&self, probability: f32) -> Self {
        let wider = 1.0 / probability.sqrt();
        let spread = |steps: [Vec3; 2]| steps.map(|step| wider * step);
        Self { place: spread(self.place), direction: spread(self.direction) }
    }

    /// Beside what it was, into directions that have density `pdf_solid_angle` (sr⁻¹) about the unit vector `direction`.
    pub fn blurred(&self, direction: Vec3, pdf_solid_angle: f32) -> Self {
        let blur = across(direction, pdf_solid_angle);
        // Steps are laid along the sum: neither is made shorter.
        let longer = |i: usize| {
            let (step, blur) = (self.direction[i], blur[i]);
            if step.dot(blur) < 0.0 { step - blur } else { step + blur }
        };
        Self { place: self.place, direction: [longer(0), longer(1)] }
    }

    /// After a lobe that turned it, as the mirror or the glass that is meant by it would; `bend` tells how the shading normal changes with a step along the surface.
    pub fn scattered(
        &self,
        lobe: &Lobe,
        normals: &Normals,
        [from, to]: [Vec3; 2],
        bend: impl Fn(Vec3) -> Vec3,
    ) -> Self {
        let side = if normals.is_front(from) { 1.0 } else { -1.0 };
        let normal = side * normals.shading;
        let (c, reflected) = (from.dot(normal), to.dot(normal) > 0.0);
        let eta = match lobe {
            Lobe::Dielectric(Dielectric { ior, .. }) | Lobe::RoughDielectric(RoughDielectric { ior, .. }) => {
                if side > 0.0 {
                    1.0 / ior
                } else {
                    *ior
                }
            }
            _ => 1.0,
        };
        if !reflected && eta == 1.0 {
            return *self; // straight through
        }
        let change = |i: usize| {
            let (turn, bend) = (self.direction[i], side * bend(self.place[i]));
            let dc = from.dot(bend) - turn.dot(normal);
            if reflected {
                // to = 2 c n − from
                return turn + 2.0 * (dc * normal + c * bend);
            }
            // to = (η c − c′) n − η from, with c′ the cosine behind
            let behind = -to.dot(normal);
            let d_behind = eta * eta * c * dc / behind;
            eta * turn + (eta * dc - d_behind) * normal + (eta * c - behind) * bend
        };
        Self { place: self.place, direction: [change(0), change(1)] }
    }
}

/// Two steps across `direction` that span one over the density.
fn across(direction: Vec3, density: f32) -> [Vec3; 2] {
    let (right, up) = direction.any_orthonormal_pair();
    let length = 1.0 / density.sqrt();
    [length * right, length * up]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{Mirror, ThinDielectric, Transport};

    /// A ball that the path meets, and what it does there.
    #[derive(Clone, Copy)]
    struct Event {
        centre: Vec3,
        radius: f32,
        lobe: Lobe,
        /// Chooses the branch.
        u: f32,
    }

    /// What all paths end on.
    const SKY: Event = Event {
        centre: Vec3::ZERO,
        radius: 10.0,
        lobe: Lobe::Mirror(Mirror::plain(Vec3::ONE, true)),
        u: 0.5,
    };

    /// Where a line meets the ball: how far away, and the normal there.
    fn meet(event: &Event, origin: Vec3, direction: Vec3) -> (f32, Vec3) {
        let (from, to) = (origin - event.centre, direction.as_dvec3());
        let from = from.as_dvec3();
        let b = from.dot(to);
        let root = (b * b - from.length_squared() + f64::from(event.radius * event.radius)).sqrt();
        let t = if -b - root > 1e-3 { -b - root } else { -b + root };
        (t as f32, ((from + t * to) / f64::from(event.radius)).as_vec3())
    }

    /// Follows a line through `events` to the sky; returns where it ends, and its beam there.
    fn follow(mut origin: Vec3, mut direction: Vec3, mut beam: Beam, events: &[Event]) -> (Vec3, Beam) {
        for event in events {
            let (t, normal) = meet(event, origin, direction);
            let normals = Normals::flat(normal);
            let sample = event
                .lobe
                .sample(&normals, -direction, Transport::Shooting, [0.5, 0.5, event.u])
                .expect("it goes on");
            beam = beam.at(direction, t, normal).scattered(
                &event.lobe,
                &normals,
                [-direction, sample.to],
                |step| step / event.radius,
            );
            (origin, direction) = (origin + t * direction, sample.to);
        }
        let (t, normal) = meet(&SKY, origin, direction);
        (origin + t * direction, beam.at(direction, t, normal))
    }

    /// The area of one path by following those beside it, which start `along` [right, up] a little differently.
    fn measured(start: impl Fn([f32; 2]) -> (Vec3, Vec3), events: &[Event]) -> f32 {
        let step = 2e-3;
        let end = |x: f32, y: f32| {
            let (origin, direction) = start([x, y]);
            follow(origin, direction, Beam::parallel(direction, 1.0), events).0
        };
        let right = (end(step, 0.0) - end(-step, 0.0)) / (2.0 * step);
        let up = (end(0.0, step) - end(0.0, -step)) / (2.0 * step);
        right.cross(up).length()
    }

    fn events() -> Vec<(&'static str, Vec<Event>)> {
        let mirror = Lobe::Mirror(Mirror::plain(Vec3::ONE, true));
        let glass = Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::ONE });
        let pane = Lobe::ThinDielectric(ThinDielectric { ior: 1.5, tint: Vec3::ONE });
        let ball = |lobe, u| Event { centre: Vec3::new(0.3, 0.2, 0.0), radius: 1.0, lobe, u };
        let cup = |lobe, u| Event { centre: Vec3::new(0.3, 0.2, 3.0), radius: 4.0, lobe, u };
        vec![
            ("nothing", vec![]),
            ("a convex mirror, then the hollow of another", vec![ball(mirror, 0.5), cup(mirror, 0.5)]),
            ("reflected by glass, then by a hollow", vec![ball(glass, 0.0), cup(mirror, 0.5)]),
            ("through a ball of glass", vec![ball(glass, 1.0), ball(glass, 1.0)]),
            (
                "once back and forth within it",
                vec![ball(glass, 1.0), ball(glass, 0.0), ball(glass, 0.0), ball(glass, 1.0)],
            ),
            ("through bubbles of thin glass", vec![ball(pane, 1.0), ball(pane, 1.0)]),
        ]
    }

    #[test]
    fn beams_cover_what_their_neighbours_span() {
        for (name, events) in events() {
            for from in [Vec3::new(0.0, 0.0, 4.0), Vec3::new(0.8, -0.5, 2.5)] {
                let direction = (Vec3::new(0.05, 0.4, 0.2) - from).normalize();
                let (right, up) = direction.any_orthonormal_pair();
                let point = |[x, y]: [f32; 2]| (from, (direction + x * right + y * up).normalize());
                let parallel = |[x, y]: [f32; 2]| (from + x * right + y * up, direction);
                let beams = [
                    (measured(point, &events), Beam::from_point(direction, 0.25), "from a point"),
                    (measured(parallel, &events), Beam::parallel(direction, 0.25), "parallel"),
                ];
                for (expected, beam, start) in beams {
                    let area = 0.25 * follow(from, direction, beam, &events).1.area();
                    let off = area / expected - 1.0;
                    assert!(off.abs() < 0.01, "{name}, {start}, {from}: {area} for {expected}");
                }
            }
        }
    }

    #[test]
    fn unhindered_light_spreads_with_the_square_of_its_distance() {
        let direction = Vec3::new(0.6, 0.0, -0.8);
        let beam = Beam::from_point(direction, 0.1).at(direction, 5.0, Vec3::Z);
        assert!((beam.area() / (25.0 / 0.8 / 0.1) - 1.0).abs() < 1e-5, "{}", beam.area());
        let beam = Beam::parallel(direction, 0.1).at(direction, 5.0, Vec3::Z);
        assert!((beam.area() / (1.0 / 0.8 / 0.1) - 1.0).abs() < 1e-5, "{}", beam.area());
    }
}
