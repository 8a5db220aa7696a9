//! Which of the light that a camera path may come upon was found before it got there.

use crate::optics::Lobe;
use crate::plan::reads_glints;

/// What a line has behind it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Past {
    /// A diffuse lobe.
    pub scattered: bool,
    pub found: Found,
}

/// What was found already, at the last surface that is not narrow, of the light that the line may come upon.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing.
    Nothing,
    /// By a diffuse lobe: what shines there at once or through mirrors and glass, by connections and caustic photons.
    Lit,
    /// By a glossy lobe, which the line has just left: what glares through mirrors and glass. What shines at once was connected, and is
    /// weighed.
    Glossed,
    /// The same, behind mirrors or glass.
    Beyond,
}

impl Past {
    /// At the camera.
    pub const NONE: Self = Self { scattered: false, found: Found::Nothing };

    /// Behind a branch; `glints`: photons tell glossy lobes what glares.
    pub fn then(self, lobe: &Lobe, glints: bool) -> Self {
        let found = match self.found {
            _ if lobe.as_diffuse().is_some() => return Self { scattered: true, found: Found::Lit },
            _ if glints && reads_glints(lobe) => Found::Glossed,
            Found::Glossed if lobe.is_narrow() => Found::Beyond,
            found if lobe.is_narrow() => found,
            _ => Found::Nothing,
        };
        Self { found, ..self }
    }

    /// True where a luminaire that the line comes upon is not found yet; `glares`: it does so.
    pub fn wants(self, glares: impl FnOnce() -> bool) -> bool {
        match self.found {
            Found::Nothing | Found::Glossed => true,
            Found::Lit => false,
            Found::Beyond => !glares(),
        }
    }
}
