//! Lamps with an extent: extras of lights and of empty nodes.

use crate::small::Small;
use glam::Vec3;
use halflight::light::Light;
use halflight::scene::{Backs, Emission, Luminaire, Scene};
use serde_json::{Value, json};
use std::f32::consts::PI;

const LIGHT: &str = "/extensions/KHR_lights_punctual/lights/0";
const BULB: &str = "/nodes/2/extras";

/// Its only light has these extras.
fn light(extras: Value) -> Small {
    Small::new().with(BULB, extras)
}

/// An empty node in the light's place.
fn empty(extras: Value) -> Small {
    light(extras).with("/nodes/2/extensions", Value::Null)
}

/// What all triangles that shine have in common, and their area.
fn shining(scene: &Scene) -> (Emission, f32) {
    let found = scene.luminaires.iter().map(|luminaire| match luminaire {
        Luminaire::Triangle { emission, area, .. } => (*emission, *area),
        other => panic!("{other:?}"),
    });
    found
        .reduce(|(emission, sum), (other, area)| {
            assert_eq!(emission, other);
            (emission, sum + area)
        })
        .expect("something shines")
}

fn close(found: f32, expected: f32) -> bool {
    (found / expected - 1.0).abs() < 1e-4
}

#[track_caller]
fn must_shine(small: Small, radiance: f32, area: f32) {
    let scene = small.good();
    let (emission, found) = shining(&scene);
    let Light { invisible, visible } = emission.radiance;
    println!("{visible} over {found} m²; {:?}", scene.notes);
    assert!(invisible == visible && !emission.two_sided);
    assert!(close(visible.x, radiance), "{visible} for {radiance}");
    assert!(close(found, area), "{found} m² for {area}");
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

#[test]
fn a_light_with_an_extent_keeps_its_intensity() {
    must_shine(light(json!({ "area": [0.5, 0.25] })), 80.0, 0.125);
    must_shine(light(json!({ "disk": 0.5 })), 40.0 / PI, 0.25 * PI);
    must_shine(light(json!({ "sphere": 0.5 })), 40.0 / PI, PI);
    let of_data = Small::new().with(&format!("{LIGHT}/extras"), json!({ "disk": 0.5 }));
    must_shine(of_data.clone(), 40.0 / PI, 0.25 * PI);
    // The node stands over the light, and its scale stretches the lamp.
    must_shine(of_data.clone().with(BULB, json!({ "disk": 1 })), 10.0 / PI, PI);
    must_shine(of_data.with("/nodes/2/scale", json!([2, 4, 1])), 5.0 / PI, 2.0 * PI);
}

#[test]
fn an_empty_node_shines_with_its_power_or_its_radiance() {
    must_shine(empty(json!({ "area": [2, 3], "radiance": 7 })), 7.0, 6.0);
    must_shine(empty(json!({ "area": [2, 3], "power": 7 })), 7.0 / (6.0 * PI), 6.0);
    must_shine(empty(json!({ "disk": 2, "power": 7 })), 7.0 / (4.0 * PI * PI), 4.0 * PI);
    must_shine(empty(json!({ "sphere": 2, "power": [7, 7, 7] })), 7.0 / (16.0 * PI * PI), 16.0 * PI);
    let power = empty(json!({ "sphere": 2, "power": [1, 2, 3] })).good();
    let all = power.luminaires.iter().map(|l| l.power(1.0).visible).sum::<Vec3>();
    assert!((all - Vec3::new(1.0, 2.0, 3.0)).length() < 1e-3, "{all} W");
}

#[test]
fn lamps_with_an_extent_look_where_lights_do_and_reflect_nothing() {
    // A quarter turn about -X brings -Z to -Y.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let extras = json!({ "area": [1, 1], "emission": [0.5, 2] });
    let scene = light(extras).with("/nodes/2/rotation", json!([-half, 0, 0, half])).good();
    let (emission, _) = shining(&scene);
    assert_eq!(emission.radiance, Light::new(Vec3::splat(5.0), Vec3::splat(20.0)));
    for triangle in 0..2 {
        assert!((scene.mesh.normal(triangle) - Vec3::NEG_Y).length() < 1e-6);
        let [a, ..] = scene.mesh.corners(triangle);
        let world = a.as_dvec3() + scene.origin;
        assert!((world.y - 3.0).abs() < 1e-6, "{world}");
    }
    let material = scene.materials.last().expect("its own");
    assert!(material.name == "Lux" && material.lobes.is_empty() && material.backs == Backs::Unseen);
    assert_eq!(scene.materials[scene.surfaces[0].material as usize].name, "Lux");
    let seen = |small: Small| small.good().materials.last().expect("its own").backs;
    assert_eq!(seen(light(json!({ "disk": 1, "backs": "seen" }))), Backs::Seen);
    assert_eq!(seen(empty(json!({ "disk": 1, "power": 1, "backs": "seen" }))), Backs::Seen);
    let empty = empty(json!({ "sphere": 1, "radiance": 1, "emission": "invisible" })).good();
    assert_eq!(shining(&empty).0.radiance, Light::new(Vec3::ONE, Vec3::ZERO));
    assert!(empty.surfaces[0].name == "Bulb" && empty.surfaces[0].closed && !empty.surfaces[0].smooth);
}

#[test]
fn blenders_lamps_are_in_watts_whatever_their_extent() {
    let blender =
        light(json!({ "disk": 1 })).with("/asset/generator", json!("Khronos glTF Blender I/O v4.2.83"));
    let (emission, _) = shining(&blender.with(&format!("{LIGHT}/intensity"), json!(1366)).good());
    assert!(close(emission.radiance.visible.x, 2.0 / PI), "{emission:?}");
}

#[test]
fn a_wrong_extent_is_told_with_the_way_out() {
    let spot = |extras: Value| light(extras).with(&format!("{LIGHT}/type"), json!("directional"));
    for (small, needles) in [
        (light(json!({ "area": 3 })), ["node `Bulb`: extras `area` is 3", "[width, height]"]),
        (light(json!({ "area": [0, 1] })), ["`area` is [0,1]", "both above 0"]),
        (light(json!({ "disk": -1 })), ["`disk` is -1", "radius"]),
        (light(json!({ "sphere": "big" })), ["`sphere` is \"big\"", "radius"]),
        (light(json!({ "sphere": 1, "disk": 1 })), ["`disk` and `sphere`", "leave one out"]),
        (light(json!({ "disk": 1, "warn": [1, 0, 0, 1] })), ["light `Lux`: extras `warn`", "or `disk`"]),
        (spot(json!({ "disk": 1 })), ["light `Lux`: extras `disk`", "point and spot"]),
        (light(json!({ "disk": 1e-30 })), ["light `Lux` has no extent in the world", "scale it"]),
        (
            light(json!({ "disk": 1e-3 })).with(&format!("{LIGHT}/intensity"), json!(1e38)),
            ["`Lux`: its radiance", "more extent"],
        ),
        (light(json!({ "disk": 1 })).with("/nodes/2/scale", json!([0, 1, 1])), ["light `Lux`", "scale it"]),
        (empty(json!({ "disk": 1, "power": 1 })).with("/nodes/2/scale", json!([1, 1, 0])), ["Bulb", "scale"]),
        (empty(json!({ "disk": 1, "power": -1 })), ["`power` is -1", "0 or more"]),
        (empty(json!({ "disk": 1, "radiance": [1, 2] })), ["`radiance` is [1,2]", "red, green and blue"]),
        (empty(json!({ "disk": 1, "radiance": 1, "power": 1 })), ["`power` and `radiance`", "leave one out"]),
        (empty(json!({ "area": [1e8, 1e8], "radiance": 1e30 })), ["Bulb", "less"]),
    ] {
        let message = small.error();
        assert!(needles.iter().all(|needle| message.contains(needle)), "{message}");
    }
}

#[test]
fn what_has_no_effect_on_a_lamp_is_told() {
    let note = |small: Small, needle: &str| {
        let scene = small.good();
        assert!(scene.notes.iter().any(|note| note.contains(needle)), "{needle}: {:?}", scene.notes);
        scene
    };
    let cone = json!({ "innerConeAngle": 0, "outerConeAngle": 0.0005 });
    let spot = light(json!({ "disk": 1 })).with(&format!("{LIGHT}/type"), json!("spot"));
    let spot = note(
        spot.with(&format!("{LIGHT}/spot"), cone),
        "the cone of spots with an extent is passed over: Lux",
    );
    assert!(!spot.notes.iter().any(|note| note.contains("less than a pixel")), "{:?}", spot.notes);
    note(light(json!({ "disk": 1 })).with(&format!("{LIGHT}/range"), json!(2)), "range of lights is ignored");
    note(light(json!({ "disk": 1, "power": 3 })), "`power` has no effect here; it is read on empty nodes");
    note(
        Small::new().with("/nodes/0/extras", json!({ "area": [1, 1] })),
        "it is read on lights and empty nodes",
    );
    note(
        light(json!({ "backs": "seen" })),
        "`backs` is passed over, it is read on lights with an extent: Lux",
    );
    note(light(json!({ "disc": 1 })), "did you mean `disk`?");
    let dark =
        note(light(json!({ "disk": 1, "emission": [0, 0] })), "lights without power were left out: Lux");
    assert!(dark.luminaires.is_empty() || dark.lit_by_studio);
    // Others may call something else by these names.
    for extras in [json!({ "area": "kitchen" }), json!({ "power": "mains" }), json!({ "emission": "both" })] {
        let other = Small::new().with("/nodes/2/extras", Value::Null);
        let mut other = other.with("/scenes/0/nodes", json!([0, 1, 2, 3, 4]));
        other.json["nodes"].as_array_mut().unwrap().push(json!({ "name": "Room", "extras": extras }));
        let scene = note(other, "these have but some: Room");
        assert_eq!((scene.luminaires.len(), scene.notes.len()), (1, 1));
    }
}

#[test]
fn no_more_lamps_are_made_than_triangles_are_allowed() {
    let nodes = 160_000;
    let mut small = Small::new().with("/scenes/0/nodes", (0..nodes).collect());
    let lamp = json!({ "extras": { "sphere": 1, "power": 1 } });
    small.json["nodes"].as_array_mut().unwrap().resize(nodes, lamp);
    let message = small.error();
    assert!(message.contains("--max-triangles") && message.contains("51198726 triangles"), "{message}");
}

#[test]
fn a_lamp_alone_is_a_scene() {
    let alone = empty(json!({ "disk": 1, "power": 1 })).with("/scenes/0/nodes", json!([2, 3])).good();
    assert_eq!((alone.mesh.triangles.len(), alone.lit_by_studio), (64, false));
}
