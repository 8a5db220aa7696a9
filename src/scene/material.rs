use super::{Emission, Illumination, Matter};
use crate::light::Matrix;
use crate::optics::{Bsdf, Lobe, Term};

/// What a surface is made of.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name, for `--set` and messages.
    pub name: String,
    /// The scalar lobes with their shares: together the paper's f_opaque.
    pub lobes: Vec<(f32, Lobe)>,
    /// The material's own illumination (extras), if it has one.
    pub illumination: Option<Illumination>,
    /// The material's own matrix of the lobes (extras), over what `illumination` says.
    pub opaque: Option<Matrix>,
    /// The material's own matrix of the straight term (extras), over what `illumination` says.
    pub straight: Option<Matrix>,
    /// What it radiates, if it is a luminaire.
    pub emission: Option<Emission>,
    /// The resolved matrix BSDF; see [`Scene::illuminate`](super::Scene::illuminate).
    pub bsdf: Bsdf,
    /// The illumination that `bsdf` was resolved from, in words.
    pub resolved: String,
}

impl Material {
    /// A material that reflects by one lobe and takes its illumination from the scene.
    pub fn new(name: impl Into<String>, lobe: Lobe) -> Self {
        Self {
            name: name.into(),
            lobes: vec![(1.0, lobe)],
            illumination: None,
            opaque: None,
            straight: None,
            emission: None,
            bsdf: Bsdf::default(),
            resolved: String::new(),
        }
    }

    /// Sets [`bsdf`](Self::bsdf): `chosen` (command line) over the own extras over `around` (the scene's).
    pub(super) fn resolve(&mut self, around: Illumination, chosen: Option<Illumination>) {
        let surroundings = around.own_matter();
        let illumination = chosen.or(self.illumination).unwrap_or(around);
        let mut matter = illumination.matter(surroundings);
        if chosen.is_none() {
            matter.opaque = self.opaque.unwrap_or(matter.opaque);
            matter.straight = self.straight.unwrap_or(matter.straight);
        }
        let own = chosen.is_none() && (self.opaque.is_some() || self.straight.is_some());
        self.resolved = if own { Illumination::Own(matter).describe() } else { illumination.describe() };
        self.bsdf = self.assemble(matter);
    }

    fn assemble(&self, matter: Matter) -> Bsdf {
        let terms = self
            .lobes
            .iter()
            .map(|&(share, lobe)| Term { coefficient: share * matter.opaque, lobe })
            .filter(|term| !term.coefficient.is_zero())
            .collect();
        Bsdf { straight: matter.straight, terms }
    }
}
