//! Writes one CSV file per run, with every logged step. Column names end in the unit.

use afbc::model::ModelConstants;
use afbc_plant::{EffectsState, Sensing};
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_sim::columns::{ESTIMATE, MOTION};
use afbc_sim::flight::Sample;
use afbc_sim::flown::ScenarioFlight;
use afbc_types::{Axis, PerAxis, State};
use csv::ByteRecord;
use nalgebra::Vector4;
use std::io::{self, Write};

/// A value, written with the fewest digits that restore it exactly.
enum CsvNumber {
    /// A value that the controller computes.
    Single(f32),
    /// A value that the plant or the reference computes.
    Double(f64),
    /// A flag, written as 0 or 1.
    Flag(bool),
}

use CsvNumber::{Double, Flag, Single};

/// Data of one row.
struct CsvRow<'a> {
    sample: &'a Sample,
    /// Lowest and highest U1..U4 since the previous row.
    extremes: &'a [Vector4<f64>; 2],
    /// Values of the function [`lyapunov`].
    lyapunov: PerAxis<f32>,
}

/// Name of a column, and the function that returns its value.
struct CsvColumn {
    name: String,
    value: Box<dyn Fn(&CsvRow) -> CsvNumber>,
}

/// Returns the computable terms of the Lyapunov functions, with g_i of the nominal vehicle.
fn lyapunov(model: &ModelConstants, sample: &Sample) -> PerAxis<f32> {
    let state = sample.motion.measure();
    PerAxis::from_fn(|axis| model.lyapunov(axis, &state, &sample.trace.errors[axis]))
}

