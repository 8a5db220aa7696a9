//! From shapes in world space to one mesh about a centre of its own.

use super::centre::{Centre, Eye, centre};
use super::uneven::{Uneven, parts};
use super::{Emission, Luminaire, Material, Mesh, Pbr, Shape, Surface};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::f64::consts::PI;

/// Normals nearer than this to those of the triangles (1 mrad) are flat: exporters round them to four digits.
const FLAT: f32 = 1e-3;

/// All shapes together.
#[derive(Default)]
pub(super) struct Assembly {
    pub mesh: Mesh,
    pub surfaces: Vec<Surface>,
    /// One per triangle whose material shines, or per part of one.
    pub luminaires: Vec<Luminaire>,
    /// World position of the mesh's zero.
    pub origin: DVec3,
    /// Surfaces for which [`INSIDE_OUT`](Self::INSIDE_OUT) holds.
    pub inside_out: Vec<String>,
    /// How many triangles had no area and were left out.
    without_area: usize,
    /// What to tell where coordinates are rounded more than shows.
    rounded: Option<String>,
    /// How many triangles of lamps coincided with others and were left out.
    twice: usize,
}

/// The corners of a triangle, the same whichever it starts with: bits of f64, +0 for −0.
fn turned(corners: [DVec3; 3]) -> [[u64; 3]; 3] {
    let mut corners = corners.map(|corner| (corner + DVec3::ZERO).to_array().map(f64::to_bits));
    let first = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
    corners.rotate_left(first);
    corners
}

/// Puts shapes together about `origin`; without one about the centre of their bounds, or of what `eye` sees of them.
///
/// Of surfaces that coincide the first is met, so those that shine come first: a lamp in the plane of a ceiling is seen and lights.
/// Of a lamp that is there twice one is left out, since light would be shot from both and be found at one.
pub(super) fn assemble(
    mut shapes: Vec<Shape>,
    materials: &[Material],
    origin: Option<DVec3>,
    eye: Option<Eye>,
) -> Result<Assembly, String> {
    let shines = |shape: &Shape| materials[shape.material as usize].emission.is_some();
    shapes.sort_by_key(|shape| !shines(shape));
    let mut lamps = HashSet::new();
    let mut twice = 0;
    for shape in shapes.iter_mut().take_while(|shape| shines(shape)) {
        let Shape { positions, triangles, .. } = shape;
        let before = triangles.len();
        triangles.retain(|triangle| lamps.insert(turned(triangle.map(|vertex| positions[vertex as usize]))));
        twice += before - triangles.len();
    }
    let corners = shapes.iter().map(|shape| shape.triangles.len() as u64 * 3).sum::<u64>();
    if corners > u64::from(u32::MAX) {
        return Err(format!("has {} triangles, more than can be counted; leave some out", corners / 3));
    }
    let Centre { origin, note } =
        origin.map_or_else(|| centre(&shapes, eye), |origin| Centre { origin, note: None });
    let mut assembly = Assembly { origin, rounded: note, twice, ..Assembly::default() };
    for shape in shapes {
        assembly.add(shape)?;
    }
    assembly.find_luminaires(materials)?;
    Ok(assembly)
}

impl Assembly {
    /// What is told about surfaces most of whose vertex normals do so.
    pub const INSIDE_OUT: &str = "the vertex normals look away from the front (counter-clockwise side)";

    /// What to tell, but for [`INSIDE_OUT`](Self::INSIDE_OUT).
    pub fn lines(&self) -> Vec<String> {
        let twice = |n| format!("{n} triangles of lamps are there twice in one place; one of each shines");
        let without_area = match self.without_area {
            0 => None,
            1 => Some("1 triangle without area was left out".into()),
            n => Some(format!("{n} triangles without area were left out")),
        };
        let twice = (self.twice > 0).then_some(self.twice).map(twice);
        self.rounded.clone().into_iter().chain(twice).chain(without_area).collect()
    }

