//! u-blox receivers are found, configured and monitored on a faulty line; their messages match another
//! implementation's.

use crate::ublox_model::{Generation, Model, Truth, frame, solution};
use afbc_drivers::GnssReading;
use afbc_drivers::ublox::{BAUDS, ReceiverAction, UbxReceiver};
use afbc_types::Stamped;
use proptest::prelude::*;

const MS: u64 = 1000;
const SECOND: u64 = 1000 * MS;
const GENERATIONS: [Generation; 3] = [Generation::Six, Generation::Eight, Generation::Ten];

/// Faults of the line from the receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Line {
    Good,
    /// One in this many bytes has a flipped bit.
    Flips(u64),
    Loses(u64),
    Repeats(u64),
    /// No byte passes.
    Cut,
}

/// A receiver model, the line and the driver, in steps of a millisecond.
struct Bench {
    model: Model,
    driver: UbxReceiver,
    line: Line,
    /// Number of further commands before one is lost, if any.
    loses_command: Option<usize>,
    /// The UART's baud rate.
    baud: u32,
    now_us: u64,
    random: u64,
    /// Fixes with their times.
    fixes: Vec<Stamped<Option<GnssReading>>>,
}

impl Bench {
    fn new(model: Model) -> Self {
        let driver = UbxReceiver::new();
        Bench {
            model,
            driver,
            line: Line::Good,
            loses_command: None,
            baud: 9600,
            now_us: 7 * SECOND,
            random: 1,
            fixes: Vec::new(),
        }
    }

    fn random(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random
    }

    /// Passes an arriving byte through the line to the driver.
    fn arrive(&mut self, at_us: u64, byte: u8) {
        let byte = if self.model.baud == self.baud { byte } else { self.random() as u8 };
        let (struck, bit) = (self.random(), self.random() % 8);
        let bytes = match self.line {
            Line::Flips(every) if struck.is_multiple_of(every) => vec![byte ^ (1 << bit)],
            Line::Loses(every) if struck.is_multiple_of(every) => vec![],
            Line::Repeats(every) if struck.is_multiple_of(every) => vec![byte; 2],
            Line::Cut => vec![],
            _ => vec![byte],
        };
        for byte in bytes {
            self.fixes.extend(self.driver.take(at_us, byte));
        }
    }

    fn run(&mut self, for_us: u64) {
        let end_us = self.now_us + for_us;
        while self.now_us < end_us {
            self.now_us += MS;
            while let Some(action) = self.driver.poll(self.now_us) {
                match action {
                    ReceiverAction::Baud(baud) => self.baud = baud,
                    ReceiverAction::Send(_) if self.loses_command == Some(0) => self.loses_command = None,
                    ReceiverAction::Send(command) => {
                        self.loses_command = self.loses_command.map(|number| number - 1);
                        for byte in command.as_bytes() {
                            let byte = if self.model.baud == self.baud { *byte } else { self.random() as u8 };
                            self.model.hear(byte);
                        }
                    }
                }
            }
            self.model.advance(self.now_us);
            let room = self.model.baud as u64 * MS / SECOND / 10;
            for place in 0..room.max(1) {
                let Some(byte) = self.model.says.pop_front() else { break };
                self.arrive(self.now_us + place * MS / room.max(1), byte);
            }
        }
    }

    /// Runs until the receiver is configured, at most for `most_us`.
    #[track_caller]
    fn configure(&mut self, most_us: u64) {
        let begun_us = self.now_us;
        while !self.driver.is_configured() {
            self.run(10 * MS);
            assert!(self.now_us < begun_us + most_us, "{:?} is not configured", self.model);
        }
    }

    /// Runs for a time and returns the fixes of that time.
    fn fixes(&mut self, for_us: u64) -> Vec<Stamped<Option<GnssReading>>> {
        self.fixes.clear();
        self.run(for_us);
        std::mem::take(&mut self.fixes)
    }
}

