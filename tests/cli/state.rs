//! Renders that are stored, killed, resumed, dealt out to many and merged: the same picture, bit for bit.

use crate::files::{done, refused, scene, triangle};
use crate::{halflight, said};
use halflight::film::{Value, read_exr};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const ATLAS: &str =
    "builtin:cornell-spheres --atlas --size 16x16 --photons 1000 --max-reflections 6 --layers visible,error";
const SCENE: &str = "builtin:cornell-spheres --size 24x20 --photons 3000 --layers all";

fn planes(folder: &Path, name: &str) -> Vec<(String, Vec<[u32; 3]>)> {
    let image = read_exr(&folder.join(name)).expect("a picture");
    let bits = |plane: &Vec<glam::Vec3>| plane.iter().map(|v| v.to_array().map(f32::to_bits)).collect();
    image.layers.iter().map(|(name, plane)| (name.clone(), bits(plane))).collect()
}

#[track_caller]
fn equal(folder: &Path, a: &str, b: &str) {
    assert!(planes(folder, a) == planes(folder, b), "{a} and {b} are different pictures");
}

fn fact(folder: &Path, name: &str, fact: &str) -> Option<f64> {
    read_exr(&folder.join(name)).expect("a picture").header.get(fact).and_then(Value::as_real)
}

/// What lies about that a render should have removed.
fn leftovers(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    names.filter_map(|name| name.into_string().ok()).filter(|name| name.ends_with(".part")).collect()
}

#[test]
fn shards_merged_in_any_order_are_the_single_render_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    done(here, &format!("render {SCENE} --passes 12 -o whole.exr"));
    assert!(!here.join("whole.halflight").exists(), "a state that nobody asked for");
    for (of, order) in [(2, vec![2, 1]), (3, vec![3, 1, 2]), (7, vec![4, 7, 1, 2, 6, 3, 5])] {
        for which in 1..=of {
            let threads = 1 + which % 3;
            done(
                here,
                &format!(
                    "render {SCENE} --passes 12 --shard {which}/{of} --threads {threads} -o {of}-{which}.exr"
                ),
            );
        }
        let states: Vec<String> = order.iter().map(|which| format!("{of}-{which}.halflight")).collect();
        let told = done(here, &format!("merge {} -o merged.exr", states.join(" ")));
        assert!(told.contains("12 passes (0..12)"), "{told}");
        equal(here, "whole.exr", "merged.exr");
        assert!(
            fs::read(here.join("whole.png")).expect("a preview")
                == fs::read(here.join("merged.png")).expect("one")
        );
        for name in ["passes", "photons", "paths_per_pass", "k", "scene_hash"] {
            assert_eq!(fact(here, "whole.exr", name), fact(here, "merged.exr", name), "{name}");
        }
        // As a tree, by way of a state.
        done(here, &format!("merge {} -o some.halflight", states[1..].join(" ")));
        done(here, &format!("merge some.halflight {} -o tree.exr", states[0]));
        equal(here, "whole.exr", "tree.exr");
    }
    done(here, &format!("render {SCENE} --passes 0..5 -o 1.exr"));
    done(here, &format!("render {SCENE} --passes 5..12 -o 2.exr"));
    done(here, "merge 2.halflight 1.halflight -o merged.exr");
    equal(here, "whole.exr", "merged.exr");
}

#[test]
fn a_render_resumed_or_extended_is_the_single_render_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    done(here, &format!("render {SCENE} --passes 9 -o whole.exr"));
    done(here, &format!("render {SCENE} --passes 2 --checkpoint 60s -o a.exr"));
    let told = done(here, &format!("render {SCENE} --passes 5 --resume -o a.exr"));
    assert!(told.contains("going on from 2 passes (0..2) in a.halflight"), "{told}");
    let told = done(here, &format!("render {SCENE} --passes 9 --extend -o a.exr"));
    assert!(told.contains("going on from 5 passes"), "{told}");
    equal(here, "whole.exr", "a.exr");
    // What is complete is complete at once, and its picture is there again.
    fs::remove_file(here.join("a.exr")).expect("there");
    let begin = Instant::now();
    let told = done(here, &format!("render {SCENE} --passes 9 --resume -o a.exr"));
    assert!(told.contains("complete: the state has all 9 passes"), "{told}");
    assert!(begin.elapsed() < Duration::from_secs(20));
    equal(here, "whole.exr", "a.exr");
    // A smaller error; a state of shards that lacks some.
    done(here, &format!("render {SCENE} --error 0.5 --extend -o a.exr"));
    done(here, &format!("render {SCENE} --passes 9 --shard 2/3 -o b.exr"));
    done(here, &format!("render {SCENE} --passes 9 --resume -o b.exr"));
    equal(here, "whole.exr", "b.exr");
}

