//! Extended parameters, which only cameras have.

use afbc_link::{ExtendedAnswer, ExtendedRequest};

/// `MAV_PARAM_EXT_TYPE`: of no known type.
const CUSTOM: u8 = 11;
/// `PARAM_ACK`: not supported.
const UNSUPPORTED: u8 = 1;

/// Returns the answer to a request: there is no parameter.
pub fn answer(request: ExtendedRequest) -> ExtendedAnswer {
    let none = |name| ExtendedAnswer::Value { name, kind: CUSTOM, count: 0, place: u16::MAX };
    match request {
        ExtendedRequest::List => none([0; 16]),
        ExtendedRequest::Read { name, .. } => none(name),
        ExtendedRequest::Set { name, kind } => ExtendedAnswer::Ack { name, kind, result: UNSUPPORTED },
    }
}