/// Asserts that a fix matches the truth to the last digit.
fn assert_true(fix: &GnssReading, truth: &Truth) {
    let Truth { place, altitude_mm, velocity_mm_s, accuracies: [h, v, s], .. } = *truth;
    let [latitude_deg, longitude_deg] = place.map(|angle| f64::from(angle) * 1e-7);
    assert!((fix.latitude_deg - latitude_deg).abs() < 1e-9 && (fix.longitude_deg - longitude_deg).abs() < 1e-9);
    assert!((fix.altitude_m - f64::from(altitude_mm) * 1e-3).abs() < 1e-6);
    for (read, speed) in fix.velocity_ned_m_s.iter().zip(velocity_mm_s) {
        assert!((read - speed as f32 * 1e-3).abs() < 1e-4);
    }
    let sigmas = [fix.horizontal_sigma_m, fix.vertical_sigma_m, fix.speed_sigma_m_s, fix.climb_sigma_m_s];
    for (read, told) in sigmas.into_iter().zip([h, v, s, s]) {
        assert!((read - told as f32 * 1e-3).abs() < 1e-4);
    }
}

/// A receiver is found at every baud rate and gets all settings.
#[test]
fn a_receiver_is_found_and_configured() {
    for generation in [Generation::Eight, Generation::Ten] {
        for baud in BAUDS {
            let mut bench = Bench::new(Model::at(generation, baud));
            bench.configure(12 * SECOND);
            let (model, period_us) = (&bench.model, if generation == Generation::Ten { 100_000 } else { 200_000 });
            assert_eq!((model.nmea, model.solves, model.dynamic_model), (false, true, 8), "{generation:?}");
            assert_eq!((model.period_us, model.baud), (period_us, baud.max(115_200)), "{generation:?}");
            bench.run(SECOND);
            let fixes = bench.fixes(10 * SECOND);
            assert_eq!(fixes.len() as u64, 10 * SECOND / period_us);
            for fix in &fixes {
                assert_true(fix.value.as_ref().expect("a fix"), &Truth::ZURICH);
                // The fix has the time of its epoch.
                let late_us = fix.at_us % period_us;
                assert!(late_us.min(period_us - late_us) <= 2 * MS, "{} us", fix.at_us);
            }
            assert_eq!(bench.driver.searches(), 0);
        }
    }
}

/// A new receiver of the usual kind is configured within three seconds, an already configured one within one second.
#[test]
fn the_usual_ones_are_found_first() {
    let mut bench = Bench::new(Model::new(Generation::Ten));
    bench.configure(3 * SECOND);
    (bench.driver, bench.baud) = (UbxReceiver::new(), 9600);
    bench.configure(SECOND);
}

/// A receiver without UBX or without usable UBX messages is used with NMEA, at every baud rate.
#[test]
fn others_are_used_by_nmea() {
    for deaf in [true, false] {
        for baud in BAUDS {
            let mut model = Model::at(Generation::Six, baud);
            model.deaf = deaf;
            let mut bench = Bench::new(model);
            bench.run(14 * SECOND);
            let fixes = bench.fixes(30 * SECOND);
            assert!((29..=31).contains(&fixes.len()), "{baud} baud: {}", fixes.len());
            let fix = fixes[20].value.expect("a fix");
            assert!((fix.latitude_deg - 47.397_742).abs() < 1e-6 && (fix.altitude_m - 488.0).abs() < 0.06);
            assert!(!bench.driver.is_configured() && bench.model.nmea);
        }
    }
}

/// A receiver whose answers were lost at first is configured later. Meanwhile there are fixes.
#[test]
fn a_receiver_that_hears_again_is_configured() {
    let mut model = Model::new(Generation::Ten);
    model.deaf = true;
    let mut bench = Bench::new(model);
    bench.run(20 * SECOND);
    assert!(bench.fixes(5 * SECOND).len() >= 4);
    bench.model.deaf = false;
    bench.configure(7 * SECOND);
}

