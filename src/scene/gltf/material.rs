//! From glTF materials to lobes with shares. What we cannot show yet is reported, never silently dropped.

use super::Reason;
use super::extensions::{Standing, standing};
use super::extras::{EMISSION, EmissionScale, Extras, Place};
use super::image::Images;
use super::notes::{Notes, label};
use super::parameters::parameters;
use crate::scene::assembly::Closure;
use crate::scene::check::check_fluorescence;
use crate::scene::names::clean;
use crate::scene::texture::Texture;
use crate::scene::{Anisotropy, Backs, Factor, Fluorescence, Material, Parameters, Pbr, VertexColours};
use glam::{Affine2, Vec3};
use gltf::json::Root;
use gltf::json::extensions::material as extension;
use gltf::json::material::Material as Source;
use std::collections::HashMap;
use std::rc::Rc;

/// A mesh whose holes are less than this share of its area is meant as a body: Blender's monkey has 0.053 (its
/// eyes), a champagne flute without thickness about 0.09, a tumbler 0.2, a window pane more than 1.
const SMALL_HOLES: f64 = 1.0 / 16.0;

/// Makes the materials that surfaces ask for, each once per kind of body it covers, with and without vertex colours.
pub(super) struct Materials<'a> {
    root: &'a Root,
    images: Images<'a>,
    default: Source,
    read: HashMap<Option<usize>, Rc<Reader>>,
    made: HashMap<(Option<usize>, bool, bool), u32>,
    list: Vec<Made>,
}

/// A material under way.
struct Made {
    material: Material,
    pbr: Pbr,
    /// The colours of all vertices that are made of it.
    colours: Option<Colours>,
}

/// Colours of many vertices, linear.
#[derive(Clone, Copy, Debug)]
pub(super) struct Colours {
    /// The largest of each channel.
    pub most: Vec3,
    pub sum: Vec3,
    pub count: usize,
}

/// What of a vertex the textures of a material ask for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Needs {
    /// Which sets of texture coordinates.
    pub uvs: [bool; 2],
    /// The set that a normal map, else a grain is laid out by, and how: what tangents follow from.
    pub tangents: Option<(u8, Affine2)>,
    /// It has a colour that those of vertices multiply.
    pub colours: bool,
}

/// What a surface asks for.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// Index into the file's materials; None: the default material of glTF.
    pub material: Option<usize>,
    /// Whether it encloses a body.
    pub closure: Closure,
    /// Its vertices' colours.
    pub colours: Option<Colours>,
    /// The surface, for messages.
    pub surface: &'a str,
}

impl<'a> Materials<'a> {
    /// None made yet. Reads the extras of all, so that a mistake is told even where no surface uses it.
    pub fn new(root: &'a Root, images: Images<'a>, notes: &mut Notes) -> Result<Self, Reason> {
        for (index, source) in root.materials.iter().enumerate() {
            let name = label("material", index, source.name.as_deref());
            let extras = Extras::new(&source.extras, name, Place::Material, notes);
            extras.illumination()?;
            extras.opaque()?;
            extras.straight()?;
            extras.fluorescence()?;
            extras.emission()?;
            extras.thin()?;
        }
        Ok(Self {
            root,
            images,
            default: Source::default(),
            read: HashMap::new(),
            made: HashMap::new(),
            list: Vec::new(),
        })
    }

    /// What of the vertices a material asks for.
    pub fn needs(&mut self, material: Option<usize>, notes: &mut Notes) -> Result<Needs, Reason> {
        let reader = self.reader(material, notes)?;
        let of = |set: u8| reader.pbr.textures().any(|texture| texture.set == set);
        let laid_out = |texture: &Texture| (texture.set, texture.transform);
        // A grain without an image runs along the first coordinate of the first set.
        let along = |grain: &Anisotropy| grain.texture.as_ref().map_or((0, Affine2::IDENTITY), laid_out);
        let grain = reader.pbr.anisotropy.as_ref().map(along);
        Ok(Needs {
            uvs: [of(0) || grain.is_some(), of(1)],
            tangents: reader.pbr.normal.as_ref().map(|map| laid_out(&map.texture)).or(grain),
            colours: reader.pbr.base != Factor::new(Vec3::ZERO),
        })
    }

