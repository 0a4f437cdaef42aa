//! Lists the code that runs on a board: its period, its cost, and how long it disables interrupts.

use super::boards::{BoardTimes, RateOfUart};
use super::bus::FRAME_NS;
use super::cycles::{CoreCycles, CycleLimit};
use crate::Error;
use crate::response::{PeriodicTask, worst_response_ns};

/// Priorities of `firmware::executors::priority`, divided by 16.
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

/// Period of the control tick \[ns\].
const TICK_NS: u64 = 1_000_000;
/// Instructions at the end of a DMA transfer, including the waker: their code in the image, each instruction counted
/// once.
const DMA_END: u64 = 120;
/// Instructions of I2C's event interrupt: their code in the image, each instruction counted once.
const I2C_EVENT: u64 = 40;
/// Events per I2C transfer: its start, its addresses, its end.
const I2C_EVENTS: u64 = 4;
/// Period of the fastest slow sensor, the compass \[ns\].
const AIDING_NS: u64 = 10_000_000;
/// Largest number of tick results that wait for the links' task.
const QUEUE: u64 = 24;

/// Instruction counts from `docs/budgets.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstructionCounts {
    /// Largest number of instructions allowed in the control tick.
    pub tick: u64,
    /// Largest number of instructions allowed in the control tick with the estimate.
    pub estimating: u64,
    /// Instructions counted in encoding the DSHOT frames of a timer's motors.
    pub dshot: u64,
    /// Instructions counted in SysTick's interrupt.
    pub systick: u64,
    /// Instructions counted in a UART's interrupt.
    pub byte: u64,
    /// Instructions counted in one run of the links' task.
    pub wake: u64,
}

/// A section of code with interrupts disabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CriticalSection {
    /// Purpose of the section.
    pub what: &'static str,
    /// Priority of the task.
    pub priority: u8,
    /// Instructions outside of loops.
    pub straight: u64,
    /// Instructions in loops that a cache holds.
    pub looped: u64,
}

/// A row of a board's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimingRow {
    /// Name of the task or interrupt.
    pub name: &'static str,
    /// Priority, period and cost.
    pub task: PeriodicTask,
    /// Longest response allowed \[ns\]; none if nothing depends on it.
    pub deadline_ns: Option<u64>,
    /// Longest response, including the following bus transfer \[ns\]; none without a bound.
    pub response_ns: Option<u64>,
}

impl TimingRow {
    /// Returns true if the row has a deadline and its response may exceed the deadline or has no bound.
    #[must_use]
    pub fn is_late(&self) -> bool {
        self.deadline_ns.is_some_and(|deadline| self.response_ns.is_none_or(|response| response > deadline))
    }
}

/// Input of a row. `interrupts` is the number of interrupt entries, `bus_ns` the time of the bus transfer that follows.
struct RowInput {
    name: &'static str,
    priority: u8,
    period_ns: u64,
    instructions: u64,
    interrupts: u64,
    bus_ns: u64,
    deadline_ns: Option<u64>,
}

/// Instructions for decoding the answers of two of a timer's motor controllers from any samples, and sampling time
/// \[ns\]. On an x86-64, decoding takes at most 4,700 instructions (callgrind, 2026-11-28).
const ANSWERS: u64 = 5_000;
const SAMPLED_NS: u64 = 75_000;
/// Instructions for the first fix in double precision: two sine and cosine pairs with 4,817 each, two square roots,
/// some 40 operations.
const FIRST_FIX: u64 = 13_000;

impl InstructionCounts {
    /// Reads the instruction counts from the page's table.
    ///
    /// # Errors
    /// Fails if the table lacks a row.
    pub fn read(budgets: &str) -> Result<Self, Error> {
        let cell = |what: &str, column: usize| {
            let row = budgets.lines().find(|line| line.starts_with(&format!("| {what} |")));
            let words = row.and_then(|row| row.split('|').nth(column)?.split_whitespace().next());
            let missing = || Error::Protocol(format!("docs/budgets.md has no figure in the row {what}"));
            words.and_then(|word| word.parse().ok()).ok_or_else(missing)
        };
        Ok(InstructionCounts {
            tick: cell("control tick, worst", 3)?,
            estimating: cell("control tick with the estimate, worst", 3)?,
            dshot: cell("DSHOT frames of four motors", 2)?,
            systick: cell("SysTick's interrupt", 2)?,
            byte: cell("USART1's interrupt, for a byte", 2)?,
            wake: cell("link's task per wake-up, most seen", 2)?,
        })
    }

