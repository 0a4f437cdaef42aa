//! Compares the control tick with the law's step, and tests blind flight with a plant.

use afbc::reference::ReferenceModel;
use afbc::{Adaptive, Controller, Profile, Settings};
use afbc_control::{FlightController, Trace};
use afbc_flight_core::descent::SINK_M_S;
use afbc_flight_core::landing::{CARRIED_US, STILL_US};
use afbc_flight_core::{
    ArmingLimits, EndReason, FlightCore, FlightCoreMemory, Inbox, Mode, Refusal, Request, RequestAnswer, Stamped,
    TickOutcome, Ticketed,
};
use afbc_types::{Parameters, RotorSpeeds, Setpoint, State};
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;

type Adapted = afbc::CascadeMemory<afbc::AdaptiveEstimate>;

/// Settings without a reference model, so that errors are distances from the setpoint.
fn settings() -> Settings {
    Settings { reference: ReferenceModel::DEFAULT, ..Profile::Flight.settings() }
}

fn controller(settings: Settings) -> Controller<Adaptive> {
    let law = Adaptive::new(Profile::Flight.gains()).expect("valid");
    Controller::new(Parameters::PAPER.to_f32(), settings, law).expect("valid")
}

fn vehicle() -> FlightCore<Controller<Adaptive>> {
    FlightCore::new(Parameters::PAPER.to_f32(), ArmingLimits::default(), controller(settings())).expect("valid")
}

/// A vehicle, its memory and the time.
struct Bench {
    vehicle: FlightCore<Controller<Adaptive>>,
    memory: FlightCoreMemory<Adapted>,
    now_us: u64,
    inbox: Inbox,
    /// Alternating noise of the measured height, since trackers never repeat a state \[m\].
    noise_m: f32,
}

impl Bench {
    fn new() -> Self {
        Bench {
            vehicle: vehicle(),
            memory: FlightCoreMemory::default(),
            now_us: 0,
            inbox: Inbox::default(),
            noise_m: 0.0,
        }
    }

    /// Returns the trace of the last tick.
    fn trace(&self) -> Trace {
        self.memory.trace::<Controller<Adaptive>, 4>()
    }

    fn ask(&mut self, request: Request) {
        assert!(self.inbox.request(Ticketed { value: request, ticket: 3 }));
    }

    /// Returns a bench that has flown at `state` towards `setpoint` for one tick.
    fn flying(state: State, setpoint: Setpoint) -> Self {
        let mut bench = Bench::new();
        for _ in 0..1001 {
            bench.tick(Some(state), Some(setpoint));
        }
        bench.ask(Request::Arm);
        assert_eq!(bench.tick(Some(state), Some(setpoint)).answer, answer(Request::Arm, Ok(())));
        bench.tick(Some(state), Some(setpoint));
        bench
    }

    /// Returns a bench in the air, carried by its rotors for long enough, with a tracker's noise.
    fn airborne(state: State, setpoint: Setpoint) -> Self {
        let mut bench = Bench { noise_m: 1e-6, ..Bench::flying(state, setpoint) };
        for _ in 0..CARRIED_US / 1000 {
            bench.tick(Some(state), Some(setpoint));
        }
        bench
    }

    /// Runs a tick with this measurement and setpoint.
    fn tick(&mut self, state: Option<State>, setpoint: Option<Setpoint>) -> TickOutcome {
        self.now_us += 1000;
        let at_us = self.now_us;
        if let Some(mut value) = state {
            self.noise_m = -self.noise_m;
            value.position_m.z += self.noise_m;
            self.inbox.put_state(Stamped { value, at_us });
        }
        if let Some(value) = setpoint {
            self.inbox.put_setpoint(Stamped { value, at_us });
        }
        let inbox = self.inbox.take();
        self.vehicle.tick(&mut self.memory, self.now_us, &inbox)
    }
}

fn answer(request: Request, result: Result<(), Refusal>) -> Option<RequestAnswer> {
    Some(RequestAnswer { ticket: 3, request, result })
}

