//! Writes the picture of a render, patiently: a full disk ends no render, and the last picture waits for space.

use super::denoise_args::too_few;
use super::out::say;
use super::output::PictureFiles;
use super::preview_args::Settled;
use crate::atlas::{AtlasRun, AtlasSums};
use crate::error::{Error, Result};
use crate::film::denoise::DENOISED;
use crate::film::{Compression, Film, Header, Layer, Preview, WrittenLayer, judge};
use crate::mattes::Mattes;
use crate::render::Render;
use std::path::PathBuf;
use std::time::Duration;

/// Writes the pictures of one render.
pub struct Writer {
    files: PictureFiles,
    preview: Preview,
    mattes: Option<Mattes>,
    /// The layers of its file, where a denoised one is among them. None: all of the film.
    denoising: Option<Vec<Layer>>,
    quiet: bool,
    /// True while writing fails, so that it is said once.
    failing: bool,
    /// Passes in the picture that is on disk.
    on_disk: Option<u32>,
}

/// How long to wait before the picture is written again; None: long enough.
///
/// A minute in all, in which somebody, or the end of another program, may make room.
fn wait_before(attempt: usize) -> Option<Duration> {
    [1, 2, 4, 8, 15, 30].get(attempt).map(|seconds| Duration::from_secs(*seconds))
}

/// Writes; where that fails waits for a minute in all, but not for a device.
///
/// # Errors
/// Those of the last time.
pub fn patiently(device: bool, write: impl Fn() -> Result<()>) -> Result<()> {
    for attempt in 0.. {
        let Err(e) = write() else { break };
        let Some(wait) = wait_before(attempt).filter(|_| !device) else { return Err(e) };
        // Also when quiet: whoever waits must know for what.
        let line = format!("{e}; trying again in {} s", wait.as_secs());
        say(format_args!("halflight: {line}"));
        std::thread::sleep(wait);
    }
    Ok(())
}

impl Writer {
    /// To files that were claimed.
    pub fn new(
        files: PictureFiles,
        preview: Preview,
        mattes: Option<Mattes>,
        denoising: Option<Vec<Layer>>,
        quiet: bool,
    ) -> Self {
        Self { files, preview, mattes, denoising, quiet, failing: false, on_disk: None }
    }

    /// Writes a picture on the way. Where that fails the render goes on, and the next picture is tried. A device gets none.
    pub fn on_the_way(&mut self, render: &Render) {
        if self.files.device {
            return;
        }
        match self.write(render) {
            Ok(()) => {
                self.on_disk = Some(render.film().passes());
                if std::mem::take(&mut self.failing) {
                    self.say("the picture can be written again");
                }
            }
            Err(e) if !self.failing => {
                self.failing = true;
                self.say(&format!("warning: {e}; the render goes on, and the next picture is tried again"));
            }
            Err(_) => {}
        }
    }

    /// Writes the last picture; waits for a minute where there is no room. Returns the names of the files.
    ///
    /// # Errors
    /// The picture is lost, or shows nothing because no pixel that is lit is a finite number.
    pub fn at_the_end(&mut self, render: &Render) -> Result<String> {
        patiently(self.files.device, || self.write(render))
            .map_err(|e| self.lost(e, render.film().passes()))?;
        self.look_at(render)?;
        Ok(self.files.describe())
    }

    /// Says what is wrong with the picture that was written.
    fn look_at(&self, render: &Render) -> Result<()> {
        let plane = render.film().mean(Layer::Visible);
        let shown = Settled::of(self.preview, &plane);
        let judgement = judge(&plane, shown.preview.view, shown.stops);
        let warnings = judgement.warnings(shown.stops);
        if judgement.shows_nothing() {
            return Err(Error::Image { path: self.path(), reason: warnings.join("; ") });
        }
        shown.note().filter(|_| self.files.displays()).iter().for_each(|note| self.say(note));
        warnings.iter().for_each(|warning| self.say(&format!("warning: {warning}")));
        let too_few = too_few(render.film().passes()).filter(|_| self.denoising.is_some());
        too_few.iter().for_each(|note| self.say(note));
        Ok(())
    }

    fn write(&self, render: &Render) -> Result<()> {
        let beside = Beside {
            atlas: render.atlas_run().map(AtlasRun::sums),
            mattes: self.mattes.as_ref(),
            denoising: self.denoising.as_deref(),
        };
        write_picture(&self.files, render.film(), render.header(), &beside, self.preview)
    }

    fn path(&self) -> PathBuf {
        self.files.all().next().map_or_else(PathBuf::new, PathBuf::from)
    }

    fn lost(&self, e: Error, passes: u32) -> Error {
        let older = match self.on_disk {
            Some(older) => format!("the file has the picture of {}", counted(older)),
            None => "no picture of this render was written".into(),
        };
        match e {
            Error::Write { path, reason } => {
                let reason = format!("{reason}; the picture of {} is lost, {older}", counted(passes));
                Error::Write { path, reason }
            }
            other => other,
        }
    }

    fn say(&self, line: &str) {
        if !self.quiet {
            say(line);
        }
    }
}

fn counted(passes: u32) -> String {
    format!("{passes} pass{}", if passes == 1 { "" } else { "es" })
}

/// What a file holds beside the layers of a film.
#[derive(Default)]
pub struct Beside<'a> {
    /// Every picture of the square.
    pub atlas: Option<&'a AtlasSums>,
    /// Of objects and materials.
    pub mattes: Option<&'a Mattes>,
    /// A denoised layer, and of the film's only these. None: all of them, as they are.
    pub denoising: Option<&'a [Layer]>,
}

/// Writes a picture with what is to be said of it, and what else its file holds.
pub fn write_picture(
    files: &PictureFiles,
    film: &Film,
    mut header: Header,
    beside: &Beside<'_>,
    preview: Preview,
) -> Result<()> {
    let Beside { atlas, mattes, denoising } = *beside;
    let size = (film.width(), film.height());
    let mut plane = film.mean(Layer::Visible);
    let shown = files.displays().then(|| Settled::of(preview, &plane));
    shown.iter().for_each(|shown| shown.tell(&mut header));
    if denoising.is_some() {
        plane = film.denoised_layer(&mut header);
    }
    if files.exr.is_some() {
        let mut image = film.image_of(denoising.unwrap_or(film.layers()), &header);
        image.layers.extend(denoising.map(|_| (DENOISED.into(), plane.clone())));
        let atlas = atlas.map(|atlas| atlas.layers(&mut image.header));
        mattes.iter().for_each(|mattes| mattes.describe_in(&mut image.header));
        // An atlas is a hundred noisy pictures: compressing them takes longer than writing what it saves. Of the lossless ones
        // that compress noisy pictures at all PIZ is smallest and fastest.
        let compression = if atlas.is_some() { Compression::Uncompressed } else { Compression::PIZ };
        let mattes = mattes.into_iter().flat_map(Mattes::layers);
        let layers: Vec<_> =
            WrittenLayer::all_of(&image).chain(atlas.into_iter().flatten()).chain(mattes).collect();
        files.put_layers(size, &image.header, &layers, compression)?;
    }
    files.show(size, &plane, shown.map_or(preview, |shown| shown.fixed()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_picture_waits_for_a_minute_in_steps_that_grow() {
        let waits: Vec<Duration> = (0..).map_while(wait_before).collect();
        assert_eq!(waits.iter().sum::<Duration>(), Duration::from_secs(60));
        assert!(waits.windows(2).all(|pair| pair[1] >= 2 * pair[0] - Duration::from_secs(1)), "{waits:?}");
        assert_eq!(waits[0], Duration::from_secs(1));
    }
}
