//! Flies the mode: passes its output through the limiter and returns a setpoint.

use super::{GuidanceInputs, Memory, ModeMemory};
use crate::available_thrust::{AccelerationTrim, AvailableThrust};
use crate::course::{Hold, Land, Return, Takeoff};
use crate::mode::FlightMode;
use crate::mode_io::{ModeInputs, ModeOutput, Shaping};
use crate::notice::{GuidanceNotice, GuidanceNotices, ModeReason};
use crate::offboard::OffboardMemory;
use crate::order::{Item, OffboardTarget, Orders, Sticks};
use crate::place::is_within;
use crate::settings::Settings;
use crate::sticks;
use afbc_control::math::{abs_max, max};
use afbc_flight_core::landing::LEFT_M;
use afbc_flight_core::{Mode, Stamped};
use afbc_types::{Setpoint, State};
use nalgebra::{Vector2, Vector3};

/// Time after which a take-off is given up if the vehicle has not left the ground \[s\].
const NO_LIFT_S: f32 = 10.0;
/// The setpoint restarts at the vehicle if it is farther away than this distance \[m\], plus this time at its speed
/// \[s\].
const LEASH_M: f32 = 5.0;
const LEASH_S: f32 = 1.0;
/// Tighter limits of position and velocity after a loss of the state or a change of mode \[m, m/s\].
const ANEW_M: f32 = 1.0;
const ANEW_M_S: f32 = 1.5;
/// Touchdown detection. A landing vehicle touches the ground once it has been above its setpoint by `TOUCHES_M` \[m\]
/// for `TOUCHES_S` \[s\] without sinking faster than `TOUCHES_M_S` \[m/s\] or `TOUCHES_SHARE` of its setpoint's speed,
/// since an estimated vertical speed may be off by tenths of a metre per second. Then its motors idle for at most
/// `SETTLES_S` \[s\]: by then the land detector has confirmed the landing, or the velocity is wrong. If it was a false
/// detection in the air, the vehicle soon sinks faster than `FALLS_M_S` \[m/s\], which ends it. A vehicle that drops
/// from the edge of its feet stays slower.
const TOUCHES_M: f32 = 0.3;
const TOUCHES_S: f32 = 0.1;
const TOUCHES_M_S: f32 = 0.25;
const TOUCHES_SHARE: f32 = 0.8;
const SETTLES_S: f32 = 3.0;
const FALLS_M_S: f32 = 1.0;

impl Memory {
    /// Flies the mode. Returns the setpoint, and whether the motors idle on the ground.
    #[allow(clippy::too_many_arguments, reason = "parts of the tick")]
    pub(super) fn fly(
        &mut self,
        settings: &Settings,
        given: &GuidanceInputs<'_>,
        state: &State,
        dt_s: f32,
        orders: &Orders,
        target: Option<&Stamped<OffboardTarget>>,
        sticks: Option<&Sticks>,
        reached: &mut Option<u16>,
        notices: &mut GuidanceNotices,
    ) -> Option<(Option<Setpoint>, bool)> {
        let armed = given.core.armed();
        let airborne = armed && given.airborne;
        if !armed {
            // Keep the setpoint at the vehicle, so that arming holds the present position.
            self.limiter.rest(state);
            (self.enters, self.was_seen) = (false, true);
            (self.left, self.stood_m) = (false, state.position_m);
            self.mode_memory = ModeMemory::New;
            return Some((self.limiter.setpoint(), false));
        }
        if given.core == Mode::Descending {
            // The flight core descends by itself: a later mode must start at the vehicle.
            self.limiter.anchor(state);
        }
        self.follow_vehicle(state);
        let present = self.limiter.setpoint()?;
        let home_m = self.home_m.unwrap_or(state.position_m);
        let inputs = ModeInputs {
            flying: &settings.flying,
            limits: &settings.limits,
            dt_s,
            state,
            present: &present,
            airborne,
            home_m,
            speed_m_s: self.speed_m_s,
            ceiling_m: home_m.z + settings.failsafe.ceiling_m(),
        };
        let output = self.output(settings, &inputs, orders, target, sticks, &given.available_thrust, reached, notices);
        if output.done {
            self.hold_what_is_reached(&output.shaping, notices);
        }
        let idle_on_ground = !airborne && !output.lifts;
        if idle_on_ground {
            self.limiter.rest(state);
            (self.lift_s, self.left, self.stood_m) = (0.0, false, state.position_m);
            return Some((self.limiter.setpoint(), true));
        }
        if self.cannot_lift(given, state, airborne, dt_s) {
            let next = if airborne { FlightMode::Land } else { FlightMode::Hold };
            self.change(next, ModeReason::NoLift, notices);
            if !airborne {
                self.limiter.rest(state);
                return Some((self.limiter.setpoint(), true));
            }
        }
        // Skip the check without an inertial sensor: the observed motion then follows from the thrust, so a vehicle
        // with idle motors would appear to fall.
        let lands = output.lands && !given.sensors.inertial && given.core == Mode::Flying;
        if lands && self.touches(state, &present, dt_s) {
            // Idle instead of running the law: its moments for a level attitude, which the ground resists, have
            // priority over low thrust, and would push the vehicle about.
            return Some((Some(present), true));
        }
        Some((self.shaped(output.shaping, settings, &inputs, &given.available_thrust), false))
    }

