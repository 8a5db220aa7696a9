//! What is read from good files.

use crate::small::Small;
use glam::{DVec3, Vec3};
use halflight::light::Light;
use halflight::optics::{Dielectric, Diffuse, Lobe, Mirror, RoughDielectric, ThinDielectric};
use halflight::scene::{Illumination, Luminaire, Projection, Scene, SpotCone};
use serde_json::{Value, json};

const LIGHT: &str = "/extensions/KHR_lights_punctual/lights/0";

fn note(scene: &Scene, needle: &str) -> bool {
    scene.notes.iter().any(|note| note.contains(needle))
}

fn lobes(material: Value) -> (Vec<(f32, Lobe)>, Scene) {
    let scene = Small::new().with("/materials/0", material).good();
    (scene.materials[0].lobes.clone(), scene)
}

#[test]
fn the_small_scene_is_read_without_a_word() {
    let scene = Small::new().good();
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    assert_eq!((scene.mesh.triangles.len(), scene.mesh.positions.len()), (6, 8));
    let [body, sheet] = &scene.surfaces[..] else { panic!("two surfaces") };
    assert!(body.closed && body.smooth && !sheet.closed && !sheet.smooth);
    assert_eq!(scene.origin, DVec3::ZERO); // bounds: x and z ±2, y ±1
    for triangle in 4..6 {
        assert!((scene.mesh.normal(triangle) - Vec3::Y).length() < 1e-6, "the strip looks up");
    }
    assert_eq!(scene.camera.aspect, None);
    assert_eq!(scene.camera.projection, Projection::Perspective { yfov: 0.7 });
}

#[test]
fn mirrored_nodes_keep_their_front_and_normals_follow_the_surface() {
    let scale = json!([-1, 0.5, 3]);
    for scene in [Small::new().good(), Small::new().with("/nodes/0/scale", scale).good()] {
        let centre = scene.mesh.positions[..4].iter().sum::<Vec3>() / 4.0;
        for triangle in 0..4 {
            let [a, ..] = scene.mesh.corners(triangle);
            assert!(scene.mesh.normal(triangle).dot(a - centre) > 0.0);
        }
        for vertex in 0..4 {
            assert!(scene.mesh.normals[vertex].dot(scene.mesh.positions[vertex] - centre) > 0.0);
            assert!(scene.mesh.normals[vertex].is_normalized());
        }
        assert!(scene.surfaces[0].closed && scene.notes.is_empty(), "{:?}", scene.notes);
    }
}

#[test]
fn matrices_and_parents_are_composed() {
    let mut small = Small::new().with("/nodes/0/translation", json!([0, 1e6, 0]));
    let matrix = [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1_000_000, 0, 0, 1];
    let node = json!({ "name": "Parent", "matrix": matrix, "children": [0, 1, 2, 3] });
    small.json["nodes"].as_array_mut().unwrap().push(node);
    let scene = small.with("/scenes/0/nodes", json!([4])).good();
    let world = scene.mesh.positions[0].as_dvec3() + scene.origin;
    assert!(world.distance(DVec3::new(1e6, 2e6, 0.0)) < 0.2, "{world}");
    let Luminaire::Point { position, .. } = scene.luminaires[0] else { panic!("a point light") };
    assert!((position.as_dvec3() + scene.origin).distance(DVec3::new(1e6, 6.0, 0.0)) < 0.1);
    assert!((scene.camera.position.as_dvec3() + scene.origin).distance(DVec3::new(1e6, 0.0, 10.0)) < 0.1);
}

