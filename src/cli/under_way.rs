//! A render on its way to one of its limits, told to end, or to go on beyond them.

use super::interrupt::Interrupt;
use super::keep::{KEPT, Keep};
use super::limits::Limits;
use super::live::{Board, Facts, Goal, LOOK_ABOUT, Status, Viewers};
use super::out::say;
use super::progress::Progress;
use super::watch::Watch;
use super::writer::{Writer, patiently};
use crate::error::{Error, Result};
use crate::film::{Exposure, Preview, Schedule};
use crate::render::{ErrorEstimate, Pace, Render};
use std::fmt::Display;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// The longest time between two pictures on disk.
pub const LONGEST_SILENCE: Duration = Duration::from_secs(60);
/// Unless writing takes more than one part in so many of the time.
const MOST_WRITING: u32 = 50;

/// How passes ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// A limit was reached.
    Complete,
    /// By a signal, by --stop-after, or by those who watch.
    Stopped,
    /// The scene is another.
    Changed,
}

/// A render on its way to one of its limits.
pub struct UnderWay<'a> {
    pub limits: Limits,
    /// Moved on by the time in which the render waited.
    pub begin: Instant,
    /// When it began, whatever it waited for.
    pub started: Instant,
    pub interrupt: &'a Interrupt,
    pub viewers: &'a Viewers,
    pub watch: Option<&'a Watch>,
    pub pace: Pace,
    pub keep: Keep,
    pub preview: Preview,
    /// When the picture is written next, since the beginning.
    pub next_write: Duration,
    pub progress: Progress,
    pub writer: Writer,
    /// True where the picture can be written only once, to a device.
    pub once: bool,
    pub quiet: bool,
}

