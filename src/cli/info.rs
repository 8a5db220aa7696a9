//! `halflight info`: what is in a scene, as it was read.

use super::out::{counted, print};
use super::plan::existence_as_json;
use super::scene_args::SceneArgs;
use crate::error::Result;
use crate::light::{Light, Matrix};
use crate::memory::words as bytes;
use crate::optics::Lobe;
use crate::plan::{Existence, Plan, Settings};
use crate::scene::names::clean;
use crate::scene::texture::{Encoding, Image};
use crate::scene::{Backs, Loaded, Luminaire, Material, Pbr, Projection, Scene};
use clap::Args;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::process::ExitCode;
use std::sync::Arc;

#[derive(Args)]
pub struct InfoArgs {
    #[command(flatten)]
    scene: SceneArgs,

    /// Print it as JSON, for programs.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &InfoArgs) -> Result<ExitCode> {
    let loaded = args.scene.load_as(true)?;
    let info = Info::of(&loaded);
    print(&if args.json { format!("{:#}\n", info.json()) } else { info.text() })?;
    Ok(ExitCode::SUCCESS)
}

/// What there is of a material.
#[derive(Clone, Copy, Default)]
struct Extent {
    triangles: usize,
    /// m².
    area: f64,
}

/// What a scene holds.
struct Info<'a> {
    scene: &'a Scene,
    /// What else its file has to choose from.
    variants: &'a [String],
    animations: &'a [String],
    /// By material.
    extents: Vec<Extent>,
    /// Kind and power of what shines, triangles of one material together, W.
    luminaires: Vec<(String, Light)>,
    existence: Existence,
}

impl<'a> Info<'a> {
    fn of(loaded: &'a Loaded) -> Self {
        let Loaded { scene, variants, animations, .. } = loaded;
        let mut extents = vec![Extent::default(); scene.materials.len()];
        for triangle in 0..scene.mesh.triangles.len() as u32 {
            let extent = &mut extents[scene.surface_of(triangle).material as usize];
            extent.triangles += 1;
            extent.area += f64::from(scene.mesh.area(triangle));
        }
        let existence = Plan::new(scene.clone(), Settings::for_film(64, 64)).existence;
        Self { scene, variants, animations, extents, luminaires: luminaires(scene), existence }
    }

    /// The corners of the box around all triangles in the world, m.
    fn bounds(&self) -> [DVec3; 2] {
        let (min, max) = self.scene.mesh.bounds();
        [min, max].map(|corner| corner.as_dvec3() + self.scene.origin)
    }

