//! Closed-loop flights of the rigid body with a rotor lag of 20 ms: convergence and accuracy of each controller.
//!
//! The bounds are about a fifth above the measured values, so that a deterioration fails the test.

use crate::harness::{
    Figures, Random, Rig, SETTINGS, at, calm, circle, disturbed, fly, fly_on, hover, paper, paper_start, vehicle,
};
use afbc_control::FlightController;
use afbc_laws::{Dfbc, Geometric, Indi, L1, Mpc, Pid, dfbc, geometric, indi, l1, mpc, pid};
use afbc_plant::{Environment, Gust, GustKind, Motion, PlantParameter, PlantParameterChange};
use afbc_types::{Axis, Parameters, Setpoint};
use core::f64::consts::FRAC_PI_2;
use nalgebra::{Vector3, Vector4};

fn pid() -> Pid {
    Pid::new(vehicle(), SETTINGS, pid::Gains::PAPER_VEHICLE).unwrap()
}

fn lee() -> Geometric {
    Geometric::new(vehicle(), SETTINGS, geometric::Gains::LEE_2010).unwrap()
}

fn goodarzi() -> Geometric {
    Geometric::new(vehicle(), SETTINGS, geometric::Gains::GOODARZI_2013).unwrap()
}

fn indi() -> Indi {
    Indi::new(vehicle(), SETTINGS, indi::Gains::PAPER_VEHICLE).unwrap()
}

fn l1() -> L1 {
    L1::new(vehicle(), SETTINGS, l1::Gains::BY_HAND).unwrap()
}

fn dfbc() -> Dfbc {
    Dfbc::new(vehicle(), SETTINGS, dfbc::Gains::PAPER_VEHICLE).unwrap()
}

fn mpc() -> Mpc {
    Mpc::new(vehicle(), SETTINGS, mpc::Gains::PAPER_VEHICLE).unwrap()
}

/// Asserts that the root mean square errors of x, y, z \[m\] and psi \[rad\] are within `bounds`.
#[track_caller]
fn within(name: &str, figures: &Figures, bounds: [f64; 4]) {
    println!("{name}: {figures:.4?}");
    assert!(
        figures.rmse.zip_map(&Vector4::from(bounds), |rmse, bound| rmse <= bound).iter().all(|ok| *ok),
        "{name}: {figures:.4?}"
    );
}

/// Checks that the vehicle stays at rest.
fn hovers<C: FlightController>(name: &str, controller: &C) {
    let place = [1.0, -2.0, 3.0];
    let start = at(place.map(f64::from), 0.7);
    let figures = fly(controller, Rig::LAG, calm(), start, hover(place, 0.7), [0.0, 5.0]);
    within(name, &figures, [2e-5; 4]);
    let figures = fly(controller, Rig::ALL, calm(), start, hover(place, 0.7), [0.0, 5.0]);
    within(name, &figures, [3e-4; 4]);
}

#[test]
fn all_hover() {
    hovers("pid", &pid());
    hovers("lee", &lee());
    hovers("goodarzi", &goodarzi());
    hovers("indi", &indi());
    hovers("l1", &l1());
    hovers("dfbc", &dfbc());
    hovers("mpc", &mpc());
}

/// Checks arrival and rest after 6 s, for a small step and for one that reaches every limit.
fn steps<C: FlightController>(name: &str, controller: &C) {
    let start = at([0.0, 0.0, 2.0], 0.0);
    let figures = fly(controller, Rig::ALL, calm(), start, hover([2.0, 1.0, 3.0], 1.0), [6.0, 12.0]);
    within(name, &figures, [0.0015; 4]);
    let figures = fly(controller, Rig::ALL, calm(), start, hover([-20.0, 10.0, 15.0], -3.0), [25.0, 40.0]);
    within(name, &figures, [3e-4; 4]);
}

#[test]
fn all_follow_a_step() {
    steps("pid", &pid());
    steps("lee", &lee());
    steps("goodarzi", &goodarzi());
    steps("indi", &indi());
    steps("l1", &l1());
    steps("dfbc", &dfbc());
    steps("mpc", &mpc());
}