impl UnderWay<'_> {
    /// Renders, writes the picture, and goes on when those who watch want more. None: given up, for the scene is another.
    ///
    /// # Errors
    /// There is no picture, or it cannot be written.
    pub fn complete(&mut self, render: &mut Render) -> Result<Option<ExitCode>> {
        self.introduce(render);
        loop {
            let end = self.passes(render);
            if end == End::Changed {
                self.progress.give_up();
                return Ok(None);
            }
            self.write(render)?;
            let code = self.exit_code(end);
            if end == End::Stopped && !self.board().is_stopped() {
                // By a signal, or because its time is over.
                return Ok(Some(code));
            }
            match self.afterwards(render, end) {
                After::Quit => return Ok(Some(code)),
                After::Changed => return Ok(None),
                After::More(goal) => self.go_on(goal, render),
            }
        }
    }

    /// Renders until a limit is reached or the end is wished.
    fn passes(&mut self, render: &mut Render) -> End {
        if render.film().passes() > 0 {
            self.interrupt.begun();
        }
        let mut error = render.error();
        self.report(render, error, Status::Rendering);
        loop {
            let done = render.film().passes();
            if self.is_changed() {
                return End::Changed;
            }
            if self.is_stopped(done) {
                return End::Stopped;
            }
            if self.board().is_paused() && done > 0 {
                self.pause(render);
                continue;
            }
            if let Some(goal) = self.board().take_more() {
                self.go_on(goal, render);
            }
            let most = render.left().unwrap_or(u32::MAX).min(self.pace.most(done));
            // The first is always completed.
            if most == 0 || (done > 0 && self.limits.reached(done, self.begin.elapsed(), error)) {
                return End::Complete;
            }
            let stop = self.interrupt.stop().or(&self.board().ending());
            render.stop_at(stop.at(self.deadline(done)));
            let passing = Instant::now();
            if render.passes(most) == 0 {
                // The pass under way was dropped.
                if self.is_changed() || self.is_stopped(done) {
                    continue;
                }
                match self.pace.again(done, render) {
                    Some(line) => self.tell(&format_args!("note: {line}")),
                    None => return End::Complete,
                }
                continue;
            }
            self.pace.took(passing.elapsed().as_secs_f64());
            self.interrupt.begun();
            error = render.error();
            self.progress.show(render, self.begin.elapsed(), error);
            self.store(render);
            self.report(render, error, Status::Rendering);
            self.viewers.show(render.film(), self.preview);
        }
    }

    fn board(&self) -> &Board {
        &self.viewers.board
    }

    /// When passes under way are dropped.
    fn deadline(&self, done: u32) -> Option<Instant> {
        let stop = self.keep.stop_after().map(|time| self.started + time);
        self.pace.deadline(done).into_iter().chain(stop).min()
    }

    /// Whether the end is wished. Those who watch must wait for the first pass.
    fn is_stopped(&self, done: u32) -> bool {
        self.is_ended() || (done > 0 && self.board().is_stopped())
    }

    /// By a signal or the clock.
    fn is_ended(&self) -> bool {
        self.interrupt.stop().is_wished()
            || self.keep.stop_after().is_some_and(|time| self.started.elapsed() >= time)
    }

    fn is_changed(&self) -> bool {
        self.watch.is_some_and(Watch::is_changed)
    }

    /// Until it is to go on. That time does not count.
    fn pause(&mut self, render: &Render) {
        let waiting = Instant::now();
        self.viewers.show_now(render.film(), self.preview);
        let error = render.error();
        self.report(render, error, Status::Paused);
        while self.board().is_paused() && !self.is_stopped(1) && !self.is_changed() {
            self.board().wait(LOOK_ABOUT);
        }
        self.waited(waiting.elapsed());
        self.report(render, error, Status::Rendering);
    }

    fn waited(&mut self, time: Duration) {
        self.begin += time;
        self.pace.waited(time);
    }

    /// Writes state and picture when it is time to.
    fn store(&mut self, render: &Render) {
        if self.is_stopped(render.film().passes()) || self.is_changed() {
            return;
        }
        if let Some(line) = self.keep.on_the_way(render, self.preview, self.begin.elapsed()) {
            self.tell(&line);
        }
        let elapsed = self.begin.elapsed();
        if elapsed >= self.next_write {
            self.writer.on_the_way(render);
            // An atlas is a hundred pictures, which take their time to be written.
            let writing = self.begin.elapsed() - elapsed;
            self.next_write = elapsed + elapsed.min(LONGEST_SILENCE).max(MOST_WRITING * writing);
        }
    }

    /// Writes state and picture at the end.
    fn write(&mut self, render: &Render) -> Result<()> {
        self.progress.finish(render, self.begin.elapsed());
        self.viewers.show_now(render.film(), self.preview);
        if render.film().passes() == 0 {
            return Err(Error::Usage(
                "--stop-after: not one pass was complete by then; give more time, or fewer --photons".into(),
            ));
        }
        // First, as the picture follows from it.
        if let Some(path) = self.keep.at_the_end(self.begin.elapsed()) {
            patiently(false, || render.save(path, self.preview))?;
            self.tell(&format_args!("stored the state in {}", path.display()));
        }
        let written = self.writer.at_the_end(render)?;
        self.tell(&format_args!("wrote {written}"));
        let error = render.error();
        if let Some(doubt) = error.and_then(ErrorEstimate::warning) {
            self.tell(&format_args!("note: {doubt}"));
        }
        self.limits.check(error)
    }

    fn exit_code(&self, end: End) -> ExitCode {
        match end {
            End::Stopped if self.keep.asked => {
                self.tell(&"not complete: the same command with --resume goes on");
                ExitCode::from(KEPT)
            }
            _ if self.keep.asked => ExitCode::SUCCESS,
            _ => self.interrupt.exit_code().map_or(ExitCode::SUCCESS, ExitCode::from),
        }
    }

    fn tell(&self, line: &dyn Display) {
        if !self.quiet {
            say(line);
        }
    }
}

/// What comes after the picture was written.
enum After {
    Quit,
    Changed,
    More(Goal),
}

