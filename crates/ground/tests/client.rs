//! Guarantees of the client on links that lose, repeat and delay frames and carry other stations' traffic.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

mod line;

use afbc_ground::{Client, CommandState, RetryPolicy, UploadEnd};
use afbc_mavlink::{
    Address, CommandResult, Downlink, MissionItem, MissionMessage, MissionResult, MissionType, ParameterRequest,
    Uplink, VehicleCommand,
};
use line::{COMPANION, Line, OTHER_VEHICLE, VEHICLE};
use proptest::prelude::*;

const STATION: Address = Client::STATION;
/// These retries last long enough for every link in these tests.
const PATIENT: RetryPolicy = RetryPolicy { answer_ms: 600, tries: 60 };
const LONG_MS: u64 = 60_000;
/// Time after which no old frame is left on the line that could be taken for an answer to the next question \[ms\].
const UNDER_WAY_MS: u64 = 1_000;

fn items(count: u16) -> Vec<MissionItem> {
    (0..count)
        .map(|number| MissionItem { number, command: 16, x: i32::from(number), ..MissionItem::default() })
        .collect()
}

fn answer(command: VehicleCommand, answer: CommandResult, to: Address) -> Downlink {
    Downlink::CommandAck { command: command.id(), answer, to }
}

fn ack(result: MissionResult, plan: MissionType, to: Address) -> Downlink {
    Downlink::Mission { message: MissionMessage::Ack(result, plan), to }
}

/// Returns the messages that the client would send now.
fn said(client: &mut Client) -> Vec<Uplink> {
    let mut said = Vec::new();
    client.send(|message, _| said.push(*message));
    said
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// A command that counts as accepted has reached the vehicle, whatever frames are lost, repeated, late or sent by
    /// others.
    #[test]
    fn commands_get_through(seed: u64, lost in 0..40_u64, again in 0..40_u64, late_ms in 0..200_u64) {
        let mut line = Line::new(seed, [lost, again, late_ms]);
        for (count, command) in (1..).zip([VehicleCommand::Arm, VehicleCommand::Land, VehicleCommand::Arm]) {
            line.client.command(command, PATIENT);
            line.run_until(LONG_MS, |client| client.state(command) != Some(CommandState::Waiting));
            prop_assert_eq!(line.client.answer(command), Some(CommandResult::Accepted));
            prop_assert!(line.vehicle.commands.len() >= count);
            line.run_until(UNDER_WAY_MS, |_| false);
        }
    }

    /// An upload that counts as accepted has left exactly these items aboard.
    #[test]
    fn plans_get_through(
        seed: u64, lost in 0..40_u64, again in 0..40_u64, late_ms in 0..200_u64,
        counts in prop::array::uniform3(0..9_u16),
    ) {
        let mut line = Line::new(seed, [lost, again, late_ms]);
        // Upload twice: no frame of the first upload may count for the second.
        for counts in [[5, 0, 2], counts] {
            let types = [MissionType::FENCE, MissionType::RALLY, MissionType::MISSION];
            let plans = types.into_iter().zip(counts.map(items));
            line.client.upload(plans.clone(), PATIENT);
            let mut end = None;
            line.run_until(LONG_MS, |client| { end = end.or(client.take_upload_end()); end.is_some() });
            // A late repeated MISSION_COUNT starts a new upload at the vehicle, as the protocol says.
            prop_assert!(end == Some(UploadEnd::Accepted) || (again > 0 && late_ms > 0), "{:?}", end);
            for (plan, items) in plans.filter(|_| end == Some(UploadEnd::Accepted)) {
                prop_assert_eq!(line.vehicle.plan(plan), &items[..]);
            }
            prop_assert_eq!(line.client.take_upload_end(), None);
            line.run_until(UNDER_WAY_MS, |_| false);
        }
    }

    #[test]
    fn parameters_get_through(seed: u64, lost in 0..25_u64, again in 0..40_u64, late_ms in 0..200_u64, value: f32) {
        let mut line = Line::new(seed, [lost, again, late_ms]);
        line.client.read_parameters();
        line.run_until(LONG_MS, |client| !client.parameters().are_being_read());
        prop_assert!(line.client.parameters().are_complete());
        let known: Vec<_> = line.client.parameters().values().copied().collect();
        prop_assert_eq!(&known, &line.vehicle.parameters());

        line.client.set_parameter("P07", value);
        line.run_until(UNDER_WAY_MS, |_| false);
        let held = line.vehicle.parameters()[7].value;
        prop_assert!(held == value.to_le_bytes() || lost > 0);
    }

    /// The client sends exactly one heartbeat at each multiple of the period.
    #[test]
    fn heartbeats_keep_time(period_ms in 1..1_000_u64, steps_ms in prop::collection::vec(0..400_u64, 1..60)) {
        let mut client = Client::new(STATION);
        client.set_heartbeat_period(Some(period_ms));
        let (mut now_ms, mut beats) = (0, 0);
        for step_ms in steps_ms {
            let before_ms = now_ms;
            client.update(now_ms);
            let count = said(&mut client).len();
            prop_assert!(count <= 1);
            beats += count;
            now_ms += step_ms.min(period_ms);
            prop_assert!(beats as u64 <= 1 + before_ms / period_ms);
            prop_assert!(beats as u64 > before_ms / period_ms);
        }
        client.set_heartbeat_period(None);
        client.update(now_ms + 10 * period_ms);
        prop_assert_eq!(said(&mut client), []);
    }
}

