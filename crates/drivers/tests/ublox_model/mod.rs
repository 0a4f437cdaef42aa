//! Model of a u-blox receiver on a UART, from the interface descriptions (M8 UBX-13003221, M10 UBX-21035062): its
//! answers, its periodic messages and the effects of a reset.

use std::collections::VecDeque;

/// Receiver generations, which are configured differently.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Generation {
    /// Configured by messages; no NAV-PVT.
    Six,
    /// Configured by messages.
    Eight,
    /// Configured by keys.
    Ten,
}

/// True state that the receiver measures, in its own units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Truth {
    /// Latitude and longitude \[1e-7 degrees\].
    pub(crate) place: [i32; 2],
    /// Altitude above mean sea level \[mm\].
    pub(crate) altitude_mm: i32,
    /// Velocity to the north, east and down \[mm/s\].
    pub(crate) velocity_mm_s: [i32; 3],
    /// `hAcc`, `vAcc` \[mm\] and `sAcc` \[mm/s\].
    pub(crate) accuracies: [u32; 3],
    /// `fixType`.
    pub(crate) fix_type: u8,
    /// `flags`, `flags3`.
    pub(crate) flags: [u8; 2],
}

impl Truth {
    pub(crate) const ZURICH: Self = Truth {
        place: [473_977_420, 85_455_940],
        altitude_mm: 488_000,
        velocity_mm_s: [1_200, -340, 560],
        accuracies: [900, 1_400, 120],
        fix_type: 3,
        flags: [1, 0],
    };
}

/// Time from an epoch to the first byte of its solution \[us\].
pub(crate) const DELAY_US: u64 = 110_000;

/// Model of the receiver.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    generation: Generation,
    new_baud: u32,
    /// Current baud rate of its UART.
    pub(crate) baud: u32,
    pub(crate) nmea: bool,
    pub(crate) solves: bool,
    pub(crate) period_us: u64,
    pub(crate) dynamic_model: u8,
    /// True if the receiver ignores all input; `refuses` are the message ids that it refuses.
    pub(crate) deaf: bool,
    pub(crate) refuses: Vec<u8>,
    /// Delay from a command to its answer.
    pub(crate) answers_after_us: u64,
    pub(crate) truth: Truth,
    epoch_us: u64,
    /// Epochs whose messages are not sent yet, with the truth at their time.
    due: VecDeque<(u64, Truth)>,
    heard: Vec<u8>,
    now_us: u64,
    /// Answers to be sent, with their times.
    answers: VecDeque<(u64, [u8; 2], [u8; 2])>,
    /// Bytes to be sent.
    pub(crate) says: VecDeque<u8>,
}

impl Model {
    /// Creates a receiver as delivered, with its usual baud rate.
    pub(crate) fn new(generation: Generation) -> Self {
        Self::at(generation, if generation == Generation::Ten { 38_400 } else { 9_600 })
    }

    /// Creates a receiver that starts at this baud rate.
    pub(crate) fn at(generation: Generation, new_baud: u32) -> Self {
        let mut model = Model {
            generation,
            new_baud,
            baud: 0,
            nmea: false,
            solves: false,
            period_us: 0,
            dynamic_model: 0,
            deaf: false,
            refuses: Vec::new(),
            answers_after_us: 0,
            truth: Truth::ZURICH,
            epoch_us: 0,
            due: VecDeque::new(),
            heard: Vec::new(),
            now_us: 0,
            answers: VecDeque::new(),
            says: VecDeque::new(),
        };
        model.reset();
        model
    }

    /// Resets the receiver; its configuration in RAM is lost.
    pub(crate) fn reset(&mut self) {
        (self.baud, self.nmea, self.solves) = (self.new_baud, true, false);
        (self.period_us, self.dynamic_model) = (1_000_000, 0);
        (self.due, self.heard, self.says) = Default::default();
    }

    /// Advances to `now_us`: measures, and sends the messages that are due.
    pub(crate) fn advance(&mut self, now_us: u64) {
        self.now_us = now_us;
        while self.answers.front().is_some_and(|(due_us, ..)| *due_us <= now_us) {
            let Some((_, id, to)) = self.answers.pop_front() else { break };
            self.say(id, &to);
        }
        while self.epoch_us + self.period_us <= now_us {
            self.epoch_us += self.period_us;
            self.due.push_back((self.epoch_us, self.truth));
        }
        while self.due.front().is_some_and(|(epoch_us, _)| epoch_us + DELAY_US <= now_us) {
            let Some((epoch_us, truth)) = self.due.pop_front() else { break };
            self.report(epoch_us, &truth);
        }
    }

