//! What a state says of itself before its sums: one line of JSON.

use super::super::{Exposure, Header, Layer, PassSet, Preview, Run, Value};
use serde_json::{Map, Value as Json, json};
use std::collections::BTreeMap;

/// What two states must agree on to be of one picture, by name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Key(pub BTreeMap<String, String>);

impl Key {
    /// The first thing in which another one differs, in words.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let names: std::collections::BTreeSet<_> = self.0.keys().chain(other.0.keys()).collect();
        names.into_iter().find_map(|name| {
            let (here, there) = (self.0.get(name), other.0.get(name));
            let word = |value: Option<&String>| value.map_or_else(|| "unknown".to_owned(), String::clone);
            (here != there).then(|| format!("{name}: {} there, {} here", word(there), word(here)))
        })
    }
}

/// What stands in a state behind the rows of its film: a block of facts, then one for each row of the picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Annex {
    /// What it is.
    pub name: String,
    /// Bytes of the facts.
    pub facts: u32,
    /// Bytes of each row.
    pub row: u32,
}

impl Annex {
    /// Why states that hold one are not added to others.
    pub(super) fn does_not_add_up(&self) -> String {
        format!(
            "the sums of an {} depend on the order of its passes, so that states of it do not add up",
            self.name
        )
    }
}

/// Everything about a state but its sums.
#[derive(Clone, Debug, PartialEq)]
pub struct StateHead {
    /// Scene, settings and estimators.
    pub key: Key,
    /// Photon paths of a pass, or camera samples of a pixel where paths are traced.
    pub pass_size: u32,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// As in the picture's file.
    pub layers: Vec<Layer>,
    /// Which passes the sums are of.
    pub passes: PassSet,
    /// Photons stored over all of them.
    pub photons: u64,
    /// What they took, in nanoseconds.
    pub nanoseconds: u64,
    /// Facts for the picture's file.
    pub facts: Header,
    /// How the picture is shown.
    pub preview: Preview,
    /// Sums that are not the film's.
    pub annex: Option<Annex>,
}

impl StateHead {
    /// Adds what another state of the same picture says of its passes, which are others.
    ///
    /// # Errors
    /// In words: what it differs in, or which pass is in both.
    pub fn join(&mut self, other: &Self) -> Result<(), String> {
        if let Some(difference) = self.difference(other) {
            return Err(difference);
        }
        if let Some(annex) = self.annex.as_ref().or(other.annex.as_ref()) {
            return Err(annex.does_not_add_up());
        }
        self.passes.join(&other.passes).map_err(|pass| format!("pass {pass} is in both"))?;
        self.photons = self.photons.saturating_add(other.photons);
        self.nanoseconds = self.nanoseconds.saturating_add(other.nanoseconds);
        Ok(())
    }

    /// In what another state is of another picture.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let sized = |head: &Self| {
            let layers: Vec<_> = head.layers.iter().map(|layer| layer.name()).collect();
            let mut key = head.key.clone();
            key.0.insert("pass size".into(), head.pass_size.to_string());
            key.0.insert("pixels".into(), format!("{}x{}", head.width, head.height));
            key.0.insert("layers".into(), layers.join(","));
            key
        };
        sized(self).difference(&sized(other))
    }

    /// The facts, with those that follow from its passes.
    pub fn header(&self) -> Header {
        let mut header = self.facts.clone();
        header.set("passes", self.passes.len());
        header.set("photons", self.photons.to_string());
        header.set("seconds", 1e-9 * self.nanoseconds as f64);
        header
    }

    pub(super) fn to_json(&self) -> Json {
        let layers: Vec<_> = self.layers.iter().map(|layer| layer.name()).collect();
        let runs: Vec<_> =
            self.passes.runs().iter().map(|Run { first, step, count }| json!([first, step, count])).collect();
        let facts: Vec<_> = self.facts.entries.iter().filter_map(fact).collect();
        let exposure = match self.preview.exposure {
            Exposure::Auto => json!("auto"),
            Exposure::Stops(stops) => json!(stops),
        };
        let mut json = json!({
            "program": concat!("halflight ", env!("CARGO_PKG_VERSION")),
            "key": self.key.0,
            "pass_size": self.pass_size,
            "size": [self.width, self.height],
            "layers": layers,
            "passes": runs,
            "photons": self.photons,
            "nanoseconds": self.nanoseconds,
            "facts": facts,
            "preview": {"exposure": exposure, "view": self.preview.view.name()},
        });
        if let Some(Annex { name, facts, row }) = &self.annex {
            json["annex"] = json!({"name": name, "facts": facts, "row": row});
        }
        json
    }

    /// None: something is missing or is not what it should be; what, in words.
    pub(super) fn of_json(json: &Json) -> Result<Self, String> {
        let all = json.as_object().ok_or("its head is no object")?;
        let key = all.get("key").and_then(Json::as_object).and_then(words).ok_or("its key is damaged")?;
        let [width, height] = list::<2>(all.get("size")).ok_or("its size is damaged")?;
        if width == 0 || height == 0 || width > 65_536 || height > 65_536 {
            return Err(format!("a picture of {width}x{height} pixels"));
        }
        let layers = all.get("layers").and_then(Json::as_array).and_then(|all| layers(all));
        let runs = all.get("passes").and_then(Json::as_array).ok_or("its passes are damaged")?;
        let runs: Option<Vec<_>> = runs.iter().map(|run| list::<3>(Some(run)).map(run_of)).collect();
        let count =
            |name: &str| all.get(name).and_then(Json::as_u64).ok_or(format!("its {name} are damaged"));
        let facts = all.get("facts").and_then(Json::as_array).ok_or("its facts are damaged")?;
        Ok(Self {
            key: Key(key),
            pass_size: u32::try_from(count("pass_size")?).map_err(|_| "its pass_size is damaged")?,
            width,
            height,
            layers: layers.ok_or("its layers are damaged")?,
            passes: runs.and_then(|runs| PassSet::of_runs(&runs)).ok_or("its passes are damaged")?,
            photons: count("photons")?,
            nanoseconds: count("nanoseconds")?,
            facts: Header { entries: facts.iter().filter_map(entry).collect() },
            preview: all.get("preview").and_then(preview).ok_or("its preview is damaged")?,
            annex: all.get("annex").map(|json| annex(json).ok_or("its annex is damaged")).transpose()?,
        })
    }
}

