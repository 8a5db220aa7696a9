//! How PNG and JPEG files show a picture.

use crate::film::{Exposure, Header, Preview, View};
use clap::Args;
use glam::Vec3;

/// What may be said of it.
#[derive(Args, Clone, Copy, Debug)]
pub struct PreviewArgs {
    /// Exposure of the PNG or JPEG in stops; auto: so that most of what is lit is shown. The EXR file stays as it is.
    #[arg(long, value_name = "STOPS|auto", allow_negative_numbers = true)]
    exposure: Option<Exposure>,

    /// From linear light to the PNG or JPEG: standard (sRGB; all above 1 is white), neutral (Khronos PBR Neutral: highlights are bent to
    /// white) or agx (AgX: the whole range is). Default: standard at exposure 0; where
    /// a file has no light and the built-in studio serves, neutral at auto.
    #[arg(long, value_name = "VIEW", hide_possible_values = true)]
    view: Option<View>,
}

impl PreviewArgs {
    /// With what is usual where nothing is said.
    pub fn over(self, usual: Preview) -> Preview {
        Preview { exposure: self.exposure.unwrap_or(usual.exposure), view: self.view.unwrap_or(usual.view) }
    }
}

/// A preview whose exposure is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// The same, as it was asked for.
    pub preview: Preview,
    /// Its exposure for the picture that it shows.
    pub stops: f64,
}

impl Settled {
    /// For a plane of linear RGB.
    pub fn of(preview: Preview, plane: &[Vec3]) -> Self {
        Self { preview, stops: preview.exposure.stops(plane) }
    }

    /// The same at the exposure that was found, so that nobody looks for it again.
    pub fn fixed(&self) -> Preview {
        Preview { exposure: Exposure::Stops(self.stops as f32), ..self.preview }
    }

    /// States both in the header of the picture.
    pub fn tell(&self, header: &mut Header) {
        header.set("view", self.preview.view.name());
        header.set("exposure", self.stops);
    }

    /// What the user did not say: the exposure that was found.
    pub fn note(&self) -> Option<String> {
        (self.preview.exposure == Exposure::Auto)
            .then(|| format!("note: shown at exposure {:.2}", self.stops))
    }
}