    /// Sends the messages of an epoch.
    pub(crate) fn report(&mut self, epoch_us: u64, truth: &Truth) {
        if self.nmea {
            self.says.extend(sentences(epoch_us, truth).bytes());
        }
        if self.solves {
            self.say([0x01, 0x07], &solution(epoch_us, truth));
        }
    }

    fn say(&mut self, id: [u8; 2], payload: &[u8]) {
        self.says.extend(frame(id, payload));
    }

    /// Receives a byte at the receiver's baud rate.
    pub(crate) fn hear(&mut self, byte: u8) {
        if self.deaf {
            return;
        }
        self.heard.push(byte);
        while let Some(at) = self.heard.iter().position(|byte| *byte == 0xB5) {
            self.heard.drain(..at);
            let [_, second, class, number, low, high, rest @ ..] = self.heard.as_slice() else { return };
            let (id, length) = ([*class, *number], usize::from(u16::from_le_bytes([*low, *high])));
            if *second != 0x62 || length > 200 {
                self.heard.remove(0);
                continue;
            }
            let Some(payload) = rest.get(..length).map(<[u8]>::to_vec) else { return };
            let whole = frame(id, &payload);
            let Some(same) = self.heard.get(..whole.len()).map(|heard| heard == whole) else { return };
            self.heard.drain(..if same { whole.len() } else { 1 });
            if same {
                self.obey(id, &payload);
            }
        }
        self.heard.clear();
    }

    fn obey(&mut self, id: [u8; 2], payload: &[u8]) {
        if (id, payload.len()) == ([0x0A, 0x04], 0) {
            let version = self.version();
            return self.say([0x0A, 0x04], &version);
        }
        let [class, number] = id;
        if class != 0x06 {
            return;
        }
        let obeys = !self.refuses.contains(&number) && self.configure(number, payload).is_some();
        let answer = [0x05, u8::from(obeys)];
        if self.answers_after_us == 0 {
            return self.say(answer, &id);
        }
        self.answers.push_back((self.now_us + self.answers_after_us, answer, id));
    }

    /// Returns texts of 30 bytes each; the second, the hardware version, has 10.
    fn version(&self) -> Vec<u8> {
        let texts: &[&str] = match self.generation {
            Generation::Six => &["7.03 (45969)", "00040007"],
            Generation::Eight => &["ROM CORE 3.01 (107888)", "00080000", "FWVER=SPG 3.01", "PROTVER=18.00", "GPS;GLO"],
            Generation::Ten => {
                &["ROM SPG 5.10 (7b202e)", "000A0000", "FWVER=SPG 5.10", "PROTVER=34.10", "GPS;GLO;GAL;BDS"]
            }
        };
        let pad = |(place, text): (usize, &&str)| {
            let mut text = text.as_bytes().to_vec();
            text.resize(if place == 1 { 10 } else { 30 }, 0);
            text
        };
        texts.iter().enumerate().flat_map(pad).collect()
    }

    /// Applies a CFG message; returns none for an unknown one.
    fn configure(&mut self, number: u8, payload: &[u8]) -> Option<()> {
        match (self.generation == Generation::Ten, number, payload) {
            // VALSET without a transaction, in RAM.
            (true, 0x8A, [0, 1, _, _, items @ ..]) => self.set(items),
            (false, 0x01, [0x01, 0x07, rate]) if self.generation != Generation::Six => {
                self.solves = *rate > 0;
                Some(())
            }
            (false, 0x24, [mask, _, model, ..]) if payload.len() == 36 => {
                if mask & 1 != 0 {
                    self.dynamic_model = *model;
                }
                Some(())
            }
            // UART 1, 8N1; one reserved bit may have either value.
            (false, 0x00, [1, _, _, _, 0xC0 | 0xD0, 0x08, 0, 0, a, b, c, d, input, 0, output, 0, _, _, _, _]) => {
                self.baud = u32::from_le_bytes([*a, *b, *c, *d]);
                (self.nmea, self.solves) = (output & 2 != 0, self.solves && output & 1 != 0);
                self.deaf = input & 1 == 0;
                Some(())
            }
            (false, 0x08, [low, high, 1, 0, _, 0]) => {
                self.period_us = u64::from(u16::from_le_bytes([*low, *high])) * 1000;
                Some(())
            }
            _ => None,
        }
    }

