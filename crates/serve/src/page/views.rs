//! Builds the parts of a [`PageFrame`](crate::page::PageFrame) from a vehicle.

use crate::ServedVehicle;
use crate::page::frame::{Adaptation, AxisAdaptation, BatteryView, EstimateView, MotionView, ReferenceView, RotorView};
use crate::page::local_frame::LocalFrame;
use afbc::model::ModelConstants;
use afbc_plant::Motion;
use afbc_types::Axis;
use nalgebra::Vector3;

/// Returns the true motion.
pub(crate) fn truth(motion: &Motion) -> MotionView {
    let state = motion.measure();
    let attitude = state.quaternion();
    MotionView {
        position_m: state.position_m.into(),
        velocity_m_s: state.velocity_m_s.into(),
        attitude: [attitude.w, attitude.i, attitude.j, attitude.k],
        attitude_rad: state.attitude_rad.into(),
        rates_rad_s: state.rates_rad_s.into(),
    }
}

/// Returns the setpoint that the vehicle follows.
pub(crate) fn reference(vehicle: &ServedVehicle, frame: &LocalFrame) -> Option<ReferenceView> {
    let setpoint = vehicle.report()?.guided.setpoint?;
    Some(ReferenceView {
        position_m: frame.earth(&setpoint.position_m).into(),
        velocity_m_s: setpoint.velocity_m_s.into(),
        yaw_rad: setpoint.yaw_rad,
    })
}

/// Returns the state that the vehicle estimates.
pub(crate) fn estimate(vehicle: &ServedVehicle, frame: &LocalFrame) -> Option<EstimateView> {
    let estimate = vehicle.host().details().estimate?;
    let (state, sigmas, validity) = (&estimate.state, &estimate.sigmas, &estimate.validity);
    Some(EstimateView {
        position_m: frame.earth(&state.position_m).into(),
        velocity_m_s: state.velocity_m_s.into(),
        attitude_rad: state.attitude_rad.into(),
        position_sigma_m: sigmas.position_m.into(),
        velocity_sigma_m_s: sigmas.velocity_m_s.into(),
        attitude_sigma_rad: sigmas.attitude_rad.into(),
        valid: validity.attitude && validity.heading && validity.velocity && validity.position,
    })
}

/// Returns the state of each rotor.
pub(crate) fn rotors(vehicle: &ServedVehicle) -> Vec<RotorView> {
    let plant = vehicle.world().plant();
    let (truth, telemetry) = (plant.truth(), plant.telemetry());
    let factor_n_s2 = vehicle.scenario().vehicle.thrust_factor_n_s2;
    let near_ground = telemetry.map_or(1.0, |telemetry| telemetry.thrust_ratio);
    let commanded = vehicle.report().map(|report| report.motors).unwrap_or_default();
    let shares = vehicle.rotor_shares();
    let rotor = |((share, speed), commanded): ((&f64, &f64), &f32)| RotorView {
        speed_rad_s: *speed as f32,
        commanded_rad_s: *commanded,
        thrust_n: (factor_n_s2 * speed * speed * share * near_ground) as f32,
        share: *share as f32,
    };
    shares.iter().zip(truth.rotor_speeds_rad_s.iter()).zip(commanded.0.iter()).map(rotor).collect()
}

/// Returns the wind velocity \[m/s\] and the state of the battery.
pub(crate) fn air_and_battery(vehicle: &ServedVehicle) -> ([f32; 3], Option<BatteryView>) {
    let Some(telemetry) = vehicle.world().plant().telemetry() else { return ([0.0; 3], None) };
    let wind_m_s: Vector3<f32> = telemetry.wind_m_s.cast();
    let battery = telemetry.battery.map(|battery| BatteryView {
        voltage_v: battery.voltage_v as f32,
        current_a: battery.current_a as f32,
        charge: battery.charge as f32,
    });
    (wind_m_s.into(), battery)
}

/// Returns the mass of the current payload \[kg\].
pub(crate) fn payload_kg(vehicle: &ServedVehicle) -> f32 {
    let plant = vehicle.world().plant();
    let carried = |it: &&afbc_plant::Payload| (it.start_s..it.end_s).contains(&plant.time_s());
    plant.environment().payloads().iter().filter(carried).map(|payload| payload.mass_kg).sum::<f64>() as f32
}

/// Returns errors and adaptive estimates of the law.
pub(crate) fn adaptation(vehicle: &ServedVehicle) -> Adaptation {
    let (details, estimates) = (vehicle.host().details(), vehicle.host().estimates());
    let model = ModelConstants::new(&vehicle.scenario().vehicle.to_f32());
    let state = vehicle.world().plant().motion().measure();
    let in_cascade = vehicle.law().in_cascade();
    let axis = |axis: Axis| {
        let (errors, estimate) = (&details.trace.errors[axis], estimates.as_ref().map(|all| &all[axis]));
        AxisAdaptation {
            name: axis.name(),
            e1: errors.e1,
            theta_norm: estimate.map(|estimate| estimate.theta.norm()),
            delta: estimate.map(|estimate| estimate.delta),
            lyapunov: in_cascade.then(|| model.lyapunov(axis, &state, errors)),
        }
    };
    let axes: Vec<AxisAdaptation> = Axis::ALL.into_iter().map(axis).collect();
    let lyapunov = axes.iter().map(|axis| axis.lyapunov).sum();
    Adaptation { axes, lyapunov }
}
