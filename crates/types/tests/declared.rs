//! Tests of structs made by [`parameters!`].
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // tests

use afbc_types::{Axis, Choice, Declared, DeclaredValue, DeclaredValueMut, PerAxis, Range, parameters};
use core::convert::Infallible;
use nalgebra::Vector3;

parameters! {
    /// Nested.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Inner {
        /// First.
        #[parameter(FIRST, "m", 0.0..=1.0)]
        pub first_m: f32 = 0.1,
        /// Second, on
        /// two lines.
        #[parameter(SECOND, "1", -1.0..=1.0, tuned)]
        pub second: f32 = -0.5,
    }
    together(inner) {
        Range { max: inner.first_m.into(), ..Inner::SECOND.range }.check(inner.second)
    }
}

/// A choice of three, numbered from 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    /// Up.
    Up,
    /// Down.
    Down,
    /// Across.
    Across,
}

impl Choice for Way {
    const ALL: &'static [Self] = &[Way::Up, Way::Down, Way::Across];
    const WORDS: &'static [&'static str] = &["up", "down", "across"];
    const FIRST: u8 = 1;
}

parameters! {
    /// One field of every kind.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Outer {
        /// Flag.
        #[switch(FLAG)]
        pub flag: bool = true,
        /// Vector.
        #[parameter(VECTOR, "kg m2", 1e-6..=10.0)]
        pub vector_kg_m2: Vector3<f64> = Vector3::new(1.0, 2.0, 3.0),
        /// Joins.
        #[group("")]
        pub joined: Inner = Inner::DEFAULT,
        /// Stays apart.
        #[group("apart")]
        pub apart: Inner = Inner { first_m: 0.2, ..Inner::DEFAULT },
        /// No parameter.
        pub list: Vec<u8> = Vec::new(),
        /// One per axis.
        #[parameter(EACH, "N", 0.0..=f64::INFINITY)]
        pub each_n: PerAxis<f32> = PerAxis { roll: 1.0, pitch: 2.0, yaw: 3.0, z: 4.0, x: 5.0, y: 6.0 },
        /// Whole number.
        #[parameter(COUNT, "number", 2.0..=9.0)]
        pub count: u32 = 4,
        /// One of three.
        #[choice(WAY)]
        pub way: Way = Way::Down,
    }
}

parameters! {
    /// In either precision.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Either<T = f32, f64> {
        /// Mass.
        #[parameter(MASS, "kg", 0.1..=1.0)]
        pub mass_kg: T = 0.3,
        /// Inertia.
        #[parameter(INERTIA, "kg m2", 0.1..=1.0)]
        pub inertia_kg_m2: Vector3<T> = Vector3::new(0.1, 0.2, 0.3),
    }
}

/// Returns name, key and numbers of each parameter in the order of the visit. A switch is 0 or 1.
fn listed(group: &impl Declared) -> Vec<(String, &'static str, Vec<f64>)> {
    let mut list = Vec::new();
    let Ok(()) = group.visit(&mut |declaration, value| {
        let numbers = match value {
            DeclaredValue::Switch(on) => vec![f64::from(u8::from(on))],
            DeclaredValue::Choice(index, _) => vec![declaration.range.min + index as f64],
            value => value.numbers().collect(),
        };
        list.push((declaration.name("P_", None).to_string(), declaration.range.name, numbers));
        Ok::<(), Infallible>(())
    });
    list
}

#[test]
fn a_visit_shows_every_parameter_in_order_of_declaration() {
    let names = |group: &Outer| listed(group).into_iter().map(|(name, ..)| name).collect::<Vec<_>>().join(" ");
    assert_eq!(
        names(&Outer::DEFAULT),
        "P_FLAG P_VECTOR P_FIRST P_SECOND P_APART_FIRST P_APART_SECOND \
         P_ROLL_EACH P_PITCH_EACH P_YAW_EACH P_Z_EACH P_X_EACH P_Y_EACH P_COUNT P_WAY"
    );
    let list = listed(&Outer::DEFAULT);
    let single = |number: f32| vec![f64::from(number)];
    assert_eq!(list[0], ("P_FLAG".into(), "flag", vec![1.0]));
    assert_eq!(list[1], ("P_VECTOR".into(), "vector_kg_m2", vec![1.0, 2.0, 3.0]));
    assert_eq!(list[2], ("P_FIRST".into(), "first_m", single(0.1)));
    assert_eq!(list[4], ("P_APART_FIRST".into(), "first_m", single(0.2)));
    assert_eq!(list[11], ("P_Y_EACH".into(), "each_n", single(6.0)));
    assert_eq!(list[12..], [("P_COUNT".into(), "count", vec![4.0]), ("P_WAY".into(), "way", vec![2.0])]);
    assert_eq!((Outer::WAY.range, Outer::WAY.unit), (Range::new("way", 1.0, 3.0), "number"));
    assert_eq!(Outer::VECTOR.name("V_", Some('X')).to_string(), "V_VECTOR_X");
}

#[test]
fn a_declaration_holds_all_that_was_written() {
    let second = Inner::SECOND;
    assert_eq!((second.id, second.unit, second.meaning), ("SECOND", "1", "Second, on two lines."));
    assert_eq!(second.range, Range::new("second", -1.0, 1.0));
    assert!(second.tuned && !Inner::FIRST.tuned && !Outer::FLAG.tuned);
    assert_eq!(Inner::default(), Inner { first_m: 0.1, second: -0.5 });
}

