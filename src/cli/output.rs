//! Where a picture goes. The ending decides the format; files that are read, or are another program's, are not replaced.

use super::out::say;
use crate::error::{Error, Result};
use crate::film::{
    Compression, FileId, Header, Place, Preview, WrittenLayer, check_writable, exr_bytes, is_ours, write_hdr,
    write_layers_exr, write_pfm, write_rgb_jpg, write_rgb_png,
};
use clap::Args;
use glam::Vec3;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

/// What may be replaced.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Overwrite {
    /// Also replace files that halflight did not write. What is read is never replaced.
    #[arg(long)]
    pub overwrite: bool,
}

/// The formats of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
    Jpeg,
    Pfm,
    Hdr,
}

/// What `-o` is called for standard output.
const STANDARD: &str = "-";

/// The most pixels of a JPEG file's side.
const LONGEST_JPEG: u32 = 65_535;

/// The files of one picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureFiles {
    /// All layers.
    pub exr: Option<PathBuf>,
    /// One plane: PNG or JPEG as on a display, PFM or HDR as it is.
    pub shown: Option<PathBuf>,
    /// True where the EXR file goes to a device, or to standard output.
    pub device: bool,
}

impl PictureFiles {
    /// By the ending of `-o`: an EXR file with a PNG preview beside it, or a file of another format alone. A device gets the EXR file
    /// alone, whatever it is called, and so does standard output, which is called `-`.
    pub fn of(output: &Path) -> Result<Self> {
        if output == Path::new(STANDARD) {
            if std::io::stdout().is_terminal() {
                let way_out = "-o -: standard output is a terminal, which shows no EXR file; lead it into a file or a program";
                return Err(Error::Usage(way_out.into()));
            }
            return Ok(Self { exr: Some(output.into()), shown: None, device: true });
        }
        if let Ok(Place::Device) = check_writable(output) {
            return Ok(Self { exr: Some(output.into()), shown: None, device: true });
        }
        let (exr, shown) = match format(output) {
            Some(Format::Exr) => (Some(output.into()), Some(output.with_extension("png"))),
            Some(_) => (None, Some(output.into())),
            None => {
                return Err(Error::Usage(format!(
                    "{}: the ending decides what is written: .exr (all layers, with a PNG preview beside it), .png or .jpg \
                     (as on a display), .pfm or .hdr (linear light)",
                    output.display()
                )));
            }
        };
        Ok(Self { exr, shown, device: false })
    }

    /// The EXR file first.
    pub fn all(&self) -> impl Iterator<Item = &Path> {
        self.exr.iter().chain(&self.shown).map(PathBuf::as_path)
    }

    /// Refuses what must not be replaced, and says where links and devices lead. To be asked before any work.
    pub fn claim(&self, inputs: &[PathBuf], overwrite: Overwrite, quiet: bool) -> Result<()> {
        for path in self.all().filter(|_| !self.is_standard()) {
            let place = claim(path, inputs, overwrite)?;
            say_where(path, &place, quiet);
        }
        match (&self.exr, &self.shown) {
            (Some(exr), Some(shown)) if end(exr) == end(shown) => Err(Error::Usage(format!(
                "{} and {} lead to the same file; give -o another name",
                exr.display(),
                shown.display()
            ))),
            _ => Ok(()),
        }
    }

    /// True where the EXR file goes to standard output.
    pub fn is_standard(&self) -> bool {
        self.exr.as_deref() == Some(Path::new(STANDARD))
    }

    /// True where there is a file of what a display shows.
    pub fn displays(&self) -> bool {
        self.shown.as_deref().is_some_and(|path| !matches!(format(path), Some(Format::Pfm | Format::Hdr)))
    }

    /// Refuses a picture that the format cannot hold.
    pub fn check_size(&self, (width, height): (u32, u32)) -> Result<()> {
        match &self.shown {
            Some(path) if format(path) == Some(Format::Jpeg) && width.max(height) > LONGEST_JPEG => {
                Err(Error::Usage(format!(
                    "{}: a JPEG file has no more than {LONGEST_JPEG} pixels a side; write an .exr or a .png file",
                    path.display()
                )))
            }
            _ => Ok(()),
        }
    }

    /// Refuses what only an EXR file holds.
    pub fn must_hold_layers(&self, option: &str) -> Result<()> {
        match &self.exr {
            Some(_) => Ok(()),
            None => Err(Error::Usage(format!("{option} needs all layers; give -o a name that ends in .exr"))),
        }
    }

    /// Writes the EXR file, if that is asked for.
    pub fn put_layers(
        &self,
        size: (u32, u32),
        header: &Header,
        layers: &[WrittenLayer<'_>],
        compression: Compression,
    ) -> Result<()> {
        match &self.exr {
            None => Ok(()),
            Some(_) if self.is_standard() => {
                let bytes = exr_bytes(size, header, layers, compression);
                let bytes =
                    bytes.ok_or_else(|| Error::Usage("-o -: an EXR file holds no such picture".into()))?;
                std::io::stdout()
                    .write_all(&bytes)
                    .and_then(|()| std::io::stdout().flush())
                    .map_err(Error::Print)
            }
            Some(path) => write_layers_exr(path, size, header, layers, compression),
        }
    }

    /// Writes the one plane, if that is asked for.
    pub fn show(&self, (width, height): (u32, u32), plane: &[Vec3], preview: Preview) -> Result<()> {
        let Some(path) = &self.shown else { return Ok(()) };
        match format(path) {
            Some(Format::Jpeg) => write_rgb_jpg(path, width, height, plane, preview).map(drop),
            Some(Format::Pfm) => write_pfm(path, width, height, plane),
            Some(Format::Hdr) => write_hdr(path, width, height, plane),
            _ => write_rgb_png(path, width, height, plane, preview).map(drop),
        }
    }

    /// Their names.
    pub fn describe(&self) -> String {
        if self.is_standard() {
            return "an EXR file to standard output".into();
        }
        self.all().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" and ")
    }
}

