use crate::array::{colour, fluorescence, matrix, of_matrix};
use crate::errors::usage;
use crate::options::{Options, halves, illumination};
use crate::texture;
use glam::{Vec3, Vec4};
use halflight::scene::{
    Alpha, Anisotropy, Backs, Emission, Illumination, Material as Matter, Pbr, VertexColours,
};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, MutexGuard};

/// What a mesh is made of, by the parameters of a glTF material; `diffuse`, `mirror`, `metal` and `glass` make plain ones.
///
/// Colours are three linear numbers, or one for grey. `emission` is a radiance (W m⁻² sr⁻¹). Of what is transmitted `thin` makes a
/// pane, else a solid that refracts; `absorption` (1/m) is that of its body. `textures` are arrays of uint8 of shape (height, width,
/// channels), by what they say.
///
/// `fluorescence` is what its diffuse lobe re-radiates: a 3×3 matrix (rows are the colours that leave), or the 6×6 matrix of the paper's
/// eq. 17; where more leaves than came, `gain` says that this is wanted.
///
/// `illumination`, `opaque` and `straight` may be changed at any time; what is rendered later shows it.
#[pyclass(frozen, module = "halflight")]
pub struct Material {
    inner: Mutex<Made>,
}

#[derive(Clone)]
struct Made {
    matter: Matter,
    /// What it follows from, where it is made in code of glTF's parameters.
    pbr: Option<Pbr>,
}

impl Material {
    /// One that a scene came with, or that has no parameters.
    pub fn plain(matter: Matter) -> Self {
        Self { inner: Mutex::new(Made { matter, pbr: None }) }
    }

    fn made(&self) -> MutexGuard<'_, Made> {
        // It is held for no longer than it takes to copy it.
        self.inner.lock().expect("nothing panics while it is held")
    }

    /// As it is now, on vertices of these colours.
    pub fn matter(&self, colours: Option<VertexColours>) -> Matter {
        let Made { matter, pbr } = self.made().clone();
        match (pbr, colours) {
            (Some(pbr), Some(colours)) => {
                let mut made = Matter::pbr(matter.name.clone(), Pbr { vertex_colours: Some(colours), ..pbr });
                // What does not follow from glTF's parameters.
                (made.illumination, made.opaque, made.straight) =
                    (matter.illumination, matter.opaque, matter.straight);
                (made.backs, made.absorption, made.dispersion) =
                    (matter.backs, matter.absorption, matter.dispersion);
                made.fluorescence = matter.fluorescence;
                made
            }
            _ => matter,
        }
    }
}

/// What all meshes of a material have as colours of their vertices; those that have none are white.
pub fn vertex_colours<'a>(meshes: impl Iterator<Item = Option<&'a [Vec4]>>) -> Option<VertexColours> {
    let (mut most, mut sum, mut count, mut some) = (Vec3::ZERO, Vec3::ZERO, 0_usize, false);
    for colours in meshes {
        some |= colours.is_some();
        for colour in colours.unwrap_or(&[Vec4::ONE]) {
            most = most.max(colour.truncate());
            sum += colour.truncate();
            count += 1;
        }
    }
    some.then(|| VertexColours { most, mean: sum / count.max(1) as f32 })
}

