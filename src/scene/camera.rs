use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

/// A camera with a pinhole or a thin lens, or an orthographic one. Its three axes are unit vectors at right angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of projection, scene space (m).
    pub position: Vec3,
    /// To the right of the picture.
    pub right: Vec3,
    /// To the top of the picture.
    pub up: Vec3,
    /// Into the picture.
    pub forward: Vec3,
    /// How directions map to the film.
    pub projection: Projection,
    /// Width / height of the picture that the scene asks for, if it does. A film of another shape shows all of that
    /// picture, and more beside it or above and below.
    pub aspect: Option<f32>,
    /// What blurs all but one distance, in central projection. None: a pinhole.
    pub lens: Option<Lens>,
}

/// A thin lens in the place of the pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Half its diameter, m.
    pub radius: f32,
    /// The distance of what is sharp, m along the direction of view.
    pub focus: f32,
}

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Central projection.
    Perspective {
        /// Full vertical angle of view, radians.
        yfov: f32,
    },
    /// Parallel projection.
    Orthographic {
        /// Half the height of what is seen, m.
        half_height: f32,
    },
}

impl Camera {
    /// A camera at `position` that looks at `target`, with `up` roughly up.
    pub fn look_at(position: Vec3, target: Vec3, up: Vec3, projection: Projection) -> Self {
        let forward = (target - position).normalize();
        let side = forward.cross(up);
        let right = side.try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        Self { position, right, up: right.cross(forward), forward, projection, aspect: None, lens: None }
    }

    /// What it sees on a film of the given width / height.
    pub fn view(&self, aspect: f32) -> View {
        let central = matches!(self.projection, Projection::Perspective { .. });
        let half_height = self.half_height(aspect);
        let (right, up) = (half_height * aspect * self.right, half_height * self.up);
        let across = |lens: Lens| Across {
            right: lens.radius * self.right,
            up: lens.radius * self.up,
            focus: lens.focus,
        };
        let lens = self.lens.map(across);
        View { position: self.position, forward: self.forward, right, up, half_height, central, lens }
    }

    /// Half the height of what a film of the given width / height shows, m; in central projection at distance 1.
    fn half_height(&self, aspect: f32) -> f32 {
        let own = match self.projection {
            Projection::Perspective { yfov } => (0.5 * yfov).tan(),
            Projection::Orthographic { half_height } => half_height,
        };
        own * self.aspect.map_or(1.0, |wanted| (wanted / aspect).max(1.0))
    }

    /// Origin and unit direction of the ray through film point (x, y) in [0, 1]², (0, 0) top left, for a film of
    /// the given width / height; where there is a lens, through its centre.
    pub fn ray(&self, x: f32, y: f32, aspect: f32) -> (Vec3, Vec3) {
        self.view(aspect).ray(x, y)
    }

    /// Film point in [0, 1]² at which `point` is seen, (0, 0) top left, for a film of the given width / height: the inverse of
    /// [`ray`](Self::ray). Outside [0, 1]² it lies beside the film; None where it lies behind a pinhole.
    pub fn film(&self, point: Vec3, aspect: f32) -> Option<[f32; 2]> {
        let offset = point - self.position;
        let h = match self.projection {
            Projection::Perspective { .. } => self.half_height(aspect) * offset.dot(self.forward),
            Projection::Orthographic { .. } => self.half_height(aspect),
        };
        let (sx, sy) = (offset.dot(self.right) / h, offset.dot(self.up) / h);
        (h > 0.0).then_some([0.5 * (sx / aspect + 1.0), 0.5 * (1.0 - sy)])
    }
}

/// A camera with a film of known shape: what all its rays have in common.
#[derive(Clone, Copy, Debug)]
pub struct View {
    position: Vec3,
    forward: Vec3,
    /// From the middle of what is seen (at distance 1 in central projection) to its edge on the right.
    right: Vec3,
    /// To its upper edge.
    up: Vec3,
    half_height: f32,
    central: bool,
    lens: Option<Across>,
}

