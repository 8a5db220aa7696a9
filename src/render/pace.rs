//! Keeps a render to the time that was asked for.
//!
//! Passes are whole: one that the clock cuts off is dropped. Only time decides, never what a pass shows, so the mean over
//! passes stays unbiased.

use super::Render;
use std::time::{Duration, Instant};

/// A pass takes no more than this share of the time, as far as fewer photons help.
const SHARE: f64 = 0.1;
/// A pass that would end later than this share of the time is not begun.
const NOT_BEGUN: f64 = 1.05;
/// One that has not ended by then is dropped, unless it is the first.
const DROPPED: f64 = 1.08;

/// A first pass that is mostly photons, and has not ended after this share of the time, was misjudged: it is begun again with
/// this share of them.
const MISJUDGED: [f64; 2] = [0.5, 0.125];

/// The time of one render.
pub struct Pace {
    begin: Instant,
    time: Option<Duration>,
    /// When the first pass is begun again with fewer photons. None: it is completed.
    again: Option<Instant>,
    /// Seconds that passes took.
    passing: f64,
    /// Passes that were complete before.
    before: u32,
}

impl Pace {
    /// From `begin`, for so long, with passes that were complete before; None: for ever.
    pub fn new(begin: Instant, time: Option<Duration>, before: u32) -> Self {
        Self { begin, time, again: None, passing: 0.0, before }
    }

    /// Makes passes small enough for the time. Returns a line about it where it changes something.
    pub fn fit(&mut self, render: &mut Render) -> Option<String> {
        let time = self.time?;
        // Planning may have taken all of it.
        let left = time.saturating_sub(self.begin.elapsed()).max(time.mul_f64(SHARE)).as_secs_f64();
        let size = render.pass_size();
        let pass = render.seconds_of_a_pass();
        let shoots = render.plan().photons.is_some();
        // Photons can be fewer, and so can camera samples of path tracers; with photons there is one for each pixel.
        let (scales, stays) = if shoots { (pass.shoot + pass.maps, pass.gather) } else { (pass.gather, 0.0) };
        let fitting = ((scaled(scales, stays, left) * f64::from(size)) as u32).max(1);
        if scales * f64::from(fitting) / f64::from(size) >= stays && fitting > 1 {
            self.again = Some(Instant::now() + Duration::from_secs_f64(MISJUDGED[0] * left));
        }
        let late = stays + scales * f64::from(fitting) / f64::from(size) > left;
        let late =
            late.then_some("the first pass may take longer than --time, and is completed all the same");
        if fitting == size {
            return late.map(str::to_owned);
        }
        render.set_pass_size(fitting);
        let what = if shoots { "photon paths" } else { "samples a pixel" };
        let late = late.map_or(String::new(), |late| format!("; {late}"));
        Some(format!("passes of {fitting} {what} (not {size}) keep to --time better{late}"))
    }

    /// How many passes may be begun now, if `done` are complete; the first of all always may.
    pub fn most(&self, done: u32) -> u32 {
        let Some(time) = self.time.filter(|_| done > 0) else { return u32::MAX };
        let left = NOT_BEGUN * time.as_secs_f64() - self.begin.elapsed().as_secs_f64();
        if done == self.before {
            // How long one takes is not known yet.
            return u32::from(left > 0.0);
        }
        (left * f64::from(done - self.before) / self.passing) as u32
    }

    /// When passes under way are dropped, if `done` are complete.
    pub fn deadline(&self, done: u32) -> Option<Instant> {
        if done == 0 { self.again } else { self.time.map(|time| self.begin + time.mul_f64(DROPPED)) }
    }

    /// After a pass was dropped: makes the first one smaller and returns a line about it. None: it was not the first.
    pub fn again(&mut self, done: u32, render: &mut Render) -> Option<String> {
        self.again.take().filter(|_| done == 0)?;
        let size = render.pass_size();
        render.set_pass_size((MISJUDGED[1] * f64::from(size)) as u32);
        Some("the first pass takes longer than was measured; it is begun again an eighth as large".into())
    }

    /// So much time went by in which nothing was to be done.
    pub fn waited(&mut self, time: Duration) {
        self.begin += time;
    }

    /// From now on there is no time to keep to.
    pub fn lift(&mut self) {
        self.time = None;
    }

    /// Passes took so long.
    pub fn took(&mut self, seconds: f64) {
        self.passing += seconds;
    }
}

/// The share of its photons with which a pass fits well into the time `left`: seconds that are in proportion to them, and
/// others. Photons may take as long as the rest does: less would be idle.
fn scaled(scales: f64, stays: f64, left: f64) -> f64 {
    let wanted = (SHARE * left - stays).max(stays);
    if scales > wanted { wanted / scales } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_are_as_large_as_the_time_allows() {
        assert_eq!(scaled(0.5, 0.3, 10.0), 1.0);
        // A tenth of the time, of which gathering takes its part.
        assert_eq!(scaled(20.0, 0.25, 10.0), 0.75 / 20.0);
        // Gathering takes more than a tenth: as much again for photons.
        assert_eq!(scaled(20.0, 2.0, 10.0), 0.1);
        assert_eq!(scaled(20.0, 12.0, 10.0), 0.6);
        assert_eq!(scaled(20.0, 30.0, 10.0), 1.0);
        // A path tracer's samples are all there is.
        assert_eq!(scaled(4.0, 0.0, 10.0), 0.25);
    }

    #[test]
    fn no_pass_is_begun_that_would_end_late() {
        let hour = Duration::from_secs(3600);
        let begin = Instant::now().checked_sub(hour).expect("a clock that runs");
        let mut pace = Pace::new(begin, Some(hour), 0);
        assert_eq!((pace.most(0), pace.deadline(0)), (u32::MAX, None));
        pace.took(3500.0);
        // 180 seconds are left of 1.05 hours.
        assert_eq!((pace.most(20), pace.most(40)), (1, 2));
        assert_eq!(pace.most(10), 0);
        assert_eq!(pace.deadline(1), Some(begin + hour.mul_f64(DROPPED)));
        pace.waited(hour);
        assert_eq!((pace.most(20), pace.deadline(1)), (21, Some(begin + hour + hour.mul_f64(DROPPED))));
        pace.lift();
        assert_eq!((pace.most(20), pace.deadline(1)), (u32::MAX, None));
        assert_eq!(
            (Pace::new(begin, None, 0).most(7), Pace::new(begin, None, 0).deadline(7)),
            (u32::MAX, None)
        );
    }
}
