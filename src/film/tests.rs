//! What the film promises: exact sums, a true error bar, files that come back bit for bit.

use super::*;
use crate::error::Error;
use glam::{DVec3, Vec3};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// A small generator of its own, so that a change of the renderer's cannot hide behind it.
struct Noise(u64);

impl Noise {
    /// Uniform on [0, 1), variance 1/12.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = (self.0 ^ (self.0 >> 29)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (x >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn colour(&mut self) -> Vec3 {
        DVec3::new(self.next(), self.next(), self.next()).as_vec3()
    }
}

fn pass(width: u32, height: u32, layers: &[Layer], mut value: impl FnMut() -> Vec3) -> PassImage {
    let pixels = (width * height) as usize;
    let planes = layers.iter().map(|&layer| (layer, (0..pixels).map(|_| value()).collect())).collect();
    PassImage { width, height, planes, asides: Asides::default() }
}

fn noisy_film(width: u32, height: u32, layers: &[Layer], passes: u32) -> Film {
    let mut noise = Noise(7);
    let mut film = Film::new(width, height, layers);
    let accumulated: Vec<Layer> = film.accumulated().collect();
    for _ in 0..passes {
        film.add(&pass(width, height, &accumulated, || noise.colour()));
    }
    film
}

fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("picture.exr");
    (folder, file)
}

fn bits(values: &[Vec3]) -> Vec<[u32; 3]> {
    values.iter().map(|v| v.to_array().map(f32::to_bits)).collect()
}

/// z of the measured mean variance against the closed form, over many independent pixels.
fn standard_error_z(claimed_variance: f64, scale: f32) -> f64 {
    let (side, passes) = (64, 64);
    let mut noise = Noise(11);
    let mut film = Film::new(side, side, &[]);
    for _ in 0..passes {
        // A mean 1000 times the spread: a plain sum of squares would lose most of its digits.
        film.add(&pass(side, side, &[Layer::Visible], || scale * (Vec3::splat(288.0) + noise.colour())));
    }
    let variances: Vec<f64> = film
        .standard_error()
        .iter()
        .flat_map(Vec3::to_array)
        .map(|se| (f64::from(se) / f64::from(scale)).powi(2))
        .collect();
    let n = variances.len() as f64;
    let mean = variances.iter().sum::<f64>() / n;
    let spread = variances.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
    (mean - claimed_variance / f64::from(passes)) / spread.sqrt()
}

#[test]
fn the_standard_error_is_that_of_the_closed_form_at_any_power() {
    for scale in [1e-12, 1.0, 1e12] {
        let z = standard_error_z(1.0 / 12.0, scale);
        assert!(z.abs() < 3.5, "scale {scale}: z = {z}");
        for wrong in [0.98, 1.02] {
            let z = standard_error_z(wrong * wrong / 12.0, scale);
            assert!(z.abs() > 3.5, "an error bar off by 2 % was accepted: z = {z}");
        }
    }
}

#[test]
fn ten_million_values_lose_no_power() {
    let mut film = Film::new(1, 1, &[]);
    let small = pass(1, 1, &[Layer::Visible], || Vec3::splat(1e-7));
    for _ in 0..10_000_000 {
        film.add(&small);
    }
    let expected = f64::from(1e-7_f32);
    assert!((film.mean_colour().x / expected - 1.0).abs() < 1e-8);
    assert_eq!(film.mean(Layer::Visible)[0], Vec3::splat(1e-7));
    assert!(film.relative_error().unwrap() < 1e-12);
}

#[test]
fn the_relative_error_is_the_root_of_the_expected_relmse() {
    let mut film = Film::new(1, 1, &[]);
    assert_eq!(film.relative_error(), None);
    film.add(&pass(1, 1, &[Layer::Visible], || Vec3::new(1.0, 2.0, 3.0)));
    assert_eq!((film.relative_error(), film.standard_error()[0]), (None, Vec3::INFINITY));
    film.add(&pass(1, 1, &[Layer::Visible], || Vec3::new(3.0, 2.0, 5.0)));
    // Means 2, 2, 4; standard errors 1, 0, 1.
    assert_eq!(film.standard_error()[0], Vec3::new(1.0, 0.0, 1.0));
    let expected = ((1.0 / 4.0001 + 1.0 / 16.0001) / 3.0_f64).sqrt();
    assert!((film.relative_error().unwrap() - expected).abs() < 1e-15);
    assert_eq!(film.mean_colour_error(), Some(DVec3::new(1.0, 0.0, 1.0)));
}

