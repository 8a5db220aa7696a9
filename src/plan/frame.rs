//! How passes of a plan are rendered: what pilots learn, and what may differ from pass to pass or from film to film.

use super::{Direct, LEVELS, Method, PhotonPlan, Plan, Settings};
use crate::connect::Sights;
use crate::stop::Stop;
use std::sync::Arc;

/// How a pass of a [`Plan`] is rendered: the film, the gather radii, and the photons that are shot.
///
/// The plan itself never changes. [`asked`](Self::asked) is what the plan's settings say; [`learn`](crate::pilot::learn) adds what
/// pilots find out. Whoever wants a smaller or sharper pass of the same plan varies a frame.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Film width in pixels.
    pub width: u32,
    /// Film height in pixels.
    pub height: u32,
    /// Camera samples per pixel and pass of the path tracers.
    pub samples: u32,
    /// First gather radius of caustics where they are sharpest, in pixel footprints.
    pub caustic_radius: f32,
    /// First gather radius of inter-reflection and of direct light by photons, in pixel footprints.
    pub indirect_radius: f32,
    /// Who serves direct light: never [`Direct::Auto`].
    pub direct: Direct,
    /// Why.
    pub direct_because: String,
    /// None: no photons and no map.
    pub photons: Option<PhotonPlan>,
    /// What is seen from where, if connections seldom see what they are made to. None: they choose luminaires by power.
    pub sights: Option<Arc<Sights>>,
    /// Looked at within a pass.
    pub stop: Stop,
}

impl Frame {
    /// As the plan's settings ask for, before any pilot.
    pub fn asked(plan: &Plan) -> Self {
        let Settings { width, height, samples, caustic_radius, indirect_radius, .. } = plan.settings;
        Self {
            width,
            height,
            samples,
            caustic_radius,
            indirect_radius,
            direct: plan.direct,
            direct_because: plan.direct_because.into(),
            photons: plan.photons.clone(),
            sights: None,
            stop: Stop::default(),
        }
    }

    /// Pixels of the film.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// What it takes in memory that pilots learned.
    pub fn learned_bytes(&self) -> usize {
        let starts = self.photons.as_ref().and_then(|photons| photons.starts.as_ref());
        starts.map_or(0, |starts| starts.bytes()) + self.sights.as_ref().map_or(0, |sights| sights.bytes())
    }

    /// Width over height.
    pub fn aspect(&self) -> f32 {
        self.width as f32 / self.height as f32
    }

    /// Camera samples of a pass, in all pixels.
    pub fn camera_samples(&self, method: Method) -> u64 {
        let each = if method.shoots() { 1 } else { self.samples };
        self.pixels() as u64 * u64::from(each)
    }

    /// First gather radii of caustics in pixel footprints, from the widest, which is that of inter-reflection.
    pub fn caustic_radii(&self) -> [f32; LEVELS] {
        let Self { caustic_radius: sharp, indirect_radius: wide, .. } = *self;
        [wide, (sharp * wide).sqrt(), sharp]
    }

    /// With gather radii that are larger by a factor.
    #[must_use]
    pub fn with_radii(&self, by: f32) -> Self {
        let (caustic_radius, indirect_radius) = (by * self.caustic_radius, by * self.indirect_radius);
        Self { caustic_radius, indirect_radius, ..self.clone() }
    }
}
