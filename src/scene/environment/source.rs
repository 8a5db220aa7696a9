//! What a scene is put into, as it is written down.

use super::{Limits, Panorama, Sky, Sun, studio};
use crate::error::{Error, Result};
use crate::scene::gltf::locate;
use crate::scene::names::clean;
use crate::scene::texture::to_linear;
use glam::Vec3;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Where light from infinity comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// The built-in [`studio`].
    Studio,
    /// The model of a clear [`Sky`] with its sun.
    Sky(Sky),
    /// The same from everywhere, linear RGB, W m⁻² sr⁻¹.
    Colour(Vec3),
    /// A picture.
    File(PathBuf),
}

/// Light from infinity: a picture, and a sun that is too small for it.
#[derive(Clone, Debug, PartialEq)]
pub struct AtInfinity {
    /// All but the sun.
    pub panorama: Panorama,
    /// A sky's.
    pub sun: Option<Sun>,
}

/// Endings of pictures that can be read.
const ENDINGS: [&str; 6] = ["hdr", "exr", "png", "jpg", "jpeg", "webp"];

impl Source {
    /// What can be written, for messages.
    pub const WORDS: &str = "studio, sky, sky:elevation=30,turbidity=3, a colour (white, black, #80a0ff, 0.5, or 0.2,0.3,0.4), or a \
                             picture (.hdr, .exr, .png, .jpg, .webp)";

    /// What shines. A file is looked for in `folder`, which a scene's own files do not leave; None: wherever it is named.
    pub fn load(&self, folder: Option<&Path>, limits: Limits) -> Result<AtInfinity> {
        let alone = |panorama| AtInfinity { panorama, sun: None };
        Ok(match self {
            Self::Studio => alone(studio()),
            Self::Sky(sky) => AtInfinity { panorama: sky.panorama(), sun: Some(sky.sun()) },
            Self::Colour(radiance) => alone(Panorama::constant(*radiance)),
            Self::File(path) => alone(Panorama::read(&found(path, folder)?, limits)?),
        })
    }

    /// The picture that is read, if it is one; as [`load`](Self::load) finds it.
    pub fn file(&self, folder: Option<&Path>) -> Result<Option<PathBuf>> {
        match self {
            Self::File(path) => found(path, folder).map(Some),
            _ => Ok(None),
        }
    }
}

fn found(path: &Path, folder: Option<&Path>) -> Result<PathBuf> {
    let Some(folder) = folder else { return Ok(path.into()) };
    locate(&path.to_string_lossy(), folder).map_err(|reason| Error::Image { path: path.into(), reason })
}

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let ending = Path::new(text).extension().map(|ending| ending.to_string_lossy().to_lowercase());
        if ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str())) {
            return Ok(Self::File(text.into()));
        }
        match text.split_once(':') {
            None if text == "studio" => Ok(Self::Studio),
            None if text == "sky" => Ok(Self::Sky(Sky::default())),
            Some(("sky", facts)) => {
                sky(facts).map(Self::Sky).map_err(|why| format!("`{}`: {why}", clean(text)))
            }
            _ => colour(text)
                .map(Self::Colour)
                .ok_or_else(|| format!("`{}` is no environment; write {}", clean(text), Self::WORDS)),
        }
    }
}

/// Of `elevation=30,turbidity=3,azimuth=90`, any of them once.
fn sky(facts: &str) -> std::result::Result<Sky, String> {
    let default = Sky::default();
    let names = ["elevation", "turbidity", "azimuth"];
    let mut numbers = [None; 3];
    for fact in facts.split(',') {
        let wrong =
            || format!("`{}` is none of elevation=DEGREES, turbidity=2…10, azimuth=DEGREES", clean(fact));
        let (name, number) = fact.split_once('=').ok_or_else(wrong)?;
        let which = names.iter().position(|known| *known == name.trim()).ok_or_else(wrong)?;
        let number: f32 = number.trim().parse().map_err(|_| wrong())?;
        if numbers[which].replace(number).is_some() {
            return Err(format!("{} is there twice", names[which]));
        }
    }
    let [elevation, turbidity, azimuth] = numbers;
    Sky::new(
        elevation.unwrap_or(default.elevation()),
        turbidity.unwrap_or(default.turbidity()),
        azimuth.unwrap_or(default.azimuth()),
    )
}

/// Linear, of a name, of sRGB as `#rrggbb`, or of one or three numbers.
fn colour(text: &str) -> Option<Vec3> {
    if let Some(digits) = text.strip_prefix('#') {
        let six = digits.len() == 6 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
        let whole = u32::from_str_radix(digits, 16).ok().filter(|_| six)?;
        let [_, r, g, b] = whole.to_be_bytes();
        return Some(Vec3::from_array([r, g, b].map(|byte| to_linear(f64::from(byte) / 255.0) as f32)));
    }
    match text {
        "white" => return Some(Vec3::ONE),
        "black" => return Some(Vec3::ZERO),
        _ => {}
    }
    let read = |word: &str| word.trim().parse::<f32>().ok().filter(|x| x.is_finite() && *x >= 0.0);
    let numbers: Option<Vec<f32>> = text.split(',').map(read).collect();
    match numbers?[..] {
        [grey] => Some(Vec3::splat(grey)),
        [r, g, b] => Some(Vec3::new(r, g, b)),
        _ => None,
    }
}