/// Returns every column of a flight's log, from left to right.
fn columns(scenario: &Scenario, contender: &Contender) -> Vec<CsvColumn> {
    let mut columns = Vec::new();
    let mut add = |name: String, value: Box<dyn Fn(&CsvRow) -> CsvNumber>| columns.push(CsvColumn { name, value });
    macro_rules! add {
        ($kind:ident $($name:literal: $value:expr;)*) => {
            $(add($name.into(), Box::new(|row| { let value: fn(&Sample) -> _ = $value; $kind(value(row.sample)) }));)*
        };
    }
    for (name, value) in MOTION {
        add(name.into(), Box::new(move |row| Double(value(row.sample))));
    }
    // phi_d and theta_d: first as given by (40), then after the command filter, as roll and pitch track them.
    add! { Single
        "phi_d_raw_rad": |s| s.trace.desired_rad[0];
        "theta_d_raw_rad": |s| s.trace.desired_rad[1];
        "phi_d_rad": |s| s.trace.filtered[0].angle;
        "theta_d_rad": |s| s.trace.filtered[1].angle;
        "phi_d_rate_rad_s": |s| s.trace.filtered[0].rate;
        "theta_d_rate_rad_s": |s| s.trace.filtered[1].rate;
    }
    // U1..U4 as produced by the rotors, then as demanded by the law. Columns with their extremes since the previous row
    // follow below.
    add! { Single
        "u1_n": |s| s.action.given.roll_n;
        "u2_n": |s| s.action.given.pitch_n;
        "u3_n": |s| s.action.given.yaw_n;
        "u4_n": |s| s.action.given.thrust_n;
        "u1_wanted_n": |s| s.trace.inputs.roll_n;
        "u2_wanted_n": |s| s.trace.inputs.pitch_n;
        "u3_wanted_n": |s| s.trace.inputs.yaw_n;
        "u4_wanted_n": |s| s.trace.inputs.thrust_n;
        "u5_m_s2": |s| s.trace.virtual_m_s2[0];
        "u6_m_s2": |s| s.trace.virtual_m_s2[1];
    }
    let rotors = 0..scenario.rotors.len();
    for i in rotors.clone() {
        let force = move |row: &CsvRow| Single(row.sample.action.forces.0.get(i).copied().unwrap_or_default());
        add(format!("f{}_n", i + 1), Box::new(force));
    }
    for i in rotors {
        let speed = move |row: &CsvRow| Single(row.sample.action.speeds.0.get(i).copied().unwrap_or_default());
        add(format!("omega{}_rad_s", i + 1), Box::new(speed));
    }
    for (i, u) in ["u1", "u2", "u3", "u4"].into_iter().enumerate() {
        for (j, extreme) in ["min", "max"].into_iter().enumerate() {
            let value = move |row: &CsvRow| row.extremes.get(j).and_then(|u| u.get(i)).copied();
            // The rotors' U1..U4 are computed in f32.
            add(format!("{u}_{extreme}_n"), Box::new(move |row| Single(value(row).unwrap_or(f64::NAN) as f32)));
        }
    }
    add! { Flag "saturated": |s| s.action.health.saturated; }
    // The comparison laws outside the cascade have neither e_2 nor estimates, so these columns are left out for them.
    let (in_cascade, adaptive) = (contender.kind().in_cascade(), contender.gains().is_some());
    for axis in Axis::ALL {
        let name = axis.name();
        // Units of e1, e2 and the subsystem's input.
        let [e1, e2, u] = match axis {
            Axis::Roll | Axis::Pitch | Axis::Yaw => ["rad", "rad_s", "n"],
            Axis::Z => ["m", "m_s", "n"],
            Axis::X | Axis::Y => ["m", "m_s", "m_s2"],
        };
        add(format!("e1_{name}_{e1}"), Box::new(move |row| Single(row.sample.trace.errors[axis].e1)));
        if in_cascade {
            add(format!("e2_{name}_{e2}"), Box::new(move |row| Single(row.sample.trace.errors[axis].e2)));
        }
        if adaptive {
            let estimate = move |row: &CsvRow| row.sample.estimates.unwrap_or_default()[axis];
            add(format!("delta_hat_{name}_{u}"), Box::new(move |row| Single(estimate(row).delta)));
            add(format!("theta_norm_{name}_{u}"), Box::new(move |row| Single(estimate(row).theta.norm())));
        }
        if in_cascade {
            add(format!("lyapunov_{name}"), Box::new(move |row| Single(row.lyapunov[axis])));
        }
    }
    if in_cascade {
        let sum = |row: &CsvRow| Axis::ALL.iter().map(|&axis| &row.lyapunov[axis]).sum();
        add("lyapunov_sum".into(), Box::new(move |row| Single(sum(row))));
    }
    if contender.monitored {
        add("tripped".into(), Box::new(|row| Flag(row.sample.action.health.fallback.is_some())));
    }
    columns.extend(real(scenario));
    columns
}

