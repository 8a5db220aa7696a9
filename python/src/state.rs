use crate::errors::{raised, usage};
use crate::picture::{Picture, claim};
use halflight::error::Error;
use halflight::film::denoise::FEATURES;
use halflight::film::{Film, StateFile, StateHead, write_state};
use halflight::plan::{Settings, memory_left};
use halflight::render::{Memory, film_for, tell_error};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyNotImplemented};
use std::path::{Path, PathBuf};

/// What a render has summed up so far: to be stored, gone on from, and merged with other passes of the same picture.
///
/// Sums are exact, so that it makes no difference in which pieces and in which order passes come together. A state is a copy: a render
/// that goes on leaves it as it is. Files are those of `halflight render --resume` and `halflight merge`.
#[pyclass(frozen, module = "halflight")]
pub struct State {
    head: StateHead,
    film: Film,
}

impl State {
    pub fn new(head: StateHead, film: Film) -> Self {
        Self { head, film }
    }

    /// What it says of itself, and its sums.
    pub fn parts(&self) -> (&StateHead, &Film) {
        (&self.head, &self.film)
    }

    fn read(path: &Path) -> halflight::error::Result<Self> {
        let state = StateFile::open(path)?;
        let head = state.head().clone();
        let mut film = film_for(&head)?;
        state.add_to(&mut film)?;
        Ok(Self { head, film })
    }

    /// All of them together.
    fn sum<'a>(first: &Self, others: impl Iterator<Item = &'a Self>) -> halflight::error::Result<Self> {
        let (mut head, mut film) = (first.head.clone(), first.film.clone());
        for other in others {
            head.join(&other.head)
                .and_then(|()| film.merge(&other.film).map_err(|pass| format!("pass {pass} is in both")))
                .map_err(|why| {
                    Error::Usage(format!("the states do not belong together: {why}; leave one of them out"))
                })?;
        }
        head.facts = head.header();
        tell_error(&mut head.facts, &film);
        Ok(Self { head, film })
    }
}

#[pymethods]
impl State {
    /// Reads a state that was stored here or by the command.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| Self::read(&path)).map_err(raised)
    }

    /// Stores it; the command looks for it as the picture's name with the ending .halflight. It is written beside its place and
    /// renamed, so that there always is a whole one. A file that halflight did not write is replaced only with `overwrite`.
    #[pyo3(signature = (path, *, overwrite=false))]
    fn save(&self, py: Python<'_>, path: PathBuf, overwrite: bool) -> PyResult<()> {
        if !overwrite {
            claim(&path)?;
        }
        py.detach(|| write_state(&path, &self.head, &self.film)).map_err(raised)
    }

    /// All passes of several states of one picture. None may be in two of them.
    #[staticmethod]
    fn merge(py: Python<'_>, states: Vec<PyRef<'_, Self>>) -> PyResult<Self> {
        let states: Vec<&Self> = states.iter().map(|state| &**state).collect();
        let Some((first, others)) = states.split_first() else {
            return Err(usage("merge: there is no state in the list"));
        };
        py.detach(|| Self::sum(first, others.iter().copied())).map_err(raised)
    }

    fn __add__<'py>(&self, py: Python<'py>, other: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let Ok(other) = other.cast::<Self>() else {
            return Ok(PyNotImplemented::get(py).to_owned().into_any());
        };
        let other = other.get();
        let sum = py.detach(|| Self::sum(self, std::iter::once(other))).map_err(raised)?;
        Ok(Bound::new(py, sum)?.into_any())
    }

    /// The picture that its passes make; with a denoised layer if they were rendered with `denoise=True`, and it is asked for here.
    #[pyo3(signature = (*, denoise=false))]
    fn picture(&self, py: Python<'_>, denoise: bool) -> PyResult<Picture> {
        if denoise {
            check_denoising(&self.head)?;
            let StateHead { width, height, ref layers, .. } = self.head;
            let held = Memory::of_pixels(&Settings::for_film(width, height), layers);
            // The film is there already.
            let held = Memory { film: 0, pass: 0, ..held }.with_denoising((width, height));
            held.check(memory_left()).map_err(raised)?;
        }
        let denoising = denoise.then_some(self.film.layers());
        Ok(py.detach(|| Picture::of(&self.film, self.head.header(), denoising, self.head.preview)))
    }

    /// How many passes it has.
    #[getter]
    fn passes(&self) -> u32 {
        self.head.passes.len()
    }

    /// The numbers of its passes, in order.
    #[getter]
    fn pass_numbers(&self) -> Vec<u32> {
        self.head.passes.iter().collect()
    }

    /// (width, height) in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.head.width, self.head.height)
    }

    /// The names of its layers.
    #[getter]
    fn layers(&self) -> Vec<&'static str> {
        self.head.layers.iter().map(|layer| layer.name()).collect()
    }

    /// Seconds that its passes took, planning included.
    #[getter]
    fn seconds(&self) -> f64 {
        1e-9 * self.head.nanoseconds as f64
    }

    /// What decides the picture, by name: states in which all of it is the same can be merged.
    #[getter]
    fn key<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let key = PyDict::new(py);
        self.head.key.0.iter().try_for_each(|(name, value)| key.set_item(name, value))?;
        Ok(key)
    }

    fn __repr__(&self) -> String {
        let StateHead { width, height, passes, .. } = &self.head;
        format!("<halflight.State {width}x{height}, {} passes ({passes})>", passes.len())
    }
}

/// Refuses a state without what the denoiser looks at.
pub fn check_denoising(head: &StateHead) -> PyResult<()> {
    match FEATURES.into_iter().find(|layer| !head.layers.contains(layer)) {
        None => Ok(()),
        Some(missing) => Err(usage(format!(
            "the state has no layer {missing}, which denoise=True looks at; leave it out, or render anew with denoise=True"
        ))),
    }
}
