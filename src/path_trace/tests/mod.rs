//! Closed forms, each of which also rejects an answer that is off by 2 %, and agreement of the two strengths.

mod agreement;
mod branching;
mod direct;
mod furnace;
mod straight;

use super::{PathSettings, Picture, Rows, Strength, trace_pass};
use crate::light::Light;
use crate::optics::{Diffuse, Lobe};
use crate::rays::Rays;
use crate::scene::{
    Camera, Emission, Illumination, Luminaire, Material, Projection, Scene, SceneBuilder, Shape,
};
use glam::{DVec3, Vec3};

/// A scene under construction, about the world's zero.
struct Stage(SceneBuilder);

impl Stage {
    fn new(camera: Camera) -> Self {
        Self(Scene::builder("test").camera(camera).origin(DVec3::ZERO))
    }

    /// Adds a material; the index is what [`quad`](Self::quad) wants.
    fn material(&mut self, lobes: &[Lobe], illumination: Option<Illumination>) -> u32 {
        let mut material = Material::new(format!("m{}", self.0.materials.len()), grey(0.0));
        material.lobes = lobes.iter().map(|lobe| (1.0, *lobe)).collect();
        material.illumination = illumination;
        self.0.material(material)
    }

    fn shine(&mut self, material: u32, radiance: Light) {
        self.0.materials[material as usize].emission = Some(Emission { radiance, two_sided: false });
    }

    /// A parallelogram whose front looks along a × b.
    fn quad(&mut self, material: u32, corner: Vec3, a: Vec3, b: Vec3) {
        self.0.shape(Shape::quad("thing", material, [corner, corner + a, corner + a + b, corner + b]));
    }

    /// A box about `centre` whose fronts look inward.
    fn room(&mut self, material: u32, centre: Vec3, half: Vec3) {
        self.cuboid(material, centre, half, true);
    }

    /// A box about `centre` whose fronts look outward.
    fn block(&mut self, material: u32, centre: Vec3, half: Vec3) {
        self.cuboid(material, centre, half, false);
    }

    fn cuboid(&mut self, material: u32, centre: Vec3, half: Vec3, inward: bool) {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for sign in [-1.0, 1.0] {
                let (out, a) = (sign * axis, axis.any_orthonormal_vector());
                let b = out.cross(a);
                let corner = centre + half * (out - a - b);
                let (a, b) = (2.0 * half * a, 2.0 * half * b);
                let (a, b) = if inward { (b, a) } else { (a, b) };
                self.quad(material, corner, a, b);
            }
        }
    }

    fn lit(self, illumination: Illumination) -> Scene {
        self.0.illumination(illumination).build().unwrap()
    }
}

fn grey(albedo: f32) -> Lobe {
    Lobe::Diffuse(Diffuse { albedo: Vec3::splat(albedo), two_sided: false, under: None })
}

fn both(radiance: f32) -> Light {
    Light::both(Vec3::splat(radiance))
}

/// A camera that sees a spot too small for anything to vary over it.
fn spot_camera(position: Vec3, target: Vec3) -> Camera {
    let up = (target - position).any_orthonormal_vector();
    Camera::look_at(position, target, up, Projection::Orthographic { half_height: 1e-4 })
}

/// A camera in the middle of things with a wide view.
fn inside_camera() -> Camera {
    Camera::look_at(Vec3::ZERO, -Vec3::Z, Vec3::Y, Projection::Perspective { yfov: 1.2 })
}

fn settings(side: u32, samples_per_pixel: u32, strength: Strength) -> PathSettings {
    PathSettings {
        width: side,
        height: side,
        samples_per_pixel,
        seed: 1,
        strength,
        rows: Rows::Visible,
        max_reflections: None,
    }
}

/// Mean and standard error of what `measure` makes of independent passes.
fn over_passes(
    scene: &Scene,
    settings: &PathSettings,
    passes: u32,
    measure: impl Fn(&Picture) -> f64,
) -> (f64, f64) {
    let rays = Rays::build(scene);
    let values: Vec<f64> =
        (0..passes).map(|pass| measure(&trace_pass(scene, &rays, settings, pass))).collect();
    let n = f64::from(passes);
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

fn mean_green(pixels: &[Vec3]) -> f64 {
    pixels.iter().map(|pixel| f64::from(pixel.y)).sum::<f64>() / pixels.len() as f64
}

fn mean_visible(picture: &Picture) -> f64 {
    mean_green(&picture.visible)
}

/// z < 3.5 for the closed form, > 3.5 for closed forms that are off by 2 %. `rounding`: relative, what f32 is allowed.
fn assert_is((mean, error): (f64, f64), expected: f64) {
    let sigma = error.hypot(expected * 1e-5);
    let z = |expected: f64| (mean - expected).abs() / sigma;
    assert!(z(expected) < 3.5, "{mean} ± {error}, expected {expected}: z = {}", z(expected));
    for wrong in [0.98 * expected, 1.02 * expected] {
        assert!(z(wrong) > 3.5, "{mean} ± {error} cannot tell {expected} from {wrong}");
    }
}
