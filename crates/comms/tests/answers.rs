//! Every command is answered to its sender.

use crate::common::{Bench, STATION};
use afbc::Trip;
use afbc_comms::{ANSWERS_MAX, ANSWERS_PER_TICK, BUSY, Comms, FORGOTTEN_US, NOT_IN_CONTROL, Setup};
use afbc_flight_core::inbox::QUEUE_MAX;
use afbc_flight_core::{EndReason, Mode, Refusal, Request};
use afbc_mavlink::{
    Address, CommandResult, Downlink, Encoder, FRAME_MAX, MavSeverity, StatusText, Uplink, VehicleCommand,
};
use afbc_onboard::Report;
use afbc_types::{Axis, State};
use proptest::prelude::*;

const STATIONS: [Address; 3] = [STATION, Address { system: 254, component: 1 }, Address { system: 1, component: 191 }];

/// An answer: command, result, receiver.
type Told = (u16, CommandResult, Address);

fn answers(said: &[Downlink]) -> Vec<Told> {
    let answer = |message: &Downlink| match *message {
        Downlink::CommandAck { command, answer, to } => Some((command, answer, to)),
        _ => None,
    };
    said.iter().filter_map(answer).collect()
}

/// Returns all answers of the next `ticks` ticks without input.
fn listen(bench: &mut Bench, ticks: usize) -> Vec<Told> {
    (0..ticks).flat_map(|_| answers(&bench.step().1)).collect()
}

fn texts(said: &[Downlink]) -> Vec<StatusText> {
    let text = |message: &Downlink| match message {
        Downlink::Text { text, .. } => Some(*text),
        _ => None,
    };
    said.iter().filter_map(text).collect()
}

/// Returns the expected answer of a vehicle that has just been switched on. The first station that asks to arm or
/// engage takes control.
fn expected(command: VehicleCommand, from: Address, holder: &mut Option<Address>) -> CommandResult {
    if matches!(command, VehicleCommand::Arm | VehicleCommand::Engage) && *holder.get_or_insert(from) != from {
        return CommandResult::Refused(NOT_IN_CONTROL);
    }
    match command {
        VehicleCommand::Arm => CommandResult::Refused(Refusal::StateStale as i32),
        VehicleCommand::Engage => CommandResult::Refused(Refusal::NotArmed as i32),
        VehicleCommand::Disarm | VehicleCommand::Kill => CommandResult::Accepted,
        VehicleCommand::Denied(_) => CommandResult::Denied,
        _ => CommandResult::Unsupported,
    }
}

fn is_request(command: VehicleCommand) -> bool {
    !matches!(command, VehicleCommand::Denied(_) | VehicleCommand::Other(_))
}

fn commands() -> impl Strategy<Value = VehicleCommand> {
    prop_oneof![
        Just(VehicleCommand::Arm),
        Just(VehicleCommand::Disarm),
        Just(VehicleCommand::Engage),
        Just(VehicleCommand::Denied(400)),
        any::<u16>().prop_filter("not ours", |id| !VehicleCommand::KNOWN.contains(id)).prop_map(VehicleCommand::Other),
    ]
}

fn sorted(mut reported: Vec<Told>) -> Vec<Told> {
    reported.sort_by_key(|reported| format!("{reported:?}"));
    reported
}

