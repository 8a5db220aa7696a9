//! What can be left out, by name.

use std::str::FromStr;

/// One thing left out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Omission {
    /// Short name: that of its [`Omittable`].
    pub name: &'static str,
    /// Why the picture is exactly the same without it.
    pub reason: String,
}

/// What a plan may leave out, if the scene does not need it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Omittable {
    /// The measurement of the multiplication factor.
    Existence,
    /// Materials that no triangle has.
    Materials,
    /// Surfaces that do nothing to light.
    Matter,
    /// Vertex normals that are not interpolated.
    Normals,
    /// Asking what surrounds solids of glass.
    Media,
    /// Lobes that reflect nothing that is read.
    Lobes,
    /// Re-radiation of light that nothing brings, or as light that nothing reads.
    Fluorescence,
    /// Textures that nothing which is read depends on.
    Textures,
    /// Light of luminaires that nothing reads.
    Luminaires,
    /// Visibility queries of connections.
    Visibility,
    /// Surfaces that cast no shadow, in those queries.
    Casters,
    /// Sampling luminaires whose irradiance has a closed form.
    LightSamples,
    /// Queries for more than the first surface on a line.
    AllHits,
    /// Photons and their maps.
    Photons,
    /// Photons that came through delta lobes only.
    CausticPhotons,
    /// Photons that came through at least one finite lobe.
    IndirectPhotons,
    /// The visible half of a photon.
    VisibleHalf,
    /// Deposits where nothing reads them.
    Deposits,
}

impl Omittable {
    /// All of them, in the order in which plans look at them.
    pub const ALL: [Self; 18] = [
        Self::Materials,
        Self::Matter,
        Self::Normals,
        Self::Media,
        Self::Existence,
        Self::Lobes,
        Self::Fluorescence,
        Self::Textures,
        Self::Luminaires,
        Self::AllHits,
        Self::Visibility,
        Self::Casters,
        Self::LightSamples,
        Self::Photons,
        Self::CausticPhotons,
        Self::IndirectPhotons,
        Self::VisibleHalf,
        Self::Deposits,
    ];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Existence => "existence",
            Self::Materials => "materials",
            Self::Matter => "matter",
            Self::Normals => "normals",
            Self::Media => "media",
            Self::Lobes => "lobes",
            Self::Fluorescence => "fluorescence",
            Self::Textures => "textures",
            Self::Luminaires => "luminaires",
            Self::Visibility => "visibility",
            Self::Casters => "casters",
            Self::LightSamples => "light-samples",
            Self::AllHits => "all-hits",
            Self::Photons => "photons",
            Self::CausticPhotons => "caustic-photons",
            Self::IndirectPhotons => "indirect-photons",
            Self::VisibleHalf => "visible-half",
            Self::Deposits => "deposits",
        }
    }

    /// The omission, with its reason.
    pub(super) fn because(self, reason: impl Into<String>) -> Omission {
        Omission { name: self.name(), reason: reason.into() }
    }
}

impl FromStr for Omittable {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|what| what.name() == text).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            format!("`{text}` is nothing that could be left out; choose among {known}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for what in Omittable::ALL {
            assert_eq!(what.name().parse(), Ok(what));
        }
        let unknown = "shadows".parse::<Omittable>().expect_err("no such name");
        assert!(Omittable::ALL.iter().all(|what| unknown.contains(what.name())), "{unknown}");
    }
}
