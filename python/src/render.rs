use crate::errors::{raised, usage};
use crate::options::Options;
use crate::picture::Picture;
use crate::records::plan_rows;
use crate::scene::Scene;
use crate::settings::{Limits, Wanted, shard};
use crate::state::{State, check_denoising};
use crate::wait::wait;
use halflight::film::{Layer, Preview, Schedule};
use halflight::plan::Settings;
use halflight::render::{ErrorEstimate, Memory, Pace, Render as Rendering, Stop};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList};
use std::sync::{Mutex, MutexGuard};
use std::time::Instant;

/// Renders `scene` until the first of `passes`, `seconds` and `error` is reached (64 passes where none is given) and returns a
/// Picture: the same, bit for bit, as `halflight render` makes with the same settings.
///
/// `size` is (width, height) in pixels, `illumination` a name or a point (s, t) of the square, `method` "photon", "path",
/// "path-plain" or "nearest". `layers` are names, or ["all"]; None: all that cost nothing. `denoise` also makes a denoised layer, which is
/// what a display is shown. `progress` is True, or a function that is called
/// after each step with a record of passes, seconds, noise and bias. Other threads run meanwhile, and Ctrl-C ends it.
#[pyfunction]
#[pyo3(
    signature = (scene, **more),
    text_signature = "(scene, *, size=None, illumination=None, passes=None, seconds=None, error=None, method='photon', seed=0, layers=None, denoise=False, photons=None, samples=4, direct='auto', max_reflections=None, indirect_radius=None, caustic_radius=2, nearest=100, cone=1, even_starts=False, one_path=False, keep_everything=False, keep=(), progress=False)"
)]
pub fn render(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    more: Option<&Bound<'_, PyDict>>,
) -> PyResult<Picture> {
    let begin = Instant::now();
    let more = Options::of("render()", more)?;
    let (wanted, limits, progress) = (Wanted::of(&more)?, Limits::of(&more)?, more.any("progress")?);
    more.finish()?;
    let render = Render::begin(py, scene, wanted, false)?;
    render.until(py, begin, &limits, progress.as_ref())?;
    render.picture(py)
}

/// A render that goes on pass by pass. Settings are those of `render`.
///
/// `shard=(k, n)` renders one share of all passes, of n shares the kth (from 1): every nth pass. States of shards can be merged.
#[pyclass(frozen, module = "halflight")]
pub struct Render {
    inner: Mutex<Rendering>,
    /// It is one share of a render, whose passes must be of one size.
    dealt: bool,
    /// The layers of its pictures, where a denoised one is among them. None: all of the film.
    denoising: Option<Vec<Layer>>,
    preview: Preview,
}

impl Render {
    /// Plans it.
    pub fn begin(py: Python<'_>, scene: &Bound<'_, Scene>, wanted: Wanted, atlas: bool) -> PyResult<Self> {
        let scene = scene.get().ready(py, wanted.illumination)?;
        let preview = Preview::usual(&scene);
        let denoising = wanted.denoising();
        let (settings, layers) = wanted.on(&scene);
        let settings = Settings { atlas, ..settings };
        let (size, limit) = ((settings.width, settings.height), settings.memory);
        let check = |held: Memory| {
            let held = if denoising.is_some() { held.with_denoising(size) } else { held };
            held.check(limit).map_err(raised)
        };
        check(Memory::of_pixels(&settings, &layers))?;
        let planned = wait(py, &Stop::default(), || Rendering::new(scene, settings, &layers))?;
        let planned = planned.map_err(raised)?;
        check(planned.memory())?;
        Ok(Self { inner: Mutex::new(planned), dealt: false, denoising, preview })
    }

    /// One that follows a schedule of its own.
    fn dealt(self, schedule: Schedule) -> Self {
        self.locked().follow(schedule);
        Self { dealt: true, ..self }
    }

