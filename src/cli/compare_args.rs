//! What `halflight compare` is told.

use super::limits::duration;
use super::output::Overwrite;
use super::scene_args::{AroundArgs, SceneArgs};
use super::settings_args::{DEFAULT_SAMPLES, size, whole};
use super::threads::number;
use crate::plan::Settings;
use crate::scene::{MAX_TRIANGLES, Pose};
use std::path::PathBuf;
use std::time::Duration;

/// Halves of `--time` that are budgets too.
const HALVINGS: i32 = 6;

/// Error against run time: methods × time budgets × seeds against a reference.
///
/// Each method and seed is one render that goes on; its error is measured when each budget is passed. Whichever run has
/// used the least time renders next, so that noise of the machine hits all alike. Counted is what a user waits for:
/// loading, planning, ray index, shooting, maps, gathering; not writing files, not measuring errors.
///
/// Writes compare.csv and compare.json (every run), compare.svg (curves) and compare.html (curves, tables, pictures).
///
/// For example: halflight compare builtin:caustic-box --time 60s --reference-time 30m -o docs/error-vs-time/caustic-box
#[derive(clap::Args, Clone, Debug)]
pub struct CompareArgs {
    /// Scenes: .gltf or .glb files, or builtin:caustic-box, builtin:cornell-spheres,
    /// builtin:fluorescent-box, builtin:two-spheres, builtin:concentric
    #[arg(value_name = "SCENE", default_value = "builtin:caustic-box")]
    pub(super) scenes: Vec<PathBuf>,
    /// Which scene of files that have several, as in `render`
    #[arg(id = "scene-of-file", long = "scene", value_name = "NAME|N")]
    pub(super) scene_of_file: Option<String>,
    /// Which camera, as in `render`
    #[arg(long, value_name = "NAME|N")]
    pub(super) camera: Option<String>,
    /// A moment of an animation, as in `render`
    #[arg(long, value_name = "[NAME:]SECONDS", allow_negative_numbers = true)]
    pub(super) pose: Option<Pose>,
    /// Instead of methods: a set of options of `render` under a name, as in --variant 'wide: --indirect-radius 24' --variant
    /// 'many: --photons 1M'; --photons, --samples and --max-reflections given beside hold where it says nothing else. Without a
    /// colon: which variant of the scene's materials, as in `render`
    #[arg(long, value_name = "NAME: OPTIONS|NAME|N")]
    pub(super) variant: Vec<String>,
    /// Illumination over the whole scene, as in `render`; repeated: every scene in each
    #[arg(long, value_name = "NAME|S,T")]
    pub(super) illumination: Vec<String>,
    /// Illumination of one material, as in `render` (repeatable)
    #[arg(long, value_name = "MATERIAL=…")]
    pub(super) set: Vec<String>,
    #[command(flatten)]
    pub(super) around: AroundArgs,
    /// The most triangles that a scene may have, every instance counted
    #[arg(long, value_name = "N", default_value_t = MAX_TRIANGLES, value_parser = whole::<u64>)]
    pub(super) max_triangles: u64,
    /// Who competes [default: photon,path,path-plain,nearest]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub(super) methods: Vec<String>,
    /// Times at which the error is measured [default: 1s,2s,4s,8s]
    #[arg(long, value_name = "TIME,…", value_delimiter = ',', value_parser = duration, conflicts_with = "time")]
    pub(super) budgets: Vec<Duration>,
    /// Instead of --budgets: this time and its halves, down to 1/64
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(super) time: Option<Duration>,
    /// Runs of each method, with the seeds 1, 2, …
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub(super) seeds: u64,
    /// Film size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "256x256", value_parser = size)]
    pub(super) size: (u32, u32),
    /// Photon paths per pass [default: chosen by the plan]
    #[arg(long, value_name = "N", value_parser = whole::<u32>)]
    pub(super) photons: Option<u32>,
    /// Camera samples per pixel and pass of the path tracers, stratified against each other [default: 4]
    #[arg(long, value_name = "N", value_parser = whole::<u32>)]
    pub(super) samples: Option<u32>,
    /// Cut the series after N reflections, as in `render`
    #[arg(long, value_name = "N")]
    pub(super) max_reflections: Option<u32>,
    /// Measure against this EXR file instead of a reference made here; it needs its layer `error`
    #[arg(long, value_name = "FILE.exr", conflicts_with_all = ["reference_time", "reference_method"])]
    pub(super) reference: Option<PathBuf>,
    /// The longest time for making the reference; it ends as soon as it has as many samples of each pixel as the longest
    /// run, and its bias and what may be left of its noise (which is taken off the errors) are ten times below them
    #[arg(long, value_name = "TIME", default_value = "120s", value_parser = duration)]
    pub(super) reference_time: Duration,
    /// Who makes the reference: path (no bias) or photon (for caustics; its bias is measured and stated)
    /// [default: path; where light reaches surfaces through mirrors or glass, or no photons are needed, the one that
    /// promises the smaller error]
    #[arg(long, value_name = "NAME")]
    pub(super) reference_method: Option<String>,
    /// Where references are kept and taken up again [default: `cache` in the output folder]
    #[arg(long, value_name = "FOLDER")]
    pub(super) cache: Option<PathBuf>,
    /// Leave out pixels where the reference has a channel above X, beside those that see a luminaire
    #[arg(long, value_name = "X", default_value_t = 3.0)]
    pub(super) mask_above: f32,
    /// Grow what is left out by N pixels on every side
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub(super) dilate: u32,
    /// Where the files go
    #[arg(short, long, value_name = "FOLDER", default_value = "compare")]
    pub(super) output: PathBuf,
    #[command(flatten)]
    pub(super) overwrite: Overwrite,
    /// Threads, at most four for each processor [default: one for each processor]
    #[arg(long, value_name = "N", value_parser = number)]
    pub(super) threads: Option<u16>,
    /// Print nothing but errors
    #[arg(short, long)]
    pub(super) quiet: bool,
}

