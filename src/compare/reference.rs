//! The picture that others are measured against, with what is known about its own error.
//!
//! A reference is a long render by one method, with a seed of its own. Its noise is the spread of its passes; what that
//! adds to errors measured against it is known in the mean, and is subtracted. Where photons make the reference, the finite
//! radius adds a bias. In every fourth pass the same photons are also gathered with twice the radius, and the mean
//! difference D bounds the bias: a bias that grows at least in proportion to the radius is no larger than what doubling the
//! radius adds to it.

use crate::error::{Error, Result};
use crate::film::{Header, Image, Layer, PassImage, Value, read_exr, write_image_exr};
use crate::measure::{Metrics, Moments};
use crate::pass::render_pass;
use crate::pilot::learn_photons;
use crate::plan::{Frame, Method, Plan, Settings};
use crate::scene::Scene;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// No run that is measured should share it.
const SEED: u64 = 0x5EED_0F7B_E112_E4CE;
/// First gather radius of a photon reference over that of an ordinary render.
const RADIUS: f32 = 0.35;
/// The doubled radius is gathered in every so manieth pass.
const WIDE_EVERY: u32 = 4;
/// Layers beside those of a render: the mean difference D that doubling the radius makes, and its standard error.
const WIDE: &str = "radius_doubled";
const WIDE_ERROR: &str = "radius_doubled_error";

/// A picture to measure against.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The visible layer.
    pub visible: Vec<Vec3>,
    /// Its standard error.
    pub error: Vec<Vec3>,
    /// What luminaires send straight into the camera, where known.
    pub emitted: Option<Vec<Vec3>>,
    /// D and its standard error, where photons made the reference here.
    pub doubled: Option<(Vec<Vec3>, Vec<Vec3>)>,
    /// Who made it, as far as known.
    pub method: String,
    /// Passes in it, as far as known.
    pub passes: u32,
    /// Seconds that rendering took, as far as known.
    pub seconds: f64,
    /// Hash of its scene, as far as known.
    pub scene_hash: Option<String>,
}

/// The reference's own error as relMSE, in the pixels that count.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct OwnError {
    /// Mean over pixels and channels of its squared standard error / (r² + 0.01²), with no r above the median of its
    /// neighbours.
    pub noise: f64,
    /// The same of D², less the noise of D itself: an upper bound of the squared bias. None where nothing is known of it;
    /// 0 where there is none.
    pub bias: Option<f64>,
    /// What may be left of both in an error that is measured [less the noise](NoiseShare): the bias, and a twentieth of the
    /// noise (and 2/N of it after N passes).
    pub total: f64,
}

/// The share of the reference's noise that is taken to be left when it is subtracted: one twentieth and, because the spread of N
/// passes is itself known to √(2/N) in each pixel, 2/N. Rare bright samples that have not come yet make errors seem larger
/// than they are, whoever made them.
fn noise_left(passes: u32) -> f64 {
    0.05 + 2.0 / f64::from(passes.max(1))
}

/// What the noise of the reference adds to errors measured against it, in the mean.
///
/// Runs and reference have seeds of their own, so E (x−r)² = (x−E r)² + Var r: the error against the reference
/// without its noise is what is measured less the variance of its mean, which the spread of its passes tells.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct NoiseShare {
    /// Of relMSE.
    pub relmse: f64,
    /// Of the mean square of x−r.
    pub mse: f64,
}

impl NoiseShare {
    /// Figures against the reference without its noise. Not below zero: an error that small drowns in the noise.
    pub fn taken_off(&self, metrics: Metrics) -> Metrics {
        Metrics {
            relmse: (metrics.relmse - self.relmse).max(0.0),
            rmse: (metrics.rmse * metrics.rmse - self.mse).max(0.0).sqrt(),
            ..metrics
        }
    }
}

impl OwnError {
    /// What `total` of a reference by `method` will be after `factor` times the time. The noise of paths falls as 1/time, that
    /// of photons as its power of -2/3 (Knaus & Zwicker 2011, α = 2/3). Their bias is greatest in strips as wide as
    /// the radius, along edges of surfaces and shadows, where it does not fall: in the mean it falls as the radius.
    pub fn after(&self, method: Method, factor: f64) -> f64 {
        let noise = noise_left(u32::MAX) * self.noise;
        if method == Method::Photon {
            noise * factor.powf(-2.0 / 3.0) + self.bias.unwrap_or(0.0) * factor.powf(-1.0 / 6.0)
        } else {
            noise / factor
        }
    }
}

