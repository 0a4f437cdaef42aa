//! One tick of the guidance: runs the failsafe checks, answers orders, decides the flight mode and flies it.

mod flying;
mod orders;

use crate::available_thrust::{AccelerationTrim, AvailableThrust};
use crate::battery::BatteryReading;
use crate::course::{Hold, Land, Return, Takeoff};
use crate::failsafe::{self, FailedSensors, FailsafeInputs, FailsafeMemory};
use crate::limiter::{Limiter, LimiterTarget};
use crate::mission::MissionMemory;
use crate::mode::FlightMode;
use crate::notice::{FailsafeCause, GuidanceNotice, GuidanceNotices, ModeReason};
use crate::offboard::{self, OffboardMemory};
use crate::orbit::Orbit;
use crate::order::{Item, OffboardTarget, OrderRefusal, Orders, Sticks};
use crate::settings::Settings;
use crate::sticks;
use crate::table::{self, FailsafeAction, TransitionInputs};
use afbc_control::math::{max, min};
use afbc_flight_core::{Mode, RateTarget, Reasons, Refusal, Request, Stamped};
use afbc_types::{Declared, OutOfRange, ResetDelta, Setpoint, State};
use nalgebra::Vector3;

/// Time between two disarm requests \[s\].
const REQUEST_S: f32 = 0.1;

/// Inputs of a tick of the guidance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidanceInputs<'a> {
    /// Time since power-up \[us\].
    pub now_us: u64,
    /// Time since the last tick \[s\].
    pub dt_s: f32,
    /// Fresh state; none if there is none or the position is not known.
    pub state: Option<&'a State>,
    /// Estimator reset of this tick, if there was one.
    pub reset: Option<&'a ResetDelta>,
    /// Mode of the flight core.
    pub core: Mode,
    /// True if the flight core reports the vehicle in the air.
    pub airborne: bool,
    /// True if the flight core reports that the vehicle has been at rest long enough to arm.
    pub rested: bool,
    /// The battery's measurements.
    pub battery: Option<BatteryReading>,
    /// Sensors that have failed.
    pub sensors: FailedSensors,
    /// Thrust of the rotors.
    pub available_thrust: AvailableThrust,
}

/// Outputs of a tick of the guidance, for the flight core, stations and logs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GuidanceOutputs {
    /// Setpoint for the flight core; none without a state.
    pub setpoint: Option<Setpoint>,
    /// True if the motors shall idle: the vehicle is armed and stays on the ground, or touches it while landing.
    pub idle_on_ground: bool,
    /// Request to the flight core, repeated until granted.
    pub request: Option<Request>,
    /// Ticket of the oldest order in [`Orders::given`], and the answer to it.
    pub answer: Option<(u8, Result<(), OrderRefusal>)>,
    /// Flight mode.
    pub mode: FlightMode,
    /// Announcements.
    pub notices: GuidanceNotices,
    /// Number of the mission item that [`Orders::leg`] must contain. After an item that ends the mission with another
    /// mode, its number stays here until that mode has landed.
    pub wanted: u16,
    /// Number of the mission item completed in this tick.
    pub reached: Option<u16>,
    /// Home position \[m\].
    pub home_m: Option<Vector3<f32>>,
    /// Failsafe cause that selected the present mode; none once a pilot or a station has selected another mode.
    pub failsafe: Option<FailsafeCause>,
    /// True if the vehicle is armed and in the air.
    pub airborne: bool,
    /// Charge of the battery, 0 to 1.
    pub charge: Option<f32>,
    /// True while flying an ordered orbit.
    pub orbits: bool,
}

/// The guidance of one vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guidance {
    settings: Settings,
    memory: Memory,
}

