//! Compares every row of the control crate's golden data in `f32`. Each tolerance is a bound on the rounding error of
//! its row, so it is also tight for small numbers.

use afbc::adaptive::{Gains, Subsystem, SubsystemConditions};
use afbc::backstepping::{self, ideal, proportional};
use afbc::desired::desired_attitude;
use afbc::fuzzy::{FuzzyBasis, Membership};
use afbc::law::SubsystemTracking;
use afbc::model::Dynamics;
use afbc::{AdaptiveEstimate, Safeguards};
use afbc_control::mixer::Mixer;
use afbc_types::{Inputs, Parameters, RotorSpeeds};
use flight_tests::{ROWS, Row, golden};
use nalgebra::{Matrix3, Vector4};

/// Relative rounding error of one `f32` operation.
const U: f64 = 1.0 / (1 << 24) as f64;

fn assert_within(row: &Row<'_>, column: &str, got: f32, allowed: f64) {
    let expected = row.get(column);
    let error = (f64::from(got) - expected).abs();
    assert!(
        error <= allowed,
        "{}: {column} = {got:e}, expected {expected:e}, off by {error:e}, allowed {allowed:e}",
        row.place()
    );
}

/// Returns a bound on the relative error of a fuzzy weight. ln w_i changes by at most twice the change of the exponents
/// k|x| and ln q. k|x| has 6 roundings besides that of x (c, s, two divisions by s, s again, the product), and the
/// error of x itself. ln q = c^2 / 2s^2 has 5 roundings. Another 20 cover the exponentials (2 each) and the products
/// and sums around them.
fn weight_bound(centre: f64, width: f64, inputs: [f64; 2], input_errors: [f64; 2]) -> f64 {
    let k = centre / (width * width);
    let exponents: f64 = inputs.iter().zip(input_errors).map(|(x, error)| k * (6.0 * U * x.abs() + error)).sum();
    2.0 * (exponents + 2.0 * 5.0 * U * 0.5 * (centre / width).powi(2)) + 20.0 * U
}

/// Below the normal numbers of `f32`, a weight's error is absolute: 2^-150, divided by a sum of at least q.
const WEIGHT_FLOOR: f64 = 1e-36;

#[test]
fn fuzzy_basis_agrees_in_every_row() {
    let table = golden("fuzzy_basis");
    assert_eq!(table.rows().len(), ROWS);
    for row in table.rows() {
        let [centre, width, first, second] = row.all(["centre", "width", "input1", "input2"]);
        let basis = FuzzyBasis::new(Membership { centre: centre as f32, width: width as f32 }).unwrap();
        let w = basis.weights([first as f32, second as f32]);
        let bound = weight_bound(centre, width, [first, second], [U * first.abs(), U * second.abs()]);
        // The order is row-major: the first input is the outermost.
        for (rule, (got, expected)) in w.transpose().iter().zip(row.nine("w")).enumerate() {
            assert_within(&row, &format!("w{}", rule + 1), *got, expected * bound + WEIGHT_FLOOR);
        }
    }
}