impl Reference {
    /// Reads a reference from a file.
    ///
    /// # Errors
    /// One without its own error: a picture of unknown error proves nothing.
    pub fn read(path: &Path) -> Result<Self> {
        let image = read_exr(path)?;
        let take = |name: &str| image.layer(name).map(<[Vec3]>::to_vec);
        let missing = |name: &str| Error::Image {
            path: path.into(),
            reason: format!(
                "no layer `{name}`, so its own error is not known; render it with --layers visible,error,emitted"
            ),
        };
        let fact = |name: &str| image.header.get(name);
        Ok(Self {
            width: image.width,
            height: image.height,
            visible: take(Layer::Visible.name()).ok_or_else(|| missing("visible"))?,
            error: take(Layer::Error.name()).ok_or_else(|| missing("error"))?,
            emitted: take(Layer::Emitted.name()),
            doubled: take(WIDE).zip(take(WIDE_ERROR)),
            method: fact("method").map_or("unknown".into(), ToString::to_string),
            passes: fact("passes").and_then(Value::as_integer).and_then(|n| n.try_into().ok()).unwrap_or(0),
            seconds: fact("seconds").and_then(Value::as_real).unwrap_or(0.0),
            scene_hash: fact("scene_hash").map(ToString::to_string),
        })
    }

    /// Its own error over the pixels that are not `left_out`.
    pub fn own_error(&self, left_out: &[bool]) -> OwnError {
        let calm = self.calm();
        let square = |plane: &[Vec3]| relative_square(plane, &calm, left_out);
        let noise = square(&self.error);
        let bias = match &self.doubled {
            Some((d, error)) => Some((square(d) - square(error)).max(0.0)),
            None if self.method.starts_with("path") => Some(0.0),
            None => None,
        };
        let total = noise_left(self.passes) * noise + bias.unwrap_or(0.0);
        OwnError { noise, bias, total }
    }

    /// What its noise adds to the figures of [`compare`](crate::measure::compare), which has the same weights.
    pub fn noise_share(&self, left_out: &[bool]) -> NoiseShare {
        let counted = self.error.iter().zip(left_out).filter(|(_, out)| !**out).map(|(error, _)| error);
        let (sum, count) = counted
            .fold((0.0, 0.0), |(sum, count), error| (sum + error.as_dvec3().length_squared(), count + 3.0));
        NoiseShare {
            relmse: relative_square(&self.error, &self.visible, left_out),
            mse: sum / f64::max(count, 1.0),
        }
    }

    /// The picture with each channel no greater than the median of its 3×3 neighbourhood: a pixel that one rare bright
    /// sample has spoiled has a large error and is itself as large, and would otherwise count as one of 100 % at the most,
    /// where it is thousands.
    fn calm(&self) -> Vec<Vec3> {
        let (width, height) = (self.width as usize, self.height as usize);
        let near = |i: usize, end: usize| i.saturating_sub(1)..=(i + 1).min(end - 1);
        let median = |x: usize, y: usize, channel: usize| {
            let around = near(y, height).flat_map(|y| near(x, width).map(move |x| y * width + x));
            let mut values: Vec<f32> = around.map(|i| self.visible[i][channel]).collect();
            values.sort_by(f32::total_cmp);
            values[values.len() / 2]
        };
        let pixel = |i: usize| {
            let (x, y) = (i % width, i / width);
            Vec3::from_array([0, 1, 2].map(|channel| median(x, y, channel))).min(self.visible[i])
        };
        (0..self.visible.len()).into_par_iter().map(pixel).collect()
    }
}

/// Mean over pixels that are not `left_out` and channels of v²/(r² + 0.01²), as relMSE.
fn relative_square(plane: &[Vec3], against: &[Vec3], left_out: &[bool]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for ((v, r), _) in plane.iter().zip(against).zip(left_out).filter(|(_, out)| !**out) {
        let (v, r) = (v.as_dvec3(), r.as_dvec3());
        sum += (v * v / (r * r + DVec3::splat(1e-4))).element_sum();
        count += 3;
    }
    sum / count.max(1) as f64
}

