use super::levels::ENOUGH;
use super::*;
use crate::light::{Invisible, Light};
use crate::optics::{Diffuse, Lobe};
use crate::plan::Settings;
use crate::scene::{Camera, Luminaire, Material, Projection, Scene, Shape};
use glam::DVec3;

/// A floor at y = 0 below a sheet of glass at y = 1, and lights of equal power.
fn below_glass(lights: &[Vec3]) -> Scene {
    let projection = Projection::Perspective { yfov: 0.5 };
    let camera = Camera::look_at(Vec3::new(0.0, 0.8, 3.0), Vec3::ZERO, Vec3::Y, projection);
    let mut scene = Scene::builder("below glass").camera(camera).origin(DVec3::ZERO);
    let floor = Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided: true, under: None });
    let materials = [Material::new("Floor", floor), Material::glass("Glass", 1.5)];
    for (material, y, turn) in [(0, 0.0, -1.0), (1, 1.0, 1.0)] {
        let corner = |[x, z]: [f32; 2]| Vec3::new(4.0 * x, y, 4.0 * turn * z);
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner);
        scene.shape(Shape::quad("", material, corners));
    }
    scene.materials = materials.to_vec();
    let intensity = Light::both(Vec3::ONE);
    scene.luminaires = lights.iter().map(|&position| Luminaire::Point { position, intensity }).collect();
    scene.build().unwrap()
}

#[test]
fn radii_are_for_the_photons_that_chance_leaves() {
    // Four hundredths of the light come back from the glass, and of two lights one shines elsewhere.
    let lights = [Vec3::new(0.0, 0.5, 0.0), Vec3::new(1000.0, 0.5, 0.0)];
    for lights in [&lights[..1], &lights] {
        let plan = Plan::new(below_glass(lights), Settings::for_film(64, 64));
        let mut frame = Frame::asked(&plan);
        // Beams do not know of a guide, which would make paths denser here: there is none yet.
        frame.photons = frame.photons.map(|photons| photons.with_paths(2_000_000));
        let photons = shoot::<Invisible>(&plan, &frame, 0);
        let side = 0.4;
        let near = |photon: &&Photon<Invisible>| {
            let [x, y, z] = photon.position.abs().to_array();
            y < 0.1 && x < side && z < side
        };
        let caustic = || photons.by_class[PathClass::Caustic as usize].iter().filter(near);
        let n = caustic().count() as f32;
        let density = n / (2.0 * side).powi(2);
        let expected = (ENOUGH / (std::f32::consts::PI * density)).sqrt().ln();
        let (view, radii) = (plan.scene.camera.view(1.0), frame.caustic_radii());
        let radius = |photon: &Photon<Invisible>| {
            radii[usize::from(photon.level())] * view.footprint_at(photon.position, 64)
        };
        let found = caustic().map(|photon| radius(photon).ln()).sum::<f32>() / n;
        // Levels are drawn: the mean of so many is good to about a hundredth.
        assert!(n > 500.0 && (found - expected).abs() < 0.05, "{} for {}", found.exp(), expected.exp());
    }
}
