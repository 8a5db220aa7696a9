//! Mattes of objects and materials after the Cryptomatte specification (Friedman, Jones 2015; version 1.2.0): for each pixel which
//! names are seen there, and how much of it each covers.

use crate::film::{Header, WrittenLayer};
use crate::rays::{Ray, Rays};
use crate::sampling::{Rng, Stream};
use crate::scene::{Scene, View};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Names that are kept of a pixel: those that cover most.
const RANKS: usize = 6;
/// Camera rays through a pixel are a grid of so many by so many, each somewhere in its cell.
const SIDE: u32 = 4;
/// A layer holds two ranks: name and coverage of each.
const COMPONENTS: [&str; 4] = ["R", "G", "B", "A"];

/// A name and the share of a pixel that it covers; the name as a number is a hash of it.
type Rank = (f32, f32);

/// Mattes of a scene as its camera sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Mattes {
    width: usize,
    kinds: [Kind; 2],
}

/// The mattes of one kind of names.
#[derive(Clone, Debug, PartialEq)]
struct Kind {
    name: &'static str,
    /// Every name of the scene, and its hash as it is stored.
    manifest: BTreeMap<String, u32>,
    /// Of each pixel, row-major from top left; what covers most comes first.
    ranks: Vec<[Rank; RANKS]>,
}

impl Mattes {
    /// Of objects (nodes of the file) and of materials. Where matter lets some of the visible half straight through, what lies
    /// behind has its share.
    pub fn of(scene: &Scene, (width, height): (u32, u32), seed: u64) -> Self {
        let rays = Rays::build(scene);
        let view = scene.camera.view(width as f32 / height as f32);
        let objects: Vec<u32> = scene.surfaces.iter().map(|surface| id(&surface.name)).collect();
        let materials: Vec<u32> = scene.materials.iter().map(|material| id(&material.name)).collect();
        let looking = Looking { scene, rays: &rays, view, size: [width, height], seed };
        let pixels = 0..width as usize * height as usize;
        let (of_objects, of_materials) = pixels
            .into_par_iter()
            .map(|pixel| {
                let seen = looking.seen(pixel);
                let by = |ids: &[u32], of: fn(&Seen) -> u32| {
                    ranked(seen.iter().map(|seen| (ids[of(seen) as usize], seen.share)))
                };
                (by(&objects, |seen| seen.surface), by(&materials, |seen| seen.material))
            })
            .unzip();
        let manifest =
            |names: &mut dyn Iterator<Item = &String>| names.map(|name| (name.clone(), id(name))).collect();
        let objects = manifest(&mut scene.surfaces.iter().map(|surface| &surface.name));
        let materials = manifest(&mut scene.materials.iter().map(|material| &material.name));
        Self {
            width: width as usize,
            kinds: [
                Kind { name: "CryptoObject", manifest: objects, ranks: of_objects },
                Kind { name: "CryptoMaterial", manifest: materials, ranks: of_materials },
            ],
        }
    }

    /// What mattes of a film of this size in pixels take in memory.
    pub fn bytes((width, height): (u32, u32)) -> usize {
        2 * width as usize * height as usize * size_of::<[Rank; RANKS]>()
    }

