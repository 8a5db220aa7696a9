//! How work under way is told to end early.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A wish to end, and a time to end at. Work that takes long asks every few milliseconds and gives up when it is
/// [`asked`](Self::asked) to; what it has made by then is incomplete and is dropped. Clones share the wish.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    wish: Arc<AtomicBool>,
    /// Somebody else's.
    other: Option<Arc<AtomicBool>>,
    deadline: Option<Instant>,
}

impl Stop {
    /// The same wish, and the end at `deadline`.
    pub fn at(&self, deadline: Option<Instant>) -> Self {
        Self { deadline, ..self.clone() }
    }

    /// The same, and the end also when `other` wishes it.
    pub fn or(&self, other: &Self) -> Self {
        Self { other: Some(Arc::clone(&other.wish)), ..self.clone() }
    }

    /// Wishes the end.
    pub fn ask(&self) {
        self.wish.store(true, Ordering::Relaxed);
    }

    /// True when someone wished the end, whatever the time.
    pub fn is_wished(&self) -> bool {
        let is_set = |wish: &Arc<AtomicBool>| wish.load(Ordering::Relaxed);
        is_set(&self.wish) || self.other.as_ref().is_some_and(is_set)
    }

    /// True from when the end is wished or due; never false again.
    pub fn asked(&self) -> bool {
        self.is_wished() || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn clones_share_the_wish_and_not_the_deadline() {
        let stop = Stop::default();
        let due = stop.at(Some(Instant::now()));
        let later = stop.at(Some(Instant::now() + Duration::from_secs(3600)));
        assert!(due.asked() && !due.is_wished() && !later.asked() && !stop.asked());
        later.ask();
        assert!(stop.asked() && later.is_wished() && due.is_wished());
    }

    #[test]
    fn either_of_two_wishes_ends_work_and_neither_the_other() {
        let (own, other) = (Stop::default(), Stop::default());
        let both = own.or(&other).at(None);
        assert!(!both.asked());
        other.ask();
        assert!(both.asked() && !own.asked());
    }
}
