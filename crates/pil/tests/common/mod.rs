//! What the tests of both images share.

use airframe::{Setpoint, State};
use link::{Address, Command, FRAME_MAX, Sender, Uplink};
use nalgebra::Vector3;
use pil::{Error, Image};
use std::io::Write as _;
use std::path::PathBuf;

/// The image, or none if this test has to be skipped, which it says on the terminal. Under CI nothing may be skipped.
pub fn image_or_skip<T>(image: Image, start: impl FnOnce(PathBuf) -> Result<T, Error>) -> Option<T> {
    match image.find().and_then(start) {
        Ok(started) => Some(started),
        Err(error) if error.is_missing() && std::env::var_os("CI").is_none() => {
            // Not println!: the test harness would hide it.
            let _ = writeln!(std::io::stderr(), "SKIPPED, nothing was tested: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// The other end of the link: tracker and commander in one.
pub struct Station {
    sender: Sender,
    bytes: Vec<u8>,
}

impl Station {
    pub fn new() -> Self {
        Station { sender: Sender::new(Address { system: 255, component: 190 }), bytes: Vec::new() }
    }

    /// Adds a message to the next [`Station::take`].
    pub fn say(&mut self, message: Uplink) {
        self.bytes.extend_from_slice(self.sender.send(&message, &mut [0; FRAME_MAX]));
    }

    pub fn command(&mut self, command: Command) {
        self.say(Uplink::Command(command));
    }

    /// All that was said since the last time.
    pub fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }
}

/// Some motion near hover in which every subsystem has something to do; `t` in seconds.
pub fn motion(t: f32) -> (State, Setpoint) {
    let wave = |rate: f32| (rate * t).sin();
    let state = State {
        position_m: Vector3::new(0.5 * wave(0.7), 0.4 * wave(1.1), 0.3 * wave(0.9)),
        velocity_m_s: Vector3::new(0.6 * wave(1.7), 0.5 * wave(1.3), 0.4 * wave(2.3)),
        attitude_rad: Vector3::new(0.2 * wave(3.1), 0.2 * wave(2.7), 0.5 * wave(0.6)),
        rates_rad_s: Vector3::new(0.8 * wave(5.1), 0.7 * wave(4.7), 0.4 * wave(3.9)),
    };
    let setpoint = Setpoint {
        position_m: Vector3::new(0.3 * wave(0.4), 0.3 * wave(0.5), 0.5),
        velocity_m_s: Vector3::new(0.2 * wave(0.8), 0.2 * wave(0.6), 0.0),
        yaw_rad: 0.5 * wave(0.3),
        ..Setpoint::default()
    };
    (state, setpoint)
}
