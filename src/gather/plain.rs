//! The tally of a picture: it adds up what each pixel shows, by class of light path.

use super::again::{Again, Sequence};
use super::direct::{Advice, Begun, Open};
use super::shared::{Place, Shared};
use super::{Density, Here, Irradiance, Pixel, Tally};
use crate::clearance::Reach;
use crate::light::{Light, Power, Row};
use crate::optics::{Lobe, Term};
use crate::photon::PathClass;
use crate::plan::{Frame, Plan, reads_glints};
use crate::sampling::Rng;
use crate::scene::Material;
use glam::Vec3;

/// Where photons were asked for.
#[derive(PartialEq)]
struct Asked {
    triangle: u32,
    /// The point and its normal.
    place: [Vec3; 2],
    disk: (f32, Reach),
    most: u16,
}

/// Adds up what a tile of pixels shows.
pub(super) struct Plain<'a, D: Density, const R: usize> {
    pub plan: &'a Plan,
    pub frame: &'a Frame,
    /// Some light is re-radiated.
    fluoresces: bool,
    /// The last answer, where some light is.
    arrived: Option<(Asked, [Irradiance<D::Power>; 3])>,
    /// The last place of a diffuse lobe, where some light is, and what is known of its connections.
    place: Option<Place>,
    pub shared: Shared,
    maps: &'a D,
    nearby: D::Nearby,
    /// The pixel under way, in its tile.
    pixel: usize,
    /// Hits of the tile that may connect more.
    pub open: Vec<Begun<R>>,
    pub sampled: Vec<[f32; 3]>,
    /// The path under way is one of several through its pixel.
    pub again: Option<Again>,
    /// What pixels around each of the tile say about it.
    pub advice: Vec<Advice>,
}

impl<'a, D: Density, const R: usize> Plain<'a, D, R> {
    pub fn new(plan: &'a Plan, frame: &'a Frame, maps: &'a D) -> Self {
        let (nearby, open, sampled, advice) = (D::Nearby::default(), Vec::new(), Vec::new(), Vec::new());
        let fluoresces = plan.scene.fluoresces();
        let (arrived, place, shared) = (None, None, Shared::default());
        Self {
            plan,
            frame,
            fluoresces,
            arrived,
            place,
            shared,
            maps,
            nearby,
            pixel: 0,
            open,
            sampled,
            again: None,
            advice,
        }
    }

    /// What comes now is for this pixel of the tile.
    pub fn begin(&mut self, pixel: usize) {
        self.pixel = pixel;
    }
}

impl<D: Density, const R: usize> Plain<'_, D, R> {
    /// What photons bring to a surface: asked once for all its diffuse lobes, of which there are several where it fluoresces.
    fn arrived(&mut self, here: &Here<'_, R>) -> [Irradiance<D::Power>; 3] {
        let (place, disk, most) =
            ((here.point, here.normal()), (here.footprint, here.reach), here.most_counted());
        let asked =
            Asked { triangle: here.point.triangle, place: [here.point.position, place.1], disk, most };
        match &self.arrived {
            Some((known, irradiance)) if self.fluoresces && *known == asked => *irradiance,
            _ => {
                let irradiance = self.maps.irradiance(&mut self.nearby, place, disk, most);
                if self.fluoresces {
                    self.arrived = Some((asked, irradiance));
                }
                irradiance
            }
        }
    }

    /// What a glossy lobe shows of caustics that photons have directions of.
    fn read_glints(&mut self, here: &Here<'_, R>, lobe: &Lobe, rows: [Row; R], pixel: &mut Pixel<R>) {
        let Here { point, wo, .. } = *here;
        let (mut whole, mut inner) = (D::Power::default(), D::Power::default());
        let (place, disk) = ((point, here.normal()), (here.footprint, here.reach));
        self.maps.glints(&mut self.nearby, place, disk, here.most_counted(), |wi, all, near| {
            let f = lobe.eval(&point.normals, wo, wi);
            whole += all.filtered(f);
            inner += near.filtered(f);
        });
        let class = here.class(PathClass::Caustic);
        for (parts, row) in pixel.parts.iter_mut().zip(rows) {
            parts.add(class, whole.read(row), row.turn.is_reradiated());
        }
        pixel.bias += (whole + inner.scaled(-1.0)).scaled(2.0).read(rows[0]);
    }
}

impl<D: Density, const R: usize> Tally<R> for Plain<'_, D, R> {
    type Mark = ();

    fn crossed((): (), _: &Material) {}

    fn reflected((): (), _: &[Row; R], _: &Material) {}

    fn wants(&self, (): ()) -> bool {
        true
    }

    fn emitted(&mut self, rows: &[Row; R], (): (), radiance: Light, scattered: bool, pixel: &mut Pixel<R>) {
        for (parts, row) in pixel.parts.iter_mut().zip(rows) {
            parts.add_emitted(*row * radiance, scattered, row.turn.is_reradiated());
        }
    }

    fn reach(&mut self, here: &Here<'_, R>) -> Reach {
        let place = (here.point, here.normal());
        self.maps.reach(&mut self.nearby, place, here.footprint, here.is_scattered())
    }

    fn read(
        &mut self,
        here: &Here<'_, R>,
        term: &Term,
        (rows, ()): ([Row; R], ()),
        pixel: &mut Pixel<R>,
        rng: &mut Rng,
    ) {
        let Here { point, wo, .. } = *here;
        if here.connects(term, self.frame.direct) {
            let again = self.again.as_mut().filter(|_| !here.is_scattered());
            let new = || again.map_or_else(|| Sequence::alone(rng), Again::next);
            let (place, numbers) = if self.fluoresces && term.lobe.as_diffuse().is_some() {
                let (place, numbers) = Place::of(&mut self.place, (self.pixel, point, wo), new);
                (Some(place), numbers)
            } else {
                (None, new())
            };
            let absorption = [wo, -wo].map(|side| here.absorption(self.plan, side));
            let (pixel_here, term, point) = (self.pixel, *term, *point);
            let open = Open { pixel: pixel_here, rows, term, point, wo, absorption, numbers, place };
            if here.is_scattered() {
                self.connect_once(&open, pixel);
            } else {
                self.connect(open, pixel);
            }
        }
        let Some(diffuse) = term.lobe.as_diffuse() else {
            if here.glints && reads_glints(&term.lobe) {
                self.read_glints(here, &term.lobe, rows, pixel);
            }
            return;
        };
        let f = diffuse.towards(&point.normals, wo);
        let irradiance = self.arrived(here);
        for (class, irradiance) in PathClass::ALL.into_iter().zip(irradiance) {
            let (value, class) = (irradiance.value.filtered(f), here.class(class));
            for (parts, row) in pixel.parts.iter_mut().zip(rows) {
                parts.add(class, value.read(row), row.turn.is_reradiated());
                if self.fluoresces && !row.turn.is_reradiated() {
                    parts.fluorescent += irradiance.reradiated.filtered(f).read(row);
                }
            }
            pixel.bias += irradiance.bias.filtered(f).read(rows[0]);
            pixel.one_more += irradiance.one_more.filtered(f).read(rows[0]).abs().max_element();
        }
    }
}
