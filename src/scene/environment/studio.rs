//! A photographer's studio, for models whose files have no light.

use super::panorama::Panorama;
use glam::DVec3;
use std::f64::consts::PI;

/// Texels: its softest edge has ten of them.
const SIZE: [u32; 2] = [256, 128];

/// The middle of a soft box and its half width and height as tangents of angles seen from the model; its radiance there, before all
/// is balanced; and the part of its half sides over which it fades.
struct SoftBox {
    towards: DVec3,
    half: [f64; 2],
    radiance: DVec3,
    fade: f64,
}

/// Key from the upper left in front, fill from the right, a strip behind for rims, and a wide one overhead. None is so small or bright
/// that chance has to find it.
const BOXES: [SoftBox; 4] = [
    SoftBox {
        towards: DVec3::new(-0.9, 0.7, 1.0),
        half: [0.4, 0.4],
        radiance: DVec3::new(5.2, 5.0, 4.7),
        fade: 0.35,
    },
    SoftBox {
        towards: DVec3::new(1.0, 0.25, 0.55),
        half: [0.35, 0.7],
        radiance: DVec3::new(1.22, 1.3, 1.42),
        fade: 0.5,
    },
    SoftBox {
        towards: DVec3::new(0.55, 0.5, -1.0),
        half: [0.6, 0.2],
        radiance: DVec3::new(3.35, 3.5, 3.75),
        fade: 0.5,
    },
    SoftBox {
        towards: DVec3::new(0.25, 1.0, -0.55),
        half: [0.5, 0.35],
        radiance: DVec3::new(1.0, 1.0, 1.0),
        fade: 0.6,
    },
];

/// Walls from below to above: a floor that is darker, and a warm ceiling.
const WALLS: [DVec3; 3] =
    [DVec3::new(0.62, 0.6, 0.58), DVec3::new(0.82, 0.8, 0.78), DVec3::new(1.02, 1.0, 0.97)];

/// The built-in studio for a model that is seen from +z: soft grey walls and four soft boxes, neutral on the whole. Level ground gets
/// an irradiance of π, so that white paper looks as 1.
pub fn studio() -> Panorama {
    let [width, height] = SIZE;
    let place = |i: u32, side: u32| (i as f32 + 0.5) / side as f32;
    let texel = |x: u32, y: u32| light(Panorama::direction([place(x, width), place(y, height)]).as_dvec3());
    let texels: Vec<DVec3> = (0..height).flat_map(|y| (0..width).map(move |x| texel(x, y))).collect();
    let angle = |y: usize| PI * y as f64 / f64::from(height);
    let rows = || texels.chunks_exact(width as usize).map(|row| row.iter().sum::<DVec3>()).enumerate();
    // In proportion to ∫ L dω, and to ∫ L cos θ dω over the upper half.
    let all: DVec3 = rows().map(|(y, row)| (angle(y).cos() - angle(y + 1).cos()) * row).sum();
    let balance = DVec3::splat(all.element_sum() / 3.0) / all;
    let upper = rows().take(height as usize / 2);
    let level: DVec3 =
        upper.map(|(y, row)| (angle(y + 1).sin().powi(2) - angle(y).sin().powi(2)) * row).sum();
    let scale = f64::from(width) / ((balance * level).element_sum() / 3.0);
    Panorama::of_texels(
        width,
        height,
        texels.iter().map(|texel| (scale * balance * *texel).as_vec3()).collect(),
    )
}

fn light(to: DVec3) -> DVec3 {
    let [floor, wall, ceiling] = WALLS;
    let towards = |end: DVec3, share: f64| wall + share * share * (3.0 - 2.0 * share) * (end - wall);
    let walls = if to.y < 0.0 { towards(floor, -to.y) } else { towards(ceiling, to.y) };
    BOXES.iter().fold(walls, |sum, soft| sum + soft.share(to) * soft.radiance)
}

