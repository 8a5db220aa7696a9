//! A smaller scene: what nothing uses is not in it.

use super::Settings;
use super::components::Components;
use super::flow::{Flow, emission};
use super::omission::{Omission, Omittable};
use crate::optics::Term;
use crate::rays::Rays;
use crate::scene::{Luminaire, Material, Mesh, Scene};

/// Takes out what does nothing whatever the light: matter that is not there, materials without triangles, normals.
pub(super) fn drop_unused(scene: &mut Scene, settings: &Settings, omissions: &mut Vec<Omission>) {
    if !settings.keeps(Omittable::Matter) {
        omissions.extend(drop_matter(scene));
    }
    if !settings.keeps(Omittable::Materials) {
        omissions.extend(drop_materials(scene));
    }
    let smooth = scene.surfaces.iter().any(|surface| surface.smooth);
    if !settings.keeps(Omittable::Normals) && !smooth && !scene.mesh.normals.is_empty() {
        scene.mesh.normals = Vec::new();
        omissions
            .push(Omittable::Normals.because("every surface is flat: vertex normals are never interpolated"));
    }
}

/// Solids of glass that air surrounds need not ask what does.
pub(super) fn media(rays: Rays, scene: &Scene, settings: &Settings, omissions: &mut Vec<Omission>) -> Rays {
    if settings.keeps(Omittable::Media) {
        return rays.keeping_media(scene);
    }
    let glass = |term: &Term| term.lobe.is_solid();
    if !rays.has_media() && scene.materials.iter().flat_map(|material| &material.bsdf.terms).any(glass) {
        omissions.push(
            Omittable::Media.because(
                "no two solids of glass lie in, on or across one another, so that air surrounds each",
            ),
        );
    }
    rays
}

/// Surfaces that neither shine nor reflect and let everything straight through.
fn drop_matter(scene: &mut Scene) -> Option<Omission> {
    let nothing: Vec<bool> = scene.materials.iter().map(Material::is_nothing).collect();
    let drops = |scene: &Scene, triangle: u32| nothing[material_index(scene, triangle)];
    if !(0..scene.mesh.triangles.len() as u32).any(|triangle| drops(scene, triangle)) {
        return None;
    }
    let names: Vec<_> = named(scene, |index| nothing[index]);
    let before = scene.mesh.triangles.len();
    *scene = only(scene, |triangle| !drops(scene, triangle));
    let dropped = before - scene.mesh.triangles.len();
    Some(Omittable::Matter.because(format!(
        "{} neither shines nor reflects and lets all light straight through: {dropped} triangles of {before} change \
         nothing",
        listed(&names)
    )))
}

fn drop_materials(scene: &mut Scene) -> Option<Omission> {
    let mut used = vec![false; scene.materials.len()];
    let mut occupied = vec![false; scene.surfaces.len()];
    scene.mesh.surface.iter().for_each(|surface| occupied[*surface as usize] = true);
    for (surface, _) in scene.surfaces.iter().zip(&occupied).filter(|(_, occupied)| **occupied) {
        used[surface.material as usize] = true;
    }
    if used.iter().chain(&occupied).all(|used| *used) {
        return None;
    }
    let names = named(scene, |index| !used[index]);
    let (new_surface, new_material) = (renumbered(&occupied), renumbered(&used));
    retain(&mut scene.surfaces, &occupied);
    retain(&mut scene.materials, &used);
    scene.mesh.surface.iter_mut().for_each(|surface| *surface = new_surface[*surface as usize]);
    scene.surfaces.iter_mut().for_each(|surface| surface.material = new_material[surface.material as usize]);
    (!names.is_empty())
        .then(|| Omittable::Materials.because(format!("no triangle is made of {}", listed(&names))))
}

/// Takes out lobes and light that nothing reads.
pub(super) fn drop_unread(
    scene: &mut Scene,
    flow: &Flow,
    photons: bool,
    settings: &Settings,
    omissions: &mut Vec<Omission>,
) {
    omissions.extend(drop_terms(scene, flow, settings));
    if !settings.keeps(Omittable::Textures) {
        omissions.extend(drop_textures(scene));
    }
    if !settings.keeps(Omittable::Luminaires) {
        // Glossy lobes read it by connections alone.
        let read = if photons { flow.linked.or(flow.useful) } else { flow.linked };
        omissions.extend(drop_light(scene, read));
    }
}

/// Terms of which nothing that is read comes.
fn drop_terms(scene: &mut Scene, flow: &Flow, settings: &Settings) -> Vec<Omission> {
    let kinds = [
        (Omittable::Lobes, "nothing that", "reflects is read"),
        (Omittable::Fluorescence, "no light comes that", "would re-radiate, or nothing reads it then"),
    ];
    let mut omissions = Vec::new();
    for (kind, what, does) in kinds.into_iter().filter(|(kind, ..)| !settings.keeps(*kind)) {
        let mut dark = Vec::new();
        for material in &mut scene.materials {
            let terms = &mut material.bsdf.terms;
            // Those of a pattern stand and fall together.
            if material.pattern.is_some() && terms.iter().any(|term| flow.uses(term)) {
                continue;
            }
            let before = terms.len();
            let is_other = |term: &Term| term.turn.is_reradiated() != (kind == Omittable::Fluorescence);
            terms.retain(|term| is_other(term) || flow.uses(term));
            if terms.len() < before {
                dark.push(material.name.as_str());
            }
        }
        if !dark.is_empty() {
            let names = crate::scene::names::listed(dark);
            omissions.push(kind.because(format!("{what} {names} {does}")));
        }
    }
    omissions
}

