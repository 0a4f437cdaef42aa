//! The pilot's commands from sticks and switches, and after a lost link.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use afbc_flight_core::Request;
use afbc_guidance::{FlightMode, Order, Sticks};
use afbc_rc::{
    CHANNELS, Channels, CrsfDecoder, CrsfFrame, PilotInputs, PilotNotice, PilotOutput, RadioLink, RadioPilot,
    RadioSettings, SbusDecoder, SbusFrame, SwitchModes,
};
use afbc_types::Declared;
use proptest::prelude::*;

const KILL: usize = 6;
const RETURN: usize = 7;
const PERIOD_US: u64 = 4_000;

/// A transmitter, its receiver and the vehicle's state.
struct Rig {
    settings: RadioSettings,
    link: RadioLink,
    pilot: RadioPilot,
    channels: Channels,
    inputs: PilotInputs,
}

impl Rig {
    /// Creates a rig with sticks centred, throttle down and switches off; no frame has been received yet.
    fn new() -> Self {
        let mut settings = RadioSettings::DEFAULT;
        settings.functions.kill = KILL as u32 + 1;
        settings.functions.return_home = RETURN as u32 + 1;
        settings.modes = SwitchModes { first: 8, third: 1, sixth: 3, ..settings.modes };
        settings.validate().unwrap();
        let mut us = [1000; 16];
        us[..4].copy_from_slice(&[1500, 1500, 1000, 1500]);
        let inputs = PilotInputs { now_us: 0, armed: false, mode: FlightMode::Hold };
        Rig { settings, link: RadioLink::default(), pilot: RadioPilot::default(), channels: Channels::of(us), inputs }
    }

    fn heard() -> Self {
        let mut rig = Rig::new();
        assert!(rig.frames(20).iter().any(|output| output.notice == Some(PilotNotice::Heard)));
        rig
    }

    /// Receives this number of frames; returns the pilot's output after each.
    fn frames(&mut self, count: u32) -> Vec<PilotOutput> {
        (0..count)
            .map(|_| {
                self.inputs.now_us += PERIOD_US;
                self.link.take(&self.channels, self.inputs.now_us);
                self.pilot.step(&self.settings, &mut self.link, &self.inputs)
            })
            .collect()
    }

    /// Lets this time pass without frames; returns the pilot's outputs.
    fn silence(&mut self, us: u64) -> Vec<PilotOutput> {
        let end_us = self.inputs.now_us + us;
        let mut outputs = Vec::new();
        while self.inputs.now_us < end_us {
            self.inputs.now_us += 20_000;
            outputs.push(self.pilot.step(&self.settings, &mut self.link, &self.inputs));
        }
        outputs
    }

    fn switch(&mut self, channel: usize, on: bool) -> Vec<PilotOutput> {
        self.channels.us[channel] = if on { 2000 } else { 1000 };
        self.frames(5)
    }
}

fn requests(outputs: &[PilotOutput]) -> Vec<Request> {
    outputs.iter().filter_map(|output| output.request).collect()
}

fn orders(outputs: &[PilotOutput]) -> Vec<Order> {
    outputs.iter().filter_map(|output| output.order).collect()
}

fn notices(outputs: &[PilotOutput]) -> Vec<PilotNotice> {
    outputs.iter().filter_map(|output| output.notice).collect()
}

const ARM: usize = 4;
const MODE: usize = 5;
const THROTTLE: usize = 2;

#[test]
fn a_switch_arms_and_disarms_once() {
    let mut rig = Rig::heard();
    assert_eq!(requests(&rig.switch(ARM, true)), [Request::Arm]);
    rig.inputs.armed = true;
    assert_eq!(requests(&rig.frames(100)), []);
    assert_eq!(requests(&rig.switch(ARM, false)), [Request::Disarm]);
}

#[test]
fn a_switch_that_was_on_arms_nothing() {
    let mut rig = Rig::new();
    assert_eq!(requests(&rig.switch(ARM, true)), []);
    assert_eq!(requests(&rig.frames(200)), []);
    rig.switch(ARM, false);
    assert_eq!(requests(&rig.switch(ARM, true)), [Request::Arm]);
    // The switch arms nothing either when the link comes back, or after the vehicle has disarmed by itself.
    assert_eq!(requests(&rig.frames(100)), []);
    assert_eq!(notices(&rig.silence(1_000_000)), [PilotNotice::Lost]);
    assert_eq!(requests(&rig.frames(500)), []);
}

