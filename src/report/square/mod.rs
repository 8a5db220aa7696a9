//! The illumination square as one self-contained page: the picture of any of its points, at once.

mod planes;
mod reduce;

use super::pictures::base64;
use super::svg::escape;
use super::template::fill;
use crate::atlas::{Atlas, GRID};
use crate::film::Header;
use glam::Vec3;
use planes::{CELL, Quantised, errors_png};
use reduce::Reduced;
use serde::Serialize;
use std::io;

/// The page and how far it is from the atlas.
pub struct SquarePage {
    /// HTML with all data inline.
    pub html: String,
    /// Pictures that the page adds up.
    pub components: usize,
    /// How often the picture was halved to keep the page small.
    pub halvings: u32,
    /// What rounding and leaving out change: root mean square over pixels of (page − atlas) / (atlas + 5 % of its mean), at
    /// the worst of 25 points.
    pub off: f64,
}

/// What the page's script reads.
#[derive(Serialize)]
struct Data<'a> {
    scene: String,
    width: u32,
    height: u32,
    passes: u32,
    seconds: Option<f64>,
    off: f64,
    cut: bool,
    n: &'a [u8],
    m: &'a [u8],
    /// t, κ(t).
    kappa: Vec<[f64; 2]>,
    reach: f64,
    coefficients: &'a [Vec<f64>],
    grid: [f64; GRID.len()],
    cell: u32,
    /// The average radiance half-way into the square: what exposure starts from.
    mean: f64,
}

/// Makes the page; the picture is halved until it takes no more than `most_bytes`.
///
/// # Errors
/// A picture that cannot be encoded.
pub fn square_page(atlas: &Atlas, header: &Header, most_bytes: usize) -> io::Result<SquarePage> {
    let (mut atlas, mut halvings) = (atlas.clone(), 0);
    loop {
        let page = at_this_size(&atlas, header, halvings)?;
        if page.html.len() <= most_bytes || atlas.width.min(atlas.height) <= 64 {
            return Ok(page);
        }
        atlas = halved(&atlas);
        halvings += 1;
    }
}

fn at_this_size(atlas: &Atlas, header: &Header, halvings: u32) -> io::Result<SquarePage> {
    let size = (atlas.width, atlas.height);
    let mut reduced = Reduced::of(atlas);
    let quantised = Quantised::of(size, &reduced.components);
    reduced.components = (0..reduced.components.len()).map(|q| quantised.radiance(q)).collect();
    let off = difference(atlas, &reduced);
    let text = |name: &str| header.get(name).map(ToString::to_string);
    let scene = text("scene").unwrap_or_else(|| "a scene".into());
    let middle = atlas.weights(0.5 * atlas.frontier.largest_s(0.5), 0.5);
    let mean = (0..size.0 as usize * size.1 as usize)
        .map(|i| f64::from(reduced.pixel(&middle, i).element_sum()) / 3.0)
        .sum::<f64>()
        / (f64::from(size.0) * f64::from(size.1));
    let data = Data {
        scene: scene.clone(),
        width: size.0,
        height: size.1,
        passes: atlas.passes,
        seconds: header.get("seconds").and_then(crate::film::Value::as_real),
        off,
        cut: atlas.cut,
        n: atlas.n.powers(),
        m: atlas.m.powers(),
        kappa: atlas.frontier.samples().iter().map(|s| [s.t, s.kappa.min(1e9)]).collect(),
        reach: crate::atlas::REACH,
        coefficients: &reduced.coefficients,
        grid: GRID,
        cell: CELL,
        mean,
    };
    let picture = |id: &str, png: &[u8]| {
        format!("<img alt=\"\" hidden id=\"{id}\" src=\"data:image/png;base64,{}\">\n", base64(png))
    };
    let mut pictures = picture("exponents", &quantised.exponents_png()?);
    for q in 0..quantised.components.len() {
        pictures.push_str(&picture(&format!("component-{q}"), &quantised.component_png(q)?));
    }
    if let Some(errors) = &atlas.errors {
        pictures.push_str(&picture("errors", &errors_png(size, &errors.planes)?));
    }
    let html = filled(&escape(&scene), &pictures, &serde_json::to_string(&data)?.replace('<', "\\u003c"));
    Ok(SquarePage { html, components: reduced.components.len(), halvings, off })
}

fn filled(scene: &str, pictures: &str, data: &str) -> String {
    let values = [
        ("style", include_str!("square.css")),
        ("scene", scene),
        ("pictures", pictures),
        ("script", include_str!("square.js")),
        ("data", data),
    ];
    fill(include_str!("square.html"), &values)
}

/// See [`SquarePage::off`].
fn difference(atlas: &Atlas, reduced: &Reduced) -> f64 {
    let points = GRID.iter().flat_map(|t| GRID.iter().map(move |share| (*share, *t)));
    points
        .map(|(share, t)| {
            let weights = atlas.weights(0.97 * share * atlas.frontier.largest_s(t), t);
            let pixels = atlas.width as usize * atlas.height as usize;
            let mut picture = vec![Vec3::ZERO; pixels];
            for (plane, weight) in atlas.planes.iter().zip(&weights) {
                let weight = *weight as f32;
                picture.iter_mut().zip(plane).for_each(|(sum, x)| *sum += weight * *x);
            }
            let mean = picture.iter().map(|v| v.element_sum()).sum::<f32>() / (3.0 * pixels as f32);
            if mean == 0.0 {
                return 0.0;
            }
            let square = |(i, truth): (usize, &Vec3)| {
                let off = (reduced.pixel(&weights, i) - *truth) / (*truth + 0.05 * mean);
                f64::from(off.length_squared())
            };
            (picture.iter().enumerate().map(square).sum::<f64>() / (3.0 * pixels as f64)).sqrt()
        })
        .fold(0.0, f64::max)
}

/// Half the size, by means over 2×2 pixels (fewer at the border); errors stay those of one pixel before.
fn halved(atlas: &Atlas) -> Atlas {
    let plane = |plane: &Vec<Vec3>| {
        let nothing = vec![false; plane.len()];
        if plane.is_empty() {
            Vec::new()
        } else {
            super::pictures::halved(atlas.width, atlas.height, plane, &nothing).2
        }
    };
    let mut smaller = atlas.clone();
    smaller.planes = atlas.planes.iter().map(plane).collect();
    if let Some(errors) = &mut smaller.errors {
        errors.planes = errors.planes.iter().map(plane).collect();
    }
    smaller.width = atlas.width.div_ceil(2);
    smaller.height = atlas.height.div_ceil(2);
    smaller
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `HALFLIGHT_REWRITE=1` makes it anew from its own data.
    #[test]
    fn the_page_of_the_documentation_looks_as_pages_made_now() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/square.html");
        let Ok(page) = std::fs::read_to_string(&path) else {
            io::Write::write_all(
                &mut io::stderr(),
                b"SKIPPED: this copy of halflight is without docs/square.html\n",
            )
            .expect("a log");
            return;
        };
        let between = |begin: &str, end: &str| {
            page.split_once(begin).expect("its begin").1.split_once(end).expect("its end").0
        };
        let scene = between("<title>The illumination square · ", "</title>");
        let pictures = between("<div hidden>\n", "</div>\n<script");
        let data = between("<script type=\"application/json\" id=\"data\">", "</script>");
        let renewed = filled(scene, pictures, data);
        if std::env::var_os("HALFLIGHT_REWRITE").is_some() {
            std::fs::write(&path, &renewed).expect("it is written");
        }
        assert!(
            std::fs::read_to_string(&path).is_ok_and(|kept| kept == renewed),
            "docs/square.html is not of now"
        );
    }
}
