//! Handling of COMMAND_LONG and COMMAND_INT.

use super::{Comms, Reply};
use crate::services::commands::{BUSY, CALIBRATES, NO_ORIGIN, NOT_IN_CONTROL, NOT_KNOWN};
use crate::services::origin::resolve;
use crate::services::streams::{Requested, Streams, id};
use crate::services::telemetry::compose;
use crate::services::texts::{Words, reason};
use crate::services::{control, modes, sensors};
use afbc_flight_core::{Refusal, Request};
use afbc_guidance::{FlightMode, ORBIT_RADIUS_M, OrbitHeading, Order, OrderRefusal};
use afbc_mavlink::{Address, CommandResult, GlobalPosition, Height, MavSeverity, MessageInterval, VehicleCommand};
use afbc_onboard::{ControlInputs, give};
use nalgebra::Vector3;

impl Comms {
    /// Returns a reason against arming that the flight core does not know of.
    fn against_arming(&self) -> Option<(&'static str, i32)> {
        if self.calibration.active.is_some() {
            return Some(("arming refused: calibrating", CALIBRATES));
        }
        sensors::faulty(&self.status.aux).map(|text| (text, Refusal::SensorFailed as i32))
    }

    /// Carries out a command or passes it on. The command is answered once, to `from`.
    pub(super) fn command(&mut self, command: VehicleCommand, from: Address, inputs: &mut ControlInputs) {
        let id = command.id();
        // A command that cannot be answered is not carried out, except a command to stop the motors.
        if command != VehicleCommand::Kill && !self.commands.has_room() {
            return self.commands.answer(id, CommandResult::Refused(BUSY), from);
        }
        if control::is_needed_for(command) && !self.may(from, inputs) {
            return self.commands.answer(id, CommandResult::Refused(NOT_IN_CONTROL), from);
        }
        let answer = match command {
            VehicleCommand::Arm => match self.against_arming() {
                Some((text, reason)) => {
                    self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, text);
                    CommandResult::Refused(reason)
                }
                None => return self.ask(Request::Arm, id, from, inputs),
            },
            VehicleCommand::SelfTest if !self.calibrates => CommandResult::Unsupported,
            VehicleCommand::SelfTest if self.status.mode.armed() => {
                CommandResult::Refused(Refusal::AlreadyArmed as i32)
            }
            VehicleCommand::SelfTest if self.calibration.active.is_some() => CommandResult::Refused(CALIBRATES),
            VehicleCommand::SelfTest => {
                self.tests = true;
                CommandResult::Accepted
            }
            VehicleCommand::Disarm => return self.ask(Request::Disarm, id, from, inputs),
            VehicleCommand::Kill => return self.ask(Request::Kill, id, from, inputs),
            VehicleCommand::Engage => return self.ask(Request::Engage, id, from, inputs),
            VehicleCommand::Denied(_) => CommandResult::Denied,
            VehicleCommand::Other(_) => CommandResult::Unsupported,
            VehicleCommand::SetInterval { message, interval_us } => {
                if self.streams.set(message, interval_us, self.now_us) {
                    CommandResult::Accepted
                } else {
                    CommandResult::Unsupported
                }
            }
            VehicleCommand::GetInterval(_) if self.replies.is_full() => CommandResult::Refused(BUSY),
            VehicleCommand::GetInterval(message) => {
                self.reply(Reply::Interval(MessageInterval {
                    message,
                    interval_us: self.streams.interval_us(message),
                }));
                CommandResult::Accepted
            }
            VehicleCommand::RequestMessage { message, index } => self.request(message, index),
            VehicleCommand::RequestProtocol => self.request(id::PROTOCOL_VERSION, 0),
            VehicleCommand::RequestCapabilities => self.request(id::AUTOPILOT_VERSION, 0),
            VehicleCommand::Reboot(into) if !self.reboots.contains(&into) => CommandResult::Unsupported,
            VehicleCommand::Reboot(_) if self.status.mode.armed() => {
                CommandResult::Refused(Refusal::AlreadyArmed as i32)
            }
            VehicleCommand::Reboot(into) => {
                self.reboot = Some(into);
                CommandResult::Accepted
            }
            VehicleCommand::Storage(storage) => self.storage(storage),
            VehicleCommand::Calibrate(what) => self.ask_calibration(what),
            VehicleCommand::CheckArming => {
                self.check_arming(from);
                CommandResult::Accepted
            }
            VehicleCommand::SetCurrent(number, resets) => {
                let items = self.missions.items().len();
                if usize::from(number.unwrap_or(0)) >= items {
                    CommandResult::Refused(OrderRefusal::NoMission as i32)
                } else {
                    if resets {
                        self.missions.restart();
                        self.reached = None;
                    }
                    match number {
                        Some(number) => return self.order(Order::Resume(number), Some(id), from, inputs),
                        None => CommandResult::Accepted,
                    }
                }
            }
            _ => match self.order_of(command) {
                Ok(Order::Select(FlightMode::Mission)) if !self.is_mission_flown() => {
                    CommandResult::Refused(OrderRefusal::OutOfRange as i32)
                }
                Ok(order) if !self.fence_allows(&order) => {
                    self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, reason(OrderRefusal::OutsideFence));
                    CommandResult::Refused(OrderRefusal::OutsideFence as i32)
                }
                Ok(order) => {
                    if let VehicleCommand::Home(_) = command {
                        // MAVLink requires HOME_POSITION after each request, even if home has not changed.
                        self.streams.request(Requested { message: id::HOME_POSITION, index: 0 });
                    }
                    if let Order::Orbit { centre_m, radius_m, .. } = order {
                        let here_m = self.here();
                        let or_here = |to: f32, here: f32| if to.is_nan() { here } else { to };
                        self.orbit_m = Some((centre_m.zip_map(&here_m, or_here), radius_m));
                    }
                    if let VehicleCommand::StartMission(first, last) = command {
                        if self.missions.set_last(last) {
                            // The last item may have another `is_last` now, so the guidance must be given it again.
                            self.given = self.given.map(|(wanted, upload)| (wanted, upload.wrapping_sub(1)));
                        }
                        if first > 0 {
                            self.order(Order::Resume(first), None, from, inputs);
                        }
                    }
                    return self.order(order, Some(id), from, inputs);
                }
                Err(answer) => answer,
            },
        };
        self.commands.answer(id, answer, from);
    }

    /// Passes an order to the guidance. `command` is the number of the command to be answered, if any.
    pub(super) fn order(&mut self, order: Order, command: Option<u16>, from: Address, inputs: &mut ControlInputs) {
        if let Some(given) = self.commands.order(order, command, from, self.now_us) {
            give(inputs.order(), given);
        }
    }

    fn ask(&mut self, request: Request, id: u16, from: Address, inputs: &mut ControlInputs) {
        if let Some(asked) = self.commands.ask(request, id, from, self.now_us) {
            inputs.inbox.request(asked);
        }
    }

    /// Returns the guidance's order for a command, or the command's answer if there is none.
    fn order_of(&self, command: VehicleCommand) -> Result<Order, CommandResult> {
        Ok(match command {
            VehicleCommand::TakeOff(height) => Order::TakeOff(self.take_off_height(height)?),
            VehicleCommand::Land => Order::Select(FlightMode::Land),
            VehicleCommand::Return => Order::Select(FlightMode::Return),
            VehicleCommand::SelectMode(custom) => Order::Select(modes::of_custom(custom).ok_or(CommandResult::Denied)?),
            VehicleCommand::SelectStandardMode(mode) => {
                Order::Select(modes::of_standard(mode).ok_or(CommandResult::Denied)?)
            }
            VehicleCommand::Reposition { changes_mode: false, .. } if self.status.guided.mode != FlightMode::Hold => {
                return Err(CommandResult::Denied);
            }
            VehicleCommand::Reposition { place, yaw_rad, speed_m_s, .. } => {
                Order::GoTo { position_m: self.local(&place)?, yaw_rad, speed_m_s }
            }
            VehicleCommand::Orbit { place, radius_m, speed_m_s, angle_deg, heading } => {
                let heading = match heading {
                    0 => OrbitHeading::Centre,
                    3 => OrbitHeading::Along,
                    _ => OrbitHeading::Kept,
                };
                // MAVLink's positive radius is clockwise, the local frame's counterclockwise.
                let radius_m = if radius_m.is_nan() { -ORBIT_RADIUS_M } else { -radius_m };
                Order::Orbit { centre_m: self.local(&place)?, radius_m, speed_m_s, angle_deg, heading }
            }
            VehicleCommand::Speed(speed_m_s) => Order::Speed(speed_m_s),
            VehicleCommand::Home(place) => Order::Home(place.map(|place| self.local(&place)).transpose()?),
            VehicleCommand::StartMission(first, last) => {
                if usize::from(last.unwrap_or(first)) >= self.missions.items().len() {
                    return Err(CommandResult::Refused(OrderRefusal::NoMission as i32));
                }
                Order::Select(FlightMode::Mission)
            }
            // No other command is for the guidance.
            _ => return Err(CommandResult::Unsupported),
        })
    }

    /// Returns true if every mission item can be flown from here and now. Otherwise warns which item cannot.
    fn is_mission_flown(&mut self) -> bool {
        let problem = self.missions.problem(&self.surroundings());
        problem.iter().for_each(|words| self.texts.say(MavSeverity::MAV_SEVERITY_WARNING, words));
        problem.is_none()
    }

    /// Returns a take-off height relative to the vehicle's present height \[m\].
    fn take_off_height(&self, height: Height) -> Result<Option<f32>, CommandResult> {
        if height.metres.is_nan() {
            return Ok(None);
        }
        let place =
            GlobalPosition { latitude_e7: GlobalPosition::AS_IT_IS, longitude_e7: GlobalPosition::AS_IT_IS, height };
        let here_m = self.here().z;
        Ok(Some(self.local(&place)?.z - here_m))
    }

    /// Converts a place to the local frame.
    pub(super) fn local(&self, place: &GlobalPosition) -> Result<Vector3<f32>, CommandResult> {
        use afbc_mavlink::Datum;
        let home_m = self.status.guided.home_m.map_or(0.0, |home| home.z);
        match &self.status.aux.origin {
            Some(origin) => Ok(resolve(origin, place, home_m, self.here().z)),
            // A height relative to home or to the vehicle needs no origin.
            None if place.latitude_e7 == GlobalPosition::AS_IT_IS && place.height.above != Datum::Sea => {
                let above_m = if place.height.above == Datum::Home { home_m } else { self.here().z };
                Ok(Vector3::new(f32::NAN, f32::NAN, place.height.metres + above_m))
            }
            None => Err(CommandResult::Refused(NO_ORIGIN)),
        }
    }

    pub(super) fn here(&self) -> Vector3<f32> {
        self.status.state.map_or(Vector3::zeros(), |state| state.position_m)
    }

    /// Queues a requested message for sending.
    fn request(&mut self, message: u32, index: u32) -> CommandResult {
        let known = match message {
            id::HEARTBEAT | id::DEBUG_FLOAT_ARRAY | id::MISSION_CURRENT => true,
            id::HIGHRES_IMU => self.calibrates,
            id::ORBIT_EXECUTION_STATUS => self.orbit_status().is_some(),
            id::POSITION_TARGET_LOCAL_NED => self.followed().is_some(),
            id::ESC_INFO | id::ESC_STATUS => self.status.escs.is_known(),
            id::AVAILABLE_MODES => index <= modes::COUNT.into(),
            _ => compose(message, &self.status).is_some(),
        };
        let has_index = [id::AVAILABLE_MODES, id::ESC_INFO, id::ESC_STATUS].contains(&message);
        match (Streams::knows(message), known) {
            (false, _) => CommandResult::Unsupported,
            _ if index != 0 && !has_index => CommandResult::Denied,
            (_, false) if message == id::AVAILABLE_MODES => CommandResult::Denied,
            (_, false) => CommandResult::Refused(NOT_KNOWN),
            _ if self.streams.request(Requested { message, index }) => CommandResult::Accepted,
            _ => CommandResult::Refused(BUSY),
        }
    }

    /// Requests the report of arming checks, and warns the station if another one is in control.
    fn check_arming(&mut self, from: Address) {
        let holder = self.control.holder(self.now_us).filter(|holder| *holder != from);
        if let Some(holder) = holder {
            let words = Words::default().station(from).and(" may not arm: ").station(holder).and(" is in control");
            self.texts.say(MavSeverity::MAV_SEVERITY_WARNING, &words);
        }
        self.checks = Some(self.checks == Some(true) || holder.is_none());
    }

    /// Reports the arming checks of the last tick: the texts with which an arm command would have been refused.
    pub(super) fn report_checks(&mut self) {
        let (Some(may), Some(against)) = (self.checks.take(), self.status.against) else { return };
        let calibrates = self.calibration.active.is_some();
        if calibrates {
            self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, "arming refused: calibrating");
        }
        let faulty = sensors::faulty(&self.status.aux);
        if let Some(text) = faulty {
            self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, text);
        }
        if may && !calibrates && faulty.is_none() && against.is_empty() {
            self.texts.put(MavSeverity::MAV_SEVERITY_INFO, "ready to arm");
        }
        for reason in against.iter() {
            self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, reason.reason());
        }
    }
}
