//! The atlas: pictures mixed from one run are like those of separate renders.
//!
//! Runs that are compared have different seeds and equally many passes, so that the bias of the gather radius is the same.
//! Each comparison also shows that it rejects a picture 2 % too bright.

use crate::agreement::{cornell, left_to_the_long_run, mixed};
use glam::Vec3;
use halflight::atlas::Atlas;
use halflight::error::Error;
use halflight::film::{Film, Layer, Preview, StateFile};
use halflight::light::Matrix;
use halflight::measure::{Estimate, agreement};
use halflight::plan::{Method, Settings};
use halflight::render::Render;
use halflight::scene::{Illumination, Matter, Scene};

const SIDE: u32 = 12;
const PASSES: u32 = 240;

fn settings(seed: u64, paths: u32) -> Settings {
    Settings { width: SIDE, height: SIDE, seed, paths: Some(paths), ..Settings::default() }
}

fn render(scene: &Scene, settings: Settings, passes: u32) -> Render {
    let mut render = Render::new(scene.clone(), settings, &[Layer::Visible]).expect("a render");
    // As the command does, which an atlas takes for leave to render several together.
    while render.film().passes() < passes {
        render.passes(passes - render.film().passes());
    }
    render
}

fn atlas(scene: &Scene, settings: Settings, passes: u32) -> Atlas {
    render(scene, Settings { atlas: true, ..settings }, passes).atlas().expect("asked for")
}

fn scaled(estimate: &Estimate, factor: f32) -> Estimate {
    let colour = estimate.colour.map(|(mean, error)| (f64::from(factor) * mean, error));
    Estimate { mean: estimate.mean.iter().map(|rgb| factor * *rgb).collect(), colour, ..estimate.clone() }
}

/// The mixed picture is that of `direct`, and would not be if it were 2 % off.
#[track_caller]
fn must_agree(atlas: &Atlas, point: (f64, f64), direct: &Render) {
    must_agree_and_tell(atlas, point, direct, 0.02);
}

