use super::Reason;
use super::accessor::Accessors;
use super::material::{Colours, Needs};
use super::tangents;
use super::unpack::draco;
use crate::scene::assembly::Closure;
use glam::{DVec2, DVec3, DVec4, Vec2, Vec3, Vec4, Vec4Swizzles};
use gltf::Semantic;
use gltf::json::Index;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::Checked;

/// The triangles of one primitive in the space of its mesh.
#[derive(Clone)]
pub(super) struct Geometry {
    pub positions: Vec<DVec3>,
    pub normals: Option<Vec<Vec3>>,
    pub triangles: Vec<[u32; 3]>,
    pub closure: Closure,
    /// Sets of texture coordinates, where they are asked for.
    pub uvs: [Option<Vec<Vec2>>; 2],
    /// Its vertex colours, linear, where they are asked for. None: it has none, or they are no shares of light.
    pub colours: Option<Vec<Vec4>>,
    /// Where a normal map's right is, and 1 where normal × tangent is its up, −1 where it is its down.
    pub tangents: Option<Vec<Vec4>>,
    /// Its last vertices are copies of these.
    pub copies: Vec<u32>,
}

/// Reads a primitive, with what its material asks for. None: it has nothing that is a surface.
pub(super) fn read(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    needs: &Needs,
) -> Result<Option<Geometry>, Reason> {
    let Checked::Valid(mode) = primitive.mode else {
        return Err("has an unknown drawing mode; export it again".into());
    };
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(Index::value);
    let triangles = match mode {
        Mode::Triangles => list,
        // Faces are packed one by one, whatever strips a reader may make of them.
        Mode::TriangleStrip if draco::packing(accessors, primitive).is_some() => list,
        Mode::TriangleStrip => strip,
        Mode::TriangleFan => fan,
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return Ok(None),
    };
    let Some(position) = attribute(Semantic::Positions) else { return Ok(None) };

    let positions = accessors.vec3(position)?;
    if let Some(vertex) = positions.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        return Err(format!("has a position that is not a finite number (vertex {vertex}); repair the mesh"));
    }
    let count =
        u32::try_from(positions.len()).map_err(|_| "has more vertices than can be counted; split it")?;
    let normals = match attribute(Semantic::Normals) {
        // Counted before they are read: only positions are counted when a scene is found to fit.
        Some(index) if accessors.count(index) > u64::from(count) => {
            let normals = accessors.count(index);
            return Err(format!("has {count} positions and {normals} normals; export it again"));
        }
        Some(index) => Some(accessors.vec3(index)?),
        None => None,
    };
    if let Some(normals) = &normals {
        if normals.len() != positions.len() {
            return Err(format!("has {count} positions and {} normals; export it again", normals.len()));
        }
        if let Some(vertex) = normals.iter().position(|n| n.iter().any(|x| !x.is_finite())) {
            return Err(format!(
                "has a normal that is not a finite number (vertex {vertex}); repair the mesh"
            ));
        }
    }
    let indices = match primitive.indices {
        Some(index) => accessors.indices(index.value())?,
        None => (0..count).collect(),
    };
    if let Some(index) = indices.iter().find(|index| **index >= count) {
        return Err(format!("refers to vertex {index} of {count}; repair the mesh"));
    }
    let triangles = triangles(&indices)?;
    let positions: Vec<_> = positions.into_iter().map(DVec3::from_array).collect();
    let closure = Closure::of(&positions, &triangles);
    let normals =
        normals.map(|normals| normals.into_iter().map(|n| DVec3::from_array(n).as_vec3()).collect());
    let vertices = Vertices { accessors, primitive, count };
    let [first, second] = [0, 1].map(|set| vertices.uvs(set, needs.uvs[set as usize]));
    let colours = vertices.colours(needs.colours)?;
    let tangents = match needs.tangents {
        Some(_) if normals.is_some() => vertices.tangents()?,
        _ => None,
    };
    let uvs = [first?, second?];
    let plain =
        Geometry { positions, normals, triangles, closure, uvs, colours, tangents, copies: Vec::new() };
    Ok(Some(plain.with_tangents(needs)))
}

/// The vertices of a primitive, of which only positions and normals are read yet.
struct Vertices<'a> {
    accessors: &'a Accessors<'a>,
    primitive: &'a Primitive,
    count: u32,
}

/// Shares of light, or of an image's width.
const SHARES: [ComponentType; 2] = [ComponentType::U8, ComponentType::U16];

