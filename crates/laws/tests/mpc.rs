//! Compares MPC with the same problem solved in double precision by another method.

use crate::harness::{Random, SETTINGS, vehicle};
use afbc_control::{FlightController, Validated};
use afbc_laws::mpc::Gains;
use afbc_laws::{Mpc, mpc};
use afbc_types::{Setpoint, State};
use nalgebra::{Matrix3, Vector3};

/// Finely integrated model of one axis, and the weights of its cost.
struct Axis {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    weights: [f64; 2],
}

impl Axis {
    fn new(weights: [f32; 2], lag_s: f32, step_s: f32) -> Self {
        let (fine, tau) = (f64::from(step_s) / 20_000.0, f64::from(lag_s));
        let run = |mut x: Vector3<f64>, u: f64| {
            for _ in 0..20_000 {
                let rate = |x: &Vector3<f64>| Vector3::new(x.y, x.z, (u - x.z) / tau);
                let half = x + rate(&x) * (0.5 * fine);
                x += rate(&half) * fine;
            }
            x
        };
        let a = Matrix3::from_columns(&[0, 1, 2].map(|i| run(Vector3::ith(i, 1.0), 0.0)));
        Axis { a, b: run(Vector3::zeros(), 1.0), weights: weights.map(f64::from) }
    }

    /// Returns the gradient of the cost for the plan u from x, over a horizon longer than every motion.
    fn slope(&self, mut x: Vector3<f64>, plan: &[f64]) -> Vec<f64> {
        let [p, v] = self.weights;
        let mut path = Vec::new();
        for u in plan {
            path.push(x);
            x = self.a * x + self.b * *u;
        }
        let mut back = Vector3::zeros();
        let mut slope = vec![0.0; plan.len()];
        for (k, x) in path.iter().enumerate().rev() {
            slope[k] = 2.0 * plan[k] + self.b.dot(&back);
            back = self.a.tr_mul(&back) + Vector3::new(2.0 * p * x.x, 2.0 * v * x.y, 0.0);
        }
        slope
    }

    /// Returns the first step of the best plan, by conjugate gradients.
    fn best(&self, x: Vector3<f64>) -> f64 {
        const STEPS: usize = 200;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut plan = vec![0.0; STEPS];
        let mut rest: Vec<f64> = self.slope(x, &plan).iter().map(|slope| -slope).collect();
        let mut along = rest.clone();
        for _ in 0..2 * STEPS {
            let bent = self.slope(Vector3::zeros(), &along);
            let size = dot(&rest, &rest);
            if size < 1e-24 {
                break;
            }
            let step = size / dot(&along, &bent);
            plan.iter_mut().zip(&along).for_each(|(u, along)| *u += step * along);
            rest.iter_mut().zip(&bent).for_each(|(rest, bent)| *rest -= step * bent);
            let turn = dot(&rest, &rest) / size;
            along.iter_mut().zip(&rest).for_each(|(along, rest)| *along = rest + turn * *along);
        }
        plan[0]
    }
}

fn first(gains: Gains, state: &State, setpoint: &Setpoint) -> Vector3<f64> {
    let mpc = Mpc::new(vehicle(), SETTINGS, gains).unwrap();
    let mut memory = Validated::<mpc::Memory>::default();
    let _ = mpc.step(&mut memory, Some(state), setpoint);
    let trace = Mpc::<4>::trace(&memory.control);
    let [x, y] = trace.virtual_m_s2;
    Vector3::new(x.into(), y.into(), f64::from(trace.inputs.thrust_n) / 0.486 - 9.81)
}

/// Near the reference no bound is reached, and the first step equals the first step of the best plan.
#[test]
fn small_errors_are_answered_by_the_best_plan() {
    let mut random = Random(5);
    let gains = Gains::PAPER_VEHICLE;
    let xy = Axis::new([gains.position_weight_1_s4, gains.velocity_weight_1_s2], gains.tilt_lag_s, gains.plan_step_s);
    let z = Axis::new([gains.height_weight_1_s4, gains.climb_weight_1_s2], gains.lift_lag_s, gains.plan_step_s);
    for _ in 0..5 {
        let mut vector = |size: f64| Vector3::from_fn(|_, _| size * (2.0 * random.uniform() - 1.0));
        let (p, v) = (vector(0.1), vector(0.2));
        let state = State { position_m: p.cast(), velocity_m_s: v.cast(), ..State::default() };
        let given = first(gains, &state, &Setpoint::default());
        for (i, axis) in [&xy, &xy, &z].into_iter().enumerate() {
            let best = axis.best(Vector3::new(p[i], v[i], 0.0));
            assert!((given[i] - best).abs() < 0.02 * (0.1 + best.abs()), "{i}: {} {best}", given[i]);
        }
    }
}

/// Far from the setpoint the demand leads there, within the bounds.
#[test]
fn large_errors_are_answered_within_the_bounds() {
    let gains = Gains::PAPER_VEHICLE;
    let state = State { position_m: Vector3::new(-30.0, 20.0, -10.0), ..State::default() };
    let given = first(gains, &state, &Setpoint::default());
    assert!(given.x > 1.0 && given.y < -1.0 && given.z > 1.0, "{given}");
    let tilt = given.x.hypot(given.y).atan2(given.z + 9.81);
    assert!(tilt <= f64::from(gains.tilt_max_rad) + 1e-3, "{tilt}");
}
