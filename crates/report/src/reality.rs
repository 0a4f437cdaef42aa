//! Describes the parts that a scenario adds to the ideal vehicle, for the HTML page.

use afbc_plant::{Deviations, Rotors, Sensing};
use afbc_scenario::Scenario;

/// Returns the name and value of each part that the scenario adds to the ideal vehicle.
pub(super) fn rows(scenario: &Scenario) -> Vec<(&'static str, String)> {
    [rotors(scenario), air(scenario), sensors(scenario)].concat()
}

fn rotors(scenario: &Scenario) -> Vec<(&'static str, String)> {
    let rotors = &scenario.realism.rotors;
    let Rotors { time_constant_s, min_rad_s, max_rad_s, delay_s, .. } = *rotors;
    let mut rows = Vec::new();
    let ideal = Rotors::default();
    if [time_constant_s, min_rad_s, max_rad_s, delay_s] != [0.0, 0.0, ideal.max_rad_s, 0.0] {
        let limits = format!("{min_rad_s:.4} to {max_rad_s:.4} rad/s");
        rows.push(("rotors", format!("time constant {time_constant_s} s, delay {delay_s} s, {limits}")));
    }
    rows.extend(
        rotors.faults.iter().map(|f| ("rotor fault", format!("{} from {} s", crate::words::fault(f), f.start_s))),
    );
    if let Some(battery) = rotors.battery {
        let voltage = format!("{} V to {} V, {} ohm", battery.full_v, battery.empty_v, battery.resistance_ohm);
        let charge = format!("{} A h, {} % full", battery.capacity_a_h, 100.0 * battery.initial_charge);
        rows.push(("battery", format!("{voltage}, {charge}")));
    }
    rows
}

fn air(scenario: &Scenario) -> Vec<(&'static str, String)> {
    let realism = &scenario.realism;
    let mut rows = Vec::new();
    if let Some(drag) = realism.drag {
        let area = drag.area_m2;
        let blades = format!("blades {:e} N s²/m", drag.blade_n_s2_m);
        rows.push(("drag", format!("{blades}, body {}, {}, {} m²", area.x, area.y, area.z)));
        let v = realism.wind.steady_m_s;
        rows.push(("steady wind", format!("({}, {}, {}) m/s", v.x, v.y, v.z)));
    }
    rows.extend(realism.wind.gusts.iter().map(|gust| {
        let hold = if gust.hold_s.is_finite() { format!("hold {} s", gust.hold_s) } else { "stays".into() };
        let wind = crate::words::wind_gust(gust);
        ("gust", format!("{wind} from {} s, rise {} s, {hold}", gust.start_s, gust.rise_s))
    }));
    if let Some(turbulence) = realism.wind.turbulence {
        rows.push(("turbulence", format!("Dryden, {:.4} m/s at 20 ft", turbulence.wind_20ft_m_s)));
    }
    if realism.contact.is_some() {
        let effect = if realism.ground_effect.is_some() { ", with ground effect" } else { "" };
        rows.push(("ground", format!("at z = 0{effect}")));
    }
    rows
}

fn sensors(scenario: &Scenario) -> Vec<(&'static str, String)> {
    let Sensing { noise, bias, delay_s, period_s, gyro, dropouts } = scenario.sensing;
    let mut rows = Vec::new();
    let spread = |s: Deviations| {
        format!("{} m, {} m/s, {} rad, {} rad/s", s.position_m, s.velocity_m_s, s.attitude_rad, s.rates_rad_s)
    };
    let mut add = |there: bool, name, value: String| rows.extend(there.then_some((name, value)));
    add(noise != Deviations::default(), "sensor noise", spread(noise));
    add(bias != Deviations::default(), "sensor bias", spread(bias));
    add(delay_s != 0.0, "sensor delay", format!("{delay_s} s"));
    add(period_s != 0.0, "states", format!("every {period_s} s"));
    add(gyro, "rates", "as from a gyroscope, in every step and without delay".into());
    let until = |end_s: f64| if end_s.is_finite() { format!("to {end_s:.4} s") } else { "to the end".into() };
    for fault in &scenario.sensor_faults {
        let what = crate::words::sensor_fault(fault);
        add(true, "sensor fault", format!("{what} from {} s {}", fault.start_s, until(fault.end_s)));
    }
    for outage in &scenario.outages {
        add(true, "no state", format!("from {} s {}", outage.start_s, until(outage.end_s)));
    }
    add(scenario.flight_core, "flight core", "coasts and descends while no state arrives".into());
    if let Some(dropouts) = dropouts {
        add(true, "dropouts", format!("{} per second, {} s on average", dropouts.rate_hz, dropouts.mean_s));
    }
    rows
}
