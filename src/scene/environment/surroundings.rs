//! What is asked for around a scene, by its file or by who renders it.

use super::{AtInfinity, Background, Environment, Limits, SUN_RADIUS, Source, Sun, upright};
use crate::error::{Error, Result};
use crate::light::Light;
use crate::scene::{Luminaire, Scene};
use glam::{Mat3, Vec3};
use std::path::Path;
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
    /// What is said here, and by `other` where nothing is.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
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

    /// The picture that is read for it.
    pub fn file(&self) -> Option<&Path> {
        match &self.source {
            Some(Around::Source(source)) => source.file(),
            _ => None,
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
        let (rotation, strength) = (rotation.unwrap_or(0.0), strength.unwrap_or(1.0));
        if !(strength >= 0.0 && strength.is_finite() && rotation.is_finite()) {
            let why = format!(
                "its environment has strength {strength}, rotation {rotation}; a strength is 0 or more"
            );
            return Err(Error::scene(&self.name, why));
        }
        let AtInfinity { panorama, sun } = source.load(folder, Limits::default())?;
        let (turn, background) = (upright(rotation), background.unwrap_or_default());
        if let Some(sun) = sun.filter(|_| strength > 0.0) {
            let sun = luminaire(sun, turn, strength, background);
            self.luminaires.push(sun);
            self.skies.push(sun);
        }
        self.surround(Environment::new(&source.to_string(), panorama, strength, turn, background));
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