    /// To be locked without the interpreter's lock, which who holds this one may be waiting for.
    fn locked(&self) -> MutexGuard<'_, Rendering> {
        self.inner.lock().expect("nothing panics while it is held")
    }

    /// What `read` finds out about it as it is now.
    pub fn look<T: Send>(&self, py: Python<'_>, read: impl FnOnce(&Rendering) -> T + Send) -> T {
        py.detach(|| read(&self.locked()))
    }

    /// How it is shown.
    pub fn preview(&self) -> Preview {
        self.preview
    }

    /// Goes on until a limit is reached, since `begin`.
    pub fn until(
        &self,
        py: Python<'_>,
        begin: Instant,
        limits: &Limits,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let mut pace = Pace::new(begin, limits.time, self.look(py, |render| render.film().passes()));
        if limits.time.is_some() && !self.dealt && self.look(py, |render| render.film().passes()) == 0 {
            wait(py, &Stop::default(), || drop(pace.fit(&mut self.locked())))?;
        }
        loop {
            let stop = Stop::default();
            let step = wait(py, &stop, || step(&mut self.locked(), &mut pace, limits, &stop))?;
            let Some(now) = step else { break };
            let done = now.reaches(limits, begin);
            if let Some(progress) = progress {
                now.tell(py, progress, begin.elapsed().as_secs_f64(), done)?;
            }
            if done {
                return now.check(limits);
            }
        }
        Ok(())
    }
}

/// Where a render stands.
struct Now {
    passes: u32,
    error: Option<ErrorEstimate>,
}

/// One pass, or as many as are best made together. None: there is no time left for another.
fn step(render: &mut Rendering, pace: &mut Pace, limits: &Limits, stop: &Stop) -> Option<Now> {
    loop {
        let done = render.film().passes();
        let left = limits.passes.map_or(u32::MAX, |limit| limit.saturating_sub(done));
        let most = left.min(pace.most(done));
        if most == 0 {
            return None;
        }
        render.stop_at(stop.at(pace.deadline(done)));
        let passing = Instant::now();
        if render.passes(most) > 0 {
            pace.took(passing.elapsed().as_secs_f64());
            return Some(Now { passes: render.film().passes(), error: render.error() });
        }
        // The pass under way was dropped.
        if stop.is_wished() || pace.again(done, render).is_none() {
            return None;
        }
    }
}

impl Now {
    fn reaches(&self, limits: &Limits, begin: Instant) -> bool {
        let reached = |limit: f64| self.error.is_some_and(|error| error.reaches(limit, self.passes));
        limits.passes.is_some_and(|limit| self.passes >= limit)
            || limits.time.is_some_and(|limit| begin.elapsed() >= limit)
            || limits.error.is_some_and(reached)
    }

    /// An error to reach that never can be.
    fn check(&self, limits: &Limits) -> PyResult<()> {
        match (limits.error, self.error) {
            (Some(limit), Some(error)) if !error.total().is_finite() => Err(usage(format!(
                "error={limit} cannot be reached: some pixels are not finite numbers, and so is the error; scale the lamps down"
            ))),
            _ => Ok(()),
        }
    }

    fn tell(&self, py: Python<'_>, progress: &Bound<'_, PyAny>, seconds: f64, done: bool) -> PyResult<()> {
        let (noise, bias) = (self.error.map(|error| error.noise), self.error.and_then(|error| error.bias));
        if progress.is_instance_of::<PyBool>() {
            return if progress.is_truthy()? { self.print(py, seconds, done) } else { Ok(()) };
        }
        let record = PyDict::new(py);
        record.set_item("passes", self.passes)?;
        record.set_item("seconds", seconds)?;
        record.set_item("noise", noise)?;
        record.set_item("bias", bias)?;
        record.set_item("trusted", self.error.map(ErrorEstimate::is_trusted))?;
        progress.call1((record,)).map(drop)
    }

    fn print(&self, py: Python<'_>, seconds: f64, done: bool) -> PyResult<()> {
        let error =
            self.error.map_or(String::new(), |error| format!(", error {:.2} %", 100.0 * error.total()));
        let end = if done { "\n" } else { "" };
        let line = format!("\r{} passes, {seconds:.1} s{error}  {end}", self.passes);
        let err = py.import("sys")?.getattr("stderr")?;
        err.call_method1("write", (line,))?;
        err.call_method0("flush").map(drop)
    }
}

