//! Register model of the MPU-6000 and its successors, and of the MPU-9250's AK8963. Sources: RM-MPU-6000A,
//! RM-MPU-6500A, RM-MPU-9250A, DS-000176, RM-000030, DS-000143 and MS1356.

use super::{Model, noise};

/// A part with the given identity.
pub(crate) struct Registers {
    identity: u8,
    registers: [u8; 128],
    reset_us: u64,
    /// Time at which the part woke up.
    awake_us: Option<u64>,
    pub(crate) is_i2c_off: bool,
    pub(crate) rates_deg_s: [f64; 3],
    pub(crate) force_g: [f64; 3],
    pub(crate) temperature_c: f64,
    pub(crate) magnetometer: Option<Magnetometer>,
    /// Factory's self-test codes in the registers from 0 and from 13 on, and the axes' responses \[deg/s, g\].
    pub(crate) trims: [[u8; 4]; 2],
    pub(crate) responses: [f64; 6],
    /// Number of samples processed by the auxiliary I2C master.
    samples: u64,
    external: [u8; 24],
    /// First byte of each slave's answer in `external`, once it has answered.
    slots: [Option<usize>; 4],
}

impl Registers {
    pub(crate) fn new(identity: u8) -> Self {
        let mut part = Registers {
            identity,
            registers: [0; 128],
            reset_us: 0,
            awake_us: None,
            is_i2c_off: false,
            rates_deg_s: [10.0, -250.0, 0.5],
            force_g: [0.1, -0.2, 1.0],
            temperature_c: 31.0,
            magnetometer: None,
            trims: [[0; 4]; 2],
            responses: [0.0; 6],
            samples: 0,
            external: [0; 24],
            slots: [None; 4],
        };
        part.reset(0);
        part
    }

    fn is_icm(&self) -> bool {
        matches!(self.identity, 0x12 | 0xAF | 0x98)
    }

    /// Resets all registers but the magnetometer's to their power-up values.
    fn reset_itself(&mut self, now_us: u64) {
        self.registers = [0; 128];
        // MPU-6500 and MPU-9250 wake up by themselves, with an automatic clock source.
        let wakes = matches!(self.identity, 0x70 | 0x71);
        self.registers[0x6B] = match self.identity {
            0x68 | 0xAF | 0x98 => 0x40,
            0x12 => 0x41,
            _ => 0x01,
        };
        if self.identity == 0x12 {
            self.registers[0x1A] = 0x80;
        }
        (self.reset_us, self.is_i2c_off) = (now_us, false);
        self.awake_us = wakes.then_some(now_us);
        (self.external, self.slots) = ([0; 24], [None; 4]);
    }

    /// Returns the time from a reset until registers can be used \[us\].
    fn restart_us(&self) -> u64 {
        if self.is_icm() { 11_000 } else { 100_000 }
    }

    /// Returns the sample period \[us\].
    fn period_us(&self) -> u64 {
        let (filter, divider) = (self.registers[0x1A] & 7, u64::from(self.registers[0x19]) + 1);
        let is_fast = matches!(filter, 0 | 7);
        if self.identity == 0x68 {
            return divider * if is_fast { 125 } else { 1_000 };
        }
        match self.registers[0x1B] & 3 {
            0 if is_fast => 125,
            0 => 1_000 * divider,
            _ => 31,
        }
    }

    fn data(&self, now_us: u64) -> [u8; 14] {
        let now_us = now_us / self.period_us() * self.period_us();
        let on = |start_us: u64| self.awake_us.is_some_and(|awake_us| now_us >= awake_us + start_us);
        let mut numbers = [0_i16; 7];
        let thermometer = match self.identity {
            0x68 => (self.temperature_c - 36.53) * 340.0,
            0x70 | 0x71 => (self.temperature_c - 21.0) * 333.87,
            _ => (self.temperature_c - 25.0) * 326.8,
        };
        numbers[3] = (thermometer + 3.0 * noise(now_us, 9)).round() as i16;
        let acc = 16384.0 / f64::from(1 << (self.registers[0x1C] >> 3 & 3));
        let gyr = 65536.0 / 500.0 / f64::from(1 << (self.registers[0x1B] >> 3 & 3));
        let clamp = |lsb: f64| lsb.round().clamp(-32768.0, 32767.0) as i16;
        for axis in 0..3 {
            // No data sheet describes this. ArduPilot found the effect of the unnamed register 0x11.
            let is_off = axis == 1 && matches!(self.identity, 0x12 | 0xAF) && self.registers[0x11] != 0xC9;
            let is_pushed = |register: usize| f64::from(self.registers[register] >> (7 - axis) & 1);
            let pushed_g = self.responses[3 + axis] * is_pushed(0x1C);
            let force_g = self.force_g[axis] + pushed_g + if is_off { 0.275 } else { 0.0 };
            let rate_deg_s = self.rates_deg_s[axis] + self.responses[axis] * is_pushed(0x1B);
            if on(30_000) && self.registers[0x6C] >> (5 - axis) & 1 == 0 {
                numbers[axis] = clamp(force_g * acc + 7.0 * noise(now_us, axis as u64));
            }
            if on(35_000) && self.registers[0x6C] >> (2 - axis) & 1 == 0 {
                numbers[4 + axis] = clamp(rate_deg_s * gyr + 2.0 * noise(now_us, 4 + axis as u64));
            }
        }
        let mut bytes = [0; 14];
        for (pair, number) in bytes.chunks_exact_mut(2).zip(numbers) {
            pair.copy_from_slice(&number.to_be_bytes());
        }
        bytes
    }

