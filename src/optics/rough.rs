//! What rough lobes have in common: a frame about the normal that turns light, and what becomes of it where normals differ.
//!
//! Seen from `wo`, light was turned about the shading normal, but about the geometric one where the smooth lobe does so too:
//! where the mirror direction lies behind the real surface, or `wo` itself behind the shading normal. What a lobe then sends
//! to where the two normals do not agree about the side is absorbed. Light that is shot takes the same ways backwards: about
//! either normal, for which of them turned it depends on where it goes.

use super::microfacet::Frame;
use super::{Normals, Pdf, Sample, Transport};
use glam::{DVec3, Vec3};

/// A finite lobe in the frame of the normal that turns light. `wo` has z > 0, and `front` says on which side of the surface it
/// is; `wi` has z < 0 where light comes through.
pub(super) trait Rough {
    /// Direction of the frame's x, in the world.
    fn tangent(&self) -> Vec3;

    /// True where light is scattered on that side.
    fn responds(&self, front: bool) -> bool;

    /// BSDF value in sr⁻¹ of light from `wi` that is seen from `wo`, as it is gathered, and the density in sr⁻¹ with which
    /// [`draw`](Self::draw) finds `wi`.
    fn scatter(&self, wo: DVec3, wi: DVec3, front: bool) -> (Vec3, f32);

    /// The square of the index on the other side over that on the side `front`.
    fn squared_index(&self, _front: bool) -> f32 {
        1.0
    }

    /// A direction nearly in proportion to what it carries; one with z = 0 is absorbed.
    fn draw(&self, wo: DVec3, u: [f32; 3], front: bool) -> DVec3;
}

/// The normal, on the side of `wo`, about which what is seen from `wo` was turned.
pub(super) fn turning_normal(normals: &Normals, wo: Vec3) -> Vec3 {
    let [shading, geometric] = both(normals, wo);
    if geometric == shading {
        return shading;
    }
    let cos = wo.dot(shading);
    let mirrored = 2.0 * cos * shading.dot(geometric) - wo.dot(geometric);
    if cos > 0.0 && mirrored > 0.0 { shading } else { geometric }
}

/// BSDF value in sr⁻¹ of light from `to` that is seen from `from`, cosine not included.
pub(super) fn eval(lobe: &impl Rough, normals: &Normals, from: Vec3, to: Vec3) -> Vec3 {
    seen(lobe, normals, from, to).0
}

/// Density in solid angle of [`sample`] where light is gathered.
pub(super) fn pdf(lobe: &impl Rough, normals: &Normals, from: Vec3, to: Vec3) -> f32 {
    seen(lobe, normals, from, to).1
}

/// A direction. None: absorbed.
pub(super) fn sample(
    lobe: &impl Rough,
    normals: &Normals,
    from: Vec3,
    transport: Transport,
    u: [f32; 3],
) -> Option<Sample> {
    let front = normals.is_front(from);
    let flat = normals.shading == normals.geometric;
    if transport == Transport::Shooting && !flat {
        return shot(lobe, normals, from, u);
    }
    if !lobe.responds(front) {
        return None;
    }
    let view = View::new(lobe, turning_normal(normals, from), from)?;
    let to = view.draw(lobe, u, front)?;
    let (value, pdf) = view.scatter(lobe, normals, to, front);
    let mut weight = value * (to.dot(normals.shading).abs() / pdf);
    if transport == Transport::Shooting && normals.is_front(to) != front {
        // What the eye at the other end gathers is the same but for the index.
        weight *= lobe.squared_index(front);
    }
    let geometric = view.up != both(normals, from)[0];
    (pdf > 0.0).then_some(Sample { to, weight, pdf: Pdf::SolidAngle(pdf), geometric })
}

/// A surface from one direction, above the normal that turns what is seen from there.
struct View {
    from: Vec3,
    up: Vec3,
    frame: Frame,
    wo: DVec3,
}

