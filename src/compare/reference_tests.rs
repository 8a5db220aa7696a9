use super::*;
use crate::compare::{ReferenceMaker, candidates};
use crate::measure::Moments;
use crate::plan::{Method, Settings};
use crate::scene::Scene;
use glam::DVec3;

fn settings() -> Settings {
    Settings { width: 12, height: 12, paths: Some(2000), ..Settings::default() }
}

/// A square picture made of passes.
fn of_passes(side: u32, moments: &Moments) -> Reference {
    Reference {
        width: side,
        height: side,
        visible: moments.mean(),
        error: moments.standard_error(),
        emitted: None,
        doubled: None,
        method: "path".into(),
        passes: moments.passes(),
        seconds: 1.0,
        scene_hash: None,
    }
}

#[test]
fn it_is_kept_taken_up_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::load("builtin:caustic-box").unwrap();
    assert_eq!(candidates(&scene, &settings()), [Method::Path, Method::Photon]);
    let method = Method::Photon;
    let new = || ReferenceMaker::new(&scene, &settings(), method, folder.path()).unwrap();
    let mut first = new();
    first.extend_to(0.0).unwrap();
    let mut second = new();
    assert!(second.from_cache && !first.from_cache);
    let before = second.reference();
    assert_eq!(before.visible, first.reference().visible);
    second.extend_to(before.seconds + 0.05).unwrap();
    let (after, counts) = (second.reference(), vec![false; 144]);
    assert!(after.passes > before.passes);
    let own = after.own_error(&counts);
    assert!(own.noise > 0.0 && own.bias.is_some_and(|bias| bias >= 0.0) && own.total > 0.05 * own.noise);
    let read = Reference::read(second.file()).unwrap();
    assert_eq!((read.passes, &read.visible), (after.passes, &after.visible));
}

#[test]
fn rare_bright_samples_do_not_hide_behind_their_own_brightness() {
    // One sample of 1000 in 2000: the mean is 1, and passes are so few that most pixels never meet one.
    let (side, passes) = (64_u32, 40);
    let pixels = (side * side) as usize;
    let mut moments = Moments::new(pixels);
    for pass in 0..passes {
        let mut rng = crate::sampling::Rng::new(1, crate::sampling::Stream::Test, pass, 0);
        let picture: Vec<DVec3> =
            (0..pixels).map(|_| DVec3::splat(if rng.f32() < 0.0005 { 1000.0 } else { 0.5 })).collect();
        moments.add(picture);
    }
    let reference = of_passes(side, &moments);
    let none_out = vec![false; pixels];
    let truth = crate::measure::compare(&reference.visible, &vec![Vec3::ONE; pixels], None).relmse;
    let own = reference.own_error(&none_out).noise;
    assert!(own > 0.5 * truth, "own {own}, truth {truth}");
    // What it would be without the median.
    let pairs = reference.error.iter().zip(&reference.visible);
    let naive: f64 = pairs.map(|(e, r)| f64::from(e.x / r.x).powi(2)).sum::<f64>() / pixels as f64;
    assert!(naive < 0.02 * truth, "naive {naive}, truth {truth}");
}

#[test]
fn errors_are_those_against_a_reference_without_noise() {
    // A picture that is off by 2 % up and down, with noise of 1 %, against a reference of 3 % noise.
    let (side, passes) = (64_u32, 25);
    let pixels = (side * side) as usize;
    let mut rng = crate::sampling::Rng::new(4, crate::sampling::Stream::Test, 0, 0);
    let mut noise = |size: f64| {
        let twelve: f32 = (0..12).map(|_| rng.f32()).sum();
        size * f64::from(twelve - 6.0)
    };
    let truth: Vec<f64> = (0..pixels).map(|i| 0.1 + (i % 50) as f64 / 50.0).collect();
    let mut moments = Moments::new(pixels);
    for _ in 0..passes {
        let picture: Vec<DVec3> = truth.iter().map(|r| DVec3::splat(r * (1.0 + noise(0.15)))).collect();
        moments.add(picture);
    }
    let reference = of_passes(side, &moments);
    let picture: Vec<Vec3> = truth
        .iter()
        .zip([1.02, 0.98].iter().cycle())
        .map(|(r, off)| Vec3::splat((r * (off + noise(0.01))) as f32))
        .collect();
    let exact: Vec<Vec3> = truth.iter().map(|r| Vec3::splat(*r as f32)).collect();
    let of = |against: &[Vec3]| crate::measure::compare(&picture, against, None);
    let (raw, wanted) = (of(&reference.visible), of(&exact));
    let none_out = vec![false; pixels];
    let got = reference.noise_share(&none_out).taken_off(raw);
    assert!(raw.relmse > 2.0 * wanted.relmse && raw.rmse > 1.4 * wanted.rmse);
    assert!((got.relmse / wanted.relmse - 1.0).abs() < 0.08, "{got:?} for {wanted:?}");
    assert!((got.rmse / wanted.rmse - 1.0).abs() < 0.04, "{got:?} for {wanted:?}");
}

#[test]
fn diffuse_scenes_get_a_path_traced_one_and_other_settings_another_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::load("builtin:cornell-spheres").unwrap();
    assert_eq!(candidates(&scene, &settings()), [Method::Path]);
    assert_eq!(candidates(&scene.at(0.0, 1.0), &settings()), [Method::Path, Method::Photon], "local");
    let file = |settings: &Settings, method| {
        let maker = ReferenceMaker::new(&scene, settings, method, folder.path()).unwrap();
        maker.file().to_owned()
    };
    let small = file(&settings(), Method::Path);
    assert_ne!(small, file(&settings(), Method::Photon));
    assert_ne!(small, file(&Settings { width: 13, ..settings() }, Method::Path));
    assert_eq!(small, file(&settings(), Method::Path));
}