/// A receiver that was configured before and does not hear is used as it is.
#[test]
fn a_configured_one_that_does_not_hear_is_used() {
    let mut bench = Bench::new(Model::new(Generation::Ten));
    bench.configure(12 * SECOND);
    bench.model.deaf = true;
    bench.driver = UbxReceiver::new();
    bench.run(2 * SECOND);
    assert_eq!(bench.fixes(5 * SECOND).len(), 50);
}

/// Refused settings are skipped.
#[test]
fn refusals_are_survived() {
    for (generation, number) in [(Generation::Eight, 0x24), (Generation::Eight, 0x08), (Generation::Eight, 0x00)] {
        let mut model = Model::at(generation, 57_600);
        model.refuses = vec![number];
        let mut bench = Bench::new(model);
        bench.run(20 * SECOND);
        assert!(bench.fixes(10 * SECOND).iter().filter(|fix| fix.value.is_some()).count() >= 9, "{number:#x}");
    }
    for generation in [Generation::Eight, Generation::Ten] {
        let mut model = Model::new(generation);
        model.refuses = vec![0x8A, 0x01];
        let mut bench = Bench::new(model);
        bench.run(12 * SECOND);
        let count = bench.fixes(10 * SECOND).len();
        assert!(
            count >= 9 && bench.model.nmea && !bench.driver.is_configured(),
            "{generation:?}: {count}, {:?}",
            bench.model
        );
    }
}

/// The receiver answers so late that each command is sent twice, and the line loses one command. No answer to an
/// earlier command counts for the next command.
#[test]
fn late_answers_are_not_taken_for_later_ones() {
    for generation in [Generation::Eight, Generation::Ten] {
        for late_ms in [0, 200, 365, 420, 450, 600] {
            for lost in 0..14 {
                let mut model = Model::new(generation);
                model.answers_after_us = late_ms * MS;
                let mut bench = Bench::new(model);
                bench.loses_command = Some(lost);
                bench.configure(60 * SECOND);
                bench.run(2 * SECOND);
                let Model { nmea, solves, period_us, dynamic_model, .. } = bench.model;
                let period_ms = if generation == Generation::Ten { 100 } else { 200 };
                let told = (nmea, solves, period_us, dynamic_model);
                assert_eq!(told, (false, true, period_ms * MS, 8), "{generation:?}, {late_ms} ms, command {lost}");
            }
        }
    }
}

/// Function that causes a fault.
type Fault = fn(&mut Bench);

/// For ten seconds of a fault in flight, every fix is correct; afterwards everything is as before.
#[test]
fn faults_in_flight_end() {
    let faults: [(&str, Fault); 12] = [
        ("flipped bits", |bench| bench.line = Line::Flips(400)),
        ("flipped bits, many", |bench| bench.line = Line::Flips(20)),
        ("lost bytes", |bench| bench.line = Line::Loses(300)),
        ("repeated bytes", |bench| bench.line = Line::Repeats(300)),
        ("cut", |bench| bench.line = Line::Cut),
        ("reset", |bench| bench.model.reset()),
        ("reset, deaf", |bench| {
            bench.model.reset();
            bench.model.deaf = true;
        }),
        ("another baud rate", |bench| bench.model.baud = 460_800),
        ("another baud rate, slow", |bench| bench.model.baud = 9_600),
        ("another receiver", |bench| bench.model = Model::at(Generation::Eight, 57_600)),
        ("no solutions", |bench| bench.model.solves = false),
        ("refusals after a reset", |bench| {
            bench.model.reset();
            bench.model.refuses = vec![0x8A, 0x00, 0x01];
        }),
    ];
    for generation in [Generation::Eight, Generation::Ten] {
        for (name, fault) in &faults {
            let mut bench = Bench::new(Model::new(generation));
            bench.configure(12 * SECOND);
            bench.run(SECOND);
            fault(&mut bench);
            for fix in bench.fixes(10 * SECOND) {
                // NMEA gives the same position with one digit less, and no accuracies.
                let fix = fix.value.expect("a fix");
                assert!(
                    (fix.latitude_deg - 47.397_742).abs() < 1e-6 && (fix.altitude_m - 488.0).abs() < 0.06,
                    "{name}"
                );
                assert!((fix.velocity_ned_m_s.x - 1.2).abs() < 0.01 && (fix.velocity_ned_m_s.y + 0.34).abs() < 0.01);
            }
            bench.line = Line::Good;
            (bench.model.deaf, bench.model.refuses) = (false, Vec::new());
            let begun_us = bench.now_us;
            bench.run(8 * SECOND);
            bench.configure(SECOND);
            let fixes = bench.fixes(2 * SECOND);
            let period_us = bench.model.period_us;
            let count = (2 * SECOND / period_us) as usize;
            assert!((count..=count + 1).contains(&fixes.len()), "{name}: {} fixes at {begun_us}", fixes.len());
            fixes.iter().for_each(|fix| assert_true(fix.value.as_ref().expect("a fix"), &Truth::ZURICH));
        }
    }
}

