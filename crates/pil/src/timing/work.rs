//! What runs on a board, how often, for how long, and how long it holds interrupts off.

use super::boards::{BoardTimes, RateOfUart};
use super::bus::FRAME_NS;
use super::cycles::{CoreCycles, CycleLimit};
use crate::Error;
use crate::response::{PeriodicTask, worst_response_ns};

/// Priorities, as `firmware::executors::priority` has them, divided by 16.
mod priority {
    pub(super) const TIME: u8 = 1;
    pub(super) const UART: u8 = 2;
    pub(super) const SAMPLING: u8 = 3;
    pub(super) const CONTROL: u8 = 4;
    pub(super) const MOTOR_DMA: u8 = 6;
    pub(super) const AIDING: u8 = 7;
    pub(super) const COMMS: u8 = 8;
    pub(super) const HOUSEKEEPING: u8 = 12;
}

/// A period of the control tick \[ns\].
const TICK_NS: u64 = 1_000_000;
/// End of a DMA transfer, with the waker: their code in the image, each instruction once.
const DMA_END: u64 = 120;
/// I2C's interrupt for an event, likewise.
const I2C_EVENT: u64 = 40;
/// Events of a transfer: its start, its addresses, its end.
const I2C_EVENTS: u64 = 4;
/// Period of the fastest slow sensor, the compass \[ns\].
const AIDING_NS: u64 = 10_000_000;
/// Results of ticks that wait for the links' task, at most.
const QUEUE: u64 = 24;

/// Instructions, from `docs/budgets.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Work {
    /// The limit of the control tick.
    pub tick: u64,
    /// The same with the estimate.
    pub estimating: u64,
    /// DSHOT frames of a timer's motors, counted, as what follows.
    pub dshot: u64,
    /// SysTick's interrupt.
    pub systick: u64,
    /// A UART's interrupt.
    pub byte: u64,
    /// The links' task, woken once.
    pub wake: u64,
}

/// A time with interrupts off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section {
    /// What it is for.
    pub what: &'static str,
    /// Priority of the task.
    pub priority: u8,
    /// Instructions outside of loops.
    pub straight: u64,
    /// Instructions in loops that a cache holds.
    pub looped: u64,
}

/// A line of a board's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimingRow {
    /// What runs.
    pub name: &'static str,
    /// When.
    pub task: PeriodicTask,
    /// Longest response allowed \[ns\]; none if nothing depends on it.
    pub deadline_ns: Option<u64>,
    /// Longest response, with what follows it on a bus \[ns\]; none without a bound.
    pub response_ns: Option<u64>,
}

impl TimingRow {
    /// True if it may exceed its deadline, or has one and no bound.
    #[must_use]
    pub fn is_late(&self) -> bool {
        self.deadline_ns.is_some_and(|deadline| self.response_ns.is_none_or(|response| response > deadline))
    }
}

/// What a row begins with: priority, period, instructions, times of interrupts, time on a bus that follows, deadline.
struct Entry {
    name: &'static str,
    priority: u8,
    period_ns: u64,
    instructions: u64,
    interrupts: u64,
    bus_ns: u64,
    deadline_ns: Option<u64>,
}

/// Instructions to read the answers of two of a timer's motor controllers from their samples, whatever those are: 4,700
/// of an x86-64 at most (callgrind, 2026-11-28); and how long they are sampled \[ns\].
const ANSWERS: u64 = 5_000;
const SAMPLED_NS: u64 = 75_000;
/// The first fix in double precision: twice sine and cosine, 4,817 each, two square roots, some 40 operations.
const FIRST_FIX: u64 = 13_000;

impl Work {
    /// Reads the table of the page.
    ///
    /// # Errors
    /// If it lacks a row.
    pub fn read(budgets: &str) -> Result<Self, Error> {
        let cell = |what: &str, column: usize| {
            let row = budgets.lines().find(|line| line.starts_with(&format!("| {what} |")));
            let words = row.and_then(|row| row.split('|').nth(column)?.split_whitespace().next());
            let missing = || Error::Protocol(format!("docs/budgets.md has no figure in the row {what}"));
            words.and_then(|word| word.parse().ok()).ok_or_else(missing)
        };
        Ok(Work {
            tick: cell("control tick, worst", 3)?,
            estimating: cell("control tick with the estimate, worst", 3)?,
            dshot: cell("DSHOT frames of four motors", 2)?,
            systick: cell("SysTick's interrupt", 2)?,
            byte: cell("USART1's interrupt, for a byte", 2)?,
            wake: cell("link's task, woken once, most seen", 2)?,
        })
    }

    /// Returns the longest times with interrupts off on a board.
    #[must_use]
    pub fn sections(&self, board: &BoardTimes) -> Vec<Section> {
        let mut sections = vec![
            // A copy of 584 bytes.
            Section { what: "result of a tick, to the links", priority: priority::CONTROL, straight: 100, looped: 515 },
            Section { what: "timer of a task", priority: priority::HOUSEKEEPING, straight: 216, looped: 0 },
            // A copy of 64 bytes to an odd address.
            Section { what: "messages, to USB's ring", priority: priority::COMMS, straight: 200, looped: 233 },
        ];
        if board.senses {
            // Copies of the frame of fixes, of 48 bytes, and of the origin.
            sections.push(Section {
                what: "a fix, to stations",
                priority: priority::AIDING,
                straight: 60,
                looped: 120,
            });
        }
        sections
    }

