//! Replies and requests that wait in queues until they are sent or carried out.

use afbc_mavlink::{
    Address, ControlAnswer, DataStream, MessageInterval, ParameterError, ParameterRequest, ServiceRefusal, TimeMessage,
};

/// Largest number of queued replies, besides answers to commands. Further replies are dropped, since stations repeat
/// requests.
pub(super) const REPLIES_MAX: usize = 16;
/// Largest number of queued parameter requests. A tick carries out all that read, and at most one that changes a value.
/// Further requests are dropped, since stations repeat them.
pub(super) const PARAMETER_TASKS_MAX: usize = 24;

/// A reply to a message other than a command.
#[derive(Clone, Copy, Debug)]
pub(super) enum Reply {
    Clock(TimeMessage),
    Control(ControlAnswer),
    Interval(MessageInterval),
    Stream(DataStream),
    Reached(u16),
    ParameterError(ParameterError, Address),
    Refusal(ServiceRefusal, Address),
}

/// A queued request about parameters.
#[derive(Clone, Copy, Debug)]
pub(super) enum ParameterTask {
    Ask(ParameterRequest, Address),
    Restore,
}
