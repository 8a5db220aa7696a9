//! What delta lobes have in common: light goes on in a few single directions, and somewhere it has to go.
//!
//! A gathering walk is reflected or refracted about the shading normal. Where that would lead it to the wrong side of the
//! real surface, as on facets seen at a grazing angle, the geometric normal is used instead. What is not absorbed goes on, so
//! that in a room that glows uniformly clear glass is invisible, whatever its normals are. Total reflection by the shading
//! normal counts only where light meets the shading normal at a smaller angle than the geometric one; otherwise walks would
//! be trapped for ever.
//!
//! Light that is shot takes the same ways backwards. Four ways can have led a gathering walk to where the light comes from:
//! by reflection or through, about either normal. Those that do, in proportion to what they carry, are the branches.
//! (Veach 1997, §5.3, for a lobe that is one about its shading normal alone.) The sum over all light is that of gathering;
//! for light from one direction it may be above or below what arrived, as always with shading normals.

use super::{Normals, Pdf, Sample, Transport};
use glam::Vec3;

/// A lobe that reflects in one direction and lets through in one.
pub(super) trait Smooth {
    /// Share of what is reflected; `cos_from` in (0, 1] about the normal that turns the walk.
    fn reflectance(&self, cos_from: f32, front: bool) -> f32;

    /// Where `from` goes on behind the surface; `normal` is on its side. None: nowhere, all is reflected.
    fn through(&self, from: Vec3, normal: Vec3, front: bool) -> Option<Vec3>;

    /// True where nothing goes through only because of the angle.
    fn is_total(&self, _cos_from: f32, _front: bool) -> bool {
        false
    }

    /// Filters of reflected light and of light that went through, linear RGB; `cos_from` as above. That of reflected light is
    /// the same both ways, since both make the same angle with the normal.
    fn filters(&self, cos_from: f32) -> [Vec3; 2];

    /// What radiance that is gathered through the surface is multiplied by; `front` is the side of the eye.
    fn compression(&self, _front: bool) -> f32 {
        1.0
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Turn {
    Reflected,
    Through,
}

/// One way to go on.
#[derive(Clone, Copy)]
struct Way {
    turn: Turn,
    /// About the geometric normal.
    geometric: bool,
    to: Vec3,
    /// Probability, or what takes its place where light is shot.
    share: f32,
}

/// A lobe, and a direction to turn.
struct Turning<'a, L> {
    lobe: &'a L,
    from: Vec3,
    front: bool,
    /// The geometric and the shading normal, on the side of `from`.
    up: Normals,
}

impl<'a, L: Smooth> Turning<'a, L> {
    fn new(lobe: &'a L, normals: &Normals, from: Vec3) -> Self {
        let front = normals.is_front(from);
        let side = if front { 1.0 } else { -1.0 };
        let up = Normals { geometric: side * normals.geometric, shading: side * normals.shading };
        Self { lobe, from, front, up }
    }

    fn up(&self, geometric: bool) -> Vec3 {
        if geometric { self.up.geometric } else { self.up.shading }
    }

    /// None: not a way of this surface.
    fn to(&self, turn: Turn, geometric: bool) -> Option<Vec3> {
        let up = self.up(geometric);
        if self.from.dot(up) <= 0.0 {
            return None;
        }
        let to = match turn {
            Turn::Reflected => reflect(self.from, up),
            Turn::Through => self.lobe.through(self.from, up, self.front)?,
        };
        let height = to.dot(self.up.geometric);
        (if turn == Turn::Reflected { height > 0.0 } else { height < 0.0 }).then_some(to)
    }

    /// The ways of a gathering walk; their shares sum to one.
    fn gathered(&self) -> [Option<Way>; 2] {
        let [cos_shading, cos_geometric] = [false, true].map(|geometric| self.from.dot(self.up(geometric)));
        // Light that a shading normal reflects totally, and more askew than the surface would, creeps along the inside of a
        // curved wall and never leaves.
        let askew = cos_shading <= 0.0
            || (cos_shading < cos_geometric && self.lobe.is_total(cos_shading, self.front));
        let reflectance = self.lobe.reflectance(if askew { cos_geometric } else { cos_shading }, self.front);
        let way = |turn, share| {
            [askew, true].into_iter().find_map(|geometric| {
                let to = self.to(turn, geometric)?;
                Some(Way { turn, geometric, to, share })
            })
        };
        let totally = || {
            Some(Way {
                turn: Turn::Reflected,
                geometric: true,
                to: self.to(Turn::Reflected, true)?,
                share: 1.0 - reflectance,
            })
        };
        let reflected = (reflectance > 0.0).then(|| way(Turn::Reflected, reflectance)).flatten();
        let rest = || way(Turn::Through, 1.0 - reflectance).or_else(totally);
        [reflected, (reflectance < 1.0).then(rest).flatten()]
    }

    /// The ways of light that is shot: those that a gathering walk would come here by.
    fn shot(&self, normals: &Normals) -> [Option<Way>; 4] {
        let ways = [
            (Turn::Reflected, false),
            (Turn::Through, false),
            (Turn::Reflected, true),
            (Turn::Through, true),
        ];
        ways.map(|(turn, geometric)| {
            let to = self.to(turn, geometric)?;
            let back = Turning::new(self.lobe, normals, to).gathered();
            let same = back.iter().flatten().filter(|way| way.turn == turn && way.geometric == geometric);
            let share: f32 = same.map(|way| way.share).sum();
            let adjoint = if geometric { 1.0 } else { normals.adjoint(self.from, to) };
            (share > 0.0).then_some(Way { turn, geometric, to, share: share * adjoint })
        })
    }
}

/// All branches; those of a gathering walk have probabilities that sum to one, those of light that is shot where there
/// are any.
pub(super) fn branches(
    lobe: &impl Smooth,
    normals: &Normals,
    from: Vec3,
    transport: Transport,
) -> [Option<Sample>; 4] {
    let turning = Turning::new(lobe, normals, from);
    let filter = |way: Way| {
        let [reflected, through] = lobe.filters(from.dot(turning.up(way.geometric)));
        if way.turn == Turn::Reflected { reflected } else { through }
    };
    let sample = |way: Way, factor: f32, whole: f32| Sample {
        to: way.to,
        weight: factor * filter(way),
        pdf: Pdf::Delta(way.share / whole),
        geometric: way.geometric,
    };
    if transport == Transport::Shooting && normals.shading != normals.geometric {
        let ways = turning.shot(normals);
        let whole: f32 = ways.iter().flatten().map(|way| way.share).sum();
        return ways.map(|way| Some(sample(way?, whole, whole)));
    }
    let factor = |turn| match (turn, transport) {
        (Turn::Through, Transport::Gathering) => lobe.compression(turning.front),
        _ => 1.0,
    };
    let [a, b] = turning.gathered().map(|way| Some(sample(way?, factor(way?.turn), 1.0)));
    [a, b, None, None]
}

/// The branch that `u` in [0, 1) falls on. None: there is none.
pub(super) fn choose(branches: [Option<Sample>; 4], mut u: f32) -> Option<Sample> {
    let mut chosen = None;
    for branch in branches.into_iter().flatten() {
        chosen = Some(branch);
        if u < branch.pdf.value() {
            break;
        }
        u -= branch.pdf.value();
    }
    chosen
}

/// The mirror image of `from` about `normal`, both pointing away from the surface.
fn reflect(from: Vec3, normal: Vec3) -> Vec3 {
    (2.0 * from.dot(normal) * normal - from).normalize()
}
