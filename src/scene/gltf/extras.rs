//! Our own facts in `extras`. A wrong value under a key of ours is an error; other keys are passed over.

use super::Reason;
use super::notes::Notes;
use crate::light::{Light, Matrix};
use crate::scene::environment::Source;
use crate::scene::illumination::{matrix_from, square_from};
use crate::scene::{Background, Backs, Fluorescence, Illumination, Lens, Projection, Surroundings};
use glam::Vec3;
use serde_json::{Map, Value};

/// Where extras may sit, with the keys that are read there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Scene,
    Material,
    Light,
    /// A node that only stands somewhere.
    Empty,
    Camera,
    /// Another node, or a mesh.
    Elsewhere,
}

const ILLUMINATION: &str = "illumination";
const OPAQUE: &str = "opaque";
const STRAIGHT: &str = "straight";
const FLUORESCENCE: &str = "fluorescence";
pub(super) const EMISSION: &str = "emission";
const THIN: &str = "thin";
const WARN: &str = "warn";
const ANGLE: &str = "angle";
pub(super) const BACKS: &str = "backs";
const FSTOP: &str = "fstop";
const APERTURE: &str = "aperture";
const FOCUS: &str = "focus";
const ENVIRONMENT: &str = "environment";
const ROTATION: &str = "environment-rotation";
const STRENGTH: &str = "environment-strength";
const BACKGROUND: &str = "background";
pub(super) const AREA: &str = "area";
pub(super) const DISK: &str = "disk";
pub(super) const SPHERE: &str = "sphere";
pub(super) const IES: &str = "ies";
pub(super) const WATTS: &str = "power";
pub(super) const RADIANCE: &str = "radiance";
/// Every key of ours with where it is read.
const KEYS: &[(&str, &[Place], &str)] = &[
    (ILLUMINATION, &[Place::Scene, Place::Material], "materials and scenes"),
    (OPAQUE, &[Place::Material], "materials"),
    (STRAIGHT, &[Place::Material], "materials"),
    (FLUORESCENCE, &[Place::Material], "materials"),
    (EMISSION, &[Place::Material, Place::Light, Place::Empty], "materials and lights"),
    (THIN, &[Place::Material], "materials"),
    (WARN, &[Place::Light], "lights"),
    (ANGLE, &[Place::Light], "directional lights"),
    (BACKS, &[Place::Material, Place::Light, Place::Empty], "materials and lights"),
    (FSTOP, &[Place::Camera], "cameras (not their objects)"),
    (APERTURE, &[Place::Camera], "cameras (not their objects)"),
    (FOCUS, &[Place::Camera], "cameras (not their objects)"),
    (ENVIRONMENT, &[Place::Scene], "scenes"),
    (ROTATION, &[Place::Scene], "scenes"),
    (STRENGTH, &[Place::Scene], "scenes"),
    (BACKGROUND, &[Place::Scene], "scenes"),
    (AREA, LAMPS, "lights and empty nodes"),
    (DISK, LAMPS, "lights and empty nodes"),
    (SPHERE, LAMPS, "lights and empty nodes"),
    (IES, &[Place::Light], "point and spot lights"),
    (WATTS, &[Place::Empty], "empty nodes"),
    (RADIANCE, &[Place::Empty], "empty nodes"),
];

/// What may have an extent.
const LAMPS: &[Place] = &[Place::Light, Place::Empty];

/// The height of the sensor that an f-number is meant for, m: that of a film of 36 × 24 mm.
const SENSOR: f32 = 0.024;

/// The least angle of a sun's disk, degrees: below it single precision tells too few directions apart, and no shadow is softer
/// than that of parallel light.
const LEAST_ANGLE: f32 = 0.002;

/// The extras of one thing.
pub(super) struct Extras {
    owner: String,
    values: Map<String, Value>,
}

