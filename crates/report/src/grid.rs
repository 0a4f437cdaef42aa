//! A table for the terminal, for an HTML page, and for a paper as Markdown and as LaTeX with booktabs.

use crate::table::line_width;
use core::fmt::Write;
use maud::{Markup, Render, html};

/// Format of the tables for a paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFormat {
    /// A table in GitHub's Markdown.
    Markdown,
    /// A `table` environment that needs the package booktabs.
    Latex,
}

/// A table: a column of names, and columns of numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Grid {
    /// Caption: a sentence without its full stop.
    pub(crate) caption: String,
    /// Heads of all columns, starting with the names' column.
    pub(crate) heads: Vec<String>,
    /// Name and cells of each row.
    pub(crate) rows: Vec<(String, Vec<GridCell>)>,
    /// Explanation of the numbers.
    pub(crate) note: String,
}

/// A cell of the table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GridCell {
    pub(crate) text: String,
    /// Whether the value is the best of its column or row.
    pub(crate) best: bool,
}

impl<T: Into<String>> From<T> for GridCell {
    fn from(text: T) -> Self {
        GridCell { text: text.into(), best: false }
    }
}

impl Render for GridCell {
    fn render(&self) -> Markup {
        // Put an interval below its median; next to it, a table with several columns would be wider than a page.
        let (figure, interval) = match self.text.split_once(" [") {
            Some((figure, interval)) => (figure, Some(interval)),
            None => (self.text.as_str(), None),
        };
        html! {
            td {
                @if self.best { strong { (figure) } "*" } @else { (figure) }
                @if let Some(interval) = interval { br; small.quiet { "[" (interval) } }
            }
        }
    }
}

/// Formats tables one below the other; `name` is the prefix of their LaTeX labels.
pub(crate) fn tables(grids: &[Grid], name: &str, format: TableFormat) -> String {
    let one = |(index, grid): (usize, &Grid)| match format {
        TableFormat::Markdown => grid.markdown(),
        TableFormat::Latex => grid.latex(&format!("tab:{name}-{}", index + 1)),
    };
    grids.iter().enumerate().map(one).collect::<Vec<_>>().join("\n")
}

/// Formats rows for the terminal: names left-aligned, cells right-aligned. Columns that do not fit into the line form a
/// further part below, which repeats the names.
pub(crate) fn parts(rows: &[(String, Vec<String>)]) -> Vec<Vec<String>> {
    let width = |text: &str| text.chars().count();
    let name_width = rows.iter().map(|(name, _)| width(name)).max().unwrap_or_default();
    let columns = rows.iter().map(|(_, cells)| cells.len()).max().unwrap_or_default();
    let widest =
        |column: usize| rows.iter().filter_map(|(_, cells)| cells.get(column)).map(|cell: &String| width(cell)).max();
    let widths: Vec<usize> = (0..columns).map(|column| widest(column).unwrap_or_default()).collect();
    let (mut parts, mut used): (Vec<Vec<usize>>, usize) = (vec![Vec::new()], name_width);
    for (column, width) in widths.iter().enumerate() {
        used += 2 + width;
        match parts.last_mut().filter(|part| part.is_empty() || used <= line_width()) {
            Some(part) => part.push(column),
            None => {
                parts.push(vec![column]);
                used = name_width + 2 + width;
            }
        }
    }
    let line = |(name, cells): &(String, Vec<String>), part: &[usize]| {
        let cells = part.iter().filter_map(|column| Some((cells.get(*column)?, widths.get(*column)?)));
        let cells: String = cells.map(|(cell, width)| format!("  {cell:>width$}")).collect();
        format!("{name:<name_width$}{cells}").trim_end().to_owned()
    };
    parts.iter().map(|part| rows.iter().map(|row| line(row, part)).collect()).collect()
}

impl Grid {
    /// Returns the lines for the terminal: names left-aligned, numbers right-aligned, the best with an asterisk. If the
    /// table is too wide, its last columns go below.
    pub(crate) fn lines(&self) -> Vec<String> {
        self.parts().join(&String::new())
    }

