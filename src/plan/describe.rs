//! The plan in words.

use super::{Direct, Method, Plan, Settings};

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

impl Plan {
    /// What is done and what is left out, in one line.
    pub fn one_line(&self) -> String {
        let Settings { width, height, .. } = self.settings;
        let photons = match (&self.photons, self.settings.method) {
            (Some(photons), _) => format!("{} photon paths a pass", photons.paths),
            (None, Method::Photon) => "no photons".into(),
            (None, method) => {
                format!("{}, {} samples a pixel and pass", method.name(), self.settings.samples)
            }
        };
        let names: Vec<_> = self.omissions.iter().map(|omission| omission.name).collect();
        let omitted =
            if names.is_empty() { String::new() } else { format!("; left out: {}", names.join(", ")) };
        format!(
            "{}: {} triangles, {}; {width}x{height}, {photons}{omitted}",
            self.scene.name,
            self.scene.mesh.triangles.len(),
            self.scene.describe_illumination(),
        )
    }

    /// The same at length, with the reasons.
    pub fn describe(&self) -> String {
        let mut text = format!("{}\n", self.one_line());
        text.push_str(&format!("multiplication factor: {}\n", self.existence.describe()));
        text.extend(self.existence.refusal(&self.scene).map(|refusal| format!("{refusal}\n")));
        text.extend(self.existence.warning().map(|warning| format!("warning: {warning}\n")));
        for technique in self.techniques() {
            let Technique { paths, by, because } = technique;
            text.push_str(&format!("{paths}: {by}, {because}\n"));
        }
        for omission in &self.omissions {
            text.push_str(&format!("left out {}: {}\n", omission.name, omission.reason));
        }
        text
    }

    /// Who serves which class of paths. Empty for path tracers, which tell none apart.
    pub fn techniques(&self) -> Vec<Technique> {
        if self.settings.method != Method::Photon {
            return Vec::new();
        }
        let direct = Technique {
            paths: "direct light",
            by: match self.settings.direct {
                Direct::Photons => "photons",
                Direct::Auto | Direct::Connection => "connections",
            },
            because: self.direct_because.clone(),
        };
        let reflected = |paths, arrives: bool, because: &str| {
            let (by, because) = if arrives { ("photons", because) } else { ("nothing", "there is none") };
            Technique { paths, by, because: because.into() }
        };
        let classes = self.photons.as_ref().map(|photons| photons.classes).unwrap_or_default();
        vec![
            direct,
            reflected("caustics", classes.caustic, "which alone find their way through mirrors and glass"),
            reflected("inter-reflection", classes.indirect, "from a map that all pixels share"),
        ]
    }
}
