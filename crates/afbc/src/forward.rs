//! Jerk and snap of the setpoint as rotors can follow them. Not in the paper.
//!
//! A trajectory of minimum jerk turns a corner with a jump of its jerk: roll and pitch would have to begin turning at
//! once, and the derivatives of (40) say nothing of how. Left to feedback, the turn that is missing becomes an error of
//! position. So a jump J is taken up by d, along x and y, which decays as the
//! [command filter](afbc_control::command_filter) of bandwidth w does,
//!
//! ```text
//! d^2 d/dt^2 = -w^2 d - 2 w dd/dt      dd/dt += J at a jump
//! ```
//!
//! and jerk j - dd/dt and snap s - d^2 d/dt^2 are followed: those of the setpoint, but for a pulse after a corner. No
//! state enters, and so no noise. A jerk that is never given, as by a link, does not jump.

use afbc_control::command_filter::{CommandFilter, Filtered};
use afbc_types::{OutOfRange, Setpoint};
use nalgebra::Vector3;

/// The filter; everything that changes in flight is in [`Followed`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forward {
    filter: CommandFilter,
    dt_s: f32,
    inverse_dt_1_s: f32,
}

/// What is taken up of jumps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Followed {
    /// d and dd/dt of x and y \[m/s2, m/s3\].
    late: [Filtered; 2],
    /// The jerk that is expected of the next setpoint \[m/s3\].
    expected: [f32; 2],
}

impl Forward {
    /// Makes the filter of the given bandwidth \[rad/s\], advanced every `dt_s` seconds.
    ///
    /// # Errors
    /// If the bandwidth is out of range.
    pub fn new(bandwidth_rad_s: f32, dt_s: f32) -> Result<Self, OutOfRange> {
        let filter = CommandFilter::new(bandwidth_rad_s, dt_s)?;
        Ok(Forward { filter, dt_s, inverse_dt_1_s: 1.0 / dt_s })
    }

    /// Returns jerk and snap to follow \[m/s3, m/s4\], those along z unchanged, and advances by one step. In the first
    /// step nothing jumps.
    #[inline(always)]
    pub fn advance(&self, followed: &mut Option<Followed>, setpoint: &Setpoint) -> [Vector3<f32>; 2] {
        let (mut jerk, mut snap) = (setpoint.jerk_m_s3, setpoint.snap_m_s4);
        let Followed { late: [x, y], expected: [expected_x, expected_y] } =
            followed.unwrap_or(Followed { expected: [jerk.x, jerk.y], ..Followed::default() });
        let next = [jerk.x + self.dt_s * snap.x, jerk.y + self.dt_s * snap.y];
        let x = self.along(&x, expected_x, [&mut jerk.x, &mut snap.x]);
        let y = self.along(&y, expected_y, [&mut jerk.y, &mut snap.y]);
        *followed = Some(Followed { late: [x, y], expected: next });
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
