//! What ends a render, and how it is written on the command line.

use crate::error::{Error, Result};
use crate::film::Schedule;
use crate::machine::{self, MemoryLimit};
use crate::render::ErrorEstimate;
use std::time::Duration;

/// What ends a render: the first of these that is reached.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// So many passes, those of before included.
    pub passes: Option<u32>,
    /// So much time.
    pub time: Option<Duration>,
    /// Relative error below this, and to be trusted.
    pub error: Option<f64>,
}

impl Limits {
    /// Whether time or error is; passes are counted elsewhere.
    pub fn reached(&self, passes: u32, elapsed: Duration, error: Option<ErrorEstimate>) -> bool {
        self.time.is_some_and(|limit| elapsed >= limit)
            || self.error.zip(error).is_some_and(|(limit, error)| error.reaches(limit, passes))
    }

    /// An error to reach that never can be.
    pub fn check(&self, error: Option<ErrorEstimate>) -> Result<()> {
        match (self.error, error) {
            // Once a pixel is not finite the error never is again.
            (Some(limit), Some(error)) if !error.total().is_finite() => Err(Error::Usage(format!(
                "--error {limit} cannot be reached: some pixels are not finite numbers, and so is the error; scale the lamps down"
            ))),
            _ => Ok(()),
        }
    }
}

/// Which passes are rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passes {
    /// The first so many.
    First(u32),
    /// From one number up to another, that one excluded.
    Range(u32, u32),
}

/// One share of all passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which, from 1.
    pub which: u32,
    /// Of how many.
    pub of: u32,
}

impl Shard {
    /// All of them.
    pub const WHOLE: Self = Self { which: 1, of: 1 };

    /// Its passes between two numbers: those that leave its own remainder, so that shards of any range are disjoint.
    pub fn schedule(self, first: u32, end: Option<u32>) -> Schedule {
        let (own, step) = (u64::from(self.which - 1), u64::from(self.of));
        let first = u64::from(first);
        let first = first + (own + step - first % step) % step;
        Schedule { first: u32::try_from(first).unwrap_or(u32::MAX), end, step: self.of }
    }
}

pub fn passes(text: &str) -> std::result::Result<Passes, String> {
    let wrong = || {
        format!(
            "`{text}` is no number of passes; write how many, as in 64, or A..B, as in 0..64 (64 is not among them)"
        )
    };
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    match text.split_once("..") {
        None => number(text).and_then(|all| if all > 0 { Ok(Passes::First(all)) } else { Err(wrong()) }),
        Some((first, end)) => {
            let (first, end) = (number(first)?, number(end)?);
            if first < end {
                Ok(Passes::Range(first, end))
            } else {
                Err(format!("`{text}` has no pass in it"))
            }
        }
    }
}

pub fn shard(text: &str) -> std::result::Result<Shard, String> {
    let wrong =
        || format!("`{text}` is no shard; write K/N, as in 3/16: the third of sixteen, numbered from 1");
    let (which, of) = text.split_once('/').ok_or_else(wrong)?;
    let number = |text: &str| text.parse::<u32>().map_err(|_| wrong());
    let shard = Shard { which: number(which)?, of: number(of)? };
    if (1..=shard.of).contains(&shard.which) { Ok(shard) } else { Err(wrong()) }
}

/// The memory that is left to this program, but no more than `most` bytes, where those are given.
pub fn memory_below(most: Option<u64>) -> Option<MemoryLimit> {
    let asked = most.map(|bytes| MemoryLimit { bytes, of: "--memory allows" });
    machine::memory().into_iter().chain(asked).min_by_key(|limit| limit.bytes)
}

