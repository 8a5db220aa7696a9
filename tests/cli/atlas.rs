//! The atlas from the command line: `render --atlas`, `mix`, and the page of `view` in a real browser.

use crate::browser::chromium;
use crate::page::open;
use crate::support::skipped;
use crate::{halflight, said};
use halflight::film::{Image, read_exr, srgb_encode};
use std::path::Path;

fn done(folder: &Path, arguments: &str) {
    let output = halflight(folder, arguments);
    assert!(output.status.success(), "{arguments}: {}", said(&output));
}

fn picture(folder: &Path, name: &str) -> Image {
    read_exr(&folder.join(name)).expect("a picture")
}

#[test]
fn mix_makes_the_picture_of_any_point() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    done(
        folder,
        "render builtin:cornell-spheres --atlas --size 40x40 --photons 20000 --passes 4 -o atlas.exr",
    );
    done(folder, "mix atlas.exr --at global -o global.exr");
    done(folder, "mix atlas.exr --at 0.5,0.25 -o between.exr");
    let (atlas, global, between) =
        (picture(folder, "atlas.exr"), picture(folder, "global.exr"), picture(folder, "between.exr"));
    // What is rendered beside the atlas is the global picture, unless something else is asked for.
    let (own, mixed) = (atlas.layer("visible").expect("light"), global.layer("visible").expect("light"));
    let off = own.iter().zip(mixed).map(|(a, b)| (*a - *b).abs().max_element() / a.max_element().max(0.01));
    assert!(off.fold(0.0, f32::max) < 1e-3);
    assert!(own.iter().any(|rgb| rgb.x > 0.0) && between.layer("visible") != global.layer("visible"));
    assert!(between.layer("error").expect("errors").iter().all(|rgb| rgb.is_finite()));
    let fact = |name: &str| between.header.get(name).map(ToString::to_string);
    assert_eq!(fact("illumination").as_deref(), Some("0.5,0.25"));
    assert_eq!(fact("passes").as_deref(), Some("4"));
    assert!(folder.join("between.png").exists());
}

#[test]
fn what_cannot_be_mixed_is_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    done(folder, "render builtin:cornell-spheres --size 16x16 --photons 1000 --passes 2 -o plain.exr");
    let scene = "builtin:concentric?albedo=0.95";
    done(
        folder,
        &format!("render {scene} --illumination local --atlas --size 8x8 --photons 500 --passes 2 -o a.exr"),
    );
    for (arguments, code, words) in [
        ("mix plain.exr --at global", 2, "--atlas"),
        ("view plain.exr", 2, "--atlas"),
        ("mix a.exr --at 0.5,1.5", 2, "0.5,1.5"),
        ("mix a.exr --at whitted", 2, "whitted"),
        ("mix nowhere.exr --at 0,0", 2, "nowhere.exr"),
        ("view a.exr --megabytes 0", 2, "--megabytes"),
        ("mix a.exr --at shadowless", 3, "up to s = 0.8"),
        ("render builtin:cornell-spheres --atlas --method path", 2, "photon"),
        ("render builtin:cornell-spheres --atlas --layers invisible", 2, "invisible"),
        ("render builtin:cornell-spheres --atlas --keep-everything", 2, "--keep-everything"),
        ("render builtin:cornell-spheres --atlas --set *=local", 2, "follows"),
        ("render builtin:concentric?albedo=0.95 --atlas", 3, "up to s = 0.8"),
    ] {
        let output = halflight(folder, arguments);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments}: {said}");
        assert!(said.trim_end().lines().count() == 1 && said.contains(words), "{arguments}: {said}");
    }
    done(folder, "mix a.exr --at 0.5,0.5");
}

#[test]
fn the_page_shows_what_mix_makes() {
    let Some(browser) = chromium() else {
        skipped("no Chromium here, so the square was not opened; install it or set CHROMIUM");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    done(
        folder,
        "render builtin:cornell-spheres --atlas --size 64x64 --photons 60000 --passes 6 -o atlas.exr",
    );
    done(folder, "view atlas.exr -o square.html");
    let page = folder.join("square.html");
    let webgl = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
    for (i, (s, t, x, y)) in [(0.6, 0.4, 20, 50), (0.25, 1.0, 40, 30), (1.0, 0.0, 12, 58)].iter().enumerate()
    {
        let at = format!("#s={s}&t={t}&x={x}&y={y}&exposure=1");
        let more: Vec<&str> = webgl.iter().copied().chain(["--dump-dom"]).collect();
        let dom = open(&browser, &page, &at, false, &more);
        let facts = dom.find("<html").map_or("", |at| &dom[at..at + dom[at..].find('>').unwrap_or(0)]);
        let fact = |name: &str| -> &str {
            let rest =
                facts.split(&format!("data-{name}=\"")).nth(1).unwrap_or_else(|| panic!("{name}: {facts}"));
            rest.split('"').next().unwrap_or("")
        };
        assert_eq!((fact("ready"), fact("errors"), fact("exists")), ("1", "0", "1"), "{facts}");
        assert_eq!(fact("drawer"), "webgl2", "{facts}");
        done(folder, &format!("mix atlas.exr --at {s},{t} -o {i}.exr"));
        let mixed = picture(folder, &format!("{i}.exr"));
        let pixel = y * 64 + x;
        let (light, error) = (mixed.layer("visible").expect("light"), mixed.layer("error").expect("errors"));
        let mean = light.iter().map(|rgb| rgb.element_sum()).sum::<f32>() / (3 * light.len()) as f32;
        let numbers = |name: &str| -> Vec<f32> {
            fact(name).split(' ').map(|x| x.parse().unwrap_or_else(|_| panic!("{name}: {facts}"))).collect()
        };
        for c in 0..3 {
            let (value, shown) = (numbers("value")[c], numbers("shown")[c]);
            let truth = light[pixel][c];
            assert!((value - truth).abs() < 0.01 * truth + 0.002 * mean, "{at}: {value} against {truth}");
            assert!(
                (shown - f32::from(srgb_encode(2.0 * value))).abs() <= 1.0,
                "{at}: {value} shown as {shown}"
            );
            // Pooled over cells of pixels: the same within a factor.
            let off = numbers("off")[c];
            assert!(
                off > 0.2 * error[pixel][c] && off < 8.0 * error[pixel][c],
                "{at}: ± {off}, not {}",
                error[pixel][c]
            );
        }
    }
    let shot = folder.join("square.png");
    let screenshot = format!("--screenshot={}", shot.display());
    open(&browser, &page, "", false, &[webgl[0], webgl[1], webgl[2], &screenshot]);
    let size = std::fs::metadata(&shot).expect("a screenshot").len();
    assert!(size > 20_000, "a screenshot of {size} bytes shows nothing");
}
