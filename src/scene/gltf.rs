//! glTF in.
use super::Scene;
use crate::error::{Error, Result};
use std::path::Path;

pub(super) fn load(path: &Path) -> Result<Scene> {
    Err(Error::scene(path.display().to_string(), "not yet"))
}
