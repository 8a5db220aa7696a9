//! Names from files, made safe for messages.

/// Longer names are cut.
const LONGEST: usize = 200;
/// More names than this are counted instead of listed.
const LISTED: usize = 8;

/// The text on one line: control characters and those that turn the direction of writing become blanks.
pub(crate) fn one_line(text: &str) -> String {
    text.chars().map(|c| if is_unprintable(c) { ' ' } else { c }).collect()
}

/// A name on one line, cut where it is very long.
pub(crate) fn clean(name: &str) -> String {
    match name.char_indices().nth(LONGEST) {
        None => one_line(name),
        Some((end, _)) => one_line(&name[..end]) + "…",
    }
}

/// The first of them with commas, and how many more there are.
pub(crate) fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names = names.into_iter();
    let first: Vec<&str> = names.by_ref().take(LISTED).collect();
    match names.count() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

/// True for what moves a terminal's cursor, starts its commands, breaks a line or turns the direction of writing.
pub(crate) fn is_unprintable(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_on_one_line_and_keep_their_letters() {
        assert_eq!(clean("Grün 壁"), "Grün 壁");
        assert_eq!(clean("a\u{1b}[2Jb\nc\u{9b}d\u{202e}e\u{7f}"), "a [2Jb c d e ");
        assert_eq!(clean(&"x".repeat(500)).chars().count(), LONGEST + 1);
        assert_eq!(clean(&"é".repeat(LONGEST)), "é".repeat(LONGEST));
    }

    #[test]
    fn many_names_are_counted() {
        assert_eq!(listed(["a", "b"]), "a, b");
        let many = vec!["n"; 11];
        assert_eq!(listed(many), "n, n, n, n, n, n, n, n and 3 more");
    }
}
