//! What glTF says of a material, and the lobes that follow from it at a point.
//!
//! The only way from parameters to lobes is [`Pbr::lobes_of`]: a material that is the same everywhere has one list of them, one
//! with textures another at every point. Plans look at [`Pbr::envelope`], which no point exceeds.

use super::Emission;
use super::texture::{Inputs, Texture};
use crate::light::Light;
use crate::optics::{Dielectric, Diffuse, Lobe, Mirror, Normals, ThinDielectric};
use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};

/// Up to this roughness a surface is seen as perfectly smooth: its lobe is narrower than a pixel.
pub(super) const SMOOTH: f32 = 1e-3;

/// A number or a colour, times what a texture says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Factor<T> {
    /// What the texture is multiplied by; all there is without one.
    pub factor: T,
    /// What varies over the surface.
    pub texture: Option<Texture>,
}

/// What is known of the colours of vertices, linear, in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexColours {
    /// The largest of each channel.
    pub most: Vec3,
    /// Their mean.
    pub mean: Vec3,
}

/// A tangent-space normal map.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// Right, up and out of the surface, each as 2 x − 1.
    pub texture: Texture,
    /// What right and up are multiplied by.
    pub scale: f32,
}

/// The parameters of a glTF material, each with its texture. Shares and colours are in [0, 1].
#[derive(Clone, Debug, PartialEq)]
pub struct Pbr {
    /// What metal mirrors and the rest scatters, linear: red, green, blue of the texture.
    pub base: Factor<Vec3>,
    /// The vertices' colours, where they multiply `base`.
    pub vertex_colours: Option<VertexColours>,
    /// Share of metal: blue of `metallic_roughness`.
    pub metallic: f32,
    /// Roughness as artists give it, the square root of α: green of `metallic_roughness`.
    pub roughness: f32,
    /// Roughness in green, metal in blue.
    pub metallic_roughness: Option<Texture>,
    /// Share of what is not metal that goes through: red of the texture.
    pub transmission: Factor<f32>,
    /// Refractive index of what light goes through.
    pub ior: f32,
    /// Whether it encloses a body; else it is a thin pane.
    pub solid: bool,
    /// Whether its back is as its front.
    pub two_sided: bool,
    /// It reflects nothing and shows its base colour, whatever light falls on it.
    pub unlit: bool,
    /// What it radiates, before `emission`; W m⁻² sr⁻¹.
    pub emissive: Factor<Vec3>,
    /// The invisible and the visible half of what it radiates, as shares of it.
    pub emission: [f32; 2],
    /// Where its normals point beside those of the mesh.
    pub normal: Option<NormalMap>,
}

/// [`Pbr`] at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Base colour.
    pub base: Vec3,
    /// Share of metal.
    pub metallic: f32,
    /// Roughness.
    pub roughness: f32,
    /// Share of what is not metal that goes through.
    pub transmission: f32,
}

impl Default for Pbr {
    /// glTF's default material.
    fn default() -> Self {
        Self {
            base: Factor { factor: Vec3::ONE, texture: None },
            vertex_colours: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness: None,
            transmission: Factor::default(),
            ior: 1.5,
            solid: false,
            two_sided: false,
            unlit: false,
            emissive: Factor::default(),
            emission: [1.0; 2],
            normal: None,
        }
    }
}

impl<T: Copy> Factor<T> {
    /// Without a texture.
    pub fn new(factor: T) -> Self {
        Self { factor, texture: None }
    }

    fn texel(&self, look: impl Fn(&Texture) -> Vec4) -> Vec4 {
        self.texture.as_ref().map_or(Vec4::ONE, look)
    }
}

impl Pbr {
    /// True where it is not the same everywhere.
    pub fn varies(&self) -> bool {
        self.normal.is_some() || self.vertex_colours.is_some() || self.textures().next().is_some()
    }

    /// All its textures, that of normals among them.
    pub fn textures(&self) -> impl Iterator<Item = &Texture> {
        self.named_textures().map(|(_, texture)| texture)
    }