proptest! {
    /// Several stations send any commands, any number of them in one tick.
    #[test]
    fn every_sender_is_answered(
        asked in prop::collection::vec(
            prop::collection::vec((commands(), prop::sample::select(STATIONS.as_slice())), 0..12),
            1..20,
        ),
    ) {
        let mut bench = Bench::new();
        let (mut reported, mut due, mut holder) = (Vec::new(), Vec::new(), None);
        for tick in asked {
            // The flight core answers one request per tick. Of all other answers three are sent per tick.
            prop_assert!(answers(&bench.step().1).is_empty());
            let (mut requests, mut all) = (0, 0);
            for (command, from) in tick {
                requests += usize::from(is_request(command));
                if requests < QUEUE_MAX || !is_request(command) {
                    bench.hear_from(from, Uplink::Command(command));
                    due.push((command.id(), expected(command, from, &mut holder), from));
                    all += 1;
                }
            }
            reported.extend(listen(&mut bench, QUEUE_MAX + all / ANSWERS_PER_TICK));
        }
        prop_assert_eq!(sorted(reported), sorted(due));
    }

    /// Too many commands arrive. Commands that cannot be carried out are refused; those that cannot be answered either
    /// are counted. No command is lost, and at least as many are answered as the queue has room for.
    #[test]
    fn every_command_is_answered_or_counted(
        asked in prop::collection::vec((commands(), prop::sample::select(STATIONS.as_slice())), 0..200),
    ) {
        let mut bench = Bench::new();
        for (command, from) in &asked {
            bench.hear_from(*from, Uplink::Command(*command));
        }
        let (mut reported, mut unanswered) = (0, 0.0);
        for _ in 0..200 {
            let (_, said) = bench.step();
            prop_assert!(answers(&said).len() <= 1 + ANSWERS_PER_TICK);
            reported += answers(&said).len();
            for message in said {
                if let Downlink::Health(health) = message {
                    unanswered = f64::from(health.unanswered);
                }
            }
        }
        prop_assert_eq!(reported + unanswered as usize, asked.len());
        prop_assert!(reported >= asked.len().min(ANSWERS_MAX));
    }

    /// An interval in a burst of commands is set if and only if the command is accepted.
    #[test]
    fn nothing_is_done_without_an_answer(
        burst in prop::collection::vec(
            prop_oneof![
                2 => any::<u16>()
                    .prop_filter("not ours", |id| !VehicleCommand::KNOWN.contains(id))
                    .prop_map(VehicleCommand::Other),
                1 => (10_000..50_000_i32).prop_map(|interval_us| {
                    VehicleCommand::SetInterval { message: afbc_comms::services::streams::id::ATTITUDE, interval_us }
                }),
            ],
            0..150,
        ),
    ) {
        let mut bench = Bench::new();
        bench.step();
        burst.iter().for_each(|command| bench.hear(Uplink::Command(*command)));
        let answers = listen(&mut bench, 150);
        let is_accepted = |id, answer| (id, answer) == (511, CommandResult::Accepted);
        let accepted = answers.iter().filter(|(id, answer, _)| is_accepted(*id, *answer)).count();
        let set = burst.iter().filter_map(|command| match command {
            VehicleCommand::SetInterval { interval_us, .. } => Some(*interval_us),
            _ => None,
        });
        // The first commands are accepted. Later ones find the queue full.
        let last = set.take(accepted).last().unwrap_or(20_000);
        bench.hear(Uplink::Command(VehicleCommand::GetInterval(afbc_comms::services::streams::id::ATTITUDE)));
        let interval = (0..5).flat_map(|_| bench.step().1).find_map(|message| match message {
            Downlink::Interval(interval) => Some(interval.interval_us),
            _ => None,
        });
        prop_assert_eq!(interval, Some(last));
    }
}

/// A command that is repeated in a burst is answered once per repetition.
#[test]
fn a_burst_of_one_command_is_answered_each_time() {
    for count in [32, 33, 60, 500] {
        let mut bench = Bench::new();
        bench.step();
        let set =
            VehicleCommand::SetInterval { message: afbc_comms::services::streams::id::ATTITUDE, interval_us: 100_000 };
        (0..count).for_each(|_| bench.hear(Uplink::Command(set)));
        assert_eq!(listen(&mut bench, 200), vec![(511, CommandResult::Accepted, STATION); count]);
    }
}

