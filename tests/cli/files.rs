//! Where pictures go: files that are read are never overwritten, those of others not silently, and nothing hangs.

use crate::support::skipped;
use crate::{halflight, said};
use halflight::film::{Value, read_exr};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A triangle a metre across under a lamp of so many candela, its buffer and a texture in files.
pub fn scene(buffer: &str, texture: &str, candela: f64) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],
"nodes":[{{"mesh":0}},{{"translation":[0.3,0.3,1],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
"materials":[{{"pbrMetallicRoughness":{{"metallicFactor":0}}}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
"bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":"{buffer}"}}],
"images":[{{"uri":"{texture}"}}],"extensionsUsed":["KHR_lights_punctual"],
"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"point","intensity":{candela}}}]}}}}}}"#
    )
}

/// The positions of that triangle.
pub fn triangle() -> Vec<u8> {
    [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A folder with such a scene, `s.gltf`.
fn folder(buffer: &str, texture: &str, candela: f64) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let put = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("written");
    put("s.gltf", scene(buffer, texture, candela).as_bytes());
    put(buffer, &triangle());
    put(texture, b"a texture of somebody's");
    folder
}

const SMALL: &str = "--size 16x16 --passes 1 --illumination local";

#[track_caller]
pub fn done(folder: &Path, arguments: &str) -> String {
    let output = halflight(folder, arguments);
    assert!(output.status.success(), "{arguments}: {}", said(&output));
    said(&output)
}

/// One line, exit code 2, and no file of the folder is other than before.
#[track_caller]
pub fn refused(folder: &Path, arguments: &str, words: &[&str]) {
    let state = || {
        let files = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("a file").path());
        let mut all: Vec<_> =
            files.map(|path| (path.is_file().then(|| fs::read(&path).ok()), path)).collect();
        all.sort();
        all
    };
    let before = state();
    let output = halflight(folder, arguments);
    let said = said(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
    assert_eq!(said.lines().count(), 1, "{arguments}: {said}");
    assert!(words.iter().all(|word| said.contains(word)), "{arguments}: {words:?} in {said}");
    assert!(state() == before, "{arguments} changed a file");
}

#[test]
fn what_a_scene_is_read_from_is_never_overwritten() {
    let folder = folder("b.exr", "t.png", 10.0);
    let here = folder.path();
    fs::copy(here.join("s.gltf"), here.join("s.png")).expect("copied");
    fs::copy(here.join("s.gltf"), here.join("s.exr")).expect("copied");
    for more in ["", "--overwrite", "--quiet"] {
        refused(
            here,
            &format!("render s.gltf {SMALL} {more} -o s.gltf"),
            &["s.gltf", ".exr", ".png", ".jpg"],
        );
        refused(here, &format!("render s.exr {SMALL} {more} -o s.exr"), &["s.exr", "it is read"]);
        refused(here, &format!("render s.png {SMALL} {more} -o ./s.png"), &["s.png", "it is read"]);
        refused(here, &format!("render s.gltf {SMALL} {more} -o b.exr"), &["b.exr", "it is read"]);
        // The preview would lie over the texture, which is not even looked at yet.
        refused(here, &format!("render s.gltf {SMALL} {more} -o t.exr"), &["t.png", "it is read"]);
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("b.exr", here.join("soft.exr")).expect("a link");
        fs::hard_link(here.join("t.png"), here.join("hard.png")).expect("a link");
        refused(here, &format!("render s.gltf {SMALL} -o soft.exr"), &["soft.exr", "it is read", "b.exr"]);
        refused(here, &format!("render s.gltf {SMALL} -o hard.exr"), &["hard.png", "it is read", "t.png"]);
    }
    refused(here, "check s.gltf --csv s.gltf", &["s.gltf", "it is read"]);
}

#[test]
fn pictures_that_are_read_are_never_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    done(here, "render --atlas --size 16x16 --passes 2 --photons 2e3 -o a.exr");
    done(here, "render --size 16x16 --passes 2 --photons 2000 -o b.exr");
    for more in ["", "--overwrite"] {
        refused(here, &format!("mix a.exr --at 0.5,0.5 -o a.exr {more}"), &["a.exr", "it is read"]);
        refused(here, &format!("view a.exr -o a.exr {more}"), &["a.exr", ".html"]);
        refused(here, &format!("diff b.exr a.exr -o a.exr {more}"), &["a.exr", "it is read"]);
        refused(here, &format!("diff b.exr a.exr -o ./b.exr {more}"), &["b.exr", "it is read"]);
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("a.exr", here.join("a.html")).expect("a link");
        refused(here, "view a.exr -o a.html", &["a.html", "it is read"]);
    }
    // What we wrote may be written again.
    done(here, "mix a.exr --at 0.5,0.5 -o b.exr");
    done(here, "mix a.exr --at 0.5,0.5 -o c.JPG");
    assert!(!here.join("c.exr").exists() && !here.join("c.png").exists());
    done(here, "view a.exr -o c.html");
    done(here, "view a.exr -o c.html");
    done(here, "diff b.exr a.exr -o d.png --layer visible");
    done(here, "diff b.exr a.exr -o d.png --layer visible");
}

