//! The two scenes that came from Blender and from the comparison with other renderers.

use glam::Vec3;
use halflight::light::Light;
use halflight::optics::{Dielectric, Lobe, Mirror};
use halflight::scene::{Illumination, Luminaire, Material, Projection, Scene};
use std::path::Path;

fn load(name: &str) -> Scene {
    Scene::load(Path::new("scenes").join(name)).expect("a good scene")
}

fn material<'a>(scene: &'a Scene, name: &str) -> &'a Material {
    scene.materials.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no {name}"))
}

fn only_lobe(scene: &Scene, name: &str) -> Lobe {
    let lobes = &material(scene, name).lobes;
    assert_eq!((lobes.len(), lobes[0].0), (1, 1.0), "{name}: {lobes:?}");
    lobes[0].1
}

#[test]
fn gallery_has_all_its_facts() {
    let scene = load("gallery.glb");
    println!("{:#?}", scene.notes);
    assert_eq!(scene.illumination, Some(Illumination::GLOBAL));
    assert_eq!(material(&scene, "Cone").illumination, Some(Illumination::SHADOWLESS));
    assert_eq!(material(&scene, "Box").illumination, Some(Illumination::Square { s: 0.5, t: 0.25 }));
    assert_eq!(material(&scene, "Box").resolved(), "0.5,0.25");

    assert_eq!(only_lobe(&scene, "Glass"), Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::ONE }));
    let gold = Vec3::new(1.0, 0.71, 0.29);
    assert_eq!(only_lobe(&scene, "Gold"), Lobe::Mirror(Mirror::metal(gold, false)));
    let [(1.0, Lobe::Glossy(_)), (1.0, Lobe::Diffuse(red))] = material(&scene, "Red").lobes[..] else {
        panic!("not diffuse under a clear layer")
    };
    assert_eq!((red.albedo, red.two_sided), (Vec3::new(0.63, 0.065, 0.05), false));

    let monkey = scene.surfaces.iter().find(|s| s.name == "Monkey").unwrap();
    assert!(monkey.smooth && !monkey.closed, "its eyes are open");
    let floor = scene.surfaces.iter().find(|s| s.name == "Floor").unwrap();
    assert!(!floor.closed && !floor.smooth);
    for closed in ["Ring", "Ball", "Cone", "Box"] {
        assert!(scene.surfaces.iter().any(|s| s.name == closed && s.closed), "{closed} is closed");
    }

    let lamp = material(&scene, "Lamp").emission.unwrap();
    let expected = 17.0 * Vec3::new(1.0, 0.75, 0.3);
    assert!((lamp.radiance.visible - expected).length() < 1e-4 && !lamp.two_sided);
    assert_eq!(lamp.radiance.visible, lamp.radiance.invisible);

    // Blender's 3 W lamp is 3 / 4π W/sr, whatever the exporter wrote.
    let bulbs: Vec<_> = scene.luminaires.iter().filter(|l| l.is_delta()).collect();
    let [Luminaire::Point { position, intensity }] = bulbs[..] else { panic!("{bulbs:?}") };
    assert!((intensity.visible - Vec3::splat(3.0 / (4.0 * std::f32::consts::PI))).length() < 1e-5);
    let world = position.as_dvec3() + scene.origin;
    assert!((world - glam::DVec3::new(-0.8, 1.7, 0.8)).length() < 1e-6);

    let eye = scene.camera.position.as_dvec3() + scene.origin;
    assert!((eye - glam::DVec3::new(0.0, 1.0, 3.9)).length() < 1e-6);
    assert_eq!(scene.camera.projection, Projection::Perspective { yfov: 40.0_f32.to_radians() });
    assert_eq!((scene.camera.aspect, scene.camera.forward), (Some(1.0), Vec3::NEG_Z));
    let note = |needle: &str| scene.notes.iter().any(|n| n.contains(needle));
    assert!(note("683") && note("Bulb") && note("solid glass in spite of small holes"));
}

#[test]
fn peer_box_is_read_without_a_word() {
    let scene = load("peer-box.glb");
    println!("{:#?}", scene.notes);
    assert_eq!(scene.notes, ["solid glass: GlassSphere (Glass)"]);
    assert_eq!(only_lobe(&scene, "Glass"), Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::ONE }));
    assert_eq!(only_lobe(&scene, "Mirror"), Lobe::Mirror(Mirror::plain(Vec3::ONE, false)));
    assert_eq!(scene.illumination, None);
    assert_eq!(scene.materials[0].resolved(), "global");
    assert_eq!(scene.mesh.triangles.len(), 2 * 195_072 / 3 + 12);
    for surface in &scene.surfaces {
        assert_eq!(surface.smooth, surface.name.ends_with("Sphere"), "{surface:?}");
        assert_eq!(surface.closed, surface.name.ends_with("Sphere"), "{surface:?}");
    }
    let power = scene.luminaires.iter().fold(Light::ZERO, |sum, l| sum + l.power(1.0));
    let expected = std::f32::consts::PI * 0.25 * 25.0;
    assert!((power.visible - expected).length() < 1e-4 * expected, "{power:?}");
    // The walls look into the box.
    for triangle in 0..scene.mesh.triangles.len() as u32 {
        let surface = scene.surface_of(triangle);
        if !surface.smooth {
            let [a, ..] = scene.mesh.corners(triangle);
            let inward = -(a.as_dvec3() + scene.origin).as_vec3();
            assert!(scene.mesh.normal(triangle).dot(inward) > 0.0, "{}", surface.name);
        }
    }
}
