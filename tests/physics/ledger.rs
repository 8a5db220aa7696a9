//! Energy: what luminaires emit is absorbed or escapes.

use crate::support::{Build, Measured, diffuse, glow, look, small};
use glam::Vec3;
use halflight::light::Invisible;
use halflight::optics::{Dielectric, Lobe, Mirror};
use halflight::photon::Ledger;
use halflight::plan::{Frame, PhotonPlan, Plan};
use halflight::render::learn;
use halflight::scene::{Illumination, Scene};
use halflight::shoot::shoot;

fn mixed_scene() -> Scene {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 1.0, 4.0), Vec3::ZERO));
    let floor = build.material("Floor", diffuse(0.7));
    let lamp = build.material("Lamp", diffuse(0.2));
    let glass = build.material("Glass", Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::ONE }));
    let mirror = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::splat(0.9), true)));
    build.0.materials[lamp as usize].emission = glow(3.0);
    build.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, floor);
    build.quad(Vec3::new(-0.5, 3.0, -0.5), Vec3::X, Vec3::Z, lamp);
    build.sphere(Vec3::new(0.5, 0.6, 0.0), 0.5, (48, 24), false, glass);
    build.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0, mirror);
    // Flat normals: interpolated ones are not energy-conserving, here or anywhere.
    build.flatten();
    build.finish()
}

fn ledgers(scene: Scene, passes: u32) -> Vec<Ledger> {
    let plan = Plan::new(scene, small(8, 8, 20_000));
    let frame = learn(&plan);
    assert!(frame.photons.is_some(), "global illumination needs photons");
    (0..passes).map(|pass| shoot::<Invisible>(&plan, &frame, pass).ledger).collect()
}

#[test]
fn books_balance_in_every_pass() {
    for ledger in ledgers(mixed_scene(), 4) {
        let income = ledger.emitted + ledger.roulette + ledger.created;
        let spending = ledger.absorbed + ledger.escaped;
        assert!((income / spending - 1.0).abs() < 1e-5, "{ledger:?}");
        assert!(ledger.created < 1e-5 * ledger.emitted, "global matter creates no energy: {ledger:?}");
    }
}

#[test]
fn what_is_emitted_is_absorbed_or_escapes() {
    let ledgers = ledgers(mixed_scene(), 40);
    // Lambertian panel of 1 m² and radiance 3: π · 3 · 1 W in each of three channels.
    let emitted = 3.0 * 3.0 * std::f64::consts::PI;
    let kept: Vec<f64> = ledgers.iter().map(|ledger| ledger.absorbed + ledger.escaped).collect();
    Measured::of(&kept).must_be(emitted, 1e-4);
    // Guided paths have powers of their own, whose sum is right on the average; without a guide it is right each time.
    Measured::of(&ledgers.iter().map(|ledger| ledger.emitted).collect::<Vec<_>>()).must_be(emitted, 1e-4);
    let plan = Plan::new(mixed_scene(), small(8, 8, 20_000));
    let frame = learn(&plan);
    let guided = frame.photons.clone().expect("global illumination needs photons");
    assert!(guided.guide.is_some() || guided.starts.is_some(), "glass and a mirror make caustics");
    let even = Frame { photons: Some(PhotonPlan { guide: None, starts: None, ..guided }), ..frame };
    for pass in 0..4 {
        let ledger = shoot::<Invisible>(&plan, &even, pass).ledger;
        assert!((ledger.emitted / emitted - 1.0).abs() < 1e-4, "{ledger:?}");
    }
}

#[test]
fn roulette_is_fair() {
    let bias: Vec<f64> =
        ledgers(mixed_scene(), 40).iter().map(|ledger| ledger.roulette / ledger.emitted).collect();
    let bias = Measured::of(&bias);
    assert!(bias.mean.abs() < 3.5 * bias.error, "{bias:?}");
    assert!(3.5 * bias.error < 0.02, "{bias:?} could hide 2 %");
}