#[test]
fn files_of_other_programs_are_not_replaced_unasked() {
    let folder = folder("b.bin", "t.png", 10.0);
    let here = folder.path();
    fs::write(here.join("p.png"), b"of another program").expect("written");
    fs::write(here.join("q.exr"), b"of another program").expect("written");
    fs::write(here.join("n.html"), b"<!doctype html><p>notes on halflight</p>").expect("written");
    refused(here, &format!("render s.gltf {SMALL} -o p.exr"), &["p.png", "--overwrite"]);
    refused(here, &format!("render s.gltf {SMALL} -o p.png"), &["p.png", "--overwrite"]);
    refused(here, &format!("render s.gltf {SMALL} -o q.exr"), &["q.exr", "--overwrite"]);
    done(here, &format!("render s.gltf {SMALL} -o q.exr --overwrite"));
    done(here, &format!("render s.gltf {SMALL} -o q.exr"));
    assert!(read_exr(&here.join("q.exr")).is_ok());
    fs::create_dir(here.join("report")).expect("made");
    fs::write(here.join("report/compare.csv"), b"my,own,table\n").expect("written");
    refused(here, "compare s.gltf -o report", &["compare.csv", "--overwrite"]);
}

#[test]
fn the_ending_decides_the_format() {
    let folder = folder("b.bin", "t.png", 10.0);
    let here = folder.path();
    let begins = |name: &str, magic: &[u8]| {
        let bytes = fs::read(here.join(name)).expect(name);
        assert!(bytes.starts_with(magic), "{name}: {:?}", &bytes[..8]);
    };
    let files = || fs::read_dir(here).expect("a folder").count();
    let before = files();
    done(here, &format!("render s.gltf {SMALL} -o one.PNG"));
    begins("one.PNG", b"\x89PNG");
    done(here, &format!("render s.gltf {SMALL} -o two.jpg"));
    begins("two.jpg", b"\xff\xd8\xff\xe0");
    assert_eq!(files(), before + 2, "one file each");
    let told = done(here, &format!("render s.gltf {SMALL} -o three.EXR"));
    begins("three.EXR", b"\x76\x2f\x31\x01");
    begins("three.png", b"\x89PNG");
    assert!(told.contains("wrote three.EXR and three.png"), "{told}");
    refused(here, &format!("render s.gltf {SMALL} -o picture"), &["picture", ".exr", ".png", ".jpg"]);
    refused(
        here,
        &format!("render s.gltf {SMALL} -o picture.tiff"),
        &["picture.tiff", ".exr", ".png", ".jpg"],
    );
    refused(here, "render --atlas -o a.png", &["--atlas", ".exr"]);
}

