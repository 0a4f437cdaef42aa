//! Faults of the measured state: a coordinate that freezes, has an offset, or is scaled, possibly by -1.

use crate::motion::Motion;
use afbc_types::Axis;
use alloc::vec::Vec;

/// Kind of error of a measured coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum SensorFaultKind {
    /// Coordinate and rate are multiplied; a factor below 0 reverses the sign.
    Factor(f64),
    /// The coordinate is too large by this much \[m\] or \[rad\]; its rate is right.
    Offset(f64),
    /// Coordinate and rate keep their values from the onset.
    Frozen,
}

/// Fault from `start_s` to `end_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct SensorFault {
    /// Affected coordinate: x, y, z with its velocity; or roll, pitch, yaw with the rate about the same body axis.
    /// `None` for the whole state.
    pub axis: Option<Axis>,
    /// Kind of error.
    pub misreading: SensorFaultKind,
    /// Onset \[s\].
    pub start_s: f64,
    /// End \[s\], infinite for a permanent fault.
    pub end_s: f64,
}

/// Faults of a flight, applied one after the other in the listed order.
#[derive(Clone, Debug, Default)]
pub struct SensorFaults {
    /// Faults, each with the motion at its onset.
    faults: Vec<(SensorFault, Option<Motion>)>,
}

/// Tolerance when comparing times, far below any step \[s\].
const TIME_SLACK_S: f64 = 1e-9;

impl SensorFaults {
    /// Creates the faults of a flight that has not begun.
    pub fn new(faults: &[SensorFault]) -> Self {
        SensorFaults { faults: faults.iter().map(|fault| (*fault, None)).collect() }
    }

    /// Returns true if there are no faults.
    #[inline]
    pub fn are_none(&self) -> bool {
        self.faults.is_empty()
    }

    /// Returns `motion` as faulty sensors measure it at `time_s`. Call it in every step.
    pub fn seen(&mut self, motion: &Motion, time_s: f64) -> Motion {
        let mut seen = *motion;
        let now_s = time_s + TIME_SLACK_S;
        for (fault, held) in &mut self.faults {
            if (fault.start_s..fault.end_s).contains(&now_s) {
                let held = *held.get_or_insert(seen);
                let axes = Axis::ALL.into_iter().filter(|axis| fault.axis.is_none_or(|only| only == *axis));
                axes.for_each(|axis| fault.misreading.apply(axis, &mut seen, &held));
            }
        }
        seen
    }
}

impl SensorFaultKind {
    /// Changes one coordinate of `seen` and its rate; `held` is the motion at the onset.
    fn apply(self, axis: Axis, seen: &mut Motion, held: &Motion) {
        let [coordinate, rate] = coordinates(seen, axis);
        match self {
            SensorFaultKind::Factor(factor) => {
                *coordinate *= factor;
                *rate *= factor;
            }
            SensorFaultKind::Offset(offset) => *coordinate += offset,
            SensorFaultKind::Frozen => [*coordinate, *rate] = coordinates(&mut { *held }, axis).map(|number| *number),
        }
    }
}

/// Returns the coordinate of this axis, and its rate.
fn coordinates(motion: &mut Motion, axis: Axis) -> [&mut f64; 2] {
    let Motion { position_m, velocity_m_s, attitude_rad, rates_rad_s } = motion;
    match axis {
        Axis::X => [&mut position_m.x, &mut velocity_m_s.x],
        Axis::Y => [&mut position_m.y, &mut velocity_m_s.y],
        Axis::Z => [&mut position_m.z, &mut velocity_m_s.z],
        Axis::Roll => [&mut attitude_rad.x, &mut rates_rad_s.x],
        Axis::Pitch => [&mut attitude_rad.y, &mut rates_rad_s.y],
        Axis::Yaw => [&mut attitude_rad.z, &mut rates_rad_s.z],
    }
}
