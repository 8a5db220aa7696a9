//! Directional lights with an angle: `extras.angle`.

use crate::small::Small;
use halflight::scene::Luminaire;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// A sun of 3 W/m²; `on` is where its extras are.
fn sun(on: &str, extras: Value) -> Small {
    Small::new()
        .with("/extensions/KHR_lights_punctual/lights/0/type", json!("directional"))
        .with("/extensions/KHR_lights_punctual/lights/0/intensity", json!(3))
        .with(&format!("{on}/extras"), extras)
}

const LIGHT: &str = "/extensions/KHR_lights_punctual/lights/0";
const NODE: &str = "/nodes/2";

#[test]
fn a_sun_with_an_angle_is_a_disk_of_that_width_and_of_the_same_irradiance() {
    for degrees in [0.002, 0.526, 11.4, 180.0_f64] {
        let scene = sun(LIGHT, json!({ "angle": degrees })).good();
        let [Luminaire::Sun { direction, radiance, versine }] = scene.luminaires[..] else {
            panic!("{:?}", scene.luminaires)
        };
        let half = 0.5 * degrees.to_radians();
        assert!((f64::from(versine) / (2.0 * (0.5 * half).sin().powi(2)) - 1.0).abs() < 1e-5, "{degrees}");
        for part in [radiance.invisible, radiance.visible] {
            let irradiance = f64::from(part.x) * PI * half.sin().powi(2);
            assert!((irradiance / 3.0 - 1.0).abs() < 1e-5, "{degrees}: {irradiance}");
        }
        assert_eq!(direction.to_array(), [0.0, 0.0, -1.0]);
        assert_eq!(scene.skies.len(), 1, "who looks there sees it");
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    }
}

#[test]
fn without_an_angle_its_light_is_parallel_and_the_angle_of_the_object_counts_first() {
    for extras in [json!({}), json!({ "angle": 0 }), json!({ "angle": -0.0 })] {
        let scene = sun(LIGHT, extras).good();
        assert!(matches!(scene.luminaires[..], [Luminaire::Directional { .. }]), "{:?}", scene.luminaires);
        assert!(scene.skies.is_empty());
    }
    let both = sun(LIGHT, json!({ "angle": 9 })).with("/nodes/2/extras", json!({ "angle": 0 })).good();
    assert!(matches!(both.luminaires[..], [Luminaire::Directional { .. }]));
    let node = sun(NODE, json!({ "angle": 9, "emission": "invisible" })).good();
    let [Luminaire::Sun { radiance, .. }] = node.luminaires[..] else { panic!("{:?}", node.luminaires) };
    assert!(radiance.invisible.x > 0.0 && radiance.visible.x == 0.0);
}

#[test]
fn an_angle_that_is_none_is_refused_by_name() {
    for wrong in [json!(-1), json!(180.1), json!(0.0001), json!("wide"), json!([1]), json!(true)] {
        let message = sun(LIGHT, json!({ "angle": wrong })).error();
        assert!(message.contains("`Lux`: extras `angle` is") && message.contains("degrees"), "{message}");
    }
}

#[test]
fn other_lights_have_no_angle_and_say_so() {
    let point = Small::new().with(&format!("{LIGHT}/extras"), json!({ "angle": 5 })).good();
    assert!(matches!(point.luminaires[..], [Luminaire::Point { .. }]));
    assert!(
        point.notes.iter().any(|note| note.contains("`angle`") && note.contains("directional")),
        "{:?}",
        point.notes
    );
}
