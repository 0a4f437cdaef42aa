//! The head of a reply crosses the wire.
#![allow(missing_docs)]

use afbc_onboard::ReplyHead;
use proptest::prelude::*;

proptest! {
    #[test]
    fn heads_cross(time_us: u64, cycles: u32, stack_bytes: u32, length: u32, throttles: [u16; 8]) {
        let head = ReplyHead { time_us, cycles, stack_bytes, length, throttles };
        prop_assert_eq!(ReplyHead::from_bytes(&head.to_bytes()), head);
    }
}

/// Byte for byte, as another program would read it.
#[test]
fn fields_are_little_endian_and_in_order() {
    let throttles = [0x0102, 0, 0, 0, 0, 0, 0, 0x0304];
    let head = ReplyHead { time_us: 0x0807_0605_0403_0201, cycles: 9, stack_bytes: 10, length: 0x0100, throttles };
    let bytes = head.to_bytes();
    assert_eq!(bytes[..20], [1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0, 10, 0, 0, 0, 0, 1, 0, 0]);
    assert_eq!((&bytes[20..22], &bytes[34..]), (&[2, 1][..], &[4, 3][..]));
}
