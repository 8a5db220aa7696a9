use crate::array::{rows, rows_f32, triangles, vec3};
use crate::camera::Camera;
use crate::errors::{raised, usage};
use crate::luminaire::Luminaire;
use crate::material::{Material, vertex_colours};
use crate::options::{Options, illumination};
use crate::wait::wait;
use glam::{DVec3, Vec2, Vec3, Vec4};
use halflight::render::Stop;
use halflight::scene::{
    Choice, Illumination, Material as Matter, Scene as Ready, SceneBuilder, Shape, Surroundings,
};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMappingProxy};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};

/// What is rendered: from a file by `Scene.load`, or built in code by `add_mesh` and `add_luminaire`.
///
/// `environment` and what belongs to it are as on the command line: "studio", "sky:elevation=30", a colour, the name of a picture.
#[pyclass(frozen, module = "halflight")]
pub struct Scene {
    inner: Mutex<Inner>,
}

struct Inner {
    source: Source,
    /// Each by its name, in the order in which they came.
    materials: Vec<Py<Material>>,
    illumination: Option<Illumination>,
}

enum Source {
    /// From a file.
    Loaded(Arc<Ready>),
    /// In code; the builder has all but the materials.
    Built(Box<SceneBuilder>, Surroundings),
}

/// A copy that can be made ready without the interpreter.
struct Copied {
    source: Source,
    materials: Vec<Matter>,
    illumination: Option<Illumination>,
}

impl Scene {
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().expect("nothing panics while it is held")
    }

    /// The scene as it is now, its matrices resolved for `asked`; to be planned.
    pub fn ready(&self, py: Python<'_>, asked: Option<Illumination>) -> PyResult<Ready> {
        let copied = self.copied(py);
        let made = wait(py, &Stop::default(), || copied.ready(asked))?;
        made.map_err(raised)
    }

    fn copied(&self, py: Python<'_>) -> Copied {
        let inner = self.inner();
        let of = |index: usize| match &inner.source {
            Source::Loaded(_) => None,
            Source::Built(builder, _) => {
                let meshes = builder.shapes.iter().filter(|shape| shape.material as usize == index);
                vertex_colours(meshes.map(|shape| shape.colours.as_deref()))
            }
        };
        let materials = inner.materials.iter().enumerate();
        Copied {
            source: match &inner.source {
                Source::Loaded(scene) => Source::Loaded(Arc::clone(scene)),
                Source::Built(builder, around) => Source::Built(builder.clone(), around.clone()),
            },
            materials: materials.map(|(index, material)| material.bind(py).get().matter(of(index))).collect(),
            illumination: inner.illumination,
        }
    }
}

