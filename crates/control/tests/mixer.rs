//! Properties of the mixer: inversion, limits under any input, and the order of priority.
//!
//! Some mutants of `mixer.rs` survive because they change no result: another number for `ASKED_MAX * ASKED_MAX` (a
//! shortcut past a clamp that changes nothing below `ASKED_MAX`), `least < most` (scales by 1) and `yaw >= 0` (zero yaw
//! takes no room).
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs)] // a failed construction must stop the test

use afbc_control::Settings;
use afbc_control::mixer::{AUTHORITY, Allocation, HOVER_MARGIN, Mixer, THRUST_SHARE};
use afbc_types::{Airframe, Inputs, PLUS, Parameters, ROTOR_POSITION, Rotor, RotorForces, RotorSpeeds};
use core::f32::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use nalgebra::{SMatrix, SVector, Vector4};
use proptest::prelude::*;

/// Relative rounding error of one `f32` operation.
const U: f32 = 1.0 / (1 << 24) as f32;

fn mixer_of<const N: usize>(rotors: [Rotor; N], force_max_n: f32) -> Mixer<N> {
    Mixer::new(airframe(rotors), force_max_n).unwrap()
}

fn mixer(force_max_n: f32) -> Mixer {
    Mixer::new(Parameters::PAPER.to_f32(), force_max_n).unwrap()
}

fn inputs(values: [f32; 4]) -> Inputs {
    let [roll_n, pitch_n, yaw_n, thrust_n] = values;
    Inputs { roll_n, pitch_n, yaw_n, thrust_n }
}

fn list(inputs: &Inputs) -> [f32; 4] {
    [inputs.roll_n, inputs.pitch_n, inputs.yaw_n, inputs.thrust_n]
}

/// Returns `N` rotors on a circle with alternating directions of rotation, the first at `first_rad` from +x.
fn circle<const N: usize>(first_rad: f32) -> [Rotor; N] {
    core::array::from_fn(|i| {
        let angle = first_rad + TAU * i as f32 / N as f32;
        Rotor { x: angle.cos(), y: angle.sin(), pushes_left: i % 2 == 0 }
    })
}

fn cross() -> [Rotor; 4] {
    circle(FRAC_PI_4)
}

/// Front rotors further apart and closer to the centre than the rear ones.
const UNEVEN: [Rotor; 4] = [
    Rotor { x: 0.6, y: 0.9, pushes_left: true },
    Rotor { x: 0.6, y: -0.9, pushes_left: false },
    Rotor { x: -0.9, y: -0.6, pushes_left: true },
    Rotor { x: -0.9, y: 0.6, pushes_left: false },
];

/// Two triangles, a quarter turn apart: equal shares of a pure thrust, but no two rotors opposite each other.
const TRIANGLES: [Rotor; 6] = [
    Rotor { x: 1.0, y: 0.0, pushes_left: true },
    Rotor { x: 0.0, y: 1.0, pushes_left: false },
    Rotor { x: -0.5, y: 0.866_025_4, pushes_left: true },
    Rotor { x: -0.866_025_4, y: -0.5, pushes_left: false },
    Rotor { x: -0.5, y: -0.866_025_4, pushes_left: true },
    Rotor { x: 0.866_025_4, y: -0.5, pushes_left: false },
];

/// Checks every allocation on every frame: forces are within limits, inputs that were not demanded are not reported as
/// missing, and unallocated = U - B F.
fn check<const N: usize>(
    mixer: &Mixer<N>,
    limit: f32,
    asked: &Inputs,
    got: &Allocation<N>,
) -> Result<(), TestCaseError> {
    prop_assert!(got.forces.0.iter().all(|force| (0.0..=limit).contains(force)), "{got:?}");
    let given = list(&mixer.inputs(&got.forces));
    for ((asked, given), missing) in list(asked).into_iter().zip(given).zip(list(&got.unallocated)) {
        let asked = if asked.is_nan() { 0.0 } else { asked.clamp(-1e9, 1e9) };
        // Forces have rounding errors in proportion to the limit, the difference in proportion to its own size.
        let allowed = 4e-6 * limit + 4.0 * U * asked.abs();
        prop_assert!((asked - given - missing).abs() <= allowed, "{asked} - {given} is not {missing}");
    }
    Ok(())
}

