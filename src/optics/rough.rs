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
    if transport == Transport::Shooting {
        return shot(lobe, normals, from, u);
    }
    let front = normals.is_front(from);
    if !lobe.responds(front) {
        return None;
    }
    let up = turning_normal(normals, from);
    let to = drawn(lobe, up, from, u, front)?;
    let (value, pdf) = seen(lobe, normals, from, to);
    let weight = value * (to.dot(normals.shading).abs() / pdf);
    (pdf > 0.0).then_some(Sample {
        to,
        weight,
        pdf: Pdf::SolidAngle(pdf),
        geometric: up != both(normals, from)[0],
    })
}

/// Value and density, zero where the two normals do not agree about the side.
fn seen(lobe: &impl Rough, normals: &Normals, from: Vec3, to: Vec3) -> (Vec3, f32) {
    let nothing = (Vec3::ZERO, 0.0);
    let front = normals.is_front(from);
    if !lobe.responds(front) {
        return nothing;
    }
    let up = turning_normal(normals, from);
    let frame = Frame::new(up, lobe.tangent());
    let (wo, wi) = (frame.local(from), frame.local(to));
    let side = if wi.z > 0.0 { from } else { -from };
    if wo.z <= 0.0 || wi.z == 0.0 || !normals.counts(side, to) {
        return nothing;
    }
    let (value, pdf) = lobe.scatter(wo, wi, front);
    if up == both(normals, from)[0] {
        return (value, pdf);
    }
    // The cosine that is not included is the one about the shading normal.
    (value * (to.dot(up) / to.dot(normals.shading)).abs(), pdf)
}

fn shot(lobe: &impl Rough, normals: &Normals, from: Vec3, u: [f32; 3]) -> Option<Sample> {
    let front = normals.is_front(from);
    if !normals.same_side(from, from) {
        return None;
    }
    let ups = both(normals, from);
    let likely = if ups[0] == ups[1] { [1.0, 0.0] } else { ups.map(|up| likely(normals, from, up)) };
    let first = likely[0] / (likely[0] + likely[1]);
    let (up, rest) =
        if u[2] < first { (ups[0], u[2] / first) } else { (ups[1], (u[2] - first) / (1.0 - first)) };
    let to = drawn(lobe, up, from, [u[0], u[1], rest], front)?;
    let density = |up| {
        let frame = Frame::new(up, lobe.tangent());
        lobe.scatter(frame.local(from), frame.local(to), front).1
    };
    // What is drawn about one normal and below its horizon is lost, whatever the other says.
    if density(up) <= 0.0 {
        return None;
    }
    let mut pdf = first * density(ups[0]);
    if first < 1.0 {
        pdf += (1.0 - first) * density(ups[1]);
    }
    // What the eye at the other end gathers.
    let value = eval(lobe, normals, to, from);
    let cosine = to.dot(normals.geometric).abs() / pdf;
    let geometric = up != ups[0];
    (pdf > 0.0 && value != Vec3::ZERO).then(|| Sample {
        to,
        weight: value * (normals.arrival(from) * cosine),
        pdf: Pdf::SolidAngle(pdf),
        geometric,
    })
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

fn drawn(lobe: &impl Rough, up: Vec3, from: Vec3, u: [f32; 3], front: bool) -> Option<Vec3> {
    let frame = Frame::new(up, lobe.tangent());
    let wo = frame.local(from);
    let wi = (wo.z > 0.0).then(|| lobe.draw(wo, u, front))?;
    (wi.z != 0.0).then(|| frame.world(wi))
}
