//! What must hold for any bytes given as a scene or as a picture. Tests run it on damaged files, and so do the fuzz targets in
//! `fuzz/`.

use halflight::atlas::Atlas;
use halflight::error::Error;
use halflight::film::read_exr;
use halflight::scene::Scene;
use std::path::PathBuf;
use tempfile::TempDir;

/// A file of these bytes in a folder of its own.
fn file(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    (folder, path)
}

/// They are read as a sound scene, or refused in one line.
///
/// # Panics
/// Where neither is so.
pub fn scene(bytes: &[u8]) {
    let name = if bytes.starts_with(b"glTF") { "damaged.glb" } else { "damaged.gltf" };
    let (_folder, path) = file(name, bytes);
    match Scene::load(path) {
        Ok(scene) => sound(&scene),
        Err(error) => one_line(&error),
    }
}

/// No number that is not finite, no index out of bounds.
fn sound(scene: &Scene) {
    let mesh = &scene.mesh;
    assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()));
    assert_eq!(mesh.positions.len(), mesh.normals.len());
    assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.positions.len()));
    for triangle in 0..mesh.triangles.len() as u32 {
        assert!(mesh.normal(triangle).is_normalized() && scene.material_of(triangle).lobes.len() < 4);
    }
    assert!(scene.luminaires.iter().all(|l| l.power(1.0).is_finite() || l.is_delta()));
    assert!(scene.camera.position.is_finite() && scene.camera.right.is_normalized());
}

/// They are read as layers of as many pixels as they say, perhaps as an atlas too, or refused in one line.
///
/// # Panics
/// Where neither is so.
pub fn exr(bytes: &[u8]) {
    let (_folder, path) = file("damaged.exr", bytes);
    match read_exr(&path) {
        Ok(image) => {
            let pixels = image.width as usize * image.height as usize;
            assert!(
                !image.layers.is_empty() && image.layers.iter().all(|(_, values)| values.len() == pixels)
            );
            if let Err(why) = Atlas::from_image(&image) {
                assert!(!why.is_empty() && !why.contains('\n'), "{why:?}");
            }
        }
        Err(error) => one_line(&error),
    }
}

fn one_line(error: &Error) {
    let text = error.to_string();
    assert!(error.exit_code() == 2 && text.contains("damaged.") && !text.contains('\n'), "{text:?}");
}