#[test]
fn the_path_tracer_is_dealt_out_as_well() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let render = "render builtin:two-spheres --method path --samples 2 --size 16x16 --passes 6";
    done(here, &format!("{render} -o whole.exr"));
    done(here, &format!("{render} --shard 1/2 -o 1.exr"));
    done(here, &format!("{render} --shard 2/2 -o 2.exr"));
    done(here, "merge 1.halflight 2.halflight -o merged.exr");
    equal(here, "whole.exr", "merged.exr");
}

#[test]
fn the_textbooks_photon_map_is_dealt_out_and_resumed_as_well() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let render =
        "render builtin:caustic-box --method nearest --nearest 20 --cone inf --photons 2000 --size 16x16";
    let layers = "--layers visible,invisible,error,direct,caustic,indirect";
    done(here, &format!("{render} {layers} --passes 6 -o whole.exr"));
    done(here, &format!("{render} {layers} --passes 6 --shard 1/2 --threads 1 -o 1.exr"));
    done(here, &format!("{render} {layers} --passes 6 --shard 2/2 --threads 2 -o 2.exr"));
    done(here, "merge 2.halflight 1.halflight -o merged.exr");
    equal(here, "whole.exr", "merged.exr");
    done(here, &format!("{render} {layers} --passes 2 --checkpoint 60s -o a.exr"));
    done(here, &format!("{render} {layers} --passes 6 --extend -o a.exr"));
    equal(here, "whole.exr", "a.exr");
    let header = read_exr(&here.join("whole.exr")).expect("a picture").header;
    assert_eq!(header.get("bias").map(ToString::to_string).as_deref(), Some("not told"));
    let fewer = render.replace("--nearest 20", "--nearest 19");
    refused(here, &format!("{fewer} {layers} --passes 9 --extend -o a.exr"), &["--nearest"]);
}

#[test]
fn what_does_not_belong_together_is_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let small = "--size 16x16 --photons 500";
    done(here, &format!("render {small} --passes 4 --shard 1/2 -o a.exr"));
    done(here, &format!("render {small} --passes 2..4 -o b.exr"));
    done(here, &format!("render {small} --passes 4 --shard 2/2 --seed 1 -o c.exr"));
    done(here, &format!("render builtin:cornell-spheres {small} --passes 4 --shard 2/2 -o d.exr"));
    done(here, &format!("render {small} --passes 4 --shard 2/2 --layers visible,depth -o e.exr"));
    refused(
        here,
        "merge a.halflight b.halflight -o m.exr",
        &["b.halflight", "a.halflight", "pass 2 is in both"],
    );
    refused(here, "merge a.halflight a.halflight -o m.exr", &["pass 0 is in both"]);
    refused(here, "merge a.halflight c.halflight -o m.exr", &["c.halflight", "--seed: 1 there, 0 here"]);
    refused(here, "merge a.halflight d.halflight -o m.exr", &["d.halflight", "scene: "]);
    refused(here, "merge a.halflight e.halflight -o m.exr", &["e.halflight", "layers: visible,depth there"]);
    refused(here, "merge a.halflight nothing.halflight -o m.exr", &["nothing.halflight"]);
    refused(here, "merge a.halflight a.exr -o m.exr", &["a.exr", "did not write it as one"]);
    refused(here, "merge a.halflight -o a.halflight", &["a.halflight", "it is read"]);
    refused(here, "merge a.halflight -o m.tif", &["m.tif", ".exr"]);
    // Nor is a render gone on with as another.
    refused(
        here,
        &format!("render {small} --passes 4 --seed 2 --resume -o a.exr"),
        &["a.halflight", "--seed: 0 there, 2 here"],
    );
    refused(here, &format!("render {small} --passes 4 --shard 2/2 -o a.exr"), &["a.halflight", "pass 0"]);
    refused(here, &format!("render {small} --passes 4 --extend -o f.exr"), &["f.halflight", "--resume"]);
    refused(
        here,
        &format!("render {small} --passes 2 --shard 3/3 -o f.exr"),
        &["--shard 3/3", "fewer shards"],
    );
    refused(here, &format!("render {small} --resume -o /dev/null"), &["/dev/null", "device"]);
}

