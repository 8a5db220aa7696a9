//! Small scenes, and the measurement of their mean.

use super::Check;
use crate::film::Layer;
use crate::light::Light;
use crate::optics::{Dielectric, Diffuse, Lobe};
use crate::plan::Settings;
use crate::render::Render;
use crate::sampling::warp;
use crate::scene::{
    Camera, Emission, Illumination, Luminaire, Material, Projection, Scene, SceneBuilder, Shape,
};
use glam::{DVec3, Vec3};

/// A scene under construction, about the world's zero: what is checked is what happens at its coordinates.
pub(super) struct Build(pub SceneBuilder);

/// Lambert's reflector, one-sided.
pub(super) fn diffuse(albedo: f32) -> Lobe {
    Lobe::Diffuse(Diffuse { albedo: Vec3::splat(albedo), two_sided: false, under: None })
}

/// Clear glass.
pub(super) fn glass(ior: f32) -> Lobe {
    Lobe::Dielectric(Dielectric { ior, tint: Vec3::ONE })
}

/// A camera with a narrow view.
pub(super) fn look(from: Vec3, at: Vec3, yfov: f32) -> Camera {
    let up = if (at - from).normalize().cross(Vec3::Y).length() < 0.5 { Vec3::Z } else { Vec3::Y };
    Camera::look_at(from, at, up, Projection::Perspective { yfov })
}

impl Build {
    pub fn new(illumination: Illumination, camera: Camera) -> Self {
        Self(Scene::builder("check").illumination(illumination).camera(camera).origin(DVec3::ZERO))
    }

    pub fn material(&mut self, name: &str, lobe: Lobe) -> u32 {
        self.0.material(Material::new(name, lobe))
    }

    pub fn glowing(&mut self, albedo: f32, radiance: f32) -> u32 {
        let emission = Emission::front(Vec3::splat(radiance));
        self.0.material(Material::diffuse("Glowing", Vec3::splat(albedo)).with_emission(emission))
    }

    /// Triangles of one open surface; counter-clockwise is the front.
    pub fn mesh(&mut self, positions: &[Vec3], triangles: &[[u32; 3]], material: u32) {
        let shape = Shape::new("thing", material, positions.iter().copied(), triangles);
        self.0.shape(Shape { closed: Some(false), ..shape });
    }

    /// A parallelogram; its front is where `a × b` points.
    pub fn quad(&mut self, corner: Vec3, a: Vec3, b: Vec3, material: u32) {
        self.grid(corner, a, b, [1, 1], material);
    }

    /// The same as a grid of `columns` × `rows` parallelograms.
    pub fn grid(&mut self, corner: Vec3, a: Vec3, b: Vec3, [columns, rows]: [u32; 2], material: u32) {
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        for j in 0..=rows {
            let start = corner + j as f32 / rows as f32 * b;
            positions.extend((0..=columns).map(|i| start + i as f32 / columns as f32 * a));
        }
        for j in 0..rows {
            for i in 0..columns {
                let at = |i: u32, j: u32| j * (columns + 1) + i;
                let [p, q, r, s] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                triangles.extend([[p, q, r], [p, r, s]]);
            }
        }
        self.mesh(&positions, &triangles, material);
    }

    /// A horizontal square about (0, y, 0) that looks up, or down.
    pub fn level(&mut self, y: f32, half: f32, up: bool, material: u32) {
        let (a, b) = (2.0 * half * Vec3::X, 2.0 * half * Vec3::Z);
        let (a, b) = if up { (b, a) } else { (a, b) };
        self.quad(Vec3::new(-half, y, -half), a, b, material);
    }

    /// The inside of a box.
    pub fn room(&mut self, min: Vec3, max: Vec3, material: u32) {
        let d = max - min;
        let (x, y, z) = (d * Vec3::X, d * Vec3::Y, d * Vec3::Z);
        self.quad(min, y, z, material);
        self.quad(min, z, x, material);
        self.quad(min, x, y, material);
        self.quad(max, -z, -y, material);
        self.quad(max, -x, -z, material);
        self.quad(max, -y, -x, material);
    }

    /// A sphere with smooth normals, of `around` × `down` facets.
    pub fn ball(&mut self, centre: Vec3, radius: f32, around: u32, down: u32, material: u32) {
        let place = |i: u32, j: u32| {
            let turn = (i % around) as f32 / around as f32;
            warp::about_z((std::f32::consts::PI * j as f32 / down as f32).cos(), turn)
        };
        let (mut normals, mut triangles) = (Vec::new(), Vec::new());
        for (j, i) in (0..down).flat_map(|j| (0..around).map(move |i| (j, i))) {
            let corners = [place(i, j), place(i, j + 1), place(i + 1, j + 1), place(i + 1, j)];
            let first = normals.len() as u32;
            normals.extend(corners);
            // At the poles a facet is one triangle.
            triangles.extend((j + 1 < down).then_some([first, first + 1, first + 2]));
            triangles.extend((j > 0).then_some([first, first + 2, first + 3]));
        }
        let positions = normals.iter().map(|normal| centre + radius * *normal);
        self.0.shape(Shape::new("ball", material, positions, triangles).with_normals(normals.clone()));
    }

    pub fn point_light(&mut self, position: Vec3, intensity: f32) {
        self.0.luminaire(Luminaire::Point { position, intensity: Light::both(Vec3::splat(intensity)) });
    }

    /// The finished scene.
    pub fn finish(self) -> Scene {
        self.0.build().expect("a scene of the program's own")
    }
}

/// Settings of a small film.
pub(super) fn film(width: u32, height: u32, paths: u32) -> Settings {
    Settings { width, height, paths: Some(paths), ..Settings::default() }
}

/// Mean of the film's red channel and its standard error over `passes`.
pub(super) fn measure(scene: Scene, settings: Settings, passes: u32) -> Result<(f64, f64), String> {
    let render = rendered(scene, settings, passes)?;
    let error = render.film().mean_colour_error().map_or(0.0, |error| error.x);
    Ok((render.film().mean_colour().x, error))
}

/// A render after some passes, or why there is none.
pub(super) fn rendered(scene: Scene, settings: Settings, passes: u32) -> Result<Render, String> {
    let mut render = Render::new(scene, settings, &[Layer::Visible]).map_err(|why| why.to_string())?;
    (0..passes).for_each(|_| render.pass());
    Ok(render)
}

/// A mean against its closed form.
pub(super) fn mean_is(
    what: impl Into<String>,
    scene: Scene,
    settings: Settings,
    passes: u32,
    expected: f64,
    rounding: f64,
) -> Check {
    match measure(scene, settings, passes) {
        Ok(measured) => Check::number(what, expected, measured, rounding),
        Err(why) => Check::fact(what, "an image", why),
    }
}

/// Whether every pixel is finite, and whether any is above zero.
pub(super) fn finite(
    what: impl Into<String>,
    lit: bool,
    scene: Scene,
    settings: Settings,
    passes: u32,
) -> Check {
    let words = |lit: bool| if lit { "finite, not black" } else { "black" };
    let got = rendered(scene, settings, passes).map(|render| {
        let picture = render.film().mean(Layer::Visible);
        match picture.iter().filter(|rgb| !rgb.is_finite()).count() {
            0 => words(picture.iter().any(|rgb| *rgb != Vec3::ZERO)).to_owned(),
            n => format!("{n} pixels are not finite"),
        }
    });
    Check::fact(what, words(lit), got.unwrap_or_else(|why| why))
}
