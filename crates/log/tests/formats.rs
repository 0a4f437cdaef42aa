//! Compares topics, fields and types with PX4's own.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

#[allow(dead_code, reason = "other tests need the rest")]
mod strict;

use afbc_log::ulog::TOPICS;
use std::collections::{BTreeMap, BTreeSet};
use strict::{FieldFormat, fields};

/// Formats of these topics in a log of PX4's simulator (September 2024, v1.15), without padding.
const PX4: &str = include_str!("px4_formats.txt");

#[test]
fn every_field_is_px4s() {
    let joined = PX4.replace("\n  ", " ");
    let formats: BTreeMap<&str, Vec<FieldFormat>> =
        joined.lines().map(|line| line.split_once(':').unwrap()).map(|(name, rest)| (name, fields(rest))).collect();
    let own = TOPICS.iter().filter(|topic| topic.name.starts_with("afbc_")).count();
    assert_eq!(formats.len() + own, TOPICS.len());
    for topic in TOPICS.iter().filter(|topic| !topic.name.starts_with("afbc_")) {
        for field in topic.fields.iter().filter(|field| !field.name.starts_with("_padding")) {
            let wanted = FieldFormat { kind: field.kind.into(), values: field.values, name: field.name.to_owned() };
            assert!(formats[topic.name].contains(&wanted), "{}: {wanted:?}", topic.name);
        }
    }
}

/// Each topic begins with its time and each name is unique. Each value is aligned as in a C struct, so readers need no
/// padding.
#[test]
fn layouts_are_sound() {
    let names: BTreeSet<_> = TOPICS.iter().map(|topic| topic.name).collect();
    assert_eq!(names.len(), TOPICS.len());
    for topic in &TOPICS {
        assert_eq!((topic.fields[0].name, topic.fields[0].kind), ("timestamp", "uint64_t"));
        assert_eq!(topic.fields.iter().map(|field| field.name).collect::<BTreeSet<_>>().len(), topic.fields.len());
        let mut at = 0;
        for field in topic.fields {
            let size = match field.kind {
                "uint64_t" | "double" => 8,
                // The size of `esc_report`, padded to a multiple of 8 bytes.
                "esc_report" => 40,
                "uint32_t" | "int32_t" | "float" => 4,
                "uint16_t" => 2,
                "uint8_t" | "int8_t" | "bool" => 1,
                other => panic!("{other}"),
            };
            assert_eq!(at % size.min(8), 0, "{}: {}", topic.name, field.name);
            at += size * field.values.unwrap_or(1);
        }
    }
}
