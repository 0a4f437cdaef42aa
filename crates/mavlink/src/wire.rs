//! Serialisation of fields: little-endian, without gaps, in MAVLink's order. Messages that the `mavlink` crate cannot
//! read and write completely are described as a tuple of their fields, extension fields last. Only their id and
//! checksum seed come from the crate.

use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX};
use core::marker::PhantomData;
use mavlink::MessageData;

/// Bytes of a payload; zeros follow after its end.
pub(crate) struct PayloadReader<'a>(core::slice::Iter<'a, u8>);

/// Payload being written.
pub(crate) struct PayloadWriter<'a> {
    rest: core::iter::Enumerate<core::slice::IterMut<'a, u8>>,
    /// Length without trailing zeros.
    length: u8,
}

impl PayloadWriter<'_> {
    fn put(&mut self, byte: u8) {
        if let Some((place, to)) = self.rest.next() {
            *to = byte;
            if byte != 0 {
                // Fits into a byte: a payload has at most 255 bytes.
                self.length = (place + 1) as u8;
            }
        }
    }
}

/// A field of fixed size.
pub(crate) trait WireField: Sized {
    /// Size \[bytes\].
    const LEN: usize;
    /// Reads the field; bytes missing from the payload are zero.
    fn take(source: &mut PayloadReader<'_>) -> Self;
    /// Writes the field.
    fn give(&self, sink: &mut PayloadWriter<'_>);
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl WireField for $number {
            const LEN: usize = size_of::<$number>();

            fn take(source: &mut PayloadReader<'_>) -> Self {
                <$number>::from_le_bytes([(); size_of::<$number>()].map(|()| source.0.next().copied().unwrap_or(0)))
            }

            fn give(&self, sink: &mut PayloadWriter<'_>) {
                self.to_le_bytes().into_iter().for_each(|byte| sink.put(byte));
            }
        }
    )*};
}

numbers!(u8, i8, u16, i16, u32, i32, u64, i64, f32);

impl<T: WireField, const N: usize> WireField for [T; N] {
    const LEN: usize = N * T::LEN;

    fn take(source: &mut PayloadReader<'_>) -> Self {
        core::array::from_fn(|_| T::take(source))
    }

    fn give(&self, sink: &mut PayloadWriter<'_>) {
        self.iter().for_each(|element| element.give(sink));
    }
}

impl WireField for Address {
    const LEN: usize = 2;

    fn take(source: &mut PayloadReader<'_>) -> Self {
        let [system, component] = WireField::take(source);
        Address { system, component }
    }

    fn give(&self, sink: &mut PayloadWriter<'_>) {
        [self.system, self.component].give(sink);
    }
}

/// Bytes that are skipped when reading and zero when writing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Unused<const N: usize>;

impl<const N: usize> WireField for Unused<N> {
    const LEN: usize = N;

    fn take(source: &mut PayloadReader<'_>) -> Self {
        // Skips at least one byte; no message has a field of length 0.
        source.0.nth(N.saturating_sub(1));
        Unused
    }

    fn give(&self, sink: &mut PayloadWriter<'_>) {
        (0..N).for_each(|_| sink.put(0));
    }
}

macro_rules! tuples {
    ($($(($field:ident $name:ident))+;)*) => {$(
        impl<$($name: WireField),+> WireField for ($($name,)+) {
            const LEN: usize = 0 $(+ $name::LEN)+;

            fn take(source: &mut PayloadReader<'_>) -> Self {
                $(let $field = $name::take(source);)+
                ($($field,)+)
            }

            fn give(&self, sink: &mut PayloadWriter<'_>) {
                let ($($field,)+) = self;
                $($field.give(sink);)+
            }
        }
    )*};
}

tuples! {
    (a A);
    (a A) (b B);
    (a A) (b B) (c C);
    (a A) (b B) (c C) (d D);
    (a A) (b B) (c C) (d D) (e E);
    (a A) (b B) (c C) (d D) (e E) (f F);
    (a A) (b B) (c C) (d D) (e E) (f F) (g G);
    (a A) (b B) (c C) (d D) (e E) (f F) (g G) (h H);
    (a A) (b B) (c C) (d D) (e E) (f F) (g G) (h H) (i I);
    (a A) (b B) (c C) (d D) (e E) (f F) (g G) (h H) (i I) (j J);
}

/// Field layout of the message `D` of the `mavlink` crate.
pub(crate) struct MessageLayout<D, W>(PhantomData<fn() -> (D, W)>);

impl<D: MessageData, W: WireField> MessageLayout<D, W> {
    /// The layout. Compiles only if it covers at least the fields that the `mavlink` crate knows.
    pub(crate) const NEW: Self = {
        assert!(D::ENCODED_LEN <= W::LEN && W::LEN <= PAYLOAD_MAX);
        MessageLayout(PhantomData)
    };

    pub(crate) const fn format(&self) -> MessageFormat {
        MessageFormat { extra_crc: D::EXTRA_CRC, length_max: W::LEN }
    }

    pub(crate) fn read(&self, payload: &[u8]) -> W {
        W::take(&mut PayloadReader(payload.iter()))
    }

    /// Writes the fields without trailing zeros; returns message id and length, at least one byte.
    pub(crate) fn write(&self, fields: &W, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let mut sink = PayloadWriter { rest: payload.iter_mut().enumerate(), length: 1 };
        fields.give(&mut sink);
        let length = sink.length;
        (D::ID, length)
    }
}