#[test]
fn nothing_arms_with_the_throttle_up_or_the_kill_switch_on() {
    let mut rig = Rig::heard();
    rig.channels.us[THROTTLE] = 1700;
    rig.frames(5);
    let outputs = rig.switch(ARM, true);
    assert_eq!((requests(&outputs), notices(&outputs)), (vec![], vec![PilotNotice::ThrottleUp]));
    rig.channels.us[THROTTLE] = 1500;
    // The switch must be moved again.
    assert_eq!(requests(&rig.frames(50)), []);
    rig.switch(ARM, false);
    rig.switch(KILL, true);
    let outputs = rig.switch(ARM, true);
    assert_eq!((requests(&outputs), notices(&outputs)), (vec![], vec![PilotNotice::KillSwitchOn]));
    rig.switch(KILL, false);
    assert_eq!(requests(&rig.frames(50)), []);
    rig.switch(ARM, false);
    assert_eq!(requests(&rig.switch(ARM, true)), [Request::Arm]);
}

/// The kill switch acts from the second frame, for as long as it is on, with priority over disarming.
#[test]
fn the_kill_switch_goes_first() {
    let mut rig = Rig::heard();
    rig.switch(ARM, true);
    (rig.inputs.armed, rig.inputs.mode) = (true, FlightMode::Mission);
    (rig.channels.us[KILL], rig.channels.us[ARM]) = (2000, 1000);
    let outputs = rig.frames(10);
    assert_eq!(outputs[0].request, None);
    assert_eq!(requests(&outputs), [Request::Kill; 9]);
    rig.inputs.armed = false;
    assert_eq!(requests(&rig.frames(10)), []);
}

/// A single frame moves no switch, since SBUS has no checksum.
#[test]
fn one_frame_moves_no_switch() {
    let mut rig = Rig::heard();
    let quiet = rig.channels;
    rig.inputs.armed = true;
    for channel in [ARM, MODE, KILL, RETURN] {
        rig.channels.us[channel] = 2000;
        let mut outputs = rig.frames(1);
        rig.channels = quiet;
        outputs.extend(rig.frames(5));
        assert_eq!((requests(&outputs), orders(&outputs)), (vec![], vec![]), "channel {channel}");
    }
}

#[test]
fn switches_select_modes() {
    let mut rig = Rig::new();
    assert_eq!(orders(&rig.frames(20)), []);
    // On arming, the switch selects the mode.
    let outputs = rig.switch(ARM, true);
    assert_eq!(requests(&outputs), [Request::Arm]);
    assert_eq!(orders(&outputs), [Order::Select(FlightMode::Stabilised)]);
    rig.inputs.armed = true;
    rig.inputs.mode = FlightMode::Stabilised;
    for (us, mode) in [(1420, FlightMode::Altitude), (2000, FlightMode::Mission), (1000, FlightMode::Stabilised)] {
        rig.channels.us[MODE] = us;
        assert_eq!(orders(&rig.frames(5)), [Order::Select(mode)]);
    }
    assert_eq!(orders(&rig.switch(RETURN, true)), [Order::Select(FlightMode::Return)]);
    // The return switch has priority over the mode switch.
    rig.channels.us[MODE] = 1420;
    assert_eq!(orders(&rig.frames(5)), [Order::Select(FlightMode::Return)]);
    assert_eq!(orders(&rig.switch(RETURN, false)), [Order::Select(FlightMode::Altitude)]);
}

/// After a lost link is regained, sticks are ignored for half a second. The mode stays until a switch or stick is
/// moved.
#[test]
fn a_pilot_who_comes_back_waits() {
    let mut rig = Rig::heard();
    (rig.inputs.armed, rig.inputs.mode) = (true, FlightMode::Mission);
    rig.frames(5);
    rig.silence(2_000_000);
    let outputs = rig.frames(120);
    assert_eq!((requests(&outputs), orders(&outputs)), (vec![], vec![]));
    assert!(outputs.iter().all(|output| output.sticks.is_none()));
    let outputs = rig.frames(50);
    assert_eq!(orders(&outputs), []);
    assert!(outputs.last().unwrap().sticks.is_some());
    rig.channels.us[0] = 1800;
    assert_eq!(orders(&rig.frames(1)), [Order::Select(FlightMode::Position)]);
}