/// After a reset, fixes return within three seconds, and the receiver is configured within four.
#[test]
fn a_reset_costs_seconds() {
    for generation in [Generation::Eight, Generation::Ten] {
        let mut bench = Bench::new(Model::new(generation));
        bench.configure(12 * SECOND);
        bench.run(SECOND);
        bench.model.reset();
        let fixes = bench.fixes(4 * SECOND);
        assert!(bench.driver.is_configured() && bench.driver.searches() == 1, "{generation:?}");
        assert!(fixes.iter().all(|fix| fix.value.is_some()));
    }
}

/// Epochs without a fix and fixes with impossible numbers give no fix.
#[test]
fn no_fix_is_none() {
    let good = Truth::ZURICH;
    let odd = [
        Truth { fix_type: 0, ..good },
        Truth { fix_type: 2, ..good },
        Truth { fix_type: 5, ..good },
        Truth { flags: [0, 0], ..good },
        Truth { flags: [1, 1], ..good },
        Truth { place: [900_000_001, 0], ..good },
        Truth { place: [0, -1_800_000_001], ..good },
        Truth { altitude_mm: 80_001_000, ..good },
        Truth { altitude_mm: -10_001_000, ..good },
        Truth { velocity_mm_s: [0, 501_000, 0], ..good },
        Truth { velocity_mm_s: [0, 0, i32::MIN], ..good },
        Truth { accuracies: [0, 1000, 100], ..good },
        Truth { accuracies: [1000, 200_001, 100], ..good },
        Truth { accuracies: [1000, 1000, u32::MAX], ..good },
    ];
    let mut bench = Bench::new(Model::new(Generation::Ten));
    bench.configure(12 * SECOND);
    for truth in odd {
        bench.model.truth = truth;
        bench.run(200 * MS);
        let fixes = bench.fixes(SECOND);
        assert!(fixes.len() == 10 && fixes.iter().all(|fix| fix.value.is_none()), "{truth:?}");
    }
    bench.model.truth = Truth { fix_type: 4, ..good };
    bench.run(200 * MS);
    assert!(bench.fixes(SECOND).iter().all(|fix| fix.value.is_some()));
    assert_eq!(bench.driver.searches(), 0, "an epoch without a fix is no silence");
}

fn any_truth() -> impl Strategy<Value = Truth> {
    let place = (-900_000_000..=900_000_000, -1_800_000_000..=1_800_000_000);
    let speed = -500_000..=500_000;
    let numbers = (place, -1_000_000..80_000_000, [speed.clone(), speed.clone(), speed]);
    (numbers, [1..200_000_u32, 1..200_000, 1..20_000]).prop_map(
        |(((latitude, longitude), altitude_mm, velocity_mm_s), accuracies)| Truth {
            place: [latitude, longitude],
            altitude_mm,
            velocity_mm_s,
            accuracies,
            ..Truth::ZURICH
        },
    )
}

