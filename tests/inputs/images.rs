//! Until textures are read the mean of an image stands in its place.

use crate::small::Small;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::Vec3;
use halflight::optics::{Diffuse, Lobe, Mirror};
use halflight::scene::{Material, Scene};
use proptest::prelude::*;
use serde_json::{Value, json};
use tempfile::TempDir;

fn note(scene: &Scene, needle: &str) -> bool {
    scene.notes.iter().any(|note| note.contains(needle))
}

/// A PNG of one row of RGB pixels.
fn png(pixels: &[[u8; 3]]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, pixels.len() as u32, 1);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().expect("written").write_image_data(pixels.as_flattened()).expect("written");
    file
}

/// A JPEG of 8 × 8 pixels of one grey, 200: one block with its mean alone.
fn jpeg() -> Vec<u8> {
    let mut file = vec![0xFF, 0xD8, 0xFF, 0xDB, 0, 0x43, 0];
    file.extend([16; 64]);
    file.extend([0xFF, 0xC0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0]);
    for (table, symbol) in [(0x00, 6), (0x10, 0)] {
        file.extend([0xFF, 0xC4, 0, 20, table, 1]);
        file.extend([0; 15]);
        file.push(symbol);
    }
    file.extend([0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 63, 0, 0b0100_1000, 0xFF, 0xD9]);
    file
}

fn webp(pixels: &[[u8; 3]]) -> Vec<u8> {
    let mut file = Vec::new();
    let encoder = image_webp::WebPEncoder::new(&mut file);
    encoder
        .encode(pixels.as_flattened(), pixels.len() as u32, 1, image_webp::ColorType::Rgb8)
        .expect("written");
    file
}

/// The small scene with a material and images as data URIs, each with a texture of its own number.
fn with_images(material: Value, images: &[Vec<u8>]) -> Small {
    let uri = |bytes: &Vec<u8>| json!({ "uri": format!("data:image/png;base64,{}", STANDARD.encode(bytes)) });
    let textures: Vec<_> = (0..images.len()).map(|i| json!({ "source": i })).collect();
    Small::new()
        .with("/images", json!(images.iter().map(uri).collect::<Vec<_>>()))
        .with("/textures", json!(textures))
        .with("/materials/0", material)
}

fn first(small: Small) -> (Material, Scene) {
    let scene = small.good();
    (scene.materials[0].clone(), scene)
}

fn albedo(material: &Material) -> Vec3 {
    match material.lobes[..] {
        [(1.0, Lobe::Diffuse(Diffuse { albedo, .. }))] => albedo,
        ref other => panic!("not diffuse alone: {other:?}"),
    }
}

fn textured(images: &[Vec<u8>]) -> Small {
    with_images(
        json!({ "name": "Brick", "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorTexture": { "index": 0 },
            "baseColorFactor": [1, 0.5, 1, 1] } }),
        images,
    )
}

#[test]
fn colours_are_averaged_in_linear_light_and_times_their_factor() {
    let (brick, scene) = first(textured(&[png(&[[255, 255, 0], [0, 0, 188]])]));
    // sRGB 188 is 0.5029; a mean of the stored numbers would read 0.5, 0.25, 0.369.
    assert!((albedo(&brick) - Vec3::new(0.5, 0.25, 0.2514)).length() < 1e-4, "{}", albedo(&brick));
    assert!(note(
        &scene,
        "base colour textures are not supported yet, the mean of the image stands in: Brick"
    ));
    let (grey, _) = first(textured(&[jpeg()]));
    // sRGB 200 is 0.5776.
    assert!((albedo(&grey) - 0.5776 * Vec3::new(1.0, 0.5, 1.0)).length() < 1e-3, "{}", albedo(&grey));
    let (web, _) = first(textured(&[webp(&[[255, 255, 0], [0, 0, 188]])]));
    assert!((albedo(&web) - albedo(&brick)).length() < 1e-6);
}

#[test]
fn a_lamp_of_a_few_bright_texels_shines_as_they_do() {
    let mut pixels = [[0; 3]; 16];
    pixels[5] = [255, 255, 255];
    let lamp = |images: &[Vec<u8>]| {
        let material = json!({ "emissiveFactor": [1, 0.5, 0], "emissiveTexture": { "index": 0 },
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8 } } });
        first(with_images(material, images)).0.emission
    };
    let radiance = lamp(&[png(&pixels)]).unwrap().radiance;
    assert_eq!(radiance.visible, Vec3::new(0.5, 0.25, 0.0));
    assert_eq!(lamp(&[png(&[[0; 3]; 4])]), None, "an image of black shines nowhere");
}

#[test]
fn shares_of_metal_and_glass_and_the_roughness_are_means_of_the_stored_numbers() {
    let material = json!({ "pbrMetallicRoughness": { "metallicRoughnessTexture": { "index": 0 } } });
    let (half, _) = first(with_images(material, &[png(&[[9, 0, 255], [9, 0, 0]])]));
    assert_eq!(half.lobes.len(), 2);
    assert!(half.lobes.contains(&(0.5, Lobe::Mirror(Mirror { tint: Vec3::ONE, two_sided: false }))));
    let glass = json!({ "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0 },
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.5, "transmissionTexture": { "index": 0 } } } });
    let (quarter, scene) = first(with_images(glass, &[png(&[[255, 7, 7], [0, 7, 7]])]));
    assert_eq!(quarter.lobes[0].0, 0.25);
    assert!(note(&scene, "transmission textures"));
}

