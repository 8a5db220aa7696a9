//! Does the image exist? The series of reflections converges if the multiplication factor k is below one.
//!
//! [`Existence::of`] reads the matrices first; only where they leave it open is k measured.

mod arrivals;
mod chain;
mod colours;
mod multiplication;

pub use multiplication::Multiplication;

use crate::optics::Lobe;
use crate::rays::Rays;
use crate::scene::{Material, Scene};
use chain::{Chain, materials};
use multiplication::measure;

/// What is known about the multiplication factor k.
#[derive(Clone, Debug, PartialEq)]
pub enum Existence {
    /// k is below one, or light that is caught is never seen: nothing to measure.
    Certain {
        /// k is no larger than this.
        at_most: f64,
        /// Why.
        reason: String,
    },
    /// k was measured.
    Measured(Multiplication),
}

/// No image where k is above one by so many standard errors.
const BEYOND_ERROR: f64 = 3.0;
/// Where k is above this, users are told how slow the series converges.
const NEAR_ONE: f64 = 0.98;
/// Where k (or its bound) is above this, photons are let fade before chance decides: see `PhotonPlan::growth`.
const STIFF: f64 = 0.99;
/// Where some albedo is above this, what light loses is for a measurement to say.
const NEARLY_LOSSLESS: f64 = 0.9999;
/// Light that is reflected more often than this is not followed to its end: that would take hours for each path.
const LONGEST: f64 = 4.0e6;
/// A material with this share of the reflected power is named.
const NAMED: f64 = 0.1;

impl Existence {
    /// Looks at the matrices and, only where they leave it open (or `always`), measures.
    pub fn of(scene: &Scene, rays: &Rays, seed: u64, always: bool) -> Self {
        let chain = Chain::of(scene);
        if chain.ends() {
            let reason = "no reflected light is reflected again, so the series has one term";
            return Self::Certain { at_most: 0.0, reason: reason.into() };
        }
        let most = |(_, material): (usize, &Material)| chain.most_reflected(material);
        let at_most = materials(scene).map(most).fold(0.0, f64::max);
        let glass = |material: &Material| {
            material
                .bsdf
                .terms
                .iter()
                .all(|t| matches!(t.lobe, Lobe::Dielectric(_) | Lobe::ThinDielectric(_)))
        };
        let opaque = materials(scene).filter(|(_, material)| !glass(material)).map(most).fold(0.0, f64::max);
        if !always && !chain.passes && opaque <= NEARLY_LOSSLESS && at_most <= 1.0 {
            let reason = if at_most < 1.0 {
                format!(
                    "what is reflected does not also go straight on, so no reflection keeps more than the largest \
                     albedo: the multiplication factor is at most {at_most:.3}"
                )
            } else {
                "what is reflected does not also go straight on, and only glass keeps all light: the multiplication \
                 factor cannot exceed one, and light caught in glass is never seen"
                    .into()
            };
            return Self::Certain { at_most, reason };
        }
        Self::Measured(measure(scene, rays, &chain, seed))
    }

    /// k as it was measured, else what it is at most.
    pub fn factor(&self) -> f64 {
        match self {
            Self::Certain { at_most, .. } => *at_most,
            Self::Measured(m) => m.k,
        }
    }

    /// The factor by which the power of a generation changes, where that is known and near one or above; else one.
    /// Where k cannot be told from one it is what k may be at the most, so that every path ends.
    pub fn growth(&self) -> f32 {
        let k = match self {
            Self::Certain { at_most, .. } => *at_most,
            Self::Measured(m) if self.is_unsettled() => m.k + BEYOND_ERROR * m.error,
            Self::Measured(m) => m.k,
        };
        if k > STIFF { k as f32 } else { 1.0 }
    }

