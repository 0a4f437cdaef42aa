//! Tables of a list that take over what an earlier one of the list says.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Key of the earlier table's name.
pub const LIKE: &str = "like";

/// Gives every table of the list `list` what the earlier one named by its key `like` says: keys that it lacks itself,
/// in tables key by key, except those in `own`. A table with another `kind` keeps to itself. Spans stay, so that an
/// error refers to the line that says it. A name that nothing earlier has changes nothing; the reader refuses it.
pub(crate) fn inherit(document: &mut DeTable<'_>, list: &str, own: &[&str]) {
    let Some(DeValue::Array(tables)) = document.get_mut(list).map(Spanned::get_mut) else { return };
    // In their order, so that what an heir has taken over goes on to its own heirs.
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
