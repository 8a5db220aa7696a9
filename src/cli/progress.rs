//! What a user sees while a render runs: a bar on a terminal, quiet lines in a log.

use super::limits::Limits;
use super::out::say;
use crate::render::{ErrorEstimate, Render};
use clap::ValueEnum;
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::Duration;

/// How a render on its way is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Told {
    /// A bar on a terminal, lines that grow rarer in a log.
    Auto,
    /// A JSON object for each pass, on a line of its own.
    Json,
}

pub struct Progress {
    out: Out,
    limits: Limits,
    paths: u64,
    /// Passes that were done before, and how far the nearest limit had come by them.
    before: (u32, f64),
    next_line: Duration,
}

enum Out {
    Quiet,
    Lines,
    Bar(ProgressBar),
    Json,
}

/// The bar counts thousandths of the way to the nearest limit.
const STEPS: u64 = 1000;

impl Progress {
    pub fn new(quiet: bool, told: Told, render: &Render, limits: &Limits) -> Self {
        if !quiet {
            say(format_args!("{}", render.frame().one_line(render.plan())));
        }
        let out = if told == Told::Json {
            Out::Json
        } else if quiet {
            Out::Quiet
        } else {
            if std::io::stderr().is_terminal() {
                let bar = ProgressBar::new(STEPS);
                let style = ProgressStyle::with_template("{bar:30} {msg}").expect("a fixed template");
                bar.set_style(style);
                Out::Bar(bar)
            } else {
                Out::Lines
            }
        };
        let paths = render.plan().photons.as_ref().map_or(0, |photons| u64::from(photons.paths));
        let mut progress = Self { out, limits: *limits, paths, before: (0, 0.0), next_line: Duration::ZERO };
        let passes = render.film().passes();
        progress.before = (passes, progress.fraction_done(passes, Duration::ZERO, render.error()));
        progress
    }

    pub fn show(&mut self, render: &Render, elapsed: Duration, error: Option<ErrorEstimate>) {
        let passes = render.film().passes();
        let done = self.fraction_done(passes, elapsed, error);
        match &self.out {
            Out::Quiet => {}
            Out::Lines if elapsed < self.next_line => {}
            Out::Lines => {
                say(format_args!("{}", self.line(passes, elapsed, error, done)));
                // Lines grow rarer, so that a log of an hour has tens of them.
                self.next_line = elapsed.mul_f64(1.5).max(elapsed + Duration::from_secs(1));
            }
            Out::Json => tell_json(passes, elapsed, error, self.left(elapsed, done)),
            Out::Bar(bar) => {
                bar.set_position((done * STEPS as f64) as u64);
                bar.set_message(self.line(passes, elapsed, error, done));
            }
        }
    }

    pub fn finish(&mut self, render: &Render, elapsed: Duration) {
        if let Out::Bar(bar) = &self.out {
            bar.finish_and_clear();
        }
        if !matches!(self.out, Out::Quiet | Out::Json) {
            let error = render.error();
            say(format_args!("{}", self.line(render.film().passes(), elapsed, error, 1.0)));
        }
    }

    /// From now on these are the limits.
    pub fn retarget(&mut self, limits: &Limits) {
        self.limits = *limits;
    }

    /// Nothing more is told of a render that is given up.
    pub fn give_up(&self) {
        if let Out::Bar(bar) = &self.out {
            bar.finish_and_clear();
        }
    }

    /// The time that is left until the nearest limit, as far as is known.
    pub fn time_left(
        &self,
        passes: u32,
        elapsed: Duration,
        error: Option<ErrorEstimate>,
    ) -> Option<Duration> {
        self.left(elapsed, self.fraction_done(passes, elapsed, error))
    }

    /// How far the nearest limit has come; the error falls as the square root of time. Nobody knows when one will be trusted.
    fn fraction_done(&self, passes: u32, elapsed: Duration, error: Option<ErrorEstimate>) -> f64 {
        let by_passes = self.limits.passes.map_or(0.0, |limit| f64::from(passes) / f64::from(limit));
        let by_time = self.limits.time.map_or(0.0, |limit| elapsed.as_secs_f64() / limit.as_secs_f64());
        let by_error = self.limits.error.zip(error).map_or(0.0, |(limit, error)| {
            let waits = error.total() <= limit && !error.is_trusted();
            if waits { 0.0 } else { (limit / error.total()).powi(2) }
        });
        by_passes.max(by_time).max(by_error).min(1.0)
    }

    /// The time that is left as far as is known.
    fn left(&self, elapsed: Duration, done: f64) -> Option<Duration> {
        let gained = done - self.before.1;
        Duration::try_from_secs_f64(elapsed.as_secs_f64() * (1.0 - done) / gained).ok()
    }

    fn line(&self, passes: u32, elapsed: Duration, error: Option<ErrorEstimate>, done: f64) -> String {
        let seconds = elapsed.as_secs_f64();
        let rate = self.paths as f64 * f64::from(passes - self.before.0) / seconds / 1e6;
        let error = error.map_or("error not known yet".into(), describe);
        let photons = if self.paths > 0 { format!("{rate:.2} M photon paths/s, ") } else { String::new() };
        let left = self.left(elapsed, done).filter(|_| done < 1.0);
        let left = left.map_or(String::new(), |left| format!(", {} left", HumanDuration(left)));
        let plural = if passes == 1 { "" } else { "es" };
        format!("{passes} pass{plural}, {seconds:.1} s, {photons}{error}{left}")
    }
}

/// `null` for what is not known.
fn tell_json(passes: u32, elapsed: Duration, error: Option<ErrorEstimate>, left: Option<Duration>) {
    // A number that is not finite becomes null.
    let line = serde_json::json!({
        "pass": passes,
        "seconds": elapsed.as_secs_f64(),
        "error": error.map(ErrorEstimate::total),
        "bias": error.and_then(|error| error.bias),
        "trusted": error.map(ErrorEstimate::is_trusted),
        "eta": left.map(|left| left.as_secs_f64()),
    });
    say(line);
}

fn describe(error: ErrorEstimate) -> String {
    let ErrorEstimate { noise, bias, .. } = error;
    if !error.total().is_finite() {
        return "error unknown, some pixels are not finite numbers".into();
    }
    let doubt = if error.is_trusted() { "" } else { ", not to be trusted yet" };
    match bias {
        None => format!("noise {:.2} %, bias not told{doubt}", 100.0 * noise),
        Some(bias) if bias > 0.0 => format!(
            "error {:.2} % (noise {:.2} %, bias {:.2} %{doubt})",
            100.0 * error.total(),
            100.0 * noise,
            100.0 * bias
        ),
        Some(_) => format!("error {:.2} %{doubt}", 100.0 * noise),
    }
}
