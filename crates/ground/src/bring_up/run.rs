//! Runs all steps of a bring-up.

use super::conversation::{ByteExchange, Conversation};
use super::error::Error;
use super::log::BringUpLog;
use super::steps;
use super::turns;
use afbc_mavlink::ParameterValue;

/// Longest wait for the first heartbeat (sent once per second) and for the health array \[ms\].
const SILENT_MS: u64 = 5_000;

/// Options of a bring-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BringUpOptions {
    /// Time at rest for measuring noise and tick times \[s\].
    pub rest_s: u32,
    /// True if somebody is there to turn the board, warm it and take it outside.
    pub is_attended: bool,
}

/// Runs all steps with the board at the other end of `exchange`. `tell` receives each line about the progress, or about
/// what to do by hand.
///
/// # Errors
/// Fails if the board is silent, sends something else, is armed or signs its frames, or if the connection fails.
pub fn bring_up(
    exchange: &mut ByteExchange<'_>,
    options: BringUpOptions,
    tell: &mut dyn FnMut(&str),
) -> Result<BringUpLog, Error> {
    let mut talk = Conversation::new(exchange);
    talk.wait(SILENT_MS, |talk| talk.client.vehicle().address.is_some())?;
    let Some(vehicle) = talk.client.vehicle().address else {
        return Err(if talk.bytes() == 0 { Error::Silent } else { Error::Nonsense(talk.bytes()) });
    };
    if talk.client.vehicle().armed {
        return Err(Error::Armed);
    }
    if !talk.wait(SILENT_MS, |talk| talk.latest.health.is_some())? {
        return Err(Error::Stranger);
    }
    tell(&format!("system {}, component {}", vehicle.system, vehicle.component));

    let mut log = BringUpLog::default();
    let mut add = |step| log.steps.push(step);
    add(steps::version(&mut talk)?);
    tell("reading parameters");
    add(steps::parameters(&mut talk)?);
    add(steps::sensors(&mut talk)?);
    tell("self-tests of the sensors: leave the board at rest");
    add(steps::self_tests(&mut talk)?);
    tell(&format!("leave the board at rest, level, for {} s", options.rest_s));
    steps::at_rest(&mut talk, options.rest_s, &mut add)?;
    turns::turns(&mut talk, options.is_attended, tell, &mut add)?;
    add(steps::warmth(&mut talk, options.is_attended, tell)?);
    add(steps::position(&mut talk, options.is_attended, tell)?);
    add(steps::battery(&talk));
    add(steps::motors(&talk));
    add(steps::arming(&mut talk)?);
    add(steps::link(&mut talk)?);

    log.parameters = talk.client.parameters().values().map(name_and_value).collect();
    let texts = talk.client.vehicle().texts.iter();
    log.texts = texts.map(|text| (text.at_ms as f64 * 1e-3, text.text.clone())).collect();
    Ok(log)
}

fn name_and_value(parameter: &ParameterValue) -> (String, String) {
    let name: Vec<u8> = parameter.name.iter().copied().take_while(|&byte| byte != 0).collect();
    // MAV_PARAM_TYPE: 9 is a float; even numbers below it are signed integers.
    let value = match parameter.kind {
        9 => f32::from_le_bytes(parameter.value).to_string(),
        2 | 4 | 6 => i32::from_le_bytes(parameter.value).to_string(),
        _ => u32::from_le_bytes(parameter.value).to_string(),
    };
    (String::from_utf8_lossy(&name).into_owned(), value)
}
