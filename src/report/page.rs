//! One self-contained page: curves, tables and pictures, with all data inline.

use super::data::{Comparison, SceneReport, Shown};
use super::pictures::{base64, encoded, halved};
use super::svg::{STYLE, escape, figure, title};
use super::template::fill;
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
    Ok(filled(comparison, &pictures, &serde_json::to_string(comparison)?.replace('<', "\\u003c")))
}

fn filled(comparison: &Comparison, pictures: &[Vec<Small>], data: &str) -> String {
    let sections: Vec<String> = comparison
        .scenes
        .iter()
        .zip(pictures)
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
    let values = [
        ("style", &*format!("{STYLE}{}", include_str!("page.css"))),
        ("links", &links),
        ("sections", &sections.concat()),
        ("script", include_str!("page.js")),
        ("data", data),
    ];
    fill(include_str!("page.html"), &values)
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
    let values = [
        ("index", &*index.to_string()),
        ("title", &escape(&title(scene))),
        ("curves", &figure(comparison, scene)),
        ("pictures", &figures),
    ];
    fill(include_str!("section.html"), &values)
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

#[cfg(test)]
mod tests {
    use super::super::svg::svg;
    use super::*;
    use base64::Engine;
    use std::path::Path;

    fn between<'a>(text: &'a str, begin: &str, end: &str) -> &'a str {
        let rest = text.split_once(begin).expect("its begin").1;
        rest.split_once(end).expect("its end").0
    }

    /// Pictures of a section: what stands beside them, and they themselves.
    fn pictures_of(section: &str) -> (Vec<Shown>, Vec<Small>) {
        let one = |figure: &str| {
            let number = |name| between(figure, &format!("{name}=\""), "\"").parse().expect("a number");
            let png = between(figure, "data:image/png;base64,", "\"");
            let png = base64::engine::general_purpose::STANDARD.decode(png).expect("base64");
            let caption = between(figure, "<span>", "</span>").to_owned();
            let name = between(figure, "\"", "\"").to_owned();
            (
                Shown { name, caption, picture: Vec::new() },
                Small { width: number("width"), height: number("height"), png },
            )
        };
        section.split("<figure data-name=").skip(1).map(one).unzip()
    }

    /// What a page holds, but for its style and script, which are those of now.
    fn renewed(page: &str) -> (Comparison, String) {
        let data = between(page, "<script type=\"application/json\" id=\"data\">", "</script>");
        let mut comparison: Comparison = serde_json::from_str(data.to_owned().leak()).expect("a comparison");
        let mut pictures = Vec::new();
        for (scene, section) in
            comparison.scenes.iter_mut().zip(page.split("<section class=\"scene\"").skip(1))
        {
            let (shown, small) = pictures_of(section);
            scene.pictures = shown;
            pictures.push(small);
        }
        let page = filled(&comparison, &pictures, data);
        (comparison, page)
    }

    fn same_or_rewritten(path: &Path, text: &str) {
        if std::env::var_os("HALFLIGHT_REWRITE").is_some() {
            std::fs::write(path, text).expect("it is written");
        }
        assert!(
            std::fs::read_to_string(path).is_ok_and(|kept| kept == text),
            "{} is not of now",
            path.display()
        );
    }

    /// `HALFLIGHT_REWRITE=1` makes them anew from their own data; what was measured stays as it is.
    #[test]
    fn the_pages_of_the_documentation_look_as_pages_made_now() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/error-vs-time");
        if !folder.exists() {
            io::Write::write_all(
                &mut io::stderr(),
                b"SKIPPED: this copy of halflight is without docs/error-vs-time\n",
            )
            .expect("a log");
            return;
        }
        let mut pages = 0;
        for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
            let path = entry.path().join("compare.html");
            let Ok(page) = std::fs::read_to_string(&path) else { continue };
            let (comparison, page) = renewed(&page);
            same_or_rewritten(&path, &page);
            same_or_rewritten(&path.with_extension("svg"), &svg(&comparison));
            pages += 1;
        }
        assert!(pages >= 5, "{pages} pages");
    }
}