/// Without any vehicle the client tries the set number of times at the set interval, and then gives up.
#[test]
fn silence_is_told() {
    let mut client = Client::new(STATION);
    let plans = [(MissionType::MISSION, items(2))];
    client.command(VehicleCommand::Land, RetryPolicy::REPEATED);
    client.upload(plans.clone(), RetryPolicy::REPEATED);
    client.command(VehicleCommand::Return, RetryPolicy::ONCE);
    let land = Uplink::Command(VehicleCommand::Land);
    let count = Uplink::Mission(MissionMessage::Count(2, MissionType::MISSION));
    let mut times = Vec::new();
    for now_ms in 0..5_000 {
        client.update(now_ms);
        times.extend(said(&mut client).into_iter().map(|message| (now_ms, message)));
        let waits = |until_ms| if now_ms < until_ms { CommandState::Waiting } else { CommandState::Silent };
        assert_eq!(client.state(VehicleCommand::Land), Some(waits(3_000)), "{now_ms}");
        assert_eq!(client.state(VehicleCommand::Return), Some(waits(3_000)), "{now_ms}");
        assert_eq!(client.take_upload_end(), (now_ms == 3_000).then_some(UploadEnd::Silent(MissionType::MISSION)));
    }
    let once = (0, Uplink::Command(VehicleCommand::Return));
    let of = |now_ms| [land, count].map(|message| (now_ms, message));
    assert_eq!(times, [&of(0)[..], &[once], &of(1_000), &of(2_000)].concat());
    // Answers that come too late, or that answer no question, change nothing.
    for command in [VehicleCommand::Land, VehicleCommand::Arm] {
        client.receive(VEHICLE, &answer(command, CommandResult::Accepted, STATION));
    }
    assert_eq!(
        (client.state(VehicleCommand::Land), client.state(VehicleCommand::Arm)),
        (Some(CommandState::Silent), None)
    );
}

/// The client requests the list until it comes, then the missing parameters, but not for ever.
#[test]
fn missing_parameters_are_asked_for() {
    let mut line = Line::new(1, [0; 3]);
    line.client.read_parameters();
    assert_eq!(said(&mut line.client), [Uplink::Parameter(ParameterRequest::List)]);
    line.client.update(1_000);
    assert_eq!(said(&mut line.client), [Uplink::Parameter(ParameterRequest::List)]);
    line.client.update(1_500);
    let all = line.vehicle.parameters();
    for value in all.iter().filter(|value| value.index % 2 == 0) {
        line.client.receive(VEHICLE, &Downlink::Parameter(*value));
    }
    line.client.update(2_499);
    assert_eq!(said(&mut line.client), []);
    line.client.update(2_500);
    let odd: Vec<_> = (1..all.len() as u16).step_by(2).take(10).collect();
    assert!(odd.len() == 10);
    assert_eq!(
        said(&mut line.client),
        odd.iter().map(|it| Uplink::Parameter(ParameterRequest::ReadIndex(*it))).collect::<Vec<_>>()
    );
    (3..60).for_each(|now_s| line.client.update(1_000 * now_s));
    assert!(!line.client.parameters().are_being_read() && !line.client.parameters().are_complete());
}

