//! What glTF says of a material, and the lobes that follow from it at a point.
//!
//! The only way from parameters to lobes is [`Pbr::lobes_of`]: a material that is the same everywhere has one list of them, one
//! with textures another at every point. Plans look at [`Pbr::envelope`], which no point exceeds.

use super::Emission;
use super::texture::{Image, Inputs, Texture};
use crate::light::Light;
use crate::optics::{
    Clear, Dielectric, Diffuse, Film, Glossy, Layers, Lobe, Mirror, Normals, RoughDielectric, RoughThin,
    Sheen, ThinDielectric, Translucent, Velvet,
};
use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};

/// Up to this roughness a surface is seen as perfectly smooth: its lobe is narrower than a pixel.
const SMOOTH: f32 = 1e-3;
/// What a coat of index 1.5 mirrors at normal incidence.
const COAT: f32 = 0.04;
/// Directions that are looked at for the most that is reflected.
const DIRECTIONS: u32 = 64;

/// Shares of what a surface is made of.
#[derive(Clone, Copy)]
struct Shares {
    metal: f32,
    glass: f32,
    /// What is neither.
    body: f32,
    /// Of a body what leaves on the side that light comes to, and on the other.
    leaves: [f32; 2],
}

/// What mirrors of metal and bodies.
#[derive(Clone, Copy, PartialEq)]
enum Facets {
    /// None are seen: a mirror of metal alone.
    Mirror,
    /// They are, however smooth; glass is that of roughness 0.
    Smooth,
    /// They are.
    Rough,
}

/// What a body mirrors at normal and at grazing incidence.
struct Specular {
    f0: Vec3,
    f90: f32,
}

/// GGX roughness of a roughness as artists give it.
fn alpha(roughness: f32) -> f32 {
    (roughness * roughness).max(1e-6)
}

/// A coat as a layer above others.
fn coat_of(at: &Parameters) -> Clear {
    Clear { f0: COAT * at.coat, f90: at.coat, alpha: alpha(at.coat_roughness) }
}

impl Anisotropy {
    /// Parameters with the direction that the grain has at a point.
    fn at(&self, inputs: &Inputs, at: Parameters) -> Parameters {
        let Some((right, up)) = inputs.tangent else { return Parameters { anisotropy: 0.0, ..at } };
        let along = match &self.texture {
            Some(texture) => (2.0 * texture.of(inputs).xy() - 1.0).normalize_or(Vec2::X),
            None => Vec2::X,
        };
        let along: Vec2 = Vec2::from_angle(self.rotation).rotate(along);
        Parameters { tangent: (along.x * right + along.y * up).normalize_or(right), ..at }
    }
}

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

/// How much of a surface is there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// All of it.
    #[default]
    Opaque,
    /// All of it where alpha is no less than this, nothing elsewhere.
    Mask(f32),
    /// Of each place the share that alpha says.
    Blend,
}

/// A grain: roughness that depends on the direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Anisotropy {
    /// How much rougher it is along its direction, in [0, 1].
    pub strength: f32,
    /// Its direction, counter-clockwise from the tangent, radians.
    pub rotation: f32,
    /// Direction in red and green, as 2 x − 1, what `strength` is multiplied by in blue.
    pub texture: Option<Texture>,
}

