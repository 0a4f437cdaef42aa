//! The log.

use std::fmt::{self, Display, Write as _};

/// What a step has come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// As it should be.
    Passed,
    /// Not as it should be.
    Failed,
    /// Not done: nobody was there to do it, or the board has nothing of the kind.
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

/// A step with what it has found.
#[derive(Clone, Debug, PartialEq)]
pub struct BringUpStep {
    /// Its name.
    pub name: &'static str,
    /// Its verdict.
    pub verdict: Verdict,
    /// Why it has failed, or was not done.
    pub reasons: Vec<String>,
    /// What was found: a name and a value with its unit.
    pub findings: Vec<(String, String)>,
}

impl BringUpStep {
    /// A step that has found nothing wrong yet.
    pub(crate) fn new(name: &'static str) -> Self {
        BringUpStep { name, verdict: Verdict::Passed, reasons: Vec::new(), findings: Vec::new() }
    }

    /// Adds what was found.
    pub(crate) fn found(&mut self, what: &str, value: impl Display) {
        self.findings.push((what.into(), value.to_string()));
    }

    /// Fails with this reason unless it is so.
    pub(crate) fn check(&mut self, is_so: bool, otherwise: impl Display) {
        if !is_so {
            self.verdict = Verdict::Failed;
            self.reasons.push(otherwise.to_string());
        }
    }

    /// A step that is not done, for this reason.
    pub(crate) fn skipped(mut self, reason: impl Display) -> Self {
        self.verdict = Verdict::Skipped;
        self.reasons.push(reason.to_string());
        self
    }
}

/// All steps, and what is not a step's.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct BringUpLog {
    /// What was connected, when and how: a name and a value.
    pub head: Vec<(String, String)>,
    /// Steps in their order.
    pub steps: Vec<BringUpStep>,
    /// Parameters of the vehicle, names and values.
    pub parameters: Vec<(String, String)>,
    /// Texts of the vehicle, with the time since the beginning \[s\].
    pub texts: Vec<(f64, String)>,
}

impl BringUpLog {
    /// True if no step has failed.
    #[must_use]
    pub fn is_well(&self) -> bool {
        self.steps.iter().all(|step| step.verdict != Verdict::Failed)
    }

    /// Returns it as a page of Markdown.
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

/// Writes a table of two columns.
fn table(page: &mut String, [first, second]: [&str; 2], rows: &[(String, String)]) {
    let _ = writeln!(page, "| {first} | {second} |\n|---|---|");
    for (name, value) in rows {
        let _ = writeln!(page, "| {} | {} |", cell(name), cell(value));
    }
}

/// Text as a cell, whatever the vehicle has sent.
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