#[cfg(unix)]
#[test]
fn devices_links_and_pipes_do_what_is_said() {
    let folder = folder("b.bin", "t.png", 10.0);
    let here = folder.path();
    let told = done(here, &format!("render s.gltf {SMALL} -o /dev/null"));
    assert!(told.contains("/dev/null is a device") && told.contains("without a preview"), "{told}");
    assert!(!Path::new("/dev/null.png").exists());
    let pipe = std::process::Command::new("mkfifo").arg(here.join("pipe.exr")).status().expect("mkfifo");
    assert!(pipe.success());
    refused(here, &format!("render s.gltf {SMALL} -o pipe.exr"), &["pipe.exr", "pipe"]);
    fs::create_dir(here.join("far")).expect("made");
    std::os::unix::fs::symlink("far/real.exr", here.join("link.exr")).expect("a link");
    let told = done(here, &format!("render s.gltf {SMALL} -o link.exr"));
    assert!(told.contains("link.exr is a link") && told.contains("far/real.exr"), "{told}");
    assert!(read_exr(&here.join("far/real.exr")).is_ok());
    assert!(fs::symlink_metadata(here.join("link.exr")).expect("a link").is_symlink());
    std::os::unix::fs::symlink("nowhere/real.exr", here.join("lost.exr")).expect("a link");
    refused(here, &format!("render s.gltf {SMALL} -o lost.exr"), &["lost.exr", "nowhere"]);
}

#[test]
fn what_killed_runs_left_is_removed_and_what_others_write_stays() {
    let folder = folder("b.bin", "t.png", 10.0);
    let here = folder.path();
    let file = |name: &str| here.join(name);
    fs::write(file(".halflight-dead.part"), b"half a picture").expect("written");
    fs::write(file("halflight-notes.part"), b"not ours").expect("written");
    let alive = fs::File::create(file(".halflight-alive.part")).expect("made");
    alive.lock().expect("locked");
    done(here, &format!("render s.gltf {SMALL} -o a.exr"));
    assert!(!file(".halflight-dead.part").exists());
    assert!(file(".halflight-alive.part").exists() && file("halflight-notes.part").exists());
    drop(alive);
    done(here, &format!("render s.gltf {SMALL} -o a.exr"));
    assert!(!file(".halflight-alive.part").exists());
}

/// A file system of 256 kB, where that is permitted.
#[cfg(target_os = "linux")]
struct Disk(TempDir);

#[cfg(target_os = "linux")]
impl Disk {
    fn new() -> Option<Self> {
        let folder = tempfile::tempdir().expect("a folder");
        let mut mount = std::process::Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", "size=256k", "tmpfs"]).arg(folder.path());
        let mounted = mount.output().is_ok_and(|output| output.status.success());
        if !mounted {
            skipped("a small disk cannot be mounted here, so a full one was not tried; run as root");
        }
        mounted.then_some(Self(folder))
    }
}

