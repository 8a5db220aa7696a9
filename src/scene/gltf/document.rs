//! The JSON of a file, made fit for the types of the gltf crate: files are less strict than those, and more precise than f32.

use super::Reason;
use super::extensions::check_packing;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::Root;
use serde_json::{Number, Value, json};

/// What the JSON says.
pub(super) struct Document {
    pub root: Root,
    /// How each node stands in its parent, in the f64 of the file: a scene may stand at 5,400,000 m with every node.
    pub stances: Vec<Stance>,
    /// As they are: nothing wrong with them matters where no pose is asked for.
    pub animations: Vec<Value>,
}

/// How a node stands in its parent.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stance {
    Matrix(DAffine3),
    Parts(Parts),
}

/// What animations move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts {
    pub scale: DVec3,
    pub rotation: DQuat,
    pub translation: DVec3,
}

impl Stance {
    pub fn to_parent(self) -> DAffine3 {
        match self {
            Self::Matrix(matrix) => matrix,
            Self::Parts(Parts { scale, rotation, translation }) => {
                DAffine3::from_scale_rotation_translation(scale, rotation, translation)
            }
        }
    }

    /// Its parts, into which a matrix is taken apart: files should not move nodes that have one.
    pub fn parts_mut(&mut self) -> &mut Parts {
        if let Self::Matrix(matrix) = self {
            let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
            *self = Self::Parts(Parts { scale, rotation, translation });
        }
        match self {
            Self::Parts(parts) => parts,
            Self::Matrix(_) => unreachable!("it was taken apart"),
        }
    }
}

/// Parses it.
pub(super) fn parse(text: &[u8]) -> Result<Document, Reason> {
    let damaged = |e: serde_json::Error| {
        format!("its JSON is damaged or not glTF 2.0 ({e}); export the scene again as glTF 2.0")
    };
    let mut json: Value = serde_json::from_slice(text).map_err(damaged)?;
    check_version(&mut json)?;
    loosen(&mut json);
    check_packing(&json)?;
    let animations = match json.as_object_mut().and_then(|all| all.remove("animations")) {
        Some(Value::Array(animations)) => animations,
        _ => Vec::new(),
    };
    let nodes = json["nodes"].as_array().into_iter().flatten();
    let stances = nodes.map(stance).collect();
    add_planes(&mut json);
    let root = serde_json::from_value(json).map_err(damaged)?;
    Ok(Document { root, stances, animations })
}

fn check_version(json: &mut Value) -> Result<(), Reason> {
    let asset =
        json.get_mut("asset").ok_or("has no asset, so it is not glTF; export the scene as glTF 2.0")?;
    for key in ["version", "minVersion"] {
        if let Some(Value::Number(number)) = asset.get(key) {
            asset[key] = json!(number.to_string());
        }
    }
    let version = asset["minVersion"].as_str().or(asset["version"].as_str());
    let version = version.ok_or("has no asset version, so it is not glTF; export the scene as glTF 2.0")?;
    if version.split('.').next() == Some("2") {
        return Ok(());
    }
    Err(format!("is glTF {version}; only glTF 2.0 can be read, convert or export it again"))
}

/// Writes whole numbers as such (24.0 is 24 where a count is wanted, and 24 is 24.0 where a length is) and takes out
/// what is null, which is how some exporters write what is not there.
fn loosen(value: &mut Value) {
    match value {
        Value::Number(number) => {
            if let Some(whole) = whole(number) {
                *number = whole;
            }
        }
        Value::Array(values) => values.iter_mut().for_each(loosen),
        Value::Object(map) => {
            map.retain(|_, value| !value.is_null());
            map.values_mut().for_each(loosen);
        }
        _ => {}
    }
}

/// A float as the integer that it is. None: it is none, or one beyond those that f64 tells apart.
fn whole(number: &Number) -> Option<Number> {
    let value = number.as_f64().filter(|_| number.is_f64())?;
    let exact = value.fract() == 0.0 && value.abs() < 9_007_199_254_740_992.0; // 2⁵³
    let negative = value.is_sign_negative();
    match (exact, negative) {
        (true, false) => Some(Number::from(value as u64)),
        (true, true) if value != 0.0 => Some(Number::from(value as i64)),
        _ => None, // the sign of −0.0 would be lost
    }
}

/// Cameras without clipping planes, which the crate asks for and nothing here reads.
fn add_planes(json: &mut Value) {
    let cameras = json.get_mut("cameras").and_then(Value::as_array_mut).into_iter().flatten();
    for camera in cameras.filter_map(Value::as_object_mut) {
        for kind in ["perspective", "orthographic"] {
            let Some(lens) = camera.get_mut(kind).and_then(Value::as_object_mut) else { continue };
            lens.entry("znear").or_insert(json!(0.01));
            lens.entry("zfar").or_insert(json!(1000));
        }
    }
}

fn stance(node: &Value) -> Stance {
    if let Some(matrix) = numbers(&node["matrix"]) {
        return Stance::Matrix(DAffine3::from_mat4(DMat4::from_cols_array(&matrix)));
    }
    let vector = |key: &str| numbers(&node[key]).map(DVec3::from_array);
    let rotation = numbers(&node["rotation"]).map(|q| DQuat::from_array(q).normalize());
    Stance::Parts(Parts {
        scale: vector("scale").unwrap_or(DVec3::ONE),
        rotation: rotation.unwrap_or(DQuat::IDENTITY),
        translation: vector("translation").unwrap_or(DVec3::ZERO),
    })
}

/// As many numbers as asked for. None: something else; the crate then says what.
fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(Value::as_f64).collect();
    numbers?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    fn loosened(text: &str) -> String {
        let mut value = serde_json::from_str(text).unwrap();
        loosen(&mut value);
        value.to_string()
    }

    #[test]
    fn floats_that_are_whole_are_integers_and_nothing_else_changes() {
        assert_eq!(loosened("[24.0, -3.0, 2e2, 1.5, 7]"), "[24,-3,200,1.5,7]");
        assert_eq!(loosened("[-0.0, 1e300, 1.8e19]"), "[-0.0,1e+300,1.8e+19]");
        assert_eq!(loosened(r#"{"a": null, "b": [null, {"c": null}]}"#), r#"{"b":[null,{}]}"#);
    }

    #[test]
    fn nodes_stand_where_the_file_says_to_the_last_bit_of_f64() {
        let text = r#"{"asset": {"version": "2.0"}, "nodes": [
            {"translation": [430000.3, -0.7, 5400000.1]},
            {"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 430000.3, -0.7, 5400000.1, 1]}]}"#;
        for mut stance in parse(text.as_bytes()).unwrap().stances {
            assert_eq!(stance.to_parent().translation, DVec3::new(430_000.3, -0.7, 5_400_000.1));
            stance.parts_mut().scale = 2.0 * DVec3::ONE;
            assert_eq!(stance.to_parent().matrix3, 2.0 * DMat3::IDENTITY);
        }
    }

    #[test]
    fn a_camera_needs_no_clipping_planes() {
        let text = r#"{"asset": {"version": 2.0}, "cameras": [{"type": "perspective", "perspective": {"yfov": 1}},
            {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1}}]}"#;
        assert_eq!(parse(text.as_bytes()).unwrap().root.cameras.len(), 2);
    }
}
