//! The pilot's radio receiver, from its bytes to requests, orders and texts, and RC_CHANNELS_OVERRIDE in place of a
//! receiver.

use crate::common::Bench;
use afbc_comms::services::{health::sensor, status::SensorBits, streams::id};
use afbc_comms::{AuxSensors, RadioControl};
use afbc_flight_core::{Mode, Refusal, Request};
use afbc_guidance::{FlightMode, Order, Sticks};
use afbc_mavlink::{
    ChannelsOverride, Downlink, ExternalTarget, ManualControl, MavSeverity, Telemetry, Uplink, VehicleCommand,
};
use afbc_onboard::{ControlInputs, Report};
use afbc_rc::{
    CHANNELS, Channels, CrsfFrame, LinkStatistics, RadioFunctions, RadioProtocol, RadioReceiver, RadioSettings,
    SbusFrame, SwitchModes,
};

const WARNING: MavSeverity = MavSeverity::MAV_SEVERITY_WARNING;
const INFO: MavSeverity = MavSeverity::MAV_SEVERITY_INFO;
/// Indices of channels.
const ROLL: usize = 0;
const THROTTLE: usize = 2;
const ARM: usize = 4;
const MODE: usize = 5;
/// Channels with centred sticks and all switches off.
const REST: [u16; 16] =
    [1500, 1500, 1500, 1500, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000];
/// Number of frames in a row after which a receiver is used.
const FRAMES: usize = 10;

/// A vehicle with a radio receiver.
struct Vehicle {
    bench: Bench,
    radio: RadioControl,
    settings: RadioSettings,
    idle: Report,
    mode: Mode,
    flight_mode: FlightMode,
    texts: Vec<(MavSeverity, String)>,
}

fn settings(protocol: RadioProtocol) -> RadioSettings {
    RadioSettings { receiver: RadioReceiver { protocol, ..RadioReceiver::DEFAULT }, ..RadioSettings::DEFAULT }
}

fn crsf(us: [u16; 16]) -> Vec<u8> {
    CrsfFrame::Channels(Channels::of(us)).encode().to_vec()
}

fn sbus(us: [u16; 16], frame_lost: bool, failsafe: bool) -> Vec<u8> {
    SbusFrame { channels: Channels::of(us), frame_lost, failsafe }.encode().to_vec()
}

fn with(changes: &[(usize, u16)]) -> [u16; 16] {
    let mut us = REST;
    changes.iter().for_each(|(place, value)| us[*place] = *value);
    us
}

impl Vehicle {
    fn new(protocol: RadioProtocol) -> Self {
        let mut bench = Bench::new();
        let (idle, _) = bench.step();
        let (radio, settings) = (RadioControl::default(), settings(protocol));
        let (mode, flight_mode) = (Mode::Disarmed, FlightMode::Position);
        Vehicle { bench, radio, settings, idle, mode, flight_mode, texts: Vec::new() }
    }

    /// Returns a vehicle whose receiver hears a pilot.
    fn heard(protocol: RadioProtocol) -> Self {
        let mut vehicle = Vehicle::new(protocol);
        // The positions of the switches are known two frames later.
        vehicle.send(FRAMES + 2, REST);
        assert_eq!(std::mem::take(&mut vehicle.texts), [(INFO, "radio: heard".to_owned())]);
        vehicle
    }

    /// Runs a tick with bytes of the receiver. Returns the vehicle's messages and the new inputs.
    fn tick(&mut self, bytes: &[u8]) -> (Vec<Downlink>, Option<ControlInputs>) {
        self.bench.now_us += 1000;
        let mut report = Report { time_us: self.bench.now_us, mode: self.mode, ..self.idle };
        report.guided.mode = self.flight_mode;
        let said = self.bench.said(&report);
        self.texts.extend(said.iter().filter_map(|message| match message {
            Downlink::Text { severity, text } => Some((*severity, text.to_str().expect("words").to_owned())),
            _ => None,
        }));
        (said, self.bench.comms.pilot(&mut self.radio, bytes, &self.settings))
    }

    /// Runs ticks without bytes. Returns the new inputs for the control tick.
    fn pass(&mut self, ticks: usize) -> Vec<ControlInputs> {
        (0..ticks).filter_map(|_| self.tick(&[]).1).collect()
    }

