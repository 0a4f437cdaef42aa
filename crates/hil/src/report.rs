//! Prints tracking errors on the terminal.

use afbc_sim::metrics::{Metrics, SETTLED_S};
use nalgebra::Vector4;

/// Formats the tracking errors over `duration_s` in the loop, next to those of the same flight without a link.
pub fn tracking(duration_s: f64, in_the_loop: &Metrics, without_link: &Metrics) -> String {
    type Values = fn(&Metrics) -> Vector4<f64>;
    let mut blocks: Vec<(&str, Values)> = Vec::new();
    if duration_s > SETTLED_S {
        blocks.push(("RMSE", |m| m.rmse));
        blocks.push(("largest |error|", |m| m.max_abs));
    }
    blocks.push(("final error", |m| m.final_error));
    let mut text = format!("{:<36}{:>10}{:>10}{:>10}{:>11}\n", "", "x [m]", "y [m]", "z [m]", "psi [rad]");
    for (title, values) in blocks {
        for (title, name, metrics) in [(title, "in the loop", in_the_loop), ("", "sitl fly", without_link)] {
            let [x, y, z, psi]: [f64; 4] = values(metrics).into();
            text += &format!("{title:<20}{name:<16}{x:>10.4}{y:>10.4}{z:>10.4}{psi:>11.4}\n");
        }
    }
    text + &format!("Error: reference minus vehicle, from {SETTLED_S} s to the end.\n")
}
