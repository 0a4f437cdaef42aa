//! Tests the exact log on a link of varying speed, with a task that is late by some ticks. The log is complete, or
//! lacks whole ticks and shows where the gap begins.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

use afbc_log::exact::{FRAME_MAX, Frames, Given, Record, RecordQueue, ReplayDifference, ReplayStep, Replayer, write};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{
    Aged, Configuration, ControlInputs, Flight, Prepared, Readings, Report, TickDetails, TickInputs, TickRecord,
};
use afbc_store::RecordName;
use afbc_types::{Pose, PoseSigmas, Stamped, State};
use nalgebra::Vector3;
use proptest::prelude::*;
use std::collections::VecDeque;

/// Number of ticks that wait for the links' task, as in the firmware.
const WAITING: usize = 8;
/// Bytes of the link's ring.
const RING: usize = 1024;

/// Events in a tick.
#[derive(Clone, Copy, Debug)]
struct Happens {
    /// True if the links' task runs.
    task: bool,
    /// Number of bytes that leave the link's ring.
    drains: usize,
    /// Number of messages with inputs.
    inputs: u8,
    /// True if a parameter is changed.
    change: bool,
}

fn happens() -> impl Strategy<Value = Happens> {
    let task = prop_oneof![9 => Just(true), 1 => Just(false)];
    (task, 0_usize..400, 0_u8..3, prop::bool::weighted(0.02)).prop_map(|(task, drains, inputs, change)| Happens {
        task,
        drains,
        inputs,
        change,
    })
}

/// A vehicle, and the part of its log that the link has sent.
struct Vehicle {
    flight: Flight,
    table: ParameterTable,
    queue: RecordQueue,
    ticks: VecDeque<(Report, TickDetails)>,
    ring: VecDeque<u8>,
    log: Vec<u8>,
    /// Inputs from messages for the next tick, and its number.
    mail: ControlInputs,
    number: u32,
    /// The configuration to fly, and the number of the configuration that the next tick is the first to fly.
    next: Option<(Prepared, u16)>,
    adopted: Option<u16>,
}

impl Vehicle {
    fn new() -> Self {
        let configuration = Configuration::default();
        let table = ParameterTable::new(configuration.clone());
        let mut queue = RecordQueue::default();
        queue.start(["paper", "afbc"], &table);
        let flight = Flight::new(&configuration).unwrap();
        let (ticks, ring, log, mail) = (VecDeque::new(), VecDeque::new(), Vec::new(), ControlInputs::EMPTY);
        Vehicle { flight, table, queue, ticks, ring, log, mail, number: 0, next: None, adopted: None }
    }

    fn tick(&mut self, what: Happens) {
        let (number, time_us) = (self.number, 1000 * u64::from(self.number + 1));
        self.number += 1;
        let noise = 1e-3 * (number % 7) as f32;
        let imu = Some(Aged { value: [Vector3::new(0.0, noise, 0.0), Vector3::new(noise, 0.0, 9.81)], age_us: 0 });
        let readings = Readings { imu, ..Readings::NONE };
        let mut taken = ControlInputs::EMPTY;
        self.mail.take_into(&mut taken);
        let report = self.flight.tick(time_us, &mut taken, &readings);
        let inputs = TickInputs { number, time_us, readings, adopted: self.adopted.take(), ..TickInputs::default() };
        if self.ticks.len() < WAITING {
            self.ticks.push_back((report, TickDetails { inputs, ..TickDetails::default() }));
        }
        if let Some((prepared, configuration)) = self.next.take() {
            self.adopted = self.flight.adopt(&prepared).then_some(configuration);
        }
        if what.task {
            self.task(what, time_us);
        }
        let leaves = what.drains.min(self.ring.len());
        self.log.extend(self.ring.drain(..leaves));
    }

