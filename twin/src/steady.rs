//! Finds pins that would float on a board, by the registers of their ports. In the models, lines are always driven; on
//! a board, they are not. An input must have its pull-up, since an open line reads as noise. A pin that switches a
//! part of the board must be driven.

/// Required state of a pin while the board runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steady {
    /// Input with pull-up.
    PulledUp,
    /// Output with this level.
    Output(bool),
}

/// Pin: its port, counted from A = 0, its number, and its required state.
pub type SteadyPin = (u64, u32, Steady);

/// Distance between the registers of two ports, and offsets of a port's mode, pull and output registers (RM0090, 8.4;
/// RM0433, 11.4).
const PORT: u64 = 0x400;
const MODES: u64 = 0x00;
const PULLS: u64 = 0x0C;
const OUTPUTS: u64 = 0x14;
/// Register values of an output and of a pull-up.
const OUTPUT: u64 = 0b01;
const UP: u64 = 0b01;

/// Returns the pins that are not in their required state. `ports` is the address of the first port.
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