    /// Its layers, as they are written: two ranks each.
    pub fn layers(&self) -> Vec<WrittenLayer<'_>> {
        let mut layers = Vec::new();
        for kind in &self.kinds {
            for pair in 0..RANKS / 2 {
                let (width, name) = (self.width, format!("{}{pair:02}", kind.name));
                let line = move |y: usize, axis: usize, line: &mut [f32]| {
                    let ranks = &kind.ranks[y * width..];
                    for (x, ranks) in line.iter_mut().zip(ranks) {
                        let (name, coverage) = ranks[2 * pair + axis / 2];
                        *x = if axis.is_multiple_of(2) { name } else { coverage };
                    }
                };
                layers.push(WrittenLayer {
                    name,
                    half: false,
                    components: &COMPONENTS,
                    line: Box::new(line),
                });
            }
        }
        layers
    }

    /// Adds what makes names of the numbers.
    pub fn describe_in(&self, header: &mut Header) {
        for kind in &self.kinds {
            let key = format!("{:08x}", murmur3(kind.name.as_bytes()));
            let mut set =
                |fact: &str, value: String| header.set(&format!("cryptomatte/{}/{fact}", &key[..7]), value);
            set("name", kind.name.into());
            set("hash", "MurmurHash3_32".into());
            set("conversion", "uint32_to_float32".into());
            let manifest: serde_json::Map<_, _> =
                kind.manifest.iter().map(|(name, id)| (name.clone(), format!("{id:08x}").into())).collect();
            set("manifest", serde_json::Value::Object(manifest).to_string());
        }
    }
}

/// What a camera ray sees.
struct Seen {
    surface: u32,
    material: u32,
    /// Of a pixel.
    share: f32,
}

/// A camera before a scene.
struct Looking<'a> {
    scene: &'a Scene,
    rays: &'a Rays,
    view: View,
    size: [u32; 2],
    seed: u64,
}

impl Looking<'_> {
    fn seen(&self, pixel: usize) -> Vec<Seen> {
        let [width, height] = self.size.map(|side| side as usize);
        let (column, row) = (pixel % width, pixel / width);
        let mut rng = Rng::new(self.seed, Stream::Measure, 0, pixel as u64);
        let (mut seen, mut hits) = (Vec::new(), Vec::new());
        for cell in 0..SIDE * SIDE {
            let place = |cell: u32, jitter: f32| (cell as f32 + jitter) / SIDE as f32;
            let [jx, jy] = rng.f32x2();
            let x = (column as f32 + place(cell % SIDE, jx)) / width as f32;
            let y = (row as f32 + place(cell / SIDE, jy)) / height as f32;
            let (origin, direction) = self.view.ray_through(x, y, rng.f32x2());
            self.rays.crossings_seen(&Ray { origin, direction, t_max: f32::INFINITY }, &mut hits);
            let mut left = 1.0 / (SIDE * SIDE) as f32;
            for hit in &hits {
                let at = self.scene.matter_at(hit.triangle, hit.u, hit.v, 0.0);
                if at.material.is_nothing() {
                    continue;
                }
                let through = left * at.bsdf.straight.vis_vis.min(1.0);
                let surface = self.scene.mesh.surface[hit.triangle as usize];
                let material = self.scene.surfaces[surface as usize].material;
                seen.push(Seen { surface, material, share: left - through });
                left = through;
                if left == 0.0 {
                    break;
                }
            }
        }
        seen
    }
}

/// The names that cover most of a pixel, that which covers most first; none is number 0 and covers nothing.
fn ranked(seen: impl Iterator<Item = (u32, f32)>) -> [Rank; RANKS] {
    let mut names: Vec<(u32, f32)> = Vec::new();
    for (id, share) in seen {
        match names.iter_mut().find(|known| known.0 == id) {
            Some(known) => known.1 += share,
            None => names.push((id, share)),
        }
    }
    names.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let mut names = names.into_iter().filter(|(_, share)| *share > 0.0);
    std::array::from_fn(|_| names.next().map_or((0.0, 0.0), |(id, share)| (f32::from_bits(id), share)))
}

/// The hash of a name, less what a float cannot hold: exponents of zeros and of infinities (`uint32_to_float32` of the
/// specification).
fn id(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes());
    let exponent = hash >> 23 & 0xff;
    if exponent == 0 || exponent == 0xff { hash ^ 1 << 23 } else { hash }
}

