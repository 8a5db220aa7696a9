//! Images of files: found, decoded, and looked up where the file lays them out.

use crate::small::Small;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{Vec2, Vec3, Vec4};
use halflight::optics::{Diffuse, Lobe, Mirror, Term};
use halflight::plan::{Plan, Settings};
use halflight::scene::texture::{Sampler, Wrap};
use halflight::scene::{Inputs, Material, Pbr, Scene};
use proptest::prelude::*;
use serde_json::{Value, json};
use tempfile::TempDir;

fn note(scene: &Scene, needle: &str) -> bool {
    scene.notes.iter().any(|note| note.contains(needle))
}

/// A PNG of one row of RGB pixels.
pub fn png(pixels: &[[u8; 3]]) -> Vec<u8> {
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

fn png_rgba(pixels: &[[u8; 4]]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, pixels.len() as u32, 1);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(pixels.as_flattened()).expect("written");
    writer.finish().expect("written");
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
    let diffuse =
        |(share, lobe): &(f32, Lobe)| lobe.as_diffuse().filter(|_| *share == 1.0).map(|it| it.albedo);
    let mut diffuse = material.lobes.iter().filter_map(diffuse);
    diffuse.next().unwrap_or_else(|| panic!("not diffuse: {:?}", material.lobes))
}

/// Where the texel of number `i` of `n` in a row has its middle.
fn middle(i: u32, n: u32) -> Inputs {
    Inputs { uvs: [Vec2::new((i as f32 + 0.5) / n as f32, 0.5); 2], ..Inputs::default() }
}

fn pattern(material: &Material) -> &Pbr {
    material.pattern.as_deref().unwrap_or_else(|| panic!("the same all over: {:?}", material.lobes))
}

/// What a material reflects at the two texels of its images.
fn of_two(material: &Material) -> [Vec3; 2] {
    [0, 1].map(|i| pattern(material).parameters(&middle(i, 2)).base)
}

fn textured(images: &[Vec<u8>]) -> Small {
    with_images(
        json!({ "name": "Brick", "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorTexture": { "index": 0 },
            "baseColorFactor": [1, 0.5, 1, 1] } }),
        images,
    )
}

#[test]
fn colours_are_read_in_linear_light_and_times_their_factor() {
    let (brick, scene) = first(textured(&[png(&[[255, 255, 0], [0, 0, 188]])]));
    // sRGB 188 is 0.5029.
    let expected = [Vec3::new(1.0, 0.5, 0.0), Vec3::new(0.0, 0.0, 0.5029)];
    let near = |a: Vec3, b: Vec3, by: f32| assert!((a - b).length() < by, "{a} for {b}");
    of_two(&brick).into_iter().zip(expected).for_each(|(seen, expected)| near(seen, expected, 1e-4));
    near(albedo(&brick), Vec3::new(1.0, 0.5, 0.5029), 1e-4);
    assert!(note(&scene, "there are no texture coordinates for its textures"), "{:?}", scene.notes);
    // What is the same all over is no texture: sRGB 200 is 0.5776.
    let (grey, scene) = first(textured(&[jpeg()]));
    near(albedo(&grey), 0.5776 * Vec3::new(1.0, 0.5, 1.0), 1e-3);
    assert!(grey.pattern.is_none() && scene.images().is_empty());
    let (web, _) = first(textured(&[webp(&[[255, 255, 0], [0, 0, 188]])]));
    assert_eq!(of_two(&web), of_two(&brick));
}

/// The small scene with texture coordinates for its body, which is a tetrahedron, in floats or as shares.
fn laid_out(small: Small, uvs: [[f32; 2]; 4], shares: bool) -> Small {
    let uvs = uvs.as_flattened();
    let bytes: Vec<u8> = match shares {
        true => uvs.iter().flat_map(|x| ((x * 65_535.0) as u16).to_le_bytes()).collect(),
        false => uvs.iter().flat_map(|x| x.to_le_bytes()).collect(),
    };
    with_attribute(small, "TEXCOORD_0", "VEC2", if shares { 5123 } else { 5126 }, &bytes)
}

fn with_attribute(mut small: Small, name: &str, kind: &str, component: u32, bytes: &[u8]) -> Small {
    let start = small.binary.len();
    small.binary.extend(bytes);
    let list = |small: &mut Small, name: &str, value: Value| {
        let list = small.json[name].as_array_mut().expect("a list");
        list.push(value);
        list.len() - 1
    };
    let view = list(
        &mut small,
        "bufferViews",
        json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() }),
    );
    let accessor = json!({ "bufferView": view, "componentType": component, "normalized": component != 5126,
        "type": kind, "count": 4 });
    let accessor = list(&mut small, "accessors", accessor);
    let length = small.binary.len();
    small
        .with("/buffers/0/byteLength", json!(length))
        .with(&format!("/meshes/0/primitives/0/attributes/{name}"), json!(accessor))
}