fn words(all: &Map<String, Json>) -> Option<BTreeMap<String, String>> {
    all.iter().map(|(name, value)| Some((name.clone(), value.as_str()?.to_owned()))).collect()
}

fn list<const N: usize>(json: Option<&Json>) -> Option<[u32; N]> {
    let numbers = json?.as_array()?.iter().map(|x| u32::try_from(x.as_u64()?).ok());
    numbers.collect::<Option<Vec<_>>>()?.try_into().ok()
}

fn run_of([first, step, count]: [u32; 3]) -> Run {
    Run { first, step, count }
}

/// None: one is unknown, or there twice.
fn layers(all: &[Json]) -> Option<Vec<Layer>> {
    let layers: Vec<Layer> = all.iter().map(|name| name.as_str()?.parse().ok()).collect::<Option<_>>()?;
    let first = layers.first() == Some(&Layer::Visible);
    (first && (1..layers.len()).all(|i| !layers[..i].contains(&layers[i]))).then_some(layers)
}

fn preview(json: &Json) -> Option<Preview> {
    let exposure = match json.get("exposure")? {
        Json::String(auto) if auto == "auto" => Exposure::Auto,
        stops => Exposure::Stops(stops.as_f64().filter(|stops| stops.abs() < 1e4)? as f32),
    };
    Some(Preview { exposure, view: json.get("view")?.as_str()?.parse().ok()? })
}

/// The most bytes of the facts of an annex.
const MOST_FACTS: u32 = 1 << 16;

fn annex(json: &Json) -> Option<Annex> {
    let bytes = |name: &str| u32::try_from(json.get(name)?.as_u64()?).ok().filter(|bytes| *bytes > 0);
    let name = json.get("name")?.as_str().filter(|name| is_word(name))?;
    let facts = bytes("facts").filter(|facts| *facts <= MOST_FACTS)?;
    Some(Annex { name: name.to_owned(), facts, row: bytes("row")? })
}

/// None: a measure that is no number.
fn fact((name, value): &(String, Value)) -> Option<Json> {
    Some(match value {
        Value::Text(text) => json!([name, text]),
        Value::Integer(i) => json!([name, i]),
        Value::Real(x) if x.is_finite() => json!([name, x]),
        Value::Real(_) => return None,
    })
}

fn entry(json: &Json) -> Option<(String, Value)> {
    let [name, value] = json.as_array()?.as_slice() else { return None };
    let value = match value {
        Json::String(text) => Value::Text(text.clone()),
        Json::Number(x) => {
            x.as_i64().map_or_else(|| x.as_f64().map(Value::Real), |i| Some(Value::Integer(i)))?
        }
        _ => return None,
    };
    // What names of attributes may be made of in a picture's file.
    let name = name.as_str().filter(|name| is_word(name))?;
    Some((name.to_owned(), value))
}

fn is_word(name: &str) -> bool {
    name.len() < 64 && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}
