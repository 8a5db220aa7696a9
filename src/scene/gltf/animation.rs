//! Animations: where nodes are, and which morph targets have weight, at a time.

use super::Reason;
use super::accessor::{Accessors, SMALL};
use super::document::Stance;
use super::morph;
use super::notes::{Notes, label};
use crate::scene::Pose;
use crate::scene::names::listed;
use glam::{DQuat, DVec3};
use gltf::json::Value;
use gltf::json::accessor::Type;
use std::collections::HashMap;

/// Weights of morph targets by node, where an animation has a say.
pub(super) type Weights = HashMap<usize, Vec<f64>>;

/// Numbers that may be read for a pose: a file may move one mesh of many targets many times.
const MOST_NUMBERS: u64 = 1 << 28;

/// How messages call each animation.
pub(super) fn names(animations: &[Value]) -> Vec<String> {
    animations
        .iter()
        .enumerate()
        .map(|(i, animation)| label("animation", i, animation["name"].as_str()))
        .collect()
}

/// Puts nodes where an animation has them at the time of `pose`, and returns what it says of morph targets.
pub(super) fn strike(
    accessors: &Accessors<'_>,
    animations: &[Value],
    pose: &Pose,
    stances: &mut [Stance],
    notes: &mut Notes,
) -> Result<Weights, Reason> {
    let names = names(animations);
    let index = choose(animations, &names, pose.animation.as_deref())?;
    let name = &names[index];
    let others: Vec<_> =
        (0..names.len()).filter(|other| *other != index).map(|i| names[i].as_str()).collect();
    if !others.is_empty() && pose.animation.is_none() {
        notes.line(format!("posed by {name}; --pose NAME:SECONDS takes another: {}", listed(others)));
    }
    let mut sampler =
        Sampler { accessors, seconds: pose.seconds, left: MOST_NUMBERS, end: f64::NEG_INFINITY };
    let mut weights = Weights::new();
    let channels = animations[index]["channels"].as_array();
    for (number, channel) in channels.into_iter().flatten().enumerate() {
        let moved = sampler.channel(&animations[index], channel, stances, &mut weights);
        match moved.map_err(|what| format!("{name}: channel {number} {what}"))? {
            Moved::Node => {}
            Moved::Nothing => notes.about("channels of animations that move no node were passed over", name),
        }
    }
    if pose.seconds > sampler.end && sampler.end.is_finite() {
        notes.line(format!("{name} ends at {} s; its end is shown", sampler.end));
    }
    Ok(weights)
}

/// The animation that is wanted by name, else by number from 0; else the first.
fn choose(animations: &[Value], names: &[String], wanted: Option<&str>) -> Result<usize, Reason> {
    if animations.is_empty() {
        return Err("has no animation to pose it by; leave out --pose".into());
    }
    let Some(wanted) = wanted else { return Ok(0) };
    let named = animations.iter().position(|animation| animation["name"].as_str() == Some(wanted));
    let numbered = || wanted.parse().ok().filter(|index| *index < animations.len());
    named.or_else(numbered).ok_or_else(|| {
        format!(
            "has no animation `{wanted}`; --pose takes NAME:SECONDS, or a number from 0 for the name: it has {}",
            listed(names.iter().map(String::as_str))
        )
    })
}

/// What became of a channel.
enum Moved {
    Node,
    /// It moves something that is no node, or nothing known.
    Nothing,
}

/// Between which keys of a sampler a time lies.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Between {
    before: u64,
    after: u64,
    /// How far from one to the other, 0…1.
    share: f64,
    /// The time from one to the other, s.
    span: f64,
}

struct Sampler<'a> {
    accessors: &'a Accessors<'a>,
    seconds: f64,
    /// Numbers that may still be read.
    left: u64,
    /// When the last channel ends, s.
    end: f64,
}

