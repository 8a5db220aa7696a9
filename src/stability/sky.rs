//! Light from infinity: skies that are even, black, of one texel or of a hundred million, and their turn.

use super::build::{Build, diffuse, film, finite, glass, look, mean_is, rendered};
use super::scale::{compare, far_file, far_from_home};
use super::{Case, Check, Effort, Run};
use crate::film::Film;
use crate::light::Light;
use crate::optics::{Lobe, Mirror};
use crate::plan::{Direct, Method, Settings};
use crate::scene::environment::{Around, Limits, Panorama, Sky, Source};
use crate::scene::{Background, Environment, Illumination, Luminaire, Scene, Surroundings};
use glam::{Mat3, Vec3};
use serde_json::json;
use std::f64::consts::{FRAC_1_PI, PI, TAU};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "sky-furnace",
        promise: "what is white cannot be told from an even sky; a shut box under it stays black",
        run: Run::AtOnce(furnace),
    },
    Case {
        name: "one-pixel-sun",
        promise: "a texel of 1e6 in a dim sky of millions brings what it should",
        run: Run::AtOnce(one_pixel_sun),
    },
    Case {
        name: "sky-sizes",
        promise: "pictures of one texel, of few and of long rows are the sky that they show",
        run: Run::AtOnce(sizes),
    },
    Case {
        name: "black-sky",
        promise: "a black sky is seen as black and takes no part in light",
        run: Run::AtOnce(black),
    },
    Case {
        name: "sky-turned",
        promise: "a sky that is turned by 360° is the same sky",
        run: Run::AtOnce(turned),
    },
    Case {
        name: "sky-scaled",
        promise: "a scene under a sky scaled by 1e-4 … 1e4 is the same picture",
        run: Run::AtOnce(scaled),
    },
    Case {
        name: "sky-far-away",
        promise: "a scene under a sky moved 1e6 m away is the same picture",
        run: Run::AtOnce(far_away),
    },
];

const ALBEDO: f64 = 0.5;

fn by_paths(method: Method) -> Settings {
    Settings { method, samples: 64, ..film(32, 32, 1) }
}

/// White walls that meet in a corner, with a ball of glass, a mirror and a white ball in it.
fn white_corner(sky: Environment) -> Scene {
    let camera = look(Vec3::new(3.0, 2.5, 3.5), Vec3::new(0.5, 0.4, 0.5), 0.5);
    let mut build = Build::new(Illumination::GLOBAL, camera);
    let white = build.material("White", diffuse(1.0));
    let clear = build.material("Glass", glass(1.5));
    let mirror = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::ONE, false)));
    let (x, y, z) = (2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z);
    for [a, b] in [[z, x], [x, y], [y, z]] {
        build.quad(Vec3::ZERO, a, b, white);
    }
    for (at, material) in [(0.4, clear), (1.0, mirror), (1.6, white)] {
        build.ball(Vec3::new(at, 0.3, 2.0 - at), 0.28, 48, 24, material);
    }
    build.0.environment = Some(sky);
    build.finish()
}

/// The inside of a box that light from outside does not reach.
fn shut_box(sky: Environment) -> Scene {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.1, 0.2, 0.3), Vec3::X, 1.2));
    let wall = build.material("Wall", diffuse(0.7));
    build.room(-Vec3::ONE, Vec3::ONE, wall);
    build.0.environment = Some(sky);
    build.finish()
}

fn furnace(_: Effort) -> Vec<Check> {
    let even = || Environment::constant(Vec3::ONE);
    // A map is blurred over its radius, which is wide here: the corner tells how much that may be.
    let photons = Settings { caustic_radius: 0.5, indirect_radius: 0.5, ..film(32, 32, 20_000) };
    let mut checks = vec![mean_is("open, photon", white_corner(even()), photons, 200, 1.0, 4e-3)];
    for method in [Method::Path, Method::PathPlain] {
        let what = format!("open, {}", method.name());
        checks.push(mean_is(what, white_corner(even()), by_paths(method), 8, 1.0, 1e-3));
    }
    for (what, sky) in [("even", even()), ("with a sun", sunny([64, 32]))] {
        let methods = [film(24, 24, 20_000), by_paths(Method::Path), by_paths(Method::PathPlain)].into_iter();
        checks.extend(methods.map(|settings| {
            let what = format!("shut, {what}, {}", settings.method.name());
            finite(what, false, shut_box(sky.clone()), settings, 4)
        }));
    }
    checks
}

/// What all texels have but one, and that one: as Radiance's files can say it.
const DIM: f64 = 0.125;
const BRIGHT: f64 = 999_424.0;

/// The row of the sun, just below 45°.
fn sun_row(height: u32) -> u32 {
    height / 4
}

/// A sky with a sun of one texel, read from the bytes of a file.
fn sunny([width, height]: [u32; 2]) -> Environment {
    let limits = Limits { pixels: 1 << 28, bytes: u64::MAX };
    let panorama = Panorama::decode(&radiance([width, height]), limits).expect("a picture of our own");
    Environment::new("a sun of one texel", panorama, 1.0, Mat3::IDENTITY, Background::Same)
}

