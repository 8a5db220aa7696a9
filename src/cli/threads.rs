//! How many threads are of use.

/// Threads for each processor at the most: more only wait for each other.
const MOST_THREADS: usize = 4;

/// As many of the threads asked for as the machine can use, and its processors where it has fewer.
pub fn threads(asked: u16) -> (usize, Option<usize>) {
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
}
