//! Ctrl-C, and the signals by which a system ends a program.

use super::out::say;
use crate::stop::Stop;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Hears the wish to end. Before the first pass is complete there is nothing to write, and the program ends at once; later
/// what there is is written first, and a second wish ends it at once.
#[derive(Clone, Default)]
pub struct Interrupt {
    stop: Stop,
    /// Something would be lost.
    begun: Arc<AtomicBool>,
    /// The exit code it leads to; zero as long as nobody wished anything.
    code: Arc<AtomicU8>,
    /// The exit code of every wish to end, where a state is kept; else zero.
    kept: u8,
    /// The exit code of a program that only waits, all it made being on disk. None: it works.
    idle: Arc<Mutex<Option<u8>>>,
}

impl Interrupt {
    /// From now on signals are heard; a hang-up that is ignored stays so. The exit code is that of the signal, unless `kept` says another.
    pub fn listen(kept: Option<u8>) -> Self {
        let interrupt = Self { kept: kept.unwrap_or(0), ..Self::default() };
        interrupt.hear();
        interrupt
    }

    /// What passes look at.
    pub fn stop(&self) -> &Stop {
        &self.stop
    }

    /// A pass is complete.
    pub fn begun(&self) {
        self.begun.store(true, Ordering::Relaxed);
    }

    /// Another render begins, of which no pass is complete.
    pub fn begins_anew(&self) {
        self.begun.store(false, Ordering::Relaxed);
    }

    /// From now on, as long as it is Some, a wish to end ends the program at once, with that exit code.
    pub fn idle(&self, code: Option<u8>) {
        *self.idle.lock().unwrap_or_else(PoisonError::into_inner) = code;
    }

    /// The exit code of a render that was interrupted.
    pub fn exit_code(&self) -> Option<u8> {
        Some(self.code.load(Ordering::Relaxed)).filter(|code| *code != 0)
    }

    fn heard(&self, signal: u8) {
        if let Some(code) = *self.idle.lock().unwrap_or_else(PoisonError::into_inner) {
            std::process::exit(code.into());
        }
        let code = if self.kept > 0 { self.kept } else { 128 + signal };
        if !self.begun.load(Ordering::Relaxed) {
            say("interrupted before the first pass was complete: nothing was written");
            std::process::exit(code.into());
        }
        if self.code.swap(code, Ordering::Relaxed) != 0 {
            std::process::exit(code.into());
        }
        say("interrupted: the picture so far is being written; once more ends it at once");
        self.stop.ask();
    }

    #[cfg(unix)]
    fn hear(&self) {
        use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
        let hang_up = (!hang_up_is_ignored()).then_some(SIGHUP);
        let heard = [SIGINT, SIGTERM].into_iter().chain(hang_up);
        // Where this fails a signal ends the program as it would any other, and the last file written stays.
        let Ok(mut signals) = signal_hook::iterator::Signals::new(heard) else { return };
        let interrupt = self.clone();
        std::thread::spawn(move || signals.forever().for_each(|signal| interrupt.heard(signal as u8)));
    }

    #[cfg(not(unix))]
    fn hear(&self) {
        let interrupt = self.clone();
        let _ = ctrlc::set_handler(move || interrupt.heard(2));
    }
}

/// As `nohup` wants it. Where the system does not tell, the signal is left alone.
#[cfg(unix)]
fn hang_up_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask & 1 == 1)
}
