//! ESC telemetry: bytes, checksums and the order of requests.

use afbc_drivers::esc_telemetry::{ANSWER_LEN, EscLine, EscReading};
use proptest::collection::vec;
use proptest::prelude::*;
use std::collections::VecDeque;

/// Computes the CRC-8 by polynomial division, bit by bit, as in KISS's description.
fn remainder(bytes: &[u8]) -> u8 {
    let mut register: u16 = 0;
    for bit in bytes.iter().flat_map(|byte| (0..8).rev().map(move |at| byte >> at & 1)).chain([0; 8]) {
        register = register << 1 | u16::from(bit);
        if register & 0x100 != 0 {
            register ^= 0x107;
        }
    }
    register as u8
}

/// Encodes an answer independently of the code under test.
fn encode(temperature: i8, words: [u16; 4]) -> [u8; ANSWER_LEN] {
    let mut bytes = vec![temperature as u8];
    for word in words {
        bytes.extend([(word / 256) as u8, (word % 256) as u8]);
    }
    bytes.push(remainder(&bytes));
    bytes.try_into().unwrap()
}

prop_compose! {
    fn any_answer()(temperature in any::<i8>(), words in any::<[u16; 4]>()) -> (EscReading, [u8; ANSWER_LEN]) {
        let [voltage_cv, current_ca, consumed_mah, erpm_hundreds] = words;
        let reading =
            EscReading { temperature_c: temperature, voltage_cv, current_ca, consumed_mah, erpm_hundreds };
        (reading, encode(temperature, words))
    }
}

proptest! {
    #[test]
    fn answers_are_read_and_written((reading, bytes) in any_answer()) {
        prop_assert_eq!(EscReading::from_bytes(&bytes), Some(reading));
        prop_assert_eq!(reading.to_bytes(), bytes);
    }

    /// The CRC-8 detects every flipped bit, every two in ten bytes, and every burst of up to eight.
    #[test]
    fn flipped_bits_are_found(
        (_, bytes) in any_answer(), first in 0..80_usize, second in 0..80_usize, burst in 1..=255_u16,
    ) {
        let flip = |bytes: &mut [u8; ANSWER_LEN], bit: usize| bytes[bit / 8] ^= 0x80 >> (bit % 8);
        let mut once = bytes;
        flip(&mut once, first);
        prop_assert_eq!(EscReading::from_bytes(&once), None);
        let mut twice = once;
        flip(&mut twice, second);
        prop_assert_eq!(EscReading::from_bytes(&twice).is_some(), first == second);
        let mut burnt = bytes;
        (0..8).filter(|at| burst >> at & 1 != 0 && first + at < 80).for_each(|at| flip(&mut burnt, first + at));
        prop_assert!(burnt == bytes || EscReading::from_bytes(&burnt).is_none());
    }

    /// No answer is assigned to another ESC, and noise counts as an answer only if its checksum fits.
    #[test]
    fn noise_is_no_answer(bytes in vec(any::<u8>(), 0..400), pauses in vec(0..3_000_u64, 400)) {
        let (mut line, mut now_us, mut fits) = (EscLine::new(4), 0, 0);
        let (mut since, mut asked) = (Vec::new(), None);
        for (byte, pause_us) in bytes.iter().zip(pauses) {
            now_us += pause_us;
            if let Some(controller) = line.ask(now_us) {
                asked = Some(controller);
                since.clear();
            }
            since.push(*byte);
            if let Some((controller, reading)) = line.take(now_us, *byte) {
                prop_assert_eq!(Some(controller), asked);
                prop_assert!(since.ends_with(&reading.to_bytes()));
                fits += 1;
            }
        }
        prop_assert!(fits <= bytes.len() / ANSWER_LEN);
    }

    /// Late answers, caused by frames that wait for up to 5 ms and by slow ESCs, may be assigned to the wrong ESC. This
    /// ends within 0.4 s after all ESCs answer in time again. Lost answers never cause a wrong assignment.
    #[test]
    fn late_answers_do_not_stay_in_wrong_turns(
        late_ms in vec(prop_oneof![19 => Just(0), 1 => 5..40_u64], 400),
        waits in vec(prop::bool::weighted(0.1), 400),
        loses in any::<bool>(),
        begins_us in 100..2_500_u64,
    ) {
        let (mut line, mut latched, mut sent) = (EscLine::new(4), None, 0);
        let mut answers = VecDeque::<(u64, u8)>::new();
        let (mut right, mut waited) = (0, 0);
        for tick in 0..3_000_u64 {
            let now_us = tick * 1_000;
            let is_trouble = tick < 1_000;
            // Bytes received since the last tick come before the next request.
            while answers.front().is_some_and(|(at_us, _)| *at_us <= now_us) {
                let (_, who) = answers.pop_front().unwrap();
                let bytes = EscReading { voltage_cv: who.into(), ..EscReading::default() }.to_bytes();
                for (controller, reading) in bytes.iter().filter_map(|byte| line.take(now_us, *byte)) {
                    let is_right = reading.voltage_cv == u16::from(controller);
                    prop_assert!(is_right || !loses && tick < 1_400, "tick {}: {} as {}", tick, who, controller);
                    right += u32::from(is_right && tick >= 2_000);
                }
            }
            latched = line.ask(now_us).or(latched);
            let frame_us = now_us + 700;
            // After a longer time the driver would give up the question, and could take its late answer for the answer
            // to the next question.
            if is_trouble && waits[tick as usize % 400] && waited < 5 {
                waited += 1;
                continue;
            }
            waited = 0;
            if let Some(who) = latched.take() {
                sent += 1;
                let late_us = 1_000 * late_ms[sent % 400];
                if is_trouble && loses && late_us > 5_000 {
                    continue;
                }
                let delay_us = begins_us + if is_trouble && !loses { late_us } else { 0 };
                // The line carries only one answer at a time.
                let free_us = answers.back().map_or(0, |(end_us, _)| *end_us);
                answers.push_back(((frame_us + delay_us).max(free_us) + 870, who));
            }
        }
        prop_assert!(right >= 180, "{} in the last second", right);
    }

    /// Any motor's speed survives encoding and decoding within the resolution, and is never rounded up.
    #[test]
    fn speeds_come_back(speed_rad_s in 0.0..4_000.0_f32, pairs in 1..=20_u32) {
        let poles = 2 * pairs;
        let erpm_hundreds = EscReading::erpm_hundreds_of(speed_rad_s, poles);
        let told = EscReading { erpm_hundreds, ..EscReading::default() };
        let resolution = 100.0 * core::f32::consts::TAU / 60.0 / pairs as f32;
        let limit = 65_535.0 * resolution;
        let back = told.speed_rad_s(poles);
        prop_assert!(back <= speed_rad_s * 1.000_01);
        prop_assert!(back >= speed_rad_s.min(limit) - 1.001 * resolution, "{} {}", back, speed_rad_s);
    }
}

