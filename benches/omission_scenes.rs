//! Scenes on which leaving something out matters, one for each omission, and one that needs everything.

use glam::Vec3;
use halflight::light::{Light, Matrix};
use halflight::optics::{Diffuse, Lobe, Mirror};
use halflight::plan::Omittable;
use halflight::scene::texture::{Encoding, Image, Texture};
use halflight::scene::{Factor, Illumination, Luminaire, Matter, Pbr, Scene};

/// What a row leaves out.
#[derive(Clone, Copy)]
pub enum What {
    One(Omittable),
    Everything,
}

impl What {
    pub fn name(self) -> &'static str {
        match self {
            Self::One(what) => what.name(),
            Self::Everything => "everything",
        }
    }
}

/// One omission on one scene.
pub struct Row {
    pub what: What,
    pub scene: &'static str,
    pub make: fn() -> Scene,
    pub why: &'static str,
}

/// A scene of which nothing can be left out but what is black or needs no measurement: planning must cost nothing there.
fn needs_everything() -> Scene {
    builtin("caustic-box", "0.3,0.1,0.5,0.2/0.2,0.1,0.1,0.2", &[])
}

fn builtin(name: &str, illumination: &str, set: &[(&str, &str)]) -> Scene {
    let mut scene = Scene::load(format!("builtin:{name}")).expect("built in");
    let read = |text: &str| text.parse::<Illumination>().expect("an illumination");
    let set: Vec<_> = set.iter().map(|(name, text)| ((*name).to_owned(), read(text))).collect();
    scene.illuminate(Some(read(illumination)), &set).expect("its names");
    scene
}

/// The caustic box among local things: of its glass and mirror alone light is reflected on.
fn glass_among_local() -> Scene {
    builtin("caustic-box", "local", &[("Glass", "global"), ("Mirror", "global")])
}

/// Balls that cast no shadow in a box that does.
fn shadowless_balls() -> Scene {
    builtin("cornell-spheres", "one-bounce", &[("Ball", "local")])
}

/// The same box, its balls not there at all.
fn balls_of_nothing() -> Scene {
    builtin("cornell-spheres", "global", &[("Ball", "0,0,0,0/1,0,0,1")])
}

/// A mirror that no triangle has.
fn unused_mirror() -> Scene {
    let mut scene = builtin("cornell-spheres", "global", &[]);
    let lobe = Lobe::Mirror(Mirror::plain(Vec3::ONE, true));
    scene.materials.push(halflight::scene::Material::new("Unused", lobe));
    let matter = Matter { opaque: Matrix::new([[0.9, 0.1], [0.9, 0.1]]), straight: Matrix::IDENTITY };
    scene.illuminate(None, &[("Unused".into(), Illumination::Own(matter))]).expect("its name");
    scene
}

/// A second lamp, seen and a hundred times as strong, that lights nothing.
fn lamp_that_is_only_seen() -> Scene {
    let mut scene = builtin("cornell-spheres", "global", &[]);
    let position = Vec3::new(0.0, -0.5, 0.5);
    for _ in 0..20 {
        let intensity = Light::new(Vec3::ZERO, Vec3::splat(20.0));
        scene.luminaires.push(Luminaire::Point { position, intensity });
    }
    scene
}

/// The balls of the box have a black coat: a lobe that reflects nothing.
fn black_coats() -> Scene {
    let mut scene = builtin("cornell-spheres", "global", &[]);
    for material in &mut scene.materials {
        material
            .lobes
            .push((1.0, Lobe::Diffuse(Diffuse { albedo: Vec3::ZERO, two_sided: true, under: None })));
    }
    scene.illuminate(None, &[]).expect("no names");
    scene
}

/// Walls whose roughness is in an image of 2048 × 2048 texels.
fn rough_by_texture() -> Scene {
    let mut scene = builtin("cornell-spheres", "global", &[]);
    let texels = (0..3 << 22).map(|i: u32| (i % 251) as u8).collect();
    let image = Image::new("roughness", [2048; 2], texels, Encoding::Data).expect("as many as it says");
    let texture = Texture::new(std::sync::Arc::new(image));
    for material in &mut scene.materials {
        let [(_, Lobe::Diffuse(lobe))] = material.lobes[..] else { continue };
        let pbr = Pbr {
            base: Factor::new(lobe.albedo),
            metallic: 0.0,
            metallic_roughness: Some(texture.clone()),
            two_sided: lobe.two_sided,
            ..Pbr::default()
        };
        material.pattern = Some(std::sync::Arc::new(pbr));
    }
    scene.illuminate(None, &[]).expect("no names");
    scene
}

