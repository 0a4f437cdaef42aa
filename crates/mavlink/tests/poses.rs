//! Poses of a tracker: bytes from the specification, conversion compared with `f64` rotation matrices, covariances.

use afbc_mavlink::{Address, Counters, Decoder, Encoder, FRAME_MAX, Uplink};
use afbc_types::{Pose, PoseSigmas, State};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

const STATION: Address = Address { system: 255, component: 190 };
const VEHICLE: Address = Address { system: 1, component: 1 };

/// Id and checksum seed of VISION_POSITION_ESTIMATE, ATT_POS_MOCAP and ODOMETRY.
const VISION: (u32, u8) = (102, 158);
const MOCAP: (u32, u8) = (138, 109);
const ODOMETRY: (u32, u8) = (331, 91);

/// Returns the only message in a frame with this payload, or the counts.
fn read((id, seed): (u32, u8), payload: &[u8]) -> Result<Uplink, Counters> {
    let mut frame = vec![0xFD, payload.len() as u8, 0, 0, 0, 255, 190];
    frame.extend_from_slice(&id.to_le_bytes()[..3]);
    frame.extend_from_slice(payload);
    let crc = mavlink::calculate_crc(&frame[1..], seed);
    frame.extend_from_slice(&crc.to_le_bytes());
    receive(&frame)
}

fn receive(frame: &[u8]) -> Result<Uplink, Counters> {
    let mut decoder = Decoder::<Uplink>::new(VEHICLE);
    let mut messages = Vec::new();
    decoder.feed(frame, |from, message| messages.push((from, message)));
    match messages.as_slice() {
        [] => Err(*decoder.counters()),
        [(STATION, message)] => Ok(*message),
        more => panic!("{more:?}"),
    }
}

/// Returns a payload with the time 77 us, followed by the numbers.
fn payload(numbers: &[f32]) -> Vec<u8> {
    let numbers = numbers.iter().flat_map(|number| number.to_le_bytes());
    77_u64.to_le_bytes().into_iter().chain(numbers).collect()
}

fn pose(message: Result<Uplink, Counters>) -> Pose {
    match message {
        Ok(Uplink::Pose { sent_us: 77, pose }) => pose,
        other => panic!("{other:?}"),
    }
}

fn sigmas(message: Result<Uplink, Counters>) -> PoseSigmas {
    match message {
        Ok(Uplink::Pose { pose, .. }) => pose.sigmas,
        Ok(Uplink::State { sigmas, .. }) => sigmas,
        other => panic!("{other:?}"),
    }
}

/// Returns what the decoder makes of each message with a pose, level at the origin, with this covariance.
fn with_covariance(covariance: &[f32; 21]) -> [Result<Uplink, Counters>; 3] {
    let vision = payload(&[[0.0; 6].as_slice(), covariance].concat());
    let mocap = payload(&[&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], covariance.as_slice()].concat());
    let odometry = [&[0.0; 3], [1.0, 0.0, 0.0, 0.0].as_slice(), &[0.0; 6], covariance, &[0.0; 21]].concat();
    // Frames MAV_FRAME_LOCAL_NED and MAV_FRAME_BODY_FRD.
    let odometry = [payload(&odometry), vec![1, 12]].concat();
    [read(VISION, &vision), read(MOCAP, &mocap), read(ODOMETRY, &odometry)]
}

/// Returns the upper triangle, row by row, of a matrix with this diagonal and `other` everywhere else.
fn triangle(diagonal: [f32; 6], other: f32) -> [f32; 21] {
    let cells = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
    let mut places = cells.map(|(row, column)| if row == column { diagonal[row] } else { other });
    [(); 21].map(|()| places.next().expect("21 cells"))
}

