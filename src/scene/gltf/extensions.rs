//! Which glTF extensions are read, and what becomes of the others. One table: whether a file uses an extension or requires it,
//! the user is told the same.

use super::Reason;
use super::unpack::{draco, meshopt};
use super::{ies, image_light};
use serde_json::Value;

/// What becomes of an extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Standing {
    /// It is read, or it has no part in a picture.
    Fine,
    /// Told of each thing that uses it.
    ToldWhereUsed,
    /// Its geometry cannot be read, as this program was built without what unpacks it.
    Packed,
}

use Standing::{Fine, Packed, ToldWhereUsed};

const KNOWN: &[(&str, Standing)] = &[
    ("KHR_lights_punctual", Fine),
    ("KHR_materials_emissive_strength", Fine),
    ("KHR_materials_ior", Fine),
    ("KHR_materials_specular", Fine),
    ("KHR_materials_transmission", Fine),
    ("KHR_materials_unlit", Fine),
    ("KHR_materials_volume", Fine),
    ("KHR_mesh_quantization", Fine),
    ("KHR_texture_transform", Fine),
    (ies::NAME, Fine),
    (image_light::NAME, Fine),
    ("EXT_mesh_gpu_instancing", Fine),
    ("EXT_texture_webp", Fine),
    ("FB_ngon_encoding", Fine),
    ("KHR_animation_pointer", Fine),
    ("KHR_materials_variants", Fine),
    ("EXT_instance_features", Fine),
    ("EXT_mesh_features", Fine),
    ("EXT_structural_metadata", Fine),
    ("KHR_audio_emitter", Fine),
    ("KHR_implicit_shapes", Fine),
    ("KHR_interactivity", Fine),
    ("KHR_node_hoverability", Fine),
    ("KHR_node_selectability", Fine),
    ("KHR_physics_rigid_bodies", Fine),
    ("KHR_xmp", Fine),
    ("KHR_xmp_json_ld", Fine),
    ("EXT_texture_avif", ToldWhereUsed),
    ("KHR_materials_pbrSpecularGlossiness", Fine),
    ("KHR_texture_basisu", ToldWhereUsed),
    ("MSFT_texture_dds", ToldWhereUsed),
    ("KHR_materials_clearcoat", Fine),
    ("KHR_materials_sheen", Fine),
    ("KHR_materials_anisotropy", Fine),
    ("KHR_materials_iridescence", Fine),
    ("KHR_materials_dispersion", Fine),
    ("KHR_materials_diffuse_transmission", Fine),
    (draco::NAME, if cfg!(feature = "draco") { Fine } else { Packed }),
    (meshopt::NAMES[0], if cfg!(feature = "meshopt") { Fine } else { Packed }),
    (meshopt::NAMES[1], if cfg!(feature = "meshopt") { Fine } else { Packed }),
];

/// What becomes of an extension; None: nobody here knows it.
pub(super) fn standing(name: &str) -> Option<Standing> {
    match KNOWN.iter().find(|(known, _)| *known == name) {
        Some((_, standing)) => Some(*standing),
        None if name.starts_with("KHR_materials_") => Some(ToldWhereUsed),
        None => None,
    }
}

/// Refuses a file whose geometry lies in a packing that cannot be undone. Where the file carries the plain numbers
/// too, for readers without the extension, those are read.
pub(super) fn check_packing(json: &Value) -> Result<(), Reason> {
    let required = json["extensionsRequired"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let required: Vec<&str> = required.filter(|name| standing(name) == Some(Packed)).collect();
    let views = || things(&json["bufferViews"]);
    let primitives = || things(&json["meshes"]).flat_map(|mesh| things(&mesh["primitives"]));
    let packs = |thing: &Value, name: &str| thing["extensions"].get(name).is_some();
    let without_data = |primitive: &Value| {
        let accessor = primitive["attributes"]["POSITION"].as_u64().and_then(|i| usize::try_from(i).ok());
        accessor.is_some_and(|i| json["accessors"][i].get("bufferView").is_none())
    };
    let packed = required.iter().find(|name| views().chain(primitives()).any(|thing| packs(thing, name)));
    let draco = standing(draco::NAME) == Some(Packed)
        && primitives().any(|primitive| packs(primitive, draco::NAME) && without_data(primitive));
    match packed.copied().or(draco.then_some(draco::NAME)) {
        Some(name) => Err(format!(
            "its geometry is packed by {name}, which this halflight was built without; build it with the default cargo features, \
             or export without compression"
        )),
        None => Ok(()),
    }
}

fn things(list: &Value) -> impl Iterator<Item = &Value> {
    list.as_array().into_iter().flatten()
}
