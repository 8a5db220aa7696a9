//! Foreign calls, and nothing else: EGL without a window system, and OpenGL's fixed-function pipeline. What is public is
//! safe: sizes and indices are checked before the driver sees them.

#![allow(unsafe_code)]

use glam::{Mat4, Vec3};
use khronos_egl as egl;
use std::ffi::{CStr, c_void};
use std::ptr::null;

// Generated code, of an edition before 2024.
#[allow(clippy::all, missing_docs, unused_qualifications, unsafe_op_in_unsafe_fn)]
mod gl {
    include!(concat!(env!("OUT_DIR"), "/gl.rs"));
}

/// `EGL_PLATFORM_SURFACELESS_MESA` of the extension `EGL_MESA_platform_surfaceless`.
const SURFACELESS: egl::Enum = 0x31DD;
/// What every OpenGL has at least.
const LIGHTS: usize = 8;

type Egl = egl::DynamicInstance<egl::EGL1_5>;

/// An OpenGL that draws into memory. It belongs to the thread that opened it.
pub struct Context {
    egl: Egl,
    display: egl::Display,
    context: egl::Context,
    gl: gl::Gl,
}

/// A light of the fixed-function pipeline that is diffuse only, in scene space.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Where.
    pub position: Vec3,
    /// Axis.
    pub direction: Vec3,
    /// `GL_DIFFUSE`: what a white surface shows that faces it, before falling off.
    pub colour: Vec3,
    /// `GL_SPOT_EXPONENT`, 0 to 128; zero shines in all directions.
    pub exponent: f32,
    /// `GL_CONSTANT_`, `GL_LINEAR_` and `GL_QUADRATIC_ATTENUATION`.
    pub attenuation: [f32; 3],
}

/// Triangles of one diffuse material whose back is black.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// `GL_DIFFUSE` of the front.
    pub albedo: Vec3,
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Unit normals, one for each corner.
    pub normals: Vec<Vec3>,
    /// Three corners for each triangle, counter-clockwise.
    pub indices: Vec<u32>,
}

/// Parts in the driver's memory and something to draw on.
pub struct Canvas<'a> {
    context: &'a Context,
    width: u32,
    height: u32,
    framebuffer: u32,
    /// Of colour and depth.
    renderbuffers: [u32; 2],
    parts: Vec<Buffers>,
}

struct Buffers {
    albedo: Vec3,
    /// Positions, normals, indices.
    names: [u32; 3],
    count: i32,
}

impl Context {
    /// Opens it.
    ///
    /// # Errors
    /// What is missing, in one line.
    pub fn open() -> Result<Self, String> {
        // SAFETY: the library of that name is EGL's loader, whose initialisation has no preconditions.
        let egl = unsafe { Egl::load_required() }
            .map_err(|e| format!("libEGL.so.1 could not be loaded ({})", innermost(&e)))?;
        // SAFETY: this platform takes no native display; the attributes end with NONE.
        let display =
            unsafe { egl.get_platform_display(SURFACELESS, egl::DEFAULT_DISPLAY, &[egl::ATTRIB_NONE]) }
                .map_err(|e| format!("EGL has no display without a window system ({e})"))?;
        egl.initialize(display).map_err(|e| format!("EGL could not be started ({e})"))?;
        let made = Self::make(&egl, display);
        match made {
            Ok((context, gl)) => Ok(Self { egl, display, context, gl }),
            Err(reason) => {
                let _ = egl.terminate(display);
                Err(reason)
            }
        }
    }

    fn make(egl: &Egl, display: egl::Display) -> Result<(egl::Context, gl::Gl), String> {
        egl.bind_api(egl::OPENGL_API).map_err(|e| format!("EGL knows no OpenGL ({e})"))?;
        let wanted = [egl::SURFACE_TYPE, egl::PBUFFER_BIT, egl::RENDERABLE_TYPE, egl::OPENGL_BIT, egl::NONE];
        let config = egl
            .choose_first_config(display, &wanted)
            .ok()
            .flatten()
            .ok_or("EGL has no configuration for OpenGL")?;
        let version = [
            egl::CONTEXT_MAJOR_VERSION,
            3,
            egl::CONTEXT_MINOR_VERSION,
            3,
            egl::CONTEXT_OPENGL_PROFILE_MASK,
            egl::CONTEXT_OPENGL_COMPATIBILITY_PROFILE_BIT,
            egl::NONE,
        ];
        let context = egl
            .create_context(display, config, None, &version)
            .map_err(|e| format!("there is no OpenGL 3.3 with the fixed-function pipeline ({e})"))?;
        egl.make_current(display, None, None, Some(context))
            .map_err(|e| format!("OpenGL does not draw without a surface ({e})"))?;
        let address = |name: &str| egl.get_proc_address(name).map_or(null(), |f| f as *const c_void);
        Ok((context, gl::Gl::load_with(address)))
    }

