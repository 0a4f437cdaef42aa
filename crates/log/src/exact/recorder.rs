//! Writes the exact log.

use crate::exact::frame::{FRAME_MAX, write};
use crate::exact::record::{Given, Record, StartRecord};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{ControlInputs, Report, TickInputs};

/// Makes the frames of a log, in the order of the calls. Runs beside the control tick, not in it.
#[derive(Clone, Debug)]
pub struct Recorder {
    buffer: [u8; FRAME_MAX],
    configuration: u16,
}

impl Default for Recorder {
    fn default() -> Self {
        Recorder { buffer: [0; FRAME_MAX], configuration: 0 }
    }
}

impl Recorder {
    /// Records the start of a processor that flies this vehicle and law, and all parameters that differ from the
    /// firmware image. Calls `send` with each frame.
    pub fn start(&mut self, [vehicle, law]: [&str; 2], table: &ParameterTable, send: &mut dyn FnMut(&[u8])) {
        self.configuration = 0;
        self.frame(&Record::Start(StartRecord::of(vehicle, law, table)), send);
        for parameter in table.iter() {
            // The values are compared bit by bit: 0 and -0 are equal, but a replay must match to the last bit.
            let image = table.default_of(parameter.name).map(|parameter| parameter.value.to_bits());
            if image != Some(parameter.value.to_bits()) {
                self.frame(&Record::Parameter { configuration: 0, name: parameter.name, value: parameter.value }, send);
            }
        }
    }

    /// Records a change of the parameter table. Returns the number of the new configuration.
    pub fn change(&mut self, table: &ParameterTable, change: RecordChange, send: &mut dyn FnMut(&[u8])) -> u16 {
        self.configuration = self.configuration.wrapping_add(1);
        let configuration = self.configuration;
        match change {
            RecordChange::Set(name, _) => {
                if let Some(parameter) = table.get(name) {
                    self.frame(&Record::Parameter { configuration, name, value: parameter.value }, send);
                }
            }
            RecordChange::Restored => self.frame(&Record::Restored { configuration }, send),
        }
        configuration
    }

    /// Records the inputs that messages brought for a tick, unless there are none. The battery is left out: the tick's
    /// own record contains it.
    pub fn inputs(&mut self, tick: u32, inputs: &ControlInputs, send: &mut dyn FnMut(&[u8])) {
        let mut inputs = inputs.clone();
        inputs.battery = None;
        if inputs != ControlInputs::EMPTY {
            self.frame(&Record::Inputs { tick, inputs }, send);
        }
    }

    /// Records a tick with its inputs and outputs.
    pub fn tick(&mut self, took: &TickInputs, gave: &Report, send: &mut dyn FnMut(&[u8])) {
        self.frame(&Record::Tick(*took, Given::of(gave)), send);
    }

    fn frame(&mut self, record: &Record, send: &mut dyn FnMut(&[u8])) {
        if let Some(frame) = write(record, &mut self.buffer) {
            send(frame);
        }
    }
}