#[test]
fn an_atlas_resumed_or_extended_is_the_single_render_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    done(here, &format!("render {ATLAS} --passes 40 -o whole.exr"));
    assert!(planes(here, "whole.exr").iter().any(|(name, _)| name.starts_with("atlas_error")));
    // Between any two groups of passes: one by one, by two, by four.
    done(here, &format!("render {ATLAS} --passes 5 --checkpoint 60s --threads 1 -o a.exr"));
    let told = done(here, &format!("render {ATLAS} --passes 12 --resume --threads 2 -o a.exr"));
    assert!(told.contains("going on from 5 passes (0..5) in a.halflight"), "{told}");
    done(here, &format!("render {ATLAS} --passes 20 --extend -o a.exr"));
    done(here, &format!("render {ATLAS} --passes 40 --extend -o a.exr"));
    equal(here, "whole.exr", "a.exr");
    // What is complete is complete at once, and its picture is there again, with all that is said of it.
    fs::remove_file(here.join("a.exr")).expect("there");
    let told = done(here, &format!("render {ATLAS} --passes 40 --resume -o a.exr"));
    assert!(told.contains("complete: the state has all 40 passes"), "{told}");
    equal(here, "whole.exr", "a.exr");
    let facts = |name: &str| {
        let header = read_exr(&here.join(name)).expect("a picture").header;
        let lasting = header.entries.into_iter().filter(|(name, _)| name != "seconds");
        lasting.map(|(name, value)| (name, value.to_string())).collect::<std::collections::BTreeMap<_, _>>()
    };
    assert_eq!(facts("whole.exr"), facts("a.exr"));
    done(here, "mix a.exr --at 0.5,0.5 -o mixed.exr");
    // A bit that is lost is seen: one pass fewer, one that was counted twice.
    done(here, &format!("render {ATLAS} --passes 39 -o fewer.exr"));
    assert!(planes(here, "whole.exr") != planes(here, "fewer.exr"));
    // Nobody asked for a state, which is as large as the picture.
    assert!(!here.join("whole.halflight").exists());
    let sizes = ["a.halflight", "a.exr"].map(|name| fs::metadata(here.join(name)).expect("there").len());
    assert!(sizes[0] < 3 * sizes[1], "{sizes:?}");
}

#[test]
fn an_atlas_goes_on_from_its_own_state_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    done(here, &format!("render {ATLAS} --passes 4 --checkpoint 60s -o a.exr"));
    let plain = ATLAS.replace(" --atlas", "");
    done(here, &format!("render {plain} --passes 4 --checkpoint 60s -o b.exr"));
    refused(
        here,
        &format!("render {ATLAS} --passes 8 --resume -o b.exr"),
        &["b.halflight", "--atlas: false"],
    );
    refused(here, &format!("render {plain} --passes 8 --resume -o a.exr"), &["a.halflight", "--atlas: true"]);
    for (other, word) in [
        (format!("{ATLAS} --illumination 0.5,0.25"), "scene: "),
        (ATLAS.replace("--max-reflections 6", "--max-reflections 7"), "--max-reflections: 6 there, 7 here"),
        (format!("{ATLAS} --seed 3"), "--seed: 0 there, 3 here"),
    ] {
        refused(here, &format!("render {other} --passes 8 --resume -o a.exr"), &["a.halflight", word]);
    }
    // Sums that depend on the order of passes are neither dealt out nor added up.
    for dealt in ["--shard 1/2 --passes 8", "--passes 4..8"] {
        refused(here, &format!("render {ATLAS} {dealt} -o c.exr"), &["--atlas", "--shard", "order"]);
    }
    refused(here, "merge a.halflight -o m.exr", &["a.halflight", "order of its passes"]);
    refused(here, "merge b.halflight a.halflight -o m.exr", &["a.halflight", "order of its passes"]);
    refused(here, &format!("render {ATLAS} --resume -o /dev/null"), &["/dev/null", "device"]);
    // Damaged, in the film and behind it.
    let state = here.join("a.halflight");
    let good = fs::read(&state).expect("a state");
    let all = good.len();
    for (end, flipped) in
        [(100, 40), (all / 2, all / 3), (all - 1, all / 2), (all - 9, all - 1), (all - 5000, all - 100)]
    {
        let mut bad = good.clone();
        bad[flipped] ^= 4;
        for bytes in [&bad[..], &good[..end], &[&good[..], &[0]].concat()] {
            fs::write(&state, bytes).expect("written");
            // What is complete needs no plan, and what goes on needs one first.
            let passes = if end == all - 5000 { &[4, 8][..] } else { &[4] };
            for passes in passes {
                let render = format!("render {ATLAS} --passes {passes} --resume -q -o a.exr");
                refused(here, &render, &["a.halflight", "no state to go on from"]);
            }
        }
    }
}

