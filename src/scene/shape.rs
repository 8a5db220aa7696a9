use glam::{DVec3, Vec2, Vec3, Vec4};
use std::f64::consts::{PI, TAU};

/// Triangles of one material in world space: what becomes one [`Surface`](super::Surface).
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// For messages.
    pub name: String,
    /// What [`SceneBuilder::material`](super::SceneBuilder::material) returned.
    pub material: u32,
    /// Vertices in the world, m.
    pub positions: Vec<DVec3>,
    /// Vertex normals, as many as positions, of any length. None: triangles are flat.
    pub normals: Option<Vec<Vec3>>,
    /// Three vertex indices per triangle; counter-clockwise is the front.
    pub triangles: Vec<[u32; 3]>,
    /// Whether the triangles enclose a volume. None: found out.
    pub closed: Option<bool>,
    /// Two sets of texture coordinates, each as many as positions; (0, 0) is the upper left corner of an image.
    pub uvs: [Option<Vec<Vec2>>; 2],
    /// Colours with alpha, linear, in [0, 1]; as many as positions.
    pub colours: Option<Vec<Vec4>>,
    /// Where the right of a normal map is (any length), as many as positions; w: 1 where its up is normal × tangent, −1 where
    /// that is its down. None: as the texture coordinates lay it out.
    pub tangents: Option<Vec<Vec4>>,
}

impl Shape {
    /// Flat triangles: `positions` in the world (m), three of their indices per triangle, counter-clockwise about the front.
    pub fn new<P: Into<DVec3>>(
        name: impl Into<String>,
        material: u32,
        positions: impl IntoIterator<Item = P>,
        triangles: impl Into<Vec<[u32; 3]>>,
    ) -> Self {
        let positions = positions.into_iter().map(Into::into).collect();
        Self {
            name: name.into(),
            material,
            positions,
            normals: None,
            triangles: triangles.into(),
            closed: None,
            uvs: [None, None],
            colours: None,
            tangents: None,
        }
    }

    /// A flat quadrilateral, m; counter-clockwise is the front.
    pub fn quad<P: Into<DVec3>>(name: impl Into<String>, material: u32, corners: [P; 4]) -> Self {
        Self::new(name, material, corners, [[0, 1, 2], [0, 2, 3]])
    }

    /// A sphere (m) that looks outward and is shaded smooth, its vertices on the true sphere: `around` of them about the axis,
    /// at least 3, and half as many rings from pole to pole.
    pub fn sphere(
        name: impl Into<String>,
        material: u32,
        centre: impl Into<DVec3>,
        radius: f64,
        around: u32,
    ) -> Self {
        let centre = centre.into();
        let around = around.max(3);
        let rings = (around / 2).max(2);
        let mut normals = vec![DVec3::Y];
        for ring in 1..rings {
            let (sin, cos) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
            normals.extend((0..around).map(|i| {
                let (s, c) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
                DVec3::new(sin * s, cos, sin * c)
            }));
        }
        normals.push(DVec3::NEG_Y);
        let positions: Vec<DVec3> = normals.iter().map(|n| centre + radius * n).collect();
        Self::new(name, material, positions, facets(around, rings))
            .with_normals(normals.iter().map(|n| n.as_vec3()).collect())
    }

    /// With vertex normals, as many as positions, of any length, which are interpolated.
    #[must_use]
    pub fn with_normals(self, normals: Vec<Vec3>) -> Self {
        Self { normals: Some(normals), ..self }
    }

    /// With the first set of texture coordinates, as many as positions.
    #[must_use]
    pub fn with_uvs(mut self, uvs: Vec<Vec2>) -> Self {
        self.uvs[0] = Some(uvs);
        self
    }

    /// With colours of vertices and their alpha, linear, in [0, 1], as many as positions.
    #[must_use]
    pub fn with_colours(self, colours: Vec<Vec4>) -> Self {
        Self { colours: Some(colours), ..self }
    }

    /// Without vertex normals.
    #[must_use]
    pub fn flat(self) -> Self {
        Self { normals: None, ..self }
    }

    /// With its fronts and normals where its backs were.
    #[must_use]
    pub fn inside_out(mut self) -> Self {
        self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        self.normals.iter_mut().flatten().for_each(|normal| *normal = -*normal);
        self.tangents.iter_mut().flatten().for_each(|tangent| tangent.w = -tangent.w);
        self
    }
}

/// The triangles of a sphere: a pole, `rings` − 1 circles of `around` vertices, the other pole.
fn facets(around: u32, rings: u32) -> Vec<[u32; 3]> {
    let at = |ring: u32, i: u32| match ring {
        0 => 0,
        r if r == rings => 1 + (rings - 1) * around,
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
    triangles
}