impl View {
    /// None: from below that normal.
    fn new(lobe: &impl Rough, up: Vec3, from: Vec3) -> Option<Self> {
        let frame = Frame::new(up, lobe.tangent());
        let wo = frame.local(from);
        (wo.z > 0.0).then_some(Self { from, up, frame, wo })
    }

    fn draw(&self, lobe: &impl Rough, u: [f32; 3], front: bool) -> Option<Vec3> {
        let wi = lobe.draw(self.wo, u, front);
        (wi.z != 0.0).then(|| self.frame.world(wi))
    }

    /// Value and density, zero where the two normals do not agree about the side.
    fn scatter(&self, lobe: &impl Rough, normals: &Normals, to: Vec3, front: bool) -> (Vec3, f32) {
        let wi = self.frame.local(to);
        let side = if wi.z > 0.0 { self.from } else { -self.from };
        if wi.z == 0.0 || !normals.counts(side, to) {
            return (Vec3::ZERO, 0.0);
        }
        let (value, pdf) = lobe.scatter(self.wo, wi, front);
        if self.up == both(normals, self.from)[0] {
            return (value, pdf);
        }
        // The cosine that is not included is the one about the shading normal.
        (value * (to.dot(self.up) / to.dot(normals.shading)).abs(), pdf)
    }

    /// Density in solid angle of [`draw`](Self::draw).
    fn density(&self, lobe: &impl Rough, to: Vec3, front: bool) -> f32 {
        lobe.scatter(self.wo, self.frame.local(to), front).1
    }
}

/// Value and density.
fn seen(lobe: &impl Rough, normals: &Normals, from: Vec3, to: Vec3) -> (Vec3, f32) {
    let front = normals.is_front(from);
    let view = || View::new(lobe, turning_normal(normals, from), from);
    let view = if lobe.responds(front) { view() } else { None };
    view.map_or((Vec3::ZERO, 0.0), |view| view.scatter(lobe, normals, to, front))
}

/// Where the two normals differ, light goes about either, since which of them turned it depends on where it is seen from.
fn shot(lobe: &impl Rough, normals: &Normals, from: Vec3, u: [f32; 3]) -> Option<Sample> {
    let front = normals.is_front(from);
    if !normals.same_side(from, from) {
        return None;
    }
    let ups = both(normals, from);
    let likely = ups.map(|up| likely(normals, from, up));
    let first = likely[0] / (likely[0] + likely[1]);
    let (shading, geometric) = (View::new(lobe, ups[0], from)?, View::new(lobe, ups[1], from)?);
    let (view, other, share, rest) = if u[2] < first {
        (shading, geometric, first, u[2] / first)
    } else {
        (geometric, shading, 1.0 - first, (u[2] - first) / (1.0 - first))
    };
    let to = view.draw(lobe, [u[0], u[1], rest], front)?;
    // What the eye at the other end gathers.
    let value = eval(lobe, normals, to, from);
    // What is drawn about one normal and below its horizon is lost, whatever the other says.
    let density = view.density(lobe, to, front);
    if density <= 0.0 || value == Vec3::ZERO {
        return None;
    }
    let pdf = share * density + (1.0 - share) * other.density(lobe, to, front);
    let weight = value * (normals.arrival(from) * to.dot(normals.geometric).abs() / pdf);
    Some(Sample { to, weight, pdf: Pdf::SolidAngle(pdf), geometric: view.up != ups[0] })
}

/// How much light from `from` is turned about `up`: what is rare is still tried.
fn likely(normals: &Normals, from: Vec3, up: Vec3) -> f32 {
    let mirrored = 2.0 * from.dot(up) * up - from;
    let gathered = normals.same_side(from, mirrored) && turning_normal(normals, mirrored) == up;
    if gathered { 1.0 } else { 0.1 }
}

/// The shading and the geometric normal on the side of `w`.
fn both(normals: &Normals, w: Vec3) -> [Vec3; 2] {
    let side = if normals.is_front(w) { 1.0 } else { -1.0 };
    [side * normals.shading, side * normals.geometric]
}
