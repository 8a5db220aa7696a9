//! One self-contained page: curves, tables and pictures, with all data inline.

use super::data::{Comparison, SceneReport, Shown};
use super::pictures::{base64, encoded, halved};
use super::svg::{STYLE, escape, figure, title};
use std::io;

/// Pictures of a page may take so many bytes, as PNG; a third more as text.
const MOST_BYTES: usize = 5_500_000;

/// The whole page. Needs no network; every number it shows is in the JSON of the comparison, which it carries.
///
/// # Errors
/// A picture that cannot be encoded.
pub fn page(comparison: &Comparison) -> io::Result<String> {
    let mut halvings = 0;
    let pictures = loop {
        let scenes = comparison.scenes.iter();
        let all: Vec<Vec<Small>> =
            scenes.map(|scene| small(comparison, scene, halvings)).collect::<io::Result<_>>()?;
        let bytes: usize = all.iter().flatten().map(|small| small.png.len()).sum();
        if bytes <= MOST_BYTES || halvings == 6 {
            break all;
        }
        halvings += 1;
    };
    let sections: Vec<String> = comparison
        .scenes
        .iter()
        .zip(&pictures)
        .enumerate()
        .map(|(i, (scene, pictures))| section(comparison, i, scene, pictures))
        .collect();
    let links: Vec<String> = comparison
        .scenes
        .iter()
        .enumerate()
        .map(|(i, scene)| format!("<a href=\"#scene-{i}\">{}</a>", escape(&title(scene))))
        .collect();
    let links = if links.len() > 1 { links.join("\n") } else { String::new() };
    let data = serde_json::to_string(comparison)?.replace('<', "\\u003c");
    Ok(include_str!("page.html")
        .replace("{{style}}", &format!("{STYLE}{}", include_str!("page.css")))
        .replace("{{links}}", &links)
        .replace("{{sections}}", &sections.concat())
        .replace("{{script}}", include_str!("page.js"))
        .replace("{{data}}", &data))
}

/// A picture, encoded.
struct Small {
    width: u32,
    height: u32,
    png: Vec<u8>,
}

fn small(comparison: &Comparison, scene: &SceneReport, halvings: u32) -> io::Result<Vec<Small>> {
    let one = |shown: &Shown| {
        let (mut width, mut height) = (comparison.width, comparison.height);
        let (mut picture, mut mask) = (shown.picture.clone(), scene.left_out.clone());
        for _ in 0..halvings {
            (width, height, picture, mask) = halved(width, height, &picture, &mask);
        }
        Ok(Small { width, height, png: encoded(width, height, &picture, &mask)? })
    };
    scene.pictures.iter().map(one).collect()
}

fn section(comparison: &Comparison, index: usize, scene: &SceneReport, pictures: &[Small]) -> String {
    let figures: String =
        scene.pictures.iter().zip(pictures).map(|(shown, small)| picture(shown, small)).collect();
    include_str!("section.html")
        .replace("{{index}}", &index.to_string())
        .replace("{{title}}", &escape(&title(scene)))
        .replace("{{curves}}", &figure(comparison, scene))
        .replace("{{pictures}}", &figures)
}

fn picture(shown: &Shown, small: &Small) -> String {
    let (name, caption) = (escape(&shown.name), escape(&shown.caption));
    format!(
        "<figure data-name=\"{name}\">\n<canvas tabindex=\"0\" width=\"{}\" height=\"{}\" role=\"img\" \
         aria-label=\"{name}: arrow keys move, plus and minus zoom, 0 resets\"></canvas>\n\
         <img alt=\"\" hidden src=\"data:image/png;base64,{}\">\n\
         <figcaption><b class=\"name {name}\">{name}</b> <span>{caption}</span><output></output></figcaption>\n</figure>\n",
        small.width,
        small.height,
        base64(&small.png)
    )
}
