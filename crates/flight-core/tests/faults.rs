//! Tests of a link that drops, delays, corrupts or reorders frames, one fault per case: MAVLink frames pass through
//! decoder and tick. The vehicle rests at its setpoint; other tests close the loop.

use afbc::{Adaptive, Controller, Profile};
use afbc_flight_core::{
    ArmingLimits, FlightCore, FlightCoreMemory, Inbox, Mode, Refusal, Request, RequestAnswer, Stamped, Ticketed,
    Tracker,
};
use afbc_mavlink::{Address, Counters, Decoder, Encoder, FRAME_MAX, Uplink, VehicleCommand};
use afbc_types::{Parameters, PoseSigmas, RotorSpeeds, Setpoint, State};

const STATION: Address = Address { system: 255, component: 190 };
const VEHICLE: Address = Address { system: 1, component: 1 };

/// Times of arming, of the fault, and of the end \[ms since power-up\].
const ARM_MS: u64 = 1_050;
const FAULT_MS: u64 = 1_800;
const END_MS: u64 = FAULT_MS + 4_000;

/// A frame in transit.
#[derive(Clone)]
struct Frame {
    /// Time of arrival, from the start of the fault \[ms\].
    at_ms: i64,
    kind: Kind,
    bytes: Vec<u8>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    State,
    Setpoint,
    Command,
}

/// Returns the frames of an undisturbed flight: a state per millisecond, a setpoint every 100 ms, one command.
fn flight() -> Vec<Frame> {
    let mut sender = Encoder::new(STATION);
    let mut frames = Vec::new();
    for ms in 0..END_MS {
        let mut push = |kind, message| {
            let bytes = sender.send(&message, &mut [0; FRAME_MAX]).to_vec();
            frames.push(Frame { at_ms: ms as i64 - FAULT_MS as i64, kind, bytes });
        };
        if ms % 100 == 0 {
            push(Kind::Setpoint, Uplink::Setpoint(Setpoint::default()));
        }
        // The sender's clock is 7 s ahead.
        push(
            Kind::State,
            Uplink::State { sent_us: 7_000_000 + ms * 1000, state: standing(ms), sigmas: PoseSigmas::UNKNOWN },
        );
        if ms == ARM_MS {
            push(Kind::Command, Uplink::Command(VehicleCommand::Arm));
        }
    }
    frames
}

/// State of a vehicle at rest with a tracker's noise.
fn standing(ms: u64) -> State {
    let mut state = State::default();
    state.position_m.z = (ms * 7919 % 1000) as f32 * 1e-8;
    state
}

/// Returns a frame with a message from the station.
fn frame(at_ms: i64, message: Uplink) -> Frame {
    let bytes = Encoder::new(Address { component: 1, ..STATION }).send(&message, &mut [0; FRAME_MAX]).to_vec();
    Frame { at_ms, kind: Kind::Command, bytes }
}

/// Result of a case, from the start of the fault.
#[derive(Debug, Default)]
struct Seen {
    /// Start of each mode \[ms\].
    modes: Vec<(i64, Mode)>,
    counters: Counters,
    answers: Vec<Result<Request, Refusal>>,
    setpoint_stale: bool,
}

/// Plays the frames at their times. Frames of the same millisecond keep their order.
fn play(mut frames: Vec<Frame>) -> Seen {
    frames.sort_by_key(|frame| frame.at_ms);
    let (parameters, settings) = (Parameters::PAPER.to_f32(), Profile::Flight.settings());
    let law = Adaptive::new(Profile::Flight.gains()).expect("valid");
    let controller = Controller::new(parameters, settings, law).expect("valid");
    let vehicle = FlightCore::new(parameters, ArmingLimits::default(), controller).expect("valid");
    let (mut memory, mut inbox, mut tracker) = (FlightCoreMemory::default(), Inbox::default(), Tracker::default());
    let mut decoder = Decoder::<Uplink>::new(VEHICLE);
    let mut seen = Seen::default();
    let mut frames = frames.iter().peekable();
    let mut before = Counters::default();

    for ms in 0..END_MS {
        let (now_us, since_ms) = (ms * 1000, ms as i64 - FAULT_MS as i64);
        while let Some(frame) = frames.next_if(|frame| frame.at_ms <= since_ms) {
            let ask = |inbox: &mut Inbox, request| assert!(inbox.request(Ticketed { value: request, ticket: 0 }));
            decoder.feed(&frame.bytes, |_, message| match message {
                Uplink::State { sent_us, state, .. } => {
                    if let Some(state) = tracker.stamp(1, sent_us, now_us, state) {
                        inbox.put_state(state);
                    }
                }
                Uplink::Setpoint(value) => inbox.put_setpoint(Stamped { value, at_us: now_us }),
                Uplink::Command(VehicleCommand::Arm) => ask(&mut inbox, Request::Arm),
                Uplink::Command(VehicleCommand::Engage) => ask(&mut inbox, Request::Engage),
                Uplink::Command(VehicleCommand::Disarm) => ask(&mut inbox, Request::Disarm),
                Uplink::Command(VehicleCommand::Kill) => ask(&mut inbox, Request::Kill),
                _ => {}
            });
        }
        let outcome = vehicle.tick(&mut memory, now_us, &inbox.take());

        // Every tick of every case checks the gating of the motors.
        let still = outcome.motors == RotorSpeeds::default();
        assert!(outcome.mode.armed() || still, "motors turn while disarmed");
        assert!(outcome.motors.0.iter().all(|speed| speed.is_finite() && *speed >= 0.0));

        if since_ms < 0 {
            before = *decoder.counters();
            continue;
        }
        seen.answers.extend(outcome.answer.map(|RequestAnswer { request, result, .. }| result.map(|()| request)));
        seen.setpoint_stale |= outcome.health.setpoint_stale;
        if seen.modes.last().is_none_or(|(_, mode)| *mode != outcome.mode) {
            seen.modes.push((since_ms, outcome.mode));
        }
    }
    assert_eq!(before, Counters { received: before.received, ..Counters::default() }, "no fault before the fault");
    seen.counters = *decoder.counters();
    seen
}