fn format(path: &Path) -> Option<Format> {
    match ending(path).as_str() {
        "exr" => Some(Format::Exr),
        "png" => Some(Format::Png),
        "jpg" | "jpeg" => Some(Format::Jpeg),
        "pfm" => Some(Format::Pfm),
        "hdr" => Some(Format::Hdr),
        _ => None,
    }
}

/// What stands after the last dot, in small letters.
pub fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default()
}

fn end(path: &Path) -> PathBuf {
    let end = match check_writable(path) {
        Ok(Place::Link(end)) => end,
        _ => path.to_path_buf(),
    };
    end.canonicalize().unwrap_or(end)
}

/// Refuses a place that cannot be written, one that is read, by whatever name, and one that holds what another program wrote.
pub fn claim(path: &Path, inputs: &[PathBuf], overwrite: Overwrite) -> Result<Place> {
    let place = check_writable(path)?;
    refuse_input(path, inputs)?;
    if place != Place::Device && !overwrite.overwrite && path.exists() {
        let refused = |reason: String| Error::Write { path: path.into(), reason };
        if !is_ours(path).map_err(|e| refused(e.to_string()))? {
            return Err(refused(
                "halflight did not write the file that is there; give another name, or --overwrite".into(),
            ));
        }
    }
    Ok(place)
}

/// Refuses a place that is read.
pub fn refuse_input(path: &Path, inputs: &[PathBuf]) -> Result<()> {
    let Some(id) = FileId::of(path) else { return Ok(()) };
    match inputs.iter().find(|input| FileId::of(input).as_ref() == Some(&id)) {
        None => Ok(()),
        Some(input) => {
            let reason = format!("it is read, as {}; give -o another name", input.display());
            Err(Error::Write { path: path.into(), reason })
        }
    }
}

fn say_where(path: &Path, place: &Place, quiet: bool) {
    let path = path.display();
    let note = match place {
        _ if quiet => return,
        Place::File => return,
        Place::Link(end) => format!("note: {path} is a link; {} is written", end.display()),
        Place::Device => {
            format!("note: {path} is a device; an EXR file goes there, once, at the end, without a preview")
        }
    };
    say(note);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(name: &str) -> Result<PictureFiles> {
        PictureFiles::of(Path::new(name))
    }

    #[test]
    fn the_ending_decides() {
        let both = |exr: &str, png: &str| PictureFiles {
            exr: Some(exr.into()),
            shown: Some(png.into()),
            device: false,
        };
        assert_eq!(files("a/b.exr").unwrap(), both("a/b.exr", "a/b.png"));
        assert_eq!(files("b.v2.EXR").unwrap(), both("b.v2.EXR", "b.v2.png"));
        for alone in ["a.png", "a.PNG", "a.jpg", "a.JPEG", "a.pfm", "a.HDR"] {
            let shown = PictureFiles { exr: None, shown: Some(alone.into()), device: false };
            assert_eq!(files(alone).unwrap(), shown);
        }
        for other in ["picture", "a.tif", "a.exr.", ".exr", "a.gltf"] {
            let message = files(other).unwrap_err().to_string();
            assert!(
                [".exr", ".png", ".jpg", ".pfm", ".hdr"].iter().all(|known| message.contains(known)),
                "{message}"
            );
        }
    }

    #[cfg(unix)]
    #[test]
    fn inputs_are_refused_by_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("in.png"), b"a texture").unwrap();
        std::fs::hard_link(path("in.png"), path("hard.png")).unwrap();
        std::os::unix::fs::symlink("in.png", path("soft.png")).unwrap();
        std::fs::create_dir(path("sub")).unwrap();
        let inputs = [path("in.png")];
        for name in ["in.png", "hard.png", "soft.png", "sub/../in.png"] {
            for overwrite in [false, true] {
                let message = claim(&path(name), &inputs, Overwrite { overwrite }).unwrap_err().to_string();
                assert!(message.contains("it is read") && message.contains("in.png"), "{message}");
            }
        }
        let other = path("other.png");
        assert_eq!(claim(&other, &inputs, Overwrite::default()).unwrap(), Place::File);
        std::fs::write(&other, b"of another program").unwrap();
        let message = claim(&other, &inputs, Overwrite::default()).unwrap_err().to_string();
        assert!(message.contains("--overwrite"), "{message}");
        assert_eq!(claim(&other, &inputs, Overwrite { overwrite: true }).unwrap(), Place::File);
    }

    #[cfg(unix)]
    #[test]
    fn a_picture_and_its_preview_are_two_files() {
        let folder = tempfile::tempdir().unwrap();
        let exr = folder.path().join("a.exr");
        std::os::unix::fs::symlink("a.png", &exr).unwrap();
        let files = PictureFiles::of(&exr).unwrap();
        let message = files.claim(&[], Overwrite::default(), true).unwrap_err().to_string();
        assert!(message.contains("same file"), "{message}");
    }
}
