//! Tests of throttles, DSHOT frames and waveforms.

use afbc_flight_core::dshot::{DshotFrame, DshotRate, Timing};
use afbc_flight_core::motor::{Curve, Motor};
use afbc_flight_core::timer_clock::TimerClock;
use afbc_types::RotorSpeeds;
use nalgebra::Vector4;
use proptest::prelude::*;

fn motor(linearity: f32, idle: f32) -> Motor {
    Motor::new(Curve { speed_max_rad_s: 1000.0, linearity, idle }).expect("valid")
}

fn timing(timer_hz: u32, rate: DshotRate) -> Timing {
    Timing::new(TimerClock::new(timer_hz).expect("valid"), rate)
}

#[test]
fn throttle_by_hand() {
    // Columns: k, speed, throttle. With the speed's share s, u = s for k = 1; u = s^2 for k = 0; 0.5 u^2 + 0.5 u = s^2
    // for k = 0.5.
    for (k, speed, throttle) in [
        (1.0, 0.0, 48),
        (1.0, 500.0, 1048), // 48 + 0.5 * 1999 = 1047.5
        (1.0, 1000.0, 2047),
        (0.0, 0.0, 48),
        (0.0, 500.0, 548), // 48 + 0.25 * 1999 = 547.75
        (0.0, 1000.0, 2047),
        (0.5, 500.0, 780), // u = 0.36603, 48 + 731.7 = 779.7
        (0.5, 1000.0, 2047),
    ] {
        assert_eq!(motor(k, 0.0).throttle(speed), throttle, "k = {k}, {speed} rad/s");
    }
}

#[test]
fn disarmed_motors_get_zero_and_armed_ones_never_less_than_idle() {
    let motor = motor(1.0, 0.05);
    for speeds in [[0.0; 4], [500.0; 4], [f32::NAN; 4], [f32::INFINITY; 4], [-1.0; 4]] {
        let speeds = RotorSpeeds(Vector4::from(speeds));
        assert_eq!(motor.throttles(false, &speeds), [0; 4]);
        assert!(motor.throttles(true, &speeds).into_iter().all(|throttle| (148..=2047).contains(&throttle)));
    }
    let speeds = RotorSpeeds(Vector4::new(100.0, 200.0, 300.0, 400.0));
    assert_eq!(motor.throttles(true, &speeds), [248, 448, 648, 848]);
    assert_eq!(motor.throttle(f32::NAN), 148);
}

#[test]
fn curves_are_validated_by_name() {
    for (speed_max_rad_s, linearity, idle, name) in [
        (0.0, 1.0, 0.0, "speed_max_rad_s"),
        (1000.0, 1.1, 0.0, "linearity"),
        (1000.0, f32::NAN, 0.0, "linearity"),
        (1000.0, 1.0, 0.5, "idle"),
    ] {
        let refused = Motor::new(Curve { speed_max_rad_s, linearity, idle });
        assert_eq!(refused.map_err(|error| error.range.name), Err(name));
    }
}

#[test]
fn frames_by_hand() {
    for (throttle, bits) in [
        (0, 0x0000),
        // 1046 = 0b100_0001_0110: 0x82C without telemetry, checksum 8 ^ 2 ^ C = 6.
        (1046, 0x82C6),
        // 48: 0x060, checksum 0 ^ 6 ^ 0 = 6.
        (48, 0x0606),
        // 2047: 0xFFE, checksum F ^ F ^ E = E.
        (2047, 0xFFEE),
        // Commands and invalid throttles stop the motor.
        (1, 0x0000),
        (47, 0x0000),
        (2048, 0x0000),
        (u16::MAX, 0x0000),
    ] {
        assert_eq!(DshotFrame::new(throttle).bits(), bits, "{throttle}");
    }
    // 1046 with telemetry: 0x82D, checksum 8 ^ 2 ^ D = 7. Telemetry can be requested with a stopped motor, too.
    assert_eq!(DshotFrame::new(1046).asking().bits(), 0x82D7);
    assert_eq!(DshotFrame::new(1046).asking().asking().bits(), 0x82D7);
    assert_eq!(DshotFrame::new(0).asking().bits(), 0x0011);
    // In bidirectional DSHOT, the frame of 1046 has the checksum 9 instead of 6.
    assert_eq!(DshotFrame::new(1046).bidirectional().bits(), 0x82C9);
}

#[test]
fn the_waveform_of_a_frame() {
    // An STM32F405 at 168 MHz: timers of the first bus at 84 MHz, 140 counts per bit.
    let timing = timing(84_000_000, DshotRate::Dshot600);
    assert_eq!(timing.period(), 140);
    let (one, zero) = (105, 53);
    let waveform = timing.waveform(DshotFrame::new(1046)); // 1000 0010 1100 0110
    assert_eq!(
        waveform,
        [
            one, zero, zero, zero, zero, zero, one, zero, one, one, zero, zero, zero, one, one, zero, //
            0
        ]
    );
}

