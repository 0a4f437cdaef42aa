//! Roll and pitch that point the thrust along a desired acceleration (40), and their derivatives. Section III-D.
//!
//! The paper takes the derivatives of phi_d and theta_d from the command filter. Those of the reference are exact
//! (differential flatness: Mellinger and Kumar, *Minimum snap trajectory generation and control for quadrotors*, ICRA
//! 2011). With the vertical part a_z of the thrust per mass, in axes turned by yaw:
//!
//! ```text
//! s_1 = (a_5 sin psi - a_6 cos psi) / a_z     tan phi   = s_1 cos theta
//! s_2 = (a_5 cos psi + a_6 sin psi) / a_z     tan theta = s_2
//! ```

use afbc_control::math;
use nalgebra::Vector3;

/// Desired roll and pitch with the terms of their derivatives.
pub struct Tilt {
    sin_psi: f32,
    cos_psi: f32,
    /// s_1 and s_2.
    slopes: [f32; 2],
    /// tan phi_d, cos^2 phi_d, cos theta_d, cos^2 theta_d.
    tan_phi: f32,
    cos2_phi: f32,
    cos_theta: f32,
    cos2_theta: f32,
    inverse_vertical: f32,
    /// phi_d, theta_d of (40) \[rad\].
    pub rad: [f32; 2],
}

impl Tilt {
    /// Computes roll and pitch for accelerations along x and y \[m/s2\], the sine and cosine of yaw, and the inverse of
    /// the vertical thrust per mass \[s2/m\].
    #[inline(always)]
    pub fn new(u5: f32, u6: f32, [sin_psi, cos_psi]: [f32; 2], inverse_vertical: f32) -> Self {
        let tan_theta = (u5 * cos_psi + u6 * sin_psi) * inverse_vertical;
        // cos(atan t) = 1 / sqrt(1 + t^2)
        let cos_theta = 1.0 / math::sqrt(1.0 + tan_theta * tan_theta);
        let aside = (u5 * sin_psi - u6 * cos_psi) * inverse_vertical;
        let tan_phi = aside * cos_theta;
        Tilt {
            sin_psi,
            cos_psi,
            slopes: [aside, tan_theta],
            tan_phi,
            cos2_phi: 1.0 / (1.0 + tan_phi * tan_phi),
            cos_theta,
            cos2_theta: cos_theta * cos_theta,
            inverse_vertical,
            rad: [math::atan(tan_phi), math::atan(tan_theta)],
        }
    }

    /// Returns the first and second derivatives of roll and pitch.
    ///
    /// `jerk` \[m/s3\] and `snap` \[m/s4\] are the derivatives of the acceleration, `turn` and `turn_dot` those of yaw
    /// \[rad/s, rad/s2\].
    #[inline(always)]
    pub fn turned(&self, jerk: &Vector3<f32>, snap: &Vector3<f32>, [turn, turn_dot]: [f32; 2]) -> [[f32; 2]; 2] {
        let Tilt { sin_psi, cos_psi, slopes: [aside, ahead], tan_phi, cos2_phi, cos_theta, cos2_theta, .. } = *self;
        let heading = |v: &Vector3<f32>| [v.x * sin_psi - v.y * cos_psi, v.x * cos_psi + v.y * sin_psi];
        let ([j1, j2], [s1, s2], over) = (heading(jerk), heading(snap), self.inverse_vertical);
        // a_z changes too.
        let [j1, j2] = [j1 - aside * jerk.z, j2 - ahead * jerk.z];
        let twice = 2.0 * over * jerk.z;
        let [s1, s2] = [s1 - aside * snap.z - twice * j1, s2 - ahead * snap.z - twice * j2];
        // The heading turns too.
        let aside_dot = j1 * over + turn * ahead;
        let ahead_dot = j2 * over - turn * aside;
        let aside_ddot = (s1 + turn * j2) * over + turn_dot * ahead + turn * ahead_dot;
        let ahead_ddot = (s2 - turn * j1) * over - turn_dot * aside - turn * aside_dot;
        let theta_dot = cos2_theta * ahead_dot;
        // (cos^2 theta)' = -2 tan theta cos^2 theta theta'; the same holds for phi below.
        let theta_ddot = cos2_theta * ahead_ddot - 2.0 * ahead * theta_dot * theta_dot;
        // These are the first and second derivatives of cos theta, divided by -cos theta.
        let (shrink, shrink_dot) = (ahead * theta_dot, ahead * theta_ddot + theta_dot * theta_dot);
        let tan_phi_dot = cos_theta * aside_dot - tan_phi * shrink;
        let tan_phi_ddot = cos_theta * (aside_ddot - 2.0 * aside_dot * shrink) - tan_phi * shrink_dot;
        let phi_dot = cos2_phi * tan_phi_dot;
        let phi_ddot = cos2_phi * tan_phi_ddot - 2.0 * tan_phi * phi_dot * phi_dot;
        [[phi_dot, theta_dot], [phi_ddot, theta_ddot]]
    }
}