    fn reader(&mut self, material: Option<usize>, notes: &mut Notes) -> Result<Rc<Reader>, Reason> {
        if let Some(known) = self.read.get(&material) {
            return Ok(Rc::clone(known));
        }
        let reader = Rc::new(Reader::new(self, material, notes)?);
        self.read.insert(material, Rc::clone(&reader));
        Ok(reader)
    }

    /// The index of the material that a surface is made of.
    pub fn index(&mut self, wanted: Wanted<'_>, notes: &mut Notes) -> Result<u32, Reason> {
        let reader = self.reader(wanted.material, notes)?;
        let body = wanted.closure.closed || wanted.closure.holes < SMALL_HOLES;
        let solid = reader.is_glass() && !reader.thin.unwrap_or(!body);
        if reader.is_glass() {
            let fact = match (solid, wanted.closure.closed || reader.thin.is_some()) {
                (true, true) => "solid glass",
                (true, false) => {
                    "solid glass in spite of small holes in the mesh (extras `thin`: true for panes)"
                }
                (false, _) => "thin panes of glass",
            };
            notes.about(fact, &format!("{} ({})", wanted.surface, reader.name));
        }
        let key = (wanted.material, solid, wanted.colours.is_some());
        if let Some(&index) = self.made.get(&key) {
            let known = &mut self.list[index as usize].colours;
            *known = known.zip(wanted.colours).map(|(known, more)| known.and(more));
            return Ok(index);
        }
        let material = reader.material(notes)?;
        let index = self.list.len() as u32;
        let pbr = Pbr { solid, ..reader.pbr.clone() };
        self.list.push(Made { material, pbr, colours: wanted.colours });
        self.made.insert(key, index);
        Ok(index)
    }

    /// All that were made.
    pub fn finish(self) -> Result<Vec<Material>, Reason> {
        let good = |material: Material| {
            check_fluorescence(&material).map_err(|what| format!("material `{}`: {what}", material.name))?;
            Ok(material)
        };
        self.list.into_iter().map(Made::finish).map(good).collect()
    }
}

impl Made {
    fn finish(self) -> Material {
        let Self { material, pbr, colours } = self;
        let vertex_colours = colours.map(|Colours { most, sum, count }| {
            let mean = sum / count.max(1) as f32;
            VertexColours { most, mean }
        });
        let made = Material::pbr(material.name.clone(), Pbr { vertex_colours, ..pbr });
        let Material { lobes, pattern, emission, covered, most, .. } = made;
        Material { lobes, pattern, emission, covered, most, ..material }
    }
}

impl Colours {
    /// Of both.
    fn and(self, other: Self) -> Self {
        Self { most: self.most.max(other.most), sum: self.sum + other.sum, count: self.count + other.count }
    }
}

/// One source material with its numbers checked.
struct Reader {
    extensions: extension::Material,
    name: String,
    label: String,
    extras: Extras,
    /// All of it, as if it covered nothing.
    pbr: Pbr,
    /// Its numbers at their least and at their most.
    extremes: [Parameters; 2],
    thin: Option<bool>,
}

impl Reader {
    fn new(materials: &mut Materials<'_>, index: Option<usize>, notes: &mut Notes) -> Result<Self, Reason> {
        let source = match index {
            None => &materials.default,
            Some(i) => materials
                .root
                .materials
                .get(i)
                .ok_or_else(|| format!("material {i} does not exist; export it again"))?,
        };
        let (name, label) = match (&source.name, index) {
            (Some(name), Some(i)) if !name.is_empty() => (clean(name), label("material", i, Some(name))),
            (_, Some(i)) => (format!("material {i}"), label("material", i, None)),
            (_, None) => ("default".to_owned(), "the default material".to_owned()),
        };
        let mut pbr = parameters(source, &mut materials.images, &name, &label, notes)?;
        if pbr.transmission.factor > 0.0 && !(pbr.ior > 0.0 && pbr.ior.is_finite()) {
            let ior = pbr.ior;
            return Err(format!("{label}: ior is {ior}; give glass a refractive index above 0, such as 1.5"));
        }
        let extras = Extras::new(&source.extras, label.clone(), Place::Material, notes);
        let usual = if pbr.unlit { EmissionScale::SEEN } else { EmissionScale::default() };
        pbr.emission = extras.emission()?.unwrap_or(usual).halves();
        let most = if pbr.unlit { Vec3::ONE } else { pbr.emissive.factor };
        if pbr.emission.iter().any(|half| !(*half * most).is_finite()) {
            return Err(format!("{label}: its emission times extras `emission` is not finite"));
        }
        Ok(Self {
            extremes: pbr.extremes(),
            pbr,
            thin: extras.thin()?,
            extensions: source.extensions.clone().unwrap_or_default(),
            name,
            label,
            extras,
        })
    }

