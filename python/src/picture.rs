use crate::array::{of_numbers, of_plane};
use crate::errors::{no_layer, raised, usage};
use halflight::error::Error;
use halflight::film::denoise::DENOISED;
use halflight::film::{
    Exposure, Film, Header, Image, Layer, Preview, Value, View, is_ours, read_exr, rgb_png, write_hdr,
    write_image_exr, write_pfm, write_rgb_jpg, write_rgb_png,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use std::path::{Path, PathBuf};

/// A picture: named layers of linear RGB and facts. A notebook shows it.
///
/// Layers are float32 arrays of shape (height, width, 3), row 0 at the top, each made anew; `depth` is (height, width), m.
#[pyclass(frozen, module = "halflight")]
pub struct Picture {
    image: Image,
    /// How it is shown where nothing else is said.
    preview: Preview,
}

impl Picture {
    pub fn new(image: Image, preview: Preview) -> Self {
        let mut image = image;
        if let Some(visible) = image.layer(Layer::Visible.name()) {
            let stops = preview.exposure.stops(visible);
            image.header.set("view", preview.view.name());
            image.header.set("exposure", stops);
        }
        Self { image, preview }
    }

    /// Of a film so far: all its layers; or those that `denoising` names, and a denoised one.
    pub fn of(film: &Film, header: Header, denoising: Option<&[Layer]>, preview: Preview) -> Self {
        let mut image = film.image_of(denoising.unwrap_or(film.layers()), &header);
        if denoising.is_some() {
            let plane = film.denoised_layer(&mut image.header);
            image.layers.push((DENOISED.into(), plane));
        }
        Self::new(image, preview)
    }

    /// Its layers and facts.
    pub fn image(&self) -> &Image {
        &self.image
    }

    fn size(&self) -> (u32, u32) {
        (self.image.width, self.image.height)
    }

    fn plane(&self, name: &str) -> PyResult<&[glam::Vec3]> {
        self.image.layer(name).ok_or_else(|| {
            let there = self.image.layer_names();
            let way_out = match name == DENOISED {
                true => "denoise=True".into(),
                false => format!("layers=[\"{name}\"]"),
            };
            no_layer(format!("the picture has no layer `{name}`; it has {there}; render it with {way_out}"))
        })
    }

    /// What a display shows, and files of one plane hold: the denoised picture where there is one.
    fn shown_plane(&self) -> Option<&[glam::Vec3]> {
        self.image.layer(DENOISED).or_else(|| self.image.layer(Layer::Visible.name()))
    }

    fn shown(&self, exposure: Option<&Bound<'_, PyAny>>, view: Option<&str>) -> PyResult<Preview> {
        let exposure = match exposure {
            None => self.preview.exposure,
            Some(asked) => asked.str()?.to_string().parse::<Exposure>().map_err(usage)?,
        };
        let view = match view {
            None => self.preview.view,
            Some(name) => View::ALL.into_iter().find(|view| view.name() == name).ok_or_else(|| {
                usage(format!(
                    "view: there is no '{name}'; the views are {}",
                    View::ALL.map(View::name).join(", ")
                ))
            })?,
        };
        // By the picture itself, so that a denoised one is shown at the same.
        let stops = self.image.layer(Layer::Visible.name()).map(|visible| exposure.stops(visible));
        Ok(Preview { exposure: stops.map_or(exposure, |stops| Exposure::Stops(stops as f32)), view })
    }

    fn layer_array<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let plane = self.plane(name)?;
        Ok(match name == Layer::Depth.name() {
            true => of_numbers(py, self.size(), plane)?.into_any(),
            false => of_plane(py, self.size(), plane.to_vec())?.into_any(),
        })
    }
}

