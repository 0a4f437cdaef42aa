//! Extended parameters (PARAM_EXT). Only cameras have them, so requests are refused.

use afbc_mavlink::{ExtendedAnswer, ExtendedRequest};

/// `MAV_PARAM_EXT_TYPE_CUSTOM`: the type is not known.
const CUSTOM: u8 = 11;
/// `PARAM_ACK_VALUE_UNSUPPORTED`.
const UNSUPPORTED: u8 = 1;

/// Returns the refusal of a request.
pub fn answer(request: ExtendedRequest) -> ExtendedAnswer {
    let none = |name| ExtendedAnswer::Value { name, kind: CUSTOM, count: 0, place: u16::MAX };
    match request {
        ExtendedRequest::List => none([0; 16]),
        ExtendedRequest::Read { name, .. } => none(name),
        ExtendedRequest::Set { name, kind } => ExtendedAnswer::Ack { name, kind, result: UNSUPPORTED },
    }
}