/// The mixed picture is that of `direct`, and would not be if it were off by the share `told`.
#[track_caller]
fn must_agree_and_tell(atlas: &Atlas, (s, t): (f64, f64), direct: &Render, told: f32) {
    let mixed = atlas.estimate(atlas.mix(s, t).expect("a picture")).expect("several passes");
    let direct = Estimate::from_film(direct.film()).expect("several passes");
    let verdict = agreement(&mixed, &direct, None);
    assert!(verdict.accepted(), "{s},{t}: {verdict:?}");
    for factor in [1.0 - told, 1.0 + told] {
        let wrong = agreement(&scaled(&mixed, factor), &direct, None);
        assert!(!wrong.accepted(), "{s},{t}: too noisy to tell {factor}: {wrong:?}");
    }
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn five_by_five_points_are_direct_renders() {
    let scene = cornell(Illumination::GLOBAL);
    let atlas = atlas(&scene, settings(1, 10_000), PASSES);
    let long = !left_to_the_long_run("16 of the 25 points");
    for i in (0..25_u8).filter(|i| long || (i % 5 % 2 == 0 && i / 5 % 2 == 0)) {
        let (s, t) = (f32::from(i % 5) / 4.0, f32::from(i / 5) / 4.0);
        let direct = render(&scene.at(s, t), settings(100 + u64::from(i), 10_000), PASSES);
        must_agree(&atlas, (s.into(), t.into()), &direct);
    }
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn mirrors_and_glass_count_like_any_other_unless_they_are_set() {
    let follow = mixed(true, true).finish();
    let mut set = follow.clone();
    let own = [("Glass".to_owned(), Illumination::GLOBAL), ("Mirror".to_owned(), Illumination::Whitted)];
    set.illuminate(Some(Illumination::GLOBAL), &own).expect("names of the scene");
    for (scene, points) in [(follow, [(1.0, 0.0), (0.5, 0.5)]), (set, [(0.75, 0.25), (0.25, 0.75)])] {
        let atlas = atlas(&scene, settings(2, 20_000), PASSES);
        for (i, (s, t)) in points.into_iter().enumerate() {
            let direct = render(&scene.at(s, t), settings(200 + i as u64, 20_000), PASSES);
            must_agree(&atlas, (s.into(), t.into()), &direct);
        }
    }
}

/// k = 1.1463 at (1, 1).
fn supercritical() -> Scene {
    let mut scene = Scene::load("builtin:concentric?albedo=0.95").expect("built in");
    scene.illuminate(Some(Illumination::LOCAL), &[]).expect("no names");
    scene
}

#[test]
fn where_the_corner_has_no_image_others_have() {
    let scene = supercritical();
    let few = atlas(&scene, settings(3, 500), 4);
    assert!(few.cut);
    for (s, t) in [(1.0, 1.0), (0.88, 1.0)] {
        let Err(Error::NoImage { reason: message, k }) = few.mix(s, t) else {
            panic!("there is no image at {s},{t}")
        };
        assert!(k > 1.0 && message.contains("up to s = 0.86"), "{k}: {message}");
    }
    assert!(matches!(few.mix(1.1, 0.0), Err(Error::Usage(_))));
    assert!(few.left_out(0.7, 1.0) < 1e-5);
    // Of Σ rⁿ with r = 0.97 the terms beyond 92.
    let left_out = few.mix(0.97 / 1.1463, 1.0).expect("a picture").left_out;
    assert!((left_out / 0.97_f64.powi(93) - 1.0).abs() < 0.1, "{left_out}");
    if left_to_the_long_run("pictures beside the frontier") {
        return;
    }
    let many = atlas(&scene, settings(3, 10_000), 3 * PASSES);
    // Many small passes: most of the noise is that of one camera path and one connection a pixel and pass, whatever the photons.
    // An atlas of such a scene is noisier than a picture: much of its light is far along the series. Beside the frontier
    // 2 % are not to be seen in minutes; what sharing powers out does there is tested without noise, in `atlas::nodes`.
    for (s, t, told) in [(0.4, 1.0, 0.02), (0.7, 1.0, 0.05), (0.8, 0.5, 0.05)] {
        let direct = render(&scene.at(s, t), settings(300, 20_000), 3 * PASSES);
        must_agree_and_tell(&many, (s.into(), t.into()), &direct, told);
    }
}

#[test]
fn the_corner_where_it_was_shot_is_the_picture_of_the_film() {
    // That this picture is the one that a render without an atlas makes, which connects and splits otherwise, is tested
    // at the corner (1, 1) of the five by five points.
    let scene = cornell(Illumination::SHADOWLESS);
    let with = render(&scene, Settings { atlas: true, ..settings(5, 20_000) }, 3);
    let mixed = with.atlas().expect("asked for").mix(1.0, 1.0).expect("a picture");
    let near = |(a, b): (&Vec3, &Vec3), far: f32| (*a - *b).abs().max_element() <= far * b.max_element();
    let (picture, error) = (with.film().mean(Layer::Visible), with.film().standard_error());
    assert!(picture.iter().any(|rgb| rgb.x > 0.0), "a black picture proves nothing");
    assert!(mixed.visible.iter().zip(&picture).all(|pair| near(pair, 2e-5)), "the mixed picture differs");
    assert!(mixed.error.iter().zip(&error).all(|pair| near(pair, 1e-3)), "its error differs");
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn error_bars_hold_between_the_points_where_they_were_measured() {
    const RUNS: u64 = 60;
    const FEW: u32 = 8;
    /// Student's t of 90 % with 7 degrees of freedom.
    const T: f32 = 1.895;
    let scene = cornell(Illumination::GLOBAL);
    let atlases: Vec<Atlas> =
        (0..RUNS).map(|seed| atlas(&scene, settings(1000 + seed, 4_000), FEW)).collect();
    for (s, t) in [(0.2, 0.2), (0.55, 0.8), (0.8, 0.55), (0.95, 0.95), (0.97, 0.1)] {
        let mixed: Vec<_> = atlases.iter().map(|atlas| atlas.mix(s, t).expect("a picture")).collect();
        let (mut held, mut all, mut predicted, mut real) = (0, 0, 0.0, 0.0);
        for pixel in 0..(SIDE * SIDE) as usize {
            let mean = mixed.iter().map(|m| m.visible[pixel]).sum::<Vec3>() / RUNS as f32;
            for m in &mixed {
                let (off, error) = ((m.visible[pixel] - mean).abs(), m.error[pixel]);
                for c in 0..3 {
                    if error[c] > 0.0 {
                        held += usize::from(off[c] <= T * error[c]);
                        all += 1;
                        predicted += f64::from(error[c] * error[c]);
                        real += f64::from(off[c] * off[c]) * RUNS as f64 / (RUNS as f64 - 1.0);
                    }
                }
            }
        }
        let (coverage, ratio) = (f64::from(held as u32) / f64::from(all as u32), (predicted / real).sqrt());
        println!("{s},{t}: coverage {coverage:.3}, predicted over real error {ratio:.3}");
        assert!((0.85..=0.95).contains(&coverage), "{s},{t}: 90 % interval holds in {coverage:.3}");
        assert!((0.92..=1.15).contains(&ratio), "{s},{t}: predicted over real error {ratio:.3}");
    }
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn beside_the_frontier_sharing_powers_out_changes_little() {
    // The film is read at the point without sharing, from the same photons and camera rays: no noise is between them.
    let corner = supercritical();
    for (s, t) in [(0.4_f32, 1.0_f32), (0.7, 1.0), (0.8, 0.5)] {
        let with = render(&corner.at(s, t), Settings { atlas: true, ..settings(8, 4_000) }, 8);
        let mixed = with.atlas().expect("asked for").mix(s.into(), t.into()).expect("a picture").visible;
        let sum = |picture: &[Vec3]| picture.iter().map(|rgb| rgb.as_dvec3().element_sum()).sum::<f64>();
        let off = sum(&mixed) / sum(&with.film().mean(Layer::Visible)) - 1.0;
        println!("{s},{t}: off by {off:.1e}");
        assert!(off.abs() < 2e-3, "{s},{t}: off by {off:.1e}");
    }
}

#[test]
fn a_truncated_series_has_all_pictures() {
    // Also where the whole series has no sum; the same photons are shot for both.
    let scene = supercritical();
    // In disks that are simple: in others paths go on, but not those of an atlas, whose pixels have one path each.
    let truncated =
        Settings { max_reflections: Some(3), indirect_radius: 0.5, one_path: true, ..settings(6, 4_000) };
    let mixed = atlas(&scene, truncated.clone(), 4).mix(1.0, 1.0).expect("a picture").visible;
    let direct = render(&scene.at(1.0, 1.0), truncated, 4).film().mean(Layer::Visible);
    let near = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element() <= 2e-5 * b.max_element();
    assert!(direct.iter().any(|rgb| rgb.x > 0.0), "a black picture proves nothing");
    assert!(mixed.iter().zip(&direct).all(near));
}

#[test]
fn passes_rendered_together_are_those_rendered_one_by_one() {
    const PASSES: u32 = 43;
    let scene = cornell(Illumination::GLOBAL);
    let settings = Settings { atlas: true, ..settings(8, 2_000) };
    let together = render(&scene, settings.clone(), PASSES);
    let mut one_by_one = Render::new(scene, settings, &[Layer::Visible]).expect("a render");
    (0..PASSES).for_each(|_| one_by_one.pass());
    assert_eq!(together.film().mean(Layer::Visible), one_by_one.film().mean(Layer::Visible));
    let (together, one_by_one) = (together.atlas().expect("one"), one_by_one.atlas().expect("one"));
    assert_eq!((together.passes, one_by_one.passes, one_by_one.groups), (PASSES, PASSES, PASSES));
    assert_eq!(together.groups, 8 + 4 + 6 + 1, "one by one, by two and by four, and three that were left");
    for (a, b) in together.planes.iter().flatten().zip(one_by_one.planes.iter().flatten()) {
        assert!((*a - *b).abs().max_element() < 1e-5 * (1e-3 + b.max_element()), "{a} instead of {b}");
    }
}

#[test]
fn an_atlas_that_goes_on_from_its_state_is_that_of_one_go() {
    let scene = cornell(Illumination::GLOBAL);
    let settings = Settings { atlas: true, ..settings(9, 2_000) };
    let begin = || Render::new(scene.clone(), settings.clone(), &[Layer::Visible]).expect("a render");
    let go_on = |mut render: Render, passes: u32| {
        while render.film().passes() < passes {
            render.passes(passes - render.film().passes());
        }
        render
    };
    let whole = go_on(begin(), 24);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.halflight");
    let resume = |render: &mut Render| render.resume(&path, StateFile::open(&path)?);
    for stop in [1, 7, 8, 10, 16, 20] {
        go_on(begin(), stop).save(&path, Preview::from(0.0)).expect("stored");
        let mut resumed = begin();
        resume(&mut resumed).expect("of the same render");
        assert_eq!(resumed.film().passes(), stop);
        let again = resume(&mut resumed).expect_err("it has passes").to_string();
        assert!(again.contains("there are passes already"), "{again}");
        let resumed = go_on(resumed, 24);
        assert!(resumed.atlas() == whole.atlas(), "stopped after {stop}");
        assert_eq!(resumed.film().mean(Layer::Visible), whole.film().mean(Layer::Visible));
    }
    // Cut in two, a group is another sample of the error bar, and sums round otherwise.
    let cut = go_on(go_on(begin(), 9), 24);
    let (cut, whole) = (cut.atlas().expect("one"), whole.atlas().expect("one"));
    assert_eq!((cut.passes, cut.groups), (24, whole.groups + 1));
    assert!(cut != whole);
    // A film alone is not half an atlas.
    let head = begin().state_head(Preview::from(0.0));
    let film = Film::new(SIDE, SIDE, &[Layer::Visible]);
    assert!(begin().add(&head, &film).expect_err("refused").contains("atlas"));
}

#[test]
fn threads_do_not_change_a_bit() {
    let scene = cornell(Illumination::GLOBAL);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| atlas(&scene, settings(7, 5_000), 19))
    };
    let one = with(1);
    assert!(one.planes.iter().flatten().any(|rgb| rgb.x > 0.0), "a black atlas proves nothing");
    assert!(with(2) == one && with(3) == one);
}

#[test]
fn what_has_no_single_power_of_s_is_refused() {
    let refusal = |scene: &Scene, settings: Settings| {
        let settings = Settings { atlas: true, ..settings };
        match Render::new(scene.clone(), settings, &[Layer::Visible]) {
            Err(Error::Usage(message)) => message,
            other => panic!("not refused: {:?}", other.map(|_| ())),
        }
    };
    let scene = cornell(Illumination::GLOBAL);
    let path = Settings { method: Method::Path, ..settings(1, 1000) };
    assert!(refusal(&scene, path).contains("photon"));
    let mut own = scene.clone();
    let matter = Matter {
        opaque: Matrix::new([[0.5, 0.2], [0.9, 0.4]]),
        straight: Matrix::new([[0.3, 0.1], [0.05, 0.2]]),
    };
    let name = own.materials[0].name.clone();
    own.illuminate(None, &[(name.clone(), Illumination::Own(matter))]).expect("a name of the scene");
    assert!(refusal(&own, settings(1, 1000)).contains(&name));
    let mut set = scene;
    set.illuminate(None, &[("*".into(), Illumination::SHADOWLESS)]).expect("no names");
    assert!(refusal(&set, settings(1, 1000)).contains("follows"));
}
