//! Fixed-step integration.

use nalgebra::SVector;

/// Integrates an autonomous dx/dt = f(x) by one step of the classical fourth-order Runge-Kutta method.
#[inline]
pub fn rk4<const N: usize>(
    f: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
    x: &SVector<f64, N>,
    dt: f64,
) -> SVector<f64, N> {
    let k1 = f(x);
    let k2 = f(&(x + k1 * (dt / 2.0)));
    let k3 = f(&(x + k2 * (dt / 2.0)));
    let k4 = f(&(x + k3 * dt));
    x + (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0)
}