    /// What the extras say, and the name; the rest follows from `pbr`.
    fn material(&self, notes: &mut Notes) -> Result<Material, Reason> {
        self.report(notes);
        let dark = match self.pbr.unlit {
            true => self.extremes[1].base == Vec3::ZERO,
            false => self.pbr.emissive.factor == Vec3::ZERO,
        };
        if dark && self.extras.has(EMISSION) {
            notes.about("extras `emission` without effect, because nothing is emitted", &self.label);
        }
        let see_through = self.pbr.two_sided || self.is_glass() || self.pbr.translucence.factor > 0.0;
        Ok(Material {
            illumination: self.extras.illumination()?,
            opaque: self.extras.opaque()?,
            straight: self.extras.straight()?,
            fluorescence: self.fluorescence(notes)?,
            backs: self.extras.backs()?.unwrap_or(if see_through { Backs::Seen } else { Backs::Unseen }),
            absorption: self.absorption(),
            dispersion: self.dispersion(),
            ..Material::diffuse(self.name.clone(), Vec3::ZERO)
        })
    }

    /// What its diffuse lobe re-radiates.
    fn fluorescence(&self, notes: &mut Notes) -> Result<Option<Fluorescence>, Reason> {
        let fluorescence = self.extras.fluorescence()?;
        let mut lobes = self.pbr.envelope();
        if fluorescence.is_some() && !lobes.any(|(_, lobe)| lobe.as_diffuse().is_some()) {
            notes.about(
                "extras `fluorescence` without effect, because nothing is reflected diffusely",
                &self.label,
            );
        }
        Ok(fluorescence)
    }

    /// True where light goes through some of it.
    fn is_glass(&self) -> bool {
        let [least, most] = self.extremes;
        !self.pbr.unlit && most.transmission * (1.0 - least.metallic) > 0.0
    }

    fn report(&self, notes: &mut Notes) {
        if self.extensions.others.contains_key(SPECULAR_GLOSSINESS) {
            notes.about(
                &format!(
                    "{SPECULAR_GLOSSINESS} is read as a body under a clear layer of its specular colour"
                ),
                &self.name,
            );
        }
        for extension in self.extensions.others.keys() {
            let read = matches!(standing(extension), Some(Standing::Fine));
            if !read && !self.pbr.unlit {
                notes.about(&format!("{extension} is not supported yet"), &self.name);
            }
        }
    }

    /// What the body of glass absorbs on light's way, m⁻¹: KHR_materials_volume.
    fn absorption(&self) -> Vec3 {
        let Some(volume) = self.extensions.volume.as_ref().filter(|_| self.is_glass()) else {
            return Vec3::ZERO;
        };
        let distance = volume.attenuation_distance.0;
        if !(distance.is_finite() && distance > 0.0) {
            return Vec3::ZERO;
        }
        let colour = Vec3::from_array(volume.attenuation_color.0).clamp(DARKEST, Vec3::ONE);
        -colour.map(f32::ln) / distance
    }

    /// How its glass spreads colours: KHR_materials_dispersion.
    fn dispersion(&self) -> f32 {
        let dispersion = self.extensions.others.get("KHR_materials_dispersion");
        let dispersion = dispersion.and_then(|more| more["dispersion"].as_f64()).unwrap_or(0.0) as f32;
        if self.is_glass() && dispersion.is_finite() { dispersion.max(0.0) } else { 0.0 }
    }
}

/// What of light is left after the attenuation distance of a volume that leaves nothing.
const DARKEST: Vec3 = Vec3::splat(1e-6);

const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
