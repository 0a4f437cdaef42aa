//! Readable names and numbers.

use afbc::Profile;
use afbc_plant::{
    CosineGust, Gust, GustKind, Payload, PlantParameter, PlantParameterChange, Realism, RotorFault, Rotors, Sensing,
    SensorFault, SensorFaultKind, Wind,
};
use afbc_scenario::Scenario;
use afbc_scenario::case::{Reading, Sign};
use afbc_scenario::contender::Contender;
use afbc_sim::metrics::{EstimateMetrics, Metrics};
use afbc_sim::run::MonitorTrip;
use afbc_types::Axis;

/// Returns a file name without extension: letters, digits and `_` of `name`, and `-` for every other character.
pub(super) fn slug(name: &str) -> String {
    let keep = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' };
    let slug: String = name.chars().take(80).map(keep).collect();
    if slug.is_empty() { "flight".into() } else { slug }
}

/// Returns the words that distinguish scenarios of the same name in file names: reading, signs, plant, profile.
pub(super) fn case_words(scenario: &Scenario) -> [String; 4] {
    let reading = scenario.case.and_then(|case| case.reading).map_or("still-air", Reading::name);
    let sign = |sign| match sign {
        Sign::Plus => "plus",
        Sign::Minus => "minus",
    };
    let signs = scenario.case.and_then(|case| case.uncertainty).map_or("certain".into(), |uncertainty| {
        format!("inertia-{}-thrust-{}", sign(uncertainty.inertia), sign(uncertainty.thrust))
    });
    [reading.into(), signs, scenario.model.name().into(), profile(scenario).map_or("tuned", Profile::name).into()]
}

/// Returns the profile that all contenders share, if any.
fn profile(scenario: &Scenario) -> Option<Profile> {
    let mut profiles = scenario.contenders.iter().map(Contender::profile);
    let first = profiles.next()?;
    profiles.all(|profile| profile == first).then_some(first)?
}

/// Summarises the conditions in one line: "rigid-body plant, persistent gusts, inertia +75 %, thrust factor -40 %, 60
/// s".
pub(super) fn conditions(scenario: &Scenario) -> String {
    let mut words = vec![format!("{} plant", scenario.model.name())];
    match (scenario.case.and_then(|case| case.reading), scenario.environment.gusts().len()) {
        (_, 0) => {}
        (Some(Reading::Persistent), _) => words.push("persistent gusts".into()),
        (Some(Reading::Pulses), _) => words.push("gusts of 1 s".into()),
        (Some(Reading::Forces), _) => words.push("gusts as forces and moments".into()),
        (None, 1) => words.push("1 gust".into()),
        (None, count) => words.push(format!("{count} gusts")),
    }
    words.extend(scenario.environment.changes().iter().map(change));
    words.extend(real(scenario).into_iter().map(Into::into));
    words.extend(profile(scenario).map(|profile| format!("{} profile", profile.name())));
    words.push(format!("{} s", scenario.duration_s));
    words.join(", ")
}

/// Names the parts of a flight that are not ideal, such as "real rotors", "battery", "wind" or "own estimate".
fn real(scenario: &Scenario) -> Vec<&'static str> {
    let Realism { rotors, drag, wind, contact, ground_effect, .. } = &scenario.realism;
    let (faults, battery) = (!rotors.faults.is_empty(), rotors.battery.is_some());
    let ideal = Rotors { faults: rotors.faults.clone(), battery: rotors.battery, ..Rotors::default() };
    let words = [
        (*rotors != ideal, "real rotors"),
        (faults, "rotor fault"),
        (battery, "battery"),
        (drag.is_some(), "drag"),
        (*wind != Wind::default(), "wind"),
        (contact.is_some() || ground_effect.is_some(), "ground"),
        (!scenario.environment.payloads().is_empty(), "payload"),
        (scenario.sensing != Sensing::default(), "real sensors"),
        (!scenario.sensor_faults.is_empty(), "sensor fault"),
        (scenario.instruments.imu.is_some(), "own estimate"),
        (!scenario.instrument_faults.is_empty(), "instrument fault"),
        (!scenario.outages.is_empty(), "outages"),
    ];
    words.into_iter().filter_map(|(there, word)| there.then_some(word)).collect()
}