/// The methods worth trying as reference of a scene: path tracing, which has no bias; photons too where light reaches
/// surfaces through mirrors or glass, which path tracing finds slowly, and where they need no photons and so have no bias.
pub fn candidates(scene: &Scene, settings: &Settings) -> Vec<Method> {
    let plan = Plan::new(scene.clone(), Settings { method: Method::Photon, ..settings.clone() });
    if plan.photons.is_none_or(|photons| photons.classes.caustic) {
        vec![Method::Path, Method::Photon]
    } else {
        vec![Method::Path]
    }
}

/// Makes a reference, keeps it in a file, and makes it better on demand.
pub struct ReferenceMaker {
    plan: Plan,
    frame: Frame,
    file: PathBuf,
    key: String,
    picture: Moments,
    emitted: Moments,
    doubled: Moments,
    seconds: f64,
    /// True when a file of an earlier run was taken up.
    pub from_cache: bool,
}

impl ReferenceMaker {
    /// Takes up what `folder` holds for the same scene, settings, method and version, or begins anew.
    pub fn new(scene: &Scene, settings: &Settings, method: Method, folder: &Path) -> Result<Self> {
        let Settings { width, height, caustic_radius, indirect_radius, .. } = *settings;
        let settings = Settings {
            seed: SEED,
            method,
            caustic_radius: RADIUS * caustic_radius,
            indirect_radius: RADIUS * indirect_radius,
            ..settings.clone()
        };
        let version = env!("CARGO_PKG_VERSION");
        let key = format!("{version} {:016x} {settings:?}", scene.hash());
        let slug: String =
            scene.name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        let slug = slug.trim_matches('-');
        let begin = slug.len().saturating_sub(40);
        let file = folder.join(format!("reference-{}-{:016x}.exr", &slug[begin..], fingerprint(&key)));
        let pixels = width as usize * height as usize;
        let plan = Plan::new(scene.clone(), settings);
        // With connections: photons that a pilot might find better would blur what is held against them.
        let frame = learn_photons(&plan);
        let empty = Moments::new(pixels);
        let mut maker = Self {
            plan,
            frame,
            file,
            key,
            picture: empty.clone(),
            emitted: empty.clone(),
            doubled: empty,
            seconds: 0.0,
            from_cache: false,
        };
        maker.take_up();
        Ok(maker)
    }

    /// Who renders it.
    pub fn method(&self) -> Method {
        self.plan.settings.method
    }

    /// Where it is kept.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Seconds spent on it so far, in earlier runs too.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Camera samples taken so far, in earlier runs too.
    pub fn camera_samples(&self) -> u64 {
        self.frame.camera_samples(self.method()) * u64::from(self.picture.passes())
    }

    /// Renders until so many seconds have been spent on it in all, and keeps the result in the file.
    pub fn extend_to(&mut self, seconds: f64) -> Result<()> {
        while self.seconds < seconds || self.picture.passes() < 2 * WIDE_EVERY {
            let begin = Instant::now();
            self.pass();
            self.seconds += begin.elapsed().as_secs_f64();
        }
        write_image_exr(&self.file, &self.image())
    }

    /// The picture so far.
    pub fn reference(&self) -> Reference {
        let Settings { width, height, method, .. } = self.plan.settings;
        let doubled =
            (method == Method::Photon).then(|| (self.doubled.mean(), self.doubled.standard_error()));
        Reference {
            width,
            height,
            visible: self.picture.mean(),
            error: self.picture.standard_error(),
            emitted: Some(self.emitted.mean()),
            doubled,
            method: method.name().into(),
            passes: self.picture.passes(),
            seconds: self.seconds,
            scene_hash: Some(format!("{:016x}", self.plan.scene.hash())),
        }
    }

    fn pass(&mut self) {
        let pass = self.picture.passes();
        let image = render_pass(&self.plan, &self.frame, pass, &[Layer::Visible, Layer::Emitted]).0;
        let visible = plane(&image, Layer::Visible);
        if self.plan.settings.method == Method::Photon && pass.is_multiple_of(WIDE_EVERY) {
            let wide = render_pass(&self.plan, &self.frame.with_radii(2.0), pass, &[Layer::Visible]).0;
            let pairs = plane(&wide, Layer::Visible).iter().zip(visible);
            self.doubled.add(pairs.map(|(wide, narrow)| wide.as_dvec3() - narrow.as_dvec3()));
        }
        self.emitted.add(plane(&image, Layer::Emitted).iter().map(|v| v.as_dvec3()));
        self.picture.add(visible.iter().map(|v| v.as_dvec3()));
    }

