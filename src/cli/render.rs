use super::denoise_args::{DenoiseArgs, too_few};
use super::interrupt::Interrupt;
use super::keep::{KEPT, Keep, KeepArgs};
use super::limits::{Limits, Passes, bytes, duration, memory_below, passes, positive};
use super::live::{LOOK_ABOUT, LiveArgs, Viewers};
use super::out::say;
use super::output::{Overwrite, PictureFiles};
use super::preview_args::PreviewArgs;
use super::progress::{Progress, Told};
use super::scene_args::SceneArgs;
use super::settings_args::SettingsArgs;
use super::threads::{number, start_threads};
use super::under_way::{LONGEST_SILENCE, UnderWay};
use super::watch::Watch;
use super::writer::{Beside, Writer, write_picture};
use crate::atlas::AtlasSums;
use crate::error::{Error, Result};
use crate::film::{Film, Layer, Preview, StateFile};
use crate::machine::MemoryLimit;
use crate::mattes::Mattes;
use crate::memory::Memory;
use crate::plan::Settings;
use crate::render::{Pace, Render, key, tell_error};
use crate::scene::Loaded;
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

    /// Stop after so many passes; A..B: render only those from number A up to B, without B, for `halflight merge`. Without --passes,
    /// --time and --error: 64. The first limit reached ends the render.
    #[arg(long, value_name = "N|A..B", value_parser = passes)]
    passes: Option<Passes>,

    /// Stop after so much time, as in 30s, 5m, 1h. Passes are made of fewer photons (or samples) where one would take more
    /// than a tenth of it; one that has not ended soon after the time is dropped. The first is always completed.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    time: Option<Duration>,

    /// Stop when the relative error of the picture is below this: standard error and estimated bias together, root of
    /// the mean square over pixels. An error that rests upon few bright paths is not trusted: the render goes on.
    #[arg(long, value_name = "FRACTION", value_parser = positive)]
    error: Option<f64>,

    /// Threads, at most four for each processor; the picture does not depend on it. Default: one for each processor.
    #[arg(long, value_name = "N", value_parser = number)]
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
    denoise: DenoiseArgs,

    #[command(flatten)]
    keep: KeepArgs,

    /// Memory that the render may take, as in 2GiB; one that takes more is refused before it begins. Default: what the machine has left.
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    memory: Option<u64>,

    #[command(flatten)]
    preview: PreviewArgs,

    #[command(flatten)]
    live: LiveArgs,

    /// How the render is told while it runs, on standard error; json: pass, seconds, error, bias and eta (seconds) of each pass.
    #[arg(long, value_enum, default_value_t = Told::Auto)]
    progress: Told,

    /// Print nothing but errors, and what --progress json says.
    #[arg(short, long)]
    quiet: bool,
}

/// Passes of a render that was given no limit.
const DEFAULT_PASSES: u32 = 64;

pub fn run(args: &RenderArgs) -> Result<ExitCode> {
    let begin = Instant::now();
    let (settings, asked) = args.settings.resolve()?;
    let layers = args.denoise.layers(&asked, settings.method, args.atlas)?;
    let files = PictureFiles::of(&args.output)?;
    let holds = [("--atlas", args.atlas), ("--cryptomatte", args.cryptomatte)];
    holds.iter().filter(|(_, asked)| *asked).try_for_each(|(option, _)| files.must_hold_layers(option))?;
    let keep = args.keep(&files)?;
    if args.live.watch && (keep.asked || files.device) {
        return Err(Error::Usage(
            "--watch renders many pictures, one after another, to a file; leave --checkpoint, --resume, --extend, --shard, \
             --stop-after, --passes A..B and devices out"
                .into(),
        ));
    }
    if let Some(asked) = args.threads {
        start_threads(asked, args.quiet)?;
    }
    let interrupt = Interrupt::listen(keep.asked.then_some(KEPT));
    let viewers = args.live.open(&args.output)?;
    let mut loaded = args.scene.load_with_files()?;
    let watch = match args.live.watch {
        true => Some(Watch::begin(&args.scene, &loaded, &viewers.board, args.quiet)?),
        false => None,
    };
    let mut job = Job { args, settings, asked, layers, files, begin, interrupt, viewers, watch };
    let mut end = job.render(loaded);
    while let Some(next) = job.next(&mut end)? {
        loaded = next;
        job.begin = Instant::now();
        end = job.render(loaded);
    }
    job.viewers.finish();
    end.map(|end| end.unwrap_or(ExitCode::SUCCESS))
}