/// A lens, seen from its centre.
#[derive(Clone, Copy, Debug)]
struct Across {
    /// To its rim on the right, m.
    right: Vec3,
    /// To its upper rim.
    up: Vec3,
    focus: f32,
}

impl View {
    /// True where rays of one film point start in more than one place, as two more numbers say.
    pub fn has_lens(&self) -> bool {
        self.lens.is_some()
    }

    /// Origin and unit direction of a ray through film point (x, y) in [0, 1]², (0, 0) top left; `lens` in [0, 1)² says through
    /// which point of the lens, if there is one, uniform over its area.
    ///
    /// All rays of a film point meet at the distance of what is sharp (pbrt 4th ed., §5.2.3).
    pub fn ray_through(&self, x: f32, y: f32, lens: [f32; 2]) -> (Vec3, Vec3) {
        let (Some(Across { right, up, focus }), true) = (self.lens, self.central) else {
            return self.ray(x, y);
        };
        let aside = (2.0 * x - 1.0) * self.right + (1.0 - 2.0 * y) * self.up;
        let [u, v] = concentric_disk(lens);
        let off = u * right + v * up;
        (self.position + off, (focus * (self.forward + aside) - off).normalize())
    }

    /// Origin and unit direction of the ray through film point (x, y) in [0, 1]², (0, 0) top left; where there is a lens,
    /// through its centre.
    pub fn ray(&self, x: f32, y: f32) -> (Vec3, Vec3) {
        let aside = (2.0 * x - 1.0) * self.right + (1.0 - 2.0 * y) * self.up;
        if self.central {
            (self.position, (self.forward + aside).normalize())
        } else {
            (self.position + aside, self.forward)
        }
    }

    /// Side length (m) of what one pixel of a film `height` pixels high covers at `distance` along a ray, facing it.
    pub fn footprint(&self, distance: f32, height: u32) -> f32 {
        let scale = if self.central { distance } else { 1.0 };
        2.0 * self.half_height * scale / height as f32
    }

    /// The same at a point, whether it is on the film or not.
    pub fn footprint_at(&self, point: Vec3, height: u32) -> f32 {
        self.footprint(point.distance(self.position), height)
    }
}

