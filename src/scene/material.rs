use super::{Emission, Fluorescence, Illumination, Inputs, Matter, Pbr};
use crate::light::Matrix;
use crate::optics::{Bsdf, Dielectric, Diffuse, Lobe, Mirror, Term};
use glam::Vec3;
use std::borrow::Cow;
use std::sync::Arc;

/// What a surface is made of. Its matrix BSDF follows from all of this and from the scene's illumination, by
/// [`SceneBuilder::build`](super::SceneBuilder::build) and [`Scene::illuminate`](super::Scene::illuminate).
#[derive(Clone, Debug)]
pub struct Material {
    /// Name, for `--set` and messages.
    pub name: String,
    /// The scalar lobes with their shares: together the paper's f_opaque. Where there is a `pattern`, what no point of it exceeds.
    pub lobes: Vec<(f32, Lobe)>,
    /// What the lobes follow from where they are not the same everywhere.
    pub pattern: Option<Arc<Pbr>>,
    /// The material's own illumination (extras), if it has one.
    pub illumination: Option<Illumination>,
    /// The material's own matrix of the lobes (extras), over what `illumination` says.
    pub opaque: Option<Matrix>,
    /// The material's own matrix of the straight term (extras), over what `illumination` says.
    pub straight: Option<Matrix>,
    /// What its diffuse lobes re-radiate in other colours. None: nothing, as a rule.
    pub fluorescence: Option<Fluorescence>,
    /// What it radiates, if it is a luminaire.
    pub emission: Option<Emission>,
    /// What its backs are to rays.
    pub backs: Backs,
    /// Of the body that it encloses, if it is solid glass: the coefficient by which light is absorbed on its way, linear RGB, m⁻¹
    /// (Beer and Lambert: exp(−absorption × distance) is left).
    pub absorption: Vec3,
    /// How its glass spreads colours: 20 over Abbe's number, as KHR_materials_dispersion has it; 0 not at all.
    pub dispersion: f32,
    /// The share of the surface that is there, in [0, 1]: 1 as a rule, and where the `pattern` says how much is. Of what is not there
    /// nothing is reflected or radiated, and light goes straight through.
    pub covered: f32,
    /// The most that all lobes together send on of light from any direction, linear RGB, where that is less than the sum of
    /// their bounds.
    pub(crate) most: Option<Vec3>,
    /// The matrix of what goes straight through where it is there.
    pub(crate) straight_there: Matrix,
    /// The resolved matrix BSDF; where there is a `pattern`, of `lobes`, which are its bounds.
    pub(crate) bsdf: Bsdf,
    /// The resolved matrix of the lobes.
    pub(crate) reflects: Matrix,
    /// The illumination that `bsdf` was resolved from, in words.
    pub(crate) resolved: String,
    /// Which of its matrices are those of the scene's point of the square.
    pub(crate) follows: Follows,
}

/// What the backs of a material's triangles are to rays. glTF culls those of surfaces that are not `doubleSided`, as if they were
/// not there; eq. 6 of the paper has them absorb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backs {
    /// There for the eye and for light: a one-sided lobe absorbs what comes to its back.
    #[default]
    Seen,
    /// The eye looks through them, also by way of mirrors and glass; light is absorbed by them.
    Unseen,
}

/// The part of a material that follows the scene's point (s, t) of the square; the rest has matrices of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Follows {
    /// The s of its opaque matrix, where that is the scene's.
    pub s: Option<f32>,
    /// The t of its straight matrix, where that is the scene's.
    pub t: Option<f32>,
}

impl Material {
    /// A material that reflects by one lobe and takes its illumination from the scene.
    pub fn new(name: impl Into<String>, lobe: Lobe) -> Self {
        Self {
            name: name.into(),
            lobes: vec![(1.0, lobe)],
            pattern: None,
            illumination: None,
            opaque: None,
            straight: None,
            fluorescence: None,
            emission: None,
            backs: Backs::Seen,
            absorption: Vec3::ZERO,
            dispersion: 0.0,
            covered: 1.0,
            most: None,
            straight_there: Matrix::ZERO,
            bsdf: Bsdf::default(),
            reflects: Matrix::ZERO,
            resolved: String::new(),
            follows: Follows::default(),
        }
    }

    /// A glTF material, with its emission. It has a `pattern` where it is not the same everywhere.
    pub fn pbr(name: impl Into<String>, pbr: Pbr) -> Self {
        let mut plain = Self::diffuse(name, Vec3::ZERO);
        plain.emission = pbr.emitted();
        plain.made_of(pbr)
    }

    /// With the lobes of a glTF material, and with its pattern where it has one.
    fn made_of(self, pbr: Pbr) -> Self {
        let most = Some(pbr.most_reflected());
        let covered = if pbr.has_holes() { 1.0 } else { pbr.mean_covered() };
        let (lobes, pattern) = match pbr.varies() {
            true => (pbr.envelope().collect(), Some(Arc::new(pbr))),
            false => (pbr.lobes(&Inputs::default()).collect(), None),
        };
        Self { lobes, pattern, most, covered, ..self }
    }