/// Formats a payload's mass: "+0.2 kg".
pub(super) fn payload(payload: &Payload) -> String {
    format!("{:+} kg", payload.mass_kg)
}

/// Formats a payload's place: "0.05 m below", "0 m below, 0.1 m ahead, -0.02 m left".
pub(super) fn place(payload: &Payload) -> String {
    let Payload { below_m, ahead_m, left_m, .. } = payload;
    let beside =
        if [*ahead_m, *left_m] == [0.0; 2] { String::new() } else { format!(", {ahead_m} m ahead, {left_m} m left") };
    format!("{below_m} m below{beside}")
}

/// Formats a rotor fault: "rotor 1 at 80 %".
pub(super) fn fault(fault: &RotorFault) -> String {
    format!("rotor {} at {} %", fault.rotor, (fault.efficiency * 1000.0).round() / 10.0)
}

/// Formats a parameter change: "inertia +75 %".
pub(super) fn change(change: &PlantParameterChange) -> String {
    let quantity = match change.quantity {
        PlantParameter::Mass => "mass",
        PlantParameter::Inertia => "inertia",
        PlantParameter::ThrustFactor => "thrust factor",
        PlantParameter::DragFactor => "drag factor",
        PlantParameter::RollMoment => "roll moment",
        PlantParameter::PitchMoment => "pitch moment",
        PlantParameter::YawMoment => "yaw moment",
    };
    if matches!(change.quantity, PlantParameter::RollMoment | PlantParameter::PitchMoment | PlantParameter::YawMoment) {
        return format!("{quantity} of the rotors times {}", change.factor);
    }
    // The change is rounded to tenths of a percent.
    let percent = ((change.factor - 1.0) * 1000.0).round() / 10.0;
    format!("{quantity} {percent:+} %")
}

/// Formats a sensor fault: "pitch frozen", "x times -1", "z off by 0.5 m", "all frozen".
pub(super) fn sensor_fault(fault: &SensorFault) -> String {
    let (name, unit) = match fault.axis {
        None => ("all", ""),
        Some(axis @ (Axis::X | Axis::Y | Axis::Z)) => (axis.name(), "m"),
        Some(axis) => (axis.name(), "rad"),
    };
    match fault.misreading {
        SensorFaultKind::Factor(factor) => format!("{name} times {factor}"),
        SensorFaultKind::Offset(offset) => format!("{name} off by {offset} {unit}"),
        SensorFaultKind::Frozen => format!("{name} frozen"),
    }
}

/// Returns letter and index of a gust: ("A", "x") for an acceleration, ("F", "x") for a force, ("T", "φ") for a moment.
pub(super) fn gust(gust: &Gust) -> (&'static str, &'static str) {
    let letter = match (gust.kind, gust.axis) {
        (GustKind::Acceleration, _) => "A",
        (GustKind::Force, Axis::X | Axis::Y | Axis::Z) => "F",
        (GustKind::Force, _) => "T",
    };
    (letter, symbol(gust.axis))
}

/// Formats a gust of wind: "wind (3, 0, −1) m/s".
pub(super) fn wind_gust(gust: &CosineGust) -> String {
    let v = gust.velocity_m_s;
    format!("wind ({}, {}, {}) m/s", v.x, v.y, v.z).replace('-', "−")
}