    /// The same, and what each says.
    pub fn named_textures(&self) -> impl Iterator<Item = (&'static str, &Texture)> {
        let Self { base, metallic_roughness, transmission, emissive, normal, .. } = self;
        [
            ("base colour", base.texture.as_ref()),
            ("metallic-roughness", metallic_roughness.as_ref()),
            ("transmission", transmission.texture.as_ref()),
            ("emissive", emissive.texture.as_ref()),
            ("normal", normal.as_ref().map(|map| &map.texture)),
        ]
        .into_iter()
        .filter_map(|(what, texture)| Some((what, texture?)))
    }

    /// Without textures that nothing depends on: neither its lobes, where they are read at all, nor what it is seen to radiate,
    /// nor its normals.
    #[must_use]
    pub fn read(&self, lobes: bool) -> Self {
        let mut kept = self.clone();
        let (lobes, picture) = (lobes && !self.unlit, self.shows_picture());
        if !(lobes || self.unlit && picture) {
            (kept.base.texture, kept.vertex_colours) = (None, None);
        }
        if !lobes {
            kept.transmission.texture = None;
        }
        // What is neither metal nor glass looks the same however rough it is.
        if !lobes || (self.metallic == 0.0 && self.transmission.factor == 0.0) {
            kept.metallic_roughness = None;
        }
        if self.unlit || !picture {
            kept.emissive.texture = None;
        }
        kept
    }

    /// The most that its lobes together send on at any point of light of each channel, which is less than the sum of
    /// [`envelope`](Self::envelope): where there is metal there is no glass.
    pub fn most_reflected(&self) -> Vec3 {
        let [least, most] = self.extremes();
        most.base.lerp(Vec3::ONE, most.transmission * (1.0 - least.metallic))
    }

    /// The parameters at a point.
    pub fn parameters(&self, inputs: &Inputs) -> Parameters {
        let colour = if self.vertex_colours.is_some() { inputs.colour.xyz() } else { Vec3::ONE };
        self.of(|texture| texture.of(inputs), colour)
    }

    /// What textures say is `look`'s affair.
    fn of(&self, look: impl Fn(&Texture) -> Vec4, colour: Vec3) -> Parameters {
        let rough = self.metallic_roughness.as_ref().map_or(Vec4::ONE, &look);
        Parameters {
            base: self.base.factor * self.base.texel(&look).xyz() * colour,
            metallic: self.metallic * rough.z,
            roughness: self.roughness * rough.y,
            transmission: self.transmission.factor * self.transmission.texel(&look).x,
        }
    }

    /// The lobes at a point, with their shares.
    pub fn lobes(&self, inputs: &Inputs) -> impl Iterator<Item = (f32, Lobe)> + use<> {
        self.lobes_of(&self.parameters(inputs))
    }

    /// The lobes that parameters make, with their shares, which are above 0: **what a new lobe is to be added to**, and to
    /// [`envelope`](Self::envelope).
    pub fn lobes_of(&self, at: &Parameters) -> impl Iterator<Item = (f32, Lobe)> + use<> {
        let Parameters { base, metallic, roughness, transmission } = *at;
        let of_glass = transmission * (1.0 - metallic);
        // Rough metal is seen as diffuse.
        let (of_mirror, of_rest) = match roughness <= SMOOTH {
            true => (metallic, 1.0 - metallic - of_glass),
            false => (0.0, 1.0 - of_glass),
        };
        self.kinds([(of_mirror, base), (of_glass, base), (of_rest, base)])
    }

    /// Each parameter at its least and at its most.
    pub fn extremes(&self) -> [Parameters; 2] {
        let least = if self.vertex_colours.is_some() { Vec3::ZERO } else { Vec3::ONE };
        let most = self.vertex_colours.map_or(Vec3::ONE, |colours| colours.most);
        [self.of(|texture| texture.image.least(), least), self.of(|texture| texture.image.most(), most)]
    }

