//! The stability suite as tests, at its shorter settings: `halflight check` prints the same rows.

use halflight::stability::{Case, Effort, cases};

fn case(name: &str) -> Case {
    cases().into_iter().find(|case| case.name == name).expect("a case of that name")
}

/// Every promise is kept, and every closed form would have been missed by a value 2 % off.
fn keeps_its_promise(name: &str) {
    let outcome = case(name).outcome(Effort::Quick, |_| ());
    assert!(!outcome.checks.is_empty(), "{name} checks nothing");
    let broken: Vec<_> = outcome.checks.iter().filter(|check| !check.passes()).collect();
    assert!(broken.is_empty(), "{name}: {}: {broken:#?}", outcome.promise);
    let blunt: Vec<_> = outcome.checks.iter().filter(|check| !check.can_fail()).collect();
    assert!(blunt.is_empty(), "{name} cannot tell 2 %: {blunt:#?}");
}

macro_rules! each {
    ($($(#[$mark:meta])* $test:ident: $name:literal;)*) => {
        $(#[test] $(#[$mark])* fn $test() { keeps_its_promise($name); })*

        #[test]
        fn no_case_is_forgotten() {
            let tested = [$($name),*];
            let untested: Vec<_> = cases().iter().map(|case| case.name).filter(|name| !tested.contains(name)).collect();
            assert!(untested.is_empty(), "{untested:?}");
        }
    };
}

each! {
    furnace: "furnace";
    furnace_paths: "furnace-paths";
    k_closed_form: "k-closed-form";
    k_near_one: "k-near-one";
    k_box: "k-box";
    scaled: "scaled";
    far_away: "far-away";
    luminaire_size: "luminaire-size";
    #[ignore = "long physics: cargo test --release --workspace -- --ignored"]
    lamp_near_zero: "lamp-near-zero";
    point_light_touching: "point-light-touching";
    grazing: "grazing";
    powers: "powers";
    faint_beside_bright: "faint-beside-bright";
    sky_furnace: "sky-furnace";
    one_pixel_sun: "one-pixel-sun";
    sky_sizes: "sky-sizes";
    black_sky: "black-sky";
    sky_turned: "sky-turned";
    sky_scaled: "sky-scaled";
    sky_far_away: "sky-far-away";
    ior: "ior";
    glass_in_glass: "glass-in-glass";
    water_in_a_glass: "water-in-a-glass";
    coloured_liquid: "coloured-liquid";
    facets: "facets";
    hall_of_mirrors: "hall-of-mirrors";
    coincident_glass: "coincident-glass";
    total_reflection: "total-reflection";
    camera_inside: "camera-inside";
    light_inside: "light-inside";
    coincident_opposite: "coincident-opposite";
    contact: "contact";
    slivers: "slivers";
    edges_and_corners: "edges-and-corners";
    axis_parallel: "axis-parallel";
    #[ignore = "long physics: cargo test --release --workspace -- --ignored"]
    one_photon: "one-photon";
    no_photons: "no-photons";
    photons_in_one_point: "photons-in-one-point";
    photons_on_one_plane: "photons-on-one-plane";
    film_shapes: "film-shapes";
    #[ignore = "long physics: cargo test --release --workspace -- --ignored"]
    million_luminaires: "million-luminaires";
    tiny_reflections: "tiny-reflections";
    black_and_white: "black-and-white";
    matrix_entries: "matrix-entries";
    fluorescent_furnace: "fluorescent-furnace";
    fluorescent_k: "fluorescent-k";
    matrix_of_eq_17: "matrix-of-eq-17";
}
