//! Flights of the server's vehicle, observed through the messages that stations send and receive.

pub mod checker;
pub mod session;

pub use checker::Checker;
pub use session::{COMPANION, STATION, Session};

use afbc_mavlink::{Address, Downlink, ExternalTarget, PositionTarget, Uplink};
use nalgebra::Vector3;
use std::sync::Mutex;
use std::thread;

/// True motion of the vehicle after a tick.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    pub position_m: Vector3<f64>,
    pub velocity_m_s: Vector3<f64>,
    /// Angle between the vehicle's and the earth's vertical \[rad\].
    pub tilt_rad: f64,
    pub on_ground: bool,
    /// Speed of the fastest rotor \[rad/s\].
    pub rotor_rad_s: f64,
}

/// Messages that stations send and receive in a tick, and the true motion after it.
#[derive(Clone, Debug)]
pub struct Tick {
    pub time_ms: u32,
    /// Messages whose frames reached the vehicle intact.
    pub sent: Vec<(Address, Uplink)>,
    pub heard: Vec<Downlink>,
    pub truth: Truth,
}

/// Returns a velocity target along the axes of the local frame \[m/s\].
pub fn velocity(x: f32, y: f32, z: f32) -> Uplink {
    Uplink::Target(ExternalTarget::Motion(PositionTarget {
        velocity_m_s: Vector3::new(x, y, z),
        ..PositionTarget::NONE
    }))
}

/// Returns a position target in the local frame \[m\].
pub fn place(x: f32, y: f32, z: f32) -> Uplink {
    Uplink::Target(ExternalTarget::Motion(PositionTarget { position_m: Vector3::new(x, y, z), ..PositionTarget::NONE }))
}

/// Does `work` for each of `jobs` on all cores. Returns the results in the order of the jobs.
pub fn on_all_cores<J: Send + Sync, R: Send>(jobs: &[J], work: impl Fn(&J) -> R + Sync) -> Vec<R> {
    let (next, results) = (Mutex::new(0), Mutex::new(Vec::new()));
    thread::scope(|threads| {
        for _ in 0..thread::available_parallelism().map_or(1, Into::into) {
            threads.spawn(|| {
                loop {
                    let place = {
                        let mut next = next.lock().unwrap();
                        *next += 1;
                        *next - 1
                    };
                    let Some(job) = jobs.get(place) else { return };
                    let result = work(job);
                    results.lock().unwrap().push((place, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap();
    results.sort_by_key(|(place, _)| *place);
    results.into_iter().map(|(_, result)| result).collect()
}
