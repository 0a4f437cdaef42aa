//! Dryden turbulence at low altitude.

use crate::noise::Noise;
use afbc_types::parameters;
use libm::{exp, pow, sqrt};
use nalgebra::Vector3;

parameters! {
    /// Dryden turbulence below 1,000 ft by MIL-F-8785C, 3.7.3: intensity and length scale follow from the height and
    /// the wind at 20 ft.
    ///
    /// The spectra are those of a frozen field that the vehicle crosses at its airspeed V. A vehicle that hovers in
    /// still air would not cross it, so V is at least `airspeed_floor_m_s`, the speed at which the field drifts past
    /// it. In wind, a hovering vehicle's airspeed is the wind speed. The rotational gusts (p, q, r) are left out, since
    /// they act on wings, not rotors.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Turbulence {
        /// W20: wind at 20 ft (6 m).
        #[parameter(WIND_20FT, "m/s", 0.0..=50.0)]
        pub wind_20ft_m_s: f64 = 15.0 * KNOT_M_S,
        /// Smallest speed at which the field drifts past the vehicle.
        #[parameter(FLOOR, "m/s", 0.1..=50.0)]
        pub airspeed_floor_m_s: f64 = 1.0,
    }
}

const FOOT_M: f64 = 0.3048;
const KNOT_M_S: f64 = 1852.0 / 3600.0;

impl Turbulence {
    /// MIL-F-8785C's light turbulence: 15 knots at 20 ft.
    pub const LIGHT: Self = Self::of_knots(15.0);
    /// Moderate: 30 knots.
    pub const MODERATE: Self = Self::of_knots(30.0);
    /// Severe: 45 knots.
    pub const SEVERE: Self = Self::of_knots(45.0);

    const fn of_knots(knots: f64) -> Self {
        Turbulence { wind_20ft_m_s: knots * KNOT_M_S, ..Self::DEFAULT }
    }

    /// Returns the turbulence at a height above ground, limited to the model's range of 10 ft to 1,000 ft.
    pub fn at(&self, height_m: f64) -> Intensity {
        let h = (height_m / FOOT_M).clamp(10.0, 1000.0);
        let base = 0.177 + 0.000823 * h;
        let sigma_w = 0.1 * self.wind_20ft_m_s;
        Intensity {
            horizontal_length_m: FOOT_M * h / pow(base, 1.2),
            vertical_length_m: FOOT_M * h,
            horizontal_m_s: sigma_w / pow(base, 0.4),
            vertical_m_s: sigma_w,
        }
    }
}

/// Intensity and length scale of turbulence at one height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intensity {
    /// L_u = L_v: horizontal length scale \[m\].
    pub horizontal_length_m: f64,
    /// L_w: vertical length scale \[m\].
    pub vertical_length_m: f64,
    /// sigma_u = sigma_v: horizontal standard deviation \[m/s\].
    pub horizontal_m_s: f64,
    /// sigma_w: vertical standard deviation \[m/s\].
    pub vertical_m_s: f64,
}

/// The longitudinal filter 1/(1 + s), in units of L/V and sigma, discretised exactly: u(k+1) = a u(k) + b n.
#[derive(Clone, Copy, Debug, Default)]
struct Along {
    a: f64,
    b: f64,
}

impl Along {
    /// Computes the coefficients for a step of `h` = V dt/L.
    fn new(h: f64) -> Self {
        let a = exp(-h);
        Along { a, b: sqrt(1.0 - a * a) }
    }

    #[inline]
    fn step(&self, u: &mut f64, n: f64) {
        *u = self.a * *u + self.b * n;
    }
}

/// The lateral and vertical filter (1 + sqrt(3) s)/(1 + s)^2, in units of L/V and sigma, discretised exactly.
///
/// With the state \[x, dx/ds\] of 1/(1 + s)^2 under white noise of unit intensity, the velocity x + sqrt(3) dx/ds has
/// unit variance, and the state's stationary covariance is P = I/4. Over a step h the state is multiplied by exp(-h)
/// \[\[1 + h, h\], \[-h, 1 - h\]\] = F and gains noise of covariance P - F P F', here by its Cholesky factor.
#[derive(Clone, Copy, Debug, Default)]
struct Across {
    f: [[f64; 2]; 2],
    /// Factors from two normal numbers to x, and from the second to dx/ds.
    noise: [f64; 3],
}

/// State of [`Across`].
#[derive(Clone, Copy, Debug)]
struct AcrossState {
    x: f64,
    x_dot: f64,
}

