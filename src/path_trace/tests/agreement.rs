use super::*;
use crate::light::Matrix;
use crate::optics::{Dielectric, Mirror};
use crate::scene::Matter;

/// A box with a lamp, a two-sided block and a second term, small enough that every series converges.
fn small_box(illumination: Illumination) -> Scene {
    let mut stage = Stage::new(inside_camera());
    stage.0.camera.position = Vec3::new(0.0, 0.0, 0.9);
    let walls = stage.material(&[grey(0.4)], None);
    stage.room(walls, Vec3::ZERO, Vec3::ONE);
    let lamp = stage.material(&[grey(0.2)], None);
    stage.shine(lamp, Light::new(Vec3::new(8.0, 10.0, 12.0), Vec3::splat(2.0)));
    stage.quad(lamp, Vec3::new(-0.8, 0.95, -0.8), 1.6 * Vec3::X, 1.6 * Vec3::Z);
    let two_sided = Lobe::Diffuse(Diffuse { albedo: Vec3::splat(0.3), two_sided: true });
    let coated = Lobe::Mirror(Mirror { tint: Vec3::splat(0.2), two_sided: true });
    let block = stage.material(&[two_sided, coated], None);
    stage.block(block, Vec3::new(0.1, -0.4, -0.2), Vec3::new(0.3, 0.4, 0.2));
    stage.lit(illumination)
}

fn assert_strengths_agree(scene: &Scene) {
    let plain = over_passes(scene, &settings(8, 64, Strength::Plain), 96, mean_visible);
    let found = over_passes(scene, &settings(8, 64, Strength::NextEvent), 48, mean_visible);
    let z = |scale: f64| (plain.0 - scale * found.0).abs() / plain.1.hypot(found.1);
    assert!(z(1.0) < 3.5, "{plain:?} against {found:?}: z = {}", z(1.0));
    assert!(z(1.02) > 3.5 && z(0.98) > 3.5, "{plain:?} against {found:?} cannot tell 2 %");
}

#[test]
fn strengths_agree_over_the_square() {
    for (s, t) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.6, 0.4)] {
        assert_strengths_agree(&small_box(Illumination::Square { s, t }));
    }
}

#[test]
fn strengths_agree_in_matter_with_full_matrices() {
    assert_strengths_agree(&small_box(Illumination::Own(Matter {
        opaque: Matrix::new([[0.4, 0.2], [0.8, 0.3]]),
        straight: Matrix::new([[0.3, 0.1], [0.2, 0.4]]),
    })));
}

#[test]
fn strengths_agree_where_glass_refracts_and_lets_straight_through() {
    let mut stage = Stage::new(inside_camera());
    stage.0.camera.position = Vec3::new(0.0, 0.0, 0.9);
    let walls = stage.material(&[grey(0.4)], None);
    stage.room(walls, Vec3::ZERO, Vec3::ONE);
    let lamp = stage.material(&[], None);
    stage.shine(lamp, both(5.0));
    stage.quad(lamp, Vec3::new(-0.8, 0.95, -0.8), 1.6 * Vec3::X, 1.6 * Vec3::Z);
    // Rays that enter straight are caught by total reflection for ever: s must stay below 1.
    let lobe = Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::ONE });
    let glass = stage.material(&[lobe], Some(Illumination::Square { s: 0.7, t: 0.2 }));
    stage.block(glass, Vec3::new(0.1, -0.4, -0.2), Vec3::new(0.3, 0.3, 0.2));
    assert_strengths_agree(&stage.lit(Illumination::GLOBAL));
}

#[test]
fn the_picture_is_the_same_for_any_number_of_threads() {
    let scene = small_box(Illumination::SHADOWLESS);
    let rays = Rays::build(&scene);
    let settings = PathSettings { rows: Rows::VisibleAndInvisible, ..settings(16, 4, Strength::NextEvent) };
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| trace_pass(&scene, &rays, &settings, 3))
    };
    let one = with_threads(1);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(3));
    assert_ne!(one, trace_pass(&scene, &rays, &settings, 4));
}

#[test]
fn reading_the_invisible_half_too_changes_no_mean() {
    let scene = small_box(Illumination::Square { s: 0.6, t: 0.4 });
    let one = over_passes(&scene, &settings(8, 32, Strength::NextEvent), 48, mean_visible);
    let rows = Rows::VisibleAndInvisible;
    let settings = PathSettings { rows, ..settings(8, 32, Strength::NextEvent) };
    let two = over_passes(&scene, &settings, 48, mean_visible);
    assert!((one.0 - two.0).abs() < 3.5 * one.1.hypot(two.1), "{one:?} against {two:?}");
}
