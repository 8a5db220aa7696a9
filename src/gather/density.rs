//! Who says how much light arrives that is not connected.

use super::{Irradiance, Maps, Nearby};
use crate::clearance::Reach;
use crate::light::Power;
use crate::photon::{PathClass, Photons};
use crate::photon_map::NearestMap;
use crate::plan::Settings;
use crate::scene::SurfacePoint;
use glam::Vec3;

/// Density estimation: what the photons of a pass say of the light that arrives at a point.
pub trait Density: Sync {
    /// What photons carry.
    type Power: Power;
    /// What is kept from one question to the next. It changes no answer.
    type Nearby: Default;

    /// How much of a disk at a point can be trusted; see [`Maps::reach`].
    fn reach(
        &self,
        nearby: &mut Self::Nearby,
        place: (&SurfacePoint, Vec3),
        footprint: f32,
        scattered: bool,
    ) -> Reach;

    /// Irradiance (W m⁻²) by light of each class, by [`PathClass`], on the side of a normal; see [`Maps::irradiance`].
    fn irradiance(
        &self,
        nearby: &mut Self::Nearby,
        place: (&SurfacePoint, Vec3),
        disk: (f32, Reach),
        most_reflections: u16,
    ) -> [Irradiance<Self::Power>; 3];

    /// Caustics of what glares by their directions, for glossy lobes; see [`Maps::glints`]. None as a rule.
    fn glints(
        &self,
        _nearby: &mut Self::Nearby,
        _place: (&SurfacePoint, Vec3),
        _disk: (f32, Reach),
        _most_reflections: u16,
        _each: impl FnMut(Vec3, Self::Power, Self::Power),
    ) {
    }
}

impl<P: Power> Density for Maps<'_, P> {
    type Power = P;
    type Nearby = Nearby;

    fn reach(
        &self,
        nearby: &mut Nearby,
        (point, normal): (&SurfacePoint, Vec3),
        footprint: f32,
        scattered: bool,
    ) -> Reach {
        Maps::reach(self, nearby, point, normal, footprint, scattered)
    }

    fn irradiance(
        &self,
        nearby: &mut Nearby,
        (point, normal): (&SurfacePoint, Vec3),
        disk: (f32, Reach),
        most_reflections: u16,
    ) -> [Irradiance<P>; 3] {
        Maps::irradiance(self, nearby, point, normal, disk, most_reflections)
    }

    fn glints(
        &self,
        nearby: &mut Nearby,
        place: (&SurfacePoint, Vec3),
        disk: (f32, Reach),
        most_reflections: u16,
        each: impl FnMut(Vec3, P, P),
    ) {
        Maps::glints(self, nearby, place, disk, most_reflections, each);
    }
}

/// The maps of the textbook: one of caustics and a global one, less the direct light that connections serve; where photons serve it,
/// that is in a third. No place is too crowded for them, and they do not know their bias.
pub struct NearestMaps<P> {
    by_class: [NearestMap<P>; 3],
}

impl<P: Power> NearestMaps<P> {
    /// Builds the maps of one pass.
    pub fn build(photons: Photons<P>, settings: &Settings) -> Self {
        let map = |photons| NearestMap::build(photons, settings.nearest, settings.cone);
        Self { by_class: photons.by_class.map(map) }
    }
}

impl<P: Power> Density for NearestMaps<P> {
    type Power = P;
    type Nearby = ();

    fn reach(&self, (): &mut (), _: (&SurfacePoint, Vec3), _: f32, _: bool) -> Reach {
        Reach::Simple(1.0)
    }

    fn irradiance(
        &self,
        (): &mut (),
        (point, normal): (&SurfacePoint, Vec3),
        _: (f32, Reach),
        most_reflections: u16,
    ) -> [Irradiance<P>; 3] {
        PathClass::ALL.map(|class| {
            let map = &self.by_class[class as usize];
            let value = map.irradiance(point.position, normal, most_reflections);
            Irradiance { value, ..Irradiance::default() }
        })
    }
}