/// Bytes, as in 2GiB, 500MB.
pub fn bytes(text: &str) -> std::result::Result<u64, String> {
    let wrong = || {
        format!(
            "`{text}` is no amount of memory; write a number with kB, MB, GB, KiB, MiB or GiB, as in 2GiB"
        )
    };
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let scale = match unit.to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "kb" => 1e3,
        "mb" => 1e6,
        "gb" => 1e9,
        "tb" => 1e12,
        "k" | "kib" => 1024.0,
        "m" | "mib" => 1024.0 * 1024.0,
        "g" | "gib" => 1024.0 * 1024.0 * 1024.0,
        "t" | "tib" => 1024.0_f64.powi(4),
        _ => return Err(wrong()),
    };
    let bytes = number.trim().parse::<f64>().map_err(|_| wrong())? * scale;
    // Below 2^53 a float holds whole numbers exactly.
    if (1.0..9e15).contains(&bytes) { Ok(bytes as u64) } else { Err(wrong()) }
}

pub fn duration(text: &str) -> std::result::Result<Duration, String> {
    let wrong = || format!("`{text}` is no time; write a number with s, m or h, as in 30s");
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let scale = match unit {
        "s" | "" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(wrong()),
    };
    let seconds = number.parse::<f64>().map_err(|_| wrong())? * scale;
    Duration::try_from_secs_f64(seconds).ok().filter(|time| !time.is_zero()).ok_or_else(wrong)
}

pub fn positive(text: &str) -> std::result::Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|x| *x > 0.0 && x.is_finite());
    value.ok_or_else(|| format!("`{text}` is no error to reach; write a fraction above zero, as in 0.01"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Doubt;

    #[test]
    fn shards_of_any_range_are_its_passes_once_each() {
        for (first, end) in [(0, 64), (5, 64), (7, 9), (30, 31)] {
            for of in [1, 2, 3, 7, 16] {
                let mut all: Vec<u32> = (1..=of)
                    .flat_map(|which| {
                        let schedule = Shard { which, of }.schedule(first, Some(end));
                        (0..schedule.len().expect("an end")).map(move |k| schedule.first + k * schedule.step)
                    })
                    .collect();
                all.sort_unstable();
                assert_eq!(all, (first..end).collect::<Vec<_>>(), "{first}..{end} in {of}");
            }
        }
        assert_eq!(Shard { which: 3, of: 16 }.schedule(0, None), Schedule { first: 2, end: None, step: 16 });
        assert!(
            Shard { which: 9, of: u32::MAX }.schedule(u32::MAX - 1, None).next(&Default::default()).is_none()
        );
    }

    #[test]
    fn an_error_that_rests_upon_few_paths_ends_nothing() {
        let limits = Limits { passes: None, time: None, error: Some(0.02) };
        let with = |noise, variance_of_variance| {
            let doubt = Doubt { variance_of_variance, ..Doubt::default() };
            Some(ErrorEstimate { noise, bias: Some(0.0), doubt })
        };
        let reached = |passes, error| limits.reached(passes, Duration::ZERO, error);
        assert!(reached(8, with(0.01, 0.05)) && !reached(8, with(0.01, 0.5)));
        assert!(!reached(7, with(0.01, 0.05)) && !reached(8, with(0.03, 0.05)) && !reached(8, None));
        // It never will be a number again.
        assert!(reached(8, with(f64::NAN, 0.5)));
    }

    #[test]
    fn what_is_no_range_shard_or_amount_is_refused() {
        assert_eq!(passes("64"), Ok(Passes::First(64)));
        assert_eq!(passes("8..64"), Ok(Passes::Range(8, 64)));
        for wrong in ["0", "-1", "8..8", "9..8", "a..b", "1..", "..4", "", "1.5", "0..4294967296"] {
            assert!(passes(wrong).is_err(), "{wrong}");
        }
        assert_eq!(shard("3/16"), Ok(Shard { which: 3, of: 16 }));
        for wrong in ["0/4", "5/4", "1", "a/b", "1/0", "0/0", "-1/4", "1/4/2", ""] {
            assert!(shard(wrong).is_err_and(|e| e.contains("numbered from 1")), "{wrong}");
        }
        assert_eq!(bytes("2GiB"), Ok(2 << 30));
        assert_eq!(bytes("1.5 MB"), Ok(1_500_000));
        for wrong in ["", "GiB", "-1GB", "0", "1e30GB", "2 apples", "nan", "inf"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }
}