    fn add(&mut self, shape: Shape) -> Result<(), String> {
        let closed = shape.closed.unwrap_or_else(|| Closure::of(&shape.positions, &shape.triangles).closed);
        let mesh = &mut self.mesh;
        let surface = self.surfaces.len() as u32;
        let positions: Vec<Vec3> = shape.positions.iter().map(|p| (p - self.origin).as_vec3()).collect();
        let mut place = vec![u32::MAX; positions.len()];
        let (mut smooth, mut away, mut kept) = (false, 0_usize, 0_usize);
        let (first, mut kept_vertices) = (mesh.positions.len(), Vec::new());
        for triangle in &shape.triangles {
            let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
            let across = (b - a).cross(c - a);
            if !across.length().is_finite() {
                return Err(format!(
                    "`{}` is too large for single precision; scale the scene down",
                    shape.name
                ));
            }
            let normal = across.normalize_or_zero();
            if !normal.is_normalized() {
                self.without_area += 1;
                continue;
            }
            kept += 1;
            mesh.triangles.push(triangle.map(|vertex| {
                let own = shape.normals.as_ref().and_then(|n| n[vertex as usize].try_normalize());
                if let Some(own) = own {
                    smooth |= own.cross(normal).length() > FLAT || own.dot(normal) < 0.0;
                    away += usize::from(own.dot(normal) < 0.0);
                }
                let place = &mut place[vertex as usize];
                if *place == u32::MAX {
                    *place = mesh.positions.len() as u32;
                    mesh.positions.push(positions[vertex as usize]);
                    mesh.normals.push(own.unwrap_or(normal));
                    kept_vertices.push(vertex);
                }
                *place
            }));
            mesh.surface.push(surface);
        }
        mesh.add_attributes(&shape, first, &kept_vertices);
        if 2 * away > 3 * kept {
            self.inside_out.push(shape.name.clone());
        }
        self.surfaces.push(Surface { name: shape.name, material: shape.material, smooth, closed });
        Ok(())
    }

    fn find_luminaires(&mut self, materials: &[Material]) -> Result<(), String> {
        let material = |surface: u32| &materials[self.surfaces[surface as usize].material as usize];
        let uneven = |surface: u32| {
            let shines = |pattern: &&Pbr| material(surface).emission.is_some() && pattern.shines_unevenly();
            material(surface).pattern.as_deref().filter(shines)
        };
        let of_surface: Vec<_> = (0..self.surfaces.len() as u32).map(uneven).collect();
        let uneven = |(triangle, surface): (u32, &u32)| {
            of_surface[*surface as usize].map(|pattern| Uneven { mesh: &self.mesh, triangle, pattern })
        };
        let mut parts =
            parts(&(0..).zip(&self.mesh.surface).filter_map(uneven).collect::<Vec<_>>()).into_iter();
        let mut luminaires = Vec::new();
        for (triangle, &surface) in (0..).zip(&self.mesh.surface) {
            let Some(emission) = material(surface).emission else { continue };
            let area = self.mesh.area(triangle);
            let before = luminaires.len();
            match of_surface[surface as usize] {
                None => luminaires.push(Luminaire::Triangle { triangle, part: None, emission, area }),
                Some(_) => luminaires.extend(parts.next().into_iter().flatten().map(|(part, radiance)| {
                    let (emission, area) = (Emission { radiance, ..emission }, area * part.share());
                    Luminaire::Triangle { triangle, part: Some(part), emission, area }
                })),
            }
            if !luminaires[before..].iter().all(|luminaire| luminaire.power(1.0).total().is_finite()) {
                return Err(format!(
                    "`{}` shines with more power than single precision holds (3.4e38 W); give it less",
                    self.surfaces[surface as usize].name
                ));
            }
        }
        self.luminaires = luminaires;
        Ok(())
    }
}