impl Extras {
    /// Parses them, and notes keys that look like ours but are not read.
    pub fn new(extras: &gltf::json::Extras, owner: String, place: Place, notes: &mut Notes) -> Self {
        let values = extras.as_ref().and_then(|raw| serde_json::from_str(raw.get()).ok()).unwrap_or_default();
        for key in Map::keys(&values) {
            match KEYS.iter().find(|(own, ..)| own == key) {
                Some((_, places, _)) if places.contains(&place) => {}
                Some((_, _, where_read)) => notes
                    .line(format!("{owner}: extras `{key}` has no effect here; it is read on {where_read}")),
                None => {
                    if let Some((own, ..)) = KEYS.iter().find(|(own, ..)| is_misspelt(key, own)) {
                        notes.line(format!("{owner}: extras `{key}` is passed over; did you mean `{own}`?"));
                    }
                }
            }
        }
        Self { owner, values }
    }

    /// True when it is there.
    pub fn has(&self, key: &str) -> bool {
        self.values.contains_key(key)
    }

    /// What is wrong with them, for messages.
    pub fn wrong(&self, what: &str) -> Reason {
        format!("{}: extras {what}", self.owner)
    }

    /// `illumination`: a word or `[s, t]`.
    pub fn illumination(&self) -> Result<Option<Illumination>, Reason> {
        self.read(ILLUMINATION, &format!("{} as [s, t]", Illumination::WORDS), |value| match value {
            Value::String(word) => word.parse().ok(),
            _ => numbers(value).and_then(|[s, t]| square_from(s, t).ok()),
        })
    }

    /// `opaque`: the matrix of the lobes.
    pub fn opaque(&self) -> Result<Option<Matrix>, Reason> {
        self.matrix(OPAQUE)
    }

    /// `straight`: the matrix of the straight term.
    pub fn straight(&self) -> Result<Option<Matrix>, Reason> {
        self.matrix(STRAIGHT)
    }

    fn matrix(&self, key: &str) -> Result<Option<Matrix>, Reason> {
        let allowed = "four numbers ≥ 0, row by row: [inv←inv, inv←vis, vis←inv, vis←vis]";
        self.read(key, allowed, |value| numbers(value).and_then(|m| matrix_from(m).ok()))
    }

    /// `fluorescence`: a matrix of colours, a dye, or the matrix of paper eq. 17.
    pub fn fluorescence(&self) -> Result<Option<Fluorescence>, Reason> {
        let allowed = "three rows (outgoing red, green, blue) of three numbers ≥ 0, {\"absorbs\": [r, g, b], \"emits\": [r, g, b], \
                       \"yield\": y}, or {\"matrix\": …} with 3×3 or 6×6 numbers; \"gain\": true beside these";
        self.read(FLUORESCENCE, allowed, fluorescence)
    }

    /// `emission`: what the two halves are multiplied by.
    pub fn emission(&self) -> Result<Option<EmissionScale>, Reason> {
        let allowed = "\"both\", \"invisible\" or two factors [invisible, visible] ≥ 0";
        self.read(EMISSION, allowed, |value| match value.as_str() {
            Some("both") => Some(EmissionScale::default()),
            Some("invisible") => Some(EmissionScale { invisible: 1.0, visible: 0.0 }),
            _ => {
                let [invisible, visible] = numbers(value)?;
                (invisible >= 0.0 && visible >= 0.0).then_some(EmissionScale { invisible, visible })
            }
        })
    }

    /// `thin`: a pane instead of a solid. Blender wrote booleans as 0 and 1 once.
    pub fn thin(&self) -> Result<Option<bool>, Reason> {
        self.read(THIN, "true or false", |value| match value.as_u64() {
            Some(number @ (0 | 1)) => Some(number == 1),
            _ => value.as_bool(),
        })
    }

    /// `backs`: what one-sided surfaces are from behind.
    pub fn backs(&self) -> Result<Option<Backs>, Reason> {
        self.read(BACKS, "\"seen\" or \"unseen\"", |value| match value.as_str()? {
            "seen" => Some(Backs::Seen),
            "unseen" => Some(Backs::Unseen),
            _ => None,
        })
    }

