//! The built-in scenes, and the files that are made from them.

use glam::Vec3;
use halflight::light::Light;
use halflight::scene::{Illumination, Luminaire, Scene};

fn power(scene: &Scene) -> Light {
    scene.luminaires.iter().fold(Light::ZERO, |sum, l| sum + l.power(1.0))
}

#[test]
fn every_listed_scene_loads() {
    for (name, _) in Scene::builtins() {
        let scene = Scene::load(format!("builtin:{name}")).expect(name);
        assert!(power(&scene).invisible.min_element() > 0.0, "{name}");
        assert_eq!(scene.name, format!("builtin:{name}"));
        assert!(scene.materials.iter().all(|m| !m.bsdf().terms.is_empty()), "{name}");
    }
}

#[test]
fn files_agree_with_the_scenes_they_were_made_from() {
    for file in ["caustic-box.glb", "cornell-spheres.gltf"] {
        let name = file.split('.').next().unwrap();
        let ours = Scene::load(format!("builtin:{name}")).expect(name);
        let theirs = Scene::load(format!("scenes/{file}")).expect(file);
        assert_eq!(ours.mesh.triangles, theirs.mesh.triangles, "{file}");
        assert_eq!(ours.mesh.surface, theirs.mesh.surface, "{file}");
        assert_eq!(ours.surfaces, theirs.surfaces, "{file}");
        assert!(ours.origin.distance(theirs.origin) < 1e-6, "{file}");
        let apart = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(apart(&ours.mesh.positions, &theirs.mesh.positions) < 1e-6, "{file}");
        assert!(apart(&ours.mesh.normals, &theirs.mesh.normals) < 1e-6, "{file}");
        for (a, b) in ours.materials.iter().zip(&theirs.materials) {
            assert_eq!((&a.name, a.bsdf(), a.emission), (&b.name, b.bsdf(), b.emission), "{file}");
        }
        let (a, b) = (power(&ours).visible, power(&theirs).visible);
        assert!((a - b).length() < 1e-5 * a.length(), "{file}: {a} against {b}");
        assert!(ours.camera.position.distance(theirs.camera.position) < 1e-6, "{file}");
        assert_eq!(ours.camera.projection, theirs.camera.projection, "{file}");
        assert_eq!(ours.camera.aspect, theirs.camera.aspect, "{file}");
        let talk: Vec<_> = theirs.notes.iter().filter(|n| !n.starts_with("solid glass")).collect();
        assert!(talk.is_empty(), "{file}: {talk:?}");
    }
}

#[test]
fn walls_look_inward_and_balls_outward() {
    for name in [
        "builtin:caustic-box",
        "builtin:cornell-spheres",
        "builtin:fluorescent-box",
        "builtin:concentric",
        "builtin:two-spheres",
    ] {
        let scene = Scene::load(name).expect(name);
        let mut volume = vec![0.0_f64; scene.surfaces.len()];
        for (index, surface) in scene.mesh.surface.iter().enumerate() {
            let [a, b, c] = scene.mesh.corners(index as u32).map(Vec3::as_dvec3);
            volume[*surface as usize] += a.dot(b.cross(c)) / 6.0;
        }
        for (surface, volume) in scene.surfaces.iter().zip(volume) {
            let outward = surface.name.contains("Ball") || surface.name.contains("Sphere");
            assert_eq!(surface.closed, outward || surface.name == "Room", "{name} {surface:?}");
            // The floor and the lamp of an open scene look at each other, too.
            assert_eq!(volume > 0.0, outward, "{name} {surface:?}: {volume}");
        }
    }
}

#[test]
fn two_spheres_are_as_in_the_paper() {
    let scene = Scene::load("builtin:two-spheres").unwrap();
    let n = scene.mesh.triangles.len();
    assert!((495_000..505_000).contains(&n), "{n}");
    assert_eq!(scene.illumination, Some(Illumination::LOCAL));
    assert_eq!(power(&scene).visible, Vec3::ZERO);
    assert!(power(&scene).invisible.x > 10.0);
}

#[test]
fn concentric_spheres_have_the_area_of_spheres() {
    let scene = Scene::load("builtin:concentric?albedo=0.7&ratio=0.25&two_sided=true").unwrap();
    let mut area = [0.0; 2];
    for (index, surface) in scene.mesh.surface.iter().enumerate() {
        area[*surface as usize] += f64::from(scene.mesh.area(index as u32));
    }
    let sphere = 4.0 * std::f64::consts::PI;
    assert!(
        (area[0] / sphere - 1.0).abs() < 1e-3 && (area[1] / sphere * 16.0 - 1.0).abs() < 1e-3,
        "{area:?}"
    );
    let [Luminaire::Point { position, .. }] = scene.luminaires[..] else { panic!("one light") };
    assert!(
        (0.3..0.95).contains(&position.length()) && (0.3..0.98).contains(&scene.camera.position.length())
    );
    assert_eq!(scene.illumination, Some(Illumination::SHADOWLESS));
}

#[test]
fn wrong_names_and_queries_are_told() {
    for (name, needle) in [
        ("builtin:nothing", "caustic-box, cornell-spheres"),
        ("builtin:", "no such scene"),
        ("builtin:concentric?albedo=2", "from 0 to 1"),
        ("builtin:concentric?albedo=NaN", "from 0 to 1"),
        ("builtin:concentric?ratio=x", "from 0.01"),
        ("builtin:concentric?colour=1", "albedo, ratio, two_sided"),
        ("builtin:concentric?albedo=0.5&albedo=0.6", "`albedo`"),
        ("builtin:concentric?albedo", "key=value"),
        ("builtin:caustic-box?albedo=1", "`albedo`"),
    ] {
        let message = Scene::load(name).expect_err(name).to_string();
        assert!(
            message.starts_with(name) && message.contains(needle) && !message.contains('\n'),
            "{message}"
        );
    }
}
