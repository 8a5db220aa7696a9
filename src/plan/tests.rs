//! Each rule alone, on scenes of one triangle per material: matrices decide, geometry does not.

use super::*;
use crate::light::{Light, Matrix};
use crate::optics::{Diffuse, Lobe, Mirror};
use crate::scene::{Camera, Illumination, Luminaire, Material, Matter, Projection, Shape};
use glam::Vec3;

const RED: Vec3 = Vec3::new(0.5, 0.0, 0.0);
const GREY: Vec3 = Vec3::splat(0.5);
const INVISIBLE: Light = Light::new(Vec3::ONE, Vec3::ZERO);
const VISIBLE: Light = Light::new(Vec3::ZERO, Vec3::ONE);
const BOTH: Light = Light::both(Vec3::ONE);

fn diffuse(albedo: Vec3) -> Lobe {
    Lobe::Diffuse(Diffuse { albedo, two_sided: false, under: None })
}

fn mirror(tint: Vec3) -> Lobe {
    Lobe::Mirror(Mirror::plain(tint, false))
}

fn opaque(matrix: [[f32; 2]; 2]) -> Illumination {
    Illumination::Own(Matter { opaque: Matrix::new(matrix), straight: Matrix::ZERO })
}

/// A scene of one triangle per material, named 0, 1, …, and a point light.
fn scene(materials: &[(Lobe, Illumination)], intensity: Light) -> Scene {
    let corner = |i: u32| Vec3::new((i % 3) as f32, (i / 3) as f32, ((i % 3) * (i % 3)) as f32);
    let camera = Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::Z, Projection::Perspective { yfov: 1.0 });
    let mut scene = Scene::builder("rules").camera(camera);
    for (i, (lobe, _)) in (0..).zip(materials) {
        let material = scene.material(Material::new(i.to_string(), *lobe));
        let shape = Shape::new("thing", material, [3 * i, 3 * i + 1, 3 * i + 2].map(corner), [[0, 1, 2]]);
        scene.shape(shape.with_normals(vec![Vec3::Y; 3]));
    }
    scene.luminaire(Luminaire::Point { position: Vec3::ONE, intensity });
    let mut scene = scene.build().unwrap();
    let set: Vec<_> = (0..).zip(materials).map(|(i, m)| (i.to_string(), m.1)).collect::<Vec<(String, _)>>();
    scene.illuminate(None, &set).expect("its own names");
    scene
}

fn settings() -> Settings {
    Settings { width: 4, height: 4, paths: Some(16), ..Settings::default() }
}

fn plan(materials: &[(Lobe, Illumination)], intensity: Light) -> Plan {
    Plan::new(scene(materials, intensity), settings())
}

fn omits(plan: &Plan, what: Omittable) -> bool {
    plan.omissions.iter().any(|omission| omission.name == what.name())
}

const GLOBAL: Illumination = Illumination::GLOBAL;
const LOCAL: Illumination = Illumination::LOCAL;

#[test]
fn photons_are_shot_where_reflected_light_is_read() {
    for (illumination, needed) in
        [(LOCAL, false), (Illumination::ONE_BOUNCE, false), (GLOBAL, true), (Illumination::SHADOWLESS, true)]
    {
        let plan = plan(&[(diffuse(GREY), illumination)], BOTH);
        assert_eq!(plan.photons.is_some(), needed, "{}", illumination.describe());
        assert_ne!(omits(&plan, Omittable::Photons), needed);
    }
    // Nothing is emitted into the half that is reflected.
    assert!(plan(&[(diffuse(GREY), GLOBAL)], VISIBLE).photons.is_none());
    // Nothing reads the half into which it is reflected.
    let to_visible = opaque([[0.0, 0.0], [1.0, 0.0]]);
    assert!(plan(&[(diffuse(GREY), to_visible)], BOTH).photons.is_none());
}

