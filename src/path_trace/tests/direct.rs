use super::*;
use crate::optics::Mirror;
use crate::path_trace::unreachable_luminaires;
use crate::scene::SpotCone;
use std::f64::consts::PI;

const ALBEDO: f32 = 0.8;

/// A floor at y = 0 that is seen at `target`, obliquely, past whatever hangs above.
fn floor(target: Vec3) -> Stage {
    let mut stage = Stage::new(spot_camera(target + Vec3::new(3.0, 0.9, 0.0), target));
    let material = stage.material(&[grey(ALBEDO)], None);
    stage.quad(material, Vec3::new(-50.0, 0.0, -50.0), 100.0 * Vec3::Z, 100.0 * Vec3::X);
    stage
}

/// Floor radiance for irradiance 1.
fn per_irradiance() -> f64 {
    f64::from(ALBEDO) / PI
}

#[test]
fn area_light_over_a_floor_has_its_form_factor() {
    // Differential element below a corner of an x × y rectangle at unit distance (Howell C-1, B-4); here four of them.
    let corner = |x: f64, y: f64| {
        let (rx, ry) = (x.hypot(1.0), y.hypot(1.0));
        (x / rx * (y / rx).atan() + y / ry * (x / ry).atan()) / (2.0 * PI)
    };
    let (a, b, h, radiance) = (0.7, 0.4, 1.0, 5.0);
    let expected = f64::from(ALBEDO) * radiance * 4.0 * corner(a / h, b / h);
    for illumination in [Illumination::ONE_BOUNCE, Illumination::LOCAL, Illumination::GLOBAL] {
        for (strength, passes) in [(Strength::Plain, 128), (Strength::NextEvent, 16)] {
            let mut stage = floor(Vec3::ZERO);
            let lamp = stage.material(&[], None);
            stage.shine(lamp, Light::new(Vec3::splat(radiance as f32), Vec3::ZERO));
            let half = Vec3::new(a as f32, 0.0, b as f32);
            let corner = Vec3::new(-half.x, h as f32, -half.z);
            stage.quad(lamp, corner, 2.0 * half.x * Vec3::X, 2.0 * half.z * Vec3::Z);
            let scene = stage.lit(illumination);
            assert_is(over_passes(&scene, &settings(4, 64, strength), passes, mean_visible), expected);
        }
    }
}

#[test]
fn punctual_luminaires_have_their_closed_forms() {
    let target = Vec3::new(1.0, 0.0, 0.0);
    let position = Vec3::new(0.0, 2.0, 0.0);
    let direction = -Vec3::Y;
    let intensity = Light::new(Vec3::splat(3.0), Vec3::ZERO);
    let (square, cos) = (5.0_f64, 2.0 / 5.0_f64.sqrt());
    let cone = SpotCone::of_cosines(0.95, 0.6);
    let warn = |exponent| Luminaire::Warn {
        position,
        direction,
        intensity,
        exponent,
        attenuation: [0.5, 0.25, 0.125],
    };
    let falloff = 0.5 + 0.25 * square.sqrt() + 0.125 * square;
    let slanted = Vec3::new(0.6, -0.8, 0.0);
    for (luminaire, irradiance) in [
        (Luminaire::Point { position, intensity }, 3.0 * cos / square),
        (
            Luminaire::Spot { position, direction, intensity, cone },
            3.0 * ((cos - 0.6) / 0.35).powi(2) * cos / square,
        ),
        (warn(0.0), 3.0 * cos / falloff),
        (warn(1.0), 3.0 * cos * cos / falloff),
        (warn(2.5), 3.0 * cos.powf(2.5) * cos / falloff),
        (Luminaire::Directional { direction: slanted, irradiance: intensity }, 3.0 * 0.8),
    ] {
        let mut scene = floor(target).lit(Illumination::GLOBAL);
        scene.luminaires.push(luminaire);
        let found = over_passes(&scene, &settings(2, 1, Strength::NextEvent), 4, mean_visible);
        assert_is((found.0, found.1.max(1e-4 * found.0)), per_irradiance() * irradiance);
        assert_eq!(unreachable_luminaires(&scene), [0]);
        assert_eq!(over_passes(&scene, &settings(2, 1, Strength::Plain), 2, mean_visible).0, 0.0);
    }
}