#[test]
fn moved_sticks_end_a_mode_that_flies_by_itself() {
    let mut rig = Rig::heard();
    (rig.inputs.armed, rig.inputs.mode) = (true, FlightMode::Return);
    assert_eq!(orders(&rig.frames(20)), []);
    rig.channels.us[1] = 1600;
    assert_eq!(orders(&rig.frames(20)), []);
    // The order is given only once, even if it is refused.
    rig.channels.us[1] = 1700;
    assert_eq!(orders(&rig.frames(50)), [Order::Select(FlightMode::Position)]);
    rig.inputs.mode = FlightMode::Position;
    assert_eq!(orders(&rig.frames(20)), []);
    rig.settings.modes.overrides = false;
    rig.inputs.mode = FlightMode::Return;
    rig.channels.us[1] = 1300;
    assert_eq!(orders(&rig.frames(20)), []);
}

#[test]
fn sticks_are_calibrated() {
    let mut rig = Rig::heard();
    rig.settings.channel_1.trim_us = 1520.0;
    rig.settings.channel_2.direction = -1.0;
    rig.settings.channel_3.min_us = 1100.0;
    rig.settings.validate().unwrap();
    let mut sticks = |us: [u16; 4]| {
        rig.channels.us[..4].copy_from_slice(&us);
        rig.frames(1)[0].sticks.unwrap()
    };
    let ends = Sticks { roll: 1.0, pitch: -1.0, throttle: -1.0, yaw: -1.0 };
    assert_eq!(sticks([2000, 2000, 1100, 1000]), ends);
    assert_eq!(sticks([2150, 2150, 900, 850]), ends);
    assert_eq!(sticks([1520, 1500, 1550, 1500]), Sticks::default());
    assert_eq!(sticks([1530, 1491, 1559, 1510]), Sticks::default());
    assert_eq!(sticks([1765, 1245, 1780, 1745]), Sticks { roll: 0.5, pitch: 0.5, throttle: 0.5, yaw: 0.479_591_84 });
}

/// A failsafe throttle below the transmitter's range counts as a lost link.
#[test]
fn a_failsafe_by_the_throttle_is_a_loss() {
    let mut rig = Rig::heard();
    rig.settings.functions.failsafe_us = 950.0;
    assert!(rig.frames(1)[0].sticks.is_some());
    rig.channels.us[THROTTLE] = 940;
    let outputs = rig.frames(50);
    assert_eq!(notices(&outputs), [PilotNotice::Lost]);
    assert!(outputs.iter().all(|output| output.sticks.is_none()));
}

/// COM_RC_IN_MODE selects whose sticks count; the receiver's switches always do.
#[test]
fn sticks_count_by_their_source() {
    for (source, receivers, joysticks) in [(0, true, false), (1, false, true), (4, false, false), (5, true, true)] {
        let mut rig = Rig::heard();
        rig.settings.receiver.source = source;
        rig.settings.validate().unwrap();
        assert_eq!(rig.frames(1)[0].sticks.is_some(), receivers, "{source}");
        assert_eq!(rig.settings.receiver.takes_joystick(), joysticks, "{source}");
        rig.channels.us[ARM] = 2000;
        assert_eq!(requests(&rig.frames(3)), [Request::Arm], "{source}");
    }
    for source in [2, 3] {
        let mut settings = RadioSettings::DEFAULT;
        settings.receiver.source = source;
        assert!(settings.validate().is_err(), "{source}");
    }
}

/// A missing channel centres its stick, holds the height and switches nothing.
#[test]
fn missing_channels_command_nothing() {
    let mut rig = Rig::heard();
    rig.channels.us = [0; CHANNELS];
    rig.channels.us[MODE] = 1500;
    rig.settings.functions.arm_share = -0.75;
    let outputs = rig.frames(20);
    assert_eq!(outputs.iter().filter_map(|output| output.request).count(), 0);
    assert_eq!(outputs.last().unwrap().sticks, Some(Sticks::default()));
}

#[test]
fn modes_that_there_are_none_of_are_refused() {
    let modes = SwitchModes { fourth: 9, ..SwitchModes::DEFAULT };
    assert!(modes.validate().unwrap_err().to_string().starts_with("fourth"));
    assert_eq!(SwitchModes { fourth: 6, ..SwitchModes::DEFAULT }.validate(), Ok(()));
}

