//! Time that does not depend on who else uses the machine.

/// Seconds that all threads of this process have computed for so far.
#[cfg(unix)]
pub fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Where the system does not tell: wall time on all threads.
#[cfg(not(unix))]
pub fn cpu_seconds() -> f64 {
    use std::{sync::OnceLock, time::Instant};
    static BEGIN: OnceLock<Instant> = OnceLock::new();
    BEGIN.get_or_init(Instant::now).elapsed().as_secs_f64() * rayon::current_num_threads() as f64
}