#[cfg(target_os = "linux")]
impl Drop for Disk {
    fn drop(&mut self) {
        let _ = std::process::Command::new("umount").arg(self.0.path()).status();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_waited_for() {
    use std::io::Read;
    use std::process::{Command, Stdio};
    use std::time::Duration;
    let Some(disk) = Disk::new() else { return };
    let scene = folder("b.bin", "t.png", 10.0);
    let filler = disk.0.path().join("filler");
    fs::write(&filler, vec![1; 250_000]).expect("it fits");
    let mut child = Command::new(env!("CARGO_BIN_EXE_halflight"))
        .arg("render")
        .arg(scene.path().join("s.gltf"))
        .args(["--size", "64x64", "--time", "1s", "--illumination", "local", "-o"])
        .arg(disk.0.path().join("a.exr"))
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(2500));
    fs::remove_file(&filler).expect("removed");
    let status = child.wait().expect("it ends");
    let mut said = String::new();
    child.stderr.take().expect("a pipe").read_to_string(&mut said).expect("text");
    assert!(status.success(), "{said}");
    assert_eq!(said.matches("the render goes on").count(), 1, "{said}");
    assert!(said.contains("trying again in 1 s"), "{said}");
    assert!(read_exr(&disk.0.path().join("a.exr")).is_ok());
    let left = fs::read_dir(disk.0.path()).expect("a folder").count();
    assert_eq!(left, 2, "the picture and its preview, no part");
}

#[test]
fn a_picture_that_shows_nothing_comes_with_a_word() {
    for (candela, word) in [(1e-6, "is black"), (1e-2, "nearly black"), (1e5, "is white")] {
        let folder = folder("b.bin", "t.png", candela);
        let told = done(folder.path(), &format!("render s.gltf {SMALL} -o a.png"));
        assert!(told.contains(word), "{candela}: {told}");
        let exposure =
            told.split("--exposure ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a number");
        let told = done(folder.path(), &format!("render s.gltf {SMALL} -o a.png --exposure {exposure}"));
        assert!(!told.contains("warning"), "{candela}: {told}");
        let told = done(folder.path(), &format!("render s.gltf {SMALL} -o a.png --quiet"));
        assert!(told.is_empty(), "{told}");
    }
    let fine = folder("b.bin", "t.png", 2.0);
    let told = done(fine.path(), &format!("render s.gltf {SMALL} -o a.png"));
    assert!(!told.contains("warning"), "{told}");
}

#[test]
fn a_preview_is_exposed_by_itself_and_its_file_says_how() {
    let folder = folder("b.bin", "t.png", 2.0);
    let render = |more: &str| done(folder.path(), &format!("render s.gltf {SMALL} -o a.exr {more}"));
    let picture = || read_exr(&folder.path().join("a.exr")).expect("a picture");
    let preview = || fs::read(folder.path().join("a.png")).expect("a preview");
    assert!(!render("").contains("shown at exposure"));
    let (linear, plain) = (picture(), preview());
    assert_eq!(linear.header.get("view").map(ToString::to_string).as_deref(), Some("standard"));
    assert_eq!(linear.header.get("exposure").and_then(Value::as_real), Some(0.0));
    let told = render("--exposure auto --view neutral");
    let shown = picture();
    let stops = shown.header.get("exposure").and_then(Value::as_real).expect("an exposure");
    assert!(told.contains(&format!("note: shown at exposure {stops:.2}")) && stops != 0.0, "{told}");
    assert_eq!(shown.header.get("view").map(ToString::to_string).as_deref(), Some("neutral"));
    assert_eq!(shown.layer("visible"), linear.layer("visible"));
    assert_ne!(preview(), plain);
    for (wrong, word) in [("--exposure bright", "write auto"), ("--view filmic", "standard, neutral or agx")]
    {
        let output = halflight(folder.path(), &format!("render s.gltf {SMALL} -o b.png {wrong}"));
        assert!(output.status.code() == Some(2) && said(&output).contains(word), "{}", said(&output));
    }
}

#[test]
fn light_beyond_single_precision_is_said_and_is_no_success() {
    let folder = folder("b.bin", "t.png", 3e38);
    for limit in ["--passes 2", "--error 0.1"] {
        let arguments = format!("render s.gltf --size 16x16 --method path {limit} -o a.exr");
        let output = halflight(folder.path(), &arguments);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("than single precision holds") && !said.contains("NaN"), "{said}");
        assert!(!folder.path().join("a.exr").exists());
    }
}