impl Mesh {
    /// Adds what `kept` vertices of `shape` have beside positions and normals, the first of which is number `first` here. Who has
    /// nothing gets zeros, or white, where others have something.
    fn add_attributes(&mut self, shape: &Shape, first: usize, kept: &[u32]) {
        for (all, own) in self.uvs.iter_mut().zip(&shape.uvs) {
            add(all, own.as_deref(), Vec2::ZERO, first, kept);
        }
        add(&mut self.colours, shape.colours.as_deref(), Vec4::ONE, first, kept);
        add(&mut self.tangents, shape.tangents.as_deref(), Vec4::ZERO, first, kept);
    }
}

fn add<T: Copy>(all: &mut Vec<T>, own: Option<&[T]>, none: T, first: usize, kept: &[u32]) {
    match own {
        Some(own) => {
            all.resize(first, none);
            all.extend(kept.iter().map(|vertex| own[*vertex as usize]));
        }
        None if !all.is_empty() => all.resize(first + kept.len(), none),
        None => {}
    }
}

/// How nearly a set of triangles encloses a volume, after welding equal positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Closure {
    /// True when every edge is shared by exactly two triangles that run along it in opposite directions.
    pub closed: bool,
    /// An upper bound of the area of all holes over the area of the triangles: a rim of length L encloses at most
    /// L² / 4π. Above 1 for a flat sheet.
    pub holes: f64,
}