#[test]
fn two_commands_of_one_tick_are_answered_to_their_senders() {
    let mut bench = Bench::new();
    let [first, second, third] = STATIONS;
    bench.hear_from(first, Uplink::Command(VehicleCommand::Disarm));
    bench.hear_from(second, Uplink::Command(VehicleCommand::Arm));
    bench.hear_from(third, Uplink::Command(VehicleCommand::Other(60_000)));
    bench.hear_from(first, Uplink::Command(VehicleCommand::Denied(400)));
    assert_eq!(
        sorted(listen(&mut bench, 2)),
        sorted(vec![
            (400, CommandResult::Accepted, first),
            (400, CommandResult::Refused(Refusal::StateStale as i32), second),
            (60_000, CommandResult::Unsupported, third),
            (400, CommandResult::Denied, first),
        ])
    );
    assert_eq!(listen(&mut bench, 1000), []);
}

/// Any command number is answered, unless the command is addressed to another system or component.
#[test]
fn every_command_number_is_answered_unless_addressed_to_others() {
    let mut bench = Bench::new();
    for id in (0..=u16::MAX).step_by(7).filter(|id| !VehicleCommand::KNOWN.contains(id)) {
        let sent =
            Encoder::new(STATION).send(&Uplink::Command(VehicleCommand::Other(id)), &mut [0; FRAME_MAX]).to_vec();
        let to = |system, component| {
            let mut payload = sent[10..sent.len() - 2].to_vec();
            payload.resize(33, 0);
            payload[30..32].copy_from_slice(&[system, component]);
            let mut frame = [&[0xFD, 33, 0, 0, 0, 255, 190, 76, 0, 0], payload.as_slice()].concat();
            frame.extend_from_slice(&crc(&frame[1..], 152).to_le_bytes());
            frame
        };
        for (system, component, mine) in [(0, 0, true), (1, 1, true), (1, 0, true), (2, 1, false), (1, 2, false)] {
            bench.hear_bytes(&to(system, component));
            let expected = if mine { vec![(id, CommandResult::Unsupported, STATION)] } else { vec![] };
            assert_eq!(listen(&mut bench, 1), expected);
        }
    }
}

/// CRC-16/MCRF4XX.
fn crc(bytes: &[u8], extra: u8) -> u16 {
    bytes.iter().chain([&extra]).fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0x8408 } else { crc >> 1 })
    })
}

/// In flight a plain disarm command is refused with the reason, and a forced one stops the motors.
#[test]
fn only_the_forced_one_disarms_in_flight() {
    let mut bench = Bench::flying();
    bench.hear(Uplink::Command(VehicleCommand::Disarm));
    let (report, said) = bench.tick(&State::default());
    assert!(report.mode.armed());
    assert_eq!(answers(&said), [(400, CommandResult::Refused(Refusal::InFlight as i32), STATION)]);
    assert_eq!(texts(&said), [StatusText::from(Refusal::InFlight.reason())]);
    bench.hear(Uplink::Command(VehicleCommand::Kill));
    let (report, said) = bench.tick(&State::default());
    assert_eq!((report.mode, report.ended), (Mode::Disarmed, Some(EndReason::Killed)));
    assert_eq!(answers(&said), [(400, CommandResult::Accepted, STATION)]);
}

/// Every refusal of the flight core is sent with its number and its text.
#[test]
fn every_refusal_is_reported_with_its_reason() {
    for request in [Request::Arm, Request::Disarm, Request::Engage] {
        for refusal in Refusal::ALL {
            let mut bench = Bench::new();
            let (idle, _) = bench.step();
            let (command, id) = match request {
                Request::Engage => (VehicleCommand::Engage, 31_010),
                Request::Disarm => (VehicleCommand::Disarm, 400),
                _ => (VehicleCommand::Arm, 400),
            };
            bench.hear(Uplink::Command(command));
            bench.inputs.take_into(&mut bench.taken);
            let asked = bench.taken.inbox.asked().expect("asked");
            assert_eq!(asked.value, request);
            let answer = afbc_flight_core::RequestAnswer { ticket: asked.ticket, request, result: Err(refusal) };
            let said = bench.said(&Report { answer: Some(answer), ..idle });
            assert_eq!(answers(&said), [(id, CommandResult::Refused(refusal as i32), STATION)]);
            assert_eq!(texts(&said), [StatusText::from(refusal.reason())]);
        }
    }
    assert!(Refusal::ALL.iter().all(|refusal| *refusal as i32 != BUSY));
}