    fn text(&self) -> String {
        let scene = self.scene;
        let [min, max] = self.bounds();
        let smooth = scene.surfaces.iter().filter(|surface| surface.smooth).count();
        let mut text = format!(
            "{}: {} in {} ({smooth} smooth), {}; from {} to {} m\n",
            scene.name,
            counted(scene.mesh.triangles.len(), "triangle"),
            counted(scene.surfaces.len(), "surface"),
            counted(scene.materials.len(), "material"),
            vector(min),
            vector(max),
        );
        let mut line = |line: std::fmt::Arguments<'_>| {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{line}");
        };
        line(format_args!("camera: {}", self.camera()));
        for (material, extent) in scene.materials.iter().zip(&self.extents) {
            line(format_args!(
                "material {}: {}; {}, {:.4} m²",
                clean(&material.name),
                matter(material),
                counted(extent.triangles, "triangle"),
                extent.area
            ));
        }
        for image in self.images() {
            line(format_args!("texture {}", image.words()));
        }
        for (what, power) in &self.luminaires {
            let [invisible, visible] = [power.invisible, power.visible].map(sum);
            line(format_args!("light: {what}, {invisible:.4} W invisible, {visible:.4} W visible"));
        }
        if self.luminaires.is_empty() {
            line(format_args!("light: none"));
        }
        line(format_args!("multiplication factor: {}", self.existence.describe()));
        for (kind, names) in [("variants", self.variants), ("animations", self.animations)] {
            if !names.is_empty() {
                let names: Vec<String> = names.iter().map(|name| clean(name)).collect();
                line(format_args!("{kind}: {}", names.join(", ")));
            }
        }
        scene.notes.iter().for_each(|note| line(format_args!("note: {note}")));
        text
    }

    fn camera(&self) -> String {
        let camera = &self.scene.camera;
        let projection = match camera.projection {
            Projection::Perspective { yfov } => format!("perspective, {:.2}° high", yfov.to_degrees()),
            Projection::Orthographic { half_height } => {
                format!("orthographic, {} m high", number(f64::from(2.0 * half_height)))
            }
        };
        let place = vector(camera.position.as_dvec3() + self.scene.origin);
        let aspect = camera.aspect.map_or(String::new(), |aspect| format!(", picture {aspect:.4}:1"));
        let lens = camera.lens.map_or(String::new(), |lens| {
            format!(", lens of radius {} m focused at {} m", lens.radius, number(f64::from(lens.focus)))
        });
        format!(
            "{projection}{lens}, at {place} m, looking along {}{aspect}",
            vector(camera.forward.as_dvec3())
        )
    }

    /// The images of textures, and what shows each.
    fn images(&self) -> Vec<Shown<'a>> {
        let shows = |image: &'a Arc<Image>| {
            let mut users = Vec::new();
            for material in &self.scene.materials {
                let named = material.pattern.iter().flat_map(|pattern| pattern.named_textures());
                let of_it = named.filter(|(_, texture)| Arc::ptr_eq(&texture.image, image));
                users.extend(of_it.map(|(what, _)| format!("{what} of {}", clean(&material.name))));
            }
            users.dedup();
            Shown { image, users }
        };
        self.scene.images().into_iter().map(shows).collect()
    }

    fn json(&self) -> Value {
        let scene = self.scene;
        let array = |v: DVec3| v.to_array();
        let [min, max] = self.bounds().map(array);
        let material = |(material, extent): (&Material, &Extent)| {
            let bsdf = material.bsdf();
            json!({
                "name": material.name, "illumination": material.resolved(),
                "varies_by": material.pattern.as_deref().map(varies_by).unwrap_or_default(),
                "lobes": material.lobes.iter().map(|(share, lobe)| json!({ "share": share, "lobe": lobe_in_words(lobe) })).collect::<Vec<_>>(),
                "terms": bsdf.terms.iter().map(|term| json!({ "opaque": term.coefficient.rows(), "lobe": lobe_in_words(&term.lobe), "colours_later": term.turn.colours() })).collect::<Vec<_>>(),
                "straight": bsdf.straight.rows(),
                "emission": material.emission.map(|emission| json!({
                    "invisible": emission.radiance.invisible.to_array(),
                    "visible": emission.radiance.visible.to_array(), "two_sided": emission.two_sided,
                })),
                "triangles": extent.triangles, "area": extent.area,
            })
        };
        let light = |(what, power): &(String, Light)| json!({ "what": what, "invisible_watts": power.invisible.to_array(), "visible_watts": power.visible.to_array() });
        json!({
            "name": scene.name,
            "hash": format!("{:016x}", scene.hash()),
            "triangles": scene.mesh.triangles.len(),
            "surfaces": scene.surfaces.len(),
            "bounds": [min, max],
            "camera": {
                "position": array(scene.camera.position.as_dvec3() + scene.origin),
                "forward": scene.camera.forward.to_array(), "up": scene.camera.up.to_array(),
                "aspect": scene.camera.aspect,
                "lens": scene.camera.lens.map(|lens| json!({ "radius": lens.radius, "focus": lens.focus })), "words": self.camera(),
            },
            "materials": scene.materials.iter().zip(&self.extents).map(material).collect::<Vec<_>>(),
            "textures": self.images().iter().map(Shown::json).collect::<Vec<_>>(),
            "luminaires": self.luminaires.iter().map(light).collect::<Vec<_>>(),
            "multiplication_factor": existence_as_json(&self.existence),
            "variants": self.variants,
            "animations": self.animations,
            "notes": scene.notes,
        })
    }
}

/// An image and what shows it.
struct Shown<'a> {
    image: &'a Image,
    users: Vec<String>,
}

/// More users of an image than these are counted.
const MOST_USERS: usize = 4;

impl Shown<'_> {
    fn words(&self) -> String {
        let [width, height] = self.image.size();
        let kind = match self.image.encoding() {
            Encoding::Colour => "colours",
            Encoding::Data => "numbers",
        };
        let mut users = self.users.iter().take(MOST_USERS).cloned().collect::<Vec<_>>().join(", ");
        if self.users.len() > MOST_USERS {
            users = format!("{users} and {} more", self.users.len() - MOST_USERS);
        }
        let (channels, bytes) = (counted(self.image.channels(), "channel"), bytes(self.image.bytes() as f64));
        format!("{}: {width} × {height}, {kind} of {channels}, {bytes}; {users}", clean(self.image.name()))
    }

    fn json(&self) -> Value {
        json!({
            "name": self.image.name(), "size": self.image.size(), "channels": self.image.channels(),
            "colours": self.image.encoding() == Encoding::Colour, "bytes": self.image.bytes(), "shown_as": self.users,
            "mean": self.image.mean().to_array(),
        })
    }
}

/// What makes a material look different from place to place.
fn varies_by(pattern: &Pbr) -> Vec<&'static str> {
    let colours = pattern.vertex_colours.is_some().then_some("vertex colours");
    pattern.named_textures().map(|(what, _)| what).chain(colours).collect()
}

