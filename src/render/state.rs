//! What is stored of a render, and how it goes on from there: docs/state-format.md.

use super::Render;
use crate::error::{Error, Result};
use crate::film::{Film, Key, Preview, Schedule, StateFile, StateHead, write_state, write_state_with};
use crate::machine;
use crate::memory::{Memory, words};
use crate::plan::{Direct, Settings};
use std::path::Path;

/// To be raised with every change after which the same scene, settings and pass number make another picture within one version.
pub const ESTIMATORS: u32 = 3;

/// What decides a picture, of a scene with this [hash](crate::scene::Scene::hash): states with equal keys add up. Every setting is
/// taken apart, so that a new one must be given a place here.
pub fn key(scene_hash: u64, settings: &Settings) -> Key {
    let Settings {
        width,
        height,
        paths,
        seed,
        method,
        samples,
        direct,
        invisible,
        max_reflections,
        even_starts,
        one_path,
        caustic_radius,
        indirect_radius,
        nearest,
        cone,
        keep_everything,
        keep,
        atlas,
        memory: _,
    } = settings;
    let direct = match direct {
        Direct::Auto => "auto",
        Direct::Connection => "connection",
        Direct::Photons => "photons",
    };
    let mut keep: Vec<_> = keep.iter().map(|kept| kept.name()).collect();
    keep.sort_unstable();
    keep.dedup();
    let all = [
        ("estimators", format!("{}, {ESTIMATORS}", env!("CARGO_PKG_VERSION"))),
        ("scene", format!("{scene_hash:016x}")),
        ("--size", format!("{width}x{height}")),
        ("--photons", paths.map_or("by the plan".into(), |paths| paths.to_string())),
        ("--seed", seed.to_string()),
        ("--method", method.name().into()),
        ("--samples", samples.to_string()),
        ("--direct", direct.into()),
        ("layer invisible", invisible.to_string()),
        ("--max-reflections", max_reflections.map_or("none".into(), |most| most.to_string())),
        ("--even-starts", even_starts.to_string()),
        ("--one-path", one_path.to_string()),
        ("caustic radius", caustic_radius.to_string()),
        ("indirect radius", indirect_radius.to_string()),
        ("--nearest", nearest.to_string()),
        ("--cone", cone.to_string()),
        ("--keep-everything", keep_everything.to_string()),
        ("--keep", keep.join(",")),
        ("--atlas", atlas.to_string()),
    ];
    Key(all.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
}

impl Render {
    /// From now on renders the passes of a schedule. An [`AtlasRun`](crate::atlas::AtlasRun) takes one after another, whatever it says.
    pub fn follow(&mut self, schedule: Schedule) {
        self.schedule = schedule;
    }

    /// How many passes of the schedule are left. None: it has no end.
    pub fn left(&self) -> Option<u32> {
        let done = self.film.pass_set().iter().filter(|pass| self.schedule.contains(*pass)).count();
        self.schedule.len().map(|all| all - done as u32)
    }

    /// Everything about the render and its film so far but the sums.
    pub fn state_head(&self, preview: Preview) -> StateHead {
        StateHead {
            key: self.key.clone(),
            pass_size: self.pass_size(),
            width: self.frame.width,
            height: self.frame.height,
            layers: self.film.layers().to_vec(),
            passes: self.film.pass_set().clone(),
            photons: self.stored,
            nanoseconds: (1e9 * self.seconds) as u64,
            facts: self.header(),
            preview,
            annex: None,
        }
    }

    /// Stores the render so far.
    ///
    /// # Errors
    /// It cannot be written; what was there is as it was.
    pub fn save(&self, path: &Path, preview: Preview) -> Result<()> {
        let head = self.state_head(preview);
        match &self.atlas {
            None => write_state(path, &head, &self.film),
            Some(atlas) => atlas.sums().as_annex(|annex| write_state_with(path, &head, &self.film, annex)),
        }
    }

    /// Goes on from a state of the same picture, with passes of its size; with that of an atlas only before the first pass.
    ///
    /// # Errors
    /// One line: it is of another picture, or damaged, or has a pass that is here already.
    pub fn resume(&mut self, path: &Path, state: StateFile) -> Result<()> {
        let head = state.head().clone();
        self.set_pass_size(head.pass_size);
        if let Some(difference) = self.state_head(head.preview).difference(&head) {
            return Err(another_picture(path, &difference));
        }
        match &mut self.atlas {
            None => state.add_to(&mut self.film)?,
            Some(_) if self.film.passes() > 0 => {
                return Err(another_picture(path, "there are passes already"));
            }
            Some(atlas) => atlas.resume(state.add_to_and_leave(&mut self.film)?)?,
        }
        self.count(&head);
        Ok(())
    }

    /// Adds a state that is in memory. A render without passes takes over the size of its.
    ///
    /// # Errors
    /// One line: it is of another picture, or has a pass that is here already, or an atlas is made, whose sums are not in `film`. Then
    /// nothing is changed.
    pub fn add(&mut self, head: &StateHead, film: &Film) -> std::result::Result<(), String> {
        if self.atlas.is_some() {
            return Err("a film alone is not added to an atlas; go on from the file of its state".into());
        }
        let size = self.pass_size();
        if self.film.passes() == 0 {
            self.set_pass_size(head.pass_size);
        }
        let refused = match self.state_head(head.preview).difference(head) {
            Some(difference) => Some(format!("the state is of another picture ({difference})")),
            None => {
                self.film.merge(film).err().map(|pass| format!("pass {pass} of the state is here already"))
            }
        };
        match refused {
            None => self.count(head),
            Some(_) => self.set_pass_size(size),
        }
        refused.map_or(Ok(()), Err)
    }

    /// What passes took that were rendered elsewhere.
    fn count(&mut self, head: &StateHead) {
        self.stored = self.stored.saturating_add(head.photons);
        self.seconds += 1e-9 * head.nanoseconds as f64;
    }
}

/// An empty film for a state, if there is memory for it and for the picture that is written of it.
///
/// # Errors
/// It takes more memory than there is.
pub fn film_for(head: &StateHead) -> Result<Film> {
    let StateHead { width, height, ref layers, .. } = *head;
    let held = Memory { pass: 0, ..Memory::of_pixels(&Settings::for_film(width, height), layers) };
    let bytes = held.total() as u64;
    if let Some(limit) = machine::memory().filter(|limit| bytes > limit.bytes) {
        let (needs, has) = (words(bytes as f64), words(limit.bytes as f64));
        return Err(Error::Usage(format!(
            "a film of {width}x{height} pixels and its picture take {needs} of memory and {} {has}",
            limit.of
        )));
    }
    Ok(Film::new(width, height, layers))
}

/// A state that is not of the picture that is asked for.
pub fn another_picture(path: &Path, difference: &str) -> Error {
    let reason =
        format!("the state is of another picture ({difference}); give -o another name, or remove it");
    Error::Image { path: path.into(), reason }
}