// --- Faults, which change the frames of an undisturbed flight. ---

/// Applies `change` to the states sent in these milliseconds; `None` drops them.
fn states(frames: &mut Vec<Frame>, when: std::ops::Range<i64>, change: impl Fn(&mut Frame) -> Option<()>) {
    frames.retain_mut(|frame| frame.kind != Kind::State || !when.contains(&frame.at_ms) || change(frame).is_some());
}

fn drop_states(frames: &mut Vec<Frame>, when: std::ops::Range<i64>) {
    states(frames, when, |_| None);
}

fn delay_states(frames: &mut Vec<Frame>, when: std::ops::Range<i64>, by: impl Fn(i64) -> i64) {
    states(frames, when, |frame| {
        frame.at_ms += by(frame.at_ms);
        Some(())
    });
}

/// Changes the payload, and corrects the checksum.
fn rewrite(frame: &mut Frame, change: impl Fn(&mut [u8])) {
    let end = frame.bytes.len() - 2;
    change(&mut frame.bytes[10..end]);
    let crc = mavlink_crc(&frame.bytes[1..end], 91);
    frame.bytes[end..].copy_from_slice(&crc.to_le_bytes());
}

/// CRC-16/MCRF4XX, bit by bit.
fn mavlink_crc(bytes: &[u8], extra: u8) -> u16 {
    bytes.iter().chain([&extra]).fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0x8408 } else { crc >> 1 })
    })
}

const FOREVER: std::ops::Range<i64> = 0..i64::MAX;

use Mode::{Coasting, Descending, Disarmed, Flying};
use VehicleCommand::Kill;

/// A fault, the resulting modes with their first milliseconds, and a further check.
type Case = (&'static str, fn(&mut Vec<Frame>), &'static [(i64, Mode)], fn(&Seen) -> bool);

