use super::*;

/// A closed room, all walls of which radiate 1 and reflect ρ: invisible radiance is Σ (sρ)ⁿ everywhere.
fn furnace(albedo: f32, illumination: Illumination) -> Scene {
    let mut stage = Stage::new(inside_camera());
    let wall = stage.material(&[grey(albedo)], None);
    stage.shine(wall, both(1.0));
    stage.room(wall, Vec3::new(0.2, 0.1, 0.0), Vec3::new(2.0, 1.0, 1.5));
    stage.lit(illumination)
}

#[test]
fn global_furnace_is_the_geometric_series() {
    for strength in [Strength::Plain, Strength::NextEvent] {
        for (albedo, passes) in [(0.5, 16), (0.9, 32)] {
            let scene = furnace(albedo, Illumination::GLOBAL);
            let found = over_passes(&scene, &settings(8, 64, strength), passes, mean_visible);
            assert_is(found, 1.0 / (1.0 - f64::from(albedo)));
        }
    }
}

#[test]
fn lossless_furnace_can_be_cut_off_anywhere() {
    for (reflections, expected) in [(0, 1.0), (1, 2.0), (7, 8.0), (100, 101.0)] {
        let scene = furnace(1.0, Illumination::GLOBAL);
        let settings =
            PathSettings { max_reflections: Some(reflections), ..settings(8, 16, Strength::NextEvent) };
        assert_is(over_passes(&scene, &settings, 32, mean_visible), expected);
    }
}

#[test]
fn between_the_corners_the_series_runs_in_s_rho() {
    let (s, albedo) = (0.6, 0.8);
    let scene = furnace(albedo, Illumination::Square { s, t: 0.3 });
    let settings = PathSettings { rows: Rows::VisibleAndInvisible, ..settings(8, 32, Strength::NextEvent) };
    let travelling = 1.0 / (1.0 - f64::from(s * albedo));
    assert_is(over_passes(&scene, &settings, 32, mean_visible), 1.0 + f64::from(albedo) * travelling);
    let invisible = |picture: &Picture| mean_green(picture.invisible.as_ref().unwrap());
    assert_is(over_passes(&scene, &settings, 32, invisible), travelling);
    let emitted = |picture: &Picture| mean_green(&picture.emitted);
    assert_is(over_passes(&scene, &settings, 32, emitted), 1.0);
}