/// What was asked for, whatever the scene is at the moment.
struct Job<'a> {
    args: &'a RenderArgs,
    settings: Settings,
    /// Of the file.
    asked: Vec<Layer>,
    /// Of the film.
    layers: Vec<Layer>,
    files: PictureFiles,
    /// Of the render under way.
    begin: Instant,
    interrupt: Interrupt,
    viewers: Viewers,
    watch: Option<Watch>,
}

impl Job<'_> {
    /// Renders a scene to its end. None: given up, for there is another scene.
    fn render(&self, loaded: Loaded) -> Result<Option<ExitCode>> {
        let Self { args, interrupt, viewers, begin, .. } = self;
        interrupt.begins_anew();
        viewers.board.begins();
        let mut keep = args.keep(&self.files)?;
        let limits = Limits { passes: keep.schedule.len(), time: args.time, error: args.error };
        self.files.claim(&loaded.files, args.overwrite, args.quiet)?;
        keep.claim(&loaded.files, args.overwrite)?;
        let mut scene = loaded.scene;
        let settings = args.settings.film(self.settings.clone(), &mut scene);
        let (size, seed) = ((settings.width, settings.height), settings.seed);
        self.files.check_size(size)?;
        scene.notes.iter().for_each(|note| args.tell(&format_args!("note: {note}")));
        let settings = Settings { atlas: args.atlas, memory: self.memory(size), ..settings };
        let preview = args.preview.over(Preview::usual(&scene));
        let beside = |held: Memory| {
            let held = if args.cryptomatte { held.with_mattes(size) } else { held };
            if args.denoise.denoise { held.with_denoising(size) } else { held }
        };
        let held = beside(Memory::of_pixels(&settings, &self.layers));
        held.check(settings.memory)?;
        let state = if keep.asked { keep.found(&key(scene.hash(), &settings))? } else { None };
        if let (Some(state), Some(path)) = (&state, keep.path()) {
            args.denoise.check(path, state.head())?;
        }
        let denoising = args.denoise.denoise.then(|| self.asked.clone());
        let state = match state {
            Some(state) if keep.is_complete(state.head(), limits.time) => {
                let mattes = args.cryptomatte.then(|| Mattes::of(&scene, size, seed));
                let beside = Beside { atlas: None, mattes: mattes.as_ref(), denoising: denoising.as_deref() };
                let atlas = AtlasSums::bytes_of(state.head());
                held.with_atlas(atlas, 1, size).check(settings.memory)?;
                return complete_already(args, &self.files, state, &beside, preview).map(Some);
            }
            state => state,
        };
        let whole = args.cryptomatte.then(|| scene.clone());
        let mut render = Render::new(scene, settings, &self.layers)?;
        beside(render.memory()).check(render.plan().settings.memory)?;
        let mattes = whole.map(|scene| Mattes::of(&scene, size, seed));
        render.follow(keep.schedule);
        announce(&render, |line| args.tell(line));
        let spent = args.go_on(&mut render, &keep, state)?;
        let time = limits.time.map(|time| time.saturating_sub(spent));
        let mut pace = Pace::new(*begin, time, render.film().passes());
        let fits = !keep.dealt && spent.is_zero();
        let fitted = if fits { pace.fit(&mut render) } else { None };
        fitted.iter().for_each(|line| args.tell(&format_args!("note: {line}")));
        let progress = Progress::new(args.quiet, args.progress, &render, &limits);
        let limits = Limits { time, ..limits };
        let writer = Writer::new(self.files.clone(), preview, mattes, denoising, args.quiet);
        let atlas_waits = args.atlas.then_some(LONGEST_SILENCE);
        let mut under_way = UnderWay {
            limits,
            begin: *begin,
            started: *begin,
            interrupt,
            viewers,
            watch: self.watch.as_ref(),
            pace,
            keep,
            preview,
            next_write: atlas_waits.unwrap_or_else(|| begin.elapsed()),
            progress,
            writer,
            once: self.files.device,
            quiet: args.quiet,
        };
        under_way.complete(&mut render)
    }

    /// The memory that a render of this size may take beside those who watch it.
    fn memory(&self, size: (u32, u32)) -> Option<MemoryLimit> {
        let seen = self.viewers.bytes(size, &self.layers);
        let limit = memory_below(self.args.memory)?;
        Some(MemoryLimit { bytes: limit.bytes.saturating_sub(seen), ..limit })
    }

    /// The scene to render after a render that ended so. None: the program ends. Trouble with the first scene ends it too; with
    /// another it is said, and the next is waited for.
    fn next(&self, end: &mut Result<Option<ExitCode>>) -> Result<Option<Loaded>> {
        let Some(watch) = &self.watch else { return Ok(None) };
        match end {
            Ok(Some(_)) => return Ok(None),
            Ok(None) => {}
            Err(_) if self.viewers.board.facts().render == 1 => return Ok(None),
            Err(error) => {
                say(format_args!("watch: {error}; another scene is waited for"));
                self.viewers.board.tell(|facts| facts.note = Some(error.to_string()));
                *end = Ok(None);
            }
        }
        self.interrupt.idle(Some(0));
        while !watch.is_changed() {
            if self.viewers.board.is_quit() {
                return Ok(None);
            }
            self.viewers.board.wait(LOOK_ABOUT);
        }
        self.interrupt.idle(None);
        Ok(watch.take())
    }
}