/// Returns a receiver's bytes for four switch positions in turn, arming included, 15 frames each.
fn recorded(frame: impl Fn(&Channels) -> Vec<u8>) -> Vec<Vec<u8>> {
    let mut rig = Rig::new();
    let mut frames = Vec::new();
    for (channel, on) in [(ARM, false), (ARM, true), (RETURN, true), (ARM, false)] {
        rig.channels.us[channel] = if on { 2000 } else { 1000 };
        frames.extend((0..15).map(|_| frame(&rig.channels)));
    }
    frames
}

/// Returns the number of bytes that the next test draws; `RADIO_BYTES` overrides it.
fn byte_count() -> usize {
    std::env::var("RADIO_BYTES").map_or(2_000_000, |count| count.parse().unwrap())
}

/// Random bytes, parts of frames and frames with flipped bits never arm, disarm or kill.
#[test]
fn noise_commands_nothing() {
    let crsf = recorded(|channels| CrsfFrame::Channels(*channels).encode().to_vec());
    let sbus =
        recorded(|channels| SbusFrame { channels: *channels, frame_lost: false, failsafe: false }.encode().to_vec());
    let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
    let mut draw = |below: usize| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 11) as usize % below
    };
    let settings = Rig::new().settings;
    for (is_crsf, frames) in [(true, &crsf), (false, &sbus)] {
        let (mut crsf, mut sbus) = (CrsfDecoder::default(), SbusDecoder::default());
        let (mut link, mut pilot) = (RadioLink::default(), RadioPilot::default());
        let (mut fed, mut now_us) = (0, 0);
        while fed < byte_count() {
            let frame = &frames[draw(frames.len())];
            let piece: Vec<u8> = match draw(4) {
                0 => (0..1 + draw(40)).map(|_| draw(256) as u8).collect(),
                1 => frame[draw(frame.len())..].to_vec(),
                2 => frame[..draw(frame.len())].to_vec(),
                _ => {
                    let mut spoilt = frame.clone();
                    let first = draw(spoilt.len());
                    spoilt[first] ^= 1 << draw(8);
                    // Spoils the SBUS header too, since SBUS has no checksum to detect the flipped bit.
                    if !is_crsf {
                        spoilt[0] ^= 1 << draw(8);
                    }
                    spoilt
                }
            };
            fed += piece.len();
            now_us += 500 + draw(8_000) as u64;
            let bad = crsf.bad_frames() + sbus.bad_frames();
            if is_crsf {
                crsf.feed(&piece, now_us, |frame| {
                    if let CrsfFrame::Channels(channels) = frame {
                        link.take(&channels, now_us);
                    }
                });
            } else {
                sbus.feed(&piece, now_us, |frame| link.take(&frame.channels, now_us));
            }
            if crsf.bad_frames() + sbus.bad_frames() > bad {
                link.refuse();
            }
            for armed in [false, true] {
                let inputs = PilotInputs { now_us, armed, mode: FlightMode::Hold };
                let output = pilot.step(&settings, &mut link, &inputs);
                assert_eq!((output.request, output.order), (None, None), "after {fed} bytes");
            }
        }
    }
}

proptest! {
    /// For any sequence of channels, sticks stay in range, and arming needs the arming switch on and the throttle down.
    #[test]
    fn any_channels_are_flown(
        frames in prop::collection::vec((prop::array::uniform16(700u16..2300), 0u64..60_000), 1..200), armed: bool,
    ) {
        let mut rig = Rig::new();
        rig.inputs.armed = armed;
        for (us, pause_us) in frames {
            rig.inputs.now_us += pause_us;
            rig.link.take(&Channels::of(us), rig.inputs.now_us);
            let output = rig.pilot.step(&rig.settings, &mut rig.link, &rig.inputs);
            if let Some(Sticks { roll, pitch, throttle, yaw }) = output.sticks {
                prop_assert!([roll, pitch, throttle, yaw].iter().all(|stick| (-1.0..=1.0).contains(stick)));
            }
            if output.request == Some(Request::Arm) {
                prop_assert!(!armed && us[ARM] > 1700 && us[THROTTLE] < 1600 && us[KILL] < 1800);
            }
        }
    }
}
