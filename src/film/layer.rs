//! The layers that a render can have, and their names.

use crate::error::{Error, Result};
use std::fmt;
use std::str::FromStr;

/// One layer of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layer {
    /// The picture: the visible half of what reaches the pixel, paper eq. 8.
    Visible,
    /// The invisible half of what reaches the pixel, `[1 0] L`.
    Invisible,
    /// The standard error of the mean of [`Layer::Visible`]: derived from the passes, never passed in.
    Error,
    /// An estimate of what the finite gather radius adds to (or takes from) [`Layer::Visible`].
    Bias,
    /// The part of the picture that comes straight from luminaires.
    Emitted,
    /// The part that met one surface between luminaire and camera. After few passes a pixel at the rim of a half shadow may be a
    /// little below zero: what is known of the unhidden lamp, less what was found hidden.
    Direct,
    /// The part that came through delta lobes before the surface seen.
    Caustic,
    /// The rest: inter-reflection.
    Indirect,
    /// The part, of whatever class, that some surface on its way re-radiated by a fluorescence of its own.
    Fluorescent,
    /// Distance from the camera to the first surface, m, in `x`; infinity where a pass met none.
    Depth,
    /// Shading normal of the surface seen, world space.
    Normal,
    /// Albedo of the surface seen.
    Albedo,
    /// The mean of the shading normals of what is seen in mirrors and through smooth glass, world space: for denoisers.
    DenoisingNormal,
    /// The albedo of what is seen in mirrors and through smooth glass, times what they let through: for denoisers.
    DenoisingAlbedo,
}

impl Layer {
    /// Every layer, in the order of the enum.
    pub const ALL: [Self; 14] = [
        Self::Visible,
        Self::Invisible,
        Self::Error,
        Self::Bias,
        Self::Emitted,
        Self::Direct,
        Self::Caustic,
        Self::Indirect,
        Self::Fluorescent,
        Self::Depth,
        Self::Normal,
        Self::Albedo,
        Self::DenoisingNormal,
        Self::DenoisingAlbedo,
    ];

    /// The name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Visible => "visible",
            Self::Invisible => "invisible",
            Self::Error => "error",
            Self::Bias => "bias",
            Self::Emitted => "emitted",
            Self::Direct => "direct",
            Self::Caustic => "caustic",
            Self::Indirect => "indirect",
            Self::Fluorescent => "fluorescent",
            Self::Depth => "depth",
            Self::Normal => "normal",
            Self::Albedo => "albedo",
            Self::DenoisingNormal => "denoising-normal",
            Self::DenoisingAlbedo => "denoising-albedo",
        }
    }

    /// The names of the components in a file: `R G B` for light, `X Y Z` for a vector, `Z` for depth.
    pub const fn components(self) -> &'static [&'static str] {
        match self {
            Self::Depth => &["Z"],
            Self::Normal | Self::DenoisingNormal => &["X", "Y", "Z"],
            _ => &["R", "G", "B"],
        }
    }
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Layer {
    type Err = Error;
    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|layer| layer.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::Usage(format!("there is no layer '{name}'; the layers are {known}"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_others_are_refused_with_the_list() {
        for layer in Layer::ALL {
            assert_eq!(layer.to_string().parse::<Layer>().unwrap(), layer);
        }
        let message = "visable".parse::<Layer>().unwrap_err().to_string();
        assert!(message.contains("'visable'") && message.contains("visible, invisible"), "{message}");
    }
}