    /// Drops textures that nothing depends on, for a material whose matrices are resolved. False: there were none.
    pub(crate) fn drop_unread(&mut self) -> bool {
        let Some(pattern) = self.pattern.take() else { return false };
        let reflects = !self.bsdf.terms.is_empty();
        let kept = pattern.read(reflects);
        if kept == *pattern {
            self.pattern = Some(pattern);
            return false;
        }
        *self = std::mem::replace(self, Self::diffuse("", Vec3::ZERO)).made_of(kept);
        if reflects {
            self.bsdf.terms = self.terms(self.reflects);
        }
        true
    }

    /// Lambert's reflector, one-sided; `albedo` in [0, 1].
    pub fn diffuse(name: impl Into<String>, albedo: Vec3) -> Self {
        Self::new(name, Lobe::Diffuse(Diffuse { albedo, two_sided: false, under: None }))
    }

    /// A smooth mirror, one-sided, that keeps `tint` in [0, 1] of what it meets at all angles.
    pub fn mirror(name: impl Into<String>, tint: Vec3) -> Self {
        Self::new(name, Lobe::Mirror(Mirror::plain(tint, false)))
    }

    /// Polished metal, one-sided, that keeps `base` in [0, 1] of what it meets face on, and all of what grazes it.
    pub fn metal(name: impl Into<String>, base: Vec3) -> Self {
        Self::new(name, Lobe::Mirror(Mirror::metal(base, false)))
    }

    /// Clear glass, for shapes that enclose a volume; `ior` is above 0, 1.5 for window glass.
    pub fn glass(name: impl Into<String>, ior: f32) -> Self {
        Self::new(name, Lobe::Dielectric(Dielectric { ior, tint: Vec3::ONE }))
    }

    /// With an illumination of its own, whatever that of the scene is.
    #[must_use]
    pub fn with_illumination(self, illumination: Illumination) -> Self {
        Self { illumination: Some(illumination), ..self }
    }

    /// With a body that absorbs light on its way through it, m⁻¹, linear RGB; for solid glass.
    #[must_use]
    pub fn with_absorption(self, absorption: Vec3) -> Self {
        Self { absorption, ..self }
    }

    /// With glass that spreads colours: 20 over Abbe's number (0.36 for crown glass, 0.67 for flint glass).
    #[must_use]
    pub fn with_dispersion(self, dispersion: f32) -> Self {
        Self { dispersion, ..self }
    }

    /// With its own matrix of what it reflects: rows, finite and not negative.
    #[must_use]
    pub fn with_opaque(self, matrix: impl Into<Matrix>) -> Self {
        Self { opaque: Some(matrix.into()), ..self }
    }

    /// With its own matrix of what goes straight through: rows, finite and not negative.
    #[must_use]
    pub fn with_straight(self, matrix: impl Into<Matrix>) -> Self {
        Self { straight: Some(matrix.into()), ..self }
    }

    /// Fluorescent: its diffuse lobes re-radiate light in other colours.
    #[must_use]
    pub fn with_fluorescence(self, fluorescence: Fluorescence) -> Self {
        Self { fluorescence: Some(fluorescence), ..self }
    }

    /// Shining: each of its triangles becomes a luminaire.
    #[must_use]
    pub fn with_emission(mut self, emission: Emission) -> Self {
        if let Some(pattern) = &mut self.pattern {
            Arc::make_mut(pattern).emission = [0.0; 2]; // its own is no more
        }
        Self { emission: Some(emission), ..self }
    }

