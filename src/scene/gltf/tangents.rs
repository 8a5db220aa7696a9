//! Tangents that a normal map asks for and a file does not have: Mikkelsen's, by which such maps are made (glTF 2.0, §3.7.2.1).

use super::geometry::Geometry;
use bevy_mikktspace::{TangentSpace, generate_tangents};
use glam::{Affine2, DVec3, Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// Triangles that meet in one place, at the most, and the sum over all corners of how many meet there, per corner and in any
/// case: the method compares each of them with each other one, and follows them around the place by recursion.
const MOST_AROUND: u32 = 1024;
const MOST_COMPARED: (u64, u64) = (64, 1 << 24);

/// The corners of triangles that cover something, by three, as the method reads them.
struct Corners<'a> {
    geometry: &'a Geometry,
    normals: &'a [Vec3],
    /// Where the image of the normal map is at each vertex.
    uvs: Vec<Vec2>,
    /// The positions are about this, so that f32 loses little.
    centre: DVec3,
    triangles: Vec<[u32; 3]>,
    tangents: Vec<Vec4>,
}

impl bevy_mikktspace::Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        let vertex = self.triangles[face][corner] as usize;
        (self.geometry.positions[vertex] - self.centre).as_vec3().to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.normals[self.triangles[face][corner] as usize].normalize_or_zero().to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[self.triangles[face][corner] as usize].to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = space.map(|space| Vec4::from_array(space.tangent_encoded()));
        let fine = tangent.filter(|tangent| tangent.is_finite() && tangent.truncate() != Vec3::ZERO);
        // The second coordinate runs down the image, and glTF's w is about its up.
        self.tangents[3 * face + corner] = fine.map_or(Vec4::ZERO, |t| t.truncate().extend(-t.w));
    }
}

/// Gives `geometry`, whose vertices have normals, tangents for a normal map that is laid out by one of its sets of texture
/// coordinates. Vertices whose triangles disagree about theirs become several. None: they cannot be had; those of single
/// triangles serve.
pub(super) fn generate(geometry: &Geometry, set: u8, transform: Affine2) -> Option<Geometry> {
    let normals = geometry.normals.as_ref()?;
    let uvs = geometry.uvs[usize::from(set)].as_ref()?;
    let uvs: Vec<Vec2> = uvs.iter().map(|uv| transform.transform_point2(*uv)).collect();
    let centre = geometry.positions.first().copied()?;
    let mut corners = Corners { geometry, normals, uvs, centre, triangles: Vec::new(), tangents: Vec::new() };
    let covers = |corners: &Corners<'_>, triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| (geometry.positions[v as usize] - centre).as_vec3());
        let finite = triangle.iter().all(|v| corners.uvs[*v as usize].is_finite());
        finite && [a, b, c].iter().all(|p| p.is_finite()) && a != b && b != c && c != a
    };
    corners.triangles =
        geometry.triangles.iter().filter(|triangle| covers(&corners, triangle)).copied().collect();
    if !is_bounded(geometry, &corners.triangles) {
        return None;
    }
    corners.tangents = vec![Vec4::ZERO; 3 * corners.triangles.len()];
    generate_tangents(&mut corners).ok()?;
    Some(split(geometry, &corners.triangles, &corners.tangents))
}

/// True where so few triangles meet in any place that comparing them takes little.
fn is_bounded(geometry: &Geometry, triangles: &[[u32; 3]]) -> bool {
    let place = |vertex: u32| {
        let position = geometry.positions[vertex as usize] + DVec3::ZERO;
        position.to_array().map(f64::to_bits)
    };
    let mut around: HashMap<[u64; 3], u32> = HashMap::new();
    triangles.iter().flatten().for_each(|vertex| *around.entry(place(*vertex)).or_default() += 1);
    let compared: u64 = around.values().map(|n| u64::from(*n).pow(2)).sum();
    let (each, any) = MOST_COMPARED;
    around.values().all(|n| *n <= MOST_AROUND) && compared <= each * 3 * triangles.len() as u64 + any
}

