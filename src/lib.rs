//! halflight renders scenes lit by *vector-valued light*: light with an invisible half that travels and a visible half
//! that is seen, turned into each other by 2×2 matrix reflectances. One algorithm gives global illumination, local
//! illumination, shadows without inter-reflection and inter-reflection without shadows, with caustics.
//!
//! ```standalone_crate
//! use halflight::film::{Layer, write_exr, write_png};
//! use halflight::plan::Settings;
//! use halflight::render::Render;
//! use halflight::scene::{Illumination, Scene};
//!
//! fn main() -> halflight::error::Result<()> {
//! #   let folder = tempfile::tempdir().expect("a temporary folder");
//! #   std::env::set_current_dir(folder.path()).expect("a folder to be in");
//!     let mut scene = Scene::load("builtin:cornell-spheres")?;
//!     scene.illuminate(Some(Illumination::SHADOWLESS), &[])?;
//!     let settings = Settings { width: 32, height: 32, paths: Some(4_000), ..Settings::default() };
//!     let mut render = Render::new(scene, settings, &[Layer::Visible, Layer::Error])?;
//!     while render.film().relative_error().is_none_or(|error| error > 0.3) {
//!         render.pass();
//!     }
//!     write_exr("spheres.exr".as_ref(), render.film(), &render.header())?;
//!     write_png("spheres.png".as_ref(), render.film(), 0.0)?;
//!     Ok(())
//! }
//! ```
//!
//! # The story
//!
//! ```text
//! scene.glb ─ load ─► Scene ─ plan ─► Plan ─ learn ─► Frame ─┐ for each pass
//!                                                            ├─ shoot ─► photons ─ build ─► maps ─┐
//!                                                            └─ camera rays ───────── gather ◄────┘ ─► Film ─► EXR, PNG
//!                                                               camera rays ─ path trace (the opponent) ─► the same Film
//! ```
//!
//! 1. [`scene`] loads a glTF file, or is built in code; every material becomes a matrix BSDF [`optics::Bsdf`], `F = Σ C_k f_k`.
//! 2. [`plan`] looks at the matrices, decides what the picture needs, and leaves out the rest. A [`plan::Plan`] does not
//!    change; what a few trial paths teach, and what may vary from pass to pass, is a [`plan::Frame`] (`pilot`).
//! 3. `shoot` sends photons from the luminaires (`emission`); matrices act on their [`light::Light`] from the left.
//! 4. `photon_map` builds kd-trees of them.
//! 5. `gather` follows camera rays whose [`light::Row`] is multiplied from the right, connects them to luminaires
//!    (`connect`) and reads the rest from the maps.
//! 6. [`film`] sums passes, which are independent: their spread is the error bar.
//!
//! `path_trace` gathers all light from the camera and shares no estimator with 3–5, so that agreement is evidence.
//!
//! `docs/architecture.md` is for those who change the code: conventions, where to add what, how it is tested.
//!
//! # Names and units
//!
//! | name | what | unit |
//! |---|---|---|
//! | `from`, `to` | where a walk came from and goes on, unit, away from the surface | |
//! | `wi`, `wo` | to the light, to the eye, unit, away from the surface | |
//! | power | what a photon carries | W |
//! | radiance | what a pixel shows | W m⁻² sr⁻¹ |
//! | irradiance | photon power per area | W m⁻² |
//! | `Pdf` | density of a direction, sr⁻¹; for a delta lobe a probability | |
//! | `n`, `m` | reflections, straight crossings of a path | |
//! | `s`, `t` | inter-reflection, shadowlessness | |
//! | `k` | multiplication factor of reflected power per generation | |
//! | footprint | side of what a pixel covers on a surface that faces it | m |
//!
//! Imports run one way, each module using those before it (a test of the repository holds them to it):
//!
//! ```text
//! error, machine, stop, pictures, light, sampling, optics, scene, rays, rims, clearance, photon, emission, existence, connect,
//! plan, shoot, photon_map, gather, path_trace, film, measure, mattes, pass, pilot, memory, atlas, render,
//! compare, report, stability, cli
//! ```
//!
//! # References
//!
//! D. C. Banks, K. M. Beason: Retro-rendering with vector-valued light (the paper; equation numbers are its own). ·
//! H. W. Jensen 2001: Realistic image synthesis using photon mapping. ·
//! C. Knaus, M. Zwicker 2011: Progressive photon mapping: a probabilistic approach. ·
//! E. Veach 1997: Robust Monte Carlo methods for light transport simulation. ·
//! S. Woop, C. Benthin, I. Wald 2013: Watertight ray/triangle intersection. ·
//! J. Arvo 1995: Stratified sampling of spherical triangles. ·
//! B. Burley 2020: Practical hash-based Owen scrambling. ·
//! M. Pharr, W. Jakob, G. Humphreys: Physically based rendering, 4th ed.

// What is said goes through `cli::out`, which a broken log does not end.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod atlas;
pub mod compare;
pub mod error;
pub mod film;
pub mod light;
pub mod mattes;
pub mod measure;
pub mod optics;
pub mod plan;
pub mod render;
pub mod report;
pub mod scene;
pub mod stability;

mod machine;
mod pass;
mod pictures;

// What is below is no part of the interface and free to change; tests and benches of this repository look at it.
#[doc(hidden)]
pub mod clearance;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod connect;
#[doc(hidden)]
pub mod emission;
#[doc(hidden)]
pub mod existence;
#[doc(hidden)]
pub mod gather;
#[doc(hidden)]
pub mod memory;
#[doc(hidden)]
pub mod path_trace;
#[doc(hidden)]
pub mod photon;
#[doc(hidden)]
pub mod photon_map;
#[doc(hidden)]
pub mod pilot;
#[doc(hidden)]
pub mod rays;
pub mod rims;
#[doc(hidden)]
pub mod sampling;
#[doc(hidden)]
pub mod shoot;
#[doc(hidden)]
pub mod stop;

/// The examples of README.md compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