    /// Receives a frame of the receiver in four ticks.
    fn frame(&mut self, bytes: &[u8]) -> Vec<ControlInputs> {
        let first = self.tick(bytes).1;
        first.into_iter().chain(self.pass(3)).collect()
    }

    /// Receives frames with these channels.
    fn send(&mut self, frames: usize, us: [u16; 16]) -> Vec<ControlInputs> {
        let bytes = match self.settings.receiver.protocol {
            RadioProtocol::Crsf => crsf(us),
            RadioProtocol::Sbus => sbus(us, false, false),
        };
        (0..frames).flat_map(|_| self.frame(&bytes)).collect()
    }

    /// Receives RC_CHANNELS_OVERRIDE of a station in four ticks.
    fn relay(&mut self, us: [u16; CHANNELS]) -> Vec<ControlInputs> {
        self.bench.hear(Uplink::Target(ExternalTarget::Channels(ChannelsOverride::new(us))));
        self.pass(4)
    }

    /// Requests RC_CHANNELS. Returns the channels and the RSSI, if the message is sent.
    fn channels(&mut self) -> Option<([u16; CHANNELS], u8)> {
        self.bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: id::RC_CHANNELS, index: 0 }));
        (0..2).flat_map(|_| self.tick(&[]).0).find_map(|message| match message {
            Downlink::Telemetry(Telemetry::Channels(channels)) => Some((channels.us, channels.rssi)),
            _ => None,
        })
    }

    fn is_heard(&mut self) -> bool {
        self.channels().is_some()
    }

    fn said(&self, text: &str) -> usize {
        self.texts.iter().filter(|(_, said)| said == text).count()
    }
}

fn padded(us: [u16; 16]) -> [u16; CHANNELS] {
    Channels::of(us).us
}

fn requests(inputs: &[ControlInputs]) -> Vec<(u8, Request)> {
    inputs.iter().filter_map(|inputs| inputs.inbox.asked()).map(|it| (it.ticket, it.value)).collect()
}

fn orders(inputs: &[ControlInputs]) -> Vec<(u8, Order)> {
    inputs.iter().flat_map(|inputs| &inputs.orders.given).map(|it| (it.ticket, it.value)).collect()
}

fn sticks(inputs: &[ControlInputs]) -> Vec<Sticks> {
    inputs.iter().filter_map(|inputs| inputs.orders.sticks).map(|sticks| sticks.value).collect()
}

/// A receiver is used from its tenth frame in a row on. The pilot is lost after half a second without a frame. Both are
/// announced once.
#[test]
fn a_pilot_is_heard_and_lost() {
    for protocol in [RadioProtocol::Crsf, RadioProtocol::Sbus] {
        let mut vehicle = Vehicle::new(protocol);
        assert!(vehicle.send(FRAMES - 1, REST).is_empty());
        assert_eq!((vehicle.is_heard(), vehicle.texts.len()), (false, 0));
        let inputs = vehicle.send(1, REST);
        assert_eq!((inputs.len(), sticks(&inputs).len()), (1, 1), "in the frame's tick");
        assert_eq!(sticks(&vehicle.send(20, REST)).len(), 20, "the sticks of each frame");
        assert_eq!(vehicle.texts, [(INFO, "radio: heard".to_owned())]);
        // The last frame came four ticks ago.
        assert!(vehicle.pass(490).is_empty());
        assert!(vehicle.is_heard());
        vehicle.pass(30);
        assert_eq!(vehicle.texts[1..], [(WARNING, "radio: lost".to_owned())]);
        assert!(!vehicle.is_heard());
        // The loss resets everything: sticks count again only after half a second.
        assert!(sticks(&vehicle.send(100, REST)).is_empty());
        assert!(!sticks(&vehicle.send(100, REST)).is_empty());
        assert_eq!((vehicle.said("radio: heard"), vehicle.said("radio: lost")), (2, 1));
    }
}