/// The vehicle flies a circle of 2 m radius in 6 s, with the nose along the velocity: 2.1 m/s and 2.2 m/s2.
#[test]
fn all_fly_a_circle() {
    let start = at([2.0, 0.0, 2.0], core::f64::consts::FRAC_PI_2);
    fn figures<C: FlightController>(controller: &C, start: Motion) -> Figures {
        fly(controller, Rig::LAG, calm(), start, circle(2.0, 6.0), [6.0, 20.0])
    }
    within("pid", &figures(&pid(), start), [0.003, 0.003, 0.001, 0.002]);
    within("lee", &figures(&lee(), start), [0.005, 0.005, 0.001, 0.005]);
    within("goodarzi", &figures(&goodarzi(), start), [0.004, 0.004, 0.001, 0.002]);
    within("indi", &figures(&indi(), start), [0.001, 0.001, 0.001, 0.001]);
    within("l1", &figures(&l1(), start), [0.0075, 0.0075, 0.001, 0.004]);
    within("dfbc", &figures(&dfbc(), start), [0.001, 0.001, 0.001, 0.001]);
    within("mpc", &figures(&mpc(), start), [0.001, 0.001, 0.001, 0.001]);
}

/// The laws fly the paper's flight with its gusts and all four sign combinations of its uncertainties, with lag, delay
/// and noise. Errors count from 5 s to 60 s.
#[test]
fn all_fly_the_papers_flight() {
    for (inertia, thrust) in [(1.75, 0.6), (1.75, 1.4), (0.25, 0.6), (0.25, 1.4)] {
        fn figures<C: FlightController>(controller: &C, environment: afbc_plant::Environment) -> Figures {
            let figures = fly(controller, Rig::ALL, environment, paper_start(), paper, [5.0, 60.0]);
            assert!(figures.delta_u4_n < 0.02, "{figures:?}");
            figures
        }
        let environment = || disturbed(inertia, thrust);
        within("pid", &figures(&pid(), environment()), [0.010, 0.013, 0.027, 0.006]);
        // Without integrals an offset remains: 1.2 m/s2 divided by k_x is 75 mm.
        within("lee", &figures(&lee(), environment()), [0.12, 0.10, 0.20, 0.03]);
        within("goodarzi", &figures(&goodarzi(), environment()), [0.011, 0.015, 0.035, 0.005]);
        within("indi", &figures(&indi(), environment()), [0.005, 0.008, 0.007, 0.002]);
        within("l1", &figures(&l1(), environment()), [0.0126, 0.0126, 0.0085, 0.0026]);
        within("dfbc", &figures(&dfbc(), environment()), [0.018, 0.025, 0.042, 0.0012]);
        within("mpc", &figures(&mpc(), environment()), [0.02, 0.025, 0.03, 0.003]);
    }
}

#[test]
fn integrals_remove_the_steady_state_error() {
    fn left<C: FlightController>(controller: &C) -> f64 {
        fly(controller, Rig::LAG, disturbed(1.75, 0.6), paper_start(), paper, [59.0, 60.0]).max_abs.amax()
    }
    assert!(left(&pid()) < 0.001);
    assert!(left(&goodarzi()) < 0.001);
    assert!(left(&indi()) < 0.002);
    assert!(left(&l1()) < 0.001);
    assert!(left(&dfbc()) < 0.001);
    assert!(left(&mpc()) < 0.002);
    assert!(left(&lee()) > 0.05);
    assert!(left(&Dfbc::new(vehicle(), SETTINGS, dfbc::Gains::SUN_2022).unwrap()) > 0.05);
}

