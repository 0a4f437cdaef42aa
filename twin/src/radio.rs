//! Flies the image, as flashed, by radio, with a CRSF receiver at a UART of the board. The pilot arms by a switch,
//! then climbs and hovers by the sticks. From that hover, many flights resume. Some move the kill switch, at times
//! spread over a control period, and check how soon the motor pins stop. Another loses the receiver and gets it back.

use crate::check::check;
use crate::fly::TICK_NS;
use crate::machine::Machine;
use crate::piloted::{FRAME_NS, PilotedFlight, PilotedHover};
use crate::stick_pilots::{ClimbPilot, KillSwitchPilot, ReceiverLossPilot};
use std::error::Error;
use std::path::Path;

/// Longest time from the last byte of the first frame with the switch on until all motors are stopped \[ns\].
const KILL_NS: u64 = 20_000_000;

/// Description of the flights: the scenario, the frame rates of the kill tests \[1/s\], and their number of phases.
pub struct RadioOptions<'a> {
    pub scenario: &'a Path,
    pub rates: &'a [u64],
    pub phases: u64,
}

/// Runs all flights by radio, and checks their results.
pub fn fly<M: Machine>(image: &Path, order: &RadioOptions<'_>) -> Result<(), Box<dyn Error>> {
    let hover = PilotedHover::<M>::of(image, order.scenario, &[("RC_MAP_KILL_SW", 7.0)], ClimbPilot::default())?;
    let (shown, wrong) = hover.vehicle().transmitter.shown();
    println!("the transmitter shows {}", shown.join(", "));
    check(["place", "attitude", "mode"].iter().all(|it| shown.contains(it)) && wrong == 0, "telemetry comes back")?;

    let mut most_ns = 0;
    for rate in order.rates {
        most_ns = most_ns.max(kill(&hover, *rate, order.phases)?);
    }
    let PilotedFlight { stick_pilot, .. } = hover.resume(FRAME_NS, 0, ReceiverLossPilot::default())?;
    println!("{}", stick_pilot.summary());
    check(most_ns <= KILL_NS, "the motors stop within 20 ms")
}

/// Moves the kill switch at this many phases of a control period. Returns the longest time until the motors stopped
/// \[ns\].
fn kill<M: Machine>(hover: &PilotedHover<M>, rate: u64, phases: u64) -> Result<u64, Box<dyn Error>> {
    let mut took_ns = Vec::new();
    for phase in 0..phases {
        let late_ns = phase * TICK_NS / phases;
        let PilotedFlight { stick_pilot, vehicle, .. } =
            hover.resume(1_000_000_000 / rate, late_ns, KillSwitchPilot::default())?;
        let killed_ns = vehicle.transmitter.killed_ns.ok_or("the transmitter has not sent the kill switch")?;
        let stopped_ns = stick_pilot.stopped_ns.ok_or("the motors are not stopped")?;
        took_ns.push((stopped_ns.saturating_sub(killed_ns), late_ns));
    }
    let ms = |ns: u64| ns as f64 * 1e-6;
    let mean_ms = took_ns.iter().map(|(took_ns, _)| ms(*took_ns)).sum::<f64>() / phases as f64;
    let (least, most) = (took_ns.iter().min().ok_or("no phase")?, took_ns.iter().max().ok_or("no phase")?);
    println!(
        "kill switch, {rate} frames per second: the motors get the stop command {:.2} to {:.2} ms after the last byte \
         of the first frame, {mean_ms:.2} ms on average over {phases} phases; slowest for a frame {:.3} ms into a \
         control period",
        ms(least.0),
        ms(most.0),
        ms(most.1)
    );
    Ok(most.0)
}
