//! Tests the meaning of a vehicle's physical parameters against definitions of mechanics, in `f64`.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // tests

use afbc_types::{
    Airframe, Axis, Inputs, Mounting, PLUS, Parameters, PerAxis, ROTORS_MAX, Rotor, RotorForces, RotorSpeeds, Rotors,
};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

fn rotor() -> impl Strategy<Value = Rotor<f64>> {
    (-10.0_f64..10.0, -10.0_f64..10.0, any::<bool>()).prop_map(|(x, y, pushes_left)| Rotor { x, y, pushes_left })
}

fn vector(most: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-most..most).prop_map(Vector3::from)
}

/// Draws a vehicle of a different size than the paper's.
fn parameters() -> impl Strategy<Value = Parameters<f64>> {
    let factors = (1e-6_f64..1e-2, 1e-8_f64..1e-3, 1e-7_f64..1e-2);
    (0.1_f64..50.0, 0.05_f64..2.0, prop::array::uniform3(1e-4_f64..10.0), factors, 1.0_f64..20.0).prop_map(
        |(mass_kg, arm_m, inertia, (rotor_inertia_kg_m2, drag_factor_n_m_s2, thrust_factor_n_s2), gravity_m_s2)| {
            let inertia_kg_m2 = inertia.into();
            Parameters {
                mass_kg,
                arm_m,
                inertia_kg_m2,
                rotor_inertia_kg_m2,
                thrust_factor_n_s2,
                drag_factor_n_m_s2,
                gravity_m_s2,
            }
        },
    )
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * b.abs()
}

proptest! {
    /// The moments of the inputs equal those of the rotor forces at their places and of the rotors' drag.
    #[test]
    fn inputs_are_the_moments_of_the_forces(
        vehicle in parameters(),
        rotors in prop::array::uniform6(rotor()),
        forces in prop::array::uniform6(0.0_f32..9.0),
    ) {
        let airframe = Airframe::<6>::new(&vehicle, &rotors).unwrap();
        let inputs = Inputs::of(&airframe.rotors, &forces);
        let (mut moment, mut thrust_n) = (Vector3::zeros(), 0.0);
        for (rotor, force_n) in rotors.iter().zip(forces.map(f64::from)) {
            let place_m = Vector3::new(rotor.x, rotor.y, 0.0) * vehicle.arm_m;
            let drag = vehicle.drag_factor_n_m_s2 / vehicle.thrust_factor_n_s2 * force_n;
            let about_z = if rotor.pushes_left { drag } else { -drag };
            moment += place_m.cross(&Vector3::new(0.0, 0.0, force_n)) + Vector3::new(0.0, 0.0, about_z);
            thrust_n += force_n;
        }
        let wanted = moment.component_div(&vehicle.inertia_kg_m2);
        let [x, y, z] = [inputs.roll_n, inputs.pitch_n, inputs.yaw_n].map(f64::from);
        let turns = vehicle.effectiveness().component_mul(&Vector3::new(x, y, z));
        // Six forces of up to 9 N act at up to 10 arm lengths. Each product is rounded to 1e-6.
        let scale = vehicle.effectiveness() * (6.0 * 90.0 * 1e-6);
        prop_assert!((0..3).all(|i| (turns[i] - wanted[i]).abs() <= scale[i]), "{turns} for {wanted}");
        prop_assert!((f64::from(inputs.thrust_n) - thrust_n).abs() <= 1e-4);
        prop_assert!(close(vehicle.weight_n(), vehicle.mass_kg * vehicle.gravity_m_s2));
    }

    /// Parameters and rotors are rounded to single precision, and an airframe has exactly its number of rotors.
    #[test]
    fn single_precision_rounds(vehicle in parameters(), rotors in prop::collection::vec(rotor(), 0..9)) {
        let single = vehicle.to_f32();
        let all = |p: Parameters<f64>| {
            let [x, y, z] = p.inertia_kg_m2.into();
            let [m, l, g] = [p.mass_kg, p.arm_m, p.gravity_m_s2];
            [m, l, g, x, y, z, p.rotor_inertia_kg_m2, p.thrust_factor_n_s2, p.drag_factor_n_m_s2]
        };
        let again = Parameters {
            mass_kg: single.mass_kg.into(),
            arm_m: single.arm_m.into(),
            inertia_kg_m2: single.inertia_kg_m2.cast(),
            rotor_inertia_kg_m2: single.rotor_inertia_kg_m2.into(),
            thrust_factor_n_s2: single.thrust_factor_n_s2.into(),
            drag_factor_n_m_s2: single.drag_factor_n_m_s2.into(),
            gravity_m_s2: single.gravity_m_s2.into(),
        };
        prop_assert_eq!(all(again), all(vehicle).map(|x| f64::from(x as f32)));
        match Airframe::<6>::new(&vehicle, &rotors) {
            Ok(airframe) => {
                prop_assert_eq!(airframe.parameters, single);
                for (rotor, told) in airframe.rotors.iter().zip(&rotors) {
                    let Rotor { x, y, pushes_left } = *told;
                    prop_assert_eq!(*rotor, Rotor { x: x as f32, y: y as f32, pushes_left });
                    prop_assert_eq!(rotor.to_f64(), Rotor { x: rotor.x.into(), y: rotor.y.into(), pushes_left });
                    prop_assert_eq!(told.spin() == 1.0, pushes_left);
                    prop_assert_eq!(told.spin().abs(), 1.0);
                }
                prop_assert_eq!(rotors.len(), 6);
            }
            Err(error) => {
                prop_assert!(rotors.len() != 6);
                let (is, must) = (error.value, [error.range.min, error.range.max]);
                prop_assert_eq!((is, must), (rotors.len() as f64, [6.0; 2]));
            }
        }
    }

    /// The rotors of a vehicle that has any number of them are its airframe's, bit by bit.
    #[test]
    fn any_number_of_rotors_is_kept(rotors in prop::collection::vec(rotor(), 0..10)) {
        let all = Rotors::try_from(rotors.as_slice());
        prop_assert_eq!(all.is_ok(), (4..=ROTORS_MAX).contains(&rotors.len()));
        if let Ok(all) = all {
            prop_assert_eq!(all.count(), rotors.len());
            prop_assert_eq!(all.iter().collect::<Vec<_>>(), rotors.iter().map(Rotor::to_f32).collect::<Vec<_>>());
            let six = all.array::<6>();
            prop_assert_eq!(six.is_ok(), rotors.len() == 6);
            if let Ok(six) = six {
                prop_assert_eq!((six.to_vec(), Rotors::new(&six)), (all.iter().collect::<Vec<_>>(), all));
            }
        }
    }

    /// Padding keeps the values and appends zeros.
    #[test]
    fn padding_is_zeros(values in prop::array::uniform5(any::<u16>().prop_map(f32::from))) {
        let wanted: [f32; ROTORS_MAX] = core::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0));
        prop_assert_eq!(RotorForces::<5>(values.into()).padded(), RotorForces::<ROTORS_MAX>(wanted.into()));
        prop_assert_eq!(RotorSpeeds::<5>(values.into()).padded(), RotorSpeeds::<ROTORS_MAX>(wanted.into()));
    }

    /// A sensor's axes are the body's axes, turned by its roll, then its pitch, then its yaw.
    #[test]
    fn a_mounting_turns_as_the_conventions_say(position_m in vector(10.0), attitude_rad in vector(7.0)) {
        let mounting = Mounting::<f64> { position_m, attitude_rad };
        let about = |axis, angle: f64| Rotation3::from_axis_angle(&axis, angle);
        let turned = about(Vector3::z_axis(), attitude_rad.z)
            * about(Vector3::y_axis(), attitude_rad.y)
            * about(Vector3::x_axis(), attitude_rad.x);
        let single = mounting.to_f32();
        let off = (single.r_body_sensor().cast() - turned.matrix()).amax();
        prop_assert!(off < 2e-6, "{off}");
        prop_assert_eq!((single.position_m, single.attitude_rad), (position_m.cast(), attitude_rad.cast()));
    }

    /// A mounting changes nothing only if all of its numbers are zero.
    #[test]
    fn a_plain_mounting_is_all_zeros(place in 0..6_usize, by in 1e-6_f32..1.0) {
        let mut mounting = Mounting::PLAIN;
        prop_assert!(mounting.is_plain() && mounting.r_body_sensor().is_identity(0.0));
        let vector = if place < 3 { &mut mounting.position_m } else { &mut mounting.attitude_rad };
        vector[place % 3] = by;
        prop_assert!(!mounting.is_plain());
    }
}

