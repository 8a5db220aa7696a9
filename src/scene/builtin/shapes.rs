use crate::optics::{Diffuse, Lobe};
use crate::scene::assembly::{Closure, Piece, assemble};
use crate::scene::{Camera, Emission, Illumination, Luminaire, Material, Scene};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Collects shapes in world space.
#[derive(Default)]
pub(super) struct Builder {
    pieces: Vec<Piece>,
    materials: Vec<Material>,
}

/// How finely a sphere is tessellated, and which way it looks.
#[derive(Clone, Copy)]
pub(super) struct Look {
    /// Triangles around the axis; there are half as many from pole to pole.
    pub around: u32,
    /// True: normals are interpolated.
    pub smooth: bool,
    /// True: the front is the inside.
    pub inward: bool,
}

/// What a scene has beside its shapes, in world space.
pub(super) struct Setting {
    pub name: String,
    pub camera: Camera,
    pub lights: Vec<Luminaire>,
    pub illumination: Option<Illumination>,
}

impl Builder {
    /// Adds a material.
    pub fn material(&mut self, name: &str, lobe: Lobe) -> u32 {
        self.materials.push(Material::new(name, lobe));
        self.materials.len() as u32 - 1
    }

    /// Adds a diffuse one-sided material.
    pub fn diffuse(&mut self, name: &str, albedo: [f32; 3]) -> u32 {
        self.material(name, Lobe::Diffuse(Diffuse { albedo: albedo.into(), two_sided: false }))
    }

    /// Adds a material that reflects nothing and shines from its front.
    pub fn lamp(&mut self, emission: Emission) -> u32 {
        let index = self.diffuse("Lamp", [0.0; 3]);
        self.materials[index as usize].emission = Some(emission);
        index
    }

    /// Adds a flat quadrilateral; counter-clockwise is the front.
    pub fn quad(&mut self, name: &str, material: u32, corners: [[f64; 3]; 4]) {
        self.piece(Piece {
            name: name.into(),
            material,
            positions: corners.map(DVec3::from_array).to_vec(),
            normals: None,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            closed: false,
        });
    }

    /// Adds a sphere, its vertices on the true sphere.
    pub fn sphere(&mut self, name: &str, material: u32, centre: [f64; 3], radius: f64, look: Look) {
        let (around, rings) = (look.around, look.around / 2);
        let mut normals = vec![DVec3::Y];
        for ring in 1..rings {
            let (sin, cos) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
            normals.extend((0..around).map(|i| {
                let (s, c) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
                DVec3::new(sin * s, cos, sin * c)
            }));
        }
        normals.push(DVec3::NEG_Y);
        let south = normals.len() as u32 - 1;
        let at = |ring: u32, i: u32| match ring {
            0 => 0,
            r if r == rings => south,
            r => 1 + (r - 1) * around + i % around,
        };
        let mut triangles = Vec::with_capacity(2 * around as usize * (rings as usize - 1));
        for ring in 0..rings {
            for i in 0..around {
                let [a, b, c, d] = [at(ring, i), at(ring + 1, i), at(ring + 1, i + 1), at(ring, i + 1)];
                triangles.extend((ring + 1 < rings).then_some([a, b, c]));
                triangles.extend((ring > 0).then_some([a, c, d]));
            }
        }
        if look.inward {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let sign = if look.inward { -1.0 } else { 1.0 };
        self.piece(Piece {
            name: name.into(),
            material,
            positions: normals.iter().map(|n| DVec3::from_array(centre) + radius * n).collect(),
            normals: look.smooth.then(|| normals.iter().map(|n| (sign * n).as_vec3()).collect()),
            triangles,
            closed: false,
        });
    }

    fn piece(&mut self, piece: Piece) {
        let closed = Closure::of(&piece.positions, &piece.triangles).closed;
        self.pieces.push(Piece { closed, ..piece });
    }

    /// The scene.
    ///
    /// # Errors
    /// What [`assemble`] refuses; none of the built-in scenes is.
    pub fn finish(self, setting: Setting) -> Result<Scene, String> {
        let assembly =
            assemble(self.pieces, |material| self.materials[material as usize].emission.is_some(), None)?;
        let local = |p: Vec3| (p.as_dvec3() - assembly.origin).as_vec3();
        let mut camera = setting.camera;
        camera.position = local(camera.position);
        let mut luminaires = assembly.luminaires(&self.materials);
        luminaires.extend(setting.lights.into_iter().map(|light| match light {
            Luminaire::Point { position, intensity } => {
                Luminaire::Point { position: local(position), intensity }
            }
            other => other,
        }));
        Ok(Scene {
            name: setting.name,
            mesh: assembly.mesh,
            surfaces: assembly.surfaces,
            materials: self.materials,
            luminaires,
            camera,
            origin: assembly.origin,
            illumination: setting.illumination,
            notes: Vec::new(),
        })
    }
}