#[pymethods]
impl Picture {
    /// Reads an EXR file, of halflight or of another program.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let image = py.detach(|| read_exr(&path)).map_err(raised)?;
        let exposure = image.header.get("exposure").and_then(Value::as_real).unwrap_or(0.0);
        let view = image.header.get("view").map(Value::to_string);
        let view = View::ALL.into_iter().find(|known| view.as_deref() == Some(known.name()));
        let exposure = Exposure::Stops(exposure as f32);
        Ok(Self { image, preview: Preview { exposure, view: view.unwrap_or_default() } })
    }

    /// Pixels per row.
    #[getter]
    fn width(&self) -> u32 {
        self.image.width
    }

    /// Rows.
    #[getter]
    fn height(&self) -> u32 {
        self.image.height
    }

    /// The names of its layers.
    #[getter]
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.image.layers.iter().map(|(name, _)| name))
    }

    /// A layer by its name: float32, (height, width, 3); depth (height, width).
    fn layer<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.layer_array(py, name)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.layer_array(py, name)
    }

    /// The picture: the visible half of what reaches each pixel, W m⁻² sr⁻¹, linear RGB.
    #[getter]
    fn visible<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.layer_array(py, "visible")
    }

    /// The invisible half.
    #[getter]
    fn invisible<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.layer_array(py, "invisible")
    }

    /// The standard error of `visible`, in its unit; infinite after one pass.
    #[getter]
    fn error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.layer_array(py, "error")
    }

    /// What the finite gather radius adds to `visible`, as far as it can tell.
    #[getter]
    fn bias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.layer_array(py, "bias")
    }

    /// `visible` with less noise, of a render with `denoise`.
    #[getter]
    fn denoised<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.layer_array(py, DENOISED)
    }

    /// Facts about it: version, method, scene, seed, passes, …
    #[getter]
    fn facts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let facts = PyDict::new(py);
        for (name, value) in &self.image.header.entries {
            match value {
                Value::Text(text) => facts.set_item(name, text)?,
                Value::Integer(whole) => facts.set_item(name, whole)?,
                Value::Real(number) => facts.set_item(name, number)?,
            }
        }
        Ok(facts)
    }

    /// Writes it; the ending decides: .exr holds all layers, .png and .jpg what a display shows at `exposure` (stops or "auto") by a
    /// `view` ("standard", "neutral", "agx"), .pfm and .hdr linear light: of `denoised` where there is one, else of
    /// `visible`. A file that halflight did not write is replaced only with `overwrite`.
    #[pyo3(signature = (path, *, exposure=None, view=None, overwrite=false))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        exposure: Option<&Bound<'_, PyAny>>,
        view: Option<&str>,
        overwrite: bool,
    ) -> PyResult<()> {
        let preview = self.shown(exposure, view)?;
        if !overwrite {
            claim(&path)?;
        }
        py.detach(|| self.write(&path, preview)).map_err(raised)
    }

    /// The bytes of a PNG file of what a display shows, as `save` would write it.
    #[pyo3(signature = (*, exposure=None, view=None))]
    fn png<'py>(
        &self,
        py: Python<'py>,
        exposure: Option<&Bound<'py, PyAny>>,
        view: Option<&str>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let (preview, plane) =
            (self.shown(exposure, view)?, self.shown_plane().map_or_else(|| self.plane("visible"), Ok)?);
        let (width, height) = self.size();
        Ok(PyBytes::new(py, &py.detach(|| rgb_png(width, height, plane, preview))))
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.png(py, None, None)
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.size();
        format!("<halflight.Picture {width}x{height}: {}>", self.image.layer_names())
    }
}

impl Picture {
    fn write(&self, path: &Path, preview: Preview) -> halflight::error::Result<()> {
        let (width, height) = self.size();
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let shown = || {
            self.shown_plane()
                .ok_or_else(|| Error::Usage("the picture has no layer `visible` that could be shown".into()))
        };
        match ending.as_deref() {
            Some("exr") => write_image_exr(path, &self.image),
            Some("png") => write_rgb_png(path, width, height, shown()?, preview).map(drop),
            Some("jpg" | "jpeg") => write_rgb_jpg(path, width, height, shown()?, preview).map(drop),
            Some("pfm") => write_pfm(path, width, height, shown()?),
            Some("hdr") => write_hdr(path, width, height, shown()?),
            _ => Err(Error::Usage(format!(
                "{}: the ending decides what is written: .exr (all layers), .png or .jpg (as on a display), .pfm or .hdr (linear light)",
                path.display()
            ))),
        }
    }
}

/// Refuses a place that holds what another program wrote.
pub fn claim(path: &Path) -> PyResult<()> {
    let refused = |reason: String| raised(Error::Write { path: path.into(), reason });
    if path.is_file() && !is_ours(path).map_err(|why| refused(why.to_string()))? {
        return Err(refused(
            "halflight did not write the file that is there; give another name, or overwrite=True".into(),
        ));
    }
    Ok(())
}