    /// `fstop` or `aperture`, and `focus`: the lens of a camera.
    pub fn lens(&self, projection: Projection) -> Result<Option<Lens>, Reason> {
        let above = |x: &f32| *x > 0.0;
        let fstop = self.number(FSTOP, "a number above 0, such as 2.8", above)?;
        let radius = self.number(APERTURE, "half the diameter of the lens, m, from 0 up", |x| *x >= 0.0)?;
        let focus = self.number(FOCUS, "the distance of what is sharp, m, above 0", above)?;
        let wrong = |what: &str| Err(self.wrong(what));
        let key = match (fstop, radius) {
            (None, None) if focus.is_none() => return Ok(None),
            (None, None) => {
                return wrong("`focus` without `fstop` or `aperture`; add one of them, or leave it out");
            }
            (Some(_), Some(_)) => {
                return wrong("`fstop` and `aperture` both say how wide the lens is; leave one out");
            }
            (Some(_), None) => FSTOP,
            (None, Some(_)) => APERTURE,
        };
        let Projection::Perspective { yfov } = projection else {
            return wrong(&format!("`{key}`: an orthographic camera has no lens; leave it out"));
        };
        let Some(focus) = focus else {
            return wrong(&format!("`{key}` needs `focus`, the distance of what is sharp, m; add it"));
        };
        let focal_length = 0.5 * SENSOR / (0.5 * yfov).tan();
        let radius = fstop.map(|fstop| 0.5 * focal_length / fstop).or(radius).unwrap_or(0.0);
        Ok((radius > 0.0).then_some(Lens { radius, focus }))
    }

    /// `environment`, `environment-rotation`, `environment-strength` and `background`: what is around a scene.
    pub fn surroundings(&self) -> Result<Surroundings, Reason> {
        let word = |value: &Value| value.as_str()?.parse().ok();
        let background = |value: &Value| match value.as_bool() {
            Some(true) => Some(Background::Same),
            Some(false) => Some(Background::Black),
            None => value.as_str()?.parse().ok(),
        };
        Ok(Surroundings {
            source: self.read(ENVIRONMENT, &format!("none, {}", Source::WORDS), word)?,
            rotation: self.number(ROTATION, "degrees", |_| true)?,
            strength: self.number(STRENGTH, "a factor, 0 or more", |x| *x >= 0.0)?,
            background: self.read(BACKGROUND, "true, false, or a colour such as \"#404040\"", background)?,
        })
    }

    /// A finite number that fits.
    pub fn number(
        &self,
        key: &str,
        allowed: &str,
        fits: impl Fn(&f32) -> bool,
    ) -> Result<Option<f32>, Reason> {
        self.read(key, allowed, |value| Some(value.as_f64()? as f32).filter(|x| x.is_finite() && fits(x)))
    }

    /// `warn`: exponent and attenuation of eq. 24.
    pub fn warn(&self) -> Result<Option<[f32; 4]>, Reason> {
        self.read(WARN, "four numbers ≥ 0, [e, a0, a1, a2], with an a above 0", |value| {
            let numbers: [f32; 4] = numbers(value)?;
            let fine = numbers.iter().all(|x| *x >= 0.0) && numbers[1..].iter().any(|a| *a > 0.0);
            fine.then_some(numbers)
        })
    }

    /// `angle`: that of the whole disk of a sun, in degrees. None, or 0: its light is parallel.
    pub fn angle(&self) -> Result<Option<f32>, Reason> {
        let allowed = "the angle of the sun's disk in degrees: 0 for parallel light, or 0.002 to 180";
        self.number(ANGLE, allowed, |x| *x == 0.0 || (LEAST_ANGLE..=180.0).contains(x))
    }

