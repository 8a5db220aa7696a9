//! What can reach the camera? The coefficient matrices are read like a program and iterated to fixed points.
//!
//! Geometry is not looked at: light that leaves any surface may arrive at any other. Components of light (half and colour)
//! are followed, not halves alone: a red mirror passes on nothing of a green lamp.

use super::components::{Components, fixed_point};
use super::glints::reads as reads_glints;
use crate::optics::{Bsdf, Term};
use crate::photon::PathClass;
use crate::scene::{Luminaire, Scene};
use glam::Vec3;

/// What can come from where, and what of it is read.
pub(super) struct Flow {
    /// Components of light leaving surfaces that camera rays read, as far as they end at diffuse lobes.
    seen_at_once: Components,
    /// The same where they [go on](Self::followed).
    pub seen: Components,
    /// Components that finite lobes read in arriving light, where camera rays end.
    pub gathered: Components,
    /// Components of light leaving surfaces that camera paths read which go on by any lobe.
    anywhere: Components,
    /// Components that glossy lobes read of arriving caustics, where photons keep their directions.
    glints: Components,
    /// Components of light leaving a luminaire that may be gathered without being reflected before.
    pub linked: Components,
    /// Components of light on the way that may still be gathered.
    pub useful: Components,
    /// Components in which light of each [`PathClass`] is on the way at all.
    present: [Components; 3],
}

impl Flow {
    /// What flows among `bsdfs`, from what the luminaires of `scene` emit.
    /// `glints`: caustics are read from photons by glossy lobes too.
    pub fn of(scene: &Scene, invisible_layer: bool, glints: bool) -> Self {
        let bsdfs = || scene.materials.iter().map(|material| &material.bsdf);
        let all = || bsdfs().flat_map(|bsdf| &bsdf.terms);
        // Camera rays go on by the others; connections and photons may come by glossy lobes, that are neither Lambert's nor delta.
        let read = || all().filter(|term| term.lobe.as_diffuse().is_some());
        let passed_on = || all().filter(|term| term.lobe.as_diffuse().is_none());
        let finite = || all().filter(|term| !term.lobe.is_delta());
        let before_straights = |set: Components| union(bsdfs().map(|b| set.before(b.straight, Vec3::ONE)));
        let after_straights = |set: Components| union(bsdfs().map(|b| set.after(b.straight, Vec3::ONE)));

        let picture = Components::VISIBLE;
        let start = if invisible_layer { picture.or(Components::INVISIBLE) } else { picture };
        let seen = fixed_point(start, |seen| {
            union(passed_on().map(|term| before(seen, term))).or(before_straights(seen))
        });
        let gathered = union(read().map(|term| before(seen, term)));
        // By camera paths that were scattered, too: what they must not count themselves, photons must bring.
        let anywhere =
            fixed_point(start, |seen| union(all().map(|term| before(seen, term))).or(before_straights(seen)));
        let glossy = || passed_on().filter(|term| glints && reads_glints(&term.lobe));
        let glints = union(glossy().map(|term| before(anywhere, term)));
        let linked = fixed_point(union(finite().map(|term| before(seen, term))), before_straights);
        let emitted = union(scene.luminaires.iter().map(emission));
        let direct = fixed_point(emitted, after_straights);
        let mirrored = |set: Components| union(passed_on().map(|term| after(set, term)));
        let caustic = fixed_point(mirrored(direct), |set| mirrored(set).or(after_straights(set)));
        let scattered = |set: Components| union(finite().map(|term| after(set, term)));
        let indirect = fixed_point(scattered(direct.or(caustic)), |set| {
            scattered(set).or(mirrored(set)).or(after_straights(set))
        });
        let glints = glints.and(caustic);
        let useful = fixed_point(gathered.or(glints), |useful| {
            union(all().map(|term| before(useful, term))).or(before_straights(useful))
        });
        Self {
            seen_at_once: seen,
            seen,
            gathered,
            anywhere,
            glints,
            linked,
            useful,
            present: [direct, caustic, indirect],
        }
    }

    /// The same where camera rays go on by diffuse lobes too.
    pub fn followed(self, scene: &Scene) -> Self {
        let bsdfs = || scene.materials.iter().map(|material| &material.bsdf);
        let all = || bsdfs().flat_map(|bsdf| &bsdf.terms);
        let before_straights = |set: Components| union(bsdfs().map(|b| set.before(b.straight, Vec3::ONE)));
        let seen = fixed_point(self.seen, |seen| {
            union(all().map(|term| before(seen, term))).or(before_straights(seen))
        });
        let finite = all().filter(|term| !term.lobe.is_delta());
        let linked = fixed_point(union(finite.map(|term| before(seen, term))), before_straights);
        Self { seen, linked, ..self }
    }

    /// Components in which light of one class is on the way.
    pub fn present(&self, class: PathClass) -> Components {
        self.present[class as usize]
    }

    /// Components in which any light is on the way.
    pub fn present_at_all(&self) -> Components {
        union(self.present.into_iter())
    }

    /// True when light of `class` arrives somewhere in components that are gathered.
    pub fn arrives(&self, class: PathClass) -> bool {
        self.present(class).and(self.gathered).any() || (class == PathClass::Caustic && self.glints.any())
    }

    /// True when caustics arrive that this glossy term reads from photons.
    pub fn reads_glints(&self, term: &Term) -> bool {
        before(self.anywhere, term).and(self.glints).any()
    }

    /// True when a camera ray reads light of some class by this finite term. Those that went on by diffuse lobes read where others do;
    /// caustics they read anywhere.
    pub fn reads(&self, term: &Term) -> bool {
        let seen = if self.arrives(PathClass::Caustic) { self.seen } else { self.seen_at_once };
        before(seen, term).and(self.present_at_all()).any()
    }

    /// True when anything of use comes of this term, on the way from the luminaires or on that from the camera.
    pub fn uses(&self, term: &Term) -> bool {
        if term.turn.is_reradiated() {
            // Unlike what is reflected this is in no layer but those of light.
            let read = before(self.seen.or(self.useful), term);
            return read.and(self.present_at_all()).any();
        }
        before(self.seen_at_once, term).any() || after(self.present_at_all(), term).and(self.useful).any()
    }
}

/// What a luminaire emits. Not by its power, which may underflow.
pub(super) fn emission(luminaire: &Luminaire) -> Components {
    Components::of(luminaire.light())
}

/// True when surfaces of `bsdf` let the halves in `set` through unchanged, and adds nothing to them.
pub(super) fn passes(bsdf: &Bsdf, set: Components) -> bool {
    let [[ii, iv], [vi, vv]] = bsdf.straight.rows();
    (!set.invisible() || (ii == 1.0 && iv == 0.0)) && (!set.visible() || (vv == 1.0 && vi == 0.0))
}

fn before(set: Components, term: &Term) -> Components {
    set.turned_back(term.turn).before(term.coefficient, term.lobe.bound())
}

fn after(set: Components, term: &Term) -> Components {
    set.after(term.coefficient, term.lobe.bound()).turned(term.turn)
}

fn union(sets: impl Iterator<Item = Components>) -> Components {
    sets.fold(Components::NONE, Components::or)
}
