//! KHR_materials_unlit: seen as it is, lights nothing.

use crate::small::Small;
use glam::Vec3;
use halflight::film::Layer;
use halflight::light::Light;
use halflight::plan::{Method, Settings};
use halflight::render::Render;
use halflight::scene::{Emission, Illumination, Luminaire, Scene};
use serde_json::{Value, json};

const SIDE: u32 = 24;
const COLOUR: Vec3 = Vec3::new(0.75, 0.25, 0.125);

fn poster(extras: Value) -> Small {
    let material = json!({ "name": "Poster", "extras": extras, "emissiveFactor": [9, 9, 9],
        "pbrMetallicRoughness": { "baseColorFactor": [0.75, 0.25, 0.125, 1], "metallicFactor": 0.5 },
        "extensions": { "KHR_materials_unlit": {} } });
    Small::new().with("/materials/0", material)
}

fn picture(scene: Scene, method: Method, illumination: Illumination) -> Vec<Vec3> {
    cut_picture(scene, method, illumination, None)
}

fn cut_picture(
    mut scene: Scene,
    method: Method,
    illumination: Illumination,
    max_reflections: Option<u32>,
) -> Vec<Vec3> {
    scene.illuminate(Some(illumination), &[]).expect("no names");
    let settings =
        Settings { method, max_reflections, paths: Some(20_000), ..Settings::for_film(SIDE, SIDE) };
    let mut render = Render::new(scene, settings, &[]).expect("an image");
    while render.film().passes() < 2 {
        render.pass();
    }
    render.film().mean(Layer::Visible)
}

/// Pixels that see nothing of the poster, nor do their neighbours.
fn beside_the_poster(scene: &Scene) -> Vec<usize> {
    let seen = cut_picture(scene.clone(), Method::Path, Illumination::GLOBAL, Some(0));
    let side = SIDE as i32;
    let dark = |x: i32, y: i32| {
        let inside = (0..side).contains(&x) && (0..side).contains(&y);
        !inside || seen[(y * side + x) as usize] == Vec3::ZERO
    };
    let clear = |x: i32, y: i32| (-1..=1).all(|dy| (-1..=1).all(|dx| dark(x + dx, y + dy)));
    (0..side * side).filter(|i| clear(i % side, i / side)).map(|i| i as usize).collect()
}

#[test]
fn an_unlit_surface_emits_visible_light_alone_unless_told() {
    let radiance = |extras: Value| poster(extras).good().materials[0].emission.unwrap().radiance;
    assert_eq!(radiance(json!({})), Light::new(Vec3::ZERO, COLOUR));
    assert_eq!(radiance(json!({ "emission": "both" })), Light::both(COLOUR));
    assert_eq!(radiance(json!({ "emission": [2, 0] })), Light::new(2.0 * COLOUR, Vec3::ZERO));
    let scene = poster(json!({})).good();
    assert!(scene.materials[0].lobes.is_empty() && scene.notes.is_empty(), "{:?}", scene.notes);
}

#[test]
fn a_scene_of_unlit_surfaces_alone_is_a_picture() {
    let alone = || {
        let small = poster(json!({})).with("/nodes/2/extensions", Value::Null);
        small.with("/scenes/0/nodes", json!([0, 2, 3])).good()
    };
    assert!(alone().notes.is_empty(), "{:?}", alone().notes);
    for method in [Method::Photon, Method::Path, Method::PathPlain] {
        for illumination in [Illumination::GLOBAL, Illumination::LOCAL, Illumination::SHADOWLESS] {
            let pixels = picture(alone(), method, illumination);
            let inside = pixels.iter().filter(|pixel| **pixel == COLOUR).count();
            assert!(inside > 10, "{method:?}: {inside} pixels are of the colour");
            assert!(pixels.iter().all(|pixel| pixel.cmple(COLOUR).all()), "nothing is brighter");
        }
    }
    let lit = poster(json!({})).with("/nodes/2/extensions", Value::Null).good();
    assert!(lit.notes.iter().any(|note| note.contains("the built-in studio lights it")), "{:?}", lit.notes);
}

#[test]
fn an_unlit_surface_lights_nothing_beside_it() {
    for method in [Method::Photon, Method::Path] {
        let with = poster(json!({})).good();
        let mut without = with.clone();
        let none = Emission { radiance: Light::ZERO, two_sided: false };
        without.materials[0].emission = Some(none);
        for luminaire in &mut without.luminaires {
            if let Luminaire::Triangle { emission, .. } = luminaire {
                *emission = none;
            }
        }
        let pixels = beside_the_poster(&with);
        let (with, without) =
            (picture(with, method, Illumination::GLOBAL), picture(without, method, Illumination::GLOBAL));
        assert!(pixels.len() > 100 && pixels.iter().any(|i| with[*i] != Vec3::ZERO), "{method:?}");
        for (a, b) in pixels.iter().map(|i| (with[*i], without[*i])) {
            assert!((a - b).abs().max_element() <= 1e-6 * b.max_element(), "{method:?}: {a} and {b}");
        }
    }
}
