//! The four corners of the illumination square on the paper's Figure 1 scene.

use crate::support::small;
use glam::Vec3;
use halflight::film::Layer;
use halflight::plan::Settings;
use halflight::render::Render;
use halflight::scene::{Illumination, Scene};

const SIDE: usize = 96;

fn picture(illumination: Illumination) -> Vec<Vec3> {
    let mut scene = Scene::load("builtin:cornell-spheres").expect("built in");
    scene.illuminate(Some(illumination), &[("*".into(), illumination)]).expect("no names");
    let settings = Settings { seed: 1, ..small(SIDE as u32, SIDE as u32, 60_000) };
    let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("a render");
    (0..16).for_each(|_| render.pass());
    render.film().mean(Layer::Visible)
}

/// Mean over a box of pixels given in fractions of the film.
fn mean(picture: &[Vec3], x: [f32; 2], y: [f32; 2]) -> Vec3 {
    let range = |r: [f32; 2]| (r[0] * SIDE as f32) as usize..(r[1] * SIDE as f32) as usize;
    let pixels: Vec<Vec3> = range(y).flat_map(|j| range(x).map(move |i| picture[j * SIDE + i])).collect();
    pixels.iter().sum::<Vec3>() / pixels.len() as f32
}

#[test]
fn the_corners_are_the_papers_pictures() {
    let [global, shadowless, one_bounce, local] =
        [Illumination::GLOBAL, Illumination::SHADOWLESS, Illumination::ONE_BOUNCE, Illumination::LOCAL]
            .map(picture);
    // The luminaire is seen in all four.
    for picture in [&global, &shadowless, &one_bounce, &local] {
        assert!(picture.iter().any(|rgb| rgb.min_element() > 3.0), "the luminaire is not seen");
    }
    // Shadows: each pixel of a shadowless picture has at least the light of the one with shadows, and some far more.
    for (without, with) in [(&local, &one_bounce), (&shadowless, &global)] {
        let gained = without.iter().zip(with.iter()).filter(|(a, b)| a.x > b.x + 0.05).count();
        assert!(gained > SIDE * SIDE / 100, "only {gained} pixels show a shadow that went");
    }
    // Inter-reflection: the ceiling sees the luminaire's back, so it is lit by other surfaces or not at all.
    let ceiling = |picture: &[Vec3]| mean(picture, [0.25, 0.35], [0.06, 0.12]).max_element();
    assert!(ceiling(&global) > 0.02 && ceiling(&shadowless) > 0.02);
    assert!(ceiling(&one_bounce) == 0.0 && ceiling(&local) == 0.0);
    // Colour bleeding: the white floor beside the coloured walls is tinted with inter-reflection only.
    let tint = |picture: &[Vec3]| {
        let (left, right) =
            (mean(picture, [0.12, 0.2], [0.93, 0.98]), mean(picture, [0.8, 0.88], [0.93, 0.98]));
        (left.x / left.y) / (right.x / right.y)
    };
    for (name, picture, bleeds) in [
        ("global", &global, true),
        ("shadowless", &shadowless, true),
        ("one-bounce", &one_bounce, false),
        ("local", &local, false),
    ] {
        assert_eq!(tint(picture) > 1.02, bleeds, "{name}: {}", tint(picture));
    }
}
