//! The hash is fixed, and everything that decides the picture changes it.

use super::hash::Fnv;
use super::*;
use crate::light::Light;
use crate::optics::{Diffuse, Lobe, Mirror, ThinDielectric};
use glam::{Vec2, Vec3, Vec4};
use texture::Texture;

/// A lamp, a sheet of glass, one light of each kind; numbers that add and divide without rounding.
fn tiny() -> Scene {
    let camera = Camera {
        position: Vec3::new(0.0, 2.0, 0.0),
        right: Vec3::X,
        up: Vec3::NEG_Z,
        forward: Vec3::NEG_Y,
        projection: Projection::Perspective { yfov: 1.0 },
        aspect: Some(1.5),
        lens: None,
    };
    let mut scene = Scene::builder("tiny").camera(camera).illumination(Illumination::SHADOWLESS);
    let lamp = Material::diffuse("Lamp", Vec3::splat(0.5)).with_emission(Emission::front(Vec3::ONE));
    let lamp = scene.material(lamp);
    let glass = scene.material(Material::glass("Glass", 1.5).with_straight([[0.5, 0.0], [0.25, 1.0]]));
    let corners = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    scene.shape(Shape::quad("Lamp", lamp, corners));
    scene.shape(Shape::quad("Glass", glass, corners.map(|[x, _, z]| [x, 1.0, z])));
    let (position, direction, intensity) = (Vec3::ONE, Vec3::NEG_Y, Light::new(Vec3::ONE, Vec3::ZERO));
    let cone = SpotCone::of_cosines(0.75, 0.5);
    let (exponent, attenuation) = (2.0, [0.0, 0.5, 1.0]);
    scene.luminaires = vec![
        Luminaire::Point { position, intensity },
        Luminaire::Spot { position, direction, intensity, cone },
        Luminaire::Warn { position, direction, intensity, exponent, attenuation },
        Luminaire::Directional { direction, irradiance: intensity },
    ];
    scene.build().unwrap()
}

#[test]
fn the_hash_of_a_scene_is_the_same_for_ever() {
    assert_eq!(Fnv::EMPTY.0, 0xcbf2_9ce4_8422_2325);
    // From the appendix of the specification.
    let mut fnv = Fnv::EMPTY;
    fnv.bytes(b"foobar");
    assert_eq!(fnv.0, 0x8594_4171_f739_67e8);
    assert_eq!(tiny().hash(), 0x618c_6240_b74c_0221);
}

type Change = fn(&mut Scene);