/// Memory of the guidance between ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Memory {
    limiter: Limiter,
    mode: FlightMode,
    mode_memory: ModeMemory,
    mission: MissionMemory,
    failsafe_memory: FailsafeMemory,
    home_m: Option<Vector3<f32>>,
    /// True if home was set by order. Then arming does not change it.
    home_ordered: bool,
    /// Ordered speed limit; infinite for none \[m/s\].
    speed_m_s: f32,
    /// Target of the last tick, flown on while the state is missing.
    last_target: LimiterTarget,
    /// Correction of attitude and thrust in modes that command these.
    trim: AccelerationTrim,
    /// Body rates that the sticks command in mode acro.
    rates: Option<RateTarget>,
    was_armed: bool,
    /// True if the last tick had a state.
    was_seen: bool,
    /// True if the mode has just changed, and has not yet been flown.
    enters: bool,
    /// True if the vehicle has been in the air since it was armed.
    flown: bool,
    failsafe: Option<FailsafeCause>,
    /// Mode that the flight core's descent interrupted; kept until it resumes or another mode is selected.
    interrupted: Option<InterruptedMode>,
    /// Mission item that counts as done once the vehicle has landed.
    lands_item: Option<u16>,
    /// Time for which the motors have idled on the ground \[s\].
    ground_s: f32,
    /// Time for which a landing vehicle has been held up above its setpoint, time for which a take-off has not left the
    /// ground, and time since the last disarm request \[s\].
    touch_s: f32,
    lift_s: f32,
    request_s: f32,
    /// Place where the vehicle last stood on the ground \[m\], and whether it has left that place since.
    stood_m: Vector3<f32>,
    left: bool,
    /// True once the disarming on the ground has been announced.
    disarms: bool,
    against: Reasons,
}

/// State of an interrupted mode, to be resumed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct InterruptedMode {
    mode: FlightMode,
    mode_memory: ModeMemory,
    failsafe: Option<FailsafeCause>,
    lands_item: Option<u16>,
    speed_m_s: f32,
}

/// Memory of the present mode.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ModeMemory {
    /// Not started yet.
    New,
    Hold(Hold),
    Orbit(Orbit),
    Takeoff(Takeoff),
    Land(Land),
    Return(Return),
    Targets(OffboardMemory),
}

impl Guidance {
    /// Makes the guidance of a disarmed vehicle.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(settings: Settings) -> Result<Self, OutOfRange> {
        settings.validate()?;
        let memory = Memory {
            limiter: Limiter::new(settings.limits)?,
            mode: FlightMode::Hold,
            mode_memory: ModeMemory::New,
            mission: MissionMemory::default(),
            failsafe_memory: FailsafeMemory::default(),
            home_m: None,
            home_ordered: false,
            speed_m_s: f32::INFINITY,
            last_target: LimiterTarget::stop(1.0, 1.0, 1.0),
            trim: AccelerationTrim::default(),
            rates: None,
            was_armed: false,
            was_seen: false,
            enters: false,
            flown: false,
            failsafe: None,
            interrupted: None,
            lands_item: None,
            ground_s: 0.0,
            touch_s: 0.0,
            lift_s: 0.0,
            request_s: REQUEST_S,
            stood_m: Vector3::zeros(),
            left: false,
            disarms: false,
            against: Reasons::NONE,
        };
        Ok(Guidance { settings, memory })
    }

    /// Changes the parameters. The limiter's parameters apply from the next tick.
    ///
    /// # Errors
    /// The first parameter out of range; nothing has changed then.
    pub fn set(&mut self, settings: Settings) -> Result<(), OutOfRange> {
        settings.validate()?;
        self.memory.limiter.set(settings.limits);
        self.settings = settings;
        Ok(())
    }

    /// Returns the parameters.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the body rates that the flight core flies instead of the setpoint, in mode acro.
    pub fn rates(&self) -> Option<&RateTarget> {
        self.memory.rates.as_ref()
    }

    /// Returns the guidance's reasons against arming, as they were while the vehicle was disarmed.
    // These reasons are not in the output of a tick, of which the firmware has a queue, because the flight core's
    // reasons include them.
    pub fn arming_refusals(&self) -> Reasons {
        self.memory.against
    }

    /// Returns the flight mode.
    pub fn mode(&self) -> FlightMode {
        self.memory.mode
    }

    /// Runs one tick. Call it every millisecond. Cannot fail.
    #[must_use = "the vehicle must fly the returned setpoint"]
    #[inline]
    pub fn tick(&mut self, given: &GuidanceInputs<'_>, orders: &Orders) -> GuidanceOutputs {
        let state = given.state.filter(|state| state.is_plausible());
        self.tick_with_plausible_state(&GuidanceInputs { state, ..*given }, orders)
    }

    /// As [`tick`](Self::tick), for a state that is [plausible](State::is_plausible), as those of the flight core are.
    #[inline(always)]
    pub fn tick_with_plausible_state(&mut self, given: &GuidanceInputs<'_>, orders: &Orders) -> GuidanceOutputs {
        self.memory.tick(&self.settings, given, orders)
    }
}

