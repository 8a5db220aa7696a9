//! Makes a reference, keeps it in a file, and makes it better on demand.

use super::reference::{Reference, WIDE, WIDE_ERROR};
use crate::error::{Error, Result};
use crate::film::{Header, Image, Layer, PassImage, Value, read_exr, write_image_exr};
use crate::measure::Moments;
use crate::pass::render_pass;
use crate::pilot::learn_photons;
use crate::plan::{Frame, Method, Plan, Settings};
use crate::scene::{Fnv, Scene};
use glam::Vec3;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// No run that is measured should share it.
const SEED: u64 = 0x5EED_0F7B_E112_E4CE;
/// First gather radius of a photon reference over that of an ordinary render.
const RADIUS: f32 = 0.35;
/// The doubled radius is gathered in every so manieth pass.
const WIDE_EVERY: u32 = 4;
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

/// # Errors
/// A method whose bias nobody knows makes no reference.
pub fn can_refer(method: Method) -> Result<()> {
    if method == Method::Nearest {
        let why = "nobody knows the bias of a reference by nearest photons; have it made by path or photon";
        return Err(Error::Usage(why.into()));
    }
    Ok(())
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
    ///
    /// # Errors
    /// A method whose bias nobody knows.
    pub fn new(scene: &Scene, settings: &Settings, method: Method, folder: &Path) -> Result<Self> {
        can_refer(method)?;
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

/// 64 bits of a text, the same in every run.
fn fingerprint(text: &str) -> u64 {
    let mut fnv = Fnv::EMPTY;
    fnv.bytes(text.as_bytes());
    fnv.0
}