#[test]
fn a_truncated_series_needs_photons_from_two_reflections_on() {
    for (most, needed) in [(0, false), (1, false), (2, true)] {
        let settings = Settings { max_reflections: Some(most), ..settings() };
        let plan = Plan::new(scene(&[(diffuse(GREY), GLOBAL)], BOTH), settings);
        assert_eq!(plan.photons.is_some(), needed, "{most}");
    }
}

#[test]
fn classes_follow_what_reflects() {
    let classes = |materials: &[(Lobe, Illumination)], light| {
        plan(materials, light).photons.map(|photons| (photons.classes.caustic, photons.classes.indirect))
    };
    assert_eq!(classes(&[(diffuse(GREY), GLOBAL)], BOTH), Some((false, true)));
    assert_eq!(classes(&[(diffuse(GREY), GLOBAL), (mirror(GREY), GLOBAL)], BOTH), Some((true, true)));
    // Among local things a global mirror makes caustics and nothing else.
    assert_eq!(classes(&[(diffuse(GREY), LOCAL), (mirror(GREY), GLOBAL)], BOTH), Some((true, false)));
    // A local mirror sends on the visible half, which nothing reads.
    assert_eq!(classes(&[(diffuse(GREY), LOCAL), (mirror(GREY), LOCAL)], BOTH), None);
    // A red mirror sends on nothing of a green lamp.
    let green = Light::both(Vec3::Y);
    assert_eq!(classes(&[(diffuse(GREY), LOCAL), (mirror(RED), GLOBAL)], green), None);
    assert_eq!(classes(&[(diffuse(GREY), GLOBAL), (mirror(RED), GLOBAL)], green), Some((false, true)));
    // Nor is its light read by a green wall.
    let wall = diffuse(Vec3::Y);
    assert_eq!(classes(&[(wall, LOCAL), (mirror(RED), GLOBAL)], BOTH), None);
}

#[test]
fn the_visible_half_is_carried_where_two_mirrors_give_it_back() {
    let to_visible = (mirror(GREY), opaque([[0.0, 0.0], [1.0, 0.0]]));
    let to_invisible = (mirror(GREY), opaque([[0.0, 1.0], [0.0, 0.0]]));
    let floor = (diffuse(GREY), Illumination::ONE_BOUNCE);
    let both = |materials: &[(Lobe, Illumination)]| {
        plan(materials, INVISIBLE).photons.map(|photons| photons.both_halves)
    };
    assert_eq!(both(&[to_visible, to_invisible, floor]), Some(true));
    assert_eq!(both(&[to_visible, floor]), None);
    // What the floor sends to the camera is visible, and one mirror suffices to give it back.
    assert_eq!(both(&[to_invisible, floor]), Some(true));
    assert_eq!(both(&[(mirror(GREY), GLOBAL), floor]), Some(false));
}

#[test]
fn deposits_are_kept_where_a_camera_ray_may_read_them() {
    let deposits =
        |materials: &[(Lobe, Illumination)]| plan(materials, BOTH).photons.expect("photons").deposits;
    // What only passes light on in the invisible half is read in mirrors alone.
    let behind = (diffuse(GREY), opaque([[0.5, 0.0], [0.0, 0.0]]));
    let floor = (diffuse(GREY), GLOBAL);
    assert_eq!(deposits(&[floor, behind]), [true, false]);
    assert_eq!(deposits(&[floor, behind, (mirror(GREY), GLOBAL)]), [true, true, false]);
    // And on the layer that shows that half.
    let invisible = Plan::new(scene(&[floor, behind], BOTH), Settings { invisible: true, ..settings() });
    assert_eq!(invisible.photons.expect("photons").deposits, [true, true]);
}

#[test]
fn lobes_that_reflect_nothing_are_dropped() {
    let plan = plan(&[(diffuse(GREY), GLOBAL), (diffuse(Vec3::ZERO), GLOBAL)], BOTH);
    assert!(omits(&plan, Omittable::Lobes));
    assert_eq!(plan.scene.materials.iter().map(|m| m.bsdf.terms.len()).collect::<Vec<_>>(), [1, 0]);
}