/// The vehicle starts rolled and pitched over, rotating and falling.
#[test]
fn all_catch_a_vehicle_that_was_thrown() {
    fn figures<C: FlightController>(controller: &C) -> Figures {
        let mut start = at([0.0, 0.0, 20.0], 0.5);
        start.attitude_rad += Vector3::new(1.9, -0.6, 0.0);
        start.rates_rad_s = Vector3::new(3.0, -2.0, 1.0);
        start.velocity_m_s = Vector3::new(2.0, 1.0, -1.0);
        fly(controller, Rig::ALL, calm(), start, hover([0.0, 0.0, 20.0], 0.5), [10.0, 15.0])
    }
    within("pid", &figures(&pid()), [3e-4; 4]);
    within("lee", &figures(&lee()), [3e-4; 4]);
    within("goodarzi", &figures(&goodarzi()), [3e-4; 4]);
    within("indi", &figures(&indi()), [3e-4; 4]);
    within("l1", &figures(&l1()), [3e-4; 4]);
    within("dfbc", &figures(&dfbc()), [3e-4; 4]);
    within("mpc", &figures(&mpc()), [3e-4; 4]);
}

/// For rotors of any strength, upright or leaning against a push, PID's hover thrust estimate takes over the integral's
/// part without moving the vehicle.
#[test]
fn the_hover_thrust_takes_over_from_the_integral() {
    let place = [0.0, 0.0, 3.0];
    let mut random = Random(11);
    for _ in 0..20 {
        let (strength, mass) = (0.65 + 0.75 * random.uniform(), 0.8 + 0.4 * random.uniform());
        let push = 5.0 * (random.uniform() - 0.5);
        let environment = || {
            let changes =
                [(PlantParameter::ThrustFactor, strength), (PlantParameter::Mass, mass)].map(|(quantity, factor)| {
                    PlantParameterChange { quantity, factor, start_s: 2.0, end_s: f64::INFINITY }
                });
            let gust =
                Gust { axis: Axis::X, kind: GustKind::Acceleration, size: push, start_s: 0.0, end_s: f64::INFINITY };
            Environment::new(Parameters::PAPER, changes.to_vec(), vec![gust]).unwrap()
        };
        let flown = |hover_thrust_1_s| {
            let gains = pid::Gains { hover_thrust_1_s, ..pid::Gains::PAPER_VEHICLE };
            let controller = Pid::new(vehicle(), SETTINGS, gains).unwrap();
            let start = at(place.map(f64::from), 0.0);
            let (figures, memory) = fly_on(&controller, Rig::LAG, environment(), start, hover(place, 0.0), [6.0, 20.0]);
            (figures.max_abs.z, memory.control.velocity_integral.z)
        };
        let ((moved, held), (moved_without, held_without)) = (flown(1.0), flown(0.0));
        let needed = 9.81 * (mass / strength - 1.0);
        assert!((f64::from(held_without) - needed).abs() < 0.01, "{held_without} for {needed}");
        assert!(f64::from(held).abs() < 0.01 * (1.0 + needed.abs()), "{held} is left of {needed}");
        assert!(moved < moved_without + 0.003, "{moved} m, without the estimate {moved_without} m");
    }
}

/// Returns a horizontal figure of eight of 2 m that also rises and falls.
fn eight(period_s: f64) -> impl Fn(f64) -> Setpoint {
    move |t| {
        let w = core::f64::consts::TAU / period_s;
        // Value and derivatives of sin(n w t), for n = 1, 2.
        let sine = |order: usize, n: f64| (n * w).powi(order as i32) * libm::sin(n * w * t + order as f64 * FRAC_PI_2);
        let at = |order| Vector3::new(2.0 * sine(order, 1.0), sine(order, 2.0), 0.3 * sine(order, 1.0)).cast::<f32>();
        Setpoint {
            position_m: at(0) + Vector3::new(0.0, 0.0, 3.0),
            velocity_m_s: at(1),
            acceleration_m_s2: at(2),
            jerk_m_s3: at(3),
            snap_m_s4: at(4),
            ..Setpoint::default()
        }
    }
}

/// Returns the motion on the reference.
fn upon(reference: &Setpoint) -> Motion {
    let mut start = at(reference.position_m.cast().into(), f64::from(reference.yaw_rad));
    start.velocity_m_s = reference.velocity_m_s.cast();
    start
}