    /// Runs the links' task.
    fn task(&mut self, what: Happens, time_us: u64) {
        for message in 0..what.inputs {
            let mut news = ControlInputs::EMPTY;
            let position_m = Vector3::new(0.01 * f32::from(message), 1e-3 * (time_us / 1000 % 11) as f32, 0.0);
            let pose = Pose { position_m, ..Pose::of(&State::default(), PoseSigmas::UNKNOWN) };
            news.inbox.put_pose(Stamped { value: pose, at_us: time_us });
            self.mail.merge(&news);
            self.queue.inputs(self.number, &news);
        }
        // Parameters are changed only after the first ticks are recorded.
        if what.change && self.number > 2 * WAITING as u32 {
            let name = RecordName::new("EST_GATE").unwrap();
            let value = self.table.set(name, 3.0 + (self.number % 5) as f32).unwrap().value;
            let configuration = self.queue.change(&self.table, RecordChange::Set(name, Some(value)));
            self.next = Some((Prepared::new(self.table.configuration()).unwrap(), configuration));
        }
        while let Some((report, details)) = self.ticks.pop_front() {
            self.queue.tick(&TickRecord { report: &report, details: &details });
        }
        let ring = &mut self.ring;
        self.queue.send(&mut |frame| {
            let fits = ring.len() + frame.len() <= RING;
            ring.extend(if fits { frame } else { &[] });
            fits
        });
    }

    /// Sends everything that waits, and returns the log.
    fn end(mut self) -> Vec<u8> {
        self.log.extend(self.ring.drain(..));
        let log = &mut self.log;
        self.queue.send(&mut |frame| {
            log.extend(frame);
            true
        });
        self.log
    }
}

/// Replays a log. Returns the number of matching ticks, and the first difference.
fn replay(log: &[u8]) -> (u32, Option<ReplayDifference>) {
    let mut replayer = Replayer::new(Configuration::default()).unwrap();
    let mut frames = Frames::default();
    let (mut same, mut first) = (0, None);
    for record in log.iter().filter_map(|byte| frames.take(*byte)) {
        match replayer.take(&record) {
            ReplayStep::Nothing => (),
            ReplayStep::Same(_) => same += 1,
            ReplayStep::Differs(difference, _) => {
                first.get_or_insert(difference);
            }
        }
    }
    assert_eq!(frames.damaged(), 0);
    (same, first)
}

/// Returns the number of the first tick before `end` that the log lacks.
fn first_missing(log: &[u8], end: u32) -> Option<u32> {
    let mut frames = Frames::default();
    let mut there = vec![false; end as usize];
    for record in log.iter().filter_map(|byte| frames.take(*byte)) {
        if let Record::Tick(tick, _) = record {
            there[tick.number as usize] = true;
        }
    }
    there.iter().position(|is_there| !is_there).map(|place| place as u32)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn it_is_whole_or_says_from_where_on_not(steps in prop::collection::vec(happens(), 50..900)) {
        let mut vehicle = Vehicle::new();
        steps.iter().for_each(|what| vehicle.tick(*what));
        // Gives the link room again, so that an earlier gap shows.
        (0..5).for_each(|_| vehicle.tick(Happens { task: true, drains: 10_000, inputs: 0, change: false }));
        let ticks = vehicle.number;
        let log = vehicle.end();
        let missing = first_missing(&log, ticks);
        let (same, difference) = replay(&log);
        prop_assert_eq!(same, missing.unwrap_or(ticks));
        let told = difference.map(|difference| match difference {
            ReplayDifference::Missing(number) => number,
            other => panic!("{other:?}"),
        });
        prop_assert_eq!(told, missing);
    }
}

/// A link that is fast enough gets the whole log, even if the task is late by as many ticks as can wait.
#[test]
fn a_link_that_keeps_up_has_all_of_it() {
    let mut vehicle = Vehicle::new();
    for number in 0..3_000_u32 {
        let task = number % 200 >= WAITING as u32 - 1;
        vehicle.tick(Happens { task, drains: 600, inputs: (number % 3) as u8, change: number % 700 == 3 });
    }
    let ticks = vehicle.number;
    assert_eq!(replay(&vehicle.end()), (ticks, None));
}

/// A link that takes nothing for a long time gets later ticks once it is back, each with its inputs.
#[test]
fn a_link_that_comes_back_has_later_ticks() {
    let mut vehicle = Vehicle::new();
    let quiet = Happens { task: true, drains: 0, inputs: 1, change: false };
    (0..50).for_each(|_| vehicle.tick(Happens { drains: 1_000, ..quiet }));
    (0..5_000).for_each(|_| vehicle.tick(quiet));
    (0..50).for_each(|_| vehicle.tick(Happens { drains: 1_000, ..quiet }));
    let ticks = vehicle.number;
    let log = vehicle.end();
    let missing = first_missing(&log, ticks).unwrap();
    assert!((50..200).contains(&missing), "{missing}");
    assert_eq!(replay(&log), (missing, Some(ReplayDifference::Missing(missing))));
    let mut frames = Frames::default();
    let last = log.iter().filter_map(|byte| frames.take(*byte)).filter_map(|record| match record {
        Record::Tick(tick, _) => Some(tick.number),
        _ => None,
    });
    assert_eq!(last.last(), Some(ticks - 1));
}