#[test]
fn luminaires_shine_in_the_components_that_are_read() {
    let light = |materials: &[(Lobe, Illumination)], light| {
        plan(materials, light).scene.luminaires.iter().map(|l| l.power(1.0).total() > 0.0).collect::<Vec<_>>()
    };
    let floor = (diffuse(GREY), GLOBAL);
    assert_eq!(light(&[floor], BOTH), [true]);
    assert!(light(&[floor], VISIBLE).is_empty());
    assert!(light(&[(diffuse(RED), GLOBAL)], Light::both(Vec3::Y)).is_empty());
    // Something turns the half that nothing in sight reads into the one that it does.
    let turns = (diffuse(GREY), opaque([[0.0, 1.0], [0.0, 0.0]]));
    assert_eq!(light(&[floor, turns], VISIBLE), [true]);
    let plan = plan(&[floor], BOTH);
    assert!(matches!(plan.scene.luminaires[..], [Luminaire::Point { intensity: INVISIBLE, .. }]));
}

#[test]
fn what_no_triangle_has_decides_nothing() {
    let mut given = scene(&[(diffuse(GREY), GLOBAL), (mirror(GREY), Illumination::SHADOWLESS)], BOTH);
    given.mesh.triangles.truncate(1);
    given.mesh.surface.truncate(1);
    let lean = Plan::new(given.clone(), settings());
    assert!(omits(&lean, Omittable::Materials) && omits(&lean, Omittable::CausticPhotons));
    assert_eq!((lean.scene.materials.len(), lean.scene.surfaces.len()), (1, 1));
    let kept = Plan::new(given, Settings { keep: vec![Omittable::Materials], ..settings() });
    assert!(!omits(&kept, Omittable::Materials) && !omits(&kept, Omittable::CausticPhotons));
    assert_eq!(lean.scene_hash, kept.scene_hash);
}

#[test]
fn matter_that_light_does_not_notice_is_not_there() {
    let nothing = Illumination::Own(Matter { opaque: Matrix::ZERO, straight: Matrix::IDENTITY });
    let mut given = scene(&[(diffuse(GREY), nothing), (diffuse(GREY), GLOBAL), (diffuse(GREY), LOCAL)], BOTH);
    let emission = crate::scene::Emission { radiance: BOTH, two_sided: true };
    given.materials[2].emission = Some(emission);
    given.luminaires.push(Luminaire::Triangle { triangle: 2, part: None, emission, area: 1.0 });
    let corners = given.mesh.corners(2);
    let plan = Plan::new(given, settings());
    assert!(omits(&plan, Omittable::Matter) && omits(&plan, Omittable::Materials));
    assert_eq!((plan.scene.mesh.triangles.len(), plan.scene.mesh.positions.len()), (2, 6));
    let lamps = plan.scene.luminaires.iter().filter_map(|luminaire| match luminaire {
        Luminaire::Triangle { triangle, .. } => Some(plan.scene.mesh.corners(*triangle)),
        _ => None,
    });
    assert_eq!(lamps.collect::<Vec<_>>(), [corners]);
    assert_eq!(plan.scene.material_of(1).name, "2");
}

#[test]
fn normals_go_where_nothing_is_smooth() {
    let mut given = scene(&[(diffuse(GREY), GLOBAL)], BOTH);
    assert!(!Plan::new(given.clone(), settings()).scene.mesh.normals.is_empty());
    given.surfaces[0].smooth = false;
    let plan = Plan::new(given, settings());
    assert!(plan.scene.mesh.normals.is_empty() && omits(&plan, Omittable::Normals));
}