/// MurmurHash3 of 32 bits with seed 0 (A. Appleby).
fn murmur3(bytes: &[u8]) -> u32 {
    let mix = |word: u32| word.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let (words, rest) = bytes.as_chunks::<4>();
    let mut hash = words.iter().fold(0_u32, |hash, word| {
        (hash ^ mix(u32::from_le_bytes(*word))).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64)
    });
    let last = rest.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
    hash ^= mix(last) ^ bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Illumination, Material, Projection, Shape};
    use glam::Vec3;

    #[test]
    fn hashes_are_the_published_ones() {
        for (text, hash) in [
            ("", 0),
            ("a", 0x3c25_69b2),
            ("hello", 0x248b_fa47),
            ("hello, world", 0x149b_bb7f),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(murmur3(text.as_bytes()), hash, "{text}");
        }
        // Zero would be no number that tells a name.
        assert_eq!((id(""), id("hello")), (1 << 23, 0x248b_fa47));
    }

    #[test]
    fn what_covers_most_comes_first_and_equal_names_count_together() {
        let ranks = ranked([(7, 0.25), (9, 0.5), (7, 0.125), (3, 0.0)].into_iter());
        let expected = [(9, 0.5), (7, 0.375), (0, 0.0)].map(|(id, share)| (f32::from_bits(id), share));
        assert_eq!(ranks[..3], expected);
    }

    /// A square before half of the picture, through which a quarter of what lies behind is seen.
    fn scene() -> Scene {
        let camera =
            Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, Projection::Orthographic { half_height: 1.0 });
        let mut scene = Scene::builder("halves").camera(camera).illumination(Illumination::GLOBAL);
        let wall = scene.material(Material::diffuse("Wall", Vec3::ONE));
        let veil = Material::diffuse("Veil", Vec3::ONE).with_straight([[0.0, 0.0], [0.0, 0.25]]);
        let veil = scene.material(veil);
        let square = |left: f64, z: f64| [[left, -1.0, z], [1.0, -1.0, z], [1.0, 1.0, z], [left, 1.0, z]];
        scene.shape(Shape::quad("Back", wall, square(-1.0, 0.0)));
        scene.shape(Shape::quad("Front", veil, square(0.0, 0.5)));
        scene.build().expect("a scene")
    }

    #[test]
    fn coverage_is_the_share_that_is_seen() {
        let mattes = Mattes::of(&scene(), (2, 2), 0);
        let [objects, materials] = &mattes.kinds;
        let named = |name: &str, share: f32| (f32::from_bits(id(name)), share);
        assert_eq!(objects.ranks[0][..2], [named("Back", 1.0), (0.0, 0.0)]);
        assert_eq!(objects.ranks[1][..3], [named("Front", 0.75), named("Back", 0.25), (0.0, 0.0)]);
        assert_eq!(materials.ranks[1][..2], [named("Veil", 0.75), named("Wall", 0.25)]);
        // A film of one pixel sees half of either.
        let whole = Mattes::of(&scene(), (1, 1), 0).kinds[0].ranks[0];
        assert_eq!(whole[..2], [named("Back", 0.625), named("Front", 0.375)]);
    }

    #[test]
    fn the_header_names_what_layers_hold() {
        let mattes = Mattes::of(&scene(), (2, 2), 0);
        let mut header = Header::new();
        mattes.describe_in(&mut header);
        let fact = |name: &str| header.get(name).map(ToString::to_string);
        let key = &format!("{:08x}", murmur3(b"CryptoObject"))[..7];
        assert_eq!(fact(&format!("cryptomatte/{key}/name")).as_deref(), Some("CryptoObject"));
        let manifest = fact(&format!("cryptomatte/{key}/manifest")).expect("a manifest");
        let manifest: BTreeMap<String, String> = serde_json::from_str(&manifest).expect("JSON");
        assert_eq!(manifest["Front"], format!("{:08x}", id("Front")));
        let names: Vec<_> = mattes.layers().into_iter().map(|layer| layer.name).collect();
        assert_eq!(names[..3], ["CryptoObject00", "CryptoObject01", "CryptoObject02"]);
        let mut line = [0.0; 2];
        (mattes.layers()[0].line)(0, 3, &mut line);
        assert_eq!(line, [0.0, 0.25], "the second rank's coverage");
    }
}
