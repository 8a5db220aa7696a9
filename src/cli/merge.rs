use super::denoise_args::{DenoiseArgs, too_few};
use super::out::say;
use super::output::{Overwrite, PictureFiles, claim, ending};
use super::preview_args::PreviewArgs;
use super::writer::{Beside, write_picture};
use crate::error::{Error, Result};
use crate::film::{Film, StateFile, StateHead, write_state};
use crate::machine;
use crate::memory::Memory;
use crate::plan::Settings;
use crate::render::{film_for, tell_error};
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Args)]
pub struct MergeArgs {
    /// States that `halflight render --shard`, `--passes A..B` or `--checkpoint` stored, or `halflight merge`.
    #[arg(required = true, value_name = "STATE")]
    states: Vec<PathBuf>,

    /// What all of them make together: .exr holds all layers and has a PNG preview beside it; .png and .jpg hold what a display
    /// shows, .pfm and .hdr linear light; - is an EXR file to standard output; .halflight is a state again, to be resumed or merged with others.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    #[command(flatten)]
    overwrite: Overwrite,

    #[command(flatten)]
    denoise: DenoiseArgs,

    #[command(flatten)]
    preview: PreviewArgs,

    /// Print nothing but errors.
    #[arg(short, long)]
    quiet: bool,
}

pub fn run(args: &MergeArgs) -> Result<ExitCode> {
    let state = (ending(&args.output) == "halflight").then_some(args.output.as_path());
    let files = if state.is_some() { None } else { Some(PictureFiles::of(&args.output)?) };
    if let Some(state) = state {
        claim(state, &args.states, args.overwrite)?;
    }
    files.iter().try_for_each(|files| files.claim(&args.states, args.overwrite, args.quiet))?;
    let (heads, mut whole) = heads(&args.states)?;
    args.check_denoising(&whole, state.is_some())?;
    whole.preview = args.preview.over(whole.preview);
    files.iter().try_for_each(|files| files.check_size((whole.width, whole.height)))?;
    let film = film(&args.states, &heads, &whole)?;
    whole.facts = whole.header();
    tell_error(&mut whole.facts, &film);
    if let Some(state) = state {
        write_state(state, &whole, &film)?;
    }
    let denoising = args.denoise.denoise.then_some(film.layers());
    let beside = Beside { denoising, ..Beside::default() };
    files.iter().try_for_each(|files| write_picture(files, &film, whole.header(), &beside, whole.preview))?;
    if !args.quiet {
        too_few(film.passes()).filter(|_| args.denoise.denoise).iter().for_each(say);
        let written = files.map_or_else(|| args.output.display().to_string(), |files| files.describe());
        let (passes, states) = (whole.passes.len(), args.states.len());
        say(format_args!("{passes} passes ({}) of {states} states; wrote {written}", whole.passes));
    }
    Ok(ExitCode::SUCCESS)
}

impl MergeArgs {
    /// Whether there is what the denoiser looks at, and memory for it.
    fn check_denoising(&self, whole: &StateHead, is_state: bool) -> Result<()> {
        if !self.denoise.denoise {
            return Ok(());
        }
        if is_state {
            return Err(Error::Usage(format!(
                "--denoise: {} is a state, which holds the passes as they are; leave it out, or give -o the name of a picture",
                self.output.display()
            )));
        }
        self.denoise.check(&self.states[0], whole)?;
        let size = (whole.width, whole.height);
        let film = Memory::of_pixels(&Settings::for_film(size.0, size.1), &whole.layers);
        Memory { pass: 0, ..film }.with_denoising(size).check(machine::memory())
    }
}

/// What every state says of itself, and what all do together. Nothing is added yet, so that what does not belong together is told at once.
fn heads(states: &[PathBuf]) -> Result<(Vec<u64>, StateHead)> {
    let mut heads = Vec::new();
    let mut whole: Option<(StateHead, &Path)> = None;
    for path in states {
        let state = StateFile::open(path)?;
        state.must_add_up()?;
        let head = state.head();
        heads.push(mark(head));
        match &mut whole {
            None => whole = Some((head.clone(), path)),
            Some((whole, first)) => {
                whole.join(head).map_err(|why| apart(path, first, states, head, &why))?;
            }
        }
    }
    let (whole, _) = whole.expect("a state is required");
    Ok((heads, whole))
}

/// Why a state cannot be added to those before it, the first of which is `first`.
fn apart(path: &Path, first: &Path, states: &[PathBuf], head: &StateHead, why: &str) -> Error {
    let open = |other: &PathBuf| StateFile::open(other).ok();
    let has_it = |other: &&PathBuf| {
        open(other).is_some_and(|other| other.head().passes.common(&head.passes).is_some())
    };
    let twice = why.starts_with("pass ") && why.ends_with("in both");
    let other = if twice { states.iter().take_while(|other| *other != path).find(has_it) } else { None };
    let other = other.map_or(first, PathBuf::as_path).display();
    let reason = format!("it does not belong to {other}: {why}; leave one of them out");
    Error::Image { path: path.into(), reason }
}

/// A state that was changed in between has another.
fn mark(head: &StateHead) -> u64 {
    head.nanoseconds ^ u64::from(head.passes.len()) << 32
}

/// All sums together: the memory of one film and of a row, and later of the picture that is written.
fn film(states: &[PathBuf], marks: &[u64], whole: &StateHead) -> Result<Film> {
    let mut film = film_for(whole)?;
    for (path, expected) in states.iter().zip(marks) {
        let state = StateFile::open(path)?;
        if mark(state.head()) != *expected {
            let reason = "it was changed while it was merged; merge again when its render has ended".into();
            return Err(Error::Image { path: path.clone(), reason });
        }
        state.add_to(&mut film)?;
    }
    Ok(film)
}
