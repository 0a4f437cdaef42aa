//! Compares every row of the plant's golden data in `f64`, within a relative error of 1e-9.

use afbc_plant::{Load, Motion, rigid_body, simplified};
use afbc_types::Parameters;
use flight_tests::{ROWS, Row, golden};
use nalgebra::Vector3;

/// The tolerance is relative to the expected number, without an allowance for cancellation. No result in the data is
/// small compared with its own terms (in fact all agree to 1e-12).
fn assert_close(row: &Row<'_>, column: &str, got: f64) {
    let expected = row.get(column);
    assert!(
        (got - expected).abs() <= 1e-9 * expected.abs(),
        "{}: {column} = {got:e}, expected {expected:e}",
        row.place()
    );
}

fn assert_vector(row: &Row<'_>, columns: [&str; 3], got: [f64; 3]) {
    for (column, got) in columns.into_iter().zip(got) {
        assert_close(row, column, got);
    }
}

/// Returns the rotor speeds and disturbances of a row.
fn load(row: &Row<'_>) -> Load {
    let speeds = row.all(["omega1_rad_s", "omega2_rad_s", "omega3_rad_s", "omega4_rad_s"]);
    let a_force = Vector3::from(row.all(["a_x", "a_y", "a_z"]));
    let a_moment = Vector3::from(row.all(["a_phi", "a_theta", "a_psi"]));
    Load::new(&Parameters::PAPER, speeds, a_force, a_moment)
}

/// Returns a motion with an arbitrary position and velocity, which must not matter.
fn motion(attitude_rad: [f64; 3], rates_rad_s: [f64; 3]) -> Motion {
    Motion {
        position_m: Vector3::new(3.0, -4.0, 5.0),
        velocity_m_s: Vector3::new(-0.6, 0.7, 0.8),
        attitude_rad: Vector3::from(attitude_rad),
        rates_rad_s: Vector3::from(rates_rad_s),
    }
}

#[test]
fn simplified_model_agrees_in_every_row() {
    let table = golden("plant_simplified");
    assert_eq!(table.rows().len(), ROWS);
    for row in table.rows() {
        let motion = motion(row.all(["phi", "theta", "psi"]), row.all(["phi_dot", "theta_dot", "psi_dot"]));
        let x_dot = simplified::derivative(&simplified::vector(&motion), &load(&row));
        let three = |at| x_dot.fixed_rows::<3>(at).into_owned();
        assert_vector(&row, ["x_ddot", "y_ddot", "z_ddot"], three(3).into());
        assert_vector(&row, ["phi_ddot", "theta_ddot", "psi_ddot"], three(9).into());
        assert_eq!((three(0), three(6)), (motion.velocity_m_s, motion.rates_rad_s), "{}", row.place());
    }
}

#[test]
fn rigid_body_agrees_in_every_row() {
    let table = golden("plant_rigid_body");
    assert_eq!(table.rows().len(), ROWS);
    for row in table.rows() {
        let motion = motion(row.all(["phi", "theta", "psi"]), row.all(["p", "q", "r"]));
        let v_dot = rigid_body::derivative(&rigid_body::vector(&motion), &load(&row));
        let three = |at| v_dot.fixed_rows::<3>(at).into_owned();
        assert_vector(&row, ["x_ddot", "y_ddot", "z_ddot"], three(3).into());
        assert_vector(&row, ["p_dot", "q_dot", "r_dot"], three(10).into());
        assert_eq!(three(0), motion.velocity_m_s, "{}", row.place());
        let eta_dot = rigid_body::euler_rates(&motion.attitude_rad, &motion.rates_rad_s);
        assert_vector(&row, ["phi_dot", "theta_dot", "psi_dot"], eta_dot.into());
    }
}

/// The rigid body does not integrate Euler angles. Its quaternion must turn at the golden Euler rates.
#[test]
fn the_quaternion_turns_at_the_golden_euler_rates() {
    let table = golden("plant_rigid_body");
    assert_eq!(table.rows().len(), ROWS);
    for row in table.rows() {
        let motion = motion(row.all(["phi", "theta", "psi"]), row.all(["p", "q", "r"]));
        let v = rigid_body::vector(&motion);
        let v_dot = rigid_body::derivative(&v, &load(&row));
        let h = 1e-6;
        let attitude = |t: f64| rigid_body::motion(&(v + v_dot * t)).attitude_rad;
        let difference =
            (attitude(h) - attitude(-h)).map(|a| a - core::f64::consts::TAU * (a / core::f64::consts::TAU).round());
        for (rate, column) in (difference / (2.0 * h)).iter().zip(["phi_dot", "theta_dot", "psi_dot"]) {
            let expected = row.get(column);
            // A central difference over 1e-6 s of rates up to 15 rad/s has a rounding error of 4e-16/1e-6 and a
            // truncation error of (15 h)^2 times the rate.
            assert!((rate - expected).abs() <= 1e-8, "{}: {column} = {rate}, expected {expected}", row.place());
        }
    }
}
