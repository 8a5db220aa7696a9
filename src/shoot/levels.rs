//! Which gather radius fits a caustic photon: the one whose disk holds enough photons of its beam.

use crate::plan::{Frame, LEVELS, Plan};
use crate::scene::View;
use glam::Vec3;

/// Photons of a pass that one beam should bring to a gather disk.
pub(super) const ENOUGH: f32 = 20.0;

/// Which gather radius fits a caustic photon.
pub(super) struct Levels {
    view: View,
    height: u32,
    /// Area of a disk that holds enough, over that which a path covers.
    disk: f32,
    /// The sharpest radius in footprints.
    sharp: f32,
    /// Levels for each factor of e between radii; zero where there is but one radius.
    per_e: f32,
}

impl Levels {
    /// Of a frame that shoots so many paths a pass.
    pub fn of(plan: &Plan, frame: &Frame, paths: u32) -> Self {
        let Frame { width, height, .. } = *frame;
        let radii = frame.caustic_radii();
        let (wide, sharp) = (radii[0], radii[LEVELS - 1]);
        let range = (wide / sharp).ln();
        Self {
            view: plan.scene.camera.view(width as f32 / height as f32),
            height,
            disk: ENOUGH / (std::f32::consts::PI * paths as f32),
            sharp,
            per_e: if range > 0.0 { (LEVELS - 1) as f32 / range } else { 0.0 },
        }
    }

    /// The level of a photon whose beam covers `area` (m²), by `u` in [0, 1): so that the mean radius follows the beam, and nothing
    /// breaks off where levels meet.
    pub fn of_beam(&self, position: Vec3, area: f32, u: f32) -> u8 {
        let radius = (self.disk * area).sqrt() / self.view.footprint_at(position, self.height);
        let sharper = self.per_e * (radius / self.sharp).max(f32::MIN_POSITIVE).ln();
        let most = (LEVELS - 1) as f32;
        // The sum may round up.
        (most - sharper.clamp(0.0, most) + u).min(most) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Projection};

    #[test]
    fn radii_follow_the_beam() {
        let camera = Camera::look_at(Vec3::ZERO, -Vec3::Z, Vec3::Y, Projection::Perspective { yfov: 0.7 });
        let (sharp, wide, paths) = (2.0_f32, 18.0_f32, 1000.0);
        let disk = ENOUGH / (std::f32::consts::PI * paths);
        let levels =
            Levels { view: camera.view(1.0), height: 100, disk, sharp, per_e: 2.0 / (wide / sharp).ln() };
        let position = Vec3::new(0.0, 1.0, -7.0);
        let footprint = levels.view.footprint_at(position, 100);
        // The area of the beam of which a disk of this radius in footprints holds enough.
        let area = |radius: f32| (radius * footprint).powi(2) / disk;
        for (radius, level) in [(0.0, 2), (1.0, 2), (18.0, 0), (1e4, 0)] {
            for u in [0.0, 0.5, 1.0_f32.next_down()] {
                assert_eq!(levels.of_beam(position, area(radius), u), level, "{radius}");
            }
        }
        // Between two radii chance takes either, so that logarithms are met in the mean.
        let taken = |radius, u| 18.0 / 3.0_f32.powi(levels.of_beam(position, area(radius), u).into());
        for radius in [2.2, 4.0, 6.0, 9.0, 15.0_f32] {
            let n = 1000;
            let mean =
                (0..n).map(|i| taken(radius, (i as f32 + 0.5) / n as f32).ln()).sum::<f32>() / n as f32;
            assert!((mean - radius.ln()).abs() < 2e-3, "{radius}: {}", mean.exp());
        }
        let even = Levels { per_e: 0.0, ..levels };
        assert_eq!(even.of_beam(position, 0.0, 0.5), even.of_beam(position, area(1e4), 0.5));
    }
}