    /// About how many reflections the paths of a series have that fades as slowly as this one. One where it need not fade.
    pub fn length(&self) -> f64 {
        let fading = match self {
            Self::Certain { at_most, .. } => 1.0 - at_most,
            Self::Measured(m) if self.is_unsettled() => BEYOND_ERROR * m.error,
            Self::Measured(m) => 1.0 - m.k,
        };
        if fading > 0.0 { 1.0 / fading } else { 1.0 }
    }

    /// True where k may be on either side of one.
    fn is_unsettled(&self) -> bool {
        matches!(self, Self::Measured(m) if !self.is_refuted() && m.k + BEYOND_ERROR * m.error >= 1.0)
    }

    /// True when there is no image: k is one or more, beyond its error, or so near to one that no path can be followed to
    /// its end.
    pub fn is_refuted(&self) -> bool {
        let Self::Measured(m) = self else { return false };
        let least = m.k - BEYOND_ERROR * m.error;
        // Light that only mirrors and glass pass on, without loss, is caught there: k is one and nothing is seen.
        let endless = if m.finite > 0.0 { 1.0 - 1.0 / LONGEST } else { 1.0 + 1.0 / LONGEST };
        least >= endless
    }

    /// k with its error, or what it is at most.
    pub fn describe(&self) -> String {
        match self {
            Self::Certain { at_most: 0.0, .. } => "0, light is reflected once".into(),
            Self::Certain { at_most, .. } => format!("at most {at_most:.3}"),
            Self::Measured(m) => with_error(m.k, m.error),
        }
    }

    /// Why there is no image and what to do about it, in one line; None where there is one.
    pub fn refusal(&self, scene: &Scene) -> Option<String> {
        let Self::Measured(m) = self else { return None };
        if !self.is_refuted() {
            return None;
        }
        let chain = Chain::of(scene);
        let mut named: Vec<(&Material, f64)> = materials(scene)
            .map(|(i, material)| (material, m.shares[i]))
            .filter(|(_, share)| *share > NAMED)
            .collect();
        named.sort_by(|a, b| b.1.total_cmp(&a.1));
        // Materials that differ in name alone share their words.
        let mut words: Vec<(&str, String, Vec<&str>)> = Vec::new();
        for (material, _) in &named {
            let kept = kept(material, m.channel);
            match words.iter_mut().find(|known| known.0 == material.resolved && known.1 == kept) {
                Some(known) => known.2.push(&material.name),
                None => words.push((&material.resolved, kept, vec![&material.name])),
            }
        }
        let words: Vec<String> = words
            .iter()
            .map(|(resolved, kept, names)| format!("{resolved} {}, {kept}", names.join(", ")))
            .collect();
        if m.k < 1.0 + 1.0 / LONGEST {
            return Some(format!(
                "no image exists: multiplication factor {} cannot be told from 1: some light is shut in and lost \
                 nowhere ({}). Lower the albedo, or open what encloses that light; or truncate the series with \
                 --max-reflections N.",
                with_error(m.k, m.error),
                words.join("; "),
            ));
        }
        let mut advice = advice(&named, m.k, chain);
        for (material, _) in &named {
            if is_glass(material) && !material.bsdf.straight.is_zero() {
                advice.push(format!(
                    "--set {0}=global, since {0} both refracts light and lets it straight through",
                    material.name
                ));
            }
        }
        Some(format!(
            "no image exists: multiplication factor {} ≥ 1 ({}). {}; or truncate the series with --max-reflections N.",
            with_error(m.k, m.error),
            words.join("; "),
            advice.join("; or "),
        ))
    }

    /// A line for whoever waits: how slow convergence will be. None where k is far from one.
    pub fn warning(&self) -> Option<String> {
        let Self::Measured(m) = self else { return None };
        if m.k <= NEAR_ONE || self.is_refuted() {
            return None;
        }
        let k = with_error(m.k, m.error);
        if self.is_unsettled() {
            return Some(format!(
                "multiplication factor {k} cannot be told from 1: there may be no image, and if there is one it takes \
                 more than {:.0} reflections to come within 1 % of it; --max-reflections N truncates the series",
                reflections_to_a_percent(1.0 - BEYOND_ERROR * m.error)
            ));
        }
        Some(format!(
            "multiplication factor {k} is close to 1: each watt is reflected {:.0} times in all, and it takes {:.0} \
             reflections to come within 1 % of the image",
            1.0 / (1.0 - m.k),
            reflections_to_a_percent(m.k)
        ))
    }
}

