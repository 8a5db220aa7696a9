//! Who serves direct light: the pilot's choice, and whether it was right.

use crate::support::{Build, diffuse, look};
use glam::Vec3;
use halflight::film::Layer;
use halflight::light::Light;
use halflight::plan::{Direct, Settings};
use halflight::render::Render;
use halflight::scene::{Illumination, Luminaire, Scene};

/// More lamps than are told apart by where they are seen from.
const CELLS: u16 = 17;

/// A house of cells with a lamp in each; of the lamps one in 289 lights what is seen. `open`: without walls.
fn cells(open: bool) -> Scene {
    let mut build =
        Build::new(Illumination::GLOBAL, look(Vec3::new(0.5, 2.5, 0.5), Vec3::new(0.5, 0.0, 0.5)));
    build.yfov(0.3);
    let grey = build.material("Grey", diffuse(0.5));
    let side = f32::from(CELLS);
    build.quad(Vec3::ZERO, Vec3::Z * side, Vec3::X * side, grey);
    for i in 0..=CELLS {
        let at = f32::from(i);
        if !open {
            for (corner, along) in [(Vec3::X * at, Vec3::Z), (Vec3::Z * at, Vec3::X)] {
                build.quad(corner, along * side, Vec3::Y * 2.0, grey);
                build.quad(corner, Vec3::Y * 2.0, along * side, grey);
            }
        }
        for k in 0..CELLS {
            let position = Vec3::new(at + 0.5, 1.0, f32::from(k) + 0.5);
            if i < CELLS {
                build.0.luminaires.push(Luminaire::Point { position, intensity: Light::both(Vec3::ONE) });
            }
        }
    }
    build.finish()
}

fn settings(direct: Direct) -> Settings {
    Settings { width: 24, height: 24, paths: Some(120_000), direct, ..Settings::default() }
}

/// Root mean square of the error of a few passes, noise and bias, against a picture of many more connections.
fn error(scene: &Scene, direct: Direct, reference: &[Vec3]) -> f64 {
    let picture = picture(scene, direct, 1, 8);
    let squares = picture.iter().zip(reference).map(|(a, b)| f64::from((*a - *b).length_squared()));
    squares.sum::<f64>().sqrt()
}

/// Direct light by many connections; of other light nothing is shot.
fn reference(scene: &Scene) -> Vec<Vec3> {
    rendered(scene, Settings { max_reflections: Some(1), seed: 2, ..settings(Direct::Connection) }, 2000)
}

fn picture(scene: &Scene, direct: Direct, seed: u64, passes: u32) -> Vec<Vec3> {
    rendered(scene, Settings { seed, ..settings(direct) }, passes)
}

fn rendered(scene: &Scene, settings: Settings, passes: u32) -> Vec<Vec3> {
    let mut render =
        Render::new(scene.clone(), settings, &[Layer::Visible, Layer::Direct]).expect("a render");
    (0..passes).for_each(|_| render.pass());
    render.film().mean(Layer::Direct)
}

fn chosen(scene: &Scene) -> (Direct, String) {
    let render = Render::new(scene.clone(), settings(Direct::Auto), &[Layer::Visible]).expect("a render");
    (render.frame().direct, render.frame().direct_because.clone())
}

#[test]
fn photons_serve_direct_light_where_connections_look_for_one_lamp_among_many_walls() {
    let scene = cells(false);
    let (direct, because) = chosen(&scene);
    println!("{because}");
    assert_eq!(direct, Direct::Photons, "{because}");
    assert_eq!(chosen(&scene), (direct, because), "a second look chooses alike");
    let reference = reference(&scene);
    let (connected, shot) =
        (error(&scene, Direct::Connection, &reference), error(&scene, Direct::Photons, &reference));
    assert!(shot < 0.7 * connected, "photons {shot}, connections {connected}");
}

#[test]
fn connections_stay_where_they_learn_what_is_seen() {
    let mut scene = cells(false);
    // Those along two walls of the house.
    scene.luminaires.truncate(2 * usize::from(CELLS));
    let (direct, because) = chosen(&scene);
    println!("{because}");
    assert!(direct == Direct::Connection && because.contains("a pilot promises"), "{because}");
}

#[test]
fn connections_stay_where_they_are_good_enough() {
    let mut scene = cells(true);
    scene.luminaires.truncate(4);
    assert_eq!(chosen(&scene), (Direct::Connection, "few luminaires".into()));
    // A lamp far stronger than the others is what connections go for.
    let mut scene = cells(true);
    if let Luminaire::Point { intensity, .. } = &mut scene.luminaires[0] {
        *intensity = Light::both(Vec3::splat(1e4));
    }
    let (direct, because) = chosen(&scene);
    println!("{because}");
    assert!(direct == Direct::Connection && because.contains("a pilot promises"), "{because}");
}

#[test]
fn what_the_pilot_chose_is_what_is_rendered() {
    let scene = cells(false);
    assert!(picture(&scene, Direct::Auto, 1, 1) == picture(&scene, Direct::Photons, 1, 1));
}