/// Its file, in run lengths.
fn radiance([width, height]: [u32; 2]) -> Vec<u8> {
    let mut bytes = format!("#?RADIANCE\n\n-Y {height} +X {width}\n").into_bytes();
    let [_, _, high, low] = width.to_be_bytes();
    for y in 0..height {
        bytes.extend([2, 2, high, low]);
        // Red, green and blue are 128 · 2⁻¹⁰, or 244 · 2¹².
        for [dim, bright] in [[128, 244], [128, 244], [128, 244], [126, 148]] {
            let before = if y == sun_row(height) { width / 4 } else { 0 };
            run(&mut bytes, before, dim);
            run(&mut bytes, u32::from(y == sun_row(height)), bright);
            run(&mut bytes, width - before - u32::from(y == sun_row(height)), dim);
        }
    }
    bytes
}

fn run(bytes: &mut Vec<u8>, mut count: u32, value: u8) {
    while count > 0 {
        let now = count.min(127);
        bytes.extend([128 + now as u8, value]);
        count -= now;
    }
}

/// ∫ L cos θ dω of that sky over what is above the horizon: its sun falls off over a texel to all sides.
fn irradiance([width, height]: [u32; 2]) -> f64 {
    let step = PI / f64::from(height);
    let zenith_angle = step * (f64::from(sun_row(height)) + 0.5);
    // ∫ (1 − |x|/h) cos(m + x) sin(m + x) dx over [−h, h] = ½ sin 2m · (1 − cos 2h) / 2h.
    let down = 0.5 * (2.0 * zenith_angle).sin() * (1.0 - (2.0 * step).cos()) / (2.0 * step);
    PI * DIM + (BRIGHT - DIM) * TAU / f64::from(width) * down
}

/// A floor under a sky, seen from above.
fn floor(sky: Environment) -> Build {
    let mut build = Build::new(Illumination::ONE_BOUNCE, look(Vec3::new(0.0, 2.0, 0.3), Vec3::ZERO, 0.6));
    let floor = build.material("Floor", diffuse(ALBEDO as f32));
    build.level(0.0, 1.0, true, floor);
    build.0.environment = Some(sky);
    build
}

fn one_pixel_sun(effort: Effort) -> Vec<Check> {
    let largest = if effort == Effort::Full { [16384, 8192] } else { [4096, 2048] };
    let mut checks = Vec::new();
    for size in [[2048, 1024], largest] {
        let sky = sunny(size);
        let expected = ALBEDO * FRAC_1_PI * irradiance(size);
        let [photon, photons] =
            [Direct::Connection, Direct::Photons].map(|direct| Settings { direct, ..film(32, 32, 20_000) });
        for (how, settings, passes) in
            [("connections", photon, 64), ("paths", by_paths(Method::Path), 16), ("photons", photons, 200)]
        {
            let what = format!("{} × {}, {how}", size[0], size[1]);
            checks.push(mean_is(what, floor(sky.clone()).finish(), settings, passes, expected, 1e-3));
        }
        let texels = size[0] as usize * size[1] as usize;
        let most = "at most 6 bytes a texel";
        let got = if sky.bytes() <= 6 * texels { most.into() } else { format!("{} bytes", sky.bytes()) };
        checks.push(Check::fact(format!("{} × {}, in memory", size[0], size[1]), most, got));
    }
    checks
}

/// A sky of so many equal texels.
fn equal(width: u32, height: u32) -> Environment {
    let panorama = Panorama::of_texels(width, height, vec![Vec3::splat(0.7); (width * height) as usize]);
    Environment::new("equal", panorama, 1.0, Mat3::IDENTITY, Background::Same)
}

fn sizes(_: Effort) -> Vec<Check> {
    let each = [[1, 1], [2, 1], [1, 2], [3, 2], [1, 700], [700, 1]].into_iter();
    let checks = each.map(|[width, height]| {
        let scene = floor(equal(width, height)).finish();
        mean_is(format!("{width} × {height}"), scene, film(32, 32, 1000), 64, ALBEDO * 0.7, 1e-4)
    });
    let one = same(
        "1 × 1 and its colour",
        floor(equal(1, 1)).finish(),
        floor(Environment::constant(Vec3::splat(0.7))).finish(),
    );
    let none = Panorama::new(0, 0, Vec::new()).map_or("refused", |_| "taken");
    checks.chain([one, Check::fact("0 × 0", "refused", none)]).collect()
}