/// n with kⁿ = 1 %.
fn reflections_to_a_percent(k: f64) -> f64 {
    (0.01_f64.ln() / k.ln()).ceil()
}

fn is_glass(material: &Material) -> bool {
    material.lobes.iter().any(|(_, lobe)| matches!(lobe, Lobe::Dielectric(_) | Lobe::ThinDielectric(_)))
}

/// What a material's lobes keep, and on which sides.
fn kept(material: &Material, channel: usize) -> String {
    let lobes: Vec<String> = material
        .lobes
        .iter()
        .map(|(_, lobe)| {
            let sides = |two_sided: bool| if two_sided { "two-sided" } else { "one-sided" };
            match lobe {
                Lobe::Diffuse(lobe) => {
                    format!("albedo {:.2}, {}", lobe.albedo[channel], sides(lobe.two_sided))
                }
                Lobe::Mirror(lobe) => {
                    format!("mirror {:.2}, {}", lobe.average()[channel], sides(lobe.two_sided))
                }
                Lobe::Dielectric(_) | Lobe::ThinDielectric(_) => "glass".into(),
                Lobe::RoughDielectric(_) | Lobe::RoughThin(_) => "rough glass".into(),
                Lobe::Sheen(lobe) => {
                    format!("sheen {:.2}, {}", lobe.colour[channel], sides(lobe.two_sided))
                }
                Lobe::Translucent(lobe) => format!("translucent {:.2}", lobe.colour[channel]),
                Lobe::Glossy(lobe) => {
                    format!("glossy {:.2}, {}", lobe.average()[channel], sides(lobe.two_sided))
                }
            }
        })
        .collect();
    lobes.join(", ")
}

/// What to lower, for materials of the illumination square and for others.
fn advice(named: &[(&Material, f64)], k: f64, chain: Chain) -> Vec<String> {
    let s_of = |material: &Material| {
        let [[ii, iv], [vi, vv]] = material.bsdf.terms.first()?.coefficient.rows();
        (iv == 0.0 && vv == 0.0 && vi > 0.0).then(|| f64::from(ii / vi))
    };
    let s: Vec<Option<f64>> = named.iter().map(|(material, _)| s_of(material)).collect();
    let or_t = if chain.passes { ", or t" } else { "" };
    match s.first() {
        Some(Some(first)) if s.iter().all(|s| *s == Some(*first)) => {
            // k is proportional to s; rounded down, so that it is enough.
            vec![format!("Lower s to below {:.2}{or_t}, or the albedo", (100.0 * first / k).floor() / 100.0)]
        }
        _ => {
            let straight = if chain.passes { "the straight matrices, " } else { "" };
            vec![format!(
                "Lower {straight}the opaque matrices to {:.2} of what they are, or the albedo",
                (100.0 / k).floor() / 100.0
            )]
        }
    }
}

/// As many digits as the error gives sense to: 1.28 ± 0.01.
pub fn with_error(value: f64, error: f64) -> String {
    let digits = if error > 0.0 { (-error.log10()).ceil().clamp(2.0, 8.0) as usize } else { 6 };
    format!("{value:.digits$} ± {error:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::with_error;

    #[test]
    fn digits_follow_the_error() {
        assert_eq!(with_error(1.2834, 0.011), "1.28 ± 0.01");
        assert_eq!(with_error(0.98762, 0.0004), "0.9876 ± 0.0004");
        assert_eq!(with_error(1.0, 0.0), "1.000000 ± 0.000000");
    }
}
