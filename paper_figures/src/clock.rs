//! Time that does not depend on who else uses the machine.

/// Seconds that all threads of this process have computed for so far.
pub fn cpu_seconds() -> f64 {
    cpu_time::ProcessTime::now().as_duration().as_secs_f64()
}
