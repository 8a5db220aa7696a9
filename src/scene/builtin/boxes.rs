//! Scenes in a Cornell box that is open towards the camera. Half its side is 1.28 m, its walls look inward.

use crate::scene::{Camera, Emission, Fluorescence, Material, Projection, Scene, SceneBuilder, Shape};
use glam::Vec3;
use std::f32::consts::FRAC_PI_4;

const HALF: f64 = 1.28;

/// A glass sphere whose caustic falls on the floor, and a mirror sphere that sees it.
pub(super) fn caustic_box(name: String) -> Result<Scene, String> {
    let mut scene = walls(name, 0.15, 150.0);
    let mirror = scene.material(Material::metal("Mirror", Vec3::splat(0.95)));
    let glass = scene.material(Material::glass("Glass", 1.5));
    scene.shape(Shape::sphere("MirrorSphere", mirror, [-0.55, -0.78, -0.35], 0.5, 96));
    // The sphere hangs where it brings the lamp to a focus on the floor: 1/f = 1/a + 1/b with f = 1.5 radii.
    scene.shape(Shape::sphere("GlassSphere", glass, [0.5, -0.45, 0.35], 0.4, 128));
    scene.built()
}

/// The paper's figure 1: everything is diffuse, and the luminaire is seen.
pub(super) fn cornell_spheres(name: String) -> Result<Scene, String> {
    let mut scene = walls(name, 0.5, 20.0);
    let ball = scene.material(Material::diffuse("Ball", Vec3::splat(0.73)));
    scene.shape(Shape::sphere("BackBall", ball, [-0.55, -0.78, -0.3], 0.5, 64));
    scene.shape(Shape::sphere("FrontBall", ball, [0.55, -0.78, 0.3], 0.5, 64));
    scene.built()
}

/// Blue light alone, and three dyes: all that is red or green was re-radiated. A glass sphere throws an image of the bright ball.
pub(super) fn fluorescent_box(name: String, glows: bool) -> Result<Scene, String> {
    let mut scene = walls(name, 0.4, 0.0);
    let emission = Emission::front(Vec3::new(0.2, 0.3, 60.0));
    let dyes = [("Red", [0.05, 0.05, 0.1], [1.0, 0.25, 0.0]), ("Green", [0.1, 0.2, 0.1], [0.15, 1.0, 0.05])];
    for material in &mut scene.materials {
        if let Some((_, base, emits)) = dyes.iter().find(|(name, ..)| *name == material.name) {
            *material = dyed(&material.name, *base, *emits, glows);
        }
        if material.name == "Lamp" {
            material.emission = Some(emission);
        }
    }
    let ball = scene.material(dyed("Ball", [0.1, 0.1, 0.1], [0.45, 1.0, 0.0], glows));
    let glass = scene.material(Material::glass("Glass", 1.5));
    scene.shape(Shape::sphere("Ball", ball, [-0.35, 0.75, 0.0], 0.22, 64));
    scene.shape(Shape::sphere("GlassSphere", glass, [0.3, -0.3, 0.35], 0.4, 128));
    scene.built()
}

/// Matter that re-radiates nine tenths of the blue light that it absorbs.
fn dyed(name: &str, base: [f32; 3], emits: [f32; 3], glows: bool) -> Material {
    let plain = Material::diffuse(name, base.into());
    let dye = Fluorescence::dye([0.0, 0.0, 1.0 - base[2]], emits, 0.9);
    if glows { plain.with_fluorescence(dye) } else { plain }
}

/// Floor, ceiling, back, red and green walls, and a lamp of the given side and radiance just below the ceiling, seen from the front.
fn walls(name: String, side: f64, radiance: f32) -> SceneBuilder {
    let projection = Projection::Perspective { yfov: FRAC_PI_4 };
    let mut camera = Camera::look_at(Vec3::new(0.0, 0.0, 4.1), Vec3::ZERO, Vec3::Y, projection);
    camera.aspect = Some(1.0);
    let mut scene = SceneBuilder::new(name).camera(camera);
    let white = scene.material(Material::diffuse("White", Vec3::splat(0.73)));
    let red = scene.material(Material::diffuse("Red", Vec3::new(0.63, 0.065, 0.05)));
    let green = scene.material(Material::diffuse("Green", Vec3::new(0.14, 0.45, 0.091)));
    let lamp = Material::diffuse("Lamp", Vec3::ZERO).with_emission(Emission::front(Vec3::splat(radiance)));
    let lamp = scene.material(lamp);
    let mut quad = |name: &str, material, corners: [[f64; 3]; 4]| {
        scene.shape(Shape::quad(name, material, corners));
    };
    let h = HALF;
    quad("Floor", white, [[-h, -h, h], [h, -h, h], [h, -h, -h], [-h, -h, -h]]);
    quad("Ceiling", white, [[-h, h, -h], [h, h, -h], [h, h, h], [-h, h, h]]);
    quad("Back", white, [[-h, -h, -h], [h, -h, -h], [h, h, -h], [-h, h, -h]]);
    quad("Left", red, [[-h, -h, h], [-h, -h, -h], [-h, h, -h], [-h, h, h]]);
    quad("Right", green, [[h, -h, -h], [h, -h, h], [h, h, h], [h, h, -h]]);
    let (s, y) = (0.5 * side, 1.27);
    quad("Lamp", lamp, [[-s, y, -s], [s, y, -s], [s, y, s], [-s, y, s]]);
    scene
}