/// Returns `Outer` with the number `coordinate` of parameter `target` just outside one end of its range; `None` if
/// there is no such number.
fn past(target: usize, coordinate: usize, above: bool) -> Option<(Outer, Range)> {
    let (mut group, mut at, mut found) = (Outer::DEFAULT, 0, None);
    let Ok(()) = group.visit_mut(&mut |declaration, value| {
        let Range { min, max, .. } = declaration.range;
        let past = if above { max + 1.0 } else { min - 1.0 };
        if at == target && past.is_finite() {
            let changed = match value {
                DeclaredValueMut::Single(numbers) => numbers.get_mut(coordinate).map(|number| *number = past as f32),
                DeclaredValueMut::Double(numbers) => numbers.get_mut(coordinate).map(|number| *number = past),
                DeclaredValueMut::Whole(number) if coordinate == 0 => {
                    *number = past as u32;
                    Some(())
                }
                _ => None,
            };
            found = changed.map(|()| declaration.range);
        }
        at += 1;
        Ok::<(), Infallible>(())
    });
    found.map(|range| (group, range))
}

#[test]
fn every_number_out_of_range_is_named() {
    let mut checked = 0;
    for (target, coordinate) in (0..14).flat_map(|target| (0..3).map(move |coordinate| (target, coordinate))) {
        for (group, range) in [true, false].into_iter().filter_map(|above| past(target, coordinate, above)) {
            assert_eq!(group.validate().unwrap_err().range, range);
            checked += 1;
        }
    }
    // Eight numbers have two limits each: three of the vector, four of the nested structs, and a whole number. Six axes
    // have one limit each.
    assert_eq!(checked, 2 * (3 + 4 + 1) + 6);
    let nan = Outer { vector_kg_m2: Vector3::new(1.0, f64::NAN, 1.0), ..Outer::DEFAULT };
    assert_eq!(nan.validate().unwrap_err().range, Outer::VECTOR.range);
}

#[test]
fn parameters_that_limit_one_another_are_checked_at_every_depth() {
    assert_eq!(Outer::DEFAULT.validate(), Ok(()));
    let uneven = Inner { first_m: 0.1, second: 0.2 };
    let error = uneven.validate().unwrap_err();
    assert_eq!((error.range.name, error.range.max as f32), ("second", 0.1));
    assert_eq!(Outer { joined: uneven, ..Outer::DEFAULT }.validate(), Err(error));
    assert_eq!(Outer { apart: uneven, ..Outer::DEFAULT }.validate(), Err(error));
    for axis in Axis::ALL {
        let mut axes = PerAxis::from_fn(|_| Inner::DEFAULT);
        assert_eq!(axes.validate(), Ok(()));
        axes[axis].second = 0.2;
        assert_eq!(axes.validate(), Err(error));
        // Ranges are checked before parameters that limit each other, at any depth.
        axes[axis.next()].first_m = 2.0;
        assert_eq!(axes.validate().unwrap_err().range, Inner::FIRST.range);
    }
}

#[test]
fn a_visitor_changes_what_it_is_shown_and_may_stop() {
    let mut axes = PerAxis::from_fn(|_| Inner::DEFAULT);
    let mut seen = 0;
    let stopped = axes.visit_mut(&mut |declaration, value| {
        seen += 1;
        match value {
            DeclaredValueMut::Single([number]) if declaration.group != "yaw" => *number = seen as f32,
            _ => return Err(declaration.name("", None).to_string()),
        }
        Ok(())
    });
    assert_eq!((stopped, seen), (Err("YAW_FIRST".into()), 5));
    assert_eq!((axes.roll, axes.pitch.second), (Inner { first_m: 1.0, second: 2.0 }, 4.0));
    assert_eq!((axes.yaw, axes.z), (Inner::DEFAULT, Inner::DEFAULT));
}

/// Choices are set by the index of their word. An index beyond the words changes nothing.
#[test]
fn a_choice_is_one_of_its_words() {
    let mut group = Outer::DEFAULT;
    for (index, way) in [(0, Way::Up), (2, Way::Across), (3, Way::Across), (1, Way::Down)] {
        let Ok(()) = group.visit_mut(&mut |_, value| {
            if let DeclaredValueMut::Choice(at, words) = value {
                assert_eq!(words, ["up", "down", "across"]);
                *at = index;
            }
            Ok::<(), Infallible>(())
        });
        assert_eq!(group.way, way);
    }
}

#[test]
fn a_group_may_serve_both_precisions() {
    let wide = Either::DEFAULT;
    let narrow = Either::<f32> { mass_kg: 0.3, inertia_kg_m2: Vector3::new(0.1, 0.2, 0.3) };
    assert_eq!((wide.validate(), narrow.validate()), (Ok(()), Ok(())));
    assert_eq!(listed(&wide)[0].2, [0.3]);
    assert_eq!(listed(&narrow)[0].2, [f64::from(0.3_f32)]);
    assert_eq!(Either::<f32>::INERTIA, Either::<f64>::INERTIA);
    // The ends of a range are compared in `f32`: a decimal bound in a file must pass after rounding.
    assert_eq!(Either { mass_kg: 0.1_f32, ..narrow }.validate(), Ok(()));
    assert!(Either { mass_kg: 0.1_f32.next_down(), ..narrow }.validate().is_err());
}
