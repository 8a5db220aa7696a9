use crate::light::Light;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// What a material radiates: Lambertian emission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance of both halves, W m⁻² sr⁻¹.
    pub radiance: Light,
    /// True: both sides shine. False: the front only.
    pub two_sided: bool,
}

/// What shines: one triangle of an emissive surface, or a punctual light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Luminaire {
    /// A triangle whose material has an [`Emission`].
    Triangle {
        /// Index into the mesh.
        triangle: u32,
        /// What it radiates.
        emission: Emission,
        /// Its area, m².
        area: f32,
    },
    /// The same intensity in all directions.
    Point {
        /// Where, scene space.
        position: Vec3,
        /// W sr⁻¹.
        intensity: Light,
    },
    /// A cone of light.
    Spot {
        /// Where, scene space.
        position: Vec3,
        /// Unit axis.
        direction: Vec3,
        /// On the axis, W sr⁻¹.
        intensity: Light,
        /// How it falls off the axis.
        cone: SpotCone,
    },
    /// OpenGL's spot after Warn, paper eq. 24: cosᵉ θ / (a₀ + a₁ r + a₂ r²) instead of 1 / r².
    Warn {
        /// Where, scene space.
        position: Vec3,
        /// Unit axis.
        direction: Vec3,
        /// On the axis: irradiance at distance r is `intensity / (a₀ + a₁ r + a₂ r²)`.
        intensity: Light,
        /// e ≥ 0; zero shines in all directions alike, anything else into the front hemisphere.
        exponent: f32,
        /// a₀, a₁ (m⁻¹), a₂ (m⁻²), not negative, not all zero.
        attenuation: [f32; 3],
    },
    /// Parallel light from far away.
    Directional {
        /// Unit vector along which the light travels.
        direction: Vec3,
        /// On a surface that faces it, W m⁻².
        irradiance: Light,
    },
}

/// The angular profile of a glTF spot: full inside `cos_inner`, none outside `cos_outer`, the square of a linear
/// ramp in the cosine between (`KHR_lights_punctual`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotCone {
    /// Cosine of the half-angle of the full core.
    pub cos_inner: f32,
    /// Cosine of the half-angle of the whole cone, ≤ `cos_inner`.
    pub cos_outer: f32,
}

impl SpotCone {
    /// Profile at cosine `cos` from the axis, in [0, 1].
    pub fn profile(&self, cos: f32) -> f32 {
        if cos >= self.cos_inner {
            1.0
        } else if cos <= self.cos_outer {
            0.0
        } else {
            ((cos - self.cos_outer) / (self.cos_inner - self.cos_outer)).powi(2)
        }
    }

    /// ∫ profile dω, sr.
    pub fn solid_angle(&self) -> f32 {
        TAU * ((1.0 - self.cos_inner) + (self.cos_inner - self.cos_outer) / 3.0)
    }

    /// A cosine distributed as the profile is over the sphere, from `u` in [0, 1).
    pub fn sample_cos(&self, u: f32) -> f32 {
        let core = TAU * (1.0 - self.cos_inner) / self.solid_angle();
        if u < core {
            1.0 - (u / core) * (1.0 - self.cos_inner)
        } else {
            let x = ((u - core) / (1.0 - core)).cbrt();
            self.cos_outer + x * (self.cos_inner - self.cos_outer)
        }
    }
}

impl Luminaire {
    /// Radiant power of both halves, W.
    ///
    /// `scene_radius` (m) stands in where power depends on who receives it: a directional light has the power that
    /// falls on the bounding disk, a Warn spot that of an inverse-square light which matches it at that distance.
    pub fn power(&self, scene_radius: f32) -> Light {
        match *self {
            Self::Triangle { emission, area, .. } => {
                let sides = if emission.two_sided { 2.0 } else { 1.0 };
                (sides * PI * area) * emission.radiance
            }
            Self::Point { intensity, .. } => (2.0 * TAU) * intensity,
            Self::Spot { intensity, cone, .. } => cone.solid_angle() * intensity,
            Self::Warn { intensity, exponent, attenuation, .. } => {
                let directions = if exponent == 0.0 { 2.0 * TAU } else { TAU / (exponent + 1.0) };
                (directions * warn_falloff(attenuation, scene_radius)) * intensity
            }
            Self::Directional { irradiance, .. } => (PI * scene_radius * scene_radius) * irradiance,
        }
    }

    /// True for luminaires that no ray can hit.
    pub fn is_delta(&self) -> bool {
        !matches!(self, Self::Triangle { .. })
    }
}

/// r² / (a₀ + a₁ r + a₂ r²): how much stronger a Warn light is at distance r than an inverse-square one, eq. 24.
pub fn warn_falloff([a0, a1, a2]: [f32; 3], r: f32) -> f32 {
    r * r / (a0 + a1 * r + a2 * r * r)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spot_samples_follow_the_profile() {
        let cone = SpotCone { cos_inner: 0.9, cos_outer: 0.6 };
        let n = 100_000_u32;
        let mean = (0..n).map(|i| f64::from(cone.sample_cos((i as f32 + 0.5) / n as f32))).sum::<f64>()
            / f64::from(n);
        // ∫ c p(c) dc / ∫ p(c) dc by Simpson's rule on each piece
        let simpson =
            |f: &dyn Fn(f64) -> f64, a: f64, b: f64| (b - a) / 6.0 * (f(a) + 4.0 * f(0.5 * (a + b)) + f(b));
        let ramp = |c: f64| ((c - 0.6) / 0.3).powi(2);
        let norm = simpson(&ramp, 0.6, 0.9) + 0.1;
        let first = simpson(&|c| c * ramp(c), 0.6, 0.9) + simpson(&|c| c, 0.9, 1.0);
        assert!((mean - first / norm).abs() < 1e-5, "{mean} against {}", first / norm);
        assert!((f64::from(cone.solid_angle()) - std::f64::consts::TAU * norm).abs() < 1e-5);
    }
}