#[test]
fn known_poses() {
    // Each case has roll, pitch and yaw as sent, their meaning, and the directions of nose and left wing in the
    // workspace's axes x, y, z.
    let quarter = core::f32::consts::FRAC_PI_2;
    let cases = [
        ([0.0; 3], "level, nose north", [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ([0.0, 0.0, quarter], "nose east: to the right", [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]),
        ([0.0, quarter, 0.0], "nose up", [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]),
        ([quarter, 0.0, 0.0], "right side down", [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        ([0.0, 0.0, 5.0 * quarter], "nose east after more than a turn", [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]),
    ];
    for ([roll, pitch, yaw], meaning, nose, left) in cases {
        let Pose { position_m, attitude, sigmas } = pose(read(VISION, &payload(&[1.0, 2.0, 3.0, roll, pitch, yaw])));
        assert_eq!((position_m, sigmas), (Vector3::new(1.0, -2.0, -3.0), PoseSigmas::UNKNOWN), "{meaning}");
        let rotation = rotation(attitude);
        assert!((rotation.column(0) - Vector3::from(nose)).amax() < 1e-6, "{meaning}");
        assert!((rotation.column(1) - Vector3::from(left)).amax() < 1e-6, "{meaning}");
    }
    // Nose east, as a quaternion.
    let half = core::f32::consts::FRAC_1_SQRT_2;
    let Pose { position_m, attitude, .. } = pose(read(MOCAP, &payload(&[half, 0.0, 0.0, half, 1.0, 2.0, 3.0])));
    assert_eq!((position_m, attitude), (Vector3::new(1.0, -2.0, -3.0), [half, 0.0, -0.0, -half]));
}

fn rotation([w, x, y, z]: [f32; 4]) -> Matrix3<f64> {
    let q = Quaternion::new(w, x, y, z).cast();
    *UnitQuaternion::from_quaternion(q).to_rotation_matrix().matrix()
}

/// The same pose at rest, sent by each of the messages, gives the same result.
#[test]
fn all_messages_agree() {
    let state = State {
        position_m: Vector3::new(1.0, -2.0, 3.0),
        attitude_rad: Vector3::new(0.3, -0.4, 2.0),
        ..State::default()
    };
    let pose_of = Pose::of(&state, PoseSigmas::UNKNOWN);
    let [w, x, y, z] = pose_of.attitude;
    let vision = pose(read(VISION, &payload(&[1.0, 2.0, -3.0, 0.3, 0.4, -2.0])));
    let mocap = pose(read(MOCAP, &payload(&[w, x, -y, -z, 1.0, 2.0, -3.0])));
    assert_eq!((vision, mocap), (pose_of, pose_of));
    let sent = Uplink::State { sent_us: 1, state, sigmas: PoseSigmas::UNKNOWN };
    match receive(Encoder::new(STATION).send(&sent, &mut [0; FRAME_MAX])) {
        Ok(Uplink::State { state, sigmas, .. }) => {
            let crossed = Pose::of(&state, sigmas);
            assert_eq!(crossed.position_m, pose_of.position_m);
            assert!((rotation(crossed.attitude) - rotation(pose_of.attitude)).amax() < 1e-6);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_largest_variance_counts() {
    for place in 0..3 {
        let mut diagonal = [0.01, 0.01, 0.01, 0.0004, 0.0004, 0.0004];
        (diagonal[place], diagonal[3 + place]) = (0.25, 0.0625);
        // Numbers off the covariance's diagonal have no effect.
        for other in [0.0, 99.0, -99.0, f32::NAN] {
            for message in with_covariance(&triangle(diagonal, other)) {
                let expected = PoseSigmas { position_m: Some(0.5), attitude_rad: Some(0.25) };
                assert_eq!(sigmas(message), expected, "{place}, {other}");
            }
        }
    }
}

#[test]
fn an_unusable_covariance_is_unknown() {
    let known = [1.0, 1.0, 1.0, 4.0, 4.0, 4.0];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0] {
        for place in 0..6 {
            let mut diagonal = known;
            diagonal[place] = bad;
            // NaN in the first place means that the whole covariance is unknown.
            let none = place == 0 && bad.is_nan();
            let expected = PoseSigmas {
                position_m: Some(1.0).filter(|_| place >= 3),
                attitude_rad: Some(2.0).filter(|_| place < 3 && !none),
            };
            for message in with_covariance(&triangle(diagonal, 0.0)) {
                assert_eq!(sigmas(message), expected, "{bad} in {place}");
            }
        }
    }
    let [zeros, position, attitude] = [[0.0; 6], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 4.0]];
    let one = PoseSigmas { position_m: Some(1.0), attitude_rad: None };
    let other = PoseSigmas { position_m: None, attitude_rad: Some(2.0) };
    for (diagonal, expected) in [(zeros, PoseSigmas::UNKNOWN), (position, one), (attitude, other)] {
        for message in with_covariance(&triangle(diagonal, 0.0)) {
            assert_eq!(sigmas(message), expected, "{diagonal:?}");
        }
    }
}

#[test]
fn each_number_of_a_pose_that_is_not_finite_is_counted() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
        for (message, good) in [(VISION, [0.0; 6].as_slice()), (MOCAP, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])] {
            for place in 0..good.len() {
                let mut numbers = good.to_vec();
                numbers[place] = bad;
                let counters = read(message, &payload(&numbers)).expect_err("implausible");
                assert_eq!(counters, Counters { implausible: 1, ..Counters::default() }, "{bad} in {place}");
            }
        }
    }
    for no_rotation in [[0.0; 4], [1.2, 0.0, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0]] {
        let counters = read(MOCAP, &payload(&[no_rotation.as_slice(), &[0.0; 3]].concat())).expect_err("implausible");
        assert_eq!(counters.implausible, 1, "{no_rotation:?}");
    }
}

/// Payloads may have the specified length, be shorter without trailing zeros, or longer by fields of a newer dialect.
#[test]
fn lengths() {
    for (message, longest, first) in [(VISION, 117, 0.0_f32), (MOCAP, 120, 1.0)] {
        for length in 12..=longest {
            let mut payload = payload(&[first]);
            payload.resize(length, 0);
            assert_eq!(pose(read(message, &payload)), Pose::default(), "{length}");
        }
        let mut payload = payload(&[first]);
        payload.resize(longest, 0);
        payload.push(7);
        assert_eq!(pose(read(message, &payload)), Pose::default());
    }
    // The last byte is the reset counter.
    let mut payload = payload(&[0.0; 27]);
    payload.push(200);
    assert_eq!(pose(read(VISION, &payload)), Pose::default());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// A pose survives writing and reading exactly.
    #[test]
    fn poses_survive_the_link(
        sent_us: u64,
        position in prop::array::uniform3(-1e5f32..1e5),
        attitude in prop::array::uniform4(-1.0f32..1.0),
        position_m in prop::option::of(1e-6f32..1e4),
        attitude_rad in prop::option::of(1e-6f32..10.0),
    ) {
        let norm = attitude.iter().map(|part| part * part).sum::<f32>().sqrt();
        prop_assume!(norm > 0.1);
        let sigmas = PoseSigmas { position_m, attitude_rad };
        let attitude = attitude.map(|part| part / norm);
        let sent = Uplink::Pose { sent_us, pose: Pose { position_m: position.into(), attitude, sigmas } };
        prop_assert_eq!(receive(Encoder::new(STATION).send(&sent, &mut [0; FRAME_MAX])), Ok(sent));
    }

    /// The result is the wire's rotation matrix Rz(yaw) Ry(pitch) Rx(roll) with half a turn about x on both sides.
    #[test]
    fn angles_mean_the_wires_rotation(
        position in prop::array::uniform3(-1e3f32..1e3),
        angles in prop::array::uniform3(-7.0f32..7.0),
    ) {
        let about = |axis, angle: f32| *Rotation3::from_axis_angle(&axis, f64::from(angle)).matrix();
        let [roll, pitch, yaw] = angles;
        let wire = about(Vector3::z_axis(), yaw) * about(Vector3::y_axis(), pitch) * about(Vector3::x_axis(), roll);
        let half_turn = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let read = pose(read(VISION, &payload(&[position, angles].concat())));
        prop_assert!((rotation(read.attitude) - half_turn * wire * half_turn).amax() < 2e-6);
        let expected = half_turn * Vector3::from(position).cast::<f64>();
        prop_assert_eq!(read.position_m.cast::<f64>(), expected);

        let q = UnitQuaternion::from_matrix(&wire).coords.cast::<f32>();
        let [x, y, z] = position;
        let read = pose(self::read(MOCAP, &payload(&[q.w, q.x, q.y, q.z, x, y, z])));
        prop_assert!((rotation(read.attitude) - half_turn * wire * half_turn).amax() < 2e-6);
    }

    /// Any bytes give a plausible pose or none.
    #[test]
    fn any_payload_is_harmless(
        payload in prop::collection::vec(prop_oneof![Just(0), Just(0x3F), Just(0x80), any::<u8>()], 1..121),
    ) {
        for message in [VISION, MOCAP] {
            if let Ok(message) = read(message, &payload) {
                prop_assert!(matches!(message, Uplink::Pose { pose, .. } if pose.is_plausible()), "{:?}", message);
            }
        }
    }
}
