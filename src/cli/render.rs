use super::interrupt::Interrupt;
use super::out::say;
use super::output::{Overwrite, PictureFiles};
use super::preview_args::PreviewArgs;
use super::progress::Progress;
use super::scene_args::SceneArgs;
use super::settings_args::SettingsArgs;
use super::writer::Writer;
use crate::error::{Error, Result};
use crate::film::Preview;
use crate::machine;
use crate::mattes::Mattes;
use crate::plan::Settings;
use crate::render::{ErrorEstimate, Pace, Render};
use crate::scene::names::listed;
use clap::Args;
use std::fmt::Display;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

#[derive(Args)]
pub struct RenderArgs {
    #[command(flatten)]
    scene: SceneArgs,

    /// The picture; its ending decides the format: .exr holds all layers and has a PNG preview beside it; .png and .jpg
    /// hold what a display shows, .pfm and .hdr linear light, and nothing else is written; - is an EXR file to standard output.
    #[arg(short, long, value_name = "FILE", default_value = "halflight.exr")]
    output: PathBuf,

    #[command(flatten)]
    overwrite: Overwrite,

    #[command(flatten)]
    settings: SettingsArgs,

    /// Stop after so many passes. Without --passes, --time and --error: 64. The first limit reached ends the render.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    passes: Option<u32>,

    /// Stop after so much time, as in 30s, 5m, 1h. Passes are made of fewer photons (or samples) where one would take more
    /// than a tenth of it; one that has not ended soon after the time is dropped. The first is always completed.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    time: Option<Duration>,

    /// Stop when the relative error of the picture is below this: standard error and estimated bias together, root of
    /// the mean square over pixels.
    #[arg(long, value_name = "FRACTION", value_parser = positive)]
    error: Option<f64>,

    /// Threads, at most four for each processor; the picture does not depend on it. Default: one for each processor.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Also store every picture of the illumination square, for `halflight mix` and `halflight view`: light by its number
    /// of reflections and straight crossings. The picture itself is that of --illumination. Takes about 2 KB of memory
    /// a pixel.
    #[arg(long)]
    atlas: bool,

    /// Also write mattes of objects and materials to the EXR file, as the Cryptomatte nodes of Blender, Nuke and others read them.
    #[arg(long)]
    cryptomatte: bool,

    #[command(flatten)]
    preview: PreviewArgs,

    /// Print nothing but errors.
    #[arg(short, long)]
    quiet: bool,
}

/// Passes of a render that was given no limit.
const DEFAULT_PASSES: u32 = 64;
/// The longest time between two pictures on disk.
const LONGEST_SILENCE: Duration = Duration::from_secs(60);
/// Unless writing takes more than one part in so many of the time.
const MOST_WRITING: u32 = 50;

pub fn run(args: RenderArgs) -> Result<ExitCode> {
    let (settings, layers) = args.settings.resolve()?;
    let files = PictureFiles::of(&args.output)?;
    if args.atlas {
        files.must_hold_layers("--atlas")?;
    }
    if args.cryptomatte {
        files.must_hold_layers("--cryptomatte")?;
    }
    if let Some(asked) = args.threads {
        start_threads(asked, args.quiet)?;
    }
    let begin = Instant::now();
    let interrupt = Interrupt::listen();
    let loaded = args.scene.load_with_files()?;
    files.claim(&loaded.files, args.overwrite, args.quiet)?;
    let mut scene = loaded.scene;
    let settings = args.settings.film(settings, &mut scene);
    files.check_size((settings.width, settings.height))?;
    let tell = |line: &dyn Display| {
        if !args.quiet {
            say(line);
        }
    };
    scene.notes.iter().for_each(|note| tell(&format_args!("note: {note}")));
    let settings = Settings { atlas: args.atlas, memory: machine::memory(), ..settings };
    let preview = args.preview.over(Preview::usual(&scene));
    let (size, seed) = ((settings.width, settings.height), settings.seed);
    let whole = args.cryptomatte.then(|| scene.clone());
    let mut render = Render::new(scene, settings, &layers)?;
    let mattes = whole.map(|scene| Mattes::of(&scene, size, seed));
    announce(&render, tell);
    let mut writer = Writer::new(files, preview, mattes, args.quiet);
    let mut pace = Pace::new(begin, args.time);
    if let Some(line) = pace.fit(&mut render) {
        tell(&format_args!("note: {line}"));
    }
    let mut progress = Progress::new(args.quiet, &render, &args.limits());
    let next_write = if args.atlas { LONGEST_SILENCE } else { begin.elapsed() };
    let mut under_way = UnderWay { args: &args, begin, interrupt: &interrupt, pace, next_write };
    under_way.passes(&mut render, &mut progress, &mut writer);
    progress.finish(&render, begin.elapsed());
    let written = writer.at_the_end(&render)?;
    tell(&format_args!("wrote {written}"));
    args.limits().check(render.error())?;
    Ok(interrupt.exit_code().map_or(ExitCode::SUCCESS, ExitCode::from))
}

