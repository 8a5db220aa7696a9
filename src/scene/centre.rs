//! Where the origin of a scene is placed, so that f32 suffices where someone looks.

use super::{Camera, Projection, Shape};
use glam::DVec3;

/// From where a scene is looked at, in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye {
    /// Where, m.
    pub position: DVec3,
    /// Unit, into the picture.
    pub forward: DVec3,
    /// Half of what is seen across: the tangent of an angle, or m in parallel projection. The larger of width and height.
    pub half_width: f64,
    /// Central projection.
    pub central: bool,
}

/// What was found.
pub(super) struct Centre {
    /// Zero, in the world.
    pub origin: DVec3,
    /// What to tell: geometry that lies so far off that places there are rounded, or that what is seen is.
    pub note: Option<String>,
}

/// Geometry is far off beyond so many times the size of what is seen. Its coordinates then lose six of f32's 24 bits to those of
/// what is seen, which keeps 18: four millionths of its size.
const FAR: f64 = 64.0;
/// So much of the picture lies within that size.
const MOST: f64 = 0.9;
/// Rounding by more than this part of a pixel, in a picture of 512, is told.
const SEEN: f64 = 0.05;
/// Where it shows in more than this part of the picture.
const TOLD: f64 = 0.01;

/// A triangle as the eye sees it.
struct Seen {
    corners: [DVec3; 3],
    /// Of the picture, all triangles together 1, whatever hides them.
    weight: f64,
}

/// The middle of the scene's bounds; or, where almost all of it is a speck there, of what the eye sees.
pub(super) fn centre(shapes: &[Shape], eye: Option<Eye>) -> Centre {
    let (min, max) = bounds(all_corners(shapes));
    if min.x > max.x {
        return Centre { origin: DVec3::ZERO, note: None };
    }
    let (middle, reach) = (0.5 * (min + max), 0.5 * (max - min).length());
    let Some(eye) = eye else { return Centre { origin: middle, note: None } };
    let seen = seen(shapes, &eye);
    if seen.is_empty() {
        return Centre { origin: middle, note: None };
    }
    let focus =
        DVec3::from([0, 1, 2].map(|axis| quantile(seen.iter().map(|s| (s.centroid()[axis], s.weight)), 0.5)));
    let size = quantile(seen.iter().map(|s| (s.reach(focus), s.weight)), MOST);
    if reach <= FAR * size {
        return Centre { origin: middle, note: lost(&seen, &eye, middle) };
    }
    let near = |corners: &[DVec3; 3]| corners.iter().all(|corner| corner.distance(focus) <= FAR * size);
    let (min, max) = bounds(all_corners(shapes).filter(near));
    let origin = 0.5 * (min + max);
    let far: Vec<&Shape> =
        shapes.iter().filter(|shape| corners(shape).any(|corners| !near(&corners))).collect();
    Centre { origin, note: lost(&seen, &eye, origin).or_else(|| Some(far_off(&far, origin))) }
}

fn corners(shape: &Shape) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    shape.triangles.iter().map(|triangle| triangle.map(|vertex| shape.positions[vertex as usize]))
}

fn all_corners(shapes: &[Shape]) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    shapes.iter().flat_map(corners)
}

fn bounds(triangles: impl Iterator<Item = [DVec3; 3]>) -> (DVec3, DVec3) {
    triangles
        .flatten()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), corner| (min.min(corner), max.max(corner)))
}

/// Triangles that reach into the picture, or lie before the eye where none does.
fn seen(shapes: &[Shape], eye: &Eye) -> Vec<Seen> {
    let weighed = |in_picture: bool| {
        let mut seen: Vec<Seen> = all_corners(shapes)
            .map(|corners| Seen { corners, weight: eye.weight(corners, in_picture) })
            .filter(|seen| seen.weight > 0.0)
            .collect();
        let sum: f64 = seen.iter().map(|seen| seen.weight).sum();
        seen.iter_mut().for_each(|seen| seen.weight /= sum);
        seen
    };
    let seen = weighed(true);
    if seen.is_empty() { weighed(false) } else { seen }
}

impl Seen {
    fn centroid(&self) -> DVec3 {
        self.corners.iter().sum::<DVec3>() / 3.0
    }

    /// The distance of its farthest corner.
    fn reach(&self, from: DVec3) -> f64 {
        self.corners.iter().map(|corner| corner.distance(from)).fold(0.0, f64::max)
    }
}

impl Eye {
    /// Of a camera in the world.
    pub fn of(camera: &Camera) -> Self {
        Self::new(camera.position.as_dvec3(), camera.forward.as_dvec3(), camera.projection, camera.aspect)
    }

    /// At `position`, looking along the unit vector `forward`.
    pub fn new(position: DVec3, forward: DVec3, projection: Projection, aspect: Option<f32>) -> Self {
        let (half_height, central) = match projection {
            Projection::Perspective { yfov } => ((0.5 * f64::from(yfov)).tan(), true),
            Projection::Orthographic { half_height } => (f64::from(half_height), false),
        };
        let half_width = half_height * aspect.map_or(1.0, f64::from).max(1.0);
        Self { position, forward, half_width, central }
    }

