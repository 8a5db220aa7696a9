/// What the loader has to tell: whole lines, and facts that are told once with the names they hold for.
#[derive(Default)]
pub(super) struct Notes {
    lines: Vec<String>,
    facts: Vec<(String, Vec<String>)>,
}

/// More names than this are counted instead of listed.
const NAMES_LISTED: usize = 8;

impl Notes {
    /// One line of its own.
    pub fn line(&mut self, line: String) {
        if !self.lines.contains(&line) {
            self.lines.push(line);
        }
    }

    /// Adds `name` to those for which `fact` holds; one line per fact.
    pub fn about(&mut self, fact: &str, name: &str) {
        if !self.facts.iter().any(|(known, _)| known == fact) {
            self.facts.push((fact.to_owned(), Vec::new()));
        }
        for (_, names) in self.facts.iter_mut().filter(|(known, _)| known == fact) {
            if !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
    }

    /// All of them, each one line.
    pub fn finish(self) -> Vec<String> {
        let facts = self.facts.into_iter().map(|(fact, names)| {
            let listed = names.iter().take(NAMES_LISTED).cloned().collect::<Vec<_>>().join(", ");
            match names.len().saturating_sub(NAMES_LISTED) {
                0 => format!("{fact}: {listed}"),
                more => format!("{fact}: {listed} and {more} more"),
            }
        });
        self.lines.into_iter().chain(facts).map(|line| one_line(&line)).collect()
    }
}

/// The text with every control character (a name in a file may hold a line break) turned into a blank.
pub(super) fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// How messages call the `index`-th thing of a kind: by its name in quotes, else by its number.
pub(super) fn label(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} `{name}`"),
        _ => format!("{kind} {index}"),
    }
}
