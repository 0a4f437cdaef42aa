//! Register model of a BMI270 (BST-BMI270-DS000). The models of boards use it, too.

/// FNV-1a hash of `bmi270_config_file` in Bosch's `BMI270_SensorAPI`.
const CONFIGURATION: u64 = 0xA3AB_E71B_91DB_4895;

/// Registers and state of the part.
#[derive(Clone, Debug)]
pub struct Bmi270Registers {
    noise: fn(u64, u64) -> f64,
    identity: u8,
    /// Register contents as written.
    pub registers: [u8; 128],
    /// True if the interface is SPI. It is I2C until the first edge of chip select.
    pub is_spi: bool,
    /// Time of the last reset.
    pub reset_us: u64,
    /// Time at which power saving was switched off.
    pub awake_us: Option<u64>,
    /// The part of the configuration loaded so far.
    pub loaded: Vec<u8>,
    /// Time at which the configuration was started, and whether it is correct.
    pub started_us: Option<(u64, bool)>,
    /// Times at which gyroscope and accelerometer were switched on.
    pub on_us: [Option<u64>; 2],
    /// Cross-sensitivity of the gyroscope's x to z \[1/512\].
    pub cas: i8,
    /// True turn rates.
    pub rates_deg_s: [f64; 3],
    /// True specific force.
    pub force_g: [f64; 3],
    /// True temperature.
    pub temperature_c: f64,
    /// Deflection of each axis by the self-test \[g\].
    pub pushes_g: [f64; 3],
}

impl Bmi270Registers {
    /// Creates a part with this identity. `noise` gives the noise for a time \[us\] and an axis.
    pub fn new(identity: u8, noise: fn(u64, u64) -> f64) -> Self {
        let mut part = Bmi270Registers {
            noise,
            identity,
            registers: [0; 128],
            is_spi: false,
            reset_us: 0,
            awake_us: None,
            loaded: Vec::new(),
            started_us: None,
            on_us: [None; 2],
            cas: -37,
            rates_deg_s: [10.0, -250.0, 500.0],
            force_g: [0.1, -0.2, 1.0],
            temperature_c: 31.0,
            pushes_g: [8.6, -8.1, 5.4],
        };
        part.reset(0);
        part
    }

    /// Returns the output period in performance mode \[us\].
    fn period_us(&self) -> u64 {
        let rate = self.registers[0x42] & 0xF;
        assert!((0x6..=0xD).contains(&rate), "rate {rate:#x}");
        40_000 >> (rate - 6)
    }

    fn status(&self, now_us: u64) -> u8 {
        match self.started_us {
            Some((since_us, is_right)) if now_us >= since_us + 15_000 => 2 - u8::from(is_right),
            _ => 0,
        }
    }

    fn data(&self, now_us: u64) -> [u8; 12] {
        let now_us = now_us / self.period_us() * self.period_us();
        let on = |at: usize, start_us: u64| self.on_us[at].is_some_and(|on_us| now_us >= on_us + start_us);
        let mut numbers = [0_i16; 6];
        let acc = 32768.0 / f64::from(2 << (self.registers[0x41] & 3));
        let gyr = 32768.0 / (2000.0 / f64::from(1 << (self.registers[0x43] & 7)));
        for axis in 0..3 {
            if on(1, 2_000) {
                let push = match self.registers[0x6D] & 0b1101 {
                    0b1101 => self.pushes_g[axis],
                    0b1001 => -self.pushes_g[axis],
                    _ => 0.0,
                };
                let lsb = (self.force_g[axis] + push) * acc + 6.0 * (self.noise)(now_us, axis as u64);
                numbers[axis] = lsb.round().clamp(-32768.0, 32767.0) as i16;
            }
            if on(0, 45_000) {
                let z = if axis == 0 { self.rates_deg_s[2] * f64::from(self.cas) / 512.0 } else { 0.0 };
                let lsb = (self.rates_deg_s[axis] + z) * gyr + 2.0 * (self.noise)(now_us, 4 + axis as u64);
                numbers[3 + axis] = lsb.round().clamp(-32768.0, 32767.0) as i16;
            }
        }
        let mut bytes = [0; 12];
        for (pair, number) in bytes.chunks_exact_mut(2).zip(numbers) {
            pair.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }

    fn temperature(&self, now_us: u64) -> [u8; 2] {
        let is_on = self.registers[0x7D] & 8 != 0 && self.on_us[0].is_some_and(|on_us| now_us >= on_us + 10_000);
        let number = if is_on { ((self.temperature_c - 23.0) * 512.0).round() as i16 } else { i16::MIN };
        number.to_le_bytes()
    }
}

impl Bmi270Registers {
    /// Reads consecutive registers.
    pub fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        if now_us < self.reset_us + 2_000 || !self.is_spi {
            self.is_spi |= now_us >= self.reset_us + 2_000;
            into.fill(0xFF);
            return;
        }
        let runs = self.status(now_us) == 1;
        for (register, byte) in (usize::from(register)..).zip(into) {
            *byte = match register {
                0x00 => self.identity,
                0x0C..=0x17 if runs => self.data(now_us)[register - 0x0C],
                0x0C..=0x17 => 0,
                0x21 => self.status(now_us),
                0x22..=0x23 => self.temperature(now_us)[register - 0x22],
                0x3C if runs && self.registers[0x2F] == 0 => self.cas as u8 & 0x7F,
                0x30..=0x3F => 0,
                _ => self.registers[register],
            };
        }
    }