    /// How much of the view a triangle takes: sr in central projection, m² in parallel.
    fn weight(&self, corners: [DVec3; 3], in_picture: bool) -> f64 {
        let [a, b, c] = corners.map(|corner| corner - self.position);
        let middle = (a + b + c) / 3.0;
        let spread = [a, b, c].map(|corner| corner.distance(middle)).into_iter().fold(0.0, f64::max);
        let depth = middle.dot(self.forward) + spread;
        let aside = (middle - middle.dot(self.forward) * self.forward).length() - spread;
        // As far as the picture's corners.
        let most = std::f64::consts::SQRT_2 * self.half_width * if self.central { depth } else { 1.0 };
        if depth <= 0.0 || (in_picture && aside > most) {
            return 0.0;
        }
        if !self.central {
            return 0.5 * (b - a).cross(c - a).dot(self.forward).abs();
        }
        let [a, b, c] = [a, b, c].map(|corner| corner.normalize_or(self.forward));
        // A. Van Oosterom & J. Strackee 1983, "The solid angle of a plane triangle".
        2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    }

    /// The size of a pixel at `place`, m, in a picture of 512.
    fn pixel(&self, place: DVec3) -> f64 {
        let distance = if self.central { (place - self.position).length() } else { 1.0 };
        2.0 * self.half_width * distance / 512.0
    }
}

/// The smallest value that so much of the weight does not exceed.
fn quantile(values: impl Iterator<Item = (f64, f64)>, share: f64) -> f64 {
    let mut values: Vec<(f64, f64)> = values.collect();
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = 0.0;
    let reached = values.iter().find(|(_, weight)| {
        below += weight;
        below >= share
    });
    reached.or(values.last()).map_or(0.0, |(value, _)| *value)
}

/// By how much a coordinate so far from zero is rounded in f32, m.
fn rounding(reach: f64) -> f64 {
    reach * 0.5 * f64::from(f32::EPSILON)
}

fn lost(seen: &[Seen], eye: &Eye, origin: DVec3) -> Option<String> {
    let shows = |s: &&Seen| rounding(s.reach(origin)) > SEEN * eye.pixel(s.centroid());
    let share: f64 = seen.iter().filter(shows).map(|s| s.weight).sum();
    let worst = seen.iter().filter(shows).map(|s| rounding(s.reach(origin))).fold(0.0, f64::max);
    (share > TOLD).then(|| {
        format!(
            "the scene is so large that places are rounded to {}, which shows in {:.0} % of the picture; leave out what \
             lies far away, or bring the camera's surroundings together",
            length(worst),
            100.0 * share.min(1.0)
        )
    })
}

fn far_off(far: &[&Shape], origin: DVec3) -> String {
    let reach = far
        .iter()
        .flat_map(|shape| corners(shape).flatten())
        .map(|corner| corner.distance(origin))
        .fold(0.0, f64::max);
    let named: Vec<_> = far.iter().take(3).map(|shape| shape.name.as_str()).collect();
    let more = if far.len() > 3 { format!(" and {} more", far.len() - 3) } else { String::new() };
    format!(
        "{}{more}: up to {} from what the camera sees, where places are rounded to {}",
        named.join(", "),
        length(reach),
        length(rounding(reach))
    )
}

/// A length in words.
fn length(metres: f64) -> String {
    match metres {
        m if m >= 1e4 => format!("{:.0} km", m * 1e-3),
        m if m >= 1.0 => format!("{m:.1} m"),
        m if m >= 0.01 => format!("{:.1} cm", m * 1e2),
        m => format!("{:.2} mm", m * 1e3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(name: &str, positions: Vec<DVec3>) -> Shape {
        let triangles: Vec<_> =
            (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Shape::new(name, 0, positions, triangles)
    }

    /// A room of 2 m about `at`.
    fn room(at: DVec3) -> Shape {
        let mut corners = Vec::new();
        for (x, y, z) in [(DVec3::X, DVec3::Y, DVec3::Z), (DVec3::Y, DVec3::Z, DVec3::X)] {
            for side in [-1.0, 1.0] {
                let at = at + side * x;
                corners.extend([at - y - z, at + y - z, at + y + z, at - y - z, at + y + z, at - y + z]);
            }
        }
        shape("Room", corners)
    }

    fn eye(position: DVec3) -> Option<Eye> {
        Some(Eye { position, forward: -DVec3::Z, half_width: 0.4, central: true })
    }

    #[test]
    fn the_middle_of_the_bounds_serves_ordinary_scenes() {
        let at = DVec3::new(7.0, 1e6, -3.0);
        let found = centre(&[room(at), room(at + 30.0 * DVec3::X)], eye(at));
        assert_eq!((found.origin, found.note), (at + 15.0 * DVec3::X, None));
        assert_eq!(centre(&[], eye(at)).origin, DVec3::ZERO);
        assert_eq!(centre(&[room(at)], None).origin, at);
    }

    #[test]
    fn what_strays_does_not_move_what_is_seen() {
        let at = DVec3::new(0.5, 0.25, -3.0);
        for far in [1e3, 1e6, 1e9] {
            for towards in [DVec3::X, -DVec3::Z, DVec3::Z] {
                let p = at + far * towards;
                let stray = shape("Stray", vec![p, p + DVec3::X, p + DVec3::Y]);
                let found = centre(&[room(at), stray], eye(at + 0.9 * DVec3::Z));
                assert_eq!(found.origin, at, "{far} {towards}");
                assert!(found.note.is_some_and(|note| note.starts_with("Stray: up to ")));
            }
        }
    }

    #[test]
    fn where_what_is_seen_is_rounded_it_is_said() {
        let (at, far) = (DVec3::ZERO, DVec3::new(0.0, 0.0, -1e7));
        // Two rooms, the farther one as large in the picture.
        let other = shape("Other", room(DVec3::ZERO).positions.iter().map(|p| 1e7 * *p + far).collect());
        let found = centre(&[room(at), other], eye(at + 0.9 * DVec3::Z));
        let note = found.note.expect("a note");
        assert!(note.contains("rounded to") && note.contains("% of the picture"), "{note}");
    }
}