/// A render of which nothing is left to do: its picture, from its state.
fn complete_already(
    args: &RenderArgs,
    files: &PictureFiles,
    state: StateFile,
    beside: &Beside<'_>,
    preview: Preview,
) -> Result<ExitCode> {
    let head = state.head().clone();
    let mut film = Film::new(head.width, head.height, &head.layers);
    let atlas = match args.atlas {
        true => Some(AtlasSums::of_annex(state.add_to_and_leave(&mut film)?)?),
        false => state.add_to(&mut film).map(|()| None)?,
    };
    let mut header = head.header();
    tell_error(&mut header, &film);
    write_picture(files, &film, header, &Beside { atlas: atlas.as_ref(), ..*beside }, preview)?;
    let written = files.describe();
    args.tell(&format_args!("complete: the state has all {} passes; wrote {written}", head.passes.len()));
    let too_few = too_few(head.passes.len()).filter(|_| args.denoise.denoise);
    too_few.iter().for_each(|note| args.tell(note));
    Ok(ExitCode::SUCCESS)
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

impl RenderArgs {
    fn tell(&self, line: &dyn Display) {
        if !self.quiet {
            say(line);
        }
    }

    /// What is kept, and which passes are rendered.
    fn keep(&self, files: &PictureFiles) -> Result<Keep> {
        Keep::of(self.keep, self.passes(), &self.output, files.device, self.atlas)
    }

    /// Which passes are rendered. None: as many as time and error take.
    fn passes(&self) -> Option<Passes> {
        let none = self.time.is_none() && self.error.is_none();
        self.passes.or(none.then_some(Passes::First(DEFAULT_PASSES)))
    }

    /// Goes on from a state; the time that was spent on it.
    fn go_on(&self, render: &mut Render, keep: &Keep, state: Option<StateFile>) -> Result<Duration> {
        let (Some(state), Some(path)) = (state, keep.path()) else { return Ok(Duration::ZERO) };
        let head = state.head().clone();
        render.resume(path, state)?;
        let (passes, path) = (head.passes.len(), path.display());
        self.tell(&format_args!("going on from {passes} passes ({}) in {path}", head.passes));
        Ok(Duration::from_nanos(head.nanoseconds))
    }
}