#[test]
fn whatever_decides_the_picture_changes_the_hash() {
    let changes: [Change; 35] = [
        |s| s.mesh.positions[3].y = -0.0,
        |s| s.mesh.positions[0].z += 1.0,
        |s| s.mesh.normals[1].x += 1.0,
        |s| s.mesh.triangles[0].swap(0, 1),
        |s| s.mesh.triangles.truncate(3),
        |s| s.mesh.surface[0] = 1,
        |s| s.surfaces[0].material = 1,
        |s| s.surfaces[0].smooth = true,
        |s| s.surfaces[1].closed = true,
        |s| s.materials.swap(0, 1),
        |s| s.materials[0].emission = None,
        |s| s.materials[0].emission.as_mut().unwrap().radiance.visible.y = 2.0,
        |s| s.materials[0].emission.as_mut().unwrap().two_sided = true,
        |s| s.materials[0].backs = Backs::Unseen,
        |s| s.materials[0].follows.s = None,
        |s| s.materials[0].follows.t = Some(0.5),
        |s| s.materials[0].bsdf.straight.vis_vis = 1.0,
        |s| s.materials[0].bsdf.terms.clear(),
        |s| s.materials[0].bsdf.terms[0].coefficient.inv_vis = 1.0,
        |s| {
            s.materials[0].bsdf.terms[0].lobe = Lobe::Mirror(Mirror::plain(Vec3::splat(0.5), false));
        },
        |s| {
            s.materials[0].bsdf.terms[0].lobe =
                Lobe::Diffuse(Diffuse { albedo: Vec3::splat(0.5), two_sided: true, under: None });
        },
        |s| {
            s.materials[1].bsdf.terms[0].lobe =
                Lobe::ThinDielectric(ThinDielectric { ior: 1.5, tint: Vec3::ONE });
        },
        |s| s.luminaires.swap(2, 3),
        |s| s.luminaires.truncate(5),
        |s| {
            if let Luminaire::Triangle { area, .. } = &mut s.luminaires[0] {
                *area = 1.0;
            }
        },
        |s| {
            if let Luminaire::Point { position, .. } = &mut s.luminaires[2] {
                position.x = 2.0;
            }
        },
        |s| {
            if let Luminaire::Spot { cone, .. } = &mut s.luminaires[3] {
                *cone = SpotCone::of_cosines(0.75, 0.25);
            }
        },
        |s| {
            if let Luminaire::Warn { attenuation, .. } = &mut s.luminaires[4] {
                attenuation.swap(1, 2);
            }
        },
        |s| {
            if let Luminaire::Directional { irradiance, .. } = &mut s.luminaires[5] {
                irradiance.invisible.z = 2.0;
            }
        },
        |s| s.camera.position.x = 1.0,
        |s| s.camera.projection = Projection::Orthographic { half_height: 1.0 },
        |s| s.camera.aspect = None,
        |s| s.camera.lens = Some(Lens { radius: 0.5, focus: 1.0 }),
        |s| s.camera.lens = Some(Lens { radius: 0.5, focus: 2.0 }),
        |s| std::mem::swap(&mut s.camera.right, &mut s.camera.up),
    ];
    let mut seen = HashMap::from([(tiny().hash(), usize::MAX)]);
    for (number, change) in changes.iter().enumerate() {
        let mut scene = tiny();
        change(&mut scene);
        assert_eq!(seen.insert(scene.hash(), number), None, "change {number}");
    }
}

#[test]
fn every_bit_of_the_geometry_changes_the_hash() {
    let unchanged = tiny().hash();
    let mut scene = tiny();
    for vertex in 0..scene.mesh.positions.len() {
        for (axis, bit) in (0..3).flat_map(|axis| (0..32).map(move |bit| (axis, bit))) {
            let flip = |v: &mut f32| *v = f32::from_bits(v.to_bits() ^ 1 << bit);
            for of_normals in [false, true] {
                let mesh = &mut scene.mesh;
                let list = if of_normals { &mut mesh.normals } else { &mut mesh.positions };
                flip(&mut list[vertex][axis]);
                let hash = scene.hash();
                assert_ne!(hash, unchanged, "{vertex} {axis} {bit}");
                let mesh = &mut scene.mesh;
                let list = if of_normals { &mut mesh.normals } else { &mut mesh.positions };
                flip(&mut list[vertex][axis]);
            }
        }
    }
    assert_eq!(scene.hash(), unchanged);
}

#[test]
fn names_and_words_change_nothing() {
    let mut scene = tiny();
    scene.name.push('x');
    scene.surfaces[0].name.push('x');
    scene.materials[0].name.push('x');
    scene.materials[0].resolved.push('x');
    scene.notes.push("x".into());
    scene.origin.x += 1.0;
    assert_eq!(scene.hash(), tiny().hash());
    // The same matrices by another way.
    scene.illumination = None;
    scene.illuminate(Some(Illumination::SHADOWLESS), &[]).unwrap();
    assert_eq!(scene.hash(), tiny().hash());
}

/// The same with texture coordinates, colours, tangents, and a pattern on its lamp.
fn patterned() -> Scene {
    let mut scene = tiny();
    let vertices = scene.mesh.positions.len();
    scene.mesh.uvs = [vec![Vec2::ONE; vertices], vec![Vec2::ONE; vertices]];
    scene.mesh.colours = vec![Vec4::ONE; vertices];
    scene.mesh.tangents = vec![Vec4::X; vertices];
    let texture = |texel: u8| {
        let image = texture::Image::new("it", [2, 1], vec![texel, 9], texture::Encoding::Data);
        Texture::new(Arc::new(image.expect("two texels")))
    };
    let factor = |texel: u8| Factor { factor: 0.5, texture: Some(texture(texel)) };
    let colour = |texel: u8| Factor { factor: Vec3::ONE, texture: Some(texture(texel)) };
    let pbr = Pbr {
        base: colour(1),
        vertex_colours: Some(VertexColours { most: Vec3::ONE, mean: Vec3::ONE }),
        metallic_roughness: Some(texture(2)),
        transmission: factor(3),
        emissive: colour(4),
        normal: Some(NormalMap { texture: texture(5), scale: 1.0 }),
        ..Pbr::default()
    };
    scene.materials[0].pattern = Some(Arc::new(pbr));
    scene
}

