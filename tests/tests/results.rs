//! docs/results.md says what the code does.
#![allow(clippy::unwrap_used, clippy::expect_used, missing_docs)] // a page that cannot be read must stop the test

use sitl::results;

const PAGE: &str = include_str!("../../docs/results.md");

/// Figures may differ in the last printed digit, and by the 2 % that another host's rounding may do to chatter.
fn agree(page: &str, code: &str) -> bool {
    match (page.parse::<f64>(), code.parse::<f64>()) {
        (Ok(page), Ok(code)) => (page - code).abs() <= 1.5e-4 + 0.02 * code.abs(),
        _ => page == code,
    }
}

#[test]
fn the_results_page_is_what_the_code_does() {
    let (_, page, _) = results::parts(PAGE).expect("both markers");
    let scenarios = results::scenarios().expect("the paper's parameters are in range");
    let code = results::markdown(&results::fly(scenarios, &|| ()).expect("parameters in range"));
    assert_eq!(page.lines().count(), 2 + 9 * 2 * 2, "nine scenarios, two models, two laws");
    assert_eq!(page.lines().count(), code.lines().count());
    for (page, code) in page.lines().zip(code.lines()) {
        let cells = |line: &str| line.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
        let (page, code) = (cells(page), cells(code));
        let same = page.len() == code.len() && page.iter().zip(&code).all(|(page, code)| agree(page, code));
        assert!(same, "run `cargo run --release -- results --write docs/results.md`\npage {page:?}\ncode {code:?}");
    }
}