fn near() -> Setpoint {
    Setpoint { position_m: Vector3::new(0.3, -0.2, 0.5), ..Setpoint::default() }
}

#[test]
fn disarmed_motors_are_off_and_arming_waits_for_the_rate() {
    let mut bench = Bench::new();
    for _ in 0..1000 {
        bench.ask(Request::Arm);
        let outcome = bench.tick(Some(State::default()), Some(near()));
        assert_eq!(outcome.answer, answer(Request::Arm, Err(Refusal::Unhealthy)));
        assert_eq!((outcome.mode, outcome.motors), (Mode::Disarmed, RotorSpeeds::default()));
    }
    bench.ask(Request::Arm);
    let outcome = bench.tick(Some(State::default()), Some(near()));
    assert_eq!((outcome.mode, outcome.answer), (Mode::Flying, answer(Request::Arm, Ok(()))));
    assert_eq!(outcome.motors, RotorSpeeds::default(), "idle in the tick of arming");
    assert!(bench.tick(Some(State::default()), Some(near())).motors.0.min() > 0.0);
}

/// In flight, a tick equals the step of a law that started on the ground, bit for bit.
#[test]
fn flying_is_the_laws_step() {
    let mut bench = Bench::flying(State::default(), near());
    let controller = controller(settings());
    let mut memory = afbc_control::Validated::default();
    controller.on_ground(&mut memory.control);
    let _ = controller.step(&mut memory, Some(&State::default()), &near());
    for tick in 0..500 {
        let t = tick as f32 * 1e-3;
        let mut state = State { position_m: Vector3::new(t, -t, 0.1 * t), ..State::default() };
        state.attitude_rad = Vector3::new(0.1 * (9.0 * t).sin(), 0.2 * t, -t);
        state.rates_rad_s = Vector3::new(t, -t, 0.3);
        let command = controller.step(&mut memory, Some(&state), &near());
        let outcome = bench.tick(Some(state), Some(near()));
        assert_eq!((outcome.forces, outcome.health.control), (command.forces, command.health));
        assert_eq!(bench.trace(), Controller::<Adaptive>::trace(&memory.control));
        assert_eq!(outcome.motors.0.map(f32::to_bits), command.speeds.0.map(f32::to_bits));
        let estimates = bench.memory.control().map(|control| &control.estimates);
        assert_eq!(estimates, Some(&memory.control.estimates));
    }
}

#[test]
fn the_estimates_of_one_flight_are_not_those_of_the_next() {
    let mut bench = Bench::flying(State::default(), near());
    for _ in 0..200 {
        bench.tick(Some(State::default()), Some(near()));
    }
    let learnt = bench.memory.control().expect("flown").estimates;
    let fresh = Bench::flying(State::default(), near()).memory.control().expect("flown").estimates;
    assert_ne!(learnt, fresh, "it has learnt");
    bench.ask(Request::Kill);
    let outcome = bench.tick(Some(State::default()), Some(near()));
    assert_eq!((outcome.mode, outcome.motors), (Mode::Disarmed, RotorSpeeds::default()));
    assert_eq!(outcome.ended, Some(EndReason::Killed));
    assert_eq!(bench.memory.control().expect("flown").estimates, learnt, "still there to be reported");
    bench.ask(Request::Arm);
    bench.tick(Some(State::default()), Some(near()));
    bench.tick(Some(State::default()), Some(near()));
    assert_eq!(bench.memory.control().expect("flown").estimates, fresh);
}