#[test]
fn whatever_decides_a_pattern_changes_the_hash() {
    fn pattern(scene: &mut Scene) -> &mut Pbr {
        Arc::make_mut(scene.materials[0].pattern.as_mut().expect("a pattern"))
    }
    fn base(scene: &mut Scene) -> &mut Texture {
        pattern(scene).base.texture.as_mut().expect("a texture")
    }
    let changes: [Change; 28] = [
        |s| s.mesh.uvs[0][3].x = 2.0,
        |s| s.mesh.uvs[1][3].y = 2.0,
        |s| s.mesh.uvs.swap(0, 1),
        |s| s.mesh.colours[0].w = 0.0,
        |s| s.mesh.tangents[1].w = 1.0,
        |s| s.mesh.tangents.clear(),
        |s| s.materials[0].pattern = None,
        |s| s.materials[0].reflects.vis_vis = 0.5,
        |s| pattern(s).base.factor.y = 0.5,
        |s| pattern(s).base.texture = None,
        |s| pattern(s).vertex_colours = None,
        |s| pattern(s).vertex_colours.as_mut().expect("colours").most.x = 0.5,
        |s| pattern(s).vertex_colours.as_mut().expect("colours").mean.x = 0.5,
        |s| pattern(s).metallic = 0.5,
        |s| pattern(s).roughness = 0.5,
        |s| pattern(s).metallic_roughness = None,
        |s| pattern(s).transmission.factor = 1.0,
        |s| pattern(s).ior = 1.25,
        |s| pattern(s).solid = true,
        |s| pattern(s).two_sided = true,
        |s| pattern(s).unlit = true,
        |s| pattern(s).emissive.factor.z = 2.0,
        |s| pattern(s).emission[0] = 0.0,
        |s| pattern(s).normal.as_mut().expect("a map").scale = 0.5,
        |s| base(s).sampler.linear = false,
        |s| base(s).sampler.wrap[1] = texture::Wrap::Clamp,
        |s| base(s).set = 1,
        |s| base(s).transform.translation.x = 1.0,
    ];
    // Both have the same coordinates, so that swapping them alone would show nothing.
    let start = || {
        let mut scene = patterned();
        scene.mesh.uvs[1][0].x = 3.0;
        scene
    };
    let mut seen = vec![start().hash(), tiny().hash()];
    for (i, change) in changes.into_iter().enumerate() {
        let mut scene = start();
        change(&mut scene);
        assert!(!seen.contains(&scene.hash()), "change {i} has the hash of another");
        seen.push(scene.hash());
    }
    let mut renamed = start();
    let image = texture::Image::new("other", [2, 1], vec![1, 9], texture::Encoding::Data);
    base(&mut renamed).image = Arc::new(image.expect("two texels"));
    assert_eq!(renamed.hash(), start().hash());
    assert_eq!(start().hash(), seen[0]);
}

#[test]
fn what_a_lamp_was_measured_to_send_and_how_it_hangs_are_part_of_the_hash() {
    let lamp = |ahead: u32, turn: f32| {
        let mut scene = tiny();
        let ies = format!("TILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 1 60 0 90 0 {ahead} 1");
        let profile = Profile::parse(ies.as_bytes()).unwrap();
        scene.profiles.push(profile.turned(glam::Mat3::from_rotation_x(turn)));
        let intensity = Light::both(Vec3::ONE);
        scene.luminaires.push(Luminaire::Profile { position: Vec3::ONE, intensity, profile: 0 });
        scene.hash()
    };
    assert_eq!(lamp(2, 0.0), lamp(2, 0.0));
    let hashes = std::collections::HashSet::from([tiny().hash(), lamp(2, 0.0), lamp(3, 0.0), lamp(2, 1.0)]);
    assert_eq!(hashes.len(), 4);
}
