//! Telemetry of ESCs over one serial line that they share, in KISS's protocol, which BLHeli_32 and AM32 also use.
//!
//! An ESC answers a DSHOT frame that has the telemetry bit set. The answer is ten bytes at [`BAUD`], high bytes first:
//! temperature, voltage, current, charge, electrical speed and a CRC-8. It does not say which ESC sent it, so one ESC
//! is asked at a time ([`EscLine`]). An answer that comes after the next request would be assigned to the wrong ESC,
//! and so would all later ones. After a request without an answer, and also after every 64 requests, no ESC is asked
//! until the line has been silent.

use heapless::Vec;

/// Baud rate of the line; 8 bits, no parity, one stop bit.
pub const BAUD: u32 = 115_200;
/// Length of an answer \[bytes\].
pub const ANSWER_LEN: usize = 10;
/// Longest time from a request to the end of its answer \[us\]: the request waits for the next frame, ESCs begin to
/// answer within a millisecond or two, and the answer takes 870 us.
const ANSWER_US: u64 = 6_000;
/// Time without a byte after which no answer can be under way \[us\], and the number of requests after which such a
/// silence is required.
const SILENCE_US: u64 = 4_000;
const QUESTIONS: u8 = 64;
/// Longest pause between two bytes of an answer \[us\]: the time of 20 bytes.
const PAUSE_US: u64 = 2_000;

/// Telemetry of one ESC.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EscReading {
    /// Temperature \[deg C\].
    pub temperature_c: i8,
    /// Supply voltage \[0.01 V\].
    pub voltage_cv: u16,
    /// Current \[0.01 A\].
    pub current_ca: u16,
    /// Charge drawn since power-up \[mA h\].
    pub consumed_mah: u16,
    /// Electrical speed \[100 rev/min\]: motor speed times number of pole pairs.
    pub erpm_hundreds: u16,
}

impl EscReading {
    /// Decodes an answer; returns none if its checksum is wrong.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; ANSWER_LEN]) -> Option<Self> {
        let [temperature, v1, v0, i1, i0, q1, q0, n1, n0, checksum] = *bytes;
        let reading = EscReading {
            temperature_c: i8::from_le_bytes([temperature]),
            voltage_cv: u16::from_be_bytes([v1, v0]),
            current_ca: u16::from_be_bytes([i1, i0]),
            consumed_mah: u16::from_be_bytes([q1, q0]),
            erpm_hundreds: u16::from_be_bytes([n1, n0]),
        };
        let [content @ .., _] = bytes;
        (crc8(content) == checksum).then_some(reading)
    }

    /// Encodes the answer as an ESC sends it.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; ANSWER_LEN] {
        let EscReading { temperature_c, voltage_cv, current_ca, consumed_mah, erpm_hundreds } = *self;
        let [temperature] = temperature_c.to_le_bytes();
        let [[v1, v0], [i1, i0], [q1, q0], [n1, n0]] =
            [voltage_cv, current_ca, consumed_mah, erpm_hundreds].map(u16::to_be_bytes);
        let checksum = crc8(&[temperature, v1, v0, i1, i0, q1, q0, n1, n0]);
        [temperature, v1, v0, i1, i0, q1, q0, n1, n0, checksum]
    }

    /// Returns the rotor speed of a motor with this number of magnetic poles \[rad/s\].
    #[must_use]
    pub fn speed_rad_s(&self, poles: u32) -> f32 {
        rotor_rad_s(u32::from(self.erpm_hundreds) * 100, poles)
    }

    /// Returns the electrical speed of a rotor that turns at `speed_rad_s`, as an ESC reports it: rounded down to 100
    /// rev/min and limited to the largest 16-bit number.
    #[must_use]
    pub fn erpm_hundreds_of(speed_rad_s: f32, poles: u32) -> u16 {
        // Pole pairs are half the poles; 60 s per minute; per hundred: 60/(2 100). The cast saturates.
        (speed_rad_s * (0.3 / core::f32::consts::TAU) * poles as f32) as u16
    }
}

/// Returns the rotor speed \[rad/s\] of a motor with this number of magnetic poles at an electrical speed \[rev/min\].
#[must_use]
pub fn rotor_rad_s(electrical_rev_min: u32, poles: u32) -> f32 {
    // One revolution per minute in rad/s; a pair has two poles.
    const RAD_S: f32 = core::f32::consts::TAU / 60.0;
    electrical_rev_min as f32 * (2.0 * RAD_S) / poles.max(2) as f32
}

