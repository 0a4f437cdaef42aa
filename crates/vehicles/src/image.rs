//! A vehicle as Rust, for the firmware's build script.

use crate::vehicle::Vehicle;
use afbc_onboard::Configuration;
use afbc_types::{Airframe, with_rotors};
use serde_json::{Value, json};
use std::fmt::Write;

impl Vehicle {
    /// Returns the constants `NAME`, `ROTORS` and `CONFIGURATION` as Rust: what the
    /// [configuration](Self::configuration) holds, value by value. The link is left at its defaults, since it is not
    /// the vehicle's.
    pub fn image(&self) -> String {
        let (name, count) = (&self.name, self.rotors.len());
        let mut text = format!(
            "/// Name of the vehicle.\npub const NAME: &str = {name:?};\n\
             /// Number of its rotors.\npub const ROTORS: usize = {count};\n\
             /// What its file says.\npub const CONFIGURATION: Configuration = {{\n    let mut it = PLAIN;\n"
        );
        each_value("it", &with_rotors!(count, N => self.values::<N>()), &mut text);
        text + "    it\n};\n"
    }

    /// Returns the values of the configuration, by field.
    fn values<const N: usize>(&self) -> Value {
        // As many rotors as there are: with_rotors.
        let Ok(configuration) = self.configuration::<N>() else { return Value::Null };
        // Errors of sensors are one vehicle's, not its kind's, and so are motor controllers; link and radio are the
        // board's.
        let Configuration {
            airframe,
            settings,
            gains,
            curve,
            response,
            outputs: _,
            escs: _,
            imu,
            calibration: _,
            estimation,
            arming,
            guidance,
            radio: _,
            link: _,
        } = configuration;
        let Airframe { parameters, rotors } = airframe;
        json!({
            "airframe": { "parameters": parameters, "rotors": rotors.as_slice() },
            "settings": settings, "gains": gains, "curve": curve, "response": response, "imu": imu,
            "estimation": estimation, "arming": arming, "guidance": guidance,
        })
    }
}

/// Assigns every value to its place.
fn each_value(place: &str, value: &Value, text: &mut String) {
    let literal = match value {
        Value::Object(fields) => {
            return fields.iter().for_each(|(field, value)| each_value(&format!("{place}.{field}"), value, text));
        }
        Value::Array(items) => match items.as_slice() {
            [x @ Value::Number(_), y, z] => format!("Vector3::new({}, {}, {})", literal(x), literal(y), literal(z)),
            items => {
                let items = items.iter().enumerate();
                return items.for_each(|(index, value)| each_value(&format!("{place}[{index}]"), value, text));
            }
        },
        value => literal(value),
    };
    // Writing to a string does not fail.
    let _ = writeln!(text, "    {place} = {literal};");
}

/// Returns a number, a switch, or the word of a choice.
fn literal(value: &Value) -> String {
    match (value, value.as_f64()) {
        (Value::Number(number), Some(wide)) if number.is_f64() => {
            // The shortest decimal that is the same number.
            let narrow = wide as f32;
            if f64::from(narrow) == wide { format!("{narrow:?}") } else { format!("{wide:?}") }
        }
        (Value::String(word), _) => format!("choice({word:?})"),
        (value, _) => value.to_string(),
    }
}
