//! Series that converge slowly, and series that do not.

use super::build::{Build, film, look, mean_is};
use super::{Case, Check, Effort, Rows, Run};
use crate::existence::Existence;
use crate::optics::{Diffuse, Lobe};
use crate::plan::{Method, Plan};
use crate::scene::{Illumination, Scene};
use glam::Vec3;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "furnace",
        promise: "a closed room of albedo ρ glows at E / (1 − ρ), after a million reflections too",
        run: Run::ByRow(furnace),
    },
    Case {
        name: "furnace-paths",
        promise: "walks from the camera find E / (1 − ρ) too, though chance ends the longest",
        run: Run::ByRow(furnace_paths),
    },
    Case {
        name: "k-closed-form",
        promise: "k within 1 % of its closed form",
        run: Run::ByRow(k_closed_form),
    },
    Case {
        name: "k-near-one",
        promise: "k = 0.999 is rendered with a warning, k = 1.001 is refused",
        run: Run::ByRow(k_near_one),
    },
    Case {
        name: "k-box",
        promise: "a shadowless box of two-sided walls of albedo 0.9 is refused",
        run: Run::AtOnce(k_box),
    },
];

/// A closed cube that glows everywhere.
fn furnace_scene(albedo: f32) -> Scene {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::ZERO, Vec3::X, 0.6));
    let wall = build.glowing(albedo, 1.0);
    build.room(-Vec3::ONE, Vec3::ONE, wall);
    build.finish()
}

fn furnace(effort: Effort) -> Rows {
    let albedos: &[(f32, u32, u32)] = &[
        // albedo, paths a pass, passes: about as many reflections each
        (0.9, 20_000, 16),
        (0.99, 300, 16),
        (0.999, 30, 16),
        (0.9999, 3, 40),
        (0.99999, 1, 8),
        (0.999_999, 1, 4),
    ];
    let kept = if effort == Effort::Full { albedos } else { &albedos[..5] };
    Box::new(kept.iter().map(|&(albedo, paths, passes)| {
        // A radius that reaches nearly to the rims of the wall: few paths must do.
        let settings = crate::plan::Settings { indirect_radius: 8.0, ..film(8, 8, paths) };
        let expected = 1.0 / (1.0 - f64::from(albedo));
        mean_is(format!("albedo {albedo}"), furnace_scene(albedo), settings, passes, expected, 1e-3)
    }))
}

/// Stiffer ones are left to photons: the chance that a walk gets as far as n reflections falls as n⁻², whatever ρ is.
fn furnace_paths(_: Effort) -> Rows {
    // Albedo, samples a pass, passes.
    Box::new([(0.9_f32, 64, 16), (0.99, 512, 48)].into_iter().map(|(albedo, samples, passes)| {
        let settings = crate::plan::Settings { method: Method::Path, samples, ..film(2, 2, 1) };
        let expected = 1.0 / (1.0 - f64::from(albedo));
        mean_is(format!("albedo {albedo}"), furnace_scene(albedo), settings, passes, expected, 1e-3)
    }))
}

const RATIO: f64 = 0.5;

fn concentric(albedo: f64, two_sided: bool) -> Result<Scene, String> {
    let name = format!("builtin:concentric?albedo={albedo}&ratio={RATIO}&two_sided={two_sided}");
    Scene::load(name).map_err(|why| why.to_string())
}

/// k / ρ of concentric spheres, shadowless; a = (r/R)². One-sided (1 + √(1 + 4a)) / 2; two-sided the largest root of
/// μ (μ − 1)² = a (2μ − 1).
fn k_over_albedo(two_sided: bool) -> f64 {
    let a = RATIO * RATIO;
    if !two_sided {
        return 0.5 * (1.0 + (1.0 + 4.0 * a).sqrt());
    }
    let (mut low, mut high) = (1.0, 3.0);
    for _ in 0..60 {
        let mu = 0.5 * (low + high);
        if mu * (mu - 1.0_f64).powi(2) < a * (2.0 * mu - 1.0) { low = mu } else { high = mu }
    }
    low
}

/// Inscribed polyhedra of 256 sides are smaller than spheres by (π / 256)² / 2 = 8e-5.
const TESSELLATION: f64 = 2e-4;

fn k_closed_form(effort: Effort) -> Rows {
    let wanted: &[f64] =
        if effort == Effort::Full { &[0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999] } else { &[0.5, 0.95] };
    let row = |two_sided: bool, k: f64| {
        let what = format!("k, {} sided", if two_sided { "two" } else { "one" });
        match concentric(k / k_over_albedo(two_sided), two_sided) {
            Ok(scene) => match Plan::new(scene, film(8, 8, 1)).existence {
                Existence::Measured(m) => Check::number(what, k, (m.k, m.error), TESSELLATION),
                Existence::Certain { reason, .. } => Check::fact(what, "measured", reason),
            },
            Err(why) => Check::fact(what, "a scene", why),
        }
    };
    Box::new([false, true].into_iter().flat_map(move |sides| wanted.iter().map(move |&k| row(sides, k))))
}

/// What a render of it would say.
fn verdict(scene: Scene) -> String {
    match super::build::rendered(scene, film(8, 8, 1), 0) {
        Ok(render) if render.plan().existence.warning().is_some() => "rendered with a warning".into(),
        Ok(_) => "rendered".into(),
        Err(why) => why.split(':').next().unwrap_or_default().into(),
    }
}

fn k_near_one(effort: Effort) -> Rows {
    let both: &[_] = &[(false, "one-sided"), (true, "two-sided")];
    let wanted = if effort == Effort::Full { both } else { &both[..1] };
    let row = |(two_sided, sides): (bool, &str), (k, expected): (f64, &str)| {
        let got = concentric(k / k_over_albedo(two_sided), two_sided).map_or_else(|why| why, verdict);
        Check::fact(format!("k = {k}, {sides}"), expected, got)
    };
    let stiff = [(0.999, "rendered with a warning"), (1.001, "no image exists")];
    Box::new(
        wanted.iter().flat_map(move |&sides| stiff.map(|k| (sides, k))).map(move |(sides, k)| row(sides, k)),
    )
}

fn k_box(_: Effort) -> Vec<Check> {
    let Ok(mut scene) = Scene::load("builtin:cornell-spheres") else { return Vec::new() };
    for material in scene.materials.iter_mut().filter(|material| material.emission.is_none()) {
        let lobe = Lobe::Diffuse(Diffuse { albedo: Vec3::splat(0.9), two_sided: true, under: None });
        material.lobes = vec![(1.0, lobe)];
    }
    let mut checks = Vec::new();
    for (illumination, expected) in
        [(Illumination::SHADOWLESS, "no image exists"), (Illumination::GLOBAL, "rendered")]
    {
        let mut scene = scene.clone();
        let got = match scene.illuminate(Some(illumination), &[]) {
            Ok(()) => verdict(scene),
            Err(why) => why.to_string(),
        };
        checks.push(Check::fact(illumination.describe(), expected, got));
    }
    checks
}