    /// Lets the auxiliary I2C master process the samples that are due.
    fn advance(&mut self, now_us: u64) {
        let period_us = self.period_us();
        let due = now_us / period_us;
        let first = self.samples.max(due.saturating_sub(100)) + 1;
        self.samples = due;
        if self.identity != 0x71 || self.registers[0x6A] & 0x20 == 0 || self.awake_us.is_none() {
            return;
        }
        for sample in first..=due {
            // Transfers at 400 kHz end some time after the sample.
            let at_us = sample * period_us + 200;
            let delay = u64::from(self.registers[0x34] & 0x1F) + 1;
            if (0..4).all(|slave| self.registers[0x27 + 3 * slave] & 0x80 == 0) {
                self.slots = [None; 4];
            }
            for slave in 0..4 {
                let [address, register, control] = [0, 1, 2].map(|at| self.registers[0x25 + 3 * slave + at]);
                let is_delayed = self.registers[0x67] >> slave & 1 != 0;
                let length = usize::from(control & 0xF);
                if control & 0x80 == 0 || is_delayed && !sample.is_multiple_of(delay) {
                    continue;
                }
                let Some(die) = self.magnetometer.as_mut().filter(|die| die.answers && address & 0x7F == 0x0C) else {
                    self.registers[0x36] |= 1 << slave;
                    continue;
                };
                if address & 0x80 == 0 {
                    die.write(at_us, register, self.registers[0x63 + slave]);
                    continue;
                }
                let used = (0..4).filter(|&other| self.slots[other].is_some());
                let used = used.map(|other| usize::from(self.registers[0x27 + 3 * other] & 0xF)).sum();
                let slot = *self.slots[slave].get_or_insert(used);
                for at in 0..length {
                    self.external[slot + at] = die.read(at_us, register + at as u8);
                }
            }
            if self.registers[0x34] & 0x80 != 0 {
                self.registers[0x34] &= 0x7F;
                let [address, register, byte] = [0x31, 0x32, 0x33].map(|at| self.registers[at]);
                assert_eq!(address & 0x80, 0, "slave 4 is used for writing");
                match self.magnetometer.as_mut().filter(|die| die.answers && address == 0x0C) {
                    Some(die) => die.write(at_us, register, byte),
                    None => self.registers[0x36] |= 0x10,
                }
                self.registers[0x36] |= 0x40;
            }
        }
    }
}

impl Model for Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        self.advance(now_us);
        if now_us < self.reset_us + self.restart_us() {
            into.fill(0);
            return;
        }
        for (register, byte) in (usize::from(register)..).zip(into) {
            *byte = match register {
                0x75 => self.identity,
                0x00..=0x02 if self.identity != 0x68 => self.trims[0][register],
                0x0D..=0x10 => self.trims[1][register - 0x0D],
                0x3B..=0x48 => self.data(now_us)[register - 0x3B],
                0x49..=0x60 => self.external[register - 0x49],
                0x36 => std::mem::take(&mut self.registers[0x36]),
                _ => self.registers[register],
            };
        }
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        self.advance(now_us);
        if now_us < self.reset_us + self.restart_us() {
            return;
        }
        let &[byte] = bytes else { panic!("registers of the auxiliary bus do not take blocks") };
        let sleeps = self.awake_us.is_none();
        match register {
            0x6B if byte & 0x80 != 0 => self.reset_itself(now_us),
            0x6B => {
                self.registers[0x6B] = byte;
                self.awake_us = (byte & 0x47 != 0x40 && byte & 0x40 == 0).then_some(self.awake_us.unwrap_or(now_us));
            }
            // A sleeping ICM accepts only these registers.
            _ if self.is_icm() && sleeps && !matches!(register, 0x37 | 0x38 | 0x6C) => (),
            0x3A..=0x60 | 0x75 => (),
            0x68 => assert_eq!(byte & !7, 0),
            0x6A => {
                self.is_i2c_off |= byte & 0x10 != 0 && self.identity != 0x12;
                // The reset bits clear themselves. In the MPU-6500 and MPU-9250, so does the bit that switches I2C off.
                let clears = if matches!(self.identity, 0x70 | 0x71) { 0x1F } else { 0x0F };
                self.registers[0x6A] = byte & !clears;
            }
            0x70 if self.identity == 0x12 => {
                self.is_i2c_off = byte & 0x40 != 0;
                self.registers[0x70] = byte;
            }
            // The MPU-6000 has no second accelerometer register.
            0x1D if self.identity == 0x68 => (),
            _ => self.registers[usize::from(register)] = byte,
        }
    }

    fn reset(&mut self, now_us: u64) {
        self.reset_itself(now_us);
        if let Some(die) = &mut self.magnetometer {
            die.reset();
        }
    }

    fn next_interrupt_us(&self, now_us: u64) -> Option<u64> {
        let is_pulse = self.registers[0x38] & 1 != 0 && self.registers[0x37] & 0xE0 == 0;
        (is_pulse && self.awake_us.is_some()).then(|| (now_us / self.period_us() + 1) * self.period_us())
    }
}