#[pymethods]
impl Material {
    #[new]
    #[pyo3(
        signature = (name, **more),
        text_signature = "(name, *, base_color=1, metallic=0, roughness=1, specular=1, specular_color=1, transmission=0, ior=1.5, thin=False, absorption=0, dispersion=0, diffuse_transmission=0, diffuse_transmission_color=1, clearcoat=0, clearcoat_roughness=0, sheen_color=0, sheen_roughness=0, iridescence=0, iridescence_ior=1.3, iridescence_thickness=(100, 400), anisotropy=0, anisotropy_rotation=0, alpha=1, alpha_mode='opaque', alpha_cutoff=0.5, emission=0, halves='both', unlit=False, double_sided=False, backs='seen', textures=None, illumination=None, opaque=None, straight=None, fluorescence=None, gain=False)"
    )]
    fn new(name: String, more: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let more = Options::of("Material()", more)?;
        let mut pbr = parameters(&more)?;
        let thin = more.get("thin", "True or False")?.unwrap_or(false);
        pbr.solid = !thin && pbr.transmission.factor > 0.0;
        if let Some(textures) = more.get::<Bound<'_, PyDict>>("textures", "a dict")? {
            texture::lay(&mut pbr, &textures)?;
        }
        let mut matter = Matter::pbr(name, pbr.clone());
        let absorption = more.read("absorption", |value| colour(value, "absorption"))?;
        matter.absorption = absorption.unwrap_or(Vec3::ZERO);
        matter.dispersion = more.get("dispersion", "a number")?.unwrap_or(0.0);
        matter.backs = match more.get::<String>("backs", "\"seen\" or \"unseen\"")?.as_deref() {
            None | Some("seen") => Backs::Seen,
            Some("unseen") => Backs::Unseen,
            Some(other) => return Err(usage(format!("backs={other:?}: give \"seen\" or \"unseen\""))),
        };
        matter.illumination = more.read("illumination", illumination)?;
        matter.opaque = more.read("opaque", |value| matrix(value, "opaque"))?.flatten();
        matter.straight = more.read("straight", |value| matrix(value, "straight"))?.flatten();
        let gain = more.get("gain", "True or False")?.unwrap_or(false);
        matter.fluorescence = more.read("fluorescence", |value| fluorescence(value, gain))?.flatten();
        more.finish()?;
        Ok(Self { inner: Mutex::new(Made { matter, pbr: Some(pbr) }) })
    }

    /// Lambertian, one-sided: it reflects `albedo` in [0, 1] of what it meets.
    #[staticmethod]
    #[pyo3(signature = (name, albedo=None, *, emission=None))]
    fn diffuse(
        name: String,
        albedo: Option<&Bound<'_, PyAny>>,
        emission: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let albedo = albedo.map_or(Ok(Vec3::splat(0.8)), |albedo| colour(albedo, "albedo"))?;
        let matter = Matter::diffuse(name, albedo);
        Ok(Self::plain(match emission {
            None => matter,
            Some(emission) => matter.with_emission(Emission::front(colour(emission, "emission")?)),
        }))
    }

    /// A smooth mirror, one-sided, that keeps `tint` in [0, 1] of what it meets at all angles.
    #[staticmethod]
    #[pyo3(signature = (name, tint=None))]
    fn mirror(name: String, tint: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let tint = tint.map_or(Ok(Vec3::ONE), |tint| colour(tint, "tint"))?;
        Ok(Self::plain(Matter::mirror(name, tint)))
    }

    /// Polished metal, one-sided, that keeps `base` in [0, 1] of what it meets face on, and all of what grazes it.
    #[staticmethod]
    fn metal(name: String, base: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self::plain(Matter::metal(name, colour(base, "base")?)))
    }

    /// Clear glass for closed meshes; `absorption` (1/m) is what its body takes of light, `dispersion` is 20 over Abbe's number.
    #[staticmethod]
    #[pyo3(signature = (name, ior=1.5, *, absorption=None, dispersion=0.0))]
    fn glass(
        name: String,
        ior: f32,
        absorption: Option<&Bound<'_, PyAny>>,
        dispersion: f32,
    ) -> PyResult<Self> {
        let absorption = absorption.map_or(Ok(Vec3::ZERO), |rgb| colour(rgb, "absorption"))?;
        let glass = Matter::glass(name, ior).with_absorption(absorption);
        Ok(Self::plain(glass.with_dispersion(dispersion)))
    }

    /// Its name, by which a scene knows it.
    #[getter]
    pub fn name(&self) -> String {
        self.made().matter.name.clone()
    }

    /// Its own illumination, as words; None: that of the scene. Set a name ("local", "whitted", …), a point (s, t), or None.
    #[getter]
    fn illumination(&self) -> Option<String> {
        self.made().matter.illumination.map(Illumination::describe)
    }

    #[setter]
    fn set_illumination(&self, value: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        self.made().matter.illumination = value.map(illumination).transpose()?;
        Ok(())
    }

    /// Its own matrix of what it reflects, float32 of shape (2, 2): the outgoing half is the row, invisible first. None: as its
    /// illumination says.
    #[getter]
    fn opaque<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f32>>> {
        self.made().matter.opaque.map(|matrix| of_matrix(py, matrix))
    }

    #[setter]
    fn set_opaque(&self, value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.made().matter.opaque = matrix(value, "opaque")?;
        Ok(())
    }

    /// Its own matrix of what goes straight through, float32 of shape (2, 2). None: as its illumination says.
    #[getter]
    fn straight<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f32>>> {
        self.made().matter.straight.map(|matrix| of_matrix(py, matrix))
    }

    #[setter]
    fn set_straight(&self, value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.made().matter.straight = matrix(value, "straight")?;
        Ok(())
    }

    fn __repr__(&self) -> String {
        format!("<halflight.Material {:?}>", self.name())
    }
}

