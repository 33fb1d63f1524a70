//! The clock of the comparison programs.

use std::time::Duration;

/// Returns the least CPU time that this process takes for `work`, over the repetitions.
pub fn least_cpu_time(repetitions: u32, mut work: impl FnMut()) -> Duration {
    let times = (0..repetitions.max(1)).map(|_| {
        let start = cpu_time();
        work();
        cpu_time().saturating_sub(start)
    });
    times.min().unwrap_or_default()
}

#[cfg(unix)]
fn cpu_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(
        time.tv_sec.unsigned_abs(),
        u32::try_from(time.tv_nsec).unwrap_or(0),
    )
}

/// Wall-clock time, where the system does not tell the CPU time.
#[cfg(not(unix))]
fn cpu_time() -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}
