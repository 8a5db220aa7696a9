use crate::errors::{raised, usage};
use crate::options::Options;
use crate::picture::{Picture, claim};
use crate::render::Render;
use crate::scene::Scene;
use crate::settings::{Limits, Wanted};
use halflight::atlas::Atlas as Square;
use halflight::error::{Error, Result};
use halflight::film::{Compression, Header, Image, Layer, Preview, WrittenLayer, write_layers_exr};
use halflight::scene::Illumination;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Every picture of the illumination square, from one render of `scene` (settings as of `render`) or from a file by `Atlas.load`.
///
/// `at(s, t)` takes milliseconds: s is inter-reflection, t shadowlessness, both from 0 to 1.
#[pyclass(frozen, module = "halflight")]
pub struct Atlas {
    atlas: Square,
    header: Header,
    preview: Preview,
}

#[pymethods]
impl Atlas {
    #[new]
    #[pyo3(
        signature = (scene, **more),
        text_signature = "(scene, *, size=None, passes=None, seconds=None, error=None, seed=0, photons=None, direct='auto', max_reflections=None, indirect_radius=None, caustic_radius=2, progress=False)"
    )]
    fn new(py: Python<'_>, scene: &Bound<'_, Scene>, more: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let begin = Instant::now();
        let more = Options::of("Atlas()", more)?;
        let (wanted, limits, progress) = (Wanted::of(&more)?, Limits::of(&more)?, more.any("progress")?);
        more.finish()?;
        if wanted.denoise {
            return Err(usage("denoise=True: an atlas holds a hundred pictures as they are; leave it out"));
        }
        let render = Render::begin(py, scene, wanted, true)?;
        render.until(py, begin, &limits, progress.as_ref())?;
        let (atlas, header) = render.look(py, |render| (render.atlas(), render.header()));
        let atlas = atlas.expect("it was asked for");
        Ok(Self { atlas, header, preview: render.preview() })
    }

    /// Reads an EXR file that `halflight render --atlas` or `save` wrote.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let (atlas, header) = py.detach(|| Square::read(&path)).map_err(raised)?;
        Ok(Self { atlas, header, preview: Preview::default() })
    }

    /// The picture at a point of the square, with its standard error.
    fn at(&self, py: Python<'_>, s: f64, t: f64) -> PyResult<Picture> {
        let image = py.detach(|| self.mixed(s, t)).map_err(raised)?;
        Ok(Picture::new(image, self.preview))
    }

    /// Writes it as an EXR file, which `halflight mix` and `halflight view` read too. A file that halflight did not write is replaced
    /// only with `overwrite`.
    #[pyo3(signature = (path, *, overwrite=false))]
    fn save(&self, py: Python<'_>, path: PathBuf, overwrite: bool) -> PyResult<()> {
        if !overwrite {
            claim(&path)?;
        }
        py.detach(|| self.write(&path)).map_err(raised)
    }

    /// About which share of the light at a point has more reflections than the atlas holds; 0 as a rule.
    fn left_out(&self, s: f64, t: f64) -> f64 {
        self.atlas.left_out(s, t)
    }

    /// Where images exist, as records: at `t`, `kappa` is the multiplication factor at s = 1, with its standard error.
    fn frontier<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let record = |sample: &halflight::atlas::Sample| {
            let record = PyDict::new(py);
            record.set_item("t", sample.t)?;
            record.set_item("kappa", sample.kappa)?;
            record.set_item("error", sample.error)?;
            Ok(record)
        };
        let records: Vec<_> = self.atlas.frontier.samples().iter().map(record).collect::<PyResult<_>>()?;
        PyList::new(py, records)
    }

    /// Passes behind it.
    #[getter]
    fn passes(&self) -> u32 {
        self.atlas.passes
    }

    /// (width, height) in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.atlas.width, self.atlas.height)
    }

    fn __repr__(&self) -> String {
        let Square { width, height, passes, .. } = self.atlas;
        format!("<halflight.Atlas {width}x{height}, {passes} passes>")
    }
}

impl Atlas {
    fn mixed(&self, s: f64, t: f64) -> Result<Image> {
        let mixed = self.atlas.mix(s, t)?;
        let mut header = self.header.clone();
        header.entries.retain(|(name, _)| !name.starts_with("atlas_"));
        header.set("illumination", Illumination::Square { s: s as f32, t: t as f32 }.describe());
        header.set("left_out", mixed.left_out);
        header.set("error_samples", self.atlas.groups);
        let layers = vec![
            (Layer::Visible.name().to_owned(), mixed.visible),
            (Layer::Error.name().to_owned(), mixed.error),
        ];
        Ok(Image { width: self.atlas.width, height: self.atlas.height, layers, header })
    }

    /// The picture in the file is that of one bounce, which exists in every scene.
    fn write(&self, path: &Path) -> Result<()> {
        if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("exr")) {
            return Err(Error::Usage(format!("{}: an atlas is an .exr file", path.display())));
        }
        let image = self.mixed(0.0, 0.0)?;
        let mut header = self.header.clone();
        header.set("illumination", Illumination::ONE_BOUNCE.describe());
        self.atlas.describe_in(&mut header);
        let layers: Vec<_> = WrittenLayer::all_of(&image).chain(self.atlas.layers()).collect();
        write_layers_exr(path, (image.width, image.height), &header, &layers, Compression::Uncompressed)
    }
}
