//! Compares faults of the measured state with their descriptions.

use afbc_plant::{Motion, SensorFault, SensorFaultKind, SensorFaults};
use afbc_types::Axis;
use nalgebra::Vector3;

/// Returns the motion at step `k`, with twelve different numbers.
fn motion(k: u32) -> Motion {
    let v = |first: f64| Vector3::new(first, first + 0.1, first + 0.2) + Vector3::repeat(f64::from(k));
    Motion { position_m: v(1.0), velocity_m_s: v(2.0), attitude_rad: v(3.0), rates_rad_s: v(4.0) }
}

fn seen(faults: &[SensorFault]) -> Vec<Motion> {
    let mut faults = SensorFaults::new(faults);
    (0..10).map(|k| faults.seen(&motion(k), 0.1 * f64::from(k))).collect()
}

/// Returns a fault in steps 3 to 6.
fn fault(axis: Option<Axis>, misreading: SensorFaultKind) -> SensorFault {
    SensorFault { axis, misreading, start_s: 0.3, end_s: 0.7 }
}

/// Returns coordinate and rate of an axis in a motion.
fn coordinates(motion: &mut Motion, axis: Axis) -> [&mut f64; 2] {
    let Motion { position_m: p, velocity_m_s: v, attitude_rad: a, rates_rad_s: w } = motion;
    match axis {
        Axis::X => [&mut p.x, &mut v.x],
        Axis::Y => [&mut p.y, &mut v.y],
        Axis::Z => [&mut p.z, &mut v.z],
        Axis::Roll => [&mut a.x, &mut w.x],
        Axis::Pitch => [&mut a.y, &mut w.y],
        Axis::Yaw => [&mut a.z, &mut w.z],
    }
}

#[test]
fn each_fault_changes_its_coordinate_for_its_time_and_nothing_else() {
    for axis in Axis::ALL {
        for misreading in [SensorFaultKind::Factor(-1.0), SensorFaultKind::Offset(0.5), SensorFaultKind::Frozen] {
            for (k, seen) in (0..).zip(seen(&[fault(Some(axis), misreading)])) {
                let (mut expected, mut held) = (motion(k), motion(3));
                if (3..7).contains(&k) {
                    let [coordinate, rate] = coordinates(&mut expected, axis);
                    match misreading {
                        SensorFaultKind::Factor(_) => [*coordinate, *rate] = [-*coordinate, -*rate],
                        SensorFaultKind::Offset(_) => *coordinate += 0.5,
                        SensorFaultKind::Frozen => [*coordinate, *rate] = coordinates(&mut held, axis).map(|x| *x),
                    }
                }
                assert_eq!(seen, expected, "{axis:?}, {misreading:?}, step {k}");
            }
        }
    }
}

#[test]
fn a_whole_state_freezes_and_faults_act_in_their_order() {
    let frozen = fault(None, SensorFaultKind::Frozen);
    for (k, seen) in (0..).zip(seen(&[frozen])) {
        assert_eq!(seen, motion(if (3..7).contains(&k) { 3 } else { k }));
    }
    // A state that freezes after an offset keeps the offset.
    let both = seen(&[SensorFault { end_s: 0.5, ..fault(Some(Axis::Z), SensorFaultKind::Offset(1.0)) }, frozen]);
    assert_eq!(both.iter().map(|motion| motion.position_m.z).nth(6), Some(motion(3).position_m.z + 1.0));
}