    /// Changes to hold at the place that the mode has reached.
    fn hold_what_is_reached(&mut self, shaping: &Shaping, notices: &mut GuidanceNotices) {
        let at_m = match (&self.mode_memory, shaping) {
            (ModeMemory::Takeoff(takeoff), _) => Some(takeoff.to_m),
            (_, Shaping::Limited(aim)) if is_finite(&aim.position_m) => Some(aim.position_m),
            _ => None,
        };
        self.change(FlightMode::Hold, ModeReason::Done, notices);
        (self.mode_memory, self.enters) = (ModeMemory::Hold(Hold { at_m, ..Hold::default() }), false);
    }

    /// True once a take-off has not left the ground for [`NO_LIFT_S`]. Rotors that carry part of the weight make the
    /// flight core report a vehicle in the air. It is still on the ground if the thrust is exhausted or the vehicle
    /// does not follow its setpoint.
    fn cannot_lift(&mut self, given: &GuidanceInputs<'_>, state: &State, airborne: bool, dt_s: f32) -> bool {
        let off_m = abs_max(&(state.position_m - self.stood_m));
        let behind = |to: Setpoint| abs_max(&(to.position_m - state.position_m)) > ANEW_M;
        self.left |= airborne && off_m > LEFT_M;
        let lifts = !self.left
            && (!airborne || given.available_thrust.is_exhausted() || self.limiter.setpoint().is_some_and(behind));
        self.lift_s = if lifts { self.lift_s + dt_s } else { 0.0 };
        let gives_up = self.lift_s > NO_LIFT_S;
        // Give up only once: the mode that follows shall not be given up as well.
        self.left |= gives_up;
        gives_up
    }