#[test]
fn shares_of_lobes_follow_the_metallic_roughness_model() {
    let colour = Vec3::new(0.5, 0.25, 0.125);
    let base = [0.5, 0.25, 0.125, 0.3];
    let diffuse = |two_sided| Lobe::Diffuse(Diffuse { albedo: colour, two_sided, under: None });

    let (found, scene) = lobes(json!({ "doubleSided": true, "pbrMetallicRoughness": {
        "baseColorFactor": base, "metallicFactor": 0.25, "roughnessFactor": 0 } }));
    // Metal and the clear layer of the body have the same facets: their reflectances add up.
    let [(1.0, Lobe::Glossy(facets)), (0.75, Lobe::Diffuse(body))] = found[..] else { panic!("{found:?}") };
    assert!((facets.f0 - (0.25 * colour + 0.75 * 0.04)).length() < 1e-6, "{}", facets.f0);
    assert!(facets.f90 == Vec3::ONE && facets.alpha == [1e-6; 2] && facets.two_sided);
    assert!(body.albedo == colour && body.two_sided && body.under.is_some());
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);

    let (found, scene) =
        lobes(json!({ "name": "Steel", "pbrMetallicRoughness": { "baseColorFactor": base } }));
    let [(1.0, Lobe::Glossy(facets))] = found[..] else { panic!("{found:?}") };
    assert_eq!((facets.f0, facets.f90, facets.alpha), (colour, Vec3::ONE, [1.0; 2]));
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let (found, _) =
        lobes(json!({ "pbrMetallicRoughness": { "baseColorFactor": base, "roughnessFactor": 0 } }));
    assert_eq!(found, [(1.0, Lobe::Mirror(Mirror::metal(colour, false)))]);
    let (found, _) = lobes(json!({ "pbrMetallicRoughness": { "baseColorFactor": base, "metallicFactor": 0 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0 } } }));
    assert_eq!(found, [(1.0, diffuse(false))]);

    let (found, scene) = lobes(json!({ "name": "Milk", "pbrMetallicRoughness": {
            "baseColorFactor": base, "metallicFactor": 0.5 },
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.5 },
            "KHR_materials_ior": { "ior": 1.25 } } }));
    let glass = Lobe::RoughDielectric(RoughDielectric { ior: 1.25, alpha: 1.0, tint: colour });
    let [(1.0, Lobe::Glossy(_)), milk, (0.25, Lobe::Diffuse(_))] = found[..] else { panic!("{found:?}") };
    assert_eq!(milk, (0.25, glass));
    assert!(!note(&scene, "not supported"), "{:?}", scene.notes);
}

#[test]
fn glass_is_solid_in_bodies_and_thin_in_sheets_unless_told() {
    let glass = |extras: Value| {
        json!({ "name": "Glass", "extras": extras,
            "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0 },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 } } })
    };
    let solid = Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::ONE });
    let thin = Lobe::ThinDielectric(ThinDielectric { ior: 1.5, tint: Vec3::ONE });
    let both = |extras: Value| {
        let small = Small::new().with("/materials/0", glass(extras));
        small.with("/meshes/1/primitives/0/material", json!(0)).good()
    };
    let of =
        |scene: &Scene, surface: usize| scene.materials[scene.surfaces[surface].material as usize].lobes[0].1;
    let scene = both(json!({}));
    assert_eq!((of(&scene, 0), of(&scene, 1), scene.materials.len()), (solid, thin, 2));
    assert_eq!(scene.materials[0].name, scene.materials[1].name);
    assert!(note(&scene, "solid glass: Body (Glass)") && note(&scene, "thin panes of glass: Sheet (Glass)"));
    let scene = both(json!({ "thin": true }));
    assert_eq!((of(&scene, 0), of(&scene, 1), scene.materials.len()), (thin, thin, 1));
    let scene = both(json!({ "thin": false }));
    assert_eq!((of(&scene, 0), of(&scene, 1), scene.materials.len()), (solid, solid, 1));
}

