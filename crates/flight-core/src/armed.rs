//! State of one flight, from arming on, and the setpoints for times without one from the commander.

use crate::dead_reckoning::{DeadReckoning, Reckoning};
use crate::descent::{Descent, Drift, shift};
use crate::fall_check::FallCheck;
use crate::frozen_tracker::FrozenTrackerCheck;
use crate::landing::LandDetector;
use crate::observer::PoseObserver;
use crate::rate_control::RateMemory;
use crate::supervisor::Mode;
use crate::tumble::Tumble;
use afbc_types::{Inputs, ResetDelta, Setpoint, State};
use nalgebra::Vector3;

/// State of one flight, from arming on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Armed<M> {
    pub(crate) control: M,
    pub(crate) reckoning: Reckoning,
    /// Motion observed from a tracker's poses, without an inertial sensor.
    pub(crate) observer: Option<PoseObserver>,
    /// Inputs last applied to the rotors.
    pub(crate) applied: Inputs,
    /// Inputs of the last tick, if it had no step of the law.
    pub(crate) open_loop: Option<Inputs>,
    /// What is remembered of turning at a pilot's rates.
    pub(crate) turning: RateMemory,
    /// True if it has turned by them since the law's last step and since it rested on the ground.
    pub(crate) turns: bool,
    /// True if it rests on the ground, and the controller's memory is as at take-off.
    pub(crate) idle_on_ground: bool,
    pub(crate) guide: Guide,
    pub(crate) landing: LandDetector,
    /// Whether it falls, if the state is an estimate by an inertial sensor.
    pub(crate) fall: FallCheck,
    pub(crate) tumble: Tumble,
    pub(crate) witness: FrozenTrackerCheck,
    /// True if the tracker contradicted itself or the thrust: its states are ignored for the rest of the flight.
    pub(crate) distrusts: bool,
}

/// Setpoints for times without one from the commander.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Guide {
    /// Setpoint to hold while there is no other.
    pub(crate) hold: Option<Setpoint>,
    pub(crate) descent: Option<Descent>,
    /// Motion and descent of a vehicle that does not know where it is.
    pub(crate) position_lost: Option<(Drift, Descent)>,
}

impl<M: Default> Armed<M> {
    /// Begins a flight, in the memory of the last one.
    // Out of line, so that the new memory is not built on the tick's stack and copied.
    #[cold]
    #[inline(never)]
    pub(crate) fn begin(
        flight: &mut Option<Self>,
        dead_reckoning: &DeadReckoning,
        weight_n: f32,
        state: &State,
        now_us: u64,
    ) {
        *flight = Some(Armed {
            control: M::default(),
            reckoning: dead_reckoning.start(state),
            observer: None,
            applied: Inputs::default(),
            open_loop: None,
            turning: RateMemory::default(),
            turns: false,
            // As after a rest: the law is told that it begins on the ground.
            idle_on_ground: true,
            guide: Guide::default(),
            landing: LandDetector::new(state, weight_n),
            fall: FallCheck::default(),
            tumble: Tumble::default(),
            witness: FrozenTrackerCheck::new(state, now_us),
            distrusts: false,
        });
    }

    /// Rests on the ground: the law begins afresh when it takes off, as after arming.
    pub(crate) fn rest(&mut self, dead_reckoning: &DeadReckoning, state: Option<&State>) {
        if !self.idle_on_ground {
            self.forget();
        }
        (self.idle_on_ground, self.turns, self.applied) = (true, false, Inputs::default());
        if let Some(state) = state {
            self.reckoning = dead_reckoning.start(state);
        }
    }

    /// Clears the controller's memory.
    #[cold]
    #[inline(never)]
    pub(crate) fn forget(&mut self) {
        (self.control, self.guide) = (M::default(), Guide::default());
    }
}

impl<M> Armed<M> {
    /// Advances the dead reckoning over the last period, corrected by a measurement if there is one.
    pub(crate) fn reckon(&mut self, dead_reckoning: &DeadReckoning, measured: Option<&State>) {
        dead_reckoning.advance(&mut self.reckoning, &self.applied);
        if let Some(state) = measured {
            dead_reckoning.measure(&mut self.reckoning, state);
        }
    }
}

impl Guide {
    /// Returns state and setpoint of a vehicle that does not know where it is, since `last`: downwards.
    pub(crate) fn down(&mut self, state: &State, last: Option<&State>, dt_s: f32) -> (State, &Setpoint) {
        // Both are made of positions: if one comes back, it is held, or descended from, where the vehicle is then.
        (self.hold, self.descent) = (None, None);
        let (drift, descent) = self.position_lost.get_or_insert_with(|| {
            // The horizontal position of `state` itself means nothing any more.
            let mut drift = Drift::new(last.unwrap_or(state).position_m.xy(), state);
            let begin = drift.advance(state, 0.0);
            (drift, Descent::new(&begin))
        });
        descent.advance(dt_s);
        (drift.advance(state, dt_s), descent.setpoint())
    }

    /// Shifts its setpoints with an estimate that has been set anew. Where the position is lost, its horizontal part
    /// means nothing.
    #[cold]
    #[inline(never)]
    pub(crate) fn shift(&mut self, reset: &ResetDelta) {
        let ResetDelta { position_m, yaw_rad } = *reset;
        let vertical = ResetDelta { position_m: Vector3::new(0.0, 0.0, position_m.z), yaw_rad };
        if let Some(hold) = &mut self.hold {
            shift(hold, reset);
        }
        if let Some(descent) = &mut self.descent {
            descent.shift(reset);
        }
        if let Some((_, descent)) = &mut self.position_lost {
            descent.shift(&vertical);
        }
    }

    /// Returns the setpoint for a fresh `state`: the descent's, the commander's, or a hold if there is none.
    pub(crate) fn target<'a>(
        &'a mut self,
        mode: Mode,
        state: &State,
        setpoint: Option<&'a Setpoint>,
        dt_s: f32,
    ) -> &'a Setpoint {
        self.position_lost = None;
        if mode == Mode::Descending {
            let descent = self.descent.get_or_insert_with(|| Descent::new(state));
            descent.advance(dt_s);
            return descent.setpoint();
        }
        // The next descent begins where the vehicle is then.
        self.descent = None;
        match setpoint {
            Some(setpoint) => {
                // The next gap is held where the vehicle is then.
                self.hold = None;
                setpoint
            }
            None => self.hold.get_or_insert_with(|| Setpoint::hold(state)),
        }
    }
}