fn take_all(driver: &mut UbxReceiver, at_us: u64, bytes: &[u8]) -> Vec<Stamped<Option<GnssReading>>> {
    bytes.iter().filter_map(|byte| driver.take(at_us, *byte)).collect()
}

proptest! {
    /// Any solution is decoded correctly after any noise, and the crate `ublox` decodes the same.
    #[test]
    fn what_is_sent_is_read(truth in any_truth(), noise in prop::collection::vec(any::<u8>(), 0..60)) {
        let payload = solution(3 * SECOND, &truth);
        let sent = frame([0x01, 0x07], &payload);
        let mut driver = UbxReceiver::new();
        let mut bytes = noise;
        // Zeros for a frame that the noise may seem to begin: it ends after at most the longest frame's length.
        bytes.extend([0; 400]);
        bytes.extend(&sent);
        let fixes = take_all(&mut driver, 5 * SECOND, &bytes);
        prop_assert_eq!(fixes.len(), 1);
        assert_true(fixes[0].value.as_ref().expect("a fix"), &truth);

        let mut parser = ublox::ParserBuilder::new().with_protocol::<ublox::proto27::Proto27>().with_vec_buffer();
        let mut packets = parser.consume_ubx(&sent);
        let Some(Ok(ublox::UbxPacket::Proto27(ublox::proto27::PacketRef::NavPvt(other)))) = packets.next() else {
            panic!("no NAV-PVT")
        };
        let fix = fixes[0].value.expect("a fix");
        prop_assert!((fix.latitude_deg - other.latitude()).abs() < 1e-9);
        prop_assert!((fix.longitude_deg - other.longitude()).abs() < 1e-9);
        prop_assert!((fix.altitude_m - other.height_msl()).abs() < 1e-6);
        let velocity = [other.vel_north(), other.vel_east(), other.vel_down()];
        for (read, speed) in fix.velocity_ned_m_s.iter().zip(velocity) {
            prop_assert!((f64::from(*read) - speed).abs() < 1e-4);
        }
        prop_assert!((f64::from(fix.horizontal_sigma_m) - other.horizontal_accuracy()).abs() < 1e-4);
        prop_assert!((f64::from(fix.vertical_sigma_m) - other.vertical_accuracy()).abs() < 1e-4);
        prop_assert!((f64::from(fix.speed_sigma_m_s) - other.speed_accuracy()).abs() < 1e-4);
        prop_assert_eq!(fix.satellites, other.num_satellites());
    }

    /// A frame with a changed byte gives no fix. The next frame is found, even within the damaged one.
    #[test]
    fn a_wrong_checksum_is_no_fix(
        truth in any_truth(), at in 0_usize..100, change in 1_u8..=255, cut in 0_usize..100, cuts in any::<bool>(),
    ) {
        let good = frame([0x01, 0x07], &solution(3 * SECOND, &truth));
        let mut bad = good.clone();
        if cuts {
            bad.remove(cut);
        } else {
            bad[at] ^= change;
        }
        let mut driver = UbxReceiver::new();
        prop_assert_eq!(take_all(&mut driver, 5 * SECOND, &bad), []);
        let mut again = good.repeat(4);
        again.extend([0; 400]);
        let fixes = take_all(&mut driver, 5 * SECOND + 100 * MS, &again);
        prop_assert_eq!(fixes.len(), 4);
        fixes.iter().for_each(|fix| assert_true(fix.value.as_ref().expect("a fix"), &truth));
    }

    /// Any bytes and calls at any times cause no panic, and no fix beyond a receiver's limits.
    #[test]
    fn noise_is_survived(
        pieces in prop::collection::vec((prop::collection::vec(any::<u8>(), 0..80), any::<u32>(), 0_u8..6), 0..60),
    ) {
        let mut driver = UbxReceiver::new();
        let mut now_us = 0_u64;
        for (mut bytes, passed_us, kind) in pieces {
            now_us += u64::from(passed_us) % (2 * SECOND);
            bytes = match kind {
                0 => frame([0x01, 0x07], &bytes),
                1 => frame([0x05, bytes.len() as u8 & 1], &bytes),
                2 => frame([0x0A, 0x04], &bytes),
                3 => [vec![0xB5, 0x62, 0x01, 0x07], bytes].concat(),
                4 => {
                    let mut payload = solution(now_us, &Truth::ZURICH);
                    payload.iter_mut().zip(&bytes).for_each(|(to, from)| *to = *from);
                    frame([0x01, 0x07], &payload)
                }
                _ => bytes,
            };
            while let Some(action) = driver.poll(now_us) {
                if let ReceiverAction::Send(command) = action {
                    prop_assert!(command.as_bytes().starts_with(&[0xB5, 0x62]));
                }
            }
            for fix in take_all(&mut driver, now_us, &bytes).into_iter().filter_map(|fix| fix.value) {
                prop_assert!(fix.latitude_deg.abs() <= 90.0 && fix.longitude_deg.abs() <= 180.0);
                prop_assert!(fix.velocity_ned_m_s.iter().all(|speed| speed.abs() <= 500.0));
                prop_assert!(fix.speed_sigma_m_s > 0.0 && fix.horizontal_sigma_m > 0.0);
            }
        }
    }
}

