use super::{Sheen, albedo};

/// A layer that reflects as [`Glossy`](super::Glossy) does and lets all the rest through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clear {
    /// Reflectance at normal incidence: the largest of the colours, in [0, 1].
    pub f0: f32,
    /// Reflectance at grazing incidence, in [0, 1].
    pub f90: f32,
    /// GGX roughness, the square of a material's.
    pub alpha: f32,
}

impl Clear {
    /// What it reflects of light that comes at cosine `mu` in [0, 1].
    pub fn albedo(&self, mu: f32) -> f32 {
        let here = albedo::albedo(mu, self.alpha);
        let once = (1.0 - here.missing) * (self.f0 + (self.f90 - self.f0) * here.grazing);
        once + here.missing * albedo::again(self.mean(), albedo::mean(self.alpha).missing)
    }

    /// What it reflects of light that comes from all directions alike.
    pub fn average(&self) -> f32 {
        let mean = albedo::mean(self.alpha);
        let once = (1.0 - mean.missing) * self.f0 + (self.f90 - self.f0) * mean.grazing;
        once + mean.missing * albedo::again(self.mean(), mean.missing)
    }

    /// What one facet reflects of light from all directions.
    fn mean(&self) -> f32 {
        self.f0 + (self.f90 - self.f0) * albedo::SCHLICK_MEAN
    }
}

/// Fibres above all else: a [`Sheen`] of one number for its colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Velvet {
    /// The largest of the sheen's colours, in [0, 1].
    pub weight: f32,
    /// Its α.
    pub alpha: f32,
}

/// What lies over a lobe: what one layer reflects does not reach what is below.
///
/// Of light that comes at cosine μ the share T(μ) = Π (1 − E(μ)) passes. A [`Diffuse`](super::Diffuse) below is seen as
/// albedo / π · T(wo) T(wi) / T̄ with T̄ the cosine-weighted average of T: reciprocal, and a white one reflects exactly what the
/// layers let pass (Kelemen & Szirmay-Kalos 2001). A [`Glossy`](super::Glossy) below is multiplied by the
/// smaller of T(wo) and T(wi): exact for a smooth one, and never more than the layers let pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layers {
    pub(crate) clear: Option<Clear>,
    pub(crate) coat: Option<Clear>,
    pub(crate) sheen: Option<Velvet>,
    pub(crate) average: f32,
}

impl Layers {
    /// Nothing at all.
    pub const NONE: Self = Self { clear: None, coat: None, sheen: None, average: 1.0 };

    /// With a layer that reflects as the material's own [`Glossy`](super::Glossy) does.
    pub fn with_clear(self, clear: Clear) -> Self {
        Self { clear: Some(clear), ..self }.averaged()
    }

    /// With a clear coat: of index 1.5 it has f0 = 0.04 and f90 = 1, both times how much of it there is.
    pub fn with_coat(self, coat: Clear) -> Self {
        Self { coat: Some(coat), ..self }.averaged()
    }

    /// With fibres above.
    pub fn with_sheen(self, sheen: Velvet) -> Self {
        Self { sheen: Some(sheen), ..self }.averaged()
    }

    /// The share of light at cosine `mu` in [0, 1] that passes all layers once.
    pub fn transmission(&self, mu: f32) -> f32 {
        let layers = [self.clear, self.coat];
        let below: f32 = layers.iter().flatten().map(|layer| passed(layer.albedo(mu))).product();
        match self.sheen {
            Some(Velvet { weight, alpha }) => below * passed(weight * Sheen::albedo(mu, alpha)),
            None => below,
        }
    }

    /// T(μ) / T̄: what leaves at cosine `mu` of light that is scattered below, over what of it leaves at all.
    pub(super) fn leaving(&self, mu: f32) -> f32 {
        // Nothing leaves where nothing enters.
        if self.average > 0.0 { self.transmission(mu) / self.average } else { 0.0 }
    }

    /// The cosine-weighted average of [`transmission`](Self::transmission).
    pub fn average(&self) -> f32 {
        self.average
    }

    fn averaged(self) -> Self {
        let average = match (self.clear, self.coat, self.sheen) {
            (None, None, None) => 1.0,
            (Some(one), None, None) | (None, Some(one), None) => passed(one.average()),
            _ => albedo::cosine_weighted(|mu| self.transmission(mu)),
        };
        Self { average, ..self }
    }
}

/// What a layer that absorbs nothing lets through; a white one passes nothing, and not the error of the last digit.
fn passed(reflected: f32) -> f32 {
    (1.0 - reflected).max(0.0)
}
