//! Makes the replayers of a log: the flight as logged, and perhaps the same flight under changed settings.

use super::change::SettingChange;
use afbc::Profile;
use afbc_files::read::FileError;
use afbc_files::read::words::out_of_range;
use afbc_log::exact::{Replayer, StartRecord};
use afbc_scenario::FlownLaw;
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_store::RecordName;
use afbc_types::OutOfRange;
use afbc_vehicles::Vehicle;

/// The flight as logged, and the same flight under changed settings.
pub(super) struct TickPlayers {
    pub(super) flown: Box<Replayer<FlownLaw>>,
    pub(super) changed: Option<Box<Replayer<FlownLaw>>>,
    pub(super) changes: Vec<SettingChange>,
}

/// Reason for which there are no players.
pub(super) enum PlayerError {
    /// A problem with the log.
    Log(String),
    /// A whole line, with its subject before a colon.
    Whole(String),
    /// A problem with the vehicle's file.
    File(FileError),
}

impl PlayerError {
    /// Returns the error; `log` is the log's name in the message.
    pub(super) fn of(self, log: &str) -> FileError {
        match self {
            PlayerError::Log(problem) => FileError::whole(log, problem),
            PlayerError::Whole(line) => match line.split_once(": ") {
                Some((what, problem)) => FileError::whole(what, problem),
                None => FileError::whole(log, line),
            },
            PlayerError::File(error) => error,
        }
    }
}

impl TickPlayers {
    /// Makes the players for a log with this start record.
    pub(super) fn of(vehicle: &Vehicle, start: &StartRecord, changes: &[SettingChange]) -> Result<Self, PlayerError> {
        let flown = ControllerKind::named(start.law.as_str());
        let Some(flown) = flown else {
            let law = start.law.escape_debug();
            return Err(PlayerError::Log(format!(
                "the log was flown with the law '{law}', which this program does not have; replay the log with a \
                 program that has this law"
            )));
        };
        if usize::from(start.rotors) != vehicle.rotors.len() {
            return Err(PlayerError::Log(format!(
                "the log was flown with {} rotors, but the vehicle {} has {}; give the right vehicle file by --vehicle",
                start.rotors,
                vehicle.name,
                vehicle.rotors.len()
            )));
        }
        let changed = if changes.is_empty() {
            None
        } else {
            let mut law = changes.iter().filter_map(|change| match change {
                SettingChange::Law(kind) => Some(*kind),
                SettingChange::Parameter(..) => None,
            });
            let mut player = player(vehicle, law.next_back().unwrap_or(flown))?;
            for change in changes {
                if let SettingChange::Parameter(name, value) = change {
                    set(&mut player, *name, *value).map_err(PlayerError::Whole)?;
                }
            }
            Some(player)
        };
        Ok(TickPlayers { flown: player(vehicle, flown)?, changed, changes: changes.to_vec() })
    }
}

/// Makes the player for a vehicle under a law.
fn player(vehicle: &Vehicle, kind: ControllerKind) -> Result<Box<Replayer<FlownLaw>>, PlayerError> {
    let refused =
        |error: OutOfRange| PlayerError::Log(format!("the vehicle {}: {}", vehicle.name, out_of_range(&error)));
    let law = match kind {
        ControllerKind::Afbc => None,
        kind => Some(Law::on(kind, vehicle, Profile::Flight).map_err(PlayerError::File)?),
    };
    let image = vehicle.configuration().map_err(refused)?;
    Ok(Box::new(Replayer::under(FlownLaw(law), image).map_err(refused)?))
}

/// Sets a parameter to another value for the whole flight.
fn set(player: &mut Replayer<FlownLaw>, name: RecordName, value: f32) -> Result<(), String> {
    if player.parameters().get(name).is_none() {
        return Err(format!("--change {name}: no such parameter; `sitl params export` lists them"));
    }
    player.change(name, value).map_err(|reason| format!("--change {reason}"))
}