#[test]
fn visibility_is_asked_for_where_something_may_cast_a_shadow() {
    let sees = |materials: &[(Lobe, Illumination)]| {
        let plan = plan(materials, BOTH);
        (plan.visibility, plan.casters.is_some())
    };
    let (local, global) = ((diffuse(GREY), LOCAL), (diffuse(GREY), GLOBAL));
    assert_eq!(sees(&[local, local]), (Visibility::Everywhere, false));
    assert_eq!(sees(&[global, global]), (Visibility::Transmittance, false));
    assert_eq!(sees(&[local, global]), (Visibility::Transmittance, true));
    assert_eq!(
        sees(&[(diffuse(GREY), Illumination::Square { s: 0.0, t: 0.5 })]).0,
        Visibility::Transmittance
    );
    // Dims what is read: no shadow, yet no full light either.
    let veil = Illumination::Own(Matter {
        opaque: Matrix::new([[0.0, 0.0], [1.0, 0.0]]),
        straight: Matrix::new([[1.0, 0.2], [0.0, 0.0]]),
    });
    assert_eq!(sees(&[(diffuse(GREY), veil)]).0, Visibility::Transmittance);
}

#[test]
fn a_caster_behind_a_caster_may_stop_another_half() {
    // Local matter stops the visible half. That is read here only behind a sheet that turns it into the invisible one.
    let sheet =
        Illumination::Own(Matter { opaque: Matrix::ZERO, straight: Matrix::new([[0.5, 0.5], [0.0, 0.0]]) });
    let (local, floor) = ((diffuse(GREY), LOCAL), (diffuse(GREY), LOCAL));
    let plan = plan(&[(diffuse(GREY), sheet), local, floor], BOTH);
    assert!(plan.visibility == Visibility::Transmittance && plan.casters.is_none());
}

#[test]
fn first_hits_serve_where_nothing_is_seen_through() {
    let goes = |materials: &[(Lobe, Illumination)], invisible| {
        let plan = Plan::new(scene(materials, BOTH), Settings { invisible, ..settings() });
        (omits(&plan, Omittable::AllHits), plan.through)
    };
    let through = |invisible, visible| Through { invisible, visible };
    assert_eq!(goes(&[(diffuse(GREY), GLOBAL)], true), (true, through(false, false)));
    assert_eq!(goes(&[(diffuse(GREY), LOCAL)], false), (true, through(true, false)));
    assert_eq!(goes(&[(diffuse(GREY), LOCAL), (mirror(GREY), GLOBAL)], false), (true, through(true, false)));
    let clear =
        Illumination::Own(Matter { opaque: Matrix::ZERO, straight: Matrix::new([[0.0; 2], [0.0, 0.3]]) });
    assert_eq!(goes(&[(diffuse(GREY), clear)], false), (false, through(false, true)));
}

#[test]
fn what_is_kept_is_not_left_out() {
    let turns = (diffuse(GREY), opaque([[0.0, 1.0], [0.0, 0.0]]));
    let scenes: [&[(Lobe, Illumination)]; 6] = [
        &[(diffuse(GREY), LOCAL)],
        &[(diffuse(GREY), GLOBAL)],
        &[(diffuse(GREY), Illumination::SHADOWLESS), (mirror(GREY), GLOBAL)],
        &[(diffuse(GREY), LOCAL), (mirror(GREY), GLOBAL)],
        &[(diffuse(Vec3::ZERO), GLOBAL), (diffuse(GREY), LOCAL)],
        &[turns, (diffuse(GREY), Illumination::ONE_BOUNCE)],
    ];
    for materials in scenes {
        for what in Omittable::ALL {
            let settings = Settings { keep: vec![what], ..settings() };
            let plan = Plan::new(scene(materials, BOTH), settings);
            assert!(!omits(&plan, what), "{}: {:?}", what.name(), plan.omissions);
        }
        let everything = Settings { keep_everything: true, ..settings() };
        assert_eq!(Plan::new(scene(materials, BOTH), everything).omissions, []);
    }
}