/// Four rotors around the centre, all off the positions of a symmetric frame.
fn uneven() -> impl Strategy<Value = [Rotor; 4]> {
    let spread = || prop::array::uniform4(-0.4_f32..0.4);
    (spread(), spread()).prop_map(|(along, across)| {
        let [a, b, c, d] = cross();
        let moved = |r: Rotor, x: f32, y: f32| Rotor { x: r.x + x, y: r.y + y, ..r };
        [
            moved(a, along[0], across[0]),
            moved(b, along[1], across[1]),
            moved(c, along[2], across[2]),
            moved(d, along[3], across[3]),
        ]
    })
}

/// Returns the largest share up to 1 for which `fits` holds. It holds for 0.
fn largest(fits: impl Fn(f64) -> bool) -> f64 {
    if fits(1.0) {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}

/// Returns the paper's vehicle with other rotors.
fn airframe<const N: usize>(rotors: [Rotor; N]) -> Airframe<N> {
    Airframe { rotors, parameters: Parameters::PAPER.to_f32() }
}

/// Returns U1..U4 of the paper's frame, (6).
fn six(forces: &RotorForces) -> Inputs {
    let [f1, f2, f3, f4] = forces.0.into();
    Inputs { roll_n: f3 - f1, pitch_n: f4 - f2, yaw_n: f1 - f2 + f3 - f4, thrust_n: f1 + f2 + f3 + f4 }
}

fn anything() -> impl Strategy<Value = Inputs> {
    prop::array::uniform4(prop_oneof![prop::num::f32::ANY, -100.0_f32..100.0]).prop_map(inputs)
}

/// Checks forces against the order of priority, with expected ones found by bisection in `f64`. Roll and pitch come
/// first, in their proportion, as large as fits at any thrust up to the larger of the demand and the raised limit. Then
/// comes the closest such thrust to the demand, then as much yaw as fits.
fn serves_in_order<const N: usize>(
    frame: [Rotor; N],
    asked: [f32; 4],
    limit: f32,
    raised: f32,
) -> Result<(), TestCaseError> {
    let columns = frame.map(|r| [f64::from(r.y), -f64::from(r.x), if r.pushes_left { 1.0 } else { -1.0 }, 1.0]);
    let effectiveness = SMatrix::<f64, 4, N>::from_columns(&columns.map(Vector4::from));
    let inverse = effectiveness.transpose() * (effectiveness * effectiveness.transpose()).try_inverse().unwrap();
    let share: SVector<f64, N> = inverse.column(3).into();
    // Exclude frames with a tiny share of a rotor or nearly dependent inputs, whose rounding exceeds the tolerance
    // below.
    prop_assume!(share.min() > 0.05 && inverse.abs().max() < 3.0);
    let (wanted, limit_n) = (Vector4::from(asked.map(f64::from)), f64::from(limit));
    // If all four inputs fit, they are given in full, which other tests check. At the boundary, either result is right.
    let exact = inverse * wanted;
    prop_assume!(exact.min() < -1e-4 || exact.max() > limit_n + 1e-4);
    let tilt = inverse.column(0) * wanted.x + inverse.column(1) * wanted.y;
    // `thrusts` returns the range of thrusts at which no force of `tilt` violates its limits. The range is empty if the
    // first thrust exceeds the second.
    let thrusts = |tilt: &SVector<f64, N>| {
        (-tilt.component_div(&share).min(), (tilt.map(|force| limit_n - force)).component_div(&share).min())
    };
    let raised_n = wanted.w.max(f64::from(raised));
    let scaled = largest(|scale| {
        let (least, most) = thrusts(&(tilt * scale));
        least <= most && least <= raised_n
    });
    let tilt = tilt * scaled;
    let (least, most) = thrusts(&tilt);
    let upright = tilt + share * wanted.w.min(most).max(least);
    let yaw = inverse.column(2) * wanted.z;
    let slack = 1e-9 * limit_n;
    let fits = |part: f64| (upright + yaw * part).iter().all(|force| (-slack..=limit_n + slack).contains(force));
    let forces = upright + yaw * largest(fits);

    let mixer = mixer_of(frame, limit).with_raised_thrust_max_n(raised);
    let got = mixer.allocate(&inputs(asked));
    check(&mixer, limit, &inputs(asked), &got)?;
    // The forces' rounding errors are in proportion to the largest intermediate value, at most 8 N times four entries
    // of the inverse. The error of yaw's share is that error divided by the yaw forces.
    for (got, wanted) in got.forces.0.iter().zip(&forces) {
        prop_assert!(
            (f64::from(*got) - wanted).abs() <= 1e-4 * (1.0 + limit_n),
            "{got} for {wanted} of {forces} for {asked:?}"
        );
    }
    Ok(())
}

/// Feasible demands are given exactly, infeasible ones within the limits.
fn any_frame<const N: usize>(rotors: [Rotor; N], shares: &[f32; 8], asked: &Inputs) -> Result<(), TestCaseError> {
    let limit = 3.0;
    let mixer = mixer_of(rotors, limit);
    check(&mixer, limit, asked, &mixer.allocate(asked))?;

    // Inputs of some forces within the limits, which are therefore feasible.
    let forces = SVector::<f32, N>::from_iterator(shares.iter().map(|share| limit * share));
    let wanted = mixer.inputs(&RotorForces(forces));
    let got = mixer.allocate(&wanted);
    check(&mixer, limit, &wanted, &got)?;
    if N == 4 || !got.saturated {
        for (got, wanted) in list(&mixer.inputs(&got.forces)).into_iter().zip(list(&wanted)) {
            prop_assert!((got - wanted).abs() <= 3e-6 * limit * N as f32, "{got} for {wanted}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn feasible_demands_are_given_exactly(forces in prop::array::uniform4(0.0_f32..30.0)) {
        let wanted = six(&RotorForces(Vector4::from(forces)));
        let mixer = mixer(31.0);
        let allocation = mixer.allocate(&wanted);
        let total: f32 = forces.iter().sum();
        // A force is a sum of three terms, each at most the total and rounded twice; so is an input.
        for (got, force) in allocation.forces.0.iter().zip(forces) {
            prop_assert!((got - force).abs() <= 6.0 * U * total, "{got} for {force}");
        }
        for (got, wanted) in list(&six(&allocation.forces)).into_iter().zip(list(&wanted)) {
            prop_assert!((got - wanted).abs() <= 24.0 * U * total, "{got} for {wanted}");
        }
        // A zero force may be computed as a tiny negative number and clipped; no other force may.
        prop_assert!(!allocation.saturated || forces.iter().any(|force| *force <= 6.0 * U * total));
    }

    #[test]
    fn frames_of_four_six_and_eight(shares in prop::array::uniform8(0.0_f32..=1.0), asked in anything()) {
        any_frame(PLUS, &shares, &asked)?;
        any_frame(cross(), &shares, &asked)?;
        any_frame(UNEVEN, &shares, &asked)?;
        any_frame(circle::<6>(0.5), &shares, &asked)?;
        any_frame(circle::<8>(0.0), &shares, &asked)?;
    }

    /// B F of the plus frame is (6), and the general mixer inverts it like the closed form.
    #[test]
    fn the_plus_frame_is_equation_6(
        forces in prop::array::uniform4(0.0_f32..30.0),
        asked in prop::array::uniform4(-10.0_f32..10.0),
    ) {
        let forces = RotorForces(Vector4::from(forces));
        let general = mixer(1e4).inputs(&forces);
        for (general, own) in list(&general).into_iter().zip(list(&six(&forces))) {
            prop_assert!((general - own).abs() <= 4.0 * U * forces.0.sum());
        }
        let [u1, u2, u3, _] = asked;
        let u4 = 100.0;
        let wanted = [
            (u4 + u3) / 4.0 - u1 / 2.0,
            (u4 - u3) / 4.0 - u2 / 2.0,
            (u4 + u3) / 4.0 + u1 / 2.0,
            (u4 - u3) / 4.0 + u2 / 2.0,
        ];
        let got = mixer(1e4).allocate(&inputs([u1, u2, u3, u4]));
        prop_assert!(!got.saturated);
        for (got, wanted) in got.forces.0.iter().zip(wanted) {
            prop_assert!((got - wanted).abs() <= 8.0 * U * 50.0, "{got} for {wanted}");
        }
    }

    #[test]
    fn speeds_and_forces_are_inverse(force in prop::array::uniform4(0.0_f32..1e4)) {
        let mixer = mixer(1e4);
        let forces = RotorForces(Vector4::from(force));
        let speeds = mixer.speeds(&forces);
        // To the speeds, 1/b, the product and the root round, and the root halves errors. Back to the forces, two
        // products round.
        for (back, force) in mixer.forces(&speeds).0.iter().zip(force) {
            prop_assert!((back - force).abs() <= 6.0 * U * force, "{back} for {force}");
        }
        let b = Parameters::PAPER.thrust_factor_n_s2;
        for (speed, force) in speeds.0.iter().zip(force) {
            let exact = (f64::from(force) / b).sqrt();
            prop_assert!((f64::from(*speed) - exact).abs() <= 3.0 * f64::from(U) * exact, "{speed} for {exact}");
        }
    }

    #[test]
    fn whatever_is_asked_every_force_stays_within_its_limits(asked in anything(), limit in 1e-3_f32..1e4) {
        let mixer = mixer(limit);
        let allocation = mixer.allocate(&asked);
        check(&mixer, limit, &asked, &allocation)?;
        let fastest = (f64::from(limit) / Parameters::PAPER.thrust_factor_n_s2).sqrt() * (1.0 + 3.0 * f64::from(U));
        let speeds = mixer.speeds(&allocation.forces);
        prop_assert!(speeds.0.iter().all(|speed| (0.0..=fastest).contains(&f64::from(*speed))), "{speeds:?}");
        if list(&asked).iter().any(|value| value.is_nan()) {
            prop_assert!(allocation.saturated, "a NaN went unnoticed");
        }
    }

    /// Four rotors: roll and pitch are given in full if any forces within limits allow it. Then thrust is as close as
    /// possible. Yaw is never reversed, and given in full if there is room.
    #[test]
    fn roll_and_pitch_come_first_then_thrust_then_yaw(
        frame in prop::sample::select(vec![PLUS, cross()]),
        asked in prop::array::uniform4(-8.0_f32..8.0),
        limit in 0.5_f32..5.0,
    ) {
        let mixer = mixer_of(frame, limit);
        let got = mixer.allocate(&inputs(asked));
        let [roll, pitch, yaw, thrust] = list(&mixer.inputs(&got.forces));
        let near = |a: f32, b: f32| (a - b).abs() <= 1e-5 * (limit + b.abs());

        // The sum of opposite rotors is fixed; roll and pitch determine their difference.
        let [a, b, c, d] = frame;
        let difference = |p: &Rotor, q: &Rotor| {
            let (x, y) = (p.x - q.x, p.y - q.y);
            (y * asked[0] - x * asked[1]) / (x * x + y * y) * 2.0
        };
        let widest = difference(&a, &c).abs().max(difference(&b, &d).abs());
        let fits = limit / widest;
        let share = fits.min(1.0);
        prop_assert!(
            near(roll, share * asked[0]) && near(pitch, share * asked[1]),
            "{roll}, {pitch} are not {share} of {asked:?}"
        );

        // Unsaturated demands are given in full, which other tests check.
        if !got.saturated {
            return Ok(());
        }
        let (least, most) = (2.0 * widest * share, 4.0 * limit - 2.0 * widest * share);
        prop_assert!(near(thrust, asked[3].max(least).min(most)), "{thrust} of {} to {most} for {asked:?}", least);
        prop_assert!(
            yaw * asked[2] >= -1e-5 * limit && yaw.abs() <= asked[2].abs() + 1e-5 * limit,
            "{yaw} for {asked:?}"
        );
        // Yaw is given as far as the pair of rotors with the widest difference stays within the limit that it moves
        // towards.
        let pair = |p: &Rotor, q: &Rotor| difference(p, q).abs() * share / 2.0;
        let (up, down) =
            if (asked[2] > 0.0) == a.pushes_left { (pair(&a, &c), pair(&b, &d)) } else { (pair(&b, &d), pair(&a, &c)) };
        let room = (limit - thrust / 4.0 - up).min(thrust / 4.0 - down).max(0.0);
        prop_assert!(near(yaw.abs(), asked[2].abs().min(4.0 * room)), "{yaw} with {room} for {asked:?}");
    }

    /// The order is the same on frames without symmetry, and on one with equal shares but no opposite rotors.
    #[test]
    fn uneven_frames_serve_in_the_same_order(
        frame in uneven(),
        asked in prop::array::uniform4(-8.0_f32..8.0),
        no_yaw in prop::bool::weighted(0.2),
        limit in 0.5_f32..5.0,
        raised in prop_oneof![Just(f32::MAX), 0.1_f32..10.0],
    ) {
        let asked = if no_yaw { [asked[0], asked[1], 0.0, asked[3]] } else { asked };
        serves_in_order(frame, asked, limit, raised)?;
        serves_in_order(TRIANGLES, asked, limit, raised)?;
    }

    /// Roll and pitch raise the thrust up to the limit or the demand at most, and keep their proportion. They are given
    /// as without the limit if they need no more thrust.
    #[test]
    fn roll_and_pitch_raise_the_thrust_to_the_limit_at_most(
        frame in prop_oneof![Just(PLUS), Just(cross()), uneven()],
        asked in anything(),
        raised in 0.1_f32..10.0,
    ) {
        let free = mixer_of(frame, 3.0);
        let limited = free.with_raised_thrust_max_n(raised);
        let (whole, got) = (free.allocate(&asked), limited.allocate(&asked));
        check(&limited, 3.0, &asked, &got)?;
        // A NaN demand does not raise the limit.
        let most = raised.max(asked.thrust_n);
        prop_assert!(got.given.thrust_n <= most * (1.0 + 4.0 * U), "{got:?} for {asked:?}, at most {most}");
        if !whole.saturated || whole.given.thrust_n <= most * (1.0 - 4.0 * U) {
            prop_assert_eq!(got, whole);
        } else {
            prop_assert!(got.saturated);
            let (got, whole) = (got.given, whole.given);
            let area = got.roll_n * whole.pitch_n - got.pitch_n * whole.roll_n;
            prop_assert!(area.abs() <= 1e-4, "{got:?} is not along {whole:?}");
            prop_assert!(got.roll_n * whole.roll_n >= 0.0 && got.roll_n.abs() <= whole.roll_n.abs() * (1.0 + 8.0 * U));
        }
    }

    /// A larger roll demand never yields less roll on a symmetric frame.
    #[test]
    fn more_roll_demand_never_yields_less_roll(
        frame in prop::sample::select(vec![PLUS, cross()]),
        asked in prop::array::uniform4(-8.0_f32..8.0),
        more in 0.0_f32..8.0,
    ) {
        let mixer = mixer_of(frame, 3.0);
        let roll = |roll_n| mixer.inputs(&mixer.allocate(&Inputs { roll_n, ..inputs(asked) }).forces).roll_n;
        let [first, second] = [asked[0].abs(), asked[0].abs() + more].map(roll);
        prop_assert!(second >= first - 1e-5, "{first}, then {second}");
        let all = roll(f32::INFINITY);
        prop_assert!(all >= second - 1e-4, "{second}, then {all} for infinite roll");
    }

    /// Unallocated input of one axis is not reported for other axes, whose adaptation must go on.
    #[test]
    fn rounding_is_not_reported_as_missing(roll in -0.5_f32..0.5, pitch in -0.5_f32..0.5, yaw in 6.0_f32..50.0) {
        let missing = mixer(3.0).allocate(&inputs([roll, pitch, yaw, 4.8])).unallocated;
        prop_assert_eq!((missing.roll_n, missing.pitch_n, missing.thrust_n), (0.0, 0.0, 0.0));
        prop_assert!(missing.yaw_n > 1.0);
    }
}

/// In this case, rounding once left negative room for zero yaw, which gave 0/0, and every rotor stopped.
#[test]
fn zero_yaw_without_room_does_not_stop_the_rotors() {
    let frame = [
        Rotor { x: 0.7713504, y: 0.68169683, pushes_left: true },
        Rotor { x: -1.0259535, y: 0.70710677, pushes_left: false },
        Rotor { x: -0.6084402, y: -1.0598502, pushes_left: true },
        Rotor { x: 0.9079, y: -0.6907507, pushes_left: false },
    ];
    let got = mixer_of(frame, 0.5).allocate(&inputs([-2.7995617, -5.2674437, 0.0, 0.0]));
    assert!(got.saturated && (got.forces.0.max() - 0.5).abs() < 1e-6, "{}", got.forces.0);
}

#[test]
fn nan_becomes_no_force_and_infinity_the_largest() {
    let mixer = mixer(10.0);
    let all = mixer.allocate(&inputs([0.0, 0.0, 0.0, f32::NAN]));
    assert_eq!(all.forces.0, Vector4::zeros());
    assert!(all.saturated);
    // The other inputs are still given.
    let roll = mixer.allocate(&inputs([f32::NAN, 0.0, 0.0, 8.0]));
    assert_eq!(roll.forces.0, Vector4::repeat(2.0));
    assert!(roll.saturated);
    let roll = mixer.allocate(&inputs([f32::INFINITY, 0.0, 0.0, 8.0]));
    assert_eq!(roll.forces.0, Vector4::new(0.0, 5.0, 10.0, 5.0));
    // Thrust has priority over yaw.
    let opposed = mixer.allocate(&inputs([0.0, 0.0, f32::NEG_INFINITY, f32::INFINITY]));
    assert_eq!(opposed.forces.0, Vector4::repeat(10.0));
}

proptest! {
    /// The largest U1 or U2 at hover is given in full, alone and in both directions. Slightly more saturates in one of
    /// them. A vehicle that the rotors cannot lift has no authority.
    #[test]
    fn tilt_authority_is_the_largest_tilt_input_at_hover(
        frame in prop_oneof![Just(PLUS), Just(cross()), uneven()], weight_n in 0.5_f32..30.0,
    ) {
        let mixer = Mixer::new(airframe(frame), 3.0);
        prop_assume!(mixer.is_ok());
        let mixer = mixer.unwrap();
        let authority = mixer.tilt_authority_n(weight_n);
        for (index, most_n) in authority.into_iter().enumerate() {
            let saturates = |share: f32| [1.0, -1.0].map(|sign| {
                let mut asked = [0.0, 0.0, 0.0, weight_n];
                asked[index] = sign * share * most_n;
                mixer.allocate(&inputs(asked)).saturated
            });
            let hover = mixer.allocate(&inputs([0.0, 0.0, 0.0, weight_n]));
            if hover.saturated {
                prop_assert!(most_n < 1e-4, "{most_n} N of a vehicle that does not hover");
                continue;
            }
            prop_assert_eq!(saturates(0.999), [false; 2], "{} N are not given", most_n);
            // If hovering saturates with any more input, there is no room.
            let room = hover.forces.0.min().min(3.0 - hover.forces.0.max());
            prop_assert!(room < 1e-3 || most_n > 1e-4, "{most_n} N with {room} N of room");
            prop_assert!(room < 1e-3 || saturates(1.001).contains(&true), "more than {most_n} N is given");
        }
    }

    /// Rotors must give 1.3 times the force that carries the vehicle. The error names the sufficient force, rounded up.
    #[test]
    fn hover_takes_rotors_with_a_margin(
        frame in prop_oneof![Just(PLUS), Just(cross()), uneven()], weight_n in 0.5_f32..30.0, limit in 0.1_f32..12.0,
    ) {
        let mixer = Mixer::new(airframe(frame), limit);
        prop_assume!(mixer.is_ok());
        let mixer = mixer.unwrap();
        prop_assert_eq!(mixer.thrust_max_n(), 4.0 * limit);
        // `share` is the largest share that a rotor has of a pure thrust without limits.
        let free = Mixer::new(airframe(frame), 1e4).unwrap();
        let share = free.allocate(&inputs([0.0, 0.0, 0.0, 1.0])).forces.0.max();
        let needed_n = HOVER_MARGIN * weight_n * share;
        prop_assume!((needed_n / limit - 1.0).abs() > 1e-3);
        match mixer.check_hover(weight_n) {
            Ok(()) => prop_assert!(needed_n < limit),
            Err(error) => {
                prop_assert!(needed_n > limit);
                prop_assert_eq!((error.range.name, error.value), ("rotor_force_max_n", f64::from(limit)));
                let least = error.range.min as f32;
                prop_assert!((-1e-5..1.1e-4).contains(&(least - needed_n)), "{least} N for {needed_n} N");
                let able = Mixer::new(airframe(frame), least.next_up()).unwrap();
                prop_assert!(able.check_hover(weight_n).is_ok());
            }
        }
    }

    /// NaN in any input counts as zero. An input larger than any rotor gives counts as 1e9 N.
    #[test]
    fn what_is_too_large_to_matter_is_no_more(asked in prop::array::uniform4(-8.0_f32..8.0), index in 0..4_usize) {
        let mixer = mixer_of(UNEVEN, 3.0);
        let with = |value: f32| {
            let mut asked = asked;
            asked[index] = value;
            mixer.allocate(&inputs(asked))
        };
        let none = with(f32::NAN);
        prop_assert!(none.saturated);
        for (forces, wanted) in none.forces.0.iter().zip(with(0.0).forces.0.iter()) {
            prop_assert!((forces - wanted).abs() <= 1e-5, "{none:?}");
        }
        for sign in [1.0, -1.0] {
            prop_assert_eq!(with(sign * 1e30), with(sign * 1e9));
            prop_assert_eq!(with(sign * f32::INFINITY), with(sign * 1e9));
        }
    }

    /// omega of (6): speeds of rotors that push to positive yaw minus those of the others.
    #[test]
    fn the_residual_is_that_of_6(speeds in prop::array::uniform4(0.0_f32..1e3)) {
        let [w1, w2, w3, w4] = speeds;
        let residual = mixer(3.0).residual_rad_s(&RotorSpeeds(speeds.into()));
        prop_assert!((residual - (w1 - w2 + w3 - w4)).abs() <= 8.0 * U * 1e3, "{residual}");
    }
}

/// The setting is a share of the weight, without effect by default.
#[test]
fn the_largest_raised_thrust_is_a_share_of_the_weight() {
    let vehicle = Parameters::PAPER.to_f32();
    let thrust_n = |settings: Settings| {
        let mixer = settings.mixer(vehicle).unwrap();
        mixer.allocate(&inputs([3.0, 0.0, 0.0, 1.0])).given.thrust_n
    };
    let settings = Settings { rotor_force_max_n: 10.0, ..Settings::DEFAULT };
    // Two rotors give 0 and 3 N; the other two give as much together.
    assert_eq!(thrust_n(settings), 6.0);
    let share = 0.8;
    let limited = thrust_n(Settings { raised_thrust_max: share, ..settings });
    assert!((limited - share * vehicle.weight_n()).abs() < 1e-5, "{limited}");
}

#[test]
fn a_limit_out_of_range_is_refused_by_name() {
    let vehicle = Parameters::PAPER.to_f32();
    for limit in [0.0, -1.0, 2e4, f32::NAN, f32::INFINITY] {
        assert_eq!(Mixer::new(vehicle, limit).unwrap_err().range, Settings::FORCE_MAX.range);
    }
    let weightless = Parameters { mass_kg: 0.0, ..vehicle };
    assert_eq!(Mixer::new(weightless, 10.0).unwrap_err().range.name, "mass_kg");
}

#[test]
fn a_frame_that_cannot_fly_is_refused_by_name() {
    fn refused<const N: usize>(rotors: [Rotor; N]) -> afbc_types::Range {
        Mixer::new(airframe(rotors), 3.0).unwrap_err().range
    }
    for bad in [11.0, -11.0, f32::NAN, f32::INFINITY] {
        let [first, rest @ ..] = PLUS;
        let [second, third, fourth] = rest;
        assert_eq!(refused([Rotor { x: bad, ..first }, second, third, fourth]), ROTOR_POSITION);
        assert_eq!(refused([first, second, third, Rotor { y: bad, ..fourth }]), ROTOR_POSITION);
    }
    // The rotors all spin the same way, or are too few, or are all at one point.
    assert_eq!(refused(PLUS.map(|rotor| Rotor { pushes_left: true, ..rotor })), AUTHORITY);
    assert_eq!(refused(circle::<3>(0.1)), AUTHORITY);
    assert_eq!(refused(PLUS.map(|rotor| Rotor { x: 0.0, y: 0.0, ..rotor })), AUTHORITY);
    // The rotors are all on one line through the centre, at any angle and size.
    for angle in [0.0_f32, 0.3, 0.8, 1.1, FRAC_PI_2, 2.9] {
        for size in [1e-3_f32, 1.0, 7.3] {
            let at = |r: f32, pushes_left| Rotor { x: r * angle.cos(), y: r * angle.sin(), pushes_left };
            assert_eq!(
                refused([at(size, true), at(-size, false), at(0.37 * size, false), at(-0.61 * size, true)]),
                AUTHORITY
            );
        }
    }
    // The centre of mass is outside the rotors: one would have to pull down to hover.
    assert_eq!(refused(cross().map(|rotor| Rotor { x: rotor.x + 1.2, ..rotor })), THRUST_SHARE);
    // A small frame is accepted.
    assert!(Mixer::new(airframe(PLUS.map(|r| Rotor { x: 0.01 * r.x, y: 0.01 * r.y, ..r })), 3.0).is_ok());
}