/// What shines and its power, triangles of one material together.
fn luminaires(scene: &Scene) -> Vec<(String, Light)> {
    let (_, radius) = scene.bounding_sphere();
    let mut of_material: BTreeMap<u32, (usize, Light)> = BTreeMap::new();
    let mut punctual = Vec::new();
    let mut before = None;
    for luminaire in &scene.luminaires {
        let goes_on = luminaire.goes_on(before.replace(luminaire));
        let power = luminaire.power(radius);
        let kind = match *luminaire {
            Luminaire::Triangle { triangle, .. } => {
                let all = of_material.entry(scene.surface_of(triangle).material).or_insert((0, Light::ZERO));
                *all = (all.0 + usize::from(!goes_on), all.1 + power);
                continue;
            }
            Luminaire::Point { .. } => "point light",
            Luminaire::Spot { .. } => "spot",
            Luminaire::Warn { .. } => "OpenGL's spot",
            Luminaire::Profile { .. } => "measured lamp",
            Luminaire::Directional { .. } => "parallel light (power is that on the scene)",
            Luminaire::Sun { .. } => "sun (power is that on the scene)",
            Luminaire::Environment { .. } => "environment (power is that on the scene)",
        };
        punctual.push((kind.to_owned(), power));
    }
    let named = |(material, (count, power)): (u32, (usize, Light))| {
        (
            format!("{} of {}", counted(count, "triangle"), clean(&scene.materials[material as usize].name)),
            power,
        )
    };
    of_material.into_iter().map(named).chain(punctual).collect()
}

/// Lobes, illumination and matrices of a material.
fn matter(material: &Material) -> String {
    let lobe = |(share, lobe): &(f32, Lobe)| match *share {
        1.0 => lobe_in_words(lobe),
        share => format!("{share} × {}", lobe_in_words(lobe)),
    };
    let lobes: Vec<String> = material.lobes.iter().map(lobe).collect();
    let lobes = if lobes.is_empty() { "reflects nothing".into() } else { lobes.join(" + ") };
    let lobes = match material.pattern.as_deref() {
        None => lobes,
        Some(pattern) => format!("up to {lobes}, varies by {}", varies_by(pattern).join(", ")),
    };
    let bsdf = material.bsdf();
    let opaque =
        bsdf.terms.first().map_or(String::new(), |term| format!(", opaque {}", matrix(term.coefficient)));
    let glows = material.fluorescence.map_or(String::new(), |dye| format!(", {}", dye.describe()));
    let shines = if material.emission.is_some() { ", shines" } else { "" };
    let backs = if material.backs == Backs::Unseen { ", backs unseen" } else { "" };
    format!(
        "{lobes}; {}{opaque}, straight {}{glows}{shines}{backs}",
        material.resolved(),
        matrix(bsdf.straight)
    )
}

fn lobe_in_words(lobe: &Lobe) -> String {
    let sides = |two_sided: bool| if two_sided { "two-sided" } else { "one-sided" };
    let colour = |v: Vec3| v.to_array().map(|x| number(f64::from(x))).join(" ");
    match lobe {
        Lobe::Diffuse(lobe) => format!("diffuse {}, {}", colour(lobe.albedo), sides(lobe.two_sided)),
        Lobe::Mirror(lobe) => {
            let rim = if lobe.grazing == lobe.tint {
                String::new()
            } else {
                format!(" ({} at grazing angles)", colour(lobe.grazing))
            };
            format!("mirror {}{rim}, {}", colour(lobe.tint), sides(lobe.two_sided))
        }
        Lobe::Dielectric(lobe) => format!("solid glass, index {}, tint {}", lobe.ior, colour(lobe.tint)),
        Lobe::ThinDielectric(lobe) => format!("thin glass, index {}, tint {}", lobe.ior, colour(lobe.tint)),
        Lobe::RoughDielectric(lobe) => {
            let (rough, tint) = (number(f64::from(lobe.alpha.sqrt())), colour(lobe.tint));
            format!("solid glass, index {}, roughness {rough}, tint {tint}", lobe.ior)
        }
        Lobe::RoughThin(lobe) => {
            let (rough, tint) = (number(f64::from(lobe.alpha.sqrt())), colour(lobe.tint));
            format!("thin glass, index {}, roughness {rough}, tint {tint}", lobe.ior)
        }
        Lobe::Sheen(lobe) => {
            let rough = number(f64::from(lobe.alpha.sqrt()));
            format!("sheen {}, roughness {rough}, {}", colour(lobe.colour), sides(lobe.two_sided))
        }
        Lobe::Translucent(lobe) => format!("translucent {}", colour(lobe.colour)),
        Lobe::Glossy(lobe) => {
            let [along, across] = lobe.alpha.map(|alpha| number(f64::from(alpha.sqrt())));
            let rough = if along == across { along } else { format!("{along} by {across}") };
            format!("glossy {}, roughness {rough}, {}", colour(lobe.f0), sides(lobe.two_sided))
        }
    }
}

fn matrix(matrix: Matrix) -> String {
    let [[a, b], [c, d]] = matrix.rows();
    format!("[{a} {b}; {c} {d}]")
}

fn vector(v: DVec3) -> String {
    format!("({})", v.to_array().map(number).join(", "))
}

/// Four digits behind the point at the most.
fn number(x: f64) -> String {
    let rounded = (1e4 * x).round() / 1e4;
    // Minus nothing is nothing.
    format!("{}", rounded + 0.0)
}

fn sum(half: Vec3) -> f64 {
    half.as_dvec3().element_sum()
}