/// Returns the label, with unit, of a quantity that a campaign draws: "steady wind [m/s]". For an unknown quantity it
/// is the name with spaces.
pub(super) fn drawn(name: &str) -> String {
    let words = match name {
        "mass_ratio" => "true mass divided by nominal",
        "inertia_ratio" => "true inertia divided by nominal",
        "thrust_factor_ratio" => "true thrust factor divided by nominal",
        "drag_factor_ratio" => "true rotor drag factor divided by nominal",
        "rotor_time_constant_s" => "time constant of the rotors [s]",
        "rotor_delay_s" => "delay from command to rotors [s]",
        "rotor_efficiency" => "remaining share of a failing rotor's thrust",
        "fault_rotor" => "number of the failing rotor",
        "fault_start_s" => "time of the rotor failure [s]",
        "payload_kg" => "mass of the payload [kg]",
        "payload_below_m" => "payload below the centre of mass [m]",
        "payload_start_s" => "time at which the payload is picked up [s]",
        "wind_m_s" => "steady wind [m/s]",
        "wind_direction_rad" => "direction in which the wind blows, from +x toward +y [rad]",
        "wind_20ft_m_s" => "turbulence: wind at 20 ft [m/s]",
        "noise_ratio" => "measurement noise divided by the scenario's",
        "bias_ratio" => "measurement bias divided by the scenario's",
        "sensor_delay_s" => "delay from motion to measurement [s]",
        "dropout_rate_hz" => "rate of measurement dropouts [Hz]",
        "dropout_mean_s" => "mean length of a dropout [s]",
        "start_x_m" => "offset of the start along x [m]",
        "start_y_m" => "offset of the start along y [m]",
        "start_z_m" => "offset of the start along z [m]",
        "imu_part" => "kind of inertial sensor",
        "vibration_ratio" => "vibration divided by the scenario's",
        "barometer_part" => "kind of barometer",
        "magnetometer_part" => "kind of magnetometer",
        "tracker_delay_s" => "delay of the tracker [s]",
        "tracker_outliers" => "share of outliers of the tracker",
        "tracker_loss_rate_hz" => "rate of dropouts of the tracker [Hz]",
        "tracker_loss_mean_s" => "mean length of a dropout of the tracker [s]",
        "gnss_delay_s" => "delay of the GNSS receiver [s]",
        "gnss_loss_rate_hz" => "rate of dropouts of the GNSS receiver [Hz]",
        "gnss_loss_mean_s" => "mean length of a dropout of the GNSS receiver [s]",
        "aiding" => "tracker (1) or GNSS, barometer and magnetometer (2)",
        other => return other.replace('_', " "),
    };
    words.into()
}

/// Returns the unit of a gust's size.
pub(super) fn gust_unit(gust: &Gust) -> &'static str {
    match (gust.kind, gust.axis) {
        (GustKind::Acceleration, Axis::X | Axis::Y | Axis::Z) => "m/s²",
        (GustKind::Acceleration, _) => "rad/s²",
        (GustKind::Force, Axis::X | Axis::Y | Axis::Z) => "N",
        (GustKind::Force, _) => "N m",
    }
}

/// Returns the paper's symbol for the coordinate of `axis`.
pub(super) const fn symbol(axis: Axis) -> &'static str {
    match axis {
        Axis::Roll => "φ",
        Axis::Pitch => "θ",
        Axis::Yaw => "ψ",
        Axis::Z => "z",
        Axis::X => "x",
        Axis::Y => "y",
    }
}

/// Formats a figure that is evaluated from 5 s to the end; empty for a flight that ended earlier.
pub(super) fn measured(metrics: &Metrics, figure: f64) -> String {
    metrics.measured(figure).map_or_else(String::new, |figure| figure.to_string())
}

/// Formats a loss: "lost at t = 15.625 s: tilted beyond 90 degrees".
pub(super) fn lost(lost: &afbc_sim::flight::Lost) -> String {
    format!("lost at t = {:.3} s: {}", lost.time_s, lost.reason)
}

/// Formats the estimate's errors: "its estimate is off by 0.0010 m, 0.018 m/s and 0.07 degrees (root mean squares),
/// NEES 9.4 of 9".
pub(super) fn estimate(estimate: &EstimateMetrics) -> String {
    let EstimateMetrics { position_m, velocity_m_s, attitude_rad, nees, .. } = estimate;
    let (position_m, velocity_m_s, attitude_deg) =
        (position_m.norm(), velocity_m_s.norm(), attitude_rad.norm().to_degrees());
    format!(
        "the vehicle's estimate is off by {position_m:.4} m, {velocity_m_s:.3} m/s and {attitude_deg:.2} degrees (root \
         mean square), NEES {nees:.1} (9 expected)"
    )
}

/// Formats a trip: "the monitor switched to backstepping at t = 15.625 s: rotors stay saturated".
pub(super) fn tripped(tripped: &MonitorTrip) -> String {
    let reason = tripped.reason;
    let reason = reason.strip_prefix("AFBC off: ").unwrap_or(reason);
    format!("the monitor switched to backstepping at t = {:.3} s: {reason}", tripped.time_s)
}
