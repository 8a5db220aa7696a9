//! From the unit square to directions and points. Each function states its density.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Uniform on the unit disk, pdf 1/π. Concentric map, Shirley & Chiu 1997.
#[inline(always)]
pub fn disk(u: [f32; 2]) -> [f32; 2] {
    let (x, y) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0, 0.0];
    }
    let (radius, angle) =
        if x.abs() > y.abs() { (x, PI / 4.0 * (y / x)) } else { (y, PI / 2.0 - PI / 4.0 * (x / y)) };
    [radius * angle.cos(), radius * angle.sin()]
}

/// About +z, pdf cos θ / π in solid angle; z > 0.
#[inline(always)]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let [x, y] = disk(u);
    // 2⁻²⁴ is the square of the smallest cosine that 24 random bits can tell from zero.
    let z = (1.0 - x * x - y * y).max(f32::EPSILON * 0.5).sqrt();
    Vec3::new(x, y, z)
}

/// Uniform on the sphere, pdf 1/(4π) in solid angle.
pub fn sphere(u: [f32; 2]) -> Vec3 {
    about_z(1.0 - 2.0 * u[0], u[1])
}

/// The unit vector at cosine `z` from +z and at azimuth 2π `turn`.
pub fn about_z(z: f32, turn: f32) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * turn).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// The unit vector whose angle from +z has the given versine, 1 − cos, at azimuth 2π `turn`: exact also very near to +z.
pub fn off_z(versine: f32, turn: f32) -> Vec3 {
    let r = (versine * (2.0 - versine)).max(0.0).sqrt();
    let (sin, cos) = (TAU * turn).sin_cos();
    Vec3::new(r * cos, r * sin, 1.0 - versine)
}

/// Uniform on a triangle: barycentric weights of its second and third vertex. Heitz 2019, low distortion.
pub fn triangle(u: [f32; 2]) -> [f32; 2] {
    let (mut b1, mut b2) = (u[0], u[1]);
    if b2 > b1 {
        b1 *= 0.5;
        b2 -= b1;
    } else {
        b2 *= 0.5;
        b1 -= b2;
    }
    [b1, b2]
}

/// Rotates `local` (z up) so that +z becomes the unit vector `up`. Duff et al. 2017, unit length is kept.
#[inline(always)]
pub fn to_world(up: Vec3, local: Vec3) -> Vec3 {
    let (tangent, bitangent) = up.any_orthonormal_pair();
    (local.x * tangent + local.y * bitangent + local.z * up).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sobol;

    fn mean(f: impl Fn([f32; 2]) -> f32) -> f64 {
        let sobol = Sobol::new(11);
        (0..65_536).map(|i| f64::from(f(sobol.point::<2>(i, 0)))).sum::<f64>() / 65_536.0
    }

    #[test]
    fn cosine_hemisphere_has_its_moments() {
        assert!((mean(|u| cosine_hemisphere(u).z) - 2.0 / 3.0).abs() < 1e-4);
        assert!((mean(|u| cosine_hemisphere(u).z.powi(2)) - 0.5).abs() < 1e-4);
        assert!(mean(|u| cosine_hemisphere(u).x).abs() < 1e-4);
    }

    #[test]
    fn sphere_has_its_moments() {
        assert!(mean(|u| sphere(u).z).abs() < 1e-4);
        assert!((mean(|u| sphere(u).x.powi(2)) - 1.0 / 3.0).abs() < 1e-4);
    }

    #[test]
    fn triangle_is_uniform() {
        assert!((mean(|u| triangle(u)[0]) - 1.0 / 3.0).abs() < 1e-4);
        assert!((mean(|u| triangle(u)[0] * triangle(u)[1]) - 1.0 / 12.0).abs() < 1e-4);
    }
}
