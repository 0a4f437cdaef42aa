//! All effects together: reproducible by seed, and finite for any input.

use afbc_plant::{
    BatteryModel, Contact, CosineGust, Deviations, Drag, Environment, GroundEffect, MeasurementDropouts, Motion, Plant,
    PlantModel, Realism, RotorFault, RotorStart, Rotors, Sag, Sensing, StateSensor, Turbulence, Wind,
};
use afbc_types::{Parameters, RotorSpeeds};
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;

const STEP_S: f64 = 0.001;

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn battery() -> impl Strategy<Value = BatteryModel> {
    (0.0..1.0, 0.001..2.0, 0.0..1.0, any::<bool>()).prop_map(|(resistance_ohm, capacity_a_h, initial_charge, speed)| {
        let effect = if speed { Sag::Speed } else { Sag::Ceiling };
        BatteryModel { resistance_ohm, capacity_a_h, initial_charge, effect, ..BatteryModel::THREE_CELLS }
    })
}

fn rotors() -> impl Strategy<Value = Rotors> {
    let fault = (1..=4_u8, 0.0..=1.0, 0.0..1.0).prop_map(|(rotor, efficiency, start_s)| RotorFault {
        rotor,
        efficiency,
        start_s,
    });
    (
        0.0..0.1,
        0.0..50.0,
        100.0..500.0,
        0.0..0.05,
        any::<bool>(),
        prop::collection::vec(fault, 0..3),
        prop::option::of(battery()),
    )
        .prop_map(|(time_constant_s, min_rad_s, max_rad_s, delay_s, hover, faults, battery)| {
            let start = if hover { RotorStart::Hover } else { RotorStart::Idle };
            Rotors { time_constant_s, min_rad_s, max_rad_s, delay_s, start, faults, battery }
        })
}

fn wind() -> impl Strategy<Value = Wind> {
    let gust = (vector(20.0), 0.0..1.0, 0.001..1.0, 0.0..1.0)
        .prop_map(|(velocity_m_s, start_s, rise_s, hold_s)| CosineGust { velocity_m_s, start_s, rise_s, hold_s });
    let turbulence = (0.0..30.0, 0.1..10.0)
        .prop_map(|(wind_20ft_m_s, airspeed_floor_m_s)| Turbulence { wind_20ft_m_s, airspeed_floor_m_s });
    (vector(20.0), prop::collection::vec(gust, 0..3), prop::option::of(turbulence))
        .prop_map(|(steady_m_s, gusts, turbulence)| Wind { steady_m_s, gusts, turbulence })
}

fn drag() -> impl Strategy<Value = Drag> {
    (0.0..2.0, 0.0..1e-2, -0.1..0.1, vector(0.05), vector(0.1)).prop_map(
        |(air_density_kg_m3, blade_n_s2_m, rotor_height_m, area, centre_m)| Drag {
            air_density_kg_m3,
            blade_n_s2_m,
            rotor_height_m,
            area_m2: area.abs(),
            centre_m,
        },
    )
}

fn realism() -> impl Strategy<Value = Realism> {
    let contact =
        (0.003..0.05, 0.05..0.8, 0.0..2.0, 0.01..0.2).prop_map(|(sink_m, damping_ratio, friction, foot_radius_m)| {
            Contact { sink_m, damping_ratio, friction, foot_radius_m, ..Contact::PAPER }
        });
    let effect = prop::option::of(Just(GroundEffect::PAPER));
    (rotors(), prop::option::of(drag()), wind(), prop::option::of(contact), effect, any::<u64>()).prop_map(
        |(rotors, drag, wind, contact, ground_effect, seed)| Realism {
            rotors,
            drag,
            wind,
            contact,
            ground_effect,
            seed,
        },
    )
}

fn motion() -> impl Strategy<Value = Motion> {
    (vector(10.0), vector(15.0), vector(3.0), vector(10.0)).prop_map(
        |(position_m, velocity_m_s, attitude_rad, rates_rad_s)| Motion {
            position_m: position_m + Vector3::new(0.0, 0.0, 9.0),
            velocity_m_s,
            attitude_rad,
            rates_rad_s,
        },
    )
}

fn sensing() -> Sensing {
    Sensing {
        noise: Deviations::all(0.01),
        bias: Deviations::all(0.05),
        delay_s: 0.003,
        dropouts: Some(MeasurementDropouts { rate_hz: 5.0, mean_s: 0.02 }),
        ..Sensing::DEFAULT
    }
}