impl Sampler<'_> {
    fn channel(
        &mut self,
        animation: &Value,
        channel: &Value,
        stances: &mut [Stance],
        weights: &mut Weights,
    ) -> Result<Moved, Reason> {
        let target = &channel["target"];
        let (Some(node), Some(path)) = (index(&target["node"]), target["path"].as_str()) else {
            return Ok(Moved::Nothing);
        };
        let lost = || "has no sampler; export it again".to_owned();
        let sampler =
            index(&channel["sampler"]).and_then(|i| animation["samplers"].get(i)).ok_or_else(lost)?;
        let gone = || format!("moves node {node}, which does not exist; export it again");
        let stance = stances.get_mut(node).ok_or_else(gone)?;
        match path {
            "translation" => stance.parts_mut().translation = vector(&self.sample(sampler, Kind::Vector)?),
            "scale" => stance.parts_mut().scale = vector(&self.sample(sampler, Kind::Vector)?),
            "rotation" => stance.parts_mut().rotation = turn(&self.sample(sampler, Kind::Turn)?),
            "weights" => {
                let root = self.accessors.root;
                let mesh = root.nodes.get(node).and_then(|node| root.meshes.get(node.mesh?.value()));
                let Some(targets) = mesh.map(morph::targets).filter(|targets| *targets > 0) else {
                    return Ok(Moved::Nothing);
                };
                weights.insert(node, self.sample(sampler, Kind::Weights(targets as u64))?);
            }
            _ => return Ok(Moved::Nothing),
        }
        Ok(Moved::Node)
    }

    /// The value of a sampler at the time.
    fn sample(&mut self, sampler: &Value, kind: Kind) -> Result<Vec<f64>, Reason> {
        let lost = || "has a sampler without times or values; export it again".to_owned();
        let (input, output) =
            (index(&sampler["input"]).ok_or_else(lost)?, index(&sampler["output"]).ok_or_else(lost)?);
        let between = self.between(input)?;
        let Between { before, after, share, span } = between;
        match sampler["interpolation"].as_str().unwrap_or("LINEAR") {
            "STEP" => self.value(output, before, kind),
            _ if before == after && sampler["interpolation"] != "CUBICSPLINE" => {
                self.value(output, before, kind)
            }
            "LINEAR" => {
                let (a, b) = (self.value(output, before, kind)?, self.value(output, after, kind)?);
                Ok(match kind {
                    Kind::Turn => turn(&a).slerp(turn(&b), share).to_array().to_vec(),
                    _ => a.iter().zip(&b).map(|(a, b)| a + share * (b - a)).collect(),
                })
            }
            "CUBICSPLINE" => {
                // Each key has the slope into it, its value, and the slope out of it: glTF 2.0, appendix C.
                let (a, out) =
                    (self.value(output, 3 * before + 1, kind)?, self.value(output, 3 * before + 2, kind)?);
                let (into, b) =
                    (self.value(output, 3 * after, kind)?, self.value(output, 3 * after + 1, kind)?);
                let all = a.iter().zip(&out).zip(into.iter().zip(&b));
                Ok(all
                    .map(|((a, out), (into, b))| hermite([*a, span * out, span * into, *b], share))
                    .collect())
            }
            other => Err(format!("is interpolated by `{other}`, which nobody here knows; export it again")),
        }
    }

    /// Where the time lies among those of an accessor: at its first or last, if it lies beyond.
    fn between(&mut self, input: usize) -> Result<Between, Reason> {
        let keys = self.accessors.count(input);
        let Some(mut high) = keys.checked_sub(1) else { return Err("has no keys; export it again".into()) };
        let at = |key: u64| -> Result<f64, Reason> {
            let time = self.accessors.some(input, Type::Scalar, &[], key..key + 1)?;
            let time = time.first().copied().filter(|time| time.is_finite());
            time.ok_or_else(|| format!("has a time that is not finite (key {key}); export it again"))
        };
        let (first, last) = (at(0)?, at(high)?);
        self.end = self.end.max(last);
        let alone = |key: u64| Between { before: key, after: key, share: 0.0, span: 0.0 };
        if self.seconds <= first {
            return Ok(alone(0));
        }
        if self.seconds >= last {
            return Ok(alone(high));
        }
        let mut low = 0;
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if at(middle)? <= self.seconds { low = middle } else { high = middle }
        }
        let (start, end) = (at(low)?, at(high)?);
        let span = end - start;
        // Times that are out of order leave no span to be in.
        let share = if span > 0.0 { ((self.seconds - start) / span).clamp(0.0, 1.0) } else { 0.0 };
        Ok(Between { before: low, after: high, share, span })
    }

    /// An element of the values, or as many as there are targets.
    fn value(&mut self, output: usize, element: u64, kind: Kind) -> Result<Vec<f64>, Reason> {
        let (of, width, numbers) = match kind {
            Kind::Vector => (Type::Vec3, 1, 3),
            Kind::Turn => (Type::Vec4, 1, 4),
            Kind::Weights(targets) => (Type::Scalar, targets, targets),
        };
        self.left = self.left.checked_sub(numbers).ok_or("is one of too many; leave out --pose")?;
        let start = element.checked_mul(width).ok_or("has too many keys; export it again")?;
        let range = start..start.saturating_add(width);
        let value = self.accessors.some(output, of, &SMALL, range)?;
        let finite = value.iter().all(|x| x.is_finite());
        finite.then_some(value).ok_or_else(|| "has a value that is not finite; export it again".into())
    }
}

/// What a channel moves.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Vector,
    Turn,
    /// Of so many targets.
    Weights(u64),
}

fn index(value: &Value) -> Option<usize> {
    value.as_u64().and_then(|index| usize::try_from(index).ok())
}

fn vector(numbers: &[f64]) -> DVec3 {
    numbers.first_chunk().map_or(DVec3::ZERO, |v| DVec3::from_array(*v))
}

fn turn(numbers: &[f64]) -> DQuat {
    numbers.first_chunk().map_or(DQuat::IDENTITY, |q| DQuat::from_array(*q).normalize())
}

/// The cubic from `a` with slope `out` to `b` with slope `into`, both per its whole length.
fn hermite([a, out, into, b]: [f64; 4], t: f64) -> f64 {
    let (t2, t3) = (t * t, t * t * t);
    (2.0 * t3 - 3.0 * t2 + 1.0) * a + (t3 - 2.0 * t2 + t) * out + (t3 - t2) * into + (3.0 * t2 - 2.0 * t3) * b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_has_its_ends_and_slopes() {
        let curve = |t| hermite([2.0, 3.0, -1.0, 5.0], t);
        assert_eq!((curve(0.0), curve(1.0)), (2.0, 5.0));
        let slope = |t: f64| (curve(t + 1e-6) - curve(t - 1e-6)) / 2e-6;
        assert!((slope(0.0) - 3.0).abs() < 1e-5 && (slope(1.0) + 1.0).abs() < 1e-5);
        // A straight line stays one.
        assert!((hermite([1.0, 2.0, 2.0, 3.0], 0.3) - 1.6).abs() < 1e-12);
    }
}