/// The mode depends on the age of the state. The law's estimates are frozen while the vehicle has no state.
#[test]
fn a_lost_state_leads_to_coasting_descending_and_stopping() {
    let mut bench = Bench::airborne(State::default(), near());
    let mut frozen = None;
    for age_ms in 1..=2300 {
        let outcome = bench.tick(None, Some(near()));
        let expected = match age_ms {
            0..=20 => Mode::Flying,
            21..=250 => Mode::Coasting,
            251..=2250 => Mode::Descending,
            _ => Mode::Disarmed,
        };
        assert_eq!(outcome.mode, expected, "{age_ms} ms");
        assert_eq!(outcome.health.state_age_us, age_ms * 1000);
        assert_eq!(outcome.motors == RotorSpeeds::default(), expected == Mode::Disarmed);
        let estimates = bench.memory.control().expect("flown").estimates;
        if expected != Mode::Flying {
            assert_eq!(*frozen.get_or_insert(estimates), estimates);
        }
    }
}

/// Weight of the paper's vehicle \[N\].
const WEIGHT_N: f32 = 0.486 * 9.81;

#[test]
fn blind_thrust_is_the_weight_and_then_less() {
    let mut bench = Bench::airborne(State::default(), Setpoint::hold(&State::default()));
    let thrusts: Vec<f32> = (1..=400)
        .map(|_| {
            bench.tick(None, Some(near()));
            bench.trace().inputs.thrust_n
        })
        .collect();
    let (coasting, descending) = (thrusts.get(100).expect("400 ticks"), thrusts.get(399).expect("400 ticks"));
    assert!((coasting / WEIGHT_N - 1.0).abs() < 0.05, "{coasting}");
    assert!((descending / coasting - 0.9).abs() < 1e-5, "{descending}");
}

/// Roll of a plant with the nominal inertia and ideal rotors, with a constant external moment.
struct Roll {
    angle: f32,
    rate: f32,
    outside_n: f32,
}

impl Roll {
    fn state(&self) -> State {
        State {
            attitude_rad: Vector3::new(self.angle, 0.0, 0.0),
            rates_rad_s: Vector3::new(self.rate, 0.0, 0.0),
            ..State::default()
        }
    }

    fn advance(&mut self, outcome: &TickOutcome) {
        let [f1, _, f3, _] = outcome.forces.0.into();
        self.rate += 0.25 / 0.0038 * (f3 - f1 + self.outside_n) * 1e-3;
        self.angle += self.rate * 1e-3;
    }
}

/// The state is lost while the vehicle rolls at 1 rad/s. Without control it would reach 0.35 rad after coasting and 2.3
/// rad when the motors stop. With the unknown external moment it would be upside down long before.
#[test]
fn coasting_stops_the_rotation_and_descending_levels() {
    for outside_n in [0.0, 0.02, -0.02] {
        let mut roll = Roll { angle: 0.0, rate: 0.0, outside_n };
        let mut bench = Bench::airborne(roll.state(), Setpoint::hold(&State::default()));
        for _ in 0..5000 {
            let outcome = bench.tick(Some(roll.state()), Some(Setpoint::hold(&State::default())));
            roll.advance(&outcome);
        }
        (roll.angle, roll.rate) = (0.1, 1.0);
        let mut held = None;
        for age_ms in 0..=2250 {
            let measured = (age_ms == 0).then(|| roll.state());
            let outcome = bench.tick(measured, Some(Setpoint::hold(&State::default())));
            roll.advance(&outcome);
            match age_ms {
                250 => {
                    assert!(roll.rate.abs() < 0.3, "{} rad/s after coasting", roll.rate);
                    assert!((roll.angle - 0.1).abs() < 0.1, "{} rad after coasting", roll.angle);
                    held = Some(outcome.mode);
                }
                1000 => assert!(roll.angle.abs() < 0.1, "{} rad while descending", roll.angle),
                2250 => assert!(roll.angle.abs() < 0.31, "{} rad when giving up", roll.angle),
                _ => {}
            }
        }
        assert_eq!(held, Some(Mode::Coasting));
    }
}