/// Name and options of a set of options: what stands after a colon begins with a dash, or there is nothing.
fn option_set(value: &str) -> Option<(&str, &str)> {
    let (name, options) = value.split_once(':')?;
    let options = options.trim();
    (options.is_empty() || options.starts_with('-')).then_some((name.trim(), options))
}

impl CompareArgs {
    /// Every scene in every light.
    pub fn scene_args(&self) -> Vec<SceneArgs> {
        let mut lights: Vec<Option<String>> = self.illumination.iter().cloned().map(Some).collect();
        if lights.is_empty() {
            lights.push(None);
        }
        let in_lights = |scene: &PathBuf| {
            let args = |illumination: &Option<String>| SceneArgs {
                scene: scene.clone(),
                scene_of_file: self.scene_of_file.clone(),
                camera: self.camera.clone(),
                pose: self.pose.clone(),
                variant: self.material_variant().map(str::to_owned),
                illumination: illumination.clone(),
                set: self.set.clone(),
                around: self.around.clone(),
                max_triangles: self.max_triangles,
            };
            lights.iter().map(args).collect::<Vec<_>>()
        };
        self.scenes.iter().flat_map(in_lights).collect()
    }

    /// Those of the values of `--variant` that are sets of options: name and options.
    pub fn option_sets(&self) -> impl Iterator<Item = (&str, &str)> {
        self.variant.iter().filter_map(|value| option_set(value))
    }

    /// The other one.
    pub fn material_variant(&self) -> Option<&str> {
        self.variant.iter().map(String::as_str).find(|value| option_set(value).is_none())
    }

    /// Seconds, ascending.
    pub fn budgets(&self) -> Vec<f64> {
        if let Some(time) = self.time {
            return (0..=HALVINGS).rev().map(|i| time.as_secs_f64() * 0.5_f64.powi(i)).collect();
        }
        let mut budgets: Vec<f64> = self.budgets.iter().map(Duration::as_secs_f64).collect();
        if budgets.is_empty() {
            budgets = vec![1.0, 2.0, 4.0, 8.0];
        }
        budgets.sort_by(f64::total_cmp);
        budgets.dedup();
        budgets
    }

    pub fn settings(&self) -> Settings {
        Settings {
            paths: self.photons,
            samples: self.samples.unwrap_or(DEFAULT_SAMPLES),
            max_reflections: self.max_reflections,
            ..Settings::for_film(self.size.0, self.size.1)
        }
    }
}
