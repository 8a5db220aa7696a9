//! `--denoise`: a layer of its own beside a picture that stays as it is.

use crate::files::{done, refused};
use halflight::film::{Image, Layer, read_exr};
use std::fs;
use std::path::Path;

const DENOISED: &str = "denoised";
const SCENE: &str = "builtin:cornell-spheres --size 32x32 --photons 3000";

fn picture(folder: &Path, name: &str) -> Image {
    read_exr(&folder.join(name)).expect("a picture")
}

#[test]
fn a_denoised_layer_stands_beside_the_picture_and_is_what_the_preview_shows() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    done(here, &format!("render {SCENE} --passes 8 -o plain.exr"));
    done(here, &format!("render {SCENE} --passes 8 --denoise -o a.exr"));
    let (plain, a) = (picture(here, "plain.exr"), picture(here, "a.exr"));
    assert_eq!(plain.layer_names(), "visible, error");
    assert_eq!(a.layers.len(), 3, "{}", a.layer_names());
    for layer in ["visible", "error"] {
        assert!(plain.layer(layer) == a.layer(layer), "{layer} is another");
    }
    let denoised = a.layer("denoised").expect("a denoised layer");
    assert!(denoised != a.layer("visible").expect("the picture"));
    assert!(a.header.get("denoised").is_some_and(|fact| fact.to_string().contains("bilateral")));
    assert!(plain.header.get("denoised").is_none());
    let png = |name: &str| fs::read(here.join(name)).expect("a preview");
    assert_ne!(png("plain.png"), png("a.png"));
    done(here, &format!("render {SCENE} --passes 8 --denoise -o alone.png"));
    done(here, &format!("render {SCENE} --passes 8 --denoise -o linear.pfm"));
    assert_eq!(png("alone.png"), png("a.png"));
    let linear = png("linear.pfm");
    let last = &linear[linear.len() - 12 * 32..];
    let first: Vec<f32> = last.chunks(4).map(|x| f32::from_le_bytes(x.try_into().expect("four"))).collect();
    assert_eq!(first, denoised[..32].iter().flat_map(glam::Vec3::to_array).collect::<Vec<_>>());
}

#[test]
fn layers_that_are_asked_for_are_written_with_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    done(
        here,
        &format!(
            "render {SCENE} --passes 4 --denoise --layers depth,denoising-normal --cryptomatte -o a.exr"
        ),
    );
    let a = picture(here, "a.exr");
    for layer in ["visible", "depth", "denoising-normal", "denoised", "CryptoObject00"] {
        assert!(a.layer(layer).is_some(), "{layer} of {}", a.layer_names());
    }
    assert!(a.layer("denoising-albedo").is_none() && a.layer("error").is_none());
}

#[test]
fn it_is_the_same_of_states_that_are_gone_on_from_and_of_shards_that_are_merged() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let denoised = |name: &str| picture(here, name).layer(DENOISED).map(<[_]>::to_vec).expect("a layer");
    let render = format!("render {SCENE} --denoise --passes 6");
    done(here, &format!("{render} -o whole.exr"));
    done(here, &format!("render {SCENE} --denoise --passes 3 --checkpoint 60s -o on.exr"));
    done(here, &format!("{render} --resume --threads 1 -o on.exr"));
    assert!(denoised("on.exr") == denoised("whole.exr"));
    done(here, &format!("{render} --resume -o on.exr"));
    assert!(denoised("on.exr") == denoised("whole.exr"), "a render that was complete");
    for which in 1..=2 {
        done(here, &format!("{render} --shard {which}/2 -o {which}.exr"));
    }
    done(here, "merge 1.halflight 2.halflight --denoise -o merged.exr");
    assert!(denoised("merged.exr") == denoised("whole.exr"));
    done(here, "merge 1.halflight 2.halflight -o plain.exr");
    let plain = picture(here, "plain.exr");
    assert!(
        plain.layer(DENOISED).is_none()
            && plain.layer("visible") == picture(here, "whole.exr").layer("visible")
    );
    refused(
        here,
        "merge 1.halflight 2.halflight --denoise -o sum.halflight",
        &["--denoise", "sum.halflight", "-o"],
    );
}

#[test]
fn states_that_do_not_tell_what_it_looks_at_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    done(here, &format!("render {SCENE} --passes 4 --checkpoint 60s -o a.exr"));
    let words = ["a.halflight", "denoising-albedo", "--denoise"];
    for passes in [4, 6] {
        refused(here, &format!("render {SCENE} --passes {passes} --resume --denoise -o a.exr"), &words);
    }
    refused(here, "merge a.halflight --denoise -o m.exr", &words);
}

#[test]
fn what_has_nothing_to_denoise_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    refused(here, &format!("render {SCENE} --denoise --atlas -o a.exr"), &["--denoise", "--atlas"]);
    refused(here, "render --denoise --method path -o a.exr", &["--denoise", "--method photon"]);
    let told = crate::support::refused(&["compare", "--variant", "a: --denoise --method path"]);
    assert!(told.contains("--denoise") && told.contains("--method photon"), "{told}");
    let told = done(here, &format!("render {SCENE} --denoise --passes 2 -o few.exr"));
    assert!(told.contains("2 passes do not tell their error"), "{told}");
    let few = picture(here, "few.exr");
    assert!(few.layer(DENOISED) == few.layer(Layer::Visible.name()));
    assert!(few.header.get(DENOISED).is_some_and(|fact| fact.to_string().contains("too few")));
}
