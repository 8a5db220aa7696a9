//! How far lines must be followed: through surfaces, or to the first; for shadows, or not at all.

use super::flow::{Flow, passes};
use super::omission::{Omission, Omittable};
use super::shrink::only;
use super::{Direct, Plan, Settings};
use crate::connect::summed_and_others;
use crate::light::{Matrix, Row};
use crate::optics::Lobe;
use crate::rays::{Hit, Ray, Rays, Segment};
use crate::scene::{Luminaire, Scene};
use glam::Vec3;
use std::collections::BTreeSet;

/// Whether the visibility of direct light must be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// Every surface lets through all that is read: nothing to ask.
    Everywhere,
    /// The product of the straight matrices along the connection.
    Transmittance,
}

/// Which halves go straight through some surface, as far as a row can read them behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Through {
    pub invisible: bool,
    pub visible: bool,
}

/// Surfaces that cast no shadow are left out of shadow queries where they are at least this share of all triangles:
/// below, a second index of the others costs more than it saves.
const WORTH_AN_INDEX: f64 = 0.25;

impl Through {
    /// Everything is looked through, needed or not.
    pub const ALL: Self = Self { invisible: true, visible: true };

    fn of(scene: &Scene) -> Self {
        let straights = || scene.materials.iter().map(|material| material.bsdf.straight.rows());
        Self {
            invisible: straights().any(|rows| rows[0] != [0.0; 2]),
            visible: straights().any(|rows| rows[1] != [0.0; 2]),
        }
    }
}

/// What camera lines go through, and the index for queries of all lines.
pub(super) fn first_hits(
    scene: &Scene,
    rays: Rays,
    flow: &Flow,
    settings: &Settings,
    omissions: &mut Vec<Omission>,
) -> (Rays, Through) {
    if settings.keeps(Omittable::AllHits) {
        return (rays.without_shortcuts(), Through::ALL);
    }
    let through = Through::of(scene);
    let reads = |through: Through| {
        (flow.seen.invisible() && through.invisible) || (flow.seen.visible() && through.visible)
    };
    let reason = match through {
        Through { invisible: false, visible: false } => {
            "no surface lets any light straight through: a line ends at its first surface"
        }
        _ if !reads(through) => {
            "no surface lets straight through what camera rays read: they end at their first surface"
        }
        Through { visible: false, .. } => {
            "no surface lets straight through the visible half: camera rays end at their first surface as long as \
             they read that half alone"
        }
        _ => return (rays, through),
    };
    omissions.push(Omittable::AllHits.because(reason));
    (rays, through)
}

/// How connections see, and the index they look through where it is not that of all triangles.
pub(super) fn visibility(
    scene: &Scene,
    flow: &Flow,
    settings: &Settings,
    omissions: &mut Vec<Omission>,
) -> (Visibility, Option<Rays>) {
    // What lies farther from the camera hit may be read in other halves than what is gathered there.
    let casts: Vec<bool> =
        scene.materials.iter().map(|material| !passes(&material.bsdf, flow.linked)).collect();
    if !settings.keeps(Omittable::Visibility) && !casts.contains(&true) {
        omissions.push(Omittable::Visibility.because(
            "every surface lets straight through all of the light that is read behind it, so no surface can shadow \
             another",
        ));
        return (Visibility::Everywhere, None);
    }
    if settings.keeps(Omittable::Casters) {
        return (Visibility::Transmittance, None);
    }
    let triangles = scene.mesh.triangles.len();
    let caster = |triangle: u32| casts[scene.surface_of(triangle).material as usize];
    let casters = (0..triangles as u32).filter(|triangle| caster(*triangle)).count();
    if (triangles - casters) as f64 <= WORTH_AN_INDEX * triangles as f64 {
        return (Visibility::Transmittance, None);
    }
    omissions.push(Omittable::Casters.because(format!(
        "{} of {triangles} triangles let straight through all that is read behind them: connections look through the \
         others alone",
        triangles - casters
    )));
    let rays = Rays::build(&only(scene, caster));
    let rays = if settings.keeps(Omittable::AllHits) { rays.without_shortcuts() } else { rays };
    (Visibility::Transmittance, Some(rays))
}

/// Up to so many triangles shine in closed form at every hit: each costs half a connection.
const CLOSED_FORMS: usize = 8;