/// Returns the largest distance from the figure of eight after two rounds \[m\].
fn off_the_eight<C: FlightController>(controller: &C, rig: Rig, period_s: f64, adjust: impl Fn(&mut Setpoint)) -> f64 {
    let path = eight(period_s);
    let reference = |t| {
        let mut setpoint = path(t);
        adjust(&mut setpoint);
        setpoint
    };
    let times = [period_s, 3.0 * period_s];
    fly(controller, rig, calm(), upon(&path(0.0)), reference, times).max_abs.xyz().norm()
}

/// With ideal rotors only the time step of a millisecond keeps INDI off a flat trajectory. Without jerk and snap the
/// error is many times larger.
#[test]
fn jerk_and_snap_keep_indi_on_its_path() {
    let gains = indi::Gains { rotor_time_constant_s: 0.0, ..indi::Gains::PAPER_VEHICLE };
    let indi = Indi::new(vehicle(), SETTINGS, gains).unwrap();
    let ideal = Rig { lag_s: 0.0, delay: 0, noise: 0.0 };
    for period_s in [8.0, 6.0, 5.0] {
        let with = off_the_eight(&indi, ideal, period_s, |_| ());
        let without = off_the_eight(&indi, ideal, period_s, |s| {
            (s.jerk_m_s3, s.snap_m_s4) = (Vector3::zeros(), Vector3::zeros())
        });
        assert!(with < 5e-4 && with < 0.02 * without, "{with} m, without jerk and snap {without} m in {period_s} s");
    }
}

/// Without jerk and snap, DFBC is far off the trajectory, too.
#[test]
fn jerk_and_snap_keep_dfbc_on_its_path() {
    let gains = dfbc::Gains { rotor_time_constant_s: 0.0, ..dfbc::Gains::PAPER_VEHICLE };
    let dfbc = Dfbc::new(vehicle(), SETTINGS, gains).unwrap();
    let ideal = Rig { lag_s: 0.0, delay: 0, noise: 0.0 };
    for period_s in [8.0, 6.0, 5.0] {
        let with = off_the_eight(&dfbc, ideal, period_s, |_| ());
        let without = off_the_eight(&dfbc, ideal, period_s, |s| {
            (s.jerk_m_s3, s.snap_m_s4) = (Vector3::zeros(), Vector3::zeros())
        });
        assert!(with < 0.002 && with < 0.05 * without, "{with} m, without jerk and snap {without} m in {period_s} s");
    }
}

/// INDI tolerates an inexact rotor lag.
#[test]
fn indi_flies_rotors_of_half_to_twice_the_lag_it_knows() {
    for lag_s in [0.01, 0.015, 0.02, 0.03, 0.04] {
        let off = off_the_eight(&indi(), Rig { lag_s, ..Rig::ALL }, 6.0, |_| ());
        assert!(off < 0.003, "{off} m with a lag of {lag_s} s");
    }
}

/// Draws a vehicle with random factors on mass, inertia and thrust factor, pushed by a constant force and moment.
struct Stranger {
    factors: [(PlantParameter, f64); 3],
    /// Push along each axis: linear \[m/s2\], then angular \[rad/s2\].
    push: [f64; 6],
}

impl Stranger {
    fn new(random: &mut Random) -> Self {
        let mut within = |low: f64, high: f64| low + (high - low) * random.uniform();
        let factors = [
            (PlantParameter::Mass, within(0.8, 1.25)),
            (PlantParameter::Inertia, within(0.7, 1.4)),
            (PlantParameter::ThrustFactor, within(0.8, 1.2)),
        ];
        let push = [1.0, 1.0, 1.0, 2.0, 2.0, 0.5].map(|size| within(-size, size));
        Stranger { factors, push }
    }

    fn environment(&self) -> Environment {
        let always = |(quantity, factor)| PlantParameterChange { quantity, factor, start_s: 0.0, end_s: f64::INFINITY };
        let axes = [Axis::X, Axis::Y, Axis::Z, Axis::Roll, Axis::Pitch, Axis::Yaw];
        let gust = |(axis, size)| Gust { axis, kind: GustKind::Acceleration, size, start_s: 1.0, end_s: f64::INFINITY };
        let gusts = axes.into_iter().zip(self.push).map(gust).collect();
        Environment::new(Parameters::PAPER, self.factors.map(always).to_vec(), gusts).unwrap()
    }
}

