//! Runs the estimator on an IMU at 1 kHz and a tracker at 100 Hz whose poses arrive 8 ms late: `cargo run -p
//! afbc-estimator --example estimator_alone`.
#![allow(clippy::unwrap_used, reason = "an example whose settings are not valid should say so")]

use afbc_estimator::{Estimator, ImuSample, Measurement, Memory, Settings, Stamped};
use nalgebra::Vector3;

fn main() {
    let estimator = Estimator::new(Settings::DEFAULT).unwrap();
    let mut memory = Memory::default();
    for ms in 1..=3000_u64 {
        let at_us = 1000 * ms;
        // Without noise the IMU would count as stuck.
        let noise = 1e-3 * (ms % 7) as f32;
        let specific_force_m_s2 = Vector3::new(noise, 0.0, 9.81);
        let sample = ImuSample { at_us, rates_rad_s: Vector3::zeros(), specific_force_m_s2 };
        if ms.is_multiple_of(10) {
            let value = Measurement::Pose {
                position_m: Vector3::new(1.0, 2.0, 0.5),
                attitude: [1.0, 0.0, 0.0, 0.0],
                position_sigma_m: 0.001,
                attitude_sigma_rad: 0.01,
            };
            memory.offer(&Stamped { value, at_us: at_us - 8000 });
        }
        let estimate = estimator.step(&mut memory, at_us, Some(&sample));
        if ms.is_multiple_of(500) {
            println!("{ms:4} ms: {:.3?} m, {:?}", estimate.state.position_m.as_slice(), estimate.validity);
        }
    }
    let estimate = estimator.step(&mut memory, 3_001_000, None);
    assert!(estimate.validity.position && (estimate.state.position_m.y - 2.0).abs() < 0.01);
}
