//! Flies the mode: what it wants, limited, as a setpoint.

use super::{GuidanceInputs, Memory, Plan};
use crate::course::{Hold, Land, Return, Takeoff};
use crate::lift::{Lift, Trim};
use crate::mode::FlightMode;
use crate::mode_io::{ModeInputs, ModeOutput, Shaping};
use crate::notice::{ModeReason, Notice, Notices};
use crate::order::{Item, OffboardTarget, Orders, Sticks};
use crate::place::is_within;
use crate::settings::Settings;
use crate::sticks;
use crate::targets::Targets;
use afbc_control::math::{abs_max, max};
use afbc_flight_core::landing::LEFT_M;
use afbc_flight_core::{Mode, Stamped};
use afbc_types::{Setpoint, State};
use nalgebra::{Vector2, Vector3};

/// Time after which a take-off that has not left the ground is given up \[s\].
const NO_LIFT_S: f32 = 10.0;
/// Distance \[m\] from the vehicle, and time at its speed \[s\], at which the setpoint begins anew at the vehicle.
const LEASH_M: f32 = 5.0;
const LEASH_S: f32 = 1.0;
/// Likewise after an outage of the state, and when the mode changes \[m, m/s\].
const ANEW_M: f32 = 1.0;
const ANEW_M_S: f32 = 1.5;
/// A landing vehicle touches the ground once it has been above its setpoint by this much \[m\], for this long \[s\],
/// and does not sink faster than this \[m/s\], or than this share of its setpoint's speed: an estimated vertical speed
/// may be off by tenths. Then its motors idle for so long at most \[s\]: by then it has been found on the ground, or
/// its velocity is not what it seems. In the air it falls, and soon sinks faster than this \[m/s\], which ends it; a
/// vehicle that drops from the edge of its feet does not.
const TOUCHES_M: f32 = 0.3;
const TOUCHES_S: f32 = 0.1;
const TOUCHES_M_S: f32 = 0.25;
const TOUCHES_SHARE: f32 = 0.8;
const SETTLES_S: f32 = 3.0;
const FALLS_M_S: f32 = 1.0;