fn black(_: Effort) -> Vec<Check> {
    let black = || Environment::constant(Vec3::ZERO);
    let lamp = |sky: Option<Environment>| {
        let mut build = floor(black());
        build.0.environment = sky;
        build
            .0
            .luminaires
            .push(Luminaire::Point { position: Vec3::new(0.2, 1.5, 0.1), intensity: Light::both(Vec3::ONE) });
        build.finish()
    };
    let dark_picture = Environment::new(
        "a black picture",
        Panorama::of_texels(8, 4, vec![Vec3::ZERO; 32]),
        1.0,
        Mat3::IDENTITY,
        Background::Same,
    );
    let dimmed =
        Environment::new("dimmed", Panorama::constant(Vec3::ONE), 0.0, Mat3::IDENTITY, Background::Same);
    let mut checks: Vec<Check> = [("a colour", black()), ("a picture", dark_picture), ("strength 0", dimmed)]
        .into_iter()
        .map(|(what, sky)| finite(what, false, floor(sky).finish(), film(16, 16, 1000), 2))
        .collect();
    checks.push(same("beside a lamp", lamp(Some(black())), lamp(None)));
    checks
}

/// Whether two scenes give the same bits.
fn same(what: &str, a: Scene, b: Scene) -> Check {
    let pictures = [a, b].map(|scene| picture(scene).map_err(|why| Check::fact(what, "an image", why)));
    match pictures {
        [Ok(a), Ok(b)] => Check::fact(what, "the same bits", compare(&a, &b)),
        [Err(why), _] | [_, Err(why)] => why,
    }
}

fn picture(scene: Scene) -> Result<Film, String> {
    Ok(rendered(scene, film(24, 24, 5000), 8)?.film().clone())
}

/// An open corner with a block in it.
fn corner(scale: f32) -> Build {
    let camera = look(scale * Vec3::new(1.5, 1.2, 1.8), scale * Vec3::new(0.3, 0.2, 0.3), 0.6);
    let mut build = Build::new(Illumination::GLOBAL, camera);
    let wall = build.material("Wall", diffuse(0.7));
    let (x, y, z) = (scale * Vec3::X, scale * Vec3::Y, scale * Vec3::Z);
    for [a, b] in [[z, x], [x, y], [y, z]] {
        build.quad(Vec3::ZERO, a, b, wall);
    }
    build.level(scale * 0.25, scale * 0.3, true, wall);
    build
}

/// The same in daylight that is turned by so many degrees.
fn in_daylight(scale: f32, rotation: f32) -> Result<Scene, String> {
    let sky = Sky::new(35.0, 3.0, 250.0).map(Source::Sky)?;
    let around = Surroundings {
        source: Some(Around::Source(sky)),
        rotation: Some(rotation),
        ..Surroundings::default()
    };
    let mut scene = corner(scale).finish();
    scene.put_into(&around, None).map_err(|why| why.to_string())?;
    Ok(scene)
}

fn turned(_: Effort) -> Vec<Check> {
    let turns = [(0.0, 360.0), (0.0, -360.0), (33.0, 393.0), (-90.0, 270.0), (0.0, 36000.0)];
    let mut checks: Vec<Check> = turns
        .into_iter()
        .map(|(one, other)| {
            let what = format!("{one}° and {other}°");
            match [in_daylight(1.0, one), in_daylight(1.0, other)] {
                [Ok(a), Ok(b)] => same(&what, a, b),
                [Err(why), _] | [_, Err(why)] => Check::fact(what, "a sky", why),
            }
        })
        .collect();
    let other = [in_daylight(1.0, 0.0), in_daylight(1.0, 90.0)].map(|scene| scene.and_then(picture));
    let got = match &other {
        [Ok(a), Ok(b)] if compare(a, b) == "the same bits" => "the same picture",
        _ => "another picture",
    };
    checks.push(Check::fact("0° and 90°", "another picture", got));
    checks
}

fn scaled(_: Effort) -> Vec<Check> {
    let shown = |scale: f32| -> Result<Film, String> {
        Ok(rendered(in_daylight(scale, 0.0)?, film(24, 24, 5000), 24)?.film().clone())
    };
    let one = match shown(1.0) {
        Ok(one) => one,
        Err(why) => return vec![Check::fact("scale 1", "an image", why)],
    };
    let powers_of_two = [-13, 13].map(|e| (2.0_f32.powi(e), "the same bits"));
    let others = [1e-4, 1e-2, 1e2, 1e4].map(|scale| (scale, "the same within noise"));
    let compared = |(scale, expected): (f32, &str)| {
        let got = shown(scale).map_or_else(|why| why, |picture| compare(&picture, &one));
        Check::fact(format!("scale {scale:e}"), expected, got)
    };
    powers_of_two.into_iter().chain(others).map(compared).collect()
}

/// A floor in a glTF file that lies at x, in daylight.
fn far_floor(x: f64) -> serde_json::Value {
    let mut file = far_file(x);
    file["scenes"][0]["extras"] = json!({ "environment": "sky:elevation=35", "environment-rotation": 20 });
    // Without its lamp.
    file["nodes"][0]["children"] = json!([1, 2]);
    file
}

fn far_away(_: Effort) -> Vec<Check> {
    far_from_home(&[1e6, -1e6], far_floor)
}
