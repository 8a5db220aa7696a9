//! What a render and those who watch it tell each other. The render never waits for them.

use crate::film::{Film, Layer, Preview};
use crate::stop::Stop;
use glam::Vec3;
use serde::Serialize;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Between the render and those who watch it.
#[derive(Default)]
pub struct Board {
    inner: Mutex<Inner>,
    changed: Condvar,
}

#[derive(Default)]
struct Inner {
    facts: Facts,
    picture: Option<Arc<Picture>>,
    /// When the picture was taken, and how long that took.
    taken: Option<(Instant, Duration)>,
    /// When somebody last asked for anything.
    seen: Option<Instant>,
    wishes: Wishes,
}

/// What those who watch want of the render.
#[derive(Default)]
struct Wishes {
    pause: bool,
    stop: bool,
    quit: bool,
    more: Option<Goal>,
    /// Ends the pass under way.
    ending: Stop,
}

/// What a render is to reach after all, in place of its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// So many passes more than it has, or was asked for.
    Passes(u32),
    /// This relative error.
    Error(f64),
}

/// What is going on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// The scene is read and planned.
    #[default]
    Loading,
    Rendering,
    Paused,
    /// A limit was reached, and the picture is on disk.
    Complete,
    /// It was stopped, and the picture is on disk.
    Stopped,
    /// The program ends.
    Ended,
}

/// All about a render but its pixels. Numbers that are not known are null.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Facts {
    /// Which render of this program, from 1.
    pub render: u32,
    pub scene: String,
    /// What is done, and what is left out.
    pub plan: String,
    pub status: Status,
    pub width: u32,
    pub height: u32,
    pub layers: Vec<&'static str>,
    pub passes: u32,
    /// The limits.
    pub all_passes: Option<u32>,
    pub all_seconds: Option<f64>,
    pub all_error: Option<f64>,
    pub seconds: f64,
    pub error: Option<f64>,
    pub noise: Option<f64>,
    pub bias: Option<f64>,
    /// Whether the error can be trusted.
    pub trusted: Option<bool>,
    /// Seconds to go.
    pub left: Option<f64>,
    /// False where the passes were dealt out, and others render the next ones.
    pub takes_passes: bool,
    /// A number of stops, or auto.
    pub exposure: String,
    pub view: String,
    /// What the user must know, as that the file cannot be read at the moment.
    pub note: Option<String>,
}

/// The means of a film at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Which render it is of, and its number of passes; pictures of the same are the same.
    pub of: (u32, u32),
    pub width: u32,
    pub height: u32,
    pub planes: Vec<(Layer, Vec<Vec3>)>,
    /// How it is shown if nobody says otherwise.
    pub preview: Preview,
}

/// Somebody who asked so recently still looks: a page asks twice a second.
const LOOKING: Duration = Duration::from_secs(3);
/// The least time between two pictures, and how many times as long as taking one takes: while somebody looks, and while
/// nobody does, so that who comes finds one.
const LOOKED_AT: (Duration, u32) = (Duration::from_millis(250), 20);
const UNSEEN: (Duration, u32) = (Duration::from_secs(5), 100);

impl Picture {
    /// The layers of a film, `Visible` first and `Error` always among them.
    pub fn of(render: u32, film: &Film, preview: Preview) -> Self {
        let layers = layers(film);
        Self {
            of: (render, film.passes()),
            width: film.width(),
            height: film.height(),
            planes: layers.into_iter().map(|layer| (layer, film.mean(layer))).collect(),
            preview,
        }
    }

    /// None: it has no such layer.
    pub fn plane(&self, layer: Layer) -> Option<&[Vec3]> {
        self.planes.iter().find(|(known, _)| *known == layer).map(|(_, plane)| plane.as_slice())
    }
}

/// Those that are shown of a film.
pub fn layers(film: &Film) -> Vec<Layer> {
    let error = (!film.layers().contains(&Layer::Error)).then_some(Layer::Error);
    film.layers().iter().copied().chain(error).collect()
}

/// The side of the render.
impl Board {
    /// Another render begins, of which nobody wished anything yet.
    pub fn begins(&self) {
        let mut inner = self.lock();
        inner.wishes = Wishes { quit: inner.wishes.quit, ..Wishes::default() };
        inner.facts = Facts { render: inner.facts.render + 1, ..Facts::default() };
        inner.taken = None;
    }

