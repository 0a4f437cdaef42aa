//! Describes a vehicle to stations: files of MAVLink's component metadata.
//!
//! See <https://mavlink.io/en/services/component_information.html>. QGroundControl reads version 1 of both files.

use afbc_comms::services::ftp::crc32;
use afbc_mavlink::ComponentMetadata;
use afbc_onboard::parameters::{Kind, Parameter, ParameterTable};
use afbc_types::Declaration;
use serde_json::{Map, Value, json};

/// The metadata files of a vehicle.
#[derive(Clone, Debug)]
pub struct MetadataFiles {
    /// Name and content of each file.
    pub files: Vec<(String, Vec<u8>)>,
    /// Location and checksum of the first file, for stations.
    pub general: ComponentMetadata,
}

const GENERAL: &str = "general.json";
const PARAMETERS: &str = "parameters.json";
/// MAVLink's `COMP_METADATA_TYPE_PARAMETER`.
const PARAMETER_TYPE: u8 = 1;
/// Number of significant digits in a shown default value.
const DIGITS: i32 = 4;

impl MetadataFiles {
    /// Returns the metadata of a vehicle with this name and these parameters.
    pub fn new(vehicle: &str, table: &ParameterTable) -> Self {
        let parameters = parameters(table).to_string().into_bytes();
        let general = json!({
            "version": 1,
            "vendorName": "AFBC",
            "modelName": vehicle,
            "firmwareVersion": env!("CARGO_PKG_VERSION"),
            "metadataTypes": [{ "type": PARAMETER_TYPE, "uri": uri(PARAMETERS), "fileCrc": crc32(0, &parameters) }],
        });
        let bytes = general.to_string().into_bytes();
        let general = ComponentMetadata::at(&uri(GENERAL), crc32(0, &bytes));
        MetadataFiles { files: vec![(GENERAL.into(), bytes), (PARAMETERS.into(), parameters)], general }
    }
}

fn uri(file: &str) -> String {
    format!("mftp://etc/{file}")
}

/// Returns the parameters' metadata, from their declarations.
fn parameters(table: &ParameterTable) -> Value {
    let mut declared = Vec::new();
    table.show_declarations(|declaration, words| declared.push((*declaration, words)));
    let all = table.iter().zip(&declared).map(|(parameter, (declaration, words))| {
        let default = table.default_of(parameter.name).unwrap_or(parameter);
        described(&default, declaration, words)
    });
    json!({ "version": 1, "parameters": all.collect::<Vec<_>>() })
}

fn described(parameter: &Parameter, declaration: &Declaration, words: &[&str]) -> Value {
    let Declaration { range, unit, meaning, .. } = declaration;
    let name = parameter.name.as_str();
    let mut described = Map::new();
    let mut put = |key: &str, value: Value| described.insert(key.into(), value);
    let is_whole = parameter.kind == Kind::Int32;
    // Uses the shortest digits of the f32; a whole number has no fraction.
    let default = parameter.value.to_string().parse::<f64>().unwrap_or_default();
    let number = |number: f64| if is_whole { json!(number as i64) } else { json!(number) };
    put("name", json!(name));
    put("type", json!(if is_whole { "Int32" } else { "Float" }));
    put("default", number(default));
    put("min", number(range.min));
    put("max", number(range.max));
    put("group", json!(name.split('_').next().unwrap_or(name)));
    let (short, rest) = meaning.split_once(". ").unwrap_or((meaning.trim_end_matches('.'), ""));
    put("shortDesc", json!(short));
    if !rest.is_empty() {
        put("longDesc", json!(meaning));
    }
    if !["", "1", "number"].contains(unit) {
        put("units", json!(unit));
    }
    // A default of zero shows no decimals, so the range gives their number instead.
    if !is_whole {
        put("decimalPlaces", json!(decimals(if default == 0.0 { range.max.min(1.0) } else { default })));
    }
    // A declaration says only in its text that a change needs a restart.
    if meaning.contains("from the next start on") {
        put("rebootRequired", json!(true));
    }
    if !words.is_empty() {
        let value = |(number, word): (i64, &&str)| json!({ "value": number, "description": word });
        put("values", (range.min as i64..).zip(words).map(value).collect());
    }
    Value::Object(described)
}

/// Returns the number of decimals that shows [`DIGITS`] significant digits, at least two.
fn decimals(number: f64) -> i32 {
    let exponent = number.abs().log10().floor();
    (DIGITS - 1 - exponent as i32).clamp(2, 15)
}
