//! Pilots: each moves sticks and switches, and checks the vehicle's reaction.

use crate::piloted::{PilotDecision, PilotedVehicle, StickPilot};
use crate::transmitter::{ARM, KILL, PITCH, THROTTLE};

/// Time of the first attempt to arm, time between attempts, and time after which arming has failed \[ms\].
const ARMS_MS: u64 = 12_000;
const AGAIN_MS: u64 = 2_000;
const PATIENCE_MS: u64 = 45_000;
/// Height at which the throttle is centred \[m\], and longest climb and duration of the hover \[ms\].
const HEIGHT_M: f64 = 4.0;
const CLIMB_MS: u64 = 15_000;
const HOVER_MS: u64 = 5_000;
/// Largest position error \[m\] and tilt \[rad\] in a hover.
const OFF_M: f64 = 2.5;
const TILT_RAD: f64 = 0.5;
/// Time for which the motors are watched after the start of a kill \[ms\].
const KILLS_MS: u64 = 80;
/// Receiver loss \[ms\]: earliest time at which it may be reported, time by which the vehicle must hold its position,
/// and duration of the silence.
const HELD_MS: u64 = 450;
const LOST_MS: u64 = 750;
const SILENT_MS: u64 = 5_000;
/// Time without stick input after the receiver is back, and time for which the stick is forward \[ms\].
const BACK_MS: u64 = 3_000;
const FORWARD_MS: u64 = 5_000;
/// Least distance that the vehicle must fly while the stick is forward \[m\].
const WAY_M: f64 = 4.0;
const LANDS_MS: u64 = 25_000;

/// Returns the vehicle's true position \[m\].
fn place_m(vehicle: &PilotedVehicle) -> [f64; 3] {
    vehicle.pilot.motion().position_m.into()
}

/// Checks that the vehicle is armed, upright and near `start_m`; returns the distance \[m\].
fn hovers(vehicle: &PilotedVehicle, start_m: [f64; 3]) -> Result<f64, String> {
    let attitude_rad = vehicle.pilot.motion().attitude_rad;
    let tilt_rad = attitude_rad.x.hypot(attitude_rad.y);
    let off_m = place_m(vehicle).iter().zip(start_m).map(|(now, then)| (now - then).powi(2)).sum::<f64>().sqrt();
    if vehicle.pilot.armed() && off_m <= OFF_M && tilt_rad <= TILT_RAD {
        return Ok(off_m);
    }
    let armed = if vehicle.pilot.armed() { "armed" } else { "disarmed" };
    Err(format!("the vehicle does not hover: {armed}, {off_m:.2} m off, tilted by {tilt_rad:.2} rad"))
}

/// Pilot that arms by the switch, climbs by the throttle and hovers.
#[derive(Debug, Default)]
pub struct ClimbPilot {
    /// Time of arming \[ms\].
    armed_ms: Option<u64>,
    /// Time \[ms\] and position \[m\] at the end of the climb.
    up: Option<(u64, [f64; 3])>,
}

impl StickPilot for ClimbPilot {
    fn move_sticks(&mut self, vehicle: &mut PilotedVehicle, now_ms: u64) -> Result<PilotDecision, String> {
        let is_armed = vehicle.pilot.armed();
        let us = &mut vehicle.transmitter.channels.us;
        let Some(armed_ms) = self.armed_ms else {
            // The switch is moved again and again until the vehicle is ready.
            let is_on = now_ms >= ARMS_MS && now_ms % AGAIN_MS >= AGAIN_MS / 2;
            us[ARM] = if is_on || is_armed { 2000 } else { 1000 };
            if is_armed {
                us[THROTTLE] = 1900;
                self.armed_ms = Some(now_ms);
                println!("{:7.3} s: armed by the switch", now_ms as f64 * 1e-3);
            }
            let is_late = now_ms > PATIENCE_MS;
            return if is_late { Err("the vehicle does not arm".to_owned()) } else { Ok(PilotDecision::GoesOn) };
        };
        let place_m = place_m(vehicle);
        let Some((up_ms, start_m)) = self.up else {
            if place_m[2] > HEIGHT_M {
                vehicle.transmitter.channels.us[THROTTLE] = 1500;
                self.up = Some((now_ms, place_m));
            }
            let is_late = now_ms > armed_ms + CLIMB_MS;
            return if is_late { Err("the vehicle does not climb".to_owned()) } else { Ok(PilotDecision::GoesOn) };
        };
        let off_m = hovers(vehicle, start_m)?;
        if now_ms < up_ms + HOVER_MS {
            return Ok(PilotDecision::GoesOn);
        }
        println!("{:7.3} s: hovers, {off_m:.2} m off", now_ms as f64 * 1e-3);
        Ok(PilotDecision::Ends)
    }
}

/// Pilot that moves the kill switch.
#[derive(Debug, Default)]
pub struct KillSwitchPilot {
    began_ms: Option<u64>,
    /// Time at which the last motor stopped for good \[ns\].
    pub stopped_ns: Option<u64>,
}

