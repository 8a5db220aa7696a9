//! From pieces in world space to one mesh about a centre of its own. The glTF loader and the built-in scenes share it.

use super::centre::{Centre, Eye, centre};
use super::{Luminaire, Material, Mesh, Surface};
use glam::{DVec3, Vec3};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::f64::consts::PI;

/// Normals nearer than this to those of the triangles (1 mrad) are flat: exporters round them to four digits.
const FLAT: f32 = 1e-3;

/// What becomes one [`Surface`].
pub(super) struct Piece {
    pub name: String,
    pub material: u32,
    /// In the world, m.
    pub positions: Vec<DVec3>,
    /// As many as positions, any length; None: flat.
    pub normals: Option<Vec<Vec3>>,
    pub triangles: Vec<[u32; 3]>,
    pub closed: bool,
}

/// All pieces together.
pub(super) struct Assembly {
    pub mesh: Mesh,
    pub surfaces: Vec<Surface>,
    /// World position of the mesh's zero.
    pub origin: DVec3,
    /// How many triangles had no area and were left out.
    pub without_area: usize,
    /// Surfaces most of whose vertex normals look away from the front.
    pub inside_out: Vec<String>,
    /// What to tell where coordinates are rounded more than shows.
    pub rounded: Option<String>,
    /// How many triangles of lamps coincided with others and were left out.
    pub twice: usize,
}

/// The corners of a triangle, the same whichever it starts with: bits of f64, +0 for −0.
fn turned(corners: [DVec3; 3]) -> [[u64; 3]; 3] {
    let mut corners = corners.map(|corner| (corner + DVec3::ZERO).to_array().map(f64::to_bits));
    let first = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
    corners.rotate_left(first);
    corners
}

/// Puts pieces together, about the centre of their bounds or of what `eye` sees of them.
///
/// Of surfaces that coincide the first is met, so those that shine (by the index of their material) come first: a lamp in the plane of
/// a ceiling is seen and lights. Of a lamp that is there twice one is left out, since light would be shot from both and be found at
/// one.
pub(super) fn assemble(
    mut pieces: Vec<Piece>,
    shines: impl Fn(u32) -> bool,
    eye: Option<Eye>,
) -> Result<Assembly, String> {
    pieces.sort_by_key(|piece| !shines(piece.material));
    let mut lamps = HashSet::new();
    let mut twice = 0;
    for piece in pieces.iter_mut().take_while(|piece| shines(piece.material)) {
        let Piece { positions, triangles, .. } = piece;
        let before = triangles.len();
        triangles.retain(|triangle| lamps.insert(turned(triangle.map(|vertex| positions[vertex as usize]))));
        twice += before - triangles.len();
    }
    let corners = pieces.iter().map(|piece| piece.triangles.len() as u64 * 3).sum::<u64>();
    if corners > u64::from(u32::MAX) {
        return Err(format!("has {} triangles, more than can be counted; leave some out", corners / 3));
    }
    let Centre { origin, note } = centre(&pieces, eye);
    let mut assembly = Assembly {
        mesh: Mesh::default(),
        surfaces: Vec::with_capacity(pieces.len()),
        origin,
        without_area: 0,
        inside_out: Vec::new(),
        rounded: note,
        twice,
    };
    for piece in pieces {
        assembly.add(piece)?;
    }
    Ok(assembly)
}

