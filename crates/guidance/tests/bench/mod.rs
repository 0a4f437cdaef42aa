//! A point mass over flat ground that follows setpoints, with the flight core's land detector.

use afbc_control::math::wrap_angle;
use afbc_flight_core::landing::LandDetector;
use afbc_flight_core::supervisor::REST_US;
use afbc_flight_core::{ArmingLimits, Mode, Request, Stamped, Ticketed};
use afbc_guidance::*;
use afbc_types::{ResetDelta, Setpoint, State};
use nalgebra::Vector3;

pub(crate) const DT_S: f32 = 1e-3;
const G_M_S2: f32 = 9.81;

pub(crate) struct Bench {
    pub(crate) guidance: Guidance,
    pub(crate) orders: Orders,
    pub(crate) state: State,
    pub(crate) core: Mode,
    pub(crate) landing: LandDetector,
    pub(crate) now_us: u64,
    pub(crate) battery: Option<BatteryReading>,
    pub(crate) sensors: FailedSensors,
    /// True while the station is heard, and while the state is visible.
    pub(crate) heard: bool,
    pub(crate) sees: bool,
    /// Acceleration by wind \[m/s2\].
    pub wind_m_s2: Vector3<f32>,
    /// The mission.
    pub(crate) items: Vec<Item>,
    pub(crate) said: Vec<GuidanceNotice>,
    pub(crate) reached: Vec<u16>,
    pub(crate) answers: Vec<(u8, Result<(), OrderRefusal>)>,
    pub(crate) last: Option<GuidanceOutputs>,
    /// Highest place of the flight \[m\].
    pub(crate) highest_m: f32,
    /// Estimator reset of the next tick, and the sum of all resets so far.
    reset: Option<ResetDelta>,
    resets: ResetDelta,
    thrust_m_s2: f32,
    /// Time at rest as the flight core would count it \[us\].
    rest_us: u32,
}

pub(crate) fn settings() -> Settings {
    Settings::DEFAULT
}

impl Bench {
    pub(crate) fn new(settings: Settings) -> Self {
        let state = State::default();
        Bench {
            guidance: Guidance::new(settings).unwrap(),
            orders: Orders::default(),
            state,
            core: Mode::Disarmed,
            landing: LandDetector::new(&state, G_M_S2),
            now_us: 1_000_000,
            battery: None,
            sensors: FailedSensors::default(),
            heard: true,
            sees: true,
            wind_m_s2: Vector3::zeros(),
            items: Vec::new(),
            said: Vec::new(),
            reached: Vec::new(),
            answers: Vec::new(),
            last: None,
            highest_m: 0.0,
            reset: None,
            resets: ResetDelta::default(),
            thrust_m_s2: 0.0,
            rest_us: 0,
        }
    }

    /// Returns a bench that hovers in hold at the take-off height.
    pub(crate) fn hovering(settings: Settings) -> Self {
        let mut bench = Bench::new(settings);
        bench.run(1.5);
        bench.arm();
        bench.order(Order::TakeOff(None)).unwrap();
        bench.run_until(20.0, |guided| guided.mode == FlightMode::Hold);
        bench.run(1.0);
        bench.said.clear();
        bench
    }

    /// Resets the estimate without moving the vehicle.
    pub(crate) fn reset(&mut self, by: ResetDelta) {
        self.state.position_m += by.position_m;
        self.state.attitude_rad.z = wrap_angle(self.state.attitude_rad.z + by.yaw_rad);
        self.resets.position_m += by.position_m;
        self.resets.yaw_rad += by.yaw_rad;
        self.reset = Some(by);
    }

    /// Returns the true position, without the resets \[m\].
    pub(crate) fn true_m(&self) -> Vector3<f32> {
        self.state.position_m - self.resets.position_m
    }

    pub(crate) fn true_rad(&self) -> f32 {
        wrap_angle(self.state.attitude_rad.z - self.resets.yaw_rad)
    }

    pub(crate) fn arm(&mut self) {
        self.core = Mode::Flying;
        self.landing = LandDetector::new(&self.state, G_M_S2);
        self.run(0.1);
    }

    pub(crate) fn airborne(&self) -> bool {
        self.core.armed() && self.landing.airborne()
    }

    /// True once the vehicle has been at rest long enough to arm.
    pub(crate) fn rested(&self) -> bool {
        self.rest_us >= REST_US
    }

    pub(crate) fn order(&mut self, order: Order) -> Result<(), OrderRefusal> {
        self.orders.given.push_back(Ticketed { value: order, ticket: 7 }).unwrap();
        let guided = self.tick();
        let (ticket, answer) = guided.answer.unwrap();
        assert_eq!(ticket, 7);
        answer
    }

    pub(crate) fn select(&mut self, mode: FlightMode) -> Result<(), OrderRefusal> {
        self.order(Order::Select(mode))
    }

    pub(crate) fn aim(&mut self, target: OffboardTarget) {
        self.orders.target = Some(Stamped { value: target, at_us: self.now_us });
    }