#[pymethods]
impl Render {
    #[new]
    #[pyo3(
        signature = (scene, **more),
        text_signature = "(scene, *, size=None, illumination=None, method='photon', seed=0, layers=None, denoise=False, photons=None, samples=4, direct='auto', max_reflections=None, indirect_radius=None, caustic_radius=2, nearest=100, cone=1, even_starts=False, one_path=False, keep_everything=False, keep=(), shard=None)"
    )]
    fn new(py: Python<'_>, scene: &Bound<'_, Scene>, more: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let more = Options::of("Render()", more)?;
        let (wanted, shard) = (Wanted::of(&more)?, shard(&more)?);
        more.finish()?;
        let whole = Self::begin(py, scene, wanted, false)?;
        Ok(match shard {
            Some(schedule) => whole.dealt(schedule),
            None => whole,
        })
    }

    /// Renders so many passes more, and returns how many there are now.
    #[pyo3(signature = (passes=1))]
    fn advance(&self, py: Python<'_>, passes: u32) -> PyResult<u32> {
        let passes = passes.saturating_add(self.passes(py));
        let limits = Limits { passes: Some(passes), time: None, error: None };
        self.until(py, Instant::now(), &limits, None)?;
        Ok(self.passes(py))
    }

    /// Goes on until the first of these is reached: so many passes in the picture, so many seconds from now, a relative error.
    #[pyo3(
        signature = (**more),
        text_signature = "($self, *, passes=None, seconds=None, error=None, progress=False)"
    )]
    fn run(&self, py: Python<'_>, more: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        let begin = Instant::now();
        let more = Options::of("run()", more)?;
        let (limits, progress) = (Limits::of(&more)?, more.any("progress")?);
        more.finish()?;
        self.until(py, begin, &limits, progress.as_ref())
    }

    /// What it has summed up so far; takes as much memory again.
    #[getter]
    fn state(&self, py: Python<'_>) -> State {
        self.look(py, |render| State::new(render.state_head(self.preview), render.film().clone()))
    }

    /// Goes on from a state of the same picture: its passes are counted as if they had been rendered here. A render that has no passes
    /// yet takes over their size.
    fn resume(&self, py: Python<'_>, state: &Bound<'_, State>) -> PyResult<()> {
        let (head, film) = state.get().parts();
        if self.denoising.is_some() {
            check_denoising(head)?;
        }
        py.detach(|| self.locked().add(head, film)).map_err(usage)
    }

    /// The picture so far.
    pub fn picture(&self, py: Python<'_>) -> PyResult<Picture> {
        let denoising = self.denoising.as_deref();
        Ok(self.look(py, |render| Picture::of(render.film(), render.header(), denoising, self.preview)))
    }

    /// Passes in the picture.
    #[getter]
    fn passes(&self, py: Python<'_>) -> u32 {
        self.look(py, |render| render.film().passes())
    }

    /// The standard error of the picture relative to it, root of the mean square over pixels. None below two passes.
    #[getter]
    fn noise(&self, py: Python<'_>) -> Option<f64> {
        self.look(py, Rendering::error).map(|error| error.noise)
    }

    /// The estimated bias of the picture on the same scale; zero where noise hides it. None below two passes, and where the
    /// method does not know it.
    #[getter]
    fn bias(&self, py: Python<'_>) -> Option<f64> {
        self.look(py, Rendering::error).and_then(|error| error.bias)
    }

    /// Both together, as `error=` asks for. None below two passes.
    #[getter]
    fn error(&self, py: Python<'_>) -> Option<f64> {
        self.look(py, Rendering::error).map(ErrorEstimate::total)
    }

    /// Whether the error can be trusted: False where it rests upon few bright paths, so that it may be far larger. None below two passes.
    #[getter]
    fn trusted(&self, py: Python<'_>) -> Option<bool> {
        self.look(py, Rendering::error).map(ErrorEstimate::is_trusted)
    }

    /// What is done and what is left out, as records.
    #[getter]
    fn plan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let rows = self.look(py, |render| plan_rows(render.plan(), render.frame(), None));
        PyList::new(py, rows)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (width, height, passes) = self.look(py, |render| {
            let film = render.film();
            (film.width(), film.height(), film.passes())
        });
        format!("<halflight.Render {width}x{height}, {passes} passes>")
    }
}
