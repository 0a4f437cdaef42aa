//! System ids in words.

/// Lists system ids; consecutive ones as "first to last".
pub(crate) fn listed(systems: &[u8]) -> String {
    match systems {
        [first, .., last] if systems.is_sorted_by(|one, next| u16::from(*one) + 1 == u16::from(*next)) => {
            format!("{first} to {last}")
        }
        _ => systems.iter().map(u8::to_string).collect::<Vec<_>>().join(", "),
    }
}