/// A command to stop the motors is accepted even if the request queue is full.
#[test]
fn a_kill_is_always_accepted() {
    let mut bench = Bench::new();
    for _ in 0..20 {
        bench.hear(Uplink::Command(VehicleCommand::Arm));
    }
    let [_, second, third] = STATIONS;
    bench.hear_from(second, Uplink::Command(VehicleCommand::Kill));
    bench.hear_from(third, Uplink::Command(VehicleCommand::Kill));
    assert!(bench.inputs.inbox.kills());
    let reported = listen(&mut bench, 30);
    assert_eq!(reported.len(), 22);
    let of = |answer| reported.iter().filter(|reported| **reported == (400, answer, STATION)).count();
    assert_eq!(of(CommandResult::Refused(BUSY)), 20 - (QUEUE_MAX - 1));
    assert_eq!(
        of(CommandResult::Refused(Refusal::Overtaken as i32)) + of(CommandResult::Refused(Refusal::StateStale as i32)),
        QUEUE_MAX - 1
    );
    assert!(
        reported.contains(&(400, CommandResult::Accepted, second))
            && reported.contains(&(400, CommandResult::Accepted, third))
    );
}

/// If the link falls behind, reports are dropped. Requests answered in such reports fail, and their tickets become free
/// again.
#[test]
fn requests_whose_tick_went_unreported_fail() {
    let mut bench = Bench::new();
    for _ in 0..3 {
        for _ in 0..QUEUE_MAX - 1 {
            bench.hear(Uplink::Command(VehicleCommand::Disarm));
        }
        for _ in 0..QUEUE_MAX {
            bench.now_us += 1000;
            bench.inputs.take_into(&mut bench.taken);
            bench.flight.tick(bench.now_us, &mut bench.taken, &afbc_onboard::Readings::NONE);
        }
        let reported = listen(&mut bench, FORGOTTEN_US as usize / 1000 + 10);
        assert_eq!(reported, [(400, CommandResult::Failed, STATION); QUEUE_MAX - 1]);
    }
    bench.hear(Uplink::Command(VehicleCommand::Disarm));
    assert_eq!(listen(&mut bench, 2), [(400, CommandResult::Accepted, STATION)]);
}

/// The largest possible output of a tick fits and is sent completely, as [`Bench::said`] checks.
#[test]
fn the_largest_output_of_a_tick_is_sent_completely() {
    let mut bench = Bench::new();
    // On a slower link texts would have to wait.
    bench.comms = Comms::with(Setup { bytes_per_s: 1_000_000, ..Setup::default() });
    let (idle, _) = bench.tick(&State::default());
    let answer = afbc_flight_core::RequestAnswer { ticket: 1, request: Request::Arm, result: Err(Refusal::Unhealthy) };
    for round in 0..2000 {
        bench.now_us += 1000;
        bench.measure(&State::default());
        for _ in 0..5 {
            bench.hear(Uplink::Command(VehicleCommand::Other(u16::MAX)));
        }
        bench.hear(Uplink::Command(VehicleCommand::Arm));
        let odd = round % 2 == 1;
        let mode = if odd { Mode::Coasting } else { Mode::Disarmed };
        let ended = odd.then_some(EndReason::StateLost);
        let mut report = Report { mode, ended, answer: Some(answer), time_us: bench.now_us, ..idle };
        report.health.control.fallback = odd.then_some(Trip::Theta(Axis::Pitch).reason());
        report.health.rate.clock_failed = odd;
        report.motors.0.fill(1.234);
        let said = bench.said(&report);
        let severe = |message: &&Downlink| {
            matches!(message, Downlink::Text { severity: MavSeverity::MAV_SEVERITY_EMERGENCY, .. })
        };
        assert_eq!(said.iter().filter(severe).count(), usize::from(odd));
        assert_eq!(texts(&said).len(), if odd { 5 } else { 1 });
    }
}