#[test]
fn no_rotor_turns_or_pushes_at_first() {
    assert_eq!(RotorForces::<4>::default(), RotorForces([0.0; 4].into()));
    assert_eq!(RotorSpeeds::<4>::default(), RotorSpeeds([0.0; 4].into()));
}

/// On the paper's frame, the inputs are the sums and differences of (6).
#[test]
fn the_papers_frame() {
    let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = Inputs::of(&PLUS, &[1.0, 2.0, 4.0, 8.0]);
    assert_eq!([roll_n, pitch_n, yaw_n, thrust_n], [4.0 - 1.0, 8.0 - 2.0, 1.0 - 2.0 + 4.0 - 8.0, 15.0]);
    assert_eq!(Airframe::from(Parameters::PAPER.to_f32()).rotors, PLUS);
    let (vehicle, rounding) = (Parameters::PAPER.effectiveness(), 1e-12);
    let wanted = Vector3::new(0.25 / 0.0038, 0.25 / 0.0038, 3.232e-7 / 2.984e-5 / 0.0076);
    assert!((vehicle - wanted).amax() < rounding * wanted.amax());
}

/// Each axis has its own place by name and by number. The first axis follows the last.
#[test]
fn axes_are_in_the_papers_order() {
    let names = ["roll", "pitch", "yaw", "z", "x", "y"];
    let mut axes = PerAxis::from_fn(Axis::name);
    let PerAxis { roll, pitch, yaw, z, x, y } = axes;
    assert_eq!([roll, pitch, yaw, z, x, y], names);
    assert_eq!(Axis::ALL.map(Axis::name), names);
    for (index, axis) in Axis::ALL.into_iter().enumerate() {
        assert_eq!(axis.next(), Axis::ALL[(index + 1) % 6]);
        axes[axis] = "changed";
        assert_eq!(axes.map(|name| *name == "changed"), PerAxis::from_fn(|other| Axis::ALL[..=index].contains(&other)));
    }
    let stopped = PerAxis::try_from_fn(|axis| if axis == Axis::Z { Err(axis) } else { Ok(()) });
    assert_eq!(stopped, Err(Axis::Z));
}