/// Register model of an AK8963.
pub(crate) struct Magnetometer {
    registers: [u8; 0x13],
    /// Time at which the current measurement ends.
    ends_us: Option<u64>,
    /// True if the part acknowledges its address.
    pub(crate) answers: bool,
    pub(crate) identity: u8,
    pub(crate) adjustment: [u8; 3],
    /// Field along the magnetometer's own axes.
    pub(crate) field_ut: [f64; 3],
    /// Duration of a measurement \[us\].
    pub(crate) takes_us: u64,
}

impl Magnetometer {
    pub(crate) fn new(field_ut: [f64; 3]) -> Self {
        let adjustment = [0xB0, 0x6C, 0xA4];
        let mut die = Magnetometer {
            registers: [0; 0x13],
            ends_us: None,
            answers: true,
            identity: 0x48,
            adjustment,
            field_ut,
            takes_us: 7_200,
        };
        die.reset();
        die
    }

    /// Resets the registers to their power-up values.
    pub(crate) fn reset(&mut self) {
        (self.registers, self.ends_us) = ([0; 0x13], None);
    }

    fn mode(&self) -> u8 {
        self.registers[0x0A] & 0xF
    }

    fn advance(&mut self, now_us: u64) {
        let Some(ends_us) = self.ends_us.filter(|&ends_us| now_us >= ends_us) else { return };
        self.ends_us = None;
        let is_wide = self.registers[0x0A] & 0x10 != 0;
        // Returns to power-down.
        self.registers[0x0A] &= 0x10;
        let sum: f64 = self.field_ut.iter().map(|field| field.abs()).sum();
        for axis in 0..3 {
            let adjustment = (f64::from(self.adjustment[axis]) - 128.0) * 0.5 / 128.0 + 1.0;
            let lsb = self.field_ut[axis] / adjustment / if is_wide { 0.15 } else { 0.6 };
            let limit = if is_wide { 32760.0 } else { 8190.0 };
            let number = (lsb + 2.0 * noise(ends_us, 20 + axis as u64)).round().clamp(-limit, limit) as i16;
            self.registers[3 + 2 * axis..5 + 2 * axis].copy_from_slice(&number.to_le_bytes());
        }
        self.registers[0x02] = 1;
        self.registers[0x09] = if is_wide { 0x10 } else { 0 } | if sum >= 4912.0 { 0x08 } else { 0 };
    }

    fn read(&mut self, now_us: u64, register: u8) -> u8 {
        self.advance(now_us);
        match register {
            0x00 => self.identity,
            0x03..=0x09 => {
                self.registers[0x02] = 0;
                self.registers[usize::from(register)]
            }
            0x10..=0x12 if self.mode() == 0xF => self.adjustment[usize::from(register) - 0x10],
            0x10..=0x12 => 0x80,
            _ => self.registers[usize::from(register)],
        }
    }

    fn write(&mut self, now_us: u64, register: u8, byte: u8) {
        self.advance(now_us);
        match register {
            0x0B if byte & 1 != 0 => self.reset(),
            0x0A => {
                let is_change = byte & 0xF != 0 && byte & 0xF != self.mode();
                assert!(!is_change || self.mode() == 0, "modes change by way of power-down");
                self.registers[0x0A] = byte & 0x1F;
                self.registers[0x02..0x0A].fill(0);
                self.ends_us = (byte & 0xF == 1).then_some(now_us + self.takes_us);
            }
            _ => panic!("register {register:#x}"),
        }
    }
}