/// Damaged frames and frames marked as lost restart the count, but do not end a link that is in use. A receiver's
/// failsafe ends it at once.
#[test]
fn bad_frames_begin_the_count_anew() {
    let mut damaged = crsf(REST);
    damaged[5] ^= 1;
    let bad = [
        (RadioProtocol::Crsf, damaged.clone()),
        (RadioProtocol::Sbus, sbus(REST, true, false)),
        (RadioProtocol::Sbus, sbus(REST, false, true)),
        (RadioProtocol::Sbus, sbus(REST, true, true)),
        // The end of a frame is missing. The next frame begins after a pause.
        (RadioProtocol::Sbus, sbus(REST, false, false)[..20].to_vec()),
    ];
    for (case, (protocol, bytes)) in bad.into_iter().enumerate() {
        let mut vehicle = Vehicle::new(protocol);
        // A truncated frame is noticed only with the next frame, which has been counted by then.
        vehicle.send(FRAMES - 2, REST);
        vehicle.frame(&bytes);
        vehicle.send(FRAMES - 1, REST);
        assert!(!vehicle.is_heard(), "{case}");
        vehicle.send(2, REST);
        assert!(vehicle.is_heard(), "{case}");
        (0..20).for_each(|_| drop(vehicle.frame(&bytes)));
        let gives_up = [2, 3].contains(&case);
        assert_eq!(vehicle.is_heard(), !gives_up, "{case}");
        assert_eq!(vehicle.said("radio: lost"), usize::from(gives_up), "{case}");
        (0..200).for_each(|_| drop(vehicle.frame(&bytes)));
        assert_eq!((vehicle.is_heard(), vehicle.said("radio: lost")), (false, 1), "they do not keep the pilot: {case}");
    }
}

/// The arming switch requests the state that it is moved to, for the pilot, and orders the mode of the mode switch.
#[test]
fn the_arming_switch_arms_and_disarms() {
    let mut vehicle = Vehicle::heard(RadioProtocol::Crsf);
    let inputs = vehicle.send(5, with(&[(ARM, 2000)]));
    assert_eq!(requests(&inputs), [(254, Request::Arm)]);
    assert_eq!(orders(&inputs), [(254, Order::Select(FlightMode::Position))]);
    vehicle.mode = Mode::Flying;
    assert_eq!(requests(&vehicle.send(5, with(&[(ARM, 2000)]))), []);
    let inputs = vehicle.send(5, with(&[]));
    assert_eq!((requests(&inputs), orders(&inputs)), (vec![(254, Request::Disarm)], vec![]));
    // The pilot is told why no request is made.
    vehicle.mode = Mode::Disarmed;
    vehicle.send(5, REST);
    assert_eq!(requests(&vehicle.send(5, with(&[(ARM, 2000), (THROTTLE, 1800)]))), []);
    assert_eq!(vehicle.texts, [(WARNING, "radio: not armed, lower the throttle".to_owned())]);
}

/// A faulty sensor prevents the arm request. With the mode switch at Land or Return, there is no order either. Both
/// refusals are announced. A flying vehicle accepts the same inputs.
#[test]
fn arming_is_refused_beside_the_flight_core() {
    let faulty = SensorBits { present: sensor::GYROSCOPE_2, healthy: 0 };
    let mut vehicle = Vehicle::heard(RadioProtocol::Crsf);
    vehicle.bench.comms.set_aux_sensors(AuxSensors { sensors: faulty, ..AuxSensors::default() });
    let inputs = vehicle.send(5, with(&[(ARM, 2000)]));
    assert_eq!((requests(&inputs), orders(&inputs).len()), (vec![], 1));
    assert_eq!(vehicle.texts, [(WARNING, "arming refused: IMU 2 is faulty".to_owned())]);
    // A faulty sensor does not prevent disarming.
    vehicle.mode = Mode::Flying;
    assert_eq!(requests(&vehicle.send(5, REST)), [(254, Request::Disarm)]);
    assert_eq!(vehicle.texts.len(), 1);

    for (number, mode, refuses) in
        [(11, FlightMode::Land, true), (5, FlightMode::Return, true), (4, FlightMode::Hold, false)]
    {
        let mut vehicle = Vehicle::heard(RadioProtocol::Crsf);
        vehicle.settings.modes = SwitchModes { sixth: number, ..SwitchModes::DEFAULT };
        let inputs = vehicle.send(5, with(&[(MODE, 2000)]));
        assert_eq!(orders(&inputs), [(254, Order::Select(mode))], "of a disarmed vehicle too");
        let inputs = vehicle.send(5, with(&[(MODE, 2000), (ARM, 2000)]));
        let expected = if refuses { vec![] } else { vec![(254, Request::Arm)] };
        assert_eq!((requests(&inputs), orders(&inputs).len()), (expected, usize::from(!refuses)), "{mode:?}");
        assert_eq!(vehicle.said(Refusal::WrongMode.reason()), usize::from(refuses));
        assert!(vehicle.texts.iter().all(|(severity, _)| *severity == WARNING));
    }
}