    /// Version and renderer, as the driver calls them.
    pub fn describe(&self) -> String {
        self.make_current();
        let text = |name| {
            // SAFETY: the context is current; the driver's strings end with zero and live as long as it.
            unsafe {
                let text = self.gl.GetString(name);
                if text.is_null() {
                    return String::new();
                }
                CStr::from_ptr(text.cast()).to_string_lossy().into_owned()
            }
        };
        format!("OpenGL {}, {}", text(gl::VERSION), text(gl::RENDERER))
    }

    fn make_current(&self) {
        let done = self.egl.make_current(self.display, None, None, Some(self.context));
        done.expect("a context that was current before");
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // Nothing is left to be done where these fail.
        let _ = self.egl.make_current(self.display, None, None, None);
        let _ = self.egl.destroy_context(self.display, self.context);
        let _ = self.egl.terminate(self.display);
    }
}

impl<'a> Canvas<'a> {
    /// Hands `parts` to the driver, beside a canvas of float pixels.
    ///
    /// # Errors
    /// What the driver refuses.
    ///
    /// # Panics
    /// When an index has no corner, or corners and normals differ in number.
    pub fn new(context: &'a Context, width: u32, height: u32, parts: &[Part]) -> Result<Self, String> {
        for part in parts {
            assert_eq!(part.positions.len(), part.normals.len(), "a normal for each corner");
            assert!(
                part.indices.iter().all(|i| (*i as usize) < part.positions.len()),
                "a corner for each index"
            );
        }
        context.make_current();
        let mut canvas =
            Self { context, width, height, framebuffer: 0, renderbuffers: [0; 2], parts: Vec::new() };
        let gl = &context.gl;
        // SAFETY: the context is current, and names are written to places of their number.
        let status = unsafe {
            gl.GenFramebuffers(1, &mut canvas.framebuffer);
            gl.GenRenderbuffers(2, canvas.renderbuffers.as_mut_ptr());
            gl.BindFramebuffer(gl::FRAMEBUFFER, canvas.framebuffer);
            let planes =
                [(gl::RGBA32F, gl::COLOR_ATTACHMENT0), (gl::DEPTH_COMPONENT24, gl::DEPTH_ATTACHMENT)];
            for (name, (format, attachment)) in canvas.renderbuffers.into_iter().zip(planes) {
                gl.BindRenderbuffer(gl::RENDERBUFFER, name);
                gl.RenderbufferStorage(gl::RENDERBUFFER, format, width as i32, height as i32);
                gl.FramebufferRenderbuffer(gl::FRAMEBUFFER, attachment, gl::RENDERBUFFER, name);
            }
            gl.CheckFramebufferStatus(gl::FRAMEBUFFER)
        };
        if status != gl::FRAMEBUFFER_COMPLETE {
            return Err(format!(
                "OpenGL has no canvas of {width}×{height} float pixels (status {status:#x})"
            ));
        }
        canvas.parts = parts.iter().map(|part| upload(gl, part)).collect();
        canvas.check()?;
        Ok(canvas)
    }

    /// Draws all parts, lit at their corners, and returns the pixels row by row from top left. Nothing is clamped.
    ///
    /// # Errors
    /// What the driver refuses.
    ///
    /// # Panics
    /// With more than eight lights.
    pub fn draw(&self, projection: Mat4, view: Mat4, lights: &[Spot]) -> Result<Vec<Vec3>, String> {
        assert!(lights.len() <= LIGHTS, "{} lights; OpenGL promises {LIGHTS}", lights.len());
        self.context.make_current();
        let (width, height) = (self.width as usize, self.height as usize);
        let mut pixels = vec![[0.0_f32; 4]; width * height];
        let gl = &self.context.gl;
        // SAFETY: the context is current; arrays passed are as long as the calls read; buffers hold what `upload` put
        // there, whose indices were checked; `pixels` has room for width × height RGBA floats.
        unsafe {
            gl.BindFramebuffer(gl::FRAMEBUFFER, self.framebuffer);
            gl.Viewport(0, 0, self.width as i32, self.height as i32);
            for target in [gl::CLAMP_VERTEX_COLOR, gl::CLAMP_FRAGMENT_COLOR, gl::CLAMP_READ_COLOR] {
                gl.ClampColor(target, u32::from(gl::FALSE));
            }
            gl.ClearColor(0.0, 0.0, 0.0, 0.0);
            gl.Clear(gl::COLOR_BUFFER_BIT | gl::DEPTH_BUFFER_BIT);
            gl.Enable(gl::DEPTH_TEST);
            gl.ShadeModel(gl::SMOOTH);
            gl.MatrixMode(gl::PROJECTION);
            gl.LoadMatrixf(projection.to_cols_array().as_ptr());
            gl.MatrixMode(gl::MODELVIEW);
            gl.LoadMatrixf(view.to_cols_array().as_ptr());
            shine(gl, lights);
            gl.EnableClientState(gl::VERTEX_ARRAY);
            gl.EnableClientState(gl::NORMAL_ARRAY);
            for part in &self.parts {
                gl.Materialfv(gl::FRONT, gl::DIFFUSE, rgba(part.albedo).as_ptr());
                gl.BindBuffer(gl::ARRAY_BUFFER, part.names[0]);
                gl.VertexPointer(3, gl::FLOAT, 0, null());
                gl.BindBuffer(gl::ARRAY_BUFFER, part.names[1]);
                gl.NormalPointer(gl::FLOAT, 0, null());
                gl.BindBuffer(gl::ELEMENT_ARRAY_BUFFER, part.names[2]);
                gl.DrawElements(gl::TRIANGLES, part.count, gl::UNSIGNED_INT, null());
            }
            gl.ReadPixels(
                0,
                0,
                self.width as i32,
                self.height as i32,
                gl::RGBA,
                gl::FLOAT,
                pixels.as_mut_ptr().cast(),
            );
        }
        self.check()?;
        let rows = pixels.chunks(width.max(1)).rev();
        Ok(rows.flatten().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect())
    }

