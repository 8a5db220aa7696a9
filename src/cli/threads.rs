//! How many threads work.

use super::out::say;
use crate::error::{Error, Result};

/// Threads for each processor at the most: more only wait for each other.
const MOST_THREADS: usize = 4;
/// No machine has so many processors that more threads could be meant.
const MEANT: u16 = 1024;

/// Starts as many of the threads asked for as are of use; says so where they are fewer.
///
/// # Errors
/// They cannot be started.
pub fn start_threads(asked: u16, quiet: bool) -> Result<()> {
    let (threads, fewer) = threads(asked);
    if let Some(processors) = fewer.filter(|_| !quiet) {
        say(format_args!("note: --threads {asked}: for {processors} processors {threads} are used"));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build_global().map_err(|why| Error::Usage(format!("--threads {asked}: {why}")))
}

/// A number of threads that can be meant.
pub fn number(text: &str) -> std::result::Result<u16, String> {
    let number = text.parse::<u16>().ok().filter(|number| (1..=MEANT).contains(number));
    number.ok_or_else(|| {
        format!("`{text}` threads cannot be meant: give 1 to {MEANT}, or leave --threads out, for one per processor")
    })
}

/// As many of the threads asked for as the machine can use, and its processors where it has fewer.
fn threads(asked: u16) -> (usize, Option<usize>) {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let most = MOST_THREADS * processors;
    let asked = usize::from(asked);
    (asked.min(most), (asked > most).then_some(processors))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_more_threads_than_processors_are_not_started() {
        let (most, processors) = threads(u16::MAX);
        assert_eq!(Some(most), processors.map(|processors| 4 * processors));
        assert_eq!(threads(1), (1, None));
    }

    #[test]
    fn numbers_of_threads_that_cannot_be_meant_are_refused() {
        assert_eq!((number("1"), number("1024")), (Ok(1), Ok(1024)));
        for wrong in ["0", "1025", "65535", "65536", "99999999999999999999", "-1", "", "all", "1.5"] {
            assert!(number(wrong).is_err_and(|why| why.contains("1 to 1024")), "{wrong}");
        }
    }
}
