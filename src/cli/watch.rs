//! Looks whether the files of a scene change, and reads it anew while the render of the old one goes on.

use super::live::Board;
use super::out::say;
use super::scene_args::SceneArgs;
use crate::error::Error;
use crate::film::FileId;
use crate::scene::{Camera, Loaded, NO_CAMERA, Scene};
use glam::DVec3;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// The files of a scene, looked at until the program ends.
pub struct Watch {
    found: Arc<Mutex<Option<Loaded>>>,
}

/// How often files are looked at; a change is read once two looks have seen the same.
const LOOK: Duration = Duration::from_millis(250);
/// What cannot be read is tried again even if no file that is known changes: it may want one that is not there yet.
const AGAIN: Duration = Duration::from_secs(1);
/// But no more often than it takes this many times as long as reading.
const MOST_READING: u32 = 10;

/// What tells one state of a file from another. None: nothing is there.
type Print = Option<(FileId, u64, Option<SystemTime>)>;

struct Watcher {
    args: SceneArgs,
    files: Vec<PathBuf>,
    /// Of the scene that was read last.
    hash: u64,
    camera: Seen,
    found: Arc<Mutex<Option<Loaded>>>,
    board: Arc<Board>,
    quiet: bool,
    /// What was said last of files that cannot be read.
    trouble: Option<String>,
}

impl Watch {
    /// Of a scene that was read just now. When another is there the pass under way is interrupted.
    ///
    /// # Errors
    /// It has no file.
    pub fn begin(args: &SceneArgs, loaded: &Loaded, board: &Arc<Board>, quiet: bool) -> Result<Self, Error> {
        if loaded.files.is_empty() {
            return Err(Error::Usage("--watch: a built-in scene has no file that could change".into()));
        }
        let found = Arc::default();
        let mut watcher = Watcher {
            args: args.clone(),
            files: loaded.files.clone(),
            hash: loaded.scene.hash(),
            camera: Seen::of(&loaded.scene),
            found: Arc::clone(&found),
            board: Arc::clone(board),
            quiet,
            trouble: None,
        };
        let thread = std::thread::Builder::new().name("watch".into()).spawn(move || watcher.run());
        thread.map_err(|why| Error::Usage(format!("--watch: {why}")))?;
        Ok(Self { found })
    }

    /// Whether another scene was read.
    pub fn is_changed(&self) -> bool {
        self.found.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// The scene that was read last, once.
    pub fn take(&self) -> Option<Loaded> {
        self.found.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Watcher {
    fn run(&mut self) {
        let mut read = self.prints();
        let mut seen = read.clone();
        // When to try again what could not be read.
        let mut again: Option<Instant> = None;
        loop {
            std::thread::sleep(LOOK);
            let now = self.prints();
            let settled = now == seen;
            seen.clone_from(&now);
            let due = again.is_some_and(|when| Instant::now() >= when);
            if !settled || (now == read && !due) {
                continue;
            }
            let begin = Instant::now();
            read = now;
            match self.args.load_with_files() {
                Ok(loaded) => {
                    again = None;
                    let is_same_list = loaded.files == self.files;
                    self.offer(loaded);
                    if !is_same_list {
                        read = self.prints();
                    }
                }
                Err(error) => {
                    again = Some(Instant::now() + AGAIN.max(MOST_READING * begin.elapsed()));
                    self.wait_for(&error.to_string());
                }
            }
        }
    }

    fn prints(&self) -> Vec<Print> {
        let print = |path: &PathBuf| {
            let there = std::fs::metadata(path).ok()?;
            Some((FileId::of(path)?, there.len(), there.modified().ok()))
        };
        self.files.iter().map(print).collect()
    }

    /// Hands a scene on, unless it shows the same as the one before.
    fn offer(&mut self, mut loaded: Loaded) {
        self.trouble = None;
        self.board.tell(|facts| facts.note = None);
        self.camera.keep(&mut loaded.scene);
        self.files.clone_from(&loaded.files);
        let (name, hash) = (self.args.scene.clone(), loaded.scene.hash());
        if hash == self.hash {
            self.tell(&format!("watch: {} was written, and shows the same", name.display()));
            return;
        }
        self.tell(&format!("watch: {} has changed; it is rendered anew", name.display()));
        self.hash = hash;
        self.camera = Seen::of(&loaded.scene);
        *self.found.lock().unwrap_or_else(PoisonError::into_inner) = Some(loaded);
        self.board.interrupt();
    }

    fn tell(&self, line: &str) {
        if !self.quiet {
            say(line);
        }
    }

    /// Says once what cannot be read.
    fn wait_for(&mut self, trouble: &str) {
        if self.trouble.as_deref() != Some(trouble) {
            say(format_args!("watch: {trouble}; it is waited for"));
            self.board.tell(|facts| facts.note = Some(format!("waited for: {trouble}")));
            self.trouble = Some(trouble.into());
        }
    }
}

/// How a scene is seen, in the world.
struct Seen {
    camera: Camera,
    origin: DVec3,
}

impl Seen {
    fn of(scene: &Scene) -> Self {
        Self { camera: scene.camera, origin: scene.origin }
    }

    /// Keeps the camera of before where the file has none: a picture that jumps with all that is added shows nobody what changed.
    fn keep(&self, scene: &mut Scene) {
        if !scene.notes.iter().any(|note| note == NO_CAMERA) {
            return;
        }
        let moved = (self.origin - scene.origin).as_vec3();
        scene.camera = Camera { position: self.camera.position + moved, ..self.camera };
        let note = scene.notes.iter_mut().filter(|note| *note == NO_CAMERA);
        note.for_each(|note| *note = "has no camera; the one of before is kept".into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_camera_is_kept_in_the_world_where_the_file_has_none() {
        let mut scene = Scene::load("builtin:cornell-spheres").unwrap();
        scene.origin = DVec3::new(1.0, 2.0, 3.0);
        let before = Seen::of(&scene);
        let mut other = scene.clone();
        other.origin = DVec3::ZERO;
        other.camera.position = Vec3::splat(9.0);
        let of_file = other.camera;
        before.keep(&mut other);
        assert_eq!(other.camera, of_file, "a file's own camera is followed");
        other.notes.push(NO_CAMERA.into());
        before.keep(&mut other);
        assert_eq!(other.camera.position, scene.camera.position + Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(other.camera.forward, scene.camera.forward);
        assert!(!other.notes.iter().any(|note| note == NO_CAMERA));
    }
}