/// Returns the columns of real rotors, air and sensors, as far as the scenario has them.
fn real(scenario: &Scenario) -> Vec<CsvColumn> {
    let mut columns = Vec::new();
    if !scenario.is_ideal() {
        for i in 0..scenario.rotors.len() {
            let speed = move |t: &EffectsState| t.rotor_speeds_rad_s.get(i).copied().unwrap_or(f64::NAN);
            let value = move |row: &CsvRow| Double(row.sample.telemetry.as_ref().map_or(f64::NAN, speed));
            columns.push(CsvColumn { name: format!("rotor{}_rad_s", i + 1), value: Box::new(value) });
        }
        let mut add = |name: &str, value: fn(&EffectsState) -> f64| {
            let value = move |row: &CsvRow| Double(row.sample.telemetry.as_ref().map_or(f64::NAN, value));
            columns.push(CsvColumn { name: name.into(), value: Box::new(value) });
        };
        add("wind_x_m_s", |t| t.wind_m_s.x);
        add("wind_y_m_s", |t| t.wind_m_s.y);
        add("wind_z_m_s", |t| t.wind_m_s.z);
        add("thrust_ratio", |t| t.thrust_ratio);
        add("on_ground", |t| f64::from(u8::from(t.on_ground)));
        if scenario.realism.rotors.battery.is_some() {
            add("battery_v", |t| t.battery.map_or(f64::NAN, |battery| battery.voltage_v));
            add("battery_a", |t| t.battery.map_or(f64::NAN, |battery| battery.current_a));
            add("battery_charge", |t| t.battery.map_or(f64::NAN, |battery| battery.charge));
        }
    }
    if scenario.sensing != Sensing::default() || !scenario.sensor_faults.is_empty() {
        let mut add = |name: &str, value: fn(&State) -> f32| {
            let value =
                move |row: &CsvRow| Single(row.sample.measurement.as_ref().map_or(f32::NAN, |m| value(&m.state)));
            columns.push(CsvColumn { name: name.into(), value: Box::new(value) });
        };
        add("x_measured_m", |s| s.position_m.x);
        add("y_measured_m", |s| s.position_m.y);
        add("z_measured_m", |s| s.position_m.z);
        add("vx_measured_m_s", |s| s.velocity_m_s.x);
        add("vy_measured_m_s", |s| s.velocity_m_s.y);
        add("vz_measured_m_s", |s| s.velocity_m_s.z);
        add("phi_measured_rad", |s| s.attitude_rad.x);
        add("theta_measured_rad", |s| s.attitude_rad.y);
        add("psi_measured_rad", |s| s.attitude_rad.z);
        add("p_measured_rad_s", |s| s.rates_rad_s.x);
        add("q_measured_rad_s", |s| s.rates_rad_s.y);
        add("r_measured_rad_s", |s| s.rates_rad_s.z);
        let fresh = |row: &CsvRow| Flag(row.sample.measurement.is_some_and(|measurement| measurement.fresh));
        columns.push(CsvColumn { name: "measurement_fresh".into(), value: Box::new(fresh) });
    }
    if scenario.instruments.imu.is_some() {
        for (name, value) in ESTIMATE {
            let value = move |row: &CsvRow| Single(row.sample.estimated.as_ref().map_or(f32::NAN, value));
            columns.push(CsvColumn { name: name.into(), value: Box::new(value) });
        }
        let valid = |row: &CsvRow| Flag(row.sample.estimated.is_some_and(|estimated| estimated.valid));
        columns.push(CsvColumn { name: "estimate_valid".into(), value: Box::new(valid) });
    }
    columns
}

/// Returns every row of a flight's log.
fn rows<'a>(ScenarioFlight { scenario, run }: &'a ScenarioFlight) -> impl Iterator<Item = CsvRow<'a>> {
    let model = ModelConstants::new(&scenario.vehicle.to_f32());
    let row =
        move |(sample, extremes): (&'a Sample, &'a _)| CsvRow { sample, extremes, lyapunov: lyapunov(&model, sample) };
    run.log.iter().zip(&run.input_extremes).map(row)
}

/// Returns the columns of the flight's CSV file with their values. Names end in the unit; flags are 0 and 1.
pub fn values(flown: &ScenarioFlight) -> Vec<(String, Vec<f64>)> {
    let columns = columns(&flown.scenario, &flown.run.contender);
    let mut values = vec![Vec::with_capacity(flown.run.log.len()); columns.len()];
    for row in rows(flown) {
        for (values, column) in values.iter_mut().zip(&columns) {
            values.push(match (column.value)(&row) {
                Single(value) => value.into(),
                Double(value) => value,
                Flag(value) => u8::from(value).into(),
            });
        }
    }
    columns.into_iter().map(|column| column.name).zip(values).collect()
}

/// Writes the header and one line per logged step.
pub(super) fn write(out: &mut dyn Write, flown: &ScenarioFlight) -> io::Result<()> {
    let columns = columns(&flown.scenario, &flown.run.contender);
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(columns.iter().map(|column| &column.name))?;
    let mut digits = ryu::Buffer::new();
    let mut record = ByteRecord::new();
    for row in rows(flown) {
        record.clear();
        for column in &columns {
            let field = match (column.value)(&row) {
                Single(value) => digits.format(value),
                Double(value) => digits.format(value),
                Flag(true) => "1",
                Flag(false) => "0",
            };
            record.push_field(field.as_bytes());
        }
        writer.write_byte_record(&record)?;
    }
    writer.flush()
}
