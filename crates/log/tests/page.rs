//! The table of topics in `docs/reference/ulog-topics.md`. `WRITE=1 cargo test -p afbc-log --test page` writes it.
#![allow(clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc_log::ulog::{LoggedField, LoggedTopic, TOPICS};
use std::fs;
use std::path::Path;

const BEGIN: &str = "<!-- topics: written by WRITE=1 cargo test -p afbc-log --test page -->\n";
const END: &str = "<!-- end of topics -->\n";

fn field(field: &LoggedField) -> String {
    let values = field.values.map_or(String::new(), |values| format!("[{values}]"));
    let unit = if field.unit.is_empty() { String::new() } else { format!(" ({})", field.unit) };
    format!("`{}{values}`{unit}", field.name)
}

fn row(topic: &LoggedTopic) -> String {
    let change = if topic.on_change { ", change" } else { "" };
    // Leaves out the timestamp, which every topic has.
    let told = topic.fields.iter().skip(1).filter(|field| !field.name.starts_with("_padding"));
    let fields: Vec<_> = told.map(field).collect();
    let [usual, small] = [topic.period_us, topic.small_us].map(|us| us / 1000);
    format!("| `{}` | {usual} ms{change} | {small} ms | {} |\n", topic.name, fields.join(", "))
}

#[test]
fn the_page_lists_every_topic() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/ulog-topics.md");
    let page = fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (_, after) = rest.split_once(END).unwrap();
    let rows: String = TOPICS.iter().map(row).collect();
    let table =
        format!("\n| topic | period | in a small log | fields, after `timestamp` (us) |\n|---|---|---|---|\n{rows}\n");
    let declared = format!("{before}{BEGIN}{table}{END}{after}");
    if std::env::var_os("WRITE").is_some() {
        return fs::write(&path, &declared).unwrap();
    }
    assert_eq!(page, declared, "run WRITE=1 cargo test -p afbc-log --test page");
}