#[test]
fn without_a_setpoint_the_vehicle_stays_where_it_is() {
    let mut bench = Bench::airborne(State::default(), near());
    for age_ms in 1..=500 {
        assert!(!bench.tick(Some(State::default()), None).health.setpoint_stale, "{age_ms} ms");
    }
    bench.noise_m = 0.0;
    let here = State { position_m: Vector3::new(1.0, 2.0, 3.0), ..State::default() };
    let outcome = bench.tick(Some(here), None);
    assert!(outcome.health.setpoint_stale);
    assert_eq!((outcome.mode, bench.trace().errors.x.e1), (Mode::Flying, 0.0));
    // The position of that moment is held.
    let moved = State { position_m: Vector3::new(1.25, 2.0, 3.0), ..State::default() };
    bench.tick(Some(moved), None);
    assert_eq!(bench.trace().errors.x.e1, -0.25);
    // A returning setpoint is flown. It is near enough that no speed limit reduces the error.
    bench.tick(Some(moved), Some(near()));
    assert_eq!(bench.trace().errors.x.e1, 0.3 - 1.25);
}

#[test]
fn a_state_that_comes_back_leads_the_descent_for_a_second() {
    for gap in [false, true] {
        let mut bench = Bench::airborne(State::default(), near());
        for _ in 0..300 {
            bench.tick(None, Some(near()));
        }
        let mut state = State { position_m: Vector3::new(1.0, 2.0, 3.0), ..State::default() };
        state.velocity_m_s.z = -SINK_M_S;
        for tick in 1..=1300 {
            // A gap that coasting would bridge restarts the second.
            let lost = gap && (500..522).contains(&tick);
            let outcome = bench.tick((!lost).then_some(state), Some(near()));
            let resumed_at = if gap { 1521 } else { 1000 };
            let expected = if tick < resumed_at { Mode::Descending } else { Mode::Flying };
            assert_eq!(outcome.mode, expected, "{tick} ms");
            state.position_m.z -= SINK_M_S * 1e-3;
        }
        if !gap {
            // The commander's setpoint is flown again, and the next descent starts at the vehicle.
            assert!((bench.trace().errors.x.e1 - (near().position_m.x - 1.0)).abs() < 1e-3);
            for _ in 0..300 {
                bench.tick(None, Some(near()));
            }
            state.position_m.z = 1.0;
            assert_eq!(bench.tick(Some(state), Some(near())).mode, Mode::Descending);
            assert!(bench.trace().errors.z.e1.abs() < 1e-2);
        }
    }
}

#[test]
fn a_state_that_comes_back_near_the_ground_leads_the_descent_there() {
    let mut bench = Bench::airborne(State::default(), near());
    for _ in 0..300 {
        bench.tick(None, Some(near()));
    }
    let mut state = State { position_m: Vector3::new(1.0, 2.0, 3.0), ..State::default() };
    state.velocity_m_s.z = -SINK_M_S;
    for tick in 1..=700 {
        let outcome = bench.tick(Some(state), Some(near()));
        assert_eq!(outcome.mode, Mode::Descending);
        let sunk = bench.trace().errors.z.e1 + state.position_m.z - 3.0;
        assert!((sunk + SINK_M_S * tick as f32 * 1e-3).abs() < 1e-3);
        assert!(bench.trace().errors.x.e1.abs() < 1e-6);
        state.position_m.z -= SINK_M_S * 1e-3;
    }
    state.velocity_m_s.z = 0.0;
    // The vehicle stops on the ground. It has landed when it has stood still with low thrust for a second.
    let mut uncarried_ms = 0;
    let ended = (0..3000).find_map(|_| {
        uncarried_ms += u32::from(bench.trace().inputs.thrust_n < 0.6 * WEIGHT_N);
        let outcome = bench.tick(Some(state), Some(near()));
        assert!(outcome.mode == Mode::Descending || outcome.motors == RotorSpeeds::default());
        outcome.ended
    });
    assert_eq!(ended, Some(EndReason::Landed));
    assert!((STILL_US / 1000..STILL_US / 1000 + 500).contains(&uncarried_ms), "{uncarried_ms} ms");
}