/// A command in progress is not repeated, and gets more time.
#[test]
fn what_is_in_progress_is_waited_for() {
    let mut client = Client::new(STATION);
    client.command(VehicleCommand::SelfTest, RetryPolicy::REPEATED);
    said(&mut client);
    for now_ms in (0..10_000).step_by(500) {
        client.update(now_ms);
        client.receive(VEHICLE, &answer(VehicleCommand::SelfTest, CommandResult::InProgress, STATION));
        assert_eq!(said(&mut client), [], "{now_ms}");
    }
    assert_eq!(client.state(VehicleCommand::SelfTest), Some(CommandState::Waiting));
    client.update(9_700);
    client.receive(VEHICLE, &answer(VehicleCommand::SelfTest, CommandResult::Failed, STATION));
    let failed = CommandState::Answered { answer: CommandResult::Failed, after_ms: 200 };
    assert_eq!(client.state(VehicleCommand::SelfTest), Some(failed));
    // The first final answer counts. The next command waits for its own answer.
    client.receive(VEHICLE, &answer(VehicleCommand::SelfTest, CommandResult::Accepted, STATION));
    assert_eq!(client.state(VehicleCommand::SelfTest), Some(failed));
    client.command(VehicleCommand::SelfTest, RetryPolicy::ONCE);
    assert_eq!(client.state(VehicleCommand::SelfTest), Some(CommandState::Waiting));
}

/// Answers for other stations, and answers by other vehicles, are ignored.
#[test]
fn answers_to_others_are_not_heard() {
    let mut client = Client::new(STATION);
    let beat = Downlink::Heartbeat { armed: false, failsafe: false, mode: 7 };
    // A station's own heartbeat that is sent back does not count as a vehicle's.
    assert!(client.receive(STATION, &beat) && client.vehicle().address.is_none());
    assert!(client.receive(VEHICLE, &beat));
    client.command(VehicleCommand::Arm, RetryPolicy::ONCE);
    client.upload([(MissionType::MISSION, items(1))], RetryPolicy::ONCE);
    said(&mut client);
    let request = |to| Downlink::Mission { message: MissionMessage::Request(0, MissionType::MISSION), to };
    for (from, to) in [(VEHICLE, COMPANION), (OTHER_VEHICLE, STATION)] {
        let armed = Downlink::Heartbeat { armed: true, failsafe: false, mode: 8 };
        for message in [
            answer(VehicleCommand::Arm, CommandResult::Denied, to),
            ack(MissionResult::ERROR, MissionType::MISSION, to),
            request(to),
        ] {
            assert!(!client.receive(from, &message), "{message:?}");
        }
        assert_eq!(client.receive(from, &armed), from == VEHICLE);
        assert_eq!((client.state(VehicleCommand::Arm), said(&mut client)), (Some(CommandState::Waiting), Vec::new()));
        assert_eq!((client.vehicle().armed, client.vehicle().mode), (true, 8));
        assert_eq!(client.take_upload_end(), None);
        client.receive(VEHICLE, &beat);
        client.receive(VEHICLE, &armed);
    }
    assert!(client.receive(VEHICLE, &request(STATION)));
    assert_eq!(said(&mut client), [Uplink::Mission(MissionMessage::Item(items(1)[0], MissionType::MISSION))]);
    assert!(client.receive(VEHICLE, &answer(VehicleCommand::Arm, CommandResult::Refused(3), STATION)));
    assert_eq!(client.answer(VehicleCommand::Arm), Some(CommandResult::Refused(3)));
}

/// A refusal ends the upload, including the plans that would follow. An acknowledgement before all items were requested
/// does not count.
#[test]
fn refused_plans_end_the_upload() {
    let mut client = Client::new(STATION);
    client.upload([(MissionType::FENCE, items(2)), (MissionType::MISSION, items(1))], RetryPolicy::ONCE);
    said(&mut client);
    client.receive(VEHICLE, &ack(MissionResult::ACCEPTED, MissionType::FENCE, STATION));
    client.receive(VEHICLE, &ack(MissionResult::ERROR, MissionType::MISSION, STATION));
    // The first request has an unknown item number; the second names a plan that is not being uploaded.
    for message in [MissionMessage::Request(2, MissionType::FENCE), MissionMessage::Request(0, MissionType::MISSION)] {
        client.receive(VEHICLE, &Downlink::Mission { message, to: STATION });
    }
    assert_eq!((said(&mut client), client.take_upload_end()), (Vec::new(), None));
    client.receive(VEHICLE, &ack(MissionResult::NO_SPACE, MissionType::FENCE, STATION));
    assert_eq!(client.take_upload_end(), Some(UploadEnd::Refused(MissionType::FENCE, MissionResult::NO_SPACE)));
    assert_eq!(said(&mut client), []);
}