    /// `ies`: the file of a measured lamp.
    pub fn ies(&self) -> Result<Option<String>, Reason> {
        let allowed = "the name of an IES file in the folder of the scene, such as \"lamp.ies\"";
        self.read(IES, allowed, |value| value.as_str().filter(|name| !name.is_empty()).map(str::to_owned))
    }

    /// What is under a key, parsed. None: nothing is there.
    pub fn read<T>(
        &self,
        key: &str,
        allowed: &str,
        parse: impl Fn(&Value) -> Option<T>,
    ) -> Result<Option<T>, Reason> {
        let Some(value) = self.values.get(key) else { return Ok(None) };
        match parse(value) {
            Some(parsed) => Ok(Some(parsed)),
            None => {
                let shown: String = value.to_string().chars().take(60).collect();
                Err(format!("{}: extras `{key}` is {shown}; write {allowed}", self.owner))
            }
        }
    }
}

fn fluorescence(value: &Value) -> Option<Fluorescence> {
    let Value::Object(object) = value else { return rows(value).map(Fluorescence::colours) };
    let known = ["absorbs", "emits", "yield", "matrix", "gain"];
    if object.keys().any(|key| !known.contains(&key.as_str())) {
        return None;
    }
    let gain = object.get("gain").map_or(Some(false), Value::as_bool)?;
    let found = match (object.get("matrix"), object.get("absorbs"), object.get("emits")) {
        (Some(matrix), None, None) if !object.contains_key("yield") => {
            rows(matrix).map(Fluorescence::colours).or_else(|| rows(matrix).map(Fluorescence::full))?
        }
        (None, Some(absorbs), Some(emits)) => {
            let (absorbs, emits): ([f32; 3], [f32; 3]) = (numbers(absorbs)?, numbers(emits)?);
            let efficiency = object.get("yield").map_or(Some(1.0), Value::as_f64)? as f32;
            let amounts = absorbs.iter().chain(&emits).chain([&efficiency]).all(|x| *x >= 0.0);
            let fine = amounts && absorbs.iter().all(|share| *share <= 1.0) && emits.iter().any(|e| *e > 0.0);
            fine.then(|| Fluorescence::dye(absorbs, emits, efficiency))?
        }
        _ => return None,
    };
    Some(if gain { found.with_gain() } else { found })
}

/// A square matrix, row by row.
fn rows<const N: usize>(value: &Value) -> Option<[[f32; N]; N]> {
    let rows: Option<Vec<[f32; N]>> = value.as_array()?.iter().map(numbers).collect();
    rows?.try_into().ok()
}

/// Factors on the two halves of what shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EmissionScale {
    invisible: f32,
    visible: f32,
}

impl Default for EmissionScale {
    fn default() -> Self {
        Self { invisible: 1.0, visible: 1.0 }
    }
}

impl EmissionScale {
    /// Seen, and lights nothing.
    pub const SEEN: Self = Self { invisible: 0.0, visible: 1.0 };

    /// Of the invisible half, and of the visible one.
    pub fn halves(self) -> [f32; 2] {
        [self.invisible, self.visible]
    }

    /// The two halves of `rgb`.
    pub fn of(self, rgb: Vec3) -> Light {
        Light::new(self.invisible * rgb, self.visible * rgb)
    }
}

/// As many finite numbers as asked for.
pub(super) fn numbers<const N: usize>(value: &Value) -> Option<[f32; N]> {
    let number = |x: &Value| x.as_f64().map(|x| x as f32).filter(|x| x.is_finite());
    let numbers: Option<Vec<f32>> = value.as_array()?.iter().map(number).collect();
    numbers?.try_into().ok()
}

/// True for a key that differs from ours by case, or by one or two letters where it is long enough to tell.
fn is_misspelt(key: &str, own: &str) -> bool {
    let key = key.to_lowercase();
    let most = match own.len() {
        ..4 => 0,
        4 | 5 => 1,
        _ => 2,
    };
    key.len().abs_diff(own.len()) <= 2 * most && edit_distance(&key, own) <= most
}

