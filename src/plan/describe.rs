//! The plan in words.

use super::{Direct, Frame, Method, Plan};

/// Who serves one class of light paths.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Technique {
    /// Which paths.
    pub paths: &'static str,
    /// By what.
    pub by: &'static str,
    /// Why.
    pub because: String,
}

impl Frame {
    /// What is done and what is left out, in one line.
    pub fn one_line(&self, plan: &Plan) -> String {
        let Self { width, height, samples, .. } = *self;
        let photons = match (&self.photons, plan.settings.method) {
            (Some(photons), Method::Nearest) => {
                format!("{} photon paths a pass, the nearest {}", photons.paths, plan.settings.nearest)
            }
            (Some(photons), _) => format!("{} photon paths a pass", photons.paths),
            (None, method) if method.shoots() => "no photons".into(),
            (None, method) => format!("{}, {samples} samples a pixel and pass", method.name()),
        };
        let names: Vec<_> = plan.omissions.iter().map(|omission| omission.name).collect();
        let omitted =
            if names.is_empty() { String::new() } else { format!("; left out: {}", names.join(", ")) };
        format!(
            "{}: {} triangles, {}; {width}x{height}, {photons}{omitted}",
            plan.scene.name,
            plan.scene.mesh.triangles.len(),
            plan.scene.describe_illumination(),
        )
    }

    /// Who serves which class of paths. Empty for path tracers, which tell none apart.
    pub fn techniques(&self, plan: &Plan) -> Vec<Technique> {
        if !plan.settings.method.shoots() {
            return Vec::new();
        }
        let direct = Technique {
            paths: "direct light",
            by: match self.direct {
                Direct::Photons => "photons",
                Direct::Auto | Direct::Connection => "connections",
            },
            because: match (&self.sights, self.direct) {
                (Some(_), Direct::Connection) => {
                    format!("{}; a pilot learned which of them are seen from where", self.direct_because)
                }
                _ => self.direct_because.clone(),
            },
        };
        let reflected = |paths, arrives: bool, because: &str| {
            let by = if plan.settings.method == Method::Nearest { "nearest photons" } else { "photons" };
            let (by, because) = if arrives { (by, because) } else { ("nothing", "there is none") };
            Technique { paths, by, because: because.into() }
        };
        let classes = self.photons.as_ref().map(|photons| photons.classes).unwrap_or_default();
        let starts = self.photons.as_ref().map(|photons| {
            let (by, because) = match (&photons.starts, &photons.guide) {
                (Some(starts), _) => {
                    let gain = starts.gain();
                    ("use", format!("they are {gain:.0} times as dense where what they bring is seen"))
                }
                (None, Some(_)) => ("use", "they are denser where caustics begin".into()),
                (None, None) if plan.settings.even_starts => ("power", "asked for".into()),
                (None, None) if !plan.settings.learns() => ("power", "as the textbook has it".into()),
                (None, None) => ("power", "a pilot found none of much more use than others".into()),
            };
            Technique { paths: "starts of photons", by, because }
        });
        let mut all = vec![
            direct,
            reflected("caustics", classes.caustic, "which alone find their way through mirrors and glass"),
            reflected("inter-reflection", classes.indirect, "from a map that all pixels share"),
        ];
        all.extend(starts);
        all
    }
}