#[test]
fn merged_shards_are_the_whole() {
    let layers = [Layer::Indirect, Layer::Error];
    let whole = noisy_film(5, 3, &layers, 12);
    let mut noise = Noise(7);
    let accumulated: Vec<Layer> = whole.accumulated().collect();
    let shards = [0..4, 4..5, 5..12].map(|passes| {
        let mut shard = Film::new(5, 3, &layers);
        passes.for_each(|number| shard.add_pass(number, &pass(5, 3, &accumulated, || noise.colour())));
        shard
    });
    let mut merged = Film::new(5, 3, &layers);
    shards.iter().rev().for_each(|shard| merged.merge(shard).unwrap());
    assert_eq!(merged.merge(&shards[1]), Err(4));
    assert_eq!(merged.passes(), 12);
    for layer in [Layer::Visible, Layer::Indirect, Layer::Error] {
        assert_eq!(bits(&merged.mean(layer)), bits(&whole.mean(layer)), "{layer}");
    }
    assert_eq!(merged.mean_colour_error(), whole.mean_colour_error());
    assert_eq!(merged.relative_error(), whole.relative_error());
}

#[test]
fn the_threads_do_not_show() {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let film = noisy_film(37, 23, &[Layer::Direct], 5);
            (film.relative_error(), film)
        })
    };
    assert_eq!(on(1), on(5));
}

#[test]
fn a_pixel_that_is_not_a_number_stays_one() {
    let mut film = Film::new(2, 1, &[]);
    for value in [1.0, f32::NAN, 2.0] {
        film.add(&PassImage {
            width: 2,
            height: 1,
            planes: vec![(Layer::Visible, vec![Vec3::splat(value), Vec3::ONE])],
            asides: Asides::default(),
        });
    }
    assert!(film.mean(Layer::Visible)[0].is_nan() && film.standard_error()[0].is_nan());
    assert_eq!(film.standard_error()[1], Vec3::ZERO);
    assert!(film.relative_error().unwrap().is_nan(), "a lost pixel must not look converged");
}

#[test]
fn every_layer_comes_back_bit_for_bit() {
    for (width, height) in [(1, 1), (7, 5), (8192, 4)] {
        let (_folder, file) = folder();
        let film = noisy_film(width, height, &Layer::ALL, 2);
        write_exr(&file, &film, &Header::new()).unwrap();
        let image = read_exr(&file).unwrap();
        assert_eq!((image.width, image.height, image.layers.len()), (width, height, Layer::ALL.len()));
        for layer in Layer::ALL {
            let mut expected = film.mean(layer);
            if layer == Layer::Depth {
                expected.iter_mut().for_each(|v| *v = Vec3::new(v.x, 0.0, 0.0));
            }
            assert_eq!(bits(image.layer(layer.name()).unwrap()), bits(&expected), "{layer}");
        }
    }
}

#[test]
fn halves_lie_among_floats_and_come_back_rounded() {
    let (_folder, file) = folder();
    let (width, height) = (70, 40); // more lines than a block has
    let value = |pixel: usize| Vec3::new(1.0, 0.3, 1e-3) * (1.0 + pixel as f32);
    let values: Vec<_> = (0..(width * height) as usize).map(value).collect();
    let components = Layer::Visible.components();
    let layer =
        |name: &str, half| WrittenLayer { name: name.into(), half, components, line: line_of(&values) };
    let layers = [layer("visible", false), layer("atlas.1.0", true), layer("error", false)];
    for compression in [Compression::PIZ, Compression::Uncompressed] {
        write_layers_exr(&file, (width, height), &Header::new(), &layers, compression).unwrap();
        let image = read_exr(&file).unwrap();
        for (name, off) in [("visible", 0.0), ("error", 0.0), ("atlas.1.0", 2.0_f32.powi(-11))] {
            let read = image.layer(name).unwrap();
            assert!(
                (0..read.len()).all(|i| (read[i] - value(i)).abs().cmple(off * value(i)).all()),
                "{name}"
            );
        }
        assert_ne!(image.layer("atlas.1.0").unwrap()[0], value(0), "it is a half");
    }
}