impl Assembly {
    fn add(&mut self, piece: Piece) -> Result<(), String> {
        let mesh = &mut self.mesh;
        let surface = self.surfaces.len() as u32;
        let positions: Vec<Vec3> = piece.positions.iter().map(|p| (p - self.origin).as_vec3()).collect();
        let mut place = vec![u32::MAX; positions.len()];
        let (mut smooth, mut away, mut kept) = (false, 0_usize, 0_usize);
        for triangle in piece.triangles {
            let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
            let across = (b - a).cross(c - a);
            if !across.length().is_finite() {
                return Err(format!(
                    "`{}` is too large for single precision; scale the scene down",
                    piece.name
                ));
            }
            let normal = across.normalize_or_zero();
            if !normal.is_normalized() {
                self.without_area += 1;
                continue;
            }
            kept += 1;
            mesh.triangles.push(triangle.map(|vertex| {
                let own = piece.normals.as_ref().and_then(|n| n[vertex as usize].try_normalize());
                if let Some(own) = own {
                    smooth |= own.cross(normal).length() > FLAT || own.dot(normal) < 0.0;
                    away += usize::from(own.dot(normal) < 0.0);
                }
                let place = &mut place[vertex as usize];
                if *place == u32::MAX {
                    *place = mesh.positions.len() as u32;
                    mesh.positions.push(positions[vertex as usize]);
                    mesh.normals.push(own.unwrap_or(normal));
                }
                *place
            }));
            mesh.surface.push(surface);
        }
        if 2 * away > 3 * kept {
            self.inside_out.push(piece.name.clone());
        }
        self.surfaces.push(Surface {
            name: piece.name,
            material: piece.material,
            smooth,
            closed: piece.closed,
        });
        Ok(())
    }

    /// One luminaire per triangle whose material shines.
    pub fn luminaires(&self, materials: &[Material]) -> Vec<Luminaire> {
        let shines = |(triangle, surface): (usize, &u32)| {
            let material = &materials[self.surfaces[*surface as usize].material as usize];
            let triangle = triangle as u32;
            material.emission.map(|emission| Luminaire::Triangle {
                triangle,
                emission,
                area: self.mesh.area(triangle),
            })
        };
        self.mesh.surface.iter().enumerate().filter_map(shines).collect()
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

    fn piece(positions: &[DVec3], triangles: &[[u32; 3]]) -> Piece {
        let (positions, triangles) = (positions.to_vec(), triangles.to_vec());
        Piece { name: "it".into(), material: 0, positions, normals: None, triangles, closed: false }
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
        let assembly = assemble(vec![piece(&moved, &TETRAHEDRON)], |_| false, None).unwrap();
        assert_eq!(assembly.origin, far + 0.5);
        assert_eq!(assembly.mesh.bounds(), (Vec3::splat(-0.5), Vec3::splat(0.5)));
    }

    #[test]
    fn lamps_come_first_and_once() {
        let lamp = |first: [u32; 3]| Piece { material: 1, ..piece(&CORNERS, &[first]) };
        // The same corners, from another on; the other side is another lamp.
        let pieces = vec![piece(&CORNERS, &TETRAHEDRON), lamp([0, 1, 2]), lamp([1, 2, 0]), lamp([0, 2, 1])];
        let assembly = assemble(pieces, |material| material == 1, None).unwrap();
        assert_eq!((assembly.twice, assembly.mesh.surface), (1, vec![0, 2, 3, 3, 3, 3]));
        assert_eq!(assembly.surfaces.iter().map(|s| s.material).collect::<Vec<_>>(), [1, 1, 1, 0]);
    }

    #[test]
    fn triangles_without_area_are_left_out_with_their_vertices() {
        let mut corners = CORNERS.to_vec();
        corners.push(2.0 * DVec3::X);
        let assembly =
            assemble(vec![piece(&corners, &[[0, 1, 2], [0, 1, 4], [1, 1, 1]])], |_| false, None).unwrap();
        assert_eq!((assembly.without_area, assembly.mesh.triangles.len()), (2, 1));
        assert_eq!(assembly.mesh.positions.len(), 3);
    }

    #[test]
    fn too_large_is_an_error_and_too_small_has_no_area() {
        let scaled = |s: f64| assemble(vec![piece(&CORNERS.map(|p| s * p), &TETRAHEDRON)], |_| false, None);
        assert!(scaled(1e8).is_ok_and(|a| a.without_area == 0));
        assert!(scaled(1e12).is_err_and(|e| e.contains("too large")));
        assert!(scaled(1e-8).is_ok_and(|a| a.without_area == 0));
        assert!(scaled(1e-15).is_ok_and(|a| a.without_area == 4));
    }
}