/// Every law with an integral or an increment brings every such vehicle to rest at its setpoint.
#[test]
fn strangers_come_to_rest_where_they_should() {
    fn lands<C: FlightController>(name: &str, controller: &C, stranger: &Stranger) -> C::Memory {
        let start = at([0.5, -0.3, 2.5], 0.3);
        let (figures, memory) =
            fly_on(controller, Rig::LAG, stranger.environment(), start, hover([0.0, 0.0, 3.0], 0.0), [18.0, 20.0]);
        let off = figures.max_abs;
        assert!(off.amax() < 0.01, "{name}: {off:?} of {:?}, {:?}", stranger.factors, stranger.push);
        memory.control
    }
    let mut random = Random(13);
    for _ in 0..20 {
        let stranger = Stranger::new(&mut random);
        lands("pid", &pid(), &stranger);
        lands("goodarzi", &goodarzi(), &stranger);
        lands("indi", &indi(), &stranger);
        lands("dfbc", &dfbc(), &stranger);
        lands("mpc", &mpc(), &stranger);

        // L1 estimates the force that its model lacks. At rest, this is the weight minus the modelled thrust.
        let estimate = lands("l1", &l1(), &stranger);
        let [(_, mass), (_, inertia), (_, thrust)] = stranger.factors;
        let pushed = -Vector3::new(stranger.push[0], stranger.push[1], stranger.push[2]);
        // The true thrust over mass balances gravity and push. The law's model expects this thrust to accelerate the
        // vehicle by mass / thrust times as much, where both are factors on the nominal values.
        let gravity = Vector3::new(0.0, 0.0, 9.81);
        let lacking = gravity - (gravity - pushed) * (mass / thrust);
        let error = (estimate.force_m_s2.cast::<f64>() - lacking).norm();
        assert!(error < 0.01 * 9.81, "{:?} for {lacking:?}", estimate.force_m_s2);
        // The moments that the rotors give balance the push. The law's model expects inertia / thrust times as much of
        // them. For yaw, whose moment comes from the rotors' drag, the model expects inertia times as much.
        let pushed = -Vector3::new(stranger.push[3], stranger.push[4], stranger.push[5]);
        let lacking = pushed.component_mul(&Vector3::new(1.0 / thrust, 1.0 / thrust, 1.0)) * inertia;
        let error = (estimate.moment_rad_s2.cast::<f64>() - lacking).norm();
        assert!(error < 0.02 * (1.0 + lacking.norm()), "{:?} for {lacking:?}", estimate.moment_rad_s2);
    }
}

/// L1 as in its source has no integral. It cancels the push that the rotors can cancel, and the rest of the push
/// remains.
#[test]
fn l1_rejects_what_is_matched() {
    let left = |push: [f64; 6], adapting: bool| {
        let stranger = Stranger {
            factors: [(PlantParameter::Mass, 1.0), (PlantParameter::Inertia, 1.0), (PlantParameter::ThrustFactor, 1.0)],
            push,
        };
        let start = at([0.0, 0.0, 3.0], 0.0);
        let (environment, path, times) = (stranger.environment(), hover([0.0, 0.0, 3.0], 0.0), [14.0, 15.0]);
        let gains = l1::Gains::WU_2022;
        let figures = if adapting {
            let l1 = L1::new(vehicle(), SETTINGS, gains).unwrap();
            fly(&l1, Rig::LAG, environment, start, path, times)
        } else {
            let base = Geometric::new(vehicle(), SETTINGS, gains.geometric).unwrap();
            fly(&base, Rig::LAG, environment, start, path, times)
        };
        figures.max_abs.xyz().norm() + figures.max_abs.w
    };
    for axis in [2, 3, 4, 5] {
        let mut push = [0.0; 6];
        push[axis] = 1.0;
        let (with, without) = (left(push, true), left(push, false));
        assert!(with < 0.02 * without, "axis {axis}: {with} of {without}");
    }
    let (with, without) = (left([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], true), left([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], false));
    assert!(with > 0.5 * without, "{with} of {without}");
}