/// A fix has the time of its first byte, also behind a frame that lost bytes, which seems to last into the next one.
/// The broken frame is counted.
#[test]
fn a_fix_has_the_time_of_its_first_byte() {
    let good = frame([0x01, 0x07], &solution(3 * SECOND, &Truth::ZURICH));
    let mut driver = UbxReceiver::new();
    let Some(ReceiverAction::Baud(baud)) = driver.poll(0) else { panic!("no baud rate") };
    let byte_us = 10 * SECOND / u64::from(baud);
    // Takes the bytes as a line of this baud rate gives them. Returns how much earlier the only fix is than byte `at`.
    let early_us = |driver: &mut UbxReceiver, begin_us: u64, bytes: &[u8], at: usize| {
        let arrives_us = |place: usize| begin_us + place as u64 * byte_us;
        let fixes: Vec<_> =
            bytes.iter().enumerate().filter_map(|(place, byte)| driver.take(arrives_us(place), *byte)).collect();
        assert_eq!(fixes.len(), 1, "{at}");
        arrives_us(at) - fixes[0].at_us
    };
    let alone_us = early_us(&mut driver, SECOND, &good, 0);
    for lost in 1..60 {
        let begin_us = SECOND + lost as u64 * SECOND;
        let cut = &good[..good.len() - lost];
        let behind_us = early_us(&mut driver, begin_us, &[cut, &good].concat(), cut.len());
        assert!(behind_us.abs_diff(alone_us) <= 1, "{lost} bytes lost: {behind_us} us, alone {alone_us} us");
        assert_eq!(driver.damaged(), lost as u32);
    }
}

/// A receiver that gives sentences only, and then falls silent, is searched for at the other baud rates.
#[test]
fn a_receiver_of_sentences_that_changes_its_baud_rate_is_found_again() {
    let mut model = Model::at(Generation::Six, 9_600);
    model.deaf = true;
    let mut bench = Bench::new(model);
    bench.run(14 * SECOND);
    assert!(bench.fixes(10 * SECOND).len() >= 9);
    let before = bench.driver.searches();
    bench.model.baud = 57_600;
    bench.run(20 * SECOND);
    assert_eq!(bench.driver.searches(), before + 1);
    assert!(bench.fixes(10 * SECOND).len() >= 9);
}