#[test]
fn emission_has_two_halves() {
    let lamp = |extras: Value| {
        let scene = Small::new().with(
            "/materials/1",
            json!({ "name": "Lamp", "doubleSided": true, "emissiveFactor": [1, 0.5, 0], "extras": extras,
                "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 } } }),
        );
        scene.good().materials[1].emission.unwrap()
    };
    let rgb = Vec3::new(4.0, 2.0, 0.0);
    assert_eq!(lamp(json!({})).radiance, Light::both(rgb));
    assert!(lamp(json!({})).two_sided);
    assert_eq!(lamp(json!({ "emission": "both" })).radiance, Light::both(rgb));
    assert_eq!(lamp(json!({ "emission": "invisible" })).radiance, Light::new(rgb, Vec3::ZERO));
    assert_eq!(lamp(json!({ "emission": [0.5, 2] })).radiance, Light::new(0.5 * rgb, 2.0 * rgb));
    let off = Small::new().with("/materials/0/extras", json!({ "emission": "invisible" })).good();
    assert!(note(&off, "nothing is emitted") && off.luminaires.len() == 1);
    let shining = Small::new().with("/materials/1/emissiveFactor", json!([1, 1, 1])).good();
    let areas: Vec<_> = shining
        .luminaires
        .iter()
        .filter_map(|l| {
            if let Luminaire::Triangle { area, triangle, .. } = l { Some((*triangle, *area)) } else { None }
        })
        .collect();
    // What shines comes first.
    assert_eq!(areas, [(0, 8.0), (1, 8.0)]);
}

#[test]
fn illumination_comes_from_materials_and_the_scene() {
    let scene = Small::new()
        .with("/scenes/0/extras", json!({ "illumination": "local" }))
        .with("/materials/0/extras", json!({ "illumination": [0.5, 1], "straight": [0, 0, 0, 0.25] }))
        .good();
    assert_eq!(scene.illumination, Some(Illumination::LOCAL));
    assert_eq!(scene.materials[1].resolved(), "local");
    assert_eq!(scene.materials[0].illumination, Some(Illumination::Square { s: 0.5, t: 1.0 }));
    assert_eq!(scene.materials[0].bsdf().straight.rows(), [[0.0, 0.0], [0.0, 0.25]]);
}

#[test]
fn punctual_lights_of_every_kind() {
    let small = || Small::new().with(&format!("{LIGHT}/color"), json!([1, 0.5, 0.25]));
    let rgb = 10.0 * Vec3::new(1.0, 0.5, 0.25);
    let only = |small: Small| small.good().luminaires[0];
    let position = Vec3::new(0.0, 3.0, 0.0);
    assert_eq!(only(small()), Luminaire::Point { position, intensity: Light::both(rgb) });

    // A quarter turn about -X brings -Z to -Y.
    let down = small().with(
        "/nodes/2/rotation",
        json!([-std::f32::consts::FRAC_1_SQRT_2, 0, 0, std::f32::consts::FRAC_1_SQRT_2]),
    );
    let sun = only(down.clone().with(&format!("{LIGHT}/type"), json!("directional")));
    let Luminaire::Directional { direction, irradiance } = sun else { panic!("{sun:?}") };
    assert!((direction - Vec3::NEG_Y).length() < 1e-6 && irradiance == Light::both(rgb));

    let cone = json!({ "innerConeAngle": 0.25, "outerConeAngle": 0.5 });
    let spot =
        down.clone().with(&format!("{LIGHT}/type"), json!("spot")).with(&format!("{LIGHT}/spot"), cone);
    let Luminaire::Spot { cone, direction, .. } = only(spot.clone()) else { panic!("no spot") };
    assert_eq!(cone, SpotCone::of_angles(0.25, 0.5));
    assert!((direction - Vec3::NEG_Y).length() < 1e-6);

    let warn = spot.with("/nodes/2/extras", json!({ "warn": [2, 0, 0.5, 1], "emission": "invisible" }));
    let Luminaire::Warn { exponent, attenuation, intensity, .. } = only(warn) else { panic!("no Warn spot") };
    assert_eq!((exponent, attenuation), (2.0, [0.0, 0.5, 1.0]));
    assert_eq!(intensity, Light::new(rgb, Vec3::ZERO));

    let ranged = small().with(&format!("{LIGHT}/range"), json!(2)).good();
    assert!(note(&ranged, "range") && note(&ranged, "Lux"));
}

#[test]
fn blenders_lumens_become_watts_again() {
    let blender = |kind: &str| {
        let small = Small::new().with("/asset/generator", json!("Khronos glTF Blender I/O v4.2.83"));
        small
            .with(&format!("{LIGHT}/type"), json!(kind))
            .with(&format!("{LIGHT}/intensity"), json!(1366))
            .good()
    };
    let scene = blender("point");
    let Luminaire::Point { intensity, .. } = scene.luminaires[0] else { panic!("no point") };
    assert_eq!(intensity.visible, Vec3::splat(2.0));
    assert!(note(&scene, "683") && note(&scene, "Lux"));
    let Luminaire::Directional { irradiance, .. } = blender("directional").luminaires[0] else {
        panic!("no sun")
    };
    assert_eq!(irradiance.visible, Vec3::splat(2.0));
}

#[test]
fn blenders_watts_from_before_it_converted_are_watts() {
    let old = |kind: &str| {
        let small = Small::new().with("/asset/generator", json!("Khronos glTF Blender I/O v1.6.16"));
        let cone = json!({ "innerConeAngle": 0.25, "outerConeAngle": 0.5 });
        let small = small.with(&format!("{LIGHT}/type"), json!(kind)).with(&format!("{LIGHT}/spot"), cone);
        small.with(&format!("{LIGHT}/intensity"), json!(3)).good()
    };
    let lamp = 3.0 / (4.0 * std::f32::consts::PI);
    for (kind, expected) in [("point", lamp), ("spot", lamp), ("directional", 3.0)] {
        let scene = old(kind);
        let (Luminaire::Point { intensity: light, .. }
        | Luminaire::Spot { intensity: light, .. }
        | Luminaire::Directional { irradiance: light, .. }) = scene.luminaires[0]
        else {
            panic!("no {kind}")
        };
        assert!((light.visible - Vec3::splat(expected)).length() < 1e-6, "{kind}: {}", light.visible);
        assert!(note(&scene, "Blender before 3.4") && note(&scene, "Lux"));
    }
}

#[test]
fn cameras_are_found_and_named() {
    let orthographic = json!({ "name": "Lens", "type": "orthographic", "orthographic": { "xmag": 3, "ymag": 2, "znear": 0, "zfar": 9 } });
    let scene = Small::new().with("/cameras/0", orthographic).good();
    assert_eq!(scene.camera.projection, Projection::Orthographic { half_height: 2.0 });
    assert_eq!(scene.camera.aspect, Some(1.5));

    let lens = Small::new().with("/cameras/0/extras", json!({ "fstop": 1.4, "focus": 5 })).good();
    let radius = 0.5 * 0.012 / (0.5 * 0.7_f32).tan() / 1.4;
    let found = lens.camera.lens.expect("a lens");
    assert!((found.radius / radius - 1.0).abs() < 1e-6 && found.focus == 5.0, "{found:?}");
    assert!(lens.notes.is_empty(), "{:?}", lens.notes);
    let object = Small::new().with("/nodes/3/extras", json!({ "fstop": 1.4, "focus": 5 })).good();
    assert!(
        object.camera.lens.is_none() && note(&object, "`fstop` has no effect here; it is read on cameras")
    );

    let scene = Small::new().with("/nodes/1/camera", json!(0)).good();
    assert!(note(&scene, "Sheet") && note(&scene, "Eye"), "{:?}", scene.notes);
    let turned = Small::new().with("/nodes/3/scale", json!([2, 3, -4])).good();
    let camera = turned.camera;
    assert!(camera.right.cross(camera.up).dot(camera.forward) < -0.999, "right-handed, unit axes");
}

#[test]
fn what_is_not_supported_is_told_once_by_name() {
    let texture = json!({ "index": 0 });
    let scene = Small::new()
        .with("/animations", json!([{}]))
        .with("/textures", json!([{}]))
        .with("/extensionsUsed", json!(["KHR_lights_environment", "KHR_materials_clearcoat", "KHR_texture_basisu"]))
        .with("/nodes/0/extensions", json!({ "MSFT_lod": {} }))
        .with("/nodes/1/extras", json!({ "illumination": "local" }))
        .with("/materials/0", json!({ "name": "Skin", "alphaMode": "BLEND", "normalTexture": texture,
            "emissiveTexture": texture, "emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorTexture": texture },
            "extras": { "ilumination": "local", "mine": 1 },
            "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 0.5 },
                "KHR_materials_sheen": { "sheenColorFactor": [0, 0, 0] },
                "KHR_materials_velvet": {} } }))
        .good();
    println!("{:#?}", scene.notes);
    for needle in [
        "normal textures",
        "emissive textures",
        "base colour textures",
        "is seen at rest; --pose [NAME:]SECONDS",
        "KHR_materials_velvet is not supported yet: Skin",
        "MSFT_lod is not supported: Body",
        "KHR_lights_environment",
        "did you mean `illumination`?",
        "extras `illumination` has no effect here",
    ] {
        assert_eq!(scene.notes.iter().filter(|n| n.contains(needle)).count(), 1, "{needle}");
    }
    assert_eq!(scene.notes.len(), 9);
}

#[test]
fn points_and_lines_are_left_out() {
    let scene = Small::new().with("/meshes/1/primitives/0/mode", json!(1)).good();
    assert!(note(&scene, "mesh `Quad`") && scene.mesh.triangles.len() == 4);
    let fan = Small::new().with("/meshes/1/primitives/0/mode", json!(6)).good();
    assert_eq!(fan.mesh.triangles.len(), 6);
}