    fn check(&self) -> Result<(), String> {
        // SAFETY: the context is current.
        match unsafe { self.context.gl.GetError() } {
            gl::NO_ERROR => Ok(()),
            error => Err(format!("OpenGL reports error {error:#x}")),
        }
    }
}

impl Drop for Canvas<'_> {
    fn drop(&mut self) {
        self.context.make_current();
        let gl = &self.context.gl;
        // SAFETY: the names are this canvas' own; zeros are passed over.
        unsafe {
            for part in &self.parts {
                gl.DeleteBuffers(3, part.names.as_ptr());
            }
            gl.DeleteRenderbuffers(2, self.renderbuffers.as_ptr());
            gl.DeleteFramebuffers(1, &self.framebuffer);
        }
    }
}

fn upload(gl: &gl::Gl, part: &Part) -> Buffers {
    let mut names = [0; 3];
    // SAFETY: the context is current (callers see to it); sizes are those of the slices.
    unsafe {
        gl.GenBuffers(3, names.as_mut_ptr());
        let arrays: [(u32, isize, *const c_void); 3] = [
            (gl::ARRAY_BUFFER, size_of_val(&part.positions[..]) as isize, part.positions.as_ptr().cast()),
            (gl::ARRAY_BUFFER, size_of_val(&part.normals[..]) as isize, part.normals.as_ptr().cast()),
            (gl::ELEMENT_ARRAY_BUFFER, size_of_val(&part.indices[..]) as isize, part.indices.as_ptr().cast()),
        ];
        for (name, (target, size, data)) in names.into_iter().zip(arrays) {
            gl.BindBuffer(target, name);
            gl.BufferData(target, size, data, gl::STATIC_DRAW);
        }
    }
    Buffers { albedo: part.albedo, names, count: part.indices.len() as i32 }
}

/// Sets all lights. Positions and axes go through the view, which must be loaded.
///
/// # Safety
/// The context is current, and there are no more lights than [`LIGHTS`].
unsafe fn shine(gl: &gl::Gl, lights: &[Spot]) {
    let black = rgba(Vec3::ZERO);
    // SAFETY: the caller's promise; arrays are of four or three floats, as each call reads.
    unsafe {
        gl.Enable(gl::LIGHTING);
        gl.LightModelfv(gl::LIGHT_MODEL_AMBIENT, black.as_ptr());
        // A one-sided reflector: the back is lit by itself, in black.
        gl.LightModeli(gl::LIGHT_MODEL_TWO_SIDE, 1);
        for name in [gl::AMBIENT, gl::SPECULAR, gl::EMISSION] {
            gl.Materialfv(gl::FRONT_AND_BACK, name, black.as_ptr());
        }
        gl.Materialfv(gl::BACK, gl::DIFFUSE, black.as_ptr());
        for (i, light) in lights.iter().enumerate() {
            let name = gl::LIGHT0 + i as u32;
            gl.Enable(name);
            gl.Lightfv(name, gl::AMBIENT, black.as_ptr());
            gl.Lightfv(name, gl::SPECULAR, black.as_ptr());
            gl.Lightfv(name, gl::DIFFUSE, rgba(light.colour).as_ptr());
            gl.Lightfv(name, gl::POSITION, light.position.extend(1.0).to_array().as_ptr());
            gl.Lightfv(name, gl::SPOT_DIRECTION, light.direction.to_array().as_ptr());
            gl.Lightf(name, gl::SPOT_EXPONENT, light.exponent);
            // 90° is the widest cone; 180° turns the spot off.
            gl.Lightf(name, gl::SPOT_CUTOFF, if light.exponent == 0.0 { 180.0 } else { 90.0 });
            let names = [gl::CONSTANT_ATTENUATION, gl::LINEAR_ATTENUATION, gl::QUADRATIC_ATTENUATION];
            for (falloff, value) in names.into_iter().zip(light.attenuation) {
                gl.Lightf(name, falloff, value);
            }
        }
        for i in lights.len()..LIGHTS {
            gl.Disable(gl::LIGHT0 + i as u32);
        }
    }
}

fn rgba(colour: Vec3) -> [f32; 4] {
    colour.extend(1.0).to_array()
}

/// What the system said at the bottom of a chain of causes.
fn innermost(error: &dyn std::error::Error) -> String {
    let mut cause = error;
    while let Some(next) = cause.source() {
        cause = next;
    }
    cause.to_string()
}