    /// Returns the lines of a board's table, with links of this baud rate.
    #[must_use]
    pub fn rows(&self, board: &BoardTimes, limit: CycleLimit, link_baud: u64) -> Vec<TimingRow> {
        let core = board.core;
        let sections = self.sections(board);
        let entries = self.entries(board, link_baud);
        let tasks: Vec<_> = entries
            .iter()
            .map(|entry| {
                let lower = sections.iter().filter(|section| section.priority > entry.priority);
                let is_byte = entry.priority == priority::UART;
                let own = |instructions| {
                    if is_byte { core.byte_ns(instructions, limit) } else { core.time_ns(instructions, 0, limit) }
                };
                PeriodicTask {
                    priority: entry.priority,
                    period_ns: entry.period_ns,
                    jitter_ns: 0,
                    cost_ns: own(entry.instructions) + entry.interrupts * core.exception_ns(limit),
                    blocking_ns: lower.map(|section| section.time_ns(core, limit)).max().unwrap_or(0),
                }
            })
            .collect();
        let row = |(index, entry): (usize, &Entry)| {
            let response_ns = worst_response_ns(&tasks, index).map(|response| response + entry.bus_ns);
            tasks.get(index).map(|task| TimingRow {
                name: entry.name,
                task: *task,
                deadline_ns: entry.deadline_ns,
                response_ns,
            })
        };
        entries.iter().enumerate().filter_map(row).collect()
    }

    fn entries(&self, board: &BoardTimes, link_baud: u64) -> Vec<Entry> {
        let tick = if board.senses { self.estimating } else { self.tick };
        let mut entries = vec![Entry {
            name: "SysTick",
            priority: priority::TIME,
            period_ns: TICK_NS,
            instructions: self.systick,
            interrupts: 1,
            bus_ns: 0,
            // Its successor would be lost.
            deadline_ns: Some(TICK_NS),
        }];
        let byte = |name, rate: RateOfUart, is_heard: bool| Entry {
            name,
            priority: priority::UART,
            period_ns: rate.byte_ns(link_baud),
            instructions: self.byte,
            interrupts: 1,
            bus_ns: 0,
            // Then the one that arrives finds no place; the line waits for those sent.
            deadline_ns: is_heard.then(|| board.uart_keeps * rate.byte_ns(link_baud)),
        };
        let links = [
            ["first link: byte received", "first link: byte sent"],
            ["second link: byte received", "second link: byte sent"],
        ];
        for [received, sent] in links.into_iter().take(board.links) {
            entries.push(byte(received, RateOfUart::Link, true));
            entries.push(byte(sent, RateOfUart::Link, false));
        }
        if board.senses {
            entries.push(byte("GNSS receiver: byte", RateOfUart::Gnss, true));
            let scripts = board.scripts();
            let (sampled, slow) = scripts.split_at(board.sampled.min(scripts.len()));
            let times = sampled.iter().map(|script| script.time_ns);
            let transfers = sampled.iter().map(|script| script.transfers);
            let (bus_ns, transfers) = if board.is_one {
                (times.max().unwrap_or(0), transfers.max().unwrap_or(0))
            } else {
                (times.sum(), transfers.sum())
            };
            // Both ends of each transfer, and as many runs of the task.
            entries.push(Entry {
                name: "sampling, with its transfers",
                priority: priority::SAMPLING,
                period_ns: TICK_NS,
                instructions: board.sampling + 2 * DMA_END * transfers,
                interrupts: 1 + 3 * transfers,
                bus_ns,
                deadline_ns: Some(TICK_NS),
            });
            let transfers = slow.iter().map(|script| script.transfers).sum::<u64>();
            entries.push(Entry {
                name: "slow sensors, with their transfers",
                priority: priority::AIDING,
                period_ns: AIDING_NS,
                instructions: board.aiding + FIRST_FIX + (2 * DMA_END + I2C_EVENTS * I2C_EVENT) * transfers,
                interrupts: 1 + (3 + I2C_EVENTS) * transfers,
                bus_ns: slow.iter().map(|script| script.time_ns).sum(),
                deadline_ns: Some(AIDING_NS),
            });
        }
        entries.extend([
            Entry {
                name: "control tick, to the motors' DMA",
                priority: priority::CONTROL,
                period_ns: TICK_NS,
                instructions: tick + self.dshot * board.timers,
                interrupts: 1,
                bus_ns: FRAME_NS,
                // The frame has gone out when the next tick begins.
                deadline_ns: Some(TICK_NS),
            },
            Entry {
                name: "end of the motors' DMA",
                priority: priority::MOTOR_DMA,
                period_ns: TICK_NS,
                instructions: DMA_END * board.timers,
                interrupts: board.timers,
                bus_ns: 0,
                deadline_ns: Some(TICK_NS),
            },
        ]);
        if board.answers {
            entries.push(Entry {
                name: "motor controllers' answers",
                priority: priority::CONTROL,
                period_ns: TICK_NS,
                instructions: (ANSWERS + DMA_END) * board.timers,
                interrupts: board.timers,
                bus_ns: SAMPLED_NS,
                deadline_ns: Some(TICK_NS),
            });
        }
        entries.extend([Entry {
            name: "links' task",
            priority: priority::COMMS,
            period_ns: TICK_NS,
            instructions: self.wake,
            interrupts: 1,
            bus_ns: 0,
            // Then results of ticks are dropped.
            deadline_ns: Some(QUEUE * TICK_NS),
        }]);
        entries.sort_by_key(|entry| entry.priority);
        entries
    }
}

impl Section {
    /// Returns how long it takes \[ns\].
    #[must_use]
    pub fn time_ns(&self, core: &CoreCycles, limit: CycleLimit) -> u64 {
        core.time_ns(self.straight, self.looped, limit)
    }
}