impl fmt::Display for Source {
    /// As it is written; colours as linear numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Studio => f.write_str("studio"),
            Self::Sky(sky) => {
                let (elevation, turbidity) = (sky.elevation(), sky.turbidity());
                write!(f, "sky:elevation={elevation},turbidity={turbidity},azimuth={}", sky.azimuth())
            }
            Self::Colour(Vec3::ONE) => f.write_str("white"),
            Self::Colour(Vec3::ZERO) => f.write_str("black"),
            Self::Colour(Vec3 { x, y, z }) => write!(f, "{x},{y},{z}"),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Source {
        text.parse().unwrap_or_else(|why| panic!("{why}"))
    }

    #[test]
    fn what_is_written_is_understood_and_given_back() {
        let colour = |r, g, b| Source::Colour(Vec3::new(r, g, b));
        for (text, source) in [
            ("studio", Source::Studio),
            ("sky", Source::Sky(Sky::default())),
            ("sky:turbidity=2.5", Source::Sky(Sky::new(45.0, 2.5, 225.0).expect("a sky"))),
            ("sky:azimuth=-30,elevation=12", Source::Sky(Sky::new(12.0, 3.0, -30.0).expect("a sky"))),
            ("white", colour(1.0, 1.0, 1.0)),
            ("black", colour(0.0, 0.0, 0.0)),
            ("0.5", colour(0.5, 0.5, 0.5)),
            ("0.2, 0.3,4e2", colour(0.2, 0.3, 400.0)),
            ("#ff0000", colour(1.0, 0.0, 0.0)),
            ("a b/Sky.HDR", Source::File("a b/Sky.HDR".into())),
            ("sky:x.exr", Source::File("sky:x.exr".into())),
            ("0.5.webp", Source::File("0.5.webp".into())),
        ] {
            assert_eq!(parse(text), source, "{text}");
            assert_eq!(parse(&source.to_string()), source, "{source}");
        }
        let Source::Colour(blue) = parse("#80a0ff") else { panic!("no colour") };
        assert!((blue - Vec3::new(0.215_861, 0.351_533, 1.0)).abs().max_element() < 1e-6, "{blue}");
    }

    #[test]
    fn what_is_not_understood_is_told_in_a_line() {
        for (text, word) in [
            ("", "studio, sky"),
            ("forest", "`forest` is no environment"),
            ("sky.blend", ".hdr, .exr"),
            ("#12345", "studio"),
            ("#+12345", "studio"),
            ("0.1,0.2", "studio"),
            ("-1", "studio"),
            ("inf", "studio"),
            ("nan", "studio"),
            ("sky:", "elevation=DEGREES"),
            ("sky:elevation=low", "elevation=low"),
            ("sky:height=3", "height=3"),
            ("sky:turbidity=3,turbidity=4", "twice"),
            ("sky:elevation=-3", "elevation -3"),
            ("sky:turbidity=40", "turbidity 40"),
        ] {
            let why = text.parse::<Source>().expect_err(text);
            assert!(why.contains(word) && !why.contains('\n'), "{text}: {why}");
        }
    }

    #[test]
    fn each_source_loads_what_it_says() {
        let load = |text: &str| parse(text).load(None, Limits::default()).expect(text);
        let grey = load("0.25");
        assert_eq!((grey.panorama.width(), grey.panorama.height(), grey.sun), (1, 1, None));
        assert_eq!(grey.panorama.at(0, 0), Vec3::splat(0.25));
        assert_eq!(load("studio").panorama, studio());
        let sky = load("sky:elevation=10");
        assert_eq!(sky.sun, Some(Sky::new(10.0, 3.0, 225.0).expect("a sky").sun()));
    }

    #[test]
    fn a_file_of_a_scene_stays_in_its_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let inside = folder.path().join("a sky.hdr");
        std::fs::write(&inside, b"#?RADIANCE\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x80\x40\x20\x82")
            .expect("written");
        let load = |name: &str| Source::File(name.into()).load(Some(folder.path()), Limits::default());
        let found = load("a%20sky.hdr").expect("a sky");
        assert_eq!(found.panorama.at(1, 0).to_array(), [2.0, 1.0, 0.5]);
        assert_eq!(Source::File(inside.clone()).load(None, Limits::default()).expect("a sky"), found);
        for outside in ["../x.hdr", "/etc/x.hdr", &inside.to_string_lossy()] {
            let why = load(outside).expect_err(outside).to_string();
            assert!(why.contains("in the folder of the scene"), "{why}");
        }
    }
}