/// Images that nothing depends on which is read, and what of the mesh lays out such images alone.
fn drop_textures(scene: &mut Scene) -> Option<Omission> {
    let held = |scene: &Scene| scene.image_bytes() + scene.mesh.bytes();
    let before = held(scene);
    let mut names = Vec::new();
    for material in &mut scene.materials {
        if material.drop_unread() {
            names.push(material.name.clone());
        }
    }
    let Scene { mesh, materials, .. } = &mut *scene;
    let patterns = || materials.iter().filter_map(|material| material.pattern.as_deref());
    let has_grain = || patterns().any(|pattern| pattern.anisotropy.is_some());
    let laid_out = |set: u8| patterns().any(|pattern| pattern.textures().any(|texture| texture.set == set));
    let [first, second] = &mut mesh.uvs;
    drop_unless(laid_out(0) || has_grain(), first);
    drop_unless(laid_out(1), second);
    drop_unless(patterns().any(|pattern| pattern.vertex_colours.is_some()), &mut mesh.colours);
    drop_unless(has_grain() || patterns().any(|pattern| pattern.normal.is_some()), &mut mesh.tangents);
    let saved = before - held(scene);
    let what = match (names.is_empty(), saved) {
        (true, 0) => return None,
        (true, _) => "no texture is laid out by some of what vertices have".to_owned(),
        (false, _) => format!("nothing that is read depends on some of the textures of {}", listed(&names)),
    };
    Some(Omittable::Textures.because(format!("{what}: {:.1} MB", saved as f64 / 1e6)))
}

fn drop_unless<T>(kept: bool, values: &mut Vec<T>) {
    if !kept {
        *values = Vec::new();
    }
}

/// What luminaires emit in components other than `read` lights nothing that is seen; the luminaire itself is seen as
/// before, since that is a matter of its surface.
fn drop_light(scene: &mut Scene, read: Components) -> Option<Omission> {
    let (mut dark, mut dimmed) = (0, 0);
    for luminaire in &mut scene.luminaires {
        let emitted = emission(luminaire);
        match emitted.and(read) {
            Components::NONE => dark += 1,
            kept if kept != emitted => dimmed += 1,
            _ => {}
        }
        let light = luminaire.light_mut();
        *light = read.of_light(*light);
    }
    scene.luminaires.retain(|luminaire| emission(luminaire).any());
    let words =
        [(dark, "light nothing that is read"), (dimmed, "shine in components of which some are never read")];
    let words: Vec<String> = words
        .iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| format!("{n} of the luminaires {what}"))
        .collect();
    (!words.is_empty()).then(|| Omittable::Luminaires.because(words.join("; ")))
}

/// The scene with those triangles alone for which `keep` is true, in the same order, and the vertices they have.
/// Luminaires follow their triangles.
pub(super) fn only(scene: &Scene, keep: impl Fn(u32) -> bool) -> Scene {
    let kept: Vec<bool> = (0..scene.mesh.triangles.len() as u32).map(keep).collect();
    let mut has_triangle = vec![false; scene.mesh.positions.len()];
    for (corners, _) in scene.mesh.triangles.iter().zip(&kept).filter(|(_, kept)| **kept) {
        corners.iter().for_each(|vertex| has_triangle[*vertex as usize] = true);
    }
    let (new_triangle, new_vertex) = (renumbered(&kept), renumbered(&has_triangle));
    let mut small = scene.clone();
    retain(&mut small.mesh.triangles, &kept);
    retain(&mut small.mesh.surface, &kept);
    retain(&mut small.mesh.positions, &has_triangle);
    let Mesh { positions: _, normals, triangles: _, surface: _, uvs: [first, second], colours, tangents } =
        &mut small.mesh;
    retain_if_any(normals, &has_triangle);
    retain_if_any(first, &has_triangle);
    retain_if_any(second, &has_triangle);
    retain_if_any(colours, &has_triangle);
    retain_if_any(tangents, &has_triangle);
    small.mesh.triangles.iter_mut().flatten().for_each(|vertex| *vertex = new_vertex[*vertex as usize]);
    small.luminaires.retain(|luminaire| match luminaire {
        Luminaire::Triangle { triangle, .. } => kept[*triangle as usize],
        _ => true,
    });
    for luminaire in &mut small.luminaires {
        if let Luminaire::Triangle { triangle, .. } = luminaire {
            *triangle = new_triangle[*triangle as usize];
        }
    }
    small
}

fn material_index(scene: &Scene, triangle: u32) -> usize {
    scene.surface_of(triangle).material as usize
}

fn listed(names: &[String]) -> String {
    crate::scene::names::listed(names.iter().map(String::as_str))
}

fn named(scene: &Scene, chosen: impl Fn(usize) -> bool) -> Vec<String> {
    let materials = scene.materials.iter().enumerate();
    materials.filter(|(index, _)| chosen(*index)).map(|(_, material)| material.name.clone()).collect()
}

/// For each thing its index among those that are kept.
fn renumbered(kept: &[bool]) -> Vec<u32> {
    let mut next = 0;
    kept.iter()
        .map(|kept| {
            let index = next;
            next += u32::from(*kept);
            index
        })
        .collect()
}

fn retain<T>(things: &mut Vec<T>, kept: &[bool]) {
    let mut index = 0;
    things.retain(|_| {
        index += 1;
        kept[index - 1]
    });
}

/// Of things that are there for each of `kept`, or not at all.
fn retain_if_any<T>(things: &mut Vec<T>, kept: &[bool]) {
    if !things.is_empty() {
        retain(things, kept);
    }
}
