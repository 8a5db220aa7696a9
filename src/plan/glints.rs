//! Caustics on glossy surfaces, for whom photons keep their directions.
//!
//! What a lens or a mirror sends of a small lamp to a surface that is glossy, but not so narrow that it makes caustics itself, is met by
//! camera paths hardly ever, and then as a single bright pixel; of a lamp without extent never. Photons meet it every time. What large
//! lamps send there camera paths find with less noise. So light is divided by where it comes from: of luminaires that *glare* photons
//! tell, of all others camera paths. Any division is right in the mean, as long as both sides make the same.

use super::flow::Flow;
use super::{Method, Settings};
use crate::optics::Lobe;
use crate::scene::{Environment, Luminaire, Material, Scene};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Which photons are kept with their directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Glints {
    /// By material: whether some lobe of it reads them.
    takes: Vec<bool>,
    glare: Glare,
}

/// Which luminaires glare.
#[derive(Clone, Debug, PartialEq)]
struct Glare {
    /// By material: those of the lamps that are made of it.
    materials: Vec<bool>,
    /// The environment, where the largest component of its radiance is above this.
    sky: f32,
}

/// All lamps of one material glare if they have less than this part of the disk that the scene fills.
const SMALL: f32 = 0.01;
/// A sun glares that covers less, sr.
const NARROW: f32 = 0.05;
/// An environment glares where it is so many times as bright as on average: in less than this part of it.
const BRIGHT: f32 = 10.0;

impl Glints {
    /// None where no photon would be kept.
    pub(super) fn of(scene: &Scene, flow: &Flow) -> Option<Self> {
        let takes = |material: &Material| {
            material.bsdf().terms.iter().any(|term| reads(&term.lobe) && flow.reads_glints(term))
        };
        let takes: Vec<bool> = scene.materials.iter().map(takes).collect();
        takes.contains(&true).then(|| Self { takes, glare: Glare::of(scene) })
    }

    /// True where light of any luminaire may come by them.
    pub(super) fn may_be(scene: &Scene, settings: &Settings) -> bool {
        let (glare, sky) = (Glare::of(scene), &scene.environment);
        let glares = |luminaire: &Luminaire| match luminaire {
            Luminaire::Triangle { triangle, .. } => {
                glare.materials[scene.surface_of(*triangle).material as usize]
            }
            Luminaire::Environment { .. } => sky.as_ref().is_some_and(|sky| sky.as_constant().is_none()),
            Luminaire::Sun { versine, .. } => is_narrow(*versine),
            _ => true,
        };
        settings.method == Method::Photon && !settings.atlas && scene.luminaires.iter().any(glares)
    }

    /// True where lobes of this material that can read photons with directions do so.
    pub fn are_read_by(&self, material: u32) -> bool {
        self.takes[material as usize]
    }

    /// True for a lamp of this material.
    pub fn is_glaring(&self, material: u32) -> bool {
        self.glare.materials[material as usize]
    }

    /// True for a luminaire at infinity in the unit direction `to`.
    pub fn is_glaring_sky(&self, scene: &Scene, luminaire: &Luminaire, to: Vec3) -> bool {
        match luminaire {
            Luminaire::Environment { .. } => {
                scene.environment.as_ref().is_some_and(|sky| brightness(sky, to) > self.glare.sky)
            }
            Luminaire::Sun { versine, .. } => is_narrow(*versine),
            _ => true,
        }
    }

    /// True for a path that starts at a luminaire in this direction.
    pub fn is_of_glare(&self, scene: &Scene, luminaire: &Luminaire, direction: Vec3) -> bool {
        match luminaire {
            Luminaire::Triangle { triangle, .. } => self.is_glaring(scene.surface_of(*triangle).material),
            _ => self.is_glaring_sky(scene, luminaire, -direction),
        }
    }
}

/// True for lobes that read photons with their directions.
pub fn reads(lobe: &Lobe) -> bool {
    matches!(lobe, Lobe::Glossy(_) | Lobe::Sheen(_)) && !lobe.is_narrow()
}

impl Glare {
    fn of(scene: &Scene) -> Self {
        let (_, radius) = scene.bounding_sphere();
        let mut areas = vec![0.0; scene.materials.len()];
        for luminaire in &scene.luminaires {
            if let Luminaire::Triangle { triangle, area, .. } = luminaire {
                areas[scene.surface_of(*triangle).material as usize] += area;
            }
        }
        let materials = areas.iter().map(|area| *area < SMALL * PI * radius * radius).collect();
        let sky = scene.environment.as_ref().map_or(f32::INFINITY, |sky| {
            let fluence = sky.fluence();
            BRIGHT * fluence.invisible.max(fluence.visible).max_element() / (2.0 * TAU)
        });
        Self { materials, sky }
    }
}

fn is_narrow(versine: f32) -> bool {
    TAU * versine < NARROW
}

fn brightness(sky: &Environment, to: Vec3) -> f32 {
    let light = sky.radiance(to);
    light.invisible.max(light.visible).max_element()
}
