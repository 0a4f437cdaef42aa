//! Memory of one flight, from arming on, and setpoints for when the commander sends none.

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

/// Memory of one flight, from arming on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Armed<M> {
    pub(crate) control: M,
    pub(crate) reckoning: Reckoning,
    /// Observer of the motion from a tracker's poses, used without an inertial sensor.
    pub(crate) observer: Option<PoseObserver>,
    /// Inputs last applied to the rotors.
    pub(crate) applied: Inputs,
    /// Inputs of the last tick, if the law did not run in it.
    pub(crate) open_loop: Option<Inputs>,
    /// Memory of the rate controller (acro mode).
    pub(crate) turning: RateMemory,
    /// True if the rate controller has run since the law's last step and since the vehicle idled on the ground.
    pub(crate) turns: bool,
    /// True while the vehicle idles on the ground; the controller's memory is then as at take-off.
    pub(crate) idle_on_ground: bool,
    pub(crate) guide: Guide,
    pub(crate) landing: LandDetector,
    /// Fall check, used if the state is an estimate by an inertial sensor.
    pub(crate) fall: FallCheck,
    pub(crate) tumble: Tumble,
    pub(crate) witness: FrozenTrackerCheck,
    /// True if the tracker contradicted itself or the thrust. Its states are then ignored for the rest of the flight.
    pub(crate) distrusts: bool,
}

/// Setpoints for when the commander sends none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Guide {
    /// Setpoint of a hold.
    pub(crate) hold: Option<Setpoint>,
    pub(crate) descent: Option<Descent>,
    /// Horizontal motion and descent of a vehicle that has lost its position.
    pub(crate) position_lost: Option<(Drift, Descent)>,
}

impl<M: Default> Armed<M> {
    /// Starts a flight in the memory of the last flight. It is not inlined, so that the tick's stack holds no copy of
    /// the new memory.
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
            // This tells the law that it starts on the ground, as after idling.
            idle_on_ground: true,
            guide: Guide::default(),
            landing: LandDetector::new(state, weight_n),
            fall: FallCheck::default(),
            tumble: Tumble::default(),
            witness: FrozenTrackerCheck::new(state, now_us),
            distrusts: false,
        });
    }

    /// Idles on the ground. The law restarts at take-off, as after arming.
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
    /// Advances the dead reckoning over the last period, and corrects it by a measurement if there is one.
    pub(crate) fn reckon(&mut self, dead_reckoning: &DeadReckoning, measured: Option<&State>) {
        dead_reckoning.advance(&mut self.reckoning, &self.applied);
        if let Some(state) = measured {
            dead_reckoning.measure(&mut self.reckoning, state);
        }
    }
}

impl Guide {
    /// Returns state and setpoint for the descent of a vehicle that has had no position since `last`.
    pub(crate) fn down(&mut self, state: &State, last: Option<&State>, dt_s: f32) -> (State, &Setpoint) {
        // Hold and descent depend on the position. If it comes back, they restart where the vehicle is then.
        (self.hold, self.descent) = (None, None);
        let (drift, descent) = self.position_lost.get_or_insert_with(|| {
            // The horizontal position of `state` is no longer valid.
            let mut drift = Drift::new(last.unwrap_or(state).position_m.xy(), state);
            let begin = drift.advance(state, 0.0);
            (drift, Descent::new(&begin))
        });
        descent.advance(dt_s);
        (drift.advance(state, dt_s), descent.setpoint())
    }

    /// Shifts the setpoints by an estimator reset. With the position lost, only the vertical part applies.
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

    /// Returns the setpoint for a fresh `state`: the descent's, the commander's, or a hold if there is neither.
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
        // The next descent starts at the vehicle.
        self.descent = None;
        match setpoint {
            Some(setpoint) => {
                // The next hold starts at the vehicle.
                self.hold = None;
                setpoint
            }
            None => self.hold.get_or_insert_with(|| Setpoint::hold(state)),
        }
    }
}
