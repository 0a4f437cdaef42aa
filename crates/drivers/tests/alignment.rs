//! Alignment matrices compared with rotations, and with ArduPilot's and Betaflight's descriptions of boards.

use afbc_drivers::InertialReading;
use afbc_drivers::alignment::{CW0, CW0_FLIP, CW90, CW90_FLIP, CW180, CW180_FLIP, CW270, CW270_FLIP, turned};
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::f32::consts::{FRAC_PI_2, PI};

const ALL: [(&str, Matrix3<f32>, f32, bool); 8] = [
    ("CW0", CW0, 0.0, false),
    ("CW90", CW90, 1.0, false),
    ("CW180", CW180, 2.0, false),
    ("CW270", CW270, 3.0, false),
    ("CW0_FLIP", CW0_FLIP, 0.0, true),
    ("CW90_FLIP", CW90_FLIP, 1.0, true),
    ("CW180_FLIP", CW180_FLIP, 2.0, true),
    ("CW270_FLIP", CW270_FLIP, 3.0, true),
];

#[test]
fn each_is_the_turn_that_its_name_says() {
    for (name, to_body, quarters, is_flipped) in ALL {
        // Clockwise as seen from above is a negative rotation about z.
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -quarters * FRAC_PI_2);
        let flip = Rotation3::from_axis_angle(&Vector3::y_axis(), if is_flipped { PI } else { 0.0 });
        assert!(((turn * flip).matrix() - to_body).amax() < 1e-6, "{name}: {to_body}");
    }
}

/// A part whose x axis points to the right senses gravity upwards on its z, a push forward on its y, and a roll to the
/// right as a rotation about its y.
#[test]
fn a_reading_is_turned_as_a_whole() {
    let reading = InertialReading {
        rates_rad_s: Vector3::new(0.0, 0.5, 0.0),
        specific_force_m_s2: Vector3::new(0.0, 2.0, 9.8),
        temperature_c: 20.0,
    };
    let [rates, force] = turned(&reading, &CW90);
    assert_eq!(rates, Vector3::new(0.5, 0.0, 0.0));
    assert_eq!(force, Vector3::new(2.0, 0.0, 9.8));
}

/// Applies an ArduPilot rotation to a vector with axes forward, right, down.
fn ardupilot(rotation: &str, [x, y, z]: [f32; 3]) -> [f32; 3] {
    match rotation {
        "NONE" => [x, y, z],
        "YAW_90" => [-y, x, z],
        "YAW_180" => [-x, -y, z],
        "YAW_270" => [y, -x, z],
        "ROLL_180" => [x, -y, -z],
        "ROLL_180_YAW_90" => ardupilot("YAW_90", ardupilot("ROLL_180", [x, y, z])),
        "PITCH_180" => [-x, y, -z],
        "PITCH_180_YAW_90" => ardupilot("YAW_90", ardupilot("PITCH_180", [x, y, z])),
        "PITCH_180_YAW_270" => ardupilot("YAW_270", ardupilot("PITCH_180", [x, y, z])),
        _ => [f32::NAN; 3],
    }
}

/// Betaflight and ArduPilot have their own axes, but their descriptions of a board must agree. ArduPilot's older driver
/// for InvenSense parts (MPU and ICM-20xxx) first swaps x and y and negates z.
#[test]
fn betaflight_and_ardupilot_agree_on_every_board_that_both_describe() {
    let boards = [
        ("SpeedyBee F405 V3", CW0, "ROLL_180", false),
        ("SpeedyBee F405 V4", CW90, "PITCH_180_YAW_270", false),
        ("SpeedyBee F405 Mini", CW270, "PITCH_180_YAW_90", false),
        ("Matek F405-STD", CW180, "YAW_90", true),
        ("Kakute F4", CW270, "YAW_180", true),
        // Only ArduPilot describes these.
        ("Pixracer", CW180_FLIP, "ROLL_180_YAW_90", true),
        ("Matek H743, first", CW0_FLIP, "YAW_180", false),
        ("Matek H743, second", CW90_FLIP, "YAW_270", false),
    ];
    for (board, to_body, rotation, is_older) in boards {
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let [x, y, z]: [f32; 3] = axis.into();
            let read = if is_older { [y, x, -z] } else { [x, y, z] };
            let [forward, right, down] = ardupilot(rotation, read);
            assert_eq!(to_body * axis, Vector3::new(forward, -right, -down), "{board}");
        }
    }
}
