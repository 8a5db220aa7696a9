use super::*;
use crate::light::Matrix;
use crate::optics::{Dielectric, Mirror};
use crate::scene::Matter;

/// A box with a lamp, a two-sided block and a second term, small enough that every series converges.
fn small_box(illumination: Illumination) -> Scene {
    let mut stage = Stage::new(Camera { position: Vec3::new(0.0, 0.0, 0.9), ..inside_camera() });
    let walls = stage.material(&[grey(0.4)], None);
    stage.room(walls, Vec3::ZERO, Vec3::ONE);
    let lamp = stage.material(&[grey(0.2)], None);
    stage.shine(lamp, Light::new(Vec3::new(8.0, 10.0, 12.0), Vec3::splat(2.0)));
    stage.quad(lamp, Vec3::new(-0.8, 0.95, -0.8), 1.6 * Vec3::X, 1.6 * Vec3::Z);
    let two_sided = Lobe::Diffuse(Diffuse { albedo: Vec3::splat(0.3), two_sided: true, under: None });
    let coated = Lobe::Mirror(Mirror::plain(Vec3::splat(0.2), true));
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
    let mut stage = Stage::new(Camera { position: Vec3::new(0.0, 0.0, 0.9), ..inside_camera() });
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
fn strengths_agree_under_bent_normals() {
    let mut scene = small_box(Illumination::Square { s: 0.8, t: 0.3 });
    let mesh = &mut scene.mesh;
    for (normal, position) in mesh.normals.iter_mut().zip(&mesh.positions) {
        *normal = (*normal + 0.5 * position.normalize()).normalize();
    }
    scene.surfaces.iter_mut().for_each(|surface| surface.smooth = true);
    assert_strengths_agree(&scene);
}

#[test]
fn there_is_no_unit_of_length_or_of_light() {
    let picture = |length: f32, light: f32| {
        let mut scene = small_box(Illumination::Square { s: 0.6, t: 0.4 });
        scene.mesh.positions.iter_mut().for_each(|position| *position *= length);
        scene.camera.position *= length;
        for material in &mut scene.materials {
            material.emission = material.emission.map(|e| Emission { radiance: light * e.radiance, ..e });
        }
        for luminaire in &mut scene.luminaires {
            if let Luminaire::Triangle { emission, area, .. } = luminaire {
                emission.radiance = light * emission.radiance;
                *area *= length * length;
            }
        }
        trace_pass(&scene, &Rays::build(&scene), &settings(16, 4, Strength::NextEvent), 0)
    };
    let expected = picture(1.0, 1.0);
    for exponent in [-30, 30] {
        let scale = 2.0_f32.powi(exponent);
        assert_eq!(picture(scale, 1.0), expected, "lengths times 2^{exponent}");
        let bright = picture(1.0, scale);
        assert!(bright.visible.iter().zip(&expected.visible).all(|(a, b)| *a == *b * scale));
    }
}

#[test]
fn no_light_is_black() {
    let mut scene = small_box(Illumination::GLOBAL);
    for luminaire in &mut scene.luminaires {
        if let Luminaire::Triangle { emission, .. } = luminaire {
            emission.radiance = Light::ZERO;
        }
    }
    scene.materials.iter_mut().for_each(|material| material.emission = None);
    let lit_by_nothing = scene.clone();
    scene.luminaires.clear();
    for scene in [scene, lit_by_nothing] {
        let picture = trace_pass(&scene, &Rays::build(&scene), &settings(8, 4, Strength::NextEvent), 0);
        assert!(picture.visible.iter().all(|pixel| *pixel == Vec3::ZERO));
    }
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
