//! A small scene builder, and the test of a closed form.

use glam::{DVec3, Vec3};
use halflight::film::Layer;
use halflight::optics::{Diffuse, Lobe};
use halflight::plan::Settings;
use halflight::render::Render;
use halflight::scene::{Camera, Emission, Illumination, Material, Projection, Scene, SceneBuilder, Shape};
use std::f32::consts::{PI, TAU};

/// A scene under construction, about the world's zero.
pub struct Build(pub SceneBuilder);

pub fn diffuse(albedo: f32) -> Lobe {
    Lobe::Diffuse(Diffuse { albedo: Vec3::splat(albedo), two_sided: false, under: None })
}

pub fn look(from: Vec3, at: Vec3) -> Camera {
    let up = if (at - from).cross(Vec3::Y).length() < 1e-3 { Vec3::Z } else { Vec3::Y };
    Camera::look_at(from, at, up, Projection::Perspective { yfov: 0.1 })
}

impl Build {
    pub fn new(illumination: Illumination, camera: Camera) -> Self {
        Self(Scene::builder("test").illumination(illumination).camera(camera).origin(DVec3::ZERO))
    }

    pub fn material(&mut self, name: &str, lobe: Lobe) -> u32 {
        self.0.material(Material::new(name, lobe))
    }

    /// Another view from where the camera is.
    pub fn yfov(&mut self, yfov: f32) {
        self.0.camera.as_mut().expect("its camera").projection = Projection::Perspective { yfov };
    }

    /// A parallelogram; its front is where `a × b` points.
    pub fn quad(&mut self, corner: Vec3, a: Vec3, b: Vec3, material: u32) -> &mut Self {
        self.0.shape(Shape::quad("thing", material, [corner, corner + a, corner + a + b, corner + b]));
        self
    }

    /// A sphere of longitude and latitude; its front is outside, or inside where `inward`.
    pub fn sphere(
        &mut self,
        centre: Vec3,
        radius: f32,
        (around, down): (u32, u32),
        inward: bool,
        material: u32,
    ) {
        let (mut normals, mut triangles) = (Vec::new(), Vec::new());
        for (j, i) in (0..=down).flat_map(|j| (0..around).map(move |i| (j, i))) {
            let (theta, phi) = (PI * j as f32 / down as f32, TAU * i as f32 / around as f32);
            normals.push(match j {
                0 => Vec3::Y,
                _ if j == down => -Vec3::Y,
                _ => Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()),
            });
            let at = |i: u32, j: u32| j * around + i % around;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            // At the poles a facet is one triangle.
            triangles.extend((0 < j && j < down).then_some([a, b, c]));
            triangles.extend((j + 1 < down).then_some([a, c, d]));
        }
        let positions: Vec<Vec3> = normals.iter().map(|n| centre + radius * n).collect();
        let shape = Shape::new("thing", material, positions, triangles).with_normals(normals);
        self.0.shape(if inward { shape.inside_out() } else { shape });
    }

    /// Shades all that is there by its triangles.
    pub fn flatten(&mut self) {
        self.0.shapes.iter_mut().for_each(|shape| shape.normals = None);
    }

    /// The finished scene.
    pub fn finish(self) -> Scene {
        self.0.build().expect("a good scene")
    }
}

/// Emission of equal halves from the front.
pub fn glow(radiance: f32) -> Option<Emission> {
    Some(Emission::front(Vec3::splat(radiance)))
}

/// Settings for a small film.
pub fn small(width: u32, height: u32, paths: u32) -> Settings {
    Settings { width, height, paths: Some(paths), ..Settings::default() }
}

/// Mean over the film of the first channel, with its standard error from the passes.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    pub mean: f64,
    pub error: f64,
}

pub fn measure(scene: Scene, settings: Settings, passes: u32) -> Measured {
    let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("a render");
    for _ in 0..passes {
        render.pass();
    }
    let (mean, error) =
        (render.film().mean_colour(), render.film().mean_colour_error().expect("several passes"));
    Measured { mean: mean.x, error: error.x }
}

impl Measured {
    /// The mean of samples with its standard error.
    pub fn of(samples: &[f64]) -> Self {
        let n = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / n;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt() }
    }

    /// Passes when the closed form lies within 3.5 standard errors, and a closed form 2 % higher or lower does not.
    /// `rounding`: relative error of the closed form itself (tessellation, f32), to be far below 2 %.
    #[track_caller]
    pub fn must_be(&self, expected: f64, rounding: f64) {
        assert!(rounding <= 0.004, "an allowance of {rounding} would hide a 2 % error");
        let z = |expected: f64| {
            let off = (self.mean - expected).abs() - rounding * expected.abs();
            off.max(0.0) / self.error.max(1e-9 * expected.abs())
        };
        assert!(z(expected) < 3.5, "{self:?} against {expected}: z = {:.2}", z(expected));
        for wrong in [0.98 * expected, 1.02 * expected] {
            assert!(z(wrong) > 3.5, "{self:?} cannot tell {expected} from {wrong}: z = {:.2}", z(wrong));
        }
    }
}

/// Says that something was not tested where a person sees it: what tests print is kept back.
pub fn skipped(why: impl std::fmt::Display) {
    use std::io::Write;
    writeln!(std::io::stderr(), "SKIPPED: {why}").expect("a terminal or a log");
}