/// A call to the queue.
#[derive(Clone, Copy, Debug)]
enum Asked {
    Inputs(u8),
    Tick(u8),
    /// The link takes this many frames, and then refuses.
    Takes(usize),
    /// The link refuses this many times.
    Refuses(u16),
}

fn asked() -> impl Strategy<Value = Asked> {
    prop_oneof![
        8 => (0..4_u8).prop_map(Asked::Inputs),
        8 => (0..4_u8).prop_map(Asked::Tick),
        4 => (0..12_usize).prop_map(Asked::Takes),
        1 => (1..700_u16).prop_map(Asked::Refuses),
        1 => Just(Asked::Refuses(1_000)),
    ]
}

/// Model of the queue as documented: it holds a kilobyte of whole frames. If a frame does not fit, or is refused a
/// thousand times in a row, all frames up to the end of the next tick are dropped.
#[derive(Default)]
struct Described {
    waiting: VecDeque<Vec<u8>>,
    lacks: bool,
    refused: u16,
}

impl Described {
    fn append(&mut self, frame: Vec<u8>) {
        let length: usize = self.waiting.iter().map(Vec::len).sum();
        if length + frame.len() > 1024 {
            self.lacks = true;
        } else {
            self.waiting.push_back(frame);
        }
    }

    fn tick(&mut self, frame: Vec<u8>) {
        if !std::mem::take(&mut self.lacks) {
            self.append(frame);
            self.lacks = false;
        }
    }

    fn send(&mut self, takes: usize) -> Vec<u8> {
        let mut sent = Vec::new();
        for k in 0.. {
            let Some(frame) = self.waiting.front() else { break };
            if k < takes {
                sent.extend(frame);
                self.refused = 0;
            } else if self.refused < 1_000 {
                self.refused += 1;
                break;
            } else {
                (self.refused, self.lacks) = (0, true);
            }
            self.waiting.pop_front();
        }
        sent
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// The queue sends the same whole frames as its model.
    #[test]
    fn it_is_a_queue_of_a_kilobyte(steps in prop::collection::vec(asked(), 1..200)) {
        let (mut queue, mut described, mut number) = (RecordQueue::default(), Described::default(), 0);
        let mut flight = Flight::<4>::new(&Configuration::default()).unwrap();
        let idle = flight.tick(1_000, &mut ControlInputs::EMPTY.clone(), &Readings::NONE);
        let frame = |record: &Record| write(record, &mut [0; FRAME_MAX]).unwrap().to_vec();
        for step in steps {
            let (takes, times) = match step {
                Asked::Inputs(size) => {
                    let mut inputs = ControlInputs::EMPTY;
                    inputs.inbox.set_idle_on_ground(true);
                    let pose = Pose::of(&State::default(), PoseSigmas::UNKNOWN);
                    (0..size.min(1)).for_each(|_| inputs.inbox.put_pose(Stamped { value: pose, at_us: 1 }));
                    inputs.order().heard_us = (size > 2).then_some(u64::MAX);
                    queue.inputs(number, &inputs);
                    described.append(frame(&Record::Inputs { tick: number, inputs }));
                    (0, 0)
                }
                Asked::Tick(size) => {
                    let time_us = u64::MAX >> (14 * size);
                    let inputs = TickInputs { number, time_us, ..TickInputs::default() };
                    number += 1;
                    let details = TickDetails { inputs, ..TickDetails::default() };
                    queue.tick(&TickRecord { report: &idle, details: &details });
                    described.tick(frame(&Record::Tick(inputs, Given::of(&idle))));
                    (0, 0)
                }
                Asked::Takes(takes) => (takes, 1),
                Asked::Refuses(times) => (0, times),
            };
            for _ in 0..times {
                let (mut sent, mut taken) = (Vec::<u8>::new(), 0);
                queue.send(&mut |frame| {
                    let takes = taken < takes;
                    taken += 1;
                    assert!(frame.iter().filter(|byte| **byte == 0).eq([&0]) && frame.ends_with(&[0]));
                    sent.extend(if takes { frame } else { &[] });
                    takes
                });
                prop_assert_eq!(sent, described.send(takes));
            }
        }
    }
}
