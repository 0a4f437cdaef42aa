//! The log of a bring-up.

use std::fmt::{self, Display, Write as _};

/// Result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// All checks passed.
    Passed,
    /// A check failed.
    Failed,
    /// The check was not done, because nobody was there to do it, or the board lacks the device.
    Skipped,
}

impl Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Verdict::Passed => "passed",
            Verdict::Failed => "FAILED",
            Verdict::Skipped => "not done",
        })
    }
}

/// A step with its findings.
#[derive(Clone, Debug, PartialEq)]
pub struct BringUpStep {
    /// Name of the step.
    pub name: &'static str,
    /// Result of the step.
    pub verdict: Verdict,
    /// Reasons for a failed or skipped step.
    pub reasons: Vec<String>,
    /// Findings: a name, and a value with its unit.
    pub findings: Vec<(String, String)>,
}

impl BringUpStep {
    /// Creates a step that has passed so far.
    pub(crate) fn new(name: &'static str) -> Self {
        BringUpStep { name, verdict: Verdict::Passed, reasons: Vec::new(), findings: Vec::new() }
    }

    /// Adds a finding.
    pub(crate) fn found(&mut self, what: &str, value: impl Display) {
        self.findings.push((what.into(), value.to_string()));
    }

    /// Fails the step with the reason `otherwise` unless `is_so`.
    pub(crate) fn check(&mut self, is_so: bool, otherwise: impl Display) {
        if !is_so {
            self.verdict = Verdict::Failed;
            self.reasons.push(otherwise.to_string());
        }
    }

    /// Marks the step as skipped for this reason.
    pub(crate) fn skipped(mut self, reason: impl Display) -> Self {
        self.verdict = Verdict::Skipped;
        self.reasons.push(reason.to_string());
        self
    }
}

/// Log of a bring-up: all steps, and what belongs to no step.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct BringUpLog {
    /// About the board, the time and the connection: a name and a value.
    pub head: Vec<(String, String)>,
    /// Steps in the order in which they were done.
    pub steps: Vec<BringUpStep>,
    /// Names and values of the vehicle's parameters.
    pub parameters: Vec<(String, String)>,
    /// Status texts of the vehicle, with the time since the beginning \[s\].
    pub texts: Vec<(f64, String)>,
}

impl BringUpLog {
    /// Returns true if no step has failed.
    #[must_use]
    pub fn is_well(&self) -> bool {
        self.steps.iter().all(|step| step.verdict != Verdict::Failed)
    }

    /// Returns the log as a page of Markdown.
    #[must_use]
    pub fn page(&self) -> String {
        let mut page = String::from("# Bring-up\n\n");
        table(&mut page, ["about", ""], &self.head);
        page.push_str("\n## Verdicts\n\n| step | verdict | because |\n|---|---|---|\n");
        for BringUpStep { name, verdict, reasons, .. } in &self.steps {
            let reasons: Vec<_> = reasons.iter().map(|reason| cell(reason)).collect();
            let _ = writeln!(page, "| {name} | {verdict} | {} |", reasons.join("; "));
        }
        for step in self.steps.iter().filter(|step| !step.findings.is_empty()) {
            let _ = write!(page, "\n## {}\n\n", step.name);
            table(&mut page, ["what", "found"], &step.findings);
        }
        page.push_str("\n## Texts of the vehicle\n\n");
        let texts: Vec<_> = self.texts.iter().map(|(at_s, text)| (format!("{at_s:.1} s"), text.clone())).collect();
        table(&mut page, ["at", "text"], &texts);
        page.push_str("\n## Parameters of the vehicle\n\n");
        table(&mut page, ["name", "value"], &self.parameters);
        page
    }
}

/// Writes a table with two columns.
fn table(page: &mut String, [first, second]: [&str; 2], rows: &[(String, String)]) {
    let _ = writeln!(page, "| {first} | {second} |\n|---|---|");
    for (name, value) in rows {
        let _ = writeln!(page, "| {} | {} |", cell(name), cell(value));
    }
}

/// Makes a text safe for a table cell: replaces `|` and control characters by spaces.
fn cell(text: &str) -> String {
    text.chars().map(|character| if character == '|' || character.is_control() { ' ' } else { character }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_everything_and_no_broken_row() {
        let mut step = BringUpStep::new("sensors");
        step.found("barometer", "well");
        step.check(true, "not shown");
        assert_eq!(step.verdict, Verdict::Passed);
        step.check(false, "a | b");
        let skipped = BringUpStep::new("turns").skipped("nobody");
        let texts = vec![(1.25, "one\ntwo".into())];
        let parameters = vec![("LOG_PORT".into(), "0".into())];
        let head = vec![("board".into(), "pixracer".into())];
        let mut log = BringUpLog { head, steps: vec![step, skipped], parameters, texts };
        let page = log.page();
        for wanted in [
            "| board | pixracer |\n",
            "| sensors | FAILED | a   b |\n",
            "| turns | not done | nobody |\n",
            "## sensors\n\n| what | found |\n|---|---|\n| barometer | well |\n",
            "| 1.2 s | one two |\n",
            "| LOG_PORT | 0 |\n",
        ] {
            assert!(page.contains(wanted), "{wanted}: {page}");
        }
        assert!(!page.contains("## turns") && !log.is_well());
        log.steps.remove(0);
        assert!(log.is_well(), "what is not done is not wrong");
    }
}
