use crate::scene::names::{clean, one_line};
use std::collections::{HashMap, HashSet};

/// What the loader has to tell: whole lines, and facts that are told once with the names they hold for.
#[derive(Default)]
pub(super) struct Notes {
    lines: Vec<String>,
    told: HashSet<String>,
    facts: Vec<Fact>,
    /// Where a fact is among `facts`.
    known: HashMap<String, usize>,
}

struct Fact {
    text: String,
    listed: Vec<String>,
    names: HashSet<String>,
}

/// More names than this are counted instead of listed.
const NAMES_LISTED: usize = 8;

/// More lines than this nobody reads.
const MOST_LINES: usize = 64;

impl Notes {
    /// One line of its own.
    pub fn line(&mut self, line: String) {
        if self.told.insert(line.clone()) {
            self.lines.push(line);
        }
    }

    /// Adds `name` to those for which `fact` holds; one line per fact.
    pub fn about(&mut self, fact: &str, name: &str) {
        let index = self.known.get(fact).copied().unwrap_or_else(|| {
            self.facts.push(Fact { text: fact.to_owned(), listed: Vec::new(), names: HashSet::new() });
            self.known.insert(fact.to_owned(), self.facts.len() - 1);
            self.facts.len() - 1
        });
        let fact = &mut self.facts[index];
        let name = clean(name);
        if !fact.names.contains(&name) {
            if fact.listed.len() < NAMES_LISTED {
                fact.listed.push(name.clone());
            }
            fact.names.insert(name);
        }
    }

    /// All of them, each one line.
    pub fn finish(mut self) -> Vec<String> {
        let left_out =
            |more: usize| (more > 0).then(|| format!("{more} more lines of this kind were left out"));
        let more_lines = left_out(self.lines.len().saturating_sub(MOST_LINES));
        let more_facts = left_out(self.facts.len().saturating_sub(MOST_LINES));
        self.lines.truncate(MOST_LINES);
        let facts = self.facts.into_iter().take(MOST_LINES).map(|Fact { text, listed, names }| {
            let all = listed.join(", ");
            match names.len() - listed.len() {
                0 => format!("{text}: {all}"),
                more => format!("{text}: {all} and {more} more"),
            }
        });
        self.lines
            .into_iter()
            .chain(more_lines)
            .chain(facts)
            .chain(more_facts)
            .map(|line| one_line(&line))
            .collect()
    }
}

/// How messages call the `index`-th thing of a kind: by its name in quotes, else by its number.
pub(super) fn label(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} `{}`", clean(name)),
        _ => format!("{kind} {index}"),
    }
}