#[test]
fn afbc_subsystem_agrees_in_every_row() {
    let table = golden("afbc_subsystem");
    assert_eq!(table.rows().len(), ROWS);
    let mut kinds = [0; 2];
    for row in table.rows() {
        let [centre, width] = row.all(["centre", "width"]);
        let [alpha1, alpha2, gamma, eta, epsilon] = row.all(["alpha1", "alpha2", "gamma", "eta", "epsilon"]);
        let [x1, x2, x1d, x1d_dot, delta] = row.all(["x1", "x2", "x1d", "x1d_dot", "delta_hat"]);
        let theta = row.nine("theta");
        let gains = Gains {
            backstepping: backstepping::Gains {
                alpha1: alpha1 as f32,
                alpha2: alpha2 as f32,
                ..backstepping::Gains::DEFAULT
            },
            gamma: gamma as f32,
            eta: eta as f32,
            epsilon: epsilon as f32,
            membership: Membership { centre: centre as f32, width: width as f32 },
            safeguards: Safeguards::NONE,
        };
        let x1d_dot_32 = x1d_dot as f32;
        let [x1_32, x2_32] = [x1 as f32, x2 as f32];
        let e1_32 = x1d as f32 - x1_32;
        let tracking =
            SubsystemTracking { x1: x1_32, x2: x2_32, e1: e1_32, x1d_dot: x1d_dot_32, ..SubsystemTracking::default() };
        let errors = tracking.errors(gains.backstepping.alpha1);
        let inputs_are_state = row.get("inputs_are_state") == 1.0;
        kinds[usize::from(inputs_are_state)] += 1;
        let inputs = if inputs_are_state { [tracking.x1, tracking.x2] } else { [errors.e1, errors.e1_dot] };
        let estimate =
            AdaptiveEstimate { theta: Matrix3::from_row_slice(&theta.map(|t| t as f32)), delta: delta as f32 };
        let (terms, rate) =
            Subsystem::new(gains).unwrap().law(&errors, inputs, &estimate, &SubsystemConditions::default());

        // Each input is rounded once, each difference and product once more.
        let [e1, e2] = row.all(["e1", "e2"]);
        let e1_error = U * (x1.abs() + x1d.abs() + e1.abs());
        let e1_dot_error = U * (x1d_dot.abs() + x2.abs() + (x1d_dot - x2).abs());
        let e2_error = e1_dot_error + alpha1 * (e1_error + 2.0 * U * e1.abs()) + U * e2.abs();
        assert_within(&row, "e1", errors.e1, e1_error);
        assert_within(&row, "e2", errors.e2, e2_error);

        let (exact_inputs, input_errors) = if inputs_are_state {
            ([x1, x2], [U * x1.abs(), U * x2.abs()])
        } else {
            ([e1, x1d_dot - x2], [e1_error, e1_dot_error])
        };
        let w_bound = weight_bound(centre, width, exact_inputs, input_errors);

        // (22) is a sum of nine products. w is within its bound; theta, product and eight sums are rounded. The weights
        // follow from the golden rates: w_i = theta_dot_i / (gamma e_2).
        let theta_dot = row.nine("theta_dot");
        let products: f64 = theta_dot.iter().zip(theta).map(|(rate, theta)| (rate / (gamma * e2) * theta).abs()).sum();
        let fuzzy_error = products * (w_bound + 10.0 * U) + 9.0 * WEIGHT_FLOOR;
        assert_within(&row, "u_a", terms.fuzzy, fuzzy_error);
        // (32): d tanh(s) <= ds. s = e_2 / epsilon has the error of e_2 and three roundings, and s tanh'(s) <= 0.448.
        // tanh is accurate to 1.4e-7. delta and the product are rounded.
        let tanh_error = e2_error / epsilon + 0.448 * 3.0 * U + 1.4e-7;
        let robust_error = delta.abs() * (tanh_error + 2.0 * U);
        assert_within(&row, "u_r", terms.robust, robust_error);
        // (21)
        let proportional_error = alpha2 * (e2_error + 2.0 * U * e2.abs());
        assert_within(&row, "u_pd", terms.proportional, proportional_error);
        // (20) has two sums.
        let size: f64 = row.all(["u_a", "u_r", "u_pd"]).iter().map(|term| term.abs()).sum();
        assert_within(&row, "u", terms.sum(), fuzzy_error + robust_error + proportional_error + 2.0 * U * size);
        // (33) has the rounding of eta and two products.
        assert_within(&row, "delta_hat_dot", rate.delta(), eta * (e2_error + e2.abs() * (tanh_error + 3.0 * U)));
        // (34) has the rounding of gamma and two products.
        for (rule, (got, expected)) in rate.theta().transpose().iter().zip(theta_dot).enumerate() {
            let weight = expected / (gamma * e2);
            let allowed = gamma * (e2_error * weight + e2.abs() * (weight * (w_bound + 3.0 * U) + WEIGHT_FLOOR));
            assert_within(&row, &format!("theta_dot{}", rule + 1), *got, allowed);
        }
    }
    assert!(kinds[0] > 20 && kinds[1] > 20, "both kinds of inputs must be in the data: {kinds:?}");
}

