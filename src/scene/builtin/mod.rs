//! The built-in scenes.
use super::Scene;
use crate::error::{Error, Result};

pub(super) const LIST: &[(&str, &str)] = &[];

pub(super) fn scene(name: &str) -> Result<Scene> {
    Err(Error::scene(format!("builtin:{name}"), "no such scene"))
}