impl StickPilot for KillSwitchPilot {
    const LOOKS: bool = true;

    fn move_sticks(&mut self, vehicle: &mut PilotedVehicle, now_ms: u64) -> Result<PilotDecision, String> {
        let began_ms = *self.began_ms.get_or_insert(now_ms);
        if now_ms == began_ms + 10 {
            vehicle.transmitter.channels.us[KILL] = 2000;
        }
        Ok(if now_ms > began_ms + KILLS_MS { PilotDecision::Ends } else { PilotDecision::GoesOn })
    }

    fn see_motors(&mut self, vehicle: &PilotedVehicle, now_ns: u64) {
        self.stopped_ns = vehicle.is_stopped().then(|| self.stopped_ns.unwrap_or(now_ns));
    }
}

/// Parts of a flight with a loss of the receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum LossPhase {
    #[default]
    Silent,
    Back,
    Forward,
    Lands,
}

/// Pilot who loses the receiver, gets it back, flies forward and lands by the sticks.
#[derive(Debug, Default)]
pub struct ReceiverLossPilot {
    part: LossPhase,
    since_ms: Option<u64>,
    start_m: [f64; 3],
    /// Time from the last frame until the vehicle reported the loss \[ms\], largest position error until the stick is
    /// moved \[m\], and distance flown forward \[m\].
    lost_ms: Option<u64>,
    off_m: f64,
    way_m: f64,
}

impl StickPilot for ReceiverLossPilot {
    fn move_sticks(&mut self, vehicle: &mut PilotedVehicle, now_ms: u64) -> Result<PilotDecision, String> {
        let since_ms = match self.since_ms {
            Some(since_ms) => since_ms,
            None => {
                self.start_m = place_m(vehicle);
                *self.since_ms.insert(now_ms)
            }
        };
        let passed_ms = now_ms - since_ms;
        let now_m = place_m(vehicle);
        let says = |what: &str| vehicle.pilot.heard().iter().any(|(_, text)| text.contains(what));
        let next = match self.part {
            LossPhase::Silent => {
                let is_lost = says("radio: lost");
                if is_lost && self.lost_ms.is_none() {
                    self.lost_ms = Some(passed_ms);
                }
                if is_lost && passed_ms < HELD_MS {
                    return Err(format!("the link counts as lost after only {passed_ms} ms"));
                }
                if passed_ms > LOST_MS && !(is_lost && says("hold")) {
                    let heard = vehicle.pilot.heard();
                    return Err(format!("the vehicle does not change to hold; its texts are {heard:?}"));
                }
                self.off_m = self.off_m.max(hovers(vehicle, self.start_m)?);
                vehicle.transmitter.is_heard = passed_ms >= SILENT_MS;
                (passed_ms >= SILENT_MS).then_some(LossPhase::Back)
            }
            LossPhase::Back => {
                if passed_ms > 500 && !says("radio: heard") {
                    return Err("the vehicle does not hear the receiver again".to_owned());
                }
                self.off_m = self.off_m.max(hovers(vehicle, self.start_m)?);
                (passed_ms >= BACK_MS).then_some(LossPhase::Forward)
            }
            LossPhase::Forward => {
                vehicle.transmitter.channels.us[PITCH] = 1800;
                let yaw_rad = vehicle.pilot.motion().attitude_rad.z;
                let [x, y] = [0, 1].map(|axis| now_m[axis] - self.start_m[axis]);
                self.way_m = x * yaw_rad.cos() + y * yaw_rad.sin();
                (passed_ms >= FORWARD_MS).then_some(LossPhase::Lands)
            }
            LossPhase::Lands => {
                if self.way_m < WAY_M {
                    let way_m = self.way_m;
                    return Err(format!("the stick moves the vehicle by only {way_m:.2} m; {WAY_M} m are needed"));
                }
                let us = &mut vehicle.transmitter.channels.us;
                (us[PITCH], us[THROTTLE]) = (1500, 1000);
                if now_m[2] < 0.1 && passed_ms % 1000 == 0 {
                    us[ARM] = 1000;
                }
                if !vehicle.pilot.armed() {
                    let is_well = now_m[2] < 0.2 && vehicle.is_stopped();
                    return if is_well { Ok(PilotDecision::Ends) } else { Err(format!("disarmed at {now_m:.2?} m")) };
                }
                if passed_ms > LANDS_MS {
                    return Err(format!("the vehicle does not land: {now_m:.2?} m"));
                }
                None
            }
        };
        if let Some(next) = next {
            (self.part, self.since_ms, self.start_m) = (next, Some(now_ms), now_m);
        }
        Ok(PilotDecision::GoesOn)
    }
}

impl ReceiverLossPilot {
    /// Returns a summary of the flight.
    pub fn summary(&self) -> String {
        let ReceiverLossPilot { lost_ms, off_m, way_m, .. } = self;
        format!(
            "radio lost: noticed after {} ms; at most {off_m:.2} m off until the stick moves, then {way_m:.1} m \
             forward; landed",
            lost_ms.unwrap_or_default()
        )
    }
}