/// CRC catalogues have this check value over "123456789".
#[test]
fn the_checksum_is_crc_8_smbus() {
    let mut bytes = [0; ANSWER_LEN];
    bytes[..9].copy_from_slice(b"123456789");
    bytes[9] = 0xF4;
    let reading = EscReading::from_bytes(&bytes).unwrap();
    assert_eq!((reading.temperature_c, reading.voltage_cv, reading.erpm_hundreds), (0x31, 0x3233, 0x3839));
}

/// A motor of 14 poles at 10,000 rev/min turns at 70,000 electrical rev/min.
#[test]
fn a_usual_motor() {
    let reading = EscReading { erpm_hundreds: 700, ..EscReading::default() };
    assert!((reading.speed_rad_s(14) - 1047.2).abs() < 0.1);
}

/// ESCs are asked in turn. One that does not answer costs ten milliseconds, a wrong answer only its own turn.
#[test]
fn each_is_asked_in_turn() {
    let mut line = EscLine::new(3);
    let answer = EscReading { erpm_hundreds: 7, ..EscReading::default() }.to_bytes();
    let mut heard = Vec::new();
    for tick in 0..1_000_u64 {
        let now_us = 1_000 * tick;
        // The second ESC is dead.
        let asked = line.ask(now_us);
        if let Some(controller) = asked.filter(|controller| *controller != 1) {
            let mut answer = answer;
            if tick % 10 == 7 {
                answer[3] ^= 4;
            }
            heard.extend(answer.iter().filter_map(|byte| line.take(now_us + 900, *byte)).map(|(who, _)| {
                assert_eq!(who, controller);
                who
            }));
        }
    }
    let count = |who| heard.iter().filter(|other| **other == who).count();
    assert_eq!(count(1), 0);
    // A round takes 12 ms, with 4 ms of silence after 64 requests. At most a fifth of the answers are spoilt.
    assert!(count(0) >= 60 && count(2) >= 60, "{} {}", count(0), count(2));
    assert!(line.missing_answers() >= 80 && line.bad_answers() > 0);
}

#[test]
fn a_line_without_controllers_asks_nobody() {
    let mut line = EscLine::new(0);
    assert_eq!(line.ask(0), None);
    assert_eq!(line.take(5, 1), None);
}

/// After half an answer and a pause, the next bytes begin a new answer.
#[test]
fn half_an_answer_is_forgotten() {
    let mut line = EscLine::new(1);
    let answer = EscReading { voltage_cv: 1_480, ..EscReading::default() }.to_bytes();
    assert_eq!(line.ask(0), Some(0));
    assert!(answer[..5].iter().all(|byte| line.take(1_000, *byte).is_none()));
    let heard: Vec<_> = answer.iter().filter_map(|byte| line.take(4_000, *byte)).collect();
    assert_eq!(heard.len(), 1);
    assert_eq!(heard[0].1.voltage_cv, 1_480);
}