#[test]
fn damaged_states_are_refused_in_a_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let render = "render --size 16x16 --photons 500 --passes 2 -o a.exr";
    done(here, &format!("{render} --checkpoint 1m"));
    let state = here.join("a.halflight");
    let good = fs::read(&state).expect("a state");
    for (end, flipped) in
        [(0, 40), (10, 3), (300, 17), (good.len() - 1, 700), (good.len() / 2, good.len() - 1)]
    {
        let mut bad = good.clone();
        bad[flipped] ^= 4;
        fs::write(&state, bad).expect("written");
        refused(here, "merge a.halflight -o m.exr", &["a.halflight", "no state to go on from"]);
        fs::write(&state, &good[..end]).expect("written");
        refused(here, "merge a.halflight -o m.exr", &["a.halflight", "no state to go on from"]);
        // Without its first bytes it might be anybody's.
        if end > 16 {
            refused(here, &format!("{render} --resume"), &["a.halflight", "no state to go on from"]);
        }
    }
}

#[cfg(unix)]
mod killed {
    use super::*;
    use halflight::atlas::AtlasSums;
    use halflight::film::{Film, StateFile};
    use std::io::Read;
    use std::os::unix::process::ExitStatusExt;
    use std::process::Child;

    fn command(folder: &Path, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_halflight"));
        command.current_dir(folder).args(arguments.split_whitespace()).stderr(Stdio::piped());
        command
    }

    /// Kills renders at moments that are spread over their lives, until one completes.
    fn kill_nine(kills: u32) {
        let passes = 40 + 4 * kills;
        let begun = |_: &mut Child| {};
        killed(kills, &format!("render {SCENE} --passes {passes}"), begun, |here| {
            done(here, "merge a.halflight -o now.exr");
            fact(here, "now.exr", "passes").expect("passes")
        });
    }

    /// The same with an atlas, whose planning takes longer than many passes: in three of four the first is waited for.
    fn kill_an_atlas(kills: u32) {
        let passes = 40 + 20 * kills;
        let mut turn = 0;
        let begun = |child: &mut Child| {
            turn += 1;
            if turn % 4 > 0 {
                let mut byte = [0];
                // None: it ended before.
                child.stderr.as_mut().expect("a pipe").read_exact(&mut byte).ok();
            }
        };
        let render = format!("render {ATLAS} --passes {passes} --quiet --progress json");
        killed(kills, &render, begun, |here| {
            let state = StateFile::open(&here.join("a.halflight")).expect("a state");
            let head = state.head().clone();
            let mut film = Film::new(head.width, head.height, &head.layers);
            let atlas = state.add_to_and_leave(&mut film).and_then(AtlasSums::of_annex).expect("an atlas");
            assert_eq!(atlas.passes(), film.passes());
            film.passes().into()
        });
    }

    /// The same for a render; `begun` waits until one lives long enough, and `load` loads a state and tells its passes.
    fn killed(kills: u32, render: &str, mut begun: impl FnMut(&mut Child), load: impl Fn(&Path) -> f64) {
        let folder = tempfile::tempdir().expect("a folder");
        let here = folder.path();
        done(here, &format!("{render} -o whole.exr"));
        let (mut killed, mut most) = (0, 0.0);
        let mut wait = 0.05;
        while killed < kills {
            let mut child = command(here, &format!("{render} --checkpoint 10ms --resume -o a.exr"))
                .spawn()
                .expect("it starts");
            begun(&mut child);
            std::thread::sleep(Duration::from_secs_f64(wait));
            child.kill().expect("killed");
            let output = child.wait_with_output().expect("it ends");
            if output.status.success() {
                // It was faster; begin again.
                for name in ["a.exr", "a.png", "a.halflight"] {
                    fs::remove_file(here.join(name)).expect("there");
                }
                most = 0.0;
            } else {
                assert_eq!(output.status.signal(), Some(9), "{}", said(&output));
                killed += 1;
            }
            if here.join("a.halflight").exists() {
                let now = load(here);
                assert!(now >= most, "{now} passes after {most}");
                most = now;
            }
            // Golden steps: moments of all kinds.
            wait = 0.02 + (wait + 0.618 * 0.6) % 0.6;
        }
        done(here, &format!("{render} --resume -o a.exr"));
        equal(here, "whole.exr", "a.exr");
        assert_eq!(leftovers(here), Vec::<String>::new());
    }

