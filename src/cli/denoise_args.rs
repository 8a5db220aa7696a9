//! `--denoise`: what it needs of a render, and where there is nothing to denoise.

use crate::error::{Error, Result};
use crate::film::denoise::{FEATURES, FEWEST_PASSES};
use crate::film::{Layer, StateHead};
use crate::plan::Method;
use clap::Args;
use std::path::Path;

/// Whether a denoised picture is made too.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct DenoiseArgs {
    /// Also make a denoised picture: layer `denoised` of the EXR file, and what its preview or a file of another format shows. The
    /// picture itself and its error stay as they are.
    #[arg(long)]
    pub denoise: bool,
}

impl DenoiseArgs {
    /// The layers of the film: those asked for, and what the denoiser looks at.
    ///
    /// # Errors
    /// The method does not make them, or an atlas is made, in which there are a hundred pictures.
    pub fn layers(self, asked: &[Layer], method: Method, atlas: bool) -> Result<Vec<Layer>> {
        let mut layers = asked.to_vec();
        if !self.denoise {
            return Ok(layers);
        }
        if !method.shoots() {
            return Err(Error::Usage(format!(
                "--denoise looks at albedo and normals, which --method {} does not tell; use --method photon, or leave it out",
                method.name()
            )));
        }
        if atlas {
            return Err(Error::Usage(
                "--denoise: an atlas holds a hundred pictures as they are; leave it out, or leave --atlas out".into(),
            ));
        }
        layers.extend(FEATURES.into_iter().filter(|layer| !asked.contains(layer)));
        Ok(layers)
    }

    /// Refuses a state without what the denoiser looks at.
    pub fn check(self, path: &Path, head: &StateHead) -> Result<()> {
        match FEATURES.into_iter().find(|layer| self.denoise && !head.layers.contains(layer)) {
            None => Ok(()),
            Some(missing) => {
                let reason = format!(
                    "the state has no layer {missing}, which --denoise looks at; leave it out, or render anew with --denoise"
                );
                Err(Error::Image { path: path.into(), reason })
            }
        }
    }
}

/// What is said of a picture of so few passes that nothing is known of its error. None: it can be denoised.
pub fn too_few(passes: u32) -> Option<String> {
    let few = passes < FEWEST_PASSES;
    few.then(|| format!("note: --denoise: nothing is denoised, as {passes} passes do not tell their error; {FEWEST_PASSES} do"))
}
