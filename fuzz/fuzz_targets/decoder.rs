//! The link's decoders on arbitrary bytes, whole and in pieces: nothing panics, both ways deliver the same messages, every
//! byte is accounted for, what was delivered is read back from its own frame, and no payload makes an implausible state.
#![no_main]

use libfuzzer_sys::fuzz_target;
use link::{Address, Counters, Decoder, Downlink, FRAME_MAX, Message, Sender, Uplink};

const VEHICLE: Address = Address { system: 1, component: 1 };

fn decode<'a, M: Message>(pieces: impl Iterator<Item = &'a [u8]>) -> (Vec<M>, Counters) {
    let mut decoder = Decoder::new(VEHICLE);
    let mut messages = Vec::new();
    pieces.for_each(|piece| decoder.feed(piece, |_, message| messages.push(message)));
    (messages, *decoder.counters())
}

fn check<M: Message + core::fmt::Debug>(bytes: &[u8]) {
    let (messages, counters) = decode::<M>(core::iter::once(bytes));
    // As text: a NaN in telemetry is not equal to itself.
    let whole = format!("{messages:?}");
    assert_eq!((whole, counters), {
        let (messages, counters) = decode::<M>(bytes.chunks(1));
        (format!("{messages:?}"), counters)
    });
    assert_eq!(messages.len(), counters.received as usize);
    assert!(counters.skipped_bytes as usize <= bytes.len());
    for message in &messages {
        let mut buffer = [0; FRAME_MAX];
        let (again, _) = decode::<M>(core::iter::once(Sender::new(VEHICLE).send(message, &mut buffer)));
        assert_eq!(again.len(), 1, "{message:?}");
    }
}

/// Payloads that arrived intact, of every message: what is read is safe to fly on.
fn check_payload<M: Message>(payload: &[u8], flyable: impl Fn(&M) -> bool) {
    for id in 0..400 {
        if let Ok(message) = M::read(id, payload, VEHICLE) {
            assert!(flyable(&message));
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    check::<Uplink>(bytes);
    check::<Downlink>(bytes);
    let payload = &bytes[..bytes.len().min(255)];
    check_payload(payload, |message: &Uplink| match message {
        Uplink::State { state, .. } => state.is_plausible(),
        Uplink::Setpoint(setpoint) => setpoint.is_plausible(),
        Uplink::Heartbeat | Uplink::Command(_) => true,
    });
    check_payload(payload, |_: &Downlink| true);
});
