//! Drivers of barometers and magnetometers never panic, and their readings stay within the data sheet's range, whatever
//! the part answers.

use afbc_drivers::bmp3::{Bmp388, Bmp390};
use afbc_drivers::bmp280::Bmp280;
use afbc_drivers::dps310::{Dps310, Spl06};
use afbc_drivers::ist8310::Ist8310;
use afbc_drivers::lis3mdl::Lis3mdl;
use afbc_drivers::ms5611::Ms5611;
use afbc_drivers::qmc5883l::Qmc5883l;
use afbc_drivers::{MagneticReading, PartFault, PressureReading, ScriptStep, SensorPart};
use nalgebra::Vector3;
use proptest::array::uniform8;
use proptest::collection::vec;
use proptest::prelude::*;

/// Returns registers with answers of any length; many are reads of the part's scripts.
fn answers<P: SensorPart>() -> impl Strategy<Value = Vec<(u8, Vec<u8>)>> {
    let reads = P::SETUP.iter().chain(P::CYCLE).filter_map(|step| match step {
        ScriptStep::Read(register, length) => Some((*register, *length)),
        _ => None,
    });
    let reads: Vec<(u8, usize)> = reads.collect();
    let of_a_script =
        prop::sample::select(reads).prop_flat_map(|(register, length)| (Just(register), vec(any::<u8>(), length)));
    vec(prop_oneof![4 => of_a_script, 1 => (any::<u8>(), vec(any::<u8>(), 0..=32))], 1..40)
}

fn give<P: SensorPart>(part: &mut P, answers: &[(u8, Vec<u8>)]) -> Vec<P::Reading> {
    answers.iter().filter_map(|(register, answer)| part.take(*register, answer).ok().flatten()).collect()
}

fn pressures(readings: &[PressureReading], [min_pa, max_pa]: [f32; 2]) {
    for PressureReading { pressure_pa, temperature_c } in readings {
        assert!((min_pa..=max_pa).contains(pressure_pa) && (-40.0..=85.0).contains(temperature_c), "{readings:?}");
    }
}

fn fields(readings: &[MagneticReading], max_ut: [f32; 3]) {
    for MagneticReading { field_ut } in readings {
        assert!(field_ut.abs().zip_map(&Vector3::from(max_ut), |ut, max_ut| ut <= max_ut).iter().all(|is| *is));
    }
}

/// Tries all values of the masked bits in one byte, until the part accepts the checksum.
fn with_checksum<P: SensorPart>(part: &mut P, register: u8, answer: &mut [u8], at: usize, mask: u8) {
    let is_taken = (0..=mask).any(|check| {
        answer[at] = answer[at] & !mask | check;
        matches!(part.take(register, answer), Ok(None))
    });
    assert!(is_taken, "no checksum is right");
}

proptest! {
    #[test]
    fn any_answers_are_survived(
        dps310 in answers::<Dps310>(),
        bmp388 in answers::<Bmp388>(),
        bmp280 in answers::<Bmp280>(),
        ms5611 in answers::<Ms5611>(),
        qmc5883l in answers::<Qmc5883l>(),
        ist8310 in answers::<Ist8310>(),
        lis3mdl in answers::<Lis3mdl>(),
    ) {
        pressures(&give(&mut Dps310::default(), &dps310), [30_000.0, 120_000.0]);
        pressures(&give(&mut Spl06::default(), &dps310), [30_000.0, 120_000.0]);
        pressures(&give(&mut Bmp388::default(), &bmp388), [30_000.0, 125_000.0]);
        pressures(&give(&mut Bmp390::default(), &bmp388), [30_000.0, 125_000.0]);
        pressures(&give(&mut Bmp280::default(), &bmp280), [30_000.0, 110_000.0]);
        pressures(&give(&mut Ms5611::default(), &ms5611), [1_000.0, 120_000.0]);
        fields(&give(&mut Qmc5883l, &qmc5883l), [800.0; 3]);
        fields(&give(&mut Ist8310, &ist8310), [1_600.0, 1_600.0, 2_480.0]);
        fields(&give(&mut Lis3mdl, &lis3mdl), [400.0; 3]);
    }

    /// Barometers survive any calibration whose checksum is correct, and any raw values.
    #[test]
    fn any_calibration_is_survived(
        coefficients in vec(any::<u8>(), 18),
        mut trim in vec(any::<u8>(), 22),
        prom in uniform8(1_u16..),
        raw in vec((any::<[u8; 6]>(), any::<bool>()), 1..40),
    ) {
        let mut part = Dps310::default();
        for _ in 0..2 {
            prop_assert_eq!(part.take(0x10, &coefficients), Ok(None));
        }
        let answers: Vec<_> = raw.iter().map(|(raw, _)| (0x00, raw.to_vec())).collect();
        pressures(&give(&mut part, &answers), [30_000.0, 120_000.0]);

        let mut part = Bmp280::default();
        for _ in 0..2 {
            prop_assert_eq!(part.take(0x88, &[&coefficients[..], &trim[..6]].concat()), Ok(None));
        }
        let answers: Vec<_> = raw.iter().map(|(raw, _)| (0xF7, raw.to_vec())).collect();
        pressures(&give(&mut part, &answers), [30_000.0, 110_000.0]);

        let mut part = Bmp388::default();
        with_checksum(&mut part, 0x30, &mut trim, 0, 0xFF);
        let answers: Vec<_> = raw.iter().map(|(raw, _)| (0x04, raw.to_vec())).collect();
        pressures(&give(&mut part, &answers), [30_000.0, 125_000.0]);

        let mut part = Ms5611::default();
        for (command, word) in (0xA0..0xAE).step_by(2).zip(prom) {
            prop_assert_eq!(part.take(command, &word.to_be_bytes()), Ok(None));
        }
        let mut last = prom[7].to_be_bytes();
        with_checksum(&mut part, 0xAE, &mut last, 1, 0x0F);
        let answers: Vec<_> = raw.iter().flat_map(|(raw, is_cut)| {
            let cycle = [(0xAE, last.to_vec()), (0x00, raw[..3].to_vec()), (0x00, raw[3..].to_vec())];
            cycle.into_iter().take(if *is_cut { 2 } else { 3 })
        }).collect();
        pressures(&give(&mut part, &answers), [1_000.0, 120_000.0]);
    }
}

/// Extreme coefficients and samples, which give the largest intermediate integers.
#[test]
fn the_largest_numbers_of_a_ms5611_fit() {
    for bits in 0..64_u32 {
        let word = |at: u32| if bits >> at & 1 == 1 { 0xFFFF } else { 1_u16 };
        let mut part = Ms5611::default();
        for (at, command) in (0..7).zip((0xA0..).step_by(2)) {
            // The first word is not a coefficient.
            assert_eq!(part.take(command, &word(if at == 0 { 0 } else { at - 1 }).to_be_bytes()), Ok(None));
        }
        let mut last = [0x12, 0x30];
        with_checksum(&mut part, 0xAE, &mut last, 1, 0x0F);
        for (d2, d1) in [(1_u32, 1_u32), (1, 0xFF_FFFF), (0xFF_FFFF, 1), (0xFF_FFFF, 0xFF_FFFF)] {
            assert_eq!(part.take(0x00, &d2.to_be_bytes()[1..]), Ok(None));
            let reading = part.take(0x00, &d1.to_be_bytes()[1..]);
            assert!(matches!(reading, Ok(Some(_)) | Err(PartFault::Range)), "{reading:?}");
        }
    }
}
