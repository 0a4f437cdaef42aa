//! Scales gains for rotors with more lag than those for which the gains were tuned.

use afbc_types::{Declaration, Declared, DeclaredValueMut};
use core::convert::Infallible;

/// Returns the exponent of time in a unit.
fn time_power(unit: &str) -> i32 {
    match unit {
        "s" => 1,
        "1/s" | "rad/s" => -1,
        "1/s2" => -2,
        "1/s3" => -3,
        "1/s4" => -4,
        _ => 0,
    }
}

/// Id of the parameter for the rotor model's time constant.
const ROTOR_LAG: &str = "ROT_LAG";

/// Returns the gains for a vehicle that is `slowness` times slower, with rotors that lag by `lag_s`. Each gain is
/// scaled by the power of time in its unit, within its range, so that errors follow the same curve, only slower. The
/// rotor model gets the lag `lag_s`. Limits in m/s, m/s2 and rad stay.
#[must_use]
pub fn slowed<G: Declared>(mut gains: G, slowness: f32, lag_s: f32) -> G {
    let scale = |Declaration { id, unit, range, .. }: &Declaration, value: DeclaredValueMut<'_>| {
        let factor = (0..time_power(unit).abs()).fold(1.0, |factor, _| factor * slowness);
        let factor = if time_power(unit) < 0 { 1.0 / factor } else { factor };
        if let DeclaredValueMut::Single(numbers) = value {
            let within = |number: f32| number.max(range.min as f32).min(range.max as f32);
            if *id == ROTOR_LAG {
                numbers.iter_mut().for_each(|number| *number = within(lag_s));
            } else if factor != 1.0 {
                // The gains are unchanged to the last bit for the lag for which they were tuned.
                numbers.iter_mut().for_each(|number| *number = within(*number * factor));
            }
        }
        Ok::<(), Infallible>(())
    };
    let Ok(()) = gains.visit_mut(&mut { scale });
    gains
}