fn finite(motion: &Motion) -> bool {
    let Motion { position_m, velocity_m_s, attitude_rad, rates_rad_s } = motion;
    [position_m, velocity_m_s, attitude_rad, rates_rad_s].iter().all(|v| v.iter().all(|x| x.is_finite()))
}

/// Draws any 32 bits as a commanded speed, including NaN and infinity.
fn commands() -> impl Strategy<Value = Vec<[f32; 4]>> {
    let usual = prop::array::uniform4(0.0..500.0_f32);
    let any_bits = prop::array::uniform4(any::<u32>().prop_map(f32::from_bits));
    prop::collection::vec(prop_oneof![4 => usual, 1 => any_bits], 1..20)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn nothing_accepted_leads_to_a_motion_that_is_not_finite(
        realism in realism(),
        motion in motion(),
        commands in commands(),
        rigid in any::<bool>(),
    ) {
        let model = if rigid { PlantModel::RigidBody } else { PlantModel::Simplified };
        let environment = Environment::calm(Parameters::PAPER).unwrap();
        let mut plant = Plant::with_realism(model, motion, environment, &realism, STEP_S).unwrap();
        let mut sensors = StateSensor::new(&sensing(), realism.seed, STEP_S).unwrap();
        for command in commands.iter().cycle().take(2000) {
            plant.step(&RotorSpeeds(Vector4::from(*command)), STEP_S);
            prop_assert!(finite(&plant.motion()), "{:?}", plant.motion());
            let telemetry = plant.telemetry().unwrap();
            prop_assert!(telemetry.rotor_speeds_rad_s.iter().all(|&w| (0.0..=realism.rotors.max_rad_s).contains(&w)));
            prop_assert!(telemetry.battery.is_none_or(|b| (0.0..=1.0).contains(&b.charge) && b.voltage_v >= 0.0));
            sensors.measure(&plant.motion());
        }
    }

    #[test]
    fn the_same_seed_flies_the_same_flight_to_the_bit(realism in realism(), motion in motion()) {
        let fly = || {
            let environment = Environment::calm(Parameters::PAPER).unwrap();
            let mut plant = Plant::with_realism(PlantModel::RigidBody, motion, environment, &realism, STEP_S).unwrap();
            let mut sensors = StateSensor::new(&sensing(), realism.seed, STEP_S).unwrap();
            let mut seen = Vec::new();
            for _ in 0..200 {
                seen.push(sensors.measure(&plant.motion()));
                plant.step(&RotorSpeeds(Vector4::repeat(200.0)), STEP_S);
            }
            format!("{seen:?} {:?} {:?}", plant.motion(), plant.telemetry())
        };
        prop_assert_eq!(fly(), fly());
    }
}

/// Flights are reproduced by seed, also by later versions and on other machines.
#[test]
fn a_flight_with_everything_stays_what_it_is() {
    let realism = Realism {
        rotors: Rotors {
            time_constant_s: 0.02,
            delay_s: 0.002,
            battery: Some(BatteryModel::THREE_CELLS),
            ..Rotors::default()
        },
        drag: Some(Drag::PAPER),
        wind: Wind {
            steady_m_s: Vector3::new(3.0, 2.0, 0.0),
            gusts: vec![CosineGust { velocity_m_s: Vector3::x(), start_s: 0.1, rise_s: 0.3, hold_s: 0.2 }],
            turbulence: Some(Turbulence::MODERATE),
        },
        contact: Some(Contact::PAPER),
        ground_effect: Some(GroundEffect::PAPER),
        seed: 11,
    };
    let initial = Motion { position_m: Vector3::new(0.0, 0.0, 1.0), ..Motion::default() };
    let environment = Environment::calm(Parameters::PAPER).unwrap();
    let mut plant = Plant::with_realism(PlantModel::RigidBody, initial, environment, &realism, STEP_S).unwrap();
    let mut sensors = StateSensor::new(&sensing(), 11, STEP_S).unwrap();
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for _ in 0..3000 {
        let state = sensors.measure(&plant.motion()).state;
        plant.step(&RotorSpeeds(Vector4::repeat(198.0)), STEP_S);
        let motion = plant.motion();
        let seen = [state.position_m, state.velocity_m_s, state.attitude_rad, state.rates_rad_s].map(|v| v.cast());
        let true_ones = [motion.position_m, motion.velocity_m_s, motion.attitude_rad, motion.rates_rad_s];
        for value in seen.iter().chain(&true_ones).flat_map(|v: &Vector3<f64>| v.iter()) {
            hash = (hash ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3);
        }
    }
    assert_eq!(hash, 0x4d46_1802_cc97_d03e, "{hash:#x}");
}