impl Memory {
    #[inline]
    fn tick(&mut self, settings: &Settings, given: &GuidanceInputs<'_>, orders: &Orders) -> GuidanceOutputs {
        // The comparison is false for NaN.
        let dt_s = if given.dt_s > 0.0 { min(max(given.dt_s, 1e-4), 0.02) } else { 0.001 };
        let state = given.state;
        let armed = given.core.armed();
        let airborne = armed && given.airborne;
        let mut notices = GuidanceNotices::default();
        self.time(airborne, dt_s);
        if let Some(reset) = given.reset.filter(|_| self.was_seen) {
            self.shift(reset, settings.flying.within_m);
        }
        // Home must be found before `decide`, which updates `was_armed`.
        self.find_home(state, given.rested, armed);
        // A new mission must be noticed before the orders are carried out, which may select one of its items.
        if orders.leg.is_some_and(|leg| self.mission.begins_anew(leg.upload)) {
            self.lands_item = None;
        }

        // Failsafe checks.
        let target = fresh_target(orders, given.now_us, settings.flying.targets_lost_s);
        let sticks = fresh_sticks(orders, given.now_us, settings.flying.sticks_lost_s);
        let findings = FailsafeInputs {
            mode: self.mode,
            armed,
            descends: given.core == Mode::Descending,
            position_m: state.map(|state| state.position_m),
            home_m: self.home_m,
            battery: given.battery.as_ref(),
            sensors: given.sensors,
            // The time saturates at 71 minutes in 32 bits, longer than any COM_DL_LOSS_T.
            silent_us: orders
                .heard_us
                .map(|heard_us| u32::try_from(given.now_us.saturating_sub(heard_us)).unwrap_or(u32::MAX)),
            targets: target.is_some(),
            sticks: sticks.is_some(),
            fence: orders.fence.unwrap_or_default(),
            dt_s,
        };
        let (held, cause, new) = self.failsafe_memory.update(&settings.failsafe, &findings, &mut notices);
        let seen = TransitionInputs {
            armed,
            airborne,
            positioned: state.is_some(),
            // Once the state is back, orders count again, even while the flight core still descends.
            descends: findings.descends && state.is_none(),
            mission: orders.leg.is_some_and(|leg| !matches!(leg.item, Item::None)),
            targets: target.is_some(),
            sticks: sticks.is_some(),
            held,
        };

        // Decides the mode.
        // Only when the cause is new: otherwise each tick until the vehicle stops would restart the mode.
        let leaves = findings.fence.leaves && failsafe::is_new(new, FailsafeCause::Fence);
        let back = state.is_some() && !findings.descends;
        self.decide(settings, &seen, cause, new, [leaves, back], &mut notices);
        let first = orders.given.front();
        let answer = first.map(|given| (given.ticket, self.order(settings, &given.value, state, &seen, &mut notices)));

        // Flies it.
        let mut reached = None;
        let flight = match state {
            Some(state) => {
                self.fly(settings, given, state, dt_s, orders, target, sticks.as_ref(), &mut reached, &mut notices)
            }
            None => {
                if armed && airborne {
                    self.limiter.advance(&self.last_target, dt_s);
                }
                self.was_seen = false;
                None
            }
        };
        // Without a state, the flight core alone decides in the air, and the motors idle on the ground.
        let (setpoint, idle_on_ground) = flight.unwrap_or((None, armed && !airborne));
        if !armed {
            self.against = self.find_arming_refusals(settings, given, state, findings.fence.outside);
        }
        let request = self.disarms(settings, armed, airborne, idle_on_ground, held, dt_s, &mut reached, &mut notices);
        GuidanceOutputs {
            setpoint,
            idle_on_ground,
            request,
            answer,
            mode: self.mode,
            notices,
            wanted: self.lands_item.unwrap_or(self.mission.wanted),
            reached,
            home_m: self.home_m,
            failsafe: self.failsafe,
            airborne,
            charge: self.failsafe_memory.charge(),
            orbits: matches!(self.mode_memory, ModeMemory::Orbit(_)),
        }
    }

