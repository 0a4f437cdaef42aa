//! A vehicle that is where the test puts it.
#![allow(dead_code, reason = "each of the tests uses a part")]

use afbc_flight_core::{ArmingLimits, Mode};
use afbc_guidance::*;
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;

pub(crate) const G: f32 = 9.81;
pub(crate) const NAN: f32 = f32::NAN;

/// A vehicle that does as the setpoint says, or stays as it is.
#[derive(Clone)]
pub(crate) struct Desk {
    pub(crate) guidance: Guidance,
    pub(crate) orders: Orders,
    pub(crate) state: Option<State>,
    pub(crate) core: Mode,
    pub(crate) airborne: bool,
    pub(crate) follows: bool,
    pub(crate) now_us: u64,
    pub(crate) dt_s: f32,
    /// Time at rest, as the flight core counts it \[s\].
    pub(crate) rest_s: f32,
    pub(crate) battery: Option<Reading>,
    pub(crate) sensors: Sensors,
    pub(crate) lift: Lift,
    pub(crate) said: Vec<Notice>,
}

pub(crate) fn at(x: f32, y: f32, z: f32) -> State {
    State { position_m: Vector3::new(x, y, z), ..State::default() }
}

pub(crate) fn fenced(radius: f32, height: f32) -> Settings {
    let net = Net { fence_radius_m: radius, fence_height_m: height, ..Net::DEFAULT };
    Settings { net, ..Settings::DEFAULT }
}

impl Desk {
    pub(crate) fn new(settings: Settings) -> Self {
        Desk {
            guidance: Guidance::new(settings).unwrap(),
            orders: Orders::default(),
            state: Some(at(1.0, 2.0, 3.0)),
            core: Mode::Disarmed,
            airborne: false,
            follows: true,
            now_us: 5_000_000,
            dt_s: 1e-3,
            rest_s: 0.0,
            battery: None,
            sensors: Sensors::default(),
            lift: Lift { most_m_s2: 2.0 * G, gravity_m_s2: G, given_m_s2: Some(G) },
            said: Vec::new(),
        }
    }

    /// A vehicle that holds in the air at (1, 2, 8), above a home at (1, 2, 3).
    pub(crate) fn flying(settings: Settings) -> Self {
        let mut desk = Desk::new(settings);
        desk.run(1100);
        desk.core = Mode::Flying;
        desk.run(10);
        desk.state = Some(at(1.0, 2.0, 8.0));
        desk.run(10);
        desk.airborne = true;
        desk.run(100);
        desk.said.clear();
        desk
    }

    pub(crate) fn tick(&mut self) -> Guided {
        self.now_us += 1000;
        let rests = self.state.as_ref().is_some_and(|state| ArmingLimits::DEFAULT.at_rest(state));
        self.rest_s = if rests { self.rest_s + 1e-3 } else { 0.0 };
        let sight = Sight {
            now_us: self.now_us,
            dt_s: self.dt_s,
            state: self.state.as_ref(),
            core: self.core,
            airborne: self.airborne,
            rested: self.rest_s >= 1.0,
            battery: self.battery,
            sensors: self.sensors,
            lift: self.lift,
        };
        let guided = self.guidance.tick(&sight, &self.orders.take());
        self.said.extend(guided.notices.iter());
        if let (true, Some(setpoint), Some(state)) = (self.follows && self.airborne, guided.setpoint, &mut self.state) {
            (state.position_m, state.velocity_m_s) = (setpoint.position_m, setpoint.velocity_m_s);
        }
        guided
    }

    pub(crate) fn run(&mut self, ticks: u32) -> Guided {
        let mut guided = self.tick();
        for _ in 1..ticks {
            guided = self.tick();
        }
        guided
    }

    pub(crate) fn order(&mut self, order: Order) -> Result<(), Declined> {
        self.orders.give(Given { order, ticket: 7 });
        let (ticket, answer) = self.tick().answer.unwrap();
        assert_eq!(ticket, 7);
        answer
    }

    /// Returns the answer to an order that leaves no trace.
    pub(crate) fn would(&self, order: Order) -> Result<(), Declined> {
        self.clone().order(order)
    }

    pub(crate) fn select(&mut self, mode: FlightMode) -> Result<(), Declined> {
        self.order(Order::Select(mode))
    }

    pub(crate) fn setpoint(&mut self) -> Setpoint {
        self.tick().setpoint.unwrap()
    }

    pub(crate) fn place(&self) -> Vector3<f32> {
        self.state.unwrap().position_m
    }
}

pub(crate) fn go(x: f32, y: f32, z: f32) -> Order {
    Order::GoTo { position_m: Vector3::new(x, y, z), yaw_rad: NAN, speed_m_s: None }
}