#[test]
fn webp_in_its_extension_and_images_in_files_and_buffers_are_found() {
    let (bytes, expected) = (png(&[[255, 255, 255], [0, 0, 0]]), Vec3::new(0.5, 0.25, 0.5));
    let extension = json!([{ "extensions": { "EXT_texture_webp": { "source": 0 } } }]);
    let (web, _) = first(textured(&[webp(&[[255; 3], [0; 3]])]).with("/textures", extension));
    assert_eq!(albedo(&web), expected);

    let mut small = textured(&[Vec::new()]);
    let start = small.binary.len();
    small.binary.extend(&bytes);
    let (length, view) =
        (small.binary.len(), json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() }));
    small.json["bufferViews"].as_array_mut().expect("a list").push(view);
    let inside =
        small.with("/buffers/0/byteLength", json!(length)).with("/images", json!([{ "bufferView": 4 }]));
    assert_eq!(albedo(&first(inside).0), expected);

    let folder = TempDir::new().unwrap();
    let path = folder.path().join("beside.gltf");
    std::fs::write(folder.path().join("a b.png"), &bytes).unwrap();
    let beside = textured(&[Vec::new()]).with("/images", json!([{ "uri": "a%20b.png" }])).embedded();
    std::fs::write(&path, beside.json.to_string()).unwrap();
    assert_eq!(albedo(&Scene::load(path).unwrap().materials[0]), expected);
}

#[test]
fn images_that_cannot_be_had_leave_the_factor_and_are_told() {
    let file = png(&[[255; 3], [0; 3]]);
    let cut = file[..file.len() / 2].to_vec();
    for images in [vec![b"GIF89a".to_vec()], vec![cut], vec![Vec::new()]] {
        let (brick, scene) = first(textured(&images));
        assert_eq!(albedo(&brick), Vec3::new(1.0, 0.5, 1.0));
        assert!(note(&scene, "no mean stands in") && note(&scene, "Brick"), "{:?}", scene.notes);
    }
    for images in [
        json!([{ "uri": "gone.png" }]),
        json!([{ "uri": "../up.png" }]),
        json!([{}]),
        json!([{ "bufferView": 99 }]),
        json!([]),
    ] {
        let (brick, scene) = first(textured(std::slice::from_ref(&file)).with("/images", images));
        assert_eq!(albedo(&brick), Vec3::new(1.0, 0.5, 1.0));
        assert!(note(&scene, "no mean stands in"), "{:?}", scene.notes);
    }
}

#[test]
fn the_older_model_shows_what_its_two_layers_reflect_together() {
    let layers = json!({ "diffuseFactor": [1, 0.5, 0, 1], "specularFactor": [0.2, 0.2, 0.2], "diffuseTexture": { "index": 0 } });
    let material = json!({ "name": "Old", "extensions": { "KHR_materials_pbrSpecularGlossiness": layers } });
    let (old, scene) = first(with_images(material, &[png(&[[255; 3], [0; 3]])]));
    assert!((albedo(&old) - Vec3::new(0.6, 0.4, 0.2)).length() < 1e-6, "{}", albedo(&old));
    assert!(note(&scene, "KHR_materials_pbrSpecularGlossiness is not supported yet: Old"));
}

#[test]
fn the_mean_of_vertex_colours_stands_in_for_them() {
    let mut small = Small::new();
    let start = small.binary.len();
    let colours: [[u8; 4]; 4] = [[255, 0, 0, 9], [255, 0, 0, 9], [0, 0, 0, 9], [0, 255, 0, 9]];
    small.binary.extend(colours.as_flattened());
    small.json["bufferViews"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "buffer": 0, "byteOffset": start, "byteLength": 16 }));
    let accessor =
        json!({ "bufferView": 4, "componentType": 5121, "normalized": true, "type": "VEC4", "count": 4 });
    small.json["accessors"].as_array_mut().expect("a list").push(accessor);
    let length = small.binary.len();
    let coloured = small
        .with("/buffers/0/byteLength", json!(length))
        .with("/meshes/0/primitives/0/attributes", json!({ "POSITION": 0, "NORMAL": 1, "COLOR_0": 4 }))
        .with("/meshes/1/primitives/0/material", json!(0));
    let scene = coloured.clone().good();
    let of = |surface: usize| &scene.materials[scene.surfaces[surface].material as usize];
    assert_eq!((albedo(of(0)), albedo(of(1))), (Vec3::new(0.5, 0.25, 0.0), Vec3::ONE));
    assert_eq!(of(0).name, of(1).name);
    assert!(note(&scene, "vertex colours are not supported yet, their mean stands in: Body"));
    let not_shares = coloured.with("/accessors/4/normalized", json!(false)).good();
    assert_eq!(albedo(&not_shares.materials[0]), Vec3::ONE);
    assert!(note(&not_shares, "vertex colours are not supported yet: Body"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_images_never_bring_the_program_down(
        which in 0_usize..3,
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let pixels: Vec<[u8; 3]> = (0..40).map(|i: u8| [i, 3 * i, 255 - i]).collect();
        let mut file = vec![png(&pixels), jpeg(), webp(&pixels)].swap_remove(which);
        for (index, value) in hits {
            let at = index.index(file.len());
            file[at] = value;
        }
        let (material, _) = first(textured(&[file]));
        prop_assert!(albedo(&material).max_element() <= 1.0);
    }
}
