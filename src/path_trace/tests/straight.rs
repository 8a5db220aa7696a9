use super::*;
use crate::light::{Matrix, Row};
use crate::optics::Dielectric;
use crate::scene::Matter;

const NEAR: Matrix = Matrix::new([[0.5, 0.1], [0.3, 0.7]]);
const FAR: Matrix = Matrix::new([[0.2, 0.9], [0.6, 0.4]]);

fn pane(stage: &mut Stage, straight: Matrix, z: f32) {
    let matter = Illumination::Own(Matter { opaque: Matrix::ZERO, straight });
    let material = stage.material(&[], Some(matter));
    stage.quad(material, Vec3::new(-1.0, -1.0, z), 2.0 * Vec3::X, 2.0 * Vec3::Y);
}

#[test]
fn light_meets_the_far_pane_first() {
    let light = Light::new(Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.5, 0.25, 4.0));
    let mut stage = Stage::new(spot_camera(Vec3::new(0.1, 0.2, 5.0), Vec3::new(0.1, 0.2, 0.0)));
    pane(&mut stage, FAR, 1.0);
    pane(&mut stage, NEAR, 2.0);
    let lamp = stage.material(&[], None);
    stage.shine(lamp, light);
    stage.quad(lamp, Vec3::new(-1.0, -1.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Y);
    let scene = stage.lit(Illumination::GLOBAL);
    let settings = PathSettings { rows: Rows::VisibleAndInvisible, ..settings(2, 4, Strength::Plain) };
    let picture = trace_pass(&scene, &Rays::build(&scene), &settings, 0);
    let close = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 1e-5;
    let expected = NEAR * (FAR * light);
    let swapped = FAR * (NEAR * light);
    assert!(picture.visible.iter().all(|pixel| close(*pixel, expected.visible)));
    assert!(picture.invisible.unwrap().iter().all(|pixel| close(*pixel, expected.invisible)));
    assert!(!close(expected.visible, swapped.visible));
    assert!(picture.emitted.iter().all(|pixel| close(*pixel, expected.visible)));
}

#[test]
fn connections_meet_the_panes_in_the_same_order() {
    // A lamp above two panes above a surface that reads both halves.
    let opaque = Matrix::new([[0.0, 0.0], [0.8, 0.3]]);
    let light = Light::new(Vec3::splat(2.0), Vec3::splat(5.0));
    let mut stage = Stage::new(spot_camera(Vec3::new(3.0, 0.0, 0.5), Vec3::ZERO));
    pane(&mut stage, NEAR, 1.0);
    pane(&mut stage, FAR, 2.0);
    let matter = Illumination::Own(Matter { opaque, straight: Matrix::ZERO });
    let wall = stage.material(&[grey(0.5)], Some(matter));
    stage.quad(wall, Vec3::new(-1.0, -1.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Y);
    let mut scene = stage.lit(Illumination::GLOBAL);
    let position = 3.0 * Vec3::Z;
    scene.luminaires.push(Luminaire::Point { position, intensity: light });
    let found = over_passes(&scene, &settings(2, 1, Strength::NextEvent), 2, mean_visible);
    let value = 0.5 / std::f32::consts::PI / 9.0;
    let expected = ((Row::VISIBLE * opaque) * (NEAR * (FAR * light))).y * value;
    assert_is((found.0, 1e-4 * found.0), f64::from(expected));
    let swapped = ((Row::VISIBLE * opaque) * (FAR * (NEAR * light))).y * value;
    assert!((expected / swapped - 1.0).abs() > 0.02);
}

#[test]
fn glass_slab_lets_through_what_fresnel_says() {
    // Incoherent reflections between two faces of R = 0.04: T = (1 − R) / (1 + R); the slab's two η² cancel.
    let glass = |tint: f32| Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::splat(tint) });
    let r = 0.04;
    for tint in [1.0, 0.9] {
        let single = (1.0 - r) * f64::from(tint);
        let expected = single * single / (1.0 - r * r);
        let mut stage = Stage::new(spot_camera(Vec3::new(0.1, 0.2, 5.0), Vec3::new(0.1, 0.2, 0.0)));
        let slab = stage.material(&[glass(tint)], None);
        stage.block(slab, Vec3::new(0.0, 0.0, 2.0), Vec3::new(3.0, 3.0, 0.1));
        let lamp = stage.material(&[], None);
        stage.shine(lamp, both(1.0));
        stage.quad(lamp, Vec3::new(-1.0, -1.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Y);
        let scene = stage.lit(Illumination::GLOBAL);
        for strength in [Strength::Plain, Strength::NextEvent] {
            assert_is(over_passes(&scene, &settings(8, 32, strength), 16, mean_visible), expected);
        }
    }
}
