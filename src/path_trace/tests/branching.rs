use super::*;

/// Two rooms that nearly coincide, one in the other, all matter shadowless.
///
/// Inside, every line meets a front of each, and either reflects ρ of what travels: k = 2ρ, so that
/// X = (E₁ + E₂) / (1 − 2ρ), and the picture shows E₁ + ρ X on the inner wall.
fn double_room(albedo: f32) -> Scene {
    let mut stage = Stage::new(inside_camera());
    let (inner, outer) = (stage.material(&[grey(albedo)], None), stage.material(&[grey(albedo)], None));
    stage.shine(inner, both(1.0));
    stage.shine(outer, both(0.5));
    let (centre, half) = (Vec3::new(0.2, 0.1, 0.0), Vec3::new(2.0, 1.0, 1.5));
    stage.room(inner, centre, half);
    stage.room(outer, centre, half + 1e-5);
    stage.lit(Illumination::SHADOWLESS)
}

#[test]
fn branching_walks_sum_the_series() {
    for strength in [Strength::Plain, Strength::NextEvent] {
        for (albedo, passes) in [(0.25, 16), (0.45, 64)] {
            let k = 2.0 * f64::from(albedo);
            let expected = 1.0 + f64::from(albedo) * 1.5 / (1.0 - k);
            let found = over_passes(&double_room(albedo), &settings(8, 32, strength), passes, mean_visible);
            assert_is(found, expected);
        }
    }
}

#[test]
fn supercritical_matter_ends_and_its_first_reflections_are_right() {
    let albedo = 0.8;
    let scene = double_room(albedo);
    let rays = Rays::build(&scene);
    let picture = trace_pass(&scene, &rays, &settings(2, 1, Strength::Plain), 0);
    assert!(picture.lines > 10_000, "{} lines", picture.lines);

    let settings = PathSettings { max_reflections: Some(5), ..settings(8, 16, Strength::NextEvent) };
    let k = 2.0 * f64::from(albedo);
    let series: f64 = (0..5).map(|n| k.powi(n)).sum();
    assert_is(over_passes(&scene, &settings, 32, mean_visible), 1.0 + f64::from(albedo) * 1.5 * series);
}

#[test]
fn work_stays_bounded_near_criticality() {
    let rays_and_lines = |albedo| {
        let scene = double_room(albedo);
        let picture = trace_pass(&scene, &Rays::build(&scene), &settings(16, 8, Strength::Plain), 0);
        picture.lines as f64 / (16.0 * 16.0 * 8.0)
    };
    // 1 + (start / weight of a branch) ρ/(1 − k), the branches of a neutron transport code
    assert!(rays_and_lines(0.495) < 500.0);
}