#[test]
fn names_from_files_stay_on_their_line() {
    let folder = folder("b.bin", "t.png", 10.0);
    let path = folder.path().join("s.gltf");
    let text = fs::read_to_string(&path).expect("text").replace(
        r#"{"pbrMetallicRoughness""#,
        r#"{"name":"A\u001b]0;owned\u0007\nwarning: B\u009b31m\u202e","extras":{"illumination":[1,1]},"doubleSided":true,"pbrMetallicRoughness""#,
    );
    fs::write(&path, text.replace(r#"{"mesh":0}"#, r#"{"mesh":0,"name":"N\u001b[2J\nM"}"#)).expect("written");
    for command in ["plan s.gltf", "render s.gltf --size 8x8 --passes 1", "render s.gltf --set X=global"] {
        let output = halflight(folder.path(), command);
        let all = [output.stdout, output.stderr].concat();
        let text = String::from_utf8(all).expect("text");
        assert!(text.chars().all(|c| c == '\n' || !c.is_control()), "{command}: {text:?}");
        assert!(
            !text.contains('\u{202e}') && !text.lines().any(|line| line.starts_with("warning: B")),
            "{text}"
        );
    }
    let odd = halflight(folder.path(), "render nowhere\u{1b}[2J.glb");
    assert!(said(&odd).contains("nowhere\\u{1b}[2J.glb"), "{}", said(&odd));
}

#[test]
fn the_ending_decides_what_is_written_and_all_hold_the_same_picture() {
    let folder = folder("b.bin", "t.png", 5.0);
    let path = |name: &str| folder.path().join(name);
    for name in ["a.exr", "b.pfm", "c.hdr", "d.jpg"] {
        done(folder.path(), &format!("render s.gltf {SMALL} -o {name}"));
    }
    assert!(path("a.png").exists() && !path("b.png").exists() && !path("c.png").exists());
    let plane = read_exr(&path("a.exr")).expect("a picture").layer("visible").expect("a plane").to_vec();
    let file = fs::read(path("b.pfm")).expect("a map");
    let pixels = file.splitn(4, |byte| *byte == b'\n').last().expect("pixels").to_vec();
    let floats: Vec<u32> = pixels.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
    let rows = plane.chunks(16).rev().flatten();
    assert_eq!(floats, rows.flat_map(|pixel| pixel.to_array().map(f32::to_bits)).collect::<Vec<_>>());
    assert!(fs::read(path("c.hdr")).expect("a picture").starts_with(b"#?RADIANCE\n"));
    // They are ours, and are replaced.
    for name in ["b.pfm", "c.hdr"] {
        done(folder.path(), &format!("render s.gltf {SMALL} --seed 3 -o {name}"));
    }
    fs::write(path("e.pfm"), b"PF\n1 1\n-1.0\n123456789012").expect("written");
    refused(folder.path(), &format!("render s.gltf {SMALL} -o e.pfm"), &["e.pfm", "--overwrite"]);
    refused(folder.path(), &format!("render s.gltf {SMALL} --cryptomatte -o b.pfm"), &["--cryptomatte"]);
}

#[test]
fn standard_output_gets_the_exr_file_and_nothing_else() {
    let folder = folder("b.bin", "t.png", 5.0);
    let output = halflight(folder.path(), &format!("render s.gltf {SMALL} -o -"));
    assert!(output.status.success(), "{}", said(&output));
    fs::write(folder.path().join("a.exr"), &output.stdout).expect("written");
    let image = read_exr(&folder.path().join("a.exr")).expect("a picture");
    assert_eq!((image.width, image.height, image.layer_names().as_str()), (16, 16, "visible, error"));
    assert!(!folder.path().join("-").exists());
}

#[test]
fn mattes_are_layers_of_the_exr_file_with_their_names_in_its_header() {
    let folder = folder("b.bin", "t.png", 5.0);
    done(folder.path(), &format!("render s.gltf {SMALL} --cryptomatte -o a.exr"));
    let image = read_exr(&folder.path().join("a.exr")).expect("a picture");
    for layer in ["CryptoObject00", "CryptoObject02", "CryptoMaterial00"] {
        assert!(image.layer(layer).is_some(), "{layer} of {}", image.layer_names());
    }
    let fact = |name: &str, of: &str| {
        let entry = image.header.entries.iter().find(|(fact, value)| {
            fact.starts_with("cryptomatte/") && fact.ends_with(name) && value.to_string().contains(of)
        });
        entry.is_some()
    };
    assert!(fact("/name", "CryptoObject") && fact("/manifest", "{") && fact("/hash", "MurmurHash3_32"));
    // Coverage, the second number, is that of one object or of nothing.
    let first = image.layer("CryptoObject00").expect("a layer");
    assert!(
        first.iter().all(|pixel| (0.0..=1.0).contains(&pixel.y)) && first.iter().any(|pixel| pixel.y == 1.0)
    );
}
