//! Declares the layout of each topic once, so that the log's formats always match its messages.

use crate::ulog::record::Content;

/// A field of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoggedField {
    /// Name of the field.
    pub name: &'static str,
    /// Type in the log: `float`, `uint64_t` and the like.
    pub kind: &'static str,
    /// Number of values in an array; none for a single value.
    pub values: Option<usize>,
    /// Unit or meaning, for the documentation.
    pub unit: &'static str,
}

impl LoggedField {
    pub(crate) const fn of<W: Wire>(name: &'static str, unit: &'static str) -> Self {
        LoggedField { name, kind: W::KIND, values: W::VALUES, unit }
    }

    /// Writes the field as ULog formats do: `float[3] xyz;`.
    pub(crate) fn format(&self, to: &mut Content<'_>) {
        to.put(self.kind.as_bytes());
        if let Some(values) = self.values {
            to.put(b"[");
            to.number(values);
            to.put(b"]");
        }
        to.put(b" ");
        to.put(self.name.as_bytes());
        to.put(b";");
    }
}

/// A field's type.
pub(crate) trait Wire: Copy {
    /// Name of the type in a format.
    const KIND: &'static str;
    /// Number of values in an array; none for a single value.
    const VALUES: Option<usize> = None;

    /// Writes the value, little-endian.
    fn put(self, to: &mut Content<'_>);
}

macro_rules! wire {
    ($($type:ty: $kind:literal),* $(,)?) => {
        $(
            impl Wire for $type {
                const KIND: &'static str = $kind;

                fn put(self, to: &mut Content<'_>) {
                    to.put(&self.to_le_bytes());
                }
            }
        )*
    };
}

wire! {
    u64: "uint64_t", u32: "uint32_t", i32: "int32_t", u16: "uint16_t", u8: "uint8_t", i8: "int8_t", f64: "double",
    f32: "float",
}

impl Wire for bool {
    const KIND: &'static str = "bool";

    fn put(self, to: &mut Content<'_>) {
        to.put(&[u8::from(self)]);
    }
}

impl<W: Wire, const N: usize> Wire for [W; N] {
    const KIND: &'static str = W::KIND;
    const VALUES: Option<usize> = Some(N);

    fn put(self, to: &mut Content<'_>) {
        self.into_iter().for_each(|value| value.put(to));
    }
}

/// A message of a topic.
pub(crate) trait Message {
    /// Name of the topic.
    const NAME: &'static str;
    /// Fields, in the order of their bytes.
    const FIELDS: &'static [LoggedField];

    /// Writes the fields.
    fn write(&self, to: &mut Content<'_>);
}

/// Declares a topic: its name, its Rust type, and its fields with types and units. Each message begins with the time
/// since power-up. After `of`, name the moment that is logged, and give each field its value on the same line.
macro_rules! message {
    ($(#[$doc:meta])* $name:literal $type:ident of $moment:ident $(, $given:ident: $what:ty)* {
        $($field:ident: $kind:ty = $unit:literal => $value:expr),* $(,)?
    }) => {
        $crate::ulog::layout::message! { $(#[$doc])* $name $type { $($field: $kind = $unit),* } }

        impl $type {
            pub(crate) fn of($moment: &$crate::ulog::moment::Moment<'_> $(, $given: $what)*) -> Self {
                $type { timestamp: $moment.now_us(), $($field: $value,)* }
            }
        }
    };
    ($(#[$doc:meta])* $name:literal $type:ident { $($field:ident: $kind:ty = $unit:literal),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub(crate) struct $type {
            pub(crate) timestamp: u64,
            $(pub(crate) $field: $kind,)*
        }

        impl $crate::ulog::layout::Message for $type {
            const NAME: &'static str = $name;
            const FIELDS: &'static [$crate::ulog::layout::LoggedField] = &[
                $crate::ulog::layout::LoggedField::of::<u64>("timestamp", "us"),
                $($crate::ulog::layout::LoggedField::of::<$kind>(stringify!($field), $unit),)*
            ];

            fn write(&self, to: &mut $crate::ulog::record::Content<'_>) {
                use $crate::ulog::layout::Wire;
                self.timestamp.put(to);
                $(self.$field.put(to);)*
            }
        }
    };
}

pub(crate) use message;

#[cfg(test)]
mod tests {
    use super::Message;
    use crate::ulog::known::Known;
    use crate::ulog::moment::{BesideTick, Moment};
    use crate::ulog::record::Content;
    use afbc_onboard::{Configuration, ControlInputs, Flight, Readings, TickDetails};
    use std::vec::Vec;

    extern crate std;

    message! {
        /// Two signals.
        "two" Two of moment {
            airborne: bool = "" => moment.report.guided.airborne,
            saturated_ticks: u32 = "" => moment.report.saturated_ticks,
        }
    }

    // This topic is the same with one more line, which logs one more signal.
    message! {
        /// Three signals.
        "three" Three of moment {
            airborne: bool = "" => moment.report.guided.airborne,
            saturated_ticks: u32 = "" => moment.report.saturated_ticks,
            wanted: u16 = "item" => moment.report.guided.wanted,
        }
    }

    fn bytes(message: &impl Message) -> Vec<u8> {
        let mut bytes = Vec::new();
        message.write(&mut Content::new(&mut |byte| bytes.push(byte)));
        bytes
    }

    /// One more line in a topic adds one signal to its format and to its messages.
    #[test]
    fn a_signal_more_is_one_line_more() {
        let configuration = Configuration::default();
        let Ok(mut flight) = Flight::<4>::new(&configuration) else { unreachable!("of an image") };
        let mut report = flight.tick(7, &mut ControlInputs::EMPTY.clone(), &Readings::NONE);
        (report.saturated_ticks, report.guided.wanted) = (5, 0x0203);
        let (known, details) = (&Known::of(&configuration), &TickDetails::default());
        let moment = Moment { report: &report, details, beside: BesideTick::default(), known };
        let (two, three) = (Two::of(&moment), Three::of(&moment));
        assert_eq!(bytes(&two), [7, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0]);
        assert_eq!(bytes(&three), [bytes(&two), [3, 2].into()].concat());
        let names: Vec<_> = Three::FIELDS.iter().map(|field| (field.name, field.kind)).collect();
        let those = Two::FIELDS.iter().map(|field| (field.name, field.kind));
        assert_eq!(names, those.chain([("wanted", "uint16_t")]).collect::<Vec<_>>());
    }
}
