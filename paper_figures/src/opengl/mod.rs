//! The paper's opponent: OpenGL's fixed-function pipeline, lit at the corners of triangles, many jittered passes a pixel.

mod calls;
mod parts;

use calls::{Canvas, Context, Spot};
use glam::{DVec3, Vec3};
use halflight::sampling::Sobol;
use halflight::scene::{Luminaire, Scene};
use std::f32::consts::FRAC_1_PI;

/// Debian's names of what brings it.
pub const PACKAGES: &str = "libegl1 libgl1-mesa-dri";

/// No flat triangle has longer edges than this share of the scene's radius: what is linear between two corners is then
/// within 10⁻⁴ of the light of a lamp that hangs as high as the scene is wide.
const EDGE: f32 = 1.0 / 150.0;

/// A fixed-function OpenGL that draws into memory.
pub struct OpenGl {
    context: Context,
}

impl OpenGl {
    /// Opens it.
    ///
    /// # Errors
    /// What is missing, in one line.
    pub fn open() -> Result<Self, String> {
        Ok(Self { context: Context::open()? })
    }

    /// Version and renderer.
    pub fn describe(&self) -> String {
        self.context.describe()
    }

    /// The scene in the light of its Warn spots, W m⁻² sr⁻¹: the mean of `samples` passes that are jittered over the pixel.
    /// Row-major from top left, linear RGB. Also the number of triangles drawn in a pass.
    ///
    /// A diffuse surface of albedo ρ shows ρ/π times the irradiance E; OpenGL shows ρ times its light. So a light's colour
    /// is its intensity (paper eq. 24) over π.
    ///
    /// # Errors
    /// Luminaires that OpenGL does not know; what the driver refuses.
    pub fn picture(
        &self,
        scene: &Scene,
        (width, height): (u32, u32),
        samples: u32,
    ) -> Result<(Vec<Vec3>, usize), String> {
        let lights = scene.luminaires.iter().map(spot).collect::<Result<Vec<_>, _>>()?;
        let (centre, radius) = scene.bounding_sphere();
        let parts = parts::parts(scene, EDGE * radius);
        let triangles = parts.iter().map(|part| part.indices.len() / 3).sum();
        let canvas = Canvas::new(&self.context, width, height, &parts)?;
        let camera = &scene.camera;
        let far = camera.position.distance(centre) + radius;
        let view = parts::view(camera);
        let net = Sobol::new(4);
        let mut sums = vec![DVec3::ZERO; width as usize * height as usize];
        for sample in 0..samples {
            let projection =
                parts::projection(camera, (width, height), net.point(sample, 0), (far / 200.0, far));
            let pixels = canvas.draw(projection, view, &lights)?;
            sums.iter_mut().zip(pixels).for_each(|(sum, pixel)| *sum += pixel.as_dvec3());
        }
        Ok((sums.iter().map(|sum| (sum / f64::from(samples)).as_vec3()).collect(), triangles))
    }
}

fn spot(luminaire: &Luminaire) -> Result<Spot, String> {
    match *luminaire {
        Luminaire::Warn { position, direction, intensity, exponent, attenuation } => {
            Ok(Spot { position, direction, colour: FRAC_1_PI * intensity.invisible, exponent, attenuation })
        }
        _ => Err("OpenGL's lights are points that shine after Warn; this scene has others".into()),
    }
}
