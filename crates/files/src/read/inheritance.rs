//! Inheritance between the tables of a list by the key `like`.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Key that names the earlier table.
pub const LIKE: &str = "like";

/// Lets every table of the list `list` inherit from the earlier table that its key `like` names. The table takes the
/// keys that it lacks, except those in `own`; subtables are merged key by key. A table with another `kind` takes
/// nothing. Spans are kept, so that an error points to the line that says the value. A `like` that names no earlier
/// table changes nothing; the reader refuses it.
pub(crate) fn inherit(document: &mut DeTable<'_>, list: &str, own: &[&str]) {
    let Some(DeValue::Array(tables)) = document.get_mut(list).map(Spanned::get_mut) else { return };
    // Goes in order, so that inherited keys are inherited further.
    for index in 1..tables.len() {
        let (earlier, rest) = tables.split_at_mut(index);
        let Some(DeValue::Table(heir)) = rest.first_mut().map(Spanned::get_mut) else { continue };
        let Some(like) = text(heir, LIKE) else { continue };
        let named =
            |value: &&Spanned<DeValue<'_>>| value.get_ref().as_table().and_then(|t| text(t, "name")) == Some(like);
        let Some(DeValue::Table(base)) = earlier.iter().find(named).map(Spanned::get_ref) else { continue };
        let mut base = base.clone();
        own.iter().for_each(|key| drop(base.remove(*key)));
        take_over(heir, base);
    }
}

fn text<'t>(table: &'t DeTable<'_>, key: &str) -> Option<&'t str> {
    table.get(key)?.get_ref().as_str()
}

fn take_over<'d>(heir: &mut DeTable<'d>, base: DeTable<'d>) {
    if text(heir, "kind").is_some_and(|kind| Some(kind) != text(&base, "kind")) {
        return;
    }
    for (key, value) in base {
        match heir.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut) {
            None => drop(heir.insert(key, value)),
            Some(DeValue::Table(own)) => {
                if let DeValue::Table(base) = value.into_inner() {
                    take_over(own, base);
                }
            }
            Some(_) => {}
        }
    }
}