    /// Returns the limited setpoint for the mode's output; none if it is not plausible.
    // This function is always inlined: copying the setpoint out of a call costs sixty instructions per tick.
    #[inline(always)]
    fn shaped(
        &mut self,
        shaping: Shaping,
        settings: &Settings,
        inputs: &ModeInputs<'_>,
        lift: &AvailableThrust,
    ) -> Option<Setpoint> {
        let ModeInputs { state, dt_s, .. } = *inputs;
        match shaping {
            Shaping::Limited(aim) => {
                (self.last_target, self.trim) = (aim, AccelerationTrim::default());
                self.limiter.advance(&self.last_target, dt_s);
                // Only the position can become implausible: the limiter bounds the rest.
                self.limiter.setpoint().filter(|setpoint| abs_max(&setpoint.position_m) <= 1e5)
            }
            Shaping::Leaning(aim, [x, y]) => {
                self.last_target = aim;
                self.limiter.advance(&aim, dt_s);
                self.limiter.follow(state);
                // The limiter's feedback holds the height, so the thrust is not trimmed.
                let lift = &AvailableThrust { given_m_s2: None, ..*lift };
                let leaning = self.limiter.setpoint().map(|setpoint| Setpoint {
                    position_m: Vector3::new(state.position_m.x, state.position_m.y, setpoint.position_m.z),
                    velocity_m_s: Vector3::new(state.velocity_m_s.x, state.velocity_m_s.y, setpoint.velocity_m_s.z),
                    acceleration_m_s2: Vector3::new(x, y, setpoint.acceleration_m_s2.z),
                    ..setpoint
                });
                leaning.map(|setpoint| self.trim.advance(lift, state, &setpoint, dt_s)).filter(Setpoint::is_plausible)
            }
            Shaping::Direct(setpoint) => {
                self.limiter.anchor(state);
                // If the state is lost, or the next mode has no target yet, the vehicle's present motion ends in a
                // stop.
                self.last_target = inputs.stop();
                let setpoint = lift.limited(&setpoint, state, &settings.limits);
                let setpoint = self.trim.advance(lift, state, &setpoint, dt_s);
                Some(setpoint).filter(Setpoint::is_plausible)
            }
            Shaping::Turning(target) => {
                self.limiter.anchor(state);
                (self.last_target, self.rates) = (inputs.stop(), Some(target));
                // The law flies this setpoint in the first 100 ms after a loss of the state, before the flight core
                // counts the vehicle as flying again.
                Some(Setpoint::hold(state))
            }
        }
    }

    /// True if a landing vehicle stands on the ground. In the air it would sink, which ends this.
    fn touches(&mut self, state: &State, present: &Setpoint, dt_s: f32) -> bool {
        let touches = |time_s: f32| (TOUCHES_S..TOUCHES_S + SETTLES_S).contains(&time_s);
        let slow_m_s = max(TOUCHES_M_S, -TOUCHES_SHARE * present.velocity_m_s.z);
        let most_m_s = if touches(self.touch_s) { max(FALLS_M_S, slow_m_s) } else { slow_m_s };
        let sinks = state.velocity_m_s.z < -most_m_s;
        let presses = state.position_m.z - present.position_m.z > TOUCHES_M;
        self.touch_s = if presses && !sinks { self.touch_s + dt_s } else { 0.0 };
        touches(self.touch_s)
    }

    /// Restarts the limiter at the vehicle, if the setpoint is too far from it.
    fn follow_vehicle(&mut self, state: &State) {
        let (enters, returns) = (self.enters, !self.was_seen);
        (self.enters, self.was_seen) = (false, true);
        let Some(present) = self.limiter.setpoint() else { return self.limiter.anchor(state) };
        let off_m = present.position_m - state.position_m;
        // A setpoint below the ground presses a landing vehicle onto it: ignore the height.
        let lands = matches!(self.mode, FlightMode::Land | FlightMode::Return) && off_m.z < 0.0;
        let off_m = if lands { Vector3::new(off_m.x, off_m.y, 0.0) } else { off_m };
        let off_m_s = present.velocity_m_s - state.velocity_m_s;
        let anew = enters || returns;
        let most_m = if anew { ANEW_M } else { LEASH_M }
            + LEASH_S * max(present.velocity_m_s.x.abs(), present.velocity_m_s.y.abs());
        let far = off_m.norm_squared() > most_m * most_m && !self.limiter.passes();
        let fast = anew && off_m_s.norm_squared() > ANEW_M_S * ANEW_M_S;
        if far || fast {
            self.limiter.anchor(state);
        }
    }