#[test]
fn backstepping_agrees_in_every_row() {
    let table = golden("backstepping");
    assert_eq!(table.rows().len(), ROWS);
    for row in table.rows() {
        let [alpha1, alpha2] = row.all(["alpha1", "alpha2"]);
        let [x1, x2, x1d, x1d_dot, x1d_ddot, f, g] = row.all(["x1", "x2", "x1d", "x1d_dot", "x1d_ddot", "f", "g"]);
        let tracking = SubsystemTracking {
            x1: x1 as f32,
            x2: x2 as f32,
            e1: x1d as f32 - x1 as f32,
            x1d_dot: x1d_dot as f32,
            x1d_ddot: x1d_ddot as f32,
            approach_1_s: None,
        };
        let errors = tracking.errors(alpha1 as f32);
        let dynamics = Dynamics { f: f as f32, g: g as f32, g_dot: 0.0 };
        let gains = backstepping::Gains { alpha1: alpha1 as f32, ..backstepping::Gains::DEFAULT };
        let u_eq = ideal(&gains, &errors, tracking.x1d_ddot, &dynamics);
        let u = u_eq + proportional(alpha2 as f32, &errors);

        let [e1, e2] = row.all(["e1", "e2"]);
        let e1_error = U * (x1.abs() + x1d.abs() + e1.abs());
        let e1_dot_error = U * (x1d_dot.abs() + x2.abs() + (x1d_dot - x2).abs());
        let e2_error = e1_dot_error + alpha1 * (e1_error + 2.0 * U * e1.abs()) + U * e2.abs();
        assert_within(&row, "e1", errors.e1, e1_error);
        assert_within(&row, "e2", errors.e2, e2_error);
        // (16): the errors of e1 and e2 count with their factors, and each term is rounded at most 9 times.
        let carried = e1_error * (1.0 + alpha1 * alpha1) + e2_error * alpha1;
        let size = e1.abs() + alpha1 * e2.abs() + alpha1 * alpha1 * e1.abs() + x1d_ddot.abs() + f.abs();
        let u_eq_error = (carried + 9.0 * U * size) / g;
        assert_within(&row, "u_eq", u_eq, u_eq_error);
        let [u_eq, u_exact] = row.all(["u_eq", "u"]);
        let proportional_error = alpha2 * (e2_error + 2.0 * U * e2.abs());
        assert_within(&row, "u", u, u_eq_error + proportional_error + U * (u_eq.abs() + u_exact.abs()));
    }
}

#[test]
fn desired_attitude_agrees_in_every_row() {
    /// Largest error of the control crate's sine and cosine, checked by `crates/control/tests/math.rs`.
    const TRIGONOMETRY: f64 = 1.7e-4;
    let gravity = Parameters::PAPER.gravity_m_s2;
    let table = golden("desired_attitude");
    assert_eq!(table.rows().len(), ROWS);
    for row in table.rows() {
        let [u5, u6, psi] = row.all(["u5_m_s2", "u6_m_s2", "psi_rad"]);
        let [phi_d, theta_d] = desired_attitude(u5 as f32, u6 as f32, psi as f32, (1.0 / gravity) as f32);
        // Sine and cosine have errors of at most 1.7e-4 each, and the sums a few roundings (8 U). The numerators of
        // both tangents change by at most that share of |u5| + |u6|. The arc tangent has a slope of at most 1 and an
        // error of its own of 1.2e-7.
        let moved = (TRIGONOMETRY + 8.0 * U) * (u5.abs() + u6.abs()) / gravity;
        assert_within(&row, "theta_d_rad", theta_d, moved + 1.2e-7);
        // phi_d also contains cos(theta_d) = (1 + t^2)^-1/2, whose slope in t is at most 0.385.
        let numerator = (u5 * psi.sin() - u6 * psi.cos()).abs() / gravity;
        assert_within(&row, "phi_d_rad", phi_d, moved + (numerator + moved) * 0.385 * moved + 1.2e-7);
    }
}

/// Compares the golden rows without errors of sine and cosine: at a yaw of 0, where they are accurate enough, (40)
/// holds to rounding. The desired acceleration is rotated by the golden yaw beforehand, in `f64`.
#[test]
fn desired_attitude_without_yaw_agrees_to_rounding() {
    let gravity = Parameters::PAPER.gravity_m_s2;
    let [_, level_theta] = desired_attitude(gravity as f32, 0.0, 0.0, (1.0 / gravity) as f32);
    assert!((level_theta - core::f32::consts::FRAC_PI_4).abs() < 1e-6, "the cosine of 0 is not 1: {level_theta}");
    let table = golden("desired_attitude");
    assert_eq!(table.rows().len(), ROWS);
    for row in table.rows() {
        let [u5, u6, psi] = row.all(["u5_m_s2", "u6_m_s2", "psi_rad"]);
        let (forward, right) = (u5 * psi.cos() + u6 * psi.sin(), u5 * psi.sin() - u6 * psi.cos());
        let [phi_d, theta_d] = desired_attitude(forward as f32, -right as f32, 0.0, (1.0 / gravity) as f32);
        // If the sine of 0 is not exactly 0, both tangents change by that share of the other component.
        let sine_of_0 = f64::from(afbc_control::math::sin(0.0)).abs();
        let moved = (sine_of_0 + 8.0 * U) * (forward.abs() + right.abs()) / gravity;
        assert_within(&row, "theta_d_rad", theta_d, moved + 1.2e-7);
        assert_within(&row, "phi_d_rad", phi_d, moved * (1.0 + 0.385 * (right.abs() / gravity + moved)) + 1.2e-7);
    }
}