    fn set(&mut self, mut items: &[u8]) -> Option<()> {
        while let Some((key, rest)) = items.split_first_chunk::<4>() {
            let key = u32::from_le_bytes(*key);
            let size = [0, 1, 1, 2, 4, 8].get(key as usize >> 28 & 7).copied()?;
            let (value, rest) = rest.split_at_checked(size)?;
            let number = value.iter().rev().fold(0, |number: u64, byte| number << 8 | u64::from(*byte));
            match key {
                0x4052_0001 => self.baud = number as u32,
                0x1074_0002 => self.nmea = number != 0,
                0x2091_0007 => self.solves = number != 0,
                0x2011_0021 => self.dynamic_model = number as u8,
                0x3021_0001 => self.period_us = number * 1000,
                _ => return None,
            }
            items = rest;
        }
        Some(())
    }
}

/// Returns a frame: header, payload, and the checksum of all but the first two bytes.
pub(crate) fn frame([class, number]: [u8; 2], payload: &[u8]) -> Vec<u8> {
    let [low, high] = (payload.len() as u16).to_le_bytes();
    let mut bytes = vec![0xB5, 0x62, class, number, low, high];
    bytes.extend(payload);
    let (mut a, mut b) = (0_u32, 0_u32);
    for byte in bytes.iter().skip(2) {
        a += u32::from(*byte);
        b += a;
    }
    bytes.extend([a as u8, b as u8]);
    bytes
}

/// Returns the payload of NAV-PVT.
pub(crate) fn solution(epoch_us: u64, truth: &Truth) -> Vec<u8> {
    let Truth { place: [latitude, longitude], altitude_mm, velocity_mm_s, accuracies, fix_type, flags } = *truth;
    let mut bytes = ((epoch_us / 1000) as u32).to_le_bytes().to_vec();
    // Date and time: 2026-11-26 02:00.
    bytes.extend([0xEA, 0x07, 11, 26, 2, 0, 0, 7, 50, 0, 0, 0, 0, 0, 0, 0]);
    bytes.extend([fix_type, flags[0], 0, 14]);
    for number in [longitude, latitude, altitude_mm + 47_000, altitude_mm] {
        bytes.extend(number.to_le_bytes());
    }
    for accuracy in &accuracies[..2] {
        bytes.extend(accuracy.to_le_bytes());
    }
    for speed in velocity_mm_s {
        bytes.extend(speed.to_le_bytes());
    }
    let [north, east, _] = velocity_mm_s.map(f64::from);
    bytes.extend((north.hypot(east) as i32).to_le_bytes());
    bytes.extend(((east.atan2(north).to_degrees() * 1e5) as i32).to_le_bytes());
    bytes.extend(accuracies[2].to_le_bytes());
    bytes.extend([0, 0, 0, 1, 130, 0, flags[1]]);
    bytes.resize(92, 0);
    bytes
}

/// Returns RMC and GGA, with the speed first, as u-blox sends them.
fn sentences(epoch_us: u64, truth: &Truth) -> String {
    let Truth { place: [latitude, longitude], altitude_mm, velocity_mm_s: [north, east, _], fix_type, .. } = *truth;
    let sentence = |text: String| format!("${text}*{:02X}\r\n", text.bytes().fold(0, |sum, byte| sum ^ byte));
    let second = epoch_us / 1_000_000;
    let (h, m, s, hundredths) = (second / 3600 % 24, second / 60 % 60, second % 60, epoch_us / 10_000 % 100);
    let time = format!("{h:02}{m:02}{s:02}.{hundredths:02}");
    let angle = |angle: i32, digits: usize, [positive, negative]: [char; 2]| {
        let minutes = u64::from(angle.unsigned_abs()) * 60 / 100;
        let (whole, rest) = (minutes / 6_000_000, minutes % 6_000_000);
        let letter = if angle < 0 { negative } else { positive };
        format!("{whole:0digits$}{:02}.{:05},{letter}", rest / 100_000, rest % 100_000)
    };
    let place = format!("{},{}", angle(latitude, 2, ['N', 'S']), angle(longitude, 3, ['E', 'W']));
    let (north, east) = (f64::from(north) * 1e-3, f64::from(east) * 1e-3);
    let (knots, course) = (north.hypot(east) / 0.514_444, east.atan2(north).to_degrees().rem_euclid(360.0));
    let (valid, quality) = if fix_type == 3 { ('A', 1) } else { ('V', 0) };
    let altitude = f64::from(altitude_mm) * 1e-3;
    sentence(format!("GNRMC,{time},{valid},{place},{knots:.3},{course:.2},261126,,,A"))
        + &sentence(format!("GNGGA,{time},{place},{quality},12,0.80,{altitude:.1},M,47.0,M,,"))
        + &sentence("GPGSV,1,1,01,05,45,120,40".into())
}