    /// The matrix BSDF at a point of the surface: what every walk asks, by way of
    /// [`Scene::matter_at`](super::Scene::matter_at). Lent where it is the same everywhere.
    #[inline]
    pub fn at(&self, inputs: &Inputs) -> Cow<'_, Bsdf> {
        match &self.pattern {
            // Of lobes that all came to nothing, or that nothing reads, none comes back.
            Some(pattern) if !self.bsdf.terms.is_empty() || self.has_holes() => {
                let covered = self.covered_at(inputs);
                let read = !self.bsdf.terms.is_empty() && covered > 0.0;
                let lobes = pattern.lobes(inputs);
                let terms = if read { self.terms_of(lobes, covered, self.reflects) } else { Vec::new() };
                Cow::Owned(Bsdf { straight: partly(self.straight_there, covered), terms })
            }
            _ => Cow::Borrowed(&self.bsdf),
        }
    }

    /// True where more of it may be there in one place than in another.
    pub fn has_holes(&self) -> bool {
        self.pattern.as_ref().is_some_and(|pattern| pattern.has_holes())
    }

    fn covered_at(&self, inputs: &Inputs) -> f32 {
        match &self.pattern {
            // How much is there is a matter of the point: whoever looks from afar must meet the same holes.
            Some(pattern) if pattern.has_holes() => pattern.covered(&Inputs { widths: [0.0; 2], ..*inputs }),
            _ => self.covered,
        }
    }

    /// What goes straight through at a point.
    pub(crate) fn straight_at(&self, inputs: &Inputs) -> Matrix {
        partly(self.straight_there, self.covered_at(inputs))
    }

    /// The matrix BSDF F = Σ C_k f_k that plans and bounds look at, at every point no less than that there; empty before it is
    /// resolved.
    pub fn bsdf(&self) -> &Bsdf {
        &self.bsdf
    }

    /// The illumination that the BSDF was resolved from, in words; empty before.
    pub fn resolved(&self) -> &str {
        &self.resolved
    }

    /// True for glass that encloses a body.
    pub fn is_solid(&self) -> bool {
        self.bsdf.terms.iter().any(|term| term.lobe.is_solid())
    }

    /// True for matter that light does not notice: it neither shines nor reflects and lets all light straight through.
    pub fn is_nothing(&self) -> bool {
        self.emission.is_none() && self.bsdf.straight == Matrix::IDENTITY && self.bsdf.terms.is_empty()
    }

    /// True where it reflects some of the visible half of light that arrives.
    pub(super) fn reads_visible(&self) -> bool {
        self.bsdf.terms.iter().any(|term| term.coefficient.rows().iter().any(|[_, visible]| *visible != 0.0))
    }

    /// Sets `bsdf`: `chosen` (command line) over the own extras over `around` (the scene's).
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
        self.follows = Follows::default();
        if let Illumination::Square { s, t } = around {
            let theirs = chosen.or(self.illumination);
            let own = |matrix: Option<Matrix>| chosen.is_none() && matrix.is_some();
            let whitted = theirs == Some(Illumination::Whitted);
            self.follows.s = (theirs.is_none() && !own(self.opaque)).then_some(s);
            self.follows.t = ((theirs.is_none() || whitted) && !own(self.straight)).then_some(t);
        }
        if self.fluorescence.is_some_and(|own| own.replaces()) {
            self.follows.s = None; // it has a matrix of its own, whatever the scene's is
        }
        self.reflects = matter.opaque;
        self.straight_there = matter.straight;
        self.bsdf = self.assemble(matter);
    }

    /// Moves what follows the scene's point of the square to another point.
    pub(super) fn move_to(&mut self, s: f32, t: f32) {
        let there = Illumination::Square { s, t }.own_matter();
        if let Some(own) = &mut self.follows.s {
            *own = s;
            self.reflects = there.opaque;
            self.bsdf.terms = self.terms(there.opaque);
        }
        if let Some(own) = &mut self.follows.t {
            *own = t;
            self.straight_there = there.straight;
            self.bsdf.straight = self.straight();
        }
    }

    /// What goes straight through it, and where it has holes something of all that goes through anywhere.
    fn straight(&self) -> Matrix {
        partly(self.straight_there, if self.has_holes() { 0.5 } else { self.covered })
    }

    fn assemble(&self, matter: Matter) -> Bsdf {
        Bsdf { straight: self.straight(), terms: self.terms(matter.opaque) }
    }

    fn terms(&self, opaque: Matrix) -> Vec<Term> {
        self.terms_of(self.lobes.iter().copied(), self.covered, opaque)
    }

    /// What lobes do of which the share `covered` is there.
    fn terms_of(&self, lobes: impl Iterator<Item = (f32, Lobe)>, covered: f32, opaque: Matrix) -> Vec<Term> {
        let Some(fluorescence) = &self.fluorescence else {
            let term = |(share, lobe)| Term::new((covered * share) * opaque, lobe);
            return lobes.map(term).filter(|term| !term.coefficient.is_zero()).collect();
        };
        let mut terms = Vec::new();
        for (share, lobe) in lobes {
            let share = covered * share;
            let diffuse = lobe.as_diffuse();
            if diffuse.is_none() || !fluorescence.replaces() {
                terms.push(Term::new(share * opaque, lobe));
            }
            if let Some(diffuse) = diffuse {
                fluorescence.add_terms(&mut terms, share, diffuse, opaque);
            }
        }
        terms.retain(|term| !term.coefficient.is_zero());
        terms
    }
}

/// What goes straight through matter of which the share `covered` is there, where `straight` does so through all of it.
fn partly(straight: Matrix, covered: f32) -> Matrix {
    if covered == 1.0 {
        return straight;
    }
    let (there, hole) = (covered * straight, 1.0 - covered);
    Matrix { inv_inv: there.inv_inv + hole, vis_vis: there.vis_vis + hole, ..there }
}