    fn image(&self) -> Image {
        let reference = self.reference();
        let mut layers = vec![
            (Layer::Visible.name().to_owned(), reference.visible),
            (Layer::Error.name().to_owned(), reference.error),
            (Layer::Emitted.name().to_owned(), self.emitted.mean()),
        ];
        if let Some((mean, error)) = reference.doubled {
            layers.push((WIDE.into(), mean));
            layers.push((WIDE_ERROR.into(), error));
        }
        let header = Header::new()
            .with("version", env!("CARGO_PKG_VERSION"))
            .with("content", "reference")
            .with("reference_key", self.key.clone())
            .with("method", reference.method)
            .with("scene", self.plan.scene.name.clone())
            .with("scene_hash", format!("{:016x}", self.plan.scene.hash()))
            .with("illumination", self.plan.scene.describe_illumination())
            .with("passes", reference.passes)
            .with("doubled_passes", self.doubled.passes())
            .with("seconds", self.seconds);
        Image { width: reference.width, height: reference.height, layers, header }
    }

    /// A file that is not there, damaged, or of something else is made anew.
    fn take_up(&mut self) {
        let Ok(image) = read_exr(&self.file) else { return };
        let count = |name: &str| {
            let value = image.header.get(name).and_then(Value::as_integer);
            value.and_then(|n| u32::try_from(n).ok())
        };
        let same = image.header.get("reference_key").is_some_and(|key| key.to_string() == self.key);
        let layer = |name: &str| image.layer(name);
        let (Some(passes), Some(visible), Some(error), Some(emitted), true) = (
            count("passes"),
            layer(Layer::Visible.name()),
            layer(Layer::Error.name()),
            layer(Layer::Emitted.name()),
            same,
        ) else {
            return;
        };
        self.picture = Moments::resume(passes, visible, error);
        self.emitted = Moments::resume(passes, emitted, &vec![Vec3::ZERO; emitted.len()]);
        if let (Some(passes), Some((mean, error))) =
            (count("doubled_passes"), layer(WIDE).zip(layer(WIDE_ERROR)))
        {
            self.doubled = Moments::resume(passes, mean, error);
        }
        self.seconds = image.header.get("seconds").and_then(Value::as_real).unwrap_or(0.0);
        self.from_cache = true;
    }
}

fn plane(image: &PassImage, layer: Layer) -> &[Vec3] {
    let found = image.planes.iter().find(|(name, _)| *name == layer);
    found.map(|(_, plane)| plane.as_slice()).expect("asked for")
}

