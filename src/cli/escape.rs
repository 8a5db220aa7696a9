//! Text for a terminal: names from files and arguments cannot move the cursor, start a command or break a line.

use crate::scene::names::is_unprintable;
use std::borrow::Cow;

/// One line, with everything escaped that is not to be printed: `\n`, `\u{1b}`.
pub fn line(text: &str) -> Cow<'_, str> {
    escaped(text, |_| false)
}

/// Several lines: line breaks stay, all else is escaped.
pub fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c == '\n')
}

fn escaped(text: &str, stays: impl Fn(char) -> bool) -> Cow<'_, str> {
    let escapes = |c: char| is_unprintable(c) && !stays(c);
    if !text.contains(escapes) {
        return Cow::Borrowed(text);
    }
    let mut line = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match c {
            '\n' | '\t' | '\r' if escapes(c) => line.extend(c.escape_default()),
            c if escapes(c) => line.extend(c.escape_unicode()),
            c => line.push(c),
        }
    }
    Cow::Owned(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_stays_one_line_of_plain_text() {
        assert!(matches!(line("Grün: 0…1, `x` \\ 壁"), Cow::Borrowed(_)));
        assert_eq!(line("a\u{1b}]0;x\u{7}b\nc\td"), "a\\u{1b}]0;x\\u{7}b\\nc\\td");
        assert_eq!(line("\u{9b}31m\u{202e}\u{2066}\u{7f}"), "\\u{9b}31m\\u{202e}\\u{2066}\\u{7f}");
        assert_eq!(lines("a\nb\u{1b}c\n"), "a\nb\\u{1b}c\n");
    }
}