#[test]
fn values_that_are_not_finite_survive_the_file() {
    let (_folder, file) = folder();
    let mut film = Film::new(1, 1, &[Layer::Error]);
    let odd = Vec3::new(f32::INFINITY, f32::MAX, 1e-42);
    film.add(&pass(1, 1, &[Layer::Visible], || odd));
    write_exr(&file, &film, &Header::new()).unwrap();
    let image = read_exr(&file).unwrap();
    assert_eq!(image.layer("visible").unwrap()[0], odd);
    assert_eq!(image.layer("error").unwrap()[0], Vec3::INFINITY);
}

#[test]
fn facts_come_back_and_equal_renders_are_equal_files() {
    let (_folder, file) = folder();
    let film = noisy_film(4, 4, &[], 2);
    let header = Header::new()
        .with("version", "0.1.0")
        .with("scene", "Käfig \u{1F4A1}.glb")
        .with("seed", u64::MAX)
        .with("passes", 12_u32)
        .with("photons", 5_000_000_000_u64)
        .with("seconds", 1.25)
        .with("illumination", "a long story; ".repeat(10_000))
        .with("passes", 2_u32);
    write_exr(&file, &film, &header).unwrap();
    let read = read_exr(&file).unwrap().header;
    for name in ["version", "scene", "seconds", "illumination", "passes"] {
        assert_eq!(read.get(name), header.get(name), "{name}");
    }
    assert_eq!(read.get("passes"), Some(&Value::Integer(2)));
    assert_eq!(read.get("photons").unwrap().as_integer(), Some(5_000_000_000));
    assert_eq!(read.get("seed").unwrap().as_integer(), Some(i128::from(u64::MAX)));
    let first = fs::read(&file).unwrap();
    for _ in 0..5 {
        write_exr(&file, &film, &header).unwrap();
        assert!(fs::read(&file).unwrap() == first, "the same picture gave other bytes");
    }
}

#[test]
fn a_write_that_fails_half_way_keeps_the_old_file_and_leaves_nothing() {
    let (folder, file) = folder();
    replace_file(&file, |f| f.write_all(b"old")).unwrap();
    let result = replace_file(&file, |f| {
        f.write_all(&[0; 200_000])?;
        Err(std::io::Error::other("No space left on device"))
    });
    let message = result.unwrap_err().to_string();
    assert!(message.contains("picture.exr: cannot write: No space left"), "{message}");
    assert_eq!(fs::read(&file).unwrap(), b"old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn places_that_cannot_be_written_are_one_line() {
    let (folder, file) = folder();
    let film = noisy_film(1, 1, &[], 1);
    let missing = folder.path().join("no/such/picture.exr");
    let in_file = file.join("picture.exr");
    fs::write(&file, b"read only").unwrap();
    let mut permissions = fs::metadata(&file).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&file, permissions).unwrap();
    for path in [&missing, &in_file, &file, &folder.path().to_path_buf(), &PathBuf::from("")] {
        assert!(matches!(check_writable(path), Err(Error::Write { .. })), "{}", path.display());
        let message = write_exr(path, &film, &Header::new()).unwrap_err().to_string();
        assert!(!message.contains('\n') && message.contains("cannot write"), "{message}");
        let message = write_png(path, &film, 0.0).unwrap_err().to_string();
        assert!(!message.contains('\n') && message.contains("cannot write"), "{message}");
    }
    assert_eq!(fs::read(&file).unwrap(), b"read only");
}

