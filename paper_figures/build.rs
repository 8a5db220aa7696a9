//! Bindings of OpenGL's compatibility profile, which still has the fixed-function pipeline.

use gl_generator::{Api, Fallbacks, Profile, Registry, StructGenerator};
use std::{env, fs::File, path::Path};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let out = env::var("OUT_DIR").expect("cargo sets it");
    let mut file = File::create(Path::new(&out).join("gl.rs")).expect("the folder of build output");
    Registry::new(Api::Gl, (3, 3), Profile::Compatibility, Fallbacks::All, [])
        .write_bindings(StructGenerator, &mut file)
        .expect("the folder of build output");
}
