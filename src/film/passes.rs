//! Which passes a film holds.

use std::ops::Range;

/// A set of pass numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PassSet {
    /// In order; no two overlap or touch.
    ranges: Vec<Range<u32>>,
    /// How many passes of either half there are.
    halves: [u32; 2],
}

/// So many passes, `step` apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// The first.
    pub first: u32,
    /// From one to the next.
    pub step: u32,
    /// How many.
    pub count: u32,
}

/// The most ranges of a set that is read from a file: 32 MB of them.
const MOST_RANGES: usize = 1 << 22;

/// Which of two halves a pass is of, whose estimates are multiplied: of each two neighbours one is in either, and by what rule
/// hardly goes with any step in which passes may be dealt out.
pub fn half(pass: u32) -> usize {
    // Fibonacci hashing: Knuth, The Art of Computer Programming, 6.4. Its topmost bit alone would be too even.
    let mixed = (pass >> 1).wrapping_mul(0x9e37_79b9);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b);
    ((pass ^ (mixed >> 31)) & 1) as usize
}

impl PassSet {
    /// How many passes.
    pub fn len(&self) -> u32 {
        self.halves[0] + self.halves[1]
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    /// How many are of either [`half`].
    pub fn halves(&self) -> [u32; 2] {
        self.halves
    }

    /// Whether a pass is among them.
    pub fn contains(&self, pass: u32) -> bool {
        self.at(pass).is_ok()
    }

    /// The number after the last one; 0 without any.
    pub fn end(&self) -> u32 {
        self.ranges.last().map_or(0, |range| range.end)
    }

    /// The first number from `pass` on that is not among them.
    pub fn next_missing(&self, pass: u32) -> u32 {
        self.at(pass).map_or(pass, |at| self.ranges[at].end)
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        self.ranges.iter().cloned().flatten()
    }

    /// The range that holds a pass; Err: where one would stand that does.
    fn at(&self, pass: u32) -> Result<usize, usize> {
        let at = self.ranges.partition_point(|range| range.end <= pass);
        if self.ranges.get(at).is_some_and(|range| range.start <= pass) { Ok(at) } else { Err(at) }
    }

    /// Adds a pass. False: it is there already.
    pub fn insert(&mut self, pass: u32) -> bool {
        let Err(at) = self.at(pass) else { return false };
        self.halves[half(pass)] += 1;
        let joins_next = self.ranges.get(at).is_some_and(|next| next.start == pass + 1);
        if at > 0 && self.ranges[at - 1].end == pass {
            self.ranges[at - 1].end = if joins_next { self.ranges.remove(at).end } else { pass + 1 };
        } else if joins_next {
            self.ranges[at].start = pass;
        } else {
            self.ranges.insert(at, pass..pass + 1);
        }
        true
    }

    /// Adds all of another set.
    ///
    /// # Errors
    /// A pass that is in both; then nothing is added.
    pub fn join(&mut self, other: &Self) -> Result<(), u32> {
        if let Some(twice) = self.common(other) {
            return Err(twice);
        }
        let mut all: Vec<_> = self.ranges.iter().chain(&other.ranges).cloned().collect();
        all.sort_by_key(|range| range.start);
        all.dedup_by(|next, before| {
            let touch = before.end == next.start;
            if touch {
                before.end = next.end;
            }
            touch
        });
        self.ranges = all;
        (0..2).for_each(|half| self.halves[half] += other.halves[half]);
        Ok(())
    }

    /// The first pass that is in both. None: they have none in common.
    pub fn common(&self, other: &Self) -> Option<u32> {
        let (mut a, mut b) = (self.ranges.iter().peekable(), other.ranges.iter().peekable());
        while let (Some(x), Some(y)) = (a.peek(), b.peek()) {
            let start = x.start.max(y.start);
            if start < x.end.min(y.end) {
                return Some(start);
            }
            if x.end <= y.end {
                a.next()
            } else {
                b.next()
            };
        }
        None
    }

    /// The same as runs of equal steps, as few as come of taking them in order.
    pub fn runs(&self) -> Vec<Run> {
        let mut runs: Vec<Run> = Vec::new();
        for pass in self.iter() {
            match runs.last_mut() {
                Some(run) if run.count == 1 => *run = Run { step: pass - run.first, count: 2, ..*run },
                Some(run)
                    if (pass - run.first) / run.step == run.count && (pass - run.first) % run.step == 0 =>
                {
                    run.count += 1;
                }
                _ => runs.push(Run { first: pass, step: 1, count: 1 }),
            }
        }
        runs
    }

    /// Of runs that a file holds. None: they are no runs of [`runs`](Self::runs), or far too many.
    pub fn of_runs(runs: &[Run]) -> Option<Self> {
        let mut set = Self::default();
        for Run { first, step, count } in runs.iter().copied() {
            let last = u64::from(first) + u64::from(step) * u64::from(count.checked_sub(1)?);
            let more = if step == 1 { 1 } else { count as usize };
            if step == 0
                || last >= u64::from(u32::MAX)
                || first < set.end()
                || set.ranges.len() + more > MOST_RANGES
            {
                return None;
            }
            if step == 1 {
                set.append(first..first + count);
            } else {
                (0..count).map(|k| first + step * k).for_each(|pass| set.append(pass..pass + 1));
            }
        }
        Some(set)
    }

    /// Adds passes beyond the last one.
    fn append(&mut self, range: Range<u32>) {
        // Of each two neighbours, the first one even, either half has one.
        let (begin, end) = (range.start.next_multiple_of(2).min(range.end), range.end & !1);
        let (begin, end) = (begin, end.max(begin));
        (0..2).for_each(|half| self.halves[half] += (end - begin) / 2);
        (range.start..begin).chain(end..range.end).for_each(|pass| self.halves[half(pass)] += 1);
        match self.ranges.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => self.ranges.push(range),
        }
    }
}

