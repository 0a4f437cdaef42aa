//! Table of the faults.

use crate::fault_injection::{FaultContext, FaultOutcome};
use rigless::chip::uart::Rate;
use rigless::time::VirtualNanos;

/// Fault at a board's pins.
pub struct PinFault {
    pub name: &'static str,
    pub what: &'static str,
    /// Number of inertial sensors that a board needs for this fault.
    pub imus: usize,
    /// Worst acceptable outcome on a board with no, one and two inertial sensors.
    expected: [FaultOutcome; 3],
    /// Least time for which the flight is watched [ms].
    pub watch_ms: u64,
    /// Action of the fault, called from its start at every access and stop of the models.
    pub act: fn(&mut FaultContext<'_>),
}

/// Indices of the inertial sensors.
const FIRST: usize = 0;
const SECOND: usize = 1;
/// Indices of the UARTs in `Machine::UART_INTERRUPTS`.
const TELEMETRY: usize = 0;
const GNSS: usize = 1;

const MS: u64 = 1_000_000;

const fn row(
    name: &'static str,
    what: &'static str,
    expected: FaultOutcome,
    watch_ms: u64,
    act: fn(&mut FaultContext<'_>),
) -> PinFault {
    PinFault { name, what, imus: 1, expected: [expected; 3], watch_ms, act }
}

impl PinFault {
    /// Restricts the fault to boards with two inertial sensors.
    const fn of_two(self) -> Self {
        PinFault { imus: 2, ..self }
    }

    /// Extends the fault to boards without sensors.
    const fn of_any(self) -> Self {
        PinFault { imus: 0, ..self }
    }

    /// Sets the worst outcome for boards with one inertial sensor, which have no second one to switch to.
    const fn with_one(self, expected: FaultOutcome) -> Self {
        let [none, _, two] = self.expected;
        PinFault { expected: [none, expected, two], ..self }
    }

    /// Accepts the loss of a board without sensors, whose state comes over the link.
    const fn lost_without(self) -> Self {
        let [_, one, two] = self.expected;
        PinFault { expected: [FaultOutcome::Lost, one, two], ..self }
    }

    /// Returns the worst acceptable outcome on a board with this many inertial sensors.
    pub fn expected(&self, imus: usize) -> FaultOutcome {
        self.expected[imus.min(2)]
    }
}

use FaultOutcome::{FliesOn, Lands, Lost};

/// All faults.
pub const ROWS: &[PinFault] = &[
    row("none", "nothing", FliesOn, 3_000, |_| ()).of_any(),
    row("imu-1-silent", "the first IMU stops answering", FliesOn, 3_000, |t| t.impairments.imus[FIRST].silent = true)
        .with_one(Lost),
    row("imu-2-silent", "the second IMU stops answering", FliesOn, 3_000, |t| t.impairments.imus[SECOND].silent = true)
        .of_two(),
    row("imu-1-stuck", "the first IMU repeats its last sample", FliesOn, 3_000, |t| {
        (t.impairments.imus[FIRST].rate.stuck, t.impairments.imus[FIRST].force.stuck) = (true, true);
    })
    .with_one(Lost),
    row("imu-1-rate-stuck", "the first IMU's gyroscope alone repeats its last sample", FliesOn, 3_000, |t| {
        t.impairments.imus[FIRST].rate.stuck = true;
    })
    .with_one(Lost),
    row("imu-1-force-stuck", "the first IMU's accelerometer alone repeats its last sample", FliesOn, 3_000, |t| {
        t.impairments.imus[FIRST].force.stuck = true;
    })
    .with_one(Lost),
    row("imu-2-stuck", "the second IMU repeats its last sample", FliesOn, 3_000, |t| {
        (t.impairments.imus[SECOND].rate.stuck, t.impairments.imus[SECOND].force.stuck) = (true, true);
    })
    .of_two(),
    row("imu-1-garbled", "every byte of the first IMU is random", FliesOn, 3_000, |t| t.garble(FIRST)).with_one(Lost),
    row("imu-2-garbled", "every byte of the second IMU is random", FliesOn, 3_000, |t| t.garble(SECOND)).of_two(),
    row("imu-1-garbled-0-3-s", "every byte of the first IMU is random for 0.3 s", FliesOn, 3_000, |t| {
        if t.since_ns < 300 * MS {
            t.garble(FIRST);
        }
    })
    .with_one(Lost),
    row("imu-1-flip", "one bit of one byte of the first IMU flips, 20 times in 2 s", FliesOn, 3_000, |t| {
        if t.now_and_then(100 * MS) && t.since_ns < 2_000 * MS {
            t.flip_a_bit(FIRST);
        }
    }),
    row("imu-1-flips", "one bit of the first IMU flips every 2 ms", FliesOn, 3_000, |t| {
        if t.now_and_then(2 * MS) {
            t.flip_a_bit(FIRST);
        }
    }),
    row("imu-1-drops", "the first IMU loses every third transfer", FliesOn, 3_000, |t| t.drop_every_third(FIRST)),
    row("imu-1-intermittent", "the first IMU comes and goes every 10 ms", FliesOn, 3_000, |t| {
        if t.now_and_then(10 * MS) {
            t.impairments.imus[FIRST].silent = t.random.next() % 2 == 0;
        }
    })
    // An IMU that is silent for 20 ms is set up again, which takes 0.15 s without readings.
    .with_one(Lost),
    row("imu-1-noisy", "noise of 20 deg/s and 0.3 g on the first IMU", FliesOn, 3_000, |t| {
        t.impairments.imus[FIRST].rate.noise = [20_000; 3];
        t.impairments.imus[FIRST].force.noise = [300_000; 3];
    }),
    row("imu-1-rate-biased", "offset of 10 deg/s on the first gyroscope", FliesOn, 3_000, |t| {
        t.impairments.imus[FIRST].rate.bias = [10_000, -10_000, 10_000];
    })
    .with_one(Lost),
    row("imu-1-force-biased", "offset of 0.2 g on the first accelerometer", FliesOn, 3_000, |t| {
        t.impairments.imus[FIRST].force.bias = [200_000, -200_000, 200_000];
    })
    .with_one(Lost),
    row(
        "imus-in-turn",
        "the first IMU is silent for 0.5 s; 1 s later the second IMU falls silent for good",
        FliesOn,
        3_000,
        |t| {
            t.impairments.imus[FIRST].silent = t.since_ns < 500 * MS;
            t.impairments.imus[SECOND].silent = t.since_ns > 1_500 * MS;
        },
    )
    .of_two(),
    row("imus-silent", "neither IMU answers", Lost, 3_000, |t| {
        (t.impairments.imus[FIRST].silent, t.impairments.imus[SECOND].silent) = (true, true);
    })
    .of_two(),
    row("barometer-silent", "the barometer stops answering", FliesOn, 4_000, |t| t.impairments.barometer.silent = true),
    row("barometer-stuck", "the barometer repeats its last sample", FliesOn, 4_000, |t| {
        t.impairments.barometer.pressure.stuck = true;
    }),
    row("barometer-wild", "noise of 500 Pa (40 m) on the barometer", FliesOn, 4_000, |t| {
        t.impairments.barometer.pressure.noise = [500];
    }),
    row("barometer-jumps", "offset of 300 Pa (25 m) on the barometer", FliesOn, 4_000, |t| {
        t.impairments.barometer.pressure.bias = [300];
    }),
    row("barometer-intermittent", "the barometer comes and goes every 3 ms", FliesOn, 4_000, |t| {
        if t.now_and_then(3 * MS) {
            t.impairments.barometer.silent = t.random.next() % 2 == 0;
        }
    }),
    row("compass-silent", "the compass stops answering", FliesOn, 4_000, |t| t.impairments.compass.silent = true),
    row("compass-stuck", "the compass repeats its last sample", FliesOn, 4_000, |t| {
        t.impairments.compass.field.stuck = true;
    }),
    row("compass-wild", "noise of 50 uT on the compass", FliesOn, 4_000, |t| {
        t.impairments.compass.field.noise = [50_000; 3];
    }),
    row("compass-intermittent", "the compass comes and goes every 3 ms", FliesOn, 4_000, |t| {
        if t.now_and_then(3 * MS) {
            t.impairments.compass.silent = t.random.next() % 2 == 0;
        }
    }),
    row("i2c-silent", "neither barometer nor compass answers", FliesOn, 4_000, |t| {
        (t.impairments.barometer.silent, t.impairments.compass.silent) = (true, true);
    }),
    row("gnss-silent", "the GNSS receiver is silent", Lands, 12_000, |t| t.impairments.receiver.silent = true),
    row("gnss-garbled", "every fiftieth byte of the GNSS receiver is wrong", Lands, 12_000, |t| {
        t.impairments.receiver.noise_errors = 20_000;
    }),
    row("gnss-wire-broken", "every byte of the GNSS receiver is wrong", Lands, 12_000, |t| {
        t.impairments.receiver.framing_errors = Rate::EVERY_WORD;
    }),
    row("telemetry-garbled", "every fiftieth byte to the vehicle is wrong", FliesOn, 4_000, |t| {
        t.target.garble_link(20_000)
    })
    .of_any(),
    row("telemetry-broken", "random bytes at full rate reach the link instead of the station's", FliesOn, 3_000, |t| {
        t.target.garble_link(Rate::EVERY_WORD);
        t.flood();
    })
    .of_any()
    .lost_without(),
    row("uart-storm", "an interrupt of the telemetry's UART every 5 us for 2 s", FliesOn, 3_000, |t| {
        t.storm(TELEMETRY);
    })
    .of_any(),
    row(
        "\
         uart-storm-gnss",
        "an interrupt of the GNSS receiver's UART every 5 us for 2 \
         s",
        FliesOn,
        3_000,
        |t| t.storm(GNSS),
    ),
    row("reset", "a reset, as by the watchdog", Lost, 3_000, |t| {
        if t.looks == 0 {
            t.target.reset(t.at, t.instructions, t.host);
        }
    })
    .of_any(),
    row("brown-out", "the supply drops for a moment: the memory's content is random", Lost, 3_000, |t| {
        if t.looks == 0 {
            t.target.lose_memory(t.host, t.random);
            t.target.reset(t.at, t.instructions, t.host);
        }
    })
    .of_any(),
];

impl FaultContext<'_> {
    /// Makes the next byte of an IMU random.
    fn garble(&mut self, chip: usize) {
        let mask = self.random.next() & 0xFF;
        if let Some(place) = self.target.imu(chip) {
            place.flip(mask);
        }
    }

    /// Inverts one random bit of the next byte of an IMU.
    fn flip_a_bit(&mut self, chip: usize) {
        let bit = self.random.below(8);
        if let Some(place) = self.target.imu(chip) {
            place.flip(1 << bit);
        }
    }

    /// Drops every third transfer of an IMU.
    fn drop_every_third(&mut self, chip: usize) {
        if let Some(place) = self.target.imu(chip)
            && place.ended() > *self.kept + 2
        {
            *self.kept = place.ended();
            place.drop_next();
        }
    }

    /// Returns true at random times, `apart_ns` apart on average.
    fn now_and_then(&mut self, apart_ns: u64) -> bool {
        let is_due = self.since_ns >= *self.kept;
        if is_due {
            *self.kept = self.since_ns + 1 + self.random.below(2 * apart_ns);
        }
        is_due
    }

    /// Keeps the wire to the vehicle busy with random bytes.
    fn flood(&mut self) {
        if self.now_and_then(MS) {
            let bytes: Vec<u8> = (0..64).map(|_| self.random.next() as u8).collect();
            self.link.flood(&bytes);
        }
    }

    /// Raises an interrupt every 5 us for two seconds, at the next access or stop of the models.
    fn storm(&mut self, uart: usize) {
        if self.since_ns > 2_000 * MS || self.since_ns < *self.kept {
            return;
        }
        *self.kept = self.since_ns + 5_000;
        self.target.raise(uart, self.host);
        self.target.stop_at(VirtualNanos(self.at.0 + 5_000));
    }
}