/// Returns the CRC-8 with polynomial x^8 + x^2 + x + 1, initially 0, highest bit first.
fn crc8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc, _| if crc & 0x80 != 0 { (crc << 1) ^ 0x07 } else { crc << 1 })
    })
}

/// Telemetry line of several ESCs: decides which one to ask, and assigns the answers.
///
/// ```
/// use afbc_drivers::esc_telemetry::{EscLine, EscReading};
///
/// let mut line = EscLine::new(4);
/// assert_eq!(line.ask(1_000), Some(0)); // set the telemetry bit in the next frame to the first
/// let answer = EscReading { erpm_hundreds: 1337, ..EscReading::default() }.to_bytes();
/// let heard: Vec<_> = answer.iter().filter_map(|byte| line.take(2_500, *byte)).collect();
/// assert_eq!(heard.first().map(|(controller, reading)| (*controller, reading.erpm_hundreds)), Some((0, 1337)));
/// assert_eq!(line.ask(3_000), Some(1));
/// ```
#[derive(Clone, Debug)]
pub struct EscLine {
    controllers: u8,
    /// ESC to be asked next.
    next: u8,
    /// ESC that was asked, and the time \[us\].
    asked: Option<(u8, u64)>,
    answer: Vec<u8, ANSWER_LEN>,
    /// Arrival time of the last byte \[us\].
    heard_us: u64,
    /// Beginning of the silence that is being waited for \[us\].
    silent_us: Option<u64>,
    /// Number of requests since the last required silence.
    questions: u8,
    bad_answers: u32,
    missing_answers: u32,
}

impl EscLine {
    /// Creates a line with this number of ESCs; none has been asked.
    #[must_use]
    pub const fn new(controllers: u8) -> Self {
        EscLine {
            controllers,
            next: 0,
            asked: None,
            answer: Vec::new(),
            heard_us: 0,
            silent_us: None,
            questions: 0,
            bad_answers: 0,
            missing_answers: 0,
        }
    }

    /// Returns the ESC to ask now, each in turn. Returns none while an answer or silence is awaited. To be called
    /// before each DSHOT frame. If a frame is sent without the request, one answer is lost, nothing more.
    pub fn ask(&mut self, now_us: u64) -> Option<u8> {
        if let Some((_, asked_us)) = self.asked {
            if now_us.saturating_sub(asked_us) < ANSWER_US {
                return None;
            }
            self.missing_answers = self.missing_answers.saturating_add(1);
            (self.asked, self.silent_us) = (None, Some(now_us));
        }
        if self.silent_us.is_some_and(|silent_us| now_us.saturating_sub(silent_us) < SILENCE_US)
            || self.controllers == 0
        {
            return None;
        }
        self.silent_us = None;
        if self.questions == QUESTIONS {
            (self.questions, self.silent_us) = (0, Some(now_us));
            return None;
        }
        self.questions = self.questions.saturating_add(1);
        let controller = self.next;
        self.next = if controller + 1 < self.controllers { controller + 1 } else { 0 };
        self.asked = Some((controller, now_us));
        self.answer.clear();
        Some(controller)
    }

    /// Takes a byte that arrived at `now_us`; returns an ESC's telemetry once its answer is complete. Drops bytes that
    /// nobody asked for, and then requires silence before the next request. Drops answers with a wrong checksum.
    pub fn take(&mut self, now_us: u64, byte: u8) -> Option<(u8, EscReading)> {
        let Some((controller, _)) = self.asked else {
            self.silent_us = Some(now_us);
            return None;
        };
        // A byte was lost: only the pause shows where an answer begins.
        if now_us.saturating_sub(self.heard_us) > PAUSE_US {
            self.answer.clear();
        }
        self.heard_us = now_us;
        // The answer cannot overflow. A complete answer ends the request, and the next request clears it.
        let _ = self.answer.push(byte);
        let answer: &[u8; ANSWER_LEN] = self.answer.as_slice().try_into().ok()?;
        let reading = EscReading::from_bytes(answer);
        self.asked = None;
        if reading.is_none() {
            self.bad_answers = self.bad_answers.saturating_add(1);
        }
        reading.map(|reading| (controller, reading))
    }

    /// Returns the number of answers since power-up with a wrong checksum.
    #[must_use]
    pub fn bad_answers(&self) -> u32 {
        self.bad_answers
    }

    /// Returns the number of requests since power-up that were not answered in time.
    #[must_use]
    pub fn missing_answers(&self) -> u32 {
        self.missing_answers
    }
}
