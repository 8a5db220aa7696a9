//! The built-in scenes, made in code. `name?key=value&…` chooses what can be chosen about one.

mod boxes;
mod spheres;

use super::Scene;
use crate::error::Error;
use spheres::Concentric;
use std::str::FromStr;

pub(super) const LIST: &[(&str, &str)] = &[
    ("caustic-box", "a glass and a mirror sphere in a box, with a caustic on the floor"),
    ("cornell-spheres", "two diffuse spheres in a box: the paper's figure 1"),
    (
        "fluorescent-box",
        "a box under blue light, walls and a ball that glow by it, and a glass ball that throws a caustic of the glow; \
         ?fluorescence=false",
    ),
    ("two-spheres", "500,000 triangles under a luminaire that is not seen: the paper's figure 4"),
    (
        "concentric",
        "a sphere in a spherical room, whose multiplication factor has a closed form; \
         ?albedo=0.5&ratio=0.5&two_sided=false",
    ),
];

pub(super) fn scene(name: &str) -> crate::error::Result<Scene> {
    let full = format!("builtin:{name}");
    build(name, full.clone()).map_err(|reason| Error::scene(full.escape_debug().to_string(), reason))
}

fn build(name: &str, full: String) -> Result<Scene, String> {
    let (kind, query) = name.split_once('?').unwrap_or((name, ""));
    let mut query = Query::parse(query)?;
    let scene = match kind {
        "caustic-box" => boxes::caustic_box(full),
        "fluorescent-box" => {
            let glows = query.take("fluorescence", true, |_| true, "true or false")?;
            boxes::fluorescent_box(full, glows)
        }
        "cornell-spheres" => boxes::cornell_spheres(full),
        "two-spheres" => spheres::two_spheres(full),
        "concentric" => spheres::concentric(
            full,
            &Concentric {
                albedo: query.take("albedo", 0.5, |x| (0.0..=1.0).contains(x), "a number from 0 to 1")?,
                ratio: query.take(
                    "ratio",
                    0.5,
                    |x| *x >= 0.01 && *x <= 0.99,
                    "a number from 0.01 to 0.99",
                )?,
                two_sided: query.take("two_sided", false, |_| true, "true or false")?,
            },
        ),
        _ => {
            let known: Vec<_> = LIST.iter().map(|(name, _)| *name).collect();
            return Err(format!("there is no such scene; choose {}", known.join(", ")));
        }
    };
    query.finish()?;
    scene
}

/// What follows the question mark.
struct Query {
    pairs: Vec<(String, String)>,
    known: Vec<&'static str>,
}

impl Query {
    fn parse(text: &str) -> Result<Self, String> {
        let pair = |part: &str| {
            let (key, value) = part.split_once('=').ok_or_else(|| format!("`{part}` is not key=value"))?;
            Ok((key.to_owned(), value.to_owned()))
        };
        let parts = text.split('&').filter(|part| !part.is_empty());
        Ok(Self { pairs: parts.map(pair).collect::<Result<_, String>>()?, known: Vec::new() })
    }

    fn take<T: FromStr>(
        &mut self,
        key: &'static str,
        default: T,
        fine: impl Fn(&T) -> bool,
        allowed: &str,
    ) -> Result<T, String> {
        self.known.push(key);
        let Some(index) = self.pairs.iter().position(|(name, _)| name == key) else { return Ok(default) };
        let (_, text) = self.pairs.remove(index);
        let value = text.parse().ok().filter(fine);
        value.ok_or_else(|| format!("{key} is `{}`; write {allowed}", text.escape_debug()))
    }

    fn finish(self) -> Result<(), String> {
        match (self.pairs.first(), self.known.is_empty()) {
            (None, _) => Ok(()),
            (Some((key, _)), true) => Err(format!("`{}` cannot be chosen, nothing can", key.escape_debug())),
            (Some((key, _)), false) => {
                Err(format!("`{}` cannot be chosen; choose {}", key.escape_debug(), self.known.join(", ")))
            }
        }
    }
}
