//! Which of a file's scenes is shown.

use super::Reason;
use super::notes::{Notes, label};
use crate::scene::names::listed;
use gltf::json::{Extras, Index, Root};

/// A scene of the file.
pub(super) struct Stage<'a> {
    pub label: String,
    /// Its number; None where a file without scenes shows all it has.
    pub index: Option<usize>,
    pub extras: &'a Extras,
    /// Its nodes without parents.
    pub roots: Vec<usize>,
}

/// The scene that is `wanted` by name, else by number from 0; else the file's default, else its first. A file without
/// scenes shows all of its nodes.
pub(super) fn choose<'a>(
    root: &'a Root,
    wanted: Option<&str>,
    notes: &mut Notes,
) -> Result<Stage<'a>, Reason> {
    if root.scenes.is_empty() && root.scene.is_none() && !root.nodes.is_empty() {
        return match wanted {
            Some(wanted) => Err(format!("has no scene `{wanted}`, as it has none; leave out --scene")),
            None => {
                let roots = parentless(root);
                Ok(Stage { label: "the file".into(), index: None, extras: &None, roots })
            }
        };
    }
    let index = match wanted {
        Some(wanted) => find(root, wanted)?,
        None => root.scene.map_or(0, |scene| scene.value()),
    };
    let source = root.scenes.get(index).ok_or(match root.scene {
        Some(_) if !root.scenes.is_empty() => {
            "its default scene does not exist; choose one by --scene, or export it again"
        }
        Some(_) => "its default scene does not exist; export it again",
        None => "has no scene; put the objects into one and export it again",
    })?;
    let name = |index: usize| label("scene", index, root.scenes[index].name.as_deref());
    let others: Vec<_> = (0..root.scenes.len()).filter(|other| *other != index).map(name).collect();
    if !others.is_empty() && wanted.is_none() {
        notes.line(format!(
            "shows {}; --scene NAME or N (from 0) shows another: {}",
            name(index),
            listed(others.iter().map(String::as_str))
        ));
    }
    let roots = source.nodes.iter().map(Index::value).collect();
    Ok(Stage { label: name(index), index: Some(index), extras: &source.extras, roots })
}

fn find(root: &Root, wanted: &str) -> Result<usize, Reason> {
    let named = root.scenes.iter().position(|scene| scene.name.as_deref() == Some(wanted));
    let numbered = || wanted.parse().ok().filter(|index| *index < root.scenes.len());
    named.or_else(numbered).ok_or_else(|| {
        let known = root.scenes.iter().enumerate();
        let known: Vec<_> = known.map(|(i, scene)| label("scene", i, scene.name.as_deref())).collect();
        format!(
            "has no scene `{wanted}`; --scene takes a name, or a number from 0: it has {}",
            listed(known.iter().map(String::as_str))
        )
    })
}

/// Nodes that are no node's child.
fn parentless(root: &Root) -> Vec<usize> {
    let mut has_parent = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        if let Some(has_parent) = has_parent.get_mut(child.value()) {
            *has_parent = true;
        }
    }
    (0..root.nodes.len()).filter(|index| !has_parent[*index]).collect()
}