#[test]
fn images_are_laid_out_by_texture_coordinates() {
    let brick = || textured(&[png(&[[255, 255, 0], [0, 0, 188]])]);
    let uvs = [[0.25, 0.0], [0.75, 1.0], [0.5, 0.5], [0.0, 0.75]];
    for shares in [false, true] {
        let scene = laid_out(brick(), uvs, shares).good();
        assert!(!note(&scene, "texture coordinates"), "{:?}", scene.notes);
        assert_eq!(scene.mesh.uvs[0].len(), scene.mesh.positions.len());
        // Vertices come in the order in which triangles have them.
        let there = |uv: [f32; 2]| scene.mesh.uvs[0].iter().any(|known| known.distance(uv.into()) < 1e-4);
        assert!(uvs.into_iter().all(there), "{:?}", scene.mesh.uvs[0]);
        assert!(scene.mesh.uvs[1].is_empty() && scene.mesh.tangents.is_empty());
    }
    // At the first corner the first texel, at the second the other.
    let scene = laid_out(brick(), uvs, false).good();
    let seen = |u: f32| {
        let matter = scene.matter_at(0, u, 0.0, 0.0);
        let diffuse = matter.bsdf.terms.iter().find_map(|term| term.lobe.as_diffuse()).expect("diffuse");
        diffuse.albedo
    };
    let [a, b, _] = scene.mesh.triangles[0].map(|vertex| scene.mesh.uvs[0][vertex as usize]);
    assert_eq!([a.x, b.x], [0.25, 0.5]);
    assert!((seen(0.0) - Vec3::new(1.0, 0.5, 0.0)).length() < 1e-5, "{}", seen(0.0));
    assert!((seen(1.0) - Vec3::new(0.5, 0.25, 0.2515)).length() < 1e-3, "{}", seen(1.0));
    // Where nothing asks for them they are not read, and need not be right.
    let plain = laid_out(Small::new(), uvs, false).good();
    assert!(plain.mesh.uvs[0].is_empty());
    let nan = laid_out(brick(), [[f32::NAN, 0.0]; 4], false).good();
    assert!(nan.mesh.uvs[0].iter().all(|uv| uv.is_finite()));
    let error = laid_out(brick(), uvs, false).with("/accessors/4/count", json!(3)).error();
    assert!(error.contains("has 4 positions and 3 texture coordinates"), "{error}");
}

#[test]
fn sets_transforms_and_samplers_are_those_of_the_file() {
    let transform = json!({ "index": 0, "texCoord": 0, "extensions": { "KHR_texture_transform":
        { "offset": [0.5, 0], "scale": [0.5, 1], "texCoord": 1 } } });
    let small = textured(&[png(&[[255, 255, 0], [0, 0, 188]])])
        .with("/samplers", json!([{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }]))
        .with("/textures", json!([{ "source": 0, "sampler": 0 }]))
        .with("/materials/0/pbrMetallicRoughness/baseColorTexture", transform);
    let (brick, _) = first(small.clone());
    let texture = pattern(&brick).base.texture.as_ref().expect("its texture");
    assert_eq!(texture.sampler, Sampler { wrap: [Wrap::Clamp, Wrap::Mirrored], linear: false });
    assert_eq!(texture.set, 1);
    let middle = texture.transform.transform_point2(Vec2::new(0.5, 0.25));
    assert_eq!(middle, Vec2::new(0.75, 0.25));
    let third = json!({ "index": 0, "texCoord": 2 });
    let (brick, scene) = first(small.with("/materials/0/pbrMetallicRoughness/baseColorTexture", third));
    assert!(brick.pattern.is_none() && note(&scene, "not TEXCOORD_2"), "{:?}", scene.notes);
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
fn shares_of_metal_and_glass_and_the_roughness_are_the_stored_numbers() {
    let material = json!({ "pbrMetallicRoughness": { "metallicRoughnessTexture": { "index": 0 } },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0 } } });
    let (half, _) = first(with_images(material, &[png(&[[9, 0, 255], [9, 0, 0]])]));
    let mirror = (1.0, Lobe::Mirror(Mirror::plain(Vec3::ONE, false)));
    let white = (1.0, Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided: false, under: None }));
    assert_eq!(half.lobes[..2], [mirror, white], "what may occur");
    let lobes = |i: u32| pattern(&half).lobes(&middle(i, 2)).collect::<Vec<_>>();
    assert_eq!([lobes(0), lobes(1)], [[mirror], [white]]);
    let glass = json!({ "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0 },
            "KHR_materials_transmission": { "transmissionFactor": 0.5, "transmissionTexture": { "index": 0 } } } });
    let (glass, _) = first(with_images(glass, &[png(&[[255, 7, 7], [0, 7, 7]])]));
    let shares = |i: u32| pattern(&glass).lobes(&middle(i, 2)).map(|(share, _)| share).collect::<Vec<_>>();
    assert_eq!([shares(0), shares(1)], [vec![0.5, 0.5], vec![1.0]]);
    assert_eq!(glass.lobes.iter().map(|(share, _)| *share).collect::<Vec<_>>(), [0.5, 1.0]);
}