#[test]
fn states_that_arrive_stale_do_not_count() {
    let mut bench = Bench::airborne(State::default(), near());
    let mut modes = Vec::new();
    for _ in 0..400 {
        let at_us = bench.now_us + 1000 - 30_000;
        bench.inbox.put_state(Stamped { value: State::default(), at_us });
        modes.push(bench.tick(None, Some(near())).mode);
    }
    modes.dedup();
    assert_eq!(modes, [Mode::Flying, Mode::Coasting, Mode::Descending]);
}

#[test]
fn only_a_law_at_the_ticks_rate_flies() {
    let settings = Profile::Flight.settings().with_dt_s(0.002);
    let refused = FlightCore::new(Parameters::PAPER.to_f32(), ArmingLimits::default(), controller(settings));
    assert_eq!(refused.expect_err("2 ms").range.name, "dt_s");
}

proptest! {
    /// With any inputs at any time, the motors get valid speeds, zero when disarmed, and nothing panics.
    #[test]
    fn any_inputs(
        script in prop::collection::vec(
            (any::<u32>(), prop::option::of((any::<[f32; 12]>(), any::<u64>())), any::<u8>()),
            1..100,
        ),
    ) {
        let mut bench = Bench::flying(State::default(), near());
        for (later, state, request) in script {
            bench.now_us += u64::from(later % 100_000);
            if let Some(([x, y, z, u, v, w, a, b, c, p, q, r], at_us)) = state {
                let value = State {
                    position_m: Vector3::new(x, y, z),
                    velocity_m_s: Vector3::new(u, v, w),
                    attitude_rad: Vector3::new(a, b, c),
                    rates_rad_s: Vector3::new(p, q, r),
                };
                let at_us = if at_us % 2 == 0 { bench.now_us } else { at_us };
                bench.inbox.put_state(Stamped { value, at_us });
            }
            match request {
                0..16 => bench.ask(Request::Arm),
                16..20 => bench.ask(Request::Disarm),
                20..22 => bench.ask(Request::Kill),
                _ => {}
            }
            let outcome = bench.tick(None, Some(near()));
            prop_assert!(outcome.motors.0.iter().all(|speed| speed.is_finite() && *speed >= 0.0));
            prop_assert!(outcome.mode.armed() || outcome.motors.0 == Vector4::zeros());
        }
    }
}

/// The reasons against arming reported in a tick match the answer to a request to arm, whether there is one or not. "At
/// rest" is reported as arming requires it.
#[test]
fn the_reasons_of_a_tick_are_its_answer() {
    let mut bench = Bench::new();
    let moves = State { velocity_m_s: Vector3::new(0.0, 0.6, 0.0), ..State::default() };
    let tilts = State { attitude_rad: Vector3::new(0.3, 0.0, 0.0), ..moves };
    let far = Setpoint { position_m: Vector3::new(9.0, 0.0, 0.0), ..Setpoint::default() };
    let here = Some(State::default());
    for (ticks, state, setpoint) in [
        (500, Some(tilts), None),
        (600, Some(moves), Some(far)),
        (990, here, Some(far)),
        (30, here, Some(near())),
        (40, None, Some(near())),
        (1010, here, Some(near())),
    ] {
        for _ in 0..ticks {
            let mut twin = Bench { memory: bench.memory, inbox: bench.inbox.clone(), ..Bench::new() };
            (twin.now_us, twin.noise_m) = (bench.now_us, bench.noise_m);
            twin.ask(Request::Arm);
            let received = bench.tick(state, setpoint).against;
            let asked = twin.tick(state, setpoint);
            assert_eq!((asked.answer, asked.against), (answer(Request::Arm, received.verdict()), received));
            assert_eq!(received.contains(Refusal::NotAtRest), !bench.memory.rested());
        }
    }
    bench.ask(Request::Arm);
    assert!(bench.tick(here, Some(near())).against.is_empty());
    let armed = bench.tick(here, Some(near())).against;
    assert!(armed.iter().eq([Refusal::AlreadyArmed]));
}