#[rustfmt::skip]
const CASES: &[Case] = &[
    ("no fault", |_| {}, &[(0, Flying)], |s| s.counters.lost == 0 && s.answers.is_empty()),

    // Dropped frames.
    ("20 ms without a state are nothing", |f| drop_states(f, 0..20), &[(0, Flying)], |s| s.counters.lost == 20),
    ("21 ms are coasted through", |f| drop_states(f, 0..21),
        &[(0, Flying), (20, Coasting), (120, Flying)], |s| s.counters.lost == 21),
    ("100 ms are coasted through", |f| drop_states(f, 0..100), &[(0, Flying), (20, Coasting), (199, Flying)], |_| true),
    ("250 ms are coasted through", |f| drop_states(f, 0..250), &[(0, Flying), (20, Coasting), (349, Flying)], |_| true),
    ("251 ms end in a descent, on the ground a second later", |f| drop_states(f, 0..251),
        &[(0, Flying), (20, Coasting), (250, Descending), (1277, Disarmed)], |_| true),
    ("a state that never returns ends the flight", |f| drop_states(f, FOREVER),
        &[(0, Flying), (20, Coasting), (250, Descending), (2250, Disarmed)], |_| true),
    ("a state that returns late still lands the vehicle", |f| drop_states(f, 0..1500),
        &[(0, Flying), (20, Coasting), (250, Descending), (2526, Disarmed)], |_| true),
    ("every second state missing is nothing",
        |f| states(f, FOREVER, |frame| (frame.at_ms % 2 == 0).then_some(())),
        &[(0, Flying)], |s| s.counters.lost > 1000),
    ("one state in 20 ms is enough",
        |f| states(f, FOREVER, |frame| (frame.at_ms % 20 == 0).then_some(())), &[(0, Flying)], |_| true),
    ("outages of 40 ms are coasted through as one",
        |f| { drop_states(f, 0..40); drop_states(f, 60..100); },
        &[(0, Flying), (20, Coasting), (199, Flying)], |_| true),
    ("no setpoint: the position is held", |f| f.retain(|frame| frame.kind != Kind::Setpoint || frame.at_ms < 0),
        &[(0, Flying)], |s| s.setpoint_stale),
    ("the whole link is dead", |f| f.retain(|frame| frame.at_ms < 0),
        &[(0, Flying), (20, Coasting), (250, Descending), (2250, Disarmed)], |s| s.setpoint_stale),

    // Delayed frames.
    ("15 ms late are nothing", |f| delay_states(f, FOREVER, |_| 15), &[(0, Flying)], |_| true),
    // After a second, the delay looks like a clock that was set back, so the states count again, and the vehicle is
    // found at rest.
    ("30 ms late are as good as none at first", |f| delay_states(f, FOREVER, |_| 30),
        &[(0, Flying), (20, Coasting), (250, Descending), (1731, Disarmed)], |_| true),
    ("a queue that builds up and empties", |f| delay_states(f, 0..100, |at| at.min(100 - at)),
        &[(0, Flying), (41, Coasting), (199, Flying)], |_| true),
    ("a burst after a pause of 100 ms", |f| delay_states(f, 0..100, |at| 100 - at),
        &[(0, Flying), (20, Coasting), (199, Flying)], |s| s.counters.lost == 0),
    ("jitter of 15 ms, some overtaken", |f| delay_states(f, FOREVER, |at| at * 7 % 16), &[(0, Flying)], |_| true),
    ("one state 500 ms late is not taken for new", |f| {
        delay_states(f, 100..101, |_| 500);
        drop_states(f, 590..700);
    }, &[(0, Flying), (610, Coasting), (799, Flying)], |_| true),
    ("setpoints 400 ms late are still setpoints",
        |f| for frame in f.iter_mut().filter(|f| f.kind == Kind::Setpoint && f.at_ms >= 0) { frame.at_ms += 400; },
        &[(0, Flying)], |s| !s.setpoint_stale),

    // Corrupt frames.
    ("one state with a flipped bit", |f| states(f, 5..6, |frame| { frame.bytes[50] ^= 4; Some(()) }),
        &[(0, Flying)], |s| s.counters.bad_checksum == 1 && s.counters.lost == 1),
    ("100 ms of flipped bits", |f| states(f, 0..100, |frame| { frame.bytes[100] ^= 0x80; Some(()) }),
        &[(0, Flying), (20, Coasting), (199, Flying)], |s| s.counters.bad_checksum == 100),
    ("flipped bits for ever", |f| states(f, FOREVER, |frame| { frame.bytes[30] ^= 1; Some(()) }),
        &[(0, Flying), (20, Coasting), (250, Descending), (2250, Disarmed)], |_| true),
    ("a length that swallows the next state", |f| states(f, 5..6, |frame| { frame.bytes[1] = 233; Some(()) }),
        &[(0, Flying)], |s| s.counters.bad_checksum == 1 && s.counters.lost == 1),
    ("truncated states for 30 ms", |f| states(f, 0..30, |frame| { frame.bytes.truncate(99); Some(()) }),
        &[(0, Flying), (20, Coasting), (129, Flying)], |s| s.counters.lost == 30),
    ("noise between states", |f| states(f, FOREVER, |frame| {
        frame.bytes.splice(0..0, [0xFD, 0, 0x55, 0xFD, 0xFD]);
        Some(())
    }), &[(0, Flying)], |s| s.counters.skipped_bytes > 10_000 && s.counters.lost == 0),
    ("NaN positions for 50 ms",
        |f| states(f, 0..50, |frame| {
            rewrite(frame, |p| p[8..12].copy_from_slice(&f32::NAN.to_le_bytes()));
            Some(())
        }),
        &[(0, Flying), (20, Coasting), (149, Flying)], |s| s.counters.implausible == 50),
    ("no rotation for 300 ms", |f| states(f, 0..300, |frame| { rewrite(frame, |p| p[20..36].fill(0)); Some(()) }),
        &[(0, Flying), (20, Coasting), (250, Descending), (1326, Disarmed)], |s| s.counters.implausible == 300),
    ("states of another frame for 50 ms",
        |f| states(f, 0..50, |frame| { rewrite(frame, |p| p[228] = 4); Some(()) }),
        &[(0, Flying), (20, Coasting), (149, Flying)], |s| s.counters.unsupported == 50),
    ("a disarm command with a flipped bit does nothing", |f| {
        let mut disarm = frame(10, Uplink::Command(VehicleCommand::Disarm));
        disarm.bytes[12] ^= 1;
        f.push(disarm);
    }, &[(0, Flying)], |s| s.answers.is_empty() && s.counters.bad_checksum == 1),

    // These cases have reordered and repeated frames.
    ("states swapped in pairs", |f| delay_states(f, 0..1000, |at| if at % 2 == 0 { 2 } else { 0 }),
        &[(0, Flying)], |_| true),
    ("states in blocks of 10, back to front", |f| delay_states(f, FOREVER, |at| 9 - at % 10 + 9 - at % 10),
        &[(0, Flying)], |_| true),
    ("every state twice", |f| { let again = f.clone(); f.extend(again.into_iter().filter(|f| f.at_ms >= 0)); },
        &[(0, Flying)], |s| s.counters.lost == 0),
    ("old states played back instead of new ones", |f| {
        let old = f.iter().find(|frame| frame.kind == Kind::State).expect("some").bytes.clone();
        for frame in f.iter_mut().filter(|f| f.kind == Kind::State && f.at_ms >= 0) {
            frame.bytes.clone_from(&old);
        }
    }, &[(0, Flying), (20, Coasting), (250, Descending), (2250, Disarmed)], |_| true),
    ("arming again in flight is refused and changes nothing", |f| {
        f.push(frame(10, Uplink::Command(VehicleCommand::Arm)));
    },
        &[(0, Flying)], |s| s.answers == [Err(Refusal::AlreadyArmed)]),
    ("stopped and armed within a millisecond: stopped, and not at rest", |f| {
        f.push(frame(10, Uplink::Command(Kill)));
        f.push(frame(10, Uplink::Command(VehicleCommand::Arm)));
        for frame in f.iter_mut().filter(|f| f.kind == Kind::State && f.at_ms > 10) {
            rewrite(frame, |p| p[44..48].copy_from_slice(&1.0f32.to_le_bytes()));
        }
    }, &[(0, Flying), (10, Disarmed)], |s| s.answers == [Ok(Request::Kill), Err(Refusal::NotAtRest)]),
    ("armed and stopped within a millisecond: stopped", |f| {
        f.push(frame(10, Uplink::Command(VehicleCommand::Arm)));
        f.push(frame(10, Uplink::Command(Kill)));
    }, &[(0, Flying), (10, Disarmed)], |s| s.answers == [Err(Refusal::Overtaken), Ok(Request::Kill)]),

    // Commands during a fault.
    ("disarmed in flight: refused", |f| f.push(frame(10, Uplink::Command(VehicleCommand::Disarm))),
        &[(0, Flying)], |s| s.answers == [Err(Refusal::InFlight)]),
    ("stopped in flight", |f| f.push(frame(10, Uplink::Command(Kill))), &[(0, Flying), (10, Disarmed)], |_| true),
    ("stopped while coasting", |f| { drop_states(f, FOREVER); f.push(frame(100, Uplink::Command(Kill))); },
        &[(0, Flying), (20, Coasting), (100, Disarmed)], |_| true),
    ("stopped while descending", |f| { drop_states(f, FOREVER); f.push(frame(400, Uplink::Command(Kill))); },
        &[(0, Flying), (20, Coasting), (250, Descending), (400, Disarmed)], |_| true),
    ("armed again while descending: refused", |f| {
        drop_states(f, 0..300);
        f.push(frame(400, Uplink::Command(VehicleCommand::Arm)));
    }, &[(0, Flying), (20, Coasting), (250, Descending), (1326, Disarmed)],
        |s| s.answers == [Err(Refusal::AlreadyArmed)]),
    ("armed on the ground without a state: refused", |f| {
        drop_states(f, FOREVER);
        f.push(frame(10, Uplink::Command(Kill)));
        f.push(frame(500, Uplink::Command(VehicleCommand::Arm)));
    }, &[(0, Flying), (10, Disarmed)], |s| s.answers == [Ok(Request::Kill), Err(Refusal::StateStale)]),
];

#[test]
fn every_case_ends_as_it_should() {
    let undisturbed = flight();
    let mut failures = Vec::new();
    for (name, fault, modes, seen_as_expected) in CASES {
        let mut frames = undisturbed.clone();
        fault(&mut frames);
        let seen = play(frames);
        if seen.modes != *modes || !seen_as_expected(&seen) {
            failures.push(format!("{name}: expected {modes:?}, saw {seen:?}"));
        }
    }
    assert!(failures.is_empty(), "{} of {} cases:\n{}", failures.len(), CASES.len(), failures.join("\n"));
    assert!(CASES.len() >= 20);
}
