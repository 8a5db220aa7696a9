//! From glTF materials to lobes with shares. What we cannot show yet is reported, never silently dropped.

use super::Reason;
use super::extensions::{Standing, numeric_extent, standing};
use super::extras::{EmissionScale, Extras, Place};
use super::image::Images;
use super::notes::{Notes, label};
use super::stand_in::{Factors, factors};
use crate::optics::{Dielectric, Diffuse, Lobe, Mirror, ThinDielectric};
use crate::scene::assembly::Closure;
use crate::scene::names::clean;
use crate::scene::{Backs, Emission, Material};
use glam::Vec3;
use gltf::json::Root;
use gltf::json::extensions::material as extension;
use gltf::json::material::{AlphaMode, Material as Source};
use gltf::json::validation::Checked;
use std::collections::{BTreeSet, HashMap};

/// Up to this roughness a surface is seen as perfectly smooth: its lobe is narrower than a pixel.
const SMOOTH: f32 = 1e-3;

/// A mesh whose holes are less than this share of its area is meant as a body: Blender's monkey has 0.053 (its
/// eyes), a champagne flute without thickness about 0.09, a tumbler 0.2, a window pane more than 1.
const SMALL_HOLES: f64 = 1.0 / 16.0;

/// Makes the materials that surfaces ask for, each once per kind of body it covers and per tint.
pub(super) struct Materials<'a> {
    root: &'a Root,
    images: Images<'a>,
    default: Source,
    made: HashMap<(Option<usize>, bool, [u32; 3]), u32>,
    coated: BTreeSet<Option<usize>>,
    list: Vec<Material>,
}

/// What a surface asks for.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// Index into the file's materials; None: the default material of glTF.
    pub material: Option<usize>,
    /// Whether it encloses a body.
    pub closure: Closure,
    /// What its colour is multiplied by.
    pub tint: Vec3,
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
            extras.emission()?;
            extras.thin()?;
        }
        Ok(Self {
            root,
            images,
            default: Source::default(),
            made: HashMap::new(),
            coated: BTreeSet::new(),
            list: Vec::new(),
        })
    }

    /// The index of the material that a surface is made of.
    pub fn index(&mut self, wanted: Wanted<'_>, notes: &mut Notes) -> Result<u32, Reason> {
        let mut reader = Reader::new(self, wanted.material, notes)?;
        reader.colour *= wanted.tint;
        let body = wanted.closure.closed || wanted.closure.holes < SMALL_HOLES;
        let solid = reader.transmission > 0.0 && !reader.thin.unwrap_or(!body);
        if reader.transmission > 0.0 {
            let fact = match (solid, wanted.closure.closed || reader.thin.is_some()) {
                (true, true) => "solid glass",
                (true, false) => {
                    "solid glass in spite of small holes in the mesh (extras `thin`: true for panes)"
                }
                (false, _) => "thin panes of glass",
            };
            notes.about(fact, &format!("{} ({})", wanted.surface, reader.name));
        }
        let key = (wanted.material, solid, wanted.tint.to_array().map(f32::to_bits));
        if let Some(index) = self.made.get(&key) {
            return Ok(*index);
        }
        let made = reader.material(solid, notes)?;
        if reader.is_coated() {
            self.coated.insert(wanted.material);
        }
        let index = self.list.len() as u32;
        self.list.push(made);
        self.made.insert(key, index);
        Ok(index)
    }

    /// All that were made.
    pub fn finish(self, notes: &mut Notes) -> Vec<Material> {
        match self.coated.len() {
            0 => {}
            n => notes.line(format!(
                "{n} material{} a clear specular coat, which is not supported yet and left out",
                if n == 1 { " has" } else { "s have" }
            )),
        }
        self.list
    }
}