    #[test]
    fn a_render_that_is_killed_ten_times_is_the_single_render_bit_for_bit() {
        kill_nine(10);
    }

    #[test]
    fn an_atlas_that_is_killed_five_times_is_the_single_render_bit_for_bit() {
        kill_an_atlas(5);
    }

    #[test]
    #[ignore = "takes some minutes"]
    fn a_render_that_is_killed_a_hundred_times_is_the_single_render_bit_for_bit() {
        kill_nine(110);
        kill_an_atlas(110);
    }

    #[test]
    fn engines_are_told_by_exit_codes_what_to_do() {
        let folder = tempfile::tempdir().expect("a folder");
        let here = folder.path();
        let endless = format!("render {SCENE} --passes 100000 -o a.exr");
        for more in ["--checkpoint 1m", "--resume", "--shard 1/2", "--passes 0..100000", "--atlas"] {
            let endless = match more {
                "--passes 0..100000" => endless.replace("--passes 100000", ""),
                "--atlas" => format!("render {ATLAS} --passes 100000 -o a.exr").replace("--atlas", ""),
                _ => endless.clone(),
            };
            let output = halflight(here, &format!("{endless} {more} --stop-after 5s"));
            assert_eq!(output.status.code(), Some(85), "{more}: {}", said(&output));
            assert!(fact(here, "a.exr", "passes").expect("passes") >= 1.0);
            fs::remove_file(here.join("a.halflight")).expect("a state");
        }
        for signal in ["-TERM", "-INT"] {
            let mut child = command(here, &format!("{endless} --resume --progress json --quiet"))
                .spawn()
                .expect("it starts");
            let mut lines = std::io::BufReader::new(child.stderr.take().expect("a pipe"));
            let mut line = String::new();
            std::io::BufRead::read_line(&mut lines, &mut line).expect("a line");
            let json: serde_json::Value = serde_json::from_str(&line).expect("JSON");
            assert!(json["pass"].as_u64().expect("a number") >= 1 && json["seconds"].is_f64(), "{line}");
            assert!(["error", "bias", "eta"].iter().all(|name| json.get(name).is_some()), "{line}");
            Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
            lines.read_to_string(&mut line).expect("text");
            assert_eq!(child.wait().expect("it ends").code(), Some(85), "{line}");
        }
        // Planning may take all of --time, and the first pass is completed all the same.
        let late = halflight(here, "render --size 16x16 --photons 500 --time 1ms --checkpoint 1m -o c.exr");
        assert!(late.status.success() && here.join("c.halflight").exists(), "{}", said(&late));
        // Not one pass: to try again would end no better.
        let huge =
            "render builtin:cornell-spheres --photons 100000000 --passes 1 --stop-after 300ms -o b.exr";
        let output = halflight(here, huge);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains("not one pass was complete"), "{}", said(&output));
    }

    #[test]
    fn places_that_cannot_take_a_state_are_refused_before_the_render() {
        let folder = tempfile::tempdir().expect("a folder");
        let here = folder.path();
        let small = "--size 16x16 --photons 500 --passes 2 --resume";
        fs::write(here.join("a.halflight"), b"of another program").expect("written");
        refused(here, &format!("render {small} -o a.exr"), &["a.halflight", "--overwrite"]);
        fs::create_dir(here.join("b.halflight")).expect("a folder");
        refused(here, &format!("render {small} -o b.exr"), &["b.halflight", "folder"]);
        let fifo = Command::new("mkfifo").arg(here.join("c.halflight")).status().expect("mkfifo");
        assert!(fifo.success());
        refused(here, &format!("render {small} -o c.exr"), &["c.halflight", "pipe"]);
        refused(here, "merge c.halflight -o m.exr", &["c.halflight"]);
        fs::create_dir(here.join("c")).expect("a folder");
        for (pipe, place) in [("c.exr", "picture"), ("c/compare.json", "page")] {
            let fifo = Command::new("mkfifo").arg(here.join(pipe)).status().expect("mkfifo");
            assert!(fifo.success(), "{place}");
        }
        let pipe = &["c.exr", "is no file (a folder, a pipe or a device)"];
        for reads in [
            "diff c.exr c.exr",
            "mix c.exr --at 0,0 -o m.exr",
            "view c.exr -o m.html",
            "compare --reference c.exr -o d",
        ] {
            refused(here, reads, pipe);
        }
        refused(here, "compare -o c", &["c/compare.json", "pipe"]);
        refused(here, "compare -o c.exr", &["c.exr", "no folder"]);
        std::os::unix::fs::symlink("/dev/full", here.join("f.halflight")).expect("a link");
        refused(here, &format!("render {small} -o f.exr"), &["f.halflight", "device"]);
        // The scene itself, by a link.
        fs::write(here.join("s.gltf"), scene("b.bin", "t.png", 10.0)).expect("written");
        fs::write(here.join("b.bin"), triangle()).expect("written");
        std::os::unix::fs::symlink("s.gltf", here.join("d.halflight")).expect("a link");
        refused(
            here,
            &format!("render s.gltf {small} --illumination local -o d.exr"),
            &["d.halflight", "it is read"],
        );
        // A link to elsewhere is followed.
        fs::create_dir(here.join("store")).expect("a folder");
        std::os::unix::fs::symlink("store/e.halflight", here.join("e.halflight")).expect("a link");
        done(here, &format!("render {small} -o e.exr"));
        assert!(here.join("store/e.halflight").exists());
        assert!(fs::symlink_metadata(here.join("e.halflight")).expect("there").is_symlink());
        assert_eq!(leftovers(here), Vec::<String>::new());
    }

    #[test]
    fn a_state_that_cannot_be_stored_keeps_the_old_one_and_the_render_goes_on() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let here = folder.path();
        let render = "render builtin:cornell-spheres --size 24x20 --photons 2000 -o a.exr";
        done(here, &format!("{render} --passes 2 --checkpoint 1m"));
        let before = fs::read(here.join("a.halflight")).expect("a state");
        fs::set_permissions(here.join("a.halflight"), fs::Permissions::from_mode(0o444)).expect("read-only");
        let output = halflight(here, &format!("{render} --passes 4 --resume"));
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains("read-only"), "{}", said(&output));
        assert!(fs::read(here.join("a.halflight")).expect("a state") == before);
    }
}

