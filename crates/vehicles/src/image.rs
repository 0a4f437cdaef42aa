//! Vehicle as Rust source, for the firmware's build script.

use crate::vehicle::Vehicle;
use afbc_onboard::Configuration;
use afbc_types::Rotor;
use serde_json::{Value, json};
use std::fmt::Write;

impl Vehicle {
    /// Returns Rust source with the constants `NAME`, `ROTORS` and `CONFIGURATION`; the last assigns every value of the
    /// [configuration](Self::configuration). The link keeps its defaults, since it belongs to the board.
    pub fn image(&self) -> String {
        let (name, count) = (&self.name, self.rotors.len());
        let frame: Vec<_> = self.rotors.iter().map(Rotor::to_f32).collect();
        let mut text = format!(
            "/// Name of the vehicle.\npub const NAME: &str = {name:?};\n\
             /// Number of its rotors.\npub const ROTORS: usize = {count};\n\
             /// Its rotors.\nconst FRAME: [Rotor; ROTORS] = {frame:?};\n\
             /// What its file says.\npub const CONFIGURATION: Configuration = {{\n    let mut it = PLAIN;\n"
        );
        each_value("it", &self.values(), &mut text);
        text + "    it\n};\n"
    }

    /// Returns the values of the configuration as a JSON object, by field.
    fn values(&self) -> Value {
        // The call cannot fail, because the file's reader has checked the number of rotors.
        let Ok(configuration) = self.configuration() else { return Value::Null };
        // Sensor calibration and motor controllers are left out, because they belong to an individual vehicle. Link and
        // radio are left out, because they belong to the board.
        let Configuration {
            parameters,
            rotors: _,
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
        json!({
            "parameters": parameters, "settings": settings, "gains": gains, "curve": curve, "response": response,
            "imu": imu, "estimation": estimation, "arming": arming, "guidance": guidance,
        })
    }
}

/// Writes an assignment for every value in `value`.
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
    // Writing to a string cannot fail.
    let _ = writeln!(text, "    {place} = {literal};");
}

/// Returns the Rust literal of a number, a switch or a choice.
fn literal(value: &Value) -> String {
    match (value, value.as_f64()) {
        (Value::Number(number), Some(wide)) if number.is_f64() => {
            // Writes the shortest decimal that gives the same number.
            let narrow = wide as f32;
            if f64::from(narrow) == wide { format!("{narrow:?}") } else { format!("{wide:?}") }
        }
        (Value::String(word), _) => format!("choice({word:?})"),
        (value, _) => value.to_string(),
    }
}
