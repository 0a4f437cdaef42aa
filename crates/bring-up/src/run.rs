//! The list of steps.

use crate::conversation::Conversation;
use crate::error::Error;
use crate::log::BringUpLog;
use crate::steps;
use crate::turns;
use afbc_hil::Autopilot;

/// Longest wait for the first heartbeat, of which there is one per second, and for the health array \[ms\].
const SILENT_MS: u64 = 5_000;

/// How it is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BringUpOptions {
    /// Time at rest over which noise and ticks are measured \[s\].
    pub rest_s: u32,
    /// True if somebody is there to turn the board, warm it and take it outside.
    pub is_attended: bool,
}

/// Goes through all steps with the board at the other end of `port`; `tell` is given each line that says what is going
/// on, or what is to be done by hand.
///
/// # Errors
/// If nothing can be asked: the board is silent, sends something else, is armed, or the connection fails.
pub fn bring_up(
    port: &mut dyn Autopilot,
    options: BringUpOptions,
    tell: &mut dyn FnMut(&str),
) -> Result<BringUpLog, Error> {
    let mut talk = Conversation::new(port);
    talk.wait(SILENT_MS, |heard| heard.vehicle.is_some())?;
    let Some((vehicle, is_armed)) = talk.heard.vehicle else {
        return Err(if talk.bytes() == 0 { Error::Silent } else { Error::Nonsense(talk.bytes()) });
    };
    if is_armed {
        return Err(Error::Armed);
    }
    if !talk.wait(SILENT_MS, |heard| heard.health.is_some())? {
        return Err(Error::Stranger);
    }
    tell(&format!("system {}, component {}", vehicle.system, vehicle.component));

    let mut log = BringUpLog::default();
    let mut add = |step| log.steps.push(step);
    add(steps::version(&mut talk)?);
    tell("reading parameters");
    add(steps::parameters(&mut talk)?);
    add(steps::sensors(&mut talk)?);
    tell("self-tests of the sensors: leave it at rest");
    add(steps::self_tests(&mut talk)?);
    tell(&format!("leave it at rest, level, for {} s", options.rest_s));
    steps::at_rest(&mut talk, options.rest_s, &mut add)?;
    turns::turns(&mut talk, options.is_attended, tell, &mut add)?;
    add(steps::warmth(&mut talk, options.is_attended, tell)?);
    add(steps::position(&mut talk, options.is_attended, tell)?);
    add(steps::battery(&talk));
    add(steps::motors(&talk));
    add(steps::arming(&mut talk)?);
    add(steps::link(&mut talk)?);

    log.parameters = talk.heard.parameters.values().cloned().collect();
    log.texts = talk.heard.texts.iter().map(|(at_ms, text)| (*at_ms as f64 * 1e-3, text.clone())).collect();
    Ok(log)
}
