//! Pins that must not float, by the registers of their ports: the models' lines are always driven, and a board's are
//! not. A pin that receives is pulled up, for a line that nothing drives reads as noise; a pin that switches a part of
//! the board is driven.

/// What a pin must be like while the board runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steady {
    /// An input that is pulled up.
    PulledUp,
    /// An output, and its level.
    Output(bool),
}

/// A pin: its port from 0 (A), its number, and what it must be like.
pub type SteadyPin = (u64, u32, Steady);

/// A port's registers are so far apart, and these so far from its first one (RM0090, 8.4; RM0433, 11.4).
const PORT: u64 = 0x400;
const MODES: u64 = 0x00;
const PULLS: u64 = 0x0C;
const OUTPUTS: u64 = 0x14;
/// An output, and a pull to the supply.
const OUTPUT: u64 = 0b01;
const UP: u64 = 0b01;

/// Returns those pins that are not as they must be, by the registers from `ports` on.
pub fn floating(ports: u64, pins: &[SteadyPin], mut read: impl FnMut(u64) -> u64) -> Vec<SteadyPin> {
    let mut is_steady = |&(port, pin, steady): &SteadyPin| {
        let mut register = |offset: u64| read(ports + PORT * port + offset);
        match steady {
            Steady::PulledUp => register(PULLS) >> (2 * pin) & 0b11 == UP,
            Steady::Output(is_high) => {
                register(MODES) >> (2 * pin) & 0b11 == OUTPUT && (register(OUTPUTS) >> pin & 1 == 1) == is_high
            }
        }
    };
    pins.iter().filter(|&pin| !is_steady(pin)).copied().collect()
}