#[test]
fn warn_light_is_dark_behind_unless_its_exponent_is_zero() {
    for (exponent, dark) in [(0.0, false), (1.0, true)] {
        let mut scene = floor(Vec3::ZERO).lit(Illumination::GLOBAL);
        scene.luminaires.push(Luminaire::Warn {
            position: Vec3::Y,
            direction: Vec3::Y,
            intensity: both(1.0),
            exponent,
            attenuation: [0.0, 0.0, 1.0],
        });
        let found = over_passes(&scene, &settings(2, 1, Strength::NextEvent), 2, mean_visible);
        assert_eq!(found.0 == 0.0, dark);
    }
}

#[test]
fn local_casts_no_shadow_and_one_bounce_does() {
    for (illumination, shadow) in [
        (Illumination::LOCAL, false),
        (Illumination::SHADOWLESS, false),
        (Illumination::ONE_BOUNCE, true),
        (Illumination::GLOBAL, true),
    ] {
        let mut stage = floor(Vec3::ZERO);
        let screen = stage.material(&[], None);
        stage.quad(screen, Vec3::new(-0.5, 1.0, -0.5), Vec3::Z, Vec3::X);
        let mut scene = stage.lit(illumination);
        scene.luminaires.push(Luminaire::Point { position: 2.0 * Vec3::Y, intensity: both(3.0) });
        let found = over_passes(&scene, &settings(2, 1, Strength::NextEvent), 2, mean_visible);
        if shadow {
            assert_eq!(found.0, 0.0);
        } else {
            assert_is((found.0, 1e-4 * found.0), per_irradiance() * 3.0 / 4.0);
        }
    }
}

#[test]
fn a_half_transparent_shadow_is_half_a_shadow() {
    let mut stage = floor(Vec3::ZERO);
    let screen = stage.material(&[], Some(Illumination::Square { s: 0.0, t: 0.5 }));
    for y in [1.0, 1.5, 1.5] {
        stage.quad(screen, Vec3::new(-0.5, y, -0.5), Vec3::Z, Vec3::X);
    }
    let mut scene = stage.lit(Illumination::GLOBAL);
    scene.luminaires.push(Luminaire::Point { position: 2.0 * Vec3::Y, intensity: both(3.0) });
    let found = over_passes(&scene, &settings(2, 1, Strength::NextEvent), 2, mean_visible);
    assert_is((found.0, 1e-4 * found.0), per_irradiance() * 3.0 / 4.0 / 8.0);
}

#[test]
fn whitted_mirror_shows_what_a_one_bounce_mirror_does_not() {
    // The camera looks down the x axis into a mirror at 45°, which shows the floor at the origin.
    let tint = 0.7;
    for (mirror, seen) in [(Some(Illumination::Whitted), true), (None, false)] {
        let mut stage = floor(Vec3::ZERO);
        let lobe = Lobe::Mirror(Mirror::plain(Vec3::splat(tint), false));
        let material = stage.material(&[lobe], mirror);
        let (a, b) = (Vec3::new(0.2, -0.2, 0.0), 0.2 * Vec3::Z);
        stage.quad(material, Vec3::Y - 0.5 * (a + b), a, b);
        stage.0.camera = Some(spot_camera(Vec3::new(-2.0, 1.0, 0.0), Vec3::Y));
        let mut scene = stage.lit(Illumination::ONE_BOUNCE);
        let normal = scene.mesh.normal(2);
        assert!(normal.dot(Vec3::new(-1.0, -1.0, 0.0)) > 1.0, "the mirror looks at camera and floor");
        let position = Vec3::new(0.0, 2.0, 2.0);
        scene.luminaires.push(Luminaire::Point { position, intensity: both(3.0) });
        let found = over_passes(&scene, &settings(2, 1, Strength::NextEvent), 2, mean_visible);
        if seen {
            let irradiance = 3.0 / 8.0 * 0.5_f64.sqrt();
            assert_is((found.0, 1e-3 * found.0), f64::from(tint) * per_irradiance() * irradiance);
        } else {
            assert_eq!(found.0, 0.0);
        }
    }
}