const SPEEDS: [&str; 4] = ["omega1_rad_s", "omega2_rad_s", "omega3_rad_s", "omega4_rad_s"];
const FORCES: [&str; 4] = ["f1_n", "f2_n", "f3_n", "f4_n"];
const INPUTS: [&str; 4] = ["u1_n", "u2_n", "u3_n", "u4_n"];

/// Returns a mixer for rotors of 20 N, with which no row saturates.
fn mixer() -> Mixer {
    Mixer::new(Parameters::PAPER.to_f32(), 20.0).unwrap()
}

#[test]
fn mixer_agrees_from_speeds_to_inputs_in_every_row() {
    let table = golden("mixer");
    assert_eq!(table.rows().len(), ROWS);
    for row in table.rows() {
        let speeds = RotorSpeeds(Vector4::from(row.all(SPEEDS).map(|w| w as f32)));
        let forces = mixer().forces(&speeds);
        // b, omega (twice) and two products round.
        for ((got, column), expected) in forces.0.iter().zip(FORCES).zip(row.all(FORCES)) {
            assert_within(&row, column, *got, 5.0 * U * expected);
        }
        let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = mixer().inputs(&forces);
        // Sums of at most four forces have 3 more roundings, each relative to at most their total.
        for (got, column) in [roll_n, pitch_n, yaw_n, thrust_n].into_iter().zip(INPUTS) {
            assert_within(&row, column, got, 8.0 * U * row.get("u4_n"));
        }
    }
}

#[test]
fn mixer_agrees_from_inputs_to_speeds_in_every_row() {
    let table = golden("mixer");
    assert_eq!(table.rows().len(), ROWS);
    for row in table.rows() {
        let [roll_n, pitch_n, yaw_n, thrust_n] = row.all(INPUTS).map(|u| u as f32);
        let allocation = mixer().allocate(&Inputs { roll_n, pitch_n, yaw_n, thrust_n });
        assert!(!allocation.saturated, "{}", row.place());
        // Each input is rounded once, and each of two sums once more. The inputs add up to at most 2 U4.
        let allowed = 4.0 * U * row.get("u4_n");
        for (got, column) in allocation.forces.0.iter().zip(FORCES) {
            assert_within(&row, column, *got, allowed);
        }
        let speeds = mixer().speeds(&allocation.forces);
        for ((got, column), force) in speeds.0.iter().zip(SPEEDS).zip(row.all(FORCES)) {
            // The square root halves the relative error of the force. There are three more roundings.
            let omega = row.get(column);
            assert_within(&row, column, *got, omega * (3.0 * U + 0.5 * allowed / (force - allowed)));
        }
    }
}

/// The virtual controls are accelerations. The attitude that (40) demands gives these accelerations in the plant of (6)
/// at hover thrust (39), which shows that the signs and frames of all golden files agree.
#[test]
fn desired_attitude_gives_the_wanted_acceleration_in_the_plant() {
    use afbc_plant::{Load, Motion, simplified};
    use nalgebra::Vector3;
    let p = Parameters::PAPER;
    for row in golden("desired_attitude").rows() {
        let [u5, u6, psi, phi, theta] = row.all(["u5_m_s2", "u6_m_s2", "psi_rad", "phi_d_rad", "theta_d_rad"]);
        let thrust = p.mass_kg * p.gravity_m_s2 / (phi.cos() * theta.cos()); // (39)
        let speed = (thrust / (4.0 * p.thrust_factor_n_s2)).sqrt();
        let load = Load::new(&p, [speed; 4], Vector3::zeros(), Vector3::zeros());
        let motion = Motion { attitude_rad: Vector3::new(phi, theta, psi), ..Motion::default() };
        let x_dot = simplified::derivative(&simplified::vector(&motion), &load);
        for (got, wanted) in [(x_dot[3], u5), (x_dot[4], u6), (x_dot[5], 0.0)] {
            assert!(
                (got - wanted).abs() <= 1e-12 * (10.0 + u5.abs() + u6.abs()),
                "{}: {got}, wanted {wanted}",
                row.place()
            );
        }
    }
}