    pub(crate) fn run(&mut self, time_s: f32) {
        for _ in 0..(time_s / DT_S) as u32 {
            self.tick();
        }
    }

    /// Runs until `ends`. Returns the time that this took \[s\].
    pub(crate) fn run_until(&mut self, most_s: f32, ends: impl Fn(&GuidanceOutputs) -> bool) -> f32 {
        for tick in 0..(most_s / DT_S) as u32 {
            if ends(&self.tick()) {
                return tick as f32 * DT_S;
            }
        }
        panic!("not within {most_s} s: {:?} at {:?}, said {:?}", self.last, self.state, self.said)
    }

    pub(crate) fn tick(&mut self) -> GuidanceOutputs {
        self.now_us += 1000;
        let rests = self.sees && ArmingLimits::DEFAULT.at_rest(&self.state);
        self.rest_us = if rests { self.rest_us + 1000 } else { 0 };
        if self.heard {
            self.orders.heard_us = Some(self.now_us);
        }
        let wanted = self.last.map_or(0, |guided| guided.wanted);
        self.orders.leg = self.items.get(usize::from(wanted)).map(|item| RequestedItem {
            number: wanted,
            upload: 1,
            item: *item,
            is_last: usize::from(wanted) + 1 == self.items.len(),
        });
        let sight = GuidanceInputs {
            now_us: self.now_us,
            dt_s: DT_S,
            state: self.sees.then_some(&self.state),
            reset: self.reset.as_ref(),
            core: self.core,
            airborne: self.airborne(),
            rested: self.rested(),
            battery: self.battery,
            sensors: self.sensors,
            available_thrust: AvailableThrust { most_m_s2: 2.0 * G_M_S2, gravity_m_s2: G_M_S2, given_m_s2: None },
        };
        let guided = self.guidance.tick(&sight, &self.orders);
        self.reset = None;
        self.orders.given.pop_front();
        self.said.extend(guided.notices.iter());
        self.reached.extend(guided.reached);
        self.answers.extend(guided.answer);
        self.fly(&guided);
        if guided.request == Some(Request::Disarm) && !self.airborne() {
            self.core = Mode::Disarmed;
        }
        self.last = Some(guided);
        guided
    }

    fn fly(&mut self, guided: &GuidanceOutputs) {
        let State { position_m, velocity_m_s, .. } = self.state;
        let idles = !self.core.armed() || guided.idle_on_ground && self.core != Mode::Descending;
        let wanted_m_s2 = match &guided.setpoint {
            // The flight core descends by itself.
            _ if self.core == Mode::Descending => (Vector3::new(0.0, 0.0, -0.5) - velocity_m_s) * 6.0,
            _ if idles => Vector3::new(0.0, 0.0, -G_M_S2),
            None => Vector3::zeros(),
            Some(setpoint) => {
                (setpoint.position_m - position_m) * 9.0
                    + (setpoint.velocity_m_s - velocity_m_s) * 6.0
                    + setpoint.acceleration_m_s2
            }
        };
        self.thrust_m_s2 = if idles { 0.0 } else { (wanted_m_s2.z + G_M_S2).clamp(0.0, 2.0 * G_M_S2) };
        let mut acceleration_m_s2 =
            Vector3::new(wanted_m_s2.x, wanted_m_s2.y, self.thrust_m_s2 - G_M_S2) + self.wind_m_s2;
        // An estimator reset does not move the ground.
        let ground_m = self.resets.position_m.z;
        let on_ground = position_m.z <= ground_m && acceleration_m_s2.z <= 0.0;
        if on_ground {
            acceleration_m_s2 = Vector3::zeros();
            self.state.velocity_m_s = Vector3::zeros();
        }
        self.state.velocity_m_s += acceleration_m_s2 * DT_S;
        self.state.position_m += self.state.velocity_m_s * DT_S;
        if self.state.position_m.z < ground_m {
            self.state.position_m.z = ground_m;
            self.state.velocity_m_s = Vector3::zeros();
        }
        if let Some(Setpoint { yaw_rad, .. }) = guided.setpoint.filter(|_| !idles) {
            self.state.attitude_rad.z = yaw_rad;
        }
        self.highest_m = self.highest_m.max(self.state.position_m.z);
        if !self.core.armed() {
            return;
        }
        if guided.idle_on_ground && !self.landing.airborne() {
            self.landing.rest(Some(&self.state));
        } else {
            self.landing.advance(&self.state, self.thrust_m_s2, 1000, DT_S);
        }
    }
}

/// Returns a target of position alone.
pub(crate) fn motion(position_m: Vector3<f32>) -> MotionTarget {
    let none = Vector3::repeat(f32::NAN);
    MotionTarget {
        position_m,
        velocity_m_s: none,
        acceleration_m_s2: none,
        yaw_rad: f32::NAN,
        yaw_rate_rad_s: f32::NAN,
        body: false,
    }
}
