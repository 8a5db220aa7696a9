use super::interrupt::Interrupt;
use super::keep::{KEPT, Keep, KeepArgs};
use super::limits::{Limits, Passes, bytes, duration, memory_below, passes, positive};
use super::out::say;
use super::output::{Overwrite, PictureFiles};
use super::preview_args::PreviewArgs;
use super::progress::{Progress, Told};
use super::scene_args::SceneArgs;
use super::settings_args::SettingsArgs;
use super::threads::{number, start_threads};
use super::writer::{Writer, patiently, write_picture};
use crate::error::{Error, Result};
use crate::film::{Film, Preview, StateFile};
use crate::mattes::Mattes;
use crate::memory::Memory;
use crate::plan::Settings;
use crate::render::{Pace, Render, key};
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
    /// the mean square over pixels.
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
    keep: KeepArgs,

    /// Memory that the render may take, as in 2GiB; one that takes more is refused before it begins. Default: what the machine has left.
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    memory: Option<u64>,

    #[command(flatten)]
    preview: PreviewArgs,

    /// How the render is told while it runs, on standard error; json: pass, seconds, error, bias and eta (seconds) of each pass.
    #[arg(long, value_enum, default_value_t = Told::Auto)]
    progress: Told,

    /// Print nothing but errors, and what --progress json says.
    #[arg(short, long)]
    quiet: bool,
}

/// Passes of a render that was given no limit.
const DEFAULT_PASSES: u32 = 64;
/// The longest time between two pictures on disk.
const LONGEST_SILENCE: Duration = Duration::from_secs(60);
/// Unless writing takes more than one part in so many of the time.
const MOST_WRITING: u32 = 50;

pub fn run(args: &RenderArgs) -> Result<ExitCode> {
    let (settings, layers) = args.settings.resolve()?;
    let files = PictureFiles::of(&args.output)?;
    if args.atlas {
        files.must_hold_layers("--atlas")?;
    }
    if args.cryptomatte {
        files.must_hold_layers("--cryptomatte")?;
    }
    let mut keep = Keep::of(args.keep, args.passes(), &args.output, files.device, args.atlas)?;
    let limits = Limits { passes: keep.schedule.len(), time: args.time, error: args.error };
    if let Some(asked) = args.threads {
        start_threads(asked, args.quiet)?;
    }
    let begin = Instant::now();
    let interrupt = Interrupt::listen(keep.asked.then_some(KEPT));
    let loaded = args.scene.load_with_files()?;
    files.claim(&loaded.files, args.overwrite, args.quiet)?;
    keep.claim(&loaded.files, args.overwrite)?;
    let mut scene = loaded.scene;
    let settings = args.settings.film(settings, &mut scene);
    files.check_size((settings.width, settings.height))?;
    scene.notes.iter().for_each(|note| args.tell(&format_args!("note: {note}")));
    let memory = memory_below(args.memory);
    let settings = Settings { atlas: args.atlas, memory, ..settings };
    let preview = args.preview.over(Preview::usual(&scene));
    let (size, seed) = ((settings.width, settings.height), settings.seed);
    let mattes = |held: Memory| if args.cryptomatte { held.with_mattes(size) } else { held };
    mattes(Memory::of_pixels(&settings, &layers)).check(memory)?;
    let state = if keep.asked { keep.found(&key(scene.hash(), &settings))? } else { None };
    let state = match state {
        Some(state) if keep.is_complete(state.head(), limits.time) => {
            let mattes = args.cryptomatte.then(|| Mattes::of(&scene, size, seed));
            return complete_already(args, &files, state, mattes.as_ref(), preview);
        }
        state => state,
    };
    let whole = args.cryptomatte.then(|| scene.clone());
    let mut render = Render::new(scene, settings, &layers)?;
    mattes(render.memory()).check(memory)?;
    let mattes = whole.map(|scene| Mattes::of(&scene, size, seed));
    render.follow(keep.schedule);
    announce(&render, |line| args.tell(line));
    let spent = args.go_on(&mut render, &keep, state)?;
    let time = limits.time.map(|time| time.saturating_sub(spent));
    let mut pace = Pace::new(begin, time, render.film().passes());
    if !keep.dealt
        && spent.is_zero()
        && let Some(line) = pace.fit(&mut render)
    {
        args.tell(&format_args!("note: {line}"));
    }
    let mut progress = Progress::new(args.quiet, args.progress, &render, &limits);
    let next_write = if args.atlas { LONGEST_SILENCE } else { begin.elapsed() };
    let limits = Limits { time, ..limits };
    let mut writer = Writer::new(files, preview, mattes, args.quiet);
    let mut under_way =
        UnderWay { args, limits, begin, interrupt: &interrupt, pace, keep, preview, next_write };
    let end = under_way.passes(&mut render, &mut progress, &mut writer);
    let keep = under_way.keep;
    progress.finish(&render, begin.elapsed());
    if render.film().passes() == 0 {
        return Err(Error::Usage(
            "--stop-after: not one pass was complete by then; give more time, or fewer --photons".into(),
        ));
    }
    // First, as the picture follows from it.
    if let Some(path) = keep.at_the_end(begin.elapsed()) {
        patiently(false, || render.save(path, preview))?;
        args.tell(&format_args!("stored the state in {}", path.display()));
    }
    let written = writer.at_the_end(&render)?;
    args.tell(&format_args!("wrote {written}"));
    limits.check(render.error())?;
    Ok(match end {
        End::Complete if keep.asked => ExitCode::SUCCESS,
        End::Stopped if keep.asked => {
            args.tell(&"not complete: the same command with --resume goes on");
            ExitCode::from(KEPT)
        }
        _ => interrupt.exit_code().map_or(ExitCode::SUCCESS, ExitCode::from),
    })
}

