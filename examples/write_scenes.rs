//! Writes the built-in scenes that are also files: `cargo run --release --example write_scenes`, in the root of
//! the repository. A test checks that files and built-in scenes agree.

use glam::Vec3;
use halflight::optics::Lobe;
use halflight::scene::{Material, Projection, Scene};
use serde_json::{Value, json};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new("scenes");
    let (mut json, binary) = export(&Scene::load("builtin:caustic-box")?)?;
    json["buffers"] = json!([{ "byteLength": binary.len() }]);
    std::fs::write(folder.join("caustic-box.glb"), glb(&json.to_string(), &binary))?;

    let (mut json, binary) = export(&Scene::load("builtin:cornell-spheres")?)?;
    json["buffers"] = json!([{ "byteLength": binary.len(), "uri": "cornell-spheres.bin" }]);
    std::fs::write(folder.join("cornell-spheres.gltf"), serde_json::to_string_pretty(&json)? + "\n")?;
    std::fs::write(folder.join("cornell-spheres.bin"), binary)?;
    Ok(())
}

/// The JSON without its buffers, and the buffer.
fn export(scene: &Scene) -> Result<(Value, Vec<u8>), Box<dyn Error>> {
    let mut file = File::default();
    let mut nodes = Vec::new();
    let mut meshes = Vec::new();
    for (index, surface) in scene.surfaces.iter().enumerate() {
        let mut primitive = file.primitive(scene, index as u32, surface.smooth);
        primitive["material"] = json!(surface.material);
        meshes.push(json!({ "name": surface.name, "primitives": [primitive] }));
        nodes.push(json!({ "name": surface.name, "mesh": index, "translation": scene.origin.to_array() }));
    }
    let camera = &scene.camera;
    let Projection::Perspective { yfov } = camera.projection else { return Err("only perspective".into()) };
    let place = (camera.position.as_dvec3() + scene.origin).to_array();
    if camera.forward != Vec3::NEG_Z {
        return Err("only cameras that look along -Z".into());
    }
    nodes.push(json!({ "name": "Camera", "camera": 0, "translation": place }));
    let perspective = json!({ "yfov": yfov, "aspectRatio": camera.aspect.unwrap_or(1.0), "znear": 0.01 });
    let roots: Vec<_> = (0..nodes.len()).collect();
    let materials: Result<Vec<_>, _> = scene.materials.iter().map(material).collect();
    let json = json!({
        "asset": { "version": "2.0", "generator": "halflight examples/write_scenes.rs" },
        "extensionsUsed": [
            "KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_specular",
            "KHR_materials_transmission"
        ],
        "scene": 0,
        "scenes": [{ "nodes": roots }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials?,
        "cameras": [{ "type": "perspective", "perspective": perspective }],
        "accessors": file.accessors,
        "bufferViews": file.views,
    });
    Ok((json, file.binary))
}

fn material(material: &Material) -> Result<Value, Box<dyn Error>> {
    let [(_, lobe)] = material.lobes[..] else { return Err("only single lobes".into()) };
    let (colour, metal, roughness, double_sided) = match lobe {
        Lobe::Diffuse(lobe) => (lobe.albedo, 0, 1, lobe.two_sided),
        Lobe::Mirror(lobe) if lobe.grazing == Vec3::ONE => (lobe.tint, 1, 0, lobe.two_sided),
        Lobe::Dielectric(lobe) => (lobe.tint, 0, 0, false),
        _ => return Err("only diffuse, metal and solid glass".into()),
    };
    let mut json = json!({
        "name": material.name,
        "doubleSided": double_sided,
        "pbrMetallicRoughness": {
            "baseColorFactor": [colour.x, colour.y, colour.z, 1],
            "metallicFactor": metal,
            "roughnessFactor": roughness
        },
        "extensions": {},
    });
    match lobe {
        Lobe::Dielectric(lobe) => {
            json["extensions"]["KHR_materials_transmission"] = json!({ "transmissionFactor": 1 });
            json["extensions"]["KHR_materials_ior"] = json!({ "ior": lobe.ior });
        }
        // Our diffuse lobe has no specular coat.
        _ => json["extensions"]["KHR_materials_specular"] = json!({ "specularFactor": 0 }),
    }
    if let Some(emission) = material.emission {
        let strength = emission.radiance.visible.max_element();
        json["emissiveFactor"] = json!((emission.radiance.visible / strength).to_array());
        json["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
    }
    Ok(json)
}

#[derive(Default)]
struct File {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl File {
    fn primitive(&mut self, scene: &Scene, surface: u32, smooth: bool) -> Value {
        let mesh = &scene.mesh;
        let own = mesh.triangles.iter().zip(&mesh.surface).filter(|(_, s)| **s == surface);
        let corners: Vec<u32> = own.flat_map(|(triangle, _)| *triangle).collect();
        let (first, last) = corners.iter().fold((u32::MAX, 0), |(a, b), i| (a.min(*i), b.max(*i)));
        let range = first as usize..=last as usize;
        let positions = &mesh.positions[range.clone()];
        let min = positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let max = positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let bounds = json!({ "min": min.to_array(), "max": max.to_array() });
        let mut attributes = json!({ "POSITION": self.vectors(positions, bounds) });
        if smooth {
            attributes["NORMAL"] = json!(self.vectors(&mesh.normals[range], json!({})));
        }
        let bytes: Vec<u8> = corners.iter().flat_map(|i| ((i - first) as u16).to_le_bytes()).collect();
        let indices = json!({ "componentType": 5123, "type": "SCALAR", "count": corners.len() });
        json!({ "attributes": attributes, "indices": self.accessor(&bytes, indices) })
    }

    fn vectors(&mut self, vectors: &[Vec3], mut accessor: Value) -> usize {
        let bytes: Vec<u8> = vectors.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect();
        accessor["componentType"] = json!(5126);
        accessor["type"] = json!("VEC3");
        accessor["count"] = json!(vectors.len());
        self.accessor(&bytes, accessor)
    }

    fn accessor(&mut self, bytes: &[u8], mut accessor: Value) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        self.binary.extend_from_slice(bytes);
        accessor["bufferView"] = json!(self.views.len());
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let pad = |bytes: &[u8], filler: u8| {
        let mut padded = bytes.to_vec();
        padded.resize(bytes.len().next_multiple_of(4), filler);
        padded
    };
    let (json, binary) = (pad(json.as_bytes(), b' '), pad(binary, 0));
    let mut file = b"glTF".to_vec();
    let words = [2, 28 + json.len() + binary.len(), json.len()];
    file.extend(words.iter().flat_map(|w| (*w as u32).to_le_bytes()));
    file.extend_from_slice(b"JSON");
    file.extend(json);
    file.extend((binary.len() as u32).to_le_bytes());
    file.extend_from_slice(b"BIN\0");
    file.extend(binary);
    file
}