/// The parameters of a glTF material, each with its texture. Shares and colours are in [0, 1].
#[derive(Clone, Debug, PartialEq)]
pub struct Pbr {
    /// What metal mirrors and the rest scatters, linear: red, green, blue of the texture. Its alpha says how much there is.
    pub base: Factor<Vec3>,
    /// What alpha of the texture is multiplied by.
    pub alpha: f32,
    /// What alpha means.
    pub coverage: Alpha,
    /// The vertices' colours, where they multiply `base`.
    pub vertex_colours: Option<VertexColours>,
    /// Share of metal: blue of `metallic_roughness`.
    pub metallic: f32,
    /// Roughness as artists give it, the square root of α: green of `metallic_roughness`.
    pub roughness: f32,
    /// Roughness in green, metal in blue.
    pub metallic_roughness: Option<Texture>,
    /// The strength of what a body that is no metal mirrors: alpha of the texture.
    pub specular: Factor<f32>,
    /// Its colour at normal incidence, ≥ 0: red, green, blue.
    pub specular_colour: Factor<Vec3>,
    /// Share of what is not metal that goes through: red of the texture.
    pub transmission: Factor<f32>,
    /// Share of what a body scatters that leaves on its other side: alpha of the texture.
    pub translucence: Factor<f32>,
    /// Its colour.
    pub translucent_colour: Factor<Vec3>,
    /// A clear coat above all: red of the texture.
    pub coat: Factor<f32>,
    /// Its roughness: green.
    pub coat_roughness: Factor<f32>,
    /// Fibres above all but the coat: their colour.
    pub sheen: Factor<Vec3>,
    /// Their roughness: alpha.
    pub sheen_roughness: Factor<f32>,
    /// A grain of what mirrors.
    pub anisotropy: Option<Anisotropy>,
    /// A thin film on what mirrors: how much of it there is, red of the texture.
    pub film: Factor<f32>,
    /// The film's index.
    pub film_ior: f32,
    /// The film's thickness in nanometres where green of the texture is 0, and where it is 1 or there is none.
    pub film_thickness: [f32; 2],
    /// What lies between those two.
    pub film_texture: Option<Texture>,
    /// Refractive index of what light goes through, and of the body that mirrors.
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
    /// Alpha.
    pub alpha: f32,
    /// Share of metal.
    pub metallic: f32,
    /// Roughness.
    pub roughness: f32,
    /// Strength of what a body mirrors.
    pub specular: f32,
    /// Its colour.
    pub specular_colour: Vec3,
    /// Share of what is not metal that goes through.
    pub transmission: f32,
    /// Share of what is scattered that goes through.
    pub translucence: f32,
    /// Its colour.
    pub translucent_colour: Vec3,
    /// How much clear coat there is.
    pub coat: f32,
    /// Its roughness.
    pub coat_roughness: f32,
    /// Colour of fibres.
    pub sheen: Vec3,
    /// Their roughness.
    pub sheen_roughness: f32,
    /// How much rougher along the grain.
    pub anisotropy: f32,
    /// Along the grain, in the world.
    pub tangent: Vec3,
    /// How much of a thin film there is.
    pub film: f32,
    /// Its thickness, nm.
    pub film_thickness: f32,
}

impl Parameters {
    /// True for metal and nothing else, with nothing above it.
    fn is_bare_metal(&self) -> bool {
        self.metallic >= 1.0 && self.coat <= 0.0 && self.sheen == Vec3::ZERO && self.film == 0.0
    }
}