impl Vertices<'_> {
    /// As many of an attribute as there are positions. None: there is no such attribute.
    fn of<const N: usize>(
        &self,
        semantic: Semantic,
        what: &str,
        read: impl Fn(usize) -> Result<Vec<[f64; N]>, Reason>,
    ) -> Result<Option<Vec<[f64; N]>>, Reason> {
        let Some(index) = self.primitive.attributes.get(&Checked::Valid(semantic)) else { return Ok(None) };
        let (count, n) = (self.count, self.accessors.count(index.value()));
        if n != u64::from(count) {
            return Err(format!("has {count} positions and {n} {what}; export it again"));
        }
        read(index.value()).map(Some)
    }

    /// A set of texture coordinates. What is not a finite number is at the image's corner.
    fn uvs(&self, set: u32, asked: bool) -> Result<Option<Vec<Vec2>>, Reason> {
        if !asked {
            return Ok(None);
        }
        let uvs =
            self.of(Semantic::TexCoords(set), "texture coordinates", |index| self.accessors.vec2(index))?;
        let finite = |uv: [f64; 2]| Some(DVec2::from_array(uv).as_vec2()).filter(|uv| uv.is_finite());
        Ok(uvs.map(|uvs| uvs.into_iter().map(|uv| finite(uv).unwrap_or_default()).collect()))
    }

    /// Colours in [0, 1], where floats beyond are brought (glTF 2.0, §3.7.2.1); other numbers beyond are no colours.
    fn colours(&self, asked: bool) -> Result<Option<Vec<Vec4>>, Reason> {
        let Some(index) = self.primitive.attributes.get(&Checked::Valid(Semantic::Colors(0))) else {
            return Ok(None);
        };
        let accessor = self.accessors.root.accessors.get(index.value());
        let is = |kind| accessor.is_some_and(|accessor| accessor.type_ == Checked::Valid(kind));
        let float = |component: &ComponentType| *component == ComponentType::F32;
        let shares = accessor.is_some_and(|accessor| {
            let floats = matches!(&accessor.component_type, Checked::Valid(component) if float(&component.0));
            floats || accessor.normalized
        });
        if !asked || !shares {
            return Ok(None);
        }
        let what = "colours";
        let colours = if is(Type::Vec4) {
            self.of(Semantic::Colors(0), what, |index| self.accessors.numbers(index, Type::Vec4, &SHARES))?
        } else {
            let with_alpha = |[r, g, b]: [f64; 3]| [r, g, b, 1.0];
            let rgb = |index| self.accessors.numbers(index, Type::Vec3, &SHARES);
            let rgb = self.of(Semantic::Colors(0), what, rgb)?;
            rgb.map(|rgb| rgb.into_iter().map(with_alpha).collect())
        };
        let share = |x: f64| if x.is_finite() { x.clamp(0.0, 1.0) as f32 } else { 1.0 };
        Ok(colours.map(|colours| colours.into_iter().map(|c| Vec4::from_array(c.map(share))).collect()))
    }

    /// Tangents as the file has them.
    fn tangents(&self) -> Result<Option<Vec<Vec4>>, Reason> {
        let tangents = self.of(Semantic::Tangents, "tangents", |index| self.accessors.vec4(index))?;
        let Some(tangents) = tangents else { return Ok(None) };
        let vector = |t: [f64; 4]| DVec4::from_array(t).as_vec4();
        let fine = |t: &Vec4| t.is_finite() && t.w.abs() == 1.0;
        let tangents: Vec<Vec4> = tangents.into_iter().map(vector).collect();
        // Others are made anew.
        Ok(tangents.iter().all(fine).then_some(tangents))
    }
}

impl Geometry {
    /// With tangents that a normal map asks for and the file does not have.
    fn with_tangents(self, needs: &Needs) -> Self {
        match needs.tangents {
            Some((set, transform)) if self.tangents.is_none() => {
                tangents::generate(&self, set, transform).unwrap_or(self)
            }
            _ => self,
        }
    }

    /// Vertices that the file has.
    pub fn in_file(&self) -> usize {
        self.positions.len() - self.copies.len()
    }

    /// Which of those one is.
    pub fn source(&self, vertex: usize) -> usize {
        let copy = vertex.checked_sub(self.in_file());
        copy.map_or(vertex, |copy| self.copies[copy] as usize)
    }

    /// What is known of its vertices' colours.
    pub fn colours(&self) -> Option<Colours> {
        let colours = self.colours.as_ref()?;
        let rgb = || colours.iter().map(|colour| colour.xyz());
        let most = rgb().fold(Vec3::ZERO, Vec3::max);
        Some(Colours { most, sum: rgb().sum(), count: colours.len() })
    }
}

fn list(indices: &[u32]) -> Result<Vec<[u32; 3]>, Reason> {
    let (triangles, rest) = indices.as_chunks::<3>();
    if rest.is_empty() {
        Ok(triangles.to_vec())
    } else {
        Err(format!("has {} corners, which is no multiple of three; repair the mesh", indices.len()))
    }
}

// The orders of glTF 2.0, §3.7.2.1: every second triangle of a strip is turned round to keep its front.
fn strip(indices: &[u32]) -> Result<Vec<[u32; 3]>, Reason> {
    let turned = |(i, w): (usize, &[u32])| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] };
    Ok(indices.windows(3).enumerate().map(turned).collect())
}

fn fan(indices: &[u32]) -> Result<Vec<[u32; 3]>, Reason> {
    let Some((hub, rim)) = indices.split_first() else { return Ok(Vec::new()) };
    Ok(rim.windows(2).map(|w| [w[0], w[1], *hub]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_the_front() {
        assert_eq!(strip(&[0, 1, 2, 3]).unwrap(), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(fan(&[0, 1, 2, 3]).unwrap(), [[1, 2, 0], [2, 3, 0]]);
        assert!(list(&[0, 1, 2, 3]).is_err());
    }
}
