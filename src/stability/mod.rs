//! The stability suite: stiff and extreme cases, each with what is promised, a closed form or a clear error, and how far our
//! result is from it. `halflight check` prints it as a table; the physics tests run the same functions.

mod build;
mod contact;
mod counts;
mod fluorescence;
mod geometry;
mod glass;
mod lights;
mod matter;
mod scale;
pub mod scene_check;
mod sky;
mod stiff;

use std::time::Instant;

/// How much time a case may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// As a test: seconds.
    Quick,
    /// As a report: the stiffest settings too.
    Full,
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq)]
pub enum Check {
    /// A number against its closed form.
    Number {
        /// Which of the case's numbers.
        what: String,
        /// The closed form.
        expected: f64,
        /// What was measured.
        got: f64,
        /// Standard error of `got`; zero where no chance is involved.
        error: f64,
        /// Relative error that rounding and tessellation may add.
        rounding: f64,
    },
    /// Something that holds or does not.
    Fact {
        /// What.
        what: String,
        /// In words.
        expected: String,
        /// In words; holds when equal.
        got: String,
    },
}

/// A measurement passes within so many standard errors. Of 100 right rows 1 in 20 tables would have one beyond.
pub const LARGEST_Z: f64 = 3.5;

impl Check {
    /// A number with its error and an allowance for rounding.
    fn number(what: impl Into<String>, expected: f64, (got, error): (f64, f64), rounding: f64) -> Self {
        Self::Number { what: what.into(), expected, got, error, rounding }
    }

    /// A fact.
    fn fact(what: impl Into<String>, expected: impl Into<String>, got: impl Into<String>) -> Self {
        Self::Fact { what: what.into(), expected: expected.into(), got: got.into() }
    }

    /// Which.
    pub fn what(&self) -> &str {
        match self {
            Self::Number { what, .. } | Self::Fact { what, .. } => what,
        }
    }

    /// How many standard errors lie between what was measured and `expected`, rounding left out.
    fn z_against(&self, against: f64) -> f64 {
        match self {
            Self::Number { got, error, rounding, .. } => {
                let off = (got - against).abs() - rounding * against.abs();
                if off.is_nan() {
                    f64::INFINITY
                } else if off <= 0.0 {
                    0.0
                } else {
                    off / error
                }
            }
            Self::Fact { .. } => f64::NAN,
        }
    }

    /// Standard errors between measured and expected; None for facts.
    pub fn z(&self) -> Option<f64> {
        match self {
            Self::Number { expected, .. } => Some(self.z_against(*expected)),
            Self::Fact { .. } => None,
        }
    }

    /// Relative difference; None for facts.
    pub fn relative_error(&self) -> Option<f64> {
        match self {
            Self::Number { expected, got, .. } if *expected != 0.0 => Some(got / expected - 1.0),
            Self::Number { got, .. } => Some(*got),
            Self::Fact { .. } => None,
        }
    }

    /// Whether the promise was kept.
    pub fn passes(&self) -> bool {
        match self {
            Self::Number { expected, .. } => self.z_against(*expected) < LARGEST_Z,
            Self::Fact { expected, got, .. } => expected == got,
        }
    }

    /// Whether an expectation that is 2 % too high or too low would have failed.
    pub fn can_fail(&self) -> bool {
        match self {
            Self::Number { expected, .. } if *expected != 0.0 => {
                [0.98, 1.02].iter().all(|wrong| self.z_against(wrong * expected) >= LARGEST_Z)
            }
            Self::Number { error, .. } => error.is_finite(),
            Self::Fact { .. } => true,
        }
    }
}

/// Rows, each measured when it is asked for.
pub type Rows = Box<dyn Iterator<Item = Check>>;

/// How a case is run.
#[derive(Clone, Copy)]
pub enum Run {
    /// All rows at once.
    AtOnce(fn(Effort) -> Vec<Check>),
    /// Row by row: each takes long enough to be told on its own.
    ByRow(fn(Effort) -> Rows),
}

/// A case of the suite.
#[derive(Clone, Copy)]
pub struct Case {
    /// Its name, for `--case`.
    pub name: &'static str,
    /// What is promised.
    pub promise: &'static str,
    /// Runs it.
    pub run: Run,
}

/// What a case gave.
pub struct Outcome {
    /// Name of the case.
    pub name: String,
    /// What was promised.
    pub promise: String,
    /// What was found.
    pub checks: Vec<Check>,
    /// Time it took, s.
    pub seconds: f64,
}

impl Case {
    /// Runs and times it; `found` hears of each row as soon as it is measured.
    pub fn outcome(&self, effort: Effort, found: impl FnMut(&Check)) -> Outcome {
        let begin = Instant::now();
        let rows: Rows = match self.run {
            Run::AtOnce(run) => Box::new(run(effort).into_iter()),
            Run::ByRow(run) => run(effort),
        };
        let checks = rows.inspect(found).collect();
        let seconds = begin.elapsed().as_secs_f64();
        Outcome { name: self.name.into(), promise: self.promise.into(), checks, seconds }
    }
}

/// All cases, by theme.
pub fn cases() -> Vec<Case> {
    let by_theme = [
        stiff::CASES,
        scale::CASES,
        lights::CASES,
        sky::CASES,
        glass::CASES,
        geometry::CASES,
        contact::CASES,
        counts::CASES,
        matter::CASES,
        fluorescence::CASES,
    ];
    by_theme.concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_can_fail() {
        let check = |got, error| Check::number("x", 2.0, (got, error), 1e-3);
        assert!(check(2.001, 0.001).passes() && check(2.001, 0.001).can_fail());
        assert!(!check(2.04, 0.001).passes());
        assert!(!check(f64::NAN, 0.001).passes() && !check(f64::NAN, f64::NAN).passes());
        assert!(!check(2.0, 0.5).can_fail(), "too noisy to tell 2 %");
        assert!(!check(0.0, 0.0).passes() && check(2.0, 0.0).passes() && check(2.0, 0.0).can_fail());
        assert!(!Check::fact("y", "a", "b").passes());
    }

    #[test]
    fn a_row_is_told_before_the_next_is_measured() {
        use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
        static MEASURED: AtomicU32 = AtomicU32::new(0);
        fn three(_: Effort) -> Rows {
            let row = |i: u32| Check::fact("row", "", (MEASURED.fetch_add(1, Relaxed) + i).to_string());
            Box::new((0..3).map(row))
        }
        let case = Case { name: "three", promise: "rows in turn", run: Run::ByRow(three) };
        let mut told = Vec::new();
        let outcome = case.outcome(Effort::Quick, |_| told.push(MEASURED.load(Relaxed)));
        assert_eq!((told, outcome.checks.len()), (vec![1, 2, 3], 3));
    }
}
