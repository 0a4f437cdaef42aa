//! Flights with motor controllers that answer. The speeds that the vehicle reports must be the plant's, and it must
//! report a stopped rotor in time.

use crate::check::check;
use crate::esc_line::voltage_cv;
use crate::machine::Machine;
use crate::piloted::{FRAME_NS, PilotDecision, PilotedHover, PilotedVehicle, StickPilot};
use crate::pins::ANSWERS;
use crate::stick_pilots::ClimbPilot;
use std::collections::VecDeque;
use std::error::Error;
use std::path::Path;

/// Time for which messages are counted \[ms\], and least number of messages in that time.
const LISTENED_MS: u64 = 3_000;
const MESSAGES: u32 = 20;
/// Longest time between a measurement and its message \[ms\], and resolution of a reported speed \[rad/s\].
const OLD_MS: usize = 60;
const COARSE_RAD_S: f64 = 1.5;
/// Longest time until a stopped rotor must be reported \[ms\].
const TOLD_MS: u64 = 100;
/// Number of stop times tried for each rotor, and time between them \[ms\].
const STOPS: u64 = 3;
const APART_MS: u64 = 4;

/// Compares reported speeds and voltages with the plant's.
#[derive(Debug, Default)]
struct TelemetryCheck {
    on_lines: bool,
    since_ms: Option<u64>,
    /// Recent speeds of the rotors \[rad/s\].
    past: VecDeque<Vec<f64>>,
    heard_ms: Option<u64>,
    messages: u32,
    most_rad_s: f64,
}

impl StickPilot for TelemetryCheck {
    fn move_sticks(&mut self, vehicle: &mut PilotedVehicle, now_ms: u64) -> Result<PilotDecision, String> {
        let since_ms = *self.since_ms.get_or_insert(now_ms);
        self.past.push_back(vehicle.pilot.rotor_speeds_rad_s().to_vec());
        if self.past.len() > OLD_MS {
            self.past.pop_front();
        }
        if let Some((at_ms, status)) = vehicle.pilot.escs().filter(|(at_ms, _)| self.heard_ms != Some(*at_ms))
            && self.past.len() == OLD_MS
        {
            self.heard_ms = Some(at_ms);
            self.messages += 1;
            for (rotor, (rpm, voltage_v)) in status.speeds_rpm.iter().zip(status.voltages_v).enumerate() {
                let told_rad_s = f64::from(*rpm) * std::f64::consts::TAU / 60.0;
                let speeds = self.past.iter().filter_map(|speeds| speeds.get(rotor).copied());
                let (least, most) =
                    speeds.fold((f64::MAX, 0.0_f64), |(least, most), speed| (least.min(speed), most.max(speed)));
                let off_rad_s = (least - told_rad_s).max(told_rad_s - most).max(0.0);
                self.most_rad_s = self.most_rad_s.max(off_rad_s);
                if off_rad_s > COARSE_RAD_S + 0.1 {
                    return Err(format!(
                        "rotor {rotor}: telemetry reports {told_rad_s:.1} rad/s, the rotor turned at \
                         {least:.1} to {most:.1} rad/s"
                    ));
                }
                let expected_v = f32::from(voltage_cv(rotor)) * 0.01;
                // Bidirectional DSHOT reports speeds only.
                if !self.on_lines && (voltage_v - expected_v).abs() > 0.005 {
                    return Err(format!("rotor {rotor}: {voltage_v} V told of {expected_v} V"));
                }
            }
        }
        Ok(if now_ms > since_ms + LISTENED_MS { PilotDecision::Ends } else { PilotDecision::GoesOn })
    }
}

/// Stops a rotor, and waits until the vehicle reports it.
#[derive(Debug)]
struct RotorStopTest {
    on_lines: bool,
    rotor: usize,
    late_ms: u64,
    began_ms: Option<u64>,
    /// Time until the vehicle has reported the stop \[ms\].
    told_ms: Option<u64>,
}

impl StickPilot for RotorStopTest {
    fn move_sticks(&mut self, vehicle: &mut PilotedVehicle, now_ms: u64) -> Result<PilotDecision, String> {
        let stops_ms = *self.began_ms.get_or_insert(now_ms) + 500 + self.late_ms;
        let says = format!("rotor {} has stopped", self.rotor + 1);
        // A controller that answers every frame shows a wrong speed before the rotor has stopped.
        let also =
            if self.on_lines { format!("rotor {} does not turn as commanded", self.rotor + 1) } else { says.clone() };
        let is_said = |text: &str| text == says || text == also;
        if let Some((_, text)) = vehicle.pilot.heard().iter().find(|(_, text)| text.starts_with("rotor"))
            && (now_ms < stops_ms || !is_said(text))
        {
            return Err(format!("the vehicle says \"{text}\" instead of \"{says}\""));
        }
        if now_ms == stops_ms {
            vehicle.pilot.stop_rotor(self.rotor);
        }
        self.told_ms = vehicle.pilot.heard().iter().find(|(_, text)| is_said(text)).map(|(ms, _)| ms - stops_ms);
        let is_over = self.told_ms.is_some() || now_ms > stops_ms + 2 * TOLD_MS;
        Ok(if is_over { PilotDecision::Ends } else { PilotDecision::GoesOn })
    }
}

/// Flies with motor controllers that answer, and stops each rotor in flight.
pub fn fly<M: Machine>(image: &Path, scenario: &Path, on_lines: bool) -> Result<(), Box<dyn Error>> {
    let listens = if on_lines { ANSWERS } else { "DSHOT_TEL_CFG" };
    let hover = PilotedHover::<M>::of(image, scenario, &[(listens, 1.0)], ClimbPilot::default())?;
    let stick_pilot = TelemetryCheck { on_lines, ..TelemetryCheck::default() };
    let TelemetryCheck { messages, most_rad_s, .. } = hover.resume(FRAME_NS, 0, stick_pilot)?.stick_pilot;
    println!(
        "{messages} messages ESC_STATUS, off by at most {most_rad_s:.1} rad/s from the rotors' speeds of the last 60 ms"
    );
    check(messages >= MESSAGES, "the motor controllers are heard")?;
    let mut all_ms = Vec::new();
    for rotor in 0..hover.vehicle().pilot.throttles().len() {
        for late_ms in (0..STOPS).map(|nth| nth * APART_MS) {
            let stick_pilot = RotorStopTest { on_lines, rotor, late_ms, began_ms: None, told_ms: None };
            let told_ms = hover.resume(FRAME_NS, 0, stick_pilot)?.stick_pilot.told_ms;
            all_ms.push(told_ms.ok_or_else(|| format!("rotor {rotor}: telemetry does not report the stop"))?);
        }
    }
    let (least_ms, most_ms) = (all_ms.iter().min().ok_or("no rotor")?, all_ms.iter().max().ok_or("no rotor")?);
    println!("{} stopped rotors are reported {least_ms} to {most_ms} ms after their drive ends", all_ms.len());
    check(*most_ms <= TOLD_MS, "a stopped rotor is reported within 100 ms")
}
