//! Fixed-step integration.

use nalgebra::SVector;

/// Integrates an autonomous dx/dt = f(x) by one step of the classical fourth-order Runge-Kutta method.
#[inline]
pub fn rk4<const N: usize>(
    f: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
    x: &SVector<f64, N>,
    dt: f64,
) -> SVector<f64, N> {
    let (mut at, mut k) = (*x, [SVector::zeros(); 4]);
    // A single call of f, so that f is inlined into the loop: passing a state through memory takes as long as a square
    // root.
    for (k, ahead) in k.iter_mut().zip([dt / 2.0, dt / 2.0, dt, 0.0]) {
        *k = f(&at);
        at = x + *k * ahead;
    }
    let [k1, k2, k3, k4] = k;
    x + (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0)
}
