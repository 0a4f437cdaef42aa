//! A trip on the link: its reason once, and the command that gives the flight back to AFBC.
#![allow(clippy::expect_used, reason = "a test that cannot go on should say why")]

use afbc::monitor::Trip;
use airframe::{Axis, Setpoint, State};
use link::{Address, Answer, Command, Decoder, Downlink, FRAME_MAX, MavCmd, Sender, Text, Uplink};
use onboard::{Comms, Flight, Report};
use vehicle::{Inbox, Mode, Request};

const STATION: Address = Address { system: 255, component: 190 };

/// The firmware, and the station that talks to it.
struct Bench {
    flight: Flight,
    comms: Comms,
    inbox: Inbox,
    sender: Sender,
    decoder: Decoder<Downlink>,
    now_us: u64,
}

impl Bench {
    fn new() -> Self {
        Bench {
            flight: Flight::new().expect("valid"),
            comms: Comms::new(),
            inbox: Inbox::default(),
            sender: Sender::new(STATION),
            decoder: Decoder::new(STATION),
            now_us: 0,
        }
    }

    fn hear(&mut self, message: Uplink) {
        let news = self.comms.receive(self.sender.send(&message, &mut [0; FRAME_MAX]));
        self.inbox.post(&news);
    }

    /// What is said after a tick that is reported so.
    fn said(&mut self, report: &Report) -> Vec<Downlink> {
        let mut messages = Vec::new();
        let Bench { comms, decoder, .. } = self;
        comms.report(report, 0, |bytes| decoder.feed(bytes, |_, message| messages.push(message)));
        messages
    }

    /// A tick with this state measured in it; returns its report, and what was said of answers and texts.
    fn tick(&mut self, state: &State) -> (Report, Vec<Downlink>) {
        self.now_us += 1000;
        // No tracker says the same twice.
        let mut state = *state;
        state.position_m.z += (self.now_us % 1_000_000) as f32 * 1e-12;
        self.hear(Uplink::State { sent_us: self.now_us, state });
        self.hear(Uplink::Setpoint(Setpoint::default()));
        let report = self.flight.tick(self.now_us, &self.inbox.take());
        let mut said = self.said(&report);
        said.retain(|message| matches!(message, Downlink::Answer { .. } | Downlink::Text(_)));
        (report, said)
    }
}

fn text(trip: Trip) -> Downlink {
    Downlink::Text(Text::from(trip.reason()))
}

fn accepted(command: MavCmd) -> Downlink {
    Downlink::Answer { command, answer: Answer::Accepted, to: STATION }
}

/// The whole way: a vehicle that is held askew trips, says so once, and is given back by MAV_CMD_USER_1.
#[test]
fn a_trip_is_told_once_and_ended_by_command() {
    let mut bench = Bench::new();
    for _ in 0..1001 {
        bench.tick(&State::default());
    }
    bench.hear(Uplink::Command(Command::Arm));
    let (report, said) = bench.tick(&State::default());
    assert_eq!((report.mode, said), (Mode::Flying, vec![accepted(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM)]));

    let mut askew = State::default();
    askew.attitude_rad.x = 1.2;
    let mut told = Vec::new();
    let mut trip = None;
    for _ in 0..10_000 {
        let (report, said) = bench.tick(&askew);
        told.extend(said);
        trip = report.health.control.trip;
    }
    let trip = trip.expect("ten seconds on its side");
    assert_eq!(told, [text(trip)]);

    bench.hear(Uplink::Command(Command::Engage));
    let (report, said) = bench.tick(&State::default());
    assert_eq!(report.answer.map(|answer| (answer.request, answer.result)), Some((Request::Engage, Ok(()))));
    assert_eq!(report.health.control.trip, None);
    assert_eq!(said, [accepted(MavCmd::MAV_CMD_USER_1)]);
    let (report, said) = bench.tick(&State::default());
    assert_eq!((report.health.control.trip, said), (None, vec![]), "AFBC flies");
}

/// Told again only if it trips again: not when states come back after a gap.
#[test]
fn a_gap_in_the_states_does_not_repeat_it() {
    let mut bench = Bench::new();
    let (idle, _) = bench.tick(&State::default());
    let trip = Trip::Theta(Axis::Roll);
    let mut says = |mode, trip| {
        let mut report = Report { mode, ..idle };
        report.health.control.trip = trip;
        bench.said(&report).into_iter().filter(|message| matches!(message, Downlink::Text(_))).count()
    };
    assert_eq!(says(Mode::Flying, None), 0);
    assert_eq!(says(Mode::Flying, Some(trip)), 1);
    assert_eq!(says(Mode::Flying, Some(trip)), 0);
    assert_eq!(says(Mode::Riding, None), 0);
    assert_eq!(says(Mode::Flying, Some(trip)), 0);
    assert_eq!(says(Mode::Flying, None), 0);
    assert_eq!(says(Mode::Flying, Some(trip)), 1);
}