/// One source material with its numbers checked.
struct Reader {
    source: Source,
    extensions: extension::Material,
    name: String,
    label: String,
    extras: Extras,
    colour: Vec3,
    metallic: f32,
    roughness: f32,
    /// Share of all light, that of metal taken off.
    transmission: f32,
    /// What shines, before extras.
    emitted: Vec3,
    /// It shows its colour, whatever light falls on it.
    unlit: bool,
    ior: f32,
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
        let extensions = source.extensions.clone().unwrap_or_default();
        let Factors { colour, metallic, roughness, transmission, emitted } =
            factors(source, &mut materials.images, &name, &label, notes)?;
        let ior = extensions.ior.as_ref().map_or(1.5, |i| i.ior.0);
        if transmission > 0.0 && !(ior > 0.0 && ior.is_finite()) {
            return Err(format!("{label}: ior is {ior}; give glass a refractive index above 0, such as 1.5"));
        }
        let unlit = extensions.unlit.is_some();
        let extras = Extras::new(&source.extras, label.clone(), Place::Material, notes);
        Ok(Self {
            metallic,
            roughness,
            transmission: if unlit { 0.0 } else { transmission * (1.0 - metallic) },
            colour,
            emitted,
            unlit,
            thin: extras.thin()?,
            ior,
            source: source.clone(),
            extensions,
            name,
            label,
            extras,
        })
    }

    fn material(&self, solid: bool, notes: &mut Notes) -> Result<Material, Reason> {
        self.report(notes);
        let (albedo, two_sided) = (self.colour, self.source.double_sided);
        let diffuse = Lobe::Diffuse(Diffuse { albedo, two_sided, under: None });
        let metal = if self.roughness <= SMOOTH {
            Lobe::Mirror(Mirror { tint: self.colour, two_sided })
        } else {
            diffuse
        };
        let (ior, tint) = (self.ior, self.colour);
        let glass = if solid {
            Lobe::Dielectric(Dielectric { ior, tint })
        } else {
            Lobe::ThinDielectric(ThinDielectric { ior, tint })
        };
        let shares = if self.unlit { [0.0; 3] } else { self.shares() };
        let [of_metal, of_glass, of_body] = shares;
        let shares = [(of_metal, metal), (of_glass, glass), (of_body, diffuse)];
        let mut lobes: Vec<(f32, Lobe)> = Vec::new();
        for (share, lobe) in shares.into_iter().filter(|(share, _)| *share > 0.0) {
            match lobes.iter_mut().find(|(_, known)| *known == lobe) {
                Some((sum, _)) => *sum += share, // rough metal is diffuse, and so may the rest be
                None => lobes.push((share, lobe)),
            }
        }
        Ok(Material {
            lobes,
            illumination: self.extras.illumination()?,
            opaque: self.extras.opaque()?,
            straight: self.extras.straight()?,
            emission: self.emission(notes)?,
            backs: self.extras.backs()?.unwrap_or(if two_sided || self.transmission > 0.0 {
                Backs::Seen
            } else {
                Backs::Unseen
            }),
            ..Material::new(self.name.clone(), diffuse)
        })
    }

    /// Of metal, of glass and of the diffuse body under it.
    fn shares(&self) -> [f32; 3] {
        [self.metallic, self.transmission, 1.0 - self.metallic - self.transmission]
    }

    /// An unlit surface is seen and lights nothing, unless extras say otherwise.
    fn emission(&self, notes: &mut Notes) -> Result<Option<Emission>, Reason> {
        let colour = if self.unlit { self.colour } else { self.emitted };
        if colour == Vec3::ZERO {
            if self.extras.has_emission() {
                notes.about("extras `emission` without effect, because nothing is emitted", &self.label);
            }
            return Ok(None);
        }
        let usual = if self.unlit { EmissionScale::SEEN } else { EmissionScale::default() };
        let radiance = self.extras.emission()?.unwrap_or(usual).of(colour);
        if !radiance.is_finite() {
            return Err(format!("{}: its emission times extras `emission` is not finite", self.label));
        }
        let two_sided = self.source.double_sided;
        Ok((!radiance.is_zero()).then_some(Emission { radiance, two_sided }))
    }

    /// True when glTF puts a specular coat over a diffuse body here.
    fn is_coated(&self) -> bool {
        let specular = self.extensions.specular.as_ref();
        let strength = specular.map_or(1.0, |s| s.specular_factor.0);
        let tinted_out = specular.is_some_and(|s| s.specular_color_factor.0 == [0.0; 3]);
        let body = !self.unlit && self.metallic + self.transmission < 1.0;
        body && self.ior != 1.0 && strength != 0.0 && !tinted_out
    }

    fn report(&self, notes: &mut Notes) {
        let (source, more) = (&self.source, &self.extensions);
        let alpha = matches!(source.alpha_mode, Checked::Valid(AlphaMode::Mask | AlphaMode::Blend));
        let smooth = self.roughness <= SMOOTH;
        let facts = [
            (source.normal_texture.is_some(), "normal textures are not supported yet"),
            (self.has_coat_texture(), "specular textures are not supported yet"),
            (self.metallic > 0.0 && !smooth, "rough metal is not supported yet, it is seen as diffuse"),
            (self.transmission > 0.0 && !smooth, "rough glass is not supported yet, it is seen as smooth"),
            (self.absorbs(), "KHR_materials_volume (light absorbed on its way through) is not supported yet"),
        ];
        for (_, fact) in facts.iter().filter(|(holds, _)| *holds && !self.unlit) {
            notes.about(fact, &self.name);
        }
        if alpha {
            notes.about("alpha is not supported, the surface is opaque", &self.name);
        }
        for (extension, value) in &more.others {
            let off = match standing(extension) {
                Some(Standing::Fine) => true,
                Some(Standing::Factor(key)) => value.get(key).map_or(0.0, numeric_extent) == 0.0,
                _ => false,
            };
            if !off && !self.unlit {
                notes.about(&format!("{extension} is not supported yet"), &self.name);
            }
        }
    }

    fn has_coat_texture(&self) -> bool {
        let specular = self.extensions.specular.as_ref();
        specular.is_some_and(|s| s.specular_texture.is_some() || s.specular_color_texture.is_some())
    }

    /// True for glass that takes light on its way through.
    fn absorbs(&self) -> bool {
        self.extensions.volume.as_ref().is_some_and(|v| {
            self.transmission > 0.0
                && v.thickness_factor.0 > 0.0
                && v.attenuation_distance.0.is_finite()
                && v.attenuation_color.0 != [1.0; 3]
        })
    }
}