/// Returns the commands that a receiver of this generation gets until it is configured.
fn commands(generation: Generation, baud: u32) -> Vec<Vec<u8>> {
    let mut model = Model::at(generation, baud);
    let (mut driver, mut now_us, mut all) = (UbxReceiver::new(), 0, Vec::new());
    let mut uart_baud = 0;
    while !driver.is_configured() && now_us < 20 * SECOND {
        now_us += MS;
        while let Some(action) = driver.poll(now_us) {
            match action {
                ReceiverAction::Baud(baud) => uart_baud = baud,
                ReceiverAction::Send(command) if uart_baud == model.baud => {
                    all.push(command.as_bytes().to_vec());
                    command.as_bytes().iter().for_each(|byte| model.hear(*byte));
                }
                ReceiverAction::Send(_) => (),
            }
        }
        let says: Vec<u8> = model.says.drain(..).collect();
        take_all(&mut driver, now_us, &says);
    }
    all
}

/// The commands match those of the crate `ublox`.
#[test]
fn commands_are_as_another_implementation_has_them() {
    use ublox::cfg_val::CfgVal;
    use ublox::{cfg_msg, cfg_nav5, cfg_prt, cfg_rate, mon_ver, nav_pvt};
    let set = |item: CfgVal| {
        let mut bytes = Vec::new();
        let (version, layers, reserved1) = (0, ublox::packets::cfg_val::CfgLayerSet::RAM, 0);
        ublox::packets::cfg_val::CfgValSetBuilder { version, layers, reserved1, cfg_data: &[item] }
            .extend_to(&mut bytes);
        bytes
    };
    let poll = ublox::UbxPacketRequest::request_for::<mon_ver::MonVer>().into_packet_bytes().to_vec();
    let airborne = cfg_nav5::NavDynamicModel::AirborneWithLess4gAcceleration;
    let expected = [
        poll.clone(),
        set(CfgVal::MsgOutUbxNavPvtUart1(1)),
        set(CfgVal::NavSpgDynModel(airborne)),
        set(CfgVal::Uart1OutProtNmea(false)),
        set(CfgVal::Uart1Baudrate(115_200)),
        poll.clone(),
        set(CfgVal::RateMeas(100)),
    ];
    assert_eq!(commands(Generation::Ten, 38_400), expected);

    let nav5 =
        cfg_nav5::CfgNav5Builder { mask: cfg_nav5::CfgNav5Params::DYN, dyn_model: airborne, ..Default::default() };
    let line = cfg_prt::CfgPrtUartBuilder {
        portid: cfg_prt::UartPortId::Uart1,
        reserved0: 0,
        tx_ready: 0,
        mode: cfg_prt::UartMode::new(cfg_prt::DataBits::Eight, cfg_prt::Parity::None, cfg_prt::StopBits::One),
        baud_rate: 115_200,
        in_proto_mask: cfg_prt::InProtoMask::UBLOX | cfg_prt::InProtoMask::NMEA,
        out_proto_mask: cfg_prt::OutProtoMask::UBLOX,
        flags: 0,
        reserved5: 0,
    };
    let rate = cfg_rate::CfgRateBuilder {
        measure_rate_ms: 200,
        nav_rate: 1,
        time_ref: cfg_rate::AlignmentToReferenceTime::Gps,
    };
    let mut all = commands(Generation::Eight, 9_600);
    // Only the mask and the model's number matter in this command; the receiver ignores the rest.
    let dynamics = all.remove(2);
    assert_eq!(dynamics[..9], nav5.into_packet_bytes()[..9]);
    let expected = [
        poll.clone(),
        cfg_msg::CfgMsgSinglePortBuilder::set_rate_for::<nav_pvt::proto27::NavPvt>(1).into_packet_bytes().to_vec(),
        line.into_packet_bytes().to_vec(),
        poll,
        rate.into_packet_bytes().to_vec(),
    ];
    assert_eq!(all, expected);
    assert!(commands(Generation::Six, 9_600).len() >= 2 && GENERATIONS.contains(&Generation::Six));
}