/// 64 bits of a text, the same in every run (FNV-1a).
fn fingerprint(text: &str) -> u64 {
    text.bytes()
        .fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> Settings {
        Settings { width: 12, height: 12, paths: Some(2000), ..Settings::default() }
    }

    /// A square picture made of passes.
    fn of_passes(side: u32, moments: &Moments) -> Reference {
        Reference {
            width: side,
            height: side,
            visible: moments.mean(),
            error: moments.standard_error(),
            emitted: None,
            doubled: None,
            method: "path".into(),
            passes: moments.passes(),
            seconds: 1.0,
            scene_hash: None,
        }
    }

    #[test]
    fn it_is_kept_taken_up_and_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let scene = Scene::load("builtin:caustic-box").unwrap();
        assert_eq!(candidates(&scene, &settings()), [Method::Path, Method::Photon]);
        let method = Method::Photon;
        let new = || ReferenceMaker::new(&scene, &settings(), method, folder.path()).unwrap();
        let mut first = new();
        first.extend_to(0.0).unwrap();
        let mut second = new();
        assert!(second.from_cache && !first.from_cache);
        let before = second.reference();
        assert_eq!(before.visible, first.reference().visible);
        second.extend_to(before.seconds + 0.05).unwrap();
        let (after, counts) = (second.reference(), vec![false; 144]);
        assert!(after.passes > before.passes);
        let own = after.own_error(&counts);
        assert!(own.noise > 0.0 && own.bias.is_some_and(|bias| bias >= 0.0) && own.total > 0.05 * own.noise);
        let read = Reference::read(second.file()).unwrap();
        assert_eq!((read.passes, &read.visible), (after.passes, &after.visible));
    }

    #[test]
    fn rare_bright_samples_do_not_hide_behind_their_own_brightness() {
        // One sample of 1000 in 2000: the mean is 1, and passes are so few that most pixels never meet one.
        let (side, passes) = (64_u32, 40);
        let pixels = (side * side) as usize;
        let mut moments = Moments::new(pixels);
        for pass in 0..passes {
            let mut rng = crate::sampling::Rng::new(1, crate::sampling::Stream::Test, pass, 0);
            let picture: Vec<DVec3> =
                (0..pixels).map(|_| DVec3::splat(if rng.f32() < 0.0005 { 1000.0 } else { 0.5 })).collect();
            moments.add(picture);
        }
        let reference = of_passes(side, &moments);
        let none_out = vec![false; pixels];
        let truth = crate::measure::compare(&reference.visible, &vec![Vec3::ONE; pixels], None).relmse;
        let own = reference.own_error(&none_out).noise;
        assert!(own > 0.5 * truth, "own {own}, truth {truth}");
        // What it would be without the median.
        let pairs = reference.error.iter().zip(&reference.visible);
        let naive: f64 = pairs.map(|(e, r)| f64::from(e.x / r.x).powi(2)).sum::<f64>() / pixels as f64;
        assert!(naive < 0.02 * truth, "naive {naive}, truth {truth}");
    }

    #[test]
    fn errors_are_those_against_a_reference_without_noise() {
        // A picture that is off by 2 % up and down, with noise of 1 %, against a reference of 3 % noise.
        let (side, passes) = (64_u32, 25);
        let pixels = (side * side) as usize;
        let mut rng = crate::sampling::Rng::new(4, crate::sampling::Stream::Test, 0, 0);
        let mut noise = |size: f64| {
            let twelve: f32 = (0..12).map(|_| rng.f32()).sum();
            size * f64::from(twelve - 6.0)
        };
        let truth: Vec<f64> = (0..pixels).map(|i| 0.1 + (i % 50) as f64 / 50.0).collect();
        let mut moments = Moments::new(pixels);
        for _ in 0..passes {
            let picture: Vec<DVec3> = truth.iter().map(|r| DVec3::splat(r * (1.0 + noise(0.15)))).collect();
            moments.add(picture);
        }
        let reference = of_passes(side, &moments);
        let picture: Vec<Vec3> = truth
            .iter()
            .zip([1.02, 0.98].iter().cycle())
            .map(|(r, off)| Vec3::splat((r * (off + noise(0.01))) as f32))
            .collect();
        let exact: Vec<Vec3> = truth.iter().map(|r| Vec3::splat(*r as f32)).collect();
        let of = |against: &[Vec3]| crate::measure::compare(&picture, against, None);
        let (raw, wanted) = (of(&reference.visible), of(&exact));
        let none_out = vec![false; pixels];
        let got = reference.noise_share(&none_out).taken_off(raw);
        assert!(raw.relmse > 2.0 * wanted.relmse && raw.rmse > 1.4 * wanted.rmse);
        assert!((got.relmse / wanted.relmse - 1.0).abs() < 0.08, "{got:?} for {wanted:?}");
        assert!((got.rmse / wanted.rmse - 1.0).abs() < 0.04, "{got:?} for {wanted:?}");
    }

    #[test]
    fn diffuse_scenes_get_a_path_traced_one_and_other_settings_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let scene = Scene::load("builtin:cornell-spheres").unwrap();
        assert_eq!(candidates(&scene, &settings()), [Method::Path]);
        assert_eq!(candidates(&scene.at(0.0, 1.0), &settings()), [Method::Path, Method::Photon], "local");
        let file = |settings: &Settings, method| {
            let maker = ReferenceMaker::new(&scene, settings, method, folder.path()).unwrap();
            maker.file().to_owned()
        };
        let small = file(&settings(), Method::Path);
        assert_ne!(small, file(&settings(), Method::Photon));
        assert_ne!(small, file(&Settings { width: 13, ..settings() }, Method::Path));
        assert_eq!(small, file(&settings(), Method::Path));
    }
}