#[test]
fn pulses_last_as_long_as_they_should_at_every_usual_clock() {
    // Period and pulse lengths of DSHOT [ns].
    let rates = [
        (DshotRate::Dshot600, [1666.7, 1250.0, 625.0]),
        (DshotRate::Dshot300, [3333.3, 2500.0, 1250.0]),
        (DshotRate::Dshot150, [6666.7, 5000.0, 2500.0]),
    ];
    for (timer_hz, (rate, [bit_ns, one_ns, zero_ns])) in [8_000_000, 72_000_000, 84_000_000, 168_000_000, 480_000_000]
        .into_iter()
        .flat_map(|hz| rates.map(|it| (hz, it)))
    {
        let timing = timing(timer_hz, rate);
        let count_ns = 1e9 / f64::from(timer_hz);
        let [one, .., zero, low] = timing.waveform(DshotFrame::new(1046));
        let long = |counts: u16| f64::from(counts) * count_ns;
        assert!((long(timing.period()) - bit_ns).abs() <= 0.51 * count_ns, "{timer_hz}");
        assert!((long(one) - one_ns).abs() <= 0.51 * count_ns, "{timer_hz}");
        assert!((long(zero) - zero_ns).abs() <= 0.51 * count_ns, "{timer_hz}");
        assert_eq!(low, 0);
    }
    for timer_hz in [0, 1_000_000, 600_000_000, u32::MAX] {
        assert!(TimerClock::new(timer_hz).is_err());
    }
}

proptest! {
    /// A higher speed never gives less throttle.
    #[test]
    fn monotone(a in 0.0f32..2000.0, b in 0.0f32..2000.0, k in 0.0f32..=1.0, idle in 0.0f32..0.3) {
        let motor = motor(k, idle);
        let (slow, fast) = (a.min(b), a.max(b));
        prop_assert!(motor.throttle(slow) <= motor.throttle(fast));
    }

    /// The curve converts the throttle back to the speed, within half a step.
    #[test]
    fn inverts_the_curve(speed in 0.0f32..1000.0, k in 0.0f32..=1.0) {
        let u_of = |steps: f64| (steps / 1999.0).clamp(0.0, 1.0);
        let k_ = f64::from(k);
        let speed_at = |u: f64| 1000.0 * (k_ * u * u + (1.0 - k_) * u).sqrt();
        let steps = f64::from(motor(k, 0.0).throttle(speed)) - 48.0;
        prop_assert!(speed_at(u_of(steps - 0.51)) <= f64::from(speed) + 1e-3);
        prop_assert!(speed_at(u_of(steps + 0.51)) >= f64::from(speed) - 1e-3);
    }

    /// Frames pass a receiver's check, and the waveform has the frame's bits.
    #[test]
    fn waveforms_decode(throttle in 48u16..=2047, asks in any::<bool>()) {
        let timing = timing(84_000_000, DshotRate::Dshot600);
        let frame = DshotFrame::new(throttle);
        let pulses = timing.waveform(if asks { frame.asking() } else { frame });
        let bits = pulses.iter().take(16).fold(0u16, |bits, &pulse| bits << 1 | u16::from(pulse > 79));
        prop_assert_eq!((bits >> 5, bits >> 4 & 1), (throttle, u16::from(asks)));
        prop_assert_eq!((bits ^ bits >> 4 ^ bits >> 8 ^ bits >> 12) & 0xF, 0);
    }

    /// Bidirectional frames differ in their checksums only.
    #[test]
    fn rows_become_bidirectional(
        throttles in prop::array::uniform4(0u16..=2047), asked in prop::option::of(0_usize..4),
    ) {
        let timing = Timing::new(TimerClock::new(168_000_000).unwrap(), DshotRate::Dshot600);
        let mut rows = [[0_u32; 4]; 17];
        timing.rows(throttles, asked, &mut rows);
        timing.complement_checksums(&mut rows);
        for (motor, throttle) in throttles.into_iter().enumerate() {
            let frame = DshotFrame::new(throttle);
            let frame = if asked == Some(motor) { frame.asking() } else { frame };
            let column = rows.map(|row| row[motor] as u16);
            prop_assert_eq!(column, timing.waveform(frame.bidirectional()));
        }
    }

    /// The four columns of a burst are the motors' waveforms, whatever the rows contained before.
    #[test]
    fn rows_are_waveforms_side_by_side(
        throttles in any::<[u16; 4]>(), before in any::<u16>(), asked in proptest::option::of(0..6_usize),
    ) {
        let timing = timing(168_000_000, DshotRate::Dshot600);
        let mut rows = [[before; 4]; 17];
        timing.rows(throttles, asked, &mut rows);
        let mut frames = throttles.map(DshotFrame::new);
        for (_, frame) in frames.iter_mut().enumerate().filter(|(at, _)| asked == Some(*at)) {
            *frame = frame.asking();
        }
        let waveforms = frames.map(|frame| timing.waveform(frame));
        for (column, waveform) in waveforms.iter().enumerate() {
            let played = rows.map(|row| row.get(column).copied().unwrap_or_default());
            prop_assert_eq!(&played, waveform);
        }
    }
}
