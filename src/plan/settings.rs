//! What the user asked for, resolved.

use super::omission::Omittable;
use super::photons::DEFAULT_PATHS;
use crate::error::{Error, Result};
use crate::machine::MemoryLimit;
use std::ops::RangeInclusive;

/// What the user asked for, resolved.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Film width in pixels.
    pub width: u32,
    /// Film height in pixels.
    pub height: u32,
    /// Photon paths emitted per pass; None: the plan chooses.
    pub paths: Option<u32>,
    /// Everything random follows from it.
    pub seed: u64,
    /// Who transports light.
    pub method: Method,
    /// Camera samples per pixel and pass of the path tracers, stratified against each other; photons take one.
    pub samples: u32,
    /// Who serves direct light when photons transport the rest.
    pub direct: Direct,
    /// Also render the invisible half of every pixel.
    pub invisible: bool,
    /// Truncates the series: no light that was reflected more often than this, the reflection towards the camera and
    /// delta lobes included. None: the whole series.
    pub max_reflections: Option<u32>,
    /// Photons start, and connections lead, in proportion to the power of luminaires, whatever comes of it: nothing is learned of
    /// what is of use.
    pub even_starts: bool,
    /// Pixels have one camera path a pass, also at edges.
    pub one_path: bool,
    /// First gather radius of caustics where they are sharpest, in pixel footprints.
    pub caustic_radius: f32,
    /// First gather radius of inter-reflection (and of `--direct photons`) in pixel footprints.
    pub indirect_radius: f32,
    /// Photons from which [`Method::Nearest`] reads light at a point, one of [`NEAREST`].
    pub nearest: u32,
    /// They weigh by a cone that reaches zero at so many times the distance of the farthest: 1 or more; infinity: all weigh the same.
    pub cone: f32,
    /// Leave nothing out.
    pub keep_everything: bool,
    /// What is not to be left out, needed or not.
    pub keep: Vec<Omittable>,
    /// Also make the [atlas](crate::atlas): every picture of the illumination square.
    pub atlas: bool,
    /// What takes more memory than this is refused. None: no limit is known.
    pub memory: Option<MemoryLimit>,
}

/// Gather radii of caustics.
pub const LEVELS: usize = 3;
/// Photons that may be asked for at a point. The farthest says how wide to look, so that one tells nothing.
pub const NEAREST: RangeInclusive<u32> = 2..=65_536;

impl Settings {
    /// True when `what` stays, needed or not.
    pub fn keeps(&self, what: Omittable) -> bool {
        self.keep_everything || self.keep.contains(&what)
    }

    /// True where pilots may learn where photons start and connections lead. The textbook has both go by power alone.
    pub fn learns(&self) -> bool {
        !self.even_starts && self.method == Method::Photon
    }

    /// # Errors
    /// A number that [`Method::Nearest`] cannot use, where that is the method.
    pub fn check_nearest(&self) -> Result<()> {
        let Self { nearest, cone, .. } = *self;
        let (least, most) = (NEAREST.start(), NEAREST.end());
        match self.method {
            Method::Nearest if !NEAREST.contains(&nearest) => Err(Error::Usage(format!(
                "--nearest {nearest}: light is read from {least} to {most} photons"
            ))),
            Method::Nearest if cone.is_nan() || cone < 1.0 => Err(Error::Usage(format!(
                "--cone {cone}: a cone ends at 1 or more times the distance of the farthest photon; inf weighs all alike"
            ))),
            _ => Ok(()),
        }
    }
}

/// Who transports light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Photons, photon maps and a final gather.
    Photon,
    /// The gathering path tracer with next-event estimation.
    Path,
    /// The gathering path tracer that finds luminaires by chance, as the paper's.
    PathPlain,
    /// The photon map of the textbooks (Jensen 2001), which reads light from the photons that lie nearest.
    Nearest,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Photon, Self::Path, Self::PathPlain, Self::Nearest];

    /// True where photons are shot, and camera paths end where they tell what arrives.
    pub fn shoots(self) -> bool {
        matches!(self, Self::Photon | Self::Nearest)
    }

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Photon => "photon",
            Self::Path => "path",
            Self::PathPlain => "path-plain",
            Self::Nearest => "nearest",
        }
    }
}

/// Who serves light that comes straight from a luminaire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direct {
    /// Connections, unless a [pilot](crate::pilot::learn) finds photons better at equal work.
    Auto,
    /// Connections from camera hits to points on luminaires.
    Connection,
    /// Photons, like all other light: the paper's plan at its purest.
    Photons,
}

impl Settings {
    /// The defaults for a film of so many pixels. Inter-reflection is as smooth in a large picture as in a small one: above 112
    /// rows its first radius is that share of the picture at which noise and bias balance.
    pub fn for_film(width: u32, height: u32) -> Self {
        let default = Self { width, height, ..Self::default() };
        Self { indirect_radius: (height as f32 / 28.0).max(4.0), ..default }
    }

    /// Of the film.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// With so many photon paths a pass, and the gather radius that goes with them: noise falls with their number and the square of the
    /// radius, bias with its square alone, so that both fall alike if the radius goes with their sixth root.
    #[must_use]
    pub fn with_paths(self, paths: u32) -> Self {
        let more = paths.max(1) as f32 / DEFAULT_PATHS as f32;
        Self { paths: Some(paths), indirect_radius: self.indirect_radius * more.powf(-1.0 / 6.0), ..self }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 512,
            height: 512,
            paths: None,
            seed: 0,
            method: Method::Photon,
            samples: 4,
            direct: Direct::Connection,
            invisible: false,
            max_reflections: None,
            even_starts: false,
            one_path: false,
            caustic_radius: 2.0,
            indirect_radius: 7.0,
            nearest: 100,
            cone: 1.0,
            keep_everything: false,
            keep: Vec::new(),
            atlas: false,
            memory: None,
        }
    }
}

/// The longer side of a film of no given size.
const LONGER_SIDE: u32 = 512;

/// The film of a picture of the given width / height, where nobody asks for another: 512 pixels on the longer side. None: square.
pub fn film_size(aspect: Option<f32>) -> (u32, u32) {
    let aspect = aspect.unwrap_or(1.0);
    let shorter = |share: f32| ((LONGER_SIDE as f32 * share).round() as u32).max(1);
    if aspect >= 1.0 { (LONGER_SIDE, shorter(1.0 / aspect)) } else { (shorter(aspect), LONGER_SIDE) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_have_the_shape_of_the_cameras_picture() {
        let shaped = |aspect: f32| film_size(Some(aspect));
        assert_eq!([film_size(None), shaped(1.0)], [(512, 512); 2]);
        assert_eq!(shaped(16.0 / 9.0), (512, 288));
        assert_eq!(shaped(0.5), (256, 512));
        assert_eq!((shaped(1e9), shaped(1e-9)), ((512, 1), (1, 512)));
    }
}