    /// Returns the output of the present mode.
    #[allow(clippy::too_many_arguments, reason = "parts of the tick")]
    fn output(
        &mut self,
        settings: &Settings,
        inputs: &ModeInputs<'_>,
        orders: &Orders,
        target: Option<&Stamped<OffboardTarget>>,
        sticks: Option<&Sticks>,
        lift: &AvailableThrust,
        reached: &mut Option<u16>,
        notices: &mut GuidanceNotices,
    ) -> ModeOutput {
        match self.mode {
            FlightMode::Hold => {
                if !matches!(self.mode_memory, ModeMemory::Hold(_) | ModeMemory::Orbit(_)) || !inputs.airborne {
                    self.mode_memory = ModeMemory::Hold(Hold::default());
                }
                match &mut self.mode_memory {
                    ModeMemory::Hold(hold) => ModeOutput::fly(hold.fly(inputs)),
                    ModeMemory::Orbit(orbit) => orbit.fly(inputs),
                    // This arm is unreachable, because `plan` has just set the memory for this mode. The same holds for
                    // the other modes.
                    _ => ModeOutput::fly(inputs.stop()),
                }
            }
            FlightMode::Takeoff => {
                if !matches!(self.mode_memory, ModeMemory::Takeoff(_)) {
                    self.mode_memory = ModeMemory::Takeoff(Takeoff::new(inputs, inputs.flying.takeoff_height_m));
                }
                match &self.mode_memory {
                    ModeMemory::Takeoff(takeoff) => takeoff.fly(inputs),
                    _ => ModeOutput::fly(inputs.stop()),
                }
            }
            FlightMode::Land => {
                if !matches!(self.mode_memory, ModeMemory::Land(_)) {
                    self.mode_memory = ModeMemory::Land(Land::default());
                }
                match &mut self.mode_memory {
                    ModeMemory::Land(land) => land.fly(inputs),
                    _ => ModeOutput::fly(inputs.stop()),
                }
            }
            FlightMode::Return => {
                if !matches!(self.mode_memory, ModeMemory::Return(_)) {
                    let plausible = |to_m: &Vector2<f32>| to_m.iter().all(|value| is_within(*value));
                    let to_m = orders.safe_m.filter(plausible).unwrap_or(inputs.home_m.xy());
                    self.mode_memory = ModeMemory::Return(Return::new(inputs, to_m));
                }
                match &mut self.mode_memory {
                    ModeMemory::Return(home) => home.fly(inputs),
                    _ => ModeOutput::fly(inputs.stop()),
                }
            }
            FlightMode::Mission => self.fly_mission(settings, inputs, orders, reached, notices),
            FlightMode::Offboard => {
                if !matches!(self.mode_memory, ModeMemory::Targets(_)) {
                    self.mode_memory = ModeMemory::Targets(OffboardMemory::default());
                }
                match (&mut self.mode_memory, target) {
                    (ModeMemory::Targets(targets), Some(target)) => targets.fly(target, inputs, lift),
                    _ => ModeOutput::fly(inputs.stop()),
                }
            }
            FlightMode::Position | FlightMode::Altitude | FlightMode::Stabilised | FlightMode::Acro => {
                let sticks = sticks.copied().unwrap_or_default();
                sticks::fly(self.mode, &sticks, inputs, lift)
            }
        }
    }

    fn fly_mission(
        &mut self,
        settings: &Settings,
        inputs: &ModeInputs<'_>,
        orders: &Orders,
        reached: &mut Option<u16>,
        notices: &mut GuidanceNotices,
    ) -> ModeOutput {
        if orders.leg.is_none_or(|leg| matches!(leg.item, Item::None)) {
            self.change(FlightMode::Hold, ModeReason::Cleared, notices);
            return ModeOutput::fly(inputs.stop());
        }
        let progress = self.mission.fly(orders.leg.as_ref(), inputs, &settings.failsafe);
        *reached = progress.reached;
        if progress.refused {
            notices.push(GuidanceNotice::ItemRefused);
            return ModeOutput { done: true, ..ModeOutput::fly(inputs.stop()) };
        }
        if let Some((mode, number)) = progress.then {
            self.change(mode, ModeReason::Mission, notices);
            self.mission.resume(0);
            // `enters` stays false, so that the setpoint continues from the mission's without a restart.
            (self.lands_item, self.enters) = (Some(number), false);
            return ModeOutput { lifts: inputs.airborne, ..ModeOutput::fly(inputs.stop()) };
        }
        progress.output
    }
}

fn is_finite(place_m: &Vector3<f32>) -> bool {
    place_m.iter().all(|value| value.is_finite())
}