/// The kill switch repeats its request while the vehicle is armed.
#[test]
fn the_kill_switch_kills() {
    let mut vehicle = Vehicle::heard(RadioProtocol::Crsf);
    vehicle.settings.functions = RadioFunctions { kill: 7, ..RadioFunctions::DEFAULT };
    vehicle.send(5, REST);
    assert_eq!(requests(&vehicle.send(5, with(&[(6, 2000)]))), []);
    vehicle.mode = Mode::Flying;
    let requests = requests(&vehicle.send(3, with(&[(6, 2000)])));
    assert_eq!(requests, [(254, Request::Kill); 3]);
}

/// Sticks are shaped for the flight mode and stamped with the time of their tick. A station's joystick is ignored until
/// the pilot's sticks have been silent for half a second.
#[test]
fn sticks_are_shaped_and_go_first() {
    for flight_mode in FlightMode::ALL {
        let mut vehicle = Vehicle::heard(RadioProtocol::Crsf);
        (vehicle.mode, vehicle.flight_mode) = (Mode::Flying, flight_mode);
        let inputs = vehicle.send(2, with(&[(ROLL, 1755), (THROTTLE, 1245)]));
        let raw = Sticks { roll: 0.5, pitch: 0.0, throttle: -0.5, yaw: 0.0 };
        let expected = vehicle.settings.curves.shape(flight_mode, &raw);
        let Sticks { roll, throttle, .. } = sticks(&inputs)[1];
        assert!((roll - expected.roll).abs() < 1e-3 && (throttle - expected.throttle).abs() < 1e-3, "{flight_mode:?}");
        let at_us = inputs[1].orders.sticks.map(|sticks| sticks.at_us);
        assert_eq!(at_us, Some(vehicle.bench.now_us - 3000));
    }
    let mut vehicle = Vehicle::heard(RadioProtocol::Crsf);
    let joystick =
        Uplink::Target(ExternalTarget::Sticks(ManualControl { roll: 0.0, pitch: 1.0, throttle: 0.0, yaw: 0.0 }));
    let counts = |vehicle: &mut Vehicle| {
        vehicle.bench.inputs = ControlInputs::EMPTY;
        vehicle.bench.hear(joystick);
        vehicle.bench.inputs.orders.sticks.is_some()
    };
    assert!(!counts(&mut vehicle));
    vehicle.pass(490);
    assert!(!counts(&mut vehicle));
    vehicle.pass(20);
    assert!(counts(&mut vehicle));
    // Sticks that are not in use do not suppress the joystick.
    let mut vehicle = Vehicle::new(RadioProtocol::Crsf);
    vehicle.settings.receiver.source = 1;
    assert!(vehicle.send(2 * FRAMES, REST).is_empty());
    assert!(vehicle.is_heard() && counts(&mut vehicle));
}

/// RC_CHANNELS has the receiver's channels and an RSSI. With CRSF the RSSI is the link quality, scaled to 254; SBUS has
/// none.
#[test]
fn stations_see_the_channels() {
    for (quality_percent, rssi) in [(0, 0), (50, 127), (99, 251), (100, 254), (255, 254)] {
        let mut vehicle = Vehicle::heard(RadioProtocol::Crsf);
        let link = LinkStatistics { rssi_dbm: -70, quality_percent, snr_db: 5 };
        vehicle.frame(&CrsfFrame::LinkStatistics(link).encode());
        assert_eq!(*vehicle.radio.statistics(), link);
        vehicle.send(1, with(&[(ROLL, 1700)]));
        assert_eq!(vehicle.channels(), Some((padded(with(&[(ROLL, 1700)])), rssi)));
    }
    let mut vehicle = Vehicle::heard(RadioProtocol::Sbus);
    assert_eq!(vehicle.channels(), Some((padded(REST), 255)));
    let mut vehicle = Vehicle::new(RadioProtocol::Crsf);
    assert_eq!(vehicle.channels(), None);
}

