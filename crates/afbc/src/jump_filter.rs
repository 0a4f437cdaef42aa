//! Smooths jumps of the setpoint's jerk so that rotors can follow. Not in the paper.
//!
//! A minimum-jerk trajectory turns a corner with a jump of its jerk. Roll and pitch would have to start turning at
//! once, and the derivatives of (40) do not contain that jump. If feedback has to supply the missing turn, a position
//! error results. So a jump J is absorbed by an offset d along x and y, which decays like the [command
//! filter](afbc_control::command_filter) of bandwidth w:
//!
//! ```text
//! d^2 d/dt^2 = -w^2 d - 2 w dd/dt      dd/dt += J at a jump
//! ```
//!
//! The law follows the jerk j - dd/dt and the snap s - d^2 d/dt^2, which differ from the setpoint's only in a pulse
//! after a corner. No measured state is used, so no noise enters. A setpoint source that never sends a jerk, such as a
//! link, causes no jump.

use afbc_control::command_filter::{CommandFilter, Filtered};
use afbc_types::{OutOfRange, Setpoint};
use nalgebra::Vector3;

/// The filter. Everything that changes in flight is in [`JumpMemory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpFilter {
    filter: CommandFilter,
    dt_s: f32,
    inverse_dt_1_s: f32,
}

/// Memory of the absorbed jumps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JumpMemory {
    /// d and dd/dt of x and y \[m/s2, m/s3\].
    offsets: [Filtered; 2],
    /// Jerk expected of the next setpoint \[m/s3\].
    expected: [f32; 2],
}

impl JumpFilter {
    /// Creates the filter with this bandwidth \[rad/s\], advanced every `dt_s` seconds.
    ///
    /// # Errors
    /// Returns an error if the bandwidth is out of range.
    pub fn new(bandwidth_rad_s: f32, dt_s: f32) -> Result<Self, OutOfRange> {
        let filter = CommandFilter::new(bandwidth_rad_s, dt_s)?;
        Ok(JumpFilter { filter, dt_s, inverse_dt_1_s: 1.0 / dt_s })
    }

    /// Returns the jerk and snap to follow \[m/s3, m/s4\], unchanged along z, and advances the filter by one step. The
    /// first step sees no jump.
    #[inline(always)]
    pub fn advance(&self, followed: &mut Option<JumpMemory>, setpoint: &Setpoint) -> [Vector3<f32>; 2] {
        let (mut jerk, mut snap) = (setpoint.jerk_m_s3, setpoint.snap_m_s4);
        let JumpMemory { offsets: [x, y], expected: [expected_x, expected_y] } =
            followed.unwrap_or(JumpMemory { expected: [jerk.x, jerk.y], ..JumpMemory::default() });
        let next = [jerk.x + self.dt_s * snap.x, jerk.y + self.dt_s * snap.y];
        let x = self.along(&x, expected_x, [&mut jerk.x, &mut snap.x]);
        let y = self.along(&y, expected_y, [&mut jerk.y, &mut snap.y]);
        *followed = Some(JumpMemory { offsets: [x, y], expected: next });
        [jerk, snap]
    }

    #[inline(always)]
    fn along(&self, late: &Filtered, expected: f32, [jerk, snap]: [&mut f32; 2]) -> Filtered {
        let late = Filtered { rate: late.rate + (*jerk - expected), ..*late };
        let next = self.filter.advance(&late, 0.0);
        *jerk -= late.rate;
        *snap += (late.rate - next.rate) * self.inverse_dt_1_s;
        next
    }
}