impl Closure {
    /// Finds out.
    pub fn of(positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let mut welded = HashMap::with_capacity(positions.len());
        let ids: Vec<u32> = positions
            .iter()
            .enumerate()
            .map(|(i, p)| *welded.entry((*p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(i as u32))
            .collect();
        let mut edges = Vec::with_capacity(3 * triangles.len());
        let mut area = 0.0;
        for triangle in triangles {
            let [a, b, c] = triangle.map(|vertex| ids[vertex as usize]);
            if a != b && b != c && c != a {
                edges.extend([(a, b), (b, c), (c, a)]);
                let [a, b, c] = [a, b, c].map(|id| positions[id as usize]);
                area += 0.5 * (b - a).cross(c - a).length();
            }
        }
        edges.sort_unstable();
        let count = |edge: (u32, u32)| {
            edges.partition_point(|known| *known <= edge) - edges.partition_point(|known| *known < edge)
        };
        let rim: Vec<_> = edges.iter().copied().filter(|&(a, b)| count((a, b)) != count((b, a))).collect();
        let once = edges.windows(2).all(|pair| pair[0] != pair[1]);
        Self { closed: !edges.is_empty() && once && rim.is_empty(), holes: hole_area(positions, &rim) / area }
    }
}

/// The sum of L² / 4π over the connected parts of a rim.
fn hole_area(positions: &[DVec3], rim: &[(u32, u32)]) -> f64 {
    let mut parent: HashMap<u32, u32> = HashMap::new();
    let mut root = |mut vertex: u32, joined: Option<u32>| {
        while let Some(&up) = parent.get(&vertex).filter(|up| **up != vertex) {
            let over = parent.get(&up).copied().unwrap_or(up);
            parent.insert(vertex, over); // halve the path, so that a long rim stays cheap
            vertex = over;
        }
        if let Some(other) = joined {
            parent.insert(vertex, other);
        }
        vertex
    };
    for &(a, b) in rim {
        let other = root(b, None);
        root(a, Some(other));
    }
    let mut lengths: BTreeMap<u32, f64> = BTreeMap::new();
    for &(a, b) in rim {
        *lengths.entry(root(a, None)).or_default() += positions[a as usize].distance(positions[b as usize]);
    }
    lengths.values().map(|length| length * length / (4.0 * PI)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn shape(positions: &[DVec3], triangles: &[[u32; 3]]) -> Shape {
        Shape::new("it", 0, positions.iter().copied(), triangles)
    }

    /// Of a diffuse material, and of one that shines.
    fn assembled(shapes: Vec<Shape>) -> Result<Assembly, String> {
        let dark = Material::diffuse("Dark", Vec3::ONE);
        let bright = dark.clone().with_emission(Emission::front(Vec3::ONE));
        assemble(shapes, &[dark, bright], None, None)
    }

    fn is_closed(positions: &[DVec3], triangles: &[[u32; 3]]) -> bool {
        Closure::of(positions, triangles).closed
    }

    #[test]
    fn a_tetrahedron_is_closed_until_a_face_is_missing_or_turned() {
        assert_eq!(Closure::of(&CORNERS, &TETRAHEDRON), Closure { closed: true, holes: 0.0 });
        assert!(!is_closed(&CORNERS, &TETRAHEDRON[1..]));
        assert!(!is_closed(&CORNERS, &[[0, 1, 2], [0, 1, 3], [0, 3, 2], [1, 2, 3]]));
        assert!(!is_closed(&CORNERS, &[]));
    }

    #[test]
    fn split_vertices_are_welded_even_over_the_two_zeros() {
        let corners: Vec<DVec3> =
            TETRAHEDRON.iter().flatten().map(|i| CORNERS[*i as usize] * DVec3::new(1.0, 1.0, -1.0)).collect();
        let triangles: Vec<[u32; 3]> = (0..4).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        assert!(is_closed(&corners, &triangles));
    }

    #[test]
    fn holes_are_measured_rim_by_rim() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let sheet = [[0, 1, 2], [0, 2, 3]];
        assert!((Closure::of(&square, &sheet).holes - 4.0 / PI).abs() < 1e-12);
        // Two sheets have two rims, each as before.
        let two: Vec<_> = square.iter().copied().chain(square.map(|p| p + 5.0)).collect();
        let sheets = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        assert!((Closure::of(&two, &sheets).holes - 4.0 / PI).abs() < 1e-12);
    }

    #[test]
    fn far_from_the_origin_nothing_is_lost() {
        let far = DVec3::new(1e7, -3e6, 5e5);
        let moved = CORNERS.map(|p| p + far);
        let assembly = assembled(vec![shape(&moved, &TETRAHEDRON)]).unwrap();
        assert_eq!(assembly.origin, far + 0.5);
        assert_eq!(assembly.mesh.bounds(), (Vec3::splat(-0.5), Vec3::splat(0.5)));
    }

    #[test]
    fn lamps_come_first_and_once() {
        let lamp = |first: [u32; 3]| Shape { material: 1, ..shape(&CORNERS, &[first]) };
        // The same corners, from another on; the other side is another lamp.
        let shapes = vec![shape(&CORNERS, &TETRAHEDRON), lamp([0, 1, 2]), lamp([1, 2, 0]), lamp([0, 2, 1])];
        let assembly = assembled(shapes).unwrap();
        assert_eq!(assembly.luminaires.len(), 2);
        assert_eq!((assembly.twice, assembly.mesh.surface), (1, vec![0, 2, 3, 3, 3, 3]));
        assert_eq!(assembly.surfaces.iter().map(|s| s.material).collect::<Vec<_>>(), [1, 1, 1, 0]);
    }

    #[test]
    fn triangles_without_area_are_left_out_with_their_vertices() {
        let mut corners = CORNERS.to_vec();
        corners.push(2.0 * DVec3::X);
        let assembly = assembled(vec![shape(&corners, &[[0, 1, 2], [0, 1, 4], [1, 1, 1]])]).unwrap();
        assert_eq!((assembly.without_area, assembly.mesh.triangles.len()), (2, 1));
        assert_eq!(assembly.mesh.positions.len(), 3);
    }

    #[test]
    fn too_large_is_an_error_and_too_small_has_no_area() {
        let scaled = |s: f64| assembled(vec![shape(&CORNERS.map(|p| s * p), &TETRAHEDRON)]);
        assert!(scaled(1e8).is_ok_and(|a| a.without_area == 0));
        assert!(scaled(1e12).is_err_and(|e| e.contains("too large")));
        assert!(scaled(1e-8).is_ok_and(|a| a.without_area == 0));
        assert!(scaled(1e-15).is_ok_and(|a| a.without_area == 4));
    }
}
