//! Checks response times against published examples and against a simulation of the same tasks.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // a wrong index must stop the test

use pil::response::{PeriodicTask, load, worst_response_ns};
use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Makes tasks from rows of priority, period and cost.
fn tasks(rows: &[(u8, u64, u64)]) -> Vec<PeriodicTask> {
    let task =
        |&(priority, period_ns, cost_ns)| PeriodicTask { priority, period_ns, jitter_ns: 0, cost_ns, blocking_ns: 0 };
    rows.iter().map(task).collect()
}

fn responses(tasks: &[PeriodicTask]) -> Vec<Option<u64>> {
    (0..tasks.len()).map(|index| worst_response_ns(tasks, index)).collect()
}

/// The examples are from Burns and Wellings, Real-Time Systems and Programming Languages. Periods 7, 12, 20 and costs
/// 3, 3, 5 give responses 3, 6, 20. Periods 80, 40, 20 and costs 40, 10, 5 give responses 80, 15, 5 at a load of 1.
#[test]
fn textbook_examples() {
    assert_eq!(responses(&tasks(&[(1, 7, 3), (2, 12, 3), (3, 20, 5)])), [Some(3), Some(6), Some(20)]);
    let full = tasks(&[(3, 80, 40), (2, 40, 10), (1, 20, 5)]);
    assert_eq!(responses(&full), [Some(80), Some(15), Some(5)]);
    assert!((load(&full) - 1.0).abs() < 1e-12);
}

/// Lehoczky 1990: periods 70 and 100, costs 26 and 62. The first seven responses of the second task are 114, 102, 116,
/// 104, 118, 106, 94: the fifth is the worst.
#[test]
fn the_worst_instance_need_not_be_the_first() {
    assert_eq!(responses(&tasks(&[(1, 70, 26), (2, 100, 62)])), [Some(26), Some(118)]);
}

#[test]
fn blocking_and_jitter_add() {
    let mut pair = tasks(&[(1, 10, 2), (2, 100, 5)]);
    pair[0].blocking_ns = 3;
    assert_eq!(responses(&pair), [Some(5), Some(7)]);
    // Released up to 4 late, the first task may run twice within 7.
    pair[0].jitter_ns = 4;
    assert_eq!(responses(&pair), [Some(9), Some(9)]);
}

#[test]
fn more_than_the_processor_has_no_bound() {
    let overloaded = tasks(&[(1, 10_000_000, 6_000_000), (2, 10_000_000, 5_000_000)]);
    assert_eq!(responses(&overloaded), [Some(6_000_000), None]);
    assert_eq!(worst_response_ns(&[], 0), None);
}

/// Simulates tasks with a common first release, one time unit after the other, and returns the worst response of each.
fn simulated(tasks: &[PeriodicTask], end: u64) -> Vec<u64> {
    let mut waiting: Vec<Vec<(u64, u64)>> = vec![Vec::new(); tasks.len()];
    let mut worst = vec![0; tasks.len()];
    for now in 0..end {
        for (queue, task) in waiting.iter_mut().zip(tasks) {
            if now % task.period_ns == 0 {
                queue.push((now, task.cost_ns));
            }
        }
        let ready = (0..tasks.len()).filter(|&index| !waiting[index].is_empty());
        let Some(index) = ready.min_by_key(|&index| tasks[index].priority) else { continue };
        waiting[index][0].1 -= 1;
        if waiting[index][0].1 == 0 {
            let (released, _) = waiting[index].remove(0);
            worst[index] = worst[index].max(now + 1 - released);
        }
    }
    worst
}

/// With a common first release and different priorities, the analysis is exact.
#[test]
fn random_tasks_respond_as_simulated() {
    let mut random = SplitMix64::seed_from_u64(1);
    let mut compared = 0;
    while compared < 200 {
        let rows: Vec<_> = (1..=4_u8)
            .map(|priority| {
                let period = [4, 5, 6, 8, 10, 12, 15, 20][random.next_u32() as usize % 8];
                (priority, period, 1 + u64::from(random.next_u32()) % (period / 2))
            })
            .collect();
        let tasks = tasks(&rows);
        if load(&tasks) > 1.0 {
            continue;
        }
        // 120 is a common multiple of the periods.
        let simulated: Vec<_> = simulated(&tasks, 480).into_iter().map(Some).collect();
        assert_eq!(responses(&tasks), simulated, "{rows:?}");
        compared += 1;
    }
}
