//! The paper's five points in place of a rectangular lamp (§3).

use glam::Vec3;
use halflight::light::Light;
use halflight::scene::{Luminaire, Scene};

/// Paper §3: a₀, a₁, a₂ of eq. 24.
const ATTENUATION: [f32; 3] = [0.0, 0.0, 0.0025];
/// Paper §3: e of eq. 24.
const EXPONENT: f32 = 1.0;
/// Centre and corner tiles of a 3×3 checkerboard, in units of the lamp's sides.
const TILES: [[f32; 2]; 5] = [
    [0.5, 0.5],
    [1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 5.0 / 6.0],
    [5.0 / 6.0, 1.0 / 6.0],
    [5.0 / 6.0, 5.0 / 6.0],
];

/// The scene with its one rectangular lamp (two triangles) replaced by five Warn spots, and their intensity, W sr⁻¹ times a₂.
///
/// Nothing is fitted. A piece dA of a lamp of radiance L gives the irradiance L cos θ' cos θ dA / r². A point of eq. 24 with
/// e = 1 and a₀ = a₁ = 0 gives I cos θ' cos θ / (a₂ r²). Five points that stand for all of A each have I = a₂ L A / 5.
pub fn five_points(scene: &Scene) -> (Scene, Vec3) {
    let [first, second] = scene.luminaires[..] else { panic!("a lamp of two triangles") };
    let (
        Luminaire::Triangle { triangle: one, emission, area: a, .. },
        Luminaire::Triangle { triangle: two, area: b, .. },
    ) = (first, second)
    else {
        panic!("a lamp of two triangles");
    };
    // As the builder of quadrilaterals divides them: [p, q, r] and [p, r, s].
    let ([p, q, _], [_, _, s]) = (scene.mesh.corners(one), scene.mesh.corners(two));
    let intensity = ATTENUATION[2] * (a + b) / TILES.len() as f32 * emission.radiance.invisible;
    let mut five = scene.clone();
    five.name = format!("{} under five points", scene.name);
    five.materials.iter_mut().for_each(|material| material.emission = None);
    five.luminaires = TILES
        .iter()
        .map(|[x, y]| Luminaire::Warn {
            position: p + *x * (q - p) + *y * (s - p),
            direction: scene.mesh.normal(one),
            intensity: Light::new(intensity, Vec3::ZERO),
            exponent: EXPONENT,
            attenuation: ATTENUATION,
        })
        .collect();
    (five, intensity)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_away_five_points_are_the_lamp() {
        let scene = Scene::load("builtin:two-spheres").expect("built in");
        let (five, _) = five_points(&scene);
        let (mut lamp, mut points) = (0.0, 0.0);
        // Irradiance on a surface that faces straight up, 100 m below.
        let below = |position: Vec3| position.y - 100.0 * Vec3::Y.y;
        for luminaire in &scene.luminaires {
            if let Luminaire::Triangle { area, emission, .. } = luminaire {
                lamp += emission.radiance.invisible.x * area / 1e4;
            }
        }
        for luminaire in &five.luminaires {
            let Luminaire::Warn { position, intensity, attenuation, direction, .. } = luminaire else {
                panic!("a Warn spot");
            };
            assert!(direction.distance(Vec3::NEG_Y) < 1e-6);
            let r = position.y - below(*position);
            points += intensity.invisible.x / (attenuation[2] * r * r);
        }
        assert!((points / lamp - 1.0).abs() < 1e-5, "{points} against {lamp}");
        let centre = five.luminaires.iter().map(|luminaire| match luminaire {
            Luminaire::Warn { position, .. } => *position,
            _ => Vec3::NAN,
        });
        let centre: Vec3 = centre.sum::<Vec3>() / 5.0;
        let [Luminaire::Triangle { triangle, .. }, _] = scene.luminaires[..] else { panic!("a lamp") };
        let [p, _, r] = scene.mesh.corners(triangle);
        assert!(centre.distance(0.5 * (p + r)) < 1e-6);
    }
}