/// `geometry` with the tangents of the corners of some of its triangles.
fn split(geometry: &Geometry, triangles: &[[u32; 3]], tangents: &[Vec4]) -> Geometry {
    let mut made = geometry.clone();
    let mut of_vertex = vec![Vec4::ZERO; geometry.positions.len()];
    let mut copies: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    let mut known = triangles.iter().zip(tangents.chunks_exact(3)).peekable();
    for triangle in &mut made.triangles {
        let Some((_, tangents)) = known.next_if(|(known, _)| *known == triangle) else { continue };
        for (vertex, tangent) in triangle.iter_mut().zip(tangents).filter(|(_, t)| t.w != 0.0) {
            let first = &mut of_vertex[*vertex as usize];
            if first.w == 0.0 {
                *first = *tangent;
            }
            if *first != *tangent {
                let key = (*vertex, tangent.to_array().map(f32::to_bits));
                *vertex = *copies.entry(key).or_insert_with(|| {
                    made.copies.push(*vertex);
                    of_vertex.push(*tangent);
                    of_vertex.len() as u32 - 1
                });
            }
        }
    }
    let copies = std::mem::take(&mut made.copies);
    extend(&mut made.positions, &copies);
    made.normals.iter_mut().for_each(|normals| extend(normals, &copies));
    made.uvs.iter_mut().flatten().for_each(|uvs| extend(uvs, &copies));
    made.colours.iter_mut().for_each(|colours| extend(colours, &copies));
    Geometry { tangents: Some(of_vertex), copies, ..made }
}

fn extend<T: Copy>(values: &mut Vec<T>, copies: &[u32]) {
    let more: Vec<T> = copies.iter().map(|vertex| values[*vertex as usize]).collect();
    values.extend(more);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::assembly::Closure;

    /// A square in the plane y = 0 seen from above, u along x and v along z, in two triangles; the second mirrored where asked.
    fn square(mirrored: bool) -> Geometry {
        let positions: Vec<DVec3> =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, z]| DVec3::new(x, 0.0, z)).to_vec();
        let mut uvs: Vec<Vec2> = positions.iter().map(|p| Vec2::new(p.x as f32, p.z as f32)).collect();
        if mirrored {
            uvs[3].x = 2.0; // the diagonal is kept, its other side folded over
            uvs[3].y = 0.0;
        }
        let triangles = vec![[0, 2, 1], [0, 3, 2]];
        Geometry {
            closure: Closure::of(&positions, &triangles),
            normals: Some(vec![Vec3::Y; 4]),
            positions,
            triangles,
            uvs: [Some(uvs), None],
            colours: None,
            tangents: None,
            copies: Vec::new(),
        }
    }

    #[test]
    fn a_square_has_its_right_along_u_and_its_up_against_v() {
        let made = generate(&square(false), 0, Affine2::IDENTITY).unwrap();
        // Normal × tangent = y × x = −z, which is up in the image.
        assert!(made.copies.is_empty());
        for tangent in made.tangents.unwrap() {
            assert!(tangent.distance(Vec4::new(1.0, 0.0, 0.0, 1.0)) < 1e-6, "{tangent}");
        }
    }

    #[test]
    fn turned_texture_coordinates_turn_it() {
        // The image is laid out with its right along z.
        let turned = Affine2::from_cols_array(&[0.0, -1.0, 1.0, 0.0, 0.0, 0.0]);
        for tangent in generate(&square(false), 0, turned).unwrap().tangents.unwrap() {
            assert!(tangent.distance(Vec4::new(0.0, 0.0, 1.0, 1.0)) < 1e-6, "{tangent}");
        }
    }

    #[test]
    fn where_an_image_is_folded_over_vertices_become_two() {
        let made = generate(&square(true), 0, Affine2::IDENTITY).unwrap();
        assert_eq!(made.positions.len(), made.tangents.as_ref().unwrap().len());
        assert_eq!((made.copies.len(), made.positions.len(), made.normals.unwrap().len()), (2, 6, 6));
        let tangents = made.tangents.unwrap();
        let signs = made.triangles.iter().map(|triangle| tangents[triangle[0] as usize].w);
        assert_eq!(signs.collect::<Vec<_>>(), [1.0, -1.0]);
    }

    #[test]
    fn a_wheel_of_very_many_spokes_is_left_alone() {
        let n = 4 * MOST_AROUND;
        let rim = |i: u32| f64::from(i) / f64::from(n) * std::f64::consts::TAU;
        let mut positions = vec![DVec3::ZERO];
        positions.extend((0..n).map(|i| DVec3::new(rim(i).cos(), 0.0, rim(i).sin())));
        let triangles: Vec<[u32; 3]> = (0..n).map(|i| [0, 1 + (i + 1) % n, 1 + i]).collect();
        let uvs = positions.iter().map(|p| Vec2::new(p.x as f32, p.z as f32)).collect();
        let normals = Some(vec![Vec3::Y; positions.len()]);
        let wheel = Geometry { positions, triangles, normals, uvs: [Some(uvs), None], ..square(false) };
        assert!(generate(&wheel, 0, Affine2::IDENTITY).is_none());
    }
}