impl std::fmt::Display for PassSet {
    /// As in `0..64`, `2..64 by 3`, the first few where they are many runs.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let runs = self.runs();
        for (i, Run { first, step, count }) in runs.iter().take(3).enumerate() {
            let before = if i > 0 { ", " } else { "" };
            let end = first + step * (count - 1) + 1;
            match step {
                1 => write!(f, "{before}{first}..{end}")?,
                _ => write!(f, "{before}{first}..{end} by {step}")?,
            }
        }
        if runs.len() > 3 { f.write_str(", …") } else { Ok(()) }
    }
}

/// The passes that a render is to make: from `first` on, `step` apart, below `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Schedule {
    /// The first.
    pub first: u32,
    /// The number that is not reached any more. None: without end.
    pub end: Option<u32>,
    /// From one to the next, 1 or more.
    pub step: u32,
}

impl Schedule {
    /// One pass after another from the first on.
    pub const ALL: Self = Self { first: 0, end: None, step: 1 };

    /// The next pass that is not done. None: all are.
    pub fn next(&self, done: &PassSet) -> Option<u32> {
        let end = self.end.unwrap_or(u32::MAX);
        let mut pass = self.first;
        while pass < end && done.contains(pass) {
            let missing = done.next_missing(pass);
            pass =
                self.first.checked_add((missing - self.first).div_ceil(self.step).checked_mul(self.step)?)?;
        }
        (pass < end).then_some(pass)
    }

    /// How many passes it has. None: without end.
    pub fn len(&self) -> Option<u32> {
        self.end.map(|end| end.saturating_sub(self.first).div_ceil(self.step))
    }

    /// True where it has no pass.
    pub fn is_empty(&self) -> bool {
        self.len() == Some(0)
    }

    /// Whether a pass is of it.
    pub fn contains(&self, pass: u32) -> bool {
        pass >= self.first
            && self.end.is_none_or(|end| pass < end)
            && (pass - self.first).is_multiple_of(self.step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(passes: impl IntoIterator<Item = u32>) -> PassSet {
        let mut set = PassSet::default();
        passes.into_iter().for_each(|pass| assert!(set.insert(pass), "{pass} twice"));
        set
    }

    #[test]
    fn a_set_does_not_depend_on_the_order_in_which_it_is_filled() {
        let whole = set(0..100);
        assert_eq!(set((0..100).rev()), whole);
        assert_eq!(set((0..100).map(|k| k * 37 % 100)), whole);
        assert_eq!((whole.ranges.len(), whole.len(), whole.end()), (1, 100, 100));
        let mut thirds = [0, 1, 2].map(|k| set((k..100).step_by(3)));
        let [a, b, c] = &mut thirds;
        c.join(a).unwrap();
        c.join(b).unwrap();
        assert_eq!(*c, whole);
        assert_eq!(c.join(b), Err(1));
        assert!(!c.insert(99) && c.insert(100));
    }

    #[test]
    fn runs_come_back() {
        for passes in [set(0..64), set((2..64).step_by(3)), set([5]), set([1, 2, 3, 7, 9, 11, 40]), set([])] {
            assert_eq!(PassSet::of_runs(&passes.runs()), Some(passes));
        }
        assert_eq!(set((2..64).step_by(3)).to_string(), "2..63 by 3");
        assert_eq!(set(0..64).to_string(), "0..64");
        let wrong = |first, step, count| PassSet::of_runs(&[Run { first, step, count }]);
        for run in
            [(0, 0, 2), (0, 1, 0), (0, 2, u32::MAX), (u32::MAX, 1, 1), (0, 2, 1 << 30), (9, 1, u32::MAX)]
        {
            assert_eq!(wrong(run.0, run.1, run.2), None, "{run:?}");
        }
        let back = [Run { first: 9, step: 1, count: 1 }, Run { first: 3, step: 1, count: 2 }];
        assert_eq!(PassSet::of_runs(&back), None);
    }

    #[test]
    fn both_halves_are_met_soon_however_passes_are_dealt_out() {
        assert!((0..1000).all(|pair| half(2 * pair) != half(2 * pair + 1)));
        for step in 1..=64 {
            for first in 0..step {
                let odd = (0..64).filter(|k| half(first + step * k) == 1).count();
                // Fair coins are farther off once in 10⁷.
                assert!((10..=54).contains(&odd), "{first} by {step}: {odd} of 64");
            }
        }
    }

    #[test]
    fn a_schedule_passes_over_what_is_done() {
        let shard = Schedule { first: 2, end: Some(20), step: 3 };
        assert_eq!(shard.len(), Some(6));
        assert_eq!(shard.next(&set([])), Some(2));
        assert_eq!(shard.next(&set([2, 5, 8])), Some(11));
        assert_eq!(shard.next(&set(0..12)), Some(14));
        assert_eq!(shard.next(&set((2..20).step_by(3))), None);
        assert!(shard.contains(17) && !shard.contains(20) && !shard.contains(16));
        assert_eq!(Schedule::ALL.next(&set(0..7)), Some(7));
        assert_eq!(Schedule::ALL.len(), None);
    }
}
