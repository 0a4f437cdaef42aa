//! References made of polynomial pieces: users' paths, and smooth paths through waypoints.

use super::reference::Reference;
use nalgebra::Vector3;

/// Number of coefficients of a polynomial of degree 7.
pub const COEFFICIENTS: usize = 8;

/// Coefficients of c0 + c1 s + ... + c7 s^7, where s is the time since the piece's start \[s\].
pub type PolynomialCoefficients = [f64; COEFFICIENTS];

/// A piece of a reference: x, y, z \[m\] and yaw \[rad\] as polynomials.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PolynomialPiece {
    /// Start \[s\].
    pub start_s: f64,
    /// Length \[s\].
    pub duration_s: f64,
    /// Coefficients of x, y, z and yaw.
    pub coefficients: [PolynomialCoefficients; 4],
}

/// Returns value and four derivatives of a polynomial at `s`, by Horner's rule.
pub fn derivatives(coefficients: &PolynomialCoefficients, s: f64) -> [f64; 5] {
    let [mut value, mut first, mut second, mut third, mut fourth] = [0.0; 5];
    for coefficient in coefficients.iter().rev() {
        fourth = fourth * s + third;
        third = third * s + second;
        second = second * s + first;
        first = first * s + value;
        value = value * s + coefficient;
    }
    // Horner's rule gives the Taylor coefficients about s, so multiply by n!.
    [value, first, 2.0 * second, 6.0 * third, 24.0 * fourth]
}

impl PolynomialPiece {
    /// Returns the end of the piece \[s\].
    pub fn end_s(&self) -> f64 {
        self.start_s + self.duration_s
    }

    /// Returns the reference at `count` + 1 times from start to end.
    pub fn samples(&self, count: u32) -> impl Iterator<Item = Reference> {
        let piece = *self;
        (0..=count).map(move |k| piece.at(piece.start_s + piece.duration_s * f64::from(k) / f64::from(count)))
    }

    /// Returns the reference at time `t` \[s\], clamped to the piece.
    pub fn at(&self, t: f64) -> Reference {
        let s = (t - self.start_s).clamp(0.0, self.duration_s);
        let [x, y, z, yaw] = self.coefficients.each_ref().map(|coefficients| derivatives(coefficients, s));
        let ([x, vx, ax, jx, sx], [y, vy, ay, jy, sy], [z, vz, az, jz, sz]) = (x, y, z);
        let [yaw_rad, yaw_rate_rad_s, yaw_acceleration_rad_s2, ..] = yaw;
        Reference {
            position_m: Vector3::new(x, y, z),
            velocity_m_s: Vector3::new(vx, vy, vz),
            acceleration_m_s2: Vector3::new(ax, ay, az),
            jerk_m_s3: Vector3::new(jx, jy, jz),
            snap_m_s4: Vector3::new(sx, sy, sz),
            yaw_rad,
            yaw_rate_rad_s,
            yaw_acceleration_rad_s2,
        }
    }
}

/// Returns the reference of pieces at time `t`: at rest before the first and after the last.
pub(super) fn at(pieces: &[PolynomialPiece], t: f64) -> Reference {
    let next = pieces.partition_point(|piece| piece.start_s <= t);
    let Some(piece) = pieces.get(next.saturating_sub(1)) else { return Reference::default() };
    let reference = piece.at(t);
    let flies = (piece.start_s..=piece.end_s()).contains(&t);
    if flies { reference } else { Reference::rest(reference.position_m, reference.yaw_rad) }
}

/// Returns the largest speed, acceleration, jerk and snap of the pieces \[m, s\], sampled at `samples` + 1 times each.
pub fn peaks(pieces: &[PolynomialPiece], samples: u32) -> [f64; 4] {
    let mut peaks = [0.0_f64; 4];
    for at in pieces.iter().flat_map(|piece| piece.samples(samples)) {
        let parts = [at.velocity_m_s, at.acceleration_m_s2, at.jerk_m_s3, at.snap_m_s4];
        for (peak, part) in peaks.iter_mut().zip(parts) {
            *peak = peak.max(part.norm());
        }
    }
    peaks
}

/// Formats pieces like the Crazyflie's tools: `duration,x^0,...,x^7,y^0,...,yaw^7`, one line for each piece.
pub fn written(pieces: &[PolynomialPiece]) -> String {
    let powers = |axis: &str| (0..COEFFICIENTS).map(|power| format!(",{axis}^{power}")).collect::<String>();
    let mut text = format!("duration{}\n", ["x", "y", "z", "yaw"].map(powers).concat());
    for piece in pieces {
        text += &piece.duration_s.to_string();
        // The Debug format reads back to the last bit. Unlike Display, it writes an exponent instead of many zeros.
        text.extend(piece.coefficients.iter().flatten().map(|coefficient| format!(",{coefficient:?}")));
        text.push('\n');
    }
    text
}

/// A knot of a path: x, y, z and yaw at a time, with first and second derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Time \[s\].
    pub time_s: f64,
    /// Value, first derivative and second derivative of x, y, z and yaw.
    pub values: [[f64; 3]; 4],
}

/// Returns pieces of degree five between the knots, with the knots' values and derivatives.
pub fn through(knots: &[Knot]) -> Vec<PolynomialPiece> {
    let piece = |(a, b): (&Knot, &Knot)| {
        let duration_s = b.time_s - a.time_s;
        let mut coefficients = [[0.0; COEFFICIENTS]; 4];
        for ((coefficients, from), to) in coefficients.iter_mut().zip(&a.values).zip(&b.values) {
            *coefficients = quintic(*from, *to, duration_s);
        }
        PolynomialPiece { start_s: a.time_s, duration_s, coefficients }
    };
    knots.iter().zip(knots.iter().skip(1)).map(piece).collect()
}

/// Returns the quintic polynomial from value and two derivatives at 0 to value and two derivatives at `t`.
fn quintic([p0, v0, a0]: [f64; 3], [p1, v1, a1]: [f64; 3], t: f64) -> PolynomialCoefficients {
    let (d, v, a) = (p1 - p0 - v0 * t - 0.5 * a0 * t * t, v1 - v0 - a0 * t, a1 - a0);
    let (t2, t3) = (t * t, t * t * t);
    [
        p0,
        v0,
        0.5 * a0,
        (10.0 * d - 4.0 * v * t + 0.5 * a * t2) / t3,
        (-15.0 * d + 7.0 * v * t - a * t2) / (t3 * t),
        (6.0 * d - 3.0 * v * t + 0.5 * a * t2) / (t3 * t2),
        0.0,
        0.0,
    ]
}