    /// Returns the lines of [`Grid::lines`], part by part.
    pub(crate) fn parts(&self) -> Vec<Vec<String>> {
        let marked = |cell: &GridCell| cell.text.clone() + if cell.best { "*" } else { " " };
        let heads: Vec<String> = self.heads.iter().skip(1).map(|head| format!("{head} ")).collect();
        let first = self.heads.first().cloned().unwrap_or_default();
        let rows = self.rows.iter().map(|(name, cells)| (name.clone(), cells.iter().map(marked).collect()));
        parts(&[(first, heads)].into_iter().chain(rows).collect::<Vec<_>>())
    }

    /// Returns the table and its note for an HTML page; the caller adds a heading.
    pub(crate) fn section(&self) -> Markup {
        html! {
            div.scroll { table {
                thead { tr { @for head in &self.heads { th scope="col" { (head) } } } }
                tbody {
                    @for (name, cells) in &self.rows {
                        tr { th scope="row" { (name) } @for cell in cells { (cell) } }
                    }
                }
            } }
            p.quiet { (self.note) }
        }
    }

    fn markdown(&self) -> String {
        // Markdown takes these characters for links, columns and emphasis.
        let escaped = |text: &str| {
            text.chars().fold(String::new(), |mut escaped, c| {
                if matches!(c, '[' | ']' | '|' | '*' | '_' | '<' | '`' | '\\') {
                    escaped.push('\\');
                }
                escaped.push(c);
                escaped
            })
        };
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let heads: Vec<String> = self.heads.iter().map(|head| escaped(head)).collect();
        let mut table = format!("{}.\n\n{}", escaped(&self.caption), line(&heads));
        table += &format!("|---|{}\n", "--:|".repeat(self.heads.len().saturating_sub(1)));
        for (name, cells) in &self.rows {
            let bold = |cell: &GridCell| match (escaped(&cell.text), cell.best) {
                (text, true) => format!("**{text}**"),
                (text, false) => text,
            };
            let cells = [escaped(name)].into_iter().chain(cells.iter().map(bold)).collect::<Vec<_>>();
            table += &line(&cells);
        }
        format!("{table}\n{}\n", escaped(&self.note))
    }

    fn latex(&self, label: &str) -> String {
        let line = |cells: Vec<String>| format!("    {} \\\\\n", cells.join(" & "));
        let columns = "r".repeat(self.heads.len().saturating_sub(1));
        let mut table = String::from("% \\usepackage{booktabs}\n\\begin{table}\n  \\centering\n");
        // Writing to a String cannot fail.
        let _ = write!(table, "  \\caption{{{}.}}\n  \\label{{{label}}}\n", latex(&self.caption));
        let _ = write!(table, "  \\begin{{tabular}}{{l{columns}}}\n    \\toprule\n");
        table += &line(self.heads.iter().map(|head| latex(head)).collect());
        table += "    \\midrule\n";
        for (name, cells) in &self.rows {
            let bold = |cell: &GridCell| match (latex(&cell.text), cell.best) {
                (text, true) => format!("\\textbf{{{text}}}"),
                (text, false) => text,
            };
            table += &line([latex(name)].into_iter().chain(cells.iter().map(bold)).collect());
        }
        let _ = write!(table, "    \\bottomrule\n  \\end{{tabular}}\n\n  \\footnotesize {}\n", latex(&self.note));
        table + "\\end{table}\n"
    }
}