impl SoftBox {
    /// How much of it shines from a direction: 1 in its middle, 0 beside it.
    fn share(&self, to: DVec3) -> f64 {
        let axis = self.towards.normalize();
        let right = DVec3::Y.cross(axis).normalize();
        let ahead = to.dot(axis);
        if ahead <= 0.0 {
            return 0.0;
        }
        let across = [right, axis.cross(right)].map(|side| (to.dot(side) / ahead).abs());
        (0..2).map(|i| fading(across[i] / self.half[i], self.fade)).product()
    }
}

/// Smoothly from 1 below 1 − `fade` to 0 above 1 + `fade`.
fn fading(at: f64, fade: f64) -> f64 {
    let x = ((1.0 + fade - at) / (2.0 * fade)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// ∫ L max(0, n · ω) dω.
    fn irradiance(panorama: &Panorama, normal: Vec3) -> Vec3 {
        let (width, height) = (panorama.width(), panorama.height());
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        texels
            .map(|(x, y)| {
                let to =
                    Panorama::direction([(x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32]);
                panorama.solid_angle(y) as f32 * normal.dot(to).max(0.0) * panorama.at(x, y)
            })
            .sum()
    }

    #[test]
    fn it_is_neutral_and_paper_in_it_is_white() {
        let studio = studio();
        let [up, all] = [
            irradiance(&studio, Vec3::Y),
            (0..128)
                .flat_map(|y| (0..256).map(move |x| (x, y)))
                .map(|(x, y)| studio.solid_angle(y) as f32 * studio.at(x, y))
                .sum(),
        ];
        assert!((up.element_sum() / 3.0 / std::f32::consts::PI - 1.0).abs() < 1e-3, "{up}");
        assert!(all.max_element() / all.min_element() < 1.0 + 1e-4, "{all}");
        assert!(up.max_element() / up.min_element() < 1.03, "{up}");
    }

    #[test]
    fn the_key_is_on_the_left_in_front_and_a_model_is_brighter_there() {
        let studio = studio();
        let texels = (0..128).flat_map(|y| (0..256).map(move |x| (x, y)));
        let (x, y) =
            texels.max_by(|a, b| studio.at(a.0, a.1).y.total_cmp(&studio.at(b.0, b.1).y)).expect("one");
        let to = Panorama::direction([(x as f32 + 0.5) / 256.0, (y as f32 + 0.5) / 128.0]);
        assert!(to.x < -0.3 && to.y > 0.3 && to.z > 0.3, "{to}");
        let at = |normal: Vec3| irradiance(&studio, normal.normalize()).y;
        let (left, front, right, back) =
            (at(Vec3::new(-1.0, 0.0, 1.0)), at(Vec3::Z), at(Vec3::new(1.0, 0.0, 1.0)), at(Vec3::NEG_Z));
        assert!(
            left > 1.2 * right && front > 1.1 * back && right > 0.5 * left,
            "{left} {front} {right} {back}"
        );
    }

    #[test]
    fn it_is_soft_everywhere() {
        let studio = studio();
        let texels = || (0..127).flat_map(|y| (0..256).map(move |x| (x, y)));
        let brightest = texels().map(|(x, y)| studio.at(x, y).max_element()).fold(0.0, f32::max);
        let darkest = texels().map(|(x, y)| studio.at(x, y).min_element()).fold(9.0, f32::min);
        assert!(
            darkest > 0.3 && brightest < 12.0 * darkest && brightest > 6.0 * darkest,
            "{darkest} {brightest}"
        );
        for (x, y) in texels() {
            for next in [((x + 1) % 256, y), (x, y + 1)] {
                let step = (studio.at(x, y) - studio.at(next.0, next.1)).abs().max_element();
                // Towards a pole columns run together; the picture is smooth over the sphere.
                assert!(step < 0.15 * brightest, "({x}, {y}): {step}");
            }
        }
    }
}
