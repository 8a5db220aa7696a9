//! A small good file to damage: a tetrahedron with indices and normals, a quad, a lamp and a camera.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use halflight::error::Error;
use halflight::scene::Scene;
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

/// The JSON and the buffer. Accessors: 0 positions, 1 normals, 2 indices (all tetrahedron), 3 positions (quad).
#[derive(Clone)]
pub struct Small {
    pub json: Value,
    pub binary: Vec<u8>,
}

impl Small {
    pub fn new() -> Self {
        let tetrahedron = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0_f32]];
        let normals = [[-0.6, -0.6, -0.6], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0_f32]];
        let indices: [u16; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
        let quad = [[-2.0, -1.0, 2.0], [2.0, -1.0, 2.0], [-2.0, -1.0, -2.0], [2.0, -1.0, -2.0_f32]];
        let floats = |v: &[[f32; 3]]| v.iter().flatten().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let binary = [
            floats(&tetrahedron),
            floats(&normals),
            indices.iter().flat_map(|i| i.to_le_bytes()).collect(),
            floats(&quad),
        ]
        .concat();
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "name": "Stage", "nodes": [0, 1, 2, 3] }],
            "nodes": [
                { "name": "Body", "mesh": 0 },
                { "name": "Sheet", "mesh": 1 },
                { "name": "Bulb", "translation": [0, 3, 0], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
                { "name": "Eye", "camera": 0, "translation": [0, 0, 5] }
            ],
            "meshes": [
                { "name": "Tetra", "primitives": [
                    { "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2, "material": 0 }] },
                { "name": "Quad", "primitives": [{ "attributes": { "POSITION": 3 }, "mode": 5, "material": 1 }] }
            ],
            "materials": [
                { "name": "Skin", "pbrMetallicRoughness": { "metallicFactor": 0 },
                  "extensions": { "KHR_materials_specular": { "specularFactor": 0 } } },
                { "name": "Cloth", "doubleSided": true, "pbrMetallicRoughness": { "metallicFactor": 0 },
                  "extensions": { "KHR_materials_specular": { "specularFactor": 0 } } }
            ],
            "extensions": { "KHR_lights_punctual": { "lights": [
                { "name": "Lux", "type": "point", "intensity": 10 }] } },
            "cameras": [{ "name": "Lens", "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4,
                  "min": [0, 0, 0], "max": [1, 1, 1] },
                { "bufferView": 1, "componentType": 5126, "type": "VEC3", "count": 4 },
                { "bufferView": 2, "componentType": 5123, "type": "SCALAR", "count": 12 },
                { "bufferView": 3, "componentType": 5126, "type": "VEC3", "count": 4,
                  "min": [-2, -1, -2], "max": [2, -1, 2] }
            ],
            "bufferViews": [
                { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
                { "buffer": 0, "byteOffset": 48, "byteLength": 48 },
                { "buffer": 0, "byteOffset": 96, "byteLength": 24 },
                { "buffer": 0, "byteOffset": 120, "byteLength": 48 }
            ],
            "buffers": [{ "byteLength": binary.len() }]
        });
        Self { json, binary }
    }

    /// With one place of the JSON set to a value, or to nothing by null.
    pub fn with(mut self, pointer: &str, value: Value) -> Self {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        let parent = self.json.pointer_mut(parent).unwrap_or_else(|| panic!("{pointer} has no parent"));
        match (parent, value) {
            (Value::Object(map), Value::Null) => drop(map.remove(key)),
            (Value::Object(map), value) => drop(map.insert(key.to_owned(), value)),
            (other, value) => other[key.parse::<usize>().expect("an index")] = value,
        }
        self
    }

    /// With a float of the buffer set.
    pub fn with_float(mut self, index: usize, value: f32) -> Self {
        self.binary[4 * index..4 * index + 4].copy_from_slice(&value.to_le_bytes());
        self
    }

    /// With an accessor more of these numbers, `kind` of glTF at a time. Returns its index.
    pub fn add(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => panic!("{kind}"),
        };
        let (start, length) = (self.binary.len(), 4 * numbers.len());
        self.binary.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        self.json["buffers"][0]["byteLength"] = json!(self.binary.len());
        let views = self.json["bufferViews"].as_array_mut().expect("a list");
        views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length }));
        let view = views.len() - 1;
        let accessors = self.json["accessors"].as_array_mut().expect("a list");
        accessors.push(json!({ "bufferView": view, "componentType": 5126, "type": kind, "count": numbers.len() / width }));
        accessors.len() - 1
    }

    /// With its buffer as a data URI, where it has no URI yet.
    pub fn embedded(mut self) -> Self {
        if self.json["buffers"][0]["uri"].is_null() {
            let data = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&self.binary));
            self.json["buffers"][0]["uri"] = json!(data);
        }
        self
    }

    /// As binary glTF.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let words = |words: [usize; 2]| words.map(|w| (w as u32).to_le_bytes()).concat();
        let total = 28 + json.len() + self.binary.len();
        let [head, length] = [words([2, total]), (json.len() as u32).to_le_bytes().to_vec()];
        let size = (self.binary.len() as u32).to_le_bytes().to_vec();
        let parts = [b"glTF".to_vec(), head, length, b"JSON".to_vec(), json, size, b"BIN\0".to_vec()];
        [parts.concat(), self.binary.clone()].concat()
    }

    /// Loads it as text.
    pub fn load(self) -> Result<Scene, Error> {
        load_bytes("small.gltf", self.embedded().json.to_string().as_bytes())
    }

    /// Loads it; must be good.
    pub fn good(self) -> Scene {
        self.load().unwrap_or_else(|e| panic!("{e}"))
    }

    /// The message of the error it must give, checked to be one line that begins with the file.
    pub fn error(self) -> String {
        message("small.gltf", self.load())
    }
}

/// Writes a file of the given name into a folder of its own and loads it.
pub fn load_bytes(name: &str, bytes: &[u8]) -> Result<Scene, Error> {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    Scene::load(path)
}

/// The one line that says what is wrong with the file.
pub fn message(file: &str, result: Result<Scene, Error>) -> String {
    let error = result.err().unwrap_or_else(|| panic!("{file} was read"));
    assert_eq!(error.exit_code(), 2);
    let message = error.to_string();
    let name = Path::new(file).file_name().and_then(|n| n.to_str()).expect("a name");
    assert!(message.contains(name) && !message.contains('\n'), "{message:?}");
    println!("{message}");
    message
}