    /// Writes consecutive registers.
    pub fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        if now_us < self.reset_us + 2_000 || !self.is_spi {
            self.is_spi |= now_us >= self.reset_us + 2_000;
            return;
        }
        let is_awake = self.awake_us.is_some_and(|awake_us| now_us >= awake_us + 450);
        match (register, bytes) {
            (0x7E, [0xB6]) => self.reset(now_us),
            (0x7C, [value]) => {
                self.registers[0x7C] = *value;
                self.awake_us = (value & 1 == 0).then_some(self.awake_us.unwrap_or(now_us));
            }
            // Other writes are lost during power saving.
            _ if !is_awake => (),
            (0x59, [0]) => {
                self.loaded.clear();
                self.started_us = None;
                self.registers[0x59] = 0;
            }
            (0x59, [value]) => {
                let hash = self.loaded.iter().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
                    (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01B3)
                });
                self.started_us = Some((now_us, self.loaded.len() == 8192 && hash == CONFIGURATION));
                self.registers[0x59] = *value;
            }
            // Blocks stay on this register. They are accepted after INIT_CTRL was set to 0.
            (0x5E, _) if self.registers[0x59] == 0 => self.loaded.extend_from_slice(bytes),
            (0x7D, [value]) => {
                self.registers[0x7D] = *value;
                for (on_us, bit) in self.on_us.iter_mut().zip([2, 4]) {
                    *on_us = (value & bit != 0).then_some(on_us.unwrap_or(now_us));
                }
            }
            (0x40..=0x5D | 0x5F..=0x6F, _) => {
                for (register, byte) in (usize::from(register)..).zip(bytes) {
                    self.registers[register] = *byte;
                }
            }
            _ => (),
        }
    }

    /// Loses everything, as after a brown-out.
    pub fn reset(&mut self, now_us: u64) {
        self.registers = [0; 128];
        for (register, value) in [(0x40, 0xA8), (0x41, 0x02), (0x42, 0xA9), (0x59, 0x90), (0x7C, 0x03)] {
            self.registers[register] = value;
        }
        (self.is_spi, self.reset_us, self.awake_us, self.started_us) = (false, now_us, None, None);
        self.on_us = [None; 2];
        self.loaded.clear();
    }

    /// Returns the time of the next interrupt after `now_us`; none if the pin is not set up.
    pub fn next_interrupt_us(&self, now_us: u64) -> Option<u64> {
        let routed =
            self.registers[0x58] & 4 != 0 && self.registers[0x53] & 0b1110 == 0b1010 && self.registers[0x55] == 0;
        let on = self.status(now_us) == 1 && self.on_us.iter().any(Option::is_some);
        (routed && on).then(|| (now_us / self.period_us() + 1) * self.period_us())
    }
}