/// What those who watch are told, and want.
impl UnderWay<'_> {
    /// Waits as long as somebody may want something. A signal ends the program at once meanwhile.
    fn afterwards(&mut self, render: &Render, end: End) -> After {
        let nobody_asks = !self.viewers.can_ask() && self.watch.is_none();
        if self.board().is_quit() || self.once || nobody_asks {
            return After::Quit;
        }
        let code = if end == End::Stopped && self.keep.asked { KEPT } else { 0 };
        self.interrupt.idle(Some(code));
        let waiting = Instant::now();
        let status = if end == End::Stopped { Status::Stopped } else { Status::Complete };
        self.report(render, render.error(), status);
        match self.watch {
            Some(_) => self.tell(&"watch: waiting for the scene to change; Ctrl-C ends"),
            None => self.tell(&"live: the page stays until it is told to quit; Ctrl-C ends"),
        }
        let after = loop {
            if self.is_changed() {
                break After::Changed;
            }
            if self.board().is_quit() {
                break After::Quit;
            }
            if let Some(goal) = self.board().take_more() {
                break After::More(goal);
            }
            self.board().wait(LOOK_ABOUT);
        };
        self.interrupt.idle(None);
        self.waited(waiting.elapsed());
        after
    }

    /// From now on the goal alone is the limit.
    fn go_on(&mut self, goal: Goal, render: &mut Render) {
        let done = render.film().passes();
        self.limits = match goal {
            Goal::Passes(more) => {
                let all = self.limits.passes.unwrap_or(done).max(done).saturating_add(more);
                Limits { passes: Some(all), time: None, error: None }
            }
            Goal::Error(error) => Limits { passes: None, time: None, error: Some(error) },
        };
        let end = self.limits.passes.map(|all| self.keep.schedule.first.saturating_add(all));
        self.keep.schedule = Schedule { end, ..self.keep.schedule };
        self.pace.lift();
        render.follow(self.keep.schedule);
        self.progress.retarget(&self.limits);
        match goal {
            Goal::Passes(_) => {
                self.tell(&format_args!("live: asked for {} passes in all", end.unwrap_or(done)));
            }
            Goal::Error(error) => self.tell(&format_args!("live: asked for an error of {error}")),
        }
    }

    /// What does not change from pass to pass.
    fn introduce(&self, render: &Render) {
        let (film, plan) = (render.film(), render.plan());
        self.board().tell(|facts| {
            facts.scene.clone_from(&plan.scene.name);
            facts.plan = render.frame().one_line(plan);
            (facts.width, facts.height) = (film.width(), film.height());
            facts.layers = Viewers::layers(film);
            facts.takes_passes = !self.keep.dealt;
            facts.exposure = match self.preview.exposure {
                Exposure::Auto => "auto".into(),
                Exposure::Stops(stops) => stops.to_string(),
            };
            facts.view = self.preview.view.to_string();
        });
    }

    fn report(&self, render: &Render, error: Option<ErrorEstimate>, status: Status) {
        let (passes, elapsed) = (render.film().passes(), self.begin.elapsed());
        let seconds = |time: Option<Duration>| time.map(|time| time.as_secs_f64());
        let is_done = matches!(status, Status::Complete | Status::Stopped);
        let left = self.progress.time_left(passes, elapsed, error).filter(|_| passes > 0 && !is_done);
        let Limits { passes: all_passes, time, error: all_error } = self.limits;
        self.board().tell(|facts| {
            *facts = Facts {
                status,
                passes,
                all_passes,
                all_seconds: seconds(time),
                all_error,
                seconds: elapsed.as_secs_f64(),
                error: error.map(ErrorEstimate::total),
                noise: error.map(|error| error.noise),
                bias: error.and_then(|error| error.bias),
                trusted: error.map(ErrorEstimate::is_trusted),
                left: seconds(left),
                ..std::mem::take(facts)
            };
        });
    }
}