#[test]
fn webp_in_its_extension_and_images_in_files_and_buffers_are_found() {
    let (bytes, expected) = (png(&[[255, 255, 255], [0, 0, 0]]), [Vec3::new(1.0, 0.5, 1.0), Vec3::ZERO]);
    let extension = json!([{ "extensions": { "EXT_texture_webp": { "source": 0 } } }]);
    let (web, _) = first(textured(&[webp(&[[255; 3], [0; 3]])]).with("/textures", extension));
    assert_eq!(of_two(&web), expected);

    let mut small = textured(&[Vec::new()]);
    let start = small.binary.len();
    small.binary.extend(&bytes);
    let (length, view) =
        (small.binary.len(), json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() }));
    small.json["bufferViews"].as_array_mut().expect("a list").push(view);
    let inside =
        small.with("/buffers/0/byteLength", json!(length)).with("/images", json!([{ "bufferView": 4 }]));
    assert_eq!(of_two(&first(inside).0), expected);

    let folder = TempDir::new().unwrap();
    let path = folder.path().join("beside.gltf");
    std::fs::write(folder.path().join("a b.png"), &bytes).unwrap();
    let beside = textured(&[Vec::new()]).with("/images", json!([{ "uri": "a%20b.png" }])).embedded();
    std::fs::write(&path, beside.json.to_string()).unwrap();
    assert_eq!(of_two(&Scene::load(path).unwrap().materials[0]), expected);
}

#[test]
fn images_that_cannot_be_had_leave_the_factor_and_are_told() {
    let file = png(&[[255; 3], [0; 3]]);
    let cut = file[..file.len() / 2].to_vec();
    for images in [vec![b"GIF89a".to_vec()], vec![cut], vec![Vec::new()]] {
        let (brick, scene) = first(textured(&images));
        assert_eq!(albedo(&brick), Vec3::new(1.0, 0.5, 1.0));
        assert!(
            note(&scene, "cannot be read") && note(&scene, "image 0") && note(&scene, "Brick"),
            "{:?}",
            scene.notes
        );
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
        assert!(
            note(&scene, "base colour textures that cannot be read, the factor alone stands in"),
            "{:?}",
            scene.notes
        );
    }
}

#[test]
fn the_older_model_is_a_body_under_a_layer_of_its_specular_colour() {
    let layers = json!({ "diffuseFactor": [1, 0.5, 0, 1], "specularFactor": [0.2, 0.1, 0.3], "diffuseTexture": { "index": 0 },
        "glossinessFactor": 0.5, "specularGlossinessTexture": { "index": 1 } });
    let material = json!({ "name": "Old", "extensions": { "KHR_materials_pbrSpecularGlossiness": layers } });
    let (old, scene) =
        first(with_images(material, &[png(&[[255; 3], [0; 3]]), png_rgba(&[[255, 255, 255, 51]])]));
    assert!((albedo(&old) - Vec3::new(1.0, 0.5, 0.0)).length() < 1e-6, "{}", albedo(&old));
    let facets = old.lobes.iter().find_map(|(_, lobe)| match lobe {
        Lobe::Glossy(facets) => Some(facets),
        _ => None,
    });
    let facets = facets.expect("a clear layer");
    assert!((facets.f0 - Vec3::new(0.2, 0.1, 0.3)).length() < 1e-4, "{}", facets.f0);
    // Half of a fifth is glossy.
    assert!((facets.alpha[0] - 0.81).abs() < 0.01, "{:?}", facets.alpha);
    assert!(note(&scene, "KHR_materials_pbrSpecularGlossiness is read as a body under a clear layer"));
}