/// From the unit square to the unit disk; areas stay in proportion and neighbours stay neighbours (Shirley & Chiu 1997).
fn concentric_disk([u, v]: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0; 2];
    }
    let (radius, angle) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_2 - FRAC_PI_4 * (a / b)) };
    [radius * angle.cos(), radius * angle.sin()]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in the middle of the cells of a grid.
    fn grid(n: u32) -> impl Iterator<Item = [f32; 2]> {
        let middle = move |i: u32| (i as f32 + 0.5) / n as f32;
        (0..n * n).map(move |i| [middle(i % n), middle(i / n)])
    }

    #[test]
    fn a_disk_is_covered_evenly() {
        let points: Vec<[f32; 2]> = grid(64).map(concentric_disk).collect();
        let squared: Vec<f32> = points.iter().map(|[x, y]| x * x + y * y).collect();
        assert!(squared.iter().all(|r2| *r2 <= 1.0));
        // Half of the points lie within half of the area, and the mean of r² over a disk is ½.
        let within = squared.iter().filter(|r2| **r2 < 0.5).count() as f32 / squared.len() as f32;
        let mean = squared.iter().sum::<f32>() / squared.len() as f32;
        assert!((within - 0.5).abs() < 0.02 && (mean - 0.5).abs() < 0.005, "{within} {mean}");
        let [x, y] = points.iter().fold([0.0, 0.0], |[x, y], [u, v]| [x + u, y + v]);
        assert!(x.abs() + y.abs() < 1e-2, "{x} {y}");
    }

    #[test]
    fn rays_of_a_film_point_meet_at_the_focus_and_spread_by_the_formula_elsewhere() {
        let projection = Projection::Perspective { yfov: 0.7 };
        let mut camera =
            Camera::look_at(Vec3::new(1.0, 2.0, 5.0), Vec3::new(0.2, 0.4, 0.0), Vec3::Y, projection);
        let (radius, focus) = (0.07, 3.0);
        camera.lens = Some(Lens { radius, focus });
        let view = camera.view(1.5);
        assert!(view.has_lens());
        for [x, y] in [[0.5, 0.5], [0.1, 0.8]] {
            for depth in [1.0, 3.0, 9.0_f32] {
                let middle = {
                    let (origin, direction) = view.ray(x, y);
                    origin + depth / direction.dot(camera.forward) * direction
                };
                let mut widest = 0.0_f32;
                for lens in grid(32) {
                    let (origin, direction) = view.ray_through(x, y, lens);
                    let along = (origin - camera.position).dot(camera.forward);
                    assert!(along.abs() < 1e-6 && origin.distance(camera.position) <= 1.0001 * radius);
                    let point = origin + depth / direction.dot(camera.forward) * direction;
                    widest = widest.max(point.distance(middle));
                }
                // The circle of confusion at that depth: similar triangles about the focus.
                let expected = radius * (depth - focus).abs() / focus;
                assert!(
                    (widest - expected).abs() < 0.04 * expected + 2e-6,
                    "{depth}: {widest} for {expected}"
                );
            }
        }
    }

    #[test]
    fn a_pinhole_has_the_same_rays_whatever_the_numbers() {
        for projection in
            [Projection::Perspective { yfov: 0.7 }, Projection::Orthographic { half_height: 2.0 }]
        {
            let view = Camera::look_at(Vec3::ONE, Vec3::X, Vec3::Y, projection).view(1.5);
            assert!(!view.has_lens());
            assert_eq!(view.ray_through(0.3, 0.4, [0.1, 0.9]), view.ray(0.3, 0.4));
        }
    }

    #[test]
    fn a_film_of_any_shape_shows_the_whole_picture_that_the_camera_asks_for() {
        for projection in
            [Projection::Perspective { yfov: 0.7 }, Projection::Orthographic { half_height: 2.0 }]
        {
            let mut camera = Camera::look_at(Vec3::ZERO, Vec3::X, Vec3::Y, projection);
            let free = camera;
            camera.aspect = Some(1.6);
            let corner = |film: f32| {
                let (origin, direction) = free.ray(1.0, 0.0, 1.6);
                camera.film(origin + direction, film).expect("in front")
            };
            let near = |seen: [f32; 2], wanted: [f32; 2]| {
                let off = (seen[0] - wanted[0]).abs().max((seen[1] - wanted[1]).abs());
                assert!(off < 1e-6, "{seen:?} for {wanted:?}");
            };
            near(corner(1.6), [1.0, 0.0]);
            near(corner(0.8), [1.0, 0.25]);
            near(corner(3.2), [0.75, 0.0]);
            assert_eq!(camera.ray(0.3, 0.4, 1.6), free.ray(0.3, 0.4, 1.6), "to the bit where the shape fits");
        }
    }

    #[test]
    fn a_point_is_seen_where_its_ray_starts() {
        for projection in
            [Projection::Perspective { yfov: 0.7 }, Projection::Orthographic { half_height: 2.0 }]
        {
            let camera =
                Camera::look_at(Vec3::new(1.0, 2.0, 5.0), Vec3::new(0.2, 0.4, 0.0), Vec3::Y, projection);
            for [x, y] in [[0.0, 0.0], [0.3, 0.8], [1.2, 0.5]] {
                let (origin, direction) = camera.ray(x, y, 1.5);
                let [u, v] = camera.film(origin + 3.0 * direction, 1.5).expect("in front");
                assert!((u - x).abs() < 1e-5 && (v - y).abs() < 1e-5, "{u} {v} for {x} {y}");
            }
        }
        let camera = Camera::look_at(Vec3::ZERO, Vec3::X, Vec3::Y, Projection::Perspective { yfov: 0.7 });
        assert_eq!(camera.film(-Vec3::X, 1.0), None);
    }
}
