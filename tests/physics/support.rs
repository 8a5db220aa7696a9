//! A small scene builder, and the test of a closed form.

use glam::{DVec3, Vec3};
use halflight::film::Layer;
use halflight::light::Light;
use halflight::optics::{Diffuse, Lobe};
use halflight::plan::Settings;
use halflight::render::Render;
use halflight::scene::{
    Camera, Emission, Illumination, Luminaire, Material, Mesh, Projection, Scene, Surface,
};

/// Builds a scene piece by piece.
pub struct Build(pub Scene);

pub fn diffuse(albedo: f32) -> Lobe {
    Lobe::Diffuse(Diffuse { albedo: Vec3::splat(albedo), two_sided: false })
}

pub fn look(from: Vec3, at: Vec3) -> Camera {
    let up = if (at - from).cross(Vec3::Y).length() < 1e-3 { Vec3::Z } else { Vec3::Y };
    Camera::look_at(from, at, up, Projection::Perspective { yfov: 0.1 })
}

impl Build {
    pub fn new(illumination: Illumination, camera: Camera) -> Self {
        Self(Scene {
            name: "test".into(),
            mesh: Mesh::default(),
            surfaces: Vec::new(),
            materials: Vec::new(),
            luminaires: Vec::new(),
            camera,
            origin: DVec3::ZERO,
            illumination: Some(illumination),
            notes: Vec::new(),
        })
    }

    pub fn material(&mut self, name: &str, lobe: Lobe) -> u32 {
        self.0.materials.push(Material::new(name, lobe));
        self.0.materials.len() as u32 - 1
    }

    /// A parallelogram; its front is where `a × b` points.
    pub fn quad(&mut self, corner: Vec3, a: Vec3, b: Vec3, material: u32) -> &mut Self {
        let surface = self.surface(material, false);
        let n = a.cross(b).normalize();
        let first = self.0.mesh.positions.len() as u32;
        self.0.mesh.positions.extend([corner, corner + a, corner + a + b, corner + b]);
        self.0.mesh.normals.extend([n; 4]);
        self.0.mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        self.0.mesh.surface.extend([surface; 2]);
        self
    }

    /// A sphere of longitude and latitude; its front is outside, or inside where `inward`.
    pub fn sphere(
        &mut self,
        centre: Vec3,
        radius: f32,
        (around, down): (u32, u32),
        inward: bool,
        material: u32,
    ) {
        let surface = self.surface(material, true);
        let first = self.0.mesh.positions.len() as u32;
        for j in 0..=down {
            for i in 0..around {
                let theta = std::f32::consts::PI * j as f32 / down as f32;
                let phi = std::f32::consts::TAU * i as f32 / around as f32;
                let n = match j {
                    0 => Vec3::Y,
                    _ if j == down => -Vec3::Y,
                    _ => Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()),
                };
                self.0.mesh.positions.push(centre + radius * n);
                self.0.mesh.normals.push(if inward { -n } else { n });
            }
        }
        for j in 0..down {
            for i in 0..around {
                let at = |i: u32, j: u32| first + j * around + i % around;
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                for [x, y, z] in [[a, b, c], [a, c, d]] {
                    let mut t = [x, y, z];
                    if self.0.mesh.positions[x as usize] == self.0.mesh.positions[y as usize]
                        || self.0.mesh.positions[y as usize] == self.0.mesh.positions[z as usize]
                        || self.0.mesh.positions[x as usize] == self.0.mesh.positions[z as usize]
                    {
                        continue;
                    }
                    if inward {
                        t.swap(1, 2);
                    }
                    self.0.mesh.triangles.push(t);
                    self.0.mesh.surface.push(surface);
                }
            }
        }
    }

    fn surface(&mut self, material: u32, smooth: bool) -> u32 {
        self.0.surfaces.push(Surface { name: "thing".into(), material, smooth, closed: smooth });
        self.0.surfaces.len() as u32 - 1
    }

    /// The finished scene.
    pub fn finish(mut self) -> Scene {
        for (i, surface) in self.0.mesh.surface.iter().enumerate() {
            let material = self.0.surfaces[*surface as usize].material;
            if let Some(emission) = self.0.materials[material as usize].emission {
                let area = self.0.mesh.area(i as u32);
                self.0.luminaires.push(Luminaire::Triangle { triangle: i as u32, emission, area });
            }
        }
        self.0.illuminate(None, &[]).expect("no names asked for");
        self.0
    }
}

/// Emission of equal halves from the front.
pub fn glow(radiance: f32) -> Option<Emission> {
    Some(Emission { radiance: Light::both(Vec3::splat(radiance)), two_sided: false })
}

/// Settings for a small film.
pub fn small(width: u32, height: u32, paths: u32) -> Settings {
    Settings { width, height, paths: Some(paths), ..Settings::default() }
}

/// Mean over the film of the first channel, with its standard error from the passes.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    pub mean: f64,
    pub error: f64,
}

pub fn measure(scene: Scene, settings: Settings, passes: u32) -> Measured {
    let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("a render");
    for _ in 0..passes {
        render.pass();
    }
    let (mean, error) =
        (render.film().mean_colour(), render.film().mean_colour_error().expect("several passes"));
    Measured { mean: mean.x, error: error.x }
}

impl Measured {
    /// The mean of samples with its standard error.
    pub fn of(samples: &[f64]) -> Self {
        let n = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / n;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt() }
    }

    /// Passes when the closed form lies within 3.5 standard errors, and a closed form 2 % higher or lower does not.
    /// `rounding`: relative error of the closed form itself (tessellation, f32), to be far below 2 %.
    #[track_caller]
    pub fn must_be(&self, expected: f64, rounding: f64) {
        assert!(rounding <= 0.004, "an allowance of {rounding} would hide a 2 % error");
        let z = |expected: f64| {
            let off = (self.mean - expected).abs() - rounding * expected.abs();
            off.max(0.0) / self.error.max(1e-9 * expected.abs())
        };
        assert!(z(expected) < 3.5, "{self:?} against {expected}: z = {:.2}", z(expected));
        for wrong in [0.98 * expected, 1.02 * expected] {
            assert!(z(wrong) > 3.5, "{self:?} cannot tell {expected} from {wrong}: z = {:.2}", z(wrong));
        }
    }
}