/// The luminaires, by index, whose irradiance is known wherever nothing hides them.
pub(super) fn closed_form(
    scene: &Scene,
    settings: &Settings,
    visibility: Visibility,
    omissions: &mut Vec<Omission>,
) -> Vec<u32> {
    let (_, others) = summed_and_others(scene);
    let even_sky = scene.environment.as_ref().is_some_and(|environment| environment.as_constant().is_some());
    let has_form = |i: &u32| match scene.luminaires[*i as usize] {
        Luminaire::Triangle { part: None, .. } => true,
        Luminaire::Environment { .. } => even_sky,
        _ => false,
    };
    let lobes = || scene.materials.iter().flat_map(|material| &material.bsdf.terms).map(|term| &term.lobe);
    let asked = settings.direct == Direct::Connection && !settings.atlas;
    let fits = asked && (1..=CLOSED_FORMS).contains(&others.len());
    if settings.keeps(Omittable::LightSamples)
        || !fits
        || !others.iter().all(has_form)
        || !lobes().any(Lobe::is_lambert)
    {
        return Vec::new();
    }
    let triangles = others.iter().filter(|i| !scene.luminaires[**i as usize].is_sky()).count();
    let sky = if triangles < others.len() { " and the even sky" } else { "" };
    let rest = match visibility {
        Visibility::Everywhere => "and nothing hides them: direct light has no noise",
        Visibility::Transmittance => "so only what hides them is found by connections",
    };
    omissions.push(Omittable::LightSamples.because(format!(
        "on diffuse surfaces the irradiance of {} has a closed form (Lambert's), {rest}",
        if triangles == 0 {
            "the even sky".into()
        } else {
            format!("{triangles} triangles of luminaires{sky}")
        }
    )));
    others
}

/// Lines on each side of the grid that finds what is looked through.
const LOOKS: u32 = 32;

impl Plan {
    /// What light that travels a connection is multiplied by: the ordered product of the straight matrices, and what is left of each
    /// colour on the way; `absorption` (m⁻¹) is that where it arrives.
    pub fn visibility_along(&self, segment: &Segment, absorption: Vec3) -> (Matrix, Vec3) {
        if self.rays.absorb() {
            return self.rays.passed(&self.scene, segment, absorption);
        }
        let through = match self.visibility {
            Visibility::Everywhere => Matrix::IDENTITY,
            Visibility::Transmittance => self.casters.as_ref().unwrap_or(&self.rays).transmittance(segment),
        };
        (through, Vec3::ONE)
    }

    /// Names of surfaces through whose backs the camera looks, as far as a grid of lines finds them.
    pub fn looked_through(&self) -> Vec<String> {
        let Settings { width, height, .. } = self.settings;
        let view = self.scene.camera.view(width as f32 / height as f32);
        let place = |i: u32| (i as f32 + 0.5) / LOOKS as f32;
        let back = |i: u32| {
            let (origin, direction) = view.ray(place(i % LOOKS), place(i / LOOKS));
            let ray = Ray { origin, direction, t_max: f32::INFINITY };
            let hit = self.rays.closest(&ray)?;
            (self.rays.closest_seen(&ray) != Some(hit)).then_some(hit.triangle)
        };
        let surfaces: BTreeSet<u32> = (0..LOOKS * LOOKS)
            .filter_map(back)
            .map(|triangle| self.scene.mesh.surface[triangle as usize])
            .collect();
        surfaces.into_iter().map(|surface| self.scene.surfaces[surface as usize].name.clone()).collect()
    }

    /// What the indices of triangles and rims take in memory.
    pub fn index_bytes(&self) -> usize {
        self.rays.bytes()
            + self.casters.as_ref().map_or(0, Rays::bytes)
            + self.rims.bytes()
            + self.clearance.bytes()
    }

    /// The surfaces on a line from the camera, in order, as far as any of `rows` can read: the first alone, where
    /// nothing lets through what they read. Of a line that is `seen` backs that the eye does not see are not among them.
    pub fn look_along(&self, ray: &Ray, rows: &[Row], seen: bool, hits: &mut Vec<Hit>) {
        let Through { invisible, visible } = self.through;
        let goes_through = (invisible && rows.iter().any(|row| row.invisible != Vec3::ZERO))
            || (visible && rows.iter().any(|row| row.visible != Vec3::ZERO));
        match (goes_through, seen) {
            (true, true) => self.rays.crossings_seen(ray, hits),
            (true, false) => self.rays.crossings(ray, hits),
            (false, seen) => {
                hits.clear();
                hits.extend(if seen { self.rays.closest_seen(ray) } else { self.rays.closest(ray) });
            }
        }
    }
}
