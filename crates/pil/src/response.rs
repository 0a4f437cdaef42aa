//! Computes response times of fixed-priority tasks that preempt one another, like Cortex-M interrupts.
//!
//! The response time of instance q of a task is the smallest w + J - q T with w = B + (q + 1) C + sum over the others
//! of ceil((w + J_j) / T_j) C_j. The task's response time is the largest over the instances of its busy period (Joseph
//! and Pandya 1986; Audsley, Burns, Richardson, Tindell and Wellings 1993; for responses beyond the period Lehoczky
//! 1990). Interrupts of the same priority do not preempt one another: each is counted as if the others ran first, which
//! never underestimates.

/// A task or an interrupt. All times are in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PeriodicTask {
    /// Priority; a lower number preempts a higher one.
    pub priority: u8,
    /// Shortest time between two releases, above zero.
    pub period_ns: u64,
    /// Longest delay with which a release is noticed.
    pub jitter_ns: u64,
    /// Longest execution time of the task alone.
    pub cost_ns: u64,
    /// Longest time for which lower priorities disable interrupts.
    pub blocking_ns: u64,
}

/// A longer response counts as unbounded \[ns\].
const HORIZON_NS: u64 = 1_000_000_000;

/// Returns the share of the processor's time that all tasks take.
#[must_use]
pub fn load(tasks: &[PeriodicTask]) -> f64 {
    tasks.iter().map(|task| task.cost_ns as f64 / task.period_ns as f64).sum()
}

/// Returns the worst response time of the task at `index` \[ns\]; none if it exceeds a second or there is no such task.
#[must_use]
pub fn worst_response_ns(tasks: &[PeriodicTask], index: usize) -> Option<u64> {
    let task = tasks.get(index)?;
    let others = || {
        let rest = tasks.iter().enumerate().filter(move |(other, _)| *other != index);
        rest.map(|(_, other)| other).filter(|other| other.priority <= task.priority)
    };
    let mut worst = 0;
    for instance in 0_u64.. {
        let own_ns = task.blocking_ns + (instance + 1) * task.cost_ns;
        let mut window_ns = own_ns;
        // The window only grows, so the loop settles or leaves the horizon.
        loop {
            let others_ns = others().map(|other| {
                // Each other task counts with at least one release, since it may run first.
                (window_ns + other.jitter_ns).div_ceil(other.period_ns).max(1) * other.cost_ns
            });
            let next_ns = own_ns + others_ns.sum::<u64>();
            if next_ns > HORIZON_NS {
                return None;
            }
            if next_ns == window_ns {
                break;
            }
            window_ns = next_ns;
        }
        worst = worst.max((window_ns + task.jitter_ns).saturating_sub(instance * task.period_ns));
        // If this instance ends before the next release, the busy period is over.
        if window_ns + task.jitter_ns <= (instance + 1) * task.period_ns {
            return Some(worst);
        }
    }
    None
}