/// Levenshtein's distance.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extras(json: &str, place: Place) -> (Extras, Vec<String>) {
        let mut notes = Notes::default();
        let raw = gltf::json::Extras::Some(serde_json::value::RawValue::from_string(json.into()).unwrap());
        let extras = Extras::new(&raw, "material `M`".into(), place, &mut notes);
        (extras, notes.finish())
    }

    #[test]
    fn our_keys_are_read() {
        let json = r#"{"illumination": [1, 0.5], "opaque": [0, 0, 0, 1], "straight": [0.5, 0, 0, 0.0],
            "fluorescence": [[0, 0, 0.1], [0, 0, 0.5], [0, 0, 0]],
            "emission": "invisible", "thin": true, "warn": [0, 0, 0, 1], "backs": "unseen", "other": {"x": 1}}"#;
        let (extras, _) = extras(json, Place::Material);
        assert_eq!(extras.illumination(), Ok(Some(Illumination::Square { s: 1.0, t: 0.5 })));
        assert_eq!(extras.opaque(), Ok(Some(Matrix::new([[0.0, 0.0], [0.0, 1.0]]))));
        assert_eq!(extras.straight(), Ok(Some(Matrix::new([[0.5, 0.0], [0.0, 0.0]]))));
        assert_eq!(extras.emission(), Ok(Some(EmissionScale { invisible: 1.0, visible: 0.0 })));
        let green_of_blue = [[0.0, 0.0, 0.1], [0.0, 0.0, 0.5], [0.0; 3]];
        assert_eq!(extras.fluorescence(), Ok(Some(Fluorescence::colours(green_of_blue))));
        assert_eq!(extras.thin(), Ok(Some(true)));
        assert_eq!(extras.warn(), Ok(Some([0.0, 0.0, 0.0, 1.0])));
        assert_eq!(extras.backs(), Ok(Some(Backs::Unseen)));
    }

    #[test]
    fn wrong_values_are_named() {
        let (extras, _) = extras(
            r#"{"illumination": "globel", "opaque": [0, 0, 1], "straight": [0, -1, 0, 0], "emission": [1, -1],
                "thin": "yes", "warn": [1, 0, 0, 0], "backs": true}"#,
            Place::Material,
        );
        let messages = [
            extras.illumination().map(drop).unwrap_err(),
            extras.opaque().map(drop).unwrap_err(),
            extras.straight().map(drop).unwrap_err(),
            extras.emission().map(drop).unwrap_err(),
            extras.thin().map(drop).unwrap_err(),
            extras.warn().map(drop).unwrap_err(),
            extras.backs().map(drop).unwrap_err(),
        ];
        for message in messages {
            assert!(
                message.starts_with("material `M`: extras `") && message.contains("; write "),
                "{message}"
            );
        }
    }

    #[test]
    fn what_fluoresces_is_said_in_one_of_three_ways() {
        let read =
            |json: &str| extras(&format!(r#"{{"fluorescence": {json}}}"#), Place::Material).0.fluorescence();
        let dye = Fluorescence::dye([0.0, 0.25, 1.0], [1.0, 3.0, 0.0], 0.5);
        assert_eq!(read(r#"{"absorbs": [0, 0.25, 1], "emits": [1, 3, 0], "yield": 0.5}"#), Ok(Some(dye)));
        let rows = "[[0, 0, 0.125], [0, 0, 0.375], [0, 0, 0]]";
        let matrix = Fluorescence::colours([[0.0, 0.0, 0.125], [0.0, 0.0, 0.375], [0.0; 3]]);
        assert_eq!(read(rows), Ok(Some(matrix)));
        assert_eq!(read(&format!(r#"{{"matrix": {rows}, "gain": true}}"#)), Ok(Some(matrix.with_gain())));
        let row = "[1, 0, 0, 0, 0, 0]";
        let six = format!(r#"{{"matrix": [{row}, {row}, {row}, {row}, {row}, {row}]}}"#);
        assert_eq!(read(&six), Ok(Some(Fluorescence::full([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]; 6]))));
        let wrong = [
            "[[0, 0], [0, 0]]",
            "0.5",
            "[0, 0, 0, 0, 0, 0, 0, 0, 0]",
            r#"{"absorbs": [0, 0, 1]}"#,
            r#"{"absorbs": [0, 0, 2], "emits": [0, 1, 0]}"#,
            r#"{"absorbs": [0, 0, 1], "emits": [0, 0, 0]}"#,
            r#"{"absorbs": [0, 0, 1], "emits": [0, 1, 0], "yeild": 1}"#,
            r#"{"absorbs": [0, 0, 1], "emits": [0, 1, 0], "gain": 1}"#,
            r#"{"gain": true}"#,
        ];
        for wrong in wrong {
            let message = read(wrong).unwrap_err();
            assert!(
                message.contains("extras `fluorescence` is") && message.contains("; write three rows"),
                "{message}"
            );
        }
    }

    #[test]
    fn a_lens_is_as_wide_as_its_f_number_or_radius_says() {
        let lens = |json: &str, projection| {
            let (extras, notes) = extras(json, Place::Camera);
            assert!(notes.is_empty(), "{notes:?}");
            extras.lens(projection)
        };
        // 50 mm on a film of 24 mm.
        let normal = Projection::Perspective { yfov: 2.0 * (0.012_f32 / 0.05).atan() };
        let Ok(Some(Lens { radius, focus: 3.0 })) = lens(r#"{"fstop": 2, "focus": 3}"#, normal) else {
            panic!("a lens")
        };
        assert!((radius - 0.0125).abs() < 1e-7, "{radius}");
        let wide = Ok(Some(Lens { radius: 0.1, focus: 2.5 }));
        assert_eq!(lens(r#"{"aperture": 0.1, "focus": 2.5}"#, normal), wide);
        assert_eq!(lens(r#"{"aperture": 0, "focus": 2.5}"#, normal), Ok(None));
        assert_eq!(lens("{}", normal), Ok(None));
        let orthographic = Projection::Orthographic { half_height: 1.0 };
        let wrong = [
            (r#"{"fstop": 2}"#, normal, "`fstop` needs `focus`"),
            (r#"{"aperture": 2}"#, normal, "`aperture` needs `focus`"),
            (r#"{"focus": 2}"#, normal, "without `fstop`"),
            (r#"{"focus": 2, "aperture": 1, "fstop": 1}"#, normal, "leave one out"),
            (r#"{"focus": 0, "fstop": 1}"#, normal, "above 0"),
            (r#"{"focus": 1, "fstop": -1}"#, normal, "such as 2.8"),
            (r#"{"focus": 1, "aperture": "wide"}"#, normal, "half the diameter"),
            (r#"{"focus": 1, "fstop": 1}"#, orthographic, "orthographic camera has no lens"),
        ];
        for (json, projection, needle) in wrong {
            let message = lens(json, projection).unwrap_err();
            assert!(message.starts_with("material `M`: extras ") && message.contains(needle), "{message}");
        }
    }

    #[test]
    fn near_misses_are_noted_and_strangers_are_not() {
        let (_, notes) = extras(
            r#"{"ilumination": 1, "Opaque": 1, "warn": 1, "illumination": 1, "wire": 1, "thing": 1, "IES": 1, "ids": 1}"#,
            Place::Material,
        );
        assert_eq!(notes.len(), 5, "{notes:#?}");
        assert!(
            extras(r#"{"cycles_visibility": true, "x": 1, "name": "", "part": 3}"#, Place::Scene)
                .1
                .is_empty()
        );
        assert!(extras("[1, 2]", Place::Scene).1.is_empty());
    }
}
