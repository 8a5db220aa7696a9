use super::{Diffuse, Layers, Normals, Sample, Transport};
use glam::Vec3;

/// Lambert's reflector turned inside out: light leaves on the other side, by the cosine law, as through paper. Both sides
/// alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Translucent {
    /// Directional-hemispherical transmittance, linear RGB, each in [0, 1].
    pub colour: Vec3,
    /// What lies above it, on either side.
    pub under: Option<Layers>,
}

impl Translucent {
    /// What it is for an eye on the other side, where it shows light as this reflector does: `towards` and `arrival` are for
    /// an eye in direction −wo.
    pub fn turned(&self) -> Diffuse {
        Diffuse { albedo: self.colour, two_sided: true, under: self.under }
    }

    /// BSDF value in sr⁻¹ of light from `to` that is seen from `from`, cosine not included.
    pub fn eval(&self, normals: &Normals, from: Vec3, to: Vec3) -> Vec3 {
        self.turned().eval(normals, -from, to)
    }

    /// Density in solid angle of [`sample`](Self::sample) where light is gathered.
    pub fn pdf(&self, normals: &Normals, from: Vec3, to: Vec3) -> f32 {
        self.turned().pdf(normals, -from, to)
    }

    /// A direction on the other side, in proportion to what it carries. None: nothing goes there.
    pub fn sample(&self, normals: &Normals, from: Vec3, transport: Transport, u: [f32; 3]) -> Option<Sample> {
        self.turned().sample(normals, -from, transport, u)
    }
}
