//! KHR_materials_variants: one file, its materials in several colours.

use super::Reason;
use super::notes::Notes;
use crate::scene::names::{clean, listed};
use gltf::json::mesh::Primitive;
use gltf::json::{Root, Value};

const NAME: &str = "KHR_materials_variants";

/// The names of the variants that a file has.
pub(super) fn names(root: &Root) -> Vec<String> {
    let says = root.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
    let list = says.and_then(|says| says["variants"].as_array());
    list.into_iter().flatten().map(|variant| variant["name"].as_str().unwrap_or("").to_owned()).collect()
}

/// The number of the variant that is wanted by name, else by number from 0. None: the materials that primitives name.
pub(super) fn choose(
    names: &[String],
    wanted: Option<&str>,
    notes: &mut Notes,
) -> Result<Option<usize>, Reason> {
    let known = || {
        let known: Vec<_> = names.iter().map(|name| clean(name)).collect();
        listed(known.iter().map(String::as_str))
    };
    let Some(wanted) = wanted else {
        if !names.is_empty() {
            notes.line(format!("its materials have variants; --variant NAME shows one of them: {}", known()));
        }
        return Ok(None);
    };
    let named = names.iter().position(|name| name == wanted);
    let numbered = || wanted.parse().ok().filter(|index| *index < names.len());
    match named.or_else(numbered) {
        Some(index) => Ok(Some(index)),
        None if names.is_empty() => {
            Err(format!("has no variant `{wanted}`, as it has none; leave out --variant"))
        }
        None => Err(format!(
            "has no variant `{wanted}`; --variant takes a name, or a number from 0: it has {}",
            known()
        )),
    }
}

/// The material of a primitive in a variant. None: the one that it names itself.
pub(super) fn material(primitive: &Primitive, variant: Option<usize>) -> Option<usize> {
    let variant = variant? as u64;
    let mappings = primitive.extensions.as_ref()?.others.get(NAME)?["mappings"].as_array()?;
    let holds = |mapping: &&Value| {
        mapping["variants"]
            .as_array()
            .is_some_and(|variants| variants.iter().any(|v| v.as_u64() == Some(variant)))
    };
    usize::try_from(mappings.iter().find(holds)?["material"].as_u64()?).ok()
}
