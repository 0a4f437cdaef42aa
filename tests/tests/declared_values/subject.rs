//! A file of any kind, whose values are changed one by one.

use super::document::{Case, Document};
use crate::airborne;
use afbc_campaign::{self as campaign, Campaign, Manifest, NamedTrajectory, Shard};
use afbc_scenario::Scenario;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// An object that is read from a file of one kind.
pub(crate) trait Subject: Sized + serde::Serialize + Sync {
    /// Reads the object from the text of a file.
    fn read(text: &str) -> Result<Self, String>;

    /// Writes the object as a file.
    fn document(&self) -> Document;

    /// Returns a scenario that uses the object.
    fn scenario(&self) -> Scenario;

    /// Checks the changed value in the firmware's image and at a station.
    fn check_on_board(&self, _base: &Self, _case: &Case, _changed: &str) {}

    /// True if a flight with this object differs from one with `base`.
    fn responds(&self, base: &Self, case: &Case) -> bool;
}

/// Number of values that are flown before a key counts as having no response.
const TRIES: usize = 4;

/// For each key, true if a flight has responded to it.
pub(crate) type Responses = BTreeMap<String, bool>;

/// Changes every value of the file of `base`. Returns the fields that changed, and records in `responses` whether a
/// flight responded.
pub(crate) fn change_each<S: Subject>(base: &S, responses: &mut Responses) -> BTreeSet<String> {
    let text = base.document().text();
    let again = S::read(&text).unwrap_or_else(|error| panic!("{error} in\n{text}"));
    assert_eq!(again.document().differing(&base.document()), [], "the file does not hold what it was made of");
    let kept = fields(&again);
    let lost: Vec<_> = fields(base).into_iter().filter(|(path, value)| kept.get(path) != Some(value)).collect();
    assert_eq!(lost, [], "the file does not hold what it was made of");
    let (base, fields, mark) = (again, kept, fingerprint(base));
    assert_eq!(fingerprint(&base), mark);
    let document = base.document();
    let results = airborne::on_all_cores(&document.cases(), |case| {
        let mut changed = BTreeSet::new();
        let mut responds = false;
        let (mut accepted, mut refused) = (0, Vec::new());
        for other in &case.others {
            let text = document.with(case, other);
            let subject = match S::read(&text) {
                Ok(subject) => subject,
                Err(error) => {
                    refused.push(error);
                    continue;
                }
            };
            let what = || format!("{case}: {other}");
            accepted += 1;
            // If the value is declared, exactly this value must have changed.
            let read = document.differing(&subject.document());
            let expected = case.declaration.map(|_| (format!("[{}] {}", case.header, case.key), other.clone()));
            assert_eq!(read, Vec::from_iter(expected), "{}", what());
            assert_ne!(fingerprint(&subject), mark, "{} has the same fingerprint", what());
            let now = self::fields(&subject);
            let different = now.iter().filter(|(path, value)| fields.get(*path) != Some(value));
            changed.extend(different.map(|(path, _)| path.clone()));
            subject.check_on_board(&base, case, other);
            responds = subject.responds(&base, case);
            if responds || accepted == TRIES {
                break;
            }
        }
        assert!(accepted > 0, "{case}: no other value is accepted: {refused:#?}");
        (changed, case.to_string(), responds)
    });
    for (_, case, responds) in &results {
        *responses.entry(case.clone()).or_default() |= *responds;
    }
    results.into_iter().flat_map(|(changed, ..)| changed).collect()
}

/// Checks that the keys without a response are those listed, each with a reason.
pub(crate) fn compare(responses: &Responses, listed: &[(&str, &[&str])]) {
    let listed: BTreeSet<&str> = listed.iter().flat_map(|(_, keys)| keys.iter().copied()).collect();
    let idle = responses.iter().filter(|(_, responds)| !**responds).map(|(key, _)| key.as_str()).collect();
    let unlisted: Vec<_> = BTreeSet::difference(&idle, &listed).collect();
    let active: Vec<_> = listed.difference(&idle).collect();
    assert!(unlisted.is_empty(), "no flight responds to {unlisted:#?}");
    assert!(active.is_empty(), "a flight responds to what is listed as without effect: {active:#?}");
}

/// Returns every field that serde writes, by path, without list indices.
pub(crate) fn fields(subject: &impl serde::Serialize) -> BTreeMap<String, String> {
    fn walk(path: &str, value: &serde_json::Value, fields: &mut BTreeMap<String, String>) {
        let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        match value {
            serde_json::Value::Object(entries) => entries.iter().for_each(|(key, it)| walk(&join(key), it, fields)),
            serde_json::Value::Array(items) if items.iter().any(|item| !item.is_number()) => {
                items.iter().for_each(|item| walk(path, item, fields));
            }
            value => fields.entry(path.to_owned()).or_default().push_str(&format!("{value} ")),
        }
    }
    let mut fields = BTreeMap::new();
    walk("", &serde_json::to_value(subject).unwrap(), &mut fields);
    fields
}

/// Returns the fingerprint of a campaign with the object.
fn fingerprint(subject: &impl Subject) -> String {
    let plain = campaign::parse("f", "flights = 1\nscenario = \"hover\"", "f", Path::new("")).unwrap();
    let scenario = subject.scenario();
    let Scenario { trajectory, initial, .. } = scenario.clone();
    let trajectories = vec![NamedTrajectory { name: "own".into(), trajectory, initial }];
    Manifest::new(&Campaign { trajectories, scenario, ..plain }, Shard::WHOLE).fingerprint
}