impl Across {
    /// Computes the coefficients for a step of `h` = V dt/L.
    fn new(h: f64) -> Self {
        let decay = exp(-h);
        let d2 = decay * decay;
        let q_xx = 0.25 * (1.0 - d2 * (1.0 + 2.0 * h + 2.0 * h * h));
        let q_xd = 0.5 * d2 * h * h;
        let q_dd = 0.25 * (1.0 - d2 * (1.0 - 2.0 * h + 2.0 * h * h));
        let l_dd = sqrt(q_dd);
        // The airspeed's floor keeps h positive, and so q_dd.
        let l_xd = q_xd / l_dd;
        // The difference is of the order of h^3, so rounding may make it negative.
        let l_xx = sqrt((q_xx - l_xd * l_xd).max(0.0));
        Across { f: [[decay * (1.0 + h), decay * h], [-decay * h, decay * (1.0 - h)]], noise: [l_xx, l_xd, l_dd] }
    }

    #[inline]
    fn step(&self, state: &mut AcrossState, n: [f64; 2]) {
        let AcrossState { x, x_dot } = *state;
        let [[f_xx, f_xd], [f_dx, f_dd]] = self.f;
        let [l_xx, l_xd, l_dd] = self.noise;
        state.x = f_xx * x + f_xd * x_dot + l_xx * n[0] + l_xd * n[1];
        state.x_dot = f_dx * x + f_dd * x_dot + l_dd * n[1];
    }
}

impl AcrossState {
    /// Draws a state from the stationary distribution.
    fn draw(noise: &mut Noise) -> Self {
        AcrossState { x: 0.5 * noise.normal(), x_dot: 0.5 * noise.normal() }
    }

    #[inline]
    fn velocity(&self) -> f64 {
        const SQRT_3: f64 = 1.732_050_807_568_877_2;
        self.x + SQRT_3 * self.x_dot
    }
}

/// Time for which the filters use constant height and airspeed \[s\].
const REFRESH_S: f64 = 0.05;

/// Turbulence in simulation. Starts in its stationary state, and stays stationary while height and airspeed change,
/// because the filters' states have unit variance for any length scale and intensity.
#[derive(Clone, Debug)]
pub(crate) struct Eddies {
    turbulence: Turbulence,
    noise: Noise,
    step_s: f64,
    /// Steps until the filters are updated with height and airspeed, and steps between updates.
    remaining: u32,
    period: u32,
    intensity: Intensity,
    along: Along,
    lateral: Across,
    vertical: Across,
    u: f64,
    v: AcrossState,
    w: AcrossState,
}

impl Eddies {
    pub(crate) fn new(turbulence: Turbulence, mut noise: Noise, step_s: f64) -> Self {
        let u = noise.normal();
        let v = AcrossState::draw(&mut noise);
        let w = AcrossState::draw(&mut noise);
        Eddies {
            turbulence,
            noise,
            step_s,
            remaining: 0,
            period: libm::round(REFRESH_S / step_s).max(1.0) as u32,
            intensity: turbulence.at(0.0),
            along: Along::default(),
            lateral: Across::default(),
            vertical: Across::default(),
            u,
            v,
            w,
        }
    }

    /// Returns the velocity along, across (to the left of) and above the wind's direction, after one more step \[m/s\].
    #[inline]
    pub(crate) fn advance(&mut self, height_m: f64, airspeed_m_s: impl FnOnce() -> f64) -> Vector3<f64> {
        // Not in every step, since the coefficients take exponentials, powers and roots.
        if self.remaining == 0 {
            self.refresh(height_m, airspeed_m_s());
        }
        self.remaining -= 1;
        let [along, lateral, lateral_dot, vertical, vertical_dot] = self.noise.normals();
        self.along.step(&mut self.u, along);
        self.lateral.step(&mut self.v, [lateral, lateral_dot]);
        self.vertical.step(&mut self.w, [vertical, vertical_dot]);
        let Intensity { horizontal_m_s, vertical_m_s, .. } = self.intensity;
        Vector3::new(horizontal_m_s * self.u, horizontal_m_s * self.v.velocity(), vertical_m_s * self.w.velocity())
    }

    #[cold]
    fn refresh(&mut self, height_m: f64, airspeed_m_s: f64) {
        self.remaining = self.period;
        self.intensity = self.turbulence.at(height_m);
        let distance_m = airspeed_m_s.max(self.turbulence.airspeed_floor_m_s) * self.step_s;
        let horizontal = distance_m / self.intensity.horizontal_length_m;
        self.along = Along::new(horizontal);
        self.lateral = Across::new(horizontal);
        self.vertical = Across::new(distance_m / self.intensity.vertical_length_m);
    }
}