/// Escapes a text for LaTeX: command characters, and characters that pdfLaTeX's fonts lack.
fn latex(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => escaped.extend(['\\', c]),
            '\\' => escaped += "\\textbackslash{}",
            '~' => escaped += "\\textasciitilde{}",
            '^' => escaped += "\\textasciicircum{}",
            '<' | '>' | '|' => escaped.extend(['$', c, '$']),
            // At the beginning of a line, LaTeX would take this for the length of a space.
            '[' | ']' => escaped.extend(['{', c, '}']),
            'ψ' => escaped += "$\\psi$",
            'Δ' => escaped += "$\\Delta$",
            '∞' => escaped += "$\\infty$",
            '−' => escaped += "$-$",
            '±' => escaped += "$\\pm$",
            '₀'..='₉' => {
                let digit = char::from_digit(c as u32 - '₀' as u32, 10).unwrap_or_default();
                escaped.extend(['$', '_', digit, '$']);
            }
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn grid() -> Grid {
        let best = GridCell { text: "1.0 [0.9, 1.1]".into(), best: true };
        Grid {
            caption: "50 % & more of wind_5".into(),
            heads: ["law", "|ΔU₄| [mN]", "p"].map(String::from).to_vec(),
            rows: vec![
                ("AFBC".into(), vec![best, "".into()]),
                ("mine_2 {\\x} <&> ~^".into(), vec!["2.0".into(), "<0.001".into()]),
            ],
            note: "p: #1 of $2".into(),
        }
    }

    /// Removes everything that is escaped; the rest must not contain a command or a column separator.
    fn unescaped(text: &str) -> String {
        let words = ["\\textbackslash{}", "\\textasciitilde{}", "\\textasciicircum{}", "\\textbf", "$\\Delta$", "\\\\"];
        let text = words.iter().fold(text.to_owned(), |text, word| text.replace(word, ""));
        ["\\&", "\\%", "\\$", "\\#", "\\_", "\\{", "\\}"].iter().fold(text, |text, word| text.replace(word, ""))
    }

    #[test]
    fn latex_has_a_figure_for_every_head_and_no_stray_command() {
        let latex = tables(&[grid()], "wind", TableFormat::Latex);
        let body = latex.split_once("\\toprule").unwrap().1.split_once("\\bottomrule").unwrap().0;
        let rows: Vec<&str> = body.lines().filter(|line| line.ends_with("\\\\")).collect();
        assert_eq!(rows.len(), 3);
        for row in &rows {
            let plain = unescaped(row);
            assert_eq!(plain.matches('&').count(), 2, "{row}");
            assert!(!plain.contains(['\\', '#', '%', '~', '^', '_']) || row.contains("$_4$"), "{row}");
            assert_eq!(plain.matches('$').count() % 2, 0, "{row}");
            assert_eq!(plain.matches('{').count(), plain.matches('}').count(), "{row}");
        }
        for environment in ["table", "tabular"] {
            for end in ["begin", "end"] {
                assert_eq!(latex.matches(&format!("\\{end}{{{environment}}}")).count(), 1, "{latex}");
            }
        }
        assert!(latex.contains("\\textbf{1.0 {[}0.9, 1.1{]}}") && latex.contains("\\label{tab:wind-1}"), "{latex}");
        assert!(latex.contains("\\begin{tabular}{lrr}"), "{latex}");
        assert!(latex.is_ascii(), "{latex}");
    }

    #[test]
    fn markdown_has_as_many_columns_in_every_line() {
        let markdown = tables(&[grid()], "wind", TableFormat::Markdown);
        let rows: Vec<String> =
            markdown.lines().filter(|line| line.starts_with('|')).map(|line| line.replace("\\|", "")).collect();
        assert_eq!(rows.len(), 4);
        assert!(rows.iter().all(|row| row.matches('|').count() == 4), "{markdown}");
        assert!(markdown.contains("**1.0 \\[0.9, 1.1\\]**"), "{markdown}");
    }

    #[test]
    fn lines_are_aligned() {
        let lines = grid().lines();
        let column = |line: &str, word: &str| line.split(word).next().unwrap().chars().count() + word.chars().count();
        let [head, best, other] = lines.as_slice() else { unreachable!() };
        assert_eq!(column(head, "[mN]"), column(best, "1.1]"));
        assert_eq!(column(best, "1.1]"), column(other, "2.0"));
        assert!(best.ends_with("1.0 [0.9, 1.1]*"), "{best}");
    }
}