#[test]
fn threads_that_cannot_be_meant_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for command in ["render", "compare"] {
        for threads in ["0", "1025", "65535", "100000"] {
            let output = halflight(folder.path(), &format!("{command} --threads {threads}"));
            assert_eq!(output.status.code(), Some(2), "{}", said(&output));
            assert!(said(&output).contains("give 1 to 1024"), "{}", said(&output));
        }
    }
}

#[test]
fn comparisons_that_take_too_much_memory_are_refused_before_they_begin() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = halflight(folder.path(), "compare builtin:cornell-spheres --size 65536x65536 -q -o c");
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    for part in ["20 runs side by side take about", "GB of memory and", "fewer seeds"] {
        assert!(said(&output).contains(part), "{}", said(&output));
    }
}

#[test]
fn memory_that_may_not_be_taken_is_refused_before_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    refused(
        folder.path(),
        "render --size 4000x4000 --memory 500MB -o a.exr",
        &["GB of memory and --memory allows 500.0 MB"],
    );
    // Mattes take some beside the sums: 96 bytes a pixel.
    let mattes = "render --size 1000x1000 --memory 350MB --cryptomatte -o a.exr";
    refused(folder.path(), mattes, &["MB of memory and --memory allows 350.0 MB"]);
    let huge = halflight(folder.path(), "render --size 100000x100000 -o a.exr");
    assert!(huge.status.code() == Some(2) && said(&huge).contains("1 to 65536 pixels"), "{}", said(&huge));
    let enough = "render --size 16x16 --photons 500 --passes 1 --memory 500MB -o a.exr";
    assert!(halflight(folder.path(), enough).status.success());
}