/// A render of which nothing is left to do: its picture, from its state.
fn complete_already(
    args: &RenderArgs,
    files: &PictureFiles,
    state: StateFile,
    mattes: Option<&Mattes>,
    preview: Preview,
) -> Result<ExitCode> {
    let head = state.head().clone();
    let mut film = Film::new(head.width, head.height, &head.layers);
    state.add_to(&mut film)?;
    write_picture(files, &film, head.header(), (None, mattes), preview)?;
    let written = files.describe();
    args.tell(&format_args!("complete: the state has all {} passes; wrote {written}", head.passes.len()));
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

/// How a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// A limit was reached.
    Complete,
    /// By a signal, or by --stop-after.
    Stopped,
}

/// A render on its way to one of its limits.
struct UnderWay<'a> {
    args: &'a RenderArgs,
    limits: Limits,
    begin: Instant,
    interrupt: &'a Interrupt,
    pace: Pace,
    keep: Keep,
    preview: Preview,
    /// When the picture is written next, since the beginning.
    next_write: Duration,
}

impl UnderWay<'_> {
    /// Renders until a limit is reached or the end is wished.
    fn passes(&mut self, render: &mut Render, progress: &mut Progress, writer: &mut Writer) -> End {
        if render.film().passes() > 0 {
            self.interrupt.begun();
        }
        let mut error = render.error();
        loop {
            let done = render.film().passes();
            let most = render.left().unwrap_or(u32::MAX).min(self.pace.most(done));
            // The first is always completed.
            if most == 0 || (done > 0 && self.limits.reached(done, self.begin.elapsed(), error)) {
                return End::Complete;
            }
            if self.is_stopped() {
                return End::Stopped;
            }
            render.stop_at(self.interrupt.stop().at(self.deadline(done)));
            let passing = Instant::now();
            if render.passes(most) == 0 {
                // The pass under way was dropped.
                if self.is_stopped() {
                    return End::Stopped;
                }
                match self.pace.again(done, render) {
                    Some(line) => self.args.tell(&format_args!("note: {line}")),
                    None => return End::Complete,
                }
                continue;
            }
            self.pace.took(passing.elapsed().as_secs_f64());
            self.interrupt.begun();
            error = render.error();
            progress.show(render, self.begin.elapsed(), error);
            self.store(render, writer);
        }
    }

    /// When passes under way are dropped.
    fn deadline(&self, done: u32) -> Option<Instant> {
        let stop = self.keep.stop_after().map(|time| self.begin + time);
        self.pace.deadline(done).into_iter().chain(stop).min()
    }

    fn is_stopped(&self) -> bool {
        self.interrupt.stop().is_wished()
            || self.keep.stop_after().is_some_and(|time| self.begin.elapsed() >= time)
    }

    /// Writes state and picture when it is time to.
    fn store(&mut self, render: &Render, writer: &mut Writer) {
        if self.is_stopped() {
            return;
        }
        if let Some(line) = self.keep.on_the_way(render, self.preview, self.begin.elapsed()) {
            self.args.tell(&line);
        }
        let elapsed = self.begin.elapsed();
        if elapsed >= self.next_write {
            writer.on_the_way(render);
            // An atlas is a hundred pictures, which take their time to be written.
            let writing = self.begin.elapsed() - elapsed;
            self.next_write = elapsed + elapsed.min(LONGEST_SILENCE).max(MOST_WRITING * writing);
        }
    }
}

impl RenderArgs {
    fn tell(&self, line: &dyn Display) {
        if !self.quiet {
            say(line);
        }
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