    /// Changes the mode if a failsafe or the end of a flight requires it, and announces the causes in the set `new`.
    /// `leaves`: the vehicle has just begun to leave the uploaded geofence. `back`: the position is known, and the
    /// flight core does not descend.
    #[inline]
    fn decide(
        &mut self,
        settings: &Settings,
        seen: &TransitionInputs,
        cause: FailsafeCause,
        new: u16,
        [leaves, back]: [bool; 2],
        notices: &mut GuidanceNotices,
    ) {
        if self.was_armed && !seen.armed {
            self.disarmed(notices);
        }
        self.was_armed = seen.armed;
        if back && let Some(flown) = self.interrupted {
            self.resume(&flown, notices);
        }
        let mut announced = None;
        if let Some(next) = table::forced(self.mode, seen) {
            let Memory { mode, mode_memory, failsafe, lands_item, speed_m_s, .. } = *self;
            self.change(next, ModeReason::Failsafe(cause), notices);
            (self.failsafe, announced) = (Some(cause), Some(cause));
            if seen.descends {
                self.interrupted = Some(InterruptedMode { mode, mode_memory, failsafe, lands_item, speed_m_s });
            }
        }
        if leaves && seen.airborne {
            self.stop_at_fence(settings.failsafe.fence_action.action(), notices);
        }
        if new != 0 {
            failsafe::announce(&settings.failsafe, new, announced, notices);
        }
    }

    /// Sets home when the vehicle has first been at rest long enough to arm, since stations arm as soon as there is a
    /// home. Sets it again at arming, unless home was ordered.
    fn find_home(&mut self, state: Option<&State>, rested: bool, armed: bool) {
        let Some(state) = state else { return };
        if self.home_m.is_none() && rested || armed && !self.was_armed && !self.home_ordered {
            self.home_m = Some(state.position_m);
        }
    }

    /// Shifts everything relative to the vehicle by an estimator reset: the setpoint, the place of a hold or stop, the
    /// end of a take-off. Ordered places and mission items do not move, and are flown to; one already reached moves
    /// along and is held.
    #[cold]
    #[inline(never)]
    fn shift(&mut self, reset: &ResetDelta, within_m: f32) {
        let present_m = self.limiter.setpoint().map(|present| present.position_m);
        self.limiter.shift(reset);
        self.stood_m += reset.position_m;
        self.mission.shift(reset);
        match &mut self.mode_memory {
            ModeMemory::Hold(hold) => hold.shift(reset, present_m, within_m),
            ModeMemory::Takeoff(takeoff) => takeoff.shift(reset),
            ModeMemory::Land(land) => land.shift(reset),
            ModeMemory::Return(home) => home.shift(reset, present_m, within_m),
            ModeMemory::New | ModeMemory::Orbit(_) | ModeMemory::Targets(_) => {}
        }
    }

    /// Updates the `flown` flag and the time since the last disarm request.
    fn time(&mut self, airborne: bool, dt_s: f32) {
        self.flown |= airborne;
        self.request_s = min(self.request_s + dt_s, REQUEST_S);
    }

    /// Resets the flight's memory after disarming.
    fn disarmed(&mut self, notices: &mut GuidanceNotices) {
        (self.flown, self.failsafe, self.speed_m_s) = (false, None, f32::INFINITY);
        (self.ground_s, self.lift_s) = (0.0, 0.0);
        self.mission.resume(0);
        // A vehicle cannot be armed in mode land or return, so hold replaces them. Manual modes stay selected.
        if !self.mode.is_manual() && self.mode != FlightMode::Hold {
            self.change(FlightMode::Hold, ModeReason::Disarmed, notices);
        }
    }

    fn change(&mut self, next: FlightMode, reason: ModeReason, notices: &mut GuidanceNotices) {
        if next != self.mode {
            notices.push(GuidanceNotice::Mode(next, reason));
        }
        self.speed_m_s = f32::INFINITY;
        self.mission.pause();
        (self.mode, self.mode_memory, self.enters, self.lift_s) = (next, ModeMemory::New, true, 0.0);
        (self.trim, self.rates) = (AccelerationTrim::default(), None);
        (self.lands_item, self.interrupted) = (None, None);
    }

