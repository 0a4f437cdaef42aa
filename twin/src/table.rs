//! The faults.

use crate::cuts::lose_memory;
use crate::trouble::{Outcome, Trouble};
use rigless::chip::uart::Rate;
use rigless::edge::Edge;
use rigless::emulator::InterruptLine;

/// A fault.
pub struct Row {
    pub name: &'static str,
    pub what: &'static str,
    /// The worst that it may lead to.
    pub expected: Outcome,
    /// For how long the vehicle is watched at least [ms].
    pub watch_ms: u64,
    /// What it does, from its beginning on, at every access and stop of the models.
    pub act: fn(&mut Trouble<'_>),
}

/// The chips that have places: as in `MatekH743::CHIPS`.
const FIRST: usize = 0;
const SECOND: usize = 1;
/// UARTs among the chip's, and their interrupt lines (RM0433, table 147).
const TELEMETRY: (usize, u16) = (6, 82);
const GNSS: (usize, u16) = (1, 38);

const MS: u64 = 1_000_000;

const fn row(
    name: &'static str,
    what: &'static str,
    expected: Outcome,
    watch_ms: u64,
    act: fn(&mut Trouble<'_>),
) -> Row {
    Row { name, what, expected, watch_ms, act }
}

use Outcome::{FliesOn, Lands, Lost};

/// All.
pub const ROWS: &[Row] = &[
    row("none", "nothing", FliesOn, 3_000, |_| ()),
    row("imu-1-silent", "the first IMU answers no more", FliesOn, 3_000, |t| t.conditions.icm42688p_silent = true),
    row("imu-2-silent", "the second IMU answers no more", FliesOn, 3_000, |t| t.conditions.icm42605_silent = true),
    row("imu-1-stuck", "the first IMU repeats itself", FliesOn, 3_000, |t| {
        (t.conditions.icm42688p_rate.stuck, t.conditions.icm42688p_acceleration.stuck) = (true, true);
    }),
    row("imu-1-rate-stuck", "the first IMU's gyroscope alone repeats itself", FliesOn, 3_000, |t| {
        t.conditions.icm42688p_rate.stuck = true;
    }),
    row("imu-1-force-stuck", "the first IMU's accelerometer alone repeats itself", FliesOn, 3_000, |t| {
        t.conditions.icm42688p_acceleration.stuck = true;
    }),
    row("imu-2-stuck", "the second IMU repeats itself", FliesOn, 3_000, |t| {
        (t.conditions.icm42605_rate.stuck, t.conditions.icm42605_acceleration.stuck) = (true, true);
    }),
    row("imu-1-garbled", "every byte of the first IMU is random", FliesOn, 3_000, |t| t.garble(FIRST)),
    row("imu-2-garbled", "every byte of the second IMU is random", FliesOn, 3_000, |t| t.garble(SECOND)),
    row("imu-1-garbled-0-3-s", "the same of the first for 0.3 s", FliesOn, 3_000, |t| {
        if t.since_ns < 300 * MS {
            t.garble(FIRST);
        }
    }),
    row("imu-1-flip", "one bit of one byte of the first IMU, 20 times in 2 s", FliesOn, 3_000, |t| {
        if t.now_and_then(100 * MS) && t.since_ns < 2_000 * MS {
            t.flip_a_bit(FIRST);
        }
    }),
    row("imu-1-flips", "one bit of the first IMU every 2 ms", FliesOn, 3_000, |t| {
        if t.now_and_then(2 * MS) {
            t.flip_a_bit(FIRST);
        }
    }),
    row("imu-1-drops", "the first IMU loses every third transfer", FliesOn, 3_000, |t| {
        if t.now_and_then(3 * MS)
            && let Some(place) = t.session.board_mut().place(FIRST)
        {
            place.drop_next();
        }
    }),
    row("imu-1-intermittent", "the first IMU comes and goes every 10 ms", FliesOn, 3_000, |t| {
        if t.now_and_then(10 * MS) {
            t.conditions.icm42688p_silent = t.random.next() % 2 == 0;
        }
    }),
    row("imu-1-noisy", "noise of 20 deg/s and 0.3 g on the first IMU", FliesOn, 3_000, |t| {
        t.conditions.icm42688p_rate.noise = [20_000; 3];
        t.conditions.icm42688p_acceleration.noise = [300_000; 3];
    }),
    row("imu-1-rate-biased", "10 deg/s on the first gyroscope", FliesOn, 3_000, |t| {
        t.conditions.icm42688p_rate.bias = [10_000, -10_000, 10_000];
    }),
    row("imu-1-force-biased", "0.2 g on the first accelerometer", FliesOn, 3_000, |t| {
        t.conditions.icm42688p_acceleration.bias = [200_000, -200_000, 200_000];
    }),
    row(
        "imus-in-turn",
        "the first IMU silent for 0.5 s, and a second later the second for good",
        FliesOn,
        3_000,
        |t| {
            t.conditions.icm42688p_silent = t.since_ns < 500 * MS;
            t.conditions.icm42605_silent = t.since_ns > 1_500 * MS;
        },
    ),
    row("imus-silent", "neither IMU answers", Lost, 3_000, |t| {
        (t.conditions.icm42688p_silent, t.conditions.icm42605_silent) = (true, true);
    }),
    row("barometer-silent", "the barometer answers no more", FliesOn, 4_000, |t| t.conditions.dps310_silent = true),
    row("barometer-stuck", "the barometer repeats itself", FliesOn, 4_000, |t| {
        t.conditions.dps310_pressure.stuck = true;
    }),
    row("barometer-wild", "noise of 500 Pa (40 m) on the barometer", FliesOn, 4_000, |t| {
        t.conditions.dps310_pressure.noise = [500];
    }),
    row("barometer-jumps", "300 Pa (25 m) on the barometer", FliesOn, 4_000, |t| {
        t.conditions.dps310_pressure.bias = [300];
    }),
    row("barometer-intermittent", "the barometer comes and goes every 3 ms", FliesOn, 4_000, |t| {
        if t.now_and_then(3 * MS) {
            t.conditions.dps310_silent = t.random.next() % 2 == 0;
        }
    }),
    row("compass-silent", "the compass answers no more", FliesOn, 4_000, |t| t.conditions.qmc5883l_silent = true),
    row("compass-stuck", "the compass repeats itself", FliesOn, 4_000, |t| {
        t.conditions.qmc5883l_field.stuck = true;
    }),
    row("compass-wild", "noise of 50 uT on the compass", FliesOn, 4_000, |t| {
        t.conditions.qmc5883l_field.noise = [50_000; 3];
    }),
    row("compass-intermittent", "the compass comes and goes every 3 ms", FliesOn, 4_000, |t| {
        if t.now_and_then(3 * MS) {
            t.conditions.qmc5883l_silent = t.random.next() % 2 == 0;
        }
    }),
    row("i2c-silent", "neither barometer nor compass answers", FliesOn, 4_000, |t| {
        (t.conditions.dps310_silent, t.conditions.qmc5883l_silent) = (true, true);
    }),
    row("gnss-silent", "the GNSS receiver is silent", Lands, 12_000, |t| t.conditions.gps_silent = true),
    row("gnss-garbled", "every fiftieth byte of the GNSS receiver is wrong", Lands, 12_000, |t| {
        t.conditions.gps_noise_errors = 20_000;
    }),
    row("gnss-wire-broken", "every byte of the GNSS receiver is wrong", Lands, 12_000, |t| {
        t.conditions.gps_framing_errors = Rate::EVERY_WORD;
    }),
    row("telemetry-garbled", "every fiftieth byte to the vehicle is wrong", FliesOn, 4_000, |t| t.garble_link(20_000)),
    row("telemetry-broken", "noise at full rate in place of the station", FliesOn, 3_000, |t| {
        t.garble_link(Rate::EVERY_WORD);
        t.flood();
    }),
    row("uart-storm", "an interrupt of the telemetry's UART every 5 us for 2 s", FliesOn, 3_000, |t| {
        t.storm(TELEMETRY.1);
    }),
    row("uart-storm-gnss", "the same of the GNSS receiver's UART", FliesOn, 3_000, |t| t.storm(GNSS.1)),
    row("reset", "a reset, as of the watchdog", Lost, 3_000, |t| {
        if t.looks == 0 {
            t.session.reset_by_pin(t.at, t.instructions, t.host);
        }
    }),
    row("brown-out", "the supply drops for a moment: the memory's content is random", Lost, 3_000, |t| {
        if t.looks == 0 {
            lose_memory(t.session, t.host, t.random);
            t.session.reset_by_pin(t.at, t.instructions, t.host);
        }
    }),
];

impl Trouble<'_> {
    /// Makes the next byte of a chip random.
    fn garble(&mut self, chip: usize) {
        let mask = self.random.next() & 0xFF;
        if let Some(place) = self.session.board_mut().place(chip) {
            place.flip(mask);
        }
    }

    /// Changes one bit of the next byte of a chip.
    fn flip_a_bit(&mut self, chip: usize) {
        let bit = self.random.below(8);
        if let Some(place) = self.session.board_mut().place(chip) {
            place.flip(1 << bit);
        }
    }

    /// True at random times, on average so far apart.
    fn now_and_then(&mut self, apart_ns: u64) -> bool {
        let is_due = self.since_ns >= *self.kept;
        if is_due {
            *self.kept = self.since_ns + 1 + self.random.below(2 * apart_ns);
        }
        is_due
    }

    /// Lets so many of a million bytes to the vehicle arrive wrong.
    fn garble_link(&mut self, per_million: u32) {
        let errors = self.session.board_mut().mcu.usart[TELEMETRY.0].errors_mut();
        errors.noise = Rate { name: "telemetry.noise_errors", per_million };
    }

    /// Keeps the wire to the vehicle busy.
    fn flood(&mut self) {
        if self.now_and_then(MS) {
            let bytes: Vec<u8> = (0..64).map(|_| self.random.next() as u8).collect();
            self.link.flood(&bytes);
        }
    }

    /// Raises an interrupt every 5 us for two seconds, at the accesses and stops that there are.
    fn storm(&mut self, line: u16) {
        if self.since_ns > 2_000 * MS || self.since_ns < *self.kept {
            return;
        }
        *self.kept = self.since_ns + 5_000;
        if let Some(line) = InterruptLine::new(line) {
            self.session.pulse(line, self.host);
        }
        if self.session.pause().is_none() {
            self.session.pause_at(Some(rigless::time::VirtualNanos(self.at.0 + 5_000)));
        }
    }
}