/// Without a receiver, a station's channels are used in its place. Their loss is announced, their arrival is not.
#[test]
fn channels_of_a_station_take_the_place_of_a_receivers() {
    let mut vehicle = Vehicle::new(RadioProtocol::Crsf);
    (0..FRAMES - 1).for_each(|_| assert!(vehicle.relay(padded(REST)).is_empty()));
    assert_eq!(sticks(&vehicle.relay(padded(REST))).len(), 1);
    (0..2).for_each(|_| drop(vehicle.relay(padded(REST))));
    assert_eq!(vehicle.channels(), Some((padded(REST), 255)));
    assert_eq!(vehicle.texts, []);
    let inputs: Vec<_> = (0..5).flat_map(|_| vehicle.relay(padded(with(&[(ARM, 2000)])))).collect();
    assert_eq!((requests(&inputs), orders(&inputs).len()), (vec![(254, Request::Arm)], 1));
    vehicle.pass(490);
    assert_eq!((vehicle.is_heard(), vehicle.texts.len()), (true, 0));
    vehicle.pass(20);
    assert_eq!(vehicle.texts, [(WARNING, "radio: lost".to_owned())]);
    assert!(!vehicle.is_heard());

    // If the station releases all channels, they are lost at once.
    let mut vehicle = Vehicle::new(RadioProtocol::Crsf);
    (0..FRAMES).for_each(|_| drop(vehicle.relay(padded(REST))));
    assert!(vehicle.is_heard());
    vehicle.relay([0; CHANNELS]);
    assert!(!vehicle.is_heard());
    assert_eq!(vehicle.texts, [(WARNING, "radio: lost".to_owned())]);
}

/// A channel that the station does not set keeps its value for half a second and is then lost. A message that sets no
/// channel refreshes none.
#[test]
fn a_channel_that_is_left_alone_is_lost_as_a_stick_is() {
    let mut vehicle = Vehicle::new(RadioProtocol::Crsf);
    // The 32-bit time in milliseconds wraps during this test.
    vehicle.bench.now_us = (u64::from(u32::MAX) + 1) * 1000 - 200_000;
    (0..FRAMES).for_each(|_| drop(vehicle.relay(padded(with(&[(ROLL, 1600)])))));
    let mut some = padded(REST);
    some[ROLL] = u16::MAX;
    let held = |vehicle: &mut Vehicle| vehicle.channels().map(|(us, _)| (us[ROLL], us[1]));
    (0..120).for_each(|_| drop(vehicle.relay(some)));
    assert_eq!(held(&mut vehicle), Some((1600, 1500)));
    (0..8).for_each(|_| drop(vehicle.relay(some)));
    assert_eq!(held(&mut vehicle), Some((0, 1500)));
    let inputs = vehicle.relay(some);
    assert_eq!(sticks(&inputs).first().map(|sticks| sticks.roll), Some(0.0));
    for _ in 0..130 {
        assert!(sticks(&vehicle.relay([u16::MAX; CHANNELS])).is_empty());
    }
    assert_eq!((vehicle.is_heard(), vehicle.said("radio: lost")), (false, 1));
}

/// A receiver that hears its pilot ends a station's channels. They start afresh when the receiver loses its pilot.
#[test]
fn a_receiver_goes_first() {
    let mut vehicle = Vehicle::new(RadioProtocol::Crsf);
    (0..FRAMES).for_each(|_| drop(vehicle.relay(padded(with(&[(ROLL, 1600)])))));
    vehicle.send(FRAMES, REST);
    assert_eq!(vehicle.channels(), Some((padded(REST), 0)));
    for _ in 0..FRAMES {
        vehicle.bench.hear(Uplink::Target(ExternalTarget::Channels(ChannelsOverride::new(padded(REST)))));
        assert!(sticks(&vehicle.pass(4)).is_empty(), "those of the receiver alone");
        vehicle.send(1, REST);
    }
    vehicle.pass(510);
    assert_eq!(vehicle.said("radio: lost"), 1);
    (0..FRAMES - 1).for_each(|_| drop(vehicle.relay(padded(REST))));
    assert!(!vehicle.is_heard());
    vehicle.relay(padded(REST));
    assert!(vehicle.is_heard());
}