/// What is said of a render before its first pass.
fn announce(render: &Render, tell: impl Fn(&dyn Display)) {
    if let Some(warning) = render.plan().existence.warning().filter(|_| render.atlas_run().is_none()) {
        tell(&format_args!("warning: {warning}"));
    }
    if let Some(atlas) = render.atlas_run() {
        tell(&atlas.describe());
    }
    let backs = render.plan().looked_through();
    if !backs.is_empty() {
        tell(&format_args!(
            "note: the camera looks through the backs of {}, as glTF's viewers do (extras `backs`: \"seen\" shows them)",
            listed(backs.iter().map(String::as_str))
        ));
    }
}

/// A render on its way to one of its limits.
struct UnderWay<'a> {
    args: &'a RenderArgs,
    begin: Instant,
    interrupt: &'a Interrupt,
    pace: Pace,
    /// When the picture is written next, since the beginning.
    next_write: Duration,
}

impl UnderWay<'_> {
    fn tell(&self, line: &dyn Display) {
        if !self.args.quiet {
            say(line);
        }
    }

    /// Renders until a limit is reached or the end is wished.
    fn passes(&mut self, render: &mut Render, progress: &mut Progress, writer: &mut Writer) {
        let limits = self.args.limits();
        loop {
            let done = render.film().passes();
            let left = limits.passes.map_or(u32::MAX, |limit| limit.saturating_sub(done));
            let most = left.min(self.pace.most(done));
            if most == 0 {
                break;
            }
            render.stop_at(self.interrupt.stop().at(self.pace.deadline(done)));
            let passing = Instant::now();
            if render.passes(most) == 0 {
                // The pass under way was dropped.
                match self.pace.again(done, render) {
                    Some(line) => self.tell(&format_args!("note: {line}")),
                    None => break,
                }
                continue;
            }
            self.pace.took(passing.elapsed().as_secs_f64());
            self.interrupt.begun();
            let elapsed = self.begin.elapsed();
            let error = render.error();
            progress.show(render, elapsed, error);
            if self.interrupt.stop().is_wished() || limits.reached(render.film().passes(), elapsed, error) {
                break;
            }
            if elapsed >= self.next_write {
                writer.on_the_way(render);
                // An atlas is a hundred pictures, which take their time to be written.
                let writing = self.begin.elapsed() - elapsed;
                self.next_write = elapsed + elapsed.min(LONGEST_SILENCE).max(MOST_WRITING * writing);
            }
        }
    }
}

fn start_threads(asked: u16, quiet: bool) -> Result<()> {
    let (threads, fewer) = super::threads::threads(asked);
    if let Some(processors) = fewer.filter(|_| !quiet) {
        say(format_args!("note: --threads {asked}: for {processors} processors {threads} are used"));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build_global().map_err(|why| Error::Usage(format!("--threads {asked}: {why}")))
}

/// What ends a render: the first of these that is reached.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// So many passes.
    pub passes: Option<u32>,
    /// So much time.
    pub time: Option<Duration>,
    /// Relative error below this.
    pub error: Option<f64>,
}

/// The spread of so few passes is not yet a measure of error.
const FEWEST_PASSES_FOR_AN_ERROR: u32 = 8;

impl Limits {
    fn reached(&self, passes: u32, elapsed: Duration, error: Option<ErrorEstimate>) -> bool {
        self.passes.is_some_and(|limit| passes >= limit)
            || self.time.is_some_and(|limit| elapsed >= limit)
            || (passes >= FEWEST_PASSES_FOR_AN_ERROR
                && self
                    .error
                    .zip(error)
                    .is_some_and(|(limit, error)| error.total() <= limit || is_lost(error)))
    }

    /// An error to reach that never can be.
    fn check(&self, error: Option<ErrorEstimate>) -> Result<()> {
        match (self.error, error) {
            (Some(limit), Some(error)) if is_lost(error) => Err(Error::Usage(format!(
                "--error {limit} cannot be reached: some pixels are not finite numbers, and so is the error; scale the lamps down"
            ))),
            _ => Ok(()),
        }
    }
}

/// Once a pixel is not finite the error never is again.
fn is_lost(error: ErrorEstimate) -> bool {
    !error.total().is_finite()
}

impl RenderArgs {
    fn limits(&self) -> Limits {
        let none = self.passes.is_none() && self.time.is_none() && self.error.is_none();
        Limits {
            passes: if none { Some(DEFAULT_PASSES) } else { self.passes },
            time: self.time,
            error: self.error,
        }
    }
}

pub(super) fn duration(text: &str) -> std::result::Result<Duration, String> {
    let wrong = || format!("`{text}` is no time; write a number with s, m or h, as in 30s");
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let scale = match unit {
        "s" | "" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(wrong()),
    };
    let seconds = number.parse::<f64>().map_err(|_| wrong())? * scale;
    Duration::try_from_secs_f64(seconds).ok().filter(|time| !time.is_zero()).ok_or_else(wrong)
}

fn positive(text: &str) -> std::result::Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|x| *x > 0.0 && x.is_finite());
    value.ok_or_else(|| format!("`{text}` is no error to reach; write a fraction above zero, as in 0.01"))
}
