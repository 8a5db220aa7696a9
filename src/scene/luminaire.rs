use super::Part;
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

impl Emission {
    /// The same radiance of both halves, W m⁻² sr⁻¹, from the front.
    pub const fn front(radiance: Vec3) -> Self {
        Self { radiance: Light::both(radiance), two_sided: false }
    }

    /// With what there is at a point of it, as far as it shines in the same components.
    pub(super) fn with(self, there: Light) -> Self {
        Self { radiance: there.kept_where(self.radiance), ..self }
    }
}

/// What shines: one triangle of an emissive surface or a part of it, or a punctual light.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Luminaire {
    /// A triangle whose material has an [`Emission`].
    Triangle {
        /// Index into the mesh.
        triangle: u32,
        /// Where it does not shine alike all over, the part of it that this is. None: all of it, which does.
        part: Option<Part>,
        /// What it radiates, on average over the part.
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
    /// A lamp whose intensity differs by direction as it was measured.
    Profile {
        /// Where, scene space.
        position: Vec3,
        /// The mean over all directions, W sr⁻¹.
        intensity: Light,
        /// Index into the scene's [`Profile`](super::Profile)s.
        profile: u32,
    },
    /// Parallel light from far away.
    Directional {
        /// Unit vector along which the light travels.
        direction: Vec3,
        /// On a surface that faces it, W m⁻².
        irradiance: Light,
    },
    /// A disk at infinity, alike all over.
    Sun {
        /// Unit vector along which light from its middle travels.
        direction: Vec3,
        /// W m⁻² sr⁻¹.
        radiance: Light,
        /// Versine (1 − cos) of its angular radius.
        versine: f32,
    },
    /// The scene's [`Environment`](super::Environment).
    Environment {
        /// ∫ L dω over all directions, W m⁻².
        fluence: Light,
    },
}

/// The angular profile of a glTF spot: full inside its core, none outside the cone, the square of a linear ramp in the
/// cosine between (`KHR_lights_punctual`). Kept as versines, 1 − cos θ: cosines of less than 10⁻⁴ rad are 1 in f32.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotCone {
    /// Versine of the half-angle of the full core.
    pub(super) inner: f32,
    /// Versine of the half-angle of the whole cone, ≥ `inner`.
    pub(super) outer: f32,
}

impl SpotCone {
    /// From the half-angles of the core and of the whole cone, radians: 0 ≤ `inner` ≤ `outer` ≤ π/2.
    pub fn of_angles(inner: f32, outer: f32) -> Self {
        let versine = |angle: f32| (2.0 * (0.5 * f64::from(angle)).sin().powi(2)) as f32;
        Self { inner: versine(inner), outer: versine(outer) }
    }

    /// From the cosines of those angles: 1 ≥ `inner` ≥ `outer` ≥ 0.
    pub fn of_cosines(inner: f32, outer: f32) -> Self {
        Self { inner: 1.0 - inner, outer: 1.0 - outer }
    }

    /// The versines of its core and of the whole cone.
    pub(crate) fn versines(&self) -> (f32, f32) {
        (self.inner, self.outer)
    }

    /// Profile at `versine` from the axis, in [0, 1].
    pub fn profile(&self, versine: f32) -> f32 {
        if versine <= self.inner {
            1.0
        } else if versine >= self.outer {
            0.0
        } else {
            ((self.outer - versine) / (self.outer - self.inner)).powi(2)
        }
    }

    /// ∫ profile dω, sr.
    pub fn solid_angle(&self) -> f32 {
        TAU * (self.inner + (self.outer - self.inner) / 3.0)
    }

    /// A versine distributed as the profile is over the sphere, from `u` in [0, 1).
    pub fn sample(&self, u: f32) -> f32 {
        let core = TAU * self.inner / self.solid_angle();
        if u < core {
            (u / core) * self.inner
        } else {
            let x = ((u - core) / (1.0 - core)).cbrt();
            self.outer - x * (self.outer - self.inner)
        }
    }
}

/// 1 − cos of the angle between two directions of any length, to the last bits of f32 however small it is.
pub fn versine_between(a: Vec3, b: Vec3) -> f32 {
    let (a, b) = (a.as_dvec3(), b.as_dvec3());
    let (cos, sin) = (a.dot(b), a.cross(b).length());
    let length = cos.hypot(sin);
    let versine = if cos > 0.0 { sin * sin / (length * (length + cos)) } else { (length - cos) / length };
    versine as f32
}

