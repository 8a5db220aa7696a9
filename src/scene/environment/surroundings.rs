//! What is asked for around a scene, by its file or by who renders it.

use super::{AtInfinity, Background, Environment, Limits, SUN_RADIUS, Source, Sun, upright};
use crate::error::{Error, Result};
use crate::light::Light;
use crate::scene::names::{clean, one_line};
use crate::scene::{Luminaire, Scene};
use glam::{Mat3, Vec3};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// What is around a scene, as far as it is said.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surroundings {
    /// What shines. None: whatever else speaks.
    pub source: Option<Around>,
    /// Degrees counter-clockwise as seen from above. None: 0.
    pub rotation: Option<f32>,
    /// What its radiance is multiplied by. None: 1.
    pub strength: Option<f32>,
    /// What is seen of it. None: the same that lights.
    pub background: Option<Background>,
}

/// What shines around a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Around {
    /// Nothing, whatever the file says.
    Nothing,
    /// Light from infinity.
    Source(Source),
}

/// What is ready to shine around a scene.
pub(crate) struct Shining {
    /// For messages.
    pub name: String,
    pub light: AtInfinity,
    /// From its own space to the scene's: a rotation. None: they are one.
    pub turn: Option<Mat3>,
    /// What its radiance is multiplied by.
    pub strength: f32,
}

impl FromStr for Around {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        if text == "none" { Ok(Self::Nothing) } else { text.parse().map(Self::Source) }
    }
}

impl FromStr for Background {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "seen" | "true" => Ok(Self::Same),
            "hidden" | "false" => Ok(Self::Black),
            _ => match text.parse() {
                Ok(Source::Colour(colour)) => Ok(Self::Colour(colour)),
                _ => {
                    Err(format!("`{text}` is no background; write seen, hidden, or a colour such as #404040"))
                }
            },
        }
    }
}

impl Surroundings {
    /// What is said here, and by `other` where nothing is. Of a sky that gives way to another, no turn and no strength is left.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let other = match &self.source {
            None => other,
            Some(Around::Nothing) => Self::default(),
            Some(Around::Source(_)) => Self { background: other.background, ..Self::default() },
        };
        Self {
            source: self.source.or(other.source),
            rotation: self.rotation.or(other.rotation),
            strength: self.strength.or(other.strength),
            background: self.background.or(other.background),
        }
    }

    /// True where something shines.
    pub fn shines(&self) -> bool {
        matches!(self.source, Some(Around::Source(_)))
    }

    /// The picture that is read for it, found as [`put_into`](Scene::put_into) finds it.
    pub fn file(&self, folder: Option<&Path>) -> Result<Option<PathBuf>> {
        match &self.source {
            Some(Around::Source(source)) => source.file(folder),
            _ => Ok(None),
        }
    }
}

impl Scene {
    /// Puts it into surroundings. A file is looked for in `folder`, which a scene's own files do not leave; None: wherever it is
    /// named.
    ///
    /// # Errors
    /// A strength that is negative or not finite; a rotation, strength or background of nothing; a picture that cannot be read.
    pub fn put_into(&mut self, around: &Surroundings, folder: Option<&Path>) -> Result<()> {
        let Surroundings { source, rotation, strength, background } = around;
        let Some(Around::Source(source)) = source else {
            let of_nothing = rotation.is_some() || strength.is_some() || background.is_some();
            let why = "nothing is around it that could be turned, dimmed or hidden; add an environment";
            return if of_nothing { Err(Error::scene(&self.name, why)) } else { Ok(()) };
        };
        let of_scene = |e: Error| match folder {
            Some(_) => Error::scene(&self.name, one_line(&format!("its environment: {e}"))),
            None => e,
        };
        let light = source.load(folder, Limits::default()).map_err(of_scene)?;
        let name = clean(&source.to_string());
        self.surround_by(Shining { name, light, turn: None, strength: 1.0 }, around)
    }

    /// Puts it into what shines, turned, scaled and hidden as `around` says beside its source.
    ///
    /// # Errors
    /// A strength that is negative or not finite; more power than single precision holds.
    pub(in crate::scene) fn surround_by(&mut self, shining: Shining, around: &Surroundings) -> Result<()> {
        let Shining { name, light: AtInfinity { panorama, sun }, turn, strength } = shining;
        let rotation = around.rotation.unwrap_or(0.0);
        let strength = strength * around.strength.unwrap_or(1.0);
        if !(strength >= 0.0 && strength.is_finite() && rotation.is_finite()) {
            let why = format!(
                "its environment has strength {strength}, rotation {rotation}; a strength is 0 or more"
            );
            return Err(Error::scene(&self.name, why));
        }
        let upright = upright(rotation);
        let turn = turn.map_or(upright, |own| upright * own);
        let background = around.background.unwrap_or_default();
        if let Some(sun) = sun.filter(|_| strength > 0.0) {
            let sun = luminaire(sun, turn, strength, background);
            self.luminaires.push(sun);
            self.skies.push(sun);
        }
        self.surround(Environment::new(&name, panorama, strength, turn, background));
        let (_, radius) = self.bounding_sphere();
        let power = self.skies.iter().map(|sky| sky.power(radius).total()).sum::<f32>();
        if !power.is_finite() {
            let why =
                "its environment sends more power than single precision holds (3.4e38 W); lower its strength";
            return Err(Error::scene(&self.name, why));
        }
        Ok(())
    }
}

fn luminaire(sun: Sun, turn: Mat3, strength: f32, background: Background) -> Luminaire {
    let lights = strength * sun.radiance;
    let visible = if background == Background::Same { lights } else { Vec3::ZERO };
    Luminaire::Sun {
        direction: -(turn * sun.direction).normalize(),
        radiance: Light::new(lights, visible),
        versine: 2.0 * (0.5 * SUN_RADIUS).sin().powi(2),
    }
}
