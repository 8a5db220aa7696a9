//! EXT_lights_ies: lamps without extent that shine as a laboratory measured them.

use super::Reason;
use super::accessor::Accessors;
use super::extras::{Extras, Place, numbers};
use super::files::load_uri;
use super::graph::Placed;
use super::notes::{Notes, label};
use crate::scene::assembly::Assembly;
use crate::scene::{Luminaire, Profile};
use glam::Vec3;
use gltf::json::Root;
use gltf::json::scene::Node;
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;

pub(super) const NAME: &str = "EXT_lights_ies";

/// Bytes of a profile: a million numbers.
const MOST_BYTES: u64 = 1 << 24;

/// Bytes that all profiles of a file may have, as they are written and as tables: some seconds of work.
const MOST_HELD: usize = 1 << 28;

/// What the extension says of a node.
pub(super) fn of_node(node: &Node) -> Option<&Value> {
    node.extensions.as_ref()?.others.get(NAME)
}

/// Adds the lamps of the scene to what shines. Returns how they do.
pub(super) fn add(
    accessors: &Accessors<'_>,
    placed: &[Placed<'_>],
    folder: &Path,
    assembly: &mut Assembly,
    notes: &mut Notes,
) -> Result<Vec<Profile>, Reason> {
    let mut profiles = Vec::new();
    let mut known = Known { accessors, folder, read: HashMap::new(), held: 0 };
    for place in placed {
        let Some(lamp) = of_node(place.node) else { continue };
        let extras = Extras::new(&place.node.extras, place.label(), Place::Light, notes);
        let emission = extras.emission()?.unwrap_or_default();
        let profile = known.profile(place, lamp)?;
        let named = |what: String| format!("{}: {what}", place.label());
        let tint = profile.mean_intensity() * tint(lamp).map_err(named)?.as_dvec3();
        let position = (place.position() - assembly.origin).as_vec3();
        let intensity = emission.of(tint.as_vec3());
        let index = profiles.len() as u32;
        let luminaire = Luminaire::Profile { position, intensity, profile: index };
        let power = luminaire.power(1.0);
        if !power.total().is_finite() || !position.is_finite() {
            return Err(named("its power or place is not finite; correct it".into()));
        }
        if power.is_zero() {
            notes.about("lights without power were left out", &place.name());
            continue;
        }
        profiles.push(profile.turned(place.upright()?.as_mat3()));
        assembly.luminaires.push(luminaire);
    }
    Ok(profiles)
}

/// The files that a document names for them.
pub(super) fn uris(root: &Root) -> impl Iterator<Item = &str> {
    all(root).iter().filter_map(|profile| profile["uri"].as_str())
}

fn all(root: &Root) -> &[Value] {
    let of_root = || root.extensions.as_ref()?.others.get(NAME)?["lights"].as_array();
    of_root().map_or(&[], Vec::as_slice)
}

/// Color times multiplier, which scale the intensity of the profile.
fn tint(lamp: &Value) -> Result<Vec3, Reason> {
    let color = lamp.get("color").map_or(Some([1.0; 3]), numbers);
    let color = color.filter(|color| color.iter().all(|share| (0.0..=1.0).contains(share)));
    let color = color.ok_or_else(|| wrong(lamp, "color", "three numbers from 0 to 1"))?;
    let multiplier = lamp.get("multiplier").map_or(Some(1.0), Value::as_f64).map(|factor| factor as f32);
    let multiplier = multiplier.filter(|factor| *factor >= 0.0 && factor.is_finite());
    let multiplier = multiplier.ok_or_else(|| wrong(lamp, "multiplier", "a number, 0 or more"))?;
    Ok(multiplier * Vec3::from_array(color))
}

fn wrong(lamp: &Value, key: &str, allowed: &str) -> Reason {
    let shown: String = lamp[key].to_string().chars().take(60).collect();
    format!("the {key} of its {NAME} is {shown}; it is {allowed}")
}

/// Profiles of a file, each read once.
struct Known<'a> {
    accessors: &'a Accessors<'a>,
    folder: &'a Path,
    read: HashMap<usize, Profile>,
    /// Bytes that they have.
    held: usize,
}

impl Known<'_> {
    /// What a node refers to.
    fn profile(&mut self, place: &Placed<'_>, lamp: &Value) -> Result<Profile, Reason> {
        let index = lamp["light"].as_u64().and_then(|index| usize::try_from(index).ok());
        let source = index.and_then(|index| Some((index, all(self.accessors.root).get(index)?)));
        let Some((index, source)) = source else {
            return Err(format!("{}: its light profile does not exist; export it again", place.label()));
        };
        if let Some(profile) = self.read.get(&index) {
            return Ok(profile.clone());
        }
        let name = label("light profile", index, source["name"].as_str());
        let (profile, bytes) = self.parse(source).map_err(|what| format!("{name}: {what}"))?;
        self.held += bytes + profile.bytes();
        if self.held > MOST_HELD {
            return Err(format!(
                "{name}: profiles take more than {} MB together; leave some out",
                MOST_HELD >> 20
            ));
        }
        self.read.insert(index, profile.clone());
        Ok(profile)
    }

    /// A profile, and how many bytes it is written in.
    fn parse(&self, source: &Value) -> Result<(Profile, usize), Reason> {
        let sized = |bytes: &[u8]| Profile::parse(bytes).map(|profile| (profile, bytes.len()));
        if let Some(uri) = source["uri"].as_str() {
            return sized(&load_uri(uri, self.folder, MOST_BYTES)?);
        }
        let view = source["bufferView"].as_u64().and_then(|view| usize::try_from(view).ok());
        let view = view.ok_or("has neither a uri nor a buffer view; export it again")?;
        sized(self.accessors.view(view)?)
    }
}