impl Default for Pbr {
    /// glTF's default material.
    fn default() -> Self {
        Self {
            base: Factor { factor: Vec3::ONE, texture: None },
            alpha: 1.0,
            coverage: Alpha::Opaque,
            vertex_colours: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness: None,
            specular: Factor::new(1.0),
            specular_colour: Factor::new(Vec3::ONE),
            transmission: Factor::default(),
            translucence: Factor::default(),
            translucent_colour: Factor::new(Vec3::ONE),
            coat: Factor::default(),
            coat_roughness: Factor::default(),
            sheen: Factor::default(),
            sheen_roughness: Factor::default(),
            anisotropy: None,
            film: Factor::default(),
            film_ior: 1.3,
            film_thickness: [100.0, 400.0],
            film_texture: None,
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
        self.normal.is_some()
            || self.vertex_colours.is_some()
            || self.anisotropy.is_some()
            || self.textures().next().is_some()
    }

    /// All its textures, that of normals among them.
    pub fn textures(&self) -> impl Iterator<Item = &Texture> {
        self.named_textures().map(|(_, texture)| texture)
    }

    /// The same, and what each says.
    pub fn named_textures(&self) -> impl Iterator<Item = (&'static str, &Texture)> {
        [
            ("base colour", self.base.texture.as_ref()),
            ("metallic-roughness", self.metallic_roughness.as_ref()),
            ("specular", self.specular.texture.as_ref()),
            ("specular colour", self.specular_colour.texture.as_ref()),
            ("transmission", self.transmission.texture.as_ref()),
            ("diffuse transmission", self.translucence.texture.as_ref()),
            ("diffuse transmission colour", self.translucent_colour.texture.as_ref()),
            ("clear coat", self.coat.texture.as_ref()),
            ("clear coat roughness", self.coat_roughness.texture.as_ref()),
            ("sheen", self.sheen.texture.as_ref()),
            ("sheen roughness", self.sheen_roughness.texture.as_ref()),
            ("iridescence", self.film.texture.as_ref()),
            ("iridescence thickness", self.film_texture.as_ref()),
            ("anisotropy", self.anisotropy.as_ref().and_then(|grain| grain.texture.as_ref())),
            ("emissive", self.emissive.texture.as_ref()),
            ("normal", self.normal.as_ref().map(|map| &map.texture)),
        ]
        .into_iter()
        .filter_map(|(what, texture)| Some((what, texture?)))
    }

    /// Without textures that nothing depends on: neither its lobes, where they are read at all, nor what it is seen to radiate,
    /// nor its normals, nor how much of it is there.
    #[must_use]
    pub fn read(&self, lobes: bool) -> Self {
        let mut kept = self.clone();
        let (lobes, picture) = (lobes && !self.unlit, self.shines_unevenly());
        if !(lobes || self.has_holes() || self.unlit && picture) {
            (kept.base.texture, kept.vertex_colours) = (None, None);
        }
        if !lobes {
            for share in [
                &mut kept.specular,
                &mut kept.transmission,
                &mut kept.translucence,
                &mut kept.coat,
                &mut kept.coat_roughness,
                &mut kept.sheen_roughness,
                &mut kept.film,
            ] {
                share.texture = None;
            }
            for colour in [&mut kept.specular_colour, &mut kept.translucent_colour, &mut kept.sheen] {
                colour.texture = None;
            }
            (kept.anisotropy, kept.film_texture) = (None, None);
        }
        // What neither mirrors nor lets through looks the same however rough it is.
        let mirrors = self.specular.factor > 0.0 && self.ior != 1.0;
        if !lobes || !(mirrors || self.metallic > 0.0 || self.transmission.factor > 0.0) {
            kept.metallic_roughness = None;
        }
        if self.unlit || !picture {
            kept.emissive.texture = None;
        }
        kept
    }

    /// The most that its lobes together send on at any point of light of each channel, which is less than the sum of
    /// [`envelope`](Self::envelope): where there is metal there is no glass, and what a layer mirrors does not reach what is below.
    pub fn most_reflected(&self) -> Vec3 {
        let [least, most] = self.extremes();
        // Of all others more reflect more. What of these varies is looked at from both ends.
        let ends: [fn(&mut Parameters) -> &mut f32; 4] = [
            |at| &mut at.roughness,
            |at| &mut at.coat_roughness,
            |at| &mut at.sheen_roughness,
            |at| &mut at.translucence,
        ];
        let mut corners = vec![Parameters { transmission: 0.0, metallic: 0.0, ..most }];
        for end in ends {
            let lower = *end(&mut { least });
            for mut corner in corners.clone() {
                if *end(&mut corner) != lower {
                    *end(&mut corner) = lower;
                    corners.push(corner);
                }
            }
        }
        let opaque = corners.iter().fold(most.base, |known, at| {
            let metal = Parameters { metallic: 1.0, ..*at };
            let metals = if most.metallic > 0.0 { self.most_at(&metal) } else { Vec3::ZERO };
            let bodies = if least.metallic < 1.0 { self.most_at(at) } else { Vec3::ZERO };
            known.max(metals).max(bodies)
        });
        opaque.min(Vec3::ONE).lerp(Vec3::ONE, most.transmission * (1.0 - least.metallic))
    }

    /// The most that all lobes together send on of light from any direction.
    fn most_at(&self, at: &Parameters) -> Vec3 {
        let normals = Normals::flat(Vec3::Z);
        let lobes: Vec<_> = Self { two_sided: true, ..self.clone() }.lobes_of(at).collect();
        let sum = |step: u32| {
            let mu = (step as f32 / DIRECTIONS as f32).powi(2).max(1e-4);
            let from = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
            lobes.iter().map(|(share, lobe)| *share * lobe.share(&normals, from)).sum::<Vec3>()
        };
        // Between those that are looked at albedos are smooth.
        (0..=DIRECTIONS).map(sum).fold(Vec3::ZERO, Vec3::max) * 1.002
    }

    /// The parameters at a point.
    pub fn parameters(&self, inputs: &Inputs) -> Parameters {
        let colour = if self.vertex_colours.is_some() { inputs.colour } else { Vec4::ONE };
        let of = self.of(|texture| texture.of(inputs), colour);
        match &self.anisotropy {
            Some(grain) => grain.at(inputs, of),
            None => of,
        }
    }

    /// What textures say is `look`'s affair.
    fn of(&self, look: impl Fn(&Texture) -> Vec4, colour: Vec4) -> Parameters {
        let texel = |texture: &Option<Texture>| texture.as_ref().map_or(Vec4::ONE, &look);
        let share = |of: &Factor<f32>, channel: usize| of.factor * texel(&of.texture)[channel];
        let rgb = |of: &Factor<Vec3>| of.factor * texel(&of.texture).xyz();
        let (base, rough) = (texel(&self.base.texture), texel(&self.metallic_roughness));
        let grain = self.anisotropy.as_ref();
        Parameters {
            base: self.base.factor * base.xyz() * colour.xyz(),
            alpha: self.alpha * base.w * colour.w,
            metallic: self.metallic * rough.z,
            roughness: self.roughness * rough.y,
            specular: share(&self.specular, 3),
            specular_colour: rgb(&self.specular_colour),
            transmission: share(&self.transmission, 0),
            translucence: share(&self.translucence, 3),
            translucent_colour: rgb(&self.translucent_colour),
            coat: share(&self.coat, 0),
            coat_roughness: share(&self.coat_roughness, 1),
            sheen: rgb(&self.sheen),
            sheen_roughness: share(&self.sheen_roughness, 3),
            anisotropy: grain.map_or(0.0, |grain| grain.strength * texel(&grain.texture).z),
            tangent: Vec3::X,
            film: share(&self.film, 0),
            film_thickness: {
                let [thin, thick] = self.film_thickness;
                thin + (thick - thin) * texel(&self.film_texture).y
            },
        }
    }

    /// The share of the surface that is there at a point.
    pub fn covered(&self, inputs: &Inputs) -> f32 {
        match self.coverage {
            Alpha::Opaque => 1.0,
            _ => {
                let texel = self.base.texture.as_ref().map_or(1.0, |texture| texture.of(inputs).w);
                let vertex = if self.vertex_colours.is_some() { inputs.colour.w } else { 1.0 };
                self.covers(self.alpha * texel * vertex)
            }
        }
    }

    /// What alpha means.
    fn covers(&self, alpha: f32) -> f32 {
        match self.coverage {
            Alpha::Opaque => 1.0,
            Alpha::Mask(least) => f32::from(u8::from(alpha >= least)),
            Alpha::Blend => alpha.clamp(0.0, 1.0),
        }
    }

    /// True where more of it may be there in one place than in another.
    pub fn has_holes(&self) -> bool {
        let varies = self
            .base
            .texture
            .as_ref()
            .is_some_and(|texture| texture.image.least().w < texture.image.most().w)
            || self.vertex_colours.is_some();
        self.coverage != Alpha::Opaque && varies
    }

    /// The share of it that is there: that of all places where it is the same, else the mean.
    pub fn mean_covered(&self) -> f32 {
        let look = |texel: fn(&Image) -> Vec4| {
            self.alpha * self.base.texture.as_ref().map_or(1.0, |texture| texel(&texture.image).w)
        };
        let (mean, most) = (look(Image::mean), look(Image::most));
        match self.coverage {
            // About so much is no less than the least that is there; where anything is, it is not nothing.
            Alpha::Mask(least) if self.has_holes() && mean < least => {
                if most < least {
                    0.0
                } else {
                    mean.clamp(f32::MIN_POSITIVE, 1.0)
                }
            }
            _ => self.covers(mean),
        }
    }

    /// The lobes at a point, with their shares.
    pub fn lobes(&self, inputs: &Inputs) -> impl Iterator<Item = (f32, Lobe)> + use<> {
        self.lobes_of(&self.parameters(inputs))
    }

    /// The lobes that parameters make, with their shares, which are above 0: **what a new lobe is to be added to**, and to
    /// [`envelope`](Self::envelope).
    pub fn lobes_of(&self, at: &Parameters) -> impl Iterator<Item = (f32, Lobe)> + use<> {
        let glass = at.transmission * (1.0 - at.metallic);
        let leaves = [1.0 - at.translucence, at.translucence];
        let shares = Shares { metal: at.metallic, glass, body: 1.0 - at.metallic - glass, leaves };
        let facets = match at.roughness <= SMOOTH {
            true if at.is_bare_metal() => Facets::Mirror,
            true => Facets::Smooth,
            false => Facets::Rough,
        };
        self.made(at, shares, facets).into_iter().flatten()
    }

    /// Each parameter at its least and at its most.
    pub fn extremes(&self) -> [Parameters; 2] {
        let least = if self.vertex_colours.is_some() { Vec4::ZERO } else { Vec4::ONE };
        let most = self.vertex_colours.map_or(Vec4::ONE, |colours| colours.most.extend(1.0));
        [self.of(|texture| texture.image.least(), least), self.of(|texture| texture.image.most(), most)]
    }

    /// For each kind of lobe that occurs at some point its largest share, and in each channel its largest colour: what no point
    /// exceeds, to the rounding of [`Image`](super::texture::Image)'s smaller versions.
    pub fn envelope(&self) -> impl Iterator<Item = (f32, Lobe)> + use<> {
        let [least, most] = self.extremes();
        let glass = most.transmission * (1.0 - least.metallic);
        let body = (1.0 - least.metallic) * (1.0 - least.transmission);
        let leaves = [1.0 - least.translucence, most.translucence];
        let shares = Shares { metal: most.metallic, glass, body, leaves };
        let smooth = least.roughness <= SMOOTH;
        let bare = Parameters { metallic: most.metallic, ..least }.is_bare_metal();
        let alone = least.is_bare_metal() && most.is_bare_metal();
        let kinds = [
            (Facets::Mirror, smooth && bare),
            (Facets::Smooth, smooth && !alone),
            (Facets::Rough, most.roughness > SMOOTH),
        ];
        let mut all: Vec<(f32, Lobe)> = Vec::new();
        let occurs = kinds.into_iter().filter(|(_, occurs)| *occurs);
        for one in occurs.flat_map(|(facets, _)| self.made(&most, shares, facets)).flatten() {
            if !all.contains(&one) {
                all.push(one);
            }
        }
        all.into_iter()
    }

    /// All lobes that have a share.
    fn made(&self, at: &Parameters, shares: Shares, facets: Facets) -> [Option<(f32, Lobe)>; 6] {
        if self.unlit {
            return [None; 6];
        }
        let Self { two_sided, ior, solid, .. } = *self;
        let Shares { metal, glass, body, leaves: [near, far] } = shares;
        let above = self.above(at);
        let [of_coat, of_sheen] = self.topmost(at);
        let specular = self.specular_of(at);
        let clear = Clear { f0: specular.f0.max_element(), f90: specular.f90, alpha: alpha(at.roughness) };
        let mirrors = clear.f0 > 0.0 || clear.f90 > 0.0;
        let below = if mirrors { Some(above.unwrap_or(Layers::NONE).with_clear(clear)) } else { above };
        // Metal and what a clear body mirrors have the same facets: reflectances add up.
        let (f0, f90) = (
            (metal * at.base + body * specular.f0).min(Vec3::ONE),
            Vec3::splat((metal + body * specular.f90).min(1.0)),
        );
        let film = (at.film > 0.0).then_some(Film {
            ior: self.film_ior,
            thickness: at.film_thickness,
            factor: at.film,
        });
        let glossy = Glossy::new(f0, f90, self.alphas(at), at.tangent, two_sided);
        let mirror = match facets {
            Facets::Mirror => Lobe::Mirror(Mirror::metal(at.base, two_sided)),
            Facets::Smooth | Facets::Rough => Lobe::Glossy(Glossy { film, under: above, ..glossy }),
        };
        // Glass has no layer above it in its lobe: it gets what one lets through on the average.
        let through = above.map_or(1.0, |above| above.average());
        let diffuse = Lobe::Diffuse(Diffuse { albedo: at.base, two_sided, under: below });
        let translucent = Lobe::Translucent(Translucent { colour: at.translucent_colour, under: below });
        let some = |holds: bool, one: (f32, Lobe)| (holds && one.0 > 0.0).then_some(one);
        [
            of_coat,
            of_sheen,
            some(metal > 0.0 || (body > 0.0 && mirrors), (1.0, mirror)),
            some(true, (glass * through, self.glass(at, ior, solid, facets != Facets::Rough))),
            some(true, (body * near, diffuse)),
            some(at.translucent_colour != Vec3::ZERO, (body * far, translucent)),
        ]
    }

    /// What light goes through.
    fn glass(&self, at: &Parameters, ior: f32, solid: bool, smooth: bool) -> Lobe {
        let (tint, alpha) = (at.base, alpha(at.roughness));
        match (solid, smooth) {
            (true, true) => Lobe::Dielectric(Dielectric { ior, tint }),
            (true, false) => Lobe::RoughDielectric(RoughDielectric { ior, alpha, tint }),
            (false, true) => Lobe::ThinDielectric(ThinDielectric { ior, tint }),
            (false, false) => Lobe::RoughThin(RoughThin { ior, alpha, tint }),
        }
    }

    /// Coat and fibres, as far as there are any.
    fn topmost(&self, at: &Parameters) -> [Option<(f32, Lobe)>; 2] {
        let two_sided = self.two_sided;
        let (f0, f90) = (Vec3::splat(COAT * at.coat), Vec3::splat(at.coat));
        let facets = [alpha(at.coat_roughness); 2];
        let coat = Lobe::Glossy(Glossy::new(f0, f90, facets, Vec3::X, two_sided));
        // The coat is the upper of the two.
        let passed = if at.coat > 0.0 { 1.0 - coat_of(at).average() } else { 1.0 };
        let fibres = Sheen { colour: passed * at.sheen, alpha: alpha(at.sheen_roughness), two_sided };
        [
            (at.coat > 0.0).then_some((1.0, coat)),
            (at.sheen != Vec3::ZERO).then_some((1.0, Lobe::Sheen(fibres))),
        ]
    }

    /// What lies above metal and body. None: nothing.
    fn above(&self, at: &Parameters) -> Option<Layers> {
        if at.coat <= 0.0 && at.sheen == Vec3::ZERO {
            return None;
        }
        let mut layers = Layers::NONE;
        if at.coat > 0.0 {
            layers = layers.with_coat(coat_of(at));
        }
        if at.sheen != Vec3::ZERO {
            let (weight, alpha) = (at.sheen.max_element(), alpha(at.sheen_roughness));
            layers = layers.with_sheen(Velvet { weight, alpha });
        }
        Some(layers)
    }

    /// What a body mirrors: KHR_materials_ior and KHR_materials_specular.
    fn specular_of(&self, at: &Parameters) -> Specular {
        let normal = ((self.ior - 1.0) / (self.ior + 1.0)).powi(2);
        // Without a difference of indices there is nothing that could mirror.
        let f90 = if normal > 0.0 { at.specular } else { 0.0 };
        Specular { f0: at.specular * (normal * at.specular_colour).min(Vec3::ONE), f90 }
    }

    /// GGX roughness along the grain and across: KHR_materials_anisotropy.
    fn alphas(&self, at: &Parameters) -> [f32; 2] {
        let across = alpha(at.roughness);
        [across + (1.0 - across) * at.anisotropy * at.anisotropy, across]
    }

    /// What it radiates at a point, of both halves.
    pub fn radiance(&self, inputs: &Inputs) -> Light {
        let colour = match self.unlit {
            true => {
                let vertex = if self.vertex_colours.is_some() { inputs.colour.xyz() } else { Vec3::ONE };
                self.base.factor * self.base.texel(|texture| texture.of(inputs)).xyz() * vertex
            }
            false => self.emissive.factor * self.emissive.texel(|texture| texture.of(inputs)).xyz(),
        };
        // As in Material::covered_at: whoever looks from afar must meet the same holes.
        self.halves(self.covered(&Inputs { widths: [0.0; 2], ..*inputs }) * colour)
    }

    /// The mean of the base colour over its images and vertices.
    pub fn mean_base(&self) -> Vec3 {
        let mean = self.vertex_colours.map_or(Vec3::ONE, |colours| colours.mean);
        self.of(|texture| texture.image.mean(), mean.extend(1.0)).base
    }

    /// The mean of what it radiates over its images and vertices.
    pub fn mean_radiance(&self) -> Light {
        let colour = match self.unlit {
            true => self.mean_base(),
            false => self.emissive.factor * self.emissive.texel(|texture| texture.image.mean()).xyz(),
        };
        self.halves(self.mean_covered() * colour)
    }

    fn halves(&self, colour: Vec3) -> Light {
        let [invisible, visible] = self.emission;
        Light::new(invisible * colour, visible * colour)
    }

    /// True where what it radiates is not the same everywhere.
    pub fn shines_unevenly(&self) -> bool {
        let differs = |of: &Factor<Vec3>| {
            let image = of.texture.as_ref().map(|texture| &texture.image);
            image.is_some_and(|image| image.least().xyz() != image.most().xyz())
        };
        let varies = match self.unlit {
            true => differs(&self.base) || self.vertex_colours.is_some(),
            false => differs(&self.emissive),
        };
        let colour = if self.unlit { self.base.factor } else { self.emissive.factor };
        (varies || self.has_holes()) && colour != Vec3::ZERO && self.emission.iter().any(|half| *half > 0.0)
    }

    /// What no point of it exceeds, both halves and all channels together.
    pub(super) fn most_radiance(&self) -> f32 {
        let colour = match self.unlit {
            true => self.extremes()[1].base,
            false => self.emissive.factor * self.emissive.texel(|texture| texture.image.most()).xyz(),
        };
        self.halves(colour).total()
    }

    /// Textures that what it radiates depends on.
    pub(super) fn shining_textures(&self) -> impl Iterator<Item = &Texture> {
        let base = self.base.texture.iter().filter(|_| self.unlit || self.has_holes());
        base.chain(self.emissive.texture.iter().filter(|_| !self.unlit))
    }

    /// True where nothing is there of a place whose base colour and vertices have no more alpha than this.
    pub(super) fn is_hole(&self, alpha: f32) -> bool {
        self.covers(self.alpha * alpha) == 0.0
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