/// The versine of half an angle of a milliradian: a pixel of 40° over 700 pixels.
const NEEDLE: f32 = 5e-7;

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
            Self::Point { intensity, .. } | Self::Profile { intensity, .. } => (2.0 * TAU) * intensity,
            Self::Spot { intensity, cone, .. } => cone.solid_angle() * intensity,
            Self::Warn { intensity, exponent, attenuation, .. } => {
                let directions = if exponent == 0.0 { 2.0 * TAU } else { TAU / (exponent + 1.0) };
                (directions * warn_falloff(attenuation, scene_radius)) * intensity
            }
            Self::Directional { irradiance, .. } => (PI * scene_radius * scene_radius) * irradiance,
            Self::Sun { radiance, versine, .. } => {
                (PI * scene_radius * scene_radius * TAU * versine) * radiance
            }
            Self::Environment { fluence } => (PI * scene_radius * scene_radius) * fluence,
        }
    }

    /// A sun of this angular radius (rad, up to π/2) that brings as much light to a surface that faces it as a
    /// [`Directional`](Self::Directional) light of this irradiance.
    pub fn sun(direction: Vec3, irradiance: Light, angular_radius: f32) -> Self {
        let angle = f64::from(angular_radius);
        // ∫ cos θ dω = π sin².
        let over = 1.0 / (std::f64::consts::PI * angle.sin().powi(2));
        let versine = 2.0 * (0.5 * angle).sin().powi(2);
        Self::Sun { direction, radiance: over as f32 * irradiance, versine: versine as f32 }
    }

    /// What shines, in the unit of the luminaire's own kind: radiance, intensity, irradiance or fluence.
    pub(crate) fn light(&self) -> Light {
        match *self {
            Self::Triangle { emission, .. } => emission.radiance,
            Self::Point { intensity, .. }
            | Self::Spot { intensity, .. }
            | Self::Warn { intensity, .. }
            | Self::Profile { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
            Self::Sun { radiance, .. } => radiance,
            Self::Environment { fluence } => fluence,
        }
    }

    /// The same, to be changed.
    pub(crate) fn light_mut(&mut self) -> &mut Light {
        match self {
            Self::Triangle { emission, .. } => &mut emission.radiance,
            Self::Point { intensity, .. }
            | Self::Spot { intensity, .. }
            | Self::Warn { intensity, .. }
            | Self::Profile { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
            Self::Sun { radiance, .. } => radiance,
            Self::Environment { fluence } => fluence,
        }
    }

    /// True where it is seen by who meets nothing else.
    pub fn is_sky(&self) -> bool {
        matches!(self, Self::Sun { .. } | Self::Environment { .. })
    }

    /// True for a spot so narrow that what it lights is less than a pixel of most pictures.
    pub fn is_needle(&self) -> bool {
        matches!(self, Self::Spot { cone, .. } if cone.outer < NEEDLE)
    }

    /// True for a luminaire of the triangle that `before` is of: another part of it.
    #[cfg(feature = "cli")]
    pub(crate) fn goes_on(&self, before: Option<&Self>) -> bool {
        match (self, before) {
            (Self::Triangle { triangle: own, .. }, Some(Self::Triangle { triangle, .. })) => own == triangle,
            _ => false,
        }
    }

    /// True for luminaires that no ray can hit.
    pub fn is_delta(&self) -> bool {
        !matches!(self, Self::Triangle { .. } | Self::Sun { .. } | Self::Environment { .. })
    }
}

/// r² / (a₀ + a₁ r + a₂ r²): how much stronger a Warn light is at distance r than an inverse-square one, eq. 24.
pub fn warn_falloff([a0, a1, a2]: [f32; 3], r: f32) -> f32 {
    r * r / (a0 + a1 * r + a2 * r * r)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The solid angle and the mean versine of a cone of half-angles `inner` and `outer`: integrals of the profile in
    /// f64, by Simpson's rule, which is exact for their cubics.
    fn integrals(inner: f64, outer: f64) -> (f64, f64) {
        let versine = |angle: f64| 2.0 * (0.5 * angle).sin().powi(2);
        let (inner, outer) = (versine(inner), versine(outer));
        let simpson =
            |f: &dyn Fn(f64) -> f64, a: f64, b: f64| (b - a) / 6.0 * (f(a) + 4.0 * f(0.5 * (a + b)) + f(b));
        let ramp = |v: f64| if outer > inner { ((outer - v) / (outer - inner)).powi(2) } else { 0.0 };
        let whole = inner + simpson(&ramp, inner, outer);
        let first = 0.5 * inner * inner + simpson(&|v| v * ramp(v), inner, outer);
        (std::f64::consts::TAU * whole, first / whole)
    }

    #[test]
    fn spots_of_any_width_have_their_power_and_their_samples_follow_the_profile() {
        let fits = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-4;
        for outer in [1.2_f32, 0.3, 1e-2, 1e-4, 1e-6, 1e-9, 1e-15] {
            for inner in [0.0, 0.5 * outer, outer] {
                let cone = SpotCone::of_angles(inner, outer);
                let (solid_angle, mean) = integrals(f64::from(inner), f64::from(outer));
                let n = 100_000_u32;
                let samples = (0..n).map(|i| f64::from(cone.sample((i as f32 + 0.5) / n as f32)));
                let mean_found = samples.sum::<f64>() / f64::from(n);
                for (found, expected) in [(f64::from(cone.solid_angle()), solid_angle), (mean_found, mean)] {
                    assert!(fits(found, expected), "{inner} to {outer} rad: {found} for {expected}");
                    assert!(!fits(1.02 * found, expected) && !fits(0.98 * found, expected));
                }
            }
        }
    }

    #[test]
    fn the_profile_falls_from_the_core_to_the_edge_in_wide_and_in_narrow_spots() {
        for outer in [0.8_f32, 1e-3, 1e-6, 1e-12] {
            let cone = SpotCone::of_angles(0.0, outer);
            let versine = |angle: f32| SpotCone::of_angles(angle, angle).outer;
            assert_eq!((cone.profile(0.0), cone.profile(versine(outer))), (1.0, 0.0));
            let half = cone.profile(0.5 * versine(outer));
            assert!((half - 0.25).abs() < 1e-6, "{half} at half the versine of {outer} rad");
        }
    }

    #[test]
    fn versines_of_small_and_large_angles_are_exact() {
        for angle in [1e-7_f64, 1e-4, 0.3, 1.5, 3.0] {
            let axis = Vec3::new(1.0, 0.0, 0.0);
            let aside = Vec3::new(angle.cos() as f32, angle.sin() as f32, 0.0);
            let expected = 2.0 * (0.5 * f64::from(aside.y).atan2(f64::from(aside.x))).sin().powi(2);
            let found = f64::from(versine_between(3.0 * axis, aside));
            assert!((found / expected - 1.0).abs() < 1e-6, "{angle}: {found} for {expected}");
        }
        assert_eq!(versine_between(Vec3::X, -Vec3::X), 2.0);
    }
}