    /// Resumes the mode that a loss of the state interrupted, from the vehicle's present place.
    #[cold]
    #[inline(never)]
    fn resume(&mut self, flown: &InterruptedMode, notices: &mut GuidanceNotices) {
        self.change(flown.mode, ModeReason::Back, notices);
        (self.mode_memory, self.failsafe) = (flown.mode_memory, flown.failsafe);
        (self.lands_item, self.speed_m_s) = (flown.lands_item, flown.speed_m_s);
    }

    /// Stops a vehicle about to cross the uploaded geofence in a mode that the failsafe action does not replace: a
    /// flight in hold stops, and a return lands.
    fn stop_at_fence(&mut self, action: FailsafeAction, notices: &mut GuidanceNotices) {
        if action < FailsafeAction::Hold {
            return;
        }
        let next = match &self.mode_memory {
            ModeMemory::Return(home) if home.is_on_its_way() => FlightMode::Land,
            ModeMemory::Hold(_) | ModeMemory::Orbit(_) if self.mode == FlightMode::Hold => FlightMode::Hold,
            _ => return,
        };
        self.change(next, ModeReason::Failsafe(FailsafeCause::Fence), notices);
        self.failsafe = Some(FailsafeCause::Fence);
    }

    /// Returns a disarm request for a vehicle on the ground, if it shall disarm.
    #[allow(clippy::too_many_arguments, reason = "parts of the tick")]
    fn disarms(
        &mut self,
        settings: &Settings,
        armed: bool,
        airborne: bool,
        idle_on_ground: bool,
        held: FailsafeAction,
        dt_s: f32,
        reached: &mut Option<u16>,
        notices: &mut GuidanceNotices,
    ) -> Option<Request> {
        if !armed || airborne || !idle_on_ground {
            (self.ground_s, self.disarms) = (0.0, false);
            return None;
        }
        self.ground_s += dt_s;
        let lands = matches!(self.mode, FlightMode::Land | FlightMode::Return);
        if lands && let Some(number) = self.lands_item.take() {
            *reached = Some(number);
        }
        let flying = &settings.flying;
        let wait_s = if self.flown { flying.disarm_after_s } else { flying.disarm_before_s };
        let waited = wait_s > 0.0 && self.ground_s >= wait_s;
        if !(lands || held >= FailsafeAction::Return || waited) {
            return None;
        }
        if !self.disarms {
            self.disarms = true;
            notices.push(GuidanceNotice::Disarms);
        }
        if self.request_s < REQUEST_S {
            return None;
        }
        self.request_s = 0.0;
        Some(Request::Disarm)
    }

    /// Returns the reasons against arming that only the guidance knows.
    fn find_arming_refusals(
        &self,
        settings: &Settings,
        given: &GuidanceInputs<'_>,
        state: Option<&State>,
        outside_fence: bool,
    ) -> Reasons {
        let mut reasons = Reasons::NONE;
        let watched = self.failsafe_memory.is_watched(&settings.failsafe);
        let known = given.battery.is_some() && self.failsafe_memory.charge().is_some();
        reasons.note(
            watched && (!known || self.failsafe_memory.is_present(FailsafeCause::BatteryLow)),
            Refusal::BatteryLow,
        );
        reasons.note(given.sensors.any(), Refusal::SensorFailed);
        let outside = state.is_some_and(|state| !self.is_inside(settings, &state.position_m));
        reasons.note(outside || outside_fence, Refusal::OutsideFence);
        reasons
    }
}

/// Returns the newest target, if plausible and not older than `lost_s`.
#[inline]
fn fresh_target(orders: &Orders, now_us: u64, lost_s: f32) -> Option<&Stamped<OffboardTarget>> {
    let target = orders.target.as_ref().filter(|target| is_fresh(target, now_us, lost_s))?;
    offboard::is_plausible(&target.value).then_some(target)
}

/// Returns the newest sticks, if plausible and not older than `lost_s`.
#[inline]
fn fresh_sticks(orders: &Orders, now_us: u64, lost_s: f32) -> Option<Sticks> {
    let sticks = orders.sticks.filter(|sticks| is_fresh(sticks, now_us, lost_s))?;
    sticks::is_plausible(&sticks.value).then_some(sticks.value)
}

fn is_fresh<T>(stamped: &Stamped<T>, now_us: u64, lost_s: f32) -> bool {
    stamped.age_us(now_us) as f32 * 1e-6 <= lost_s
}
