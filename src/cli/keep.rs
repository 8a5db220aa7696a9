//! The state of a render, kept beside its picture: docs/cluster.md.

use super::limits::{Passes, Shard, duration, shard};
use super::output::{Overwrite, claim};
use crate::error::{Error, Result};
use crate::film::{Key, Place, Preview, Schedule, StateFile, StateHead};
use crate::render::{Render, another_picture};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What is kept of a render on the way, and what it goes on from.
#[derive(Args, Clone, Copy, Debug)]
pub struct KeepArgs {
    /// Store the state of the render so often, as in 60s, beside the picture (.halflight in place of its ending), and at the
    /// end. Default: 60s, from the first minute on; with --atlas none.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    checkpoint: Option<Duration>,

    /// Go on from the stored state, if there is one. It must be of the same scene and settings. --passes and --time count what
    /// was rendered before.
    #[arg(long)]
    resume: bool,

    /// The same, but there must be a state: for more passes than a render had, or a smaller --error.
    #[arg(long)]
    extend: bool,

    /// Render one share of all passes, for `halflight merge`: of N shares the Kth, which is every Nth pass. Goes on from a stored
    /// state, as --resume does; passes are as large as the plan or --photons says, whatever --time is.
    #[arg(long, value_name = "K/N", value_parser = shard)]
    shard: Option<Shard>,

    /// Stop after so much time, as --time does; but the render is not complete then: its state is kept, and the exit code is 85.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    stop_after: Option<Duration>,
}

/// The exit code of a render that is not complete and whose state is kept.
pub const KEPT: u8 = 85;
/// How often a state is stored that nobody asked for.
const EVERY: Duration = Duration::from_secs(60);
/// And no more often than it takes this many times as long as storing it.
const MOST_STORING: u32 = 100;

/// Where the state of a render is, and which passes it has.
pub struct Keep {
    args: KeepArgs,
    /// None: no state is stored.
    path: Option<PathBuf>,
    /// True: by the user. Then the exit code tells whether the render is complete.
    pub asked: bool,
    /// Passes of these numbers alone were asked for.
    pub dealt: bool,
    /// Which passes are rendered.
    pub schedule: Schedule,
    next: Duration,
    stored: bool,
    failing: bool,
}

impl Keep {
    /// As arguments say; `passes` without an end: None.
    ///
    /// # Errors
    /// There can be no state.
    pub fn of(
        args: KeepArgs,
        passes: Option<Passes>,
        output: &Path,
        device: bool,
        atlas: bool,
    ) -> Result<Self> {
        let range = matches!(passes, Some(Passes::Range(..)));
        let dealt = range || args.shard.is_some();
        let asked =
            args.checkpoint.is_some() || args.resume || args.extend || args.stop_after.is_some() || dealt;
        if asked && device {
            return Err(Error::Usage(format!(
                "{}: a device has no stored state; leave --checkpoint, --resume, --extend, --shard, --stop-after and --passes A..B out",
                output.display()
            )));
        }
        if dealt && atlas {
            return Err(Error::Usage(
                "--atlas: the sums of an atlas depend on the order of its passes, so that shares of them do not add up; leave --shard and \
                 --passes A..B out"
                    .into(),
            ));
        }
        let (first, end) = match passes {
            None => (0, None),
            Some(Passes::First(all)) => (0, Some(all)),
            Some(Passes::Range(first, end)) => (first, Some(end)),
        };
        let schedule = args.shard.unwrap_or(Shard::WHOLE).schedule(first, end);
        if let Some(Shard { which, of }) = args.shard.filter(|_| schedule.is_empty()) {
            return Err(Error::Usage(format!(
                "--shard {which}/{of}: none of the passes {first}..{} is its own; give more passes or fewer shards",
                end.unwrap_or(u32::MAX)
            )));
        }
        // That of an atlas is as large as its picture: kilobytes a pixel that nobody asked for.
        let path = (!device && (asked || !atlas)).then(|| output.with_extension("halflight"));
        let next = args.checkpoint.unwrap_or(EVERY);
        Ok(Self { args, path, asked, dealt, schedule, next, stored: false, failing: false })
    }

    /// When the render is to end, whether it is complete or not.
    pub fn stop_after(&self) -> Option<Duration> {
        self.args.stop_after
    }

    /// Refuses a place for the state that must not be replaced. Where nobody asked for a state there is none then.
    pub fn claim(&mut self, inputs: &[PathBuf], overwrite: Overwrite) -> Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        let claimed = claim(path, inputs, overwrite).and_then(|place| match place {
            Place::Device => {
                let reason = "this is a device, which keeps no state".into();
                Err(Error::Write { path: path.clone(), reason })
            }
            _ => Ok(()),
        });
        match claimed {
            Ok(()) => Ok(()),
            Err(refused) if self.asked => Err(refused),
            Err(_) => {
                self.path = None;
                Ok(())
            }
        }
    }

    /// The state to go on from. None: the render begins.
    ///
    /// # Errors
    /// One line: it is of another picture or has passes that are not asked for, or is damaged, or there must be one and is none.
    pub fn found(&self, key: &Key) -> Result<Option<StateFile>> {
        let Some(path) = self.path.as_ref().filter(|_| self.args.resume || self.args.extend || self.dealt)
        else {
            return Ok(None);
        };
        // An empty file is one that was made for us, by `mktemp` say.
        if !path.exists() || std::fs::metadata(path).is_ok_and(|there| there.is_file() && there.len() == 0) {
            if self.args.extend {
                let path = path.display();
                return Err(Error::Usage(format!(
                    "--extend: there is no state {path}; --resume would begin one"
                )));
            }
            return Ok(None);
        }
        let state = StateFile::open(path)?;
        if let Some(difference) = key.difference(&state.head().key) {
            return Err(another_picture(path, &difference));
        }
        let foreign = state.head().passes.iter().find(|pass| !self.schedule.contains(*pass));
        match foreign.filter(|_| self.dealt) {
            Some(pass) => Err(another_picture(path, &format!("it has pass {pass}, which is not asked for"))),
            None => Ok(Some(state)),
        }
    }

    /// Whether nothing is left to do.
    pub fn is_complete(&self, head: &StateHead, time: Option<Duration>) -> bool {
        let spent = Duration::from_nanos(head.nanoseconds);
        self.schedule.next(&head.passes).is_none() || time.is_some_and(|time| spent >= time)
    }

    /// The name of the state.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Stores the state when it is time to. Where that fails the render goes on; the line says so once.
    pub fn on_the_way(&mut self, render: &Render, preview: Preview, elapsed: Duration) -> Option<String> {
        let path = self.path.as_ref().filter(|_| elapsed >= self.next)?;
        let begin = Instant::now();
        let saved = render.save(path, preview);
        let took = begin.elapsed();
        let every = self.args.checkpoint.unwrap_or_else(|| EVERY.max(MOST_STORING * took));
        self.next = elapsed + took + every;
        self.stored |= saved.is_ok();
        match saved {
            Ok(()) => std::mem::take(&mut self.failing).then(|| "the state can be stored again".into()),
            Err(e) => (!std::mem::replace(&mut self.failing, true))
                .then(|| format!("warning: {e}; the render goes on, and storing its state is tried again")),
        }
    }

    /// Where the state is stored at the end. None: it is not.
    pub fn at_the_end(&self, elapsed: Duration) -> Option<&Path> {
        self.path().filter(|_| self.asked || self.stored || elapsed >= EVERY)
    }
}