#[test]
fn colours_of_vertices_are_read_where_they_are_shares_of_light() {
    let colours: [[u8; 4]; 4] = [[255, 0, 0, 9], [255, 0, 0, 9], [0, 0, 0, 9], [0, 255, 0, 9]];
    let coloured = with_attribute(Small::new(), "COLOR_0", "VEC4", 5121, colours.as_flattened())
        .with("/meshes/1/primitives/0/material", json!(0));
    let scene = coloured.clone().good();
    let of = |surface: usize| &scene.materials[scene.surfaces[surface].material as usize];
    let known = pattern(of(0)).vertex_colours.expect("colours");
    assert_eq!((known.mean, known.most), (Vec3::new(0.5, 0.25, 0.0), Vec3::new(1.0, 1.0, 0.0)));
    assert_eq!((albedo(of(0)), albedo(of(1))), (Vec3::new(1.0, 1.0, 0.0), Vec3::ONE));
    assert!(of(0).name == of(1).name && of(1).pattern.is_none());
    // What has none is white beside what has some.
    assert_eq!(scene.mesh.colours.len(), 8);
    assert_eq!(scene.mesh.colours[3], Vec4::new(0.0, 1.0, 0.0, 9.0 / 255.0));
    assert!(scene.mesh.colours[4..].iter().all(|colour| *colour == Vec4::ONE));
    let not_shares = coloured.with("/accessors/4/normalized", json!(false)).good();
    assert_eq!(albedo(&not_shares.materials[0]), Vec3::ONE);
    assert!(note(&not_shares, "vertex colours that are no shares of light are left out: Body"));
    // Floats beyond are brought to the nearest share.
    let floats: Vec<u8> = [2.0, 0.5, -1.0_f32].repeat(4).iter().flat_map(|x| x.to_le_bytes()).collect();
    let bright = with_attribute(Small::new(), "COLOR_0", "VEC3", 5126, &floats).good();
    assert!(bright.mesh.colours[..4].iter().all(|colour| *colour == Vec4::new(1.0, 0.5, 0.0, 1.0)));
}

#[test]
fn normal_maps_bring_tangents_of_the_file_or_of_their_own() {
    let bumpy = || {
        let material = json!({ "name": "Bumpy", "pbrMetallicRoughness": { "metallicFactor": 0 }, "normalTexture": { "index": 0, "scale": 0.5 } });
        let small = with_images(material, &[png(&[[128, 128, 255], [200, 128, 230]])]);
        laid_out(small, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], false)
    };
    let scene = bumpy().good();
    let map = pattern(&scene.materials[0]).normal.as_ref().expect("a normal map");
    assert!(map.scale == 0.5 && !note(&scene, "normal textures"), "{:?}", scene.notes);
    assert_eq!(scene.mesh.tangents.len(), scene.mesh.positions.len());
    assert!(scene.mesh.tangents[..4].iter().all(|t| t.w.abs() == 1.0 && t.is_finite()));
    // The sheet has no normal map, and none.
    assert_eq!(scene.mesh.tangents.last(), Some(&Vec4::ZERO));

    let given = [[0.0, 0.0, 1.0, -1.0_f32]; 4];
    let bytes: Vec<u8> = given.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let scene = with_attribute(bumpy(), "TANGENT", "VEC4", 5126, &bytes).good();
    assert!(scene.mesh.tangents[..4].iter().all(|t| *t == Vec4::from_array(given[0])));
    // A mirrored node turns the image's up with it.
    let mirrored = with_attribute(bumpy(), "TANGENT", "VEC4", 5126, &bytes)
        .with("/nodes/0/scale", json!([1, 1, -2]))
        .good();
    assert!(mirrored.mesh.tangents[..4].iter().all(|t| *t == Vec4::new(0.0, 0.0, -1.0, 1.0)));
}

#[test]
fn a_grain_without_an_image_runs_along_the_first_texture_coordinate() {
    let brushed = json!({ "pbrMetallicRoughness": { "roughnessFactor": 0.3 },
        "extensions": { "KHR_materials_anisotropy": { "anisotropyStrength": 0.8 } } });
    let uvs = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let scene = laid_out(Small::new().with("/materials/0", brushed), uvs, false).good();
    // Planning drops nothing that it needs.
    let scene = Plan::new(scene, Settings::default()).scene;
    let brushed = |triangle: u32| scene.material_of(triangle).pattern.is_some();
    let triangle =
        (0..scene.mesh.triangles.len() as u32).find(|triangle| brushed(*triangle)).expect("a body");
    let matter = scene.matter_at(triangle, 0.3, 0.3, 0.0);
    let [Term { lobe: Lobe::Glossy(facets), .. }] = matter.bsdf.terms[..] else {
        panic!("{:?}", matter.bsdf)
    };
    let along = 0.09 + 0.91 * 0.64;
    assert!((facets.alpha[0] - along).abs() < 1e-5 && (facets.alpha[1] - 0.09).abs() < 1e-6);
    assert!(facets.tangent.length() > 0.99, "{}", facets.tangent);
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