    /// Returns the longest sections with interrupts disabled on a board.
    #[must_use]
    pub fn sections(&self, board: &BoardTimes) -> Vec<CriticalSection> {
        let mut sections = vec![
            // Copies 584 bytes.
            CriticalSection {
                what: "result of a tick, to the links",
                priority: priority::CONTROL,
                straight: 100,
                looped: 515,
            },
            CriticalSection { what: "timer of a task", priority: priority::HOUSEKEEPING, straight: 216, looped: 0 },
            // The section copies 64 bytes to an odd address.
            CriticalSection { what: "messages, to USB's ring", priority: priority::COMMS, straight: 200, looped: 233 },
        ];
        if board.senses {
            // The section copies the message of a fix, 48 bytes, and the origin.
            sections.push(CriticalSection {
                what: "a fix, to stations",
                priority: priority::AIDING,
                straight: 60,
                looped: 120,
            });
        }
        sections
    }

    /// Returns the rows of a board's table for links of this baud rate.
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
        let row = |(index, entry): (usize, &RowInput)| {
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

    fn entries(&self, board: &BoardTimes, link_baud: u64) -> Vec<RowInput> {
        let tick = if board.senses { self.estimating } else { self.tick };
        let mut entries = vec![RowInput {
            name: "SysTick",
            priority: priority::TIME,
            period_ns: TICK_NS,
            instructions: self.systick,
            interrupts: 1,
            bus_ns: 0,
            // If SysTick's response is longer than a tick, the next tick is lost.
            deadline_ns: Some(TICK_NS),
        }];
        let byte = |name, rate: RateOfUart, is_heard: bool| RowInput {
            name,
            priority: priority::UART,
            period_ns: rate.byte_ns(link_baud),
            instructions: self.byte,
            interrupts: 1,
            bus_ns: 0,
            // If the interrupt of a received byte comes later, the next byte has no room. A byte to send has no
            // deadline, since the line just waits.
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
            // Each transfer has two DMA interrupts at its end and one run of the task.
            entries.push(RowInput {
                name: "sampling, with its transfers",
                priority: priority::SAMPLING,
                period_ns: TICK_NS,
                instructions: board.sampling + 2 * DMA_END * transfers,
                interrupts: 1 + 3 * transfers,
                bus_ns,
                deadline_ns: Some(TICK_NS),
            });
            let transfers = slow.iter().map(|script| script.transfers).sum::<u64>();
            entries.push(RowInput {
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
            RowInput {
                name: "control tick, with the motors' frames",
                priority: priority::CONTROL,
                period_ns: TICK_NS,
                instructions: tick + self.dshot * board.timers,
                interrupts: 1,
                bus_ns: FRAME_NS,
                // The frame must have been sent when the next tick begins.
                deadline_ns: Some(TICK_NS),
            },
            RowInput {
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
            entries.push(RowInput {
                name: "motor controllers' answers",
                priority: priority::CONTROL,
                period_ns: TICK_NS,
                instructions: (ANSWERS + DMA_END) * board.timers,
                interrupts: board.timers,
                bus_ns: SAMPLED_NS,
                deadline_ns: Some(TICK_NS),
            });
        }
        entries.extend([RowInput {
            name: "links' task",
            priority: priority::COMMS,
            period_ns: TICK_NS,
            instructions: self.wake,
            interrupts: 1,
            bus_ns: 0,
            // If the links' task comes later, tick results are dropped.
            deadline_ns: Some(QUEUE * TICK_NS),
        }]);
        entries.sort_by_key(|entry| entry.priority);
        entries
    }
}

impl CriticalSection {
    /// Returns the section's duration \[ns\].
    #[must_use]
    pub fn time_ns(&self, core: &CoreCycles, limit: CycleLimit) -> u64 {
        core.time_ns(self.straight, self.looped, limit)
    }
}