/// What glTF says of a material.
fn parameters(more: &Options<'_>) -> PyResult<Pbr> {
    let share = |name, usual: f32| {
        let value = more.get::<f32>(name, "a number")?.unwrap_or(usual);
        let fits = (0.0..=1.0).contains(&value);
        fits.then_some(value).ok_or_else(|| usage(format!("{name}={value}: give a share from 0 to 1")))
    };
    let number = |name, usual: f32| Ok::<f32, PyErr>(more.get(name, "a number")?.unwrap_or(usual));
    let hue = |name, usual: f32| {
        let value = more.read(name, |value| colour(value, name))?.unwrap_or(Vec3::splat(usual));
        let fits = value.is_finite() && value.min_element() >= 0.0;
        fits.then_some(value)
            .ok_or_else(|| usage(format!("{name}={value}: give finite numbers, none below 0")))
    };
    let flag = |name| Ok::<bool, PyErr>(more.get(name, "True or False")?.unwrap_or(false));
    let mut pbr = Pbr { metallic: share("metallic", 0.0)?, ..Pbr::default() };
    pbr.base.factor = hue("base_color", 1.0)?;
    pbr.roughness = share("roughness", 1.0)?;
    pbr.specular.factor = share("specular", 1.0)?;
    pbr.specular_colour.factor = hue("specular_color", 1.0)?;
    pbr.transmission.factor = share("transmission", 0.0)?;
    pbr.ior = number("ior", 1.5)?;
    pbr.translucence.factor = share("diffuse_transmission", 0.0)?;
    pbr.translucent_colour.factor = hue("diffuse_transmission_color", 1.0)?;
    pbr.coat.factor = share("clearcoat", 0.0)?;
    pbr.coat_roughness.factor = share("clearcoat_roughness", 0.0)?;
    pbr.sheen.factor = hue("sheen_color", 0.0)?;
    pbr.sheen_roughness.factor = share("sheen_roughness", 0.0)?;
    pbr.film.factor = share("iridescence", 0.0)?;
    pbr.film_ior = number("iridescence_ior", 1.3)?;
    let thickness = more.get::<(f32, f32)>("iridescence_thickness", "two numbers, nanometres")?;
    pbr.film_thickness = thickness.map_or(pbr.film_thickness, Into::into);
    let (strength, rotation) = (share("anisotropy", 0.0)?, number("anisotropy_rotation", 0.0)?);
    pbr.anisotropy = (strength > 0.0).then_some(Anisotropy { strength, rotation, texture: None });
    pbr.alpha = share("alpha", 1.0)?;
    let cutoff = share("alpha_cutoff", 0.5)?;
    pbr.coverage = match more.get::<String>("alpha_mode", "a word")?.as_deref() {
        None | Some("opaque") => Alpha::Opaque,
        Some("mask") => Alpha::Mask(cutoff),
        Some("blend") => Alpha::Blend,
        Some(other) => {
            return Err(usage(format!("alpha_mode={other:?}: give \"opaque\", \"mask\" or \"blend\"")));
        }
    };
    pbr.emissive.factor = hue("emission", 0.0)?;
    pbr.emission = halves(more.any("halves")?.as_ref())?;
    pbr.unlit = flag("unlit")?;
    pbr.two_sided = flag("double_sided")?;
    check_ior(&pbr)?;
    Ok(pbr)
}

fn check_ior(pbr: &Pbr) -> PyResult<()> {
    for (name, ior) in [("ior", pbr.ior), ("iridescence_ior", pbr.film_ior)] {
        if !(ior > 0.0 && ior.is_finite()) {
            return Err(usage(format!("{name}={ior}: give a refractive index above 0, such as 1.5")));
        }
    }
    Ok(())
}
