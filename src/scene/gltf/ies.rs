//! Lamps without extent that shine as a laboratory measured them: EXT_lights_ies, and the files that extras `ies` name.

use super::Reason;
use super::accessor::Accessors;
use super::extras::{Extras, IES, Place, numbers};
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

/// Bytes that all profiles of a file may have, as they are written and as tables: some seconds of work.
const MOST_HELD: usize = 1 << 28;

/// What the extension says of a node.
pub(super) fn of_node(node: &Node) -> Option<&Value> {
    node.extensions.as_ref()?.others.get(NAME)
}

/// Adds the lamps that the extension hangs in the scene to what shines.
pub(super) fn add(
    profiles: &mut Profiles<'_>,
    placed: &[Placed<'_>],
    assembly: &mut Assembly,
    notes: &mut Notes,
) -> Result<(), Reason> {
    for place in placed {
        let Some(lamp) = of_node(place.node) else { continue };
        let extras = Extras::new(&place.node.extras, place.label(), Place::Light, notes);
        if extras.has(IES) {
            return Err(extras.wrong(&format!("`{IES}` and {NAME} both say how it shines; leave one out")));
        }
        let emission = extras.emission()?.unwrap_or_default();
        let profile = profiles.of_lamp(place, lamp)?;
        let named = |what: String| format!("{}: {what}", place.label());
        let tint = profile.mean_intensity() * tint(lamp).map_err(named)?.as_dvec3();
        let position = (place.position() - assembly.origin).as_vec3();
        let intensity = emission.of(tint.as_vec3());
        let luminaire = Luminaire::Profile { position, intensity, profile: profiles.next() };
        let power = luminaire.power(1.0);
        if !power.total().is_finite() || !position.is_finite() {
            return Err(named("its power or place is not finite; correct it".into()));
        }
        if power.is_zero() {
            notes.about("lights without power were left out", &place.name());
            continue;
        }
        profiles.hang(&profile, place)?;
        assembly.luminaires.push(luminaire);
    }
    Ok(())
}

/// The files that a document names for them.
pub(super) fn uris(root: &Root) -> impl Iterator<Item = String> {
    let listed = all(root).iter().filter_map(|profile| profile["uri"].as_str().map(str::to_owned));
    let lights = root.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
    let of_lights = lights.into_iter().flat_map(|lights| &lights.lights).map(|light| &light.extras);
    let is_lamp = |node: &&Node| {
        node.extensions.as_ref().is_some_and(|extensions| extensions.khr_lights_punctual.is_some())
    };
    let of_nodes = root.nodes.iter().filter(is_lamp).map(|node| &node.extras);
    let named =
        |extras| Extras::new(extras, String::new(), Place::Light, &mut Notes::default()).ies().ok().flatten();
    listed.chain(of_lights.chain(of_nodes).filter_map(named))
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

/// The profiles of a file, each read once, and how they hang in the scene.
pub(super) struct Profiles<'a> {
    accessors: &'a Accessors<'a>,
    folder: &'a Path,
    read: HashMap<Source, Profile>,
    /// Bytes that they have.
    held: usize,
    hung: Vec<Profile>,
}

/// Where a profile is.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Source {
    /// Among those of the extension.
    Listed(usize),
    /// In a file of this name.
    Named(String),
}

impl<'a> Profiles<'a> {
    /// None is read yet.
    pub fn new(accessors: &'a Accessors<'a>, folder: &'a Path) -> Self {
        Self { accessors, folder, read: HashMap::new(), held: 0, hung: Vec::new() }
    }

    /// The index of the one that is hung next.
    pub fn next(&self) -> u32 {
        self.hung.len() as u32
    }

    /// Hangs one as a node stands.
    pub fn hang(&mut self, profile: &Profile, place: &Placed<'_>) -> Result<(), Reason> {
        self.hung.push(profile.turned(place.upright()?.as_mat3()));
        Ok(())
    }

    /// Those that hang in the scene.
    pub fn finish(self) -> Vec<Profile> {
        self.hung
    }

    /// That of a file beside the scene; `label` is whose extras name it.
    pub fn named(&mut self, uri: &str, label: &str) -> Result<Profile, Reason> {
        let source = Source::Named(uri.to_owned());
        let shown: String = uri.chars().take(60).collect();
        self.known(source, || format!("{label}: extras `{IES}` names `{shown}`"), |this| this.load(uri))
    }

    /// What a node refers to.
    fn of_lamp(&mut self, place: &Placed<'_>, lamp: &Value) -> Result<Profile, Reason> {
        let index = lamp["light"].as_u64().and_then(|index| usize::try_from(index).ok());
        let source = index.and_then(|index| Some((index, all(self.accessors.root).get(index)?)));
        let Some((index, source)) = source else {
            return Err(format!("{}: its light profile does not exist; export it again", place.label()));
        };
        let name = || label("light profile", index, source["name"].as_str());
        self.known(Source::Listed(index), name, |this| this.parse(source))
    }

    /// A profile that `parse` reads, with how many bytes it is written in, where it is not known yet.
    fn known(
        &mut self,
        source: Source,
        name: impl Fn() -> String,
        parse: impl FnOnce(&Self) -> Result<(Profile, usize), Reason>,
    ) -> Result<Profile, Reason> {
        if let Some(profile) = self.read.get(&source) {
            return Ok(profile.clone());
        }
        let (profile, bytes) = parse(self).map_err(|what| format!("{}: {what}", name()))?;
        self.held += bytes + profile.bytes();
        if self.held > MOST_HELD {
            return Err(format!(
                "{}: profiles take more than {} MB together; leave some out",
                name(),
                MOST_HELD >> 20
            ));
        }
        self.read.insert(source, profile.clone());
        Ok(profile)
    }

    fn parse(&self, source: &Value) -> Result<(Profile, usize), Reason> {
        if let Some(uri) = source["uri"].as_str() {
            return self.load(uri);
        }
        let view = source["bufferView"].as_u64().and_then(|view| usize::try_from(view).ok());
        let view = view.ok_or("has neither a uri nor a buffer view; export it again")?;
        sized(self.accessors.view(view)?)
    }

    fn load(&self, uri: &str) -> Result<(Profile, usize), Reason> {
        sized(&load_uri(uri, self.folder, Profile::MOST_BYTES)?)
    }
}

fn sized(bytes: &[u8]) -> Result<(Profile, usize), Reason> {
    Profile::parse(bytes).map(|profile| (profile, bytes.len()))
}