    /// For each kind of lobe that occurs at some point its largest share, and in each channel its largest colour: what no point
    /// exceeds, to the rounding of [`Image`](super::texture::Image)'s smaller versions.
    pub fn envelope(&self) -> impl Iterator<Item = (f32, Lobe)> + use<> {
        let [least, most] = self.extremes();
        let glass = |by: Parameters, metal: f32| by.transmission * (1.0 - metal);
        let of_mirror = if least.roughness <= SMOOTH { most.metallic } else { 0.0 };
        let of_rest = match most.roughness <= SMOOTH {
            true => (1.0 - least.metallic) * (1.0 - least.transmission),
            false => 1.0 - glass(least, most.metallic),
        };
        self.kinds([(of_mirror, most.base), (glass(most, least.metallic), most.base), (of_rest, most.base)])
    }

    /// Lobes of mirrors, of glass and of what is diffuse, as far as they have a share.
    fn kinds(&self, shares: [(f32, Vec3); 3]) -> impl Iterator<Item = (f32, Lobe)> + use<> {
        let Self { two_sided, ior, solid, unlit, .. } = *self;
        let kinds = shares.map(|(share, _)| share);
        let [mirror, glass, diffuse] = shares.map(|(_, colour)| colour);
        let mirror = Lobe::Mirror(Mirror { tint: mirror, two_sided });
        let glass = match solid {
            true => Lobe::Dielectric(Dielectric { ior, tint: glass }),
            false => Lobe::ThinDielectric(ThinDielectric { ior, tint: glass }),
        };
        let diffuse = Lobe::Diffuse(Diffuse { albedo: diffuse, two_sided });
        kinds.into_iter().zip([mirror, glass, diffuse]).filter(move |(share, _)| *share > 0.0 && !unlit)
    }

    /// What it radiates at a point, of both halves.
    pub fn radiance(&self, inputs: &Inputs) -> Light {
        let colour = match self.unlit {
            true => self.parameters(inputs).base,
            false => self.emissive.factor * self.emissive.texel(|texture| texture.of(inputs)).xyz(),
        };
        self.halves(colour)
    }

    /// The mean of the base colour over its images and vertices.
    pub fn mean_base(&self) -> Vec3 {
        let mean = self.vertex_colours.map_or(Vec3::ONE, |colours| colours.mean);
        self.of(|texture| texture.image.mean(), mean).base
    }

    /// The mean of what it radiates over its images and vertices.
    pub fn mean_radiance(&self) -> Light {
        let colour = match self.unlit {
            true => self.mean_base(),
            false => self.emissive.factor * self.emissive.texel(|texture| texture.image.mean()).xyz(),
        };
        self.halves(colour)
    }

    fn halves(&self, colour: Vec3) -> Light {
        let [invisible, visible] = self.emission;
        Light::new(invisible * colour, visible * colour)
    }

    /// True where what it radiates is only seen and is not the same everywhere: then it is looked up where it is seen.
    pub fn shows_picture(&self) -> bool {
        let varies = match self.unlit {
            true => self.base.texture.is_some() || self.vertex_colours.is_some(),
            false => self.emissive.texture.is_some(),
        };
        varies && self.emission[0] == 0.0 && self.emission[1] > 0.0
    }

    /// Its emission as a whole. None: it has none.
    pub fn emitted(&self) -> Option<Emission> {
        let radiance = self.mean_radiance();
        (!radiance.is_zero()).then_some(Emission { radiance, two_sided: self.two_sided })
    }
}

impl NormalMap {
    /// Both normals at a point, where a tangent (of any length) is the image's right, and `up` its up as seen from the front: 1
    /// where that is the side to which normal × tangent points, else −1.
    pub fn at(&self, normals: &Normals, tangent: Vec3, up: f32, inputs: &Inputs) -> Normals {
        let out = normals.shading;
        let Some(right) = (tangent - tangent.dot(out) * out).try_normalize() else { return *normals };
        let texel = self.texture.of(inputs);
        let slope = self.scale * (2.0 * Vec2::new(texel.x, texel.y) - 1.0);
        let up = up * out.cross(right);
        let shading = slope.x * right + slope.y * up + (2.0 * texel.z - 1.0) * out;
        Normals::new(normals.geometric, shading.normalize_or(out))
    }
}