fn flat_spheres() -> Scene {
    let mut scene = builtin("two-spheres", "global", &[]);
    scene.surfaces.iter_mut().for_each(|surface| surface.smooth = false);
    scene
}

pub fn rows() -> Vec<Row> {
    use Omittable::*;
    let row = |what, scene, make, why| Row { what, scene, make, why };
    let one = |what, scene, make, why| row(What::One(what), scene, make, why);
    vec![
        row(
            What::Everything,
            "cornell-spheres, local",
            || builtin("cornell-spheres", "local", &[]),
            "all of the reasons below",
        ),
        row(
            What::Everything,
            "cornell-spheres, one-bounce",
            || builtin("cornell-spheres", "one-bounce", &[]),
            "the same",
        ),
        row(
            What::Everything,
            "cornell-spheres, global",
            || builtin("cornell-spheres", "global", &[]),
            "the same",
        ),
        row(
            What::Everything,
            "caustic-box, matrices that use all",
            needs_everything,
            "hardly anything can be left out, and looking for it costs nothing",
        ),
        one(
            LightSamples,
            "cornell-spheres, local",
            || builtin("cornell-spheres", "local", &[]),
            "the irradiance of an unhidden triangle has a closed form",
        ),
        one(
            LightSamples,
            "cornell-spheres, one-bounce",
            || builtin("cornell-spheres", "one-bounce", &[]),
            "only what hides the lamp is left to connections",
        ),
        one(
            Photons,
            "cornell-spheres, local",
            || builtin("cornell-spheres", "local", &[]),
            "nothing reflects light into a half that is read later",
        ),
        one(
            Photons,
            "cornell-spheres, one-bounce",
            || builtin("cornell-spheres", "one-bounce", &[]),
            "the same",
        ),
        one(
            IndirectPhotons,
            "caustic-box, local but for glass and mirror",
            glass_among_local,
            "only mirrors and glass send on light that is read",
        ),
        one(
            CausticPhotons,
            "cornell-spheres, global",
            || builtin("cornell-spheres", "global", &[]),
            "there is no mirror and no glass",
        ),
        one(
            VisibleHalf,
            "caustic-box, global",
            || builtin("caustic-box", "global", &[]),
            "every second column is zero",
        ),
        one(
            Deposits,
            "caustic-box, global",
            || builtin("caustic-box", "global", &[]),
            "density estimation reads nothing on mirrors and glass",
        ),
        one(
            Visibility,
            "cornell-spheres, local",
            || builtin("cornell-spheres", "local", &[]),
            "all surfaces let through what is read behind them",
        ),
        one(
            Casters,
            "cornell-spheres, one-bounce but for local balls",
            shadowless_balls,
            "local things cast no shadow",
        ),
        one(
            AllHits,
            "two-spheres, local",
            || builtin("two-spheres", "local", &[]),
            "nothing lets through the visible half",
        ),
        one(
            AllHits,
            "cornell-spheres, global",
            || builtin("cornell-spheres", "global", &[]),
            "nothing lets light through",
        ),
        one(Lobes, "cornell-spheres, black coats", black_coats, "they reflect nothing"),
        one(
            Luminaires,
            "cornell-spheres and lamps that are only seen",
            lamp_that_is_only_seen,
            "nothing reads the visible half of a lamp's light",
        ),
        one(Matter, "cornell-spheres, balls of nothing", balls_of_nothing, "light does not notice them"),
        one(Materials, "cornell-spheres and a mirror without triangles", unused_mirror, "no triangle has it"),
        one(Normals, "two-spheres, flat", flat_spheres, "they are never interpolated"),
        one(
            Textures,
            "cornell-spheres, rough by a texture",
            rough_by_texture,
            "what is neither metal nor glass looks the same however rough it is: 28 MB",
        ),
        one(
            Existence,
            "cornell-spheres, global",
            || builtin("cornell-spheres", "global", &[]),
            "k is at most the largest albedo",
        ),
    ]
}