impl Copied {
    fn ready(self, asked: Option<Illumination>) -> halflight::error::Result<Ready> {
        let Self { source, materials, illumination } = self;
        let mut scene = match source {
            Source::Loaded(scene) => {
                let mut scene = Arc::unwrap_or_clone(scene);
                scene.illumination = illumination;
                for own in &mut scene.materials {
                    if let Some(set) = materials.iter().find(|set| set.name == own.name) {
                        (own.illumination, own.opaque, own.straight) =
                            (set.illumination, set.opaque, set.straight);
                    }
                }
                scene
            }
            Source::Built(mut builder, around) => {
                (builder.materials, builder.illumination) = (materials, illumination);
                let mut scene = builder.build()?;
                if around != Surroundings::default() {
                    scene.put_into(&around, None)?;
                }
                scene
            }
        };
        scene.illuminate(asked, &[])?;
        Ok(scene)
    }
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(
        signature = (name="scene".to_owned(), **more),
        text_signature = "(name='scene', *, camera=None, illumination=None, environment=None, environment_rotation=None, environment_strength=None, background=None)"
    )]
    fn new(name: String, more: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let more = Options::of("Scene()", more)?;
        let mut builder = SceneBuilder::new(name);
        builder.camera =
            more.get::<Bound<'_, Camera>>("camera", "a Camera")?.map(|camera| camera.get().inner);
        let illumination = more.read("illumination", illumination)?;
        let around = surroundings(&more)?;
        more.finish()?;
        let source = Source::Built(Box::new(builder), around);
        Ok(Self { inner: Mutex::new(Inner { source, materials: Vec::new(), illumination }) })
    }

    /// Loads a .gltf or .glb file, or a built-in scene by its name ("builtin:caustic-box", …). Arguments are those of the command
    /// line: which `scene` and `camera` of the file (name or number), which `pose` ("1.5", "Walk:1.5") and `variant`, what is
    /// around it, and the most triangles that it may have.
    #[staticmethod]
    #[pyo3(
        signature = (path, **more),
        text_signature = "(path, *, scene=None, camera=None, pose=None, variant=None, environment=None, environment_rotation=None, environment_strength=None, background=None, max_triangles=50000000)"
    )]
    fn load(py: Python<'_>, path: PathBuf, more: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let more = Options::of("Scene.load()", more)?;
        let usual = Choice::default();
        let choice = Choice {
            scene: more.word("scene")?,
            camera: more.word("camera")?,
            pose: more.word("pose")?,
            variant: more.word("variant")?,
            max_triangles: more.get("max_triangles", "a whole number")?.unwrap_or(usual.max_triangles),
            around: surroundings(&more)?,
            ..usual
        };
        more.finish()?;
        let loaded = wait(py, &Stop::default(), || Ready::load_chosen(path, &choice))?.map_err(raised)?;
        let scene = loaded.scene;
        let mut materials: Vec<Py<Material>> = Vec::new();
        for material in &scene.materials {
            if !materials.iter().any(|known| known.get().name() == material.name) {
                materials.push(Py::new(py, Material::plain(material.clone()))?);
            }
        }
        let illumination = scene.illumination;
        let source = Source::Loaded(Arc::new(scene));
        Ok(Self { inner: Mutex::new(Inner { source, materials, illumination }) })
    }

    /// Adds triangles: `positions` (n, 3) in the world (m), `triangles` (m, 3) of their indices, counter-clockwise about the front;
    /// `normals` (n, 3) of any length are interpolated; `uvs` (n, 2) with (0, 0) at the upper left corner of an image; `colors` (n, 3
    /// or 4), linear, in [0, 1]. `material` is a Material, or the name of one that the scene knows. `closed`: whether they enclose a
    /// volume; None: found out.
    #[pyo3(
        signature = (positions, triangles, **more),
        text_signature = "($self, positions, triangles, *, material, normals=None, uvs=None, uvs1=None, colors=None, tangents=None, name=None, closed=None)"
    )]
    fn add_mesh(
        &self,
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
        more: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let more = Options::of("add_mesh()", more)?;
        let shape = mesh(positions, triangles, &more)?;
        let material = more.any("material")?.ok_or_else(|| usage("add_mesh(): give it a material"))?;
        more.finish()?;
        self.add(py, shape, &material)
    }

    /// Adds a sphere that is shaded smooth: `center` and `radius` (m), `around` vertices about its axis.
    #[pyo3(signature = (center, radius, *, material, around=64, name="sphere".to_owned()))]
    fn add_sphere(
        &self,
        py: Python<'_>,
        center: &Bound<'_, PyAny>,
        radius: f64,
        material: &Bound<'_, PyAny>,
        around: u32,
        name: String,
    ) -> PyResult<()> {
        let center = vec3(center, "center")?.as_dvec3();
        if !(3..=4096).contains(&around) {
            return Err(usage(format!("add_sphere(): around={around}; give 3 to 4096 vertices")));
        }
        self.add(py, Shape::sphere(name, 0, center, radius, around), material)
    }

    /// Adds a flat quadrilateral: four `corners` (4, 3), m, counter-clockwise about the front.
    #[pyo3(signature = (corners, *, material, name="quad".to_owned()))]
    fn add_quad(
        &self,
        py: Python<'_>,
        corners: &Bound<'_, PyAny>,
        material: &Bound<'_, PyAny>,
        name: String,
    ) -> PyResult<()> {
        let corners = rows::<3>(corners, "corners")?;
        let corners: [_; 4] =
            corners.try_into().map_err(|_| usage("corners: not numbers of shape (4, 3)"))?;
        self.add(py, Shape::quad(name, 0, corners), material)
    }

    /// Adds what shines without being a mesh.
    fn add_luminaire(&self, luminaire: &Luminaire) -> PyResult<()> {
        let mut inner = self.inner();
        luminaire.add_to(inner.builder("add_luminaire()")?);
        Ok(())
    }

    /// From where a scene that is built in code is seen.
    fn set_camera(&self, camera: &Camera) -> PyResult<()> {
        self.inner().builder("set_camera()")?.camera = Some(camera.inner);
        Ok(())
    }

    /// Its materials by their names: a mapping whose values can be changed.
    #[getter]
    fn materials<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyMappingProxy>> {
        let materials: Vec<_> =
            self.inner().materials.iter().map(|material| material.clone_ref(py)).collect();
        let by_name = PyDict::new(py);
        for material in materials {
            by_name.set_item(material.get().name(), material)?;
        }
        Ok(PyMappingProxy::new(py, by_name.as_mapping()))
    }

    /// The illumination of all that has none of its own, as words; None: global. Set a name, a point (s, t), or None.
    #[getter]
    fn illumination(&self) -> Option<String> {
        self.inner().illumination.map(Illumination::describe)
    }

    #[setter]
    fn set_illumination(&self, value: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let value = value.map(illumination).transpose()?;
        self.inner().illumination = value;
        Ok(())
    }

    /// What the loader has to tell, one line each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        match &self.inner().source {
            Source::Loaded(scene) => scene.notes.clone(),
            Source::Built(builder, _) => builder.notes.clone(),
        }
    }

    /// Its file, or the name that it was given.
    #[getter]
    fn name(&self) -> String {
        match &self.inner().source {
            Source::Loaded(scene) => scene.name.clone(),
            Source::Built(builder, _) => builder.name().to_owned(),
        }
    }

    /// A hash of all that decides a picture, 16 hexadecimal digits; the same on every machine.
    fn hash(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("{:016x}", self.ready(py, None)?.hash()))
    }

    fn __repr__(&self) -> String {
        let materials = self.inner().materials.len();
        format!("<halflight.Scene {:?}, {materials} materials>", self.name())
    }
}

