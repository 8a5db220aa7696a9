//! What the filter looks at, plane by plane, in numbers of one size.

use super::Noisy;
use glam::{DVec3, Vec3};

/// Three numbers a pixel, each row-major from top left.
pub(super) type Three = [Vec<f32>; 3];

/// A picture taken apart.
pub(super) struct Planes {
    pub width: usize,
    pub height: usize,
    /// Radiance by albedo, times `scale`.
    pub value: Three,
    /// Of it, the variance of the mean, all three channels together.
    pub variance: Vec<f32>,
    /// Where there is none −1, so that it is like no other.
    pub albedo: Three,
    pub normal: Three,
    /// 1; 0 where a number is not finite.
    pub usable: Vec<f32>,
    /// From values to radiance.
    back: Vec<Vec3>,
}

impl Planes {
    /// Of a picture, its mean brightness about 1: squares are neither lost nor infinite, in whatever unit it is.
    pub fn of(noisy: &Noisy<'_>) -> Self {
        let Noisy { width, height, picture, error, albedo, normal } = *noisy;
        // What does not reflect stays as it is.
        let divisors: Vec<Vec3> =
            albedo.iter().map(|a| Vec3::select(a.cmpgt(Vec3::ZERO), *a, Vec3::ONE)).collect();
        let usable = |i: usize| {
            let all = [picture[i] / divisors[i], error[i] / divisors[i], albedo[i], normal[i]];
            all.iter().all(|x| x.is_finite())
        };
        let usable: Vec<bool> = (0..picture.len()).map(usable).collect();
        let scale = scale((0..picture.len()).filter(|i| usable[*i]).map(|i| picture[i] / divisors[i]));
        let of = |plane: &dyn Fn(usize) -> Vec3| {
            let value = |i: usize, axis: usize| if usable[i] { plane(i)[axis] } else { 0.0 };
            [0, 1, 2].map(|axis| (0..usable.len()).map(|i| value(i, axis)).collect::<Vec<f32>>())
        };
        let variance =
            |i: usize| if usable[i] { (error[i] / divisors[i] * scale).length_squared() } else { 0.0 };
        let reflects = |a: Vec3| Vec3::select(a.cmpgt(Vec3::ZERO), a, Vec3::NEG_ONE);
        Self {
            width: width as usize,
            height: height as usize,
            value: of(&|i| picture[i] / divisors[i] * scale),
            variance: (0..usable.len()).map(variance).collect(),
            albedo: of(&|i| reflects(albedo[i])),
            normal: of(&|i| normal[i]),
            usable: usable.iter().map(|usable| f32::from(u8::from(*usable))).collect(),
            back: divisors.iter().map(|divisor| *divisor / scale).collect(),
        }
    }

    /// The radiance of a change of value.
    pub fn radiance(&self, i: usize, change: Vec3) -> Vec3 {
        change * self.back[i]
    }
}

/// A power of two by which values are about 1 in the mean: nothing is rounded.
fn scale(values: impl Iterator<Item = Vec3>) -> f32 {
    let (sum, count) =
        values.fold((0.0, 0.0), |(sum, count), x| (sum + x.as_dvec3().abs().dot(DVec3::ONE), count + 3.0));
    let power = -(sum / f64::max(count, 1.0)).log2().round();
    // A black picture has no size; of others the power is one that single precision has.
    let (least, most) = (f64::from(f32::MIN_EXP), f64::from(f32::MAX_EXP - 1));
    if power.is_finite() { power.clamp(least, most).exp2() as f32 } else { 1.0 }
}