#[cfg(unix)]
#[test]
fn permissions_are_those_of_a_plain_create_or_of_the_old_file() {
    use std::os::unix::fs::PermissionsExt;
    let mode = |path: &std::path::Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let (folder, file) = folder();
    let plain = folder.path().join("plain");
    fs::write(&plain, b"").unwrap();
    check_writable(&file).unwrap();
    assert!(!file.exists());
    replace_file(&file, |f| f.write_all(b"new")).unwrap();
    assert_eq!(mode(&file), mode(&plain));
    fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
    let link = folder.path().join("link");
    std::os::unix::fs::symlink(&file, &link).unwrap();
    replace_file(&link, |f| f.write_all(b"newer")).unwrap();
    assert_eq!((mode(&file), fs::read(&file).unwrap()), (0o640, b"newer".to_vec()));
    replace_file("/dev/null".as_ref(), |f| f.write_all(b"gone")).unwrap();
    assert!(!fs::metadata("/dev/null").unwrap().is_file());
}

#[test]
fn png_bytes_of_known_values() {
    let (_folder, file) = folder();
    let plane = [
        Vec3::new(0.0, 0.5, 1.0),
        Vec3::new(-1.0, 0.214_041_14, 9.0),
        Vec3::splat(0.001),
        Vec3::new(f32::NAN, 0.0, 0.0),
    ];
    assert_eq!(write_rgb_png(&file, 2, 2, &plane, 0.0).unwrap(), 1);
    let decode = || {
        let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(&file).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        bytes
    };
    assert_eq!(decode(), [0, 188, 255, 0, 128, 255, 3, 3, 3, 255, 0, 255]);
    write_rgb_png(&file, 2, 2, &plane, -1.0).unwrap();
    assert_eq!(decode()[..3], [0, 137, 188]);
}

#[test]
fn damaged_files_are_errors_never_panics() {
    let (_folder, file) = folder();
    let film = noisy_film(40, 70, &[Layer::Depth], 2);
    write_exr(&file, &film, &Header::new().with("scene", "box")).unwrap();
    let good = fs::read(&file).unwrap();
    let mut noise = Noise(3);
    let mut at = |limit: usize| (noise.next() * limit as f64) as usize;
    for _ in 0..40 {
        fs::write(&file, &good[..at(good.len())]).unwrap();
        let message = match read_exr(&file) {
            Err(e @ Error::Image { .. }) => e.to_string(),
            other => panic!("a truncated file gave {other:?}"),
        };
        assert!(!message.contains('\n'), "{message}");
    }
    for round in 0..400 {
        let mut bad = good.clone();
        for _ in 0..=at(3) {
            // Most of the ways to go wrong are in the header.
            let place = at(if round % 4 == 0 { good.len() } else { 600 });
            bad[place] = at(256) as u8;
        }
        fs::write(&file, &bad).unwrap();
        if let Err(e) = read_exr(&file) {
            assert!(matches!(e, Error::Image { .. }) && !e.to_string().contains('\n'), "{e}");
        }
    }
    for junk in [&b""[..], b"\x76\x2f\x31\x01", b"not a picture at all"] {
        fs::write(&file, junk).unwrap();
        assert!(matches!(read_exr(&file), Err(Error::Image { .. })));
    }
    assert!(matches!(read_exr("no/such.exr".as_ref()), Err(Error::Read { .. })));
}

#[test]
fn one_photon_more_than_came_is_counted() {
    let mut film = Film::new(2, 1, &[]);
    // 0.5 and 0.25 are held exactly in any precision.
    for (value, one_more) in [(1.0, 0.25), (1.0, 0.5), (4.0, 0.25)] {
        film.add(&PassImage {
            width: 2,
            height: 1,
            planes: vec![(Layer::Visible, vec![Vec3::ZERO, Vec3::splat(value)])],
            asides: Asides { one_more: Some(vec![one_more, one_more]), scattered: None },
        });
    }
    let error = film.standard_error();
    // Nothing came to the first: one photon of three passes, as strong as the weakest. To the second, a variance of 1 and that.
    assert!((error[0].x - 0.25 / 3.0).abs() < 1e-6, "{error:?}");
    assert!((error[1].y - (1.0 + 0.0625_f32 / 9.0).sqrt()).abs() < 1e-6, "{error:?}");
}
