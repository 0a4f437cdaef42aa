//! The decoders of radio receivers on arbitrary bytes and pauses, and the pilot behind them: they do not panic, bytes
//! in
//! one piece and one by one give the same frames, a frame that is written is read again, sticks are between their ends,
//! and nothing arms before enough frames in a row.
#![no_main]

use afbc_flight_core::Request;
use afbc_guidance::FlightMode;
use afbc_rc::{
    ACQUIRE_FRAMES, CrsfDecoder, CrsfFrame, PilotInputs, RadioLink, RadioPilot, RadioSettings, SbusDecoder, SbusFrame,
};
use libfuzzer_sys::fuzz_target;

/// Time between two pieces \[us\].
const PAUSE_US: u64 = 7_000;

fn crsf(pieces: &[&[u8]], pause_us: u64) -> Vec<CrsfFrame> {
    let (mut decoder, mut frames) = (CrsfDecoder::default(), Vec::new());
    for (piece, number) in pieces.iter().zip(1..) {
        decoder.feed(piece, number * pause_us, |frame| frames.push(frame));
    }
    frames
}

fn sbus(pieces: &[&[u8]], pause_us: u64) -> Vec<SbusFrame> {
    let (mut decoder, mut frames) = (SbusDecoder::default(), Vec::new());
    for (piece, number) in pieces.iter().zip(1..) {
        decoder.feed(piece, 10_000 + number * pause_us, |frame| frames.push(frame));
    }
    frames
}

/// Flies by both decoders, in pieces as long as the first bytes say.
fn fly(mut bytes: &[u8]) {
    let settings = RadioSettings::DEFAULT;
    let (mut crsf, mut sbus, mut now_us, mut frames) = (CrsfDecoder::default(), SbusDecoder::default(), 0, 0_u32);
    let (mut link, mut pilot) = (RadioLink::default(), RadioPilot::default());
    while let [length, pause, rest @ ..] = bytes {
        let (piece, rest) = rest.split_at(usize::from(*length % 64).min(rest.len()));
        bytes = rest;
        now_us += u64::from(*pause) * 100;
        let inputs = PilotInputs { now_us, armed: false, mode: FlightMode::Hold };
        crsf.feed(piece, now_us, |frame| {
            if let CrsfFrame::Channels(channels) = frame {
                frames += 1;
                link.take(&channels, now_us);
            }
        });
        sbus.feed(piece, now_us, |frame| {
            frames += 1;
            link.take(&frame.channels, now_us);
        });
        let output = pilot.step(&settings, &mut link, &inputs);
        assert!(output.request != Some(Request::Arm) || frames > u32::from(ACQUIRE_FRAMES));
        if let Some(sticks) = output.sticks {
            let all = [sticks.roll, sticks.pitch, sticks.throttle, sticks.yaw];
            assert!(all.iter().all(|stick| (-1.0..=1.0).contains(stick)));
            for mode in FlightMode::ALL {
                let shaped = settings.curves.shape(mode, &sticks);
                assert!([shaped.roll, shaped.pitch, shaped.throttle, shaped.yaw].iter().all(|it| it.abs() <= 1.0));
            }
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let single: Vec<_> = bytes.chunks(1).collect();
    assert_eq!(crsf(&[bytes], 0), crsf(&single, 0));
    assert_eq!(sbus(&[bytes], 0), sbus(&single, 0));
    for frame in crsf(&[bytes], 0) {
        assert_eq!(crsf(&[&frame.encode()], 0), [frame]);
    }
    for frame in sbus(&bytes.chunks(25).collect::<Vec<_>>(), PAUSE_US) {
        assert_eq!(sbus(&[&frame.encode()], 0), [frame]);
    }
    fly(bytes);
});