    /// What ends passes under way, when those who watch stop the render or its scene is another.
    pub fn ending(&self) -> Stop {
        self.lock().wishes.ending.clone()
    }

    /// Changes what is known.
    pub fn tell(&self, change: impl FnOnce(&mut Facts)) {
        change(&mut self.lock().facts);
        self.changed.notify_all();
    }

    /// Whether it is time for a picture.
    pub fn wants_picture(&self) -> bool {
        let inner = self.lock();
        let (least, times) = if inner.is_looked_at() { LOOKED_AT } else { UNSEEN };
        inner.taken.is_none_or(|(when, took)| when.elapsed() >= least.max(times * took))
    }

    /// Shows a picture that took so long to take.
    pub fn put(&self, picture: Picture, took: Duration) {
        let mut inner = self.lock();
        inner.picture = Some(Arc::new(picture));
        inner.taken = Some((Instant::now(), took));
        self.changed.notify_all();
    }

    /// Which render this is, and whether its last picture has so many passes.
    pub fn has(&self, passes: u32) -> (u32, bool) {
        let inner = self.lock();
        let of = (inner.facts.render, passes);
        (of.0, inner.picture.as_ref().is_some_and(|picture| picture.of == of))
    }

    pub fn is_paused(&self) -> bool {
        self.lock().wishes.pause
    }

    pub fn is_stopped(&self) -> bool {
        let wishes = &self.lock().wishes;
        wishes.stop || wishes.quit
    }

    /// Whether the program is to end.
    pub fn is_quit(&self) -> bool {
        self.lock().wishes.quit
    }

    /// What is to be reached after all, once.
    pub fn take_more(&self) -> Option<Goal> {
        let mut inner = self.lock();
        let more = inner.wishes.more.take();
        if more.is_some() {
            // A new life for what was stopped.
            inner.wishes = Wishes { quit: inner.wishes.quit, ..Wishes::default() };
        }
        more
    }

    /// Until something changes, or for so long.
    pub fn wait(&self, most: Duration) {
        drop(self.changed.wait_timeout(self.lock(), most));
    }

    /// True while somebody looks.
    pub fn is_looked_at(&self) -> bool {
        self.lock().is_looked_at()
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The side of those who watch.
impl Board {
    /// Somebody looks.
    pub fn look(&self) {
        self.lock().seen = Some(Instant::now());
    }

    pub fn facts(&self) -> Facts {
        self.lock().facts.clone()
    }

    /// The last picture. None: there is none yet.
    pub fn picture(&self) -> Option<Arc<Picture>> {
        self.lock().picture.clone()
    }

    /// The same, if it is not the one `known`; else waits for another for so long.
    pub fn next_picture(&self, known: Option<(u32, u32)>, most: Duration) -> Option<Arc<Picture>> {
        let is_new = |inner: &Inner| inner.picture.as_ref().is_some_and(|picture| Some(picture.of) != known);
        let waited = self.changed.wait_timeout_while(self.lock(), most, |inner| !is_new(inner));
        let (inner, _) = waited.unwrap_or_else(PoisonError::into_inner);
        inner.picture.clone().filter(|_| is_new(&inner))
    }

    pub fn pause(&self, pause: bool) {
        self.wish(|wishes| wishes.pause = pause);
    }

    /// Ends the render with the passes that it has; the first is always completed.
    pub fn stop(&self) {
        let begun = self.lock().facts.passes > 0;
        self.wish(|wishes| {
            wishes.stop = true;
            wishes.pause = false;
            if begun {
                wishes.ending.ask();
            }
        });
    }

    /// Ends the pass under way.
    pub fn interrupt(&self) {
        self.wish(|wishes| wishes.ending.ask());
    }

    /// Ends the program.
    pub fn quit(&self) {
        self.stop();
        self.wish(|wishes| wishes.quit = true);
    }

    pub fn more(&self, goal: Goal) {
        self.wish(|wishes| {
            wishes.more = Some(goal);
            wishes.pause = false;
        });
    }

    fn wish(&self, change: impl FnOnce(&mut Wishes)) {
        change(&mut self.lock().wishes);
        self.changed.notify_all();
    }
}

impl Inner {
    fn is_looked_at(&self) -> bool {
        self.seen.is_some_and(|seen| seen.elapsed() < LOOKING)
    }
}
