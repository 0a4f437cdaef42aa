//! A setting to change in a replay.

use afbc_scenario::contender::ControllerKind;
use afbc_store::RecordName;
use std::fmt;
use std::str::FromStr;

/// Key that selects the law in `KEY=VALUE`.
const LAW: &str = "law";

/// A setting that replaces the flown setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettingChange {
    /// A parameter by its MAVLink name, and its value from the first start on.
    Parameter(RecordName, f32),
    /// The law: AFBC under its monitor, as in every image, or another law with its gains from the profile `flight`.
    Law(ControllerKind),
}

impl FromStr for SettingChange {
    type Err = String;

    /// Reads `KEY=VALUE`: a parameter's name and a number, or `law` and a law's name.
    fn from_str(text: &str) -> Result<Self, String> {
        let (key, value) = text.split_once('=').ok_or("write KEY=VALUE, as in MPC_XY_VEL_MAX=4 or law=pid")?;
        let (key, value) = (key.trim(), value.trim());
        if key == LAW {
            let kind = ControllerKind::named(value);
            return kind.map(SettingChange::Law).ok_or_else(|| format!("no such law; {}", ControllerKind::cure(value)));
        }
        let name = RecordName::new(key).ok_or("no such parameter; `sitl params export` lists them")?;
        let value: Option<f32> = value.parse().ok().filter(|value: &f32| value.is_finite());
        Ok(SettingChange::Parameter(name, value.ok_or("its value must be a number")?))
    }
}

impl fmt::Display for SettingChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SettingChange::Parameter(name, value) => write!(f, "{name}={value}"),
            SettingChange::Law(kind) => write!(f, "{LAW}={}", kind.name()),
        }
    }
}
