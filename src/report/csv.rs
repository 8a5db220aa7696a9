//! Every run at every budget as a table that any program reads.

use super::data::{Comparison, Row, SceneReport};

/// One line for each scene, method, seed and budget, after a line of names.
pub fn csv(comparison: &Comparison) -> String {
    let names: Vec<_> = COLUMNS.iter().map(|(name, _)| *name).collect();
    let mut text = names.join(",") + "\n";
    for scene in &comparison.scenes {
        for row in &scene.runs {
            let cells: Vec<_> = COLUMNS.iter().map(|(_, cell)| cell(scene, row)).collect();
            text += &(cells.join(",") + "\n");
        }
    }
    text
}

type Cell = fn(&SceneReport, &Row) -> String;

const COLUMNS: [(&str, Cell); 26] = [
    ("scene", |scene, _| quoted(&scene.scene)),
    ("illumination", |scene, _| quoted(&scene.illumination)),
    ("scene_hash", |scene, _| scene.scene_hash.clone()),
    ("method", |_, row| quoted(&row.method)),
    ("seed", |_, row| row.seed.to_string()),
    ("budget", |_, row| row.budget.to_string()),
    ("seconds", |_, row| format!("{:.6}", row.seconds)),
    ("setup_seconds", |_, row| format!("{:.6}", row.setup_seconds)),
    ("passes", |_, row| row.passes.to_string()),
    ("photon_paths", |_, row| row.photon_paths.to_string()),
    ("camera_samples", |_, row| row.camera_samples.to_string()),
    ("rmse", |_, row| row.metrics.rmse.to_string()),
    ("relmse", |_, row| row.metrics.relmse.to_string()),
    ("relmse_measured", |_, row| row.relmse_measured.to_string()),
    ("bias", |_, row| row.metrics.bias.to_string()),
    ("relative_bias", |_, row| row.metrics.relative_bias.map_or(String::new(), |bias| bias.to_string())),
    ("e_pixel", |_, row| row.metrics.e_pixel.to_string()),
    ("e_pixel_max", |_, row| row.metrics.e_pixel_max.to_string()),
    ("mean_colour", |_, row| row.metrics.mean_colour.to_string()),
    ("flip", |_, row| row.flip.to_string()),
    ("not_finite", |_, row| row.metrics.not_finite.to_string()),
    ("mask_share", |scene, _| scene.mask.share.to_string()),
    ("reference_method", |scene, _| quoted(&scene.reference.method)),
    ("reference_noise", |scene, _| scene.reference.own_error.noise.to_string()),
    ("reference_bias", |scene, _| {
        scene.reference.own_error.bias.map_or(String::new(), |bias| bias.to_string())
    }),
    ("reference_too_noisy", |_, row| row.reference_too_noisy.to_string()),
];

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}