impl Scene {
    fn add(&self, py: Python<'_>, shape: Shape, material: &Bound<'_, PyAny>) -> PyResult<()> {
        // Before the lock is taken: it may run code of the user's.
        let name = material.str()?.to_string();
        let mut inner = self.inner();
        inner.builder("add_mesh()")?;
        let index = match material.cast::<Material>() {
            Ok(material) => inner.known(py, material)?,
            Err(_) => inner.named(&name)?,
        };
        inner.builder("add_mesh()")?.shape(Shape { material: index, ..shape });
        Ok(())
    }
}

impl Inner {
    /// Of a scene that is built in code.
    fn builder(&mut self, what: &str) -> PyResult<&mut SceneBuilder> {
        match &mut self.source {
            Source::Built(builder, _) => Ok(builder),
            Source::Loaded(scene) => Err(usage(format!(
                "{what}: {} was loaded from a file and stays as it is, but for its illumination and materials; build one with Scene()",
                scene.name
            ))),
        }
    }

    /// The index of a material, which is added if it is new.
    fn known(&mut self, py: Python<'_>, material: &Bound<'_, Material>) -> PyResult<u32> {
        let same = |known: &Py<Material>| known.bind(py).is(material);
        if let Some(index) = self.materials.iter().position(same) {
            return Ok(index as u32);
        }
        let name = material.get().name();
        if self.materials.iter().any(|known| known.get().name() == name) {
            return Err(usage(format!(
                "there is another material `{name}` in the scene; give it another name"
            )));
        }
        self.materials.push(material.clone().unbind());
        Ok(self.materials.len() as u32 - 1)
    }

    fn named(&self, name: &str) -> PyResult<u32> {
        let index = self.materials.iter().position(|known| known.get().name() == name);
        index.map(|index| index as u32).ok_or_else(|| {
            let known: Vec<_> = self.materials.iter().map(|known| known.get().name()).collect();
            let known = if known.is_empty() { "none".into() } else { known.join(", ") };
            usage(format!("there is no material `{name}` in the scene; it has {known}"))
        })
    }
}

fn mesh(positions: &Bound<'_, PyAny>, indices: &Bound<'_, PyAny>, more: &Options<'_>) -> PyResult<Shape> {
    let positions = rows::<3>(positions, "positions")?;
    let name = more.get("name", "a name")?.unwrap_or_else(|| "mesh".to_owned());
    let uvs = |name| {
        let read = |value: &Bound<'_, PyAny>| rows_f32::<2>(value, name);
        Ok::<_, PyErr>(more.read(name, read)?.map(|uvs| uvs.into_iter().map(Vec2::from).collect()))
    };
    Ok(Shape {
        normals: more
            .read("normals", |value| rows_f32::<3>(value, "normals"))?
            .map(|normals| normals.into_iter().map(Vec3::from).collect()),
        uvs: [uvs("uvs")?, uvs("uvs1")?],
        colours: more.read("colors", colours)?,
        tangents: more
            .read("tangents", |value| rows_f32::<4>(value, "tangents"))?
            .map(|tangents| tangents.into_iter().map(Vec4::from).collect()),
        closed: more.get("closed", "True or False")?,
        ..Shape::new(name, 0, positions.into_iter().map(DVec3::from), triangles(indices)?)
    })
}

fn colours(value: &Bound<'_, PyAny>) -> PyResult<Vec<Vec4>> {
    match rows_f32::<4>(value, "colors") {
        Ok(colours) => Ok(colours.into_iter().map(Vec4::from).collect()),
        Err(_) => {
            Ok(rows_f32::<3>(value, "colors")?.into_iter().map(|[r, g, b]| Vec4::new(r, g, b, 1.0)).collect())
        }
    }
}

fn surroundings(more: &Options<'_>) -> PyResult<Surroundings> {
    Ok(Surroundings {
        source: more.word("environment")?,
        rotation: more.get("environment_rotation", "a number of degrees")?,
        strength: more.get("environment_strength", "a factor")?,
        background: more.word("background")?,
    })
}