impl Memory {
    /// Flies the mode; returns the setpoint, and whether the vehicle rests on the ground.
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
        notices: &mut Notices,
    ) -> Option<(Option<Setpoint>, bool)> {
        let armed = given.core.armed();
        let airborne = armed && given.airborne;
        if !armed {
            // A disarmed vehicle that is armed now would hold its present position.
            self.limiter.rest(state);
            (self.enters, self.was_seen) = (false, true);
            (self.left, self.stood_m) = (false, state.position_m);
            self.plan = Plan::New;
            return Some((self.limiter.setpoint(), false));
        }
        if given.core == Mode::Descending {
            // It flies down by itself: what follows begins where the vehicle is then.
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
            ceiling_m: home_m.z + settings.net.ceiling_m(),
        };
        let output = self.output(settings, &inputs, orders, target, sticks, &given.lift, reached, notices);
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
        // What is observed without an inertial sensor follows from the thrust, so that it would fall.
        let lands = output.lands && !given.sensors.inertial && given.core == Mode::Flying;
        if lands && self.touches(state, &present, dt_s) {
            // A law would push itself about: the moments for a level attitude, which the ground resists, have priority
            // over little thrust.
            return Some((Some(present), true));
        }
        Some((self.shaped(output.shaping, settings, &inputs, &given.lift), false))
    }

    /// Changes to hold, where what was wanted has been reached.
    fn hold_what_is_reached(&mut self, shaping: &Shaping, notices: &mut Notices) {
        let at_m = match (&self.plan, shaping) {
            (Plan::Takeoff(takeoff), _) => Some(takeoff.to_m),
            (_, Shaping::Limited(aim)) if is_finite(&aim.position_m) => Some(aim.position_m),
            _ => None,
        };
        self.change(FlightMode::Hold, ModeReason::Done, notices);
        (self.plan, self.enters) = (Plan::Hold(Hold { at_m, ..Hold::default() }), false);
    }

    /// True once a take-off has not left the ground for [`NO_LIFT_S`]. Rotors that carry a share of the weight make the
    /// flight core report that the vehicle is airborne. It is not if the thrust is exhausted or it does not follow its
    /// setpoint.
    fn cannot_lift(&mut self, given: &GuidanceInputs<'_>, state: &State, airborne: bool, dt_s: f32) -> bool {
        let off_m = abs_max(&(state.position_m - self.stood_m));
        let behind = |to: Setpoint| abs_max(&(to.position_m - state.position_m)) > ANEW_M;
        self.left |= airborne && off_m > LEFT_M;
        let lifts =
            !self.left && (!airborne || given.lift.is_exhausted() || self.limiter.setpoint().is_some_and(behind));
        self.lift_s = if lifts { self.lift_s + dt_s } else { 0.0 };
        let gives_up = self.lift_s > NO_LIFT_S;
        // Given up once: the mode that follows is not given up in its turn.
        self.left |= gives_up;
        gives_up
    }

    /// Returns the setpoint for what the mode wants, within the limits; none if it is not plausible.
    // Always: copying the setpoint out of a call costs the tick sixty instructions.
    #[inline(always)]
    fn shaped(
        &mut self,
        shaping: Shaping,
        settings: &Settings,
        inputs: &ModeInputs<'_>,
        lift: &Lift,
    ) -> Option<Setpoint> {
        let ModeInputs { state, dt_s, .. } = *inputs;
        match shaping {
            Shaping::Limited(aim) => {
                (self.aim, self.trim) = (aim, Trim::default());
                self.limiter.advance(&self.aim, dt_s);
                // Only the position can become implausible: the limiter bounds all else.
                self.limiter.setpoint().filter(|setpoint| abs_max(&setpoint.position_m) <= 1e5)
            }
            Shaping::Leaning(aim, [x, y]) => {
                self.aim = aim;
                self.limiter.advance(&aim, dt_s);
                self.limiter.follow(state);
                // The height is held by feedback.
                let lift = &Lift { given_m_s2: None, ..*lift };
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
                // Through a gap of the state, or in the mode that follows, the vehicle's own motion goes on to a stop.
                self.aim = inputs.stop();
                let setpoint = lift.limited(&setpoint, state, &settings.limits);
                let setpoint = self.trim.advance(lift, state, &setpoint, dt_s);
                Some(setpoint).filter(Setpoint::is_plausible)
            }
            Shaping::Turning(target) => {
                self.limiter.anchor(state);
                (self.aim, self.rates) = (inputs.stop(), Some(target));
                // The law flies by it in the first 100 ms after an outage, before the vehicle counts as flying again.
                Some(Setpoint::hold(state))
            }
        }
    }

    /// True if a landing vehicle stands on the ground. In the air it would sink, and this would end.
    fn touches(&mut self, state: &State, present: &Setpoint, dt_s: f32) -> bool {
        let touches = |time_s: f32| (TOUCHES_S..TOUCHES_S + SETTLES_S).contains(&time_s);
        let slow_m_s = max(TOUCHES_M_S, -TOUCHES_SHARE * present.velocity_m_s.z);
        let most_m_s = if touches(self.touch_s) { max(FALLS_M_S, slow_m_s) } else { slow_m_s };
        let sinks = state.velocity_m_s.z < -most_m_s;
        let presses = state.position_m.z - present.position_m.z > TOUCHES_M;
        self.touch_s = if presses && !sinks { self.touch_s + dt_s } else { 0.0 };
        touches(self.touch_s)
    }

    /// Lets the limiter begin at the vehicle, if it is far from it.
    fn follow_vehicle(&mut self, state: &State) {
        let (enters, returns) = (self.enters, !self.was_seen);
        (self.enters, self.was_seen) = (false, true);
        let Some(present) = self.limiter.setpoint() else { return self.limiter.anchor(state) };
        let off_m = present.position_m - state.position_m;
        // Below the ground it presses the vehicle onto it.
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

    /// Returns what the mode wants.
    #[allow(clippy::too_many_arguments, reason = "parts of the tick")]
    fn output(
        &mut self,
        settings: &Settings,
        inputs: &ModeInputs<'_>,
        orders: &Orders,
        target: Option<&Stamped<OffboardTarget>>,
        sticks: Option<&Sticks>,
        lift: &Lift,
        reached: &mut Option<u16>,
        notices: &mut Notices,
    ) -> ModeOutput {
        match self.mode {
            FlightMode::Hold => {
                if !matches!(self.plan, Plan::Hold(_) | Plan::Orbit(_)) || !inputs.airborne {
                    self.plan = Plan::Hold(Hold::default());
                }
                match &mut self.plan {
                    Plan::Hold(hold) => ModeOutput::fly(hold.fly(inputs)),
                    Plan::Orbit(orbit) => orbit.fly(inputs),
                    // Never: the plan has just been made that of the mode. The same below.
                    _ => ModeOutput::fly(inputs.stop()),
                }
            }
            FlightMode::Takeoff => {
                if !matches!(self.plan, Plan::Takeoff(_)) {
                    self.plan = Plan::Takeoff(Takeoff::new(inputs, inputs.flying.takeoff_height_m));
                }
                match &self.plan {
                    Plan::Takeoff(takeoff) => takeoff.fly(inputs),
                    _ => ModeOutput::fly(inputs.stop()),
                }
            }
            FlightMode::Land => {
                if !matches!(self.plan, Plan::Land(_)) {
                    self.plan = Plan::Land(Land::default());
                }
                match &mut self.plan {
                    Plan::Land(land) => land.fly(inputs),
                    _ => ModeOutput::fly(inputs.stop()),
                }
            }
            FlightMode::Return => {
                if !matches!(self.plan, Plan::Return(_)) {
                    let plausible = |to_m: &Vector2<f32>| to_m.iter().all(|value| is_within(*value));
                    let to_m = orders.safe_m.filter(plausible).unwrap_or(inputs.home_m.xy());
                    self.plan = Plan::Return(Return::new(inputs, to_m));
                }
                match &mut self.plan {
                    Plan::Return(home) => home.fly(inputs),
                    _ => ModeOutput::fly(inputs.stop()),
                }
            }
            FlightMode::Mission => self.fly_mission(settings, inputs, orders, reached, notices),
            FlightMode::Offboard => {
                if !matches!(self.plan, Plan::Targets(_)) {
                    self.plan = Plan::Targets(Targets::default());
                }
                match (&mut self.plan, target) {
                    (Plan::Targets(targets), Some(target)) => targets.fly(target, inputs, lift),
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
        notices: &mut Notices,
    ) -> ModeOutput {
        if orders.leg.is_none_or(|leg| matches!(leg.item, Item::None)) {
            self.change(FlightMode::Hold, ModeReason::Cleared, notices);
            return ModeOutput::fly(inputs.stop());
        }
        let progress = self.mission.fly(orders.leg.as_ref(), inputs, &settings.net);
        *reached = progress.reached;
        if progress.refused {
            notices.push(Notice::ItemRefused);
            return ModeOutput { done: true, ..ModeOutput::fly(inputs.stop()) };
        }
        if let Some((mode, number)) = progress.then {
            self.change(mode, ModeReason::Mission, notices);
            self.mission.resume(0);
            // No new beginning for the limiter: the setpoint goes on from the mission's.
            (self.lands_item, self.enters) = (Some(number), false);
            return ModeOutput { lifts: inputs.airborne, ..ModeOutput::fly(inputs.stop()) };
        }
        progress.output
    }
}

fn is_finite(place_m: &Vector3<f32>) -> bool {
    place_m.iter().all(|value| value.is_finite())
}
