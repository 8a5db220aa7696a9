use glam::Vec3;

/// A pinhole or orthographic camera. Its three axes are unit vectors at right angles.
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
        Self { position, right, up: right.cross(forward), forward, projection, aspect: None }
    }

    /// What it sees on a film of the given width / height.
    pub fn view(&self, aspect: f32) -> View {
        let central = matches!(self.projection, Projection::Perspective { .. });
        let half_height = self.half_height(aspect);
        let (right, up) = (half_height * aspect * self.right, half_height * self.up);
        View { position: self.position, forward: self.forward, right, up, half_height, central }
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
    /// the given width / height.
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
}

impl View {
    /// Origin and unit direction of the ray through film point (x, y) in [0, 1]², (0, 0) top left.
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

#[cfg(test)]
mod tests {
    use super::*;

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
